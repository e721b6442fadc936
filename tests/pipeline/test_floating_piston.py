"""The scene of the floating piston: what its report says, what it loads, one sentence for every mistake."""

from __future__ import annotations

import copy
import math
import subprocess
import sys
import tomllib
from dataclasses import replace
from typing import Any

import pytest

from graphsynth.core.errors import SceneError
from graphsynth.pipeline.runner import execute, run
from graphsynth.pipeline.scene import OutputsTable, Scene, find_scene, load_scene

FAST = ("loops", "turns", "records", "tables")


@pytest.fixture(scope="module")
def tables() -> dict[str, Any]:
    return tomllib.loads(find_scene("floating_piston").read_text("utf-8"))


@pytest.fixture(scope="module")
def report() -> Any:
    scene = load_scene("floating_piston")
    fewer = replace(scene.mechanism, positions=8, square_errors=tuple(map(math.radians, (0, 5, 10))))
    return execute(replace(scene, mechanism=fewer, outputs=OutputsTable(FAST)))


def changed(tables: dict[str, Any], *products: str, **mechanism: Any) -> Scene:
    found = copy.deepcopy(tables)
    found["mechanism"] |= mechanism
    found["outputs"]["products"] = list(products or FAST)
    return Scene.from_mapping(found, "x.toml")


@pytest.mark.long
def test_both_machines_are_assessed(report: Any) -> None:
    records = report["records"]
    assert [record.status for record in records] == ["assessed", "assessed"]
    assert all(record.good for record in records)
    slider, yoke = ({m.name: m.value for m in record.margins} for record in records)
    for margins in (slider, yoke):
        assert margins["mobility W"] == margins["redundant constraints"] == 1
        assert margins["stroke"] == pytest.approx(100.0, rel=1e-14)
        assert margins["largest side load on the cylinder"] < 1e-9
        assert margins["energy balance over one rotation"] < 1e-9
        assert margins["difference of the forces to a sliding slot"] < 1e-12
    # the discharge pressure opens the valve where the rod leans; the guide then takes what the wall took
    plain, guide = slider["largest side load of the plain piston"], slider["largest load on the crosshead's guide"]
    assert 500.0 < plain < 3927.0 * math.tan(math.asin(0.25))
    assert guide == pytest.approx(plain, rel=0.02)  # less friction, otherwise the same
    # half a couple's arm: F r sin(phi) over the length, at most the gas force times 50 mm over 80 mm
    assert yoke["largest force at an end of the plain piston"] < 3927.0 * 50.0 / 80.0
    assert (
        yoke["largest force at an end of the plain piston"]
        > 3.0 * slider["largest force at an end of the plain piston"]
    )
    assert slider["static friction of the slot"] == pytest.approx(0.08 * 3665.0, rel=0.02)


@pytest.mark.long
def test_figures_of_the_explanation(report: Any) -> None:
    """docs/explanation/floating-piston.md quotes these."""
    slider, yoke = (turn.found for turn in report["turns"])
    for value, quoted in (
        (slider.plain.peak_wall, 554), (slider.floating.peak_guide, 549), (slider.floating.peak_held, 292),
        (yoke.plain.peak_edge, 1736), (yoke.floating.peak_guide_edge, 1731),
    ):  # fmt: skip
        assert abs(value - quoted) <= 0.5
    assert round(slider.plain.friction, 1) == 12.2 and round(slider.floating.friction, 1) == 10.1
    square = {round(math.degrees(error)): found.edge_ratio for error, found in report["turns"][0].square}
    assert round(square[5], 2) == 0.58 and round(square[10], 2) == 1.18


@pytest.mark.long
def test_tables_tell_structure_and_trust(report: Any) -> None:
    tables = {table.title: table for table in report["tables"]}
    loops = tables["Loops and the spaces they move in"].rows
    assert loops[0][1:] == ("0-1-2-3", "0-1 1-2 2-3 0-3", "3", "3", "4 - 3 = 1")
    assert loops[1][1:] == ("0-3-4", "3-4 0-4", "2", "2", "2 - 2 = 0")
    assert loops[2][1].startswith("W = 6 - (3 + 2) = 1; one space 3 for all loops gives 0")
    assert "W = 1, agrees" in loops[2][2]
    assert [row[1] for row in tables["Which joints make such a mechanism"].rows] == ["yes", "yes", "no"]
    trust = tables["Checks"].rows
    assert len(trust) == 4
    assert not any("WARNING" in cell or cell == "DETERMINED" for row in trust for cell in row)
    square = [row for row in tables["How square the slot must be"].rows if row[1] == "5"]
    assert float(square[0][2]) == pytest.approx(math.tan(math.radians(5.0)) * 3665.0, rel=0.02)


