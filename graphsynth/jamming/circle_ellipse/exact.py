"""Ranges of rational numbers: input without rounding, square roots with rounding outward."""

from __future__ import annotations

import math
import re
from decimal import Decimal
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from graphsynth.errors import GeometryError
from graphsynth.intervals.interval import Interval
from graphsynth.intervals.reading import lower_bound, upper_bound

__all__ = ["Range", "exact_range", "outward", "root_bounds"]

_PAIR = re.compile(r"\s*\[\s*([^,\]]+?)\s*,\s*([^,\]]+?)\s*\]\s*")
_SPREAD = re.compile(r"\s*(\S+)\s*(?:\+-|\+/-|±)\s*(\S+)\s*")
_NUMBER = re.compile(r"\s*[+-]?[0-9.]{1,400}(?:[eE][+-]?[0-9]{1,3})?(?:/[0-9]{1,400})?\s*")


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


def _rational(name: str, text: str) -> Fraction:
    if _NUMBER.fullmatch(text):
        try:
            return Fraction(text.strip())
        except (ValueError, ZeroDivisionError):
            pass
    raise GeometryError(
        f"{name} = {text[:60]!r} is not a number; write a decimal such as 0.03, a fraction such as 1/30, "
        "a pair [17.4, 17.6] or a spread 17.5 +- 0.005"
    )


def _ends(name: str, value: Any) -> tuple[Fraction, Fraction]:
    if isinstance(value, Range):
        return value
    if isinstance(value, Interval):
        if value.ndim or not value.is_bounded.all():
            raise GeometryError(f"{name} = {value!r} is not one bounded interval; give one")
        return Fraction(value.lo.item()), Fraction(value.hi.item())
    if isinstance(value, str):
        if pair := _PAIR.fullmatch(value):
            return _rational(name, pair[1]), _rational(name, pair[2])
        if spread := _SPREAD.fullmatch(value):
            middle, radius = _rational(name, spread[1]), _rational(name, spread[2])
            return middle - radius, middle + radius
        point = _rational(name, value)
        return point, point
    if isinstance(value, tuple | list) and len(value) == 2:
        return _ends(name, value[0])[0], _ends(name, value[1])[1]
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | Fraction | Decimal | np.number):
        raise GeometryError(f"{name} = {value!r} is not a real number; give a number, text or a pair of bounds")
    number = value.item() if isinstance(value, np.number) else value
    if isinstance(number, complex) or (not isinstance(number, int | Fraction) and not math.isfinite(number)):
        raise GeometryError(f"{name} = {number} is not finite; give a finite real number")
    return Fraction(number), Fraction(number)


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
    lo, hi = _ends(name, value)
    if lo > hi:
        raise GeometryError(f"{name} has its lower bound {float(lo)} above its upper bound {float(hi)}; exchange them")
    return Range(lo, hi)


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
