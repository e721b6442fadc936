"""What acts on the bodies: springs, dampers, forces, torques, drives through a train, friction in joints.

Points are given in link frames.  A callable force or torque must be smooth between its ``breaks`` (times); whatever a
force or torque does is counted as work of non-conservative loads, whether or not it has a potential.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

from graphsynth.core.checks import Point, finite, link_number, not_negative, point, positive
from graphsynth.core.errors import GeometryError
from graphsynth.dynamics.motors import (
    DCMotor,
    IdealTorque,
    LinearCharacteristic,
    Motor,
    SynchronousMotor,
    Train,
    electric,
)

#: (t, place, velocity of the point) -> (fx, fy), world coordinates.
ForceLaw = Callable[[float, Point, Point], Sequence[float]]
#: (t, relative angle, relative speed) -> torque.
TorqueLaw = Callable[[float, float, float], float]


def _pair(element: Any, what: str) -> None:
    for name in ("a", "b"):
        object.__setattr__(element, name, link_number(f"link {name} of a {what}", getattr(element, name)))
    if element.a == element.b:
        raise GeometryError(f"a {what} between link {element.a} and itself does nothing; name two links")


def _times(element: Any) -> None:
    given = getattr(element, "breaks", ())
    if not isinstance(given, Iterable):
        raise GeometryError(f"breaks = {given!r} are not a list of times; leave them out or give ()")
    object.__setattr__(element, "breaks", tuple(finite("break", t) for t in given))


@dataclass(frozen=True)
class Spring:
    """Spring and damper between a point of link a and a point of link b (theory/planar-dynamics 3).

    ``f = stiffness (l - free_length) + damping dl/dt`` pulls the points together; N/m, m, N s/m.
    """

    a: int
    b: int
    at_a: Point = (0.0, 0.0)
    at_b: Point = (0.0, 0.0)
    stiffness: float = 0.0
    free_length: float = 0.0
    damping: float = 0.0

    def __post_init__(self) -> None:
        _pair(self, "spring")
        for name in ("at_a", "at_b"):
            object.__setattr__(self, name, point(f"{name} of a spring", getattr(self, name)))
        for name in ("stiffness", "free_length", "damping"):
            object.__setattr__(self, name, not_negative(f"{name} of spring {self.a}-{self.b}", getattr(self, name)))


@dataclass(frozen=True)
class TorsionSpring:
    """Torsional spring and damper between links a and b.

    ``torque = stiffness (theta_b - theta_a - free_angle) + damping (omega_b - omega_a)`` acts on a, its opposite on b;
    N m/rad, rad, N m s.
    """

    a: int
    b: int
    stiffness: float = 0.0
    free_angle: float = 0.0
    damping: float = 0.0

    def __post_init__(self) -> None:
        _pair(self, "torsion spring")
        name = f"of torsion spring {self.a}-{self.b}"
        object.__setattr__(self, "free_angle", finite(f"free_angle {name}", self.free_angle))
        for part in ("stiffness", "damping"):
            object.__setattr__(self, part, not_negative(f"{part} {name}", getattr(self, part)))


@dataclass(frozen=True)
class Force:
    """Force at a point of a link: constant, or a function ``(t, place, velocity) -> (fx, fy)`` in world coordinates.

    ``frame="body"`` turns a constant force with the link.

    Raises
    ------
    GeometryError
        A frame other than "world" or "body", numbers that are not finite.
    """

    link: int
    force: Point | ForceLaw
    at: Point = (0.0, 0.0)
    frame: Literal["world", "body"] = "world"
    breaks: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "link", link_number("link of a force", self.link))
        object.__setattr__(self, "at", point("point of a force", self.at))
        if not isinstance(self.frame, str) or self.frame not in ("world", "body"):
            raise GeometryError(f"frame = {self.frame!r} of a force is not known; give 'world' or 'body'")
        if not callable(self.force):
            object.__setattr__(self, "force", point(f"force on link {self.link}", self.force))
        _times(self)


@dataclass(frozen=True)
class Torque:
    """Torque on link b, its opposite on link a: constant, or a function ``(t, angle, speed) -> torque``.

    Angle and speed are those of b relative to a.
    """

    a: int
    b: int
    torque: float | TorqueLaw
    breaks: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        _pair(self, "torque")
        if not callable(self.torque):
            object.__setattr__(self, "torque", finite(f"torque {self.a}-{self.b}", self.torque))
        _times(self)
        object.__setattr__(self, "breaks", (*self.breaks, *getattr(self.torque, "breaks", ())))
        _times(self)


@dataclass(frozen=True)
class Pulse:
    """A rectangular pulse in time; its edges are breaks, so no step runs over them.

    >>> Pulse(0.1, 1e-6, 50.0).breaks
    (0.1, 0.100001)
    """

    start: float
    duration: float
    height: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", finite("start of a pulse", self.start))
        object.__setattr__(self, "duration", positive("duration of a pulse", self.duration))
        object.__setattr__(self, "height", finite("height of a pulse", self.height))

    @property
    def breaks(self) -> tuple[float, float]:
        """Times of the two edges."""
        return self.start, self.start + self.duration

    def __call__(self, t: float, angle: float = 0.0, speed: float = 0.0) -> float:
        """Height inside the pulse, 0 outside."""
        return self.height if self.breaks[0] <= t < self.breaks[1] else 0.0


@dataclass(frozen=True)
class TorqueSource:
    """A motor with a given torque behind a train, from link a to link b.

    Shaft torque on b: ``eta G T - G^2 J d2phi - G^2 B dphi`` (theory/planar-dynamics 3), phi the angle of b relative to
    a, G the ratio motor speed / speed of b, J the rotor's inertia (kg m^2), B its viscous friction (N m s).  ``eta``
    becomes ``1/eta`` while power flows back.  ``torque=0`` leaves the reflected inertia alone: a flywheel behind a
    train. The inertia is taken as ``G^2 J`` on the relative angle: right for a fixed a, and for large ratios.

    Raises
    ------
    GeometryError
        A ratio of zero, an efficiency that is not in (0, 1].
    """

    a: int
    b: int
    torque: float | TorqueLaw = 0.0
    ratio: float = 1.0
    efficiency: float = 1.0
    rotor_inertia: float = 0.0
    rotor_damping: float = 0.0
    breaks: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        _pair(self, "torque source")
        name = f"of torque source {self.a}-{self.b}"
        if not callable(self.torque):
            object.__setattr__(self, "torque", finite(f"torque {name}", self.torque))
        object.__setattr__(self, "ratio", finite(f"ratio {name}", self.ratio))
        if self.ratio == 0.0:
            raise GeometryError(f"ratio {name} = 0 transmits nothing; give motor speed / speed of link {self.b}")
        object.__setattr__(self, "efficiency", positive(f"efficiency {name}", self.efficiency))
        if self.efficiency > 1.0:
            raise GeometryError(f"efficiency {name} = {self.efficiency} makes power from nothing; give at most 1")
        for part in ("rotor_inertia", "rotor_damping"):
            object.__setattr__(self, part, not_negative(f"{part} {name}", getattr(self, part)))
        _times(self)


@dataclass(frozen=True)
class MotorDrive:
    """A motor behind a train, from link a (its housing) to link b, with its electrical states.

    The shaft turns at ``train.ratio`` times the speed of b relative to a; the inertia of rotor and train is taken on
    that relative angle, as in a `TorqueSource`.  Currents are states of the motion; a voltage limit and the direction
    of the power flow (trains with losses) switch at located events.

    Parameters
    ----------
    a, b : int
        Links with a revolute joint between them.
    motor : DCMotor, SynchronousMotor, LinearCharacteristic or IdealTorque
        Without inductance its limit L -> 0 is taken, which is exact.
    train : Train, optional
        Direct coupling by default.
    currents : sequence of float, optional
        At the start, A; zero by default.

    Raises
    ------
    GeometryError
        No motor with a torque, no train, or currents that do not fit the motor.

    Examples
    --------
    >>> MotorDrive(0, 1, DCMotor(1.0, 0.2, 0.1, 0.1, gain=20.0, speed=20.0), Train(5.0)).currents
    (0.0,)
    """

    a: int
    b: int
    motor: Motor
    train: Train = field(default_factory=Train)
    currents: Sequence[float] = ()

    def __post_init__(self) -> None:
        _pair(self, "motor drive")
        name = f"of motor drive {self.a}-{self.b}"
        if not isinstance(self.motor, DCMotor | SynchronousMotor | LinearCharacteristic | IdealTorque):
            raise GeometryError(
                f"motor {name} = {self.motor!r} has no torque of its own; give a DCMotor, SynchronousMotor, "
                "LinearCharacteristic or IdealTorque (a given speed is a prescribed Driver)"
            )
        if not isinstance(self.train, Train):
            raise GeometryError(f"train {name} = {self.train!r} is not a Train; give Train(ratio)")
        count = electric(self.equation)[0]
        if not isinstance(self.currents, Iterable):
            raise GeometryError(f"currents {name} = {self.currents!r} are not a list; leave them out or give amperes")
        given = tuple(finite(f"current {name}", part) for part in self.currents)
        if given and len(given) != count:
            raise GeometryError(f"{len(given)} currents {name} given for a motor with {count}; leave them out")
        object.__setattr__(self, "currents", given or (0.0,) * count)

    @cached_property
    def equation(self) -> DCMotor | SynchronousMotor | LinearCharacteristic:
        """The motor as it is integrated: without inductance its limit."""
        idle = isinstance(self.motor, IdealTorque) or getattr(self.motor, "inductance", 1.0) == 0.0
        return self.motor.reduced() if idle else self.motor  # type: ignore[union-attr,return-value]

    @property
    def voltage_limit(self) -> float:
        """Of the motor, V; infinite if it has none."""
        return float(getattr(self.motor, "voltage_limit", math.inf))

    @property
    def switches(self) -> bool:
        """Whether its equations change at events: a voltage limit, or losses in the train."""
        return self.train.efficiency < 1.0 or self.voltage_limit < math.inf

    @property
    def idle(self) -> TorqueSource:
        """The same without torque: inertia and friction alone, for inverse dynamics."""
        ratio, motor = self.train.ratio, self.motor
        inertia = motor.rotor_inertia + self.train.inertia / ratio**2
        return TorqueSource(self.a, self.b, 0.0, ratio, 1.0, inertia, motor.friction)


@dataclass(frozen=True)
class JointFriction:
    """Dry friction in a joint: at rest up to ``static`` times the load, sliding ``mu(v)`` times the load.

    ``mu(v) = kinetic + (static - kinetic) exp(-(v/stribeck_speed)^2)``; with ``stribeck_speed=0`` the coefficient falls
    at once.  In a revolute joint v is ``radius`` times the relative speed and the friction torque ``mu radius |F|``, F
    the pin force; in a prismatic joint the friction force is ``mu (|N1| + |N2|)``, N1 and N2 the normal forces at the
    ends of a shoe of the given ``length`` that carry the guide's force and couple (0: the force alone).  Sticking is a
    state with events, see ``docs/explanation/planar-dynamics.md``; ``smoothing_velocity > 0`` asks for the smooth law
    ``mu(v) tanh(v/smoothing_velocity)`` instead, which never sticks; a pin in a slot knows no other law.

    Raises
    ------
    GeometryError
        Negative coefficients, a kinetic one above the static one, or no Stribeck speed between them.
    """

    a: int
    b: int
    kinetic: float
    static: float | None = None
    radius: float = 0.0
    length: float = 0.0
    stribeck_speed: float = math.inf
    smoothing_velocity: float = 0.0

    def __post_init__(self) -> None:
        _pair(self, "joint friction")
        name = f"of joint friction {self.a}-{self.b}"
        object.__setattr__(self, "kinetic", not_negative(f"kinetic {name}", self.kinetic))
        static = self.kinetic if self.static is None else not_negative(f"static {name}", self.static)
        object.__setattr__(self, "static", static)
        if static < self.kinetic:
            raise GeometryError(
                f"kinetic {name} = {self.kinetic} is above static = {static}; exchange them or make them equal"
            )
        for part in ("radius", "length", "smoothing_velocity"):
            object.__setattr__(self, part, not_negative(f"{part} {name}", getattr(self, part)))
        if not (isinstance(self.stribeck_speed, float) and self.stribeck_speed == math.inf):
            object.__setattr__(self, "stribeck_speed", finite(f"stribeck_speed {name}", self.stribeck_speed))
        if static > self.kinetic and not 0.0 <= self.stribeck_speed < math.inf:
            raise GeometryError(
                f"static {name} above kinetic needs stribeck_speed, the speed at which friction falls (0: at once)"
            )
        if static > self.kinetic and self.stribeck_speed == 0.0 < self.smoothing_velocity:
            raise GeometryError(
                f"smoothing_velocity {name} cannot represent a coefficient that falls at once; leave it out, or give a "
                "stribeck_speed"
            )


Element = Spring | TorsionSpring | Force | Torque | TorqueSource | MotorDrive | JointFriction
