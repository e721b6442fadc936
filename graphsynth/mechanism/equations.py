"""Joint equations in any arithmetic: floats, balls, intervals, duals, numbers of many digits, formulas.

Every kind of joint states its equations once (`graphsynth.mechanism.joints`), over a `Plane` of numbers and vectors:
that of numpy arrays here, of balls in `graphsynth.kinematics.certify`, and of any type of number with functions of its
own: intervals, duals, mpmath, sympy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

#: A number, and a vector of the plane, of the arithmetic in use.
Number = Any
Vector = Any


@dataclass(frozen=True, slots=True)
class Pair:
    """A vector of two numbers of any type."""

    x: Number
    y: Number

    def __add__(self, other: Pair) -> Pair:
        return Pair(self.x + other.x, self.y + other.y)

    def __sub__(self, other: Pair) -> Pair:
        return Pair(self.x - other.x, self.y - other.y)

    def __mul__(self, other: Number) -> Pair:
        return Pair(self.x * other, self.y * other)


@dataclass(frozen=True)
class Plane:
    """Any type of number, with its sine, cosine, distance ``hypot(x, y)`` and angle ``atan2(y, x)``; and vectors of it.

    Sums of vectors, and products with numbers, are written with operators.
    """

    sin: Callable[[Number], Number]
    cos: Callable[[Number], Number]
    hypot: Callable[[Number, Number], Number]
    atan2: Callable[[Number, Number], Number]

    def vector(self, x: Number, y: Number) -> Vector:
        """Vector of two numbers, plain floats among them."""
        return Pair(x, y)

    def parts(self, v: Vector) -> tuple[Number, Number]:
        """Both components."""
        return v.x, v.y

    def unit(self, angle: Number) -> Vector:
        """Direction of an angle."""
        return Pair(self.cos(angle), self.sin(angle))

    def turned(self, v: Vector, by: Vector) -> Vector:
        """``v`` turned by the direction of a unit vector."""
        return Pair(by.x * v.x - by.y * v.y, by.y * v.x + by.x * v.y)

    def left(self, v: Vector) -> Vector:
        """``v`` turned to the left by a right angle."""
        return Pair(-v.y, v.x)

    def dot(self, a: Vector, b: Vector) -> Number:
        """Scalar product."""
        return a.x * b.x + a.y * b.y

    def cross(self, a: Vector, b: Vector) -> Number:
        """Component of ``a x b`` across the plane."""
        return a.x * b.y - a.y * b.x

    def length(self, v: Vector) -> Number:
        """Length of a vector."""
        return self.hypot(v.x, v.y)

    def argument(self, v: Vector) -> Number:
        """Angle of a vector, up to whole turns."""
        return self.atan2(v.y, v.x)


#: Arrays of floats.
FLOATS = Plane(np.sin, np.cos, np.hypot, np.arctan2)


@dataclass(frozen=True)
class Seen:
    """The two links of a joint in some arithmetic: what its equations are written in.

    The angles of the links; ``axis_a``, the direction of the x axis of link a; the arms, from the origin of each link
    to the joint's point of it; ``d``, from the joint's point of a to that of b.
    """

    plane: Plane
    angle_a: Number
    angle_b: Number
    axis_a: Vector
    arm_a: Vector
    arm_b: Vector
    d: Vector

    def line(self, angle: float) -> Vector:
        """Direction of a line fixed on link a."""
        return self.plane.turned(self.plane.unit(angle), self.axis_a)


class Gradient(NamedTuple):
    """Derivatives of one equation by the vector d and by the angles of links a and b; None for zero."""

    by_d: Vector | None
    by_a: Number | None = None
    by_b: Number | None = None


def seen(plane: Plane, joint: Any, a: tuple[Number, Number, Number], b: tuple[Number, Number, Number]) -> Seen:
    """Place the two links of a joint at poses ``(x, y, theta)``."""
    axes = [plane.unit(pose[2]) for pose in (a, b)]
    arms = [plane.turned(plane.vector(*at), axis) for axis, at in zip(axes, (joint.at_a, joint.at_b))]
    d = plane.vector(b[0], b[1]) + arms[1] - (plane.vector(a[0], a[1]) + arms[0])
    return Seen(plane, a[2], b[2], axes[0], arms[0], arms[1], d)


def derivatives(at: Seen, rows: Sequence[Gradient]) -> list[tuple[list[Number | None], list[Number | None]]]:
    """Return the derivatives of equations by ``x, y, theta`` of link a and of link b; None for zero."""
    found = []
    for by_d, by_a, by_b in rows:
        if by_d is None:
            found.append(([None, None, by_a], [None, None, by_b]))
            continue
        x, y = at.plane.parts(by_d)
        turn_a, turn_b = (at.plane.dot(by_d, at.plane.left(arm)) for arm in (at.arm_a, at.arm_b))
        own = [-x, -y, -turn_a if by_a is None else by_a - turn_a]
        found.append((own, [x, y, turn_b if by_b is None else by_b + turn_b]))
    return found
