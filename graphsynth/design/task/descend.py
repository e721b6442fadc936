"""Levenberg and Marquardt for many candidates at once; the weak are left behind (successive halving).

Bounds are penalties whose weight grows from stage to stage.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.task.problem import TaskProblem

Array = NDArray[np.float64]
#: Damping at the start, its factors after a step that was taken and one that was not.
_DAMPING, _BETTER, _WORSE = 1e-2, 0.2, 5.0
#: A candidate rests when its squared error falls by less than this part, or it was refused that often.
_GAIN, _REFUSED = 1e-6, 7
#: Longest step of an unknown, in sizes of the task.
_STEP = 0.5
#: An error that is as good as none, in tolerances.
NONE = 1e-9


class Descended(NamedTuple):
    """Candidates (sets, size), best first, with their errors in tolerances and the times of their targets."""

    X: Array
    error: Array
    times: list[Array]


def descend(
    problem: TaskProblem,
    X: Array,
    strict: float,
    iterations: int,
    times: list[Array] | None = None,
) -> Descended:
    """Take candidates towards their optima, with one weight of the bounds; the best come first."""
    X, model = X.copy(), problem.model
    (error, r, J), times = problem.linearise(X, times, strict)
    damping, refused = np.full(len(X), _DAMPING), np.zeros(len(X), dtype=np.intp)
    longest = _STEP * np.where(np.arange(model.size) < model.own_at, model.task.size, 1.0)
    live = np.isfinite(error)
    for _ in range(iterations):
        at = np.flatnonzero(live)
        if not at.size:
            break
        own = J[at]
        turned = own.transpose(0, 2, 1)
        H, g = turned @ own, turned @ r[at, :, None]
        scale = np.einsum("sii->si", H)
        scale = np.maximum(scale, 1e-9 * scale.max(axis=1, keepdims=True)) + 1e-300
        H += (damping[at, None] * scale)[:, :, None] * np.eye(model.size)
        step = -np.linalg.solve(H, g)[:, :, 0]
        step /= np.maximum(1.0, np.abs(step / longest).max(axis=1, keepdims=True))
        (found, q, K), later = problem.linearise(X[at] + step, [part[at] for part in times], strict)
        good = found < error[at]
        gained = error[at] ** 2 - found**2 > _GAIN * error[at] ** 2
        taken = at[good]
        X[taken] += step[good]
        J[taken], r[taken], error[taken] = K[good], q[good], found[good]
        for part, new in zip(times, later):
            part[taken] = new[good]
        refused[at] = np.where(good & gained, 0, refused[at] + 1)
        damping[at] = np.clip(damping[at] * np.where(good, _BETTER, _WORSE), 1e-12, 1e12)
        live = np.isfinite(error) & (refused < _REFUSED) & (error > NONE)
    return best(Descended(X, error, times), len(X))


def best(found: Descended, count: int) -> Descended:
    """Return the best so many."""
    order = np.argsort(found.error, kind="stable")[:count]
    order = order[np.isfinite(found.error[order])]
    return Descended(found.X[order], found.error[order], [own[order] for own in found.times])
