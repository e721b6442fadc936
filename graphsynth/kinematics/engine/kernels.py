"""Compiled kernels: constraint rows, Newton, closed-form dyads, eliminated links, and the run over the inputs.

One file, although long: the compiler's cache notices changes of the file that holds a caller, not of its callees.
Functions with many arguments and one caller are inlined, because passing the arrays costs more than the work.

The state of a link is one row of eleven numbers: x, y, cos theta, sin theta, theta (unwrapped; right only where gears
need it), the velocity (x', y', theta') and the acceleration.
"""

import math

import numpy as np
from numba import njit

TAU = 2.0 * math.pi


@njit(cache=True, error_model="numpy")
def row(kind, p, k, a, b, x, phi, q, g):
    """Value of one constraint row; its gradient by (x, y, theta) of a and of b goes to g[0:6]."""
    ca, sa, cb, sb = x[a, 2], x[a, 3], x[b, 2], x[b, 3]
    ux, uy = ca * p[k, 0] - sa * p[k, 1], sa * p[k, 0] + ca * p[k, 1]
    wx, wy = cb * p[k, 2] - sb * p[k, 3], sb * p[k, 2] + cb * p[k, 3]
    dx, dy = x[b, 0] + wx - x[a, 0] - ux, x[b, 1] + wy - x[a, 1] - uy
    for c in range(6):
        g[c] = 0.0
    if kind == 0:
        g[0], g[2], g[3], g[5] = -1.0, uy, 1.0, -wy
        return dx
    if kind == 1:
        g[1], g[2], g[4], g[5] = -1.0, -ux, 1.0, wx
        return dy
    if kind == 2:
        h = p[k, 6]
        ex, ey = dx * p[k, 11], dy * p[k, 11]
        g[0], g[1], g[2] = -ex, -ey, -(ux * ey - uy * ex)
        g[3], g[4], g[5] = ex, ey, wx * ey - wy * ex
        return 0.5 * (dx * ex + dy * ey - h)
    if kind == 3 or kind == 7:
        tx, ty = ca * p[k, 4] - sa * p[k, 5], sa * p[k, 4] + ca * p[k, 5]
        nx, ny = -ty, tx
        along = tx * dx + ty * dy
        across = nx * dx + ny * dy
        if kind == 3:
            g[0], g[1], g[2] = -nx, -ny, -along - (ux * ny - uy * nx)
            g[3], g[4], g[5] = nx, ny, wx * ny - wy * nx
            return across - p[k, 6]
        g[0], g[1], g[2] = -tx, -ty, across - (ux * ty - uy * tx)
        g[3], g[4], g[5] = tx, ty, wx * ty - wy * tx
        return along - p[k, 9] * q[int(p[k, 10]), 0]
    if kind == 4 or kind == 6:
        h = p[k, 6] if kind == 4 else p[k, 9] * q[int(p[k, 10]), 0]
        g[2], g[5] = -1.0, 1.0
        ch, sh = math.cos(h), math.sin(h)
        re, im = cb * ca + sb * sa, sb * ca - cb * sa
        return math.atan2(im * ch - re * sh, re * ch + im * sh)
    # gear: angles relative to the line of centres
    total = p[k, 7] + p[k, 9] * p[k, 8]
    square = dx * dx + dy * dy
    nx, ny = -dy / square, dx / square
    slot = int(p[k, 10])
    raw = math.atan2(dy, dx)
    here = raw + TAU * math.floor((phi[slot] - raw) / TAU + 0.5)
    scale = 1.0 / (p[k, 7] + p[k, 8])
    g[0], g[1], g[2] = scale * total * nx, scale * total * ny, scale * (p[k, 7] + total * (ux * ny - uy * nx))
    g[3], g[4] = -scale * total * nx, -scale * total * ny
    g[5] = scale * (p[k, 9] * p[k, 8] - total * (wx * ny - wy * nx))
    return scale * (p[k, 7] * (x[a, 4] - here) + p[k, 9] * p[k, 8] * (x[b, 4] - here - p[k, 6]))


