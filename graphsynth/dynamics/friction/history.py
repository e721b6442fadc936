"""Friction at the output times of a motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.friction.problem import FrictionProblem
from graphsynth.dynamics.friction.rows import FrictionRows
from graphsynth.dynamics.result import FrictionHistory
from graphsynth.dynamics.tables import Compiled

Array = NDArray[np.float64]


class FrictionAt(NamedTuple):
    """Friction at one state: accelerations, multipliers, generalised force, and per element state, rate, force, load.

    ``shared`` names elements that stick together in a loop.
    """

    a: Array
    multipliers: Array
    rubbing: Array
    senses: tuple[int, ...]
    rates: Array
    forces: Array
    loads: Array
    shared: tuple[str, ...]


def friction_at(
    rows: FrictionRows, t: float, q: Array, v: Array, slots: Array, senses: tuple[int, ...] | None
) -> FrictionAt | None:
    """Solve the friction problem at a state whose senses are known; None if there is no single solution."""
    if senses is None:
        return None
    problem = FrictionProblem(rows, t, q, v, slots)
    fit = problem.at(senses)
    if fit is None:
        return None
    rests = np.array([s == 0 and not e.smooth for s, e in zip(senses, rows.elements)])
    rates = np.where(rests | (np.abs(problem.rates) <= problem.noise), 0.0, problem.rates)
    names = tuple(dict.fromkeys(rows.elements[f].name for f in fit.shared))
    return FrictionAt(
        fit.a, fit.multipliers, problem.W.T @ fit.forces, senses, rates, fit.forces, fit.loads, names
    )  # fmt: skip


def friction_history(rows: FrictionRows, count: int, fits: list[FrictionAt | None]) -> FrictionHistory:
    """Collect the friction of all output times."""
    shape = (count, len(rows.elements))
    state = np.zeros(shape, dtype=np.int64)
    rates, forces, loads = (np.full(shape, np.nan) for _ in range(3))
    shared: dict[tuple[str, ...], None] = {}
    for k, fit in enumerate(fits):
        if fit is not None:
            state[k], rates[k], forces[k], loads[k] = fit.senses, fit.rates, fit.forces, fit.loads
            if fit.shared:
                shared[fit.shared] = None
    return FrictionHistory(tuple(e.name for e in rows.elements), state, rates, forces, loads, tuple(shared))


def open_shares(
    compiled: Compiled, times: Array, q: Array, v: Array, slots: Array, state: NDArray[np.int64]
) -> dict[int, Array]:
    """Return changes of the multipliers that joints which stick together leave open, by index of the instant."""
    rows, found = FrictionRows(compiled), {}
    for k in range(len(times)):
        stuck = np.flatnonzero([s == 0 and not e.smooth for s, e in zip(state[k], rows.elements)])
        if len(stuck) < 2 or not np.isfinite(q[k]).all():
            continue
        problem = FrictionProblem(rows, float(times[k]), q[k], v[k], slots[k])
        changes = problem.open_shares([int(f) for f in stuck])
        if changes.shape[1]:
            found[k] = changes
    return found
