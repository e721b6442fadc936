"""Which mechanisms an index draws from: chains, inversions, drivers and sliding joints, each once up to isomorphism."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

from graphsynth.kinematics.dimensional.design import Design
from graphsynth.structure.assur import decompose, find_fault
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis.api import enumerate_chains

#: Colours of a joint in the key that tells families apart, as mobilities of joints in space: sliding, driven.
_SLIDES, _DRIVEN, _SPACE = 1, 2, 6
#: Links up to which joints slide.
_SLIDING = 6


@dataclass(frozen=True)
class Family:
    """All mechanisms of one graph with a frame, one driver on the frame and given sliding joints.

    ``key`` is the canonical key of the graph, whose links are numbered as in it; ``driven`` the driven link;
    ``sliders`` the indices of the prismatic joints among ``graph.joints``.
    """

    key: str
    driven: int
    sliders: tuple[int, ...]

    @cached_property
    def design(self) -> Design:
        """Graph, driver and kinds of joints."""
        graph = MechanismGraph.from_key(self.key)
        kinds = tuple("P" if k in self.sliders else "R" for k in range(len(graph.joints)))
        return Design(graph, ((0, self.driven),), kinds)

    @cached_property
    def tracing(self) -> tuple[int, ...]:
        """Links whose points draw more than a circle or a line: those without a joint on the frame."""
        graph = self.design.graph
        return tuple(link for link in range(1, graph.links) if not graph.neighbours[0] >> link & 1)

    @cached_property
    def groups(self) -> tuple[int, ...]:
        """Numbers of links of the structural groups, in the order of assembly."""
        design = self.design
        return tuple(len(group.links) for group in decompose(design.graph, design.drivers).groups)

    @property
    def dyadic(self) -> bool:
        """Whether all groups are dyads."""
        return self.design.dyadic

    @property
    def turns(self) -> bool:
        """Whether the driver turns; else it slides."""
        return self.design.kinds[self.design.driver_joints[0]] == "R"


def families(links: Sequence[int], sliders: int) -> list[Family]:
    """Return all families with these numbers of links, with up to so many sliding joints (none in eight-bars).

    Examples
    --------
    >>> [len(families([links], 0)) for links in (4, 6, 8)]
    [1, 9, 153]
    """
    seen: dict[str, Family] = {}
    for count in links:
        for graph in (inversion for chain in enumerate_chains(count) for inversion in chain.inversions()):
            for coloured, family in of_graph(graph, sliders if count <= _SLIDING else 0):
                seen.setdefault(coloured, family)
    return list(seen.values())


def of_graph(graph: MechanismGraph, sliders: int) -> Iterator[tuple[str, Family]]:
    """Yield the families of an inversion, each with a key that isomorphic ones share."""
    graph = MechanismGraph.from_key(graph.key)
    pairs = [(a, b) for a, b, _ in graph.joints]
    for driver in (k for k, (a, _) in enumerate(pairs) if a == graph.frame):
        if find_fault(graph, [pairs[driver]]) is not None:
            continue
        for count in range(sliders + 1):
            for sliding in combinations(range(len(pairs)), count):
                colours = [1 + _SLIDES * (k in sliding) + _DRIVEN * (k == driver) for k in range(len(pairs))]
                coloured = MechanismGraph(
                    graph.links, [(*pair, own) for pair, own in zip(pairs, colours)], frame=0, space=_SPACE
                )
                yield coloured.key, Family(graph.key, pairs[driver][1], sliding)
