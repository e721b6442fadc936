"""Error against run time: the closed form and the twelve equations, against fifty digits."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import finite
from graphsynth.core.errors import GeometryError

if TYPE_CHECKING:
    from graphsynth.systems.antenna.mechanism import PointingMechanism

__all__ = ["PointingErrorRow", "pointing_errors"]

Array = NDArray[np.float64]


class PointingErrorRow(NamedTuple):
    """One run: method, setting, largest error of elevation and azimuth (rad; NaN after a failure), seconds per pose."""

    method: str
    setting: str
    error: float
    seconds: float


def _best(run: Callable[[], Array], rounds: int) -> tuple[Array, float]:
    found, seconds = run(), math.inf
    for _ in range(rounds):
        begin = perf_counter()
        found = run()
        seconds = min(seconds, perf_counter() - begin)
    return found, seconds


def pointing_errors(
    mechanism: PointingMechanism, largest: float = math.radians(40.0), *, poses: int = 41, rounds: int = 3
) -> tuple[PointingErrorRow, ...]:
    """Error against run time of every way to a pose, over equal crank angles up to ``largest`` on the mode at rest.

    Ways: the closed form in bulk and pose by pose, Newton's method on the twelve equations in bulk, scipy's ``root`` on
    the same equations pose by pose with several tolerances.

    Parameters
    ----------
    mechanism : PointingMechanism
    largest : float
        Radians.
    poses : int
        Poses of the comparison, at least 2; the closed form in bulk is timed with 100 000.
    rounds : int
        Runs for the wall time, of which the shortest counts.

    Returns
    -------
    tuple of PointingErrorRow
        Errors against `precise_angles` with 50 digits.

    Raises
    ------
    GeometryError
        Fewer than two poses or one round, or the mechanism cannot be assembled throughout.

    Examples
    --------
    >>> from graphsynth.systems.antenna import PointingMechanism
    >>> pointing_errors(PointingMechanism(), poses=3, rounds=1)[0].error < 1e-15
    True
    """
    if poses < 2 or rounds < 1:
        raise GeometryError(f"poses = {poses} and rounds = {rounds}: give at least two poses and one round")
    phi = np.linspace(0.0, finite("largest", largest), poses)
    truth = _truth(mechanism, phi)
    many = np.linspace(0.0, largest, 100_000)

    def bulk() -> Array:
        mechanism.poses(many, many)
        found = mechanism.poses(phi, phi)
        return np.stack([found.a, found.b], -1)

    def single() -> Array:
        found = [mechanism.poses(x, x) for x in phi.tolist()]
        return np.array([[float(pose.a), float(pose.b)] for pose in found])

    def newton() -> Array:
        return mechanism.solve_loops(phi, phi).x[:, [5, 11]]

    runs: list[tuple[str, str, Callable[[], Array], int]] = [
        ("closed form", "100 000 poses at once", bulk, many.size),
        ("closed form", "pose by pose", single, poses),
        ("twelve equations, own Newton", f"{poses} poses at once", newton, poses),
    ]
    runs += [
        ("twelve equations, scipy root", f"tol {tolerance:.0e}", _scipy(mechanism, phi, tolerance), poses)
        for tolerance in (1e-4, 1e-8, 1e-12)
    ]
    rows = []
    for method, setting, run, count in runs:
        found, seconds = _best(run, rounds)
        rows.append(PointingErrorRow(method, setting, float(np.abs(found - truth).max()), seconds / count))
    return tuple(rows)


def _truth(mechanism: PointingMechanism, phi: Array) -> Array:
    from graphsynth.systems.antenna.precise import precise_angles

    if not mechanism.poses(phi, phi).assembled.all():
        raise GeometryError("the mechanism cannot be assembled at all of these crank angles; lower largest")
    return np.array([[float(x) for x in precise_angles(mechanism, value, value)[:2]] for value in phi.tolist()])


def _scipy(mechanism: PointingMechanism, phi: Array, tolerance: float) -> Callable[[], Array]:
    """Continue from pose to pose; the unknowns are shifted by 1, because the step of ``hybr`` scales with them."""
    from graphsynth.systems.antenna.loop_equations import loop_equations

    def residual(y: Array, x: float) -> Array:
        found: Array = loop_equations(mechanism, y[None] - 1.0, np.array([[x, x]]), "corrected").residual[0]
        return found

    def run() -> Array:
        from scipy.optimize import root

        y, found = np.ones(12), []
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for x in phi.tolist():
                answer = root(residual, y, args=(x,), method="hybr", tol=tolerance)
                y = answer.x
                found.append((y - 1.0)[[5, 11]])
        return np.array(found)

    return run
