"""Counting the labellings of contracted graphs up to symmetry, without visiting them one by one; drawing one.

Burnside: the number of orbits is the average, over the automorphisms g, of the number of labellings fixed by g.  For
each g the variables are taken one by one, and partial choices that leave the same needs and the same resources are
merged into one state with a count; as soon as no critical set needs anything, the rest is read from a table.  To draw
uniformly, the labellings fixed by one automorphism are numbered without regard to sparsity.
"""

from __future__ import annotations

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.synthesis.kernels import layout as lay
from graphsynth.synthesis.kernels.contracted import automorphisms
from graphsynth.synthesis.kernels.covers import LAID, PLAIN, cover_of
from graphsynth.synthesis.kernels.layout import glue, inner
from graphsynth.synthesis.kernels.variables import (
    build_variables,
    fits,
    lay_gains,
    lay_lanes,
    load_graph,
    plain_entries,
    unconstrained_ways,
)

FRAME_NONE, FRAME_VERTEX, FRAME_PATH = 1, 2, 4
TOO_LARGE = -1
NO_ROOM = -2
LISTING, COUNTING, MAKING = range(3)  # what contracted graphs are wanted for
STEPS = 17  # in work.state: words of states looked at
_LIMIT = 2.0**62


@inner
def _store(key, words, number, layer, shift, value, keys, states):
    """Add ``value`` to the state ``key[:words]`` of a layer; return its number of states, or -1 when full.

    ``shift`` is where the layer starts: key words in ``keys``; sums start at half of that.
    """
    capacity = states.shape[1]
    h = np.uint64(1469598103934665603)
    for i in range(words):
        h = (h ^ key[i]) * np.uint64(0x9E3779B97F4A7C15)
        h ^= h >> np.uint64(29)
    slot = np.int64(h & np.uint64(capacity - 1))
    half = shift >> 1
    while states[lay.STAMP, slot] == layer:
        at = states[lay.SLOT, slot]
        same = True
        for i in range(words):
            if keys[shift + at * words + i] != key[i]:
                same = False
                break
        if same:
            states[lay.SUM, half + at] += value
            return number
        slot = (slot + 1) & (capacity - 1)
    if (number + 1) * words > capacity:  # two words at least: half of the slots remain free
        return -1
    states[lay.STAMP, slot] = layer
    states[lay.SLOT, slot] = number
    for i in range(words):
        keys[shift + number * words + i] = key[i]
    states[lay.SUM, half + number] = value
    return number + 1


