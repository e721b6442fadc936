"""How joints share misaligned axes at one pose after another, for a page on which a mechanism is dragged.

Small tilts, loop form, as in `graphsynth.jamming.joints.program`, for limits that are finite; estimated, with a lower
bound from equilibrium and an upper one from closure.
"""

from collections import namedtuple

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels.nearest import atan2, cos, hypot, sin
from graphsynth.jamming.joints.kernels.cones import bounds_of, solve_cones
from graphsynth.kinematics.engine.kernels.rows import world

#: Columns of the numbers of a joint, as in the planning kernels.
AX, AY, A_ANGLE, BX, BY = 0, 1, 2, 3, 4
#: Singular values below the first are none; rounds of turns at most.
RANK, SWEEPS = 1e-11, 30

#: What is misaligned and limited: ``pairs`` (joints, 2) bodies a and b; ``guided`` (joints,): 1 with roll and pitch, 0
#: with one limit in all directions; ``sizes`` (joints, 10); ``limits`` (joints, 3): tilt or roll, pitch, end float;
#: ``tilts`` (joints, 3): misalignment in the frame of a link, and that link: 1 for a, -1 for b.
Seats = namedtuple("Seats", "pairs guided sizes limits tilts")


@kernel
def critical_tilt(radius, half, clearance, slanted):
    """Tilt at which a bearing in a hole touches, NaN if it never does: as in `graphsynth.jamming.bearing.bearing`.

    ``half`` is half its height (condition A), or with ``slanted`` half the length of the hole (B).
    """
    slack = clearance * (2.0 * radius + clearance)
    room = half * half + slack if slanted else half * half - slack
    if room < 0.0 or not half + room > 0.0:
        return np.nan
    return 2.0 * atan2(clearance, half + np.sqrt(room))


@kernel
def loops(pairs, bodies, frame, incidence):
    """Write fundamental loops (loops, joints): +1 where one passes a joint from a to b, -1 back; returns their number.

    A breadth-first tree from the frame, and from every part that it does not reach.
    """
    joints, count = pairs.shape[0], 0
    up, sign = np.full(bodies, -2, np.int64), np.zeros(bodies)
    tree, queue = np.zeros(joints, np.bool_), np.empty(bodies, np.int64)
    for start in range(-1, bodies):
        root = frame if start < 0 else start
        if up[root] != -2:
            continue
        up[root], queue[0] = -1, root
        head, tail = 0, 1
        while head < tail:
            body = queue[head]
            head += 1
            for k in range(joints):
                for side in range(2):
                    there = pairs[k, 1 - side]
                    if pairs[k, side] == body and up[there] == -2:
                        up[there], sign[there], tree[k] = k, 1.0 - 2.0 * side, True
                        queue[tail] = there
                        tail += 1
    for k in range(joints):
        if tree[k]:
            continue
        for j in range(joints):
            incidence[count, j] = 0.0
        incidence[count, k] = 1.0
        for side in range(2):  # down the tree to a, through the joint, and up from b
            body = pairs[k, side]
            while up[body] >= 0:
                j = up[body]
                incidence[count, j] += (1.0 - 2.0 * side) * sign[body]
                body = pairs[j, 0] + pairs[j, 1] - body
        count += 1
    return count


@kernel
def lean(seats, x, k, out):
    """Write of joint k: its place, the direction of its guide, its misalignment, the point it leans about (8,)."""
    a, b, p = seats.pairs[k, 0], seats.pairs[k, 1], seats.sizes[k]
    out[6], out[7] = world(x, a, p[AX], p[AY])
    if seats.guided[k]:
        out[0], out[1] = world(x, b, p[BX], p[BY])
        c, s = cos(p[A_ANGLE]), sin(p[A_ANGLE])
        out[2], out[3] = x[a, 2] * c - x[a, 3] * s, x[a, 3] * c + x[a, 2] * s
    else:
        out[0], out[1], out[2], out[3] = out[6], out[7], 1.0, 0.0
    u, v, side = seats.tilts[k, 0], seats.tilts[k, 1], seats.tilts[k, 2]
    base = a if side > 0.0 else b
    out[4], out[5] = side * (x[base, 2] * u - x[base, 3] * v), side * (x[base, 3] * u + x[base, 2] * v)
    if not (seats.guided[k] and side > 0.0):  # only a rail leans about its own point
        out[6], out[7] = out[0], out[1]


