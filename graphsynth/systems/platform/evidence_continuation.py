"""One branch of the single-motor platform over its turn: followed, picked from all modes, and proved."""

from __future__ import annotations

import math
from functools import partial
from inspect import signature
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError, GraphsynthError
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of
from graphsynth.systems.platform.evidence_direct_reference import precise_modes

if TYPE_CHECKING:
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

__all__ = ["precise_branch", "turn_problem"]

Array = NDArray[np.float64]
_NODES = 12
_REFERENCE = "interpolated closure condition, roots with 50 digits, drives in closed form with 50 digits"
_KIND = "distance from the reference"


def precise_branch(mechanism: SingleMotorPlatform, psi: Array, near: Array) -> Array:
    """Poses of one branch at wheel angles with 50 digits, rounded once, shape (n, 3).

    The rocker angles come from the drives' circles intersected with 50 digits; of all assembly modes the one nearest to
    ``near`` (n, 3) is taken.

    Raises
    ------
    GeometryError
        A drive that cannot be assembled.
    """
    import mpmath

    found = []
    with mpmath.workdps(60):
        turn = [mpmath.expj(mpmath.mpf(a)) for a in mechanism.frame_angle]
        for angle, guess in zip(psi, near):
            anchors = []
            for k in range(3):
                pin = mpmath.mpc(mechanism.axis[k]) + mpmath.mpf(mechanism.crank[k]) * mpmath.expj(
                    mpmath.mpf(float(angle)) + mpmath.mpf(mechanism.phase[k]) - mpmath.mpf(mechanism.frame_angle[k])
                )
                rocker = _circle(pin, mpmath.mpc(mechanism.pivot[k]), mechanism, k)
                arm = mpmath.mpf(mechanism.l1[k]) * rocker * mpmath.expj(mpmath.mpf(mechanism.delta[k]))
                anchors.append((mpmath.mpc(mechanism.pivot[k]) + arm) * turn[k])
            vertices = [mpmath.mpc(mechanism.vertex[k]) * turn[k] for k in range(3)]
            modes = precise_modes(anchors, vertices, mechanism.l2)
            found.append(modes[int(np.argmin(_apart(modes, guess, mechanism.Lc)))])
    return np.array(found)


def _circle(pin: Any, pivot: Any, mechanism: SingleMotorPlatform, k: int) -> Any:
    """Direction of the rocker, drive joint left or right of the line from pin to pivot as the branch says."""
    import mpmath

    coupler, rocker = mpmath.mpf(mechanism.coupler[k]), mpmath.mpf(mechanism.rocker[k])
    w = pin - pivot
    D = abs(w)
    cosine = (D * D + rocker * rocker - coupler * coupler) / (2 * D * rocker)
    if abs(cosine) > 1:
        raise GeometryError(f"drive {k + 1} cannot be assembled, so there is no turn to compare")
    return w / D * mpmath.expj(mechanism.tau[k] * mpmath.acos(cosine))


def _apart(poses: Array, guess: Array, Lc: float) -> Array:
    d = np.atleast_2d(poses) - guess
    turn = np.angle(np.exp(1j * d[..., 2]))
    return np.asarray(np.sqrt((d[..., 0] ** 2 + d[..., 1] ** 2) / Lc**2 + turn**2))


def turn_problem(mechanism: SingleMotorPlatform, effort: Effort | None = None) -> Problem:
    """Compare continuation, the full turn with all modes, the modes alone and the certificate.

    Parameters
    ----------
    mechanism : SingleMotorPlatform
        That turns fully.
    effort : Effort, optional

    Raises
    ------
    GeometryError
        If the branch ends within the turn.
    """
    effort = effort or Effort()
    psi = np.linspace(0.0, math.tau, _NODES + 1)
    followed = mechanism.sweep(psi)
    if not followed.complete:
        raise GeometryError(f"the branch ends within the turn: {followed.reason}")
    truth = precise_branch(mechanism, psi, followed.pose)
    rows: list[Row] = []
    for count in (13, 37, 73) if effort.quick else (13, 37, 361, 3601, 36_001):
        grid = np.linspace(0.0, math.tau, count)
        rows.append(_row(
            mechanism, "continuation", count, truth, effort, partial(_swept, mechanism, grid),
        ))  # fmt: skip
    for count in (13, 37, 73) if effort.quick else (37, 361, 3601):
        grid = np.linspace(0.0, math.tau, count)
        rows.append(_row(
            mechanism, "continuation, all modes compared, events", count, truth, effort,
            partial(_turned, mechanism, grid),
        ))  # fmt: skip
    limit = _default_boxes()
    rows += [_proof(mechanism, boxes, truth, psi, effort) for boxes in sorted({40, 400, limit})]
    question = "The home branch of the platform of the scene over a turn of the wheels"
    return Problem("turn", question, "relative", tuple(rows), "position")


def _swept(mechanism: SingleMotorPlatform, psi: Array) -> Array:
    return mechanism.sweep(psi).pose


def _turned(mechanism: SingleMotorPlatform, psi: Array) -> Array:
    return mechanism.full_turn(psi).pose


def _row(
    mechanism: SingleMotorPlatform, method: str, count: int, truth: Array, effort: Effort, run: Any
) -> Row:  # fmt: skip
    found, seconds, rounds = best_of(run, effort)
    nodes = found[:: (count - 1) // _NODES]
    whole = len(found) == count and bool(np.isfinite(nodes).all())
    error = float(_apart(nodes, truth, mechanism.Lc).max()) if whole else math.nan
    return Row(
        method, f"{count} positions", error, seconds / count, rounds, _KIND, _REFERENCE,
        RowStatus.OK if whole else RowStatus.FAILED, "" if whole else "the branch is lost",
    )  # fmt: skip


def _default_boxes() -> int:
    from graphsynth.systems.platform import certify_full_turn

    return int(signature(certify_full_turn).parameters["max_boxes"].default)


def _proof(mechanism: SingleMotorPlatform, boxes: int, truth: Array, psi: Array, effort: Effort) -> Row:
    """Certificate of the whole turn: every angle is proved, so the seconds are those of the turn."""
    method, kind = "certificate of the full turn", "largest proved radius at the nodes"
    try:
        from graphsynth.systems.platform import certify_full_turn

        found, seconds, rounds = best_of(lambda: certify_full_turn(mechanism, max_boxes=boxes), effort)
    except GraphsynthError as error:
        return Row(method, f"{boxes} boxes", math.nan, math.nan, 0, kind, "", RowStatus.FAILED, str(error))
    default, setting = boxes == _default_boxes(), f"up to {boxes} boxes"
    if not found.certified:
        return Row(
            method, setting, math.nan, seconds, rounds, kind, "", RowStatus.FAILED, found.statement, default, True
        )
    radii, why = [], ""
    for angle, right in zip(psi[:-1], truth):
        pose, radius = found.enclosure(float(angle))
        scaled = float(np.linalg.norm(np.asarray(radius) / [mechanism.Lc, mechanism.Lc, 1.0]))
        if _apart(np.asarray(pose), right, mechanism.Lc).max() > scaled + 1e-15:
            why = "the reference lies outside of what is proved"
        radii.append(scaled)
    status = RowStatus.FAILED if why else RowStatus.OK
    return Row(
        method, setting, max(radii), seconds, rounds, kind, "none needed; checked to hold the pose with 50 digits",
        status, why, default, True,
    )  # fmt: skip
