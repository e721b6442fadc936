"""Bearings and loads of any planar mechanism: coupled jamming, torque for a constant speed, start-up with a motor."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from graphsynth.pipeline.planar.stages import Moved
from graphsynth.pipeline.planar.system import BearingsTable, LoadsTable, MotorTable
from graphsynth.pipeline.products import Quantity, Rejected
from graphsynth.pipeline.stages import Context

if TYPE_CHECKING:
    from graphsynth.dynamics.model import Body, DynamicModel
    from graphsynth.jamming.joints.limits import JointLimits, Misalignment
    from graphsynth.mechanism.model import Mechanism

__all__ = ["Driven", "Jammed", "dynamics", "jamming", "model_of"]

_PIECES = 20_000
_SAMPLES = 401


@dataclass(frozen=True, slots=True)
class Jammed:
    """What the bearings do."""

    words: str
    good: bool | None
    margins: tuple[Quantity, ...]
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Driven:
    """What the loads need."""

    words: str
    good: bool | None
    margins: tuple[Quantity, ...]
    reason: str = ""


def jamming(context: Context, moved: Moved) -> Jammed:
    """Judge all bearings together when the driven axis is tilted; proved if ``certify`` is true.

    Raises
    ------
    Rejected
        If they jam (or, with ``certify``, are not proved free) and ``must_be_free`` is true.
    """
    from graphsynth.jamming.joints import assess_coupled, certify_coupled
    from graphsynth.jamming.verdict import Verdict

    table: BearingsTable = context.scene.mechanism.bearings
    limits, tilt = _limits(table), _tilt(table, moved.motion.mechanism)
    report = assess_coupled(moved.motion, limits, tilt, condition=table.condition)
    verdict, reason = report.verdict, report.reason
    if table.certify:
        proof = certify_coupled(
            moved.motion,
            limits,
            tilt,
            condition=table.condition,
            length_tolerance=table.length_tolerance,
            max_pieces=context.scene.budget.boxes or _PIECES,
            seconds=math.inf,
        )
        verdict, reason = proof.verdict, proof.reason
    good = True if verdict.is_free else False if verdict.is_jammed else None
    if table.must_be_free and not good:
        raise Rejected("the bearings jam" if good is False else "the bearings are not proved free", reason)
    margins = (
        Quantity("use of the clearances", report.worst_factor),
        Quantity.of_si("tilt allowed", table.alpha * report.smallest_scale, "deg"),
        Quantity.of_si("worst input", report.worst_input, "deg"),
    )
    return Jammed(f"bearings: {verdict.value}", good, margins, reason if verdict is Verdict.UNDECIDED else "")


def _limits(table: BearingsTable) -> JointLimits:
    from graphsynth.jamming.bearing.bearing import Bearing
    from graphsynth.jamming.joints import bearing_limits

    bearing = Bearing(table.radius_mm, table.height_mm, table.clearance_mm)
    found: JointLimits = bearing_limits(bearing, table.condition, clearance_tolerance=table.clearance_tolerance_mm)
    return found


def _tilt(table: BearingsTable, mechanism: Mechanism) -> Misalignment:
    from graphsynth.jamming.joints.limits import Misalignment

    driver = mechanism.drivers[0]
    alpha, spread = table.alpha, table.alpha_tolerance
    return Misalignment(
        driver.base,
        driver.link,
        alpha,
        table.direction,
        alpha_range=(max(alpha - spread, 0.0), alpha + spread) if spread else None,
        direction_range=(0.0, math.tau) if table.any_direction else None,
    )


def dynamics(context: Context, moved: Moved) -> Driven:
    """Find the torque of a constant speed; with a motor, also start from rest."""
    import numpy as np

    from graphsynth.dynamics.inverse import inverse_dynamics

    table: LoadsTable = context.scene.mechanism.loads
    model = model_of(table, moved.motion.mechanism)
    needed = inverse_dynamics(model, moved.motion, table.speed)
    torque = needed.efforts[:, 0]
    u = moved.motion.inputs
    mean = float(np.trapezoid(torque, u) / (u[-1] - u[0]))
    forces = [needed.reactions.between(*joint.pair).force for joint in model.mechanism.joints]
    margins = (
        Quantity("largest torque", float(np.abs(torque).max()), "N m"),
        Quantity("mean torque", mean, "N m"),
        Quantity("largest reaction", float(np.linalg.norm(forces, axis=-1).max()), "N"),
    )
    if table.motor is None:
        return Driven("", None, margins)
    words, good, more, reason = _start_up(table, table.motor, moved)
    return Driven(words, good, (*margins, *more), reason)


def model_of(table: LoadsTable, mechanism: Mechanism, elements: tuple[Any, ...] = ()) -> DynamicModel:
    """Return the mechanism with its masses and the force on its first named point."""
    from graphsynth.dynamics.elements import Force
    from graphsynth.dynamics.model import DynamicModel

    bodies = {link: _body(table, mechanism, link) for link in range(mechanism.graph.links) if link != mechanism.frame}
    if any(table.force) and mechanism.points:
        point = next(iter(mechanism.points.values()))
        elements = (*elements, Force(point.link, table.force, point.at))
    return DynamicModel(mechanism, bodies, elements, table.gravity)


def _body(table: LoadsTable, mechanism: Mechanism, link: int) -> Body:
    """Uniform bars from the first joint of a link to its others and to its named points."""
    from graphsynth.dynamics.model import Body

    at = [j.at_a if j.a == link else j.at_b for j in mechanism.joints if link in j.pair]
    at += [point.at for point in mechanism.points.values() if point.link == link]
    bars = [Body.bar(table.bar_kg_per_m * math.dist(at[0], end), at[0], end) for end in at[1:] if end != at[0]]
    if not bars:  # a block: as heavy as a bar of a hundredth of a metre
        return Body(0.01 * table.bar_kg_per_m, 1e-6 * table.bar_kg_per_m, at[0])
    return Body.combined(*bars)


def _start_up(table: LoadsTable, motor: MotorTable, moved: Moved) -> tuple[str, bool, tuple[Quantity, ...], str]:
    """Start from rest with the motor; a run that does not reach the end is reported as such."""
    import numpy as np

    from graphsynth.dynamics.elements import TorqueSource
    from graphsynth.dynamics.integrate import simulate_dynamics

    mechanism = moved.motion.mechanism
    driver = mechanism.drivers[0]
    slope = motor.stall / motor.no_load
    angle = moved.motion.poses[:2, driver.link, 2] - moved.motion.poses[:2, driver.base, 2]
    sense = math.copysign(1.0, angle[1] - angle[0])  # in which the input grows

    def torque(t: float, angle: float, speed: float) -> float:
        return sense * motor.stall - slope * speed

    source = TorqueSource(driver.base, driver.link, torque, rotor_inertia=motor.inertia)
    run = simulate_dynamics(
        model_of(table, mechanism, (source,)),
        np.linspace(0.0, motor.end, _SAMPLES),
        pose=moved.motion.poses[0],
        rtol=1e-7,
        atol=1e-9,
    )
    if not run.completed:
        return f"start-up stops at {run.reached:.3g} s", False, (), run.message
    _, speed = run.coordinate(driver.base, driver.link)
    late = speed[_SAMPLES // 2 :]
    mean = float(late.mean())
    margins = (
        Quantity("mean speed with the motor", sense * mean, "rad/s"),
        Quantity("ripple of the speed", float(np.ptp(late)) / abs(mean) if mean else math.inf),
    )
    turns = sense * mean > 0.0 and float(np.min(sense * late)) > 0.0
    return ("the motor turns it" if turns else "the motor does not keep it turning"), turns, margins, ""
