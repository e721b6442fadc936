"""Directed rounding of single operations, compiled; the same results as ``graphsynth/intervals/rounding.py``.

The sign of a rounding error comes from one fused multiply-add that is written down where it is wanted.  The compiler
itself must not fuse anything: no ``fastmath`` anywhere, and a test compares with the uncompiled functions.
"""

from math import sqrt

from numba import types
from numba.extending import intrinsic

from graphsynth.compilation import kernel

PHI = 2.0**-53 * (1.0 + 2.0**-52)
ETA = 2.0**-1074
MAX = 1.7976931348623157e308
INF = float("inf")
NAN = float("nan")
PRODUCT_MIN = 2.0**-960
FACTOR_MAX = 2.0**500
DIVISOR_MIN = 2.0**-500
QUOTIENT_MIN = 2.0**-400
QUOTIENT_MAX = 2.0**490
ROOT_MAX = 2.0**1000


@intrinsic
def fma(typing_context, a, b, c):
    """Compute ``a * b + c`` with one rounding."""

    def build(context, builder, signature, args):
        return builder.fma(*args)

    return types.float64(types.float64, types.float64, types.float64), build


@kernel(forceinline=True)
def down(x, exact):
    """Move a nearest result down one step unless it is exact enough."""
    y = x if exact else x - (PHI * abs(x) + ETA)
    return MAX if x > MAX else y


@kernel(forceinline=True)
def up(x, exact):
    """Move a nearest result up one step unless it is exact enough."""
    y = x if exact else x + (PHI * abs(x) + ETA)
    return -MAX if x < -MAX else y


@kernel(forceinline=True)
def add_down(a, b):
    """Lower bound of a sum."""
    s = a + b
    t = s - a
    e = (a - (s - t)) + (b - t)
    return down(s, (e >= 0.0) & (e <= MAX))


@kernel(forceinline=True)
def add_up(a, b):
    """Upper bound of a sum."""
    s = a + b
    t = s - a
    e = (a - (s - t)) + (b - t)
    return up(s, (e <= 0.0) & (e >= -MAX))


@kernel(forceinline=True)
def multiply_both(a, b):
    """Lower and upper bound of a product, with ``0 * inf = 0``."""
    p = a * b
    e = fma(a, b, -p)
    p = 0.0 if p != p else p
    zero = (a == 0.0) | (b == 0.0)
    safe = abs(p) >= PRODUCT_MIN
    return down(p, zero | (safe & (e >= 0.0))), up(p, zero | (safe & (e <= 0.0)))


@kernel(forceinline=True)
def divide_both(a, b):
    """Lower and upper bound of a quotient, ``b`` not 0, ``inf / inf = 0``."""
    q = a / b
    r = fma(-q, b, a)
    q = 0.0 if q != q else q
    r = r if b > 0.0 else -r
    size = abs(q)
    safe = (abs(b) >= DIVISOR_MIN) & (abs(b) <= FACTOR_MAX) & (size >= QUOTIENT_MIN) & (size <= QUOTIENT_MAX)
    zero = a == 0.0
    return down(q, zero | (safe & (r >= 0.0))), up(q, zero | (safe & (r <= 0.0)))


@kernel(forceinline=True)
def root_down(a):
    """Lower bound of a root."""
    s = sqrt(a)
    r = fma(-s, s, a)
    return down(s, (a == 0.0) | ((a >= PRODUCT_MIN) & (a <= ROOT_MAX) & (r >= 0.0)))


@kernel(forceinline=True)
def root_up(a):
    """Upper bound of a root."""
    s = sqrt(a)
    r = fma(-s, s, a)
    return up(s, (a == 0.0) | (a > MAX) | ((a >= PRODUCT_MIN) & (a <= ROOT_MAX) & (r <= 0.0)))
