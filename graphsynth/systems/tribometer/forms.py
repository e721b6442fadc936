"""The two other forms of the stick-slip model: time stepping with complementarity, regularised friction."""

from __future__ import annotations

import math
import time
import warnings
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite, positive, whole
from graphsynth.core.errors import SpecError, TooLargeError
from graphsynth.systems.tribometer.motion import (
    RunStatus,
    StickSlipEvent,
    StickSlipMotion,
    event_driven,
    motion_of,
    output_times,
)
from graphsynth.systems.tribometer.platforms import Platforms, StribeckLaw, TwoCoefficientLaw

Array = NDArray[np.float64]
#: Solvers of scipy that the regularised form accepts.
SOLVERS = ("LSODA", "BDF", "Radau", "DOP853", "RK45", "RK23")
_IMPLICIT = ("LSODA", "BDF", "Radau")
_MOST_STEPS = 20_000_000
#: A solver is called unreliable if another one differs by more than this share of the error of the form.
_SHARE = 0.5


_Events = tuple[StickSlipEvent, ...]


def time_stepping(
    self: Platforms,
    duration: float = 10.0,
    *,
    step: float = 1e-4,
    times: ArrayLike | None = None,
    weight: float = 0.5,
    estimate: bool = True,
) -> StickSlipMotion:
    """March with equal steps, ``step`` s at most, and friction impulses from a complementarity problem.

    First order; needs no event location, so it survives Zeno behaviour.  ``weight``, 0 to 1, is that of the end of a
    step.  Changes come at whole steps; errors are estimated by two runs with longer steps.  `SpecError` or
    `TooLargeError` if a number is out of its bounds, or the steps are too many.
    """
    (duration, times), step = output_times(duration, times), positive("step", step, SpecError)
    if not 0.0 <= finite("weight of the step", weight, SpecError) <= 1.0:
        raise SpecError(f"The weight of the step is {weight:g}; give a number from 0 to 1, best 0.5.")
    count = max(1, math.ceil(duration / step * (1.0 - 1e-12)))
    if count > _MOST_STEPS:
        raise TooLargeError(
            f"The step {step:g} s needs {count} steps, more than {_MOST_STEPS}; give a step of at least "
            f"{duration / _MOST_STEPS:.2g} s or a shorter run.",
            count,
        )
    _march(self, duration, 1, weight)  # compilation is no part of the run time
    begin = time.perf_counter()
    march = _march(self, duration, count, weight)
    x2 = march.between(times, duration, 0)
    seconds = time.perf_counter() - begin
    failed, h = march.done < count, duration / count
    error, events = math.nan, march.changes(h)
    if estimate and not failed:
        error, events = _stepping_error(self, duration, times, weight, count, x2, events)
    end = march.done * h if failed else duration
    statement = f"{len(events)} changes of the contact in {duration:g} s, step {h:g} s."
    if failed:
        statement = (
            f"Failed: the numbers left the range of floating point at {end:.9g} s; use a weight of at least 0.5."
        )
    state, friction = march.path[np.minimum(np.ceil(times / h - 1e-9).astype(int), count), 2:].T
    driven, heat, damped = march.energies.tolist()
    return motion_of(
        self,
        "time stepping",
        times,
        np.stack([x2, march.between(times, duration, 1), state, friction]),
        status=RunStatus.FAILED if failed else RunStatus.COMPLETE,
        statement=statement,
        end=end,
        error=error,
        evaluations=march.done,
        seconds=seconds,
        events=events,
        energy_residual=_residual(self, march),
        friction_loss=heat,
        drive_work=driven,
        damper_loss=damped,
    )


class _March(NamedTuple):
    """Position, velocity, state and friction force at every step; energies, and the steps that stayed finite."""

    path: Array
    energies: Array
    done: int

    def between(self, times: Array, duration: float, column: int) -> Array:
        """Interpolate between steps, linearly: the method itself knows no more."""
        return np.asarray(np.interp(times, np.linspace(0.0, duration, len(self.path)), self.path[:, column]))

    def changes(self, h: float) -> _Events:
        """Return the changes of the contact."""
        path = self.path[: self.done + 1]
        at = np.flatnonzero(np.diff(path[:, 2])) + 1
        rows = zip((at * h).tolist(), path[at, 2].astype(int).tolist(), path[at, 0].tolist())
        return tuple(StickSlipEvent(*row, math.nan) for row in rows)


def _march(model: Platforms, duration: float, count: int, weight: float) -> _March:
    from graphsynth.systems.tribometer.kernels.plant import march

    path, energies = np.full((count + 1, 4), math.nan), np.zeros(3)
    v, state = model.start()
    path[0] = model.x2, v, state, math.nan
    with np.errstate(over="ignore", invalid="ignore"):
        done = march(model.data(), model.x2, v, duration / count, weight, path, energies)
    path[0, 3] = path[1, 3]
    return _March(path, energies, int(done))


