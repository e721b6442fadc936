"""Counting the labellings of contracted graphs up to symmetry, without visiting them one by one.

Burnside: the number of orbits is the average, over the automorphisms g, of the number of labellings fixed by g.  A
depth-first search assigns the variables of one g until no critical set needs anything; the rest is read from a table.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from graphsynth.synthesis.kernels.automorphisms import automorphisms
from graphsynth.synthesis.kernels.variables import (
    build_variables,
    load_graph,
    start_needs,
    unconstrained_ways,
)

FRAME_NONE, FRAME_VERTEX, FRAME_PATH = 1, 2, 4
TOO_LARGE = -1
_LIMIT = 2.0**62


@njit(cache=True)
def count_fixed(count, unmet, tables, work, rank):
    """Count the admissible choices of all variables; stop inside the one numbered ``rank`` when rank >= 0.

    Stopping leaves the choices in ``work.at[: depth + 1]`` and returns ``(depth + 1, rank left)`` in ``work.state``:
    the remaining variables are free.
    """
    if unmet == 0:
        work.state[0] = 0
        work.state[1] = rank
        return work.ways[0, tables.target]
    total = np.int64(0)
    depth = 0
    own_kind = 2 * work.class_kind[work.var_rep[0]] + work.var_own[0]
    work.at[0] = tables.group_lo[own_kind]
    work.used_index[0] = tables.target
    work.product[0] = 1
    while True:
        own_kind = 2 * work.class_kind[work.var_rep[depth]] + work.var_own[depth]
        g = work.at[depth]
        if g == tables.group_hi[own_kind]:
            depth -= 1
            if depth < 0:
                return total
            g = work.at[depth]
            y = work.class_heaviest[work.var_rep[depth]] - tables.group_weight[g]
            for q in range(work.row[depth], work.row[depth + 1]):
                s = work.row_set[q]
                old = work.left[s]
                work.left[s] = old + work.row_coef[q] * y
                if old <= 0 and work.left[s] > 0:
                    unmet += 1
            work.at[depth] = g + 1
            continue
        size = work.var_size[depth]
        index = work.used_index[depth]
        if ((tables.packed_of[index] | tables.guard) - tables.group_packed[g] * size) & tables.guard != tables.guard:
            work.at[depth] = g + 1
            continue
        index -= tables.group_index[g] * size
        ways = work.ways[depth + 1, index]
        if ways == 0:
            work.at[depth] = g + 1
            continue
        y = work.class_heaviest[work.var_rep[depth]] - tables.group_weight[g]
        alive = True
        for q in range(work.row[depth], work.row[depth + 1]):
            s = work.row_set[q]
            old = work.left[s]
            new = old - work.row_coef[q] * y
            work.left[s] = new
            if old > 0 and new <= 0:
                unmet -= 1
            if new > work.row_rest[q]:
                alive = False
        if alive and unmet > 0:
            work.product[depth + 1] = work.product[depth] * tables.group_count[g]
            depth += 1
            work.used_index[depth] = index
            work.at[depth] = tables.group_lo[2 * work.class_kind[work.var_rep[depth]] + work.var_own[depth]]
            continue
        if alive:
            found = work.product[depth] * tables.group_count[g] * ways
            if rank >= 0 and total + found > rank:
                work.state[0] = depth + 1
                work.state[1] = rank - total
                work.used_index[depth + 1] = index
                return found
            total += found
        for q in range(work.row[depth], work.row[depth + 1]):
            s = work.row_set[q]
            old = work.left[s]
            work.left[s] = old + work.row_coef[q] * y
            if old <= 0 and work.left[s] > 0:
                unmet += 1
        work.at[depth] = g + 1


@njit(cache=True)
def fixed_by(member, m, sets, tables, work, rank):
    """Count the admissible labellings fixed by automorphism number ``member``, or TOO_LARGE."""
    count = build_variables(m, sets, work.perms[member], tables, work)
    if unconstrained_ways(count, tables, work) > _LIMIT:
        return np.int64(TOO_LARGE)
    return count_fixed(count, start_needs(sets, work), tables, work, rank)


@njit(cache=True)
def frame_stabiliser(order, frame_mode, frame, work):
    """Collect the automorphisms that keep the frame; return their number, 0 if the frame is not the first of its orbit."""
    kept = 0
    for g in range(order):
        if frame_mode == FRAME_NONE:
            image = frame
        elif frame_mode == FRAME_VERTEX:
            image = np.int64(work.perms[g, frame])
        else:
            image = work.class_of[work.perms[g, work.class_u[frame]], work.perms[g, work.class_v[frame]]]
        if image < frame:
            return 0
        if image == frame:
            work.members[kept] = g
            kept += 1
    return kept


@njit(cache=True)
def degree_of(k, mult, v):
    """Sum the multiplicities at vertex v."""
    total = 0
    for w in range(k):
        total += mult[v, w]
    return total


@njit(cache=True)
def count_block(k, mults, start, stop, frame_modes, frame_degree, tables, work, out):
    """Count the orbits of labellings of the contracted graphs ``mults[start:stop]``; one number each in ``out``.

    ``frame_modes`` is a sum of FRAME_NONE, FRAME_VERTEX, FRAME_PATH; ``frame_degree`` restricts FRAME_VERTEX to
    vertices of that degree (0: any).  Returns 0, or TOO_LARGE when a count passes 2**62 or a group is too large.
    """
    for h in range(start, stop):
        mult = mults[h]
        order = automorphisms(k, mult, work.perms)
        m, sets = load_graph(k, mult, tables, work)
        if order < 0 or sets < 0:
            return TOO_LARGE
        total = np.int64(0)
        for mode in (FRAME_NONE, FRAME_VERTEX, FRAME_PATH):
            if not frame_modes & mode:
                continue
            frames = 1 if mode == FRAME_NONE else (k if mode == FRAME_VERTEX else m)
            for frame in range(frames):
                if mode == FRAME_VERTEX and frame_degree and degree_of(k, mult, frame) != frame_degree:
                    continue
                kept = frame_stabiliser(order, mode, frame, work)
                if kept == 0:
                    continue
                if mode == FRAME_PATH:
                    work.class_kind[frame] += 1
                fixed = np.int64(0)
                for i in range(kept):
                    n = fixed_by(work.members[i], m, sets, tables, work, -1)
                    if n < 0 or fixed > (np.int64(1) << 62) - n:
                        return TOO_LARGE
                    fixed += n
                if mode == FRAME_PATH:
                    work.class_kind[frame] -= 1
                total += fixed // kept
        out[h - start] = total
    return 0
