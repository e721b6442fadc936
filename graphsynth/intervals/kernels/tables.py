"""Tables of elementary functions as pairs of doubles, made at import from integers alone (a millisecond).

Every number is computed in fixed point with ``BITS`` bits behind the binary point; no table errs by more than 2^14
units, so the pairs are right to their last bits (``docs/theory/elementary-functions.md``).
"""

from collections.abc import Iterable
from fractions import Fraction
from math import isqrt, ldexp

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals.kernels import double_double as dd

BITS = 192
_ONE = 1 << BITS


def _pairs(values: Iterable[int], last: int | None = None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return high and low parts of fixed-point numbers; the high ones cut to multiples of ``2**-last``, if given."""
    high, low = [], []
    for value in values:
        head = value if last is None else value >> (BITS - last) << (BITS - last)
        first = ldexp(float(head), -BITS)
        high.append(first)
        low.append(ldexp(float(value - int(ldexp(first, BITS))), -BITS))
    return np.array(high), np.array(low)


def pieces(value: Fraction, *lasts: int) -> tuple[float, ...]:
    """Cut a positive number into multiples of ``2**-last`` for each of ``lasts``, and a rest."""
    found = []
    for last in lasts:
        found.append(float(Fraction(int(value * 2**last), 2**last)))
        value -= Fraction(found[-1])
    return *found, float(value)


def _powers() -> list[int]:
    """``2^(j/128)`` for j from 0 to 127, by roots and products."""
    step = 2 << BITS
    for _ in range(7):
        step = isqrt(step << BITS)
    found = [_ONE]
    for _ in range(127):
        found.append(found[-1] * step >> BITS)
    return found


def _logarithms(least: int, most: int) -> list[int]:
    """``log(n/256)`` for n from ``least`` to ``most``, by ``log((n + 1)/n) = 2 atanh(1/(2n + 1))``."""

    def step(n: int) -> int:
        total, power, k, square = 0, _ONE // (2 * n + 1), 1, (2 * n + 1) ** 2
        while power:
            total += power // k
            power //= square
            k += 2
        return 2 * total

    above, below = [0], [0]
    for n in range(256, most):
        above.append(above[-1] + step(n))
    for n in range(255, least - 1, -1):
        below.append(below[-1] - step(n))
    return below[:0:-1] + above


def _arctangents() -> list[int]:
    """``atan(k/128)`` for k from 0 to 128, by ``atan((k + 1)/n) - atan(k/n) = atan(n / (n^2 + k (k + 1)))``."""
    found = [0]
    for k in range(128):
        q = 128 * 128 + k * (k + 1)
        total, power, odd, square = 0, (_ONE << 7) // q, 1, q * q
        while power:
            total += power // odd if odd & 2 == 0 else -(power // odd)
            power = (power << 14) // square
            odd += 2
        found.append(found[-1] + total)
    return found


def _sines() -> list[int]:
    """``sin(j pi/256)`` for a whole turn, j from 0 to 511, by rotations."""
    angle = dd.pi_fixed(BITS) >> 8
    term, sums, k = _ONE, [0, 0], 0
    while term:
        sums[k & 1] += term if k & 2 == 0 else -term
        k += 1
        term = (term * angle >> BITS) // k
    c, s = sums
    sine, cosine, found = 0, _ONE, [0]
    for _ in range(127):
        sine, cosine = (sine * c + cosine * s) >> BITS, (cosine * c - sine * s) >> BITS
        found.append(sine)
    half = [*found, _ONE, *found[:0:-1]]
    return [*half, *(-value for value in half)]


POWER_H, POWER_L = _pairs(_powers(), 25)
#: 256 parts of [0.6875, 1.375), equal in bits: multipliers n/256 near the inverse of the middle, 1 on both sides of 1.
FIRST_BITS = int(np.float64(0.6875).view(np.int64))
_MIDDLES = (FIRST_BITS + (np.arange(256) << 44) + (1 << 43)).view(np.float64)
_NEAREST = np.rint(256.0 / _MIDDLES).astype(np.int64)
_NEAREST[abs(_MIDDLES - 1.0) < 2.0**-8] = 256
_LEAST, _MOST = int(_NEAREST.min()), int(_NEAREST.max())
_LOGARITHMS = _logarithms(_LEAST, _MOST)
INVERSE = _NEAREST / 256.0
LOG_H, LOG_L = _pairs([-_LOGARITHMS[n - _LEAST] for n in _NEAREST.tolist()], 42)
_QUARTER = _arctangents()
#: ``atan(k/128)``, then ``pi/2 - atan(k/128)``.
ATAN_H, ATAN_L = _pairs([*_QUARTER, *((dd.pi_fixed(BITS) >> 1) - value for value in _QUARTER)])
SIN_H, SIN_L = _pairs(_sines(), 26)
