"""Chains that are few enough to be made one by one: rings, and fractionated chains; to count, most need not be made."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from graphsynth.synthesis.families import Levels, rings

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph
    from graphsynth.structure.system.assortment import LinkAssortment


@dataclass(frozen=True)
class OneByOne:
    """Rings, or fractionated chains.

    ``assortment`` and ``levels`` restrict mechanisms, ``symmetry`` asks for an automorphism of that prime order.
    """

    kind: str  # "rings" or "fractionated"
    links: int
    mobility: int
    space: int
    higher: tuple[tuple[int, int], ...]
    framed: bool
    assortment: LinkAssortment | None = None
    levels: Levels = ()
    symmetry: int = 0
    weight: float = 1.0

    def graphs(self) -> Iterator[MechanismGraph]:
        """Yield the graphs."""
        for graph in self._all():
            if self.symmetry and graph.automorphism_order % self.symmetry:  # Cauchy: p divides the order of the group
                continue
            if self._fits(graph):
                yield graph

    @property
    def restricted(self) -> bool:
        """Whether only some of the chains are wanted."""
        return bool(self.assortment or self.levels or self.symmetry)

    def count(self) -> int:
        """Count the graphs; fractionated chains without any restriction are not made."""
        if self.kind == "fractionated" and not self.restricted:
            from graphsynth.synthesis.joined import count_fractionated

            return count_fractionated(self.links, self.mobility, self.space, self.higher, self.framed)
        return sum(1 for _ in self.graphs())

    def _all(self) -> Iterator[MechanismGraph]:
        if self.kind == "rings":
            yield from rings(self.links, self.mobility, self.space, dict(self.higher), self.framed)
            return
        from graphsynth.synthesis.fractionated import fractionated_chains

        for chain in fractionated_chains(self.links, self.mobility, self.space, self.higher):
            if self.framed:
                yield from (_by_levels(graph) for graph in chain.inversions())
            else:
                yield chain

    def _fits(self, graph: MechanismGraph) -> bool:
        from graphsynth.structure.connectivity import components_of

        wanted = self.assortment
        if wanted is not None:
            if graph.degrees[0] != wanted.frame_joints or graph.assortment != {
                a: n for a, n in wanted.n_a.items() if n
            }:
                return False
            parts = len(components_of(graph.neighbours, (1 << graph.links) - 2))  # without the frame
            if wanted.frame_loops != wanted.frame_joints - parts:
                return False
        return all(
            low <= (len(graph.levels[at]) if -len(graph.levels) <= at < len(graph.levels) else 0) <= high
            for at, low, high in self.levels
        )


def _by_levels(graph: MechanismGraph) -> MechanismGraph:
    order = [link for level in graph.levels for link in sorted(level)]
    place = [0] * graph.links
    for position, link in enumerate(order):
        place[link] = position
    return graph.relabelled(place)
