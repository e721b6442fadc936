"""The scene of the braider: printed values in its report, loads, failures told with their reason."""

from __future__ import annotations

import copy
import math
import re
import tomllib
from typing import Any

import numpy as np
import pytest

from graphsynth.core.errors import SceneError
from graphsynth.pipeline.runner import execute
from graphsynth.pipeline.scene import Scene, find_scene

FAST = ("start_up", "sensors", "inductance", "records", "tables")


@pytest.fixture
def tables() -> dict[str, Any]:
    return tomllib.loads(find_scene("braider").read_text("utf-8"))


def run(tables: dict[str, Any], *products: str) -> Any:
    changed = copy.deepcopy(tables)
    changed["outputs"]["products"] = list(products or FAST)
    return execute(Scene.from_mapping(changed, "x.toml"))


def test_start_up_has_the_printed_values(tables: dict[str, Any]) -> None:
    report = run(tables)
    (record,) = report["records"]
    assert record.status == "assessed" and record.good
    assert record.verdict == "stays within ±2 % of 1.803 rad/s from 0.1083 s on (estimated)"
    margins = {m.name: m for m in record.margins}
    for name, printed, digits in [
        ("settling time, ±2 %", 0.1083, 5e-5),
        ("settling time, ±1 %", 0.1279, 5e-5),
        ("crank speed at 0.5 s", 1.8026624512378647, 1e-13),
        ("crank angle at 0.5 s", 0.85149709671523497, 1e-13),
        ("smallest speed of the steady motion", 1.802654502, 1e-9),
        ("largest speed of the steady motion", 1.802779267, 1e-9),
        ("largest current i_q", 0.9915, 5e-5),
        ("time of the largest current", 0.00206, 5e-6),
    ]:
        assert abs(margins[name].value - printed) <= digits
        assert margins[name].guarantee == "estimated" and margins[name].error is not None
    assert margins["largest moment of the thread about O2"].value == 0.0  # the guide lies over O2
    run_ = report["start_up"]
    assert run_.energy_error < 1e-9 and run_.electric_error < 1e-9


def test_sensors_and_second_way(tables: dict[str, Any]) -> None:
    report = run(tables)
    turn = report["sensors"]
    at = int(np.argmin(np.abs(turn.theta - math.radians(45))))
    assert turn.F01[at] == pytest.approx((-0.004839456837046956, -0.002393107550719340), rel=1e-12)
    assert turn.torque[at] == pytest.approx(3.459660339026256e-5, rel=1e-11)
    (told,) = next(t for t in report["tables"] if t.title == "Sensors over one rotation").findings
    largest = [float(number) for number in told.text.split("at most ")[1].split(" mN")[0].split(", ")]
    sizes = [[1e3 * math.hypot(*force) for force in forces] for forces in turn.forces().swapaxes(0, 1)]
    assert largest == pytest.approx([max(joint) for joint in sizes], rel=6e-4)
    second = next(t for t in report["tables"] if t.title == "Reactions, independent cross-check")
    assert float(second.rows[0][1]) < 1e-12
    limit = next(t for t in report["tables"] if t.title == "The limit L → 0")
    assert [float(row[3]) for row in limit.rows[3:]] == pytest.approx([1.0] * 4, abs=0.02)
    assert len(limit.rows) == 7


def test_a_load_is_felt(tables: dict[str, Any]) -> None:
    tables["mechanism"]["thread"] |= {"guide_mm": [30, 70], "weight_g": 200}
    report = run(tables, "records", "tables", "start_up")
    moment = {m.name: m.value for m in report["records"][0].margins}["largest moment of the thread about O2"]
    assert 0.005 < moment < 0.2 * 9.80665 * 0.035
    assert report["start_up"].energy_error < 1e-9


def test_a_crank_that_meets_a_change_point_is_a_failure_with_its_reason(tables: dict[str, Any]) -> None:
    tables["mechanism"]["linkage"] |= {"coupler_mm": 50, "rocker_mm": 30}
    tables["mechanism"]["start"] |= {"end_s": 3.0}
    report = run(tables)
    (record,) = report["records"]
    assert record.status == "failed" and "change point at theta = 3.14159" in record.reason
    assert any("choose the branch" in cell for table in report["tables"] for row in table.rows for cell in row)


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        (("masses", "rocker_g"), -30, "mass of the rocker = -0.03 must be zero or more"),
        (("motor", "pole_pairs"), 0, "pole_pairs = 0 must be a whole number"),
        (("motor", "resistance_ohm"), 0, "resistance = 0.0 must be positive"),
        (("linkage", "crank_mm"), 0, r"crank_mm = 0\.?0?; a length must be positive"),
        (("linkage", "crank_mm"), 500, "cannot be assembled at angle = 0"),
        (("train", "stages"), [[10]], "stages"),
        (("train", "efficiency"), [0.9], "1 efficiencies for 3 stages"),
        (("start", "samples"), 3, "samples = 3; use 20 to 100000"),
        (("start", "tolerance"), 1e-20, "rtol = 1e-20 must be from"),
        (("inductances_H",), [1e-3, -1.0], "each must be"),
    ],
)
def test_bad_numbers_give_one_sentence(tables: dict[str, Any], place: tuple[str, ...], value: Any, said: str) -> None:
    at = tables["mechanism"]
    for key in place[:-1]:
        at = at[key]
    at[place[-1]] = value
    with pytest.raises(SceneError, match=said) as caught:
        run(tables, "start_up")
    assert "\n" not in str(caught.value) and "x.toml" in str(caught.value)


@pytest.mark.slow
def test_pictures_of_the_shipped_scene(tables: dict[str, Any]) -> None:
    report = run(tables, "mechanism_pictures", "animations", "plots")
    assert len(report["mechanism_pictures"]) == 7 and len(report["plots"]) == 13
    (moving,) = report["animations"]
    assert "<animateTransform" in moving.svg
    for picture in (*report["plots"], *report["mechanism_pictures"]):
        assert picture.svg.startswith("<svg") and not re.search(r"\bnan\b", picture.svg)


def test_solvers_side_by_side(tables: dict[str, Any]) -> None:
    from graphsynth.evidence.drives import drive_work_precision
    from graphsynth.systems.braider.model import Braider

    times = np.linspace(0.0, 0.1, 11)
    study = drive_work_precision(Braider(), times, tolerances=[1e-6, 1e-10], solvers=["LSODA"], rounds=1)
    assert [row.status for row in study.rows] == ["ok"] * 4
    for ours, theirs in zip(study.rows[:2], study.rows[2:]):
        assert ours.error < 100 * ours.value and theirs.error < 1e3 * theirs.value
    failed = drive_work_precision(
        Braider(), np.linspace(0.0, 0.1, 11), tolerances=[1e-8], solvers=["DOP853"], rounds=1, most_calls=100
    ).rows[1]
    assert failed.reason == "more than 100 calls" and math.isnan(failed.error)
