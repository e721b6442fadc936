"""The index-1 form with projection: all coordinates, multipliers at every evaluation (spec 5.5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.applied import applied_loads
from graphsynth.dynamics.start import StartReport
from graphsynth.dynamics.tables import Compiled
from graphsynth.dynamics.values import initial_slots
from graphsynth.errors import GeometryError

__all__ = ["ConstrainedForm"]

Array = NDArray[np.float64]

_PROJECTIONS = 4


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
        self.out = np.ones(7)
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
        if self.out[3] >= 1.0 or self.out[6] == 0.0:
            self.why = (
                "a spring has length 0, so its direction is not defined" if self.out[6] == 0.0
                else "the friction iteration does not contract: the reactions are not determined, there may be no "
                "solution or several"
            )  # fmt: skip
            return np.full_like(found, np.nan)
        self.contraction = max(self.contraction, float(self.out[3]))
        return np.asarray(found)

    def accept(self, t: float, y: Array) -> Array:
        """Project an accepted state onto the constraints; gears are followed."""
        n = self.compiled.n
        self.slots = initial_slots(self.compiled, y[:n], self.slots)
        self.pivot = float(self.out[1])
        if not self.project:
            return y
        q, v = self.on_constraints(t, y[:n], y[n : 2 * n], count=True)
        return np.concatenate([q, v, y[2 * n :]])

    def on_constraints(self, t: float, q: Array, v: Array, count: bool = False) -> tuple[Array, Array]:
        """Nearest state on the constraints in the metric of the mass matrix (spec 5.5)."""
        T, driven = self.compiled.tables, self.driven(t)
        last = np.inf
        for _ in range(_PROJECTIONS):
            step, violation = self._kernels.position_step(T, q, self.slots, driven)
            size = float(np.abs(violation).max(initial=0.0))
            if not size < last:
                break
            q, last = q + step, size
            if size < 1e-9 * T.size:  # the next violation would be rounding: Newton squares it
                break
        change, _, _, pivot = self._kernels.velocity_step(T, q, v, self.slots, driven)
        if count:
            fixed = v + change
            self.loss += 0.5 * float(v @ T.mass @ v - fixed @ T.mass @ fixed)
            self.pivot = float(pivot)
        return q, v + change

    def state(self, t: float, y: Array) -> tuple[Array, Array]:
        """Coordinates and velocities of a state between steps, on the constraints."""
        n = self.compiled.n
        if not self.project:
            return y[:n], y[n : 2 * n]
        return self.on_constraints(t, y[:n], y[n : 2 * n])
