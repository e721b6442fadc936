"""The interval problem of the source, circle and ellipse with tolerances, and the exact hull of its intersections.

``x^2 + y^2`` in ``R1^2 + [-e1, e1]`` and ``x^2/a^2 + y^2/b^2`` in ``1 + [-e2, e2]``, ``a >= b > 0``; radii may be
ranges.  All numbers are kept as rational numbers, so that cases of touching are decided, not guessed.  With
``u = x^2`` and ``v = y^2`` the problem is linear, its solution set a parallelogram cut by the axes; the hull is
computed in rational numbers and rounded outward once, at the square root.

Source: [Mitrofanova & Bazhenov 2020].  See theory/circle-and-ellipse 6 to 8, theory/interval-tests 3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from graphsynth.core.arguments import Count
from graphsynth.core.checks import checked
from graphsynth.core.errors import GeometryError
from graphsynth.intervals.boxes import Status
from graphsynth.intervals.guard import check_rounding
from graphsynth.intervals.interval import Interval
from graphsynth.intervals.reading import lower_bound, upper_bound
from graphsynth.jamming.bearing import parameters
from graphsynth.jamming.bearing.bearing import Bearing

#: On the exact hull enlarged by s the image has radius 1 + s^2 rho: below s for some s only if rho < 1/4
#: (theory/interval-tests 3).
RHO_LIMIT = 0.25
_MOST_BITS = 10_000


class Exact(NamedTuple):
    """A closed range of numbers with rational ends; a point if they are equal."""

    lo: Fraction
    hi: Fraction

    @property
    def is_point(self) -> bool:
        """Whether it holds one number only."""
        return self.lo == self.hi

    def outward(self) -> Interval:
        """Return the tightest interval of doubles around it."""
        return Interval.from_bounds(lower_bound(self.lo) + 0.0, upper_bound(self.hi) + 0.0)  # no negative zero


def exact_range(name: str, value: Any) -> Exact:
    """Read a number or a range without rounding; a float is the binary number it is."""
    if isinstance(value, Exact):
        return value
    if isinstance(value, Fraction):  # also beyond the range of doubles: units far from 1
        return Exact(value, value)
    found = parameters.Range.read(name, value)
    return Exact(found.lower, found.upper)


def root_bounds(value: Fraction, bits: int = 64) -> Exact:
    """Enclose the square root of ``value >= 0`` in rational numbers, to ``bits`` digits; exact if it is rational."""
    if value == 0:
        return Exact(Fraction(0), Fraction(0))
    size = value.numerator.bit_length() - value.denominator.bit_length()
    shift = bits - size // 2  # value 4^shift has about 2 bits digits
    up, down = max(2 * shift, 0), max(-2 * shift, 0)
    whole, rest = divmod(value.numerator << up, value.denominator << down)
    root = math.isqrt(whole)
    unit = Fraction(1, 1 << shift) if shift >= 0 else Fraction(1 << -shift)
    exact = root * unit
    if rest != 0 or root * root != whole:
        exact = Fraction(math.isqrt(value.numerator), math.isqrt(value.denominator))
        if exact * exact != value:
            return Exact(root * unit, (root + 1) * unit)
    return Exact(exact, exact)


class Reason(Enum):
    """Reason of a status; the value is a sentence for the reader."""

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


@dataclass(frozen=True)
class CircleEllipse:
    """A circle and a centred ellipse, each with a tolerance; made by `circle_ellipse`.

    Radius R1 of the circle and semi-axes a, b along x and y in one length unit; tolerances e1 of ``x^2 + y^2``, in the
    square of that unit, and e2 of ``x^2/a^2 + y^2/b^2``, a number.
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
    e1, e2, eps : the same, optional
        Tolerances, of which the upper bound counts; the one number that the source uses for both.

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
    """Return R, Rh and h as the decimals that they print as."""
    R, c, height = (Fraction(repr(v)) for v in (bearing.Rb, bearing.clearance, bearing.Hb))
    return R, R + c, height / 2


