"""Bounds that do not rest on monotonicity: branch and bound, and Monte-Carlo samples with a search over corners.

Branch and bound encloses the largest value of a function over a box with proof (theory/jam-arcs 6): for
quantities that are not monotone in every parameter, and for functions of the user.  All boxes of a round are evaluated
at once; derivatives, where the function gives them, remove variables in which it is monotone and tell where to cut.

Samples prove nothing about freedom (theory/jam-arcs 8).  They show how far the certified bound is from what is seen: a
sample above the bound would be a bug, a large distance would mean overestimation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import product
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.arguments import Budget, Count
from graphsynth.core.checks import called, checked
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.bearing.certify import certify_jamming
from graphsynth.jamming.bearing.parameters import ToleranceBox

if TYPE_CHECKING:
    from graphsynth.intervals import Dual, Interval

Array = NDArray[np.float64]
_ROUND = 4096  # boxes evaluated at once
_ENOUGH = 64


@dataclass(frozen=True, eq=False)
class Supremum:
    """The largest value of a function over a box, between certified bounds.

    An infinite bound says that nothing is known there; at ``point`` (n,) the value is at least ``lower``.  ``boxes``
    were evaluated, and ``waiting`` ones not settled when the search stopped; it is ``finished`` if the bounds are as
    close as asked, or their sign decides what was asked.
    """

    lower: float
    upper: float
    point: Array
    boxes: int
    waiting: int
    finished: bool
    seconds: float = field(default=0.0, compare=False)


@checked
def maximise(
    function: Callable[[Sequence[Dual]], Dual],
    box: Interval,
    *,
    tolerance: float = 0.0,
    decide_sign: bool = False,
    max_boxes: Count = 200_000,
    max_seconds: Budget = math.inf,
    tried: Interval | None = None,
) -> Supremum:
    """Enclose the largest value of a function over a box.

    Parameters
    ----------
    function : callable
        Takes n `Dual` variables of shape (N,), returns a `Dual` of shape (N,); written with operators and the functions
        of `graphsynth.intervals`.
    box : Interval, shape (n,)
    tolerance, decide_sign : float, bool
        Stop when the bounds are this close; stop as soon as the largest value is proved negative or positive.
    max_boxes, max_seconds : budgets
        Exhausted: the bounds found so far, ``finished`` False.
    tried : Interval, shape (n,), optional
        Where points are tried, if ``box`` is a box of doubles around exact ranges: the doubles inside each range, or
        those around it where there is none (then ``lower`` holds for every value between them).

    Returns
    -------
    Supremum
        Certified.

    Raises
    ------
    GeometryError
        If the box is empty or unbounded.

    Examples
    --------
    >>> from graphsynth.intervals import Interval, sin
    >>> found = maximise(lambda x: sin(x[0]) * x[1], Interval(["[0, 3]", "[-1, 2]"]), tolerance=1e-9)
    >>> found.lower <= 2.0 <= found.upper, found.upper - found.lower <= 1e-9
    (True, True)
    """
    from graphsynth.intervals import check_rounding

    begin = perf_counter()
    check_rounding()
    tried = box if tried is None else tried
    for name, given in (("box", box), ("tried", tried)):
        if given.ndim != 1 or given.shape != box.shape or not bool(given.is_bounded.all()):
            raise GeometryError(f"{name} = {given!r} must be a vector of bounded intervals, one for each variable")
    search = _Search(function, box, tried)
    while len(search.bound) and search.boxes < max_boxes and perf_counter() - begin < max_seconds:
        if search.settled(tolerance, decide_sign):
            break
        search.round(min(_ROUND, max_boxes - search.boxes))
    done = search.settled(tolerance, decide_sign)
    found = search.best, search.upper(), search.point, search.boxes, len(search.bound)
    return Supremum(*found, done, perf_counter() - begin)


class _Search:
    """Boxes with their upper bounds, largest first."""

    def __init__(self, function: Callable[[Sequence[Dual]], Dual], box: Interval, tried: Interval) -> None:
        self.function, self.tried = function, tried
        self.lo, self.hi = box.lo[None, :].copy(), box.hi[None, :].copy()
        self.bound = np.array([math.inf])
        self.best, self.point, self.boxes = -math.inf, box.mid, 0
        self.closed = -math.inf  # bound of the boxes too small to cut

    def upper(self) -> float:
        return max(self.best, self.closed, float(self.bound.max(initial=-math.inf)))

    def settled(self, tolerance: float, decide_sign: bool) -> bool:
        if decide_sign and (self.best > 0.0 or self.upper() < 0.0):
            return True
        return self.upper() - self.best <= tolerance

    def round(self, count: int) -> None:
        order = np.argsort(-self.bound, kind="stable")
        first, rest = order[:count], order[count:]
        lo, hi = self.lo[first], self.hi[first]
        self.lo, self.hi, self.bound = self.lo[rest], self.hi[rest], self.bound[rest]
        value_hi, slope_lo, slope_hi = self._evaluate(lo, hi)
        # where the function only grows or only falls in a variable, the largest value lies at that end
        low_face, high_face = (slope_hi <= 0.0) & (slope_lo < 0.0), slope_lo >= 0.0
        lo, hi = np.where(high_face, hi, lo), np.where(low_face, lo, hi)
        smaller = (low_face | high_face).any(axis=1)
        if smaller.any():
            again, slope_lo[smaller], slope_hi[smaller] = self._evaluate(lo[smaller], hi[smaller])
            value_hi[smaller] = np.minimum(value_hi[smaller], again)
        self._points(0.5 * lo + 0.5 * hi)
        alive = value_hi > self.best
        lo, hi, value_hi = lo[alive], hi[alive], value_hi[alive]
        reach = np.maximum(np.abs(slope_lo), np.abs(slope_hi))[alive]
        self._cut(lo, hi, value_hi, reach)
        # few boxes cost as much as many: cut on with the same slopes, so that long arrays take the compiled path
        while len(first) and 0 < len(self.bound) < _ENOUGH and len(self.bound) > len(rest):
            count = len(self.bound)
            first_lo, first_hi, bound = self.lo[len(rest) :], self.hi[len(rest) :], self.bound[len(rest) :]
            self.lo, self.hi, self.bound = self.lo[: len(rest)], self.hi[: len(rest)], self.bound[: len(rest)]
            reach = np.tile(reach, (2, 1)) if len(reach) * 2 == len(bound) else np.ones_like(first_lo)
            self._cut(first_lo, first_hi, bound, reach)
            if len(self.bound) <= count:
                break
        keep = self.bound > self.best
        self.lo, self.hi, self.bound = self.lo[keep], self.hi[keep], self.bound[keep]

    def _value(self, lo: Array, hi: Array) -> tuple[Interval, Interval | None]:
        """Return the function over boxes and, where it gives them, its derivatives."""
        from graphsynth.intervals import Dual, Interval, variables

        found: Any = called("the function", self.function, variables(Interval.from_bounds(lo, hi)))
        if isinstance(found, Dual):
            return found.value, found.grad
        if not isinstance(found, Interval):
            raise GeometryError(f"the function returns {found!r}; write it with operators: it returns a Dual")
        return found, None

    def _evaluate(self, lo: Array, hi: Array) -> tuple[Array, Array, Array]:
        value, grad = self._value(lo, hi)
        self.boxes += len(lo)
        top = np.where(np.broadcast_to(value.is_empty, (len(lo),)), -np.inf, np.broadcast_to(value.hi, (len(lo),)))
        if grad is None:
            unknown = np.full(lo.shape, np.inf)
            return top, -unknown, unknown
        shape = lo.shape[::-1]
        low, high = np.broadcast_to(grad.lo, shape).T, np.broadcast_to(grad.hi, shape).T
        sound = np.broadcast_to(value.guaranteed, (len(lo),))[:, None]
        broken = (low > high) | ~sound  # an empty derivative, or one beside a hole of the domain, says nothing
        return top.copy(), np.where(broken, -np.inf, low), np.where(broken, np.inf, high)

    def _points(self, points: Array) -> None:
        points = np.clip(points, self.tried.lo, self.tried.hi)
        around = self.tried.width <= 2.0 * np.spacing(self.tried.mag)  # neighbouring doubles: the range lies between
        lo, hi = np.where(around, self.tried.lo, points), np.where(around, self.tried.hi, points)
        value = self._value(lo, hi)[0]
        low = np.where(value.is_empty | ~value.guaranteed, -np.inf, value.lo)
        low = np.broadcast_to(low, (len(points),))
        top = int(low.argmax())
        if low[top] > self.best:
            self.best, self.point = float(low[top]), points[top].copy()

    def _cut(self, lo: Array, hi: Array, bound: Array, reach: Array) -> None:
        width = hi - lo
        with np.errstate(invalid="ignore", over="ignore"):
            gain = np.where(width > 0.0, width * np.where(np.isfinite(reach), reach, 1e300), 0.0)
        column = gain.argmax(axis=1)
        row = np.arange(len(lo))
        fallback = width.argmax(axis=1)
        column = np.where(width[row, column] > 0.0, column, fallback) if len(lo) else column
        middle = 0.5 * lo[row, column] + 0.5 * hi[row, column]
        small = (middle <= lo[row, column]) | (middle >= hi[row, column])
        self.closed = max(self.closed, float(bound[small].max(initial=-math.inf)))
        lo, hi, bound, column, middle = lo[~small], hi[~small], bound[~small], column[~small], middle[~small]
        row = np.arange(len(lo))
        left_hi, right_lo = hi.copy(), lo.copy()
        left_hi[row, column], right_lo[row, column] = middle, middle
        self.lo = np.concatenate([self.lo, lo, right_lo])
        self.hi = np.concatenate([self.hi, left_hi, hi])
        self.bound = np.concatenate([self.bound, bound, bound])


#: Parameters of the interference over a full rotation, in the order of the variables of `interference_function`.
INTERFERENCE_VARIABLES = ("l2", "l3", "alpha", "Rb", "Hb", "clearance", "hole_length")


def interference_function(
    condition: Condition, axis: tuple[Any, Any, Any] = (1, 0, 0)
) -> Callable[[Sequence[Dual]], Dual]:
    """Return the interference at the worst angle as a function of l2, l3, alpha, Rb, Hb, clearance[, hole_length].

    For `maximise`; the axis is fixed, the rod rigid.  It uses none of the monotonicity of `certify_jamming`.
    """
    from graphsynth.intervals import Dual, Interval, minimum, sin, sqrt

    n = [Interval(part) for part in axis]
    flat, steep = n[0].sqr() + n[1].sqr(), n[2].sqr()
    inclination = flat / (flat + steep)

    def interference(v: Sequence[Dual]) -> Dual:
        l2, l3, alpha, R, height, c = v[:6]
        half = sin(alpha / 2)  # sqrt(d (2 - d)) with d = 2 half^2 (1 - n3^2), written with a bounded derivative at 0
        S: Dual = l2 / l3 * (abs(half) * (inclination.sqrt() * 2) * sqrt(1 - half.sqr() * inclination))
        C = sqrt((1 - S) * (1 + S))
        h = height / 2
        bend = S.sqr() / (1 + C)
        if condition == "B":
            shaft: Dual = h * S - c + (R + c) * bend
            return shaft
        # the second branch where R S > h C; the hull of both where that is not known
        switch, low, high = R * S - h * C, h * S - c - R * bend, sqrt(R.sqr() + h.sqr()) - (R + c)
        below, above = switch.value.hi <= 0.0, switch.value.lo > 0.0
        parts = []
        for first, second in ((low.value, high.value), (low.grad, high.grad)):
            hull = first.hull(second)
            lo = np.where(below, first.lo, np.where(above, second.lo, hull.lo))
            hi = np.where(below, first.hi, np.where(above, second.hi, hull.hi))
            parts.append(Interval.from_bounds(lo, hi))
        a = Dual(*parts)
        if condition == "A":
            return a
        slanted: Dual = minimum(a, (v[6] / 2 * S - c + (R + c) * bend) / C)
        return slanted

    return interference


@checked
def largest_interference(box: ToleranceBox, condition: Condition = "A", **options: Any) -> Supremum:
    """Enclose the largest interference (mm) over a turn and a tolerance box by branch and bound.

    Slower than the two corners of `certify_jamming`, and independent of the monotonicity that they rest on.

    Parameters
    ----------
    box, condition : ToleranceBox, {"A", "B", "general"}
        With a fixed axis and a rigid rod; contact condition.
    **options
        As for `maximise`.

    Returns
    -------
    Supremum
        Lower and upper bound of the largest interference, mm (certified), and where it is.

    Raises
    ------
    GeometryError
        For a range of axes, or the rod of the source.

    Examples
    --------
    >>> box = ToleranceBox(alpha="0.0130 +- 0.00013", clearance="0.03 +- 0.003")
    >>> found = largest_interference(box, decide_sign=True)
    >>> found.upper < 0, found.boxes < 100
    (True, True)
    """
    from graphsynth.intervals import Interval
    from graphsynth.jamming.bearing.corners import check_condition

    check_condition(box, condition)
    axis = [box[f"n{i}"] for i in (1, 2, 3)]
    if box.rod != "rigid" or not all(part.is_point for part in axis):
        raise GeometryError("branch and bound needs a fixed axis and a rigid rod; use certify_jamming for this box")
    names = INTERFERENCE_VARIABLES[: 7 if condition == "general" else 6]
    start = Interval.stack([box.outer(name) for name in names])
    function = interference_function(condition, (axis[0].lower, axis[1].lower, axis[2].lower))
    return maximise(function, start, tried=Interval.stack([box[name].doubles for name in names]), **options)


_BATCH = 100_000


@dataclass(frozen=True)
class Samples:
    """What was sampled, beside what is proved.

    ``count`` parameter vectors with a crank angle, uniform in the box and over the turn, and all ``corners`` of the box
    at the worst angle gave ``largest_interference`` and ``corner_interference`` at most, mm (estimated); ``outside`` of
    them lie above the certified ``bound``: anything but 0 is a bug.  ``jamming_positions`` is the part of the samples
    with a positive interference: the share of crank positions, over all parameter vectors.  ``jamming_mechanisms`` is
    the part of the parameter vectors that have one somewhere in the turn: the probability that a mechanism drawn from
    the box binds (estimated), whether that position can be assembled or not; ``jamming_mechanisms_range`` its
    confidence interval, 95 %, exact for the binomial distribution [Clopper & Pearson 1934].
    """

    count: int
    largest_interference: float
    jamming_positions: float
    jamming_mechanisms: float
    jamming_mechanisms_range: tuple[float, float]
    corner_interference: float
    corners: int
    bound: float
    outside: int
    seconds: float = field(default=0.0, compare=False)

    @property
    def overestimation(self) -> float:
        """Certified bound minus the largest interference seen, at the corners or in the samples, mm."""
        return self.bound - max(self.largest_interference, self.corner_interference)


@checked
def sample_interference(
    box: ToleranceBox, condition: Condition = "A", count: Count = 200_000, seed: int = 0
) -> Samples:
    """Draw parameter vectors and crank angles, search the corners, and compare with the certified bound.

    Parameters
    ----------
    box, condition : ToleranceBox, {"A", "B", "general"}
        The tolerance box, uniform and independent in every range; contact condition.
    count, seed : int
        Number of samples; seed of the generator.

    Returns
    -------
    Samples
        What was met, and whether it respects the certified bound.

    Raises
    ------
    GeometryError
        Unless ``count`` is a positive integer and ``seed`` one of zero or more, and what `certify_jamming` raises.

    Examples
    --------
    >>> box = ToleranceBox(alpha="0.0130 +- 0.00013", clearance="0.03 +- 0.003")
    >>> seen = sample_interference(box, count=2000)
    >>> seen.outside, seen.jamming_positions, seen.jamming_mechanisms, 0 <= seen.overestimation < 1e-15
    (0, 0.0, 0.0, True)
    >>> seen.jamming_mechanisms_range[1] < 0.002
    True
    """
    if seed < 0:
        raise GeometryError(f"seed = {seed!r} must be a whole number of zero or more")
    begin = perf_counter()
    bound = certify_jamming(box, condition).largest_interference.hi
    generator = np.random.default_rng(seed)
    best, jams, ever, outside = -math.inf, 0, 0, 0
    for start in range(0, count, _BATCH):
        size = min(_BATCH, count - start)
        values = {}
        for name in box.ranges:
            (_, low), (high, _) = box[name].ends
            values[name] = np.full(size, low) if low >= high else generator.uniform(low, high, size)
        interference = _interferences(box, condition, values, np.sin(generator.uniform(0.0, math.tau, size)))
        best = max(best, float(interference.max()))
        jams += int((interference > 0.0).sum())
        ever += int((_interferences(box, condition, values, np.ones(size)) > 0.0).sum())  # the tilt is largest there
        outside += int((interference > bound).sum())
    # the corners of the ranges that have a width, at the worst angle
    wide = [name for name in box.ranges if not box[name].is_point]
    signs = np.array(list(product((0, 1), repeat=len(wide)))).reshape(2 ** len(wide), len(wide))
    tried = len(signs)
    values = {name: np.full(tried, box[name].middle) for name in box.ranges}
    for column, name in enumerate(wide):
        values[name] = np.array([float(box[name].lower), float(box[name].upper)])[signs[:, column]]
    corner = float(_interferences(box, condition, values, np.ones(tried)).max())
    seen = best, jams / count, ever / count, _binomial_range(ever, count), corner, tried
    return Samples(count, *seen, bound, outside, perf_counter() - begin)


def _binomial_range(hits: int, count: int) -> tuple[float, float]:
    """Clopper and Pearson's interval of a probability, 95 %."""
    from scipy.special import betaincinv

    low = 0.0 if hits == 0 else float(betaincinv(hits, count - hits + 1, 0.025))
    return low, 1.0 if hits == count else float(betaincinv(hits + 1, count - hits, 0.975))


