"""The interval problem of the source: where a circle and an ellipse with tolerances intersect.

``x^2 + y^2`` in ``R1^2 + [-e1, e1]`` and ``x^2/a^2 + y^2/b^2`` in ``1 + [-e2, e2]``, ``a >= b > 0``; radii may be
ranges.  All numbers are kept as rational numbers, so that cases of touching are decided, not guessed.
Source: [Mitrofanova & Bazhenov 2020]; theory/circle-and-ellipse 6.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from typing import Any, NamedTuple

from graphsynth.core.arguments import Count
from graphsynth.core.checks import checked
from graphsynth.core.errors import GeometryError
from graphsynth.intervals.interval import Interval
from graphsynth.intervals.reading import lower_bound, upper_bound
from graphsynth.jamming.bearing import parameters
from graphsynth.jamming.bearing.bearing import Bearing


class Exact(NamedTuple):
    """A closed range of numbers with rational ends; a point if they are equal."""

    lo: Fraction
    hi: Fraction

    @property
    def is_point(self) -> bool:
        """Whether it holds one number only."""
        return self.lo == self.hi

    def outward(self) -> Interval:
        """Enclose in an interval of doubles."""
        return outward(self.lo, self.hi)


def outward(lo: Fraction, hi: Fraction) -> Interval:
    """Return the tightest interval of doubles around two rational numbers."""
    return Interval.from_bounds(lower_bound(lo) + 0.0, upper_bound(hi) + 0.0)  # no negative zero


def exact_range(name: str, value: Any) -> Exact:
    """Read a number or a range without rounding.

    Parameters
    ----------
    name : str
        For the message.
    value : int, Fraction, Decimal, float, str, Interval or pair
        A float is the binary number it is.  Text: ``"17.53"``, ``"1/30"``, ``"[17.4, 17.6]"``, ``"17.5 +- 0.005"``.

    Raises
    ------
    GeometryError
        For what is no finite real number, and for reversed bounds.

    Examples
    --------
    >>> exact_range("c", "0.03").lo
    Fraction(3, 100)
    """
    if isinstance(value, Exact):
        return value
    if isinstance(value, Fraction):  # also beyond the range of doubles: units far from 1
        return Exact(value, value)
    found = parameters.Range.read(name, value)
    return Exact(found.lower, found.upper)


def root_bounds(value: Fraction, bits: int = 64) -> Exact:
    """Enclose the square root of ``value >= 0`` in rational numbers, to ``bits`` significant bits; exact if rational.

    Examples
    --------
    >>> root_bounds(Fraction(9, 4)).is_point, float(root_bounds(Fraction(2)).lo)
    (True, 1.4142135623730951)
    """
    if value == 0:
        return Exact(Fraction(0), Fraction(0))
    size = value.numerator.bit_length() - value.denominator.bit_length()
    shift = bits - size // 2  # value 4^shift has about 2 bits digits
    up, down = max(2 * shift, 0), max(-2 * shift, 0)
    whole, rest = divmod(value.numerator << up, value.denominator << down)
    root = math.isqrt(whole)
    exact = rest == 0 and root * root == whole
    unit = Fraction(1, 1 << shift) if shift >= 0 else Fraction(1 << -shift)
    if exact:
        return Exact(root * unit, root * unit)
    perfect = math.isqrt(value.numerator), math.isqrt(value.denominator)
    if perfect[0] ** 2 == value.numerator and perfect[1] ** 2 == value.denominator:
        return Exact(Fraction(*perfect), Fraction(*perfect))
    return Exact(root * unit, (root + 1) * unit)


class Reason(Enum):
    """Reason of a status; the value is a sentence for the reader.

    Examples
    --------
    >>> Reason.TOUCHES_X.value
    'touches axis x = 0: for some parameters the intersection lies on it, or there is none'
    """

    INTERSECTION = "one intersection in each quadrant for every choice of the parameters"
    CIRCLE_OUTSIDE = "the circle encloses the ellipse: no intersection"
    CIRCLE_INSIDE = "the ellipse encloses the circle: no intersection"
    TOUCHES_X = "touches axis x = 0: for some parameters the intersection lies on it, or there is none"
    TOUCHES_Y = "touches axis y = 0: for some parameters the intersection lies on it, or there is none"
    TANGENT_LONG = "tangent at the ends of the long axis: a double point on y = 0"
    TANGENT_SHORT = "tangent at the ends of the short axis: a double point on x = 0"
    COINCIDENT = "coincident: circle and ellipse are the same curve, every point of it is a solution"
    RING = "a = b: the solutions form a ring, not separate intersections"
    NOT_SEPARATED = "the ranges of a and b overlap: the ellipse may be a circle"
    BOXES = "the limit in boxes was reached"
    SECONDS = "the limit in seconds was reached"
    RESOLUTION = "boxes at the limit of the resolution are left: the solution set is thick, or a solution is multiple"


_MOST_BITS = 10_000


@dataclass(frozen=True)
class CircleEllipse:
    """A circle and a centred ellipse, each with a tolerance; made by `circle_ellipse`.

    Attributes
    ----------
    R1, a, b : Exact
        Radius of the circle, semi-axes along x and y; of one length unit.
    e1 : Exact
        Tolerance of ``x^2 + y^2``, in the square of that unit.
    e2 : Exact
        Tolerance of ``x^2/a^2 + y^2/b^2``, a number.
    """

    R1: Exact
    a: Exact
    b: Exact
    e1: Exact
    e2: Exact

    @property
    def circle_bounds(self) -> Exact:
        """Smallest and largest ``x^2 + y^2``."""
        return Exact(self.R1.lo**2 - self.e1.hi, self.R1.hi**2 + self.e1.hi)

    @property
    def level_bounds(self) -> Exact:
        """Smallest and largest ``x^2/a^2 + y^2/b^2``."""
        return Exact(1 - self.e2.hi, 1 + self.e2.hi)

    @property
    def is_exact_data(self) -> bool:
        """Whether the radii are points and both tolerances are zero."""
        return self.R1.is_point and self.a.is_point and self.b.is_point and self.e1.hi == 0 == self.e2.hi


def circle_ellipse(R1: Any, a: Any, b: Any, e1: Any = 0, e2: Any = 0, *, eps: Any = None) -> CircleEllipse:
    """Pose the problem of the source.

    Parameters
    ----------
    R1, a, b : number, text, Interval or pair of bounds
        Text, integers, fractions and decimals are taken exactly; a float is the binary number it is.
    e1, e2 : the same
        Tolerances; the upper bound of a range counts.
    eps : the same, optional
        The one number that the source uses for both, although their units differ.

    Returns
    -------
    CircleEllipse
        The problem, its numbers exact.

    Raises
    ------
    GeometryError
        For values that are no finite numbers, ``R1 <= 0``, ``b <= 0``, ``a < b``, negative tolerances, eps beside
        e1 or e2.

    Examples
    --------
    >>> circle_ellipse("17.5", "17.53", "17.46", eps="1e-6").e1.hi
    Fraction(1, 1000000)
    """
    if eps is not None:
        if e1 != 0 or e2 != 0:
            raise GeometryError("eps stands for both e1 and e2; give either eps, or e1 and e2")
        e1 = e2 = eps
    ranges = {name: exact_range(name, v) for name, v in (("R1", R1), ("a", a), ("b", b), ("e1", e1), ("e2", e2))}
    for name, value in ranges.items():
        bound = "zero or more" if name in ("e1", "e2") else "positive"
        if value.lo < 0 or (value.lo == 0 and bound == "positive"):
            raise GeometryError(f"{name} = {float(value.lo)} must be {bound}; correct the value")
    if ranges["a"].lo < ranges["b"].lo or ranges["a"].hi < ranges["b"].hi:
        raise GeometryError(
            f"a = {float(ranges['a'].lo)} is below b = {float(ranges['b'].hi)}; a is the long semi-axis: exchange them"
        )
    return CircleEllipse(**ranges)


@checked
def bearing_radii(bearing: Bearing) -> tuple[Fraction, Fraction, Fraction]:
    """Return R, Rh and h as the decimals that they print as.

    Examples
    --------
    >>> bearing_radii(Bearing())[1]
    Fraction(1753, 100)
    """
    R, c, height = (Fraction(repr(v)) for v in (bearing.Rb, bearing.clearance, bearing.Hb))
    return R, R + c, height / 2


@checked
def surrogate_problem(
    bearing: Bearing, sine: Any, e1: Any = 0, e2: Any = 0, *, eps: Any = None, bits: Count = 128
) -> CircleEllipse:
    """Pose the problem for the centred surrogate ellipse E4 of a tilted bearing (theory/circle-and-ellipse 1).

    Parameters
    ----------
    bearing : Bearing
        Its dimensions are read as the decimals they print as: 0.03 is 3/100.
    sine : number, text or Interval
        Sine of the tilt; its sign does not matter.
    e1, e2, eps : as for `circle_ellipse`
    bits : int
        Digits to which the cosine is enclosed.

    Returns
    -------
    CircleEllipse
        The problem, its numbers exact.

    Raises
    ------
    GeometryError
        For a tilt so steep that ``b = Rh cos t - h sin t`` is not positive, and what `circle_ellipse` raises.

    Examples
    --------
    >>> round(float(surrogate_problem(Bearing(), "0.0133308643").b.lo), 9)
    17.461787964
    """
    if bits > _MOST_BITS:
        raise GeometryError(f"bits = {bits} is more than {_MOST_BITS}; fewer are enough")
    low, high = exact_range("sine", sine)
    low, high = (low, high) if low >= 0 else (max(Fraction(0), low, -high), max(-low, high))
    if high > 1:
        raise GeometryError(f"sine = {float(high)} of the tilt exceeds 1; give a value in [-1, 1]")
    _, Rh, h = bearing_radii(bearing)
    short = Exact(
        Rh * root_bounds(1 - high * high, bits).lo - h * high, Rh * root_bounds(1 - low * low, bits).hi - h * low
    )
    if short.lo <= 0:
        raise GeometryError(
            f"sine = {float(high)}: Rh cos t - h sin t is not positive, so the surrogate ellipse does not exist; "
            "use lid_area, which is defined at any tilt"
        )
    return circle_ellipse(bearing_radii(bearing)[0], Rh, short, e1, e2, eps=eps)
