"""Groups solved by Newton's method at one sample: small linear systems, prediction, correction, rates."""

import math

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels.nearest import cos, sin
from graphsynth.kinematics.engine.codes import CAM, DRIVE_ANGLE, GEAR, INVERSE, PAX, PAY, PBX, PBY, SIGN, SLOT, H
from graphsynth.kinematics.engine.kernels.rows import ends, gamma, row, world

#: Corrections above this part of the size of the mechanism are never rounding: too few digits would be left.
ROUNDED = 1e-4


@kernel
def copy(source, target):
    """Copy a matrix (a slice assignment takes far longer to compile)."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            target[i, j] = source[i, j]


@kernel
def factor(J, n, pivots):
    """LU in place with row pivoting; returns the determinant (0 if a pivot vanishes)."""
    det = 1.0
    for k in range(n):
        best, big = k, abs(J[k, k])
        for r in range(k + 1, n):
            if abs(J[r, k]) > big:
                best, big = r, abs(J[r, k])
        pivots[k] = best
        if not big > 0.0:
            return 0.0
        if best != k:
            det = -det
            for c in range(n):
                J[k, c], J[best, c] = J[best, c], J[k, c]
        det *= J[k, k]
        inv = 1.0 / J[k, k]
        for r in range(k + 1, n):
            m = J[r, k] * inv
            J[r, k] = m
            if m != 0.0:
                for c in range(k + 1, n):
                    J[r, c] -= m * J[k, c]
    return det


@kernel
def back(J, n, pivots, y):
    """Solve with the factors of `factor`, in place."""
    for k in range(n):
        if pivots[k] != k:
            y[k], y[pivots[k]] = y[pivots[k]], y[k]
    for k in range(n):
        for r in range(k + 1, n):
            y[r] -= J[r, k] * y[k]
    for k in range(n - 1, -1, -1):
        for c in range(k + 1, n):
            y[k] -= J[k, c] * y[c]
        y[k] /= J[k, k]


@kernel
def solve3(Q, a, b, c):
    """Cramer's rule for the first three columns of Q; returns determinant and solution."""
    m0 = Q[1, 1] * Q[2, 2] - Q[1, 2] * Q[2, 1]
    m1 = Q[2, 1] * Q[0, 2] - Q[2, 2] * Q[0, 1]
    m2 = Q[0, 1] * Q[1, 2] - Q[0, 2] * Q[1, 1]
    det = Q[0, 0] * m0 + Q[1, 0] * m1 + Q[2, 0] * m2
    n0 = Q[1, 2] * Q[2, 0] - Q[1, 0] * Q[2, 2]
    n1 = Q[2, 2] * Q[0, 0] - Q[2, 0] * Q[0, 2]
    n2 = Q[0, 2] * Q[1, 0] - Q[0, 0] * Q[1, 2]
    k0 = Q[1, 0] * Q[2, 1] - Q[1, 1] * Q[2, 0]
    k1 = Q[2, 0] * Q[0, 1] - Q[2, 1] * Q[0, 0]
    k2 = Q[0, 0] * Q[1, 1] - Q[0, 1] * Q[1, 0]
    f = 1.0 / det
    return det, f * (a * m0 + b * m1 + c * m2), f * (a * n0 + b * n1 + c * n2), f * (a * k0 + b * k1 + c * k2)


@kernel
def assemble(group, x, phi, q, room, moving):
    """Jacobian by the core links, residuals, or (moving) the right-hand side of the velocities; returns prod |row|."""
    rows, rp, n = group.rows, group.rp, group.nr
    J, f, g, G = room.J, room.f, room.g, room.G
    norms = 1.0
    for r in range(n):
        k = group.r0 + r
        kind, a, b, ia, ib = rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3], rows[k, 4]
        f[r] = row(kind, rp, k, a, b, x, phi, q, g)
        if moving:
            f[r] = 0.0
            if kind >= DRIVE_ANGLE:
                f[r] = rp[k, SIGN] * q[int(rp[k, SLOT]), 1]
        for c in range(n):
            J[r, c] = 0.0
        # a link of the core has columns; the velocity of any other goes to the right-hand side
        size = 0.0
        for c in range(3):
            G[r, c], G[r, 3 + c] = g[c], g[3 + c]
            if ia >= 0:
                J[r, 3 * ia + c] = g[c]
                size += g[c] * g[c] if c < 2 else 0.0
            elif moving:
                f[r] -= g[c] * x[a, 5 + c]
            if ib >= 0:
                J[r, 3 * ib + c] = g[3 + c]
                size += g[3 + c] * g[3 + c] if c < 2 else 0.0
            elif moving:
                f[r] -= g[3 + c] * x[b, 5 + c]
        norms *= max(1.0, math.sqrt(size))
    return norms


