"""Adjacency levels and connected parts; cut links, cut joints, planarity, girth.

Adjacency levels: L0 is the frame, L(k+1) the links jointed to Lk and in no earlier level.  Joints run inside a level or
between neighbouring levels (docs/explanation/mechanism-graph.md, section *Levels*).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from graphsynth.structure.graph import Joint, MechanismGraph


def bits(mask: int) -> list[int]:
    """Return the positions of the set bits, ascending.

    >>> bits(0b10110)
    [1, 2, 4]
    """
    found = []
    while mask:
        low = mask & -mask
        found.append(low.bit_length() - 1)
        mask ^= low
    return found


def breadth_first(neighbours: Sequence[int], start: int, within: int = -1) -> list[int]:
    """Return the breadth-first levels from one link as bit masks.

    ``neighbours``: for each link the bit mask of the links jointed to it; ``start``: the link that makes level 0;
    ``within``: bit mask of the links that may be visited; all by default. Returns one bit mask per level; links that
    cannot be reached are in none.

    >>> breadth_first([0b0010, 0b0101, 0b1010, 0b0100], 0)
    [1, 2, 4, 8]
    """
    level = 1 << start
    seen = level
    levels = []
    while level:
        levels.append(level)
        reached = 0
        for link in bits(level):
            reached |= neighbours[link]
        level = reached & within & ~seen
        seen |= level
    return levels


def component_of(neighbours: Sequence[int], start: int, within: int = -1) -> int:
    """Return the bit mask of the links that can be reached from ``start``.

    >>> component_of([0b010, 0b001, 0b000], 0)
    3
    """
    mask = 0
    for level in breadth_first(neighbours, start, within):
        mask |= level
    return mask


def components_of(neighbours: Sequence[int], within: int) -> list[int]:
    """Return the connected parts of the links in ``within``, each as a bit mask, by smallest link.

    >>> components_of([0b010, 0b001, 0b000], 0b111)
    [3, 4]
    """
    parts = []
    while within:
        part = component_of(neighbours, (within & -within).bit_length() - 1, within)
        within &= ~part
        parts.append(part)
    return parts


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
    shortest = graph.links + 1
    for link in range(graph.links):  # breadth first: finds the shortest loop if the link lies on it
        distance = {link: 0}
        parent = {link: link}
        queue = [link]
        for near in queue:
            for far in bits(graph.neighbours[near]):
                if far not in distance:
                    distance[far], parent[far] = distance[near] + 1, near
                    queue.append(far)
                elif far != parent[near]:
                    shortest = min(shortest, distance[near] + distance[far] + 1)
    return None if shortest > graph.links else shortest
