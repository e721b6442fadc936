"""Singularity types, statics, maps and distances against definitions, power balance and brute force."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.maps import platform_map, quality
from graphsynth.systems.platform.parallel_platform import WORKING_MODES, ParallelPlatform
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
from graphsynth.systems.platform.singular_loci import type_two_curves
from graphsynth.systems.platform.singularity import crank_statics, singularity, singularity_distance, statics
from graphsynth.systems.platform.workspace import constant_orientation_workspace

G1, MOCK = ParallelPlatform.g1(), ParallelPlatform.mock()
ALPHA_MOCK = 2.0 * math.atan(3.0 / 7.0)
HOME = (-1, -1, -1)
MECHANISM = SingleMotorPlatform(crank=(10, 5, 2), phase=(0, 0.5, 1))

coordinate = st.floats(-0.5, 0.5)
wrenches = st.lists(st.floats(-10.0, 10.0), min_size=3, max_size=3)


def closed(x: float, y: float, alpha: float, mode: int) -> tuple[np.ndarray, np.ndarray]:
    X = np.array([1.2 + x, 0.9 + y, 0.15 + alpha])
    theta = G1.inverse(X, WORKING_MODES[mode]).theta
    assume(bool(np.isfinite(theta).all()))
    return X, theta


# --- types


def test_regular_home() -> None:
    found = singularity(MOCK, [0, 0, 0], MOCK.inverse([0, 0, 0], HOME).theta)
    assert found.kind == "regular" and found.legs == () and found.uncontrolled.shape == (0, 3)
    assert found.sines == pytest.approx((-1.0, -1.0, -1.0), abs=1e-15)  # right angle between rocker and link
    assert found.determinant == pytest.approx(-111974400 * math.sqrt(3), rel=1e-13)


def test_type_two_at_the_concurrent_lines() -> None:
    X = [0.0, 0.0, ALPHA_MOCK]
    theta = MOCK.inverse(X, HOME).theta
    found = singularity(MOCK, X, theta)
    assert found.kind == "II" and abs(found.centre) < 1e-12
    JX, _ = MOCK.jacobians(X, theta)
    assert np.abs(JX @ found.uncontrolled[0]).max() < 1e-10 * np.abs(JX).max()
    d = MOCK.vertices(X) - MOCK.elbows(theta)
    forces = found.self_stress[0] * d / np.abs(d)  # in balance without a load
    assert abs(forces.sum()) < 1e-12
    assert abs(np.imag(np.conj(MOCK.vertices(X)) * forces).sum()) < 1e-10


def test_uncontrolled_motion_keeps_the_legs_to_second_order() -> None:
    curve = max(type_two_curves(G1, 0.0, (1, 1, -1), nodes=60), key=lambda c: len(c.points))
    i = len(curve.points) // 2
    X, theta = np.array([curve.points[i].real, curve.points[i].imag, 0.0]), curve.theta[i]
    found = singularity(G1, X, theta)
    assert found.kind == "II"
    opened = [np.abs(G1.closure(X + h * found.uncontrolled[0], theta)).max() for h in (1e-2, 1e-3)]
    assert opened[0] / opened[1] == pytest.approx(100.0, rel=0.1)  # the first order vanishes
    p, q = complex(*X[:2]), found.centre
    assert abs(1j * (p - q) * found.uncontrolled[0, 2] - complex(*found.uncontrolled[0, :2])) < 1e-12


def test_type_one_and_three() -> None:
    arc = constant_orientation_workspace(G1, 0.15).arcs[0]
    p = complex(arc.point(0.5 * (arc.start + arc.stop)))
    theta = G1.inverse([p.real, p.imag, 0.15], (1, 1, 1)).theta
    theta = np.where(np.isfinite(theta), theta, 0.0)
    theta[arc.circle.leg - 1] = np.angle(p - arc.circle.centre)
    found = singularity(G1, [p.real, p.imag, 0.15], theta, tolerance=1e-7)
    assert found.kind == "I" and found.legs == (arc.circle.leg,)
    JX, JT = G1.jacobians([p.real, p.imag, 0.15], theta)
    velocity = np.linalg.solve(JX, -JT * [0.3, -0.7, 1.1])  # any rocker speeds
    assert abs(found.lost[0] @ velocity) < 1e-7
    curve = type_two_curves(G1, 0.0, (1, 1, 1), nodes=60)[0]
    end = singularity(G1, [curve.points[0].real, curve.points[0].imag, 0.0], curve.theta[0])
    assert end.kind == "III" and end.legs == (curve.ends[0],)


def test_open_pose_is_refused() -> None:
    with pytest.raises(GeometryError, match="open"):
        singularity(G1, [1.2, 0.9, 0.15], [0, 0, 0])
    with pytest.raises(GeometryError, match="three"):
        singularity(G1, [1.2, 0.9], [0, 0, 0])


# --- statics


@settings(max_examples=60, deadline=None)
@given(coordinate, coordinate, coordinate, st.integers(0, 7), wrenches, wrenches)
def test_power_balance_and_equilibrium(
    x: float, y: float, alpha: float, mode: int, wrench: list[float], speeds: list[float]
) -> None:
    X, theta = closed(x, y, alpha, mode)
    JX, JT = G1.jacobians(X, theta)
    assume(np.linalg.cond(JX) < 1e4)
    W, rates = np.array(wrench), np.array(speeds)
    held = statics(G1, X, theta, W)
    assert held.status == "balanced"
    velocity = np.linalg.solve(JX, -JT * rates)
    size = (np.abs(held.rocker_torque).max() + 1.0) * 10.0
    assert W @ velocity == pytest.approx(held.rocker_torque @ rates, abs=1e-10 * size * np.linalg.cond(JX))
    d = G1.vertices(X) - G1.elbows(theta)
    push = held.link_force * d / np.abs(d)
    arm = G1.vertices(X) - complex(X[0], X[1])
    total = [push.sum().real, push.sum().imag, np.imag(np.conj(arm) * push).sum()]
    np.testing.assert_allclose(total, W, atol=1e-9 * size)
    # each rocker: its torque carries the reaction of its link
    rocker = G1.elbows(theta) - np.array(G1.D)
    np.testing.assert_allclose(held.rocker_torque, np.imag(np.conj(rocker) * push), atol=1e-9 * size)


def test_reference_torque_equals_the_velocity_matrix() -> None:
    X, W = [3.0, -2.0, 0.1], [1.0, 2.0, 30.0]
    theta = MOCK.inverse(X, HOME).theta
    np.testing.assert_allclose(
        statics(MOCK, X, theta, W).rocker_torque, MOCK.velocity_matrix(X, theta).T @ W, rtol=1e-12
    )


def test_type_two_is_named_not_computed() -> None:
    X = [0.0, 0.0, ALPHA_MOCK]
    theta = MOCK.inverse(X, HOME).theta
    turned = statics(MOCK, X, theta, [0.0, 0.0, 1.0])
    assert turned.status == "cannot be balanced"
    assert np.isnan(turned.rocker_torque).all() and np.isnan(turned.link_force).all()
    np.testing.assert_allclose(turned.singularity.uncontrolled, [[0.0, 0.0, 1.0]], atol=1e-12)
    np.testing.assert_allclose(turned.unbalanced_power, [1.0], atol=1e-12)
    pushed = statics(MOCK, X, theta, [1.0, -2.0, 0.0])  # no work on the rotation: balanced, but not uniquely
    assert pushed.status == "indeterminate"
    d = MOCK.vertices(X) - MOCK.elbows(theta)
    force = ((pushed.link_force + 7.0 * pushed.singularity.self_stress[0]) * d / np.abs(d)).sum()
    assert force == pytest.approx(1.0 - 2.0j, abs=1e-10)


@pytest.mark.parametrize("psi", [0.0, 0.7, 2.5, 4.0])
def test_crank_torque_is_virtual_work(psi: float) -> None:
    motion = MECHANISM.full_turn(np.array([psi, psi + 1e-3]))
    W = np.array([2.0, -1.0, 40.0])
    held = crank_statics(MECHANISM, psi, motion.pose[0], W)
    assert held.status == "balanced"
    assert held.crank_torque == pytest.approx(motion.velocity[0] @ W, rel=1e-11)
    assert held.motor_torque == pytest.approx(-0.5 * held.crank_torque, rel=1e-14)
    # the bell-crank is in balance between coupler and link
    turn = np.exp(1j * np.array(MECHANISM.frame_angle))
    phi = motion.theta[0] - np.array(MECHANISM.delta)
    O, D = np.array(MECHANISM.axis) * turn, np.array(MECHANISM.platform.D)
    C = D + np.array(MECHANISM.rocker) * np.exp(1j * phi)
    B = O + np.array(MECHANISM.crank) * np.exp(1j * (psi + np.array(MECHANISM.phase)))
    push = held.coupler_force * (C - B) / np.abs(C - B)
    np.testing.assert_allclose(np.imag(np.conj(C - D) * push), held.platform.rocker_torque, rtol=1e-11)
    np.testing.assert_allclose(np.imag(np.conj(B - O) * push), held.shares, rtol=1e-9, atol=1e-12)


def test_dead_point_carries_any_load_without_torque() -> None:
    mechanism = SingleMotorPlatform(crank=(10, 0, 0))
    dead = mechanism.drives[0].dead_points()[0]
    held = crank_statics(mechanism, dead, mechanism.home_pose(dead), [50.0, 20.0, 300.0])
    assert abs(held.crank_torque) < 1e-9 and np.abs(held.platform.rocker_torque).max() > 100.0


def test_locked_drive_is_named() -> None:
    mechanism = SingleMotorPlatform(crank=(35, 0, 0))
    lock = min(angle % math.tau for angle in mechanism.drives[0].barriers()[2])
    poses = mechanism.all_poses(lock - 1e-12)
    held = crank_statics(mechanism, lock - 1e-12, poses[0], [1.0, 0.0, 0.0], tolerance=1e-5)
    assert held.status == "drive 1 locked" and math.isnan(held.crank_torque)
    assert np.isfinite(held.platform.rocker_torque).all()


# --- maps


@pytest.mark.parametrize("sigma", [(1, 1, 1), (-1, 1, -1)])
def test_map_against_definitions(sigma: tuple[int, int, int]) -> None:
    found = platform_map(G1, 0.2, sigma, nodes=40, Lc=0.7)
    rng = np.random.default_rng(5)
    nodes = np.argwhere(np.isfinite(found.quality.determinant))
    for i, j in nodes[rng.integers(0, len(nodes), 25)]:
        X = [found.x[i], found.y[j], 0.2]
        theta = G1.inverse(X, sigma).theta
        J = G1.scaled_velocity_matrix(X, theta, 0.7)
        values = np.linalg.svd(J, compute_uv=False)
        q = {name: getattr(found.quality, name)[i, j] for name in found.quality.__dataclass_fields__ if name != "Lc"}
        assert q["dexterity"] == pytest.approx(1.0 / np.linalg.cond(J), rel=1e-8)
        assert q["velocity_max"] == pytest.approx(values[0], rel=1e-8)
        assert q["velocity_min"] == pytest.approx(values[2], rel=1e-8)
        assert q["force_min"] == pytest.approx(1.0 / values[0], rel=1e-8)
        assert q["force_max"] == pytest.approx(1.0 / values[2], rel=1e-8)
        JX, JT = G1.jacobians(X, theta)
        assert q["determinant"] == pytest.approx(np.linalg.det(JX), rel=1e-9)
        scaled = JX @ np.diag([1.0, 1.0, 1.0 / 0.7])
        assert q["smallest"] == pytest.approx(np.linalg.svd(scaled, compute_uv=False)[2], rel=1e-8)
        assert q["reach"] == pytest.approx(np.abs(JT / (2.0 * np.array(G1.l1) * np.array(G1.l2))).min(), rel=1e-12)
        loads = rng.normal(size=(200, 3))
        loads /= np.linalg.norm(loads, axis=1)[:, None]
        forces = np.linalg.solve(scaled.T, loads.T) * (2.0 * np.array(G1.l2))[:, None]
        largest = np.linalg.norm(forces, axis=0).max()
        assert 0.9 * q["link_force"] < largest < q["link_force"] * (1 + 1e-9)


def test_map_edges() -> None:
    found = platform_map(MOCK, 0.0, HOME, nodes=60)
    inside = np.isfinite(found.quality.determinant)
    p = found.x[:, None] + 1j * found.y[None, :]
    assert (inside == constant_orientation_workspace(MOCK, 0.0).contains(p)).all()
    assert len(found.to_pandas()) == inside.sum()
    singular = quality(MOCK, [0.0, 0.0, ALPHA_MOCK], HOME)
    assert singular.dexterity < 1e-12 and singular.condition > 1e12 and singular.velocity_max > 1e12
    beyond = quality(MOCK, [[500.0, 0.0, 0.0], [0.0, 0.0, 0.0]], HOME)
    assert math.isnan(beyond.dexterity[0]) and beyond.condition[1] == pytest.approx(0.96 * math.sqrt(2), rel=1e-12)
    with pytest.raises(GeometryError, match="sigma"):
        platform_map(MOCK, 0.0, (0, 1, 1))


# --- distances


def test_distance_of_the_mock_up_is_known() -> None:
    """Beside the concurrent pose the nearest singular pose is reached by pure rotation (by symmetry)."""
    found = singularity_distance(MOCK, [0.0, 0.0, 0.75], HOME)
    assert found.nearest.kind == "II" and found.nearest.pose == pytest.approx((0.0, 0.0, ALPHA_MOCK), abs=1e-6)
    assert found.nearest.distance == pytest.approx(45.0 * (ALPHA_MOCK - 0.75), rel=1e-8)
    assert found.other_mode > found.nearest.distance


@pytest.mark.parametrize(
    ("pose", "sigma"), [((1.2, 0.9, -0.45), (1, 1, 1)), ((1.0, 0.8, 0.2), (-1, 1, 1)), ((0.9, 1.1, 0.6), (1, -1, 1))]
)
def test_distance_against_random_poses(pose: tuple[float, float, float], sigma: tuple[int, int, int]) -> None:
    """No singular pose inside the ball, one on its surface."""
    found = singularity_distance(G1, pose, sigma)
    near = found.nearest
    weight = np.array([1.0, 1.0, 1.0 / found.Lc])
    assert np.linalg.norm((np.array(near.pose) - pose) / weight) == pytest.approx(near.distance, rel=1e-9)
    rng = np.random.default_rng(8)
    v = rng.normal(size=(60000, 3))
    v *= (rng.uniform(size=60000) ** (1 / 3) * 0.99 * near.distance / np.linalg.norm(v, axis=1))[:, None]
    X = np.array(pose) + v * weight
    theta = G1.inverse(X, sigma).theta
    assert np.isfinite(theta).all()  # no leg at its limit inside the ball
    assert len(np.unique(np.sign(np.linalg.det(G1.jacobians(X, theta)[0])))) == 1
    if near.kind == "II":
        theta = G1.inverse(near.pose, sigma).theta
        assert abs(G1.determinant(near.pose, theta)) < 1e-6
    else:
        assert np.abs(G1.inverse(near.pose).deficit[near.leg - 1]) < 1e-8


def test_pose_out_of_reach_is_refused() -> None:
    with pytest.raises(GeometryError, match="leg 1"):
        singularity_distance(G1, [9.0, 9.0, 0.0], (1, 1, 1))
    with pytest.raises(GeometryError, match="leg 2 has a link of length zero"):
        singularity_distance(ParallelPlatform(G1.D, G1.b, G1.l1, (1.1, 0.0, 1.05)), [1.2, 0.9, 0.0], (1, 1, 1))
