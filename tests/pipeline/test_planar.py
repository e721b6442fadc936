"""The planar family: candidates from questions and files, dimensions, motion, bearings, loads."""

from __future__ import annotations

import copy
import json
import math
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graphsynth.core.errors import SceneError, TooLargeError
from graphsynth.jamming.bearing.bearing import Bearing
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.pipeline.planar import stages as stages
from graphsynth.pipeline.runner import execute, run
from graphsynth.pipeline.scene import Scene
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.system.spec import StructuralSpec

LENGTHS = (0.08, 0.04, 0.1, 0.1)  # frame, crank, coupler, rocker of the lambda linkage, m
FOUR = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)


def linkage(g: float = 0.08, a: float = 0.04, b: float = 0.1, c: float = 0.1) -> Mechanism:
    """A four-bar with the point M of the lambda linkage, B above the frame line."""
    joints = (Revolute(0, 1), Revolute(1, 2, (a, 0)), Revolute(2, 3, (b, 0), (c, 0)), Revolute(0, 3, (g, 0)))
    start = math.acos((c * c + (g - a) ** 2 - b * b) / (2 * c * (g - a)))
    angle = math.pi - start
    B = (g + c * math.cos(angle), c * math.sin(angle))
    pose = ((0, 0, 0), (0, 0, 0), (a, 0, math.atan2(B[1], B[0] - a)), (g, 0, angle))
    return Mechanism(FOUR, joints, (Driver(0, 1),), {"M": (2, (2 * b, 0))}, pose)


def scene(folder: Path, products: list[str], **mechanism: Any) -> Scene:
    (folder / "lambda.toml").write_text(linkage().to_toml(), encoding="utf-8")
    tables = {
        "scene": {"name": "planar", "title": "Planar"},
        "mechanism": {"module": "planar", "files": ["lambda.toml"], "motion": {"positions": 72}, **mechanism},
        "outputs": {"products": products},
    }
    return replace(Scene.from_mapping(tables), folder=folder)


def margins(report: Any, number: int = 1) -> dict[str, float]:
    return {m.name: m.value for m in report["records"][number - 1].margins}


def test_a_mechanism_of_a_file_is_moved(tmp_path: Path) -> None:
    report = execute(scene(tmp_path, ["records", "mechanisms"]))
    (record,) = report["records"]
    g, a, b, c = LENGTHS
    cosines = [(b * b + c * c - d * d) / (2 * b * c) for d in (g - a, g + a)]
    worst = min(min(math.acos(x), math.pi - math.acos(x)) for x in cosines)
    assert margins(report)["transmission angle"] == pytest.approx(math.degrees(worst), rel=1e-9)
    assert (
        record.verdict == "moves over the whole range (estimated)"
        and record.good is True
        and record.key.startswith("1")
    )
    kept = Mechanism.from_json(report["mechanisms"].columns["mechanism"][0])
    assert kept == linkage()


def test_size_is_the_box_of_joints_and_points_in_cranks(tmp_path: Path) -> None:
    found = margins(execute(scene(tmp_path, ["records"])))["size"]
    u = np.linspace(0, 2 * np.pi, 73)
    g, a, b, c = (length / 0.04 for length in LENGTHS)
    A = a * np.exp(1j * u)
    d = g - A
    along = (b * b - c * c + np.abs(d) ** 2) / (2 * np.abs(d))
    B = A + d / np.abs(d) * (along + 1j * np.sqrt(b * b - along**2))
    z = np.concatenate([[0, g], A, B, 2 * B - A])
    assert found == pytest.approx(math.hypot(np.ptp(z.real), np.ptp(z.imag)), rel=1e-9)


def test_torque_against_virtual_work(tmp_path: Path) -> None:
    from graphsynth.mechanism.four_bar import TiltedFourBar

    loads = {"bar_kg_per_m": 1e-9, "force": ["2 N", "-3 N"], "speed": "1 rad/s"}
    found = margins(execute(scene(tmp_path, ["records"], loads=loads)))
    path = TiltedFourBar(*LENGTHS).positions(np.linspace(0, 2 * np.pi, 73))
    torque = -(path.dM[:, 0] * 2.0 + path.dM[:, 1] * -3.0)
    assert found["largest torque"] == pytest.approx(np.abs(torque).max(), rel=1e-6)
    assert found["mean torque"] == pytest.approx(0.0, abs=1e-9)  # a constant force does no work over a turn


