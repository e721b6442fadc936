"""Enclosures over a tolerance box of quantities that are monotone in every parameter, and of the linkage's positions.

A "corner pair" is an `Interval` of shape (2,): entry 0 encloses the smallest value over the box, entry 1 the largest.
Every parameter occurs in them at an exact end of its range, itself enclosed by neighbouring doubles, so that both
bounds of both entries are proofs about the exact box.  See theory/bearing-contact 6, 7 and theory/jam-arcs 1, 3, 6; the
monotonicity is derived in ``docs/explanation/bearing-jamming.md``.

`pose` is the kinematics of theory/four-bar-and-tilt 2, 6 to 8 for whole pieces of the turn at once.  It shares no
formula with the closed form of the arcs, so that each checks the other.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import choice
from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Interval, asin, atan2, cos, hypot, sin
from graphsynth.intervals.reading import enclose
from graphsynth.jamming.bearing.bearing import CONDITIONS, Condition
from graphsynth.jamming.bearing.parameters import ToleranceBox


def ends(box: ToleranceBox, name: str, falling: bool = False) -> Interval:
    """Return both exact ends of a parameter as a pair; exchanged for a quantity that falls with it."""
    low, high = box[name].ends
    if falling:
        low, high = high, low
    return Interval.from_bounds([low[0], high[0]], [low[1], high[1]])


def check_condition(box: ToleranceBox, condition: Condition) -> None:
    """Raise `GeometryError` for an unknown condition, or for "general" without a hole length."""
    choice("condition", condition, CONDITIONS)
    if condition == "general" and "hole_length" not in box:
        raise GeometryError('condition "general" needs hole_length; give it, or use condition "A" or "B"')


class Tilt(NamedTuple):
    """Largest sine of tilt over a turn (pair), and the sine of the angle of the coupler per unit of sin(f - psi).

    ``amplitude`` is the pair of ``max |A_z| / l3`` before any cap; ``sine`` the pair of the largest ``sin |theta|``.
    """

    amplitude: Interval
    sine: Interval


def sines(box: ToleranceBox) -> Tilt:
    """Enclose the largest sine of tilt over a turn at its two corners (theory/four-bar-and-tilt 6, 8)."""
    amplitude = _height(box) * ends(box, "l2") / ends(box, "l3", falling=True)
    return Tilt(amplitude, sine_of(amplitude, box.rod))


def sine_of(amplitude: Interval, rod: str) -> Interval:
    """Sine of tilt from ``|A_z| / l3``; capped at 1 (beyond it the linkage cannot be assembled)."""
    if rod == "deck":
        return amplitude / (amplitude.sqr() + 1).sqrt()
    return Interval.from_bounds(np.minimum(amplitude.lo, 1.0), np.minimum(amplitude.hi, 1.0))


def _inclination(box: ToleranceBox) -> Interval:
    """Pair of ``1 - n3^2`` for the normalised axis: grows with n1^2 + n2^2, falls with n3^2; rational, so exact."""
    squares = []  # the smallest and the largest of every component
    for value in (box[f"n{i}"] for i in (1, 2, 3)):
        low, high = sorted((value.lower**2, value.upper**2))
        squares.append((Fraction(0) if value.lower <= 0 <= value.upper else low, high))
    flat = [squares[0][k] + squares[1][k] for k in (0, 1)]
    pairs = [enclose(flat[k] / (flat[k] + squares[2][1 - k])) for k in (0, 1)]
    return Interval.from_bounds([low for low, _ in pairs], [high for _, high in pairs])


def _height(box: ToleranceBox) -> Interval:
    """Pair of ``sqrt((1 - R33)(1 + R33))``; with d = 1 - R33 it is ``sqrt(d (2 - d))``, growing up to d = 1."""
    low, high = box["alpha"].lower, box["alpha"].upper
    small = 0 if low <= 0 <= high else min(abs(low), abs(high))
    large = max(abs(low), abs(high))
    if large > 3:  # beyond pi the sine of alpha/2 falls again
        wave = sin(box.outer("alpha") / 2).sqr()
        halves = Interval.from_bounds([wave.lo, wave.lo], [wave.hi, wave.hi])  # both corners: the whole range
    else:
        a, b = (Interval(abs(end)) for end in (small, large))
        halves = sin(Interval.from_bounds([a.lo, b.lo], [a.hi, b.hi]) / 2).sqr()
    d = halves * _inclination(box) * 2
    values = d * (2 - d)
    clipped = Interval.from_bounds(np.clip(values.lo, 0.0, 1.0), np.clip(values.hi, 0.0, 1.0))
    if not (d.hi <= 1.0).all():  # the product falls beyond d = 1: take what holds for every d of the box
        top = 1.0 if d.hi[1] >= 1.0 and d.lo[0] <= 1.0 else float(clipped.hi.max())
        bottom = float(clipped.lo.min())
        clipped = Interval.from_bounds([bottom, bottom], [top, top])
    return clipped.sqrt()


def phase(box: ToleranceBox) -> Interval:
    """Enclose psi1 modulo pi over the box: ``arg(n1 + i n2) - atan2(n3 sin(alpha/2), cos(alpha/2)) + azimuth``.

    Half turns do not matter, because ``|sin(f - psi1)|`` decides.  At least pi wide if the direction is not known.
    """
    n1, n2, n3 = (box.outer(f"n{i}") for i in (1, 2, 3))
    if float(n1.lo) <= 0.0 <= float(n1.hi) and float(n2.lo) <= 0.0 <= float(n2.hi):
        return Interval.from_bounds(-2.0, 2.0)
    if float(n1.hi) <= 0.0:  # keep away from the cut of atan2; a half turn does not matter
        n1, n2 = -n1, -n2
    result = atan2(n2, n1) + box.outer("azimuth")
    if not (box["n3"].is_point and box["n3"].lower == 0):
        half = box.outer("alpha") / 2 * (1 if box.convention == "spec" else -1)
        length = (n1.sqr() + n2.sqr() + n3.sqr()).sqrt()
        result = result - atan2(n3 / length * sin(half), cos(half))
    return result


def cosine(sine: Interval) -> Interval:
    """Cosine of a tilt between 0 and pi/2 from its sine, without cancellation."""
    return ((1 - sine) * (1 + sine)).sqrt()


def _interference_a(S: Interval, R: Interval, h: Interval, c: Interval) -> Interval:
    """Condition A, both branches in stable form (theory/bearing-contact 2); grows with S and h, falls with R and c."""
    C = cosine(S)
    rising = h * S - c - R * S.sqr() / (1 + C)
    across, along = R * S, h * C
    if (across.hi <= along.lo).all():
        return rising
    saturated = (h.sqr() - c * (2 * R + c)) / (hypot(R, h) + R + c)
    steep, flat = across.lo > along.hi, across.hi <= along.lo
    hull = rising.hull(saturated)
    lo = np.where(steep, saturated.lo, np.where(flat, rising.lo, hull.lo))
    hi = np.where(steep, saturated.hi, np.where(flat, rising.hi, hull.hi))
    return Interval.from_bounds(lo, hi)


def _interference_b(S: Interval, R: Interval, h: Interval, c: Interval) -> Interval:
    """Condition B for sine of tilt, radius, half height and clearance, elementwise (mm)."""
    return h * S - c + (R + c) * S.sqr() / (1 + cosine(S))


def slanted(S: Interval, R: Interval, hole: Interval, c: Interval) -> Interval:
    """Interference ``gB / C`` of the slanted shaft at the rim of a hole of half length ``hole``.

    A pin in a hole ("general") has the smaller one of this and gA: it binds where it would both as a short bearing in a
    long hole and as a long shaft in a hole of this length (theory/bearing-contact 4).
    """
    C = cosine(S)
    value = (hole * S - c + (R + c) * S.sqr() / (1 + C)) / C
    upright = value.is_empty  # C = 0: the shaft lies across
    return Interval.from_bounds(np.where(upright, 0.0, value.lo), np.where(upright, np.inf, value.hi))


def interference_corners(box: ToleranceBox, sine: Interval, condition: Condition) -> Interval:
    """Pair of the smallest and the largest interference (mm) over the box, for a pair of sines (theory/jam-arcs 6)."""
    check_condition(box, condition)
    h, c = ends(box, "Hb") / 2, ends(box, "clearance", falling=True)
    if condition == "B":
        return _interference_b(sine, ends(box, "Rb"), h, c)
    a = _interference_a(sine, ends(box, "Rb", falling=True), h, c)
    if condition == "A":
        return a
    hole = ends(box, "hole_length") / 2
    b = slanted(sine, ends(box, "Rb"), hole, c)
    lo, hi = np.minimum(a.lo, b.lo), np.minimum(a.hi, b.hi)
    if not box["Rb"].is_point:
        lo[1], hi[1] = _largest_over_radius(box, sine[1], h[1], c[1], hole[1])
    return Interval.from_bounds(lo, hi)


def _largest_over_radius(
    box: ToleranceBox, S: Interval, h: Interval, c: Interval, hole: Interval
) -> tuple[float, float]:
    """Enclose ``max over R of min(gA, gB / C)``: gA falls with R and gB rises, so the ends of a piece of R bound it."""
    (start, first), (last, stop) = box["Rb"].ends

    def both(points: Interval) -> tuple[Interval, Interval]:
        return _interference_a(S, points, h, c), slanted(S, points, hole, c)

    a, b = both(Interval.from_bounds(start, stop))
    best, above = float(min(a.lo, b.lo)), float(min(a.hi, b.hi))
    low, high = start, stop
    for _ in range(6):
        edges = np.linspace(low, high, 65)
        a, b = both(Interval.from_bounds(edges, edges))
        inside = (edges >= first) & (edges <= last)  # values there are attained in the exact range
        if inside.any():
            best = max(best, float(np.minimum(a.lo, b.lo)[inside].max()))
        pieces = np.minimum(a.hi[:-1], b.hi[1:])
        above = min(above, max(float(pieces.max()), best))
        keep = np.flatnonzero(pieces > best)
        if keep.size == 0 or above - best <= 4e-16 * abs(best):
            break
        low, high = float(edges[keep[0]]), float(edges[keep[-1] + 1])
    return best, above


def critical_sines(box: ToleranceBox, condition: Condition) -> Interval:
    """Pair of the sine of the critical tilt (theory/bearing-contact 7); an infinite bound means "no critical tilt".

    Condition A: grows with c and R, falls with h, and exists where ``h^2 > c (2R + c)``, decided exactly; equality,
    contact without overlap, counts in the lower bound only.  Condition B: grows with c, falls with R and h.  General:
    the larger one of both, since the pin binds where both do.
    """
    check_condition(box, condition)
    if condition == "B":
        return _critical(box, "Hb", "B")
    a = _critical(box, "Hb", "A")
    if condition == "A":
        return a
    b = _critical(box, "hole_length", "B")
    return Interval.from_bounds(np.maximum(a.lo, b.lo), np.maximum(a.hi, b.hi))


def _critical(box: ToleranceBox, height: str, condition: str) -> Interval:
    c, R = ends(box, "clearance"), ends(box, "Rb", falling=condition == "B")
    h = ends(box, height, falling=True) / 2
    slack = c * (2 * R + c)
    room = h.sqr() + (slack if condition == "B" else -slack)
    w = room.sqrt()
    q = c / (h + w)
    with np.errstate(all="ignore"):
        s = 2 * q / (1 + q.sqr())
    lo, hi = np.where(s.is_empty, 0.0, np.clip(s.lo, 0.0, 1.0)), np.where(s.is_empty, 1.0, np.clip(s.hi, 0.0, 1.0))
    given = box["clearance"], box["Rb"], box[height]
    tight, loose = zip(*((value.lower, value.upper) for value in given))
    for corner, (least, radius, half) in enumerate(((*tight[:2], loose[2] / 2), (*loose[:2], tight[2] / 2))):
        # in rational arithmetic; with no room the parts touch but never overlap: no jam for the last bearing to jam
        exists, space = least >= 0, half * half - least * (2 * radius + least)
        if condition == "A":
            exists = exists and (space > 0 if corner else space >= 0)
        if not exists:
            lo[corner] = hi[corner] = math.inf
        elif c.lo[corner] <= 0.0 <= c.hi[corner]:  # no clearance, no tilt
            lo[corner] = 0.0
            hi[corner] = 0.0 if c.hi[corner] == 0.0 else hi[corner]
    big = float(np.finfo(np.float64).max)
    lo = np.where(np.isinf(lo), big, lo)  # an interval needs a finite lower bound
    return Interval.from_bounds(lo, hi)


def onset(box: ToleranceBox, critical: Interval, tilt: Tilt) -> tuple[float, float]:
    """Bounds of kappa over the box: the bearing binds where ``|sin(f - psi1)| > kappa`` (theory/jam-arcs 1).

    Infinite where there is no critical tilt or no tilt.
    """
    big = float(np.finfo(np.float64).max)
    s = sine_of(critical, "rigid")
    if box.rod == "deck":  # tan theta = A_z / l3
        s = s / cosine(s)
        s = Interval.from_bounds(np.where(s.is_empty, big, s.lo), np.where(s.is_empty, np.inf, s.hi))
    low, high = float(s.lo[0]), float(s.hi[1])
    a, b = float(tilt.amplitude.lo[0]), float(tilt.amplitude.hi[1])
    first, last = 0.0, math.inf
    if low != 0.0:
        known = b != 0.0 and critical.lo[0] != big
        first = float((Interval(low) / Interval(b)).lo) if known else math.inf
    if high == 0.0 and a > 0.0:
        last = 0.0
    elif a != 0.0 and math.isfinite(high) and math.isfinite(float(critical.hi[1])):
        last = float((Interval(high) / Interval(a)).hi)
    return first, max(first, last)


def arcsine(value: float) -> Interval:
    """Enclose ``asin`` of a double in [0, 1]."""
    return asin(Interval.from_bounds(value, value))


def worst_corner(box: ToleranceBox, condition: Condition) -> ToleranceBox:
    """Return the parameter vector of the box at which the interference is largest; the middle where it does not matter.

    For condition "general" with a range of radii the radius is a candidate only: the value there is evaluated anew.
    """
    worst: dict[str, Fraction] = {name: (r.lower + r.upper) / 2 for name, r in box.ranges.items()}
    for name in ("l2", "Hb", "hole_length"):
        if name in box:
            worst[name] = box[name].upper
    worst["l3"], worst["clearance"] = box["l3"].lower, max(box["clearance"].lower, Fraction(0))
    for name in ("alpha", "n1", "n2"):
        worst[name] = max(box[name].lower, box[name].upper, key=abs)
    low, high = box["n3"].lower, box["n3"].upper
    worst["n3"] = Fraction(0) if low <= 0 <= high else min(low, high, key=abs)
    worst["Rb"] = box["Rb"].lower if condition == "A" else box["Rb"].upper
    sine = box.nominal()[0].largest_tilt[1] if condition == "general" else 0.0
    if sine != 0.0:  # both readings of the general pin are about equal: R S = hp C - hh (theory/bearing-contact 4)
        wanted = float(worst["Hb"]) / 2 * math.sqrt(1.0 - sine * sine) - float(worst["hole_length"]) / 2
        worst["Rb"] = min(max(Fraction(wanted / sine), box["Rb"].lower), box["Rb"].upper)
    return box.replace(axis=[worst.pop(name) for name in ("n1", "n2", "n3")], **worst)


Mask = NDArray[np.bool_]


class Pose(NamedTuple):
    """Enclosures over pieces of the rotation, for all parameters of a box.

    ``assembled``, ``missing``: proved that the linkage can be assembled at every point of the piece, or at none.
    ``sine``:  of the tilt, without sign.
    """

    assembled: Mask
    missing: Mask
    sine: Interval


def turns_freely(box: ToleranceBox, amplitude: float) -> bool:
    """Whether a few exact inequalities prove that every parameter vector is assembled at every crank angle.

    ``amplitude`` is an upper bound over the box of z, the largest ``|A_z| / l3`` of a rotation.  True is a proof; False
    says nothing (then `pose` decides piece by piece).  The pin runs at a plan radius in ``[sqrt(l2^2 - z^2), l2]``, the
    plan length s3 of the coupler lies in ``[sqrt(l3^2 - z^2), l3]``, and ``sqrt(1 - x^2) >= 1 - x^2`` keeps all bounds
    rational.  Then ``|l4 - s3| <= D <= l4 + s3`` (theory/four-bar-and-tilt 3, 7) holds for every D between the bounds
    of ``|A - C|``.
    """
    if not amplitude < 1.0:
        return False
    l1, l2, l3, l4 = (box[name] for name in ("l1", "l2", "l3", "l4"))
    z = Fraction(amplitude) * l3.lower  # the largest ratio is that of the largest crank and the smallest coupler
    radius = l2.lower - z * z / l2.lower
    plan = l3.lower if box.rod == "deck" else l3.lower - z * z / l3.lower
    nearest = max(l1.lower - l2.upper, radius - l1.upper)
    apart = max(l4.upper - plan, l3.upper - l4.lower, Fraction(0))
    return nearest > 0 and nearest >= apart and l1.upper + l2.upper <= l4.lower + plan


def pose(box: ToleranceBox, f: Interval) -> Pose:
    """Enclose assembly and tilt over pieces ``f`` (m,) of the rotation (certified for all parameters of the box)."""
    # one shape for all, so that every operation takes it
    l1, l2, l3, l4, turn = (_spread(box.outer(name), f) for name in ("l1", "l2", "l3", "l4", "azimuth"))
    n1, n2, n3, alpha = (_spread(value, f) for value in _direction(box))
    phi = f - turn  # the axis turned by the azimuth: the same motion, seen in a turned frame
    cf, sf = cos(phi), sin(phi)
    s, c, v = sin(alpha), cos(alpha), sin(alpha / 2).sqr() * 2
    x = l2 * (cf * (c + n1.sqr() * v) + sf * (n1 * n2 * v - n3 * s))
    y = l2 * (cf * (n1 * n2 * v + n3 * s) + sf * (c + n2.sqr() * v))
    z = l2 * (cf * (n1 * n3 * v - n2 * s) + sf * (n2 * n3 * v + n1 * s))
    dx, dy = x - l1 * cos(turn), y + l1 * sin(turn)
    square = dx.sqr() + dy.sqr()
    ratio = abs(z) / l3
    plan = l3 if box.rod == "deck" else ((l3 - z) * (l3 + z)).sqrt()
    near, far = square - (l4 - plan).sqr(), (l4 + plan).sqr() - square
    assembled = (near.lo >= 0.0) & (far.lo >= 0.0) & (square.lo > 0.0)
    missing = (near.hi < 0.0) | (far.hi < 0.0)
    if box.rod == "rigid":
        assembled = assembled & (ratio.hi <= 1.0)
        missing = missing | (ratio.lo > 1.0)
    return Pose(np.asarray(assembled), np.asarray(missing), sine_of(ratio, box.rod))


def _spread(value: Interval, f: Interval) -> Interval:
    """Repeat one interval over the pieces."""
    return Interval.from_bounds(np.broadcast_to(value.lo, f.shape), np.broadcast_to(value.hi, f.shape))


def _direction(box: ToleranceBox) -> tuple[Interval, Interval, Interval, Interval]:
    """Return the unit direction of the tilt axis and the angle of the active rotation."""
    n = [box.outer(f"n{i}") for i in (1, 2, 3)]
    alpha = box.outer("alpha") if box.convention == "spec" else -box.outer("alpha")
    known = [box[f"n{i}"] for i in (1, 2, 3)]
    if all(part.is_point for part in known) and sum(part.lower**2 for part in known) == 1:
        return n[0], n[1], n[2], alpha
    length = (n[0].sqr() + n[1].sqr() + n[2].sqr()).sqrt()
    one = Interval.from_bounds(-1.0, 1.0)
    unit = [(part / length).intersect(one) for part in n]
    return unit[0], unit[1], unit[2], alpha


def corner_interference(box: ToleranceBox, sine: Interval, condition: Condition, corner: int) -> Interval:
    """Interference at the sine given and at the corner of the bearing that makes it smallest (0) or largest (1)."""

    def end(name: str, rising: bool) -> Interval:
        low, high = box[name].ends[corner if rising else 1 - corner]
        return _spread(Interval.from_bounds(low, high), sine)

    h, c = end("Hb", True) / 2, end("clearance", False)
    if condition == "B":
        return _interference_b(sine, end("Rb", True), h, c)
    a = _interference_a(sine, end("Rb", False), h, c)
    if condition == "A":
        return a
    # gA falls and gB / C rises with the radius: each at its own end bounds the smaller of both from either side
    b = slanted(sine, end("Rb", True), end("hole_length", True) / 2, c)
    return Interval.from_bounds(np.minimum(a.lo, b.lo), np.minimum(a.hi, b.hi))
