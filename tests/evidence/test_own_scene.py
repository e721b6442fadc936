"""What a scene states itself is measured: its mechanism, its bearings, its loads; and the platform it builds."""

import math
from dataclasses import replace

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.evidence import Effort, RowStatus
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.pipeline.planar import evidence as planar
from graphsynth.pipeline.scene import Scene, load_scene
from graphsynth.pipeline.stages import Context
from graphsynth.structure.graph import MechanismGraph
from graphsynth.systems.platform import evidence as platform
from graphsynth.systems.platform.motor_stages import drive_of

QUICK = Effort(rounds=1, quick=True)
BEARINGS = {"radius_mm": 17.5, "height_mm": 10, "clearance_mm": 0.03, "alpha_deg": 0.5}


def stated(folder, **tables):
    """Scene that states the graph and the dimensions of a four-bar linkage, in a file."""
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = (Revolute(0, 1), Revolute(1, 2, (0.04, 0)), Revolute(2, 3, (0.1, 0), (0.11, 0)), Revolute(0, 3, (0.09, 0)))
    angle = math.pi - math.acos((0.11**2 + 0.05**2 - 0.1**2) / (2 * 0.11 * 0.05))
    B = complex(0.09 + 0.11 * math.cos(angle), 0.11 * math.sin(angle))
    coupler = float(np.angle(B - 0.04))
    pose = ((0, 0, 0), (0, 0, 0), (0.04, 0, coupler), (0.09, 0, angle))
    (folder / "own.toml").write_text(Mechanism(graph, joints, (Driver(0, 1),), pose=pose).to_toml(), encoding="utf-8")
    given = {
        "scene": {"name": "own", "title": "Own"}, "outputs": {"products": ["records"]},
        "mechanism": {"module": "planar", "files": ["own.toml"], **tables},
    }  # fmt: skip
    return Context(replace(Scene.from_mapping(given), folder=folder))


@pytest.mark.long
def test_positions_are_those_of_the_mechanism_that_the_scene_states(tmp_path):
    problem = planar.positions(stated(tmp_path), QUICK)
    assert "own of the scene (4 links" in problem.question
    assert all(row.good for row in problem.rows)
    assert max(row.error for row in problem.of("engine, with events and derivatives")) < 2e-15


@pytest.mark.slow
def test_bearings_are_those_of_the_scene(tmp_path):
    context = stated(tmp_path, bearings=BEARINGS)
    problem = planar.coupled_joints(context, QUICK)
    assert "own of the scene" in problem.question and all(row.good for row in problem.rows)
    assert max(row.error for row in problem.of("samples")) < 0.01


@pytest.mark.long
def test_loads_are_those_of_the_scene(tmp_path):
    problem = planar.linkage_dynamics(stated(tmp_path, loads={"bar_kg_per_m": 1.0, "speed_rad_s": 5.0}), QUICK)
    assert "own of the scene" in problem.question and "so it shares code" in problem.note
    default = next(row for row in problem.rows if row.default)
    assert default.good and default.error < 1e-8


@pytest.mark.parametrize("measure", [planar.coupled_joints, planar.linkage_dynamics])
def test_what_the_scene_does_not_state_is_left_out(measure, tmp_path):
    with pytest.raises(GeometryError, match="no table"):
        measure(stated(tmp_path), QUICK)


def test_a_mechanism_that_does_not_move_through_the_range_is_no_problem_but_a_reason(tmp_path):
    context = stated(tmp_path, motion={"min_transmission_deg": 80.0})
    with pytest.raises(GeometryError, match=r"can be measured: .*transmission"):
        planar.positions(context, QUICK)


@pytest.mark.parametrize("search", ["dimensions", "path_dimensions"])
def test_searches_say_that_they_are_not_the_scene_s(monkeypatch, search):
    for problem in ("line_problem", "path_problem"):
        monkeypatch.setattr(f"graphsynth.evidence.embodiment.{problem}", lambda _: replace(_nothing(), note="Lots."))
    note = getattr(planar, search)(None, QUICK).note
    assert note.startswith("Not the target of the scene") and note.endswith(" Lots.")


def _nothing():
    from graphsynth.evidence import Problem

    return Problem("p", "q", "mm", ())


def test_the_platform_is_the_one_that_the_stage_moves():
    context = Context(load_scene("didenko"))
    found, table = platform.platform_of(context), context.scene.mechanism
    assert found.crank == table.crank and found.l1 == (table.arm,) * 3
    assert (found.gears.z1, found.gears.z2) == (table.pinion_teeth, table.wheel_teeth)


def test_a_platform_that_cannot_be_assembled_is_a_reason():
    scene = load_scene("didenko")
    apart = replace(scene, mechanism=replace(scene.mechanism, coupler=1e-3))
    with pytest.raises(GeometryError):
        platform.turn(Context(apart), QUICK)


def test_a_drive_has_a_reference_that_shares_nothing_with_it():
    from graphsynth.evidence.drives import drive_problem

    context = Context(load_scene("didenko_drive"))
    model = drive_of(context, 5.0)
    problem = drive_problem(model.plant(), model.motor, model.train, 0.2, QUICK)
    own = problem.of("graphsynth")
    assert {row.status for row in own} == {RowStatus.OK}
    assert all("long doubles" in row.reference for row in own) and own[-1].default and own[-1].error < 1e-11
    assert all("DOP853" in row.reference for row in problem.of("scipy LSODA"))
    # the two references agree to what the second one is good for
    assert abs(own[0].error - own[0].more["distance from scipy DOP853"]) < 1e-11
