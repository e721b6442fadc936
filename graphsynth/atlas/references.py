"""What a catalogue should say of a chain, by slow and plain means: networkx, subsets one by one, the definition itself.

Nothing here uses the kernels or the data structures that made the catalogue.
"""

from __future__ import annotations

from base64 import urlsafe_b64encode
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

Masks = NDArray[np.int64]


@lru_cache(maxsize=4)
def _sizes(links: int) -> Masks:
    """Count the members of every set of links, the sets as bit masks."""
    sizes = np.zeros(1 << links, np.int64)
    for link in range(links):
        sizes[1 << link : 2 << link] = sizes[: 1 << link] + 1
    return sizes


def search_key(links: int, pairs: list[tuple[int, int]], frame: int | None = None) -> str:
    """Canonical key by the search in plain Python, whatever the number of graphs labelled before."""
    from graphsynth.structure.canonical import link_colours
    from graphsynth.structure.graph import MechanismGraph
    from graphsynth.structure.search import CanonicalSearch

    graph = MechanismGraph(links, pairs, frame=frame)
    found = CanonicalSearch(links, [list(graph.neighbours)], link_colours(graph)).run()
    place = {link: position for position, link in enumerate(found.order_of_vertices)}
    moved = graph.relabelled([place[link] for link in range(links)])
    # the bits of the canonical graph, as the reference page of keys says
    held = {(joint.a, joint.b) for joint in moved.joints}
    bits = "".join("01"[(a, b) in held] for b in range(links) for a in range(b))
    bits += "0" * (-len(bits) % 8)
    head = links, 3 if frame is None else 11
    data = bytes([*head, *(int(bits[at : at + 8], 2) for at in range(0, len(bits), 8))])
    return "1" + urlsafe_b64encode(data).decode().rstrip("=")


@lru_cache(maxsize=200_000)
def group_key(links: int, pairs: tuple[tuple[int, int], ...]) -> str:
    """Key of a structural group of ``links`` moving links and its base, link 0."""
    from graphsynth.structure.graph import MechanismGraph

    return MechanismGraph(links + 1, pairs, frame=0).key


