"""GraphML, read and written.

The reader takes what networkx, yEd, igraph and Gephi write of simple undirected graphs.  A document type declaration is
refused, so there are no entities to expand and nothing outside the file is read; depth is limited.  Graphs come out as
they end, so a long file needs no more memory than its longest graph.

Source: U. Brandes et al., *GraphML Progress Report*, GD 2001, and the GraphML primer.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import chain
from typing import Any
from xml.sax.saxutils import escape, quoteattr

from graphsynth.core.errors import FormatError
from graphsynth.formats.attributes import OF_EDGE, OF_GRAPH, Edge, Item, Spent, attributes_of, item_from
from graphsynth.structure.text import LINKS_MAX

#: Bytes of one graph, of what stands before the first and of what stands between two.
LENGTH_MAX = 3_000_000

_SPACE = "http://graphml.graphdrawing.org/xmlns"
_KEYS = [
    *(("graph", name, kind) for name, kind in (("frame", "int"), ("space", "int"), ("drivers", "string"))),
    *(("graph", name, "string") for name in ("points", "pose")),
    *(("edge", name, kind) for name, kind in (("mobility", "int"), ("kind", "string"), ("joint", "string"))),
]
_DEPTH = 32
_EDGES = LINKS_MAX * (LINKS_MAX - 1) // 2
_KEYS_MAX = 1000


def compose(items: Iterable[Item]) -> Iterator[str]:
    """Write graphs and mechanisms, each as one ``<graph>``."""
    yield f'<?xml version="1.0" encoding="UTF-8"?>\n<graphml xmlns="{_SPACE}">\n'
    for of, name, kind in _KEYS:
        yield f' <key id="{name}" for="{of}" attr.name="{name}" attr.type="{kind}"/>\n'
    for place, item in enumerate(items):
        graph, own, edges = attributes_of(item)
        lines = [f' <graph id="G{place}" edgedefault="undirected">', *(f"  {data}" for data in _data(own))]
        lines += [f'  <node id="{link}"/>' for link in range(graph.links)]
        for joint, attributes in zip(graph.joints, edges):
            lines.append(f'  <edge source="{joint.a}" target="{joint.b}">{"".join(_data(attributes))}</edge>')
        yield "\n".join([*lines, " </graph>\n"])
    yield "</graphml>\n"


def _data(attributes: dict[str, str]) -> list[str]:
    return [f"<data key={quoteattr(name)}>{escape(value)}</data>" for name, value in attributes.items()]


@dataclass
class _Graph:
    """A ``<graph>`` being read."""

    place: str
    nodes: dict[str, None] = field(default_factory=dict)
    edges: list[Edge] = field(default_factory=list)
    own: dict[str, str] = field(default_factory=dict)


class _Reader:
    """What expat calls; keeps the stack of open elements."""

    def __init__(self, parser: Any) -> None:
        self.parser = parser
        self.stack: list[str] = []
        self.keys: dict[str, tuple[str, str]] = {}  # id: (for, name)
        self.defaults: dict[str, dict[str, str]] = {"graph": {}, "edge": {}, "all": {}}
        self.graph: _Graph | None = None
        self.found: list[Item] = []
        self.into: tuple[dict[str, str], str] | None = None  # where the text of the open element goes
        self.attributes: dict[str, str] = {}
        self.key = ""
        self.text: list[str] = []
        self.spent = Spent(LENGTH_MAX)

    @property
    def place(self) -> str:
        return f"line {self.parser.CurrentLineNumber}"

    def start(self, full: str, given: dict[str, str]) -> None:
        name, outer = full.rpartition(" ")[2], self.stack[-1] if self.stack else ""
        self.stack.append(name)
        if len(self.stack) > _DEPTH:
            raise FormatError(f"elements are nested deeper than {_DEPTH}", self.place)
        if len(self.stack) == 1 and name != "graphml":
            raise FormatError(f"<{name[:24]}> is not the root of GraphML; expected <graphml>", self.place)
        if name in _HANDLED:
            getattr(self, f"start_{name}")(given, outer)

    def start_key(self, given: dict[str, str], outer: str) -> None:
        name = self._needed(given, "id", "key")
        if len(self.keys) >= _KEYS_MAX:
            raise FormatError(f"more than {_KEYS_MAX} keys; remove those that no mechanism graph needs", self.place)
        self.keys[name] = given.get("for", "all"), given.get("attr.name", name)
        self.key = name

    def start_default(self, given: dict[str, str], outer: str) -> None:
        if outer == "key":
            of, name = self.keys[self.key]
            known = OF_GRAPH if of == "graph" else OF_EDGE if of == "edge" else OF_GRAPH | OF_EDGE
            if of in self.defaults and name in known:
                self.into, self.text = (self.defaults[of], name), []

    def start_graph(self, given: dict[str, str], outer: str) -> None:
        if self.graph is not None or outer != "graphml":
            raise FormatError("a graph within a graph is not read", self.place)
        if given.get("edgedefault", "undirected") != "undirected":
            raise FormatError("the graph is directed; a mechanism graph is undirected", self.place)
        self.graph = _Graph(self.place, own={**self.defaults["all"], **self.defaults["graph"]})

    def start_node(self, given: dict[str, str], outer: str) -> None:
        graph, name = self._open("node"), self._needed(given, "id", "node")
        if name in graph.nodes:
            raise FormatError(f"the vertex {name[:24]!r} is there twice", self.place)
        if len(graph.nodes) >= LINKS_MAX:
            raise FormatError(f"more than {LINKS_MAX} vertices; a mechanism graph has at most so many", self.place)
        graph.nodes[name] = None

    def start_edge(self, given: dict[str, str], outer: str) -> None:
        graph = self._open("edge")
        if given.get("directed", "false") != "false":
            raise FormatError("the edge is directed; a mechanism graph is undirected", self.place)
        if len(graph.edges) >= _EDGES:
            raise FormatError(f"more than {_EDGES} edges; no simple graph of {LINKS_MAX} links has so many", self.place)
        ends = [self._needed(given, name, "edge").strip() for name in ("source", "target")]
        self.attributes = {**self.defaults["all"], **self.defaults["edge"]}
        graph.edges.append(Edge(ends[0], ends[1], self.attributes, self.place))

    def start_hyperedge(self, given: dict[str, str], outer: str) -> None:
        raise FormatError("a hyperedge is not a joint of two links", self.place)

    def start_data(self, given: dict[str, str], outer: str) -> None:
        key = self._needed(given, "key", "data")
        name = self.keys.get(key, ("all", key))[1]
        if outer == "graph" and name in OF_GRAPH:
            self.into, self.text = (self._open("data").own, name), []
        elif outer == "edge" and name in OF_EDGE:
            self.into, self.text = (self.attributes, name), []

    def end(self, full: str) -> None:
        name = self.stack.pop()
        if name in ("data", "default") and self.into is not None:
            table, key = self.into
            table[key] = "".join(self.text)
            self.into = None
        elif name == "graph" and self.graph is not None and len(self.stack) == 1:
            graph, self.graph = self.graph, None
            for edge in graph.edges:
                for end in (edge.source, edge.target):
                    if end not in graph.nodes:
                        raise FormatError(f"the edge ends at {end[:24]!r}, which is not a vertex", edge.place)
            self.found.append(item_from(list(graph.nodes), graph.edges, graph.own, graph.place, self.spent))

    def characters(self, text: str) -> None:
        if self.into is not None:
            self.text.append(text)

    def _open(self, name: str) -> _Graph:
        if self.graph is None:
            raise FormatError(f"<{name}> stands outside a graph", self.place)
        return self.graph

    def _needed(self, given: dict[str, str], name: str, element: str) -> str:
        if name not in given:
            raise FormatError(f"<{element}> needs the attribute {name!r}", self.place)
        return given[name]

    def doctype(self, *_: object) -> None:
        raise FormatError("a document type declaration is not read; remove it", self.place)


_SMALLER = "the largest graph of 255 links needs half of it"
_HANDLED = {"key", "default", "graph", "node", "edge", "hyperedge", "data"}


def parse(blocks: Iterable[bytes]) -> Iterator[Item]:
    """Read every graph of the blocks of a GraphML document; anything else is a `FormatError`, with the line."""
    from xml.parsers import expat

    parser = expat.ParserCreate("UTF-8", namespace_separator=" ")
    parser.buffer_text = True
    reader = _Reader(parser)
    parser.StartElementHandler = reader.start
    parser.EndElementHandler = reader.end
    parser.CharacterDataHandler = reader.characters
    parser.StartDoctypeDeclHandler = reader.doctype
    count = since = 0
    try:
        for block in chain(blocks, [b""]):
            if since > LENGTH_MAX:
                raise FormatError(f"a graph of more than {LENGTH_MAX} bytes; {_SMALLER}", reader.place)
            parser.Parse(block, not block)
            since += len(block)
            reader.spent.most += len(block)
            if reader.found:
                count, since = count + len(reader.found), 0
                yield from reader.found
                reader.found = []
    except expat.ExpatError as error:
        what = expat.errors.messages.get(error.code, "not well-formed")
        raise FormatError(f"not XML ({what})", f"line {error.lineno}, column {error.offset + 1}") from None
    if not count:
        raise FormatError("the file holds no <graph>", "end")
