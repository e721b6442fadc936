"""The whole mechanism in the general engine; rank of its loop-closure matrix at ordinary poses and at events."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.kinematics import simulate
from graphsynth.mechanism.constraints import residual
from graphsynth.mechanism.joints import Gear, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.systems.platform.drive import GearTrain
from graphsynth.systems.platform.rank_check import as_mechanism, link_poses, loop_closure, platform_loop_closure
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

REFERENCE = SingleMotorPlatform(crank=(10, 5, 1), phase=(0, 0.5, 1))


@pytest.mark.parametrize(
    "source",
    [
        REFERENCE,
        SingleMotorPlatform(),
        SingleMotorPlatform(crank=(8.0, 0.0, 3.0), phase=(1.0, 2.0, 3.0)),
        SingleMotorPlatform(crank=(9.0,) * 3, phase=SingleMotorPlatform().frame_angle, gears=GearTrain(20, 60)),
    ],
    ids=["three cranks", "equal", "one still", "pure rotation, other gears"],
)
def test_general_engine_gives_the_same_motion(source: SingleMotorPlatform) -> None:
    expected = source.full_turn(181)
    assert expected.complete
    motion = simulate(as_mechanism(source), expected.psi)
    assert motion.completed and motion.closure.closed
    for own, closed in (
        (motion.poses, expected.pose), (motion.velocities, expected.velocity),
        (motion.accelerations, expected.acceleration),
    ):  # fmt: skip
        assert np.abs(own[:, 14] - closed).max() < 1e-11
    for i in (0, 37, 90):
        known = link_poses(source, float(expected.psi[i]), expected.pose[i])
        assert np.abs(motion.poses[i, :, :2] - known[:, :2]).max() < 1e-11
        assert np.abs(np.exp(1j * motion.poses[i, :, 2]) - np.exp(1j * known[:, 2])).max() < 1e-12
    assert np.allclose(motion.velocities[:, 1, 2], 1.0 / source.gears.ratio, atol=1e-13)


@pytest.mark.long
@settings(max_examples=25, deadline=None)
@given(st.floats(0.0, 6.28))
def test_all_joints_close_and_the_rank_is_full(psi: float) -> None:
    mechanism = as_mechanism(REFERENCE, psi)
    assert np.abs(residual(mechanism.joints, mechanism.pose)).max() < 1e-12 * 100
    report = mechanism.mobility()
    assert (report.count, report.by_rank) == (1, 1)
    found = loop_closure(mechanism)
    assert found.matrix.shape == (24, 25) and found.rank == 24 and found.mobility == 1
    assert np.abs(found.matrix @ found.motions[0]).max() < 1e-14
    assert found.singular_values[-1] > 1e-3 * found.singular_values[0]


def test_null_vector_is_the_motion() -> None:
    motion = REFERENCE.full_turn(5)
    psi, pose, velocity = motion.psi[1], motion.pose[1], motion.velocity[1]
    found = platform_loop_closure(REFERENCE, psi, pose)
    scale = 1.0 / found.component("R 0-2")[0]  # wheels turn with psi
    assert found.component("R 0-1")[0] * scale == pytest.approx(-2.0, rel=1e-12)
    state = REFERENCE.drive(psi)
    for k in range(3):
        assert found.component(f"R 0-{8 + k}")[0] * scale == pytest.approx(state.theta1[k], rel=1e-9, abs=1e-13)
        assert found.component(f"roll 1-{2 + k}")[0] * scale == pytest.approx(3.0, rel=1e-12)
        assert abs(found.component(f"slide 1-{2 + k}")[0]) < 1e-13  # fixed centres
        to_platform = sum(found.component(f"R {a}-{b}")[0] for a, b in ((0, 8 + k), (8 + k, 11 + k), (11 + k, 14)))
        assert to_platform * scale == pytest.approx(velocity[2], rel=1e-9, abs=1e-13)
    with pytest.raises(GeometryError, match="unknown"):
        found.component("R 3-4")


def test_rocker_component_vanishes_at_its_dead_point() -> None:
    dead = REFERENCE.drives[1].dead_points()[0]
    found = platform_loop_closure(REFERENCE, dead, REFERENCE.home_pose(dead))
    assert found.rank == 24
    assert abs(found.component("R 0-9")[0]) < 1e-12 < abs(found.component("R 0-8")[0])
    assert abs(found.component("R 0-1")[0]) > 0.1


def test_motor_component_vanishes_where_the_platform_is_singular() -> None:
    """Equal leg-frame phases, cranks of 28 mm: the pure rotation runs into the concurrent pose 2 atan(3/7)."""
    from scipy.optimize import brentq

    source = SingleMotorPlatform(crank=(28.0,) * 3, phase=SingleMotorPlatform().frame_angle)
    event = next(e for e in source.full_turn(181).events if e.ends_motion)
    assert event.kind == "platform singular"
    alpha = 2.0 * math.atan(3.0 / 7.0)
    theta = source.platform.inverse([0.0, 0.0, alpha], (-1, -1, -1)).theta

    def missing(psi: float) -> float:
        return float(np.angle(np.exp(1j * (source.drive(psi).theta[0] - theta[0]))))

    psi = brentq(missing, event.psi - 0.02, event.psi + 0.02, xtol=1e-15)
    assert psi == pytest.approx(event.psi, abs=1e-6)
    found = loop_closure(as_mechanism(source, psi, [0.0, 0.0, alpha]))
    assert found.mobility == 1 and abs(found.component("R 0-1")[0]) < 1e-12
    assert np.abs([found.component(f"R {11 + k}-14")[0] for k in range(3)]).min() > 0.1  # the platform moves


def test_one_more_freedom_where_dead_points_meet_the_singular_platform() -> None:
    """The limit crank 45 (1 - sqrt(5/29)): there the inner dead point of all rockers is the concurrent pose."""
    length = 45.0 * (1.0 - math.sqrt(5.0 / 29.0))
    source = SingleMotorPlatform(crank=(length,) * 3, phase=SingleMotorPlatform().frame_angle)
    alpha = 2.0 * math.atan(3.0 / 7.0)
    theta = source.platform.inverse([0.0, 0.0, alpha], (-1, -1, -1)).theta
    turn = np.exp(1j * np.array(source.frame_angle))
    reach = 60.0 + 45j + 60.0 * np.exp(1j * (theta - np.array(source.delta))) / turn  # from wheel axis to rocker end
    assert np.abs(np.abs(reach) - (45.0 - length)).max() < 1e-12
    psi = float(np.angle(-reach[0]))
    found = loop_closure(as_mechanism(source, psi, [0.0, 0.0, alpha]), tolerance=1e-7)
    assert found.mobility == 2 and found.rank == 23


def test_motor_component_vanishes_at_a_drive_lock() -> None:
    source = SingleMotorPlatform(crank=(35.0, 0.0, 0.0))
    lock = min(angle % math.tau for angle in source.drives[0].barriers()[2])
    errors = []
    for before in (1e-4, 1e-6, 1e-8):  # phi has a square root at the lock
        psi = lock - before
        if not np.isfinite(source.drive(psi).theta).all():
            psi = lock + before
        found = platform_loop_closure(source, psi, source.all_poses(psi)[0])
        assert found.mobility == 1
        errors.append(abs(found.component("R 0-1")[0]))
    assert errors[2] < 1e-3 and errors[0] / errors[1] == pytest.approx(10.0, rel=0.05)


def test_rank_drops_at_a_change_point() -> None:
    """Crank 30 mm: at the far end crank, coupler, rocker and frame are collinear, and one more freedom appears."""
    source = SingleMotorPlatform(crank=(30.0, 0.0, 0.0))
    kind, _, (at, *_) = source.drives[0].barriers()
    assert kind == "change point"
    near = at - 1e-9 if np.isfinite(source.drive(at - 1e-9).theta).all() else at
    poses = source.all_poses(near)
    found = loop_closure(as_mechanism(source, near, poses[0]), tolerance=1e-6)
    assert found.rank == 23 and found.mobility == 2
    away = platform_loop_closure(source, at - 0.3, source.all_poses(at - 0.3)[0])
    assert away.rank == 24


def test_other_joints() -> None:
    """Slider-crank, pin in slot and a gear pair: freedoms minus rank is the mobility at a regular pose."""
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    slider = Mechanism(
        graph,
        [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (3.0, 0.0)), Prismatic(0, 3)],
        pose=[(0, 0, 0), (0, 0, 0.5), (math.cos(0.5), math.sin(0.5), -math.asin(math.sin(0.5) / 3)),
              (math.cos(0.5) + math.sqrt(9 - math.sin(0.5) ** 2), 0, 0)],
    )  # fmt: skip
    found = loop_closure(slider)
    assert found.matrix.shape == (3, 4) and found.mobility == 1
    crank, slide = found.component("R 0-1")[0], found.component("P 0-3")[0] * found.Lc
    x = math.cos(0.5) + math.sqrt(9 - math.sin(0.5) ** 2)
    rate = -math.sin(0.5) * x / math.sqrt(9 - math.sin(0.5) ** 2)
    assert slide / crank == pytest.approx(rate, rel=1e-12)
    pair = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
    slot = Mechanism(
        pair, [Revolute(0, 1), Revolute(0, 2, (2.0, 0.0)), PinSlot(1, 2, at_b=(0.5, 0.0))],
        pose=[(0, 0, 0), (0, 0, math.atan2(0.5, 2.0)), (2.0, 0, math.pi / 2)],
    )  # fmt: skip
    found = loop_closure(slot)
    assert found.matrix.shape == (3, 4) and found.mobility == 1
    inner = Mechanism(
        pair, [Revolute(0, 1), Revolute(0, 2, (1.0, 0.0)), Gear(1, 2, radius_a=3.0, radius_b=2.0, internal=True)],
        pose=[(0, 0, 0), (0, 0, 0), (1.0, 0, 0)],
    )  # fmt: skip
    found = loop_closure(inner)
    assert found.mobility == 1
    assert found.component("R 0-2")[0] / found.component("R 0-1")[0] == pytest.approx(1.5, rel=1e-12)


def test_bad_input() -> None:
    with pytest.raises(GeometryError, match="wheel 1"):
        as_mechanism(SingleMotorPlatform(axis=(0.0, 45.0, 45.0), coupler=(90.0, 45, 45)), 0.0, [0.0, 0.0, 0.0])
    bare = as_mechanism(REFERENCE)
    with pytest.raises(GeometryError, match="configuration"):
        loop_closure(Mechanism(bare.graph, bare.joints, bare.drivers))
