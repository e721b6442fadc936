"""Trees of links and axes, and the planetary gear trains on them: counted, listed and drawn at random."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import groupby, permutations
from math import factorial
from operator import itemgetter
from random import Random

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.compilation import named
from graphsynth.structure.coloured_chains import OTHER
from graphsynth.structure.connectivity import bits
from graphsynth.structure.gear_trains import PlanetaryGearTrain
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis.made import EACH, Draw, Made

MOST_LINKS = 11
NO_ROLES, FRAME, DRIVE, COAXIAL = range(4)  # which roles of links are chosen
_TREES = 32  # in an item


@dataclass(frozen=True)
class GearedTrees(Made):
    """Trains on trees of axes ``start..stop - 1``; on as many axes as can be, if only rotation graphs are wanted.

    With roles, link 0 is the frame, and with more than a frame links 1 and 2 are input and output.
    """

    links: int
    start: int
    stop: int
    rotation: bool
    mobility: int = 1
    roles: int = NO_ROLES
    weight: float = 1.0

    @property
    def gears(self) -> int:
        """Number of gear pairs."""
        return self.links - 1 - self.mobility

    def chain(self, graph: MechanismGraph) -> PlanetaryGearTrain:
        """Return what a graph stands for."""
        return PlanetaryGearTrain(graph)

    def work(self, purpose: int) -> float:
        """Estimate the work."""
        return EACH * (self.stop - self.start)

    def count(self) -> int:
        """Count the trains, with their roles (exact)."""
        return self._choose(self.roles)[0]

    def graphs(self) -> Iterator[MechanismGraph]:
        """Yield the trains as coloured graphs."""
        number, _ = self._choose(NO_ROLES)
        _, chosen = self._choose(NO_ROLES, number)
        for at, choices in groupby(zip(*chosen.tolist()), itemgetter(0)):
            tree = trees_of_axes(self.links)[at]
            pairs = _possible_pairs(tree)
            for _, choice in choices:
                places = [place for place in range(len(pairs)) if choice >> len(pairs) - 1 - place & 1]
                graph = _geared(tree, [pairs[place] for place in places])
                yield from (_numbered(graph, roles) for roles in self._chosen(graph))

    def urns(self) -> list[tuple[int, Draw]]:
        """List each tree with its number of choices of gear pairs and roles, locked or not, up to its symmetries."""
        found: list[tuple[int, Draw]] = []
        for tree in range(self.start, self.stop):
            order, total, _ = _move(self.links, tree, self.gears, self.roles, -1)
            if total:
                found.append((total // order, partial(self._drawn, tree, total)))
        return found

    def _choose(self, roles: int, room: int = 0) -> tuple[int, NDArray[np.int64]]:
        """Return the number of trains, and the first of them: their trees and choices of gear pairs."""
        (choose_gears,) = named("graphsynth.synthesis.kernels.gears", "choose_gears")
        asked = self.start, self.stop, self.gears, self.rotation, roles
        out = np.empty((2, room), np.int64)
        return int(choose_gears(self.links, _matrices(self.links), *asked, _moves(self.links), out)), out

    def _chosen(self, graph: MechanismGraph) -> list[tuple[int, ...]]:
        """List the roles of the links of a train, each once up to its symmetries."""
        if self.roles == NO_ROLES:
            return [()]
        if self.roles == FRAME:
            return [(orbit[0],) for orbit in graph.orbits]
        ways = PlanetaryGearTrain(graph).arrangements(coaxial=self.roles == COAXIAL)
        return [(way.fixed, way.input, way.output) for way in ways]

    def _drawn(self, tree: int, total: int, random: Random) -> MechanismGraph | None:
        """Draw a symmetry of the tree and what it keeps: gear pairs and roles; None if they are no train."""
        axes = trees_of_axes(self.links)[tree]
        _, _, move = _move(self.links, tree, self.gears, self.roles, random.randrange(total))
        pairs = _possible_pairs(axes)
        chosen = [pairs[place] for place in _kept_choice(pairs, move, self.gears, random)]
        if not _moves_freely(self.links, axes, chosen):
            return None
        graph = _geared(axes, chosen)
        train = PlanetaryGearTrain(graph)
        if (self.mobility > 1 and train.is_fractionated) or (
            self.rotation and len(train.rotation_graph().axes) > len(train.axes)
        ):
            return None
        kept = [roles for roles in _all_roles(axes, self.roles) if all(move[link] == link for link in roles)]
        return _numbered(graph, random.choice(kept))


def _split(packed: bytes) -> list[bytes]:
    return [packed[at : at + 3] for at in range(0, len(packed), 3)]


def _possible_pairs(tree: MechanismGraph) -> list[bytes]:
    """Return the pairs of links that a third one can carry, in the order of the kernel."""
    near = tree.neighbours
    ends = ((a, b) for a in range(tree.links) for b in range(a + 1, tree.links))
    return [bytes((a, b, OTHER)) for a, b in ends if near[a] & near[b] and not near[a] >> b & 1]


def _geared(tree: MechanismGraph, pairs: list[bytes]) -> MechanismGraph:
    return MechanismGraph._unchecked(tree.links, b"".join(sorted(_split(tree.packed) + pairs)))


def _numbered(graph: MechanismGraph, roles: tuple[int, ...]) -> MechanismGraph:
    """Return the graph with the links that have roles first, the first of them fixed."""
    if not roles:
        return graph
    order = [*roles, *(link for link in range(graph.links) if link not in roles)]
    return graph.relabelled([order.index(link) for link in range(graph.links)]).with_frame(0)


def _all_roles(tree: MechanismGraph, roles: int) -> list[tuple[int, ...]]:
    """List the roles that links can have by their axes: of a frame; of frame, input and output."""
    if roles in (NO_ROLES, FRAME):
        return [()] if roles == NO_ROLES else [(link,) for link in range(tree.links)]
    near = [set(bits(row)) for row in tree.neighbours]
    found = ((f, a, b) for f in range(tree.links) for a, b in permutations(near[f], 2))
    return [(f, a, b) for f, a, b in found if roles == DRIVE or b in near[a]]


def _kept_choice(pairs: list[bytes], move: list[int], gears: int, random: Random) -> list[int]:
    """Draw one of the choices of so many pairs that a permutation of the links keeps."""
    number = {(pair[0], pair[1]): at for at, pair in enumerate(pairs)}
    images = [number[min(ends), max(ends)] for ends in ((move[pair[0]], move[pair[1]]) for pair in pairs)]
    cycles: list[list[int]] = []
    left = set(range(len(pairs)))
    while left:
        cycle = [min(left)]
        while (following := images[cycle[-1]]) != cycle[0]:
            cycle.append(following)
        left -= set(cycle)
        cycles.append(cycle)
    ways = [[1] + [0] * gears]  # how many choices of so many pairs the last cycles leave
    for cycle in reversed(cycles):
        size, rest = len(cycle), ways[-1]
        ways.append([rest[k] + (rest[k - size] if k >= size else 0) for k in range(gears + 1)])
    chosen: list[int] = []
    for cycle, rest in zip(cycles, ways[-2::-1]):
        wanted, size = gears - len(chosen), len(cycle)
        taking = rest[wanted - size] if wanted >= size else 0
        if random.randrange(rest[wanted] + taking) < taking:
            chosen += cycle
    return chosen


def _moves_freely(links: int, tree: MechanismGraph, pairs: list[bytes]) -> bool:
    """Tell whether any set of links holds fewer pairs, carriers included, than it has links by 2 at least."""
    near = tree.neighbours
    held = np.array([1 << a | 1 << b | near[a] & near[b] for a, b, _ in pairs])
    sets = np.arange(1 << links)
    inside = (sets[:, None] & held == held).sum(axis=1)
    return bool((inside <= np.maximum(np.bitwise_count(sets).astype(np.int64) - 2, 0)).all())


def _move(links: int, tree: int, gears: int, roles: int, target: int) -> tuple[int, int, list[int]]:
    """Return the order of the group of a tree, how many pairs of a symmetry and what it keeps, and a symmetry.

    It is that of the pair with the given number; of a negative one nothing is returned but the numbers.
    """
    (weigh_moves,) = named("graphsynth.synthesis.kernels.gears", "weigh_moves")
    move = np.zeros(links, np.int64)
    order, total = weigh_moves(links, _matrices(links)[tree], gears, roles, _moves(links), target, move)
    return int(order), int(total), move.tolist()


@lru_cache(maxsize=1)
def _moves(links: int) -> NDArray[np.uint8]:
    return np.empty((factorial(links - 1), links), np.uint8)  # a tree of equal arms has the most symmetries


@lru_cache(maxsize=2)
def _matrices(links: int) -> NDArray[np.uint8]:
    found = np.zeros((len(trees_of_axes(links)), links, links), np.uint8)
    for matrix, tree in zip(found, trees_of_axes(links)):
        for a, b, _ in tree.joints:
            matrix[a, b] = matrix[b, a] = 1
    return found


@lru_cache(maxsize=16)
def trees_of_axes(links: int) -> tuple[MechanismGraph, ...]:
    """List the trees of links and axes, each once, as graphs of the links that share an axis.

    They grow by one link, on an axis that is there or on one of its own.

    >>> [len(trees_of_axes(links)) for links in range(2, 8)]
    [1, 2, 4, 9, 22, 59]
    """
    if links == 2:
        return (MechanismGraph(2, [(0, 1)]),)
    found: dict[str, MechanismGraph] = {}
    for tree in trees_of_axes(links - 1):
        axes = PlanetaryGearTrain(tree).axes
        for place in (*axes, *((link,) for link in range(links - 1))):
            grown = MechanismGraph(links, [*tree.joints, *((link, links - 1) for link in place)])
            found.setdefault(grown.key, grown)
    return tuple(found.values())


def geared_trees(links: int, rotation: bool, mobility: int, roles: int) -> tuple[GearedTrees, ...]:
    """Cut the trees of axes into items."""
    trees = len(trees_of_axes(links))
    asked = rotation, mobility, roles
    return tuple(GearedTrees(links, at, min(at + _TREES, trees), *asked) for at in range(0, trees, _TREES))
