"""Drawing labellings uniformly: the labellings fixed by one automorphism, numbered without regard to sparsity."""

from __future__ import annotations

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.synthesis.kernels.automorphisms import automorphisms
from graphsynth.synthesis.kernels.counting import (
    FRAME_NONE,
    FRAME_PATH,
    FRAME_VERTEX,
    TOO_LARGE,
    degree_of,
    fixed_by,
    frame_stabiliser,
)
from graphsynth.synthesis.kernels.layout import (
    COEF,
    COPIES,
    DIGITS,
    ENTRY,
    FLIP,
    GAIN,
    HEAVIEST,
    INDEX,
    KIND,
    LABELS,
    LABELS_END,
    LEFT,
    OWN,
    PACKED,
    REP,
    REVERSE,
    ROW,
    SET,
    SIZE,
    VAR,
    WAYS,
    WEIGHT,
    inner,
)
from graphsynth.synthesis.kernels.listing import HEADER
from graphsynth.synthesis.kernels.variables import (
    build_variables,
    fits,
    load_graph,
    plain_entries,
    start_needs,
    unconstrained_ways,
)


@kernel
def fixed_table(k, mult, frame_modes, frame_degree, tables, work, out):
    """Write a row (mode, frame, automorphism, automorphisms that keep the frame, labellings fixed) for each pair.

    Returns the number of rows, or a negative outcome as ``count_block``.
    """
    order = automorphisms(k, mult, work.perms)
    m, sets = load_graph(k, mult, tables, work)
    if order < 0 or sets < 0:
        return TOO_LARGE
    n = 0
    for mode in (FRAME_NONE, FRAME_VERTEX, FRAME_PATH):
        if not frame_modes & mode:
            continue
        frames = 1 if mode == FRAME_NONE else (k if mode == FRAME_VERTEX else m)
        for frame in range(frames):
            if mode == FRAME_VERTEX and frame_degree and degree_of(k, mult, frame) != frame_degree:
                continue
            kept = frame_stabiliser(order, mode, frame, work)
            if mode == FRAME_PATH:
                work.classes[KIND, frame] += 1
            for i in range(kept):
                if n == out.shape[0]:
                    return TOO_LARGE
                fixed = fixed_by(work.members[i], m, sets, tables, work)
                if fixed < 0:
                    return fixed
                out[n, 0] = mode
                out[n, 1] = frame
                out[n, 2] = work.members[i]
                out[n, 3] = kept
                out[n, 4] = fixed
                n += 1
            if mode == FRAME_PATH:
                work.classes[KIND, frame] -= 1
    return n


@kernel
def open_fixed(k, mult, mode, frame, member, tables, work):
    """Lay out the labellings fixed by one automorphism; return (variables, classes, sets, ways without sparsity)."""
    automorphisms(k, mult, work.perms)
    m, sets = load_graph(k, mult, tables, work)
    if mode == FRAME_PATH:
        work.classes[KIND, frame] += 1
    count = build_variables(m, sets, work.perms[member], tables, work)
    plain_entries(count, tables, work)
    unconstrained_ways(count, np.bool_(False), tables, work)
    return count, m, sets, work.tables[WAYS, 0, tables.target]


@inner
def _nth_label(j, g, rank, tables, work):
    """Return label number ``rank`` of those that entry g of variable j stands for."""
    kind = work.classes[KIND, work.variables[REP, j]]
    heaviest = work.classes[HEAVIEST, work.variables[REP, j]]
    packed = work.entries[PACKED, g]
    for label in range(tables.kinds[LABELS, kind], tables.kinds[LABELS_END, kind]):
        if work.variables[OWN, j] and tables.labels[REVERSE, label] != label:
            continue
        if heaviest - tables.labels[WEIGHT, label] != work.entries[GAIN, g]:
            continue
        if tables.labels[PACKED, label] * work.variables[SIZE, j] != packed:
            continue
        if rank == 0:
            return label
        rank -= 1
    return np.int64(-1)


@kernel
def decode_fixed(count, m, sets, number, tables, work, row):
    """Write labelling ``number`` of those laid out by ``open_fixed``; return whether it is admissible."""
    start_needs(sets, work)
    index = np.int64(tables.target)
    chosen = np.empty(count, np.int64)
    for j in range(count):
        for g in range(work.variables[ENTRY, j], work.variables[ENTRY, j + 1]):
            if not fits(tables.resources[DIGITS, index], work.entries[PACKED, g], tables.guard):
                continue
            ways = work.tables[WAYS, j + 1, index - work.entries[INDEX, g]]
            block = work.entries[COPIES, g] * ways
            if number >= block:
                number -= block
                continue
            chosen[j] = _nth_label(j, g, number // ways, tables, work)
            number %= ways
            index -= work.entries[INDEX, g]
            for q in range(work.variables[ROW, j], work.variables[ROW, j + 1]):
                s = work.rows[SET, q]
                work.sets[LEFT, s] -= work.rows[COEF, q] * work.entries[GAIN, g]
            break
    for s in range(sets):
        if work.sets[LEFT, s] > 0:
            return False
    for e in range(m):
        label = chosen[work.classes[VAR, e]]
        if work.classes[FLIP, e]:
            label = tables.labels[REVERSE, label]
        row[HEADER + e] = label
    return True
