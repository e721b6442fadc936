"""Sine, cosine and tangent: certified bounds at points and over intervals.

Arguments beyond pi/4 are reduced with pi/2 in exact pieces [Cody & Waite 1980], beyond a million by exact integer
arithmetic with 1344 bits of 2/pi [Payne & Hanek 1983]; the rest is a Taylor polynomial in double-double arithmetic.
Every error bound is proved in ``docs/explanation/intervals.md``.
"""

from fractions import Fraction
from math import factorial, frexp

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels import double_double as dd, quick
from graphsynth.intervals.kernels.rounding import INF, down, up

_WORDS = np.array(dd.two_over_pi_words(42), dtype=np.uint64)
_HALF_PI_H, _HALF_PI_L = dd.split(Fraction(dd.pi_fixed(256), 2**257))
#: pi/2 cut into three pieces of 33 bits, whose products with integers below 2^20 are exact, and the rest.
_FIRST, _SECOND, _THIRD = (
    float(Fraction((dd.pi_fixed(256) >> (225 - 33 * k)) % 2**33, 2 ** (32 + 33 * k))) for k in range(3)
)
_REST_H, _REST_L = dd.split(
    Fraction(dd.pi_fixed(256), 2**257) - Fraction(_FIRST) - Fraction(_SECOND) - Fraction(_THIRD)
)
_MODERATE = 1e6
#: Taylor coefficients by rows: high and low part; the first ones are used in double-double, the others as doubles.
_SIN = np.array([dd.split(Fraction((-1) ** k, factorial(2 * k + 1))) for k in range(13)])
_COS = np.array([dd.split(Fraction((-1) ** k, factorial(2 * k))) for k in range(14)])
_SIN_EXACT, _COS_EXACT = 5, 6
RELATIVE, ABSOLUTE = 2.0**-74, 2.0**-140
_SMALL = 2.0**-27
_MASK = np.uint64(0xFFFFFFFF)
_32 = np.uint64(32)


@kernel
def reduce_moderate(x):
    """Do what `reduce` does, for ``|x| <= 1e6``, with pi/2 in pieces [Cody & Waite 1980]."""
    k = np.floor(x * 0.6366197723675814 + 0.5)
    h, l = dd.two_sum(x, -k * _FIRST)
    h, l = dd.add_double(h, l, -k * _SECOND)
    rh, rl = dd.multiply_double(_REST_H, _REST_L, k)
    rh, rl = dd.add_double(rh, rl, k * _THIRD)
    h, l = dd.add(h, l, -rh, -rl)
    nearest = np.int64(k) & 3
    if abs(h) < 4.0 * ABSOLUTE:
        return -1, nearest, h, l
    return nearest if h > 0.0 else (nearest - 1) & 3, nearest, h, l


@kernel
def reduce(x):
    """Return ``floor(x 2/pi) mod 4`` (-1 if not certain), the nearest integer mod 4, and the rest times pi/2."""
    if abs(x) < 0.785:
        return (0 if x >= 0.0 else 3), 0, x, 0.0
    if abs(x) <= _MODERATE:
        return reduce_moderate(x)
    # the integer of 53 bits times eight words of 2/pi: those before add whole turns, those after nothing that counts
    fraction, exponent = frexp(abs(x))
    m = np.uint64(np.int64(fraction * 9007199254740992.0))
    e = exponent - 53
    first = (e - 2) // 32
    first = first if first > 0 else 0
    point = 224 - (e - 32 * (first + 1))  # position of the binary point in the product with eight words
    product = np.zeros(13, dtype=np.uint64)
    m0, m1 = m & _MASK, m >> _32
    for j in range(8):
        w = _WORDS[first + 7 - j]
        carry = product[j] + m0 * w
        product[j] = carry & _MASK
        carry = product[j + 1] + m1 * w + (carry >> _32)
        product[j + 1] = carry & _MASK
        product[j + 2] += carry >> _32
    # shift so that the binary point lies between two words: quadrant before it, fraction after it
    shift = np.uint64((32 - point % 32) % 32)
    unit = (point + 31) // 32
    if shift:
        for j in range(12, 0, -1):
            product[j] = ((product[j] << shift) | (product[j - 1] >> (_32 - shift))) & _MASK
        product[0] = (product[0] << shift) & _MASK
    floor = np.int64(product[unit] & np.uint64(3))
    upper = product[unit - 1] >= np.uint64(0x80000000)
    ones = True
    h, l, weight = 0.0, 0.0, 2.0**-32
    for j in range(1, 7):
        word = product[unit - j]
        if j < 6:
            ones = ones and word == _MASK
        if upper:  # 1 minus the fraction
            word = _MASK - word
        h, l = dd.add_double(h, l, np.float64(word) * weight)
        weight *= 2.0**-32
    nearest = floor
    if upper:
        nearest, h, l = (floor + 1) & 3, -h, -l
    rh, rl = dd.multiply(h, l, _HALF_PI_H, _HALF_PI_L)
    if x < 0.0:
        floor, nearest, rh, rl = 3 - floor, (4 - nearest) & 3, -rh, -rl
    return -1 if ones else floor, nearest, rh, rl


