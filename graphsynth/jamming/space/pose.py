"""One pose of a mechanism in space: free, jammed or undecided, with proof."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import check_rounding
from graphsynth.jamming.space.closure import Closure
from graphsynth.jamming.space.model import SpaceModel
from graphsynth.jamming.space.optimum import Optimum, least_scale
from graphsynth.jamming.space.proof import Box, Certificate, branch_box, certificate, closes, contract, lower_bounds

Array = NDArray[np.float64]
#: Half width of the box of a branch in unlimited turns (radians) and travels (units), from the largest.
REACHES = (0.1, 0.05, 0.02, 0.01)
_SIGMAS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)


@dataclass(frozen=True, eq=False)
class PoseProof:
    """What is proved about one pose.

    ``state``: +1 free, -1 jammed, 0 undecided.  ``scale``: least factor on all limits (estimated).  ``reach``: a jam is
    proved for all closures whose unlimited turns (radians) and travels lie within it of the reference.  ``boxes``: work.
    """

    state: int
    scale: float
    reach: float
    boxes: int
    reason: str
    optimum: Optimum


def prove_pose(model: SpaceModel, q: Array, *, boxes: int = 2000) -> PoseProof:
    """Prove whether a mechanism closes within its limits near a start q (width,), whose given coordinates stay."""
    check_rounding()
    floats, exact = Closure(model, False), Closure(model, True)
    found = least_scale(floats, q)
    if found.scale < 1.0 and found.missed < 1e-9:
        if closes(exact, found.q, np.zeros((model.size, model.width - model.size)), np.zeros(model.width - model.size)):
            return PoseProof(1, found.scale, np.inf, 0, "closes within all limits, proved", found)
        return PoseProof(0, found.scale, 0.0, 0, "closes in floating point, but the closure is not proved", found)
    given = np.zeros(model.width - model.size)
    starts = [(reach, *contract(exact, branch_box(model, q, reach, given))) for reach in REACHES]
    used = len(starts)
    tried = []
    for reach, box, empty in starts:  # first without cuts, from the largest box
        proofs = [certificate(exact, found, box, sigma) for sigma in _SIGMAS]
        bound = lower_bounds(exact, proofs, box)[:, 0]
        if empty[0] or bound.max() > 0.0:
            return PoseProof(-1, found.scale, reach, used, "does not close within the limits, proved", found)
        tried.append((bound.max(), reach, box, proofs[int(bound.argmax())]))
    for _, reach, box, proof in sorted(tried, key=lambda one: -one[0])[:1]:
        done, own = _cut(exact, proof, box, boxes - used)
        used += own
        if done:
            return PoseProof(-1, found.scale, reach, used, "does not close within the limits, proved", found)
    return PoseProof(0, found.scale, 0.0, used, "neither a closure nor its absence is proved", found)


def _cut(exact: Closure, proof: Certificate, first: Box, most: int) -> tuple[bool, int]:
    """Whether no member of a box closes within the limits, by cutting it; and the boxes looked at."""
    used, live = 1, first
    while len(live.low):
        if used + 2 * len(live.low) > most:
            return False, used
        live = _halved(live, first, exact.model.size)
        used += len(live.low)
        live, empty = contract(exact, live)
        live = Box(live.low[~empty], live.high[~empty])
        if len(live.low):
            left = ~(lower_bounds(exact, [proof], live)[0] > 0.0)
            live = Box(live.low[left], live.high[left])
    return True, used


def _halved(boxes: Box, first: Box, size: int) -> Box:
    """Cut every box across its widest unknown, measured by the first box."""
    width = (boxes.high - boxes.low)[:, :size] / np.maximum((first.high - first.low)[0, :size], 1e-300)
    rows, side = np.arange(len(width)), width.argmax(1)
    middle = 0.5 * (boxes.low + boxes.high)[rows, side]
    high, low = boxes.high.copy(), boxes.low.copy()
    high[rows, side] = low[rows, side] = middle
    return Box(np.concatenate([boxes.low, low]), np.concatenate([high, boxes.high]))


def summary(proof: PoseProof) -> dict[str, Any]:
    """Plain values."""
    return {name: getattr(proof, name) for name in ("state", "scale", "reach", "boxes", "reason")}
