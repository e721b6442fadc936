"""The partitioned form: independent coordinates chosen by column-pivoted QR, changed where they fail.

See theory/planar-dynamics 4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics import kernels
from graphsynth.dynamics.start import StartReport
from graphsynth.dynamics.stepping import Form
from graphsynth.dynamics.tables import Compiled
from graphsynth.dynamics.values import Values, applied_loads, initial_slots

Array = NDArray[np.float64]

#: Coordinates are changed when the smallest pivot falls below this part of what it was when they were chosen.
_WORN = 0.2
_NAMES = ("x", "y", "theta")


class PartitionedForm(Form):
    """State ``(z, dz/dt, currents, work)`` with z some of the coordinates.

    Dependent coordinates are solved by Newton's method at every evaluation; ``(N^T M N) z'' = N^T (Q - M a0)`` with
    ``N`` the velocity map and ``a0`` the accelerations at ``z'' = 0``.
    """

    name = "partitioned"
    slots: Array

    def __init__(self, compiled: Compiled, start: StartReport) -> None:
        super().__init__(compiled, np.empty(0))
        self.slots = start.slots.copy()
        self._metric, self._near = np.diag(1.0 / compiled.unit), start.q.copy()
        self._choose(start.time, start.q, start.v)
        self._begin = np.concatenate([start.q[self.chosen], start.v[self.chosen], compiled.tail])

    def _choose(self, t: float, q: Array, v: Array) -> None:
        """Choose independent coordinates at a pose: those left over by the largest pivots of the constraints."""
        from scipy.linalg import qr

        scaled = Values(self.compiled, t, self.slots).scaled_jacobian(q)
        self.chosen = np.arange(len(q))
        if scaled.size:
            _, R, order = qr(scaled, mode="economic", pivoting=True)
            diagonal = np.abs(np.diag(R))
            self.chosen = np.sort(order[int(np.sum(diagonal > 1e-10 * diagonal[0])) :])
        self.unit = self.compiled.unit[self.chosen]
        self._fresh = self._place(t, np.concatenate([q[self.chosen], v[self.chosen], [0.0]]), q)[2]

    def state(self, t: float, y: Array) -> tuple[Array, Array]:
        """Coordinates and velocities; NaN where Newton's method does not return to the constraints."""
        return self._place(t, y, self._near)[:2]

    def _place(self, t: float, y: Array, near: Array) -> tuple[Array, Array, float]:
        """Coordinates, velocities and smallest pivot of the constraints with the chosen coordinates; -1 if not."""
        T, y, driven = self.compiled.tables, np.ascontiguousarray(y), self.compiled.driven(t)
        found = kernels.place_partitioned(T, y, self.chosen, near, self._metric, self.slots, driven)
        return found[0], found[1], float(found[2])

    def accelerations(self, t: float, y: Array) -> Array:
        """Accelerations of all coordinates."""
        return self._accelerate(t, y)[0]

    def _accelerate(self, t: float, y: Array) -> tuple[Array, Array]:
        """Accelerations, and the rates of what stands behind the motion in the state."""
        q, v, pivot = self._place(t, y, self._near)
        tail = np.full((1, len(y) - 2 * len(self.chosen)), np.nan)
        if pivot < 0.0:
            self.out[6] = 3.0 if np.isfinite(y).all() else 0.0  # a state that is none says nothing of the mechanism
            self._note()
            return q, tail[0]
        T, own = self.compiled.tables, np.ascontiguousarray(y[2 * len(self.chosen) :])
        given = self.compiled.driven(t), applied_loads(self.compiled, t, q, v), own, self.out
        a, P = kernels.accelerate_partitioned(T, q, v, self.chosen, self._metric, self.slots, *given)
        kernels.finish(T, kernels.state_rows(T, q, v), own, tail, 0, 0, P)
        self._note()
        return a, tail[0]

    def rates(self, t: float, y: Array) -> Array:
        """Return the derivative of the state; NaN where the mechanism cannot be assembled."""
        k = len(self.chosen)
        a, tail = self._accelerate(t, y)
        return np.concatenate([y[k : 2 * k], a[self.chosen], tail])

    def step(self, t: float, y: Array, h: float, A: Array, K: Array) -> Array:
        """Return the end of a compiled Runge-Kutta step."""
        form = self.chosen, self._near, self._metric, self.slots
        driven = self.compiled.driven_at(t + h * A.sum(axis=1))
        run = kernels.partitioned_stages
        fresh = run(self.compiled.tables, y, h, A, K, 1, len(A), *form, driven, self._none, self.out)
        self._note()
        return np.asarray(fresh)

    def accept(self, t: float, y: Array) -> Array:
        """Take the accepted state as the next guess; change coordinates that wear out."""
        q, v, pivot = self._place(t, y, self._near)
        if pivot < 0.0:
            return y
        self._near, self.pivot = q, pivot
        self.slots = initial_slots(self.compiled, q, self.slots)
        if self.pivot >= _WORN * self._fresh:
            return y
        before, links = self.chosen, self.compiled.moving
        self._choose(t, q, v)
        if np.array_equal(before, self.chosen):
            self._fresh = max(self.pivot, 1e-12)
            return y
        old, new = (
            ", ".join(f"{_NAMES[int(c) % 3]} of link {links[int(c) // 3]}" for c in chosen)
            for chosen in (before, self.chosen)
        )
        self.changes.append((t, f"independent coordinates {old} fail here; {new} from now on"))
        return np.concatenate([q[self.chosen], v[self.chosen], y[2 * len(before) :]])
