"""Boxes of the tolerances, cut until the probability of a negative margin lies between bounds close enough.

In every box the margin is a linear function and a remainder, from derivatives over the box; only the part of a box that
the linear function does not rule out is kept.  See theory/probability-of-jamming 1, 5.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Dual, Interval, check_rounding
from graphsynth.intervals.dual import variables
from graphsynth.intervals.reading import enclose
from graphsynth.jamming.chance.distributions import Bracket, Distribution, Trapezoids
from graphsynth.jamming.chance.halfspace import Sums, measures_below
from graphsynth.jamming.chance.margin import LinearMargin, Margin

Array = NDArray[np.float64]
Objects = NDArray[np.object_]
#: Ends of boxes are multiples of this.
_GRID = 2.0**32
#: Boxes cut at a time, at most.
_BATCH = 256
#: A box of less probability is left as it is.
_NOTHING = 1e-18
#: A bound that falls no further than by this share, for so many rounds, while boxes have sides below that: a surface.
_SAME, _STILL_ROUNDS, _THIN = 0.98, 4, 2.0**-20
_UNDECIDED = (
    " and no part was decided: the tolerances are too wide for it, or positions follow the lengths too fast (near a "
    "toggle); narrow them or the range of the input, or allow more seconds"
)
_NONE_PROVED = " and no member is proved to bind: allow more seconds, or narrow the widest tolerances"
_TOUCHING = "the tolerances touch the limit of binding: members there are proved neither to bind nor to be free"
_PIECE = Trapezoids(np.zeros(1), np.ones(1), np.ones(1), np.ones(1))
#: Stands for a quantity that does not matter.
_STILL = Bracket.of(_PIECE, _PIECE)


class Sources(NamedTuple):
    """Independent quantities; those of the margin are ``own`` plus ``effect`` times each common factor.

    ``own``: one distribution per quantity of the margin; ``common``: of the factors; ``effects`` (quantities, factors).
    """

    own: tuple[Distribution, ...]
    common: tuple[Distribution, ...]
    effects: tuple[tuple[Fraction, ...], ...]

    @property
    def every(self) -> tuple[Distribution, ...]:
        """All that vary: the own ones that are no points, then the common ones."""
        return (*(d for d in self.own if not d.is_point), *self.common)

    def quantities(self, v: Sequence[Any]) -> list[Any]:
        """Return the quantities of the margin for v of each source: intervals or duals."""
        rest = iter(v)
        own = [_spread(d, next(rest)) if not d.is_point else d.support.outer for d in self.own]
        common = [_spread(d, next(rest)) for d in self.common]
        for k, row in enumerate(self.effects):
            for effect, factor in zip(row, common):
                if effect:
                    own[k] = factor * Interval.from_bounds(*enclose(effect)) + own[k]
        return own

    def sampled(self, v: list[Array]) -> Array:
        """Return the quantities in floating point, (N, quantities), for v of each source."""
        rest = iter(v)

        def value(of: Distribution) -> Any:
            ends = of.support
            return float(ends.lower) + float(ends.upper - ends.lower) * (0.0 if of.is_point else next(rest))

        own = [value(d) for d in self.own]
        common = [value(d) for d in self.common]
        for k, row in enumerate(self.effects):
            own[k] = own[k] + sum(float(effect) * factor for effect, factor in zip(row, common))
        return np.stack(np.broadcast_arrays(*own, v[0])[:-1], axis=-1)


def _spread(of: Distribution, v: Any) -> Any:
    width = Interval.from_bounds(*enclose(of.support.upper - of.support.lower))
    return v * width + Interval.from_bounds(*of.support.ends[0])


class Affine(NamedTuple):
    """The margin over N boxes: negative only where ``weights (v - middle) < high``, and wherever it is ``< low``.

    ``weights`` (N, n); ``curved`` (N, n) what each quantity adds to the remainder.
    """

    weights: Array
    low: Array
    high: Array
    curved: Array


def affine(margin: Margin, sources: Sources, lo: Array, hi: Array) -> Affine:
    """Enclose the margin over boxes (N, n) by a linear function, by the mean value theorem one quantity at a time."""
    count, n = lo.shape
    middle, half = 0.5 * (lo + hi), 0.5 * (hi - lo)
    # the derivative by quantity j is needed over the first j quantities only, the others at their middles
    late = np.arange(n)[None, :] > np.arange(n)[:, None]
    first, last = (np.where(late, middle[:, None], end[:, None]).reshape(-1, n) for end in (lo, hi))
    every = margin.enclosed(sources.quantities(variables(Interval.from_bounds(first, last))))
    centre = margin.enclosed(sources.quantities([Interval.from_bounds(x, x) for x in middle.T]))
    value = every.value if isinstance(every, Dual) else every
    value, centre = _shaped(value, (count * n,)), _shaped(centre, (count,))
    weights, radius, sound = np.zeros((count, n)), np.full((count, n), np.inf), np.zeros(count, dtype=np.bool_)
    curved = np.where(half > 0.0, half, 0.0)
    if isinstance(every, Dual):
        grad = _shaped(every.grad, (n, count * n)).reshape(n, count, n)
        fine = grad.guaranteed & grad.is_bounded & np.broadcast_to(value.guaranteed, (count * n,)).reshape(count, n)
        sound = fine.all(axis=(0, 2)) & centre.guaranteed
        slopes = grad[np.arange(n), :, np.arange(n)]  # (n, count): by quantity j over box j
        weights, radius = slopes.mid.T, slopes.rad.T
        curved = np.where(sound[:, None], grad[:, :, n - 1].rad.T * half, curved)
    rest = np.where(half > 0.0, radius * half, 0.0).sum(axis=1)
    middle_value = centre.mid
    wrong = (rest + centre.rad) * (1.0 + 4.0 * n * 2.0**-53) + 5e-324
    low, high = np.nextafter(-middle_value - wrong, -np.inf), np.nextafter(-middle_value + wrong, np.inf)
    # over the whole box, without derivatives: all or nothing where they are not known
    whole = value[n - 1 :: n]
    unsure = np.where(sound, 0.0, np.inf)
    low = np.where((whole.hi < 0.0) & whole.guaranteed, np.inf, np.where(sound, low, -unsure))
    high = np.where((whole.lo > 0.0) & whole.guaranteed, -np.inf, np.where(sound, high, unsure))
    return Affine(np.where(sound[:, None], weights, 0.0), low, high, curved)


def _unknown(count: int) -> Objects:
    """Nothing known of N boxes."""
    return np.full(count, None, dtype=object)


def _shaped(value: Any, shape: tuple[int, ...]) -> Interval:
    """Spread intervals to a shape."""
    if value.shape == shape:
        return value  # type: ignore[no-any-return]
    zero: Interval = Interval.zeros(shape) + value
    return zero


def linear(margin: Margin, sources: Sources, lo: Array, hi: Array, known: Objects) -> tuple[Affine, Objects]:
    """Enclose the margin over boxes (N, n) by a linear function: by its own bounds if it has any, else by derivatives.

    ``known`` (N,) is what a margin with bounds of its own already knows of each box, None for nothing.
    """
    if not isinstance(margin, LinearMargin):
        return affine(margin, sources, lo, hi), known
    middle = 0.5 * (lo + hi)
    at = sources.quantities([Interval.from_bounds(x, x) for x in middle.T])
    over = sources.quantities(variables(Interval.from_bounds(lo, hi))) if lo.shape[1] else at
    line, left = margin.lines(at, over, (lo, hi), list(known))
    fresh = np.empty(len(lo), dtype=object)
    fresh[:] = left
    return line, fresh


@dataclass
class Boxes:
    """Boxes that are not decided, with bounds of the probability of binding inside each; ``known`` by the margin."""

    lo: Array
    hi: Array
    lower: Array
    upper: Array
    curved: Array
    known: Objects

    def take(self, keep: Any) -> Boxes:
        """Keep some of the boxes."""
        return Boxes(*(getattr(self, name)[keep] for name in self.__dataclass_fields__))

    def joined(self, other: Boxes) -> Boxes:
        """Join the boxes of both."""
        pairs = ((getattr(self, name), getattr(other, name)) for name in self.__dataclass_fields__)
        return Boxes(*(np.concatenate(pair) for pair in pairs))


class Bounds(NamedTuple):
    """Enclosure of a probability, the boxes that were looked at, and why it is no tighter (empty: as asked)."""

    lower: float
    upper: float
    boxes: int
    reason: str


@dataclass
class Paver:
    """One question: the probability that a margin is negative.

    ``width``: wanted ``upper - lower``; ``ratio``: wanted ``upper / lower``, unless the upper end is below ``least``.
    ``allowed``: it is enough to know whether the probability is at most this.  ``seconds``: of the processor.
    """

    margin: Margin
    sources: Sources
    width: float = 1e-3
    ratio: float = 1.5
    least: float = 1e-12
    max_boxes: int = 20_000
    seconds: float = 60.0
    allowed: float | None = None
    boxes: int = 0
    decided: list[tuple[float, float]] = field(default_factory=list)

    def run(self) -> Bounds:
        """Cut the boxes that leave most undecided until the bounds are as close as wanted."""
        check_rounding()
        begin, self.every = process_time(), self.sources.every
        n = len(self.every)
        self.masses: list[dict[tuple[float, float], tuple[float, float]]] = [{} for _ in self.every]
        self.brackets: list[dict[tuple[float, float], Bracket]] = [{} for _ in self.every]
        if n == 0:
            return self._one_member()
        smooth = sum(d.kind in ("normal", "beta") for d in self.every)
        wanted = math.sqrt(40.0 * max(smooth, 1) / max(self.width, 1e-6))
        self.resolution = 1 << min(max(math.ceil(math.log2(wanted)), 5), 12)
        self.goal = self.width
        boxes = self.assessed(np.zeros((1, n)), np.ones((1, n)), _unknown(1))
        reason, before, still = "", 1.0, 0
        while True:
            lower, upper = self.total(boxes)
            self.goal = min(self.width, max((self.ratio - 1.0) * lower, 0.01 * upper if upper > self.least else 0.0))
            if upper - lower <= self.width and (upper <= self.ratio * lower or upper <= self.least):
                break
            if self.allowed is not None and not lower <= self.allowed < upper:
                break
            if self.boxes >= self.max_boxes or process_time() - begin > self.seconds or len(boxes.lo) == 0:
                reason = f"the limit of work was reached after {self.boxes} boxes"
                reason += "" if lower > 0.0 else _UNDECIDED if upper == 1.0 else _NONE_PROVED
                break
            still = still + 1 if lower == 0.0 and upper > _SAME * before and upper <= self.width else 0
            before = upper
            if still >= _STILL_ROUNDS and bool(((boxes.hi - boxes.lo).min(axis=1) < _THIN).all()):
                reason = _TOUCHING
                break
            boxes = self.refined(boxes)
        return Bounds(lower, upper, self.boxes, reason)

    def _one_member(self) -> Bounds:
        """Answer where nothing varies."""
        if isinstance(self.margin, LinearMargin):
            line, _ = linear(self.margin, self.sources, np.zeros((1, 0)), np.zeros((1, 0)), _unknown(1))
            binds, may = bool(line.low[0] > 0.0), bool(line.high[0] > 0.0)
        else:
            value = _shaped(self.margin.enclosed(self.sources.quantities([])), ())
            sure = bool(value.guaranteed)
            binds, may = sure and bool(value.hi < 0.0), not sure or bool(value.lo < 0.0)
        near = "the one member lies so close to the limit of binding that it is proved neither to bind nor to be free"
        return Bounds(float(binds), float(may), 1, "" if binds == may else near)

    def total(self, boxes: Boxes) -> tuple[float, float]:
        """Bounds of the sum over all boxes."""
        lower = math.fsum([*(a for a, _ in self.decided), *boxes.lower.tolist()])
        upper = math.fsum([*(b for _, b in self.decided), *boxes.upper.tolist()])
        return max(math.nextafter(lower, -1.0), 0.0), min(math.nextafter(upper, 2.0), 1.0) if upper > 0.0 else 0.0

    def refined(self, boxes: Boxes) -> Boxes:
        """Cut the boxes with the widest bounds, each across the quantity in which the margin is most curved."""
        gap = boxes.upper - boxes.lower
        order = np.argsort(-gap, kind="stable")
        enough = int(np.searchsorted(np.cumsum(gap[order]), 0.6 * gap.sum())) + 1
        chosen, rest = order[: min(enough, _BATCH)], order[min(enough, _BATCH) :]
        own = boxes.take(chosen)
        axis = own.curved.argmax(axis=1)
        rows = np.arange(len(axis))
        cut = np.round(0.5 * (own.lo + own.hi)[rows, axis] * _GRID) / _GRID
        left, right = own.hi.copy(), own.lo.copy()
        left[rows, axis] = right[rows, axis] = cut
        known = np.concatenate([own.known, own.known])
        fresh = self.assessed(np.concatenate([own.lo, right]), np.concatenate([left, own.hi]), known)
        return boxes.take(np.sort(rest)).joined(fresh)

    def assessed(self, lo: Array, hi: Array, known: Objects) -> Boxes:
        """Bound the probability in each box; boxes that are decided are booked and left out."""
        found: list[tuple[Any, ...]] = []
        for _ in range(6):  # as long as ruling out parts of a box pays, the margin is enclosed anew in the rest
            line, known = linear(self.margin, self.sources, lo, hi, known)
            self.boxes += len(lo)
            low, high = _contracted(lo, hi, line)
            alive = (low < high).all(axis=1)
            shrunk = alive & (np.prod((high - low) / np.where(hi > lo, hi - lo, 1.0), axis=1) < 0.8)
            done = alive & ~shrunk
            found.append((lo[done], hi[done], *(part[done] for part in line), known[done]))
            lo, hi, known = low[shrunk], high[shrunk], known[shrunk]
            if len(lo) == 0:
                break
        else:
            line, known = linear(self.margin, self.sources, lo, hi, known)
            found.append((lo, hi, *line, known))
        lo, hi, weights, low, high, curved, known = (np.concatenate(parts) for parts in zip(*found))
        lower, upper = self.bounds(lo, hi, weights, low, high)
        every = Boxes(lo, hi, lower, upper, curved, known)
        decided = np.isinf(low) & (low > 0.0) | (upper - lower <= _NOTHING)
        self.decided += list(zip(lower[decided].tolist(), upper[decided].tolist()))
        return every.take(~decided)

    def bounds(self, lo: Array, hi: Array, weights: Array, low: Array, high: Array) -> tuple[Array, Array]:
        """Bounds (N,) of the probability of binding within each box."""
        if len(lo) == 0:
            return np.zeros(0), np.zeros(0)
        masses = np.array(
            [[self.mass(k, *ends) for k, ends in enumerate(zip(*row))] for row in zip(lo.tolist(), hi.tolist())]
        )
        still = weights == 0.0
        slack = 1e-14
        # quantities that do not matter count by their probability, the others by their densities
        rest = [
            np.where(still, masses[:, :, side], 1.0).prod(axis=1) * (1.0 + sign * slack)
            for side, sign in enumerate((-1, 1))
        ]
        whole = [
            np.where(still, 1.0, masses[:, :, side]).prod(axis=1) * (1.0 + sign * slack)
            for side, sign in enumerate((-1, 1))
        ]
        sure = (low == np.inf) | (still.all(axis=1) & (low > 0.0))
        lower, upper = np.where(sure, whole[0], 0.0), whole[1].copy()
        rows = np.flatnonzero(~sure & np.isfinite(high) & ~still.all(axis=1) & (upper * rest[1] > _NOTHING))
        if rows.size:
            lines = weights[rows], np.stack([low[rows], high[rows]], axis=1)
            lower[rows], upper[rows] = self.half_spaces(lo[rows], hi[rows], *lines, whole[0][rows], whole[1][rows])
        return lower * rest[0], np.minimum(upper * rest[1], 1.0)

    def mass(self, k: int, a: float, b: float) -> tuple[float, float]:
        """Bounds of the probability of a piece of a source."""
        known = self.masses[k]
        if (a, b) not in known:
            known[a, b] = self.every[k].mass(a, b)
        return known[a, b]

    def bracket(self, k: int, a: float, b: float, moves: bool) -> Bracket:
        """Enclose the density of a source over a piece; of one that does not matter, a constant of mass 1."""
        if not moves:
            return _STILL
        known = self.brackets[k]
        if (a, b) not in known:
            known[a, b] = self.every[k].bracket(a, b, self.resolution)
        return known[a, b]

    def half_spaces(
        self, lo: Array, hi: Array, weights: Array, ends: Array, least: Array, most: Array
    ) -> tuple[Array, Array]:
        """Bounds (N,) for linear functions, with as many terms of the series as each remainder deserves.

        ``ends`` (N, 2): thresholds below which it binds for certain, and perhaps; ``least``, ``most`` (N,): bounds of
        the probability of each box.
        """
        brackets = [
            [self.bracket(k, a, b, w != 0.0) for k, (a, b, w) in enumerate(zip(*row))]
            for row in zip(lo.tolist(), hi.tolist(), weights.tolist())
        ]
        sums = Sums(weights, np.where(weights != 0.0, 0.5 * (lo + hi), 0.5), brackets, ends)
        below, above = np.zeros(len(lo)), most.copy()
        rows, tolerance = np.arange(len(lo)), np.full(len(lo), 1e-3)
        while rows.size:
            m = measures_below(sums.take(rows), tolerance[rows])
            down = np.maximum(m.lower[0, :, 0], least[rows] - m.mass[1] * (1.0 + 1e-15) + m.lower[1, :, 0])
            up = np.minimum(m.upper[1, :, 1], most[rows] - m.mass[0] * (1.0 - 1e-15) + m.upper[0, :, 1])
            below[rows], above[rows] = np.maximum(below[rows], down), np.minimum(above[rows], up)
            left = 2.0 * m.rest * most[rows]
            enough = np.maximum(0.1 * (above - below)[rows], 0.02 * self.goal * most[rows])
            more = (left > enough) & (tolerance[rows] > 1e-12) & (m.rest <= 2.0 * tolerance[rows])
            rows = rows[more]
            tolerance[rows] *= 1e-3
        return below, above


def _contracted(lo: Array, hi: Array, line: Affine) -> tuple[Array, Array]:
    """Return the smallest boxes, rounded outward to the grid, that hold all points a linear function does not rule out.

    A box without such points comes back reversed.
    """
    middle, half = 0.5 * (lo + hi), 0.5 * (hi - lo)
    sizes = np.abs(line.weights) * half
    reach = sizes.sum(axis=1)
    bound = (line.high + reach) * (1.0 + np.sign(line.high + reach) * 1e-12) + 1e-12 * reach
    none = (bound <= 0.0) | (line.high == -np.inf)
    with np.errstate(all="ignore"):
        room = (bound[:, None] - sizes) / np.abs(line.weights)
    open_ = ~(np.isfinite(room) & (line.weights != 0.0))
    room = np.where(open_, half, room)
    up = np.where(line.weights > 0.0, np.minimum(hi, np.ceil((middle + room) * _GRID + 1e-3) / _GRID), hi)
    down = np.where(line.weights < 0.0, np.maximum(lo, np.floor((middle - room) * _GRID - 1e-3) / _GRID), lo)
    return np.where(none[:, None], 1.0, down), np.where(none[:, None], 0.0, up)
