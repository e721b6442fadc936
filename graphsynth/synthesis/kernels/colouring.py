"""Contracted graphs with some of their vertices multiple joints: one of each orbit of the automorphism group."""

from __future__ import annotations

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.core.intrinsics import popcount
from graphsynth.synthesis.kernels.contracted import automorphisms
from graphsynth.synthesis.kernels.layout import (
    BETWEEN_PINS,
    KIND_SHIFT,
    LOOSE,
    MAX_CLASSES,
    MAX_VERTICES,
    TO_PIN,
    inner,
)


@inner
def _is_first_subset(k, u, order, perms, members):
    """Collect the automorphisms that keep the vertices u; return their number, 0 if one takes u to a smaller number."""
    kept = 0
    for g in range(order):
        image = np.int64(0)
        for v in range(k):
            image |= (u >> v & 1) << perms[g, v]
        if image < u:
            return 0
        if image == u:
            members[kept] = g
            kept += 1
    return kept


@inner
def _is_first_choice(chosen, count, pairs, number, kept, perms, members):
    """Tell whether none of the automorphisms kept takes the chosen classes to a smaller choice."""
    for i in range(1, kept):
        perm = perms[members[i]]
        image = np.int64(0)
        for e in range(count):
            image |= (chosen >> e & 1) << number[perm[pairs[0, e]], perm[pairs[1, e]]]
        if image < chosen:
            return False
    return True


@inner
def _write(k, mult, u, chosen, count, pairs, out):
    """Write the coloured graph, links before multiple joints."""
    place = np.empty(k, np.int64)
    at = 0
    for pin in range(2):
        for v in range(k):
            if u >> v & 1 == pin:
                place[v] = at
                at += 1
    for v in range(k):
        out[place[v], place[v]] = u >> v & 1
        for w in range(k):
            if mult[v, w]:
                kind = (u >> v & 1) + (u >> w & 1)
                out[place[v], place[w]] = mult[v, w] | kind * TO_PIN << KIND_SHIFT
    for e in range(count):
        if chosen >> e & 1:
            v, w = place[pairs[0, e]], place[pairs[1, e]]
            out[v, w] += (LOOSE - BETWEEN_PINS) << KIND_SHIFT
            out[w, v] = out[v, w]


@kernel
def colour_graphs(k, mults, pins, loose, out):
    """Make the contracted graphs ``mults`` with ``pins`` of their k vertices multiple joints, each once.

    Up to ``loose`` classes between multiple joints are marked LOOSE.  Coloured matrices go to ``out`` as long as there
    is room.  Returns how many there are, or -1 when a graph has too many symmetries.
    """
    perms = np.empty((20_000, MAX_VERTICES), np.uint8)
    members = np.empty(20_000, np.int64)
    pairs = np.empty((2, MAX_CLASSES), np.int64)
    number = np.empty((k, k), np.int64)
    found = np.int64(0)
    for h in range(mults.shape[0]):
        mult = mults[h]
        order = automorphisms(k, mult, perms)
        if order < 0:
            return np.int64(-1)
        for u in range(np.int64(1) << k):
            if popcount(np.uint64(u)) != pins:
                continue
            kept = _is_first_subset(k, u, order, perms, members)
            if kept == 0:
                continue
            count = 0
            for v in range(k):
                for w in range(v + 1, k):
                    if loose and mult[v, w] and (u >> v) & (u >> w) & 1:
                        pairs[0, count] = v
                        pairs[1, count] = w
                        number[v, w] = count
                        number[w, v] = count
                        count += 1
            for chosen in range(np.int64(1) << count):
                if popcount(np.uint64(chosen)) <= loose and _is_first_choice(
                    chosen, count, pairs, number, kept, perms, members
                ):
                    if found < out.shape[0]:
                        _write(k, mult, u, chosen, count, pairs, out[found])
                    found += 1
    return found