def _interferences(box: ToleranceBox, condition: str, v: dict[str, Array], wave: Array) -> Array:
    """Interference in doubles for parameter vectors and ``sin(f - psi1)``, stable form."""
    flat = v["n1"] ** 2 + v["n2"] ** 2
    deficit = 2.0 * np.sin(0.5 * v["alpha"]) ** 2 * flat / (flat + v["n3"] ** 2)
    ratio = v["l2"] / v["l3"] * np.sqrt(deficit * (2.0 - deficit)) * np.abs(wave)
    S = np.minimum(ratio, 1.0) if box.rod == "rigid" else ratio / np.hypot(1.0, ratio)
    C = np.sqrt((1.0 - S) * (1.0 + S))
    R, h, c = v["Rb"], 0.5 * v["Hb"], v["clearance"]
    if condition == "B":
        return np.asarray(h * S - c + (R + c) * S * S / (1.0 + C))
    saturated = (h * h - c * (2.0 * R + c)) / (np.hypot(R, h) + R + c)
    a = np.where(h * C >= R * S, h * S - c - R * S * S / (1.0 + C), saturated)
    if condition == "A":
        return np.asarray(a)
    with np.errstate(divide="ignore"):
        return np.minimum(a, (0.5 * v["hole_length"] * S - c + (R + c) * S * S / (1.0 + C)) / C)
