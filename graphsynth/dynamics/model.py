"""`DynamicModel`: a mechanism with bodies, loads, prescribed motions and additional joints."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from graphsynth.core.checks import Point, finite, link_number, not_negative, point, positive
from graphsynth.core.errors import GeometryError
from graphsynth.dynamics.elements import (
    Element,
    Force,
    JointFriction,
    MotorDrive,
    Spring,
    Torque,
    TorqueSource,
    TorsionSpring,
)
from graphsynth.mechanism.joints import JointGeometry, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism


@dataclass(frozen=True)
class Body:
    """Mass (kg), moment of inertia about the centre of mass (kg m^2), centre of mass in the link frame (m).

    >>> Body.bar(0.6, (0.0, 0.0), (0.6, 0.0)).inertia
    0.018
    """

    mass: float
    inertia: float
    centre: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "mass", not_negative("mass", self.mass))
        object.__setattr__(self, "inertia", not_negative("inertia", self.inertia))
        object.__setattr__(self, "centre", point("centre of mass", self.centre))

    @classmethod
    def bar(cls, mass: float, start: Point, end: Point) -> Body:
        """Return a uniform thin bar between two points of the link."""
        (x0, y0), (x1, y1) = point("start of a bar", start), point("end of a bar", end)
        square = (x1 - x0) ** 2 + (y1 - y0) ** 2
        return cls(mass, finite("mass", mass) * square / 12.0, (0.5 * (x0 + x1), 0.5 * (y0 + y1)))

    @classmethod
    def combined(cls, *bodies: Body) -> Body:
        """Return the body of several parts fixed to the same link.

        Raises
        ------
        GeometryError
            If the parts have no mass.
        """
        for body in bodies:
            if not isinstance(body, Body):
                raise GeometryError(f"part {body!r} of a combined body is not a Body(mass, inertia, centre)")
        mass = sum(body.mass for body in bodies)
        if not mass > 0.0:
            raise GeometryError("the parts of a combined body have no mass; give one of them a positive mass")
        x = sum(body.mass * body.centre[0] for body in bodies) / mass
        y = sum(body.mass * body.centre[1] for body in bodies) / mass
        own = sum(b.inertia + b.mass * ((b.centre[0] - x) ** 2 + (b.centre[1] - y) ** 2) for b in bodies)
        return cls(mass, own, (x, y))


@dataclass(frozen=True)
class Rack:
    """Rack and pinion: link ``rack`` slides along ``angle`` of the frame, a wheel of link ``pinion`` rolls on it.

    ``e . (r_rack - c) - radius theta_pinion`` keeps its value at the start; e is the direction ``angle`` of the frame,
    c the pinion's ``centre`` (in its link frame), which must be fixed, as the rack must not turn
    (theory/planar-dynamics 2).  The tooth force acts along e at the pitch point, so the reactions in guide and bearing
    contain it.

    Raises
    ------
    GeometryError
        One link for both, or a radius that is not positive.
    """

    rack: int
    pinion: int
    radius: float
    angle: float = 0.0
    centre: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "rack", link_number("rack", self.rack))
        object.__setattr__(self, "pinion", link_number("pinion", self.pinion))
        if self.rack == self.pinion:
            raise GeometryError(f"link {self.rack} cannot be rack and pinion; name two links")
        object.__setattr__(self, "radius", positive("radius of the pinion", self.radius))
        object.__setattr__(self, "angle", finite("angle of the rack", self.angle))
        object.__setattr__(self, "centre", point("centre of the pinion", self.centre))


@dataclass(frozen=True)
class Rigid:
    """Two links fixed to each other: points coincide and ``theta_b + angle_b = theta_a + angle_a``."""

    a: int
    b: int
    at_a: Point = (0.0, 0.0)
    at_b: Point = (0.0, 0.0)
    angle_a: float = 0.0
    angle_b: float = 0.0

    def __post_init__(self) -> None:
        Prismatic(self.a, self.b, self.at_a, self.at_b, self.angle_a, self.angle_b)  # the same checks


Coupling = Rack | Rigid
_ELEMENTS = (Spring, TorsionSpring, Force, Torque, TorqueSource, MotorDrive, JointFriction)


@dataclass(frozen=True)
class DynamicModel:
    """A dimensioned mechanism with everything that its motion depends on.

    Parameters
    ----------
    mechanism : Mechanism
        Its driver names the coordinate of the one-coordinate form; drivers are free to move, their laws unused.
    bodies : mapping of int to Body
        One for every moving link.
    elements : iterable of Spring, TorsionSpring, Force, Torque, TorqueSource, MotorDrive, JointFriction
    gravity : (gx, gy), optional
        m/s^2; (0, -9.81) by default, (0, 0) for a horizontal mechanism.
    prescribed : iterable of Driver
        Coordinates that follow a law of time.
    additional : iterable of joints, Rack, Rigid
        Constraints beyond the joints of the graph: a second guide, a rack, a weld.

    Raises
    ------
    GeometryError
        A moving link without body, a negative mass, a link that does not exist, a massless frame body, friction or a
        motor in a joint that is not there, friction beside a motor with states of its own.

    Examples
    --------
    >>> from graphsynth.mechanism.model import MechanismGraph
    >>> pendulum = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1)], [Driver(0, 1)])
    >>> model = DynamicModel(pendulum, {1: Body.bar(1.0, (0.0, 0.0), (1.0, 0.0))})
    >>> model.massless
    ()
    """

    mechanism: Mechanism
    bodies: Mapping[int, Body]
    elements: Sequence[Element] = ()
    gravity: Point = (0.0, -9.81)
    prescribed: Sequence[Driver] = ()
    additional: Sequence[JointGeometry | Coupling] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.mechanism, Mechanism):
            raise GeometryError(f"mechanism = {self.mechanism!r} is not a Mechanism")
        if not isinstance(self.bodies, Mapping):
            raise GeometryError(f"bodies = {self.bodies!r} is not a mapping; give {{link: Body(...)}}")
        for name in ("elements", "prescribed", "additional"):
            if not isinstance(getattr(self, name), Iterable):
                raise GeometryError(f"{name} = {getattr(self, name)!r} is not a list; leave it out or give ()")
        object.__setattr__(self, "bodies", self._checked_bodies(self.bodies))
        object.__setattr__(self, "elements", tuple(self._checked(element) for element in self.elements))
        self._check_together()
        object.__setattr__(self, "gravity", point("gravity", self.gravity))
        object.__setattr__(self, "additional", tuple(self._checked_additional(self.additional)))
        object.__setattr__(self, "prescribed", self._checked_drivers(tuple(self.prescribed)))

    def __hash__(self) -> int:
        return hash((self.mechanism, self.elements, self.gravity))

    def _checked_bodies(self, bodies: Mapping[int, Body]) -> dict[int, Body]:
        links, frame = self.mechanism.graph.links, self.mechanism.frame
        found = {link_number("link of a body", link): body for link, body in bodies.items()}
        for link, body in found.items():
            self._link(link, "a body")
            if not isinstance(body, Body):
                raise GeometryError(f"body of link {link} = {body!r} is not a Body(mass, inertia, centre)")
            if link == frame:
                raise GeometryError(f"link {link} is the frame and has no body; remove it")
        missing = [link for link in range(links) if link != frame and link not in found]
        if missing:
            raise GeometryError(f"links {missing} have no body; give each a Body(mass, inertia, centre)")
        return dict(sorted(found.items()))

    def _link(self, link: int, what: str) -> None:
        if link >= self.mechanism.graph.links:
            raise GeometryError(f"{what} names link {link}, but the links are 0..{self.mechanism.graph.links - 1}")

    def _checked(self, element: Any) -> Element:
        if not isinstance(element, _ELEMENTS):
            raise GeometryError(f"{element!r} is not an element; use {', '.join(kind.__name__ for kind in _ELEMENTS)}")
        for link in (element.link,) if isinstance(element, Force) else (element.a, element.b):
            self._link(link, f"a {type(element).__name__}")
        if isinstance(element, JointFriction):
            self._check_friction(element)
        if isinstance(element, MotorDrive) and not isinstance(
            self.mechanism.joint(element.a, element.b), Revolute | PinSlot
        ):
            raise GeometryError(f"a motor drive needs a revolute joint, and joint {element.a}-{element.b} is none")
        return element

    def _check_friction(self, element: JointFriction) -> None:
        joint = self.mechanism.joint(element.a, element.b)
        if isinstance(joint, Revolute):
            if not element.radius > 0.0:
                raise GeometryError(f"friction in revolute joint {element.a}-{element.b} needs the radius of the pin")
        elif not isinstance(joint, Prismatic | PinSlot):
            raise GeometryError(
                f"friction in joint {element.a}-{element.b}: only R and P joints and pins in slots, not {joint.kind}"
            )
        elif isinstance(joint, PinSlot) and (element.smoothing_velocity == 0.0 or element.length > 0.0):
            raise GeometryError(
                f"friction of the pin in slot {element.a}-{element.b} needs smoothing_velocity, and no length; a pin "
                "that sticks is not known"
            )

    def _check_together(self) -> None:
        for element in self.elements:
            if not isinstance(element, MotorDrive) or not (element.currents or element.switches):
                continue
            if any(isinstance(other, JointFriction) for other in self.elements):
                raise GeometryError(
                    f"dry friction beside motor drive {element.a}-{element.b}, which has currents or switches: the "
                    "friction problem does not know them; take the motor's limit motor.reduced() and a train without "
                    "losses, or leave the friction out"
                )

    def _checked_additional(self, items: Iterable[Any]) -> Iterable[JointGeometry | Coupling]:
        for item in items:
            if not isinstance(item, Rack | Rigid | Revolute | Prismatic | PinSlot):
                raise GeometryError(f"additional = {item!r} is not a Revolute, Prismatic, PinSlot, Rack or Rigid")
            for link in (item.rack, item.pinion) if isinstance(item, Rack) else (item.a, item.b):
                self._link(link, f"an additional {type(item).__name__}")
            yield item

    def _checked_drivers(self, drivers: tuple[Driver, ...]) -> tuple[Driver, ...]:
        for driver in drivers:
            if not isinstance(driver, Driver):
                raise GeometryError(f"prescribed = {driver!r} is not a Driver(base, link, law)")
            joint = self.mechanism.joint(*driver.pair)
            if not isinstance(joint, Revolute | Prismatic):
                raise GeometryError(
                    f"prescribed joint {driver.base}-{driver.link} is {joint.kind}; only R and P move so"
                )
        return drivers

    @property
    def massless(self) -> tuple[int, ...]:
        """Links whose mass or inertia is zero: allowed in the one-coordinate form only."""
        return tuple(link for link, body in self.bodies.items() if not (body.mass > 0.0 and body.inertia > 0.0))

    @property
    def breaks(self) -> tuple[float, ...]:
        """Times at which loads are not smooth, ascending."""
        return tuple(sorted({t for element in self.elements for t in getattr(element, "breaks", ())}))
