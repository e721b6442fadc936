"""One sample: values, gradients and second-order parts of the constraint rows; links placed in closed form."""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels.nearest import atan2, cos, sin
from graphsynth.kinematics.engine.codes import (
    ANGLE,
    CAM,
    CAM_WIDTH,
    DIST,
    DRIVE_ANGLE,
    DRIVE_SLIDE,
    E_RP,
    INVERSE,
    LINE,
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
    RX,
    RY,
    SIGN,
    SLOT,
    TX,
    TY,
    H,
)

TAU = 2.0 * math.pi


@kernel
def world(x, link, px, py):
    """World point of a local one."""
    c, s = x[link, 2], x[link, 3]
    return x[link, 0] + c * px - s * py, x[link, 1] + s * px + c * py


@kernel
def ends(rows, rp, k, own):
    """Of a row: the link that is not ``own`` and its point, and the point of ``own``."""
    if rows[k, 1] == own:
        return rows[k, 2], rp[k, PBX], rp[k, PBY], rp[k, PAX], rp[k, PAY]
    return rows[k, 1], rp[k, PAX], rp[k, PAY], rp[k, PBX], rp[k, PBY]


@kernel
def far_point(rows, rp, k, own, x):
    """Of a row: where the point of the placed link lies, and the local point of ``own``."""
    far, fx, fy, hx, hy = ends(rows, rp, k, own)
    px, py = world(x, far, fx, fy)
    return px, py, hx, hy


@kernel(inline="always")
def upper_half(a):
    """Return the upper 26 bits of a number [Veltkamp 1968]: products of such halves are exact."""
    big = 134217729.0 * a
    return big - (big - a)


@kernel
def cross(ax, ay, bx, by):
    """Return ax by - ay bx, right to its last digits also where the vectors are nearly parallel.

    Both products are exact sums of two numbers [Dekker 1971], so that only the difference is rounded.
    """
    p, q = ax * by, ay * bx
    a, b, c, d = upper_half(ax), upper_half(by), upper_half(ay), upper_half(bx)
    dp = ((a * b - p) + a * (by - b) + (ax - a) * b) + (ax - a) * (by - b)
    dq = ((c * d - q) + c * (bx - d) + (ay - c) * d) + (ay - c) * (bx - d)
    return (p - q) + (dp - dq)


@kernel
def nearest_turn(raw, near):
    """Angle that differs from ``raw`` by whole turns and lies nearest to ``near``, for angles of any size.

    ``math.floor`` would give a 64-bit integer here, which wraps round from 5.8e19 rad on.
    """
    return raw + TAU * np.floor((near - raw) / TAU + 0.5)


@kernel
def follow_angle(link, x, near):
    """Unwrapped angle of a link, nearest to ``near``."""
    raw = atan2(x[link, 3], x[link, 2])
    x[link, 4] = nearest_turn(raw, near)


@kernel
def pitch(p, k, psi):
    """Pitch radius of a cam and its first two derivatives by psi."""
    value, first, second = p[k, H], 0.0, 0.0
    c1, s1 = cos(psi), sin(psi)
    c, s, order = c1, s1, 1.0
    for column in range(CAM_WIDTH, p.shape[1] - 1, 2):
        even, odd = p[k, column] * c + p[k, column + 1] * s, p[k, column + 1] * c - p[k, column] * s
        value += even
        first += order * odd
        second -= order * order * even
        c, s, order = c * c1 - s * s1, s * c1 + c * s1, order + 1.0
    return value, first, second