@njit(cache=True, error_model="numpy")
def gamma(kind, p, k, a, b, x, q):
    """Second-order part of a row: its second derivative along the velocities, accelerations being zero."""
    if kind == 4:
        return 0.0
    if kind == 6:
        return -p[k, 9] * q[int(p[k, 10]), 2]
    ca, sa, cb, sb = x[a, 2], x[a, 3], x[b, 2], x[b, 3]
    ux, uy = ca * p[k, 0] - sa * p[k, 1], sa * p[k, 0] + ca * p[k, 1]
    wx, wy = cb * p[k, 2] - sb * p[k, 3], sb * p[k, 2] + cb * p[k, 3]
    oa, ob = x[a, 7], x[b, 7]
    cx, cy = oa * oa * ux - ob * ob * wx, oa * oa * uy - ob * ob * wy
    if kind == 0:
        return cx
    if kind == 1:
        return cy
    dx, dy = x[b, 0] + wx - x[a, 0] - ux, x[b, 1] + wy - x[a, 1] - uy
    ex, ey = x[b, 5] - ob * wy - x[a, 5] + oa * uy, x[b, 6] + ob * wx - x[a, 6] - oa * ux
    if kind == 2:
        return (ex * ex + ey * ey + dx * cx + dy * cy) * p[k, 11]
    if kind == 3 or kind == 7:
        tx, ty = ca * p[k, 4] - sa * p[k, 5], sa * p[k, 4] + ca * p[k, 5]
        if kind == 3:
            return oa * oa * (ty * dx - tx * dy) - 2.0 * oa * (tx * ex + ty * ey) - ty * cx + tx * cy
        return (-oa * oa * (tx * dx + ty * dy) + 2.0 * oa * (tx * ey - ty * ex) + tx * cx + ty * cy
                - p[k, 9] * q[int(p[k, 10]), 2])  # fmt: skip
    square = dx * dx + dy * dy
    turn = (dx * cy - dy * cx) / square - 2.0 * (dx * ex + dy * ey) * (dx * ey - dy * ex) / (square * square)
    return -(p[k, 7] + p[k, 9] * p[k, 8]) / (p[k, 7] + p[k, 8]) * turn


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
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
            if kind >= 6:
                f[r] = rp[k, 9] * q[int(rp[k, 10]), 1]
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


@njit(cache=True, error_model="numpy")
def follow_angle(link, x, near):
    """Unwrapped angle of a link, nearest to ``near``."""
    raw = math.atan2(x[link, 3], x[link, 2])
    x[link, 4] = raw + TAU * math.floor((near - raw) / TAU + 0.5)


@njit(cache=True, error_model="numpy")
def newton(rows, rp, r0, nr, core, c0, nc, x, phi, q, J, f, g, G, pivots, Lc, out):
    """Newton from x; out = (first correction, last correction, rate); returns 0 if it converged."""
    last = 0.0
    out[2] = 0.0
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
        if it > 12 and size >= 0.5 * last:
            return 3
        last = size
    return 3


@njit(cache=True, error_model="numpy")
def drive(step, d, p, r, x, q):
    """Place a driven link from the link it is driven on."""
    base, link, k = d[r, 1], d[r, 2], d[r, 3]
    s = p[r, 6]
    cb, sb = x[base, 2], x[base, 3]
    px, py = cb * p[r, 0] - sb * p[r, 1], sb * p[r, 0] + cb * p[r, 1]
    turn = p[r, 7] + (s * q[k, 0] if step == 0 else 0.0)
    c, sn = math.cos(turn), math.sin(turn)
    x[link, 4] = x[base, 4] + turn
    x[link, 2], x[link, 3] = cb * c - sb * sn, sb * c + cb * sn
    ox, oy = x[link, 2] * p[r, 4] - x[link, 3] * p[r, 5], x[link, 3] * p[r, 4] + x[link, 2] * p[r, 5]
    o, al = x[base, 7], x[base, 10]
    tx, ty, rate, acc = 0.0, 0.0, 0.0, 0.0
    if step == 1:
        tx, ty = cb * p[r, 2] - sb * p[r, 3], sb * p[r, 2] + cb * p[r, 3]
        px, py = px + s * q[k, 0] * tx, py + s * q[k, 0] * ty
        rate, acc = s * q[k, 1], s * q[k, 2]
    x[link, 0], x[link, 1] = x[base, 0] + px - ox, x[base, 1] + py - oy
    ol, all_ = o, al
    if step == 0:
        ol, all_ = o + s * q[k, 1], al + s * q[k, 2]
    x[link, 5] = x[base, 5] - o * py + rate * tx + ol * oy
    x[link, 6] = x[base, 6] + o * px + rate * ty - ol * ox
    x[link, 7] = ol
    x[link, 8] = x[base, 8] - al * py - o * o * px + acc * tx - 2.0 * o * rate * ty + all_ * oy + ol * ol * ox
    x[link, 9] = x[base, 9] + al * px - o * o * py + acc * ty + 2.0 * o * rate * tx - all_ * ox + ol * ol * oy
    x[link, 10] = all_


