"""Compiled kernels: constraint rows, Newton, closed-form dyads, eliminated links, and the run over the inputs.

A pose is ``(x, y, cos theta, sin theta)``; angles are kept, unwrapped, only where gears need them.
"""

import math

import numpy as np
from numba import njit

TAU = 2.0 * math.pi


@njit(cache=True, error_model="numpy")
def row(kind, p, a, b, x, th, phi, q, g):
    """Value of one constraint row; its gradient by (x, y, theta) of a and of b goes to g[0:6]."""
    ca, sa, cb, sb = x[a, 2], x[a, 3], x[b, 2], x[b, 3]
    ux, uy = ca * p[0] - sa * p[1], sa * p[0] + ca * p[1]
    wx, wy = cb * p[2] - sb * p[3], sb * p[2] + cb * p[3]
    dx, dy = x[b, 0] + wx - x[a, 0] - ux, x[b, 1] + wy - x[a, 1] - uy
    for k in range(6):
        g[k] = 0.0
    if kind == 0:
        g[0], g[2], g[3], g[5] = -1.0, uy, 1.0, -wy
        return dx
    if kind == 1:
        g[1], g[2], g[4], g[5] = -1.0, -ux, 1.0, wx
        return dy
    if kind == 2:
        h = p[6]
        ex, ey = dx / h, dy / h
        g[0], g[1], g[2] = -ex, -ey, -(ux * ey - uy * ex)
        g[3], g[4], g[5] = ex, ey, wx * ey - wy * ex
        return 0.5 * (dx * ex + dy * ey - h)
    if kind == 3 or kind == 7:
        tx, ty = ca * p[4] - sa * p[5], sa * p[4] + ca * p[5]
        nx, ny = -ty, tx
        along = tx * dx + ty * dy
        across = nx * dx + ny * dy
        if kind == 3:
            g[0], g[1], g[2] = -nx, -ny, -along - (ux * ny - uy * nx)
            g[3], g[4], g[5] = nx, ny, wx * ny - wy * nx
            return across - p[6]
        g[0], g[1], g[2] = -tx, -ty, across - (ux * ty - uy * tx)
        g[3], g[4], g[5] = tx, ty, wx * ty - wy * tx
        return along - p[9] * q[int(p[10]), 0]
    if kind == 4 or kind == 6:
        h = p[6] if kind == 4 else p[9] * q[int(p[10]), 0]
        g[2], g[5] = -1.0, 1.0
        ch, sh = math.cos(h), math.sin(h)
        re, im = cb * ca + sb * sa, sb * ca - cb * sa
        return math.atan2(im * ch - re * sh, re * ch + im * sh)
    # gear: angles relative to the line of centres
    total = p[7] + p[9] * p[8]
    square = dx * dx + dy * dy
    nx, ny = -dy / square, dx / square
    slot = int(p[10])
    raw = math.atan2(dy, dx)
    here = raw + TAU * math.floor((phi[slot] - raw) / TAU + 0.5)
    scale = 1.0 / (p[7] + p[8])
    g[0], g[1], g[2] = scale * total * nx, scale * total * ny, scale * (p[7] + total * (ux * ny - uy * nx))
    g[3], g[4] = -scale * total * nx, -scale * total * ny
    g[5] = scale * (p[9] * p[8] - total * (wx * ny - wy * nx))
    return scale * (p[7] * (th[a] - here) + p[9] * p[8] * (th[b] - here - p[6]))


