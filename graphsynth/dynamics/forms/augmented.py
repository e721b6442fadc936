"""The index-1 form with projection: all coordinates, multipliers at every evaluation (theory/planar-dynamics 5)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.dynamics import kernels
from graphsynth.dynamics.result import DynamicEvent
from graphsynth.dynamics.singular import GaussStep, HermiteGuess, gauss_step, passed_singular_pose
from graphsynth.dynamics.start import StartReport
from graphsynth.dynamics.stepping import ONE_STAGE, Form
from graphsynth.dynamics.tables import Compiled
from graphsynth.dynamics.values import applied_loads, initial_slots

if TYPE_CHECKING:
    from graphsynth.dynamics.stepping import SolverStatistics

Array = NDArray[np.float64]

#: Pivots below this part of the largest are looked at closely.
_LOW = 0.3
#: Pivots below this part of the largest: a singular pose may lie ahead; below the second, one does.
_AHEAD, _SINGULAR = 0.7, 0.02
#: Where to look for it, in steps.
_SAMPLES, _COARSE = np.linspace(0.1, 1.3, 9), (0.3, 0.6, 0.9, 1.2)
#: Smallest pivot at a stage, and how far a step leads away from a singular start (units).
_REGULAR, _AWAY = 1e-6, 0.05
#: How well a step over a singular pose must land (units; relative), and the energy it may gain or lose.
_LANDED, _KEPT = 1e-9, 1e-11
#: Lengths of the step in times to the pose, and states that the first guess goes through.
_LENGTHS, _NODES = (2.0, 1.75, 2.3), 3


class AugmentedForm(Form):
    """State ``(q, v, currents, work)``."""

    name = "augmented"
    slots: Array

    def __init__(self, compiled: Compiled, start: StartReport, project: bool = True) -> None:
        if compiled.model.massless:
            raise GeometryError(
                f"links {list(compiled.model.massless)} have no mass or no inertia; give them some, or use "
                "form='one-coordinate', where the effective inertia may stay positive"
            )
        if start.message.endswith(compiled.spread_words):  # the start could not tell the accelerations
            raise GeometryError(compiled.spread_words)
        super().__init__(compiled, np.concatenate([start.q, start.v, compiled.tail]))
        self.project, self.slots = project, start.slots.copy()
        self._history: list[tuple[float, float]] = []
        self._dense: Any = None
        self._largest = 0.0
        self._due, self._blocked, self._from_singular = 0.0, -np.inf, start.pose_class == "singular"
        self._nodes: list[tuple[float, Array]] = []
        self._follows = bool((compiled.tables.slots >= 0).any())
        self._one = np.empty((1, len(self._begin)))

    def rates(self, t: float, y: Array) -> Array:
        """Return the derivative of the state; NaN where no friction loads fit."""
        n = self.compiled.n
        applied = applied_loads(self.compiled, t, y[:n], y[n : 2 * n])
        self._run(t, np.ascontiguousarray(y), 0.0, ONE_STAGE, self._one, 0, 1, applied)
        return np.array(self._one[0])

    def _run(self, t: float, y: Array, h: float, A: Array, K: Array, low: int, high: int, applied: Array) -> Array:
        fresh, _ = kernels.augmented_stages(
            self.compiled.tables,
            y,
            h,
            A,
            K,
            low,
            high,
            self.slots,
            self.compiled.driven_at(t + h * A.sum(axis=1)),
            applied,
            self.out,
        )
        self._note()
        return np.asarray(fresh)

    def step(self, t: float, y: Array, h: float, A: Array, K: Array) -> Array:
        """Return the end of a compiled Runge-Kutta step."""
        return self._run(t, y, h, A, K, 1, len(A), self._none)

    def _projected(self, t: float, y: Array) -> tuple[Array, Array, float, float]:
        """Coordinates and velocities on the constraints, kinetic energy lost on the way, smallest pivot."""
        n = self.compiled.n  # a solver may give strided states
        q, v = np.ascontiguousarray(y[:n]), np.ascontiguousarray(y[n : 2 * n])
        q, v, loss, pivot = kernels.project_state(self.compiled.tables, q, v, self.slots, self.compiled.driven(t))
        return q, v, loss, pivot

    def accept(self, t: float, y: Array) -> Array:
        """Project an accepted state onto the constraints; gears are followed."""
        n = self.compiled.n
        if self._follows:
            self.slots = initial_slots(self.compiled, y[:n], self.slots)
        if not self.project:
            return y
        q, v, loss, self.pivot = self._projected(t, y)
        self.loss += loss
        self._history.append((t, self.pivot))
        fresh = np.concatenate([q, v, y[2 * n :]])
        self._nodes = [*self._nodes[1 - _NODES :], (t, fresh)]
        return fresh

    def state(self, t: float, y: Array) -> tuple[Array, Array]:
        """Coordinates and velocities of a state between steps, on the constraints."""
        n = self.compiled.n
        return self._projected(t, y)[:2] if self.project else (y[:n], y[n : 2 * n])

    def pivot_at(self, t: float, y: Array) -> tuple[float, Array]:
        """Smallest pivot of the constraints at a state, and the coordinates on the constraints."""
        q, _, _, pivot = self._projected(t, y)
        return float(pivot), q

    def proposed_step(self, t: float, step: float) -> float:
        """Look for a singular pose within the next step, which no step may end next to; see `cross`."""
        self._due = 0.0
        if not self._history and self.project:
            # a step away from a start at a singular pose, along its velocity
            y = self._begin
            self.pivot = self._largest = self.pivot_at(t, y)[0]
            self._history, self._nodes = [(t, self.pivot)], [(t, y)]
            speed = float(np.abs(y[self.compiled.n : 2 * self.compiled.n] / self.unit).max())
            if self._from_singular and speed > 0.0:
                self._due = _AWAY / speed
            return step
        if t <= self._blocked:
            return min(step, 1.01 * (self._blocked - t))
        if len(self._nodes) < 2 or self._nodes[-1][0] != t or self.pivot > _AHEAD * self._largest:
            return step
        if not self._falls(t, step):
            return step
        guess = self._guess()
        times = t + step * _SAMPLES
        pivots = [self.pivot_at(at, guess(at))[0] for at in times]
        k = int(np.argmin(pivots))
        if k == len(times) - 1 or not pivots[k] < 0.5 * self.pivot:
            return step
        from scipy.optimize import minimize_scalar

        low = t if k == 0 else times[k - 1]
        found = minimize_scalar(
            lambda at: self.pivot_at(at, guess(at))[0],
            bounds=(low, times[k + 1]),
            method="bounded",
            options={"xatol": 1e-3 * step},
        )
        if found.fun < _SINGULAR * self._largest:
            self._due = float(found.x) - t
        return step

    def _falls(self, t: float, step: float) -> bool:
        """Whether the smallest pivot falls within the next step, by a parabola: cheap, as it is asked at every step."""
        y, n = self._nodes[-1][1], self.compiled.n
        f = self.rates(t, y)
        for part in _COARSE:
            s = part * step
            ahead = y[:n] + s * (y[n : 2 * n] + 0.5 * s * f[n : 2 * n])
            if self.pivot_at(t + s, np.concatenate([ahead, y[n:]]))[0] < 0.6 * self.pivot:
                return True
        return False

    def cross(self, stats: SolverStatistics, bound: float) -> tuple[float, Array, GaussStep] | None:
        """Time and state beyond a singular pose, and the polynomial that leads there; None if no cross is due."""
        ahead, t = self._due, stats.time
        if not ahead > 0.0:
            return None
        self._due, starts = 0.0, len(self._nodes) == 1
        guess = self._guess()
        for length in _LENGTHS:
            h = min(0.5 * length * ahead if starts else length * ahead, bound - t)
            found = self._across(t, h, guess) if h > (0.1 if starts else 1.2) * ahead else None
            if found is not None:
                landing, fresh, pivot, path = found
                if not starts:
                    passed = passed_singular_pose(self, t, t + ahead, landing, path, path, self._largest)
                    stats.events += [DynamicEvent(*event) for event in passed]
                self._history, self._dense, self.pivot = [(landing, pivot)], None, pivot
                self._largest = max(self._largest, pivot)
                self._nodes = [*self._nodes[1 - _NODES :], (landing, fresh)]
                return landing, fresh, path
        # nearer first; next to the pose the ordinary steps must do
        self._blocked = t + (0.5 if self.pivot > 0.1 * self._largest else 3.0) * ahead
        return None

    def _guess(self) -> Callable[[float], Array]:
        """Polynomial through the last states; along the velocity where there is only one."""
        (t, y), n = self._nodes[-1], self.compiled.n
        if len(self._nodes) == 1:
            return lambda at: np.concatenate([y[:n] + (at - t) * y[n : 2 * n], y[n:]])
        times, states = zip(*self._nodes)
        return HermiteGuess(n, list(times), list(states), [self.rates(at, state) for at, state in zip(times, states)])

    def _across(
        self, t: float, h: float, guess: Callable[[float], Array]
    ) -> tuple[float, Array, float, GaussStep] | None:
        """One step of length h over a singular pose; None if it does not land where it should."""
        y, n = self._nodes[-1][1], self.compiled.n

        def evaluate(at: float, q: Array, v: Array, tail: Array) -> tuple[Array, Array]:
            q, v, _, pivot = self._projected(at, np.concatenate([q, v]))
            found = self.rates(at, np.concatenate([q, v, tail]))
            return found[n : 2 * n] if pivot > _REGULAR else np.full(n, np.nan), found[2 * n :]

        path = gauss_step(evaluate, t, y, h, guess, self.unit)
        if path is None:
            return None
        raw = path(t + h)
        q, v, loss, pivot = self._projected(t + h, raw)
        fresh = np.concatenate([q, v, raw[2 * n :]])
        speed = float(np.abs(v / self.unit).max())
        missed = max(np.abs((q - raw[:n]) / self.unit).max(), np.abs((v - raw[n : 2 * n]) / self.unit).max() / speed)
        kept = abs(self._energy(t + h, fresh) - self._energy(t, y) - float(raw[-1] - y[-1]))
        if not missed < _LANDED or not kept <= _KEPT * float(v @ self.compiled.tables.mass @ v):
            return None
        self.loss += loss
        return t + h, fresh, float(pivot), path

    def _energy(self, t: float, y: Array) -> float:
        T, n = self.compiled.tables, self.compiled.n
        q, v = y[:n].copy(), y[n : 2 * n].copy()
        potential = kernels.load_vector(T, kernels.state_rows(T, q, v), self._none, self.compiled.currents)[2]
        return 0.5 * float(v @ T.mass @ v) + float(potential)

    def watch(self, stats: SolverStatistics, before: float, solver: Any) -> None:
        """Find singular poses passed: minima of the smallest pivot."""
        self._largest = max(self._largest, self._history[-1][1] if self._history else 0.0)
        if len(self._history) < 3:
            return
        (t0, p0), (_, p1), (t2, p2) = self._history[-3:]
        largest = self._largest
        if p1 <= p0 and p1 < p2 and p1 < _LOW * largest and self._dense is not None:
            passed = passed_singular_pose(self, t0, float(before), t2, self._dense, solver.dense_output(), largest)
            stats.events += [DynamicEvent(*event) for event in passed]
        self._dense = solver.dense_output() if p2 < _LOW * largest else None
