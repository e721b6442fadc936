"""Every published count of catalog/counts/published.toml."""

from __future__ import annotations

import tomllib
from collections import Counter
from pathlib import Path

import pytest

from graphsynth import (
    MechanismGraph,
    StructuralSpec,
    count_assur_groups,
    count_baranov_trusses,
    count_chains,
    count_mechanisms,
    enumerate_chains,
    enumerate_mechanisms,
    sample_mechanisms,
)

PUBLISHED = tomllib.loads((Path(__file__).parents[2] / "catalog/counts/published.toml").read_text(encoding="utf-8"))
EXAMPLE = PUBLISHED["worked_example"]
FIGURE_3 = MechanismGraph(
    15,
    [(a, b) for a, b in EXAMPLE["figure_3_joints_1"]] + [(a, b, 2) for a, b in EXAMPLE["figure_3_joints_2"]],
    frame=0,
)


def rows(name):
    return [
        pytest.param(
            row, marks=pytest.mark.slow if row.get("slow") else (), id=f"W{row.get('mobility', 1)}-{row['links']}"
        )
        for row in PUBLISHED[name]
    ]


def by_links(name):
    return [(int(links), count) for links, count in PUBLISHED[name]["counts"].items()]


def example(name):
    numbers = {key: value for key, value in EXAMPLE[name].items() if key.startswith("n")}
    return StructuralSpec(
        W=1, Pi=3, p1=EXAMPLE["p1"], p2=EXAMPLE["p2"], n=14, t0=EXAMPLE["frame_joints"], v_ct=6, **numbers
    )


def test_every_row_names_a_source():
    tables = [row for table in PUBLISHED.values() for row in (table if isinstance(table, list) else [table])]
    named = [table["source"] for table in tables if table is not PUBLISHED["sources"]]
    assert set(named) <= set(PUBLISHED["sources"])


@pytest.mark.long
@pytest.mark.parametrize("row", rows("chains"))
def test_chains(row):
    assert count_chains(row["links"], row["mobility"]) == row["count"]
    if "with_fractionated" in row:
        assert count_chains(row["links"], row["mobility"], fractionated=True) == row["with_fractionated"]


def listed():
    found = [row for row in rows("chains") if row.values[0]["count"] < 10_000]
    return [
        pytest.param(*row.values, id=row.id, marks=pytest.mark.slow if row.values[0]["count"] > 5_000 else row.marks)
        for row in found
    ]


@pytest.mark.long
@pytest.mark.parametrize("row", listed())
def test_chains_listed(row):
    row_count, links, mobility = row["count"], row["links"], row["mobility"]
    listed = list(enumerate_chains(links, mobility))
    assert len(listed) == row_count
    assert len({g.key for g in listed}) == row_count
    if "with_fractionated" in row:
        everything = list(enumerate_chains(links, mobility, fractionated=True))
        assert len({g.key for g in everything}) == len(everything) == row["with_fractionated"]
        assert sum(not g.is_fractionated for g in everything) == row_count


def test_by_non_binary_links():
    table = PUBLISHED["by_non_binary_links"]
    found = Counter(sum(d > 2 for d in g.degrees) for g in enumerate_chains(table["links"]))
    assert found == {int(number): count for number, count in table["counts"].items()}


def test_by_assortment():
    table = PUBLISHED["by_assortment"]
    found = Counter(tuple(g.assortment.get(a, 0) for a in (2, 3, 4, 5)) for g in enumerate_chains(table["links"]))
    assert found == {tuple(numbers): count for *numbers, count in table["rows"]}


@pytest.mark.parametrize("row", rows("non_planar"))
def test_non_planar(row):
    assert sum(not g.is_planar for g in enumerate_chains(row["links"])) == row["count"]


@pytest.mark.parametrize("row", rows("asymmetric"))
def test_asymmetric(row):
    assert sum(g.automorphism_order == 1 for g in enumerate_chains(row["links"])) == row["count"]


@pytest.mark.parametrize(("links", "count"), by_links("mechanisms"))
def test_mechanisms(links, count):
    assert count_mechanisms(StructuralSpec(W=1, links=links)) == count


