"""Structural facts of blocks of chains: canonical numbering, symmetry, groups of every inversion and driver, parents.

Planar chains of mobility-1 joints with at most ``MOST_LINKS`` links.  Links are numbered canonically in everything that
leaves this module, so that they are those of the graph read back from the key.
"""

import numpy as np

from graphsynth.atlas.kernels.grouping import groups_of
from graphsynth.compilation import kernel
from graphsynth.structure.kernels import ONE, ZERO, canon, canon_workspace, lowest_bit, popcount

#: A group with its base has at most 16 vertices, and 120 pairs of them: they fit into two words.
MOST_LINKS = 17


@kernel
def spell(n, rows, out):
    """Write the upper triangle of an adjacency, column by column, as bits of bytes from the highest."""
    for k in range(out.shape[0]):
        out[k] = 0
    bit = 0
    for b in range(1, n):
        for a in range(b):
            if rows[b] >> np.uint64(a) & ONE != ZERO:
                out[bit >> 3] |= np.uint8(128 >> (bit & 7))
            bit += 1


@kernel
def girth_of(n, masks, distance, queue):
    """Shortest loop by a search from every link; 0 if there is none."""
    best = n + 1
    for start in range(n):
        for v in range(n):
            distance[v] = -1
        distance[start], queue[0] = 0, start
        head, tail = 0, 1
        while head < tail:
            at = queue[head]
            head += 1
            left = masks[at]
            while left != ZERO:
                other = np.int64(lowest_bit(left))
                left &= left - ONE
                if distance[other] < 0:
                    distance[other] = distance[at] + 1
                    queue[tail] = other
                    tail += 1
                elif distance[other] >= distance[at]:
                    best = min(best, distance[at] + distance[other] + 1)
    return best if best <= n else 0


@kernel
def level_sizes(n, masks, frame, out):
    """Write the number of links on every adjacency level from a frame."""
    out[:] = 0
    seen = ONE << np.uint64(frame)
    level, at = seen, 0
    while level != ZERO:
        out[at] = popcount(level)
        at += 1
        following, left = ZERO, level
        while left != ZERO:
            following |= masks[np.int64(lowest_bit(left))]
            left &= left - ONE
        level = following & ~seen
        seen |= level


@kernel
def connected_without(n, masks, gone):
    """Whether the links outside a mask are connected."""
    rest = ((ONE << np.uint64(n)) - ONE) & ~gone
    seen = rest & (~rest + ONE)
    grown = True
    while grown:
        grown = False
        left = seen
        while left != ZERO:
            more = masks[np.int64(lowest_bit(left))] & rest & ~seen
            left &= left - ONE
            if more != ZERO:
                seen |= more
                grown = True
    return seen == rest


@kernel
def arc_orbits(n, joints, arc_of, gens, count, out):
    """Smallest arc (frame, driver) of the orbit of every arc; arc 2 j is a -> b of joint j, arc 2 j + 1 is b -> a."""
    arcs = out.shape[0]
    for k in range(arcs):
        out[k] = k
    changed = True
    while changed:
        changed = False
        for g in range(count):
            for k in range(arcs):
                j, back = k >> 1, k & 1
                image = arc_of[gens[g, joints[j, back]], gens[g, joints[j, 1 - back]]]
                low = min(out[k], out[image])
                if out[k] != low or out[image] != low:
                    out[k] = out[image] = low
                    changed = True


@kernel
def lay_out_group(group, known, masks, local, small, colours):
    """Adjacency of a group and its base (vertex 0, a colour of its own); returns (vertices, outer joints)."""
    size, left = 1, group
    while left != ZERO:
        local[np.int64(lowest_bit(left))] = size
        left &= left - ONE
        size += 1
    for v in range(size):
        small[0, v], colours[v] = ZERO, min(v, 1)
    outer, left = 0, group
    while left != ZERO:
        link = np.int64(lowest_bit(left))
        left &= left - ONE
        near, bit = local[link], ONE << np.uint64(local[link])
        inside = masks[link] & group
        while inside != ZERO:
            small[0, near] |= ONE << np.uint64(local[np.int64(lowest_bit(inside))])
            inside &= inside - ONE
        outside = masks[link] & known
        if outside != ZERO:
            outer += np.int64(popcount(outside))
            small[0, near] |= ONE
            small[0, 0] |= bit
    return size, outer