def _stepping_error(
    model: Platforms, duration: float, times: Array, weight: float, count: int, x2: Array, events: _Events
) -> tuple[float, _Events]:
    """Estimate the errors from two coarser runs: one alone agrees by chance where releases fall alike on the steps.

    Errors of the event times are from the run with steps of twice the length; NaN if its events differ.
    """
    worst = 0.0
    for share in (0.5, 0.7):
        fewer = max(1, int(share * count))
        other = _march(model, duration, fewer, weight)
        if other.done < fewer or fewer == count:
            return math.nan, events
        gap = float(np.abs(x2 - other.between(times, duration, 0)).max())
        worst = max(worst, gap * fewer / (count - fewer))
        coarse = other.changes(duration / fewer) if share == 0.5 else ()
        if [event.state for event in events] == [event.state for event in coarse]:
            step = duration / count
            events = tuple(a._replace(error=abs(a.time - b.time) + step) for a, b in zip(events, coarse))
    return worst, events


def _residual(model: Platforms, march: _March) -> float:
    path = march.path[: march.done + 1]
    energy = 0.5 * model.mass * path[:, 1] ** 2 + 0.5 * model.stiffness * path[:, 0] ** 2
    driven, heat, damped = march.energies
    exchanged = max(float(np.abs(march.energies).max()), float(np.ptp(energy)))
    gap = abs(energy[-1] - energy[0] - (driven - heat - damped))
    return float(gap / exchanged) if exchanged > 0.0 else 0.0


def model_error(speed: float) -> float:
    """Error of the position that regularised friction makes in reference C, ``0.15 s eps ln((1 m/s)/eps)``, m.

    Measured for ``eps`` from 1e-8 to 1e-2 m/s (theory/tribometer 10); for another tribometer an order of magnitude.

    Examples
    --------
    >>> f"{model_error(1e-5):.1e}"
    '1.7e-05'
    """
    return 0.15 * speed * max(math.log(1.0 / speed), 1.0)


class _Solving(NamedTuple):
    """Smoothing velocity (m/s), solver of scipy, tolerance, whether it gets the Jacobian, bound on its calls."""

    speed: float
    solver: str
    rtol: float
    jacobian: bool
    most_calls: int


class _Solution(NamedTuple):
    """What a solver returned: x2 and v2 at the times (NaN beyond its end), the end, calls, complaint."""

    y: Array
    end: float
    calls: int
    seconds: float
    complaint: str = ""


def regularised(
    self: Platforms,
    duration: float = 10.0,
    *,
    speed: float = 1e-5,
    solver: str = "Radau",
    times: ArrayLike | None = None,
    rtol: float = 1e-8,
    jacobian: bool = True,
    check: bool | None = None,
    most_calls: int = 2_000_000,
) -> StickSlipMotion:
    """Solve the form with ``F = N mu(|u|) tanh(u / speed)``, which any solver of scipy accepts (see `SOLVERS`).

    It never sticks: the upper platform creeps.  The error of the result is its difference from an event-driven run.
    The smoothing velocity ``speed`` (m/s) lies below the Stribeck velocity; the absolute tolerance is a hundredth of
    ``rtol`` (of m, m/s); ``jacobian`` gives the exact Jacobian to the implicit solvers; ``most_calls`` bounds the calls
    of the right-hand side.  ``check`` compares with a second implicit solver; None: if the solver is LSODA, which can
    report a wrong answer as a success.

    `RunStatus.FAILED` if the solver stopped, `RunStatus.UNRELIABLE` if the cross-check objects; `SpecError` if the law
    has two coefficients, or a number is out of its bounds.
    """
    duration, times = output_times(duration, times)
    if not 1e-13 <= finite("relative tolerance", rtol, SpecError) <= 1e-2:
        raise SpecError(f"The relative tolerance is {rtol:g}; give a number from 1e-13 to 1e-2.")
    calls = whole("most_calls", most_calls, 1, error=SpecError)
    how = _Solving(positive("smoothing velocity", speed, SpecError), str(solver), rtol, jacobian, calls)
    _refuse(self, how)
    found = _solve(self, duration, times, how)
    reference = event_driven(self, duration, times=times, estimate=False)
    exact = reference.x2 if reference.complete else None
    status, statement = RunStatus.COMPLETE, f"{how.solver} reached {duration:g} s."
    if found.complaint:
        status = RunStatus.FAILED
        stopped = f"{how.solver} stopped at {found.end:.9g} s of {duration:g} s ({found.complaint})"
        statement = f"Failed: {stopped}; use Radau."
    elif solver == "LSODA" if check is None else check:
        status, statement = _cross_checked(self, duration, times, how, found.y[0], exact)
    u = self.drive.motion(times).v - found.y[1]
    friction = self.normal * self.law.coefficient(np.abs(u)) * np.tanh(u / how.speed)
    return motion_of(
        self,
        f"regularised ({how.solver})",
        times,
        np.stack([*found.y, np.sign(u), friction]),
        status=status,
        statement=statement,
        end=found.end,
        error=math.nan if exact is None else float(np.abs(found.y[0] - exact).max()),
        evaluations=found.calls,
        seconds=found.seconds,
    )


