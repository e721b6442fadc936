"""Hand-made mechanisms of every kind of joint, moved."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from graphsynth.kinematics import simulate
from graphsynth.mechanism.joints import Cam, Gear, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

TURN = np.linspace(0.0, math.tau, 181)
CYCLE = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)


def four_bar(frame: float, crank: float, coupler: float, rocker: float, **more: Any) -> Mechanism:
    joints = [
        Revolute(0, 1), Revolute(1, 2, (crank, 0.0)), Revolute(2, 3, (coupler, 0.0), (rocker, 0.0)),
        Revolute(0, 3, (frame, 0.0)),
    ]  # fmt: skip
    return Mechanism(CYCLE, joints, [Driver(0, 1)], **more)


def slider_crank() -> Mechanism:
    joints = [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (3.0, 0.0)), Prismatic(0, 3)]
    return Mechanism(CYCLE, joints, [Driver(0, 1)])


def quick_return() -> Mechanism:
    """A block on the crank pin slides along a lever."""
    joints = [Revolute(0, 1, (0.0, 2.0)), Revolute(1, 2, (1.0, 0.0)), Prismatic(3, 2), Revolute(0, 3)]
    return Mechanism(CYCLE, joints, [Driver(0, 1)])


def yoke() -> Mechanism:
    graph = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
    joints = [Revolute(0, 1), Prismatic(0, 2), PinSlot(2, 1, (0.0, 0.0), (1.0, 0.0), math.pi / 2)]
    return Mechanism(graph, joints, [Driver(0, 1)])


def geared() -> Mechanism:
    graph = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4), (1, 4, 2)], frame=0)
    joints = [
        Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (3.0, 0.0), (3.0, 0.0)),
        Revolute(3, 4, (0.0, 0.0), (1.0, 0.0)), Revolute(0, 4, (3.0, 0.0)), Gear(1, 4, radius_a=1.5, radius_b=1.5),
    ]  # fmt: skip
    return Mechanism(graph, joints, [Driver(0, 1)], {"P": (2, (3.0, 0.0))})


def planet() -> Mechanism:
    """A wheel of radius 1 rolls inside a fixed ring of radius 3: its rim point draws a deltoid."""
    graph = MechanismGraph(3, [(0, 1), (1, 2), (0, 2, 2)], frame=0)
    joints = [Revolute(0, 1), Revolute(1, 2, (2.0, 0.0)), Gear(0, 2, radius_a=3.0, radius_b=1.0, internal=True)]
    return Mechanism(graph, joints, [Driver(0, 1)], {"K": (2, (1.0, 0.0))})


def cam() -> Mechanism:
    """A disk cam lifts a roller on a slider."""
    graph = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
    up = math.pi / 2
    profile = Cam(1, 2, radius=1.5, harmonics=((0.4, 0.0), (0.2, 0.1)))
    joints = [Revolute(0, 1), Prismatic(0, 2, angle_a=up, angle_b=up), profile]
    return Mechanism(graph, joints, [Driver(0, 1)], {"F": (2, (0.0, 1.2))})


def cylinder() -> Mechanism:
    """A boom moved by a cylinder: the driven sliding pair moves itself."""
    graph = MechanismGraph(4, [(0, 1), (0, 2), (1, 3), (2, 3)], frame=0)
    joints = [Revolute(0, 1), Revolute(0, 2, (2.0, 0.0)), Revolute(1, 3, (2.5, 0.0)), Prismatic(2, 3)]
    return Mechanism(graph, joints, [Driver(2, 3)], {"T": (1, (4.0, 0.6))})


def ladder(stages: int) -> Mechanism:
    """Four-bars in series: 2 + 2 stages links."""
    pairs, joints = [(0, 1)], [Revolute(0, 1)]
    rocker, pin, at = 1, (1.0, 0.0), 0.0
    for _ in range(stages):
        coupler, after = rocker + 1, rocker + 2
        at += 3.0
        pairs += [(rocker, coupler), (coupler, after), (0, after)]
        joints += [
            Revolute(rocker, coupler, pin), Revolute(coupler, after, (3.0, 0.0), (2.2, 0.0)),
            Revolute(0, after, (at, 0.0)),
        ]  # fmt: skip
        rocker, pin = after, (0.8, -0.6)
    return Mechanism(
        MechanismGraph(rocker + 1, pairs, frame=0), joints, [Driver(0, 1)], {"Q": (rocker - 1, (1.0, 1.0))}
    )


MOTIONS = {
    "lambda": lambda: simulate(four_bar(2, 1, 2.5, 2.5, points={"M": (2, (5.0, 0.0))}), TURN, modes={0: 1}),
    "stops": lambda: simulate(four_bar(2, 1, 1, 1, points={"M": (2, (0.5, 0.5))}), TURN),
    "slider crank": lambda: simulate(slider_crank(), TURN, modes={0: 1}),
    "quick return": lambda: simulate(quick_return(), TURN),
    "yoke": lambda: simulate(yoke(), TURN),
    "geared": lambda: simulate(geared(), TURN),
    "planet": lambda: simulate(planet(), TURN),
    "cam": lambda: simulate(cam(), TURN, start=[(0, 0, 0), (0, 0, 0), (0, 1.7, 0)]),
    "cylinder": lambda: simulate(cylinder(), np.linspace(1.2, 3.4, 45)),
    "ladder": lambda: simulate(ladder(4), np.linspace(0.0, math.tau, 361), modes=dict.fromkeys(range(4), 1)),
}


@pytest.fixture(scope="session")
def motions() -> dict[str, Any]:
    return {name: make() for name, make in MOTIONS.items()}


@pytest.fixture(params=sorted(MOTIONS))
def motion(request: pytest.FixtureRequest, motions: dict[str, Any]) -> Any:
    return motions[request.param]
