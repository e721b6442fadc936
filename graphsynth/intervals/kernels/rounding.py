"""Directed rounding of single operations, compiled; the same results as ``graphsynth/intervals/rounding.py``.

The sign of a rounding error comes from one fused multiply-add that is written down where it is wanted.  The compiler
itself must not fuse anything: no ``fastmath`` anywhere, and a test compares with the uncompiled functions.
"""

from math import frexp, ldexp, sqrt

from graphsynth.core.compilation import kernel
from graphsynth.core.intrinsics import fma

PHI = 2.0**-53 * (1.0 + 2.0**-52)
ETA = 2.0**-1074
MAX = 1.7976931348623157e308
INF = float("inf")
PRODUCT_MIN = 2.0**-960
ROOT_MAX = 2.0**1000
NORMAL_MIN = 2.0**-1022
SCALE = 2.0**600


@kernel(forceinline=True)
def down(x, exact):
    """Move a nearest result to its neighbour below unless it is a lower bound; an overflow to the largest number."""
    size = abs(x)
    y = fma(size, -PHI, x) if size >= NORMAL_MIN else x - ETA
    return MAX if x > MAX else (x if exact else y)


@kernel(forceinline=True)
def up(x, exact):
    """Move a nearest result to its neighbour above unless it is an upper bound; ``-inf`` to the smallest number."""
    size = abs(x)
    y = fma(size, PHI, x) if size >= NORMAL_MIN else x + ETA
    return -MAX if x < -MAX else (x if exact else y)


@kernel(forceinline=True)
def _sum(a, b):
    """Sum and its error, which overflows only with the sum [Dekker 1971]."""
    s = a + b
    first = abs(a) >= abs(b)
    return s, (b if first else a) - (s - (a if first else b))


@kernel(forceinline=True)
def add_down(a, b):
    """Lower bound of a sum."""
    s, e = _sum(a, b)
    return down(s, (e >= 0.0) & (e <= MAX))


@kernel(forceinline=True)
def add_up(a, b):
    """Upper bound of a sum."""
    s, e = _sum(a, b)
    return up(s, (e <= 0.0) & (e >= -MAX))


@kernel(forceinline=True)
def excess(a, b, p):
    """Return a number with the sign of ``a b - p``; NaN beside an infinity.

    A tiny p is scaled with both factors, so that no part of the difference vanishes; a product that is not tiny may
    overflow then, with the right sign.
    """
    tiny = abs(p) < PRODUCT_MIN
    scaled = fma(a * SCALE, b * SCALE, -p * SCALE * SCALE)
    return scaled if tiny else fma(a, b, -p)


@kernel(forceinline=True)
def multiply_both(a, b):
    """Lower and upper bound of a product, with ``0 * inf = 0``."""
    p = a * b
    p = 0.0 if p != p else p
    e = excess(a, b, p)
    zero = (a == 0.0) | (b == 0.0)
    return down(p, zero | (e >= 0.0)), up(p, zero | (e <= 0.0))


@kernel
def remainder(a, b, q):
    """Return a number with the sign of ``a - q b`` for numbers of any size, from their fractions and exponents."""
    fa, na = frexp(a)
    fb, nb = frexp(b)
    fq, nq = frexp(q)
    return fma(-fq, fb, ldexp(fa, min(max(na - nb - nq, -100), 100)))


@kernel
def divide_both(a, b):
    """Lower and upper bound of a quotient, ``b`` not 0, ``inf / inf = 0``."""
    q = a / b
    q = 0.0 if q != q else q
    r = remainder(a, b, q)
    r = r if b > 0.0 else -r
    zero = (a == 0.0) | (abs(b) > MAX)
    return down(q, zero | (r >= 0.0)), up(q, zero | (r <= 0.0))


@kernel(forceinline=True)
def root_both(a):
    """Lower and upper bound of a root."""
    s = sqrt(a)
    f = 2.0**300 if a < PRODUCT_MIN else (2.0**-300 if a > ROOT_MAX else 1.0)
    r = fma(-s * f, s * f, a * f * f)  # a number with the sign of the error
    return down(s, r >= 0.0), up(s, r <= 0.0)