def test_a_motor_brings_it_near_its_speed_without_load(tmp_path: Path) -> None:
    motor = {"stall_Nm": 0.4, "no_load": "300 rpm", "end_s": 0.5, "inertia_kg_m2": 1e-4}
    report = execute(scene(tmp_path, ["records"], loads={"bar_kg_per_m": 0.005, "motor": motor}))
    found = margins(report)
    assert "the motor keeps it turning" in report["records"][0].verdict and report["records"][0].good
    assert found["mean speed with the motor"] == pytest.approx(10 * math.pi, rel=1e-3)  # no losses, settled
    assert 0.0 < found["ripple of the speed"] < 0.1


@pytest.mark.long
@pytest.mark.parametrize(
    "own",
    [
        {"stall_Nm": 0.04, "no_load": "3000 rpm"},
        # K_m K w_d / r at rest; without load at K w_d / (K + c)
        {"direct_current": {"resistance_ohm": 1, "inductance_H": 1e-4, "constant_V_s": 0.01, "gain_V_s": 0.01,
                            "speed": "6000 rpm"}},
    ],
    ids=["straight", "direct current"],
)  # fmt: skip
def test_a_motor_behind_a_train(tmp_path: Path, own: dict[str, Any]) -> None:
    """Two stages of 1:4 and 2:5 bring 3000 rpm down to 300; the rotor weighs a hundred times its inertia there."""
    motor = {"end_s": 0.5, "inertia_kg_m2": 1e-6, "stages": [[10, 40], [20, 50]], **own}
    report = execute(scene(tmp_path, ["records"], loads={"bar_kg_per_m": 0.005, "motor": motor}))
    assert report["records"][0].good
    assert margins(report)["mean speed with the motor"] == pytest.approx(10 * math.pi, rel=1e-2)


def test_a_motor_has_one_characteristic(tmp_path: Path) -> None:
    for motor in ({"end_s": 1}, {"end_s": 1, "stall_Nm": 1}):
        with pytest.raises(SceneError, match=r"needs stall_Nm and no_load_rad_s, or .*direct_current"):
            scene(tmp_path, ["records"], loads={"bar_kg_per_m": 0.005, "motor": motor})


BEARINGS = {"radius_mm": 17.5, "height_mm": 10, "clearance_mm": 0.03}


def test_what_binding_costs_in_a_scene(tmp_path: Path) -> None:
    from graphsynth.jamming import Bearing
    from graphsynth.jamming.binding import ContactFriction, LinkSection

    own = {"stiffness_Nm_per_rad": 900.0, "friction": 0.1, "young_GPa": 210, "width_mm": 10, "height": "0.004 m"}
    given: dict[str, Any] = {"bearings": {**BEARINGS, "alpha_deg": 2.0}, "binding": own}
    found = execute(scene(tmp_path, ["records"], **given))
    motion = linkage().simulate(np.linspace(0.0, 2 * np.pi, 73))
    friction = ContactFriction(0.1, 0.0175, 0.01)
    bar = LinkSection.rectangular(2.1e11, 0.01, 0.004)
    report = motion.binding(tilt="2 deg", joints=Bearing(17.5, 10, 0.03), stiffness=900.0, links=bar, friction=friction)
    assert margins(found)["binding torque"] == pytest.approx(report.peak_torque, rel=1e-9)
    assert margins(found)["binding loss"] == pytest.approx(report.loss, rel=1e-9)
    assert "drive: binds (estimated)" in found["records"][0].verdict
    weak = execute(scene(tmp_path, ["records"], **given | {"binding": {**own, "motor_Nm": 0.01}}))
    assert weak["records"][0].good is False
    assert "exceed the motor" in weak["records"][0].reason


def test_binding_needs_bearings_and_a_whole_section(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"no \[mechanism.bearings\]"):
        scene(tmp_path, ["records"], binding={"stiffness_Nm_per_rad": 900.0})
    with pytest.raises(SceneError, match="young_GPa, width_mm and height_mm"):
        bound = {"stiffness_Nm_per_rad": 900.0, "young_GPa": 210}
        scene(tmp_path, ["records"], bearings={**BEARINGS, "alpha_deg": 2.0}, binding=bound)


def test_bearings_against_the_coupled_assessment(tmp_path: Path) -> None:
    from graphsynth.jamming.joints import Misalignment, assess_coupled, bearing_limits
    from graphsynth.kinematics import simulate

    report = execute(scene(tmp_path, ["records"], bearings={**BEARINGS, "alpha_deg": 0.5}))
    motion = simulate(linkage(), np.linspace(0.0, 2 * np.pi, 73))
    direct = assess_coupled(motion, bearing_limits(Bearing(17.5, 10, 0.03)), Misalignment(0, 1, math.radians(0.5)))
    found = margins(report)
    assert found["use of the clearances"] == direct.worst_factor
    assert found["tilt allowed"] == pytest.approx(0.5 / direct.worst_factor, rel=1e-9)
    assert "estimated" in report["records"][0].verdict


