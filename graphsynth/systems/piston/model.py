"""The floating piston: a crank drive and, on its crosshead, a piston in a structural group of its own; closed forms.

Drives are the slider-crank (RRP) and the Scotch yoke (RPP); positions have two derivatives by the crank angle.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import check_fields, finite, finite_array, positive
from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.joints import JointGeometry, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism, TracePoint
from graphsynth.structure.graph import MechanismGraph

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]
#: Crank angle in [0, 2 pi) and place of the crosshead, m, of the outer and the inner dead centre.
_Ends = tuple[tuple[float, float], tuple[float, float]]
_PARALLEL = 1e-9
_TURN = 2.0 * math.pi


class Derivatives(NamedTuple):
    """A coordinate over the crank angle with two derivatives by it, each of the shape of the angle."""

    value: Array
    first: Array
    second: Array

    def mapped(self, factor: float, constant: float) -> Derivatives:
        """Return ``constant + factor * value`` with its derivatives."""
        return Derivatives(constant + factor * self.value, factor * self.first, factor * self.second)


def _finite(part: object, what: str, *names: str, check: Callable[..., float] = finite) -> None:
    for name in names:
        object.__setattr__(part, name, check(f"{name} of the {what}", getattr(part, name)))


@dataclass(frozen=True)
class CrankSlider:
    """Crank, connecting rod and crosshead.

    Parameters
    ----------
    crank, rod : float
        Lengths, m.
    offset : float
        Distance of the crosshead's axis from the centre of the crank, m; 0: centric.
    branch : {1, -1}
        Side of the crank on which the crosshead is.

    Raises
    ------
    GeometryError
        Lengths that are not positive; a rod that is too short for a full rotation.

    Examples
    --------
    >>> CrankSlider(0.05, 0.2).crosshead(0.0).value.item()
    0.25
    """

    crank: float
    rod: float
    offset: float = 0.0
    branch: int = 1

    kind: ClassVar[str] = "RRP"

    def __post_init__(self) -> None:
        _finite(self, "slider-crank", "crank", "rod", check=positive)
        _finite(self, "slider-crank", "offset")
        if self.branch not in (1, -1):
            raise GeometryError(f"branch = {self.branch!r} must be 1 or -1: the side of the crosshead")
        check_fields(self, ("crank", "rod"), small=("offset",))
        least = self.crank + abs(self.offset)
        if not self.rod > least:
            raise GeometryError(
                f"the rod of {self.rod:.6g} m is too short for a full turn: it must be longer than crank + |offset| = "
                f"{least:.6g} m; lengthen the rod, or shorten crank or offset"
            )

    def _across(self, phi: ArrayLike) -> tuple[Derivatives, Derivatives]:
        """Height of the crank pin over the crosshead's axis, and the projection of the rod on it."""
        angle = np.asarray(phi, dtype=np.float64)
        c, s = self.crank * np.cos(angle), self.crank * np.sin(angle)
        z = Derivatives(s - self.offset, c, -s)
        q = np.sqrt((self.rod - z.value) * (self.rod + z.value))
        first = -z.value * z.first / q
        return z, Derivatives(q, first, -(z.first**2 + z.value * z.second + first**2) / q)

    def crosshead(self, phi: ArrayLike) -> Derivatives:
        """Place of the crosshead's pin along its guide, counted from the foot of the crank's centre, m."""
        (_, c, minus_s), q = self._across(phi)
        b = float(self.branch)
        return Derivatives(c + b * q.value, minus_s + b * q.first, -c + b * q.second)

    def follower(self, phi: ArrayLike) -> Derivatives:
        """Angle of the rod, from crank pin to crosshead pin, against the guide, radians."""
        z, q = self._across(phi)
        x = self.branch * q.value
        first = -z.first / x
        lean = np.arctan2(-z.value, q.value)
        value = lean if self.branch > 0 else math.pi - lean  # continuous: it never passes the cut at pi
        return Derivatives(value, first, -z.second / x + z.first * q.first / (x * q.value))

    def dead_centres(self) -> _Ends:
        """Crank angle in [0, 2 pi) and crosshead's place at the outer (farthest along +x) and the inner one; exact."""
        e, b = self.offset, self.branch
        far, near = (
            math.sqrt((length - e) * (length + e)) for length in (self.rod + self.crank, self.rod - self.crank)
        )
        stretched = math.atan2(e, b * far) % _TURN, b * far
        folded = math.atan2(-e, -b * near) % _TURN, b * near
        return (stretched, folded) if b > 0 else (folded, stretched)

    @property
    def steepest(self) -> float:
        """Largest angle of the rod against the guide over a turn, radians (exact)."""
        return math.asin((self.crank + abs(self.offset)) / self.rod)

    def joints(self) -> list[JointGeometry]:
        """Joints of links 0..3: frame, crank, rod, crosshead."""
        return [
            Revolute(0, 1),
            Revolute(1, 2, (self.crank, 0.0)),
            Revolute(2, 3, (self.rod, 0.0)),
            Prismatic(0, 3, (0.0, self.offset)),
        ]


