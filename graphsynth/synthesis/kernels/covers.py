"""What links and loops need: revolute joints beside prismatic ones; or a loop its length, links to be jointed or not.

Needs of vertices, of cycles and of sets of classes of the contracted graph stand behind those of critical sets, a byte
each, and start with a word of their own.  A label gives to the two ends of its class, and to the cycles through it, by
its *cover*: 1 if a path has a revolute joint at the lower end, 2 at the higher end, and 4 times the fewest revolute
joints of a path, 2 at most.  Without prismatic joints it is 1 if a path is a single joint, and 4 times the joints of
the shortest path, 15 at most.
"""

from __future__ import annotations

import numpy as np

from graphsynth.synthesis.kernels import layout as lay
from graphsynth.synthesis.kernels.layout import inner

# in work.state: words of the needs of critical sets; classes of the graph; covers that labels have
PLAIN, LAID, LAID_COVERS = 19, 20, 21


@inner
def covered_sets(k, mult, sets, tables, work):
    """Add the vertices, cycles and pairs of links that need something; return the number of sets, -1 without room."""
    girth = (tables.rules >> lay.GIRTH) & lay.LONGEST
    pairs = tables.rules >> lay.PAIRS
    work.state[LAID_COVERS] = lay.COVERS if girth or pairs else lay.SLIDING_COVERS
    count = 8 * work.state[PLAIN]
    for s in range(sets, work.sets.shape[1]):  # the word is filled with sets that need nothing
        work.sets[lay.MASK, s] = 0
        work.sets[lay.NEED, s] = 0
    if tables.rules & lay.NO_SLIDING_LINK:
        for v in range(k):
            if _joints_at(k, mult, v) <= tables.sliders and mult[v, v] == 0:
                count = _add(count, 1, v, np.int64(0), work)
    while pairs:
        count = _add_pair(k, mult, count, pairs & 15, (pairs >> 4) & 15, (pairs >> 8) & 1, work)
        pairs >>= lay.PAIR
    if tables.rules & lay.NO_SLIDING_LOOP or girth:
        return _add_cycles(k, mult, count, max(np.int64(2), girth), tables.sliders, work)
    return count


@inner
def _joints_at(k, mult, v):
    joints = np.int64(0)
    for w in range(k):
        if w != v:
            joints += mult[v, w] & lay.COPIES_MASK
    return joints


@inner
def _add_pair(k, mult, count, one, other, apart, work):
    """Add the classes between links with these numbers of joints: one is to have a single joint, or all of them not."""
    between = np.int64(0)
    classes = np.int64(0)
    for e in range(work.state[LAID]):
        a = _joints_at(k, mult, work.classes[lay.U, e])
        b = _joints_at(k, mult, work.classes[lay.V, e])
        if (a == one and b == other) or (a == other and b == one):
            between |= np.int64(1) << e
            classes += 1
    return _add(count, classes if apart else np.int64(1), lay.APART if apart else lay.JOINTED, between, work)


@inner
def _add(count, need, vertex, cycle, work):
    if count < 0 or count >= work.sets.shape[1]:
        return np.int64(-1)
    work.sets[lay.NEED, count] = need
    work.sets[lay.VERTEX, count] = vertex
    work.sets[lay.CYCLE, count] = cycle
    return count + 1


@inner
def _add_cycles(k, mult, count, need, longest, work):
    """Add the cycles of ``longest`` classes and one more: larger ones have anyway what they need."""
    path = np.empty(k, np.int64)
    following = np.empty(k, np.int64)
    for first in range(k):  # the lowest vertex of the cycle
        path[0] = first
        following[0] = first + 1
        depth = 0
        used = np.int64(0)  # of the vertices behind it
        while depth >= 0:
            at = path[depth]
            w = following[depth]
            while w < k and (used >> w & 1 or mult[at, w] == 0):
                w += 1
            if w == k or depth == longest:
                used &= ~(np.int64(1) << at)
                depth -= 1
                continue
            following[depth] = w + 1
            depth += 1
            path[depth] = w
            following[depth] = first + 1
            used |= np.int64(1) << w
            if depth >= 2 and path[1] < w and mult[w, first]:
                cycle = np.int64(1) << work.class_of[w, first]
                for i in range(depth):
                    cycle |= np.int64(1) << work.class_of[path[i], path[i + 1]]
                count = _add(count, need, np.int64(-1), cycle, work)
    return count


@inner
def cover_of(j, cover, s, laid, classes, sets):
    """Return what variable j gives to set s, no critical one, by a label with this cover."""
    given = np.int64(0)
    vertex, cycle = sets[lay.VERTEX, s], sets[lay.CYCLE, s]
    for e in range(laid):
        if classes[lay.VAR, e] != j:
            continue
        if vertex == lay.JOINTED:
            given += (cycle >> e) & cover & 1
        elif vertex == lay.APART:
            given += (cycle >> e) & ~cover & 1
        elif vertex < 0:
            given += ((cycle >> e) & 1) * (cover >> 2)
        elif classes[lay.U, e] == vertex:
            given += (cover >> classes[lay.FLIP, e]) & 1
        elif classes[lay.V, e] == vertex:
            given += (cover >> (1 - classes[lay.FLIP, e])) & 1
    return min(given, np.int64(lay.BYTE))
