"""The single-motor platform in bulk: drives block by block, then the platform by prediction and Newton's method.

See theory/platform-jacobians 2 and theory/platform-drive 3, 6.  A step is accepted only if the corrector moves little
and converges fast, and if ``det JX`` keeps its sign and half its size; otherwise it is cut.  A step that becomes too
small ends the branch, and so do a thousand tiny ones between two samples: there is no jump.

A machine is one array (3, 21), a row per leg: axis minus pivot of the drive (x, y), crank, phase, rocker, tau, six
constants of `length_constants`, the fixed turn of the bell-crank (cos, sin, angle), pivot (x, y), arm l1, platform
vertex (x, y), link l2.
"""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.core.intrinsics import fma
from graphsynth.kinematics.triad.kernels.leg import ROUND, angle_of, cross_sum, directions, solve

COMPLETE, NO_HOME, HOME_ENDS, DRIVE_ENDS, SINGULAR, NO_START = 0, 1, 2, 3, 4, 5
SMALLEST = 1e-11  # step over the whole range
TINY, MOST = 1e-6, 1000  # so many tiny steps between two samples are no motion of the machine
TAU = 2.0 * math.pi
BLOCK = 128
# rows of a leg in a block: arm cos, sin, theta', theta'', theta; of the platform: pose, velocity, determinant, push
LEG = 5 * BLOCK
PX, PY, PA, SPEED, PUSH = (row * BLOCK for row in (0, 1, 2, 3, 7))
QUICK = 1e-7  # scaled correction after which one more pass, in bulk, is enough
FINAL = 1e-13  # scaled correction of that pass above which the block is done again, step by step

# state: pose x, y, cos, sin, running angle; velocity; det; parameter; previous pose (x, y, angle), velocity, parameter
X, Y, C, S, A, VX, VY, VA, DET, AT, OX, OY, OA, OVX, OVY, OVA, OAT, OLD = range(18)


@kernel
def rocker(u, v, arm1x, arm1y, length, tau, c0, c1, c2, c3, c4, c5):
    """Rocker of a drive whose crank pin is at (u, v) from the pivot: y, x of phi, cos, sin, phi', link and moment.

    NaN beyond the reach.
    """
    r, K, P1, P2 = solve(u, v, c0, c1, c2, c3, c4, c5)
    s = tau * math.sqrt(P1 * P2)
    y, x = cross_sum(v, K, u, s), cross_sum(u, K, -v, s)
    scale = 1.0 / (2.0 * length * r)
    c, t = x * scale, y * scale
    lx, ly = length * c - u, length * t - v
    half = 0.5 * s
    return y, x, c, t, (lx * arm1x + ly * arm1y) / half, lx, ly, half


@kernel
def rocker2(c, t, rate, lx, ly, half, arm1x, arm1y, arm2x, arm2y, length):
    """``phi''`` of the drive from the results of `rocker`."""
    sx, sy = -length * t * rate - arm1x, length * c * rate - arm1y
    ax, ay = arm2x + length * c * rate * rate, arm2y + length * t * rate * rate
    return (lx * ax + ly * ay - (sx * sx + sy * sy)) / half


@kernel
def drives(p, k, m, c, s, out):
    """Drive k at m wheel angles with cosines c and sines s: the five rows of a leg into ``out``."""
    ex, ey, crank, length, tau = p[k, 0], p[k, 1], p[k, 2], p[k, 4], p[k, 5]
    c0, c1, c2, c3, c4, c5 = p[k, 6], p[k, 7], p[k, 8], p[k, 9], p[k, 10], p[k, 11]
    cd, sd, offset = p[k, 12], p[k, 13], p[k, 14]
    cp, sp = math.cos(p[k, 3]), math.sin(p[k, 3])
    for i in range(m):
        cs, sn = c[i], s[i]
        ax, ay = crank * (cs * cp - sn * sp), crank * (cs * sp + sn * cp)
        y, x, cf, tf, r, lx, ly, half = rocker(ex + ax, ey + ay, -ay, ax, length, tau, c0, c1, c2, c3, c4, c5)
        out[i], out[BLOCK + i], out[2 * BLOCK + i] = cf * cd - tf * sd, cf * sd + tf * cd, r
        out[3 * BLOCK + i] = rocker2(cf, tf, r, lx, ly, half, -ay, ax, -ax, -ay, length)
        out[4 * BLOCK + i] = angle_of(y, x) + offset


