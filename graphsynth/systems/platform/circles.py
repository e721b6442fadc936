"""The circles that bound the workspace of a leg at a fixed orientation, and how two circles meet."""

from __future__ import annotations

import cmath
import math
from typing import NamedTuple

from graphsynth.core.checks import checked
from graphsynth.systems.platform.parallel_platform import ParallelPlatform

__all__ = ["BoundaryCircle", "Limits", "Meeting", "leg_circles", "meet"]

#: Range (low, high) of a rocker angle in radians; None for no limit.
Limits = tuple[float, float] | None


class BoundaryCircle(NamedTuple):
    """One circle that bounds the reach of a leg.

    ``leg`` is 1 to 3; ``side`` is "outer" (leg stretched), "inner" (leg folded), "lower limit" or "upper limit"
    (rocker at a joint limit).  ``sense`` is +1 if the allowed side is inside the circle, -1 if outside.  ``angle`` is
    the rocker angle of a limit, NaN for the others.
    """

    leg: int
    side: str
    centre: complex
    radius: float
    sense: int
    angle: float = math.nan


class Meeting(NamedTuple):
    """Common points of two circles; ``kind`` is "apart", "crossing", "tangent" or "coincident"."""

    kind: str
    points: tuple[complex, ...]


@checked
def leg_circles(
    platform: ParallelPlatform, alpha: float, sigma: tuple[int, ...] | None, limits: tuple[Limits, ...]
) -> list[BoundaryCircle]:
    """Circles of all legs at orientation ``alpha``; circles of radius zero bound nothing and are left out.

    A rocker at a limit fixes its joint A, so the platform vertex then moves on a circle of radius l2 about A.  Going
    outward on it changes theta by the sign of ``-sigma``, which gives the allowed side.
    """
    z = cmath.exp(1j * alpha)
    found = []
    for k in range(3):
        l1, l2, centre = platform.l1[k], platform.l2[k], platform.D[k] - z * platform.b[k]
        found.append(BoundaryCircle(k + 1, "outer", centre, l1 + l2, 1))
        if l1 != l2:
            found.append(BoundaryCircle(k + 1, "inner", centre, abs(l1 - l2), -1))
        bounds = limits[k]
        if bounds is not None and sigma is not None:
            for side, angle, sense in (("lower limit", bounds[0], sigma[k]), ("upper limit", bounds[1], -sigma[k])):
                found.append(BoundaryCircle(k + 1, side, centre + l1 * cmath.exp(1j * angle), l2, sense, angle))
    return found


def meet(a: BoundaryCircle, b: BoundaryCircle, tolerance: float) -> Meeting:
    """Return the common points of two circles; closer than ``tolerance`` (a length) counts as tangent or coincident."""
    gap = b.centre - a.centre
    d, total, difference = abs(gap), a.radius + b.radius, a.radius - b.radius
    if d <= tolerance and abs(difference) <= tolerance:
        return Meeting("coincident", ())
    if d == 0.0:
        return Meeting("apart", ())
    unit = gap / d
    if abs(d - total) <= tolerance:
        return Meeting("tangent", (a.centre + a.radius * unit,))
    if abs(d - abs(difference)) <= tolerance:
        larger = a if difference > 0.0 else b
        return Meeting("tangent", (larger.centre + larger.radius * (unit if difference > 0.0 else -unit),))
    if d > total or d < abs(difference):
        return Meeting("apart", ())
    along = 0.5 * (d + difference * total / d)
    across = math.sqrt((total - d) * (total + d) * (d - difference) * (d + difference)) / (2.0 * d)
    return Meeting("crossing", (a.centre + unit * (along + 1j * across), a.centre + unit * (along - 1j * across)))
