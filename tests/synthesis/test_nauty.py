"""The enumerator against nauty's geng and a subset test: the same canonical graphs, not only as many."""

from __future__ import annotations

import subprocess
import sys

import brute_force as bf
import nauty
import pytest

from graphsynth import (
    MechanismGraph,
    StructuralSpec,
    enumerate_assur_groups,
    enumerate_baranov_trusses,
    enumerate_chains,
    enumerate_mechanisms,
)

CHAINS = [(6, 1), (8, 1), (10, 1), (12, 1), (5, 2), (7, 2), (9, 2), (11, 2), (8, 3), (10, 3), (9, 4), (11, 4)]


def same(found, expected):
    """Compare lists of graph6 lines up to isomorphism; both must be without repetition."""
    found, expected = nauty.canonical(found), nauty.canonical(expected)
    assert len(set(found)) == len(found)
    assert sorted(found) == sorted(expected)


def marked(graph):
    """Return the graph6 line of a mechanism with a pendant vertex at its frame."""
    joints = [(a, b) for a, b, _ in graph.joints]
    return MechanismGraph(graph.links + 1, [*joints, (graph.frame, graph.links)]).graph6()


def with_each_frame(lines):
    """Return the canonical graph6 lines of chains with a pendant vertex at each of their links, each once."""
    framed = []
    for line in lines:
        chain = MechanismGraph.from_graph6(line)
        framed += [marked(chain.with_frame(link)) for link in range(chain.links)]
    return sorted(set(nauty.canonical(framed)))


@pytest.mark.long
@pytest.mark.parametrize(("links", "mobility"), CHAINS)
@pytest.mark.parametrize("fractionated", [False, True])
def test_chains(links, mobility, fractionated):
    joints = (3 * (links - 1) - mobility) // 2
    expected = nauty.chains(links, joints, fractionated=fractionated)
    same([g.graph6() for g in enumerate_chains(links, mobility, fractionated=fractionated)], expected)


@pytest.mark.slow
@pytest.mark.parametrize(("links", "mobility"), [(13, 2), (12, 3)])
def test_larger_chains_with_fractionated_ones(links, mobility):
    expected = nauty.chains(links, (3 * (links - 1) - mobility) // 2, fractionated=True)
    same([g.graph6() for g in enumerate_chains(links, mobility, fractionated=True)], expected)


@pytest.mark.slow
def test_fourteen_links():
    same([g.graph6() for g in enumerate_chains(14)], nauty.chains(14, 19))


@pytest.mark.parametrize("links", [5, 7, 9, 11, pytest.param(13, marks=pytest.mark.slow)])
def test_trusses_and_groups(links):
    trusses = nauty.chains(links, 3 * (links - 1) // 2, fractionated=True, proper=True)
    same([g.graph6() for g in enumerate_baranov_trusses(links)], trusses)
    groups = [marked(g) for g in enumerate_assur_groups(links - 1)]
    assert sorted(nauty.canonical(groups)) == with_each_frame(trusses)


@pytest.mark.parametrize("links", [6, 8, 10, pytest.param(12, marks=pytest.mark.slow)])
def test_mechanisms(links):
    chains = nauty.chains(links, (3 * links - 4) // 2)
    mechanisms = [marked(g) for g in enumerate_mechanisms(StructuralSpec(W=1, links=links))]
    assert sorted(nauty.canonical(mechanisms)) == with_each_frame(chains)


@pytest.mark.parametrize(("links", "mobility"), [(7, 2), (9, 2), (8, 3)])
def test_fractionated_mechanisms(links, mobility):
    chains = nauty.chains(links, (3 * (links - 1) - mobility) // 2, fractionated=True)
    spec = StructuralSpec(W=mobility, links=links, fractionated=True)
    mechanisms = [marked(g) for g in enumerate_mechanisms(spec)]
    assert sorted(nauty.canonical(mechanisms)) == with_each_frame(chains)


@pytest.mark.long
@pytest.mark.parametrize(
    ("links", "p1", "p2"),
    [(7, 8, 1), (7, 7, 3), (8, 9, 2)],
)
def test_higher_pairs(links, p1, p2):
    lines = nauty.run("geng", "-C", str(links), f"{p1 + p2}:{p1 + p2}")
    underlying = [bf.nx.from_graph6_bytes(line.encode()) for line in lines]
    expected = bf.census(underlying, {1: p1, 2: p2}, 3)
    find = bf.Identifier(underlying)
    found = {find(g.links, g.joints, None): g for g in enumerate_chains(links, joints_by_mobility={2: p2})}
    assert {entry: g.automorphism_order for entry, g in found.items()} == expected


def test_the_command_line_writes_distinct_graphs(tmp_path):
    out = tmp_path / "chains.g6"
    command = [sys.executable, "-m", "graphsynth", "enumerate", "--links", "8", "-o", str(out)]
    subprocess.run(command, check=True, capture_output=True)
    lines = out.read_text(encoding="ascii").splitlines()
    assert len(lines) == 16
    assert len(nauty.run("shortg", "-g", data=lines)) == 16
