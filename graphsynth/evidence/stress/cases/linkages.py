"""Linkages that several cases use."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.graph import MechanismGraph

__all__ = ["built", "exact_four_bar", "four_bar", "planet", "wheel"]


def built(graph: MechanismGraph, joints: Iterable[Any], pose: Iterable[Any] | None = None) -> Mechanism:
    """Mechanism with link 1 driven."""
    from graphsynth.mechanism.model import Driver, Mechanism

    placed = None if pose is None else tuple((float(x), float(y), float(theta)) for x, y, theta in pose)
    return Mechanism(graph, tuple(joints), (Driver(0, 1),), pose=placed)


def four_bar(crank: float, coupler: float, rocker: float, frame: float) -> Mechanism:
    """Four turning pairs, link 1 driven, the frame's second joint on +x."""
    from graphsynth.mechanism.joints import Revolute
    from graphsynth.structure.graph import MechanismGraph

    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [
        Revolute(0, 1), Revolute(1, 2, (crank, 0.0)), Revolute(2, 3, (coupler, 0.0), (rocker, 0.0)),
        Revolute(0, 3, (frame, 0.0)),
    ]  # fmt: skip
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
