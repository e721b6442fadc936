from .assess import assess_coupled as assess_coupled
from .directions import (
    DirectionMap as DirectionMap,
)
from .directions import (
    direction_map as direction_map,
)
from .limits import (
    FREE as FREE,
)
from .limits import (
    RIGID as RIGID,
)
from .limits import (
    SPHERICAL as SPHERICAL,
)
from .limits import (
    JointLimits as JointLimits,
)
from .limits import (
    Misalignment as Misalignment,
)
from .limits import (
    SlideLimits as SlideLimits,
)
from .limits import (
    bearing_limits as bearing_limits,
)
from .loosening import (
    Loosened as Loosened,
)
from .loosening import (
    LooseningTable as LooseningTable,
)
from .loosening import (
    compare_loosening as compare_loosening,
)
from .report import CoupledReport as CoupledReport
from .scale import (
    ScaleCertificate as ScaleCertificate,
)
from .scale import (
    largest_scale as largest_scale,
)
from .turn import (
    TurnCertificate as TurnCertificate,
)
from .turn import (
    certify_coupled as certify_coupled,
)
from .witness import Witness as Witness
