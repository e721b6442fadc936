"""Random questions of every kind against trying everything: numbers and keys of the answers are equal."""

from __future__ import annotations

import coloured
import pytest
from coloured import Question
from some_questions import ASKED, asked

from graphsynth import (
    Wishes,
    count_chains,
    count_multiple_joint_chains,
    count_slider_chains,
    enumerate_chains,
    enumerate_multiple_joint_chains,
    enumerate_slider_chains,
)
from graphsynth.cli.main import main
from graphsynth.core.errors import SpecError
from graphsynth.synthesis.problem import EnumerationProblem


def check(numbers, *, large):
    for number in numbers:
        question = coloured.question(number, large=large)
        keys, choices = coloured.answers(question)
        listed, count = asked(question)
        assert (count, len(listed)) == (len(keys), len(keys)), (number, question)
        assert {answer.key for answer in listed} == keys, (number, question)
        if question.roles != (0, 0):
            assert sum(len(graph.roles(*question.roles)) for graph in listed) == choices, (number, question)


@pytest.mark.long
def test_some_questions():
    check(range(40), large=False)


@pytest.mark.long
def test_numbers_of_some_questions_are_those_of_trying_everything():
    """The changes of the orbit engine are measured against these numbers (``tests/mutation``)."""
    for question, number in ASKED:
        keys, _ = coloured.answers(question)
        listed, count = asked(question)
        assert {answer.key for answer in listed} == keys, question
        assert (count, len(listed)) == (number, number) == (len(keys), len(keys)), question


@pytest.mark.slow
@pytest.mark.parametrize("tenth", range(10))
def test_a_thousand_questions(tenth):
    check(range(1000 + 100 * tenth, 1100 + 100 * tenth), large=True)


@pytest.mark.parametrize(
    ("links", "mobility", "symmetry"),
    [(9, 2, None), (10, 1, 3), *(pytest.param(10, 1, p, marks=pytest.mark.long) for p in (None, 2))],
)
def test_wishes_that_the_search_takes_over_are_counted_without_a_list(links, mobility, symmetry):
    """Counts by the dynamic program, beside the filter behind the list."""
    wishes = [
        *(Wishes(girth=girth) for girth in (4, 5, 6)),
        *(Wishes(**{name: [pair]}) for name in ("jointed", "apart") for pair in ((3, 3), (3, 4), (4, 4))),
        Wishes(girth=5, jointed=[(3, 3)], apart=[(3, 4), (4, 4)]),
    ]
    chains = list(enumerate_chains(links, mobility, symmetry=symmetry))
    for wish in wishes:
        assert wish.is_searched
        keys = sorted(chain.key for chain in chains if wish.fit(chain))
        assert count_chains(links, mobility, symmetry=symmetry, wishes=wish) == len(keys), wish
        listed = enumerate_chains(links, mobility, symmetry=symmetry, wishes=wish)
        assert sorted(chain.key for chain in listed) == keys


def test_wishes_at_the_command_line(capsys, tmp_path):
    def counted(line):
        assert main(["count", *line.split()]) == 0
        return int(capsys.readouterr().out.split()[-1])

    assert counted("--links 8 --girth 5") == counted("--links 8 --without Cl") == 1
    assert counted("--links 8 --contains Cl") == 15
    assert counted("--links 10 --jointed 4-4 --apart 3-3 --planar yes") == 14
    assert counted("--links 9 --mobility 2 --mobility-type total") == 6
    assert main(["enumerate", "--links", "8", "--sliders", "1", "--girth", "5", "-o", str(tmp_path / "a.txt")]) == 0
    assert {line.split()[0] for line in (tmp_path / "a.txt").read_text().splitlines()} == {"G`iRA_"}


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"girth": 2}, "girth = 2 must be a whole number from 3 to 15"),
        ({"jointed": [(3,)]}, "must be pairs of links"),
        ({"apart": 3}, "must be pairs of links"),
        ({"jointed": [("drum", 3)]}, "joints of a link = 'drum' must be a whole number, at least 1"),
        ({"contains": "Cl"}, "must be a list of MechanismGraph"),
        ({"planar": "yes"}, "planar = 'yes' must be True, False or None"),
        ({"mobility_type": "half"}, "must be one of total, partial, fractionated"),
    ],
)
def test_wishes_that_are_none(wrong, said):
    with pytest.raises(SpecError, match=said):
        Wishes(**wrong)


