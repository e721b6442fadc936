"""Inverse dynamics: when loads are taken, and arguments that make no sense."""

from __future__ import annotations

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.dynamics import (
    Body,
    DynamicModel,
    Force,
    JointFriction,
    Pulse,
    Torque,
    consistent_start,
    inverse_dynamics,
)
from graphsynth.kinematics import simulate
from graphsynth.mechanism.joints import PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

ARM = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1)], [Driver(0, 1)])


def arm(*elements: object) -> DynamicModel:
    """A balanced arm with the inertia 0.1 kg m^2, without gravity."""
    return DynamicModel(ARM, {1: Body(1.0, 0.1)}, elements, gravity=(0.0, 0.0))


def test_loads_are_taken_at_their_time_not_at_the_input() -> None:
    """A torque equal to the time since the input was 0, at 5 rad/s."""
    model = arm(Torque(0, 1, lambda t, angle, speed: t))
    found = inverse_dynamics(model, simulate(ARM, [0.0, 5.0, 10.0]), speed=5.0)
    assert found.efforts.ravel() == pytest.approx([0.0, -1.0, -2.0], abs=1e-12)
    assert found.times.tolist() == [0.0, 1.0, 2.0] == found.reactions.times.tolist()
    back = inverse_dynamics(model, simulate(ARM, [0.0, -5.0, -10.0]), speed=np.full(3, -5.0))
    assert back.efforts.ravel() == pytest.approx([0.0, -1.0, -2.0], abs=1e-12)
    still = inverse_dynamics(model, simulate(ARM, [1.0, 2.0]), speed=0.0)
    assert still.efforts.ravel() == pytest.approx([0.0, 0.0], abs=1e-12)


def test_a_speed_that_varies_needs_the_times() -> None:
    """From rest at 2 rad/s^2: the input is t^2, the speed 2 t; torque and force are given over time."""
    t = np.array([0.0, 0.5, 1.0, 1.5])
    motion = simulate(ARM, t**2)
    model = arm(Torque(0, 1, Pulse(0.4, 0.8, 3.0)), Force(1, lambda t, place, speed: (0.0, t)))
    found = inverse_dynamics(model, motion, 2.0 * t, 2.0, times=t)
    assert found.efforts.ravel() == pytest.approx(0.1 * 2.0 - np.array([0.0, 3.0, 3.0, 0.0]), abs=1e-12)
    assert found.reactions.between(0, 1).on(1)[0][:, 1] == pytest.approx(-t, abs=1e-12)
    assert found.newton_euler < 1e-12
    for speed, acceleration in ((2.0 * t, 0.0), (2.0, 2.0)):
        with pytest.raises(GeometryError, match=r"the speed of the motion varies and loads are functions.*give times="):
            inverse_dynamics(model, motion, speed, acceleration)
    assert np.isnan(inverse_dynamics(arm(), motion, 2.0 * t, 2.0).times).all()  # nobody asks for them


def test_what_is_no_motion_or_has_another_shape_is_refused() -> None:
    model, motion = arm(), simulate(ARM, [0.0, 0.1, 0.2])
    with pytest.raises(GeometryError, match="motion is StartReport, not a Motion; give that of"):
        inverse_dynamics(model, consistent_start(model, keep={(0, 1): 0.0}))  # type: ignore[arg-type]
    with pytest.raises(GeometryError, match="model is NoneType, not a DynamicModel"):
        inverse_dynamics(None, motion)  # type: ignore[arg-type]
    for name in ("speed", "acceleration", "times"):
        with pytest.raises(GeometryError, match=rf"{name} has the shape \(2,\); give one number, or .* each of 3"):
            inverse_dynamics(model, motion, **{name: [1.0, 2.0]})
        with pytest.raises(GeometryError, match=f"{name} holds nan"):
            inverse_dynamics(model, motion, **{name: np.nan})


def test_friction_of_a_pin_in_a_slot() -> None:
    """A crank's pin drives a yoke: ``N (sin u - mu cos u)`` moves the yoke of 2 kg, the rest is the crank's torque."""
    pairs = [(0, 1), (1, 2, 2), (0, 2)]
    joints = [Revolute(0, 1), PinSlot(2, 1, at_b=(0.5, 0.0), angle_a=np.pi / 2), Prismatic(0, 2)]
    yoke = Mechanism(MechanismGraph(3, pairs, frame=0), joints, [Driver(0, 1)])
    bodies = {1: Body(0.0, 0.0), 2: Body(2.0, 0.0)}
    u, speed, mu = np.array([0.4, 1.0, 2.0, 2.5]), 3.0, 0.2
    friction = JointFriction(1, 2, mu, smoothing_velocity=1e-9)
    found = inverse_dynamics(DynamicModel(yoke, bodies, [friction], gravity=(0, 0)), simulate(yoke, u), speed)
    push = -2.0 * 0.5 * speed**2 * np.cos(u)  # the slot is square to the guide: the normal force moves the yoke alone
    rub = mu * np.abs(push) * np.sign(np.cos(u))  # against the pin's way in the slot
    assert found.efforts[:, 0] == pytest.approx(0.5 * (-push * np.sin(u) + rub * np.cos(u)), abs=1e-12)
    assert found.power_error < 1e-13
    with pytest.raises(GeometryError, match="pin in slot 1-2 needs smoothing_velocity"):
        DynamicModel(yoke, bodies, [JointFriction(1, 2, mu)])
