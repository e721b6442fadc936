"""Rigid sub-chains by the pebble game, and the mobility at random geometry as a cross-check.

For a set S of links, DOF(S) = Pi (|S| - 1) - sum over joints inside S of (Pi - f).  A chain without rigid sub-chain has
DOF(S) >= 1 for every S of two links or more.  With Pi - f parallel edges for a joint this reads: at most
Pi |S| - (Pi + 1) edges inside S, the (Pi, Pi+1)-sparsity that the pebble game decides exactly for Pi >= 2.  The rank of
the loop matrix at random geometry, W = G - rank, also finds the freedom that redundant constraints hide.

Sources: A. Lee and I. Streinu, *Pebble game algorithms and sparse graphs*, Discrete Math. 308 (2008) 1425-1437;
T.-S. Tay, *Rigidity of multi-graphs I*, J. Combin. Theory B 36 (1984) 95-112; W. Whiteley, *The union of matroids and
the rigidity of frameworks*, SIAM J. Discrete Math. 1 (1988) 237-255, for hinges; ``docs/explanation/
mechanism-graph.md``, section *Mobility at random geometry*.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import GraphError, TooLargeError
from graphsynth.core.wording import whole
from graphsynth.structure.connectivity import bits

if TYPE_CHECKING:
    from graphsynth.structure.graph import Joint, MechanismGraph


@dataclass(frozen=True, slots=True)
class RigidSubchain:
    """A sub-chain that cannot move in itself (exact, by counting)."""

    links: tuple[int, ...]  # a largest set of links that generically move as one body
    joints: tuple[Joint, ...]  # the joints between them
    mobility: int  # DOF of this set, 0 (rigid) or negative (over-constrained)
    #: the same for a smallest culprit inside it: every smaller set of two links or more has DOF 1 at least
    minimal_links: tuple[int, ...]
    minimal_joints: tuple[Joint, ...]
    minimal_mobility: int
    bodies: tuple[tuple[int, ...], ...]  # all sets of two links or more that move as one body; they do not overlap

    def __str__(self) -> str:
        kind = "a rigid" if self.mobility == 0 else "an over-constrained"
        joints = ", ".join(f"{a}-{b}" for a, b, _ in self.minimal_joints)
        text = f"links {_list(self.links)} form {kind} sub-chain of mobility {self.mobility}"
        if self.minimal_links != self.links:
            text += f"; already links {_list(self.minimal_links)} have mobility {self.minimal_mobility}"
        return f"{text}; remove or free one of the joints {joints}"


class PebbleGame:
    """The (k, l)-pebble game on a multigraph whose edges are oriented as they are accepted.

    ``free``: pebbles on each vertex at the start, k or another capacity.  A triangle of double edges has 3 * 3 - 3
    edges: more than 3 * 3 - 4.

    >>> game = PebbleGame([3, 3, 3])
    >>> [game.insert(a, b, 4) for a, b in ((0, 1), (0, 1), (1, 2), (1, 2), (0, 2), (0, 2))]
    [True, True, True, True, True, False]
    """

    def __init__(self, free: Iterable[int]) -> None:
        self.free = list(free)
        #: ``out[u][v]``: number of edges oriented from u to v, paid for by pebbles of u.
        self.out: list[dict[int, int]] = [{} for _ in self.free]

    def copy(self) -> PebbleGame:
        """Return the same state of the game, to play on."""
        other = PebbleGame(self.free)
        other.out = [dict(edges) for edges in self.out]
        return other

    def gather(self, a: int, b: int, wanted: int) -> bool:
        """Move pebbles to ``a`` and ``b`` until they hold ``wanted`` together; False if that is impossible."""
        while self.free[a] + self.free[b] < wanted:
            if not (self._fetch(a, b) or self._fetch(b, a)):
                return False
        return True

    def insert(self, a: int, b: int, spare: int) -> bool:
        """Insert an edge if ``spare + 1`` pebbles can be gathered on its ends (``spare`` is l of the game)."""
        if not self.gather(a, b, spare + 1):
            return False
        if not self.free[a]:
            a, b = b, a
        self.free[a] -= 1
        self.out[a][b] = self.out[a].get(b, 0) + 1
        return True

    def reach(self, *starts: int) -> int:
        """Return the bit mask of the vertices that oriented edges lead to from ``starts``, these included."""
        seen = 0
        stack = list(starts)
        while stack:
            vertex = stack.pop()
            if not seen >> vertex & 1:
                seen |= 1 << vertex
                stack.extend(self.out[vertex])
        return seen

    def _fetch(self, to: int, keep: int) -> bool:
        """Bring one pebble to ``to`` along a reversed path, leaving those of ``keep`` where they are."""
        came_from = {to: to, keep: keep}
        stack = [to]
        while stack:
            vertex = stack.pop()
            for other in self.out[vertex]:
                if other in came_from:
                    continue
                came_from[other] = vertex
                if self.free[other]:
                    self.free[other] -= 1
                    self.free[to] += 1
                    while other != to:  # reverse the path
                        tail = came_from[other]
                        edges = self.out[tail]
                        edges[other] -= 1
                        if not edges[other]:
                            del edges[other]
                        self.out[other][tail] = self.out[other].get(tail, 0) + 1
                        other = tail
                    return True
                stack.append(other)
        return False


def first_violation(links: int, joints: Iterable[Sequence[int]], space: int, within: int = -1) -> int:
    """Return the bit mask of a set with DOF 0 or less, or 0 if there is none (exact).

    ``links``: number of links; ``joints`` iterable of (a, b, mobility): parallel joints are allowed; ``space``: Pi, 2
    to 6; ``within``: only links of this bit mask count. When an edge is refused, the vertices that oriented edges
    lead to from its ends are the smallest tight set around it: no edge leaves a tight set whose spare pebbles lie on
    the two ends.

    >>> first_violation(4, [(0, 1, 1), (1, 2, 1), (0, 2, 1), (2, 3, 1)], 3)
    7
    """
    game = PebbleGame([space] * links)
    for a, b, mobility in joints:
        if within >> a & 1 and within >> b & 1:
            for _ in range(space - mobility):
                if not game.insert(a, b, space + 1):
                    return game.reach(a, b)
    return 0


def is_sparse(graph: MechanismGraph, within: int = -1) -> bool:
    """Return whether DOF(S) >= 1 for every set S of two links or more, among the links of a bit mask (exact).

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> is_sparse(MechanismGraph(3, [(0, 1), (1, 2), (0, 2)]))
    False
    """
    return not first_violation(graph.links, graph.joints, graph.space, within)


def find_rigid_subchain(graph: MechanismGraph) -> RigidSubchain | None:
    """Return a report on a rigid or over-constrained sub-chain, or None if every set of links can move (exact).

    The report has the largest body (ties: with the smallest link) and a minimal culprit inside it.  Bodies are the
    components of the (Pi, Pi)-sparsity matroid: two bodies with a common link would be one, so they do not overlap.

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> print(find_rigid_subchain(MechanismGraph(4, [(0, 1), (1, 2), (0, 2), (2, 3), (3, 0)])))
    links 0, 1, 2, 3 form an over-constrained sub-chain of mobility -1; already links 0, 1, 2 have mobility 0; \
