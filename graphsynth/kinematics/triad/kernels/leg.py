"""Two-link legs in bulk: compensated reach and angles, written so that the compiler can use vector instructions.

The discriminants are sums of products kept as pairs (value, rounding error) with fused multiply-add; the sums of the
two lengths enter as such pairs, computed once.  Relative error of C, P1 and P2 below 2^-52 wherever the margin P1 or P2
exceeds 2^-48 of its terms; the few entries closer to the boundary, or near overflow, are marked HARD and left to the
exact evaluation of `graphsynth.kinematics.triad.leg.solve_leg`.
"""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.core.intrinsics import fma

BLOCK = 256
HARD = 9  # status of an entry that needs the exact evaluation
NARROW = 2.0**-48
LARGEST, SMALLEST = 1e60, 1e-60  # of the squared lengths: their fourth powers neither overflow nor underflow

QUARTER = 0.7853981633974483  # pi / 4 and its rounding error
QUARTER_LOW = 3.061616997868383e-17
HALF_PI, HALF_PI_LOW, TWO_OVER_PI = 1.5707963267948966, 6.123233995736766e-17, 0.6366197723675814
ROUND = 1.5 * 2.0**52  # added and taken away: rounds to the nearest whole number
TANGENT = 0.41421356237309503  # tan(pi / 8)


@kernel
def angle_of(y, x):
    """``atan2(y, x)`` in (-pi, pi] without branches; error below 0.75 ulp of pi and 2 ulp of a small result.

    Reduced to |t| <= tan(pi/8); polynomial of fdlibm [Sun Microsystems 1993] for the arc tangent.  NaN at the origin.
    """
    ax, ay = abs(x), abs(y)
    steep = ay > ax
    low = ax if steep else ay
    high = ay if steep else ax
    big = low > TANGENT * high
    t = (low - high if big else low) / (low + high if big else high)
    z = t * t
    p = 1.62858201153657823623e-02
    p = fma(p, z, -3.65315727442169155270e-02)
    p = fma(p, z, 4.97687799461593236017e-02)
    p = fma(p, z, -5.83357013379057348645e-02)
    p = fma(p, z, 6.66107313738753120669e-02)
    p = fma(p, z, -7.69187620504482999495e-02)
    p = fma(p, z, 9.09088713343650656196e-02)
    p = fma(p, z, -1.11111104054623557880e-01)
    p = fma(p, z, 1.42857142725034663711e-01)
    p = fma(p, z, -1.99999999998764832476e-01)
    p = fma(p, z, 3.33333333333329318027e-01)
    r = fma(-t, z * p, t)
    k = 1.0 if big else 0.0
    k = 2.0 - k if steep else k
    r = -r if steep else r
    k = 4.0 - k if x < 0.0 else k
    r = -r if x < 0.0 else r
    a = fma(k, QUARTER, fma(k, QUARTER_LOW, r))
    return -a if y < 0.0 else a


@kernel
def direction(a):
    """Cosine and sine without branches, for |a| < 1e5; error below 1 ulp (polynomials of [Sun Microsystems 1993])."""
    n = (a * TWO_OVER_PI + ROUND) - ROUND
    r = fma(-n, HALF_PI_LOW, fma(-n, HALF_PI, a))
    z = r * r
    s = fma(z, 1.58969099521155010221e-10, -2.50507602534068634195e-08)
    s = fma(z, fma(z, s, 2.75573137070700676789e-06), -1.98412698298579493134e-04)
    s = fma(z, fma(z, s, 8.33333333332248946124e-03), -1.66666666666666324348e-01)
    s = fma(r, z * s, r)
    c = fma(z, -1.13596475577881948265e-11, 2.08757232129817482790e-09)
    c = fma(z, fma(z, c, -2.75573143513906633035e-07), 2.48015872894767294178e-05)
    c = fma(z, fma(z, c, -1.38888888888741095749e-03), 4.16666666666666019037e-02)
    h = 0.5 * z
    w = 1.0 - h
    c = w + (((1.0 - w) - h) + z * (z * c))
    quarter = n - 4.0 * ((n * 0.25 - 0.375 + ROUND) - ROUND)  # 0, 1, 2 or 3
    odd = (quarter == 1.0) | (quarter == 3.0)
    x, y = (s if odd else c), (c if odd else s)
    x = -x if (quarter == 1.0) | (quarter == 2.0) else x
    return x, (-y if quarter > 1.5 else y)


@kernel
def directions(a, start, m, c, s):
    """Cosines and sines of the m angles from ``a[start]``."""
    far = False
    for i in range(m):
        c[i], s[i] = direction(a[start + i])
        far |= not abs(a[start + i]) < 1e5
    if far:
        for i in range(m):
            c[i], s[i] = math.cos(a[start + i]), math.sin(a[start + i])


