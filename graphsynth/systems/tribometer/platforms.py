"""Both platforms of a tribometer as data: the drive of the lower one, spring, damper and friction of the upper one."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from typing import NamedTuple, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import check_fields, finite, finite_array, not_negative, positive
from graphsynth.core.errors import GeometryError, SpecError

Array = NDArray[np.float64]
Speed = TypeVar("Speed", float, Array)


class FrictionLaw(ABC):
    """Base of the laws: ``coefficient`` and ``slope`` over the sliding speed ``v >= 0``, ``static`` at rest."""

    static: float
    kinetic: float
    viscous: float

    def _check(self, *more: str) -> None:
        """Check the coefficients, which all laws have; ``more`` are the names of further numbers above zero."""
        for name, check in (("static", positive), ("kinetic", not_negative), ("viscous", not_negative)):
            value = check(f"{name} friction coefficient", getattr(self, name), SpecError)
            object.__setattr__(self, name, value)
        if self.kinetic > self.static:
            raise SpecError(
                f"The kinetic friction coefficient {self.kinetic:g} is above the static one, {self.static:g}; "
                "swap them, or give the static one at least the same value."
            )
        check_fields(self, ("static", *more), SpecError, small=("kinetic", "viscous"))

    @abstractmethod
    def _weakening(self, v: Array) -> tuple[Array, Array]:
        """Return the part above the kinetic coefficient, and its slope."""

    def coefficient(self, v: Speed) -> Speed:
        """Friction coefficient while slipping at the speed ``v >= 0``, m/s, a number or an array."""
        speed = np.asarray(v, float)
        found = np.asarray(self.kinetic + self._weakening(speed)[0] + self.viscous * speed)
        return found if found.ndim else float(found)  # type: ignore[return-value]

    def slope(self, v: Speed) -> Speed:
        """Return the derivative of the coefficient by the sliding speed, s/m; negative where friction weakens."""
        found = np.asarray(self._weakening(np.asarray(v, float))[1] + self.viscous)
        return found if found.ndim else float(found)  # type: ignore[return-value]

    @abstractmethod
    def _packed(self) -> tuple[float, float, float, float, float, float]:
        """Return static, kinetic, Stribeck velocity, exponent, viscous, kind: entries 4 to 9 of the kernels' data."""


@dataclass(frozen=True)
class TwoCoefficientLaw(FrictionLaw):
    """One coefficient at rest, another while slipping (Coulomb's law if they are equal).

    ``0 <= kinetic <= static``, ``static > 0``, or a `SpecError` is raised; the part ``viscous`` (s/m) grows with the
    sliding speed.

    Examples
    --------
    >>> TwoCoefficientLaw(0.4, 0.25).coefficient(0.1)
    0.25
    """

    static: float
    kinetic: float
    viscous: float = 0.0

    def __post_init__(self) -> None:
        self._check()

    def _weakening(self, v: Array) -> tuple[Array, Array]:
        return np.zeros_like(v), np.zeros_like(v)

    def _packed(self) -> tuple[float, float, float, float, float, float]:
        return self.static, self.kinetic, 1.0, 1.0, self.viscous, 0.0


