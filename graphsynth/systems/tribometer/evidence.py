"""``module = "tribometer"``: the event-driven run, time stepping and the regularised form, each against another method.

The event-driven run is compared with Taylor series in multiple precision that share no code with it; the two
approximations with the event-driven run at its tightest tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from inspect import signature
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of
from graphsynth.pipeline.stages import build
from graphsynth.systems.tribometer.forms import model_error
from graphsynth.systems.tribometer.model import Tribometer, general_model
from graphsynth.systems.tribometer.motion import RunStatus, StickSlipMotion

if TYPE_CHECKING:
    from graphsynth.systems.tribometer.precise import PreciseMotion

Array = NDArray[np.float64]
_DIGITS = 22
_PRECISE_S = 2.0
_SETTINGS = {"event-driven": "rtol {:.0e}", "time stepping": "step {:g} s"}
_FINAL = "error of the final position"
_STATUS = {RunStatus.COMPLETE: RowStatus.OK, RunStatus.UNRELIABLE: RowStatus.UNRELIABLE}


def events(context: Any, effort: Effort) -> Problem:
    """Event-driven run against multiple precision, over the first seconds."""
    duration = min(context.scene.mechanism.run.duration, 0.5 if effort.quick else _PRECISE_S)
    return event_problem(build(context.scene), duration, effort)


def stick_slip(context: Any, effort: Effort) -> Problem:
    """All methods over the duration of the scene, with its settings."""
    run, ways = context.scene.mechanism.run, context.scene.mechanism.methods
    duration = min(run.duration, 1.0) if effort.quick else run.duration
    return stick_slip_problem(build(context.scene), duration, ways.steps, ways.speeds, ways.solvers, effort)


class _Truth(NamedTuple):
    """Positions at the times of a study, times of the events, and where they are from."""

    times: Array
    positions: Array
    events: Array
    name: str


def _reference(model: Tribometer, duration: float) -> _Truth:
    """Run the automaton at the times of theory/tribometer 10: 0.05, 0.10, ... below the duration."""
    times: Array = 0.05 * np.arange(1, max(2, round(duration / 0.05)), dtype=np.float64)
    found = model.event_driven(duration, times=times)
    if not found.complete:
        raise SpecError(f"There is no reference to compare with: {found.statement}")
    name = f"event-driven run with relative tolerance 1e-14, error estimated {found.error:.1e} m"
    return _Truth(times, found.x2, np.array([event.time for event in found.events]), name)


def _row(method: str, value: float, run: Callable[[], StickSlipMotion], truth: _Truth, effort: Effort) -> Row:
    """Measure one run; a setting that the method refuses is a failure."""
    setting = _SETTINGS.get(method, "speed {:.0e} m/s").format(value)
    row = Row(method, setting, math.nan, math.nan, 0, "largest error of the position", truth.name, value=value)
    try:
        motion, seconds, rounds = best_of(run, effort, warm=False)
    except SpecError as refusal:
        if method in _SETTINGS:
            raise
        return replace(row, status=RowStatus.FAILED, reason=str(refusal), more={"events": 0.0, "steps or calls": 0.0})
    status = _STATUS.get(motion.status, RowStatus.FAILED)
    found = np.array([event.time for event in motion.events])
    more = {"events": float(found.size), "steps or calls": float(motion.evaluations)}
    if found.size == truth.events.size and found.size:
        more["event error [s]"] = float(np.abs(found - truth.events).max())
    return replace(
        row,
        error=math.nan if status is RowStatus.FAILED else float(np.abs(motion.x2 - truth.positions).max()),
        seconds=seconds,
        rounds=rounds,
        status=status,
        reason="" if status is RowStatus.OK else motion.statement,
        more=more,
    )


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
    """Error and run time of all three methods on one tribometer over ``duration`` s, failures and refusals included.

    The reference is the automaton with the tolerance 1e-14: for its own rows it is itself, for the others a different
    method; `SpecError` if it does not finish.  Rows of the regularised form say "unreliable" if the error is more than
    three times that of the form with the other solvers at the same speed, or more than ten times `model_error` if there
    is no other.

    Settings are ``tolerances`` of the automaton, ``steps`` (s) of time stepping, ``speeds`` (m/s) and ``solvers`` of
    the regularised form, of which one that needs more than ``most_calls`` calls has failed; a method without settings
    is left out.  Of ``rounds`` runs the shortest counts; solvers but LSODA run once.

    Examples
    --------
    >>> study = method_study(Tribometer(), 0.5, tolerances=[1e-8], steps=[1e-4], speeds=[1e-3], rounds=1)
    >>> [row.method for row in study.rows]
    ['event-driven', 'time stepping', 'LSODA']
    """
    truth = _reference(model, duration)

    def rows(method: str, name: str, values: Sequence[float], run: Callable[..., StickSlipMotion]) -> list[Row]:
        effort = Effort(1 if method in solvers and method != "LSODA" else rounds)
        return [
            _row(method, value, partial(run, duration, times=truth.times, **{name: value}), truth, effort)
            for value in values
        ]

    run, step = partial(model.event_driven, estimate=False), partial(model.time_stepping, estimate=False)
    found = rows("event-driven", "rtol", () if model.closed_form else tolerances, run)
    found += rows("time stepping", "step", steps, step)
    smooth: list[Row] = []
    for solver in solvers:
        solve = partial(model.regularised, solver=solver, check=False, most_calls=most_calls)
        smooth += rows(solver, "speed", speeds, solve)
    question = f"Stick-slip over {duration:g} s: position of the upper platform every 50 ms"
    for row in smooth:
        others = [other.error for other in smooth if other.value == row.value and other.method != row.method]
        others = [error for error in others if not math.isnan(error)]
        bound = 3.0 * min(others) if others else 10.0 * model_error(row.value)
        if row.status is RowStatus.OK and row.error > bound:
            text = f"{row.method} reports success with an error of {row.error:.1e} m, above that of the form itself."
            row = replace(row, status=RowStatus.UNRELIABLE, reason=text)
        found.append(row)
    return Problem("stick-slip", question, "m", tuple(found), note=f"Error against {truth.name}.")


def _default(method: str, name: str) -> Any:
    return signature(getattr(Tribometer, method)).parameters[name].default


def event_problem(model: Tribometer, duration: float, effort: Effort | None = None) -> Problem:
    """Compare the event-driven run with multiple precision: final position and every event.

    Raises `SpecError` if the law has no Taylor series at rest; takes seconds for each second of ``duration``.
    """
    effort = effort or Effort()
    default = _default("event_driven", "rtol")
    from graphsynth.systems.tribometer.precise import precise_motion

    truth = precise_motion(model, duration, digits=_DIGITS)
    tolerances = sorted({1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, default}, reverse=True)
    rows = tolerance_rows(model, truth, duration, effort.some(tolerances), effort.rounds)
    rows = [replace(row, default=row.value == default) for row in rows] + _general_rows(model, truth, duration, effort)
    count = len(truth.events)
    question = f"Event-driven run over {duration:g} s: final position of the upper platform, {count} events"
    return Problem("events", question, "m", tuple(rows))


def tolerance_rows(
    model: Tribometer, reference: PreciseMotion, duration: float, tolerances: Sequence[float], rounds: int
) -> list[Row]:
    """Error of the automaton against a motion in multiple precision of the same model and duration, by tolerance."""
    times = np.array([float(event.time) for event in reference.events])
    name = f"Taylor series with {reference.digits} digits"
    truth = _Truth(np.array([duration]), np.array([float(reference.x2)]), times, name)
    rows = []
    for rtol in tolerances:
        run = partial(model.event_driven, duration, times=[duration], rtol=rtol, estimate=False)
        row = replace(_row("event-driven", rtol, run, truth, Effort(rounds)), kind=_FINAL)
        if row.more["events"] != times.size:
            reason = f"{row.more['events']:.0f} events for {times.size}."
            row = replace(row, status=RowStatus.UNRELIABLE, reason=reason)
        rows.append(row)
    return rows


def _general_rows(model: Tribometer, truth: PreciseMotion, duration: float, effort: Effort) -> list[Row]:
    """Compare the same as a model of the general dynamics, with sticking as a state of its joint."""
    from graphsynth.dynamics.integrate import simulate_dynamics

    own = signature(simulate_dynamics).parameters["rtol"].default
    general, start = general_model(model)
    rows = []
    for rtol in effort.some(sorted({1e-6, 1e-8, 1e-10, own}, reverse=True)):
        run = partial(simulate_dynamics, general, [0.0, duration], start=start, form="augmented", rtol=rtol)
        found, *timed = best_of(run, effort)
        more = {"events": float(len(found.events)), "steps or calls": float(found.steps)}
        why = "" if found.completed else found.message
        if found.completed and len(found.events) != len(truth.events):
            why = "other events than the reference"
        elif not why:
            gaps = (abs(e.time - float(t.time)) for e, t in zip(found.events, truth.events))
            more["event error [s]"] = max(gaps, default=0.0)
        error = abs(float(found.poses[-1, 2, 0]) - float(truth.x2)) if found.completed else math.nan
        given: dict[str, Any] = {"kind": _FINAL, "reference": f"Taylor series with {_DIGITS} digits"}
        given |= {"default": rtol == own, "more": more}
        rows.append(Row.of("general model", f"rtol {rtol:.0e}", error, timed, why, **given))
    return rows


def stick_slip_problem(
    model: Tribometer,
    duration: float,
    steps: tuple[float, ...],
    speeds: tuple[float, ...],
    solvers: tuple[str, ...],
    effort: Effort | None = None,
) -> Problem:
    """Compare all three ways to simulate stick-slip over some seconds.

    ``steps`` are those of time stepping, s, ``speeds`` and ``solvers`` those of the regularised form; `SpecError` if
    the event-driven run does not finish: then there is no reference.
    """
    effort = effort or Effort()
    defaults = {"event-driven": ("event_driven", "rtol"), "time stepping": ("time_stepping", "step")}
    own_solver, speed = _default("regularised", "solver"), _default("regularised", "speed")
    study = partial(method_study, model, duration, most_calls=200_000)
    found = study(
        tolerances=effort.some((1e-4, 1e-6, 1e-8, 1e-10, 1e-12)),
        steps=effort.some(steps),
        speeds=effort.some(speeds),
        solvers=solvers,
        rounds=effort.rounds,
    )
    rows = list(found.rows)
    if own_solver not in solvers and not effort.quick:
        rows += study(tolerances=(), steps=(), speeds=(1e-2, 1e-3, speed), solvers=(own_solver,)).rows
    shaped = []
    for row in rows:
        if row.method in defaults:
            row = replace(row, default=row.value == _default(*defaults[row.method]))
            if row.method == "event-driven":
                row = replace(row, reference=row.reference + " (the same method; see the problem events)")
        else:
            default = row.method == own_solver and row.value == speed
            more = {key: value for key, value in row.more.items() if not key.startswith("event")}
            row = replace(row, default=default, method=f"regularised, {row.method}", more=more)
        shaped.append(row)
    note = (
        f"Observed order of time stepping: {found.order('time stepping'):.2f}. The regularised form never sticks: it "
        "has no events, and its error is that of the form, not of the solver. The event-driven run is compared with "
        "itself at its tightest tolerance here, and with multiple precision in the problem events."
    )
    return replace(found, rows=tuple(shaped), note=note)
