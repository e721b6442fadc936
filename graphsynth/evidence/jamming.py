"""Jam arcs: rows of the room of jamming, against the contact condition of theory/bearing-contact in 50 digits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from inspect import signature
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import GeometryError
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus

if TYPE_CHECKING:
    from graphsynth.jamming.bearing.bearing import Bearing, Condition
    from graphsynth.jamming.bearing.parameters import ToleranceBox

__all__ = ["arc_problem", "precise_arc_ends", "precise_critical_tilt"]

_DIGITS = 50
_PROVED = {"closed form, enclosed", "interval sweep"}


def _rows(found: Sequence[Any], effort: Effort, kinds: dict[str, str], references: dict[str, str]) -> list[Row]:
    """Turn rows (method, setting, error, seconds) of other rooms into ours."""
    return [
        Row(
            r.method, r.setting, float(r.error), r.seconds, effort.rounds,
            kinds.get(r.method, kinds[""]), references.get(r.method, references[""]),
            proved=r.method in _PROVED,
        )
        for r in found
    ]  # fmt: skip


def precise_arc_ends(box: ToleranceBox, condition: Condition = "A") -> tuple[float, ...]:
    """Crank angles in [0, 2 pi) at which the bearing begins and ceases to jam, from the plain formulas with 50 digits.

    The contact condition as it stands in theory/bearing-contact 2 and 3, solved by bisection; the height of
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


def precise_critical_tilt(bearing: Bearing, condition: Condition = "A") -> Any:
    """Least tilt at which a bearing jams, radians, with 50 digits; None if it never does.

    Examples
    --------
    >>> from graphsynth.jamming import Bearing
    >>> print(f"{float(precise_critical_tilt(Bearing())):.16f}")
    0.0060643965591564
    """
    import mpmath

    with mpmath.workdps(_DIGITS):
        given = {"Rb": bearing.Rb, "Hb": 2 * bearing.h, "clearance": bearing.clearance}
        sine = _critical_sine({name: mpmath.mpf(repr(value)) for name, value in given.items()}, condition)
        return None if sine is None else mpmath.asin(sine)


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
    from graphsynth.evidence.bearing import arc_errors
    from graphsynth.jamming.bearing.certify import certify_jamming
    from graphsynth.jamming.bearing.sweep import sweep_linkage

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
    rows = [replace(row, default=row.setting == f"{default:g} rad") for row in rows]
    spans = {"closed form, enclosed": [certify_jamming(box, condition).arcs.undecided]}
    spans["interval sweep"] = [sweep_linkage(box, condition, resolution=r).undecided for r in resolutions]
    rows = _checked(rows, spans, ends)
    counts = {row.setting: int(row.setting.split()[0]) for row in rows if row.method == "samples, doubles"}
    rows = [
        row if row.setting not in counts or _steps_found(row, counts[row.setting], ends)
        else replace(row, status=RowStatus.UNRELIABLE, reason="an arc lies between two samples and is not seen")
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
                row = replace(row, status=RowStatus.FAILED, reason="an end lies outside the angles left undecided")
        checked.append(row)
    return checked


def _held(spans: Sequence[Any], end: float) -> bool:
    slack = 4.0 * math.ulp(end)  # the reference is rounded once
    return any(low - slack <= end + turn <= high + slack for low, high in spans for turn in (-math.tau, 0.0, math.tau))
