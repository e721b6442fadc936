"""Groups solved by Newton's method at one sample: prediction, correction, rates."""

import math

from graphsynth.core.compilation import kernel
from graphsynth.kinematics.engine.codes import CAM, DRIVE_ANGLE, GEAR, INVERSE, PAX, PAY, PBX, PBY, SIGN, SLOT, H
from graphsynth.kinematics.engine.kernels.linear import back, factor, solve3
from graphsynth.kinematics.engine.kernels.rows import gamma, row, world

#: Corrections above this part of the size of the mechanism are never rounding: too few digits would be left.
ROUNDED = 1e-4


@kernel
def assemble(rows, rp, r0, nr, x, phi, q, J, f, g, G, moving):
    """Jacobian by the core links, residuals, or (moving) the right-hand side of the velocities; returns prod |row|."""
    norms = 1.0
    n = nr
    for r in range(nr):
        k = r0 + r
        kind, a, b, ia, ib = rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3], rows[k, 4]
        f[r] = row(kind, rp, k, a, b, x, phi, q, g)
        if moving:
            f[r] = 0.0
            if kind >= DRIVE_ANGLE:
                f[r] = rp[k, SIGN] * q[int(rp[k, SLOT]), 1]
        for c in range(n):
            J[r, c] = 0.0
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
def noise(rows, rp, r0, nr, x, q, J, f, G, pivots, size):
    """Length of the correction that rounding of the rows alone can cause; J holds the factors, G the gradients.

    A row is a sum of terms as large as coordinates and arms, each with a few units of rounding.
    """
    total = 0.0
    for column in range(nr):
        for r in range(nr):
            f[r] = 0.0
        k = r0 + column
        kind, a, b = rows[k, 0], rows[k, 1], rows[k, 2]
        reach = abs(rp[k, PAX]) + abs(rp[k, PAY]) + abs(rp[k, PBX]) + abs(rp[k, PBY])
        reach += abs(x[a, 0]) + abs(x[a, 1]) + abs(x[b, 0]) + abs(x[b, 1])
        turns = abs(x[a, 4]) + abs(x[b, 4]) if kind == GEAR else 1.0
        slide = abs(q[int(rp[k, SLOT]), 0]) if kind >= DRIVE_ANGLE and kind < CAM else 0.0
        steep = abs(G[column, 0]) + abs(G[column, 1]) + abs(G[column, 3]) + abs(G[column, 4])
        f[column] = 4e-16 * (steep * reach + (abs(G[column, 2]) + abs(G[column, 5])) * (1.0 + turns) + slide)
        back(J, nr, pivots, f)
        part = 0.0
        for c in range(nr):
            part += (f[c] * size) ** 2 if c % 3 == 2 else f[c] * f[c]
        total += math.sqrt(part)
    return total / size


@kernel
def newton(rows, rp, r0, nr, core, c0, nc, x, phi, q, J, f, g, G, pivots, Lc, out):
    """Newton from x; out = (first correction, last correction, rate, its rounding); returns 0 if it converged.

    Corrections that no longer become smaller are rounding if rounding of the rows explains them, whatever their size;
    only then is that computed.
    """
    last = 0.0
    out[2], out[3] = 0.0, 0.0
    for it in range(30):
        assemble(rows, rp, r0, nr, x, phi, q, J, f, g, G, False)
        det = factor(J, nr, pivots)
        if det == 0.0 or not math.isfinite(det):
            return 4
        back(J, nr, pivots, f)
        size = 0.0
        for k in range(nc):
            link = core[c0 + k]
            fx, fy, ft = f[3 * k], f[3 * k + 1], f[3 * k + 2]
            size += fx * fx + fy * fy + Lc * Lc * ft * ft
            x[link, 0] -= fx
            x[link, 1] -= fy
            x[link, 4] -= ft
            c, s = math.cos(ft), math.sin(ft)
            xc, xs = x[link, 2] * c + x[link, 3] * s, x[link, 3] * c - x[link, 2] * s
            inv = 1.5 - 0.5 * (xc * xc + xs * xs)
            x[link, 2], x[link, 3] = xc * inv, xs * inv
        size = math.sqrt(size) / Lc
        if not math.isfinite(size):
            return 3
        if it == 0:
            out[0] = size
        elif it == 1:
            out[2] = size / out[0] if out[0] > 1e-12 else 0.0
        out[1] = size
        if size <= 2e-16 * nr or (it > 0 and size <= 1e-8 and size <= 1e-3 * last) or (it > 2 and size <= 1e-13):
            return 0
        if it > 2 and size >= 0.5 * last and size <= ROUNDED:
            out[3] = noise(rows, rp, r0, nr, x, q, J, f, G, pivots, Lc)
            if size <= out[3] <= ROUNDED:
                return 0
        if it > 12 and size >= 0.5 * last:
            return 3
        last = size
    return 3