@kernel
def row(kind, p, k, a, b, x, phi, q, g):
    """Value of one constraint row; its gradient by (x, y, theta) of a and of b goes to g[0:6]."""
    ca, sa, cb, sb = x[a, 2], x[a, 3], x[b, 2], x[b, 3]
    ux, uy = ca * p[k, PAX] - sa * p[k, PAY], sa * p[k, PAX] + ca * p[k, PAY]
    wx, wy = cb * p[k, PBX] - sb * p[k, PBY], sb * p[k, PBX] + cb * p[k, PBY]
    dx, dy = x[b, 0] + wx - x[a, 0] - ux, x[b, 1] + wy - x[a, 1] - uy
    for c in range(6):
        g[c] = 0.0
    # both components of Q - P
    if kind == RX:
        g[0], g[2], g[3], g[5] = -1.0, uy, 1.0, -wy
        return dx
    if kind == RY:
        g[1], g[2], g[4], g[5] = -1.0, -ux, 1.0, wx
        return dy
    if kind == DIST:  # (|d|^2 / h - h) / 2: linear in |d| where it is h
        h = p[k, H]
        ex, ey = dx * p[k, INVERSE], dy * p[k, INVERSE]
        g[0], g[1], g[2] = -ex, -ey, -(ux * ey - uy * ex)
        g[3], g[4], g[5] = ex, ey, wx * ey - wy * ex
        return 0.5 * (dx * ex + dy * ey - h)
    if kind in (LINE, DRIVE_SLIDE):
        tx, ty = ca * p[k, TX] - sa * p[k, TY], sa * p[k, TX] + ca * p[k, TY]
        nx, ny = -ty, tx
        along = tx * dx + ty * dy
        across = nx * dx + ny * dy
        if kind == LINE:
            g[0], g[1], g[2] = -nx, -ny, -along - (ux * ny - uy * nx)
            g[3], g[4], g[5] = nx, ny, wx * ny - wy * nx
            return across - p[k, H]
        g[0], g[1], g[2] = -tx, -ty, across - (ux * ty - uy * tx)
        g[3], g[4], g[5] = tx, ty, wx * ty - wy * tx
        return along - p[k, SIGN] * q[int(p[k, SLOT]), 0]
    if kind in (ANGLE, DRIVE_ANGLE):  # from cosines and sines: no turns are counted
        h = p[k, H] if kind == ANGLE else p[k, SIGN] * q[int(p[k, SLOT]), 0]
        g[2], g[5] = -1.0, 1.0
        ch, sh = cos(h), sin(h)
        re, im = cb * ca + sb * sa, sb * ca - cb * sa
        return atan2(im * ch - re * sh, re * ch + im * sh)
    if kind == CAM:
        square = dx * dx + dy * dy
        far = math.sqrt(square)
        rho, first, _ = pitch(p, k, atan2(dy, dx) - atan2(sa, ca) - p[k, RA])
        ex, ey = dx / far + first * dy / square, dy / far - first * dx / square
        g[0], g[1], g[2] = -ex, -ey, first - (ux * ey - uy * ex)
        g[3], g[4], g[5] = ex, ey, wx * ey - wy * ex
        return far - rho
    # gear: angles relative to the line of centres
    total = p[k, RA] + p[k, SIGN] * p[k, RB]
    square = dx * dx + dy * dy
    nx, ny = -dy / square, dx / square
    slot = int(p[k, SLOT])
    raw = atan2(dy, dx)
    here = nearest_turn(raw, phi[slot])
    scale = 1.0 / (p[k, RA] + p[k, RB])
    g[0], g[1], g[2] = scale * total * nx, scale * total * ny, scale * (p[k, RA] + total * (ux * ny - uy * nx))
    g[3], g[4] = -scale * total * nx, -scale * total * ny
    g[5] = scale * (p[k, SIGN] * p[k, RB] - total * (wx * ny - wy * nx))
    return scale * (p[k, RA] * (x[a, 4] - here) + p[k, SIGN] * p[k, RB] * (x[b, 4] - here - p[k, H]))


