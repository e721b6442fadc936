"""Arrays of balls in double precision: a midpoint, real or complex, and a radius that covers every rounding error.

Every operation rounds to nearest and adds to the radius a bound of its own error ([Rump 1999], midpoint-radius
arithmetic), so the result encloses the exact result for all members of the operands.  Directions come from a
table made with python-flint and a series with its tail bounded, so no assumption on the mathematical library is made.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import flint
import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.errors import GraphsynthError
from graphsynth.intervals.operations import Array
from graphsynth.intervals.reading import precision

#: Unit roundoff of binary64.
U = 2.0**-53
#: A sum or product of up to thirty nonnegative numbers, times this, is an upper bound of the exact one.
UP = 1.0 + 64.0 * U
#: More than anything lost by underflow in one operation.
TINY = 2.0**-1000
#: The smallest positive number: more than a product that leaves the normal range loses.
SMALLEST = 2.0**-1074
#: Entries of the table of directions.
_STEPS = 1024
#: Checked bound of the error of a cosine or sine in the table.
_TABLE = 2.0**-52


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
    __array_ufunc__ = None  # numpy leaves mixed operations to this class

    def __add__(self, other: Balls | float) -> Balls:
        other = _ball(other)
        mid = self.mid + other.mid
        return Balls(mid, (self.rad + other.rad + U * np.abs(mid)) * UP + TINY)

    __radd__ = __add__

    def __sub__(self, other: Balls | float) -> Balls:
        other = _ball(other)
        mid = self.mid - other.mid
        return Balls(mid, (self.rad + other.rad + U * np.abs(mid)) * UP + TINY)

    def __rsub__(self, other: float) -> Balls:
        return _ball(other) - self

    def __mul__(self, other: Balls | float) -> Balls:
        other = _ball(other)
        a, b = np.abs(self.mid), np.abs(other.mid)
        # 4 U covers the error sqrt(5) U of a complex product, with or without fused operations
        return Balls(self.mid * other.mid, (a * other.rad + self.rad * (b + other.rad) + 4.0 * U * (a * b)) * UP + TINY)

    __rmul__ = __mul__

    def __truediv__(self, other: Balls | float) -> Balls:
        """Quotient; of infinite radius where the divisor may be zero.  Real balls only."""
        other = _ball(other)
        # products below the normal range lose up to SMALLEST each, which a small divisor would blow up
        least = np.abs(other.mid) * (1.0 - 4.0 * U) - SMALLEST - other.rad
        with np.errstate(all="ignore"):
            mid = self.mid / other.mid
            size = np.abs(mid) * UP
            rad = ((self.rad + size * other.rad + SMALLEST) / least + 4.0 * U * size) * UP + TINY
        good = (least > 0.0) & np.isfinite(mid) & np.isfinite(rad)
        return Balls(np.where(good, mid, 0.0), np.where(good, rad, np.inf))

    def __rtruediv__(self, other: float) -> Balls:
        return _ball(other) / self

    def __neg__(self) -> Balls:
        return Balls(-self.mid, self.rad)

    def __getitem__(self, key: Any) -> Balls:
        return Balls(self.mid[key], self.rad[key])

    def times(self, other: Balls) -> Balls:
        """Products of real matrices (N, n, n) with matrices or vectors (N, n)."""
        if other.mid.ndim < self.mid.ndim:
            product = self.times(other[..., None])
            return product[..., 0]
        gamma = 4.0 * (self.mid.shape[-1] + 2) * U  # more than the error of a sum of n products, relative to its terms
        a, b = np.abs(self.mid), np.abs(other.mid)
        rad = np.matmul(a, gamma * b + other.rad)
        if self.rad.any():
            rad = rad + np.matmul(self.rad, b + other.rad)
        return Balls(np.matmul(self.mid, other.mid), rad * ((1.0 + gamma) * UP) + TINY)

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


def _ball(value: Balls | float) -> Balls:
    return value if isinstance(value, Balls) else exact(value)


def exact(values: ArrayLike) -> Balls:
    """Numbers of double precision, taken as exact."""
    mid = np.asarray(values)
    if mid.dtype.kind not in "fc":
        mid = mid.astype(np.float64)
    return Balls(mid, np.zeros(mid.shape))


def stack(parts: list[Balls]) -> Balls:
    """Balls of one shape, stacked on a new last axis."""
    return Balls(np.stack([p.mid for p in parts], axis=-1), np.stack([p.rad for p in parts], axis=-1))


def join(a: Balls, b: Balls) -> Balls:
    """Balls of both arrays along the first axis."""
    return Balls(np.concatenate([a.mid, b.mid]), np.concatenate([a.rad, b.rad]))


def tau_times(turns: ArrayLike) -> Balls:
    """``2 pi`` times numbers that double precision holds exactly (turns)."""
    # the double nearest to 2 pi is less than half a unit in its last place, 2^-51, away from it
    return exact(np.asarray(turns, dtype=np.float64)) * Balls(np.asarray(2.0 * np.pi), np.asarray(2.0**-51))


@cache
def _table() -> Balls:
    """``exp(2 pi i j / 1024)``, from balls of python-flint."""
    mid = np.zeros(_STEPS, dtype=np.complex128)
    with precision(128):
        for j in range(_STEPS):
            s, c = flint.arb.sin_cos_pi_fmpq(flint.fmpq(2 * j, _STEPS))
            mid[j] = complex(float(c), float(s))
            if not (abs(c - mid[j].real) < _TABLE and abs(s - mid[j].imag) < _TABLE):  # holds for correct rounding
                raise GraphsynthError(
                    "python-flint rounds wrongly, so nothing can be certified; reinstall python-flint"
                )
    return Balls(mid, np.full(_STEPS, 2.0 * _TABLE))


def unit(angle: Balls) -> Balls:
    """``exp(i angle)``: the nearest entry of a table times the exponential series of the rest.

    >>> z = unit(exact([0.0, 1.0, -700.0]))
    >>> bool((abs(z.mid - np.exp([0.0, 1.0j, -700.0j])) <= z.rad).all()), bool(z.rad[1] < 3e-15)
    (True, True)
    """
    with np.errstate(invalid="ignore", over="ignore"):
        index = np.round(angle.mid * (_STEPS / (2.0 * np.pi)))
    sound = np.isfinite(index) & (np.abs(index) < 2.0**50)
    index = np.where(sound, index, 0.0)
    rest = exact(np.where(sound, angle.mid, 0.0)) - tau_times(index / _STEPS)
    w = Balls(1j * rest.mid, rest.rad)  # |w| < 0.004: the tail after w^6 / 720 is less than |w|^7 / 5000
    total = exact(np.ones(w.mid.shape, dtype=np.complex128))
    for k in (6.0, 5.0, 4.0, 3.0, 2.0, 1.0):
        total = exact(1.0) + w * total * (exact(1.0) / exact(k))
    size = w.size
    total = total.wider(np.where(size < 0.004, size**7 / 4900.0, np.inf))
    turned = _table()[index.astype(np.int64) % _STEPS] * total
    rad = np.where(sound & np.isfinite(angle.rad), (turned.rad + angle.rad) * UP, np.inf)
    return Balls(turned.mid, rad)


def root(x: Balls) -> Balls:
    """Square root of real balls; of infinite radius where zero is not excluded."""
    with np.errstate(all="ignore"):
        mid = np.sqrt(x.mid)
        rad = (x.rad / mid + 2.0 * U * mid) * UP + TINY  # |sqrt(a) - sqrt(m)| <= |a - m| / sqrt(m)
    good = (x.mid - x.rad > 0.0) & np.isfinite(rad)
    return Balls(np.where(good, mid, 0.0), np.where(good, rad, np.inf))


def argument(d: Balls) -> Balls:
    """Argument of every member, continuous over the ball; infinite radius if zero may be inside.

    The library's value at the midpoint is checked by turning back: ``d exp(-i phi)`` must lie on the positive axis.
    """
    phi = np.angle(d.mid)
    back = exact(d.mid) * unit(exact(-phi))
    least = back.real.mid - back.rad
    with np.errstate(all="ignore"):
        error = back.imag.size / least  # tangent of the error of phi
        sine = d.rad / (np.abs(d.mid) * (1.0 - 1e-15))
        spread = sine / np.sqrt(np.maximum(1.0 - sine * sine, 0.0))  # at least the arc sine
        rad = (error + spread * (1.0 + 1e-14)) * (1.0 + 1e-14) + 1e-300
    good = (least > 0.0) & (sine < 0.99) & np.isfinite(rad)
    return Balls(phi, np.where(good, rad, np.inf))
