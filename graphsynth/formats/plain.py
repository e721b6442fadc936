"""Formats that other rooms define, in the form of the registry: text form, graph6, mechanisms as TOML."""

from __future__ import annotations

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
