"""Steps in closed form over a range of samples: drivers, RRR dyads, links between two revolute joints.

Inner loops run over samples that lie side by side in memory and do not branch, so the compiler may use vector
instructions.  ``X[link]`` has the rows x, y, cos theta, sin theta; ``V`` and ``W`` the rows of (x, y, theta).
"""

import math

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels.nearest import cos, sin
from graphsynth.kinematics.engine.codes import DRIVE_R, H
from graphsynth.kinematics.engine.kernels.rows import ends


@kernel
def carried(state, link, ax, ay, T, k, i0, i1, derivs):
    """Path of a point of a placed link, to two rows of T from k on; velocity and acceleration to four from 4 + 2 k."""
    L, px, py = state.X[link], T[k], T[k + 1]
    x, y, c, s = L[0], L[1], L[2], L[3]
    for i in range(i0, i1):
        px[i] = x[i] + c[i] * ax - s[i] * ay
        py[i] = y[i] + s[i] * ax + c[i] * ay
    if derivs:
        V, W, r = state.V[link], state.W[link], 4 + 2 * k
        v0, v1, o, w0, w1, al = V[0], V[1], V[2], W[0], W[1], W[2]
        vx, vy, wx, wy = T[r], T[r + 1], T[r + 2], T[r + 3]
        for i in range(i0, i1):
            ux, uy = c[i] * ax - s[i] * ay, s[i] * ax + c[i] * ay
            vx[i], vy[i] = v0[i] - o[i] * uy, v1[i] + o[i] * ux
            wx[i], wy[i] = w0[i] - al[i] * uy - o[i] * o[i] * ux, w1[i] + al[i] * ux - o[i] * o[i] * uy


@kernel
def pinned(state, link, T, hx, hy, i0, i1, derivs):
    """Place an oriented link, whose angle has rates, so that its point (hx, hy) follows the first path in T."""
    L, px, py = state.X[link], T[0], T[1]
    x, y, c, s = L[0], L[1], L[2], L[3]
    for i in range(i0, i1):
        x[i] = px[i] - (c[i] * hx - s[i] * hy)
        y[i] = py[i] - (s[i] * hx + c[i] * hy)
    if derivs:
        V, W = state.V[link], state.W[link]
        v0, v1, o, w0, w1, al = V[0], V[1], V[2], W[0], W[1], W[2]
        vx, vy, wx, wy = T[4], T[5], T[6], T[7]
        for i in range(i0, i1):
            fx, fy = c[i] * hx - s[i] * hy, s[i] * hx + c[i] * hy
            v0[i], v1[i] = vx[i] + o[i] * fy, vy[i] - o[i] * fx
            w0[i], w1[i] = wx[i] + al[i] * fy + o[i] * o[i] * fx, wy[i] - al[i] * fx + o[i] * o[i] * fy


@kernel
def apex(T, gx, gy, l2, sign, M, c, s, i0, i1):
    """Direction of the link with the arm (gx, gy) from P to the third joint C; ``M`` is sin^2 of the angle at C.

    T has P (rows 0, 1) and Q (2, 3); |CQ| = l2; ``M`` is negative where the circles do not meet.
    """
    px, py, qx, qy = T[0], T[1], T[2], T[3]
    l1 = math.sqrt(gx * gx + gy * gy)
    total, difference, scale = l1 + l2, l1 - l2, 1.0 / (4.0 * l1 * l1 * l2 * l2)
    both = total * difference
    for i in range(i0, i1):
        dx, dy = qx[i] - px[i], qy[i] - py[i]
        dd = dx * dx + dy * dy
        d = math.sqrt(dd)
        product = (total - d) * (total + d) * (d - difference) * (d + difference)
        M[i] = product * scale if dd > 0.0 else -5e-324  # P on Q: every direction or none
        unit = 1.0 / d
        k, m = (dd + both) * unit, sign * math.sqrt(product) * unit
        # the arm along (k + i m) d; its length does not matter, but must not underflow
        ax, ay = (gx * dx + gy * dy) * unit, (gx * dy - gy * dx) * unit
        re, im = k * ax - m * ay, k * ay + m * ax
        f = 1.0 / math.sqrt(re * re + im * im)
        c[i], s[i] = re * f, im * f


@kernel
def apex_rates(T, gx, gy, c, s, o, al, i0, i1):
    """Rates of the angle of that link; T has the velocities and accelerations of P (rows 4..7) and Q (8..11)."""
    px, py, qx, qy = T[0], T[1], T[2], T[3]
    vx, vy, wx, wy, ux, uy, zx, zy = T[4], T[5], T[6], T[7], T[8], T[9], T[10], T[11]
    for i in range(i0, i1):
        kx, ky = c[i] * gx - s[i] * gy, s[i] * gx + c[i] * gy  # from P to C
        ex, ey = px[i] + kx - qx[i], py[i] + ky - qy[i]  # from Q to C
        rx, ry = vx[i] - ux[i], vy[i] - uy[i]
        inverse = 1.0 / (kx * ey - ky * ex)
        w = -(ex * rx + ey * ry) * inverse
        rx, ry = rx - w * ky, ry + w * kx
        tx, ty = wx[i] - w * w * kx - zx[i], wy[i] - w * w * ky - zy[i]
        o[i], al[i] = w, -(rx * rx + ry * ry + ex * tx + ey * ty) * inverse