@kernel
def rows_of(seats, incidence, at, M, W):
    """Write moments (cones, 2, 3 loops), forces times end floats as further cones, and the work (3 loops,) of a pose.

    ``at`` (joints, 8) as `lean` tells them, in units.  Only what costs something has a cone: tilt or roll, pitch, end
    float of every joint, as far as they are above zero; returns how many there are.
    """
    joints, count = at.shape[0], 0
    for j in range(W.shape[0]):
        W[j] = 0.0
    for k in range(joints):
        rx, ry, ex, ey = at[k, 0], at[k, 1], at[k, 2], at[k, 3]
        u, v, px, py = at[k, 4], at[k, 5], at[k, 6], at[k, 7]
        for part in range(3):
            limit = seats.limits[k, part]
            if not limit > 0.0 or (part == 1 and not seats.guided[k]):
                continue
            for loop in range(incidence.shape[0]):
                through, j = incidence[loop, k] * limit, 3 * loop
                for i in range(3):
                    M[count, 0, j + i] = M[count, 1, j + i] = 0.0
                if part == 2:
                    M[count, 0, j + 2] = through
                elif not seats.guided[k]:
                    M[count, 0, j], M[count, 0, j + 2] = through, -through * ry
                    M[count, 1, j + 1], M[count, 1, j + 2] = through, through * rx
                else:  # along the guide, or across
                    c, s = (ex, ey) if part == 0 else (-ey, ex)
                    M[count, 0, j], M[count, 0, j + 1] = c * through, s * through
                    M[count, 0, j + 2] = (s * rx - c * ry) * through
            count += 1
        for loop in range(incidence.shape[0]):
            through, j = incidence[loop, k], 3 * loop
            W[j] += through * u
            W[j + 1] += through * v
            W[j + 2] += through * (v * px - u * py)
    return count


@kernel
def principal(A, V):
    """Turn columns of A (m, k) until they are at right angles, two at a time; V (k, k) collects the turns.

    Then A holds them with their lengths, the singular values, in no order (Jacobi's method on one side).
    """
    m, k = A.shape
    for i in range(k):
        for j in range(k):
            V[i, j] = 1.0 if i == j else 0.0
    for _ in range(SWEEPS):
        turned = False
        for i in range(k):
            for j in range(i + 1, k):
                a = b = c = 0.0
                for r in range(m):
                    a += A[r, i] * A[r, i]
                    b += A[r, j] * A[r, j]
                    c += A[r, i] * A[r, j]
                if not abs(c) > 1e-15 * np.sqrt(a * b):
                    continue
                turned = True
                zeta = (b - a) / (2.0 * c)
                t = (1.0 if zeta >= 0.0 else -1.0) / (abs(zeta) + np.sqrt(1.0 + zeta * zeta))
                cosine = 1.0 / np.sqrt(1.0 + t * t)
                rotate(A, i, j, cosine, cosine * t)
                rotate(V, i, j, cosine, cosine * t)
        if not turned:
            break


@kernel
def rotate(A, i, j, c, s):
    """Turn two columns."""
    for r in range(A.shape[0]):
        A[r, i], A[r, j] = c * A[r, i] - s * A[r, j], s * A[r, i] + c * A[r, j]


@kernel
def share_pose(M, W, q, tau):
    """Least factor on all limits at which the loops close: lower and upper bound, infinite if none is enough.

    M (cones, 2, n), W (n,); to ``q`` (n,) goes the load that proves the first, to ``tau`` (cones, 2) the tilts of the
    second, both in units.
    """
    cones, n = M.shape[0], W.shape[0]
    # loads with their costs at right angles to each other
    stacked, V, size = np.zeros((2 * cones, n)), np.empty((n, n)), np.sqrt(np.sum(W * W))
    for i in range(n):
        q[i] = 0.0
    for c in range(cones):
        tau[c, 0] = tau[c, 1] = 0.0
        for r in range(2):
            for j in range(n):
                stacked[2 * c + r, j] = M[c, r, j]
    if not size > 0.0:
        return 0.0, 0.0
    principal(stacked, V)
    order, k = np.empty(n, np.int64), 0
    for j in range(n):
        length, work = 0.0, 0.0
        for r in range(2 * cones):
            length += stacked[r, j] * stacked[r, j]
        for i in range(n):
            work += V[i, j] * W[i]
        if length > RANK * RANK:
            order[k] = j
            k += 1
        elif abs(work) > 1e-12 * size:  # a load that costs nothing and does work
            for i in range(n):
                q[i] = V[i, j]
            return np.inf, np.inf
    # the program on the loads that cost something, with work of the order of 1
    own, part, load = np.empty((cones, 2, k)), np.empty(k), np.zeros(k)
    for j in range(k):
        part[j] = 0.0
        for i in range(n):
            part[j] += V[i, order[j]] * W[i] / size
        for c in range(cones):
            own[c, 0, j], own[c, 1, j] = stacked[2 * c, order[j]], stacked[2 * c + 1, order[j]]
    solve_cones(own, cones, part, load, tau)
    lower, upper = bounds_of(own, part, load, tau)
    for i in range(n):
        for j in range(k):
            q[i] += V[i, order[j]] * load[j]
    for c in range(cones):
        tau[c, 0], tau[c, 1] = tau[c, 0] * size, tau[c, 1] * size
    return lower * size, upper * size


