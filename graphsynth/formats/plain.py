"""One graph a line or a row: text form, graph6, CSV with a head; and mechanisms as TOML."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Iterator

from graphsynth.core.errors import FormatError, GraphError
from graphsynth.mechanism.files import TOML_MAX
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
        if len(text) > TOML_MAX:
            raise GraphError(f"the mechanism has {len(text)} characters in TOML, at most {TOML_MAX} are read; use json")
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
