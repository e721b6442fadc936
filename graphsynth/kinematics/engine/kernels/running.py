"""Running a program: step after step, each over all samples, for every dimension set."""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels.nearest import atan2, cos, sin
from graphsynth.kinematics.engine import codes
from graphsynth.kinematics.engine.kernels.loops import bar_loop, drive_loop, rrr_loop
from graphsynth.kinematics.engine.kernels.newton import (
    ROUNDED,
    anchors,
    assemble,
    factor,
    newton,
    noise,
    platform,
    predict,
    rates,
)
from graphsynth.kinematics.engine.kernels.rows import (
    follow_angle,
    nearest_turn,
    pin_to_neighbour,
    pivot_rates,
    place_eliminated,
    slid_form,
    turned_form,
    world,
)

#: Turn of a line of centres between two samples, in radians, from which on its sense is in doubt if no speed tells it.
BACKWARD = 2.0


@kernel
def make_room(size, links, gears, steps, drivers, n):
    """Make the workspace of a run over n samples; ``size`` is the largest number of rows of a group."""
    return codes.Room(
        np.empty((size, size)),
        np.empty(size),
        np.empty(6),
        np.empty((size, 6)),
        np.empty(size, np.int64),
        np.zeros(4 + size),
        np.empty((3, 10)),
        np.empty((3, 6)),
        np.zeros((links, 11)),
        np.empty((12, n)),
        np.empty(gears),
        np.zeros(steps),
        np.empty((drivers, 3)),
        np.empty(n),
    )


@kernel
def load(link, i, x, state, derivs):
    """Copy one link's state at sample i to its row of x."""
    for c in range(4):
        x[link, c] = state.X[link, c, i]
    x[link, 4] = state.TH[link, i]
    if derivs:
        for c in range(3):
            x[link, 5 + c], x[link, 8 + c] = state.V[link, c, i], state.W[link, c, i]


@kernel
def store(link, i, x, state, derivs):
    """Copy a row of x to the link's state at sample i."""
    for c in range(4):
        state.X[link, c, i] = x[link, c]
    state.TH[link, i] = x[link, 4]
    if derivs:
        for c in range(3):
            state.V[link, c, i], state.W[link, c, i] = x[link, 5 + c], x[link, 8 + c]


@kernel
def unwrap(link, u, state, i0, i1, derivs):
    """Angle of a link placed by a loop, without jumps."""
    X, TH = state.X, state.TH
    for i in range(i0, i1):
        near = TH[link, i]
        if i > 0:
            near = TH[link, i - 1] + ((u[i] - u[i - 1]) * state.V[link, 2, i - 1] if derivs else 0.0)
        raw = atan2(X[link, 3, i], X[link, 2, i])
        TH[link, i] = nearest_turn(raw, near)


@kernel
def centres_pass(group, x, phi, h, derivs):
    """Whether the line of centres of a gear pair turns in a way that nobody can know from both ends of a step.

    Centres that come close to each other turn their line by up to half a turn, in a sense that the ends of a long step
    do not tell.  So the turn must be what the angular speed at its end says, and the distance must not change much.
    """
    rows, rp = group.rows, group.rp
    for k in range(group.r0, group.r0 + group.nr):
        if rows[k, 0] != codes.GEAR:
            continue
        a, b = rows[k, 1], rows[k, 2]
        ax, ay = world(x, a, rp[k, 0], rp[k, 1])
        bx, by = world(x, b, rp[k, 2], rp[k, 3])
        dx, dy = bx - ax, by - ay
        slot = int(rp[k, codes.SLOT])
        turn = nearest_turn(atan2(dy, dx), phi[slot]) - phi[slot]
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
def place(code, group, room, need, s, at, sizes):
    """Place the kept links of one group at one sample; returns why it failed, or 0.  ``sizes`` are Lc and far."""
    if code >= codes.ITERATIVE_FROM:
        return solved(code, group, room, need, s, at, sizes)
    x, m, own = room.x, room.m, group.core[group.c0]
    near = x[own, 4] + (at.h * x[own, 7] if at.warm and at.derivs else 0.0)
    if code in (codes.P_DIST, codes.P_LINE):
        m[s] = slid_form(code, group, at.sign, x)
    else:
        m[s] = turned_form(code, group, at.sign, x, room.phi)
    if code == codes.P_LINE:  # one mode; its determinant keeps its sign
        if m[s] == 0.0 or (at.warm and not m[s] * at.before > 0.0):
            return codes.UNREACHABLE
    elif m[s] < 0.0:
        return codes.UNREACHABLE
    if not math.isfinite(m[s]):
        return codes.NO_CONVERGENCE
    if need[own] and code != codes.R_GEAR:
        follow_angle(own, x, near)
    if at.derivs:
        if code <= codes.R_GEAR:
            pivot_rates(group, x, room.phi, room.ql, room.g)
        else:
            rates(group, x, room.phi, room.ql, room)
    if code == codes.R_GEAR and at.warm and centres_pass(group, x, room.phi, at.h, at.derivs):
        return codes.STEP_TOO_LONG
    return 0


