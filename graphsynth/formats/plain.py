"""Formats that other rooms define, in the form of the registry: text form, graph6, mechanisms as TOML."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from graphsynth.errors import FormatError, GraphError
from graphsynth.formats.graph_json import KEYED_MAX
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.canonical import decode_key
from graphsynth.structure.graph import MechanismGraph

__all__ = ["compose_graph6", "compose_text", "compose_toml", "graph_of_key", "parse_graph6", "parse_text", "parse_toml"]

_STRING = re.compile(r'"(?:[^"\\\n]|\\.)*+"' "|'[^'\n]*+'")
_LONG_KEY = re.compile(r'(?<![\w"-])(?:[\w"-]++[ \t]*+\.[ \t]*+){12}', re.ASCII)


def parse_text(line: str, place: str) -> MechanismGraph:
    """Read a line: a canonical key, or the text form."""
    try:
        return graph_of_key(line) if line.startswith("1") else MechanismGraph.from_text(line)
    except FormatError as error:
        raise FormatError(str(error), place) from None


def graph_of_key(key: str) -> MechanismGraph:
    """Read a key; that it is the canonical one is checked up to 24 links, where the check takes bounded time."""
    links, joints, frame, space = decode_key(key)
    if links <= KEYED_MAX:
        return MechanismGraph.from_key(key)
    return MechanismGraph(links, joints, frame=frame, space=space)


def compose_text(graphs: Iterable[MechanismGraph]) -> Iterator[str]:
    """Write the text form of every graph."""
    return (graph.to_text() + "\n" for graph in graphs)


def parse_graph6(line: str, place: str) -> MechanismGraph:
    """Read a line of graph6."""
    try:
        return MechanismGraph.from_graph6(line)
    except FormatError as error:
        raise FormatError(str(error), place) from None


def compose_graph6(graphs: Iterable[MechanismGraph]) -> Iterator[str]:
    """Write graph6; a frame or a joint of higher mobility is refused."""
    return (graph.graph6() + "\n" for graph in graphs)


def parse_toml(text: str) -> list[Mechanism]:
    """Read a mechanism.

    A key of many parts is refused: the time of the parser grows with the square of their number.
    """
    if match := _LONG_KEY.search(_STRING.sub('""', text)):
        raise FormatError(f"the key {match[0][:24]!r}... has too many parts", "text")
    return [Mechanism.from_toml(text)]


def compose_toml(items: Iterable[MechanismGraph | Mechanism]) -> Iterator[str]:
    """Write a mechanism."""
    for item in items:
        if not isinstance(item, Mechanism):
            raise GraphError("TOML holds dimensioned mechanisms; write a graph as json, graphml or text")
        yield item.to_toml()