@njit(cache=True, error_model="numpy")
def gamma(kind, p, a, b, x, v, q):
    """Second-order part of a row: its second derivative along the velocities v, accelerations being zero."""
    if kind == 4:
        return 0.0
    if kind == 6:
        return -p[9] * q[int(p[10]), 2]
    ca, sa, cb, sb = x[a, 2], x[a, 3], x[b, 2], x[b, 3]
    ux, uy = ca * p[0] - sa * p[1], sa * p[0] + ca * p[1]
    wx, wy = cb * p[2] - sb * p[3], sb * p[2] + cb * p[3]
    oa, ob = v[a, 2], v[b, 2]
    cx, cy = oa * oa * ux - ob * ob * wx, oa * oa * uy - ob * ob * wy
    if kind == 0:
        return cx
    if kind == 1:
        return cy
    dx, dy = x[b, 0] + wx - x[a, 0] - ux, x[b, 1] + wy - x[a, 1] - uy
    ex, ey = v[b, 0] - ob * wy - v[a, 0] + oa * uy, v[b, 1] + ob * wx - v[a, 1] - oa * ux
    if kind == 2:
        return (ex * ex + ey * ey + dx * cx + dy * cy) / p[6]
    if kind == 3 or kind == 7:
        tx, ty = ca * p[4] - sa * p[5], sa * p[4] + ca * p[5]
        if kind == 3:
            return oa * oa * (ty * dx - tx * dy) - 2.0 * oa * (tx * ex + ty * ey) - ty * cx + tx * cy
        return (-oa * oa * (tx * dx + ty * dy) + 2.0 * oa * (tx * ey - ty * ex) + tx * cx + ty * cy
                - p[9] * q[int(p[10]), 2])  # fmt: skip
    square = dx * dx + dy * dy
    turn = (dx * cy - dy * cx) / square - 2.0 * (dx * ex + dy * ey) * (dx * ey - dy * ex) / (square * square)
    return -(p[7] + p[9] * p[8]) / (p[7] + p[8]) * turn


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
def assemble(rows, rp, r0, nr, x, th, phi, q, v, J, f, g, moving):
    """Jacobian by the core links, residuals, or (moving) the right-hand side of the velocities; returns prod |row|."""
    norms = 1.0
    n = nr
    for r in range(nr):
        k = r0 + r
        kind, a, b, ia, ib = rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3], rows[k, 4]
        f[r] = row(kind, rp[k], a, b, x, th, phi, q, g)
        if moving:
            f[r] = 0.0
            if kind >= 6:
                f[r] = rp[k, 9] * q[int(rp[k, 10]), 1]
        for c in range(n):
            J[r, c] = 0.0
        size = 0.0
        for c in range(3):
            if ia >= 0:
                J[r, 3 * ia + c] = g[c]
                size += g[c] * g[c] if c < 2 else 0.0
            elif moving:
                f[r] -= g[c] * v[a, c]
            if ib >= 0:
                J[r, 3 * ib + c] = g[3 + c]
                size += g[3 + c] * g[3 + c] if c < 2 else 0.0
            elif moving:
                f[r] -= g[3 + c] * v[b, c]
        norms *= max(1.0, math.sqrt(size))
    return norms


@njit(cache=True, error_model="numpy")
def follow_angle(link, x, th, near):
    """Unwrapped angle of a link, nearest to ``near``."""
    raw = math.atan2(x[link, 3], x[link, 2])
    th[link] = raw + TAU * math.floor((near - raw) / TAU + 0.5)


