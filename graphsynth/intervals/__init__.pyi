from .boxes import (
    Paving as Paving,
)
from .boxes import (
    Progress as Progress,
)
from .cells import (
    CellPaving as CellPaving,
)
from .cells import (
    pave_cells as pave_cells,
)
from .compiled import (
    compiled_system as compiled_system,
)
from .compiled import (
    pave_compiled as pave_compiled,
)
from .dual import (
    Dual as Dual,
)
from .dual import (
    jacobian as jacobian,
)
from .dual import (
    variables as variables,
)
from .functions import (
    acos as acos,
)
from .functions import (
    asin as asin,
)
from .functions import (
    atan as atan,
)
from .functions import (
    atan2 as atan2,
)
from .functions import (
    cos as cos,
)
from .functions import (
    divide_extended as divide_extended,
)
from .functions import (
    exp as exp,
)
from .functions import (
    hypot as hypot,
)
from .functions import (
    log as log,
)
from .functions import (
    maximum as maximum,
)
from .functions import (
    minimum as minimum,
)
from .functions import (
    pi as pi,
)
from .functions import (
    sin as sin,
)
from .functions import (
    sqr as sqr,
)
from .functions import (
    sqrt as sqrt,
)
from .functions import (
    tan as tan,
)
from .guard import check_rounding as check_rounding
from .interval import (
    Decoration as Decoration,
)
from .interval import (
    Interval as Interval,
)
from .linear import (
    LinearResult as LinearResult,
)
from .linear import (
    gauss_seidel as gauss_seidel,
)
from .linear import (
    solve_linear as solve_linear,
)
from .paving import (
    Search as Search,
)
from .paving import (
    pave as pave,
)
from .proving import (
    Image as Image,
)
from .proving import (
    KrawczykResult as KrawczykResult,
)
from .proving import (
    image as image,
)
from .proving import (
    krawczyk as krawczyk,
)
from .status import Status as Status
