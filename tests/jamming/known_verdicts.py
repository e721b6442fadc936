"""Linkages with bearings whose verdict is known from closed forms to 60 digits, near and far from touching."""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import mpmath
import numpy as np

from graphsynth.jamming import (
    ToleranceBox,
    Verdict,
    certified_largest_height,
    certified_largest_misalignment,
    certified_smallest_clearance,
    certify_jamming,
    sweep_linkage,
)

F = Fraction
DIGITS = 60


class Case(NamedTuple):
    """A point of parameters, the reading, and whether a jam exists on a turn that is assembled throughout."""

    box: ToleranceBox
    condition: str
    jams: bool
    margin: float


def real(x) -> mpmath.mpf:
    return mpmath.mpf(x.numerator) / x.denominator


def rational(x, digits=60) -> Fraction:
    """A decimal near a multi-precision number."""
    return F(mpmath.nstr(x, digits, strip_zeros=False))


def touching_sine(condition, R, h, c, hole):
    """Sine of the tilt at which the bearing touches (theory/bearing-contact 7), or None."""
    found = []
    for reading, half in (("A", h), ("B", hole if condition == "general" else h)):
        if condition not in (reading, "general"):
            continue
        room = half**2 + (-1 if reading == "A" else 1) * c * (2 * R + c)
        if room <= 0:
            return None
        q = c / (half + mpmath.sqrt(room))
        found.append(2 * q / (1 + q * q))
    return max(found)


def tilt_for(sine, n):
    """Tilt alpha of an axis n at which the crank pin rises by ``sine`` per unit of the crank, or None."""
    if sine >= 1:
        return None
    flat = mpmath.mpf(n[0] ** 2 + n[1] ** 2) / sum(v * v for v in n)
    deficit = sine**2 / (1 + mpmath.sqrt((1 - sine) * (1 + sine))) / flat
    return mpmath.acos(1 - deficit) if deficit < 1 else None


def log_uniform(rng, low, high, digits=4):
    return F(f"{10 ** rng.uniform(low, high):.{digits}g}")


def random_case(rng, kind="moderate", margins=(-9.0, -0.5)) -> Case | None:
    """A random case at a chosen relative distance of the tilt from touching; None if there is no touching tilt.

    ``kind``: "moderate" (dimensions as on drawings), "extreme" (ratios over ten decades, units over a hundred,
    tilts up to a right angle), "change point" (the linkage folds flat).
    """
    extreme = kind == "extreme"
    condition = ("A", "B", "general")[int(rng.integers(3))]
    unit, mm = (F(10) ** int(rng.integers(-50, 51)) for _ in range(2)) if extreme else (F(1), F(1))
    wide = 5.0 if extreme else 0.5
    l2 = log_uniform(rng, -0.3, 0.3) * unit
    l3 = l2 * log_uniform(rng, 0.2, 0.2 + wide)
    R = log_uniform(rng, 0.7, 1.5) * mm
    H = R * log_uniform(rng, -wide, 0.3)
    c = min(H, R) * log_uniform(rng, -(9.0 if extreme else 4.0), -1.0)
    hole = H * log_uniform(rng, -0.5, 0.2)
    n = [int(v) for v in rng.integers(-5, 6, 3)]
    n[0] = n[0] or 1
    frame, rocker = (8 * l2 + 4 * l3, 8 * l2 + 4 * l3)
    if kind == "change point":  # l2 + l1 = l3 + l4 or l1 + l3 = l2 + l4: flat at f = 180 degrees or at f = 0
        rocker = l3 + l2 * log_uniform(rng, 0.4, 1.0)
        frame = (l3 + rocker - l2) if rng.integers(2) else (l2 + rocker - l3)
    with mpmath.workdps(DIGITS):
        sine = touching_sine(condition, real(R), real(H / 2), real(c), real(hole / 2))
        edge = None if sine is None else tilt_for(sine * real(l3 / l2), n)
        if edge is None:
            return None
        margin = mpmath.mpf(10) ** rng.uniform(*margins) * int(rng.choice([-1, 1]))
        alpha = rational(edge * (1 + margin), DIGITS - 5)
        if abs(alpha) >= F("1.57"):
            return None
    box = ToleranceBox(
        frame, l2, l3, rocker, alpha * int(rng.choice([-1, 1])), n, azimuth=F(int(rng.integers(-300, 301)), 100),
        Rb=R, Hb=H, clearance=c, hole_length=hole,
        sgn=int(rng.choice([-1, 1])), convention=str(rng.choice(["spec", "deck"])),
    )  # fmt: skip
    return Case(box, condition, bool(margin > 0), float(margin))


