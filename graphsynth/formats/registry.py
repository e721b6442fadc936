"""The formats of graphs and mechanisms, and reading and writing files by suffix or name.

Readers raise nothing but `FormatError`.  Their time and memory are bounded: a text that is read at once has a longest
length and a largest number of graphs and joints; a file of lines, rows or GraphML is read as it is asked for, and each
of its graphs has a longest length.  What is longer is refused before it is read.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from itertools import count
from pathlib import Path
from typing import Any

from graphsynth.core.errors import FormatError, GraphError, SpecError
from graphsynth.core.wholefiles import replacing
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

Item = MechanismGraph | Mechanism

#: Longest line of a file of lines; the longest text form is shorter.
LINE_MAX = 1_000_000
#: Longest text of several graphs that is read at once.
TEXT_MAX = 3_000_000
#: Most graphs in a text that is read at once.
GRAPHS_MAX = 20_000
JOINTS_MAX = 120_000  #: Most joints of all graphs in a text that is read at once.
_BLOCK = 1 << 16
_MESSAGE = 360


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
    place : str
        Module of this package that reads and writes it, by functions ``parse`` and ``compose``; ``module:end`` by
        ``parse_end`` and ``compose_end``.
    many : bool
        Whether one file holds several graphs.
    mechanisms : bool
        Whether it holds dimensioned mechanisms too.
    limit : int
        Longest text that is read at once, in bytes.
    feed : {"whole", "lines", "rows", "blocks"}
        How it is read: at once, or as it is asked for.
    piece : int
        Longest text of one graph, in bytes, if it is read as it is asked for.
    """

    name: str
    suffixes: tuple[str, ...]
    about: str
    place: str
    many: bool = False
    mechanisms: bool = False
    limit: int = TEXT_MAX
    feed: str = "whole"
    piece: int = LINE_MAX

    def function(self, verb: str) -> Callable[..., Any]:
        """Return the function that does "parse" or "compose"."""
        module, _, end = self.place.partition(":")
        name = f"{verb}_{end}" if end else verb
        found: Callable[..., Any] = getattr(import_module(f"graphsynth.formats.{module}"), name)
        return found

    @property
    def line(self) -> bool:
        """Whether every line is one graph."""
        return self.feed == "lines"

    @property
    def bounds(self) -> str:
        """What is read at most, for people."""
        if self.feed == "whole":
            return _size(self.limit)
        return f"{_size(self.piece)} a {'line' if self.line else 'row' if self.feed == 'rows' else 'graph'}"


def _size(count: int) -> str:
    return f"{count / 1e6:g} MB" if count >= 1_000_000 else f"{count // 1000} kB"


_MATRIX = 4_000_000
_LISTED: tuple[tuple[str, str, str, str, dict[str, Any]], ...] = (
    ("text", ".g6 .txt", "graph6 with frame and joint mobilities, one graph a line", "plain:text", {"feed": "lines"}),
    ("graph6", "", "graph6 alone: chains of revolute joints, one a line", "plain:graph6", {"feed": "lines"}),
    ("jsonl", ".jsonl .ndjson", "JSON lines, one graph a line", "plain:jsonl", {"feed": "lines"}),
    ("json", ".json", "JSON: a graph, a list of graphs, or a mechanism", "plain:json", {"mechanisms": True}),
    ("toml", ".toml", "TOML: a mechanism", "plain:toml", {"many": False, "mechanisms": True, "limit": 400_000}),
    ("graphml", ".graphml", "GraphML", "graphml", {"mechanisms": True, "feed": "blocks", "piece": 3_000_000}),
    ("dot", ".dot .gv", "DOT of Graphviz", "dot", {"mechanisms": True, "limit": 2_000_000}),
    ("csv", ".csv", "table, a row for each graph", "plain:csv", {"feed": "rows"}),
    ("edges", ".edges .edgelist", "edge list", "matrices:edges", {"many": False, "limit": _MATRIX}),
    ("adjacency", ".adj", "adjacency matrix", "matrices:adjacency", {"many": False, "limit": _MATRIX}),
    ("incidence", ".inc", "incidence matrix", "matrices:incidence", {"many": False, "limit": _MATRIX}),
)
FORMATS: dict[str, Format] = {  #: All formats by their names.
    name: Format(name, tuple(suffixes.split()), about, place, **{"many": True, **options})
    for name, suffixes, about, place, options in _LISTED
}


