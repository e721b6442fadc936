"""Poses of the pointing mechanism in bulk: two linear trigonometric equations in triangular order.

Lengths come scaled by a power of two.  A leg is ``(crank c, rod r, side)``: the ball joint of its crank lies at
``P = l1 - c (1 - cos phi)``, ``Q = side r + c sin phi`` in the plane of the leg (side -1 for leg Y, +1 for leg X).
"""

import math

import numpy as np

from graphsynth.core.compilation import kernel

OK, FOLD_FIRST, FOLD_SECOND, OUT_FIRST, OUT_SECOND, FREE = 0, 1, 2, 3, 4, 5
DOUBT = 6.4e-15  # relative rounding error of a discriminant, with a factor of safety of about ten


@kernel(inline="always")
def ball_joint(l1, crank, rod, side, phi):
    """P, Q and ``K = (l1^2 + P^2 + Q^2 - rod^2) / (2 l1)`` without the difference ``Q^2 - rod^2``."""
    s, c = math.sin(phi), math.cos(phi)
    bend = s * s / (1.0 + c) if c > 0.0 else 1.0 - c
    p = l1 - crank * bend
    rise = crank * s
    q = side * rod + rise
    k = 0.5 * (l1 * l1 + p * p + rise * (2.0 * side * rod + rise)) / l1
    return p, q, k


@kernel
def triangular(l1, c1, r1, side1, s1, c2, r2, side2, s2, phi1, phi2, u, v, status, deficit, margin1, margin2, close):
    """Solve ``P1 cos u + Q1 sin u = K1`` and then ``P2 cos v + Q2 cos u sin v = K2`` on the branches s1, s2.

    ``margin`` is the sine of the angle by which an output is away from its fold; ``deficit`` is ``|K| - hypot``;
    ``close`` says that rounding may have decided whether a leg reaches.
    """
    for i in range(phi1.size):
        u[i] = v[i] = margin1[i] = margin2[i] = np.nan
        deficit[i] = 0.0
        close[i] = False
        p, q, k = ball_joint(l1, c1, r1, side1, phi1[i])  # first equation: P1 cos u + Q1 sin u = K1
        square = p * p + q * q
        rest = square - k * k
        close[i] = abs(rest) <= DOUBT * square
        if rest < 0.0:
            status[i] = OUT_FIRST
            deficit[i] = abs(k) - math.sqrt(square)
            continue
        if square == 0.0:
            status[i] = FREE
            continue
        code = FOLD_FIRST if rest == 0.0 else OK
        root = math.sqrt(rest)  # sine and cosine of u, times P1^2 + Q1^2
        sine = q * k + s1 * p * root
        cosine = p * k - s1 * q * root
        u[i] = math.atan2(sine, cosine)
        margin1[i] = root / math.sqrt(square)
        p, q, k = ball_joint(l1, c2, r2, side2, phi2[i])
        q *= cosine / square  # second equation: its Q2 is seen at the angle u
        square = p * p + q * q
        rest = square - k * k
        close[i] |= abs(rest) <= DOUBT * square * (1.0 + 1.0 / margin1[i])
        if rest < 0.0:  # without v there is no pose: u is taken back
            status[i] = OUT_SECOND
            deficit[i] = abs(k) - math.sqrt(square)
            u[i] = margin1[i] = np.nan
            continue
        if square == 0.0:
            status[i] = FREE
            u[i] = margin1[i] = np.nan
            continue
        status[i] = FOLD_SECOND if rest == 0.0 else code
        root = math.sqrt(rest)
        v[i] = math.atan2(q * k + s2 * p * root, p * k - s2 * q * root)
        margin2[i] = root / math.sqrt(square)
