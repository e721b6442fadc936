"""Listing the labellings of contracted graphs, one from each orbit, as a stream that can stop anywhere.

Every labelling is met once by a depth-first search and kept when no automorphism maps it to a lexicographically
smaller one: nothing is stored to compare with.  With a required symmetry of prime order p the searches run only over
labellings fixed by a *witness*: an automorphism of order p of the contracted graph, or a class with p equal paths
(these two cases are all: an automorphism of order p of the mechanism acts on the contracted graph with order p or 1).
"""

from __future__ import annotations

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.synthesis.kernels import layout as lay
from graphsynth.synthesis.kernels.contracted import automorphisms
from graphsynth.synthesis.kernels.counting import (
    FRAME_NONE,
    FRAME_PATH,
    FRAME_VERTEX,
    TOO_LARGE,
    can_be_frame,
    frame_stabiliser,
)
from graphsynth.synthesis.kernels.covers import PLAIN
from graphsynth.synthesis.kernels.layout import inner
from graphsynth.synthesis.kernels.variables import (
    build_variables,
    fits,
    lay_gains,
    lay_lanes,
    load_graph,
    plain_entries,
    unconstrained_ways,
)

# work.state: where the stream stands
GRAPH, MODE, FRAME, WITNESS, ACTIVE, DEPTH, ORDER, CLASSES, SETS, KEPT, COUNT, PART, PARTS, MET, WORDS = range(2, 17)
VISITED = 18  # labellings met since ``rewind``, a measure of the work
PREFIX = 5  # variables that number the parts of one contracted graph


@inner
def _has_order(perm, k, p):
    """Tell whether a vertex permutation has prime order p."""
    moved = False
    for v in range(k):
        w = v
        for _ in range(p):
            w = np.int64(perm[w])
        if w != v:
            return False
        if perm[v] != v:
            moved = True
    return moved


@inner
def _is_first(kept, m, tables, work):
    """Tell whether no automorphism that keeps the frame maps the current leaf to a smaller labelling."""
    for i in range(1, kept):  # the first one is the identity
        perm = work.perms[work.members[i]]
        for e in range(m):
            a = perm[work.classes[lay.U, e]]
            b = perm[work.classes[lay.V, e]]
            image = work.classes[lay.LABEL, work.class_of[a, b]]
            if a > b:
                image = tables.labels[lay.REVERSE, image]
            if image != work.classes[lay.LABEL, e]:
                if image < work.classes[lay.LABEL, e]:
                    return False
                break
    return True


@inner
def _is_new(k, symmetry, tables, work):
    """Tell whether the current leaf has no earlier witness than the one being searched."""
    kept = work.state[KEPT]
    witness = work.state[WITNESS]
    m = work.state[CLASSES]
    for i in range(min(witness, kept)):
        perm = work.perms[work.members[i]]
        fixed = _has_order(perm, k, symmetry)
        e = 0
        while fixed and e < m:
            a = perm[work.classes[lay.U, e]]
            b = perm[work.classes[lay.V, e]]
            want = work.classes[lay.LABEL, e]
            if a > b:
                want = tables.labels[lay.REVERSE, want]
            fixed = work.classes[lay.LABEL, work.class_of[a, b]] == want
            e += 1
        if fixed:
            return False
    for e in range(witness - kept):  # noqa: SIM110 (no generators in compiled code)
        if tables.labels[lay.FOLD, work.classes[lay.LABEL, e]] >= symmetry:
            return False
    return True


@inner
def _next_search(k, mults, stop, frame_modes, frame_degree, symmetry, tables, work):
    """Advance to the next (graph, frame, witness); return 1, 0 at the end, or TOO_LARGE."""
    st = work.state
    while st[GRAPH] < stop:
        mult = mults[st[GRAPH]]
        if st[ORDER] == 0:  # a new contracted graph
            st[ORDER] = automorphisms(k, mult, work.perms)
            st[CLASSES], st[SETS] = load_graph(k, mult, tables, work)
            if st[ORDER] < 0 or st[SETS] < 0:
                return TOO_LARGE
            st[MODE] = FRAME_NONE
            st[FRAME] = -1
            st[KEPT] = 0
        m = st[CLASSES]
        # next witness for this frame; without a required symmetry there is one search
        st[WITNESS] += 1
        witnesses = 0
        if st[KEPT]:
            witnesses = st[KEPT] + m if symmetry else 1
        while st[WITNESS] < witnesses:
            w = st[WITNESS]
            if symmetry == 0:
                return 1
            if w < st[KEPT]:
                if _has_order(work.perms[work.members[w]], k, symmetry):
                    return 1
            elif work.classes[lay.KIND, w - st[KEPT]] >= 2 * symmetry:
                return 1
            st[WITNESS] += 1
        # next frame
        if st[KEPT] and st[MODE] == FRAME_PATH:
            work.classes[lay.KIND, st[FRAME]] -= 1
        st[KEPT] = 0
        st[FRAME] += 1
        frames = 1 if st[MODE] == FRAME_NONE else (k if st[MODE] == FRAME_VERTEX else m)
        if st[FRAME] >= frames or not frame_modes & st[MODE]:
            st[MODE] *= 2
            st[FRAME] = -1
            if st[MODE] > FRAME_PATH:
                st[GRAPH] += 1
                st[ORDER] = 0
            continue
        st[WITNESS] = -1
        if st[MODE] == FRAME_VERTEX and not can_be_frame(k, mult, st[FRAME], frame_degree):
            continue
        st[KEPT] = frame_stabiliser(st[ORDER], st[MODE], st[FRAME], work)
        if st[KEPT] and st[MODE] == FRAME_PATH:
            work.classes[lay.KIND, st[FRAME]] += 1
    return 0


