"""The structural question: the worked example, reading rules, aliases, contradictions, bad input."""

from __future__ import annotations

import copy
import itertools
import math
import pickle
import time

import networkx
import numpy
import pytest

import graphsynth
from graphsynth import LinkAssortment, StructuralSpec
from graphsynth.core.errors import InfeasibleSpecError, SpecError, TooLargeError
from graphsynth.structure.system.assortment import solutions_table

SOURCE = {"W": 1, "Pi": 3, "v_ct": 6, "p": 22, "p2": 3, "n": 14, "t0": 7}
FIVE = [(5, 9, 0), (6, 7, 1), (7, 5, 2), (8, 3, 3), (9, 1, 4)]

FIGURE_3 = [(0, 1), (0, 2), (0, 3), (0, 4), (2, 5), (3, 6), (4, 7), (5, 8), (6, 9), (7, 10), (0, 8), (0, 9), (0, 10)]
FIGURE_3 += [(8, 11), (9, 12), (10, 13), (11, 14), (12, 14), (13, 14)]
GEARS = [(1, 2), (1, 3), (1, 4)]


def kinds(solutions):
    return [(s.n2, s.n3, s.n4) for s in solutions]


# ---- the worked example ----------------------------------------------------------------------------------------


def test_the_worked_example_has_its_five_solutions_in_order():
    solutions = StructuralSpec(**SOURCE).solve()
    assert kinds(solutions) == FIVE
    for s in solutions:
        assert (s.p1, s.p2, s.G, s.v, s.v_P, s.v_ct, s.t0, s.W, s.N) == (19, 3, 25, 8, 2, 6, 7, 1, 15)
        assert sum(s.n_a.values()) == 14
        s.check()


def test_n4_makes_it_the_solution_of_the_source():
    (only,) = StructuralSpec(**SOURCE, n4=1).solve()
    assert (only.n2, only.n3, only.n4) == (6, 7, 1)
    assert str(only) == "n2=6 n3=7 n4=1 | p1=19 p2=3 | t0=7"


@pytest.mark.parametrize(
    "question",
    [
        {"mobility": 1, "space": 3, "frame_loops": 6, "joints": 22, "joints_by_mobility": {2: 3}, "links": 15},
        {"W": 1, "t0": 7, "p": 22, "p_i": {1: 19, 2: 3}, "N": 15},
        {"W": 1, "t0": 7, "v": 8, "p2": 3, "moving_links": 14},
        {"G": 25, "moving_loops": 2, "loops": 8, "t0": 7, "p2": (3, 3), "n": 14, "links": 15},
    ],
)
def test_other_ways_to_state_it(question):
    assert kinds(StructuralSpec(**question).solve()) == FIVE


def test_worked_example_is_fast():
    """In no more than three times the processor time of a hundred thousand sums in Python."""
    spec = StructuralSpec(**SOURCE)

    def least(work):
        best = math.inf
        for _ in range(7):
            start = time.process_time()
            work()
            best = min(best, time.process_time() - start)
        return best

    def sums():
        total = 0
        for k in range(100_000):
            total += k
        return total

    assert least(spec.solve) <= 3.0 * least(sums)


