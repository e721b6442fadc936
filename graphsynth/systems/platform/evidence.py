"""``module = "single_motor_platform"``: what is measured of the platform with one motor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from inspect import signature
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.evidence.choice import seconds_text
from graphsynth.evidence.drives import drive_problem, reduction_problem
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of
from graphsynth.systems.platform.certified_assembly_modes import certify_assembly_modes
from graphsynth.systems.platform.certified_full_turn import certify_full_turn
from graphsynth.systems.platform.evidence_direct import (
    PROVED,
    Proved,
    assessed,
    eigenvalue_modes,
    mode_problem,
    of_certificate,
    precise_modes,
    proof_row,
)
from graphsynth.systems.platform.motion import distance
from graphsynth.systems.platform.motor_stages import drive_of, machine_drive
from graphsynth.systems.platform.stages import platform_of

if TYPE_CHECKING:
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

Array = NDArray[np.float64]
_NODES = 12
_REFERENCE = "interpolated closure condition, roots with 50 digits, drives in closed form with 50 digits"
_KIND = "distance from the reference"
_AWAY = "distance from the singularity"


def assembly_modes(context: Any, effort: Effort) -> Problem:
    """Measure all modes at angles that the drives reach during the turn."""
    mechanism = platform_of(context)
    psi = np.linspace(0.1, 0.1 + math.tau, 4 if effort.quick else 24, endpoint=False)
    theta = mechanism.drive(psi).theta
    return mode_problem(mechanism.platform, theta, mechanism.Lc, "the platform of the scene", effort)


def double_root(context: Any, effort: Effort) -> Problem:
    """Measure two modes that nearly merge."""
    return double_root_problem(effort)


def turn(context: Any, effort: Effort) -> Problem:
    """Measure one branch followed over the rotation."""
    return turn_problem(platform_of(context), effort)


def drive(context: Any, effort: Effort) -> Problem:
    """Measure the motor that runs the platform up from rest, with the inertia of the real motion."""
    table = getattr(context.scene.mechanism, "drive", None)
    if table is None:
        raise GeometryError("the scene has no table [mechanism.drive], so no motor")
    model = machine_drive(platform_of(context), table, table.resistances[0])
    return drive_problem(model.plant(), model.motor, model.train, table.end, effort)


def motor_drive(context: Any, effort: Effort) -> Problem:
    """Measure the run from rest for the first resistance."""
    table = context.scene.mechanism
    model = drive_of(context, table.resistances[0])
    return drive_problem(model.plant(), model.motor, model.train, table.end, effort)


def small_inductance(context: Any, effort: Effort) -> Problem:
    """Measure the limit L -> 0."""
    limit = context.scene.mechanism.limit
    if len(limit.inductances) < 3:
        raise GeometryError("the scene names fewer than three inductances, so there is no limit to compare")
    model = drive_of(context, limit.resistance)
    return reduction_problem(model, np.linspace(0.0, limit.end, 26), limit.inductances, effort)


def precise_branch(mechanism: SingleMotorPlatform, psi: Array, near: Array) -> Array:
    """Poses of one branch at wheel angles with 50 digits, rounded once, shape (n, 3).

    The rocker angles come from the drives' circles intersected with 50 digits; of all assembly modes the one nearest to
    ``near`` (n, 3) is taken.

    Raises `GeometryError`: a drive that cannot be assembled.
    """
    import mpmath

    found = []
    with mpmath.workdps(60):
        turn = [mpmath.expj(mpmath.mpf(a)) for a in mechanism.frame_angle]
        for angle, guess in zip(psi, near):
            anchors = [_elbow(mechanism, k, mpmath.mpf(float(angle))) * turn[k] for k in range(3)]
            vertices = [mpmath.mpc(mechanism.vertex[k]) * turn[k] for k in range(3)]
            modes = precise_modes(anchors, vertices, mechanism.l2)
            found.append(modes[int(np.argmin(distance(modes, guess, mechanism.Lc)))])
    return np.array(found)


def _elbow(mechanism: SingleMotorPlatform, k: int, psi: Any) -> Any:
    """Joint between rocker and intermediate link in the frame of leg k, on the branch of the drive."""
    import mpmath

    names = ("axis", "pivot", "phase", "frame_angle", "delta", "crank", "coupler", "rocker", "l1")
    given = [mpmath.mpmathify(getattr(mechanism, name)[k]) for name in names]
    axis, pivot, phase, frame, delta, crank, coupler, rocker, l1 = given
    w = axis + crank * mpmath.expj(psi + phase - frame) - pivot
    D = abs(w)
    cosine = (D * D + rocker * rocker - coupler * coupler) / (2 * D * rocker)
    if abs(cosine) > 1:
        raise GeometryError(f"drive {k + 1} cannot be assembled, so there is no rotation to compare")
    return pivot + l1 * (w / D) * mpmath.expj(mechanism.tau[k] * mpmath.acos(cosine) + delta)


def turn_problem(mechanism: SingleMotorPlatform, effort: Effort | None = None) -> Problem:
    """Compare continuation, the full rotation with all modes, the modes alone and the certificate.

    `mechanism`: that turns fully. Raises `GeometryError` if the branch ends within the rotation.
    """
    effort = effort or Effort()
    psi = np.linspace(0.0, math.tau, _NODES + 1)
    followed = mechanism.sweep(psi)
    if not followed.complete:
        raise GeometryError(f"the branch ends within the turn: {followed.reason}")
    truth = precise_branch(mechanism, psi, followed.pose)
    quick, rows = (13, 37, 73), list[Row]()
    ways: tuple[tuple[str, Any, tuple[int, ...]], ...] = (
        ("continuation", mechanism.sweep, quick if effort.quick else (13, 37, 361, 3601, 36_001)),
        ("continuation, all modes compared, events", mechanism.full_turn, quick if effort.quick else (37, 361, 3601)),
    )
    for method, follow, counts in ways:
        for count in counts:
            found, *timed = best_of(partial(follow, np.linspace(0.0, math.tau, count)), effort)
            nodes = found.pose[:: (count - 1) // _NODES]
            whole = len(found.pose) == count and bool(np.isfinite(nodes).all())
            error = float(distance(nodes, truth, mechanism.Lc).max()) if whole else math.nan
            more: dict[str, Any] = {"kind": _KIND, "reference": _REFERENCE, "many": count}
            why = "" if whole else "the branch is lost"
            rows.append(Row.of(method, f"{count} positions", error, timed, why, **more))
    limit = signature(certify_full_turn).parameters["max_boxes"].default
    rows += [_proof(mechanism, boxes, boxes == limit, truth, psi, effort) for boxes in sorted({40, 400, limit})]
    question = "The home branch of the platform of the scene over a rotation of the wheels"
    return Problem("turn", question, "relative", tuple(rows), "position")


def _proof(mechanism: SingleMotorPlatform, boxes: int, default: bool, truth: Array, psi: Array, effort: Effort) -> Row:
    """Certificate of the whole rotation: every angle is proved, so the seconds are those of the rotation."""
    found, *timed = best_of(partial(certify_full_turn, mechanism, max_boxes=boxes), effort)
    radii, why = [math.nan], "" if found.certified else found.statement
    for angle, right in zip(psi[:-1], truth) if found.certified else ():
        pose, radius = found.enclosure(float(angle))
        radii.append(float(np.linalg.norm(radius / [mechanism.Lc, mechanism.Lc, 1.0])))
        if distance(pose, right, mechanism.Lc) > radii[-1] + 1e-15:
            why = "the reference lies outside of what is proved"
    more: dict[str, Any] = {"default": default, "proved": True, "reference": PROVED if found.certified else ""}
    kind, method = "largest proved radius at the nodes", "certificate of the full rotation"
    return Row.of(method, f"up to {boxes} boxes", float(np.fmax.reduce(radii)), timed, why, kind=kind, **more)


def double_root_problem(effort: Effort | None = None) -> Problem:
    """Two modes that nearly merge: similar triangles, equal legs of ``1 + d``; the modes are ``sqrt(d)`` apart.

    Settings are distances d from the singularity here: the table shows where each method stops being right.
    """
    from graphsynth.kinematics.triad.assembly_modes import assembly_modes_batch

    effort = effort or Effort()
    corner = np.exp(2j * np.pi * np.arange(3) / 3)
    anchors = 2.0 * corner
    rows: list[Row] = []
    for d in (1e-2, 1e-8, 1e-13) if effort.quick else (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13, 1e-14):
        lengths = np.full(3, 1.0 + d)
        truth = [precise_modes(anchors.tolist(), corner.tolist(), lengths.tolist())]
        setting = f"distance {d:g}"
        given = anchors, corner, lengths
        for method, escalate in (("sextic and Newton", True), ("the same, double precision only", False)):
            batch, *timed = best_of(partial(assembly_modes_batch, *given, escalate=escalate), effort)
            row = assessed(method, setting, [batch.poses], truth, 1.0, timed, more={_AWAY: d})
            if not escalate and bool(batch.near_double_root[0]):
                why = row.reason or "it flags the problem as undecided in double precision"
                row = replace(row, status=RowStatus.FAILED, error=math.nan, reason=why)
            rows.append(row)
        for band in (1e-6, 1e-9):
            way = partial(eigenvalue_modes, anchors[None], corner, lengths, polish=2, band=band)
            modes, *timed = best_of(way, effort)
            name = f"companion eigenvalues, band {band:g}"
            rows.append(assessed(name, setting, modes, truth, 1.0, timed, more={_AWAY: d}))
        run = partial(_certified, *given)
        proved = proof_row("certified, up to 512 bits", setting, run, truth, 1.0, 1, effort)
        rows.append(replace(proved, more={_AWAY: d}))
    question = "Two assembly modes that nearly merge, at distances from the singularity (similar triangles)"
    note = (
        "The settings are distances from the singularity, not accuracies: the condition of the modes is one over the "
        "square root of the distance."
    )
    found = Problem("double-root", question, "relative", tuple(rows), "problem", note, over=_AWAY)
    return replace(found, sentences={method: _sentence(method, found.of(method)) for method in found.methods})


def _certified(*given: Array) -> Proved:
    return [of_certificate(certify_assembly_modes(*(values.tolist() for values in given)), 1.0)]


def _sentence(method: str, rows: Sequence[Row]) -> str:
    """Say how near to the singularity a method stays right, and what that costs."""
    right = [row for row in rows if row.good]
    if not right:
        return f"{method}: not usable here, it is right at none of the distances."
    near, far = right[-1], right[0]
    text = (
        f"{method}: right down to a {near.setting}, with errors up to {max(row.error for row in right):.1g}; "
        f"{seconds_text(near.seconds)} there, {seconds_text(far.seconds)} at {far.setting}"
    )
    lost = [row for row in rows if row.status is not RowStatus.OK]
    return text + (f"; {lost[0].reason} at {', '.join(row.setting.split()[1] for row in lost)}." if lost else ".")
