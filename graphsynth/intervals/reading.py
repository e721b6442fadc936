"""Exact input: numbers and decimal text as rational numbers; the nearest bounds outside, balls of python-flint."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from enum import IntFlag
from fractions import Fraction
from typing import Any, Final

import numpy as np

from graphsynth.core.errors import FormatError, GeometryError, IntervalError
from graphsynth.intervals.guard import in_default_mode
from graphsynth.intervals.operations import Array, Flags

CLIPPED: Final = np.uint8(1)
DISCONTINUOUS: Final = np.uint8(2)
FLOAT_INPUT: Final = np.uint8(4)
#: Decorations of one interval, each made once: equal ones are the same.
OF_ONE: Final = tuple(np.broadcast_to(np.uint8(flags), ()) for flags in range(8))  # read-only
NO_FLAGS: Flags = OF_ONE[0]
OF_FLOAT: Flags = OF_ONE[FLOAT_INPUT]

_PAIR = re.compile(r"\s*\[\s*([^,\]]+?)\s*,\s*([^,\]]+?)\s*\]\s*")
_SPREAD = re.compile(r"\s*(\S+)\s*(?:\+-|\+/-|±)\s*(\S+)\s*")
_EXPONENT = re.compile(r"[eE]([+-]?[0-9][0-9_]*)\s*$")
_LONGEST = 10_000


class Decoration(IntFlag):
    """What happened on the way to an interval; 0 says: defined and continuous throughout, exact input."""

    NONE = 0
    CLIPPED = 1  # an operation was undefined on part of its argument, which was left out
    DISCONTINUOUS = 2  # an operation was not continuous on its argument (atan2 across its cut, tan across a pole)
    FLOAT_INPUT = 4  # a plain float came in: whatever rounding made it is not included


@in_default_mode
def lower_bound(value: Fraction) -> float:
    """Return the largest double not above ``value``.

    >>> lower_bound(Fraction(1, 10)) < Fraction(1, 10) < upper_bound(Fraction(1, 10))
    True
    """
    try:
        nearest = float(value)
    except OverflowError:
        return float(np.finfo(np.float64).max) if value > 0 else -math.inf
    return nearest if Fraction(nearest) <= value else math.nextafter(nearest, -math.inf)


def upper_bound(value: Fraction) -> float:
    """Return the smallest double not below ``value``."""
    return -lower_bound(-value)


def enclose(value: Fraction) -> tuple[float, float]:
    """Return the tightest bounds of a rational number."""
    return lower_bound(value), upper_bound(value)


def text_ends(text: str) -> tuple[str, str, bool]:
    """Split text that gives a range: both parts and whether the second is a radius; a single number is both ends.

    >>> text_ends("[1, 2]"), text_ends("17.5 +- 0.005"), text_ends("1/30")
    (('1', '2', False), ('17.5', '0.005', True), ('1/30', '1/30', False))
    """
    if pair := _PAIR.fullmatch(text):
        return pair[1], pair[2], False
    if spread := _SPREAD.fullmatch(text):
        return spread[1], spread[2], True
    return text.strip(), text.strip(), False


def fraction(text: str) -> Fraction:
    """Read text as a rational number; `FormatError` if it is none."""
    if len(text) > _LONGEST:
        raise FormatError(f"a number of {len(text)} characters; at most {_LONGEST} are read: shorten it")
    exponent = _EXPONENT.search(text)
    if exponent and abs(int(exponent[1].replace("_", ""))) > _LONGEST:
        raise FormatError(f"{text.strip()[:60]!r} has an exponent beyond +-{_LONGEST}: bring it into that of float64")
    try:
        return Fraction(text.strip())
    except (ValueError, ZeroDivisionError):
        raise FormatError(
            f"{text[:60]!r} is not a number; write a decimal such as 0.03, a fraction such as 1/30, "
            "a pair [0.1, 0.2] or a spread 17.5 +- 0.005"
        ) from None


def _text(text: str) -> tuple[float, float]:
    word = text.strip().lower()
    if word in ("[empty]", "empty"):
        return math.inf, -math.inf
    if word in ("[entire]", "entire"):
        return -math.inf, math.inf
    first, last, spread = text_ends(text)
    if spread:
        mid, rad = fraction(first), fraction(last)
        if rad < 0:
            raise IntervalError(f"{text.strip()!r} has a negative radius; give a radius of at least 0")
        return lower_bound(mid - rad), upper_bound(mid + rad)
    if first == last:
        return enclose(fraction(first))
    lo = -math.inf if first.lower() in ("-inf", "-infinity") else fraction(first)
    hi = math.inf if last.lower() in ("inf", "+inf", "infinity") else fraction(last)
    if lo > hi:
        raise IntervalError(f"{text.strip()!r} has its lower bound above its upper bound; exchange them")
    low = lo if isinstance(lo, float) else lower_bound(lo)
    return low, hi if isinstance(hi, float) else upper_bound(hi)


def read_one(value: Any) -> tuple[float, float, bool]:
    """Return bounds of one number or text, and whether they are guaranteed (False for a float).

    `FormatError` for what is no number or text of one, `IntervalError` for NaN, infinities, bounds in the wrong order.

    >>> read_one("0.5"), read_one(0.5)
    ((0.5, 0.5, True), (0.5, 0.5, False))
    """
    if isinstance(value, bool | np.bool_):
        raise FormatError(f"{value!r} is a truth value, not a number; give a number or text")
    if isinstance(value, str):
        return *_text(value), True
    if isinstance(value, float | np.floating):
        if not np.isfinite(value):
            raise IntervalError(f"{value} is not a point; give a finite number, or bounds that may be infinite")
        return *enclose(Fraction(*value.as_integer_ratio())), False  # one double, but for extended precision
    if isinstance(value, Decimal) and not value.is_finite():
        raise IntervalError(f"{value} is not a point; give a finite number, or bounds that may be infinite")
    if isinstance(value, int | np.integer | Fraction | Decimal):
        if isinstance(value, Decimal) and abs(value.adjusted()) > _LONGEST:
            raise FormatError(f"{value} has an exponent beyond +-{_LONGEST}: bring it into that of float64")
        return *enclose(Fraction(int(value) if isinstance(value, np.integer) else value)), True
    raise FormatError(f"{type(value).__name__} is not a number; give a number, a Fraction, a Decimal or text")


def decimal_outward(x: float, side: int, digits: int = 17) -> str:
    """Write a bound as a decimal that is not inside it: not above a lower bound (side -1), not below an upper (+1).

    >>> decimal_outward(0.1, -1), decimal_outward(0.1, 1)
    ('0.1', '0.10000000000000001')
    """
    if math.isinf(x) or x == 0.0:
        return "0" if x == 0.0 else repr(x)
    exact, short = Fraction(x), repr(x)
    if Fraction(short) == exact or (Fraction(short) < exact) == (side < 0):
        return short.removesuffix(".0")
    return str(_rounded(x, side, digits))


def shortened(x: float, side: int, digits: int = 6) -> str:
    """Write a bound in a few digits for a sentence, rounded so that it stays a bound: down (-1) or up (+1).

    >>> shortened(0.0350992730735, -1), shortened(0.0350992730735, 1), shortened(0.5, -1)
    ('0.0350992', '0.0350993', '0.5')
    """
    if not math.isfinite(x) or x == 0.0:
        return "0" if x == 0.0 else repr(x)
    return f"{float(_rounded(x, side, digits)):.{digits}g}"  # the same digits, written as floats are


def _rounded(x: float, side: int, digits: int) -> Decimal:
    context = Context(prec=digits, rounding=ROUND_FLOOR if side < 0 else ROUND_CEILING, Emin=-9999, Emax=9999)
    return context.create_decimal(Decimal(x))


def read_points(value: Any) -> tuple[Array, Array, Flags]:
    """Read numbers, text or nested sequences of them: bounds and decorations."""
    if not isinstance(value, np.ndarray | np.generic) and hasattr(value, "flags"):  # an Interval inside a list
        return value.lo, value.hi, value.flags
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if _is_double(value):
        array = np.array(value, dtype=np.float64)
        if not np.isfinite(array).all():
            bad = array[~np.isfinite(array)].ravel()[0]
            raise IntervalError(f"{bad} is not a point; give finite numbers, or bounds that may be infinite")
        return array, array.copy(), OF_FLOAT
    if isinstance(value, np.ndarray | list | tuple):
        nested = [read_points(item) for item in value]
        if not nested:
            return np.zeros(0), np.zeros(0), NO_FLAGS
        if len({part[0].shape for part in nested}) > 1:
            raise IntervalError("the rows of intervals have different lengths; give a full array")
        flags = NO_FLAGS
        if any(part[2].any() for part in nested):
            flags = np.stack([np.broadcast_to(part[2], part[0].shape) for part in nested])
        return np.stack([part[0] for part in nested]), np.stack([part[1] for part in nested]), flags
    lo, hi, guaranteed = read_one(value)
    flag = NO_FLAGS if guaranteed else OF_FLOAT
    return np.asarray(lo), np.asarray(hi), flag


def _is_double(value: Any) -> bool:
    """Whether numpy floats are doubles or shorter: extended precision is enclosed number by number."""
    return isinstance(value, np.ndarray | np.generic) and value.dtype.kind == "f" and value.dtype.itemsize <= 8


def _bound(value: Any, side: int) -> Array:
    if isinstance(value, float) or _is_double(value):
        return np.array(value, dtype=np.float64)
    if isinstance(value, np.floating) and not np.isfinite(value):
        return np.asarray(float(value))
    if (isinstance(value, Sequence) and not isinstance(value, str)) or (isinstance(value, np.ndarray) and value.ndim):
        try:
            return np.array([_bound(item, side) for item in value], dtype=np.float64)
        except ValueError:
            raise IntervalError("the rows of bounds have different lengths; give a full array") from None
    lo, hi, _ = read_points(value)
    return hi if side else lo


def read_bounds(lower: Any, upper: Any) -> tuple[Array, Array]:
    """Read lower and upper bounds, rounded outward; refuse NaN and bounds in the wrong order."""
    lo, hi = _bound(lower, 0), _bound(upper, 1)
    try:
        lo, hi = (np.array(a) for a in np.broadcast_arrays(lo, hi))
    except ValueError:
        raise IntervalError(f"bounds of shapes {lo.shape} and {hi.shape} do not fit; give equal shapes") from None
    if np.isnan(lo).any() or np.isnan(hi).any():
        raise IntervalError("a bound is NaN, which is no number; give numbers, -inf or inf")
    wrong = ((lo > hi) & ~((lo == np.inf) & (hi == -np.inf))) | ((lo == hi) & np.isinf(lo))
    if wrong.any():
        a, b = lo[wrong].ravel()[0], hi[wrong].ravel()[0]
        raise IntervalError(f"lower bound {a} and upper bound {b} hold no number; give lower <= upper")
    return lo, hi


@contextmanager
def precision(bits: int) -> Iterator[None]:
    """Work with python-flint's balls of ``bits`` binary digits inside the block, whatever the caller has set."""
    import flint

    before = flint.ctx.prec
    flint.ctx.prec = bits
    try:
        yield
    finally:
        flint.ctx.prec = before