@kernel
def sine_polynomial(h, l):
    """Sine of ``|h + l| <= 0.7854``."""
    sh, sl = dd.multiply(h, l, h, l)
    ph, pl = dd.polynomial(_SIN, _SIN_EXACT, 1, sh, sl)
    ph, pl = dd.multiply(ph, pl, sh, sl)
    ph, pl = dd.multiply(ph, pl, h, l)
    return dd.add(h, l, ph, pl)


@kernel
def cosine_polynomial(h, l):
    """Cosine of ``|h + l| <= 0.7854``."""
    sh, sl = dd.multiply(h, l, h, l)
    return dd.polynomial(_COS, _COS_EXACT, 0, sh, sl)


@kernel
def sine_at(x, turn):
    """Bounds of ``sin(x + turn pi/2)`` for finite x, and the quadrant of the argument (-1 if not certain)."""
    floor, nearest, h, l = reduce(x)
    if floor >= 0:
        floor = (floor + turn) & 3
    k = (nearest + turn) & 3
    if nearest == 0 and abs(x) < _SMALL:  # x - x^3/6 < sin x < x,  1 - x^2/2 <= cos x <= 1
        if k & 1 == 0:
            lo, hi = (down(x, x == 0.0), x) if x > 0.0 else (x, up(x, x == 0.0))
        else:
            lo, hi = (1.0, 1.0) if x == 0.0 else (down(1.0, False), 1.0)
    else:
        h, l = sine_polynomial(h, l) if k & 1 == 0 else cosine_polynomial(h, l)
        lo, hi = dd.bounds(h, l, abs(h) * RELATIVE + ABSOLUTE)
    if k >= 2:
        lo, hi = -hi, -lo
    return max(lo, -1.0), min(hi, 1.0), floor


@kernel
def _steps(first, last, width):
    """Quadrant borders crossed between two quadrants; the width tells none from four."""
    n = (last - first) & 3
    return 4 if n == 0 and width > 3.0 else n


@kernel
def sine_turned(al, ah, turn):
    """Range of ``sin(x + turn pi/2)``."""
    if al > ah:
        return INF, -INF
    lo, hi = quick.sine(al, ah, turn)
    if lo == lo:
        return lo, hi
    width = ah - al
    if not width < 6.28:
        return -1.0, 1.0
    lo, hi, first = sine_at(al, turn)
    l2, h2, last = sine_at(ah, turn) if ah != al else (lo, hi, first)
    if first < 0 or last < 0:
        return -1.0, 1.0
    lo, hi = min(lo, l2), max(hi, h2)
    for i in range(_steps(first, last, width)):
        border = (first + i) & 3
        if border == 0:
            hi = 1.0
        elif border == 2:
            lo = -1.0
    return lo, hi


@kernel
def sin(al, ah):
    """Range of the sine."""
    return sine_turned(al, ah, 0)


@kernel
def cos(al, ah):
    """Range of the cosine."""
    return sine_turned(al, ah, 1)


@kernel
def tangent_at(x):
    """Bounds of the tangent of finite x, and the quadrant."""
    if abs(x) < _SMALL:  # x < tan x < x + x^3 / 2
        lo, hi = (x, up(x, x == 0.0)) if x >= 0.0 else (down(x, False), x)
        return lo, hi, (0 if x >= 0.0 else 3)
    floor, nearest, h, l = reduce(x)
    sh, sl = sine_polynomial(h, l)
    ch, cl = cosine_polynomial(h, l)
    # an absolute error of the argument counts in proportion to a sine that is at least 2^-61
    if nearest & 1:
        th, tl = dd.divide(-ch, -cl, sh, sl)
        error = abs(th) * (4.0 * RELATIVE + ABSOLUTE / abs(sh))
    else:
        th, tl = dd.divide(sh, sl, ch, cl)
        error = abs(th) * (4.0 * RELATIVE) + 4.0 * ABSOLUTE
    lo, hi = dd.bounds(th, tl, error)
    return lo, hi, floor


@kernel
def tan(al, ah):
    """Range of the tangent; the whole line across a pole."""
    if al > ah:
        return INF, -INF
    width = ah - al
    if not width < 3.14:
        return -INF, INF
    lo, hi, first = tangent_at(al)
    _, h2, last = tangent_at(ah) if ah != al else (lo, hi, first)
    if first < 0 or last < 0:
        return -INF, INF
    for i in range(_steps(first, last, width)):
        if (first + i) & 1 == 0:
            return -INF, INF
    return lo, h2
