"""Canonical labelling of a coloured graph by individualisation and refinement, in plain Python for any size.

The search is that of [McKay 1981], with pruning by automorphisms.  A node of the search tree is an ordered partition
of the vertices, refined until every cell sees every other cell evenly (1-dimensional Weisfeiler-Leman, all edge
colours at once); its children make one vertex of the target cell a cell of its own.  A leaf orders the vertices; the
canonical form is the adjacency of the leaf that is greatest by (trace of the refinements, adjacency).  That
definition does not mention labels or pruning, so :mod:`graphsynth.structure.kernels`, which runs the same search
compiled, gives the same form; tests compare the two.

Pruning:

* a node whose trace can neither give the first leaf's adjacency nor beat the best leaf is left;
* a leaf equal to the first or to the best one gives an automorphism, and the search returns to where the paths
  parted: the two subtrees there are images of each other;
* on the path to the first leaf, one vertex of each orbit of the automorphisms found so far is tried (all of them
  fix the path above); elsewhere, one of each orbit of those generators that fix the path;
* with ``twins``, exchanging two vertices that have the same neighbours is an automorphism that needs no leaf: it fixes
  the path above, and the branch it saves is the image of one that has been searched, so that the form, the order of
  the vertices, the orbits and the order of the group stay the same.  A complete graph, a
  star or links without joints are then one leaf.

The tree of other very symmetric graphs (a hundred equal parts) grows with a high power of n.  A search does not
go beyond ``WORK_MAX`` looks at a vertex or a cell: it then raises `TooLargeError`.

Sources: B. D. McKay, *Practical graph isomorphism*, Congressus Numerantium 30 (1981) 45-87; B. D. McKay and
A. Piperno, *Practical graph isomorphism, II*, J. Symbolic Comput. 60 (2014) 94-112.
"""

from __future__ import annotations

from collections.abc import Sequence

from graphsynth.core.errors import TooLargeError
from graphsynth.structure.connectivity import bits

#: Looks at a vertex or a cell in one search; a minute or two.
WORK_MAX = 200_000_000
_WORD = (1 << 64) - 1
_MIX = 0x9E3779B97F4A7C15
_LEAF = 1 << 63


def _mix(state: int, value: int) -> int:
    state = (state ^ value) * _MIX & _WORD
    return state ^ state >> 32


def _cell_end(starts: int, place: int, n: int) -> int:
    """Return the position after the cell that starts at ``place``."""
    rest = starts >> place + 1
    return place + (rest & -rest).bit_length() if rest else n


def find_root(parent: list[int], vertex: int) -> int:
    """Return the smallest member of the class of a vertex."""
    while parent[vertex] != vertex:
        parent[vertex] = parent[parent[vertex]]
        vertex = parent[vertex]
    return vertex


def join_images(parent: list[int], permutation: Sequence[int]) -> bool:
    """Join each vertex with its image; roots stay minimal.  Return whether any classes were joined."""
    joined = False
    for vertex, image in enumerate(permutation):
        a, b = find_root(parent, vertex), find_root(parent, image)
        if a != b:
            parent[max(a, b)] = min(a, b)
            joined = True
    return joined


