"""Proved verdicts over the range of a motion, with every loop closed in space: pieces of the input."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Interval
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.joints.certify import TurnCertificate
from graphsynth.jamming.joints.limits import Misalignment
from graphsynth.jamming.joints.pieces import check_range
from graphsynth.jamming.joints.program import Bearings, problem
from graphsynth.jamming.space.model import MODEL, SpaceModel, Unsupported, driven_at, in_space, start
from graphsynth.jamming.space.pose import REACHES, PoseProof, prove_pose
from graphsynth.jamming.verdict import Verdict

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]
#: Pieces of a full rotation at first, of any range at least; parts into which one is cut; half width of the
#: branch in unlimited turns and travels.
_FIRST, _FEWEST, _PARTS, _REACH = 96, 4, 3, 0.03
#: Boxes into which the unknowns at a single input are cut.
_BOXES = 300


class _Piece(NamedTuple):
    """A piece of the input and what is proved about it."""

    low: float
    high: float
    proof: PoseProof


def certify_in_space(
    motion: Motion,
    bearings: Bearings,
    tilts: Misalignment | Iterable[Misalignment],
    *,
    condition: Condition = "A",
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
    begin = perf_counter()
    check_range(motion, resolution=resolution, max_pieces=max_pieces, seconds=seconds)
    given = problem(motion.mechanism, bearings, tilts, condition)
    try:
        model = in_space(given)
    except Unsupported as error:
        ends = motion.inputs[motion.assembled]
        nothing = _columns([_Piece(float(ends.min()), float(ends.max()), PoseProof.unknown(str(error)))])
        return TurnCertificate(
            Verdict.UNDECIDED, str(error), *nothing, False, None, 0, perf_counter() - begin, model=MODEL
        )
    work = _Work(model, motion)
    pieces, stopped = work.search(resolution, max_pieces, begin + seconds)
    verdict, reason = _verdict(motion, pieces, stopped)
    spent = perf_counter() - begin
    return TurnCertificate(verdict, reason, *_columns(pieces), False, None, work.evaluated, spent, model=MODEL)


class _Work:
    """Proofs for pieces of the input along one motion."""

    def __init__(self, model: SpaceModel, motion: Motion) -> None:
        self.model, self.motion = model, motion
        keep = np.flatnonzero(motion.assembled)
        ends = motion.inputs[keep]
        self.low, self.high = float(ends.min()), float(ends.max())
        self.start = motion.poses[keep[int(np.argmin(ends))]]
        self.evaluated = 0

    def search(self, resolution: float, most: int, end: float) -> tuple[list[_Piece], str]:
        """Cut the range until every piece is decided or too narrow; say what stopped the work."""
        count = int(np.clip(math.ceil(_FIRST * (self.high - self.low) / math.tau), _FEWEST, _FIRST))
        edges = np.linspace(self.low, self.high, count + 1).tolist()
        waiting, done, stopped = list(pairwise(edges)), [], ""
        peak: _Piece | None = None
        while waiting:
            fits = self.evaluated + len(waiting) <= most and perf_counter() < end
            if not fits:
                stopped = f"the limit of work was reached after {self.evaluated} pieces"
                unknown = PoseProof.unknown(stopped)
                done += [_Piece(a, b, unknown) for a, b in waiting]
                break
            pieces = self._round(waiting, end)
            if not done and peak is None:
                peak = self._peak(pieces)
            again = [p for p in pieces if p.proof.state == 0 and p.high - p.low > resolution * (self.high - self.low)]
            done += [p for p in pieces if p not in again]
            waiting = [part for piece in again for part in _cut(piece)]
        if peak is not None:
            done = _split(done, peak)
        return sorted(done, key=lambda piece: (piece.low, piece.high)), stopped

    def _peak(self, pieces: list[_Piece]) -> _Piece | None:
        """Try to prove that it binds in the middle of the undecided piece with the largest factor."""
        left = [p for p in pieces if p.proof.state == 0 and p.proof.scale > 1.0]
        if not left or any(p.proof.state < 0 for p in pieces):
            return None
        top = max(left, key=lambda piece: piece.proof.scale)
        u = 0.5 * (top.low + top.high)
        single = self._round([(u, u)], math.inf, _BOXES)[0]
        return single if single.proof.state < 0 else None

    def _round(self, spans: list[tuple[float, float]], end: float, boxes: int = 0) -> list[_Piece]:
        """Prove what can be proved about pieces of the input."""
        from graphsynth.kinematics.simulation import simulate

        low, high = np.array(spans).T
        middle = 0.5 * (low + high)
        passed, back = np.unique(np.concatenate([[self.low], middle]), return_inverse=True)
        found = simulate(self.motion.mechanism, passed, start=self.start, events=False)
        given = driven_at(self.model, self.motion.mechanism, Interval.from_bounds(low, high))
        pieces = []
        for k, (a, b) in enumerate(spans):
            at = int(back[k + 1])
            if not found.assembled[at] or perf_counter() > end:
                why = "the time was up" if found.assembled[at] else "the plane mechanism is not assembled"
                pieces.append(_Piece(a, b, PoseProof.unknown(why)))
                continue
            q = start(self.model, self.motion.mechanism, found.poses[at])
            q[self.model.size :] = given.mid[k]
            self.evaluated += 1
            reaches = REACHES if boxes else (_REACH,)
            pieces.append(
                _Piece(
                    a,
                    b,
                    prove_pose(self.model, q, given=given.rad[k], boxes=boxes, reaches=reaches),
                )
            )
        return pieces


def _split(pieces: list[_Piece], single: _Piece) -> list[_Piece]:
    """Put a single input between the two parts of the undecided piece that holds it."""
    at = next((p for p in pieces if p.proof.state == 0 and p.low < single.low < p.high), None)
    if at is None:
        return pieces
    parts = [at._replace(high=single.low), single, at._replace(low=single.low)]
    return [p for p in pieces if p is not at] + parts


def _cut(piece: _Piece) -> list[tuple[float, float]]:
    """Equal parts of a piece, which share their ends."""
    width = piece.high - piece.low
    edges = [piece.low, *(piece.low + width * k / _PARTS for k in range(1, _PARTS)), piece.high]
    return list(pairwise(edges))


def _columns(pieces: list[_Piece]) -> tuple[Array, Array, NDArray[np.int8], Array, Array]:
    """Return ends, states and bounds of the factor."""
    low, high = np.array([[p.low, p.high] for p in pieces]).T
    state = np.array([p.proof.state for p in pieces], dtype=np.int8)
    return low, high, state, np.where(state == -1, 1.0, 0.0), np.where(state == 1, 1.0, math.inf)


def _verdict(motion: Motion, pieces: list[_Piece], stopped: str) -> tuple[Verdict, str]:
    """Return what the pieces prove together, and one sentence on it."""
    width = np.array([p.high - p.low for p in pieces])
    state = np.array([p.proof.state for p in pieces])
    binding, undecided = (float(width[state == s].sum() / width.sum()) for s in (-1, 0))
    left = next((p for p in pieces if p.proof.state == 0), None)
    why = "" if left is None else f"near the input {left.low:.9g}: {stopped or left.proof.reason}"
    if binding == 0.0 and (state == -1).any():
        u = pieces[int(np.argmin(state))].low
        return Verdict.CERTIFIED_JAMMED, f"binds at the input {u!r}, proved with exact closure in space; else {why}"
    if binding > 0.0:
        part = "the whole range" if (state == -1).all() else f"{100.0 * binding:.3g} % of the range"
        rest = f"; undecided over {undecided:.3g} of it, {why}" if why else ""
        return Verdict.CERTIFIED_JAMMED, f"binds over {part}, proved with exact closure in space{rest}"
    if why:
        return Verdict.UNDECIDED, f"undecided over {undecided:.3g} of the range, {why}"
    if not motion.completed:
        return Verdict.UNDECIDED, f"free as far as the motion goes, proved; it ends: {motion.reason}"
    return (
        Verdict.CERTIFIED_FREE,
        f"free over the whole range, proved with exact closure in space, {len(pieces)} pieces",
    )