@kernel
def packed_bits(size, form):
    """Upper triangle of a canonical adjacency of at most 16 vertices in two words."""
    high, low, bit = ZERO, ZERO, 0
    for b in range(1, size):
        for a in range(b):
            if form[0, b] >> np.uint64(a) & ONE != ZERO:
                if bit < 64:
                    low |= ONE << np.uint64(bit)
                else:
                    high |= ONE << np.uint64(bit - 64)
            bit += 1
    return high, low


@kernel
def without_dyad(n, masks, u, w, local, small):
    """Adjacency of the chain without the adjacent binary links u and w; False if a link would lose too much."""
    gone = ONE << np.uint64(u) | ONE << np.uint64(w)
    size = 0
    for v in range(n):
        if gone >> np.uint64(v) & ONE == ZERO:
            if popcount(masks[v] & ~gone) < np.uint64(2):
                return False
            local[v] = size
            size += 1
    for v in range(n):
        if gone >> np.uint64(v) & ONE == ZERO:
            row, left = ZERO, masks[v] & ~gone
            while left != ZERO:
                row |= ONE << np.uint64(local[np.int64(lowest_bit(left))])
                left &= left - ONE
            small[0, local[v]] = row
    return connected_without(n, masks, gone)


@kernel
def contract(n, masks, local, small):
    """Contracted multigraph as layers of an adjacency, layer m - 1 for m parallel paths; returns its vertices."""
    size = 0
    for v in range(n):
        if popcount(masks[v]) > np.uint64(2):
            local[v] = size
            size += 1
    times = np.zeros((size, size), np.int64)
    for v in range(n):
        if popcount(masks[v]) <= np.uint64(2):
            continue
        left = masks[v]
        while left != ZERO:
            before, at = v, np.int64(lowest_bit(left))
            left &= left - ONE
            while popcount(masks[at]) == np.uint64(2):
                onward = masks[at] & ~(ONE << np.uint64(before))
                before, at = at, np.int64(lowest_bit(onward))
            times[local[v], local[at]] += 1
    small[:] = ZERO
    for p in range(size):
        for q in range(size):
            if p != q and times[p, q]:
                small[times[p, q] - 1, p] |= ONE << np.uint64(q)
    return size


