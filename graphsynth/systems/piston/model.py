"""The floating piston: a crank drive and, on its crosshead, a piston in a group of its own."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.joints import JointGeometry, PinSlot, Prismatic
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism, TracePoint
from graphsynth.structure.graph import MechanismGraph
from graphsynth.systems.piston.drives import CrankSlider, Derivatives, ScotchYoke
from graphsynth.systems.piston.group import FloatingGroup

Array = NDArray[np.float64]


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
        """Return the crank-slider with a floating piston; further keywords are those of `FloatingGroup`."""
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
        first = [(0, 1), (1, 2), (2, 3), (0, 3)]
        if self.group is None:
            return MechanismGraph(4, first, frame=0)
        return MechanismGraph(5, [*first, (3, 4), (0, 4)], frame=0)

    def motion(self, angle: ArrayLike) -> PistonMotion:
        """Positions, and first and second derivatives by the crank angle, at any angles.

        Raises
        ------
        GeometryError
            Angles that are not finite numbers.
        """
        phi = finite_array("angle", angle)
        crosshead = self.drive.crosshead(phi)
        if self.group is None:
            zero = np.zeros_like(phi)
            return PistonMotion(phi, crosshead, self.drive.follower(phi), crosshead, Derivatives(zero, zero, zero))
        (along, across), (first, second) = self.group.transmission, self.group.place()
        return PistonMotion(
            phi, crosshead, self.drive.follower(phi), crosshead.mapped(along, first), crosshead.mapped(across, second)
        )

    def dead_centres(self) -> tuple[DeadCentre, DeadCentre]:
        """Outer (next to the cylinder's head) and inner dead centre."""
        factor = 1.0 if self.group is None else self.group.transmission[0]
        constant = 0.0 if self.group is None else self.group.place()[0]
        outer, inner = (DeadCentre(phi, s, constant + factor * s) for phi, s in self.drive.dead_centres())
        return outer, inner

    @property
    def stroke(self) -> float:
        """Way of the piston between the dead centres, m."""
        outer, inner = self.dead_centres()
        factor = 1.0 if self.group is None else self.group.transmission[0]
        return factor * (outer.crosshead - inner.crosshead)

    @property
    def time_ratio(self) -> float:
        """Crank angle from the outer to the inner dead centre, over that of the way back; 1 for a centric drive."""
        outer, inner = self.dead_centres()
        out = (inner.angle - outer.angle) % (2.0 * math.pi)
        return out / (2.0 * math.pi - out)

    def angle_at(self, piston: float, towards_head: bool) -> float:
        """Crank angle in [0, 2 pi) at which the piston passes a place on its way to or from the head (to rounding).

        Raises
        ------
        GeometryError
            A place that the piston does not reach.
        """
        from scipy.optimize import brentq

        outer, inner = self.dead_centres()
        if not inner.piston <= piston <= outer.piston:
            raise GeometryError(
                f"piston = {piston:.6g} m is outside its stroke, {inner.piston:.6g} to {outer.piston:.6g} m; "
                "choose a place inside"
            )
        start, stop = (inner.angle, outer.angle) if towards_head else (outer.angle, inner.angle)
        stop = start + (stop - start) % (2.0 * math.pi)

        def apart(phi: float) -> float:
            return float(self.motion(phi).piston.value) - piston

        ends = apart(start), apart(stop)
        if ends[0] * ends[1] >= 0.0:  # at a dead centre, up to rounding
            return (start if abs(ends[0]) < abs(ends[1]) else stop) % (2.0 * math.pi)
        return float(brentq(apart, start, stop, xtol=1e-15, rtol=8.9e-16)) % (2.0 * math.pi)

    def poses(self, angle: ArrayLike) -> Array:
        """Poses ``(x, y, theta)`` of all links, shape (n, links, 3), for angles of shape (n,)."""
        phi = np.atleast_1d(finite_array("angle", angle))
        motion = self.motion(phi)
        found = np.zeros((len(phi), self.graph.links, 3))
        found[:, 1, 2] = phi
        found[:, 2, 0], found[:, 2, 1] = self.drive.crank * np.cos(phi), self.drive.crank * np.sin(phi)
        if isinstance(self.drive, CrankSlider):
            found[:, 2, 2] = motion.follower.value
        found[:, 3, 0], found[:, 3, 1] = motion.crosshead.value, self.drive.offset
        if self.group is not None:
            t, turn = motion.piston.value, self.group.cylinder_angle
            found[:, 4, 0] = t * math.cos(turn)
            found[:, 4, 1] = self.drive.offset + self.group.cylinder_offset + t * math.sin(turn)
        return found

    def mechanism(self, slot: Literal["sliding", "crowned"] = "sliding", at: float = 0.5) -> Mechanism:
        """Return the dimensioned mechanism for the planar engine and for dynamics.

        Parameters
        ----------
        slot : {"sliding", "crowned"}
            "sliding": the joint 3-4 is a sliding pair, mobility 1, as the source has it; one constraint is redundant.
            "crowned": the slot lets the piston turn in it, mobility 2; no constraint is redundant and the motion is the
            same.  The planar engine takes this one.
        at : float
            Crank angle of the pose, radians.

        Raises
        ------
        GeometryError
            For another ``slot``.
        """
        if not isinstance(slot, str) or slot not in ("sliding", "crowned"):
            raise GeometryError(f"slot = {slot!r} is not known; give 'sliding' or 'crowned'")
        joints: list[JointGeometry] = self.drive.joints()
        graph = self.graph
        if (group := self.group) is not None:
            cylinder, turn = (0.0, self.drive.offset + group.cylinder_offset), group.cylinder_angle
            joints.append(Prismatic(0, 4, cylinder, angle_a=turn, angle_b=turn))
            if slot == "sliding":
                joints.append(Prismatic(3, 4, (group.lead, 0.0), angle_a=group.slot_angle, angle_b=group.slot_angle))
            else:
                joints.append(PinSlot(3, 4, (group.lead, 0.0), angle_a=group.slot_angle))
                pairs = [(a, b, 2 if (a, b) == (3, 4) else 1) for a, b, _ in graph.joints]
                graph = MechanismGraph(5, pairs, frame=0)
        pose = tuple((x, y, turn) for x, y, turn in self.poses([at])[0].tolist())
        last = 3 if self.group is None else 4
        return Mechanism(graph, tuple(joints), (Driver(0, 1),), {"piston": TracePoint(last, (0.0, 0.0))}, pose)
