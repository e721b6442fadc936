"""Joints with geometry: where each joint sits on its two links.

Every point and direction is given in the frame of its own link; the frame link's own frame is the fixed one.
Complex notation below: link k carries the point p to ``r_k + exp(i theta_k) p``.

A new kind of joint is a class here, among `KINDS` and in `JointGeometry`: ``values`` are the left sides of its
equations in the arithmetic of what is `Seen`, ``gradients`` their derivatives.  Its equations for the kernels stand in
``EQUATIONS`` and ``joint_row`` of the planning kernels of `graphsynth.kinematics.engine`, or in ``FURTHER`` of its
``program``; its symbol in `graphsynth.drawing.symbols`, its reactions in `graphsynth.dynamics.reactions`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, ClassVar

from graphsynth.core.checks import Point, checked, finite, link_number, point, positive
from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.equations import Gradient, Seen

__all__ = ["COLUMNS", "Cam", "Gear", "JointGeometry", "PinSlot", "PlanarJoint", "Prismatic", "Revolute"]

#: Numbers of a joint in one row: point on a, direction on a, point on b, direction on b, radii, sign, offset.
COLUMNS = ("ax", "ay", "a_angle", "bx", "by", "b_angle", "radius_a", "radius_b", "sign", "offset")


_HARMONICS_MAX = 1024
_CHECKS: dict[str, Callable[[str, Any], Any]] = {"at_": point, "angle": finite, "offset": finite, "radius": positive}


@dataclass(frozen=True)
class PlanarJoint:
    """Two links joined; the order a, b is the user's and need not ascend."""

    a: int
    b: int

    mobility: ClassVar[int] = 1
    kind: ClassVar[str] = ""

    def __post_init__(self) -> None:
        for name in ("a", "b"):
            object.__setattr__(self, name, link_number(f"link {name} of a joint", getattr(self, name)))
        if self.a == self.b:
            raise GeometryError(f"link {self.a} cannot be jointed to itself; name two links")
        for item in fields(self):  # points, angles and radii are told by their names
            check = next((_CHECKS[start] for start in _CHECKS if item.name.startswith(start)), None)
            if check is not None:
                value = check(f"{item.name} of joint {self.a}-{self.b}", getattr(self, item.name))
                object.__setattr__(self, item.name, value)

    def turns(self) -> list[tuple[float, ...]]:
        """Return what a whole turn of the angle in each equation adds to it, in turns; empty where there is none."""
        return [()] * (3 - self.mobility)

    def row(self) -> tuple[float, ...]:
        """Numbers in the order of `COLUMNS`, zeros where the joint has none."""
        places = dict(zip(("ax", "ay", "bx", "by"), (*vars(self)["at_a"], *vars(self)["at_b"])))
        own = {"a_angle": "angle_a", "b_angle": "angle_b"}
        return tuple(places.get(name, getattr(self, own.get(name, name), 0.0)) for name in COLUMNS)

    @property
    def pair(self) -> tuple[int, int]:
        """The two links, ascending."""
        return (self.a, self.b) if self.a < self.b else (self.b, self.a)


@dataclass(frozen=True)
class Revolute(PlanarJoint):
    """Revolute joint: the point ``at_a`` of link a and the point ``at_b`` of link b coincide (two equations)."""

    at_a: Point = (0.0, 0.0)
    at_b: Point = (0.0, 0.0)

    kind: ClassVar[str] = "R"

    def values(self, at: Seen) -> list[Any]:
        """``d = 0``."""
        return list(at.plane.parts(at.d))

    def gradients(self, at: Seen) -> list[Gradient]:
        """Of both components of d."""
        return [Gradient(at.plane.vector(1.0, 0.0)), Gradient(at.plane.vector(0.0, 1.0))]

    coordinate_turns: ClassVar[bool] = True

    def coordinate(self, at: Seen) -> tuple[Any, Gradient]:
        """Angle of link b against link a, up to whole turns."""
        return at.angle_b - at.angle_a, Gradient(None, -1.0, 1.0)


