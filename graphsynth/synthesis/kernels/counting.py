"""Counting the labellings of contracted graphs up to symmetry, without visiting them one by one.

Burnside: the number of orbits is the average, over the automorphisms g, of the number of labellings fixed by g.  For
each g the variables are taken one by one, and partial choices that leave the same needs and the same resources are
merged into one state with a count; as soon as no critical set needs anything, the rest is read from a table.
"""

from __future__ import annotations

import numpy as np

from graphsynth.compilation import kernel
from graphsynth.synthesis.kernels.automorphisms import automorphisms
from graphsynth.synthesis.kernels.layout import (
    BYTE,
    COPIES,
    DIGITS,
    ENTRY,
    GAIN,
    GAINS,
    INDEX,
    KIND,
    NEED,
    ONES,
    PACKED,
    SLOT,
    STAMP,
    SUM,
    TOP,
    WAYS,
    U,
    V,
    glue,
    inner,
)
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
_LIMIT = 2.0**62


@inner
def _store(key, words, number, layer, shift, value, work):
    """Add ``value`` to the state ``key[:words]`` of a layer; return its number of states, or -1 when full.

    ``shift`` is where the layer starts: key words in ``work.keys``; sums start at half of that.
    """
    capacity = work.states.shape[1]
    h = np.uint64(1469598103934665603)
    for i in range(words):
        h = (h ^ key[i]) * np.uint64(0x9E3779B97F4A7C15)
        h ^= h >> np.uint64(29)
    slot = np.int64(h & np.uint64(capacity - 1))
    half = shift >> 1
    while work.states[STAMP, slot] == layer:
        at = work.states[SLOT, slot]
        same = True
        for i in range(words):
            if work.keys[shift + at * words + i] != key[i]:
                same = False
                break
        if same:
            work.states[SUM, half + at] += value
            return number
        slot = (slot + 1) & (capacity - 1)
    if (number + 1) * words > capacity or 2 * (number + 1) > capacity:
        return -1
    work.states[STAMP, slot] = layer
    work.states[SLOT, slot] = number
    for i in range(words):
        work.keys[shift + number * words + i] = key[i]
    work.states[SUM, half + number] = value
    return number + 1


@inner
def count_states(count, sets, tables, work):
    """Count the admissible choices of all variables by dynamic programming.

    A state is what each critical set still needs (a byte each, never below 0) and the resources left.  States in
    which no set needs anything are finished by ``work.tables[WAYS]``.

    Returns
    -------
    int
        The number, TOO_LARGE when the arithmetic does not suffice, or NO_ROOM when the workspace is too small.
    """
    if sets == 0:
        return work.tables[WAYS, 0, tables.target]
    needs = (sets + 7) // 8
    words = needs + 1
    if not lay_lanes(count, sets, needs, work):
        return np.int64(TOO_LARGE)
    lay_gains(count, tables, work)
    capacity = work.states.shape[1]
    key = np.zeros(words, np.uint64)
    for s in range(sets):
        key[s // 8] |= np.uint64(work.sets[NEED, s]) << np.uint64(8 * (s % 8))
    key[needs] = np.uint64(tables.target)
    work.state[1] += 1
    shift = np.int64(0)
    states = _store(key, words, np.int64(0), work.state[1], shift, np.int64(1), work)
    total = np.int64(0)
    for j in range(count):
        coefs = 2 * j * needs
        rests = coefs + needs
        other = capacity - shift
        work.state[1] += 1
        layer = work.state[1]
        fresh = np.int64(0)
        for at in range(states):
            base = shift + at * words
            left = np.int64(work.keys[base + needs])
            value = work.states[SUM, (shift >> 1) + at]
            for g in range(work.variables[ENTRY, j], work.variables[ENTRY, j + 1]):
                if not fits(tables.resources[DIGITS, left], work.entries[PACKED, g], tables.guard):
                    continue
                index = left - work.entries[INDEX, g]
                ways = work.tables[WAYS, j + 1, index]
                if ways == 0:
                    continue
                gain = np.uint64(work.entries[GAIN, g])
                cap = np.uint64(min(work.tables[GAINS, j + 1, index], BYTE)) * ONES
                alive = TOP
                open_ = np.uint64(0)
                for i in range(needs):
                    raised = (work.keys[base + i] | TOP) - work.lanes[coefs + i] * gain
                    keep = raised & TOP
                    need = raised & (keep - (keep >> np.uint64(7)))
                    alive &= (work.lanes[rests + i] | TOP) - need
                    alive &= (cap | TOP) - need
                    open_ |= need
                    key[i] = need
                if alive != TOP:
                    continue
                if open_ == 0:
                    total += value * work.entries[COPIES, g] * ways
                    continue
                key[needs] = np.uint64(index)
                fresh = _store(key, words, fresh, layer, other, value * work.entries[COPIES, g], work)
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
    if not plain_entries(count, tables, work):
        return np.int64(TOO_LARGE)
    if count < 0 or unconstrained_ways(count, np.bool_(False), tables, work) > _LIMIT:
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
            image = work.class_of[work.perms[g, work.classes[U, frame]], work.perms[g, work.classes[V, frame]]]
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
        total += mult[v, w]
    return total


@kernel
def count_block(k, mults, start, stop, frame_modes, frame_degree, tables, work, out):
    """Count the orbits of labellings of the contracted graphs ``mults[start:stop]``; one number each in ``out``.

    ``frame_modes`` is a sum of FRAME_NONE, FRAME_VERTEX, FRAME_PATH; ``frame_degree`` restricts FRAME_VERTEX to
    vertices of that degree (0: any).  Returns 0, TOO_LARGE (a count passes 2**62, or a group is too large), or NO_ROOM.
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
                    work.classes[KIND, frame] += 1
                fixed = np.int64(0)
                for i in range(kept):
                    n = fixed_by(work.members[i], m, sets, tables, work)
                    if n < 0:
                        return n
                    if fixed > (np.int64(1) << 62) - n:
                        return TOO_LARGE
                    fixed += n
                if mode == FRAME_PATH:
                    work.classes[KIND, frame] -= 1
                if total > (np.int64(1) << 62) - fixed // kept:
                    return TOO_LARGE
                total += fixed // kept
        out[h - start] = total
    return 0


@kernel
def weigh_block(k, mults, chosen, listing, tables, work, out):
    """Estimate the work that contracted graphs cost, in microseconds or so; a whole number for each of ``chosen``.

    Listing visits every labelling, which is counted here, and writes out one of each orbit; counting grows with the
    critical sets and with the automorphisms.  A graph that is too large is given -1.
    """
    for i in range(chosen.shape[0]):
        mult = mults[chosen[i]]
        out[i] = -1.0
        order = automorphisms(k, mult, work.perms)
        m, sets = load_graph(k, mult, tables, work)
        if order < 0 or sets < 0:
            continue
        if not listing:
            out[i] = np.floor(20.0 + (np.int64(1) << k) / 50.0 + 2.0 * sets * (sets + order))
            continue
        labellings = fixed_by(np.int64(0), m, sets, tables, work)
        if labellings >= 0:
            out[i] = np.floor(24.0 + labellings * (0.5 + 0.4 / order) * (14 + k) / 25.0)
