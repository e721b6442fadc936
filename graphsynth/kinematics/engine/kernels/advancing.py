"""Following the drivers from a pose: in steps whose length the branch decides, to a wanted place or over asked samples.

The drivers move along a straight line of their coordinates, whose parameter s runs from 0 to 1.  Four samples at a time
are placed: the pose reached and three ahead, so that a margin that dips between them is seen.  A step is halved where
the groups refuse it, where a link turns by more than 60 degrees between samples, or where a margin may vanish in it;
what stays so down to the last bits ends the way.
"""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels.nearest import atan2, cos, sin
from graphsynth.kinematics.engine import codes, outlines
from graphsynth.kinematics.engine.kernels.rows import nearest_turn
from graphsynth.kinematics.engine.kernels.running import make_room, run_set

#: Samples of a step: the pose reached, and three ahead.
SAMPLES = 4
#: Longest step of a turning driver in radians, and of a sliding one over the characteristic length.
FINE, FINE_SLIDE = math.tau / 360.0, 0.01
#: Shortest step over the longest.
SMALLEST = 1e-11
#: Margins above this do not vanish within a step of the longest length.
SAFE = 0.2
#: Cosine of the largest turn of a link between two samples that is taken as it is.
SUDDEN = 0.5
#: Margins at and below this have vanished: two modes meet at the sample.
TOUCH = 1e-15
#: Part of the longest step beyond a place that is not reached at which a branch that goes on there is met again.
BEYOND = 4e-5
#: Steps that are tried at most for one way.
TRIALS = 100_000


@kernel
def longest(tables, start, goal, Lc):
    """Return the longest step in s."""
    steps = 1.0
    for r in range(tables.drives.shape[0]):
        k = tables.drives[r, 3]
        fine = FINE if tables.drives[r, 0] == codes.DRIVE_R else FINE_SLIDE * Lc
        steps = max(steps, np.ceil(abs(goal[k] - start[k]) / fine - 1e-9))
    for r in range(tables.rows.shape[0]):  # drivers away from the frame
        kind = tables.rows[r, 0]
        if kind in (codes.DRIVE_ANGLE, codes.DRIVE_SLIDE):
            k = int(tables.row_table[0, r, codes.SLOT])
            fine = FINE if kind == codes.DRIVE_ANGLE else FINE_SLIDE * Lc
            steps = max(steps, np.ceil(abs(goal[k] - start[k]) / fine - 1e-9))
    return 1.0 / steps


@kernel
def workspace(tables, state, drivers):
    """Make room for steps: workspace, driver coordinates (drivers, 5, 4), their limits, links wanted."""
    size = 3
    for s in range(tables.steps.shape[0]):
        size = max(size, tables.steps[s, 2])
    steps, links = tables.steps.shape[0], state.X.shape[0]
    room = make_room(size, links, state.PHI.shape[0], steps, max(1, drivers), SAMPLES)
    limits, wanted = np.full(steps, SAMPLES, np.int64), np.ones(links, np.bool_)
    return room, np.zeros((max(1, drivers), 5, SAMPLES)), np.zeros(SAMPLES), limits, wanted


@kernel
def coordinates(start, goal, rate, s, end, q, u):
    """Set inputs and driver coordinates of four samples between two values of s."""
    for i in range(SAMPLES):
        u[i] = s + (end - s) * i / (SAMPLES - 1.0) if i < SAMPLES - 1 else end
        for k in range(start.shape[0]):
            q[k, 0, i] = start[k] + u[i] * (goal[k] - start[k]) if u[i] != 1.0 else goal[k]
            q[k, 1, i], q[k, 2, i] = rate[k], 0.0
            q[k, 3, i], q[k, 4, i] = cos(q[k, 0, i]), sin(q[k, 0, i])


@kernel
def accept(state, i):
    """Make sample i the first one."""
    for part in (state.X, state.V, state.W):
        for a in range(part.shape[0]):
            for b in range(part.shape[1]):
                part[a, b, 0] = part[a, b, i]
    for part in (state.TH, state.PHI, state.M):
        for a in range(part.shape[0]):
            part[a, 0] = part[a, i]


