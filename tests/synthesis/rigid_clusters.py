"""Chains counted without contracted graphs, labels or critical sets: permutations of links, and rigid clusters.

A second way to count, from the definition: DOF(S) = Pi (|S| - 1) - (Pi - 1) (joints inside S) >= 1 for every set S of
two or more links.  Any graph falls apart in one way only into its largest rigid clusters and, each cluster drawn
together to one vertex, a graph without rigid sets.  So graphs without rigid sets are all graphs less those that have
clusters.  The lemma of Burnside is used on the permutations of the links: one that keeps a graph permutes its clusters.

`python tests/synthesis/rigid_clusters.py 20 FILE` counts the chains of 20 links and goes on where it was stopped; a
last argument 3/64 makes it do that part of the work.

An *orbit* (c, cycles) stands for c clusters that a permutation p takes one to the next, p ** c permuting the links of
each by cycles of these lengths; a *state* is a sorted tuple of orbits.  Polynomials are in the number of joints.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator
from fractions import Fraction
from itertools import combinations, product
from math import comb, factorial, gcd, lcm, prod
from pathlib import Path

Cycles = tuple[int, ...]
Orbit = tuple[int, Cycles]
State = tuple[Orbit, ...]


class Clusters:
    """All counts for graphs with so many links and at most so many joints in a space of mobility Pi.

    A polynomial is one integer, its value at 2 ** digits: no coefficient counts more graphs than there are.
    """

    def __init__(self, links: int, most: int, space: int = 3) -> None:
        self.links, self.most, self.space = links, most, space
        self.digits = comb(comb(links, 2), min(most, comb(links, 2) // 2)).bit_length() + 1
        self.mask = (1 << self.digits * (most + 1)) - 1
        self.known: dict[State, tuple[int, int]] = {}
        self.known_drawn: dict[State, dict[State, int]] = {}

    def forget(self) -> None:
        """Keep what is small, which all permutations need, and give the memory of the rest back."""
        self.known, self.known_drawn = (
            {state: own for state, own in kept.items() if links_of(state) <= self.links // 2}
            for kept in (self.known, self.known_drawn)
        )

    def coefficient(self, polynomial: int, joints: int) -> int:
        return polynomial >> self.digits * joints & ((1 << self.digits) - 1)

    def spread(self, polynomial: int, c: int) -> int:
        """Write the c-th power of the variable for the variable."""
        if c == 1:
            return polynomial
        return sum(self.coefficient(polynomial, i) << self.digits * i * c for i in range(self.most // c + 1))

    def all(self, state: State) -> int:
        """Count the graphs that the permutation keeps, with joints between different clusters only."""
        joints = pair_orbits([c * length for c, cycles in state for length in cycles])
        for c, cycles in state:
            for length, count in pair_orbits(cycles).items():
                joints[c * length] -= count
        found = 1
        for length, count in joints.items():
            choices = range(min(count, self.most // length) + 1)
            found = found * sum(comb(count, i) << self.digits * i * length for i in choices) & self.mask
        return found

    def split(self, state: State) -> tuple[int, int]:
        """Return (graphs without rigid sets of clusters, graphs that are one rigid cluster)."""
        if state not in self.known:
            size = sum(c for c, _ in state)
            left = self.all(state)
            for drawn, ways in self.drawn(state).items() if size > 1 else ():
                if drawn != state:
                    left -= ways * self.split(drawn)[0] & self.mask
            bound = (self.space * (size - 1) - 1) // (self.space - 1) + 1  # fewer joints leave a DOF of 1 or more
            free = left & ((1 << self.digits * bound) - 1)
            self.known[state] = (free, left - free) if size > 1 else (1, 1)
        return self.known[state]

    def drawn(self, state: State) -> dict[State, int]:
        """Count the ways to draw clusters together to rigid ones, but not all to one, by what they become."""
        if state in self.known_drawn:
            return self.known_drawn[state]
        found: dict[State, int] = {}
        for c, block, others, choices in first_blocks(state):
            all_in_one = c == 1 and not others and sum(size for size, _ in block) > 1
            if all_in_one or not (rigid := self.split(block)[1]):
                continue
            rigid = choices * self.spread(rigid, c)
            new = c, drawn_together(block)
            for drawn, ways in self.drawn_at_will(others):
                key = tuple(sorted((*drawn, new)))
                found[key] = found.get(key, 0) + (rigid * ways & self.mask)
        if links_of(state) < self.links:  # one of all links is asked for once
            self.known_drawn[state] = found
        return found

    def drawn_at_will(self, state: State) -> Iterator[tuple[State, int]]:
        """Yield the same, all drawn to one included."""
        if not state:
            yield (), 1
            return
        yield from self.drawn(state).items()
        if sum(c for c, _ in state) > 1 and (rigid := self.split(state)[1]):
            yield ((1, drawn_together(state)),), rigid


def links_of(state: State) -> int:
    return sum(c * sum(cycles) for c, cycles in state)


def drawn_together(block: State) -> Cycles:
    return tuple(sorted(c * length for c, cycles in block for length in cycles))


def first_blocks(state: State) -> Iterator[tuple[int, State, State, int]]:
    """Yield what may be drawn together with the first orbit: (orbit's length, inside one cluster, others, choices)."""
    first = max(state, key=lambda orbit: (links_of((orbit,)), orbit))  # so that the others are few
    at = state.index(first)
    rest = state[:at] + state[at + 1 :]
    kinds = sorted(set(rest))
    numbers = [rest.count(kind) for kind in kinds]
    for c in (d for d in range(1, first[0] + 1) if first[0] % d == 0):
        ranges = [range(number + 1 if kind[0] % c == 0 else 1) for kind, number in zip(kinds, numbers)]
        for taken in product(*ranges):
            chosen = [first, *(kind for kind, count in zip(kinds, taken) for _ in range(count))]
            block = tuple(sorted((size // c, cycles) for size, cycles in chosen))
            others = tuple(kind for kind, n, count in zip(kinds, numbers, taken) for _ in range(n - count))
            yield c, block, others, prod(map(comb, numbers, taken)) * c ** (len(chosen) - 1)


def pair_orbits(cycles: Cycles | list[int]) -> Counter[int]:
    """Count the orbits of pairs of points under a permutation, by their length."""
    found: Counter[int] = Counter()
    for n in cycles:
        found[n] += (n - 1) // 2
        if n % 2 == 0:
            found[n // 2] += 1
    for a, b in combinations(cycles, 2):
        found[lcm(a, b)] += gcd(a, b)
    return found


def partitions(n: int, largest: int) -> Iterator[Cycles]:
    if n == 0:
        yield ()
    for first in range(min(n, largest), 0, -1):
        for rest in partitions(n - first, first):
            yield (first, *rest)


def joints_of(links: int, space: int) -> int:
    """Return the number of joints of mobility 1 of a chain of mobility 1."""
    joints, rest = divmod(space * (links - 1) - 1, space - 1)
    assert rest == 0
    return joints


def labelled_chains(links: int, space: int = 3) -> int:
    """Count the chains of mobility 1 whose links are told apart."""
    joints = joints_of(links, space)
    clusters = Clusters(links, joints, space)
    return clusters.coefficient(clusters.split(((1, (1,)),) * links)[0], joints)


def kept_by(clusters: Clusters, cycles: Cycles) -> int:
    """Count the labelled chains of mobility 1 that a permutation with these cycles keeps."""
    return clusters.coefficient(all_kept_by(clusters, cycles), joints_of(clusters.links, clusters.space))


def all_kept_by(clusters: Clusters, cycles: Cycles) -> int:
    """Return the polynomial of the labelled graphs without rigid sets that it keeps, by numbers of joints."""
    return clusters.split(tuple(sorted((length, (1,)) for length in cycles)))[0]


def centraliser(cycles: Cycles) -> int:
    """Return how many permutations commute with one: all there are, over those with its cycles."""
    return prod(cycles) * prod(factorial(count) for count in Counter(cycles).values())


def power(cycles: Cycles, n: int) -> Cycles:
    return tuple(sorted((c // gcd(c, n) for c in cycles for _ in range(gcd(c, n))), reverse=True))


def mean(kept: dict[Cycles, int]) -> int:
    """Return the lemma of Burnside's sum: the mean over all permutations, by their cycles."""
    total = sum(Fraction(count, centraliser(cycles)) for cycles, count in kept.items())
    assert total.denominator == 1
    return int(total)


def chains(links: int, space: int = 3) -> int:
    """Count the chains of mobility 1 up to isomorphism."""
    clusters = Clusters(links, joints_of(links, space), space)
    return mean({cycles: kept_by(clusters, cycles) for cycles in partitions(links, links)})


Terms = dict[Cycles, dict[int, Fraction]]
"""A cycle index: for each partition, by numbers of joints."""


def with_fractionated(links: int, mobility: int, space: int = 3) -> int:
    """Count the chains of any mobility up to isomorphism, fractionated ones included.

    These are the connected graphs without rigid sets that have no loose end.  All graphs are sets of connected ones; a
    connected one that is no tree is a chain at whose links rooted trees hang, and has as many loops as the chain.  In
    cycle indices trees are taken off by p_k -> p_k exp(-sum p_kj / j), which for p_k = x ** k is x ** k - x ** 2k.
    """
    joints, rest = divmod(space * (links - 1) - mobility, space - 1)
    if rest:
        return 0
    clusters = Clusters(links, joints, space)
    total = Fraction(0)
    for cycles, by_joints in connected(clusters, links).items():
        loops_alike = by_joints.get(sum(cycles) + joints - links, Fraction(0))
        total += loops_alike * without_trees(cycles, links)
    assert total.denominator == 1
    return int(total)


def without_trees(cycles: Cycles, links: int) -> int:
    """Return the coefficient of x ** links in the product of x ** k - x ** 2k."""
    ways = Counter({0: 1})
    for k in cycles:
        fresh: Counter[int] = Counter()
        for size, count in ways.items():
            fresh[size + k] += count
            fresh[size + 2 * k] -= count
        ways = fresh
    return ways[links]


def connected(clusters: Clusters, links: int) -> Terms:
    """Return the cycle index of connected graphs without rigid sets: the logarithm, and Moebius inversion."""
    every: list[Terms] = [{}]
    for n in range(1, links + 1):
        terms: Terms = {}
        for cycles in partitions(n, n):
            polynomial, order = all_kept_by(clusters, cycles), centraliser(cycles)
            numbers = ((i, clusters.coefficient(polynomial, i)) for i in range(clusters.most + 1))
            terms[tuple(sorted(cycles))] = {i: Fraction(count, order) for i, count in numbers if count}
        every.append(terms)
    logarithm: list[Terms] = [{}]
    for n in range(1, links + 1):  # n L_n = n G_n - sum of k L_k G_(n - k)
        left: Terms = {cycles: dict(own) for cycles, own in every[n].items()}
        for k in range(1, n):
            for one, mine in logarithm[k].items():
                for other, yours in every[n - k].items():
                    own = left.setdefault(tuple(sorted(one + other)), {})
                    for i, a in mine.items():
                        for j, b in yours.items():
                            if i + j <= clusters.most:
                                own[i + j] = own.get(i + j, Fraction(0)) - a * b * Fraction(k, n)
        logarithm.append(left)
    found: Terms = {}
    for power, sign in enumerate((1, -1, -1, 0, -1, 1, -1, 0, 0, 1, -1, 0, -1, 1), 1):  # the Moebius function
        for n in range(1, links // power + 1 if sign else 0):
            for cycles, mine in logarithm[n].items():
                own = found.setdefault(tuple(power * length for length in cycles), {})
                for i, a in mine.items():
                    own[i * power] = own.get(i * power, Fraction(0)) + a * Fraction(sign, power)
    return found


def read(path: Path) -> dict[Cycles, int]:
    """Read what `main` has written."""
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    pairs = [line.split(": ") for line in lines if ": " in line and line.endswith("\n")]  # the last may be cut short
    return {tuple(map(int, cycles.split())): int(count) for cycles, count in pairs}


def _line(cycles: Cycles, count: int) -> str:
    return f"{' '.join(map(str, cycles))}: {count}\n"


def main(links: int, path: Path, shard: str = "1/1") -> None:
    """Write for each kind of permutation how many labelled chains it keeps; all there, print the number of chains.

    Shard i/m does every m-th kind from the i-th on; the files of all, joined, are a file that a last call goes on with.
    """
    first, step = map(int, shard.split("/"))
    kept = read(path) if path.exists() else {}
    path.write_text("".join(_line(cycles, count) for cycles, count in kept.items()), encoding="utf-8")
    clusters = Clusters(links, joints_of(links, 3))
    kinds = [*partitions(links, links)][::-1]  # powers of a permutation come before it
    for cycles in kinds[first - 1 :: step]:
        if cycles not in kept:
            divisors = [n for n in range(2, max(cycles) + 1) if any(c % n == 0 for c in cycles)]
            none = any(kept.get(power(cycles, n)) == 0 for n in divisors)  # its powers keep what it keeps
            kept[cycles] = 0 if none else kept_by(clusters, cycles)
            clusters.forget()
            with path.open("a", encoding="utf-8") as stream:
                stream.write(_line(cycles, kept[cycles]))
    if len(kept) == len(kinds):
        print(mean(kept))


if __name__ == "__main__":
    main(int(sys.argv[1]), Path(sys.argv[2]), *sys.argv[3:])
