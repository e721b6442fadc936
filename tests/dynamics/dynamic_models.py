"""Mechanisms of the reference problems of theory/planar-dynamics 9 and others, for the tests of planar dynamics."""

from __future__ import annotations

import math

from graphsynth.dynamics import Body, DynamicModel, Force, Spring, Torque, TorsionSpring
from graphsynth.mechanism.joints import Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph


def bar(mass, length):
    return Body.bar(mass, (0.0, 0.0), (length, 0.0))


def four_bar(a, b, c, g):
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [Revolute(0, 1), Revolute(1, 2, (a, 0.0)), Revolute(2, 3, (b, 0.0), (c, 0.0)), Revolute(0, 3, (g, 0.0))]
    return Mechanism(graph, joints, [Driver(0, 1)])


def g1(**changes):
    bodies = {1: bar(0.2, 0.2), 2: bar(0.6, 0.6), 3: bar(0.4, 0.4)}
    return DynamicModel(four_bar(0.2, 0.6, 0.4, 0.6), **{"bodies": bodies, **changes})


def g2():
    return g1(elements=[
        Torque(0, 1, 0.5), TorsionSpring(0, 3, damping=0.05), Spring(0, 2, (0.3, 0.5), (0.3, 0.0), 50.0, 0.3),
    ])  # fmt: skip


def slider_crank(crank=0.1, rod=0.3, offset=0.02):
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [Revolute(0, 1), Revolute(1, 2, (crank, 0.0)), Revolute(2, 3, (rod, 0.0)), Prismatic(0, 3, (0.0, offset))]
    return Mechanism(graph, joints, [Driver(0, 1)])


def g3(**changes):
    bodies = {1: bar(0.2, 0.1), 2: bar(0.5, 0.3), 3: Body(0.8, 1e-3)}
    spring = Spring(0, 3, (0.0, 0.02), stiffness=300.0, free_length=0.35, damping=4.0)
    return DynamicModel(slider_crank(), **{"bodies": bodies, "elements": [spring], **changes})


def seven_body():
    """Andrews' squeezer: seven bodies, three loops; data of the test set for initial value problem solvers."""
    d, da, e, ea, rr, ra = 28e-3, 115e-4, 2e-2, 1421e-5, 7e-3, 92e-5
    ss, sa, sb, sc, sd = 35e-3, 1874e-5, 1043e-5, 18e-3, 2e-2
    ta, tb, u, ua, ub, zf, zt, fa = 2308e-5, 916e-5, 4e-2, 1228e-5, 449e-5, 2e-2, 4e-2, 1421e-5
    A, B, C = (-0.06934, -0.00227), (-0.03635, 0.03273), (0.014, 0.072)
    graph = MechanismGraph(8, [(0, 1), (1, 2), (2, 3), (0, 3), (2, 4), (4, 5), (0, 5), (2, 6), (6, 7), (0, 7)], frame=0)
    tip = (-d, 0.0)  # of link 2, where links 3, 4 and 6 meet
    joints = [
        Revolute(0, 1), Revolute(1, 2, (rr, 0.0)), Revolute(2, 3, tip, (0.0, -ss)), Revolute(0, 3, B),
        Revolute(2, 4, tip, (0.0, -e)), Revolute(4, 5, (0.0, 0.0), (zt, 0.0)), Revolute(0, 5, A),
        Revolute(2, 6, tip, (zf, 0.0)), Revolute(6, 7, (0.0, 0.0), (0.0, -u)), Revolute(0, 7, A),
    ]  # fmt: skip
    mechanism = Mechanism(graph, joints, [Driver(0, 1)])
    bodies = {
        1: Body(0.04325, 2.194e-6, (ra, 0.0)), 2: Body(0.00365, 4.410e-7, (-da, 0.0)),
        3: Body(0.02373, 5.255e-6, (sb, -sa)), 4: Body(0.00706, 5.667e-7, (0.0, -(e - ea))),
        5: Body(0.07050, 1.169e-5, (ta, tb)), 6: Body(0.00706, 5.667e-7, (zf - fa, 0.0)),
        7: Body(0.05498, 1.912e-5, (-ub, -ua)),
    }  # fmt: skip
    elements = [Torque(0, 1, 0.033), Spring(0, 3, C, (sd, -sc), 4530.0, 0.07785)]
    return DynamicModel(mechanism, bodies, elements, gravity=(0.0, 0.0))


SEVEN_START = {
    "beta": -0.0617138900142764496358948458001, "gamma": 0.455279819163070380255912382449,
    "phi": 0.222668390165885884674473185609, "delta": 0.487364979543842550225598953530,
    "omega": -0.222668390165885884674473185609, "epsilon": 1.23054744454982119249735015568,
}  # fmt: skip


def seven_pose():
    """Return poses of the squeezer at its published start angles."""
    s = SEVEN_START
    angles = [0.0, s["beta"], s["beta"], s["gamma"], s["phi"] + s["delta"], s["delta"], s["omega"] + s["epsilon"],
              s["epsilon"]]  # fmt: skip
    pose = [[0.0, 0.0, angle] for angle in angles]
    A, B = (-0.06934, -0.00227), (-0.03635, 0.03273)
    pose[2][:2] = [7e-3 * math.cos(s["beta"]), 7e-3 * math.sin(s["beta"])]
    pose[3][:2], pose[5][:2], pose[7][:2] = list(B), list(A), list(A)
    pose[4][:2] = [A[0] + 4e-2 * math.cos(s["delta"]), A[1] + 4e-2 * math.sin(s["delta"])]
    pose[6][:2] = [A[0] + 4e-2 * math.sin(s["epsilon"]), A[1] - 4e-2 * math.cos(s["epsilon"])]
    return pose


def braider(load=True):
    """Four-bar of the braiding mechanism (theory/braider), rocker and switch one body, thread force at the switch."""
    a, b, c, g, r, delta = 0.020, 0.060, 0.040, 0.060, 0.035, math.radians(150.0)
    tip = (r * math.cos(delta), r * math.sin(delta))

    def thread(t, place, velocity):
        dx, dy = 0.060 - place[0], -place[1]
        far = math.sqrt(dx * dx + dy * dy + 0.080**2)
        return 0.005 * 9.80665 * dx / far, 0.005 * 9.80665 * dy / far

    bodies = {
        1: bar(0.015, a), 2: bar(0.045, b),
        3: Body.combined(bar(0.030, c), Body.bar(0.020, (0.0, 0.0), tip)),
    }  # fmt: skip
    elements = [Force(3, thread, tip)] if load else []
    return DynamicModel(four_bar(a, b, c, g), bodies, elements, gravity=(0.0, 0.0))