def test_without_the_limit_of_the_source_there_are_28():
    everything = StructuralSpec(**SOURCE, max_link_joints="all").solve()
    # Independent count: multisets of 14 numbers in 2..9 with sum 37, as partitions of 37 - 2*14 = 9 into parts <= 7.
    partitions = {0: 1}
    for part in range(1, 8):
        partitions = {
            total: sum(partitions.get(total - part * k, 0) for k in range(total // part + 1)) for total in range(10)
        }
    assert len(everything) == partitions[9] == 28
    assert [s for s in everything if s.max_link_joints <= 4] == StructuralSpec(**SOURCE).solve()


def rigid_subset(joints, weight, links):
    """Some set of links with DOF <= 0, by looking at all of them."""
    masks = [((1 << a) | (1 << b), w) for (a, b), w in zip(joints, weight)]
    for subset in range(1, 1 << links):
        freedom = 3 * (subset.bit_count() - 1) - sum(w for mask, w in masks if subset & mask == mask)
        if subset.bit_count() >= 2 and freedom < 1:
            return subset
    return None


def test_the_limit_of_the_source_is_a_choice_and_not_a_law():
    """A five-joint moving link occurs in an admissible mechanism with the totals of the worked example."""
    joints = [(1, 11) if joint == (8, 11) else joint for joint in FIGURE_3] + GEARS
    degrees = [sum(link in joint for joint in joints) for link in range(15)]
    assert rigid_subset(joints, [2] * 19 + [1] * 3, 15) is None
    assert 3 * 14 - 2 * 19 - 3 == 1
    assert degrees[0] == 7
    assert max(degrees[1:]) == 5
    found = [s for s in StructuralSpec(**SOURCE, max_link_joints="all").solve() if s.n5 == 1 and s.n2 == 7]
    assert [dict(s.n_a) for s in found] == [{2: 7, 3: 6, 5: 1}]


def test_mentioning_a_larger_kind_opens_it():
    assert {s.n5 for s in StructuralSpec(**SOURCE, n5=(0, None)).solve()} == {0, 1, 2, 3}
    assert kinds(StructuralSpec(**SOURCE, n5=0).solve()) == FIVE


def test_the_limit_of_the_source_never_makes_a_question_infeasible():
    solutions = StructuralSpec(**SOURCE, n2=10).solve()
    assert [dict(s.n_a) for s in solutions] == [{2: 10, 4: 3, 5: 1}, {2: 10, 3: 1, 4: 1, 5: 2}]


@pytest.mark.parametrize("links", [10, 12, 14])
def test_families_are_never_truncated(links):
    """Every partition of the excess over binary links occurs, with every frame."""
    loops = links // 2 - 1
    solutions = StructuralSpec(W=1, links=links).solve()
    assert max(s.max_link_joints for s in solutions) == loops + 1
    seen = {(s.t0, tuple(s.n_a.items())) for s in solutions}
    expected = set()
    for degrees in itertools.combinations_with_replacement(range(2, loops + 2), links - 1):
        frame = 2 * (3 * links // 2 - 2) - sum(degrees)
        if 2 <= frame <= loops + 1:
            expected.add((frame, tuple(sorted((a, degrees.count(a)) for a in set(degrees)))))
    assert seen == expected
    assert len(solutions) == len(expected)


@pytest.mark.parametrize("question", [{"W": 1, "links": 8}, {"W": 1, "links": 8, "p2": 2}, {"W": 2, "n": 8, "p": 11}])
def test_fixing_the_frame_only_filters(question):
    """Outside the source's form, a further value never removes other solutions than those it contradicts."""
    whole = StructuralSpec(**question).solve()
    parts = [s for t0 in sorted({s.t0 for s in whole}) for s in StructuralSpec(**question, t0=t0).solve()]
    assert not StructuralSpec(**question, t0=3).is_source_form
    assert set(parts) == set(whole)
    assert len(parts) == len(whole)


# ---- rules of reading ------------------------------------------------------------------------------------------


def test_four_bar():
    (only,) = StructuralSpec(W=1, n=3).solve()
    assert (only.p_i, dict(only.n_a), only.t0, only.v_P) == ((4, 0), {2: 3}, 2, 0)


def test_joint_mobilities_that_are_not_mentioned_do_not_occur():
    assert {s.p_i for s in StructuralSpec(W=1, n=5).solve()} == {(7, 0)}
    assert {s.p_i for s in StructuralSpec(W=1, n=5, max_joint_mobility=2).solve()} == {
        (7, 0), (6, 2), (5, 4), (4, 6), (3, 8), (2, 10), (1, 12), (0, 14),
    }  # fmt: skip
    # RSSR-like: one loop in space needs seven freedoms; p2 and p4, p5 are not mentioned, so only p1 and p3 remain.
    assert {s.p_i for s in StructuralSpec(W=1, Pi=6, n=4, v=1, p3=1).solve()} == {(4, 0, 1, 0, 0)}


def test_joints_beyond_lower_pairs_force_higher_pairs():
    assert {s.p_i for s in StructuralSpec(W=1, n=4, p=6).solve()} == {(5, 1)}
    assert {s.p_i for s in StructuralSpec(W=1, n=14, G=25).solve()} == {(19, 3)}


def test_plane_is_the_default_and_space_can_be_asked():
    spec = StructuralSpec(W=1, n=3)
    assert spec.bounds("Pi") == (3, 3)
    assert spec == StructuralSpec(mobility=1, moving_links=3)
    spatial = StructuralSpec(W=1, Pi=(2, 6), n=(1, 6), p=(1, 7), max_joint_mobility=1, max_link_joints=2, v=1).solve()
    assert [(s.Pi, s.N) for s in spatial] == [(2, 3), (3, 4), (4, 5), (5, 6), (6, 7)]


def test_bennett_linkage_has_negative_mobility_by_the_formula():
    (only,) = StructuralSpec(Pi=6, n=3, p=4, max_joint_mobility=1).solve()
    assert only.W == -2


def test_every_named_quantity_can_be_read_by_symbol_and_by_name():
    s = StructuralSpec(**SOURCE, n4=1).solve()[0]
    pairs = ["W", "mobility", "Pi", "space", "n", "moving_links", "N", "links", "p", "joints", "v", "loops"]
    pairs += ["v_ct", "frame_loops", "v_P", "moving_loops", "t0", "frame_joints", "G", "sub_edges"]
    pairs += ["n_a", "links_by_joints"]
    for symbol, name in zip(pairs[::2], pairs[1::2]):
        assert getattr(s, symbol) == getattr(s, name)
    assert s.joints_by_mobility == {1: 19, 2: 3}
    assert (s.n7, s.p5) == (0, 0)
    with pytest.raises(AttributeError, match="n02"):
        _ = s.n02
    assert s.as_dict()["n_a"] == {"2": 6, "3": 7, "4": 1}


def test_fractionated_adds_parts():
    plain = StructuralSpec(W=2, links=7).solve()
    wide = StructuralSpec(W=2, links=7, fractionated=True).solve()
    assert set(plain) <= set(wide)
    assert {s.frame_parts for s in wide} == {1, 2}
    # Two four-bar loops sharing a moving link with four joints: v + 2, more than any other chain allows.
    assert any(s.n4 == 1 and s.v == 2 for s in wide)
    for s in wide:
        s.check()


def admissible_chains(most_links):
    """Connected graphs without rigid sub-chain and with at least two joints on every link, by brute force."""
    for graph in networkx.graph_atlas_g():
        links = len(graph)
        if not 4 <= links <= most_links or not networkx.is_connected(graph):
            continue
        joints = list(graph.edges)
        if min(dict(graph.degree).values()) >= 2 and rigid_subset(joints, [2] * len(joints), links) is None:
            yield graph


def test_every_admissible_chain_with_any_frame_is_a_solution():
    """Soundness of the natural bounds: nothing that exists is cut off (all chains with up to seven links)."""
    answers: dict[tuple[int, int, bool], set[LinkAssortment]] = {}
    seen = 0
    for graph in admissible_chains(7):
        mobility = 3 * (len(graph) - 1) - 2 * graph.number_of_edges()
        fractionated = not networkx.is_biconnected(graph)
        question = (mobility, len(graph), fractionated)
        if question not in answers:
            answers[question] = set(StructuralSpec(W=mobility, links=len(graph), fractionated=fractionated).solve())
        for frame in graph:
            degrees = [graph.degree[link] for link in graph if link != frame]
            rest = graph.subgraph(set(graph) - {frame})
            parts = networkx.number_connected_components(rest)
            matching = [
                s
                for s in answers[question]
                if dict(s.n_a) == {a: degrees.count(a) for a in set(degrees)}
                and (s.t0, s.frame_parts) == (graph.degree[frame], parts)
                and s.v_P == rest.number_of_edges() - rest.number_of_nodes() + parts
            ]
            assert len(matching) == 1
            seen += 1
    assert seen > 40


# ---- contradictions and open questions -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("question", "words"),
    [
        ({"W": 1, "p": 22, "p2": 3, "n": 14, "v": 7}, ["n = 14", "p = 22", "v = 7", "v = p - n"]),
        ({**SOURCE, "t0": 6}, ["t0 = 6", "v_ct = 6", "t0 = v_ct + 1"]),
        ({"W": 1, "n": 4}, ["W = 1", "n = 4", "joints of mobility 1 only", "W = G - v*Pi", "max_joint_mobility"]),
        ({"W": 1, "n": 3, "t0": 1}, ["t0 = 1", "t0 >= 2"]),
        ({"W": 1, "n": 5, "p4": 1}, ["p4 = 1", "Pi = 3 (default)", "i <= Pi - 1"]),
        ({"W": 1, "n": 5, "n5": 1}, ["n5 = 1", "a <= v + 1"]),
        ({"n": 5, "n2": 3, "n3": (4, 6), "W": 1}, ["n2 = 3", "n3 = 4..6", "n = 5", "n = sum n_a"]),
        ({"G": 10, "p1": 4, "p2": 2, "n": 5}, ["G = 10", "p1 = 4", "p2 = 2", "G = sum i*p_i"]),
        ({"W": 1, "n": 5, "max_link_joints": 2}, ["at most 2 joints on a moving link", "2p = t0 + sum a*n_a"]),
        ({"v": 3, "v_ct": 2, "v_P": 2, "n": 7, "W": 1}, ["v_P = 2", "v_ct = 2", "v = 3", "v = v_ct + v_P"]),
    ],
)
def test_a_contradiction_names_what_clashes(question, words):
    with pytest.raises(InfeasibleSpecError) as caught:
        StructuralSpec(**question).solve()
    message = str(caught.value)
    assert message.startswith("no integer solution: ")
    for word in words:
        assert word in message
    assert set(caught.value.clashes) >= set(words) - {"max_joint_mobility"}


@pytest.mark.parametrize(
    ("question", "clashes"),
    [
        ({"W": 1, "p": 22, "p2": 3, "n": 14, "v": 7}, {"n = 14", "p = 22", "v = 7", "v = p - n"}),
        ({**SOURCE, "t0": 6}, {"t0 = 6", "v_ct = 6", "t0 = v_ct + 1"}),
        ({**SOURCE, "v": 9}, {"n = 14", "p = 22", "v = 9", "v = p - n"}),
        ({**SOURCE, "p1": 18}, {"p = 22", "p1 = 18", "p2 = 3", "p = sum p_i", "joints of mobility 1 or 2 only"}),
        ({"W": 1, "n": 5, "t0": 1}, {"t0 = 1", "t0 >= 2"}),
    ],
)
def test_a_contradiction_names_nothing_else(question, clashes):
    with pytest.raises(InfeasibleSpecError) as caught:
        StructuralSpec(**question).solve()
    assert set(caught.value.clashes) == clashes


@pytest.mark.parametrize(
    ("question", "wanted"),
    [
        ({}, "bound n"),
        ({"W": 1}, "bound n"),
        ({"n": 3}, "bound W"),
        ({"W": 1, "t0": 3}, "bound n"),
        ({"v": 2}, "bound n"),
    ],
)
def test_an_open_question_says_what_to_bound(question, wanted):
    with pytest.raises(SpecError, match=wanted) as caught:
        StructuralSpec(**question).solve()
    assert not isinstance(caught.value, InfeasibleSpecError)


def test_bounds_that_follow_only_from_several_equations_together_suffice():
    (only,) = StructuralSpec(W=1, n2=4, n3=1).solve()
    assert (only.n, only.t0) == (5, 3)


@pytest.mark.parametrize("least", [None, 4])
@pytest.mark.parametrize("most", [None, 6])
def test_links_are_moving_links_and_the_frame(least, most):
    links = [None if number is None else number - 1 for number in (least, most)]
    assert StructuralSpec(W=1, p=7, N=(least, most)).solve() == StructuralSpec(W=1, p=7, n=tuple(links)).solve()


def test_too_many_solutions_are_refused():
    with pytest.raises(TooLargeError, match="more than 100 "):
        StructuralSpec(W=1, n=99).solve(limit=100)
    with pytest.raises(SpecError, match="1000000000000"):
        StructuralSpec(W=1, n=3).solve(limit=10**12 + 1)
    assert next(StructuralSpec(W=1, n=9999).iter_solutions()).v == 4999


# ---- bad input -------------------------------------------------------------------------------------------------

BAD = [True, False, 1.0, float("nan"), float("inf"), "1", b"1", 10**30, -(10**30), object(), {}, set(), (1,), (1, 2, 3)]
BAD += [
    (None, "x"),
    (3, 1),
    (1.0, 2),
    (True, 2),
    [[1], 2],
    1 + 0j,
    numpy.float64(1),
    numpy.array([1, 2, 3]),
    numpy.bool_(True),
]


@pytest.mark.parametrize("value", BAD, ids=lambda value: repr(value).split(" at 0x")[0])
@pytest.mark.parametrize("name", ["W", "links", "p2", "n3", "v_ct"])
def test_a_value_that_is_not_an_integer_or_a_pair(name, value):
    with pytest.raises(SpecError):
        StructuralSpec(**{name: value})


@pytest.mark.parametrize(
    "question",
    [
        {"n": -1}, {"n": 0}, {"N": 1}, {"p": -3}, {"p2": -1}, {"n3": -1}, {"v": -1}, {"t0": 0}, {"G": -1}, {"Pi": 1},
        {"Pi": 7}, {"p0": 1}, {"p6": 1}, {"n1": 1}, {"n0": 1}, {"n02": 1}, {"mobilty": 1}, {"": 1},
        {"links_by_joints": 3}, {"n4": 1, "n_a": {4: 2}}, {"fractionated": 1},
        {"n_a": {1: 2}}, {"n_a": {"x": 2}}, {"p_i": {6: 1}}, {"p_i": {True: 1}}, {"n": 14, "N": 14},
        {"W": 1, "mobility": 2}, {"fractionated": "no"}, {"max_joint_mobility": 0},
        {"max_joint_mobility": 6}, {"max_joint_mobility": (1, 2)}, {"max_link_joints": 1}, {"max_link_joints": "most"},
        {"levels": 3}, {"levels": {"x": 1}}, {"levels": {0: 2}}, {"levels": {-1: 1.5}}, {"levels": {True: 1}},
    ],
    ids=repr,
)  # fmt: skip
def test_a_question_that_makes_no_sense(question):
    with pytest.raises(SpecError) as caught:
        StructuralSpec(**question)
    assert len(str(caught.value)) < 250


def test_the_nearest_name_is_offered():
    with pytest.raises(SpecError, match="did you mean 'mobility'"):
        StructuralSpec(mobilty=1)


def test_numpy_integers_are_integers():
    assert StructuralSpec(W=numpy.int64(1), n=numpy.int32(3)) == StructuralSpec(W=1, n=3)
    assert type(StructuralSpec(W=numpy.int64(1)).W) is int


# ---- behaviour as a value --------------------------------------------------------------------------------------


def test_frozen_hashable_copyable():
    spec = StructuralSpec(**SOURCE, levels={-1: 1}, n5=(None, 2), fractionated=True)
    assert hash(spec) == hash(StructuralSpec(**spec.as_dict()))
    assert copy.deepcopy(spec) == spec == pickle.loads(pickle.dumps(spec)) == eval(repr(spec))
    assert spec != StructuralSpec(**SOURCE)
    with pytest.raises(AttributeError):
        spec.W = 2
    solution = StructuralSpec(**SOURCE).solve()[0]
    assert copy.deepcopy(solution) == solution == pickle.loads(pickle.dumps(solution))
    assert len({solution, copy.copy(solution)}) == 1
    with pytest.raises(AttributeError):
        solution.mobility = 2
    with pytest.raises(AttributeError):
        solution.n_a._items = ()


def test_replace_follows_aliases():
    spec = StructuralSpec(**SOURCE, n4=1)
    assert spec.replace(links=15) == spec
    assert spec.replace(links_by_joints={3: 7}) == StructuralSpec(**SOURCE, n3=7)
    assert spec.replace(n4=None) == StructuralSpec(**SOURCE)
    assert spec.replace(frame_joints=None).t0 is None


def test_reading_a_question():
    spec = StructuralSpec(W=(1, None), links=(4, 8), fractionated=True, levels={-1: (1, 3)}, max_joint_mobility=2)
    assert (spec.W, spec.N, spec.n, spec.Pi, spec.p) == ((1, None), (4, 8), (3, 7), 3, None)
    assert (spec.fixed("Pi"), spec.fixed("n"), spec.levels) == (3, None, {-1: (1, 3)})
    with pytest.raises(AttributeError, match="colour"):
        _ = spec.colour
    text = spec.describe()
    for word in ("W = 1..", "n = 3..7", "level -1: 1..3 links", "fractionated", "joints of mobility 1, 2", "v + W"):
        assert word in text
    assert "max_link_joints" in StructuralSpec(**SOURCE).describe()
    assert "infinitely many" in StructuralSpec(W=1).describe()


def test_a_tampered_assortment_is_caught():
    import dataclasses

    s = StructuralSpec(**SOURCE).solve()[0]
    for field in (
        "mobility",
        "moving_links",
        "joints",
        "loops",
        "frame_loops",
        "moving_loops",
        "frame_joints",
        "sub_edges",
    ):
        with pytest.raises(SpecError, match="breaks"):
            dataclasses.replace(s, **{field: getattr(s, field) + 1}).check()


def test_table():
    header, rows = solutions_table(StructuralSpec(**SOURCE).solve())
    assert header == ["#", "n2", "n3", "n4", "p1", "p2", "W", "Pi", "n", "p", "v", "v_ct", "v_P", "t0", "G"]
    assert rows[1] == [2, 6, 7, 1, 19, 3, 1, 3, 14, 22, 8, 6, 2, 7, 25]
    assert solutions_table([])[1] == []


def test_public_name():
    assert graphsynth.StructuralSpec is StructuralSpec


def test_joints_are_simple() -> None:
    assert StructuralSpec(W=1, links=4, simple_joints=True) == StructuralSpec(W=1, links=4)
    assert StructuralSpec.from_assignments(["W=1", "links=4", "simple_joints=true"]) == StructuralSpec(W=1, links=4)
    for wrong in (False, 1, "true"):
        with pytest.raises(SpecError, match="k - 1 simple joints"):
            StructuralSpec(W=1, links=4, simple_joints=wrong)
