"""``module = "tribometer"``: the event-driven run, time stepping and the regularised form, each against another method.

The event-driven run is compared with Taylor series in multiple precision that share no code with it; the two
approximations with the event-driven run at its tightest tolerance.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from inspect import signature
from typing import TYPE_CHECKING, Any

from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of

if TYPE_CHECKING:
    from graphsynth.systems.tribometer.model import Tribometer
    from graphsynth.systems.tribometer.stick_slip_precise import PreciseMotion

_DIGITS = 22
_PRECISE_S = 2.0


def _model(context: Any) -> Any:
    from graphsynth.systems.tribometer.stages import tribometer_of

    return tribometer_of(context)


def events(context: Any, effort: Effort) -> Problem:
    """Event-driven run against multiple precision, over the first seconds."""
    duration = min(context.scene.mechanism.run.duration_s, 0.5 if effort.quick else _PRECISE_S)
    return event_problem(_model(context), duration, effort)


def stick_slip(context: Any, effort: Effort) -> Problem:
    """All methods over the duration of the scene, with its settings."""
    table = context.scene.mechanism
    duration = min(table.run.duration_s, 1.0) if effort.quick else table.run.duration_s
    m = table.methods
    return stick_slip_problem(_model(context), duration, m.steps_s, m.speeds_m_s, m.solvers, effort)


def _default(method: str, name: str) -> Any:
    from graphsynth.systems.tribometer.model import Tribometer

    return signature(getattr(Tribometer, method)).parameters[name].default


def event_problem(model: Tribometer, duration: float, effort: Effort | None = None) -> Problem:
    """Compare the event-driven run with multiple precision: final position and every event.

    Parameters
    ----------
    model : Tribometer
        Its law has a Taylor series at rest.
    duration : float
        s; the multiple-precision run takes seconds for each second.
    effort : Effort, optional

    Raises
    ------
    SpecError
        A law without a Taylor series.
    """
    from graphsynth.systems.tribometer.accuracy import tolerance_study
    from graphsynth.systems.tribometer.stick_slip_precise import precise_motion

    effort = effort or Effort()
    default = _default("event_driven", "rtol")
    truth = precise_motion(model, duration, digits=_DIGITS)
    tolerances = sorted({1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, default}, reverse=True)
    found = tolerance_study(model, truth, duration, tolerances=effort.some(tolerances), rounds=effort.rounds)
    rows = tuple(replace(row, default=row.value == default) for row in found.rows)
    return replace(found, rows=rows + _general_rows(model, truth, duration, effort))


def _general_rows(model: Tribometer, truth: PreciseMotion, duration: float, effort: Effort) -> tuple[Row, ...]:
    """Compare the same as a model of the general dynamics, with sticking as a state of its joint."""
    from graphsynth.dynamics.integrate import simulate_dynamics
    from graphsynth.systems.tribometer.general_model import general_model

    own = signature(simulate_dynamics).parameters["rtol"].default
    general, start = general_model(model)
    rows = []
    for rtol in effort.some(sorted({1e-6, 1e-8, 1e-10, own}, reverse=True)):
        run = partial(simulate_dynamics, general, [0.0, duration], start=start, form="augmented", rtol=rtol)
        found, seconds, rounds = best_of(run, effort)
        why = "" if found.completed else found.message
        same = found.completed and len(found.events) == len(truth.events)
        gap = max((abs(e.time - float(t.time)) for e, t in zip(found.events, truth.events)), default=0.0)
        error = abs(float(found.poses[-1, 2, 0]) - float(truth.x2)) if found.completed else math.nan
        more = {"events": float(len(found.events)), "steps or calls": float(found.steps)}
        rows.append(
            Row(
                "general model",
                f"rtol {rtol:.0e}",
                error,
                seconds,
                rounds,
                "error of the final position",
                f"Taylor series with {_DIGITS} digits",
                RowStatus.OK if same else RowStatus.FAILED,
                "" if same else why or "other events than the reference",
                rtol == own,
                more=more | ({"event error [s]": gap} if same else {}),
            )
        )
    return tuple(rows)


def stick_slip_problem(
    model: Tribometer,
    duration: float,
    steps: tuple[float, ...],
    speeds: tuple[float, ...],
    solvers: tuple[str, ...],
    effort: Effort | None = None,
) -> Problem:
    """Compare all three ways to simulate stick-slip over some seconds.

    Parameters
    ----------
    model : Tribometer
    duration : float
        s.
    steps, speeds : tuple of float
        Of time stepping, s; of the regularised form, m/s.
    solvers : tuple of str
        For the regularised form.
    effort : Effort, optional

    Raises
    ------
    SpecError
        If the event-driven run does not finish: then there is no reference.
    """
    from graphsynth.systems.tribometer.accuracy import method_study, regularisation_study

    effort = effort or Effort()
    defaults = {
        "event-driven": _default("event_driven", "rtol"),
        "time stepping": _default("time_stepping", "step"),
        "": _default("regularised", "speed"),
    }
    own_solver = _default("regularised", "solver")
    found = method_study(
        model,
        duration,
        tolerances=effort.some((1e-4, 1e-6, 1e-8, 1e-10, 1e-12)),
        steps=effort.some(steps),
        speeds=effort.some(speeds),
        solvers=solvers,
        rounds=effort.rounds,
        most_calls=200_000,
    )
    rows = list(found.rows)
    if own_solver not in solvers and not effort.quick:
        rows += regularisation_study(
            model, duration, speeds=(1e-2, 1e-3, defaults[""]), solvers=(own_solver,), most_calls=200_000
        ).rows
    shaped = []
    for row in rows:
        own = row.method in defaults
        row = replace(
            row, default=row.value == defaults[row.method if own else ""] and own | (row.method == own_solver)
        )
        if row.method == "event-driven":
            row = replace(row, reference=row.reference + " (the same method; see the problem events)")
        shaped.append(row if own else _regularised(row))
    note = (
        f"Observed order of time stepping: {found.order('time stepping'):.2f}. The regularised form never sticks: it "
        "has no events, and its error is that of the form, not of the solver. The event-driven run is compared with "
        "itself at its tightest tolerance here, and with multiple precision in the problem events."
    )
    return replace(found, rows=tuple(shaped), note=note)


def _regularised(row: Row) -> Row:
    more = {key: value for key, value in row.more.items() if not key.startswith("event")}
    return replace(row, method=f"regularised, {row.method}", more=more)
