"""Counting all chains of a size together: what the identities contribute, and what all other automorphisms do.

By the lemma of Burnside the chains over a contracted graph are the mean number of labellings that an automorphism
fixes.  The sum over all graphs is cut in two: the identities, of all graphs at once (``rigid_blocks``), and the other
automorphisms, graph by graph; most graphs have none.  A part is a fraction; only the sum of all is a whole number.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import TooLargeError
from graphsynth.synthesis.chunks import workspace
from graphsynth.synthesis.contracted import SHIPPED_LOOPS, contracted_graphs
from graphsynth.synthesis.families import Family, chain_families
from graphsynth.synthesis.kernels.counting import FRAME_NONE
from graphsynth.synthesis.kernels.layout import MAX_VERTICES
from graphsynth.synthesis.kernels.moving import sum_moved
from graphsynth.synthesis.rigid_blocks import identity_sum

GROWN_LOOPS = SHIPPED_LOOPS + 1  # as many are grown as a stream from the graphs that are shipped
_LEAST_LOOPS = 8  # with fewer, graph by graph is faster
_GRAPHS = 2048  # in one item
_ROOTS = 512
_BUFFER = 4096
_SOME = 20  # graphs with one loop more that grow from one


@dataclass(frozen=True)
class Identities:
    """The share of the identities: distributions of paths over some points.

    Weights are those of chunks: contracted graphs that are counted one by one.
    """

    links: int
    space: int
    points: int

    @property
    def weight(self) -> float:
        """Share of the work."""
        return 2000.0 * self.points

    def count(self) -> Fraction:
        """Return the sum of labellings over the orders of the groups (exact)."""
        return identity_sum(self.links, self.space, self.points)


@dataclass(frozen=True)
class Listed:
    """The share of the other automorphisms of contracted graphs ``start..stop - 1`` of a family."""

    family: Family
    start: int
    stop: int

    @property
    def weight(self) -> float:
        """Share of the work."""
        return (self.stop - self.start) / 10.0

    def count(self) -> Fraction:
        """Return the sum over the graphs of labellings fixed, over the order of the group (exact)."""
        return moved(self.family, self.family.graphs, self.start, self.stop)


@dataclass(frozen=True)
class Grown:
    """The same of all graphs with one loop more than shipped that grow from graphs ``start..stop - 1`` of a list."""

    families: tuple[Family, ...]
    loops: int
    vertices: int
    start: int
    stop: int

    @property
    def weight(self) -> float:
        """Share of the work."""
        return _SOME * (self.stop - self.start) / 10.0

    def count(self) -> Fraction:
        """Return the sum over the graphs of labellings fixed, over the order of the group (exact)."""
        return sum((share for _, share in self.by_vertices().values()), Fraction(0))

    def by_vertices(self) -> dict[int, tuple[int, Fraction]]:
        """Return the number of contracted graphs, and the share of the automorphisms, by number of vertices."""
        totals = np.zeros(MAX_VERTICES + 1, np.int64)
        shares = {family.vertices: Fraction(0) for family in self.families}
        families = {family.vertices: family for family in self.families}
        for mults in self._stream(totals):
            k = mults.shape[1]
            shares[k] += moved(families[k], mults, 0, len(mults))
        return {k: (int(totals[k]), share) for k, share in shares.items()}

    def _stream(self, totals: NDArray[np.int64]) -> Iterator[NDArray[np.uint8]]:
        """Stream the symmetric graphs in blocks of equal numbers of vertices; ``totals`` adds up all graphs."""
        from graphsynth.synthesis.kernels.growing import grow, make_growth

        roots = contracted_graphs(self.loops, self.vertices)[self.start : self.stop]
        growth = make_growth()
        out = np.empty((_BUFFER, MAX_VERTICES, MAX_VERTICES), np.uint8)
        sizes = np.empty(_BUFFER, np.int64)
        if self.loops == GROWN_LOOPS:
            totals[self.vertices] += len(roots)
            yield roots
        most = self.families[-1].vertices
        count = _BUFFER
        while count == _BUFFER:
            numbers = self.vertices, roots, len(roots), self.loops, SHIPPED_LOOPS, GROWN_LOOPS, most
            count = grow(*numbers, True, growth, out, sizes, totals)
            if count < 0:
                raise TooLargeError("a contracted graph has too many symmetries to grow others from it")
            for k in np.unique(sizes[:count]).tolist():
                block = np.ascontiguousarray(out[:count][sizes[:count] == k][:, :k, :k])
                block.setflags(write=False)  # the kernels are compiled once, for read-only lists
                yield block


Total = Identities | Listed | Grown


def is_counted_together(mobility: int, loops: int, higher: tuple[tuple[int, int], ...]) -> bool:
    """Tell whether the chains with these numbers can be counted as parts of sums."""
    return mobility == 1 and not higher and _LEAST_LOOPS <= loops <= GROWN_LOOPS


def totals_of(families: Sequence[Family]) -> list[Total] | None:
    """Cut the sum for all chains of a size into parts; None for families that are something else, or few."""
    if not families:
        return None
    one = families[0]
    if one.frames != FRAME_NONE or not is_counted_together(one.mobility, one.loops, one.higher):
        return None
    if tuple(families) != tuple(chain_families(one.links, 1, one.space, {}, False)):
        return None
    return list(_totals(tuple(families)))


@lru_cache(maxsize=4)
def _totals(families: tuple[Family, ...]) -> tuple[Total, ...]:
    parts: list[Total] = []
    last = families[-1]
    parts += [Identities(last.links, last.space, points) for points in range(last.vertices, 1, -1)]
    if last.loops <= SHIPPED_LOOPS:
        for family in families:
            count = len(family.graphs)
            parts += [Listed(family, at, min(at + _GRAPHS, count)) for at in range(0, count, _GRAPHS)]
        return tuple(parts)
    for loops in range(GROWN_LOOPS, 1, -1):
        for k in range(2, 3 if loops == GROWN_LOOPS else 2 * loops - 1):
            count = len(contracted_graphs(loops, k))
            parts += [Grown(families, loops, k, at, min(at + _ROOTS, count)) for at in range(0, count, _ROOTS)]
    return tuple(parts)


def moved(family: Family, mults: NDArray[np.uint8], start: int, stop: int) -> Fraction:
    """Sum, over contracted graphs, the labellings fixed by automorphisms but the identity, over the order of the group.

    Raises `TooLargeError` for numbers above 2**62.
    """
    edge_labels = family.edge_labels
    out = np.zeros((2, stop - start), np.int64)
    tables, work = edge_labels.tables, workspace(edge_labels)
    if sum_moved(family.vertices, mults, start, stop, tables, work, out) < 0:
        raise TooLargeError(
            f"a contracted graph with {family.vertices} vertices has too many symmetries or partial chains to count"
        )
    total = Fraction(0)
    for order in np.unique(out[0]).tolist():
        total += Fraction(sum(out[1, out[0] == order].tolist()), order)
    return total
