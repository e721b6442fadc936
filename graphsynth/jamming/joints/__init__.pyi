from .assess import CoupledReport as CoupledReport, assess_coupled as assess_coupled
from .certify import TurnCertificate as TurnCertificate, certify_coupled as certify_coupled
from .limits import (
    FREE as FREE,
    RIGID as RIGID,
    SPHERICAL as SPHERICAL,
    JointLimits as JointLimits,
    Misalignment as Misalignment,
    SlideLimits as SlideLimits,
    bearing_limits as bearing_limits,
)
from .scale import (
    DirectionMap as DirectionMap,
    LimitSensitivity as LimitSensitivity,
    ScaleCertificate as ScaleCertificate,
    SensitivityTable as SensitivityTable,
    compare_sensitivities as compare_sensitivities,
    direction_map as direction_map,
    largest_scale as largest_scale,
)
from .search import MemberWitness as MemberWitness