@pytest.mark.parametrize(("links", "count"), by_links("baranov_trusses"))
def test_baranov_trusses(links, count):
    assert count_baranov_trusses(links) == count


@pytest.mark.parametrize(("links", "count"), by_links("assur_groups"))
def test_assur_groups(links, count):
    assert count_assur_groups(links) == count


@pytest.mark.parametrize(("links", "p1", "p2", "count"), PUBLISHED["higher_pairs"]["rows"])
def test_higher_pairs(links, p1, p2, count):
    assert count_chains(links, joints_by_mobility={2: p2}) == count
    listed = list(enumerate_chains(links, joints_by_mobility={2: p2}))
    assert len({g.key for g in listed}) == len(listed) == count
    assert all(Counter(joint.mobility for joint in g.joints) == {1: p1, 2: p2} for g in listed)


def test_worked_example_with_four_quaternary_links():
    table = EXAMPLE["large_quaternary"]
    assert count_mechanisms(example("large_quaternary")) == table["count"]
    threefold = list(enumerate_mechanisms(example("large_quaternary"), symmetry=3))
    assert len({g.key for g in threefold}) == len(threefold) == table["order_3"]
    assert all(g.automorphism_order % 3 == 0 and g.rigid_subchain() is None for g in threefold)


def test_worked_example_of_the_figure():
    assert count_mechanisms(example("figure_3")) == EXAMPLE["figure_3"]["count"]


@pytest.mark.long
def test_threefold_mechanisms_of_the_figure():
    threefold = list(enumerate_mechanisms(example("figure_3"), symmetry=3))
    keys = {g.key for g in threefold}
    assert len(keys) == len(threefold)
    assert all(g.automorphism_order % 3 == 0 and g.mobility == 1 and g.rigid_subchain() is None for g in threefold)
    assert FIGURE_3.key in keys
    assert FIGURE_3.automorphism_order == EXAMPLE["figure_3_automorphisms"]
    two_fixed = sum(_fixed_by_order_3(g) == {2} for g in threefold)
    assert two_fixed == EXAMPLE["figure_3"]["order_3_two_fixed"]


def _fixed_by_order_3(graph):
    """Return how many moving links the automorphisms of order 3 fix (a set: one value per automorphism)."""
    import networkx as nx
    from networkx.algorithms.isomorphism import GraphMatcher, categorical_edge_match, categorical_node_match

    coloured = graph.to_networkx()
    nx.set_node_attributes(coloured, {v: v == graph.frame for v in coloured}, "fixed")
    matcher = GraphMatcher(
        coloured, coloured, categorical_node_match("fixed", False), categorical_edge_match("mobility", 1)
    )
    moves = list(matcher.isomorphisms_iter())
    return {
        sum(move[v] == v for v in move) - 1
        for move in moves
        if any(move[v] != v for v in move) and all(move[move[move[v]]] == v for v in move)
    }


@pytest.mark.slow
def test_samples_of_the_worked_example_are_answers():
    drawn = sample_mechanisms(example("figure_3"), 20, seed=7)
    for g in drawn:
        assert g.frame == 0
        assert (g.mobility, g.degrees[0], g.assortment) == (1, 7, {2: 6, 3: 7, 4: 1})
        assert Counter(joint.mobility for joint in g.joints) == {1: 19, 2: 3}
        assert g.rigid_subchain() is None and not g.is_fractionated


def golden():
    """Read the graphs that nauty's generator found (made once, so that nauty is not needed here)."""
    chains = {}
    for line in (Path(__file__).parents[1] / "golden/enumeration.tsv").read_text(encoding="ascii").splitlines():
        if not line.startswith("#"):
            mobility, links, graph6 = line.split("\t")
            chains.setdefault((int(mobility), int(links)), []).append(MechanismGraph.from_graph6(graph6))
    return chains


@pytest.mark.parametrize(("mobility", "links"), golden())
def test_same_graphs_as_on_file(mobility, links):
    expected = golden()[mobility, links]
    found = enumerate_chains(links, mobility, fractionated=True)
    assert sorted(g.key for g in found) == sorted(g.key for g in expected)
    strict = enumerate_chains(links, mobility)
    assert sorted(g.key for g in strict) == sorted(g.key for g in expected if not g.is_fractionated)
