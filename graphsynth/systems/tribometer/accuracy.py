"""Error of every method on one tribometer against the automaton or a motion in multiple precision."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError
from graphsynth.systems.tribometer.events import RunStatus
from graphsynth.systems.tribometer.model import Tribometer
from graphsynth.systems.tribometer.stick_slip import StickSlipMotion
from graphsynth.systems.tribometer.stick_slip_forms import model_error
from graphsynth.systems.tribometer.stick_slip_precise import PreciseMotion

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "AccuracyRow",
    "AccuracyStudy",
    "method_study",
    "regularisation_study",
    "step_study",
    "tolerance_study",
]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AccuracyRow:
    """One run of one method.

    Attributes
    ----------
    method : str
        "event-driven", "time stepping" or the name of the solver of the regularised form.
    parameter : float
        Relative tolerance, step (s) or smoothing velocity (m/s).
    error : float
        Largest error of x2 at the times of the study, m; NaN if the run failed.
    event_error : float
        Largest error of an event time, s; NaN where the events do not match or the method has none.
    events : int
        Events found.
    evaluations : int
        Steps, or calls of the right-hand side.
    seconds : float
        Wall time, the best of the rounds.
    status : RunStatus
        A failure stays in the table as a failure.
    statement : str
        One sentence.
    """

    method: str
    parameter: float
    error: float
    event_error: float
    events: int
    evaluations: int
    seconds: float
    status: RunStatus
    statement: str


@dataclass(frozen=True)
class AccuracyStudy:
    """Rows of a study, and against what the errors were measured."""

    rows: tuple[AccuracyRow, ...]
    reference: str

    def to_pandas(self) -> pd.DataFrame:
        """Return the rows as a table."""
        import pandas as pd

        return pd.DataFrame([asdict(row) | {"status": row.status.value} for row in self.rows])

    def order(self, method: str) -> float:
        """Observed order of a method: slope of the error over the parameter between first and last good row."""
        good = [row for row in self.rows if row.method == method and row.status is RunStatus.COMPLETE]
        if len(good) < 2:
            return math.nan
        return math.log(good[0].error / good[-1].error) / math.log(good[0].parameter / good[-1].parameter)


def _times(duration: float) -> Array:
    """Return the times of theory/tribometer 10: 0.05, 0.10, ... below the duration."""
    found: Array = 0.05 * np.arange(1, max(2, round(duration / 0.05)), dtype=np.float64)
    return found


def _row(method: str, parameter: float, runs: list[StickSlipMotion], truth: Array, events: Array) -> AccuracyRow:
    motion = runs[0]
    bad = motion.status not in (RunStatus.COMPLETE, RunStatus.UNRELIABLE)
    gap = math.nan if bad else float(np.abs(motion.x2 - truth).max())
    found = np.array([event.time for event in motion.events])
    late = float(np.abs(found - events).max()) if found.size == events.size and found.size else math.nan
    return AccuracyRow(
        method, parameter, gap, late, found.size, motion.evaluations, min(run.seconds for run in runs), motion.status,
        motion.statement,
    )  # fmt: skip


def _failed(method: str, parameter: float, sentence: str) -> AccuracyRow:
    return AccuracyRow(method, parameter, math.nan, math.nan, 0, 0, math.nan, RunStatus.FAILED, sentence)


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
) -> AccuracyStudy:
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
    times = _times(duration)
    truth, events, text = _reference(model, duration, times)
    rows = []
    for rtol in () if model.closed_form else tolerances:
        runs = [model.event_driven(duration, times=times, rtol=rtol, estimate=False) for _ in range(rounds)]
        rows.append(_row("event-driven", rtol, runs, truth, events))
    for step in steps:
        runs = [model.time_stepping(duration, step=step, times=times, estimate=False) for _ in range(rounds)]
        rows.append(_row("time stepping", step, runs, truth, events))
    smooth = [
        _regularised_row(model, duration, times, speed, solver, rounds, most_calls, truth, events)
        for solver in solvers
        for speed in speeds
    ]
    return AccuracyStudy((*rows, *(_doubted(row, smooth) for row in smooth)), text)


def _regularised_row(
    model: Tribometer, duration: float, times: Array, speed: float, solver: str, rounds: int, most_calls: int,
    truth: Array, events: Array,
) -> AccuracyRow:  # fmt: skip
    try:
        runs = [
            model.regularised(duration, speed=speed, solver=solver, times=times, check=False, most_calls=most_calls)
            for _ in range(rounds if solver == "LSODA" else 1)
        ]
    except SpecError as refusal:
        return _failed(solver, speed, str(refusal))
    return _row(solver, speed, runs, truth, events)


def _doubted(row: AccuracyRow, all_rows: list[AccuracyRow]) -> AccuracyRow:
    """Mark a success whose error is far above that of the form itself."""
    if row.status is not RunStatus.COMPLETE:
        return row
    others = [other.error for other in all_rows if other.parameter == row.parameter and other.method != row.method]
    others = [error for error in others if not math.isnan(error)]
    bound = 3.0 * min(others) if others else 10.0 * model_error(row.parameter)
    if row.error <= bound:
        return row
    text = f"{row.method} reports success with an error of {row.error:.1e} m, above that of the form itself."
    return replace(row, status=RunStatus.UNRELIABLE, statement=text)


def _reference(model: Tribometer, duration: float, times: Array) -> tuple[Array, Array, str]:
    motion = model.event_driven(duration, times=times)
    if not motion.complete:
        raise SpecError(f"There is no reference to compare with: {motion.statement}")
    text = f"event-driven run with relative tolerance 1e-14, error estimated {motion.error:.1e} m"
    return motion.x2, np.array([event.time for event in motion.events]), text


def regularisation_study(
    model: Tribometer,
    duration: float = 10.0,
    *,
    speeds: Sequence[float] = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8),
    solvers: Sequence[str] = ("LSODA", "BDF", "Radau", "DOP853"),
    rtol: float = 1e-8,
    most_calls: int = 600_000,
    rounds: int = 1,
) -> AccuracyStudy:
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
    'complete'
    """
    times = _times(duration)
    truth, events, text = _reference(model, duration, times)
    rows = []
    for solver in solvers:
        for speed in speeds:
            runs = [
                model.regularised(duration, speed=speed, solver=solver, times=times, rtol=rtol, most_calls=most_calls)
            ]
            runs += [
                model.regularised(
                    duration, speed=speed, solver=solver, times=times, rtol=rtol, most_calls=most_calls, check=False
                )
                for _ in range(rounds - 1)
            ]
            rows.append(_row(solver, speed, runs, truth, events))
    return AccuracyStudy(tuple(rows), text)


