"""Limits of joints and misalignments of axes, each with a tolerance box; without one the range is the value itself.

A bearing's limit is its critical tilt, enclosed over the box of its dimensions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, ClassVar, TypeAlias

import numpy as np

from graphsynth.core.arguments import Real
from graphsynth.core.checks import checked, choice, finite
from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Interval
from graphsynth.jamming.bearing.bearing import Bearing, Condition
from graphsynth.mechanism.joints import Cam, Gear, JointGeometry, PinSlot, Prismatic, Revolute

Range: TypeAlias = tuple[float, float]
#: Smallest limit above zero: products of smaller ones would vanish.
_SMALLEST = 1e-150


def _limit(name: str, value: float) -> float:
    if isinstance(value, float | np.floating) and value == math.inf:
        return math.inf
    number = finite(name, value)
    if 0.0 < number < _SMALLEST:
        raise GeometryError(f"{name} = {number} is smaller than {_SMALLEST}; give 0 (rigid), or another unit of length")
    if number < 0.0:
        raise GeometryError(f"{name} = {number} is negative; give 0 (rigid), a positive limit, or inf (no limit)")
    return number


def _fill(own: Limits | Misalignment, check: Callable[[str, Any], float], *names: str) -> None:
    """Check values and their ranges; a range that is not given is the value itself."""
    for name in names:
        value, given = check(name, getattr(own, name)), getattr(own, f"{name}_range")
        if given is None:
            given = value, value
        if not isinstance(given, tuple | list) or len(given) != 2:
            raise GeometryError(f"{name}_range = {given!r} is no pair of bounds; give (low, high)")
        low, high = (check(f"{name} of the range", bound) for bound in given)
        if not low <= value <= high:
            raise GeometryError(f"{name} = {value} lies outside its range ({low}, {high}); correct one of them")
        object.__setattr__(own, name, value)
        object.__setattr__(own, f"{name}_range", (low, high))


def bounds(own: Limits | Misalignment, name: str) -> Range:
    """Return the tolerance box of a value, which is always filled."""
    found: Range = getattr(own, f"{name}_range")
    return found


@dataclass(frozen=True)
class JointLimits:
    """Limits of a joint that tilts alike in all directions: a bearing, a pin, a spherical joint.

    Parameters
    ----------
    tilt : float
        Largest relative tilt, radians; 0 for a rigid guide, ``math.inf`` for none (a spherical joint).
    axial_clearance : float
        Axial clearance (end float): largest slip to either side, in the length unit of the mechanism; ``math.inf`` for
        a joint that floats.
    radial_clearance : float
        Largest shift across the axis (of a guide in the plane), beside any tilt, in the same unit.  Only exact closure
        counts it: to first order it changes nothing (theory/what-binding-costs 9), proofs about small tilts refuse it.
    tilt_range, axial_clearance_range, radial_clearance_range : (float, float), optional
        Tolerance boxes; the value itself by default.

    Examples
    --------
    >>> JointLimits(0.006).axial_clearance
    0.0
    """

    tilt: float
    axial_clearance: float = 0.0
    tilt_range: Range | None = None
    axial_clearance_range: Range | None = None
    radial_clearance: float = 0.0
    radial_clearance_range: Range | None = None
    tilts: ClassVar[tuple[str, ...]] = ("tilt",)
    names: ClassVar[tuple[str, ...]] = (*tilts, "axial_clearance", "radial_clearance")

    def __post_init__(self) -> None:
        _fill(self, _limit, *self.names)
        if bounds(self, "radial_clearance")[1] == math.inf:
            raise GeometryError("radial_clearance = inf would leave links that are not joined; give a length")


@dataclass(frozen=True)
class SlideLimits:
    """Limits of a straight guide (prismatic joint, or a pin guided in its slot), with tolerance boxes.

    ``roll`` and ``pitch`` are the largest tilts about the direction of the guide and about the perpendicular in the
    plane, radians; ``axial_clearance`` the largest slip out of the plane to either side, as in `JointLimits`.
    """

    roll: float
    pitch: float
    axial_clearance: float = 0.0
    roll_range: Range | None = None
    pitch_range: Range | None = None
    axial_clearance_range: Range | None = None
    tilts: ClassVar[tuple[str, ...]] = ("roll", "pitch")
    names: ClassVar[tuple[str, ...]] = (*tilts, "axial_clearance")
    radial_clearance: ClassVar[float] = 0.0
    radial_clearance_range: ClassVar[Range] = (0.0, 0.0)

    def __post_init__(self) -> None:
        _fill(self, _limit, *self.names)


Limits: TypeAlias = JointLimits | SlideLimits


def chosen(own: Limits, value: Callable[[Limits, str], float]) -> Limits:
    """Return limits without ranges, each the value that is chosen of it by name."""
    values: Any = {name: value(own, name) for name in own.names}
    return type(own)(**values)


#: No clearance at all.
RIGID = JointLimits(0.0)
SPHERICAL = JointLimits(math.inf)  #: Any tilt, but no displacement along the axis.
FREE = JointLimits(math.inf, math.inf)  #: No limit of tilt or displacement: the contact of gears or of a cam.


@dataclass(frozen=True)
class Misalignment:
    """A joint whose axis on link ``base`` is tilted against the normal of the plane.

    Parameters
    ----------
    base, link : int
        The two links of the joint; the seat on ``base``, usually the frame, is the tilted one.  It leans about its own
        point: the rail of a guide about that on its link, so that the slider leaves the plane as it travels.
    alpha : float
        Tilt, radians (small).
    direction : float
        Angle in the plane of the axis about which it is tilted, radians: 0 is the x axis (the ``n = [1, 0, 0]`` of the
        lambda linkage).  On a moving base it is counted in that link's frame.
    rigid : bool
        Whether ``link`` follows the tilted axis without clearance, as on a motor shaft; with False the joint's own
        limits hold.
    alpha_range, direction_range : (float, float), optional
        Tolerance boxes; |alpha| may not exceed 0.5 rad.

    Examples
    --------
    >>> Misalignment(0, 1, 0.01).vector
    (0.01, 0.0)
    """

    base: int
    link: int
    alpha: float
    direction: float = 0.0
    rigid: bool = True
    alpha_range: Range | None = None
    direction_range: Range | None = None

    def __post_init__(self) -> None:
        _fill(self, finite, "alpha", "direction")
        largest = max(bounds(self, "alpha"), key=abs)
        if abs(largest) > 0.5:
            raise GeometryError(f"alpha = {largest} rad is no small tilt; the coupled model needs |alpha| <= 0.5")

    def sharp(self, alpha: float | None = None, direction: float | None = None) -> Misalignment:
        """Return the misalignment without tolerances, at other values if given."""
        alpha = self.alpha if alpha is None else alpha
        return Misalignment(self.base, self.link, alpha, self.direction if direction is None else direction, self.rigid)

    @property
    def pair(self) -> tuple[int, int]:
        """Both links, the smaller number first."""
        return min(self.base, self.link), max(self.base, self.link)

    @property
    def vector(self) -> tuple[float, float]:
        """``alpha (cos direction, sin direction)``."""
        return (self.alpha * math.cos(self.direction), self.alpha * math.sin(self.direction))


@checked
def bearing_limits(
    bearing: Bearing,
    condition: Condition = "A",
    *,
    axial_clearance: Real = 0.0,
    radius_tolerance: float = 0.0,
    height_tolerance: float = 0.0,
    clearance_tolerance: float = 0.0,
    hole_tolerance: float = 0.0,
    radial_offset: Real = 0.0,
) -> JointLimits:
    """Limits of a bearing: its critical tilt, with a range that encloses it for all dimensions within tolerance.

    Parameters
    ----------
    bearing, condition : Bearing, {"A", "B", "general"}
        Contact condition; "general" needs ``bearing.hole_length``.
    axial_clearance : float
        Axial clearance (end float) to either side, in the length unit of the mechanism.
    radius_tolerance, height_tolerance, clearance_tolerance, hole_tolerance : float
        Half widths in millimetres of ``Rb``, ``Hb``, ``clearance`` and ``hole_length``.
    radial_offset : float
        Largest distance in millimetres by which a load pushes the axis off the middle (level L2 of the model ladder);
        the clearance left is smaller by it.

    Returns
    -------
    JointLimits
        ``tilt`` is infinite if there is no critical tilt.  The range is certified (outward rounding): t_A grows with
        the clearance and the radius and falls with the height; t_B falls with the radius and the height; a pin in a
        hole has the larger one of both (theory/bearing-contact 4, 7).

    Raises
    ------
    GeometryError
        For an interference fit, a tolerance that is negative or reaches zero, "general" without a hole length.

    Examples
    --------
    >>> round(bearing_limits(Bearing()).tilt, 15)
    0.006064396559156
    """
    choice("condition", condition, ("A", "B", "general"))
    bearing = pushed(bearing, radial_offset, clearance_tolerance)
    boxes = (radius_tolerance, height_tolerance, clearance_tolerance, hole_tolerance)
    for name, value in zip(("radius", "height", "clearance", "hole"), boxes):
        if not 0.0 <= value < math.inf:
            raise GeometryError(f"{name}_tolerance = {value} must be zero or more; correct the value")
    if hole_tolerance and condition != "general":
        raise GeometryError(f'hole_tolerance = {hole_tolerance} needs condition "general"; condition is "{condition}"')
    if bearing.clearance < 0.0:
        raise GeometryError(f"clearance = {bearing.clearance} mm is an interference fit; the joint cannot be assembled")
    critical = bearing.critical_tilt(condition)
    tilt = math.inf if critical.angle is None or critical.reason else critical.angle
    return JointLimits(tilt, axial_clearance, critical_range(bearing, condition, boxes, tilt))


def complete(
    joints: tuple[JointGeometry, ...],
    given: Bearing | Limits | Mapping[tuple[int, int], Bearing | Limits],
    misaligned: Mapping[tuple[int, int], Misalignment],
    condition: Condition,
) -> tuple[Limits, ...]:
    """Limits of every joint: those named, else those given for all; contacts of gears, cams and slots are free."""
    table = {(min(pair), max(pair)): own for pair, own in given.items()} if isinstance(given, Mapping) else {}
    common = None if isinstance(given, Mapping) else given
    for a, b in set(table) - {joint.pair for joint in joints}:
        raise GeometryError(f"bearings name the joint {a}-{b}, which does not exist")
    found: list[Limits] = []
    for joint in joints:
        own = table.get(joint.pair)
        if joint.pair in misaligned and misaligned[joint.pair].rigid:
            own = RIGID if isinstance(joint, Revolute) else SlideLimits(0.0, 0.0)
        elif own is None:
            own = FREE if isinstance(joint, Gear | Cam | PinSlot) else common
        name = f"joint {joint.a}-{joint.b}"
        if own is None:
            raise GeometryError(f"{name} has no limits; give bearings={{({joint.a}, {joint.b}): ...}}")
        if isinstance(own, Bearing):
            if not isinstance(joint, Revolute):
                raise GeometryError(f"{name} is a {joint.kind} joint, a bearing does not fit; give SlideLimits or FREE")
            own = bearing_limits(own, condition)
        if not isinstance(own, JointLimits | SlideLimits):
            raise GeometryError(f"{own!r} are no limits of {name}; give a Bearing, JointLimits or SlideLimits")
        if isinstance(own, SlideLimits) and not isinstance(joint, Prismatic | PinSlot):
            raise GeometryError(f"{name} is a {joint.kind} joint without a direction; give JointLimits")
        if isinstance(joint, Gear | Cam) and own != FREE:
            raise GeometryError(
                f"{name} is a {joint.kind} contact, which guides nothing out of the plane; leave it FREE"
            )
        found.append(own)
    return tuple(found)


def critical_range(
    bearing: Bearing, condition: str, tolerances: tuple[float, float, float, float], nominal: float
) -> tuple[float, float]:
    """Enclose the critical tilt for ``Rb``, ``Hb``, ``clearance``, ``hole_length`` within the tolerances (mm).

    A pin in a hole ("general") touches where it would both as a short bearing and as a long shaft in that hole, so that
    its critical tilt is the larger of the two; each is enclosed by itself.
    """
    ends = []  # of every dimension
    for name, tolerance in zip(("Rb", "Hb", "clearance", "hole_length"), tolerances):
        value = getattr(bearing, name)
        if name == "hole_length" and condition != "general":
            continue
        low, high = Fraction(value) - Fraction(tolerance), Fraction(value) + Fraction(tolerance)
        if low < 0 or (name in ("Rb", "hole_length") and low == 0):
            raise GeometryError(f"{name} = {value} mm with tolerance {tolerance} mm reaches {float(low)}; reduce it")
        ends.append((low, high))
    radius, height, clearance, *hole = ends
    own = [(condition, height)] if condition != "general" else [("A", height), ("B", hole[0])]
    found = []
    for kind, length in own:  # lower bound at the tightest corner, upper bound at the loosest one
        small, large = radius if kind == "A" else radius[::-1]
        below = pair_tilt(small, length[1], clearance[0], kind)[0]
        found.append((below, pair_tilt(large, length[0], clearance[1], kind)[1]))
    least, most = (max(pair) for pair in zip(*found))
    if hole and radius[0] < radius[1]:
        least = max(least, _least_of_both(radius, (height[1], hole[0][1]), clearance[0]))
    return min(least, nominal), max(most, nominal)


def _least_of_both(radius: tuple[Fraction, Fraction], lengths: tuple[Fraction, Fraction], c: Fraction) -> float:
    """Bound from below the larger of t_A, which grows with the radius, and t_B, which falls: least where they cross."""
    low, high = radius
    for _ in range(50):
        middle = (low + high) / 2
        a, b = (pair_tilt(middle, length, c, kind)[0] for kind, length in zip("AB", lengths))
        low, high = (middle, high) if a < b else (low, middle)
    return max(pair_tilt(low, lengths[0], c, "A")[0], pair_tilt(high, lengths[1], c, "B")[0])


def pushed(bearing: Bearing, offset: float, tolerance: float) -> Bearing:
    """Return a bearing with the clearance that is left beside an axis pushed off the middle, rounded down.

    In the direction of the push both rims reach ``offset`` further, so that all three contact conditions hold with the
    clearance less the offset; in other directions more is left.  See theory/joints-that-share-a-tilt 7, level L2.
    """
    if not 0.0 <= offset < math.inf:
        raise GeometryError(f"radial_offset = {offset} must be a distance of zero or more, in mm; correct the value")
    if offset == 0.0:
        return bearing
    if offset + tolerance > bearing.clearance:
        raise GeometryError(
            f"radial_offset = {offset} mm is more than the smallest clearance, "
            f"{bearing.clearance - tolerance:.9g} mm; the pin cannot be pushed so far"
        )
    exact = Fraction(bearing.clearance) - Fraction(offset)
    left = float(exact)
    return replace(bearing, clearance=left if Fraction(left) <= exact else math.nextafter(left, 0.0))


def pair_tilt(R: Fraction, H: Fraction, c: Fraction, condition: str) -> tuple[float, float]:
    """Enclose the critical tilt, ``2 arctan(c / (h + w))``; infinite where there is none (exact decision).

    See theory/bearing-contact 7.
    """
    h = H / 2
    room = h * h - c * (2 * R + c) if condition == "A" else h * h + c * (2 * R + c)
    if condition == "A" and (room <= 0 or h == 0):
        return math.inf, math.inf
    divisor = Interval(h) + Interval(room).sqrt()
    if c == 0:
        return 0.0, 0.0
    q = Interval(c) / divisor
    cube = q * q * q
    # alternating series with falling terms for q <= 1: q - q^3/3 <= arctan q <= q - q^3/3 + q^5/5
    if float(q.hi) <= 1e-3:
        angle = q - cube / 3 + Interval.from_bounds(0.0, 1.0) * (cube * q * q) / 5
    else:
        from graphsynth.intervals import atan

        angle = atan(q)
    return float((2 * angle).lo), float((2 * angle).hi)
