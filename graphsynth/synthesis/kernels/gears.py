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
FRAME, DRIVE, COAXIAL = 1, 2, 3  # which roles of links are chosen


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
def _is_finest(n, joined, near):
    """Tell whether every axis is needed: no link or pair of parts on it could have an axis of its own.

    The links on an axis are joined where one carries a gear pair of the other, see ``_near_of`` (a gear pair itself
    joins no two links on an axis); taking any one away must leave the others connected.  An axis of two links is always
    needed: one carries a gear pair of the other, or nothing held the two sides together.
    """
    for a in range(n):
        for b in range(a + 1, n):
            if not joined[a, b]:
                continue
            axis = np.int64(1) << a | np.int64(1) << b
            for c in range(n):
                axis |= np.int64(joined[a, c] and joined[b, c]) << c
            if axis & ((1 << b) - 1) != 1 << a:
                continue  # met before, at its two lowest links
            for v in range(n):
                if axis >> v & 1 and not _is_connected(axis ^ (np.int64(1) << v), near):
                    return False
    return True


@inner
def _near_of(n, pairs, chosen, gears, near):
    """Write, for each link, which links it is joined to by a gear pair or as its carrier, as bits."""
    for v in range(n):
        near[v] = 0
    for i in range(gears):
        for at in (_A, _B, _CARRIER):
            near[pairs[at, chosen[i]]] |= pairs[_LINKS, chosen[i]]


@inner
def _is_whole(n, near):
    """Tell whether gear pairs with their carriers hold all links together, whichever link is taken away."""
    everything = (np.int64(1) << n) - 1
    whole = True
    for v in range(n):
        whole &= _is_connected(everything ^ np.int64(1) << v, near)
    return whole


@inner
def _roles_kept(n, joined, perm, roles):
    """Count the frames, or choices of frame, input and output, that an automorphism keeps."""
    kept = 0
    for f in range(n):
        if perm[f] != f:
            continue
        if roles == FRAME:
            kept += 1
            continue
        for a in range(n):
            if perm[a] == a and joined[f, a]:
                for b in range(n):
                    if b != a and perm[b] == b and joined[f, b] and (joined[a, b] or roles == DRIVE):
                        kept += 1
    return kept


@inner
def _role_orbits(chosen, gears, mask, order, images, kept):
    """Count the roles of the links of a choice up to its own automorphisms, by the lemma of Burnside."""
    total, own = np.int64(0), np.int64(0)
    for g in range(order):
        image = np.int64(0)
        for i in range(gears):
            image |= np.int64(1) << images[g, chosen[i]]
        if image == mask:
            total += kept[g]
            own += 1
    return total // own


@kernel
def choose_gears(n, trees, start, stop, gears, finest, roles, perms, out):
    """Write one of each orbit of choices of so many gear pairs on the trees ``trees[start:stop]`` with n links.

    ``trees`` (trees, n, n) uint8: 1 for two links that share an axis; ``finest``: only where no axis can be split;
    ``perms`` (capacity, n) uint8: room for the automorphisms of a tree; ``out`` (2, capacity) int64: the number of a
    tree, and the pairs chosen as bits, the first possible pair being the highest.  Any set of links contains fewer
    gear pairs, carriers included, than it has links by 2 at least, and gear pairs with their carriers hold all links
    together, whichever one is taken away.  Returns the number of choices, of which those that fit are written, or -1
    for a group too large; with ``roles`` (FRAME, DRIVE, COAXIAL) that of choices of gear pairs and roles of links.
    """
    count = 0
    pairs = np.empty((4, n * n), np.int64)
    number = np.empty((n, n), np.int64)
    chosen = np.empty(max(gears, 1), np.int64)
    room = np.empty(1 << n, np.int64)
    near = np.empty(n, np.int64)
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
        # roles that each automorphism keeps
        kept = np.zeros(order, np.int64)
        for g in range(order if roles else 0):
            kept[g] = _roles_kept(n, trees[h], perms[g], roles)
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
            # one pair more, unless it locks links or the choice is not the first of its orbit
            chosen[depth] = p
            grown = mask | np.int64(1) << (m - 1 - p)
            if not (_take(pairs[_LINKS, p], n, -1, room) and _is_first(chosen, depth, grown, order, images)):
                _take(pairs[_LINKS, p], n, 1, room)
            elif depth + 1 < gears:
                mask = grown
                depth += 1
            else:
                _take(pairs[_LINKS, p], n, 1, room)
                _near_of(n, pairs, chosen, gears, near)
                if gears < n - 2 and not _is_whole(n, near):
                    continue
                if finest and not _is_finest(n, trees[h], near):
                    continue
                if roles:
                    count += _role_orbits(chosen, gears, grown, order, images, kept)
                else:
                    if count < out.shape[1]:
                        out[0, count], out[1, count] = h, grown
                    count += 1
    return count


@inner
def _kept_choices(m, gears, image, ways):
    """Count the choices of so many of m pairs that a permutation of them keeps."""
    for k in range(gears + 1):
        ways[k] = k == 0
    seen = np.int64(0)
    for p in range(m):
        if seen >> p & 1:
            continue
        size, at = 0, p
        while not seen >> at & 1:
            seen |= np.int64(1) << at
            at = image[at]
            size += 1
        for k in range(gears, size - 1, -1):
            ways[k] += ways[k - size]
    return ways[gears]


@kernel
def weigh_moves(n, joined, gears, roles, perms, target, move):
    """Count pairs of an automorphism of a tree and what it keeps, so many possible gear pairs and roles of links.

    ``joined`` (n, n) uint8: 1 for two links that share an axis; ``perms`` as for `choose_gears`; ``move`` (n,) int64
    takes the automorphism of pair number ``target``.  Returns the order of the group and the number of pairs, locked
    choices included; of a ``target`` that is not negative the number up to its automorphism.
    """
    pairs = np.empty((4, n * n), np.int64)
    number = np.empty((n, n), np.int64)
    ways = np.empty(gears + 1, np.int64)
    image = np.empty(n * n, np.int64)
    m = _lay_pairs(n, joined, pairs, number)
    total = np.int64(0)
    if m < gears:
        return np.int64(1), total
    order = np.int64(automorphisms(n, joined, perms))
    for g in range(order):
        kept = np.int64(1) if roles == 0 else np.int64(_roles_kept(n, joined, perms[g], roles))
        if kept:
            for p in range(m):
                image[p] = number[perms[g, pairs[_A, p]], perms[g, pairs[_B, p]]]
            total += kept * _kept_choices(m, gears, image, ways)
        if 0 <= target < total:
            for v in range(n):
                move[v] = perms[g, v]
            break
    return order, total
