"""Questions that are too large: their estimate, against counts that are known; nothing is waited for."""

from __future__ import annotations

import pytest

from graphsynth import (
    StructuralSpec,
    count_assur_groups,
    count_baranov_trusses,
    count_chains,
    count_mechanisms,
    enumerate_chains,
)
from graphsynth.cli import main
from graphsynth.core.errors import TooLargeError
from graphsynth.structure.system.solving import number_of_solutions, solutions
from graphsynth.synthesis.contracted import contracted_graphs, generate
from graphsynth.synthesis.problem import EnumerationProblem, extrapolated


@pytest.fixture(autouse=True)
def only_shipped_lists(monkeypatch):
    monkeypatch.delenv("GRAPHSYNTH_CONTRACTED", raising=False)


@pytest.mark.parametrize(
    ("question", "known"),
    [
        ((9, 11, 1, 2, {}), 2_039_273),  # counted once with the lists of nine loops
        ((8, 10, 1, 2, {}), 110_132),
        ((7, 16, 1, 3, {}), 19_819_281),
        ((8, 18, 1, 3, {}), 1_535_380_884),
        ((7, 17, 2, 3, {}), 96_314_652),
    ],
)
def test_the_estimate_is_near_what_is_known(question, known):
    assert known / 1.3 < extrapolated(*question) < 1.3 * known


@pytest.mark.long
def test_estimates_of_trusses_and_of_frames():
    assert 0.7 < extrapolated(7, 15, 0, 3, {}) / count_baranov_trusses(15) < 1.3
    assert 0.7 < extrapolated(7, 16, 1, 3, {}, framed=True) / 308_823_067 < 1.3  # counted once
    with pytest.raises(TooLargeError, match="11 independent loops"):  # nothing smaller to count
        count_chains(12, joints_by_mobility={2: 12})


def test_without_anything_smaller_to_count_every_link_may_be_the_frame():
    question = (11, 8, 1, 3, {})  # chains of nine loops less have no links
    assert extrapolated(*question, framed=True) == pytest.approx(8 * extrapolated(*question), rel=1e-12)
    assert extrapolated(*question) > 10 * extrapolated(9, 20, 1, 3, {}) > 1e12  # more loops, far more chains


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: enumerate_chains(20), r"2e\+11 chains.* 4\d hours on one core.*contracted 9.*1.5 GB"),
        (lambda: count_chains(30), "14 independent loops.* years.*cannot be made"),
        (lambda: count_mechanisms(StructuralSpec(W=1, links=20)), r"e\+12 mechanisms.* days"),
        (lambda: count_assur_groups(18), r"1e\+11 groups"),
        (lambda: count_chains(12, space=2), r"5e\+07 chains"),
    ],
)
def test_the_refusal_speaks_of_the_question(call, words):
    with pytest.raises(TooLargeError, match=words.replace("e+0", r"e\+0")) as caught:
        call()
    assert caught.value.estimate > 1e6


def test_a_question_of_minutes_is_not_refused():
    """Nine loops, few links: the contracted graphs that it needs are made when they are asked for."""
    assert len(EnumerationProblem.chains(11, 1, 2, None, False, None).families) == 10
    assert [len(contracted_graphs(9, k)) for k in range(2, 7)] == [1, 9, 126, 1193, 8915]
    anew = generate(9, 5)[9]
    assert all((contracted_graphs(9, k) == anew[k]).all() for k in anew)
    with pytest.raises(TooLargeError, match="no list of contracted graphs with 9 loops"):
        contracted_graphs(9, 12)


@pytest.mark.slow
def test_eleven_links_in_a_space_of_two():
    assert count_chains(11, space=2) == 2_039_273


QUESTIONS = [
    {"n": 12, "p": 17}, {"n": 9, "p": 13, "n3": (1, 4), "n2": (2, None)}, {"W": 1, "n": (3, 9)},
    {"n": 7, "p": 9, "p2": 2}, {"W": 1, "n": (3, 9), "n5": (1, None)},
    {"W": 2, "n": 10, "fractionated": True}, {"n": 8, "p": 12, "n4": (1, 2), "t0": (2, 3)}, {"n": 8, "p": 15, "n8": 1},
    {"Pi": (3, 4), "n": 7, "p": (8, 10), "p3": (0, 2)}, {"W": 1, "Pi": 6, "n": (5, 7), "p2": (0, 3)},
]  # fmt: skip


@pytest.mark.parametrize("question", QUESTIONS, ids=str)
def test_solutions_are_counted_without_being_listed(question):
    reading, first = StructuralSpec(**question)._first()
    assert reading is not None and first is not None
    assert number_of_solutions(reading, 10**9) == sum(1 for _ in solutions(reading))


def test_too_many_solutions_are_refused_with_their_number(capsys):
    with pytest.raises(TooLargeError, match="994456202 integer solutions at least; more than 1000000"):
        StructuralSpec(n=100, p=149).solve()
    with pytest.raises(TooLargeError, match="1471 integer solutions at least; more than 10"):
        StructuralSpec(n=40, p=59).solve(limit=10)
    assert main(["solve", "--moving-links", "100", "--joints", "149"]) == 2
    assert "994456202 integer solutions" in capsys.readouterr().err


def test_a_long_list_of_solutions_is_written_plainly(capsys):
    """A table with lines takes a millisecond a row: 93339 rows took minutes."""
    assert main(["solve", "--moving-links", "26", "--joints", "38"]) == 0
    lines = capsys.readouterr().out.splitlines()
    rows = StructuralSpec(n=26, p=38).solve()
    assert len(rows) > 1000
    start = lines.index(f"{len(rows)} integer solutions")
    assert lines[start + 1].split()[:3] == ["#", "n2", "n3"]
    assert len(lines) == start + 2 + len(rows) and len({len(line) for line in lines[start + 1 :]}) == 1
