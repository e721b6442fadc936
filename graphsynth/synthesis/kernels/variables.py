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
MAX_SETS = 4096


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
    row_set: NDArray[np.int64]
    row_coef: NDArray[np.int64]
    row_rest: NDArray[np.int64]  # what the later variables can still contribute
    ways: NDArray[np.int64]  # (variables + 1, resources) unconstrained completions
    at: NDArray[np.int64]  # the search stack: current choice of each variable
    used_index: NDArray[np.int64]
    product: NDArray[np.int64]
    state: NDArray[np.int64]  # scalars that survive between calls of a stream
    label: NDArray[np.int64]  # label of each class at a leaf


def make_work(resources: int, group: int = 50_000) -> Work:
    """Allocate the workspace for problems with the given number of resource states."""

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
        row_set=ints(sets * classes),
        row_coef=ints(sets * classes),
        row_rest=ints(sets * classes),
        ways=ints(classes + 1, resources),
        at=ints(classes + 1),
        used_index=ints(classes + 1),
        product=ints(classes + 1),
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

    Variables covered by the most critical sets come first: once no set needs anything any more, the rest is counted
    by a table.
    """
    for e in range(m):
        work.class_var[e] = -1
    count = 0
    score = np.empty(m, np.int64)
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
        total = 0
        for s in range(sets):
            total += popcount(work.set_mask[s] & mask)
        score[count] = total
        count += 1
    order = np.argsort(-score[:count])
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
    for s in range(sets):
        work.left[s] = 0
    for j in range(count - 1, -1, -1):
        kind = work.class_kind[work.var_rep[j]]
        own_kind = 2 * kind + work.var_own[j]
        heaviest = work.class_heaviest[work.var_rep[j]]
        most = 0
        for g in range(tables.group_lo[own_kind], tables.group_hi[own_kind]):
            y = heaviest - tables.group_weight[g]
            if y > most:
                most = y
        for q in range(work.row[j], work.row[j + 1]):
            work.row_rest[q] = work.left[work.row_set[q]]
            work.left[work.row_set[q]] += work.row_coef[q] * most
    return count


@njit(cache=True)
def unconstrained_ways(count, tables, work):
    """Fill ``work.ways[j, r]``: choices of variables j, j+1, ... that use up the resources r, sparsity ignored.

    Returns
    -------
    float
        The same number for all variables and the whole target in floating point; above 2**62 the table is useless.
    """
    resources = tables.final.shape[0]
    top = 1.0
    for i in range(resources):
        work.ways[count, i] = tables.final[i]
    for j in range(count - 1, -1, -1):
        own_kind = 2 * work.class_kind[work.var_rep[j]] + work.var_own[j]
        size = work.var_size[j]
        choices = 0.0
        for i in range(resources):
            work.ways[j, i] = 0
        for g in range(tables.group_lo[own_kind], tables.group_hi[own_kind]):
            packed = tables.group_packed[g] * size
            shift = tables.group_index[g] * size
            choices += tables.group_count[g]
            for i in range(shift, resources):
                if ((tables.packed_of[i] | tables.guard) - packed) & tables.guard == tables.guard:
                    work.ways[j, i] += tables.group_count[g] * work.ways[j + 1, i - shift]
        top *= choices
    return top


@njit(cache=True)
def start_needs(sets, work):
    """Reset what each critical set needs; return how many still need something."""
    for s in range(sets):
        work.left[s] = work.set_need[s]
    return sets
