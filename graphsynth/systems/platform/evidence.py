"""``module = "single_motor_platform"``: what is measured of the platform with one motor."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from inspect import signature
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError, GraphsynthError
from graphsynth.evidence.choice import seconds_text
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of
from graphsynth.systems.platform.evidence_direct import Proved, assessed, eigenvalue_modes, precise_modes, proof_row
from graphsynth.systems.platform.motion import distance

if TYPE_CHECKING:
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

Array = NDArray[np.float64]
_NODES = 12
_REFERENCE = "interpolated closure condition, roots with 50 digits, drives in closed form with 50 digits"
_KIND = "distance from the reference"
_AWAY = "distance from the singularity"
Complex = NDArray[np.complex128]


def _mechanism(context: Any) -> Any:
    """Platform with the dimensions of the scene, as its stage builds it."""
    from graphsynth.systems.platform.stages import platform_of

    return platform_of(context)


def assembly_modes(context: Any, effort: Effort) -> Problem:
    """Measure all modes at angles that the drives reach during the turn."""
    import numpy as np

    from graphsynth.systems.platform.evidence_direct import mode_problem

    mechanism = _mechanism(context)
    psi = np.linspace(0.1, 0.1 + math.tau, 4 if effort.quick else 24, endpoint=False)
    theta = mechanism.drive(psi).theta
    return mode_problem(mechanism.platform, theta, mechanism.Lc, "the platform of the scene", effort)


def double_root(context: Any, effort: Effort) -> Problem:
    """Measure two modes that nearly merge."""
    return double_root_problem(effort)


def turn(context: Any, effort: Effort) -> Problem:
    """Measure one branch followed over the turn."""
    return turn_problem(_mechanism(context), effort)


def drive(context: Any, effort: Effort) -> Problem:
    """Measure the motor that runs the platform up from rest, with the inertia of the real motion."""
    from graphsynth.evidence.drives import drive_problem
    from graphsynth.systems.platform.motor_stages import machine_drive

    table = getattr(context.scene.mechanism, "drive", None)
    if table is None:
        raise GeometryError("the scene has no table [mechanism.drive], so no motor")
    model = machine_drive(_mechanism(context), table, table.resistances[0])
    return drive_problem(model.plant(), model.motor, model.train, table.end, effort)


def motor_drive(context: Any, effort: Effort) -> Problem:
    """Measure the run from rest for the first resistance."""
    from graphsynth.evidence.drives import drive_problem

    table = context.scene.mechanism
    from graphsynth.systems.platform.motor_stages import drive_of

    model = drive_of(context, table.resistances[0])
    return drive_problem(model.plant(), model.motor, model.train, table.end, effort)


def small_inductance(context: Any, effort: Effort) -> Problem:
    """Measure the limit L -> 0."""
    import numpy as np

    from graphsynth.evidence.drives import reduction_problem

    limit = context.scene.mechanism.limit
    if len(limit.inductances) < 3:
        raise GeometryError("the scene names fewer than three inductances, so there is no limit to compare")
    from graphsynth.systems.platform.motor_stages import drive_of

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
            found.append(modes[int(np.argmin(distance(modes, guess, mechanism.Lc)))])
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


def turn_problem(mechanism: SingleMotorPlatform, effort: Effort | None = None) -> Problem:
    """Compare continuation, the full turn with all modes, the modes alone and the certificate.

    `mechanism`: that turns fully. Raises `GeometryError` if the branch ends within the turn.
    """
    effort = effort or Effort()
    psi = np.linspace(0.0, math.tau, _NODES + 1)
    followed = mechanism.sweep(psi)
    if not followed.complete:
        raise GeometryError(f"the branch ends within the turn: {followed.reason}")
    truth = precise_branch(mechanism, psi, followed.pose)
    quick, rows = (13, 37, 73), list[Row]()
    ways = (
        ("continuation", mechanism.sweep, quick if effort.quick else (13, 37, 361, 3601, 36_001)),
        ("continuation, all modes compared, events", mechanism.full_turn, quick if effort.quick else (37, 361, 3601)),
    )
    for method, follow, counts in ways:
        rows += [_turn_row(mechanism, method, follow, count, truth, effort) for count in counts]
    limit = _default_boxes()
    rows += [_proof(mechanism, boxes, truth, psi, effort) for boxes in sorted({40, 400, limit})]
    question = "The home branch of the platform of the scene over a turn of the wheels"
    return Problem("turn", question, "relative", tuple(rows), "position")


def _turn_row(
    mechanism: SingleMotorPlatform,
    method: str,
    follow: Callable[[Array], Any],
    count: int,
    truth: Array,
    effort: Effort,
) -> Row:
    grid = np.linspace(0.0, math.tau, count)
    found, seconds, rounds = best_of(lambda: follow(grid).pose, effort)
    nodes = found[:: (count - 1) // _NODES]
    whole = len(found) == count and bool(np.isfinite(nodes).all())
    error = float(distance(nodes, truth, mechanism.Lc).max()) if whole else math.nan
    verdict = (RowStatus.OK, "") if whole else (RowStatus.FAILED, "the branch is lost")
    return Row(method, f"{count} positions", error, seconds / count, rounds, _KIND, _REFERENCE, *verdict)


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
    flags, setting = (boxes == _default_boxes(), True), f"up to {boxes} boxes"
    if not found.certified:
        verdict = (RowStatus.FAILED, found.statement)
        return Row(method, setting, math.nan, seconds, rounds, kind, "", *verdict, *flags)
    radii, verdict = [], (RowStatus.OK, "")
    for angle, right in zip(psi[:-1], truth):
        pose, radius = found.enclosure(float(angle))
        scaled = float(np.linalg.norm(np.asarray(radius) / [mechanism.Lc, mechanism.Lc, 1.0]))
        if distance(np.asarray(pose), right, mechanism.Lc) > scaled + 1e-15:
            verdict = (RowStatus.FAILED, "the reference lies outside of what is proved")
        radii.append(scaled)
    reference = "none needed; checked to hold the pose with 50 digits"
    return Row(method, setting, max(radii), seconds, rounds, kind, reference, *verdict, *flags)


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
        for method, escalate in (("sextic and Newton", True), ("the same, doubles only", False)):
            run = partial(assembly_modes_batch, anchors, corner, lengths, escalate=escalate)
            batch, seconds, rounds = best_of(run, effort)
            row = assessed(method, setting, [batch.poses], truth, 1.0, seconds, rounds, more={_AWAY: d})
            if not escalate and bool(batch.near_double_root[0]):
                row = _flagged(row)
            rows.append(row)
        for band in (1e-6, 1e-9):
            way = partial(eigenvalue_modes, anchors[None], corner, lengths, polish=2, band=band)
            modes, seconds, rounds = best_of(way, effort)
            name = f"companion eigenvalues, band {band:g}"
            rows.append(assessed(name, setting, modes, truth, 1.0, seconds, rounds, more={_AWAY: d}))
        proved = _certified_near(anchors, corner, lengths, truth, setting, effort)
        rows.append(replace(proved, more={_AWAY: d}))
    question = "Two assembly modes that nearly merge, at distances from the singularity (similar triangles)"
    note = (
        "The settings are distances from the singularity, not accuracies: the condition of the modes is one over the "
        "square root of the distance."
    )
    found = Problem("double-root", question, "relative", tuple(rows), "problem", note, over=_AWAY)
    return replace(found, sentences={method: _sentence(method, found.of(method)) for method in found.methods})


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


def _flagged(row: Row) -> Row:
    why = row.reason or "it flags the problem as undecided in doubles"
    return replace(row, status=RowStatus.FAILED, error=math.nan, reason=why)


def _certified_near(
    anchors: Complex, corner: Complex, lengths: Array, truth: Sequence[Array], setting: str, effort: Effort
) -> Row:
    def run() -> Proved:
        from graphsynth.systems.platform import certify_assembly_modes

        proof = certify_assembly_modes(anchors.tolist(), corner.tolist(), lengths.tolist())
        poses = np.array([mode.pose for mode in proof.modes]).reshape(-1, 3)
        radius = max((float(np.linalg.norm(mode.radius)) for mode in proof.modes), default=0.0)
        return [(poses, radius) if proof.certified else None]

    return proof_row("certified, up to 512 bits", setting, run, truth, 1.0, 1, effort)