@checked
def surrogate_problem(
    bearing: Bearing, sine: Any, e1: Any = 0, e2: Any = 0, *, eps: Any = None, bits: Count = 128
) -> CircleEllipse:
    """Pose the problem for the centred surrogate ellipse E4 of a tilted bearing (theory/circle-and-ellipse 1).

    Parameters
    ----------
    bearing, sine : Bearing, number, text or Interval
        The dimensions are read as the decimals they print as: 0.03 is 3/100; the sign of the tilt does not matter.
    e1, e2, eps : as for `circle_ellipse`
    bits : int
        Digits to which the cosine is enclosed.

    Returns
    -------
    CircleEllipse
        Its numbers are exact.

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


@checked
def spectral_radius(problem: CircleEllipse, box: Interval) -> float:
    """Spectral radius of ``|I - Y L|`` on a box of the quadrant, Y the inverse of mid L, an estimate.

    As ``I - Y mid L = 0``, it is the radius of ``|Y| rad L``; infinite where mid L is singular (a circle, or a box at
    the origin).

    >>> box = Interval.from_bounds([4.0, 2.9], [4.1, 3.0])
    >>> round(spectral_radius(circle_ellipse(5, 6, 4), box), 4)
    0.0733
    """
    if box.is_empty.any():
        return 0.0
    unit = problem.R1.hi  # lengths in units of the radius, so that no unit of the data overflows
    x, y, rx, ry = (np.concatenate([box.mid, box.rad]) / float(unit)).tolist()
    bounds = [(unit**2 / r.hi**2, unit**2 / r.lo**2) for r in (problem.a, problem.b)]
    (alpha, beta), (da, db) = [float((p + q) / 2) for p, q in bounds], [float((q - p) / 2) for p, q in bounds]
    difference = float(sum(bounds[1]) - sum(bounds[0])) / 2
    determinant = 4.0 * x * y * difference
    if determinant == 0.0:
        return float("inf")
    inverse = np.abs(np.array([[2 * beta * y, -2 * y], [-2 * alpha * x, 2 * x]]) / determinant)
    radius = 2.0 * np.array([[rx, ry], [alpha * rx + da * (x + rx), beta * ry + db * (y + ry)]])
    return float(np.abs(np.linalg.eigvals(inverse @ radius)).max())


@dataclass(frozen=True, eq=False)
class IntersectionHull:
    """Outcome of `exact_hull`, for the first quadrant.

    ``UNIQUE``: one intersection inside the quadrant for every choice of the parameters; ``EMPTY``: none for any;
    ``UNDECIDED``: neither holds, or it depends on the parameters: see the one or two ``reasons``.  ``hull`` (2,) of all
    solutions (x, y) with x, y >= 0 is certified, and exact up to outward rounding if ``tight``: unless the ranges of a
    and b overlap; ``squares`` (2,) is that of (x^2, y^2).
    """

    problem: CircleEllipse
    status: Status
    reasons: tuple[Reason, ...]
    hull: Interval
    squares: Interval
    tight: bool

    @property
    def spectral_radius(self) -> float:
        """``rho(|I - Y L|)`` of Krawczyk's operator in (x, y) on the hull, an estimate; 0 for an empty hull."""
        return spectral_radius(self.problem, self.hull)

    @property
    def krawczyk_can_certify(self) -> bool:
        """Whether Krawczyk's test in (x, y) can succeed on one box, to first order: ``rho < 1/4``.

        See theory/interval-tests 3.
        """
        return self.status is Status.UNIQUE and self.spectral_radius < RHO_LIMIT

    @property
    def four(self) -> Interval:
        """All intersections, see `mirrored`."""
        return mirrored(self.hull)


