"""Bounds of the factor over a moving box: from loads in equilibrium below, from tilts that close all loops above.

Both begin with floats of `sharing` at the middle, which need not be right, and are those of
`graphsynth.jamming.joints.enclosure` for sharp dimensions.  Work and tilts are lines in the input and a cost is convex
in it, so quotients are bounded at both ends of a box: what changes in proportion costs nothing.
"""

from collections import namedtuple

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels import arithmetic as ia
from graphsynth.intervals.kernels.krawczyk import invert
from graphsynth.intervals.kernels.nearest import hypot
from graphsynth.intervals.kernels.pairs import minus, plus, size, thin, times
from graphsynth.intervals.kernels.rounding import add_up, divide_both, multiply_both
from graphsynth.jamming.joints.kernels.moving import (
    DX,
    DY,
    EX,
    EY,
    RX,
    RY,
    at_end,
    close,
    difference,
    line,
    over,
    product,
    scaled,
    sum_of,
)
from graphsynth.jamming.joints.kernels.sharing import Seats, rows_of, share_pose

#: Share in which a joint that is used up may still tilt further; rounds of an enclosed solve.
STIFF, ROUNDS = 1e-3, 3
#: Numbers of this size and more are no numbers here: no product of a few of them may overflow.
LARGE = 1e50

#: A sharing in floats: loads ``y`` (3 loops,), tilts and slips ``q`` (joints, 3, 2) with their slopes, and for every
#: sum of the loops changes of them, ``ways`` (3 loops, joints, 3, 2), whose slopes are zero.
Sharing = namedtuple("Sharing", "y q ways")

#: What exact tilts change: additions to the closure of lifts (loops,), limits from outside and inside (joints, 3).
More = namedtuple("More", "lift wide narrow")


@kernel
def middle_of(a):
    """Middle of the value of a line."""
    return 0.5 * (a[0] + a[1])


@kernel
def choose(asked, seen, h, sharing):
    """Choose a sharing in floats at the middle, and how it follows the input; False where none is found."""
    joints, n = asked.pairs.shape[0], sharing.y.shape[0]
    at, M, W = np.zeros((joints, 8)), np.zeros((3 * joints, 2, n)), np.zeros(n)
    tau, limits = np.zeros((3 * joints, 2)), asked.limits.copy()
    largest, lean = 0.0, 0.0
    # in units: the largest limit, the largest misalignment
    for k in range(joints):
        for c in range(6):
            at[k, c] = middle_of(seen.at[k, c])
        at[k, 6], at[k, 7] = at[k, 0], at[k, 1]
        largest, lean = max(largest, limits[k, 0], limits[k, 1]), max(lean, hypot(at[k, 4], at[k, 5]))
    scale = largest if largest > 0.0 else 1.0
    lean = lean if lean > 0.0 else 1.0
    for k in range(joints):
        limits[k, 0], limits[k, 1], limits[k, 2] = (
            limits[k, 0] / scale,
            limits[k, 1] / scale,
            limits[k, 2] * seen.unit[2] / scale,
        )
        at[k, 4], at[k, 5] = at[k, 4] / lean, at[k, 5] / lean
    own = Seats(asked.pairs, asked.guided, asked.sizes, limits, asked.tilts)
    count = rows_of(own, asked.incidence, at, M, W)
    sharing.q[:] = 0.0
    sharing.y[:] = 0.0
    if count > 0:
        share_pose(M[:count], W, sharing.y, tau)
    # tilts of the cones back to joints
    count = 0
    for k in range(joints):
        for part in range(3):
            if not limits[k, part] > 0.0 or (part == 1 and not asked.guided[k]):
                continue
            own_limit = limits[k, part] * lean
            if part == 0 and not asked.guided[k]:
                sharing.q[k, 0, 0], sharing.q[k, 1, 0] = tau[count, 0] * own_limit, tau[count, 1] * own_limit
            else:
                sharing.q[k, part, 0] = tau[count, 0] * own_limit
            count += 1
    for i in range(n):  # any load is one, but no number must be none
        if not abs(sharing.y[i]) < LARGE:
            sharing.y[:] = 0.0
    for k in range(joints):
        for part in range(3):
            if not abs(sharing.q[k, part, 0]) < LARGE:
                return False
    return find_ways(asked, limits, at, sharing) and follow(asked, seen, h, sharing)


