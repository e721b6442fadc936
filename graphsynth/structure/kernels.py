"""Compiled canonical labelling for graphs of at most 64 vertices: the search of :mod:`.search` over flat arrays.

``canon`` allocates nothing and may be called from other compiled code; ``canon_workspace`` makes its arrays once.
"""

from __future__ import annotations

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.core.intrinsics import lowest_bit, popcount

ZERO = np.uint64(0)
ONE = np.uint64(1)
EIGHT = np.uint64(8)
HALF = np.uint64(32)
MIX = np.uint64(0x9E3779B97F4A7C15)
LEAF = np.uint64(1 << 63)

# Rows of the integer scratch array after the n rows of vertex orders, one per level.
PATH, FIRST_PATH, BEST_PATH, FIRST_LAB, POSITION, CELL, LIKE_FIRST, VERSUS, PARENT, ROWS_I = range(10)
# Rows of the unsigned scratch array before the forms of the first and of the current leaf.
STARTS, LEFT, TRACE, FIRST_TRACE, BEST_TRACE, KEYS, ROWS_U = range(7)


@kernel
def canon_workspace(n, layers):
    """Return ``(lab, form, gens, index, orbits, wi, wu)``, the output and scratch arrays of ``canon``."""
    return (
        np.empty(n, np.int64),
        np.empty((layers, n), np.uint64),
        np.empty((2 * n, n), np.int64),
        np.empty(n, np.int64),
        np.empty(n, np.int64),
        np.empty((n + ROWS_I, n), np.int64),
        np.empty((ROWS_U + 2 * layers, n), np.uint64),
    )


@kernel
def _mix(state, value):
    state = (state ^ value) * MIX
    return state ^ (state >> HALF)


@kernel
def _cell_end(starts, place, n):
    if place + 1 >= n:
        return n
    rest = starts >> np.uint64(place + 1)
    if rest == ZERO:
        return n
    return place + 1 + np.int64(lowest_bit(rest))


@kernel
def _find(parent, vertex):
    while parent[vertex] != vertex:
        parent[vertex] = parent[parent[vertex]]
        vertex = parent[vertex]
    return vertex


@kernel
def _merge(n, parent, permutation):
    joined = False
    for vertex in range(n):
        a = _find(parent, vertex)
        b = _find(parent, permutation[vertex])
        if a != b:
            parent[max(a, b)] = min(a, b)
            joined = True
    return joined


@kernel
def _refine(n, layers, masks, lab, keys, starts, active):
    """Refine to an equitable partition; return (cell starts, trace)."""
    state = ZERO
    cells = np.int64(popcount(starts))
    while active != ZERO and cells < n:
        place = np.int64(lowest_bit(active))
        active &= active - ONE
        end = _cell_end(starts, place, n)
        # The vertices of an active cell.
        splitter = ZERO
        for i in range(place, end):
            splitter |= ONE << np.uint64(lab[i])
        state = _mix(state, (np.uint64(place) << EIGHT) | np.uint64(end - place))
        # Split every cell by the edges of each colour into this one.
        low = 0
        while low < n:
            high = _cell_end(starts, low, n)
            if high - low == 1:
                low = high
                continue
            same = True
            for i in range(low, high):
                vertex = lab[i]
                key = popcount(masks[0, vertex] & splitter)
                weight = MIX
                for c in range(1, layers):
                    key += weight * popcount(masks[c, vertex] & splitter)
                    weight *= MIX
                # Insertion sort: cells are small and mostly in order.
                j = i
                while j > low and keys[j - 1] > key:
                    keys[j] = keys[j - 1]
                    lab[j] = lab[j - 1]
                    j -= 1
                    same = False
                keys[j] = key
                lab[j] = vertex
                if j > low and keys[j - 1] != key:
                    same = False
            if same:
                state = _mix(_mix(state, np.uint64(low)), keys[low])
            else:
                # All fragments become active but the first largest; that too if the cell was.
                was_active = (active >> np.uint64(low)) & ONE
                largest = low
                size = 0
                begin = low
                for i in range(low + 1, high + 1):
                    if i == high or keys[i] != keys[begin]:
                        starts |= ONE << np.uint64(begin)
                        active |= ONE << np.uint64(begin)
                        state = _mix(state, (np.uint64(begin) << EIGHT) | np.uint64(i - begin))
                        state = _mix(state, keys[begin])
                        if begin > low:
                            cells += 1
                        if i - begin > size:
                            largest = begin
                            size = i - begin
                        begin = i
                if was_active == ZERO:
                    active &= ~(ONE << np.uint64(largest))
            low = high
    trace = state >> ONE
    if cells == n:
        trace |= LEAF
    return starts, trace