def test_pictures(tables: dict[str, Any]) -> None:
    found = execute(changed(tables, "mechanism_pictures", "animations", kinds=["scotch_yoke", "crank_slider"]))
    assert [picture.title for picture in found["mechanism_pictures"]][2] == "Scotch yoke with plain piston"
    assert len(found["mechanism_pictures"]) == 6
    one, other = (picture.svg for picture in found["animations"])
    assert "<animateTransform" in one
    assert one != other


@pytest.mark.slow
def test_the_whole_scene_writes_its_report(tmp_path: Any) -> None:
    found = run("floating_piston", out=tmp_path)
    page = (tmp_path / "report.html").read_text("utf-8")
    assert found["graph_pictures"] and "Candidate graphs" in page
    assert page.count("<svg") == 2 + 6 + 14 + 12
    assert (tmp_path / "results.csv").read_text("utf-8").count("\n") == 3


@pytest.mark.long
def test_a_constant_force_and_one_kind(tables: dict[str, Any]) -> None:
    own = copy.deepcopy(tables)
    for key in ("gas", "masses", "friction", "group"):
        del own["mechanism"][key]
    scene = changed(own, kinds=["crank_slider"], force_N=1000.0, gravity_m_s2=[0, 0], square_errors_deg=[])
    (record,) = execute(scene)["records"]
    margins = {m.name: m.value for m in record.margins}
    assert margins["largest side load of the plain piston"] == pytest.approx(1000.0 / math.sqrt(15.0), rel=1e-9)
    assert math.isnan(margins["friction loss over that of the plain piston"])


def test_candidates_and_the_known_one(tables: dict[str, Any]) -> None:
    found = execute(changed(tables, "solutions", "recognised"))
    assert len(found["solutions"]) == 2
    assert [item.module for item in found["recognised"]].count("floating_piston") == 1
    assert len(found["recognised"]) == 12


@pytest.mark.parametrize(
    ("keys", "value", "sentence"),
    [
        (("drive", "rod_mm"), 40, "rod of 0.04 m is too short for a full turn"),
        (("drive", "crank_mm"), -5, "crank_mm = -5"),
        (("drive", "length"), 5, "unknown key 'length'"),
        (("group", "slot_angle_deg"), 0, "slot_angle"),
        (("gas", "discharge"), "20 kPa", "below suction"),
        (("gas", "bore_mm"), 0, "bore_mm = 0"),
        (("masses", "piston_kg"), -1, "piston = -1.0 must be zero or more"),
        (("friction", "slot"), -0.1, "friction slot"),
        (("kinds",), [], "kinds"),
        (("kinds",), ["crank_slider", "crank_slider"], "repeat"),
        (("kinds",), ["wobble_plate"], "wobble_plate"),
        (("speed",), 0, "speed"),
        (("force_N",), 5, "remove one"),
        (("piston_length_mm",), -1, "piston_length_mm = -1"),
        (("positions",), 3, "positions = 3"),
        (("square_errors_deg",), [90], "parallel"),
    ],
)
def test_mistakes_get_a_sentence(tables: dict[str, Any], keys: tuple[str, ...], value: Any, sentence: str) -> None:
    own = copy.deepcopy(tables)
    place = own["mechanism"]
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = value
    own["outputs"]["products"] = ["turns"]
    with pytest.raises(SceneError, match=sentence) as error:
        execute(Scene.from_mapping(own, "x.toml"))
    assert "x.toml" in str(error.value)


def test_no_rod_for_a_crank_slider(tables: dict[str, Any]) -> None:
    with pytest.raises(SceneError, match="no rod_mm"):
        changed(tables, drive={"crank_mm": 50})
    assert changed(tables, drive={"crank_mm": 50}, kinds=["scotch_yoke"]).mechanism.drive.crank == 0.05


PROBE = """
import sys
before = set(sys.modules)
from dataclasses import replace
from graphsynth.pipeline.runner import execute
from graphsynth.pipeline.scene import OutputsTable, load_scene
execute(replace(load_scene("floating_piston"), outputs=OutputsTable((sys.argv[1],))))
print(",".join(sorted({m.partition(".")[0] for m in set(sys.modules) - before} - set(sys.stdlib_module_names))))
"""


@pytest.mark.long
@pytest.mark.parametrize(
    ("product", "allowed"), [("solutions", set()), ("mechanism_pictures", {"numpy"}), ("loops", {"numpy"})]
)
def test_it_pays_only_for_what_it_asks(product: str, allowed: set[str]) -> None:
    done = subprocess.run([sys.executable, "-c", PROBE, product], capture_output=True, text=True, check=True)
    names = {name for name in done.stdout.strip().split(",") if "cython" not in name}  # numpy's random numbers bring it
    assert names - {"graphsynth", "lazy_loader", ""} <= allowed
