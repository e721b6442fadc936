"""Chains by brute force: every simple graph, every subset of links, networkx for isomorphism.

Nothing here uses graphsynth.  The definitions are those of catalog/counts/README.md, read literally:
a set S of links has DOF(S) = Pi (|S| - 1) - sum over joints inside S of (Pi - f).
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from functools import cache
from itertools import combinations, permutations

import networkx as nx
from networkx.algorithms.isomorphism import GraphMatcher

Coloured = tuple[tuple[int, int, int], ...]  # joints (a, b, mobility), a < b, sorted


def worst_subset(links: int, joints: Iterable[tuple[int, int, int]], space: int, *, proper: bool = False) -> int:
    """Return the smallest DOF of a set of two or more links (of fewer than all, if ``proper``)."""
    inside = [(1 << a | 1 << b, space - f) for a, b, f in joints]
    full = (1 << links) - 1
    return min(
        space * (mask.bit_count() - 1) - sum(lost for pair, lost in inside if pair & mask == pair)
        for mask in range(3, full + 1 - proper)
        if mask.bit_count() >= 2
    )


def mobility(links: int, joints: Iterable[tuple[int, int, int]], space: int) -> int:
    return space * (links - 1) - sum(space - f for _, _, f in joints)


@cache
def graphs(links: int, joints: int) -> tuple[nx.Graph, ...]:
    """Return all simple graphs with minimum degree 2, connected, up to isomorphism (networkx atlas: seven links)."""
    assert links <= 7
    return tuple(
        nx.convert_node_labels_to_integers(g)
        for g in nx.graph_atlas_g()
        if len(g) == links and g.size() == joints and nx.is_connected(g) and min(d for _, d in g.degree()) >= 2
    )


def _signature(g: nx.Graph) -> tuple[object, ...]:
    """An isomorphism invariant: degrees, neighbours' degrees, distances."""
    lengths = dict(nx.all_pairs_shortest_path_length(g))
    return tuple(
        sorted((g.degree(v), tuple(sorted(g.degree(w) for w in g[v])), tuple(sorted(lengths[v].values()))) for v in g)
    )


@cache
def sparse_graphs(links: int, joints: int) -> tuple[nx.Graph, ...]:
    """Return all planar graphs without rigid sub-chain (connected or not), adding one joint at a time.

    Taking a joint away never makes a sub-chain rigid, so every such graph is reached through smaller ones.
    """
    if joints == 0:
        return (nx.empty_graph(links),)
    found: dict[tuple[object, ...], list[nx.Graph]] = defaultdict(list)
    for smaller in sparse_graphs(links, joints - 1):
        for a, b in nx.non_edges(smaller):
            g = smaller.copy()
            g.add_edge(a, b)
            if _tight_around(g, a, b):
                continue
            bucket = found[_signature(g)]
            if not any(nx.is_isomorphic(g, other) for other in bucket):
                bucket.append(g)
    return tuple(g for bucket in found.values() for g in bucket)


def _tight_around(g: nx.Graph, a: int, b: int) -> bool:
    others = [v for v in g if v not in (a, b)]
    return any(
        3 * (size + 1) - 2 * g.subgraph((a, b, *rest)).size() < 1
        for size in range(1, len(others) + 1)
        for rest in combinations(others, size)
    )


def automorphisms(g: nx.Graph) -> list[dict[int, int]]:
    return list(GraphMatcher(g, g).isomorphisms_iter())


def colourings(g: nx.Graph, counts: dict[int, int]) -> Iterator[tuple[int, ...]]:
    """Yield every placement of the joint mobilities on the edges of g, in the order of ``g.edges``."""
    wanted = tuple(sorted(i for i, count in counts.items() for _ in range(count)))
    if len(counts) == 1:
        yield wanted
        return
    low, rest = min(counts), {i: c for i, c in counts.items() if i != min(counts)}
    for places in combinations(range(g.size()), counts[low]):
        others = [e for e in range(g.size()) if e not in places]
        for inner in _arrangements(rest):
            colours = [low] * g.size()
            for place, colour in zip(others, inner, strict=True):
                colours[place] = colour
            yield tuple(colours)


def _arrangements(counts: dict[int, int]) -> Iterator[tuple[int, ...]]:
    yield from set(permutations([i for i, count in counts.items() for _ in range(count)]))


