"""All automorphisms of a small edge-weighted graph."""

from __future__ import annotations

import numpy as np

from graphsynth.synthesis.kernels.layout import inner

_GOLDEN = np.int64(-7046029254386353131)
_MIX = np.int64(-4658895280553007687)


@inner
def _mix(x):
    x = (x ^ (x >> 31)) * _MIX
    return x ^ (x >> 29)


@inner
def _refine(k, mult, colour):
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
    if _refine(k, mult, colour) == k:
        return 1
    order = _search_order(k, mult, colour)
    image = np.full(k, -1, np.int64)
    candidate = np.zeros(k + 1, np.int64)
    used = np.zeros(k, np.bool_)
    count = 1
    depth = 0
    while depth >= 0:
        v = order[depth]
        if image[v] >= 0:
            used[image[v]] = False
            image[v] = -1
        w = candidate[depth]
        while w < k:
            if not used[w] and colour[w] == colour[v]:
                fits = True
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
