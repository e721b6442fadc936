"""What every export shares: refusals, carriers of gear pairs, constant torques."""

from __future__ import annotations

import math
from typing import Any

from graphsynth.core.errors import GeometryError
from graphsynth.dynamics.elements import Torque, TorqueSource
from graphsynth.dynamics.model import DynamicModel
from graphsynth.dynamics.start import StartReport, check_start
from graphsynth.mechanism.joints import Gear, Revolute

Point = tuple[float, float]


def check_common(model: DynamicModel, start: StartReport, engine: str) -> None:
    """Refuse what no engine here can run."""
    if isinstance(start, StartReport) and not start.consistent:
        raise GeometryError(f"the start is not consistent, so {engine} would run another mechanism: {start.message}")
    check_start(model, start)
    if model.massless:
        raise GeometryError(f"links {list(model.massless)} have no mass or inertia; {engine} needs both positive")


def check_settings(settings: Any, kind: type) -> None:
    """Refuse settings of another engine."""
    if not isinstance(settings, kind):
        raise GeometryError(f"settings are {type(settings).__name__}, not {kind.__name__}; give these, or none")


def carrier_of(model: DynamicModel, gear: Gear) -> int:
    """Return the link that carries both wheels of a gear pair."""
    for link in range(model.mechanism.graph.links):
        if link in (gear.a, gear.b):
            continue
        if _bears(model, link, gear.a, gear.at_a) and _bears(model, link, gear.b, gear.at_b):
            return link
    raise GeometryError(f"gear pair {gear.a}-{gear.b} has no link that bears both wheels at their centres; give one")


def _bears(model: DynamicModel, link: int, wheel: int, centre: Point) -> bool:
    """Whether the centre of a wheel is fixed in a link: turning pairs of both, at one point of one link."""
    for middle, spot in [(wheel, centre), *_hinges(model, wheel, centre)]:
        if middle == link or any(other == link for other, _ in _hinges(model, middle, spot)):
            return True
    return False


def _hinges(model: DynamicModel, link: int, at: Point) -> list[tuple[int, Point]]:
    """Links that turn on a link at the given point of it, and the point in them."""
    found = []
    for joint in model.mechanism.joints:
        if isinstance(joint, Revolute) and link in (joint.a, joint.b):
            own, other = (joint.at_a, joint.at_b) if joint.a == link else (joint.at_b, joint.at_a)
            if math.dist(own, at) <= 1e-12 * max(1.0, math.hypot(*at)):
                found.append((joint.b if joint.a == link else joint.a, other))
    return found


def gear_weights(model: DynamicModel, gear: Gear) -> dict[int, float]:
    """Weights of the link angles whose sum a gear pair keeps constant."""
    carrier, sign = carrier_of(model, gear), -1.0 if gear.internal else 1.0
    weights = {gear.a: gear.radius_a, gear.b: sign * gear.radius_b}
    weights[carrier] = weights.get(carrier, 0.0) - gear.radius_a - sign * gear.radius_b
    largest = max(gear.radius_a, gear.radius_b)
    return {link: w / largest for link, w in weights.items()}


def constant_torque(element: Torque | TorqueSource) -> tuple[float, float]:
    """Return torque and viscous damping of an element on its link b."""
    torque, pair = element.torque, f"{element.a}-{element.b}"
    if callable(torque):
        raise GeometryError(f"torque {pair} is a function; an exported one must be constant")
    if isinstance(element, Torque):
        return torque, 0.0
    if element.efficiency != 1.0 and torque != 0.0:
        raise GeometryError(
            f"efficiency = {element.efficiency} of torque source {pair} depends on the flow of power; an exported "
            "train must have efficiency 1"
        )
    return torque * element.ratio, element.ratio**2 * element.rotor_damping
