"""Exponential, logarithm and hypotenuse with certified bounds; proofs in ``docs/explanation/intervals.md``."""

from fractions import Fraction
from math import factorial, frexp, ldexp

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.core.intrinsics import fma
from graphsynth.intervals.kernels import double_double as dd, quick
from graphsynth.intervals.kernels.rounding import ETA, INF, MAX, add_down, add_up, multiply_both, root_both, up

_LOG2 = Fraction(dd.log2_fixed(300), 2**300)
_TOP = float(Fraction(int(_LOG2 * 2**40), 2**40))  # 40 bits: its products with exponents are exact
_MID, _LOW = dd.split(_LOG2 - Fraction(_TOP))
_LOG2_H, _LOG2_L = dd.split(_LOG2)
_EXP = np.array([dd.split(Fraction(1, factorial(k))) for k in range(21)])
_ODD = np.array([dd.split(Fraction(2, 2 * k + 1)) for k in range(20)])
_EXP_EXACT, _LOG_EXACT = 10, 7
RELATIVE, HYPOT_RELATIVE = 2.0**-78, 2.0**-66


@kernel
def exp_at(x):
    """Bounds of the exponential; infinities allowed."""
    if x == 0.0:
        return 1.0, 1.0
    if x != x:
        return x, x
    if x > 709.8:
        return MAX, INF
    if x < -745.2:
        return 0.0, ETA
    k = np.floor(x * 1.4426950408889634 + 0.5)
    h, l = dd.two_sum(x, -k * _TOP)
    mh, ml = dd.multiply_double(_MID, _LOW, k)
    h, l = dd.add(h, l, -mh, -ml)
    ph, pl = dd.polynomial(_EXP, _EXP_EXACT, 0, h, l)
    lo, hi = dd.bounds(ph, pl, ph * RELATIVE)
    if k == 0.0:
        lo, hi = (max(lo, 1.0), hi) if x > 0.0 else (lo, min(hi, 1.0))
    n = int(k)
    half = n // 2
    a, b = ldexp(1.0, half), ldexp(1.0, n - half)
    if n > -1000:
        lo, hi = lo * a * b, hi * a * b  # exact, or an overflow
    else:
        lo, hi = multiply_both(lo * a, b)[0], multiply_both(hi * a, b)[1]
    return max(min(lo, MAX), 0.0), hi


@kernel
def log_at(x):
    """Bounds of the logarithm of ``x >= 0``; infinities allowed."""
    if x == 0.0:
        return -INF, -INF
    if x == INF:
        return MAX, INF
    if x == 1.0:
        return 0.0, 0.0
    m, e = frexp(x)
    if m < 0.7071067811865476:
        m, e = 2.0 * m, e - 1
    ah, al = dd.two_sum(m, 1.0)
    h, l = dd.divide(m - 1.0, 0.0, ah, al)
    sh, sl = dd.multiply(h, l, h, l)
    ph, pl = dd.polynomial(_ODD, _LOG_EXACT, 0, sh, sl)
    h, l = dd.multiply(ph, pl, h, l)
    if e != 0:
        lh, ll = dd.multiply_double(_LOG2_H, _LOG2_L, float(e))
        h, l = dd.add(lh, ll, h, l)
    return dd.bounds(h, l, abs(h) * RELATIVE)


@kernel
def exp(al, ah):
    """Range of the exponential."""
    if al > ah:
        return INF, -INF
    lo, hi = quick.exp(al, ah)
    if lo == lo:
        return lo, hi
    return 0.0 if al == -INF else exp_at(al)[0], INF if ah == INF else exp_at(ah)[1]


@kernel
def log(al, ah):
    """Range of the logarithm of the part above 0."""
    if al > ah or ah <= 0.0:
        return INF, -INF
    lo, hi = quick.log(al, ah)
    if lo == lo:
        return lo, hi
    return log_at(max(al, 0.0))[0], log_at(ah)[1]


@kernel
def hypot(al, ah, bl, bh):
    """Range of ``sqrt(x^2 + y^2)``."""
    if al > ah or bl > bh:
        return INF, -INF
    x1 = al if al > 0.0 else (-ah if ah < 0.0 else 0.0)
    y1 = bl if bl > 0.0 else (-bh if bh < 0.0 else 0.0)
    return _hypot_at(x1, y1)[0], _hypot_at(max(-al, ah), max(-bl, bh))[1]


@kernel
def _hypot_at(x, y):
    """Bounds for ``x, y >= 0``."""
    if x == 0.0 or y == 0.0:
        return x + y, x + y
    big, small = max(x, y), min(x, y)
    if big == INF:
        return MAX, INF
    scale = 1.0
    if big > 2.0**480:
        scale = 2.0**-600
    elif big < 2.0**-400:
        scale = 2.0**600
    a = big * scale
    b = small * scale
    if b < a * 2.0**-30:  # hypot - big < small^2 / (2 big), less than a step
        return big, up(big, False)
    ph, qh = a * a, b * b
    h, l = dd.add(ph, fma(a, a, -ph), qh, fma(b, b, -qh))
    h, l = dd.root(h, l)
    lo, hi = dd.bounds(h, l, h * HYPOT_RELATIVE)
    # roots of bounds are wider, but exact where the squares and their sum are
    lo = max(lo, root_both(add_down(multiply_both(a, a)[0], multiply_both(b, b)[0]))[0])
    hi = min(hi, root_both(add_up(multiply_both(a, a)[1], multiply_both(b, b)[1]))[1])
    return multiply_both(lo, 1.0 / scale)[0], multiply_both(hi, 1.0 / scale)[1]