@njit(cache=True, error_model="numpy")
def world(x, link, px, py):
    """World point of a local one."""
    c, s = x[link, 2], x[link, 3]
    return x[link, 0] + c * px - s * py, x[link, 1] + s * px + c * py


@njit(cache=True, error_model="numpy")
def turn_to(x, link, lx, ly, wx, wy):
    """Orient a link so that its local vector (lx, ly) points along (wx, wy)."""
    re, im = lx * wx + ly * wy, lx * wy - ly * wx
    size = math.sqrt(re * re + im * im)
    x[link, 2], x[link, 3] = re / size, im / size


@njit(cache=True, error_model="numpy")
def pin_to(x, link, lx, ly, wx, wy):
    """Move an oriented link so that its local point lies at (wx, wy)."""
    c, s = x[link, 2], x[link, 3]
    x[link, 0], x[link, 1] = wx - (c * lx - s * ly), wy - (s * lx + c * ly)


@njit(cache=True, error_model="numpy")
def orient(rows, rp, k, x, own):
    """Orient link ``own`` by the ANGLE row k."""
    a, b, h = rows[k, 1], rows[k, 2], rp[k, 6]
    other, sign = (a, 1.0) if own == b else (b, -1.0)
    c, s = math.cos(h), sign * math.sin(h)
    x[own, 2], x[own, 3] = x[other, 2] * c - x[other, 3] * s, x[other, 3] * c + x[other, 2] * s
    x[own, 4] = x[other, 4] + sign * h


@njit(cache=True, error_model="numpy")
def line_of(rows, rp, k, x, own):
    """For an oriented link ``own`` in a LINE row: direction t and the value kappa of n . r_own."""
    a, b = rows[k, 1], rows[k, 2]
    c, s = x[a, 2], x[a, 3]
    tx, ty = c * rp[k, 4] - s * rp[k, 5], s * rp[k, 4] + c * rp[k, 5]
    if own == b:
        px, py = world(x, a, rp[k, 0], rp[k, 1])
        ox, oy = x[b, 2] * rp[k, 2] - x[b, 3] * rp[k, 3], x[b, 3] * rp[k, 2] + x[b, 2] * rp[k, 3]
        return tx, ty, rp[k, 6] - ty * (px - ox) + tx * (py - oy)
    px, py = world(x, b, rp[k, 2], rp[k, 3])
    ox, oy = c * rp[k, 0] - s * rp[k, 1], s * rp[k, 0] + c * rp[k, 1]
    return tx, ty, -ty * (px - ox) + tx * (py - oy) - rp[k, 6]


@njit(cache=True, error_model="numpy")
def circles(dx, dy, l1, l2, sign, out):
    """Vector from A to C with |AC| = l1, |BC| = l2, B - A = (dx, dy); returns sin^2 of the angle at C (< 0: open)."""
    dd = dx * dx + dy * dy
    d = math.sqrt(dd)
    product = ((l1 + l2) - d) * ((l1 + l2) + d) * (d - (l1 - l2)) * (d + (l1 - l2))
    margin = product / (4.0 * l1 * l1 * l2 * l2)
    if margin < 0.0:
        return margin
    if dd == 0.0:
        return -5e-324  # A on B: every direction or none
    c = dd + (l1 - l2) * (l1 + l2)
    s = sign * math.sqrt(product)
    f = 0.5 / dd
    out[0], out[1] = f * (c * dx - s * dy), f * (c * dy + s * dx)
    return margin


