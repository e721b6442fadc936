"""Small mechanisms with every kind of joint and load, each with its start."""

import math

from dynamic_models import bar, g1, g3

from graphsynth.dynamics import (
    Body,
    DynamicModel,
    Force,
    Rigid,
    Spring,
    Torque,
    TorqueSource,
    TorsionSpring,
    consistent_start,
)
from graphsynth.mechanism.joints import Gear, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

LOOP = [(0, 1), (1, 2), (2, 3), (0, 3)]


def reversed_slider_crank():
    """G3 with every joint named the other way round: the line belongs to the slider."""
    joints = [Revolute(1, 0), Revolute(2, 1, (0.0, 0.0), (0.1, 0.0)), Revolute(3, 2, (0.0, 0.0), (0.3, 0.0)),
              Prismatic(3, 0, (0.0, 0.0), (0.0, 0.02))]  # fmt: skip
    model = g3()
    mechanism = Mechanism(MechanismGraph(4, LOOP, frame=0), joints, [Driver(0, 1)], pose=start_g3().poses.tolist())
    model = DynamicModel(mechanism, model.bodies, model.elements)
    return model, consistent_start(model, keep={(0, 1): 0.5}, keep_rates={(0, 1): 15.0})


def start_g3():
    return consistent_start(g3(), modes={0: 1}, keep={(0, 1): 0.5}, keep_rates={(0, 1): 15.0})


def yoke(slot_on_crank=False):
    """Scotch yoke, or its inversion with the slot in the crank; slides tilted by 0.3 rad."""
    graph = MechanismGraph(3, [(0, 1, 1), (1, 2, 2), (0, 2, 1)], frame=0)
    slot = PinSlot(1, 2, (0.0, 0.01), (0.0, 0.0), 0.2) if slot_on_crank else PinSlot(2, 1, (0.0, 0.0), (0.1, 0.0), 1.4)
    guide = Prismatic(0, 2, (0.02, 0.15) if slot_on_crank else (0.02, 0.03), (0.0, 0.0), 0.3, 0.1)
    mechanism = Mechanism(graph, [Revolute(0, 1), slot, guide], [Driver(0, 1)])
    bodies = {1: bar(0.2, 0.1), 2: Body(0.5, 1e-3, (0.02, 0.01))}
    elements = [
        TorsionSpring(0, 1, 0.4, -1.7, 0.01), Force(2, (1.0, -0.5), (0.03, 0.0)),
        Force(1, (0.3, 0.9), (0.05, 0.02), "body"),
        TorqueSource(0, 1, 0.02, ratio=3.0, rotor_inertia=5e-5, rotor_damping=1e-4),
    ]  # fmt: skip
    model = DynamicModel(mechanism, bodies, elements)
    pose = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.2], [0.0, 0.1, 0.2]]
    return model, consistent_start(model, pose=pose, keep={(0, 1): 1.2}, keep_rates={(0, 1): 4.0})


def trammel():
    """Two sliding pairs on the frame and a bar between them."""
    joints = [Prismatic(0, 1), Revolute(1, 2), Revolute(2, 3, (0.5, 0.0)), Prismatic(0, 3, angle_a=1.5, angle_b=1.5)]
    mechanism = Mechanism(MechanismGraph(4, LOOP, frame=0), joints, [Driver(0, 1)])
    elements = [Spring(1, 3, (0.0, -0.1), (0.1, 0.0), 40.0, 0.2, 0.5), Torque(1, 2, 0.1)]
    model = DynamicModel(mechanism, {1: Body(0.3, 1e-3), 2: bar(0.4, 0.5), 3: Body(0.2, 1e-3, (0.01, 0.0))}, elements)
    pose = [[0.0] * 3, [0.3, 0.0, 0.0], [0.3, 0.0, 2.1], [0.03, 0.4, 0.0]]
    return model, consistent_start(model, pose=pose, keep={(0, 1): 0.3})


def gear_pair(torque=0.7):
    """Two wheels on the frame: radii 0.1 and 0.25 m, inertias 0.02 and 0.3 kg m^2."""
    graph = MechanismGraph(3, [(0, 1, 1), (0, 2, 1), (1, 2, 2)], frame=0)
    joints = [Revolute(0, 1), Revolute(0, 2, (0.35, 0.0)), Gear(1, 2, radius_a=0.1, radius_b=0.25)]
    mechanism = Mechanism(graph, joints, [Driver(0, 1)])
    model = DynamicModel(mechanism, {1: Body(1.0, 0.02), 2: Body(2.0, 0.3)}, [Torque(0, 1, torque)], gravity=(0.0, 0.0))
    return model, consistent_start(model, keep={(0, 1): 0.0})


