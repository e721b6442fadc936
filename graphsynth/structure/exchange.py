"""What a mechanism graph is made from: checked joints, and graphs of networkx.

Whatever comes in, only FormatError goes out.
"""

from __future__ import annotations

from collections.abc import Iterable
from operator import index
from typing import Any

from graphsynth.core.errors import FormatError
from graphsynth.structure.text import LINKS_MAX


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
    number = {node: place for place, node in enumerate(graph)}
    if all(type(node) is int and 0 <= node < links for node in graph):  # these keep their number
        number = {node: node for node in graph}
    joints = [(number[a], number[b], data.get("mobility", 1)) for a, b, data in graph.edges(data=True)]
    frame = graph.graph.get("frame")
    if frame is not None:
        try:
            frame = number[frame]
        except (KeyError, TypeError):
            raise FormatError("the graph attribute 'frame' is not a node of the graph", "frame") from None
    return links, joints, frame, graph.graph.get("space", 3)


def integer(value: object, place: str, low: int, high: int, what: str) -> int:
    """Return a plain int within its bounds or raise FormatError."""
    try:
        number = index(value)  # type: ignore[arg-type]
    except Exception:  # whatever a foreign __index__ raises
        raise FormatError(f"the {what} must be an integer, not {type(value).__name__}", place) from None
    if not low <= number <= high:
        shown = number if abs(number) < 10**18 else "a number of many digits"
        raise FormatError(f"the {what} must be within {low} to {high}, not {shown}", place)
    return number


def packed_joints(links: int, joints: Iterable[Any], space: int) -> bytes:
    """Return valid joints packed and sorted."""
    found: dict[tuple[int, int], bytes] = {}
    try:
        items = iter(joints)
    except TypeError:
        raise FormatError(f"joints must be pairs of links, not {type(joints).__name__}", "joints") from None
    for count, item in enumerate(items, start=1):
        place = f"joint {count}"
        try:
            a, b, *rest = item
        except (TypeError, ValueError):
            raise FormatError("a joint is (a, b) or (a, b, mobility)", place) from None
        if len(rest) > 1:
            raise FormatError(f"a joint is (a, b) or (a, b, mobility), not {len(rest) + 2} values", place)
        a = integer(a, place, 0, links - 1, "number of a link")
        b = integer(b, place, 0, links - 1, "number of a link")
        mobility = integer(rest[0], place, 1, space - 1, "mobility of a joint") if rest else 1
        if a == b:
            raise FormatError(f"link {a} is jointed to itself", place)
        a, b = min(a, b), max(a, b)
        if (a, b) in found:
            raise FormatError(f"links {a} and {b} are jointed twice; merge the two joints or add a link", place)
        found[a, b] = bytes((a, b, mobility))
    return b"".join(sorted(found.values()))