@kernel
def noise(group, x, q, room, size):
    """Length of the correction that rounding of the rows alone can cause; J holds the factors, G the gradients.

    A row is a sum of terms as large as coordinates and arms, each with a few units of rounding.
    """
    rp, nr, f, G = group.rp, group.nr, room.f, room.G
    total = 0.0
    for column in range(nr):
        for r in range(nr):
            f[r] = 0.0
        k = group.r0 + column
        kind, a, b = group.rows[k, 0], group.rows[k, 1], group.rows[k, 2]
        reach = abs(rp[k, PAX]) + abs(rp[k, PAY]) + abs(rp[k, PBX]) + abs(rp[k, PBY])
        reach += abs(x[a, 0]) + abs(x[a, 1]) + abs(x[b, 0]) + abs(x[b, 1])
        turns = abs(x[a, 4]) + abs(x[b, 4]) if kind == GEAR else 1.0
        slide = abs(q[int(rp[k, SLOT]), 0]) if kind >= DRIVE_ANGLE and kind < CAM else 0.0
        steep = abs(G[column, 0]) + abs(G[column, 1]) + abs(G[column, 3]) + abs(G[column, 4])
        f[column] = 4e-16 * (steep * reach + (abs(G[column, 2]) + abs(G[column, 5])) * (1.0 + turns) + slide)
        back(room.J, nr, room.pivots, f)
        part = 0.0
        for c in range(nr):
            part += (f[c] * size) ** 2 if c % 3 == 2 else f[c] * f[c]
        total += math.sqrt(part)
    return total / size


@kernel
def newton(group, x, phi, q, room, Lc):
    """Newton from x; room.out = (first correction, last correction, rate, its rounding); returns 0 if it converged.

    Corrections that no longer become smaller are rounding if rounding of the rows explains them, whatever their size;
    only then is that computed.
    """
    f, out, nr = room.f, room.out, group.nr
    last = 0.0
    out[2], out[3] = 0.0, 0.0
    for it in range(30):
        assemble(group, x, phi, q, room, False)
        det = factor(room.J, nr, room.pivots)
        if det == 0.0 or not math.isfinite(det):
            return 4
        back(room.J, nr, room.pivots, f)
        # move the links; cosine and sine are turned, and scaled to length 1 to first order
        size = 0.0
        for k in range(group.nc):
            link = group.core[group.c0 + k]
            fx, fy, ft = f[3 * k], f[3 * k + 1], f[3 * k + 2]
            size += fx * fx + fy * fy + Lc * Lc * ft * ft
            x[link, 0] -= fx
            x[link, 1] -= fy
            x[link, 4] -= ft
            turned_back(x, link, ft)
        size = math.sqrt(size) / Lc
        if not math.isfinite(size):
            return 3
        if it == 0:
            out[0] = size
        elif it == 1:
            out[2] = size / out[0] if out[0] > 1e-12 else 0.0
        out[1] = size
        # converged quadratically, to rounding, or to what rounding explains
        if size <= 2e-16 * nr or (it > 0 and size <= 1e-8 and size <= 1e-3 * last) or (it > 2 and size <= 1e-13):
            return 0
        if it > 2 and size >= 0.5 * last and size <= ROUNDED:
            out[3] = noise(group, x, q, room, Lc)
            if size <= out[3] <= ROUNDED:
                return 0
        # neither: it does not converge
        if it > 12 and size >= 0.5 * last:
            return 3
        last = size
    return 3


@kernel
def turned_back(x, link, angle):
    """Turn cosine and sine of a link by a small angle backwards; their length is set to 1 to first order."""
    c, s = cos(angle), sin(angle)
    xc, xs = x[link, 2] * c + x[link, 3] * s, x[link, 3] * c - x[link, 2] * s
    inv = 1.5 - 0.5 * (xc * xc + xs * xs)
    x[link, 2], x[link, 3] = xc * inv, xs * inv


@kernel
def rates(group, x, phi, q, room):
    """Velocities and accelerations of the core links; returns the determinant over the product of row lengths."""
    rows, core, c0, nr, f, G = group.rows, group.core, group.c0, group.nr, room.f, room.G
    norms = assemble(group, x, phi, q, room, True)
    det = factor(room.J, nr, room.pivots)
    if det == 0.0:
        for k in range(group.nc):
            for c in range(3):
                x[core[c0 + k], 5 + c] = math.nan
                x[core[c0 + k], 8 + c] = math.nan
        return 0.0
    back(room.J, nr, room.pivots, f)
    for k in range(group.nc):
        for c in range(3):
            x[core[c0 + k], 5 + c] = f[3 * k + c]
    for r in range(nr):
        k = group.r0 + r
        kind, a, b = rows[k, 0], rows[k, 1], rows[k, 2]
        total = -gamma(kind, group.rp, k, a, b, x, q)
        if rows[k, 3] < 0 or rows[k, 4] < 0:
            for c in range(3):
                if rows[k, 3] < 0:
                    total -= G[r, c] * x[a, 8 + c]
                if rows[k, 4] < 0:
                    total -= G[r, 3 + c] * x[b, 8 + c]
        f[r] = total
    back(room.J, nr, room.pivots, f)
    for k in range(group.nc):
        for c in range(3):
            x[core[c0 + k], 8 + c] = f[3 * k + c]
    return det / norms


