"""DOT, the language of Graphviz, read and written.

Read are undirected graphs: vertices, edges and chains of edges, attributes, defaults of edges, all comments and
quotations.  Subgraphs, ports, directed graphs and HTML texts are refused.

Source: the DOT language reference of Graphviz.
"""

from __future__ import annotations

import re
from bisect import bisect
from collections.abc import Iterable, Iterator
from itertools import pairwise

from graphsynth.core.errors import FormatError, GraphError
from graphsynth.formats.attributes import OF_EDGE, OF_GRAPH, Edge, Item, Spent, attributes_of, item_from
from graphsynth.structure.text import LINKS_MAX

_TOKEN = re.compile(
    # blanks and comments one by one: early releases of Python 3.11 get a possessive group of all of them wrong
    r"(?P<blank>\s++|//[^\n]*+|\#[^\n]*+|/\*.*?\*/)"
    r'|(?P<quoted>"[^"\\]*+(?:\\.[^"\\]*+)*+")'
    r"|(?P<name>-?(?:\.[0-9]++|[0-9]++(?:\.[0-9]*+)?))"
    r"|(?P<word>[A-Za-z_\x80-\U0010ffff][A-Za-z_0-9\x80-\U0010ffff]*+)"
    r"|(?P<mark>--|->|[][{}=;,:<+])"
    r"|(?P<bad>.)",
    re.DOTALL,
)
#: Characters of a text.
LENGTH_MAX = 2_000_000
#: Words and marks of a text; the complete graph on 255 links has 300 000.
TOKENS_MAX = 320_000
_EDGES = LINKS_MAX * (LINKS_MAX - 1) // 2
_KEYWORDS = {"graph", "digraph", "node", "edge", "subgraph", "strict"}


def compose(items: Iterable[Item]) -> Iterator[str]:
    """Write graphs and mechanisms; the frame is a double circle, a joint of higher mobility a dashed line."""
    for place, item in enumerate(items):
        graph, own, edges = attributes_of(item)
        lines = [f"graph G{place} {{", "  node [shape=circle];"]
        lines += [f"  {name}={_value(value)};" for name, value in own.items()]
        for link in range(graph.links):
            lines.append(f"  {link} [shape=doublecircle];" if link == graph.frame else f"  {link};")
        for joint, attributes in zip(graph.joints, edges):
            given = [f"{name}={_value(value)}" for name, value in attributes.items()]
            given += ["style=dashed"] if joint.mobility > 1 else []
            lines.append(f"  {joint.a} -- {joint.b} [{', '.join(given)}];")
        found = "\n".join([*lines, "}\n"])
        tokens = 20 + 4 * len(own) + 6 * graph.links + sum(5 + 4 * len(part) for part in edges)
        if len(found) > LENGTH_MAX or tokens > TOKENS_MAX:
            raise GraphError(f"{graph} with {len(graph.joints)} joints is longer in DOT than is read; use json")
        yield found


def _value(text: str) -> str:
    if text.isdigit() and text.isascii():
        return text
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


#: Text, place, and the mark or keyword that it is; a name, a number and a quotation are none.
_Token = tuple[str, int, str]


def _tokens(text: str) -> list[_Token]:
    found: list[_Token] = []
    for match in _TOKEN.finditer(text):
        kind, end = match.lastgroup, match.end() - 1
        if kind is None or kind == "blank":
            continue
        piece = match[kind]
        if kind == "bad":
            raise FormatError(f"{piece!r} begins nothing of the DOT language", _line(text, end))
        low = piece.lower()
        mark = low if kind == "mark" or (kind == "word" and low in _KEYWORDS) else ""
        if kind == "quoted":  # \" and \\ are the characters, a line end after a backslash is nothing
            piece = re.sub(r'\\(["\\\n])', lambda escaped: escaped[1].strip("\n"), piece[1:-1])
        found.append((piece, end, mark))
        if len(found) > TOKENS_MAX:
            raise FormatError(f"more than {TOKENS_MAX} words and marks; use json for so much", _line(text, end))
    return found


def _line(text: str, at: int) -> str:
    return f"line {text.count(chr(10), 0, at) + 1}"


