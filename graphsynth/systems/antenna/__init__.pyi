from .approach import ApproachToFold as ApproachToFold
from .charts import ChartReport as ChartReport
from .comparison import (
    ModelComparison as ModelComparison,
)
from .comparison import (
    Reading as Reading,
)
from .cranks import CrankAngles as CrankAngles
from .folds import (
    DeadPoint as DeadPoint,
)
from .folds import (
    Fold as Fold,
)
from .mechanism import PointingMechanism as PointingMechanism
from .modes import AssemblyModes as AssemblyModes
from .newton import (
    LoopSolution as LoopSolution,
)
from .newton import (
    RootSurvey as RootSurvey,
)
from .passive import PassiveAngles as PassiveAngles
from .rates import Rates as Rates
from .results import (
    Poses as Poses,
)
from .results import (
    PoseStatus as PoseStatus,
)
from .sweep import PointingSweep as PointingSweep
from .tolerance import Tolerance as Tolerance