def _cross_checked(
    model: Platforms, duration: float, times: Array, how: _Solving, x2: Array, exact: Array | None
) -> tuple[RunStatus, str]:
    """Compare with a second implicit solver; their difference has to be small beside the error of the form."""
    solver, other = how.solver, "BDF" if how.solver == "Radau" else "Radau"
    second = _solve(model, duration, times, how._replace(solver=other, jacobian=True))
    if second.complaint:
        why = f"but {other} failed ({second.complaint}): no cross-check; use Radau."
        return RunStatus.UNRELIABLE, f"{solver} reached {duration:g} s, {why}"
    gap = float(np.abs(x2 - second.y[0]).max())
    form = model_error(how.speed) if exact is None else float(np.abs(second.y[0] - exact).max())
    if gap <= _SHARE * form:
        return RunStatus.COMPLETE, f"{solver} reached {duration:g} s; {other} differs by {gap:.2g} m."
    statement = (
        f"{solver} reports success, but {other} differs by {gap:.2g} m, not small beside the error {form:.2g} m "
    )
    return RunStatus.UNRELIABLE, statement + "of the form itself; use Radau or a smaller tolerance."


def _refuse(model: Platforms, how: _Solving) -> None:
    if how.solver not in SOLVERS:
        raise SpecError(f"The solver {how.solver!r} is not known; give one of {', '.join(SOLVERS)}.")
    law = model.law
    if isinstance(law, TwoCoefficientLaw) and law.static != law.kinetic:
        raise SpecError(
            "The regularised form cannot represent the two-coefficient law: it needs a smoothing velocity far below "
            "the Stribeck velocity, and here that is zero; use event_driven or time_stepping, or a StribeckLaw."
        )
    if isinstance(law, StribeckLaw) and not how.speed < law.velocity:
        raise SpecError(
            f"The smoothing velocity {how.speed:g} m/s is not below the Stribeck velocity {law.velocity:g} m/s, "
            "so that the static friction would never be reached; give at most a tenth of it."
        )


class _ExhaustedError(Exception):
    """The bound on the calls of the right-hand side is reached, at the time that is its argument."""


def _solve(model: Platforms, duration: float, times: Array, how: _Solving) -> _Solution:
    """Run a solver of scipy and believe nothing: status, end and finite numbers are checked."""
    from scipy.integrate import solve_ivp

    from graphsynth.systems.tribometer.kernels.plant import regularised as rate, regularised_slope as slope

    data, start, calls = model.data(), np.array([model.x2, model.start()[0]]), 0

    def rhs(t: float, y: Array) -> Array:
        nonlocal calls
        calls += 1
        if calls > how.most_calls:
            raise _ExhaustedError(float(t))
        out = np.empty(2)
        rate(t, y, data, how.speed, out)
        return out

    def jac(t: float, y: Array) -> Array:
        damping = model.damping + slope(t, y, data, how.speed)
        return np.array([[0.0, 1.0], [-model.stiffness / model.mass, -damping / model.mass]])

    rhs(0.0, start)
    jac(0.0, start)
    options: dict[str, Any] = {"jac": jac} if how.jacobian and how.solver in _IMPLICIT else {}
    # the absolute tolerance is 1e-10 for the relative one 1e-8 of theory/tribometer 10
    options |= {"method": how.solver, "t_eval": times, "rtol": how.rtol, "atol": 0.01 * how.rtol, "max_step": 0.02}
    blank = np.full((2, times.size), math.nan)
    begin = time.perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = solve_ivp(rhs, (0.0, duration), start, **options)
    except _ExhaustedError as stop:
        complaint = f"more than {how.most_calls} calls"
        return _Solution(blank, stop.args[0], how.most_calls, time.perf_counter() - begin, complaint)
    except (ValueError, ArithmeticError, np.linalg.LinAlgError) as problem:
        return _Solution(blank, 0.0, 0, time.perf_counter() - begin, str(problem).rstrip("."))
    seconds = time.perf_counter() - begin
    got = np.asarray(found.y, float).reshape(2, -1) if np.size(found.y) else np.empty((2, 0))
    reached = got.shape[1]
    blank[:, :reached] = got[:, : times.size]
    if found.status != 0:
        complaint = f"status {found.status}, {found.message}".rstrip(".")
    elif reached != times.size:
        complaint = f"{reached} of {times.size} times returned"
    elif not np.isfinite(blank).all():
        complaint = "not a number in the result"
    else:
        return _Solution(blank, duration, int(found.nfev), seconds)
    return _Solution(blank, float(times[reached - 1]) if reached else 0.0, int(found.nfev), seconds, complaint)
