"""Motors with mechanisms: the integrator of drives beside scipy's solvers, and the limit of a small inductance."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp

from graphsynth.core.checks import whole
from graphsynth.core.errors import SpecError
from graphsynth.dynamics.driven.run import run
from graphsynth.dynamics.driven.setup import DriveOptions, Plant, output_times, prepare
from graphsynth.dynamics.motors import IdealSpeed, Motor, Train
from graphsynth.evidence.choice import seconds_text
from graphsynth.evidence.precise_drive import NAME, Shape, precise_drive, shape_of_series
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of

Array = NDArray[np.float64]
_L = "inductance [H]"
_PRECISE = f"{NAME} on the equations of theory/motor-drive"
_KIND = "largest error of speed and currents over their largest values"
#: A scipy solver that needs more calls of the right-hand side is a failure here.
_MOST_CALLS = 30_000
_OWN = "graphsynth"
_WORK = "steps or calls"
#: Above this many electrical time constants the explicit reference would take too long.
_STIFF = 5e4


class _Drive(NamedTuple):
    """What is integrated, for a motion without events."""

    plant: Plant
    motor: Motor
    train: Train
    times: Array

    def run(self, rtol: float) -> Any:
        return run(self.plant, self.motor, self.train, self.times, DriveOptions(rtol=rtol, estimate=False))

    def equations(self) -> tuple[Callable[[float, Array], Array], Array]:
        """Right-hand side of the form with inertia for scipy, and the start."""
        from graphsynth.dynamics.driven.kernels import systems as s

        ready = prepare(self.plant, self.motor, self.train, self.times, DriveOptions())
        scratch = np.zeros(16)

        def rhs(_t: float, y: Array) -> Array:
            rates = np.empty(y.size)
            s.field(ready.setup, ready.values, ready.rows, y, rates, scratch)
            return rates

        return rhs, ready.start


class _Truth(NamedTuple):
    """States (angle, speed, currents) at the times, and where they are from."""

    states: Array
    name: str

    def error(self, states: Array) -> float:
        """Largest error of speed and currents over their largest reference values."""
        scale = np.abs(self.states).max(axis=0)[1:]
        gaps = np.abs(states - self.states)[:, 1:].max(axis=0)
        return float((gaps / np.where(scale > 0.0, scale, 1.0)).max())


def work_precision(
    plant: Plant,
    motor: Motor | IdealSpeed,
    train: Train,
    times: ArrayLike,
    *,
    tolerances: Sequence[float] = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12),
    solvers: Sequence[str] = ("LSODA", "BDF", "Radau", "DOP853"),
    rounds: int = 3,
    most_calls: int = 200_000,
) -> Problem:
    """Error against run time over tolerances, failures included.

    Plant, motor, train and times as for `graphsynth.dynamics.driven.run.run`, from rest; a `SpecError` refuses events
    on the way: an ideal speed, a voltage limit, an efficiency below one.  `solvers` are those of scipy's ``solve_ivp``,
    on the same compiled right-hand side; one that needs more than `most_calls` calls is shown as failed.

    The reference is DOP853 at 3e-14, another method on the same equations; for a stiff motor, which no explicit method
    can follow, a run at 1e-13, and ``reference`` of the rows says so.
    """
    out = output_times(times)
    whole("rounds", rounds, 1, error=SpecError)
    if isinstance(motor, IdealSpeed) or train.efficiency < 1.0 or getattr(motor, "voltage_limit", math.inf) < math.inf:
        raise SpecError("the comparison is for motions without events: no ideal speed, voltage limit or efficiency")
    drive, effort = _Drive(plant, motor, train, out), Effort(rounds)
    truth = _reference(drive)
    rows = []
    for rtol in tolerances:
        found, *timed = best_of(partial(drive.run, rtol), effort)
        error = truth.error(_states(found)) if found.complete else math.nan
        more: dict[str, Any] = {"kind": _KIND, "reference": truth.name, "value": rtol}
        more |= {"more": {_WORK: float(found.steps + found.rejected)}}
        more |= {"status": RowStatus.UNRELIABLE if found.complete else RowStatus.FAILED}
        rows.append(Row.of(_OWN, f"rtol {rtol:.0e}", error, timed, found.reason, **more))
    rows += [_scipy_row(name, drive, rtol, truth, effort, most_calls) for name in solvers for rtol in tolerances]
    question = f"Speed and currents of the drive up to {out[-1]:g} s, at {out.size} times"
    note = f"Error of speed and currents against {truth.name}."
    return Problem("drive", question, "relative", tuple(rows), note=note)


def drive_work_precision(machine: Any, times: ArrayLike, **options: Any) -> Problem:
    """Error against run time of a machine with ``plant()``, ``motor`` and ``train``; options as `work_precision`."""
    return work_precision(machine.plant(), machine.motor, machine.train, times, **options)


def _reference(drive: _Drive) -> _Truth:
    own, out = drive.run(1e-13), drive.times
    states = _states(own)
    constants = float(out[-1] - out[0]) / getattr(drive.motor, "electrical_time", math.inf)
    if constants < _STIFF:
        rhs, start = drive.equations()
        found = solve_ivp(rhs, (out[0], out[-1]), start, "DOP853", out, rtol=3e-14, atol=1e-15)
        if found.success:
            truth = _Truth(np.asarray(found.y.T), "")
            gap = truth.error(states)
            name = f"scipy DOP853 with tolerance 3e-14 on the same equations, itself good to about {gap:.0e}"
            return truth._replace(name=name)
    if not own.complete:
        raise SpecError(f"there is no reference to compare with: {own.reason}")
    name = "graphsynth itself with tolerance 1e-13, because the motor is too stiff for an explicit method"
    return _Truth(states, name)


def _states(found: Any) -> Array:
    """Angle, speed and currents of a run, a column each."""
    return np.column_stack([found.angle, found.speed, found.currents])


class _TooManyCallsError(Exception):
    pass


def _scipy_row(name: str, drive: _Drive, rtol: float, truth: _Truth, effort: Effort, most_calls: int) -> Row:
    (rhs, start), out, calls = drive.equations(), drive.times, 0
    unit = np.concatenate([[1.0], np.maximum(np.abs(truth.states).max(axis=0)[1:], 1e-300)])

    def counted(t: float, y: Array) -> Array:
        nonlocal calls
        calls += 1
        if calls > most_calls:
            raise _TooManyCallsError
        return rhs(t, y)

    def solve() -> Any:
        nonlocal calls
        calls = 0
        with warnings.catch_warnings(), np.errstate(all="ignore"):  # a solver that overflows is a row, not a stop
            warnings.simplefilter("ignore")
            try:
                return solve_ivp(counted, (out[0], out[-1]), start, name, out, rtol=max(rtol, 3e-14), atol=rtol * unit)
            except _TooManyCallsError:
                calls = most_calls
                return None

    found, *timed = best_of(solve, effort, warm=False)
    why = f"more than {most_calls} calls" if found is None else "" if found.success else str(found.message)
    against = truth.name + (" (the same method)" if name in truth.name else "")
    more = {"value": rtol, "kind": _KIND, "reference": against, "more": {_WORK: float(calls)}}
    error = math.nan if why else truth.error(found.y.T)
    return Row.of(f"scipy {name}", f"rtol {rtol:.0e}", error, timed, why, **more)


def drive_problem(
    plant: Any, motor: Any, train: Any, end: float, effort: Effort | None = None, *, shape: Shape | None = None
) -> Problem:
    """Run a drive up from rest with every integrator and several tolerances.

    `plant`, `motor` and `train` as for `work_precision`; `end` in seconds; `shape`: inertia and load as
    `graphsynth.evidence.precise_drive` takes them, by default those of the plant's series.

    Examples
    --------
    >>> from graphsynth.dynamics.driven.setup import Plant
    >>> from graphsynth.dynamics.motors import DCMotor
    >>> from graphsynth.dynamics.motors import Train
    >>> motor = DCMotor(1.0, 0.2, 0.1, 0.1, gain=20.0, speed=20.0)
    >>> found = drive_problem(Plant(np.zeros((1, 1)), 1.0), motor, Train(), 0.2, Effort(rounds=1, quick=True))
    >>> found.methods, found.rows[0].status.value
    (('graphsynth', 'scipy LSODA'), 'ok')
    """
    effort = effort or Effort()
    default = DriveOptions().rtol
    times = np.linspace(0.0, end, 11)
    slow = (1e-4, 1e-6, 1e-8)
    tolerances = tuple(sorted({*slow, 1e-10, 1e-12, default} if not effort.quick else {1e-4, 1e-8, default}))[::-1]

    measured = partial(work_precision, plant, motor, train, times, most_calls=_MOST_CALLS)
    rows = list(measured(tolerances=tolerances, solvers=("LSODA",), rounds=effort.rounds).rows)
    for solver in () if effort.quick else ("DOP853", "BDF", "Radau"):
        asked = tolerances if solver == "DOP853" else slow
        rows += measured(tolerances=asked, solvers=(solver,), rounds=1).rows[len(asked) :]
    reference = rows[0].reference
    rows = [replace(row, default=row.method == _OWN and row.value == default) for row in rows]
    truth = _precise(plant, motor, train, times, shape)
    note = (
        f"graphsynth is compared with {_PRECISE}, which shares no code with it; scipy's solvers with {reference}, "
        "which shares the compiled right-hand side with them. scipy's DOP853 is that method at a looser tolerance."
    )
    if truth is None:
        note = (
            f"There is no independent reference for this motor: all methods are compared with {reference}, which uses "
            "the same right-hand side."
        )
    else:
        drive, precise = _Drive(plant, motor, train, times), _Truth(truth, _PRECISE)
        for k, row in enumerate(rows):
            if row.method == _OWN and row.good:
                more = {**row.more, "distance from scipy DOP853": row.error}
                error = precise.error(_states(drive.run(row.value)))
                rows[k] = replace(row, error=error, reference=_PRECISE, more=more)
    question = f"Speed and currents of the drive from rest to {end:g} s, at eleven times"
    return Problem("drive", question, "relative", tuple(rows), "run", note)


def _precise(plant: Any, motor: Any, train: Any, times: Any, shape: Shape | None) -> Any:
    """States at the times from another implementation; None for what it does not know."""
    if shape is None and (plant.linkage is not None or plant.load_series is not None):
        return None
    shape = shape or shape_of_series(plant.rows, plant.base, plant.load)
    try:
        return precise_drive(shape, motor, train.ratio, train.inertia, plant.friction, times.tolist())
    except SpecError:  # another motor, or too stiff for an explicit method
        return None


def reduction_problem(machine: Any, times: Any, inductances: Sequence[float], effort: Effort | None = None) -> Problem:
    """Leave the inductance out: what the limit L -> 0 costs in accuracy, and what keeping it costs in time.

    The machine has ``inductance_study``, a motor, and ``simulate``: a motor-driven platform, a braider. Output times in
    s, at least three inductances in H.
    """
    effort = effort or Effort()
    chosen = effort.some(inductances)
    found = machine.inductance_study(times, chosen)
    least = replace(machine, motor=replace(machine.motor, inductance=float(found.inductance.min())))
    limit, _, rounds = best_of(lambda: least.simulate(times, reduce=True), effort)
    study = ("model without inductance", "largest error of the speed behind the electrical transient")
    kept = ("model with inductance", "estimated error of the speed")

    def row(named: tuple[str, str], against: str, L: float, error: float, run: Any, rounds: int) -> Row:
        more = {"kind": named[1], "reference": against, "value": L, "more": {"steps": float(run.steps), _L: L}}
        why = "" if run.complete else run.reason
        return Row.of(named[0], f"L = {L:g} H", error, (run.seconds, rounds), why, **more)

    pairs = list(zip(found.inductance.tolist(), found.speed.tolist()))
    rows = [row(study, "run with the inductance", L, wrong, limit, rounds) for L, wrong in pairs]
    for L, _ in pairs:
        full = replace(machine, motor=replace(machine.motor, inductance=L))
        run, _, rounds = best_of(partial(full.simulate, times, reduce=False), effort)
        error = float(run.error[1]) if run.complete else math.nan
        rows.append(row(kept, "the same integrator at a tighter tolerance", L, error, run, rounds))
    question = "The motor without its inductance: error of the speed after the electrical transient"
    note = (
        "The settings are inductances, not accuracies. Errors with the inductance are the integrator's own estimate: "
        "no other method follows so stiff a motor."
    )
    problem = Problem("small-inductance", question, "rad/s", tuple(rows), "run", note, over=_L)
    return replace(problem, sentences=_limit_sentences(problem))


def _limit_sentences(problem: Problem) -> dict[str, str]:
    """Say how the error of the limit falls with the inductance, and what keeping it costs."""
    bare, full = (problem.of(method) for method in problem.methods)
    small, large = min(bare, key=lambda row: row.more[_L]), max(bare, key=lambda row: row.more[_L])
    share = small.error / small.more[_L]
    times = max(row.seconds for row in full) / small.seconds
    worst = max((row.error for row in full if row.good), default=math.nan)
    return {
        bare[0].method: (
            f"{bare[0].method}: errors from {large.error:.1g} rad/s ({large.setting}) down to {small.error:.1g} rad/s "
            f"({small.setting}), {share:.2g} rad/s per henry in the limit, in {seconds_text(small.seconds)}: "
            "enough where that error is."
        ),
        full[0].method: (
            f"{full[0].method}: errors up to {worst:.1g} rad/s whatever the inductance, in up to {times:.2g} times the "
            "time."
        ),
    }
