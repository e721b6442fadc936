from .api import Embodiment as Embodiment, embody as embody
from .goals import (
    FunctionGoal as FunctionGoal,
    Goals as Goals,
    LineGoal as LineGoal,
    PathGoal as PathGoal,
    PosesGoal as PosesGoal,
)
from .sketch import JointLayout as JointLayout, layout as layout
from .verify import Figures as Figures