@kernel
def share(seats, incidence, poses, factors, used, price):
    """Least factor on all limits, end floats too, with which poses (n, links, 3) can be assembled (small tilts).

    To ``factors`` (n, 2) go a lower and an upper bound (estimated: rounding only), infinite if none is enough; to
    ``used`` and ``price`` (n, joints, 3), for tilt or roll, pitch and end float of every joint, the part of the limit
    at that factor that is used, and the relative fall of the factor per relative growth of the limit.
    """
    joints, links, n = seats.pairs.shape[0], poses.shape[1], 3 * incidence.shape[0]
    x, at = np.empty((links, 4)), np.empty((joints, 8))
    M, W, q, tau = np.zeros((3 * joints, 2, n)), np.empty(n), np.empty(n), np.empty((3 * joints, 2))
    # units: the largest limit, the largest misalignment
    unit = tilt = 0.0
    for k in range(joints):
        unit = max(unit, seats.limits[k, 0], seats.limits[k, 1])
        tilt = max(tilt, hypot(seats.tilts[k, 0], seats.tilts[k, 1]))
    for s in range(poses.shape[0]):
        for link in range(links):
            x[link, 0], x[link, 1] = poses[s, link, 0], poses[s, link, 1]
            x[link, 2], x[link, 3] = cos(poses[s, link, 2]), sin(poses[s, link, 2])
        for k in range(joints):
            lean(seats, x, k, at[k])
        length = centre(at)
        own = Seats(seats.pairs, seats.guided, seats.sizes, seats.limits.copy(), seats.tilts)
        scale = unit if unit > 0.0 else length
        for k in range(joints):
            own.limits[k, 0] /= scale
            own.limits[k, 1] /= scale
            own.limits[k, 2] /= scale * length
            at[k, 4] /= tilt if tilt > 0.0 else 1.0
            at[k, 5] /= tilt if tilt > 0.0 else 1.0
            for part in range(3):
                used[s, k, part] = price[s, k, part] = 0.0
        count = rows_of(own, incidence, at, M, W)
        lower, upper = share_pose(M[:count], W, q, tau)
        factors[s, 0], factors[s, 1] = lower * tilt / scale, upper * tilt / scale
        report(own, M[:count], q, tau, upper, used[s], price[s])


@kernel
def centre(at):
    """Measure places from their middle, in units of their reach, which is returned."""
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for k in range(at.shape[0]):
        for c in (0, 1, 6, 7):
            i = c & 1
            low[i], high[i] = min(low[i], at[k, c]), max(high[i], at[k, c])
    length = max(0.5 * (high[0] - low[0]), 0.5 * (high[1] - low[1]))
    length = length if length > 0.0 else 1.0
    for k in range(at.shape[0]):
        for c in (0, 1, 6, 7):
            i = c & 1
            at[k, c] = (at[k, c] - 0.5 * (low[i] + high[i])) / length
    return length


@kernel
def report(seats, M, q, tau, upper, used, price):
    """Write for every limit how much of it is used, and its price."""
    count, total = 0, 0.0
    for k in range(used.shape[0]):
        for part in range(3):
            if not seats.limits[k, part] > 0.0 or (part == 1 and not seats.guided[k]):
                continue
            a = b = 0.0
            for j in range(q.shape[0]):
                a += M[count, 0, j] * q[j]
                b += M[count, 1, j] * q[j]
            price[k, part] = hypot(a, b)
            total += price[k, part]
            if 0.0 < upper < np.inf:
                used[k, part] = hypot(tau[count, 0], tau[count, 1]) / upper
            count += 1
    for k in range(used.shape[0]):
        for part in range(3):
            price[k, part] = price[k, part] / total if total > 0.0 else 0.0
