"""Cut links, cut joints, planarity, girth."""

from __future__ import annotations

from typing import TYPE_CHECKING

from graphsynth.structure.levels import bits, component_of

if TYPE_CHECKING:
    from graphsynth.structure.graph import Joint, MechanismGraph

__all__ = ["cut_joints", "cut_links", "girth", "is_planar"]


def cut_links(graph: MechanismGraph) -> tuple[int, ...]:
    """Return the links whose removal splits the connected part they belong to, ascending.

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> cut_links(MechanismGraph(5, [(0, 1), (1, 2), (0, 2), (2, 3), (3, 4), (2, 4)]))
    (2,)
    """
    neighbours = graph.neighbours
    found = []
    for link, around in enumerate(neighbours):
        first = around & -around
        if first and around & ~component_of(neighbours, first.bit_length() - 1, within=~(1 << link)):
            found.append(link)
    return tuple(found)


def cut_joints(graph: MechanismGraph) -> tuple[Joint, ...]:
    """Return the joints whose removal splits the connected part they belong to, sorted.

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> cut_joints(MechanismGraph(4, [(0, 1), (1, 2), (0, 2), (2, 3)]))
    (Joint(a=2, b=3, mobility=1),)
    """
    found = []
    for joint in graph.joints:
        neighbours = list(graph.neighbours)
        neighbours[joint.a] &= ~(1 << joint.b)
        neighbours[joint.b] &= ~(1 << joint.a)
        if not component_of(neighbours, joint.a) >> joint.b & 1:
            found.append(joint)
    return tuple(found)


def is_planar(graph: MechanismGraph) -> bool:
    """Return whether the graph can be drawn in the plane without crossing joints.

    The left-right planarity test of networkx (exact).

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> is_planar(MechanismGraph(6, [(a, b) for a in (0, 1, 2) for b in (3, 4, 5)]))
    False
    """
    import networkx

    planar, _ = networkx.check_planarity(graph.to_networkx())
    return bool(planar)


def girth(graph: MechanismGraph) -> int | None:
    """Return the number of joints of a shortest loop, or None for a graph without loops.

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> girth(MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (0, 3), (3, 4)]))
    4
    """
    shortest = min((_shortest_loop_through(graph, link) for link in range(graph.links)), default=0)
    return None if shortest > graph.links else shortest


def _shortest_loop_through(graph: MechanismGraph, link: int) -> int:
    """Return the length of some loop, the shortest of all if ``link`` lies on it; more than N without loops."""
    distance = {link: 0}
    parent = {link: link}
    queue = [link]
    shortest = graph.links + 1
    for near in queue:
        for far in bits(graph.neighbours[near]):
            if far not in distance:
                distance[far], parent[far] = distance[near] + 1, near
                queue.append(far)
            elif far != parent[near]:
                shortest = min(shortest, distance[near] + distance[far] + 1)
    return shortest
