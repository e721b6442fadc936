from .loads import (
    CompressorCycle as CompressorCycle,
    ConstantForce as ConstantForce,
    GivenForce as GivenForce,
    PistonFriction as PistonFriction,
    PistonMasses as PistonMasses,
)
from .machine import PistonLoads as PistonLoads, PistonMachine as PistonMachine
from .model import (
    CrankSlider as CrankSlider,
    DeadCentre as DeadCentre,
    FloatingGroup as FloatingGroup,
    FloatingPiston as FloatingPiston,
    PistonMotion as PistonMotion,
    ScotchYoke as ScotchYoke,
)
from .spaces import (
    LoopSpace as LoopSpace,
    LoopSpaces as LoopSpaces,
    loop_spaces as loop_spaces,
    rotary_assignments as rotary_assignments,
)
from .turn import compare_pistons as compare_pistons, piston_turn as piston_turn