def format_of(path: str | os.PathLike[str], name: str | None = None) -> Format:
    """Return the format of a given name, or of the suffix of a file.

    Parameters
    ----------
    path : path
        The suffix counts; the file need not exist.
    name : str, optional
        A name in :data:`FORMATS`, which overrides the suffix.

    Returns
    -------
    Format

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
        if not isinstance(name, str) or name not in FORMATS:
            raise SpecError(f"format {name!r} is unknown; known are {', '.join(FORMATS)}")
        return FORMATS[name]
    suffix = Path(path).suffix.lower()
    for entry in FORMATS.values():
        if suffix in entry.suffixes:
            return entry
    known = ", ".join(suffix for entry in FORMATS.values() for suffix in entry.suffixes)
    raise SpecError(f"{Path(path).name}: the suffix {suffix!r} names no format; use one of {known}, or give format=")


def read_text(text: str | bytes, format: str) -> list[Item]:
    r"""Read every graph and mechanism of a text.

    Parameters
    ----------
    text : str or bytes
        Bytes are UTF-8.
    format : str
        A name in :data:`FORMATS`.

    Returns
    -------
    list of MechanismGraph and Mechanism

    Raises
    ------
    FormatError
        For anything that is not this format, with the place; for a text longer than ``FORMATS[format].limit``, more
        than :data:`GRAPHS_MAX` graphs or :data:`JOINTS_MAX` joints in all.
    SpecError
        For an unknown format.

    Examples
    --------
    >>> read_text("0 1 1\n1 0 1\n1 1 0", "adjacency")[0].mobility
    0
    """
    entry = format_of("", format)
    if not isinstance(text, str | bytes):
        raise SpecError(f"text is {type(text).__name__}; give str or bytes")
    found: list[Item] = []
    joints = 0
    with _sentences(""):
        _check_length(len(text), entry)
        try:
            data = text.encode() if isinstance(text, str) else text
        except UnicodeEncodeError as error:
            raise FormatError("half of a character that takes two", f"character {error.start}") from None
        for item in _fed(io.BytesIO(data), entry):
            found.append(item)
            joints += len(item.joints) if isinstance(item, Mechanism) else len(item.packed) // 3
            if len(found) > GRAPHS_MAX or joints > JOINTS_MAX:
                most = f"{GRAPHS_MAX} graphs, or {JOINTS_MAX} joints in all,"
                raise FormatError(f"more than {most} at once; split the text, or use a file of text or jsonl", "length")
    return found


def _check_length(length: int, entry: Format) -> None:
    if length > entry.limit:
        remedy = "split it, or write it in text or jsonl" if entry.many else "write it in json or graphml"
        if entry.feed != "whole":
            remedy = "split it, or put it into a file, which is read graph by graph"
        raise FormatError(f"more than {entry.limit} bytes of {entry.name} at once; {remedy}", "length")


@contextmanager
def _sentences(name: str) -> Iterator[None]:
    """Keep messages short, with the name of the file in front."""
    try:
        yield
    except FormatError as error:
        said = str(error)
        if name or len(said) > _MESSAGE:
            short = said if len(said) <= _MESSAGE else f"{said[: _MESSAGE - 64]} ... {said[-56:]}"
            raise FormatError(short, name or error.place) from None
        raise


def _fed(file: io.BufferedIOBase, entry: Format) -> Iterator[Item]:
    """Read the items of an open file as its format wants it."""
    parse = entry.function("parse")
    if entry.feed == "lines":
        return (parse(text, place) for line, place in _lines(file, entry) if (text := line.strip()))
    if entry.feed == "rows":
        return iter(parse(line for line, _ in _lines(file, entry)))
    if entry.feed == "blocks":
        return iter(parse(iter(lambda: file.read(_BLOCK), b"")))
    data = file.read(entry.limit + 1)
    _check_length(len(data), entry)
    try:
        return iter(parse(data.decode("utf-8-sig")))
    except UnicodeDecodeError as error:
        raise FormatError(f"not UTF-8 text ({error.reason})", f"byte {error.start}") from None


def _lines(file: io.BufferedIOBase, entry: Format) -> Iterator[tuple[str, str]]:
    """Yield every line and its place."""
    for number in count(1):
        line, place = file.readline(entry.piece + 2), f"line {number}"
        if not line:
            return
        if len(line) > entry.piece:
            raise FormatError(f"more than {entry.piece} bytes {'on one line' if entry.line else 'in one row'}", place)
        try:
            text = line.decode("utf-8-sig" if entry.line or number == 1 else "utf-8")
        except UnicodeDecodeError:
            raise FormatError("not UTF-8 text", place) from None
        yield text, place


def read_stream(file: io.BufferedIOBase, format: str, name: str = "") -> Iterator[Item]:
    """Read every graph and mechanism of an open binary file, in order, as they are asked for.

    Lines, rows and GraphML take the memory of one graph, whatever the length of the file.

    Parameters
    ----------
    file : binary file
        For example ``sys.stdin.buffer``; UTF-8.
    format : str
        A name in :data:`FORMATS`.
    name : str
        What messages call it.

    Returns
    -------
    iterator of MechanismGraph and Mechanism

    Raises
    ------
    FormatError, SpecError
        For a file that is not of this format, with its name and the place; for an unknown format.

    Examples
    --------
    >>> import io
    >>> [graph.links for graph in read_stream(io.BytesIO(b"Bw Cl".replace(b" ", bytes([10]))), "text")]
    [3, 4]
    """
    entry = format_of("", format)

    def items() -> Iterator[Item]:
        with _sentences(name):
            yield from _fed(file, entry)

    return items()


def read_all(path: str | os.PathLike[str], format: str | None = None) -> Iterator[Item]:
    """Read every graph and mechanism of a file, in its order, as they are asked for.

    Lines, rows and GraphML take the memory of one graph.

    Parameters
    ----------
    path : path
    format : str, optional
        A name in :data:`FORMATS`; by the suffix otherwise.

    Returns
    -------
    iterator of MechanismGraph and Mechanism

    Raises
    ------
    FormatError, SpecError
        As for :func:`read_stream`.
    OSError
        For a file that cannot be opened, when the first item is asked for.
    """
    entry, path = format_of(path, format), Path(path)

    def items() -> Iterator[Item]:
        with path.open("rb") as file:
            yield from read_stream(file, entry.name, path.name)

    return items()


def read(path: str | os.PathLike[str], format: str | None = None, *, number: int = 1) -> Item:
    """Read one graph or mechanism of a file.

    Parameters
    ----------
    path : path
    format : str, optional
        A name in :data:`FORMATS`; by the suffix otherwise.
    number : int
        Which one of the file, from 1.

    Returns
    -------
    MechanismGraph or Mechanism

    Raises
    ------
    FormatError
        For a file that is not of this format or holds fewer graphs.
    """
    found = 0
    for found, item in enumerate(read_all(path, format), 1):
        if found == number:
            return item
    raise FormatError(f"graph {number} does not exist, the file has {found}", Path(path).name)


def write_text(items: Item | Iterable[Item], format: str) -> str:
    r"""Write graphs or mechanisms as a text.

    Parameters
    ----------
    items : MechanismGraph, Mechanism, or an iterable of them
    format : str
        A name in :data:`FORMATS`.

    Returns
    -------
    str

    Raises
    ------
    GraphError, SpecError
        If the format cannot hold them: several graphs, a mechanism, a frame; for an unknown format.

    Examples
    --------
    >>> write_text(MechanismGraph(3, [(0, 1), (0, 2), (1, 2)], frame=0), "text")
    'Bw f0\n'
    """
    return "".join(_pieces(items, format_of("", format)))


def _pieces(items: Item | Iterable[Item], entry: Format) -> Iterator[str]:
    def checked() -> Iterator[Item]:
        for number, item in enumerate((items,) if isinstance(items, MechanismGraph | Mechanism) else items):
            if number and not entry.many:
                raise GraphError(f"{entry.name} holds one graph in a file; write each to its own")
            if isinstance(item, Mechanism) and not entry.mechanisms:
                able = ", ".join(name for name, other in FORMATS.items() if other.mechanisms)
                raise GraphError(f"{entry.name} holds graphs, no dimensions; write mechanism.graph, or use {able}")
            if not isinstance(item, MechanismGraph | Mechanism):
                raise GraphError(f"{type(item).__name__} is neither a MechanismGraph nor a Mechanism")
            yield item

    pieces: Iterator[str] = entry.function("compose")(checked())
    return pieces


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

    Returns
    -------
    int
        Number of graphs and mechanisms written.

    Raises
    ------
    GraphError, SpecError
        As for :func:`write_text`.
    """
    entry, path = format_of(path, format), Path(path)
    count = 0

    def counted() -> Iterator[Item]:
        nonlocal count
        for item in (items,) if isinstance(items, MechanismGraph | Mechanism) else items:
            count += 1
            yield item

    try:
        with replacing(path) as fresh, fresh.open("w", encoding="utf-8", newline="") as file:
            for piece in _pieces(counted(), entry):
                file.write(piece)
    except UnicodeEncodeError as error:
        raise GraphError(f"a name holds half of a character that takes two ({error.object[error.start]!r})") from None
    return count
