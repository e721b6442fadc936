"""Beyond the specification: huge loads, stiff motors, long times, laws that break, budgets of steps."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from graphsynth.evidence.stress.cases.linkages import wheel

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = ["broken_laws", "budget", "stiff_motor", "wheels"]


def wheels(check: Checks) -> None:
    """One wheel: torques of 1e-300 to 1e18 N m, inertias of 1e-200 to 1e200, times of 1e-9 to 1e9 s; closed form."""
    from graphsynth.dynamics import Body, DynamicModel, Torque, simulate_dynamics

    for inertia, torque, time in (
        (1.0, 1e18, 1.0), (1.0, 1e-300, 1.0), (1e-12, 1.0, 1.0), (1e200, 1.0, 1.0), (1e-200, 1e-200, 1.0),
        (1.0, 1.0, 1e9), (1.0, 1.0, 1e-9),
    ):  # fmt: skip
        model = DynamicModel(wheel(), {1: Body(1.0, inertia)}, [Torque(0, 1, torque)], (0.0, 0.0))
        for form in ("one-coordinate", "augmented"):
            motion = simulate_dynamics(model, [0.0, time], keep={(0, 1): 0.0}, form=form)
            what = f"J = {inertia:g}, M = {torque:g}, {time:g} s, {form}"
            speed = torque / inertia * time
            check.value(f"{what}: speed", motion.velocities[-1, 1, 2], speed, relative=1e-10, source="M t / J")
            angle = 0.5 * speed * time
            check.value(f"{what}: angle", motion.poses[-1, 1, 2], angle, relative=1e-10, source="M t^2 / 2 J")


def stiff_motor(check: Checks) -> None:
    """Motors with electrical times of 1e-4 to 1e-15 s over 1e3 s, without platform: speed and current at the end."""
    from graphsynth.dynamics.motors import DCMotor
    from graphsynth.systems.platform.motor_model import MotorDrivenPlatform

    times = [0.0, 1.0, 1000.0]
    for inductance, resistance in ((1e-4, 1.0), (1e-9, 1.0), (1e-9, 1e3), (1e-12, 1e3)):
        motor = DCMotor(resistance, inductance, 0.1, 0.1, 20.0, 20.0)
        found = MotorDrivenPlatform.source(motor, mass=0.0).simulate(times, rtol=1e-10, reduce=False)
        what = f"L / r = {inductance / resistance:.0e} s"
        # J w' = K_m I and L I' = K (w_d - w) - c_e w - r I: after the transient w = K w_d / (K + c_e), I = 0
        rate = 0.1 * 20.1 / (0.002 * resistance)
        right = 400.0 / 20.1 * (1.0 - math.exp(-rate))
        check.value(f"{what}: speed after 1 s", found.speed[1], right, relative=1e-4, source="limit of 14.10")
        if rate > 1.0:
            check.value(
                f"{what}: speed at the end", found.speed[2], 400.0 / 20.1, relative=1e-8, source="rest of 14.10"
            )
            check.below(f"{what}: current at the end", abs(found.currents[2, 0]), 1e-6, source="no load")
        check.agrees(f"{what}: complete", found.complete)


def broken_laws(check: Checks) -> None:
    """Torques that become NaN or infinite, times that are none: refused in one sentence, by either formulation."""
    from graphsynth.dynamics import Torque, simulate_dynamics
    from graphsynth.evidence.stress.cases.bodies import _g1

    at = {"keep": {(0, 1): 0.0}, "modes": {0: 1}}
    for bad in (math.nan, math.inf, -math.inf):
        model = _g1(elements=[Torque(0, 1, lambda t, angle, speed, bad=bad: bad if t > 0.1 else 0.1)])
        for form in ("one-coordinate", "augmented"):
            run = partial(simulate_dynamics, model, [0.0, 0.2], form=form, **at)
            check.refused(f"{bad} after 0.1 s, {form}", run, f"gave {bad}", "finite number")
    for name, given in (("NaN", math.nan), ("infinity", math.inf)):
        check.refused(f"times with {name}", partial(simulate_dynamics, _g1(), [0.0, given], **at), "times")
    check.refused("times that fall", lambda: simulate_dynamics(_g1(), [1.0, 0.0], **at), "times")


def budget(check: Checks) -> None:
    """Crank-rocker under 1e9 N m: thousands of turns a second; the steps run out, and that is said."""
    from graphsynth.dynamics import Torque, simulate_dynamics
    from graphsynth.evidence.stress.cases.bodies import _g1

    model, times = _g1(elements=[Torque(0, 1, 1e9)]), [0.0, 1e-5, 0.01]
    for form in ("one-coordinate", "augmented"):
        motion = simulate_dynamics(model, times, keep={(0, 1): 0.0}, modes={0: 1}, form=form, max_steps=300)
        check.says(f"{form}: status", motion.status, "failed")
        check.mentions(f"{form}: sentence", motion.message, "300 steps")
        check.agrees(f"{form}: nothing at the end", bool(np.isnan(motion.poses[-1, 1:]).all()))
    check.refused(
        "no steps at all", lambda: simulate_dynamics(model, times, keep={(0, 1): 0.0}, max_steps=0), "max_steps"
    )
