"""Gear pairs on a tree of turning joints: the first of each orbit of the choices without a locked sub-chain.

The tree is given as the graph of links that share an axis.  A gear pair joins two links at distance 2 there; the link
between them is its carrier.  Choices grow in ascending order, and one that an automorphism takes to an earlier one is
left with all that begin with it: the first choice of an orbit begins with first choices [Read 1978].
"""

from __future__ import annotations

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.core.intrinsics import popcount
from graphsynth.synthesis.kernels.contracted import automorphisms
from graphsynth.synthesis.kernels.layout import inner

_A, _B, _CARRIER, _LINKS = range(4)


@inner
def _lay_pairs(n, joined, pairs, number):
    """Write ends, carrier and links (as bits) of each possible gear pair; return how many there are."""
    count = 0
    for a in range(n):
        for b in range(a + 1, n):
            for c in range(n):
                if not joined[a, b] and joined[a, c] and joined[b, c]:
                    pairs[:, count] = a, b, c, 1 << a | 1 << b | 1 << c
                    number[a, b] = number[b, a] = count
                    count += 1
    return count


@inner
def _take(pair, n, by, room):
    """Add to the room that each set of links has for gear pairs of its own; return whether room is left."""
    others = ((1 << n) - 1) ^ pair
    some = others
    left = True
    while True:
        room[pair | some] += by
        left &= room[pair | some] >= 0
        if some == 0:
            return left
        some = (some - 1) & others


@inner
def _is_first(chosen, depth, mask, order, images):
    """Tell whether no automorphism takes the chosen pairs to an earlier choice, whose bits are a larger number."""
    for g in range(1, order):
        image = np.int64(0)
        for i in range(depth + 1):
            image |= np.int64(1) << images[g, chosen[i]]
        if image > mask:
            return False
    return True


@inner
def _is_connected(links, near):
    """Tell whether links (as bits) are connected among themselves."""
    reached = links & -links
    while True:
        more = reached
        for v in range(len(near)):
            if reached >> v & 1:
                more |= near[v] & links
        if more == reached:
            return reached == links
        reached = more


@inner
def _is_finest(n, joined, pairs, chosen, gears):
    """Tell whether every axis is needed: no link or pair of parts on it could have an axis of its own.

    The links on an axis are joined where one carries a gear pair of the other; taking any one away must leave the
    others connected.
    """
    near = np.zeros(n, np.int64)
    for i in range(gears):
        a, b, c = pairs[_A, chosen[i]], pairs[_B, chosen[i]], pairs[_CARRIER, chosen[i]]
        near[c] |= np.int64(1) << a | np.int64(1) << b
        near[a] |= np.int64(1) << c
        near[b] |= np.int64(1) << c
    for a in range(n):
        for b in range(a + 1, n):
            if not joined[a, b]:
                continue
            axis = np.int64(1) << a | np.int64(1) << b
            for c in range(n):
                axis |= np.int64(joined[a, c] and joined[b, c]) << c
            if axis & ((1 << b) - 1) != 1 << a:
                continue  # met before, at its two lowest links
            if axis == 1 << a | 1 << b:
                if not near[a] >> b & 1:
                    return False
                continue
            for v in range(n):
                if axis >> v & 1 and not _is_connected(axis ^ (np.int64(1) << v), near):
                    return False
    return True


@kernel
def choose_gears(n, trees, start, stop, gears, finest, perms, out):
    """Write one of each orbit of choices of so many gear pairs on the trees ``trees[start:stop]`` with n links.

    ``trees`` (trees, n, n) uint8: 1 for two links that share an axis; ``finest``: only where no axis can be split;
    ``perms`` (capacity, n) uint8: room for the automorphisms of a tree; ``out`` (2, capacity) int64: the number of a
    tree, and the pairs chosen as bits, the first possible pair being the highest.  Any set of links contains fewer
    gear pairs, carriers included, than it has links by 2 at least.  Returns the number of choices, of which those
    that fit are written, or -1 for a group too large.
    """
    count = 0
    pairs = np.empty((4, n * n), np.int64)
    number = np.empty((n, n), np.int64)
    chosen = np.empty(max(gears, 1), np.int64)
    room = np.empty(1 << n, np.int64)
    for h in range(start, stop):
        m = _lay_pairs(n, trees[h], pairs, number)
        if m < gears:
            continue
        order = automorphisms(n, trees[h], perms)
        if order < 0:
            return -1
        # where each automorphism takes each pair, as a bit
        images = np.empty((order, m), np.uint8)
        for g in range(order):
            for p in range(m):
                images[g, p] = m - 1 - number[perms[g, pairs[_A, p]], perms[g, pairs[_B, p]]]
        # how many more pairs each set of links may have
        for u in range(1 << n):
            room[u] = max(0, np.int64(popcount(np.uint64(u))) - 2)
        depth, p, mask = 0, -1, np.int64(0)
        while depth >= 0:
            p += 1
            if p > m - gears + depth:  # too few are left: take the last one back
                depth -= 1
                if depth >= 0:
                    p = chosen[depth]
                    mask ^= np.int64(1) << (m - 1 - p)
                    _take(pairs[_LINKS, p], n, 1, room)
                continue
            chosen[depth] = p
            grown = mask | np.int64(1) << (m - 1 - p)
            if not (_take(pairs[_LINKS, p], n, -1, room) and _is_first(chosen, depth, grown, order, images)):
                _take(pairs[_LINKS, p], n, 1, room)
            elif depth + 1 < gears:
                mask = grown
                depth += 1
            else:
                _take(pairs[_LINKS, p], n, 1, room)
                if not finest or _is_finest(n, trees[h], pairs, chosen, gears):
                    if count < out.shape[1]:
                        out[0, count], out[1, count] = h, grown
                    count += 1
    return count
