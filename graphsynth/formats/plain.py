"""One graph a line or a row: text form, graph6, JSON lines, CSV with a head; JSON documents, mechanisms as TOML."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from graphsynth.core.errors import FormatError, GraphError
from graphsynth.core.textfiles import json_value
from graphsynth.mechanism import files
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.canonical import decode_key
from graphsynth.structure.graph import MechanismGraph


def parse_text(line: str, place: str) -> MechanismGraph:
    """Read a line: a canonical key, or the text form."""
    return placed(graph_of_key if line.startswith("1") else graph_of_text, line, place)


def placed(read: Callable[[str], MechanismGraph], text: str, place: str) -> MechanismGraph:
    """Read a text; an error says where the text stands."""
    try:
        return read(text)
    except FormatError as error:
        raise FormatError(str(error), place) from None


def graph_of_text(text: str) -> MechanismGraph:
    """Read the text form; graph6 alone takes a shorter way."""
    return MechanismGraph.from_text(text) if " " in text else MechanismGraph.from_graph6(text)


def graph_of_key(key: str) -> MechanismGraph:
    """Read a key as the graph it describes; that it is the canonical one is not checked, which may take long."""
    links, joints, frame, space = decode_key(key)
    return MechanismGraph(links, joints, frame=frame, space=space)


def compose_text(graphs: Iterable[MechanismGraph]) -> Iterator[str]:
    """Write the text form of every graph."""
    return (graph.to_text() + "\n" for graph in graphs)


def parse_graph6(line: str, place: str) -> MechanismGraph:
    """Read a line of graph6."""
    return placed(MechanismGraph.from_graph6, line, place)


def compose_graph6(graphs: Iterable[MechanismGraph]) -> Iterator[str]:
    """Write graph6; a frame or a joint of higher mobility is refused."""
    return (graph.graph6() + "\n" for graph in graphs)


def parse_toml(text: str) -> list[Mechanism]:
    """Read a mechanism."""
    return [Mechanism.from_toml(text)]


def compose_toml(items: Iterable[MechanismGraph | Mechanism]) -> Iterator[str]:
    """Write a mechanism."""
    for item in items:
        if not isinstance(item, Mechanism):
            raise GraphError("TOML holds dimensioned mechanisms; write a graph as json, graphml or text")
        text = item.to_toml()
        if len(text) > files.TOML_MAX:
            most = f"{len(text)} characters in TOML, at most {files.TOML_MAX} are read"
            raise GraphError(f"the mechanism has {most}; use json")
        yield text


#: Characters of a row, which may hold line ends.
ROW_MAX = 1_000_000

#: Columns that are written; ``text`` (or ``key`` or ``graph6``) is the one that is read.
COLUMNS = ("text", "links", "joints", "frame", "space", "mobility", "loops", "assortment")
_READ = ("text", "key", "graph6")
_FIELD_MAX = 131_072  # of the csv module


def compose_csv(graphs: Iterable[MechanismGraph]) -> Iterator[str]:
    """Write a head and a row for each graph (RFC 4180, lines end with one line feed)."""
    yield ",".join(COLUMNS) + "\n"
    for graph in graphs:
        text = graph.to_text()
        if len(text) >= _FIELD_MAX:
            raise GraphError(f"the text form has {len(text)} characters, a CSV field at most {_FIELD_MAX}; use graphml")
        counts = " ".join(f"n{a}={count}" for a, count in graph.assortment.items())
        frame = "" if graph.frame is None else graph.frame
        line = io.StringIO()
        row = (text, graph.links, len(graph.joints), frame, graph.space, graph.mobility, graph.loops, counts)
        csv.writer(line, lineterminator="\n").writerow(row)
        yield line.getvalue()


def parse_csv(lines: Iterable[str]) -> Iterator[MechanismGraph]:
    """Read the column ``text`` (or ``key``, or ``graph6``) of every row; the other columns are not looked at."""
    source = _Rows(lines)
    reader = csv.reader(source, strict=True)
    column, name = -1, ""
    try:
        for row in reader:
            source.since, place = 0, f"line {reader.line_num}"
            if column < 0:
                name = next((known for known in _READ if known in row), "")
                if not name:
                    raise FormatError(f"the head has none of the columns {', '.join(_READ)}", place)
                column = row.index(name)
            elif row:
                if len(row) <= column:
                    raise FormatError(f"the row has no column {name!r}", place)
                yield placed(graph_of_key if name == "key" else graph_of_text, row[column], place)
    except csv.Error as error:
        raise FormatError(f"not CSV ({error})", f"line {reader.line_num}") from None
    if column < 0:
        raise FormatError("the text is empty; the first row names the columns", "line 1")


class _Rows:
    """Lines, while no row of them gets too long."""

    def __init__(self, lines: Iterable[str]) -> None:
        self.lines, self.since, self.number = iter(lines), 0, 0

    def __iter__(self) -> _Rows:
        return self

    def __next__(self) -> str:
        line = next(self.lines)
        self.since, self.number = self.since + len(line), self.number + 1
        if self.since > ROW_MAX:
            raise FormatError(f"more than {ROW_MAX} characters in one row", f"line {self.number}")
        return line


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


def parse_json(text: str) -> Iterator[MechanismGraph | Mechanism]:
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


def parse_jsonl(line: str, place: str) -> MechanismGraph:
    """Read one JSON line."""
    return graph_of(json_value(line, place), place)


def compose_json(items: Iterable[MechanismGraph | Mechanism]) -> Iterator[str]:
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


def compose_jsonl(graphs: Iterable[MechanismGraph]) -> Iterator[str]:
    """Write a record of every graph on a line of its own; with its key where that is quickly found."""
    for graph in graphs:
        head = {"key": graph.key} if graph.links <= KEYED_MAX else {}
        yield json.dumps({**head, **record_of(graph)}) + "\n"