@njit(cache=True, error_model="numpy")
def closed_form(code, rows, rp, r0, own, sign, x, phi, g):
    """Place the one core link of a group; returns its margin, negative where it cannot be assembled."""
    if code == 7 or code == 8:  # a sliding pair orients the link: rows LINE, ANGLE, then DIST or LINE
        orient(rows, rp, r0 + 1, x, own)
        tx, ty, kappa = line_of(rows, rp, r0, x, own)
        k = r0 + 2
        if code == 8:
            sx, sy, other = line_of(rows, rp, k, x, own)
            det = tx * sy - ty * sx
            if det == 0.0:
                return 0.0
            x[own, 0], x[own, 1] = (kappa * sx - other * tx) / det, (kappa * sy - other * ty) / det
            return det
        a, b, l = rows[k, 1], rows[k, 2], rp[k, 6]
        if own == a:
            bx, by = world(x, b, rp[k, 2], rp[k, 3])
            lx, ly = rp[k, 0], rp[k, 1]
        else:
            bx, by = world(x, a, rp[k, 0], rp[k, 1])
            lx, ly = rp[k, 2], rp[k, 3]
        ox, oy = x[own, 2] * lx - x[own, 3] * ly, x[own, 3] * lx + x[own, 2] * ly
        e = kappa - ty * (ox - bx) + tx * (oy - by)
        margin = (l - e) * (l + e) / (l * l)
        if margin < 0.0:
            return margin
        along = sign * math.sqrt((l - e) * (l + e))
        pin_to(x, own, lx, ly, bx - e * ty + along * tx, by + e * tx + along * ty)
        return margin
    # a turning pair holds the point A; rows RX, RY, then one more
    a, b, k = rows[r0, 1], rows[r0, 2], r0 + 2
    if own == a:
        ax, ay = world(x, b, rp[r0, 2], rp[r0, 3])
        hx, hy = rp[r0, 0], rp[r0, 1]
    else:
        ax, ay = world(x, a, rp[r0, 0], rp[r0, 1])
        hx, hy = rp[r0, 2], rp[r0, 3]
    margin = 1.0
    a, b = rows[k, 1], rows[k, 2]
    if own == a:
        lx, ly = rp[k, 0] - hx, rp[k, 1] - hy
    else:
        lx, ly = rp[k, 2] - hx, rp[k, 3] - hy
    if code == 2:
        if own == a:
            bx, by = world(x, b, rp[k, 2], rp[k, 3])
        else:
            bx, by = world(x, a, rp[k, 0], rp[k, 1])
        margin = circles(bx - ax, by - ay, math.sqrt(lx * lx + ly * ly), rp[k, 6], sign, g)
        if not margin >= 0.0:
            return margin
        turn_to(x, own, lx, ly, g[0], g[1])
    elif code == 3:  # the pin of this link runs on a line
        px, py = world(x, a, rp[k, 0], rp[k, 1])
        c, s = x[a, 2], x[a, 3]
        tx, ty = c * rp[k, 4] - s * rp[k, 5], s * rp[k, 4] + c * rp[k, 5]
        e = -ty * (px - ax) + tx * (py - ay) + rp[k, 6]
        square = lx * lx + ly * ly
        l = math.sqrt(square)
        margin = (l - e) * (l + e) / square
        if margin < 0.0:
            return margin
        along = sign * math.sqrt((l - e) * (l + e))
        turn_to(x, own, lx, ly, -e * ty + along * tx, e * tx + along * ty)
    elif code == 4:  # a pin runs on the line of this link
        bx, by = world(x, b, rp[k, 2], rp[k, 3])
        dx, dy = bx - ax, by - ay
        dd = dx * dx + dy * dy
        d = math.sqrt(dd)
        tx, ty = rp[k, 4], rp[k, 5]
        e = -ty * lx + tx * ly + rp[k, 6]
        if dd == 0.0:
            return -5e-324
        margin = (d - e) * (d + e) / dd
        if margin < 0.0:
            return margin
        along = sign * math.sqrt((d - e) * (d + e))
        turn_to(x, own, along * tx - e * ty, along * ty + e * tx, dx, dy)
    elif code == 5:
        orient(rows, rp, k, x, own)
    else:  # gear with its centre on the turning pair
        other = b if own == a else a
        if own == a:
            ox, oy = world(x, b, rp[k, 2], rp[k, 3])
            raw = math.atan2(oy - ay, ox - ax)
        else:
            ox, oy = world(x, a, rp[k, 0], rp[k, 1])
            raw = math.atan2(ay - oy, ax - ox)
        slot = int(rp[k, 10])
        here = raw + TAU * math.floor((phi[slot] - raw) / TAU + 0.5)
        ra, rb = rp[k, 7], rp[k, 9] * rp[k, 8]
        if own == a:
            x[own, 4] = here - rb * (x[other, 4] - here - rp[k, 6]) / ra
        else:
            x[own, 4] = here + rp[k, 6] - ra * (x[other, 4] - here) / rb
        x[own, 2], x[own, 3] = math.cos(x[own, 4]), math.sin(x[own, 4])
    pin_to(x, own, hx, hy, ax, ay)
    return margin


