"""Drives of the lower platform of a tribometer: crank and rod, pure cosine, belt."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import check_fields, finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.dynamics.friction.laws import finite, positive

Array = NDArray[np.float64]


class DriveMotion(NamedTuple):
    """Displacement (m), velocity (m/s), acceleration (m/s^2) and jerk (m/s^3) of the lower platform."""

    x: Array
    v: Array
    a: Array
    j: Array


class Drive(ABC):
    """Base of the drives: ``motion(t)`` and ``period`` (infinite for a belt)."""

    speed: float

    @property
    def period(self) -> float:
        """Time of one turn of the crank, s."""
        return math.tau / abs(self.speed)

    @abstractmethod
    def motion(self, t: ArrayLike) -> DriveMotion:
        """Motion of the lower platform at the times ``t``."""

    @abstractmethod
    def _packed(self) -> tuple[float, float, float, float]:
        """Return kind, radius, rod, speed: entries 10 to 13 of the kernels' data."""


def _turning(speed: float) -> float:
    number = finite("crank speed", speed)
    if number == 0.0:
        raise GeometryError("The crank speed is 0; the drive has to turn, give a speed in rad/s other than zero.")
    return number


@dataclass(frozen=True)
class BeltDrive(Drive):
    """Lower platform that moves with the constant velocity ``speed``, m/s.

    Examples
    --------
    >>> float(BeltDrive(0.02).motion(3.0).x)
    0.06
    """

    speed: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "speed", finite("belt speed", self.speed))
        check_fields(self, (), small=("speed",))

    @property
    def period(self) -> float:
        """Infinite: a belt does not repeat."""
        return math.inf

    def motion(self, t: ArrayLike) -> DriveMotion:
        """Motion of the lower platform at the times ``t``; exact."""
        t = finite_array("t", t, nan=True)
        zero = np.zeros_like(t)
        return DriveMotion(self.speed * t, zero + self.speed, zero, zero)

    def _packed(self) -> tuple[float, float, float, float]:
        return 0.0, 1.0, 2.0, self.speed


@dataclass(frozen=True)
class HarmonicDrive(Drive):
    """Lower platform at ``radius cos(speed t)``: the sine of the source's block diagram.

    Parameters
    ----------
    radius : float
        Amplitude, m.
    speed : float
        Angular speed, rad/s.

    Raises
    ------
    SpecError, GeometryError
        If the radius is not positive or the speed is zero.

    Examples
    --------
    >>> float(HarmonicDrive(0.03, 2.0).motion(0.0).a)
    -0.12
    """

    radius: float
    speed: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", positive("radius", self.radius))
        object.__setattr__(self, "speed", _turning(self.speed))
        check_fields(self, ("radius", "speed"))

    def motion(self, t: ArrayLike) -> DriveMotion:
        """Motion of the lower platform at the times ``t``; exact but for rounding."""
        w = self.speed
        theta = w * finite_array("t", t, nan=True)
        C, S = self.radius * np.cos(theta), self.radius * np.sin(theta)
        return DriveMotion(C, -w * S, -w * w * C, w**3 * S)

    def _packed(self) -> tuple[float, float, float, float]:
        return 1.0, self.radius, 2.0 * self.radius, self.speed


@dataclass(frozen=True)
class CrankDrive(Drive):
    """Lower platform driven by a crank and a connecting rod, ``x1 = r cos(wt) + sqrt(l^2 - r^2 sin^2(wt)) - l``.

    Parameters
    ----------
    radius, rod : float
        Crank radius and length of the connecting rod, m; the rod must be longer.
    speed : float
        Crank speed, rad/s.

    Raises
    ------
    SpecError, GeometryError
        If a length is not positive, the rod is not longer than the crank, or the speed is zero.

    Examples
    --------
    >>> float(CrankDrive(0.03, 0.12, 2.0).motion(0.0).x)
    0.03
    """

    radius: float
    rod: float
    speed: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", positive("crank radius", self.radius))
        object.__setattr__(self, "rod", positive("length of the connecting rod", self.rod))
        object.__setattr__(self, "speed", _turning(self.speed))
        check_fields(self, ("radius", "rod", "speed"))
        if not self.radius < self.rod:
            raise GeometryError(
                f"The crank radius {self.radius:g} m is not below the length of the connecting rod, {self.rod:g} m; "
                "the crank could not turn: shorten the crank or lengthen the rod."
            )

    def motion(self, t: ArrayLike) -> DriveMotion:
        """Motion of the lower platform at the times ``t``; closed form."""
        r, rod, w = self.radius, self.rod, self.speed
        theta = w * finite_array("t", t, nan=True)
        C, S = np.cos(theta), np.sin(theta)
        gap = (rod - r) * (rod + r)
        square = gap + (r * C) ** 2  # nothing cancels where the crank stands across a rod hardly longer than itself
        q = np.sqrt(square)
        a = r * r * S * C / q
        return DriveMotion(
            r * C - (r * S) ** 2 / (q + rod),
            w * (-r * S - a),
            w * w * (-r * C + r * r * (gap * S * S / square - C * C) / q),
            w**3 * (r * S + a * (1.0 + 3.0 * gap * rod * rod / (square * square))),
        )

    def _packed(self) -> tuple[float, float, float, float]:
        return 2.0, self.radius, self.rod, self.speed
