"""Exact hull of the intersection of a circle and an ellipse with tolerances, in the squares of the coordinates.

With ``u = x^2`` and ``v = y^2`` the problem is linear, its solution set a parallelogram cut by the axes.  The hull is
computed in rational numbers and rounded outward once, at the square root.  See theory/circle-and-ellipse 7, 8,
theory/interval-tests 3 and theory/extreme-cases 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from graphsynth.core.checks import checked
from graphsynth.intervals.boxes import Status
from graphsynth.intervals.guard import check_rounding
from graphsynth.intervals.interval import Interval
from graphsynth.jamming.intersection.problem import CircleEllipse, Exact, Reason, outward, root_bounds

if TYPE_CHECKING:
    from graphsynth.jamming.intersection.problem import CircleEllipse


#: On the exact hull enlarged by s the image has radius 1 + s^2 rho: below s for some s only if rho < 1/4
#: (theory/interval-tests 3).
RHO_LIMIT = 0.25


@checked
def spectral_radius(problem: CircleEllipse, box: Interval) -> float:
    """Spectral radius of ``|I - Y L|`` on a box of the quadrant, Y the inverse of mid L.

    An estimate in double precision.  As ``I - Y mid L = 0``, it is the radius of ``|Y| rad L``; infinite where mid L
    is singular (a circle, or a box at the origin).

    Examples
    --------
    >>> from graphsynth.jamming.intersection import circle_ellipse
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

    Attributes
    ----------
    status : Status
        ``UNIQUE``: one intersection inside the quadrant for every choice of the parameters; ``EMPTY``: none for any;
        ``UNDECIDED``: neither holds, or it depends on the parameters: see ``reasons``.
    reasons : tuple of Reason
        Why, one or two.
    hull : Interval, shape (2,)
        Of all solutions (x, y) with x, y >= 0: certified, exact up to outward rounding if ``tight``.
    squares : Interval, shape (2,)
        Hull of (x^2, y^2).
    tight : bool
        False only where the ranges of a and b overlap, so that the hull is an enclosure and not exact.
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

    Parameters
    ----------
    problem : CircleEllipse

    Returns
    -------
    IntersectionHull
        Certified; the hull is exact up to one rounding of each bound.

    Raises
    ------
    GraphsynthError
        If the processor's rounding has been changed.

    Notes
    -----
    See theory/circle-and-ellipse 7; for ranges of the radii the same two corners of the parameters are extreme (6.3,
    with eps too: ``u = A (Q - B)/(A - B)`` grows with Q and falls with A and B while B <= Q <= A).

    Examples
    --------
    >>> from graphsynth.jamming.intersection import circle_ellipse
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
    reasons = _touches(problem, least[0], most[1])
    status = Status.UNDECIDED if reasons else Status.UNIQUE
    return _result(problem, status, reasons or (Reason.INTERSECTION,), Exact(u_min, u_max), Exact(v_min, v_max))


def _corner(a: Fraction, b: Fraction, Q: Fraction, E: Fraction) -> tuple[Fraction, Fraction]:
    """Solution (u, v) of ``u + v = Q``, ``u/a^2 + v/b^2 = E``."""
    span = (a - b) * (a + b)
    return a * a * (Q - b * b * E) / span, b * b * (a * a * E - Q) / span


def _touches(problem: CircleEllipse, u: Fraction, v: Fraction) -> tuple[Reason, ...]:
    """Reasons why not every choice of the parameters has a intersection inside the quadrant."""
    sharp = problem.R1.is_point and problem.e1.hi == 0 == problem.e2.hi
    reasons = []
    if u <= 0:
        reasons.append(Reason.TANGENT_SHORT if sharp and problem.b == problem.R1 else Reason.TOUCHES_X)
    if v <= 0:
        reasons.append(Reason.TANGENT_LONG if sharp and problem.a == problem.R1 else Reason.TOUCHES_Y)
    return tuple(reasons)


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
    hull = Interval.stack([outward(root_bounds(r.lo).lo, root_bounds(r.hi).hi) for r in (u, v)])
    return IntersectionHull(problem, status, reasons, hull, squares, tight)


@checked
def mirrored(box: Interval) -> Interval:
    """Return the images of a box of the first quadrant in all four, copies on an axis merged.

    Parameters
    ----------
    box : Interval, shape (2,)
        With bounds of at least 0, or empty.

    Returns
    -------
    Interval, shape (M, 2)
        M = 4 boxes; 2 where the box touches one axis, 1 where it touches both, 0 for an empty one.  Order: as in the
        source, (+, +), (+, -), (-, -), (-, +).

    Examples
    --------
    >>> mirrored(Interval([["[1, 2]"], ["[0, 3]"]]).reshape(2)).lo.tolist()
    [[1.0, -3.0], [-2.0, -3.0]]
    """
    if box.is_empty.any():
        return Interval.from_bounds(np.zeros((0, 2)), np.zeros((0, 2)))
    signs = []
    for sx, sy in ((1, 1), (1, -1), (-1, -1), (-1, 1)):
        sign = (0 if box.lo[0] == 0.0 else sx, 0 if box.lo[1] == 0.0 else sy)
        if sign not in signs:
            signs.append(sign)
    rows = []
    for sign in signs:
        parts = [box[k].hull(-box[k]) if s == 0 else (box[k] if s > 0 else -box[k]) for k, s in enumerate(sign)]
        rows.append(Interval.stack(parts))
    return Interval.stack(rows)