@kernel
def solved(code, group, room, need, s, at, sizes):
    """Place a group by Newton's method; a step that may have left the branch is too long.

    ``room.blur[i]`` is how far rounding moved the links of the groups before; that of this group is added to it.
    """
    x, phi, ql, m, out = room.x, room.phi, room.ql, room.m, room.out
    rows, core, c0, nc, warm = group.rows, group.core, group.c0, group.nc, at.warm
    Lc, far = sizes
    reach = Lc  # a link that goes far away moves far: its travel is measured by its distance
    for k in range(c0, c0 + nc):
        reach = max(reach, abs(x[core[k], 0]) + abs(x[core[k], 1]) - far)
    # predict
    travel = predict(group, x, at.h, reach, out) if warm else 0.0
    if not travel <= 0.5:
        return codes.STEP_TOO_LONG
    if warm and nc == 1 and rows[group.r0, 0] == codes.RX and rows[group.r0 + 1, 0] == codes.RY:
        # far from the origin the predicted place is rough, its turn is not
        pin_to_neighbour(rows, group.rp, group.r0, core[c0], x)
    # correct
    why = 0
    if code == codes.PLATFORM:
        anchors(group, x, room.P)
        why = platform(room.P, x, core[c0], room.Q, Lc, reach, out, m, s)
    if code == codes.NEWTON or (why == codes.NO_CONVERGENCE and out[1] <= ROUNDED):
        first, rate = out[0], out[2]
        why = newton(group, x, phi, ql, room, reach)
        if code == codes.PLATFORM:
            code, out[0], out[2] = codes.NEWTON, first, rate
    if why:
        return why
    for k in range(c0, c0 + nc):
        if need[core[k]]:  # the angle that gears count and its cosine and sine must not drift apart
            follow_angle(core[k], x, x[core[k], 4])
    # is the correction small for the travel, or explained by rounding?
    if warm:
        second = out[0] * out[2]
        if out[2] > 0.1 and second <= ROUNDED and out[3] == 0.0:
            assemble(group, x, phi, ql, room, False)
            factor(room.J, group.nr, room.pivots)
            out[3] = noise(group, x, ql, room, reach)
        out[3] += room.blur[at.i] / reach
        room.blur[at.i] = out[3] * reach
        if out[0] > 0.1 * travel + 1e-9 + out[3] or (out[2] > 0.1 and second > out[3]):
            return codes.STEP_TOO_LONG
    # does the determinant keep its sign and half of its size?
    if code == codes.NEWTON:
        unit = 1.0
        for _ in range(nc):
            unit *= Lc
        m[s] = rates(group, x, phi, ql, room) / unit
    if m[s] == 0.0:
        return codes.SINGULAR
    if warm and not (m[s] * at.before > 0.0 and abs(m[s]) > 0.5 * abs(at.before)):
        return codes.STEP_TOO_LONG
    # another branch has other speeds, even where its pose is met by chance
    if warm:
        total = 0.0
        for k in range(nc):
            link = core[c0 + k]
            e = 4 + 3 * k
            dx, dy, dt = x[link, 5] - out[e], x[link, 6] - out[e + 1], x[link, 7] - out[e + 2]
            total += dx * dx + dy * dy + reach * reach * dt * dt
        if abs(at.h) * math.sqrt(total) / reach > 0.3 * travel + 1e-9 + out[3]:
            return codes.STEP_TOO_LONG
    if warm and centres_pass(group, x, phi, at.h, True):
        return codes.STEP_TOO_LONG
    return 0


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
def walk(tables, ep, group, s, q, u, sign, room, state, span, sizes, derivs):
    """Place a group at one sample after another, each from the one before; returns where and why it stopped."""
    steps, elim, need, x, phi = tables.steps, tables.eliminated, tables.need_angle, room.x, room.phi
    e0, ne, t0, nt = steps[s, 5], steps[s, 6], steps[s, 7], steps[s, 8]
    first, stop = span
    # begin with the sample before the first
    j = max(first - 1, 0)
    for k in range(group.c0, group.c0 + group.nc):
        load(group.core[k], j, x, state, derivs)
    for k in range(e0, e0 + ne):
        load(elim[k, 1], j, x, state, derivs)
    for k in range(phi.shape[0]):
        phi[k] = state.PHI[k, j]
    for i in range(first, stop):
        # what was placed before, and the coordinates of the drivers
        for k in range(t0, t0 + nt):
            load(tables.touched[k], i, x, state, derivs)
        for k in range(room.ql.shape[0]):
            room.ql[k, 0], room.ql[k, 1], room.ql[k, 2] = q[k, 0, i], q[k, 1, i], q[k, 2, i]
        h, before = (u[i] - u[i - 1], state.M[s, i - 1]) if i > 0 else (0.0, 0.0)
        reason = place(steps[s, 0], group, room, need, s, codes.At(i, h, before, i > 0, sign, derivs), sizes)
        state.M[s, i] = room.m[s]
        if reason:
            return i, reason
        # keep the core links, and the eliminated ones that slide
        for k in range(group.c0, group.c0 + group.nc):
            store(group.core[k], i, x, state, derivs)
        for k in range(e0, e0 + ne):
            e = elim[k, 1]
            if elim[k, 0] != codes.E_RR:
                near = x[e, 4] + (h * x[e, 7] if i > 0 and derivs else 0.0)
                place_eliminated(elim[k, 0], e, elim[k, 2], elim[k, 3], ep, k, x, derivs)
                if need[e]:
                    follow_angle(e, x, near)
                store(e, i, x, state, derivs)
        # follow the direction of the line of centres of every gear pair
        rows, rp = group.rows, group.rp
        for k in range(group.r0, group.r0 + group.nr):
            if rows[k, 0] == codes.GEAR:
                slot = int(rp[k, codes.SLOT])
                ax, ay = world(x, rows[k, 1], rp[k, 0], rp[k, 1])
                bx, by = world(x, rows[k, 2], rp[k, 2], rp[k, 3])
                phi[slot] = nearest_turn(atan2(by - ay, bx - ax), phi[slot])
                state.PHI[slot, i] = phi[slot]
    return stop, 0