@kernel
def drive_at(p, scaled, psi, parameter, e):
    """Put the three rocker arms at one wheel angle, or at one scale of the cranks, into e (3, 5)."""
    for k in range(3):
        angle = (psi if scaled else parameter) + p[k, 3]
        ax, ay = p[k, 2] * math.cos(angle), p[k, 2] * math.sin(angle)
        bx, by = (ax, ay) if scaled else (-ay, ax)
        f = parameter if scaled else 1.0
        c0, c1, c2, c3, c4, c5 = p[k, 6], p[k, 7], p[k, 8], p[k, 9], p[k, 10], p[k, 11]
        x, y = p[k, 0] + f * ax, p[k, 1] + f * ay
        _y, _x, c, t, rate, _lx, _ly, _half = rocker(x, y, bx, by, p[k, 4], p[k, 5], c0, c1, c2, c3, c4, c5)
        arm(p, k, c * p[k, 12] - t * p[k, 13], c * p[k, 13] + t * p[k, 12], rate, e)


@kernel
def near(angle, other):
    """``angle`` shifted by whole turns to be nearest to ``other``."""
    return angle + TAU * (((other - angle) * (1.0 / TAU) + ROUND) - ROUND)


@kernel
def arm(p, k, c, t, rate, e):
    """Elbow A_k, rocker vector and rate of a rocker arm with direction (c, t) into e[k]."""
    rx, ry = p[k, 17] * c, p[k, 17] * t
    e[k, 0], e[k, 1], e[k, 2], e[k, 3], e[k, 4] = p[k, 15] + rx, p[k, 16] + ry, rx, ry, rate


@kernel
def predict(q, goal):
    """Pose at ``goal``: cubic through the last two poses and velocities, or the tangent where there is one only."""
    h = goal - q[AT]
    if q[OLD] == 0.0 or h > 4.0 * (q[AT] - q[OAT]):
        return q[X] + h * q[VX], q[Y] + h * q[VY], h * q[VA]
    w = q[AT] - q[OAT]
    s = 1.0 + h / w
    h01 = s * s * (3.0 - 2.0 * s)
    h00, h10, h11 = 1.0 - h01, w * s * (s - 1.0) * (s - 1.0), w * s * s * (s - 1.0)
    x = h00 * q[OX] + h01 * q[X] + h10 * q[OVX] + h11 * q[VX]
    y = h00 * q[OY] + h01 * q[Y] + h10 * q[OVY] + h11 * q[VY]
    return x, y, h00 * (q[OA] - q[A]) + h10 * q[OVA] + h11 * q[VA]


