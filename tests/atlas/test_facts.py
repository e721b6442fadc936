"""Facts of chains against the graph class, one chain at a time, and published counts."""

import numpy as np
import pytest

from graphsynth import count_assur_groups, enumerate_chains
from graphsynth.atlas.facts import analyse_block, chain_facts, group_graph
from graphsynth.structure.assur import decompose


def facts_of(links):
    chains = list(enumerate_chains(links))
    packed = np.array([np.frombuffer(chain.packed, np.uint8) for chain in chains])
    return chains, list(chain_facts(analyse_block(links, packed), 1))


@pytest.mark.parametrize("links", [4, 6, 8, 10])
def test_facts_are_those_of_the_graph_class(links):
    chains, facts = facts_of(links)
    smaller = {chain.key for chain in enumerate_chains(links - 2)} if links > 4 else set()
    for chain, found in zip(chains, facts, strict=True):
        own = chain.canonical()
        assert found.key == chain.key
        assert found.graph6 == own.graph6()
        assert found.automorphisms == chain.automorphism_order
        assert found.girth == chain.girth
        assert found.orbits == tuple(sorted(tuple(orbit) for orbit in own.orbits))
        assert found.assortment == dict(own.assortment)
        assert found.cut_links == tuple(chain.cut_links)
        assert set(found.parents) <= smaller
        assert set(found.levels) == {orbit[0] for orbit in found.orbits}
        for frame, sizes in found.levels.items():
            assert tuple(map(len, own.with_frame(frame).levels)) == sizes


@pytest.mark.parametrize("links", [4, 6, 8])
def test_groups_are_those_of_the_decomposition(links):
    chains, facts = facts_of(links)
    for chain, found in zip(chains, facts, strict=True):
        own = chain.canonical()
        for frame, driver, groups in found.mechanisms:
            mechanism = own.with_frame(frame)
            moved = 0 if driver == frame else driver + 1 if driver < frame else driver
            expected = decompose(mechanism, [moved]).groups
            assert sorted((len(g.links), g.order) for g in expected) == sorted((size, o) for (size, _), o in groups)


def test_drivers_of_a_mechanism_are_counted_by_brute_force():
    """Orbits of (frame, driver) by applying every automorphism that networkx finds."""
    import networkx as nx

    for links in (6, 8):
        for chain, found in zip(*facts_of(links), strict=True):
            graph = chain.canonical().to_networkx()
            maps = list(nx.isomorphism.GraphMatcher(graph, graph).isomorphisms_iter())
            arcs = [(a, b) for a, b in graph.edges] + [(b, a) for a, b in graph.edges]
            orbits = {min((m[a], m[b]) for m in maps) for a, b in arcs}
            assert len(found.mechanisms) == len(orbits)
            assert {min((m[a], m[b]) for m in maps) for a, b, _ in found.mechanisms} == orbits


def test_every_assur_group_appears():
    """The groups of the mechanisms of up to ten links are all the groups of two to eight links."""
    forms = {
        form
        for links in (4, 6, 8, 10)
        for found in facts_of(links)[1]
        for _, _, groups in found.mechanisms
        for form, _ in groups
    }
    for size in (2, 4, 6, 8):
        own = {group_graph(form).key for form in forms if form[0] == size}
        assert len(own) == count_assur_groups(size)
