"""Proved verdicts over the range of a motion, with every loop closed in space: pieces of the input."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Interval
from graphsynth.intervals.reading import shortened
from graphsynth.jamming.assembly.positions import points
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.joints.certify import TurnCertificate
from graphsynth.jamming.joints.drawing import Tolerances, drawn
from graphsynth.jamming.joints.limits import Misalignment
from graphsynth.jamming.joints.pieces import check_range
from graphsynth.jamming.joints.program import Bearings, JointProblem, problem
from graphsynth.jamming.joints.search import limits_chosen
from graphsynth.jamming.space.apart import closes_apart
from graphsynth.jamming.space.branch import Free, faces, joined
from graphsynth.jamming.space.closure import closures
from graphsynth.jamming.space.members import (
    MemberPoses,
    Members,
    Place,
    SpaceWitness,
    aligned,
    at_end,
    binding_member,
    slopes,
)
from graphsynth.jamming.space.model import MODEL, Unsupported
from graphsynth.jamming.space.pose import REACHES, PoseProof, free_poses, rates, settle_pose
from graphsynth.jamming.verdict import Verdict

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion
    from graphsynth.tolerances.box import ParameterBox

Array = NDArray[np.float64]
#: Ends of the input, and of the parameters.
_Span: TypeAlias = tuple[float, float, Array, Array]
#: Pieces of a full rotation at first, of any range at least; parts into which one is cut; half width of the
#: branch in unlimited turns and travels.
_FIRST, _FEWEST, _PARTS, _REACH = 96, 4, 3, 0.03
#: Boxes into which the unknowns at a single input are cut.
_BOXES = 300
#: So many times the parameters of a piece are halved at most; how far (radians, units), or as far as their limits, a
#: coordinate may lead the unknowns; how near to 1 a factor is for a member to be looked at; spread by the input, beside
#: that by the dimensions, from which on a piece with members of both kinds is cut.
_CUTS, _MOVED, _NEAR, _CLEAR = 12, 0.03, 1e-3, 0.3
#: Factor of the linearised closure below which a piece is cut rather than solved for; pieces taken at once.
_SURE, _CHUNK = 0.999, 64
#: Rounds in which free pieces are cut once more, to know their closures as continuous.
_FINER = 3
NOT_LED = "; that one continuous motion leads through them is not proved"
#: Worth of cutting a parameter from which on links are tried as bodies, which takes as long as thirty pieces.
_WIDE = 1.0


class _Piece(NamedTuple):
    """A piece of the input and of the dimensions, and what is proved about it.

    ``p_low``, ``p_high`` (m,): ends of the parameters; ``worth`` (1 + m,) says what is worth cutting; ``ends``: the
    smallest and largest of the least factors of all members; ``spread``: how far that of one lies to either side over
    the input.  The last three are estimates.
    """

    low: float
    high: float
    p_low: Array
    p_high: Array
    proof: PoseProof
    worth: Array
    ends: tuple[float, float] = (math.nan, math.nan)
    spread: float = 0.0

    @property
    def mixed(self) -> bool:
        """Whether some members seem to bind and some do not."""
        return self.ends[0] < 1.0 < self.ends[1]

    @property
    def told(self) -> str:
        """Why it is undecided."""
        if not self.mixed:
            return self.proof.reason
        low, high = self.ends
        return f"some members seem to bind and some do not (least factors {low:.4g} to {high:.4g}, estimated)"


def certify_in_space(
    motion: Motion,
    bearings: Bearings | None,
    tilts: Misalignment | Iterable[Misalignment],
    *,
    condition: Condition = "A",
    tolerances: Tolerances = 0.0,
    resolution: float = 1e-3,
    max_pieces: int = 5000,
    seconds: float = 60.0,
) -> TurnCertificate:
    """Prove where a mechanism closes within its limits and where it does not, with exact closure in space.

    Unlike `certify_coupled` nothing is neglected: finite tilts, and all loops closed in three dimensions.  See
    theory/closure-in-space.

    Parameters
    ----------
    motion : Motion
        Of `graphsynth.simulate`, with revolute and prismatic joints and pins in slots.
    bearings, tilts, condition
        As for `graphsynth.jamming.joints.assess_coupled`; the verdict holds for every value in their ranges.
    tolerances : float or iterable of PartTolerance
        As for `graphsynth.jamming.joints.certify_coupled`; the verdict holds for every member, or names one that binds.
    resolution : float
        Width of a piece, over the range, below which it is left undecided.
    max_pieces, seconds : optional
        Limits of the work; what is not decided within them stays undecided.

    Returns
    -------
    TurnCertificate
        Certified.  State +1: for every input of the piece there is a closure within all limits.  State -1: for none of
        them there is one whose links spin (of guides: whose joints turn and travel) with the plane mechanism, within
        0.03 (radians, or parts of its size).  ``lower`` and ``upper`` bound the factor on all limits by 1 where
        that is proved.  `GeometryError` for limits or misalignments that do not fit the mechanism.

    Examples
    --------
    >>> from graphsynth import Mechanism
    >>> from graphsynth.jamming.joints import JointLimits
    >>> motion = Mechanism.four_bar(2, 1, 2.5, 2.5).simulate(np.linspace(0.2, 0.4, 3))
    >>> certify_in_space(motion, JointLimits(0.1), Misalignment(0, 1, 0.1)).verdict.name
    'CERTIFIED_FREE'
    """
    end = perf_counter() + seconds
    check_range(motion, resolution=resolution, max_pieces=max_pieces, seconds=seconds)
    limits, axes, box = drawn(motion.mechanism, bearings, tilts, tolerances)
    given = problem(motion.mechanism, limits, axes, condition)
    return certify_members(given, motion, box, Stint(end, resolution, max_pieces))


class Stint(NamedTuple):
    """Limits of the work: when it ends (`perf_counter`), narrowest piece over the range, pieces."""

    end: float
    resolution: float = 1e-3
    max_pieces: int = 5000


def certify_members(given: JointProblem, motion: Motion, box: ParameterBox, effort: Stint) -> TurnCertificate:
    """Prove as `certify_in_space`, of a problem and a box of dimensions."""
    begin = perf_counter()
    try:
        work = _Work(aligned(given, motion, box), motion, box)
    except Unsupported as error:
        ends = motion.inputs[motion.assembled]
        unknown = PoseProof.unknown(str(error))
        nothing = _columns([_Piece(float(ends.min()), float(ends.max()), box.low, box.high, unknown, np.zeros(1))])
        return TurnCertificate(
            Verdict.UNDECIDED, str(error), *nothing, False, None, 0, perf_counter() - begin, model=MODEL
        )
    pieces, stopped = work.search(effort)
    box = work.members.box
    decided = _decided(pieces, box)
    witness = None if decided == 1.0 else work.witness(pieces)
    verdict, reason = _verdict(motion, pieces, stopped, witness)
    branch = verdict is Verdict.CERTIFIED_FREE and work.one_branch(pieces, effort.end)
    if verdict is Verdict.CERTIFIED_FREE:
        reason += ", through which one continuous motion is proved to lead" if branch else NOT_LED
    if box.size and verdict is not Verdict.CERTIFIED_FREE:
        u = np.unique([0.5 * (p.low + p.high) for p in pieces if p.proof.state == 0])
        share = f"of all inputs and dimensions together {shortened(100.0 * decided, -1, 3)} % are decided"
        reason = "; ".join(filter(None, (reason, work.members.unclosed(u), share)))
    columns, spent = _columns(pieces), perf_counter() - begin
    found = TurnCertificate(verdict, reason, *columns, branch, witness, work.evaluated, spent, model=MODEL)
    return replace(found, decided=decided)


class _Work:
    """Proofs for pieces of the input and of the dimensions along one motion.

    ``members`` have their limits at the low ends of their ranges, for freedom, ``loose`` at the high ones, for a jam.
    """

    def __init__(self, given: JointProblem, motion: Motion, box: ParameterBox) -> None:
        ranges = bool(limits_chosen(given, given.limits))
        self.members = Members(at_end(given, 0) if ranges else given, motion, box)
        self.loose = Members(at_end(given, 1), motion, box) if ranges else self.members
        self.given, self.several = given, ranges or self.members.box.size > 0
        self.likely: list[_Piece] = []
        self.evaluated = 0

    def search(self, effort: Stint) -> tuple[list[_Piece], str]:
        """Cut until every piece is decided, too narrow or of members of both kinds; say what stopped the work."""
        own = self.members
        count = int(np.clip(math.ceil(_FIRST * (own.high - own.low) / math.tau), _FEWEST, _FIRST))
        edges = np.linspace(own.low, own.high, count + 1).tolist()
        waiting: list[_Span] = [(a, b, own.box.low, own.box.high) for a, b in pairwise(edges)]
        done, stopped, first = [], "", True
        peak: _Piece | None = None
        while waiting:
            fits = self.evaluated + len(waiting) <= effort.max_pieces and perf_counter() < effort.end
            if not fits:
                stopped = f"the limit of work was reached after {self.evaluated} pieces"
                unknown = PoseProof.unknown(stopped)
                done += [_Piece(*span, unknown, np.zeros(1 + own.box.size)) for span in waiting]
                break
            pieces = self._round(waiting, effort.end)
            if first:
                peak, first = self._peak(pieces), False
            least = effort.resolution * (own.high - own.low)
            waiting = []
            self.likely += [p for p in pieces if p.proof.state == 0 and p.ends[1] > 1.0 - _NEAR]
            for piece in pieces:
                parts = self._cut(piece, least) if piece.proof.state == 0 else []
                waiting += parts
                done += [] if parts else [piece]
        if peak is not None:
            done = _split(done, peak)
        return sorted(done, key=lambda piece: (piece.low, piece.high, *piece.p_low)), stopped

    def _cut(self, piece: _Piece, least: float) -> list[_Span]:
        """Cut a piece where it is worth most: the input into equal parts, or a parameter in two.

        None where it is too narrow, or as far as the input goes holds members of both kinds: no cut decides these.
        """
        box, p_low, p_high = self.members.box, piece.p_low, piece.p_high
        wide, worth = piece.high - piece.low > least, piece.worth.copy()
        if not self.several:
            return [(a, b, p_low, p_high) for a, b in _thirds(piece)] if wide else []
        if piece.mixed and piece.spread < _CLEAR * (piece.ends[1] - piece.ends[0]):
            return []
        whole = np.where(box.high > box.low, box.high - box.low, 1.0)
        cuts = -np.log2(np.where(box.high > box.low, (p_high - p_low) / whole, 1.0)).sum()
        if piece.mixed or cuts >= _CUTS - 0.5:
            worth[1:] = 0.0
        worth[0] *= wide
        k = int(worth.argmax())
        if not worth[k] > 0.0:
            return []
        if k == 0:
            return [(a, b, p_low, p_high) for a, b in _thirds(piece)]
        spans = []
        for half in (0, 1):
            low, high = p_low.copy(), p_high.copy()
            (high if half == 0 else low)[k - 1] = 0.5 * (p_low[k - 1] + p_high[k - 1])
            inside, held = box.in_discs(Interval.from_bounds(low[None], high[None]))
            if held[0]:
                spans.append((piece.low, piece.high, inside.lo[0], inside.hi[0]))
        return spans

    def _peak(self, pieces: list[_Piece]) -> _Piece | None:
        """Try to prove that it binds in the middle of the undecided piece with the largest factor."""
        left = [p for p in pieces if p.proof.state == 0 and p.ends[0] > 1.0]
        if not left or any(p.proof.state < 0 for p in pieces):
            return None
        top = max(left, key=lambda piece: piece.proof.scale)
        u = 0.5 * (top.low + top.high)
        single = self._round([(u, u, top.p_low, top.p_high)], math.inf, _BOXES)[0]
        return single if single.proof.state < 0 else None

    def witness(self, pieces: list[_Piece]) -> SpaceWitness | None:
        """Name a member that is proved to bind, unless all of them do at some input."""
        if (_columns(pieces)[2] == -1).any() or not self.several:
            return None
        sure = [p for p in pieces if p.proof.state < 0]
        left = sure + sorted(self.likely, key=lambda p: -p.ends[1])
        places = (Place(p.low, p.high, 0.5 * (p.p_low + p.p_high)) for p in left)
        return binding_member(self.given, self.members.motion, self.members.sizes, places)

    def one_branch(self, pieces: list[_Piece], end: float) -> bool:
        """Whether one continuous motion of every member is proved to lead through pieces that are all free."""
        members, found = self.members, []
        pieces = self._led(pieces, end)
        for p in pieces:
            if p.proof.lead is None or p.proof.optimum is None:
                return False
            found.append((p.proof.optimum.q, p.proof.lead))
        (low, high), (p_low, p_high) = (np.array([(p[k], p[k + 1]) for p in pieces]).swapaxes(0, 1) for k in (0, 2))
        free, (first, second) = Free.of(found, members.model.size), faces(low, high, p_low, p_high)
        floats, enclosed = closures(members.model)
        for k in range(0, len(first), _CHUNK):
            a, b = first[k : k + _CHUNK], second[k : k + _CHUNK]
            shared = np.maximum(p_low[a], p_low[b]), np.minimum(p_high[a], p_high[b])
            face = members.coordinates(points(high[a]), Interval.from_bounds(*shared))
            if perf_counter() > end or not joined(enclosed, floats, free.take(a), free.take(b), face).all():
                return False
        return True

    def _led(self, pieces: list[_Piece], end: float) -> list[_Piece]:
        """Cut free pieces in which closures are not proved to be single, as far as that is not most of the work."""
        for _ in range(_FINER):
            wide = [p for p in pieces if p.proof.lead is None]
            if not wide or len(wide) > _FEWEST + len(pieces) // 4:
                break
            own = self._round([(a, b, p.p_low, p.p_high) for p in wide for a, b in _thirds(p)], end)
            if not all(p.proof.state > 0 for p in own):
                break
            pieces = [*(p for p in pieces if p.proof.lead is not None), *own]
        return pieces

    def _round(self, spans: list[_Span], end: float, boxes: int = 0) -> list[_Piece]:
        """Prove what can be proved about pieces."""
        low, high, p_low, p_high = (np.array(part) for part in zip(*spans))
        box = Interval.from_bounds(low, high), Interval.from_bounds(p_low, p_high)
        poses, pieces = self.members.poses(*box), []
        model, reaches = self.members.model, REACHES if boxes else (_REACH,)
        nothing = np.ones(1 + self.members.box.size)
        first = {} if boxes else self._free(poses, end)
        for k, span in enumerate(spans):
            if not poses.found[k] or perf_counter() > end:
                why = "the time was up" if poses.found[k] else "the plane mechanism is not assembled"
                pieces.append(_Piece(*span, PoseProof.unknown(why), nothing))
                continue
            self.evaluated += 1
            proof = first[k] if k in first else settle_pose(model, poses.q[k], poses.given[k], boxes, reaches)
            if proof.state == 0 and k in first and not proof.scale < _SURE:
                proof = settle_pose(model, poses.q[k], poses.given[k], boxes, reaches)
            least = proof.scale
            if self.loose is not self.members and proof.state < 1 and not proof.scale < _SURE:
                own = self.loose.poses(*(part[k : k + 1] for part in box))
                other = settle_pose(self.loose.model, own.q[0], own.given[0], boxes, reaches)
                proof, least = replace(proof, state=min(other.state, 0)), other.scale
            piece = _Piece(*span, proof, *self._worth(proof, least, poses.given[k], span))
            pieces.append(self._apart(piece, poses.given[k]))
        return pieces

    def _apart(self, piece: _Piece, given: Array) -> _Piece:
        """Try to prove a piece free with links as bodies, where many cuts of its dimensions would be needed."""
        found = piece.proof.optimum
        if piece.proof.state or found is None or not found.scale < 1.0 or not piece.worth[1:].max(initial=0.0) > _WIDE:
            return piece
        if not closes_apart(self.members.model, found.q, rates(self.members.floats, found.q), given):
            return piece
        return piece._replace(proof=PoseProof(1, found.scale, math.inf, "closes within all limits", found))

    def _free(self, poses: MemberPoses, end: float) -> dict[int, PoseProof]:
        """Prove which pieces are free, many at once, as far as the time goes."""
        found: dict[int, PoseProof] = {}
        rows = np.flatnonzero(poses.found)
        for k in range(0, len(rows), _CHUNK):
            part = rows[k : k + _CHUNK]
            if perf_counter() > end:
                break
            found |= zip(part.tolist(), free_poses(self.members.model, poses.q[part], poses.given[part]))
        return found

    def _worth(
        self, proof: PoseProof, least: float, given: Array, span: _Span
    ) -> tuple[Array, tuple[float, float], float]:
        """Estimate what is worth cutting of an undecided piece, the ends of its factors, their spread by the input.

        ``least`` is the factor with limits at their high ends.
        """
        m = self.members.box.size
        if proof.state or not self.several or proof.optimum is None:
            return np.ones(1 + m), (least, proof.scale), 0.0
        rises = slopes(self.members.model, proof.optimum)
        spread = np.abs(rises) * given
        model, q = self.members.model, proof.optimum.q
        far = np.full(model.size, _MOVED)
        for bound in model.bounds:
            far[list(bound.columns)] = min(bound.chart(1.0), _MOVED)
        moved = np.abs(rates(self.members.floats, q)) * given[None] / far[:, None]
        worth = spread / max(abs(proof.scale - 1.0), 1e-9) + moved.max(0, initial=0.0)
        drivers = len(given) - m
        by_input = float(spread[:drivers].sum())
        down, up = _rises(self.members.box, rises[drivers:], *span[2:])
        worth = np.append(worth[:drivers].max(initial=0.0), worth[drivers:])
        return worth, (least - down, proof.scale + up), by_input


def _rises(box: ParameterBox, rises: Array, low: Array, high: Array) -> tuple[float, float]:
    """How far a linear function falls and rises from the middle of a part of the box; no further than on its discs."""
    middle, sides = 0.5 * (low + high), 0.5 * np.abs(rises) * (high - low)
    ends = [float(sides.sum())] * 2
    for pair in map(list, box.discs):
        most, at, flat = box.high[pair[0]] * math.hypot(*rises[pair]), rises[pair] @ middle[pair], sides[pair].sum()
        ends = [end - max(0.0, float(flat - most - side * at)) for end, side in zip(ends, (1.0, -1.0))]
    return ends[0], ends[1]


def _split(pieces: list[_Piece], single: _Piece) -> list[_Piece]:
    """Put a single input between the two parts of the undecided piece that holds it."""
    found = []
    for p in pieces:
        inside = p.low < single.low < p.high
        found += [p._replace(high=single.low), p._replace(low=single.low)] if inside else [p]
    return [*found, single]


def _thirds(piece: _Piece) -> list[tuple[float, float]]:
    """Equal parts of a piece, which share their ends."""
    width = piece.high - piece.low
    edges = [piece.low, *(piece.low + width * k / _PARTS for k in range(1, _PARTS)), piece.high]
    return list(pairwise(edges))


def _columns(pieces: list[_Piece]) -> tuple[Array, Array, NDArray[np.int8], Array, Array]:
    """Return ends, states and bounds of the factor: one piece for each range of inputs, decided if all over it are."""
    low, high = np.array([[p.low, p.high] for p in pieces]).T
    state = np.array([p.proof.state for p in pieces], dtype=np.int8)
    if any(len(p.p_low) for p in pieces):
        edges = np.unique(np.concatenate([low, high]))
        still = np.unique(low[low == high])
        ends = np.concatenate([np.stack([edges[:-1], edges[1:]], 1), np.stack([still, still], 1)])
        ends = ends[np.lexsort((ends[:, 1], ends[:, 0]))]
        merged = []
        for a, b in ends.tolist():
            own = state[(low == a) & (high == a)] if a == b else state[(low <= a) & (high >= b)]
            merged.append(own[0] if (own == own[0]).all() else 0)
        (low, high), state = ends.T, np.array(merged, dtype=np.int8)
    return low, high, state, np.where(state == -1, 1.0, 0.0), np.where(state == 1, 1.0, math.inf)


def _decided(pieces: list[_Piece], box: ParameterBox) -> float:
    """Share of all inputs and dimensions together that is proved free or binding."""
    wide = box.high > box.low
    size = np.array([(p.high - p.low) * float((p.p_high - p.p_low)[wide].prod()) for p in pieces])
    state = np.array([p.proof.state for p in pieces])
    return 1.0 if (state != 0).all() else float(size[state != 0].sum() / size.sum())


def _verdict(motion: Motion, pieces: list[_Piece], stopped: str, witness: SpaceWitness | None) -> tuple[Verdict, str]:
    """Return what the pieces prove together, and one sentence on it."""
    low, high, state, *_ = _columns(pieces)
    width = high - low
    binding, undecided = (float(width[state == s].sum() / width.sum()) for s in (-1, 0))
    left = next((p for p in pieces if p.proof.state == 0), None)
    why = "" if left is None else f"near the input {left.low:.9g}: {stopped or left.told}"
    if binding == 0.0 and (state == -1).any():
        u = float(low[int(np.argmin(state))])
        return Verdict.CERTIFIED_JAMMED, f"binds at the input {u!r}, proved with exact closure in space; else {why}"
    if binding > 0.0:
        part = "the whole range" if (state == -1).all() else f"{100.0 * binding:.3g} % of the range"
        rest = f"; undecided over {undecided:.3g} of it, {why}" if why else ""
        return Verdict.CERTIFIED_JAMMED, f"binds over {part}, proved with exact closure in space{rest}"
    if witness is not None:
        return Verdict.CERTIFIED_JAMMED_FOR_SOME, witness.sentence
    if why:
        return Verdict.UNDECIDED, f"undecided over {undecided:.3g} of the range, {why}"
    if not motion.completed:
        return Verdict.UNDECIDED, f"free as far as the motion goes, proved; it ends: {motion.reason}"
    return (
        Verdict.CERTIFIED_FREE,
        f"free over the whole range, proved with exact closure in space, {len(pieces)} pieces",
    )
