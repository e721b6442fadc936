"""Running a program: step after step, each over all samples, for every dimension set."""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.kinematics.engine.codes import (
    BAD_INPUT,
    E_RR,
    GEAR,
    ITERATIVE_FROM,
    NEWTON,
    NO_CONVERGENCE,
    P_LINE,
    PLATFORM,
    R_DIST,
    R_GEAR,
    RX,
    RY,
    SINGULAR,
    SLOT,
    STEP_TOO_LONG,
    UNREACHABLE,
)  # fmt: skip
from graphsynth.kinematics.engine.kernels.linear import factor
from graphsynth.kinematics.engine.kernels.loops import bar_loop, drive_loop, first_bad, rrr_loop
from graphsynth.kinematics.engine.kernels.newton import (
    ROUNDED,
    anchors,
    assemble,
    newton,
    noise,
    platform,
    predict,
    rates,
    surprise,
)
from graphsynth.kinematics.engine.kernels.rows import follow_angle, nearest_turn, world
from graphsynth.kinematics.engine.kernels.single import closed_form, pin_to_neighbour, pivot_rates, place_eliminated

#: Turn of a line of centres between two samples, in radians, from which on its sense is in doubt if no speed tells it.
BACKWARD = 2.0


@kernel
def load(link, i, x, X, TH, V, W, derivs):
    """Copy one link's state at sample i to its row of x."""
    for c in range(4):
        x[link, c] = X[link, c, i]
    x[link, 4] = TH[link, i]
    if derivs:
        for c in range(3):
            x[link, 5 + c], x[link, 8 + c] = V[link, c, i], W[link, c, i]


@kernel
def store(link, i, x, X, TH, V, W, derivs):
    """Copy a row of x to the link's state at sample i."""
    for c in range(4):
        X[link, c, i] = x[link, c]
    TH[link, i] = x[link, 4]
    if derivs:
        for c in range(3):
            V[link, c, i], W[link, c, i] = x[link, 5 + c], x[link, 8 + c]


@kernel
def unwrap(link, u, X, TH, V, i0, i1, derivs):
    """Angle of a link placed by a loop, without jumps."""
    for i in range(i0, i1):
        near = TH[link, i]
        if i > 0:
            near = TH[link, i - 1] + ((u[i] - u[i - 1]) * V[link, 2, i - 1] if derivs else 0.0)
        raw = math.atan2(X[link, 3, i], X[link, 2, i])
        TH[link, i] = nearest_turn(raw, near)


@kernel
def bars(elim, e0, ne, ep, wanted, need, u, X, TH, V, W, T, i0, i1, derivs):
    """Place the eliminated links with two turning pairs, those that are wanted."""
    for k in range(e0, e0 + ne):
        e = elim[k, 1]
        if elim[k, 0] == E_RR and wanted[e]:
            bar_loop(e, elim[k, 2], elim[k, 3], ep, k, X, V, W, T, i0, i1, derivs)
            if need[e]:
                unwrap(e, u, X, TH, V, i0, i1, derivs)


@kernel
def carry_centres(rows, rp, r0, nr, i, x, phi, PHI):
    """Follow the direction of the line of centres of every gear pair of a step."""
    for k in range(r0, r0 + nr):
        if rows[k, 0] == GEAR:
            slot = int(rp[k, SLOT])
            ax, ay = world(x, rows[k, 1], rp[k, 0], rp[k, 1])
            bx, by = world(x, rows[k, 2], rp[k, 2], rp[k, 3])
            raw = math.atan2(by - ay, bx - ax)
            phi[slot] = nearest_turn(raw, phi[slot])
            PHI[slot, i] = phi[slot]


