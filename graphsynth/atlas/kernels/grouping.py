"""Structural groups of a mechanism as bit masks: assignment of constraints, dependence, strong components.

The method is that of :mod:`graphsynth.structure.assur`, for planar chains of mobility-1 joints whose drivers sit on the
frame: frame and driven links are one placed body, every other link is a body of its own.
"""

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.core.intrinsics import lowest_bit
from graphsynth.structure.kernels import ONE, ZERO

#: Constraints of a joint, and freedoms of a body, in the plane.
PER_JOINT, PER_BODY = 2, 3


@kernel
def fetch(to, ends, owner, free, came, stack):
    """Move a free place to body ``to`` by letting other bodies take over constraints; whether there was one."""
    seen = ONE << np.uint64(to)
    stack[0], top = to, 1
    while top > 0:
        top -= 1
        at = stack[top]
        for c in range(owner.shape[0]):
            if owner[c] != at:
                continue
            other = ends[c, 0] + ends[c, 1] - at
            if seen >> np.uint64(other) & ONE != ZERO:
                continue
            seen |= ONE << np.uint64(other)
            came[other] = c
            if free[other] > 0:
                free[other] -= 1
                while other != to:
                    c = came[other]
                    before = owner[c]
                    owner[c] = other
                    other = before
                free[to] += 1
                return True
            stack[top] = other
            top += 1
    return False


@kernel
def assign(joints, placed, base, ends, owner, free, came, stack):
    """Give every constraint to one of its two bodies, three to each; returns their number, or -1 if impossible."""
    count = 0
    for j in range(joints.shape[0]):
        a, b = joints[j, 0], joints[j, 1]
        a = base if placed >> np.uint64(a) & ONE != ZERO else a
        b = base if placed >> np.uint64(b) & ONE != ZERO else b
        if a == b:  # driven, or inside the placed body
            continue
        for _ in range(PER_JOINT):
            ends[count, 0], ends[count, 1], owner[count] = a, b, -1
            count += 1
    for c in range(count):
        a, b = ends[c, 0], ends[c, 1]
        if free[a] == 0 and free[b] == 0:
            taken = owner[:c]
            if not (fetch(a, ends, taken, free, came, stack) or fetch(b, ends, taken, free, came, stack)):
                return -1
        owner[c] = a if free[a] > 0 else b
        free[owner[c]] -= 1
    return count


@kernel
def groups_of(n, joints, placed, ends, owner, free, came, stack, reach, groups):
    """Write the groups as masks of links, in the order of assembly; returns their number, or -1 if there are none.

    ``n``: links, at most 64; ``joints`` integer[joints, 2]: planar, mobility 1; ``placed`` uint64: mask of the frame
    and the driven links; ``ends``, ``owner``, ``free``, ``came``, ``stack``, ``reach`` scratch: ``int64[2 joints,
    2]``, ``int64[2 joints]``, ``int64[n]`` (three times), ``uint64[n]``; ``groups`` (uint64[n], output).
    """
    base = np.int64(lowest_bit(placed))
    for v in range(n):
        free[v] = 0 if placed >> np.uint64(v) & ONE != ZERO else PER_BODY
        reach[v] = ONE << np.uint64(v)
    count = assign(joints, placed, base, ends, owner, free, came, stack)
    if count < 0:
        return -1
    for v in range(n):
        if free[v] > 0:
            return -1
    for c in range(count):
        reach[owner[c]] |= ONE << np.uint64(ends[c, 0]) | ONE << np.uint64(ends[c, 1])
    for k in range(n):
        for v in range(n):
            if reach[v] >> np.uint64(k) & ONE != ZERO:
                reach[v] |= reach[k]
    return order_groups(n, placed, base, reach, groups)


@kernel
def order_groups(n, placed, base, reach, groups):
    """Strong components of the dependence, each after those it hangs on; of several the one with the smallest link."""
    done = placed
    known = ONE << np.uint64(base)
    everything = (ONE << np.uint64(n)) - ONE
    found = 0
    while done != everything:
        for v in range(n):
            if done >> np.uint64(v) & ONE != ZERO:
                continue
            group = ZERO
            for w in range(n):
                if reach[v] >> np.uint64(w) & reach[w] >> np.uint64(v) & ONE != ZERO:
                    group |= ONE << np.uint64(w)
            if reach[v] & ~(group | known) == ZERO:
                groups[found] = group
                found += 1
                done |= group
                known |= group
                break
    return found