@njit(cache=True, error_model="numpy")
def newton(rows, rp, r0, nr, core, c0, nc, x, th, phi, q, v, J, f, g, pivots, Lc, out):
    """Newton from x; out = (first correction, last correction, rate); returns 0 if it converged."""
    last = 0.0
    out[2] = 0.0
    for it in range(30):
        assemble(rows, rp, r0, nr, x, th, phi, q, v, J, f, g, False)
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
            th[link] -= ft
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
def drive(step, d, p, x, th, v, w, q):
    """Place a driven link from the link it is driven on."""
    base, link, k = d[1], d[2], d[3]
    s = p[6]
    cb, sb = x[base, 2], x[base, 3]
    px, py = cb * p[0] - sb * p[1], sb * p[0] + cb * p[1]
    turn = p[7] + (s * q[k, 0] if step == 0 else 0.0)
    c, sn = math.cos(turn), math.sin(turn)
    th[link] = th[base] + turn
    x[link, 2], x[link, 3] = cb * c - sb * sn, sb * c + cb * sn
    ox, oy = x[link, 2] * p[4] - x[link, 3] * p[5], x[link, 3] * p[4] + x[link, 2] * p[5]
    o, al = v[base, 2], w[base, 2]
    tx, ty, rate, acc = 0.0, 0.0, 0.0, 0.0
    if step == 1:
        tx, ty = cb * p[2] - sb * p[3], sb * p[2] + cb * p[3]
        px, py = px + s * q[k, 0] * tx, py + s * q[k, 0] * ty
        rate, acc = s * q[k, 1], s * q[k, 2]
    x[link, 0], x[link, 1] = x[base, 0] + px - ox, x[base, 1] + py - oy
    ol, all_ = o, al
    if step == 0:
        ol, all_ = o + s * q[k, 1], al + s * q[k, 2]
    v[link, 0] = v[base, 0] - o * py + rate * tx + ol * oy
    v[link, 1] = v[base, 1] + o * px + rate * ty - ol * ox
    v[link, 2] = ol
    w[link, 0] = w[base, 0] - al * py - o * o * px + acc * tx - 2.0 * o * rate * ty + all_ * oy + ol * ol * ox
    w[link, 1] = w[base, 1] + al * px - o * o * py + acc * ty + 2.0 * o * rate * tx - all_ * ox + ol * ol * oy
    w[link, 2] = all_


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
def orient(rows, rp, k, x, th, own):
    """Orient link ``own`` by the ANGLE row k."""
    a, b, h = rows[k, 1], rows[k, 2], rp[k, 6]
    other, sign = (a, 1.0) if own == b else (b, -1.0)
    c, s = math.cos(h), sign * math.sin(h)
    x[own, 2], x[own, 3] = x[other, 2] * c - x[other, 3] * s, x[other, 3] * c + x[other, 2] * s
    th[own] = th[other] + sign * h


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
    """Vector from A to C with |AC| = l1, |BC| = l2, B - A = (dx, dy); returns sin^2 of the angle at C, negative if open."""
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
def closed_form(code, rows, rp, r0, own, sign, x, th, phi, g):
    """Place the one core link of a group; returns its margin, negative where it cannot be assembled."""
    if code == 7 or code == 8:  # a sliding pair orients the link: rows LINE, ANGLE, then DIST or LINE
        orient(rows, rp, r0 + 1, x, th, own)
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
        orient(rows, rp, k, x, th, own)
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
            th[own] = here - rb * (th[other] - here - rp[k, 6]) / ra
        else:
            th[own] = here + rp[k, 6] - ra * (th[other] - here) / rb
        x[own, 2], x[own, 3] = math.cos(th[own]), math.sin(th[own])
    pin_to(x, own, hx, hy, ax, ay)
    return margin


@njit(cache=True, error_model="numpy")
def place_eliminated(kind, e, a, b, p, x, th, v, w, derivs):
    """Place a link eliminated from its group, with velocity and acceleration."""
    ax, ay = world(x, a, p[0], p[1])
    bx, by = world(x, b, p[4], p[5])
    if kind == 0:
        turn_to(x, e, p[6] - p[2], p[7] - p[3], bx - ax, by - ay)
        pin_to(x, e, p[2], p[3], ax, ay)
    else:
        base = b if kind == 1 else a
        c, s = math.cos(p[12]), math.sin(p[12])
        x[e, 2], x[e, 3] = x[base, 2] * c - x[base, 3] * s, x[base, 3] * c + x[base, 2] * s
        th[e] = th[base] + p[12]
        if kind == 1:
            pin_to(x, e, p[2], p[3], ax, ay)
    oa, ob, la, lb = v[a, 2], v[b, 2], w[a, 2], w[b, 2]
    ux, uy, wx, wy = ax - x[a, 0], ay - x[a, 1], bx - x[b, 0], by - x[b, 1]
    vax, vay, vbx, vby = v[a, 0] - oa * uy, v[a, 1] + oa * ux, v[b, 0] - ob * wy, v[b, 1] + ob * wx
    aax, aay = w[a, 0] - la * uy - oa * oa * ux, w[a, 1] + la * ux - oa * oa * uy
    abx, aby = w[b, 0] - lb * wy - ob * ob * wx, w[b, 1] + lb * wx - ob * ob * wy
    c, s = x[e, 2], x[e, 3]
    fx, fy = c * p[2] - s * p[3], s * p[2] + c * p[3]
    if kind < 2:
        if not derivs:
            return
        o, l = ob, lb
        if kind == 0:
            dx, dy = bx - ax, by - ay
            dd = dx * dx + dy * dy
            o = (dx * (vby - vay) - dy * (vbx - vax)) / dd
            l = (dx * (aby - aay) - dy * (abx - aax)) / dd
        v[e, 0], v[e, 1], v[e, 2] = vax + o * fy, vay - o * fx, o
        w[e, 0], w[e, 1], w[e, 2] = aax + l * fy + o * o * fx, aay - l * fx + o * o * fy, l
        return
    # two sliding pairs: the origin lies on two lines of known directions
    hx, hy = c * p[6] - s * p[7], s * p[6] + c * p[7]
    tx, ty = x[a, 2] * p[8] - x[a, 3] * p[9], x[a, 3] * p[8] + x[a, 2] * p[9]
    sx, sy = x[b, 2] * p[10] - x[b, 3] * p[11], x[b, 3] * p[10] + x[b, 2] * p[11]
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
    v[e, 0], v[e, 1], v[e, 2] = (k1 * sx - k2 * tx) / det, (k1 * sy - k2 * ty) / det, o
    p1x, p1y = v[e, 0] - o * fy - vax, v[e, 1] + o * fx - vay
    p2x, p2y = v[e, 0] - o * hy - vbx, v[e, 1] + o * hx - vby
    # n'' = -alpha t - omega^2 n, and n . X = 0
    k1 = (-ty * (aax + l * fy + o * o * fx) + tx * (aay - l * fx + o * o * fy)
          + 2.0 * o * (tx * p1x + ty * p1y) + l * (tx * X1 + ty * Y1))  # fmt: skip
    k2 = (-sy * (abx + l * hy + o * o * hx) + sx * (aby - l * hx + o * o * hy)
          + 2.0 * o * (sx * p2x + sy * p2y) + l * (sx * X2 + sy * Y2))  # fmt: skip
    w[e, 0], w[e, 1], w[e, 2] = (k1 * sx - k2 * tx) / det, (k1 * sy - k2 * ty) / det, l


