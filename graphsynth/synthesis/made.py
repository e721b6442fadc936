"""What is made without contracted graphs, and the face that all of it has: rings, fractionated chains, geared trees."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from random import Random
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph

Draw = Callable[[Random], "MechanismGraph | None"]
"""Draws a graph; None stands for a draw of everything anew."""


EACH = 1000.0  # work of a graph that is made one by one, as the kernels weigh


class Made(ABC):
    """A work item that makes its graphs itself."""

    weight: float  # share of the work, for progress

    @abstractmethod
    def graphs(self) -> Iterator[MechanismGraph]:
        """Yield the graphs."""

    @abstractmethod
    def work(self, purpose: int) -> float:
        """Estimate the work, as `weigh_block` does for contracted graphs."""

    def chain(self, graph: MechanismGraph) -> Any:
        """Return what a graph stands for."""
        return graph

    def count(self) -> int:
        """Count the graphs (exact)."""
        return sum(1 for _ in self.graphs())

    def texts(self) -> Iterator[tuple[bytes, int]]:
        """Yield them as (lines of the text form, number of lines), at once."""
        lines = [f"{self.chain(graph).to_text()}\n" for graph in self.graphs()]
        if lines:
            yield "".join(lines).encode("ascii"), len(lines)

    def urns(self) -> list[tuple[int, Draw]]:
        """List weights and what draws with them: after the urn is drawn by its weight, all graphs are as likely."""
        listed = list(self.graphs())
        return [(len(listed), lambda random: random.choice(listed))]
