"""Bounds of the factor in intervals: from a system in equilibrium below, from a closed system of tilts above.

Both start from floating-point numbers that need not be right.  Below: loop wrenches are in equilibrium whatever the
positions (`graphsynth.jamming.joints.closure`); where a joint must carry no moment or no force, the wrenches are
corrected by an enclosed linear solve.  Above: the tilts are corrected by an enclosed linear solve until every loop
closes, for every position in the box.  Then limits and work are evaluated with outward rounding.
See theory/joints-that-share-a-tilt 4, 5.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Dual, Interval
from graphsynth.jamming.assembly.positions import enclosed_solve, points
from graphsynth.jamming.joints.closure import PITCH, ROLL, ROUND, Columns, Layout, by_joint, closure_sums, moment_rows
from graphsynth.jamming.joints.program import PoseSolution, Units

if TYPE_CHECKING:
    from graphsynth.jamming.joints.exact import Neglected


Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
#: Share in which a joint that is used up may still tilt further in a correction.
_STIFF = 1e-3


class Moving(NamedTuple):
    """The same at the middle of each piece, their derivatives over it, and the input and parameters less their middle.

    ``r_slope``, ``e_slope``, ``d_slope``, ``about_slope`` (K, N, joints, 2) are by the input and by every parameter,
    ``steps`` (K, N).  Lets the closure be bounded by the mean value theorem: joints that move together do not count as
    if each moved alone.  ``sound`` (N,) tells where all of it is proved; elsewhere it is not used.
    """

    r: Interval
    e: Interval
    d: Interval
    about: Interval
    r_slope: Interval
    e_slope: Interval
    d_slope: Interval
    about_slope: Interval
    steps: Interval
    sound: Mask

    def take(self, rows: NDArray[np.intp]) -> Moving:
        """Return some of the pieces."""
        here, slopes = (part[rows] for part in self[:4]), (part[:, rows] for part in self[4:9])
        return Moving._make([*here, *slopes, self.sound[rows]])


class Pieces(NamedTuple):
    """Positions, guide directions, misalignments and the points these lean about, in intervals, (N, joints, 2) each."""

    r: Interval
    e: Interval
    d: Interval
    about: Interval
    moving: Moving | None = None


def _around(values: Interval, radius: Array) -> Interval:
    """Widen pairs (N, joints, 2) by (N, joints)."""
    return values + Interval.from_bounds(-radius, radius).reshape(*radius.shape, 1)


@np.errstate(all="ignore")
def lower_bounds(layout: Layout, at: Pieces, found: PoseSolution, exact: Neglected | None = None) -> Array:
    """Certified lower bounds (N,) of the factor (mode "scale") over boxes of positions, misalignments and limits.

    The limits' ranges of the layout are part of the box.  ``found`` is of `solve_poses` near the middle of the boxes;
    any numbers give valid bounds for every member, 0 where nothing is proved.  With ``exact`` above 1 only where exact
    tilts bind too.
    """
    length = found.units.length
    if exact is not None:
        radii = exact.r, exact.e, exact.d, exact.about
        at = Pieces._make([*(_around(part, radius) for part, radius in zip(at[:4], radii)), None])
    r, about = ((part - Interval(found.units.centre)) / length for part in (at.r, at.about))
    y, fine = _without_forbidden(layout, r, at.e, found.y)
    # sum of the loop wrenches through every joint, (N, joints, 3)
    columns = []
    for place in range(len(layout.joints)):
        total = Interval.zeros((len(y), 3))
        for loop, sign in enumerate(layout.incidence[:, place].tolist()):
            if sign != 0.0:
                part = y[:, 3 * loop : 3 * loop + 3]
                total = total + part if sign > 0.0 else total - part
        columns.append(total)
    wrench = Interval.stack(columns, axis=1)
    m = (wrench[:, :, 0] - wrench[:, :, 2] * r[:, :, 1], wrench[:, :, 1] + wrench[:, :, 2] * r[:, :, 0])
    work = _work(layout, wrench, by_joint(about), by_joint(at.d))
    if at.moving is not None and exact is None:
        work = _straight_work(layout, wrench, at.moving, found.units, work)
    cost = Interval.zeros((len(found.y),))
    limits = np.broadcast_to(layout.limit_range[1], (len(y), len(layout.limit))) if exact is None else exact.wide
    for block, place in enumerate(layout.block_joint.tolist()):
        limit = limits[:, block]
        if not limit.any() or np.isinf(layout.limit[block]):  # rigid costs nothing; without limit the moment is zero
            continue
        # length of the moment, or its component along or across the guide, as the limit takes it
        mx, my, e = m[0][:, place], m[1][:, place], at.e[:, place]
        if layout.block_axis[block] == ROUND:
            size = (mx.sqr() + my.sqr()).sqrt()
        elif layout.block_axis[block] == ROLL:
            size = abs(mx * e[:, 0] + my * e[:, 1])
        else:
            size = abs(my * e[:, 0] - mx * e[:, 1])
        cost = cost + size * Interval.from_bounds(np.zeros(len(y)), limit)
    for place, play in enumerate(layout.end_float_range[1].tolist()):
        if play > 0.0 and np.isfinite(layout.end_float[place]):
            cost = cost + abs(wrench[:, place, 2]) * Interval.from_bounds(0.0, play) / length
    if exact is not None:
        rest = Interval.from_bounds(np.zeros_like(exact.lift), exact.lift)
        cost = cost + (abs(y[:, 2::3]) * rest).sum(-1) / length
    least = work.mig
    quotient = (Interval.from_bounds(least, least) / Interval.from_bounds(cost.hi, cost.hi)).lo
    quotient = np.where((cost.hi == 0.0) & (least > 0.0), np.inf, quotient)
    sound = fine & np.isfinite(least) & (least > 0.0) & ~np.isnan(quotient)
    if exact is not None:
        sound &= exact.sound
    return np.where(sound, np.maximum(quotient, 0.0), 0.0)


def _without_forbidden(layout: Layout, r: Interval, e: Interval, y: Array) -> tuple[Interval, Mask]:
    """Correct y until joints without limit carry exactly nothing; False where that is not proved."""
    exact = Interval.from_bounds(y, y)
    every = np.ones(len(y), dtype=bool)
    rows = _forbidden(layout, r, e)
    if rows is None:
        return exact, every
    direction = rows.mid
    matrix = (rows.reshape(*rows.shape[:2], 1, rows.shape[2]) * points(direction[:, None])).sum(-1)
    right = -(rows * points(y[:, None])).sum(-1)
    step, fine = enclosed_solve(matrix, right)
    change = (step.reshape(*step.shape, 1) * points(direction)).sum(1)
    return exact + change, fine


def _forbidden(layout: Layout, r: Interval, e: Interval) -> Interval | None:
    """Rows (N, rows, 3 loops) of moments and forces that must vanish; equal rows once."""
    zero, one, nothing = Interval(0), Interval(1), Interval.zeros((len(r),))
    rows: list[list[Interval]] = []
    for block in np.flatnonzero(np.isinf(layout.limit)).tolist():
        place = int(layout.block_joint[block])
        x, y, signs = r[:, place, 0], r[:, place, 1], [int(s) for s in layout.incidence[:, place]]
        wanted = [(one, zero, -y), (zero, one, x)]
        if layout.block_axis[block] != ROUND:
            a, b = e[:, place, 0], e[:, place, 1]
            if layout.block_axis[block] == PITCH:
                a, b = -b, a
            wanted = [tuple(first * a + second * b for first, second in zip(*wanted))]
        rows += [[value * s for s in signs for value in row] for row in wanted]
    columns = {
        tuple((c * (c[np.flatnonzero(c)[0]] if c.any() else 1.0)).tolist())
        for c in layout.incidence.T[np.isinf(layout.end_float)]
    }
    for column in sorted(columns):
        if any(column):
            rows.append([value for s in column for value in (zero, zero, Interval(int(s)))])
    if not rows:
        return None
    return Interval.stack([Interval.stack([value + nothing for value in row], axis=-1) for row in rows], axis=1)


def _start_tilts(layout: Layout, at: Pieces, found: PoseSolution) -> tuple[Array, Array]:
    """Tilts (N, blocks, 2) and slips (N, joints) from which a closed system is sought, in floats."""
    tau, zeta = np.nan_to_num(found.tau), np.nan_to_num(found.zeta)
    tau[:, layout.limit == 0.0], zeta[:, layout.end_float == 0.0] = 0.0, 0.0
    tau[:, layout.block_axis != ROUND, 1] = 0.0
    return _fill_free(layout, found.units, at, (tau, zeta))


def _work(layout: Layout, wrench: Interval, about: Columns, d: Columns) -> Any:
    """Work of the misalignments by the wrenches of the joints, ``sum (M_j - f_j J(p_j)) . d_j``; intervals or duals."""
    work: Any = Interval.zeros((len(wrench),))
    for place, _, _ in layout.misalignments:
        x, y, force = (wrench[:, place, k] for k in range(3))
        p, q = about[place]
        work = work + (x - force * q) * d[place][0] + (y + force * p) * d[place][1]
    return work


def _straight_work(layout: Layout, wrench: Interval, moving: Moving, units: Units, whole: Interval) -> Interval:
    """Narrow the work by the mean value theorem: wrenches are in equilibrium whatever the positions."""
    middle = _work(layout, wrench, by_joint((moving.about - Interval(units.centre)) / units.length), by_joint(moving.d))
    p = (moving.about_slope / units.length, moving.about + (moving.about_slope * _spread(moving)).sum(0))
    d = (moving.d_slope, moving.d + (moving.d_slope * _spread(moving)).sum(0))
    values = (_duals((p[1] - Interval(units.centre)) / units.length, p[0]), _duals(d[1], d[0]))
    found = _work(layout, wrench, *values)
    if not isinstance(found, Dual):
        return whole
    straight = (middle + (found.grad * moving.steps).sum(0)).intersect(whole)
    use = moving.sound & ~straight.is_empty
    return Interval.from_bounds(np.where(use, straight.lo, whole.lo), np.where(use, straight.hi, whole.hi))


def _spread(moving: Moving) -> Interval:
    return moving.steps.reshape(*moving.steps.shape, 1, 1)


def _duals(values: Interval, slopes: Interval) -> Columns:
    """Pair values (N, joints, 2) with their derivatives (K, N, joints, 2)."""
    return [tuple(Dual(values[:, k, i], slopes[:, :, k, i]) for i in (0, 1)) for k in range(values.shape[1])]  # type: ignore[misc]


class Rule(NamedTuple):
    """How a sharing of the tilts follows the input and the parameters, to first order; any numbers give valid bounds.

    ``tau`` (N, blocks, 2) and ``zeta`` (N, joints) at the middle, ``by`` (K, N, blocks, 2) and ``slip`` (K, N, joints)
    what one unit of each parameter adds; ``rates`` (N, K): relative change of the factor (estimated).  ``tilts`` and
    ``slips`` are the directions of `_directions`.  Enclosed: closure of tau and zeta over the piece ``off`` and at its
    middle ``middle``, (N, 3 loops), and its derivatives ``change`` (K, N, 3 loops).
    """

    tau: Array
    zeta: Array
    by: Array
    slip: Array
    rates: Array
    tilts: Array
    slips: Array
    off: Interval
    middle: Interval
    change: Interval

    def take(self, rows: NDArray[np.intp]) -> Rule:
        """Return some of the pieces."""
        by_kind = ("by", "slip", "change")
        return Rule._make(own[:, rows] if name in by_kind else own[rows] for name, own in self._asdict().items())


@np.errstate(all="ignore")
def rule_of(layout: Layout, at: Pieces, found: PoseSolution) -> Rule:
    """Choose the rule, in floats.

    The optimal factor changes by ``g = - (y . C) / (y . closure(tau))`` for a change C of the closure, y the wrenches
    of the dual program.  All tilts in proportion take that part; what is left needs no more of the joints that bind.
    """
    length, centre = found.units.length, Interval(found.units.centre)
    moving = at.moving
    r, about = ((part - centre) / length for part in (at.r, at.about))
    tau, zeta = _start_tilts(layout, at, found)
    ways = _directions(layout, r.mid, at.e.mid, (tau, zeta), length)
    start = points(tau), points(zeta)
    lean = by_joint(at.d), by_joint(about)
    off = Interval.stack(closure_sums(layout, by_joint(r), by_joint(at.e), *start, length, lean), axis=-1)
    if moving is None:
        empty = np.zeros((0, *tau.shape)), np.zeros((0, *zeta.shape)), np.zeros((len(tau), 0))
        return Rule(tau, zeta, *empty, *ways, off, off, Interval.zeros((0, *off.shape)))
    values = _duals(r, moving.r_slope / length), _duals(at.e, moving.e_slope)
    leaning = _duals(at.d, moving.d_slope), _duals(about, moving.about_slope / length)
    sums = closure_sums(layout, *values, *start, length, leaning)
    zero = Interval.zeros(moving.steps.shape)
    change = Interval.stack([v.grad + zero if isinstance(v, Dual) else zero for v in sums], axis=-1)
    place, about = ((part - centre) / length for part in (moving.r, moving.about))
    lean = by_joint(moving.d), by_joint(about)
    sums = closure_sums(layout, by_joint(place), by_joint(moving.e), *start, length, lean)
    rows = moment_rows(layout, place.mid, moving.e.mid)
    held = np.nan_to_num(np.einsum("nbic,nbi->nc", rows, tau))
    held[:, 2::3] += zeta @ layout.incidence.T / length
    C, y = np.nan_to_num(change.mid), np.nan_to_num(found.y)
    given = (held * y).sum(axis=-1)
    rates = np.where(given != 0.0, -(C * y).sum(axis=-1) / np.where(given != 0.0, given, 1.0), 0.0)
    rates = np.where(moving.sound & (np.abs(rates) * moving.steps.mag < 1.0), rates, 0.0)
    left = np.where(moving.sound[:, None], -(C + rates[..., None] * held), 0.0)
    by = rates[..., None, None] * tau + np.einsum("nbic,knc->knbi", ways[0], left)
    slip = rates[..., None] * zeta + np.einsum("njc,knc->knj", ways[1], left)
    return Rule(
        tau, zeta, np.nan_to_num(by), np.nan_to_num(slip), rates.T, *ways, off, Interval.stack(sums, axis=-1), change
    )


@np.errstate(all="ignore")
def upper_bounds(
    layout: Layout, at: Pieces, found: PoseSolution, exact: Neglected | None = None, rule: Rule | None = None
) -> Array:
    """Upper bounds as `lower_bounds`, or infinity; with ``exact`` below 1 only where exact tilts are free too.

    The tilts are ``tau + sum of by_k step_k`` plus what closes the loops exactly for every member: an enclosed linear
    solve of a remainder of second order.  ``rule`` is that of `rule_of`.
    """
    rule = rule_of(layout, at, found) if rule is None else rule
    length = found.units.length
    whole = (at.r - Interval(found.units.centre)) / length
    r, e, rest = whole, at.e, Interval(0)
    if exact is not None:
        more = _disturbed(layout, found.units, at, rule.tau, exact)
        rest = Interval.from_bounds(-more, more)
        r, e = _around(r, (points(exact.r) / length).hi), _around(e, exact.e)
    off = _remainder(layout, at.moving, length, rule, (r, e)) + rest
    places, guides = by_joint(r), by_joint(e)
    parts = []
    for c in range(rule.tilts.shape[-1]):
        ways = points(rule.tilts[..., c]), points(rule.slips[..., c])
        parts.append(Interval.stack(closure_sums(layout, places, guides, *ways, length), axis=-1))
    step, fine = enclosed_solve(Interval.stack(parts, axis=-1), -off)
    steps = Interval.zeros((0, len(step))) if at.moving is None else at.moving.steps
    worst = _largest_ratio(layout, rule, (steps, step), exact)
    sound = fine & ~np.isnan(worst)
    if exact is not None:
        sound &= exact.sound
    return np.where(sound, worst, np.inf)


def factor_range(rule: Rule, steps: Interval, found: PoseSolution) -> tuple[Array, Array]:
    """Estimate the range of the factor over pieces with these ``steps`` (K, N), to first order."""
    change = (np.abs(rule.rates) * steps.mag.T).sum(axis=1)
    return found.lower * np.maximum(1.0 - change, 0.0), found.lower * (1.0 + change)


def _remainder(
    layout: Layout, moving: Moving | None, length: float, rule: Rule, wide: tuple[Interval, Interval]
) -> Interval:
    """Enclose what is missing from the closure of the tilts of the rule, (N, 3 loops); ``wide`` positions and guides.

    Over the whole piece, and by the mean value theorem: the narrower of both.
    """
    if moving is None:
        return rule.off
    kinds, count = moving.steps.shape
    many = [Interval.from_bounds(np.tile(v.lo, (kinds, 1, 1)), np.tile(v.hi, (kinds, 1, 1))) for v in wide]
    tau, zeta = rule.by.reshape(-1, *rule.tau.shape[1:]), rule.slip.reshape(-1, rule.zeta.shape[1])
    sums = closure_sums(layout, by_joint(many[0]), by_joint(many[1]), points(tau), points(zeta), length)
    follows = Interval.stack(sums, axis=-1).reshape(kinds, count, -1)
    steps = moving.steps.reshape(kinds, count, 1)
    plain = rule.off + (follows * steps).sum(0)
    better = plain.intersect(rule.middle + ((rule.change + follows) * steps).sum(0))
    use = moving.sound[:, None] & ~better.is_empty
    return Interval.from_bounds(np.where(use, better.lo, plain.lo), np.where(use, better.hi, plain.hi))


def _largest_ratio(layout: Layout, rule: Rule, moved: tuple[Interval, Interval], exact: Neglected | None) -> Array:
    """Upper bound of the largest tilt or slip over its limit, (N,)."""
    tilts, slips, (steps, step) = rule.tilts, rule.slips, moved
    worst = np.zeros(len(rule.tau))
    limits, plays = layout.limit_range[:1], layout.end_float_range[:1]
    if exact is not None:
        limits, plays = exact.narrow, exact.end_float
    across = step.reshape(len(step), 1, -1)
    ahead = steps.reshape(*steps.shape, 1)

    def along(way: Array) -> Interval:
        """Component of all tilts along plane vectors (N, blocks, 2)."""
        x, y = points(way[..., 0]), points(way[..., 1])
        start = points(rule.tau[..., 0]) * x + points(rule.tau[..., 1]) * y
        first = ((points(rule.by[..., 0]) * x + points(rule.by[..., 1]) * y) * ahead).sum(0)
        wide = x.reshape(*x.shape, 1), y.reshape(*y.shape, 1)
        second = (points(tilts[:, :, 0]) * wide[0] + points(tilts[:, :, 1]) * wide[1]) * across
        return start + first + second.sum(-1)

    size = np.hypot(rule.tau[..., 0], rule.tau[..., 1])[..., None]
    unit = np.where(size > 0.0, rule.tau / np.where(size > 0.0, size, 1.0), (1.0, 0.0))
    unit[:, layout.block_axis != ROUND] = 1.0, 0.0
    turned = np.stack([-unit[..., 1], unit[..., 0]], axis=-1)
    turned[:, layout.block_axis != ROUND] = 0.0
    square = points(unit[..., 0]).sqr() + points(unit[..., 1]).sqr()
    sizes = ((along(unit).sqr() + along(turned).sqr()) / square).sqrt()
    for block in range(len(layout.limit)):
        if layout.limit[block] == 0.0 or np.isinf(limits[:, block]).any():
            continue
        worst = np.maximum(worst, _ratio(sizes[:, block].hi, limits[:, block]))
    zeta = points(rule.zeta) + (points(rule.slip) * ahead).sum(0) + (points(slips) * across).sum(-1)
    for place in range(len(layout.joints)):
        if layout.end_float[place] > 0.0 and np.isfinite(layout.end_float_range[0, place]):
            worst = np.maximum(worst, _ratio(zeta[:, place].mag, plays[:, place]))
    return worst


def _disturbed(layout: Layout, units: Units, at: Pieces, tau: Array, exact: Neglected) -> Array:
    """Bound what exact tilts add to the closure of given tilts, (N, 3 loops).

    The closure is linear in the tilts and bilinear with the positions: ``(r + dr) x (t + dt) - r x t``, and with
    misalignments and the points they lean about alike.
    """
    count, length = len(tau), units.length
    r, about = (((part - Interval(units.centre)) / length).mag.sum(axis=-1) for part in (at.r, at.about))
    lean, change = np.zeros((2, count, len(layout.joints)))
    for block, place in enumerate(layout.block_joint.tolist()):
        size = np.abs(tau[:, block]).sum(axis=-1)
        lean[:, place] += size
        if layout.block_axis[block] != ROUND:
            change[:, place] += size * exact.e[:, place]
    lift = exact.r / length * (lean + change) + r * change
    lift += exact.about / length * (at.d.mag.sum(axis=-1) + exact.d) + about * exact.d
    change += exact.d
    through = np.abs(layout.incidence).T
    rest = np.empty((count, 3 * layout.loops))
    rest[:, 0::3] = rest[:, 1::3] = change @ through
    rest[:, 2::3] = lift @ through + exact.lift / length
    return rest * (1.0 + 1e-12)  # for the rounding of a few dozen nonnegative terms


def _ratio(size: Array, limit: Array) -> Array:
    """Upper bound of size over limit; infinite for a limit that may be zero, unless the size is zero too."""
    positive = limit > 0.0
    quotient = (points(size) / points(np.where(positive, limit, 1.0))).hi
    return np.where(positive, quotient, np.where(size > 0.0, np.inf, 0.0))


def _directions(layout: Layout, r: Array, e: Array, start: tuple[Array, Array], length: float) -> tuple[Array, Array]:
    """Return changes of tilts (N, blocks, 2, 3 loops) and slips (N, joints, 3 loops) that may correct the closure.

    In proportion to the squares of the limits: the least change measured by what each joint has; joints without limit
    take most, and joints near their share of the factor turn rather than tilt further.  Column k changes nearly the sum
    k of the closure alone, so no bound is lost in a change of basis.
    """
    loops = layout.loops
    rows = moment_rows(layout, r, e)
    finite = layout.limit[np.isfinite(layout.limit)].max(initial=0.0) or 1.0
    weight = np.where(np.isinf(layout.limit), 100.0, (layout.limit / finite) ** 2)
    tilts = rows * weight[:, None, None]
    size = np.hypot(start[0][..., 0], start[0][..., 1])
    limits, plays = (np.where((own > 0.0) & np.isfinite(own), own, np.inf) for own in (layout.limit, layout.end_float))
    use = np.concatenate([size / limits, np.abs(start[1]) / plays], axis=1)
    left = np.clip(4.0 - 4.0 * use / np.maximum(use.max(axis=1, keepdims=True, initial=0.0), 1e-300), _STIFF, 1.0)
    unit = start[0] / np.where(size > 0.0, size, 1.0)[..., None]
    unit = unit * np.sqrt(1.0 - left[:, : len(layout.limit)])[..., None]
    tilts -= unit[..., None] * (unit[..., None] * tilts).sum(axis=2, keepdims=True)
    play = np.where(
        np.isinf(layout.end_float), 10.0 * finite * length, np.minimum(layout.end_float, 10.0 * finite * length)
    )
    share = (play / (length * finite)) ** 2
    slips = np.zeros((len(r), len(layout.joints), 3 * loops))
    slips[:, :, 2::3] = layout.incidence.T * (share * length * left[:, len(layout.limit) :])[..., None]
    flat, lifts = rows.reshape(len(r), -1, 3 * loops), layout.incidence.T / length
    effect = flat.transpose(0, 2, 1) @ tilts.reshape(flat.shape)
    effect[:, 2::3] += lifts.T @ slips
    inverse = np.linalg.pinv(effect, rcond=1e-14)
    return tilts @ inverse[:, None], slips @ inverse


def _fill_free(layout: Layout, units: Units, at: Pieces, start: tuple[Array, Array]) -> tuple[Array, Array]:
    """Give joints without limit the tilts and slips that close the loops, in floats."""
    tau, zeta = start
    blocks, joints = np.isinf(layout.limit), np.isinf(layout.end_float)
    if not (blocks.any() or joints.any()):
        return tau, zeta
    length = units.length
    r, about = ((part.mid - units.centre) / length for part in (at.r, at.about))
    count = len(r)
    rows = moment_rows(layout, r, at.e.mid)[:, blocks].reshape(count, -1, 3 * layout.loops)
    slips = np.zeros((count, int(joints.sum()), 3 * layout.loops))
    slips[:, :, 2::3] = layout.incidence.T[joints]
    places, guides, *lean = (by_joint(points(value)) for value in (r, at.e.mid, at.d.mid, about))
    sums = closure_sums(layout, places, guides, points(tau), points(zeta), length, (lean[0], lean[1]))
    off = Interval.stack(sums, axis=-1).mid
    both = np.concatenate([rows, slips], axis=1).transpose(0, 2, 1)
    value = -(np.linalg.pinv(both, rcond=1e-12) @ np.nan_to_num(off)[:, :, None])[..., 0]
    n = 2 * int(blocks.sum())
    tau[:, blocks] = value[:, :n].reshape(count, -1, 2)
    tau[:, layout.block_axis != ROUND, 1] = 0.0
    zeta[:, joints] = value[:, n:] * length
    return tau, zeta
