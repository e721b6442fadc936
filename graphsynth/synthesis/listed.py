"""Graphs in the order of their enumeration: an iterator that can be asked for one by its number."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from html import escape
from itertools import islice
from typing import overload

from graphsynth.core.errors import GraphError
from graphsynth.structure.graph import MechanismGraph

#: Graphs shown in a notebook.
_SHOWN = 12


class Graphs(Iterator[MechanismGraph]):
    """Graphs of an enumeration, made one after the other.

    An iterator like any other; ``graphs[3]`` and ``graphs[2:5]`` enumerate anew up to there, whatever was taken from
    it, and a notebook shows the first twelve.

    Examples
    --------
    >>> from graphsynth import enumerate_chains
    >>> chains = enumerate_chains(6)
    >>> chains[1].graph6(), len(list(chains)), chains
    ('E]`G', 2, Graphs: chains of 6 links, mobility 1; list(...) makes them all, [k] one of them)
    """

    def __init__(self, what: str, make: Callable[[], Iterator[MechanismGraph]]) -> None:
        self._what, self._make, self._graphs = what, make, make()

    def __next__(self) -> MechanismGraph:
        return next(self._graphs)

    @overload
    def __getitem__(self, k: int) -> MechanismGraph: ...
    @overload
    def __getitem__(self, k: slice) -> list[MechanismGraph]: ...
    def __getitem__(self, k: int | slice) -> MechanismGraph | list[MechanismGraph]:
        if isinstance(k, slice):
            return list(islice(self._make(), k.start, k.stop, k.step))
        if k < 0:
            raise GraphError(f"graph {k}: the graphs are counted from the first, 0; make a list to count from the last")
        found = next(islice(self._make(), k, None), None)
        if found is None:
            raise IndexError(f"graph {k} does not exist; there are fewer {self._what}")
        return found

    def __repr__(self) -> str:
        return f"Graphs: {self._what}; list(...) makes them all, [k] one of them"

    def _repr_html_(self) -> str:
        first = list(islice(self._make(), _SHOWN + 1))
        pictures = "".join(
            f"<figure style='display:inline-block'>{graph._repr_svg_()}<figcaption>{k}</figcaption></figure>"
            for k, graph in enumerate(first[:_SHOWN])
        )
        more = "<p>and more</p>" if len(first) > _SHOWN else ""
        return f"<p>{escape(self._what)}</p>{pictures}{more}"
