"""Integration over a smooth piece: the steppers of scipy, DOP853 with compiled stages, CVODE (extra ``stiff``)."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, field, replace
from functools import cache
from io import StringIO
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GraphsynthError
from graphsynth.core.extras import need
from graphsynth.dynamics.result import DynamicEvent
from graphsynth.dynamics.tables import Compiled
from graphsynth.dynamics.values import initial_slots

Array = NDArray[np.float64]
Output = Callable[[int, float, Array], None]

METHODS = ("DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA", "CVODE")
_RUNGE_KUTTA = ("DOP853", "RK45", "RK23")
#: Steps shorter than this part of the longest, so many in a row next to a singular pose, are a failure.
_STALL, _STALLED = 1e-2, 200
#: The same for steps shorter than this part of the whole time.
_TINY = 1e-5
#: What a formulation says where it finds no loads on the way.
NO_LOADS = (
    "there is no motion beyond: the load that friction makes returns to it with a factor that reaches 1, and the joint "
    "jams; reduce the friction coefficient, or lengthen the guide"
)


@dataclass(frozen=True)
class StepOptions:
    """What the integrator is told."""

    method: str
    rtol: float
    atol: Array | float | None
    exact: bool
    project: bool
    max_steps: int

    def scaled(self, sizes: Array) -> StepOptions:
        """Return the options with an absolute tolerance: by default a hundredth of the relative one, in these sizes."""
        return self if self.atol is not None else replace(self, atol=sizes * self.rtol * 0.01)


@dataclass
class SolverStatistics:
    """How an integration went; a workspace."""

    time: float = 0.0
    steps: int = 0
    evaluations: int = 0
    last_step: float = 0.0
    message: str = ""
    events: list[DynamicEvent] = field(default_factory=list)


#: ``(t, y, h, A, K) -> new state``: fills the rows of K after the first with the rates at ``y + h A[s] K``.
Stages = Callable[[float, Array, float, Array, Array], Array]
#: What a kernel reports in ``out[6]``.
_WRONG = (
    "",
    "a spring has length 0, so its direction is not defined",
    NO_LOADS,
    "the dependent coordinates cannot be solved: the mechanism cannot be assembled there",
)


class Form:
    """What a formulation gives the integrator; a solver workspace, not a result.

    ``why`` is the reason of a failure, ``stall`` what steps that become ever shorter mean; ``loss`` the kinetic energy
    removed by projection so far (J); ``pivot`` the smallest pivot of the constraints; ``contraction`` the largest
    factor with which a load of friction returned to itself; ``slots`` those of gears and racks, None where they are
    found at every pose; ``unit`` the units of the coordinates in the state.
    """

    name = why = ""
    stall = (
        "at the singular pose there branches meet or nearly meet, and the equations do not tell how the motion goes "
        "on; change the dimensions, or start elsewhere"
    )
    loss = contraction = 0.0
    pivot = 1.0
    slots: Array | None = None

    def __init__(self, compiled: Compiled, begin: Array) -> None:
        self.compiled, self.unit, self._begin = compiled, compiled.unit, begin
        self.changes: list[tuple[float, str]] = []
        self.out, self._none = np.zeros(7), np.zeros(compiled.n)

    @property
    def stages(self) -> Stages | None:
        """A compiled Runge-Kutta step, if no load is given as a function."""
        return None if self.compiled.applied else self.step

    def begin(self) -> Array:
        """State of the form at the start."""
        return self._begin.copy()

    def slots_at(self, q: Array) -> Array:
        """Slots of gears and racks at a pose."""
        return initial_slots(self.compiled, q) if self.slots is None else self.slots

    def rates(self, t: float, y: Array) -> Array:
        """Rate of that state."""
        raise NotImplementedError

    def step(self, t: float, y: Array, h: float, A: Array, K: Array) -> Array:
        """Return the end of a compiled Runge-Kutta step, see `Stages`."""
        raise NotImplementedError

    def state(self, t: float, y: Array) -> tuple[Array, Array]:
        """Coordinates and velocities of the mechanism."""
        raise NotImplementedError

    def accelerations(self, t: float, y: Array) -> Array | None:
        """Accelerations of all coordinates, where the form has them without multipliers."""

    def accept(self, t: float, y: Array) -> Array:
        """State that the next step starts from."""
        return y

    def refuses(self, t: float, y: Array) -> bool:
        """Whether the formulation does not hold over the step just made."""
        return False

    def proposed_step(self, t: float, step: float) -> float:
        """Length of the next step."""
        return step

    def cross(self, stats: SolverStatistics, bound: float) -> tuple[float, Array, Callable[[float], Array]] | None:
        """Time and state beyond a singular pose, and the way there; None if no step is to lead over one."""

    def watch(self, stats: SolverStatistics, before: float, solver: Any) -> None:
        """Look for singular poses in the step just made."""

    def _note(self) -> None:
        """Note what the kernels found wrong."""
        if self.out[6] > 0.0:
            self.why = _WRONG[int(self.out[6])]
        else:
            self.contraction = max(self.contraction, float(self.out[3]))
        self.out[6] = 0.0


class Finding(NamedTuple):
    """What to do after a step: go on (nothing), again with a step, up to an event, or stop with a message."""

    step: float | None = None
    event: float | None = None
    message: str = ""


class Watch(Protocol):
    """What watches the steps of one piece of a motion, and ends it at an event."""

    def longest(self) -> float:
        """Longest step allowed."""

    def look(self, stepper: Stepper, t0: float, y0: Array, solver: Any) -> Finding:
        """Look at a step from ``(t0, y0)`` that the solver has made."""


class Stepper:
    """Integration over one smooth piece."""

    def __init__(
        self,
        form: Form,
        stats: SolverStatistics,
        options: StepOptions,
        end: float,
        at_break: bool,
        guard: Watch | None = None,
    ) -> None:
        self.form, self.stats, self.options, self.end, self.guard = form, stats, options, end, guard
        self.longest, self.stalled, self.lost = 0.0, 0, False
        self.exact = options.exact or options.method not in (*_RUNGE_KUTTA, "Radau")
        self.latest = float(np.nextafter(end, -np.inf)) if at_break else np.inf

    def rates(self, t: float, y: Array) -> Array:
        """Rates of the form, seen from this side of the next break."""
        self.stats.evaluations += 1
        found = self.form.rates(min(t, self.latest), y)
        self.lost = self.lost or not np.isfinite(found).all()
        return found

    def solver(self, t: float, y: Array, bound: float, first: float | None) -> Any:
        """Return a solver of the method from a state to a bound."""
        from scipy import integrate as scipy_integrate

        method = self.options.method
        options: dict[str, Any] = {"rtol": self.options.rtol, "atol": self.options.atol}
        if method == "CVODE":
            return CvodeStepper(self.rates, t, y, bound, **options)
        if first is not None:
            options["first_step"] = min(first, bound - t)
        stages = self.form.stages
        if method != "DOP853" or stages is None:
            return getattr(scipy_integrate, method)(self.rates, t, y, bound, **options)
        solver = _stepper_class()(self.rates, t, y, bound, **options)
        solver.stages, solver.stats = stages, self.stats
        return solver

    def reached(self, t0: float, y0: Array, t: float) -> Array | None:
        """State at a time, by steps of their own from a node; None if they fail."""
        solver = self.solver(t0, y0, t, t - t0)
        while solver.status == "running":
            solver.step()
        return None if solver.status == "failed" else np.asarray(solver.y)

    def run(self, y: Array, grid: Array, output: Output) -> Array | None:
        """Integrate to the end of the piece, or to where the guard ends it; None if that fails."""
        stats = self.stats
        if not np.isfinite(self.rates(stats.time, y)).all():
            stats.message = "the equations of motion have no value at the start"
            return None
        k = int(np.searchsorted(grid, stats.time, side="right"))
        solver = None
        step: float | None = None
        while stats.time < self.end:
            bound = min(float(grid[k]), self.end) if self.exact and k < len(grid) else self.end
            if solver is None or solver.status == "finished":
                solver = self._next(solver, stats.time, y, bound, step)
            before = stats.time
            if self.options.method == "DOP853":
                solver.h_abs = self.form.proposed_step(before, solver.h_abs)
                crossed = self.form.cross(stats, self.end)
                if crossed is not None:
                    stats.time, y, path = crossed
                    while k < len(grid) and grid[k] <= stats.time:
                        output(k, float(grid[k]), path(float(grid[k])))
                        k += 1
                    step, solver = stats.last_step or None, None
                    continue
            if self.guard is not None and hasattr(solver, "h_abs"):
                solver.h_abs = min(solver.h_abs, self.guard.longest())
            message = self._step(solver)
            stats.steps += 1
            if solver.status == "failed" or not np.isfinite(solver.y).all():
                from graphsynth.dynamics.singular import lock

                said = str(message or "the solver gave no finite state").rstrip(".")
                stats.message = ": ".join(filter(None, (said, lock(self.form, before, y))))
                return None
            self.longest = max(self.longest, float(solver.t) - before)
            least = max(_STALL * self.longest, _TINY * float(grid[-1] - grid[0]))
            short = float(solver.t) - before < least and self.form.pivot < 0.05
            self.stalled = self.stalled + 1 if short else 0
            if self.stalled > _STALLED:
                from graphsynth.dynamics.singular import stalled

                stats.message = f"no way past t = {float(solver.t):.9g} s: {stalled(self.form, before, y)}"
                return None
            if stats.steps >= self.options.max_steps:
                stats.message = f"more than {self.options.max_steps} steps"
                return None
            if self.guard is not None:
                found = self.guard.look(self, before, y, solver)
                if found.message:
                    stats.message = found.message
                    return None
                if found.step is not None:  # again from here, shorter; to the event if there is one
                    self.end = self.end if found.event is None else found.event
                    solver, step = None, found.step
                    continue
            if self.form.refuses(float(solver.t), np.asarray(solver.y)):
                stats.message = "the formulation does not hold beyond this time"
                return None
            k = self._outputs(solver, before, grid, k, output)
            stats.time, stats.last_step = float(solver.t), float(solver.t) - before
            y, step, keep = self._accepted(solver, step)
            if self.options.method in _RUNGE_KUTTA:
                self.form.watch(stats, before, solver)
            solver = solver if keep else None
        return y

    def _step(self, solver: Any) -> str | None:
        """One step; an implicit solver that meets rates without a value raises, and that is a failure like others."""
        try:
            message: str | None = solver.step()
        except (ValueError, np.linalg.LinAlgError) as error:
            if not self.lost or isinstance(error, GraphsynthError):
                raise
            solver.status, message = "failed", "the equations of motion have no value on the way"
        return message

    def _next(self, solver: Any, t: float, y: Array, bound: float, step: float | None) -> Any:
        """Return a solver to go on; a Runge-Kutta solver is taken on with its proposed step."""
        if solver is not None and self.options.method in _RUNGE_KUTTA:
            solver.t_bound, solver.status = bound, "running"
            if step is not None:
                solver.h_abs = max(solver.h_abs, step)
            return solver
        return self.solver(t, y, bound, step)

    def _outputs(self, solver: Any, before: float, grid: Array, k: int, output: Output) -> int:
        dense = None
        while k < len(grid) and grid[k] <= solver.t:
            t = float(grid[k])
            if t == solver.t:
                output(k, t, np.asarray(solver.y))
            else:
                dense = solver.dense_output() if dense is None else dense
                output(k, t, np.asarray(dense(t)))
            k += 1
        return k

    def _accepted(self, solver: Any, step: float | None) -> tuple[Array, float | None, bool]:
        """Project; state, proposed step, and whether the solver goes on from there.

        A Runge-Kutta solver goes on from the projected state with the step size it proposed; Radau starts anew
        with it; a multistep solver would fall back to low order, so it is left alone except where it lands.
        """
        t, y = float(solver.t), np.asarray(solver.y)
        finished = solver.status == "finished"
        if self.options.method not in (*_RUNGE_KUTTA, "Radau") and not finished and self.form.name == "augmented":
            return y, step, True
        changed = self.form.accept(t, y)
        proposed = float(getattr(solver, "h_abs", 0.0))
        step = max(proposed, step or 0.0) if finished else proposed
        if changed is y:
            return y, step or None, True
        if self.options.method in _RUNGE_KUTTA:
            solver.y = changed
            solver.f = self.rates(t, changed)
            return changed, step or None, True
        return changed, (step or None) if self.options.method == "Radau" else None, False


#: The table of a "step" that only evaluates the rates at a state.
ONE_STAGE: Array = np.zeros((1, 1))

# of scipy.integrate's Runge-Kutta methods
_SAFETY, _LEAST, _MOST = 0.9, 0.2, 10.0


@cache
def _stepper_class() -> Any:
    from scipy.integrate import DOP853

    A = np.vstack([DOP853.A, DOP853.B])  # the last row leads to the new state

    class CompiledDOP853(DOP853):  # type: ignore[misc]  # scipy has no types
        """The step of `scipy.integrate.DOP853` with compiled stages."""

        stages: Stages
        stats: SolverStatistics

        t: float
        y: Array
        f: Array
        h_abs: float

        def _step_impl(self) -> tuple[bool, str | None]:
            t, y = self.t, self.y
            least = 10.0 * abs(np.nextafter(t, np.inf) - t)
            size, rejected = min(max(self.h_abs, least), self.max_step), False
            while True:
                if size < least:
                    return False, self.TOO_SMALL_STEP
                fresh_t = min(t + size, self.t_bound)
                h = fresh_t - t
                size = abs(h)
                self.K[0] = self.f
                fresh = self.stages(t, y, h, A, self.K)
                self.stats.evaluations += self.n_stages
                scale = self.atol + np.maximum(np.abs(y), np.abs(fresh)) * self.rtol
                error = self._estimate_error_norm(self.K, h, scale)
                if error < 1.0:
                    factor = _MOST if error == 0.0 else min(_MOST, _SAFETY * error**self.error_exponent)
                    self.h_previous, self.y_old = h, y
                    self.h_abs = size * (min(1.0, factor) if rejected else factor)
                    self.t, self.y, self.f = fresh_t, fresh, self.K[-1].copy()
                    return True, None
                size *= max(_LEAST, _SAFETY * error**self.error_exponent) if error == error else _LEAST
                rejected = True

    return CompiledDOP853


#: Where SUNDIALS is told to write its warnings, read when a solver is made.
_WARNINGS = "SUNLOGGER_WARNING_FILENAME"


@contextmanager
def _collected() -> Iterator[StringIO]:
    """Collect what the solver prints of a failure, and drop its warnings: the result says what happened.

    Somebody who has told SUNDIALS where to write its warnings gets them there.
    """
    own = _WARNINGS not in os.environ
    if own:
        os.environ[_WARNINGS] = os.devnull
    try:
        with redirect_stdout(StringIO()) as said:
            yield said
    finally:
        if own:
            os.environ.pop(_WARNINGS, None)


class CvodeStepper:
    """One internal step of CVODE a call, the last one ending at the bound."""

    def __init__(
        self, rates: Callable[[float, Array], Array], t: float, y: Array, bound: float, rtol: float, atol: Array | float
    ) -> None:
        CVODE = need("sksundae.cvode", "stiff", "method 'CVODE'").CVODE

        def right_hand_side(time: float, state: Array, found: Array) -> None:
            found[:] = rates(time, np.array(state))

        with _collected():
            self._solver: Any = CVODE(right_hand_side, rtol=rtol, atol=atol, method="BDF")
            self._solver.init_step(t, np.array(y))
        self.t, self.y, self.t_bound, self.status = t, np.array(y), bound, "running"

    def step(self) -> str | None:
        """Take one step; the status is "failed" if the solver could not, "finished" at the bound."""
        with _collected() as said:
            found = self._solver.step(self.t_bound, method="onestep", tstop=self.t_bound)
        if not found.success:
            self.status = "failed"
            return " ".join(f"{found.message} {said.getvalue()}".split())
        self.t, self.y = float(found.t), np.asarray(found.y)
        if self.t >= self.t_bound:
            self.t, self.status = self.t_bound, "finished"
        return None
