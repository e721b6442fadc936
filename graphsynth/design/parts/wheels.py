"""Gear wheels and disk cams as sheets beside their links, in the layer of what they touch (theory/parts 4).

A wheel has involute teeth of 20 degrees, addendum one module and dedendum 1.25, and so has a ring, inside; a cam is the
curve within its pitch curve by the radius of its roller.  Two dowels fasten each to its link; a roller turns on its own
pin.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.design.parts.outline import Corner, Rounded
from graphsynth.kinematics.engine.result import Motion
from graphsynth.mechanism.joints import Cam, Gear

Complex = NDArray[np.complex128]
#: Pressure angle; addendum and dedendum, and what both wheels' teeth together are thinner by, in modules.
_PRESSURE, _ADDENDUM, _DEDENDUM, _BACKLASH = math.radians(20.0), 1.0, 1.25, 0.04
#: Fewest teeth, below which a rack would undercut them; largest whole numbers of a ratio; points of a flank.
_FEWEST, _RATIO, _FLANK = 17, 200, 8
#: Fewest teeth of a ring, all involute, and by how many at least it has more than its wheel: else tips meet on the way
#: in and out of the mesh.
_RING, _MORE = 34, 9
#: Points of a cam, more where it has many harmonics; sides of a polygon about it; sectors of one that is hollow.
_POINTS, _WAVES, _SIDES, _SECTORS = 720, 48, 48, 36
#: Corners left out by `Rounded.around`, which stand out by 1e-9 of the diameter or less, one after the other.
_MERGED = 1e-6
#: Distances of centres that differ by less, of their size, are what they should be.
_SAME = 1e-6


@dataclass(frozen=True)
class Cut(Rounded):
    """A sheet with a polygon of its own; as a rounded hull it is what holds it, which is what must not collide.

    >>> square = Cut((0j,), 2.0, (1 + 1j, -1 + 1j, -1 - 1j, 1 - 1j))
    >>> square.moments.area, square.box
    (4.0, ((-2-2j), (2+2j)))
    """

    edge: tuple[complex, ...] = ()
    pitch: float = 0.0  #: radius of a circle to engrave
    sectors: tuple[Rounded, ...] = ()  #: of a hollow cam: what must not collide

    def moved(self, turn: complex, shift: complex) -> Cut:
        """Return it turned about the origin by a unit vector, then shifted."""
        held = super().moved(turn, shift)
        edge = tuple(z * turn + shift for z in self.edge)
        sectors = tuple(own.moved(turn, shift) for own in self.sectors)
        return Cut(held.hull, held.radius, edge, self.pitch, sectors)

    @cached_property
    def corners(self) -> tuple[Corner, ...]:
        """The polygon, counter-clockwise."""
        return tuple(Corner(z, 0.0) for z in self.edge)


class Wheel(NamedTuple):
    """A sheet of a link that touches another one: its link, centre, outline, the radius free for dowels, what it is.

    ``rolls``: it turns on a pin and needs no dowels.  ``hole``: of a ring its teeth; ``dowels``, from the centre.
    """

    link: int
    centre: complex
    outline: Rounded
    free: float
    told: str
    rolls: bool = False
    hole: Rounded | None = None
    dowels: float = 0.0


def check(motion: Motion) -> None:
    """Refuse what has no teeth: ratios without whole numbers, centres elsewhere than where the pitch circles touch."""
    poses = motion.poses[motion.assembled]
    for joint in motion.mechanism.joints:
        if not isinstance(joint, Gear):
            continue
        name = f"gear {joint.a}-{joint.b}"
        teeth(joint)
        ends = ((joint.a, joint.at_a), (joint.b, joint.at_b))
        a, b = (poses[:, k, :2] @ [1, 1j] + np.exp(1j * poses[:, k, 2]) * complex(*at) for k, at in ends)
        far, need = np.abs(b - a), abs(joint.radius_a + joint.sign * joint.radius_b)
        if np.abs(far - need).max() > _SAME * need:
            raise GeometryError(
                f"the centres of {name} are {far.min():.6g} to {far.max():.6g} apart, and its pitch circles "
                f"touch at {need:.6g}; make them equal, so that teeth meet"
            )


def teeth(joint: Gear) -> tuple[int, int]:
    """Return the least numbers of teeth of a pair, none below 17; of a ring 34 or more, and 9 more than of its wheel.

    >>> teeth(Gear(0, 1, radius_a=1.0, radius_b=1.5)), teeth(Gear(0, 1, radius_a=1.0, radius_b=1.5, internal=True))
    ((18, 27), (24, 36))
    """
    ratio = joint.radius_a / joint.radius_b
    whole = Fraction(ratio).limit_denominator(_RATIO)
    if whole <= 0 or abs(whole - ratio) > 1e-9 * ratio or whole.numerator > _RATIO:
        raise GeometryError(
            f"the radii of gear {joint.a}-{joint.b}, {joint.radius_a:g} and {joint.radius_b:g}, have no ratio of whole "
            f"numbers up to {_RATIO}; give such radii, for teeth are counted"
        )
    few, many = sorted((whole.numerator, whole.denominator))
    times = -(-_FEWEST // few)
    if joint.internal:
        times = max(times, -(-_RING // many), -(-_MORE // (many - few)))
    return whole.numerator * times, whole.denominator * times


def wheel(count: int, pitch: float, centre: complex, first: float, ring: bool = False) -> Cut:
    """Return a wheel with so many teeth on a pitch radius, the middle of one in a direction; or the hole of a ring."""
    module = 2.0 * pitch / count
    out, inward, play = (_DEDENDUM, _ADDENDUM, -_BACKLASH) if ring else (_ADDENDUM, _DEDENDUM, _BACKLASH)
    base, tip, root = pitch * math.cos(_PRESSURE), pitch + out * module, pitch - inward * module
    radii: NDArray[np.float64] = np.linspace(max(base, root), tip, _FLANK)
    angle = np.arccos(base / radii)
    whole = math.pi / (2 * count) - 0.25 * play * module / pitch + math.tan(_PRESSURE) - _PRESSURE
    half = np.asarray(whole - (np.tan(angle) - angle))  # of a tooth, at these radii
    if root < base:
        radii, half = np.append(root, radii), np.append(half[0], half)
    flank = radii * np.exp(-1j * half)
    tooth = np.concatenate([flank, np.conj(flank[::-1])])
    turns = np.exp(1j * (first + math.tau * np.arange(count) / count))
    return Cut((centre,), tip, tuple((centre + (turns[:, None] * tooth).ravel()).tolist()), pitch)


def cam(joint: Cam, unit: float, roller: float) -> Cut:
    """Return the disk that a roller touches, in millimetres, and what holds it (theory/parts 5)."""
    count = max(_POINTS, _WAVES * len(joint.harmonics))
    psi: NDArray[np.float64] = np.linspace(0.0, math.tau, count, endpoint=False)
    rho, first, second = waves = unit * np.array([joint.pitch_radius(float(u)) for u in psi]).T
    bend = (rho**2 + 2.0 * first**2 - rho * second) / (rho**2 + first**2) ** 1.5
    if bend.max() * roller >= 1.0:
        raise GeometryError(
            f"the pitch curve of cam {joint.a}-{joint.b} has a radius of curvature of {1.0 / bend.max():.3g} mm, "
            f"and its roller one of {roller:.3g}, which would undercut it; make the pin smaller, or the unit larger"
        )
    turn, centre = np.exp(1j * (psi + joint.angle_a)), complex(*joint.at_a) * unit
    way = (first + 1j * rho) * turn
    edge = rho * turn + 1j * roller * way / np.abs(way) + centre
    beyond = _beyond_chords(joint, unit, waves, roller)
    hollow = bool(bend.min() < 0.0)
    runs = np.array_split(np.arange(count), _SECTORS) if hollow else []
    fans = [np.append(edge[np.arange(run[0], run[-1] + 2) % count], centre) for run in runs]
    around, sectors = _held(edge, beyond), tuple(_held(fan, beyond, 4 * _SIDES) for fan in fans)
    return Cut(around.hull, around.radius, tuple(edge.tolist()), sectors=sectors)


def _beyond_chords(joint: Cam, unit: float, waves: NDArray[np.float64], roller: float) -> float:
    """Bound how far a cam reaches beyond the chords between its points, where radius and derivatives are known.

    Over a step h the tangent, which is along the chord somewhere, turns by W h at most, and the curve is nowhere
    further than h / 2 from an end of the chord: at most ``h^2 W G / 2`` beyond it, G the speed by the angle.
    """
    step = math.tau / waves.shape[1]
    size = unit * np.hypot(*np.reshape(joint.harmonics, (-1, 2)).T)
    more = [step**2 / 8.0 * float(size @ np.arange(1, len(size) + 1) ** float(k)) for k in (2, 3, 4)]
    rho, first, second = np.abs(waves).max(axis=1) + more
    least = max(float(waves[0].min()) - more[0], 0.0)
    with np.errstate(divide="ignore"):
        turning = (rho**2 + 2.0 * first**2 + rho * second) / np.square(least)
    return float(0.5 * step**2 * turning * (rho + first + roller * turning))


def _held(points: Complex, beyond: float, sides: int = _SIDES) -> Rounded:
    """Return a polygon of so many sides or less that holds points and what is as near to their hull."""
    ends = np.exp(1j * math.tau * np.arange(sides) / sides)
    far = (np.conj(ends)[:, None] * points).real.max(axis=1)  # lines that touch: where neighbours meet are its corners
    step = math.tau / sides
    corners = ends * (far + 1j * (np.roll(far, -1) - far * math.cos(step)) / math.sin(step))
    return Rounded.around(corners.tolist(), beyond + _MERGED * float(far.max()))


def pair(joint: Gear | Cam, unit: float, pose: NDArray[np.float64], roller: float) -> tuple[Wheel, Wheel]:
    """Return both sheets of a joint, with teeth that mesh at a pose (links, 3) in millimetres."""
    A, B = complex(*joint.at_a) * unit, complex(*joint.at_b) * unit
    if isinstance(joint, Cam):
        disk = cam(joint, unit, roller)
        return (
            Wheel(joint.a, A, disk, min(abs(z - A) for z in disk.edge), "cam"),
            Wheel(joint.b, B, Rounded((B,), roller), roller, "roller", True),
        )
    a, b = (complex(*pose[k, :2]) + cmath.exp(1j * pose[k, 2]) * at for k, at in ((joint.a, A), (joint.b, B)))
    towards, found = cmath.phase(b - a), []
    rings = tuple(
        joint.internal and own == max(joint.radius_a, joint.radius_b) for own in (joint.radius_a, joint.radius_b)
    )
    meet = (towards + math.pi * rings[1], towards + math.pi * (not rings[0]))  # where the pitch circles touch
    for count, link, at, radius, first, ring in zip(
        teeth(joint), (joint.a, joint.b), (A, B), (joint.radius_a, joint.radius_b), meet, rings
    ):
        # a tooth of a in a gap of b; the hole of a ring has teeth where the ring has gaps
        pitch, gap = radius * unit, 0.0 if joint.internal or link == joint.a else math.pi / count
        module = 2.0 * pitch / count
        outline = wheel(count, pitch, at, first + gap - float(pose[link, 2]), ring)
        told = f"{'ring' if ring else 'wheel'}, {count} teeth, module {module:.4g} mm"
        if ring:
            rim = outline.radius + roller
            found.append(Wheel(link, at, Rounded((at,), rim + roller), math.inf, told, hole=outline, dowels=rim))
        else:
            found.append(Wheel(link, at, outline, pitch - _DEDENDUM * module, told))
    return found[0], found[1]
