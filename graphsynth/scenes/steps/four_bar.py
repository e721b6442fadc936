"""The lambda linkage of a scene: recognise four-bars, move them, assess the tilted bearing, judge."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from graphsynth.scenes.products import Attempt, Candidate, Quantity, Recognised, Record, Table, each
from graphsynth.scenes.scene import LambdaTable
from graphsynth.scenes.stages import Context
from graphsynth.scenes.steps.records import recognise_by_key, records_of

if TYPE_CHECKING:
    from graphsynth.jamming.assess import JammingReport
    from graphsynth.kinematics.lambda_linkage import LambdaLinkage, LambdaPositions

__all__ = ["LambdaMotion", "jamming", "judge", "kinematics", "recognise"]


@dataclass(frozen=True, slots=True)
class LambdaMotion:
    """One turn of the crank.

    Attributes
    ----------
    linkage : LambdaLinkage
        With the tilted motor axis.
    planar, tilted : LambdaPositions
        Motion without and with the tilt at the same crank angles, from 0 to 2 pi.
    residual : float
        Largest relative error of the rod length in `tilted`, as recomputed from the positions (estimated error).
    """

    linkage: LambdaLinkage
    planar: LambdaPositions
    tilted: LambdaPositions
    residual: float


def _table(context: Context) -> LambdaTable:
    table = context.scene.mechanism
    assert isinstance(table, LambdaTable)
    return table


def recognise(context: Context, candidates: tuple[Candidate, ...]) -> tuple[Recognised, ...]:
    """Mark the candidates whose canonical key is that of the four-bar with its frame."""
    from graphsynth.kinematics.lambda_linkage import LambdaLinkage

    return recognise_by_key(candidates, LambdaLinkage().graph(), "lambda_linkage")


def kinematics(context: Context, recognised: tuple[Recognised, ...]) -> tuple[Attempt, ...]:
    """Move every recognised candidate through one turn with the dimensions of the scene."""
    return each((Attempt(r.candidate, r) for r in recognised if r.module), lambda _: _move(_table(context)))


def _move(table: LambdaTable) -> LambdaMotion:
    from dataclasses import replace

    import numpy as np

    from graphsynth.errors import GeometryError
    from graphsynth.kinematics.lambda_linkage import LambdaLinkage

    lengths = table.lengths
    linkage = LambdaLinkage(
        lengths.frame,
        lengths.crank,
        lengths.coupler,
        lengths.rocker,
        sgn=table.branch,
        alpha=table.tilt.alpha_rad,
        axis=table.tilt.axis,
    )
    f = np.linspace(0.0, math.tau, table.positions + 1)
    tilted = linkage.positions(f)
    if not tilted.assembled.any():
        raise GeometryError(f"the linkage cannot be assembled at any crank angle ({'; '.join(tilted.reasons())})")
    rod = np.sqrt(((tilted.A - tilted.B) ** 2).sum(axis=-1))
    residual = float(np.nanmax(np.abs(rod / linkage.l3 - 1.0)))
    return LambdaMotion(linkage, replace(linkage, alpha=0.0).positions(f), tilted, residual)


def jamming(context: Context, motions: tuple[Attempt, ...]) -> tuple[Attempt, ...]:
    """Assess the bearing of every moved candidate by the closed form, under condition A and condition B."""
    from graphsynth.jamming.assess import assess_jamming
    from graphsynth.jamming.bearing import Bearing

    table = _table(context)
    bearing = Bearing(table.bearing.radius_mm, table.bearing.height_mm, table.bearing.clearance_mm)

    def assess(motion: LambdaMotion) -> dict[Literal["A", "B"], JammingReport]:
        return {c: assess_jamming(motion.linkage, bearing, c, motion.tilted.f) for c in _CONDITIONS}

    return each(motions, assess)


def judge(
    context: Context, recognised: tuple[Recognised, ...], motions: tuple[Attempt, ...], assessments: tuple[Attempt, ...]
) -> tuple[tuple[Record, ...], tuple[Table, ...]]:
    """Give one record per candidate and the tables of the first one assessed."""
    condition = _table(context).bearing.condition

    def verdict(reports: dict[Literal["A", "B"], JammingReport]) -> tuple[str, bool, tuple[Quantity, ...]]:
        report = reports[condition]
        return f"{report.verdict.value}, condition {condition}", report.verdict.is_free, _margins(report)

    records = records_of(recognised, assessments, verdict)
    done = next((a for a in assessments if not a.failed), None)
    if done is None:
        return records, ()
    motion = next(m.value for m in motions if m.candidate.number == done.candidate.number)
    return records, (_motion_table(motion), _jam_table(done.value))


def _margins(report: JammingReport) -> tuple[Quantity, ...]:
    """Margins of one bearing; the closed forms carry no error bound in floating point."""
    values = [
        ("least clearance over the turn", -report.worst_gap, "mm"),
        ("largest tilt", report.largest_tilt, "rad"),
        ("critical tilt", report.critical_tilt, "rad"),
        ("jammed part of the turn", sum(arc.length for arc in report.arcs.arcs) / math.tau, ""),
        ("smallest clearance", report.smallest_clearance.value if report.smallest_clearance else None, "mm"),
        ("largest axis tilt", report.largest_misalignment.value if report.largest_misalignment else None, "rad"),
    ]
    return tuple(Quantity(name, value, unit) for name, value, unit in values if value is not None)


def _jam_table(reports: dict[Literal["A", "B"], JammingReport]) -> Table:
    """Lay the two contact conditions side by side."""
    margins = {c: {q.name: q.text for q in _margins(r)} for c, r in reports.items()}
    names = dict.fromkeys(name for values in margins.values() for name in values)
    rows = [("verdict", *(r.verdict.value for r in reports.values()))]
    arcs = max(len(r.arcs.arcs) for r in reports.values())
    rows += [(f"jam arc {i + 1}", *(_arc_text(r, i) for r in reports.values())) for i in range(arcs)]
    rows += [(name, *(values.get(name, "no limit") for values in margins.values())) for name in names]
    method = next(iter(reports.values())).method
    columns = ("", *(f"condition {c} ({_CONDITIONS[c]})" for c in reports))
    return Table("Jamming of the bearing at B", columns, tuple(rows), f"How had: {method}.")


_CONDITIONS: dict[Literal["A", "B"], str] = {"A": "short bearing in a long hole", "B": "long shaft in a short hole"}


def _arc_text(report: JammingReport, i: int) -> str:
    if i >= len(report.arcs.arcs):
        return "none"
    arc = report.arcs.arcs[i]
    return f"{math.degrees(arc.start):.8f}° to {math.degrees(arc.stop):.8f}°"


def _motion_table(motion: LambdaMotion) -> Table:
    """State what the motion is, with and without the tilt."""
    import numpy as np

    turn = motion.linkage.full_turn()
    away = float(np.nanmax(np.abs(motion.tilted.M[..., 2])))
    shift = float(np.nanmax(np.hypot(*(motion.tilted.M - motion.planar.M)[..., :2].T)))
    rows = (
        ("full turn", turn.statement, turn.method),
        ("crank positions computed", str(len(motion.tilted.f)), "exact"),
        (
            "straight stroke of M, crank 90° to 270°",
            _stroke(motion.linkage),
            "estimated",
        ),
        ("M leaves the plane by at most", f"{away:.8g}", "estimated, largest sample"),
        ("the tilt moves M in the plane by at most", f"{shift:.6g}", "estimated, largest sample"),
        ("relative error of the rod length", f"{motion.residual:.1e}", "estimated, largest sample"),
    )
    return Table("Motion", ("quantity", "value", "how had"), rows, "Lengths in the unit of the link lengths.")


def _stroke(linkage: LambdaLinkage) -> str:
    """Say how long and how straight the working stroke is, or why there is none."""
    from graphsynth.errors import GeometryError

    try:
        stroke = linkage.straightness()
    except GeometryError as error:
        return f"none: {error}"
    return f"{stroke.chord:.8g} long, {stroke.deviation:.6g} wide"
