"""Areas of interference enclosed: over ranges of the parameters, and against the crank angle.

The closed forms of `graphsynth.jamming.bearing.areas` in interval arithmetic.  Each area is evaluated at the two
corners of the ranges at which it is smallest and largest, so that wide ranges of tilt, height and clearance give their
exact range up to rounding; the radius of the bearing is carried as it is.  Why the areas are monotone:
``docs/theory/circle-and-ellipse.md``.  See theory/circle-and-ellipse 2 to 5, theory/jam-arcs 2.

The source plots "the part of the ellipse not crossed by the circle" over [90, 450] degrees.  That is the free gap of
the surrogate ellipse, zero where there is no intersection: it jumps at the onset and falls towards the worst pose.  The
true interference, `AreaCurve.lid` and `AreaCurve.rim`, does the opposite.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.intervals.guard import check_rounding
from graphsynth.intervals.interval import Interval, _make
from graphsynth.jamming.bearing.areas import (
    COEFFICIENTS,
    CrescentAreas,
    Numbers,
    Tilt,
    crescents,
    lid_crescent,
    rim_crescent,
    series,
)
from graphsynth.jamming.bearing.bearing import Bearing
from graphsynth.mechanism.four_bar import TiltedFourBar

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
#: Detail windows of the source, degrees.
ZOOMS = ((90.0, 115.5), (414.0, 450.0))
#: With 13 terms of the series what is left out is below 1e-30 of the first for |x| <= 1, and the relative error in
#: double precision below 6 units of 2^-53: each partial sum is dominated 19 to 1 by its first term, so that errors of
#: later ones fade (proof in docs/theory/circle-and-ellipse.md).
_SERIES_ERROR = 8.0 * 2.0**-53


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


def _xms_enclosed(x: Interval) -> Interval:
    """Enclose ``x - sin x``, which never falls: at both ends, by its series or directly."""
    from graphsynth.intervals import functions

    ends = np.stack([x.lo, x.hi])
    small = np.abs(ends) <= 1.0
    value = series(np.where(small, ends, 0.0), len(COEFFICIENTS))
    margin = _SERIES_ERROR * np.abs(value) + 1e-300
    lo, hi = value - margin, value + margin
    if not small.all():
        direct = _point(np.where(small, 0.0, ends))
        direct = direct - functions.sin(direct)
        lo, hi = np.where(small, lo, direct.lo), np.where(small, hi, direct.hi)
    zero = ends == 0.0
    return _bounds(np.where(zero, 0.0, lo)[0], np.where(zero, 0.0, hi)[1])


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


@cache
def _intervals() -> Numbers:
    from graphsynth.intervals import functions

    def angle(y: Interval, x: Interval) -> Interval:
        """Enclose the angle of the points (x, y); [-pi, pi] at the origin alone, where nothing is known."""
        found = functions.atan2(y, x)
        return _choose(found.is_empty, _pi().hull(-_pi()), found)

    def within(x: Interval, top: Interval) -> Interval:
        return _limited(_choose(x.is_empty, _bounds(0.0, np.inf), x), top)

    return Numbers(functions.sin, Interval.sqr, _root, angle, _xms_enclosed, within)


def _root(x: Interval) -> Interval:
    return _nonnegative(x).sqrt()


def _pi() -> Interval:
    from graphsynth.intervals.kernels.double_double import PI

    return _bounds(*PI)


def enclose_crescents(R1: Any, pa: Any, qb: Any) -> CrescentAreas:
    """Enclose the areas between a circle and a centred ellipse from ``pa = a - R1`` and ``qb = R1 - b`` (certified).

    Exact up to rounding for a point R1; for a range of R1 an enclosure.  Raises `GeometryError` unless ``R1 > 0``,
    ``qb < R1`` and ``pa + qb >= 0`` throughout.

    >>> found = enclose_crescents(1, "1e-9", "1e-9")
    >>> found.ellipse_only.contains("1.999999998429203672788436714e-9"), bool(found.ellipse_only.width < 1e-22)
    (True, True)
    """
    R1, pa, qb = _ranges(R1=R1, pa=pa, qb=qb)
    if not bool(((R1.lo > 0.0) & (qb.hi < R1.lo) & ((pa + qb).hi >= 0.0)).all()):
        raise GeometryError("an ellipse needs semi-axes a >= b > 0: qb < R1 and pa + qb >= 0 with R1 > 0")
    ell, cir = _crescents_at(_twice(R1), _point(np.stack([pa.lo, pa.hi])), _point(np.stack([qb.hi, qb.lo])))
    return CrescentAreas(_bounds(ell.lo[0], ell.hi[1]), _bounds(cir.lo[1], cir.hi[0]))


def _crescents_at(R1: Interval, pa: Interval, qb: Interval) -> CrescentAreas:
    """theory/circle-and-ellipse 3 with its branches; ``pa`` is a point, ``qb`` a point or narrow."""
    ex = R1 * (qb - pa) + pa * qb
    intersecting = (pa.hi > 0.0) & (qb.hi > 0.0)
    one = Interval(1)
    p, q = _choose(intersecting, pa, one), _choose(intersecting, _nonnegative(qb), one)
    b = R1 - _choose(intersecting, q, qb)
    ell, cir, _ = crescents(_intervals(), R1, R1 + p, _choose(b.lo > 0.0, b, one), p, q)
    nothing, inside = Interval.zeros(ell.shape), pa.hi <= 0.0
    whole = _pi() * ex
    maybe = intersecting & (qb.lo <= 0.0)  # touching cannot be excluded: both branches
    ell = _choose(maybe, ell.hull(-whole), ell)
    cir = _choose(maybe, cir.hull(nothing), cir)
    ell = _choose(intersecting, _nonnegative(ell), _choose(inside, nothing, _nonnegative(-whole)))
    cir = _choose(intersecting, _nonnegative(cir), _choose(inside, _nonnegative(whole), nothing))
    return CrescentAreas(ell, cir)


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


def _tilt(S: Interval) -> Tilt:
    C = _root((1 - S) * (1 + S))
    return Tilt(S, C, S.sqr() / (1 + C))


def enclose_surrogate_areas(R: Any, clearance: Any, h: Any, sine: Any) -> CrescentAreas:
    """Enclose the free gap and the interference of the surrogate ellipse E4 over ranges of the parameters (certified).

    R, clearance and half height h in mm, sine of the tilt.  Empty where the ellipse does not exist for any value (``b
    <= 0``), [0, inf] where it may not.
    """
    R, c, h, S = _bearing_ranges(R, clearance, h, sine)
    pairs = ((c.lo, c.hi), (h.hi, h.lo), (S.hi, S.lo))  # the tight corner, the free corner
    R2, c2, h2, S2 = _twice(R), *(_point(np.stack(pair)) for pair in pairs)
    depth = h2 * S2 - c2 + (R2 + c2) * _tilt(S2).bend
    areas = _crescents_at(R2, c2, _choose(depth.hi < R2.lo, depth, Interval(0)))
    never, maybe = depth.lo[1] >= R.hi, depth.hi[0] >= R.lo
    any_area = _bounds(0.0, np.inf)
    both = []
    for area, low, high in ((areas.ellipse_only, 0, 1), (areas.circle_only, 1, 0)):
        found = _bounds(np.minimum(area.lo[low], area.hi[high]), area.hi[high])
        both.append(_choose(never, Interval.empty(), _choose(maybe, any_area, found)))
    return CrescentAreas(*both)


def enclose_lid_area(R: Any, clearance: Any, h: Any, sine: Any) -> Interval:
    """Enclose A_lid, the disc of radius R outside one lid of the tilted hole (condition B), mm^2 (certified).

    The exact range up to rounding: the area grows with R, h and the tilt, and falls with the clearance.
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


