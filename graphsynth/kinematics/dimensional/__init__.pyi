from .api import (
    Embodiment as Embodiment,
)
from .api import (
    embody as embody,
)
from .goals import (
    FunctionGoal as FunctionGoal,
)
from .goals import (
    Goals as Goals,
)
from .goals import (
    LineGoal as LineGoal,
)
from .goals import (
    PathGoal as PathGoal,
)
from .goals import (
    PosesGoal as PosesGoal,
)
from .sketch import (
    JointLayout as JointLayout,
)
from .sketch import (
    layout as layout,
)
from .verify import Figures as Figures
