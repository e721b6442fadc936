"""The shipped antenna scene against published values, other antennas, and bad input."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from typing import Any

import pytest

from graphsynth.core.errors import SceneError
from graphsynth.pipeline.runner import execute, run
from graphsynth.pipeline.scene import OutputsTable, Scene, find_scene, load_scene

SAID = ("records", "tables")


def changed(*products: str, **mechanism: Any) -> Scene:
    """The shipped scene with other products and other tables of [mechanism]."""
    tables = tomllib.loads(find_scene("antenna").read_text("utf-8"))
    for name, value in mechanism.items():
        old = tables["mechanism"].get(name)
        tables["mechanism"][name] = {**old, **value} if isinstance(value, dict) else value
    tables["outputs"]["products"] = list(products)
    return Scene.from_mapping(tables)


@pytest.fixture(scope="module")
def report() -> Any:
    return execute(replace(load_scene("antenna"), outputs=OutputsTable(SAID)))


def table(report: Any, title: str) -> Any:
    return next(t for t in report["tables"] if t.title.startswith(title))


@pytest.mark.long
def test_published_values(report: Any) -> None:
    (record,) = report["records"]
    assert record.status == "assessed" and record.good
    assert "differ by 30.99′ at 40°" in record.verdict and "certified" in record.verdict
    value = {m.name: m for m in record.margins}
    # theory/values-of-the-antenna 1
    assert value["elevation at 40°"].value == pytest.approx(23.7120800164849915647, abs=1e-13)
    assert value["azimuth at 40°"].value == pytest.approx(22.44785725383752382049, abs=1e-13)
    assert value["separation of the two at 40°"].value == pytest.approx(75.8533657588, abs=1e-10)
    assert value["difference of the two models at 40°"].value == pytest.approx(30.9895760535, abs=1e-10)
    assert value["difference of the two models at 15°"].value == pytest.approx(0.656058727127, abs=1e-10)
    # theory/antenna 9
    for name, exact in (("elevation", 44.4258857627), ("azimuth", 43.0183614472)):
        bound = value[f"largest deviation of the {name} at 15°"]
        assert bound.guarantee == "certified"
        assert exact - 1e-10 <= bound.value <= exact * (1 + 1e-6)


def test_structure_and_cross_check(report: Any) -> None:
    rows = {row[0]: row[1] for row in table(report, "Structure").rows}
    assert rows["mobility in space"] == "2" and rows["independent loops"] == "2" and rows["loop equations"] == "12"
    rows = dict(table(report, "The twelve loop equations").rows)
    assert float(rows["largest difference of an angle from the closed form"].split()[0]) < 3e-15
    assert rows["rank at rest, equations as printed in the article"].startswith("11 of 12: coordinates singular")
    assert "condition 5.91" in rows["rank at rest, corrected equations"]


def test_table_of_conventions(report: Any) -> None:
    """theory/antenna 8, to the printed digits."""
    rows = {row[0]: [float(x) for x in row[1:]] for row in table(report, "What makes").rows}
    assert rows["gimbal order XY"] == pytest.approx([0.008, 0.130, 0.656, 2.060, 10.201, 30.990], abs=6e-4)
    assert rows["both cranks reversed"] == rows["gimbal order XY"]
    assert rows["crank of leg Y reversed"] == pytest.approx([0.01, 0.15, 0.74, 2.34, 11.81, 37.19], abs=6e-3)
    assert rows["crank of leg X reversed"] == pytest.approx([0.00, -0.02, -0.08, -0.27, -1.54, -5.62], abs=6e-3)
    assert rows["tilt of the normal as output"] == pytest.approx([0.12, 0.94, 3.14, 7.33, 23.50, 51.19], abs=6e-3)
    assert rows["universal joints farther out by 0.5 mm"] == pytest.approx(
        [-0.89, -1.78, -2.69, -3.64, -5.62, -7.75], abs=6e-3
    )
    assert rows["crank of leg Y longer by 0.5 mm"] == pytest.approx([0.75, 1.51, 2.27, 3.05, 4.65, 6.29], abs=6e-3)


def test_no_zero_has_a_sign(report: Any) -> None:
    cells = [cell for t in report["tables"] for row in t.rows for cell in row]
    assert "-0" not in cells and not any(cell.startswith(("-0.000000000", "-0.0000 ")) for cell in cells)


@pytest.mark.long
def test_the_page(tmp_path: Any) -> None:
    scene = changed(
        "records", "tables", "mechanism_pictures", "animations", "plots",
        tolerances={"map_nodes": 3, "at_deg": [15]}, sweep={"samples": 41},
    )  # fmt: skip
    done = run(scene, out=tmp_path)
    page = (tmp_path / "report.html").read_text("utf-8")
    assert page.count("<figure") == 1 + 5 + 8
    assert page.count("Assembly mode (") >= 4
    assert "Figure 4" in page and "prefers-reduced-motion" in page
    assert sum(t.seconds for t in done.times) < 60.0
    assert (tmp_path / "results.csv").read_text("utf-8").count("\n") == 2


@pytest.mark.long
def test_an_antenna_that_folds() -> None:
    """Parallelogram legs fold at 69.39 degrees: the sweep stops there and says so, nothing is invented beyond."""
    scene = changed(
        *SAID, "animations", lengths={"crank_y_mm": 100, "crank_x_mm": 100}, sweep={"largest_deg": 80},
        tolerances={"at_deg": [60, 69.3, 75]},
    )  # fmt: skip
    report = execute(scene)
    (record,) = report["records"]
    assert record.good is False
    assert "fold of leg Y at phi_x = 69.394628 deg" in record.verdict
    last = table(report, "Both cranks").rows[-1]
    assert last[1] == "nan"
    folds = [row for row in table(report, "Folds").rows if row[0] == "fold of leg Y"]
    assert any(row[1].startswith("69.394627605") and "2.8694330" in row[5] for row in folds)
    bounds = [row[3] for row in table(report, "Effect of the tolerances").rows]
    assert ".." in bounds[0] and "undecided" in bounds[2] and "undecided" in bounds[4]
    assert "folds" in report["animations"][0].caption


@pytest.mark.long
def test_an_antenna_whose_legs_do_not_reach() -> None:
    report = execute(changed(*SAID, lengths={"cardan_mm": 10, "crank_y_mm": 100, "crank_x_mm": 100}))
    (record,) = report["records"]
    assert record.good is False
    assert math.isnan(float(table(report, "Both cranks").rows[-1][1]))


@pytest.mark.long
@pytest.mark.parametrize(
    ("mechanism", "words"),
    [
        ({"lengths": {"rod_y_mm": -1}}, "rod_y_mm = -1"),
        ({"lengths": {"rod_z_mm": 1}}, "did you mean 'rod_x_mm'|did you mean 'rod_y_mm'"),
        ({"order": "ZX"}, "ZX"),
        ({"sweep": {"largest_deg": 0}}, "largest_deg = 0"),
        ({"sweep": {"working_deg": 50}}, "working_deg = 50"),
        ({"tolerances": {"crank_x_mm": 60}}, "tolerance 0.06 of l5"),
        ({"comparison": {"sense_y": 2}}, "sense_y"),
    ],
)
def test_bad_scenes_get_one_sentence(mechanism: Any, words: str) -> None:
    with pytest.raises(SceneError, match=words) as caught:
        execute(changed(*SAID, **mechanism))
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_solvers() -> None:
    (found,) = execute(changed("solvers"))["solvers"]
    assert float(found.rows[0][2]) < 1e-15
    assert len(found.rows) == 6
