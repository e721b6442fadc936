"""Spanning tree of a mechanism and the joints that are cut: what an engine of joint coordinates needs.

See theory/exports 2.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from graphsynth.core.checks import checked
from graphsynth.core.errors import GraphError
from graphsynth.mechanism.joints import JointGeometry, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.model import Mechanism


@dataclass(frozen=True)
class SpanningTree:
    """A tree rooted at the frame.

    Attributes
    ----------
    edges : tuple of (parent, link, joint)
        Joints as indices into ``mechanism.joints``; parents come before their children.
    cuts : tuple of int
        The other joints, ascending; gears and cams are always among them.
    """

    edges: tuple[tuple[int, int, int], ...]
    cuts: tuple[int, ...]

    def children(self, link: int) -> tuple[tuple[int, int], ...]:
        """(link, joint) of the links that hang on ``link``."""
        return tuple((child, joint) for parent, child, joint in self.edges if parent == link)


@checked
def spanning_tree(mechanism: Mechanism) -> SpanningTree:
    """Choose the tree: sliding pairs and slots stay in it, turning pairs are cut, the depth is small (exact).

    A cut turning pair is one pair of points that coincide, which every engine knows; a cut sliding pair is not.  So
    the tree holds as many sliding pairs and slots as it can, and the rest is filled breadth first from the frame.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    SpanningTree

    Raises
    ------
    GraphError
        A link held by gears or cams alone.

    References
    ----------
    See theory/exports 2.

    Examples
    --------
    >>> from graphsynth.mechanism.model import MechanismGraph
    >>> graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    >>> slider_crank = Mechanism(graph, [
    ...     Revolute(0, 1), Revolute(1, 2, (0.1, 0.0)), Revolute(2, 3, (0.3, 0.0)), Prismatic(0, 3)])
    >>> spanning_tree(slider_crank)
    SpanningTree(edges=((0, 3, 1), (0, 1, 0), (3, 2, 3)), cuts=(2,))
    """
    joints = mechanism.joints
    slides = _forest(mechanism)
    edges: list[tuple[int, int, int]] = []
    seen = {mechanism.frame}
    layer = deque(_component(joints, slides, mechanism.frame, seen, edges))
    while layer:
        link = layer.popleft()
        for index, joint in enumerate(joints):
            other = _across(joint, link)
            if not isinstance(joint, Revolute) or other is None or other in seen:
                continue
            seen.add(other)
            edges.append((link, other, index))
            layer.extend(_component(joints, slides, other, seen, edges))
    missing = sorted(set(range(mechanism.graph.links)) - seen)
    if missing:
        raise GraphError(f"links {missing} hang on gears or cams alone; give each a turning or sliding pair")
    used = {index for *_, index in edges}
    return SpanningTree(tuple(edges), tuple(k for k in range(len(joints)) if k not in used))


def _across(joint: JointGeometry, link: int) -> int | None:
    """Return the other link of a joint, None if the joint is elsewhere."""
    return joint.b if joint.a == link else joint.a if joint.b == link else None


def _forest(mechanism: Mechanism) -> set[int]:
    """Sliding pairs, then slots, without a cycle (Kruskal)."""
    root = list(range(mechanism.graph.links))

    def find(link: int) -> int:
        while root[link] != link:
            link = root[link]
        return link

    chosen: set[int] = set()
    for kind in (Prismatic, PinSlot):
        for index, joint in enumerate(mechanism.joints):
            if isinstance(joint, kind) and find(joint.a) != find(joint.b):
                root[find(joint.a)] = find(joint.b)
                chosen.add(index)
    return chosen


def _component(
    joints: tuple[JointGeometry, ...],
    slides: set[int],
    start: int,
    seen: set[int],
    edges: list[tuple[int, int, int]],
) -> list[int]:
    """Walk the chosen sliding joints from ``start``; return the links reached, ``start`` first."""
    reached = [start]
    for link in reached:
        for index in sorted(slides):
            other = _across(joints[index], link)
            if other is not None and other not in seen:
                seen.add(other)
                edges.append((link, other, index))
                reached.append(other)
    return reached
