"""The index-1 form with projection: all coordinates, multipliers at every evaluation (spec 5.5)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.applied import applied_loads
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


class ConstrainedForm:
    """State ``(q, v, work)``; a solver workspace, not a result.

    Attributes
    ----------
    loss : float
        Kinetic energy removed by velocity projection so far (J).
    """

    name = "constrained"

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
        """Loads given as functions."""
        n = self.compiled.n
        return applied_loads(self.compiled, t, y[:n], y[n : 2 * n]) if self.compiled.applied else self._none

    def rates(self, t: float, y: Array) -> Array:
        """Derivative of the state; NaN where the friction iteration does not contract."""
        found, _ = self._kernels.constrained_rates(
            self.compiled.tables, y, self.slots, self.driven(t), self.applied(t, y), self.out
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

    def accept(self, t: float, y: Array) -> Array:
        """Project an accepted state onto the constraints; gears are followed."""
        n = self.compiled.n
        if self._follows:
            self.slots = initial_slots(self.compiled, y[:n], self.slots)
        if not self.project:
            return y
        q, v, loss, self.pivot = self._kernels.project_state(
            self.compiled.tables, y[:n], y[n : 2 * n], self.slots, self.driven(t)
        )
        self.loss += loss
        self._history.append((t, self.pivot))
        return np.concatenate([q, v, y[2 * n :]])

    def state(self, t: float, y: Array) -> tuple[Array, Array]:
        """Coordinates and velocities of a state between steps, on the constraints."""
        n = self.compiled.n
        if not self.project:
            return y[:n], y[n : 2 * n]
        q, v, _, _ = self._kernels.project_state(
            self.compiled.tables, y[:n], y[n : 2 * n], self.slots, self.driven(t)
        )
        return q, v

    def pivot_at(self, t: float, y: Array) -> tuple[float, Array]:
        """Smallest pivot of the constraints at a state, and the coordinates on the constraints."""
        n = self.compiled.n
        q, _, _, pivot = self._kernels.project_state(
            self.compiled.tables, y[:n], y[n : 2 * n], self.slots, self.driven(t)
        )
        return float(pivot), q

    def watch(self, trail: Trail, before: float, solver: Any) -> None:
        """Find singular poses passed: minima of the smallest pivot."""
        if len(self._history) < 3:
            return
        (t0, p0), (_, p1), (t2, p2) = self._history[-3:]
        largest = max(self._largest, p2)
        self._largest = largest
        if p1 <= p0 and p1 < p2 and p1 < _LOW * largest and self._dense is not None:
            event = passed_singular_pose(self, t0, float(before), t2, self._dense, solver.dense_output(), largest)
            if event is not None:
                trail.events.append(event)
        self._dense = solver.dense_output() if p2 < _LOW * largest else None