@kernel
def advance(p, e, goal, q, Lc, check, quick):
    """Move the state q to the parameter ``goal`` with rocker arms e; False, and q unchanged, if not trustworthy.

    With ``check`` False the pose of q is only a guess: the rules on the step do not apply.  With ``quick`` one pass is
    enough after a good prediction; `finish` then makes the second and judges it.
    """
    weight = 1.0 / (Lc * Lc)
    x, y, turn = q[X], q[Y], 0.0
    c, s = q[C], q[S]
    h = goal - q[AT]
    travelled = math.sqrt((q[VX] * q[VX] + q[VY] * q[VY]) * weight + q[VA] * q[VA]) * abs(h)
    if check:
        if not travelled <= 0.1:
            return False
        x, y, turn = predict(q, goal)
        d2 = turn * turn  # the rotation by a small turn as a polynomial
        dc = 1.0 - d2 * (0.5 - d2 * (1.0 / 24.0 - d2 / 720.0))
        ds = turn * (1.0 - d2 * (1.0 / 6.0 - d2 * (1.0 / 120.0)))
        c, s = c * dc - s * ds, s * dc + c * ds
    first, last, rate, settled = 0.0, 0.0, 0.0, False
    for it in range(10):
        # platform arms and legs; half of the closure of each leg, f, and of its row of JX, (dx, dy, m)
        rx1, ry1 = c * p[0, 18] - s * p[0, 19], c * p[0, 19] + s * p[0, 18]
        rx2, ry2 = c * p[1, 18] - s * p[1, 19], c * p[1, 19] + s * p[1, 18]
        rx3, ry3 = c * p[2, 18] - s * p[2, 19], c * p[2, 19] + s * p[2, 18]
        dx1, dy1 = x + rx1 - e[0, 0], y + ry1 - e[0, 1]
        dx2, dy2 = x + rx2 - e[1, 0], y + ry2 - e[1, 1]
        dx3, dy3 = x + rx3 - e[2, 0], y + ry3 - e[2, 1]
        f1 = 0.5 * (fma(dx1, dx1, -(p[0, 20] * p[0, 20])) + dy1 * dy1)
        f2 = 0.5 * (fma(dx2, dx2, -(p[1, 20] * p[1, 20])) + dy2 * dy2)
        f3 = 0.5 * (fma(dx3, dx3, -(p[2, 20] * p[2, 20])) + dy3 * dy3)
        m1, m2, m3 = rx1 * dy1 - ry1 * dx1, rx2 * dy2 - ry2 * dx2, rx3 * dy3 - ry3 * dx3
        k1, k2, k3 = dx2 * dy3 - dx3 * dy2, dx3 * dy1 - dx1 * dy3, dx1 * dy2 - dx2 * dy1
        det = m1 * k1 + m2 * k2 + m3 * k3
        inv = 1.0 / det  # Newton's step by the adjugate (u, w, k)
        u1, u2, u3 = dy2 * m3 - dy3 * m2, dy3 * m1 - dy1 * m3, dy1 * m2 - dy2 * m1
        w1, w2, w3 = dx3 * m2 - dx2 * m3, dx1 * m3 - dx3 * m1, dx2 * m1 - dx1 * m2
        px, py = (f1 * u1 + f2 * u2 + f3 * u3) * inv, (f1 * w1 + f2 * w2 + f3 * w3) * inv
        pa = (f1 * k1 + f2 * k2 + f3 * k3) * inv
        size = math.sqrt((px * px + py * py) * weight + pa * pa)
        if not size < 1.0:
            return False
        x, y, turn = x - px, y - py, turn - pa
        c, s = c + s * pa, s - c * pa
        fix = 1.5 - 0.5 * (c * c + s * s)
        c, s = c * fix, s * fix
        if it == 0:
            first = size
        elif it == 1 and first > 1e-13:
            rate = size / first
        # the matrix of this pass serves the velocity: it must belong to the final pose
        if size <= 1e-14 or settled or (quick and it == 0 and size <= QUICK):
            break
        if it > 0:
            if size > 1e-13 and size >= 0.5 * last and not size <= 1e-11:
                return False
            settled = size <= 1e-11 and (size <= 1e-3 * last or it > 1)
        last = size
    else:
        return False
    det *= 8.0
    same = (det > 0.0) == (q[DET] > 0.0)  # a product of two determinants, length^8, would underflow
    fits = first <= 0.1 * travelled + 1e-9 and rate <= 0.1 and same and abs(det) > 0.5 * abs(q[DET])
    if not (fits if check else first <= 0.1):
        return False
    # velocity of the platform from the rates of the rockers, with the same adjugate
    g1 = (e[0, 2] * dy1 - e[0, 3] * dx1) * e[0, 4]
    g2 = (e[1, 2] * dy2 - e[1, 3] * dx2) * e[1, 4]
    g3 = (e[2, 2] * dy3 - e[2, 3] * dx3) * e[2, 4]
    vx, vy = (g1 * u1 + g2 * u2 + g3 * u3) * inv, (g1 * w1 + g2 * w2 + g3 * w3) * inv
    va = (g1 * k1 + g2 * k2 + g3 * k3) * inv
    if not math.isfinite(vx + vy + va):
        return False
    if check:
        q[OX], q[OY], q[OA], q[OVX], q[OVY], q[OVA], q[OAT] = q[X], q[Y], q[A], q[VX], q[VY], q[VA], q[AT]
        q[OLD] = 1.0
    q[X], q[Y], q[C], q[S], q[A] = x, y, c, s, q[A] + turn
    q[VX], q[VY], q[VA], q[DET], q[AT] = vx, vy, va, det, goal
    return True


