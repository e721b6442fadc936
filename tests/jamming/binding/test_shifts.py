"""Mechanisms that close only with their pins shifted: closed forms, energy, work, friction, what is refused."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares

import graphsynth as gs
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.binding import ContactFriction, JointStiffness, unclosed_motion
from graphsynth.jamming.joints import JointLimits, SlideLimits
from graphsynth.mechanism.joints import Prismatic

Array = NDArray[np.float64]
Cranks = Callable[[float], gs.Mechanism]
CRANK, FRAME, ERROR, K = 0.1, 0.2, 4e-4, 1e7
U = np.radians(np.arange(10.0, 371.0))


def limits(mechanism: gs.Mechanism, clearance: float, radial: float = K) -> dict[str, Any]:
    """Joints that shift, and tilt as they like; no misalignment."""
    pairs = [joint.pair for joint in mechanism.joints]
    joints: dict[Any, Any] = dict.fromkeys(pairs, JointLimits(math.inf, 0.0, radial_clearance=clearance))
    joints |= {joint.pair: SlideLimits(0.0, 0.0) for joint in mechanism.joints if isinstance(joint, Prismatic)}
    return {"tilt": (), "joints": joints, "stiffness": dict.fromkeys(pairs, JointStiffness(1.0, 1.0, radial))}


def parallelogram(error: float = ERROR) -> gs.Mechanism:
    """A parallelogram whose coupler is too long: its links must pass through a line that they do not fit."""
    return gs.Mechanism.four_bar(FRAME, CRANK, FRAME + error, CRANK)


def in_line(u: Array, clearance: float, pins: int, series: float) -> tuple[Array, Array]:
    """Energy and torque of coupler and rocker in line: clearances of all pins first, then their springs in series."""
    way = np.hypot(FRAME - CRANK * np.cos(u), CRANK * np.sin(u))
    over = np.maximum(FRAME + ERROR - CRANK - way - pins * clearance, 0.0)
    return 0.5 * series * over**2, -series * over * FRAME * CRANK * np.sin(u) / way


@pytest.mark.long
@pytest.mark.parametrize("clearance", [0.0, 1e-4, 0.99 * ERROR / 4.0, 1.01 * ERROR / 4.0])
@pytest.mark.parametrize("mode", [1, -1])
def test_a_length_error_blocks_unless_the_clearances_along_the_line_absorb_it(clearance: float, mode: int) -> None:
    mechanism = parallelogram()
    motion = mechanism.simulate(U, modes={0: mode}, events=False)
    assert not motion.completed
    report = motion.binding(**limits(mechanism, clearance))
    energy, torque = in_line(U, clearance, 4, K / 4.0)
    np.testing.assert_allclose(report.energy, energy, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(report.elastic_torque, torque, atol=1e-9 * max(np.abs(torque).max(), 1e-3))
    assert report.answer == ("free" if 4.0 * clearance >= ERROR else "binds")
    pressed = energy > 1e-12
    over = np.sqrt(2.0 * energy / (K / 4.0))
    np.testing.assert_allclose(report.push[pressed], (K / 4.0 * over[pressed])[:, None] * np.ones(4), rtol=1e-7)
    np.testing.assert_allclose(report.shift[pressed], clearance + report.push[pressed] / K, rtol=1e-7)
    # the links pass the line as they came, and go on as the mirrored motion
    there = np.isclose(np.degrees(U), 350.0) | np.isclose(np.degrees(U), 370.0)
    turned = report.motion.poses[there][:, 2:, 2]
    np.testing.assert_allclose(np.sin(turned[0]), -np.sin(turned[1]), atol=1e-9)


def test_without_stiffness_it_is_free_or_blocks() -> None:
    for clearance, answer in ((0.99 * ERROR / 4.0, "blocks"), (1.01 * ERROR / 4.0, "free")):
        mechanism = parallelogram()
        given = limits(mechanism, clearance) | {"stiffness": 1.0}
        report = mechanism.simulate(U, events=False).binding(**given)
        assert report.answer == answer
        assert report.blocked.any() == (answer == "blocks")
        assert "nothing gives way" in report.statement or answer == "free"
    tight = parallelogram().simulate(U, events=False).binding(**limits(parallelogram(), 0.0) | {"stiffness": 1.0})
    assert any("not assembled" in note for note in tight.notes)  # no clearance, no stiffness: as before


@pytest.mark.long
@pytest.mark.parametrize(("error", "clearance"), [(0.0, 0.0), (2e-4, 0.0), (2e-4, 2e-5), (2e-4, 5.1e-5)])
def test_a_crank_too_many(three_cranks: Cranks, error: float, clearance: float) -> None:
    """The middle crank presses against both others: two pins in series each, the outer ones side by side."""
    mechanism = three_cranks(error)
    with pytest.raises(GeometryError, match="too many constraints"):
        mechanism.simulate(U)
    inputs = np.radians(np.arange(0.0, 361.0, 60.0))
    report = unclosed_motion(mechanism, inputs).binding(**limits(mechanism, clearance))
    over = max(error - 4.0 * clearance, 0.0)
    np.testing.assert_allclose(report.energy, 0.5 * K / 3.0 * over**2, rtol=1e-9, atol=1e-14)
    middle = [report.joints.index(pair) for pair in ((0, 4), (2, 4))]
    np.testing.assert_allclose(report.push[:, middle], K / 3.0 * over, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(report.elastic_torque, 0.0, atol=1e-6)
    np.testing.assert_allclose(np.sin(report.motion.poses[:, 2, 2]), 0.0, atol=1e-3)


@pytest.mark.long
def test_energy_is_the_least_over_all_poses(three_cranks: Cranks) -> None:
    """Against a general optimiser over the poses of all links, with clearances and stiffnesses that differ."""
    random = np.random.default_rng(4)
    mechanism = three_cranks(3e-4)
    pairs = [joint.pair for joint in mechanism.joints]
    c, k = random.uniform(1e-5, 5e-5, 6), random.uniform(5e6, 2e7, 6)
    joints = {pair: JointLimits(math.inf, 0.0, radial_clearance=own) for pair, own in zip(pairs, c)}
    springs = {pair: JointStiffness(1.0, 1.0, own) for pair, own in zip(pairs, k)}
    report = unclosed_motion(mechanism, [0.7, 1.0]).binding(tilt=(), joints=joints, stiffness=springs)

    def energy(v: Array) -> Array:
        pose = np.zeros((5, 3))
        pose[1:] = v.reshape(4, 3) * [1e-3, 1e-3, 1e-2] + np.array(mechanism.pose)[1:]
        pose[1, 2] = 1.0
        found = []
        for joint, own, stiff in zip(mechanism.joints, c, k):
            a, b = (
                complex(*pose[link, :2]) + np.exp(1j * pose[link, 2]) * complex(*at)
                for link, at in ((joint.a, joint.at_a), (joint.b, joint.at_b))  # type: ignore[union-attr]
            )
            found.append(math.sqrt(stiff) * max(abs(b - a) - own, 0.0))
        return np.array(found)

    least = min(least_squares(energy, random.normal(size=12) * 0.1, xtol=1e-15, ftol=1e-15).cost for _ in range(2))
    assert report.energy[1] == pytest.approx(least, rel=1e-7)


@pytest.mark.long
def test_torque_is_the_derivative_of_the_energy_and_friction_is_what_is_lost() -> None:
    mechanism = parallelogram()
    u = np.linspace(math.radians(350.0), math.radians(370.0), 201)
    motion = mechanism.simulate(u, events=False)
    pin = ContactFriction(0.1, 0.006, 0.02)
    report = motion.binding(**limits(mechanism, 5e-5), friction=pin)
    slope = np.gradient(report.energy, u)
    size = np.abs(slope).max()
    assert np.quantile(np.abs(slope - report.elastic_torque), 0.95) < 5e-3 * size  # differences of second order
    assert report.work_error < 5e-4
    assert float(np.trapezoid(report.torque, u)) == pytest.approx(report.loss, rel=5e-3)
    turn = np.array([report.motion.velocities[:, b, 2] - report.motion.velocities[:, a, 2] for a, b in report.joints])
    rubs = (0.1 * 0.006 * report.push * np.abs(turn.T)).sum(axis=1)
    np.testing.assert_allclose(report.friction_torque, rubs, rtol=1e-9, atol=1e-12)
    assert report.wear[0].push == pytest.approx(report.push.max())
    # in line the coupler and the rocker turn as one about the end of the crank
    u0 = np.argmin(np.abs(u - math.tau))
    rate = -CRANK / (FRAME - CRANK)
    assert report.motion.velocities[u0, 2:, 2] == pytest.approx([rate, rate], rel=1e-2)


def test_tilts_and_shifts_add_up() -> None:
    """Both energies at the pose that the shifts leave; where the mechanism closes nothing changes."""
    mechanism = parallelogram()
    motion = mechanism.simulate(U, events=False)
    given: Any = {"tilt": 0.02, "stiffness": JointStiffness(900.0, 1e7, K)}
    both = motion.binding(**given, joints=JointLimits(0.004, 0.0, radial_clearance=5e-5))
    alone = motion.binding(**given | {"stiffness": JointStiffness(900.0, 1e7)}, joints=JointLimits(0.004, 0.0))
    own = motion.assembled
    np.testing.assert_array_equal(both.energy[own], alone.energy[own])
    np.testing.assert_allclose(both.energy[~own].min(), both.energy[~own].min())
    there = both.motion.poses[~own]
    tilted = gs.binding_torque(both.motion, **given, joints=JointLimits(0.004, 0.0)).energy[~own]
    energy, _ = in_line(U, 5e-5, 3, K / 4.0)  # the shaft of the motor is rigid: three pins have clearance
    assert np.isfinite(there).all()
    np.testing.assert_allclose(both.energy[~own], energy[~own] + tilted, rtol=1e-6)


def test_a_guide_is_held_and_lengths_have_their_unit() -> None:
    """A slider-crank whose rod is shorter than its crank by less than the clearances; metres and millimetres."""
    found = []
    for size, unit in ((1.0, "m"), (1e3, "mm")):
        mechanism = gs.Mechanism.slider_crank(0.05 * size, 0.0499 * size)
        motion = mechanism.simulate(np.linspace(0.2, 2.9, 28), events=False)
        assert not motion.completed
        found.append(motion.binding(**limits(mechanism, 2e-5 * size), unit=unit))
        over = np.maximum(0.05 * np.sin(motion.inputs) - 0.0499 - 6e-5, 0.0)
        np.testing.assert_allclose(found[-1].energy, 0.5 * K / 4.0 * over**2, rtol=1e-7, atol=1e-12)
    np.testing.assert_allclose(found[0].push, found[1].push, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(found[0].elastic_torque, found[1].elastic_torque, rtol=1e-6, atol=1e-9)


@pytest.mark.long
def test_far_beyond_its_range_it_would_break() -> None:
    motion = parallelogram(0.02).simulate(U, modes={0: 1}, events=False)
    report = motion.binding(**limits(motion.mechanism, 1e-4))
    assert any("would break" in note for note in report.notes)


def test_what_is_refused() -> None:
    mechanism = parallelogram()
    motion = mechanism.simulate(U, events=False)
    given = limits(mechanism, 1e-4)
    given["stiffness"] = given["stiffness"] | {(1, 2): JointStiffness(1.0)}
    with pytest.raises(GeometryError, match="joint 1-2 has a radial_clearance but does not give way beyond it"):
        motion.binding(**given)
    with pytest.raises(GeometryError, match="mechanism is Motion, no Mechanism"):
        unclosed_motion(motion, U)  # type: ignore[arg-type]
    with pytest.raises(GeometryError, match="no pose or no driver"):
        unclosed_motion(replace(mechanism, pose=None), U)