@kernel
def find_ways(asked, limits, at, sharing):
    """Write the changes that may correct each sum of the loops, in proportion to the squares of the limits.

    As `graphsynth.jamming.joints.enclosure._directions`; ``limits`` in units.
    """
    joints, n, q, ways = at.shape[0], sharing.y.shape[0], sharing.q, sharing.ways
    rows, free = np.zeros((joints, 3, n)), np.zeros((joints, 3, n))
    used, most = np.zeros((joints, 3)), 1e-300
    for k in range(joints):
        for part in range(3):
            lean = hypot(q[k, 0, 0], q[k, 1, 0]) if part == 0 and not asked.guided[k] else abs(q[k, part, 0])
            if limits[k, part] > 0.0:
                used[k, part] = lean / limits[k, part]
            most = max(most, used[k, part])
    # what a tilt or slip adds to the sums, and how freely it may change
    for k in range(joints):
        rx, ry, ex, ey = at[k, 0], at[k, 1], at[k, 2], at[k, 3]
        for loop in range(asked.incidence.shape[0]):
            sign, j = asked.incidence[loop, k], 3 * loop
            rows[k, 0, j], rows[k, 0, j + 1], rows[k, 0, j + 2] = sign * ex, sign * ey, sign * (rx * ey - ry * ex)
            rows[k, 1, j], rows[k, 1, j + 1], rows[k, 1, j + 2] = -sign * ey, sign * ex, sign * (rx * ex + ry * ey)
            rows[k, 2, j + 2] = sign
        for part in range(3):
            weight = limits[k, part] ** 2
            room = min(1.0, max(STIFF, 4.0 - 4.0 * used[k, part] / most))
            if not asked.guided[k] and part < 2:
                # the whole vector turns rather than that it becomes longer
                weight, room = limits[k, 0] ** 2, min(1.0, max(STIFF, 4.0 - 4.0 * used[k, 0] / most))
                length = hypot(q[k, 0, 0], q[k, 1, 0])
                if length > 0.0:
                    u, v = q[k, 0, 0] / length, q[k, 1, 0] / length
                    own = u if part == 0 else v
                    for j in range(n):
                        along = (1.0 - room) * (u * rows[k, 0, j] + v * rows[k, 1, j])
                        free[k, part, j] = weight * (rows[k, part, j] - own * along)
                    continue
                room = 1.0
            for j in range(n):
                free[k, part, j] = weight * room * rows[k, part, j]
    # one change for every sum alone
    effect, inverse = np.zeros((n, n)), np.zeros((n, n))
    for k in range(joints):
        for part in range(3):
            for i in range(n):
                for j in range(n):
                    effect[i, j] += rows[k, part, i] * free[k, part, j]
    if not invert(effect, inverse):
        return False
    ways[:] = 0.0
    for c in range(n):
        for k in range(joints):
            for part in range(3):
                for j in range(n):
                    ways[c, k, part, 0] += free[k, part, j] * inverse[j, c]
                if not abs(ways[c, k, part, 0]) < LARGE:
                    return False
    return True


@kernel
def follow(asked, seen, h, sharing):
    """Write the slopes of the sharing: all tilts in proportion to the factor, and what the closure needs besides."""
    n, y, q = sharing.y.shape[0], sharing.y, sharing.q
    close(asked, q, True, h, seen)
    change, held = np.zeros(n), np.zeros(n)
    for i in range(n):
        change[i] = 0.5 * (seen.sums[i, 2] + seen.sums[i, 3])
    close(asked, q, False, h, seen)
    given = lost = 0.0
    for i in range(n):
        held[i] = middle_of(seen.sums[i])
        given, lost = given + held[i] * y[i], lost + change[i] * y[i]
    rate = -lost / given if given != 0.0 else 0.0
    rate = rate if abs(rate) * h < 1.0 else 0.0
    for k in range(q.shape[0]):
        for part in range(3):
            total = rate * q[k, part, 0]
            for i in range(n):
                total -= sharing.ways[i, k, part, 0] * (change[i] + rate * held[i])
            q[k, part, 1] = total if abs(total) < LARGE else 0.0
    return True


