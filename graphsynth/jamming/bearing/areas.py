"""Areas of interference: ellipse against circle, disc against the lid of a tilted hole, rim against the hole.

Square millimetres throughout.  The stable forms take the small differences of the radii instead of the radii, because
subtracting numbers near 17.5 to obtain 0.001 loses every digit of a thin crescent.  Each closed form is written once,
for any `Numbers`: arrays of floats (estimated), or intervals (certified).
See theory/circle-and-ellipse 2 to 5; the enclosures are those of `graphsynth.jamming.bearing.areas_enclosed`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Bearing

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Series of x - sin x = x^3/3! - x^5/5! + ...
COEFFICIENTS = [(-1) ** k / math.factorial(2 * k + 3) for k in range(13)]
#: With 12 terms what is left out is below 1e-17 of the first for |x| < 2; direct subtraction below 2 loses up to four
#: units in the last place.
_SERIES_BELOW, _SERIES_TERMS = 2.0, 12


class CrescentAreas(NamedTuple):
    """``ellipse_only``: ellipse minus circle (free gap); ``circle_only``: circle minus ellipse (interference); mm^2."""

    ellipse_only: Any
    circle_only: Any


# -- the closed forms, in any numbers ----------------------------------------------------------------------------------


class Numbers(NamedTuple):
    """Functions of a number type.

    ``root`` is the square root of the part that is not negative, ``xms`` is ``x - sin x``, ``within(x, top)`` cuts x to
    [0, top], where the true value is known to lie.
    """

    sin: Callable[[Any], Any]
    square: Callable[[Any], Any]
    root: Callable[[Any], Any]
    angle: Callable[[Any, Any], Any]
    xms: Callable[[Any], Any]
    within: Callable[[Any, Any], Any]


class Tilt(NamedTuple):
    """Sine S and cosine C of the tilt, and ``1 - C`` times the radius of the tilted circle: of the hole, or 1."""

    S: Any
    C: Any
    bend: Any


def _segment(n: Numbers, s: Any) -> Any:
    """``s - sin s cos s``, the circular segment of half angle s."""
    return n.xms(2 * s) / 2


def _segment_difference(n: Numbers, difference: Any, total: Any) -> Any:
    """``segment(a) - segment(b)`` from ``a - b`` and ``a + b``."""
    return n.xms(difference) + 2 * n.sin(difference) * n.square(n.sin(total / 2))


def crescents(n: Numbers, R1: Any, a: Any, b: Any, p: Any, q: Any) -> tuple[Any, Any, tuple[Any, ...]]:
    """Both areas where circle and ellipse intersect, ``p = a - R1 > 0`` and ``q = R1 - b > 0``, and the half angles."""
    ex = R1 * (q - p) + p * q  # R1^2 - a b
    x0 = a * n.root(q * (R1 + b) / ((p + q) * (a + b)))
    y0 = b * n.root(p * (a + R1) / ((p + q) * (a + b)))
    dl = n.angle((p + q) * x0 * y0, b * x0 * x0 + a * y0 * y0)
    sc, se = n.angle(y0, x0), n.angle(a * y0, b * x0)
    tc, te = n.angle(x0, y0), n.angle(b * x0, a * y0)
    ell = 2 * (a * b * _segment_difference(n, dl, sc + se) - ex * _segment(n, sc))
    cir = 2 * (ex * _segment(n, tc) + a * b * _segment_difference(n, dl, tc + te))
    return ell, cir, (sc, se, tc, te)


def _lid_point(n: Numbers, R: Any, q: Any, h: Any, ring: Any, tilt: Tilt, depth: Any) -> tuple[Any, Any]:
    """Distances of the intersections of disc and lid ellipse from the centre, against the tilt and across it.

    The discriminant of theory/circle-and-ellipse 4 simplifies: ``H^2 - k G = (S wB / (C q^2))^2`` with ``wB`` of
    theory/bearing-contact 7, so that the intersection needs neither a division by C nor a subtraction.
    """
    S, C, _ = tilt
    m = depth * (R + h * S + q * C) / (S * (R * S + h + C * n.root(n.square(h) + ring)))
    m = n.within(m, 2 * R)
    return R - m, n.root(m * (2 * R - m))


def lid_crescent(n: Numbers, R: Any, q: Any, h: Any, ring: Any, tilt: Tilt, depth: Any) -> Any:
    """Crescent of the disc of radius R outside the lid ellipse, on the side of ``depth > 0``; h < 0 is the far side.

    ``q`` is the radius of the hole, ``ring`` is ``q^2 - R^2``, ``tilt.bend`` is ``q (1 - C)``.
    """
    p, d, thin = q * tilt.C, h * tilt.S, tilt.bend
    X, y = _lid_point(n, R, q, h, ring, tilt, depth)
    s1, s2 = n.angle(y, X), n.angle(y / q, (d + X) / p)
    dl = n.angle((y / R) * (d / p + X * thin / (p * q)), X * (d + X) / (p * R) + n.square(y) / (q * R))
    return (q * thin - ring) * _segment(n, s1) + p * q * _segment_difference(n, dl, s1 + s2)


def _rim_point(n: Numbers, R: Any, Rh: Any, h: Any, ring: Any, tilt: Tilt, depth: Any) -> tuple[Any, Any]:
    """Intersection of rim and hole; the discriminant of theory/circle-and-ellipse 4 is ``(S wA / C)^2``."""
    S, C, _ = tilt
    m = depth * (R * C + Rh - h * S) / (S * (h - Rh * S + C * n.root(n.square(h) - ring)))
    m = n.within(m, 2 * Rh)
    return Rh - m, n.root(m * (2 * Rh - m))


def rim_crescent(n: Numbers, R: Any, Rh: Any, h: Any, ring: Any, tilt: Tilt, depth: Any) -> Any:
    """Crescent of the rim outside the hole; ``tilt.bend`` is ``1 - C``."""
    p, d, bend = R * tilt.C, h * tilt.S, tilt.bend
    x, y = _rim_point(n, R, Rh, h, ring, tilt, depth)
    s1, s2 = n.angle(y, x), n.angle(y / R, (x - d) / p)
    dl = n.angle(y * (d - x * bend) / (p * Rh), (x - d) * x / (p * Rh) + n.square(y) / (R * Rh))
    return p * R * _segment_difference(n, dl, s1 + s2) - (R * R * bend + ring) * _segment(n, s1)


def series(x: Array, terms: int) -> Array:
    """``x - sin x`` by its series."""
    square, total = x * x, np.zeros_like(x)
    for coefficient in reversed(COEFFICIENTS[:terms]):
        total = total * square + coefficient
    return np.asarray(total * square * x)


# -- in floats ---------------------------------------------------------------------------------------------------------


def _xms(x: Array) -> Array:
    return np.asarray(np.where(np.abs(x) < _SERIES_BELOW, series(x, _SERIES_TERMS), x - np.sin(x)))


_FLOATS = Numbers(np.sin, np.square, lambda x: np.sqrt(np.maximum(x, 0.0)), np.arctan2, _xms, within=lambda x, top: x)


def ellipse_circle(R1: ArrayLike, a: ArrayLike, b: ArrayLike) -> CrescentAreas:
    """Areas between a centred ellipse (semi-axes a >= b > 0) and a circle of radius R1, direct form.

    See theory/circle-and-ellipse 2.  Loses digits when a, b and R1 nearly agree; `ellipse_circle_stable` does not.
    """
    R1, a, b = _alike(R1=R1, a=a, b=b)
    if not bool(np.all((a >= b) & (b > 0.0) & (R1 > 0.0))):
        raise GeometryError("an ellipse needs semi-axes a >= b > 0 and the circle a radius R1 > 0")
    intersecting = (b < R1) & (a > R1)
    with np.errstate(divide="ignore", invalid="ignore"):
        span = np.where(intersecting, (a - b) * (a + b), 1.0)
        x0 = a * np.sqrt(np.where(intersecting, (R1 - b) * (R1 + b), 0.0) / span)
        y0 = b * np.sqrt(np.where(intersecting, (a - R1) * (a + R1), 0.0) / span)
    ell = 2.0 * (a * b * np.arctan2(a * y0, b * x0) - R1 * R1 * np.arctan2(y0, x0))
    cir = 2.0 * (R1 * R1 * np.arctan2(x0, y0) - a * b * np.arctan2(b * x0, a * y0))
    inside, outside = a <= R1, b >= R1
    ell = np.where(inside, 0.0, np.where(outside, math.pi * (a * b - R1 * R1), ell))
    cir = np.where(inside, math.pi * (R1 * R1 - a * b), np.where(outside, 0.0, cir))
    return CrescentAreas(ell, cir)


def ellipse_circle_stable(R1: ArrayLike, pa: ArrayLike, qb: ArrayLike) -> CrescentAreas:
    """Areas of `ellipse_circle` from the differences ``pa = a - R1`` and ``qb = R1 - b`` (theory/circle-and-ellipse 3).

    Relative error of a few units in the last place down to the thinnest crescents.

    >>> print(f"{ellipse_circle_stable(1.0, 1e-9, 1e-9).ellipse_only.item():.14e}")
    1.99999999842920e-09
    """
    R1, pa, qb = _alike(R1=R1, pa=pa, qb=qb)
    if not bool(np.all((R1 > 0.0) & (qb < R1) & (pa + qb >= 0.0))):
        raise GeometryError("an ellipse needs semi-axes a >= b > 0: qb < R1 and pa + qb >= 0 with R1 > 0")
    a, b = R1 + pa, R1 - qb
    ex = R1 * (qb - pa) + pa * qb  # R1^2 - a b
    intersecting = (pa > 0.0) & (qb > 0.0)
    ell, cir, (sc, se, tc, te) = crescents(
        _FLOATS, R1, a, b, np.where(intersecting, pa, 1.0), np.where(intersecting, qb, 1.0)
    )
    # far from a circle the angles differ so much that the plain difference of the segments loses less
    ell = np.where(2.0 * sc < se, 2.0 * (a * b * _segment(_FLOATS, se) - R1 * R1 * _segment(_FLOATS, sc)), ell)
    cir = np.where(2.0 * te < tc, 2.0 * (R1 * R1 * _segment(_FLOATS, tc) - a * b * _segment(_FLOATS, te)), cir)
    ell = np.where(intersecting, ell, np.where(pa <= 0.0, 0.0, -math.pi * ex))
    cir = np.where(intersecting, cir, np.where(pa <= 0.0, math.pi * ex, 0.0))
    return CrescentAreas(ell, cir)


def _alike(**given: ArrayLike) -> list[Array]:
    """Return arrays of numbers, NaN among them, spread to one shape."""
    arrays = {name: finite_array(name, values, nan=True) for name, values in given.items()}
    try:
        return list(np.broadcast_arrays(*arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise GeometryError(f"the shapes do not fit each other: {shapes}; give as many of each, or one") from None


def _tilts(bearing: Bearing, sine: ArrayLike, cosine: ArrayLike) -> tuple[Array, Array]:
    """Return sine (without sign) and cosine of the tilt, of one shape."""
    if bearing.clearance < 0.0:
        raise GeometryError(
            f"clearance = {bearing.clearance} is negative: an interference fit has no free position to measure an "
            "area from"
        )
    S, C = _alike(sine=sine, cosine=cosine)
    return np.abs(S), C


@checked
def surrogate_areas(bearing: Bearing, sine: ArrayLike, cosine: ArrayLike) -> CrescentAreas:
    """Free gap and interference of the centred surrogate ellipse E4 (theory/circle-and-ellipse 1), mm^2.

    Ellipse ``a = Rh``, ``b = Rh C - h S`` against the disc of radius R.  Where the tilt is so steep that ``b <= 0`` the
    surrogate is not defined: NaN there (use `lid_area`, which is defined everywhere).
    """
    S, C = _tilts(bearing, sine, cosine)
    depth = bearing.interference(S, C, "B")
    defined = depth < bearing.Rb
    areas = ellipse_circle_stable(bearing.Rb, bearing.clearance, np.where(defined, depth, 0.0))
    return CrescentAreas(*(np.where(defined, area, np.nan) for area in areas))


@checked
def lid_area(bearing: Bearing, sine: ArrayLike, cosine: ArrayLike) -> Array:
    """A_lid: disc of radius R outside one lid of the tilted hole (condition B, theory/circle-and-ellipse 4), mm^2.

    Exact closed form in double precision, including the second crescent at very large tilt.  Zero while ``gB <= 0``;
    NaN for NaN.
    """
    S, C = _tilts(bearing, sine, cosine)
    R, Rh, h = bearing.Rb, bearing.Rh, bearing.h
    disc, ring = math.pi * R * R, float(bearing._slack)
    depth, p, d = bearing.interference(S, C, "B"), Rh * C, h * S
    missed = (d - p >= R) | (p <= 0.0)
    area = np.zeros(S.shape)
    for near, side in ((depth, h), (np.asarray(R - d - p), -h)):
        use = (near > 0.0) & ~missed
        tilt = Tilt(S[use], C[use], Rh * S[use] * S[use] / (1.0 + C[use]))
        area[use] += lid_crescent(_FLOATS, R, Rh, side, ring, tilt, near[use])
    return np.asarray(np.where(missed, disc, np.minimum(area, disc)) + 0.0 * (S + C))


@checked
def rim_area(bearing: Bearing, sine: ArrayLike, cosine: ArrayLike) -> tuple[Array, Mask]:
    """A_rim: rim of the tilted bearing outside the disc of radius Rh (condition A, theory/circle-and-ellipse 4), mm^2.

    Zero while ``gA <= 0``.  The second array is True where ``R S > h C``: there the closed form does not hold and the
    area is an adaptive quadrature (estimated relative error 1e-10).
    """
    S, C = _tilts(bearing, sine, cosine)
    R, Rh, h = bearing.Rb, bearing.Rh, bearing.h
    depth, ring = bearing.interference(S, C, "A"), float(bearing._slack)
    steep = h * C < R * S
    area = np.zeros(S.shape)
    p, d = R * C, h * S
    missed = (d - p >= Rh) & ~steep
    area[missed] = math.pi * R * p[missed]
    use = (depth > 0.0) & ~steep & ~missed
    if use.any():
        tilt = Tilt(S[use], C[use], S[use] * S[use] / (1.0 + C[use]))
        area[use] = rim_crescent(_FLOATS, R, Rh, h, ring, tilt, depth[use])
    quadrature = steep & (depth > 0.0)
    for index in np.ndindex(S.shape):
        if quadrature[index]:
            area[index] = _rim_quadrature(R, Rh, float(p[index]), float(d[index]))
    return np.asarray(area + 0.0 * (S + C)), quadrature


@checked
def lid_intersection(bearing: Bearing, sine: ArrayLike, cosine: ArrayLike) -> tuple[Array, Array]:
    """Intersection (u, v) of disc and near side of one lid (condition B, theory/circle-and-ellipse 4), mm.

    Along the tilt and across it; the other one is ``(u, -v)``.  NaN without an intersection.
    """
    S, C = _tilts(bearing, sine, cosine)
    R, Rh, h = bearing.Rb, bearing.Rh, bearing.h
    depth = bearing.interference(S, C, "B")
    there = (depth > 0.0) & (h * S - Rh * C < R) & (C > 0.0)
    with np.errstate(all="ignore"):
        X, y = _lid_point(_FLOATS, R, Rh, h, float(bearing._slack), Tilt(S, C, None), depth)
    return np.where(there, -X, np.nan), np.where(there, y, np.nan)


@checked
def rim_intersection(bearing: Bearing, sine: ArrayLike, cosine: ArrayLike) -> tuple[Array, Array]:
    """Intersection (u, v) of the rim and the hole as in `lid_intersection` (condition A), mm.

    NaN where ``R S > h C`` too.
    """
    S, C = _tilts(bearing, sine, cosine)
    R, Rh, h = bearing.Rb, bearing.Rh, bearing.h
    depth = bearing.interference(S, C, "A")
    there = (depth > 0.0) & (h * C >= R * S) & (h * S - R * C < Rh)
    with np.errstate(all="ignore"):
        x, y = _rim_point(_FLOATS, R, Rh, h, float(bearing._slack), Tilt(S, C, None), depth)
    return np.where(there, x, np.nan), np.where(there, y, np.nan)


def _rim_quadrature(R: float, Rh: float, p: float, d: float) -> float:
    """Ellipse (centre d, semi-axes p along u and R across) minus the disc of radius Rh, by strips across u."""
    from scipy.integrate import quad

    def outside(angle: float) -> float:
        half, y = p * math.cos(angle), R * math.sin(angle)
        reach = math.sqrt(max((Rh - y) * (Rh + y), 0.0))
        overlap = max(0.0, min(d + half, reach) - max(d - half, -reach))
        return (2.0 * half - overlap) * R * math.cos(angle)

    value, _ = quad(outside, 0.0, 0.5 * math.pi, limit=400, epsabs=0.0, epsrel=1e-10)
    return 2.0 * float(value)
