"""The enumerator against brute force with networkx: every class exactly once, nothing else."""

from __future__ import annotations

from functools import cache

import brute_force as bf
import pytest

from graphsynth import (
    StructuralSpec,
    count_assur_groups,
    count_baranov_trusses,
    count_chains,
    count_mechanisms,
    enumerate_assur_groups,
    enumerate_baranov_trusses,
    enumerate_chains,
    enumerate_mechanisms,
)


def underlying(links, joints):
    return bf.graphs(links, joints) if links <= 7 else bf.sparse_graphs(links, joints)


@cache
def identifier(links, joints):
    return bf.Identifier(underlying(links, joints))


def assert_same(found, expected, joints):
    """Every class of the census exactly once, with the automorphism group of the right order."""
    found = list(found)
    ids = {}
    for g in found:
        entry = identifier(g.links, joints)(g.links, g.joints, g.frame)
        assert entry not in ids, f"{g!r} and {ids[entry]!r} are the same"
        ids[entry] = g
    assert set(ids) == set(expected)
    assert {entry: g.automorphism_order for entry, g in ids.items()} == expected


PLANAR = [
    (4, 1, 4),
    (6, 1, 7),
    pytest.param(8, 1, 10, marks=pytest.mark.slow),
    (5, 2, 5),
    (7, 2, 8),
    (6, 3, 6),
    pytest.param(8, 3, 9, marks=pytest.mark.slow),
    (7, 4, 7),
]


@pytest.mark.parametrize(("links", "mobility", "joints"), PLANAR)
@pytest.mark.parametrize("fractionated", [False, True])
def test_planar_chains(links, mobility, joints, fractionated):
    graphs = [g for g in underlying(links, joints) if bf.nx.is_connected(g) and min(d for _, d in g.degree()) >= 2]
    expected = bf.census(graphs, {1: joints}, 3, fractionated=fractionated)
    found = enumerate_chains(links, mobility, fractionated=fractionated)
    find = bf.Identifier(graphs)
    ids = [find(g.links, g.joints, None) for g in found]
    assert sorted(ids) == sorted(expected)
    assert count_chains(links, mobility, fractionated=fractionated) == len(expected)


COLOURED = [
    # links, W, Pi, joints by mobility
    (4, 1, 3, {1: 3, 2: 2}),
    (5, 1, 3, {1: 5, 2: 1}),
    (5, 1, 3, {1: 4, 2: 3}),
    (4, 1, 3, {1: 2, 2: 4}),
    (3, 1, 3, {1: 2, 2: 1}),
    (6, 1, 3, {1: 6, 2: 2}),
    (7, 1, 3, {1: 8, 2: 1}),
    (6, 2, 3, {1: 6, 2: 1}),
    (5, 2, 3, {1: 4, 2: 2}),
    (6, 2, 3, {1: 5, 2: 3}),
    (5, 3, 3, {1: 3, 2: 3}),
    (6, 3, 3, {1: 5, 2: 2}),
    (4, 1, 2, {1: 5}),
    (5, 1, 2, {1: 7}),
    (6, 1, 2, {1: 9}),
    (5, 2, 2, {1: 6}),
    (6, 3, 2, {1: 7}),
    (4, 2, 4, {1: 2, 2: 1, 3: 2}),
    (5, 1, 4, {1: 3, 2: 3}),
    (5, 3, 4, {1: 3, 2: 1, 3: 2}),
    (6, 1, 4, {1: 5, 2: 2}),
    (4, 1, 5, {1: 1, 2: 2, 3: 2}),
    (5, 3, 5, {1: 2, 2: 2, 4: 1, 3: 1}),
    (4, 1, 6, {1: 1, 3: 4}),
    (5, 6, 6, {1: 3, 4: 1, 5: 1}),
    (5, 1, 6, {1: 2, 2: 1, 3: 3}),
    (5, 2, 6, {1: 1, 2: 2, 3: 3}),
]


@pytest.mark.long
@pytest.mark.parametrize(("links", "mobility", "space", "counts"), COLOURED)
@pytest.mark.parametrize("fractionated", [False, True])
def test_chains_with_joints_of_any_mobility(links, mobility, space, counts, fractionated):
    assert mobility == space * (links - 1) - sum(count * (space - i) for i, count in counts.items())
    joints = sum(counts.values())
    expected = bf.census(bf.graphs(links, joints), counts, space, fractionated=fractionated)
    higher = {i: count for i, count in counts.items() if i > 1}
    options = {"space": space, "joints_by_mobility": higher, "fractionated": fractionated}
    assert_same(enumerate_chains(links, mobility, **options), expected, joints)
    assert count_chains(links, mobility, **options) == len(expected)


@pytest.mark.parametrize(
    ("links", "mobility", "space", "higher"), [(5, 1, 3, {}), (6, 1, 3, {2: 1}), (5, 1, 4, {2: 1})]
)
def test_no_chain_when_the_formula_has_no_whole_answer(links, mobility, space, higher):
    assert (space * (links - 1) - mobility - sum(c * (space - i) for i, c in higher.items())) % (space - 1)
    assert count_chains(links, mobility, space=space, joints_by_mobility=higher) == 0
    assert list(enumerate_chains(links, mobility, space=space, joints_by_mobility=higher)) == []


FRAMED = [
    (4, 1, 3, {1: 4}),
    (6, 1, 3, {1: 7}),
    (7, 2, 3, {1: 8}),
    (6, 3, 3, {1: 6}),
    (3, 1, 3, {1: 2, 2: 1}),
    (5, 1, 3, {1: 5, 2: 1}),
    (5, 1, 3, {1: 4, 2: 3}),
    (6, 1, 3, {1: 6, 2: 2}),
    (6, 2, 3, {1: 6, 2: 1}),
    (5, 1, 2, {1: 7}),
    (4, 1, 6, {1: 1, 3: 4}),
]


@pytest.mark.parametrize(("links", "mobility", "space", "counts"), FRAMED)
def test_mechanisms(links, mobility, space, counts):
    joints = sum(counts.values())
    expected = bf.census(bf.graphs(links, joints), counts, space, framed=True)
    spec = StructuralSpec(W=mobility, links=links, Pi=space, **{f"p{i}": counts.get(i, 0) for i in range(1, space)})
    assert_same(enumerate_mechanisms(spec), expected, joints)
    assert count_mechanisms(spec) == len(expected)
    # One assortment at a time: the same mechanisms, each with its assortment and frame.
    parts = []
    for solution in spec.solve():
        listed = list(enumerate_mechanisms(solution))
        assert count_mechanisms(solution) == len(listed)
        for g in listed:
            assert g.frame == 0
            assert g.degrees[0] == solution.t0
            assert g.assortment == {a: n for a, n in solution.n_a.items() if n}
        parts += listed
    assert sorted(g.key for g in parts) == sorted(g.key for g in enumerate_mechanisms(spec))


@pytest.mark.parametrize("links", [3, 5, 7])
def test_trusses_and_groups(links):
    joints = 3 * (links - 1) // 2
    trusses = bf.census(bf.graphs(links, joints), {1: joints}, 3, proper=True, fractionated=True)
    assert_same(enumerate_baranov_trusses(links), trusses, joints)
    assert count_baranov_trusses(links) == len(trusses)
    groups = bf.census(bf.graphs(links, joints), {1: joints}, 3, proper=True, framed=True, fractionated=True)
    assert_same(enumerate_assur_groups(links - 1), groups, joints)
    assert count_assur_groups(links - 1) == len(groups)
