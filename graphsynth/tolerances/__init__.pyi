from .box import LinkPoint as LinkPoint, ParameterBox as ParameterBox
from .iso286 import (
    LimitDeviations as LimitDeviations,
    limit_deviations as limit_deviations,
    standard_tolerance as standard_tolerance,
)
from .parts import (
    AxisAngle as AxisAngle,
    EndFloat as EndFloat,
    FitClearance as FitClearance,
    HolePosition as HolePosition,
    LengthTolerance as LengthTolerance,
    Parallelism as Parallelism,
    PartTolerance as PartTolerance,
    ThermalExpansion as ThermalExpansion,
    parameter_box as parameter_box,
)