@dataclass(frozen=True)
class Gaussian:
    """A complex number with rational parts; exact arithmetic."""

    real: Fraction
    imag: Fraction

    def __add__(self, other: Gaussian) -> Gaussian:
        return Gaussian(self.real + other.real, self.imag + other.imag)

    def __sub__(self, other: Gaussian) -> Gaussian:
        return Gaussian(self.real - other.real, self.imag - other.imag)

    def __neg__(self) -> Gaussian:
        return Gaussian(-self.real, -self.imag)

    def __mul__(self, other: Gaussian | Fraction | int) -> Gaussian:
        if isinstance(other, Gaussian):
            a, b, c, d = self.real, self.imag, other.real, other.imag
            return Gaussian(a * c - b * d, a * d + b * c)
        return Gaussian(self.real * other, self.imag * other)

    __rmul__ = __mul__

    @property
    def conj(self) -> Gaussian:
        """Complex conjugate."""
        return Gaussian(self.real, -self.imag)


def rational(name: str, value: Any) -> Fraction:
    """Exact value of an int, float, Fraction, Decimal, or text such as "0.1" or "1/3"; else `GeometryError`.

    >>> rational("l", "0.1"), rational("l", 0.5)
    (Fraction(1, 10), Fraction(1, 2))
    """
    try:
        if isinstance(value, str):
            return fraction(value)
        if isinstance(value, float | int | Fraction | Decimal):
            return Fraction(value)
        if isinstance(value, np.floating | np.integer):
            return Fraction(value.item())
    except (FormatError, ValueError, OverflowError):
        pass
    raise GeometryError(f"{name} = {value!r} is not a finite number; give an int, float, Fraction or decimal text")


def gaussian(name: str, value: Any) -> Gaussian:
    """Return the exact value of a complex number, or of a pair (x, y) of anything that `rational` takes."""
    if isinstance(value, complex | np.complexfloating):
        return Gaussian(rational(f"x of {name}", float(value.real)), rational(f"y of {name}", float(value.imag)))
    if isinstance(value, tuple | list | np.ndarray):
        if len(value) != 2:
            raise GeometryError(f"{name} = {value!r} is not a point; give a complex number or a pair (x, y)")
        return Gaussian(rational(f"x of {name}", value[0]), rational(f"y of {name}", value[1]))
    return Gaussian(rational(name, value), Fraction(0))


def ball(value: Any) -> Any:
    """Enclose a rational number in an ``arb`` at the precision set; an ``arb`` stays as it is."""
    import flint

    if not isinstance(value, Fraction):
        return flint.arb(value)
    return flint.arb(flint.fmpq(value.numerator, value.denominator))


def complex_ball(value: Any) -> Any:
    """Enclose a complex number in an ``acb`` at the precision set; an ``acb`` stays as it is."""
    import flint

    if not isinstance(value, Gaussian):
        return flint.acb(value)
    return flint.acb(ball(value.real), ball(value.imag))
