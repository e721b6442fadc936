"""Error against run time of a drive: ours beside scipy's solvers on the same compiled equations."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.errors import SpecError
from graphsynth.dynamics.driven.run import Plant, run
from graphsynth.dynamics.driven.setup import output_times, prepare
from graphsynth.dynamics.motors import IdealSpeed, Motor, whole
from graphsynth.dynamics.trains import Train
from graphsynth.systems.platform.motor_model import MotorDrivenPlatform

if TYPE_CHECKING:
    from graphsynth.systems.braider.model import Braider

__all__ = [
    "WorkPrecision",
    "WorkRow",
    "braider_work_precision",
    "drive_work_precision",
    "rows_as_text",
    "work_precision",
]

Array = NDArray[np.float64]
_OWN = "graphsynth"
#: Above this many electrical time constants the explicit reference would take too long.
_STIFF = 5e4


@dataclass(frozen=True)
class WorkRow:
    """One run of one method.

    Attributes
    ----------
    method : str
    setting : float
        Relative tolerance.
    error : float
        Largest error of speed and currents over the output times, each over its largest reference value; NaN after a
        failure.
    seconds : float
        Wall time of the solve, the best of the rounds.
    steps : int
        Steps of the integrator, or calls of the right-hand side for scipy.
    status : str
        "done", or what went wrong: a failure stays in the table.
    """

    method: str
    setting: float
    error: float
    seconds: float
    steps: int
    status: str


@dataclass(frozen=True)
class WorkPrecision:
    """Rows of a study, and against what the errors were measured."""

    rows: tuple[WorkRow, ...]
    reference: str


def work_precision(
    plant: Plant,
    motor: Motor | IdealSpeed,
    train: Train,
    times: ArrayLike,
    *,
    angle: float = 0.0,
    speed: float = 0.0,
    tolerances: Sequence[float] = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12),
    solvers: Sequence[str] = ("LSODA", "BDF", "Radau", "DOP853"),
    rounds: int = 3,
    most_calls: int = 200_000,
) -> WorkPrecision:
    """Error against run time over tolerances, failures included.

    Parameters
    ----------
    plant, motor, train, times, angle, speed
        As for `graphsynth.dynamics.driven.run.run`; no event may lie on the way (voltage limit, efficiency).
    tolerances : sequence of float
    solvers : sequence of str
        Of `scipy.integrate.solve_ivp`, on the same compiled right-hand side.
    rounds : int
        Runs for the wall time.
    most_calls : int
        A solver that needs more calls of the right-hand side is shown as failed.

    Returns
    -------
    WorkPrecision
        The reference is DOP853 at 3e-14, another method on the same equations; for a stiff motor, which no explicit
        method can follow, a run at 1e-13, and ``reference`` says so.

    Raises
    ------
    SpecError
        An ideal speed, a voltage limit or an efficiency below one.

    Examples
    --------
    >>> from graphsynth.dynamics.motors import DCMotor
    >>> drive = MotorDrivenPlatform.source(DCMotor(1.0, 0.2, 0.1, 0.1, gain=20.0, speed=20.0))
    >>> found = drive_work_precision(drive, [0.0, 0.1, 0.2], tolerances=[1e-8], solvers=["LSODA"], rounds=1)
    >>> [(row.method, row.status) for row in found.rows]
    [('graphsynth', 'done'), ('scipy LSODA', 'done')]
    """
    out = output_times(times)
    whole("rounds", rounds, "the best of them is taken")
    if isinstance(motor, IdealSpeed) or train.efficiency < 1.0 or getattr(motor, "voltage_limit", math.inf) < math.inf:
        raise SpecError("the comparison is for motions without events: no ideal speed, voltage limit or efficiency")
    rhs, start = _equations(plant, motor, train, out, angle, speed)
    truth, said = _reference(plant, motor, train, out, angle, speed, rhs, start)
    scale = np.abs(truth).max(axis=0)[1:]
    rows = [_own_row(plant, motor, train, out, angle, speed, r, truth, scale, rounds) for r in tolerances]
    rows += [
        _scipy_row(name, rhs, start, out, r, truth, scale, rounds, most_calls) for name in solvers for r in tolerances
    ]
    return WorkPrecision(tuple(rows), said)


def drive_work_precision(drive: MotorDrivenPlatform, times: ArrayLike, **options: Any) -> WorkPrecision:
    """Error against run time of a motor-driven platform with inertia; options as for `work_precision`."""
    return work_precision(drive.plant(), drive.motor, drive.train, times, **options)


def braider_work_precision(braider: Braider, end: float = 0.5, **options: Any) -> WorkPrecision:
    """Error against run time of the start-up of a braider; options as for `work_precision`."""
    return work_precision(braider.plant(), braider.motor, braider.train, np.linspace(0.0, end, 11), **options)


def _equations(
    plant: Plant, motor: Motor, train: Train, out: Array, angle: float, speed: float
) -> tuple[Callable[[float, Array], Array], Array]:
    """Right-hand side of the form with inertia for scipy, and the start."""
    from graphsynth.dynamics.driven.kernels import systems as s

    ready = prepare(plant, motor, train, out, angle, speed, None, regular=False)
    scratch = np.zeros(16)

    def rhs(_t: float, y: Array) -> Array:
        rates = np.empty(y.size)
        s.field(ready.setup, ready.values, ready.rows, y, rates, scratch)
        return rates

    return rhs, ready.start


def _reference(
    plant: Plant, motor: Motor, train: Train, out: Array, angle: float, speed: float,
    rhs: Callable[[float, Array], Array], start: Array,
) -> tuple[Array, str]:  # fmt: skip
    from scipy.integrate import solve_ivp

    own = run(plant, motor, train, out, angle=angle, speed=speed, rtol=1e-13, estimate=False)
    states = np.column_stack([own.angle, own.speed, own.currents])
    constants = float(out[-1] - out[0]) / getattr(motor, "electrical_time", math.inf)
    if constants < _STIFF:
        found = solve_ivp(rhs, (out[0], out[-1]), start, "DOP853", out, rtol=3e-14, atol=1e-15)
        if found.success:
            truth = np.asarray(found.y.T)
            gap = _error(states, truth, np.abs(truth).max(axis=0)[1:])
            return truth, f"scipy DOP853 with tolerance 3e-14 on the same equations, itself good to about {gap:.0e}"
    if not own.complete:
        raise SpecError(f"there is no reference to compare with: {own.reason}")
    return states, "graphsynth itself with tolerance 1e-13, because the motor is too stiff for an explicit method"


def _own_row(
    plant: Plant, motor: Motor, train: Train, out: Array, angle: float, speed: float, rtol: float,
    truth: Array, scale: Array, rounds: int,
) -> WorkRow:  # fmt: skip
    best, found = math.inf, None
    for _ in range(rounds + 1):  # the first round may compile
        found = run(plant, motor, train, out, angle=angle, speed=speed, rtol=rtol, estimate=False)
        best = min(best, found.seconds)
    assert found is not None
    states = np.column_stack([found.angle, found.speed, found.currents])
    error = _error(states, truth, scale) if found.complete else math.nan
    return WorkRow(_OWN, rtol, error, best, found.steps + found.rejected, found.reason or "done")


class _TooManyCallsError(Exception):
    pass


def _scipy_row(
    name: str, rhs: Callable[[float, Array], Array], start: Array, out: Array, rtol: float, truth: Array,
    scale: Array, rounds: int, most_calls: int,
) -> WorkRow:  # fmt: skip
    from scipy.integrate import solve_ivp

    calls = 0

    def counted(t: float, y: Array) -> Array:
        nonlocal calls
        calls += 1
        if calls > most_calls:
            raise _TooManyCallsError
        return rhs(t, y)

    unit = np.concatenate([[1.0], np.maximum(scale, 1e-300)])
    best = math.inf
    for _ in range(rounds):
        calls, begin = 0, perf_counter()
        try:
            with warnings.catch_warnings(), np.errstate(all="ignore"):  # a solver that overflows is a row, not a stop
                warnings.simplefilter("ignore")
                found = solve_ivp(counted, (out[0], out[-1]), start, name, out, rtol=max(rtol, 3e-14), atol=rtol * unit)
        except _TooManyCallsError:
            seconds = perf_counter() - begin
            return WorkRow(f"scipy {name}", rtol, math.nan, seconds, most_calls, f"more than {most_calls} calls")
        best = min(best, perf_counter() - begin)
    if not found.success:
        return WorkRow(f"scipy {name}", rtol, math.nan, best, calls, str(found.message))
    return WorkRow(f"scipy {name}", rtol, _error(found.y.T, truth, scale), best, calls, "done")


def _error(states: Array, truth: Array, scale: Array) -> float:
    """Largest error of speed and currents over their largest reference values."""
    return float((np.abs(states - truth)[:, 1:].max(axis=0) / np.where(scale > 0.0, scale, 1.0)).max())


def rows_as_text(found: WorkPrecision) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...], str]:
    """Columns, rows and note of a study, ready to print."""
    columns = ("method", "tolerance", "error", "time [ms]", "steps or calls", "status")
    rows = tuple(
        (
            row.method, f"{row.setting:.0e}", "" if math.isnan(row.error) else f"{row.error:.1e}",
            f"{1e3 * row.seconds:.2f}", str(row.steps), row.status,
        )
        for row in found.rows
    )  # fmt: skip
    return columns, rows, f"Error of speed and currents against {found.reference}."