@kernel
def leg_row(x, y, cz, sz, dx, dy, l1, bx, by, l2, c, t):
    """Half a row of JX, half the closure, the rocker vector and the platform arm of one leg."""
    zx, zy = cz * bx - sz * by, cz * by + sz * bx
    rx, ry = l1 * c, l1 * t
    lx, ly = x + zx - (dx + rx), y + zy - (dy + ry)
    return lx, ly, zx * ly - zy * lx, 0.5 * (fma(lx, lx, -(l2 * l2)) + ly * ly), rx, ry, zx, zy


@kernel
def push(lx, ly, rx, ry, zx, zy, vx, vy, va, r1, r2):
    """Half the right-hand side of the accelerations for one leg (theory/platform-jacobians 2)."""
    sx, sy = vx - zy * va + ry * r1, vy + zx * va - rx * r1
    ax, ay = -ry * r2 - rx * r1 * r1 + zx * va * va, rx * r2 - ry * r1 * r1 + zy * va * va
    return lx * ax + ly * ay - (sx * sx + sy * sy)


@kernel
def finish(p, m, weight, cs, sn, e1, e2, e3, w):
    """Last Newton step and derivatives of m samples, leg rows e, platform rows w; how many corrections were too large.

    The running angle only tells the number of turns.
    """
    d1x, d1y, q1, b1x, b1y, l1 = p[0, 15], p[0, 16], p[0, 17], p[0, 18], p[0, 19], p[0, 20]
    d2x, d2y, q2, b2x, b2y, l2 = p[1, 15], p[1, 16], p[1, 17], p[1, 18], p[1, 19], p[1, 20]
    d3x, d3y, q3, b3x, b3y, l3 = p[2, 15], p[2, 16], p[2, 17], p[2, 18], p[2, 19], p[2, 20]
    bad = 0
    for i in range(m):
        x, y, cz, sz = w[PX + i], w[PY + i], cs[i], sn[i]
        a1, a2, a3 = e1[2 * BLOCK + i], e2[2 * BLOCK + i], e3[2 * BLOCK + i]
        dx1, dy1, m1, f1, r1x, r1y, z1x, z1y = leg_row(x, y, cz, sz, d1x, d1y, q1, b1x, b1y, l1, e1[i], e1[BLOCK + i])
        dx2, dy2, m2, f2, r2x, r2y, z2x, z2y = leg_row(x, y, cz, sz, d2x, d2y, q2, b2x, b2y, l2, e2[i], e2[BLOCK + i])
        dx3, dy3, m3, f3, r3x, r3y, z3x, z3y = leg_row(x, y, cz, sz, d3x, d3y, q3, b3x, b3y, l3, e3[i], e3[BLOCK + i])
        k1, k2, k3 = dx2 * dy3 - dx3 * dy2, dx3 * dy1 - dx1 * dy3, dx1 * dy2 - dx2 * dy1
        u1, u2, u3 = dy2 * m3 - dy3 * m2, dy3 * m1 - dy1 * m3, dy1 * m2 - dy2 * m1
        v1, v2, v3 = dx3 * m2 - dx2 * m3, dx1 * m3 - dx3 * m1, dx2 * m1 - dx1 * m2
        whole = m1 * k1 + m2 * k2 + m3 * k3
        inv = 1.0 / whole
        px, py = (f1 * u1 + f2 * u2 + f3 * u3) * inv, (f1 * v1 + f2 * v2 + f3 * v3) * inv
        pa = (f1 * k1 + f2 * k2 + f3 * k3) * inv
        bad += 0 if (px * px + py * py) * weight + pa * pa <= FINAL * FINAL else 1
        w[PX + i], w[PY + i], w[PA + i] = x - px, y - py, near(angle_of(sz, cz), w[PA + i]) - pa
        g1, g2, g3 = (r1x * dy1 - r1y * dx1) * a1, (r2x * dy2 - r2y * dx2) * a2, (r3x * dy3 - r3y * dx3) * a3
        vx, vy = (g1 * u1 + g2 * u2 + g3 * u3) * inv, (g1 * v1 + g2 * v2 + g3 * v3) * inv
        va = (g1 * k1 + g2 * k2 + g3 * k3) * inv
        w[SPEED + i], w[SPEED + BLOCK + i], w[SPEED + 2 * BLOCK + i], w[SPEED + 3 * BLOCK + i] = vx, vy, va, 8.0 * whole
        g1 = push(dx1, dy1, r1x, r1y, z1x, z1y, vx, vy, va, a1, e1[3 * BLOCK + i])
        g2 = push(dx2, dy2, r2x, r2y, z2x, z2y, vx, vy, va, a2, e2[3 * BLOCK + i])
        g3 = push(dx3, dy3, r3x, r3y, z3x, z3y, vx, vy, va, a3, e3[3 * BLOCK + i])
        w[PUSH + i] = (g1 * u1 + g2 * u2 + g3 * u3) * inv
        w[PUSH + BLOCK + i] = (g1 * v1 + g2 * v2 + g3 * v3) * inv
        w[PUSH + 2 * BLOCK + i] = (g1 * k1 + g2 * k2 + g3 * k3) * inv
    return bad


