"""Circle and ellipse by Krawczyk's method in (x, y) with bisection, as in the source, but with sound statuses.

See theory/interval-tests 1, 2: an empty image proves that there is no intersection, an image in the interior of
its box that there is exactly one, and an overlap proves nothing.  `cross_check` compares with the exact hull.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.arguments import Real
from graphsynth.core.checks import checked
from graphsynth.core.errors import IntervalError
from graphsynth.intervals.boxes import Status
from graphsynth.intervals.guard import check_rounding
from graphsynth.intervals.interval import Interval
from graphsynth.jamming.intersection.hull import (
    CircleEllipse,
    IntersectionHull,
    Reason,
    exact_hull,
    mirrored,
    spectral_radius,
)

Array = NDArray[np.float64]
#: Boxes treated between two looks at the clock.
_BATCH = 4096
_MOST_PROVED = 16
_MOST_BOXES = 20_000_000
_MOST_POWER = 900


@dataclass(frozen=True, eq=False)
class IntersectionBoxes:
    """Outcome of `krawczyk_boxes`, for the first quadrant.

    ``EMPTY``: no intersection; ``UNIQUE``: exactly one in the quadrant, for every choice of the parameters; ``EXISTS``:
    at least one for every choice, but boxes are left that may hold more; ``UNDECIDED``: see ``reasons``.  ``rows`` are
    ``proved``, ``domains``, ``inner``, ``boundary`` as bounds x lo, x hi, y lo, y hi, (K, 4) each.  Not ``finished``: a
    limit ended the search; all boxes together hold every solution all the same.
    """

    problem: CircleEllipse
    status: Status
    reasons: tuple[Reason, ...]
    rows: tuple[Array, Array, Array, Array] = field(repr=False)
    finished: bool
    tested: int
    seconds: float = field(compare=False)

    @cached_property
    def proved(self) -> Interval:
        """Enclosures of intersections that exist and are unique in the matching row of ``domains``, shape (P, 2)."""
        return _intervals(self.rows[0])

    @cached_property
    def domains(self) -> Interval:
        """Boxes in which each of the proved ones is the only intersection, shape (P, 2)."""
        return _intervals(self.rows[1])

    @cached_property
    def inner(self) -> Interval:
        """Boxes of which every point is a solution for some choice of the parameters, shape (M, 2)."""
        return _intervals(self.rows[2])

    @cached_property
    def boundary(self) -> Interval:
        """Boxes about which nothing is proved: a layer around a thick solution set, boxes not treated; shape (N, 2)."""
        return _intervals(self.rows[3])

    @property
    def spectral_radius(self) -> float:
        """``rho(|I - Y L|)`` on ``outer``, an estimate."""
        return spectral_radius(self.problem, self.outer)

    @property
    def boxes(self) -> Interval:
        """All boxes, shape (K, 2): every solution lies in one of them."""
        return _intervals(np.concatenate([self.rows[0], self.rows[2], self.rows[3]]))

    @property
    def outer(self) -> Interval:
        """Hull of all boxes, shape (2,)."""
        return _hull_of(self.boxes)

    @property
    def inside(self) -> Interval:
        """Hull of the inner boxes, shape (2,): part of the solution set; empty if there are none."""
        return _hull_of(self.inner)

    @property
    def four(self) -> Interval:
        """Hulls of the intersections in all quadrants, copies on an axis merged; see `mirrored`."""
        return mirrored(self.outer)


def _hull_of(boxes: Interval) -> Interval:
    if len(boxes) == 0:
        return Interval.empty(2)
    return Interval.from_bounds(boxes.lo.min(axis=0), boxes.hi.max(axis=0))


@checked
def krawczyk_data(problem: CircleEllipse, power: int = 0) -> Array:
    """Bounds of the two right-hand sides and of 1/a^2 and 1/b^2, lengths in units of ``2**power``, rounded outward."""
    (low, high), level = _squared_radii(problem), problem.e2.hi
    one = level.denominator
    ends = [(*_scaled(*low, -2 * power), 0), (*_scaled(*high, -2 * power), 1)]
    ends += [(one - level.numerator, one, 0), (one + level.numerator, one, 1)]
    for r in (problem.a, problem.b):
        for side, end in enumerate((r.hi, r.lo)):
            ends.append((*_scaled(end.denominator**2, end.numerator**2, 2 * power), side))
    return np.array([_bounds(top, bottom)[side] for top, bottom, side in ends])


def _squared_radii(problem: CircleEllipse) -> list[tuple[int, int]]:
    """Smallest and largest ``x^2 + y^2`` as quotients of integers, not reduced."""
    e = problem.e1.hi
    found = []
    for sign, r in ((-1, problem.R1.lo), (1, problem.R1.hi)):
        bottom = r.denominator**2
        found.append((r.numerator**2 * e.denominator + sign * e.numerator * bottom, bottom * e.denominator))
    return found


def _scaled(top: int, bottom: int, power: int) -> tuple[int, int]:
    """Multiply a quotient by ``2**power``."""
    return (top << power, bottom) if power >= 0 else (top, bottom << -power)


def _bounds(top: int, bottom: int) -> tuple[float, float]:
    """Return the tightest doubles around a quotient of integers (``bottom > 0``), which need not be reduced."""
    try:
        nearest = top / bottom  # correctly rounded
    except OverflowError:
        return (math.nextafter(math.inf, 0.0), math.inf) if top > 0 else (-math.inf, -math.nextafter(math.inf, 0.0))
    n, d = nearest.as_integer_ratio()
    excess = n * bottom - top * d
    low = math.nextafter(nearest, -math.inf) if excess > 0 else nearest
    return low, math.nextafter(nearest, math.inf) if excess < 0 else nearest


@checked
def krawczyk_boxes(
    problem: CircleEllipse, *, tolerance: Real = 1e-6, max_boxes: Real = 20_000, max_seconds: Real = 60.0
) -> IntersectionBoxes:
    """Solve the problem by bisection and Krawczyk's test in (x, y).

    Parameters
    ----------
    problem : CircleEllipse
    tolerance : float
        Boxes with both sides below ``tolerance`` times the side of the start box are not cut further.
    max_boxes, max_seconds : int, float
        Limits on the boxes tested and on the run time; waiting boxes are then reported as boundary.

    Returns
    -------
    IntersectionBoxes
        Certified, whatever the limit.

    Raises
    ------
    IntervalError
        For limits that are not positive, and more than 20 million boxes.

    Examples
    --------
    >>> from graphsynth.jamming.intersection.hull import circle_ellipse
    >>> found = krawczyk_boxes(circle_ellipse(5, 6, 4, eps="1e-9"))
    >>> found.status.name, len(found.four), found.finished
    ('UNIQUE', 4, True)
    """
    check_rounding()
    for name, value in (("tolerance", tolerance), ("max_boxes", max_boxes), ("max_seconds", max_seconds)):
        if not value > 0:
            raise IntervalError(f"{name} = {value} must be positive; give a number above 0")
    if not isinstance(max_boxes, int | np.integer) or max_boxes > _MOST_BOXES:
        raise IntervalError(
            f"max_boxes = {max_boxes} must be an integer of at most {_MOST_BOXES}; use fewer, or a tolerance"
        )
    from graphsynth.jamming.intersection import kernels

    begin = perf_counter()
    # side of the start box in units of 2**power, about 1: the same boxes for every unit of length
    top, bottom = _squared_radii(problem)[1]
    power = (top.bit_length() - bottom.bit_length()) // 2
    if abs(power) > _MOST_POWER:
        raise IntervalError(
            f"R1 = {float(problem.R1.hi)} is beyond the range for boxes; choose a unit of length nearer to it"
        )
    side = math.nextafter(math.sqrt(_bounds(*_scaled(top, bottom, -2 * power))[1]), math.inf)
    queue, state = np.empty((2 * max_boxes + 2, 4)), np.zeros(5, dtype=np.int64)
    queue[0], state[kernels.TAIL] = (0.0, side, 0.0, side), 1
    kept, inner = np.empty((max_boxes + 1, 4)), np.zeros(max_boxes + 1, dtype=np.bool_)
    proved, data = np.empty((_MOST_PROVED, 8)), krawczyk_data(problem, power)
    seconds = 0.0
    while state[kernels.HEAD] < state[kernels.TAIL] and state[kernels.TESTED] < max_boxes and seconds < max_seconds:
        limit = min(int(state[kernels.TESTED]) + _BATCH, max_boxes)
        kernels.search(queue, state, kept, inner, proved, data, tolerance * side, limit)
        seconds = perf_counter() - begin
    head, tail, tested, found, count = state.tolist()
    within, layer = kept[:count], queue[head:tail]
    if count:
        solved = inner[:count]
        within, layer = within[solved], np.concatenate([within[~solved], layer])
    parts = [_carried(part, power) for part in (proved[:found, 4:], proved[:found, :4], within, layer)]
    return _outcome(problem, parts, head == tail, tested, seconds, tested >= max_boxes)


def _carried(rows: Array, power: int) -> Array:
    """Multiply boxes by ``2**power``; bounds that become subnormal and are rounded move outward."""
    if len(rows) == 0 or power >= 0:
        return rows * 2.0**power
    moved = np.ldexp(rows, power)
    lost = np.ldexp(moved, -power) - rows
    side = np.tile([-1.0, 1.0], rows.shape[1] // 2)
    return np.asarray(np.where(lost * side < 0.0, np.nextafter(moved, side * np.inf), moved))


def _intervals(rows: Array) -> Interval:
    return Interval.from_bounds(rows[:, ::2], rows[:, 1::2])


def _outcome(
    problem: CircleEllipse, parts: list[Array], finished: bool, tested: int, seconds: float, full: bool
) -> IntersectionBoxes:
    """Drop boxes that a proved intersection stands for, and say what is known."""
    enclosures, domains, inner, rest = parts
    for domain in domains if len(rest) else ():
        for_it = (rest[:, ::2] >= domain[::2]).all(axis=1) & (rest[:, 1::2] <= domain[1::2]).all(axis=1)
        rest = rest[~for_it]
    left = len(rest) + len(inner) > 0
    if len(domains):
        status = Status.EXISTS if left or len(domains) > 1 else Status.UNIQUE
    else:
        status = Status.UNDECIDED if left else Status.EMPTY
    reasons = [Reason.INTERSECTION] if status is Status.UNIQUE else []
    if status is Status.EMPTY:
        outside = problem.circle_bounds.lo > problem.a.lo**2
        reasons.append(Reason.CIRCLE_OUTSIDE if outside else Reason.CIRCLE_INSIDE)
    elif left:
        reasons.append(Reason.RESOLUTION if finished else Reason.BOXES if full else Reason.SECONDS)
    rows = (enclosures, domains, inner, rest)
    return IntersectionBoxes(problem, status, tuple(reasons), rows, finished, tested, seconds)


@dataclass(frozen=True, eq=False)
class CrossCheck:
    """Both solutions of one problem, and whether they can be true together.

    ``hull_in_boxes``: the exact hull lies in the hull of all boxes, as it does if both are right and the hull is tight.
    ``inner_in_hull``: the inner boxes, which are solutions, lie in the exact hull.  ``statuses_agree``: neither has
    proved what the other has disproved.
    """

    hull: IntersectionHull
    boxes: IntersectionBoxes
    hull_in_boxes: bool
    inner_in_hull: bool
    statuses_agree: bool

    @property
    def consistent(self) -> bool:
        """Whether nothing contradicts; False means a defect of the program."""
        return self.hull_in_boxes and self.inner_in_hull and self.statuses_agree


@checked
def cross_check(problem: CircleEllipse, **limits: Any) -> CrossCheck:
    """Solve a problem by both methods and compare what they prove.

    Parameters
    ----------
    problem, **limits
        As for `krawczyk_boxes`.

    Returns
    -------
    CrossCheck
        Both outcomes, and whether all they prove can hold together (certified).

    Examples
    --------
    >>> from graphsynth.jamming.intersection.hull import circle_ellipse
    >>> found = cross_check(circle_ellipse(5, 6, 4, eps="1e-6"))
    >>> found.consistent, found.hull.status is found.boxes.status
    (True, True)
    """
    hull, boxes = exact_hull(problem), krawczyk_boxes(problem, **limits)
    covered = not hull.tight or bool(hull.hull.subset(boxes.outer).all())
    if boxes.status is Status.UNIQUE and hull.tight:
        covered = covered and bool(hull.hull.subset(boxes.proved[0]).all())
    return CrossCheck(hull, boxes, covered, bool(boxes.inside.subset(hull.hull).all()), _agree(hull, boxes))


def _agree(hull: IntersectionHull, boxes: IntersectionBoxes) -> bool:
    if boxes.status is Status.EMPTY or hull.status is Status.EMPTY:
        found = len(boxes.proved) + len(boxes.inner) > 0
        return not found and (boxes.status is not Status.EMPTY or hull.status is Status.EMPTY)
    # a intersection proved for every choice of the parameters cannot vanish or be double for some
    return len(boxes.proved) == 0 or hull.status is Status.UNIQUE or not hull.tight
