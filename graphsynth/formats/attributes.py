"""Graphs and mechanisms as named vertices and edges with text attributes: what GraphML and DOT have in common.

A graph carries ``frame`` (if chosen) and ``space``, an edge ``mobility``.  A dimensioned mechanism carries besides, as
JSON, ``joint`` on every edge and ``drivers``, ``points``, ``pose`` on the graph, so the round trip is exact.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from graphsynth.core.errors import FormatError
from graphsynth.core.textfiles import json_value
from graphsynth.mechanism.files import FORMAT, VERSION, from_dict, to_dict
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.text import LINKS_MAX

Item = MechanismGraph | Mechanism

_WHOLE = ("drivers", "points", "pose")
#: Attributes that are read; readers keep no others, so that defaults of many names cost nothing.
OF_GRAPH = frozenset({"frame", "space", *_WHOLE})
OF_EDGE = frozenset({"mobility", "joint"})
_NUMBER = re.compile(r"\s*+([0-9]{1,4})\s*+", re.ASCII)


class Edge(NamedTuple):
    """An edge as read: names of its ends, attributes, and where it stood."""

    source: str
    target: str
    attributes: Mapping[str, str]
    place: str


class Spent:
    """Characters of attributes that were read, each default counted wherever it applies.

    Otherwise a text of a megabyte could say, by one default, what fills gigabytes.
    """

    def __init__(self, most: int) -> None:
        self.most, self.count = most, 0

    def add(self, attributes: Mapping[str, str], place: str) -> None:
        """Count the values of an element; refuse too many."""
        self.count += sum(map(len, attributes.values()))
        if self.count > self.most:
            raise FormatError(f"the attributes, defaults included, have more than {self.most} characters", place)


def attributes_of(item: Item) -> tuple[MechanismGraph, dict[str, str], list[dict[str, str]]]:
    """Return the graph, its attributes, and those of its joints in the order of ``graph.joints``."""
    graph = item.graph if isinstance(item, Mechanism) else item
    own = {"space": str(graph.space)}
    if graph.frame is not None:
        own["frame"] = str(graph.frame)
    edges = [{"mobility": str(mobility)} for _, _, mobility in graph.joints]
    if isinstance(item, Mechanism):
        data = to_dict(item)
        own |= {name: _compact(data[name]) for name in _WHOLE if name in data}
        for edge, joint in zip(edges, data["joints"]):
            edge |= {"kind": joint["kind"], "joint": _compact(joint)}
    return graph, own, edges


def _compact(value: object) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def item_from(nodes: Sequence[str], edges: Sequence[Edge], own: Mapping[str, str], place: str, spent: Spent) -> Item:
    """Build what :func:`attributes_of` describes; anything else is a `FormatError`, with the place.

    Vertices named 0..N-1 keep their number; others are numbered in their order.  ``spent`` bounds the work.
    """
    if not 1 <= len(nodes) <= LINKS_MAX:
        raise FormatError(f"{len(nodes)} vertices; a mechanism graph has 1 to {LINKS_MAX} links", place)
    number = {name: k for k, name in enumerate(nodes)}
    if set(number) == set(map(str, range(len(nodes)))):
        number = {name: int(name) for name in nodes}
    spent.add(own, place)
    frame = None
    if "frame" in own:
        frame = number.get(own["frame"].strip())
        if frame is None:
            raise FormatError(f"the frame {own['frame'][:24]!r} is not a vertex of the graph", place)
    seen: set[tuple[int, int]] = set()
    joints = []
    for edge in edges:
        spent.add(edge.attributes, edge.place)
        a, b = number[edge.source], number[edge.target]
        if a == b or (min(a, b), max(a, b)) in seen:
            what = "joins a link to itself" if a == b else f"joins links {a} and {b} a second time"
            raise FormatError(f"the edge {what}; a mechanism graph is simple", edge.place)
        seen.add((min(a, b), max(a, b)))
        joints.append((a, b, whole_number(edge.attributes.get("mobility", "1"), "mobility", edge.place)))
    space = whole_number(own.get("space", "3"), "space", place)
    try:
        graph = MechanismGraph(len(nodes), joints, frame=frame, space=space)
    except FormatError as error:
        raise FormatError(str(error), place) from None
    if any("joint" in edge.attributes for edge in edges):
        return _mechanism(graph, edges, own, place)
    return graph


def _mechanism(graph: MechanismGraph, edges: Sequence[Edge], own: Mapping[str, str], place: str) -> Mechanism:
    joints = []
    for edge in edges:
        if "joint" not in edge.attributes:
            raise FormatError("the edge has no attribute 'joint', but others have; give all or none", edge.place)
        joints.append(json_value(edge.attributes["joint"], edge.place))
    data: dict[str, Any] = {"format": FORMAT, "version": VERSION, "graph": graph.to_text(), "joints": joints}
    data |= {name: json_value(own[name], f"{place}, {name}") for name in _WHOLE if name in own}
    try:
        return from_dict(data)
    except FormatError as error:
        raise FormatError(str(error), place) from None


def whole_number(text: str, name: str, place: str) -> int:
    """Read a whole number of at most four digits."""
    match = _NUMBER.fullmatch(text)
    if not match:
        raise FormatError(f"{name} = {text[:24]!r} is not a whole number", place)
    return int(match[1])
