"""Error of every method on one tribometer against the automaton or a motion in multiple precision."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of
from graphsynth.systems.tribometer.events import RunStatus
from graphsynth.systems.tribometer.model import Tribometer
from graphsynth.systems.tribometer.stick_slip import StickSlipMotion
from graphsynth.systems.tribometer.stick_slip_forms import model_error
from graphsynth.systems.tribometer.stick_slip_precise import PreciseMotion

Array = NDArray[np.float64]
_SETTINGS = {"event-driven": "rtol {:.0e}", "time stepping": "step {:g} s"}
_KIND = "largest error of the position"
_STATUS = {RunStatus.COMPLETE: RowStatus.OK, RunStatus.UNRELIABLE: RowStatus.UNRELIABLE}


class _Truth(NamedTuple):
    """Positions at the times of a study, times of the events, and where they are from."""

    times: Array
    positions: Array
    events: Array
    name: str


def _times(duration: float) -> Array:
    """Return the times of theory/tribometer 10: 0.05, 0.10, ... below the duration."""
    found: Array = 0.05 * np.arange(1, max(2, round(duration / 0.05)), dtype=np.float64)
    return found


def _row(method: str, value: float, run: Callable[[], StickSlipMotion], truth: _Truth, effort: Effort) -> Row:
    row = Row(method, _setting(method, value), math.nan, math.nan, 0, _KIND, truth.name, value=value)
    motion, seconds, rounds = best_of(run, effort, warm=False)
    status = _STATUS.get(motion.status, RowStatus.FAILED)
    failed = status is RowStatus.FAILED
    found = np.array([event.time for event in motion.events])
    more = {"events": float(found.size), "steps or calls": float(motion.evaluations)}
    if found.size == truth.events.size and found.size:
        more["event error [s]"] = float(np.abs(found - truth.events).max())
    return replace(
        row,
        error=math.nan if failed else float(np.abs(motion.x2 - truth.positions).max()),
        seconds=seconds,
        rounds=rounds,
        status=status,
        reason="" if status is RowStatus.OK else motion.statement,
        more=more,
    )


def _setting(method: str, value: float) -> str:
    return _SETTINGS.get(method, "speed {:.0e} m/s").format(value)


def _study(rows: Sequence[Row], duration: float, truth: _Truth) -> Problem:
    question = f"Stick-slip over {duration:g} s: position of the upper platform every 50 ms"
    return Problem("stick-slip", question, "m", tuple(rows), note=f"Error against {truth.name}.")


def method_study(
    model: Tribometer,
    duration: float = 10.0,
    *,
    tolerances: Sequence[float] = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12),
    steps: Sequence[float] = (1e-3, 1e-4, 1e-5),
    speeds: Sequence[float] = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8),
    solvers: Sequence[str] = ("LSODA",),
    rounds: int = 3,
    most_calls: int = 600_000,
) -> Problem:
    """Error and run time of all three methods on one tribometer, failures and refusals included.

    The reference is the automaton with the tolerance 1e-14: for its own rows it is itself, for the others a different
    method.  Rows of the regularised form say "unreliable" if the error is more than three times that of the form with
    the other solvers at the same speed, or more than ten times `model_error` if there is no other.

    Parameters
    ----------
    model : Tribometer
    duration : float
        s.
    tolerances, steps, speeds : sequence of float
        Of the automaton; of time stepping, s; of the regularised form, m/s.
    solvers : sequence of str
    rounds : int
        Runs for the wall time, of which the shortest counts.
    most_calls : int
        A solver that needs more is shown as failed.

    Raises
    ------
    SpecError
        There is no reference: the automaton did not finish.

    Examples
    --------
    >>> study = method_study(Tribometer(), 0.5, tolerances=[1e-8], steps=[1e-4], speeds=[1e-3], rounds=1)
    >>> [row.method for row in study.rows]
    ['event-driven', 'time stepping', 'LSODA']
    """
    truth, effort = _reference(model, duration), Effort(rounds)
    options: dict[str, Any] = {"times": truth.times, "estimate": False}
    rows = [
        _row("event-driven", rtol, partial(model.event_driven, duration, rtol=rtol, **options), truth, effort)
        for rtol in (() if model.closed_form else tolerances)
    ]
    rows += _step_rows(model, duration, steps, truth, effort)
    smooth = []
    smoothed: dict[str, Any] = {"times": truth.times, "check": False, "most_calls": most_calls}
    for solver in solvers:
        for speed in speeds:
            run = partial(model.regularised, duration, speed=speed, solver=solver, **smoothed)
            try:
                smooth.append(_row(solver, speed, run, truth, effort if solver == "LSODA" else Effort(1)))
            except SpecError as refusal:
                refused = Row(solver, _setting(solver, speed), math.nan, math.nan, 0, _KIND, truth.name, value=speed)
                none = {"events": 0.0, "steps or calls": 0.0}
                smooth.append(replace(refused, status=RowStatus.FAILED, reason=str(refusal), more=none))
    return _study([*rows, *(_doubted(row, smooth) for row in smooth)], duration, truth)


def _step_rows(model: Tribometer, duration: float, steps: Sequence[float], truth: _Truth, effort: Effort) -> list[Row]:
    options: dict[str, Any] = {"times": truth.times, "estimate": False}
    return [
        _row("time stepping", step, partial(model.time_stepping, duration, step=step, **options), truth, effort)
        for step in steps
    ]


def _doubted(row: Row, all_rows: list[Row]) -> Row:
    """Mark a success whose error is far above that of the form itself."""
    if row.status is not RowStatus.OK:
        return row
    others = [other.error for other in all_rows if other.value == row.value and other.method != row.method]
    others = [error for error in others if not math.isnan(error)]
    bound = 3.0 * min(others) if others else 10.0 * model_error(row.value)
    if row.error <= bound:
        return row
    text = f"{row.method} reports success with an error of {row.error:.1e} m, above that of the form itself."
    return replace(row, status=RowStatus.UNRELIABLE, reason=text)


def _reference(model: Tribometer, duration: float) -> _Truth:
    times = _times(duration)
    motion = model.event_driven(duration, times=times)
    if not motion.complete:
        raise SpecError(f"There is no reference to compare with: {motion.statement}")
    name = f"event-driven run with relative tolerance 1e-14, error estimated {motion.error:.1e} m"
    return _Truth(times, motion.x2, np.array([event.time for event in motion.events]), name)


def regularisation_study(
    model: Tribometer,
    duration: float = 10.0,
    *,
    speeds: Sequence[float] = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8),
    solvers: Sequence[str] = ("LSODA", "BDF", "Radau", "DOP853"),
    rtol: float = 1e-8,
    most_calls: int = 600_000,
    rounds: int = 1,
) -> Problem:
    """Error of the regularised form against the smoothing velocity (theory/tribometer 10), failures included.

    Parameters
    ----------
    model : Tribometer
    duration : float
        s.
    speeds : sequence of float
        m/s, below the Stribeck velocity.
    solvers : sequence of str
    rtol : float
    most_calls : int
        A solver that needs more is shown as failed.
    rounds : int
        Runs for the wall time.

    Examples
    --------
    >>> study = regularisation_study(Tribometer(), 0.5, speeds=[1e-3], solvers=["BDF"])
    >>> study.rows[0].status.value
    'ok'
    """
    truth, rows = _reference(model, duration), []
    for solver in solvers:
        for speed in speeds:
            run = partial(
                model.regularised,
                duration,
                speed=speed,
                solver=solver,
                times=truth.times,
                rtol=rtol,
                most_calls=most_calls,
            )
            row = _row(solver, speed, run, truth, Effort(1))
            if rounds > 1 and row.rounds:
                _, seconds, more = best_of(partial(run, check=False), Effort(rounds - 1), warm=False)
                row = replace(row, seconds=min(row.seconds, seconds), rounds=1 + more)
            rows.append(row)
    return _study(rows, duration, truth)


def step_study(
    model: Tribometer, duration: float = 10.0, *, steps: Sequence[float] = (1e-3, 1e-4, 1e-5), rounds: int = 1
) -> Problem:
    """Error of time stepping against the step; errors of the final position too are in ``StickSlipMotion``.

    Examples
    --------
    >>> 0.8 < step_study(Tribometer(), 2.0).order("time stepping") < 1.2
    True
    """
    truth = _reference(model, duration)
    return _study(_step_rows(model, duration, steps, truth, Effort(rounds)), duration, truth)


def tolerance_study(
    model: Tribometer,
    reference: PreciseMotion,
    duration: float,
    *,
    tolerances: Sequence[float] = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14),
    rounds: int = 3,
) -> Problem:
    """Error of the automaton against a motion in multiple precision: final position and event times.

    Parameters
    ----------
    model : Tribometer
    reference : PreciseMotion
        Of the same model and duration.
    duration : float
        s.
    tolerances : sequence of float
    rounds : int
    """
    name = f"Taylor series with {reference.digits} digits"
    events = np.array([float(event.time) for event in reference.events])
    truth = _Truth(np.array([duration]), np.array([float(reference.x2)]), events, name)
    rows = []
    for rtol in tolerances:
        run = partial(model.event_driven, duration, times=[duration], rtol=rtol, estimate=False)
        row = replace(_row("event-driven", rtol, run, truth, Effort(rounds)), kind="error of the final position")
        if row.more["events"] != events.size:
            row = replace(
                row, status=RowStatus.UNRELIABLE, reason=f"{row.more['events']:.0f} events for {events.size}."
            )
        rows.append(row)
    question = f"Event-driven run over {duration:g} s: final position of the upper platform, {events.size} events"
    return Problem("events", question, "m", tuple(rows))
