"""Bearings that jam: ends of the jam arcs, and the largest misalignment that several bearings share.

The references are the contact condition in 50 digits, a closed form, or proved bounds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from inspect import signature
from typing import Any

import mpmath
import numpy as np

from graphsynth.core.errors import GeometryError
from graphsynth.evidence.position import four_bar
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of
from graphsynth.jamming.bearing.arcs import total_length
from graphsynth.jamming.bearing.bearing import Bearing, Condition
from graphsynth.jamming.bearing.certify import certify_jamming
from graphsynth.jamming.bearing.parameters import ToleranceBox
from graphsynth.jamming.bearing.sweep import sweep_linkage
from graphsynth.jamming.joints.assess import CoupledReport, assess_coupled
from graphsynth.jamming.joints.limits import Misalignment
from graphsynth.jamming.joints.scale import ScaleCertificate, largest_scale
from graphsynth.kinematics.engine.result import Motion
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.mechanism.model import Mechanism

_DIGITS = 50
#: Gap of the proved bounds that are the reference where no closed form is known.
_FINE_GAP = 1e-6


def precise_arc_ends(box: ToleranceBox, condition: Condition = "A") -> tuple[float, ...]:
    """Crank angles in [0, 2 pi) at which the bearing begins and ceases to jam, from the plain formulas with 50 digits.

    The contact condition as it stands in theory/bearing-contact 2 and 3, solved by bisection; the height of
    the crank pin from the rotation of the motor axis (Rodrigues).
    Rounded once; empty if it never jams.  For a box without tolerances and a rigid rod.

    Examples
    --------
    >>> from graphsynth.jamming import ToleranceBox
    >>> [round(math.degrees(f), 10) for f in precise_arc_ends(ToleranceBox(alpha="1/30"))]
    [27.0592203252, 152.9407796748, 207.0592203252, 332.9407796748]
    """
    if not box.is_point or box.rod != "rigid" or condition not in ("A", "B"):
        raise GeometryError("arc ends are known for single dimensions, a rigid rod and conditions A and B")
    with mpmath.workdps(_DIGITS):
        v = {name: mpmath.mpf(r.lower.numerator) / r.lower.denominator for name, r in box.ranges.items()}
        critical = _critical_sine(v, condition)
        if critical is None:
            return ()
        length = mpmath.sqrt(v["n1"] ** 2 + v["n2"] ** 2 + v["n3"] ** 2)
        c, s = mpmath.cos(v["azimuth"]), mpmath.sin(v["azimuth"])
        n1, n2, n3 = ((v["n1"] * c - v["n2"] * s) / length, (v["n1"] * s + v["n2"] * c) / length, v["n3"] / length)
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
    with mpmath.workdps(_DIGITS):
        given = {"Rb": bearing.Rb, "Hb": 2 * bearing.h, "clearance": bearing.clearance}
        sine = _critical_sine({name: mpmath.mpf(repr(value)) for name, value in given.items()}, condition)
        return None if sine is None else mpmath.asin(sine)


def _critical_sine(v: dict[str, Any], condition: str) -> Any:
    """Sine of the least tilt at which the parts touch; None if they never do (by bisection in 50 digits)."""
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

    Returns
    -------
    Problem
        Error and time of every method.

    Raises
    ------
    GeometryError
        A box with tolerances, which have no arc ends; or a bearing that never jams.
    """
    effort = effort or Effort()
    ends = precise_arc_ends(box, condition)
    if not ends:
        raise GeometryError("the bearing jams nowhere during the turn, so there are no arc ends to compare")
    found, *timed = best_of(lambda: certify_jamming(box, condition), effort)
    rows = [_proved_row("closed form, enclosed", "", found.arcs.undecided, ends, timed)]
    default = signature(sweep_linkage).parameters["resolution"].default
    for resolution in sorted({*effort.some((1e-1, 1e-2, 1e-4, 1e-6, 1e-9, 1e-12)), default}, reverse=True):
        swept, *timed = best_of(partial(sweep_linkage, box, condition, resolution=resolution), effort)
        row = _proved_row("interval sweep", f"{resolution:g} rad", swept.undecided, ends, timed)
        rows.append(replace(row, error=math.tau * swept.undecided_part, default=resolution == default))
    given = {"kind": "length of the steps in which the sign changes", "status": RowStatus.UNRELIABLE}
    given["reference"] = f"ends with {_DIGITS} digits lie in these steps"
    linkage, bearing = box.nominal()

    def sign_changes(count: int) -> int:
        path = linkage.positions(np.linspace(0.0, math.tau, count + 1))
        jams = bearing.interference(path.sin_theta, path.cos_theta, condition) > 0.0
        return int((jams[1:] != jams[:-1]).sum())

    for count in (100, 300, 1000) if effort.quick else (100, 1000, 10_000, 100_000):
        changes, *timed = best_of(partial(sign_changes, count), effort)
        # ends that share a step hide each other
        seen = changes == len({math.floor(end * count / math.tau) for end in ends}) == len(ends)
        why = "" if seen else "an arc lies between two samples and is not seen"
        rows.append(Row.of("samples, float64", f"{count} angles", changes * math.tau / count, timed, why, **given))
    question = f"At which crank angles the bearing begins and ceases to jam (condition {condition}, {len(ends)} ends)"
    return Problem("arc-ends", question, "rad", tuple(rows))


