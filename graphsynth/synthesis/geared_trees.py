"""Trees of links and axes, and the planetary gear trains of one freedom on them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.compilation import named
from graphsynth.structure.coloured_chains import OTHER
from graphsynth.structure.gear_trains import PlanetaryGearTrain
from graphsynth.structure.graph import MechanismGraph

MOST_LINKS = 10
_MOST_MOVES = 362_880  # automorphisms of a tree: nine equal arms
_TREES = 32  # in an item
_ROWS = 1 << 16


@dataclass(frozen=True)
class GearedTrees:
    """Trains on trees of axes ``start..stop - 1``; on as many axes as can be, if only rotation graphs are wanted."""

    links: int
    start: int
    stop: int
    rotation: bool
    weight: float = 1.0

    def count(self) -> int:
        """Count the trains (exact)."""
        return self._choose(np.zeros((2, 0), np.int64))

    def graphs(self) -> Iterator[MechanismGraph]:
        """Yield the trains as coloured graphs."""
        chosen = np.empty((2, _ROWS), np.int64)
        if (number := self._choose(chosen)) > _ROWS:
            chosen = np.empty((2, number), np.int64)
            self._choose(chosen)
        trees = trees_of_axes(self.links)
        pairs: list[bytes] = []
        known = -1
        for tree, choice in zip(*chosen[:, :number].tolist()):
            if tree != known:
                pairs, known = _possible_pairs(trees[tree]), tree
            places = [place for place in range(len(pairs)) if choice >> len(pairs) - 1 - place & 1]
            joints = _split(trees[tree].packed) + [pairs[place] for place in places]
            yield MechanismGraph._unchecked(self.links, b"".join(sorted(joints)))

    def texts(self) -> Iterator[tuple[bytes, int]]:
        """Yield them as (lines of the text form, number of lines), at once."""
        lines = [PlanetaryGearTrain(graph).to_text() for graph in self.graphs()]
        if lines:
            yield "".join(f"{line}\n" for line in lines).encode("ascii"), len(lines)

    def _choose(self, out: NDArray[np.int64]) -> int:
        (choose_gears,) = named("graphsynth.synthesis.kernels.gears", "choose_gears")
        asked = self.start, self.stop, self.links - 2, self.rotation
        return int(choose_gears(self.links, _matrices(self.links), *asked, _moves(), out))


def _split(packed: bytes) -> list[bytes]:
    return [packed[at : at + 3] for at in range(0, len(packed), 3)]


def _possible_pairs(tree: MechanismGraph) -> list[bytes]:
    """Return the pairs of links that a third one can carry, in the order of the kernel."""
    near = tree.neighbours
    ends = ((a, b) for a in range(tree.links) for b in range(a + 1, tree.links))
    return [bytes((a, b, OTHER)) for a, b in ends if near[a] & near[b] and not near[a] >> b & 1]


@lru_cache(maxsize=1)
def _moves() -> NDArray[np.uint8]:
    return np.empty((_MOST_MOVES, MOST_LINKS), np.uint8)


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


def geared_trees(links: int, rotation: bool) -> tuple[GearedTrees, ...]:
    """Cut the trees of axes into items."""
    trees = len(trees_of_axes(links))
    return tuple(GearedTrees(links, at, min(at + _TREES, trees), rotation) for at in range(0, trees, _TREES))
