"""Structural facts of blocks of chains: canonical numbering, symmetry, groups of every inversion and driver, parents.

Planar chains of mobility-1 joints with at most ``MOST_LINKS`` links.  Links are numbered canonically in everything that
leaves this module, so that they are those of the graph read back from the key.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.atlas.kernels.grouping import groups_of
from graphsynth.core.compilation import kernel
from graphsynth.core.intrinsics import lowest_bit, popcount
from graphsynth.structure.kernels import ONE, ZERO, canon, canon_workspace

MOST_LINKS = 18
#: Bytes of the canonical adjacency of a group: with its base at most 17 vertices, 136 pairs of them.
FORM = 17
#: 18 links make 8 loops at most, and so 9 parallel paths.
MOST_PATHS = 9


class Block(NamedTuple):
    """Facts of chains, chain by chain along the first axis; links as in the key.

    Of mechanisms K rows, at least the number of all (frame, driven links); ``sizes`` is 0 beyond the last group.
    """

    joints: NDArray[np.uint8]  # (chains, joints, 2)
    keys: NDArray[np.uint8]  # (chains, bytes)
    order: NDArray[np.int64]  # (chains,) of the automorphism group
    orbit: NDArray[np.uint8]  # (chains, n) smallest link of the orbit
    girth: NDArray[np.uint8]  # (chains,)
    cuts: NDArray[np.uint64]  # (chains,) mask of the cut links
    levels: NDArray[np.uint8]  # (chains, n, n) links on each level from each frame
    mechanisms: NDArray[np.int64]  # (chains,) how many
    frames: NDArray[np.uint8]  # (chains, K)
    drives: NDArray[np.uint64]  # (chains, K) masks of the driven links
    sizes: NDArray[np.uint8]  # (chains, K, n // 2) links of each group
    outers: NDArray[np.uint8]  # (chains, K, n // 2) outer joints
    forms: NDArray[np.uint8]  # (chains, K, n // 2, FORM) canonical adjacency, as `spell` writes it
    parents: NDArray[np.uint8]  # (chains, n // 2, bytes + 1) first byte 1 where there is one
    contracted: NDArray[np.uint8]  # (chains, 1 + n n) vertices, then multiplicities


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
def list_drives(n, mobility, masks, frames, drives):
    """Write every frame with every set of driven links jointed to it; returns their number."""
    count = 0
    for v in range(n):
        chosen = ZERO
        while True:
            if popcount(chosen) == np.uint64(mobility):
                frames[count], drives[count] = v, chosen
                count += 1
            chosen = (chosen - masks[v]) & masks[v]  # the next subset
            if chosen == ZERO:
                break
    return count


@kernel
def drive_orbits(count, frames, drives, gens, generators, first, low):
    """Smallest member of the orbit of every (frame, driven links); ``first`` is where the sets of a frame begin."""
    for k in range(count - 1, -1, -1):
        low[k], first[frames[k]] = k, k
    changed = True
    while changed:
        changed = False
        for g in range(generators):
            for k in range(count):
                moved, left = ZERO, drives[k]
                while left != ZERO:
                    moved |= ONE << np.uint64(gens[g, np.int64(lowest_bit(left))])
                    left &= left - ONE
                image = first[gens[g, frames[k]]]
                while drives[image] != moved:
                    image += 1
                least = min(low[k], low[image])
                if low[k] != least or low[image] != least:
                    low[k] = low[image] = least
                    changed = True


@kernel
def lay_out_group(group, known, masks, local, small, colours):
    """Adjacency of a group and its base (vertex 0), coloured by adjacency level; returns (vertices, outer joints)."""
    size, left = 1, group
    while left != ZERO:
        local[np.int64(lowest_bit(left))] = size
        left &= left - ONE
        size += 1
    for v in range(size):
        small[0, v] = ZERO
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
    seen = level = ONE
    number = 0
    while level != ZERO:
        following = ZERO
        while level != ZERO:
            at = np.int64(lowest_bit(level))
            level &= level - ONE
            colours[at] = number
            following |= small[0, at]
        level = following & ~seen
        seen |= level
        number += 1
    return size, outer


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
def contract(n, masks, local, small, colours):
    """Contracted multigraph as layers of an adjacency, layer m - 1 for m parallel paths; returns its vertices.

    The colour of a vertex is its number of paths back to itself (in fractionated chains only).
    """
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
        colours[p] = times[p, p] // 2
        for q in range(size):
            if p != q and times[p, q]:
                small[times[p, q] - 1, p] |= ONE << np.uint64(q)
    return size


@kernel
def independent_loops(n, rows, edge_of, most, basis, distance, before, queue):
    """Rank of the loops of at most ``most`` links; ``n`` vertices, vertex 0 left out.

    Loops are vectors over the joints.  Those of a breadth-first tree from every vertex are enough: each edge of a loop
    of length L closes, with the tree of a vertex of that loop, a loop no longer than L, and these add up to it.
    """
    rank = 0
    for start in range(1, n):
        for v in range(1, n):
            distance[v] = -1
        distance[start], queue[0], before[start] = 0, start, start
        head, tail = 0, 1
        while head < tail:
            at = queue[head]
            head += 1
            for w in range(1, n):
                if rows[at] >> np.uint64(w) & ONE != ZERO and distance[w] < 0:
                    distance[w], before[w], queue[tail] = distance[at] + 1, at, w
                    tail += 1
        for a in range(1, n):
            for b in range(1, a):
                if rows[a] >> np.uint64(b) & ONE == ZERO or distance[a] < 0:
                    continue
                if before[a] == b or before[b] == a or distance[a] + distance[b] + 1 > most:
                    continue
                vector = ONE << np.uint64(edge_of[a, b])
                for end in (a, b):
                    at = end
                    while at != start:
                        vector ^= ONE << np.uint64(edge_of[at, before[at]])
                        at = before[at]
                for k in range(rank):
                    vector = min(vector, vector ^ basis[k])
                if vector != ZERO:
                    basis[rank] = vector
                    rank += 1
    return rank


@kernel
def classes_of(vertices, forms, out):
    """Class of each group: most joints of a link, or links of the longest loop of a minimum basis, at least 2.

    ``vertices`` int64[groups] with the base, ``forms`` uint8[groups, FORM] as :func:`spell` writes them.
    """
    rows, edge_of = np.zeros(MOST_LINKS, np.uint64), np.zeros((MOST_LINKS, MOST_LINKS), np.int64)
    basis, distance = np.zeros(64, np.uint64), np.zeros(MOST_LINKS, np.int64)
    before, queue = np.zeros(MOST_LINKS, np.int64), np.zeros(MOST_LINKS, np.int64)
    for g in range(vertices.shape[0]):
        n, bit, edges = vertices[g], 0, 0
        rows[:] = ZERO
        for b in range(1, n):
            for a in range(b):
                if forms[g, bit >> 3] & (128 >> (bit & 7)):
                    rows[a] |= ONE << np.uint64(b)
                    rows[b] |= ONE << np.uint64(a)
                    if a > 0:
                        edge_of[a, b] = edge_of[b, a] = edges
                        edges += 1
                bit += 1
        highest = 2
        for v in range(1, n):
            highest = max(highest, np.int64(popcount(rows[v])))
        # the inner joints connect the group: one loop for each joint beyond those of a tree
        loops, most = edges - (n - 2), 2
        while loops > 0 and independent_loops(n, rows, edge_of, most, basis, distance, before, queue) < loops:
            most += 1
        out[g] = max(highest, most) if loops > 0 else highest


@kernel
def fresh_parents(n, joints, rows, local, small, plain, space, parents):
    """Write the chains left when one dyad of two binary links is removed."""
    lab, form, gens, index, orbits, wi, wu = space
    found = 0
    for j in range(joints.shape[0]):
        u, w = np.int64(joints[j, 0]), np.int64(joints[j, 1])
        if popcount(rows[u]) == popcount(rows[w]) == np.uint64(2) and without_dyad(n, rows, u, w, local, small):
            canon(n - 2, np.int64(1), small, plain, lab, form, gens, index, orbits, wi, wu)
            spell(n - 2, form[0], parents[found, 1:])
            parents[found, 0] = 1
            found += 1
    for k in range(found, parents.shape[0]):
        parents[k, 0] = 0


@kernel
def canonical_contracted(n, rows, local, small, colours, space, out):
    """Write the canonical contracted multigraph: vertices, then its matrix of multiplicities."""
    lab, form, gens, index, orbits, wi, wu = space
    size = contract(n, rows, local, small, colours)
    out[0] = size
    if size > 0:
        canon(size, np.int64(MOST_PATHS), small, colours, lab, form, gens, index, orbits, wi, wu)
    for p in range(size):
        for q in range(size):
            times = colours[lab[p]] if p == q else 0
            for m in range(MOST_PATHS):
                if form[m, p] >> np.uint64(q) & ONE != ZERO:
                    times = m + 1
            out[1 + p * size + q] = times


@kernel
def grouped(n, joints, rows, placed, scratch, local, small, colours, space, out):
    """Write the groups of one mechanism; returns False if these drivers cannot move it."""
    sizes, outers, forms = out
    ends, owner, free, came, stack, reach, groups = scratch
    lab, form, gens, index, orbits, wi, wu = space
    found = groups_of(n, joints, placed, ends, owner, free, came, stack, reach, groups)
    sizes[:] = 0
    known = placed
    for g in range(found):
        size, outer = lay_out_group(groups[g], known, rows, local, small, colours)
        known |= groups[g]
        sizes[g], outers[g] = size - 1, outer
        if size > 3:
            canon(size, np.int64(1), small, colours, lab, form, gens, index, orbits, wi, wu)
            spell(size, form[0], forms[g])
        else:  # a dyad: all three pairs
            forms[g, :] = 0
            forms[g, 0] = 224
    return found >= 0


@kernel
def renumber(n, c, generators, space, local, rows, image, block):
    """Take over what the canonical labelling says of chain c: order, orbits, rows, generators in the new numbers."""
    lab, form, gens, index, orbits, _, _ = space
    block.order[c] = 1
    for i in range(n):
        block.order[c] *= index[i]
        local[lab[i]] = i
        rows[i] = form[0, i]
    for g in range(generators):
        for v in range(n):
            image[g, local[v]] = local[gens[g, v]]
    for i in range(n):
        block.orbit[c, i] = n
        for v in range(n):
            if orbits[v] == orbits[lab[i]]:
                block.orbit[c, i] = min(block.orbit[c, i], local[v])


@kernel
def chain_facts(n, c, rows, distance, queue, block):
    """Write key, joints, girth, cut links and adjacency levels of chain c."""
    spell(n, rows, block.keys[c])
    at = 0
    for a in range(n):
        for b in range(a + 1, n):
            if rows[a] >> np.uint64(b) & ONE != ZERO:
                block.joints[c, at, 0], block.joints[c, at, 1] = a, b
                at += 1
    block.girth[c] = girth_of(n, rows, distance, queue)
    block.cuts[c] = ZERO
    for v in range(n):
        if not connected_without(n, rows, ONE << np.uint64(v)):
            block.cuts[c] |= ONE << np.uint64(v)
        level_sizes(n, rows, v, block.levels[c, v])


@kernel
def mechanism_facts(n, c, rows, found, drives, scratch, local, small, colours, space, block):
    """Write the groups of one mechanism of each orbit of (frame, driven links); ``drives`` as `list_drives` says."""
    all_frames, all_drives, low = drives
    frames, driven, sizes = block.frames[c], block.drives[c], block.sizes[c]
    outers, forms = block.outers[c], block.forms[c]
    at = 0
    for k in range(found):
        if low[k] != k:
            continue
        placed = ONE << np.uint64(all_frames[k]) | all_drives[k]
        frames[at], driven[at] = all_frames[k], all_drives[k]
        known = -1  # a mechanism with the same links placed has the same groups
        for i in range(at):
            if ONE << np.uint64(frames[i]) | driven[i] == placed:
                known = i
        if known >= 0:
            sizes[at], outers[at], forms[at] = sizes[known], outers[known], forms[known]
            at += 1
        else:
            own = sizes[at], outers[at], forms[at]
            at += grouped(n, block.joints[c], rows, placed, scratch, local, small, colours, space, own)
    block.mechanisms[c] = at


@kernel
def analyse(n, mobility, packed, block):
    """Facts of a block of chains, ``packed`` uint8[chains, 3 joints]; all else is output, see `Block`."""
    most, joint_count, room = max(n, 16), packed.shape[1] // 3, block.frames.shape[1]
    space = canon_workspace(most, MOST_PATHS)
    lab, form, gens, index, orbits, wi, wu = space
    masks, small = np.zeros((1, most), np.uint64), np.zeros((MOST_PATHS, most), np.uint64)
    plain, colours, local = np.zeros(most, np.int64), np.zeros(most, np.int64), np.zeros(most, np.int64)
    rows, image = np.zeros(n, np.uint64), np.zeros((2 * n, n), np.int64)
    distance, queue, first = np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n, np.int64)
    drives = np.zeros(room, np.int64), np.zeros(room, np.uint64), np.zeros(room, np.int64)
    ends, owner, free = np.zeros((2 * joint_count, 2), np.int64), np.zeros(2 * joint_count, np.int64), queue.copy()
    scratch = ends, owner, free, queue.copy(), np.zeros(n + 1, np.int64), rows.copy(), rows.copy()
    for c in range(packed.shape[0]):
        # the chain as it comes, its canonical numbers, and all that follows from these
        for v in range(n):
            masks[0, v] = ZERO
        for j in range(joint_count):
            a, b = np.int64(packed[c, 3 * j]), np.int64(packed[c, 3 * j + 1])
            masks[0, a] |= ONE << np.uint64(b)
            masks[0, b] |= ONE << np.uint64(a)
        generators = canon(n, np.int64(1), masks, plain, lab, form, gens, index, orbits, wi, wu)
        renumber(n, c, generators, space, local, rows, image, block)
        chain_facts(n, c, rows, distance, queue, block)
        found = list_drives(n, mobility, rows, drives[0], drives[1])
        drive_orbits(found, drives[0], drives[1], image, generators, first, drives[2])
        mechanism_facts(n, c, rows, found, drives, scratch, local, small, colours, space, block)
        fresh_parents(n, block.joints[c], rows, local, small, plain, space, block.parents[c])
        canonical_contracted(n, rows, local, small, colours, space, block.contracted[c])
