"""The counting problem of one contracted graph under one automorphism, laid out for the searches."""

from __future__ import annotations

import numpy as np

from graphsynth.core.intrinsics import popcount
from graphsynth.synthesis.kernels import layout as lay
from graphsynth.synthesis.kernels.contracted import critical_sets
from graphsynth.synthesis.kernels.covers import LAID, LAID_COVERS, PLAIN, cover_of, covered_sets
from graphsynth.synthesis.kernels.layout import inner


@inner
def load_graph(k, mult, tables, work):
    """Lay out a contracted graph; return the number of its classes and of its critical sets."""
    m = np.int64(0)
    for u in range(k):
        for v in range(u + 1, k):
            if mult[u, v]:
                work.classes[lay.U, m] = u
                work.classes[lay.V, m] = v
                work.classes[lay.KIND, m] = 2 * np.int64(mult[u, v])
                work.classes[lay.HEAVIEST, m] = tables.heaviest[mult[u, v]]
                work.class_of[u, v] = m
                work.class_of[v, u] = m
                m += 1
    sets = critical_sets(k, m, mult, work.classes, tables.space, work.subsets, work.sets)
    work.state[PLAIN] = (sets + 7) // 8
    work.state[LAID] = m
    if tables.rules and sets >= 0:
        sets = covered_sets(k, mult, sets, tables, work)
    return m, sets


@inner
def build_variables(m, sets, perm, tables, work):
    """Set up the variables of the labellings fixed by one automorphism; return their number.

    Variables that decide small critical sets come first, variables in none last: once no set needs anything any more,
    the rest is counted by a table.
    """
    for e in range(m):
        work.classes[lay.VAR, e] = -1
    count = np.int64(0)
    masks = np.empty(m, np.int64)
    # cycles of classes under the automorphism
    for e in range(m):
        if work.classes[lay.VAR, e] >= 0:
            continue
        at = e
        flip = 0
        size = 0
        mask = np.int64(0)
        while True:
            work.classes[lay.VAR, at] = count
            work.classes[lay.FLIP, at] = flip
            mask |= np.int64(1) << at
            size += 1
            a = perm[work.classes[lay.U, at]]
            b = perm[work.classes[lay.V, at]]
            if a > b:
                flip ^= 1
            at = work.class_of[a, b]
            if at == e:
                break
        work.variables[lay.REP, count] = e
        work.variables[lay.SIZE, count] = size
        work.variables[lay.OWN, count] = flip
        masks[count] = mask
        count += 1
    # variables in the order in which they are chosen
    order = _smallest_sets_first(count, sets, masks, work)
    rank = np.empty(count, np.int64)
    rep = work.variables[lay.REP, :count].copy()
    size_ = work.variables[lay.SIZE, :count].copy()
    own = work.variables[lay.OWN, :count].copy()
    for j in range(count):
        rank[order[j]] = j
        work.variables[lay.REP, j] = rep[order[j]]
        work.variables[lay.SIZE, j] = size_[order[j]]
        work.variables[lay.OWN, j] = own[order[j]]
    # their new numbers
    for e in range(m):
        work.classes[lay.VAR, e] = rank[work.classes[lay.VAR, e]]
    # the critical sets that each variable serves, and how often
    at = 0
    for j in range(count):
        work.variables[lay.ROW, j] = at
        mask = masks[order[j]]
        for s in range(sets):
            c = np.int64(popcount(np.uint64(work.sets[lay.MASK, s] & mask)))
            if c:
                work.rows[lay.SET, at] = s
                work.rows[lay.COEF, at] = c
                at += 1
    work.variables[lay.ROW, count] = at
    return count


@inner
def _smallest_sets_first(count, sets, masks, work):
    """Order the variables so that critical sets are decided early: the set with fewest open variables comes next."""
    order = np.empty(count, np.int64)
    opened = np.zeros(count, np.bool_)
    placed = np.int64(0)
    weights = np.zeros(count, np.int64)  # how many sets each variable serves
    for j in range(count):
        for s in range(sets):
            if work.sets[lay.MASK, s] & masks[j]:
                weights[j] += 1
    while placed < count:
        fewest = count + 1
        chosen = -1
        for s in range(sets):
            left = 0
            for j in range(count):
                if not opened[j] and work.sets[lay.MASK, s] & masks[j]:
                    left += 1
            if 0 < left < fewest:
                fewest = left
                chosen = s
        inside = work.sets[lay.MASK, chosen] if chosen >= 0 else np.int64(-1)
        first = placed
        for j in range(count):
            if not opened[j] and (chosen < 0 or inside & masks[j]):
                opened[j] = True
                order[placed] = j
                placed += 1
        # within the set, variables that serve more sets come first
        for i in range(first + 1, placed):
            j = order[i]
            at = i
            while at > first and weights[order[at - 1]] < weights[j]:
                order[at] = order[at - 1]
                at -= 1
            order[at] = j
    return order


