"""Motors with mechanisms: the integrator of drives beside scipy's solvers, and the limit of a small inductance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from inspect import signature
from typing import Any

import numpy as np

from graphsynth.core.errors import SpecError
from graphsynth.evidence.choice import seconds_text
from graphsynth.evidence.precise_drive import NAME, Shape, precise_drive, shape_of_series
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of

__all__ = ["drive_problem", "reduction_problem", "work_rows"]

_L = "inductance [H]"
_PRECISE = f"{NAME} on the equations of theory/motor-drive"
_KIND = "largest error of speed and currents over their largest values"
#: A scipy solver that needs more calls of the right-hand side is a failure here.
_MOST_CALLS = 30_000


def drive_problem(
    plant: Any, motor: Any, train: Any, end: float, effort: Effort | None = None, *, shape: Shape | None = None
) -> Problem:
    """Run a drive up from rest with every integrator and several tolerances.

    Parameters
    ----------
    plant, motor, train
        As for `graphsynth.evidence.driven.work_precision`; without events on the way.
    end : float
        Final time, s.
    effort : Effort, optional
    shape : Shape, optional
        Inertia and load as `graphsynth.evidence.precise_drive` takes them; by default those of the plant's series.

    Raises
    ------
    SpecError
        A motor with events (ideal speed, voltage limit) or a train that loses power.
    """
    from graphsynth.dynamics.driven.run import run
    from graphsynth.evidence.driven import work_precision

    effort = effort or Effort()
    default = signature(run).parameters["rtol"].default
    times = np.linspace(0.0, end, 11)
    tolerances = (
        (1e-4, 1e-8, default)
        if effort.quick
        else tuple(sorted({1e-4, 1e-6, 1e-8, 1e-10, 1e-12, default}, reverse=True))
    )
    options = {"rounds": effort.rounds, "most_calls": _MOST_CALLS}
    found = work_precision(plant, motor, train, times, tolerances=tolerances, solvers=("LSODA",), **options)
    rows, reference = list(found.rows), found.reference
    slow = (1e-4, 1e-6, 1e-8)
    for solver in () if effort.quick else ("DOP853", "BDF", "Radau"):
        rows += work_precision(
            plant, motor, train, times, tolerances=slow if solver != "DOP853" else tolerances, solvers=(solver,),
            **{**options, "rounds": 1},
        ).rows[-len(slow if solver != "DOP853" else tolerances) :]  # fmt: skip
    shaped = work_rows(rows, reference, effort, default)
    truth = _precise(plant, motor, train, times, shape)
    note = (
        f"graphsynth is compared with {_PRECISE}, which shares no code with it; scipy's solvers with {reference}, "
        "which shares the compiled right-hand side with them. scipy's DOP853 is that method at a looser tolerance."
    )
    if truth is None:
        note = f"No reference of its own for this motor. All are compared with {reference}: the same right-hand side."
    else:
        shaped = tuple(_against(row, truth, (plant, motor, train, times)) for row in shaped)
    question = f"Speed and currents of the drive from rest to {end:g} s, at eleven times"
    return Problem("drive", question, "relative", shaped, "run", note)


def _precise(plant: Any, motor: Any, train: Any, times: Any, shape: Shape | None) -> Any:
    """States at the times from another implementation; None for what it does not know."""
    if shape is None and (plant.linkage is not None or plant.load_series is not None):
        return None
    shape = shape or shape_of_series(plant.rows, plant.base, plant.load)
    try:
        return precise_drive(shape, motor, train.ratio, train.inertia, plant.friction, times.tolist())
    except SpecError:  # another motor, or too stiff for an explicit method
        return None


def _against(row: Row, truth: Any, drive: Any) -> Row:
    """Row of the own integrator with its error against the precise motion; others as they are."""
    from graphsynth.dynamics.driven.run import run

    if row.method != "graphsynth" or not row.good:
        return row
    plant, motor, train, times = drive
    found = run(plant, motor, train, times, rtol=float(row.setting.split()[1]), estimate=False)
    states = np.column_stack([found.speed, found.currents])
    scale = np.abs(truth).max(axis=0)[1:]
    error = float((np.abs(states - truth[:, 1:]).max(axis=0) / np.where(scale > 0, scale, 1)).max())
    return replace(row, error=error, reference=_PRECISE, more={**row.more, "distance from scipy DOP853": row.error})


def work_rows(rows: Sequence[Any], reference: str, effort: Effort, default: float) -> tuple[Row, ...]:
    """Turn rows of the room of dynamics into ours; what is not done is a failure, with its error if it has one."""
    found = []
    for r in rows:
        done = r.status == "done" and math.isfinite(r.error)
        missed = not done and math.isfinite(r.error)
        status = RowStatus.OK if done else RowStatus.UNRELIABLE if missed else RowStatus.FAILED
        own = r.method == "graphsynth"
        same = "DOP853" in r.method and "DOP853" in reference
        found.append(
            Row(
                r.method, f"rtol {r.setting:.0e}", r.error, r.seconds,
                effort.rounds if own or "LSODA" in r.method else 1, _KIND,
                reference + (" (the same method)" if same else ""), status, "" if done else r.status,
                own and r.setting == default, more={"steps or calls": float(r.steps)},
            )
        )  # fmt: skip
    return tuple(found)


def reduction_problem(machine: Any, times: Any, inductances: Sequence[float], effort: Effort | None = None) -> Problem:
    """Leave the inductance out: what the limit L -> 0 costs in accuracy, and what keeping it costs in time.

    Parameters
    ----------
    machine : MotorDrivenPlatform or Braider
        Has ``inductance_study``.
    times : array_like
        Output times, s.
    inductances : sequence of float
        H, at least three.
    effort : Effort, optional
    """
    effort = effort or Effort()
    chosen = effort.some(inductances)
    found = machine.inductance_study(times, chosen)
    least = replace(machine, motor=replace(machine.motor, inductance=float(found.inductance.min())))
    limit, _, rounds = best_of(lambda: least.simulate(times, reduce=True), effort)
    rows = []
    for k, L in enumerate(found.inductance.tolist()):
        wrong = float(found.speed[k])
        rows.append(
            Row(
                "model without inductance", f"L = {L:g} H", wrong, limit.seconds, rounds,
                "largest error of the speed behind the electrical transient", "run with the inductance",
                more={"steps": float(limit.steps)},
            )
        )  # fmt: skip
    for L in found.inductance.tolist():
        kept = replace(machine, motor=replace(machine.motor, inductance=L))
        run, _, rounds = best_of(lambda k=kept: k.simulate(times, reduce=False), effort)  # type: ignore[misc]
        rows.append(
            Row(
                "model with inductance", f"L = {L:g} H", float(run.error[1]) if run.complete else math.nan, run.seconds,
                rounds, "estimated error of the speed", "the same integrator at a tighter tolerance",
                RowStatus.OK if run.complete else RowStatus.FAILED, run.reason, more={"steps": float(run.steps)},
            )
        )  # fmt: skip
    question = "The motor without its inductance: error of the speed after the electrical transient"
    note = (
        "The settings are inductances, not accuracies. Errors with the inductance are the integrator's own estimate: "
        "no other method follows so stiff a motor."
    )
    found_rows = tuple(replace(row, more={**row.more, _L: float(row.setting.split()[2])}) for row in rows)
    problem = Problem("small-inductance", question, "rad/s", found_rows, "run", note, over=_L)
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
            f"({small.setting}), {share:.2g} rad/s per henry in the limit, in {seconds_text(small.seconds)}; choose it "
            "where that error is small enough."
        ),
        full[0].method: (
            f"{full[0].method}: errors up to {worst:.1g} rad/s whatever the inductance, in up to {times:.2g} times the "
            "time; choose it otherwise."
        ),
    }
