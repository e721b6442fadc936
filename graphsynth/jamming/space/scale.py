"""How far misalignments may grow, and how small limits may be, with every loop closed in space: proved on both sides.

The worst input is found in floats: the small-tilt model over a fine grid, the exact least factor round its peaks.
There a jam is proved for a factor a little beyond; freedom over the whole range for one a little before.

Larger limits never hurt, so that a proof for one factor on the limits holds for all larger or all smaller ones.  The
exact closure is not linear in the misalignments: there a proof is about the factor itself.
See theory/closure-in-space 7.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.joints.drawing import Tolerances, drawn
from graphsynth.jamming.joints.limits import Misalignment, bounds
from graphsynth.jamming.joints.pieces import check_range
from graphsynth.jamming.joints.program import Bearings, JointProblem, problem
from graphsynth.jamming.joints.scale import ScaleCertificate
from graphsynth.jamming.joints.search import limits_chosen, sharp_problem
from graphsynth.jamming.space.along import NOTHING, Along, Change, changed
from graphsynth.jamming.space.members import Members, at_end, extreme_member
from graphsynth.jamming.space.model import MODEL, Unsupported
from graphsynth.jamming.space.plane import leaning
from graphsynth.jamming.space.turn import Stint, certify_members
from graphsynth.jamming.verdict import Verdict

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion
    from graphsynth.tolerances.box import ParameterBox

Array = NDArray[np.float64]
#: Inputs of the grid of the small-tilt model; peaks of it that are looked at; how much lower these may be.
_GRID, _PEAKS, _LOWER = 721, 4, 0.97
#: Steps of the search round a peak, and how near it comes (parts of the distance of the grid).
_ROUND, _FINE = 7, 1e-2
#: Parts of the gap that either side keeps from the estimate; growth of that after a proof that fails, and how often.
_SIDE, _WIDER, _TRIES = 0.45, 4.0, 5
SCALE = (
    f"{MODEL}; freedom is proved for the factor low itself, and a jam for the factor high: "
    "the closure is not linear in the misalignments, so that the factors between and below are not proved"
)


@dataclass(frozen=True, eq=False)
class FactorCertificate:
    """Least common factor on all limits of joints with which the whole range is free, between two proved bounds.

    ``high``: with this factor or a larger one every input is proved free.  ``low``: with this one or a smaller one the
    input ``at`` is proved to bind, within the reach that theory/closure-in-space 5 names.  ``reason`` says why the gap
    is not smaller, or is empty.
    """

    low: float
    high: float
    at: float
    reason: str
    seconds: float
    model: str = MODEL

    @property
    def relative_gap(self) -> float:
        """``high / low - 1``."""
        return self.high / self.low - 1.0 if self.low > 0.0 else math.inf


_Found = TypeVar("_Found", ScaleCertificate, FactorCertificate)


class _Worst(NamedTuple):
    """Input with the largest factor on all limits, its plane pose, and the estimate there."""

    u: float
    pose: Array
    value: float


def worst_input(along: Along, change: Change = NOTHING) -> _Worst:
    """Input of the motion with the largest least factor on all limits (estimated)."""
    ends = along.motion.inputs[along.keep]
    grid = np.linspace(float(ends.min()), float(ends.max()), _GRID)
    poses, assembled = along.poses(grid)
    small = np.full(_GRID, -math.inf)
    small[assembled] = changed(along.given, change).solve(poses[assembled], "scale").lower
    padded = np.concatenate([[-math.inf], small, [-math.inf]])
    peaks = np.flatnonzero((small >= padded[:-2]) & (small >= padded[2:]) & assembled)
    peaks = peaks[np.argsort(-small[peaks], kind="stable")][:_PEAKS]
    most = float(small[peaks[0]])
    if not 0.0 < most < math.inf:  # as good as any
        return _Worst(float(grid[peaks[0]]), poses[peaks[0]], most)
    peaks = peaks[small[peaks] >= _LOWER * most]
    return max((_round_a_peak(along, change, grid, poses, int(k)) for k in peaks), key=lambda one: one.value)


def _round_a_peak(along: Along, change: Change, grid: Array, poses: Array, k: int) -> _Worst:
    """Search for the largest exact factor between the neighbours of an input of the grid."""
    from scipy.optimize import minimize_scalar

    found = _Worst(float(grid[k]), poses[k], along.least(float(grid[k]), poses[k], change).scale)
    if not math.isfinite(found.value):
        return found._replace(value=math.inf if math.isnan(found.value) else found.value)

    def value(u: float) -> float:
        nonlocal found
        pose, assembled = along.poses(np.array([u]))
        scale = along.least(u, pose[0], change).scale if assembled[0] else math.nan
        if scale > found.value:
            found = _Worst(float(u), pose[0], scale)
        return 0.0 if math.isnan(scale) else -scale

    low, high = grid[max(k - 2, 0)], grid[min(k + 2, _GRID - 1)]
    options = {"maxiter": _ROUND, "xatol": _FINE * (grid[1] - grid[0])}
    minimize_scalar(value, bounds=(float(low), float(high)), method="bounded", options=options)
    return found


class _Asked(NamedTuple):
    """A question about all members of a box of dimensions along a motion.

    ``change``: what a factor on misalignments or limits changes; a jam comes with larger factors (``up`` = 1) or
    smaller ones (-1).  Estimates: the factors ``free`` and ``jam`` at which the members that bind first and last have
    no room left, the latter at the input ``worst``.
    """

    given: JointProblem
    motion: Motion
    box: ParameterBox
    change: Callable[[float], Change]
    up: float
    worst: _Worst
    jam: float
    free: float


class _Sides(NamedTuple):
    """What was proved of a factor: free with one, binding with the other, at an input."""

    free: float
    binds: float
    at: float
    reasons: tuple[str, ...]


def _proved(asked: _Asked, gap: float, end: float) -> _Sides:
    """Prove freedom and a jam round the estimates."""
    u, motion, box = asked.worst.u, asked.motion, asked.box
    binds, free, reasons = math.nan, math.nan, []
    side = _SIDE * gap
    for _ in range(_TRIES):
        factor = asked.jam * (1.0 + side) ** asked.up
        members = Members(at_end(changed(asked.given, asked.change(factor)), 1), motion, box)
        proof = members.prove(u, members.box.whole)
        if proof.state < 0:
            binds = factor
            break
        side *= _WIDER
    else:
        reasons.append(f"a jam at the input {u!r} is not proved: {proof.reason}")
    side, why = _SIDE * gap, ""
    for _ in range(_TRIES):
        factor = asked.free * (1.0 + side) ** -asked.up
        if perf_counter() >= end:
            why = why or "the time was up"
            break
        proved = certify_members(changed(asked.given, asked.change(factor)), motion, box, Stint(end))
        if proved.verdict is Verdict.CERTIFIED_FREE:
            free = factor
            break
        why, side = proved.reason, side * _WIDER
    if math.isnan(free):
        reasons.append(f"freedom is not proved: {why}")
    return _Sides(free, binds, u, tuple(reasons))


def _of_members(asked: _Asked, estimate: Callable[[Along], tuple[_Worst, float]]) -> _Asked:
    """Correct the estimates of the nominal mechanism by those of the members that bind first and last."""
    given = asked.given
    if not (asked.box.size or limits_chosen(given, given.limits) or any(map(leaning, given.misalignments))):
        return asked
    found = []
    for end, side in ((0, 1.0), (1, -1.0)):
        given = at_end(asked.given, end)
        members = Members(changed(given, asked.change(asked.free)), asked.motion, asked.box)
        p = extreme_member(members, asked.worst.u, side)
        mechanism, pairs = members.mechanism(p), zip(given.misalignments, members.axes(p))
        axes = tuple(t.sharp(bounds(t, "alpha")[1], own.direction) if leaning(t) else t for t, own in pairs)
        motion = replace(asked.motion, mechanism=mechanism)
        found.append(estimate(Along(sharp_problem(mechanism, given.limits, axes), motion)))
    (_, free), (worst, jam) = found
    return asked._replace(worst=worst, jam=jam, free=free)


def largest_scale(
    motion: Motion,
    bearings: Bearings | None,
    tilts: Misalignment | Iterable[Misalignment],
    *,
    condition: Condition = "A",
    tolerances: Tolerances = 0.0,
    relative_gap: float = 1e-3,
    seconds: float = 60.0,
) -> ScaleCertificate:
    """Enclose the factor on all misalignments at which a motion begins to bind, with exact closure in space.

    Parameters
    ----------
    motion, bearings, tilts, condition, tolerances
        As for `certify_in_space`; ranges of limits and narrow ranges of misalignments count.
    relative_gap : float
        Wanted ``high / low - 1``.
    seconds : float
        Time after which no further proof of freedom is begun or goes on.

    Returns
    -------
    ScaleCertificate
        Certified: with all misalignments ``low`` times as large every input is free, with ``high`` times the input
        ``at`` binds; for all members of the tolerances, which keep the two apart.  Unlike with small tilts nothing is
        proved for the factors between or below.  ``low`` is 0, or ``high`` infinite, where nothing is proved, and
        ``reason`` says why.

    Examples
    --------
    >>> from graphsynth import Mechanism
    >>> from graphsynth.jamming.joints import JointLimits
    >>> motion = Mechanism.four_bar(2, 1, 2.5, 2.5).simulate(np.linspace(1.57, 1.58, 2))
    >>> found = largest_scale(motion, JointLimits(0.1), Misalignment(0, 1, 0.1))
    >>> 1.99 < found.low < 2.01 and found.relative_gap < 1e-3
    True
    """
    begin = perf_counter()
    check_range(motion, relative_gap=relative_gap, seconds=seconds)
    limits, axes, box = drawn(motion.mechanism, bearings, tilts, tolerances)
    given = problem(motion.mechanism, limits, axes, condition)
    try:
        worst, estimate = _misaligned(Along(given, motion))
        asked = _Asked(given, motion, box, lambda factor: Change(phi=factor), 1.0, worst, estimate, estimate)
        asked = _of_members(asked, _misaligned) if 0.0 < estimate < math.inf else asked
    except Unsupported as error:
        return ScaleCertificate(0.0, math.inf, math.nan, 0, str(error), perf_counter() - begin, SCALE)
    if not (0.0 < asked.free < math.inf and 0.0 < asked.jam < math.inf):
        why = {0.0: "it binds with any misalignment", math.inf: "no misalignment up to 0.5 rad binds"}
        reason = f"{why.get(estimate, 'no closure was found')} (estimated)"
        return ScaleCertificate(0.0, math.inf, worst.u, 0, reason, perf_counter() - begin, SCALE)
    gap, end = max(relative_gap, 1e-9), begin + seconds
    found = _proved(asked, gap, end)
    low, high = 0.0 if math.isnan(found.free) else found.free, math.inf if math.isnan(found.binds) else found.binds
    return _told(ScaleCertificate(low, high, found.at, 0, "; ".join(found.reasons), 0.0, SCALE), relative_gap, begin)


def _misaligned(along: Along) -> tuple[_Worst, float]:
    """Worst input, and the factor on all misalignments that leaves no room there (estimated)."""
    worst = worst_input(along)
    estimate = along.allowed(worst.u, worst.pose, NOTHING, along.least(worst.u, worst.pose))
    if 0.0 < estimate < math.inf:  # another input may be the worst at the factor found
        worst = worst_input(along, Change(phi=estimate))
        least = along.least(worst.u, worst.pose, Change(phi=estimate))
        estimate *= along.allowed(worst.u, worst.pose, Change(phi=estimate), least)
    return worst, estimate


def _limited(along: Along) -> tuple[_Worst, float]:
    """Worst input, and the factor on all limits that just leaves room there (estimated)."""
    worst = worst_input(along)
    return worst, worst.value


def least_factor(
    motion: Motion,
    bearings: Bearings | None,
    tilts: Misalignment | Iterable[Misalignment],
    *,
    condition: Condition = "A",
    tolerances: Tolerances = 0.0,
    relative_gap: float = 1e-3,
    seconds: float = 60.0,
) -> FactorCertificate:
    """Enclose the least common factor on all limits of joints with which a motion is free, with exact closure in space.

    Parameters
    ----------
    motion, bearings, tilts, condition, tolerances, relative_gap, seconds
        As for `largest_scale`.

    Returns
    -------
    FactorCertificate
        Certified on both sides, and for all factors beyond them.

    Examples
    --------
    >>> from graphsynth import Mechanism
    >>> from graphsynth.jamming.joints import JointLimits
    >>> motion = Mechanism.four_bar(2, 1, 2.5, 2.5).simulate(np.linspace(1.57, 1.58, 2))
    >>> found = least_factor(motion, JointLimits(0.1), Misalignment(0, 1, 0.1))
    >>> 0.49 < found.low < found.high < 0.51
    True
    """
    begin = perf_counter()
    check_range(motion, relative_gap=relative_gap, seconds=seconds)
    limits, axes, box = drawn(motion.mechanism, bearings, tilts, tolerances)
    given = problem(motion.mechanism, limits, axes, condition)
    try:
        worst, estimate = _limited(Along(given, motion))
        asked = _Asked(given, motion, box, lambda factor: Change(limits=factor), -1.0, worst, estimate, estimate)
        asked = _of_members(asked, _limited) if 0.0 < estimate < math.inf else asked
    except Unsupported as error:
        return FactorCertificate(0.0, math.inf, math.nan, str(error), perf_counter() - begin)
    if not (0.0 < asked.free < math.inf and 0.0 < asked.jam < math.inf):
        why = {0.0: "nothing is misaligned: any limits will do", math.inf: "no limits are large enough"}
        return FactorCertificate(0.0, math.inf, worst.u, f"{why[worst.value]} (estimated)", perf_counter() - begin)
    gap, end = max(relative_gap, 1e-9), begin + seconds
    found = _proved(asked, gap, end)
    low, high = 0.0 if math.isnan(found.binds) else found.binds, math.inf if math.isnan(found.free) else found.free
    return _told(FactorCertificate(low, high, found.at, "; ".join(found.reasons), 0.0), relative_gap, begin)


def _told(found: _Found, gap: float, begin: float) -> _Found:
    """Add the time, and why the gap is wider than wanted."""
    wide = "" if found.reason or found.relative_gap <= gap else "nearer to the verge nothing was proved of all members"
    return replace(found, reason=found.reason or wide, seconds=perf_counter() - begin)