@pytest.mark.long
def test_certified_bearings_free_jammed_and_out_of_budget(tmp_path: Path) -> None:
    spread = {"clearance_tolerance": "1 um", "length_tolerance": "0.001 %", "certify": True}
    free = execute(scene(tmp_path, ["records"], bearings={**BEARINGS, **spread, "alpha_deg": 0.1}))["records"][0]
    assert free.good is True and "certified" in free.verdict and "free" in free.verdict
    jammed = execute(scene(tmp_path, ["records"], bearings={**BEARINGS, **spread, "alpha_deg": 9.0}))["records"][0]
    assert jammed.good is False and "certified" in jammed.verdict
    poor = replace(scene(tmp_path, ["records"], bearings={**BEARINGS, **spread, "alpha_deg": 0.5}))
    poor = replace(poor, budget=replace(poor.budget, boxes=1))
    undecided = execute(poor)["records"][0]
    assert undecided.good is None and "the limit of work was reached" in undecided.reason
    wanted = {**BEARINGS, "alpha_deg": 9.0, "must_be_free": True}
    rejected = execute(scene(tmp_path, ["records"], bearings=wanted))["records"][0]
    assert rejected.status == "rejected" and rejected.cause == "jamming: the bearings jam"


PARTS = [
    {"kind": "length", "link": 1, "ends": [0, 2], "plus_mm": 0.02, "minus": "10 um"},
    {"kind": "hole", "link": 2, "to": 3, "diameter_mm": 0.05},
    {"kind": "temperature", "low_kelvin": -20, "high_kelvin": 40, "per_kelvin": [1.2e-5, 2.3e-5, 2.3e-5, 1.2e-5]},
    {"kind": "fit", "joint": [1, 2], "fit": "35 H8/e8", "height_mm": 10},
    {"kind": "end float", "joint": [0, 3], "least_mm": 0.1, "most_mm": 0.2},
    {"kind": "parallelism", "link": 2, "to": 3, "diameter_mm": 0.002, "over_mm": 20},
]