@dataclass(frozen=True)
class ScotchYoke:
    """Crank, block on its pin, and yoke with the slot in which the block slides.

    Parameters
    ----------
    crank : float
        Length, m.
    offset : float
        Distance of the yoke's axis from the centre of the crank, m.
    yoke_angle : float
        Direction of the yoke's slot against its guide, radians; pi/2 gives harmonic motion of amplitude ``crank``.

    Raises
    ------
    GeometryError
        A crank that is not positive; a slot parallel to the guide.

    Examples
    --------
    >>> ScotchYoke(0.05).crosshead(0.0).value.item()
    0.05
    """

    crank: float
    offset: float = 0.0
    yoke_angle: float = 0.5 * math.pi

    kind: ClassVar[str] = "RPP"

    def __post_init__(self) -> None:
        _finite(self, "Scotch yoke", "crank", check=positive)
        _finite(self, "Scotch yoke", "offset", "yoke_angle")
        check_fields(self, ("crank",), small=("offset",))
        if not math.sin(self.yoke_angle) > _PARALLEL:
            raise GeometryError(
                f"yoke_angle = {self.yoke_angle:.6g} rad must lie between 0 and pi, best at pi/2: a slot parallel to "
                "the guide does not drive the yoke"
            )

    @property
    def _wave(self) -> tuple[float, float]:
        """Amplitude and mean place of the yoke."""
        sine = math.sin(self.yoke_angle)
        return self.crank / sine, self.offset * math.cos(self.yoke_angle) / sine

    def crosshead(self, phi: ArrayLike) -> Derivatives:
        """Place of the yoke along its guide, m: where its slot crosses the guide's axis."""
        amplitude, mean = self._wave
        turn = self.yoke_angle - np.asarray(phi, dtype=np.float64)
        wave = amplitude * np.sin(turn)
        return Derivatives(mean + wave, -amplitude * np.cos(turn), -wave)

    def follower(self, phi: ArrayLike) -> Derivatives:
        """Place of the block along the yoke's slot, counted from the guide's axis, m."""
        angle = np.asarray(phi, dtype=np.float64)
        c, s = self.crank * np.cos(angle), self.crank * np.sin(angle)
        return Derivatives(s - self.offset, c, -s).mapped(1.0 / math.sin(self.yoke_angle), 0.0)

    def dead_centres(self) -> _Ends:
        """Crank angle in [0, 2 pi) and yoke's place at the outer and the inner dead centre; exact."""
        amplitude, mean = self._wave
        quarter = 0.5 * math.pi
        outer = (self.yoke_angle - quarter) % _TURN, mean + amplitude
        return outer, ((self.yoke_angle + quarter) % _TURN, mean - amplitude)

    def joints(self) -> list[JointGeometry]:
        """Joints of links 0..3: frame, crank, block, yoke."""
        return [
            Revolute(0, 1),
            Revolute(1, 2, (self.crank, 0.0)),
            Prismatic(3, 2, angle_a=self.yoke_angle, angle_b=self.yoke_angle),
            Prismatic(0, 3, (0.0, self.offset)),
        ]


