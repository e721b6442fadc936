"""Singular poses: classified at a start, with the branches that meet; why an integration does not get past one."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.tables import Compiled
from graphsynth.dynamics.values import Values, initial_slots

Array = NDArray[np.float64]
PoseClass = Literal["regular", "redundant", "singular", "not tested"]

#: Length of the steps to nearby poses, in characteristic lengths and radians.
_NEARBY = 1e-3


class BranchTangents(NamedTuple):
    """Motions possible at a singular pose with one lost rank and two instantaneous freedoms.

    ``kind`` is "change point" (two branches cross: ``motions`` (2, links, 3) are their velocities, largest entry 1),
    "isolated" (the second-order equation has no real solution) or "higher order" (it does not decide).
    """

    kind: str
    motions: Array
    discriminant: float


def classify_pose(
    values: Values, q: Array, rank: int, left: Array, null: Array, tolerance: float
) -> tuple[PoseClass, int, BranchTangents | None]:
    """Compare the rank at ``q`` with that at nearby poses on the constraints (theory/planar-dynamics 6, step 3).

    Parameters
    ----------
    left, null : ndarray
        Left and right null vectors of the scaled Jacobian, in columns.
    """
    directions = [*null.T, *(null @ np.array([np.cos(t), np.sin(t)]) for t in (0.7, 2.1) if null.shape[1] == 2)]
    nearby = rank
    for direction in directions:
        for sense in (1.0, -1.0):
            found = _returned(values, q + sense * _NEARBY * values.column_scale * direction)
            if found is not None:
                S = np.linalg.svd(values.scaled_jacobian(found), compute_uv=False)
                nearby = max(nearby, int(np.sum(tolerance * S[0] < S)))
    if nearby == rank:
        return "redundant", nearby, None
    return "singular", nearby, branch_tangents(values, q, left, null) if nearby == rank + 1 else None


def _returned(values: Values, q: Array) -> Array | None:
    """Return to the constraints from a point close to them; None if that does not converge."""
    for _ in range(30):
        C = values.system(q, np.zeros_like(q))[0] / values.row_scale
        if np.abs(C).max() < 1e-14:
            return q
        step = np.linalg.lstsq(values.scaled_jacobian(q), -C, rcond=1e-13)[0]
        size = float(np.abs(step).max())
        q = q + values.column_scale * step * min(1.0, 0.1 / max(size, 1e-300))
    return q if np.abs(C).max() < 1e-12 else None


def branch_tangents(values: Values, q: Array, left: Array, null: Array) -> BranchTangents | None:
    """Solve the second-order equation ``l . C_qq(n, n) = 0`` for the directions of the branches."""
    special = left
    if null.shape[1] != 2 or special.shape[1] != 1:
        return None
    scale = values.column_scale

    def form(direction: Array) -> float:
        gam = values.system(q, scale * direction)[2] + _driver_part(values)
        return float(special[:, 0] @ (-gam / values.row_scale))

    n1, n2 = null[:, 0], null[:, 1]
    a, c = form(n1), form(n2)
    b = 0.5 * (form(n1 + n2) - a - c)
    discriminant = b * b - a * c
    size = max(abs(a), abs(b), abs(c))
    if not size > 1e-9 or abs(discriminant) <= 1e-9 * size**2:
        return BranchTangents("higher order", np.empty((0, values.compiled.links, 3)), discriminant)
    if discriminant < 0.0:
        return BranchTangents("isolated", np.empty((0, values.compiled.links, 3)), discriminant)
    root = np.sqrt(discriminant)
    # a s^2 + 2 b s t + c t^2 = 0 with (s, t) homogeneous, without cancellation
    w = -(b + np.copysign(root, b))
    pairs = [(w, a), (c, w)]
    motions = []
    for s, t in pairs:
        v = scale * (s * n1 + t * n2)
        rate = values.compiled.to_links(q, v, np.zeros_like(v))[1]
        motions.append(rate / rate.flat[int(np.argmax(np.abs(rate)))])
    return BranchTangents("change point", np.array(motions), discriminant)


def _driver_part(values: Values) -> Array:
    """Remove the drivers' own accelerations from the right side."""
    zero = values.system(np.zeros(values.compiled.n), np.zeros(values.compiled.n))[2]
    kinds = values.compiled.tables.rows[:, 0]
    from graphsynth.kinematics.engine.codes import DRIVE_ANGLE, DRIVE_SLIDE

    return np.where((kinds == DRIVE_ANGLE) | (kinds == DRIVE_SLIDE), -zero, 0.0)


#: Masses farther apart than this (see `Compiled.spread`) may defeat double precision.
_SPREAD = 1e16
#: Smallest singular value of the constraints over the largest, above which a pose counts as regular.
_REGULAR = 1e-2


def stalled(form: Any, t: float, y: Array) -> str:
    """Say why steps become ever shorter at a state of a formulation."""
    compiled: Compiled = form.compiled
    found = lock(form, t, y)
    if found:
        return found
    values, q = _values(form, t, y)
    if _SPREAD < compiled.spread < np.inf and _least(values.scaled_jacobian(q)) > _REGULAR:
        return compiled.spread_words
    return str(form.stall)


def lock(form: Any, t: float, y: Array) -> str:
    """Say which prescribed motion locks the mechanism next to a state; nothing if none does.

    There the joints alone are regular, and with the prescribed coordinate they are not: it is at its extreme.
    """
    compiled: Compiled = form.compiled
    drivers = compiled.model.prescribed
    if not drivers or not np.isfinite(y).all():
        return ""
    values, q = _values(form, t, y)
    J = values.scaled_jacobian(q)
    of = np.array([info.joint for info in compiled.info])
    whole = _least(J)
    for number, driver in enumerate(drivers, len(compiled.joints) - len(drivers)):
        if whole < 0.1 and _least(J[of != number]) > 3.0 * whole:
            value, speed = values.driven[number - len(compiled.joints) + len(drivers), :2]
            unit = "m" if compiled.model.mechanism.joint(*driver.pair).kind == "P" else "rad"
            return (
                f"the prescribed motion of joint {driver.base}-{driver.link} locks the mechanism: near {value:.6g} "
                f"{unit}, at {speed:.3g} {unit}/s, its coordinate is at an extreme of what the joints allow; prescribe "
                "less, or another joint"
            )
    return ""


def _values(form: Any, t: float, y: Array) -> tuple[Values, Array]:
    q = np.ascontiguousarray(form.state(t, y)[0])
    return Values(form.compiled, t, initial_slots(form.compiled, q, getattr(form, "slots", None))), q


def _least(J: Array) -> float:
    """Smallest singular value over the largest; 1 without rows."""
    S = np.linalg.svd(J, compute_uv=False) if J.size else np.ones(1)
    return float(S[min(J.shape) - 1] / S[0]) if J.size and S[0] > 0.0 else 1.0
