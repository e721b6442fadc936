"""One pose of a mechanism in space: free, jammed or undecided, with proof."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import check_rounding
from graphsynth.jamming.space.binding import binds, body_box, multipliers
from graphsynth.jamming.space.bodies import Bodies, stands_apart
from graphsynth.jamming.space.closure import Closure, closures
from graphsynth.jamming.space.model import SHIFT_X, TURN, SpaceModel
from graphsynth.jamming.space.optimum import Optimum, least_scale, some_closures
from graphsynth.jamming.space.proof import (
    Box,
    Certificate,
    Tubes,
    branch_box,
    certificates,
    closings,
    contract,
    lower_bounds,
)

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
#: Half widths of the box of a branch in unlimited turns (radians) and travels (units); the last one is LEAST, or more.
REACHES = (0.1, 0.03)
LEAST = 0.005
CLOSES = "closes within all limits"


class Lead(NamedTuple):
    """The one closure that is proved for each of the given coordinates in a box, continuous in them.

    It is at the optimum of its proof, led by ``rate`` (size, given) from the middle of the box, corrected in the
    unknowns ``basic`` by less than ``reach``.
    """

    rate: Array
    basic: Ints
    reach: Array

    @classmethod
    def of(cls, found: Tubes, rate: Array, k: int) -> Lead | None:
        """Return that of one of several, where it is proved to be the only one."""
        return cls(rate[k], found.basic[k], found.reach[k]) if found.single[k] else None


@dataclass(frozen=True, eq=False)
class PoseProof:
    """What is proved about one pose.

    ``state``: +1 free, -1 jammed, 0 undecided.  ``scale``: least factor on all limits (estimated).  ``reach``: a jam is
    proved for all closures in which the spins of links (where `stands_apart`; else unlimited turns, radians) and
    unlimited travels (units) lie within it of the reference.  ``lead``: closures that are proved to be continuous.
    """

    state: int
    scale: float
    reach: float
    reason: str
    optimum: Optimum | None = None
    lead: Lead | None = None

    @classmethod
    def unknown(cls, reason: str) -> PoseProof:
        """Nothing is proved."""
        return cls(0, math.nan, 0.0, reason)


def prove_pose(
    model: SpaceModel, q: Array, *, given: Array | None = None, boxes: int = 300, reaches: tuple[float, ...] = REACHES
) -> PoseProof:
    """Prove whether a mechanism closes within its limits near a reference (certified).

    Parameters
    ----------
    model : SpaceModel
    q : ndarray, shape (width,)
        Reference: unknowns and given coordinates, as of a plane pose (`start`).
    given : ndarray, shape (drivers,), optional
        Half widths of a box of the given coordinates; what is proved holds for all of it.
    boxes : int
        Boxes into which the unknowns are cut at most; 0 for none, and then freedom is tried with any closure first,
        so that ``scale`` may be more than the least factor of what is free.
    reaches : tuple of float
        Half widths tried for the box of a branch.

    Returns
    -------
    PoseProof
        +1: a closure within all limits for each of the given coordinates.  -1: for none of them a closure within the
        limits within ``reach`` of the reference.
    """
    check_rounding()
    given = np.zeros(model.width - model.size) if given is None else given
    if not boxes:
        found = free_poses(model, q[None], given[None])[0]
        if found.state > 0:
            return found
    return settle_pose(model, q, given, boxes, reaches)


def free_poses(model: SpaceModel, q: Array, given: Array) -> list[PoseProof]:
    """Prove which of N poses are free, with references q (N, width) and half widths of given coordinates (certified).

    The closures are some with room in the limits, not those with the most.  What is not proved free is undecided, and
    its optimum is that of the closure linearised at the plane pose.
    """
    floats, enclosed = closures(model)
    found = some_closures(floats, q)
    good = np.flatnonzero(found.used < 1.0)
    rate = all_rates(floats, found.q[good])
    closed = closings(enclosed, found.q[good], rate, given[good])
    leads = {int(good[n]): Lead.of(closed, rate, n) for n in np.flatnonzero(closed.proved).tolist()}
    proofs, none = [], np.zeros(len(model.bounds))
    for k, own in enumerate(found.q):
        missed = 0.0 if found.used[k] < math.inf else math.inf
        optimum = Optimum(float(found.used[k]), own, found.by[k], none, missed, False)
        if k in leads:
            proofs.append(PoseProof(1, float(found.used[k]), math.inf, CLOSES, optimum, leads[k]))
        else:
            reason = (
                "a closure is found, but not proved"
                if found.used[k] < 1.0
                else "no closure within the limits was found"
            )
            proofs.append(PoseProof(0, float(found.used[k]), 0.0, reason, optimum))
    return proofs


def settle_pose(model: SpaceModel, q: Array, given: Array, boxes: int, reaches: tuple[float, ...]) -> PoseProof:
    """Prove what can be proved about one pose from its least factor (certified); arguments as of `prove_pose`."""
    floats, enclosed = closures(model)
    found = least_scale(floats, q)
    if found.scale < 1.0 and found.missed < 1e-9:
        rate = all_rates(floats, found.q[None])
        closed = closings(enclosed, found.q[None], rate, given[None])
        if closed.proved[0]:
            return PoseProof(1, found.scale, math.inf, CLOSES, found, Lead.of(closed, rate, 0))
        return PoseProof(0, found.scale, math.inf, "a closure is found, but not proved", found)
    if stands_apart(model):
        reach = _bound_apart(model, q, found, given, reaches, boxes)
        boxes = 0  # where this fails, cuts of the coordinates of the joints do not help
    else:
        reach = 0.0
    if reach == 0.0:
        reach = _bound_joints(enclosed, q, found, given, reaches, boxes)
    if reach > 0.0:
        return PoseProof(-1, found.scale, reach, "does not close within the limits", found)
    return PoseProof(0, found.scale, 0.0, "neither a closure nor its absence is proved", found)


def _bound_apart(
    model: SpaceModel, q: Array, found: Optimum, given: Array, reaches: tuple[float, ...], boxes: int
) -> float:
    """Largest reach with a proof of binding in which the links are bodies that turn by themselves, or 0."""
    bodies = Bodies(model, q)
    proof = multipliers(bodies, found)
    if proof is None:
        return 0.0
    least = max(2.0 * bodies.away(proof.at), LEAST)
    tried = [*(reach for reach in reaches if reach > least), least]
    for most in (1, boxes):
        for reach in tried:
            box = body_box(bodies, reach, given)
            if box is not None and most and binds(bodies, proof, box, most):
                return reach
    return 0.0


def _bound_joints(
    enclosed: Closure, q: Array, found: Optimum, given: Array, reaches: tuple[float, ...], boxes: int
) -> float:
    """Largest reach with a proof of binding in the coordinates of the joints, or 0; first without cuts."""
    model = enclosed.model
    floats = closures(model)[0]
    tried, rate = [], rates(floats, q, free=True)
    for reach in _reaches(model, q, found, reaches):
        box, empty = contract(enclosed, branch_box(model, q, reach, given, rate))
        proofs = certificates(floats, found, box)
        bound = lower_bounds(enclosed, proofs, box)[:, 0]
        if empty[0] or bound.max() > 0.0:
            return reach
        tried.append((float(bound.max()), reach, box, proofs[int(bound.argmax())]))
    _, reach, box, proof = max(tried, key=lambda one: one[0])
    return reach if boxes and _cut(enclosed, proof, box, boxes) else 0.0


def _reaches(model: SpaceModel, q: Array, found: Optimum, reaches: tuple[float, ...]) -> tuple[float, ...]:
    """Return those reaches that hold the closure found twice over, and the least one that does."""
    away = 0.0
    for joint, column in zip(model.joints, model.column):
        for place in (TURN, *((SHIFT_X,) if joint.guide else ())):
            if 0 <= column[place] < model.size:
                away = max(away, abs(float(found.q[column[place]] - q[column[place]])))
    least = max(2.0 * away, LEAST)
    return (*(reach for reach in reaches if reach > least), least)


def rates(floats: Closure, q: Array, free: bool = False) -> Array:
    """Change of the unknowns with the given coordinates, the least by what their limits leave, (size, given).

    With ``free`` only of unknowns without limits.
    """
    return np.asarray(all_rates(floats, q[None], free)[0])


def all_rates(floats: Closure, q: Array, free: bool = False) -> Array:
    """Return the `rates` of N closures q (N, width), (N, size, given)."""
    model = floats.model
    J = floats.jacobian(floats.loops(q))
    room = np.ones((len(q), model.size))
    for bound in model.bounds:
        columns = list(bound.columns)
        left = bound.chart(1.0) - np.sqrt((q[:, columns] ** 2).sum(1))
        room[:, columns] = 0.0 if free else np.clip(left, 1e-9, 1.0)[:, None]
    first = J[:, :, : model.size] * room[:, None]
    return np.asarray(-room[:, :, None] * (np.linalg.pinv(first, rcond=1e-11) @ J[:, :, model.size :]))


def _cut(enclosed: Closure, proof: Certificate, first: Box, most: int) -> bool:
    """Whether no member of a box closes within the limits, by cutting it into at most so many boxes."""
    used, live = 1, first
    while len(live.low):
        if used + 2 * len(live.low) > most:
            return False
        live = _halved(live, enclosed.model.size)
        used += len(live.low)
        live, empty = contract(enclosed, live)
        live = live.take(~empty)
        if len(live.low):
            left = ~(lower_bounds(enclosed, [proof], live)[0] > 0.0)
            live = live.take(left)
    return True


def _halved(boxes: Box, size: int) -> Box:
    """Cut every box across its widest unknown: angles and parts of the size of the mechanism count alike."""
    width = (boxes.high - boxes.low)[:, :size]
    rows, side = np.arange(len(width)), width.argmax(1)
    middle = 0.5 * (boxes.low + boxes.high)[rows, side]
    high, low = boxes.high.copy(), boxes.low.copy()
    high[rows, side] = low[rows, side] = middle
    return boxes._replace(low=np.concatenate([boxes.low, low]), high=np.concatenate([high, boxes.high]))
