"""What is laid out once of a contracted graph: its automorphisms, and the few sparsity conditions that can bind."""

from __future__ import annotations

import numpy as np

from graphsynth.core.intrinsics import popcount
from graphsynth.synthesis.kernels.layout import BETWEEN_PINS, HEAVIEST, KIND_SHIFT, LEFT, MASK, NEED, U, V, inner

_GOLDEN = np.int64(-7046029254386353131)
_MIX = np.int64(-4658895280553007687)


@inner
def _mix(x):
    x = (x ^ (x >> 31)) * _MIX
    return x ^ (x >> 29)


@inner
def refine(k, mult, colour):
    """Colour refinement by hashing: equivalent vertices keep equal colours (a collision only weakens pruning)."""
    fresh = np.empty(k, np.int64)
    distinct = 0
    for _ in range(k):
        for v in range(k):
            acc = colour[v] * _GOLDEN + 1
            for w in range(k):
                if mult[v, w]:
                    acc += _mix(colour[w] + np.int64(mult[v, w]) * _GOLDEN)
            fresh[v] = _mix(acc)
        count = 0
        for v in range(k):
            first = True
            for w in range(v):
                if fresh[w] == fresh[v]:
                    first = False
                    break
            if first:
                count += 1
        for v in range(k):
            colour[v] = fresh[v]
        if count in (distinct, k):
            return count
        distinct = count
    return distinct


@inner
def _search_order(k, mult, colour):
    """Vertices so that each one has as many earlier neighbours as possible, rare colours first."""
    order = np.empty(k, np.int64)
    placed = np.zeros(k, np.bool_)
    links = np.zeros(k, np.int64)
    for i in range(k):
        best = -1
        best_rank = -1
        for v in range(k):
            if placed[v]:
                continue
            same = 0
            for w in range(k):
                if colour[w] == colour[v]:
                    same += 1
            rank = links[v] * 64 + (63 - same)
            if rank > best_rank:
                best_rank = rank
                best = v
        order[i] = best
        placed[best] = True
        for w in range(k):
            if mult[best, w]:
                links[w] += 1
    return order


@inner
def automorphisms(k, mult, perms):
    """Write every automorphism of the multigraph ``mult`` into ``perms``; the identity comes first.

    ``k``: number of vertices; ``mult`` (k, k) uint8: symmetric matrix of edge multiplicities; ``perms`` (capacity, k)
    uint8: output: ``perms[g, v]`` is the image of v. Returns the order of the group, or -1 when it exceeds the
    capacity.
    """
    for v in range(k):
        perms[0, v] = v
    colour = np.zeros(k, np.int64)
    if refine(k, mult, colour) == k:
        return 1
    order = _search_order(k, mult, colour)
    image = np.full(k, -1, np.int64)
    candidate = np.zeros(k, np.int64)
    used = np.zeros(k, np.bool_)
    count = 1
    depth = 0
    while depth >= 0:
        v = order[depth]
        # take back the image that was tried, and look for the next one
        if image[v] >= 0:
            used[image[v]] = False
            image[v] = -1
        w = candidate[depth]
        while w < k:
            if not used[w] and colour[w] == colour[v] and mult[w, w] == mult[v, v]:
                fits = True  # as far as the vertices placed before are concerned
                for i in range(depth):
                    u = order[i]
                    if mult[v, u] != mult[w, image[u]]:
                        fits = False
                        break
                if fits:
                    break
            w += 1
        if w == k:
            depth -= 1
            continue
        candidate[depth] = w + 1
        image[v] = w
        used[w] = True
        if depth + 1 < k:
            depth += 1
            candidate[depth] = 0
            continue
        # every vertex has its image: an automorphism; the identity is there already
        identity = True
        for u in range(k):
            if image[u] != u:
                identity = False
                break
        if not identity:
            if count == perms.shape[0]:
                return -1
            for u in range(k):
                perms[count, u] = image[u]
            count += 1
    return count


@inner
def critical_sets(k, m, mult, classes, space, subsets, sets):
    """Find the vertex sets whose sparsity condition is neither automatic nor implied by a smaller set.

    A class e (all parallel paths between two vertices) has weight D_e = HEAVIEST_e - y_e with y_e >= 0.  The condition
    sum of D_e inside U <= Pi (|U| - 1) - 1 reads: sum of y_e inside U >= need(U).  U is dropped when need(U) <= 0 or
    when a proper subset needs at least as much.  The whole vertex set is dropped too: there the sum is prescribed.
    Multiple joints take 1 from the bound each; with them the whole set is looked at (``_is_one_link``).

    ``classes`` and ``subsets`` (workspace) are those of ``Work``; of each critical set ``sets`` takes the bit mask of
    the classes inside it (MASK) and its need (NEED).  Returns the number of critical sets, or -1 when there is no room.
    """
    need = _needs(k, m, mult, classes, space, subsets)
    pins = np.int64(0)
    for v in range(k):
        pins |= np.int64(mult[v, v]) << v
    count = 0
    for u in range(3, (1 << k) - (pins == 0)):
        if pins and need[u] > 0 and _is_one_link(k, u, pins, mult):
            need[u] = 0
        n = need[u]
        if n <= 0 or _is_implied(k, u, n, need, count, sets):
            continue
        if count == sets.shape[1]:
            return -1
        mask = np.int64(0)
        for e in range(m):
            if (u >> classes[U, e]) & 1 and (u >> classes[V, e]) & 1:
                mask |= np.int64(1) << e
        sets[MASK, count] = mask
        sets[NEED, count] = n
        sets[LEFT, count] = u  # its vertices; the searches write what is left of its need
        count += 1
    return count


@inner
def _needs(k, m, mult, classes, space, subsets):
    """Return ``need[u]`` of every vertex set u: doubled vertex by vertex, by what the new one adds to each."""
    need, inside = subsets[0], subsets[1]
    weight = np.zeros((k, k), np.int16)
    for e in range(m):
        weight[classes[V, e], classes[U, e]] = classes[HEAVIEST, e]
    need[0] = space + 1  # more than single vertices need, so that these are implied; no two vertices need anything
    for v in range(k):
        inside[0] = np.int64(mult[v, v]) - space
        for w in range(v):
            size = 1 << w
            for u in range(size):
                inside[size + u] = inside[u] + weight[v, w]
        size = 1 << v
        for u in range(size):
            need[size + u] = need[u] + inside[u]
    return need


@inner
def _is_one_link(k, u, pins, mult):
    """Tell whether labels alone decide that what is inside u is one link and joints on it, or not rigid.

    So it is for two vertices, and for one link and multiple joints without a path of weight >= 0 between two of these.
    """
    links = popcount(np.uint64(u & ~pins))
    if popcount(np.uint64(u)) == 2 or links > 1:
        return links < 2
    if links == 0:
        return False
    for v in range(k):
        for w in range(v):
            if (u >> v) & (u >> w) & 1 and mult[v, w] >> KIND_SHIFT == BETWEEN_PINS:
                return False
    return True


@inner
def _is_implied(k, u, n, need, count, sets):
    """Tell whether a proper subset of u needs n or more: one vertex less (quick), or a critical set found before.

    If there is such a subset, descending through subsets that need at least as much ends at a critical one; its number
    as a bit mask is smaller, so it has been found.
    """
    for v in range(k):
        if (u >> v) & 1 and need[u ^ (1 << v)] >= n:
            return True
    found = False
    for s in range(count):
        found |= sets[LEFT, s] & ~u == 0 and sets[NEED, s] >= n
    return found
