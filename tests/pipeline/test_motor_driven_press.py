"""The shipped press with a motor, against the energy of a slider-crank in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from graphsynth.pipeline.runner import execute
from graphsynth.pipeline.scene import load_scene

CRANK, PER_METRE, SPEED, FORCE = 0.04, 2.0, 2.0 * math.pi, -200.0
BLOCK = 0.01 * PER_METRE  # kg, the ram


def largest_torque(rod: float) -> float:
    """Torque at the crank at constant speed: rate of the energy of uniform bars less the power of the force."""
    f = np.linspace(0.0, 2.0 * math.pi, 20_001)
    x, y = CRANK * np.cos(f), CRANK * np.sin(f)
    slope = np.arcsin(-y / rod)
    slope_f = -x / (rod * np.cos(slope))
    ram_f = -y - rod * np.sin(slope) * slope_f
    mass = PER_METRE * rod
    middle_f = np.hypot(0.5 * (ram_f - y), 0.5 * x)
    inertia = mass * (middle_f**2 + rod**2 / 12.0 * slope_f**2) + BLOCK * ram_f**2
    height = 9.81 * (PER_METRE * CRANK + mass) * 0.5 * y
    energy = 0.5 * inertia * SPEED**2 + height
    return float(np.abs(np.gradient(energy, f) - FORCE * ram_f).max())


@pytest.mark.long
def test_motor_driven_press() -> None:
    report = execute(load_scene("motor_driven_press"))
    for record, rod in zip(report["records"], (0.08, 0.2), strict=True):
        found = {margin.name: margin.value for margin in record.margins}
        assert record.good and "the motor keeps it turning" in record.verdict
        assert found["largest torque"] == pytest.approx(largest_torque(rod), rel=2e-3)
        # neither force nor weight does work over a rotation: nearly the speed at which the motor has no torque
        idle = 0.5 / (0.5 + 0.05) * 40.0 * math.pi / 20.0
        assert found["mean speed with the motor"] == pytest.approx(idle, rel=0.03)
    assert report["ranking"].numbers == (2, 1)  # the long rod runs more evenly
    assert len(report["animations"]) == len(report["mechanism_pictures"]) == 2
