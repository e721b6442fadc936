"""Watching the steps of a piece: where a sliding ends or a joint that sticks is released, located to rounding."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.friction.problem import FrictionProblem
from graphsynth.dynamics.friction.state import Piece, decide, state_values
from graphsynth.dynamics.stepping import Finding

if TYPE_CHECKING:
    from graphsynth.dynamics.stepping import Form, Stepper

Array = NDArray[np.float64]

#: Places inside a step where sticking is looked at, as parts of it.
_INSIDE = (0.2, 0.4, 0.6, 0.8)
#: A step that is shorter than this many spacings of its time resolves nothing.
_SHORTEST = 64.0
_UNRESOLVED = (
    "a sliding that begins or ends here is below the rounding of the velocities: the contact is not resolved; change "
    "the data slightly to see which side it falls on"
)
#: Rounds of the search for an event.
_ROUNDS = 40


class Guard:
    """Watches one piece of a motion with dry friction.

    ``hit`` is the element whose sliding or sticking ends at the event, ``uncertainty`` an estimate of the error of its
    time.
    """

    def __init__(self, piece: Piece, form: Form, t: float, q: Array, v: Array, slots: Array) -> None:
        self.piece, self.form = piece, form
        self.hit: int | None = None
        self.uncertainty = 0.0
        self.factor, self.message = 0.0, ""
        self._slots = slots
        self.value, self.slope, _ = state_values(piece, t, q, v, slots)
        rates = piece.rows.directions(t, q, v, slots)[2] @ v
        self._fresh = np.array([bool(s) and not s * rates[f] > 1e-300 for f, s in enumerate(piece.senses)])
        self.value[self._fresh] = 0.0
        elements = piece.rows.elements
        self._held = [f for f, e in enumerate(elements) if not piece.senses[f] and f not in piece.stuck and e.sticks]
        # sliding speeds over which friction falls, in the unit of the rates
        narrow = [e.static > e.kinetic and e.stribeck > 0.0 and not e.smooth for e in elements]
        self._narrow = np.array([e.stribeck / e.lever if falls else np.inf for e, falls in zip(elements, narrow)])

    def longest(self) -> float:
        """Return the longest step that does not jump over the rise of friction at rest."""
        if not np.isfinite(self._narrow).any():
            return float("inf")
        change = self._narrow + 0.5 * np.maximum(self.value, 0.0)
        with np.errstate(all="ignore"):
            bounds = change / np.abs(np.nan_to_num(self.slope))
        return float(np.min(bounds[np.isfinite(self._narrow)], initial=np.inf))

    def _values(self, t: float, y: Array) -> tuple[Array, Array, float]:
        q, v = self.form.state(t, y)
        return state_values(self.piece, t, q, v, self.form.slots_at(q))

    def look(self, stepper: Stepper, t0: float, y0: Array, solver: Any) -> Finding:
        """Look at a step from ``(t0, y0)`` that the solver has made."""
        t1 = float(solver.t)
        h = t1 - t0
        if self.hit is not None:  # the last step before an event
            return Finding()
        value, slope, factor = self._values(min(t1, stepper.latest), np.asarray(solver.y))
        if not np.isfinite(value).all():
            return self._shorter(t0, h, 0.5)
        sliding = np.array([bool(s) for s in self.piece.senses])
        for f in np.flatnonzero(sliding):
            if self._fresh[f] and value[f] <= 0.0:
                return self._shorter(t0, h, 0.1)
            least = max(min(value[f], self.value[f]), 0.0)
            if abs(value[f] - self.value[f]) > 2.0 * (self._narrow[f] + 0.5 * least):
                return self._shorter(t0, h, 0.5)
        dense = cache(solver.dense_output) if hasattr(solver, "dense_output") else None
        found = [
            (at, f)
            for f in (*np.flatnonzero(sliding), *self.piece.stuck, *self._held)
            if (at := self._crossing(int(f), t0, t1, value, slope, dense, bool(sliding[f]), stepper.latest)) is not None
        ]
        if found:
            guess, self.hit = min(found)
            event = self._located(stepper, t0, y0, t1, guess, int(self.hit))
            return Finding(max(event - t0, 0.0) or h, event)
        if factor >= 1.0:
            self.factor, t, y = factor, min(t1, stepper.latest), np.asarray(solver.y)
            q, v = self.form.state(t, y)
            problem = FrictionProblem(self.piece.rows, t, q, v, self.form.slots_at(q))
            moving = {f: s for f, s in enumerate(self.piece.senses) if s or self.piece.rows.elements[f].smooth}
            self.message = decide(problem, moving, self.piece.stuck).message  # why the motion is no longer the only one
            if self.message:
                return Finding(message=self.message)
        self.value, self.slope = value, slope
        self._fresh[:] = False
        return Finding()

    def _shorter(self, t0: float, h: float, part: float) -> Finding:
        if h * part < _SHORTEST * np.spacing(abs(t0) + h):
            self.message = _UNRESOLVED
            return Finding(message=_UNRESOLVED)
        return Finding(h * part)

    def _crossing(
        self, f: int, t0: float, t1: float, value: Array, slope: Array, dense: Any, slides: bool, latest: float
    ) -> float | None:
        """Time within a step at which a value falls to 0, roughly; None if it does not."""
        g0, g1 = float(self.value[f]), float(value[f])

        def at(t: float) -> float:
            return float(self._values(min(t, latest), np.asarray(dense()(t)))[0][f])

        if g1 <= 0.0:
            if g0 <= 0.0:
                return t0
            return t0 + (t1 - t0) * g0 / (g0 - g1) if dense is None else _root(at, t0, t1, g0, g1)
        if dense is None or (slides and not self._may_touch(f, t1 - t0, g1, float(slope[f]))):
            return None
        times = [t0 + part * (t1 - t0) for part in _INSIDE]
        inside = [at(t) for t in times]
        k = int(np.argmin(inside))
        if inside[k] > 0.0 and inside[k] < min(g0 if not self._fresh[f] else g1, g1):
            from scipy.optimize import minimize_scalar

            low, high = (t0, *times)[k], (*times, t1)[k + 1]
            least = minimize_scalar(at, bounds=(low, high), method="bounded", options={"xatol": 1e-6 * (high - low)})
            times[k], inside[k] = float(least.x), float(least.fun)
        if inside[k] > 0.0 or (self._fresh[f] and k == 0):
            return None
        return _root(at, t0, times[k], g0, inside[k])

    def _may_touch(self, f: int, h: float, g1: float, d1: float) -> bool:
        """Whether the cubic through both ends comes near 0 between them."""
        g0, d0 = float(self.value[f]), float(self.slope[f])
        if not d0 < 0.0 < d1:
            return False
        x = np.linspace(0.05, 0.95, 19)
        ends = g0 * (1 + 2 * x) * (1 - x) ** 2 + g1 * x * x * (3 - 2 * x)
        return bool((ends + h * x * (1 - x) * (d0 * (1 - x) - d1 * x)).min() < 0.2 * min(g0, g1))

    def _located(self, stepper: Stepper, t0: float, y0: Array, t1: float, guess: float, f: int) -> float:
        """Time of an event by steps of its own from the last node, to rounding."""
        low, high, t = t0, t1, guess
        if guess <= t0:
            return t0
        last: tuple[float, float] | None = None
        for _ in range(_ROUNDS):
            y = stepper.reached(t0, y0, t)
            if y is None:
                break
            values, slopes, _ = self._values(min(t, stepper.latest), y)
            g, d = float(values[f]), float(slopes[f])
            if not np.isfinite(d):
                d = (g - last[1]) / (t - last[0]) if last is not None and t != last[0] else np.nan
            low, high = (t, high) if g > 0.0 else (low, t)
            last = (t, g)
            fresh = t - g / d if d < 0.0 else np.nan
            if g == 0.0 or abs(fresh - t) <= 2.0 * np.spacing(t):
                break
            if not low <= fresh <= high:
                probe = t - np.copysign(1e-4 * (t1 - t0), g) if last is None or not np.isfinite(d) else np.nan
                fresh = probe if low < probe < high else 0.5 * (low + high)
            if high - low <= 2.0 * np.spacing(t):
                break
            t = float(fresh)
        self.uncertainty = high - low if last is None else float(4.0 * np.spacing(t))
        return t


def _root(value: Callable[[float], float], low: float, high: float, at_low: float, at_high: float) -> float:
    """Root of an interpolant between two times; good enough to begin with."""
    from scipy.optimize import brentq

    if not at_low > 0.0:  # zero at its own start: look for where it has risen
        for part in (0.5, 0.25, 0.1, 0.01, 1e-3):
            middle = low + part * (high - low)
            if value(middle) > 0.0:
                low = middle
                break
        else:
            return low
    if not value(low) > 0.0 or not value(high) <= 0.0:  # the interpolant does not meet the ends to the last digit
        return high
    return float(brentq(value, low, high, xtol=1e-9 * (high - low), rtol=8.9e-16))
