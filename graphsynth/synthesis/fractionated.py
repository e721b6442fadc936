"""Chains that are few enough to be made one by one, rings and fractionated chains; to count, most need not be made.

A fractionated chain falls apart at a link or at a joint, each part with a mobility of its own.  It is a tree of blocks:
non-fractionated chains, and single joints between two links.  Its mobility is the sum of the mobilities of the blocks,
and it has a rigid sub-chain exactly when a block has one.  Chains grow by gluing one block at a link of a smaller
chain.  A chain is kept only when the block just glued is equivalent to its canonical leaf block, so each chain arises
from one parent only and nothing has to be remembered (canonical augmentation, [McKay 1998]).

They are counted by arithmetic on counts of their blocks.  Chains in which a link, a block, or a block at a link is
pointed out are counted by formal power series, the symmetries of blocks by the lemma of Burnside; since every tree has
as many links and blocks as such pairs, and one, so have its orbits, and

    chains = chains with a link pointed out + chains with a block pointed out - chains with a block at a link.

Exponents are (links - 1, mobility, joints of each higher mobility): all add up when chains are joined at a link.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from itertools import product
from math import comb
from operator import le, sub
from typing import TYPE_CHECKING

import numpy as np

from graphsynth.structure.connectivity import bits, components_of
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.kernels import canon_packed
from graphsynth.structure.slider_chains import SliderChain
from graphsynth.synthesis.chunks import cut
from graphsynth.synthesis.edge_labels import SLIDER
from graphsynth.synthesis.families import Levels, chain_families, chain_joints, rings
from graphsynth.synthesis.kernels.counting import COUNTING, MAKING
from graphsynth.synthesis.made import EACH, Made

if TYPE_CHECKING:
    from graphsynth.structure.system.assortment import LinkAssortment
    from graphsynth.synthesis.wishes import Wishes

Higher = tuple[tuple[int, int], ...]
Exponents = tuple[int, ...]
Series = dict[Exponents, int]
Cycles = tuple[tuple[int, int], ...]
"""Numbers of cycles of a permutation: (length, cycles)."""
_EFFORT = 10.0  # work of a chain that is made one by one, in chains of a catalogue


@dataclass(frozen=True)
class OneByOne(Made):
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
    rules: int = field(default=0, repr=False)  # of prismatic joints, which are among ``higher``
    wishes: Wishes | None = field(default=None, repr=False)

    def graphs(self) -> Iterator[MechanismGraph]:
        """Yield the graphs."""
        for graph in self._all():
            if self.symmetry and graph.automorphism_order % self.symmetry:  # Cauchy: p divides the order of the group
                continue
            if self._fits(graph) and (self.wishes is None or self.wishes.fit(self.chain(graph))):
                yield graph

    def chain(self, graph: MechanismGraph) -> MechanismGraph | SliderChain:
        """Return what a graph stands for."""
        return SliderChain(graph) if SLIDER in dict(self.higher) else graph

    def work(self, purpose: int) -> float:
        """Estimate the work; of a catalogue, the number of chains."""
        if self.kind == "rings" or (purpose == COUNTING and not self.restricted):
            return _EFFORT if purpose == MAKING else 100.0
        count = count_fractionated(self.links, self.mobility, self.space, self.higher, self.framed)
        return _EFFORT * (1 + count) if purpose == MAKING else 100.0 + EACH * count

    @property
    def restricted(self) -> bool:
        """Whether only some of the chains are wanted."""
        return bool(self.assortment or self.levels or self.symmetry or self.wishes)

    def count(self) -> int:
        """Count the graphs; fractionated chains without any restriction are not made."""
        if self.kind == "fractionated" and not self.restricted:
            return count_fractionated(self.links, self.mobility, self.space, self.higher, self.framed)
        return sum(1 for _ in self.graphs())

    def _all(self) -> Iterator[MechanismGraph]:
        if self.kind == "rings":
            yield from rings(self.links, self.mobility, self.space, dict(self.higher), self.framed, self.rules)
            return
        for chain in fractionated_chains(self.links, self.mobility, self.space, self.higher):
            for graph in chain.inversions() if self.framed else ():
                order = [link for level in graph.levels for link in sorted(level)]
                yield graph.relabelled([order.index(link) for link in range(graph.links)])
            if not self.framed:
                yield chain

    def _fits(self, graph: MechanismGraph) -> bool:
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


@lru_cache(maxsize=512)
def blocks_of(links: int, mobility: int, space: int, higher: Higher) -> tuple[MechanismGraph, ...]:
    """List the blocks with given numbers: non-fractionated chains, or a single joint."""
    content = dict(higher)
    found = list(rings(links, mobility, space, content, False))
    for chunk in cut(chain_families(links, mobility, space, content, False), listing=True):
        found += chunk.graphs()
    return tuple(found)


def _shares(higher: Higher) -> Iterator[tuple[Higher, Higher]]:
    """Yield every way to divide the higher pairs between two parts."""
    if not higher:
        yield (), ()
        return
    (i, count), rest = higher[0], higher[1:]
    for mine in range(count + 1):
        own = ((i, mine),) if mine else ()
        other = ((i, count - mine),) if mine < count else ()
        for a, b in _shares(rest):
            yield own + a, other + b


def _glued(parent: MechanismGraph, at: int, block: MechanismGraph, link: int) -> MechanismGraph | None:
    """Identify a link of the block with a link of the parent; None unless the block is the chain's canonical leaf."""
    fresh = iter(range(parent.links, parent.links + block.links))
    names = [at if v == link else next(fresh) for v in range(block.links)]
    joints = [*parent.joints, *((names[a], names[b], f) for a, b, f in block.joints)]
    graph = MechanismGraph(parent.links + block.links - 1, joints, space=parent.space)
    own = _marked_form(graph, {name for name in names if name != at})
    everything = (1 << graph.links) - 1
    cuts = sum(1 << v for v in graph.cut_links)
    for cut_link in graph.cut_links:
        for part in components_of(graph.neighbours, everything & ~(1 << cut_link)):
            # a leaf block is what falls off at a cut link and holds no other cut link
            if not part & cuts and _marked_form(graph, set(bits(part))) < own:
                return None
    return graph


