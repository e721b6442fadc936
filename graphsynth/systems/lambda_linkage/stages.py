"""The lambda linkage of a scene: recognise four-bars, move them, assess the tilted bearing with its tolerances."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import astuple, dataclass, replace
from fractions import Fraction
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, Literal

from graphsynth.pipeline.products import Attempt, Candidate, Finding, Quantity, Recognised, Record, Table, each
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.steps import recognise_by_key, records_of
from graphsynth.systems.lambda_linkage.space import beside_small_tilts
from graphsynth.systems.lambda_linkage.system import LambdaTable

if TYPE_CHECKING:
    from graphsynth.core.errors import SceneError
    from graphsynth.jamming.assess import JammingReport
    from graphsynth.jamming.bearing.arcs import Span
    from graphsynth.jamming.bearing.certify import JamCertificate
    from graphsynth.jamming.bearing.limits import CertifiedLimit
    from graphsynth.jamming.bearing.parameters import ToleranceBox
    from graphsynth.mechanism.four_bar import FourBarPositions, TiltedFourBar

_C = Literal["A", "B"]


@dataclass(frozen=True, slots=True)
class LambdaMotion:
    """One rotation of the crank: motion without and with the tilt of the motor axis, at crank angles from 0 to 2 pi.

    `residual`: largest relative error of the rod length in `tilted`, recomputed from the positions (estimated).
    """

    linkage: TiltedFourBar
    planar: FourBarPositions
    tilted: FourBarPositions
    residual: float


def recognise(context: Context, candidates: tuple[Candidate, ...]) -> tuple[Recognised, ...]:
    """Mark the candidates whose canonical key is that of the four-bar with its frame."""
    from graphsynth.systems.lambda_linkage.model import LambdaLinkage

    return recognise_by_key(candidates, LambdaLinkage().graph(), "lambda_linkage")


def kinematics(context: Context, recognised: tuple[Recognised, ...]) -> tuple[Attempt, ...]:
    """Move every recognised candidate through one rotation with the dimensions of the scene."""
    return each((Attempt(r.candidate, r) for r in recognised if r.module), lambda _: _move(context))


def linkage_of(context: Context) -> TiltedFourBar:
    """Build the linkage of the scene."""
    from graphsynth.systems.lambda_linkage.model import LambdaLinkage

    table: LambdaTable = context.scene.mechanism
    frame, crank, coupler, rocker = astuple(table.lengths)
    tilt = table.tilt
    return LambdaLinkage(frame, crank, coupler, rocker, sgn=table.branch, alpha=tilt.alpha, axis=tilt.axis)


def _move(context: Context) -> LambdaMotion:
    import numpy as np

    from graphsynth.core.errors import GeometryError

    table, linkage = context.scene.mechanism, linkage_of(context)
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

    table: LambdaTable = context.scene.mechanism
    box = tolerance_box(context)
    bearing = Bearing(table.bearing.radius_mm, table.bearing.height_mm, table.bearing.clearance_mm)

    def both(motion: LambdaMotion) -> dict[_C, JammingReport]:
        return {c: assess_bearing(motion.linkage, bearing, c, motion.tilted.f, box, True) for c in _CONDITIONS}

    return each(motions, both)


def assess(
    context: Context, recognised: tuple[Recognised, ...], motions: tuple[Attempt, ...], assessments: tuple[Attempt, ...]
) -> tuple[tuple[Record, ...], tuple[Table, ...]]:
    """Give one record per candidate and the tables of the first one assessed."""
    condition = context.scene.mechanism.bearing.condition
    limits: dict[_C, dict[str, CertifiedLimit]] = {}

    def verdict(reports: dict[_C, JammingReport]) -> tuple[str, bool, tuple[Quantity, ...]]:
        report = reports[condition]
        limits.update({c: _limits(context, c) for c in _CONDITIONS})
        margins = _margins(report, limits[condition], _nominal(context, condition))
        return f"{report.verdict.value}; contact condition {condition}", report.verdict.is_free, margins

    records = records_of(recognised, assessments, verdict)
    done = next((a for a in assessments if not a.failed), None)
    if done is None:
        return records, ()
    motion = next(m.value for m in motions if m.candidate.number == done.candidate.number)
    proved = _proof_table(context, done.value, limits)
    findings = _findings(done.value[condition], limits[condition])
    space, said = beside_small_tilts(context.scene.mechanism, motion.linkage)
    jam = replace(_binding_table(context, done.value, limits), findings=(*findings, *said))
    return records, (_motion_table(motion), jam, proved, space, _fit_table(context))


def _findings(report: JammingReport, limits: Mapping[str, CertifiedLimit]) -> tuple[Finding, ...]:
    """Say where the nominal bearing binds, and which clearance is proved to be enough and which tilt harmless.

    The proved numbers are rounded to the safe side.
    """
    from graphsynth.intervals.reading import shortened

    found = []
    arcs = report.arcs.arcs
    if arcs and sum(arc.length for arc in arcs) < math.tau:
        angles = " and ".join(f"{math.degrees(arc.start):.2f}° to {math.degrees(arc.stop):.2f}°" for arc in arcs)
        found.append(Finding(f"With the nominal dimensions it binds at crank angles {angles} (estimated)."))
    clearance, tilt = limits["smallest clearance"], limits["largest axis tilt"]
    words = []
    if clearance.works is not None:
        words.append(f"a clearance of {shortened(clearance.works, 1, 4)} {clearance.unit} is enough")
    if tilt.works is not None:
        words.append(f"a tilt of the axis of {shortened(tilt.works, -1, 4)} {tilt.unit} is harmless")
    sentence = "; with the clearance given, ".join(words)
    if words:
        found.append(Finding(f"{sentence[:1].upper()}{sentence[1:]} (certified, without tolerances)."))
    return tuple(found)


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
    """Margins of the nominal dimensions, with a bound of the error where two ends are proved; else estimated."""
    part = sum(arc.length for arc in report.arcs.arcs) / math.tau
    values: list[tuple[str, float | None, str, tuple[float | None, float | None]]] = [
        ("clearance left at the worst crank angle", -report.worst_interference, "mm", proved.clearance_left),
        ("largest tilt", report.largest_tilt, "rad", proved.largest_tilt),
        ("critical tilt", report.critical_tilt, "rad", proved.critical_tilt),
        ("share of the rotation that binds", part, "", (None, None)),
    ]
    for name, limit, unit in (
        ("smallest clearance", report.smallest_clearance, "mm"),
        ("largest axis tilt", report.largest_misalignment, "rad"),
    ):
        values.append((name, limit.value if limit else None, unit, (limits[name].works, limits[name].fails)))
    found = []
    for name, value, unit, (a, b) in values:
        if value is None:
            continue
        if a is None or b is None or not (math.isfinite(a) and math.isfinite(b)):
            found.append(Quantity(name, value, unit))
            continue
        error = max(abs(Fraction(value) - Fraction(a)), abs(Fraction(value) - Fraction(b)))
        bound = math.nextafter(float(error), math.inf) if error else 0.0
        found.append(Quantity(name, value, unit, "certified", bound))
    return tuple(found)


def _proof_table(
    context: Context, reports: dict[_C, JammingReport], limits: dict[_C, dict[str, CertifiedLimit]]
) -> Table:
    """State what is proved for the tolerance box, condition by condition."""
    found = {c: r.certificate for c, r in reports.items() if r.certificate}
    rows: list[tuple[str, ...]] = [("statement", *(f.statement for f in found.values()))]
    if not tolerance_box(context).is_point:
        rows.append(("without tolerances", *(_nominal(context, c).statement for c in found)))
    rows += [(title, *(text(f) for f in found.values())) for title, text in _PROVED.items()]
    for name in ("smallest clearance", "largest axis tilt"):
        ends = [limits[c][name] for c in found]
        texts = (
            end.reason if end.works is None or end.fails is None else f"{end.works!r}, {end.fails!r} {end.unit}"
            for end in ends
        )
        rows.append((f"{name}: works, fails", *texts))
    box = tolerance_box(context)
    units = {"l2": "", "l3": "", "alpha": " rad", "azimuth": " rad"}  # the rest are lengths of the bearing
    given = ((name, text) for name, text in box.describe().items() if not box[name].is_point)
    ranges = ", ".join(f"{name} {text}{units.get(name, ' mm')}" for name, text in given)
    inputs = "all inputs are exact" if box.exact_input else "some inputs are rounded numbers"
    note = f"Certified with outward rounding; {inputs}. "
    note += f"Ranges: {ranges}." if ranges else "No tolerances are given."
    return Table("What is proved about the bearing", ("", *(f"condition {c}" for c in found)), tuple(rows), note)


def _fit_table(context: Context) -> Table:
    """Assess standard fits for the tilt and the dimensions of the scene."""
    from graphsynth.core.errors import GeometryError
    from graphsynth.intervals.reading import shortened
    from graphsynth.jamming.bearing.fits import assess_fits

    box, bearing = tolerance_box(context), context.scene.mechanism.bearing
    columns = ("fit", "radial clearance [mm]", "verdict", "clearance left for the worst pair [mm]")
    note = f"Certified for all parts: diameter {2 * bearing.radius_mm:g} mm, condition {bearing.condition}."
    try:
        found = assess_fits(box, bearing.condition, diameter=Fraction(repr(2 * bearing.radius_mm)))
    except GeometryError as error:
        return Table("Standard fits (ISO 286)", columns, (), f"Not assessed: {error}")
    rows = tuple((f.fit.name, str(f.fit.clearance), f.words, shortened(f.clearance_left, -1, 4)) for f in found)
    return Table("Standard fits (ISO 286)", columns, rows, note)


def _bounds(low: float, high: float) -> str:
    from graphsynth.intervals.reading import decimal_outward

    return f"[{decimal_outward(low, -1, 10)}, {decimal_outward(high, 1, 10)}]"


def _spans(spans: tuple[Span, ...]) -> str:
    """Spans in degrees, rounded into their inside."""
    if any(span.length >= math.tau for span in spans):
        return "a full rotation"
    ends = [span.degrees() for span in spans]
    texts = [f"{math.ceil(a * 1e8 + 1.0) / 1e8:.8f}° to {math.floor(b * 1e8 - 1.0) / 1e8:.8f}°" for a, b in ends]
    return ", ".join(texts) or "nowhere"


#: What a certificate proves: row of the table, and its text.
_PROVED: dict[str, Callable[[JamCertificate], str]] = {
    "largest interference, mm": lambda f: _bounds(f.largest_interference.lo, f.largest_interference.hi),
    "binds for certain": lambda f: _spans(f.arcs.inner),
    "free for certain": lambda f: _spans(f.arcs.free),
    "neither is proved": lambda f: (
        f"{math.degrees(sum(span.length for span in f.arcs.undecided)):.3g}°, pieces: {len(f.arcs.undecided)}"
        if f.arcs.undecided
        else "nowhere"
    ),
    "assembled": lambda f: f.assembles,
}


def _binding_table(
    context: Context, reports: dict[_C, JammingReport], limits: dict[_C, dict[str, CertifiedLimit]]
) -> Table:
    """Lay the two contact conditions side by side."""
    margins = {c: {q.name: q.text for q in _margins(r, limits[c], _nominal(context, c))} for c, r in reports.items()}
    names = dict.fromkeys(name for values in margins.values() for name in values)
    rows = [("verdict", *(r.verdict.value for r in reports.values()))]
    spans = [
        [f"{math.degrees(a.start):.8f}° to {math.degrees(a.stop):.8f}°" for a in r.arcs.arcs] for r in reports.values()
    ]
    rows += [(f"interval of binding {i + 1}", *texts) for i, texts in enumerate(zip_longest(*spans, fillvalue="none"))]
    rows += [(name, *(values.get(name, "no limit") for values in margins.values())) for name in names]
    columns = ("", *(f"condition {c} ({_CONDITIONS[c]})" for c in reports))
    note = "Verdict certified; intervals and numbers are the nominal ones, their proved bounds are in the next table."
    return Table("Binding of the bearing at B", columns, tuple(rows), note)


_CONDITIONS: dict[_C, str] = {"A": "short bearing in a long hole", "B": "long shaft in a short hole"}


def _motion_table(motion: LambdaMotion) -> Table:
    """State what the motion is, with and without the tilt, and how long and straight the working stroke is."""
    import numpy as np

    from graphsynth.core.errors import GeometryError

    turn = motion.linkage.full_turn()
    away = float(np.nanmax(np.abs(motion.tilted.M[..., 2])))
    shift = float(np.nanmax(np.hypot(*(motion.tilted.M - motion.planar.M)[..., :2].T)))
    try:
        straight = motion.linkage.straightness()
        stroke = f"{straight.chord:.8g} long, {straight.deviation:.6g} wide"
    except GeometryError as error:
        stroke = f"none: {error}"
    rows = (
        ("full rotation", turn.statement, turn.method),
        ("crank positions computed", str(len(motion.tilted.f)), "exact"),
        ("straight stroke of M, crank 90° to 270°", stroke, "estimated"),
        ("M leaves the plane by at most", f"{away:.8g}", "estimated, largest sample"),
        ("the tilt moves M in the plane by at most", f"{shift:.6g}", "estimated, largest sample"),
        ("relative error of the rod length", f"{motion.residual:.1e}", "estimated, largest sample"),
    )
    return Table("Motion", ("quantity", "value", "method"), rows, "Lengths in the unit of the link lengths.")


#: Key of ``[mechanism.tolerances]``: parameter of the box, and where its nominal value stands in the scene.
_TOLERANCES: dict[str, tuple[str, tuple[str, str] | None]] = {
    "frame": ("l1", ("lengths", "frame")),
    "crank": ("l2", ("lengths", "crank")),
    "coupler": ("l3", ("lengths", "coupler")),
    "rocker": ("l4", ("lengths", "rocker")),
    "alpha_rad": ("alpha", ("tilt", "alpha_rad")),
    "azimuth_rad": ("azimuth", None),
    "radius_mm": ("Rb", ("bearing", "radius_mm")),
    "height_mm": ("Hb", ("bearing", "height_mm")),
    "clearance_mm": ("clearance", ("bearing", "clearance_mm")),
}


def tolerance_box(context: Context, tolerances: bool = True) -> ToleranceBox:
    """Return the exact dimensions of the scene, with the tolerances of ``[mechanism.tolerances]`` if there are any.

    Numbers of the file are taken as the decimals that stand there, not as the doubles nearest to them; a dimension that
    was changed after reading is taken as the double it is.

    Raises `SceneError` for a tolerance with an unknown name, one that is no number, or one so large that a dimension
    may vanish.
    """
    from graphsynth.core.errors import GeometryError
    from graphsynth.jamming.bearing.parameters import Range, ToleranceBox, spread
    from graphsynth.pipeline.tables import exact_number, suggest, written
    from graphsynth.pipeline.units import Unit

    table: LambdaTable = context.scene.mechanism
    raw = context.scene.raw.get("mechanism", {})
    raw = raw if isinstance(raw, Mapping) else {}
    given: dict[str, Any] = {"azimuth": 0}
    for name, place in _TOLERANCES.values():
        if place:
            part = getattr(table, place[0])
            given[name] = _exact(written(raw.get(place[0], {}), place[1]), getattr(part, place[1].removesuffix("_rad")))
    tilt = raw.get("tilt", {})
    numbers = (tilt.get("axis") if isinstance(tilt, Mapping) else None) or [None] * 3
    axis = [_exact(exact_number(number, Unit.parse("")), value) for number, value in zip(numbers, table.tilt.axis)]
    for key, size in table.tolerances.items() if tolerances else ():
        if key not in _TOLERANCES:
            here = context.scene.place / "mechanism" / "tolerances"
            raise here.error(f"has an unknown key {key!r}{suggest(key, _TOLERANCES)}", key)
        name = _TOLERANCES[key][0]
        absolute, relative = _tolerance(context, key, size)
        given[name] = spread(Range.read(key, given[name]), absolute, relative)
    try:
        return ToleranceBox(**given, axis=axis, sgn=table.branch)
    except GeometryError as error:
        raise _refused(context, str(error)) from None


def _refused(context: Context, sentence: str) -> SceneError:
    """Return a sentence about a parameter of the box with the place and the key of its tolerance in the scene."""
    place, tolerances = context.scene.place / "mechanism", context.scene.mechanism.tolerances
    for key, (name, _) in _TOLERANCES.items():
        if sentence.startswith(f"{name} = ") and key in tolerances:
            size = tolerances[key]
            return (place / "tolerances").error(f"has {key} = {size!r}, so that {sentence}", key)
    return place.error(f"gives what no bearing has: {sentence}")


def _exact(number: Fraction | None, value: float) -> Any:
    """Return the number that stands in the file, if it is the one that was read; else the double."""
    return number if number is not None and float(number) == value else value


def _tolerance(context: Context, key: str, size: Any) -> tuple[Fraction, Fraction]:
    """Read an absolute tolerance, or a relative one such as ``"1 %"``."""
    from graphsynth.pipeline.tables import ANY_LENGTH
    from graphsynth.pipeline.units import Unit, convert, split_suffix, split_value

    expected = Unit.parse(split_suffix(key)[1]) if split_suffix(key)[1] else ANY_LENGTH
    try:
        number, text = split_value(size if isinstance(size, str) else repr(size))
        unit = Unit.parse(text)
        if text and text != "%":
            number, exact = convert(number, unit, expected) if unit.agrees(expected) else (Fraction(-1), True)
            number *= 1 if exact else 1 + Fraction(1, 10**40)  # outward: more than the error of pi
    except ValueError:
        number, text = Fraction(-1), ""
    if number < 0 or isinstance(size, bool):
        raise (context.scene.place / "mechanism" / "tolerances").error(
            f'has {key} = {size!r}; give a tolerance of zero or more, as in 0.005 or "0.005 {expected.text}", '
            'or relative, as in "1 %"',
            key,
        )
    return (Fraction(0), number / 100) if text == "%" else (number, Fraction(0))
