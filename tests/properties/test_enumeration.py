"""What must hold for every enumeration, whatever the question."""

from __future__ import annotations

import math
import random
from collections import Counter
from functools import cache
from itertools import combinations

import networkx as nx
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth import (
    MechanismGraph,
    StructuralSpec,
    count_assur_groups,
    count_baranov_trusses,
    count_chains,
    count_mechanisms,
    enumerate_assur_groups,
    enumerate_baranov_trusses,
    enumerate_chains,
    enumerate_mechanisms,
    sample_mechanisms,
)
from graphsynth.synthesis.chunks import Chunk, cut
from graphsynth.synthesis.families import chain_families
from graphsynth.synthesis.problem import EnumerationProblem, texts
from graphsynth.synthesis.shards import shard_of
from graphsynth.testing import chains, specs

EXACT = settings(deadline=None)  # the first example may compile

CHAINS = [  # links, mobility, options
    (4, 1, {}),
    (6, 1, {}),
    (8, 1, {}),
    (10, 1, {}),
    (5, 2, {}),
    (9, 2, {}),
    (9, 2, {"fractionated": True}),
    (8, 3, {"fractionated": True}),
    (11, 4, {}),
    (5, 1, {"joints_by_mobility": {2: 1}}),
    (6, 1, {"joints_by_mobility": {2: 2}}),
    (7, 1, {"joints_by_mobility": {2: 3}}),
    (7, 2, {"joints_by_mobility": {2: 2}, "fractionated": True}),
    (8, 3, {"joints_by_mobility": {2: 2}}),
    (7, 1, {"space": 2}),
    (5, 1, {"space": 4, "joints_by_mobility": {2: 3}}),
    (6, 1, {"space": 6, "joints_by_mobility": {3: 3}}),
    (6, 4, {"space": 5, "joints_by_mobility": {2: 3, 3: 2}}),
]
SPECS = [
    {"W": 1, "links": 6},
    {"W": 1, "links": 8},
    {"W": 1, "links": 10, "t0": 2},
    {"W": 1, "links": 10, "t0": 4, "n4": 1},
    {"W": 2, "links": 7},
    {"W": 2, "links": 7, "fractionated": True},
    {"W": 3, "links": 8, "fractionated": True},
    {"W": 1, "links": 6, "p2": 2},
    {"W": 2, "links": 6, "p2": 1},
    {"W": 1, "links": 7, "p2": 1, "t0": 3},
]


def lower_mobility(links, mobility, options):
    """Return the joints by mobility that the structural formula asks for."""
    space, higher = options.get("space", 3), options.get("joints_by_mobility", {})
    p1, rest = divmod(space * (links - 1) - mobility - sum(c * (space - i) for i, c in higher.items()), space - 1)
    assert rest == 0
    return {i: c for i, c in {1: p1, **higher}.items() if c}


@cache
def _listed(at):
    links, mobility, options = CHAINS[at]
    return tuple(enumerate_chains(links, mobility, **options))


@pytest.mark.long
@pytest.mark.parametrize("at", range(len(CHAINS)), ids=str)
def test_every_chain_answers_the_question_once(at):
    links, mobility, options = CHAINS[at]
    listed = _listed(at)
    assert listed
    assert len(listed) == count_chains(links, mobility, **options)
    assert len({g.key for g in listed}) == len(listed)
    wanted = lower_mobility(links, mobility, options)
    for g in listed:
        assert (g.links, g.mobility, g.frame, g.space) == (links, mobility, None, options.get("space", 3))
        assert Counter(joint.mobility for joint in g.joints) == wanted
        assert g.is_connected and min(g.degrees) >= 2
        assert options.get("fractionated") or not g.is_fractionated
        assert g.rigid_subchain() is None
        assert sum(g.degrees) == 2 * len(g.joints) == sum(a * n for a, n in g.assortment.items())
        assert MechanismGraph(g.links, g.joints, space=g.space) == g  # the joints are valid and in order


