"""``module = "pointing"``: what is measured of the antenna, against the lengths of the rods in fifty digits."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from mpmath import mp
from numpy.typing import NDArray
from scipy.optimize import root

from graphsynth.core.checks import finite
from graphsynth.core.errors import GeometryError
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of
from graphsynth.systems.antenna import PointingMechanism
from graphsynth.systems.antenna.loop_equations import loop_equations
from graphsynth.systems.antenna.precise import precise_angles
from graphsynth.systems.antenna.scene import antenna_of

Array = NDArray[np.float64]
_DIGITS = 50
_REFERENCE = f"Newton's method with {_DIGITS} digits on the lengths of both rods"
_KIND = "largest distance from the reference"
_CLOSED, _NEWTON, _SCIPY = "closed form", "twelve equations, own Newton", "twelve equations, scipy root"
_ORDER = (_CLOSED, _NEWTON, _SCIPY)


def poses(context: Any, effort: Effort) -> Problem:
    """Poses over the sweep of the scene."""
    return pose_problem(antenna_of(context), context.scene.mechanism.sweep.largest, effort)


def rod_angles(mechanism: PointingMechanism, phi_x: float, phi_y: float, near: tuple[float, float]) -> tuple[Any, Any]:
    """Elevation and azimuth with 50 digits from two equations: each rod is as long as it is.

    Nothing of the closed form is used: the ends of the cranks, the turned ends on the reflector, their distances. Crank
    angles are taken as the doubles they are; `near` (elevation, azimuth) chooses the assembly mode.

    Examples
    --------
    >>> from graphsynth.systems.antenna import PointingMechanism
    >>> phi = math.radians(40)
    >>> [round(math.degrees(x), 9) for x in rod_angles(PointingMechanism(), phi, phi, (0.4, 0.4))]
    [23.712080016, 22.447857254]
    """
    with mp.workdps(_DIGITS + 10):
        l1, rod_y, crank_y, rod_x, crank_x = (mp.mpf(repr(length)) for length in mechanism.lengths)
        x, y = mp.mpf(phi_x), mp.mpf(phi_y)
        pin_y = (mp.mpf(0), l1 - crank_y + crank_y * mp.cos(x), -rod_y + crank_y * mp.sin(x))
        pin_x = (l1 - crank_x + crank_x * mp.cos(y), mp.mpf(0), -rod_x - crank_x * mp.sin(y))

        def lengths(a: Any, b: Any) -> list[Any]:
            ca, sa, cb, sb = mp.cos(a), mp.sin(a), mp.cos(b), mp.sin(b)
            if mechanism.order == "YX":  # R_y(b) R_x(a): the ends on the reflector at (0, l1, 0) and (l1, 0, 0)
                end_y, end_x = (sb * sa * l1, ca * l1, cb * sa * l1), (cb * l1, mp.mpf(0), -sb * l1)
            else:  # R_x(a) R_y(b)
                end_y, end_x = (mp.mpf(0), ca * l1, sa * l1), (cb * l1, sa * sb * l1, -ca * sb * l1)
            pairs = ((end_y, pin_y, rod_y), (end_x, pin_x, rod_x))
            return [sum((p - q) ** 2 for p, q in zip(end, pin)) - rod * rod for end, pin, rod in pairs]

        found = mp.findroot(lengths, tuple(map(mp.mpf, near)), tol=mp.mpf(10) ** (-2 * _DIGITS))
        return found[0], found[1]


def pointing_errors(
    mechanism: PointingMechanism, largest: float = math.radians(40.0), *, poses: int = 41, rounds: int = 3
) -> tuple[Row, ...]:
    """Error against run time of every way to a pose, over equal crank angles up to ``largest`` on the mode at rest.

    Ways: the closed form in bulk (timed with 100 000 poses) and pose by pose, Newton's method on the twelve equations
    in bulk, scipy's ``root`` on the same equations pose by pose with several tolerances.  Rows hold the largest errors
    of both angles (radians; NaN after a failure) and the seconds for one pose. A `GeometryError` refuses fewer than two
    poses or one round, and a mechanism that cannot be assembled throughout.

    Examples
    --------
    >>> from graphsynth.systems.antenna import PointingMechanism
    >>> pointing_errors(PointingMechanism(), poses=3, rounds=1)[0].error < 1e-15
    True
    """
    if poses < 2 or rounds < 1:
        raise GeometryError(f"poses = {poses} and rounds = {rounds}: give at least two poses and one round")
    phi = np.linspace(0.0, finite("largest", largest), poses)
    truth = _truths(mechanism, phi)
    many = np.linspace(0.0, largest, 100_000)
    closed, newton = partial(_closed, mechanism), partial(_newton, mechanism)

    def bulk() -> Array:
        closed(many)
        return closed(phi)

    def single() -> Array:
        return np.concatenate([closed(np.array([x])) for x in phi.tolist()])

    runs: list[tuple[str, str, Callable[[], Array], int]] = [
        (_CLOSED, "100 000 poses at once", bulk, many.size),
        (_CLOSED, "pose by pose", single, poses),
        (_NEWTON, f"{poses} poses at once", lambda: newton(phi), poses),
    ]
    runs += [
        (_SCIPY, f"tol {tolerance:.0e}", _scipy(mechanism, phi, tolerance), poses) for tolerance in (1e-4, 1e-8, 1e-12)
    ]
    return tuple(_row(method, setting, run, truth, count, Effort(rounds)) for method, setting, run, count in runs)


def _row(method: str, setting: str, run: Callable[[], Array], truth: Array, count: int, effort: Effort) -> Row:
    found, *timed = best_of(run, effort)
    error = float(np.abs(found - truth).max())
    return Row.of(method, setting, error, timed, many=count, kind=_KIND, reference=_REFERENCE)


def _closed(mechanism: PointingMechanism, angles: Array) -> Array:
    found = mechanism.poses(angles, angles)
    return np.stack([found.a, found.b], -1)


def _newton(mechanism: PointingMechanism, angles: Array) -> Array:
    return np.asarray(mechanism.solve_loops(angles, angles).x[:, [5, 11]])


def _scipy(mechanism: PointingMechanism, phi: Array, tolerance: float) -> Callable[[], Array]:
    """Continue from pose to pose; the unknowns are shifted by 1, because the step of ``hybr`` scales with them."""

    def residual(y: Array, x: float) -> Array:
        found: Array = loop_equations(mechanism, y[None] - 1.0, np.array([[x, x]]), "corrected").residual[0]
        return found

    def run() -> Array:
        y, found = np.ones(12), []
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for x in phi.tolist():
                answer = root(residual, y, args=(x,), method="hybr", tol=tolerance)
                y = answer.x
                found.append((y - 1.0)[[5, 11]])
        return np.array(found)

    return run


def pose_problem(mechanism: PointingMechanism, largest: float, effort: Effort | None = None) -> Problem:
    """Compare the closed form with the twelve equations, over equal crank angles up to ``largest`` (radians).

    Examples
    --------
    >>> from graphsynth.systems.antenna import PointingMechanism
    >>> pose_problem(PointingMechanism(), 0.5, Effort(rounds=1, quick=True)).rows[0].error < 1e-15
    True
    """
    effort = effort or Effort()
    count = 3 if effort.quick else 9
    phi = np.linspace(0.0, largest, count)
    given = list(pointing_errors(mechanism, largest, poses=count, rounds=effort.rounds))
    # further numbers of poses at once, the same poses again and again
    ways = ((_CLOSED, _closed, (100,)), (_NEWTON, _newton, (1, 3 * count)))
    for method, way, sizes in ways:
        for size in sizes:
            angles = np.resize(phi[::-1], size)
            truth = np.resize(_truths(mechanism, phi)[::-1], (size, 2))
            setting = f"{size} pose{'s' if size > 1 else ''} at once"
            given.append(_row(method, setting, partial(way, mechanism, angles), truth, size, effort))
    gaps = (
        float(abs(p - q))
        for value in phi.tolist()
        for p, q in zip(precise_angles(mechanism, value, value), _truth(mechanism, value), strict=True)
    )
    far = max(gaps)
    away = "" if far < 1e-40 else f"the closed form with 50 digits is {far:.1e} rad from the reference"
    rows = []
    for row in sorted(given, key=lambda row: _ORDER.index(row.method)):
        lost = not math.isfinite(row.error) or row.error > 0.01
        why = "it converges to another assembly, or to none" if lost else away
        rows.append(replace(row, status=RowStatus.UNRELIABLE if why else RowStatus.OK, reason=why))
    question = f"Elevation and azimuth of the reflector, both cranks from 0 to {math.degrees(largest):g} degrees"
    return Problem("poses", question, "rad", tuple(rows), "pose")


def _truth(mechanism: PointingMechanism, phi: float) -> tuple[Any, Any]:
    pose = mechanism.poses(phi, phi)
    return rod_angles(mechanism, phi, phi, (float(pose.a), float(pose.b)))


def _truths(mechanism: PointingMechanism, phi: Array) -> Array:
    if not mechanism.poses(phi, phi).assembled.all():
        raise GeometryError("the mechanism cannot be assembled at all of these crank angles; lower largest")
    return np.array([[float(x) for x in _truth(mechanism, value)] for value in phi.tolist()])