def image(joints: Coloured, frame: int | None, move: dict[int, int]) -> tuple[int, Coloured]:
    moved = sorted((*sorted((move[a], move[b])), f) for a, b, f in joints)
    return (-1 if frame is None else move[frame], tuple(moved))


Census = dict[tuple[int, int, Coloured], int]
"""(number of the underlying graph, frame, joints), smallest of its orbit -> order of its automorphism group."""


def census(
    underlying: Iterable[nx.Graph],
    counts: dict[int, int],
    space: int,
    *,
    least: int = 1,
    proper: bool = False,
    framed: bool = False,
    fractionated: bool = False,
) -> Census:
    """Place mobilities and frame on every graph in every way, keep the admissible, one from each orbit."""
    found: Census = {}
    for number, g in enumerate(underlying):
        if not fractionated and len(g) > 2 and not nx.is_biconnected(g):
            continue
        moves = automorphisms(g)
        pairs = [tuple(sorted(e)) for e in g.edges]
        seen: set[tuple[int, Coloured]] = set()
        for colours in colourings(g, counts):
            joints = tuple(sorted((a, b, f) for (a, b), f in zip(pairs, colours, strict=True)))
            plain = image(joints, None, {v: v for v in g})
            if plain in seen:
                continue
            orbit = Counter(image(joints, None, move) for move in moves)
            seen.update(orbit)
            if worst_subset(len(g), joints, space, proper=proper) < least:
                continue
            for frame in list(g) if framed else [None]:
                images = Counter(image(joints, frame, move) for move in moves)
                smallest = min(images)
                found[number, *smallest] = images[smallest]
    return found


class Identifier:
    """Finds the entry of a census that a given graph is isomorphic to."""

    def __init__(self, underlying: Iterable[nx.Graph]) -> None:
        self.buckets: dict[tuple[object, ...], list[tuple[int, nx.Graph, list[dict[int, int]]]]] = defaultdict(list)
        for number, g in enumerate(underlying):
            self.buckets[_signature(g)].append((number, g, automorphisms(g)))

    def __call__(
        self, links: int, joints: Iterable[tuple[int, int, int]], frame: int | None
    ) -> tuple[int, int, Coloured]:
        joints = tuple(joints)
        g = nx.empty_graph(links)
        g.add_edges_from((a, b) for a, b, _ in joints)
        for number, other, moves in self.buckets[_signature(g)]:
            matcher = GraphMatcher(g, other)
            if matcher.is_isomorphic():
                there = image(joints, frame, matcher.mapping)
                start = None if frame is None else there[0]
                return (number, *min(image(there[1], start, move) for move in moves))
        raise AssertionError(f"not among the underlying graphs: {joints}")


def labelled_count(links: int, joints: int) -> int:
    """Count labelled 2-connected planar chains without rigid sub-chain by trying all joint sets."""
    pairs = list(combinations(range(links), 2))
    total = 0
    degree = [0] * links

    def extend(at: int, chosen: list[tuple[int, int]]) -> None:
        nonlocal total
        if len(chosen) == joints:
            g = nx.Graph(chosen)
            total += min(degree) >= 2 and len(g) == links and nx.is_biconnected(g)
            return
        for i in range(at, len(pairs) - (joints - len(chosen)) + 1):
            a, b = pairs[i]
            if a > 0 and degree[a - 1] < 2:
                return  # all pairs of link a - 1 are past
            chosen.append((a, b))
            degree[a] += 1
            degree[b] += 1
            if _loose(chosen, a, b, links):
                extend(i + 1, chosen)
            chosen.pop()
            degree[a] -= 1
            degree[b] -= 1

    extend(0, [])
    return total


def _loose(chosen: list[tuple[int, int]], a: int, b: int, links: int) -> bool:
    masks = [1 << x | 1 << y for x, y in chosen]
    pair = 1 << a | 1 << b
    rest = [1 << v for v in range(links) if v not in (a, b)]
    for bits in range(1 << len(rest)):
        mask = pair
        for i, bit in enumerate(rest):
            if bits >> i & 1:
                mask |= bit
        if 3 * (mask.bit_count() - 1) - 2 * sum(m & mask == m for m in masks) < 1:
            return False
    return True