@pytest.mark.parametrize("question", SPECS, ids=str)
def test_every_mechanism_answers_the_question_once(question):
    spec = StructuralSpec(**question)
    listed = list(enumerate_mechanisms(spec))
    assert listed
    assert len(listed) == count_mechanisms(spec) == len({g.key for g in listed})
    solutions = spec.solve()
    for g in listed:
        assert g.frame == 0 and g.mobility == question["W"] and g.rigid_subchain() is None
        assert [link for level in g.levels for link in sorted(level)] == list(range(g.links))  # level by level
        assert MechanismGraph(g.links, g.joints, frame=0) == g
        p_i = Counter(joint.mobility for joint in g.joints)
        assert any(
            s.t0 == g.degrees[0]
            and {a: n for a, n in s.n_a.items() if n} == g.assortment
            and {i: c for i, c in enumerate(s.p_i, 1) if c} == p_i
            for s in solutions
        )


@pytest.mark.long
@pytest.mark.parametrize(
    ("links", "mobility", "options"),
    [c for c in CHAINS if c[0] <= 9 and not {"space", "fractionated"} & set(c[2])] + [(10, 1, {})],
)
def test_frames_are_orbits_of_links(links, mobility, options):
    higher = options.get("joints_by_mobility", {})
    spec = StructuralSpec(W=mobility, links=links, p2=higher.get(2, 0))
    chains = list(enumerate_chains(links, mobility, **options))
    assert count_mechanisms(spec) == sum(len(g.orbits) for g in chains)
    by_inversion = sorted(m.key for g in chains for m in g.inversions())
    assert sorted(m.key for m in enumerate_mechanisms(spec)) == by_inversion


@pytest.mark.long
@pytest.mark.parametrize("links", [5, 7, 9, 11])
def test_assur_groups_are_orbits_of_truss_links(links):
    trusses = list(enumerate_baranov_trusses(links))
    assert len({g.key for g in trusses}) == len(trusses) == count_baranov_trusses(links)
    groups = sorted(m.key for g in trusses for m in g.inversions())
    assert groups == sorted(m.key for m in enumerate_assur_groups(links - 1))
    assert len(groups) == count_assur_groups(links - 1)


# --- orbit-stabiliser -------------------------------------------------------------------------------------------------


