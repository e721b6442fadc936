__version__: str

from .atlas.catalogue import Catalogue as Catalogue
from .atlas.dataset import Dataset as Dataset, dataset as dataset
from .core.angles import degrees as degrees
from .core.errors import GraphsynthError as GraphsynthError
from .design.parts.api import parts as parts
from .design.parts.plan import PartSizes as PartSizes
from .design.parts.result import Parts as Parts
from .drawing.methods import Drawing as Drawing
from .drawing.plots import Chart as Chart
from .dynamics.elements import Force as Force, Torque as Torque
from .dynamics.inverse import StaticForces as StaticForces
from .intervals.boxes import Status as Status
from .intervals.interval import Interval as Interval
from .intervals.paving import pave as pave
from .intervals.proving import krawczyk as krawczyk
from .jamming.assess import JammingReport as JammingReport, assess_jamming as assess_jamming
from .jamming.bearing.fits import Fit as Fit
from .jamming.binding.parts import (
    ContactFriction as ContactFriction,
    JointStiffness as JointStiffness,
    LinkSection as LinkSection,
)
from .jamming.binding.report import BindingReport as BindingReport
from .jamming.binding.torque import binding_torque as binding_torque
from .jamming.chance.allocation import Grade as Grade, allocate_tolerances as allocate_tolerances
from .jamming.chance.distributions import Distribution as Distribution
from .jamming.chance.probability import (
    JammingProbability as JammingProbability,
    probability_of_jamming as probability_of_jamming,
)
from .jamming.joints.assess import CoupledReport as CoupledReport
from .jamming.joints.limits import JointLimits as JointLimits, Misalignment as Misalignment
from .kinematics.certify.poses import certify as certify
from .kinematics.dimensional.api import embody as embody
from .kinematics.dimensional.goals import (
    FunctionGoal as FunctionGoal,
    Goals as Goals,
    LineGoal as LineGoal,
    PathGoal as PathGoal,
    PosesGoal as PosesGoal,
)
from .kinematics.engine.batch import simulate_batch as simulate_batch
from .kinematics.engine.result import Motion as Motion
from .kinematics.engine.start import AssemblyMode as AssemblyMode
from .kinematics.simulation import simulate as simulate
from .mechanism import gallery as gallery
from .mechanism.four_bar import TiltedFourBar as TiltedFourBar
from .mechanism.joints import Cam as Cam, Gear as Gear, PinSlot as PinSlot, Prismatic as Prismatic, Revolute as Revolute
from .mechanism.laws import Driver as Driver
from .mechanism.model import Mechanism as Mechanism
from .pipeline.runner import run as run
from .structure.gear_trains import PlanetaryGearTrain as PlanetaryGearTrain
from .structure.graph import Joint as Joint, MechanismGraph as MechanismGraph
from .structure.modes import (
    count_assembly_modes as count_assembly_modes,
    coupler_curve_degree as coupler_curve_degree,
    coupler_curve_genus as coupler_curve_genus,
)
from .structure.multiple_joints import MultipleJointChain as MultipleJointChain
from .structure.slider_chains import SliderChain as SliderChain
from .structure.system.assortment import LinkAssortment as LinkAssortment
from .structure.system.spec import StructuralSpec as StructuralSpec
from .synthesis.api import (
    count_assur_groups as count_assur_groups,
    count_baranov_trusses as count_baranov_trusses,
    count_chains as count_chains,
    count_mechanisms as count_mechanisms,
    enumerate_assur_groups as enumerate_assur_groups,
    enumerate_baranov_trusses as enumerate_baranov_trusses,
    enumerate_chains as enumerate_chains,
    enumerate_mechanisms as enumerate_mechanisms,
    sample_chains as sample_chains,
    sample_mechanisms as sample_mechanisms,
)
from .synthesis.gear_trains import (
    count_planetary_gear_trains as count_planetary_gear_trains,
    enumerate_planetary_gear_trains as enumerate_planetary_gear_trains,
    sample_planetary_gear_trains as sample_planetary_gear_trains,
)
from .synthesis.multiple_joints import (
    count_multiple_joint_chains as count_multiple_joint_chains,
    enumerate_multiple_joint_chains as enumerate_multiple_joint_chains,
    sample_multiple_joint_chains as sample_multiple_joint_chains,
)
from .synthesis.sliders import (
    count_slider_chains as count_slider_chains,
    enumerate_slider_chains as enumerate_slider_chains,
    sample_slider_chains as sample_slider_chains,
)
from .synthesis.wishes import Wishes as Wishes
from .systems.antenna.mechanism import PointingMechanism as PointingMechanism
from .systems.lambda_linkage.model import LambdaLinkage as LambdaLinkage
from .systems.piston.machine import PistonMachine as PistonMachine
from .systems.piston.model import FloatingPiston as FloatingPiston
from .systems.platform.parallel_platform import ParallelPlatform as ParallelPlatform
from .systems.platform.single_motor_platform import SingleMotorPlatform as SingleMotorPlatform
from .workbench.opening import OpenedWorkbench as OpenedWorkbench
