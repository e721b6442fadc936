"""Values, gradients and second-order parts of the constraint rows; points carried by links."""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.kinematics.engine.codes import (
    ANGLE,
    CAM,
    CAM_WIDTH,
    DIST,
    DRIVE_ANGLE,
    DRIVE_SLIDE,
    INVERSE,
    LINE,
    PAX,
    PAY,
    PBX,
    PBY,
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
    raw = math.atan2(x[link, 3], x[link, 2])
    x[link, 4] = nearest_turn(raw, near)


@kernel
def pitch(p, k, psi):
    """Pitch radius of a cam and its first two derivatives by psi."""
    value, first, second = p[k, H], 0.0, 0.0
    c1, s1 = math.cos(psi), math.sin(psi)
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
        ch, sh = math.cos(h), math.sin(h)
        re, im = cb * ca + sb * sa, sb * ca - cb * sa
        return math.atan2(im * ch - re * sh, re * ch + im * sh)
    if kind == CAM:
        square = dx * dx + dy * dy
        far = math.sqrt(square)
        rho, first, _ = pitch(p, k, math.atan2(dy, dx) - math.atan2(sa, ca) - p[k, RA])
        ex, ey = dx / far + first * dy / square, dy / far - first * dx / square
        g[0], g[1], g[2] = -ex, -ey, first - (ux * ey - uy * ex)
        g[3], g[4], g[5] = ex, ey, wx * ey - wy * ex
        return far - rho
    # gear: angles relative to the line of centres
    total = p[k, RA] + p[k, SIGN] * p[k, RB]
    square = dx * dx + dy * dy
    nx, ny = -dy / square, dx / square
    slot = int(p[k, SLOT])
    raw = math.atan2(dy, dx)
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
        _, first, second = pitch(p, k, math.atan2(dy, dx) - math.atan2(sa, ca) - p[k, RA])
        far, along, across = math.sqrt(square), dx * ex + dy * ey, dx * ey - dy * ex
        rate = across / square - oa
        curved = (dx * cy - dy * cx) / square - 2.0 * along * across / (square * square)
        straight = (ex * ex + ey * ey + dx * cx + dy * cy) / far - along * along / (square * far)
        return straight - second * rate * rate - first * curved
    turn = (dx * cy - dy * cx) / square - 2.0 * (dx * ex + dy * ey) * (dx * ey - dy * ex) / (square * square)
    return -(p[k, RA] + p[k, SIGN] * p[k, RB]) / (p[k, RA] + p[k, RB]) * turn
