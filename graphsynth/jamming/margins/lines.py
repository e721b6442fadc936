"""Linear bounds of the margin over pairs of a box of tolerances and a station, both with proof.

Below: where a linear function of the sources is negative, wrenches in equilibrium prove that the mechanism binds at
the middle of the station.  Above: where a linear function is not negative, vectors of all items that follow the sources
by a linear rule close the loops inside the limits, for every input of the station.  The numbers that both start from
are floating-point and need not be right (theory/probability-of-coupled-joints 2, 3).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Dual, Interval
from graphsynth.jamming.assembly.positions import enclosed_solve, points
from graphsynth.jamming.joints.closure import PITCH, ROLL, ROUND, Columns, Layout, Leans, leaning_points
from graphsynth.jamming.joints.enclosure import _without_forbidden
from graphsynth.jamming.margins.program import Items, Sharing, closure, share, ways
from graphsynth.jamming.margins.quantities import Quantities, Values
from graphsynth.jamming.margins.stations import Placed

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
#: Share of the cost from which an item counts as loaded; what the rounding of some dozen terms may add.
_LOADED, _SUMS = 1e-6, 1e-13
#: Share by which a limit varies over a box from which its vector is taken in proportion to it.
_STEEP = 0.6


class Boxes(NamedTuple):
    """Limits of the items, misalignments and lengths of N boxes: at the middle, and with derivatives by n sources.

    ``t`` (N, items), ``t_by`` (n, N, items); ``v`` (N, axes, 2), ``v_over`` over the box, ``v_by``; ``p`` (N, lengths),
    ``p_by``; ``half`` (N, n).  Limits in units of the items.
    """

    t: Interval
    t_by: Interval
    v: Interval
    v_over: Interval
    v_by: Interval
    p: Interval
    p_by: Interval
    half: Array

    def take(self, rows: Rows) -> Boxes:
        """Return some of the boxes, or one several times."""
        return Boxes(*(own[:, rows] if name.endswith("_by") else own[rows] for name, own in self._asdict().items()))


def boxes_of(quantities: Quantities, items: Items, at: Sequence[Any], over: Sequence[Any], half: Array) -> Boxes:
    """Evaluate quantities: ``at`` the middles (intervals), ``over`` the boxes (duals by the sources)."""
    count, n = half.shape
    size = quantities.box.size
    middle, whole = quantities.values(at), quantities.values(over)

    def limits(values: Values) -> list[Any]:
        return [*values.limits, *(None if own is None else own / items.length for own in values.plays)]

    here = Interval.stack([_value(own, count) for own in limits(middle)], axis=-1)
    t_by = Interval.stack([_slope(own, count, n) for own in limits(whole)], axis=-1)
    v = _pairs([[_value(c, count) for c in pair] for pair in middle.vectors])
    v_over = _pairs([[_value(c, count) for c in pair] for pair in whole.vectors])
    v_by = _pairs([[_slope(c, count, n) for c in pair] for pair in whole.vectors])
    p = Interval.stack([_value(own, count) for own in at[:size]], axis=-1) if size else Interval.zeros((count, 0))
    p_by = [_slope(own, count, n) for own in over[:size]]
    grown = Interval.stack(p_by, axis=-1) if size else Interval.zeros((n, count, 0))
    return Boxes(here, t_by, v, v_over, v_by, p, grown, half)


def _pairs(vectors: list[list[Interval]]) -> Interval:
    return Interval.stack([Interval.stack(pair, axis=-1) for pair in vectors], axis=-2)


def _value(own: Any, count: int) -> Interval:
    if own is None:
        return Interval.zeros((count,))
    return Interval.zeros((count,)) + (own.value if isinstance(own, Dual) else own)


def _slope(own: Any, count: int, n: int) -> Interval:
    none = Interval.zeros((n, count))
    return none + own.grad if isinstance(own, Dual) else none


class Pairs(NamedTuple):
    """Positions and misalignments of P pairs: at both middles, and derivatives by the input and the n sources.

    ``r``, ``e``, ``d`` and the points ``about`` which misalignments lean, (P, joints, 2); ``_by`` (1 + n, P, joints, 2)
    over the whole of both; ``steps`` (1 + n, P).
    """

    r: Interval
    e: Interval
    d: Interval
    about: Interval
    r_by: Interval
    e_by: Interval
    d_by: Interval
    about_by: Interval
    steps: Interval

    def take(self, rows: Rows) -> Pairs:
        """Return some of the pairs."""
        return Pairs(*(own[rows] for own in self[:4]), *(own[:, rows] for own in self[4:]))

    def columns(self) -> list[Columns]:
        """Return the vectors of the joints one by one: r, e, d, about."""
        return [[(own[:, k, 0], own[:, k, 1]) for k in range(own.shape[1])] for own in self[:4]]

    def duals(self, steps: Interval) -> list[Columns]:
        """Return the same as duals over the steps."""
        return [duals(*own, steps) for own in zip(self[:4], self[4:8])]

    def at_input(self) -> Interval:
        """Return the steps with the input kept at its middle."""
        zero = np.ones((len(self.steps), 1))
        zero[0] = 0.0
        return self.steps * points(zero)


def pairs_of(layout: Layout, items: Items, boxes: Boxes, placed: Placed, centre: Interval, half: Array) -> Pairs:
    """Bring boxes and stations together, row by row; ``centre`` are the lengths at which the stations were placed."""
    off = boxes.p - centre
    n = len(boxes.p_by)

    def moved(here: Interval, by: Interval) -> tuple[Interval, Interval]:
        """Values at the middles and derivatives (1 + n, P, ...)."""
        shape = (len(off), *(1,) * (here.ndim - 1))
        slopes = [by[:, 0]]
        zero = Interval.zeros(here.shape)
        for k in range(n):
            total = zero
            for m in range(off.shape[1]):
                total = total + by[:, 1 + m] * boxes.p_by[k, :, m].reshape(*shape)
            slopes.append(total)
        for m in range(off.shape[1]):
            here = here + by[:, 1 + m] * off[:, m].reshape(*shape)
        return here, Interval.stack(slopes, axis=0)

    at, by = placed
    r, r_by = about, about_by = moved((at.r - Interval(items.centre)) / items.length, by.r / items.length)
    if layout.rails:
        here, rates = (leaning_points(layout, own.r, own.rail) for own in placed)
        about, about_by = moved((here - Interval(items.centre)) / items.length, rates / items.length)
    e, e_by = moved(at.e, by.e)
    base, base_by = moved(at.base, by.base)
    ends = np.concatenate([half[:, None], boxes.half], axis=1).T
    steps = Interval.from_bounds(-ends, ends)
    d, d_by = _misaligned(layout, boxes, (base, base_by), steps)
    return Pairs(r, e, d, about, r_by, e_by, d_by, about_by, steps)


def _misaligned(
    layout: Layout, boxes: Boxes, base: tuple[Interval, Interval], steps: Interval
) -> tuple[Interval, Interval]:
    """Misalignments of the joints in the plane, and their derivatives."""
    count, joints = len(boxes.p), len(layout.joints)
    here, by = base
    none = Interval.zeros((1, count, 2))
    d, d_by = [Interval.zeros((count, 2))] * joints, [Interval.zeros((len(steps), count, 2))] * joints
    for k, (place, sign, _) in enumerate(layout.misalignments):
        side = 0 if sign > 0 else 1
        turn, turn_by = here[:, place, side], by[:, :, place, side]
        over = turn + (turn_by * steps.reshape(*steps.shape, 1)).sum(0)
        v, v_by = boxes.v[:, k], boxes.v_by[:, :, k]
        grown = Interval.from_bounds(*(np.concatenate([a, b]) for a, b in ((none.lo, v_by.lo), (none.hi, v_by.hi))))
        d[place] = _turned(turn, v) * sign
        d_by[place] = (_turned(turn_by, boxes.v_over[:, k]) + _turned(over, grown)) * sign
    return Interval.stack(d, axis=1), Interval.stack(d_by, axis=2)


def _turned(turn: Interval, v: Interval) -> Interval:
    x, y = turn[..., 0], turn[..., 1]
    return Interval.stack([x * v[..., 0] - y * v[..., 1], x * v[..., 1] + y * v[..., 0]], axis=-1)


def duals(value: Interval, by: Interval, steps: Interval) -> Columns:
    """Duals of vectors (P, k, 2) over the steps."""
    over = value + (by * steps.reshape(*steps.shape, 1, 1)).sum(0)
    return [tuple(Dual(over[:, k, i], by[:, :, k, i]) for i in (0, 1)) for k in range(over.shape[1])]  # type: ignore[misc]


class Certificate(NamedTuple):
    """``start + sum of by_k step_k`` is negative only where P pairs bind: (P,), and (1 + n, P) derivatives."""

    start: Interval
    by: Interval
    sound: NDArray[np.bool_]


@np.errstate(all="ignore")
def certificates(layout: Layout, items: Items, boxes: Boxes, pairs: Pairs, y: Array) -> Certificate:
    """Enclose what the items can give back less the work of the misalignments, for wrenches y (P, 3 loops)."""
    steps = pairs.at_input()
    over = pairs.r + (pairs.r_by * steps.reshape(*steps.shape, 1, 1)).sum(0)
    guide = pairs.e + (pairs.e_by * steps.reshape(*steps.shape, 1, 1)).sum(0)
    wrenches, fine = _without_forbidden(layout, over, guide, y)
    zero = Interval.zeros((1, len(y)))
    t_over = boxes.t + (boxes.t_by * steps[1:].reshape(*steps[1:].shape, 1)).sum(0)

    def limit(k: int, dual: bool) -> Any:
        if not dual:
            return boxes.t[:, k]
        own = boxes.t_by[:, :, k]
        both = (np.concatenate(ends) for ends in ((zero.lo, own.lo), (zero.hi, own.hi)))
        return Dual(t_over[:, k], Interval.from_bounds(*both))

    found = []
    for dual in (False, True):
        at = pairs.duals(steps) if dual else pairs.columns()
        found.append(_left_over(layout, items, at, wrenches, lambda k, dual=dual: limit(k, dual)))
    start, whole = found
    by = whole.grad + Interval.zeros(steps.shape) if isinstance(whole, Dual) else Interval.zeros(steps.shape)
    sound = fine & start.is_bounded & by.is_bounded.all(axis=0)
    return Certificate(start, by, np.asarray(sound))


def _left_over(layout: Layout, items: Items, at: list[Columns], y: Interval, limit: Any) -> Any:
    """Sum of limits times loads, less the work; negative proves that the loops cannot be closed."""
    r, e, d, about = at
    total: Any = Interval.zeros((len(y),))
    wrench, leaning = [], []
    for place in range(len(layout.joints)):
        own: list[Any] = [Interval.zeros((len(y),))] * 3
        for loop, sign in enumerate(layout.incidence[:, place].tolist()):
            if sign:
                own = [a + y[:, 3 * loop + i] * sign for i, a in enumerate(own)]
        (x, across), (p, q) = r[place], about[place]
        wrench.append((own[0] - across * own[2], own[1] + x * own[2], own[2]))
        rail = place in layout.rails
        leaning.append((own[0] - q * own[2], own[1] + p * own[2]) if rail else wrench[-1][:2])
    for item in np.flatnonzero(items.costly).tolist():
        blocks = len(layout.limit)
        if item >= blocks:
            total = total + abs(wrench[item - blocks][2]) * limit(item)
            continue
        place, axis = int(layout.block_joint[item]), layout.block_axis[item]
        mx, my, _ = wrench[place]
        if axis == ROUND:
            size = length(mx, my)
        elif axis == ROLL:
            size = abs(mx * e[place][0] + my * e[place][1])
        else:
            assert axis == PITCH
            size = abs(my * e[place][0] - mx * e[place][1])
        total = total + size * limit(item)
    for place, _, _ in layout.misalignments:
        mx, my = leaning[place]
        total = total - (mx * d[place][0] + my * d[place][1])
    return total


def length(x: Any, y: Any) -> Any:
    """Length of a vector; where it may vanish its derivative is any of those of a Lipschitz function."""
    if not isinstance(x, Dual) or not isinstance(y, Dual):
        both = [own.value if isinstance(own, Dual) else own for own in (x, y)]
        return (both[0].sqr() + both[1].sqr()).sqrt()
    value = (x.value.sqr() + y.value.sqr()).sqrt()
    away = value.lo > 0.0
    slope = (x.value * x.grad + y.value * y.grad) / Interval.from_bounds(
        np.where(away, value.lo, 1.0), np.where(away, value.hi, 1.0)
    )
    most = (x.grad.sqr() + y.grad.sqr()).sqrt().hi
    return Dual(value, Interval.from_bounds(np.where(away, slope.lo, -most), np.where(away, slope.hi, most)))


class Slack(NamedTuple):
    """What items leave of their limits: at least ``-need + by . step`` over the box, for every input of the station.

    In shares of the limits; two rows for each item, for vectors that point along the one at the middle and against it.
    ``need`` (P, rows), infinite where nothing is proved; ``by`` (P, rows, n); ``curved`` (P, rows, 1 + n): what the
    input and every source add to the need (estimated).
    """

    need: Array
    by: Array
    curved: Array


@np.errstate(all="ignore")
def slacks(layout: Layout, items: Items, boxes: Boxes, pairs: Pairs, found: Sharing, a: Array, loose: Array) -> Slack:
    """Bound what all costly items leave, by a linear rule for their vectors over their limits; ``a`` (1 + n, P).

    Loaded items follow so that all of them leave the same share, ``m + a . step``; what then does not close is left to
    the ways of correction, to first order in the rule, and enclosed for the rest.  Where ``loose``, loaded items
    turn less and grow more: less room along the rule, and less lost beside it.
    """
    steps = pairs.steps
    t, t_dual, caps = _limits(items, boxes, steps)
    over = np.where(t.mid > 0.0, t.mid, np.inf)
    way = ways(items, t.mid, found, loose) / over[..., None, None]
    share = found.tau / over[..., None]
    turned = [place for place, _, _ in layout.misalignments]
    here, moving = pairs.columns(), pairs.duals(steps)

    def leaning(at: list[Columns]) -> dict[int, tuple[Any, Any]]:
        """Misalignments with the points they lean about."""
        return {place: (at[2][place], at[3][place]) for place in turned}

    def open_(share: Array) -> Interval:
        """Closure at the middles."""
        own = [(t[:, k] * share[:, k, 0], t[:, k] * share[:, k, 1]) for k in range(share.shape[1])]
        return _stacked(closure(layout, here[0], here[1], own, leaning(here)), len(share))

    def closed(share: Array) -> Array:
        for _ in range(2):
            share = share - np.einsum("pijc,pc->pij", way, np.nan_to_num(open_(share).mid))
        return share

    share = closed(share)
    size = np.hypot(share[..., 0], share[..., 1])
    unit = np.where(size[..., None] > 0.0, share / np.where(size > 0.0, size, 1.0)[..., None], (1.0, 0.0))
    load = np.einsum("pick,pk->pic", found.rows, found.y)
    cost = np.where(items.costly, t.mid * np.hypot(load[..., 0], load[..., 1]), 0.0)
    loaded = cost > _LOADED
    rule = np.where(loaded[..., None], (caps.mid - a[..., None])[..., None] * unit, 0.0)
    for last in (False, True):
        own = [(limit * x, limit * y) for limit, (x, y) in zip(t_dual, _following(share, rule, steps))]
        sums = closure(layout, moving[0], moving[1], own, leaning(moving))
        change = Interval.stack([_slopes(own, steps) for own in sums], axis=-1)
        if not last:
            rule = rule - np.einsum("pijc,kpc->kpij", way, np.nan_to_num(change.mid))
            # what turns most gets more room at the middle, so that all loaded items end with the same
            turn = np.abs(rule[..., 1] * unit[..., 0] - rule[..., 0] * unit[..., 1]) * steps.mag[..., None]
            bend = np.where(loaded & items.plane, np.hypot(size, turn.sum(axis=0)) - size, 0.0)
            even = (cost * bend).sum(axis=1, where=loaded) / np.maximum(cost.sum(axis=1, where=loaded), 1e-300)
            share = closed(share - np.where(loaded, bend - even[:, None], 0.0)[..., None] * unit)
    missing = open_(share) + (change * steps.reshape(*steps.shape, 1)).sum(0)
    step, fine = enclosed_solve(_matrix(layout, moving, t_dual, way), -missing)
    start = Interval.from_bounds(*(np.where(t.mid > 0.0, own / over, 1.0) for own in (boxes.t.lo, boxes.t.hi)))
    return _slack(
        items, (start, caps), (share, rule, unit, way), (steps, step, change.rad * steps.mag[..., None]), fine
    )


def _slopes(own: Any, steps: Interval) -> Interval:
    zero = Interval.zeros(steps.shape)
    return zero + own.grad if isinstance(own, Dual) else zero


def _limits(items: Items, boxes: Boxes, steps: Interval) -> tuple[Interval, list[Any], Interval]:
    """Return units of the items at the middles (P, items), over the pairs, and what limits grow, (1 + n, P, items).

    A limit that varies much is its own unit, so that its vector vanishes with it and all it may grow to is 1; of others
    the unit is the limit at the middle, and the cap follows the limit.  Items without limit have the unit 1.
    """
    count = len(boxes.half)
    one = np.ones(count)
    zero = np.zeros((1, count))
    here, whole, caps = [], [], []
    for k, free in enumerate(items.free.tolist()):
        by = boxes.t_by[:, :, k]
        middle = one if free else boxes.t.mid[:, k]
        steep = (by.mag * steps.mag[1:]).sum(axis=0) > _STEEP * middle
        own = Interval.from_bounds(*(np.concatenate([zero, np.where(steep, end, 0.0)]) for end in (by.lo, by.hi)))
        here.append(points(middle))
        whole.append(Dual(points(middle) + (own * steps).sum(0), own))
        rest = Interval.from_bounds(*(np.concatenate([zero, np.where(steep, 0.0, end)]) for end in (by.lo, by.hi)))
        caps.append(rest / points(np.where(middle > 0.0, middle, 1.0)))
    return Interval.stack(here, axis=-1), whole, Interval.stack(caps, axis=-1)


def _stacked(sums: list[Any], count: int) -> Interval:
    zero = Interval.zeros((count,))
    return Interval.stack([own + zero for own in sums], axis=-1)


def _following(share: Array, rule: Array, steps: Interval) -> list[tuple[Any, Any]]:
    """Duals of the shares that follow the rule (1 + n, P, items, 2)."""
    by = points(rule)
    over = points(share) + (by * steps.reshape(*steps.shape, 1, 1)).sum(0)
    return [tuple(Dual(over[:, k, i], by[:, :, k, i]) for i in (0, 1)) for k in range(share.shape[1])]  # type: ignore[misc]


def _matrix(layout: Layout, moving: list[Columns], t: list[Any], way: Array) -> Interval:
    """Enclose what every column of the ways adds to the closure, (P, 3 loops, 3 loops)."""
    r, e = ([tuple(c.value for c in pair) for pair in own] for own in moving[:2])
    limits = [own.value if isinstance(own, Dual) else own for own in t]
    parts = []
    for c in range(way.shape[3]):
        own = [(limit * way[:, k, 0, c], limit * way[:, k, 1, c]) for k, limit in enumerate(limits)]
        parts.append(_stacked(closure(layout, r, e, own, {}), len(way)))
    return Interval.stack(parts, axis=-1)


def _slack(
    items: Items,
    caps: tuple[Interval, Interval],
    made: tuple[Array, Array, Array, Array],
    moved: tuple[Interval, Interval, Array],
    fine: NDArray[np.bool_],
) -> Slack:
    """Bound ``cap - |share|`` from below by linear functions of the steps, one for each side of every item."""
    (share, rule, unit, way), (steps, step, spread) = made, moved
    half, across = steps.mag, np.stack([-unit[..., 1], unit[..., 0]], axis=-1)
    along, aslant = (_moved(own, way, step.mag) for own in (unit, across))  # by the correction, (P, items, sums)
    far, wide = (np.einsum("kpij,pij->kpi", rule, own) for own in (unit, across))
    start, side = ((share * own).sum(axis=-1) for own in (unit, across))
    rest, turn = along.sum(axis=-1), aslant.sum(axis=-1)
    reach = np.einsum("kpi,kp->pi", np.abs(far), half)
    turn = np.where(items.plane, turn + np.einsum("kpi,kp->pi", np.abs(wide), half) + np.abs(side), 0.0)
    least, most = start - reach - rest, start + reach + rest
    loose = np.einsum("kpi,kp->pi", caps[1].rad, half)
    fixed = _SUMS * (2.0 + np.abs(most) + turn + np.einsum("kpi,kp->pi", caps[1].mag, half)) + loose - caps[0].lo
    plain = np.einsum("pic,kpc->pik", along, spread / np.where(step.mag > 0.0, step.mag, 1.0))
    aside = np.where(items.plane[:, None], np.moveaxis(np.abs(wide) * half[..., None], 0, -1), 0.0)
    sides = []
    for sign in (1.0, -1.0):
        ends = (least, most) if sign > 0.0 else (-most, -least)
        low, high = (np.maximum(own, 0.0) for own in ends)
        # the length is convex in the component along the middle: the chord between the ends of a side bounds it
        first, last = np.hypot(low, turn), np.hypot(high, turn)
        slope = np.where(high > low, np.clip((last - first) / (high - low), 0.0, 1.0), 0.0)
        bend = np.maximum(first - slope * low, last - slope * high)
        own = sign * slope * far
        need = bend + slope * (sign * start + rest) + fixed + np.abs(own[0]) * half[0][:, None]
        need = np.where(fine[:, None] & np.isfinite(need), need, np.inf)
        need = np.where(items.costly & ((high > 0.0) | (sign > 0.0)), need, -np.inf)
        curved = plain + aside * np.minimum(bend / np.maximum(turn, 1e-300), 1.0)[..., None]
        curved[..., 0] += np.abs(own[0]) * half[0][:, None]
        sides.append((need, np.moveaxis(caps[1].mid[1:] - own[1:], 0, -1), np.nan_to_num(curved)))
    return Slack(*(np.concatenate(part, axis=1) for part in zip(*sides)))


def _moved(unit: Array, way: Array, step: Array) -> Array:
    """Bound how far a correction moves the items along directions (P, items, 2), for each of its sums."""
    exact = np.abs(np.einsum("pij,pijc->pic", unit, way))
    most = np.einsum("pij,pijc->pic", np.abs(unit), np.abs(way))
    return np.asarray((exact + _SUMS * most) * step[:, None])


def thresholds(slack: Slack, a: Array, half: Array) -> tuple[Array, NDArray[np.intp], Array]:
    """Return c (P,) with: free wherever ``a . step >= c``; and the item that sets it, with its multiplier.

    From ``slack >= -need + by . step``: for every multiplier ``v > 0`` the bound ``c = need v + sum |v by - a| half``
    is enough; it is convex in v, least at ``a_k / by_k`` for some k.  Infinite: nothing in the box is proved free.
    """
    need, by = slack.need, slack.by
    if not by.shape[2]:  # nothing varies: free, or not proved
        item = need.argmax(axis=1)
        return np.where(need.max(axis=1) < 0.0, -np.inf, np.inf), item, np.zeros(len(need))
    size = (np.abs(by) * half[:, None]).sum(axis=2)
    best, v = np.full(need.shape, -np.inf), np.zeros(need.shape)
    rows, items = np.nonzero(~(need + size * (1.0 + 1e-12) < 0.0))  # elsewhere all of the box is free
    best[rows, items], v[rows, items] = _lifted(need[rows, items], by[rows, items], a[rows], half[rows])
    item = np.where(best == np.inf, need, best).argmax(axis=1)
    return best.max(axis=1), item, v[np.arange(len(a)), item]


def _lifted(need: Array, by: Array, a: Array, half: Array) -> tuple[Array, Array]:
    """Return the thresholds of rows (R,), and their multipliers."""
    none = (np.abs(a) * half).sum(axis=1)
    with np.errstate(all="ignore"):
        v = a / by
        v = np.where(np.isfinite(v) & (v > 0.0), v, np.nan)
        gaps = np.einsum("rmk,rk->rm", np.abs(v[:, :, None] * by[:, None] - a[:, None]), half)
        size = np.abs(need) + (np.abs(by) * half).sum(axis=1)
        c = need[:, None] * v + gaps + _SUMS * (size[:, None] * v + none[:, None])
        c = np.where(np.isnan(c), np.inf, c)
    at = c.argmin(axis=1)
    best, v = c[np.arange(len(c)), at], np.nan_to_num(v[np.arange(len(c)), at])
    return np.where(best < none, best, np.inf), v


def solved(layout: Layout, items: Items, boxes: Boxes, pairs: Pairs) -> Sharing:
    """Share the misalignments at the middles; wrenches scaled so that all items can give back 1."""
    t = np.where(items.costly, np.maximum(boxes.t.mid, 0.0), 0.0)
    found = share(layout, items, t, pairs.r.mid, pairs.e.mid, Leans(pairs.d.mid, pairs.about.mid))
    load = np.einsum("pick,pk->pic", found.rows, found.y)
    cost = (t * np.hypot(load[..., 0], load[..., 1])).sum(axis=1)
    lift = np.einsum("pjc,pjc->p", pairs.d.mid, _moments(layout, pairs.about.mid, found.y))
    scale = np.where(lift < 0.0, -1.0, 1.0) / np.where(cost > 1e-300, cost, 1.0)
    return found._replace(y=found.y * scale[:, None])


def _moments(layout: Layout, r: Array, y: Array) -> Array:
    """Moments of the joints (P, joints, 2) about points r by loop wrenches."""
    wrench = np.einsum("lj,plc->pjc", layout.incidence, y.reshape(len(y), -1, 3))
    return np.stack([wrench[..., 0] - wrench[..., 2] * r[..., 1], wrench[..., 1] + wrench[..., 2] * r[..., 0]], axis=-1)
