"""Interval operations in numpy alone, bounds in and bounds out: the reference of the compiled ones, to the bit.

An operation is done to nearest; an error-free transformation without fused operations then tells the sign of its
rounding error, and only a result on the wrong side is moved to its neighbour.  Operands and results of any size are
first scaled by powers of two to where the error is representable.  Proofs: ``docs/explanation/intervals.md``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Bounds = tuple[Array, Array]

MAX = float(np.finfo(np.float64).max)
#: Limits within which the error of a product or quotient is computed without scaling.
PRODUCT_MIN, FACTOR_MAX = 2.0**-960, 2.0**500
DIVISOR_MIN, QUOTIENT_MIN, QUOTIENT_MAX, ROOT_MAX = 2.0**-500, 2.0**-400, 2.0**490, 2.0**1000
#: Veltkamp's number, and a limit below which halving with it does not overflow.
SPLIT, SPLIT_MAX = 2.0**27 + 1.0, 2.0**900


def down(x: Array, exact: Mask | bool = False) -> Array:
    """Return the neighbour below except where ``x`` is a lower bound; an overflow becomes the largest number."""
    return np.where(x > MAX, MAX, np.where(exact, x, np.nextafter(x, -np.inf)))


def up(x: Array, exact: Mask | bool = False) -> Array:
    """Return the neighbour above except where ``x`` is an upper bound; ``-inf`` becomes the smallest number."""
    return np.where(x < -MAX, -MAX, np.where(exact, x, np.nextafter(x, np.inf)))


def two_product(a: Array, b: Array) -> tuple[Array, Array]:
    """Product and its rounding error (Dekker, Veltkamp), exact within the limits above."""
    p = a * b
    ca, cb = SPLIT * a, SPLIT * b
    ah, bh = ca - (ca - a), cb - (cb - b)
    al, bl = a - ah, b - bh
    return p, al * bl - (((p - ah * bh) - al * bh) - ah * bl)


def add_two(a: Array, b: Array) -> tuple[Array, Mask, Mask]:
    """Return the sum, and where it is a lower and where an upper bound of the exact sum.

    The error of a sum with the larger operand first is exact and overflows only with the sum itself [Dekker 1971].
    """
    s = a + b
    first = np.abs(a) >= np.abs(b)
    e = np.where(first, b, a) - (s - np.where(first, a, b))
    return s, (e >= 0.0) & (e <= MAX), (e <= 0.0) & (e >= -MAX)


def multiply_two(a: Array, b: Array) -> tuple[Array, Array]:
    """Return the product with ``0 * inf = 0`` and a number with the sign of its error; NaN beside an infinity.

    Beside a factor so large that its halves overflow the other one is below 2^124; where the product is tiny both are
    below 2^114: scaled by powers of two, everything on the way to the error is exact.
    """
    p = a * b
    small, big, large = np.abs(p) < PRODUCT_MIN, np.abs(a) > SPLIT_MAX, np.abs(b) > SPLIT_MAX
    if not (small | big | large).any():
        return p, two_product(a, b)[1]
    with_a = np.where(small, 2.0**600, np.where(big, 2.0**-300, np.where(large, 2.0**200, 1.0)))
    with_b = np.where(small, 2.0**600, np.where(big, 2.0**200, np.where(large, 2.0**-300, 1.0)))
    q, e = two_product(a * with_a, b * with_b)
    scaled = p * np.minimum(with_a, with_b) * np.maximum(with_a, with_b)
    return np.where(np.isnan(p), 0.0, p), (q - scaled) + e


def divide_two(a: Array, b: Array) -> tuple[Array, Array]:
    """Return the quotient (``b`` not 0, ``inf / inf = 0``) and a number with the sign of its error; NaN by infinity."""
    q = a / b
    q = np.where(np.isnan(q), 0.0, q)
    p, e = two_product(q, b)
    r = (a - p) - e
    size, divisor = np.abs(q), np.abs(b)
    ordinary = (size >= QUOTIENT_MIN) & (size <= QUOTIENT_MAX) & (divisor >= DIVISOR_MIN) & (divisor <= FACTOR_MAX)
    if not ordinary.all():
        r = np.where(ordinary, r, _remainder(a, b, q))
    return q, np.where(b > 0.0, r, -r)


def _remainder(a: Array, b: Array, q: Array) -> Array:
    """Return a number with the sign of ``a - q b`` for numbers of any size, from their fractions and exponents."""
    (fa, na), (fb, nb), (fq, nq) = np.frexp(a), np.frexp(b), np.frexp(q)
    p, e = two_product(fq, fb)
    return np.asarray((np.ldexp(fa, np.clip(na - nb - nq, -100, 100)) - p) - e)


def square_root(a: Array) -> tuple[Array, Mask, Mask]:
    """Return the root of ``a >= 0``, and where it is a lower and where an upper bound."""
    s = np.sqrt(a)
    f = np.where(a < PRODUCT_MIN, 2.0**300, np.where(a > ROOT_MAX, 2.0**-300, 1.0))
    p, e = two_product(s * f, s * f)
    r = (a * f * f - p) - e
    return s, r >= 0.0, r <= 0.0


def _masked(lo: Array, hi: Array, void: Mask) -> Bounds:
    return np.where(void, np.inf, lo), np.where(void, -np.inf, hi)


def add(al: Array, ah: Array, bl: Array, bh: Array) -> Bounds:
    """Sum."""
    s, below, _ = add_two(al, bl)
    t, _, above = add_two(ah, bh)
    return _masked(down(s, below), up(t, above), (al > ah) | (bl > bh))


def subtract(al: Array, ah: Array, bl: Array, bh: Array) -> Bounds:
    """Difference."""
    s, below, _ = add_two(al, -bh)
    t, _, above = add_two(ah, -bl)
    return _masked(down(s, below), up(t, above), (al > ah) | (bl > bh))


def _ends(values: list[tuple[Array, Array]]) -> tuple[Array, Array, Mask, Mask]:
    """Least and largest of four nearest values with the signs of their errors, and whether they bound the exact ones.

    An error that is NaN belongs to a product with an infinity, which is exact.
    """
    lo = np.minimum(np.minimum(values[0][0], values[1][0]), np.minimum(values[2][0], values[3][0]))
    hi = np.maximum(np.maximum(values[0][0], values[1][0]), np.maximum(values[2][0], values[3][0]))
    below, above = np.ones(lo.shape, dtype=np.bool_), np.ones(lo.shape, dtype=np.bool_)
    for value, error in values:
        below &= ~((value == lo) & (error < 0.0))
        above &= ~((value == hi) & (error > 0.0))
    return lo, hi, below, above


def multiply(al: Array, ah: Array, bl: Array, bh: Array) -> Bounds:
    """Product, with ``0 * inf = 0``."""
    lo, hi, below, above = _ends([multiply_two(a, b) for a in (al, ah) for b in (bl, bh)])
    return _masked(down(lo, below), up(hi, above), (al > ah) | (bl > bh))


def divide(al: Array, ah: Array, bl: Array, bh: Array) -> Bounds:
    """Quotients by the nonzero part of the divisor."""
    touched = (bl <= 0.0) & (bh >= 0.0)
    if not touched.any():
        return _divide_nonzero(al, ah, bl, bh)
    # a divisor [0, h] or [l, 0] is replaced by its far end; the near end gives an infinity in the direction of the sign
    far = np.where(bl == 0.0, bh, bl)
    safe = np.where(touched, np.where(far == 0.0, 1.0, far), bl), np.where(touched, np.where(far == 0.0, 1.0, far), bh)
    lo, hi = _divide_nonzero(al, ah, *safe)
    positive, negative = (al >= 0.0), (ah <= 0.0)
    upward = (positive & (bl == 0.0)) | (negative & (bh == 0.0))
    lo = np.where(touched, np.where(upward & (lo > 0.0), lo, np.where(upward, 0.0, -np.inf)), lo)
    hi = np.where(touched, np.where(upward, np.inf, np.where(hi < 0.0, hi, 0.0)), hi)
    across = touched & (((bl < 0.0) & (bh > 0.0)) | ((al < 0.0) & (ah > 0.0)))
    lo, hi = np.where(across, -np.inf, lo), np.where(across, np.inf, hi)
    nothing = touched & (al == 0.0) & (ah == 0.0)
    lo, hi = np.where(nothing, 0.0, lo), np.where(nothing, 0.0, hi)
    return _masked(lo, hi, (al > ah) | (bl > bh) | ((bl == 0.0) & (bh == 0.0)))


def _divide_nonzero(al: Array, ah: Array, bl: Array, bh: Array) -> Bounds:
    lo, hi, below, above = _ends([divide_two(a, b) for a in (al, ah) for b in (bl, bh)])
    return _masked(down(lo, below), up(hi, above), (al > ah) | (bl > bh))


def _one_product(a: Array, b: Array) -> Bounds:
    """Lower and upper bound of the product of two numbers that are not negative."""
    p, e = multiply_two(a, b)
    zero = (a == 0.0) | (b == 0.0)
    return down(p, zero | (e >= 0.0)), up(p, zero | (e <= 0.0))


def absolute(al: Array, ah: Array) -> Bounds:
    """Absolute value."""
    return _masked(np.maximum(np.maximum(al, -ah), 0.0), np.maximum(-al, ah), al > ah)


def square(al: Array, ah: Array) -> Bounds:
    """Square, not the product with itself."""
    low, high = absolute(al, ah)
    return _masked(_one_product(low, low)[0], _one_product(high, high)[1], al > ah)


def root(al: Array, ah: Array) -> Bounds:
    """Square roots of the part at or above 0."""
    low, high = np.maximum(al, 0.0), np.maximum(ah, 0.0)
    s, below, _ = square_root(low)
    t, _, above = square_root(high)
    return _masked(down(s, below), up(t, above), (al > ah) | (ah < 0.0))


def _power_bounds(x: Array, n: int, side: int) -> Array:
    """Lower (side 0) or upper (side 1) bound of ``x**n`` for ``x >= 0``, ``n >= 1``, by repeated squaring."""
    result, factor = np.ones_like(x), x
    while True:
        if n & 1:
            result = _one_product(result, factor)[side]
        n >>= 1
        if n == 0:
            return result
        factor = _one_product(factor, factor)[side]


def power(al: Array, ah: Array, n: int) -> Bounds:
    """Integer power; a negative exponent is the quotient of 1 by the positive one."""
    void = al > ah
    if n == 0:
        return _masked(np.ones_like(al), np.ones_like(ah), void)
    m = abs(n)
    if m % 2:
        lo = np.where(al >= 0.0, _power_bounds(np.abs(al), m, 0), -_power_bounds(np.abs(al), m, 1))
        hi = np.where(ah >= 0.0, _power_bounds(np.abs(ah), m, 1), -_power_bounds(np.abs(ah), m, 0))
    else:
        low, high = absolute(al, ah)
        lo, hi = _power_bounds(low, m, 0), _power_bounds(high, m, 1)
    if n < 0:
        lo, hi = divide(np.ones_like(lo), np.ones_like(hi), lo, hi)
    return _masked(lo, hi, void)
