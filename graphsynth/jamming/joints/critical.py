"""Certified range of the critical tilt of a bearing over a box of its dimensions."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction

from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Interval
from graphsynth.jamming.bearing.bearing import Bearing

__all__ = ["critical_range", "pushed"]


def critical_range(
    bearing: Bearing, condition: str, tolerances: tuple[float, float, float, float], nominal: float
) -> tuple[float, float]:
    """Enclose the critical tilt for ``Rb``, ``Hb``, ``clearance``, ``hole_length`` within the tolerances (mm).

    "A" and "B" from their two corners.  A pin in a hole ("general") touches where it would both as a short bearing and
    as a long shaft in that hole, so that its critical tilt is the larger of the two; each is enclosed by itself.
    """
    radius, height, clearance = (
        _around(name, value, tolerance)
        for name, value, tolerance in zip(
            ("Rb", "Hb", "clearance"), (bearing.Rb, bearing.Hb, bearing.clearance), tolerances[:3]
        )
    )
    if condition != "general":
        least, most = _over(radius, height, clearance, condition)
    else:
        assert bearing.hole_length is not None  # checked with the nominal tilt
        hole = _around("hole_length", bearing.hole_length, tolerances[3])
        ends = (_over(radius, height, clearance, "A"), _over(radius, hole, clearance, "B"))
        least, most = (max(pair) for pair in zip(*ends))
    return min(least, nominal), max(most, nominal)


def pushed(bearing: Bearing, offset: float, tolerance: float) -> Bearing:
    """Return a bearing with the clearance that is left beside an axis pushed off the middle, rounded down.

    In the direction of the push both rims reach ``offset`` further, so that all three contact conditions hold with the
    clearance less the offset; in other directions more is left.  Specification, section 9.7, level L2.

    Raises
    ------
    GeometryError
        An offset that is negative or more than the smallest clearance.
    """
    if not 0.0 <= offset < math.inf:
        raise GeometryError(f"radial_offset = {offset} must be a distance of zero or more, in mm; correct the value")
    if offset == 0.0:
        return bearing
    if offset + tolerance > bearing.clearance:
        raise GeometryError(
            f"radial_offset = {offset} mm is more than the smallest clearance, "
            f"{bearing.clearance - tolerance:.9g} mm; the pin cannot be pushed so far"
        )
    exact = Fraction(bearing.clearance) - Fraction(offset)
    left = float(exact)
    return replace(bearing, clearance=left if Fraction(left) <= exact else math.nextafter(left, 0.0))


_Ends = tuple[Fraction, Fraction]


def _over(radius: _Ends, height: _Ends, clearance: _Ends, condition: str) -> tuple[float, float]:
    """Lower bound at the tightest corner, upper bound at the loosest one."""
    sense = 1 if condition == "A" else -1
    least = _tilt(radius[::sense][0], height[1], clearance[0], condition)[0]
    return least, _tilt(radius[::sense][1], height[0], clearance[1], condition)[1]


def _around(name: str, value: float, tolerance: float) -> tuple[Fraction, Fraction]:
    low, high = Fraction(value) - Fraction(tolerance), Fraction(value) + Fraction(tolerance)
    if low < 0 or (name in ("Rb", "hole_length") and low == 0):
        raise GeometryError(f"{name} = {value} mm with tolerance {tolerance} mm reaches {float(low)}; reduce it")
    return low, high


def _tilt(R: Fraction, H: Fraction, c: Fraction, condition: str) -> tuple[float, float]:
    """``2 arctan(c / (h + w))`` of section 4.7; infinite where there is no critical tilt (exact decision)."""
    h = H / 2
    room = h * h - c * (2 * R + c) if condition == "A" else h * h + c * (2 * R + c)
    if condition == "A" and (room <= 0 or h == 0):
        return math.inf, math.inf
    divisor = Interval(h) + Interval(room).sqrt()
    if c == 0:
        return 0.0, 0.0
    q = Interval(c) / divisor
    cube = q * q * q
    # alternating series with falling terms for q <= 1: q - q^3/3 <= arctan q <= q - q^3/3 + q^5/5
    if float(q.hi) <= 1e-3:
        angle = q - cube / 3 + Interval.from_bounds(0.0, 1.0) * (cube * q * q) / 5
    else:
        from graphsynth.intervals import atan

        angle = atan(q)
    return float((2 * angle).lo), float((2 * angle).hi)
