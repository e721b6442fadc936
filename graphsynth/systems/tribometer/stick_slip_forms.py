"""The two other forms of the stick-slip model: time stepping with complementarity, regularised friction."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError, TooLargeError
from graphsynth.dynamics.friction.laws import finite, positive
from graphsynth.systems.tribometer.events import RunStatus, StickSlipEvent
from graphsynth.systems.tribometer.stick_slip import StickSlipMotion

if TYPE_CHECKING:
    from graphsynth.systems.tribometer.model import Tribometer

Array = NDArray[np.float64]
#: Solvers of scipy that the regularised form accepts.
SOLVERS = ("LSODA", "BDF", "Radau", "DOP853", "RK45", "RK23")
_IMPLICIT = ("LSODA", "BDF", "Radau")
_MOST_STEPS = 20_000_000
#: A solver is called unreliable if another one differs by more than this share of the error of the form.
_SHARE = 0.5


def time_stepping(
    model: Tribometer, duration: float, times: Array, step: float, weight: float, estimate: bool
) -> StickSlipMotion:
    """March with fixed steps; see `graphsynth.systems.tribometer.model.Tribometer.time_stepping`.

    Raises
    ------
    SpecError
        A weight outside [0, 1].
    TooLargeError
        More steps than the limit.
    """
    step = positive("step", step)
    if not 0.0 <= finite("weight of the step", weight) <= 1.0:
        raise SpecError(f"The weight of the step is {weight:g}; give a number from 0 to 1, best 0.5.")
    count = max(1, math.ceil(duration / step * (1.0 - 1e-12)))
    if count > _MOST_STEPS:
        raise TooLargeError(
            f"The step {step:g} s needs {count} steps, more than {_MOST_STEPS}; give a step of at least "
            f"{duration / _MOST_STEPS:.2g} s or a shorter run.",
            count,
        )
    _march(model, duration, 1, weight)  # compilation is no part of the run time
    begin = time.perf_counter()
    path, energies, done = _march(model, duration, count, weight)
    x2 = _between(path, times, duration, 0)
    seconds = time.perf_counter() - begin
    failed = done < count
    h = duration / count
    error, events = math.nan, _changes(path[: done + 1], h)
    if estimate and not failed:
        error, events = _stepping_error(model, duration, times, weight, count, x2, events)
    drive = model.drive.motion(times)
    index = np.minimum(np.ceil(times / h - 1e-9).astype(int), count)
    end = done * h if failed else duration
    statement = f"{len(events)} changes of the contact in {duration:g} s, step {h:g} s."
    if failed:
        statement = (
            f"Failed: the numbers left the range of floating point at {end:.9g} s; use a weight of at least 0.5."
        )
    return StickSlipMotion(
        model, "time stepping", times, drive.x, drive.v, x2, _between(path, times, duration, 1),
        path[index, 3], np.where(np.isnan(path[index, 2]), 0.0, path[index, 2]).astype(np.int64), events,
        RunStatus.FAILED if failed else RunStatus.COMPLETE, statement, end, error, "estimated",
        _residual(model, path[: done + 1], energies), float(energies[1]), float(energies[0]), float(energies[2]),
        done, seconds,
    )  # fmt: skip


def _march(model: Tribometer, duration: float, count: int, weight: float) -> tuple[Array, Array, int]:
    from graphsynth.systems.tribometer.kernels.stepping import march

    path, energies = np.full((count + 1, 4), math.nan), np.zeros(3)
    v, state = model._start()
    path[0] = model.x2, v, state, math.nan
    with np.errstate(over="ignore", invalid="ignore"):
        done = march(model.data(), model.x2, v, duration / count, weight, path, energies)
    path[0, 3] = path[1, 3]
    return path, energies, int(done)


def _between(path: Array, times: Array, duration: float, column: int) -> Array:
    """Interpolate between steps, linearly: the method itself knows no more."""
    found: Array = np.interp(times, np.linspace(0.0, duration, len(path)), path[:, column])
    return found


def _changes(path: Array, h: float) -> tuple[StickSlipEvent, ...]:
    at = np.flatnonzero(np.diff(path[:, 2])) + 1
    return tuple(
        StickSlipEvent(float(i) * h, int(state), float(x), math.nan)
        for i, (x, state) in zip(at, path[at][:, [0, 2]].tolist())
    )


def _stepping_error(
    model: Tribometer, duration: float, times: Array, weight: float, count: int, x2: Array,
    events: tuple[StickSlipEvent, ...],
) -> tuple[float, tuple[StickSlipEvent, ...]]:  # fmt: skip
    """Estimate the errors from two coarser runs: one alone agrees by chance where releases fall alike on the steps."""
    worst = 0.0
    for share in (0.5, 0.7):
        fewer = max(1, int(share * count))
        other, _, reached = _march(model, duration, fewer, weight)
        if reached < fewer or fewer == count:
            return math.nan, events
        gap = float(np.abs(x2 - _between(other, times, duration, 0)).max())
        worst = max(worst, gap * fewer / (count - fewer))
        if share == 0.5:
            events = _judged(events, _changes(other, duration / fewer), duration / count)
    return worst, events


def _judged(
    events: tuple[StickSlipEvent, ...], coarse: tuple[StickSlipEvent, ...], h: float
) -> tuple[StickSlipEvent, ...]:
    """Estimate the errors of the event times by a run with steps of twice the length; NaN if its events differ."""
    if [event.state for event in events] != [event.state for event in coarse]:
        return events
    return tuple(a._replace(error=abs(a.time - b.time) + h) for a, b in zip(events, coarse))


def _residual(model: Tribometer, path: Array, energies: Array) -> float:
    energy = 0.5 * model.mass * path[:, 1] ** 2 + 0.5 * model.stiffness * path[:, 0] ** 2
    exchanged = max(float(np.abs(energies).max()), float(np.ptp(energy)))
    gap = abs(energy[-1] - energy[0] - (energies[0] - energies[1] - energies[2]))
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


@dataclass(frozen=True)
class _Solution:
    """What a solver returned: x2 and v2 at the times (NaN beyond its end), the end, calls, complaint."""

    y: Array
    end: float
    calls: int
    seconds: float
    complaint: str


def regularised(
    model: Tribometer,
    duration: float,
    times: Array,
    speed: float,
    solver: str,
    rtol: float,
    jacobian: bool,
    check: bool,
    most_calls: int,
) -> StickSlipMotion:
    """Solve the regularised form; see `graphsynth.systems.tribometer.model.Tribometer.regularised`."""
    _refuse(model, speed, solver)
    found = _solve(model, duration, times, speed, solver, rtol, jacobian, most_calls)
    reference = model.event_driven(duration, times=times, estimate=False)
    error = float(np.abs(found.y[0] - reference.x2).max()) if reference.complete else math.nan
    status, statement = RunStatus.COMPLETE, f"{solver} reached {duration:g} s."
    if found.complaint:
        status = RunStatus.FAILED
        statement = f"Failed: {solver} stopped at {found.end:.9g} s of {duration:g} s ({found.complaint}); use Radau."
    elif check:
        other = "BDF" if solver == "Radau" else "Radau"
        second = _solve(model, duration, times, speed, other, rtol, True, most_calls)
        status, statement = _judge(solver, other, found, second, reference, duration, speed)
    drive = model.drive.motion(times)
    u = drive.v - found.y[1]
    force = model.normal * model.law.coefficient(np.abs(u)) * np.tanh(u / speed)
    return StickSlipMotion(
        model, f"regularised ({solver})", times, drive.x, drive.v, found.y[0], found.y[1], force,
        np.where(np.isnan(u), 0.0, np.sign(u)).astype(np.int64), (), status, statement, found.end, error,
        "estimated", math.nan, math.nan, math.nan, math.nan, found.calls, found.seconds,
    )  # fmt: skip


def _judge(
    solver: str, other: str, found: _Solution, second: _Solution, reference: StickSlipMotion, duration: float,
    speed: float,
) -> tuple[RunStatus, str]:  # fmt: skip
    """Compare two solvers; their difference has to be small beside the error of the form."""
    if second.complaint:
        return (
            RunStatus.UNRELIABLE,
            f"{solver} reached {duration:g} s, but {other} failed ({second.complaint}): no cross-check; use Radau.",
        )
    gap = float(np.abs(found.y[0] - second.y[0]).max())
    form = float(np.abs(second.y[0] - reference.x2).max()) if reference.complete else model_error(speed)
    if gap <= _SHARE * form:
        return RunStatus.COMPLETE, f"{solver} reached {duration:g} s; {other} differs by {gap:.2g} m."
    return (
        RunStatus.UNRELIABLE,
        f"{solver} reports success, but {other} differs by {gap:.2g} m, not small beside the error {form:.2g} m "
        "of the form itself; use Radau or a smaller tolerance.",
    )


def _refuse(model: Tribometer, speed: float, solver: str) -> None:
    positive("smoothing velocity", speed)
    if solver not in SOLVERS:
        raise SpecError(f"The solver {solver!r} is not known; give one of {', '.join(SOLVERS)}.")
    law = model.law
    if type(law).__name__ == "TwoCoefficientLaw" and law.static != law.kinetic:
        raise SpecError(
            "The regularised form cannot represent the two-coefficient law: it needs a smoothing velocity far below "
            "the Stribeck velocity, and here that is zero; use event_driven or time_stepping, or a StribeckLaw."
        )
    velocity = getattr(law, "velocity", math.inf)
    if not speed < velocity:
        raise SpecError(
            f"The smoothing velocity {speed:g} m/s is not below the Stribeck velocity {velocity:g} m/s, "
            "so that the static friction would never be reached; give at most a tenth of it."
        )


class _ExhaustedError(Exception):
    """The bound on the calls of the right-hand side is reached; holds the time."""

    def __init__(self, at: float) -> None:
        super().__init__()
        self.at = at


def _functions(
    model: Tribometer, speed: float, most: int
) -> tuple[Callable[[float, Array], Array], Callable[[float, Array], Array]]:
    from graphsynth.systems.tribometer.kernels.stepping import regularised as rate, regularised_slope as slope

    data, calls = model.data(), 0
    stiffness, damping, mass = model.stiffness, model.damping, model.mass

    def rhs(t: float, y: Array) -> Array:
        nonlocal calls
        calls += 1
        if calls > most:
            raise _ExhaustedError(float(t))
        out = np.empty(2)
        rate(t, y, data, speed, out)
        return out

    def jac(t: float, y: Array) -> Array:
        return np.array([[0.0, 1.0], [-stiffness / mass, -(damping + slope(t, y, data, speed)) / mass]])

    return rhs, jac


def _solve(
    model: Tribometer, duration: float, times: Array, speed: float, solver: str, rtol: float, jacobian: bool, most: int
) -> _Solution:
    """Run a solver of scipy and believe nothing: status, end and finite numbers are checked."""
    from scipy.integrate import solve_ivp

    rhs, jac = _functions(model, speed, most)
    start = np.array([model.x2, model._start()[0]])
    rhs(0.0, start)
    jac(0.0, start)
    options: dict[str, Any] = {"jac": jac} if jacobian and solver in _IMPLICIT else {}
    scale = 0.01 * rtol  # 1e-10 for the tolerance 1e-8 of theory/tribometer 10
    blank = np.full((2, times.size), math.nan)
    begin = time.perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = solve_ivp(
                rhs, (0.0, duration), start, method=solver, t_eval=times, rtol=rtol, atol=scale,
                max_step=0.02, **options,
            )  # fmt: skip
    except _ExhaustedError as stop:
        return _Solution(blank, stop.at, most, time.perf_counter() - begin, f"more than {most} calls")
    except (ValueError, ArithmeticError, np.linalg.LinAlgError) as problem:
        return _Solution(blank, 0.0, 0, time.perf_counter() - begin, str(problem).rstrip("."))
    seconds = time.perf_counter() - begin
    got = np.asarray(found.y, float).reshape(2, -1) if np.size(found.y) else np.empty((2, 0))
    reached = got.shape[1]
    blank[:, :reached] = got[:, : times.size]
    complaint = ""
    if found.status != 0:
        complaint = f"status {found.status}, {found.message}".rstrip(".")
    elif reached != times.size:
        complaint = f"{reached} of {times.size} times returned"
    elif not np.isfinite(blank).all():
        complaint = "not a number in the result"
    end = duration if not complaint else float(times[reached - 1]) if reached else 0.0
    return _Solution(blank, end, int(found.nfev), seconds, complaint)
