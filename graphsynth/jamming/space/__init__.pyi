from .model import Seat as Seat, SpaceJoint as SpaceJoint, SpaceModel as SpaceModel
