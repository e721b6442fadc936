"""Poses of the antenna: rows of its own room, and more sizes, against the lengths of the rods in fifty digits."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of

if TYPE_CHECKING:
    from graphsynth.systems.antenna import PointingMechanism

__all__ = ["pose_problem", "rod_angles"]

Array = NDArray[np.float64]
_DIGITS = 50
_REFERENCE = f"Newton's method with {_DIGITS} digits on the lengths of both rods"
_KIND = "largest distance from the reference"


def rod_angles(mechanism: PointingMechanism, phi_x: float, phi_y: float, near: tuple[float, float]) -> tuple[Any, Any]:
    """Elevation and azimuth with 50 digits from two equations: each rod is as long as it is.

    Nothing of the closed form is used: the ends of the cranks, the turned ends on the reflector, their distances.

    Parameters
    ----------
    mechanism : PointingMechanism
    phi_x, phi_y : float
        Angles of the cranks of legs Y and X, radians, taken as the doubles they are.
    near : (float, float)
        Elevation and azimuth near by, which choose the assembly mode.

    Examples
    --------
    >>> from graphsynth.systems.antenna import PointingMechanism
    >>> phi = math.radians(40)
    >>> [round(math.degrees(x), 9) for x in rod_angles(PointingMechanism(), phi, phi, (0.4, 0.4))]
    [23.712080016, 22.447857254]
    """
    from mpmath import mp

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


def pose_problem(mechanism: PointingMechanism, largest: float, effort: Effort | None = None) -> Problem:
    """Compare the closed form with the twelve equations, over equal crank angles up to ``largest`` (radians).

    Examples
    --------
    >>> from graphsynth.systems.antenna import PointingMechanism
    >>> pose_problem(PointingMechanism(), 0.5, Effort(rounds=1, quick=True)).rows[0].error < 1e-15
    True
    """
    from graphsynth.systems.antenna.accuracy import pointing_errors

    effort = effort or Effort()
    count = 3 if effort.quick else 9
    phi = np.linspace(0.0, largest, count)
    given = [
        Row(r.method, r.setting, r.error, r.seconds, effort.rounds, _KIND, _REFERENCE)
        for r in pointing_errors(mechanism, largest, poses=count, rounds=effort.rounds)
    ]
    given += _sizes(mechanism, phi, effort)
    why = _disagreement(mechanism, phi)
    rows = [_judged(row, why) for row in sorted(given, key=lambda row: list(_ORDER).index(row.method))]
    question = f"Elevation and azimuth of the reflector, both cranks from 0 to {math.degrees(largest):g} degrees"
    return Problem("poses", question, "rad", tuple(rows), "pose")


_CLOSED, _NEWTON, _SCIPY = "closed form", "twelve equations, own Newton", "twelve equations, scipy root"
_ORDER = (_CLOSED, _NEWTON, _SCIPY)


def _sizes(mechanism: PointingMechanism, phi: Array, effort: Effort) -> list[Row]:
    """Further numbers of poses at once, the same poses again and again."""
    truth = np.array([[float(x) for x in _truth(mechanism, value)] for value in phi.tolist()])

    def closed(angles: Array) -> Array:
        found = mechanism.poses(angles, angles)
        return np.stack([found.a, found.b], -1)

    def newton(angles: Array) -> Array:
        return np.asarray(mechanism.solve_loops(angles, angles).x[:, [5, 11]])

    ways: tuple[tuple[str, Callable[[Array], Array], tuple[int, ...]], ...] = (
        (_CLOSED, closed, (100,)), (_NEWTON, newton, (1, 3 * phi.size)),
    )  # fmt: skip
    rows = []
    for method, way, sizes in ways:
        for size in sizes:
            angles = np.resize(phi[::-1], size)
            found, seconds, rounds = best_of(lambda way=way, angles=angles: way(angles), effort)  # type: ignore[misc]
            error = float(np.abs(found - np.resize(truth[::-1], (size, 2))).max())
            setting = f"{size} pose{'s' if size > 1 else ''} at once"
            rows.append(Row(method, setting, error, seconds / size, rounds, _KIND, _REFERENCE))
    return rows


def _truth(mechanism: PointingMechanism, phi: float) -> tuple[Any, Any]:
    pose = mechanism.poses(phi, phi)
    return rod_angles(mechanism, phi, phi, (float(pose.a), float(pose.b)))


def _disagreement(mechanism: PointingMechanism, phi: Array) -> str:
    """Why the closed form in 50 digits, against which the room measures, is not the reference; "" if it is."""
    from graphsynth.systems.antenna.precise import precise_angles

    away = max(
        float(abs(p - q))
        for value in phi.tolist()
        for p, q in zip(precise_angles(mechanism, value, value), _truth(mechanism, value), strict=True)
    )
    return "" if away < 1e-40 else f"the closed form with 50 digits is {away:.1e} rad from the reference"


def _judged(row: Row, why: str) -> Row:
    if not math.isfinite(row.error) or row.error > 0.01:
        why = "it converges to another assembly, or to none"
    return replace(row, status=RowStatus.UNRELIABLE if why else RowStatus.OK, reason=why)
