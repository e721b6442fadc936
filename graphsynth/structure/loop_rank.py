"""Mobility at random geometry: W = G - rank of the loop matrix.

The cross-check of the structural formula: it finds the freedom that redundant constraints hide.

Sources: T.-S. Tay, *Rigidity of multi-graphs I*, J. Combin. Theory B 36 (1984) 95-112; W. Whiteley, *The union of
matroids and the rigidity of frameworks*, SIAM J. Discrete Math. 1 (1988) 237-255, for hinges; ``docs/explanation/
mechanism-graph.md``, section *Mobility at random geometry*.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import TooLargeError
from graphsynth.core.wording import whole
from graphsynth.structure.connectivity import bits

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph

#: Rank is taken over the integers modulo this prime (2^31 - 1), so that products fit in 64 bits.
_PRIME = 2_147_483_647
#: Largest number of entries of a loop matrix: some seconds of elimination.
_ENTRIES_MAX = 1_000_000


@dataclass(frozen=True, slots=True)
class GenericMobility:
    """Mobility at random geometry, W = G - rank of the loop matrix.

    The random values are integers modulo a prime, so the rank is exact for them.  ``mobility`` is never below the
    generic value and equals it with probability at least ``1 - failure_bound`` (Schwartz-Zippel).

    Parameters
    ----------
    mobility : int
        Mobility found.
    structural : int
        Mobility by the structural formula; the difference is the number of redundant constraints.
    sub_edges, rank, loops : int
        Columns G, rank, and number of independent loops v of the loop matrix.
    failure_bound : float
        Upper bound of the probability that the rank is too small.
    """

    mobility: int
    structural: int
    sub_edges: int
    rank: int
    loops: int
    failure_bound: float

    @property
    def redundant_constraints(self) -> int:
        """Constraints that follow from the others."""
        return self.mobility - self.structural


def generic_mobility(graph: MechanismGraph, seed: int = 0) -> GenericMobility:
    """Return the mobility at random geometry, W = G - rank of the loop matrix.

    Each joint of mobility f gets f random screws of the Pi-dimensional space: in the plane a revolute joint at a random
    point, for f = 2 a pin in a random slot.  Each independent loop gives Pi rows.  By Tay's theorem and its
    extension to hinges [Whiteley 1988] random screws have the rank of random joints.

    Parameters
    ----------
    graph : MechanismGraph
        A graph in c connected parts has Pi (c - 1) freedoms more than its joints show; they are counted.
    seed : int, optional
        Seed of the random geometry.

    Returns
    -------
    GenericMobility
        Exact with probability at least ``1 - failure_bound``; never too small.

    Raises
    ------
    TooLargeError
        If the loop matrix has more than a million entries (a dense graph of more than about 60 links).

    Examples
    --------
    The triangle is rigid; the second brace of a square is redundant.

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> generic_mobility(MechanismGraph(3, [(0, 1), (1, 2), (0, 2)])).mobility
    0
    >>> generic_mobility(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3), (0, 2), (1, 3)])).redundant_constraints
    3
    """
    entries = graph.space * graph.loops * graph.sub_edges
    if entries > _ENTRIES_MAX:
        raise TooLargeError(
            f"the loop matrix has {entries} entries, more than {_ENTRIES_MAX}; use rigid_subchain(), which counts",
            float(entries),
        )
    matrix = _loop_matrix(graph, whole(seed, "seed", 0, 10**100))
    rank = _rank(matrix)
    parts = len(graph.components)
    return GenericMobility(
        mobility=graph.sub_edges - rank + graph.space * (parts - 1),
        structural=graph.mobility,
        sub_edges=graph.sub_edges,
        rank=rank,
        loops=graph.loops,
        failure_bound=rank / _PRIME,
    )


def _loop_matrix(graph: MechanismGraph, seed: int) -> Any:
    """Return the loop matrix modulo the prime, shape (Pi v, G), for the fundamental loops of a spanning forest."""
    import numpy as np

    space = graph.space
    random = np.random.default_rng(seed)
    screws = random.integers(1, _PRIME, size=(space, graph.sub_edges), dtype=np.int64)
    columns: dict[tuple[int, int], slice] = {}
    begin = 0
    for a, b, mobility in graph.joints:
        columns[a, b] = slice(begin, begin + mobility)
        begin += mobility
    parent, depth = _forest(graph)
    matrix = np.zeros((space * graph.loops, graph.sub_edges), dtype=np.int64)
    row = 0
    for a, b, _ in graph.joints:
        if parent[a] == b or parent[b] == a:
            continue
        block = matrix[row : row + space]
        row += space
        block[:, columns[a, b]] = screws[:, columns[a, b]]
        while a != b:  # back from b to a along the tree
            lower = a if depth[a] >= depth[b] else b
            upper = parent[lower]
            sign = 1 if (lower == b) == (lower < upper) else -1
            where = columns[min(lower, upper), max(lower, upper)]
            block[:, where] = sign * screws[:, where] % _PRIME
            a, b = (upper, b) if lower == a else (a, upper)
    return matrix


def _forest(graph: MechanismGraph) -> tuple[list[int], list[int]]:
    """Return parent (-1 at roots) and depth of each link in a breadth-first spanning forest."""
    parent, depth = [-1] * graph.links, [0] * graph.links
    for part in graph.components:
        queue = [part[0]]
        seen = 1 << part[0]
        for link in queue:
            for other in bits(graph.neighbours[link] & ~seen):
                seen |= 1 << other
                parent[other], depth[other] = link, depth[link] + 1
                queue.append(other)
    return parent, depth


def _rank(matrix: Any) -> int:
    """Return the rank modulo the prime by Gaussian elimination; the matrix is overwritten."""
    import numpy as np

    rank = 0
    rows, columns = matrix.shape
    for column in range(columns):
        pivots = np.flatnonzero(matrix[rank:, column])
        if not len(pivots):
            continue
        pivot = rank + int(pivots[0])
        matrix[[rank, pivot]] = matrix[[pivot, rank]]
        inverse = pow(int(matrix[rank, column]), -1, _PRIME)
        matrix[rank] = matrix[rank] * inverse % _PRIME
        below = rank + 1 + np.flatnonzero(matrix[rank + 1 :, column])
        factors = matrix[below, column : column + 1]
        matrix[below] = (matrix[below] - factors * matrix[rank] % _PRIME) % _PRIME
        rank += 1
        if rank == rows:
            break
    return rank
