"""Areas of interference against the crank angle, enclosed; and what the ordinate of the source's plot was.

The source plots "the part of the ellipse not crossed by the circle" over [90, 450] degrees.  That is the free gap of
the surrogate ellipse, zero where there is no intersection: it jumps at the onset and falls towards the worst pose.  The
true interference, `AreaCurve.lid` and `AreaCurve.rim`, does the opposite.  See theory/circle-and-ellipse 4,
theory/jam-arcs 2.

The interval shoelace sum of the source is kept as a warning: its width does not shrink with finer boxes, because every
vertex appears in two products and the dependency error is hundreds of times the area (theory/circle-and-ellipse 5).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.intervals.guard import check_rounding
from graphsynth.intervals.interval import Interval
from graphsynth.jamming.bearing.areas_enclosed import enclose_lid_area, enclose_rim_area, enclose_surrogate_areas
from graphsynth.jamming.bearing.bearing import Bearing
from graphsynth.mechanism.four_bar import TiltedFourBar

if TYPE_CHECKING:
    import pandas as pd


Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
#: Detail windows of the source, degrees.
ZOOMS = ((90.0, 115.5), (414.0, 450.0))


@dataclass(frozen=True, eq=False)
class AreaCurve:
    """Areas over crank angles; every array and `Interval` has the shape of ``f``.

    Attributes
    ----------
    f : ndarray
        Crank angles, radians.
    sine : Interval
        Sine of the tilt of the coupler, signed (the sign tells the lid).
    lid, rim : Interval
        True one-lid interference for conditions B and A, mm^2; certified for the numbers given.
    surrogate_gap, surrogate_jam : Interval
        Ellipse minus circle and circle minus ellipse of the surrogate E4, mm^2; empty where E4 does not exist.
    crossing : ndarray of bool
        Where circle and ellipse E4 certainly cross.
    rim_closed : ndarray of bool
        Where ``rim`` is the closed form; elsewhere a coarse enclosure (``R S > h C``).
    """

    f: Array
    sine: Interval
    lid: Interval
    rim: Interval
    surrogate_gap: Interval
    surrogate_jam: Interval
    crossing: Mask
    rim_closed: Mask

    @property
    def source_ordinate(self) -> Array:
        """What the source plots, as far as it can be told: the free gap of E4, 0 without an intersection, mm^2."""
        return np.where(self.crossing, self.surrogate_gap.mid, 0.0)

    def to_pandas(self) -> pd.DataFrame:
        """Return bounds of every area as a `pandas.DataFrame` (pandas is imported here); angles in radians."""
        import pandas as pd

        columns: dict[str, Any] = {"f": self.f}
        for name in ("sine", "lid", "rim", "surrogate_gap", "surrogate_jam"):
            bounds: Interval = getattr(self, name)
            columns |= {f"{name}_lo": bounds.lo, f"{name}_hi": bounds.hi}
        columns |= {"source_ordinate": self.source_ordinate, "crossing": self.crossing, "rim_closed": self.rim_closed}
        return pd.DataFrame(columns)


@checked
def enclose_tilt_sine(linkage: TiltedFourBar, f: ArrayLike | Interval) -> Interval:
    """Enclose the sine of the tilt of the coupler, ``A_z / l3``.

    Parameters
    ----------
    linkage : TiltedFourBar
        With ``rod="rigid"``; its numbers are taken as the doubles that they are.
    f : array_like or Interval
        Crank angles, radians.

    Raises
    ------
    GeometryError
        For ``rod="deck"``, which is no rigid body.

    Notes
    -----
    See theory/four-bar-and-tilt 5 to 8.  Certified; a pin that rises above l3 gives a sine beyond 1.

    Examples
    --------
    >>> float(enclose_tilt_sine(TiltedFourBar(alpha=1 / 30), np.pi / 2).width) < 1e-16
    True
    """
    from graphsynth.intervals import functions

    if linkage.rod != "rigid":
        raise GeometryError('enclose_tilt_sine holds for rod="rigid" only; the deck rod is not a rigid body')
    check_rounding()
    angle = f if isinstance(f, Interval) else _points(f)
    axis = [Interval.from_bounds(n, n) for n in linkage.axis]  # of length 1 up to rounding only
    length = (axis[0].sqr() + axis[1].sqr() + axis[2].sqr()).sqrt()
    n1, n2, n3 = (part / length for part in axis)
    alpha = Interval.from_bounds(linkage._angle, linkage._angle)
    s, v = functions.sin(alpha), 2 * functions.sin(alpha / 2).sqr()
    height = (n1 * n3 * v - n2 * s) * functions.cos(angle) + (n2 * n3 * v + n1 * s) * functions.sin(angle)
    ratio = Interval.from_bounds(linkage.l2, linkage.l2) / Interval.from_bounds(linkage.l3, linkage.l3)
    sine: Interval = height * ratio
    return sine


def _points(f: ArrayLike) -> Interval:
    angles = finite_array("f", f)
    return Interval.from_bounds(angles, angles)


@checked
def area_curve(
    linkage: TiltedFourBar | None = None, bearing: Bearing | None = None, f: ArrayLike | None = None
) -> AreaCurve:
    """Enclose all areas over crank angles.

    Parameters
    ----------
    linkage : TiltedFourBar, optional
        Defaults to the source: its lengths, ``alpha = 1/30`` about x.
    bearing : Bearing, optional
        Its dimensions are read as the decimals they print as.
    f : array_like, optional
        Crank angles, radians; the source's [90, 450] degrees in half degrees by default.

    Returns
    -------
    AreaCurve
        Certified.

    Raises
    ------
    GeometryError
        For an interference fit, the non-rigid rod, and angles at which the crank pin rises above l3.

    Examples
    --------
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
    crossing = (used.lo > 0.0) & (c.lo > 0.0) & ~gap.is_empty
    return AreaCurve(angles, sine, enclose_lid_area(R, c, h, sine), rim, gap, jam, np.asarray(crossing), closed)


