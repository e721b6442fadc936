"""Assess any mechanism whose joints share the misalignment: least tilt, prices, verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import checked
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.joints.limits import Misalignment
from graphsynth.jamming.joints.problem import Bearings, Problem, check_motion, problem
from graphsynth.jamming.joints.program import PoseSolution
from graphsynth.jamming.joints.report import CoupledReport, Loosen
from graphsynth.jamming.verdict import Verdict

if TYPE_CHECKING:
    from graphsynth.kinematics.simulation import Motion

__all__ = ["assess_coupled"]

Array = NDArray[np.float64]

#: Differences from 1 below this are a matter of rounding.
_TOUCH = 1e-12


@checked
def assess_coupled(
    motion: Motion,
    bearings: Bearings,
    tilts: Misalignment | Iterable[Misalignment],
    *,
    condition: Condition = "A",
    certify: bool = False,
    length_tolerance: float = 0.0,
    seconds: float = 20.0,
) -> CoupledReport:
    """Assess whether all joints together can take up misaligned axes at every pose of a motion (model L1).

    Parameters
    ----------
    motion : Motion
        Of `graphsynth.simulate`; any planar mechanism.
    bearings : Bearing, JointLimits, SlideLimits, or mapping of (link, link) to one of these
        Limits of every joint.  Gear, cam and slot contacts that are not named guide nothing out of the plane.
    tilts : Misalignment or several
        Which axes are tilted; a rigid one (a motor shaft) takes no clearance of its own.
    condition : {"A", "B", "general"}
        Contact condition of every `Bearing`.
    certify : bool
        Prove the verdict between the samples too (`certify_coupled`), over the tolerance boxes.
    length_tolerance, seconds : float
        For the proof: relative tolerance of lengths, and its time.

    Returns
    -------
    CoupledReport
        Estimated at the samples, with primal and dual values and their gap; with ``certify`` the verdict and the
        reason are those of the proof.

    Raises
    ------
    GeometryError
        For limits or misalignments that do not fit the mechanism.

    Notes
    -----
    Specification lambda_and_jamming, section 9.

    Examples
    --------
    >>> from graphsynth import Driver, Mechanism, MechanismGraph, Revolute, simulate
    >>> from graphsynth.jamming import Bearing
    >>> graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    >>> joints = Revolute(0, 1), Revolute(1, 2, (1, 0)), Revolute(2, 3, (2.5, 0), (2.5, 0)), Revolute(0, 3, (2, 0))
    >>> motion = simulate(Mechanism(graph, joints, [Driver(0, 1)]), np.radians([0.0, 90.0, 180.0]))
    >>> report = assess_coupled(motion, Bearing(), Misalignment(0, 1, 0.012))
    >>> report.verdict.name, [round(float(f), 4) for f in report.factor]
    ('FREE_ESTIMATED', [0.9694, 0.9894, 0.7915])
    """
    begin = perf_counter()
    check_motion(motion)
    given = problem(motion.mechanism, bearings, tilts, condition)
    report = replace(_report(given, motion, begin), condition=condition)
    if not certify or not motion.assembled.any():
        return report
    return _with_proof(report, motion, bearings, condition, length_tolerance, seconds)


def _with_proof(
    report: CoupledReport, motion: Motion, bearings: Bearings, condition: Condition, tolerance: float, seconds: float
) -> CoupledReport:
    """Replace the verdict at the samples by what is proved between them."""
    from graphsynth.jamming.joints.turn import certify_coupled

    begin = perf_counter()
    if int(motion.assembled.sum()) == 1:
        reason = "a proof needs a range of inputs; the motion has one assembled sample"
        return replace(report, verdict=Verdict.UNDECIDED, reason=reason, notes=(*report.notes, report.reason))
    proof = certify_coupled(
        motion, bearings, report.misalignments, condition=condition, length_tolerance=tolerance, seconds=seconds
    )
    # where nothing is proved, what the samples say is still worth reading
    notes = (*report.notes, f"at the samples: {report.reason}") if proof.verdict is Verdict.UNDECIDED else report.notes
    return replace(
        report, verdict=proof.verdict, reason=proof.reason, certificate=proof, notes=notes,
        seconds=report.seconds + perf_counter() - begin,
    )  # fmt: skip


def _spread(values: Array, keep: NDArray[np.intp], count: int) -> Array:
    full = np.full((count, *values.shape[1:]), np.nan)
    full[keep] = values
    return full


def _report(given: Problem, motion: Motion, begin: float) -> CoupledReport:
    keep = np.flatnonzero(motion.assembled)
    tilt, scale = given.solve(motion.poses[keep]), given.solve(motion.poses[keep], "scale")
    layout, count = given.layout, len(motion.inputs)
    with np.errstate(all="ignore"):
        gap = np.where(tilt.upper > tilt.lower, (tilt.upper - tilt.lower) / tilt.upper, 0.0)
        allowed = np.where(scale.lower > 0.0, 1.0 / scale.lower, math.inf)
        lean = np.hypot(tilt.tau[..., 0], tilt.tau[..., 1])
        used = np.where(layout.limit > 0.0, lean / (tilt.lower[:, None] * layout.limit), 0.0)
        slip = np.where(np.isfinite(layout.play) & (layout.play > 0.0), np.abs(tilt.zeta) / layout.play, 0.0)
    used = np.where(tilt.lower[:, None] > 0.0, used, 0.0)
    verdict, reason = _verdict(scale.lower, motion, keep)
    worst = int(np.argmax(tilt.lower)) if keep.size else -1
    tight = int(np.argmin(allowed)) if keep.size else -1
    inputs = motion.inputs[keep]
    return CoupledReport(
        verdict=verdict,
        reason=reason,
        inputs=motion.inputs,
        factor=_spread(tilt.lower, keep, count),
        gap=_spread(gap, keep, count),
        allowed_scale=_spread(allowed, keep, count),
        consumption=_spread(used, keep, count),
        play_used=_spread(slip, keep, count),
        price=_spread(tilt.moment, keep, count),
        play_price=_spread(tilt.force, keep, count),
        names=given.names,
        joints=given.pairs,
        worst_input=float(inputs[worst]) if keep.size else math.nan,
        worst_factor=float(tilt.lower[worst]) if keep.size else math.nan,
        smallest_scale=float(allowed[tight]) if keep.size else math.nan,
        smallest_scale_input=float(inputs[tight]) if keep.size else math.nan,
        loosen=_loosen(given, scale, tight) if keep.size else (),
        limits=given.limits,
        misalignments=given.misalignments,
        notes=_notes(given, motion, keep),
        seconds=perf_counter() - begin,
    )


def _verdict(value: Array, motion: Motion, keep: NDArray[np.intp]) -> tuple[Verdict, str]:
    if keep.size == 0:
        return Verdict.CANNOT_ASSEMBLE, f"no sample is assembled: {motion.reason}"
    jammed = value > 1.0 + _TOUCH
    if jammed.any():
        return Verdict.JAMMED_ESTIMATED, f"jams at {int(jammed.sum())} of {keep.size} samples (estimated)"
    if (value >= 1.0 - _TOUCH).any():
        return Verdict.TOUCHING_ESTIMATED, "no clearance is left at one sample or more (estimated)"
    if not motion.completed:
        return Verdict.FREE_ESTIMATED, f"free at {keep.size} samples; the motion ends: {motion.reason}"
    return Verdict.FREE_ESTIMATED, f"free at all {keep.size} samples (estimated)"


def _loosen(given: Problem, scale: PoseSolution, at: int) -> tuple[Loosen, ...]:
    rows = [Loosen(pair, what, float(scale.moment[at, k])) for k, (pair, what) in enumerate(given.names)]
    rows += [Loosen(pair, "play", float(scale.force[at, k])) for k, pair in enumerate(given.pairs)]
    return tuple(sorted((row for row in rows if row.gain > 1e-9), key=lambda row: -row.gain))


def _notes(given: Problem, motion: Motion, keep: NDArray[np.intp]) -> tuple[str, ...]:
    notes = []
    if given.layout.loops == 0:
        notes.append("no closed loop of guided joints: nothing can jam")
    if keep.size < len(motion.inputs):
        notes.append(f"{len(motion.inputs) - keep.size} samples are not assembled: {motion.reason}")
    return tuple(notes)
