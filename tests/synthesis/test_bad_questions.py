"""Arguments of the enumerator that are not what they should be; texts of graphs with many links."""

from __future__ import annotations

import pytest

from graphsynth import (
    StructuralSpec,
    count_assur_groups,
    count_baranov_trusses,
    count_chains,
    enumerate_assur_groups,
    enumerate_chains,
    sample_mechanisms,
)
from graphsynth.core.errors import SpecError
from graphsynth.synthesis import chunks
from graphsynth.synthesis.problem import EnumerationProblem

SIX = StructuralSpec(W=1, links=6)


@pytest.mark.parametrize("bad", ["x", None, 1.5, True, (1,), object()])
@pytest.mark.parametrize(
    "call",
    [
        count_assur_groups, enumerate_assur_groups, count_baranov_trusses, count_chains, enumerate_chains,
        lambda bad: sample_mechanisms(SIX, 1, bad), lambda bad: sample_mechanisms(SIX, bad, 1),
    ],
    ids=["groups", "groups listed", "trusses", "chains", "chains listed", "seed", "draws"],
)  # fmt: skip
def test_numbers_that_are_none(call, bad):
    with pytest.raises(SpecError, match="whole number"):
        call(bad)


@pytest.mark.parametrize("bad", [3, "2:1", [(2, 1)], True])
def test_joints_that_are_no_mapping(bad):
    with pytest.raises(SpecError, match="mapping"):
        count_chains(6, joints_by_mobility=bad)


@pytest.mark.parametrize("links", [-2, 0])
def test_no_moving_links(links):
    with pytest.raises(SpecError, match=f"moving links = {links} "):
        count_assur_groups(links)


@pytest.mark.parametrize(
    "problem",
    [
        EnumerationProblem.chains(8, 1, 3, None, False, None), EnumerationProblem.chains(6, 1, 3, {2: 1}, False, None),
        EnumerationProblem.mechanisms(SIX, None), EnumerationProblem.chains(5, 1, 2, None, False, None),
    ],
    ids=lambda problem: problem.title,
)  # fmt: skip
def test_texts_of_many_links_are_those_of_few(problem, monkeypatch):
    """Beyond 62 links graph6 writes their number in four bytes: the graph writes itself then."""
    pieces = problem.work_items(listing=True)
    expected = b"".join(text for piece in pieces for text, _ in piece.texts())
    monkeypatch.setattr(chunks, "_ONE_BYTE", 1)
    blocks = [block for piece in pieces for block in piece.texts()]
    assert b"".join(text for text, _ in blocks) == expected
    assert sum(lines for _, lines in blocks) == expected.count(b"\n")