def labelled_chains(links, joints):
    """Count labelled 2-connected planar chains without rigid sub-chain by trying every set of joints."""
    pairs = list(combinations(range(links), 2))
    sets = {
        pair: [s for s in range(1 << links) if s >> pair[0] & 1 and s >> pair[1] & 1] for pair in pairs
    }  # the sets of links that a joint lies in
    room = [(3 * (s.bit_count() - 1) - 1) // 2 for s in range(1 << links)]  # joints that a set may have
    degree = [0] * links
    chosen = []

    def extend(at):
        if len(chosen) == joints:
            return min(degree) >= 2 and nx.is_biconnected(nx.Graph(chosen))
        total = 0
        for i in range(at, len(pairs) - (joints - len(chosen)) + 1):
            a, b = pairs[i]
            if a and degree[a - 1] < 2:
                break  # no joint of link a - 1 is left
            if min(room[s] for s in sets[a, b]) < 1:
                continue
            chosen.append((a, b))
            degree[a] += 1
            degree[b] += 1
            for s in sets[a, b]:
                room[s] -= 1
            total += extend(i + 1)
            for s in sets[a, b]:
                room[s] += 1
            degree[b] -= 1
            degree[a] -= 1
            chosen.pop()
        return total

    return extend(0)


@pytest.mark.parametrize(
    ("links", "mobility"), [(4, 1), (6, 1), (5, 2), (7, 2), (6, 3), (7, 4), pytest.param(8, 1, marks=pytest.mark.slow)]
)
def test_orbits_add_up_to_the_labelled_chains(links, mobility):
    orbits = [math.factorial(links) // g.automorphism_order for g in enumerate_chains(links, mobility)]
    assert sum(orbits) == labelled_chains(links, (3 * (links - 1) - mobility) // 2)


# --- completeness: a chain made in another way is among those listed --------------------------------------------------


@cache
def _keys(links):
    return frozenset(g.key for g in enumerate_chains(links))


@pytest.mark.long
@EXACT
@given(chains(4, 10), st.data())
def test_a_chain_with_one_more_dyad_is_listed(chain, data):
    links = chain.links
    a, b = data.draw(st.lists(st.integers(0, links - 1), min_size=2, max_size=2, unique=True))
    joints = [(joint.a, joint.b) for joint in chain.joints]
    grown = MechanismGraph(links + 2, [*joints, (a, links), (links, links + 1), (b, links + 1)])
    assert grown.key in _keys(links + 2)


# --- symmetry ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("prime", [2, 3, 5, 7])
@pytest.mark.parametrize("at", range(len(CHAINS)), ids=str)
def test_required_symmetry_of_chains(at, prime):
    links, mobility, options = CHAINS[at]
    expected = sorted(g.key for g in _listed(at) if g.automorphism_order % prime == 0)
    found = [g.key for g in enumerate_chains(links, mobility, **options, symmetry=prime)]
    assert sorted(found) == expected
    assert count_chains(links, mobility, **options, symmetry=prime) == len(expected)


@pytest.mark.parametrize("prime", [2, 3, 5])
@pytest.mark.parametrize("question", SPECS, ids=str)
def test_required_symmetry_of_mechanisms(question, prime):
    spec = StructuralSpec(**question)
    expected = sorted(g.key for g in enumerate_mechanisms(spec) if g.automorphism_order % prime == 0)
    assert sorted(g.key for g in enumerate_mechanisms(spec, symmetry=prime)) == expected
    assert count_mechanisms(spec, symmetry=prime) == len(expected)


def test_symmetric_families_are_not_empty():
    """The comparisons above say something for 2, 3 and 5."""
    orders = [g.automorphism_order for at in range(len(CHAINS)) for g in _listed(at)]
    assert all(any(order % prime == 0 for order in orders) for prime in (2, 3, 5))


# --- pieces and shards ------------------------------------------------------------------------------------------------

PROBLEMS = [
    EnumerationProblem.chains(10, 1, 3, None, False, None),
    EnumerationProblem.chains(9, 2, 3, None, True, None),
    EnumerationProblem.chains(6, 1, 3, {2: 2}, False, None),
    EnumerationProblem.trusses(9, 3, True),
    EnumerationProblem.mechanisms(StructuralSpec(W=1, links=8), None),
    EnumerationProblem.chains(5, 1, 3, None, False, None),  # none at all
]


@cache
def _text(at):
    return b"".join(data for data, _ in texts(PROBLEMS[at].work_items(listing=True), None))


def _atoms(piece):
    """What a piece consists of that no shard cuts: contracted graphs, parts of one, a handful."""
    if not isinstance(piece, Chunk) or piece.parts > 1:
        return [piece]
    return [(piece.family, graph) for graph in range(piece.start, piece.stop)]


@pytest.mark.long
@EXACT
@given(st.integers(0, len(PROBLEMS) - 1), st.integers(1, 40))
def test_shards_one_after_the_other_are_the_whole(at, shards):
    pieces = PROBLEMS[at].work_items(listing=True)
    cuts = [shard_of(pieces, (i, shards)) for i in range(1, shards + 1)]
    assert [atom for shard in cuts for piece in shard for atom in _atoms(piece)] == [
        atom for piece in pieces for atom in _atoms(piece)
    ]
    assert b"".join(data for shard in cuts for data, _ in texts(shard, None)) == _text(at)


@pytest.mark.parametrize("at", range(len(PROBLEMS)))
def test_text_is_the_text_of_the_graphs(at):
    from graphsynth.synthesis.problem import graphs

    lines = [g.to_text() for g in graphs(PROBLEMS[at].work_items(listing=True), None)]
    assert "".join(f"{line}\n" for line in lines).encode() == _text(at)
    assert sum(lines for _, lines in texts(PROBLEMS[at].work_items(listing=True), None)) == len(lines)


@pytest.mark.long
@settings(EXACT, max_examples=25)
@given(st.integers(2, 60), st.integers(0, 10**6))
def test_a_contracted_graph_may_be_cut_into_any_parts(parts, pick):
    families = [f for f in chain_families(10, 1, 3, {}, True) + chain_families(11, 0, 3, {}, False) if len(f.graphs)]
    family = families[pick % len(families)]
    at = pick // len(families) % len(family.graphs)
    whole = [g.packed for g in Chunk(family, at, at + 1).graphs()]
    pieces = [g.packed for part in range(parts) for g in Chunk(family, at, at + 1, part, parts).graphs()]
    assert sorted(pieces) == sorted(whole)


@pytest.mark.parametrize("size", [1.0, 50.0, 3000.0])
def test_the_size_of_pieces_does_not_matter(monkeypatch, size):
    families = chain_families(10, 1, 3, {}, False)
    whole = b"".join(data for chunk in cut(families, listing=True) for data, _ in chunk.texts())
    monkeypatch.setattr("graphsynth.synthesis.chunks.LISTING_SIZE", size)
    small = [data for chunk in cut(families, listing=True) for data, _ in chunk.texts()]
    assert sorted(b"".join(small).splitlines()) == sorted(whole.splitlines())


# --- sampling ---------------------------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize(
    "question", [{"W": 1, "links": 6}, {"W": 1, "links": 8}, {"W": 1, "links": 6, "p2": 2, "t0": 3}]
)
def test_samples_are_uniform_over_classes(question):
    from scipy.stats import chisquare

    spec = StructuralSpec(**question)
    population = {g.key: g.automorphism_order for g in enumerate_mechanisms(spec)}
    assert len(set(population.values())) > 1  # symmetric ones and others: both must be as likely
    drawn = Counter(g.key for g in sample_mechanisms(spec, 25 * len(population), seed=20))
    assert set(drawn) <= set(population)
    assert chisquare([drawn[key] for key in population]).pvalue > 1e-3
    # Symmetric and asymmetric ones taken together: a bias by the order of the group would show here first.
    by_order = Counter()
    for key, times in drawn.items():
        by_order[population[key]] += times
    sizes = Counter(population.values())
    orders = sorted(sizes)
    assert chisquare([by_order[o] for o in orders], [25 * sizes[o] for o in orders]).pvalue > 1e-3


def test_a_seed_fixes_the_sample():
    spec = StructuralSpec(W=1, links=10)
    assert sample_mechanisms(spec, 10, seed=3) == sample_mechanisms(spec, 10, seed=3)
    assert sample_mechanisms(spec, 10, seed=3) != sample_mechanisms(spec, 10, seed=4)
    assert sample_mechanisms(spec, 0, seed=3) == []


@EXACT
@given(st.integers(0, 10**9))
def test_keys_do_not_depend_on_labels(seed):
    rng = random.Random(seed)
    g = rng.choice(_listed(rng.randrange(len(CHAINS))))
    names = list(range(g.links))
    rng.shuffle(names)
    other = g.relabelled(names)
    assert (other.key, other.automorphism_order) == (g.key, g.automorphism_order)


# --- questions drawn at random ----------------------------------------------------------------------------------------


@settings(max_examples=12, deadline=None)
@given(specs(4, 6))
def test_counts_are_lengths_of_lists(spec):
    listed = list(enumerate_mechanisms(spec))
    assert len(listed) == count_mechanisms(spec) == len({g.key for g in listed})
    assert all(g.frame is not None and g.rigid_subchain() is None for g in listed)
    assert {g.key for g in listed} <= {g.key for g in enumerate_mechanisms(StructuralSpec(W=1, n=spec_links(spec)))}


def spec_links(spec):
    """Moving links of a question of `specs`: always given."""
    return next(a.n for a in spec.solve())