@kernel
def cross_sum(a, b, c, d):
    """Return ``a b + c d``, both products and their sum compensated."""
    p = a * b
    q = c * d
    s = p + q
    t = s - p
    rest = (p - (s - t)) + (q - t)
    return s + (rest + (fma(a, b, -p) + fma(c, d, -q)))


@kernel
def square(u, v):
    """``u^2 + v^2`` as a pair."""
    p = u * u
    q = v * v
    s = p + q
    t = s - p
    low = (p - (s - t)) + (q - t) + (fma(u, u, -p) + fma(v, v, -q))
    return s, low


@kernel
def add_pair(a, al, b, bl):
    """Sum of two pairs, rounded."""
    s = a + b
    t = s - a
    return s + ((a - (s - t)) + (b - t) + (al + bl))


@kernel
def solve(u, v, c0, c1, c2, c3, c4, c5):
    """Squared distance, C, P1, P2 of a leg that ends at (u, v); constants: the first six of `length_constants`."""
    r, rl = square(u, v)
    C = add_pair(r, rl, c0, c1)
    P1 = add_pair(c2, c3, -r, -rl)
    P2 = add_pair(r, rl, -c4, -c5)
    return r, C, P1, P2


@kernel
def inverse(pose, D, b, consts, sigma, theta, status, S, deficit):
    """Legs of poses (n, 3): angles, status and, where wanted, S and deficit; returns the number of legs marked HARD.

    ``theta`` is (n, 3) with ``sigma`` (1, 3) or (n, 3), or (n, 8, 3) for the eight working modes with ``sigma`` the
    table of them.  ``S`` and ``deficit`` are (n, 3), or (0, 3).  The first arrangement is ``theta[:, 0, :]``.
    """
    n, modes = pose.shape[0], theta.shape[1]
    extra = S.shape[0] > 0
    step = 1 if modes == 1 and sigma.shape[0] > 1 else 0
    rows = np.empty((12, BLOCK))
    u, v, cs, sn, sg, r = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]
    C, P1, P2, mark, plus, minus = rows[6], rows[7], rows[8], rows[9], rows[10], rows[11]
    hard = 0
    for start in range(0, n, BLOCK):
        m = min(BLOCK, n - start)
        # a block of poses at a time: directions of the platform, then leg by leg
        for i in range(m):
            sg[i] = pose[start + i, 2]
        directions(sg, start - start, m, cs, sn)
        for k in range(3):
            bx, by, dx, dy = b[k, 0], b[k, 1], D[k, 0], D[k, 1]
            for i in range(m):
                u[i] = pose[start + i, 0] + (cs[i] * bx - sn[i] * by) - dx
                v[i] = pose[start + i, 1] + (cs[i] * by + sn[i] * bx) - dy
                sg[i] = sigma[(start + i) * step, k]
            c0, c1, c2, c3, c4, c5 = consts[k, 0], consts[k, 1], consts[k, 2], consts[k, 3], consts[k, 4], consts[k, 5]
            for i in range(m):  # marks: 0 reachable, 2, 3, HARD
                r[i], C[i], P1[i], P2[i] = solve(u[i], v[i], c0, c1, c2, c3, c4, c5)
                size = r[i] + c2
                narrow = NARROW * size
                clear = (abs(P1[i]) > narrow) & (abs(P2[i]) > narrow) & (size < LARGEST) & (size > SMALLEST)
                out = 2.0 if P1[i] < 0.0 else (3.0 if P2[i] < 0.0 else 0.0)
                mark[i] = out if clear else 9.0
            # the angle on one branch, or on both
            for side in range(2 if modes > 1 else 1):
                chosen = minus if side == 1 else plus
                for i in range(m):
                    s = math.sqrt(P1[i] * P2[i])
                    turn = -1.0 if side == 1 else sg[i]
                    a, c = turn * u[i], turn * v[i]
                    chosen[i] = angle_of(cross_sum(v[i], C[i], a, s), cross_sum(u[i], C[i], -c, s))
            # deliver
            for i in range(m):
                status[start + i, k] = np.int8(mark[i])
                hard += 1 if mark[i] == 9.0 else 0
            if modes == 1:
                for i in range(m):
                    theta[start + i, 0, k] = plus[i]
            else:
                for i in range(m):
                    for j in range(8):
                        theta[start + i, j, k] = plus[i] if sigma[j, k] > 0.0 else minus[i]
            if extra:
                total, least = consts[k, 6], consts[k, 7]
                for i in range(m):
                    rho = math.sqrt(r[i])
                    S[start + i, k] = math.sqrt(P1[i] * P2[i])
                    far, near = -P1[i] / (rho + total), -P2[i] / (rho + least)
                    deficit[start + i, k] = far if far > near else near
    return hard