@inner
def _lay_pairs(symmetry, work):
    """Note, for each automorphism g, the first two labels in which a labelling and its image under g can differ.

    A labelling is the first of its orbit only if it has label(ONE) <= label(OTHER), read from the other end if TURNED.
    The condition is kept with the later one of the two variables, so that it cuts the search.  Searches for a required
    symmetry do without: their variables stand for several classes.
    """
    st = work.state
    count = st[COUNT]
    m = st[CLASSES]
    members = min(st[KEPT], lay.MAX_PAIRS) if symmetry == 0 else np.int64(0)
    at = np.int64(0)
    for depth in range(count):
        work.pairs[lay.PAIR_AT, depth] = at
        for i in range(1, members):
            perm = work.perms[work.members[i]]
            for e in range(m):
                a = perm[work.classes[lay.U, e]]
                b = perm[work.classes[lay.V, e]]
                image = work.class_of[a, b]
                if image == e and a < b:
                    continue
                if max(work.classes[lay.VAR, e], work.classes[lay.VAR, image]) == depth:
                    work.pairs[lay.ONE, at] = work.classes[lay.VAR, e]
                    work.pairs[lay.OTHER, at] = work.classes[lay.VAR, image]
                    work.pairs[lay.TURNED, at] = a > b
                    at += 1
                break
    work.pairs[lay.PAIR_AT, count] = at


@inner
def _is_ordered(depth, label, labels, variables, pairs):
    """Check the conditions of ``_lay_pairs`` that the variable at ``depth`` completes."""
    for i in range(pairs[lay.PAIR_AT, depth], pairs[lay.PAIR_AT, depth + 1]):
        one = pairs[lay.ONE, i]
        other = pairs[lay.OTHER, i]
        mine = label if one == depth else variables[lay.AT, one]
        image = label if other == depth else variables[lay.AT, other]
        if pairs[lay.TURNED, i]:
            image = labels[lay.REVERSE, image]
        if image < mine:
            return False
    return True


