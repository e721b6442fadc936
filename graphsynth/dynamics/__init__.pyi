from .driven.inertia import EffectiveInertia as EffectiveInertia
from .driven.run import DriveRun as DriveRun
from .elements import (
    Force as Force,
)
from .elements import (
    JointFriction as JointFriction,
)
from .elements import (
    MotorDrive as MotorDrive,
)
from .elements import (
    Pulse as Pulse,
)
from .elements import (
    Spring as Spring,
)
from .elements import (
    Torque as Torque,
)
from .elements import (
    TorqueSource as TorqueSource,
)
from .elements import (
    TorsionSpring as TorsionSpring,
)
from .forms.one_coordinate import effective_inertia as effective_inertia
from .integrate import simulate_dynamics as simulate_dynamics
from .inverse import (
    InverseDynamics as InverseDynamics,
)
from .inverse import (
    inverse_dynamics as inverse_dynamics,
)
from .model import (
    Body as Body,
)
from .model import (
    DynamicModel as DynamicModel,
)
from .model import (
    Rack as Rack,
)
from .model import (
    Rigid as Rigid,
)
from .motors import (
    DCMotor as DCMotor,
)
from .motors import (
    IdealSpeed as IdealSpeed,
)
from .motors import (
    IdealTorque as IdealTorque,
)
from .motors import (
    LinearCharacteristic as LinearCharacteristic,
)
from .motors import (
    SynchronousMotor as SynchronousMotor,
)
from .reactions import Reactions as Reactions
from .result import DynamicMotion as DynamicMotion
from .start import (
    StartReport as StartReport,
)
from .start import (
    consistent_start as consistent_start,
)
from .trains import Train as Train
