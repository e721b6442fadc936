"""Assembly modes counted over sets of links: kernels of `graphsynth.structure.modes`.

Loops close where the unit vectors x of the links lie in a linear space, and their inverses y in another one of the same
matroid; solutions are counted by cutting the links into those that become large and those that become small, which
leaves two smaller questions of the same kind (theory/assembly-modes).  A question is three sets of links: those that
are left, those that are contracted in x, and those that are contracted in y; the others are left out.
"""

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.core.intrinsics import popcount

#: Links, at most: three sets in one key.
MOST = 20


@kernel
def fill_ranks(links, link, pin, ranks):
    """Rank of every set of links in the matroid of their unit vectors, (2^links,).

    Link ``link[k]`` (incidences,) holds pin ``pin[k]``; pins are numbered from 0.
    """
    full = (1 << links) - 1
    points = links
    for k in range(pin.shape[0]):
        points = max(points, links + pin[k] + 1)
    parent = np.empty(points, np.int64)
    # what a set adds to the equations of loops, if nothing but its pins restrains it: its incidences in the cographic
    # matroid of links and pins, which is their number less the pieces into which the rest falls without them
    for chosen in range(full + 1):
        for v in range(points):
            parent[v] = v
        pieces, star = points, 0
        for k in range(link.shape[0]):
            if chosen >> link[k] & 1:
                star += 1
                continue
            x, y = link[k], links + pin[k]
            while parent[x] != x:
                x = parent[x]
            while parent[y] != y:
                y = parent[y]
            if x != y:
                parent[x] = y
                pieces -= 1
        ranks[chosen] = star - (pieces - 1)
    # each link adds one vector at most, a general one of what its incidences span
    for chosen in range(1, full + 1):
        rest = chosen
        while rest:
            low = rest & -rest
            rest ^= low
            ranks[chosen] = min(ranks[chosen], ranks[chosen ^ low] + 1)
    # the unit vectors that satisfy the equations: the dual matroid
    whole = ranks[full]
    for chosen in range((full + 1) // 2):
        other = full ^ chosen
        a, b = ranks[chosen], ranks[other]
        ranks[chosen] = popcount(np.uint64(chosen)) - whole + b
        ranks[other] = popcount(np.uint64(other)) - whole + a


@kernel
def _reduced(ranks, full, left, one, two):
    """Leave out links that only one of the spaces restrains not at all; (0, 0, 0) if neither restrains one."""
    again = True
    while again and left & (left - 1):
        again = False
        rest = left
        while rest and not again:
            low = rest & -rest
            rest ^= low
            free = ranks[(left ^ low) | one] < ranks[left | one]
            if free & (ranks[(left ^ low) | two] < ranks[left | two]):
                return 0, 0, 0
            if free | (ranks[(left ^ low) | two] < ranks[left | two]):
                left ^= low
                again = True
    closed_one, closed_two = 0, 0
    rest = full ^ left
    while rest:  # what is contracted, as far as it reaches: equal questions get equal keys
        low = rest & -rest
        rest ^= low
        if ranks[one | low] == ranks[one]:
            closed_one |= low
        if ranks[two | low] == ranks[two]:
            closed_two |= low
    return left, closed_one, closed_two


@kernel
def _known(keys, counts, left, one, two):
    """Place of a question among the keys and its answer, -1 if it is not known."""
    if left & (left - 1) == 0:
        return -1, np.int64(left != 0)
    key = left | one << MOST | two << 2 * MOST
    mask = keys.shape[0] - 1
    at = (key * 0x9E3779B97F4A7C1 >> 17) & mask
    while keys[at] != 0:
        if keys[at] == key:
            return at, counts[at]
        at = (at + 1) & mask
    return at, np.int64(-1)


@kernel
def _is_flat(ranks, within, base, others):
    """Whether each of the other links raises the rank of a set beyond what is contracted."""
    rank = ranks[within | base]
    while others:
        low = others & -others
        others ^= low
        if ranks[within | low | base] == rank:
            return False
    return True


@kernel
def _fits(ranks, left, one, two, large, small):
    """Whether a cut leaves two questions with as many equations as unknowns, and no link of length zero in either."""
    kept, other = small & ~large, large & ~small
    rank_one = ranks[large | one]
    rank_two = ranks[small | two]
    if kept and ranks[left | one] - rank_one + ranks[kept | two] - ranks[two] != popcount(np.uint64(kept)) + 1:
        return False
    if other and ranks[other | one] - ranks[one] + ranks[left | two] - rank_two != popcount(np.uint64(other)) + 1:
        return False
    return _is_flat(ranks, large, one, kept) and _is_flat(ranks, small, two, other)


@kernel
def _wait(stack, at, left, one, two):
    """Put a question on the stack, before its first cut."""
    stack[at, 0], stack[at, 1], stack[at, 2], stack[at, 3], stack[at, 4] = left, one, two, 0, 0


@kernel
def count_modes(links, ranks, left, one, two, keys, counts, stack):
    """Return the number of assembly modes; -1 where keys (a power of two) are too few, 0 if none or infinitely many.

    ``left, one, two``: the question, all links and (0, 0) for a structure.  ``stack`` (links + 1, 5): questions that
    wait for smaller ones, with the next cut and the sum so far.
    """
    full = (1 << links) - 1
    rest = left
    while rest:
        low = rest & -rest
        rest ^= low
        if ranks[one | low] == ranks[one] or ranks[two | low] == ranks[two]:
            return np.int64(0)
    if ranks[left | one] - ranks[one] + ranks[left | two] - ranks[two] != popcount(np.uint64(left)) + 1:
        return np.int64(0)
    keys[:] = 0
    left, one, two = _reduced(ranks, full, left, one, two)
    at, found = _known(keys, counts, left, one, two)
    if found >= 0:
        return found
    top, known = 0, 0
    _wait(stack, 0, left, one, two)
    while top >= 0:
        left, one, two = stack[top, 0], stack[top, 1], stack[top, 2]
        cut, total = stack[top, 3], stack[top, 4]
        fixed = left & -left  # the link of the cut, large and small at once
        waits = False
        while not waits:
            large, small = cut | fixed, left ^ cut
            if _fits(ranks, left, one, two, large, small):
                product = np.int64(1)
                for side in range(2):
                    if side == 0 and small != fixed:
                        question = _reduced(ranks, full, small ^ fixed, one | large, two)
                    elif side == 1 and cut:
                        question = _reduced(ranks, full, cut, one, two | small)
                    else:
                        continue
                    at, found = _known(keys, counts, question[0], question[1], question[2])
                    if found < 0:  # the smaller question first, then this cut again
                        stack[top, 3], stack[top, 4] = cut, total
                        top += 1
                        _wait(stack, top, question[0], question[1], question[2])
                        waits = True
                        break
                    product *= found
                    if found == 0:
                        break
                if waits:
                    break
                total += product
            if cut == left ^ fixed:
                break
            cut = (cut - (left ^ fixed)) & (left ^ fixed)
        if waits:
            continue
        if 2 * known > keys.shape[0]:
            return np.int64(-1)
        at, found = _known(keys, counts, left, one, two)
        keys[at], counts[at] = left | one << MOST | two << 2 * MOST, total
        known += 1
        top -= 1
    return total
