"""Tolerances of parts as a drawing gives them, and the box of parameters of a mechanism that they make.

Every tolerance belongs to a part: a distance between two joints of a link, a hole within a circle, a fit, an axis.  So
it does not matter where the frame of a link has its origin.  A joint of a link is named by the link at its other side.
See theory/drawing-tolerances 2.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from graphsynth.core.checks import choice, finite, link_number, not_negative, positive
from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Interval
from graphsynth.mechanism.model import Mechanism
from graphsynth.tolerances.box import LinkPoint, ParameterBox, Term
from graphsynth.tolerances.iso286 import read_fit

Pair: TypeAlias = tuple[int, int]


def _pair(name: str, value: object) -> Pair:
    if not isinstance(value, tuple | list) or len(value) != 2:
        raise GeometryError(f"{name} = {value!r} is no pair of links; give two numbers, as (0, 2)")
    first, second = (link_number(f"link of {name}", link) for link in value)
    if first == second:
        raise GeometryError(f"{name} = {value!r} names one link twice; give two")
    return first, second


@dataclass(frozen=True)
class LengthTolerance:
    """Distance between two joints of a link: the nominal one, plus and minus, in the length unit of the mechanism.

    ``ends`` are the links at the other side of both joints.  The first is the datum: the second joint moves along the
    line of both, and whatever is dimensioned from it moves with it.  ``minus`` is ``plus`` if it is not given.

    Examples
    --------
    >>> LengthTolerance(1, (0, 2), 0.02).minus
    0.02
    """

    link: int
    ends: Pair
    plus: float
    minus: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "link", link_number("link of a length", self.link))
        object.__setattr__(self, "ends", _pair("ends", self.ends))
        object.__setattr__(self, "plus", not_negative("plus", self.plus))
        minus = self.plus if self.minus is None else self.minus
        object.__setattr__(self, "minus", not_negative("minus", minus))


@dataclass(frozen=True)
class HolePosition:
    """Position of a hole (or pin) of a link: within a circle of ``diameter`` round its place (length unit)."""

    link: int
    to: int
    diameter: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "link", link_number("link of a hole", self.link))
        object.__setattr__(self, "to", link_number("link at a hole", self.to))
        object.__setattr__(self, "diameter", not_negative("diameter", self.diameter))


@dataclass(frozen=True)
class ThermalExpansion:
    """Temperature between ``low`` and ``high``, kelvin above that of the drawing; one coefficient, or one per link.

    All lengths of a link grow together by ``coefficient dT``, and all links at the one temperature: a single parameter.
    """

    low: float
    high: float
    coefficients: float | Mapping[int, float]

    def __post_init__(self) -> None:
        low, high = finite("low", self.low), finite("high", self.high)
        if not low <= 0.0 <= high:
            raise GeometryError(
                f"the temperatures {low} to {high} K do not hold 0, that of the drawing; give differences from it"
            )
        object.__setattr__(self, "low", low)
        object.__setattr__(self, "high", high)

    def of(self, link: int) -> float:
        """Coefficient of a link, per kelvin; 0 for a link that is not named."""
        given = self.coefficients
        return finite("coefficient", given.get(link, 0.0) if isinstance(given, Mapping) else given)


@dataclass(frozen=True)
class FitClearance:
    """Clearance of a joint as an ISO 286 fit with its size, ``"25 H7/g6"``, and the height of the bearing, mm.

    Sizes are those at the temperature of the drawing: a `ThermalExpansion` does not change the clearance.
    ``condition`` is the contact condition of the bearing (theory/bearing-contact): "A", a short bearing in a long
    hole, or "B", a long shaft in a hole of that height.
    """

    joint: Pair
    fit: str
    height: float
    height_tolerance: float = 0.0
    condition: str = "A"

    def __post_init__(self) -> None:
        object.__setattr__(self, "joint", _pair("joint", self.joint))
        _, _, hole, shaft = read_fit(self.fit)
        if hole.lower < shaft.upper:
            raise GeometryError(
                f"{self.fit}: the tightest pair interferes, the joint cannot turn; give a fit with clearance, as H7/g6"
            )
        object.__setattr__(self, "height", positive("height", self.height))
        object.__setattr__(self, "height_tolerance", not_negative("height_tolerance", self.height_tolerance))
        choice("condition", self.condition, ("A", "B"))


@dataclass(frozen=True)
class EndFloat:
    """Axial end float of a joint, ``least`` to ``most`` from one end to the other, in the length unit."""

    joint: Pair
    least: float
    most: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "joint", _pair("joint", self.joint))
        least, most = (not_negative(name, getattr(self, name)) for name in ("least", "most"))
        if least > most:
            raise GeometryError(f"end float from {least} to {most}: the first is the larger one; exchange them")


@dataclass(frozen=True)
class AxisAngle:
    """Angle of the axis of a joint on a link against the normal of the plane: up to ``angle`` radians, anywhere."""

    link: int
    to: int
    angle: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "link", link_number("link of an axis", self.link))
        object.__setattr__(self, "to", link_number("link at an axis", self.to))
        object.__setattr__(self, "angle", not_negative("angle", self.angle))


@dataclass(frozen=True)
class Parallelism:
    """Parallelism of the axis of a joint on a link to the normal: within a cylinder of ``diameter`` over ``length``."""

    link: int
    to: int
    diameter: float
    length: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "diameter", not_negative("diameter", self.diameter))
        object.__setattr__(self, "length", positive("length", self.length))
        object.__setattr__(self, "link", link_number("link of an axis", self.link))
        object.__setattr__(self, "to", link_number("link at an axis", self.to))

    @property
    def angle(self) -> float:
        """Largest angle that fits into the cylinder, radians, rounded up."""
        return math.nextafter(math.atan(self.diameter / self.length) * (1.0 + 1e-15), math.inf)


PartTolerance: TypeAlias = (  #: Everything that a list of tolerances may hold.
    LengthTolerance | HolePosition | ThermalExpansion | FitClearance | EndFloat | AxisAngle | Parallelism
)


def checked_tolerances(tolerances: Iterable[PartTolerance]) -> tuple[PartTolerance, ...]:
    """Return the tolerances as a tuple; `GeometryError` for anything that is none."""
    try:
        found = tuple(tolerances)
    except TypeError as error:
        raise GeometryError(f"tolerances = {tolerances!r} is no list; give a list of tolerances of parts") from error
    for own in found:
        if not isinstance(own, PartTolerance):
            raise GeometryError(f"{own!r} is no tolerance of a part; give LengthTolerance, HolePosition, ...")
    return found


def _place_of(mechanism: Mechanism, link: int, to: int) -> tuple[int, int]:
    """Return a joint's number, and 0 or 1 for the side that the link is at."""
    joint = mechanism.joint(link, to)
    return mechanism.joints.index(joint), int(joint.b == link)