@kernel
def doubt(tables, state):
    """Whether a link turns suddenly in a step (`FLIPPED`), or a margin may vanish in it (`MEETING`), and which step."""
    X, M, steps = state.X, state.M, tables.steps
    for link in range(X.shape[0]):
        for i in range(1, SAMPLES):
            if not X[link, 2, i] * X[link, 2, i - 1] + X[link, 3, i] * X[link, 3, i - 1] >= SUDDEN:
                return outlines.FLIPPED, placing(tables, link)
    for s in range(steps.shape[0]):
        if steps[s, 0] not in outlines.DIPPING:
            continue
        m0, m1, m2, m3 = abs(M[s, 0]), abs(M[s, 1]), abs(M[s, 2]), abs(M[s, 3])
        if min(min(m0, m1), min(m2, m3)) > SAFE:
            continue
        if min(m1, min(m2, m3)) <= TOUCH < m0:  # a sample upon the place where the modes meet
            return outlines.MEETING, s
        # the cubic through the samples falls into the step from both ends: how far?
        if 18.0 * m1 + 2.0 * m3 < 11.0 * m0 + 9.0 * m2 and 18.0 * m2 + 2.0 * m0 < 11.0 * m3 + 9.0 * m1:
            lowest = min(m1, m2)
            for j in range(1, 48):
                t = j / 16.0
                a, b, c = t - 1.0, t - 2.0, t - 3.0
                lowest = min(lowest, (t * a * b * m3 - a * b * c * m0) / 6.0 + t * c * (b * m1 - a * m2) / 2.0)
            if lowest < 0.5 * min(m0, m3):
                return outlines.MEETING, s
    return codes.DONE, -1


@kernel
def placing(tables, link):
    """Return the step that places a link, -1 for the frame."""
    steps, found = tables.steps, -1
    for s in range(steps.shape[0]):
        if steps[s, 0] < codes.R_DIST and tables.drives[steps[s, 1], 2] == link:
            found = s
        for k in range(steps[s, 3], steps[s, 3] + steps[s, 4]):
            found = s if tables.core[k] == link else found
        for k in range(steps[s, 5], steps[s, 5] + steps[s, 6]):
            found = s if tables.eliminated[k, 1] == link else found
    return found


@kernel
def evaluate(tables, modes, state, q0, rate, sizes, work):
    """Place sample 0 anew at driver coordinates, from the pose in it, with derivatives by u where dq/du is ``rate``.

    Returns the code and step of a failure.
    """
    room, q, u, limits, wanted = work
    coordinates(q0, q0, rate, 0.0, 0.0, q, u)
    done, code, at = run_set(tables, 0, wanted, q, u, modes, state, room, limits, 0, sizes, True)
    return (codes.DONE, -1) if done > 0 else (code, at)


@kernel
def follow(tables, modes, state, start, goal, span, sizes, work):
    """Follow from sample 0, the pose at the first s of ``span`` with rates by s, to the second.

    Returns the s reached, and the code and step of a stop; sample 0 becomes the pose reached.
    """
    room, q, u, limits, wanted = work
    most, rate = longest(tables, start, goal, sizes[0]), goal - start
    s, end = span
    step, code, at = most, codes.DONE, -1
    for _ in range(TRIALS):
        if s == end:
            return s, codes.DONE, -1
        last = step >= abs(end - s)
        length = abs(end - s) if last else step
        to = end if last else s + math.copysign(length, end - s)
        coordinates(start, goal, rate, s, to, q, u)
        done, code, at = run_set(tables, 0, wanted, q, u, modes, state, room, limits, 1, sizes, True)
        if done == SAMPLES:
            code, at = doubt(tables, state)
            if code == codes.DONE:
                accept(state, SAMPLES - 1)
                s, step = to, min(most, 2.0 * length)
                continue
        step = 0.5 * length
        if step < SMALLEST * most:
            break
    if code == codes.UNREACHABLE and tables.steps[at, 0] in codes.TWO_MODES and abs(end - s) > BEYOND * most:
        # it is assembled again right behind: the margin has vanished without changing its sign
        coordinates(start, goal, rate, s, s + math.copysign(BEYOND * most, end - s), q, u)
        done, _, _ = run_set(tables, 0, wanted, q, u, modes, state, room, limits, 1, sizes, True)
        code = outlines.MEETING if done == SAMPLES else code
    return s, code, at