def step_study(
    model: Tribometer, duration: float = 10.0, *, steps: Sequence[float] = (1e-3, 1e-4, 1e-5), rounds: int = 1
) -> AccuracyStudy:
    """Error of time stepping against the step; errors of the final position too are in ``StickSlipMotion``.

    Examples
    --------
    >>> 0.8 < step_study(Tribometer(), 2.0).order("time stepping") < 1.2
    True
    """
    times = _times(duration)
    truth, events, text = _reference(model, duration, times)
    rows = []
    for step in steps:
        runs = [model.time_stepping(duration, step=step, times=times, estimate=False) for _ in range(rounds)]
        rows.append(_row("time stepping", step, runs, truth, events))
    return AccuracyStudy(tuple(rows), text)


def tolerance_study(
    model: Tribometer,
    reference: PreciseMotion,
    duration: float,
    *,
    tolerances: Sequence[float] = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14),
    rounds: int = 3,
) -> AccuracyStudy:
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
    truth = np.array([float(reference.x2)])
    events = np.array([float(event.time) for event in reference.events])
    rows = []
    for rtol in tolerances:
        runs = [model.event_driven(duration, times=[duration], rtol=rtol, estimate=False) for _ in range(rounds)]
        row = _row("event-driven", rtol, runs, truth, events)
        if row.events != events.size:
            row = replace(row, status=RunStatus.UNRELIABLE, statement=f"{row.events} events for {events.size}.")
        rows.append(row)
    return AccuracyStudy(tuple(rows), f"Taylor series with {reference.digits} digits")
