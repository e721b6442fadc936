"""Scenes of a task: what the tables make of the file, what the page and the command give, what is refused."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.cli import main
from graphsynth.core.errors import SceneError
from graphsynth.design import DwellTarget, FunctionTarget, PathTarget, PosesTarget, SwingTarget
from graphsynth.pipeline.runner import execute
from graphsynth.pipeline.scene import Scene, load_scene
from graphsynth.pipeline.summary import sentences

SEGMENT = {"segment": [[0, 0], [4, 0]], "count": 12}


def scene(products: tuple[str, ...] = ("records",), **mechanism: Any) -> Scene:
    own = {"module": "design", "links": [4], "seconds": 20, "answers": 1, **mechanism}
    return Scene.from_mapping(
        {"scene": {"name": "own", "title": "Own"}, "mechanism": own, "outputs": {"products": list(products)}}
    )


def test_tables_make_the_targets_of_the_library() -> None:
    own = scene(
        paths=[SEGMENT, {"svg": "M0 0 L1 1", "count": 5, "inputs": [0, 90], "own_start": True, "point": "Q"}],
        poses=[{"points": [[0, 0], [1, 0]], "angles_deg": [0, 30], "tolerance": 0.2}],
        functions=[{"formula": "x**2", "between": [0, 1], "input_range": 60, "output_range_deg": 30}],
        dwells=[{"span": 60, "start": 10, "weight": 3}],
        swings=[{"least_deg": 40, "time_ratio": 1.2, "link": "ram", "pivot": [1, 2]}],
        pivots=[[0, 0], [3, 3, 4, 5]],
        drive_pivot=[7, 7],
        rank={"size": 0.5},
        transmission_deg=30,
    ).mechanism.task()
    path, drawn, poses, function, dwell, swing = own.targets
    assert isinstance(path, PathTarget) and path.inputs is None and len(path.points) == 12
    assert isinstance(drawn, PathTarget) and drawn.point == "Q" and drawn.own_start
    assert drawn.inputs == pytest.approx(np.radians([0, 22.5, 45, 67.5, 90]))
    assert isinstance(poses, PosesTarget) and poses.turn[1] == pytest.approx(math.pi / 6)
    assert isinstance(function, FunctionTarget) and function.outputs[12] == pytest.approx(math.radians(7.5))
    assert isinstance(dwell, DwellTarget) and dwell.span == pytest.approx(math.pi / 3) and dwell.weight == 3
    assert isinstance(swing, SwingTarget) and swing.most == math.inf and swing.link == "ram"
    assert own.transmission == pytest.approx(math.pi / 6) and own.pivots == ((0.0, 0.0), (3.0, 3.0, 4.0, 5.0))
    assert swing.pivot == (1.0, 2.0) and own.drive_pivot == (7.0, 7.0)
    assert (own.rank["size"], own.rank["error"]) == (0.5, 1.0)


def test_a_link_slides_where_its_tolerance_is_a_length() -> None:
    own = scene(
        swings=[{"stroke": [2, 3], "within": 0.1, "link": "ram"}],
        functions=[{"inputs": [0, 90], "places": [0, 4], "within": 0.2, "link": "valve"}],
        dwells=[{"span": 30, "within": 0.3, "link": "ram"}],
        sliders=2,
    ).mechanism.task()
    function, dwell, swing = own.targets
    assert own.sliding == {"ram", "valve"}
    assert isinstance(swing, SwingTarget) and (swing.least, swing.most, swing.tolerance) == (2, 3, 0.1)
    assert isinstance(function, FunctionTarget) and function.outputs == (0, 4) and function.tolerance == 0.2
    assert isinstance(dwell, DwellTarget) and dwell.slides and dwell.tolerance == 0.3


def test_inputs_of_a_cylinder_are_parts_of_its_stroke() -> None:
    table = {"inputs": [0, 0.5, 1], "outputs_deg": [0, 20, 50]}
    own = scene(functions=[table], drive="cylinder", stroke=[0.5, 1]).mechanism.task()
    assert own.targets[0].inputs == (0.0, 0.5, 1.0) and own.linear  # type: ignore[attr-defined]


@pytest.mark.long
def test_the_page_shows_every_answer_over_its_target() -> None:
    report = execute(scene(("records", "tables", "animations", "plots", "mechanisms"), paths=[SEGMENT], answers=2))
    assert [record.good for record in report["records"]] == [True, True]
    answers, verdicts, *_ = report["tables"]
    assert len(answers.rows) == 2 and answers.rows[0][-1] == "yes"
    assert verdicts.rows[0][1:3] == ("turns fully, proved", "one branch, proved")
    best = gs.Mechanism.from_json(report["mechanisms"].columns["mechanism"][0]).simulate()
    forgiven = np.radians(float(verdicts.rows[0][3]))
    assert best.assess_jamming(tilt=0.98 * forgiven, joints="0.3 deg").verdict.name == "CERTIFIED_FREE"
    assert best.assess_jamming(tilt=1.05 * forgiven, joints="0.3 deg").verdict.name.startswith("CERTIFIED_JAMMED")
    assert all("<animate" in picture.svg for picture in report["animations"])
    assert "2 mechanisms do the task" in " ".join(finding.text for finding in sentences(report))
    (plot,) = report["plots"]
    assert "target" in plot.svg
    for text in report["mechanisms"].columns["mechanism"]:
        mechanism = gs.Mechanism.from_json(text)
        z = gs.simulate(mechanism, np.linspace(0, math.tau, 7201)).point("P").position @ [1.0, 1.0j]
        for p in np.linspace(0, 4, 12):
            assert np.abs(z - p).min() < 0.02 + 2e-3


@pytest.mark.long
def test_the_command_writes_a_file_of_each_mechanism(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = """
[scene]
name = "own"
title = "Own"
[mechanism]
module = "design"
links = [4]
answers = 1
[[mechanism.paths]]
segment = [[0, 0], [4, 0]]
[outputs]
products = ["tables"]
"""
    (tmp_path / "own.toml").write_text(text, "utf-8")
    options = ["--out", str(tmp_path / "report"), "--workers", "1", "--seconds", "20"]
    assert main(["design", str(tmp_path / "own.toml"), *options]) == 0
    hint = re.search(r"unit of length of (\d+) mm: graphsynth parts \S+ --unit (\d+)", capsys.readouterr().out)
    assert hint and hint[1] == hint[2] and 5 <= int(hint[1]) <= 100  # a stroke of 4, so a few units wide
    options.append("--json")
    assert main(["design", str(tmp_path / "own.toml"), *options]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["accepted"] == 1 and told["answers"][0]["error of the path"] < 0.01
    mechanism = gs.Mechanism.from_toml(Path(told["answers"][0]["file"]).read_text("utf-8"))
    assert mechanism.graph.key == told["answers"][0]["key"]
    assert mechanism.input_range == (0.0, 2.0 * math.pi)
    size = max(abs(value) for joint in mechanism.joints for value in (*joint.at_a, *joint.at_b))
    noise = [v for joint in mechanism.joints for v in (*joint.at_a, *joint.at_b) if 0.0 < abs(v) < 1e-13 * size]
    assert not noise and gs.Mechanism.from_toml(mechanism.to_toml()) == mechanism
    assert (tmp_path / "report" / "report.html").exists()
    assert main(["design", str(tmp_path / "own.toml"), *options, "--go-on"]) == 0
    assert json.loads(capsys.readouterr().out)["accepted"] == 1
    (tmp_path / "report" / "mechanism-2.toml").write_text("no mechanism", "utf-8")
    assert main(["design", str(tmp_path / "own.toml"), *options, "--go-on"]) == 2
    assert "is no mechanism" in capsys.readouterr().err
    assert main(["design", "lambda"]) == 2 and "use graphsynth run" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("mechanism", "words"),
    [
        ({}, "has no target"),
        ({"paths": [{}]}, "gives no path"),
        ({"paths": [{**SEGMENT, "svg": "M0 0 L1 1"}]}, "segment and svg"),
        ({"paths": [{"segment": [[0, 0]]}]}, "two ends"),
        ({"paths": [SEGMENT], "links": [5]}, "even numbers"),
        ({"functions": [{"formula": "import os"}]}, "formula"),
        ({"functions": [{}]}, "either inputs"),
        ({"functions": [{"inputs": [0, 1], "places": [0, 1]}]}, "not within"),
        ({"swings": [{"stroke": [1, 2]}]}, "give both or none"),
        ({"poses": [{"points": [[0, 0]], "angles_deg": []}]}, "1 points and 0 angles"),
        ({"paths": [SEGMENT], "pivot": [0, 0]}, "did you mean 'pivots'"),
        ({"paths": [SEGMENT], "begin": ["none.toml"]}, "begin"),
    ],
)
def test_mistakes_are_told_with_their_place(mechanism: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError, match=words):
        execute(scene(**mechanism))


@pytest.mark.long
def test_the_chart_of_a_stroke_shows_its_limits_and_the_caption_what_is_reached() -> None:
    swing = {"least_deg": 50, "most_deg": 55, "time_ratio": 1, "link": "blade"}
    report = execute(scene(("tables", "animations", "plots"), swings=[swing], pivots=[[0, 0], [4, 1]]))
    (chart,), (picture,) = report["plots"], report["animations"]
    assert "least" in chart.svg and "most" in chart.svg and "lowest place" in chart.caption
    told = re.search(r"Blade: link \d, which turns through ([\d.]+)°", picture.caption)
    assert told and 50 - 0.5 <= float(told[1]) <= 55 + 0.5
    ram = {"stroke": [2, 2.1], "within": 0.01, "link": "ram"}
    (picture,) = execute(scene(("animations",), swings=[ram], sliders=1))["animations"]
    told = re.search(r"Ram: link \d, which slides by ([\d.]+)\.$", picture.caption)
    assert told and 1.99 <= float(told[1]) <= 2.11


def test_an_impossible_task_gives_a_report_that_says_why() -> None:
    report = execute(scene(("records", "tables", "animations", "plots"), paths=[SEGMENT], box=[0, -1, 3, 1]))
    assert report["records"] == () and not report["animations"]
    assert any("Impossible" in finding.text for finding in sentences(report))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["windscreen_wiper", "excavator_bucket", "walking_leg"])
def test_shipped_tasks_are_done(name: str) -> None:
    report = execute(load_scene(name))
    assert any(record.good for record in report["records"])


@pytest.mark.long
def test_the_best_so_far_are_kept_while_it_searches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As when the process is killed in the middle: what was found is on the disk, older files are gone."""
    import graphsynth.design.task.search as search

    (tmp_path / "mechanism-7.toml").write_text("of an earlier search")
    real = search._Run._enough

    def killed(run: Any) -> bool:
        if real(run):
            raise MemoryError
        return False

    monkeypatch.setattr(search._Run, "_enough", killed)
    with pytest.raises(MemoryError):
        execute(scene(("records",), paths=[SEGMENT], kept=str(tmp_path), seconds=600))
    (file,) = tmp_path.glob("mechanism-*.toml")
    assert file.name == "mechanism-1.toml" and "P" in gs.Mechanism.from_toml(file.read_text()).points