@kernel
def load_of(asked, y, k, c):
    """Component c of the load of a joint: the sum of the loops through it."""
    total = thin(0.0)
    for loop in range(asked.incidence.shape[0]):
        sign, own = asked.incidence[loop, k], thin(y[3 * loop + c])
        if sign > 0.0:
            total = plus(total, own)
        elif sign < 0.0:
            total = minus(total, own)
    return total


@kernel
def length_of(x, y):
    """Largest length of a vector of intervals."""
    square = plus(ia.square(x[0], x[1]), ia.square(y[0], y[1]))
    return ia.root(square[0], square[1])[1]


@kernel
def lower_bound(asked, seen, h, y, more):
    """Lower bound of the factor for every member; 0 where nothing is proved.  ``y`` may be any numbers.

    ``more.wide`` are the limits that count.
    """
    work = thin(0.0), thin(0.0)
    low, high = thin(0.0), thin(0.0)  # costs at both ends
    for k in range(asked.pairs.shape[0]):
        at = seen.at[k]
        wx, wy, f = load_of(asked, y, k, 0), load_of(asked, y, k, 1), load_of(asked, y, k, 2)
        mx = difference((wx, thin(0.0)), scaled(line(at[RY]), f))
        my = sum_of((wy, thin(0.0)), scaled(line(at[RX]), f))
        if asked.tilts[k, 4] != 0.0:
            work = sum_of(work, sum_of(product(mx, line(at[DX]), h), product(my, line(at[DY]), h)))
        slip = multiply_both(size(f), more.wide[k, 2])[1]
        slip = multiply_both(slip, seen.unit[2])[1]
        for side in range(2):
            t = h if side else -h
            cost = thin(slip)
            if asked.guided[k]:
                along = sum_of(product(mx, line(at[EX]), h), product(my, line(at[EY]), h))
                across = difference(product(my, line(at[EX]), h), product(mx, line(at[EY]), h))
                cost = plus(cost, times(thin(size(at_end(along, t))), thin(more.wide[k, 0])))
                cost = plus(cost, times(thin(size(at_end(across, t))), thin(more.wide[k, 1])))
            else:
                cost = plus(cost, times(thin(length_of(at_end(mx, t), at_end(my, t))), thin(more.wide[k, 0])))
            low, high = (low, plus(high, cost)) if side else (plus(low, cost), high)
    for loop in range(asked.incidence.shape[0]):
        rest = multiply_both(multiply_both(abs(y[3 * loop + 2]), more.lift[loop])[1], seen.unit[2])[1]
        low, high = plus(low, thin(rest)), plus(high, thin(rest))
    # the work keeps its sign; then the smaller quotient of both ends is a bound between them
    first, last, whole = at_end(work, -h), at_end(work, h), over(work, h)
    if not (whole[0] > 0.0 or whole[1] < 0.0):
        return 0.0
    if whole[1] < 0.0:
        first, last = (-first[1], -first[0]), (-last[1], -last[0])
    return min(quotient(first[0], low[1]), quotient(last[0], high[1]))


@kernel
def quotient(work, cost):
    """Lower bound of a quotient of bounds; infinite if nothing costs, 0 where nothing is known."""
    if not (0.0 < work < np.inf) or not cost >= 0.0:
        return 0.0
    return divide_both(work, cost)[0] if cost > 0.0 else np.inf


