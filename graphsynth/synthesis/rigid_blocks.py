"""The labellings of all contracted graphs together, symmetry ignored, without making one graph.

Every distribution of paths over the pairs of k points falls apart in one way only: into the largest rigid blocks, and
what is left when each block is drawn together to a point, which has no rigid part.  All distributions are counted by a
product; so those without rigid blocks are what is left of them when the others are taken away, and these are built of
smaller blocks.  Points drawn together matter by their number alone, so partitions of k are all there is to go through.
``docs/explanation/enumeration.md`` has the proofs.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import product
from math import comb, factorial
from typing import Any

Sizes = tuple[int, ...]
"""Points drawn together, in falling order: (3, 1, 1) are five points, three of them one block."""

Series = dict[tuple[int, int], Any]
"""Polynomials in the weight (``fmpz_poly``), by number of links inside paths and number of marks."""


def identity_sums(links: int, space: int = 3, vertices: int | None = None) -> dict[int, Fraction]:
    """Sum, over the contracted graphs with k vertices, the labellings over the order of the group; for every k.

    That is what the identities contribute to the chains with mobility 1 and joints of mobility 1 (lemma of Burnside).
    ``links``: N, such that there are such chains, with two loops or more; ``space``: mobility Pi; ``vertices``: k at
    most, which takes fewer points.

    >>> identity_sums(6), sum(identity_sums(8).values())
    ({2: Fraction(1, 1)}, Fraction(35, 4))
    """
    most = min(_most_vertices(links, space), vertices or links)
    sums = dict.fromkeys(range(2, most + 1), Fraction(0))
    for points in range(2, most + 1):
        for marks, count in _Blocks(points, space, links - points, most - points).labellings():
            sums[points + marks] += count
    return sums


def identity_sum(links: int, space: int, points: int) -> Fraction:
    """Return what distributions over so many points (2 or more) contribute to the sum of all ``identity_sums``."""
    blocks = _Blocks(points, space, links - points, _most_vertices(links, space) - points)
    return sum((count for _, count in blocks.labellings()), Fraction(0))


def _most_vertices(links: int, space: int) -> int:
    loops = (space * (links - 1) - 1) // (space - 1) - links + 1
    return min(2 * (loops - 1), links)


class _Blocks:
    """Distributions of paths over pairs of points, up to a weight, a number of links inside them, and of marks.

    A contracted graph has no vertex with two paths.  Vertices with two are taken out by inclusion and exclusion: they
    become marked links inside paths, each with the factor -1.  Marked links are told apart, so with m of them the
    series takes 1 / m! (and ``scale ** m``, which keeps all coefficients whole).
    """

    def __init__(self, points: int, space: int, inside: int, marks: int) -> None:
        self.points, self.space, self.inside, self.marks = points, space, inside, marks
        self.scale = factorial(marks)
        self.heaviest = space * (points - 1) - 1
        self._solved: dict[Sizes, tuple[Series, Series]] = {}
        self._drawn: dict[Sizes, dict[Sizes, Series]] = {}

    def labellings(self) -> Iterator[tuple[int, Fraction]]:
        """Yield the sum of labellings over the factorial of the number of vertices, by the number of marks.

        Paths of weight 0 can be anywhere, any number of them: they come last.
        """
        pairs, length = comb(self.points, 2), self.space - 1
        for (inside, marks), series in self._split((1,) * self.points)[0].items():
            paths, rest = divmod(self.inside - inside, length)
            count = int(series[self.heaviest])
            if rest or not count:
                continue
            for more, ways in enumerate(self._spread(pairs, length, paths, self.marks - marks)):
                yield marks + more, Fraction(count * ways, self.scale ** (marks + more) * factorial(self.points))

    def _spread(self, pairs: int, length: int, paths: int, marks: int) -> list[int]:
        """Count ways to have so many equal paths, by marks on them; times ``scale`` for each mark."""
        ways = [0] * (marks + 1)
        power = [1] + [0] * marks  # ((1 - x) ** length - 1) ** m
        for m in range(min(paths, marks) + 1):
            plain = comb(pairs + paths - m - 1, paths - m) * pairs**m
            for j in range(m, marks + 1):
                ways[j] += plain * power[j] * self.scale**j // factorial(m)
            power = [sum((-1) ** i * comb(length, i) * power[j - i] for i in range(1, j + 1)) for j in range(marks + 1)]
        return ways

    def _all(self, sizes: Sizes) -> Series:
        """Count all distributions of paths over pairs of points of different blocks."""
        from flint import fmpz_poly

        pairs = (sum(sizes) ** 2 - sum(size * size for size in sizes)) // 2
        joint = self.space - 1  # a pair is joined at most once, and has any number of longer paths
        single = [comb(pairs, d // joint) if d % joint == 0 else 0 for d in range(self.heaviest + 1)]
        total: Series = {(0, 0): fmpz_poly(single)}
        for weight in range(1, joint):
            length = joint - weight
            factor: Series = {}
            for paths in range(min(self.inside // length, self.heaviest // weight) + 1):
                for marks, ways in enumerate(self._spread(pairs, length, paths, self.marks)):
                    if ways:
                        factor[paths * length, marks] = fmpz_poly([0] * (paths * weight) + [ways])
            total = self._times(total, factor)
        return total

    def _times(self, one: Series, other: Series) -> Series:
        """Multiply two series, up to the bounds."""
        found: Series = {}
        for (inside, marks), left in one.items():
            for (more, further), right in other.items():
                key = inside + more, marks + further
                if key[0] <= self.inside and key[1] <= self.marks:
                    found[key] = found[key] + left * right if key in found else left * right
        return {key: series.truncate(self.heaviest + 1) for key, series in found.items()}

    def _split(self, sizes: Sizes) -> tuple[Series, Series]:
        """Return the distributions without rigid blocks, and those that are one rigid block, for points drawn together.

        Which of the two is possible is told by the weight: the mobility of the whole is at least 1, or at most 0.
        """
        if sizes not in self._solved:
            if len(sizes) == 1:
                self._solved[sizes] = _one(), _one()
                return self._solved[sizes]
            left = self._all(sizes)
            for drawn, ways in self._draw(sizes).items():
                if drawn != sizes:
                    _add(left, self._times(ways, self._split(drawn)[0]), -1)
            bound = self.space * (len(sizes) - 1)
            free = {key: series.truncate(bound) for key, series in left.items()}
            rigid = {key: series - free[key] for key, series in left.items()}
            self._solved[sizes] = _without_zeros(free), _without_zeros(rigid)
        return self._solved[sizes]

    def _draw(self, sizes: Sizes) -> dict[Sizes, Series]:
        """Count the ways to draw points together to rigid blocks, two blocks or more; by the sizes afterwards."""
        if sizes not in self._drawn:
            ways: dict[Sizes, Series] = {}
            for block, others, choices in _blocks_with_the_first(sizes):
                if others or len(block) == 1:
                    rigid = self._split(block)[1]
                    for drawn, rest in self._drawn_at_will(others) if rigid else ():
                        key = tuple(sorted((*drawn, sum(block)), reverse=True))
                        _add(ways.setdefault(key, {}), rest if len(block) == 1 else self._times(rigid, rest), choices)
            self._drawn[sizes] = ways
        return self._drawn[sizes]

    def _drawn_at_will(self, sizes: Sizes) -> Iterator[tuple[Sizes, Series]]:
        """Yield the same for any number of blocks."""
        if not sizes:
            yield (), _one()
            return
        yield from self._draw(sizes).items()
        if len(sizes) > 1 and (rigid := self._split(sizes)[1]):
            yield (sum(sizes),), rigid


def _one() -> Series:
    from flint import fmpz_poly

    return {(0, 0): fmpz_poly([1])}


def _add(total: Series, other: Series, times: int) -> None:
    for key, series in other.items():
        total[key] = total[key] + times * series if key in total else times * series


def _without_zeros(series: Series) -> Series:
    return {key: polynomial for key, polynomial in series.items() if polynomial}


def _blocks_with_the_first(sizes: Sizes) -> Iterator[tuple[Sizes, Sizes, int]]:
    """Yield each choice of what forms a block with the first of the sizes: (block, others, choices alike)."""
    kinds = sorted(set(sizes[1:]), reverse=True)
    numbers = [sizes[1:].count(size) for size in kinds]
    for taken in product(*(range(number + 1) for number in numbers)):
        block = (sizes[0], *(size for size, count in zip(kinds, taken) for _ in range(count)))
        others = tuple(size for size, number, count in zip(kinds, numbers, taken) for _ in range(number - count))
        choices = 1
        for number, count in zip(numbers, taken):
            choices *= comb(number, count)
        yield block, others, choices
