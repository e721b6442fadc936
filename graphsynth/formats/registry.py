"""The formats of graphs and mechanisms, and reading and writing files by suffix or name.

Readers raise nothing but `FormatError`; their time and memory are bounded by the length of the text, and a text longer
than the format's limit is refused before it is read.  Formats of one graph a line are read line by line.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from graphsynth.errors import FormatError, GraphError, SpecError
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

__all__ = ["FORMATS", "Format", "format_of", "read", "read_all", "read_text", "write", "write_text"]

Item = MechanismGraph | Mechanism

#: Longest line of a file of lines; the longest text form is shorter.
LINE_MAX = 1_000_000


@dataclass(frozen=True)
class Format:
    """A format of graphs.

    Parameters
    ----------
    name : str
    suffixes : tuple of str
        File names that mean it.
    about : str
        One line for people.
    many : bool
        Whether one file holds several graphs.
    mechanisms : bool
        Whether it holds dimensioned mechanisms too.
    limit : int
        Longest text that is read, in characters; of one line if ``line``.
    line : bool
        Whether every line is one graph.
    parse, compose : str
        Functions of a module of this package, ``module:function``.
    """

    name: str
    suffixes: tuple[str, ...]
    about: str
    many: bool
    mechanisms: bool
    limit: int
    parse: str
    compose: str
    line: bool = False


FORMATS: dict[str, Format] = {
    entry.name: entry
    for entry in (
        Format(
            "text", (".g6", ".txt"), "graph6 with frame and joint mobilities, one graph a line", True, False, LINE_MAX,
            "plain:parse_text", "plain:compose_text", line=True,
        ),
        Format(
            "graph6", (), "graph6 alone: chains of turning pairs, one a line", True, False, LINE_MAX,
            "plain:parse_graph6", "plain:compose_graph6", line=True,
        ),
        Format(
            "jsonl", (".jsonl", ".ndjson"), "JSON lines, one graph a line", True, False, LINE_MAX,
            "graph_json:parse_line", "graph_json:compose_lines", line=True,
        ),
        Format(
            "json", (".json",), "JSON: a graph, a list of graphs, or a mechanism", True, True, 20_000_000,
            "graph_json:parse", "graph_json:compose",
        ),
        Format(
            "toml", (".toml",), "TOML: a mechanism", False, True, 1_000_000, "plain:parse_toml", "plain:compose_toml",
        ),
        Format("graphml", (".graphml",), "GraphML", True, True, 20_000_000, "graphml:parse", "graphml:compose"),
        Format("dot", (".dot", ".gv"), "DOT of Graphviz", True, True, 4_000_000, "dot:parse", "dot:compose"),
        Format(
            "csv", (".csv",), "table, a row for each graph", True, False, 20_000_000, "tables:parse", "tables:compose",
        ),
        Format(
            "edges", (".edges", ".edgelist"), "edge list", False, False, 4_000_000,
            "edge_list:parse", "edge_list:compose",
        ),
        Format(
            "adjacency", (".adj",), "adjacency matrix", False, False, 4_000_000,
            "matrices:parse_adjacency", "matrices:compose_adjacency",
        ),
        Format(
            "incidence", (".inc",), "incidence matrix", False, False, 4_000_000,
            "matrices:parse_incidence", "matrices:compose_incidence",
        ),
    )
}  # fmt: skip


def format_of(path: str | os.PathLike[str], name: str | None = None) -> Format:
    """Return the format of a given name, or of the suffix of a file.

    Raises
    ------
    SpecError
        For a name or a suffix that no format has.

    Examples
    --------
    >>> format_of("chains.graphml").name, format_of("x.dat", "dot").name
    ('graphml', 'dot')
    """
    if name is not None:
        if name not in FORMATS:
            raise SpecError(f"format {name!r} is unknown; known are {', '.join(FORMATS)}")
        return FORMATS[name]
    suffix = Path(path).suffix.lower()
    for entry in FORMATS.values():
        if suffix in entry.suffixes:
            return entry
    known = ", ".join(suffix for entry in FORMATS.values() for suffix in entry.suffixes)
    raise SpecError(f"{Path(path).name}: the suffix {suffix!r} names no format; use one of {known}, or give format=")


def _function(place: str) -> Callable[..., Any]:
    module, _, name = place.partition(":")
    found: Callable[..., Any] = getattr(import_module(f"graphsynth.formats.{module}"), name)
    return found


def read_text(text: str | bytes, format: str) -> list[Item]:
    r"""Read every graph and mechanism of a text.

    Parameters
    ----------
    text : str or bytes
        Bytes are UTF-8.
    format : str
        A name in :data:`FORMATS`.

    Raises
    ------
    FormatError
        For anything that is not this format, with the place.
    SpecError
        For an unknown format.

    Examples
    --------
    >>> read_text("0 1 1\n1 0 1\n1 1 0", "adjacency")[0].mobility
    0
    """
    entry = format_of("", format)
    if not entry.line and len(text) > entry.limit:
        raise FormatError(f"{len(text)} characters; {entry.name} is read up to {entry.limit}", "length")
    if entry.line:
        lines = text.split("\n") if isinstance(text, str) else text.split(b"\n")
        return list(_lines(lines, entry, ""))
    found: list[Item] = _function(entry.parse)(_decoded(text))
    return found


def _decoded(text: str | bytes) -> str:
    if isinstance(text, str):
        return text.removeprefix("\ufeff")
    try:
        return text.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FormatError(f"not UTF-8 text ({error.reason})", f"byte {error.start}") from None


def _lines(lines: Iterable[str | bytes], entry: Format, name: str) -> Iterator[Item]:
    one = _function(entry.parse)
    for number, line in enumerate(lines, 1):
        place = f"{name} line {number}".lstrip()
        if len(line) > entry.limit:
            raise FormatError(f"more than {entry.limit} characters on one line", place)
        try:
            text = _decoded(line).strip()
        except FormatError as error:
            raise FormatError(str(error), place) from None
        if text:
            yield one(text, place)


def read_all(path: str | os.PathLike[str], format: str | None = None) -> Iterator[Item]:
    """Read every graph and mechanism of a file, in its order; files of lines are read as they are asked for.

    Raises
    ------
    FormatError
        For a file that is not of this format, with its name and the place.
    SpecError
        For an unknown format.
    OSError
        For a file that cannot be opened.
    """
    entry, path = format_of(path, format), Path(path)
    if entry.line:
        return _lines(_file_lines(path, entry.limit), entry, path.name)
    with path.open("rb") as file:
        data = file.read(entry.limit + 1)
    try:
        return iter(read_text(data, entry.name))
    except FormatError as error:
        raise FormatError(str(error), path.name) from None


def _file_lines(path: Path, limit: int) -> Iterator[bytes]:
    with path.open("rb") as file:
        while line := file.readline(limit + 2):
            yield line


def read(path: str | os.PathLike[str], format: str | None = None, *, number: int = 1) -> Item:
    """Read one graph or mechanism of a file.

    Parameters
    ----------
    path : path
    format : str, optional
        A name in :data:`FORMATS`; by the suffix otherwise.
    number : int
        Which one of the file, from 1.

    Raises
    ------
    FormatError
        For a file that is not of this format or holds fewer graphs.
    """
    count = 0
    for count, item in enumerate(read_all(path, format), 1):
        if count == number:
            return item
    raise FormatError(f"graph {number} does not exist, the file has {count}", Path(path).name)


def write_text(items: Item | Iterable[Item], format: str) -> str:
    r"""Write graphs or mechanisms as a text.

    Raises
    ------
    GraphError
        If the format cannot hold them: several graphs, a mechanism, a frame.
    SpecError
        For an unknown format.

    Examples
    --------
    >>> write_text(MechanismGraph(3, [(0, 1), (0, 2), (1, 2)], frame=0), "text")
    'Bw f0\n'
    """
    return "".join(_pieces(items, format_of("", format)))


def _pieces(items: Item | Iterable[Item], entry: Format) -> Iterator[str]:
    given: Iterable[Item] = (items,) if isinstance(items, MechanismGraph | Mechanism) else items
    pieces: Iterator[str] = _function(entry.compose)(_checked(given, entry))
    return pieces


def _checked(items: Iterable[Item], entry: Format) -> Iterator[Item]:
    for count, item in enumerate(items):
        if count and not entry.many:
            raise GraphError(f"{entry.name} holds one graph in a file; write each to its own")
        if isinstance(item, Mechanism) and not entry.mechanisms:
            able = ", ".join(name for name, other in FORMATS.items() if other.mechanisms)
            raise GraphError(f"{entry.name} holds graphs, no dimensions; write mechanism.graph, or use {able}")
        if not isinstance(item, MechanismGraph | Mechanism):
            raise GraphError(f"{type(item).__name__} is neither a MechanismGraph nor a Mechanism")
        yield item


def write(items: Item | Iterable[Item], path: str | os.PathLike[str], format: str | None = None) -> int:
    """Write graphs or mechanisms to a file; return how many.

    The file appears when it is complete: an interruption or a refusal leaves what was there.

    Parameters
    ----------
    items : MechanismGraph, Mechanism, or an iterable of them
        Of an iterable, formats of many graphs keep one at a time (JSON all of them).
    path : path
    format : str, optional
        A name in :data:`FORMATS`; by the suffix otherwise.

    Raises
    ------
    GraphError
        If the format cannot hold them.
    SpecError
        For an unknown format.
    """
    entry, path = format_of(path, format), Path(path)
    count = 0

    def counted() -> Iterator[Item]:
        nonlocal count
        for item in (items,) if isinstance(items, MechanismGraph | Mechanism) else items:
            count += 1
            yield item

    fresh = path.with_name(f".{path.name}.{os.getpid()}.new")
    try:
        with fresh.open("w", encoding="utf-8", newline="") as file:
            for piece in _pieces(counted(), entry):
                file.write(piece)
        fresh.replace(path)
    finally:
        fresh.unlink(missing_ok=True)
    return count