@kernel
def _permuted(n, layers, masks, lab, position, wu, row):
    """Write the adjacency in the order ``lab`` to rows ``row..`` of ``wu``."""
    for i in range(n):
        position[lab[i]] = i
    for c in range(layers):
        for i in range(n):
            left = masks[c, lab[i]]
            line = ZERO
            while left != ZERO:
                line |= ONE << np.uint64(position[np.int64(lowest_bit(left))])
                left &= left - ONE
            wu[row + c, i] = line


@kernel
def _compare(n, layers, a, row_a, b, row_b):
    for c in range(layers):
        for i in range(n):
            x = a[row_a + c, i]
            y = b[row_b + c, i]
            if x != y:
                return 1 if x > y else -1
    return 0


@kernel
def _next(n, level, on_path, left, path, parent, orbits, gens, merging, others):
    """Return the next vertex of the target cell to try, or -1, and what is left of the cell."""
    if on_path:
        for v in range(n):
            parent[v] = _find(orbits, v)
    else:
        for v in range(n):
            parent[v] = v
        for k in range(merging + min(others, n)):
            row = k if k < merging else n + k - merging
            fixes = True
            for i in range(level):
                if gens[row, path[i]] != path[i]:
                    fixes = False
                    break
            if fixes:
                _merge(n, parent, gens[row])
    while left != ZERO:
        vertex = np.int64(lowest_bit(left))
        left &= left - ONE
        if _find(parent, vertex) == vertex:
            return vertex, left
    return -1, left


