"""Graphs as JSON documents and JSON lines."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from typing import Any

from graphsynth.core.errors import FormatError, GraphError
from graphsynth.core.textfiles import json_value
from graphsynth.mechanism import files
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

FORMAT = "graphsynth graph"
VERSION = 1
#: Links up to which a canonical labelling takes no time worth speaking of, whatever the graph.
KEYED_MAX = 24
_KNOWN = ("format", "version", "key", "links", "space", "frame", "joints", "levels")


def record_of(graph: MechanismGraph) -> dict[str, Any]:
    """Return plain numbers and lists that describe a graph; ``frame`` is None for a chain."""
    joints = [list(joint) for joint in graph.joints]
    return {"links": graph.links, "space": graph.space, "frame": graph.frame, "joints": joints}


def graph_of(record: Any, place: str = "record") -> MechanismGraph:
    """Build a graph from a record; keys besides links, joints, frame and space must be known ones."""
    if not isinstance(record, dict):
        raise FormatError(f"the record of a graph is an object, not {_name(record)}", place)
    for name in record:
        if name not in _KNOWN:
            raise FormatError(f"unknown key {name[:24]!r}; known are {', '.join(_KNOWN)}", place)
    for name in ("links", "joints"):
        if name not in record:
            raise FormatError(f"the JSON record of a graph needs the key {name!r}", place)
    if not isinstance(record["joints"], list):
        raise FormatError(f"'joints' must be a list, not {_name(record['joints'])}", place)
    for k, joint in enumerate(record["joints"], 1):
        if not isinstance(joint, list) or any(type(part) is not int for part in joint):
            raise FormatError("a joint is [a, b] or [a, b, mobility] in whole numbers", f"{place}, joint {k}")
    head = [record["links"], record.get("space", 3), record.get("frame")]
    if any(type(part) is not int for part in head[:2]) or not (head[2] is None or type(head[2]) is int):
        raise FormatError("links, space and frame must be whole numbers", place)
    try:
        return MechanismGraph(head[0], record["joints"], frame=head[2], space=head[1])
    except FormatError as error:
        raise FormatError(str(error), place) from None


def _name(value: Any) -> str:
    return {dict: "an object", list: "a list", str: "a text", type(None): "null"}.get(type(value), "a number")


def parse(text: str) -> Iterator[MechanismGraph | Mechanism]:
    """Read one JSON document: a graph, a mechanism, or a list of records of graphs."""
    data = json_value(text)
    if isinstance(data, list):
        return (graph_of(record, f"record {k}") for k, record in enumerate(data, 1))
    if isinstance(data, dict):
        if data.get("format") == files.FORMAT:
            return iter([files.from_dict(data)])
        if data.get("format", FORMAT) != FORMAT or data.get("version", VERSION) != VERSION:
            found = f"{str(data.get('format'))[:40]!r}, version {str(data.get('version'))[:12]}"
            raise FormatError(f"found {found}; this program reads {FORMAT!r}, version {VERSION}", "format")
    return iter([graph_of(data)])


def parse_lines(line: str, place: str) -> MechanismGraph:
    """Read one JSON line."""
    return graph_of(json_value(line, place), place)


def compose(items: Iterable[MechanismGraph | Mechanism]) -> Iterator[str]:
    """Write one graph or mechanism as a document, or several graphs as a list."""
    found = list(items)
    if len(found) == 1:
        item = found[0]
        if isinstance(item, Mechanism):
            yield files.to_json(item)
        else:
            yield json.dumps({"format": FORMAT, "version": VERSION, **record_of(item)}) + "\n"
        return
    graphs = [item for item in found if isinstance(item, MechanismGraph)]
    if len(graphs) < len(found):
        raise GraphError("one JSON document holds one mechanism; write each to its own file")
    yield "[" + ",\n ".join(json.dumps(record_of(graph)) for graph in graphs) + "]\n"


def compose_lines(graphs: Iterable[MechanismGraph]) -> Iterator[str]:
    """Write a record of every graph on a line of its own; with its key where that is quickly found."""
    for graph in graphs:
        head = {"key": graph.key} if graph.links <= KEYED_MAX else {}
        yield json.dumps({**head, **record_of(graph)}) + "\n"
