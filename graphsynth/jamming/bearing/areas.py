"""Areas of interference: ellipse against circle, disc against the lid of a tilted hole, rim against the hole.

Square millimetres throughout.  The stable forms take the small differences of the radii instead of the radii, because
subtracting numbers near 17.5 to obtain 0.001 loses every digit of a thin crescent.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Bearing

Array = NDArray[np.float64]

# xms(x) = x - sin x = x^3/3! - x^5/5! + ...; the first term left out is below 1e-17 of the first for |x| < 2.  Direct
# subtraction below 2 loses up to four units in the last place.
_XMS_LIMIT = 2.0
_XMS = [(-1) ** k / math.factorial(2 * k + 3) for k in range(12)]


class CrescentAreas(NamedTuple):
    """``ellipse_only``: ellipse minus circle (free gap); ``circle_only``: circle minus ellipse (interference)."""

    ellipse_only: Array
    circle_only: Array


def _xms(x: Array) -> Array:
    square = x * x
    series = np.zeros_like(x)
    for coefficient in reversed(_XMS):
        series = series * square + coefficient
    return np.asarray(np.where(np.abs(x) < _XMS_LIMIT, series * square * x, x - np.sin(x)))


def _segment(s: Array) -> Array:
    """``s - sin s cos s``, the circular segment of half angle s."""
    return np.asarray(0.5 * _xms(2.0 * s))


def _segment_difference(difference: Array, total: Array) -> Array:
    """``segment(a) - segment(b)`` from ``a - b`` and ``a + b``."""
    return np.asarray(_xms(difference) + 2.0 * np.sin(difference) * np.sin(0.5 * total) ** 2)


def ellipse_circle(R1: ArrayLike, a: ArrayLike, b: ArrayLike) -> CrescentAreas:
    """Areas between a centred ellipse (semi-axes a >= b > 0) and a circle of radius R1, direct form.

    See theory/circle-and-ellipse 2.

    Loses digits when a, b and R1 nearly agree; `ellipse_circle_stable` does not.

    Raises
    ------
    GeometryError
        Unless ``a >= b > 0`` and ``R1 > 0`` everywhere.

    Examples
    --------
    >>> round(ellipse_circle(5.0, 6.0, 4.0).circle_only.item(), 9)
    11.487371022
    """
    R1, a, b = _alike(R1=R1, a=a, b=b)
    if not bool(np.all((a >= b) & (b > 0.0) & (R1 > 0.0))):
        raise GeometryError("an ellipse needs semi-axes a >= b > 0 and the circle a radius R1 > 0")
    crossing = (b < R1) & (a > R1)
    with np.errstate(divide="ignore", invalid="ignore"):
        span = np.where(crossing, (a - b) * (a + b), 1.0)
        x0 = a * np.sqrt(np.where(crossing, (R1 - b) * (R1 + b), 0.0) / span)
        y0 = b * np.sqrt(np.where(crossing, (a - R1) * (a + R1), 0.0) / span)
    ell = 2.0 * (a * b * np.arctan2(a * y0, b * x0) - R1 * R1 * np.arctan2(y0, x0))
    cir = 2.0 * (R1 * R1 * np.arctan2(x0, y0) - a * b * np.arctan2(b * x0, a * y0))
    inside, outside = a <= R1, b >= R1
    ell = np.where(inside, 0.0, np.where(outside, math.pi * (a * b - R1 * R1), ell))
    cir = np.where(inside, math.pi * (R1 * R1 - a * b), np.where(outside, 0.0, cir))
    return CrescentAreas(ell, cir)


def ellipse_circle_stable(R1: ArrayLike, pa: ArrayLike, qb: ArrayLike) -> CrescentAreas:
    """Areas of `ellipse_circle` from the differences ``pa = a - R1`` and ``qb = R1 - b`` (theory/circle-and-ellipse 3).

    Relative error of a few units in the last place down to the thinnest crescents.

    Raises
    ------
    GeometryError
        Semi-axes that make no ellipse within the formula.

    Examples
    --------
    >>> print(f"{ellipse_circle_stable(1.0, 1e-9, 1e-9).ellipse_only.item():.14e}")
    1.99999999842920e-09
    """
    R1, pa, qb = _alike(R1=R1, pa=pa, qb=qb)
    if not bool(np.all((R1 > 0.0) & (qb < R1) & (pa + qb >= 0.0))):
        raise GeometryError("an ellipse needs semi-axes a >= b > 0: qb < R1 and pa + qb >= 0 with R1 > 0")
    a, b = R1 + pa, R1 - qb
    ex = R1 * (qb - pa) + pa * qb  # R1^2 - a b
    crossing = (pa > 0.0) & (qb > 0.0)
    p, q = np.where(crossing, pa, 1.0), np.where(crossing, qb, 1.0)
    x0 = a * np.sqrt(q * (R1 + b) / ((p + q) * (a + b)))
    y0 = b * np.sqrt(p * (a + R1) / ((p + q) * (a + b)))
    dl = np.arctan2((p + q) * x0 * y0, b * x0 * x0 + a * y0 * y0)
    sc, se = np.arctan2(y0, x0), np.arctan2(a * y0, b * x0)
    tc, te = np.arctan2(x0, y0), np.arctan2(b * x0, a * y0)
    ell = 2.0 * (-ex * _segment(sc) + a * b * _segment_difference(dl, sc + se))
    cir = 2.0 * (ex * _segment(tc) + a * b * _segment_difference(dl, tc + te))
    # far from a circle the angles differ so much that the plain difference of the segments loses less
    ell = np.where(2.0 * sc < se, 2.0 * (a * b * _segment(se) - R1 * R1 * _segment(sc)), ell)
    cir = np.where(2.0 * te < tc, 2.0 * (R1 * R1 * _segment(tc) - a * b * _segment(te)), cir)
    ell = np.where(crossing, ell, np.where(pa <= 0.0, 0.0, -math.pi * ex))
    cir = np.where(crossing, cir, np.where(pa <= 0.0, math.pi * ex, 0.0))
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

    Raises
    ------
    GeometryError
        For an interference fit.
    """
    S, C = _tilts(bearing, sine, cosine)
    depth = bearing.interference(S, C, "B")
    defined = depth < bearing.Rb
    areas = ellipse_circle_stable(bearing.Rb, bearing.clearance, np.where(defined, depth, 0.0))
    return CrescentAreas(*(np.where(defined, area, np.nan) for area in areas))


