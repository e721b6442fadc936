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
from graphsynth.jamming.joints.closure import PITCH, ROLL, ROUND, Layout
from graphsynth.jamming.joints.enclosure import Columns, _without_forbidden
from graphsynth.jamming.joints.positions import enclosed_solve, points
from graphsynth.jamming.margins.program import Items, Sharing, closure, share, ways
from graphsynth.jamming.margins.quantities import Quantities, Values
from graphsynth.jamming.margins.stations import Places

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
#: Share of the cost from which an item counts as loaded; what the rounding of some dozen terms may add.
_LOADED, _SUMS = 1e-6, 1e-13


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


def boxes_of(quantities: Quantities, items: Items, at: Sequence[Any], over: Sequence[Any], half: Array) -> Boxes:
    """Evaluate quantities: ``at`` the middles (intervals), ``over`` the boxes (duals by the sources)."""
    count, n = half.shape
    size = quantities.box.size
    middle, whole = quantities.values(at), quantities.values(over)

    def limits(values: Values) -> list[Any]:
        return [*values.limits, *(None if own is None else own / items.length for own in values.plays)]

    here = Interval.stack([_value(own, count) for own in limits(middle)], axis=-1)
    t_by = Interval.stack([_slope(own, count, n) for own in limits(whole)], axis=-1)
    vectors = [
        Interval.stack([Interval.stack([f(c) for c in pair], axis=-1) for pair in own.vectors], axis=-2)
        for own, f in (
            (middle, lambda c: _value(c, count)),
            (whole, lambda c: _value(c, count)),
            (whole, lambda c: _slope(c, count, n)),
        )
    ]
    p = Interval.stack([_value(own, count) for own in at[:size]], axis=-1) if size else Interval.zeros((count, 0))
    p_by = [_slope(own, count, n) for own in over[:size]]
    grown = Interval.stack(p_by, axis=-1) if size else Interval.zeros((n, count, 0))
    return Boxes(here, t_by, *vectors, p, grown, half)


def _value(own: Any, count: int) -> Interval:
    if own is None:
        return Interval.zeros((count,))
    return Interval.zeros((count,)) + (own.value if isinstance(own, Dual) else own)


def _slope(own: Any, count: int, n: int) -> Interval:
    none = Interval.zeros((n, count))
    return none + own.grad if isinstance(own, Dual) else none


class Pairs(NamedTuple):
    """Positions and misalignments of P pairs: at both middles, and derivatives by the input and the n sources.

    ``r``, ``e``, ``d`` (P, joints, 2); ``_by`` (1 + n, P, joints, 2) over the whole of both; ``steps`` (1 + n, P).
    """

    r: Interval
    e: Interval
    d: Interval
    r_by: Interval
    e_by: Interval
    d_by: Interval
    steps: Interval

    def at_input(self) -> Interval:
        """Steps with the input kept at its middle."""
        zero = np.ones((len(self.steps), 1))
        zero[0] = 0.0
        return self.steps * points(zero)


def pairs_of(layout: Layout, items: Items, boxes: Boxes, at: Places, centre: Interval, half: Array) -> Pairs:
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

    r, r_by = moved((at.r - Interval(items.centre)) / items.length, at.r_by / items.length)
    e, e_by = moved(at.e, at.e_by)
    base, base_by = moved(at.base, at.base_by)
    ends = np.concatenate([half[:, None], boxes.half], axis=1).T
    steps = Interval.from_bounds(-ends, ends)
    d, d_by = _misaligned(layout, boxes, (base, base_by), steps)
    return Pairs(r, e, d, r_by, e_by, d_by, steps)


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


def columns(value: Interval) -> Columns:
    """Vectors (P, k, 2) one by one."""
    return [(value[:, k, 0], value[:, k, 1]) for k in range(value.shape[1])]


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
        if dual:
            r, e, d = (duals(*own, steps) for own in ((pairs.r, pairs.r_by), (pairs.e, pairs.e_by), (pairs.d, pairs.d_by)))
        else:
            r, e, d = columns(pairs.r), columns(pairs.e), columns(pairs.d)
        found.append(_left_over(layout, items, (r, e, d), wrenches, lambda k, dual=dual: limit(k, dual)))
    start, whole = found
    by = whole.grad + Interval.zeros(steps.shape) if isinstance(whole, Dual) else Interval.zeros(steps.shape)
    sound = fine & start.is_bounded & by.is_bounded.all(axis=0)
    return Certificate(start, by, np.asarray(sound))


