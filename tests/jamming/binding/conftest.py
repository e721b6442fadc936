"""A mechanism with a link too many."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

import graphsynth as gs
from graphsynth.mechanism.joints import Revolute

CRANK, FRAME = 0.1, 0.2


@pytest.fixture(scope="session")
def three_cranks() -> Callable[[float], gs.Mechanism]:
    """Return what makes a parallelogram with a third crank in its middle, whose length is wrong by an error."""
    return _three_cranks


def _three_cranks(error: float) -> gs.Mechanism:
    """A parallelogram with a third crank in its middle, whose length is wrong."""
    graph = gs.MechanismGraph(5, [(0, 1), (0, 3), (0, 4), (1, 2), (2, 3), (2, 4)], frame=0)
    cranks = [Revolute(0, link, (x, 0.0)) for link, x in ((1, 0.0), (3, FRAME), (4, 0.5 * FRAME))]
    tops = [
        Revolute(2, link, (x, 0.0), (length, 0.0))
        for link, x, length in ((1, 0.0, CRANK), (3, FRAME, CRANK), (4, 0.5 * FRAME, CRANK + error))
    ]
    pose = [(0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (CRANK * math.cos(1.0), CRANK * math.sin(1.0), 0.0)]
    pose += [(FRAME, 0.0, 1.0), (0.5 * FRAME, 0.0, 1.0)]
    return gs.Mechanism(graph, cranks + tops, [gs.Driver(0, 1)], pose=pose)
