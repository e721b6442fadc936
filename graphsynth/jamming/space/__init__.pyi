from .model import Seat as Seat, SpaceJoint as SpaceJoint, SpaceModel as SpaceModel
from .pose import PoseProof as PoseProof, prove_pose as prove_pose
from .turn import certify_in_space as certify_in_space