def _left_over(layout: Layout, items: Items, at: tuple[Columns, Columns, Columns], y: Interval, limit: Any) -> Any:
    """Sum of limits times loads, less the work; negative proves that the loops cannot be closed."""
    r, e, d = at
    total: Any = Interval.zeros((len(y),))
    wrench = []
    for place in range(len(layout.joints)):
        own: list[Any] = [Interval.zeros((len(y),))] * 3
        for loop, sign in enumerate(layout.incidence[:, place].tolist()):
            if sign:
                own = [a + y[:, 3 * loop + i] * sign for i, a in enumerate(own)]
        x, across = r[place]
        wrench.append((own[0] - across * own[2], own[1] + x * own[2], own[2]))
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
        mx, my, _ = wrench[place]
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

    ``need`` (P, items), infinite where nothing is proved; ``by`` (P, items, n); ``curved`` (P, items, 1 + n): what the
    input and every source add to the need (estimated).
    """

    need: Array
    by: Array
    curved: Array


@np.errstate(all="ignore")
def slacks(layout: Layout, items: Items, boxes: Boxes, pairs: Pairs, found: Sharing, a: Array) -> Slack:
    """Bound the slack of all costly items, by a linear rule for their vectors; ``a`` (1 + n, P) guides the rule.

    Loaded items follow so that all of them keep the slack ``t (m + a . step)``; what then does not close is left to
    the ways of correction, to first order in the rule, and enclosed for the rest.
    """
    t, t_by = boxes.t.mid, boxes.t_by.mid
    way = ways(items, t, found)
    tau = found.tau.copy()
    here = columns(pairs.r), columns(pairs.e), {place: columns(pairs.d)[place] for place, _, _ in layout.misalignments}
    for _ in range(2):
        off = _stacked(closure(layout, here[0], here[1], _vectors(tau), here[2]), len(tau))
        tau = tau - np.einsum("pijc,pc->pij", way, np.nan_to_num(off.mid))
    off = _stacked(closure(layout, here[0], here[1], _vectors(tau), here[2]), len(tau))
    size = np.hypot(tau[..., 0], tau[..., 1])
    unit = np.where(size[..., None] > 0.0, tau / np.where(size > 0.0, size, 1.0)[..., None], (1.0, 0.0))
    load = np.einsum("pick,pk->pic", found.rows, found.y)
    loaded = items.costly & (t * np.hypot(load[..., 0], load[..., 1]) > _LOADED)
    grown = np.concatenate([np.zeros((1, *t.shape)), t_by]) - t * a[..., None]
    rule = np.where(loaded[..., None], grown[..., None] * unit, 0.0)
    moving = [
        duals(*own, pairs.steps) for own in ((pairs.r, pairs.r_by), (pairs.e, pairs.e_by), (pairs.d, pairs.d_by))
    ]
    for last in (False, True):
        own = _following(tau, rule, pairs.steps)
        shift = {place: moving[2][place] for place, _, _ in layout.misalignments}
        sums = closure(layout, moving[0], moving[1], own, shift)
        change = Interval.stack([s.grad + Interval.zeros(pairs.steps.shape) for s in sums], axis=-1)
        if not last:
            rule = rule - np.einsum("pijc,kpc->kpij", way, np.nan_to_num(change.mid))
    missing = off + (change * pairs.steps.reshape(*pairs.steps.shape, 1)).sum(0)
    step, fine = enclosed_solve(_matrix(layout, moving, way), -missing)
    spread = (change.rad + 0.0) * pairs.steps.mag[..., None]
    return _slack(items, boxes, (tau, rule, unit, way), (pairs.steps, step, spread), fine)


def _stacked(sums: list[Any], count: int) -> Interval:
    zero = Interval.zeros((count,))
    return Interval.stack([own + zero for own in sums], axis=-1)


def _vectors(tau: Array) -> list[tuple[Any, Any]]:
    return [(points(tau[:, k, 0]), points(tau[:, k, 1])) for k in range(tau.shape[1])]


def _following(tau: Array, rule: Array, steps: Interval) -> list[tuple[Any, Any]]:
    """Duals of the items that follow the rule (1 + n, P, items, 2)."""
    by = points(rule)
    over = points(tau) + (by * steps.reshape(*steps.shape, 1, 1)).sum(0)
    return [tuple(Dual(over[:, k, i], by[:, :, k, i]) for i in (0, 1)) for k in range(tau.shape[1])]  # type: ignore[misc]


def _matrix(layout: Layout, moving: list[Columns], way: Array) -> Interval:
    """Enclose what every column of the ways adds to the closure, (P, 3 loops, 3 loops)."""
    r, e = ([tuple(c.value for c in pair) for pair in own] for own in moving[:2])
    parts = [
        _stacked(closure(layout, r, e, _vectors(way[..., c]), {}), len(way))  # type: ignore[arg-type]
        for c in range(way.shape[3])
    ]
    return Interval.stack(parts, axis=-1)


def _slack(
    items: Items,
    boxes: Boxes,
    made: tuple[Array, Array, Array, Array],
    moved: tuple[Interval, Interval, Array],
    fine: NDArray[np.bool_],
) -> Slack:
    """Bound ``limit - |vector|`` from below: linear in the steps where the vector does not turn far."""
    (tau, rule, unit, way), (steps, step, spread) = made, moved
    half, across = steps.mag, np.stack([-unit[..., 1], unit[..., 0]], axis=-1)
    move = np.einsum("pijc,pc->pij", np.abs(way), step.mag)  # of every component, by the correction
    far, wide = (np.einsum("kpij,pij->kpi", rule, way) for way in (unit, across))
    start, side = ((tau * way).sum(axis=-1) for way in (unit, across))
    rest = np.abs(unit[..., 0]) * move[..., 0] + np.abs(unit[..., 1]) * move[..., 1]
    turn = np.abs(across[..., 0]) * move[..., 0] + np.abs(across[..., 1]) * move[..., 1]
    reach = np.einsum("kpi,kp->pi", np.abs(far), half)
    turn = np.where(items.plane, turn + np.einsum("kpi,kp->pi", np.abs(wide), half) + np.abs(side), 0.0)
    least, most = start - reach - rest, start + reach + rest
    # the length is convex in the component along the middle: the chord between its ends bounds it
    ends = np.hypot(least, turn), np.hypot(most, turn)
    slope = np.where(most > least, np.clip((ends[1] - ends[0]) / (most - least), 0.0, 1.0), 0.0)
    bend = np.maximum(ends[0] - slope * least, ends[1] - slope * most)
    need = bend + slope * (start + rest) - boxes.t.lo
    far = slope * far
    need = need + np.einsum("kpi,kp->pi", boxes.t_by.rad, half[1:]) + np.abs(far[0]) * half[0][:, None]
    by = np.moveaxis(boxes.t_by.mid - far[1:], 0, -1)
    scale = boxes.t.mag + np.abs(most) + turn + np.einsum("kpi,kp->pi", boxes.t_by.mag, half[1:])
    need = need + _SUMS * scale
    need = np.where(fine[:, None] & np.isfinite(need), need, np.inf)
    lean = np.abs(unit[..., 0])[..., None] * np.abs(way[:, :, 0]) + np.abs(unit[..., 1])[..., None] * np.abs(way[:, :, 1])
    curved = np.einsum("pic,kpc->pik", lean, spread)
    part = np.minimum(bend / np.maximum(turn, 1e-300), 1.0)
    curved += np.moveaxis(np.abs(wide) * half[..., None], 0, -1) * np.where(items.plane, part, 0.0)[..., None]
    curved[..., 0] += np.abs(far[0]) * half[0][:, None]
    curved[..., 1:] += np.moveaxis(boxes.t_by.rad * half[1:, :, None], 0, -1)
    return Slack(np.where(items.costly, need, -np.inf), by, np.nan_to_num(curved))


def thresholds(slack: Slack, a: Array, half: Array) -> tuple[Array, NDArray[np.intp], Array]:
    """Return c (P,) with: free wherever ``a . step >= c``; and the item that sets it, with its multiplier.

    From ``slack >= -need + by . step``: for every multiplier ``v > 0`` the bound ``c = need v + sum |v by - a| half``
    is enough; it is convex in v, least at ``a_k / by_k`` for some k.  Infinite: nothing in the box is proved free.
    """
    need, by = slack.need, slack.by
    size = np.abs(by) * half[:, None]
    none = (np.abs(a) * half).sum(axis=1)
    with np.errstate(all="ignore"):
        v = a[:, None] / by
        v = np.where(np.isfinite(v) & (v > 0.0), v, np.nan)
        gaps = (np.abs(v[..., None] * by[:, :, None] - a[:, None, None]) * half[:, None, None]).sum(axis=-1)
        c = need[..., None] * v + gaps
        c = c + _SUMS * ((np.abs(need) + size.sum(axis=-1))[..., None] * v + none[:, None, None])
        c = np.where(np.isnan(c), np.inf, c)
    at = c.argmin(axis=2)[..., None]
    best, v = (np.take_along_axis(own, at, axis=2)[..., 0] for own in (c, v))
    best = np.where(best < none[:, None], best, np.inf)
    best = np.where(need + size.sum(axis=2) * (1.0 + 1e-12) < 0.0, -np.inf, best)
    item = np.where(best == np.inf, need, best).argmax(axis=1)
    rows = np.arange(len(a))
    return best.max(axis=1), item, np.nan_to_num(v[rows, item])


def solved(layout: Layout, items: Items, boxes: Boxes, pairs: Pairs) -> Sharing:
    """Share the misalignments at the middles; wrenches scaled so that all items can give back 1."""
    t = np.where(items.costly, np.maximum(boxes.t.mid, 0.0), 0.0)
    found = share(layout, items, t, pairs.r.mid, pairs.e.mid, pairs.d.mid)
    load = np.einsum("pick,pk->pic", found.rows, found.y)
    cost = (t * np.hypot(load[..., 0], load[..., 1])).sum(axis=1)
    lift = np.einsum("pjc,pjc->p", pairs.d.mid, _moments(layout, pairs.r.mid, found.y))
    scale = np.where(lift < 0.0, -1.0, 1.0) / np.where(cost > 1e-300, cost, 1.0)
    return found._replace(y=found.y * scale[:, None])


def _moments(layout: Layout, r: Array, y: Array) -> Array:
    """Moments of the joints (P, joints, 2) by loop wrenches."""
    wrench = np.einsum("lj,plc->pjc", layout.incidence, y.reshape(len(y), -1, 3))
    return np.stack(
        [wrench[..., 0] - wrench[..., 2] * r[..., 1], wrench[..., 1] + wrench[..., 2] * r[..., 0]], axis=-1
    )
