"""Strategies for intervals: points, empty, unbounded, subnormal, huge, signed zeros; and members of them."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np

from graphsynth.core.errors import SpecError
from graphsynth.intervals import Interval
from graphsynth.testing.extra import st

#: Doubles at which arithmetic changes its behaviour.
SPECIAL = (
    *(sign * x for x in (0.0, 1.0, 5e-324, 2.0**-1022, 1.7976931348623157e308, 1e160) for sign in (1.0, -1.0)),
    *(0.1, 1 / 3, 1e-160, 2.0**-960, math.nextafter(1.0, 2.0), math.nextafter(1.0, 0.0), math.pi, 9007199254740993.0),
)


def finite_numbers() -> st.SearchStrategy[float]:
    """Finite doubles, with those at which arithmetic changes its behaviour drawn often.

    Whole numbers, ordinary ones, subnormal ones, the largest, both zeros, neighbours of 1.

    Returns
    -------
    hypothesis strategy
        Of floats.

    Examples
    --------
    >>> from hypothesis import find
    >>> find(finite_numbers(), lambda x: 0.0 < x < 1e-310)
    5e-324
    """
    return st.one_of(
        st.integers(-8, 8).map(float),
        st.floats(-100.0, 100.0, allow_nan=False),
        st.sampled_from(SPECIAL),
        st.floats(allow_nan=False, allow_infinity=False),
    )


@st.composite
def _bounds(draw: st.DrawFn, empty: bool, unbounded: bool) -> tuple[float, float]:
    kinds = ["point", "bounded", "narrow"] + ["below", "above", "entire"] * unbounded + ["empty"] * empty
    kind = draw(st.sampled_from(kinds))
    if kind == "empty":
        return math.inf, -math.inf
    low, high = sorted((draw(finite_numbers()), draw(finite_numbers())))
    if kind == "point":
        return low, low
    if kind == "narrow":
        high = low
        for _ in range(draw(st.integers(1, 3))):
            high = math.nextafter(high, math.inf)
        return (low, high) if math.isfinite(high) else (math.nextafter(low, 0.0), low)
    return (-math.inf if kind in ("below", "entire") else low), (math.inf if kind in ("above", "entire") else high)


@st.composite
def _intervals(draw: st.DrawFn, shape: tuple[int, ...], empty: bool, unbounded: bool) -> Interval:
    bounds = [draw(_bounds(empty, unbounded)) for _ in range(math.prod(shape))]
    low, high = (np.array([pair[k] for pair in bounds]).reshape(shape) for k in (0, 1))
    return Interval.from_bounds(low, high)


def intervals(
    shape: int | tuple[int, ...] = (), *, empty: bool = True, unbounded: bool = True
) -> st.SearchStrategy[Interval]:
    """Intervals, or arrays of them, each a point, narrow, wide, half a line, the line or empty, equally often.

    Parameters
    ----------
    shape : int or tuple of int
        Of the array, else a `SpecError`; a single interval by default.
    empty, unbounded : bool
        Whether empty and unbounded ones are drawn.

    Returns
    -------
    SearchStrategy
        Of `Interval`, made from float bounds.

    Examples
    --------
    >>> from hypothesis import find
    >>> bool(find(intervals(), lambda x: bool(x.is_empty)).is_empty)
    True
    """
    sizes = (shape,) if isinstance(shape, int) else tuple(shape)
    if any(isinstance(size, bool) or not isinstance(size, int) or size < 0 for size in sizes):
        raise SpecError(f"shape = {shape!r} is no shape; give whole numbers of zero or more")
    return _intervals(sizes, empty, unbounded)


@st.composite
def _members(draw: st.DrawFn, unbounded: bool) -> tuple[Interval, Fraction]:
    low, high = draw(_bounds(False, unbounded))
    ends = [Fraction(end) for end in (low, high) if math.isfinite(end)]
    if not ends:
        return Interval.from_bounds(low, high), Fraction(draw(finite_numbers()))
    if len(ends) == 1:
        away = abs(Fraction(draw(finite_numbers())))
        member = ends[0] + away if math.isfinite(low) else ends[0] - away
        return Interval.from_bounds(low, high), member
    share = draw(st.sampled_from((Fraction(0), Fraction(1))) | st.fractions(0, 1, max_denominator=1000))
    return Interval.from_bounds(low, high), ends[0] + share * (ends[1] - ends[0])


def intervals_and_members(*, unbounded: bool = True) -> st.SearchStrategy[tuple[Interval, Fraction]]:
    """Pairs of an interval that is not empty and an exact member of it, often one of its ends.

    The inclusion property of interval functions in one line: ``f(member)`` must lie in ``f(interval)``.

    Parameters
    ----------
    unbounded : bool
        Whether unbounded intervals are drawn.

    Returns
    -------
    hypothesis strategy
        Of pairs ``(Interval, Fraction)``.

    Examples
    --------
    >>> from hypothesis import find
    >>> interval, member = find(intervals_and_members(unbounded=False), lambda pair: pair[1].denominator > 1)
    >>> Fraction(float(interval.lo)) <= member <= Fraction(float(interval.hi))
    True
    """
    found: Any = _members(unbounded)
    return found  # type: ignore[no-any-return]