def _lid_side(R: Interval, c: Interval, h: Interval, tilt: Tilt, depth: Interval) -> Interval:
    """One crescent; zero where ``depth <= 0``."""
    q, ring = R + c, c * (2 * R + c)
    S, C, bend = (_choose((tilt.S.lo > 0.0) & (tilt.C.lo > 0.0), part, Interval(1)) for part in tilt)
    return _known(lid_crescent(_intervals(), R, q, h, ring, Tilt(S, C, q * bend), _nonnegative(depth)), depth)


def _known(area: Interval, depth: Interval) -> Interval:
    """Zero where ``depth <= 0``; at least the hull with it where that may be."""
    area = _bounds(np.where(depth.lo > 0.0, area.lo, np.minimum(area.lo, 0.0)), area.hi)
    return _choose(depth.hi > 0.0, area, Interval.zeros(area.shape))


def enclose_rim_area(R: Any, clearance: Any, h: Any, sine: Any) -> tuple[Interval, Mask]:
    """Enclose A_rim, the rim of the tilted bearing outside the disc of radius Rh (condition A), mm^2 (certified).

    Exact up to rounding for a point R while ``(h S)^2 <= c (2 R + c)``.  False where ``R S > h C`` is possible: the
    closed form does not hold there, and the area is only enclosed by the whole rim.
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
    tilt = Tilt(*(_choose(usable, part, one) for part in full))
    Rh, ring, p, d = R + c, c * (2 * R + c), R * tilt.C, h * tilt.S
    area = rim_crescent(_intervals(), R, Rh, h, ring, tilt, _nonnegative(depth))
    whole = _pi() * p * R
    beyond = d - p - Rh
    area = _choose(beyond.lo >= 0.0, whole, _choose(beyond.hi >= 0.0, area.hull(whole), area))
    possible = _choose(usable, _known(area, depth), (_pi() * R.sqr()).hull(Interval(0)))
    return _choose(depth.hi > 0.0, possible, Interval.zeros(area.shape))


@dataclass(frozen=True, eq=False)
class AreaCurve:
    """Areas over crank angles ``f`` (radians); every array and `Interval` has the shape of ``f``.

    ``sine``: of the tilt of the coupler, signed (the sign tells the lid).  ``lid`` and ``rim``: true one-lid
    interference for conditions B and A, mm^2; certified for the numbers given.  ``surrogate_gap`` and
    ``surrogate_jam``: ellipse minus circle and circle minus ellipse of the surrogate E4, mm^2; empty where E4 does not
    exist.  ``intersecting``: where circle and ellipse E4 certainly intersect.  ``rim_closed``: where ``rim`` is the
    closed form; elsewhere it is a coarse enclosure (``R S > h C``).
    """

    f: Array
    sine: Interval
    lid: Interval
    rim: Interval
    surrogate_gap: Interval
    surrogate_jam: Interval
    intersecting: Mask
    rim_closed: Mask

    @property
    def source_ordinate(self) -> Array:
        """What the source plots, as far as it can be told: the free gap of E4, 0 without an intersection, mm^2."""
        return np.where(self.intersecting, self.surrogate_gap.mid, 0.0)

    def to_pandas(self) -> pd.DataFrame:
        """Return bounds of every area as a `pandas.DataFrame` (pandas is imported here); angles in radians."""
        import pandas as pd

        columns: dict[str, Any] = {"f": self.f}
        for name in ("sine", "lid", "rim", "surrogate_gap", "surrogate_jam"):
            bounds: Interval = getattr(self, name)
            columns |= {f"{name}_lo": bounds.lo, f"{name}_hi": bounds.hi}
        flags = ("source_ordinate", "intersecting", "rim_closed")
        return pd.DataFrame(columns | {name: getattr(self, name) for name in flags})


@checked
def enclose_tilt_sine(linkage: TiltedFourBar, f: ArrayLike | Interval) -> Interval:
    """Enclose the sine of the tilt of the coupler, ``A_z / l3``, at crank angles (radians) or over intervals of them.

    The numbers of the linkage are taken as the doubles that they are; a pin that rises above l3 gives a sine beyond 1.
    See theory/four-bar-and-tilt 5 to 8.  Raises `GeometryError` for ``rod="deck"``, which is no rigid body.
    """
    from graphsynth.intervals import functions

    if linkage.rod != "rigid":
        raise GeometryError('enclose_tilt_sine holds for rod="rigid" only; the deck rod is not a rigid body')
    check_rounding()
    angle = f if isinstance(f, Interval) else _point(finite_array("f", f))
    axis = [Interval(n) for n in linkage.axis]  # of length 1 up to rounding only
    length = (axis[0].sqr() + axis[1].sqr() + axis[2].sqr()).sqrt()
    n1, n2, n3 = (part / length for part in axis)
    alpha = Interval(linkage._angle)
    s, v = functions.sin(alpha), 2 * functions.sin(alpha / 2).sqr()
    height = (n1 * n3 * v - n2 * s) * functions.cos(angle) + (n2 * n3 * v + n1 * s) * functions.sin(angle)
    return height * (Interval(linkage.l2) / Interval(linkage.l3))


@checked
def area_curve(
    linkage: TiltedFourBar | None = None, bearing: Bearing | None = None, f: ArrayLike | None = None
) -> AreaCurve:
    """Enclose all areas over crank angles (certified); without arguments those of the source in half degrees.

    The dimensions of the bearing are read as the decimals they print as.  Raises `GeometryError` for an interference
    fit, the non-rigid rod, and angles at which the crank pin rises above l3.

    >>> curve = area_curve(f=np.radians([90.0, 180.0]))
    >>> np.round(curve.lid.mid, 9).tolist(), np.round(curve.source_ordinate, 9).tolist()
    ([0.966036031, 0.0], [0.974968365, 0.0])
    """
    linkage = TiltedFourBar(alpha=1 / 30) if linkage is None else linkage
    bearing = Bearing() if bearing is None else bearing
    angles = np.radians(np.linspace(90.0, 450.0, 721)) if f is None else np.atleast_1d(finite_array("f", f))
    sine = enclose_tilt_sine(linkage, angles)
    if bool((abs(sine).hi > 1.0).any()):
        place = np.degrees(angles.ravel()[abs(sine).hi.ravel().argmax()])
        raise GeometryError(
            f"the crank pin rises above l3 at {place:.6g} degrees: the linkage cannot be assembled there; "
            "reduce alpha or leave the angle out"
        )
    R, c, height = (Interval(repr(v)) for v in (bearing.Rb, bearing.clearance, bearing.Hb))
    h = height / 2
    rim, closed = enclose_rim_area(R, c, h, sine)
    gap, jam = enclose_surrogate_areas(R, c, h, sine)
    size = abs(sine)
    cosine = ((1 - size) * (1 + size)).sqrt()
    used = h * size - c + (R + c) * size.sqr() / (1 + cosine)
    intersecting = (used.lo > 0.0) & (c.lo > 0.0) & ~gap.is_empty
    return AreaCurve(angles, sine, enclose_lid_area(R, c, h, sine), rim, gap, jam, np.asarray(intersecting), closed)
