"""Symmetries of trees of axes and what they keep, by trying everything; and all outcomes of a draw, with chances."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import combinations, permutations
from random import Random
from typing import Any


def symmetries(tree: Any) -> list[tuple[int, ...]]:
    """Return every permutation of the links that keeps which of them share an axis."""
    joined = {frozenset(joint[:2]) for joint in tree.joints}
    moves = permutations(range(tree.links))
    return [move for move in moves if all(frozenset((move[a], move[b])) in joined for a, b in joined)]


def possible_pairs(tree: Any) -> list[frozenset[int]]:
    """Return the pairs of links on different axes that share an axis each with a third link."""
    joined = {frozenset(joint[:2]) for joint in tree.joints}
    ends = map(frozenset, combinations(range(tree.links), 2))
    near = [p for p in ends if p not in joined]
    return [p for p in near if any(all(frozenset((x, c)) in joined for x in p) for c in range(tree.links))]


def kept_choices(tree: Any, gears: int, move: tuple[int, ...]) -> list[frozenset[frozenset[int]]]:
    """Return the sets of so many possible gear pairs that a symmetry keeps."""
    every = map(frozenset, combinations(possible_pairs(tree), gears))
    return [chosen for chosen in every if {frozenset(move[x] for x in pair) for pair in chosen} == chosen]


def kept_roles(tree: Any, roles: int, move: tuple[int, ...]) -> int:
    """Count the frames (1) that it keeps, or those with input and output on their axes (2) or all on one axis (3)."""
    if roles == 0:
        return 1
    still = [x for x in range(tree.links) if move[x] == x]
    joined = {frozenset(joint[:2]) for joint in tree.joints}

    def near(a: int, b: int) -> bool:
        return frozenset((a, b)) in joined

    ways = [way for way in permutations(still, 3) if near(way[0], way[1]) and near(way[0], way[2])]
    return len(still) if roles == 1 else sum(roles == 2 or near(a, b) for _, a, b in ways)


def weights(tree: Any, gears: int, roles: int) -> Counter[tuple[int, ...]]:
    """Count, for each symmetry, the gear pairs and roles that it keeps."""
    found = {move: len(kept_choices(tree, gears, move)) * kept_roles(tree, roles, move) for move in symmetries(tree)}
    return +Counter(found)


class _Script(Random):
    """Gives the numbers of a script, and 0 after its end."""

    def __init__(self, script: list[int]) -> None:
        super().__init__(0)
        self.script, self.sizes = script, list[int]()

    def randrange(self, size: int) -> int:  # type: ignore[override]
        if len(self.sizes) == len(self.script):
            self.script.append(0)
        self.sizes.append(size)
        return self.script[len(self.sizes) - 1]

    def choice(self, some: Any) -> Any:
        return some[self.randrange(len(some))]


def every_draw(draw: Callable[[Random], Any]) -> Iterator[tuple[Any, Fraction]]:
    """Yield what a draw gives for every way its numbers can fall, with the chance of that way."""
    script: list[int] = []
    while True:
        random, chance = _Script(script), Fraction(1)
        found = draw(random)
        for size in random.sizes:
            chance /= size
        yield found, chance
        while script and script[-1] + 1 == random.sizes[len(script) - 1]:
            script.pop()
        if not script:
            return
        script[-1] += 1
