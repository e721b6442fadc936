"""The lambda linkage of a scene: recognise four-bars, move them, assess the tilted bearing, judge."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Literal

from graphsynth.pipeline.products import Attempt, Candidate, Finding, Quantity, Recognised, Record, Table, each
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.steps.records import recognise_by_key, records_of
from graphsynth.systems.lambda_linkage.stages_tolerances import tolerance_box
from graphsynth.systems.lambda_linkage.system import LambdaTable

if TYPE_CHECKING:
    from graphsynth.jamming.assess import JammingReport
    from graphsynth.jamming.bearing.arcs import Span
    from graphsynth.jamming.bearing.certify import JamCertificate
    from graphsynth.jamming.bearing.limits import CertifiedLimit
    from graphsynth.mechanism.four_bar import FourBarPositions, TiltedFourBar

__all__ = ["LambdaMotion", "jamming", "judge", "kinematics", "recognise", "tolerance_box"]

_C = Literal["A", "B"]


@dataclass(frozen=True, slots=True)
class LambdaMotion:
    """One turn of the crank.

    Attributes
    ----------
    linkage : TiltedFourBar
        With the tilted motor axis.
    planar, tilted : FourBarPositions
        Motion without and with the tilt at the same crank angles, from 0 to 2 pi.
    residual : float
        Largest relative error of the rod length in `tilted`, as recomputed from the positions (estimated error).
    """

    linkage: TiltedFourBar
    planar: FourBarPositions
    tilted: FourBarPositions
    residual: float


def _table(context: Context) -> LambdaTable:
    table = context.scene.mechanism
    assert isinstance(table, LambdaTable)
    return table


def recognise(context: Context, candidates: tuple[Candidate, ...]) -> tuple[Recognised, ...]:
    """Mark the candidates whose canonical key is that of the four-bar with its frame."""
    from graphsynth.systems.lambda_linkage.model import LambdaLinkage

    return recognise_by_key(candidates, LambdaLinkage().graph(), "lambda_linkage")


def kinematics(context: Context, recognised: tuple[Recognised, ...]) -> tuple[Attempt, ...]:
    """Move every recognised candidate through one turn with the dimensions of the scene."""
    return each((Attempt(r.candidate, r) for r in recognised if r.module), lambda _: _move(_table(context)))


def _move(table: LambdaTable) -> LambdaMotion:
    import numpy as np

    from graphsynth.core.errors import GeometryError
    from graphsynth.systems.lambda_linkage.model import LambdaLinkage

    lengths = table.lengths
    linkage = LambdaLinkage(
        lengths.frame,
        lengths.crank,
        lengths.coupler,
        lengths.rocker,
        sgn=table.branch,
        alpha=table.tilt.alpha,
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
    """Prove what the bearing of every moved candidate does, under condition A and condition B, for all tolerances."""
    from graphsynth.jamming.assess import assess_bearing
    from graphsynth.jamming.bearing.bearing import Bearing

    table, box = _table(context), tolerance_box(context)
    bearing = Bearing(table.bearing.radius_mm, table.bearing.height_mm, table.bearing.clearance_mm)

    def assess(motion: LambdaMotion) -> dict[_C, JammingReport]:
        return {c: assess_bearing(motion.linkage, bearing, c, motion.tilted.f, box, True) for c in _CONDITIONS}

    return each(motions, assess)


def judge(
    context: Context, recognised: tuple[Recognised, ...], motions: tuple[Attempt, ...], assessments: tuple[Attempt, ...]
) -> tuple[tuple[Record, ...], tuple[Table, ...]]:
    """Give one record per candidate and the tables of the first one assessed."""
    condition = _table(context).bearing.condition

    limits: dict[_C, dict[str, CertifiedLimit]] = {}

    def verdict(reports: dict[_C, JammingReport]) -> tuple[str, bool, tuple[Quantity, ...]]:
        report = reports[condition]
        limits.update({c: _limits(context, c) for c in _CONDITIONS})
        margins = _margins(report, limits[condition], _nominal(context, condition))
        return f"{report.verdict.value}, condition {condition}", report.verdict.is_free, margins

    records = records_of(recognised, assessments, verdict)
    done = next((a for a in assessments if not a.failed), None)
    if done is None:
        return records, ()
    motion = next(m.value for m in motions if m.candidate.number == done.candidate.number)
    proved = _proof_table(context, done.value, limits)
    told = _arcs_told(done.value[condition]) + _limits_told(limits[condition])
    jam = replace(_jam_table(context, done.value, limits), findings=told)
    return records, (_motion_table(motion), jam, proved, _fit_table(context))


def _arcs_told(report: JammingReport) -> tuple[Finding, ...]:
    """Say at which crank angles the nominal bearing jams."""
    arcs = report.arcs.arcs
    if not arcs or sum(arc.length for arc in arcs) >= math.tau:
        return ()
    angles = " and ".join(f"{math.degrees(arc.start):.2f}° to {math.degrees(arc.stop):.2f}°" for arc in arcs)
    return (Finding(f"With the nominal dimensions it jams at crank angles {angles} (estimated)."),)


def _limits_told(limits: Mapping[str, CertifiedLimit]) -> tuple[Finding, ...]:
    """Say which clearance is proved to be enough and which tilt harmless, rounded to the safe side."""
    from graphsynth.intervals.reading import shortened

    clearance, tilt = limits["smallest clearance"], limits["largest axis tilt"]
    words = []
    if clearance.works is not None:
        words.append(f"a clearance of {shortened(clearance.works, 1, 4)} {clearance.unit} is enough")
    if tilt.works is not None:
        words.append(f"a tilt of the axis of {shortened(tilt.works, -1, 4)} {tilt.unit} is harmless")
    sentence = "; with the clearance given, ".join(words)
    return (Finding(f"{sentence[:1].upper()}{sentence[1:]} (certified, without tolerances)."),) if words else ()


def _nominal(context: Context, condition: _C) -> JamCertificate:
    """Return what is proved about the dimensions without their tolerances."""
    from graphsynth.jamming.bearing.certify import certify_jamming

    return certify_jamming(tolerance_box(context, tolerances=False), condition)


def _limits(context: Context, condition: _C) -> dict[str, CertifiedLimit]:
    """Bracket the smallest clearance and the largest tilt of the axis, for the dimensions without tolerances."""
    from graphsynth.jamming.bearing.limits import certified_largest_misalignment, certified_smallest_clearance

    box = tolerance_box(context, tolerances=False)
    return {
        "smallest clearance": certified_smallest_clearance(box, condition),
        "largest axis tilt": certified_largest_misalignment(box, condition),
    }


def _margins(
    report: JammingReport, limits: Mapping[str, CertifiedLimit], proved: JamCertificate
) -> tuple[Quantity, ...]:
    """Margins of the nominal dimensions, each with the proved bound of its error where there is one."""
    part = sum(arc.length for arc in report.arcs.arcs) / math.tau
    values: list[tuple[str, float | None, str, tuple[float | None, float | None]]] = [
        ("least clearance over the turn", -report.worst_interference, "mm", proved.clearance_left),
        ("largest tilt", report.largest_tilt, "rad", proved.largest_tilt),
        ("critical tilt", report.critical_tilt, "rad", proved.critical_tilt),
        ("jammed part of the turn", part, "", (None, None)),
    ]
    names = (
        ("smallest clearance", report.smallest_clearance, "mm"),
        ("largest axis tilt", report.largest_misalignment, "rad"),
    )
    for name, limit, unit in names:
        values.append((name, limit.value if limit else None, unit, (limits[name].works, limits[name].fails)))
    return tuple(_quantity(name, value, unit, ends) for name, value, unit, ends in values if value is not None)


def _quantity(name: str, value: float, unit: str, ends: tuple[float | None, float | None]) -> Quantity:
    """Return a value with the bound of its error from two proved ends; estimated without them."""
    a, b = ends
    if a is None or b is None or not (math.isfinite(a) and math.isfinite(b)):
        return Quantity(name, value, unit)
    error = max(abs(Fraction(value) - Fraction(a)), abs(Fraction(value) - Fraction(b)))
    return Quantity(name, value, unit, "certified", math.nextafter(float(error), math.inf) if error else 0.0)


def _proof_table(
    context: Context, reports: dict[_C, JammingReport], limits: dict[_C, dict[str, CertifiedLimit]]
) -> Table:
    """State what is proved for the tolerance box, condition by condition."""
    found = {c: r.certificate for c, r in reports.items() if r.certificate}
    rows: list[tuple[str, ...]] = [("statement", *(f.statement for f in found.values()))]
    if not tolerance_box(context).is_point:
        rows.append(("without tolerances", *(_nominal(context, c).statement for c in found)))
    rows += [
        ("largest gap, mm", *(_bounds(f.largest_interference.lo, f.largest_interference.hi) for f in found.values())),
        ("jams for certain", *(_spans(f.arcs.inner) for f in found.values())),
        ("free for certain", *(_spans(f.arcs.free) for f in found.values())),
        ("neither is proved", *(_total(f.arcs.undecided) for f in found.values())),
        ("assembled", *(f.assembles for f in found.values())),
    ]
    for name in ("smallest clearance", "largest axis tilt"):
        rows.append((f"{name}: works, fails", *(_works(limits[c][name]) for c in found)))
    box = tolerance_box(context)
    ranges = ", ".join(f"{name} {value}" for name, value in box.describe().items() if not box[name].is_point)
    given = "exact decimals" if box.exact_input else "some inputs are rounded numbers"
    note = f"Certified with outward rounding; {given}. "
    note += f"Ranges: {ranges}." if ranges else "No tolerances are given."
    return Table("What is proved about the bearing", ("", *(f"condition {c}" for c in found)), tuple(rows), note)


def _fit_table(context: Context) -> Table:
    """Judge standard fits for the tilt and the dimensions of the scene."""
    from graphsynth.core.errors import GeometryError
    from graphsynth.intervals.reading import shortened
    from graphsynth.jamming.bearing.fits import assess_fits

    box, bearing = tolerance_box(context), _table(context).bearing
    columns = ("fit", "radial clearance [mm]", "verdict", "clearance left for the worst pair [mm]")
    note = f"Certified for all parts: diameter {2 * bearing.radius_mm:g} mm, condition {bearing.condition}."
    try:
        found = assess_fits(box, bearing.condition, diameter=Fraction(repr(2 * bearing.radius_mm)))
    except GeometryError as error:
        return Table("Standard fits (ISO 286)", columns, (), f"Not judged: {error}")
    rows = tuple((f.fit.name, str(f.fit.clearance), f.words, shortened(f.clearance_left, -1, 4)) for f in found)
    return Table("Standard fits (ISO 286)", columns, rows, note)


def _bounds(low: float, high: float) -> str:
    from graphsynth.intervals.reading import decimal_outward

    return f"[{decimal_outward(low, -1, 10)}, {decimal_outward(high, 1, 10)}]"


def _spans(spans: tuple[Span, ...]) -> str:
    """Spans in degrees, rounded into their inside."""
    if any(span.length >= math.tau for span in spans):
        return "the whole turn"
    ends = [span.degrees() for span in spans]
    texts = [f"{math.ceil(a * 1e8 + 1.0) / 1e8:.8f}° to {math.floor(b * 1e8 - 1.0) / 1e8:.8f}°" for a, b in ends]
    return ", ".join(texts) or "nowhere"


def _total(spans: tuple[Span, ...]) -> str:
    total = sum(span.length for span in spans)
    return f"{math.degrees(total):.2g}° in {len(spans)} pieces" if spans else "nowhere"


def _works(limit: CertifiedLimit) -> str:
    if limit.works is None or limit.fails is None:
        return limit.reason
    return f"{limit.works!r}, {limit.fails!r} {limit.unit}"


def _jam_table(
    context: Context, reports: dict[_C, JammingReport], limits: dict[_C, dict[str, CertifiedLimit]]
) -> Table:
    """Lay the two contact conditions side by side."""
    margins = {c: {q.name: q.text for q in _margins(r, limits[c], _nominal(context, c))} for c, r in reports.items()}
    names = dict.fromkeys(name for values in margins.values() for name in values)
    rows = [("verdict", *(r.verdict.value for r in reports.values()))]
    arcs = max(len(r.arcs.arcs) for r in reports.values())
    rows += [(f"jam arc {i + 1}", *(_arc_text(r, i) for r in reports.values())) for i in range(arcs)]
    rows += [(name, *(values.get(name, "no limit") for values in margins.values())) for name in names]
    columns = ("", *(f"condition {c} ({_CONDITIONS[c]})" for c in reports))
    note = "Verdict certified; arcs and numbers are the nominal ones, their proved bounds stand in the next table."
    return Table("Jamming of the bearing at B", columns, tuple(rows), note)


_CONDITIONS: dict[_C, str] = {"A": "short bearing in a long hole", "B": "long shaft in a short hole"}


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


def _stroke(linkage: TiltedFourBar) -> str:
    """Say how long and how straight the working stroke is, or why there is none."""
    from graphsynth.core.errors import GeometryError

    try:
        stroke = linkage.straightness()
    except GeometryError as error:
        return f"none: {error}"
    return f"{stroke.chord:.8g} long, {stroke.deviation:.6g} wide"
