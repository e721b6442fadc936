from .boxes import Paving as Paving, PavingProgress as PavingProgress, Status as Status
from .cells import (
    CellPaving as CellPaving,
    CompiledSystem as CompiledSystem,
    compiled_system as compiled_system,
    pave_cells as pave_cells,
    pave_compiled as pave_compiled,
)
from .dual import Dual as Dual, jacobian as jacobian, variables as variables
from .functions import (
    acos as acos,
    asin as asin,
    atan as atan,
    atan2 as atan2,
    cos as cos,
    divide_extended as divide_extended,
    exp as exp,
    hypot as hypot,
    log as log,
    maximum as maximum,
    minimum as minimum,
    pi as pi,
    sin as sin,
    sqr as sqr,
    sqrt as sqrt,
    tan as tan,
)
from .guard import check_rounding as check_rounding
from .interval import Interval as Interval
from .linear import LinearResult as LinearResult, gauss_seidel as gauss_seidel, solve_linear as solve_linear
from .paving import Search as Search, pave as pave
from .proving import Image as Image, KrawczykResult as KrawczykResult, image as image, krawczyk as krawczyk
from .reading import Decoration as Decoration
