"""DOT, the language of Graphviz, read and written.

Read are undirected graphs: vertices, edges and chains of edges, attributes, defaults of edges, all comments and
quotations.  Subgraphs, ports, directed graphs and HTML texts are refused.

Source: the DOT language reference of Graphviz.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import NamedTuple

from graphsynth.errors import FormatError
from graphsynth.formats.attributes import Edge, Item, attributes_of, item_from
from graphsynth.structure.text import LINKS_MAX

__all__ = ["compose", "parse"]

_TOKEN = re.compile(
    r"(?P<skip>\s+|//[^\n]*|\#[^\n]*|/\*[^*]*(?:\*(?!/)[^*]*)*\*/)"
    r'|(?P<quoted>"[^"\\]*(?:\\.[^"\\]*)*")'
    r"|(?P<number>-?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?))"
    r"|(?P<word>[A-Za-z_\x80-\U0010ffff][A-Za-z_0-9\x80-\U0010ffff]*)"
    r"|(?P<mark>--|->|[][{}=;,:<+])",
    re.DOTALL,
)
_TOKENS_MAX = 400_000
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
        yield "\n".join([*lines, "}\n"])


def _value(text: str) -> str:
    if text.isdigit() and text.isascii():
        return text
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


class _Token(NamedTuple):
    text: str
    line: int
    is_name: bool  # an identifier, a number or a quotation
    bare: bool = False  # could be a keyword


def _tokens(text: str) -> list[_Token]:
    found: list[_Token] = []
    at, line = 0, 1
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise FormatError(f"{text[at]!r} begins nothing of the DOT language", f"line {line}")
        kind, piece = match.lastgroup, match[0]
        if kind == "quoted":
            found.append(_Token(_unquoted(piece), line, True))
        elif kind != "skip":
            found.append(_Token(piece, line, kind != "mark", kind == "word" and piece.lower() in _KEYWORDS))
        at = match.end()
        line += piece.count("\n")
        if len(found) > _TOKENS_MAX:
            raise FormatError(f"more than {_TOKENS_MAX} words; no mechanism graph needs so many", f"line {line}")
    return found


def _unquoted(piece: str) -> str:
    r"""Undo a quotation: ``\"`` and ``\\`` are the characters, a line end after a backslash is nothing."""
    body = piece[1:-1]
    return re.sub(r'\\(["\\\n])', lambda m: "" if m[1] == "\n" else m[1], body) if "\\" in body else body


class _Reader:
    """Reads statement by statement; never recurses."""

    def __init__(self, text: str) -> None:
        self.tokens, self.at = _tokens(text), 0
        self.last = text.count("\n") + 1
        self.nodes: dict[str, None] = {}
        self.edges: list[Edge] = []
        self.own: dict[str, str] = {}
        self.defaults: dict[str, str] = {}

    @property
    def place(self) -> str:
        return f"line {self.tokens[self.at].line if self.at < len(self.tokens) else self.last}"

    def look(self) -> str:
        """Return the next mark or keyword; a name reads as the empty text."""
        if self.at >= len(self.tokens):
            raise FormatError("the text ends within a graph", self.place)
        token = self.tokens[self.at]
        return token.text.lower() if token.bare else "" if token.is_name else token.text

    def take(self, mark: str) -> bool:
        if self.look() == mark:
            self.at += 1
            return True
        return False

    def name(self, what: str) -> str:
        if self.look():
            raise FormatError(f"expected {what}, found {self.tokens[self.at].text[:24]!r}", self.place)
        parts = [self.tokens[self.at].text]
        self.at += 1
        while self.at + 1 < len(self.tokens) and self.look() == "+":  # "a" + "b"
            self.at += 1
            parts.append(self.tokens[self.at].text)
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
        return item_from(list(self.nodes), self.edges, self.own, first)

    def statement(self) -> None:
        if self.take(";"):
            return
        kind = self.look()
        if kind in ("graph", "edge", "node"):
            self.at += 1
            table = {"graph": self.own, "edge": self.defaults, "node": {}}[kind]
            table |= self.attributes()
            return
        if kind in ("subgraph", "{"):
            raise FormatError("a subgraph is not read; write its edges into the graph", self.place)
        first = self.name("a vertex")
        if self.take("="):
            self.own[first] = self.name("a value")
            return
        ends, place = [first], self.place
        while self.take("--"):
            if self.look() in ("subgraph", "{"):
                raise FormatError("a subgraph is not read; write its edges into the graph", self.place)
            ends.append(self.name("a vertex"))
        if self.look() in ("->", ":"):
            what = "the edge is directed" if self.look() == "->" else "a port is not read"
            raise FormatError(f"{what}; a mechanism graph has undirected edges between vertices", self.place)
        attributes = {**(self.defaults if len(ends) > 1 else {}), **self.attributes()}
        self.nodes |= dict.fromkeys(ends)
        if len(self.nodes) > LINKS_MAX or len(self.edges) + len(ends) - 1 > _EDGES:
            raise FormatError(f"more vertices or edges than a simple graph of {LINKS_MAX} links has", self.place)
        self.edges += [Edge(a, b, attributes, place) for a, b in pairwise(ends)]

    def attributes(self) -> dict[str, str]:
        found: dict[str, str] = {}
        while self.take("["):
            while not self.take("]"):
                name = self.name("the name of an attribute")
                if not self.take("="):
                    raise FormatError(f"attribute {name[:24]!r} has no value", self.place)
                found[name] = self.name("a value")
                _ = self.take(",") or self.take(";")
        return found


def parse(text: str) -> list[Item]:
    """Read every graph of a DOT text.

    Raises
    ------
    FormatError
        For anything that is not DOT of simple undirected graphs, with the line.

    Examples
    --------
    >>> parse('graph { frame=a; a -- b -- c -- a [mobility=1] }')[0].to_text()
    'Bw f0'
    """
    reader = _Reader(text)
    found = []
    while reader.at < len(reader.tokens):
        found.append(reader.graph())
    if not found:
        raise FormatError("the text holds no graph", "end")
    return found
