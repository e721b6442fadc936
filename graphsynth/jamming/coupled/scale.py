"""The largest misalignment over the range of a motion, between two proved bounds: branch and bound over the input."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from graphsynth.intervals import Interval
from graphsynth.jamming.bearing import Condition
from graphsynth.jamming.coupled.limits import Misalignment
from graphsynth.jamming.coupled.pieces import PARTS, Work, check_range, cut
from graphsynth.jamming.coupled.positions import Unsupported
from graphsynth.jamming.coupled.problem import Bearings, problem

if TYPE_CHECKING:
    from graphsynth.kinematics.simulation import Motion

__all__ = ["ScaleCertificate", "largest_scale"]


@dataclass(frozen=True, eq=False)
class ScaleCertificate:
    """Largest factor on all misalignments that leaves the whole range free, between two proved bounds.

    ``low``: with a smaller factor every input is proved free.  ``high``: with a larger one the input ``at`` is proved
    to jam.  ``relative_gap`` is ``high / low - 1``; ``reason`` says why it is not smaller, or is empty.
    """

    low: float
    high: float
    at: float
    evaluated: int
    reason: str
    seconds: float

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
    length_tolerance: float = 0.0,
    relative_gap: float = 1e-3,
    max_pieces: int = 20_000,
    seconds: float = 20.0,
) -> ScaleCertificate:
    """Enclose the largest factor by which all misalignments may grow over the range, with proof on both sides.

    Parameters
    ----------
    motion, bearings, tilts, condition, length_tolerance
        As for `certify_coupled`.
    relative_gap : float
        Wanted ``high / low - 1``.
    max_pieces, seconds : optional
        Limits of the work.

    Returns
    -------
    ScaleCertificate
        Certified (branch and bound over the input).  With one misalignment the largest allowed alpha lies between
        ``low * alpha`` and ``high * alpha``.

    Raises
    ------
    GeometryError
        As `certify_coupled`; and for a motion or mechanism whose positions cannot be proved at all.
    """
    begin = perf_counter()
    check_range(motion, length_tolerance)
    given = problem(motion.mechanism, bearings, tilts, condition)
    reason = ""
    best, at, above = 0.0, math.nan, 0.0
    try:
        work = Work(given, motion, length_tolerance)
        lo, hi = work.first()
        while lo.size:
            found = work.evaluate(lo, hi)
            top = np.argsort(-found.upper)[:4]
            middle = Interval.from_bounds(lo, hi).mid[top]
            points = work.evaluate(*(np.unique(middle),) * 2)
            for part in (found, points):
                k = int(np.argmax(part.lower))
                if part.lower[k] > best:
                    best, at = float(part.lower[k]), float(part.lo[k])
            rest = found.upper > best * (1.0 + 0.9 * relative_gap)
            above = max(above, float(found.upper[~rest].max(initial=0.0)))
            narrow = hi - lo <= 1e-9 * (work.high - work.low)
            if (
                work.evaluated + PARTS * int(rest.sum()) > max_pieces
                or perf_counter() - begin > seconds
                or (rest & narrow).any()
            ):
                above = max(above, float(found.upper[rest].max(initial=0.0)))
                reason = f"the limit of work was reached after {work.evaluated} pieces" if rest.any() else ""
                break
            lo, hi = cut(lo[rest], hi[rest])
    except Unsupported as error:
        return ScaleCertificate(0.0, math.inf, math.nan, 0, str(error), perf_counter() - begin)
    one = Interval(1)
    low = float((one / Interval.from_bounds(above, above)).lo) if 0.0 < above < math.inf else 0.0
    high = float((one / Interval.from_bounds(best, best)).hi) if best > 0.0 else math.inf
    low = math.inf if above == 0.0 else low
    if not motion.completed:
        reason = reason or f"the motion ends: {motion.reason}"
    return ScaleCertificate(low, high, at, work.evaluated, reason, perf_counter() - begin)