def parameter_box(mechanism: Mechanism, tolerances: Iterable[PartTolerance]) -> ParameterBox:
    """Turn tolerances of the places of joints into a box of parameters; those of other kinds are left out.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one.
    tolerances : iterable of LengthTolerance, HolePosition, ThermalExpansion
        At most one `ThermalExpansion`, and at most one length to every joint of a link.

    Returns
    -------
    ParameterBox
        Places of all joints as functions of the parameters; exact, but for the outward rounding of directions.

    Raises
    ------
    GeometryError
        For a joint that the link does not have, a length of zero, and lengths that do not determine the places.

    Examples
    --------
    >>> crank = LengthTolerance(1, (0, 2), 0.01)
    >>> parameter_box(Mechanism.four_bar(2, 1, 2.5, 2.5), [crank]).names
    ('length 0-2 of link 1',)
    """
    given = checked_tolerances(tolerances)
    names: list[str] = []
    bounds: list[tuple[float, float]] = []
    terms: dict[tuple[int, int], tuple[Term, ...]] = {}
    lengths = [own for own in given if isinstance(own, LengthTolerance)]
    for own in lengths:
        names.append(f"length {own.ends[0]}-{own.ends[1]} of link {own.link}")
        assert own.minus is not None
        bounds.append((-own.minus, own.plus))
    for link in sorted({own.link for own in lengths}):
        terms |= _chained(mechanism, link, [(k, own) for k, own in enumerate(lengths) if own.link == link])
    discs = []
    for hole in (own for own in given if isinstance(own, HolePosition)):
        place = _place_of(mechanism, hole.link, hole.to)
        k, half = len(names), 0.5 * hole.diameter
        names += [f"{axis} of the hole {hole.link}-{hole.to} of link {hole.link}" for axis in "xy"]
        bounds += [(-half, half), (-half, half)]
        discs.append((k, k + 1))
        terms[place] = (*terms.get(place, ()), (k, 1.0, 0.0), (k + 1, 0.0, 1.0))
    heats = [own for own in given if isinstance(own, ThermalExpansion)]
    if len(heats) > 1:
        raise GeometryError("two temperature ranges are given; one holds for the whole mechanism: give one")
    if heats:
        names.append("temperature")
        bounds.append((heats[0].low, heats[0].high))
    points = _link_points(mechanism, terms, heats[0] if heats else None, len(names) - 1)
    low, high = np.array(bounds, dtype=np.float64).reshape(-1, 2).T
    return ParameterBox(tuple(names), low.copy(), high.copy(), points, tuple(discs))


