"""Bounds of exp, log, atan, sin and cos by tables, without a branch or a fused operation; NaN where they do not decide.

Each ``*_pair`` returns ``h + l``, with h the nearest double, within ``ERROR |h|`` of the true value (sine:
``SINE_ERROR |h| + ABSOLUTE``).  If ``|l|`` is larger than that, the sign of l tells on which side of h the value lies:
h and its neighbour are the tightest bounds.  Else, and for arguments out of range, the lower bound of an interval is
NaN, and the functions of double-double arithmetic decide.  Proofs of all error bounds:
``docs/theory/elementary-functions.md``.
"""

from fractions import Fraction

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels import double_double as dd, tables
from graphsynth.intervals.kernels.rounding import MAX, PHI
from graphsynth.intervals.kernels.tables import ATAN_H, ATAN_L, INVERSE, LOG_H, LOG_L, POWER_H, POWER_L, SIN_H, SIN_L

NAN = float("nan")
ERROR, SINE_ERROR, ABSOLUTE = 2.0**-64, 2.0**-63, 2.0**-102
_SHIFT = 1.5 * 2.0**52  # added and taken away again: the nearest integer
_LOG2 = Fraction(dd.log2_fixed(300), 2**300)
_LOG2_H, _LOG2_L = tables.pieces(_LOG2, 42)
#: log(2)/128 and pi/256: pieces whose products with the integers that come are exact, and the rest.
_EXP_STEP, _EXP_SECOND, _EXP_THIRD = tables.pieces(_LOG2 / 128, 42, 77)
_SIN_STEP, _SIN_SECOND, _SIN_THIRD = tables.pieces(Fraction(dd.pi_fixed(256), 2**264), 39, 72)
_EXP_LEAST, _EXP_MOST, SINE_MOST, _ATAN_MOST = -690.0, 709.0, 12000.0, 2.0**900
_NORMAL_MIN = 2.0**-1022
#: Bits of a number, with an exponent that is larger by 1024 and counts from 0.6875; parts of them.
_BIAS, _PAST_FIRST = np.uint64(1024 << 52), np.uint64((1024 << 52) - tables.FIRST_BITS)
_44, _52, _255, _TWO_52 = np.uint64(44), np.uint64(52), np.uint64(255), np.uint64(0x433 << 52)
_EXPONENT, _UPPER = np.uint64(0xFFF << 52), np.uint64(0xFFFFFFFF << 32)


@kernel(forceinline=True)
def below(h, l, error):
    """Largest double not above ``h + l``, which is known to ``error``; NaN if not certain."""
    return (h if l > 0.0 else h - PHI * abs(h)) if abs(l) > error else NAN


@kernel(forceinline=True)
def above(h, l, error):
    """Smallest double not below ``h + l``, which is known to ``error``; NaN if not certain."""
    return (h if l < 0.0 else h + PHI * abs(h)) if abs(l) > error else NAN


@kernel(forceinline=True)
def cut(x):
    """High part of a number, 26 bits; the rest has 26 bits as well [Dekker 1971]."""
    c = 134217729.0 * x
    return c - (c - x)


@kernel(forceinline=True)
def exp_pair(x):
    """Pair of the exponential's fraction, and the power of two that belongs to it; ``l = 0`` out of range."""
    fine = (x > _EXP_LEAST) & (x < _EXP_MOST)
    x = x if fine else 0.0
    n = (x * (128.0 * 1.4426950408889634) + _SHIFT) - _SHIFT
    k = np.int64(np.int32(n))
    # x = n log(2)/128 + r
    first = x - n * _EXP_STEP
    second = n * _EXP_SECOND
    r = first - second
    low = ((first - r) - second) - n * _EXP_THIRD
    rest = r * r * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0))))) + low
    th, tl = POWER_H[k & 127], POWER_L[k & 127]
    high = cut(r)
    h, e = dd.quick_two_sum(th, th * high)
    l = e + (th * (r - high) + (tl + (tl * r + (th + tl) * rest)))
    h, l = dd.quick_two_sum(h, l)
    power = np.int64(((k >> 7) + 1023) << 52).view(np.float64)
    return h, l if fine else 0.0, power


@kernel(forceinline=True)
def exp(al, ah):
    """Range of the exponential."""
    h, l, power = exp_pair(al)
    lo = below(h, l, ERROR * h) * power
    h, l, power = exp_pair(ah)
    hi = above(h, l, ERROR * h) * power
    return lo if (al <= ah) & (hi == hi) else NAN, hi


@kernel(forceinline=True)
def log_pair(x):
    """Pair of the logarithm; ``l = 0`` for what is no positive normal number."""
    fine = (x >= _NORMAL_MIN) & (x <= MAX)
    bits = np.float64(x if fine else 1.0).view(np.uint64)
    past = bits + _PAST_FIRST
    k = (past >> _44) & _255
    part = (bits + _BIAS) - (past & _EXPONENT)
    m = np.uint64(part).view(np.float64)
    first = np.uint64(part & _UPPER).view(np.float64)
    exponent = np.uint64((past >> _52) | _TWO_52).view(np.float64) - (2.0**52 + 1024.0)
    z = (first * INVERSE[k] - 1.0) + (m - first) * INVERSE[k]  # exact
    high = cut(z)
    w = z * z
    tail = 1.0 / 7.0 + z * (-1.0 / 8.0 + z * (1.0 / 9.0 + z * (-1.0 / 10.0)))
    tail = z * w * (1.0 / 3.0 + z * (-1.0 / 4.0 + z * (1.0 / 5.0 + z * (-1.0 / 6.0 + z * tail))))
    h, e = dd.two_sum(exponent * _LOG2_H + LOG_H[k], z)
    h, f = dd.quick_two_sum(h, -0.5 * (high * high))
    l = (e + f) + (tail + ((exponent * _LOG2_L + LOG_L[k]) - 0.5 * ((z - high) * (z + high))))
    h, l = dd.quick_two_sum(h, l)
    return h, l if fine else 0.0