def test_chains_that_can_have_no_wishes(capsys):
    with pytest.raises(SpecError, match="must be Wishes"):
        count_chains(6, wishes={"girth": 4})
    assert main(["count", "--links", "6", "--gear-trains", "--planar", "no"]) == 2
    assert "the axes of a gear train do not have" in capsys.readouterr().err


def test_wishes_for_cylinders_are_counted_without_a_list():
    """The search takes them over where every prismatic joint is a cylinder's, by the filter elsewhere."""
    chains = list(enumerate_slider_chains(9, 2, 2, cylinders=True, framed=True))
    for wish in (Wishes(girth=5), Wishes(jointed=[(3, 3)]), Wishes(girth=5, apart=[(3, 3)]), Wishes(planar=False)):
        number = sum(map(wish.fit, chains))
        assert count_slider_chains(9, 2, 2, cylinders=True, framed=True, wishes=wish) == number < len(chains)
        searched = EnumerationProblem.sliders(9, 2, 2, False, False, True, True).wishing(wish)
        assert (searched.wishes is None) == wish.is_searched
    assert EnumerationProblem.sliders(9, 2, 2, False, False, False, True).wishing(Wishes(girth=5)).wishes


@pytest.mark.parametrize(
    ("links", "mobility", "framed", "girths"),
    [
        (9, 2, False, {4: 174, 5: 10}),
        pytest.param(9, 2, True, {5: 56, 6: 0}, marks=pytest.mark.long),
        pytest.param(10, 3, False, {4: 463, 5: 67, 6: 0}, marks=pytest.mark.long),
    ],
)
def test_girth_of_multiple_joints_is_counted_without_a_list(links, mobility, framed, girths):
    """In halves of a joint, which paths between multiple joints have less of."""
    chains = list(enumerate_multiple_joint_chains(links, mobility, framed=framed))
    for girth, number in girths.items():
        wish = Wishes(girth=girth)
        assert EnumerationProblem.multiple_joints(links, mobility, None, framed=framed).wishing(wish).wishes is None
        assert count_multiple_joint_chains(links, mobility, framed=framed, wishes=wish) == number
        listed = [chain.key for chain in enumerate_multiple_joint_chains(links, mobility, framed=framed, wishes=wish)]
        assert sorted(listed) == sorted(chain.key for chain in chains if wish.fit(chain)) and len(listed) == number


@pytest.mark.long
def test_wishes_for_multiple_joints():
    """A wish of each kind that tells chains of eight or nine links apart."""
    told = [
        (8, 1, True, Wishes(jointed=[("frame", 3)], apart=[(3, 3)])),
        (8, 1, False, Wishes(jointed=[(2, 4)])),
        (9, 2, False, Wishes(girth=5)),
        (9, 2, False, Wishes(mobility_type="total", without=[coloured.FOUR_BAR])),
        (9, 2, True, Wishes(contains=[coloured.STAR_FRAME, coloured.FIVE_BAR], planar=True)),
    ]
    for links, mobility, framed, wish in told:
        more = {"multiple": 2, "framed": framed, "wishes": wish}
        expected, _ = coloured.answers(Question("multiple", links, mobility, framed, 2, wishes=wish))
        found = [chain.key for chain in enumerate_multiple_joint_chains(links, mobility, **more)]
        assert set(found) == expected and len(found) == len(expected) > 0, wish
        whole = count_multiple_joint_chains(links, mobility, multiple=2, framed=framed)
        assert count_multiple_joint_chains(links, mobility, **more) == len(found) < whole, wish
