"""The series of catalog/counts/more-terms.toml: counted anew, and by permutations of links and rigid clusters."""

from __future__ import annotations

import tomllib
from collections import Counter
from pathlib import Path

import brute_force
import networkx as nx
import pytest
import rigid_clusters

from graphsynth import count_assur_groups, count_baranov_trusses, count_chains

SERIES = {
    name: {int(links): count for links, count in terms.items()}
    for name, terms in tomllib.loads(
        (Path(__file__).parents[2] / "catalog/counts/more-terms.toml").read_text("utf-8")
    ).items()
}


def count(name, links):
    if not name.startswith("chains"):
        return {"baranov_trusses": count_baranov_trusses, "assur_groups": count_assur_groups}[name](links)
    return count_chains(links, int(name.split("_")[1]), fractionated=name.endswith("fractionated"))


@pytest.mark.parametrize("name", SERIES)
def test_terms_are_counted_anew(name):
    first = min(SERIES[name])
    assert sorted(SERIES[name]) == list(range(first, first + 2 * len(SERIES[name]), 2))
    few = {links: number for links, number in SERIES[name].items() if links < first + 8}
    assert {links: count(name, links) for links in few} == few


@pytest.mark.slow
@pytest.mark.parametrize("name", SERIES)
def test_larger_terms_are_counted_anew(name):
    links = min(SERIES[name]) + 12
    assert count(name, links) == SERIES[name][links]


@pytest.mark.parametrize(
    ("mobility", "most"),
    [
        (2, 9), (3, 8), (4, 9), (5, 10),
        pytest.param(3, 12, marks=pytest.mark.slow),
        pytest.param(4, 13, marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_permutations_of_links_give_all_chains_with_fractionated_ones(mobility, most):
    terms = {n: c for n, c in SERIES[f"chains_{mobility}_with_fractionated"].items() if n <= most}
    assert {links: rigid_clusters.with_fractionated(links, mobility) for links in terms} == terms
    assert len(terms) > 1


def test_loops_of_chains_that_do_not_exist():
    assert rigid_clusters.with_fractionated(7, 1) == 0
    assert rigid_clusters.with_fractionated(6, 1) == 2


def test_connected_graphs_are_those_of_networkx():
    """All connected graphs without rigid sets of up to six links, trees and loose ends included, by joints."""
    clusters = rigid_clusters.Clusters(6, 7)
    found, wanted = Counter(), Counter()
    for cycles, numbers in rigid_clusters.connected(clusters, 6).items():
        for joints, number in numbers.items():
            found[sum(cycles), joints] += number
    for graph in nx.graph_atlas_g():
        if 2 <= len(graph) <= 6 and nx.is_connected(graph):
            joints = [(a, b, 1) for a, b in graph.edges]
            if brute_force.worst_subset(len(graph), joints, 3) > 0:
                wanted[len(graph), len(joints)] += 1
    wanted[1, 0] = 1
    assert +found == wanted


def test_without_joints_only_one_link_is_connected():
    """The logarithm and Moebius inversion up to 14, where everything cancels."""
    found = rigid_clusters.connected(rigid_clusters.Clusters(14, 0), 14)
    assert [cycles for cycles, numbers in found.items() if any(numbers.values())] == [(1,)]
    assert found[1,] == {0: 1}
