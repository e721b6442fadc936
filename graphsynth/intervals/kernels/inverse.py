"""Inverse tangent, sine and cosine, and the angle of a box, with certified bounds.

``atan`` reduces to ``|t| <= 1/32`` by the addition theorem with a table of ``atan(k/16)`` computed from integers; the
others are arctangents of double-double quotients.  Proofs: ``docs/explanation/intervals.md``.
"""

from fractions import Fraction

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels import double_double as dd, quick
from graphsynth.intervals.kernels.rounding import INF, divide_both, down, up

_TABLE = np.array([dd.split(Fraction(dd.atan_fixed(k, 16, 256), 2**256)) for k in range(17)])
_ODD = np.array([dd.split(Fraction((-1) ** k, 2 * k + 1)) for k in range(12)])
_PI_H, _PI_L = dd.split(Fraction(dd.pi_fixed(256), 2**256))
_HALF_H, _HALF_L = 0.5 * _PI_H, 0.5 * _PI_L
PI_DOWN, PI_UP = dd.PI
RELATIVE, ATAN_RELATIVE = 2.0**-68, 2.0**-78
_SMALL = 2.0**-27


@kernel
def atan_unit(h, l):
    """Arctangent of ``0 <= h + l <= 1 + 1/32``."""
    k = min(int(h * 16.0 + 0.5), 16)
    if k > 0:
        c = k / 16.0
        nh, nl = dd.add_double(h, l, -c)
        th, tl = dd.multiply_double(h, l, c)
        th, tl = dd.add_double(th, tl, 1.0)
        h, l = dd.divide(nh, nl, th, tl)
    sh, sl = dd.multiply(h, l, h, l)
    ph, pl = dd.polynomial(_ODD, 4, 1, sh, sl)
    ph, pl = dd.multiply(ph, pl, sh, sl)
    ph, pl = dd.multiply(ph, pl, h, l)
    h, l = dd.add(h, l, ph, pl)
    if k > 0:
        h, l = dd.add(_TABLE[k, 0], _TABLE[k, 1], h, l)
    return h, l


@kernel
def atan_at(x):
    """Bounds of the arctangent; infinities allowed."""
    size = abs(x)
    if size < _SMALL:  # x - x^3/3 < atan x < x
        return (down(x, x == 0.0), x) if x >= 0.0 else (x, up(x, False))
    if size <= 1.0:
        h, l = atan_unit(size, 0.0)
    else:
        h, l = dd.divide(1.0, 0.0, size, 0.0) if size < 2.0**900 else (0.0, 0.0)
        h, l = atan_unit(h, l)
        h, l = dd.add(_HALF_H, _HALF_L, -h, -l)
    lo, hi = dd.bounds(h, l, h * ATAN_RELATIVE)
    return (lo, hi) if x > 0.0 else (-hi, -lo)


@kernel
def atan(al, ah):
    """Range of the arctangent."""
    if al > ah:
        return INF, -INF
    lo, hi = quick.atan(al, ah)
    if lo == lo:
        return lo, hi
    return atan_at(al)[0], atan_at(ah)[1]


@kernel
def asin_at(x):
    """Bounds of the arcsine of ``|x| <= 1``."""
    size = abs(x)
    if size < _SMALL:  # x < asin x < x + x^3/5
        return (x, up(x, x == 0.0)) if x >= 0.0 else (down(x, False), x)
    if size == 1.0:
        h, l = _HALF_H, _HALF_L
    else:
        ah, al = dd.two_sum(1.0, -size)
        bh, bl = dd.two_sum(1.0, size)
        rh, rl = dd.multiply(ah, al, bh, bl)
        rh, rl = dd.root(rh, rl)
        if size <= 0.7071067811865475:
            h, l = dd.divide(size, 0.0, rh, rl)
            h, l = atan_unit(h, l)
        else:
            h, l = dd.divide(rh, rl, size, 0.0)
            h, l = atan_unit(h, l)
            h, l = dd.add(_HALF_H, _HALF_L, -h, -l)
    lo, hi = dd.bounds(h, l, h * RELATIVE)
    return (lo, hi) if x > 0.0 else (-hi, -lo)


@kernel
def acos_at(x):
    """Bounds of the arccosine of ``|x| <= 1``."""
    if x == 1.0:
        return 0.0, 0.0
    size = abs(x)
    ah, al = dd.two_sum(1.0, -size)
    bh, bl = dd.two_sum(1.0, size)
    h, l = dd.divide(ah, al, bh, bl)
    if h > 0.0:
        h, l = dd.root(h, l)
    h, l = atan_unit(h, l)
    h, l = 2.0 * h, 2.0 * l
    if x < 0.0:
        h, l = dd.add(_PI_H, _PI_L, -h, -l)
    return dd.bounds(h, l, h * RELATIVE)


