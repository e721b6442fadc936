"""Error of every method on one tribometer against the automaton or a motion in multiple precision."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.events import RunStatus
from graphsynth.dynamics.stick_slip import StickSlipMotion
from graphsynth.dynamics.stick_slip_precise import PreciseMotion
from graphsynth.dynamics.tribometer import Tribometer
from graphsynth.errors import SpecError

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["AccuracyRow", "AccuracyStudy", "regularisation_study", "step_study", "tolerance_study"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AccuracyRow:
    """One run of one method.

    Attributes
    ----------
    method : str
        "event-driven", "time stepping" or the name of the solver of the regularised form.
    parameter : float
        Relative tolerance, step (s) or regularisation speed (m/s).
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
    """Return the times of the specification, 0.05, 0.10, ... below the duration."""
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
    """Error of the regularised form against the regularisation speed (section 3.10), failures included.

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
