"""Linkages that several cases use."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism

__all__ = ["four_bar"]


def four_bar(crank: float, coupler: float, rocker: float, frame: float) -> Mechanism:
    """Four turning pairs, link 1 driven, the frame's second joint on +x."""
    from graphsynth.mechanism.joints import Revolute
    from graphsynth.mechanism.model import Driver, Mechanism
    from graphsynth.structure.graph import MechanismGraph

    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [
        Revolute(0, 1), Revolute(1, 2, (crank, 0.0)), Revolute(2, 3, (coupler, 0.0), (rocker, 0.0)),
        Revolute(0, 3, (frame, 0.0)),
    ]  # fmt: skip
    return Mechanism(graph, joints, [Driver(0, 1)])
