"""What gives way and what rubs: stiffness of joints, sections of links, friction of joints; all in SI units."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from graphsynth.core.checks import finite, not_negative, positive
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Bearing

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism

Part = TypeVar("Part")
#: Metres of a unit of length.
UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254}


def _stiffness(name: str, value: Any) -> float:
    return math.inf if isinstance(value, float) and value == math.inf else positive(name, value)


@dataclass(frozen=True)
class JointStiffness:
    """Stiffness of a joint beyond its limits; within them it is free.

    Parameters
    ----------
    tilt : float
        Moment for each radian beyond the limit of the tilt (of a guide of its roll and of its pitch), N m/rad;
        ``math.inf`` for a joint that does not give way.
    axial, radial : float
        Force for each metre beyond the axial clearance, and beyond the radial one (in the plane; of a guide or a slot
        across it, of gears along their pitch circles, cams are held), N/m; by default infinite.

    Examples
    --------
    >>> JointStiffness.of_contacts(1e7, 0.02)
    JointStiffness(tilt=2000.0, axial=inf, radial=20000000.0)
    """

    tilt: float
    axial: float = math.inf
    radial: float = math.inf

    def __post_init__(self) -> None:
        for name in ("tilt", "axial", "radial"):
            object.__setattr__(self, name, _stiffness(name, getattr(self, name)))

    @classmethod
    def of_contacts(cls, radial: float, length: float, axial: float = math.inf) -> JointStiffness:
        """Stiffness of a pin that touches its hole at both ends, ``length`` (m) apart, each with ``radial`` (N/m)."""
        each = positive("radial", radial)
        return cls(0.5 * each * positive("length", length) ** 2, axial, 2.0 * each)


@dataclass(frozen=True)
class LinkSection:
    """Section of a link, a beam of Euler and Bernoulli: ``bending`` E I out of the plane and ``torsion`` G J, N m^2.

    Examples
    --------
    >>> LinkSection.rectangular(2e11, width=0.02, height=0.005).bending.__round__(6)
    41.666667
    """

    bending: float
    torsion: float

    def __post_init__(self) -> None:
        for name in ("bending", "torsion"):
            object.__setattr__(self, name, _stiffness(name, getattr(self, name)))

    @classmethod
    def rectangular(cls, young: float, width: float, height: float, poisson: float = 0.3) -> LinkSection:
        """Section of a bar: ``width`` in the plane of the mechanism, ``height`` across it (m), ``young`` in Pa.

        The constant of torsion is the usual approximation ``a b^3 (1/3 - 0.21 b/a (1 - b^4/(12 a^4)))``, a >= b, to
        half a percent.
        """
        E, w, h = positive("young", young), positive("width", width), positive("height", height)
        a, b = max(w, h), min(w, h)
        J = a * b**3 * (1.0 / 3.0 - 0.21 * b / a * (1.0 - b**4 / (12.0 * a**4)))
        return cls(E * w * h**3 / 12.0, E / (2.0 * (1.0 + _poisson(poisson))) * J)

    @classmethod
    def round(cls, young: float, diameter: float, poisson: float = 0.3) -> LinkSection:
        """Section of a round bar of a diameter (m), ``young`` in Pa."""
        polar = math.pi / 32.0 * positive("diameter", diameter) ** 4
        E = positive("young", young)
        return cls(E * 0.5 * polar, E / (2.0 * (1.0 + _poisson(poisson))) * polar)


def _poisson(value: float) -> float:
    if not -1.0 < finite("poisson", value) <= 0.5:
        raise GeometryError(f"poisson = {value} is no ratio of Poisson; give a number above -1, at most 0.5")
    return value


@dataclass(frozen=True)
class ContactFriction:
    """Coulomb friction of a joint, and the size of its contacts, by which it wears.

    Parameters
    ----------
    coefficient : float
        Of friction.
    radius, length : float
        Radius of the pin and distance of the contacts at both ends of the bearing, m.  Of a guide ``length`` is the
        distance of its contacts, along and across it, and the radius half their width, for its wear alone.
    """

    coefficient: float
    radius: float
    length: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficient", not_negative("coefficient", self.coefficient))
        for name in ("radius", "length"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))


def metres(unit: Any) -> float:
    """Metres of the mechanism's unit of length, given by name or as a number."""
    if isinstance(unit, str):
        if unit not in UNITS:
            raise GeometryError(f"unit = {unit!r} is no unit of length; use {', '.join(UNITS)}, or metres as a number")
        return UNITS[unit]
    return positive("unit", unit)


def by_joint(mechanism: Mechanism, name: str, given: Any, make: Callable[[Any], Part], other: Part) -> list[Part]:
    """Part of every joint: one for all, or a mapping of pairs of links; ``other`` where nothing is given."""
    if not isinstance(given, Mapping):
        common = other if given is None else make(given)
        return [common for _ in mechanism.joints]
    table = {(min(pair), max(pair)): make(own) for pair, own in given.items()}
    for a, b in set(table) - {joint.pair for joint in mechanism.joints}:
        raise GeometryError(f"{name} names the joint {a}-{b}, which does not exist")
    return [table.get(joint.pair, other) for joint in mechanism.joints]


def as_stiffness(given: Any) -> JointStiffness:
    """Return what is given as a stiffness: a number is one of tilts, N m/rad."""
    return given if isinstance(given, JointStiffness) else JointStiffness(_stiffness("stiffness", given))


def sections(mechanism: Mechanism, given: Any) -> list[LinkSection | None]:
    """Section of every link: one for all that move, or a mapping of links; None is a rigid link."""
    for own in given.values() if isinstance(given, Mapping) else () if given is None else (given,):
        if not isinstance(own, LinkSection):
            raise GeometryError(
                f"links = {own!r} is no LinkSection; give LinkSection.rectangular(young, width, height)"
            )
    links = range(mechanism.graph.links)
    if not isinstance(given, Mapping):
        return [None if link == mechanism.frame else given for link in links]
    for link in given:
        if link not in links:
            raise GeometryError(f"links name the link {link!r}, which does not exist; the links are 0..{links[-1]}")
    return [given.get(link) for link in links]


def frictions(mechanism: Mechanism, given: Any, joints: Any) -> list[ContactFriction | None]:
    """Friction of every joint; a number is its coefficient, with the sizes of the joint's `Bearing`."""
    table = {(min(pair), max(pair)): own for pair, own in joints.items()} if isinstance(joints, Mapping) else {}
    found: list[ContactFriction | None] = []
    for joint, own in zip(mechanism.joints, by_joint(mechanism, "friction", given, lambda part: part, None)):
        bearing = table.get(joint.pair) if isinstance(joints, Mapping) else joints
        if not isinstance(bearing, Bearing) or bearing.Hb == 0.0:
            bearing = None
        if own is None and bearing is not None:
            own = 0.0
        if own is not None and not isinstance(own, ContactFriction):
            if bearing is None:
                raise GeometryError(
                    f"friction = {own!r} of joint {joint.a}-{joint.b} needs the size of its contacts, for it has no "
                    "Bearing; give ContactFriction(coefficient, radius, length)"
                )
            own = ContactFriction(own, 1e-3 * bearing.Rb, 1e-3 * bearing.Hb)
        found.append(own)
    return found
