"""Chains with multiple joints: published counts, nauty's bipartite graphs with a subset test, keys, bad input."""

from __future__ import annotations

import random
import tomllib
from pathlib import Path

import multiple_joints as oracle
import networkx as nx
import pytest

from graphsynth import MultipleJointChain, count_multiple_joint_chains, enumerate_multiple_joint_chains
from graphsynth.cli.main import main
from graphsynth.core.errors import FormatError, SpecError, TooLargeError

PUBLISHED = tomllib.loads((Path(__file__).parents[2] / "catalog/counts/published.toml").read_text("utf-8"))


@pytest.mark.parametrize("row", PUBLISHED["multiple_joints"]["rows"])
def test_published_numbers(row):
    links, mobility, *counts = row
    found = [count_multiple_joint_chains(links, mobility, multiple=k) for k in range(1, len(counts) + 1)]
    assert found == counts
    assert count_multiple_joint_chains(links, mobility) == sum(counts)


def line_of(chain):
    """Return graph6 of the bipartite graph of links and joints."""
    graph = nx.empty_graph(chain.links + len(chain.joints))
    graph.add_edges_from((link, chain.links + k) for k, joint in enumerate(chain.joints) for link in joint)
    return nx.to_graph6_bytes(graph, header=False).decode().strip()


