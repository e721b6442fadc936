"""The reduced form: independent coordinates chosen by column-pivoted QR, changed where they fail (spec 5.4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.applied import applied_loads
from graphsynth.dynamics.start import StartReport
from graphsynth.dynamics.tables import Compiled
from graphsynth.dynamics.values import initial_slots

__all__ = ["ReducedForm", "independent_coordinates"]

Array = NDArray[np.float64]

#: Coordinates are changed when the smallest pivot falls below this part of what it was when they were chosen.
_WORN = 0.2
_ROUNDS = 12
_NAMES = ("x", "y", "theta")


def independent_coordinates(scaled: Array, tolerance: float = 1e-10) -> NDArray[np.intp]:
    """Columns of a scaled Jacobian left over by the largest pivots: a good choice of independent coordinates."""
    if not scaled.size:
        return np.arange(scaled.shape[1])
    from scipy.linalg import qr

    _, R, order = qr(scaled, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(R))
    rank = int(np.sum(diagonal > tolerance * diagonal[0]))
    return np.sort(order[rank:])


class ReducedForm:
    """State ``(z, dz/dt, work)`` with z some of the coordinates; a solver workspace, not a result.

    Dependent coordinates are solved by Newton's method at every evaluation; ``(N^T M N) z'' = N^T (Q - M a0)`` with
    ``N`` the velocity map and ``a0`` the accelerations at ``z'' = 0``.
    """

    name = "reduced"
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
        T = compiled.tables
        self._scale = np.tile([T.size, T.size, 1.0], compiled.n // 3)
        self._row_scale = np.array([1.0 if info.angular else T.size for info in compiled.info])
        self._metric = np.diag(1.0 / self._scale)
        self._fixed = compiled.driven(0.0)
        self._near = start.q.copy()
        self._choose(start.time, start.q)
        self._begin = np.concatenate([start.q[self.chosen], start.v[self.chosen], [0.0]])

    @property
    def unit(self) -> Array:
        """Units of the chosen coordinates."""
        return np.asarray(self._scale[self.chosen])

    def _choose(self, t: float, q: Array) -> None:
        """Choose independent coordinates at a pose."""
        J = self._system(t, q, np.zeros_like(q))[1] * self._scale / self._row_scale[:, None]
        self.chosen = independent_coordinates(J)
        self._unit_rows = np.zeros((len(self.chosen), self.compiled.n))
        self._unit_rows[np.arange(len(self.chosen)), self.chosen] = 1.0
        self._fresh = self._factor(t, q)[2]

    def _system(self, t: float, q: Array, v: Array) -> tuple[Array, Array, Array, Array]:
        T = self.compiled.tables
        driven = self.compiled.driven(t) if self.compiled.laws else self._fixed
        C, J, gam, vel = self._kernels.constraint_system(T, self._kernels.state_rows(T, q, v), self.slots, driven)
        return C, J, gam, vel

    def _factor(self, t: float, q: Array) -> tuple[tuple[Array, ...], Array, float]:
        """QR of the constraints together with the chosen coordinates; the Jacobian; the smallest pivot."""
        J = self._system(t, q, np.zeros_like(q))[1]
        found = self._kernels.factor_rows(self._metric, True, np.vstack([J, self._unit_rows]))
        return found, J, float(np.abs(found[1]).min()) if found[4] == self.compiled.n else 0.0

    def _solve(self, factors: tuple[Array, ...], rows: Array, coordinates: Array) -> Array:
        """Solve ``J x = rows, x[chosen] = coordinates``."""
        step, _ = self._kernels.least_step(self._metric, True, *factors, np.concatenate([rows, coordinates]))
        return np.asarray(step)

    def begin(self) -> Array:
        """Start state."""
        return self._begin.copy()

    def state(self, t: float, y: Array) -> tuple[Array, Array]:
        """Coordinates and velocities; NaN where Newton's method does not return to the constraints."""
        q, v, _, _ = self._place(t, y)
        return q, v

    def _place(self, t: float, y: Array) -> tuple[Array, Array, tuple[Array, ...], Array]:
        k = len(self.chosen)
        q, z, last = self._near.copy(), y[:k], np.inf
        for _ in range(_ROUNDS):
            factors, J, _ = self._factor(t, q)
            C = self._system(t, q, np.zeros_like(q))[0]
            step = self._solve(factors, -C, z - q[self.chosen])
            size = float(np.abs(step / self._scale).max(initial=0.0))
            if not np.isfinite(size) or size > 2.0:
                return np.full_like(q, np.nan), np.full_like(q, np.nan), factors, J
            q = q + step
            q[self.chosen] = z
            if size < 1e-15 or (size < 1e-9 and not size < 0.1 * last) or size < 1e-12:
                break
            last = size
        else:
            return np.full_like(q, np.nan), np.full_like(q, np.nan), factors, J
        factors, J, _ = self._factor(t, q)
        v = self._solve(factors, self._system(t, q, np.zeros_like(q))[3], y[k : 2 * k])
        return q, v, factors, J

    def accelerations(self, t: float, y: Array) -> Array:
        """Accelerations of all coordinates."""
        return self._accelerate(t, y)[0]

    def _accelerate(self, t: float, y: Array) -> tuple[Array, float]:
        """Accelerations, and the power of the non-conservative loads and drivers."""
        q, v, factors, J = self._place(t, y)
        if not np.isfinite(q).all():
            self.why = "the dependent coordinates cannot be solved: the mechanism cannot be assembled there"
            return q, float("nan")
        T, k = self.compiled.tables, len(self.chosen)
        _, J, gam, _ = self._system(t, q, v)
        x = self._kernels.state_rows(T, q, v)
        Qc, Qn, _, P, good = self._kernels.load_vector(T, x)
        applied = applied_loads(self.compiled, t, q, v)
        Q = Qc + Qn + applied
        if not good:
            self.why = "a spring has length 0, so its direction is not defined"
            return np.full_like(q, np.nan), float("nan")
        P += float(applied @ v)
        if T.friction.size:
            out = np.zeros(7)
            a, lam = self._kernels.accelerate(T, x, J, gam, Q, out)
            self.contraction = max(self.contraction, float(out[3]))
            if out[3] >= 1.0:
                self.why = "the friction iteration does not contract: there may be no solution or several"
                return np.full_like(q, np.nan), float("nan")
            return a, P + out[2] - float(lam @ (J @ v))
        N = np.column_stack([self._solve(factors, np.zeros(len(gam)), row) for row in np.eye(k)])
        a0 = self._solve(factors, gam, np.zeros(k))
        second = np.linalg.solve(N.T @ T.mass @ N, N.T @ (Q - T.mass @ a0))
        a = a0 + N @ second
        # what drivers do is what the loads leave: the constraint forces along the velocity
        drivers = float((T.mass @ a - Q) @ v) if self.compiled.laws else 0.0
        return a, P + drivers

    def rates(self, t: float, y: Array) -> Array:
        """Return the derivative of the state; NaN where the mechanism cannot be assembled."""
        k = len(self.chosen)
        a, power = self._accelerate(t, y)
        return np.concatenate([y[k : 2 * k], a[self.chosen], [power]])

    def accept(self, t: float, y: Array) -> Array:
        """Take the accepted state as the next guess; change coordinates that wear out."""
        q, v, _, _ = self._place(t, y)
        if not np.isfinite(q).all():
            return y
        self._near = q
        self.slots = initial_slots(self.compiled, q, self.slots)
        self.pivot = self._factor(t, q)[2]
        if self.pivot >= _WORN * self._fresh:
            return y
        before, old = self.chosen, self._fresh
        self._choose(t, q)
        if np.array_equal(before, self.chosen):
            self._fresh = max(self.pivot, 1e-12)
            del old
            return y
        text = f"independent coordinates {self._named(before)} fail here; {self._named(self.chosen)} from now on"
        self.changes.append((t, text))
        return np.concatenate([q[self.chosen], v[self.chosen], y[-1:]])

    def _named(self, chosen: NDArray[np.intp]) -> str:
        links = self.compiled.moving
        return ", ".join(f"{_NAMES[int(c) % 3]} of link {links[int(c) // 3]}" for c in chosen)
