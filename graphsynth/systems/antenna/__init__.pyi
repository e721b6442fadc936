from .closed_form import (
    Convention as Convention,
)
from .closed_form import CrankAngles as CrankAngles
from .closed_form import (
    ModelComparison as ModelComparison,
)
from .closed_form import PointingModes as PointingModes
from .folds import (
    DeadPoint as DeadPoint,
)
from .folds import (
    Fold as Fold,
)
from .loop_equations import ChartReport as ChartReport
from .loop_equations import (
    LoopSolution as LoopSolution,
)
from .loop_equations import PassiveAngles as PassiveAngles
from .loop_equations import (
    RootSurvey as RootSurvey,
)
from .mechanism import PointingMechanism as PointingMechanism
from .model import (
    Poses as Poses,
)
from .model import (
    PoseStatus as PoseStatus,
)
from .precise import ApproachToFold as ApproachToFold
from .rates import Rates as Rates
from .sweep import PointingSweep as PointingSweep
from .tolerance import Tolerance as Tolerance