def _marked_form(graph: MechanismGraph, marked: set[int]) -> tuple[int, tuple[tuple[int, ...], ...]]:
    """Return a form that is equal for two sets of links exactly when an automorphism maps one to the other."""
    colours = np.array([int(v in marked) for v in range(graph.links)], np.int64)
    order = canon_packed(graph.links, np.frombuffer(graph.packed, np.uint8), colours)[0]
    place = {int(v): i for i, v in enumerate(order)}
    joints = sorted((*sorted((place[a], place[b])), f) for a, b, f in graph.joints)
    # the fewest links first, single joints: a chain without loose ends then has parents with few of them
    return len(marked), tuple(joints)


@lru_cache(maxsize=512)
def _trees(links: int, mobility: int, space: int, higher: Higher) -> tuple[MechanismGraph, ...]:
    """List the connected chains of blocks, loose ends (single joints as leaf blocks) included."""
    found = list(blocks_of(links, mobility, space, higher))
    for block_links in range(2, links):
        for block_mobility in range(1, mobility):
            for own, other in _shares(higher):
                blocks = blocks_of(block_links, block_mobility, space, own)
                if not blocks:
                    continue
                for parent in _trees(links - block_links + 1, mobility - block_mobility, space, other):
                    for block in blocks:
                        pairs = product(parent.orbits, block.orbits)
                        chains = (_glued(parent, at, block, link) for (at, *_), (link, *_) in pairs)
                        found += [graph for graph in chains if graph is not None]
    return tuple(found)


def fractionated_chains(links: int, mobility: int, space: int, higher: Higher) -> Iterator[MechanismGraph]:
    """Yield the fractionated chains without loose ends and without rigid sub-chains, each once.

    >>> sum(1 for _ in fractionated_chains(7, 2, 3, ()))
    1
    """
    for graph in _trees(links, mobility, space, higher):
        if graph.is_fractionated and min(graph.degrees) >= 2:
            yield graph


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
    return sum(chunk.count() for chunk in cut(families, listing=False)) + sum(
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
        links, mobility, space, higher = self._numbers(exponents)
        lower = chain_joints(links, mobility, space, dict(higher)) if mobility else None
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
        return total.numerator  # of a whole number

    def _distributed(self, cycles: Cycles, rest: Exponents, everywhere: bool) -> int:
        """Count the distributions of sets of parts over links that a permutation with given cycles keeps."""
        if not cycles:
            return int(not any(rest))
        (length, number), others = cycles[0], cycles[1:]
        total = 0
        for part in _up_to(tuple(e // length for e in rest)):
            left = _minus(rest, tuple(length * e for e in part))
            for used in range(number if everywhere else 0, number + 1):
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
