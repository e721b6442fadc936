"""Contracted graphs as a stream, each once, with no list to compare with (canonical augmentation).

A graph is grown from the one that merging its *canonical pair* gives.  That is the first of the good pairs (see
``docs/explanation/enumeration.md``) by an order that does not depend on the numbering of the vertices.  So a split is
kept when its two halves are the canonical pair of the result, or are taken to it by an automorphism; and of splits that
an automorphism of the smaller graph takes to each other one is tried.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.compilation import kernel
from graphsynth.structure.kernels import canon, canon_workspace
from graphsynth.synthesis.kernels.contracted import automorphisms, refine
from graphsynth.synthesis.kernels.layout import MAX_VERTICES, inner
from graphsynth.synthesis.kernels.splitting import masks_by_layer

GROUP_TOO_LARGE = -1
# columns of Growth.at: loops, edges between the halves, vertex to split, order of the group
_LOOPS, _JOINED, _VERTEX, _ORDER = range(4)
# rows of Growth.state
_ROOT, _DEPTH = range(2)


class Growth(NamedTuple):
    """Where a search stands: the graphs from a root down to the one that is split now."""

    mults: NDArray[np.uint8]  # (depths, MAX_VERTICES, MAX_VERTICES) multiplicities
    given: NDArray[np.int64]  # (depths, MAX_VERTICES) edges to each vertex that the new half takes over
    at: NDArray[np.int64]  # (depths, 4) loops, edges between the halves, the vertex that is split, order of the group
    perms: NDArray[np.uint8]  # (depths, group, MAX_VERTICES) automorphisms
    state: NDArray[np.int64]  # (2,) the root, and the depth (-1: the root is yet to be taken)


def make_growth(group: int = 20_000) -> Growth:
    """Allocate the search; ``group`` bounds the order of automorphism groups."""
    depths = MAX_VERTICES
    return Growth(
        np.zeros((depths, MAX_VERTICES, MAX_VERTICES), np.uint8),
        np.zeros((depths, MAX_VERTICES), np.int64),
        np.zeros((depths, 4), np.int64),
        np.zeros((depths, group, MAX_VERTICES), np.uint8),
        np.array([0, -1], np.int64),
    )


@kernel
def grow(k, roots, stop, loops, known, wanted, most, symmetric, growth, out, sizes, totals):
    """Go on with the stream of the graphs that grow from ``roots[:stop]``; return how many are written.

    ``k``, ``loops``: vertices and loops of the roots; ``known``: graphs with so many loops or less are roots
    themselves, so they are not grown; ``wanted``: loops of the graphs to write; ``most``: their vertices at most;
    ``symmetric``: write only those with automorphisms besides the identity; ``out`` (capacity, MAX_VERTICES,
    MAX_VERTICES) uint8, ``sizes`` (capacity,): output: graphs and their numbers of vertices; fewer than the capacity
    are the last ones; ``totals``: output: adds up the graphs with the wanted loops by number of vertices, written or
    not.  GROUP_TOO_LARGE: an automorphism group has no room.
    """
    space = canon_workspace(MAX_VERTICES, wanted + 1)
    masks = np.zeros((wanted + 1, MAX_VERTICES), np.uint64)
    written = 0
    while written < out.shape[0]:
        depth = growth.state[_DEPTH]
        if depth < 0:  # the next root
            root = growth.state[_ROOT]
            if root == stop:
                break
            growth.state[_ROOT] += 1
            growth.state[_DEPTH] = 0
            for a in range(k):
                for b in range(k):
                    growth.mults[0, a, b] = roots[root, a, b]
            if not _enter(0, k, loops, max(1, known + 2 - loops), growth):
                return GROUP_TOO_LARGE
            continue
        n = k + depth
        # the next split of the graph at this depth; when there is none, back to the one before
        if n == most or not _next_split(n, depth, wanted, growth):
            growth.state[_DEPTH] -= 1
            continue
        if not _is_first_split(n, depth, growth):
            continue
        _split(n, depth, growth)
        made = growth.at[depth, _LOOPS] + growth.at[depth, _JOINED] - 1
        order = _is_grown_here(n + 1, growth.at[depth, _VERTEX], depth + 1, masks, space, growth)
        if order < 0:
            return GROUP_TOO_LARGE
        if order == 0:
            continue
        # a new graph: written, if it is wanted, and split in its turn
        if made == wanted:
            totals[n + 1] += 1
            if order > 1 or not symmetric:
                for a in range(n + 1):
                    for b in range(n + 1):
                        out[written, a, b] = growth.mults[depth + 1, a, b]
                sizes[written] = n + 1
                written += 1
        if n + 1 < most:
            growth.state[_DEPTH] = depth + 1
            _begin(depth + 1, n + 1, made, 1, order, growth)
    return written


@inner
def _enter(depth, n, loops, joined, growth):
    """Begin to split the graph at a depth, whose automorphisms are not known; False if they have no room."""
    order = automorphisms(n, growth.mults[depth], growth.perms[depth])
    _begin(depth, n, loops, joined, order, growth)
    return order > 0


@inner
def _begin(depth, n, loops, joined, order, growth):
    growth.at[depth, _LOOPS] = loops
    growth.at[depth, _JOINED] = joined
    growth.at[depth, _VERTEX] = 0
    growth.at[depth, _ORDER] = order
    for w in range(n):
        growth.given[depth, w] = 0


@inner
def _next_split(n, depth, wanted, growth):
    """Go to the next split with halves of degree 3 or more, each with an edge to another vertex; False at the end."""
    mult, given, at = growth.mults[depth], growth.given[depth], growth.at[depth]
    while at[_LOOPS] + at[_JOINED] - 1 <= wanted:
        v, joined = at[_VERTEX], at[_JOINED]
        degree = 0
        for w in range(n):
            degree += mult[v, w]
        while degree + 2 * joined >= 6:
            # count on: given[w] from 0 to mult[v, w]
            w = 0
            while w < n and given[w] == mult[v, w]:
                given[w] = 0
                w += 1
            if w == n:
                break
            given[w] += 1
            moved = 0
            for u in range(n):
                moved += given[u]
            if 0 < moved < degree and moved + joined >= 3 and degree - moved + joined >= 3:
                return True
        at[_VERTEX] = v + 1
        if v + 1 == n:
            at[_VERTEX] = 0
            at[_JOINED] = joined + 1
    return False


@inner
def _is_first_split(n, depth, growth):
    """Tell whether no automorphism, nor exchanging the halves, gives a split of lower number."""
    mult, given = growth.mults[depth], growth.given[depth]
    v = growth.at[depth, _VERTEX]
    for g in range(growth.at[depth, _ORDER]):
        perm = growth.perms[depth, g]  # read backwards: it takes vertex perm[w] to w
        image = 0
        while perm[image] != v:
            image += 1
        if image > v:
            continue
        if image < v:
            return False
        same = other = np.int64(0)
        for w in range(n):
            if same == 0:
                same = given[perm[w]] - given[w]
            if other == 0:
                other = mult[v, perm[w]] - given[perm[w]] - given[w]
            if same > 0 and other > 0:
                break
        if same < 0 or other < 0:
            return False
    return True


@inner
def _split(n, depth, growth):
    """Write the graph with the vertex split into itself and vertex n, at the next depth."""
    old, new, given = growth.mults[depth], growth.mults[depth + 1], growth.given[depth]
    v = growth.at[depth, _VERTEX]
    for a in range(n):
        for b in range(n):
            new[a, b] = old[a, b]
        new[a, n] = new[n, a] = 0
    new[n, n] = 0
    for w in range(n):
        if given[w]:
            new[v, w] -= given[w]
            new[w, v] -= given[w]
            new[n, w] = new[w, n] = given[w]
    new[v, n] = new[n, v] = growth.at[depth, _JOINED]


@inner
def _is_good(n, a, b, mult, degrees, joined):
    """Tell whether merging two joined vertices leaves a 2-connected graph of minimum degree 3."""
    if n == 3:
        return True
    if degrees[a] + degrees[b] - 2 * np.int64(mult[a, b]) < 3:
        return False
    rest = ((np.int64(1) << n) - 1) & ~(np.int64(1) << a) & ~(np.int64(1) << b)
    reached = rest & -rest
    fresh = reached
    while fresh:
        found = np.int64(0)
        for w in range(n):
            if (fresh >> w) & 1:
                found |= joined[w]
        fresh = found & rest & ~reached
        reached |= fresh
    return reached == rest


@inner
def _rank(a, b, mult, degrees):
    """Order of a pair that is quickly told: many parallel edges first, then high degrees."""
    return np.int64(mult[a, b]) * 256 + degrees[a] + degrees[b]


@inner
def _is_grown_here(n, v, depth, masks, space, growth):
    """Tell whether {v, n - 1} is the canonical pair of the graph at a depth, but for an automorphism.

    Returns 0 if not, else the order of the group, or -1 if the automorphisms have no room.
    """
    mult, perms = growth.mults[depth], growth.perms[depth]
    u = n - 1
    degrees = np.zeros(n, np.int64)
    joined = np.zeros(n, np.int64)
    for a in range(n):
        for b in range(n):
            if mult[a, b]:
                degrees[a] += mult[a, b]
                joined[a] |= np.int64(1) << b
    # most pairs are told apart by what is quick
    mine = _rank(u, v, mult, degrees)
    for a in range(n):
        for b in range(a):
            if mult[a, b] and _rank(a, b, mult, degrees) > mine and _is_good(n, a, b, mult, degrees, joined):
                return 0
    # then colours that do not depend on the numbering
    colours = np.zeros(n, np.int64)
    discrete = refine(n, mult, colours) == n
    own = colours[u] + colours[v]
    ties = 0
    for a in range(n):
        for b in range(a):
            if mult[a, b] and _rank(a, b, mult, degrees) == mine:
                rank = colours[a] + colours[b]
                other = rank == own and (a != u or b != v)
                if (other or rank > own) and _is_good(n, a, b, mult, degrees, joined):
                    if not other:
                        return 0
                    ties += 1
    # the automorphisms; they matter where other pairs are alike
    if discrete:
        for a in range(n):
            perms[0, a] = a
        order = 1
    else:
        order = automorphisms(n, mult, perms)
    if ties == 0 or order < 0:
        return order
    return order if _is_first_pair(n, v, order, mine, degrees, joined, colours, depth, masks, space, growth) else 0


@inner
def _is_first_pair(n, v, order, mine, degrees, joined, colours, depth, masks, space, growth):
    """Tell whether an automorphism takes {v, n - 1} to the first, by canonical labels, of the pairs that are alike."""
    mult, perms = growth.mults[depth], growth.perms[depth]
    lab, form, gens, index, orbits, wi, wu = space
    u = n - 1
    layers = 0
    for a in range(n):
        for b in range(n):
            layers = max(layers, np.int64(mult[a, b]))
    masks_by_layer(n, layers, mult, masks)
    nothing = np.zeros(n, np.int64)
    canon(n, layers, masks, nothing, lab, form, gens, index, orbits, wi, wu)
    for i in range(n):
        for j in range(i):
            a, b = lab[i], lab[j]
            if not mult[a, b] or _rank(a, b, mult, degrees) != mine:
                continue
            if colours[a] + colours[b] != colours[u] + colours[v] or not _is_good(n, a, b, mult, degrees, joined):
                continue
            for g in range(order):
                if (perms[g, u] == a and perms[g, v] == b) or (perms[g, u] == b and perms[g, v] == a):
                    return True
            return False
    return False
