"""The two legs and their order of solution: the same triangular pair of equations for both gimbal orders.

With ``u`` the angle of the fixed gimbal axis and ``v`` that of the carried one (specification
instruments_and_dynamics, section 2.5)::

    P1 cos u + Q1 sin u = K1
    P2 cos v + Q2 cos u sin v = K2

where a leg of crank ``c`` and rod ``r`` has its ball joint at ``P = l1 - c + c cos phi``, ``Q = side r + c sin phi``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from graphsynth.systems.antenna.mechanism import PointingMechanism

__all__ = ["Leg", "legs", "scale_of", "solution_order"]


class Leg(NamedTuple):
    """One leg: name, crank, rod, side of the rod at rest, branch sign of the rest pose."""

    name: str
    crank: float
    rod: float
    side: float
    rest: int


def scale_of(mechanism: PointingMechanism) -> float:
    """Power of two near the largest length; dividing by it rounds nothing."""
    largest = max(mechanism.l1, mechanism.l2, mechanism.l3, mechanism.l4, mechanism.l5)
    return math.ldexp(1.0, math.frexp(largest)[1])


def legs(mechanism: PointingMechanism, scale: float = 1.0) -> tuple[Leg, Leg]:
    """Leg Y and leg X, lengths divided by ``scale``."""
    m = mechanism
    return (
        Leg("Y", m.l3 / scale, m.l2 / scale, -1.0, 1),
        Leg("X", m.l5 / scale, m.l4 / scale, 1.0, -1),
    )


def solution_order(mechanism: PointingMechanism, scale: float = 1.0) -> tuple[Leg, Leg]:
    """Return the leg that is solved first (it turns the axis fixed to the ground) and the other one."""
    y, x = legs(mechanism, scale)
    return (x, y) if mechanism.order == "YX" else (y, x)