@kernel
def canon(n, layers, masks, colours, lab, form, gens, index, orbits, wi, wu):
    """Label a coloured graph canonically; the arrays after ``colours`` come from ``canon_workspace(n, layers)``.

    ``n``: number of vertices, 1 to 64; ``layers``: number of edge colours, a pair of vertices is joined in one layer at
    most; ``masks`` uint64[layers, n]: ``masks[c, v]``, the vertices joined to ``v`` by an edge of colour ``c``;
    ``colours`` int64[n]: of the vertices, canonical positions run through them in ascending order.

    Output: ``lab``, the vertex at each canonical position; ``form`` uint64[layers, n], the canonical adjacency: two
    graphs with the same n, layers and sorted colours are isomorphic exactly when their forms are equal; ``gens``
    int64[2 n, n], in the first rows automorphisms (vertex to vertex) that generate the group, the rest is scratch;
    ``index``, factors of the group order, 1 beyond the path; ``orbits``, the smallest vertex of the orbit of each
    vertex.  Returns the number of generators.
    """
    first_form = ROWS_U
    leaf_form = ROWS_U + layers
    path = wi[n + PATH]
    first_path = wi[n + FIRST_PATH]
    best_path = wi[n + BEST_PATH]
    first_lab = wi[n + FIRST_LAB]
    position = wi[n + POSITION]
    cell = wi[n + CELL]
    like_first = wi[n + LIKE_FIRST]
    versus_best = wi[n + VERSUS]
    parent = wi[n + PARENT]
    left = wu[LEFT]
    trace = wu[TRACE]
    first_trace = wu[FIRST_TRACE]
    best_trace = wu[BEST_TRACE]
    keys = wu[KEYS]
    # The first leaf: its level, and the deepest level on the path to it that is not done.
    first_length = 0
    on_first = -1
    have_leaf = False
    merging = 0
    others = 0
    # The root: vertices by colour.
    for v in range(n):
        orbits[v] = v
        index[v] = 1
        j = v
        while j > 0 and colours[wi[0, j - 1]] > colours[v]:
            wi[0, j] = wi[0, j - 1]
            j -= 1
        wi[0, j] = v
    starts = ONE
    for i in range(1, n):
        if colours[wi[0, i]] != colours[wi[0, i - 1]]:
            starts |= ONE << np.uint64(i)
    wu[STARTS, 0], trace[0] = _refine(n, layers, masks, wi[0], keys, starts, starts)
    level = 0
    while True:
        # A new node at this level: prune it, read it off as a leaf, or choose its target cell.
        expand = True
        if have_leaf:
            above = level == 0 or like_first[level - 1] == 1
            like_first[level] = 1 if above and level < first_length and trace[level] == first_trace[level] else 0
            versus = versus_best[level - 1] if level > 0 else 0
            if versus == 0 and trace[level] != best_trace[level]:
                versus = 1 if trace[level] > best_trace[level] else -1
            versus_best[level] = versus
            if versus < 0 and like_first[level] == 0:
                expand = False
        if expand and trace[level] & LEAF != ZERO:
            expand = False
            target = level - 1
            _permuted(n, layers, masks, wi[level], position, wu, leaf_form)
            take = False
            # The first leaf is kept; an equal one, or one equal to the best, is an automorphism.
            if not have_leaf:
                have_leaf = True
                take = True
                on_first = level - 1
                first_length = level + 1
                for i in range(level + 1):
                    first_trace[i] = trace[i]
                    like_first[i] = 1
                for i in range(level):
                    first_path[i] = path[i]
                for i in range(n):
                    first_lab[i] = wi[level, i]
                for c in range(layers):
                    for i in range(n):
                        wu[first_form + c, i] = wu[leaf_form + c, i]
            else:
                found = 0
                if like_first[level] == 1 and _compare(n, layers, wu, leaf_form, wu, first_form) == 0:
                    found = 1
                    target = on_first
                elif versus_best[level] == 0:
                    order = _compare(n, layers, wu, leaf_form, form, 0)
                    if order == 0:
                        found = 2
                        target = 0
                        while path[target] == best_path[target]:
                            target += 1
                    take = order > 0
                else:
                    take = versus_best[level] > 0
                if found > 0:
                    # Generators that join orbits stay; of the others the last n, for pruning.
                    row = n + others % n
                    for i in range(n):
                        gens[row, first_lab[i] if found == 1 else lab[i]] = wi[level, i]
                    if _merge(n, orbits, gens[row]):
                        for i in range(n):
                            gens[merging, i] = gens[row, i]
                        merging += 1
                    else:
                        others += 1
            if take:  # the best leaf so far
                for c in range(layers):
                    for i in range(n):
                        form[c, i] = wu[leaf_form + c, i]
                for i in range(n):
                    lab[i] = wi[level, i]
                for i in range(level + 1):
                    best_trace[i] = trace[i]
                    versus_best[i] = 0
                for i in range(level):
                    best_path[i] = path[i]
            level = target
        elif not expand:
            level -= 1
        if expand:
            # The target cell: the first of the smallest that are not single.
            starts = wu[STARTS, level]
            best = 0
            size = n + 1
            place = 0
            while place < n:
                end = _cell_end(starts, place, n)
                if 1 < end - place < size:
                    best = place
                    size = end - place
                place = end
            cell[level] = best
            members = ZERO
            for i in range(best, best + size):
                members |= ONE << np.uint64(wi[level, i])
            left[level] = members
        # The next child of the deepest node that still has one.
        vertex = -1
        while level >= 0:
            if left[level] != ZERO:
                on_path = not have_leaf or level == on_first
                vertex, left[level] = _next(n, level, on_path, left[level], path, parent, orbits, gens, merging, others)
                if vertex >= 0:
                    break
            # A level of the first path is done: the orbit of its vertex is a factor of the order.
            if level == on_first:
                root = _find(orbits, first_path[level])
                count = 0
                for v in range(n):
                    if _find(orbits, v) == root:
                        count += 1
                index[level] = count
                on_first -= 1
            level -= 1
        if level < 0:
            break
        # Make the vertex a cell of its own, and refine.
        place = cell[level]
        path[level] = vertex
        for i in range(n):
            wi[level + 1, i] = wi[level, i]
        where = place
        while wi[level + 1, where] != vertex:
            where += 1
        wi[level + 1, where] = wi[level + 1, place]
        wi[level + 1, place] = vertex
        starts = wu[STARTS, level] | (ONE << np.uint64(place + 1))
        level += 1
        wu[STARTS, level], trace[level] = _refine(n, layers, masks, wi[level], keys, starts, ONE << np.uint64(place))
    for v in range(n):
        orbits[v] = _find(orbits, v)
    return merging


@kernel
def canon_packed(links, packed, colours):
    """Label one graph of at most 64 links given by joints ``a, b, mobility``; return (lab, generators, index, orbits).

    ``packed`` is uint8[3 * joints], ``colours`` int64[links].
    """
    layers = np.int64(1)
    for place in range(2, packed.shape[0], 3):
        layers = max(layers, np.int64(packed[place]))
    masks = np.zeros((layers, links), np.uint64)
    for place in range(0, packed.shape[0], 3):
        a = np.int64(packed[place])
        b = np.int64(packed[place + 1])
        c = np.int64(packed[place + 2]) - 1
        masks[c, a] |= ONE << np.uint64(b)
        masks[c, b] |= ONE << np.uint64(a)
    lab, form, gens, index, orbits, wi, wu = canon_workspace(links, layers)
    count = canon(links, layers, masks, colours, lab, form, gens, index, orbits, wi, wu)
    return lab, gens[:count].copy(), index, orbits
