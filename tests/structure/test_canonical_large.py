"""Labelling of large graphs with many links alike: a shortcut that changes nothing, and a bound."""

from __future__ import annotations

import time
from math import factorial, prod

import networkx as nx
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.core.errors import TooLargeError
from graphsynth.structure import search
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.search import CanonicalSearch


@st.composite
def blown_up(draw: st.DrawFn) -> tuple[int, list[list[int]], list[int]]:
    """Links of a small graph replaced by sets of links alike, joined among themselves or not; two mobilities."""
    small = draw(st.integers(1, 5))
    sizes = draw(st.lists(st.integers(1, 4), min_size=small, max_size=small))
    place = [k for k, size in enumerate(sizes) for _ in range(size)]
    inside = draw(st.lists(st.integers(0, 2), min_size=small, max_size=small))
    between = {(a, b): draw(st.integers(0, 2)) for b in range(small) for a in range(b)}
    n = len(place)
    order = draw(st.permutations(range(n)))
    layers = [[0] * n, [0] * n]
    for b in range(n):
        for a in range(b):
            p, q = place[a], place[b]
            kind = inside[p] if p == q else between[p, q]
            if kind:
                layers[kind - 1][order[a]] |= 1 << order[b]
                layers[kind - 1][order[b]] |= 1 << order[a]
    colours = [0] * n
    if draw(st.booleans()):
        for v in range(n):
            colours[order[v]] = place[v] % 2
    return n, layers, colours


@settings(max_examples=150)
@given(blown_up())
def test_exchanging_twins_changes_nothing(case: tuple[int, list[list[int]], list[int]]) -> None:
    n, layers, colours = case
    plain = CanonicalSearch(n, layers, colours).run()
    quick = CanonicalSearch(n, layers, colours, twins=True).run()
    assert quick.form == plain.form and quick.order_of_vertices == plain.order_of_vertices
    assert quick.orbits == plain.orbits and prod(quick.index) == prod(plain.index)
    for generator in quick.generators:  # automorphisms, of the colours too
        assert [colours[v] for v in generator] == colours
        for layer in layers:
            for v in range(n):
                image = sum(1 << generator[u] for u in range(n) if layer[v] >> u & 1)
                assert layer[generator[v]] == image
    assert _order(n, quick.generators) == prod(plain.index)


def _order(n: int, generators: list[list[int]]) -> int:
    from sympy.combinatorics import Permutation, PermutationGroup

    return int(PermutationGroup([Permutation(g) for g in generators] or [Permutation(n - 1)]).order())


def _joints(graph: nx.Graph) -> list[tuple[int, int]]:
    return [(min(a, b), max(a, b)) for a, b in graph.edges]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("graph", "order"),
    [
        (nx.complete_graph(255), factorial(255)),
        (nx.empty_graph(255), factorial(255)),
        (nx.star_graph(254), factorial(254)),
        (nx.complete_bipartite_graph(127, 128), factorial(127) * factorial(128)),
        (nx.complete_multipartite_graph(80, 80, 95), factorial(80) ** 2 * 2 * factorial(95)),
    ],
    ids=["complete", "no joints", "star", "bipartite", "tripartite"],
)
def test_the_largest_graphs_of_links_alike_have_a_key(graph: nx.Graph, order: int) -> None:
    links = len(graph)
    one = MechanismGraph(links, _joints(graph))
    begin = time.thread_time()
    key = one.key
    assert time.thread_time() - begin < 5.0
    assert one.automorphism_order == order
    turned = one.relabelled([*range(7, links), *range(7)])
    assert turned.key == key and MechanismGraph.from_key(key).key == key


@pytest.mark.long
def test_a_graph_too_symmetric_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    parts = MechanismGraph(80, [(k, k + 1) for k in range(0, 80, 2)])
    key = parts.key
    monkeypatch.setattr(search, "WORK_MAX", 500_000)
    again = MechanismGraph(80, [(k, k + 1) for k in range(0, 80, 2)])
    with pytest.raises(TooLargeError, match="80 links are too symmetric to be labelled canonically"):
        again.key  # noqa: B018
    monkeypatch.undo()
    assert again.key == key
