"""Stick-slip: the event-driven run, time stepping and the regularised form, each against another method.

The event-driven run is compared with Taylor series in multiple precision that share no code with it; the two
approximations with the event-driven run at its tightest tolerance.
"""

from __future__ import annotations

import math
from inspect import signature
from typing import TYPE_CHECKING, Any

from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus

if TYPE_CHECKING:
    from graphsynth.systems.tribometer.model import Tribometer
    from graphsynth.systems.tribometer.stick_slip_precise import PreciseMotion

__all__ = ["event_problem", "stick_slip_problem"]

_DIGITS = 22


def _default(method: str, name: str) -> Any:
    from graphsynth.systems.tribometer.model import Tribometer

    return signature(getattr(Tribometer, method)).parameters[name].default


def _row(r: Any, setting: str, reference: str, kind: str, rounds: int, default: bool) -> Row:
    status = {"complete": RowStatus.OK, "unreliable": RowStatus.UNRELIABLE}.get(r.status.value, RowStatus.FAILED)
    wrong = status is not RowStatus.OK
    more = {"events": float(r.events), "event error [s]": r.event_error, "steps or calls": float(r.evaluations)}
    return Row(
        r.method, setting, r.error, r.seconds, rounds, kind, reference, status, r.statement if wrong else "", default,
        more={key: value for key, value in more.items() if math.isfinite(value)},
    )  # fmt: skip


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
    kind = "error of the final position"
    rows = tuple(
        _row(r, f"rtol {r.parameter:.0e}", found.reference, kind, effort.rounds, r.parameter == default)
        for r in found.rows
    )
    rows += _general_rows(model, truth, duration, effort)
    question = f"Event-driven run over {duration:g} s: final position of the upper platform, {len(truth.events)} events"
    return Problem("events", question, "m", rows, "run")


def _general_rows(model: Tribometer, truth: PreciseMotion, duration: float, effort: Effort) -> tuple[Row, ...]:
    """Compare the same as a model of the general dynamics, with sticking as a state of its joint."""
    from graphsynth.dynamics.integrate import simulate_dynamics
    from graphsynth.systems.tribometer.general_model import general_model

    own = signature(simulate_dynamics).parameters["rtol"].default
    general, start = general_model(model)
    rows = []
    for rtol in effort.some(sorted({1e-6, 1e-8, 1e-10, own}, reverse=True)):
        runs = [
            simulate_dynamics(general, [0.0, duration], start=start, form="augmented", rtol=rtol)
            for _ in range(effort.rounds + 1)
        ]
        found = runs[-1]
        why = "" if found.completed else found.message
        same = found.completed and len(found.events) == len(truth.events)
        gap = max((abs(e.time - float(t.time)) for e, t in zip(found.events, truth.events)), default=0.0)
        error = abs(float(found.poses[-1, 2, 0]) - float(truth.x2)) if found.completed else math.nan
        more = {"events": float(len(found.events)), "steps or calls": float(found.steps)}
        rows.append(Row(
            "general model", f"rtol {rtol:.0e}", error, min(run.seconds for run in runs[1:]), effort.rounds,
            "error of the final position", f"Taylor series with {_DIGITS} digits",
            RowStatus.OK if same else RowStatus.FAILED, "" if same else why or "other events than the reference",
            rtol == own, more=more | ({"event error [s]": gap} if same else {}),
        ))  # fmt: skip
    return tuple(rows)


def stick_slip_problem(
    model: Tribometer, duration: float, steps: tuple[float, ...], speeds: tuple[float, ...], solvers: tuple[str, ...],
    effort: Effort | None = None,
) -> Problem:  # fmt: skip
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
        "event-driven": _default("event_driven", "rtol"), "time stepping": _default("time_stepping", "step"),
        "": _default("regularised", "speed"),
    }  # fmt: skip
    own_solver = _default("regularised", "solver")
    found = method_study(
        model, duration, tolerances=effort.some((1e-4, 1e-6, 1e-8, 1e-10, 1e-12)), steps=effort.some(steps),
        speeds=effort.some(speeds), solvers=solvers, rounds=effort.rounds, most_calls=200_000,
    )  # fmt: skip
    rows = list(found.rows)
    if own_solver not in solvers and not effort.quick:
        study = regularisation_study(
            model, duration, speeds=(1e-2, 1e-3, defaults[""]), solvers=(own_solver,), most_calls=200_000
        )
        rows += study.rows
    names = {"event-driven": "rtol {:.0e}", "time stepping": "step {:g} s"}
    shaped = []
    for r in rows:
        own = r.method in names
        setting = names.get(r.method, "speed {:.0e} m/s").format(r.parameter)
        reference = found.reference + (
            " (the same method; see the problem events)" if r.method == "event-driven" else ""
        )
        default = r.parameter == defaults[r.method if own else ""] and (own or r.method == own_solver)
        rounds = effort.rounds if own or r.method == "LSODA" else 1
        row = _row(r, setting, reference, "largest error of the position", rounds, default)
        shaped.append(row if own else _regularised(row))
    question = f"Stick-slip over {duration:g} s: position of the upper platform every 50 ms"
    note = (
        f"Observed order of time stepping: {found.order('time stepping'):.2f}. The regularised form never sticks: it "
        "has no events, and its error is that of the form, not of the solver. The event-driven run is compared with "
        "itself at its tightest tolerance here, and with multiple precision in the problem events."
    )
    return Problem("stick-slip", question, "m", tuple(shaped), "run", note)


def _regularised(row: Row) -> Row:
    from dataclasses import replace

    more = {key: value for key, value in row.more.items() if not key.startswith("event")}
    return replace(row, method=f"regularised, {row.method}", more=more)