def test_verdicts_of_answers_that_fail_say_what_tells_against_them() -> None:
    from types import SimpleNamespace

    from graphsynth.pipeline.design.stages import _verdicts

    failed = SimpleNamespace(
        certificate=None, accepted=False, jam_margin=math.nan, reasons=("the range is not completed",)
    )
    changed = SimpleNamespace(
        certificate=None,
        accepted=False,
        jam_margin=math.nan,
        reasons=("an assembly mode changes", "the path is missed"),
    )
    task = scene(paths=[SEGMENT]).mechanism.task()
    table = _verdicts(SimpleNamespace(task=task, answers=(failed, changed)))  # type: ignore[arg-type]
    assert [(*row[1:3], row[-1]) for row in table.rows] == [
        ("the range is not completed", "the range is not completed", ""),
        ("turns fully, estimated", "an assembly mode changes", ""),
    ]


def test_verdicts_tell_what_can_be_built_as_sheets() -> None:
    """Chebyshev's lambda linkage needs two layers; crank and rocker that sweep over each other's pivot have none."""
    from graphsynth.pipeline.design.stages import _layers

    assert _layers(gs.simulate(gs.gallery.chebyshev_lambda())) == (2, "")
    layers, collision = _layers(gs.simulate(gs.Mechanism.four_bar(1, 2.5, 2, 2.5)))
    assert layers == 0 and collision.endswith("overlap") and "input" not in collision
