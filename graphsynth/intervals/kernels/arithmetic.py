"""Interval operations on scalar bounds: four floats in, two out; empty is ``(inf, -inf)``."""

from graphsynth.core.compilation import kernel
from graphsynth.core.intrinsics import fma
from graphsynth.intervals.kernels.rounding import (
    INF,
    MAX,
    PHI,
    PRODUCT_MIN,
    add_down,
    add_up,
    divide_both,
    down,
    excess,
    multiply_both,
    root_both,
    up,
)

NAN = float("nan")
FACTOR_MAX, DIVISOR_MIN = 2.0**500, 2.0**-500
QUOTIENT_MIN, QUOTIENT_MAX = 2.0**-400, 2.0**490


@kernel(forceinline=True)
def add(al, ah, bl, bh):
    """Sum."""
    void = (al > ah) | (bl > bh)
    lo, hi = add_down(al, bl), add_up(ah, bh)
    return INF if void else lo, -INF if void else hi


@kernel(forceinline=True)
def subtract(al, ah, bl, bh):
    """Difference."""
    void = (al > ah) | (bl > bh)
    lo, hi = add_down(al, -bh), add_up(ah, -bl)
    return INF if void else lo, -INF if void else hi


@kernel(forceinline=True)
def _least_and_largest(al, ah, bl, bh):
    """Return the rounded products that bound all others, with ``0 * inf = NaN``, and the pairs of factors of each.

    For a fixed factor the other one is chosen by its sign, so two products are left for each end.
    """
    u, v = (bl, bh) if al >= 0.0 else (bh, bl)
    w, z = (bl, bh) if ah >= 0.0 else (bh, bl)
    return al * u, ah * w, al * v, ah * z, u, v, w, z


@kernel(forceinline=True)
def multiply_plain(al, ah, bl, bh):
    """Product of intervals of ordinary size; the lower bound is NaN where `multiply_any` must be asked.

    The bounds are moved only if a product lies beyond them: the residual has the sign of the exact difference.
    """
    p, q, r, s, u, v, w, z = _least_and_largest(al, ah, bl, bh)
    lo = p if p < q else q
    hi = r if r > s else s
    below = (fma(al, u, -lo) < 0.0) | (fma(ah, w, -lo) < 0.0)
    above = (fma(al, v, -hi) > 0.0) | (fma(ah, z, -hi) > 0.0)
    small, large = abs(lo), abs(hi)
    # empty and unbounded operands give bounds that are not finite
    safe = (small >= PRODUCT_MIN) & (large >= PRODUCT_MIN) & (small <= MAX) & (large <= MAX)
    lo = fma(small, -PHI, lo) if below else lo
    hi = fma(large, PHI, hi) if above else hi
    return lo if safe else NAN, hi


@kernel(forceinline=True)
def multiply_any(al, ah, bl, bh):
    """Product of any intervals."""
    p, q, r, s, u, v, w, z = _least_and_largest(al, ah, bl, bh)
    p = 0.0 if p != p else p
    q = 0.0 if q != q else q
    r = 0.0 if r != r else r
    s = 0.0 if s != s else s
    lo = p if p < q else q
    hi = r if r > s else s
    below = (excess(al, u, lo) < 0.0) | (excess(ah, w, lo) < 0.0)
    above = (excess(al, v, hi) > 0.0) | (excess(ah, z, hi) > 0.0)
    lo, hi = down(lo, not below), up(hi, not above)
    void = (al > ah) | (bl > bh)
    return INF if void else lo, -INF if void else hi


@kernel(forceinline=True)
def multiply(al, ah, bl, bh):
    """Product."""
    lo, hi = multiply_plain(al, ah, bl, bh)
    if lo != lo:
        return multiply_any(al, ah, bl, bh)
    return lo, hi


@kernel(forceinline=True)
def scale(a, bl, bh):
    """Float times interval."""
    l1, u1 = multiply_both(a, bl)
    l2, u2 = multiply_both(a, bh)
    void = bl > bh
    return INF if void else (l1 if l1 < l2 else l2), -INF if void else (u1 if u1 > u2 else u2)


