"""Roots of the nine-point equations followed along a straight path of points (theory/nine-points 1, 3).

``z`` holds a, a*, x, x*, b, b*, y, y*: pivots and joints of two dyads, counted from the first point; ``d`` the other
points, their conjugates beside them.  Some unknowns may be given: they move on a straight path like the points.
"""

import numpy as np

from graphsynth.core.compilation import kernel

#: How a path ended.
REACHED, TOO_MANY_STEPS, STEP_TOO_SMALL = 0, 1, 2
_NEWTON = 4


@kernel
def size(z):
    """Sum of the sizes of both parts: between the absolute value and 1.42 times that."""
    return abs(z.real) + abs(z.imag)


@kernel
def inverse(z):
    """Reciprocal, scaled by nothing."""
    n = 1.0 / (z.real * z.real + z.imag * z.imag)
    return complex(z.real * n, -z.imag * n)


@kernel
def linearise(z, d, speed, free, given, M):
    """Fill rows of M: slopes by the free unknowns, the value, what the motion of points and given unknowns adds.

    ``speed`` holds rates like d: of the points, of the given ones among the eight unknowns in four rows, and of the
    bend and pole of the last point, which is moved by ``bend / (z[free[n - 4]] - pole)`` (theory/nine-points 6).
    """
    n = free.shape[0]
    bend, at = d[n + 4, 0], free[n - 4]
    a, aa, x, xx, b, bb, y, yy = z[0], z[1], z[2], z[3], z[4], z[5], z[6], z[7]
    n1, nn1, n2, nn2 = aa * x, a * xx, bb * y, b * yy
    s1, ss1, s2, ss2 = x - a, xx - aa, y - b, yy - bb
    g = np.empty(8, dtype=np.complex128)
    for j in range(n):
        p, pp = d[j, 0], d[j, 1]
        rate, follows = speed[j, 0], 0j
        if j == n - 1 and bend != 0.0:
            r = inverse(z[at] - d[n + 4, 1])
            p += bend * r
            follows = -bend * r * r
            rate += speed[n + 4, 0] * r - follows * speed[n + 4, 1]
        square = p * pp
        # each dyad: c gamma + k gamma* + e = 0
        c1, k1, e1 = x * pp - n1, xx * p - nn1, p * ss1 + pp * s1 + square
        c2, k2, e2 = y * pp - n2, yy * p - nn2, p * ss2 + pp * s2 + square
        # minors: both rotations as quotients
        u, v, w = k1 * e2 - k2 * e1, e1 * c2 - e2 * c1, c1 * k2 - c2 * k1
        fw, fu, fv = u + v, w + v, w + u
        # slopes by the coefficients, then by the unknowns
        gc1, gk1, ge1 = fw * k2 - fv * e2, fu * e2 - fw * c2, fv * c2 - fu * k2
        gc2, gk2, ge2 = fv * e1 - fw * k1, fw * c1 - fu * e1, fu * k1 - fv * c1
        g[0] = -gk1 * xx - ge1 * pp
        g[1] = -gc1 * x - ge1 * p
        g[2] = gc1 * (pp - aa) + ge1 * pp
        g[3] = gk1 * (p - a) + ge1 * p
        g[4] = -gk2 * yy - ge2 * pp
        g[5] = -gc2 * y - ge2 * p
        g[6] = gc2 * (pp - bb) + ge2 * pp
        g[7] = gk2 * (p - b) + ge2 * p
        slope = gk1 * xx + ge1 * (ss1 + pp) + gk2 * yy + ge2 * (ss2 + pp)
        g[at] += slope * follows
        # what the motion of points and given unknowns adds
        right = slope * rate + (gc1 * x + ge1 * (s1 + p) + gc2 * y + ge2 * (s2 + p)) * speed[j, 1]
        for k in given:
            right += g[k] * speed[n + k // 2, k % 2]
        for i in range(n):
            M[j, i] = g[free[i]]
        M[j, n] = w * fw + u * v
        M[j, n + 1] = right


@kernel
def solve(M):
    """Elimination with scaled rows and the largest pivots; the last columns of M become the solutions, negated."""
    n, m = M.shape
    for i in range(n):
        top = 0.0
        for j in range(n):
            top = max(top, size(M[i, j]))
        if not top > 0.0:
            return False
        top = 1.0 / top
        for j in range(m):
            M[i, j] = M[i, j] * top
    for k in range(n):
        best, at = -1.0, k
        for i in range(k, n):
            s = size(M[i, k])
            if s > best:
                best, at = s, i
        if not best > 0.0:
            return False
        if at != k:
            for j in range(k, m):
                M[k, j], M[at, j] = M[at, j], M[k, j]
        r = inverse(M[k, k])
        for j in range(k + 1, m):
            M[k, j] = M[k, j] * r
        for i in range(k + 1, n):
            t = M[i, k]
            for j in range(k + 1, m):
                M[i, j] -= t * M[k, j]
    for k in range(n - 1, -1, -1):
        for i in range(k):
            t = M[i, k]
            for j in range(n, m):
                M[i, j] -= t * M[k, j]
    for i in range(n):
        for j in range(n, m):
            M[i, j] = -M[i, j]
    return True


@kernel
def place(t, start, change, given, d, z):
    """Points at time t, and given unknowns."""
    n = d.shape[0] - 5
    for j in range(n + 5):
        for i in range(2):
            d[j, i] = start[j, i] + t * change[j, i]
    for k in given:
        z[k] = d[n + k // 2, k % 2]


@kernel
def correct(z, d, change, free, given, M, tolerance):
    """Newton's method; the size of the first correction and of the last, relative, and the number of corrections."""
    n = free.shape[0]
    first, last, before = 0.0, 1e300, 1e300
    for step in range(_NEWTON):
        linearise(z, d, change, free, given, M)
        if not solve(M):
            return 1e300, 1e300, step
        last = 0.0
        for i in range(n):
            last = max(last, size(M[i, n]) / (0.1 + size(z[free[i]])))
        if step == 0:
            first = last
        if not last < 1e-2 or last > 0.3 * before:  # not the square convergence near a root
            return first, (last if last <= tolerance else 1e300), step + 1
        for i in range(n):
            z[free[i]] += M[i, n]
        if last <= tolerance:
            return first, last, step + 1
        before = last
    return first, 1e300, _NEWTON


@kernel
def follow(z, start, change, free, given, settings, work):
    """One root from t = 0 to t = 1, in place; return how it ended, the number of steps and of linear systems.

    ``settings``: largest first correction, tolerance of the corrector, first step, least step.
    """
    most, tolerance, h, least = settings[0], settings[1], settings[2], settings[3]
    n = free.shape[0]
    d, M, k1, k2, k3, k4, z0, zt = work
    t = 0.0
    place(0.0, start, change, given, d, z)
    first, last, spent = correct(z, d, change, free, given, M, tolerance)
    for i in range(n):
        k1[i] = M[i, n + 1]
    # t grows from 0 to 1 in steps h that follow the first correction
    for step in range(100000):
        h = min(h, 1.0 - t)
        for k in range(8):
            z0[k], zt[k] = z[k], z[k]
        # Runge and Kutta's rule
        half = t + 0.5 * h
        good = True
        place(half, start, change, given, d, zt)
        for i in range(n):
            zt[free[i]] = z0[free[i]] + 0.5 * h * k1[i]
        linearise(zt, d, change, free, given, M)
        good &= solve(M)
        for i in range(n):
            k2[i] = M[i, n + 1]
            zt[free[i]] = z0[free[i]] + 0.5 * h * k2[i]
        linearise(zt, d, change, free, given, M)
        good &= solve(M)
        for i in range(n):
            k3[i] = M[i, n + 1]
            zt[free[i]] = z0[free[i]] + h * k3[i]
        after = 1.0 if h == 1.0 - t else t + h
        place(after, start, change, given, d, zt)
        linearise(zt, d, change, free, given, M)
        good &= solve(M)
        for i in range(n):
            k4[i] = M[i, n + 1]
            zt[free[i]] = z0[free[i]] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i])
        # back to the path; the first correction is the error of the step
        first, last, used = correct(zt, d, change, free, given, M, tolerance)
        spent += 3 + used
        if good and first <= most and last <= tolerance:
            t = after
            for k in range(8):
                z[k] = zt[k]
            for i in range(n):
                k1[i] = M[i, n + 1]
            if t == 1.0:
                correct(z, d, change, free, given, M, 0.0)  # to the last digits
                return REACHED, step, spent
            h *= min(3.0, 0.85 * (most / max(first, 1e-300)) ** 0.2)
        else:
            h *= 0.5 if not first < 1e200 else max(0.2, min(0.6, 0.8 * (most / first) ** 0.2))
            if h < least:
                return STEP_TOO_SMALL, step, spent
    return TOO_MANY_STEPS, 100000, spent


@kernel
def follow_all(Z, start, change, free, given, settings, ends):
    """Every root of Z, in place; how each ended, steps and systems in ``ends``."""
    n = free.shape[0]
    work = (
        np.empty((n + 5, 2), dtype=np.complex128),
        np.empty((n, n + 2), dtype=np.complex128),
        np.empty(n, dtype=np.complex128),
        np.empty(n, dtype=np.complex128),
        np.empty(n, dtype=np.complex128),
        np.empty(n, dtype=np.complex128),
        np.empty(8, dtype=np.complex128),
        np.empty(8, dtype=np.complex128),
    )
    for k in range(Z.shape[0]):
        how, steps, spent = follow(Z[k], start, change, free, given, settings, work)
        ends[k, 0], ends[k, 1], ends[k, 2] = how, steps, spent
