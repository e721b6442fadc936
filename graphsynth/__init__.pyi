__version__: str

from .atlas.catalogue import Catalogue as Catalogue
from .core.angles import degrees as degrees
from .core.errors import GraphsynthError as GraphsynthError
from .dynamics.elements import (
    Force as Force,
)
from .dynamics.elements import (
    Torque as Torque,
)
from .intervals.interval import Interval as Interval
from .intervals.paving import pave as pave
from .intervals.proving import krawczyk as krawczyk
from .intervals.status import Status as Status
from .jamming.assess import (
    JammingReport as JammingReport,
)
from .jamming.assess import (
    assess_jamming as assess_jamming,
)
from .jamming.joints.limits import (
    JointLimits as JointLimits,
)
from .jamming.joints.limits import (
    Misalignment as Misalignment,
)
from .kinematics.certify.poses import certify as certify
from .kinematics.dimensional.api import embody as embody
from .kinematics.dimensional.goals import (
    FunctionGoal as FunctionGoal,
)
from .kinematics.dimensional.goals import (
    Goals as Goals,
)
from .kinematics.dimensional.goals import (
    LineGoal as LineGoal,
)
from .kinematics.dimensional.goals import (
    PathGoal as PathGoal,
)
from .kinematics.dimensional.goals import (
    PosesGoal as PosesGoal,
)
from .kinematics.simulation import (
    simulate as simulate,
)
from .kinematics.simulation import (
    simulate_batch as simulate_batch,
)
from .mechanism import gallery as gallery
from .mechanism.four_bar import TiltedFourBar as TiltedFourBar
from .mechanism.joints import (
    Cam as Cam,
)
from .mechanism.joints import (
    Gear as Gear,
)
from .mechanism.joints import (
    PinSlot as PinSlot,
)
from .mechanism.joints import (
    Prismatic as Prismatic,
)
from .mechanism.joints import (
    Revolute as Revolute,
)
from .mechanism.model import (
    Driver as Driver,
)
from .mechanism.model import (
    Mechanism as Mechanism,
)
from .pipeline.runner import run as run
from .structure.graph import (
    Joint as Joint,
)
from .structure.graph import (
    MechanismGraph as MechanismGraph,
)
from .structure.system.spec import (
    LinkAssortment as LinkAssortment,
)
from .structure.system.spec import (
    StructuralSpec as StructuralSpec,
)
from .synthesis.api import (
    count_assur_groups as count_assur_groups,
)
from .synthesis.api import (
    count_baranov_trusses as count_baranov_trusses,
)
from .synthesis.api import (
    count_chains as count_chains,
)
from .synthesis.api import (
    count_mechanisms as count_mechanisms,
)
from .synthesis.api import (
    enumerate_assur_groups as enumerate_assur_groups,
)
from .synthesis.api import (
    enumerate_baranov_trusses as enumerate_baranov_trusses,
)
from .synthesis.api import (
    enumerate_chains as enumerate_chains,
)
from .synthesis.api import (
    enumerate_mechanisms as enumerate_mechanisms,
)
from .synthesis.api import (
    sample_mechanisms as sample_mechanisms,
)
from .systems.antenna.mechanism import PointingMechanism as PointingMechanism
from .systems.lambda_linkage.model import LambdaLinkage as LambdaLinkage
from .systems.piston.machine import PistonMachine as PistonMachine
from .systems.piston.model import FloatingPiston as FloatingPiston
from .systems.platform.parallel_platform import ParallelPlatform as ParallelPlatform
from .systems.platform.single_motor_platform import SingleMotorPlatform as SingleMotorPlatform