def _link_points(
    mechanism: Mechanism, terms: Mapping[tuple[int, int], tuple[Term, ...]], heat: ThermalExpansion | None, number: int
) -> tuple[tuple[LinkPoint, LinkPoint], ...]:
    """Points of every joint on both links, each from the first joint of its link."""
    datum: dict[int, tuple[float, float]] = {}
    found = []
    for k, joint in enumerate(mechanism.joints):
        ends = []
        for side, (link, at) in enumerate(((joint.a, joint.at_a), (joint.b, joint.at_b))):
            start = datum.setdefault(link, at)
            growth = 0.0 if heat is None else heat.of(link)
            fixed = link == mechanism.frame
            ends.append(LinkPoint(at, terms.get((k, side), ()), start, growth, number, fixed))
        found.append((ends[0], ends[1]))
    return tuple(found)


def _chained(
    mechanism: Mechanism, link: int, lengths: list[tuple[int, LengthTolerance]]
) -> dict[tuple[int, int], tuple[Term, ...]]:
    """Terms of the joints of one link: each is moved by its own length, and by those that its datum is moved by."""
    place = {to: _place_of(mechanism, link, to) for _, own in lengths for to in own.ends}
    seconds = [own.ends[1] for _, own in lengths]
    for to in set(seconds):
        if seconds.count(to) > 1:
            raise GeometryError(f"link {link} has two lengths to its joint with link {to}; give one, or a HolePosition")
    found: dict[int, tuple[Term, ...]] = {to: () for to in place if to not in seconds}
    left = list(lengths)
    while left:
        ready = [(k, own) for k, own in left if own.ends[0] in found]
        if not ready:
            raise GeometryError(f"the lengths of link {link} form a ring; leave one of them out")
        for k, own in ready:
            first, second = (_nominal(mechanism, *place[to]) for to in own.ends)
            x, y = Interval(second[0]) - first[0], Interval(second[1]) - first[1]
            length = (x.sqr() + y.sqr()).sqrt()
            if not float(length.lo) > 0.0:
                raise GeometryError(f"the joints {own.ends} of link {link} lie at one place; use a HolePosition")
            assert own.minus is not None
            if own.minus >= float(length.lo):
                raise GeometryError(
                    f"minus = {own.minus} leaves no length between the joints {own.ends} of link {link}"
                )
            found[own.ends[1]] = (*found[own.ends[0]], (k, x / length, y / length))
        left = [pair for pair in left if pair not in ready]
    return {place[to]: own for to, own in found.items() if own}


def _nominal(mechanism: Mechanism, joint: int, side: int) -> tuple[float, float]:
    own = mechanism.joints[joint]
    return own.at_b if side else own.at_a