@njit(cache=True, error_model="numpy")
def place_eliminated(kind, e, a, b, p, r, x, derivs):
    """Place a link eliminated from its group, with velocity and acceleration."""
    ax, ay = world(x, a, p[r, 0], p[r, 1])
    bx, by = world(x, b, p[r, 4], p[r, 5])
    if kind == 0:
        turn_to(x, e, p[r, 6] - p[r, 2], p[r, 7] - p[r, 3], bx - ax, by - ay)
        pin_to(x, e, p[r, 2], p[r, 3], ax, ay)
    else:
        base = b if kind == 1 else a
        c, s = math.cos(p[r, 12]), math.sin(p[r, 12])
        x[e, 2], x[e, 3] = x[base, 2] * c - x[base, 3] * s, x[base, 3] * c + x[base, 2] * s
        x[e, 4] = x[base, 4] + p[r, 12]
        if kind == 1:
            pin_to(x, e, p[r, 2], p[r, 3], ax, ay)
    oa, ob, la, lb = x[a, 7], x[b, 7], x[a, 10], x[b, 10]
    ux, uy, wx, wy = ax - x[a, 0], ay - x[a, 1], bx - x[b, 0], by - x[b, 1]
    vax, vay, vbx, vby = x[a, 5] - oa * uy, x[a, 6] + oa * ux, x[b, 5] - ob * wy, x[b, 6] + ob * wx
    aax, aay = x[a, 8] - la * uy - oa * oa * ux, x[a, 9] + la * ux - oa * oa * uy
    abx, aby = x[b, 8] - lb * wy - ob * ob * wx, x[b, 9] + lb * wx - ob * ob * wy
    c, s = x[e, 2], x[e, 3]
    fx, fy = c * p[r, 2] - s * p[r, 3], s * p[r, 2] + c * p[r, 3]
    if kind < 2:
        if not derivs:
            return
        o, l = ob, lb
        if kind == 0:
            dx, dy = bx - ax, by - ay
            dd = dx * dx + dy * dy
            o = (dx * (vby - vay) - dy * (vbx - vax)) / dd
            l = (dx * (aby - aay) - dy * (abx - aax)) / dd
        x[e, 5], x[e, 6], x[e, 7] = vax + o * fy, vay - o * fx, o
        x[e, 8], x[e, 9], x[e, 10] = aax + l * fy + o * o * fx, aay - l * fx + o * o * fy, l
        return
    # two sliding pairs: the origin lies on two lines of known directions
    hx, hy = c * p[r, 6] - s * p[r, 7], s * p[r, 6] + c * p[r, 7]
    tx, ty = x[a, 2] * p[r, 8] - x[a, 3] * p[r, 9], x[a, 3] * p[r, 8] + x[a, 2] * p[r, 9]
    sx, sy = x[b, 2] * p[r, 10] - x[b, 3] * p[r, 11], x[b, 3] * p[r, 10] + x[b, 2] * p[r, 11]
    det = tx * sy - ty * sx
    k1 = -ty * (ax - fx) + tx * (ay - fy)
    k2 = -sy * (bx - hx) + sx * (by - hy)
    x[e, 0], x[e, 1] = (k1 * sx - k2 * tx) / det, (k1 * sy - k2 * ty) / det
    if not derivs:
        return
    o, l = oa, la
    X1, Y1, X2, Y2 = x[e, 0] + fx - ax, x[e, 1] + fy - ay, x[e, 0] + hx - bx, x[e, 1] + hy - by
    # d/du of n . X = 0 with n' = -omega t
    k1 = -ty * (vax + o * fy) + tx * (vay - o * fx) + o * (tx * X1 + ty * Y1)
    k2 = -sy * (vbx + o * hy) + sx * (vby - o * hx) + o * (sx * X2 + sy * Y2)
    x[e, 5], x[e, 6], x[e, 7] = (k1 * sx - k2 * tx) / det, (k1 * sy - k2 * ty) / det, o
    p1x, p1y = x[e, 5] - o * fy - vax, x[e, 6] + o * fx - vay
    p2x, p2y = x[e, 5] - o * hy - vbx, x[e, 6] + o * hx - vby
    # n'' = -alpha t - omega^2 n, and n . X = 0
    k1 = (-ty * (aax + l * fy + o * o * fx) + tx * (aay - l * fx + o * o * fy)
          + 2.0 * o * (tx * p1x + ty * p1y) + l * (tx * X1 + ty * Y1))  # fmt: skip
    k2 = (-sy * (abx + l * hy + o * o * hx) + sx * (aby - l * hx + o * o * hy)
          + 2.0 * o * (sx * p2x + sy * p2y) + l * (sx * X2 + sy * Y2))  # fmt: skip
    x[e, 8], x[e, 9], x[e, 10] = (k1 * sx - k2 * tx) / det, (k1 * sy - k2 * ty) / det, l


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
def pivot_rates(rows, rp, r0, own, x, phi, q, g):
    """Rates of a link that turns about a point of a placed link: one unknown, from the third row."""
    if rows[r0, 1] == own:
        far, ax, ay = rows[r0, 2], rp[r0, 2], rp[r0, 3]
    else:
        far, ax, ay = rows[r0, 1], rp[r0, 0], rp[r0, 1]
    ax, ay = world(x, far, ax, ay)
    ux, uy = ax - x[far, 0], ay - x[far, 1]
    o, l = x[far, 7], x[far, 10]
    vx, vy = x[far, 5] - o * uy, x[far, 6] + o * ux
    bx, by = x[far, 8] - l * uy - o * o * ux, x[far, 9] + l * ux - o * o * uy
    px, py = x[own, 0] - ax, x[own, 1] - ay
    k = r0 + 2
    kind, a, b = rows[k, 0], rows[k, 1], rows[k, 2]
    row(kind, rp, k, a, b, x, phi, q, g)
    other, i, j = (b, 0, 3) if a == own else (a, 3, 0)
    coefficient = g[i + 2] - g[i] * py + g[i + 1] * px
    total = g[i] * vx + g[i + 1] * vy + g[j] * x[other, 5] + g[j + 1] * x[other, 6] + g[j + 2] * x[other, 7]
    o = -total / coefficient
    x[own, 5], x[own, 6], x[own, 7] = vx - o * py, vy + o * px, o
    bx, by = bx - o * o * px, by - o * o * py
    total = gamma(kind, rp, k, a, b, x, q) + g[i] * bx + g[i + 1] * by
    total += g[j] * x[other, 8] + g[j + 1] * x[other, 9] + g[j + 2] * x[other, 10]
    l = -total / coefficient
    x[own, 8], x[own, 9], x[own, 10] = bx - l * py, by + l * px, l


