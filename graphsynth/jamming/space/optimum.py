"""The least common factor on all limits with which a mechanism closes in space at one pose; estimated.

Sequential cone programs: at every step the closure is linearised and the convex program of the small-tilt model
(`graphsynth.jamming.joints.cones`) gives the next tilts, slips and multipliers; free turns follow from the closure.
Newton's method on the optimality conditions, with the second derivatives of the closure, adds the last digits.
The first step from a plane pose is the small-tilt model itself.  See theory/closure-in-space 3.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.jamming.joints.cones import ConeSolution, polish, solve_cones
from graphsynth.jamming.space.closure import Closure, Loop

Array = NDArray[np.float64]
_ROUNDS = 60
#: Rounds after which Newton's method is tried before the programs come to rest.
_TRIES = (2, 4, 6, 10, 16, 26, 40)
_RANK = 1e-11
#: Gap between tilts and wrenches of a program, relative, that leaves nothing to gain.
_TIGHT = 1e-13
_PROJECTIONS, _STEPS, _GAUSS = 100, 5, 6
#: Largest step of an unknown in one round (radians, units).
_STEP = 0.3


class Optimum(NamedTuple):
    """Least factor at one pose (estimated).

    ``scale``: the factor; infinite if no factor is enough.  ``q`` (width,): unknowns and given coordinates.  ``by``
    (equations,): multipliers of the closure; ``weight`` (bounds,): those of ``|x|^2 <= limit^2``, with
    ``sum 2 weight X dX/ds = 1``.  ``missed``: largest left side of the closure.  ``converged``: whether the iteration
    came to rest.
    """

    scale: float
    q: Array
    by: Array
    weight: Array
    missed: float
    converged: bool


class _Linear(NamedTuple):
    """Solution of one linearised program: factor, unknowns, multipliers, and what the closure missed before."""

    factor: float
    q: Array
    by: Array
    missed: float


def least_scale(closure: Closure, q: Array) -> Optimum:
    """Find the least factor from a start q (width,), whose given coordinates stay."""
    bounds = closure.model.bounds
    scale, reach, before = 1.0, _STEP, math.inf
    q, converged = _all_nearer(closure, q[None])[0], False
    found = _Linear(math.inf, q, np.zeros(len(closure.rows)), math.inf)
    for rounds in range(_ROUNDS):
        radii = np.array([b.chart(scale) / scale for b in bounds])
        found = _linearised(closure, q, radii)
        if not math.isfinite(found.factor):
            return _finished(closure, q, math.inf, found.by, False)
        step = found.q - q
        size = float(np.abs(step).max(initial=0.0))
        if size > 0.9 * before:
            reach *= 0.6
        q = q + step * min(1.0, reach / max(size, 1e-300))
        change, scale = abs(found.factor - scale), max(found.factor, 1e-12)
        # idle joints may share out their tilts in more than one way, so that the unknowns need not come to rest
        if change < 1e-9 * scale + 1e-12 and (size < 1e-9 or found.missed < 1e-12):
            converged = True
            break
        before = min(size, reach)
        if rounds in _TRIES and change < 1e-4 * scale:
            early = _finished(closure, q, scale, found.by, False)
            if early.converged:
                return early
    last = _finished(closure, q, scale, found.by, converged)
    return last if last.converged else _general(closure, last)


class Several(NamedTuple):
    """Closures of N poses with some room in their limits, not the most (estimated).

    ``q`` (N, width); ``used`` (N,): what is used of the limits, infinite where it is no closure; ``by`` (N, equations)
    the multipliers of the least factor with the closure linearised at the plane pose.
    """

    q: Array
    used: Array
    by: Array


def some_closures(closure: Closure, q: Array) -> Several:
    """Find closures from starts q (N, width): one program each, all at once, then steps of least use of room."""
    bounds, n = closure.model.bounds, closure.model.size
    q = _all_nearer(closure, q)
    q, by = _all_linearised(closure, q, np.array([b.chart(1.0) for b in bounds]))
    room = np.ones(n)
    for bound in bounds:
        room[list(bound.columns)] = max(bound.chart(1.0), 1e-12)
    missed = np.full(len(q), math.inf)
    for _ in range(_STEPS):
        loops = closure.loops(q)
        value = closure.values(loops)
        missed = np.abs(value).max(1, initial=0.0)
        if not missed.max(initial=0.0) >= 1e-13:
            break
        J = closure.jacobian(loops)[:, :, :n] * room
        q[:, :n] -= room * (np.linalg.pinv(J, rcond=_RANK) @ value[:, :, None])[..., 0]
    used = np.zeros(len(q))
    for b in bounds:
        used = np.maximum(used, np.sqrt((q[:, list(b.columns)] ** 2).sum(1)) / b.chart(1.0))
    # at the closure the multipliers hold the unknowns without limits again
    J = closure.jacobian(closure.loops(q))[:, :, _unlimited(closure)].swapaxes(1, 2)
    by = by - (np.linalg.pinv(J, rcond=_RANK) @ (J @ by[..., None]))[..., 0]
    return Several(q, np.where(missed < 1e-9, used, math.inf), by)


def _all_nearer(closure: Closure, q: Array) -> Array:
    """Move unknowns without limits of N poses towards a closure, by a few steps of Gauss and Newton."""
    q = q.copy()
    free = _unlimited(closure)
    for _ in range(_GAUSS):
        loops = closure.loops(q)
        inverse = np.linalg.pinv(closure.jacobian(loops)[:, :, free], rcond=1e-6)
        step = (inverse @ closure.values(loops)[:, :, None])[..., 0]
        size = np.abs(step).max(1, initial=0.0)
        q[:, free] -= step * np.minimum(1.0, _STEP / np.maximum(size, 1e-300))[:, None]
        if not size.max(initial=0.0) >= 1e-6:
            break
    return q


def _unlimited(closure: Closure) -> NDArray[np.bool_]:
    """Unknowns without limits, (width,)."""
    free = np.arange(closure.model.width) < closure.model.size
    for bound in closure.model.bounds:
        free[list(bound.columns)] = False
    return free


def _all_linearised(closure: Closure, q: Array, radii: Array) -> tuple[Array, Array]:
    """Solve the programs of N poses with the closure linearised: unknowns, and multipliers (N, equations).

    All of one shape at once; one by one where the columns without limits, or those with, are not independent.
    """
    bounds, slack = closure.model.bounds, _unlimited(closure)
    loops = closure.loops(q)
    values, J = closure.values(loops), closure.jacobian(loops)
    found, by = q.copy(), np.zeros_like(values)
    rank = int(min(J.shape[1], slack.sum()))
    left, size, _ = np.linalg.svd(J[:, :, slack], full_matrices=True)
    null = left[:, :, rank:]
    stacked = np.zeros((len(q), len(bounds), 2, null.shape[2]))
    work = values.copy()
    for k, bound in enumerate(bounds):
        for axis, column in enumerate(bound.columns):
            stacked[:, k, axis] = radii[k] * (J[:, None, :, column] @ null)[:, 0]
            work -= J[:, :, column] * q[:, [column]]
    work = (work[:, None] @ null)[:, 0]
    unit, weight = np.abs(stacked).max((1, 2, 3), initial=1e-300), np.sqrt((work**2).sum(1))
    M = stacked / unit[:, None, None, None]
    regular = size[:, rank - 1] > _RANK * size[:, 0] if rank else np.ones(len(q), dtype=np.bool_)
    least = np.linalg.svd(M.reshape(len(q), 2 * len(bounds), -1), compute_uv=False)
    regular &= (least.shape[1] == null.shape[2] > 0) & (least.min(1, initial=1.0) > _RANK) & (weight > 1e-13)
    rows = np.flatnonzero(regular)
    if rows.size:
        M, W = M[rows], work[rows] / weight[rows, None]
        cones = solve_cones(M, np.zeros((rows.size, 0, M.shape[3])), W)
        flat = M.reshape(rows.size, -1, M.shape[3])
        tau = cones.tau.reshape(rows.size, -1, 1)
        tau = tau - np.linalg.pinv(flat, rcond=1e-13).swapaxes(1, 2) @ (W[..., None] + flat.swapaxes(1, 2) @ tau)
        x = tau.reshape(rows.size, len(bounds), 2) * (weight / unit)[rows, None, None]
        by[rows] = (null[rows] @ cones.q[..., None])[..., 0]
        for k, bound in enumerate(bounds):
            for axis, column in enumerate(bound.columns):
                found[rows, column] = radii[k] * x[:, k, axis]
        change = np.where(slack, 0.0, found - q)[rows]
        off = values[rows] + (J[rows] @ change[..., None])[..., 0]
        found[np.ix_(rows, slack)] -= (np.linalg.pinv(J[rows][:, :, slack], rcond=_RANK) @ off[..., None])[..., 0]
    for row in np.flatnonzero(~regular):
        own = _linearised(closure, q[row], radii)
        found[row], by[row] = own.q, own.by
    load = (by[:, None] @ J)[:, 0]  # all loads times limits are 1: then the multipliers are slopes of the factor
    total = sum(radii[k] * np.sqrt((load[:, list(b.columns)] ** 2).sum(1)) for k, b in enumerate(bounds))
    return found, by / np.maximum(total, 1e-300)[:, None]


def _general(closure: Closure, found: Optimum) -> Optimum:
    """Try a general optimiser where the linearised programs do not come to rest, as beside dead centres."""
    from scipy.optimize import minimize

    bounds, n = closure.model.bounds, closure.model.size
    given = found.q[n:]

    def room(x: Array) -> Array:
        return np.array([(b.chart(x[n]) ** 2 - float((x[list(b.columns)] ** 2).sum())) / b.chart(1.0) for b in bounds])

    def room_slope(x: Array) -> Array:
        slope = np.zeros((len(bounds), n + 1))
        for k, b in enumerate(bounds):
            slope[k, list(b.columns)] = -2.0 * x[list(b.columns)] / b.chart(1.0)
            slope[k, n] = 2.0 * b.chart(x[n]) * b.slope(x[n]) / b.chart(1.0)
        return slope

    def loops(x: Array) -> list[Loop]:
        return closure.loops(np.concatenate([x[:n], given])[None])

    def slopes(x: Array) -> Array:
        J = closure.jacobian(loops(x))[0][:, :n]
        return np.concatenate([J, np.zeros((len(J), 1))], 1)

    closes = {"type": "eq", "fun": lambda x: closure.values(loops(x))[0], "jac": slopes}
    limits = {"type": "ineq", "fun": room, "jac": room_slope}
    start, last = np.append(found.q[:n], found.scale), np.eye(n + 1)[n]
    solved = minimize(
        lambda x: x[n],
        start,
        jac=lambda x: last,
        method="SLSQP",
        constraints=[closes, limits],
        options={"ftol": 1e-12, "maxiter": 200},
    )
    q, scale = np.concatenate([solved.x[:n], given]), float(solved.x[n])
    if not (np.isfinite(q).all() and 0.0 < scale < math.inf):
        return found
    J, tight = slopes(solved.x)[:, :n], room(solved.x) < 1e-6
    normals = -room_slope(solved.x)[tight]
    rows = np.concatenate([np.concatenate([J, normals[:, :n]]).T, [np.append(np.zeros(len(J)), normals[:, n])]])
    by = np.linalg.lstsq(rows, -last, rcond=1e-10)[0][: len(J)]
    own = _finished(closure, q, scale, by, False)
    return own if own.converged or own.missed < found.missed else found


def _finished(closure: Closure, q: Array, scale: float, by: Array, converged: bool) -> Optimum:
    """Give every loaded limit its multiplier, and add the last digits."""
    bounds = closure.model.bounds
    loops = closure.loops(q[None])
    missed = float(np.abs(closure.values(loops)).max(initial=0.0))
    weight = np.zeros(len(bounds))
    if not math.isfinite(scale):
        return Optimum(math.inf, q, by, weight, missed, False)
    slope = closure.jacobian(loops)[0].T @ by
    for k, bound in enumerate(bounds):
        columns, radius = list(bound.columns), bound.chart(scale)
        inside = float(np.linalg.norm(q[columns])) if radius > 0.0 else 0.0
        if inside > radius * (1.0 - (1e-6 if converged else 1e-2)):
            weight[k] = max(0.0, -float(slope[columns] @ q[columns]) / (2.0 * radius**2))
    return _polished(closure, Optimum(scale, q, by, weight, missed, converged))


def _linearised(closure: Closure, q: Array, radii: Array) -> _Linear:
    """Solve the program with the closure linearised at q: least T with ``|x_b| <= T radius_b`` for every bound."""
    bounds = closure.model.bounds
    loops = closure.loops(q[None])
    values, J = closure.values(loops)[0], closure.jacobian(loops)[0]
    moving = np.arange(len(q)) < closure.model.size
    tied = np.zeros(len(q), dtype=bool)
    for bound in bounds:
        tied[list(bound.columns)] = True
    slack = moving & ~tied
    free = J[:, slack]
    null = _left_null(free)
    blocks = np.zeros((len(bounds), 2, null.shape[1]))
    for k, bound in enumerate(bounds):
        for axis, column in enumerate(bound.columns):
            blocks[k, axis] = radii[k] * (J[:, column] @ null)
    work = (values - J[:, tied] @ q[tied]) @ null
    factor, x, wrench = _cone(blocks, work)
    if math.isfinite(factor):
        now = np.zeros_like(x)
        for k, bound in enumerate(bounds):
            now[k, : len(bound.columns)] = q[list(bound.columns)] / radii[k]
        x = _calmed(blocks, work, x, now, np.linalg.norm(blocks @ wrench, axis=-1))
    found = q.copy()
    for k, bound in enumerate(bounds):
        for axis, column in enumerate(bound.columns):
            found[column] = radii[k] * x[k, axis]
    if math.isfinite(factor):
        rest = values + J @ np.where(tied, found - q, 0.0)
        found[slack] = q[slack] - np.linalg.lstsq(free, rest, rcond=_RANK)[0]
    return _Linear(factor, found, null @ wrench, float(np.abs(values).max(initial=0.0)))


def _calmed(blocks: Array, work: Array, x: Array, now: Array, load: Array) -> Array:
    """Take idle joints to the nearest of their optimal tilts instead of any; all over radii, (bounds, 2).

    Projections in turn on the closure and on the limits, the loaded joints held.
    """
    factor = float(np.linalg.norm(x, axis=-1).max(initial=0.0))
    idle = load < 1e-7 * load.max(initial=0.0)
    if not idle.any():
        return x
    flat = blocks[idle].reshape(-1, blocks.shape[-1])
    held = work + blocks[~idle].reshape(-1, blocks.shape[-1]).T @ x[~idle].ravel()
    inverse = np.linalg.pinv(flat.T, rcond=_RANK)
    found = now[idle]
    for _ in range(_PROJECTIONS):
        size = np.linalg.norm(found, axis=-1, keepdims=True)
        found = found * np.minimum(1.0, (1.0 - 1e-9) * factor / np.maximum(size, 1e-300))
        found = found - (inverse @ (held + flat.T @ found.ravel())).reshape(found.shape)
        if np.linalg.norm(found, axis=-1).max() <= factor:
            x = x.copy()
            x[idle] = found
            return x
    return x


def _left_null(A: Array) -> Array:
    """Orthonormal basis of what is orthogonal to all columns."""
    if A.shape[1] == 0:
        return np.eye(len(A))
    left, values, _ = np.linalg.svd(A, full_matrices=True)
    rank = int((values > _RANK * max(values.max(initial=0.0), 1e-300)).sum())
    return left[:, rank:]


def _cone(blocks: Array, work: Array) -> tuple[float, Array, Array]:
    """Least T, tilts over their radii (bounds, 2), and multipliers: ``sum M_b' x_b + work = 0``, ``|x_b| <= T``."""
    count, k = len(blocks), len(work)
    stacked = blocks.reshape(2 * count, k)
    unit = float(np.abs(stacked).max(initial=0.0))
    size = float(np.linalg.norm(work))
    if size <= 1e-15 * max(unit, 1e-3):
        return 0.0, np.zeros((count, 2)), np.zeros(k)
    _, values, right = np.linalg.svd(stacked, full_matrices=True) if count else (0, np.zeros(0), np.eye(k))
    rank = int((values > _RANK * unit).sum())
    idle, span = right[rank:], right[:rank].T
    lost = idle @ work
    if float(np.linalg.norm(lost)) > 1e-9 * size and float(np.linalg.norm(lost)) > 1e-13:
        return math.inf, np.zeros((count, 2)), idle.T @ lost / np.linalg.norm(lost)
    M, W = (blocks @ span / unit)[None], (span.T @ work / size)[None]
    F = np.zeros((1, 0, rank))
    found = solve_cones(M, F, W)
    best = _restored(M, W, found)
    for robust in (False, True):
        with np.errstate(all="ignore"):
            again = polish(M, F, W, found, robust=robust)
        own = _restored(M, W, again)
        if np.isfinite(own[0]) and own[0] <= best[0] and np.isfinite(again.q).all():
            best = own
        T, tau, q = best
        if T * np.linalg.norm(M[0] @ q, axis=-1).sum() - abs(W[0] @ q) <= _TIGHT * T:
            break
    # the dual form has W q = T, sum |M_b q| = 1; in the closure T (s + by . g) has the slope of the factor
    return T * size / unit, tau * (size / unit), span @ q


