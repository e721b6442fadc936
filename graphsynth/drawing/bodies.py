"""What of a mechanism's links can be seen: attachment points, guides over their travel, wheels, and the room they take.

Points are complex numbers in the frame of their link; nothing here draws.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from graphsynth.mechanism.joints import Cam, Gear, JointGeometry, PinSlot, Prismatic
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Guide:
    """The line of a prismatic joint or the middle of a slot, from the first to the last place that is used."""

    joint: JointGeometry
    start: complex
    stop: complex
    direction: complex

    def nearest(self, point: complex) -> complex:
        """Return the point of the guide nearest to a point."""
        along = ((point - self.start) * self.direction.conjugate()).real
        length = ((self.stop - self.start) * self.direction.conjugate()).real
        return self.start + self.direction * min(max(along, 0.0), length)


@dataclass(slots=True)
class LinkBody:
    """One link: where other links or named points are attached, its guides, pitch circles and cams."""

    link: int
    points: list[complex] = field(default_factory=list)
    joints: int = 0  # different places of joints
    guides: list[Guide] = field(default_factory=list)
    wheels: list[tuple[complex, float, Gear]] = field(default_factory=list)
    cams: list[tuple[Cam, list[complex]]] = field(default_factory=list)

    def vertices(self) -> list[complex]:
        """Attachment points, and for each guide its point nearest to them."""
        found = list(self.points)
        for k, guide in enumerate(self.guides):
            other = self.guides[0 if k else -1]  # a link without points is joined at the middle of another guide
            middle = sum(self.points) / len(self.points) if self.points else (other.start + other.stop) / 2
            found.append(guide.nearest(middle))
        return found


def world(poses: Array, link: int, point: complex) -> Complex:
    """Carry a point of a link to the plane for every pose of ``poses`` (n, links, 3)."""
    pose = poses[:, link]
    return np.asarray(pose[:, 0] + 1j * pose[:, 1] + np.exp(1j * pose[:, 2]) * point)


def bodies(mechanism: Mechanism, poses: Array, reserve: float) -> list[LinkBody]:
    """Return what each link shows over the poses; guides are ``reserve`` longer at both ends than the travel."""
    found = [LinkBody(link) for link in range(mechanism.graph.links)]
    for joint in mechanism.joints:
        a, b = found[joint.a], found[joint.b]
        at_a, at_b = complex(*joint.at_a), complex(*joint.at_b)
        if isinstance(joint, Prismatic | PinSlot):
            t = complex(np.exp(1j * joint.angle_a))
            # least and largest displacement of at_b along the line of a
            turn = np.exp(-1j * (poses[:, joint.a, 2] + joint.angle_a))
            along = ((world(poses, joint.b, at_b) - world(poses, joint.a, at_a)) * turn).real
            least, most = float(along.min()), float(along.max())
            a.guides.append(Guide(joint, at_a + t * (least - reserve), at_a + t * (most + reserve), t))
            b.points.append(at_b)
        else:
            a.points.append(at_a)
            b.points.append(at_b)
        if isinstance(joint, Gear):
            a.wheels.append((at_a, joint.radius_a, joint))
            b.wheels.append((at_b, joint.radius_b, joint))
        if isinstance(joint, Cam):
            angles = [math.tau * k / 180 for k in range(180)]
            curve = [at_a + cmath.rect(joint.pitch_radius(psi)[0], joint.angle_a + psi) for psi in angles]
            a.cams.append((joint, curve))
    for body in found:  # a wheel on its pivot counts once
        body.joints = len(_apart(body.points, reserve / 9.0)) + len(body.guides)
    for point in mechanism.points.values():
        found[point.link].points.append(complex(*point.at))
    return found


def bounds(mechanism: Mechanism, poses: Array) -> tuple[complex, complex]:
    """Corners of the smallest box around everything that is drawn, over all poses; never without width or height."""
    every = []
    for body in bodies(mechanism, poses, 0.0):
        ends = [end for guide in body.guides for end in (guide.start, guide.stop)]
        rims = [point for _, curve in body.cams for point in curve[::6]]
        every += [world(poses, body.link, point) for point in (*body.points, *ends, *rims)]
        every += [
            world(poses, body.link, centre) + radius * d for centre, radius, _ in body.wheels for d in (1j, -1j, 1, -1)
        ]
    z = np.concatenate(every) if every else np.zeros(1, dtype=np.complex128)
    lower, upper = complex(z.real.min(), z.imag.min()), complex(z.real.max(), z.imag.max())
    size = upper - lower
    side = max(size.real, size.imag) or 1.0
    grow = complex(max(0.0, 0.3 * side - size.real), max(0.0, 0.25 * side - size.imag)) / 2
    return lower - grow, upper + grow


def hull(points: list[complex]) -> list[complex]:
    """Corners of the convex hull, anticlockwise (monotone chain [Andrew 1979]); fewer than three if in line."""
    ordered = sorted(set(points), key=lambda z: (z.real, z.imag))
    if len(ordered) < 3:
        return ordered

    def chain(sequence: list[complex]) -> list[complex]:
        kept: list[complex] = []
        for z in sequence:
            while len(kept) > 1 and ((kept[-1] - kept[-2]).conjugate() * (z - kept[-2])).imag <= 0.0:
                kept.pop()
            kept.append(z)
        return kept

    lower, upper = chain(ordered), chain(ordered[::-1])
    return [*lower[:-1], *upper[:-1]]


def outline(points: list[complex], merge: float) -> list[complex]:
    """Hull of points after those closer than ``merge`` to an earlier one are left out; two ends if nearly in line."""
    corners = hull(_apart(points, merge))
    if len(corners) < 3:
        return corners
    far, p, q = max(((abs(p - q), p, q) for p in corners for q in corners), key=lambda found: found[0])
    t = (q - p) / far
    width = [((z - p) * t.conjugate()).imag for z in corners]
    return corners if max(width) - min(width) > merge else [p, q]


def _apart(points: list[complex], merge: float) -> list[complex]:
    """Leave out points closer than ``merge`` to an earlier one."""
    kept: list[complex] = []
    for point in points:
        if all(abs(point - other) > merge for other in kept):
            kept.append(point)
    return kept


def thickness(corners: list[complex]) -> float:
    """Least width of a convex polygon; 0 for two corners."""
    if len(corners) < 3:
        return 0.0
    sides = [(p, (q - p) / abs(q - p)) for p, q in zip(corners, [*corners[1:], corners[0]])]
    return min(max(((z - p) * t.conjugate()).imag for z in corners) for p, t in sides)


def rounded(corners: list[complex], radius: float) -> list[complex]:
    """Outline of everything within ``radius`` of a convex polygon, or of the line between two points."""
    count = len(corners)
    found = []
    for k, corner in enumerate(corners):
        into, out = corner - corners[k - 1], corners[(k + 1) % count] - corner
        first = math.atan2(-into.real, into.imag)  # outwards: cmath.phase fails on subnormal numbers
        turn = (math.atan2(out.imag, out.real) - math.atan2(into.imag, into.real)) % math.tau
        turn = 0.0 if turn > 1.5 * math.pi else turn  # a corner that is straight to rounding
        steps = max(2, math.ceil(turn / 0.35))
        found += [corner + cmath.rect(radius, first + turn * j / steps) for j in range(steps + 1)]
    return found
