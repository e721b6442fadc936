"""Counting fractionated chains by arithmetic on counts of their blocks, without making them.

A fractionated chain is a tree of blocks (`graphsynth.synthesis.fractionated`).  Chains in which a link, a block, or a
block at a link is pointed out are counted by formal power series, the symmetries of blocks by the lemma of Burnside;
since every tree has as many links and blocks as such pairs, and one, so have its orbits, and

    chains = chains with a link pointed out + chains with a block pointed out - chains with a block at a link.

Exponents are (links - 1, mobility, joints of each higher mobility): all add up when chains are joined at a link.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from fractions import Fraction
from functools import lru_cache
from itertools import product
from math import comb
from operator import le, sub

from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis.families import chain_families, chain_joints, rings
from graphsynth.synthesis.fractionated import Higher, blocks_of
from graphsynth.synthesis.units import count_unit, cut

Exponents = tuple[int, ...]
Series = dict[Exponents, int]
Cycles = tuple[tuple[int, int], ...]
"""Numbers of cycles of a permutation: (length, cycles)."""


def count_fractionated(links: int, mobility: int, space: int, higher: Higher, framed: bool = False) -> int:
    """Count the fractionated chains without loose ends and without rigid sub-chains (with every frame, if ``framed``).

    >>> count_fractionated(7, 2, 3, ()), count_fractionated(9, 2, 3, ())
    (1, 5)
    """
    return _Joined(space, tuple(i for i, _ in higher), (links - 1, mobility, *(n for _, n in higher))).count(framed)


@lru_cache(maxsize=1024)
def _rooted(links: int, mobility: int, space: int, higher: Higher) -> int:
    """Count the blocks with one link pointed out."""
    content = dict(higher)
    families = chain_families(links, mobility, space, content, True)
    return sum(map(count_unit, cut(families, listing=False))) + sum(
        1 for _ in rings(links, mobility, space, content, True)
    )


@lru_cache(maxsize=1024)
def _symmetries(links: int, mobility: int, space: int, higher: Higher) -> tuple[tuple[Cycles, Fraction], ...]:
    """Count the automorphisms of all blocks by their cycles, each block with weight 1 over the order of its group."""
    found: defaultdict[Cycles, Fraction] = defaultdict(Fraction)
    for block in blocks_of(links, mobility, space, higher):
        share = Fraction(1, block.automorphism_order)
        for cycles, count in Counter(map(_cycles, _group(block))).items():
            found[cycles] += share * count
    return tuple(found.items())


def _group(graph: MechanismGraph) -> set[bytes]:
    """Return all automorphisms, each as the bytes of the images."""
    tail = bytes(range(graph.links, 256))
    generators = [bytes(generator) + tail for generator in graph.labelling.generators]
    found = waiting = {bytes(range(graph.links))}
    while waiting:
        waiting = {element.translate(generator) for element in waiting for generator in generators} - found
        found = found | waiting
    return found


def _cycles(permutation: bytes) -> Cycles:
    lengths: Counter[int] = Counter()
    left = set(range(len(permutation)))
    while left:
        at, length = left.pop(), 1
        while (at := permutation[at]) in left:
            left.remove(at)
            length += 1
        lengths[length] += 1
    return tuple(sorted(lengths.items()))


class _Joined:
    """Series of everything that can hang at a link, up to the exponents ``goal`` of the whole chain."""

    def __init__(self, space: int, kinds: tuple[int, ...], goal: Exponents) -> None:
        self.space, self.kinds, self.goal = space, kinds, goal
        self._hanging: Series = {}  # parts that hang at a link by one block
        self._sets: Series = {(0,) * len(goal): 1}  # sets of such parts
        self._known: dict[tuple[int, Exponents], int] = {}

    def count(self, framed: bool) -> int:
        for exponents in _up_to(self.goal):  # ascending numbers of links
            if self._loops(_minus(self.goal, exponents)) > 0:  # the rest has another leaf of the tree, no loose end
                self._hang(exponents)
        several = self._sets.get(self.goal, 0)
        if framed:  # one block at the frame: not a single joint, which would leave the frame a loose end
            return several + self._at_one_block(self.goal, pointed=True, least=2)
        pairs = sum(n * self._sets.get(_minus(self.goal, e), 0) for e, n in self._hanging.items())
        return several - pairs + self._at_one_block(self.goal, pointed=False)

    def _hang(self, exponents: Exponents) -> None:
        """Complete the series by the parts with the given exponents."""
        if self._loops(exponents) < 1:  # all single joints: loose ends
            return
        number = self._at_one_block(exponents, pointed=True) + _rooted(*self._numbers(exponents))
        if not number:
            return
        self._hanging[exponents] = number
        before = dict(self._sets)
        for times in range(1, min(top // e for top, e in zip(self.goal, exponents) if e) + 1):
            ways = comb(number + times - 1, times)
            for base, n in before.items():
                total = tuple(b + times * e for b, e in zip(base, exponents))
                if all(map(le, total, self.goal)):
                    self._sets[total] = self._sets.get(total, 0) + ways * n

    def _numbers(self, exponents: Exponents) -> tuple[int, int, int, Higher]:
        return exponents[0] + 1, exponents[1], self.space, tuple((i, n) for i, n in zip(self.kinds, exponents[2:]) if n)

    def _loops(self, exponents: Exponents) -> int:
        """Return the number of loops of what has these exponents: 0 for single joints, negative if there is nothing."""
        if not (exponents[0] and exponents[1]):
            return -1
        links, mobility, space, higher = self._numbers(exponents)
        lower = chain_joints(links, mobility, space, dict(higher))
        return -1 if lower is None else lower + sum(n for _, n in higher) - exponents[0]

    def _at_one_block(self, exponents: Exponents, *, pointed: bool, least: int = 1) -> int:
        """Count what consists of one block, pointed out, and parts that hang at its links, at least one.

        With ``pointed`` one link of the block is pointed out too, and nothing hangs there.
        """
        total = Fraction(0)
        for rest, sets in self._sets.items():
            own = _minus(exponents, rest)
            if not any(rest) or min(own) < 0 or own[0] < least or self._loops(own) < (own[0] > 1):
                continue
            numbers = self._numbers(own)
            if not pointed and own[0] > 1 and not self._divided(2, rest):
                total += _rooted(*numbers) * sets
                continue
            for cycles, weight in _symmetries(*numbers):
                fixed = dict(cycles).get(1, 0) if pointed else 1
                if fixed:
                    free = tuple((length, n - (pointed and length == 1)) for length, n in cycles)
                    total += weight * fixed * self._distributed(free, rest, own[0] == 1)
        return int(total)

    def _distributed(self, cycles: Cycles, rest: Exponents, everywhere: bool) -> int:
        """Count the distributions of sets of parts over links that a permutation with given cycles keeps."""
        if not cycles:
            return int(not any(rest))
        (length, number), others = cycles[0], cycles[1:]
        total = 0
        for part in _up_to(tuple(e // length for e in rest)):
            left = _minus(rest, tuple(length * e for e in part))
            for used in range(number if everywhere else 0, min(number, part[1]) + 1):
                if sets := self._divided(used, part):
                    total += comb(number, used) * sets * self._distributed(others, left, everywhere)
        return total

    def _divided(self, number: int, rest: Exponents) -> int:
        """Count the ways to divide the exponents between so many links, none of them empty."""
        if number == 0:
            return int(not any(rest))
        if (number, rest) not in self._known:
            self._known[number, rest] = sum(
                n * self._divided(number - 1, _minus(rest, own))
                for own in _up_to(rest)
                if any(own) and (n := self._sets.get(own, 0))
            )
        return self._known[number, rest]


def _up_to(limit: Exponents) -> Iterator[Exponents]:
    return product(*(range(top + 1) for top in limit))


def _minus(one: Exponents, other: Exponents) -> Exponents:
    return tuple(map(sub, one, other))