@kernel
def solve_near_one(A, b, bound):
    """Bound |x| for all solutions of ``A x = b``, A (n, n, 2) near 1; False where a matrix may be singular."""
    n = b.shape[0]
    rest, weight, guess = np.empty((n, n)), np.empty(n), 1e-300
    for i in range(n):
        guess = max(guess, b[i])
        for j in range(n):
            rest[i, j] = size(minus(thin(1.0 if i == j else 0.0), (A[i, j, 0], A[i, j, 1])))
    for i in range(n):
        weight[i] = b[i] + 1e-3 * guess
    start = weight.copy()
    for _ in range(6):
        last = weight.copy()
        for i in range(n):
            weight[i] = start[i]
            for j in range(n):
                weight[i] += rest[i, j] * last[j]
    norm = largest = 0.0
    for i in range(n):
        if not 0.0 < weight[i] < np.inf:
            return False
        total = 0.0
        for j in range(n):
            total = add_up(total, multiply_both(rest[i, j], weight[j])[1])
        norm, largest = max(norm, divide_both(total, weight[i])[1]), max(largest, divide_both(b[i], weight[i])[1])
    if not (norm < 1.0 and largest < np.inf):
        return False
    factor = divide_both(largest, -add_up(norm, -1.0))[1]
    for i in range(n):
        bound[i] = multiply_both(weight[i], factor)[1]
    for _ in range(ROUNDS):  # any solution obeys |x| <= |b| + |rest| |x|
        for i in range(n):
            total = b[i]
            for j in range(n):
                total = add_up(total, multiply_both(rest[i, j], bound[j])[1])
            bound[i] = min(bound[i], total)
    return True


@kernel
def upper_bound(asked, seen, h, sharing, more):
    """Upper bound of the factor for every member, or infinity.  ``more.narrow`` are the limits that count."""
    n, joints = sharing.y.shape[0], asked.pairs.shape[0]
    off, A, step = np.empty(n), np.empty((n, n, 2)), np.zeros(n)
    # what the loops miss, exact tilts included
    close(asked, sharing.q, True, h, seen)
    for i in range(n):
        off[i] = size(over(line(seen.sums[i]), h))
        if i % 3 == 2:
            off[i] = add_up(off[i], multiply_both(more.lift[i // 3], seen.unit[2])[1])
        if not off[i] < np.inf:
            return np.inf
    for c in range(n):
        close(asked, sharing.ways[c], False, h, seen)
        for i in range(n):
            A[i, c, 0], A[i, c, 1] = over(line(seen.sums[i]), h)
            if not A[i, c, 0] <= A[i, c, 1]:
                return np.inf
    # what takes the rest of the closure away for every member, and the tilts with it
    if not solve_near_one(A, off, step):
        return np.inf
    # tilts and slips at both ends, over their limits
    worst, own = 0.0, np.empty((3, 2, 2))
    for k in range(joints):
        for part in range(3):
            ahead = thin(0.0)
            for c in range(n):
                ahead = plus(ahead, times(thin(sharing.ways[c, k, part, 0]), (-step[c], step[c])))
            for side in range(2):
                t = h if side else -h
                here = plus(thin(sharing.q[k, part, 0]), times(thin(sharing.q[k, part, 1]), thin(t)))
                own[part, side, 0], own[part, side, 1] = plus(here, ahead)
        for side in range(2):
            x, y, z = own[0, side], own[1, side], own[2, side]
            tilt = max(-x[0], x[1])
            if asked.guided[k]:
                worst = max(worst, ratio(max(-y[0], y[1]), more.narrow[k, 1]))
            else:
                tilt = length_of((x[0], x[1]), (y[0], y[1]))
            worst = max(worst, ratio(tilt, more.narrow[k, 0]))
            slip = divide_both(max(-z[0], z[1]), seen.unit[2])[1]
            worst = max(worst, ratio(slip, more.narrow[k, 2]))
    return worst


@kernel
def ratio(amount, limit):
    """Upper bound of an amount over its limit; a rigid joint has neither."""
    if amount == 0.0:
        return 0.0
    return divide_both(amount, limit)[1] if limit > 0.0 and amount < np.inf else np.inf


@kernel
def new_sharing(joints, loops):
    """Make room for a sharing."""
    return Sharing(np.zeros(3 * loops), np.zeros((joints, 3, 2)), np.zeros((3 * loops, joints, 3, 2)))
