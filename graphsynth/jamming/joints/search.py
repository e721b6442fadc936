"""The search over the range of a motion, and the search for one member of the tolerance boxes that binds.

Pieces are cut until each is decided or no cut can decide it.  Where the boxes as a whole prove nothing, floating point
looks for a member that binds: limits and plays at their low ends, misalignments at the ends of their boxes, dimensions
at the corner that the sensitivities point to.  Then that member alone is proved to bind at one input, in an assembly
that lies in the box of a piece proved to hold exactly one assembly for every member: the branch of the motion.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import product
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Interval
from graphsynth.intervals.reading import shortened
from graphsynth.jamming.assembly.tubes import joined, shortest_reach
from graphsynth.jamming.joints.limits import Limits, Misalignment, bounds, chosen
from graphsynth.jamming.joints.pieces import PARTS, Found, Work, cut
from graphsynth.jamming.joints.program import JointProblem, problem

if TYPE_CHECKING:
    from graphsynth.jamming.assembly.positions import Positions
    from graphsynth.mechanism.model import Mechanism


Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_PEAKS = 4
#: So many pieces may be cut without asking whether it can help.
_FEW = 8
#: So many are looked at together where not all of one depth can be.
_SOME = 256
#: So many times the parameters of a piece are halved at most; with members of both kinds; what a cut of the input is
#: worth beside that of a parameter, for it makes more pieces but is needed anyway.
_CUTS, _MIXED_CUTS, _INPUT = 24, 4, 0.5


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
    """Cut inputs and parameters until every piece is decided, too narrow, or cannot be decided; say what stopped it."""
    parts: list[Found] = []
    lo, hi = work.first()
    p = work.whole(len(lo))
    stopped = ""
    first = True
    while lo.size:
        left = budget.max_pieces - work.evaluated
        # all of one depth as long as that leaves most of the work, then some of them down to the end
        at = 0 if first or PARTS * lo.size <= left else max(lo.size - _SOME, 0)
        if lo.size - at > left or budget.over:
            stopped = f"the limit of work was reached after {work.evaluated} pieces"
            parts.append(Found.open(lo, hi, p, work.system.size))
            break
        found, waiting = work.evaluate(lo[at:], hi[at:], p[at:]), (lo[:at], hi[:at], p[:at])
        again = (found.straddles | found.unsure) & _worth(work, found, budget)
        if not first and not budget.over:
            again &= ~_hopeless(work, found, again)
        first = False
        parts.append(found.take(~again))
        lo, hi, p = (joined(list(pair)) for pair in zip(waiting, _divided(work, found.take(again), budget)))
    pieces = Found.join(parts)
    if not (pieces.sure == -1).any() and not ((pieces.upper < 1.0) | ~pieces.proved).all():
        pieces = _with_peak(work, pieces)
    return pieces, stopped


def _shares(work: Work, found: Found) -> Array:
    """Width of every parameter of the pieces over that of the whole box, (N, m)."""
    whole = work.box.high - work.box.low
    return np.where(whole > 0.0, (found.p_hi - found.p_lo) / np.where(whole > 0.0, whole, 1.0), 1.0)


def _worth(work: Work, found: Found, budget: Budget) -> Mask:
    """Tell the pieces that are wide enough to be cut; those with members of both kinds only along the input."""
    wide = np.asarray(found.hi - found.lo > budget.smallest)
    if work.box.size == 0:
        return wide
    cuts = -np.log2(np.maximum(_shares(work, found), 1e-300)).sum(axis=1)
    few = np.where(found.mixed & found.proved, _MIXED_CUTS, _CUTS)
    return np.asarray(wide & (cuts < few - 0.5))


def _divided(work: Work, found: Found, budget: Budget) -> tuple[Array, Array, Interval]:
    """Cut every piece where the assembly moves most: the input into `PARTS`, or a parameter in two.

    What lies outside a circle of holes holds no member, and is left out.
    """
    reach = found.reach.copy()
    none = ~found.proved & (reach.max(axis=1, initial=0.0) == 0.0)
    reach[none, 0] = 1.0  # the middle is not assembled: nothing is known of the parameters
    if work.box.size:
        reach[found.hi - found.lo <= budget.smallest, 0] = 0.0
        reach[:, 0] *= _INPUT
    which = reach.argmax(axis=1)
    p = Interval.from_bounds(found.p_lo, found.p_hi)
    by_input = np.flatnonzero(which == 0)
    lo, hi = cut(found.lo[by_input], found.hi[by_input])
    rows = np.repeat(by_input, PARTS)
    parts = [(lo, hi, p.lo[rows], p.hi[rows])]
    rest = np.flatnonzero(which > 0)
    for half in (0, 1):
        low, high = p.lo[rest].copy(), p.hi[rest].copy()
        at = np.arange(rest.size), which[rest] - 1
        middle = 0.5 * (low[at] + high[at])
        (high if half == 0 else low)[at] = middle
        parts.append((found.lo[rest], found.hi[rest], low, high))
    lo, hi, low, high = (np.concatenate(columns) for columns in zip(*parts))
    p, held = work.box.in_discs(Interval.from_bounds(low, high))
    return lo[held], hi[held], p[held]


def _hopeless(work: Work, found: Found, again: Mask) -> Mask:
    """Tell the pieces that no cut decides: at both ends and in the middle they are as undecided without width.

    Tolerances of which some jam and some do not, a factor of 1 all along, or a distance from 1 that exact tilts may
    close.  A guess about what to leave undecided; it proves nothing.
    """
    stuck = again & found.proved & (found.mixed | found.unsure | (work.box.size == 0))
    rows = np.flatnonzero(stuck)
    if rows.size <= _FEW:
        return np.zeros_like(stuck)
    lo, hi = found.lo[rows], found.hi[rows]
    inputs = np.concatenate([lo, 0.5 * (lo + hi), hi])
    # where exact tilts may change the answer, a narrower box of parameters may do too
    own, near = found.take(rows), found.unsure[rows, None]
    middle = np.clip(0.5 * (own.p_lo + own.p_hi), own.p_lo, own.p_hi)
    low, high = (np.tile(np.where(near, middle, end), (3, 1)) for end in (own.p_lo, own.p_hi))
    # neighbours share their ends
    _, one, back = np.unique(np.column_stack([inputs, low, high]), axis=0, return_index=True, return_inverse=True)
    at = work.evaluate(inputs[one], inputs[one], Interval.from_bounds(low[one], high[one])).take(back.reshape(-1))
    straddles, unsure, proved = (part.reshape(3, -1) for part in (at.straddles, at.unsure, at.proved))
    stuck[rows] = (proved & np.where(found.straddles[rows], straddles, unsure)).all(axis=0)
    return stuck


def peak_inputs(work: Work, pieces: Found, left: NDArray[np.intp]) -> Array:
    """Return inputs in some of the pieces at which the factor seems largest (estimated), ascending."""
    left = left[np.argsort(-pieces.lower[left], kind="stable")]
    left = left[np.sort(np.unique(pieces.lo[left], return_index=True)[1])][:_PEAKS]
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
    around = np.flatnonzero((pieces.lo <= u) & (pieces.hi >= u))
    around = around[pieces.lo[around] == pieces.lo[around].max()]
    before, after = pieces.take(around), pieces.take(around)
    before.hi[:] = after.lo[:] = u
    rest = np.delete(np.arange(len(pieces.lo)), around)
    return Found.join([pieces.take(rest), before, after, points.take(top)])


#: Directions tried over the range of each; relative width of a range that only encloses a number.
_DIRECTIONS, _ROUNDING = 9, 1e-12


def _deviations(values: Iterable[tuple[str, float]]) -> list[str]:
    return [f"{name} {value:+.12g}" if value else f"{name} nominal" for name, value in values]


@dataclass(frozen=True, eq=False)
class MemberWitness:
    """A member of the tolerance boxes that is proved to jam (certified).

    It binds at ``input``, where ``factor``, above 1, is a proved lower bound of the factor on limits and plays; with
    ``exact`` tilts, or with small ones only (first order).  Misalignments, limits (in the order of
    ``mechanism.joints``) and the dimensions of ``mechanism`` are those of this member, without tolerance.  What
    tolerances leave open has names: ``deviations`` of the dimensions, and ``chosen_limits`` of joints.
    """

    input: float
    factor: float
    misalignments: tuple[Misalignment, ...]
    limits: tuple[Limits, ...]
    mechanism: Mechanism
    exact: bool = True
    deviations: tuple[tuple[str, float], ...] = ()
    chosen_limits: tuple[tuple[str, float], ...] = ()

    def summary(self) -> dict[str, Any]:
        """Plain values."""
        limits = []
        for joint, own in zip(self.mechanism.joints, self.limits):
            names = {name: "play" if name == "axial_clearance" else name for name in own.names}
            limits.append({"joint": list(joint.pair), **{names[name]: getattr(own, name) for name in names}})
        return {
            **{name: getattr(self, name) for name in ("input", "factor", "exact")},
            "misalignments": [
                {"base": m.base, "link": m.link, "alpha": m.alpha, "direction": m.direction} for m in self.misalignments
            ],
            "limits": limits,
            "deviations": dict(self.deviations),
            "chosen_limits": dict(self.chosen_limits),
            "dimensions": [[list(joint.at_a), list(joint.at_b)] for joint in self.mechanism.joints],
        }

    @property
    def named(self) -> str:
        """The member in words."""
        tilts = [f"alpha = {m.alpha:.9g} at {m.direction:.9g} rad" for m in self.misalignments]
        named = _deviations(self.deviations)
        named += [f"{name} = {value:.12g}" for name, value in self.chosen_limits]
        return f"a member of the tolerance boxes ({', '.join(tilts + named)})"

    @property
    def sentence(self) -> str:
        """What is proved."""
        return (
            f"{self.named} binds at the input {self.input!r}, proved"
            f"{'' if self.exact else ' with small tilts (first order) only'}: its limits would "
            f"have to be {shortened(self.factor, -1, 9)} times as large or more with small tilts"
        )


def unclosed_member(work: Work, pieces: Found) -> str:
    """Name a member that cannot be assembled in a piece without proved positions, or return an empty text."""
    return unclosed_at(work.system, np.unique(0.5 * (pieces.lo + pieces.hi)[~pieces.proved]))


def unclosed_at(system: Positions, u: Array) -> str:
    """Name a member that cannot be assembled at one of the inputs (N,), or return an empty text."""
    if u.size == 0 or system.box.size == 0 or not system.dyads:
        return ""
    p, room = shortest_reach(system, u)
    at = int(np.argmin(room))
    if not room[at] < 0.0:
        return ""
    named = ", ".join(_deviations(zip(system.box.names, p[at].tolist())))
    return f"the member ({named}) cannot be assembled at the input {float(u[at])!r}, proved"


def jamming_member(work: Work, pieces: Found, own: Mask) -> MemberWitness | None:
    """Return a member proved to jam in one of the pieces ``own`` (proved to be on the branch), or None."""
    proved = np.flatnonzero(own & (pieces.sure == -1))
    for row in proved[np.argsort(-pieces.lower[proved], kind="stable")].tolist():
        found = _of_a_piece(work, pieces, row)
        if found is not None:
            return found
    left = np.flatnonzero(own & (pieces.upper > 1.0))
    boxes = [bounds(tilt, name) for tilt in work.given.misalignments for name in ("alpha", "direction")]
    boxes += [bounds(own, name) for own in work.given.limits for name in own.names]
    if left.size == 0 or not (work.box.size or any(low < high for low, high in boxes)):
        return None
    tilts = tuple(tilt.sharp() for tilt in work.given.misalignments)
    member = _member(work, np.zeros(work.box.size), lowest(work.given.limits), tilts)
    at = peak_inputs(member, pieces, left)
    # dimensions last: their corner depends on which way the axes are tilted
    member = _worst_tilts(work, member, at)
    member, p = _worst_dimensions(work, member, at)
    at = peak_inputs(member, pieces, left)
    limits, tilts = member.given.limits, member.given.misalignments
    points = _proving(work, limits, tilts).evaluate(at, at, Interval.from_bounds(*2 * (np.tile(p, (at.size, 1)),)))
    inside = _in_a_piece(pieces, own, at, p, points)
    exact = bool((inside & (points.sure == -1)).any())
    factor = np.where(inside & ((points.sure == -1) | (not exact)), points.lower, 0.0)
    top = int(np.argmax(factor))
    if factor[top] <= 1.0:
        return None
    return _named(work, member, p, (float(at[top]), float(factor[top])), exact)


def _of_a_piece(work: Work, pieces: Found, row: int) -> MemberWitness | None:
    """Return a member in a piece in which all bind: the middle if all discs hold it, else what is next to nominal."""
    u = float(0.5 * (pieces.lo[row] + pieces.hi[row]))
    low, high = pieces.p_lo[row], pieces.p_hi[row]
    for p in (np.clip(0.5 * (low + high), low, high), np.clip(0.0, low, high)):
        if work.box.holds(p):
            limits = tuple(chosen(own, getattr) for own in work.given.limits)
            member = _member(work, p, limits, tuple(tilt.sharp() for tilt in work.given.misalignments))
            return _named(work, member, p, (u, float(pieces.lower[row])))
    return None


def _named(work: Work, member: Work, p: Array, at: tuple[float, float], exact: bool = True) -> MemberWitness:
    """Return the member with names for what the tolerances leave open; ``at`` are the input and the factor there."""
    given = member.given
    named = tuple(zip(work.box.names, p.tolist())), limits_chosen(work.given, given.limits)
    return MemberWitness(*at, given.misalignments, given.limits, given.mechanism, exact, *named)


def limits_chosen(given: JointProblem, limits: tuple[Limits, ...]) -> tuple[tuple[str, float], ...]:
    """Return names and values of the limits that a problem leaves a range, wider than what encloses one number."""
    found = []
    for joint, limit, own in zip(given.mechanism.joints, given.limits, limits):
        for name in limit.names:
            low, high = bounds(limit, name)
            if high - low > _ROUNDING * high:
                found.append((f"{name.replace('_', ' ')} of joint {joint.a}-{joint.b}", getattr(own, name)))
    return tuple(found)


def lowest(limits: tuple[Limits, ...]) -> tuple[Limits, ...]:
    """Return limits at the low ends of their ranges, a little above where those only enclose a critical tilt."""

    def least(own: Limits, name: str) -> float:
        low, high = bounds(own, name)
        return min(low * (1.0 + 1e-9), high)

    return tuple(chosen(own, least) for own in limits)


def _in_a_piece(pieces: Found, own: Mask, at: Array, p: Array, points: Found) -> Mask:
    """Whether the assembly proved at an input, for the member p, is that of a piece on the branch."""
    found = np.zeros(at.size, dtype=np.bool_)
    held = own & ((pieces.p_lo <= p) & (p <= pieces.p_hi)).all(axis=1)
    for k in np.flatnonzero(points.proved).tolist():
        rows = np.flatnonzero(held & (pieces.lo <= at[k]) & (at[k] <= pieces.hi))
        low, high = pieces.box_lo[rows] <= points.box_lo[k], points.box_hi[k] <= pieces.box_hi[rows]
        found[k] = (low & high).all(axis=1).any()
    return found


def sharp_problem(mechanism: Mechanism, limits: tuple[Limits, ...], tilts: tuple[Misalignment, ...]) -> JointProblem:
    """Put one member together, its limits in the order of the joints."""
    rigid = {tilt.pair for tilt in tilts if tilt.rigid}
    table = {joint.pair: own for joint, own in zip(mechanism.joints, limits) if joint.pair not in rigid}
    return problem(mechanism, table, tilts)


def _proving(work: Work, limits: tuple[Limits, ...], tilts: tuple[Misalignment, ...]) -> Work:
    """Work of the same box of parameters with sharp limits and misalignments."""
    return Work(sharp_problem(work.given.mechanism, limits, tilts), work.motion, work.box)


def _member(work: Work, p: Array, limits: tuple[Limits, ...], tilts: tuple[Misalignment, ...]) -> Work:
    """Work of one member of the box of parameters, from the start of the motion: to look for what binds."""
    mechanism = work.box.member(work.given.mechanism, p) if p.any() else work.given.mechanism
    given = sharp_problem(mechanism, limits, tilts)
    return Work(given, replace(work.motion, mechanism=mechanism), 0.0)


def _worst_tilts(work: Work, member: Work, at: NDArray[np.float64]) -> Work:
    """Take one misalignment after the other to where the factor is largest: an end of alpha (it is convex in each)."""
    best, most = member, float(member.estimate(at).max())
    for k, tilt in enumerate(work.given.misalignments):
        low, high = bounds(tilt, "direction")
        angles = {low, high, *np.clip(np.linspace(low, high, _DIRECTIONS), low, high).tolist()}
        for alpha, direction in product(sorted(set(bounds(tilt, "alpha"))), sorted(angles)):
            choice = tilt.sharp(alpha, direction)
            tilts = (*best.given.misalignments[:k], choice, *best.given.misalignments[k + 1 :])
            other = _member(work, np.zeros(work.box.size), member.given.limits, tilts)
            value = float(other.estimate(at).max())
            if value > most:
                best, most = other, value
    return best


def _worst_dimensions(work: Work, member: Work, at: NDArray[np.float64]) -> tuple[Work, Array]:
    """Take every parameter to the end of its box, or the rim of its disc, that raises the factor at the worst input."""
    box = work.box
    rises = np.zeros(box.size)
    if box.size == 0:
        return member, rises
    value = member.estimate(at)
    worst = at[[int(np.argmax(value))]]
    most = float(value.max())

    def moved(values: Array) -> Work:
        return _member(work, values, member.given.limits, member.given.misalignments)

    for k in range(box.size):
        one = np.zeros(box.size)
        one[k] = end = box.high[k] if box.high[k] > 0.0 else box.low[k]
        rises[k] = (moved(one).estimate(worst)[0] - most) * math.copysign(1.0, end)
    p = box.furthest(rises)
    other = moved(p)
    return (other, p) if float(other.estimate(worst)[0]) > most else (member, np.zeros(box.size))
