"""The last stage of one candidate: at exact points of its motion, with bounds kept exactly, not by penalties.

Each step is that of a linearised problem: least squares with linear bounds (least distances, Lawson and Hanson), or the
least largest error, a linear program.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.task.problem import Exact, TaskProblem

Array = NDArray[np.float64]
#: Damping at the start, and how often steps are refused.
_DAMPING, _REFUSED = 1e-4, 6
#: Steps at most, the part by which an error falls at least, and the square of one that is as good as none.
_STEPS, _GAIN, _NONE = 40, 1e-6, 1e-24
#: Longest step in sizes of the task, at first; its factors; the shortest.
_REACH, _LONGER, _SHORTER, _LEAST = 0.02, 2.0, 0.25, 1e-10
#: A step is made longer, up to so many times twice, if the merit falls by so much more than promised.
_DOUBLED, _SLOW = 10, 1.3
#: The shortest part of a step beyond which the motion breaks off that is tried.
_PART = 0.02
#: Violations of bounds that count as none, beside a weight that is larger than their multipliers.
_KEPT, _WEIGHT = 1e-8, 2.0


class Settled(NamedTuple):
    """A vector (size,), and its error in tolerances: a root mean square, or the largest."""

    x: Array
    error: float


def settled(problem: TaskProblem, x: Array) -> Settled:
    """Take a candidate (size,) to its least sum of squares within the bounds; as it is where that does not help.

    Steps are those of Gauss and Newton, or know the rest of the Hessian where that foretold the last step better.
    """
    now = problem.exactly(x, None)
    if now.times is None:
        return Settled(x, np.inf)
    damping, worse, weight, refused, best = _DAMPING, 2.0, 0.0, 0, Settled(x, np.inf)
    S, curved = np.zeros((len(x), len(x))), False  # what Gauss and Newton leave out, and whether it counts
    if _kept(now):
        best = Settled(x, float(np.sqrt(_squares(now))))
    for _ in range(_STEPS):
        r, J = _stacked(now)
        G, g = J.T @ J, J.T @ r
        scale = np.maximum(np.diag(G), 1e-12 * np.diag(G).max()) + 1e-300
        for own in (G + S, G) if curved else (G,):
            H = own + damping * np.diag(scale)
            step, pull = least_squares(H, g, now.steep, -now.bounds)
            if step is not None:
                break
        if step is None:
            break
        weight = max(weight, _WEIGHT * pull.max(initial=0.0))
        before, promised = _merit(now, weight), -float((2.0 * g + own @ step) @ step)
        step, later = _bent(problem, x, now, step, H, g, weight, before - _SLOW * promised)
        after = _merit(later, weight)
        if later.times is not None:
            missed = _squares(later) - _squares(now) - float((2.0 * g + G @ step) @ step)
            curved = abs(missed - float(step @ S @ step)) < abs(missed)
            S = _secant(S, now, later, step, pull)
        if not after < before:
            damping, worse, refused = damping * worse, 2.0 * worse, refused + 1
            if refused >= _REFUSED:
                break
            continue
        gain = min((before - after) / max(promised, 1e-300), 2.0)  # of more no cube is needed
        x, now, worse = x + step, later, 2.0
        damping = max(damping * max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3), 1e-15)
        refused = 0 if before - after > _GAIN * before else refused + 2
        if _kept(now) and _squares(now) < best.error**2:
            best = Settled(x, float(np.sqrt(_squares(now))))
        if refused >= _REFUSED or after < _NONE:
            break
    return best


def _secant(S: Array, now: Exact, later: Exact, step: Array, pull: Array) -> Array:
    """Return the part of the Hessian that Gauss and Newton leave out, as the gradients after a step tell it.

    Symmetric of rank one, sized as in [Dennis et al. 1981].
    """
    (_, J), (r, K) = _stacked(now), _stacked(later)
    y = (K - J).T @ r
    if len(pull) and pull.any():
        y = y + (later.steep - now.steep).T @ pull
    own = float(step @ S @ step)
    S = S * min(1.0, abs(float(step @ y)) / max(abs(own), 1e-300))
    off = y - S @ step
    size = float(off @ step)
    if abs(size) <= 1e-8 * float(np.linalg.norm(off) * np.linalg.norm(step)):
        return S
    return S + np.outer(off, off) / size


def _bent(
    problem: TaskProblem, x: Array, now: Exact, step: Array, H: Array, g: Array, weight: float, far: float
) -> tuple[Array, Exact]:
    """Return a step, or a better one that knows how errors and bounds bend along it, and what is seen at its end.

    A merit below ``far`` says that they bend away from the model: the step is doubled, along its arc, while that helps.
    """
    later, part = problem.exactly(x + step, now.times), 1.0
    while later.times is None and part > _PART:  # beyond a dead centre: a shorter step tells how to bend
        part, step = _SHORTER * part, _SHORTER * step
        later = problem.exactly(x + step, now.times)
    if later.times is None:
        return step, later
    r, J = _stacked(now)
    bent, over = _stacked(later)[0] - r - J @ step, later.bounds - now.bounds - now.steep @ step
    second, _ = least_squares(H, part * g + J.T @ bent, now.steep, -now.bounds - over)
    if second is None:
        return step, later
    first, other = step, problem.exactly(x + second, now.times)
    if _merit(other, weight) < _merit(later, weight):
        step, later = second, other
    for k in 2.0 ** np.arange(1, _DOUBLED):
        if part == 1.0 and not _merit(later, weight) < far:
            break
        long = k * first + k * k * (second - first)
        other = problem.exactly(x + long, later.times)
        if not _merit(other, weight) < _merit(later, weight):
            break
        step, later = long, other
    return step, later


def levelled(problem: TaskProblem, x: Array) -> Settled:
    """Take a candidate (size,) to its least largest error within the bounds; as it is where that does not help."""
    now = problem.exactly(x, None)
    if now.times is None:
        return Settled(x, np.inf)
    reach, best = _REACH, Settled(x, _largest(now) if _kept(now) else np.inf)
    longest = np.where(np.arange(problem.model.size) < problem.model.own_at, problem.model.task.size, 1.0)
    for _ in range(_STEPS):
        step = _lower(now, reach * longest)
        if step is None:
            break
        later = problem.exactly(x + step, now.times)
        weight = 1e3 * max(_largest(now), 1e-6)
        before = _largest(now) + weight * _violated(now)
        after = np.inf if later.times is None else _largest(later) + weight * _violated(later)
        if not after < before:
            reach *= _SHORTER
        else:
            x, now = x + step, later
            reach = _LONGER * reach if np.abs(step / longest).max() > 0.9 * reach else reach
            if _kept(now) and _largest(now) < best.error:
                best = Settled(x, _largest(now))
            if before - after < _GAIN * before:
                break
        if reach < _LEAST:
            break
    return best


def least_squares(H: Array, g: Array, A: Array, b: Array) -> tuple[Array | None, Array]:
    """Return the least d H d / 2 + g d with A d <= b, and the multipliers; None where nothing keeps A d <= b.

    The problem of least distances of Lawson and Hanson, by non-negative least squares.

    >>> step, pull = least_squares(np.eye(2), np.array([-3.0, -1.0]), np.array([[1.0, 0.0]]), np.array([1.0]))
    >>> step.round(12), pull.round(12)
    (array([1., 1.]), array([2.]))
    """
    from scipy.optimize import nnls

    try:
        L = np.linalg.cholesky(H)
    except np.linalg.LinAlgError:
        return None, np.zeros(len(A))
    free = np.asarray(-np.linalg.solve(H, g), np.float64)
    if not len(A) or (A @ free <= b).all():
        return free, np.zeros(len(A))
    size = np.maximum(np.linalg.norm(A, axis=1), 1e-300)[:, None]
    A, b = A / size, b / size[:, 0]
    # with z = L' (d - free): least |z| where G z >= h
    G, h = -np.linalg.solve(L, A.T).T, A @ free - b
    E = np.concatenate([G.T, h[None]])
    try:
        u, _ = nnls(E, np.append(np.zeros(len(g)), 1.0))
    except RuntimeError:  # too many steps
        return None, np.zeros(len(A))
    r = E @ u
    r[-1] -= 1.0
    if not -r[-1] > 1e-10:
        return None, np.zeros(len(A))
    nearest = np.asarray(free + np.linalg.solve(L.T, -r[:-1] / r[-1]), np.float64)
    return nearest, np.asarray(u / -r[-1] / size[:, 0])


def _lower(now: Exact, reach: Array) -> Array | None:
    """Return the step, no longer than a reach, after which the largest linearised error is least."""
    from scipy.optimize import linprog

    rows, values = [], []
    for error, slope in now.errors:
        error, slope = _unweighted(error), _unweighted(slope)
        if len(error) == 1:  # numbers, of either sign
            rows += [slope[0], -slope[0]]
            values += [error[0], -error[0]]
        else:  # lengths
            far = np.maximum(np.linalg.norm(error, axis=0), 1e-300)
            rows.append(np.einsum("dn,dni->ni", error / far, slope))
            values.append(far)
    J, e = np.concatenate(rows) * reach, np.concatenate(values)
    unit = max(float(e.max()), 1e-300)
    A = np.concatenate(
        [np.column_stack([J / unit, -np.ones(len(e))]), np.column_stack([now.steep * reach, np.zeros(len(now.steep))])]
    )
    b = np.concatenate([-e / unit, -now.bounds])
    cost = np.append(np.zeros(J.shape[1]), 1.0)
    found = linprog(cost, A_ub=A, b_ub=b, bounds=[(-1.0, 1.0)] * J.shape[1] + [(0.0, None)], method="highs")
    return None if found.x is None else found.x[:-1] * reach


def _unweighted(part: Array) -> Array:
    """Errors in tolerances: without the root of their number."""
    return np.asarray(part * np.sqrt(part.shape[1]))


def _stacked(now: Exact) -> tuple[Array, Array]:
    size = now.steep.shape[1]
    return np.concatenate([r.ravel() for r, _ in now.errors]), np.concatenate(
        [J.reshape(-1, size) for _, J in now.errors]
    )


def _squares(now: Exact) -> float:
    return float(sum((r**2).sum() for r, _ in now.errors))


def _largest(now: Exact) -> float:
    return max(float(np.linalg.norm(_unweighted(r), axis=0).max()) for r, _ in now.errors)


def _merit(now: Exact, weight: float) -> float:
    return np.inf if now.times is None else _squares(now) + weight * _violated(now)


def _violated(now: Exact) -> float:
    return float(np.maximum(now.bounds, 0.0).sum())


def _kept(now: Exact) -> bool:
    return bool((now.bounds < _KEPT).all())