def _proved_row(method: str, setting: str, left: Any, ends: Sequence[float], timed: Sequence[float]) -> Row:
    """Row of a proof: the length of the angles left undecided, which must hold the ends."""

    def held(end: float) -> bool:
        slack = 4.0 * math.ulp(end)  # the reference is rounded once
        places = [end + turn for turn in (-math.tau, 0.0, math.tau)]
        return any(low - slack <= at <= high + slack for low, high in left for at in places)

    why = "" if all(map(held, ends)) else "an end lies outside the angles left undecided"
    against = f"none needed; checked to hold the ends with {_DIGITS} digits"
    more = {"kind": "length of the angles left undecided", "reference": against, "proved": True}
    return Row.of(method, setting, total_length(left), timed, why, **more)


def exact_largest(linkage: TiltedFourBar, bearing: Bearing, condition: Condition = "A") -> Any:
    """Largest misalignment about the frame line of the source's linkage with three equal bearings, with 50 digits.

    Twice the critical tilt of one bearing (theory/joints-that-share-a-tilt 6: the worst pose is 90 degrees).  None for
    other proportions than (2, 1, 5/2, 5/2), for which no closed form is known.

    Examples
    --------
    >>> from graphsynth.jamming import Bearing
    >>> from graphsynth.mechanism.four_bar import TiltedFourBar
    >>> print(f"{float(exact_largest(TiltedFourBar(), Bearing())):.16f}")
    0.0121287931183128
    """
    crank = linkage.l2
    if (linkage.l1, linkage.l3, linkage.l4) != (2.0 * crank, 2.5 * crank, 2.5 * crank):
        return None
    critical = precise_critical_tilt(bearing, condition)
    with mpmath.workdps(_DIGITS):
        return None if critical is None else 2 * critical


def lambda_problem(
    linkage: TiltedFourBar,
    bearing: Bearing,
    direction: float = 0.0,
    condition: Condition = "A",
    effort: Effort | None = None,
) -> Problem:
    """Find the largest misalignment of the driven axis of a four-bar linkage with equal bearings in its moving joints.

    The linkage is planar, and its crank turns fully; `direction` is that of the axis about which the motor axis is
    tilted, radians from the frame line.
    """
    mechanism, _ = four_bar(linkage)
    exact = exact_largest(linkage, bearing, condition) if direction == 0.0 else None
    size = ", ".join(f"{value:g}" for value in (linkage.l1, linkage.l2, linkage.l3, linkage.l4))
    tilt = Misalignment(0, 1, 0.01, direction)
    return coupled_problem(
        mechanism, bearing, tilt, f"the linkage ({size})", condition=condition, exact=exact, effort=effort
    )


