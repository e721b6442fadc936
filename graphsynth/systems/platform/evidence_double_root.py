"""Two assembly modes that nearly merge: where each way to the modes stops being right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import nan

import numpy as np
from numpy.typing import NDArray

from graphsynth.evidence.choice import seconds_text
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of
from graphsynth.systems.platform.evidence_direct import Proved, judged, proof_row
from graphsynth.systems.platform.evidence_direct_reference import precise_modes
from graphsynth.systems.platform.evidence_eigenvalues import eigenvalue_modes

__all__ = ["double_root_problem"]

_AWAY = "distance from the singularity"

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


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
            row = judged(method, setting, [batch.poses], truth, 1.0, seconds, rounds, more={_AWAY: d})
            if not escalate and bool(batch.near_double_root[0]):
                row = _flagged(row)
            rows.append(row)
        for band in (1e-6, 1e-9):
            way = partial(eigenvalue_modes, anchors[None], corner, lengths, polish=2, band=band)
            modes, seconds, rounds = best_of(way, effort)
            name = f"companion eigenvalues, band {band:g}"
            rows.append(judged(name, setting, modes, truth, 1.0, seconds, rounds, more={_AWAY: d}))
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
        return f"{method}: do not choose it here; it is right at none of the distances."
    near, far = right[-1], right[0]
    text = (
        f"{method}: right down to a {near.setting}, with errors up to {max(row.error for row in right):.1g}; "
        f"{seconds_text(near.seconds)} there, {seconds_text(far.seconds)} at {far.setting}"
    )
    lost = [row for row in rows if row.status is not RowStatus.OK]
    return text + (f"; {lost[0].reason} at {', '.join(row.setting.split()[1] for row in lost)}." if lost else ".")


def _flagged(row: Row) -> Row:
    why = row.reason or "it flags the problem as undecided in doubles"
    return replace(row, status=RowStatus.FAILED, error=nan, reason=why)


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