@inner
def count_states(count, sets, tables, work):
    """Count the admissible choices of all variables; TOO_LARGE for too large numbers, NO_ROOM in the workspace.

    A state is what each set still needs (a byte each, never below 0) and the resources left.  States in which no set
    needs anything are finished by ``work.tables[WAYS]``.
    """
    work.state[STEPS] = 0
    if sets == 0:
        return work.tables[lay.WAYS, 0, tables.target]
    needs = (sets + 7) // 8
    words = needs + 1
    plain = work.state[PLAIN]
    if not lay_lanes(count, sets, needs, work):
        return np.int64(TOO_LARGE)
    lay_gains(count, tables, work)
    capacity = work.states.shape[1]
    key = np.zeros(words, np.uint64)  # the first layer: one state, all needs and all resources
    for s in range(sets):
        key[s // 8] |= np.uint64(work.sets[lay.NEED, s]) << np.uint64(8 * (s % 8))
    key[needs] = np.uint64(tables.target)
    work.state[1] += 1
    shift = np.int64(0)
    states = _store(key, words, np.int64(0), work.state[1], shift, np.int64(1), work.keys, work.states)
    total = np.int64(0)
    for j in range(count):  # from layer to layer by the choices of one variable
        coefs = 2 * j * needs
        rests = coefs + needs
        other = capacity - shift
        work.state[1] += 1
        layer = work.state[1]
        fresh = np.int64(0)
        work.state[STEPS] += states * needs * (work.variables[lay.ENTRY, j + 1] - work.variables[lay.ENTRY, j])
        for at in range(states):
            base = shift + at * words
            left = np.int64(work.keys[base + needs])
            value = work.states[lay.SUM, (shift >> 1) + at]
            for g in range(work.variables[lay.ENTRY, j], work.variables[lay.ENTRY, j + 1]):
                if not fits(tables.resources[lay.DIGITS, left], work.entries[lay.PACKED, g], tables.guard):
                    continue
                index = left - work.entries[lay.INDEX, g]
                ways = work.tables[lay.WAYS, j + 1, index]
                if ways == 0:
                    continue
                gain = np.uint64(work.entries[lay.GAIN, g])
                cap = np.uint64(min(work.tables[lay.GAINS, j + 1, index], lay.BYTE)) * lay.ONES
                # eight sets at a time: needs less gains, not below 0; later variables must be able to give the rest
                alive = lay.TOP
                open_ = np.uint64(0)
                for i in range(plain, needs):  # revolute joints that links and loops need
                    raised = (work.keys[base + i] | lay.TOP) - work.covers[
                        (j * lay.COVERS + work.entries[lay.COVER, g]) * needs + i
                    ]
                    keep = raised & lay.TOP
                    need = raised & (keep - (keep >> np.uint64(7)))
                    alive &= (work.lanes[rests + i] | lay.TOP) - need
                    open_ |= need
                    key[i] = need
                for i in range(plain):
                    raised = (work.keys[base + i] | lay.TOP) - work.lanes[coefs + i] * gain
                    keep = raised & lay.TOP
                    need = raised & (keep - (keep >> np.uint64(7)))
                    alive &= (work.lanes[rests + i] | lay.TOP) - need
                    alive &= (cap | lay.TOP) - need
                    open_ |= need
                    key[i] = need
                if alive != lay.TOP:
                    continue
                if open_ == 0:  # nothing is needed any more: the table counts the rest
                    total += value * work.entries[lay.COPIES, g] * ways
                    continue
                key[needs] = np.uint64(index)
                more = value * work.entries[lay.COPIES, g]
                fresh = _store(key, words, fresh, layer, other, more, work.keys, work.states)
                if fresh < 0:
                    return np.int64(NO_ROOM)
        states = fresh
        shift = other
        if states == 0:
            break
    return total


@glue
def fixed_by(member, m, sets, tables, work):
    """Count the admissible labellings fixed by automorphism number ``member``; negative: see ``count_states``."""
    count = build_variables(m, sets, work.perms[member], tables, work)
    if not plain_entries(count, tables, work) or unconstrained_ways(count, np.bool_(False), tables, work) > _LIMIT:
        return np.int64(TOO_LARGE)
    return count_states(count, sets, tables, work)


@inner
def frame_stabiliser(order, frame_mode, frame, work):
    """Collect the automorphisms that keep the frame; return their number, 0 unless it is the first of its orbit."""
    kept = 0
    for g in range(order):
        if frame_mode == FRAME_NONE:
            image = frame
        elif frame_mode == FRAME_VERTEX:
            image = np.int64(work.perms[g, frame])
        else:
            image = work.class_of[work.perms[g, work.classes[lay.U, frame]], work.perms[g, work.classes[lay.V, frame]]]
        if image < frame:
            return 0
        if image == frame:
            work.members[kept] = g
            kept += 1
    return kept


@inner
def degree_of(k, mult, v):
    """Sum the multiplicities at vertex v."""
    total = 0
    for w in range(k):
        if w != v:
            total += mult[v, w] & lay.COPIES_MASK
    return total


@inner
def can_be_frame(k, mult, v, degree):
    """Tell whether vertex v is a link, with the wanted number of joints (0: any)."""
    return mult[v, v] == 0 and (degree == 0 or degree_of(k, mult, v) == degree)


@kernel
def count_block(k, mults, start, stop, frame_modes, frame_degree, tables, work, out, pairs):
    """Count the orbits of labellings of the contracted graphs ``mults[start:stop]``; one number each in ``out``.

    ``frame_modes`` is a sum of FRAME_NONE, FRAME_VERTEX, FRAME_PATH; ``frame_degree`` restricts FRAME_VERTEX to
    vertices of that degree (0: any).  ``pairs``, unless it is empty, takes a row (mode, frame, automorphism,
    automorphisms that keep the frame, labellings fixed) for each pair of frame and automorphism.  Returns the number of
    these rows, TOO_LARGE (a count passes 2**62, or a group is too large), or NO_ROOM.
    """
    rows = np.int64(0)
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
                if mode == FRAME_VERTEX and not can_be_frame(k, mult, frame, frame_degree):
                    continue
                kept = frame_stabiliser(order, mode, frame, work)
                if kept == 0:  # the first of its orbit stands for this frame
                    continue
                if mode == FRAME_PATH:
                    work.classes[lay.KIND, frame] += 1
                fixed = np.int64(0)
                # Burnside: the mean number of labellings fixed
                for i in range(kept):
                    n = fixed_by(work.members[i], m, sets, tables, work)
                    if n < 0:
                        return n
                    if fixed > (np.int64(1) << 62) - n:
                        return TOO_LARGE
                    fixed += n
                    if pairs.shape[0]:  # wanted for drawing
                        if rows == pairs.shape[0]:
                            return TOO_LARGE
                        pairs[rows, 0] = mode
                        pairs[rows, 1] = frame
                        pairs[rows, 2] = work.members[i]
                        pairs[rows, 3] = kept
                        pairs[rows, 4] = n
                        rows += 1
                if mode == FRAME_PATH:
                    work.classes[lay.KIND, frame] -= 1
                if total > (np.int64(1) << 62) - fixed // kept:
                    return TOO_LARGE
                total += fixed // kept
        out[h - start] = total
    return rows


@inner
def _least(e, others, turned, tables, work):
    """Estimate how often the label of a class is at most those of ``others`` classes alike, and at most its reverse."""
    kind = work.classes[lay.KIND, e]
    above = least = same = 0.0
    for label in range(tables.kinds[lay.LABELS_END, kind] - 1, tables.kinds[lay.LABELS, kind] - 1, -1):
        packed = tables.labels[lay.PACKED, label]
        if tables.labels[lay.WEIGHT, label] < tables.space and fits(
            tables.resources[lay.DIGITS, tables.target], packed, tables.guard
        ):
            # the others are as free as if the first variable were this class
            ways = float(work.tables[lay.WAYS, 1, tables.target - tables.labels[lay.INDEX, label]])
            above += ways
            least += ways * above**others
            if tables.labels[lay.REVERSE, label] == label:
                same += ways
    if above == 0.0:
        return 1.0
    return least / above ** (others + 1) * (0.5 + 0.5 * same / above if turned else 1.0)


@inner
def _visited(order, m, tables, work):
    """Estimate the share of the labellings that the search for the first of each orbit visits, see ``_lay_pairs``.

    Some classes have the least label of all to which an automorphism takes them that moves no class before.
    """
    share = 1.0
    for e in range(m):
        work.classes[lay.VAR, e] = 0  # of the classes to which this one is taken
    for e in range(m):
        others = np.int64(0)
        turned = False
        for i in range(1, order):
            perm = work.perms[i]
            first = np.int64(0)
            while first < e and _stays(first, perm, work):
                first += 1
            if first < e or _stays(e, perm, work):
                continue
            image = work.class_of[perm[work.classes[lay.U, e]], perm[work.classes[lay.V, e]]]
            if image == e:
                turned = True
            elif work.classes[lay.VAR, image] <= e:
                work.classes[lay.VAR, image] = e + 1
                others += 1
        if others or turned:
            share *= _least(e, others, turned, tables, work)
    return max(share, 1.0 / order)


@inner
def _stays(e, perm, work):
    """Tell whether a vertex permutation takes a class to itself, not reversed."""
    a = perm[work.classes[lay.U, e]]
    b = perm[work.classes[lay.V, e]]
    return a < b and work.class_of[a, b] == e


@kernel
def weigh_block(k, mults, chosen, purpose, tables, work, out):
    """Estimate the work that contracted graphs cost; a whole number for each of ``chosen``, in microseconds or so.

    LISTING visits labellings and writes out one of each orbit, COUNTING lays out the variables of each automorphism and
    steps through states; of MAKING the work is the number of chains.  A graph that is too large is given -1.
    """
    for i in range(chosen.shape[0]):
        out[i] = -1.0
        order = automorphisms(k, mults[chosen[i]], work.perms)
        m, sets = load_graph(k, mults[chosen[i]], tables, work)
        if order < 0 or sets < 0:
            continue
        fixed = 0.0
        for g in range(order if purpose == MAKING else 1):
            n = fixed_by(g, m, sets, tables, work)
            fixed += n
            if n < 0:
                fixed = -1.0
                break
        if fixed < 0:
            continue
        if purpose == LISTING:
            out[i] = np.floor(35.0 + fixed * _visited(order, m, tables, work) * (48 + k) / 60.0)
        elif purpose == COUNTING:
            out[i] = np.floor(12.0 + (np.int64(1) << k) / 100.0 + order * sets * m / 12.0 + work.state[STEPS] / 25.0)
        else:
            out[i] = np.floor(1.0 + fixed / order)


@kernel
def open_fixed(k, mult, mode, frame, member, tables, work):
    """Lay out the labellings fixed by one automorphism; return (variables, classes, sets, ways without sparsity)."""
    automorphisms(k, mult, work.perms)
    m, sets = load_graph(k, mult, tables, work)
    if mode == FRAME_PATH:
        work.classes[lay.KIND, frame] += 1
    count = build_variables(m, sets, work.perms[member], tables, work)
    plain_entries(count, tables, work)
    unconstrained_ways(count, np.bool_(False), tables, work)
    return count, m, sets, work.tables[lay.WAYS, 0, tables.target]


@inner
def _nth_label(j, g, rank, tables, work):
    """Return label number ``rank`` of those that entry g of variable j stands for."""
    kind = work.classes[lay.KIND, work.variables[lay.REP, j]]
    heaviest = work.classes[lay.HEAVIEST, work.variables[lay.REP, j]]
    packed = work.entries[lay.PACKED, g]
    for label in range(tables.kinds[lay.LABELS, kind], tables.kinds[lay.LABELS_END, kind]):
        if work.variables[lay.OWN, j] and tables.labels[lay.REVERSE, label] != label:
            continue
        if heaviest - tables.labels[lay.WEIGHT, label] != work.entries[lay.GAIN, g]:
            continue
        if tables.labels[lay.PACKED, label] * work.variables[lay.SIZE, j] != packed:
            continue
        if tables.labels[lay.LABEL_COVER, label] != work.entries[lay.COVER, g]:
            continue
        if rank == 0:
            return label
        rank -= 1
    return np.int64(-1)


@kernel
def decode_fixed(count, m, sets, number, tables, work, row):
    """Write labelling ``number`` of those laid out by ``open_fixed``; return whether it is admissible."""
    for s in range(sets):
        work.sets[lay.LEFT, s] = work.sets[lay.NEED, s]
    index = np.int64(tables.target)
    chosen = np.empty(count, np.int64)
    for j in range(count):
        for g in range(work.variables[lay.ENTRY, j], work.variables[lay.ENTRY, j + 1]):
            if not fits(tables.resources[lay.DIGITS, index], work.entries[lay.PACKED, g], tables.guard):
                continue
            ways = work.tables[lay.WAYS, j + 1, index - work.entries[lay.INDEX, g]]
            block = work.entries[lay.COPIES, g] * ways
            if number >= block:
                number -= block
                continue
            chosen[j] = _nth_label(j, g, number // ways, tables, work)
            number %= ways
            index -= work.entries[lay.INDEX, g]
            for q in range(work.variables[lay.ROW, j], work.variables[lay.ROW, j + 1]):
                s = work.rows[lay.SET, q]
                work.sets[lay.LEFT, s] -= work.rows[lay.COEF, q] * work.entries[lay.GAIN, g]
            for s in range(8 * work.state[PLAIN], sets):
                work.sets[lay.LEFT, s] -= cover_of(
                    j, work.entries[lay.COVER, g], s, work.state[LAID], work.classes, work.sets
                )
            break
    for s in range(sets):
        if work.sets[lay.LEFT, s] > 0:
            return False
    for e in range(m):
        label = chosen[work.classes[lay.VAR, e]]
        if work.classes[lay.FLIP, e]:
            label = tables.labels[lay.REVERSE, label]
        row[lay.HEADER + e] = label
    return True