class CanonicalSearch:
    """One canonical labelling of ``n`` vertices; make it, call :meth:`run`, read the results.

    ``layers[c][v]`` is the bit mask of the vertices joined to ``v`` by an edge of colour ``c``; cells are ordered by
    vertex colour first.  With ``twins``, the generators may differ from those of the kernel.

    Results: ``order_of_vertices``, the vertex at each canonical position; ``form[c][i]``, the bit mask of the positions
    joined to position ``i`` by colour ``c``; ``generators`` of the whole automorphism group; ``index``, orbit sizes
    along the path to the first leaf, whose product is the order of the group; ``orbits``, the smallest vertex of the
    orbit of each vertex.
    """

    def __init__(self, n: int, layers: Sequence[Sequence[int]], colours: Sequence[int], *, twins: bool = False) -> None:
        self.n = n
        self.twins = twins
        self.work = 0
        self.layers = layers
        self.colours = colours
        self.generators: list[list[int]] = []
        self.others: list[list[int]] = []
        self.index: list[int] = []
        self.orbits = list(range(n))
        self.weights = [pow(_MIX, c, 1 << 64) for c in range(len(layers))]
        # One entry per level of the current path.
        self.lab: list[list[int]] = [[]] * (n + 1)
        self.starts = [0] * (n + 1)
        self.cell = [0] * (n + 1)
        self.left = [0] * (n + 1)
        self.path = [-1] * (n + 1)
        self.trace = [0] * (n + 1)
        self.like_first = [True] * (n + 1)
        self.versus_best = [0] * (n + 1)
        # The first leaf sets what is known of the first and of the best one.
        self.have_leaf = False
        self.on_first = -1

    def run(self) -> CanonicalSearch:
        """Search the whole tree and return self.

        Raises `TooLargeError` after ``WORK_MAX`` looks.
        """
        self.lab[0] = sorted(range(self.n), key=self.colours.__getitem__)
        starts = 0
        for place, vertex in enumerate(self.lab[0]):
            if place == 0 or self.colours[vertex] != self.colours[self.lab[0][place - 1]]:
                starts |= 1 << place
        self._refine(0, starts, starts)
        level = 0
        while True:
            level = self._visit(level)
            vertex = -1
            while level >= 0:
                vertex = self._next(level)
                if vertex >= 0:
                    break
                if level == self.on_first:
                    root = find_root(self.orbits, self.first_path[level])
                    self.index.append(sum(find_root(self.orbits, v) == root for v in range(self.n)))
                    self.on_first -= 1
                level -= 1
            if level < 0:
                break
            # make the vertex a cell of its own and refine
            lab = self.lab[level].copy()
            place = self.cell[level]
            where = lab.index(vertex, place)
            lab[place], lab[where] = lab[where], lab[place]
            self.path[level] = vertex
            self.lab[level + 1] = lab
            self._refine(level + 1, self.starts[level] | 1 << place + 1, 1 << place)
            level += 1
        self.orbits = [find_root(self.orbits, v) for v in range(self.n)]
        return self

    def _refine(self, level: int, starts: int, active: int) -> None:
        """Split cells by the number of edges of each colour into active cells, until nothing splits."""
        n, lab, state = self.n, self.lab[level], 0
        while active and starts.bit_count() < n:
            place = (active & -active).bit_length() - 1
            active &= active - 1
            end = _cell_end(starts, place, n)
            splitter = 0
            for vertex in lab[place:end]:
                splitter |= 1 << vertex
            state = _mix(state, place << 8 | end - place)
            self.work += starts.bit_count()
            low = 0
            while low < n:
                high = _cell_end(starts, low, n)
                if high - low > 1:
                    self.work += high - low
                    starts, active, state = self._split(lab, low, high, splitter, starts, active, state)
                low = high
        self.work += n
        if self.work > WORK_MAX:
            raise TooLargeError(
                f"{n} links are too symmetric to be labelled canonically (given up after {WORK_MAX:.0e} steps); "
                "label the parts of the graph, or compare such graphs by other means"
            )
        leaf = starts.bit_count() == n
        self.starts[level] = starts
        self.trace[level] = state >> 1 | (_LEAF if leaf else 0)

    def _split(
        self, lab: list[int], low: int, high: int, splitter: int, starts: int, active: int, state: int
    ) -> tuple[int, int, int]:
        """Split one cell; all fragments but the first largest become active (all, if the cell was active)."""
        keys = {}
        for vertex in lab[low:high]:
            key = 0
            for weight, layer in zip(self.weights, self.layers, strict=True):
                key += weight * (layer[vertex] & splitter).bit_count()
            keys[vertex] = key & _WORD
        if len(set(keys.values())) == 1:
            return starts, active, _mix(_mix(state, low), keys[lab[low]])
        cell = sorted(lab[low:high], key=keys.__getitem__)
        lab[low:high] = cell
        was_active = active >> low & 1
        largest, size, begin = low, 0, low
        for place in range(low + 1, high + 1):
            if place == high or keys[lab[place]] != keys[lab[begin]]:
                starts |= 1 << begin
                active |= 1 << begin
                state = _mix(_mix(state, begin << 8 | place - begin), keys[lab[begin]])
                if place - begin > size:
                    largest, size = begin, place - begin
                begin = place
        if not was_active:
            active &= ~(1 << largest)
        return starts, active, state

    def _visit(self, level: int) -> int:
        """Look at a new node; return the level whose next child is to be made."""
        trace = self.trace[level]
        if self.have_leaf:
            above = level == 0 or self.like_first[level - 1]
            self.like_first[level] = above and self.first_trace[level : level + 1] == [trace]
            versus = self.versus_best[level - 1] if level else 0
            if versus == 0 and trace != self.best_trace[level]:
                versus = 1 if trace > self.best_trace[level] else -1
            self.versus_best[level] = versus
            if versus < 0 and not self.like_first[level]:
                return level - 1
        if trace & _LEAF:
            return self._leaf(level)
        starts, best, size = self.starts[level], 0, self.n + 1
        place = 0
        while place < self.n:
            end = _cell_end(starts, place, self.n)
            if 1 < end - place < size:
                best, size = place, end - place
            place = end
        self.cell[level] = best
        self.left[level] = sum(1 << vertex for vertex in self.lab[level][best : best + size])
        return level

    def _leaf(self, level: int) -> int:
        order = self.lab[level]
        form = self._form(order)
        if not self.have_leaf:
            self.have_leaf = True
            self.on_first = level - 1
            self.first_trace = self.trace[: level + 1]
            self.first_path = self.path[:level]
            self.first_form, self.first_order = form, order
            self._take_as_best(level, form)
            return level - 1
        if self.like_first[level] and form == self.first_form:
            self._automorphism(self.first_order, order)
            return self.on_first
        versus = self.versus_best[level]
        if versus == 0 and form == self.form:
            self._automorphism(self.order_of_vertices, order)
            return next(i for i in range(level) if self.path[i] != self.best_path[i])
        if versus > 0 or (versus == 0 and form > self.form):
            self._take_as_best(level, form)
        return level - 1

    def _take_as_best(self, level: int, form: list[list[int]]) -> None:
        self.form = form
        self.order_of_vertices = self.lab[level]
        self.best_trace = self.trace[: level + 1]
        self.best_path = self.path[:level]
        self.versus_best[: level + 1] = [0] * (level + 1)

    def _form(self, order: list[int]) -> list[list[int]]:
        position = [0] * self.n
        for place, vertex in enumerate(order):
            position[vertex] = 1 << place
        return [[sum(position[u] for u in bits(layer[v])) for v in order] for layer in self.layers]

    def _automorphism(self, source: list[int], image: list[int]) -> None:
        permutation = [0] * self.n
        for a, b in zip(source, image, strict=True):
            permutation[a] = b
        if join_images(self.orbits, permutation):
            self.generators.append(permutation)
        else:
            self.others = [*self.others[1 - self.n :], permutation] if self.n > 1 else []

    def _exchange_twins(self, level: int) -> None:
        """Join the vertex of the first path with its twins in the target cell: all they join is outside the path."""
        vertex = self.first_path[level]
        for other in bits(self.left[level]):
            others = ~(1 << vertex | 1 << other)
            if any((layer[vertex] ^ layer[other]) & others for layer in self.layers):
                continue
            a, b = find_root(self.orbits, vertex), find_root(self.orbits, other)
            if a != b:
                self.orbits[max(a, b)] = min(a, b)
                permutation = list(range(self.n))
                permutation[vertex], permutation[other] = other, vertex
                self.generators.append(permutation)

    def _next(self, level: int) -> int:
        """Return the next vertex of the target cell to try, or -1."""
        left = self.left[level]
        if not left:
            return -1
        if not self.have_leaf or level == self.on_first:
            if self.twins and self.have_leaf:
                self._exchange_twins(level)
            parent = self.orbits
        else:
            parent = list(range(self.n))
            for permutation in (*self.generators, *self.others):
                if all(permutation[vertex] == vertex for vertex in self.path[:level]):
                    self.work += self.n
                    join_images(parent, permutation)
        while left:
            low = left & -left
            left ^= low
            vertex = low.bit_length() - 1
            if find_root(parent, vertex) == vertex:
                self.left[level] = left
                return vertex
        self.left[level] = 0
        return -1
