"""Reports on a motion with every loop closed in space: tables at the samples, verdict by proof between them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.joints.assess import CoupledReport, Sensitivity, assess_coupled
from graphsynth.jamming.joints.drawing import Tolerances, drawn
from graphsynth.jamming.joints.limits import Misalignment
from graphsynth.jamming.joints.program import Bearings, JointProblem, problem
from graphsynth.jamming.space.along import NOTHING, Along, Least
from graphsynth.jamming.space.closure import Closure
from graphsynth.jamming.space.model import MODEL, Bound, Unsupported
from graphsynth.jamming.space.optimum import least_scale
from graphsynth.jamming.space.plane import in_space, start
from graphsynth.jamming.space.sensitivity import prices
from graphsynth.jamming.space.turn import certify_in_space
from graphsynth.jamming.verdict import Verdict

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]
#: Factors so near to 1 are a matter of rounding.
_TOUCH = 1e-9


def assess_in_space(
    motion: Motion,
    bearings: Bearings | None,
    tilts: Misalignment | Iterable[Misalignment],
    *,
    condition: Condition = "A",
    certify: bool = True,
    tolerances: Tolerances = 0.0,
    seconds: float = 20.0,
) -> CoupledReport:
    """Assess a motion with every loop closed in space.

    The tables are those of small tilts, filled anew: ``factor`` is the least one on all limits and plays together,
    ``duality_gap`` what the shadow prices miss of their sum, 1; ``allowed_scale`` is solved for where it is smallest,
    and follows from its slope elsewhere.  All are estimated, and of the nominal mechanism; the verdict is proved if
    ``certify``, for all members of the tolerance boxes.
    """
    begin = perf_counter()
    tilts = tuple(tilts) if isinstance(tilts, Iterable) else (tilts,)
    tolerances = tuple(tolerances) if isinstance(tolerances, Iterable) else tolerances
    limits, axes, _ = drawn(motion.mechanism, bearings, tilts, tolerances)
    report = assess_coupled(motion, limits, axes, condition=condition)
    if report.verdict is Verdict.CANNOT_ASSEMBLE:
        return report
    try:
        along = Along(problem(motion.mechanism, limits, axes, condition), motion)
    except Unsupported as error:
        return replace(report, verdict=Verdict.UNDECIDED, reason=str(error), seconds=perf_counter() - begin)
    report = _tabled(report, along)
    if not certify:
        return replace(report, seconds=perf_counter() - begin)
    if len(along.keep) < 2:
        return replace(report, verdict=Verdict.UNDECIDED, reason="a proof needs a range of inputs, two samples or more")
    options: Any = {"condition": condition, "tolerances": tolerances, "seconds": seconds}
    proof = certify_in_space(motion, bearings, tilts, **options)
    return replace(
        report, verdict=proof.verdict, reason=proof.reason, certificate=proof, seconds=perf_counter() - begin
    )


def _tabled(report: CoupledReport, along: Along) -> CoupledReport:
    """Fill the tables of a report with what exact closure gives."""
    motion, keep, given = along.motion, along.keep, along.given
    allowed, found = along.allowed_at(motion.inputs[keep], motion.poses[keep])
    names = ("factor", "duality_gap", "allowed_scale", "consumption", "axial_clearance_used", "shadow_price")
    tables = {name: np.full_like(getattr(report, name), np.nan) for name in (*names, "axial_shadow_price")}
    tables["factor"][keep] = [one.scale for one in found]
    tables["allowed_scale"][keep] = allowed
    for row, least in zip(keep.tolist(), found):
        _used(tables, row, given, along, least)
    factor = tables["factor"]
    worst = int(np.argmax(np.where(np.isnan(factor), -1.0, factor)))
    tight = int(np.argmin(np.where(np.isnan(tables["allowed_scale"]), math.inf, tables["allowed_scale"])))
    model, least, rows = along.model(NOTHING), found[int(np.searchsorted(keep, tight))], []
    if 0.0 < least.scale < math.inf:
        for own, price in zip(model.bounds, prices(model, least.optimum).tolist()):
            rows.append(Sensitivity(given.mechanism.joints[own.joint].pair, own.kind, price / least.slope))
    verdict, reason = _verdict(factor[keep], motion)
    lost = int(np.isnan(factor[keep]).sum())
    notes = tuple(note for note in report.notes if "small tilts" not in note)
    return replace(
        report,
        **tables,
        verdict=verdict,
        reason=reason,
        worst_input=float(report.inputs[worst]),
        worst_factor=float(factor[worst]),
        smallest_scale=float(tables["allowed_scale"][tight]),
        smallest_scale_input=float(report.inputs[tight]),
        sensitivities=tuple(sorted((one for one in rows if one.gain > 1e-9), key=lambda one: -one.gain)),
        notes=(*notes, f"no closure in space was found at {lost} samples") if lost else notes,
        small_tilts=MODEL,
        small_tilt_error=math.nan,
    )


def _used(tables: dict[str, Array], row: int, given: JointProblem, along: Along, least: Least) -> None:
    """Fill one row: use and price of every limit."""
    tables["consumption"][row] = tables["shadow_price"][row] = 0.0
    tables["axial_clearance_used"][row] = tables["axial_shadow_price"][row] = 0.0
    if not 0.0 < least.scale < math.inf:
        tables["duality_gap"][row] = 0.0
        return
    model, found = along.model(NOTHING), least.optimum
    share = prices(model, found)
    tables["duality_gap"][row] = abs(1.0 - float(share.sum()))
    for bound, price in zip(model.bounds, share.tolist()):
        pair = given.mechanism.joints[bound.joint].pair
        size = _size(bound, found.q)
        if bound.kind == "play":
            column = given.pairs.index(pair)
            tables["axial_clearance_used"][row, column] = size / bound.limit
            tables["axial_shadow_price"][row, column] = price
        elif bound.kind != "shift":
            column = given.names.index((pair, bound.kind))
            tables["consumption"][row, column] = size / (found.scale * bound.limit)
            tables["shadow_price"][row, column] = price


def _size(bound: Bound, q: Array) -> float:
    """Tilt (radians) or slide of a joint."""
    size = float(np.linalg.norm(q[list(bound.columns)]))
    return 2.0 * math.atan(0.5 * size) if bound.angular else size


def _verdict(factor: Array, motion: Motion) -> tuple[Verdict, str]:
    """Verdict of the samples alone (estimated)."""
    count, where = len(factor), "with exact closure in space (estimated)"
    if np.isnan(factor).any():
        return Verdict.UNDECIDED, f"no closure in space was found at {int(np.isnan(factor).sum())} of {count} samples"
    if (factor > 1.0 + _TOUCH).any():
        return Verdict.JAMMED_ESTIMATED, f"binds at {int((factor > 1.0 + _TOUCH).sum())} of {count} samples {where}"
    if (factor >= 1.0 - _TOUCH).any():
        return Verdict.TOUCHING_ESTIMATED, f"no clearance is left at one sample or more {where}"
    ends = "" if motion.completed else f"; the motion ends: {motion.reason}"
    return Verdict.FREE_ESTIMATED, f"free at all {count} samples {where}{ends}"


def small_tilt_error(motion: Motion, report: CoupledReport, condition: Condition = "A") -> float:
    """Relative error of the factor of small tilts at its worst input, by exact closure there (estimated).

    NaN where the exact model does not describe the mechanism, or nothing limits it.
    """
    if not 0.0 < report.smallest_scale < math.inf:
        return math.nan
    k = int(np.nanargmin(report.allowed_scale))
    pairs = (joint.pair for joint in motion.mechanism.joints)
    rigid = {tilt.pair for tilt in report.misalignments if tilt.rigid}
    limits = {pair: own for pair, own in zip(pairs, report.limits) if pair not in rigid}
    try:
        model = in_space(problem(motion.mechanism, limits, report.misalignments, condition))
        q = start(model, motion.mechanism, motion.poses[k])
        found = least_scale(Closure(model, False), q)
    except Unsupported:
        return math.nan
    closed = found.missed < 1e-9 and math.isfinite(found.scale)
    return abs(found.scale * report.smallest_scale - 1.0) if closed else math.nan
