from .closed_form import (
    Convention as Convention,
    CrankAngles as CrankAngles,
    ModelComparison as ModelComparison,
    PointingModes as PointingModes,
)
from .folds import Fold as Fold
from .loop_equations import (
    ChartReport as ChartReport,
    LoopSolution as LoopSolution,
    PassiveAngles as PassiveAngles,
    RootSurvey as RootSurvey,
)
from .mechanism import PointingMechanism as PointingMechanism
from .model import Poses as Poses, PoseStatus as PoseStatus
from .motion import DeadPoint as DeadPoint, PointingSweep as PointingSweep, Rates as Rates
from .precise import ApproachToFold as ApproachToFold
from .tolerance import Tolerance as Tolerance