def gap_at(point, f, condition):
    """Gap function and both factors of the assembly condition, from the rotation matrix itself, in 60 digits.

    ``point``: parameters by name as rationals; returns (gap, least factor of 2.3), the factor negative where the
    linkage is not assembled.
    """
    p = {name: real(value) for name, value in point.items()}
    c0, s0 = mpmath.cos(p["azimuth"]), mpmath.sin(p["azimuth"])
    n = [p["n1"] * c0 - p["n2"] * s0, p["n1"] * s0 + p["n2"] * c0, p["n3"]]
    length = mpmath.sqrt(sum(v * v for v in n))
    n = [v / length for v in n]
    s, k = mpmath.sin(p["alpha"]), 1 - mpmath.cos(p["alpha"])
    cf, sf = mpmath.cos(f), mpmath.sin(f)
    x = p["l2"] * ((1 - k + n[0] ** 2 * k) * cf + (n[0] * n[1] * k - n[2] * s) * sf)
    y = p["l2"] * ((n[0] * n[1] * k + n[2] * s) * cf + (1 - k + n[1] ** 2 * k) * sf)
    z = p["l2"] * ((n[0] * n[2] * k - n[1] * s) * cf + (n[1] * n[2] * k + n[0] * s) * sf)
    if abs(z) > p["l3"]:
        return mpmath.nan, p["l3"] - abs(z)
    plan, D = mpmath.sqrt(p["l3"] ** 2 - z**2), mpmath.hypot(x - p["l1"], y)
    assembled = min(D - abs(p["l4"] - plan), p["l4"] + plan - D)
    S = abs(z) / p["l3"]
    return gap_of(p, S, condition), assembled


def gap_of(p, S, condition):
    """Gap function from distances of points (theory/bearing-contact 2 to 4)."""
    C, R, h, Rh = mpmath.sqrt((1 - S) * (1 + S)), p["Rb"], p["Hb"] / 2, p["Rb"] + p["clearance"]
    if condition == "B":
        return R - (Rh * C - h * S)
    rim = R * C + h * S if h * C >= R * S else mpmath.hypot(R, h)
    if condition == "A" or C == 0:
        return rim - Rh
    return min(rim, (R + p["hole_length"] / 2 * S) / C) - Rh


def phase_of(point):
    """psi1 modulo half a turn, from the third row of the rotation matrix."""
    p = {name: real(value) for name, value in point.items()}
    length = mpmath.sqrt(p["n1"] ** 2 + p["n2"] ** 2 + p["n3"] ** 2)
    n1, n2, n3 = (p[name] / length for name in ("n1", "n2", "n3"))
    s, k = mpmath.sin(p["alpha"]), 1 - mpmath.cos(p["alpha"])
    return mpmath.atan2(-(n1 * n3 * k - n2 * s), n2 * n3 * k + n1 * s) + p["azimuth"]


def point_of(box, values=None):
    """Parameters of a point box as rationals, the tilt with the sign of its convention."""
    point = {name: box[name].lower for name in box.ranges} | (values or {})
    if box.convention == "deck":
        point["alpha"] = -point["alpha"]
    return point


def check_witness(found):
    """A jam that is claimed must be there, to 60 digits, for members of the witness."""
    exact = {}
    for name, text in found.witness.parameters.items():
        low, _, high = text.strip("[]").partition(", ")
        exact[name] = (F(low), F(high or low))
    ranges = any(low < high for low, high in exact.values())
    for share in (F(0), F(1, 3), F(1)) if ranges else (F(0),):
        values = {name: low + share * (high - low) for name, (low, high) in exact.items()}
        with mpmath.workdps(DIGITS):
            point, f = point_of(found.box, values), mpmath.mpf(found.witness.f.mid)
            if ranges:  # each member after its own phase
                off = phase_of(point) - mpmath.mpf(found.arcs.phase.mid)
                f += off - mpmath.pi * mpmath.nint(off / mpmath.pi)
            gap, assembled = gap_at(point, f, found.condition)
            assert gap > 0 and assembled >= 0, (found.box, found.condition, gap, assembled)


def count_undecided(count, seed, kind="moderate", margins=(-9.0, -0.5)):
    """Certify random cases; a wrong certificate raises.  Returns the number of undecided ones, each with a reason."""
    rng, tried, undecided = np.random.default_rng(seed), 0, 0
    while tried < count:
        case = random_case(rng, kind, margins)
        if case is None:
            continue
        tried += 1
        found = certify_jamming(case.box, case.condition)
        if found.verdict is Verdict.UNDECIDED:
            undecided += 1
            assert found.reason
        elif found.verdict is Verdict.CERTIFIED_JAMMED:
            assert case.jams, (case, found)
            if found.witness.interference.lo > 1e-12 * float(case.box["Rb"].upper):
                check_witness(found)
        else:
            assert found.verdict is Verdict.CERTIFIED_FREE and not case.jams, (case, found)
    return undecided


def worst_interference(point, condition):
    """Largest gap over a turn, wherever the linkage can be assembled or not, and the sine of its tilt."""
    p = {name: real(value) for name, value in point.items()}
    n = [p["n1"], p["n2"], p["n3"]]
    flat = (n[0] ** 2 + n[1] ** 2) / sum(v * v for v in n)
    deficit = 2 * mpmath.sin(p["alpha"] / 2) ** 2 * flat
    S = min(p["l2"] / p["l3"] * mpmath.sqrt(deficit * (2 - deficit)), mpmath.mpf(1))
    return gap_of(p, S, condition), S


