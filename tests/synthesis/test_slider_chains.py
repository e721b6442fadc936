"""Chains with prismatic joints beside brute force: every choice of joints of every chain, rules read literally."""

from __future__ import annotations

import json
import random
from functools import cache
from itertools import combinations

import brute_force as bf
import nauty
import networkx as nx
import pytest
from coloured import keeps_rules

from graphsynth import Goals, SliderChain, count_slider_chains, enumerate_chains, enumerate_slider_chains
from graphsynth.cli.main import main
from graphsynth.core.errors import FormatError, SpecError, TooLargeError


@cache
def plain_chains(links, mobility):
    """Non-fractionated chains without rigid sub-chain, not by graphsynth."""
    joints = (3 * (links - 1) - mobility) // 2
    if links > 7:
        return tuple(nx.from_graph6_bytes(line.encode()) for line in nauty.chains(links, joints))
    return tuple(
        g
        for g in bf.graphs(links, joints)
        if nx.is_biconnected(g) and bf.worst_subset(links, [(a, b, 1) for a, b in g.edges], 3) >= 1
    )


def classes(links, mobility, number, framed, **rules):
    """Return the smallest image of each class of (chain, frame, prismatic joints)."""
    found = set()
    for k, g in enumerate(plain_chains(links, mobility)):
        moves = bf.automorphisms(g)
        for sliders in combinations(sorted(tuple(sorted(pair)) for pair in g.edges), number):
            if not keeps_rules(g, sliders, **rules):
                continue
            for frame in g if framed else [-1]:
                images = (
                    (move.get(frame, -1), *sorted(tuple(sorted((move[a], move[b]))) for a, b in sliders))
                    for move in moves
                )
                found.add((k, min(images)))
    return found


def class_of(chain, links, mobility):
    g = nx.Graph(list(chain.joints))
    for k, other in enumerate(plain_chains(links, mobility)):
        matcher = nx.algorithms.isomorphism.GraphMatcher(g, other)
        if matcher.is_isomorphic():
            to = matcher.mapping
            moves = bf.automorphisms(other)
            frame = -1 if chain.frame is None else to[chain.frame]
            return k, min(
                (
                    move.get(frame, -1),
                    *sorted(tuple(sorted((move[to[a]], move[to[b]]))) for a, b in chain.sliders),
                )
                for move in moves
            )
    raise AssertionError(f"{chain} is none of the chains")


RULES = [
    {"sliding_links": links, "sliding_loops": loops, "cylinders": cylinders}
    for links, loops, cylinders in ((0, 0, 0), (0, 1, 0), (1, 0, 0), (1, 1, 0), (0, 0, 1))
]
RULES = [{name: bool(value) for name, value in rules.items()} for rules in RULES]


@pytest.mark.parametrize(
    ("links", "mobility", "most", "framed"),
    [
        (4, 1, 4, True), (5, 2, 5, True), (6, 1, 5, True), (6, 3, 5, True),
        pytest.param(7, 2, 6, True, marks=pytest.mark.slow),
        pytest.param(8, 1, 5, True, marks=pytest.mark.slow),
        pytest.param(9, 2, 4, False, marks=pytest.mark.slow),
        pytest.param(10, 1, 4, False, marks=pytest.mark.slow),
    ],
)  # fmt: skip
@pytest.mark.parametrize("rules", RULES)
def test_counts_and_lists(links, mobility, most, framed, rules):
    for number in range(1, most + 1):
        expected = classes(links, mobility, number, False, **rules)
        assert count_slider_chains(links, number, mobility, **rules) == len(expected)
        listed = list(enumerate_slider_chains(links, number, mobility, **rules))
        assert len({chain.key for chain in listed}) == len(listed) == len(expected)
        if links <= 7:
            assert {class_of(chain, links, mobility) for chain in listed} == expected
        if framed:
            expected = classes(links, mobility, number, True, **rules)
            assert count_slider_chains(links, number, mobility, framed=True, **rules) == len(expected)
            listed = list(enumerate_slider_chains(links, number, mobility, framed=True, **rules))
            assert len({chain.key for chain in listed}) == len(listed) == len(expected)
            assert {chain.frame for chain in listed} <= {0}


def test_reference_numbers():
    """No link has prismatic joints only."""
    assert [count_slider_chains(6, number, sliding_loops=True) for number in (1, 2, 3)] == [6, 13, 11]
    assert [count_slider_chains(8, number, sliding_loops=True) for number in (1, 2, 3)] == [84, 307, 574]
    assert count_slider_chains(4, 2) == 1 and count_slider_chains(4, 2, sliding_links=True) == 2  # RPRP; and RRPP


@pytest.mark.long
def test_every_listed_chain_keeps_the_rules():
    """Several classes meet at a vertex from eight links on: what a label gives must be told at the right end."""
    for rules in RULES:
        chains = list(enumerate_slider_chains(8, 3, **rules))
        for chain in chains[:: 1 if rules["sliding_loops"] else 20]:
            assert keeps_rules(nx.Graph(list(chain.joints)), chain.sliders, **rules), chain


