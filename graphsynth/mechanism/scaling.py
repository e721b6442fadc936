"""A mechanism in another unit of length, or of another size."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from graphsynth.core.checks import Point, positive
from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.joints import Cam, Prismatic

if TYPE_CHECKING:
    from graphsynth.mechanism.joints import JointGeometry
    from graphsynth.mechanism.laws import Driver
    from graphsynth.mechanism.model import Mechanism


def scaled(mechanism: Mechanism, factor: float) -> Mechanism:
    """Return the mechanism with every length multiplied; see `Mechanism.scaled`."""
    from graphsynth.mechanism.model import Mechanism, TracePoint

    factor = positive("factor", factor)

    def driver(own: Driver) -> Driver:
        if not isinstance(mechanism.joint(*own.pair), Prismatic):
            return own
        if not hasattr(own.law, "times"):
            raise GeometryError(
                f"the law {own.law!r} of the sliding driver {own.base}-{own.link} cannot be scaled; use one of "
                "graphsynth.mechanism.laws, or give it a method times(factor)"
            )
        return replace(own, law=own.law.times(factor))

    points = {name: TracePoint(own.link, _times(own.at, factor)) for name, own in mechanism.points.items()}
    pose = mechanism.pose and tuple((*_times((x, y), factor), angle) for x, y, angle in mechanism.pose)
    joints = tuple(_joint(joint, factor) for joint in mechanism.joints)
    return Mechanism(mechanism.graph, joints, tuple(map(driver, mechanism.drivers)), points, pose)


def _joint(joint: JointGeometry, factor: float) -> JointGeometry:
    """Points, radii and harmonics are lengths; directions, offsets of gears and numbers of links are not."""
    lengths: dict[str, Any] = {name: value * factor for name, value in vars(joint).items() if name.startswith("radius")}
    if isinstance(joint, Cam):
        lengths["harmonics"] = tuple(_times(pair, factor) for pair in joint.harmonics)
    return replace(joint, at_a=_times(joint.at_a, factor), at_b=_times(joint.at_b, factor), **lengths)


def _times(point: Point, factor: float) -> Point:
    return point[0] * factor, point[1] * factor
