"""Sine, cosine, arctangent of two numbers and hypotenuse for other kernels: the same bits on every machine.

Elementary functions of a C library differ in their last bits from one library to the next, and there is none in
WebAssembly.  These are sums, products, quotients and roots alone.  Sine, cosine and arctangent err by less than 0.501
units in the last place, the hypotenuse by two half units and a bit; special arguments give what C gives.  Proofs:
``docs/theory/elementary-functions.md``.
"""

import math
from fractions import Fraction

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels import double_double as dd, quick
from graphsynth.intervals.kernels.rounding import INF
from graphsynth.intervals.kernels.trigonometry import cosine_polynomial, reduce, sine_polynomial

_PI_H, _PI_L = dd.split(Fraction(dd.pi_fixed(256), 2**256))
_HALF_H, _HALF_L = 0.5 * _PI_H, 0.5 * _PI_L
#: Below this the table's absolute error counts; sin x is x, atan q is q.
_SMALL_SINE, _TINY, _SMALL_QUOTIENT = 2.0**-30, 2.0**-26, 2.0**-32
_LARGE, _LITTLE, _SHRINK, _GROW = 2.0**500, 2.0**-400, 2.0**-600, 2.0**600


@kernel
def _rarely(x, turn):
    """``sin(x + turn pi/2)`` where the tables do not serve: near its roots, far from zero, of no number."""
    if not abs(x) < INF:
        return x - x
    _, nearest, h, l = reduce(x)
    k = (nearest + turn) & 3
    h, l = sine_polynomial(h, l) if k & 1 == 0 else cosine_polynomial(h, l)
    return -(h + l) if k >= 2 else h + l


@kernel
def sin(x):
    """Sine."""
    if abs(x) < _TINY:
        return x
    h, _, _ = quick.sine_pair(x, 0)
    return h if (abs(h) > _SMALL_SINE) & (abs(x) < quick.SINE_MOST) else _rarely(x, 0)


@kernel
def cos(x):
    """Cosine."""
    h, _, _ = quick.sine_pair(x, 1)
    return h if (abs(h) > _SMALL_SINE) & (abs(x) < quick.SINE_MOST) else _rarely(x, 1)


@kernel
def atan2(y, x):
    """Angle of the vector (x, y), between -pi and pi."""
    if x != x or y != y:
        return x + y
    a, b = abs(y), abs(x)
    steep = a > b
    if steep:
        a, b = b, a
    behind = math.copysign(1.0, x) < 0.0
    if b == INF:
        a, b = 1.0 if a == INF else 0.0, 1.0
    elif b > _LARGE:
        a, b = a * _SHRINK, b * _SHRINK
    elif b < _LITTLE:
        a, b = a * _GROW, b * _GROW
    q = a / b if b > 0.0 else 0.0
    if q < _SMALL_QUOTIENT and not steep and not behind:
        return math.copysign(abs(y) / abs(x) if b > 0.0 else 0.0, y)
    # the angle of the rounded quotient, and what the rounding took from it
    h, l = quick.atan_pair(q)
    if b > 0.0:
        p, high, part = q * b, quick.cut(q), quick.cut(b)
        error = (((high * part - p) + high * (b - part)) + (q - high) * part) + (q - high) * (b - part)
        l += ((a - p) - error) / (b * (1.0 + q * q))
    if steep:
        h, e = dd.two_sum(_HALF_H, -h)
        l = e + (_HALF_L - l)
    if behind:
        h, e = dd.two_sum(_PI_H, -h)
        l = e + (_PI_L - l)
    return math.copysign(h + l, y)


@kernel
def _rescaled(a, b):
    """Length of the vector (a, b) of any numbers from zero on."""
    if a == INF or b == INF:
        return INF
    large = a if a > b else b
    if a != a or b != b or large == 0.0:
        return a + b
    a, b, back = (a * _SHRINK, b * _SHRINK, _GROW) if large > 1.0 else (a * _GROW, b * _GROW, _SHRINK)
    return math.sqrt(a * a + b * b) * back


@kernel(forceinline=True)
def hypot(x, y):
    """Length of the vector (x, y)."""
    a, b = abs(x), abs(y)
    large = a if a > b else b
    if (large < _LARGE) & (large > _LITTLE):
        return math.sqrt(a * a + b * b)
    return _rescaled(a, b)