@njit(cache=True, error_model="numpy")
def anchors(rows, rp, r0, own, x, P):
    """Of three distances to one link: far points with velocity and acceleration, near points (local), lengths."""
    for r in range(3):
        k = r0 + r
        if rows[k, 1] == own:
            far, fx, fy, P[r, 6], P[r, 7] = rows[k, 2], rp[k, 2], rp[k, 3], rp[k, 0], rp[k, 1]
        else:
            far, fx, fy, P[r, 6], P[r, 7] = rows[k, 1], rp[k, 0], rp[k, 1], rp[k, 2], rp[k, 3]
        px, py = world(x, far, fx, fy)
        ux, uy, o, l = px - x[far, 0], py - x[far, 1], x[far, 7], x[far, 10]
        P[r, 0], P[r, 1] = px, py
        P[r, 2], P[r, 3] = x[far, 5] - o * uy, x[far, 6] + o * ux
        P[r, 4], P[r, 5] = x[far, 8] - l * uy - o * o * ux, x[far, 9] + l * ux - o * o * uy
        P[r, 8], P[r, 9] = rp[k, 6], rp[k, 11]


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
def platform(P, x, own, Q, Lc, out, m, s):
    """Newton and rates of a link held by three distances (class III triad); returns the code of `newton`."""
    last = 0.0
    out[2] = 0.0
    for it in range(30):
        platform_rows(P, x, own, Q)
        det, fx, fy, ft = solve3(Q, Q[0, 3], Q[1, 3], Q[2, 3])
        size = math.sqrt(fx * fx + fy * fy + Lc * Lc * ft * ft) / Lc
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