def _lid_point(R: float, Rh: float, ring: float, S: Array, C: Array, depth: Array, h: float) -> tuple[Array, Array]:
    """Distances of the intersections of disc and lid ellipse from the centre, against the tilt and across it.

    The discriminant of theory/circle-and-ellipse 4 simplifies: ``H^2 - k G = (S wB / (C q^2))^2`` with ``wB`` of
    theory/bearing-contact 7, so that the intersection needs neither a division by C nor a subtraction.
    """
    m = depth * (R + h * S + Rh * C) / (S * (R * S + h + C * math.sqrt(h * h + ring)))
    return R - m, np.sqrt(np.maximum(m * (2.0 * R - m), 0.0))


def _lid_side(R: float, Rh: float, ring: float, S: Array, C: Array, depth: Array, h: float) -> Array:
    """Crescent of the disc of radius R outside the lid ellipse, on the side of ``depth > 0``; h < 0 is the far side."""
    p, q, d = Rh * C, Rh, h * S
    X, y = _lid_point(R, Rh, ring, S, C, depth, h)
    s1, s2 = np.arctan2(y, X), np.arctan2(y / q, (d + X) / p)
    thin = q * S * S / (1.0 + C)  # q - p
    dl = np.arctan2((y / R) * (d / p + X * thin / (p * q)), X * (d + X) / (p * R) + y * y / (q * R))
    return np.asarray((q * thin - ring) * _segment(s1) + p * q * _segment_difference(dl, s1 + s2))


@checked
def lid_area(bearing: Bearing, sine: ArrayLike, cosine: ArrayLike) -> Array:
    """A_lid: disc of radius R outside one lid of the tilted hole (condition B, theory/circle-and-ellipse 4), mm^2.

    Exact closed form in double precision, including the second crescent at very large tilt.  Zero while ``gB <= 0``;
    NaN for NaN.

    Raises
    ------
    GeometryError
        For an interference fit.
    """
    S, C = _tilts(bearing, sine, cosine)
    R, Rh, h = bearing.Rb, bearing.Rh, bearing.h
    disc, ring = math.pi * R * R, float(bearing._slack)
    depth, p, d = bearing.interference(S, C, "B"), Rh * C, h * S
    missed = (d - p >= R) | (p <= 0.0)
    area = np.zeros(S.shape)
    for near, side in ((depth, h), (np.asarray(R - d - p), -h)):
        use = (near > 0.0) & ~missed
        area[use] += _lid_side(R, Rh, ring, S[use], C[use], near[use], side)
    return np.asarray(np.where(missed, disc, np.minimum(area, disc)) + 0.0 * (S + C))


