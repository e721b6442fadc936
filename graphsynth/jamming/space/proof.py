"""Proofs over boxes of given coordinates: within the limits the mechanism closes for all of them, or for none.

*Free*: as many unknowns as equations are chosen by pivoting; the others move linearly with the given coordinates.
Krawczyk's test proves a closure within a small box for each of the given coordinates, and the box obeys all limits.

*Jammed*: for multipliers ``by + K (q - q*)`` of the closure and weights of the limits that are zero or more, the
function ``L = (by + K (q - q*)) . g + sum weight (|x|^2 - limit^2)`` is at most zero wherever the loops close within
the limits.  Its Hessian over the box, shifted to be positive semidefinite (verified Cholesky factorisation), bounds it
from below; above zero nothing closes.  Boxes are contracted and cut until each is settled.

Both in balls with all rounding errors; proofs in theory/closure-in-space 4 and 5.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from graphsynth.intervals.balls import Balls, exact
from graphsynth.jamming.space.closure import Closure, Loop, swapped, times
from graphsynth.jamming.space.model import SLIDE, TILT_X, TILT_Y, SpaceModel
from graphsynth.jamming.space.optimum import Optimum

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
Mask = NDArray[np.bool_]
#: More than what rounding loses in sums of fewer than a thousand nonnegative numbers.
_UP = 1.0 + 1e-12
_FREE_STEPS = 6
#: Least half width of the box of a piece, in which narrower ones at its faces find place.
_LEAST = 1e-12
_CONTRACTIONS = 8
_GAIN = 0.9
#: Curvature given to unknowns without a loaded limit, in parts of that of the loaded ones.
_PARTS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)


class Tubes(NamedTuple):
    """Closures round N points, one for each of the given coordinates in a box: ``proved`` (N,), within all limits.

    ``basic`` (N, equations) are the unknowns that are solved for, within ``reach`` of where the others lead them;
    ``single`` (N,): there is only one such closure, which is then continuous in the given coordinates.
    """

    proved: Mask
    single: Mask
    basic: Ints
    reach: Array


def closings(closure: Closure, at: Array, rate: Array, given: Array) -> Tubes:
    """Tell of N boxes whether the mechanism is proved to close within its limits for all of them (certified).

    ``at`` (N, width) are near closures with room in all limits, their given coordinates the middles of the boxes;
    ``given`` (N, given coordinates) are the half widths; ``rate`` (N, size, given) the changes of the unknowns.
    """
    eye = np.broadcast_to(np.eye(given.shape[1]), (len(at), given.shape[1], given.shape[1]))
    return tubes(closure, at, np.concatenate([rate, eye], 1), given)


def tubes(
    closure: Closure, at: Array, along: Array, given: Array, basic: Ints | None = None, loose: Array | None = None
) -> Tubes:
    """Prove closures at ``at + along c``, for all c (N, k) within ``given``, corrected in the basic unknowns.

    Parameters
    ----------
    closure : Closure
    at, along, given : ndarray, shapes (N, width), (N, width, k), (N, k)
    basic : ndarray, shape (N, equations), optional
        Unknowns to solve for; otherwise chosen.
    loose : ndarray, shape (N, size), optional
        Half widths by which the unknowns may lie elsewhere besides: what is proved holds for all of these values of
        those that are not basic, and the basic ones are sought as far at least.
    """
    model, count = closure.model, len(at)
    each = np.arange(count)[:, None]
    if not closure.rows:
        still = sides(np.abs(along), given)
        return Tubes(
            _within(model, at, still), np.ones(count, dtype=np.bool_), np.zeros((count, 0), dtype=np.intp), still[:, :0]
        )
    loops = closure.loops(exact(at))
    value, J = closure.values(loops), closure.jacobian(loops)
    if basic is None:
        basic, fine = _basics(model, at, J.mid)
    else:
        fine = np.ones(count, dtype=np.bool_)
    least = np.full(basic.shape, _LEAST)
    if loose is not None:
        least, loose = loose[each, basic] + 1e-15, loose.copy()
        loose[each, basic] = 0.0
        unit = np.broadcast_to(np.eye(model.width, model.size), (count, model.width, model.size))
        along, given = np.concatenate([along, unit], 2), np.concatenate([given, loose], 1)
    still = sides(np.abs(along), given)
    own = Balls(*(part[each, :, basic].swapaxes(1, 2) for part in (J.mid, J.rad)))
    inverse = exact(np.linalg.pinv(np.where(fine[:, None, None], own.mid, 0.0)))
    start = times(inverse, value[..., None])[..., 0].size
    start = start + sides(times(inverse, times(J, exact(along))).size, given)
    rest = (exact(np.eye(len(closure.rows))) - times(inverse, own)).size
    reach = 2.0 * start + least
    proved, single = np.zeros((2, count), dtype=np.bool_)
    live = np.flatnonzero(fine)
    for _ in range(_FREE_STEPS):
        live = live[np.isfinite(reach[live]).all(1) & (reach[live].max(1) <= 1.0)]
        if live.size == 0:
            break
        whole, gamma, columns = still[live], given[live], basic[live]
        rows = np.arange(live.size)[:, None]
        whole[rows, columns] += reach[live]
        around = closure.loops(Balls(at[live], whole))
        H = closure.hessian(around, inverse[live])
        turned = times(H, exact(along[live][:, None]))
        # of the given coordinates alone, of both kinds, of the basic ones alone
        both = times(exact(along[live].swapaxes(1, 2)[:, None]), turned).size
        bend = sides(sides(both, gamma[:, None]), gamma)
        mixed = sides(sides(turned.size, gamma[:, None])[rows, :, columns].swapaxes(1, 2), reach[live])
        square = H.size[rows[..., None], :, columns[:, :, None], columns[:, None, :]]
        square = sides(sides(square.transpose(0, 3, 1, 2), reach[live][:, None]), reach[live])
        left = sides(rest[live], reach[live]) + mixed
        image = (start[live] + left + 0.5 * (bend + square)) * _UP
        inside = (image < reach[live]).all(1)
        proved[live[inside]] = (_identity(around) & _within(model, at[live], whole))[inside]
        single[live] = ((left + square) * _UP < reach[live]).all(1)
        reach[live[~inside]] = (np.maximum(1.5 * image, reach[live]) + 1e-300)[~inside]
        live = live[~inside]
    return Tubes(proved, single & proved, basic, reach)


def bend_of(H: Balls, along: Array, given: Array, basic: Ints, reach: Array) -> Array:
    """Bound what second derivatives H (n, width, width) make over a box, twice, rounded up.

    The given coordinates lead all by ``along`` (width, given); the ``basic`` unknowns are moved within ``reach``.
    """
    turned = times(H, exact(along[None]))
    bend = sides(sides(times(exact(along.T[None]), turned).size, given), given)
    bend = bend + 2.0 * sides(sides(turned.size[:, basic], given), reach)
    return np.asarray(bend + sides(sides(H.size[:, basic[:, None], basic[None, :]], reach), reach))


def sides(A: Array, x: Array) -> Array:
    """Products of nonnegative matrices (..., n, k) with vectors (..., k), rounded up."""
    return np.asarray((A @ x[..., None])[..., 0] * _UP)


def _basics(model: SpaceModel, at: Array, J: Array) -> tuple[Ints, Mask]:
    """Unknowns to solve for at N points: as many as equations, those with most room in their limits first.

    False where there are not so many independent ones.
    """
    room = np.ones((len(at), model.size))
    for bound in model.bounds:
        columns = list(bound.columns)
        left = bound.chart(1.0) - np.sqrt((at[:, columns] ** 2).sum(1))
        room[:, columns] = np.clip(left, 1e-12, 1.0)[:, None]
    basic, fine = np.zeros((len(at), J.shape[1]), dtype=np.intp), np.zeros(len(at), dtype=np.bool_)
    for k in range(len(at)):
        found = pivots(J[k, :, : model.size], room[k])
        fine[k] = len(found) == J.shape[1]
        if fine[k]:
            basic[k] = found
    return basic, fine


def pivots(J: Array, weight: Array) -> Ints:
    """Independent columns of a derivative, the largest by weight first."""
    _, upper, order = qr(J * weight, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(upper))
    rank = int((diagonal > 1e-11 * diagonal.max(initial=0.0)).sum())
    return np.asarray(np.sort(order[:rank]))


def _within(model: SpaceModel, at: Array, radius: Array) -> Mask:
    """Whether all unknowns within boxes (N, width) obey their limits."""
    inside = np.ones(len(at), dtype=np.bool_)
    for bound, limit in zip(model.bounds, model.limit_bounds[0]):
        columns = list(bound.columns)
        size = (np.abs(at[:, columns]) + radius[:, columns]) * _UP
        inside &= np.sqrt((size**2).sum(1) * _UP) * _UP < limit
    return inside


def _identity(loops: list[Loop]) -> Mask:
    """Whether a symmetric rotation of every loop is the identity, for N boxes: no half turn is within them."""
    fine = np.ones(len(loops[0].t.mid), dtype=np.bool_)
    for loop in loops:
        trace = loop.R[..., 0, 0] + loop.R[..., 1, 1] + loop.R[..., 2, 2]
        fine &= trace.mid - trace.rad > -0.99
    return fine


class Box(NamedTuple):
    """Boxes of coordinates y, bounds (N, width), with ``q = origin + shear y``: unknowns that follow the given ones."""

    low: Array
    high: Array
    origin: Array
    shear: Array

    @property
    def ball(self) -> Balls:
        """Balls around the boxes of y."""
        middle = 0.5 * self.low + 0.5 * self.high
        return Balls(middle, np.maximum(self.high - middle, middle - self.low) * _UP + 1e-300)

    def unknowns(self, y: Balls) -> Balls:
        """Coordinates q of some y (N, width)."""
        moved: Balls = times(exact(self.shear), y[..., None])[..., 0]
        return exact(self.origin) + moved

    def take(self, rows: NDArray[np.bool_]) -> Box:
        """Return some of the boxes."""
        return self._replace(low=self.low[rows], high=self.high[rows])


def branch_box(model: SpaceModel, reference: Array, reach: float, given: Array, rate: Array) -> Box:
    """Box of a branch: turns and travels within ``reach`` of the reference, the others within their limits.

    The former move by ``rate`` (size, drivers) with the given coordinates.  Tilts without a limit are only bounded by
    the axes of the links, slides without one by half a unit.
    """
    radius = np.full(model.width, reach)
    origin, shear = reference.copy(), np.eye(model.width)
    for column, lean in zip(model.column, model.leans):
        for own, size in ((column[TILT_X], lean), (column[TILT_Y], lean), (column[SLIDE], 0.5)):
            if own >= 0:
                radius[own] = size
                shear[own, model.size :] = 0.0
    shear[: model.size, model.size :] = rate
    radius[model.size :] = given
    for bound, high in zip(model.bounds, model.limit_bounds[1]):
        columns = list(bound.columns)
        origin[columns] = 0.0
        radius[columns] = high
        shear[columns, model.size :] = 0.0
    return Box(-radius[None], radius[None], origin, shear)


def contract(closure: Closure, box: Box) -> tuple[Box, NDArray[np.bool_]]:
    """Cut away parts of boxes where no loop closes (certified); True where nothing is left.

    With C near the inverse of the derivative by as many unknowns as equations, every closure c + d of the box obeys
    ``d = - C g(c) - (C J(c) - I) d - d C H d / 2`` in those unknowns, H the second derivatives over the box.
    """
    low, high = box.low.copy(), box.high.copy()
    empty = np.zeros(len(low), dtype=bool)
    ball = box.ball
    weight = np.maximum(ball.rad[0], 1e-300)[: closure.model.size]
    J = closure.jacobian(closure.loops(exact(box.unknowns(exact(ball.mid[:1])).mid)))
    basic = pivots(J.mid[0][:, : closure.model.size], weight)
    for _ in range(_CONTRACTIONS):
        live = np.flatnonzero(~empty)
        before = (high - low)[live]
        for part in np.array_split(live, 1 + len(live) // 64):
            down, up = _solved(closure, box._replace(low=low[part], high=high[part]), basic)
            rows = np.ix_(part, basic)
            low[rows], high[rows] = np.maximum(low[rows], down), np.minimum(high[rows], up)
            empty[part] = (low[part] > high[part]).any(1)
        wide = before > 1e-14
        after = np.where(empty[live, None], before, (high - low)[live])
        if empty.all() or not (after[wide] < _GAIN * before[wide]).any():
            break
    return box._replace(low=low, high=high), empty


def _solved(closure: Closure, box: Box, basic: Ints) -> tuple[Array, Array]:
    """Bounds of the chosen unknowns, (N, chosen) twice."""
    ball, shear = box.ball, exact(box.shear)
    loops = closure.loops(box.unknowns(exact(ball.mid)))
    value, J = closure.values(loops), times(closure.jacobian(loops), shear)
    inverse = exact(np.linalg.pinv(J.mid[:, :, basic]))
    offset = times(inverse, value[..., None])[..., 0]
    M = times(inverse, J)
    each = np.arange(len(basic))
    unit = np.zeros(M.mid.shape)
    unit[:, each, basic] = 1.0
    rest = (M - exact(unit)).size
    H = closure.hessian(closure.loops(box.unknowns(ball)), inverse)
    size = times(swapped(shear), times(H, shear)).size
    radius = ball.rad
    second = 0.5 * ((size @ radius[:, None, :, None])[..., 0] * radius[:, None, :]).sum(-1)
    spread = ((rest @ radius[:, :, None])[..., 0] + second + offset.rad) * _UP
    centre = ball.mid[:, basic] - offset.mid
    spread = spread * _UP + 1e-15 * (np.abs(centre) + np.abs(ball.mid[:, basic]) + spread)
    return centre - spread, centre + spread


class Certificate(NamedTuple):
    """Multipliers of a proof of binding: ``L = (by + K (q - at)) . g + sum weight (|x|^2 - limit^2)``."""

    at: Array
    by: Array
    K: Array
    weight: Array


def certificates(floats: Closure, found: Optimum, box: Box) -> list[Certificate]:
    """Choose multipliers from an optimum; any choice is valid, these make L convex near it (estimated).

    Loaded limits curve L upward in their own unknowns.  For the others K = S J adds J' S J, which is a small part of
    that curvature in them, measured by the half widths of the box.
    """
    model = floats.model
    radius = 0.5 * (box.high - box.low)[0]
    loops = floats.loops(found.q[None])
    J, H = floats.jacobian(loops)[0], np.abs(floats.hessian(loops, found.by[None])[0])
    idle = np.arange(model.width) < model.size
    top = 0.0
    for bound, mu in zip(model.bounds, found.weight):
        columns = list(bound.columns)
        top = max(top, float((2.0 * mu * radius[columns] ** 2).max()))
        idle[columns] = mu <= 1e-9 * found.weight.max()
    idle &= (H * radius).sum(1) * radius > 1e-9 * top
    active = _active(floats, found)
    inverse = np.linalg.pinv(J[np.ix_(active, np.flatnonzero(idle))] * radius[idle], rcond=3e-2)
    K = np.zeros_like(J)
    K[active] = 0.5 * (top or 1.0) * (inverse.T @ inverse) @ J[active]
    return [Certificate(found.q, found.by, part * K, found.weight) for part in _PARTS]


def _active(closure: Closure, found: Optimum) -> Ints:
    """Equations of the loops whose multipliers are not all zero."""
    largest = float(np.abs(found.by).max(initial=0.0))
    loops = {k for (k, _), by in zip(closure.rows, found.by) if abs(by) > 1e-10 * largest}
    return np.array([place for place, (k, _) in enumerate(closure.rows) if k in loops], dtype=np.intp)


def lower_bounds(closure: Closure, proofs: list[Certificate], box: Box) -> Array:
    """Lower bounds of L over boxes, (proofs, N), certified; above zero no member of the box closes within the limits.

    All proofs have the same multipliers but for K.
    """
    ball, shear = box.ball, exact(box.shear)
    at = exact(proofs[0].at[None])
    z = np.clip(np.linalg.solve(box.shear, proofs[0].at - box.origin), box.low, box.high)
    by = exact(np.repeat(proofs[0].by[None], len(z), 0))
    near, far = box.unknowns(exact(z)), box.unknowns(ball)
    loops, wide = closure.loops(near), closure.loops(far)
    g, J, everywhere = closure.values(loops), closure.jacobian(loops), closure.jacobian(wide)
    weighed = _weighed(closure.model, proofs[0].weight, near)
    below, above = box.low - z, box.high - z
    found = []
    for proof in proofs:
        K = exact(proof.K[None])
        own = by + times(K, (near - at)[..., None])[..., 0]
        value = total(own * g) + weighed[0]
        slope = times(swapped(J), own[..., None])[..., 0] + times(swapped(K), g[..., None])[..., 0] + weighed[1]
        slope = times(swapped(shear), slope[..., None])[..., 0]
        product = times(swapped(K), everywhere)
        H = (
            closure.hessian(wide, by + times(K, (far - at)[..., None])[..., 0])
            + product
            + swapped(product)
            + weighed[2]
        )
        H = times(swapped(shear), times(H, shear))
        found.append(least(value, slope, H, below, above)[0])
    return np.array(found)


def least(value: Balls, slope: Balls, H: Balls, below: Array, above: Array) -> tuple[Array, Array]:
    """Lower bounds of functions (N,) with the value and slope at a point and H over the box around it (certified).

    The box reaches from ``below`` to ``above`` (N, width) of the point, H (N, width, width).  The second result
    (N, width) says how much every coordinate takes off.
    """
    reach = np.maximum(-below, above) * _UP
    ends = [(slope.mid + sign * slope.rad) * side for sign in (-1.0, 1.0) for side in (below, above)]
    first = np.minimum(np.min(ends, axis=0), 0.0)
    second = np.array([shift(*part) for part in zip(H.mid, H.rad, reach)]).reshape(reach.shape)
    lost, bent = first.sum(-1), second.sum(-1)
    found = value.mid - value.rad * _UP + lost * _UP - 0.5 * bent * _UP
    return found - 1e-15 * (np.abs(value.mid) - lost + bent), 0.5 * second - first


def _weighed(model: SpaceModel, weight: Array, q: Balls) -> tuple[Balls, Balls, Balls]:
    """Return ``sum weight (|x|^2 - limit^2)`` at points (N, width) with first and second derivatives."""
    count, width = q.mid.shape
    value, slope, bend = exact(np.zeros(count)), np.zeros((2, count, width)), np.zeros((width, width))
    for bound, mu, limit in zip(model.bounds, weight, model.limit_bounds[1]):
        if mu > 0.0:
            for column in bound.columns:
                x = q[:, column]
                value = value + x * x * mu
                own = x * (2.0 * mu)
                slope[0, :, column], slope[1, :, column] = own.mid, own.rad
                bend[column, column] = 2.0 * mu
            value = value - exact(limit) * exact(limit) * mu
    return value, Balls(*slope), exact(bend[None])


def total(a: Balls) -> Balls:
    """Sum over the last axis."""
    rounding = a.mid.shape[-1] * 4e-16 * np.abs(a.mid).sum(-1)
    return Balls(a.mid.sum(-1), (a.rad.sum(-1) + rounding) * _UP)


def shift(mid: Array, rad: Array, far: Array) -> Array:
    """Return ``D far^2`` for a diagonal D >= 0 with H + D positive semidefinite for all H in the ball (certified).

    Infinite where none is found.  In unknowns over ``far``; rows of radii go to the diagonal (Gershgorin).
    """
    keep = np.flatnonzero(far > 0.0)
    best = np.where(far > 0.0, math.inf, 0.0)
    if not np.isfinite(mid).all() or not np.isfinite(rad).all():
        return best
    scale = far[keep]
    A = mid[np.ix_(keep, keep)] * scale[:, None] * scale
    A = 0.5 * (A + A.T)
    # products of three factors and the mean round; entries of both triangles hold the same true value
    spread = (rad[np.ix_(keep, keep)] * scale[:, None] * scale) * _UP + 1e-15 * np.abs(A)
    spread = np.maximum(spread, spread.T)
    unit = float(np.abs(A).max(initial=0.0))
    for floor in (1.0, 1e-2, 1e-4, 1e-6):
        weight = 1.0 / np.sqrt(np.maximum(np.diag(A), floor * unit) + 1e-300)
        own = _diagonal(A - np.diag(spread @ weight / weight * _UP), unit)
        if own.sum() < best[keep].sum():
            best[keep] = own
    return best


def _diagonal(A: Array, unit: float) -> Array:
    """Return a diagonal D >= 0 with A + D positive semidefinite (certified); infinite if none is found."""
    values, vectors = np.linalg.eigh(A)
    least = 1e-13 * unit * len(A) + 1e-300
    negative = np.minimum(values - 2.0 * least, 0.0)
    D = np.abs((vectors * negative) @ vectors.T).sum(1)
    for _ in range(4):
        if _positive(A + np.diag(D)):
            return np.asarray(D * _UP)
        D = 1.5 * D + 4.0 * least
    return np.full(len(A), math.inf)


def _positive(A: Array) -> bool:
    """Whether a symmetric matrix is proved positive definite: the factorisation of a smaller one ends [Rump 2006]."""
    n = len(A)
    eps = 2.0**-53
    gamma = (n + 2) * eps / (1.0 - (n + 2) * eps)
    diagonal = np.abs(np.diag(A))
    less = 4.0 * gamma / (1.0 - gamma) * float(diagonal.sum()) + 4.0 * eps * float(diagonal.max(initial=0.0)) + 1e-290
    try:
        np.linalg.cholesky(A - less * np.eye(n))
    except np.linalg.LinAlgError:
        return False
    return True
