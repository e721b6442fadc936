"""Pins in slots, gears and cams in mechanisms that close only with their pins shifted: closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

import graphsynth as gs
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.binding import JointStiffness, unclosed_motion
from graphsynth.jamming.joints import JointLimits, SlideLimits
from graphsynth.mechanism.joints import Cam, Gear, PinSlot, Prismatic, Revolute

Array = NDArray[np.float64]
CRANK, PITCH, K, START = 0.1, 0.25, 1e7, 0.7
U = np.radians(np.arange(40.0, 400.0, 40.0))


def yoke(error: float) -> gs.Mechanism:
    """A yoke with two slots, moved by the pins of two cranks that equal gears turn; one slot is misplaced."""
    graph = gs.MechanismGraph(4, [(0, 1), (0, 2), (0, 3), (1, 2, 2), (1, 3, 2), (2, 3, 2)], frame=0)
    joints: list[Any] = [
        Revolute(0, 1), Prismatic(0, 2), Revolute(0, 3, (2.0 * PITCH, 0.0)), Gear(1, 3, radius_a=PITCH, radius_b=PITCH),
        PinSlot(2, 1, (0.0, 0.0), (CRANK, 0.0), math.pi / 2),
        PinSlot(2, 3, (2.0 * PITCH + error, 0.0), (CRANK, 0.0), math.pi / 2),
    ]  # fmt: skip
    pose = [(0.0, 0.0, 0.0), (0.0, 0.0, START), (CRANK * math.cos(START), 0.0, 0.0), (2.0 * PITCH, 0.0, -START)]
    return gs.Mechanism(graph, tuple(joints), (gs.Driver(0, 1),), pose=tuple(pose))


def bound(mechanism: gs.Mechanism, clearance: float, stiffness: dict[Any, float], u: Array) -> gs.BindingReport:
    """Joints that tilt as they like; those with a stiffness shift."""
    joints: dict[Any, Any] = {}
    for joint in mechanism.joints:
        if isinstance(joint, Prismatic):
            joints[joint.pair] = SlideLimits(0.0, 0.0)
        elif isinstance(joint, Revolute | PinSlot):
            own = clearance if joint.pair in stiffness else 0.0
            joints[joint.pair] = JointLimits(math.inf, 0.0, radial_clearance=own)
    springs = {pair: JointStiffness(1.0, 1.0, own) for pair, own in stiffness.items()}
    return unclosed_motion(mechanism, u).binding(tilt=(), joints=joints, stiffness=springs)


@pytest.mark.parametrize(("clearance", "teeth"), [(0.0, math.inf), (3e-5, math.inf), (3e-5, 2e6), (1.1e-4, 2e6)])
def test_a_slot_that_is_misplaced(clearance: float, teeth: float) -> None:
    """Both slots in series, and beside them the teeth, which turn the second crank: energy and its derivative."""
    error = 2e-4
    stiffness = {(1, 2): K, (2, 3): K} | ({(1, 3): teeth} if math.isfinite(teeth) else {})
    report = bound(yoke(error), clearance, stiffness, U)
    energy, torque = [], []
    for angle in U.tolist():

        def over(turn: float, angle: float = angle) -> float:
            return max(error + CRANK * (math.cos(angle) - math.cos(angle - turn)) - 2.0 * clearance, 0.0)

        def least(turn: float) -> float:
            return 0.25 * K * over(turn) ** 2 + (0.5 * teeth * (PITCH * turn) ** 2 if turn else 0.0)

        turn = 0.0
        if math.isfinite(teeth):
            turn = minimize_scalar(least, bounds=(-0.02, 0.02), method="bounded", options={"xatol": 1e-13}).x
        energy.append(least(turn))
        torque.append(0.5 * K * over(turn) * CRANK * (math.sin(angle - turn) - math.sin(angle)))
    np.testing.assert_allclose(report.energy, energy, rtol=1e-9, atol=1e-13)
    np.testing.assert_allclose(report.elastic_torque, torque, rtol=1e-5, atol=1e-6)
    assert report.answer == ("free" if 2.0 * clearance >= error else "binds")


def cam_and_rod(radius: float, harmonic: float) -> gs.Mechanism:
    """A slider held by a cam, and by a rod to a crank on the cam's shaft too."""
    graph = gs.MechanismGraph(4, [(0, 1), (0, 2), (1, 3), (2, 3), (1, 2, 2)], frame=0)
    joints: list[Any] = [
        Revolute(0, 1), Prismatic(0, 2), Revolute(1, 3, (CRANK, 0.0)), Revolute(2, 3, (0.0, 0.0), (0.3, 0.0)),
        Cam(1, 2, radius=radius, harmonics=((harmonic, 0.0),)),
    ]  # fmt: skip
    x = radius + harmonic * math.cos(START)
    pin = complex(CRANK * math.cos(START), CRANK * math.sin(START))
    pose = [(0.0, 0.0, 0.0), (0.0, 0.0, START), (x, 0.0, 0.0), (pin.real, pin.imag, float(np.angle(x - pin)))]
    return gs.Mechanism(graph, tuple(joints), (gs.Driver(0, 1),), pose=tuple(pose))


def test_a_rod_beside_a_cam() -> None:
    """The cam places the slider, so the rod is too long or too short by what its two pins take."""
    clearance, radius = 1e-3, math.sqrt(0.3**2 - 0.5 * CRANK**2)
    report = bound(cam_and_rod(radius, CRANK), clearance, {(1, 3): K, (2, 3): K}, U)
    way = np.abs(radius + CRANK * np.cos(U) - CRANK * np.exp(1j * U))
    over = np.maximum(np.abs(way - 0.3) - 2.0 * clearance, 0.0)
    assert (over > 0.0).any() and (over == 0.0).any()
    np.testing.assert_allclose(report.energy, 0.25 * K * over**2, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(report.motion.poses[:, 2, 0], radius + CRANK * np.cos(U), atol=1e-12)


def test_contacts_of_cams_do_not_give_way() -> None:
    with pytest.raises(GeometryError, match="joint 1-2 is a cam contact, which is held in the plane"):
        bound(cam_and_rod(0.3, CRANK), 0.0, {(1, 2): K}, U)


def test_exact_closure_takes_the_samples_without_shifted_pins() -> None:
    motion = gs.Mechanism.four_bar(0.2, 0.1, 0.2004, 0.1).simulate(np.radians([60.0, 180.0, 360.0]), events=False)
    assert list(motion.assembled) != [True] * 3
    joints = JointLimits(0.001, 0.0, radial_clearance=1e-4)
    report = motion.binding(tilt=0.01, joints=joints, stiffness=JointStiffness(900.0, 1e6, K))
    aside = (report.shift > 0.0).any(axis=1)
    assert aside.any() and not aside.all()
    assert len(report.exact().energy) == int((~aside).sum())
    with pytest.raises(GeometryError, match=f"sample {int(np.argmax(aside))} closes only with its pins shifted"):
        report.exact(list(range(3)))
