from .driven.inertia import EffectiveInertia as EffectiveInertia
from .driven.run import DriveRun as DriveRun
from .elements import (
    Force as Force,
    JointFriction as JointFriction,
    MotorDrive as MotorDrive,
    Pulse as Pulse,
    Spring as Spring,
    Torque as Torque,
    TorqueSource as TorqueSource,
    TorsionSpring as TorsionSpring,
)
from .forms.one_coordinate import effective_inertia as effective_inertia
from .integrate import simulate_dynamics as simulate_dynamics
from .inverse import InverseDynamics as InverseDynamics, inverse_dynamics as inverse_dynamics
from .model import Body as Body, DynamicModel as DynamicModel, Rack as Rack, Rigid as Rigid
from .motors import (
    DCMotor as DCMotor,
    IdealSpeed as IdealSpeed,
    IdealTorque as IdealTorque,
    LinearCharacteristic as LinearCharacteristic,
    SynchronousMotor as SynchronousMotor,
    Train as Train,
)
from .reactions import Reactions as Reactions
from .result import DynamicMotion as DynamicMotion
from .start import StartReport as StartReport, consistent_start as consistent_start