@njit(cache=True, error_model="numpy")
def rates(rows, rp, r0, nr, core, c0, nc, x, th, phi, q, v, w, J, f, g, pivots):
    """Velocities and accelerations of the core links; returns the determinant over the product of row lengths."""
    norms = assemble(rows, rp, r0, nr, x, th, phi, q, v, J, f, g, True)
    det = factor(J, nr, pivots)
    if det == 0.0:
        for k in range(nc):
            for c in range(3):
                v[core[c0 + k], c] = math.nan
                w[core[c0 + k], c] = math.nan
        return 0.0
    back(J, nr, pivots, f)
    for k in range(nc):
        for c in range(3):
            v[core[c0 + k], c] = f[3 * k + c]
    for r in range(nr):
        k = r0 + r
        kind, a, b = rows[k, 0], rows[k, 1], rows[k, 2]
        total = -gamma(kind, rp[k], a, b, x, v, q)
        if rows[k, 3] < 0 or rows[k, 4] < 0:
            row(kind, rp[k], a, b, x, th, phi, q, g)
            for c in range(3):
                if rows[k, 3] < 0:
                    total -= g[c] * w[a, c]
                if rows[k, 4] < 0:
                    total -= g[3 + c] * w[b, c]
        f[r] = total
    back(J, nr, pivots, f)
    for k in range(nc):
        for c in range(3):
            w[core[c0 + k], c] = f[3 * k + c]
    return det / norms


@njit(cache=True, error_model="numpy")
def track_group(rows, rp, r0, nr, core, c0, nc, x, th, px, pth, pv, pw, before, h, warm, phi, q, v, J, f, g, pivots,
                Lc, out):  # fmt: skip
    """Newton for a group: predictor from the last sample (warm), corrector, and the tests against a jump."""
    travel = 0.0
    if warm:
        for k in range(nc):
            link = core[c0 + k]
            ax, ay = h * pv[link, 0], h * pv[link, 1]
            at = h * pv[link, 2]
            bx, by = 0.5 * h * h * pw[link, 0], 0.5 * h * h * pw[link, 1]
            bt = 0.5 * h * h * pw[link, 2]
            travel += ax * ax + ay * ay + Lc * Lc * at * at + bx * bx + by * by + Lc * Lc * bt * bt
            x[link, 0], x[link, 1], th[link] = px[link, 0] + ax + bx, px[link, 1] + ay + by, pth[link] + at + bt
            c, s = math.cos(at + bt), math.sin(at + bt)
            x[link, 2], x[link, 3] = px[link, 2] * c - px[link, 3] * s, px[link, 3] * c + px[link, 2] * s
        travel = math.sqrt(travel) / Lc
        if not travel <= 0.5:
            return 2
    code = newton(rows, rp, r0, nr, core, c0, nc, x, th, phi, q, v, J, f, g, pivots, Lc, out)
    if code:
        return code
    if warm and (out[0] > 0.1 * travel + 1e-9 or out[2] > 0.1):
        return 2
    return 0