remove or free one of the joints 0-1, 0-2, 1-2
    """
    if not first_violation(graph.links, graph.joints, graph.space):
        return None
    bodies = rigid_bodies(graph.links, graph.joints, graph.space)
    body = max(bodies, key=int.bit_count)  # the first of the largest
    culprit = first_violation(graph.links, graph.joints, graph.space, body)
    for link in bits(culprit):  # until no link can be left out
        if culprit >> link & 1:
            smaller = first_violation(graph.links, graph.joints, graph.space, culprit & ~(1 << link))
            culprit = smaller or culprit
    return RigidSubchain(
        *_induced(graph, body), *_induced(graph, culprit), bodies=tuple(tuple(bits(mask)) for mask in bodies)
    )


def rigid_bodies(links: int, joints: Iterable[Sequence[int]], space: int, within: int = -1) -> list[int]:
    """Return the sets of two links or more that generically move as one body, as bit masks (exact).

    ``links``, ``joints``, ``space``, ``within``: as in :func:`first_violation`.

    >>> rigid_bodies(6, [(0, 1, 1), (1, 2, 1), (0, 2, 1), (2, 3, 1), (3, 4, 1), (4, 5, 1), (0, 5, 1)], 3)
    [7]
    """
    game = PebbleGame([space] * links)
    for a, b, mobility in joints:
        if within >> a & 1 and within >> b & 1:
            for _ in range(space - mobility):
                game.insert(a, b, space)
    bodies: list[int] = []
    for link in bits(within & (1 << links) - 1):
        for place, body in enumerate(bodies):
            # Two links have Pi + 1 free pebbles between them exactly when they can move relative to each other.
            if not game.gather((body & -body).bit_length() - 1, link, space + 1):
                bodies[place] |= 1 << link
                break
        else:
            bodies.append(1 << link)
    return [body for body in bodies if body.bit_count() > 1]


def mobility_type(graph: MechanismGraph) -> str:
    """Return how the mobility W of a chain is shared out: ``"total"``, ``"partial"`` or ``"fractionated"`` (exact).

    *Fractionated*: a link or a joint holds the chain together.  *Partial*: it is not, and some sub-chain with a loop
    has a mobility of less than W.  *Total*: neither; then, and only then, any W freedoms of joints can be the inputs.
    So joints that follow one another are held, W freedoms at most, and each must be one constraint more.  Raises
    `GraphError` for a chain without mobility or with a rigid sub-chain.

    References: docs/explanation/mechanism-graph.md, section *Total, partial, fractionated*.

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> mobility_type(MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)]))
    'total'
    """
    if graph.mobility < 1 or not is_sparse(graph):
        raise GraphError(
            f"the type of mobility is that of a chain that moves in all its parts; this one has mobility "
            f"{graph.mobility} and {graph.rigid_subchain() or 'no rigid sub-chain'}"
        )
    if graph.is_fractionated:
        return "fractionated"
    game = PebbleGame([graph.space] * graph.links)
    for a, b, mobility in graph.joints:
        for _ in range(graph.space - mobility):
            game.insert(a, b, graph.space)
    drives = all(_can_hold(graph, game, joint, set(), graph.mobility) for joint in graph.joints)
    return "total" if drives else "partial"


def _can_hold(graph: MechanismGraph, game: PebbleGame, joint: Joint, held: set[Joint], free: int) -> bool:
    """Tell whether this joint can be held beside others, and then any that follow it, ``free`` freedoms at most."""
    game, held = game.copy(), held | {joint}
    for _ in range(min(free, joint.mobility)):
        if not game.insert(joint.a, joint.b, graph.space):
            return False
    free -= joint.mobility
    near = (other for other in graph.joints if other not in held and {*other[:2]} & {*joint[:2]})
    return free <= 0 or all(_can_hold(graph, game, other, held, free) for other in near)


def _induced(graph: MechanismGraph, mask: int) -> tuple[tuple[int, ...], tuple[Joint, ...], int]:
    joints = tuple(joint for joint in graph.joints if mask >> joint.a & mask >> joint.b & 1)
    links = tuple(bits(mask))
    return links, joints, graph.space * (len(links) - 1) - sum(graph.space - joint.mobility for joint in joints)


def _list(links: Iterable[int]) -> str:
    return ", ".join(map(str, links))


#: Rank is taken over the integers modulo this prime (2^31 - 1), so that products fit in 64 bits.
_PRIME = 2_147_483_647

#: Largest number of entries of a loop matrix: some seconds of elimination.
_ENTRIES_MAX = 1_000_000


@dataclass(frozen=True, slots=True)
class GenericMobility:
    """Mobility at random geometry, W = G - rank of the loop matrix.

    The random values are integers modulo a prime, so the rank is exact for them.  ``mobility`` is never below the
    generic value and equals it with probability at least ``1 - failure_bound`` (Schwartz-Zippel).
    """

    mobility: int
    structural: int  # by the structural formula; the difference is the number of redundant constraints
    sub_edges: int  # columns G of the loop matrix
    rank: int
    loops: int  # independent loops v
    failure_bound: float  # upper bound of the probability that the rank is too small

    @property
    def redundant_constraints(self) -> int:
        """Constraints that follow from the others."""
        return self.mobility - self.structural


def generic_mobility(graph: MechanismGraph, seed: int = 0) -> GenericMobility:
    """Return the mobility at random geometry, W = G - rank of the loop matrix.

    Each joint of mobility f gets f random screws of the Pi-dimensional space: in the plane a revolute joint at a random
    point, for f = 2 a pin in a random slot.  Each independent loop gives Pi rows.  By Tay's theorem and its
    extension to hinges [Whiteley 1988] random screws have the rank of random joints.  A graph in c connected parts has
    Pi (c - 1) freedoms more than its joints show; they are counted.  Raises `TooLargeError` for a loop matrix with more
    than a million entries (a dense graph of more than about 60 links).

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
    mobility = graph.sub_edges - rank + graph.space * (parts - 1)
    return GenericMobility(mobility, graph.mobility, graph.sub_edges, rank, graph.loops, rank / _PRIME)