@pytest.mark.parametrize("number", [pytest.param(5, marks=pytest.mark.slow), pytest.param(6, marks=pytest.mark.long)])
def test_many_sliders_tell_the_ends_of_turned_classes(number):
    """Automorphisms turn classes about: a symmetric labelling gives the other end what it gave this one."""
    rules = RULES[1]
    assert count_slider_chains(8, number, **rules) == len(classes(8, 1, number, False, **rules))


def test_one_slider_is_an_orbit_of_joints():
    orbits = sum(len(chain.joint_orbits) for chain in enumerate_chains(10))
    assert count_slider_chains(10, 1) == orbits


def test_keys_and_texts():
    chains = list(enumerate_slider_chains(6, 2, framed=True))
    shuffle = random.Random(5)
    for chain in chains:
        names = [0, *shuffle.sample(range(1, 6), 5)]
        moved = chain.graph.relabelled(names)
        other = SliderChain.from_graph(moved, [(names[b], names[a]) for a, b in chain.sliders])
        assert other.key == chain.key != chain.coloured.key
        assert SliderChain.from_key(chain.key) == chain.canonical()
        assert SliderChain.from_text(chain.to_text()) == chain
        assert chain.graph.mobility == chain.mobility == 1


def test_dimensions_and_picture():
    chain = SliderChain.from_text("Cl f0 P:0-3")
    found = chain.embody()
    assert found.mechanism is not None and [joint.kind for joint in found.mechanism.joints].count("P") == 1
    assert found.motion.assembled.all()
    assert chain.draw().svg.count('data-part="block') >= 1


@pytest.mark.slow
def test_excavators_with_two_cylinders_move():
    machines = list(enumerate_slider_chains(9, 2, 2, cylinders=True, framed=True))
    for machine in (m for m in machines if m.graph.degrees[0] == 3):
        arms = {b for a, b in machine.joints if a == 0} - {link for pair in machine.sliders for link in pair}
        if len(arms) == 1 and machine.graph.degrees[min(arms)] >= 3:
            found = machine.embody(Goals(span=0.5, rates=(1.0, 0.5)), driver=machine.sliders, tries=4, effort=0.5)
            assert found.motion.assembled.all() and len(found.mechanism.drivers) == 2


@pytest.mark.parametrize("text", ["Cl 2:0-3", "Cl P:0-2", "Cl P:0-3 pi4", "Cl 3:0-3", ""])
def test_texts_that_are_none(text):
    with pytest.raises(FormatError):
        SliderChain.from_text(text)


def test_bad_questions():
    for asked in ((1, 1), (8, 0), (8, 1, 0), (8, "one")):
        with pytest.raises(SpecError):
            count_slider_chains(*asked)
    with pytest.raises(SpecError, match="sliding_links"):
        count_slider_chains(8, 1, sliding_links=2)
    with pytest.raises(TooLargeError):
        count_slider_chains(22, 1)
    assert count_slider_chains(7, 1) == count_slider_chains(6, 8) == count_slider_chains(2, 1) == 0
    with pytest.raises(FormatError):
        SliderChain.from_graph(SliderChain.from_text("Cl P:0-3").graph, [(0, 2)])


def test_command_line(capsys, tmp_path):
    assert main(["count", "--links", "8", "--sliders", "3", "--sliding-loops"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "574"
    assert main(["enumerate", "--links", "4", "--sliders", "1", "--frame"]) == 0
    texts = capsys.readouterr().out.split("\n")[:-1]
    assert [SliderChain.from_text(text).frame for text in texts] == [0, 0]
    listing = tmp_path / "chains.jsonl"
    assert main(["enumerate", "--links", "6", "--sliders", "2", "--cylinders", "-o", str(listing)]) == 0
    capsys.readouterr()
    assert '"sliders"' in listing.read_text()
    assert main(["show", texts[0], "-o", str(tmp_path / "chain.svg")]) == 0
    assert "P:" in capsys.readouterr().out
    for wrong in (["--sliders", "two"], ["--cylinders"], ["--sliders", "1", "--multiple-joints", "1"]):
        assert main(["count", "--links", "8", *wrong]) == 2


@pytest.mark.parametrize("question", ["--links 8 --sliders 1", "--links 8 --multiple-joints any"])
def test_facts_in_lists_are_those_of_the_graph(question, tmp_path, capsys):
    """Symmetries and girth by networkx, on the graph of links and joints as vertices of their kinds."""
    assert main(["enumerate", *question.split(), "-o", str(tmp_path / "list.jsonl")]) == 0
    rows = [json.loads(line) for line in (tmp_path / "list.jsonl").read_text().splitlines()]
    assert len(rows) in (84, 44)
    for row in rows[::9]:
        sliders = [tuple(pair) for pair in row.get("sliders", ())]
        graph = nx.Graph()
        graph.add_nodes_from(range(8), kind="link")
        for joint in row["joints"]:
            graph.add_node(name := ("joint", *joint), kind="P" if tuple(joint) in sliders else "R")
            graph.add_edges_from((name, link) for link in joint)
        same = nx.isomorphism.GraphMatcher(graph, graph, nx.isomorphism.categorical_node_match("kind", ""))
        assert row["symmetries"] == sum(1 for _ in same.isomorphisms_iter())
        assert row["girth"] == nx.girth(graph) // 2
        assert row["mobility"] == 3 * 7 - 2 * sum(len(joint) - 1 for joint in row["joints"]) == 1
        assert row["mobility_type"] == "total"