@dataclass(frozen=True)
class FloatingGroup:
    """A piston that slides in its cylinder and in a slot of the crosshead.

    With one link, two joints of mobility 1 and translations only its mobility is 2 * 1 - 2 (2 - 1) = 0.

    Parameters
    ----------
    cylinder_angle : float
        Direction of the cylinder, towards its head, against the crosshead's guide, radians; 0: parallel.
    slot_angle : float
        Direction of the slot against the crosshead's guide, radians; pi/2: square to it.
    cylinder_offset : float
        Distance of the cylinder's axis above the crosshead's, taken over the centre of the crank, m.
    lead : float
        Where the slot crosses the crosshead's axis, ahead of its pin, m.

    Raises
    ------
    GeometryError
        A slot that is parallel to the cylinder or to the guide, or that moves the piston backwards; a cylinder that
        is square to the guide; values that are not finite.

    Examples
    --------
    >>> FloatingGroup().transmission
    (1.0, 0.0)
    """

    cylinder_angle: float = 0.0
    slot_angle: float = 0.5 * math.pi
    cylinder_offset: float = 0.0
    lead: float = 0.0

    def __post_init__(self) -> None:
        _finite(self, "floating group", "cylinder_angle", "slot_angle", "cylinder_offset", "lead")
        check_fields(self, (), small=("cylinder_offset",))
        if math.cos(self.cylinder_angle) < _PARALLEL:
            raise GeometryError(
                f"cylinder_angle = {self.cylinder_angle:.6g} rad turns the cylinder square to the crosshead's guide or "
                "beyond; keep it between -pi/2 and pi/2"
            )
        why = ""
        if abs(math.sin(self.slot_angle - self.cylinder_angle)) < _PARALLEL:
            why = "is parallel to the cylinder, so the piston has no definite place; turn the slot, best by pi/2"
        elif abs(math.sin(self.slot_angle)) < _PARALLEL:
            why = "is parallel to the crosshead's guide, so the piston stands still; turn the slot, best to pi/2"
        elif self.transmission[0] < 0.0:
            why = "lies between the directions of guide and cylinder, so the piston moves against the crosshead; turn "
            why += "the slot, best to pi/2"
        if why:
            raise GeometryError(f"slot_angle = {self.slot_angle:.6g} rad {why}")

    @property
    def transmission(self) -> tuple[float, float]:
        """Displacement of the piston in the cylinder, and along the slot, for one of the crosshead."""
        return self._solve(1.0, 0.0)

    def place(self) -> tuple[float, float]:
        """Coordinates of the piston in the cylinder and along the slot, for a crosshead at 0."""
        return self._solve(self.lead, -self.cylinder_offset)

    def _solve(self, x: float, y: float) -> tuple[float, float]:
        """Find t and u with ``(x, y) + u slot = t cylinder``."""
        across = math.sin(self.slot_angle - self.cylinder_angle)
        t, u = (x * math.sin(turn) - y * math.cos(turn) for turn in (self.slot_angle, self.cylinder_angle))
        return t / across, u / across


class DeadCentre(NamedTuple):
    """Crank angle in [0, 2 pi), place of the crosshead and of the piston, m (exact up to rounding)."""

    angle: float
    crosshead: float
    piston: float


@dataclass(frozen=True, eq=False)
class PistonMotion:
    """Positions and two derivatives by the crank angle, in closed form (errors of a few roundings).

    Attributes
    ----------
    angle : ndarray
        Crank angle, radians; every other array has its shape.
    crosshead : Derivatives
        Along the guide, m.
    follower : Derivatives
        Angle of the rod (radians), or place of the block in the yoke (m).
    piston : Derivatives
        Along the cylinder, m; without a second group the crosshead's.
    slot : Derivatives
        Along the slot of the crosshead, m; 0 without a second group.
    """

    angle: Array
    crosshead: Derivatives
    follower: Derivatives
    piston: Derivatives
    slot: Derivatives