@kernel
def gamma(kind, p, k, a, b, x, q):
    """Second-order part of a row: its second derivative along the velocities, accelerations being zero."""
    if kind == ANGLE:
        return 0.0
    if kind == DRIVE_ANGLE:
        return -p[k, SIGN] * q[int(p[k, SLOT]), 2]
    ca, sa, cb, sb = x[a, 2], x[a, 3], x[b, 2], x[b, 3]
    ux, uy = ca * p[k, PAX] - sa * p[k, PAY], sa * p[k, PAX] + ca * p[k, PAY]
    wx, wy = cb * p[k, PBX] - sb * p[k, PBY], sb * p[k, PBX] + cb * p[k, PBY]
    oa, ob = x[a, 7], x[b, 7]
    cx, cy = oa * oa * ux - ob * ob * wx, oa * oa * uy - ob * ob * wy
    if kind == RX:
        return cx
    if kind == RY:
        return cy
    dx, dy = x[b, 0] + wx - x[a, 0] - ux, x[b, 1] + wy - x[a, 1] - uy
    ex, ey = x[b, 5] - ob * wy - x[a, 5] + oa * uy, x[b, 6] + ob * wx - x[a, 6] - oa * ux
    if kind == DIST:
        return (ex * ex + ey * ey + dx * cx + dy * cy) * p[k, INVERSE]
    if kind in (LINE, DRIVE_SLIDE):
        tx, ty = ca * p[k, TX] - sa * p[k, TY], sa * p[k, TX] + ca * p[k, TY]
        if kind == LINE:
            return oa * oa * (ty * dx - tx * dy) - 2.0 * oa * (tx * ex + ty * ey) - ty * cx + tx * cy
        along = -oa * oa * (tx * dx + ty * dy) + 2.0 * oa * (tx * ey - ty * ex) + tx * cx + ty * cy
        return along - p[k, SIGN] * q[int(p[k, SLOT]), 2]
    square = dx * dx + dy * dy
    if kind == CAM:
        _, first, second = pitch(p, k, atan2(dy, dx) - atan2(sa, ca) - p[k, RA])
        far, along, across = math.sqrt(square), dx * ex + dy * ey, dx * ey - dy * ex
        rate = across / square - oa
        curved = (dx * cy - dy * cx) / square - 2.0 * along * across / (square * square)
        straight = (ex * ex + ey * ey + dx * cx + dy * cy) / far - along * along / (square * far)
        return straight - second * rate * rate - first * curved
    turn = (dx * cy - dy * cx) / square - 2.0 * (dx * ex + dy * ey) * (dx * ey - dy * ex) / (square * square)
    return -(p[k, RA] + p[k, SIGN] * p[k, RB]) / (p[k, RA] + p[k, RB]) * turn


# --- the rarer dyads and eliminated links in closed form, and their rates


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
    c, s = cos(h), sign * sin(h)
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
def slid_form(code, group, sign, x):
    """Place a link that a prismatic joint orients: rows LINE, ANGLE, then DIST or LINE; returns its margin."""
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
    """Place a link that a revolute joint holds at the point A: rows RX, RY, then one more; returns its margin."""
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
        here = nearest_turn(atan2(dy, dx), phi[int(rp[k, SLOT])])
        ra, rb = rp[k, RA], rp[k, SIGN] * rp[k, RB]
        if own == a:
            x[own, 4] = here - rb * (x[far, 4] - here - rp[k, H]) / ra
        else:
            x[own, 4] = here + rp[k, H] - ra * (x[far, 4] - here) / rb
        x[own, 2], x[own, 3] = cos(x[own, 4]), sin(x[own, 4])
    pin_to(x, own, hx, hy, ax, ay)
    return margin


@kernel
def place_eliminated(kind, e, a, b, p, r, x, derivs):
    """Place an eliminated link that slides on at least one of its two neighbours, with velocity and acceleration."""
    ax, ay = world(x, a, p[r, 0], p[r, 1])
    bx, by = world(x, b, p[r, 4], p[r, 5])
    base = b if kind == E_RP else a
    c, s = cos(p[r, 12]), sin(p[r, 12])
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
