from .closed_form import (
    Convention as Convention,
    CrankAngles as CrankAngles,
    ModelComparison as ModelComparison,
    PointingModes as PointingModes,
)
from .folds import DeadPoint as DeadPoint, Fold as Fold
from .loop_equations import (
    ChartReport as ChartReport,
    LoopSolution as LoopSolution,
    PassiveAngles as PassiveAngles,
    RootSurvey as RootSurvey,
)
from .mechanism import PointingMechanism as PointingMechanism
from .model import Poses as Poses, PoseStatus as PoseStatus
from .precise import ApproachToFold as ApproachToFold
from .rates import Rates as Rates
from .sweep import PointingSweep as PointingSweep
from .tolerance import Tolerance as Tolerance