@inner
def plain_entries(count, tables, work):
    """Give each variable its own choices, one entry for each group of labels alike; return False on overflow."""
    at = 0
    for j in range(count):
        work.variables[lay.ENTRY, j] = at
        own_kind = 2 * work.classes[lay.KIND, work.variables[lay.REP, j]] + work.variables[lay.OWN, j]
        size = work.variables[lay.SIZE, j]
        heaviest = work.classes[lay.HEAVIEST, work.variables[lay.REP, j]]
        for g in range(tables.group_kinds[lay.GROUPS, own_kind], tables.group_kinds[lay.GROUPS_END, own_kind]):
            packed = tables.groups[lay.PACKED, g] * size
            if not fits(tables.resources[lay.DIGITS, tables.target], packed, tables.guard):
                continue
            if at == lay.MAX_ENTRIES:
                return False
            work.entries[lay.GAIN, at] = heaviest - tables.groups[lay.WEIGHT, g]
            work.entries[lay.INDEX, at] = tables.groups[lay.INDEX, g] * size
            work.entries[lay.PACKED, at] = packed
            work.entries[lay.COPIES, at] = tables.groups[lay.COPIES, g]
            work.entries[lay.COVER, at] = tables.groups[lay.COVER, g]
            at += 1
    work.variables[lay.ENTRY, count] = at
    return True


@inner
def fits(available, packed, guard):
    """Tell whether every digit of ``packed`` is at most that of ``available``."""
    return ((available | guard) - packed) & guard == guard


@inner
def unconstrained_ways(count, yes_or_no, tables, work):
    """Fill ``work.tables[WAYS, j, r]``: choices of variables j, j+1, ... that use up the resources r, sparsity ignored.

    With ``yes_or_no`` the table only tells whether there are any (and cannot overflow).

    Returns the number of choices of all variables, resources ignored; above 2**62 the table may have overflowed.
    """
    resources = tables.resources.shape[1]
    top = 1.0
    for i in range(resources):
        work.tables[lay.WAYS, count, i] = tables.resources[lay.FINAL, i]
    for j in range(count - 1, -1, -1):
        choices = 0.0
        for i in range(resources):
            work.tables[lay.WAYS, j, i] = 0
        for g in range(work.variables[lay.ENTRY, j], work.variables[lay.ENTRY, j + 1]):
            shift = work.entries[lay.INDEX, g]
            packed = work.entries[lay.PACKED, g]
            choices += work.entries[lay.COPIES, g]
            for i in range(shift, resources):
                if fits(tables.resources[lay.DIGITS, i], packed, tables.guard):
                    if yes_or_no:
                        work.tables[lay.WAYS, j, i] |= work.tables[lay.WAYS, j + 1, i - shift]
                    else:
                        work.tables[lay.WAYS, j, i] += (
                            work.entries[lay.COPIES, g] * work.tables[lay.WAYS, j + 1, i - shift]
                        )
        top *= choices
    return top


@inner
def lay_gains(count, tables, work):
    """Fill ``work.tables[GAINS, j, r]``: the most that variables j, j+1, ... give one critical set while using up r."""
    resources = tables.resources.shape[1]
    for i in range(resources):
        work.tables[lay.GAINS, count, i] = 0
    for j in range(count - 1, -1, -1):
        factor = np.int64(0)
        for q in range(work.variables[lay.ROW, j], work.variables[lay.ROW, j + 1]):
            factor = max(factor, work.rows[lay.COEF, q])
        for i in range(resources):
            work.tables[lay.GAINS, j, i] = 0
        for g in range(work.variables[lay.ENTRY, j], work.variables[lay.ENTRY, j + 1]):
            shift = work.entries[lay.INDEX, g]
            for i in range(shift, resources):
                if work.tables[lay.WAYS, j + 1, i - shift] and fits(
                    tables.resources[lay.DIGITS, i], work.entries[lay.PACKED, g], tables.guard
                ):
                    gain = work.tables[lay.GAINS, j + 1, i - shift] + factor * work.entries[lay.GAIN, g]
                    if gain > work.tables[lay.GAINS, j, i]:
                        work.tables[lay.GAINS, j, i] = gain


@inner
def lay_lanes(count, sets, words, work):
    """Write, for each variable, its coefficients and what the later variables can contribute, a byte for each set.

    Returns False when a byte could overflow.
    """
    for i in range(2 * count * words):
        work.lanes[i] = 0
    for s in range(sets):
        work.sets[lay.LEFT, s] = 0
        if work.sets[lay.NEED, s] > lay.BYTE:
            return False
    for j in range(count - 1, -1, -1):
        base = 2 * j * words
        for s in range(sets):
            rest = min(work.sets[lay.LEFT, s], lay.BYTE)
            work.lanes[base + words + s // 8] |= np.uint64(rest) << np.uint64(8 * (s % 8))
        most = 0
        for g in range(work.variables[lay.ENTRY, j], work.variables[lay.ENTRY, j + 1]):
            most = max(most, work.entries[lay.GAIN, g])
        for q in range(work.variables[lay.ROW, j], work.variables[lay.ROW, j + 1]):
            s = work.rows[lay.SET, q]
            if work.rows[lay.COEF, q] * most > lay.BYTE:
                return False
            work.sets[lay.LEFT, s] += work.rows[lay.COEF, q] * most
            work.lanes[base + s // 8] |= np.uint64(work.rows[lay.COEF, q]) << np.uint64(8 * (s % 8))
        for s in range(8 * work.state[PLAIN], sets):
            most = 0
            for cover in range(work.state[LAID_COVERS]):
                given = cover_of(j, cover, s, work.state[LAID], work.classes, work.sets)
                place = (j * lay.COVERS + cover) * words + s // 8
                if s % 8 == 0:
                    work.covers[place] = np.uint64(0)
                work.covers[place] |= np.uint64(given) << np.uint64(8 * (s % 8))
                most = max(most, given)
            work.sets[lay.LEFT, s] += most
    return True
