"""Crossings, areas, jam arcs and coupled joints: rows of the room of jamming, with references that are independent.

Exact results are checked against formulas of the specification evaluated with 50 digits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from inspect import signature
from typing import TYPE_CHECKING, Any

from graphsynth.accuracy.rows import Effort, Problem, Row, RowStatus, best_of
from graphsynth.errors import GeometryError

if TYPE_CHECKING:
    from graphsynth.jamming.bearing import Bearing, Condition
    from graphsynth.jamming.circle_ellipse import CircleEllipse
    from graphsynth.jamming.parameters import ToleranceBox

__all__ = ["arc_problem", "area_problem", "coupled_problem", "crossing_problem", "precise_arc_ends", "precise_crossing"]

_DIGITS = 50
_PROVED = {"exact hull", "Krawczyk boxes", "general solver", "closed form, enclosed", "interval shoelace sum",
           "interval sweep", "certified gap"}  # fmt: skip


def _rows(found: Sequence[Any], effort: Effort, kinds: dict[str, str], references: dict[str, str]) -> list[Row]:
    """Turn rows (method, setting, error, seconds) of other rooms into ours."""
    return [
        Row(
            r.method, r.setting, float(r.error), r.seconds, 1 if r.method == "general solver" else effort.rounds,
            kinds.get(r.method, kinds[""]), references.get(r.method, references[""]),
            proved=r.method in _PROVED,
        )
        for r in found
    ]  # fmt: skip


def crossing_problem(bearing: Bearing, sine: str, effort: Effort | None = None) -> Problem:
    """Enclose the crossing of the circle and the ellipse of a tilted bearing.

    Parameters
    ----------
    bearing : Bearing
    sine : str
        Sine of the tilt, a decimal; the curves must cross.
    effort : Effort, optional

    Raises
    ------
    GeometryError
        If the curves do not cross.

    Examples
    --------
    >>> from graphsynth.jamming import Bearing
    >>> problem = crossing_problem(Bearing(), "0.0133308643347", Effort(rounds=1, quick=True))
    >>> problem.methods, problem.rows[0].status.value
    (('exact hull', 'Krawczyk boxes'), 'ok')
    """
    from graphsynth.jamming.circle_ellipse import krawczyk_boxes, surrogate_problem
    from graphsynth.jamming.error_against_time import crossing_errors

    effort = effort or Effort()
    problem = surrogate_problem(bearing, sine)
    truth = precise_crossing(problem)
    boxes = effort.some((30, 100, 200, 300, 400, 500, 20_000))
    found = crossing_errors(problem, boxes, general=not effort.quick, repeats=effort.rounds)
    rows = _rows(
        found, effort, {"": "width of the enclosure beyond the exact hull", "exact hull": "width of the enclosure"},
        {"": "exact hull, rational arithmetic", "exact hull": f"closed form with {_DIGITS} digits"},
    )  # fmt: skip
    rows[0] = _hull_row(problem, truth, effort)
    # the default limit is never reached here: it is the row of the finished search
    limit = signature(krawczyk_boxes).parameters["max_boxes"].default
    last = max(k for k, row in enumerate(rows) if row.method == "Krawczyk boxes")
    if boxes[-1] >= limit or int(rows[last].setting.split()[0]) < boxes[-1]:
        rows[last] = _with(rows[last], default=True)
    question = f"Where circle and ellipse of the bearing cross at the tilt asin({float(sine):.6g})"
    return Problem("crossing", question, "mm", tuple(rows), note="A limit of boxes ends the search before its end.")


def _with(row: Row, **changes: Any) -> Row:
    from dataclasses import replace

    return replace(row, **changes)


def precise_crossing(problem: CircleEllipse) -> tuple[Any, Any]:
    """Crossing in the first quadrant with 50 digits, from the radii as they are (exact point data).

    Raises
    ------
    GeometryError
        If the curves do not cross.
    """
    import mpmath

    with mpmath.workdps(_DIGITS):
        R, a, b = (mpmath.mpf(r.lo.numerator) / r.lo.denominator for r in (problem.R1, problem.a, problem.b))
        if not b < R < a:
            raise GeometryError("circle and ellipse do not cross at this tilt; give one beyond the critical tilt")
        x = a * mpmath.sqrt((R * R - b * b) / (a * a - b * b))
        y = b * mpmath.sqrt((a * a - R * R) / (a * a - b * b))
        return x, y


def _hull_row(problem: CircleEllipse, truth: tuple[Any, Any], effort: Effort) -> Row:
    """Exact hull against 50 digits: its width, and whether it holds the crossing."""
    from graphsynth.jamming.circle_ellipse import exact_hull

    found, seconds, rounds = best_of(lambda: exact_hull(problem), effort)
    holds = all(float(low) <= value <= float(high) for low, high, value in zip(found.hull.lo, found.hull.hi, truth))
    width = float(found.hull.width.max())
    status, why = (RowStatus.OK, "") if holds else (RowStatus.FAILED, "the hull does not hold the crossing")
    reference = f"closed form with {_DIGITS} digits"
    return Row("exact hull", "", width, seconds, rounds, "width of the enclosure", reference, status, why, proved=True)


def area_problem(bearing: Bearing, sine: str, effort: Effort | None = None) -> Problem:
    """Compute the free gap of the surrogate ellipse; arguments and errors as for `crossing_problem`.

    Examples
    --------
    >>> from graphsynth.jamming import Bearing
    >>> len(area_problem(Bearing(), "0.0133308643347", Effort(rounds=1, quick=True)).methods)
    5
    """
    from graphsynth.jamming.error_against_time import area_errors

    effort = effort or Effort()
    found = area_errors(bearing, sine, effort.some((16, 64, 250, 1000, 4000)), repeats=effort.rounds)
    width, distance = "width of the enclosure", "distance from the reference"
    kinds = {"": distance, "closed form, enclosed": width, "interval shoelace sum": width}
    rows = _rows(found, effort, kinds, {"": f"direct formula with {_DIGITS} digits"})
    area = _area(bearing, sine)
    rows = [row if row.error < area else _useless(row, area) for row in rows]
    question = f"Area between bearing and hole of the source's figure at the tilt asin({float(sine):.6g})"
    return Problem("areas", question, "mm²", tuple(rows))


def _area(bearing: Bearing, sine: str) -> float:
    from graphsynth.jamming.areas import surrogate_areas

    return abs(float(surrogate_areas(bearing, float(sine), math.sqrt(1.0 - float(sine) ** 2)).ellipse_only))


def _useless(row: Row, area: float) -> Row:
    return _with(row, status=RowStatus.FAILED, reason=f"the enclosure is wider than the area itself, {area:.3g} mm²")


def precise_arc_ends(box: ToleranceBox, condition: Condition = "A") -> tuple[float, ...]:
    """Crank angles in [0, 2 pi) at which the bearing begins and ceases to jam, from the plain formulas with 50 digits.

    The contact condition as it stands in the specification, sections 4.2 and 4.3, solved by bisection; the height of
    the crank pin from the rotation of the motor axis (Rodrigues).

    Parameters
    ----------
    box : ToleranceBox
        Without tolerances, rigid rod.
    condition : {"A", "B"}

    Returns
    -------
    tuple of float
        Rounded once; empty if it never jams.

    Examples
    --------
    >>> from graphsynth.jamming import ToleranceBox
    >>> [round(math.degrees(f), 10) for f in precise_arc_ends(ToleranceBox(alpha="1/30"))]
    [27.0592203252, 152.9407796748, 207.0592203252, 332.9407796748]
    """
    import mpmath

    if not box.is_point or box.rod != "rigid" or condition not in ("A", "B"):
        raise GeometryError("arc ends are known for single dimensions, a rigid rod and conditions A and B")
    with mpmath.workdps(_DIGITS):
        v = {name: mpmath.mpf(r.lower.numerator) / r.lower.denominator for name, r in box.ranges.items()}
        critical = _critical_sine(v, condition)
        if critical is None:
            return ()
        length = mpmath.sqrt(v["n1"] ** 2 + v["n2"] ** 2 + v["n3"] ** 2)
        c, s = mpmath.cos(v["azimuth"]), mpmath.sin(v["azimuth"])
        n1, n2, n3 = (
            (v["n1"] * c - v["n2"] * s) / length, (v["n1"] * s + v["n2"] * c) / length, v["n3"] / length
        )  # fmt: skip
        angle = v["alpha"] if box.convention == "spec" else -v["alpha"]
        sine, versine = mpmath.sin(angle), 1 - mpmath.cos(angle)
        r31, r32 = n1 * n3 * versine - n2 * sine, n2 * n3 * versine + n1 * sine
        amplitude, phase = v["l2"] * mpmath.hypot(r31, r32), mpmath.atan2(r31, r32)
        wanted = v["l3"] * critical / amplitude if amplitude else mpmath.inf
        if wanted >= 1:
            return ()
        inner, tau = mpmath.asin(wanted), 2 * mpmath.pi
        ends = [sign * inner + turn - phase for turn in (0, mpmath.pi) for sign in (1, -1)]
        return tuple(sorted(float(mpmath.fmod(mpmath.fmod(f, tau) + tau, tau)) for f in ends))


def _critical_sine(v: dict[str, Any], condition: str) -> Any:
    """Sine of the least tilt at which the parts touch; None if they never do (by bisection in 50 digits)."""
    import mpmath

    R, h, c = v["Rb"], v["Hb"] / 2, v["clearance"]

    def gap(t: Any) -> Any:
        if condition == "A":
            return h * mpmath.sin(t) + R * mpmath.cos(t) - (R + c)
        return h * mpmath.sin(t) + R - (R + c) * mpmath.cos(t)

    low, high = mpmath.mpf(0), (mpmath.atan2(h, R) if condition == "A" else mpmath.pi / 2)
    if gap(high) <= 0:
        return None
    for _ in range(180):
        middle = (low + high) / 2
        low, high = (middle, high) if gap(middle) < 0 else (low, middle)
    return mpmath.sin(high)


def arc_problem(box: ToleranceBox, condition: Condition = "A", effort: Effort | None = None) -> Problem:
    """Find where the bearing begins and ceases to jam during a turn.

    Parameters
    ----------
    box : ToleranceBox
        Without tolerances.
    condition : {"A", "B"}
    effort : Effort, optional

    Raises
    ------
    GeometryError
        A box with tolerances, which have no arc ends; or a bearing that never jams.
    """
    from graphsynth.jamming.certify import certify_jamming
    from graphsynth.jamming.error_against_time import arc_errors
    from graphsynth.jamming.sweep import sweep_linkage

    effort = effort or Effort()
    ends = precise_arc_ends(box, condition)
    if not ends:
        raise GeometryError("the bearing jams nowhere during the turn, so there are no arc ends to compare")
    default = signature(sweep_linkage).parameters["resolution"].default
    resolutions = sorted({*effort.some((1e-1, 1e-2, 1e-4, 1e-6, 1e-9, 1e-12)), default}, reverse=True)
    samples = effort.some((100, 1000, 10_000, 100_000)) if not effort.quick else (100, 300, 1000)
    found = arc_errors(box, condition, resolutions, samples, repeats=effort.rounds)
    width = "length of the angles left undecided"
    kinds = {"": width, "samples, doubles": "length of the steps in which the sign changes"}
    proof = f"none needed; checked to hold the ends with {_DIGITS} digits"
    rows = _rows(
        found, effort, kinds, {"": proof, "samples, doubles": f"ends with {_DIGITS} digits lie in these steps"}
    )
    rows = [_with(row, default=row.setting == f"{default:g} rad") for row in rows]
    spans = {"closed form, enclosed": [certify_jamming(box, condition).arcs.undecided]}
    spans["interval sweep"] = [sweep_linkage(box, condition, resolution=r).undecided for r in resolutions]
    rows = _checked(rows, spans, ends)
    counts = {row.setting: int(row.setting.split()[0]) for row in rows if row.method == "samples, doubles"}
    rows = [
        row if row.setting not in counts or _steps_found(row, counts[row.setting], ends)
        else _with(row, status=RowStatus.UNRELIABLE, reason="an arc lies between two samples and is not seen")
        for row in rows
    ]  # fmt: skip
    question = f"At which crank angles the bearing begins and ceases to jam (condition {condition}, {len(ends)} ends)"
    return Problem("arc-ends", question, "rad", tuple(rows))


def _steps_found(row: Row, count: int, ends: tuple[float, ...]) -> bool:
    """Whether samples saw a change of sign in the step of every end (ends that share a step hide each other)."""
    steps = {math.floor(end * count / math.tau) for end in ends}
    return round(row.error * count / math.tau) == len(steps) == len(ends)


def _checked(rows: list[Row], spans: dict[str, list[Any]], ends: tuple[float, ...]) -> list[Row]:
    """Mark a proof whose undecided angles do not hold the ends as failed."""
    left = {method: list(found) for method, found in spans.items()}
    checked = []
    for row in rows:
        if row.method in left:
            open_ = left[row.method].pop(0)
            if not all(_held(open_, end) for end in ends):
                row = _with(row, status=RowStatus.FAILED, reason="an end lies outside the angles left undecided")
        checked.append(row)
    return checked


def _held(spans: Sequence[Any], end: float) -> bool:
    slack = 4.0 * math.ulp(end)  # the reference is rounded once
    return any(low - slack <= end + turn <= high + slack for low, high in spans for turn in (-math.tau, 0.0, math.tau))


def coupled_problem(effort: Effort | None = None) -> Problem:
    """Find the largest misalignment of the source's linkage with three equal bearings that share the tilt."""
    from graphsynth.jamming.coupled.error_and_time import error_against_time
    from graphsynth.jamming.coupled.scale import largest_scale

    effort = effort or Effort()
    default = signature(largest_scale).parameters["relative_gap"].default
    gaps = (1e-1, 1e-2, default) if effort.quick else tuple(sorted({1e-1, 1e-2, 1e-4, default}, reverse=True))
    samples = (8, 14, 26) if effort.quick else (8, 26, 74, 362)
    rounds = 1 if effort.quick else min(2, effort.rounds)
    found = error_against_time(samples, gaps, rounds)
    exact = "exact: twice the critical tilt of one bearing"
    rows = [
        Row(
            r.method, r.setting, r.error, r.seconds, rounds,
            "gap between the proved bounds" if r.method == "certified gap" else "distance from the reference",
            exact, default=r.setting.startswith(f"gap {default:g},"), proved=r.method == "certified gap",
        )
        for r in found
    ]  # fmt: skip
    question = "Largest misalignment of the source's linkage (2, 1, 2.5, 2.5) whose three bearings share it"
    note = "Samples err on the wrong side: they never find the worst input itself."
    return Problem("coupled-joints", question, "relative", tuple(rows), note=note)