@kernel
def centres_pass(rows, rp, r0, nr, x, phi, h, derivs):
    """Whether the line of centres of a gear pair turns in a way that nobody can know from both ends of a step.

    Centres that come close to each other turn their line by up to half a turn, in a sense that the ends of a long step
    do not tell.  So the turn must be what the angular speed at its end says, and the distance must not change much.
    """
    for k in range(r0, r0 + nr):
        if rows[k, 0] != GEAR:
            continue
        a, b = rows[k, 1], rows[k, 2]
        ax, ay = world(x, a, rp[k, 0], rp[k, 1])
        bx, by = world(x, b, rp[k, 2], rp[k, 3])
        dx, dy = bx - ax, by - ay
        slot = int(rp[k, SLOT])
        turn = nearest_turn(math.atan2(dy, dx), phi[slot]) - phi[slot]
        if not derivs:
            if abs(turn) > BACKWARD:
                return True
            continue
        vx = x[b, 5] - x[b, 7] * (by - x[b, 1]) - x[a, 5] + x[a, 7] * (ay - x[a, 1])
        vy = x[b, 6] + x[b, 7] * (bx - x[b, 0]) - x[a, 6] - x[a, 7] * (ax - x[a, 0])
        square = dx * dx + dy * dy
        along, across = h * (dx * vx + dy * vy), h * (dx * vy - dy * vx)
        if not (abs(along) <= 0.5 * square and abs(across - turn * square) <= 0.5 * square):
            return True
    return False


@kernel
def place(code, r0, nr, own, rows, rp, core, c0, nc, x, phi, ql, sign, before, h, warm, need, M, s, J, f, g, G, pivots,
          out, P, Q, Lc, far, derivs, blur, i):  # fmt: skip
    """Place the kept links of one group at one sample i; returns why it failed, or 0.

    ``blur[i]`` is how far rounding moved the links of the groups before; rounding of this group is added to it.
    """
    why = 0
    if code >= ITERATIVE_FROM:
        reach = Lc  # a link that goes far away moves far: its travel is measured by its distance
        for k in range(c0, c0 + nc):
            reach = max(reach, abs(x[core[k], 0]) + abs(x[core[k], 1]) - far)
        travel = predict(core, c0, nc, x, h, reach, out) if warm else 0.0
        if not travel <= 0.5:
            return STEP_TOO_LONG
        if warm and nc == 1 and rows[r0, 0] == RX and rows[r0 + 1, 0] == RY:
            pin_to_neighbour(rows, rp, r0, own, x)  # far from the origin the predicted place is rough, its turn is not
        if code == PLATFORM:
            anchors(rows, rp, r0, own, x, P)
            why = platform(P, x, own, Q, Lc, reach, out, M, s)
        if code == NEWTON or (why == NO_CONVERGENCE and out[1] <= ROUNDED):
            first, rate = out[0], out[2]
            why = newton(rows, rp, r0, nr, core, c0, nc, x, phi, ql, J, f, g, G, pivots, reach, out)
            if code == PLATFORM:
                code, out[0], out[2] = NEWTON, first, rate
        if why:
            return why
        for k in range(c0, c0 + nc):
            if need[core[k]]:  # the angle that gears count and its cosine and sine must not drift apart
                follow_angle(core[k], x, x[core[k], 4])
        if warm:
            second = out[0] * out[2]
            if out[2] > 0.1 and second <= ROUNDED and out[3] == 0.0:
                assemble(rows, rp, r0, nr, x, phi, ql, J, f, g, G, False)
                factor(J, nr, pivots)
                out[3] = noise(rows, rp, r0, nr, x, ql, J, f, G, pivots, reach)
            out[3] += blur[i] / reach
            blur[i] = out[3] * reach
            if out[0] > 0.1 * travel + 1e-9 + out[3] or (out[2] > 0.1 and second > out[3]):
                return STEP_TOO_LONG
        if code == NEWTON:
            M[s] = rates(rows, rp, r0, nr, core, c0, nc, x, phi, ql, J, f, g, G, pivots) / Lc**nc
        if M[s] == 0.0:
            return SINGULAR
        if warm and not (M[s] * before > 0.0 and abs(M[s]) > 0.5 * abs(before)):
            return STEP_TOO_LONG
        # another branch has other speeds, even where its pose is met by chance
        if warm and surprise(core, c0, nc, x, h, reach, out) > 0.3 * travel + 1e-9 + out[3]:
            return STEP_TOO_LONG
        if warm and centres_pass(rows, rp, r0, nr, x, phi, h, True):
            return STEP_TOO_LONG
        return 0
    near = x[own, 4] + (h * x[own, 7] if warm and derivs else 0.0)
    M[s] = closed_form(code, rows, rp, r0, own, sign, x, phi, g)
    if code == P_LINE:  # one mode; its determinant keeps its sign
        if M[s] == 0.0 or (warm and not M[s] * before > 0.0):
            return UNREACHABLE
    elif M[s] < 0.0:
        return UNREACHABLE
    if not math.isfinite(M[s]):
        return NO_CONVERGENCE
    if need[own] and code != R_GEAR:
        follow_angle(own, x, near)
    if derivs:
        if code <= R_GEAR:
            pivot_rates(rows, rp, r0, own, x, phi, ql, g)
        else:
            rates(rows, rp, r0, nr, core, c0, nc, x, phi, ql, J, f, g, G, pivots)
    if code == R_GEAR and warm and centres_pass(rows, rp, r0, nr, x, phi, h, derivs):
        return STEP_TOO_LONG
    return 0


