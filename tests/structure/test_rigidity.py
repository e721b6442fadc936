import itertools
import random

import pytest

from graphsynth import enumerate_chains
from graphsynth.core.errors import GraphError, TooLargeError
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.rigidity import is_sparse


def dof(graph, links):
    """Definition of theory/structural-system 3, joint by joint."""
    inside = [m for a, b, m in graph.joints if a in links and b in links]
    return graph.space * (len(links) - 1) - sum(graph.space - m for m in inside)


def violating_sets(graph):
    links = range(graph.links)
    return [
        set(chosen)
        for size in range(2, graph.links + 1)
        for chosen in itertools.combinations(links, size)
        if dof(graph, set(chosen)) <= 0
    ]


def random_graph(rng, largest):
    links, space = rng.randint(2, largest), rng.randint(2, 6)
    density = rng.uniform(0.1, 0.7)
    joints = [
        (a, b, rng.randint(1, space - 1) if rng.random() < 0.5 else 1)
        for a, b in itertools.combinations(range(links), 2)
        if rng.random() < density
    ]
    return MechanismGraph(links, joints, space=space)


def check_against_brute_force(graph):
    bad = violating_sets(graph)
    report = graph.rigid_subchain()
    assert is_sparse(graph) == (not bad)
    if not bad:
        assert report is None
        # Theorem (Tay): without a violating set all constraints are independent at generic geometry.
        assert graph.generic_mobility(seed=5).mobility == graph.mobility
        return False
    assert report.mobility == dof(graph, set(report.links)) <= 0
    minimal = set(report.minimal_links)
    assert report.minimal_mobility == dof(graph, minimal) <= 0
    assert not any(other < minimal for other in bad)
    assert minimal <= set(report.links)
    assert all({j.a, j.b} <= minimal for j in report.minimal_joints)
    # Every minimal violating set lies in one body, bodies are disjoint, and each body is generically rigid.
    smallest = [s for s in bad if not any(t < s for t in bad)]
    assert all(any(s <= set(body) for body in report.bodies) for s in smallest)
    assert sum(map(len, report.bodies)) == len(set().union(*report.bodies))
    for body in report.bodies:
        number = {link: place for place, link in enumerate(body)}
        part = MechanismGraph(
            len(body),
            [(number[a], number[b], m) for a, b, m in graph.joints if a in number and b in number],
            space=graph.space,
        )
        assert part.generic_mobility(seed=3).mobility == 0
    return True


def test_pebble_game_against_all_subsets():
    rng = random.Random(20)
    outcomes = [check_against_brute_force(random_graph(rng, 7)) for _ in range(400)]
    assert 50 < sum(outcomes) < 350  # both outcomes are exercised


@pytest.mark.slow
def test_pebble_game_against_all_subsets_up_to_ten_links():
    rng = random.Random(21)
    for _ in range(300):
        check_against_brute_force(random_graph(rng, 10))


def test_report_is_a_sentence():
    graph = MechanismGraph(6, [(0, 1), (1, 2), (0, 2), (2, 3), (3, 4), (4, 5), (5, 2)])
    report = graph.rigid_subchain()
    assert report.links == report.minimal_links == (0, 1, 2)
    assert report.bodies == ((0, 1, 2),)
    assert report.mobility == 0
    assert str(report) == (
        "links 0, 1, 2 form a rigid sub-chain of mobility 0; remove or free one of the joints 0-1, 0-2, 1-2"
    )


def test_generic_mobility_finds_hidden_freedom():
    # K4 on links 0-3 wastes three constraints: the count says 0 + ... but the rest moves.
    graph = MechanismGraph(8, [*itertools.combinations(range(4), 2), (3, 4), (4, 5), (5, 6), (6, 7), (7, 0)])
    found = graph.generic_mobility(seed=1)
    assert found.redundant_constraints == 3
    assert found.mobility == graph.mobility + 3 == 2
    assert found.rank == graph.sub_edges - 2
    assert 0 < found.failure_bound < 1e-6


def test_generic_mobility_of_a_graph_in_parts():
    graph = MechanismGraph(5, [(0, 1), (2, 3), (3, 4)])
    assert graph.generic_mobility().mobility == graph.mobility == 6


def test_generic_mobility_refuses_what_cannot_finish():
    with pytest.raises(TooLargeError, match="rigid_subchain"):
        MechanismGraph(100, itertools.combinations(range(100), 2)).generic_mobility()


def test_girth_and_cuts_against_networkx():
    import networkx as nx

    rng = random.Random(22)
    for _ in range(300):
        graph = random_graph(rng, 9)
        view = graph.to_networkx()
        assert (graph.girth or float("inf")) == nx.girth(view)
        assert set(graph.cut_links) == set(nx.articulation_points(view))
        assert {(j.a, j.b) for j in graph.cut_joints} == {tuple(sorted(edge)) for edge in nx.bridges(view)}
        assert graph.is_planar == nx.check_planarity(view)[0]
        assert [set(part) for part in graph.components] == [set(p) for p in nx.connected_components(view)]
        assert graph.loops == len(nx.cycle_basis(view))


def least_with_a_loop(graph):
    """The smallest DOF of a set of links each of which has two joints inside it."""
    found = []
    for mask in range(1, 1 << graph.links):
        links = {link for link in range(graph.links) if mask >> link & 1}
        if all((graph.neighbours[link] & mask).bit_count() >= 2 for link in links):
            found.append(dof(graph, links))
    return min(found)


@pytest.mark.parametrize(
    ("links", "mobility", "more", "numbers"),
    [
        (7, 2, {}, (1, 2, 1)), (6, 3, {}, (1, 0, 0)), (8, 3, {}, (1, 4, 2)),
        (6, 2, {"joints_by_mobility": {2: 1}}, (2, 6, 2)), (7, 3, {"space": 4}, (1, 0, 0)),
        pytest.param(9, 2, {}, (6, 29, 5), marks=pytest.mark.long),
        pytest.param(9, 4, {}, (0, 6, 4), marks=pytest.mark.long),
        pytest.param(10, 3, {}, (3, 71, 24), marks=pytest.mark.long),
        pytest.param(7, 4, {"joints_by_mobility": {2: 2}}, (0, 47, 26), marks=pytest.mark.long),
        pytest.param(7, 3, {"joints_by_mobility": {2: 1}}, (1, 12, 6), marks=pytest.mark.long),
    ],
)  # fmt: skip
def test_types_of_mobility(links, mobility, more, numbers):
    """Against all sets of links."""
    chains = list(enumerate_chains(links, mobility, fractionated=True, **more))
    for chain in chains:
        whole = "total" if least_with_a_loop(chain) >= mobility else "partial"
        assert chain.mobility_type == ("fractionated" if chain.cut_links or chain.cut_joints else whole)
    assert numbers == tuple(
        sum(chain.mobility_type == kind for chain in chains) for kind in ("total", "partial", "fractionated")
    )


def test_no_type_of_mobility():
    triangle = MechanismGraph(5, [(0, 1), (1, 2), (0, 2), (2, 3), (3, 4), (4, 0)])
    for graph in (triangle, MechanismGraph(2, [])):
        with pytest.raises(GraphError, match=r"moves in all its parts|in several parts"):
            _ = graph.mobility_type
