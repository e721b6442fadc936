"""Directed rounding of single operations, the numpy form.

An operation is done to nearest; an error-free transformation then tells the sign of its rounding error, and only a
result on the wrong side is moved to its neighbour.  Operands and results of any size are first scaled by powers of two
to where the error is representable, so every bound is the tightest floating-point bound, without exception.
Nothing here depends on the rounding mode being changed, on fused operations, or on the order of evaluation of an
optimiser.  ``kernels/rounding.py`` holds the same decisions compiled; results are the same to the bit.
Proofs: ``docs/explanation/intervals.md``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

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


def add(a: Array, b: Array) -> tuple[Array, Mask, Mask]:
    """Return the sum, and where it is a lower and where an upper bound of the exact sum.

    The error of a sum with the larger operand first is exact and overflows only with the sum itself [Dekker 1971].
    """
    s = a + b
    first = np.abs(a) >= np.abs(b)
    e = np.where(first, b, a) - (s - np.where(first, a, b))
    return s, (e >= 0.0) & (e <= MAX), (e <= 0.0) & (e >= -MAX)


def multiply(a: Array, b: Array) -> tuple[Array, Array]:
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


def divide(a: Array, b: Array) -> tuple[Array, Array]:
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