class _Reader:
    """Reads statement by statement; never recurses."""

    def __init__(self, text: str) -> None:
        self.tokens, self.at = _tokens(text), 0
        self.breaks = [match.start() for match in re.finditer("\n", text)]
        self.nodes: dict[str, None] = {}
        self.edges: list[Edge] = []
        self.own: dict[str, str] = {}
        self.defaults: dict[str, str] = {}
        self.spent = Spent(LENGTH_MAX)

    @property
    def place(self) -> str:
        ended = self.at >= len(self.tokens)
        return f"line {1 + (len(self.breaks) if ended else bisect(self.breaks, self.tokens[self.at][1]))}"

    def look(self) -> str:
        """Return the next mark or keyword; a name reads as the empty text."""
        if self.at >= len(self.tokens):
            raise FormatError("the text ends within a graph", self.place)
        return self.tokens[self.at][2]

    def take(self, mark: str) -> bool:
        if self.look() == mark:
            self.at += 1
            return True
        return False

    def name(self, what: str) -> str:
        if self.look():
            raise FormatError(f"expected {what}, found {self.tokens[self.at][0][:24]!r}", self.place)
        parts = [self.tokens[self.at][0]]
        self.at += 1
        while self.at + 1 < len(self.tokens) and self.look() == "+":  # "a" + "b"
            self.at += 1
            parts.append(self.tokens[self.at][0])
            self.at += 1
        return "".join(parts)

    def graph(self) -> Item:
        self.take("strict")
        if self.look() == "digraph":
            raise FormatError("the graph is directed; a mechanism graph is undirected", self.place)
        if not self.take("graph"):
            raise FormatError("expected 'graph'", self.place)
        first = self.place
        if self.look() != "{":
            self.name("the name of the graph")
        if not self.take("{"):
            raise FormatError("expected '{'", self.place)
        self.nodes, self.edges, self.own, self.defaults = {}, [], {}, {}
        while not self.take("}"):
            self.statement()
        return item_from(list(self.nodes), self.edges, self.own, first, self.spent)

    def statement(self) -> None:
        if self.take(";"):
            return
        kind = self.look()
        if kind in ("graph", "edge", "node"):
            self.at += 1
            table = {"graph": self.own, "edge": self.defaults, "node": {}}[kind]
            table |= self.attributes(OF_GRAPH if kind == "graph" else OF_EDGE)
            return
        if kind in ("subgraph", "{"):
            raise FormatError("a subgraph is not read; write its edges into the graph", self.place)
        first = self.name("a vertex")
        if self.take("="):
            value = self.name("a value")
            if first in OF_GRAPH:
                self.own[first] = value
            return
        ends, place = [first], self.place
        while self.take("--"):
            if self.look() in ("subgraph", "{"):
                raise FormatError("a subgraph is not read; write its edges into the graph", self.place)
            ends.append(self.name("a vertex"))
        if self.look() in ("->", ":"):
            what = "the edge is directed" if self.look() == "->" else "a port is not read"
            raise FormatError(f"{what}; a mechanism graph has undirected edges between vertices", self.place)
        attributes = {**(self.defaults if len(ends) > 1 else {}), **self.attributes(OF_EDGE)}
        self.nodes |= dict.fromkeys(ends)
        if len(self.nodes) > LINKS_MAX or len(self.edges) + len(ends) - 1 > _EDGES:
            raise FormatError(f"more vertices or edges than a simple graph of {LINKS_MAX} links has", self.place)
        self.edges += [Edge(a, b, attributes, place) for a, b in pairwise(ends)]

    def attributes(self, known: frozenset[str]) -> dict[str, str]:
        found: dict[str, str] = {}
        while self.take("["):
            while not self.take("]"):
                name = self.name("the name of an attribute")
                if not self.take("="):
                    raise FormatError(f"attribute {name[:24]!r} has no value", self.place)
                value = self.name("a value")
                if name in known:
                    found[name] = value
                _ = self.take(",") or self.take(";")
        return found


def parse(text: str) -> Iterator[Item]:
    """Read every graph of a DOT text; anything else is a `FormatError`, with the line."""
    reader = _Reader(text)
    if not reader.tokens:
        raise FormatError("the text holds no graph", "end")
    while reader.at < len(reader.tokens):
        yield reader.graph()
