"""Rigid sub-chains by the pebble game.

For a set S of links, DOF(S) = Pi (|S| - 1) - sum over joints inside S of (Pi - f).  A chain without rigid sub-chain has
DOF(S) >= 1 for every S of two links or more.  With Pi - f parallel edges for a joint this reads: at most
Pi |S| - (Pi + 1) edges inside S, the (Pi, Pi+1)-sparsity that the pebble game decides exactly for Pi >= 2.

Source: A. Lee and I. Streinu, *Pebble game algorithms and sparse graphs*, Discrete Math. 308 (2008) 1425-1437.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from graphsynth.structure.connectivity import bits

if TYPE_CHECKING:
    from graphsynth.structure.graph import Joint, MechanismGraph


@dataclass(frozen=True, slots=True)
class RigidSubchain:
    """A sub-chain that cannot move in itself (exact, by counting).

    Parameters
    ----------
    links : tuple of int
        A largest set of links that generically move as one body.
    joints : tuple of Joint
        The joints between them.
    mobility : int
        DOF of this set, 0 (rigid) or negative (over-constrained).
    minimal_links, minimal_joints, minimal_mobility
        The same for a smallest culprit inside it: every smaller set of two links or more has DOF 1 at least.
    bodies : tuple of tuple of int
        All sets of two links or more that generically move as one body; they do not overlap.
    """

    links: tuple[int, ...]
    joints: tuple[Joint, ...]
    mobility: int
    minimal_links: tuple[int, ...]
    minimal_joints: tuple[Joint, ...]
    minimal_mobility: int
    bodies: tuple[tuple[int, ...], ...]

    def __str__(self) -> str:
        kind = "a rigid" if self.mobility == 0 else "an over-constrained"
        joints = ", ".join(f"{a}-{b}" for a, b, _ in self.minimal_joints)
        text = f"links {_list(self.links)} form {kind} sub-chain of mobility {self.mobility}"
        if self.minimal_links != self.links:
            text += f"; already links {_list(self.minimal_links)} have mobility {self.minimal_mobility}"
        return f"{text}; remove or free one of the joints {joints}"


class PebbleGame:
    """The (k, l)-pebble game on a multigraph whose edges are oriented as they are accepted.

    Parameters
    ----------
    free : iterable of int
        Pebbles on each vertex at the start: k, or another capacity.

    Examples
    --------
    A triangle of double edges has 3 * 3 - 3 edges: more than 3 * 3 - 4.

    >>> game = PebbleGame([3, 3, 3])
    >>> [game.insert(a, b, 4) for a, b in ((0, 1), (0, 1), (1, 2), (1, 2), (0, 2), (0, 2))]
    [True, True, True, True, True, False]
    """

    def __init__(self, free: Iterable[int]) -> None:
        self.free = list(free)
        #: ``out[u][v]``: number of edges oriented from u to v, paid for by pebbles of u.
        self.out: list[dict[int, int]] = [{} for _ in self.free]

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
                    self._reverse(came_from, to, other)
                    self.free[to] += 1
                    return True
                stack.append(other)
        return False

    def _reverse(self, came_from: dict[int, int], start: int, end: int) -> None:
        while end != start:
            tail = came_from[end]
            edges = self.out[tail]
            edges[end] -= 1
            if not edges[end]:
                del edges[end]
            self.out[end][tail] = self.out[end].get(tail, 0) + 1
            end = tail


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

    Examples
    --------
    >>> from graphsynth.structure.graph import MechanismGraph
    >>> print(find_rigid_subchain(MechanismGraph(4, [(0, 1), (1, 2), (0, 2), (2, 3), (3, 0)])))
    links 0, 1, 2, 3 form an over-constrained sub-chain of mobility -1; already links 0, 1, 2 have mobility 0; \
remove or free one of the joints 0-1, 0-2, 1-2
    """
    if not first_violation(graph.links, graph.joints, graph.space):
        return None
    bodies = rigid_bodies(graph.links, graph.joints, graph.space)
    body = max(bodies, key=int.bit_count)  # the first of the largest
    culprit = _minimal(graph, first_violation(graph.links, graph.joints, graph.space, body))
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


def _minimal(graph: MechanismGraph, culprit: int) -> int:
    """Shrink a violating set until no link can be left out."""
    for link in bits(culprit):
        if culprit >> link & 1:
            smaller = first_violation(graph.links, graph.joints, graph.space, culprit & ~(1 << link))
            culprit = smaller or culprit
    return culprit


def _induced(graph: MechanismGraph, mask: int) -> tuple[tuple[int, ...], tuple[Joint, ...], int]:
    joints = tuple(joint for joint in graph.joints if mask >> joint.a & mask >> joint.b & 1)
    links = tuple(bits(mask))
    return links, joints, graph.space * (len(links) - 1) - sum(graph.space - joint.mobility for joint in joints)


def _list(links: Iterable[int]) -> str:
    return ", ".join(map(str, links))