@kernel
def advance(tables, modes, state, start, goal, rate, sizes, found):
    """Move the drivers from coordinates ``start`` (drivers,), those of the pose in sample 0 of the state, to ``goal``.

    The state has four samples; sample 0 becomes the pose reached, with derivatives by u where dq/du is ``rate``
    (drivers,).  To ``found`` (3,) go the part of the way that was made, and the code and step of what stopped it.
    """
    work = workspace(tables, state, start.shape[0])
    code, at = evaluate(tables, modes, state, start, goal - start, sizes, work)
    s = 0.0
    if code == codes.DONE:
        s, code, at = follow(tables, modes, state, start, goal, (0.0, 1.0), sizes, work)
        evaluate(tables, modes, state, start + s * (goal - start) if s < 1.0 else goal, rate, sizes, work)
    found[0], found[1], found[2] = s, code, at


@kernel
def copied(state):
    """Return a copy of a state: the frame has its place in all samples."""
    X, TH, V, W, PHI, M = state
    return codes.State(X.copy(), TH.copy(), V.copy(), W.copy(), PHI.copy(), M.copy())


@kernel
def copy_first(source, target):
    """Copy sample 0 of a state."""
    for a in range(source.X.shape[0]):
        for b in range(4):
            target.X[a, b, 0] = source.X[a, b, 0]
        for b in range(3):
            target.V[a, b, 0], target.W[a, b, 0] = source.V[a, b, 0], source.W[a, b, 0]
        target.TH[a, 0] = source.TH[a, 0]
    for a in range(source.PHI.shape[0]):
        target.PHI[a, 0] = source.PHI[a, 0]
    for a in range(source.M.shape[0]):
        target.M[a, 0] = source.M[a, 0]


@kernel
def sweep(tables, modes, state, start, goal, scale, watched, out, sizes, found):
    """Move the drivers from ``start``, the coordinates of sample 0, to ``goal`` over equally spaced samples.

    To ``out`` go poses (n, links, 3) with continuous angles, derivatives by u where ds/du is ``scale``, margins
    (n, steps), and reversals (most, 2): index in ``watched``, s.  ``watched`` (k, 3) names coordinates on the frame:
    a link, and the direction in which it slides, or zeros.  To ``found`` (5,) go samples reached, the part of the way
    made, code and step of what stopped it, number of reversals.
    """
    work, n, links = workspace(tables, state, start.shape[0]), out.poses.shape[0], state.X.shape[0]
    before, probe, between = copied(state), copied(state), copied(state)
    code, at = evaluate(tables, modes, state, start, goal - start, sizes, work)
    s, reached, count = 0.0, 0, 0
    # sample by sample, each from the one before
    for i in range(n if code == codes.DONE else 0):
        to, last = i / max(1.0, n - 1.0), s
        copy_first(state, before)
        s, code, at = follow(tables, modes, state, start, goal, (s, to), sizes, work)
        if code != codes.DONE:
            break
        for link in range(links):
            for c in range(2):
                out.poses[i, link, c] = state.X[link, c, 0]
            theta = atan2(state.X[link, 3, 0], state.X[link, 2, 0])
            near = state.TH[link, 0] if tables.need_angle[link] else out.poses[max(i - 1, 0), link, 2]
            out.poses[i, link, 2] = nearest_turn(theta, near) if i > 0 or tables.need_angle[link] else theta
            for c in range(3):
                out.velocities[i, link, c] = scale * state.V[link, c, 0]
                out.accelerations[i, link, c] = scale * scale * state.W[link, c, 0]
        for k in range(state.M.shape[0]):
            out.margins[i, k] = state.M[k, 0]
        for k in range(watched.shape[0] if i > 0 and count < out.reversals.shape[0] else 0):
            own, middle = watched[k], last
            copy_first(before, between)
            # slower, then faster: it may reverse twice
            v, w = rate(before, own, 0), rate(state, own, 0)
            if v * w > 0.0 and v * rate(before, own, 1) < 0.0 and w * rate(state, own, 1) > 0.0:
                slow = reversal(tables, modes, before, probe, start, goal, (last, s), own, 1, sizes, work)
                if slow == slow:
                    _, failed, _ = follow(tables, modes, between, start, goal, (last, slow), sizes, work)
                    middle = slow if failed == codes.DONE else last
            # one reversal in each part where the speed changes its sign
            for part in range(2):
                low, high = (last, middle) if part == 0 else (middle, s)
                first, second = (before, between) if part == 0 else (between, state)
                if count == out.reversals.shape[0] or not rate(first, own, 0) * rate(second, own, 0) < 0.0:
                    continue
                where = reversal(tables, modes, first, probe, start, goal, (low, high), own, 0, sizes, work)
                if where == where:
                    out.reversals[count, 0], out.reversals[count, 1] = k, where
                    count += 1
        reached = i + 1
    out.poses[reached:], out.velocities[reached:], out.accelerations[reached:] = math.nan, math.nan, math.nan
    out.margins[reached:] = math.nan
    found[0], found[1], found[2], found[3], found[4] = reached, s, code, at, count