def coupled_problem(
    mechanism: Mechanism,
    bearings: Any,
    tilt: Misalignment,
    name: str,
    *,
    condition: Condition = "A",
    exact: Any = None,
    inputs: tuple[float, float] = (0.0, math.tau),
    effort: Effort | None = None,
) -> Problem:
    """Find the largest misalignment of a mechanism whose bearings share it, by samples and by proof.

    Bearings as for `graphsynth.jamming.joints.assess_coupled`; `name` is that of the mechanism, for the picture;
    `exact` the largest misalignment, radians, if it is known: else the reference are proved bounds, 1e-6 apart;
    `inputs` the range of the input, radians. A `GeometryError` says that the mechanism does not move through it, or
    that no bounds can be proved.
    """
    effort = effort or Effort()
    rounds = replace(effort, rounds=1 if effort.quick else min(2, effort.rounds))

    def turn(count: int) -> Motion:
        return simulate(mechanism, np.linspace(*inputs, count), events=False)

    def assessed(count: int) -> CoupledReport:
        return assess_coupled(turn(count), bearings, tilt, condition=condition)

    motion = turn(37)
    if not motion.completed:
        raise GeometryError(f"the motion ends: {motion.reason}")
    prove = partial(largest_scale, motion, bearings, tilt, condition=condition)
    low, high, reference = _reference(prove, tilt, exact)
    middle = (low + high) / 2
    rows = []
    for count in (8, 14, 26) if effort.quick else (8, 26, 74, 362):
        report, *timed = best_of(partial(assessed, count), rounds)
        error = float(abs(report.smallest_scale / middle - 1))
        rows.append(Row.of("samples", f"{count} positions", error, timed, reference=reference))
    default = signature(largest_scale).parameters["relative_gap"].default
    gaps = sorted({1e-1, 1e-2, default} if effort.quick else {1e-1, 1e-2, 1e-3, default}, reverse=True)
    for gap in gaps:
        found, *timed = best_of(partial(prove, relative_gap=gap), rounds, warm=gap == gaps[0])
        rows.append(_gap_row(found, gap, (low, high, reference), timed, default=gap == default))
    question = f"Largest misalignment of {name} whose bearings share it"
    note = "Samples overestimate the misalignment allowed, because they miss the worst input itself."
    return Problem("coupled-joints", question, "relative", tuple(rows), note=note)


def _gap_row(
    found: ScaleCertificate, gap: float, truth: tuple[Any, Any, str], timed: Sequence[float], *, default: bool
) -> Row:
    """Row of a certificate: its gap, and whether it holds the reference and is as narrow as was asked."""
    low, high, reference = truth
    why = "" if found.low <= high and low <= found.high else "the reference lies outside of what is proved"
    why = why or (found.reason if found.relative_gap > gap else "")
    setting = f"gap {gap:g}, {found.evaluated} pieces".removesuffix(", 0 pieces")
    against = f"none needed; checked to hold the {reference}"
    more = {"kind": "gap between the proved bounds", "reference": against, "proved": True, "value": gap}
    return Row.of("certified gap", setting, found.relative_gap, timed, why, default=default, **more)


def _reference(prove: Any, tilt: Misalignment, exact: Any) -> tuple[Any, Any, str]:
    """Bounds of the largest factor on the misalignment, and where they are from."""
    if exact is not None:
        with mpmath.workdps(_DIGITS):
            scale = exact / mpmath.mpf(tilt.alpha)
        return scale, scale, "closed form with 50 digits: twice the critical tilt of one bearing"
    found = prove(relative_gap=_FINE_GAP, max_pieces=200_000)
    if not 0.0 < found.low <= found.high < math.inf:
        raise GeometryError(f"no bounds of the misalignment can be proved: {found.reason}")
    return found.low, found.high, f"proved bounds of the certificate itself, {found.relative_gap:.0e} apart"