@kernel
def analyse(
    n, packed, joints, keys, order, orbit, girth, cuts, levels, arcs, sizes, outers, forms, parents, contracted
):
    """Facts of a block of chains; see :func:`graphsynth.atlas.facts.analyse_block` for the arrays.

    ``packed`` uint8[chains, 3 joints]; the rest is output.  ``joints`` uint8[chains, joints, 2], ``keys`` uint8[chains,
    bytes], ``order`` int64[chains], ``orbit`` uint8[chains, n], ``girth`` uint8[chains], ``cuts`` uint64[chains],
    ``levels`` uint8[chains, n, n], ``arcs`` int16[chains, 2 joints], ``sizes``, ``outers`` uint8[chains, joints, n // 2]
    (0 beyond the last group and for joints that do not represent their orbit), ``forms`` uint64[chains, joints, n // 2, 2],
    ``parents`` uint8[chains, n // 2, bytes + 1] (first byte 1 where there is one), ``contracted`` uint8[chains, 1 + n n].
    """  # noqa: E501
    count = packed.shape[1] // 3
    most = max(n, 16)
    layers = np.int64(1)
    lab, form, gens, index, orbits, wi, wu = canon_workspace(most, 8)
    masks, small = np.zeros((1, most), np.uint64), np.zeros((8, most), np.uint64)
    plain, colours, local = np.zeros(most, np.int64), np.zeros(most, np.int64), np.zeros(most, np.int64)
    rows, arc_of, image = np.zeros(n, np.uint64), np.zeros((n, n), np.int64), np.zeros((2 * n, n), np.int64)
    distance, queue = np.zeros(n, np.int64), np.zeros(n, np.int64)
    ends, owner = np.zeros((2 * count, 2), np.int64), np.zeros(2 * count, np.int64)
    free, came, stack = np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n + 1, np.int64)
    reach, groups = np.zeros(n, np.uint64), np.zeros(n, np.uint64)
    for c in range(packed.shape[0]):
        for v in range(n):
            masks[0, v] = ZERO
        for j in range(count):
            a, b = np.int64(packed[c, 3 * j]), np.int64(packed[c, 3 * j + 1])
            masks[0, a] |= ONE << np.uint64(b)
            masks[0, b] |= ONE << np.uint64(a)
        generators = canon(n, layers, masks, plain, lab, form, gens, index, orbits, wi, wu)
        order[c] = 1
        for i in range(n):
            order[c] *= index[i]
            local[lab[i]] = i
            rows[i] = form[0, i]
        for g in range(generators):
            for v in range(n):
                image[g, local[v]] = local[gens[g, v]]
        for i in range(n):
            low = n
            for v in range(n):
                if orbits[v] == orbits[lab[i]]:
                    low = min(low, local[v])
            orbit[c, i] = low
        spell(n, rows, keys[c])
        at = 0
        for a in range(n):
            for b in range(a + 1, n):
                if rows[a] >> np.uint64(b) & ONE != ZERO:
                    joints[c, at, 0], joints[c, at, 1] = a, b
                    arc_of[a, b], arc_of[b, a] = 2 * at, 2 * at + 1
                    at += 1
        girth[c] = girth_of(n, rows, distance, queue)
        cuts[c] = ZERO
        for v in range(n):
            if not connected_without(n, rows, ONE << np.uint64(v)):
                cuts[c] |= ONE << np.uint64(v)
            level_sizes(n, rows, v, levels[c, v])
        arc_orbits(n, joints[c], arc_of, image, generators, arcs[c])
        sizes[c, :, :] = 0
        for k in range(2 * count):
            j = k >> 1
            if arcs[c, k] != k or (k & 1 and arcs[c, k - 1] == k - 1):
                continue  # not the first of its orbit, or the two links have just been driven against each other
            placed = ONE << np.uint64(joints[c, j, 0]) | ONE << np.uint64(joints[c, j, 1])
            found = groups_of(n, joints[c], placed, ends, owner, free, came, stack, reach, groups)
            known = placed
            for g in range(found):
                size, outer = lay_out_group(groups[g], known, rows, local, small, colours)
                known |= groups[g]
                sizes[c, j, g], outers[c, j, g] = size - 1, outer
                if size > 3:
                    canon(size, layers, small, colours, lab, form, gens, index, orbits, wi, wu)
                    high, low = packed_bits(size, form)
                    forms[c, j, g, 0], forms[c, j, g, 1] = high, low
                else:
                    forms[c, j, g, 0], forms[c, j, g, 1] = ZERO, np.uint64(7)
        found = 0
        for j in range(count):
            u, w = np.int64(joints[c, j, 0]), np.int64(joints[c, j, 1])
            if popcount(rows[u]) == popcount(rows[w]) == np.uint64(2) and without_dyad(n, rows, u, w, local, small):
                canon(n - 2, layers, small, plain, lab, form, gens, index, orbits, wi, wu)
                spell(n - 2, form[0], parents[c, found, 1:])
                parents[c, found, 0] = 1
                found += 1
        for k in range(found, parents.shape[1]):
            parents[c, k, 0] = 0
        size = contract(n, rows, local, small)
        contracted[c, 0] = size
        if size > 0:
            canon(size, np.int64(8), small, plain, lab, form, gens, index, orbits, wi, wu)
            for p in range(size):
                for q in range(size):
                    times = 0
                    for m in range(8):
                        if form[m, p] >> np.uint64(q) & ONE != ZERO:
                            times = m + 1
                    contracted[c, 1 + p * size + q] = times
