from .assignments import rotary_assignments as rotary_assignments
from .drives import CrankSlider as CrankSlider, ScotchYoke as ScotchYoke
from .gas import CompressorCycle as CompressorCycle, ConstantForce as ConstantForce, GivenForce as GivenForce
from .group import FloatingGroup as FloatingGroup
from .loads import PistonFriction as PistonFriction, PistonMasses as PistonMasses
from .machine import PistonMachine as PistonMachine
from .model import DeadCentre as DeadCentre, FloatingPiston as FloatingPiston, PistonMotion as PistonMotion
from .spaces import LoopSpace as LoopSpace, LoopSpaces as LoopSpaces, loop_spaces as loop_spaces
from .turn import compare_pistons as compare_pistons, piston_turn as piston_turn
