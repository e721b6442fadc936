"""Measures of intervals: width, midpoint, radius, largest and smallest absolute value, and what is recorded."""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from graphsynth.core.errors import FormatError
from graphsynth.intervals import operations
from graphsynth.intervals.guard import in_default_mode
from graphsynth.intervals.operations import Array, Flags, Mask
from graphsynth.intervals.reading import CLIPPED, DISCONTINUOUS, FLOAT_INPUT, OF_ONE, fraction


def _refuse(self: Measures, value: Any) -> NoReturn:
    raise AttributeError("an Interval does not change; make a new one")


class Measures:
    """The part of `Interval` that reads its bounds and makes no new intervals."""

    __slots__ = ("_ends", "_flags", "_hi", "_lo")
    _ends: tuple[float, float] | None  # of one interval; its arrays are made when they are asked for
    _lo: Array
    _hi: Array
    _flags: Flags

    @property
    def lo(self) -> Array:
        """Lower bounds, read-only."""
        try:
            return self._lo
        except AttributeError:
            return _spread(self)[0]

    @property
    def hi(self) -> Array:
        """Upper bounds, read-only."""
        try:
            return self._hi
        except AttributeError:
            return _spread(self)[1]

    @property
    def flags(self) -> Flags:
        """Decorations, of the shape of the bounds or a scalar for all."""
        return self._flags

    if not TYPE_CHECKING:  # to type checkers they are read-only
        lo, hi, flags = (member.setter(_refuse) for member in (lo, hi, flags))

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array of intervals."""
        return self.lo.shape

    @property
    def size(self) -> int:
        """Number of intervals."""
        return self.lo.size

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return self.lo.ndim

    @property
    def is_empty(self) -> Mask:
        """Where empty."""
        return np.asarray(self.lo > self.hi)

    @property
    def is_bounded(self) -> Mask:
        """Where not empty and both ends are finite."""
        return np.asarray(np.isfinite(self.lo) & np.isfinite(self.hi))

    @property
    def width(self) -> Array:
        """Upper bound of ``hi - lo``; NaN for empty."""
        return np.where(self.is_empty, np.nan, operations.run("subtract", self.hi, self.hi, self.lo, self.lo)[1])

    @property
    @in_default_mode
    def mid(self) -> Array:
        """Midpoint, always inside; 0 for the line, the largest number of its sign for a half line, NaN for empty."""
        big = float(np.finfo(np.float64).max)
        with np.errstate(all="ignore"):
            middle = np.where(self.lo == -np.inf, -big, np.where(self.hi == np.inf, big, 0.5 * self.lo + 0.5 * self.hi))
            middle = np.where((self.lo == -np.inf) & (self.hi == np.inf), 0.0, middle)
            middle = np.where(self.is_empty, np.nan, np.minimum(np.maximum(middle, self.lo), self.hi))
        return np.asarray(middle)

    @property
    @in_default_mode
    def rad(self) -> Array:
        """Smallest float with ``[mid - rad, mid + rad]`` around the interval, rounded up; NaN for empty."""
        mid = self.mid
        above = operations.run("subtract", self.hi, self.hi, mid, mid)[1]
        below = operations.run("subtract", mid, mid, self.lo, self.lo)[1]
        return np.where(self.is_empty, np.nan, np.maximum(above, below))

    @property
    @in_default_mode
    def mag(self) -> Array:
        """Largest absolute value; NaN for empty."""
        return np.where(self.is_empty, np.nan, np.maximum(np.abs(self.lo), np.abs(self.hi)))

    @property
    @in_default_mode
    def mig(self) -> Array:
        """Smallest absolute value; NaN for empty."""
        return np.where(self.is_empty, np.nan, np.maximum(np.maximum(self.lo, -self.hi), 0.0))

    @property
    def guaranteed(self) -> Mask:
        """Where every operation was defined and continuous on its whole argument: a certificate may rest on it."""
        return np.asarray((self.flags & (CLIPPED | DISCONTINUOUS)) == 0)

    @property
    def exact_input(self) -> Mask:
        """Where no plain float came in."""
        return np.asarray((self.flags & FLOAT_INPUT) == 0)

    @in_default_mode
    def contains(self, point: Any) -> Any:
        """Whether a number lies inside, exactly decided; text and fractions for one interval, floats for arrays.

        An infinity is no number and lies in no interval; `FormatError` for anything else that is none.

        Examples
        --------
        >>> from graphsynth.intervals import Interval
        >>> Interval("1/30").contains("1/30"), Interval.entire().contains(float("inf"))
        (True, False)
        """
        lo, hi = self.lo, self.hi
        if isinstance(point, np.ndarray) and point.ndim and point.dtype.kind in "fiu":
            operations.common_shape(lo, point)
            if point.dtype.kind in "iu":
                point = point.astype(np.float64)
                if (np.abs(point) > 2.0**53).any():
                    raise FormatError(
                        "an array of whole numbers beyond 2^53 is not one of floats; ask number by number"
                    )
            return np.asarray((lo <= point) & (point <= hi) & np.isfinite(point))
        value = _number(point)
        if value is None:
            return False if self.ndim == 0 else np.zeros(self.shape, dtype=np.bool_)
        inside = [a <= value <= b for a, b in zip(lo.ravel().tolist(), hi.ravel().tolist())]
        return inside[0] if self.ndim == 0 else np.array(inside, dtype=np.bool_).reshape(self.shape)


def _number(point: Any) -> Fraction | float | None:
    """Return an exact number, None for an infinity or NaN; `FormatError` for anything else."""
    point = point[()] if isinstance(point, np.ndarray) and point.ndim == 0 else point
    if isinstance(point, str):
        return fraction(point)
    if isinstance(point, float):
        return point if math.isfinite(point) else None
    if (isinstance(point, Decimal) and not point.is_finite()) or (
        isinstance(point, np.floating) and not np.isfinite(point)
    ):
        return None
    if isinstance(point, np.floating):
        return Fraction(*point.as_integer_ratio())
    if isinstance(point, int | np.integer | Fraction | Decimal) and not isinstance(point, bool):
        return Fraction(int(point) if isinstance(point, np.integer) else point)
    raise FormatError(f"{point!r} is not a number; give a number, a Fraction, a Decimal, text or an array of floats")


def fill(target: Measures, lo: Array, hi: Array, flags: Flags) -> None:
    """Give an interval its arrays, which are made read-only, and the ends of a single one."""
    lo.setflags(write=False)
    hi.setflags(write=False)
    if flags.ndim and flags.shape != lo.shape:
        flags = np.broadcast_to(flags, lo.shape)
    elif not lo.ndim:
        flags = OF_ONE[flags.item()]  # equal ones are the same, which the short ways of `Interval` look for
    target._lo, target._hi, target._flags = lo, hi, flags
    target._ends = None if lo.ndim else (lo.item(), hi.item())


def _spread(single: Measures) -> tuple[Array, Array]:
    """Make the arrays of a single interval; its ends are known."""
    lo, hi = map(np.array, single._ends or ())
    fill(single, lo, hi, single._flags)
    return lo, hi
