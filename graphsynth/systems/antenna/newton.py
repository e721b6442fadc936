"""The twelve loop equations solved by Newton's method, independently of the closed form.

A root counts only if the orientation reached through each leg agrees with the gimbal: the scalar equations are also
satisfied when it is off by half a turn about a coordinate axis (section 2.3).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.systems.antenna.charts import RANK_TOLERANCE, check_chart
from graphsynth.systems.antenna.closed_form import crank_arrays
from graphsynth.systems.antenna.loop_equations import loop_equations

if TYPE_CHECKING:
    from graphsynth.systems.antenna.mechanism import PointingMechanism

__all__ = ["LoopSolution", "RootSurvey", "newton", "solve_loops", "survey_roots"]

Array = NDArray[np.float64]

#: A residual (lengths divided by l1) below this is a root.
RESIDUAL = 1e-12
#: Turn of the cranks between two continuation steps, radians.
STEP = 0.05


@dataclass(frozen=True, eq=False)
class LoopSolution:
    """Newton's solution of the twelve equations.

    Attributes
    ----------
    x : ndarray, shape (..., 12)
        Unknowns; NaN where Newton's method found no root or a false one.
    residual : ndarray, shape (...)
        Largest absolute residual of the returned root, position rows divided by ``l1``.
    error : ndarray, shape (...)
        Largest component of the last Newton step (estimate of the error).
    converged, genuine : ndarray of bool, shape (...)
        A root was found; its orientations agree (both traces are 3).
    iterations : ndarray of int64, shape (...)
        Iterations in all continuation steps together.
    chart : str
        Coordinates that were used: the regular ones if those asked for are singular at the start.
    start_rank : ndarray of int64, shape (...)
        Rank of the 12 x 12 Jacobian at the start, in the coordinates asked for.
    message : str
        One sentence on the coordinates.
    """

    x: Array
    residual: Array
    error: Array
    converged: NDArray[np.bool_]
    genuine: NDArray[np.bool_]
    iterations: NDArray[np.int64]
    chart: str
    start_rank: NDArray[np.int64]
    message: str


@dataclass(frozen=True, eq=False)
class RootSurvey:
    """Roots of the twelve scalar equations found from random starts.

    Attributes
    ----------
    starts, failed, false, genuine : int
        Random starts; those without a root; false orientation roots (rejected); genuine roots.
    modes : ndarray, shape (m, 2)
        Different pairs ``(a, b)`` of the genuine roots, radians, sorted.
    """

    starts: int
    failed: int
    false: int
    genuine: int
    modes: Array


def newton(
    mechanism: PointingMechanism, x: Array, phi: Array, chart: str, limit: int = 40
) -> tuple[Array, Array, Array, NDArray[np.int64]]:
    """Newton's method with halved steps on many poses; returns x, residual, last step and iterations.

    A pose whose Jacobian is singular takes the step of least norm.
    """
    x = x.copy()
    found = loop_equations(mechanism, x, phi, chart)
    size = np.abs(found.residual).max(axis=1)
    last, iterations = np.full(len(x), np.inf), np.zeros(len(x), dtype=np.int64)
    active = np.arange(len(x))
    for _ in range(limit):
        step = _steps(found.jacobian, found.residual)
        length = np.abs(step).max(axis=1)
        factor = np.minimum(1.0, 1.0 / np.maximum(length, 1e-300))  # no step turns a joint by more than 1 rad
        for _ in range(12):
            trial = loop_equations(mechanism, x[active] - factor[:, None] * step, phi[active], chart)
            worse = np.linalg.norm(trial.residual, axis=1) > np.maximum(np.linalg.norm(found.residual, axis=1), 1e-15)
            if not worse.any():
                break
            factor[worse] *= 0.5
        x[active] -= factor[:, None] * step
        size[active], last[active] = np.abs(trial.residual).max(axis=1), length
        iterations[active] += 1
        going = (length > 1e-14) & ~((size[active] < 4e-16) & (length < 1e-7))
        active = active[going]
        if active.size == 0:
            break
        found = type(found)(*(part[going] for part in trial))
    return x, size, last, iterations


def _steps(jacobian: Array, residual: Array) -> Array:
    try:
        return np.asarray(np.linalg.solve(jacobian, residual[..., None])[..., 0])
    except np.linalg.LinAlgError:
        return np.asarray((np.linalg.pinv(jacobian, rcond=1e-13) @ residual[..., None])[..., 0])


def solve_loops(
    mechanism: PointingMechanism, phi_x: ArrayLike, phi_y: ArrayLike, start: ArrayLike | None, chart: str
) -> LoopSolution:
    """Solve the twelve equations; see `PointingMechanism.solve_loops`."""
    given_x, given_y = crank_arrays(phi_x, phi_y)
    phi = np.stack([given_x.ravel(), given_y.ravel()], axis=1)
    n = len(phi)
    total = np.zeros(n, dtype=np.int64)
    message = f"coordinates {chart!r}"
    if start is None:
        # every angle is zero at rest, in any coordinates and for any lengths
        report = check_chart(mechanism, 0.0, 0.0, chart, 1, -1, scaled=True)
        ranks = np.full(n, report.rank, dtype=np.int64)
        if report.rank < 12 and report.use:
            message = (
                f"at the start rank {report.rank} of 12: {report.verdict}; {report.use!r} used instead of {chart!r}"
            )
            chart = report.use
        x = np.zeros((n, 12))
        stages = max(1, int(np.ceil(np.abs(phi).max(initial=0.0) / STEP)))
        for stage in range(1, stages):
            x, _, _, used = newton(mechanism, x, phi * (stage / stages), chart)
            total += used
    else:
        x = np.broadcast_to(np.asarray(start, dtype=np.float64), (*given_x.shape, 12)).reshape(n, 12)
        values = np.linalg.svd(loop_equations(mechanism, x, phi, chart).jacobian, compute_uv=False)
        ranks = (values > RANK_TOLERANCE * values[:, :1]).sum(axis=1)
    x, size, last, used = newton(mechanism, x, phi, chart)
    traces = loop_equations(mechanism, x, phi, chart).traces
    converged = size < RESIDUAL
    genuine = converged & (np.abs(traces - 3.0) < 1e-6).all(axis=1)
    shape = given_x.shape
    x = np.where(genuine[:, None], x - 2.0 * np.pi * np.round(x / (2.0 * np.pi)), np.nan)
    return LoopSolution(
        x=x.reshape(*shape, 12), residual=size.reshape(shape), error=last.reshape(shape),
        converged=converged.reshape(shape), genuine=genuine.reshape(shape), iterations=(total + used).reshape(shape),
        chart=chart, start_rank=ranks.reshape(shape), message=message,
    )  # fmt: skip


def survey_roots(
    mechanism: PointingMechanism, phi_x: float, phi_y: float, starts: int, seed: int, chart: str
) -> RootSurvey:
    """Newton's method from random starts at one pose; see `PointingMechanism.survey_roots`.

    Raises
    ------
    GeometryError
        A number of starts below 1.
    """
    if starts < 1:
        raise GeometryError(f"starts = {starts} must be at least 1; give a number of random starts")
    random = np.random.default_rng(seed).uniform(-np.pi, np.pi, (starts, 12))
    found = solve_loops(mechanism, np.full(starts, phi_x), np.full(starts, phi_y), random, chart)
    pairs = found.x[found.genuine][:, [5, 11]]
    modes: list[Array] = []
    for pair in pairs[np.lexsort(pairs.T[::-1])] if len(pairs) else pairs:
        if all(np.abs(np.exp(1j * pair) - np.exp(1j * other)).max() > 1e-7 for other in modes):
            modes.append(pair)
    converged, genuine = int(found.converged.sum()), int(found.genuine.sum())
    return RootSurvey(starts, starts - converged, converged - genuine, genuine, np.array(modes).reshape(-1, 2))
