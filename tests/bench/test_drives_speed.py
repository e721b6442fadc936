"""How fast the drives are; ``docs/explanation/motors-and-drives.md`` holds what was measured.

Run by the normal suite once each, without timing; with times: ``pytest tests/bench/test_drives_speed.py
--benchmark-enable -n0``. No time is asserted: machines differ.  Every benchmark checks its result against the
specification, and the scipy rows integrate the same equations at about the same error.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from graphsynth.dynamics.motors import DCMotor
from graphsynth.systems.braider.model import Braider
from graphsynth.systems.braider.reactions import reactions
from graphsynth.systems.platform.motor_model import MotorDrivenPlatform

STIFF = replace(Braider(), motor=replace(Braider().motor, inductance=1e-6))
PLATFORM = MotorDrivenPlatform.source(DCMotor(1.0, 0.2, 0.1, 0.1, gain=20.0, speed=20.0))


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """Compile, or load from the cache, everything that is timed."""
    STIFF.simulate([0.0, 0.001])


def repeat(benchmark, function):
    return benchmark.pedantic(function, rounds=5, warmup_rounds=1)


@pytest.mark.parametrize("rtol", [1e-6, 1e-10])
def test_braider_start_up_with_stiff_motor(benchmark, rtol):
    times = np.linspace(0.0, 0.5, 101)
    found = repeat(benchmark, lambda: STIFF.simulate(times, reduce=False, rtol=rtol))
    assert found.complete and found.speed[-1] == pytest.approx(1.80292647578758, rel=1e-9)


def test_braider_start_up_with_scipy(benchmark):
    """LSODA of scipy on the same equations in Python."""
    from scipy.integrate import solve_ivp

    plant, motor, ratio = STIFF.plant(), STIFF.motor, STIFF.train.ratio
    assert plant.linkage is not None

    def rhs(_t, y):
        theta, w, d, q = y
        shaft = motor.pole_pairs * ratio * w
        torque = 1.5 * motor.pole_pairs * motor.flux * q
        return [
            w, float(STIFF.acceleration(theta, w, torque)),
            (motor.ud - motor.resistance * d + shaft * motor.inductance * q) / motor.inductance,
            (motor.uq - motor.resistance * q - shaft * (motor.inductance * d + motor.flux)) / motor.inductance,
        ]  # fmt: skip

    done = repeat(benchmark, lambda: solve_ivp(rhs, (0.0, 0.5), np.zeros(4), method="LSODA", rtol=1e-8, atol=1e-10))
    assert done.success and done.y[1, -1] == pytest.approx(1.80292647578758, rel=1e-7)


def test_platform_one_second(benchmark):
    found = repeat(benchmark, lambda: PLATFORM.simulate([0.0, 1.0], rtol=1e-10))
    assert found.speed[-1] == pytest.approx(26.757075249208202, rel=1e-11)


def test_platform_without_inertia(benchmark):
    motor = DCMotor(10.0, 1.0, 0.1, 0.1, gain=20.0, speed=20.0)
    drive = MotorDrivenPlatform.source(motor, base_inertia=0.0)
    found = repeat(benchmark, lambda: drive.simulate([0.0, 0.5], speed=1.0, rtol=1e-10))
    assert found.angle[-1] == pytest.approx(9.2851768505979327, rel=1e-12)


@pytest.mark.long
def test_reactions_of_a_turn(benchmark):
    theta = np.linspace(0.0, math.tau, 10_000)
    found = repeat(benchmark, lambda: reactions(Braider(), theta, 1.803, 0.0))
    assert found.power_error < 1e-13


OUTPUTS = np.linspace(0.0, 1.0, 101)
END = 26.757075249208202


def test_platform_with_outputs(benchmark):
    found = repeat(benchmark, lambda: PLATFORM.simulate(OUTPUTS, rtol=1e-8))
    assert found.speed[-1] == pytest.approx(END, rel=2e-11)


@pytest.mark.long
def test_platform_with_outputs_by_scipy(benchmark):
    """LSODA of scipy on the same equations and Jacobian, compiled, at about the same error."""
    from numba import njit
    from scipy.integrate import solve_ivp

    @njit
    def rhs(_t, y):
        q, w, current = y
        torque = 0.1 * current + 0.0025 * math.sin(2.0 * q) * w * w
        inertia = 0.002 + 0.005 * math.cos(q) ** 2
        return np.array([w, torque / inertia, (20.0 * (20.0 - w) - current - 0.1 * w) / 0.2])

    @njit
    def jacobian(_t, y):
        q, w, current = y
        torque = 0.1 * current + 0.0025 * math.sin(2.0 * q) * w * w
        inertia, slope = 0.002 + 0.005 * math.cos(q) ** 2, -0.005 * math.sin(2.0 * q)
        by_angle = 0.005 * math.cos(2.0 * q) * w * w / inertia - torque * slope / inertia**2
        by_speed = 0.005 * math.sin(2.0 * q) * w / inertia
        return np.array([[0.0, 1.0, 0.0], [by_angle, by_speed, 0.1 / inertia], [0.0, -20.1 / 0.2, -1.0 / 0.2]])

    options = {"method": "LSODA", "t_eval": OUTPUTS, "rtol": 1e-12, "atol": 1e-12, "jac": jacobian}
    done = repeat(benchmark, lambda: solve_ivp(rhs, (0.0, 1.0), np.zeros(3), **options))
    assert done.success and done.y[1, -1] == pytest.approx(END, rel=2e-11)
