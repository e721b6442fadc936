"""Ranges of rational numbers: input without rounding, square roots with rounding outward."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any, NamedTuple

from graphsynth.intervals.interval import Interval
from graphsynth.intervals.reading import lower_bound, upper_bound
from graphsynth.jamming.bearing import ranges

__all__ = ["Range", "exact_range", "outward", "root_bounds"]


class Range(NamedTuple):
    """A closed range of numbers with rational ends; a point if they are equal."""

    lo: Fraction
    hi: Fraction

    @property
    def is_point(self) -> bool:
        """Whether it holds one number only."""
        return self.lo == self.hi

    def outward(self) -> Interval:
        """Enclose in an interval of doubles."""
        return outward(self.lo, self.hi)


def outward(lo: Fraction, hi: Fraction) -> Interval:
    """Return the tightest interval of doubles around two rational numbers."""
    return Interval.from_bounds(lower_bound(lo) + 0.0, upper_bound(hi) + 0.0)  # no negative zero


def exact_range(name: str, value: Any) -> Range:
    """Read a number or a range without rounding.

    Parameters
    ----------
    name : str
        For the message.
    value : int, Fraction, Decimal, float, str, Interval or pair
        A float is the binary number it is.  Text: ``"17.53"``, ``"1/30"``, ``"[17.4, 17.6]"``, ``"17.5 +- 0.005"``.

    Raises
    ------
    GeometryError
        For what is no finite real number, and for reversed bounds.

    Examples
    --------
    >>> exact_range("c", "0.03").lo
    Fraction(3, 100)
    """
    if isinstance(value, Range):
        return value
    if isinstance(value, Fraction):  # also beyond the range of doubles: units far from 1
        return Range(value, value)
    found = ranges.Range.read(name, value)
    return Range(found.lower, found.upper)


def root_bounds(value: Fraction, bits: int = 64) -> Range:
    """Enclose the square root of ``value >= 0`` in rational numbers, to ``bits`` significant bits; exact if rational.

    Examples
    --------
    >>> root_bounds(Fraction(9, 4)).is_point, float(root_bounds(Fraction(2)).lo)
    (True, 1.4142135623730951)
    """
    if value == 0:
        return Range(Fraction(0), Fraction(0))
    size = value.numerator.bit_length() - value.denominator.bit_length()
    shift = bits - size // 2  # value 4^shift has about 2 bits digits
    up, down = max(2 * shift, 0), max(-2 * shift, 0)
    whole, rest = divmod(value.numerator << up, value.denominator << down)
    root = math.isqrt(whole)
    exact = rest == 0 and root * root == whole
    unit = Fraction(1, 1 << shift) if shift >= 0 else Fraction(1 << -shift)
    if exact:
        return Range(root * unit, root * unit)
    perfect = math.isqrt(value.numerator), math.isqrt(value.denominator)
    if perfect[0] ** 2 == value.numerator and perfect[1] ** 2 == value.denominator:
        return Range(Fraction(*perfect), Fraction(*perfect))
    return Range(root * unit, (root + 1) * unit)
