"""One link placed in closed form at one sample: the rarer dyads, eliminated links, their rates."""

import math

from graphsynth.core.compilation import kernel
from graphsynth.kinematics.engine.codes import (
    E_RP,
    P_DIST,
    P_LINE,
    PARALLEL,
    PAX,
    PAY,
    PBX,
    PBY,
    R_ANGLE,
    R_LINE_PIN,
    R_LINE_SLOT,
    RA,
    RB,
    SIGN,
    SLOT,
    TX,
    TY,
    H,
)
from graphsynth.kinematics.engine.kernels.rows import cross, ends, far_point, gamma, nearest_turn, row, world


@kernel
def turn_to(x, link, lx, ly, wx, wy):
    """Orient a link so that its local vector (lx, ly) points along (wx, wy)."""
    re, im = lx * wx + ly * wy, lx * wy - ly * wx
    size = math.sqrt(re * re + im * im)
    x[link, 2], x[link, 3] = re / size, im / size


@kernel
def pin_to(x, link, lx, ly, wx, wy):
    """Move an oriented link so that its local point lies at (wx, wy)."""
    c, s = x[link, 2], x[link, 3]
    x[link, 0], x[link, 1] = wx - (c * lx - s * ly), wy - (s * lx + c * ly)


@kernel
def pin_to_neighbour(rows, rp, k, own, x):
    """Move an oriented link to the revolute joint of rows k and k + 1; returns that point and its local one."""
    ax, ay, hx, hy = far_point(rows, rp, k, own, x)
    pin_to(x, own, hx, hy, ax, ay)
    return ax, ay, hx, hy


@kernel
def orient(rows, rp, k, x, own):
    """Orient link ``own`` by the ANGLE row k."""
    a, b, h = rows[k, 1], rows[k, 2], rp[k, H]
    other, sign = (a, 1.0) if own == b else (b, -1.0)
    c, s = math.cos(h), sign * math.sin(h)
    x[own, 2], x[own, 3] = x[other, 2] * c - x[other, 3] * s, x[other, 3] * c + x[other, 2] * s
    x[own, 4] = x[other, 4] + sign * h


@kernel
def line_of(rows, rp, k, x, own):
    """For an oriented link ``own`` in a LINE row: direction t and the value kappa of n . r_own."""
    a, b = rows[k, 1], rows[k, 2]
    c, s = x[a, 2], x[a, 3]
    tx, ty = c * rp[k, TX] - s * rp[k, TY], s * rp[k, TX] + c * rp[k, TY]
    if own == b:
        px, py = world(x, a, rp[k, PAX], rp[k, PAY])
        ox, oy = x[b, 2] * rp[k, PBX] - x[b, 3] * rp[k, PBY], x[b, 3] * rp[k, PBX] + x[b, 2] * rp[k, PBY]
        return tx, ty, rp[k, H] - ty * (px - ox) + tx * (py - oy)
    px, py = world(x, b, rp[k, PBX], rp[k, PBY])
    ox, oy = c * rp[k, PAX] - s * rp[k, PAY], s * rp[k, PAX] + c * rp[k, PAY]
    return tx, ty, -ty * (px - ox) + tx * (py - oy) - rp[k, H]


@kernel
def closed_form(code, group, sign, x, phi):
    """Place the one core link of a group; returns its margin, negative where it cannot be assembled."""
    if code in (P_DIST, P_LINE):
        return slid_form(code, group, sign, x)
    return turned_form(code, group, sign, x, phi)


