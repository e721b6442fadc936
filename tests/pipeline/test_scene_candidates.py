"""Which mechanisms become candidates: given ones, filtered ones, drawn ones; counts against the enumerator."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from graphsynth.core.errors import SceneError
from graphsynth.pipeline.runner import execute
from graphsynth.pipeline.scene import Scene
from graphsynth.structure.graph import MechanismGraph

FOUR_BAR = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
WATT = MechanismGraph(6, [(0, 1), (1, 2), (2, 3), (0, 3), (2, 4), (4, 5), (3, 5)], frame=0)


def candidates(tables: dict[str, Any], structure: Mapping[str, Any], seed: int = 0) -> list[MechanismGraph]:
    tables["structure"] = structure
    tables["outputs"]["products"] = ["candidates"]
    tables["scene"]["seed"] = seed
    return [candidate.graph for candidate in execute(Scene.from_mapping(tables, "x.toml"))["candidates"]]


def test_given_graphs(lambda_tables: dict[str, Any]) -> None:
    found = candidates(lambda_tables, {"graphs": [FOUR_BAR.key, WATT.to_text()]})
    assert [graph.key for graph in found] == [FOUR_BAR.key, WATT.key]


def test_a_given_four_bar_is_recognised_and_assessed(lambda_tables: dict[str, Any]) -> None:
    lambda_tables["structure"] = {"graphs": [WATT.key, FOUR_BAR.key]}
    lambda_tables["outputs"]["products"] = ["records"]
    records = execute(Scene.from_mapping(lambda_tables))["records"]
    assert [record.status for record in records] == ["not recognised", "assessed"]


K33 = MechanismGraph(6, [(a, b) for a in (0, 1, 2) for b in (3, 4, 5)], frame=0)


def test_planar_leaves_out_what_cannot_be_drawn(lambda_tables: dict[str, Any]) -> None:
    graphs = [WATT.key, K33.key, FOUR_BAR.key]
    assert len(candidates(lambda_tables, {"graphs": graphs})) == 3
    found = candidates(lambda_tables, {"graphs": graphs, "generate": {"planar": True}})
    assert [graph.key for graph in found] == [WATT.key, FOUR_BAR.key]


def test_a_sample_is_of_the_question_and_of_the_seed(lambda_tables: dict[str, Any]) -> None:
    structure = {"question": {"W": 1, "links": 8}, "generate": {"sample": 20}}
    first = [g.key for g in candidates(lambda_tables, structure, seed=1)]
    assert first == [g.key for g in candidates(lambda_tables, structure, seed=1)]
    assert first != [g.key for g in candidates(lambda_tables, structure, seed=2)]
    assert len(set(first)) == len(first) <= 20
    everything = {g.key for g in candidates(lambda_tables, {"question": {"W": 1, "links": 8}})}
    assert len(everything) == 71 and set(first) <= everything


@pytest.mark.parametrize(
    ("structure", "message"),
    [
        ({}, "either a table question or a list graphs"),
        ({"question": {"W": 1}, "graphs": ["x"]}, "either a table question or a list graphs"),
        ({"graphs": [FOUR_BAR.key], "generate": {"sample": 3}}, "generate.sample of graphs that are given"),
        ({"graphs": [FOUR_BAR.key], "generate": {"symmetry": 3}}, "generate.symmetry of graphs that are given"),
        ({"question": {"W": 1, "links": 6}, "generate": {"sample": 0}}, "sample 0; draw 1 to 10000, the limit"),
        ({"question": {"W": 1, "links": 6}, "generate": {"sample": 10**9}}, "draw 1 to 10000, the limit"),
        ({"question": {"W": 1, "links": 4}, "generate": {"symmetry": 3}}, "gives no candidate"),
        ({"graphs": ["1abc"]}, r"\[structure.graphs.0\] is neither a canonical key nor"),
    ],
)
def test_structures_that_make_no_sense(
    lambda_tables: dict[str, Any], structure: Mapping[str, Any], message: str
) -> None:
    with pytest.raises(SceneError, match=message):
        candidates(lambda_tables, structure)