@checked
def rim_area(bearing: Bearing, sine: ArrayLike, cosine: ArrayLike) -> tuple[Array, NDArray[np.bool_]]:
    """A_rim: rim of the tilted bearing outside the disc of radius Rh (condition A, theory/circle-and-ellipse 4), mm^2.

    Returns
    -------
    area : ndarray
        Zero while ``gA <= 0``.
    quadrature : ndarray of bool
        True where ``R S > h C``: there the closed form does not hold and the area is an adaptive quadrature
        (estimated relative error 1e-10).

    Raises
    ------
    GeometryError
        For an interference fit.
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
        area[use] = _rim_side(R, Rh, h, ring, S[use], C[use], depth[use])
    quadrature = steep & (depth > 0.0)
    for index in np.ndindex(S.shape):
        if quadrature[index]:
            area[index] = _rim_quadrature(R, Rh, float(p[index]), float(d[index]))
    return np.asarray(area + 0.0 * (S + C)), quadrature


@checked
def lid_intersection(bearing: Bearing, sine: ArrayLike, cosine: ArrayLike) -> tuple[Array, Array]:
    """Intersection of the disc of radius R and the near side of one lid (condition B, theory/circle-and-ellipse 4), mm.

    Returns
    -------
    u, v : ndarray
        Along the tilt and across it; the other one is ``(u, -v)``.  NaN without an intersection.

    Raises
    ------
    GeometryError
        For an interference fit.

    Examples
    --------
    >>> u, v = lid_intersection(Bearing(), 0.01333086429801, 0.99991114008)
    >>> round(float(u), 6), round(float(v), 6)
    (-7.76804, 15.68144)
    """
    S, C = _tilts(bearing, sine, cosine)
    R, Rh, h = bearing.Rb, bearing.Rh, bearing.h
    depth = bearing.interference(S, C, "B")
    there = (depth > 0.0) & (h * S - Rh * C < R) & (C > 0.0)
    with np.errstate(all="ignore"):
        X, y = _lid_point(R, Rh, float(bearing._slack), S, C, depth, h)
    return np.where(there, -X, np.nan), np.where(there, y, np.nan)


@checked
def rim_intersection(bearing: Bearing, sine: ArrayLike, cosine: ArrayLike) -> tuple[Array, Array]:
    """Intersection of the rim of the tilted bearing and the hole (condition A, theory/circle-and-ellipse 4), mm.

    Returns
    -------
    u, v : ndarray
        Along the tilt and across it; the other one is ``(u, -v)``.  NaN without an intersection, and where ``R S > h
        C``.

    Raises
    ------
    GeometryError
        For an interference fit.
    """
    S, C = _tilts(bearing, sine, cosine)
    R, Rh, h = bearing.Rb, bearing.Rh, bearing.h
    depth = bearing.interference(S, C, "A")
    there = (depth > 0.0) & (h * C >= R * S) & (h * S - R * C < Rh)
    with np.errstate(all="ignore"):
        x, y = _rim_point(R, Rh, h, float(bearing._slack), S, C, depth)
    return np.where(there, x, np.nan), np.where(there, y, np.nan)


def _rim_point(R: float, Rh: float, h: float, ring: float, S: Array, C: Array, depth: Array) -> tuple[Array, Array]:
    """Intersection of rim and hole; the discriminant of theory/circle-and-ellipse 4 is ``(S wA / C)^2``."""
    m = depth * (R * C + Rh - h * S) / (S * (h - Rh * S + C * math.sqrt(max(h * h - ring, 0.0))))
    return Rh - m, np.sqrt(np.maximum(m * (2.0 * Rh - m), 0.0))


def _rim_side(R: float, Rh: float, h: float, ring: float, S: Array, C: Array, depth: Array) -> Array:
    """Crescent of the rim outside the hole."""
    p, d = R * C, h * S
    x, y = _rim_point(R, Rh, h, ring, S, C, depth)
    s1, s2 = np.arctan2(y, x), np.arctan2(y / R, (x - d) / p)
    bend = S * S / (1.0 + C)
    dl = np.arctan2(y * (d - x * bend) / (p * Rh), (x - d) * x / (p * Rh) + y * y / (R * Rh))
    difference = -(R * R * bend + ring)  # p R - Rh^2
    return np.asarray(difference * _segment(s1) + p * R * _segment_difference(dl, s1 + s2))


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