@kernel
def slid_form(code, group, sign, x):
    """Place a link that a prismatic joint orients: rows LINE, ANGLE, then DIST or LINE."""
    rows, rp, r0, own = group.rows, group.rp, group.r0, group.core[group.c0]
    orient(rows, rp, r0 + 1, x, own)
    tx, ty, kappa = line_of(rows, rp, r0, x, own)
    k = r0 + 2
    if code == P_LINE:
        sx, sy, other = line_of(rows, rp, k, x, own)
        det = cross(tx, ty, sx, sy)
        if abs(det) <= PARALLEL:
            return 0.0
        x[own, 0], x[own, 1] = (kappa * sx - other * tx) / det, (kappa * sy - other * ty) / det
        return det
    # the circle about the point of the placed link meets the line
    l = rp[k, H]
    bx, by, lx, ly = far_point(rows, rp, k, own, x)
    ox, oy = x[own, 2] * lx - x[own, 3] * ly, x[own, 3] * lx + x[own, 2] * ly
    e = kappa - ty * (ox - bx) + tx * (oy - by)
    margin = (l - e) * (l + e) / (l * l)
    if margin < 0.0:
        return margin
    along = sign * math.sqrt((l - e) * (l + e))
    pin_to(x, own, lx, ly, bx - e * ty + along * tx, by + e * tx + along * ty)
    return margin


@kernel
def turned_form(code, group, sign, x, phi):
    """Place a link that a revolute joint holds at the point A: rows RX, RY, then one more."""
    rows, rp, own, k = group.rows, group.rp, group.core[group.c0], group.r0 + 2
    ax, ay, hx, hy = pin_to_neighbour(rows, rp, group.r0, own, x)
    margin = 1.0
    a, b = rows[k, 1], rows[k, 2]
    far, fx, fy, lx, ly = ends(rows, rp, k, own)
    lx, ly = lx - hx, ly - hy
    if code == R_LINE_PIN:  # the pin of this link runs on a line
        px, py = world(x, a, rp[k, PAX], rp[k, PAY])
        c, s = x[a, 2], x[a, 3]
        tx, ty = c * rp[k, TX] - s * rp[k, TY], s * rp[k, TX] + c * rp[k, TY]
        e = -ty * (px - ax) + tx * (py - ay) + rp[k, H]
        square = lx * lx + ly * ly
        l = math.sqrt(square)
        margin = (l - e) * (l + e) / square
        if margin < 0.0:
            return margin
        along = sign * math.sqrt((l - e) * (l + e))
        turn_to(x, own, lx, ly, -e * ty + along * tx, e * tx + along * ty)
    elif code == R_LINE_SLOT:  # a pin runs on the line of this link
        bx, by = world(x, b, rp[k, PBX], rp[k, PBY])
        dx, dy = bx - ax, by - ay
        dd = dx * dx + dy * dy
        d = math.sqrt(dd)
        tx, ty = rp[k, TX], rp[k, TY]
        e = -ty * lx + tx * ly + rp[k, H]
        if dd == 0.0:
            return -5e-324
        margin = (d - e) * (d + e) / dd
        if margin < 0.0:
            return margin
        along = sign * math.sqrt((d - e) * (d + e))
        turn_to(x, own, along * tx - e * ty, along * ty + e * tx, dx, dy)
    elif code == R_ANGLE:
        orient(rows, rp, k, x, own)
    else:  # gear with its centre on the revolute joint
        ox, oy = world(x, far, fx, fy)
        dx, dy = (ox - ax, oy - ay) if own == a else (ax - ox, ay - oy)
        if dx == 0.0 and dy == 0.0:  # no line of centres
            return -5e-324
        here = nearest_turn(math.atan2(dy, dx), phi[int(rp[k, SLOT])])
        ra, rb = rp[k, RA], rp[k, SIGN] * rp[k, RB]
        if own == a:
            x[own, 4] = here - rb * (x[far, 4] - here - rp[k, H]) / ra
        else:
            x[own, 4] = here + rp[k, H] - ra * (x[far, 4] - here) / rb
        x[own, 2], x[own, 3] = math.cos(x[own, 4]), math.sin(x[own, 4])
    pin_to(x, own, hx, hy, ax, ay)
    return margin


