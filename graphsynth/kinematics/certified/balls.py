"""Arrays of balls in double precision: a midpoint, real or complex, and a radius that covers every rounding error.

Every operation rounds to nearest and adds to the radius a bound of its own error (Rump 1999, midpoint-radius
arithmetic), so the result encloses the exact result for all members of the operands.  Cosines and sines come from the
platform's library and are each checked against a ball of python-flint, so no assumption on that library is made.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.errors import GraphsynthError
from graphsynth.kinematics.certified.extra import need_flint, precision

__all__ = ["UP", "Balls", "check_rounding", "exact", "stack", "tau_times", "unit"]

Array = NDArray[np.float64]

#: Unit roundoff of binary64.
U = 2.0**-53
#: A sum or product of up to thirty nonnegative numbers, times this, is an upper bound of the exact one.
UP = 1.0 + 64.0 * U
#: More than anything lost by underflow in one operation.
TINY = 2.0**-1000
#: Checked bound of the error of a cosine or sine.
_LIBRARY = 2.0**-51


def check_rounding() -> None:
    """Refuse to certify anything in a process whose rounding is not to nearest, or that flushes small numbers.

    Raises
    ------
    GraphsynthError
        If a library has changed the rounding mode of this process.
    """
    one, half, small = np.array([1.0, 2.0**-53, 5e-324])
    if one + half != 1.0 or -one - half != -1.0 or one - half / 2.0 != 1.0 or not small * one > 0.0:
        raise GraphsynthError(
            "floating point does not round to nearest in this process, so nothing can be certified; "
            "find the library that changed the rounding mode, and certify in a process without it"
        )


@dataclass(frozen=True, eq=False)
class Balls:
    """An array of balls: all numbers within ``rad`` of ``mid`` (real, or complex in the plane).

    >>> third = exact(1.0) / exact(3.0)
    >>> product = third * exact(3.0)
    >>> bool(abs(product.mid - 1.0) <= product.rad)
    True
    """

    mid: NDArray[Any]
    rad: Array

    def __add__(self, other: Balls) -> Balls:
        mid = self.mid + other.mid
        return Balls(mid, (self.rad + other.rad + U * np.abs(mid)) * UP + TINY)

    def __sub__(self, other: Balls) -> Balls:
        mid = self.mid - other.mid
        return Balls(mid, (self.rad + other.rad + U * np.abs(mid)) * UP + TINY)

    def __mul__(self, other: Balls) -> Balls:
        a, b = np.abs(self.mid), np.abs(other.mid)
        # 4 U covers the error sqrt(5) U of a complex product, with or without fused operations
        return Balls(self.mid * other.mid, (a * other.rad + self.rad * (b + other.rad) + 4.0 * U * (a * b)) * UP + TINY)

    def __truediv__(self, other: Balls) -> Balls:
        """Quotient; of infinite radius where the divisor may be zero.  Real balls only."""
        least = np.abs(other.mid) * (1.0 - 4.0 * U) - other.rad
        with np.errstate(all="ignore"):
            mid = self.mid / other.mid
            size = np.abs(mid) * UP
            rad = ((self.rad + size * other.rad) / least + 4.0 * U * size) * UP + TINY
        good = (least > 0.0) & np.isfinite(mid) & np.isfinite(rad)
        return Balls(np.where(good, mid, 0.0), np.where(good, rad, np.inf))

    def __neg__(self) -> Balls:
        return Balls(-self.mid, self.rad)

    def __getitem__(self, key: Any) -> Balls:
        return Balls(self.mid[key], self.rad[key])

    @property
    def real(self) -> Balls:
        """Real part."""
        return Balls(self.mid.real, self.rad)

    @property
    def imag(self) -> Balls:
        """Imaginary part."""
        return Balls(self.mid.imag, self.rad)

    @property
    def conj(self) -> Balls:
        """Complex conjugate."""
        return Balls(self.mid.conj(), self.rad)

    @property
    def times_i(self) -> Balls:
        """Product with the imaginary unit, exactly."""
        return Balls(1j * self.mid, self.rad)

    @property
    def size(self) -> Array:
        """Upper bound of the absolute value."""
        return np.asarray((np.abs(self.mid) + self.rad) * UP)

    @property
    def least(self) -> Array:
        """Lower bound of the absolute value; negative or zero if zero is not excluded."""
        return np.asarray(np.abs(self.mid) * (1.0 - 8.0 * U) - self.rad * UP)

    def wider(self, more: ArrayLike) -> Balls:
        """Radius increased by ``more``."""
        return Balls(self.mid, (self.rad + np.asarray(more)) * UP)


def exact(values: ArrayLike) -> Balls:
    """Numbers of double precision, taken as exact."""
    mid = np.asarray(values)
    if mid.dtype.kind not in "fc":
        mid = mid.astype(np.float64)
    return Balls(mid, np.zeros(mid.shape))


def stack(parts: list[Balls]) -> Balls:
    """Balls of one shape, stacked on a new last axis."""
    return Balls(np.stack([p.mid for p in parts], axis=-1), np.stack([p.rad for p in parts], axis=-1))


def tau_times(turns: ArrayLike) -> Balls:
    """``2 pi`` times numbers that double precision holds exactly (turns)."""
    # the double nearest to 2 pi is less than half a unit in its last place, 2^-51, away from it
    return exact(np.asarray(turns, dtype=np.float64)) * Balls(np.asarray(2.0 * np.pi), np.asarray(2.0**-51))


def unit(angle: Balls) -> Balls:
    """``exp(i angle)``: library values, each checked with a ball; infinite radius where the check fails.

    >>> z = unit(exact([0.0, 1.0]))
    >>> bool((abs(z.mid - [1.0, 0.5403023058681398 + 0.8414709848078965j]) <= z.rad).all())
    True
    """
    arb = need_flint().arb
    with np.errstate(invalid="ignore"):
        mid = np.cos(angle.mid) + 1j * np.sin(angle.mid)
    flat = mid.ravel()
    good = np.zeros(flat.size, dtype=bool)
    with precision(64):
        limit = arb(_LIBRARY)
        for k, (t, z) in enumerate(zip(angle.mid.ravel().tolist(), flat.tolist())):
            s, c = arb(t).sin_cos()
            good[k] = abs(c - z.real) < limit and abs(s - z.imag) < limit
    rad = np.where(good.reshape(mid.shape), (2.0 * _LIBRARY + angle.rad) * UP, np.inf)
    return Balls(np.where(np.isfinite(mid), mid, 1.0), np.minimum(rad, np.where(np.isfinite(angle.rad), rad, np.inf)))