@dataclass(frozen=True)
class Prismatic(PlanarJoint):
    """Prismatic joint: ``at_b`` stays on the line of link a, and the two directions stay parallel (two equations).

    The line passes through ``at_a`` in the direction ``angle_a``; ``theta_a + angle_a = theta_b + angle_b``.  The
    displacement is that of ``at_b`` from ``at_a`` along the direction.
    """

    at_a: Point = (0.0, 0.0)
    at_b: Point = (0.0, 0.0)
    angle_a: float = 0.0
    angle_b: float = 0.0

    kind: ClassVar[str] = "P"

    def values(self, at: Seen) -> list[Any]:
        """``t x d = 0`` and ``theta_b + angle_b - theta_a - angle_a = 0``."""
        along = at.plane.cross(at.line(self.angle_a), at.d)
        return [along, (at.angle_b + self.angle_b) - (at.angle_a + self.angle_a)]

    def gradients(self, at: Seen) -> list[Gradient]:
        """Return the derivatives; the line turns with link a."""
        return [_across(at, self.angle_a), Gradient(None, -1.0, 1.0)]

    def turns(self) -> list[tuple[float, ...]]:
        """Return 1 for the equation of angles."""
        return [(), (1.0,)]

    coordinate_turns: ClassVar[bool] = False

    def coordinate(self, at: Seen) -> tuple[Any, Gradient]:
        """Displacement of ``at_b`` along the line."""
        t = at.line(self.angle_a)
        return at.plane.dot(t, at.d), Gradient(t, at.plane.cross(t, at.d))


@dataclass(frozen=True)
class PinSlot(PlanarJoint):
    """Pin in a straight slot: the point ``at_b`` of link b stays on the line of link a (one equation)."""

    at_a: Point = (0.0, 0.0)
    at_b: Point = (0.0, 0.0)
    angle_a: float = 0.0

    mobility: ClassVar[int] = 2
    kind: ClassVar[str] = "pin-slot"

    def values(self, at: Seen) -> list[Any]:
        """``t x d = 0``."""
        return [at.plane.cross(at.line(self.angle_a), at.d)]

    def gradients(self, at: Seen) -> list[Gradient]:
        """Return the derivatives; the line turns with link a."""
        return [_across(at, self.angle_a)]


@dataclass(frozen=True)
class Gear(PlanarJoint):
    """Gear pair with pitch radii, external or internal (one equation).

    With phi the direction from the centre ``at_a`` to the centre ``at_b``, followed continuously,
    ``radius_a (theta_a - phi) + s radius_b (theta_b - phi - offset) = 0``; s = +1 external, -1 internal.  The angles
    are turned relative to the line of centres, so a moving carrier needs no name; for involute teeth the
    relation holds at any centre distance.  Angles are not reduced modulo a turn: at the first input they are the ones
    nearest to the start pose.
    """

    at_a: Point = (0.0, 0.0)
    at_b: Point = (0.0, 0.0)
    radius_a: float = 1.0
    radius_b: float = 1.0
    internal: bool = False
    offset: float = 0.0

    mobility: ClassVar[int] = 2
    kind: ClassVar[str] = "gear"

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.internal, bool):
            raise GeometryError(f"internal = {self.internal!r} of gear {self.a}-{self.b} must be true or false")
        if self.internal and self.radius_a == self.radius_b:
            raise GeometryError(
                f"internal gear {self.a}-{self.b} has equal radii {self.radius_a}, so the centres coincide; "
                "give different radii"
            )

    @property
    def sign(self) -> float:
        """+1 for an external, -1 for an internal pair."""
        return -1.0 if self.internal else 1.0

    def values(self, at: Seen) -> list[Any]:
        """``radius_a (theta_a - phi) + s radius_b (theta_b - phi - offset) = 0``."""
        return [self.mesh(at, at.plane.argument(at.d))]

    def mesh(self, at: Seen, phi: Any) -> Any:
        """Return the left side for a given direction of the line of centres."""
        second = (at.angle_b - phi - self.offset) * (self.sign * self.radius_b)
        return (at.angle_a - phi) * self.radius_a + second

    def gradients(self, at: Seen) -> list[Gradient]:
        """Return the derivatives; the line of centres turns with d."""
        weight = (self.radius_a + self.sign * self.radius_b) * -1.0
        by_d = at.plane.left(at.d) * (weight / at.plane.dot(at.d, at.d))
        return [Gradient(by_d, self.radius_a, self.sign * self.radius_b)]

    def turns(self) -> list[tuple[float, ...]]:
        """Return what a turn of the line of centres adds."""
        return [(self.radius_a, self.sign * self.radius_b)]