def crescent_boxes(R1: float, a: float, b: float, count: int = 250) -> Interval:
    """Boxes that tile the boundary of one crescent of the ellipse outside the circle, in order.

    Parameters
    ----------
    R1, a, b : float
        Radius and semi-axes, ``b < R1 < a``.
    count : int
        Number of boxes, at least 4; half on the ellipse, half on the circle.

    Returns
    -------
    Interval, shape (2 * (count // 2), 2)
        Bounding boxes of neighbouring points of the boundary (in double precision: a demonstration, not a certificate).

    Raises
    ------
    GeometryError
        Unless ``0 < b < R1 < a``, and for fewer than 4 boxes.

    Examples
    --------
    >>> crescent_boxes(5.0, 6.0, 4.0, 8).shape
    (8, 2)
    """
    points = crescent_points(R1, a, b, count)
    after = np.roll(points, -1, axis=0)
    return Interval.from_bounds(np.minimum(points, after), np.maximum(points, after))


def crescent_points(R1: float, a: float, b: float, count: int) -> Array:
    """Points on the boundary of one crescent of the ellipse outside the circle, counter-clockwise.

    Parameters and errors as for `crescent_boxes`.

    Returns
    -------
    ndarray, shape (2 * (count // 2), 2)

    Raises
    ------
    GeometryError
        Axes that make no crescent, or fewer than 4 boxes.
    """
    if not 0.0 < b < R1 < a:
        raise GeometryError(f"b = {b}, R1 = {R1}, a = {a}: a crescent needs 0 < b < R1 < a")
    if count < 4:
        raise GeometryError(f"count = {count} is too small; give at least 4 boxes")
    x0 = a * np.sqrt((R1 - b) * (R1 + b) / ((a - b) * (a + b)))
    y0 = b * np.sqrt((a - R1) * (a + R1) / ((a - b) * (a + b)))
    sweep = np.linspace(-1.0, 1.0, count // 2 + 1)
    outer, inner = np.arctan2(y0 / b, x0 / a) * sweep, np.arctan2(y0, x0) * sweep[::-1]
    ellipse = np.column_stack([a * np.cos(outer), b * np.sin(outer)])
    circle = R1 * np.column_stack([np.cos(inner), np.sin(inner)])
    return np.concatenate([ellipse[:-1], circle[:-1]])


def interval_shoelace(vertices: Interval) -> Interval:
    """Half the sum ``x_i y_{i+1} - x_{i+1} y_i`` over a closed chain of boxes.

    Parameters
    ----------
    vertices : Interval, shape (n, 2)

    Returns
    -------
    Interval
        Signed area of every polygon with one vertex in each box.  A true enclosure, and a useless one: see the module.

    Examples
    --------
    >>> interval_shoelace(Interval([[0, 0], [2, 0], [2, 1]]))
    Interval([1, 1])
    """
    x, y = vertices[:, 0], vertices[:, 1]
    after = np.roll(np.arange(len(vertices)), -1)
    twice: Interval = x * y[after] - x[after] * y
    return twice.sum() / 2