@kernel
def turns(machines, psi, stops, guess, grown, Lc, found):
    """Branches of many machines over the same increasing wheel angles, into the arrays of a ``Tracked``.

    ``guess`` is a pose near the branch at psi[0], or with ``grown`` at zero crank length, from where the cranks then
    grow.  Angles from ``stops`` on are not entered.  Rows beyond ``reached`` are left alone.  ``end`` (N, 4) is the
    parameter (a scale of the cranks for HOME_ENDS) and the pose where the branch ended.  ``theta2`` and
    ``acceleration`` are (N, n, 3), or (N, 0, 3) if not wanted.
    """
    theta, theta1, pose, velocity, determinant = (
        found.theta,
        found.theta1,
        found.pose,
        found.velocity,
        found.determinant,
    )
    theta2, acceleration, status, reached, end = (
        found.theta2,
        found.acceleration,
        found.status,
        found.reached,
        found.end,
    )
    n, second = psi.size, theta2.shape[1] > 0
    q, saved, e, w = np.empty(18), np.empty(18), np.empty((3, 5)), np.empty(10 * BLOCK)
    cs, sn, legs = np.empty(BLOCK), np.empty(BLOCK), (np.empty(LEG), np.empty(LEG), np.empty(LEG))
    for i in range(machines.shape[0]):
        p, state, done = machines[i], COMPLETE, 0
        # the state of a guess: at rest, no determinant to be kept
        q[VX], q[VY], q[VA], q[DET] = 0.0, 0.0, 0.0, 0.0
        q[X], q[Y], q[A], q[C], q[S] = (
            guess[i, 0],
            guess[i, 1],
            guess[i, 2],
            math.cos(guess[i, 2]),
            math.sin(guess[i, 2]),
        )
        # phase 0: the cranks grow from scale 0, at the home pose, to 1; phase 1: over the wheel angles, in blocks
        for phase in range(0 if grown else 1, 2):
            growing = phase == 0
            count = 2 if growing else n
            total = 1.0 if growing else psi[n - 1] - psi[0]
            for start in range(0, count, BLOCK):
                m = min(BLOCK, count - start)
                if not growing:
                    directions(psi, start, m, cs, sn)
                    for k in range(3):
                        drives(p, k, m, cs, sn, legs[k])
                for k in range(18):
                    saved[k] = q[k]
                # quick steps first; a block that `finish` refuses is done once more, every step to the end
                for attempt in range(2):
                    for slot in range(m):
                        j = start + slot
                        target = 1.0 * j if growing else psi[j]
                        if not growing and not target < stops[i]:
                            state = DRIVE_ENDS
                            break
                        if j == 0:
                            q[AT], q[OLD] = target, 0.0
                        step, sampled, arrived, tiny = target - q[AT], not growing, False, 0
                        # longer steps after every success, halved where `advance` does not trust one
                        while not arrived:
                            whole = step >= target - q[AT]
                            goal = target if whole else q[AT] + step
                            if sampled:
                                for k in range(3):
                                    arm(p, k, legs[k][slot], legs[k][BLOCK + slot], legs[k][2 * BLOCK + slot], e)
                            else:
                                drive_at(p, growing, psi[0], goal, e)
                            if advance(p, e, goal, q, Lc, j > 0, sampled and attempt == 0):
                                arrived = whole
                                tiny += 1 if step < TINY else 0
                                step = min(2.0 * step, total / 8.0)
                            else:
                                step = 0.5 * (goal - q[AT])
                                if j == 0 or step < SMALLEST * total or tiny > MOST:
                                    break
                            sampled = False  # what lies between two samples is computed there
                        if not arrived:
                            state = (
                                (NO_HOME if j == 0 else HOME_ENDS) if growing else (NO_START if j == 0 else SINGULAR)
                            )
                            break
                        if growing:
                            continue
                        done = j + 1
                        w[PX + slot], w[PY + slot], w[PA + slot] = q[X], q[Y], q[A]
                        cs[slot], sn[slot] = q[C], q[S]
                    if growing or done <= start:
                        break
                    bad = finish(p, done - start, 1.0 / (Lc * Lc), cs, sn, legs[0], legs[1], legs[2], w)
                    if bad == 0 or attempt == 1:
                        break
                    state, done = COMPLETE, start
                    for k in range(18):
                        q[k] = saved[k]
                # rocker angles are made continuous along the branch
                if not growing:
                    for j in range(start, done):
                        s = j - start
                        for k in range(3):
                            pose[i, j, k], velocity[i, j, k] = w[PX + k * BLOCK + s], w[SPEED + k * BLOCK + s]
                            raw = legs[k][4 * BLOCK + s]
                            theta[i, j, k] = raw if j == 0 else near(raw, theta[i, j - 1, k])
                            theta1[i, j, k] = legs[k][2 * BLOCK + s]
                        determinant[i, j] = w[SPEED + 3 * BLOCK + s]
                        if second:
                            for k in range(3):
                                acceleration[i, j, k] = w[PUSH + k * BLOCK + s]
                                theta2[i, j, k] = legs[k][3 * BLOCK + s]
                if state != COMPLETE:
                    break
            if state != COMPLETE:
                break
        status[i], reached[i] = state, done
        end[i, 0], end[i, 1], end[i, 2], end[i, 3] = stops[i] if state == DRIVE_ENDS else q[AT], q[X], q[Y], q[A]
