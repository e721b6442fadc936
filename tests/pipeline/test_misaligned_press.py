"""The shipped press out of square: what its page says against the library; mistakes in its table."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.core.errors import SceneError
from graphsynth.jamming import Bearing
from graphsynth.jamming.binding import ContactFriction, LinkSection
from graphsynth.jamming.joints import Misalignment, bearing_limits
from graphsynth.mechanism.laws import Linear
from graphsynth.pipeline.runner import execute
from graphsynth.pipeline.scene import Scene, load_scene
from graphsynth.pipeline.summary import facts, sentences

SCENE = Path(__file__).parents[2] / "catalog" / "scenes" / "misaligned_press.toml"


def changed(
    products: list[str], files: tuple[str, ...] = (), bearings: dict[str, Any] | None = None, **binding: Any
) -> Scene:
    scene = load_scene("misaligned_press")
    raw = dict(scene.raw)
    own = raw["mechanism"]
    raw["mechanism"] = {
        **own,
        "files": list(files) or own["files"],
        "bearings": {**own["bearings"], **(bearings or {})},
        "binding": {name: value for name, value in {**own["binding"], **binding}.items() if value is not None},
    }
    raw["outputs"] = {"products": products}
    return replace(Scene.from_mapping(raw), folder=SCENE.parent)


@pytest.fixture(scope="module")
def cost() -> gs.BindingReport:
    """The same press with the library: rod of 80 mm, 360 steps."""
    motion = gs.Mechanism.slider_crank(0.04, 0.08).simulate(np.linspace(0.0, math.tau, 361))
    return motion.binding(
        tilt=[Misalignment(0, 1, math.radians(0.3), math.radians(30.0))],
        joints=bearing_limits(Bearing(15.0, 40.0, 0.05)),
        stiffness=40e3,
        links=LinkSection.rectangular(210e9, 0.03, 0.012),
        friction=ContactFriction(0.1, 0.015, 0.04),
        motor_torque=5.0,
    )


def test_the_first_screen_says_what_the_library_finds(cost: gs.BindingReport) -> None:
    report = execute(changed(["records", "binding_tables"]))
    (record,) = report["records"]
    assert record.good is True and "binds over part of the range" in record.verdict
    told = {margin.name: margin.value for margin in record.margins}
    assert told["binding torque"] == pytest.approx(cost.peak_torque, rel=1e-6)
    assert told["binding loss"] == pytest.approx(cost.loss, rel=1e-6)
    sentence = sentences(report)[1]
    assert sentence.good is True
    share = float(np.mean(cost.energy > 0.0))
    for part in (cost.statement, f"over {100.0 * share:.3g} %", "joint 0-1 bears", "joint 1-2 wears first"):
        assert part in sentence.text
    assert cost.wear[0].joint == (1, 2) and max(cost.wear, key=lambda row: row.moment).joint == (0, 1)
    assert any(fact.text.startswith("binding torque") for fact in facts(report))
    (table,) = report["binding_tables"]
    for row, own in zip(table.rows, cost.wear, strict=True):
        assert row[0] == f"{own.joint[0]}-{own.joint[1]}"
        np.testing.assert_allclose([float(cell) for cell in row[1:]], own[1:], rtol=1e-3)


@pytest.mark.long
def test_two_presses_and_a_weak_motor() -> None:
    """The short rod blocks a weak motor, the long one does not; each sentence names its mechanism."""
    files = tuple(f"mechanisms/press_with_{rod}_rod.toml" for rod in ("short", "long"))
    report = execute(changed(["records", "binding_tables"], files, motor_Nm=1.0))
    assert [record.good for record in report["records"]] == [False, True]
    findings = [finding for table in report["binding_tables"] for finding in table.findings]
    assert [finding.good for finding in findings] == [False, True]
    assert findings[0].text.startswith("press_with_short_rod: Estimated: blocks, 2.34")
    assert "press_with_long_rod: Estimated: binds" in findings[1].text


@pytest.mark.long
def test_the_curve_has_the_words_of_the_table() -> None:
    report = execute(changed(["binding_tables", "binding_curves"]))
    (picture,), (table,) = report["binding_curves"], report["binding_tables"]
    assert picture.caption == table.findings[0].text and "<svg" in picture.svg


@pytest.mark.long
def test_a_fit_counts_with_its_middle(cost: gs.BindingReport) -> None:
    """The crank pin has the clearance of its fit instead of that of the other bearings; a large tilt has a note."""
    fit = {"kind": "fit", "joint": [1, 2], "fit": "30 F7/h6", "height_mm": 40}
    report = execute(changed(["records", "binding_tables"], bearings={"tolerances": [fit]}))
    middle = bearing_limits(Bearing(15.0, 40.0, 0.0185))  # in the diameter 0.020 to 0.041 above 30, 0.013 to 0 below
    joints = {joint.pair: bearing_limits(Bearing(15.0, 40.0, 0.05)) for joint in cost.motion.mechanism.joints}
    direct = cost.motion.binding(
        tilt=cost.problem.misalignments,
        joints=joints | {(1, 2): middle},
        stiffness=40e3,
        links=LinkSection.rectangular(210e9, 0.03, 0.012),
        friction=ContactFriction(0.1, 0.015, 0.04),
    )
    told = {margin.name: margin.value for margin in report["records"][0].margins}
    assert told["binding torque"] == pytest.approx(direct.peak_torque, rel=1e-3)
    assert told["binding torque"] > 1.2 * cost.peak_torque
    steep = execute(changed(["binding_tables"], bearings={"alpha_deg": 20}))["binding_tables"][0]
    assert "small tilts are a rough model" in steep.note


def test_a_small_tilt_costs_nothing() -> None:
    report = execute(changed(["records", "binding_tables"], bearings={"alpha_deg": 0.1}))
    assert report["records"][0].good is True
    assert report["binding_tables"][0].findings[0].text.startswith("Estimated: free")


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"stiffness": "40 kN"}, "N m/rad"),
        ({"stiffness": -4.0e4}, "with its unit"),
        ({"stiffness": "0 N m/rad"}, "must be positive"),
        ({"stiffness": "stiff"}, "stiff"),
        ({"stiffness": None}, "stiffness"),
        ({"friction": -0.1}, "at least 0"),
        ({"friktion": 0.1}, "friction"),
        ({"motor_Nm": 0}, "must be positive"),
        ({"motor_Nm": "5 N"}, "N"),
        ({"young_GPa": None}, "young_GPa, width_mm and height_mm"),
        ({"width_mm": math.nan}, "width_mm"),
        ({"height_mm": True}, "height_mm"),
    ],
)
def test_mistakes_are_told_in_one_sentence(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError, match=words) as caught:
        changed(["records"], **wrong)
    assert "\n" not in str(caught.value) and "binding" in str(caught.value)


def long_coupler(folder: Path) -> str:
    """A file with a parallelogram whose coupler is 0.4 mm too long, from the upright position on."""
    mechanism = gs.Mechanism.four_bar(0.2, 0.1, 0.2004, 0.1)
    mechanism = replace(mechanism, drivers=(gs.Driver(0, 1, Linear(1.0, 1.5)),), pose=None)
    path = folder / "long_coupler.toml"
    path.write_text(mechanism.to_toml(), encoding="utf-8")
    return str(path)


@pytest.mark.long
def test_pins_shift_where_a_mechanism_does_not_close(tmp_path: Path) -> None:
    """With ``radial`` it turns on through its clearances or their springs; without it the range is not completed."""
    file = (long_coupler(tmp_path),)
    (stiff,) = execute(changed(["records"], file))["records"]
    assert stiff.status == "rejected" and stiff.reason.startswith("the range is not completed")
    for clearance, radial in ((0.05, 2e7), (0.14, 2e7)):
        bearings = {"clearance_mm": clearance, "alpha_deg": 1e-3}
        report = execute(changed(["records", "binding_tables"], file, bearings, radial=f"{radial} N/m", friction=0.0))
        (record,) = report["records"]
        told = {margin.name: margin.value for margin in record.margins}
        u = 1.5 + np.linspace(0.0, math.tau, 361)
        way = np.hypot(0.2 - 0.1 * np.cos(u), 0.1 * np.sin(u))
        over = np.maximum(0.1004 - way - 3e-3 * clearance, 0.0)  # the shaft of the motor has no clearance
        torque = radial / 4.0 * over * 0.02 * np.abs(np.sin(u)) / way
        assert told["binding torque"] == pytest.approx(torque.max(), rel=1e-4, abs=1e-9)
        assert (told["binding torque"] > 0.0) == (clearance < 0.4 / 3.0)
