"""The shipped press with fits: bounds beside random members, grades that keep the risk, wrong keys."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from graphsynth.core.errors import SceneError
from graphsynth.pipeline.runner import execute
from graphsynth.pipeline.scene import Scene, load_scene

SCENE = Path(__file__).parents[2] / "catalog" / "scenes" / "press_tolerances.toml"


@pytest.fixture(scope="module")
def report():  # type: ignore[no-untyped-def]
    return execute(load_scene("press_tolerances"))


@pytest.mark.slow
def test_bounds_agree_with_random_members(report) -> None:  # type: ignore[no-untyped-def]
    (record,) = report["records"]
    upper = next(m for m in record.margins if m.name == "probability of binding, at most")
    assert upper.guarantee == "certified" and 0.175 < upper.value < 0.195 and upper.error <= 0.015
    risk = report["tables"][0]
    shown = dict(risk.rows)
    assert shown["random members that bind"].endswith(" of 1000")
    bounds, drawn = (
        [float(part.strip(" %")) for part in text.split(" to ")] for text in (risk.rows[0][1], risk.rows[2][1])
    )
    assert drawn[0] <= bounds[1] and bounds[0] <= drawn[1]
    assert shown["proved bounds"] in record.verdict and "(proved)" in record.verdict


@pytest.mark.slow
def test_grades_keep_the_risk_and_cost_no_more_for_more_risk(report) -> None:  # type: ignore[no-untyped-def]
    rows = next(table for table in report["tables"] if table.title == "What less risk costs").rows
    costs = [float(row[1]) for row in rows]
    assert [row[0] for row in rows] == ["10 %", "2 %", "0.2 %"] and costs == sorted(costs)
    assert all(row[3] == "yes" for row in rows)
    (picture,) = report["cost_over_risk"]
    assert "<svg" in picture.svg and "proved" in picture.caption


def changed(**risk: object) -> Scene:
    scene = load_scene("press_tolerances")
    raw = dict(scene.raw)
    raw["mechanism"] = {**raw["mechanism"], "risk": {"samples": 0, "sensitivities": False, **risk}}
    raw["outputs"] = {"products": ["tables"]}
    return replace(Scene.from_mapping(raw), folder=SCENE.parent)


@pytest.mark.long
def test_the_risk_alone() -> None:
    (risk, quantities) = execute(changed(distribution="uniform", width=0.05))["tables"]
    assert risk.rows[0][0] == "proved bounds" and " % to " in risk.rows[0][1]
    assert [row[0] for row in quantities.rows] == ["hole 1-2", "shaft 1-2", "alpha 0-1"]


@pytest.mark.parametrize(
    ("risk", "words"),
    [
        ({"allowed": [0.1]}, "grades and allowed"),
        ({"allowed": [0.1], "grades": [{"quantity": "hole 1-2", "cost": 1}]}, "tolerance_class or range"),
        (
            {"allowed": [1.5], "grades": [{"quantity": "hole 1-2", "cost": 1, "tolerance_class": "F7"}]},
            "outside 0 to 1",
        ),
    ],
)
def test_wrong_keys_are_refused(risk: dict[str, object], words: str) -> None:
    with pytest.raises(SceneError, match=words):
        changed(**risk)


def test_a_quantity_that_does_not_exist_is_told() -> None:
    grades = [{"quantity": "hole 7-8", "cost": 1, "tolerance_class": "F7"}]
    found = execute(changed(allowed=[0.1], grades=grades, width=0.5))
    assert not found["tables"]
