"""Linkages that several cases use."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.graph import MechanismGraph


def built(graph: MechanismGraph, joints: Iterable[Any], pose: Iterable[Any] | None = None) -> Mechanism:
    """Mechanism with link 1 driven."""
    from graphsynth.mechanism.laws import Driver
    from graphsynth.mechanism.model import Mechanism

    placed = None if pose is None else tuple((float(x), float(y), float(theta)) for x, y, theta in pose)
    return Mechanism(graph, tuple(joints), (Driver(0, 1),), pose=placed)


def four_bar(crank: float, coupler: float, rocker: float, frame: float) -> Mechanism:
    """Four revolute joints, link 1 driven, the frame's second joint on +x."""
    from graphsynth.mechanism.joints import Revolute
    from graphsynth.structure.graph import MechanismGraph

    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [
        Revolute(0, 1),
        Revolute(1, 2, (crank, 0.0)),
        Revolute(2, 3, (coupler, 0.0), (rocker, 0.0)),
        Revolute(0, 3, (frame, 0.0)),
    ]
    return built(graph, joints)


def exact_four_bar(crank: Any, coupler: Any, rocker: Any, frame: Any, theta: float, branch: int) -> tuple[Any, Any]:
    """Angles of coupler and rocker with 60 digits by the two circles about A and D, for numbers or decimal text."""
    import mpmath as mp

    with mp.workdps(60):
        a, b, c, g, t = (mp.mpf(value) for value in (crank, coupler, rocker, frame, theta))
        A = a * mp.expj(t)
        d = abs(g - A)
        u = (b * b - c * c + d * d) / (2 * d)
        B = A + (g - A) / d * mp.mpc(u, branch * mp.sqrt(b * b - u * u))
        return mp.arg(B - A), mp.arg(B - g)


def wheel() -> Mechanism:
    """One link that turns on the frame."""
    from graphsynth.mechanism.joints import Revolute
    from graphsynth.structure.graph import MechanismGraph

    return built(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1)])


def planet(sun: float, wheel: float) -> Mechanism:
    """Planet wheel, link 2, that rolls round a fixed sun wheel of radius ``sun``; the carrier is link 1."""
    from graphsynth.mechanism.joints import Gear, Revolute
    from graphsynth.structure.graph import MechanismGraph

    graph = MechanismGraph(3, [(0, 1), (1, 2), (0, 2, 2)], frame=0)
    joints = [Revolute(0, 1), Revolute(1, 2, (sun + wheel, 0.0)), Gear(0, 2, radius_a=sun, radius_b=wheel)]
    return built(graph, joints)


def bar(mass: float, length: float) -> Any:
    from graphsynth.dynamics import Body

    return Body.bar(mass, (0.0, 0.0), (length, 0.0))


def crank_rocker(**changes: Any) -> Any:
    """Crank-rocker G1 of theory/planar-dynamics 9."""
    from graphsynth.dynamics import DynamicModel

    bodies = {1: bar(0.2, 0.2), 2: bar(0.6, 0.6), 3: bar(0.4, 0.4)}
    return DynamicModel(four_bar(0.2, 0.6, 0.4, 0.6), **{"bodies": bodies, **changes})


def slider_crank(shift: float | None = None) -> Any:
    """G3 of theory/planar-dynamics 9, with a second guide shifted sideways if asked for."""
    from graphsynth.dynamics import Body, DynamicModel, Spring
    from graphsynth.mechanism.joints import Prismatic, Revolute
    from graphsynth.structure.graph import MechanismGraph

    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [Revolute(0, 1), Revolute(1, 2, (0.1, 0.0)), Revolute(2, 3, (0.3, 0.0)), Prismatic(0, 3, (0.0, 0.02))]
    spring = Spring(0, 3, (0.0, 0.02), stiffness=300.0, free_length=0.35, damping=4.0)
    more = {} if shift is None else {"additional": [Prismatic(0, 3, (0.0, 0.02 + shift))]}
    bodies = {1: bar(0.2, 0.1), 2: bar(0.5, 0.3), 3: Body(0.8, 1e-3)}
    return DynamicModel(built(graph, joints), bodies, [spring], **more)


def flat_four_bar() -> Any:
    from graphsynth.dynamics import DynamicModel

    bodies = {1: bar(1.0, 0.02), 2: bar(1.0, 0.05), 3: bar(1.0, 0.03)}
    return DynamicModel(four_bar(0.02, 0.05, 0.03, 0.06), bodies, gravity=(0.0, 0.0))


def sliding_block(elements: list[Any], gravity: tuple[float, float], **options: Any) -> Any:
    from graphsynth.dynamics.model import Body, DynamicModel
    from graphsynth.mechanism.joints import Prismatic
    from graphsynth.mechanism.laws import Driver
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.graph import MechanismGraph

    centre = options.pop("centre", (0.0, 0.0))
    mechanism = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), (Prismatic(0, 1),), (Driver(0, 1),))
    return DynamicModel(mechanism, {1: Body(1.0, 0.01, centre)}, tuple(elements), gravity, **options)


def exact_ratios(theta: float, branch: int) -> tuple[Any, Any]:
    """Velocity ratios by the textbook formulas with 50 digits, for the decimal lengths."""
    import mpmath as mp

    phi2, phi3 = exact_four_bar("0.02", "0.05", "0.03", "0.06", theta, branch)
    with mp.workdps(60):
        a, b, c, t = mp.mpf("0.02"), mp.mpf("0.05"), mp.mpf("0.03"), mp.mpf(theta)
        k2 = -a * mp.sin(t - phi3) / (b * mp.sin(phi2 - phi3))
        return k2, a * mp.sin(t - phi2) / (c * mp.sin(phi3 - phi2))


def on_three_bars(lean: float) -> Any:
    """Frame, platform, and three bars of length 1 from 0, 1 and 2 at 0.7 rad; the third turned further by ``lean``."""
    from graphsynth.mechanism.joints import Revolute
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.graph import MechanismGraph

    graph = MechanismGraph(5, [(0, 1), (0, 2), (0, 3), (1, 4), (2, 4), (3, 4)], frame=0)
    turns = (0.7, 0.7, 0.7 + lean)
    tips = [complex(k + math.cos(turn), math.sin(turn)) for k, turn in enumerate(turns)]
    joints = [Revolute(0, k + 1, (float(k), 0.0)) for k in range(3)]
    held = [tip - tips[0] for tip in tips]
    joints += [Revolute(k + 1, 4, (1.0, 0.0), (held[k].real, held[k].imag)) for k in range(3)]
    pose = [
        (0.0, 0.0, 0.0),
        *((float(k), 0.0, turn) for k, turn in enumerate(turns)),
        (tips[0].real, tips[0].imag, 0.0),
    ]
    return Mechanism(graph, tuple(joints), (), pose=tuple(pose))
