"""Tables of graphs as CSV: a row for each graph, its text form and what follows from it."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator

from graphsynth.errors import FormatError, GraphError
from graphsynth.formats.plain import graph_of_key
from graphsynth.structure.graph import MechanismGraph

__all__ = ["COLUMNS", "compose", "parse"]

#: Columns that are written; ``text`` (or ``key`` or ``graph6``) is the one that is read.
COLUMNS = ("text", "links", "joints", "frame", "space", "mobility", "loops", "assortment")
_READ = ("text", "key", "graph6")
_FIELD_MAX = 131_072  # of the csv module


def compose(graphs: Iterable[MechanismGraph]) -> Iterator[str]:
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


def parse(text: str) -> list[MechanismGraph]:
    """Read the column ``text`` (or ``key``, or ``graph6``) of every row; the other columns are not looked at.

    Raises
    ------
    FormatError
        For anything else, with the line.
    """
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    found: list[MechanismGraph] = []
    column, name = -1, ""
    try:
        for row in reader:
            place = f"line {reader.line_num}"
            if column < 0:
                name = next((known for known in _READ if known in row), "")
                if not name:
                    raise FormatError(f"the head has none of the columns {', '.join(_READ)}", place)
                column = row.index(name)
            elif row:
                if len(row) <= column:
                    raise FormatError(f"the row has no column {name!r}", place)
                found.append(_graph(row[column], name, place))
    except csv.Error as error:
        raise FormatError(f"not CSV ({error})", f"line {reader.line_num}") from None
    if column < 0:
        raise FormatError("the text is empty; the first row names the columns", "line 1")
    return found


def _graph(text: str, name: str, place: str) -> MechanismGraph:
    try:
        return graph_of_key(text) if name == "key" else MechanismGraph.from_text(text)
    except FormatError as error:
        raise FormatError(str(error), place) from None
