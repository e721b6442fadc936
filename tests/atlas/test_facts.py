"""Facts of chains against the graph class, one chain at a time, brute force, and published counts."""

from itertools import combinations

import numpy as np
import pytest

from graphsynth import MechanismGraph, count_assur_groups, enumerate_assur_groups, enumerate_chains
from graphsynth.atlas.facts import Rows, analyse_block, rows_of
from graphsynth.structure.assur import contour_class, decompose, find_fault
from graphsynth.structure.modes import coupler_curve_degree, coupler_curve_genus

FAMILIES = [(4, 1), (6, 1), (8, 1), (5, 2), (7, 2), (9, 2), (6, 3), (8, 3), (7, 4), (9, 4)]


def facts_of(links, mobility):
    chains = list(enumerate_chains(links, mobility, fractionated=mobility > 1))
    packed = np.array([np.frombuffer(chain.packed, np.uint8) for chain in chains])
    rows = Rows()
    rows_of(analyse_block(links, mobility, packed), rows)
    return chains, rows


def moved(driver, frame):
    """Number of a link after with_frame()."""
    return 0 if driver == frame else driver + 1 if driver < frame else driver


@pytest.mark.parametrize(("links", "mobility"), [*FAMILIES, (10, 1), pytest.param(11, 2, marks=pytest.mark.long)])
def test_facts_are_those_of_the_graph_class(links, mobility):
    chains, rows = facts_of(links, mobility)
    own = []
    for at, (chain, found) in enumerate(zip(chains, rows.chains, strict=True)):
        graph = chain.canonical()
        degrees = range(2, max(graph.degrees) + 1)
        assert found[:-1] == (
            chain.key, graph.graph6(), links, len(graph.joints), graph.loops,
            "-".join(str(graph.assortment.get(a, 0)) for a in degrees), chain.automorphism_order,
            " ".join(",".join(map(str, orbit)) for orbit in sorted(graph.orbits)), len(chain.inversions()),
            chain.girth, int(chain.is_fractionated), chain.mobility_type,
        )  # fmt: skip
        for frame in sorted(orbit[0] for orbit in graph.orbits):
            levels = graph.with_frame(frame).levels
            own.append((at, frame, graph.degrees[frame], "-".join(str(len(level)) for level in levels)))
    assert [row[:4] for row in rows.inversions] == own


def test_coupler_curves_are_those_of_the_mechanism_and_left_out_where_they_cost_much():
    for links, mobility in ((6, 1), (8, 1), (10, 1), (7, 2)):
        chains, rows = facts_of(links, mobility)
        for at, frame, _, _, degree, genus, *texts in rows.inversions[:40]:
            if (links, mobility) in ((10, 1), (7, 2)):
                assert (degree, genus, *texts) == (None,) * 4
                continue
            mechanism = chains[at].canonical().with_frame(frame)  # numbers its links anew
            numbers = [moved(link, frame) for link in range(links)]
            for text, most, count in zip(texts, (degree, genus), (coupler_curve_degree, coupler_curve_genus)):
                wanted = [count(mechanism, own) if own else 0 for own in numbers]
                assert text == " ".join(map(str, wanted))
                assert most == max(wanted)


@pytest.mark.parametrize(("links", "mobility"), FAMILIES)
def test_groups_are_those_of_the_decomposition(links, mobility):
    chains, rows = facts_of(links, mobility)
    listed = dict.fromkeys(range(len(chains)), 0)
    every, structures = list(rows.groups), list(rows.structures)
    for at, frame, driver, structure in rows.mechanisms:
        graph = chains[at].canonical().with_frame(frame)
        drivers = [moved(int(link), frame) for link in str(driver).split(",")]
        expected = decompose(graph, drivers).groups
        groups = [every[number] for number in structures[structure]]
        wanted = sorted((len(group.links), group.order, group.group_class) for group in expected)
        assert wanted == sorted((group.links, group.order, group.group_class) for group in groups)
        listed[at] += 1
    assert all(listed.values()) or mobility > 1