@kernel
def place_eliminated(kind, e, a, b, p, r, x, derivs):
    """Place an eliminated link that slides on at least one of its two neighbours, with velocity and acceleration."""
    ax, ay = world(x, a, p[r, 0], p[r, 1])
    bx, by = world(x, b, p[r, 4], p[r, 5])
    base = b if kind == E_RP else a
    c, s = math.cos(p[r, 12]), math.sin(p[r, 12])
    x[e, 2], x[e, 3] = x[base, 2] * c - x[base, 3] * s, x[base, 3] * c + x[base, 2] * s
    x[e, 4] = x[base, 4] + p[r, 12]
    if kind == E_RP:
        pin_to(x, e, p[r, 2], p[r, 3], ax, ay)
    oa, ob, la, lb = x[a, 7], x[b, 7], x[a, 10], x[b, 10]
    ux, uy, wx, wy = ax - x[a, 0], ay - x[a, 1], bx - x[b, 0], by - x[b, 1]
    vax, vay, vbx, vby = x[a, 5] - oa * uy, x[a, 6] + oa * ux, x[b, 5] - ob * wy, x[b, 6] + ob * wx
    aax, aay = x[a, 8] - la * uy - oa * oa * ux, x[a, 9] + la * ux - oa * oa * uy
    abx, aby = x[b, 8] - lb * wy - ob * ob * wx, x[b, 9] + lb * wx - ob * ob * wy
    c, s = x[e, 2], x[e, 3]
    fx, fy = c * p[r, 2] - s * p[r, 3], s * p[r, 2] + c * p[r, 3]
    if kind == E_RP:
        if not derivs:
            return
        o, l = ob, lb
        x[e, 5], x[e, 6], x[e, 7] = vax + o * fy, vay - o * fx, o
        x[e, 8], x[e, 9], x[e, 10] = aax + l * fy + o * o * fx, aay - l * fx + o * o * fy, l
        return
    # two prismatic joints: the origin lies on two lines of known directions
    hx, hy = c * p[r, 6] - s * p[r, 7], s * p[r, 6] + c * p[r, 7]
    tx, ty = x[a, 2] * p[r, 8] - x[a, 3] * p[r, 9], x[a, 3] * p[r, 8] + x[a, 2] * p[r, 9]
    sx, sy = x[b, 2] * p[r, 10] - x[b, 3] * p[r, 11], x[b, 3] * p[r, 10] + x[b, 2] * p[r, 11]
    det = cross(tx, ty, sx, sy)
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
    k1 = -ty * (aax + l * fy + o * o * fx) + tx * (aay - l * fx + o * o * fy)
    k1 = k1 + 2.0 * o * (tx * p1x + ty * p1y) + l * (tx * X1 + ty * Y1)
    k2 = -sy * (abx + l * hy + o * o * hx) + sx * (aby - l * hx + o * o * hy)
    k2 = k2 + 2.0 * o * (sx * p2x + sy * p2y) + l * (sx * X2 + sy * Y2)
    x[e, 8], x[e, 9], x[e, 10] = (k1 * sx - k2 * tx) / det, (k1 * sy - k2 * ty) / det, l


@kernel
def pivot_rates(group, x, phi, q, g):
    """Rates of a link that turns about a point of a placed link: one unknown, from the third row."""
    rows, rp, own, k = group.rows, group.rp, group.core[group.c0], group.r0 + 2
    far, ax, ay, _, _ = ends(rows, rp, group.r0, own)
    ax, ay = world(x, far, ax, ay)
    ux, uy = ax - x[far, 0], ay - x[far, 1]
    o, l = x[far, 7], x[far, 10]
    vx, vy = x[far, 5] - o * uy, x[far, 6] + o * ux
    bx, by = x[far, 8] - l * uy - o * o * ux, x[far, 9] + l * ux - o * o * uy
    px, py = x[own, 0] - ax, x[own, 1] - ay
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
