"""Effective inertia of the real geometry: ranges of the specification, central differences, the energy of the sweep."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.core.errors import GeometryError, SpecError
from graphsynth.dynamics.driven.inertia import EffectiveInertia
from graphsynth.dynamics.motors import DCMotor
from graphsynth.systems.platform.motor_model import MotorDrivenPlatform, platform_inertia
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

LEGS = (-5 * math.pi / 6, -math.pi / 6, math.pi / 2)
LINEAR = SingleMotorPlatform(
    crank=(2.10617329135206268, 5.29647666822047662, 3.19030337686841394),
    phase=tuple(np.radians((-166.260204708311957406, 133.739795291688042594, 73.7397952916880425937))),
)
# theory/motor-drive 2: J_eff/m in mm^2 with a radius of gyration of 20 mm
RANGES = {
    "circular translation": (SingleMotorPlatform(), (38.955, 78.368, 58.602), 0),
    "pure rotation": (SingleMotorPlatform(phase=LEGS), (0.0, 12.604, 6.217), 2),
    "single crank": (SingleMotorPlatform(crank=(10, 0, 0)), (0.0, 28.167, 13.407), 2),
}


@pytest.mark.parametrize("name", RANGES)
def test_ranges_of_the_real_geometry(name):
    machine, expected, dead = RANGES[name]
    inertia = platform_inertia(machine, 1.0, 0.020)
    low, high, mean = (1e6 * x for x in inertia.range())
    assert low == pytest.approx(expected[0], abs=1.01e-3)
    assert (high, mean) == pytest.approx(expected[1:], abs=1.01e-3)
    assert len(inertia.dead_centres) == dead and inertia.truncation < 1e-13


def test_linear_design_almost_has_dead_points():
    inertia = platform_inertia(LINEAR, 1.0, 0.020)
    low, high, mean = (1e6 * x for x in inertia.range())
    assert (high, mean) == pytest.approx((16.102, 8.020), abs=1.01e-3)
    assert not inertia.dead_centres
    # two poses at which the platform almost stops; the printed minimum, about 2e-4, is the value on a coarse grid
    q = np.linspace(0.0, math.tau, 720, endpoint=False)
    values = inertia.value(q)
    found = []
    for k in np.nonzero((values < np.roll(values, 1)) & (values < np.roll(values, -1)) & (values < 1e-9))[0]:
        velocity = LINEAR.sweep(q[k] + np.linspace(-0.01, 0.01, 4001)).velocity
        found.append((velocity[:, 0] ** 2 + velocity[:, 1] ** 2 + (20.0 * velocity[:, 2]) ** 2).min())
    assert len(found) == 2 and low == pytest.approx(min(found), rel=1e-3)
    assert 0.0 < low < 1e-5


def test_value_and_derivative_against_the_sweep():
    machine = SingleMotorPlatform(crank=(10, 5, 0), phase=(0, 0.5, 1))
    centre, rockers = 0.003 - 0.002j, (1e-4, 2e-4, 3e-4)
    inertia = platform_inertia(machine, 1.7, 0.02, centre, rocker_inertia=rockers)
    q = np.sort(np.random.default_rng(3).uniform(0.0, math.tau, 40))
    sweep = machine.sweep(q)
    point = 1e-3 * (sweep.velocity[:, 0] + 1j * sweep.velocity[:, 1])
    point += 1j * np.exp(1j * sweep.pose[:, 2]) * centre * sweep.velocity[:, 2]
    direct = 1.7 * np.abs(point) ** 2 + 1.7 * 4e-4 * sweep.velocity[:, 2] ** 2 + sweep.theta_velocity**2 @ rockers
    np.testing.assert_allclose(inertia.value(q), direct, rtol=1e-11)
    h = 1e-5
    slope = (inertia.value(q + h) - inertia.value(q - h)) / (2 * h)
    np.testing.assert_allclose(inertia.derivative(q), slope, atol=1e-9 * inertia.value(q).max())


def test_reference_point_of_the_specification():
    """theory/values-of-the-platform 5: J_eff/m and half its derivative at psi = pi/2."""
    machine = SingleMotorPlatform(crank=(10, 5, 0), phase=(0, 0.5, 1))
    inertia = platform_inertia(machine, 1.0, 0.020)
    assert 1e6 * float(inertia.value(math.pi / 2)) == pytest.approx(25.677994605313476, rel=1e-13)
    assert 0.5e6 * float(inertia.derivative(math.pi / 2)) == pytest.approx(6.2006475694504331, rel=1e-12)


@pytest.mark.long
def test_real_geometry_with_and_without_rotor():
    motor = DCMotor(10.0, 1.0, 0.1, 0.1, 20.0, 20.0)
    times = [0.0, 0.2, 0.4]
    machine = SingleMotorPlatform(phase=LEGS)
    free = MotorDrivenPlatform.of_machine(machine, motor, mass=0.5, gyration=0.02)
    assert free.train.ratio == 2.0 and free.constant_inertia == 0.0
    source = free.simulate(times, angle=0.3, speed=1.0, rtol=1e-11)
    assert source.model.startswith("S") and source.complete and source.energy_error < 1e-12
    assert {event.kind for event in source.events} >= {"dead centre"}
    gaps = []
    for rotor in (1e-8, 1e-10, 1e-12):
        drive = replace(free, motor=replace(motor, rotor_inertia=rotor))
        found = drive.simulate(times, angle=0.3, speed=1.0, rtol=1e-10, estimate=False)
        assert found.model.startswith("J") and found.energy_error < 1e-11
        gaps.append(abs(found.angle[1] - source.angle[1]))
    assert gaps[0] > gaps[1] > gaps[2]


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.floats(-1.0, 1.0), min_size=5, max_size=5),
    st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3),
    st.floats(0.1, 2.0),
    st.floats(-3.0, 3.0),
)
def test_energy_is_balanced_for_any_series(first, second, base, angle):
    rows = np.zeros((2, 5))
    rows[0], rows[1, :3] = first, second
    motor = DCMotor(1.0, 0.1, 0.5, 0.5, 5.0, 10.0)
    drive = MotorDrivenPlatform(EffectiveInertia(rows), motor, base_inertia=base, load=0.1, friction=0.05)
    found = drive.simulate(np.linspace(0.0, 2.0, 9), angle=angle, rtol=1e-10, estimate=False)
    assert found.complete and found.energy_error < 1e-10 and found.electric_error < 1e-10


def test_samples_that_do_not_resolve_are_refused():
    q = np.linspace(0.0, math.tau, 16, endpoint=False)
    with pytest.raises(SpecError, match="give more samples"):
        EffectiveInertia.of_samples(np.exp(np.sin(3 * q)))
    good = EffectiveInertia.of_samples(2.0 * np.sin(q))
    assert good.dead_centres == pytest.approx((0.0, math.pi)) or good.dead_centres == pytest.approx((-math.pi, 0.0))
    with pytest.raises(GeometryError, match=r"branch ends|home branch"):
        platform_inertia(SingleMotorPlatform(crank=(31, 31, 31)), 1.0, 0.02)
    with pytest.raises(SpecError, match="mass = -1"):
        platform_inertia(SingleMotorPlatform(), -1.0, 0.02)
