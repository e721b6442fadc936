"""Directed rounding of single operations, the numpy form.

An operation is done to nearest; an error-free transformation then tells the sign of its rounding error, and only a
result on the wrong side is moved by one step with the predecessor and successor bounds of Rump, Zimmermann, Boldo and
Melquiond (2009), ``x -+ (phi |x| + eta)``.  So results are the tightest floating-point bounds wherever the error is
representable (roughly, magnitudes between 2^-400 and 2^490), and at most one step wider elsewhere (two around 2^-1022).
Nothing here depends on the rounding mode being changed, on fused operations, or on the order of evaluation of an
optimiser.  ``kernels/rounding.py`` holds the same formulas compiled; results are the same to the bit.
Proofs: ``docs/explanation/intervals.md``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["ETA", "MAX", "PHI", "PRODUCT_MIN", "SPLIT", "SPLIT_MAX", "down", "up"]

Array = NDArray[np.float64]

PHI = 2.0**-53 * (1.0 + 2.0**-52)
ETA = 2.0**-1074
MAX = float(np.finfo(np.float64).max)
#: Limits within which the error of a product or quotient is computed without error itself.
PRODUCT_MIN, FACTOR_MAX = 2.0**-960, 2.0**500
DIVISOR_MIN, QUOTIENT_MIN, QUOTIENT_MAX, ROOT_MAX = 2.0**-500, 2.0**-400, 2.0**490, 2.0**1000
#: Veltkamp's number, and a limit below which halving with it does not overflow.
SPLIT, SPLIT_MAX = 2.0**27 + 1.0, 2.0**900


def down(x: Array, exact: NDArray[np.bool_] | bool = False) -> Array:
    """Move ``x`` down one step except where it is already a lower bound; an overflow becomes the largest number."""
    y = np.where(exact, x, x - (PHI * np.abs(x) + ETA))
    return np.where(x > MAX, MAX, y)


def up(x: Array, exact: NDArray[np.bool_] | bool = False) -> Array:
    """Move ``x`` up one step except where it is already an upper bound; ``-inf`` becomes the smallest number."""
    y = np.where(exact, x, x + (PHI * np.abs(x) + ETA))
    return np.where(x < -MAX, -MAX, y)


def two_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """Sum and its rounding error (Knuth, Moller); the error is not finite where an intermediate overflows."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def two_product(a: Array, b: Array) -> tuple[Array, Array]:
    """Product and its rounding error (Dekker, Veltkamp), exact within the limits above."""
    p = a * b
    ca, cb = SPLIT * a, SPLIT * b
    ah, bh = ca - (ca - a), cb - (cb - b)
    al, bl = a - ah, b - bh
    return p, al * bl - (((p - ah * bh) - al * bh) - ah * bl)


def add(a: Array, b: Array) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the sum, and where it is a lower and where an upper bound of the exact sum."""
    s, e = two_sum(a, b)
    return s, (e >= 0.0) & (e <= MAX), (e <= 0.0) & (e >= -MAX)


def multiply(a: Array, b: Array) -> tuple[Array, Array]:
    """Return the product with ``0 * inf = 0`` and a number with the sign of its error; NaN beside an infinity.

    The sign is right for products of at least ``PRODUCT_MIN``.  Where a factor is so large that something on the way
    to the error would overflow, the other one is below 2^124, and both are scaled by powers of two.
    """
    p = a * b
    big, large = np.abs(a) > SPLIT_MAX, np.abs(b) > SPLIT_MAX
    if (big | large).any():
        a = a * np.where(big, 2.0**-300, np.where(large, 2.0**200, 1.0))
        b = b * np.where(big, 2.0**200, np.where(large, 2.0**-300, 1.0))
    _, e = two_product(a, b)
    return np.where(np.isnan(p), 0.0, p), e


def divide(a: Array, b: Array) -> tuple[Array, Array]:
    """Return the quotient (``b`` not 0, ``inf / inf = 0``) and a number with the sign of its error."""
    q = a / b
    p, e = two_product(q, b)
    r = (a - p) - e
    return np.where(np.isnan(q), 0.0, q), np.where(b > 0.0, r, -r)


def square_root(a: Array) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the root of ``a >= 0``, and where it is a lower and where an upper bound."""
    s = np.sqrt(a)
    p, e = two_product(s, s)
    r = (a - p) - e
    zero = a == 0.0
    safe = (a >= PRODUCT_MIN) & (a <= ROOT_MAX)
    return s, zero | (safe & (r >= 0.0)), zero | (safe & (r <= 0.0)) | (a > MAX)
