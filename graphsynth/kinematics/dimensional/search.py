"""The search: differential evolution over batches of motions, then a local polish of a target.

Why there is always something to begin with: at a sketch where the structure without the driven link is held regularly,
a crank whose joints all lie close to its pivot on the frame moves every other joint a little only, so by the implicit
function theorem the whole turn exists.  The population holds cranks of many sizes; the search enlarges what lives.

Sources: [Storn & Price 1997], J. Global Optim. 11, 341-359 (differential evolution); [Deb 2000], Comput.
Methods Appl. Mech. Eng. 186, 311-338 (complete motions before bounds, bounds before aims).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.dimensional.problem import INCOMPLETE, OUTSIDE, Problem

Array = NDArray[np.float64]

#: Merit at which a search without a target is content: all bounds kept with this to spare.
_ENOUGH = 1.5
#: Error of a target below which nothing is gained.
EXACT = 1e-9
_DIFFERENCE = 1e-6
#: Spread of the second population about the best of the first, where least squares do not help.
_AROUND = 0.01
#: Penalty of a motion that is not complete, in the least squares of a target.
_WALL = 1e3


class HistoryRow(NamedTuple):
    """Best of one generation of one search."""

    attempt: int
    generation: int
    evaluations: int
    cost: float


@dataclass(frozen=True)
class Search:
    """The best vector of a search, its cost, and the way to it."""

    best: Array
    cost: float
    history: tuple[HistoryRow, ...]
    start: tuple[int, int, int]  # candidates of the first population: all, complete, within bounds
    population: Array = field(repr=False)


def search(
    problem: Problem,
    attempt: int,
    random: np.random.Generator,
    deadline: float,
    before: Search | None = None,
    effort: float = 1.0,
) -> Search:
    """Run one search, or go on with one; it ends early only when ``perf_counter`` passes the deadline.

    With a target the first search is short: it tells the promising starts, which are then continued.  `effort` is the
    share of the usual number of first candidates and of generations.
    """
    begun = _begin(problem, random, effort) if before is None else before
    history = [HistoryRow(attempt, 0, problem.evaluations, begun.cost)]
    start = begun.start if before is None else (0, 0, 0)
    if problem.unknowns.size == 0:
        return replace(begun, history=tuple(history), start=start)
    best, value, population = _evolve(
        problem, begun.population, _generations(problem, before, effort), history, deadline, random
    )
    smooth = problem.fit is None or problem.fit.smooth
    if not smooth and before is not None:
        box = problem.bounds()
        around = np.clip(best + random.normal(0.0, _AROUND, population.shape), box[:, 0], box[:, 1])
        around[0] = best
        best, value, population = _evolve(
            problem, around, _generations(problem, before, effort) // 2, history, deadline, random
        )
    if problem.fit is not None and smooth and EXACT < value < OUTSIDE:
        polished = _polish(problem, best)
        better = float(problem.evaluate(polished[None]).cost[0])
        if better < value:
            best, value, population[0] = polished, better, polished
            history.append(HistoryRow(attempt, len(history), problem.evaluations, value))
    return Search(best, value, tuple(history), start, population)


def _begin(problem: Problem, random: np.random.Generator, effort: float) -> Search:
    """Make many candidates and keep the best as the first population."""
    aimed, size = problem.fit is not None, problem.unknowns.size
    width = min(120, 15 * size) if aimed else min(60, 6 * size)
    first = problem.population(max(width, round(effort * (20 if aimed else 4) * width), 1), random)
    outcome = problem.evaluate(first)
    order = np.argsort(outcome.cost, kind="stable")[: max(width, 8)]
    start = (len(first), int((outcome.cost < 0.5 * INCOMPLETE).sum()), int((outcome.merit >= 1.0).sum()))
    return Search(first[order[0]], float(outcome.cost[order[0]]), (), start, first[order])


def _generations(problem: Problem, before: Search | None, effort: float) -> int:
    """Return the largest number of generations: fewer where a motion costs more."""
    if problem.fit is None:
        count = 60
    elif before is None:
        count = 120
    else:
        count = 400 if problem.fit.warped else 600
    return max(2, round(effort * (count // 3 if problem.iterative else count)))


def _evolve(
    problem: Problem, population: Array, generations: int, history: list[HistoryRow], deadline: float,
    random: np.random.Generator,
) -> tuple[Array, float, Array]:  # fmt: skip
    """Differential evolution; returns the best, its cost and the last population."""
    from scipy.optimize import differential_evolution

    enough = -_ENOUGH if problem.fit is None else EXACT
    attempt = history[0].attempt

    def cost(X: Array) -> Array:
        found = problem.evaluate(np.atleast_2d(X.T)).cost
        least = min(history[-1].cost, float(found.min()))
        history.append(HistoryRow(attempt, len(history), problem.evaluations, least))
        return found

    def content(x: Array, convergence: float) -> bool:
        return perf_counter() > deadline or history[-1].cost <= enough

    found = differential_evolution(
        cost, problem.bounds(), init=population, vectorized=True, updating="deferred", polish=False,
        maxiter=generations, tol=1e-7, atol=1e-12, seed=random, callback=content,
    )  # fmt: skip
    return found.x, float(found.fun), np.asarray(found.population)


def _polish(problem: Problem, x: Array) -> Array:
    """Least squares of the errors from x, bounds as penalties; derivatives by differences, all in one batch."""
    from scipy.optimize import least_squares

    def residuals(X: Array) -> Array:
        found = problem.evaluate(X)
        broken = np.maximum(0.0, 1.0 - found.merit) * np.where(found.cost < 0.5 * INCOMPLETE, 1.0, _WALL)
        return np.concatenate([found.errors.real, found.errors.imag, broken[:, None]], axis=1)

    def derivatives(x: Array) -> Array:
        step = _DIFFERENCE * np.eye(len(x))
        both = residuals(np.concatenate([x + step, x - step]))
        return np.asarray((both[: len(x)] - both[len(x) :]).T / (2.0 * _DIFFERENCE))

    found = least_squares(
        lambda x: residuals(x[None])[0],
        x,
        jac=derivatives,
        x_scale=1.0,
        xtol=1e-14,
        ftol=1e-15,
        gtol=1e-15,
        max_nfev=80,
    )
    return np.asarray(found.x)


def verdict(cost: float) -> str:
    """Words for a cost."""
    if cost >= 0.5 * INCOMPLETE:
        return "the range is not completed"
    return "a bound is not kept" if cost > 0.5 * OUTSIDE else ""
