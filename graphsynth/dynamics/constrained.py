"""The index-1 form with projection: all coordinates, multipliers at every evaluation (spec 5.5)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.applied import applied_loads
from graphsynth.dynamics.leap import HermiteLeap
from graphsynth.dynamics.passing import passed_singular_pose
from graphsynth.dynamics.start import StartReport
from graphsynth.dynamics.tables import Compiled
from graphsynth.dynamics.values import initial_slots
from graphsynth.errors import GeometryError

__all__ = ["ConstrainedForm"]

if TYPE_CHECKING:
    from graphsynth.dynamics.stepping import Trail

Array = NDArray[np.float64]

#: Pivots below this part of the largest are looked at closely.
_LOW = 0.3
#: Pivots below this part of the largest tell a singular pose ahead.
_AHEAD = 0.6
#: Pivots below this part of the largest fall linearly enough to tell when.
_CLOSE = 0.3
#: Short steps before a leap over a singular pose, and how well it must land (characteristic lengths, radians).
_NODES, _LANDED = 3, 1e-6


class ConstrainedForm:
    """State ``(q, v, work)``; a solver workspace, not a result.

    Attributes
    ----------
    loss : float
        Kinetic energy removed by velocity projection so far (J).
    """

    name = "constrained"
    stall = (
        "at the singular pose there branches meet or nearly meet, and the equations do not tell how the motion goes "
        "on; change the dimensions, or start elsewhere"
    )

    def __init__(self, compiled: Compiled, start: StartReport, project: bool = True) -> None:
        from graphsynth.dynamics import kernels

        if compiled.model.massless:
            raise GeometryError(
                f"links {list(compiled.model.massless)} have no mass or no inertia; give them some, or use "
                "form='minimal', where the effective inertia may stay positive"
            )
        self.compiled = compiled
        self.project = project
        self.slots = start.slots.copy()
        self.loss = 0.0
        self.changes: list[tuple[float, str]] = []
        self.why = ""
        self.out = np.zeros(7)
        self._history: list[tuple[float, float]] = []
        self._dense: Any = None
        self._largest = 0.0
        self._short, self._blocked = 0.0, -np.inf
        self._nodes: list[tuple[float, Array]] = []
        self._last: tuple[float, Array] | None = None
        self._follows = bool((compiled.tables.slots >= 0).any())
        self.contraction = 0.0
        self.pivot = 1.0
        self._kernels = kernels
        self._fixed = compiled.driven(0.0)
        self._none = np.zeros(compiled.n)
        self._begin = np.concatenate([start.q, start.v, [0.0]])

    def begin(self) -> Array:
        """Start state."""
        return self._begin.copy()

    def driven(self, t: float) -> Array:
        """Prescribed coordinates at time t."""
        return self.compiled.driven(t) if self.compiled.laws else self._fixed

    def applied(self, t: float, y: Array) -> Array:
        """Return the loads given as functions."""
        n = self.compiled.n
        return applied_loads(self.compiled, t, y[:n], y[n : 2 * n]) if self.compiled.applied else self._none

    def rates(self, t: float, y: Array) -> Array:
        """Return the derivative of the state; NaN where the friction iteration does not contract."""
        found, _ = self._kernels.constrained_rates(
            self.compiled.tables, np.ascontiguousarray(y), self.slots, self.driven(t), self.applied(t, y), self.out
        )
        self._look()
        return np.asarray(found)

    @property
    def stages(self) -> Callable[..., Array] | None:
        """A compiled Runge-Kutta step, if neither loads nor motions are given as functions."""
        if self.compiled.applied or self.compiled.laws:
            return None

        def run(y: Array, h: float, A: Array, B: Array, K: Array) -> Array:
            fresh = self._kernels.constrained_stages(
                self.compiled.tables, y, h, A, B, K, self.slots, self._fixed, self._none, self.out
            )
            self._look()
            return np.asarray(fresh)

        return run

    def _look(self) -> None:
        """Note what the kernel found wrong."""
        if self.out[6] == 1.0:
            self.why = "a spring has length 0, so its direction is not defined"
        elif self.out[6] == 2.0:
            self.why = (
                "the friction iteration does not contract: the reactions are not determined, there may be no solution "
                "or several; reduce the friction coefficient"
            )
        else:
            self.contraction = max(self.contraction, float(self.out[3]))
        self.out[6] = 0.0

    def _halves(self, y: Array) -> tuple[Array, Array]:
        """Coordinates and velocities, in memory of their own where a solver gives strided states."""
        n = self.compiled.n
        return np.ascontiguousarray(y[:n]), np.ascontiguousarray(y[n : 2 * n])

    def accept(self, t: float, y: Array) -> Array:
        """Project an accepted state onto the constraints; gears are followed."""
        n = self.compiled.n
        if self._follows:
            self.slots = initial_slots(self.compiled, y[:n], self.slots)
        if not self.project:
            return y
        q, v, loss, self.pivot = self._kernels.project_state(
            self.compiled.tables, *self._halves(y), self.slots, self.driven(t)
        )
        self.loss += loss
        self._history.append((t, self.pivot))
        fresh = np.concatenate([q, v, y[2 * n :]])
        self._last = (t, fresh)
        return fresh

    def state(self, t: float, y: Array) -> tuple[Array, Array]:
        """Coordinates and velocities of a state between steps, on the constraints."""
        n = self.compiled.n
        if not self.project:
            return y[:n], y[n : 2 * n]
        q, v, _, _ = self._kernels.project_state(self.compiled.tables, *self._halves(y), self.slots, self.driven(t))
        return q, v

    def pivot_at(self, t: float, y: Array) -> tuple[float, Array]:
        """Smallest pivot of the constraints at a state, and the coordinates on the constraints."""
        q, _, _, pivot = self._kernels.project_state(self.compiled.tables, *self._halves(y), self.slots, self.driven(t))
        return float(pivot), q

    def proposed_step(self, t: float, step: float) -> float:
        """Short equal steps before a singular pose ahead, as nodes of the leap over it; else the step itself."""
        self._note(t)
        if self._short > 0.0:
            return min(step, self._short)
        ahead = self._ahead(t)
        if ahead is None or ahead > 1.5 * step or t <= self._blocked:
            return step
        if self._history[-1][1] > _CLOSE * self._largest:
            return min(step, 0.25 * ahead)  # nearer first, where the extrapolation can be trusted
        self._short, self._nodes = ahead / (_NODES + 2), []
        self._note(t)
        return self._short

    def _ahead(self, t: float) -> float | None:
        """Time until the smallest pivot vanishes, by linear extrapolation; None if it does not fall."""
        if len(self._history) < 2:
            return None
        (t0, p0), (t1, p1) = self._history[-2:]
        if t1 != t or not p1 < p0 or p1 > _AHEAD * self._largest:
            return None
        return p1 * (t1 - t0) / (p0 - p1)

    def _note(self, t: float) -> None:
        """Keep the state at t as a node of the leap."""
        if self._short > 0.0 and self._last is not None and self._last[0] == t:
            self._nodes.append(self._last)

    def leap(self, trail: Trail, bound: float) -> tuple[float, Array, HermiteLeap] | None:
        """Time and state beyond a singular pose, and the polynomial that leads there; None if no leap is due."""
        if len(self._nodes) <= _NODES:
            return None
        t, short = self._nodes[-1][0], self._short
        ahead = self._ahead(t)
        if ahead is not None and ahead > short and len(self._nodes) < 3 * _NODES:
            return None  # nearer first
        nodes, self._short, self._nodes = self._nodes[-_NODES - 1 :], 0.0, []
        self._blocked = t + 3.0 * (ahead or 0.0)
        if ahead is None:
            return None
        landing = t + ahead + max(ahead, 0.8 * short)
        if landing >= bound:
            return None
        path = HermiteLeap([node[0] for node in nodes], [node[1] for node in nodes],
                           [self.rates(node[0], node[1]) for node in nodes])  # fmt: skip
        y = path(landing)
        n, unit = self.compiled.n, np.tile([self.compiled.tables.size] * 2 + [1.0], self.compiled.n // 3)
        q, v, loss, pivot = self._kernels.project_state(
            self.compiled.tables, *self._halves(y), self.slots, self.driven(landing)
        )
        speed = float(np.abs(v / unit).max())
        missed = max(float(np.abs((q - y[:n]) / unit).max()), float(np.abs((v - y[n : 2 * n]) / unit).max()) / speed)
        if not missed < _LANDED:
            return None
        self.loss += loss
        event = passed_singular_pose(self, t, t + ahead, landing, path, path, self._largest)
        if event is not None:
            trail.events.append(event)
        self._history, self._dense, self.pivot = [(landing, float(pivot))], None, float(pivot)
        fresh = np.concatenate([q, v, y[2 * n :]])
        self._last = (landing, fresh)
        return landing, fresh, path

    def watch(self, trail: Trail, before: float, solver: Any) -> None:
        """Find singular poses passed: minima of the smallest pivot."""
        self._largest = max(self._largest, self._history[-1][1] if self._history else 0.0)
        if len(self._history) < 3:
            return
        (t0, p0), (_, p1), (t2, p2) = self._history[-3:]
        largest = self._largest
        if p1 <= p0 and p1 < p2 and p1 < _LOW * largest and self._dense is not None:
            event = passed_singular_pose(self, t0, float(before), t2, self._dense, solver.dense_output(), largest)
            if event is not None:
                trail.events.append(event)
        self._dense = solver.dense_output() if p2 < _LOW * largest else None