@kernel
def seat(poses, centres, X, TH, PHI):
    """Put the poses (x, y, theta) of all links, and directions of lines of centres, into the first sample."""
    for k in range(poses.shape[0]):
        X[k, 0, 0], X[k, 1, 0], TH[k, 0] = poses[k, 0], poses[k, 1], poses[k, 2]
        X[k, 2, 0], X[k, 3, 0] = math.cos(poses[k, 2]), math.sin(poses[k, 2])
    for k in range(PHI.shape[0]):
        PHI[k, 0] = centres[k]


@kernel
def deliver(source, rows, done, target):
    """Copy the rows asked for, not a number beyond the samples reached."""
    for r in range(rows.shape[0]):
        for c in range(target.shape[1]):
            count = min(done, target.shape[2])
            for i in range(count):
                target[r, c, i] = source[rows[r], c, i]
            for i in range(count, target.shape[2]):
                target[r, c, i] = math.nan


@kernel
def run(steps, touched, rows, RP, core, elim, EP, drv, DP, need, wanted, q, u, modes, poses, centres, X, TH, V, W, PHI,
        M, kept, groups, OX, OV, OW, OM, done, why, first, Lc, far, derivs):  # fmt: skip
    """Run a program for every dimension set over the samples first..n-1.

    RP, EP, DP have the dimension set as first axis.  The state is that of one set: X (links, 4, n), TH (links, n), V
    and W (links, 3, n), PHI (gears, n), M (steps, n); it stays in the cache of the core and what is asked for (``kept``
    links, ``groups`` of steps) is copied to OX (sets, kept, 4, n), OV, OW (sets, kept, 3, n) and OM (sets, groups, n).
    q (drivers, 5, n) holds the driver coordinate, its two derivatives, cosine and sine.  Sample ``first`` starts from
    ``first - 1`` if there is one; else cold, from ``poses`` (sets, links, 3) and
    ``centres`` (sets, gears), or without them from sample 0 as it is.
    ``done`` gets the samples reached, ``why`` the code and the step at which it stopped.  Eliminated links are placed
    if ``wanted``.
    """
    n, links, size = u.shape[0], X.shape[0], 3
    for s in range(steps.shape[0]):
        size = max(size, steps[s, 2])
    J, f, g, out = np.empty((size, size)), np.empty(size), np.empty(6), np.zeros(4 + size)
    G, pivots = np.empty((size, 6)), np.empty(size, np.int64)
    P, Q = np.empty((3, 10)), np.empty((3, 6))
    x, T = np.zeros((links, 11)), np.empty((12, n))
    phi, m, ql = np.empty(PHI.shape[0]), np.empty(steps.shape[0]), np.empty((q.shape[0], 3))
    blur = np.empty(n)
    limits, angles = np.empty(steps.shape[0], np.int64), need[0]
    for k in range(1, links):
        angles = angles or need[k]
    for s in range(steps.shape[0]):
        limits[s] = n
        for i in range(first, n if steps[s, 0] < R_DIST else first):
            if not math.isfinite(q[drv[steps[s, 1], 3], 0, i]):
                limits[s] = i
                break
    for b in range(done.shape[0]):
        rp, ep, dp = RP[b], EP[b], DP[b]
        if poses.shape[0] > 0:
            seat(poses[b], centres[b], X, TH, PHI)
        stop, code, at = n, 0, -1
        blur[:] = 0.0
        for s in range(steps.shape[0]):
            kind, r0, nr, c0, nc = steps[s, 0], steps[s, 1], steps[s, 2], steps[s, 3], steps[s, 4]
            e0, ne, t0, nt = steps[s, 5], steps[s, 6], steps[s, 7], steps[s, 8]
            own = core[c0]
            if kind < R_DIST:
                if limits[s] < stop:
                    stop, code, at = limits[s], BAD_INPUT, s
                drive_loop(drv, dp, r0, q, X, TH, V, W, T, first, stop, derivs, angles)
                continue
            if kind == R_DIST:
                rrr_loop(rows, rp, r0, own, modes[s], X, V, W, M[s], T, first, stop, derivs)
                end, reason = first_bad(M[s], first, stop)
                if reason:
                    stop, code, at = end, reason, s
                if need[own]:
                    unwrap(own, u, X, TH, V, first, stop, derivs)
                bars(elim, e0, ne, ep, wanted, need, u, X, TH, V, W, T, first, stop, derivs)
                continue
            # one sample after another: each starts from the one before
            j = max(first - 1, 0)
            for k in range(c0, c0 + nc):
                load(core[k], j, x, X, TH, V, W, derivs)
            for k in range(e0, e0 + ne):
                load(elim[k, 1], j, x, X, TH, V, W, derivs)
            for k in range(phi.shape[0]):
                phi[k] = PHI[k, j]
            for i in range(first, stop):
                for k in range(t0, t0 + nt):
                    load(touched[k], i, x, X, TH, V, W, derivs)
                for k in range(ql.shape[0]):
                    ql[k, 0], ql[k, 1], ql[k, 2] = q[k, 0, i], q[k, 1, i], q[k, 2, i]
                h, before = (u[i] - u[i - 1], M[s, i - 1]) if i > 0 else (0.0, 0.0)
                reason = place(kind, r0, nr, own, rows, rp, core, c0, nc, x, phi, ql, modes[s], before, h, i > 0, need,
                               m, s, J, f, g, G, pivots, out, P, Q, Lc, far, derivs, blur, i)  # fmt: skip
                M[s, i] = m[s]
                if reason:
                    stop, code, at = i, reason, s
                    break
                for k in range(c0, c0 + nc):
                    store(core[k], i, x, X, TH, V, W, derivs)
                for k in range(e0, e0 + ne):
                    e = elim[k, 1]
                    if elim[k, 0] != E_RR:
                        near = x[e, 4] + (h * x[e, 7] if i > 0 and derivs else 0.0)
                        place_eliminated(elim[k, 0], e, elim[k, 2], elim[k, 3], ep, k, x, derivs)
                        if need[e]:
                            follow_angle(e, x, near)
                        store(e, i, x, X, TH, V, W, derivs)
                carry_centres(rows, rp, r0, nr, i, x, phi, PHI)
            bars(elim, e0, ne, ep, wanted, need, u, X, TH, V, W, T, first, stop, derivs)
        done[b], why[b, 0], why[b, 1] = stop, code, at
        if kept.shape[0] > 0:
            deliver(X, kept, stop, OX[b])
            deliver(V, kept, stop, OV[b])
            deliver(W, kept, stop, OW[b])
            for r in range(groups.shape[0]):
                for i in range(n):
                    OM[b, r, i] = M[groups[r], i] if i < stop else math.nan
