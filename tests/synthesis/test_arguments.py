"""What the enumerator and structural questions take for a number, and what they say to anything else."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from graphsynth import (
    MechanismGraph,
    StructuralSpec,
    count_assur_groups,
    count_baranov_trusses,
    count_chains,
    count_mechanisms,
    enumerate_chains,
    sample_mechanisms,
)
from graphsynth.cli import main
from graphsynth.core.errors import GraphError, GraphsynthError, SpecError
from graphsynth.structure.system.variables import Counts
from graphsynth.synthesis.problem import EnumerationProblem

SIX = StructuralSpec(W=1, links=6)
HUGE = 10**5000
NOT_NUMBERS = [
    None,
    "x",
    1.5,
    float("nan"),
    np.float64(2.0),
    np.array([1, 2]),
    True,
    np.bool_(True),
    [],
    {},
    b"a",
    HUGE,
]


@pytest.mark.parametrize("kind", [np.int64, np.uint8, np.int32, np.array])
def test_whole_numbers_of_numpy(kind):
    assert count_chains(kind(8), kind(1), space=kind(3)) == 16
    assert count_chains(kind(6), joints_by_mobility={int(kind(2)): kind(2)}, symmetry=kind(2)) == count_chains(
        6, joints_by_mobility={2: 2}, symmetry=2
    )
    assert count_chains(kind(9), kind(2), fractionated=np.bool_(True)) == 40
    assert len(list(enumerate_chains(kind(6)))) == 2
    assert count_assur_groups(kind(4)) == 2 and count_baranov_trusses(kind(5)) == 1
    assert count_mechanisms(StructuralSpec(W=kind(1), links=kind(8)), symmetry=kind(3)) == 1
    assert sample_mechanisms(SIX, kind(3), kind(1)) == sample_mechanisms(SIX, 3, 1)
    assert len(SIX.solve(limit=kind(50))) == len(SIX.solve())
    assert SIX.solve()[0].n_a[kind(9)] == 0
    graph = MechanismGraph(kind(4), [(kind(0), kind(1)), (1, 2), (2, 3), (0, 3)], frame=kind(0))
    assert graph.relabelled(np.array([1, 2, 3, 0])).frame == 1
    assert graph.with_frame(kind(2)).generic_mobility(kind(1)).mobility == 1
    spec = StructuralSpec(W=1, links=8, levels={int(kind(-1 if kind is not np.uint8 else 1)): kind(3)})
    assert list(spec.levels.values()) == [(3, 3)]


def test_numbers_of_numpy_are_the_same_question():
    one, other = (
        EnumerationProblem.chains(8, 1, 3, {2: 0}, False, None),
        EnumerationProblem.chains(np.int64(8), 1, np.uint8(3), None, False, None),
    )
    assert one.signature == other.signature
    assert StructuralSpec(levels={np.int64(1): 2}).levels == {1: (2, 2)}


def test_stored_names_of_questions_stay():
    """Catalogues and journals name a question by its signature: it may not change with the words of the code."""
    six = EnumerationProblem.chains(6, 1, 3, None, True, None)
    assert (six.signature, [item.weight for item in six.work_items(listing=True)]) == ("0a85df02c530983a", [1.0, 2.0])


@pytest.mark.parametrize("bad", NOT_NUMBERS, ids=lambda bad: type(bad).__name__)
def test_anything_else_gets_a_sentence(bad):
    calls = [
        lambda: count_chains(bad), lambda: count_chains(6, bad), lambda: count_chains(6, space=bad),
        lambda: count_chains(6, joints_by_mobility={2: bad}), lambda: count_assur_groups(bad),
        lambda: count_baranov_trusses(bad), lambda: count_mechanisms(bad), lambda: sample_mechanisms(SIX, bad, 1),
        lambda: sample_mechanisms(SIX, 1, bad), lambda: SIX.solve(limit=bad), lambda: SIX.bounds(bad),
        lambda: StructuralSpec.from_toml(bad), lambda: StructuralSpec.from_assignments([bad]),
        lambda: MechanismGraph(3, [(0, 1), (1, 2)]).relabelled(bad),
        lambda: count_mechanisms(dataclasses.replace(SIX.solve()[0], mobility=bad)),
        lambda: count_mechanisms(dataclasses.replace(SIX.solve()[0], p_i=bad)),
    ]  # fmt: skip
    if bad is not None:
        calls += [lambda: count_chains(6, symmetry=bad), lambda: StructuralSpec(levels={1: bad})]
    if type(bad) not in (bool, np.bool_):
        calls += [lambda: count_chains(9, 2, fractionated=bad)]
        calls += [lambda: MechanismGraph(3, [(0, 1), (1, 2)]).generic_mobility(bad)]
    for call in calls:
        with pytest.raises(GraphsynthError) as caught:
            call()
        assert 10 < len(str(caught.value)) < 600


def test_names_of_joint_mobilities():
    with pytest.raises(SpecError, match=r"mobility of a joint = '2' must be a whole number from 1 to 2"):
        count_chains(6, joints_by_mobility={"2": 1})
    with pytest.raises(SpecError, match="p2 = -1 must be a whole number from 0 to 100"):
        count_chains(6, joints_by_mobility={2: -1})


def test_a_permutation_of_floats_is_none():
    with pytest.raises(GraphError, match="permutation"):
        MechanismGraph(3, [(0, 1), (1, 2)]).relabelled([0.0, 1.0, 2.0])


def test_two_links_are_the_smallest_chain():
    assert [count_chains(n) for n in (2, 4, 6, 8)] == [1, 1, 2, 16]  # as OEIS A233288
    assert [graph.to_text() for graph in enumerate_chains(2)] == ["A_"]
    assert count_chains(2, 2) == 0 and count_chains(2, 2, joints_by_mobility={2: 1}, fractionated=True) == 1
    assert count_baranov_trusses(2) == count_assur_groups(1) == 0
    with pytest.raises(SpecError, match="links = 1 must be a whole number from 2 to 255"):
        count_chains(1)


@pytest.mark.parametrize(
    ("question", "why"),
    [
        (["--links", "7"], "8.5 joints of mobility 1, no whole number: ask for 6 or 8 links"),
        (["--links", "4", "--mobility", "3"], "too few for a loop"),
        (["--links", "5", "--p2", "20"], "there are too many others"),
        (["--links", "6", "--p1", "3"], "not 3: leave p1 out"),
        (["--truss", "4"], "ask for 3 or 5 links"),
    ],
)
def test_nothing_comes_with_its_reason(question, why, capsys):
    assert main(["count", *question]) == 0
    said = capsys.readouterr()
    assert said.out.splitlines()[-1] == "0"
    assert said.err.startswith("nothing to count: ") and why in said.err
    assert main(["count", *question, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["count"] == 0 and why in found["reason"]


@pytest.mark.parametrize("name", ["x.pdf", "x.toml", "x.csv.gz", "x.svg"])
def test_a_suffix_that_holds_no_chains(name, tmp_path, capsys):
    assert main(["enumerate", "--links", "6", "-o", str(tmp_path / name)]) == 2
    said = capsys.readouterr().err
    assert "use one of .g6, .txt, .jsonl" in said and said.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_json_lines_by_their_other_suffix(tmp_path):
    assert main(["enumerate", "--links", "6", "-o", str(tmp_path / "x.NDJSON")]) == 0
    assert [json.loads(line)["links"] for line in (tmp_path / "x.NDJSON").read_text().splitlines()] == [6, 6]


def test_kinds_that_are_not_there_are_none():
    assert Counts({2: 6})[np.int64(3)] == 0