def _loop_matrix(graph: MechanismGraph, seed: int) -> Any:
    """Return the loop matrix modulo the prime, shape (Pi v, G), for the fundamental loops of a spanning forest."""
    import numpy as np

    size = (graph.space, graph.sub_edges)
    screws = np.random.default_rng(seed).integers(1, _PRIME, size=size, dtype=np.int64)
    number = {(a, b): k for k, (a, b, _) in enumerate(graph.joints)}
    paths = np.zeros((graph.links, len(number)), np.int8)  # joints from the root of its tree to each link, by sense
    chords = dict.fromkeys(number.values())
    for part in graph.components:
        queue = [part[0]]
        seen = 1 << part[0]
        for link in queue:
            for other in bits(graph.neighbours[link] & ~seen):
                seen |= 1 << other
                joint = number[min(link, other), max(link, other)]
                paths[other] = paths[link]
                paths[other, joint] = 1 if link < other else -1
                queue.append(other)
                del chords[joint]
    loops = np.array([paths[a] - paths[b] for a, b, _ in (graph.joints[k] for k in chords)], np.int8)
    loops = loops.reshape(len(chords), len(number))
    loops[range(len(chords)), list(chords)] = 1  # along the chord from a to b, back along the tree
    signs = np.repeat(loops, [mobility for _, _, mobility in graph.joints], axis=1)
    return (signs[:, None] * screws % _PRIME).reshape(graph.space * len(chords), graph.sub_edges)


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