@kernel
def turned(L, ca, sa, cq, sq, sign, c, s, i0, i1):
    """Direction of a link turned against link L by a fixed angle and by sign q, both given as cosine and sine."""
    cb, sb = L[2], L[3]
    for i in range(i0, i1):
        c1, s1 = cq[i] * ca - sign * sq[i] * sa, sign * sq[i] * ca + cq[i] * sa
        c[i], s[i] = cb[i] * c1 - sb[i] * s1, sb[i] * c1 + cb[i] * s1


@kernel
def drive_loop(d, p, r, q, state, T, i0, i1, derivs, angles):
    """Place a driven link from the link it is driven on; T is room for twelve rows."""
    X, TH, V, W = state.X, state.TH, state.V, state.W
    base, link, k = d[r, 1], d[r, 2], d[r, 3]
    px, py, sign, angle = p[r, 0], p[r, 1], p[r, 6], p[r, 7]
    ca, sa = cos(angle), sin(angle)
    Q, L, turning = q[k], X[link], d[r, 0] == DRIVE_R
    B = X[base]
    if turning:
        turned(B, ca, sa, Q[3], Q[4], sign, L[2], L[3], i0, i1)
        carried(state, base, px, py, T, 0, i0, i1, derivs)
    else:  # the point moves by q from (px, py) along (tx, ty), both given in the base
        for i in range(i0, i1):
            T[2, i], T[3, i] = 1.0, 0.0
        turned(B, ca, sa, T[2], T[3], sign, L[2], L[3], i0, i1)
        tx, ty = sign * p[r, 2], sign * p[r, 3]
        for i in range(i0, i1):
            ux, uy = px + Q[0, i] * tx, py + Q[0, i] * ty
            T[0, i], T[1, i] = B[0, i] + B[2, i] * ux - B[3, i] * uy, B[1, i] + B[3, i] * ux + B[2, i] * uy
        for i in range(i0, i1 if derivs else i0):
            c, s, o, al, v, q1, q2 = B[2, i], B[3, i], V[base, 2, i], W[base, 2, i], Q[0, i], Q[1, i], Q[2, i]
            gx, gy = c * tx - s * ty, s * tx + c * ty
            ux, uy = c * px - s * py + v * gx, s * px + c * py + v * gy
            T[4, i], T[5, i] = V[base, 0, i] - o * uy + q1 * gx, V[base, 1, i] + o * ux + q1 * gy
            T[6, i] = W[base, 0, i] - al * uy - o * o * ux + q2 * gx - 2.0 * o * q1 * gy
            T[7, i] = W[base, 1, i] + al * ux - o * o * uy + q2 * gy + 2.0 * o * q1 * gx
    if angles:
        for i in range(i0, i1):
            TH[link, i] = TH[base, i] + angle + (sign * Q[0, i] if turning else 0.0)
    if derivs:
        for i in range(i0, i1):
            V[link, 2, i] = V[base, 2, i] + (sign * Q[1, i] if turning else 0.0)
            W[link, 2, i] = W[base, 2, i] + (sign * Q[2, i] if turning else 0.0)
    pinned(state, link, T, p[r, 4], p[r, 5], i0, i1, derivs)


@kernel
def rrr_loop(group, sign, state, M, T, i0, i1, derivs):
    """Place the kept link of an RRR dyad; T is room for twelve rows."""
    own = group.core[group.c0]
    la, ax, ay, hx, hy = ends(group.rows, group.rp, group.r0, own)
    lb, bx, by, ex, ey = ends(group.rows, group.rp, group.r0 + 2, own)
    L, gx, gy = state.X[own], ex - hx, ey - hy
    carried(state, la, ax, ay, T, 0, i0, i1, derivs)
    carried(state, lb, bx, by, T, 2, i0, i1, derivs)
    apex(T, gx, gy, group.rp[group.r0 + 2, H], sign, M, L[2], L[3], i0, i1)
    if derivs:
        apex_rates(T, gx, gy, L[2], L[3], state.V[own, 2], state.W[own, 2], i0, i1)
    pinned(state, own, T, hx, hy, i0, i1, derivs)


@kernel
def bar_loop(e, a, b, p, r, state, T, i0, i1, derivs):
    """Place a link with two revolute joints between placed links a and b; T is room for twelve rows."""
    L, hx, hy = state.X[e], p[r, 2], p[r, 3]
    carried(state, a, p[r, 0], p[r, 1], T, 0, i0, i1, derivs)
    carried(state, b, p[r, 4], p[r, 5], T, 2, i0, i1, derivs)
    # its vector (gx, gy) points from P (rows 0, 1) to Q (2, 3)
    gx, gy, c, s, o, al = p[r, 6] - hx, p[r, 7] - hy, L[2], L[3], state.V[e, 2], state.W[e, 2]
    px, py, qx, qy = T[0], T[1], T[2], T[3]
    for i in range(i0, i1):
        dx, dy = qx[i] - px[i], qy[i] - py[i]
        re, im = gx * dx + gy * dy, gx * dy - gy * dx
        f = 1.0 / math.sqrt(re * re + im * im)
        c[i], s[i] = re * f, im * f
    if derivs:
        vx, vy, wx, wy, ux, uy, zx, zy = T[4], T[5], T[6], T[7], T[8], T[9], T[10], T[11]
        for i in range(i0, i1):
            dx, dy = qx[i] - px[i], qy[i] - py[i]
            f = 1.0 / (dx * dx + dy * dy)
            o[i] = (dx * (uy[i] - vy[i]) - dy * (ux[i] - vx[i])) * f
            al[i] = (dx * (zy[i] - wy[i]) - dy * (zx[i] - wx[i])) * f
    pinned(state, e, T, hx, hy, i0, i1, derivs)


@kernel
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