@pytest.mark.parametrize(("links", "mobility"), [(6, 1), (8, 1), (7, 2), (9, 2), (8, 3)])
def test_mechanisms_are_counted_by_brute_force(links, mobility):
    """Orbits of (frame, drivers that can move it) by applying every automorphism that networkx finds."""
    import networkx as nx

    chains, rows = facts_of(links, mobility)
    for at, chain in enumerate(chains):
        graph = chain.canonical()
        plain = graph.to_networkx()
        maps = list(nx.isomorphism.GraphMatcher(plain, plain).isomorphisms_iter())
        orbits = set()
        for frame in range(links):
            for drivers in combinations(sorted(plain[frame]), mobility):
                if find_fault(graph.with_frame(frame), [moved(link, frame) for link in drivers]) is None:
                    orbits.add(min((m[frame], sorted(m[link] for link in drivers).__repr__()) for m in maps))
        own = [
            (frame, [int(link) for link in str(driver).split(",")])
            for number, frame, driver, _ in rows.mechanisms
            if number == at
        ]
        assert len(own) == len(orbits)
        found = {min((m[f], sorted(m[link] for link in drivers).__repr__()) for m in maps) for f, drivers in own}
        assert found == orbits


def test_every_assur_group_appears_with_its_class():
    """The groups of the mechanisms of up to ten links are all the groups of two to eight links."""
    groups = {}
    for links in (4, 6, 8, 10):
        groups |= {group.key: group for group in facts_of(links, 1)[1].groups}
    for size in (2, 4, 6, 8):
        own = {key for key, group in groups.items() if group.links == size}
        assert len(own) == count_assur_groups(size)
        assert own == {graph.key for graph in enumerate_assur_groups(size)}
    for key, group in groups.items():
        graph = MechanismGraph.from_key(key)
        contour = contour_class((a, b, f) if a else (b, -1, f) for a, b, f in graph.joints)
        assert (contour, graph.degrees[0]) == (group.group_class, group.order)


@pytest.mark.slow
def test_the_classes_of_all_groups_of_ten_links():
    for group in facts_of(12, 1)[1].groups:
        graph = MechanismGraph.from_key(group.key)
        assert graph.key == group.key
        assert contour_class((a, b, f) if a else (b, -1, f) for a, b, f in graph.joints) == group.group_class


def test_parents_by_removing_dyads():
    for links, mobility in ((8, 1), (10, 1), (9, 2)):
        chains, rows = facts_of(links, mobility)
        smaller = {chain.key for chain in enumerate_chains(links - 2, mobility, fractionated=mobility > 1)}
        own = {(at, parent) for at, parent in rows.dyads}
        assert {parent for _, parent in own} <= smaller
        expected = set()
        for at, chain in enumerate(chains):
            for a, b, _ in chain.joints:
                rest = [v for v in range(links) if v not in (a, b)]
                kept = [(rest.index(p), rest.index(q)) for p, q, _ in chain.joints if not {p, q} & {a, b}]
                if chain.degrees[a] == chain.degrees[b] == 2:
                    parent = MechanismGraph(links - 2, kept)
                    if parent.is_connected and min(parent.degrees) >= 2:
                        expected.add((at, parent.key))
        assert own == expected


def test_contracted_graphs_are_the_chains_without_their_binary_links():
    import networkx as nx

    for links, mobility in ((8, 1), (9, 2), (9, 4)):
        chains, rows = facts_of(links, mobility)
        shapes = list(rows.contracted)
        for chain, found in zip(chains, rows.chains, strict=True):
            vertices, edges = shapes[found[-1]]
            whole = nx.MultiGraph(chain.to_networkx())
            for link in [v for v in whole if whole.degree(v) == 2]:
                if len(near := [w for _, w in whole.edges(link)]) == 2 and link not in near:
                    whole.remove_node(link)
                    whole.add_edge(*near)
            if all(degree == 2 for _, degree in whole.degree()):  # a ring has nothing to contract to
                assert vertices == 0
                continue
            own = nx.MultiGraph()
            for edge in edges.split():
                pair, _, times = edge.partition("x")
                own.add_edges_from([tuple(map(int, pair.split("-")))] * int(times or 1))
            assert len(own) == vertices
            weights = [
                nx.Graph((a, b, {"times": graph.number_of_edges(a, b)}) for a, b in graph.edges())
                for graph in (own, whole)
            ]
            same = nx.isomorphism.numerical_edge_match("times", 0)
            assert nx.is_isomorphic(*weights, edge_match=same)