@dataclass(frozen=True)
class StribeckLaw(FrictionLaw):
    """Friction that falls from the static to the kinetic coefficient as the sliding speed grows.

    ``mu(v) = kinetic + (static - kinetic) exp(-(v/velocity)^exponent) + viscous v`` with the Stribeck velocity (m/s),
    an exponent of at least 1, and ``viscous`` in s/m; coefficients as for a `TwoCoefficientLaw`.

    Examples
    --------
    >>> StribeckLaw(0.4, 0.25, velocity=0.02).coefficient(0.0)
    0.4
    """

    static: float
    kinetic: float
    velocity: float
    exponent: float = 2.0
    viscous: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "velocity", positive("Stribeck velocity", self.velocity, SpecError))
        object.__setattr__(self, "exponent", finite("Stribeck exponent", self.exponent, SpecError))
        if self.exponent < 1.0:
            raise SpecError(f"The Stribeck exponent is {self.exponent:g}; it must be at least 1.")
        self._check("velocity", "exponent")

    def _weakening(self, v: Array) -> tuple[Array, Array]:
        z, d = v / self.velocity, self.exponent
        part = (self.static - self.kinetic) * np.exp(-(z**d))
        return part, -part * d * z ** (d - 1.0) / self.velocity

    def _packed(self) -> tuple[float, float, float, float, float, float]:
        return self.static, self.kinetic, self.velocity, self.exponent, self.viscous, 1.0


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

    def _check(self, *lengths: tuple[str, str]) -> None:
        """Check lengths, pairs of field and name in messages, and the speed of a crank, which has to turn."""
        for field_name, name in lengths:
            object.__setattr__(self, field_name, positive(name, getattr(self, field_name), SpecError))
        object.__setattr__(self, "speed", finite("crank speed", self.speed, SpecError))
        if self.speed == 0.0:
            raise GeometryError("The crank speed is 0; the drive has to turn, give a speed in rad/s other than zero.")
        check_fields(self, (*(name for name, _ in lengths), "speed"))

    @abstractmethod
    def motion(self, t: ArrayLike) -> DriveMotion:
        """Motion of the lower platform at the times ``t``, closed form."""

    @abstractmethod
    def _packed(self) -> tuple[float, float, float, float]:
        """Return kind, radius, rod, speed: entries 10 to 13 of the kernels' data."""


@dataclass(frozen=True)
class BeltDrive(Drive):
    """Lower platform that moves with the constant velocity ``speed``, m/s."""

    speed: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "speed", finite("belt speed", self.speed, SpecError))
        check_fields(self, (), small=("speed",))

    @property
    def period(self) -> float:
        """Infinite: a belt does not repeat."""
        return math.inf

    def motion(self, t: ArrayLike) -> DriveMotion:
        """See `Drive`; exact."""
        t = finite_array("t", t, nan=True)
        zero = np.zeros_like(t)
        return DriveMotion(self.speed * t, zero + self.speed, zero, zero)

    def _packed(self) -> tuple[float, float, float, float]:
        return 0.0, 1.0, 2.0, self.speed


@dataclass(frozen=True)
class HarmonicDrive(Drive):
    """Lower platform at ``radius cos(speed t)`` (m, rad/s): the sine of the source's block diagram.

    `SpecError` or `GeometryError` if the radius is not positive or the speed is zero.

    Examples
    --------
    >>> float(HarmonicDrive(0.03, 2.0).motion(0.0).a)
    -0.12
    """

    radius: float
    speed: float

    def __post_init__(self) -> None:
        self._check(("radius", "radius"))

    def motion(self, t: ArrayLike) -> DriveMotion:
        """See `Drive`; exact but for rounding."""
        w = self.speed
        theta = w * finite_array("t", t, nan=True)
        C, S = self.radius * np.cos(theta), self.radius * np.sin(theta)
        return DriveMotion(C, -w * S, -w * w * C, w**3 * S)

    def _packed(self) -> tuple[float, float, float, float]:
        return 1.0, self.radius, 2.0 * self.radius, self.speed


@dataclass(frozen=True)
class CrankDrive(Drive):
    """Lower platform driven by a crank and a connecting rod, ``x1 = r cos(wt) + sqrt(l^2 - r^2 sin^2(wt)) - l``.

    In m and rad/s.  `SpecError` or `GeometryError` if a length is not positive, the rod is not longer than the crank,
    or the speed is zero.

    Examples
    --------
    >>> float(CrankDrive(0.03, 0.12, 2.0).motion(0.0).x)
    0.03
    """

    radius: float
    rod: float
    speed: float

    def __post_init__(self) -> None:
        self._check(("radius", "crank radius"), ("rod", "length of the connecting rod"))
        if not self.radius < self.rod:
            raise GeometryError(
                f"The crank radius {self.radius:g} m is not below the length of the connecting rod, {self.rod:g} m; "
                "the crank could not turn: shorten the crank or lengthen the rod."
            )

    def motion(self, t: ArrayLike) -> DriveMotion:
        """See `Drive`."""
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