@kernel
def rates(rows, rp, r0, nr, core, c0, nc, x, phi, q, J, f, g, G, pivots):
    """Velocities and accelerations of the core links; returns the determinant over the product of row lengths."""
    norms = assemble(rows, rp, r0, nr, x, phi, q, J, f, g, G, True)
    det = factor(J, nr, pivots)
    if det == 0.0:
        for k in range(nc):
            for c in range(3):
                x[core[c0 + k], 5 + c] = math.nan
                x[core[c0 + k], 8 + c] = math.nan
        return 0.0
    back(J, nr, pivots, f)
    for k in range(nc):
        for c in range(3):
            x[core[c0 + k], 5 + c] = f[3 * k + c]
    for r in range(nr):
        k = r0 + r
        kind, a, b = rows[k, 0], rows[k, 1], rows[k, 2]
        total = -gamma(kind, rp, k, a, b, x, q)
        if rows[k, 3] < 0 or rows[k, 4] < 0:
            for c in range(3):
                if rows[k, 3] < 0:
                    total -= G[r, c] * x[a, 8 + c]
                if rows[k, 4] < 0:
                    total -= G[r, 3 + c] * x[b, 8 + c]
        f[r] = total
    back(J, nr, pivots, f)
    for k in range(nc):
        for c in range(3):
            x[core[c0 + k], 8 + c] = f[3 * k + c]
    return det / norms


@kernel(inline="always")
def predict(core, c0, nc, x, h, Lc, out):
    """Move the core links to second order; returns how far, scaled.  Their expected velocities go to ``out[4:]``."""
    travel = 0.0
    for k in range(nc):
        link = core[c0 + k]
        ax, ay, at = h * x[link, 5], h * x[link, 6], h * x[link, 7]
        bx, by, bt = 0.5 * h * h * x[link, 8], 0.5 * h * h * x[link, 9], 0.5 * h * h * x[link, 10]
        travel += ax * ax + ay * ay + Lc * Lc * at * at + bx * bx + by * by + Lc * Lc * bt * bt
        for c in range(3):
            out[4 + 3 * k + c] = x[link, 5 + c] + h * x[link, 8 + c]
        x[link, 0] += ax + bx
        x[link, 1] += ay + by
        x[link, 4] += at + bt
        c, s = math.cos(at + bt), math.sin(at + bt)
        x[link, 2], x[link, 3] = x[link, 2] * c - x[link, 3] * s, x[link, 3] * c + x[link, 2] * s
    return math.sqrt(travel) / Lc


@kernel(inline="always")
def surprise(core, c0, nc, x, h, Lc, out):
    """How far the velocities of the core links, over a step, carry from those that `predict` expected; scaled."""
    total = 0.0
    for k in range(nc):
        link = core[c0 + k]
        e = 4 + 3 * k
        dx, dy, dt = x[link, 5] - out[e], x[link, 6] - out[e + 1], x[link, 7] - out[e + 2]
        total += dx * dx + dy * dy + Lc * Lc * dt * dt
    return abs(h) * math.sqrt(total) / Lc


@kernel
def anchors(rows, rp, r0, own, x, P):
    """Of three distances to one link: far points with velocity and acceleration, near points (local), lengths."""
    for r in range(3):
        k = r0 + r
        if rows[k, 1] == own:
            far, fx, fy, P[r, 6], P[r, 7] = rows[k, 2], rp[k, PBX], rp[k, PBY], rp[k, PAX], rp[k, PAY]
        else:
            far, fx, fy, P[r, 6], P[r, 7] = rows[k, 1], rp[k, PAX], rp[k, PAY], rp[k, PBX], rp[k, PBY]
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
        c, sn = math.cos(ft), math.sin(ft)
        xc, xs = x[own, 2] * c + x[own, 3] * sn, x[own, 3] * c - x[own, 2] * sn
        inv = 1.5 - 0.5 * (xc * xc + xs * xs)
        x[own, 2], x[own, 3] = xc * inv, xs * inv
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
        Q[r, 3] = (Q[r, 0] * (P[r, 4] + o * o * ux) + Q[r, 1] * (P[r, 5] + o * o * uy)
                   - (ex * ex + ey * ey) * P[r, 9])  # fmt: skip
    det, x[own, 8], x[own, 9], x[own, 10] = solve3(Q, Q[0, 3], Q[1, 3], Q[2, 3])
    return 0