@pytest.mark.parametrize(
    ("links", "mobility", "framed", "most"),
    [
        (6, 1, True, 2), (7, 2, True, 2), (8, 3, True, 2), (9, 4, True, 2),
        pytest.param(8, 1, True, 4, marks=pytest.mark.long),
        pytest.param(9, 2, True, 4, marks=pytest.mark.slow),
        pytest.param(10, 1, False, 6, marks=pytest.mark.slow),
        pytest.param(10, 3, True, 4, marks=pytest.mark.slow),
        pytest.param(11, 2, False, 6, marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_every_chain_once(links, mobility, framed, most):
    """Also every mechanism: the sets of canonical graphs are equal, so nothing is missing and nothing else there."""
    for multiple in range(1, most + 1):
        expected = oracle.chains(links, mobility, multiple)
        if framed:
            mechanisms = set(oracle.canonical(oracle.with_frames(expected, links), links, framed=True))
            listed = list(enumerate_multiple_joint_chains(links, mobility, multiple=multiple, framed=True))
            assert sorted(oracle.canonical(map(line_of, listed), links, framed=True)) == sorted(mechanisms)
            assert count_multiple_joint_chains(links, mobility, multiple=multiple, framed=True) == len(mechanisms)
            assert all(chain.frame == 0 for chain in listed)
        listed = list(enumerate_multiple_joint_chains(links, mobility, multiple=multiple))
        assert sorted(oracle.canonical(map(line_of, listed), links)) == sorted(oracle.canonical(expected, links))
        assert count_multiple_joint_chains(links, mobility, multiple=multiple) == len(expected)
        assert {chain.mobility for chain in listed} <= {mobility}


@pytest.mark.slow
@pytest.mark.parametrize("multiple", [7, 8])
def test_chains_of_twelve_links_with_many_multiple_joints(multiple):
    assert count_multiple_joint_chains(12, multiple=multiple) == len(oracle.chains(12, 1, multiple))


def test_keys_know_isomorphic_chains_and_no_others():
    chains = list(enumerate_multiple_joint_chains(8))
    assert len({chain.key for chain in chains}) == len(chains)
    shuffle = random.Random(3)
    for chain in chains:
        names = shuffle.sample(range(8), 8)
        joints = [shuffle.sample([names[link] for link in joint], len(joint)) for joint in chain.joints]
        other = MultipleJointChain.from_joints(8, shuffle.sample(joints, len(joints)))
        assert other.key == chain.key and other.automorphism_order == chain.automorphism_order
        assert MultipleJointChain.from_key(chain.key) == chain.canonical()
        assert MultipleJointChain.from_text(chain.to_text()) == chain
        assert chain.graph().mobility == chain.mobility == 1


def test_links_and_multiple_joints_are_told_apart():
    """A star of one link with three pins, and of one pin with three links, three more links on each: the same graph."""
    first = [(0, 1, 2, 3), (0, 4, 5, 6), (0, 7, 8, 9)]
    other = [(0, 1, 2), (0, 3), (0, 4), (0, 5), (1, 6), (1, 7), (1, 8), (2, 9), (2, 10), (2, 11)]
    chains = MultipleJointChain.from_joints(10, first), MultipleJointChain.from_joints(12, other)
    assert [nx.Graph([(a, b) for a, b, _ in chain.incidence.joints]).size() for chain in chains] == [12, 12]
    assert nx.is_isomorphic(*(nx.Graph([(a, b) for a, b, _ in chain.incidence.joints]) for chain in chains))
    assert chains[0].key != chains[1].key
    framed = {MultipleJointChain.from_joints(10, first, frame=link).key for link in range(10)}
    assert len(framed) == 2 and chains[0].key not in framed


@pytest.mark.parametrize(
    ("links", "joints", "message"),
    [
        (3, [(0, 1, 1)], "two different links"),
        (3, [(0, 1), (0, 1, 2)], "jointed twice"),
        (4, [(0, 1, 2), (0, 1, 3)], "jointed twice"),
        (3, [(0,)], "two different links"),
        (3, [(0, 3)], "number of a link"),
    ],
)
def test_joints_that_are_none(links, joints, message):
    with pytest.raises(FormatError, match=message):
        MultipleJointChain.from_joints(links, joints)


@pytest.mark.parametrize("text", ["", "m1", "FCSv?", "FCSv? m2", "FCSv? m9", "FCSv? f6 m1", "FCSv? 2:0-6 m1"])
def test_texts_that_are_none(text):
    with pytest.raises(FormatError):
        MultipleJointChain.from_text(text)


@pytest.mark.parametrize("key", ["", "1m1", "1m1.", "1m2.BwA", "2m1.BwA", "1BAN4", "1m0001.Bw"])
def test_keys_that_are_none(key):
    with pytest.raises(FormatError):
        MultipleJointChain.from_key(key)


def test_bad_questions():
    for asked in ({"links": 1}, {"links": 8, "mobility": 0}, {"links": 8, "multiple": 0}, {"links": 8, "framed": "no"}):
        with pytest.raises(SpecError):
            count_multiple_joint_chains(**asked)
    with pytest.raises(TooLargeError, match="16 links at most"):
        count_multiple_joint_chains(18)
    assert count_multiple_joint_chains(7) == count_multiple_joint_chains(4) == 0
    assert count_multiple_joint_chains(8, multiple=5) == 0


def test_command_line(capsys, tmp_path):
    assert main(["count", "--links", "8", "--multiple-joints", "2"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "18"
    assert main(["count", "--links", "8", "--multiple-joints", "any", "--frame"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "259"
    assert main(["enumerate", "--links", "6", "--multiple-joints", "any"]) == 0
    texts = capsys.readouterr().out.split("\n")[:-1]
    assert [MultipleJointChain.from_text(text).multiple for text in texts] == [1, 2]
    listing = tmp_path / "chains.jsonl"
    assert main(["enumerate", "--links", "6", "--multiple-joints", "1", "-o", str(listing)]) == 0
    assert MultipleJointChain.from_text(texts[0]).key in listing.read_text()
    capsys.readouterr()
    picture = tmp_path / "chain.svg"
    assert main(["show", texts[1], "-o", str(picture)]) == 0
    shown = capsys.readouterr().out
    assert MultipleJointChain.from_text(texts[1]).key in shown and picture.read_text().count("multiple joint") == 4
    for wrong in (["--multiple-joints", "two"], ["--multiple-joints", "1", "--p2", "1"]):
        assert main(["count", "--links", "8", *wrong]) == 2