@kernel
def asin(al, ah):
    """Range of the arcsine of the part in [-1, 1]."""
    if al > ah or al > 1.0 or ah < -1.0:
        return INF, -INF
    return asin_at(max(al, -1.0))[0], asin_at(min(ah, 1.0))[1]


@kernel
def acos(al, ah):
    """Range of the arccosine of the part in [-1, 1]."""
    if al > ah or al > 1.0 or ah < -1.0:
        return INF, -INF
    return max(acos_at(min(ah, 1.0))[0], 0.0), acos_at(max(al, -1.0))[1]


@kernel
def angle_at(y, x):
    """Bounds of ``atan2(y, x)`` for ``y >= 0``, not both 0; one may be infinite."""
    if y == 0.0 or abs(x) == INF:
        return (0.0, 0.0) if x > 0.0 else (PI_DOWN, PI_UP)
    if x == 0.0 or y == INF:
        return 0.5 * PI_DOWN, 0.5 * PI_UP
    size = abs(x)
    if max(size, y) < 2.0**-500:
        y, x, size = y * 2.0**500, x * 2.0**500, size * 2.0**500
    if max(size, y) > 2.0**900:
        # what is lost by this scaling is below 2^-1074 next to a number of at least 2^700
        if min(size, y) < 2.0**-100:
            if y < size:
                lo, hi = divide_both(y, size)
                return (max(down(lo, False), 0.0), hi) if x > 0.0 else (PI_DOWN, PI_UP)
            return down(0.5 * PI_DOWN, False), up(0.5 * PI_UP, False)
        y, x, size = y * 2.0**-200, x * 2.0**-200, size * 2.0**-200
    if y <= size:
        q = y / size
        if q < _SMALL and x > 0.0:  # q - q^3/3 < atan q < q
            lo, hi = divide_both(y, size)
            return max(down(lo, False), 0.0), hi
        h, l = dd.divide(y, 0.0, size, 0.0) if q > 2.0**-900 else (0.0, 0.0)
        h, l = atan_unit(h, l) if h <= 1.0 else (_TABLE[16, 0], _TABLE[16, 1])
        if x < 0.0:
            h, l = dd.add(_PI_H, _PI_L, -h, -l)
    else:
        h, l = dd.divide(size, 0.0, y, 0.0) if size / y > 2.0**-900 else (0.0, 0.0)
        h, l = atan_unit(h, l)
        if x > 0.0:
            h, l = -h, -l
        h, l = dd.add(_HALF_H, _HALF_L, h, l)
    return dd.bounds(h, l, h * RELATIVE)


@kernel
def _angle_above(yl, yh, xl, xh):
    """Range for ``yl >= 0``, without the origin inside; the extremes lie at corners."""
    if yh == 0.0 and xl >= 0.0:
        return 0.0, 0.0
    if yh == 0.0 and xh <= 0.0:
        return PI_DOWN, PI_UP
    if yl == 0.0 and xl < 0.0 < xh:  # the origin on the border: all of [0, pi]
        return 0.0, PI_UP
    yl = 0.0 if yl < 0.0 else yl
    low_y = yl if xh > 0.0 else yh
    high_y = yh if xl > 0.0 else yl
    if low_y == 0.0 and xh == 0.0:
        low = 0.5 * PI_DOWN
    else:
        low = angle_at(low_y, xh)[0]
    if high_y == 0.0 and xl == 0.0:
        high = 0.5 * PI_UP
    else:
        high = angle_at(high_y, xl)[1]
    return low, high


@kernel
def atan2(yl, yh, xl, xh):
    """Range of the angle of the points of a box; ``[-pi, pi]`` where the cut is crossed."""
    if yl > yh or xl > xh or (yl == 0.0 and yh == 0.0 and xl == 0.0 and xh == 0.0):
        return INF, -INF
    if yl >= 0.0:
        return _angle_above(yl, yh, xl, xh)
    if yh < 0.0 or (yh == 0.0 and xl >= 0.0):
        lo, hi = _angle_above(-yh, -yl, xl, xh)
        return -hi, -lo
    if xl < 0.0:
        return -PI_UP, PI_UP
    if xl == 0.0:
        return -0.5 * PI_UP, 0.5 * PI_UP
    return -angle_at(-yl, xl)[1], angle_at(yh, xl)[1]