@dataclass(frozen=True)
class FloatingPiston:
    """A crank drive with or without a floating piston.

    Links: 0 frame, 1 crank, 2 rod or block, 3 crosshead or yoke, 4 piston.  The crosshead's guide is the x axis of the
    machine, shifted by the drive's offset; the cylinder's head is on the far side of positive displacement.

    Parameters
    ----------
    drive : CrankSlider or ScotchYoke
        The first group, in a space of mobility 3.
    group : FloatingGroup or None
        The second group, in a space of mobility 2; None: the crosshead itself is the piston.

    Raises
    ------
    GeometryError
        Parts that are of another type.

    Examples
    --------
    >>> machine = FloatingPiston.crank_slider(0.05, 0.2)
    >>> round(machine.stroke, 12), machine.motion(0.0).piston.value.item()
    (0.1, 0.25)
    """

    drive: CrankSlider | ScotchYoke
    group: FloatingGroup | None = field(default_factory=FloatingGroup)

    def __post_init__(self) -> None:
        if not isinstance(self.drive, CrankSlider | ScotchYoke):
            raise GeometryError(f"drive = {self.drive!r} is not known; give a CrankSlider or a ScotchYoke")
        if self.group is not None and not isinstance(self.group, FloatingGroup):
            raise GeometryError(f"group = {self.group!r} is not known; give a FloatingGroup, or None for none")

    @classmethod
    def crank_slider(cls, crank: float, rod: float, offset: float = 0.0, **group: float) -> FloatingPiston:
        """Return the slider-crank with a floating piston; further keywords are those of `FloatingGroup`."""
        return cls(CrankSlider(crank, rod, offset), FloatingGroup(**group))

    @classmethod
    def scotch_yoke(cls, crank: float, offset: float = 0.0, **group: float) -> FloatingPiston:
        """Return the Scotch yoke with a floating piston; further keywords are those of `FloatingGroup`."""
        return cls(ScotchYoke(crank, offset), FloatingGroup(**group))

    def without_group(self) -> FloatingPiston:
        """Return the same drive whose crosshead is the piston."""
        return FloatingPiston(self.drive, None)

    @property
    def graph(self) -> MechanismGraph:
        """The graph with mobility-1 joints: four links and one loop, or five links and two."""
        pairs = [(0, 1), (1, 2), (2, 3), (0, 3), *([] if self.group is None else [(3, 4), (0, 4)])]
        return MechanismGraph(4 if self.group is None else 5, pairs, frame=0)

    @property
    def cylinder(self) -> tuple[float, complex]:
        """Direction of the cylinder, radians, and the point of its axis from which the piston's place counts, m."""
        if self.group is None:
            return 0.0, 1j * self.drive.offset
        return self.group.cylinder_angle, 1j * (self.drive.offset + self.group.cylinder_offset)

    def motion(self, angle: ArrayLike) -> PistonMotion:
        """Positions, and first and second derivatives by the crank angle, at any finite angles."""
        phi = finite_array("angle", angle)
        crosshead, follower = self.drive.crosshead(phi), self.drive.follower(phi)
        if self.group is None:
            return PistonMotion(phi, crosshead, follower, crosshead, crosshead.mapped(0.0, 0.0))
        (along, across), (first, second) = self.group.transmission, self.group.place()
        return PistonMotion(phi, crosshead, follower, crosshead.mapped(along, first), crosshead.mapped(across, second))

    def dead_centres(self) -> tuple[DeadCentre, DeadCentre]:
        """Outer (next to the cylinder's head) and inner dead centre."""
        factor, constant = (1.0, 0.0) if self.group is None else (self.group.transmission[0], self.group.place()[0])
        outer, inner = (DeadCentre(phi, s, constant + factor * s) for phi, s in self.drive.dead_centres())
        return outer, inner

    @property
    def stroke(self) -> float:
        """Travel of the piston between the dead centres, m."""
        (_, outer), (_, inner) = self.drive.dead_centres()
        return (1.0 if self.group is None else self.group.transmission[0]) * (outer - inner)

    @property
    def time_ratio(self) -> float:
        """Crank angle from the outer to the inner dead centre, over that of the way back; 1 for a centric drive."""
        outer, inner = self.dead_centres()
        out = (inner.angle - outer.angle) % _TURN
        return out / (_TURN - out)

    def angle_at(self, piston: float, towards_head: bool) -> float:
        """Crank angle in [0, 2 pi) at which the piston passes a place on its way to or from the head (to rounding).

        A `GeometryError` refuses a place that the piston does not reach.
        """
        from scipy.optimize import brentq

        outer, inner = self.dead_centres()
        if not inner.piston <= piston <= outer.piston:
            raise GeometryError(
                f"piston = {piston:.6g} m is outside its stroke, {inner.piston:.6g} to {outer.piston:.6g} m; "
                "choose a place inside"
            )
        start, stop = (inner.angle, outer.angle) if towards_head else (outer.angle, inner.angle)
        stop = start + (stop - start) % _TURN

        def apart(phi: float) -> float:
            return float(self.motion(phi).piston.value) - piston

        ends = apart(start), apart(stop)
        if ends[0] * ends[1] >= 0.0:  # at a dead centre, up to rounding
            return (start if abs(ends[0]) < abs(ends[1]) else stop) % _TURN
        return float(brentq(apart, start, stop, xtol=1e-15, rtol=8.9e-16)) % _TURN

    def poses(self, angle: ArrayLike) -> Array:
        """Poses ``(x, y, theta)`` of all links, shape (n, links, 3), for angles of shape (n,)."""
        return np.asarray(self._states(self.motion(np.atleast_1d(finite_array("angle", angle))))[0])

    def _states(self, motion: PistonMotion) -> Array:
        """Poses of all links and two derivatives by the crank angle, shape (3, n, links, 3)."""
        phi = motion.angle
        found = np.zeros((3, len(phi), self.graph.links, 3))
        found[0, :, 1, 2], found[1, :, 1, 2] = phi, 1.0
        pin = np.multiply.outer([1.0, 1j, -1.0], self.drive.crank * np.exp(1j * phi))
        found[:, :, 2, 0], found[:, :, 2, 1] = pin.real, pin.imag
        if isinstance(self.drive, CrankSlider):
            found[:, :, 2, 2] = motion.follower
        found[:, :, 3, 0], found[0, :, 3, 1] = motion.crosshead, self.drive.offset
        if self.group is not None:
            turn, base = self.cylinder
            found[:, :, 4, 0] = np.array(motion.piston) * math.cos(turn)
            found[:, :, 4, 1] = np.array(motion.piston) * math.sin(turn)
            found[0, :, 4, 1] += base.imag
        return found

    def run(self, angle: ArrayLike, slot: Literal["sliding", "crowned"] = "crowned") -> Motion:
        """Return the motion, in closed form, as the planar engine gives it; to draw and for dynamics.

        Crank angles of shape (n,) in any order, or a `GeometryError`; for `slot` see `mechanism`.
        """
        from graphsynth.pipeline.display import shown_motion

        own = self.motion(np.atleast_1d(finite_array("angle", angle)))
        if own.angle.ndim != 1 or not own.angle.size:
            raise GeometryError(f"angle has shape {own.angle.shape}; give one list of crank angles")
        poses, first, second = self._states(own)
        closed = len(own.angle) > 1 and abs(own.angle[-1] - own.angle[0] - _TURN) < 1e-12
        shown = shown_motion(self.mechanism(slot, float(own.angle[0])), own.angle, poses, closed=closed)
        return replace(shown, velocities=first, accelerations=second)

    def mechanism(self, slot: Literal["sliding", "crowned"] = "sliding", at: float = 0.5) -> Mechanism:
        """Return the dimensioned mechanism for the planar engine and for dynamics.

        `slot` "sliding": the joint 3-4 is a prismatic joint, mobility 1, as the source has it; one constraint is
        redundant.  "crowned": the slot lets the piston turn in it, mobility 2; no constraint is redundant and the
        motion is the same; the planar engine takes this one.  A `GeometryError` refuses others.  `at`: crank angle of
        the pose, radians.
        """
        if not isinstance(slot, str) or slot not in ("sliding", "crowned"):
            raise GeometryError(f"slot = {slot!r} is not known; give 'sliding' or 'crowned'")
        joints, graph = self.drive.joints(), self.graph
        if (group := self.group) is not None:
            turn, base = self.cylinder
            joints.append(Prismatic(0, 4, (0.0, base.imag), angle_a=turn, angle_b=turn))
            if slot == "sliding":
                joints.append(Prismatic(3, 4, (group.lead, 0.0), angle_a=group.slot_angle, angle_b=group.slot_angle))
            else:
                joints.append(PinSlot(3, 4, (group.lead, 0.0), angle_a=group.slot_angle))
                pairs = [(a, b, 2 if (a, b) == (3, 4) else 1) for a, b, _ in graph.joints]
                graph = MechanismGraph(5, pairs, frame=0)
        pose = tuple((x, y, turn) for x, y, turn in self.poses([at])[0].tolist())
        last = 3 if self.group is None else 4
        return Mechanism(graph, tuple(joints), (Driver(0, 1),), {"piston": TracePoint(last, (0.0, 0.0))}, pose)