def _restored(M: Array, W: Array, found: ConeSolution) -> tuple[float, Array, Array]:
    """Factor from tilts whose closure has been restored."""
    flat = M[0].reshape(-1, W.shape[1])
    tau = found.tau[0].ravel().copy()
    inverse = np.linalg.pinv(flat, rcond=1e-13).T
    for _ in range(2):
        off = W[0] + flat.T @ tau
        tau = tau - inverse @ np.where(np.isfinite(off), off, 0.0)
    tau = tau.reshape(-1, 2)
    return float(np.hypot(tau[:, 0], tau[:, 1]).max()), tau, found.q[0]


def _polished(closure: Closure, found: Optimum) -> Optimum:
    """Take Newton steps on the optimality conditions with the loaded limits as equations."""
    bounds = closure.model.bounds
    loaded = [k for k in range(len(bounds)) if found.weight[k] > 1e-9 * found.weight.max(initial=0.0)]
    if not loaded:
        return found
    best, least = found, math.inf
    state = found
    for _ in range(6):
        matrix, right = _conditions(closure, state, loaded)
        n, m = closure.model.size, len(state.by)
        size = max(float(np.abs(right[:n]).max()) / max(1.0, np.abs(state.by).max()), float(np.abs(right[n:]).max()))
        if not size < least:
            break
        best, least = state._replace(converged=state.converged or size < 1e-12), size
        if size < 1e-15:
            break
        size_of = np.ones(len(right))  # unknowns with limits move by parts of these
        for bound in bounds:
            size_of[list(bound.columns)] = bound.chart(state.scale)
        step = size_of * np.linalg.lstsq(matrix * size_of * size_of[:, None], -right * size_of, rcond=1e-12)[0]
        weight = state.weight.copy()
        weight[loaded] += step[n + m : -1]
        q, by = state.q.copy(), state.by + step[n : n + m]
        q[:n] += step[:n]
        missed = float(np.abs(closure.values(closure.loops(q[None]))).max())
        state = Optimum(state.scale + float(step[-1]), q, by, weight, missed, state.converged)
        if not (state.scale > 0.0 and np.abs(step[:n]).max() < 0.1):
            break
    fits = all(np.linalg.norm(best.q[list(b.columns)]) <= b.chart(best.scale) * (1.0 + 1e-9) for b in bounds)
    return best if fits and (best.weight >= 0.0).all() and best.missed <= max(found.missed, 1e-12) else found