@kernel(forceinline=True)
def log(al, ah):
    """Range of the logarithm."""
    h, l = log_pair(al)
    lo = below(h, l, ERROR * abs(h))
    h, l = log_pair(ah)
    hi = above(h, l, ERROR * abs(h))
    return lo if (al <= ah) & (hi == hi) else NAN, hi


@kernel(forceinline=True)
def atan_pair(x):
    """Pair of the arctangent; ``l = 0`` for huge arguments and infinities."""
    size = abs(x)
    fine = size < _ATAN_MOST
    size = size if fine else 0.0
    large = size > 1.0
    s = (1.0 / size) if large else size
    n = (s * 128.0 + _SHIFT) - _SHIFT
    k = np.int64(np.int32(n))
    c = n * 0.0078125
    # the tangent of the difference, (a size - b) / (a + b size) with (a, b) = (1, c), or (c, 1) beyond 1
    a = c if large else 1.0
    high = cut(size)
    p = c * size
    e = (c * high - p) + c * (size - high)  # p + e is the product, exactly
    nh, nl = (p - 1.0, e) if large else (size - c, 0.0)
    dh, dl = dd.two_sum(a, size if large else p)
    dl = dl if large else dl + e
    t = cut(nh / dh)
    high = cut(dh)
    low = (((nh - t * high) - t * (dh - high)) + (nl - t * dl)) / dh
    w = (t + low) * (t + low)
    rest = (t + low) * w * (-1.0 / 3.0 + w * (1.0 / 5.0 + w * (-1.0 / 7.0 + w * (1.0 / 9.0))))
    k = k + 129 if large else k
    h, e = dd.quick_two_sum(ATAN_H[k], t)
    h, l = dd.quick_two_sum(h, e + (rest + (low + ATAN_L[k])))
    sign = 1.0 if x > 0.0 else -1.0
    return sign * h, sign * l if fine else 0.0


@kernel(forceinline=True)
def atan(al, ah):
    """Range of the arctangent."""
    h, l = atan_pair(al)
    lo = below(h, l, ERROR * abs(h))
    h, l = atan_pair(ah)
    hi = above(h, l, ERROR * abs(h))
    return lo if (al <= ah) & (hi == hi) else NAN, hi


@kernel(forceinline=True)
def sine_pair(x, turn):
    """Pair of ``sin(x + turn pi/2)`` and the integer ``floor(x 2/pi)``; ``l = 0`` where that is not certain."""
    fine = abs(x) < SINE_MOST
    x = x if fine else 0.0
    n = (x * 81.48733086305042 + _SHIFT) - _SHIFT
    k = np.int64(np.int32(n))
    # x = n pi/256 + r
    r, low = dd.two_sum(x - n * _SIN_STEP, -n * _SIN_SECOND)
    r, low = dd.two_sum(r, low - n * _SIN_THIRD)
    w = r * r
    sine = r * w * (-1.0 / 6.0 + w * (1.0 / 120.0 + w * (-1.0 / 5040.0))) + low
    cosine = w * (-0.5 + w * (1.0 / 24.0 + w * (-1.0 / 720.0))) - r * low
    j = (k + 128 * turn) & 511
    sh, sl = SIN_H[j], SIN_L[j]
    j = (j + 128) & 511
    ch, cl = SIN_H[j], SIN_L[j]
    high = cut(r)
    h, e = dd.quick_two_sum(sh, ch * high)
    l = e + (ch * (r - high) + (sl + ((sh + sl) * cosine + (cl * r + (ch + cl) * sine))))
    h, l = dd.quick_two_sum(h, l)
    quadrant = np.floor(n * 0.0078125)
    quadrant = quadrant - 1.0 if (n == 128.0 * quadrant) & (r < 0.0) else quadrant
    fine &= (abs(r) > 4.0 * ABSOLUTE) | (n == 0.0)
    return h, l if fine else 0.0, quadrant


@kernel(forceinline=True)
def _residue(x):
    """Residue of an integer modulo 4."""
    return x - 4.0 * np.floor(0.25 * x)


@kernel(forceinline=True)
def sine(al, ah, turn):
    """Range of ``sin(x + turn pi/2)``."""
    h, l, first = sine_pair(al, turn)
    error = SINE_ERROR * abs(h) + ABSOLUTE
    certain = abs(l) > error
    lo, hi = below(h, l, error), above(h, l, error)
    h, l, last = sine_pair(ah, turn)
    error = SINE_ERROR * abs(h) + ABSOLUTE
    certain &= (abs(l) > error) & (al <= ah)
    low, high = below(h, l, error), above(h, l, error)
    lo = lo if lo < low else low
    hi = hi if hi > high else high
    # borders of quadrants between the ends: one from quadrant 0 to 1 is a maximum, one from 2 to 3 a minimum
    crossed = last - first
    lo = -1.0 if _residue(2.0 - turn - first) < crossed else lo
    hi = 1.0 if _residue(-turn - first) < crossed else hi
    return lo if certain else NAN, hi


@kernel(forceinline=True)
def sin(al, ah):
    """Range of the sine."""
    return sine(al, ah, 0)


@kernel(forceinline=True)
def cos(al, ah):
    """Range of the cosine."""
    return sine(al, ah, 1)
