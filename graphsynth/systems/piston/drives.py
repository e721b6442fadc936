"""The first group: crank-slider (RRP) and Scotch yoke (RPP), in closed form with two derivatives by the crank angle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import check_fields, finite, positive
from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.joints import JointGeometry, Prismatic, Revolute

Array = NDArray[np.float64]


class Derivatives(NamedTuple):
    """A coordinate over the crank angle with two derivatives by it, each of the shape of the angle."""

    value: Array
    first: Array
    second: Array

    def mapped(self, factor: float, constant: float) -> Derivatives:
        """Return ``constant + factor * value`` with its derivatives."""
        return Derivatives(constant + factor * self.value, factor * self.first, factor * self.second)


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
        Lengths that are not positive; a rod that is too short for a full turn.

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
        for name in ("crank", "rod"):
            object.__setattr__(self, name, positive(f"{name} of the crank-slider", getattr(self, name)))
        object.__setattr__(self, "offset", finite("offset of the crank-slider", self.offset))
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
        second = -(z.first**2 + z.value * z.second + first**2) / q
        return z, Derivatives(q, first, second)

    def crosshead(self, phi: ArrayLike) -> Derivatives:
        """Place of the crosshead's pin along its guide, counted from the foot of the crank's centre, m."""
        angle = np.asarray(phi, dtype=np.float64)
        c, s = self.crank * np.cos(angle), self.crank * np.sin(angle)
        q = self._across(angle)[1]
        b = float(self.branch)
        return Derivatives(c + b * q.value, -s + b * q.first, -c + b * q.second)

    def follower(self, phi: ArrayLike) -> Derivatives:
        """Angle of the rod, from crank pin to crosshead pin, against the guide, radians."""
        z, q = self._across(phi)
        x = self.branch * q.value
        first = -z.first / x
        lean = np.arctan2(-z.value, q.value)
        value = lean if self.branch > 0 else math.pi - lean  # continuous: it never passes the cut at pi
        return Derivatives(value, first, -z.second / x + z.first * q.first / (x * q.value))

    def dead_centres(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Crank angle in [0, 2 pi) and crosshead's place at the outer (farthest along +x) and the inner one; exact."""
        far, near = self.rod + self.crank, self.rod - self.crank
        e, b = self.offset, self.branch
        x = [math.sqrt((length - e) * (length + e)) for length in (far, near)]
        stretched = (math.atan2(e, b * x[0]), b * x[0])
        folded = (math.atan2(-e, -b * x[1]), b * x[1])
        outer, inner = (stretched, folded) if b > 0 else (folded, stretched)
        turn = 2.0 * math.pi
        return (outer[0] % turn, outer[1]), (inner[0] % turn, inner[1])

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
        m.
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
    branch: ClassVar[int] = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "crank", positive("crank of the Scotch yoke", self.crank))
        for name in ("offset", "yoke_angle"):
            object.__setattr__(self, name, finite(f"{name} of the Scotch yoke", getattr(self, name)))
        check_fields(self, ("crank",), small=("offset",))
        if not math.sin(self.yoke_angle) > 1e-9:
            raise GeometryError(
                f"yoke_angle = {self.yoke_angle:.6g} rad must lie between 0 and pi, best at pi/2: a slot parallel to "
                "the guide does not drive the yoke"
            )

    def crosshead(self, phi: ArrayLike) -> Derivatives:
        """Place of the yoke along its guide, m: where its slot crosses the guide's axis."""
        amplitude = self.crank / math.sin(self.yoke_angle)
        mean = self.offset * math.cos(self.yoke_angle) / math.sin(self.yoke_angle)
        turn = self.yoke_angle - np.asarray(phi, dtype=np.float64)
        wave = amplitude * np.sin(turn)
        return Derivatives(mean + wave, -amplitude * np.cos(turn), -wave)

    def follower(self, phi: ArrayLike) -> Derivatives:
        """Place of the block along the yoke's slot, counted from the guide's axis, m."""
        angle = np.asarray(phi, dtype=np.float64)
        c, s = self.crank * np.cos(angle), self.crank * np.sin(angle)
        return Derivatives(s - self.offset, c, -s).mapped(1.0 / math.sin(self.yoke_angle), 0.0)

    def dead_centres(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Crank angle in [0, 2 pi) and yoke's place at the outer and the inner dead centre; exact."""
        amplitude = self.crank / math.sin(self.yoke_angle)
        mean = self.offset * math.cos(self.yoke_angle) / math.sin(self.yoke_angle)
        turn = 2.0 * math.pi
        quarter = 0.5 * math.pi
        return (
            ((self.yoke_angle - quarter) % turn, mean + amplitude),
            ((self.yoke_angle + quarter) % turn, mean - amplitude),
        )

    def joints(self) -> list[JointGeometry]:
        """Joints of links 0..3: frame, crank, block, yoke."""
        return [
            Revolute(0, 1),
            Revolute(1, 2, (self.crank, 0.0)),
            Prismatic(3, 2, angle_a=self.yoke_angle, angle_b=self.yoke_angle),
            Prismatic(0, 3, (0.0, self.offset)),
        ]
