"""Poses as a user gives them, exactly, and their displacements from the first one as balls of python-flint."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import Any

import flint
import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import SMALLEST, finite
from graphsynth.core.errors import GeometryError
from graphsynth.intervals.reading import ball, rational

Array = NDArray[np.float64]
#: An angle as an exact number: radians, or whole turns of which sines and cosines may be rational.
Angle = tuple[Fraction, bool]
_DEGREES = re.compile(r"\s*(\S+?)\s*(deg|°)\s*")


def read_angle(name: str, value: Any) -> Angle:
    """Read radians, or a text such as "30 deg", which is exactly that."""
    if isinstance(value, str) and (match := _DEGREES.fullmatch(value)):
        return rational(name, match[1]) / 360, True
    if isinstance(value, str):
        value = value.removesuffix("rad").strip()
    elif not isinstance(value, Fraction):
        finite(name, value)
    return rational(name, value), False


def radians(angle: Angle) -> float:
    """Return the nearest double, or one beside it."""
    return math.tau * float(angle[0]) if angle[1] else float(angle[0])


def direction(angle: Angle, before: Angle = (Fraction(0), False)) -> Any:
    """Enclose ``exp(i (angle - before))``; a rotation by nothing is exactly one."""
    if angle[1] == before[1] or 0 in (angle[0], before[0]):
        turns = angle[1] if angle[0] else before[1]
        difference = angle[0] - before[0]
        s, c = (
            flint.arb.sin_cos_pi_fmpq(flint.fmpq(2 * difference.numerator, difference.denominator))
            if turns
            else ball(difference).sin_cos()
        )
        return flint.acb(c, s)
    return direction(angle) * direction(before).conjugate()


@dataclass(frozen=True)
class Task:
    """Poses as exact numbers: places, angles, and the size of the task as a power of two."""

    x: tuple[Fraction, ...]
    y: tuple[Fraction, ...]
    angle: tuple[Angle, ...]
    unit: Fraction

    def __len__(self) -> int:
        return len(self.x)

    @property
    def poses(self) -> Array:
        """The poses as doubles, shape (n, 3)."""
        return np.array([[float(x), float(y), radians(a)] for x, y, a in zip(self.x, self.y, self.angle)])

    def displacements(self, inverse: bool = False) -> list[tuple[Any, Any]]:
        """Rotation ``u`` and translation ``d`` (in units) from the first pose to each of the others.

        A point at w in the first pose, counted from the place of that pose, is at ``u w + d`` in the other.  The
        inverse moves what is fixed, as seen from the link.
        """
        found = []
        for x, y, angle in zip(self.x[1:], self.y[1:], self.angle[1:]):
            u = direction(angle, self.angle[0])
            d = flint.acb(ball((x - self.x[0]) / self.unit), ball((y - self.y[0]) / self.unit))
            found.append((u.conjugate(), -u.conjugate() * d) if inverse else (u, d))
        return found

    def to_first(self, place: Sequence[Any], in_link: bool = False) -> Any:
        """Enclose a point of the frame, or of the link in its own frame, in units from the first pose's place."""
        x, y = (rational(f"coordinate {value!r}", value) for value in place)
        if in_link:
            return flint.acb(ball(x / self.unit), ball(y / self.unit)) * direction(self.angle[0])
        return flint.acb(ball((x - self.x[0]) / self.unit), ball((y - self.y[0]) / self.unit))

    def from_first(self, place: Any, in_link: bool = False) -> Any:
        """Undo `to_first`: a ball in the length of the poses."""
        unit = ball(self.unit)
        if in_link:
            return place * direction(self.angle[0]).conjugate() * unit
        return place * unit + flint.acb(ball(self.x[0]), ball(self.y[0]))


def read_poses(poses: Any, least: int = 2, most: int = 5, differ: bool = True) -> Task:
    """Read poses (x, y, angle); `GeometryError` for another number of them, or two that are the same."""
    if isinstance(poses, Task):
        return poses
    try:
        rows = [tuple(row) for row in poses]
    except TypeError as error:
        raise GeometryError(f"poses = {poses!r} is not a list of (x, y, angle)") from error
    if not least <= len(rows) <= most:
        raise GeometryError(f"{len(rows)} poses are given; give {least} to {most}")
    for k, row in enumerate(rows, 1):
        if len(row) != 3:
            raise GeometryError(f"pose {k} = {row!r} has {len(row)} entries; give (x, y, angle)")
    x = tuple(rational(f"x of pose {k}", row[0]) for k, row in enumerate(rows, 1))
    y = tuple(rational(f"y of pose {k}", row[1]) for k, row in enumerate(rows, 1))
    angle = tuple(read_angle(f"angle of pose {k}", row[2]) for k, row in enumerate(rows, 1))
    for (k, one), (j, other) in combinations(enumerate(zip(x, y, angle), 1), 2) if differ else ():
        turn, whole = one[2][0] - other[2][0], one[2][1]
        if one[:2] == other[:2] and whole == other[2][1] and (turn == 0 or (whole and turn % 1 == 0)):
            raise GeometryError(f"poses {k} and {j} are the same; leave one of them out")
    size = max((abs(v - a[0]) for a in (x, y) for v in a), default=Fraction(0))
    if size and not Fraction(SMALLEST) <= size <= 1 / Fraction(SMALLEST):
        raise GeometryError(f"the poses are {float(size):g} apart, not between 1e-60 and 1e60; change the unit")
    power = size.numerator.bit_length() - size.denominator.bit_length() if size else 0
    return Task(x, y, angle, Fraction(2) ** power)