@njit(cache=True, error_model="numpy")
def run(steps, rows, rp, core, elim, ep, drv, dp, need, gears, q, u, modes, X, TH, V, W, PHI, M, first, Lc, derivs):
    """Run a program over the samples first..n-1; returns (samples done, code, step).

    Sample ``first`` starts from ``first - 1`` if there is one; else cold, from the poses already in X[0], TH[0].
    """
    L = X.shape[1]
    size = 3
    for s in range(steps.shape[0]):
        size = max(size, steps[s, 2])
    J, f, g, out = np.empty((size, size)), np.empty(size), np.empty(6), np.zeros(3)
    pivots = np.empty(size, np.int64)
    for i in range(first, u.shape[0]):
        x, th, v, w, phi, qi = X[i], TH[i], V[i], W[i], PHI[i], q[i]
        warm = i > 0
        j = i - 1 if warm else i
        h = u[i] - u[j]
        for k in range(gears.shape[0]):
            phi[k] = PHI[j, k]
        for s in range(steps.shape[0]):
            code, r0, nr, c0, nc = steps[s, 0], steps[s, 1], steps[s, 2], steps[s, 3], steps[s, 4]
            if code < 2:
                drive(code, drv[r0], dp[r0], x, th, v, w, qi)
                M[i, s] = 1.0
                if not math.isfinite(qi[drv[r0, 3], 0]):
                    return i, 5, s
                continue
            own = core[c0]
            if code == 9:
                why = track_group(rows, rp, r0, nr, core, c0, nc, x, th, X[j], TH[j], V[j], W[j], M[j, s], h, warm,
                                  phi, qi, v, J, f, g, pivots, Lc, out)  # fmt: skip
                if why:
                    return i, why, s
            else:
                M[i, s] = closed_form(code, rows, rp, r0, own, modes[s], x, th, phi, g)
                if code == 8:  # one mode; its determinant keeps its sign
                    if M[i, s] == 0.0 or (warm and not M[i, s] * M[j, s] > 0.0):
                        return i, 1, s
                elif M[i, s] < 0.0:
                    return i, 1, s
                if not math.isfinite(M[i, s]):
                    return i, 3, s
                if need[own] and code != 6:
                    follow_angle(own, x, th, TH[j, own] + (h * V[j, own, 2] if warm and derivs else 0.0))
            if derivs or code == 9:
                det = rates(rows, rp, r0, nr, core, c0, nc, x, th, phi, qi, v, w, J, f, g, pivots)
                if code == 9:
                    M[i, s] = det / Lc**nc
                    if warm and not (M[i, s] * M[j, s] > 0.0 and abs(M[i, s]) > 0.5 * abs(M[j, s])):
                        return i, 2, s
                    if M[i, s] == 0.0:
                        return i, 4, s
            for k in range(steps[s, 5], steps[s, 5] + steps[s, 6]):
                e = elim[k, 1]
                place_eliminated(elim[k, 0], e, elim[k, 2], elim[k, 3], ep[k], x, th, v, w, derivs)
                if need[e]:
                    follow_angle(e, x, th, TH[j, e] + (h * V[j, e, 2] if warm and derivs else 0.0))
        for k in range(gears.shape[0]):
            r = gears[k]
            ax, ay = world(x, rows[r, 1], rp[r, 0], rp[r, 1])
            bx, by = world(x, rows[r, 2], rp[r, 2], rp[r, 3])
            raw = math.atan2(by - ay, bx - ax)
            phi[k] = raw + TAU * math.floor((phi[k] - raw) / TAU + 0.5)
    return u.shape[0], 0, -1
