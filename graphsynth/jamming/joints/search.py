"""The search over the range of a motion, and the search for one member of the tolerance boxes that binds.

Pieces are cut until each is decided or no cut can decide it.  Where the boxes as a whole prove nothing, floating point
looks for a member that binds: limits and plays at their low ends, misalignments at the ends of their boxes, dimensions
at the corner that the sensitivities point to.  Then that member alone is proved to bind at one input, in an assembly
that lies in the box of a piece proved to hold exactly one assembly for every member: the branch of the motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals.reading import shortened
from graphsynth.jamming.joints.limits import Limits, Misalignment, bounds
from graphsynth.jamming.joints.pieces import Found, Work, cut
from graphsynth.jamming.joints.program import problem

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism


Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_PEAKS = 4
#: So many pieces may be cut without asking whether it can help.
_FEW = 8


class Budget(NamedTuple):
    """Limits of the work: narrowest piece, pieces, seconds, and when the work began (`perf_counter`)."""

    smallest: float
    max_pieces: int
    seconds: float
    begin: float

    @property
    def over(self) -> bool:
        """Whether the time is up."""
        return perf_counter() - self.begin > self.seconds


def search(work: Work, budget: Budget) -> tuple[Found, str]:
    """Cut the range until every piece is decided, too narrow, or cannot be decided; say what stopped the work."""
    parts: list[Found] = []
    lo, hi = work.first()
    stopped = ""
    first = True
    while lo.size:
        if work.evaluated + lo.size > budget.max_pieces or budget.over:
            stopped = f"the limit of work was reached after {work.evaluated} pieces"
            parts.append(_open(lo, hi, work.system.size))
            break
        found = work.evaluate(lo, hi)
        again = (found.straddles | found.unsure) & (hi - lo > budget.smallest)
        if not first and not budget.over:
            again &= ~_hopeless(work, found, again)
        first = False
        parts.append(found.take(~again))
        lo, hi = cut(lo[again], hi[again])
    pieces = Found.join(parts)
    if not (pieces.sure == -1).any() and not ((pieces.upper < 1.0) | ~pieces.proved).all():
        pieces = _with_peak(work, pieces)
    return pieces, stopped


def _hopeless(work: Work, found: Found, again: Mask) -> Mask:
    """Tell the pieces that no cut decides: at both ends and in the middle they are as undecided without any width.

    Tolerances of which some jam and some do not, a factor of 1 all along, or a distance from 1 that exact tilts may
    close.  A guess about what to leave undecided; it proves nothing.
    """
    stuck = again & found.proved
    rows = np.flatnonzero(stuck)
    if rows.size <= _FEW:
        return np.zeros_like(stuck)
    lo, hi = found.lo[rows], found.hi[rows]
    inputs, back = np.unique(np.concatenate([lo, 0.5 * (lo + hi), hi]), return_inverse=True)
    at = work.evaluate(inputs, inputs)
    straddles, unsure, proved = (part[back].reshape(3, -1) for part in (at.straddles, at.unsure, at.proved))
    stuck[rows] = (proved & np.where(found.straddles[rows], straddles, unsure)).all(axis=0)
    return stuck


def peak_inputs(work: Work, pieces: Found, left: NDArray[np.intp]) -> Array:
    """Return inputs in some of the pieces at which the factor seems largest (estimated), ascending."""
    left = left[np.argsort(-pieces.lower[left], kind="stable")][:_PEAKS]
    lo, hi = pieces.lo[left], pieces.hi[left]
    for _ in range(8):
        inputs = np.unique(lo[:, None] + (hi - lo)[:, None] * (np.arange(9) / 8.0))
        value = work.estimate(inputs)
        for k in range(len(lo)):
            own = np.flatnonzero((inputs >= lo[k]) & (inputs <= hi[k]))
            if own.size > 2:
                best = own[int(np.argmax(value[own]))]
                lo[k], hi[k] = inputs[max(best - 1, own[0])], inputs[min(best + 1, own[-1])]
    return np.unique(np.concatenate([lo, 0.5 * (lo + hi), hi]))


def _with_peak(work: Work, pieces: Found) -> Found:
    """Look in undecided pieces for an input at which the jam can be proved; add it as a piece of no width."""
    left = np.flatnonzero((pieces.upper >= 1.0) & pieces.proved)
    inputs = peak_inputs(work, pieces, left)
    points = work.evaluate(inputs, inputs)
    jams = np.flatnonzero(points.sure == -1)
    jams = jams if jams.size else np.flatnonzero(points.lower > 1.0)
    if jams.size == 0:
        return pieces
    top = jams[[int(np.argmax(points.lower[jams]))]]
    u = float(points.lo[top[0]])
    place = int(np.searchsorted(pieces.lo, u, side="right")) - 1
    split = pieces.take(np.array([place, place]))
    split.hi[0] = split.lo[1] = u
    rest = np.delete(np.arange(len(pieces.lo)), place)
    return Found.join([pieces.take(rest), split, points.take(top)])


def _open(lo: Array, hi: Array, size: int) -> Found:
    """Pieces about which nothing is known."""
    none = np.zeros(len(lo))
    box = np.full((len(lo), size), np.nan)
    return Found(lo, hi, none, none + np.inf, none > 1.0, box, box, none.astype(np.int8))


#: Directions tried over the range of each.
_DIRECTIONS = 9
#: Relative step back from the corner of the dimensions, so that rounding leaves them inside their box.
_INSIDE = 1e-9


@dataclass(frozen=True, eq=False)
class MemberWitness:
    """A member of the tolerance boxes that is proved to jam (certified).

    It binds at ``input``, where ``factor``, above 1, is a proved lower bound of the factor on limits and plays; with
    ``exact`` tilts, or with small ones only (first order).  Misalignments, limits (in the order of
    ``mechanism.joints``) and the dimensions of ``mechanism`` are those of this member, without tolerance.
    """

    input: float
    factor: float
    misalignments: tuple[Misalignment, ...]
    limits: tuple[Limits, ...]
    mechanism: Mechanism
    exact: bool = True

    def summary(self) -> dict[str, Any]:
        """Plain values."""
        limits = []
        for joint, own in zip(self.mechanism.joints, self.limits):
            tilts = {name: getattr(own, name) for name in own.tilts}
            limits.append({"joint": list(joint.pair), **tilts, "play": own.axial_clearance})
        return {
            **{name: getattr(self, name) for name in ("input", "factor", "exact")},
            "misalignments": [
                {"base": m.base, "link": m.link, "alpha": m.alpha, "direction": m.direction} for m in self.misalignments
            ],
            "limits": limits,
            "dimensions": [[list(joint.at_a), list(joint.at_b)] for joint in self.mechanism.joints],
        }

    @property
    def sentence(self) -> str:
        """What is proved."""
        tilts = ", ".join(f"alpha = {m.alpha:.9g} at {m.direction:.9g} rad" for m in self.misalignments)
        return (
            f"a member of the tolerance boxes ({tilts}) binds at the input {self.input!r}, proved"
            f"{'' if self.exact else ' with small tilts (first order) only'}: its limits would "
            f"have to be {shortened(self.factor, -1, 9)} times as large or more with small tilts"
        )


def jamming_member(work: Work, pieces: Found, own: Mask) -> MemberWitness | None:
    """Return a member proved to jam in one of the pieces ``own`` (proved to be on the branch), or None."""
    left = np.flatnonzero(own & (pieces.upper > 1.0))
    boxes = [bounds(tilt, name) for tilt in work.given.misalignments for name in ("alpha", "direction")]
    lows = []
    for limit in work.given.limits:
        ranges = {name: bounds(limit, name) for name in (*limit.tilts, "axial_clearance")}
        boxes += ranges.values()
        least: dict[str, Any] = {name: low for name, (low, _) in ranges.items()}
        lows.append(type(limit)(**least))
    if left.size == 0 or not (work.tolerance > 0.0 or any(low < high for low, high in boxes)):
        return None
    tilts = tuple(tilt.sharp() for tilt in work.given.misalignments)
    member = _member(work, work.given.mechanism, tuple(lows), tilts)
    at = peak_inputs(member, pieces, left)
    # dimensions last: their corner depends on which way the axes are tilted
    for adjust in (_worst_tilts, _worst_dimensions):
        member = adjust(work, member, at)
    at = peak_inputs(member, pieces, left)
    points = member.evaluate(at, at)
    place = np.clip(np.searchsorted(pieces.lo, at, side="right") - 1, 0, None)
    inside = own[place] & points.proved & (at <= pieces.hi[place])
    inside &= ((points.box_lo >= pieces.box_lo[place]) & (points.box_hi <= pieces.box_hi[place])).all(axis=1)
    exact = bool((inside & (points.sure == -1)).any())
    factor = np.where(inside & ((points.sure == -1) | (not exact)), points.lower, 0.0)
    top = int(np.argmax(factor))
    if factor[top] <= 1.0:
        return None
    given = member.given
    return MemberWitness(float(at[top]), float(factor[top]), given.misalignments, given.limits, given.mechanism, exact)


def _member(work: Work, mechanism: Mechanism, limits: tuple[Limits, ...], tilts: tuple[Misalignment, ...]) -> Work:
    """Work of one member, from the start of the motion."""
    rigid = {tilt.pair for tilt in tilts if tilt.rigid}
    table = {joint.pair: own for joint, own in zip(mechanism.joints, limits) if joint.pair not in rigid}
    return Work(problem(mechanism, table, tilts), replace(work.motion, mechanism=mechanism), 0.0)


def _worst_tilts(work: Work, member: Work, at: NDArray[np.float64]) -> Work:
    """Take one misalignment after the other to where the factor is largest: an end of alpha (it is convex in each)."""
    best, most = member, float(member.estimate(at).max())
    for k, tilt in enumerate(work.given.misalignments):
        low, high = bounds(tilt, "direction")
        angles = {low, high, *np.clip(np.linspace(low, high, _DIRECTIONS), low, high).tolist()}
        for alpha, direction in product(sorted(set(bounds(tilt, "alpha"))), sorted(angles)):
            choice = tilt.sharp(alpha, direction)
            tilts = (*best.given.misalignments[:k], choice, *best.given.misalignments[k + 1 :])
            other = _member(work, member.given.mechanism, member.given.limits, tilts)
            value = float(other.estimate(at).max())
            if value > most:
                best, most = other, value
    return best


def _worst_dimensions(work: Work, member: Work, at: NDArray[np.float64]) -> Work:
    """Take every coordinate of a joint to the end of its box that raises the factor at the worst of the inputs."""
    if work.tolerance == 0.0:
        return member
    mechanism, step = member.given.mechanism, work.tolerance * (1.0 - _INSIDE)
    value = member.estimate(at)
    worst = at[[int(np.argmax(value))]]
    most = float(value.max())

    def moved(signs: NDArray[np.float64]) -> Work:
        grow = (1.0 + step * signs).reshape(-1, 4)
        joints = [
            replace(
                joint,
                at_a=(joint.at_a[0] * g[0], joint.at_a[1] * g[1]),
                at_b=(joint.at_b[0] * g[2], joint.at_b[1] * g[3]),
            )
            for joint, g in zip(mechanism.joints, grow.tolist())
        ]
        other = replace(mechanism, joints=tuple(joints))
        return _member(work, other, member.given.limits, member.given.misalignments)

    signs = np.zeros(4 * len(mechanism.joints))
    given = np.array([value for joint in mechanism.joints for value in (*joint.at_a, *joint.at_b)])
    for k in np.flatnonzero(given != 0.0):
        one = np.zeros_like(signs)
        one[k] = 1.0
        signs[k] = np.sign(moved(one).estimate(worst)[0] - most)
    other = moved(signs)
    return other if float(other.estimate(worst)[0]) > most else member