@njit(cache=True, error_model="numpy", inline="always")
def predict(core, c0, nc, x, h, Lc):
    """Move the core links to second order; returns how far, scaled."""
    travel = 0.0
    for k in range(nc):
        link = core[c0 + k]
        ax, ay, at = h * x[link, 5], h * x[link, 6], h * x[link, 7]
        bx, by, bt = 0.5 * h * h * x[link, 8], 0.5 * h * h * x[link, 9], 0.5 * h * h * x[link, 10]
        travel += ax * ax + ay * ay + Lc * Lc * at * at + bx * bx + by * by + Lc * Lc * bt * bt
        x[link, 0] += ax + bx
        x[link, 1] += ay + by
        x[link, 4] += at + bt
        c, s = math.cos(at + bt), math.sin(at + bt)
        x[link, 2], x[link, 3] = x[link, 2] * c - x[link, 3] * s, x[link, 3] * c + x[link, 2] * s
    return math.sqrt(travel) / Lc


@njit(cache=True, error_model="numpy", inline="always")
def sample(steps, rows, rp, core, elim, ep, drv, dp, need, gears, q, h, warm, modes, x, phi, m,
           J, f, g, G, pivots, out, P, Q, Lc, derivs):  # fmt: skip
    """Move the state (x, phi, margins m) to the next input, h further; returns (code, step)."""
    for s in range(steps.shape[0]):
        code, r0, nr, c0, nc = steps[s, 0], steps[s, 1], steps[s, 2], steps[s, 3], steps[s, 4]
        if code < 2:
            if not math.isfinite(q[drv[r0, 3], 0]):
                return 5, s
            drive(code, drv, dp, r0, x, q)
            m[s] = 1.0
            continue
        before, own = m[s], core[c0]
        if code >= 9:
            travel = predict(core, c0, nc, x, h, Lc) if warm else 0.0
            if not travel <= 0.5:
                return 2, s
            if code == 9:
                why = newton(rows, rp, r0, nr, core, c0, nc, x, phi, q, J, f, g, G, pivots, Lc, out)
            else:
                anchors(rows, rp, r0, own, x, P)
                why = platform(P, x, own, Q, Lc, out, m, s)
            if why:
                return why, s
            if warm and (out[0] > 0.1 * travel + 1e-9 or out[2] > 0.1):
                return 2, s
        else:
            near = x[own, 4] + (h * x[own, 7] if warm and derivs else 0.0)
            m[s] = closed_form(code, rows, rp, r0, own, modes[s], x, phi, g)
            if code == 8:  # one mode; its determinant keeps its sign
                if m[s] == 0.0 or (warm and not m[s] * before > 0.0):
                    return 1, s
            elif m[s] < 0.0:
                return 1, s
            if not math.isfinite(m[s]):
                return 3, s
            if need[own] and code != 6:
                follow_angle(own, x, near)
        if 2 <= code <= 6 and derivs:
            pivot_rates(rows, rp, r0, own, x, phi, q, g)
        elif code != 10 and derivs:
            det = rates(rows, rp, r0, nr, core, c0, nc, x, phi, q, J, f, g, G, pivots)
            if code == 9:
                m[s] = det / Lc**nc
        if code >= 9:
            if m[s] == 0.0:
                return 4, s
            if warm and not (m[s] * before > 0.0 and abs(m[s]) > 0.5 * abs(before)):
                return 2, s
        for k in range(steps[s, 5], steps[s, 5] + steps[s, 6]):
            e = elim[k, 1]
            near = x[e, 4] + (h * x[e, 7] if warm and derivs else 0.0)
            place_eliminated(elim[k, 0], e, elim[k, 2], elim[k, 3], ep, k, x, derivs)
            if need[e]:
                follow_angle(e, x, near)
    for k in range(gears.shape[0]):
        r = gears[k]
        ax, ay = world(x, rows[r, 1], rp[r, 0], rp[r, 1])
        bx, by = world(x, rows[r, 2], rp[r, 2], rp[r, 3])
        raw = math.atan2(by - ay, bx - ax)
        phi[k] = raw + TAU * math.floor((phi[k] - raw) / TAU + 0.5)
    return 0, -1