@kernel(inline="always")
def predict(group, x, h, Lc, out):
    """Move the core links to second order; returns how far, scaled.  Their expected velocities go to ``out[4:]``."""
    travel = 0.0
    for k in range(group.nc):
        link = group.core[group.c0 + k]
        ax, ay, at = h * x[link, 5], h * x[link, 6], h * x[link, 7]
        bx, by, bt = 0.5 * h * h * x[link, 8], 0.5 * h * h * x[link, 9], 0.5 * h * h * x[link, 10]
        travel += ax * ax + ay * ay + Lc * Lc * at * at + bx * bx + by * by + Lc * Lc * bt * bt
        for c in range(3):
            out[4 + 3 * k + c] = x[link, 5 + c] + h * x[link, 8 + c]
        x[link, 0] += ax + bx
        x[link, 1] += ay + by
        x[link, 4] += at + bt
        c, s = cos(at + bt), sin(at + bt)
        x[link, 2], x[link, 3] = x[link, 2] * c - x[link, 3] * s, x[link, 3] * c + x[link, 2] * s
    return math.sqrt(travel) / Lc


@kernel
def anchors(group, x, P):
    """Of three distances to one link: far points with velocity and acceleration, near points (local), lengths."""
    rp, own = group.rp, group.core[group.c0]
    for r in range(3):
        k = group.r0 + r
        far, fx, fy, P[r, 6], P[r, 7] = ends(group.rows, rp, k, own)
        px, py = world(x, far, fx, fy)
        ux, uy, o, l = px - x[far, 0], py - x[far, 1], x[far, 7], x[far, 10]
        P[r, 0], P[r, 1] = px, py
        P[r, 2], P[r, 3] = x[far, 5] - o * uy, x[far, 6] + o * ux
        P[r, 4], P[r, 5] = x[far, 8] - l * uy - o * o * ux, x[far, 9] + l * ux - o * o * uy
        P[r, 8], P[r, 9] = rp[k, H], rp[k, INVERSE]


@kernel
def platform_rows(P, x, own, Q):
    """Rows of three distances: Q[r] = (unit vector from the far point, its moment, residual, near arm)."""
    X, Y, c, s = x[own, 0], x[own, 1], x[own, 2], x[own, 3]
    for r in range(3):
        ux, uy = c * P[r, 6] - s * P[r, 7], s * P[r, 6] + c * P[r, 7]
        dx, dy = X + ux - P[r, 0], Y + uy - P[r, 1]
        ex, ey = dx * P[r, 9], dy * P[r, 9]
        Q[r, 0], Q[r, 1], Q[r, 2] = ex, ey, ux * ey - uy * ex
        Q[r, 3] = 0.5 * (dx * ex + dy * ey - P[r, 8])
        Q[r, 4], Q[r, 5] = ux, uy


@kernel
def platform(P, x, own, Q, Lc, reach, out, m, s):
    """Newton and rates of a link held by three distances (class III triad); returns the code of `newton`."""
    last = 0.0
    out[2], out[3] = 0.0, 0.0
    for it in range(30):
        platform_rows(P, x, own, Q)
        det, fx, fy, ft = solve3(Q, Q[0, 3], Q[1, 3], Q[2, 3])
        size = math.sqrt(fx * fx + fy * fy + reach * reach * ft * ft) / reach
        if not math.isfinite(size):
            return 4 if det == 0.0 else 3
        x[own, 0] -= fx
        x[own, 1] -= fy
        x[own, 4] -= ft
        turned_back(x, own, ft)
        if it == 0:
            out[0] = size
        elif it == 1:
            out[2] = size / out[0] if out[0] > 1e-12 else 0.0
        out[1] = size
        if size <= 6e-16 or (it > 0 and size <= 1e-8 and size <= 1e-3 * last) or (it > 2 and size <= 1e-13):
            break
        if (it > 12 and size >= 0.5 * last) or it == 29:
            return 3
        last = size
    platform_rows(P, x, own, Q)
    for r in range(3):
        Q[r, 3] = Q[r, 0] * P[r, 2] + Q[r, 1] * P[r, 3]
    det, vx, vy, o = solve3(Q, Q[0, 3], Q[1, 3], Q[2, 3])
    m[s] = det / Lc
    x[own, 5], x[own, 6], x[own, 7] = vx, vy, o
    for r in range(3):
        ux, uy = Q[r, 4], Q[r, 5]
        ex, ey = vx - o * uy - P[r, 2], vy + o * ux - P[r, 3]
        turn = Q[r, 0] * (P[r, 4] + o * o * ux) + Q[r, 1] * (P[r, 5] + o * o * uy)
        Q[r, 3] = turn - (ex * ex + ey * ey) * P[r, 9]
    det, x[own, 8], x[own, 9], x[own, 10] = solve3(Q, Q[0, 3], Q[1, 3], Q[2, 3])
    return 0
