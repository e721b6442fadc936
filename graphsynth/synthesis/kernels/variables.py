"""The counting problem of one contracted graph under one automorphism, laid out for the depth-first searches.

A *class* is the set of all parallel paths between two vertices of the contracted graph; its *label* says which paths
they are.  An automorphism g of the contracted graph permutes the classes and may reverse them.  The labellings fixed
by g take one free label per cycle of classes: a *variable*.  A variable whose class returns to itself reversed admits
only labels that equal their own reversal.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from graphsynth.synthesis.kernels.constraints import critical_sets, popcount

MAX_VERTICES = 18
MAX_CLASSES = 48
MAX_SETS = 1024
MAX_ENTRIES = 1 << 18
MAX_GAIN = 256


class Tables(NamedTuple):
    """Labels of classes, grouped by kind ``t = 2 * multiplicity + marked`` (see ``graphsynth.synthesis.alphabet``)."""

    label_lo: NDArray[np.int64]  # (kinds,) first label of a kind
    label_hi: NDArray[np.int64]
    label_weight: NDArray[np.int64]  # (labels,) D, the weight counted in the sparsity conditions
    label_index: NDArray[np.int64]  # (labels,) resources used, as a mixed-radix index
    label_packed: NDArray[np.int64]  # (labels,) the same, eight bits a digit
    label_reverse: NDArray[np.int64]  # (labels,) the label read from the other end
    label_fold: NDArray[np.int64]  # (labels,) largest number of equal paths
    group_lo: NDArray[np.int64]  # (2 * kinds,) labels alike for counting: kind 2 t + own_reverse
    group_hi: NDArray[np.int64]
    group_weight: NDArray[np.int64]
    group_index: NDArray[np.int64]
    group_packed: NDArray[np.int64]
    group_count: NDArray[np.int64]
    heaviest: NDArray[np.int64]  # (multiplicities,) largest weight of an unmarked label
    packed_of: NDArray[np.int64]  # (resources,) mixed-radix index -> packed digits
    final: NDArray[np.int64]  # (resources,) 1 where nothing but slack is left
    space: np.int64
    target: np.int64  # resources to be used up, as an index
    guard: np.int64  # the top bit of every packed digit


class Work(NamedTuple):
    """Workspace of one search; allocated once per process."""

    perms: NDArray[np.uint8]  # (group, MAX_VERTICES)
    members: NDArray[np.int64]  # automorphisms that fix the chosen frame
    class_u: NDArray[np.int64]
    class_v: NDArray[np.int64]
    class_kind: NDArray[np.int64]
    class_heaviest: NDArray[np.int64]
    class_of: NDArray[np.int64]  # (MAX_VERTICES, MAX_VERTICES)
    need: NDArray[np.int16]
    best: NDArray[np.int16]
    set_mask: NDArray[np.int64]
    set_need: NDArray[np.int64]
    left: NDArray[np.int64]  # what each critical set still needs, during a search
    var_rep: NDArray[np.int64]
    var_size: NDArray[np.int64]
    var_own: NDArray[np.int64]  # 1: only labels equal to their own reversal
    class_var: NDArray[np.int64]
    class_flip: NDArray[np.int64]
    row: NDArray[np.int64]  # constraints of variable j are entries row[j]..row[j+1]
    merged_row: NDArray[np.int64]
    row_set: NDArray[np.int64]
    row_coef: NDArray[np.int64]
    row_rest: NDArray[np.int64]  # what the later variables can still contribute
    entry_lo: NDArray[np.int64]  # choices of variable j are entries entry_lo[j]..entry_lo[j+1]
    entry_gain: NDArray[np.int64]  # y, what the choice contributes to each unit of coefficient
    entry_index: NDArray[np.int64]  # resources used by all classes of the variable
    entry_packed: NDArray[np.int64]
    entry_count: NDArray[np.int64]  # number of choices alike
    fresh: NDArray[np.int64]  # (gains, resources) two tables for products of variables
    stale: NDArray[np.int64]
    ways: NDArray[np.int64]  # (variables + 1, resources) unconstrained completions
    gains: NDArray[np.int64]  # (variables + 1, resources) the most they can contribute to one critical set
    lanes: NDArray[np.uint64]  # per variable: coefficients, then what later variables can contribute; a byte per set
    keys: NDArray[np.uint64]  # two layers of states of the dynamic program
    sums: NDArray[np.int64]
    slots: NDArray[np.int64]  # hash table: state number, and the layer it belongs to
    stamps: NDArray[np.int64]
    at: NDArray[np.int64]  # the search stack: current choice of each variable
    used_index: NDArray[np.int64]
    state: NDArray[np.int64]  # scalars that survive between calls of a stream
    label: NDArray[np.int64]  # label of each class at a leaf


def make_work(resources: int, group: int = 20_000, key_words: int = 1 << 18) -> Work:
    """Allocate the workspace for problems with the given number of resource states.

    ``group`` bounds the order of automorphism groups, ``key_words`` (a power of two) the states of the dynamic program.
    """

    def ints(*shape: int) -> NDArray[np.int64]:
        return np.zeros(shape, np.int64)

    sets, classes = MAX_SETS, MAX_CLASSES
    return Work(
        perms=np.zeros((group, MAX_VERTICES), np.uint8),
        members=ints(group),
        class_u=ints(classes),
        class_v=ints(classes),
        class_kind=ints(classes),
        class_heaviest=ints(classes),
        class_of=ints(MAX_VERTICES, MAX_VERTICES),
        need=np.zeros(1 << MAX_VERTICES, np.int16),
        best=np.zeros(1 << MAX_VERTICES, np.int16),
        set_mask=ints(sets),
        set_need=ints(sets),
        left=ints(sets),
        var_rep=ints(classes),
        var_size=ints(classes),
        var_own=ints(classes),
        class_var=ints(classes),
        class_flip=ints(classes),
        row=ints(classes + 1),
        merged_row=ints(classes + 1),
        row_set=ints(sets * classes),
        row_coef=ints(sets * classes),
        row_rest=ints(sets * classes),
        entry_lo=ints(classes + 1),
        entry_gain=ints(MAX_ENTRIES),
        entry_index=ints(MAX_ENTRIES),
        entry_packed=ints(MAX_ENTRIES),
        entry_count=ints(MAX_ENTRIES),
        fresh=ints(MAX_GAIN, resources),
        stale=ints(MAX_GAIN, resources),
        ways=ints(classes + 1, resources),
        gains=ints(classes + 1, resources),
        lanes=np.zeros(2 * classes * (sets // 8), np.uint64),
        keys=np.zeros(2 * key_words, np.uint64),
        sums=ints(key_words),
        slots=ints(key_words),
        stamps=ints(key_words),
        at=ints(classes + 1),
        used_index=ints(classes + 1),
        state=ints(16),
        label=ints(classes),
    )


@njit(cache=True)
def load_graph(k, mult, tables, work):
    """Lay out the classes of a contracted graph; return their number and the number of critical sets."""
    m = 0
    for u in range(k):
        for v in range(u + 1, k):
            if mult[u, v]:
                work.class_u[m] = u
                work.class_v[m] = v
                work.class_kind[m] = 2 * np.int64(mult[u, v])
                work.class_heaviest[m] = tables.heaviest[mult[u, v]]
                work.class_of[u, v] = m
                work.class_of[v, u] = m
                m += 1
    sets = critical_sets(
        k, m, work.class_u, work.class_v, work.class_heaviest, tables.space,
        work.need, work.best, work.set_mask, work.set_need,
    )  # fmt: skip
    return m, sets


@njit(cache=True)
def build_variables(m, sets, perm, tables, work):
    """Set up the variables of the labellings fixed by one automorphism; return their number.

    Variables that decide small critical sets come first, variables in none last: once no set needs anything any more,
    the rest is counted by a table.
    """
    for e in range(m):
        work.class_var[e] = -1
    count = 0
    masks = np.empty(m, np.int64)
    for e in range(m):
        if work.class_var[e] >= 0:
            continue
        at = e
        flip = 0
        size = 0
        mask = np.int64(0)
        while True:
            work.class_var[at] = count
            work.class_flip[at] = flip
            mask |= np.int64(1) << at
            size += 1
            a = perm[work.class_u[at]]
            b = perm[work.class_v[at]]
            if a > b:
                flip ^= 1
            at = work.class_of[a, b]
            if at == e:
                break
        work.var_rep[count] = e
        work.var_size[count] = size
        work.var_own[count] = flip
        masks[count] = mask
        count += 1
    order = _smallest_sets_first(count, sets, masks, work)
    rank = np.empty(count, np.int64)
    rep = work.var_rep[:count].copy()
    size_ = work.var_size[:count].copy()
    own = work.var_own[:count].copy()
    for j in range(count):
        rank[order[j]] = j
        work.var_rep[j] = rep[order[j]]
        work.var_size[j] = size_[order[j]]
        work.var_own[j] = own[order[j]]
    for e in range(m):
        work.class_var[e] = rank[work.class_var[e]]
    at = 0
    for j in range(count):
        work.row[j] = at
        mask = masks[order[j]]
        for s in range(sets):
            c = popcount(work.set_mask[s] & mask)
            if c:
                work.row_set[at] = s
                work.row_coef[at] = c
                at += 1
    work.row[count] = at
    return count


@njit(cache=True)
def _smallest_sets_first(count, sets, masks, work):
    """Order the variables so that critical sets are decided early: the set with fewest open variables comes next."""
    order = np.empty(count, np.int64)
    opened = np.zeros(count, np.bool_)
    placed = 0
    while placed < count:
        fewest = count + 1
        chosen = -1
        for s in range(sets):
            left = 0
            for j in range(count):
                if not opened[j] and work.set_mask[s] & masks[j]:
                    left += 1
            if 0 < left < fewest:
                fewest = left
                chosen = s
        inside = work.set_mask[chosen] if chosen >= 0 else np.int64(-1)
        first = placed
        for j in range(count):
            if not opened[j] and (chosen < 0 or inside & masks[j]):
                opened[j] = True
                order[placed] = j
                placed += 1
        # within the set, variables that serve more sets come first
        for i in range(first + 1, placed):
            j = order[i]
            weight = _coverage(masks[j], sets, work)
            at = i
            while at > first and _coverage(masks[order[at - 1]], sets, work) < weight:
                order[at] = order[at - 1]
                at -= 1
            order[at] = j
    return order


@njit(cache=True)
def _coverage(mask, sets, work):
    total = 0
    for s in range(sets):
        if work.set_mask[s] & mask:
            total += 1
    return total


@njit(cache=True)
def plain_entries(count, tables, work):
    """Give each variable its own choices, one entry for each group of labels alike; return False on overflow."""
    at = 0
    for j in range(count):
        work.entry_lo[j] = at
        own_kind = 2 * work.class_kind[work.var_rep[j]] + work.var_own[j]
        size = work.var_size[j]
        heaviest = work.class_heaviest[work.var_rep[j]]
        for g in range(tables.group_lo[own_kind], tables.group_hi[own_kind]):
            packed = tables.group_packed[g] * size
            if not fits(tables.packed_of[tables.target], packed, tables.guard):
                continue
            if at == MAX_ENTRIES:
                return False
            work.entry_gain[at] = heaviest - tables.group_weight[g]
            work.entry_index[at] = tables.group_index[g] * size
            work.entry_packed[at] = packed
            work.entry_count[at] = tables.group_count[g]
            at += 1
    work.entry_lo[count] = at
    return True


@njit(cache=True)
def fits(available, packed, guard):
    """Tell whether every digit of ``packed`` is at most that of ``available``."""
    return ((available | guard) - packed) & guard == guard


@njit(cache=True)
def _same_row(i, j, work):
    """Tell whether two variables enter the critical sets with the same coefficients."""
    size = work.row[i + 1] - work.row[i]
    if work.row[j + 1] - work.row[j] != size:
        return False
    for q in range(size):
        a = work.row[i] + q
        b = work.row[j] + q
        if work.row_set[a] != work.row_set[b] or work.row_coef[a] != work.row_coef[b]:
            return False
    return True


@njit(cache=True)
def _multiply_in(j, top, tables, work):
    """Multiply the table of gains and resources by the choices of variable j; return the new largest gain."""
    resources = tables.final.shape[0]
    own_kind = 2 * work.class_kind[work.var_rep[j]] + work.var_own[j]
    size = work.var_size[j]
    heaviest = work.class_heaviest[work.var_rep[j]]
    most = 0
    for g in range(tables.group_lo[own_kind], tables.group_hi[own_kind]):
        most = max(most, heaviest - tables.group_weight[g])
    if top + most >= MAX_GAIN:
        return -1
    for y in range(top + 1):
        for i in range(resources):
            work.stale[y, i] = work.fresh[y, i]
    for y in range(top + most + 1):
        for i in range(resources):
            work.fresh[y, i] = 0
    limit = tables.packed_of[tables.target]
    for g in range(tables.group_lo[own_kind], tables.group_hi[own_kind]):
        gain = heaviest - tables.group_weight[g]
        shift = tables.group_index[g] * size
        packed = tables.group_packed[g] * size
        for y in range(top + 1):
            for i in range(resources - shift):
                n = work.stale[y, i]
                if n and fits(limit, tables.packed_of[i] + packed, tables.guard):
                    work.fresh[y + gain, i + shift] += n * tables.group_count[g]
    return top + most


@njit(cache=True)
def merged_entries(count, tables, work):
    """Merge variables that enter all critical sets alike: only the sum of their gains matters.

    Variables outside every critical set stay as they are; their choices are counted by ``unconstrained_ways``.

    Returns
    -------
    int
        The new number of variables, or -1 on overflow.
    """
    resources = tables.final.shape[0]
    kept = 0
    at = 0
    row_at = 0
    done = np.zeros(count, np.bool_)
    for j in range(count):
        if done[j]:
            continue
        for i in range(resources):
            work.fresh[0, i] = 0
        work.fresh[0, 0] = 1
        top = 0
        first, last = work.row[j], work.row[j + 1]
        for i in range(j, count):
            if done[i] or (i > j and (first == last or not _same_row(j, i, work))):
                continue
            done[i] = True
            top = _multiply_in(i, top, tables, work)
            if top < 0:
                return -1
        work.entry_lo[kept] = at
        for y in range(top + 1):
            for i in range(resources):
                if work.fresh[y, i]:
                    if at == MAX_ENTRIES:
                        return -1
                    work.entry_gain[at] = y
                    work.entry_index[at] = i
                    work.entry_packed[at] = tables.packed_of[i]
                    work.entry_count[at] = work.fresh[y, i]
                    at += 1
        # rows move to the front; row[j + 1] of a variable not yet looked at is never overwritten before it is read
        work.merged_row[kept] = row_at
        for q in range(first, last):
            work.row_set[row_at] = work.row_set[q]
            work.row_coef[row_at] = work.row_coef[q]
            row_at += 1
        kept += 1
    work.entry_lo[kept] = at
    work.merged_row[kept] = row_at
    for j in range(kept + 1):
        work.row[j] = work.merged_row[j]
    return kept


@njit(cache=True)
def unconstrained_ways(count, yes_or_no, tables, work):
    """Fill ``work.ways[j, r]``: choices of variables j, j+1, ... that use up the resources r, sparsity ignored.

    With ``yes_or_no`` the table only tells whether there are any (and cannot overflow).

    Returns
    -------
    float
        The number of choices of all variables, resources ignored; above 2**62 the table may have overflowed.
    """
    resources = tables.final.shape[0]
    top = 1.0
    for i in range(resources):
        work.ways[count, i] = tables.final[i]
    for j in range(count - 1, -1, -1):
        choices = 0.0
        for i in range(resources):
            work.ways[j, i] = 0
        for g in range(work.entry_lo[j], work.entry_lo[j + 1]):
            shift = work.entry_index[g]
            packed = work.entry_packed[g]
            choices += work.entry_count[g]
            for i in range(shift, resources):
                if fits(tables.packed_of[i], packed, tables.guard):
                    if yes_or_no:
                        work.ways[j, i] |= work.ways[j + 1, i - shift]
                    else:
                        work.ways[j, i] += work.entry_count[g] * work.ways[j + 1, i - shift]
        top *= choices
    return top


@njit(cache=True)
def remaining_gains(count, sets, work):
    """Fill ``row_rest``: what the variables after j can still contribute to each critical set of j."""
    for s in range(sets):
        work.left[s] = 0
    for j in range(count - 1, -1, -1):
        most = 0
        for g in range(work.entry_lo[j], work.entry_lo[j + 1]):
            most = max(most, work.entry_gain[g])
        for q in range(work.row[j], work.row[j + 1]):
            work.row_rest[q] = work.left[work.row_set[q]]
            work.left[work.row_set[q]] += work.row_coef[q] * most


@njit(cache=True)
def start_needs(sets, work):
    """Reset what each critical set needs, for a depth-first search."""
    for s in range(sets):
        work.left[s] = work.set_need[s]
