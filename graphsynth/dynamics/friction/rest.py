"""A mechanism at rest: how long its friction holds it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.friction.state import state_values
from graphsynth.dynamics.tables import Compiled

if TYPE_CHECKING:
    from graphsynth.dynamics.friction.guard import Guard

__all__ = ["RestForm", "rest_until"]

Array = NDArray[np.float64]

#: Steps of the search over the whole time: the longest, and the first.
_LONGEST, _FIRST = 1.0 / 400.0, 1e-5
#: How far a value may lie from the line through its neighbours, as a part of what is left.
_BENT = 0.02


class RestForm:
    """State ``(work,)`` of a mechanism whose every joint is held: a workspace that looks like the other forms."""

    name, why, stall = "rest", "", ""
    loss = contraction = 0.0
    pivot = 1.0

    def __init__(self, compiled: Compiled, q: Array, slots: Array) -> None:
        self.compiled = compiled
        self.changes: list[tuple[float, str]] = []
        self.slots, self._q = slots, q

    def begin(self) -> Array:
        """Start state."""
        return np.zeros(1)

    def rates(self, t: float, y: Array) -> Array:
        """Nothing changes."""
        return np.zeros_like(y)

    def accept(self, t: float, y: Array) -> Array:
        """Nothing to mend."""
        return y

    def state(self, t: float, y: Array) -> tuple[Array, Array]:
        """Coordinates and velocities."""
        return self._q, np.zeros_like(self._q)


def rest_until(guard: Guard, t: float, end: float, first: float, last: float) -> float:
    """Time to which nothing moves: ``end``, or that of the release of ``guard.hit``.

    Loads that do not depend on time hold for ever; others are followed in steps over which they are nearly straight.
    """
    piece = guard.piece
    if not piece.rows.compiled.applied or not piece.stuck:
        return end
    q, v = guard.form.state(t, guard.form.begin())
    latest = float(np.nextafter(end, -np.inf)) if end < last else end
    stuck = list(piece.stuck)

    def left(at: float) -> Array:
        return np.asarray(state_values(piece, min(at, latest), q, v, guard._slots)[0][stuck])

    span = last - first
    step, low, before = _FIRST * span, t, left(t)
    while low < end:
        high = min(low + step, end)
        middle, after = left(0.5 * (low + high)), left(high)
        if (middle < 0.0).any() or (after < 0.0).any():
            if high - low <= 4.0 * np.spacing(high):
                guard.hit, guard.uncertainty = stuck[int(np.argmin(np.minimum(middle, after)))], high - low
                return low
            step = 0.5 * (high - low)
            if (before < 0.0).any():
                guard.hit, guard.uncertainty = stuck[int(np.argmin(before))], 0.0
                return low
            continue
        bent = np.abs(middle - 0.5 * (before + after)).max() > _BENT * np.minimum(before, after).min()
        if bent and step > 1e-12 * span:
            step = 0.5 * (high - low)
            continue
        low, before, step = high, after, min(2.0 * step, _LONGEST * span)
    return end
