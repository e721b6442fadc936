"""Sizes of dynamic models at the ends of double precision: right, failed with a reason, or refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError, SpecError
from graphsynth.dynamics import Body, DynamicModel, Torque, simulate_dynamics
from graphsynth.dynamics.motors import DCMotor, SynchronousMotor, Train
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.systems.braider import FourBar
from graphsynth.systems.braider.model import Braider, Thread
from graphsynth.systems.piston.loads import CompressorCycle, ConstantForce, PistonFriction, PistonMasses
from graphsynth.systems.piston.model import CrankSlider, FloatingGroup, ScotchYoke
from graphsynth.systems.tribometer.model import Tribometer
from graphsynth.systems.tribometer.platforms import BeltDrive, CrankDrive, HarmonicDrive, StribeckLaw, TwoCoefficientLaw

HUGE: dict[str, Any] = {
    "Braider": lambda x: Braider(switch=x), "Braider masses": lambda x: Braider(masses=(x, 1.0, 1.0, 1.0)),
    "Thread": lambda x: Thread(weight=x), "guide": lambda x: Thread(guide=x * 1j),
    "StribeckLaw": lambda x: StribeckLaw(0.4, 0.2, x), "TwoCoefficientLaw": lambda x: TwoCoefficientLaw(x, 0.2),
    "DCMotor": lambda x: DCMotor(1.0, x, 0.1, 0.1, 20.0, 20.0),
    "SynchronousMotor": lambda x: SynchronousMotor(2, 1.0, 1.0, x, 0.0, 1.0),
    "CompressorCycle": lambda x: CompressorCycle(x, 1e5, 2e5), "ConstantForce": lambda x: ConstantForce(-x),
    "PistonFriction": lambda x: PistonFriction(rings=x), "PistonMasses": lambda x: PistonMasses(crank=x),
    "Train": lambda x: Train(inertia=x), "Tribometer": lambda x: Tribometer(mass=x),
    "Tribometer x2": lambda x: Tribometer(x2=-x), "BeltDrive": lambda x: BeltDrive(-x),
    "CrankDrive": lambda x: CrankDrive(0.5 * x, x, 1.0), "HarmonicDrive": lambda x: HarmonicDrive(x, 1.0),
    "FourBar": lambda x: FourBar(x, x, x, x), "CrankSlider": lambda x: CrankSlider(0.1 * x, x),
    "ScotchYoke": lambda x: ScotchYoke(x), "FloatingGroup": lambda x: FloatingGroup(cylinder_offset=x),
}  # fmt: skip
TINY = ("StribeckLaw", "CompressorCycle", "Tribometer", "CrankDrive", "HarmonicDrive", "FourBar", "CrankSlider",
        "ScotchYoke", "TwoCoefficientLaw")  # fmt: skip


@pytest.mark.parametrize("name", HUGE)
@pytest.mark.parametrize("size", [1e61, 1e155, 1e300])
def test_huge_sizes_are_refused(name: str, size: float) -> None:
    with pytest.raises((GeometryError, SpecError), match="change the unit"):
        HUGE[name](size)


@pytest.mark.parametrize("name", TINY)
@pytest.mark.parametrize("size", [1e-61, 1e-160, 1e-300])
def test_tiny_sizes_that_set_a_scale_are_refused(name: str, size: float) -> None:
    with pytest.raises((GeometryError, SpecError), match=r"change the unit|swap"):
        HUGE[name](size)


@pytest.mark.parametrize("unit", [2.0**-190, 2.0**190])
def test_four_bar_of_the_braider_in_any_unit(unit: float) -> None:
    theta = np.linspace(0.0, 6.2, 13)
    one, own = FourBar().motion(theta), FourBar(0.02 * unit, 0.06 * unit, 0.04 * unit, 0.06 * unit).motion(theta)
    for name in ("phi2", "phi3", "k2", "k3", "f2", "f3"):
        np.testing.assert_array_equal(getattr(own, name), getattr(one, name))


@pytest.mark.parametrize("form", ["one-coordinate", "augmented"])
@pytest.mark.parametrize("torque", [5e19, 1.2e20, 1e21, 1e100])
def test_angles_that_no_integer_counts_in_turns(form: str, torque: float) -> None:
    """``M t^2 / (2 J)``; with 64-bit turns the angle wrapped round from 5.8e19 rad on."""
    graph = MechanismGraph(2, [(0, 1)], frame=0)
    model = DynamicModel(
        Mechanism(graph, [Revolute(0, 1)], [Driver(0, 1)]), {1: Body(1.0, 1.0)}, [Torque(0, 1, torque)], (0.0, 0.0)
    )
    for sign in (1.0, -1.0) if torque == 1e21 else (1.0,):
        turned = DynamicModel(model.mechanism, model.bodies, [Torque(0, 1, sign * torque)], (0.0, 0.0))
        motion = simulate_dynamics(turned, [0.0, 1.0], keep={(0, 1): 0.0}, form=form)  # type: ignore[arg-type]
        assert motion.completed
        assert math.isclose(motion.poses[-1, 1, 2], sign * 0.5 * torque, rel_tol=1e-10)
