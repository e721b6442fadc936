"""Places and bounds of a task: points, regions, limits of lengths."""

from __future__ import annotations

from collections.abc import Sequence

from graphsynth.core.checks import finite, point, positive
from graphsynth.core.errors import GeometryError

Point = tuple[float, float]
#: x and y of the lower left, then of the upper right corner.
Box = tuple[float, float, float, float]
#: A place that is given, or a region in which it lies.
Place = Point | Box


def box(name: str, given: Box) -> Box:
    """Read a box."""
    try:
        x0, y0, x1, y1 = (finite(f"{name}[{k}]", value) for k, value in enumerate(given))
    except (TypeError, ValueError):
        raise GeometryError(f"{name} = {given!r} must be (x0, y0, x1, y1): two opposite corners") from None
    if not (x0 < x1 and y0 < y1):
        raise GeometryError(f"{name} = {given} must be (x0, y0, x1, y1) with x0 < x1 and y0 < y1")
    return x0, y0, x1, y1


def place(name: str, given: Place) -> Place:
    """Read a point, or a region of four numbers.

    >>> place("pivot", (1, 2)), place("pivot", (0, 0, 1, 2))
    ((1.0, 2.0), (0.0, 0.0, 1.0, 2.0))
    """
    if isinstance(given, Sequence) and len(given) == 4:
        return box(name, given)
    if isinstance(given, Sequence) and len(given) == 3:
        raise GeometryError(f"{name} has three numbers; give two, a place, or four, two corners of a region")
    return point(name, given)


def limits(name: str, given: tuple[float, float]) -> tuple[float, float]:
    """Read the least and the largest of positive numbers."""
    least, most = (positive(f"{name}[{k}]", value) for k, value in enumerate(given))
    if least > most:
        raise GeometryError(
            f"{name} = ({least:g}, {most:g}): the first must not be larger than the second; exchange them"
        )
    return least, most


def outside(p: Point, region: Box) -> tuple[float, float]:
    """How far a point lies outside a box, by x and by y."""
    return max(region[0] - p[0], 0.0, p[0] - region[2]), max(region[1] - p[1], 0.0, p[1] - region[3])


def meet(a: Box, b: Box) -> bool:
    """Whether two boxes have a point in common."""
    return a[0] <= b[2] and b[0] <= a[2] and a[1] <= b[3] and b[1] <= a[3]
