"""Dry friction in the joints of any mechanism: rest, jamming, redundant guides, the tribometer as a general model."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = ["jamming", "rest", "tribometer"]


def _slide(elements: list[Any], gravity: tuple[float, float], **options: Any) -> Any:
    from graphsynth.dynamics.model import Body, DynamicModel
    from graphsynth.mechanism.joints import Prismatic
    from graphsynth.mechanism.model import Driver, Mechanism
    from graphsynth.structure.graph import MechanismGraph

    centre = options.pop("centre", (0.0, 0.0))
    mechanism = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), (Prismatic(0, 1),), (Driver(0, 1),))
    return DynamicModel(mechanism, {1: Body(1.0, 0.01, centre)}, tuple(elements), gravity, **options)


def rest(check: Checks) -> None:
    """Block on an incline beside its friction angle by 1e-3 to 1e-9: at rest for 1e9 s exactly, or sliding."""
    from graphsynth.dynamics.elements import JointFriction
    from graphsynth.dynamics.integrate import simulate_dynamics

    mu = 0.3
    for beside in (-1e-3, -1e-6, -1e-9, 1e-3, 1e-6, 1e-9):
        angle = math.atan(mu) + beside
        model = _slide([JointFriction(0, 1, mu)], (-9.81 * math.sin(angle), -9.81 * math.cos(angle)))
        motion = simulate_dynamics(model, [0.0, 1e9] if beside < 0.0 else [0.0, 1.0], keep={(0, 1): 0.0})
        place = float(motion.poses[-1, 1, 0])
        if beside < 0.0:
            check.value(f"{beside:g} rad: place after 1e9 s", place, "0", absolute=0.0)
            check.equals(f"{beside:g} rad: events", len(motion.events), 0)
        else:  # sin(atan mu + d) - mu cos(atan mu + d) = sqrt(1 + mu^2) sin d
            way = -0.5 * 9.81 * math.sqrt(1.0 + mu * mu) * math.sin(beside)
            check.value(
                f"{beside:g} rad: place after 1 s", place, way, absolute=3e-15, relative=1e-10, source="closed form"
            )


def jamming(check: Checks) -> None:
    """Shoe with a lever, loads returning with 0.5 to 1e6: the only motion, both, or none; a second guide is refused."""
    from graphsynth.dynamics.elements import Force, JointFriction
    from graphsynth.dynamics.start import consistent_start
    from graphsynth.mechanism.joints import Prismatic

    for push in (1.0, -1.0):
        for r in (0.5, 0.9, 1.0 - 1e-6, 1.0 + 1e-6, 2.0, 1e6):
            elements = [JointFriction(0, 1, 0.3, length=0.1), Force(1, (push, 0.0))]
            model = _slide(elements, (0.0, 0.0), centre=(0.0, r * 0.1 / 0.6))
            start = consistent_start(model, keep={(0, 1): 0.0}, keep_rates={(0, 1): 1.0})
            what = f"force {push:g} N, factor {r:.7g}"
            if r < 1.0:
                exact = push / (1.0 + push * r)
                check.value(
                    f"{what}: acceleration", start.accelerations[1, 0], exact, relative=1e-9, source="closed form"
                )
                continue
            check.says(f"{what}: status", start.status, f"friction: {'several' if push > 0.0 else 'none'}")
            check.mentions(f"{what}: sentence", start.message, "P 0-1", "reduce the friction coefficient")
    for at in (0.02, 0.2, 2.0):
        model = _slide([JointFriction(0, 1, 0.3)], (0.0, -9.81), additional=[Prismatic(0, 1, (0.0, 0.0), (at, 0.0))])
        start = consistent_start(model, keep={(0, 1): 0.0}, keep_rates={(0, 1): 1.0})
        check.says(f"second guide at {at:g} m: status", start.status, "friction: undetermined")
        check.mentions(f"second guide at {at:g} m: sentence", start.message, "P 0-1", "additional 1: P 0-1")


def tribometer(check: Checks) -> None:
    """Tribometer B as a general model of two guides, a spring and a law of motion: the printed events and end."""
    from graphsynth.dynamics.integrate import simulate_dynamics
    from graphsynth.evidence.stress.cases.stick_slip import EVENTS, harmonic
    from graphsynth.systems.tribometer.general_model import general_model

    model, start = general_model(harmonic())
    motion = simulate_dynamics(model, [0.0, 10.0], start=start)
    check.equals("events", len(motion.events), 37, source="section 3.8")
    for k, (t, state, _) in EVENTS.items():
        check.equals(f"event {k + 1}: kind", motion.events[k].kind, "slip" if state else "stick", source="section 3.8")
        check.value(f"event {k + 1}: time", motion.events[k].time, t, absolute=1e-10, source="section 3.8")
    x, v = "-0.0088337024489276769888214220566", "0.0595451435333351571993796554312"
    check.value("x2(10)", motion.poses[-1, 2, 0], x, absolute=1e-11, source="section 3.8")
    check.value("v2(10)", motion.velocities[-1, 2, 0], v, absolute=1e-10, source="section 3.8")
    check.below("energy", motion.checks.energy, 1e-11)
    assert motion.friction is not None
    check.agrees("friction within its cone", bool((np.abs(motion.friction.force) <= 0.40 * 9.81 + 1e-12).all()))