@checked
def exact_hull(problem: CircleEllipse) -> IntersectionHull:
    """Solve the problem exactly.

    See theory/circle-and-ellipse 7; for ranges of the radii the same two corners of the parameters are extreme (6.3,
    with eps too: ``u = A (Q - B)/(A - B)`` grows with Q and falls with A and B while B <= Q <= A).

    Parameters
    ----------
    problem : CircleEllipse

    Returns
    -------
    IntersectionHull
        Certified; the hull is exact up to one rounding of each bound.

    Examples
    --------
    >>> found = exact_hull(circle_ellipse(5, 6, 4))
    >>> found.status.name, found.hull
    ('UNIQUE', Interval([[4.024922359499621, 4.0249223594996222], [2.9664793948382648, 2.9664793948382653]]))
    """
    check_rounding()
    circle, level = problem.circle_bounds, problem.level_bounds
    long, short = (Exact(r.lo**2 * level.lo, r.hi**2 * level.hi) for r in (problem.a, problem.b))
    if circle.lo > long.hi:
        return _empty(problem, Reason.CIRCLE_OUTSIDE)
    if circle.hi < short.lo:
        return _empty(problem, Reason.CIRCLE_INSIDE)
    if problem.a.lo <= problem.b.hi:
        return _near_circular(problem, circle, long, short)
    most = _corner(problem.a.lo, problem.b.lo, circle.hi, level.lo)
    least = _corner(problem.a.hi, problem.b.hi, circle.lo, level.hi)
    u_max, v_min = most if most[1] >= 0 else (min(circle.hi, long.hi), Fraction(0))
    u_min, v_max = least if least[0] >= 0 else (Fraction(0), min(circle.hi, short.hi))
    # why not every choice of the parameters has an intersection inside the quadrant
    sharp, reasons = problem.R1.is_point and problem.e1.hi == 0 == problem.e2.hi, []
    if least[0] <= 0:
        reasons.append(Reason.TANGENT_SHORT if sharp and problem.b == problem.R1 else Reason.TOUCHES_X)
    if most[1] <= 0:
        reasons.append(Reason.TANGENT_LONG if sharp and problem.a == problem.R1 else Reason.TOUCHES_Y)
    status = Status.UNDECIDED if reasons else Status.UNIQUE
    u, v = Exact(u_min, u_max), Exact(v_min, v_max)
    return _result(problem, status, tuple(reasons) or (Reason.INTERSECTION,), u, v)


def _corner(a: Fraction, b: Fraction, Q: Fraction, E: Fraction) -> tuple[Fraction, Fraction]:
    """Solution (u, v) of ``u + v = Q``, ``u/a^2 + v/b^2 = E``."""
    span = (a - b) * (a + b)
    return a * a * (Q - b * b * E) / span, b * b * (a * a * E - Q) / span


def _near_circular(problem: CircleEllipse, circle: Exact, long: Exact, short: Exact) -> IntersectionHull:
    """Treat an ellipse that is, or may be, a circle."""
    ring = problem.a == problem.b and problem.a.is_point
    top = min(circle.hi, long.hi)
    if ring:
        if max(circle.lo, long.lo) > top:
            return _empty(problem, Reason.CIRCLE_OUTSIDE if circle.lo > long.hi else Reason.CIRCLE_INSIDE)
        reason = Reason.COINCIDENT if problem.is_exact_data else Reason.RING
        return _result(problem, Status.UNDECIDED, (reason,), Exact(Fraction(0), top), Exact(Fraction(0), top))
    v_max = min(top, short.hi)
    u = Exact(max(Fraction(0), circle.lo - v_max), top)
    return _result(problem, Status.UNDECIDED, (Reason.NOT_SEPARATED,), u, Exact(Fraction(0), v_max), tight=False)


def _empty(problem: CircleEllipse, reason: Reason) -> IntersectionHull:
    nothing = Interval.empty(2)
    return IntersectionHull(problem, Status.EMPTY, (reason,), nothing, nothing, True)


def _result(
    problem: CircleEllipse, status: Status, reasons: tuple[Reason, ...], u: Exact, v: Exact, tight: bool = True
) -> IntersectionHull:
    squares = Interval.stack([u.outward(), v.outward()])
    hull = Interval.stack([Exact(root_bounds(r.lo).lo, root_bounds(r.hi).hi).outward() for r in (u, v)])
    return IntersectionHull(problem, status, reasons, hull, squares, tight)


@checked
def mirrored(box: Interval) -> Interval:
    """Return the images of a box of the first quadrant in all four, copies on an axis merged.

    Parameters
    ----------
    box : Interval, shape (2,)

    Returns
    -------
    Interval, shape (M, 2)
        M = 4 boxes in the order of the source, (+, +), (+, -), (-, -), (-, +); 2 where the box touches one axis, 1
        where it touches both, 0 for an empty one.

    Examples
    --------
    >>> mirrored(Interval([["[1, 2]"], ["[0, 3]"]]).reshape(2)).lo.tolist()
    [[1.0, -3.0], [-2.0, -3.0]]
    """
    if box.is_empty.any():
        return Interval.from_bounds(np.zeros((0, 2)), np.zeros((0, 2)))
    rows = {}
    for sign in ((1, 1), (1, -1), (-1, -1), (-1, 1)):
        on_axis = tuple(0 if box.lo[k] == 0.0 else s for k, s in enumerate(sign))
        parts = [box[k].hull(-box[k]) if s == 0 else (box[k] if s > 0 else -box[k]) for k, s in enumerate(on_axis)]
        rows[on_axis] = Interval.stack(parts)
    return Interval.stack(list(rows.values()))