def random_lengths(rng) -> ToleranceBox:
    """Any four lengths, also such that the crank cannot turn or nothing can be assembled; any tilt."""
    ratio = [log_uniform(rng, -0.5, 0.5, 3) for _ in range(4)]
    if rng.integers(3) == 0:  # flat at a position of the crank
        ratio[0] = max(ratio[2] + ratio[3] - ratio[1], F(1, 100))
    elif rng.integers(2):
        ratio[3] = ratio[2]
    alpha = log_uniform(rng, -4.0, 0.3)
    axis = [F(int(v)) for v in rng.integers(-3, 4, 3)]
    if not any(axis):
        axis[1] = F(1)
    H = log_uniform(rng, 0.3, 1.7)
    return ToleranceBox(
        *ratio, alpha, axis, azimuth=F(int(rng.integers(-30, 31)), 10), Rb=log_uniform(rng, 0.7, 1.5), Hb=H,
        clearance=log_uniform(rng, -4.0, 0.3), hole_length=H * log_uniform(rng, -0.5, 0.2),
        sgn=int(rng.choice([-1, 1])),
    )  # fmt: skip


def loosened(rng, box) -> ToleranceBox:
    """The same with tolerances on some of the parameters, from nothing to a few per cent."""
    ranges = {}
    for name, value in box.ranges.items():
        if rng.integers(2):
            spread = abs(value.lower) * log_uniform(rng, -6.0, -1.3) + (F(1, 10**4) if name == "azimuth" else 0)
            ranges[name] = (value.lower - spread, value.upper + spread * int(rng.integers(2)))
    axis = tuple(ranges.pop(name, box[name]) for name in ("n1", "n2", "n3"))
    if not any(F(1) <= abs(v[0] if isinstance(v, tuple) else v.lower) for v in axis):
        axis = (1, 0, 0)
    return box.replace(**ranges, axis=axis)


def members(rng, box, count):
    """Corners and inner points of a box, exactly."""
    names = list(box.ranges)
    for k in range(count):
        share = [F(int(rng.integers(2)) if k % 2 else int(rng.integers(101)), 1 if k % 2 else 100) for _ in names]
        yield {m: box[m].lower + t * (box[m].upper - box[m].lower) for m, t in zip(names, share)}


def check_box(rng, box, condition, count=6, angles=5):
    """Compare everything that is certified about a box with members of it, to 60 digits; returns the certificate."""
    found = certify_jamming(box, condition)
    if found.witness is not None:
        check_witness(found)
    assert found.verdict is not Verdict.UNDECIDED or found.reason
    with mpmath.workdps(DIGITS):
        for values in members(rng, box, count):
            point = point_of(box, values)
            gap, S = worst_interference(point, condition)
            assert found.largest_interference.hi >= gap >= found.smallest_worst_interference.lo, (box, condition)
            assert found.largest_tilt.lo <= mpmath.asin(S) <= found.largest_tilt.hi, (box, condition)
            assert found.verdict is not Verdict.CERTIFIED_FREE or gap < 0, (box, condition)
            assert found.verdict is not Verdict.CERTIFIED_JAMMED or gap > 0, (box, condition)
            for f in rng.uniform(0.0, 6.283, angles):
                _check_angle(found, point, float(f))
    return found


def _check_angle(found, point, f):
    gap, factor = gap_at(point, mpmath.mpf(f), found.condition)
    assembled = factor >= 0
    assert found.assembles != "always" or assembled, (found.box, f)
    assert found.assembles != "never" or not assembled, (found.box, f)
    here = found.over(f, f)
    if assembled:
        assert here is not Verdict.CERTIFIED_FREE or gap < 0, (found.box, found.condition, f)
    assert here is not Verdict.CERTIFIED_JAMMED or (assembled and gap > 0), (found.box, found.condition, f)


def check_sweep(rng, box, condition, count=4, angles=12):
    """Compare the pieces of an interval sweep with members at random angles."""
    found = sweep_linkage(box, condition, resolution=3e-2)
    with mpmath.workdps(DIGITS):
        for values in members(rng, box, count):
            point = point_of(box, values)
            for f in map(float, rng.uniform(0.0, 6.283, angles)):
                gap, factor = gap_at(point, mpmath.mpf(f), condition)
                for spans, right in (
                    (found.free, factor < 0 or gap < 0), (found.inner, factor >= 0 and gap > 0),
                    (found.missing, factor < 0),
                ):  # fmt: skip
                    assert right or not any(span.start < f < span.stop for span in spans), (box, condition, f)


def check_limits(rng, box, condition, count=6):
    """Every member of the box must be free at the value that is certified to work."""
    limits = (
        ("alpha", certified_largest_misalignment), ("clearance", certified_smallest_clearance),
        ("Hb", certified_largest_height),
    )  # fmt: skip
    for name, question in limits:
        limit = question(box, condition)
        assert limit.reason or (limit.works is not None and limit.fails is not None)
        if limit.works is None:
            continue
        with mpmath.workdps(DIGITS):
            for values in members(rng, box, count):
                gap, _ = worst_interference(point_of(box, {**values, name: F(limit.works)}), condition)
                assert gap < 0, (box, condition, name, limit)
