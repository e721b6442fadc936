"""Constants to hundreds of bits, from integers alone: pi, log 2, arctangents; nothing here trusts a library.

Series with integer terms: ``atan(p/q)`` and ``atanh(1/q)`` in fixed point.  Each term is truncated by less than one
unit, so the error is below the number of terms, and 32 guard bits are cut off at the end.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache

_GUARD = 32


def _series(p: int, q: int, bits: int, sign: int) -> int:
    """Return ``2**bits`` times ``atan(p/q)`` (sign -1) or ``atanh(p/q)`` (sign +1), error below a thousand units."""
    power, total, k, turn = (p << bits) // q, 0, 1, 1
    while power:
        total += turn * (power // k)
        power = power * p * p // (q * q)
        k += 2
        turn *= sign
    return total


@cache
def atan_fixed(p: int, q: int, bits: int) -> int:
    """Return ``atan(p/q) * 2**bits`` within one unit, for ``0 <= p <= q``."""
    work = bits + _GUARD
    if 2 * p > q:  # atan x = pi/4 - atan((1 - x)/(1 + x)), where the series is quick
        return (pi_fixed(work) // 4 - _series(q - p, q + p, work, -1)) >> _GUARD
    return _series(p, q, work, -1) >> _GUARD


@cache
def pi_fixed(bits: int) -> int:
    """Return ``pi * 2**bits`` within one unit (Machin 1706).

    Examples
    --------
    >>> pi_fixed(16)
    205887
    """
    work = bits + _GUARD
    return (16 * _series(1, 5, work, -1) - 4 * _series(1, 239, work, -1)) >> _GUARD


@cache
def log2_fixed(bits: int) -> int:
    """Return ``log(2) * 2**bits`` within one unit, ``18 atanh(1/26) - 2 atanh(1/4801) + 8 atanh(1/8749)``."""
    work = bits + _GUARD
    return (18 * _series(1, 26, work, 1) - 2 * _series(1, 4801, work, 1) + 8 * _series(1, 8749, work, 1)) >> _GUARD


def split(value: Fraction, parts: int = 2) -> tuple[float, ...]:
    """Return doubles whose sum is ``value`` to about 53 bits each."""
    found = []
    for _ in range(parts):
        head = float(value)
        found.append(head)
        value -= Fraction(head)
    return tuple(found)


def two_over_pi_words(count: int) -> list[int]:
    """Return the first ``count`` 32-bit words of the fraction ``2/pi``, truncated."""
    bits = 32 * count
    extra = 128
    value = (1 << (2 * (bits + extra) + 1)) // pi_fixed(bits + extra)
    top = value >> extra
    return [(top >> (32 * (count - 1 - i))) & 0xFFFFFFFF for i in range(count)]


#: pi enclosed by two neighbouring doubles.
PI = (3.141592653589793, 3.1415926535897936)
