"""Double-double arithmetic: unevaluated sums of two doubles, about 106 bits; and the constants made for it.

Relative errors (u = 2^-53) are proved by Joldes, Muller and Popescu, "Tight and rigorous error bounds for basic
building blocks of double-word arithmetic", ACM TOMS 44 (2017): sum 3 u^2 + 13 u^3, sum with a double 2 u^2, product
5 u^2, product with a double 2 u^2, quotient 15 u^2 + 56 u^3, all below 2^-102, without overflow or underflow.
"""

from fractions import Fraction
from functools import cache
from math import sqrt

from graphsynth.core.compilation import kernel
from graphsynth.core.intrinsics import fma
from graphsynth.intervals.kernels.rounding import ETA, PHI, add_down, add_up


@kernel(forceinline=True)
def two_sum(a, b):
    """Sum and error (Knuth)."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@kernel(forceinline=True)
def quick_two_sum(a, b):
    """Sum and error for ``|a| >= |b|`` (Dekker)."""
    s = a + b
    return s, b - (s - a)


@kernel(forceinline=True)
def add_double(ah, al, b):
    """Sum with a double (algorithm 4)."""
    s, e = two_sum(ah, b)
    return quick_two_sum(s, e + al)


@kernel(forceinline=True)
def add(ah, al, bh, bl):
    """Sum, accurate also under cancellation (algorithm 6)."""
    sh, sl = two_sum(ah, bh)
    th, tl = two_sum(al, bl)
    vh, vl = quick_two_sum(sh, sl + th)
    return quick_two_sum(vh, tl + vl)


@kernel(forceinline=True)
def multiply_double(ah, al, b):
    """Product with a double (algorithm 9)."""
    p = ah * b
    return quick_two_sum(p, fma(al, b, fma(ah, b, -p)))


@kernel(forceinline=True)
def multiply(ah, al, bh, bl):
    """Product (algorithm 12)."""
    p = ah * bh
    e = fma(ah, bh, -p)
    return quick_two_sum(p, e + fma(al, bh, fma(ah, bl, al * bl)))


@kernel(forceinline=True)
def divide(ah, al, bh, bl):
    """Quotient (algorithm 17)."""
    q = ah / bh
    rh, rl = multiply_double(bh, bl, q)
    d = (ah - rh) + (al - rl)
    return quick_two_sum(q, d / bh)


@kernel(forceinline=True)
def root(ah, al):
    """Square root of a positive number ([Lefèvre et al. 2023]: 25/8 u^2)."""
    s = sqrt(ah)
    r = fma(-s, s, ah)
    return quick_two_sum(s, (al + r) / (s + s))


@kernel(forceinline=True)
def polynomial(coefficients, exact, least, xh, xl):
    """Horner's scheme from the last coefficient to that of index ``least``; those from ``exact`` on as doubles."""
    tail = 0.0
    for k in range(coefficients.shape[0] - 1, exact - 1, -1):
        tail = tail * xh + coefficients[k, 0]
    h, l = tail, 0.0
    for k in range(exact - 1, least - 1, -1):
        h, l = multiply(h, l, xh, xl)
        h, l = add(h, l, coefficients[k, 0], coefficients[k, 1])
    return h, l


@kernel(forceinline=True)
def bounds(h, l, error):
    """Doubles on both sides of every number within ``error`` of ``h + l``."""
    d = l - error
    e = l + error
    return add_down(h, d - (PHI * abs(d) + ETA)), add_up(h, e + (PHI * abs(e) + ETA))


# --- constants to hundreds of bits, from integers alone; nothing here trusts a library
#
# Series with integer terms: atan(p/q) and atanh(1/q) in fixed point.  Each term is truncated by less than one unit, so
# the error is below the number of terms, and 32 guard bits are cut off at the end.

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
