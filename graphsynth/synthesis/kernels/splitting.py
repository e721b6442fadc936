"""Growing contracted graphs: split one vertex into two, in every way, and label the results canonically."""

from __future__ import annotations

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.structure.kernels import canon, canon_workspace

_ONE = np.uint64(1)


@kernel
def masks_by_layer(n, layers, mult, masks):
    """Write who is joined to each vertex by one edge, by two, and so on: the edge colours of `canon`."""
    for c in range(layers):
        for v in range(n):
            masks[c, v] = 0
    for v in range(n):
        for w in range(n):
            if mult[v, w]:
                masks[mult[v, w] - 1, v] |= _ONE << np.uint64(w)


@kernel
def _canonical_code(n, layers, mult, masks, colours, space, out):
    """Write the upper triangle of the canonically relabelled multiplicity matrix."""
    lab, form, gens, index, orbits, wi, wu = space
    masks_by_layer(n, layers, mult, masks)
    canon(n, layers, masks, colours, lab, form, gens, index, orbits, wi, wu)
    at = 0
    for i in range(n):
        for j in range(i + 1, n):
            out[at] = mult[lab[i], lab[j]]
            at += 1


@kernel
def split_all(k, mults, start, joined, layers, codes):
    """Split the vertices of ``mults[start:]`` into two vertices joined by ``joined`` parallel edges.

    Only results of minimum degree 3 are made; they are 2-connected because both halves keep a neighbour.

    ``k``: number of vertices before the split; ``mults`` (graphs, k, k) uint8: multiplicity matrices; ``start``:
    first graph to split; ``joined``: parallel edges between the two halves; ``layers``: bound of the multiplicities;
    ``codes`` (capacity, k (k + 1) / 2) uint8: output: canonical upper triangles of the results, with repetitions.
    Returns the graph to go on with, and the number of codes written.
    """
    n = k + 1
    space = canon_workspace(n, layers)
    masks = np.zeros((layers, n), np.uint64)
    colours = np.zeros(n, np.int64)
    mult = np.zeros((n, n), np.uint8)
    neighbour = np.empty(k, np.int64)
    given = np.empty(k, np.int64)
    count = 0
    h = start
    while h < mults.shape[0]:
        before = count
        full = False
        # every vertex v, and every way to give some of its edges to a new vertex k
        for v in range(k):
            degree = 0
            neighbours = 0
            for w in range(k):
                if mults[h, v, w]:
                    neighbour[neighbours] = w
                    given[neighbours] = 0
                    neighbours += 1
                    degree += mults[h, v, w]
            while True:
                # next distribution: the new vertex gets given[i] of the edges to neighbour[i]
                i = 0
                while i < neighbours and given[i] == mults[h, v, neighbour[i]]:
                    given[i] = 0
                    i += 1
                if i == neighbours:
                    break
                given[i] += 1
                moved = 0
                for i in range(neighbours):
                    moved += given[i]
                if moved + joined < 3 or degree - moved + joined < 3 or moved == degree:
                    continue
                if 2 * given[0] > mults[h, v, neighbour[0]]:
                    continue  # the same split with the halves exchanged
                if count == codes.shape[0]:
                    full = True
                    break
                # the split graph
                for a in range(k):
                    for b in range(k):
                        mult[a, b] = mults[h, a, b]
                    mult[a, k] = 0
                    mult[k, a] = 0
                for i in range(neighbours):
                    w = neighbour[i]
                    mult[v, w] -= given[i]
                    mult[w, v] -= given[i]
                    mult[k, w] = given[i]
                    mult[w, k] = given[i]
                mult[k, v] = joined
                mult[v, k] = joined
                _canonical_code(n, layers, mult, masks, colours, space, codes[count])
                count += 1
            if full:
                break
        if full:  # this graph is split again in the next call
            return h, before
        h += 1
    return h, count