@inner
def _open_search(symmetry, tables, work):
    """Lay out the variables of the search the state points to; return False without room, or where bytes overflow."""
    st = work.state
    member = work.members[st[WITNESS]] if st[WITNESS] < st[KEPT] and symmetry else np.int64(0)
    st[COUNT] = build_variables(st[CLASSES], st[SETS], work.perms[member], tables, work)
    if not plain_entries(st[COUNT], tables, work):
        return False
    unconstrained_ways(st[COUNT], np.bool_(True), tables, work)
    lay_gains(st[COUNT], tables, work)
    st[WORDS] = (st[SETS] + 7) // 8
    for i in range(st[WORDS]):
        work.keys[i] = 0
    for i in range(st[SETS]):
        work.keys[i // 8] |= np.uint64(work.sets[lay.NEED, i]) << np.uint64(8 * (i % 8))
    laid = lay_lanes(st[COUNT], st[SETS], st[WORDS], work)
    _lay_pairs(symmetry, work)
    st[DEPTH] = 0
    work.variables[lay.AT, 0] = tables.kinds[lay.LABELS, work.classes[lay.KIND, work.variables[lay.REP, 0]]]
    work.variables[lay.USED, 0] = tables.target
    st[ACTIVE] = 1
    return laid


@inner
def _emit(k, symmetry, tables, work, rows, n):
    """Keep the current leaf if it is the first of its orbit; return the new number of rows."""
    st, classes, variables, labels = work.state, work.classes, work.variables, tables.labels
    m = st[CLASSES]
    st[VISITED] += 1
    for e in range(m):
        label = variables[lay.AT, classes[lay.VAR, e]]
        if classes[lay.FLIP, e]:
            label = labels[lay.REVERSE, label]
        classes[lay.LABEL, e] = label
        rows[n, lay.HEADER + e] = label
    if st[KEPT] > 1 and not _is_first(st[KEPT], m, tables, work):
        return n
    if symmetry and not _is_new(k, symmetry, tables, work):
        return n
    rows[n, 0] = st[GRAPH]
    rows[n, 1] = st[MODE]
    rows[n, 2] = st[FRAME]
    return n + 1


@inner
def _step(depth, plain, needs, gain, cover, most, keys, lanes, covers):
    """Let the variable at ``depth`` give up ``gain``; return whether every set can still be served.

    ``cover``: what its label gives to vertices and cycles, whose needs come behind ``plain`` words of critical sets.

    What the sets need after the step goes to the next row of ``keys``, so nothing has to be taken back.
    """
    cap = np.uint64(min(most, lay.BYTE)) * lay.ONES | lay.TOP
    alive = lay.TOP
    for i in range(plain, needs):
        raised = (keys[depth * needs + i] | lay.TOP) - covers[(depth * lay.COVERS + cover) * needs + i]
        keep = raised & lay.TOP
        need = raised & (keep - (keep >> np.uint64(7)))
        alive &= (lanes[(2 * depth + 1) * needs + i] | lay.TOP) - need
        keys[(depth + 1) * needs + i] = need
    for i in range(plain):
        raised = (keys[depth * needs + i] | lay.TOP) - lanes[2 * depth * needs + i] * gain
        keep = raised & lay.TOP
        need = raised & (keep - (keep >> np.uint64(7)))
        alive &= (lanes[(2 * depth + 1) * needs + i] | lay.TOP) - need
        alive &= cap - need
        keys[(depth + 1) * needs + i] = need
    return alive == lay.TOP


@inner
def _search(k, symmetry, tables, work, rows, n):
    """Run or go on with the search the state points to until it ends or the rows are full."""
    # taken out of the tuples once: inside the loops that would cost more than the search itself
    st, classes, variables, pairs = work.state, work.classes, work.variables, work.pairs
    ahead, plain = work.tables, st[PLAIN]
    keys, lanes, covers = work.keys, work.lanes, work.covers
    labels, kinds, resources, guard = tables.labels, tables.kinds, tables.resources, tables.guard
    fold_class = st[WITNESS] - st[KEPT] if symmetry else np.int64(-1)
    needs, parts, last = st[WORDS], st[PARTS], st[COUNT] - 1
    depth = st[DEPTH]
    while depth >= 0:
        rep = variables[lay.REP, depth]
        end = kinds[lay.LABELS_END, classes[lay.KIND, rep]]
        size = variables[lay.SIZE, depth]
        left = variables[lay.USED, depth]
        label = variables[lay.AT, depth]
        index = left
        descend = False
        # the next label of this variable that leaves a labelling possible
        while label < end and n < rows.shape[0]:
            index = left - labels[lay.INDEX, label] * size
            usable = fits(resources[lay.DIGITS, left], labels[lay.PACKED, label] * size, guard)
            usable = usable and ahead[lay.WAYS, depth + 1, index] != 0
            if variables[lay.OWN, depth] and labels[lay.REVERSE, label] != label:
                usable = False
            if rep == fold_class and labels[lay.FOLD, label] < symmetry:
                usable = False
            usable = usable and _is_ordered(depth, label, labels, variables, pairs)
            if usable:
                gain = np.uint64(classes[lay.HEAVIEST, rep] - labels[lay.WEIGHT, label])
                cover = labels[lay.LABEL_COVER, label]
                most = ahead[lay.GAINS, depth + 1, index]
                usable = _step(depth, plain, needs, gain, cover, most, keys, lanes, covers)
            if usable and parts > 1 and depth + 1 == min(PREFIX, last + 1):
                st[MET] += 1
                usable = st[MET] % parts == st[PART]
            if usable:
                variables[lay.AT, depth] = label
                if depth < last:
                    descend = True
                    break
                n = _emit(k, symmetry, tables, work, rows, n)
            label += 1
        if descend:  # the next variable starts with its first label
            depth += 1
            variables[lay.USED, depth] = index
            variables[lay.AT, depth] = kinds[lay.LABELS, classes[lay.KIND, variables[lay.REP, depth]]]
            continue
        if label < end:  # the rows are full
            variables[lay.AT, depth] = label
            st[DEPTH] = depth
            return n
        depth -= 1  # no label is left: the variable before takes its next one
        if depth >= 0:
            variables[lay.AT, depth] += 1
    st[ACTIVE] = 0
    return n


@kernel
def rewind(start, part, parts, work):
    """Put the stream before contracted graph number ``start``; keep one part of ``parts`` of its search prefixes."""
    for i in range(work.state.shape[0]):
        work.state[i] = 0
    work.state[GRAPH] = start
    work.state[PART] = part
    work.state[PARTS] = parts


@kernel
def list_rows(k, mults, stop, frame_modes, frame_degree, symmetry, tables, work, rows):
    """Fill ``rows`` with the next labellings of the contracted graphs up to number ``stop``.

    ``k``: number of vertices of the contracted graphs; ``mults`` (graphs, k, k) uint8: their multiplicity matrices;
    ``frame_modes``, ``frame_degree``: as in ``count_block``; ``symmetry``: 0, or the prime order of a required
    automorphism; ``rows`` (capacity, HEADER + classes) int32: output: graph, frame mode, frame, label of each class.
    Returns the number of rows written; fewer than the capacity only at the end of the stream; TOO_LARGE on overflow.
    """
    n = np.int64(0)
    while n < rows.shape[0]:
        if not work.state[ACTIVE]:
            more = _next_search(k, mults, stop, frame_modes, frame_degree, symmetry, tables, work)
            if more <= 0:
                return n if more == 0 else TOO_LARGE
            if not _open_search(symmetry, tables, work):
                return TOO_LARGE
        n = _search(k, symmetry, tables, work, rows, n)
    return n