@kernel
def run_set(tables, b, wanted, q, u, modes, state, room, limits, first, sizes, derivs):
    """Run a program for one dimension set; returns the samples reached, and the code and the step of the stop.

    ``limits`` are the first samples at which the driver of a step has no value.
    """
    rp, ep, dp = tables.row_table[b], tables.eliminated_table[b], tables.drive_table[b]
    steps, need = tables.steps, tables.need_angle
    stop, code, at = u.shape[0], 0, -1
    room.blur[:] = 0.0
    for s in range(steps.shape[0]):
        kind, r0 = steps[s, 0], steps[s, 1]
        if kind < codes.R_DIST:  # a driven link
            if limits[s] < stop:
                stop, code, at = limits[s], codes.BAD_INPUT, s
            drive_loop(tables.drives, dp, r0, q, state, room.T, first, stop, derivs, need.any())
            continue
        # a group: an RRR dyad in loops over the samples, any other sample by sample
        group = codes.Group(tables.rows, rp, r0, steps[s, 2], tables.core, steps[s, 3], steps[s, 4])
        if kind == codes.R_DIST:
            rrr_loop(group, modes[s], state, state.M[s], room.T, first, stop, derivs)
            M, bad, end, reason = state.M[s], 0, stop, 0
            for i in range(first, stop):  # margins that are negative or not a number: counted first, without branches
                bad += not M[i] >= 0.0
            for i in range(first if bad else stop, stop):
                if not M[i] >= 0.0:
                    end, reason = i, codes.UNREACHABLE if M[i] < 0.0 else codes.NO_CONVERGENCE
                    break
        else:
            end, reason = walk(tables, ep, group, s, q, u, modes[s], room, state, (first, stop), sizes, derivs)
        if reason:
            stop, code, at = end, reason, s
        own = tables.core[steps[s, 3]]
        if kind == codes.R_DIST and need[own]:
            unwrap(own, u, state, first, stop, derivs)
        # the links eliminated from it, as far as it goes
        elim = tables.eliminated
        for k in range(steps[s, 5], steps[s, 5] + steps[s, 6]):
            e = elim[k, 1]
            if elim[k, 0] == codes.E_RR and wanted[e]:
                bar_loop(e, elim[k, 2], elim[k, 3], ep, k, state, room.T, first, stop, derivs)
                if need[e]:
                    unwrap(e, u, state, first, stop, derivs)
    return stop, code, at


