"""Views of a mechanism graph in networkx, both ways."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import FormatError
from graphsynth.structure.text import LINKS_MAX

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph


def to_networkx(graph: MechanismGraph) -> Any:
    """Return a ``networkx.Graph`` with nodes 0..N-1.

    Edges carry ``mobility``; the graph carries ``space`` and, if chosen, ``frame``.

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> sorted(to_networkx(MechanismGraph(3, [(0, 1), (1, 2, 2)])).edges(data="mobility"))
    [(0, 1, 1), (1, 2, 2)]
    """
    import networkx

    view = networkx.Graph(space=graph.space)
    if graph.frame is not None:
        view.graph["frame"] = graph.frame
    view.add_nodes_from(range(graph.links))
    view.add_edges_from((a, b, {"mobility": mobility}) for a, b, mobility in graph.joints)
    return view


def from_networkx(graph: Any) -> tuple[int, list[tuple[int, int, Any]], Any, Any]:
    """Return ``(links, joints, frame, space)`` of a ``networkx.Graph``, still to be checked by the constructor.

    Raises `FormatError` if it is no undirected simple graph, has too many nodes, or names a frame that is not one of
    them.
    """
    import networkx

    if not isinstance(graph, networkx.Graph):
        raise FormatError(f"expected a networkx.Graph, not {type(graph).__name__}", "graph")
    if graph.is_directed() or graph.is_multigraph():
        raise FormatError("a mechanism graph is undirected and simple; convert with networkx.Graph(...)", "graph")
    links = len(graph)
    if not 1 <= links <= LINKS_MAX:
        raise FormatError(f"{links} nodes; a mechanism graph has 1 to {LINKS_MAX} links", "graph")
    number = _numbering(graph)
    joints = [(number[a], number[b], data.get("mobility", 1)) for a, b, data in graph.edges(data=True)]
    frame = graph.graph.get("frame")
    if frame is not None:
        try:
            frame = number[frame]
        except (KeyError, TypeError):
            raise FormatError("the graph attribute 'frame' is not a node of the graph", "frame") from None
    return links, joints, frame, graph.graph.get("space", 3)


def _numbering(graph: Any) -> dict[Any, int]:
    """Return the link number of each node: 0..N-1 stay, other names are numbered in their order."""
    nodes = list(graph)
    if all(type(node) is int and 0 <= node < len(nodes) for node in nodes):
        return {node: node for node in nodes}
    return {node: place for place, node in enumerate(nodes)}