@kernel
def rate(state, coordinate, order):
    """Return the speed (order 0) or the acceleration (1) of a coordinate on the frame in sample 0."""
    V, link = (state.V if order == 0 else state.W), int(coordinate[0])
    if coordinate[1] == 0.0 and coordinate[2] == 0.0:
        return V[link, 2, 0]
    return coordinate[1] * V[link, 0, 0] + coordinate[2] * V[link, 1, 0]


@kernel
def reversal(tables, modes, before, probe, start, goal, span, coordinate, order, sizes, work):
    """Find s where a rate changes its sign between two samples, by the rule of false position [Dowell, Jarratt 1971].

    NaN where the branch does not reach, or the speed has a pole there.
    """
    low, high = span
    copy_first(before, probe)
    f_low, f_high, where = rate(probe, coordinate, order), math.nan, high
    first = abs(f_low)
    for trial in range(60):
        copy_first(before, probe)
        _, code, _ = follow(tables, modes, probe, start, goal, (span[0], where), sizes, work)
        if code != codes.DONE:
            return math.nan
        f = rate(probe, coordinate, order)
        if trial == 0:
            high, f_high, first = where, f, max(first, abs(f))
        elif f * f_high < 0.0:
            low, f_low, high, f_high = high, f_high, where, f
        else:
            f_low, high, f_high = f_low * f_high / (f_high + f), where, f
        if f == 0.0 or abs(high - low) <= 1e-14:
            break
        where = high - f_high * (high - low) / (f_high - f_low)
        if not min(low, high) < where < max(low, high):
            where = 0.5 * (low + high)
    return high if abs(f_high) <= 1e-3 * first else math.nan


# --- where a motion starts


@kernel
def driver_coordinates(drawn, poses, q):
    """Coordinates (drivers,) of the drivers at a pose (links, 3), turns as in its angles."""
    for k in range(q.shape[0]):
        joint, base = drawn.drivers[k, 0], drawn.drivers[k, 1]
        kind, a, b = drawn.joints[joint, 0], drawn.joints[joint, 1], drawn.joints[joint, 2]
        sense, p = 1.0 if base == a else -1.0, drawn.sizes[0, joint]
        q[k] = sense * (poses[b, 2] - poses[a, 2])
        if kind == outlines.PRISMATIC:
            ca, sa, cb, sb = cos(poses[a, 2]), sin(poses[a, 2]), cos(poses[b, 2]), sin(poses[b, 2])
            dx = poses[b, 0] + cb * p[3] - sb * p[4] - poses[a, 0] - ca * p[0] + sa * p[1]
            dy = poses[b, 1] + sb * p[3] + cb * p[4] - poses[a, 1] - sa * p[0] - ca * p[1]
            angle = poses[a, 2] + p[2]
            q[k] = sense * (cos(angle) * dx + sin(angle) * dy)


@kernel
def seed(tables, state, poses, phi):
    """Put a pose (links, 3) into all samples, and the directions of lines of centres into the first."""
    X, TH = state.X, state.TH
    for link in range(poses.shape[0]):
        x, y, theta = poses[link, 0], poses[link, 1], poses[link, 2]
        c, s = cos(theta), sin(theta)
        for i in range(SAMPLES):
            X[link, 0, i], X[link, 1, i], X[link, 2, i], X[link, 3, i], TH[link, i] = x, y, c, s, theta
    for k in range(phi.shape[0]):
        state.PHI[k, 0] = phi[k]


