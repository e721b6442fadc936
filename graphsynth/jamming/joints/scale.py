"""How much more misalignment a motion takes: the largest, its worst direction, and which limit to loosen first.

The factor of the small-tilt model (first order) grows in proportion to the misalignments: it is a seminorm of them (a
maximum of linear functions), so turning all of them by phi gives a seminorm of ``(cos phi, sin phi)``.  Between two
directions that are delta apart it is at most the larger of their values over ``cos(delta / 2)``: a grid bounds every
direction.

The allowed scale of one pose is a concave function of all limits and axial clearances together (more of each never
hurts), and so is the smallest over a range.  The shadow price of a limit therefore promises at most what loosening it
gains; a second joint, or another input, may bind next.  That is why the answer is solved for and not extrapolated.
See theory/joints-that-share-a-tilt 3, 4.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import finite
from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Interval
from graphsynth.jamming.assembly.positions import Unsupported
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.joints.branch import of_the_motion
from graphsynth.jamming.joints.drawing import Tolerances, drawn
from graphsynth.jamming.joints.limits import Misalignment
from graphsynth.jamming.joints.pieces import PARTS, Found, Work, check_range, cut
from graphsynth.jamming.joints.program import Bearings, check_motion, problem
from graphsynth.jamming.joints.search import Budget

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]
SMALL_TILTS = "L1 with small tilts (first order): neglects terms of relative order alpha squared"


@dataclass(frozen=True, eq=False)
class ScaleCertificate:
    """Largest factor on all misalignments that leaves the whole range free with small tilts, between two proved bounds.

    ``low``: with a smaller factor every input is proved free, for all members of the tolerance boxes.  ``high``: with a
    larger one the input ``at`` is proved to jam, again for all of them; tolerances keep the two apart.
    ``relative_gap`` is ``high / low - 1``; ``reason`` says why it is not smaller, or is empty.  Free and jammed are
    those of the small-tilt model, whose error, of relative order alpha squared, is not in the bounds; `certify_coupled`
    assesses a given misalignment with exact tilts.
    """

    low: float
    high: float
    at: float
    evaluated: int
    reason: str
    seconds: float
    model: str = (
        "L1 with small tilts (first order): the terms of second order that it neglects, of relative order alpha "
        "squared, are not in the bounds"
    )

    @property
    def relative_gap(self) -> float:
        """``high / low - 1``."""
        return self.high / self.low - 1.0 if self.low > 0.0 else math.inf


def largest_scale(
    motion: Motion,
    bearings: Bearings,
    tilts: Misalignment | Iterable[Misalignment],
    *,
    condition: Condition = "A",
    tolerances: Tolerances = 0.0,
    relative_gap: float = 1e-4,
    max_pieces: int = 20_000,
    seconds: float = 20.0,
) -> ScaleCertificate:
    """Enclose the largest factor by which all misalignments may grow over the range, with proof on both sides.

    Parameters
    ----------
    motion, bearings, tilts, condition, tolerances
        As for `certify_coupled`.
    relative_gap : float
        Wanted ``high / low - 1``.
    max_pieces, seconds : optional
        Limits of the work.

    Returns
    -------
    ScaleCertificate
        Certified for the small-tilt model (branch and bound over the input).  With one misalignment its largest alpha
        lies between ``low * alpha`` and ``high * alpha``.
    """
    begin = perf_counter()
    check_range(motion, relative_gap=relative_gap, max_pieces=max_pieces, seconds=seconds)
    limits, axes, box = drawn(motion.mechanism, bearings, tilts, tolerances)
    given = problem(motion.mechanism, limits, axes, condition)
    try:
        work = Work(given, motion, box, exact=False)
        budget = Budget(1e-9 * (work.high - work.low), max_pieces, seconds, begin)
        found = _enclosed(work, budget, *_branch_and_bound(work, budget, relative_gap))
        if found.reason or found.relative_gap <= relative_gap or found.high == math.inf == found.low:
            return found
        return replace(found, reason="the tolerances leave no smaller gap: high holds for all members, low for any")
    except Unsupported as error:
        return ScaleCertificate(0.0, math.inf, math.nan, 0, str(error), perf_counter() - begin)


def _branch_and_bound(work: Work, budget: Budget, relative_gap: float) -> tuple[Found, float, str]:
    """Cut what may hold a larger factor than the best found; return the pieces, a bound of them, and what stopped.

    With tolerances the bound from above at a single input is not reached by the one from below, which holds for all
    members; pieces are cut against the larger of the two.
    """
    best, reach, above, reason = 0.0, 0.0, 0.0, ""
    parts: list[Found] = []
    lo, hi = work.first()
    while lo.size:
        found = work.evaluate(lo, hi)
        peaks, highest = _peaks(work, found)
        found = found._replace(lower=peaks)
        best, reach = max(best, float(peaks.max())), max(reach, highest)
        rest = found.upper > max(best, reach) * (1.0 + 0.9 * relative_gap)
        above = max(above, float(found.upper[~rest].max(initial=0.0)))
        narrow = hi - lo <= budget.smallest
        if work.evaluated + PARTS * int(rest.sum()) > budget.max_pieces or budget.over or (rest & narrow).any():
            above = max(above, float(found.upper[rest].max(initial=0.0)))
            reason = f"the limit of work was reached after {work.evaluated} pieces" if rest.any() else ""
            parts.append(found)
            break
        parts.append(found.take(~rest))
        lo, hi = cut(lo[rest], hi[rest])
    return Found.join(parts), above, reason


def _enclosed(work: Work, budget: Budget, pieces: Found, above: float, reason: str) -> ScaleCertificate:
    """Turn bounds of the factor into bounds of its inverse; only pieces proved to be on the branch count."""
    own, whole = of_the_motion(work, pieces)
    peak = np.where(own, pieces.lower, 0.0)
    top = int(np.argmax(peak))
    best, at = float(peak[top]), math.nan
    if not whole:
        above = math.inf
        reason = reason or "the pieces are not proved to be one branch"
    low, high = math.inf if above == 0.0 else 0.0, math.inf
    if 0.0 < above < math.inf:
        low = float((1 / Interval.from_bounds(above, above)).lo)
    if best > 0.0:
        high = float((1 / Interval.from_bounds(best, best)).hi)
        at = float(Interval.from_bounds(pieces.lo[top], pieces.hi[top]).mid)
    if not work.motion.completed:
        reason = reason or f"the motion ends: {work.motion.reason}"
    return ScaleCertificate(low, high, at, work.evaluated, reason, perf_counter() - budget.begin)


def _peaks(work: Work, found: Found) -> tuple[Array, float]:
    """Lower bounds of the largest factor in each piece: over the whole of it, or at its middle for the worst few.

    And the largest bound from above at these middles.  A middle counts only if its assembly is the one of the piece: it
    lies in the box that holds exactly one.
    """
    peak = found.lower.copy()
    top = np.argsort(-found.upper)[:4]
    middle = Interval.from_bounds(found.lo[top], found.hi[top]).mid
    points = work.evaluate(middle, middle)
    inside = (points.box_lo >= found.box_lo[top]) & (points.box_hi <= found.box_hi[top])
    same = points.proved & found.proved[top] & inside.all(axis=1)
    peak[top] = np.maximum(peak[top], np.where(same, points.lower, 0.0))
    return peak, float(points.upper[same & np.isfinite(points.upper)].max(initial=0.0))


_MOST = 100_000


@dataclass(frozen=True, eq=False)
class DirectionMap:
    """Allowed scale over the direction and the input.

    ``directions`` (m,): angles by which all misalignments were turned, radians, in [0, pi), as turning by pi changes
    nothing; ``inputs`` (n,).  ``allowed_scale`` (m, n): factor by which the misalignments may grow (estimated), NaN
    where not assembled; ``smallest_scale`` at ``worst_direction`` and ``worst_input`` is its smallest entry.  No
    direction between those of the grid has a smaller scale than ``bound`` at the inputs given (exact consequence of the
    grid values).
    """

    directions: Array
    inputs: Array
    allowed_scale: Array
    worst_direction: float
    worst_input: float
    smallest_scale: float
    bound: float
    model: str = SMALL_TILTS


def direction_map(
    motion: Motion,
    bearings: Bearings,
    tilts: Misalignment | Iterable[Misalignment],
    *,
    condition: Condition = "A",
    directions: int = 12,
) -> DirectionMap:
    """Turn all misalignments together through half a turn and find the worst direction.

    See theory/joints-that-share-a-tilt 6: the direction of the tilt matters.

    Parameters
    ----------
    motion, bearings, tilts, condition
        As for `graphsynth.jamming.joints.assess_coupled`.
    directions : int
        Number of directions over half a turn, at least 3.

    Returns
    -------
    DirectionMap
        Estimated at the grid.

    Raises
    ------
    GeometryError
        Fewer than 3 directions; a motion without an assembled sample.
    """
    if not isinstance(directions, int | np.integer) or not 3 <= directions <= _MOST:
        few = "many" if isinstance(directions, int | np.integer) and directions > _MOST else "few"
        raise GeometryError(f"directions = {directions} are too {few} for a map; give a whole number, 3 to {_MOST}")
    check_motion(motion)
    given = problem(motion.mechanism, bearings, tilts, condition)
    keep = np.flatnonzero(motion.assembled)
    if keep.size == 0:
        raise GeometryError(f"no sample is assembled: {motion.reason}; choose other inputs")
    angles, inputs = math.pi * np.arange(directions) / directions, motion.inputs
    scale = np.full((directions, len(inputs)), np.nan)
    for k, angle in enumerate(angles.tolist()):
        scale[k, keep] = _inverse(given.solve(motion.poses[keep], "scale", angle).lower)
    at = np.unravel_index(int(np.nanargmin(scale)), scale.shape)
    least = float(scale[at])
    bound = least * math.cos(0.5 * math.pi / directions)
    return DirectionMap(angles, inputs, scale, float(angles[at[0]]), float(inputs[at[1]]), least, bound)


#: Relative gains below this are rounding.
_NOTHING = 1e-9


class LimitSensitivity(NamedTuple):
    """One limit loosened by itself.

    ``scale`` is the smallest allowed scale over the range then, and ``binds_at`` the input where it is reached;
    ``gain`` its relative growth per relative growth of the limit (0.4: ten percent more limit, four percent more
    misalignment); ``promised`` the same from the shadow price at the worst input, never less; ``without`` the smallest
    scale if the joint had no such limit at all: no more can be had from this joint alone (of a shift it is NaN).
    """

    joint: tuple[int, int]
    what: str
    scale: float
    gain: float
    promised: float
    binds_at: float
    without: float


@dataclass(frozen=True, eq=False)
class SensitivityTable:
    """Result of `compare_sensitivities`: rows from the most useful limit to the least.

    ``by`` is the relative growth of each limit; ``scale`` the smallest allowed scale as the mechanism is, and
    ``worst_input`` where it is reached.
    """

    by: float
    scale: float
    worst_input: float
    rows: tuple[LimitSensitivity, ...]
    model: str = SMALL_TILTS

    def __str__(self) -> str:
        """Return a table in plain text; limits that gain nothing are counted."""
        name = self.model.partition(":")[0].partition(" (")[0]
        lines = [f"smallest allowed scale {self.scale:.6g} at the input {self.worst_input:.6g}, {name}"]
        for (a, b), what, scale, gain, _, binds_at, without in self.rows:
            if gain > 0.0:
                lines.append(
                    f"  joint {a}-{b} {what:5s} {self.by:+.0%}: scale {scale:.6g}, gain {gain:.3f}, binds at "
                    f"{binds_at:.6g}{'' if math.isnan(without) else f'; without limit {without:.6g}'}"
                )
        if rest := sum(row.gain <= 0.0 for row in self.rows):
            lines.append(f"  {rest} other limits gain nothing alone")
        return "\n".join(lines)

    def to_pandas(self) -> Any:
        """Return the rows as a table."""
        import pandas as pd

        frame = pd.DataFrame(self.rows, columns=LimitSensitivity._fields)
        frame["joint"] = [f"{a}-{b}" for a, b in frame["joint"]]
        return frame


def compare_sensitivities(
    motion: Motion,
    bearings: Bearings,
    tilts: Misalignment | Iterable[Misalignment],
    *,
    condition: Condition = "A",
    by: float = 0.1,
) -> SensitivityTable:
    """Loosen every limit by itself and tell how much more misalignment the whole motion then takes.

    See theory/joints-that-share-a-tilt 3, 4.

    Parameters
    ----------
    motion, bearings, tilts, condition
        As for `graphsynth.jamming.joints.assess_coupled`.
    by : float
        Relative growth of a limit: 0.1 is ten percent.

    Returns
    -------
    SensitivityTable
        Estimated, at the samples of the motion; limits that are zero (rigid) or infinite have no row.

    Raises
    ------
    GeometryError
        ``by`` not positive; a motion without an assembled sample.

    Examples
    --------
    >>> from graphsynth import Mechanism
    >>> from graphsynth.jamming import Bearing
    >>> motion = Mechanism.four_bar(2, 1, 2.5, 2.5).simulate(np.radians([90.0]))
    >>> table = compare_sensitivities(motion, Bearing(), Misalignment(0, 1, 0.01))
    >>> [(row.joint, row.what, round(row.promised, 6)) for row in table.rows]
    [((0, 3), 'tilt', 0.5), ((1, 2), 'tilt', 0.5), ((2, 3), 'tilt', 0.0)]
    """
    check_motion(motion)
    if not finite("by", by) > 0.0:
        raise GeometryError(f"by = {by} must be a positive relative growth of a limit; 0.1 is ten percent")
    given = problem(motion.mechanism, bearings, tilts, condition)
    keep = np.flatnonzero(motion.assembled)
    if keep.size == 0:
        raise GeometryError(f"no sample is assembled: {motion.reason}; choose other inputs")
    poses, inputs = motion.poses[keep], motion.inputs[keep]
    found = given.solve(poses, "scale")
    allowed = _inverse(found.lower)
    worst = int(np.argmin(allowed))
    scale, at = float(allowed[worst]), float(inputs[worst])
    # no pose gains more than the factor itself: only those near the smallest can be the smallest then
    near = np.flatnonzero(allowed <= scale * (1.0 + by))

    def loosened(field: str, place: int, factor: float, poses: Array) -> Array:
        """Return the allowed scales with one limit so many times as large."""
        values = getattr(given.layout, field).copy()
        values[place] *= factor
        other = replace(given, layout=replace(given.layout, **{field: values}))
        return _inverse(other.solve(poses, "scale").lower)

    limits = [(name, "limit", k, found.moment[worst, k]) for k, name in enumerate(given.names)]
    limits += [((pair, "play"), "end_float", k, found.force[worst, k]) for k, pair in enumerate(given.pairs)]
    rows = []
    for name, field, k, share in limits:
        if not 0.0 < getattr(given.layout, field)[k] < math.inf:
            continue
        promised = float(share) if math.isfinite(share) else 0.0
        row = LimitSensitivity(*name, scale, 0.0, promised, at, scale)
        if promised > _NOTHING and scale != 0.0:  # else concave and without slope: it will not grow later either
            now = loosened(field, k, 1.0 + by, poses[near])
            least = int(np.argmin(now))
            gain = (float(now[least]) / scale - 1.0) / by
            without = float(loosened(field, k, math.inf, poses).min())
            own = float(now[least]), gain if gain > _NOTHING else 0.0, promised, float(inputs[near[least]]), without
            row = LimitSensitivity(*name, *own)
        rows.append(row)
    rows.sort(key=lambda row: (-round(row.gain, 9), -row.promised, row.joint, row.what))
    return SensitivityTable(by, scale, at, tuple(rows))


def _inverse(factor: Array) -> Array:
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / factor)
