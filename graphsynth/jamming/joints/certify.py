"""Proved verdicts over the range of a motion: pieces of the input, cut until each is decided.

A piece is free if the tilts found at its middle can be corrected to close every loop, inside the limits, for every
input, position and tolerance in it; it binds if the wrenches found at its middle prove so for all of them.  The
positions are proved by `graphsynth.jamming.assembly.positions`.  The search is that of the small-tilt model L1; the
verdict counts only pieces for which the terms of second order, which that model neglects, are proved not to change it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals.reading import shortened
from graphsynth.jamming.assembly.positions import Unsupported
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.joints.branch import of_the_motion
from graphsynth.jamming.joints.drawing import Tolerances, drawn
from graphsynth.jamming.joints.limits import Misalignment
from graphsynth.jamming.joints.pieces import Found, Work, check_range
from graphsynth.jamming.joints.program import Bearings, problem
from graphsynth.jamming.joints.search import Budget, MemberWitness, jamming_member, search, unclosed_member
from graphsynth.jamming.joints.walked import walked
from graphsynth.jamming.verdict import Verdict

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion


Array = NDArray[np.float64]
States = NDArray[np.int8]
Mask = NDArray[np.bool_]
#: What the verdict is about, for certificates and reports.
MODEL = (
    "L1 with exact tilts: the small-tilt closure (first order) with bounds of the terms of second order that it "
    "neglects; the factors are those of small tilts"
)


def states(pieces: Found) -> States:
    """+1 where with small tilts every member of the boxes is free, -1 where every one binds, 0 elsewhere."""
    return np.where(pieces.lower > 1.0, -1, np.where(pieces.upper < 1.0, 1, 0)).astype(np.int8)


def verdict_of(
    work: Work, pieces: Found, state: States, stopped: str, branch: bool, witness: MemberWitness | None
) -> tuple[Verdict, str]:
    """Return the strongest verdict that the pieces in these states prove, and one sentence on it."""
    width = pieces.hi - pieces.lo
    binding, undecided = (float(width[state == s].sum() / width.sum()) for s in (-1, 0))
    open_text = _why_open(pieces, state, stopped)
    if binding == 0.0 and (state == -1).any():
        u = float(pieces.lo[state == -1][0])
        return Verdict.CERTIFIED_JAMMED, f"binds at the input {u!r}, proved; around it undecided: {open_text}"
    if binding > 0.0:
        rest = f"; undecided over {undecided:.3g}: {open_text}" if undecided > 0.0 else ""
        part = "the whole range" if (state == -1).all() else f"{shortened(100.0 * binding, -1, 3)} % of the range"
        return Verdict.CERTIFIED_JAMMED, f"binds over {part}, proved{rest}"
    if witness is not None:
        return Verdict.CERTIFIED_JAMMED_FOR_SOME, witness.sentence
    if undecided == 1.0:
        return Verdict.UNDECIDED, f"nothing is proved: {open_text}"
    if undecided > 0.0:
        return Verdict.UNDECIDED, f"{open_text} over {undecided:.3g} of the range, the rest is proved free"
    if not work.motion.completed:
        return Verdict.UNDECIDED, f"free as far as the motion goes, proved; it ends: {work.motion.reason}"
    if not branch:
        return Verdict.UNDECIDED, "every piece is free, but the pieces are not proved to be one branch"
    return Verdict.CERTIFIED_FREE, f"free over the whole range, proved in {work.evaluated} pieces"


def _why_open(pieces: Found, state: States, stopped: str) -> str:
    left = state == 0
    if not left.any():
        return ""
    if stopped:
        return stopped
    lost = left & ~pieces.proved
    if lost.any():
        u = float(pieces.lo[lost][0])
        return f"the positions are not proved near the input {u:.9g} (a singularity, or two modes that nearly meet)"
    near, texts = left & (states(pieces) != 0), []
    if near.any():
        at = int(np.flatnonzero(near)[np.argmin(np.maximum(pieces.lower[near] - 1.0, 1.0 - pieces.upper[near]))])
        side = "binds" if pieces.lower[at] > 1.0 else "is free"
        texts.append(
            f"near the input {pieces.lo[at]:.9g} it {side} with small tilts (first order), but the terms of second "
            "order that they neglect may change that"
        )
    rest = np.flatnonzero(left & ~near)
    if rest.size:
        worst = int(rest[np.argmax(pieces.upper[rest] - pieces.lower[rest])])
        below, above = shortened(float(pieces.lower[worst]), -1, 9), shortened(float(pieces.upper[worst]), 1, 9)
        texts.append(
            f"the factor lies between {below} and {above} near the input {pieces.lo[worst]:.9g}: "
            "it passes 1, touches 1, or some members of the tolerance boxes bind and some do not"
        )
    return "; ".join(texts)


@dataclass(frozen=True, eq=False)
class TurnCertificate:
    """What is proved about the range of inputs (certified: rounding, positions, tolerances and exact tilts included).

    Attributes
    ----------
    verdict, reason : Verdict, str
        CERTIFIED_FREE: no jam at any input of the range (between the samples too), for any value in the tolerance
        boxes.  CERTIFIED_JAMMED: at every input of the pieces marked so it binds, for every value in the boxes.
        CERTIFIED_JAMMED_FOR_SOME: the member ``witness`` of the boxes binds.  UNDECIDED otherwise, also where small
        tilts would decide but the terms of second order that they neglect may change it.
    low, high, state : ndarray, shape (pieces,)
        Pieces of the input, ascending; +1 free, -1 jammed, 0 undecided, with exact tilts.
    lower, upper : ndarray, shape (pieces,)
        Proved bounds of the factor on limits and plays together (the inverse of the allowed scale), in the small-tilt
        model (first order), which neglects terms of second order; ``small_tilts`` is the verdict in that model.
    decided : float
        Share of all inputs and dimensions together (by volume of the boxes) for which free or jammed is proved.
    one_branch : bool
        All pieces are proved to belong to one continuous branch; with exact closure in space: one continuous motion
        of every member is proved to lead through the whole range within all limits.
    """

    verdict: Verdict
    reason: str
    low: Array
    high: Array
    state: NDArray[np.int8]
    lower: Array
    upper: Array
    one_branch: bool
    witness: MemberWitness | None
    evaluated: int
    seconds: float
    small_tilts: Verdict = Verdict.UNDECIDED
    model: str = MODEL
    decided: float = 0.0

    @property
    def certified(self) -> bool:
        """Whether the verdict is proved."""
        return self.verdict.is_certified

    def arcs(self, state: int) -> list[tuple[float, float]]:
        """Ranges of the input of one state (+1 free, -1 jammed, 0 undecided), neighbours joined."""
        found: list[tuple[float, float]] = []
        for a, b in zip(self.low[self.state == state].tolist(), self.high[self.state == state].tolist()):
            if found and found[-1][1] == a:
                found[-1] = (found[-1][0], b)
            else:
                found.append((a, b))
        return found

    def share(self, state: int) -> float:
        """Part of the range in one state."""
        width = self.high - self.low
        return float(width[self.state == state].sum() / width.sum()) if width.size else 0.0

    def summary(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "verdict": self.verdict.name,
            "reason": self.reason,
            "model": self.model,
            "small_tilts": self.small_tilts.name,
            "free": self.arcs(1),
            "jammed": self.arcs(-1),
            "undecided": self.arcs(0),
            "decided": self.decided,
            "one_branch": self.one_branch,
            "witness": None if self.witness is None else self.witness.summary(),
            "evaluated": self.evaluated,
            "seconds": self.seconds,
        }

    def to_pandas(self) -> Any:
        """Return a table of the pieces."""
        import pandas as pd

        columns = {name: getattr(self, name) for name in ("low", "high", "state", "lower", "upper")}
        return pd.DataFrame(columns)


def certify_coupled(
    motion: Motion,
    bearings: Bearings | None,
    tilts: Misalignment | Iterable[Misalignment],
    *,
    condition: Condition = "A",
    tolerances: Tolerances = 0.0,
    resolution: float = 1e-4,
    max_pieces: int = 20_000,
    seconds: float = 20.0,
) -> TurnCertificate:
    """Prove where a mechanism is free and where it binds, between the first and the last input of a motion.

    See theory/joints-that-share-a-tilt 4, 5 and theory/jam-arcs 5.

    Parameters
    ----------
    motion : Motion
        Of `graphsynth.simulate`; its branch is followed, its samples need not be dense.  No cams.
    bearings, tilts, condition
        As for `graphsynth.jamming.joints.assess_coupled`; the ranges they carry are tolerance boxes, and the verdict
        holds for every value in them.
    tolerances : float or iterable of PartTolerance
        Relative half width of every coordinate of a joint on its links; or tolerances of parts, as on a drawing
        (`graphsynth.tolerances`).
    resolution : float
        Width of a piece, over the range, below which it is left undecided.
    max_pieces, seconds : optional
        Limits of the work; what is not decided within them stays undecided.  A binding member is sought after it.

    Returns
    -------
    TurnCertificate
        Certified, with exact tilts; UNDECIDED with a reason rather than a guess.  `GeometryError` for limits or
        misalignments that do not fit the mechanism, and fewer than two assembled samples.

    Examples
    --------
    >>> from graphsynth import Mechanism
    >>> from graphsynth.jamming import Bearing
    >>> motion = Mechanism.four_bar(2, 1, 2.5, 2.5).simulate(np.linspace(0.0, 2.0 * np.pi, 37))
    >>> certify_coupled(motion, Bearing(), Misalignment(0, 1, 0.0115)).verdict.name
    'CERTIFIED_FREE'
    """
    begin = perf_counter()
    check_range(motion, resolution=resolution, max_pieces=max_pieces, seconds=seconds)
    limits, axes, box = drawn(motion.mechanism, bearings, tilts, tolerances)
    given = problem(motion.mechanism, limits, axes, condition)
    try:
        work = Work(given, motion, box)
        budget = Budget(resolution * (work.high - work.low), max_pieces, seconds, begin)
        if (pieces := walked(work, resolution, max_pieces, seconds)) is not None:
            return _told(work, budget, pieces, "", pieces.proved, True)
        return _proved(work, budget, *search(work, budget))
    except Unsupported as error:
        ends, zero = motion.inputs[motion.assembled], np.zeros(1)
        columns = ends.min(keepdims=True), ends.max(keepdims=True), zero.astype(np.int8), zero, zero + np.inf
        seconds = perf_counter() - begin
        return TurnCertificate(Verdict.UNDECIDED, str(error), *columns, False, None, 0, seconds)


def _proved(work: Work, budget: Budget, pieces: Found, stopped: str) -> TurnCertificate:
    """Keep what is proved to be on the branch of the motion; give the verdict."""
    own, branch = of_the_motion(work, pieces)
    lost = np.flatnonzero(pieces.proved & ~own)
    # of another branch, perhaps: nothing is said about the motion
    pieces = pieces._replace(
        lower=np.where(own, pieces.lower, 0.0),
        upper=np.where(own, pieces.upper, np.inf),
        sure=np.where(own, pieces.sure, 0).astype(np.int8),
    )
    if lost.size and not stopped:
        stopped = (
            f"the pose near the input {float(pieces.lo[lost[0]])!r} is not proved to be on the branch of the motion"
        )
    return _told(work, budget, pieces, stopped, own, branch)


def _told(work: Work, budget: Budget, pieces: Found, stopped: str, own: Mask, branch: bool) -> TurnCertificate:
    """Return the certificate of pieces, of which ``own`` are of the motion and ``branch`` says that all are one."""
    shown = pieces.by_input()
    state = shown.sure
    witness = None if (state == -1).any() or (state == 1).all() else jamming_member(work, pieces, own)
    proved = witness if witness is not None and witness.exact else None
    verdict, reason = verdict_of(work, shown, state, stopped, branch, proved)
    small, first_order = verdict_of(work, shown, states(shown), stopped, branch, witness)
    if small.is_certified and small is not verdict:
        reason = f"{reason}; with small tilts (first order): {first_order}"
    shares = {s: float(pieces.volume[pieces.sure == s].sum()) for s in (1, -1, 0)}
    if work.box.size and verdict is not Verdict.CERTIFIED_FREE:
        reason = "; ".join(filter(None, (reason, unclosed_member(work, pieces), _shares_told(shares))))
    columns, seconds = (shown.lo, shown.hi, state, shown.lower, shown.upper), perf_counter() - budget.begin
    found = TurnCertificate(verdict, reason, *columns, branch, witness, work.evaluated, seconds, small)
    return replace(found, decided=1.0 - shares[0])


def _shares_told(shares: dict[int, float]) -> str:
    """Say how much of the inputs and dimensions together is decided, rounded so that no share is promised too high."""
    free, binds = (f"{shortened(100.0 * shares[s], -1, 3)} %" for s in (1, -1))
    return f"of all inputs and dimensions together {free} are proved free and {binds} are proved to bind"