def planet():
    """Sun 1, carrier 2, planet 3, ring fixed: radii 0.1, 0.05, 0.2 m."""
    graph = MechanismGraph(4, [(0, 1, 1), (0, 2, 1), (2, 3, 1), (1, 3, 2), (0, 3, 2)], frame=0)
    joints = [
        Revolute(0, 1), Revolute(0, 2), Revolute(2, 3, (0.15, 0.0)), Gear(1, 3, radius_a=0.1, radius_b=0.05),
        Gear(0, 3, radius_a=0.2, radius_b=0.05, internal=True),
    ]  # fmt: skip
    mechanism = Mechanism(graph, joints, [Driver(0, 1)])
    bodies = {1: Body(1.0, 0.01), 2: Body(0.5, 0.02), 3: Body(0.3, 0.001)}
    model = DynamicModel(mechanism, bodies, [Torque(0, 1, 0.2)], gravity=(0.0, 0.0))
    pose = [[0.0] * 3, [0.0] * 3, [0.0] * 3, [0.15, 0.0, 0.0]]
    return model, consistent_start(model, pose=pose, keep={(0, 1): 0.0})


def wedges():
    """Three sliding pairs in a loop: a wedge drives another one; the masses fall along the guides."""
    graph = MechanismGraph(3, [(0, 1), (1, 2), (0, 2)], frame=0)
    joints = [Prismatic(0, 1), Prismatic(1, 2, angle_a=0.4, angle_b=0.4), Prismatic(0, 2, angle_a=math.pi / 2,
              angle_b=math.pi / 2)]  # fmt: skip
    mechanism = Mechanism(graph, joints, [Driver(0, 1)])
    model = DynamicModel(mechanism, {1: Body(1.0, 0.01), 2: Body(2.0, 0.02)})
    return model, consistent_start(model, pose=[[0.0] * 3] * 3, keep={(0, 1): 0.0})


def two_guides():
    """G3 with a second guide collinear with the first: two redundant rows."""
    extra = Prismatic(0, 3, (0.0, 0.02), (0.1, 0.0))
    model = g3(additional=[extra])
    return model, consistent_start(model, pose=start_g3().poses, keep={(0, 1): 0.5}, keep_rates={(0, 1): 15.0})


def double_pendulum(*additional, pose, rate=2.0):
    """Two bars, with constraints beyond the joints."""
    graph = MechanismGraph(3, [(0, 1), (1, 2)], frame=0)
    mechanism = Mechanism(graph, [Revolute(0, 1), Revolute(1, 2, (0.2, 0.0))], [Driver(0, 1)])
    model = DynamicModel(mechanism, {1: bar(0.2, 0.2), 2: bar(0.6, 0.6)}, additional=additional)
    keep = {(0, 1): pose[1][2]}
    return model, consistent_start(model, pose=pose, keep=keep, keep_rates={(0, 1): rate})


def welded():
    """Both bars fixed to each other at 0.5 rad: one pendulum."""
    c, s = 0.2 * math.cos(0.3), 0.2 * math.sin(0.3)
    weld = Rigid(1, 2, (0.2, 0.0), (0.0, 0.0), 0.5, 0.0)
    return double_pendulum(weld, pose=[[0.0] * 3, [0.0, 0.0, 0.3], [c, s, 0.8]])


def tip_in_a_slot():
    """The double pendulum with its tip in a slot of the frame."""
    c, s = 0.2 * math.cos(0.3), 0.2 * math.sin(0.3)
    slot = PinSlot(0, 2, (0.0, 0.1), (0.6, 0.0))
    return double_pendulum(slot, pose=[[0.0] * 3, [0.0, 0.0, 0.3], [c, s, 0.07]])


def doubled_pin():
    """G1 with one of its pins stated twice."""
    model = g1(additional=[Revolute(2, 3, (0.6, 0.0), (0.4, 0.0))])
    pose = consistent_start(g1(), modes={0: 1}, keep={(0, 1): 0.0}).poses
    return model, consistent_start(model, pose=pose, keep={(0, 1): 0.0}, keep_rates={(0, 1): 10.0})
