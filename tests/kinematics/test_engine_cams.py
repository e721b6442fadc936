"""Cams: translating and oscillating followers against closed forms and fifty digits, cams inside groups, files."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st
from mpmath import mp

from graphsynth import Cam, Driver, Mechanism, MechanismGraph, Prismatic, Revolute
from graphsynth.core.errors import GeometryError
from graphsynth.kinematics import simulate, simulate_batch
from graphsynth.mechanism.constraints import jacobian, residual
from graphsynth.systems.platform.rank_check import loop_closure

TURN = np.linspace(0.0, 2.0 * np.pi, 361)
HARMONICS = ((0.12, -0.05), (0.03, 0.04), (0.0, -0.01))
H = 1e-3
WEIGHTS = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280]) / H


def translating(offset: float = 0.0) -> Mechanism:
    """Cam 1 turns about the origin, follower 2 slides along the y axis at x = offset."""
    graph = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
    joints = [
        Revolute(0, 1), Prismatic(0, 2, (offset, 0.0), (0.0, 0.0), math.pi / 2, math.pi / 2),
        Cam(1, 2, radius=1.0, harmonics=HARMONICS),
    ]  # fmt: skip
    return Mechanism(graph, joints, [Driver(0, 1)], pose=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (offset, 1.0, 0.0)))


def oscillating() -> Mechanism:
    """Cam 1 turns about the origin; the rocker 2 of length 1.5 turns about (2, 0)."""
    graph = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
    joints = [
        Revolute(0, 1), Revolute(0, 2, (2.0, 0.0), (0.0, 0.0)),
        Cam(1, 2, at_b=(1.5, 0.0), angle_a=0.3, radius=1.0, harmonics=HARMONICS),
    ]  # fmt: skip
    return Mechanism(graph, joints, [Driver(0, 1)], pose=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (2.0, 0.0, 2.3)))


def pitch(psi: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    parts = np.array([Cam(0, 1, radius=1.0, harmonics=HARMONICS).pitch_radius(float(value)) for value in psi])
    return parts[:, 0], parts[:, 1], parts[:, 2]


def test_radial_follower_shows_the_pitch_curve() -> None:
    motion = simulate(translating(), TURN)
    rho, first, second = pitch(math.pi / 2 - TURN)
    assert motion.completed and motion.closure.closed
    np.testing.assert_allclose(motion.poses[:, 2, 1], rho, atol=1e-14)
    np.testing.assert_allclose(motion.velocities[:, 2, 1], -first, atol=1e-13)
    np.testing.assert_allclose(motion.accelerations[:, 2, 1], second, atol=1e-12)
    dead = [event.input for event in motion.events if event.kind == "dead centre"]
    np.testing.assert_allclose(pitch(math.pi / 2 - np.array(dead))[1], 0.0, atol=1e-12)
    assert len(dead) >= 2


def test_offset_follower_against_fifty_digits() -> None:
    motion = simulate(translating(0.3), TURN[::30])
    with mp.workdps(50):
        for u, y in zip(motion.inputs, motion.poses[:, 2, 1]):

            def gap(s: mp.mpf, u: float = float(u)) -> mp.mpf:
                psi = mp.atan2(s, mp.mpf(0.3)) - mp.mpf(u)
                rho = mp.mpf(1) + sum(
                    mp.mpf(c) * mp.cos(k * psi) + mp.mpf(s_k) * mp.sin(k * psi)
                    for k, (c, s_k) in enumerate(HARMONICS, 1)
                )
                return mp.hypot(s, mp.mpf(0.3)) - rho

            assert abs(mp.findroot(gap, mp.mpf(float(y))) - mp.mpf(float(y))) < 1e-15


def test_oscillating_follower_keeps_touch_and_has_true_rates() -> None:
    motion = simulate(oscillating(), TURN)
    assert motion.completed and motion.closure.closed and motion.residual < 1e-14
    roller = motion.point(2, (1.5, 0.0)).position
    psi = np.arctan2(roller[:, 1], roller[:, 0]) - TURN - 0.3
    np.testing.assert_allclose(np.hypot(*roller.T), pitch(psi)[0], atol=1e-14)
    fine = simulate(oscillating(), 0.8 + H * np.arange(-4, 5))
    for values, rates in ((fine.poses, fine.velocities[4]), (fine.velocities, fine.accelerations[4])):
        np.testing.assert_allclose(np.tensordot(WEIGHTS, values, axes=1), rates, atol=1e-9)


@given(st.integers(0, 10**6))
def test_gradient_agrees_with_differences(seed: int) -> None:
    random = np.random.default_rng(seed)
    cam = Cam(0, 1, tuple(random.normal(size=2)), tuple(random.normal(size=2)), 0.4, 2.0, HARMONICS)
    pose = random.normal(size=(2, 3)) * [[1.0, 1.0, 2.0]]
    gap = complex(*pose[1, :2]) - complex(*pose[0, :2])
    gap += np.exp(1j * pose[1, 2]) * complex(*cam.at_b) - np.exp(1j * pose[0, 2]) * complex(*cam.at_a)
    if abs(gap) < 0.3:
        return
    J = jacobian([cam], pose)[0]
    for k in range(6):
        step = np.zeros(6)
        step[k] = 1e-6
        difference = residual([cam], pose + step.reshape(2, 3)) - residual([cam], pose - step.reshape(2, 3))
        assert abs(difference[0] / 2e-6 - J[k]) < 2e-8


def test_cam_in_a_larger_group() -> None:
    """Follower 2 pushes a coupler: the dyad 3-4 hangs on it."""
    graph = MechanismGraph(5, [(0, 1), (0, 2), (1, 2, 2), (2, 3), (3, 4), (0, 4)], frame=0)
    base = oscillating()
    joints = [
        *base.joints,
        Revolute(2, 3, (0.9, 0.2)),
        Revolute(3, 4, (1.4, 0.0), (1.0, 0.0)),
        Revolute(0, 4, (3.0, 0.0)),
    ]
    mechanism = Mechanism(graph, joints, [Driver(0, 1)], pose=(*base.pose, (0.0, 0.0, 0.0), (3.0, 0.0, 1.6)))
    motion = simulate(mechanism, TURN)
    assert motion.completed and motion.closure.closed and motion.residual < 1e-13


def test_batch_scales_the_mean_radius() -> None:
    mechanism = translating()
    sets = np.repeat(mechanism.dimensions[None], 3, axis=0)
    sets[:, 2, 6] = [1.0, 1.2, 1.5]
    batch = simulate_batch(mechanism, TURN, sets)
    assert batch.completed.all()
    np.testing.assert_allclose(
        batch.point(2, (0.0, 0.0))[1, :, 1] - batch.point(2, (0.0, 0.0))[0, :, 1], 0.2, atol=1e-13
    )


def test_loop_closure_of_a_cam() -> None:
    """The loop matrix of the velocities has one freedom, with the ratio of speeds that the motion shows."""
    motion = simulate(oscillating(), [0.8, 0.9])
    found = loop_closure(motion.mechanism, motion.poses[0])
    assert found.mobility == 1
    speeds = dict(zip(found.columns, found.motions[0]))
    ratio = speeds["R 0-2"] / speeds["R 0-1"]
    np.testing.assert_allclose(ratio, motion.velocities[0, 2, 2], atol=1e-12)


@pytest.mark.parametrize("mechanism", [translating(0.2), oscillating()], ids=["translating", "oscillating"])
def test_both_followers_are_certified(mechanism: Mechanism) -> None:
    from graphsynth.kinematics.certify import certify

    proof = certify(simulate(mechanism, TURN[::6]))
    assert proof.certified and proof.closed and proof.position_radius.max() < 1e-12


def test_mobility_and_files() -> None:
    mechanism = oscillating()
    report = mechanism.mobility(simulate(mechanism, [0.0]).poses[0])
    assert mechanism.graph.mobility == 1 and report.by_rank == 1
    assert Mechanism.from_toml(mechanism.to_toml()) == mechanism
    assert Mechanism.from_json(mechanism.to_json()) == mechanism


@pytest.mark.parametrize(
    ("change", "words"),
    [({"radius": 0.1, "harmonics": ((0.5, 0.0),)}, "positive everywhere"), ({"radius": -1.0}, "must be positive"),
     ({"harmonics": ((1.0,),)}, "coordinates"), ({"harmonics": ((math.nan, 0.0),)}, "finite")],
)  # fmt: skip
def test_bad_cams(change: dict, words: str) -> None:
    with pytest.raises(GeometryError, match=words):
        Cam(0, 1, **change)


@pytest.mark.parametrize(
    ("harmonics", "kind", "order", "where"),
    [
        (((0.0, 0.2),), "dead centre", 2, [0.0, math.pi]),  # y = 1 + 0.2 cos u
        (((0.0, -0.15), (0.0, 0.0), (0.0, -0.2 / 12)), "dead centre", 4, [0.0, math.pi]),  # y' = 0.2 sin(u)^3
        (((0.15, 0.0), (0.0, 0.075)), "dwell", 3, [math.pi]),  # y' = 0.3 (1 + cos u) (cos u - 1/2)
    ],
)  # fmt: skip
def test_order_of_dead_centres_and_dwells(harmonics: tuple, kind: str, order: int, where: list[float]) -> None:
    base = translating()
    joints = [*base.joints[:2], Cam(1, 2, radius=1.0, harmonics=harmonics)]
    motion = simulate(Mechanism(base.graph, joints, base.drivers, pose=base.pose), np.linspace(-0.6, 5.4, 300))
    found = [event for event in motion.events if event.kind == kind]
    assert {event.order for event in found} == {order}
    np.testing.assert_allclose([event.input for event in found], where, atol=1e-5 if order == 4 else 1e-9)