@pytest.mark.slow
def test_tolerances_of_parts_are_those_of_python(tmp_path: Path) -> None:
    from graphsynth.jamming.joints import Misalignment, bearing_limits, certify_coupled
    from graphsynth.kinematics import simulate
    from graphsynth.tolerances import (
        EndFloat,
        FitClearance,
        HolePosition,
        LengthTolerance,
        Parallelism,
        ThermalExpansion,
    )  # fmt: skip

    parts = [
        LengthTolerance(1, (0, 2), 2e-5, 1e-5), HolePosition(2, 3, 5e-5),
        ThermalExpansion(-20.0, 40.0, {0: 1.2e-5, 1: 2.3e-5, 2: 2.3e-5, 3: 1.2e-5}),
        FitClearance((1, 2), "35 H8/e8", 10.0), EndFloat((0, 3), 1e-4, 2e-4), Parallelism(2, 3, 2e-6, 0.02),
    ]  # fmt: skip
    tables = {**BEARINGS, "alpha_deg": 0.1, "certify": True}
    read = scene(tmp_path, ["records"], bearings={**tables, "tolerances": PARTS})
    assert [stages.part_of(own) for own in read.mechanism.bearings.tolerances] == parts
    (record,) = execute(read)["records"]
    motion = simulate(linkage(), np.linspace(0.0, 2 * np.pi, 73))
    tilt = Misalignment(0, 1, math.radians(0.1))
    proof = certify_coupled(motion, bearing_limits(Bearing(17.5, 10, 0.03)), tilt, tolerances=parts)
    assert record.verdict.endswith(proof.verdict.value) and proof.verdict.name == "CERTIFIED_FREE"


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"tolerances": [{"kind": "length", "link": 1}]}, "gives no ends and no plus_mm|gives no ends and no plus"),
        ({"tolerances": [{"kind": "length", "link": 1, "ends": [0, 2], "plus_mm": -1}]}, "plus_mm = -1"),
        ({"tolerances": [{"kind": "size"}]}, "must be one of 'length'"),
        ({"tolerances": PARTS[:1], "length_tolerance": "1 %"}, "one number for all"),
    ],
)
def test_tolerances_that_a_scene_cannot_mean(tmp_path: Path, table: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        scene(tmp_path, ["records"], bearings={**BEARINGS, "alpha_deg": 0.1, **table})


def question(products: list[str], **mechanism: Any) -> dict[str, Any]:
    return {
        "scene": {"name": "six", "title": "Six links"},
        "structure": {"question": {"W": 1, "links": 6, "p2": 0}},
        "mechanism": {"module": "planar", "crank_mm": 40, "motion": {"positions": 36}, **mechanism},
        "ranking": {"objectives": [{"quantity": "transmission angle", "goal": "max"}]},
        "outputs": {"products": products},
    }


@pytest.mark.long
def test_a_question_is_answered_with_mechanisms_of_the_size_asked_for(tmp_path: Path) -> None:
    report = run(
        Scene.from_mapping(question(["records", "ranking", "mechanisms", "mechanism_pictures", "plots"])), tmp_path
    )
    records = report["records"]
    assert len(records) == 5 and {r.status for r in records} == {"assessed"}
    assert all(margins(report, n)["transmission angle"] > 24.99 for n in range(1, 6))
    for text in report["mechanisms"].columns["mechanism"]:
        mechanism = Mechanism.from_json(text)
        assert stages._crank(mechanism) == pytest.approx(0.04)
    assert len(report["mechanism_pictures"]) == len(report["plots"]) == 5
    assert json.loads((tmp_path / "scene.json").read_text())["notes"] == []


@pytest.mark.long
def test_goals_that_nothing_meets_and_one_that_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    tables = question(
        ["records"], embody={"min_transmission_deg": 88, "max_length_ratio": 2, "tries": 1, "effort": 0.1}
    )
    tables["structure"]["question"]["links"] = 4
    rejected = execute(Scene.from_mapping(tables))["records"][0]
    assert rejected.status == "rejected" and rejected.cause.startswith("embody: moves, but ")
    assert "nothing was accepted in 1 search" in rejected.reason

    usual = stages.embody

    def fails(context: Any, design: Any) -> Any:
        if design.number == 2:
            raise ZeroDivisionError("two")
        return usual(context, design)

    monkeypatch.setattr(stages, "embody", fails)
    records = execute(Scene.from_mapping(question(["records"])))["records"]
    assert [r.status for r in records] == ["assessed", "failed", "assessed", "assessed", "assessed"]
    assert records[1].reason == "ZeroDivisionError: two"


@pytest.mark.long
@pytest.mark.parametrize(
    ("target", "largest"),
    [
        ({"line": {"length": 2, "tolerance": 0.02}}, 0.02),
        ({"function": {"inputs_deg": [0, 40, 80, 120], "outputs_deg": [0, 4, 6, 6.5], "tolerance_deg": 1}}, 0.0175),
    ],
)
def test_targets_are_met(target: dict[str, Any], largest: float) -> None:
    tables = question(["records"], embody={"min_transmission_deg": 20, "tries": 2, "effort": 0.15, **target})
    tables["structure"]["question"]["links"] = 4
    report = execute(Scene.from_mapping(tables))
    assert report["records"][0].status == "assessed" and margins(report)["deviation"] <= largest


def test_a_table_of_goals_is_passed_on() -> None:
    from graphsynth.kinematics.dimensional.goals import PathGoal, PosesGoal
    from graphsynth.pipeline.planar.stages import goals_of

    points = [[0, 0], [1, 0], [1, 1]]
    path = {"path": {"points": points, "inputs": ["0 deg", "45 deg", "1 rad"]}}
    found = goals_of(Scene.from_mapping(question(["records"], embody=path)).mechanism.embody)
    assert isinstance(found.target, PathGoal) and found.target.inputs == pytest.approx((0.0, math.pi / 4, 1.0))
    poses = {"poses": {"points": points, "angles_deg": [0, 90, 180], "inputs_deg": [0, 10, 20]}}
    goal = goals_of(Scene.from_mapping(question(["records"], embody=poses)).mechanism.embody).target
    assert isinstance(goal, PosesGoal) and goal.poses[1] == pytest.approx((1.0, 0.0, math.pi / 2))


def test_scenes_that_make_no_sense(tmp_path: Path) -> None:
    both = question(["records"], files=["x.toml"])
    with pytest.raises(SceneError, match=r"\[mechanism\] needs candidates: give either a table \[structure\] or"):
        execute(Scene.from_mapping(both))
    neither = copy.deepcopy(both)
    del neither["structure"], neither["mechanism"]["files"]
    with pytest.raises(SceneError, match="needs candidates"):
        execute(Scene.from_mapping(neither))
    with pytest.raises(SceneError, match=r"names 'gone.toml', which cannot be read: No such file"):
        execute(scene(tmp_path, ["records"], files=["gone.toml"]))
    (tmp_path / "bad.toml").write_text("format = 3\n")
    with pytest.raises(SceneError, match=r"names 'bad.toml', which is no mechanism"):
        execute(scene(tmp_path, ["records"], files=["bad.toml"]))
    two = {"line": {"length": 3}, "path": {"points": [[0, 0], [1, 0], [1, 1]]}}
    with pytest.raises(SceneError, match=r"has line and path; only one target works"):
        Scene.from_mapping(question(["records"], embody=two))
    tables = question(["records"], loads={"bar_kg_per_m": 1})
    del tables["mechanism"]["crank_mm"]
    with pytest.raises(SceneError, match=r"has \[mechanism.loads\] but no crank_mm"):
        Scene.from_mapping(tables)


def test_files_are_read_before_work_begins_on_the_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One bad file of many refuses the scene at once, by its line and its name: nothing is computed and lost."""
    worked: list[object] = []
    monkeypatch.setattr(stages, "move", lambda context, built: worked.append(built))
    good = linkage().to_toml()
    spoilt = {
        "nan.toml": good.replace("0.04", "nan", 1),
        "text.toml": "lengths = [1, 'two', 3]\n",
        "short.toml": good[: len(good) // 2],
        "large.toml": "# x\n" * 300_000,
        "binary.json": "\x00\x01",
    }
    for name, text in spoilt.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "loop.toml").symlink_to(tmp_path / "loop.toml")
    for name in (*spoilt, "folder.toml", "loop.toml"):
        own = scene(tmp_path, ["records"])
        own = replace(own, mechanism=replace(own.mechanism, files=(*own.mechanism.files, name)))
        with pytest.raises(SceneError, match=rf"\[mechanism.files.1\] names '{name}', which (is no mechanism|cannot)"):
            run(own, out=tmp_path / "out")
    assert worked == []


def test_too_many_candidates_are_told_before_work_begins(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    worked: list[object] = []
    monkeypatch.setattr(stages, "embody", lambda context, design: worked.append(design))
    tables = question(["records"])
    tables["structure"]["generate"] = {"limit": 4}
    with pytest.raises(TooLargeError, match="more than limit = 4 mechanisms; raise the limit"):
        run(Scene.from_mapping(tables), tmp_path)
    assert worked == []


def test_a_listing_without_end_obeys_the_time_of_the_budget(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from graphsynth import synthesis

    usual = list(synthesis.enumerate_mechanisms(StructuralSpec(W=1, links=4, p2=0)))

    def endless(*arguments: object, **options: object) -> Iterator[MechanismGraph]:
        while True:
            time.sleep(0.01)
            yield usual[0]

    monkeypatch.setattr(synthesis, "enumerate_mechanisms", endless)
    tables = question(["records"]) | {"budget": {"time_s": 0.2}}
    with pytest.raises(SceneError, match=r"\[budget\] stops the run while candidates are listed \(\d+ so far\).*0.2 s"):
        run(Scene.from_mapping(tables), tmp_path)


def test_only_what_is_asked_for_is_a_stage(tmp_path: Path) -> None:
    report = execute(scene(tmp_path, ["records"]))
    assert [stage.name for stage in report.stages] == ["take", "embody", "move", "assess", "collect"]
    loaded = {room for time in report.times for room in time.modules}
    assert not {"graphsynth.jamming", "graphsynth.dynamics", "matplotlib"} & loaded


@pytest.mark.slow
def test_the_scene_of_the_how_to_uses_every_part(tmp_path: Path) -> None:
    page = Path(__file__).parents[2] / "docs" / "how-to" / "search-straight-lines.md"
    text = page.read_text(encoding="utf-8").split("```toml\n")[1].split("```")[0]
    (tmp_path / "six.toml").write_text(text, encoding="utf-8")
    report = run(tmp_path / "six.toml", out=tmp_path / "out")
    assert {stage.name for stage in report.stages} >= {
        "take",
        "embody",
        "move",
        "jamming",
        "dynamics",
        "assess",
        "rank",
    }
    assert 1 <= len(report["records"]) <= 3 and {record.status for record in report["records"]} == {"assessed"}
    names = {margin.name for margin in report["records"][0].margins}
    assert names >= {
        "tilt allowed",
        "binding torque",
        "largest torque",
        "mean speed with the motor",
        "transmission angle",
    }
    assert len(report["animations"]) == len(report["plots"]) == min(2, len(report["records"]))
    assert len(report["binding_curves"]) == len(report["plots"])
    assert "wears first" in report["binding_curves"][0].caption or "free" in report["binding_curves"][0].caption
