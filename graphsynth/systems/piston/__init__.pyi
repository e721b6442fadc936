from .assignments import rotary_assignments as rotary_assignments
from .drives import (
    CrankSlider as CrankSlider,
)
from .drives import (
    ScotchYoke as ScotchYoke,
)
from .gas import (
    CompressorCycle as CompressorCycle,
)
from .gas import (
    ConstantForce as ConstantForce,
)
from .gas import (
    GivenForce as GivenForce,
)
from .group import FloatingGroup as FloatingGroup
from .machine import (
    PistonFriction as PistonFriction,
)
from .machine import (
    PistonMachine as PistonMachine,
)
from .machine import (
    PistonMasses as PistonMasses,
)
from .model import (
    DeadCentre as DeadCentre,
)
from .model import (
    FloatingPiston as FloatingPiston,
)
from .model import (
    PistonMotion as PistonMotion,
)
from .spaces import (
    LoopSpace as LoopSpace,
)
from .spaces import (
    LoopSpaces as LoopSpaces,
)
from .spaces import (
    loop_spaces as loop_spaces,
)
from .turn import (
    compare_pistons as compare_pistons,
)
from .turn import (
    piston_turn as piston_turn,
)