@dataclass(frozen=True)
class Platforms:
    """Data of a tribometer and what follows from them at once; see `graphsynth.systems.tribometer.model.Tribometer`."""

    mass: float = 1.0
    stiffness: float = 400.0
    damping: float = 2.0
    load: float = 0.0
    gravity: float = 9.81
    law: FrictionLaw = field(default_factory=lambda: StribeckLaw(0.40, 0.25, 0.02))
    drive: Drive = field(default_factory=lambda: CrankDrive(0.03, 0.12, 2.0))
    x2: float = 0.0
    v2: float | None = None

    def __post_init__(self) -> None:
        for name, value in (
            ("mass", positive("mass", self.mass, SpecError)),
            ("stiffness", positive("spring stiffness", self.stiffness, SpecError)),
            ("damping", not_negative("damping", self.damping, SpecError)),
            ("load", finite("load", self.load, SpecError)),
            ("gravity", not_negative("gravity", self.gravity, SpecError)),
            ("x2", finite("initial position", self.x2, SpecError)),
            ("v2", None if self.v2 is None else finite("initial velocity", self.v2, SpecError)),
        ):
            object.__setattr__(self, name, value)
        check_fields(self, ("mass", "stiffness"), SpecError, small=("damping", "load", "gravity", "x2", "v2"))
        if not isinstance(self.law, FrictionLaw):
            raise SpecError(f"The friction law is {self.law!r}; give a TwoCoefficientLaw or a StribeckLaw.")
        if not isinstance(self.drive, Drive):
            raise SpecError(f"The drive is {self.drive!r}; give a CrankDrive, a HarmonicDrive or a BeltDrive.")
        if not self.normal > 0.0:
            raise SpecError(
                f"The normal force is {self.normal:g} N; the platforms separate: "
                "raise the load so that mass * gravity + load is greater than zero."
            )

    @property
    def normal(self) -> float:
        """Normal force ``N = m g + P``, N."""
        return self.mass * self.gravity + self.load

    @property
    def frequency(self) -> float:
        """Natural angular frequency ``sqrt(k/m)``, rad/s."""
        return math.sqrt(self.stiffness / self.mass)

    @property
    def reach(self) -> float:
        """Natural scale of the displacement, ``mu_s N / k``, m."""
        return self.law.static * self.normal / self.stiffness

    @property
    def closed_form(self) -> bool:
        """Whether slip pieces have a closed form (two coefficients, no viscous part)."""
        return isinstance(self.law, TwoCoefficientLaw) and self.law.viscous == 0.0

    def stiffened(self, factor: float, *, scaled_damping: bool = True) -> Self:
        """Return the same with the stiffness times ``factor``; with ``scaled_damping`` the damping ratio stays."""
        factor = positive("factor on the stiffness", factor, SpecError)
        damping = self.damping * math.sqrt(factor) if scaled_damping else self.damping
        return replace(self, stiffness=self.stiffness * factor, damping=damping)

    def limit_force(self, times: ArrayLike) -> Array:
        """Spring force over the normal force in the limit of a stiff, damped spring, ``sgn(v1) mu(|v1|)``.

        The averaged limit to which ``k x2 / N`` tends (theory/tribometer 11).
        """
        v = self.drive.motion(times).v
        return np.asarray(np.sign(v) * self.law.coefficient(np.abs(v)))

    def data(self) -> Array:
        """Return the data of the kernels."""
        return np.array(
            [self.mass, self.stiffness, self.damping, self.normal, *self.law._packed(), *self.drive._packed()]
        )

    def start(self) -> tuple[float, float]:
        """Return the initial velocity and the state of the contact."""
        begin = self.drive.motion(0.0)
        v1, a1 = float(begin.v), float(begin.a)
        v = v1 if self.v2 is None else self.v2
        if v != v1:
            return v, math.copysign(1.0, v1 - v)
        force = self.mass * a1 + self.stiffness * self.x2 + self.damping * v1
        return v, 0.0 if abs(force) <= self.law.static * self.normal else math.copysign(1.0, force)
