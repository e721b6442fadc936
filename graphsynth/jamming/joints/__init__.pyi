from .assess import CoupledReport as CoupledReport
from .assess import assess_coupled as assess_coupled
from .certify import (
    TurnCertificate as TurnCertificate,
)
from .certify import (
    certify_coupled as certify_coupled,
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
from .scale import (
    DirectionMap as DirectionMap,
)
from .scale import (
    ScaleCertificate as ScaleCertificate,
)
from .scale import (
    direction_map as direction_map,
)
from .scale import (
    largest_scale as largest_scale,
)
from .search import MemberWitness as MemberWitness
from .sensitivity import (
    LimitSensitivity as LimitSensitivity,
)
from .sensitivity import (
    SensitivityTable as SensitivityTable,
)
from .sensitivity import (
    compare_sensitivities as compare_sensitivities,
)