@njit(cache=True, error_model="numpy")
def run(steps, rows, RP, core, elim, EP, drv, DP, need, gears, q, u, modes, X, TH, V, W, PHI, M, done, why, first, Lc,
        derivs):  # fmt: skip
    """Run a program for every dimension set over the samples first..n-1.

    RP, EP, DP, X, TH, V, W, PHI, M have the dimension set as first axis.  Sample ``first`` starts from ``first - 1`` if
    there is one; else cold, from the poses already in X[b, 0], TH[b, 0].  Returns nothing: ``done`` gets the samples
    reached, ``why`` the code and the step at which it stopped.
    """
    links, size = X.shape[2], 3
    for s in range(steps.shape[0]):
        size = max(size, steps[s, 2])
    J, f, g, out = np.empty((size, size)), np.empty(size), np.empty(6), np.zeros(3)
    G, pivots = np.empty((size, 6)), np.empty(size, np.int64)
    P, Q = np.empty((3, 10)), np.empty((3, 6))
    x = np.zeros((links, 11))
    phi, m, ql = np.empty(PHI.shape[2]), np.empty(steps.shape[0]), np.empty((q.shape[1], 3))
    for b in range(X.shape[0]):
        j = max(first - 1, 0)
        for k in range(links):
            for c in range(4):
                x[k, c] = X[b, j, k, c]
            x[k, 4] = TH[b, j, k]
            for c in range(3 if derivs else 0):
                x[k, 5 + c], x[k, 8 + c] = V[b, j, k, c], W[b, j, k, c]
        for k in range(phi.shape[0]):
            phi[k] = PHI[b, j, k]
        for k in range(m.shape[0]):
            m[k] = M[b, j, k]
        rp, ep, dp = RP[b], EP[b], DP[b]
        done[b], why[b, 0], why[b, 1] = u.shape[0], 0, -1
        for i in range(first, u.shape[0]):
            for k in range(ql.shape[0]):
                ql[k, 0], ql[k, 1], ql[k, 2] = q[i, k, 0], q[i, k, 1], q[i, k, 2]
            h = u[i] - u[i - 1] if i > 0 else 0.0
            code, s = sample(steps, rows, rp, core, elim, ep, drv, dp, need, gears, ql, h, i > 0, modes, x,
                             phi, m, J, f, g, G, pivots, out, P, Q, Lc, derivs)  # fmt: skip
            for k in range(m.shape[0]):
                M[b, i, k] = m[k]
            for k in range(links):
                X[b, i, k, 0], X[b, i, k, 1], X[b, i, k, 2], X[b, i, k, 3] = x[k, 0], x[k, 1], x[k, 2], x[k, 3]
                TH[b, i, k] = x[k, 4]
            if derivs:
                for k in range(links):
                    for c in range(3):
                        V[b, i, k, c], W[b, i, k, c] = x[k, 5 + c], x[k, 8 + c]
            for k in range(phi.shape[0]):
                PHI[b, i, k] = phi[k]
            if code:
                done[b], why[b, 0], why[b, 1] = i, code, s
                break


@njit(cache=True, error_model="numpy")
def rrr(A, B, l1, l2, sign, C, margin):
    """Third joints of RRR dyads; lengths of one entry are shared by all."""
    s1, s2 = min(1, l1.shape[0] - 1), min(1, l2.shape[0] - 1)
    for i in range(A.shape[0]):
        a, b = l1[s1 * i], l2[s2 * i]
        dx, dy = B[i, 0] - A[i, 0], B[i, 1] - A[i, 1]
        dd = dx * dx + dy * dy
        d = math.sqrt(dd)
        product = ((a + b) - d) * ((a + b) + d) * (d - (a - b)) * (d + (a - b))
        f = 0.5 / dd
        c, s = f * (dd + (a - b) * (a + b)), f * sign * math.sqrt(product)
        margin[i] = 0.25 * product / (a * a * b * b)
        C[i, 0], C[i, 1] = A[i, 0] + c * dx - s * dy, A[i, 1] + c * dy + s * dx
