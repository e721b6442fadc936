"""Areas of interference enclosed: the closed forms of `graphsynth.jamming.bearing.areas` in interval arithmetic.

Each area is evaluated at the two corners of the ranges at which it is smallest and largest, so that wide ranges of
tilt, height and clearance give their exact range up to rounding; the radius of the bearing is carried as it is.  Why
the areas are monotone: ``docs/explanation/circle-and-ellipse.md``.  See theory/circle-and-ellipse 2 to 5.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.intervals.guard import check_rounding
from graphsynth.intervals.interval import Interval, _make

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Series of x - sin x for |x| <= 1; what is left out is below 1e-30 of the first term.
_COEFFICIENTS = [(-1) ** k / math.factorial(2 * k + 3) for k in range(13)]
#: Relative error of the series in double precision is below 6 units of 2^-53: each partial sum is dominated 19 to 1 by
#: its first term, so that errors of later ones fade (proof in docs/explanation/circle-and-ellipse.md).
_SERIES_ERROR = 8.0 * 2.0**-53


class EnclosedCrescents(NamedTuple):
    """``ellipse_only``: ellipse minus circle; ``circle_only``: circle minus ellipse; both `Interval`, mm^2."""

    ellipse_only: Interval
    circle_only: Interval


def _bounds(lo: Array | float, hi: Array | float) -> Interval:
    """Make an interval of bounds that are known to be in order."""
    return _make(np.asarray(lo, dtype=np.float64), np.asarray(hi, dtype=np.float64))


def _point(x: Array) -> Interval:
    return _bounds(x, x)


def _choose(mask: Mask, a: Interval, b: Interval) -> Interval:
    return _bounds(np.where(mask, a.lo, b.lo), np.where(mask, a.hi, b.hi))


def _nonnegative(x: Interval) -> Interval:
    """Clip to [0, inf); what is wholly negative becomes 0."""
    return _bounds(np.maximum(x.lo, 0.0), np.maximum(x.hi, 0.0))


def _limited(x: Interval, top: Interval) -> Interval:
    """Return ``x`` cut to [0, top], where the true value is known to lie."""
    return _bounds(np.clip(x.lo, 0.0, top.hi), np.clip(x.hi, 0.0, top.hi))


def _xms(x: Interval) -> Interval:
    """Enclose ``x - sin x``, which never falls: at both ends, by its series or directly."""
    from graphsynth.intervals import functions

    ends = np.stack([x.lo, x.hi])
    small = np.abs(ends) <= 1.0
    t = np.where(small, ends, 0.0)
    square, series = t * t, np.zeros_like(t)
    for coefficient in reversed(_COEFFICIENTS):
        series = series * square + coefficient
    value = series * square * t
    margin = _SERIES_ERROR * np.abs(value) + 1e-300
    lo, hi = value - margin, value + margin
    if not small.all():
        direct = _point(np.where(small, 0.0, ends))
        direct = direct - functions.sin(direct)
        lo, hi = np.where(small, lo, direct.lo), np.where(small, hi, direct.hi)
    zero = ends == 0.0
    return _bounds(np.where(zero, 0.0, lo)[0], np.where(zero, 0.0, hi)[1])


def _segment(s: Interval) -> Interval:
    return _xms(2 * s) / 2


def _segment_difference(difference: Interval, total: Interval) -> Interval:
    from graphsynth.intervals import functions

    turned: Interval = 2 * functions.sin(difference) * functions.sin(total / 2).sqr()
    return _xms(difference) + turned


def _ranges(**values: Any) -> tuple[Interval, ...]:
    """Read the ranges and broadcast them; name what is wrong."""
    check_rounding()
    read = []
    for name, value in values.items():
        item = value if isinstance(value, Interval) else Interval(value)
        if not item.is_bounded.all():
            raise GeometryError(f"{name} holds an empty or unbounded interval; give finite bounds")
        read.append(item)
    shape = np.broadcast_shapes(*(item.shape for item in read))
    return tuple(_bounds(np.broadcast_to(item.lo, shape), np.broadcast_to(item.hi, shape)) for item in read)


def _angle(y: Interval, x: Interval) -> Interval:
    """Enclose the angle of the points (x, y); [-pi, pi] at the origin alone, where nothing is known."""
    from graphsynth.intervals import functions

    angle = functions.atan2(y, x)
    return _choose(angle.is_empty, _pi().hull(-_pi()), angle)


def _pi() -> Interval:
    from graphsynth.intervals.constants import PI

    return _bounds(*PI)


# -- centred ellipse and circle ----------------------------------------------------------------------------------------


def enclose_crescents(R1: Any, pa: Any, qb: Any) -> EnclosedCrescents:
    """Enclose the areas between a circle and a centred ellipse from ``pa = a - R1`` and ``qb = R1 - b``.

    Parameters
    ----------
    R1, pa, qb : Interval or anything it takes, shape (...)
        Radius of the circle and differences of the radii; broadcast against each other.

    Returns
    -------
    EnclosedCrescents
        Certified.  Exact up to rounding for a point R1; for a range of R1 an enclosure.

    Raises
    ------
    GeometryError
        Unless ``R1 > 0``, ``qb < R1`` and ``pa + qb >= 0`` throughout.

    Examples
    --------
    >>> found = enclose_crescents(1, "1e-9", "1e-9")
    >>> found.ellipse_only.contains("1.999999998429203672788436714e-9"), bool(found.ellipse_only.width < 1e-22)
    (True, True)
    """
    R1, pa, qb = _ranges(R1=R1, pa=pa, qb=qb)
    if not bool(((R1.lo > 0.0) & (qb.hi < R1.lo) & ((pa + qb).hi >= 0.0)).all()):
        raise GeometryError("an ellipse needs semi-axes a >= b > 0: qb < R1 and pa + qb >= 0 with R1 > 0")
    ell, cir = _crescents_at(_twice(R1), _point(np.stack([pa.lo, pa.hi])), _point(np.stack([qb.hi, qb.lo])))
    return EnclosedCrescents(_bounds(ell.lo[0], ell.hi[1]), _bounds(cir.lo[1], cir.hi[0]))


def _crescents_at(R1: Interval, pa: Interval, qb: Interval) -> EnclosedCrescents:
    """theory/circle-and-ellipse 3 with its branches; ``pa`` is a point, ``qb`` a point or narrow."""
    ex = R1 * (qb - pa) + pa * qb
    crossing = (pa.hi > 0.0) & (qb.hi > 0.0)
    one = Interval(1)
    p, q = _choose(crossing, pa, one), _choose(crossing, _nonnegative(qb), one)
    a, b = R1 + p, R1 - _choose(crossing, q, qb)
    b = _choose(b.lo > 0.0, b, one)
    x0 = a * (q * (R1 + b) / ((p + q) * (a + b))).sqrt()
    y0 = b * (p * (a + R1) / ((p + q) * (a + b))).sqrt()
    dl = _angle((p + q) * x0 * y0, b * x0.sqr() + a * y0.sqr())
    sc, se = _angle(y0, x0), _angle(a * y0, b * x0)
    tc, te = _angle(x0, y0), _angle(b * x0, a * y0)
    mixed = R1 * (q - p) + p * q
    ell = 2 * (a * b * _segment_difference(dl, sc + se) - mixed * _segment(sc))
    cir = 2 * (mixed * _segment(tc) + a * b * _segment_difference(dl, tc + te))
    nothing, inside = Interval.zeros(ell.shape), pa.hi <= 0.0
    whole = _pi() * ex
    maybe = crossing & (qb.lo <= 0.0)  # touching cannot be excluded: both branches
    ell = _choose(maybe, ell.hull(-whole), ell)
    cir = _choose(maybe, cir.hull(nothing), cir)
    ell = _choose(crossing, _nonnegative(ell), _choose(inside, nothing, _nonnegative(-whole)))
    cir = _choose(crossing, _nonnegative(cir), _choose(inside, _nonnegative(whole), nothing))
    return EnclosedCrescents(ell, cir)


# -- the tilted bearing ------------------------------------------------------------------------------------------------


def _bearing_ranges(R: Any, c: Any, h: Any, sine: Any) -> tuple[Interval, Interval, Interval, Interval]:
    R, c, h, S = _ranges(R=R, clearance=c, h=h, sine=sine)
    if not bool((R.lo > 0.0).all()):
        raise GeometryError(f"R = {R.lo.min()} must be positive; correct the value")
    if not bool((c.lo >= 0.0).all()):
        raise GeometryError(
            f"clearance = {c.lo.min()} is negative: an interference fit has no free position to measure an area from"
        )
    if not bool((h.lo >= 0.0).all()):
        raise GeometryError(f"h = {h.lo.min()} must be zero or more; correct the value")
    S = abs(S)
    if not bool((S.hi <= 1.0).all()):
        raise GeometryError(f"sine = {S.hi.max()} of the tilt exceeds 1; give values in [-1, 1]")
    return R, c, h, S


class _Tilt(NamedTuple):
    """A tilt at points of S: cosine, ``1 - C``, and the shape of things in the section."""

    S: Interval
    C: Interval
    bend: Interval


def _tilt(S: Interval) -> _Tilt:
    C = _nonnegative((1 - S) * (1 + S)).sqrt()
    return _Tilt(S, C, S.sqr() / (1 + C))


def enclose_surrogate_areas(R: Any, clearance: Any, h: Any, sine: Any) -> EnclosedCrescents:
    """Enclose the free gap and the interference of the surrogate ellipse E4 over ranges of the parameters.

    Parameters
    ----------
    R, clearance, h : Interval or anything it takes, shape (...)
        Radius of the bearing, radial clearance, half height; mm.
    sine : the same
        Sine of the tilt.

    Returns
    -------
    EnclosedCrescents
        Certified; empty where the ellipse does not exist for any value (``b <= 0``), [0, inf] where it may not.

    Examples
    --------
    >>> gap, jam = enclose_surrogate_areas("17.5", "0.03", 5, "0.01333086429801")
    >>> bool(jam.width < 1e-11)
    True
    """
    R, c, h, S = _bearing_ranges(R, clearance, h, sine)
    pairs = ((c.lo, c.hi), (h.hi, h.lo), (S.hi, S.lo))  # the tight corner, the free corner
    areas, depth = _surrogate_at(_twice(R), *(_point(np.stack(pair)) for pair in pairs))
    never, maybe = depth.lo[1] >= R.hi, depth.hi[0] >= R.lo
    any_area = _bounds(0.0, np.inf)
    both = []
    for area, low, high in ((areas.ellipse_only, 0, 1), (areas.circle_only, 1, 0)):
        found = _bounds(np.minimum(area.lo[low], area.hi[high]), area.hi[high])
        both.append(_choose(never, Interval.empty(), _choose(maybe, any_area, found)))
    return EnclosedCrescents(*both)


def _surrogate_at(R: Interval, c: Interval, h: Interval, S: Interval) -> tuple[EnclosedCrescents, Interval]:
    tilt = _tilt(S)
    depth = h * S - c + (R + c) * tilt.bend
    defined = _choose(depth.hi < R.lo, depth, Interval(0))
    return _crescents_at(R, c, defined), depth


def enclose_lid_area(R: Any, clearance: Any, h: Any, sine: Any) -> Interval:
    """Enclose A_lid, the disc of radius R outside one lid of the tilted hole (condition B), mm^2.

    Parameters
    ----------
    R, clearance, h, sine : Interval or anything it takes, shape (...)
        As for `enclose_surrogate_areas`; the clearance must not be negative.

    Returns
    -------
    Interval
        Certified; the exact range up to rounding: the area grows with R, h and the tilt, and falls with the clearance.

    Examples
    --------
    >>> area = enclose_lid_area("17.5", "0.03", 5, "[0.0133, 0.0134]")
    >>> bool(area.lo > 0.95), bool(area.hi < 0.98)
    (True, True)
    """
    R, c, h, S = _bearing_ranges(R, clearance, h, sine)
    corners = (np.stack(pair) for pair in ((R.lo, R.hi), (c.hi, c.lo), (h.lo, h.hi), (S.lo, S.hi)))
    area = _lid_at(*(_point(corner) for corner in corners))
    return _bounds(area.lo[0], area.hi[1])


def _lid_at(R: Interval, c: Interval, h: Interval, S: Interval) -> Interval:
    tilt = _tilt(S)
    q = R + c
    p, d = q * tilt.C, h * S
    disc = _pi() * R.sqr()
    near = h * S - c + q * tilt.bend
    area = _lid_side(R, c, h, tilt, near)
    far = R - d - p
    if bool((far.hi > 0.0).any()):
        area = area + _lid_side(R, c, -h, tilt, far)
    beyond = d - p - R
    area = _choose(beyond.lo >= 0.0, disc, _choose(beyond.hi >= 0.0, area.hull(disc), area))
    return _limited(_choose(p.lo > 0.0, area, _choose(near.lo > 0.0, disc, disc.hull(Interval(0)))), disc)


def _lid_side(R: Interval, c: Interval, h: Interval, tilt: _Tilt, depth: Interval) -> Interval:
    """One crescent; zero where ``depth <= 0``."""
    one = Interval(1)
    S, C, bend = (_choose((tilt.S.lo > 0.0) & (tilt.C.lo > 0.0), part, one) for part in tilt)
    q = R + c
    p, d, thin, ring = q * C, h * S, q * bend, c * (2 * R + c)
    m = _nonnegative(depth) * (R + d + p) / (S * (R * S + h + C * (h.sqr() + ring).sqrt()))
    m = _choose(m.is_empty, _bounds(0.0, np.inf), m)
    m = _limited(m, 2 * R)
    X, y = R - m, _nonnegative(m * (2 * R - m)).sqrt()
    s1, s2 = _angle(y, X), _angle(y / q, (d + X) / p)
    dl = _angle((y / R) * (d / p + X * thin / (p * q)), X * (d + X) / (p * R) + y.sqr() / (q * R))
    area = (q * thin - ring) * _segment(s1) + p * q * _segment_difference(dl, s1 + s2)
    area = _bounds(np.where(depth.lo > 0.0, area.lo, np.minimum(area.lo, 0.0)), area.hi)
    return _choose(depth.hi > 0.0, area, Interval.zeros(area.shape))


def enclose_rim_area(R: Any, clearance: Any, h: Any, sine: Any) -> tuple[Interval, Mask]:
    """Enclose A_rim, the rim of the tilted bearing outside the disc of radius Rh (condition A), mm^2.

    Parameters
    ----------
    R, clearance, h, sine : Interval or anything it takes, shape (...)
        As for `enclose_surrogate_areas`; the clearance must not be negative.

    Returns
    -------
    area : Interval
        Certified; exact up to rounding for a point R while ``(h S)^2 <= c (2 R + c)``.
    closed_form : ndarray of bool
        False where ``R S > h C`` is possible: the closed form does not hold there, and the area is only enclosed by the
        whole rim.

    Examples
    --------
    >>> area, closed = enclose_rim_area("17.5", "0.03", 5, "[0.0133, 0.0134]")
    >>> bool(area.lo > 0.87), bool(area.hi < 0.9), bool(closed)
    (True, True, True)
    """
    R, c, h, S = _bearing_ranges(R, clearance, h, sine)
    pairs = ((c.hi, c.lo), (h.lo, h.hi), (S.lo, S.hi))
    area = _rim_at(_twice(R), *(_point(np.stack(pair)) for pair in pairs))
    # the area grows with the tilt while the ends of the rim across the tilt, (d, +-R), lie in the hole
    monotone = (S.lo == S.hi) | ((c * (2 * R + c) - (h * S).sqr()).lo >= 0.0)
    if monotone.all():
        area = _bounds(area.lo[0], area.hi[1])
    else:
        over = _rim_at(R, c, h, S)
        area = _bounds(np.where(monotone, area.lo[0], over.lo), np.where(monotone, area.hi[1], over.hi))
    tilt = _tilt(S)
    closed = np.asarray((h * tilt.C - R * S).lo >= 0.0)
    nothing = np.asarray(((R + c).sqr() - R.sqr() - h.sqr()).lo >= 0.0)  # Rh >= sqrt(R^2 + h^2): free at any tilt
    rim = _pi() * R.sqr() * tilt.C
    area = _choose(closed, area, rim.hull(Interval(0)))
    area = _choose(nothing, Interval.zeros(area.shape), _limited(area, rim))
    return area, np.asarray(closed | nothing)


def _twice(x: Interval) -> Interval:
    """Repeat for two corners."""
    return _bounds(np.stack([x.lo, x.lo]), np.stack([x.hi, x.hi]))


def _rim_at(R: Interval, c: Interval, h: Interval, S: Interval) -> Interval:
    """theory/circle-and-ellipse 4, condition A, with its branches."""
    one, full = Interval(1), _tilt(S)
    usable = (full.S.lo > 0.0) & (full.C.lo > 0.0)
    depth = h * S - c - R * full.bend
    S, C, bend = (_choose(usable, part, one) for part in full)
    Rh, ring = R + c, c * (2 * R + c)
    p, d = R * C, h * S
    m = _nonnegative(depth) * (p + Rh - d) / (S * (h - Rh * S + C * _nonnegative(h.sqr() - ring).sqrt()))
    m = _limited(_choose(m.is_empty, _bounds(0.0, np.inf), m), 2 * Rh)
    x, y = Rh - m, _nonnegative(m * (2 * Rh - m)).sqrt()
    s1, s2 = _angle(y, x), _angle(y / R, (x - d) / p)
    dl = _angle(y * (d - x * bend) / (p * Rh), (x - d) * x / (p * Rh) + y.sqr() / (R * Rh))
    area = p * R * _segment_difference(dl, s1 + s2) - (R.sqr() * bend + ring) * _segment(s1)
    whole = _pi() * p * R
    beyond = d - p - Rh
    area = _choose(beyond.lo >= 0.0, whole, _choose(beyond.hi >= 0.0, area.hull(whole), area))
    area = _bounds(np.where(depth.lo > 0.0, area.lo, np.minimum(area.lo, 0.0)), area.hi)
    area = _choose(depth.hi > 0.0, area, Interval.zeros(area.shape))
    possible = _choose(usable, area, (_pi() * R.sqr()).hull(Interval(0)))
    return _choose(depth.hi > 0.0, possible, Interval.zeros(area.shape))
