"""Exact input: every dimension is a range between two rational numbers, read from decimal text without rounding."""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.core.checks import checked
from graphsynth.core.errors import GeometryError
from graphsynth.intervals.reading import fraction, text_ends

if TYPE_CHECKING:
    from graphsynth.intervals import Interval

__all__ = ["Given", "Range", "bounds_of", "exact_text", "spread"]


def bounds_of(value: Fraction) -> tuple[float, float]:
    """Return the largest double not above and the smallest not below a rational number.

    Examples
    --------
    >>> bounds_of(Fraction(1, 2)), bounds_of(Fraction(3, 100))[0] < bounds_of(Fraction(3, 100))[1]
    ((0.5, 0.5), True)
    """
    nearest = float(value)
    exact = Fraction(nearest)
    if exact == value:
        return nearest, nearest
    if exact < value:
        return nearest, math.nextafter(nearest, math.inf)
    return math.nextafter(nearest, -math.inf), nearest


@checked
@dataclass(frozen=True)
class Range:
    """All values from ``lower`` to ``upper``, both exact.

    Attributes
    ----------
    lower, upper : Fraction
        The ends.
    exact : bool
        False if a plain float came in: whatever rounding made that float is not included in any statement.

    Examples
    --------
    >>> Range.read("clearance", "0.03 +- 0.003")
    Range(lower=Fraction(27, 1000), upper=Fraction(33, 1000), exact=True)
    >>> Range.read("clearance", 0.5).exact
    False
    """

    lower: Fraction
    upper: Fraction
    exact: bool = True

    @classmethod
    def read(cls, name: str, value: Any) -> Range:
        """Read a number, decimal text, ``"[a, b]"``, ``"a +- b"``, a pair or an `Interval`.

        Raises
        ------
        GeometryError
            For anything that is no finite number, and for reversed bounds; the sentence names the parameter.
        """
        if isinstance(value, Range):
            return value
        if isinstance(value, str):
            return cls._text(name, value)
        if isinstance(value, tuple | list):
            if len(value) != 2:
                raise GeometryError(f"{name} = {value!r} has {len(value)} bounds; give two, or one number")
            first, last = (cls.read(name, part) for part in value)
            return cls._ordered(name, first.lower, last.upper, first.exact and last.exact)
        if hasattr(value, "lo") and hasattr(value, "hi"):
            if getattr(value, "shape", ()) != ():
                raise GeometryError(f"{name} = {value!r} is an array of shape {value.shape}; give one interval")
            low, high = _number(name, float(value.lo)), _number(name, float(value.hi))
            return cls._ordered(name, low, high, bool(value.exact_input))
        number = _number(name, value)
        return cls(number, number, isinstance(value, int | Fraction | Decimal | np.integer))

    @classmethod
    def _text(cls, name: str, text: str) -> Range:
        first, last, is_spread = text_ends(text)
        low, high = _number(name, first), _number(name, last)
        if not is_spread:
            return cls._ordered(name, low, high, True)
        if high < 0:
            raise GeometryError(f"{name} = {text.strip()!r} has a negative tolerance; give 0 or more")
        return cls(low - high, low + high)

    @classmethod
    def _ordered(cls, name: str, lower: Fraction, upper: Fraction, exact: bool) -> Range:
        if lower > upper:
            raise GeometryError(
                f"{name} has its lower bound {float(lower):.6g} above its upper bound {float(upper):.6g}; exchange them"
            )
        return cls(lower, upper, exact)

    @property
    def is_point(self) -> bool:
        """Whether the range is a single number."""
        return self.lower == self.upper

    @property
    def middle(self) -> float:
        """Double nearest to the middle."""
        return float((self.lower + self.upper) / 2)

    @cached_property
    def ends(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Tightest double bounds of the lower and of the upper end."""
        return bounds_of(self.lower), bounds_of(self.upper)

    @cached_property
    def outer(self) -> Interval:
        """The smallest interval of doubles around the range."""
        from graphsynth.intervals import Interval

        low, high = self.ends
        return Interval.from_bounds(low[0], high[1])

    @cached_property
    def doubles(self) -> Interval:
        """The doubles inside the range; the two around it if there is none."""
        from graphsynth.intervals import Interval

        (below, first), (last, above) = self.ends
        return Interval.from_bounds(first, last) if first <= last else Interval.from_bounds(below, above)

    def __str__(self) -> str:
        low, high = (_short(end) for end in (self.lower, self.upper))
        return low if self.is_point else f"[{low}, {high}]"


Given = Any  # str, int, float, Fraction, Decimal, Interval, Range, or a pair of them


def spread(nominal: Given, absolute: Given = 0, relative: Given = 0) -> Range:
    """Return ``nominal`` with an absolute and a relative tolerance, exactly.

    Parameters
    ----------
    nominal : Given
        A number, text or range.
    absolute : Given, optional
        Plus or minus, in the same unit.
    relative : Given, optional
        Plus or minus, as a fraction of the value: 1/100 for one per cent.

    Returns
    -------
    Range
        Exact.

    Raises
    ------
    GeometryError
        For a negative tolerance.

    Examples
    --------
    >>> str(spread("0.0130", relative="1e-2"))
    '[0.01287, 0.01313]'
    """
    given = {"nominal": nominal, "absolute": absolute, "relative": relative}
    value, plus, factor = (Range.read(name, v) for name, v in given.items())
    if plus.lower < 0 or factor.lower < 0:
        raise GeometryError(f"a tolerance of {plus} or {factor} is negative; give zero or more")
    low = min(end * (1 - sign * factor.upper) for end in (value.lower, value.upper) for sign in (1, -1))
    high = max(end * (1 + sign * factor.upper) for end in (value.lower, value.upper) for sign in (1, -1))
    return Range(low - plus.upper, high + plus.upper, value.exact and plus.exact and factor.exact)


def _number(name: str, value: Any) -> Fraction:
    try:
        if isinstance(value, bool | bytes | bytearray | np.bool_):
            raise ValueError
        if isinstance(value, str):
            number = fraction(value)
        elif isinstance(value, Decimal) and value.is_finite() and abs(value.adjusted()) > 10_000:
            raise ValueError
        elif isinstance(value, int | np.integer):
            number = Fraction(int(value))
        elif isinstance(value, Fraction | Decimal | np.floating):
            number = Fraction(*value.as_integer_ratio())
        else:
            number = Fraction(float(value))
        float(number)
    except (ValueError, TypeError, OverflowError, ZeroDivisionError):
        raise GeometryError(
            f"{name} = {value!r} is not a finite number; write a decimal such as 0.03, a fraction such as 1/30, "
            "a pair [0.1, 0.2] or a spread 17.5 +- 0.005"
        ) from None
    return number


def exact_text(value: Fraction) -> str:
    """Write a rational number exactly: as a decimal if a short one exists, else as a fraction.

    Examples
    --------
    >>> exact_text(Fraction(27, 1000)), exact_text(Fraction(1, 30))
    ('0.027', '1/30')
    """
    rest = value.denominator
    for prime in (2, 5):
        while rest % prime == 0:
            rest //= prime
    if rest == 1:
        with localcontext() as context:
            context.prec = 60
            decimal = (Decimal(value.numerator) / Decimal(value.denominator)).normalize()
        if Fraction(decimal) == value:
            text = f"{decimal:f}"
            return text if len(text) <= 24 else f"{decimal:e}"
    return f"{value.numerator}/{value.denominator}"


def _short(value: Fraction) -> str:
    """Write a rational number exactly if that is short, else rounded to 12 digits."""
    text = exact_text(value)
    return text if len(text) <= 24 else f"{float(value):.12g}"