@kernel
def lines_of_centres(rows, row_table, poses, phi):
    """Directions ``phi`` of the lines of centres of the gear pairs among the rows at a pose (links, 3).

    A pose tells them modulo a turn; the turn is that with which the angles of the two wheels fit best.
    """
    slot = 0
    for r in range(rows.shape[0]):
        if rows[r, 0] != codes.GEAR:
            continue
        a, b, p = rows[r, 1], rows[r, 2], row_table[r]
        ca, sa, cb, sb = cos(poses[a, 2]), sin(poses[a, 2]), cos(poses[b, 2]), sin(poses[b, 2])
        dx = poses[b, 0] + cb * p[codes.PBX] - sb * p[codes.PBY] - poses[a, 0] - ca * p[codes.PAX] + sa * p[codes.PAY]
        dy = poses[b, 1] + sb * p[codes.PBX] + cb * p[codes.PBY] - poses[a, 1] - sa * p[codes.PAX] - ca * p[codes.PAY]
        raw, ra, rb = atan2(dy, dx), p[codes.RA], p[codes.SIGN] * p[codes.RB]
        left = ra * (poses[a, 2] - raw) + rb * (poses[b, 2] - raw - p[codes.H])
        phi[slot] = nearest_turn(raw, raw + left / (ra + rb))
        slot += 1


@kernel
def settle(tables, modes, state, q0, rate, poses, sizes):
    """Choose the modes (steps,) of dyads that lie closest to a pose (links, 3), and assemble near it.

    Sample 0 of the state becomes the pose at driver coordinates ``q0`` (drivers,), with derivatives by u where dq/du is
    ``rate``.  Returns the code of a failure and the step.
    """
    work, steps, phi = workspace(tables, state, q0.shape[0]), tables.steps, np.zeros(state.PHI.shape[0])
    lines_of_centres(tables.rows, tables.row_table[0], poses, phi)
    for k in range(steps.shape[0]):
        if steps[k, 0] not in codes.TWO_MODES:
            continue
        best, sign = math.inf, 1.0
        for trial in (1.0, -1.0):
            modes[k] = trial
            seed(tables, state, poses, phi)
            code, at = evaluate(tables, modes, state, q0, rate, sizes, work)
            apart = math.inf if code != codes.DONE and at <= k else apart_from(tables, k, state, poses, sizes[0])
            if apart < best:
                best, sign = apart, trial
        modes[k] = sign
    seed(tables, state, poses, phi)
    return evaluate(tables, modes, state, q0, rate, sizes, work)


@kernel
def apart_from(tables, k, state, poses, Lc):
    """Square of the distance of the links of step k in sample 0 from a pose."""
    total = 0.0
    for link in range(poses.shape[0]):
        if placing(tables, link) == k:
            X = state.X[link]
            dx, dy = (X[0, 0] - poses[link, 0]) / Lc, (X[1, 0] - poses[link, 1]) / Lc
            dc, ds = X[2, 0] - cos(poses[link, 2]), X[3, 0] - sin(poses[link, 2])
            total += dx * dx + dy * dy + dc * dc + ds * ds
    return total


@kernel
def instant_centres(X, V, centres):
    """Velocity poles (links, links, 2) of all pairs of links, from state arrays; NaN where the pair does not turn.

    The pole of two links is the point at which both have the same velocity.
    """
    for a in range(X.shape[0]):
        for b in range(X.shape[0]):
            # v + o J (p - r) is the same for both: o_ab J p = ...
            turn = V[a, 2, 0] - V[b, 2, 0]
            ux = V[a, 0, 0] + V[a, 2, 0] * X[a, 1, 0] - V[b, 0, 0] - V[b, 2, 0] * X[b, 1, 0]
            uy = V[a, 1, 0] - V[a, 2, 0] * X[a, 0, 0] - V[b, 1, 0] + V[b, 2, 0] * X[b, 0, 0]
            centres[a, b, 0], centres[a, b, 1] = -uy / turn, ux / turn
            if turn == 0.0:
                centres[a, b, 0], centres[a, b, 1] = math.nan, math.nan


@kernel
def point_motion(poses, velocities, accelerations, link, x, y, out):
    """Write place, velocity and acceleration of the point (x, y) of a link to ``out`` (n, 6), from (n, links, 3)."""
    for i in range(poses.shape[0]):
        c, s, w, e = cos(poses[i, link, 2]), sin(poses[i, link, 2]), velocities[i, link, 2], accelerations[i, link, 2]
        rx, ry = c * x - s * y, s * x + c * y
        out[i, 0], out[i, 1] = poses[i, link, 0] + rx, poses[i, link, 1] + ry
        out[i, 2], out[i, 3] = velocities[i, link, 0] - w * ry, velocities[i, link, 1] + w * rx
        out[i, 4] = accelerations[i, link, 0] - e * ry - w * w * rx
        out[i, 5] = accelerations[i, link, 1] + e * rx - w * w * ry