@kernel(forceinline=True)
def divide_plain(al, ah, bl, bh):
    """Quotient of intervals of ordinary size; the lower bound is NaN where `divide_any` must be asked."""
    q1, q2, q3, q4 = al / bl, al / bh, ah / bl, ah / bh
    r1, r2, r3, r4 = fma(-q1, bl, al), fma(-q2, bh, al), fma(-q3, bl, ah), fma(-q4, bh, ah)
    sign = 1.0 if bl > 0.0 else -1.0
    r1, r2, r3, r4 = r1 * sign, r2 * sign, r3 * sign, r4 * sign
    l1 = q1 if q1 < q2 else q2
    l2 = q3 if q3 < q4 else q4
    u1 = q1 if q1 > q2 else q2
    u2 = q3 if q3 > q4 else q4
    lo = l1 if l1 < l2 else l2
    hi = u1 if u1 > u2 else u2
    # whether the least and the largest bound the exact quotients, which lie beyond the rounded ones by the signs of r
    below = ((q1 > lo) | (r1 >= 0.0)) & ((q2 > lo) | (r2 >= 0.0))
    below &= ((q3 > lo) | (r3 >= 0.0)) & ((q4 > lo) | (r4 >= 0.0))
    above = ((q1 < hi) | (r1 <= 0.0)) & ((q2 < hi) | (r2 <= 0.0))
    above &= ((q3 < hi) | (r3 <= 0.0)) & ((q4 < hi) | (r4 <= 0.0))
    inner = bl if bl > 0.0 else -bh
    outer = bh if bl > 0.0 else -bl
    small, large = abs(lo), abs(hi)
    # a quotient of 0 leaves the numerator as its remainder; empty and unbounded operands are beyond the limits
    safe = (inner >= DIVISOR_MIN) & (outer <= FACTOR_MAX) & (al <= ah) & (bl <= bh)
    safe &= ((small >= QUOTIENT_MIN) & (small <= QUOTIENT_MAX)) | (small == 0.0)
    safe &= ((large >= QUOTIENT_MIN) & (large <= QUOTIENT_MAX)) | (large == 0.0)
    return down(lo, below) if safe else NAN, up(hi, above)


@kernel
def divide_any(al, ah, bl, bh):
    """Quotients of any intervals by the nonzero part of the divisor."""
    if bl <= 0.0 <= bh:
        return divide_zero(al, ah, bl, bh)
    if al > ah or bl > bh:
        return INF, -INF
    l1, u1 = divide_both(al, bl)
    l2, u2 = divide_both(al, bh)
    l3, u3 = divide_both(ah, bl)
    l4, u4 = divide_both(ah, bh)
    return min(min(l1, l2), min(l3, l4)), max(max(u1, u2), max(u3, u4))


@kernel
def divide_zero(al, ah, bl, bh):
    """Quotients by the nonzero part of a divisor that contains 0."""
    if al > ah or (bl == 0.0 and bh == 0.0):
        return INF, -INF
    if al == 0.0 and ah == 0.0:
        return 0.0, 0.0
    if bl < 0.0 < bh or al < 0.0 < ah:
        return -INF, INF
    if bl == 0.0:
        if al >= 0.0:
            return divide_both(al, bh)[0], INF
        return -INF, divide_both(ah, bh)[1]
    if al >= 0.0:
        return -INF, divide_both(al, bl)[1]
    return divide_both(ah, bl)[0], INF


@kernel(forceinline=True)
def divide(al, ah, bl, bh):
    """Quotients by the nonzero part of the divisor."""
    if bl <= 0.0 <= bh:
        return divide_zero(al, ah, bl, bh)
    lo, hi = divide_plain(al, ah, bl, bh)
    if lo != lo:
        return divide_any(al, ah, bl, bh)
    return lo, hi


@kernel(forceinline=True)
def square(al, ah):
    """Square."""
    void = al > ah
    mig = al if al > 0.0 else (-ah if ah < 0.0 else 0.0)
    mag = -al if -al > ah else ah
    lo = multiply_both(mig, mig)[0]
    hi = multiply_both(mag, mag)[1]
    return INF if void else lo, -INF if void else hi


@kernel(forceinline=True)
def root(al, ah):
    """Square roots of the part at or above 0."""
    if al > ah or ah < 0.0:
        return INF, -INF
    return root_both(al)[0] if al > 0.0 else 0.0, root_both(ah)[1]


@kernel(forceinline=True)
def absolute(al, ah):
    """Absolute value."""
    if al > ah:
        return INF, -INF
    return al if al > 0.0 else (-ah if ah < 0.0 else 0.0), max(-al, ah)


@kernel
def _powers(low, high, n):
    """Lower bound of ``low**n`` and upper bound of ``high**n`` for numbers of zero or more, ``n >= 1``."""
    lo, hi = 1.0, 1.0
    while True:
        if n & 1:
            lo, hi = multiply_both(lo, low)[0], multiply_both(hi, high)[1]
        n >>= 1
        if n == 0:
            return lo, hi
        low, high = multiply_both(low, low)[0], multiply_both(high, high)[1]


@kernel
def power(al, ah, n):
    """Integer power; a negative exponent is the quotient of 1 by the positive one."""
    if al > ah:
        return INF, -INF
    if n == 0:
        return 1.0, 1.0
    m = abs(n)
    if m & 1 == 0:
        l, h = absolute(al, ah)
        lo, hi = _powers(l, h, m)
    elif al >= 0.0:
        lo, hi = _powers(al, ah, m)
    elif ah < 0.0:
        h, l = _powers(-ah, -al, m)
        lo, hi = -l, -h
    else:
        lo, hi = -_powers(0.0, -al, m)[1], _powers(0.0, ah, m)[1]
    return (lo, hi) if n > 0 else divide(1.0, 1.0, lo, hi)
