"""Double-double arithmetic: unevaluated sums of two doubles, about 106 bits.

Relative errors (u = 2^-53) are proved by Joldes, Muller and Popescu, "Tight and rigorous error bounds for basic
building blocks of double-word arithmetic", ACM TOMS 44 (2017): sum 3 u^2 + 13 u^3, sum with a double 2 u^2, product
5 u^2, product with a double 2 u^2, quotient 15 u^2 + 56 u^3, all below 2^-102, without overflow or underflow.
"""

from math import sqrt

from graphsynth.core.compilation import kernel
from graphsynth.core.intrinsics import fma
from graphsynth.intervals.kernels.rounding import ETA, PHI, add_down, add_up


@kernel(forceinline=True)
def two_sum(a, b):
    """Sum and error (Knuth)."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@kernel(forceinline=True)
def quick_two_sum(a, b):
    """Sum and error for ``|a| >= |b|`` (Dekker)."""
    s = a + b
    return s, b - (s - a)


@kernel(forceinline=True)
def add_double(ah, al, b):
    """Sum with a double (algorithm 4)."""
    s, e = two_sum(ah, b)
    return quick_two_sum(s, e + al)


@kernel(forceinline=True)
def add(ah, al, bh, bl):
    """Sum, accurate also under cancellation (algorithm 6)."""
    sh, sl = two_sum(ah, bh)
    th, tl = two_sum(al, bl)
    vh, vl = quick_two_sum(sh, sl + th)
    return quick_two_sum(vh, tl + vl)


@kernel(forceinline=True)
def multiply_double(ah, al, b):
    """Product with a double (algorithm 9)."""
    p = ah * b
    return quick_two_sum(p, fma(al, b, fma(ah, b, -p)))


@kernel(forceinline=True)
def multiply(ah, al, bh, bl):
    """Product (algorithm 12)."""
    p = ah * bh
    e = fma(ah, bh, -p)
    return quick_two_sum(p, e + fma(al, bh, fma(ah, bl, al * bl)))


@kernel(forceinline=True)
def divide(ah, al, bh, bl):
    """Quotient (algorithm 17)."""
    q = ah / bh
    rh, rl = multiply_double(bh, bl, q)
    d = (ah - rh) + (al - rl)
    return quick_two_sum(q, d / bh)


@kernel(forceinline=True)
def root(ah, al):
    """Square root of a positive number ([Lefèvre et al. 2023]: 25/8 u^2)."""
    s = sqrt(ah)
    r = fma(-s, s, ah)
    return quick_two_sum(s, (al + r) / (s + s))


@kernel(forceinline=True)
def bounds(h, l, error):
    """Doubles on both sides of every number within ``error`` of ``h + l``."""
    d = l - error
    e = l + error
    return add_down(h, d - (PHI * abs(d) + ETA)), add_up(h, e + (PHI * abs(e) + ETA))
