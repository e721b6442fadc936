"""Corners of the boxes of the misalignments: where the factor is largest over all of them.

The factor on limits and plays is a seminorm of the misalignments together (a maximum of linear functions of them).  Its
largest value over a set is that over the corners of any polygon around the set, and of one misalignment alone only the
largest ``|alpha|`` counts.  An arc of radius A lies in the polygon with corners at the radius ``A / cos(delta / 2)``,
delta apart.  So "up to alpha, in any direction" needs a dozen corners instead of one wide box.
Specification, sections 9.3 and 10.2.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise, product

from graphsynth.jamming.joints.closure import Layout
from graphsynth.jamming.joints.limits import Misalignment

__all__ = ["corner_layouts"]

#: Widest angle between two corners (the polygon is 0.9 % larger than the circle), most corners, largest radius.
_APART, _MOST, _LARGEST = 0.2618, 64, 0.49


def corner_layouts(layout: Layout) -> tuple[Layout, ...]:
    """Return layouts whose sharp misalignments are the corners; the layout itself where there would be too many.

    For any positions and limits, the largest factor over the boxes of alpha and direction is at most the largest one of
    the layouts returned (certified: the polygons are rounded outward).
    """
    tilts = [tilt for _, _, tilt in layout.misalignments]
    if all(tilt.alpha_range == (tilt.alpha,) * 2 and tilt.direction_range == (tilt.direction,) * 2 for tilt in tilts):
        return (layout,)
    if max((abs(bound) for tilt in tilts for bound in _alphas(tilt)), default=0.0) > _LARGEST:
        return (layout,)
    choices = [_around(tilt, alone=len(tilts) == 1) for tilt in tilts]
    if math.prod(len(corners) for corners in choices) > _MOST:
        return (layout,)
    places = [(place, sign) for place, sign, _ in layout.misalignments]
    return tuple(
        replace(layout, misalignments=tuple((*place, tilt) for place, tilt in zip(places, chosen)))
        for chosen in product(*choices)
    )


def _alphas(tilt: Misalignment) -> tuple[float, float]:
    assert tilt.alpha_range is not None  # filled when made
    return tilt.alpha_range


def _around(tilt: Misalignment, *, alone: bool) -> list[Misalignment]:
    """Corners of a polygon around all ``alpha (cos, sin)(direction)`` of a box; for one alone, up to a factor <= 1."""
    assert tilt.direction_range is not None
    (least, most), (first, last) = _alphas(tilt), tilt.direction_range
    largest = max(abs(least), abs(most))
    if last - first >= math.pi:
        # opposite corners count alike for one alone; for several the whole circle is needed
        turn = math.pi if alone else math.tau
        count = math.ceil(turn / _APART)
        angles = [turn * k / count for k in range(count)]
        return _corners(tilt, largest, angles, turn / count)
    if first == last:
        ends = {largest} if alone else {least, most}
        return _corners(tilt, 1.0, [first], 0.0, sorted(ends))
    steps = max(1, math.ceil((last - first) / _APART))
    angles = [first, *(first + (last - first) * k / steps for k in range(1, steps)), last]
    apart = max(b - a for a, b in pairwise(angles))
    if alone:
        return _corners(tilt, largest, angles, apart)
    outer, inner = (most, least) if abs(most) >= abs(least) else (least, most)
    found = _corners(tilt, outer, angles, apart)
    if least < 0.0 < most:  # the opposite sector too; between the two lies all the rest
        return found + _corners(tilt, inner, angles, apart)
    return found + [_sharp(tilt, inner, angle) for angle in (first, last)]


def _corners(
    tilt: Misalignment, radius: float, angles: list[float], apart: float, lengths: list[float] | None = None
) -> list[Misalignment]:
    # both factors are rounding allowances: angles are off by some ulps, the cosine by one
    grow = (1.0 + 1e-13) / math.cos(0.5 * apart * (1.0 + 1e-12) + 1e-14) if apart > 0.0 else 1.0
    return [_sharp(tilt, radius * own * grow, angle) for own in lengths or [1.0] for angle in angles]


def _sharp(tilt: Misalignment, alpha: float, direction: float) -> Misalignment:
    return Misalignment(tilt.base, tilt.link, alpha, direction, tilt.rigid)
