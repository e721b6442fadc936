"""The integration loop: scipy's steppers, projection after every step, breaks, outputs, singular poses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GraphsynthError
from graphsynth.dynamics.result import DynamicEvent
from graphsynth.dynamics.singular import lock, stalled
from graphsynth.dynamics.switching import KINDS, Switches

if TYPE_CHECKING:
    from graphsynth.dynamics.friction.guard import Guard
    from graphsynth.dynamics.integrate import Form

Array = NDArray[np.float64]
Output = Callable[[int, float, Array], None]

METHODS = ("DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA", "CVODE")
_RUNGE_KUTTA = ("DOP853", "RK45", "RK23")
#: Steps shorter than this part of the longest, so many in a row next to a singular pose, are a failure.
_STALL, _STALLED = 1e-2, 200
#: The same for steps shorter than this part of the whole time.
_TINY = 1e-5
#: Events of one motion.
_EVENTS = 2_000


@dataclass(frozen=True)
class StepOptions:
    """What the integrator is told."""

    method: str
    rtol: float
    atol: float | None
    exact: bool
    project: bool
    max_steps: int


@dataclass
class Trail:
    """How an integration went; a workspace."""

    time: float = 0.0
    steps: int = 0
    evaluations: int = 0
    last_step: float = 0.0
    message: str = ""
    events: list[DynamicEvent] = field(default_factory=list)


def integrate(
    form: Form, grid: Array, breaks: Sequence[float], method: str, rtol: float, atol: Array | float, exact: bool,
    max_steps: int, output: Output,
) -> Trail:  # fmt: skip
    """Integrate a formulation over the output times; how far it came is in the trail.

    Parameters
    ----------
    breaks : sequence of float
        Times that no step crosses; loads are taken from their own side of them.
    exact : bool
        End a step at every output time.
    output : callable
        Called with index, time and state at every output time reached.
    """
    trail = Trail(time=float(grid[0]))
    y = form.begin()
    output(0, trail.time, y)
    inner = [t for t in breaks if grid[0] < t < grid[-1]]
    for t in inner:
        trail.events.append(DynamicEvent("break", t, 0.0, f"loads are not smooth at t = {t:.9g} s"))
    ends = [*inner, float(grid[-1])]
    watching = any(drive.switches for drive in form.compiled.drives)
    flipped: list[tuple[int, int]] = []
    while ends:
        began = trail.time
        guard = Switches(form, trail.time, y, flipped) if watching else None
        stepper = Stepper(form, trail, method, rtol, atol, exact, ends[0], at_break=ends[0] in inner, guard=guard)
        last = stepper.run(y, grid, max_steps, output)
        if last is None:
            break
        y = last
        if trail.time > began:
            flipped = []
        if guard is not None and guard.hit is not None:
            flipped.append(guard.hit)
            if len(trail.events) >= _EVENTS:
                trail.message = f"Zeno behaviour: more than {_EVENTS} events by t = {trail.time:.9g} s"
                break
            kind = KINDS[guard.hit[1]]
            trail.events.append(DynamicEvent(kind, trail.time, 4.0 * np.spacing(trail.time), guard.flip(trail.time, y)))
        if trail.time >= ends[0]:
            ends.pop(0)
    return trail


class Stepper:
    """Integration over one smooth piece."""

    def __init__(
        self, form: Form, trail: Trail, method: str, rtol: float, atol: Array | float, exact: bool, end: float,
        at_break: bool, guard: Guard | Switches | None = None,
    ) -> None:  # fmt: skip
        self.form, self.trail, self.method, self.rtol, self.atol = form, trail, method, rtol, atol
        self.longest, self.stalled, self.lost = 0.0, 0, False
        self.exact = exact or method not in (*_RUNGE_KUTTA, "Radau")
        self.end, self.guard = end, guard
        self.latest = float(np.nextafter(end, -np.inf)) if at_break else np.inf

    def rates(self, t: float, y: Array) -> Array:
        """Rates of the form, seen from this side of the next break."""
        self.trail.evaluations += 1
        found = self.form.rates(min(t, self.latest), y)
        self.lost = self.lost or not np.isfinite(found).all()
        return found

    def solver(self, t: float, y: Array, bound: float, first: float | None) -> Any:
        """Return a solver of the method from a state to a bound."""
        from scipy import integrate as scipy_integrate

        if self.method == "CVODE":
            from graphsynth.dynamics.steppers import CvodeStepper

            return CvodeStepper(self.rates, t, y, bound, self.rtol, self.atol)
        stages = getattr(self.form, "stages", None)
        if self.method == "DOP853" and stages is not None:
            from graphsynth.dynamics.steppers import compiled_stepper

            return compiled_stepper(stages, self.rates, t, y, bound, self.rtol, self.atol, first, self.trail)
        options: dict[str, Any] = {"rtol": self.rtol, "atol": self.atol}
        if first is not None:
            options["first_step"] = min(first, bound - t)
        return getattr(scipy_integrate, self.method)(self.rates, t, y, bound, **options)

    def reached(self, t0: float, y0: Array, t: float) -> Array | None:
        """State at a time, by steps of their own from a node; None if they fail."""
        solver = self.solver(t0, y0, t, t - t0)
        while solver.status == "running":
            solver.step()
        return None if solver.status == "failed" else np.asarray(solver.y)

    def run(self, y: Array, grid: Array, max_steps: int, output: Output) -> Array | None:
        """Integrate to the end of the piece, or to where the guard ends it; None if that fails."""
        trail = self.trail
        if not np.isfinite(self.rates(trail.time, y)).all():
            trail.message = "the equations of motion have no value at the start"
            return None
        k = int(np.searchsorted(grid, trail.time, side="right"))
        solver = None
        step: float | None = None
        while trail.time < self.end:
            bound = min(float(grid[k]), self.end) if self.exact and k < len(grid) else self.end
            if solver is None or solver.status == "finished":
                solver = self._next(solver, trail.time, y, bound, step)
            before = trail.time
            cross = self._cross(solver) if self.method == "DOP853" else None
            if cross is not None:
                trail.time, y, path = cross
                while k < len(grid) and grid[k] <= trail.time:
                    output(k, float(grid[k]), path(float(grid[k])))
                    k += 1
                step, solver = trail.last_step or None, None
                continue
            if self.guard is not None and hasattr(solver, "h_abs"):
                solver.h_abs = min(solver.h_abs, self.guard.longest())
            message = self._step(solver)
            trail.steps += 1
            if solver.status == "failed" or not np.isfinite(solver.y).all():
                said = str(message or "the solver gave no finite state").rstrip(".")
                trail.message = ": ".join(filter(None, (said, lock(self.form, before, y))))
                return None
            if self._stalls(float(solver.t) - before, float(grid[-1] - grid[0])):
                trail.message = f"no way past t = {float(solver.t):.9g} s: {stalled(self.form, before, y)}"
                return None
            if trail.steps >= max_steps:
                trail.message = f"more than {max_steps} steps"
                return None
            if self.guard is not None:
                found = self.guard.look(self, before, y, solver)
                if found.message:
                    trail.message = found.message
                    return None
                if found.step is not None:  # again from here, shorter; to the event if there is one
                    self.end = self.end if found.event is None else found.event
                    solver, step = None, found.step
                    continue
            if self._refused(solver):
                trail.message = "the formulation does not hold beyond this time"
                return None
            k = self._outputs(solver, before, grid, k, output)
            trail.time, trail.last_step = float(solver.t), float(solver.t) - before
            y, step, keep = self._accepted(solver, step)
            self._watch(before, solver)
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

    def _stalls(self, step: float, span: float) -> bool:
        """Whether steps have become hopelessly short next to a singular pose."""
        self.longest = max(self.longest, step)
        short = step < max(_STALL * self.longest, _TINY * span) and self.form.pivot < 0.05
        self.stalled = self.stalled + 1 if short else 0
        return self.stalled > _STALLED

    def _cross(self, solver: Any) -> Any:
        """Propose the next step; where a singular pose is ahead, the state beyond it."""
        propose = getattr(self.form, "proposed_step", None)
        if propose is None:
            return None
        solver.h_abs = propose(self.trail.time, solver.h_abs)
        found: Any = getattr(self.form, "cross", lambda *_: None)(self.trail, self.end)
        return found

    def _refused(self, solver: Any) -> bool:
        """Whether the formulation does not hold over the step just made."""
        refuses = getattr(self.form, "refuses", None)
        return refuses is not None and bool(refuses(float(solver.t), np.asarray(solver.y)))

    def _next(self, solver: Any, t: float, y: Array, bound: float, step: float | None) -> Any:
        """Return a solver to go on; a Runge-Kutta solver is taken on with its proposed step."""
        if solver is not None and self.method in _RUNGE_KUTTA:
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
        if self.method not in (*_RUNGE_KUTTA, "Radau") and not finished and self.form.name == "augmented":
            return y, step, True
        changed = self.form.accept(t, y)
        proposed = float(getattr(solver, "h_abs", 0.0))
        step = max(proposed, step or 0.0) if finished else proposed
        if changed is y:
            return y, step or None, True
        if self.method in _RUNGE_KUTTA:
            solver.y = changed
            solver.f = self.rates(t, changed)
            return changed, step or None, True
        return changed, (step or None) if self.method == "Radau" else None, False

    def _watch(self, before: float, solver: Any) -> None:
        """Let the formulation look for singular poses in the step just made."""
        watch = getattr(self.form, "watch", None)
        if watch is not None and self.method in _RUNGE_KUTTA:
            watch(self.trail, before, solver)
