"""Functions for formulas written once: of numbers, intervals and duals.

Elementary functions are computed by this package's own kernels with proved error bounds; no function of the C library
or of numpy is trusted with a bound (``docs/explanation/intervals.md``).  Accuracy: for point arguments the bounds are
mostly neighbouring doubles, at worst three apart.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import Any, Protocol, overload

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals.dual import Dual
from graphsynth.intervals.guard import in_default_mode
from graphsynth.intervals.interval import Interval, _apply, _both, _make, _mark, interval
from graphsynth.intervals.operations import Array
from graphsynth.intervals.reading import DISCONTINUOUS


class _Unary(Protocol):
    """Function of one argument: a `Dual` gives a `Dual`, anything else an `Interval`."""

    @overload
    def __call__(self, x: Dual) -> Dual: ...
    @overload
    def __call__(self, x: Any) -> Interval: ...


class _Binary(Protocol):
    """Function of two arguments: a `Dual` among them gives a `Dual`, anything else an `Interval`."""

    @overload
    def __call__(self, x: Dual, y: Any, /) -> Dual: ...
    @overload
    def __call__(self, x: Any, y: Dual, /) -> Dual: ...
    @overload
    def __call__(self, x: Any, y: Any, /) -> Interval: ...


_DOCUMENTED = """

    Parameters
    ----------
    {names} : Interval, Dual or anything an Interval takes{more}

    Returns
    -------
    Interval or Dual
        Encloses every value over the argument (certified); of the same kind and shape.
    """


def _document(function: Callable[..., Any], names: str, more: str = "") -> None:
    """Put parameters and result behind the first paragraph of a docstring."""
    first, _, rest = (function.__doc__ or "").partition("\n\n")
    sections = _DOCUMENTED.format(names=names, more=more)
    function.__doc__ = first + sections + ("\n    " + rest.lstrip() if rest else "")


def _unary(slope: Callable[[Interval, Interval], Interval]) -> Callable[[Callable[[Interval], Interval]], _Unary]:
    """Make a function of intervals one of duals too; ``slope(x, value)`` is its derivative."""

    def decorated(function: Callable[[Interval], Interval]) -> _Unary:
        @wraps(function)
        def apply(x: Any) -> Any:
            if type(x) is Interval:
                return function(x)
            if isinstance(x, Dual):
                value = function(x.value)
                return x.chain(value, slope(x.value, value))
            return function(interval(x))

        _document(apply, "x")
        return apply

    return decorated


def _binary(slopes: Callable[[Dual, Dual, Interval], Dual]) -> Callable[[Callable[..., Interval]], _Binary]:
    """Make a function of two intervals one of duals too; ``slopes(x, y, value)`` is the result for duals."""

    def decorated(function: Callable[[Interval, Interval], Interval]) -> _Binary:
        @wraps(function)
        def apply(x: Any, y: Any, /) -> Any:
            if type(x) is Interval is type(y) and x._ends and y._ends:
                return function(x, y)
            if isinstance(x, Dual) or isinstance(y, Dual):
                x, y = (a if isinstance(a, Dual) else Dual(interval(a), b.grad * 0) for a, b in ((x, y), (y, x)))
                return slopes(x, y, function(x.value, y.value))
            x = interval(x)
            return function(x, x._beside(y))

        names = ", ".join(signature(function).parameters)
        _document(apply, names, "\n        Shapes that broadcast.")
        return apply

    return decorated


@_unary(lambda x, value: x * 2)
def sqr(x: Interval) -> Interval:
    """Square.

    Examples
    --------
    >>> sqr(Interval(-1, 2))
    Interval([0, 4])
    """
    return x.sqr()


@_unary(lambda x, value: 1 / (value * 2))
def sqrt(x: Interval) -> Interval:
    """Square root; a negative part is clipped and recorded (`Decoration.CLIPPED`)."""
    return x.sqrt()


@_unary(lambda x, value: _apply("cos", x))
def sin(x: Interval) -> Interval:
    """Sine.

    Examples
    --------
    >>> sin(Interval(0, 4)).hi.item()
    1.0
    """
    return _apply("sin", x)


@_unary(lambda x, value: -_apply("sin", x))
def cos(x: Interval) -> Interval:
    """Cosine."""
    return _apply("cos", x)


@_unary(lambda x, value: value.sqr() + 1)
def tan(x: Interval) -> Interval:
    """Tangent; the whole line across a pole, recorded (`Decoration.DISCONTINUOUS`)."""
    result = _apply("tan", x)
    if (ends := result._ends) and ends[1] - ends[0] < math.inf:
        return result
    return _mark(result, lambda lo, hi: (lo == -np.inf) | (hi == np.inf), result, mark=DISCONTINUOUS)


@_unary(lambda x, value: 1 / (x.sqr() + 1))
def atan(x: Interval) -> Interval:
    """Inverse tangent."""
    return _apply("atan", x)


@_unary(lambda x, value: 1 / sqrt((1 - x) * (1 + x)))
def asin(x: Interval) -> Interval:
    """Inverse sine; a part outside [-1, 1] is clipped and recorded."""
    return _of_a_sine("asin", x)


@_unary(lambda x, value: -1 / sqrt((1 - x) * (1 + x)))
def acos(x: Interval) -> Interval:
    """Inverse cosine; a part outside [-1, 1] is clipped and recorded."""
    return _of_a_sine("acos", x)


def _of_a_sine(name: str, x: Interval) -> Interval:
    result = _apply(name, x)
    if (ends := x._ends) and ends[0] >= -1.0 and ends[1] <= 1.0:
        return result
    return _mark(result, lambda lo, hi: (lo < -1.0) | (hi > 1.0), x)


@_unary(lambda x, value: value)
def exp(x: Interval) -> Interval:
    """Exponential."""
    return _apply("exp", x)


@_unary(lambda x, value: 1 / x)
def log(x: Interval) -> Interval:
    """Natural logarithm; a part at or below 0 is clipped and recorded."""
    result = _apply("log", x)
    return result if (ends := x._ends) and ends[0] > 0.0 else _mark(result, lambda lo, hi: lo <= 0.0, x)


def _atan2_slopes(y: Dual, x: Dual, value: Interval) -> Dual:
    square = x.value.sqr() + y.value.sqr()
    return Dual(value, (x.value / square) * y.grad - (y.value / square) * x.grad)


@_binary(_atan2_slopes)
def atan2(y: Interval, x: Interval) -> Interval:
    """Angle of the points (x, y) in (-pi, pi]; ``[-pi, pi]`` across the cut, recorded; clipped at the origin.

    Examples
    --------
    >>> atan2(Interval(1), Interval(1)).contains(0.7853981633974483)
    True
    """
    result = _apply("atan2", y, x)
    if (ends := x._ends) and ends[0] > 0.0 and y._ends:
        return result
    across = lambda y_lo, y_hi, x_lo, x_hi: (y_lo < 0.0) & (y_hi >= 0.0) & (x_lo < 0.0)  # noqa: E731
    origin = lambda y_lo, y_hi, x_lo, x_hi: (y_lo <= 0.0) & (y_hi >= 0.0) & (x_lo <= 0.0) & (x_hi >= 0.0)  # noqa: E731
    return _mark(_mark(result, across, y, x, mark=DISCONTINUOUS), origin, y, x)


@_binary(lambda x, y, value: Dual(value, (x.value / value) * x.grad + (y.value / value) * y.grad))
def hypot(x: Interval, y: Interval) -> Interval:
    """Distance from the origin, without overflow on the way."""
    return _apply("hypot", x, y)


@_binary(lambda x, y, value: _selected(value, x, y, x.value.hi < y.value.lo, y.value.hi < x.value.lo))
@in_default_mode
def minimum(x: Interval, y: Interval) -> Interval:
    """Smaller of two; the derivative holds both where either may be the smaller."""
    return _combined(x, y, np.minimum(x.lo, y.lo), np.minimum(x.hi, y.hi))


@_binary(lambda x, y, value: _selected(value, x, y, x.value.lo > y.value.hi, y.value.lo > x.value.hi))
@in_default_mode
def maximum(x: Interval, y: Interval) -> Interval:
    """Larger of two; the derivative holds both where either may be the larger."""
    return _combined(x, y, np.maximum(x.lo, y.lo), np.maximum(x.hi, y.hi))


def _combined(x: Interval, y: Interval, lo: Array, hi: Array) -> Interval:
    void = x.is_empty | y.is_empty
    return _make(np.where(void, np.inf, lo), np.where(void, -np.inf, hi), _both(x.flags, y.flags))


def _selected(value: Interval, x: Dual, y: Dual, first: NDArray[np.bool_], second: NDArray[np.bool_]) -> Dual:
    both = x.grad.hull(y.grad)
    lo = np.where(first, x.grad.lo, np.where(second, y.grad.lo, both.lo))
    hi = np.where(first, x.grad.hi, np.where(second, y.grad.hi, both.hi))
    return Dual(value, _make(lo, hi, both.flags))


def pi() -> Interval:
    """Return the interval of two neighbouring doubles around pi.

    Returns
    -------
    Interval, shape ()
        Certified.

    Examples
    --------
    >>> pi()
    Interval([3.141592653589793, 3.1415926535897936])
    """
    from graphsynth.intervals.kernels.double_double import PI

    return _make(*PI)


@in_default_mode
def divide_extended(a: Any, b: Any) -> tuple[Interval, Interval]:
    """Quotient as the union of two intervals, the second empty unless 0 lies inside the divisor.

    ``{x : x b = a for some a, b}`` without the case 0 b = 0: for a divisor with 0 inside and a numerator without it,
    the quotient is two half lines, needed by Gauss-Seidel steps.

    Parameters
    ----------
    a, b : Interval or anything it takes
        Numerator and divisor, shapes that broadcast.

    Returns
    -------
    (Interval, Interval)
        Their union holds every quotient (certified).

    Examples
    --------
    >>> divide_extended(Interval(1), Interval(-2, 4))
    (Interval([-inf, -0.5]), Interval([0.25, inf]))
    """
    a = interval(a)
    b = a._beside(b)
    split = (b.lo < 0.0) & (b.hi > 0.0) & ((a.lo > 0.0) | (a.hi < 0.0)) & ~a.is_empty
    whole = a / b
    left = a / _make(np.where(split, b.lo, 1.0), np.where(split, 0.0, 1.0))
    right = a / _make(np.where(split, 0.0, 1.0), np.where(split, b.hi, 1.0))
    low = np.where(left.lo == -np.inf, left.hi, right.hi)
    high = np.where(left.hi == np.inf, left.lo, right.lo)
    first = _make(np.where(split, -np.inf, whole.lo), np.where(split, low, whole.hi), whole.flags)
    return first, _make(np.where(split, high, np.inf), np.where(split, np.inf, -np.inf), whole.flags)
