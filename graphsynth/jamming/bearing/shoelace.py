"""The interval shoelace sum of the source, kept as a warning: its width does not shrink with finer boxes.

Specification lambda_and_jamming, section 5.5: every vertex appears in two products, so that the dependency error is
hundreds of times the area.  Use the closed forms of `graphsynth.jamming.bearing.areas_enclosed`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.intervals.interval import Interval

__all__ = ["crescent_boxes", "crescent_points", "interval_shoelace"]

Array = NDArray[np.float64]


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