@dataclass(frozen=True)
class Cam(PlanarJoint):
    """Disk cam on link a with a roller (or knife edge) on link b (one equation).

    The centre ``at_b`` of the roller stays on the pitch curve round ``at_a``, given in polar form by
    ``rho(psi) = radius + sum over k >= 1 of c_k cos(k psi) + s_k sin(k psi)`` with psi counted from the direction
    ``angle_a`` of link a; ``harmonics`` holds the pairs (c_k, s_k), at most 1024.  The radius must be positive
    everywhere (checked at 64 angles for each harmonic).  Contact is kept from both sides, as in a groove.
    """

    at_a: Point = (0.0, 0.0)
    at_b: Point = (0.0, 0.0)
    angle_a: float = 0.0
    radius: float = 1.0
    harmonics: tuple[Point, ...] = ()

    mobility: ClassVar[int] = 2
    kind: ClassVar[str] = "cam"

    def __post_init__(self) -> None:
        super().__post_init__()
        name, given = f"of cam {self.a}-{self.b}", self.harmonics
        try:
            if len(given) > _HARMONICS_MAX:
                raise GeometryError(f"harmonics {name}: {len(given)} are given, at most {_HARMONICS_MAX} are taken")
            read = tuple(point(f"harmonic {k} {name}", pair) for k, pair in enumerate(given, 1))
        except TypeError as error:
            raise GeometryError(f"harmonics {name} = {given!r} are no list of pairs (c_k, s_k)") from error
        object.__setattr__(self, "harmonics", read)
        least = self._least_radius()
        if not least > 0.0:
            raise GeometryError(
                f"the pitch curve {name} has the radius {least:.6g} somewhere; make it positive everywhere"
            )

    @property
    def radius_a(self) -> float:
        """The mean radius, in the column of the first radius; harmonics are the joint's own."""
        return self.radius

    def _least_radius(self) -> float:
        """Return a bound of the radius if that is positive, else the least value at many angles (estimated)."""
        largest = sum(math.hypot(c, s) for c, s in self.harmonics)
        if self.radius > largest * (1.0 + 1e-12):
            return self.radius - largest
        import numpy as np

        unit = max(self.radius, largest)  # so that no sum overflows; not finite only if the harmonics are absurd
        if not math.isfinite(unit):
            return -math.inf
        waves = np.zeros(32 * (len(self.harmonics) + 1) + 1, dtype=complex)
        waves[0] = self.radius / unit
        waves[1 : len(self.harmonics) + 1] = [complex(c / unit, -s / unit) / 2.0 for c, s in self.harmonics]
        return float(np.fft.irfft(waves, norm="forward").min()) * unit

    def values(self, at: Seen) -> list[Any]:
        """``|d| = rho(psi)``, psi the direction of d seen from link a."""
        return [at.plane.length(at.d) - self._wave(at)[0]]

    def gradients(self, at: Seen) -> list[Gradient]:
        """Return the derivatives; the pitch curve turns with link a."""
        length, first = at.plane.length(at.d), self._wave(at)[1]
        radial = at.d * (1.0 / length)
        return [Gradient(radial - at.plane.left(radial) * (first / length), first)]

    def _wave(self, at: Seen) -> tuple[Any, Any]:
        """Radius of the pitch curve in the direction of d and its derivative, in any arithmetic."""
        psi = at.plane.argument(at.d) - at.angle_a - self.angle_a
        value, first = psi * 0.0 + self.radius, psi * 0.0
        for k, (c, s) in enumerate(self.harmonics, 1):
            cosine, sine = at.plane.parts(at.plane.unit(psi * k))
            value = value + cosine * c + sine * s
            first = first + (cosine * s - sine * c) * k
        return value, first

    @checked
    def pitch_radius(self, psi: float) -> tuple[float, float, float]:
        """Radius of the pitch curve at ``psi`` (radians from ``angle_a``) and its first two derivatives."""
        value, first, second = self.radius, 0.0, 0.0
        for k, (c, s) in enumerate(self.harmonics, 1):
            cosine, sine = math.cos(k * psi), math.sin(k * psi)
            value += c * cosine + s * sine
            first += k * (s * cosine - c * sine)
            second -= k * k * (c * cosine + s * sine)
        return value, first, second


def _across(at: Seen, angle: float) -> Gradient:
    """Return the derivatives of ``t x d`` for the direction t of a line on link a."""
    t = at.line(angle)
    return Gradient(at.plane.left(t), at.plane.dot(t, at.d) * -1.0)


JointGeometry = Revolute | Prismatic | PinSlot | Gear | Cam  #: The five kinds of joints.

#: Class by kind, for readers.
KINDS: dict[str, Any] = {joint.kind: joint for joint in (Revolute, Prismatic, PinSlot, Gear, Cam)}
