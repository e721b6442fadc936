from .axes import Axis as Axis, from_axes as from_axes, reference as reference
from .model import Seat as Seat, SpaceJoint as SpaceJoint, SpaceModel as SpaceModel
from .pose import PoseProof as PoseProof, prove_pose as prove_pose
from .scale import FactorCertificate as FactorCertificate, largest_scale as largest_scale, least_factor as least_factor
from .sensitivity import compare_sensitivities as compare_sensitivities, direction_map as direction_map
from .turn import certify_in_space as certify_in_space
