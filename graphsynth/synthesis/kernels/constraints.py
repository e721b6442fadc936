"""The sparsity conditions of one contracted graph, reduced to the few that can bind."""

from __future__ import annotations

import numpy as np

from graphsynth.synthesis.kernels.layout import inner


@inner
def popcount(x):
    """Count the set bits of a non-negative 64-bit integer."""
    x = x - ((x >> 1) & 0x5555555555555555)
    x = (x & 0x3333333333333333) + ((x >> 2) & 0x3333333333333333)
    x = (x + (x >> 4)) & 0x0F0F0F0F0F0F0F0F
    return ((x * 0x0101010101010101) >> 56) & 0xFF


@inner
def critical_sets(k, m, class_u, class_v, class_dmax, space, need, best, set_mask, set_need):
    """Find the vertex sets whose sparsity condition is neither automatic nor implied by a smaller set.

    A class e (all parallel paths between two vertices) has weight D_e = dmax_e - y_e with y_e >= 0.  The condition
    sum of D_e inside U <= Pi (|U| - 1) - 1 reads: sum of y_e inside U >= need(U).  U is dropped when need(U) <= 0 or
    when a proper subset needs at least as much.  The whole vertex set is dropped too: there the sum is prescribed.

    ``k``, ``m``: numbers of vertices and of classes; ``class_u``, ``class_v`` (m,) int64: end vertices of each class,
    u < v; ``class_dmax`` (m,) int64: largest weight a class can take; ``space``: mobility Pi of the space; ``need``,
    ``best`` (2**k,) int16: workspace; ``set_mask`` (capacity,) int64: output: for each critical set, the bit mask of
    the classes inside it; ``set_need`` (capacity,) int64: output: the need of each critical set. Returns the number of
    critical sets, or -1 when the capacity is exceeded.
    """
    size = 1 << k
    first = np.zeros(k + 1, np.int64)
    other = np.empty(m, np.int64)
    weight = np.empty(m, np.int64)
    at = 0
    for u in range(k):
        first[u] = at
        for e in range(m):
            if class_u[e] == u:
                other[at] = class_v[e]
                weight[at] = class_dmax[e]
                at += 1
    first[k] = at
    # need[] first holds sum of dmax inside U minus Pi |U|; the lowest vertex of U is added last
    need[0] = 0
    for u in range(1, size):
        low = 0
        while not (u >> low) & 1:
            low += 1
        acc = need[u & (u - 1)] - space
        for i in range(first[low], first[low + 1]):
            if (u >> other[i]) & 1:
                acc += weight[i]
        need[u] = acc
    for u in range(size):
        need[u] += space + 1
        best[u] = need[u]
    best[0] = 0
    for v in range(k):
        best[1 << v] = 0
        need[1 << v] = 0
    need[0] = 0
    for v in range(k):
        bit = 1 << v
        for base in range(0, size, 2 * bit):
            for u in range(base, base + bit):
                if best[u] > best[u + bit]:
                    best[u + bit] = best[u]
    count = 0
    for u in range(3, size - 1):
        n = need[u]
        if n <= 0 or best[u] > n:
            continue
        implied = False
        for v in range(k):
            if (u >> v) & 1 and best[u ^ (1 << v)] >= n:
                implied = True
                break
        if implied:
            continue
        if count == set_mask.shape[0]:
            return -1
        mask = np.int64(0)
        for e in range(m):
            if (u >> class_u[e]) & 1 and (u >> class_v[e]) & 1:
                mask |= np.int64(1) << e
        set_mask[count] = mask
        set_need[count] = n
        count += 1
    return count