def _conditions(closure: Closure, at: Optimum, loaded: list[int]) -> tuple[Array, Array]:
    """Matrix and left sides: stationarity in q, closure, loaded limits, normalisation."""
    bounds = closure.model.bounds
    loops = closure.loops(at.q[None])
    n, m, k = closure.model.size, len(at.by), len(loaded)
    J, H = closure.jacobian(loops)[0][:, :n], closure.hessian(loops, at.by[None])[0][:n, :n]
    matrix = np.zeros((n + m + k + 1, n + m + k + 1))
    right = np.zeros(n + m + k + 1)
    matrix[:n, :n], matrix[:n, n : n + m], matrix[n : n + m, :n] = H, J.T, J
    right[:n], right[n : n + m] = J.T @ at.by, closure.values(loops)[0]
    right[-1] = -1.0
    for place, number in enumerate(loaded):
        bound, row = bounds[number], n + m + place
        columns = list(bound.columns)
        X, slope = bound.chart(at.scale), bound.slope(at.scale)
        mu, x = at.weight[number], at.q[columns]
        matrix[columns, columns] += 2.0 * mu
        matrix[columns, row] = matrix[row, columns] = 2.0 * x
        matrix[row, -1] = -2.0 * X * slope
        right[columns] += 2.0 * mu * x
        right[row] = float(x @ x) - X * X
        matrix[-1, row] = 2.0 * X * slope
        matrix[-1, -1] += 2.0 * mu * slope * slope
        right[-1] += 2.0 * mu * X * slope
    return matrix, right
