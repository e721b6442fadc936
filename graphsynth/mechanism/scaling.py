"""A mechanism in another unit of length, or of another size."""

from __future__ import annotations

import math
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
    from graphsynth.mechanism.model import TracePoint

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
    drivers = tuple(map(driver, mechanism.drivers))
    return replace(mechanism, joints=joints, drivers=drivers, points=points, pose=pose)


def rounded(mechanism: Mechanism, digits: int = 14) -> Mechanism:
    """Return the mechanism with numbers rounded to so many digits of its largest place: no noise, no change else.

    >>> from graphsynth.mechanism.model import Mechanism
    >>> rounded(Mechanism.four_bar(2.0000000000000004, 1, 2.5, 2.5)).joint(0, 3).at_a
    (2.0, 0.0)
    """
    from graphsynth.mechanism.model import TracePoint

    places = [value for joint in mechanism.joints for at in (joint.at_a, joint.at_b) for value in at]
    size = max(map(abs, [*places, *(value for own in mechanism.points.values() for value in own.at)]), default=0.0)
    of_lengths = digits - math.ceil(math.log10(size)) if size > 0.0 else digits

    def lengths(values: tuple[float, ...]) -> Any:
        return tuple(round(value, of_lengths) + 0.0 for value in values)

    joints = []
    for joint in mechanism.joints:
        more = {name: round(value, digits) + 0.0 for name, value in vars(joint).items() if name.startswith("angle")}
        joints.append(replace(joint, at_a=lengths(joint.at_a), at_b=lengths(joint.at_b), **more))
    points = {name: TracePoint(own.link, lengths(own.at)) for name, own in mechanism.points.items()}
    pose = mechanism.pose and tuple((*lengths((x, y)), round(a, digits) + 0.0) for x, y, a in mechanism.pose)
    return replace(mechanism, joints=tuple(joints), points=points, pose=pose)


def _joint(joint: JointGeometry, factor: float) -> JointGeometry:
    """Points, radii and harmonics are lengths; directions, offsets of gears and numbers of links are not."""
    lengths: dict[str, Any] = {name: value * factor for name, value in vars(joint).items() if name.startswith("radius")}
    if isinstance(joint, Cam):
        lengths["harmonics"] = tuple(_times(pair, factor) for pair in joint.harmonics)
    return replace(joint, at_a=_times(joint.at_a, factor), at_b=_times(joint.at_b, factor), **lengths)


def _times(point: Point, factor: float) -> Point:
    return point[0] * factor, point[1] * factor