@kernel
def run(tables, wanted, q, u, modes, state, out, done, why, first, sizes, derivs):
    """Run a program for every dimension set over the samples first..n-1.

    The state is that of one set: it stays in the cache of the core, and what ``out`` asks for is copied there.  q
    (drivers, 5, n) holds the driver coordinate, its two derivatives, cosine and sine.  Sample ``first`` starts from
    ``first - 1`` if there is one, else cold.  ``done`` gets the samples reached, ``why`` the code and the step at which
    it stopped.  Eliminated links are placed if ``wanted``.  ``sizes`` are the characteristic length and the distance
    from which on a link has gone away.
    """
    steps, n, size = tables.steps, u.shape[0], 3
    for s in range(steps.shape[0]):
        size = max(size, steps[s, 2])
    room = make_room(size, state.X.shape[0], state.PHI.shape[0], steps.shape[0], q.shape[0], n)
    # up to which sample every driver has a value
    limits = np.empty(steps.shape[0], np.int64)
    for s in range(steps.shape[0]):
        limits[s] = n
        for i in range(first, n if steps[s, 0] < codes.R_DIST else first):
            if not math.isfinite(q[tables.drives[steps[s, 1], 3], 0, i]):
                limits[s] = i
                break
    for b in range(done.shape[0]):
        if out.poses.shape[0] > 0:
            for k in range(out.poses.shape[1]):
                x, y, theta = out.poses[b, k, 0], out.poses[b, k, 1], out.poses[b, k, 2]
                state.X[k, 0, 0], state.X[k, 1, 0], state.TH[k, 0] = x, y, theta
                state.X[k, 2, 0], state.X[k, 3, 0] = cos(theta), sin(theta)
            for k in range(state.PHI.shape[0]):
                state.PHI[k, 0] = out.centres[b, k]
        done[b], why[b, 0], why[b, 1] = run_set(
            tables, b, wanted, q, u, modes, state, room, limits, first, sizes, derivs
        )
        # deliver what is asked for
        if out.links.shape[0] > 0:
            deliver(state.X, out.links, done[b], out.frames[b])
            deliver(state.V, out.links, done[b], out.velocities[b])
            deliver(state.W, out.links, done[b], out.accelerations[b])
            for r in range(out.steps.shape[0]):
                for i in range(n):
                    out.margins[b, r, i] = state.M[out.steps[r], i] if i < done[b] else math.nan
