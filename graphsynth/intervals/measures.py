"""Measures of intervals: width, midpoint, radius, largest and smallest absolute value, and what is recorded."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import operations
from graphsynth.intervals.reading import CLIPPED, DISCONTINUOUS, FLOAT_INPUT, fraction

__all__ = ["Measures"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Flags = NDArray[np.uint8]


class Measures:
    """The part of `Interval` that reads its bounds and makes no new intervals."""

    __slots__ = ()

    lo: Array
    hi: Array
    flags: Flags

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
        with np.errstate(all="ignore"):
            return np.where(self.is_empty, np.nan, operations.binary("subtract", self.hi, self.hi, self.lo, self.lo)[1])

    @property
    def mid(self) -> Array:
        """Midpoint rounded, always inside; 0 for the whole line, the largest number for a half line, NaN for empty."""
        big = float(np.finfo(np.float64).max)
        with np.errstate(all="ignore"):
            lo, hi = np.maximum(self.lo, -big), np.minimum(self.hi, big)
            middle = np.where(lo == -hi, 0.0, 0.5 * lo + 0.5 * hi)
            middle = np.where(self.is_empty, np.nan, np.minimum(np.maximum(middle, self.lo), self.hi))
        return np.asarray(middle)

    @property
    def rad(self) -> Array:
        """Smallest float with ``[mid - rad, mid + rad]`` around the interval, rounded up; NaN for empty."""
        mid = self.mid
        with np.errstate(all="ignore"):
            above = operations.binary("subtract", self.hi, self.hi, mid, mid)[1]
            below = operations.binary("subtract", mid, mid, self.lo, self.lo)[1]
        return np.where(self.is_empty, np.nan, np.maximum(above, below))

    @property
    def mag(self) -> Array:
        """Largest absolute value; NaN for empty."""
        return np.where(self.is_empty, np.nan, np.maximum(np.abs(self.lo), np.abs(self.hi)))

    @property
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

    def contains(self, point: Any) -> Any:
        """Whether a number lies inside, exactly decided; text and fractions for one interval, floats for arrays.

        Examples
        --------
        >>> from graphsynth.intervals import Interval
        >>> Interval("1/30").contains("1/30")
        True
        """
        if isinstance(point, np.ndarray):
            return np.asarray((self.lo <= point) & (point <= self.hi))
        from fractions import Fraction

        value = point if isinstance(point, float) else fraction(point) if isinstance(point, str) else Fraction(point)
        lo, hi = self.lo, self.hi
        if self.ndim == 0:
            return bool(float(lo) <= value <= float(hi))
        inside = [a <= value <= b for a, b in zip(lo.ravel().tolist(), hi.ravel().tolist())]
        return np.array(inside, dtype=np.bool_).reshape(self.shape)
