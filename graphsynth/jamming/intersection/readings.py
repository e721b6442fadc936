"""What the source can mean and what it sums up: four readings of "the ellipse", the interval shoelace sum.

The readings are those of theory/circle-and-ellipse 1.  The interval shoelace sum is kept as a warning: its width does
not shrink with finer boxes, because every vertex appears in two products and the dependency error is hundreds of times
the area (theory/circle-and-ellipse 5).
"""

from __future__ import annotations

from enum import Enum
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.intervals.interval import Interval
from graphsynth.jamming.bearing.areas import CrescentAreas, ellipse_circle_stable, lid_area, surrogate_areas
from graphsynth.jamming.bearing.bearing import Bearing
from graphsynth.jamming.intersection.hull import (
    CircleEllipse,
    Exact,
    bearing_radii,
    circle_ellipse,
    exact_range,
    root_bounds,
    surrogate_problem,
)

Array = NDArray[np.float64]


class Reading(Enum):
    """Which ellipse stands for the tilted part, against which circle."""

    #: Projection of the tilted hole centred on the axis, against the bearing.
    IMAGE = "E1"
    #: Section of the tilted bearing, against the hole.
    SECTION = "E2"
    #: Projection of the rim of the tilted hole at one lid, shifted by ``h sin t``, against the bearing.  The default:
    #: the only one whose area is the interference of condition B.
    LID = "E3"
    #: Centred ellipse that touches the near side of the lid, against the bearing: right onset, wrong area.
    SURROGATE = "E4"


class TiltedEllipse(NamedTuple):
    """Ellipse in the plane across the other part's axis, the direction of the tilt first, and its circle; mm."""

    centre: Array
    along: Array
    across: Array
    circle: float


def _tilt(sine: ArrayLike, cosine: ArrayLike) -> tuple[Array, Array]:
    return np.abs(finite_array("sine", sine, nan=True)), finite_array("cosine", cosine, nan=True)


@checked
def reading_ellipse(
    bearing: Bearing, sine: ArrayLike, cosine: ArrayLike, reading: Reading = Reading.LID, lid: int = 1
) -> TiltedEllipse:
    """Return the ellipse of a reading for sine and cosine of the tilt, mm (estimated: floating point).

    ``lid``, +1 or -1, tells at which lid the shift of E3 is ``h sin t``.
    """
    if lid not in (1, -1):
        raise GeometryError(f"lid = {lid!r} must be +1 or -1")
    S, C = _tilt(sine, cosine)
    R, Rh, h = bearing.Rb, bearing.Rh, bearing.h
    zero, one = np.zeros_like(S * C), np.ones_like(S * C)
    if reading is Reading.IMAGE:
        return TiltedEllipse(zero, Rh * C * one, Rh * one, R)
    if reading is Reading.SECTION:
        with np.errstate(divide="ignore"):
            return TiltedEllipse(zero, R / C * one, R * one, Rh)
    if reading is Reading.LID:
        return TiltedEllipse(lid * h * S * one, Rh * C * one, Rh * one, R)
    return TiltedEllipse(zero, Rh * C - h * S, Rh * one, R)


@checked
def reading_areas(
    bearing: Bearing, sine: ArrayLike, cosine: ArrayLike, reading: Reading = Reading.LID
) -> CrescentAreas:
    """Both differences of ellipse and circle for a reading, mm^2; stable closed forms (estimated, not certified).

    For E2 the interference is the ellipse outside the circle, for the others the circle outside the ellipse.  NaN where
    the ellipse does not exist.

    >>> [round(float(a), 12) for a in reading_areas(Bearing(), 0.0, 1.0, Reading.LID)]
    [3.301499719658, 0.0]
    """
    S, C = _tilt(sine, cosine)
    R, Rh, c = bearing.Rb, bearing.Rh, bearing.clearance
    bend, defined = S * S / (1.0 + C), C > 0.0
    if reading is Reading.SURROGATE:
        return surrogate_areas(bearing, S, C)
    if reading is Reading.LID:
        jam = lid_area(bearing, S, C)
        return CrescentAreas(jam + np.pi * (c * (2.0 * R + c) - Rh * Rh * bend), jam)
    if reading is Reading.IMAGE:
        areas = ellipse_circle_stable(R, c, np.where(defined, Rh * bend - c, 0.0))
    else:
        longer = (R * bend - c * C) / np.where(defined, C, 1.0)
        areas = ellipse_circle_stable(Rh, np.where(defined, longer, 0.0), c)
    return CrescentAreas(*(np.where(defined, area, np.nan) for area in areas))


@checked
def reading_problem(
    bearing: Bearing, sine: Any, reading: Reading, e1: Any = 0, e2: Any = 0, *, eps: Any = None
) -> CircleEllipse:
    """Pose the intersection problem for a centred reading (E1, E2 or E4), with x along the long axis.

    The dimensions of the bearing are read as the decimals they print as; e1, e2 and eps are those of `circle_ellipse`.
    Raises `GeometryError` for E3, whose ellipse is not centred, and a tilt at which the ellipse does not exist.
    """
    if reading is Reading.LID:
        raise GeometryError("the ellipse of reading E3 (LID) is not centred; use lid_area, or E4 (SURROGATE)")
    if reading is Reading.SURROGATE:
        return surrogate_problem(bearing, sine, e1, e2, eps=eps)
    low, high = exact_range("sine", sine)
    most = max(abs(low), abs(high))
    least = Fraction(0) if low <= 0 <= high else min(abs(low), abs(high))
    if most >= 1:
        raise GeometryError(f"sine = {float(most)}: the ellipse of {reading.value} exists for |sine| < 1 only")
    cosine = Exact(root_bounds(1 - most * most, 128).lo, root_bounds(1 - least * least, 128).hi)
    R, Rh, _ = bearing_radii(bearing)
    if reading is Reading.IMAGE:
        return circle_ellipse(R, Rh, (Rh * cosine.lo, Rh * cosine.hi), e1, e2, eps=eps)
    return circle_ellipse(Rh, (R / cosine.hi, R / cosine.lo), R, e1, e2, eps=eps)


def crescent_boxes(R1: float, a: float, b: float, count: int = 250) -> Interval:
    """Boxes that tile the boundary of one crescent of the ellipse outside the circle, ``b < R1 < a``, in order.

    Half of them lie on the ellipse, half on the circle: bounding boxes of neighbouring points of the boundary, shape (2
    (count // 2), 2), in double precision: a demonstration, not a certificate.
    """
    points = crescent_points(R1, a, b, count)
    after = np.roll(points, -1, axis=0)
    return Interval.from_bounds(np.minimum(points, after), np.maximum(points, after))


def crescent_points(R1: float, a: float, b: float, count: int) -> Array:
    """Points on the boundary of `crescent_boxes`, counter-clockwise, shape (2 (count // 2), 2)."""
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
    """Half the sum ``x_i y_{i+1} - x_{i+1} y_i`` over a closed chain of boxes (n, 2).

    The signed area of every polygon with one vertex in each box: a true enclosure, and a useless one, see the module.
    """
    x, y = vertices[:, 0], vertices[:, 1]
    after = np.roll(np.arange(len(vertices)), -1)
    twice: Interval = x * y[after] - x[after] * y
    return twice.sum() / 2