@dataclass(frozen=True)
class Reference:
    """A chain, read from graph6 by networkx; everything else is computed from that graph."""

    graph6: str
    mobility: int

    @cached_property
    def graph(self) -> Any:
        """The chain as networkx reads it."""
        import networkx

        return networkx.from_graph6_bytes(self.graph6.encode())

    @cached_property
    def links(self) -> int:
        """Number of links."""
        return len(self.graph)

    @cached_property
    def maps(self) -> list[dict[int, int]]:
        """Every automorphism, found by networkx."""
        import networkx

        return list(networkx.isomorphism.GraphMatcher(self.graph, self.graph).isomorphisms_iter())

    @cached_property
    def edges_inside(self) -> Masks:
        """Number of joints inside every set of links."""
        count = np.zeros(1 << self.links, np.int64)
        sizes = _sizes(self.links)
        for link in range(self.links):
            near = sum(1 << other for other in self.graph[link] if other < link)
            count[1 << link : 2 << link] = count[: 1 << link] + sizes[np.arange(1 << link) & near]
        return count

    def is_chain(self) -> bool:
        """Whether it hangs together, has two joints on each link, and no part of it is rigid."""
        import networkx

        near = [degree for _, degree in self.graph.degree()]
        return min(near, default=0) >= 2 and bool(networkx.is_connected(self.graph)) and self.no_rigid_subchain()

    def no_rigid_subchain(self) -> bool:
        """Test every set of two or more links: DOF = 3 (|S| - 1) - 2 joints >= 1."""
        sizes = _sizes(self.links)
        return bool((3 * (sizes - 1) - 2 * self.edges_inside >= 1)[sizes >= 2].all())

    def facts(self) -> dict[str, Any]:
        """Every field of the table of chains that follows from the graph."""
        import networkx

        graph = self.graph
        joints = graph.number_of_edges()
        degrees = [degree for _, degree in graph.degree()]
        orbits = self.orbits()
        girth = networkx.girth(graph)
        return {
            "key": search_key(self.links, list(graph.edges)),
            "graph6": networkx.to_graph6_bytes(graph, header=False).decode().strip(),
            "mobility": 3 * (self.links - 1) - 2 * joints,
            "links": self.links,
            "joints": joints,
            "loops": len(networkx.cycle_basis(graph)),
            "assortment": "-".join(str(degrees.count(a)) for a in range(2, max(degrees) + 1)),
            "automorphisms": len(self.maps),
            "link_orbits": " ".join(",".join(map(str, orbit)) for orbit in orbits),
            "inversions": len(orbits),
            "planar": int(networkx.check_planarity(graph)[0]),
            "girth": 0 if girth == float("inf") else girth,
            "fractionated": int(any(True for _ in networkx.articulation_points(graph))),
            "mobility_type": self.mobility_type(),
        }

    def mobility_type(self) -> str:
        """Tell it by all sets of links each of which has two joints with others of the set."""
        import networkx

        if any(True for _ in networkx.articulation_points(self.graph)):
            return "fractionated"
        sizes, sets = _sizes(self.links), np.arange(1 << self.links)
        closed = sets > 0
        for link in range(self.links):
            near = sum(1 << other for other in self.graph[link])
            closed &= (sizes[sets & near] >= 2) | (sets >> link & 1 == 0)
        least = (3 * (sizes - 1) - 2 * self.edges_inside)[closed].min()
        return "partial" if least < 3 * (self.links - 1) - 2 * self.graph.number_of_edges() else "total"

    def orbits(self) -> list[tuple[int, ...]]:
        """Return the orbits of links, by smallest link."""
        return sorted({tuple(sorted({image[link] for image in self.maps})) for link in range(self.links)})

    def inversions(self) -> list[tuple[int, int, str]]:
        """Rows ``(frame, joints of the frame, levels)``."""
        import networkx

        found = []
        for frame, *_ in self.orbits():
            distance = list(networkx.single_source_shortest_path_length(self.graph, frame).values())
            sizes = "-".join(str(distance.count(level)) for level in range(max(distance) + 1))
            found.append((frame, self.graph.degree(frame), sizes))
        return found

    def parents(self) -> list[str]:
        """Keys of the chains that the removal of a dyad leaves."""
        import networkx

        found = set()
        for a, b in self.graph.edges:
            if self.graph.degree(a) == self.graph.degree(b) == 2:
                rest = self.graph.copy()
                rest.remove_nodes_from((a, b))
                if networkx.is_connected(rest) and min(degree for _, degree in rest.degree()) >= 2:
                    plain = networkx.convert_node_labels_to_integers(rest)
                    found.add(search_key(self.links - 2, list(plain.edges)))
        return sorted(found)

    def contracted(self) -> Any:
        """Contracted multigraph: binary links bridged one by one; without vertices for a ring."""
        import networkx

        whole = networkx.MultiGraph(self.graph)
        for link in range(self.links):
            near = [other for _, other in whole.edges(link)]
            if len(near) == 2 and whole.degree(link) == 2 and link not in near:
                whole.remove_node(link)
                whole.add_edge(*near)
        return whole if any(degree > 2 for _, degree in whole.degree()) else networkx.MultiGraph()

    def mechanisms(self) -> list[tuple[int, tuple[int, ...], tuple[str, ...]]]:
        """Rows ``(frame, driven links, keys of the groups in the order of assembly)``, one of each orbit."""
        seen: set[tuple[int, tuple[int, ...]]] = set()
        found = []
        for frame in range(self.links):
            choices = combinations(sorted(self.graph[frame]), self.mobility)
            for drivers in sorted(choices, key=lambda own: sum(1 << link for link in own)):
                if (frame, drivers) in seen:
                    continue
                seen |= {(image[frame], tuple(sorted(image[link] for link in drivers))) for image in self.maps}
                groups = self.groups(frame, drivers)
                if groups is not None:
                    found.append((frame, drivers, groups))
        return found

    def groups(self, frame: int, drivers: tuple[int, ...]) -> tuple[str, ...] | None:
        """Keys of the groups in the order of assembly; None as for `members`."""
        found = self.members(frame, drivers)
        if found is None:
            return None
        placed, keys = {frame, *drivers}, []
        for group in found:
            number = {link: at for at, link in enumerate(sorted(group), 1)}
            placed |= group
            joined = [(number[a], number.get(b, 0)) for a in group for b in self.graph[a] if b in placed]
            pairs = {(min(pair), max(pair)) for pair in joined}
            keys.append(group_key(len(group), tuple(sorted(pairs))))
        return tuple(keys)

    def members(self, frame: int, drivers: tuple[int, ...]) -> list[set[int]] | None:
        """Links of the groups by the definition: smallest sets of zero mobility, one after the other.

        None if some set has more constraints than freedoms, or some link is never placed.
        """
        placed = sum(1 << link for link in {frame, *drivers})
        everything = (1 << self.links) - 1
        found = []
        while placed != everything:
            sets = _subsets(everything & ~placed)
            constraints = 2 * (self.edges_inside[sets | placed] - self.edges_inside[placed])
            freedoms = 3 * _sizes(self.links)[sets]
            tight = [int(own) for own in sets[constraints == freedoms]]
            if (constraints > freedoms).any() or not tight:
                return None
            smallest = [own for own in tight if not any(other != own and other & ~own == 0 for other in tight)]
            group = min(smallest, key=lambda own: own & -own)
            found.append(set(_members(group)))
            placed |= group
        return found


@lru_cache(maxsize=4096)
def _subsets(mask: int) -> Masks:
    """Nonempty subsets of a set."""
    sets = np.zeros(1, np.int64)
    for link in _members(mask):
        sets = np.concatenate([sets, sets | 1 << link])
    return sets[1:]


def _members(mask: int) -> Iterator[int]:
    while mask:
        yield (mask & -mask).bit_length() - 1
        mask &= mask - 1
