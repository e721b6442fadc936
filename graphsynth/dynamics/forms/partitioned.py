"""The partitioned form: independent coordinates chosen by column-pivoted QR, changed where they fail.

See theory/planar-dynamics 4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.friction.problem import NO_LOADS
from graphsynth.dynamics.start import StartReport
from graphsynth.dynamics.stepping import Stages
from graphsynth.dynamics.tables import Compiled
from graphsynth.dynamics.values import applied_loads, initial_slots

Array = NDArray[np.float64]

#: Coordinates are changed when the smallest pivot falls below this part of what it was when they were chosen.
_WORN = 0.2
_NAMES = ("x", "y", "theta")
#: What the kernels report in ``out[6]``.
_WRONG = (
    "",
    "a spring has length 0, so its direction is not defined",
    NO_LOADS,
    "the dependent coordinates cannot be solved: the mechanism cannot be assembled there",
)


def independent_coordinates(scaled: Array, tolerance: float = 1e-10) -> NDArray[np.intp]:
    """Columns of a scaled Jacobian left over by the largest pivots: a good choice of independent coordinates."""
    if not scaled.size:
        return np.arange(scaled.shape[1])
    from scipy.linalg import qr

    _, R, order = qr(scaled, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(R))
    rank = int(np.sum(diagonal > tolerance * diagonal[0]))
    return np.sort(order[rank:])


class PartitionedForm:
    """State ``(z, dz/dt, currents, work)`` with z some of the coordinates; a solver workspace, not a result.

    Dependent coordinates are solved by Newton's method at every evaluation; ``(N^T M N) z'' = N^T (Q - M a0)`` with
    ``N`` the velocity map and ``a0`` the accelerations at ``z'' = 0``.
    """

    name = "partitioned"
    stall = (
        "at the singular pose there branches meet or nearly meet, and the equations do not tell how the motion goes "
        "on; change the dimensions, or start elsewhere"
    )
    loss = 0.0

    def __init__(self, compiled: Compiled, start: StartReport) -> None:
        from graphsynth.dynamics import kernels

        self.compiled = compiled
        self.slots = start.slots.copy()
        self.changes: list[tuple[float, str]] = []
        self.why = ""
        self.contraction = 0.0
        self.pivot = 1.0
        self._kernels = kernels
        self._scale = compiled.unit
        self._row_scale = compiled.row_unit
        self._metric = np.diag(1.0 / self._scale)
        self._fixed, self._none, self.out = compiled.driven(0.0), np.zeros(compiled.n), np.zeros(7)
        self._near = start.q.copy()
        self._choose(start.time, start.q, start.v)
        self._begin = np.concatenate([start.q[self.chosen], start.v[self.chosen], compiled.tail])

    @property
    def unit(self) -> Array:
        """Units of the chosen coordinates."""
        return np.asarray(self._scale[self.chosen])

    def _choose(self, t: float, q: Array, v: Array) -> None:
        """Choose independent coordinates at a pose."""
        T = self.compiled.tables
        x = self._kernels.state_rows(T, q, v)
        J = self._kernels.constraint_system(T, x, self.slots, self._driven(t))[1]
        self.chosen = independent_coordinates(J * self._scale / self._row_scale[:, None])
        self._fresh = self._place(t, np.concatenate([q[self.chosen], v[self.chosen], [0.0]]), q)[2]

    def _driven(self, t: float) -> Array:
        return self.compiled.driven(t) if self.compiled.laws else self._fixed

    def begin(self) -> Array:
        """Start state."""
        return self._begin.copy()

    def state(self, t: float, y: Array) -> tuple[Array, Array]:
        """Coordinates and velocities; NaN where Newton's method does not return to the constraints."""
        return self._place(t, y, self._near)[:2]

    def _place(self, t: float, y: Array, near: Array) -> tuple[Array, Array, float]:
        """Coordinates, velocities and smallest pivot of the constraints with the chosen coordinates; -1 if not."""
        found = self._kernels.place_partitioned(
            self.compiled.tables, np.ascontiguousarray(y), self.chosen, near, self._metric, self.slots, self._driven(t)
        )
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
            self._look()
            return q, tail[0]
        T, own = self.compiled.tables, np.ascontiguousarray(y[2 * len(self.chosen) :])
        applied = applied_loads(self.compiled, t, q, v) if self.compiled.applied else self._none
        a, P = self._kernels.accelerate_partitioned(
            T, q, v, self.chosen, self._metric, self.slots, self._driven(t), applied, own, self.out
        )
        self._kernels.finish(T, self._kernels.state_rows(T, q, v), own, tail, 0, 0, P)
        self._look()
        return a, tail[0]

    def _look(self) -> None:
        """Note what the kernels found wrong."""
        if self.out[6] > 0.0:
            self.why = _WRONG[int(self.out[6])]
        elif self.compiled.tables.friction.size:
            self.contraction = max(self.contraction, float(self.out[3]))
        self.out[6] = 0.0

    def rates(self, t: float, y: Array) -> Array:
        """Return the derivative of the state; NaN where the mechanism cannot be assembled."""
        k = len(self.chosen)
        a, tail = self._accelerate(t, y)
        return np.concatenate([y[k : 2 * k], a[self.chosen], tail])

    @property
    def stages(self) -> Stages | None:
        """A compiled Runge-Kutta step, if no load is given as a function."""
        if self.compiled.applied:
            return None

        def run(t: float, y: Array, h: float, A: Array, K: Array) -> Array:
            fresh = self._kernels.partitioned_stages(
                self.compiled.tables,
                y,
                h,
                A,
                K,
                1,
                len(A),
                self.chosen,
                self._near,
                self._metric,
                self.slots,
                self.compiled.driven_at(t + h * A.sum(axis=1)),
                self._none,
                self.out,
            )
            self._look()
            return np.asarray(fresh)

        return run

    def accept(self, t: float, y: Array) -> Array:
        """Take the accepted state as the next guess; change coordinates that wear out."""
        q, v, pivot = self._place(t, y, self._near)
        if pivot < 0.0:
            return y
        self._near = q
        self.slots = initial_slots(self.compiled, q, self.slots)
        self.pivot = pivot
        if self.pivot >= _WORN * self._fresh:
            return y
        before = self.chosen
        self._choose(t, q, v)
        if np.array_equal(before, self.chosen):
            self._fresh = max(self.pivot, 1e-12)
            return y
        text = f"independent coordinates {self._named(before)} fail here; {self._named(self.chosen)} from now on"
        self.changes.append((t, text))
        return np.concatenate([q[self.chosen], v[self.chosen], y[2 * len(before) :]])

    def _named(self, chosen: NDArray[np.intp]) -> str:
        links = self.compiled.moving
        return ", ".join(f"{_NAMES[int(c) % 3]} of link {links[int(c) // 3]}" for c in chosen)
