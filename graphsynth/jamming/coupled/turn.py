"""Proved verdicts over the range of a motion: pieces of the input, cut until each is decided.

A piece is free if the tilts found at its middle can be corrected to close every loop, inside the limits, for every
input, position and tolerance in it; it jams if the wrenches found at its middle prove so for all of them.  The
positions are proved by `graphsynth.jamming.coupled.tubes`.  Statements are about the small-tilt model L1.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals.reading import shortened
from graphsynth.jamming.bearing import Condition
from graphsynth.jamming.coupled.limits import Misalignment
from graphsynth.jamming.coupled.pieces import Found, Work, check_range, cut
from graphsynth.jamming.coupled.positions import Unsupported
from graphsynth.jamming.coupled.problem import Bearings, problem
from graphsynth.jamming.verdict import Verdict

if TYPE_CHECKING:
    from graphsynth.kinematics.simulation import Motion

__all__ = ["TurnCertificate", "certify_coupled"]

Array = NDArray[np.float64]

_PEAKS = 4


@dataclass(frozen=True, eq=False)
class TurnCertificate:
    """What is proved about the range of inputs (certified: rounding, positions and tolerances included).

    Attributes
    ----------
    verdict : Verdict
        CERTIFIED_FREE: no jam at any input, for any value in the tolerance boxes.  CERTIFIED_JAMMED: at every input of
        the pieces marked so it jams, for every value in the boxes.  UNDECIDED otherwise.
    reason : str
    low, high : ndarray, shape (pieces,)
        Pieces of the input, ascending.
    state : ndarray of int8, shape (pieces,)
        +1 free, -1 jammed, 0 undecided.
    lower, upper : ndarray, shape (pieces,)
        Proved bounds of the factor on limits and plays together (the inverse of the allowed scale).
    one_branch : bool
        All pieces are proved to belong to one continuous branch.
    evaluated : int
        Pieces evaluated.
    seconds : float
    """

    verdict: Verdict
    reason: str
    low: Array
    high: Array
    state: NDArray[np.int8]
    lower: Array
    upper: Array
    one_branch: bool
    evaluated: int
    seconds: float

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
            "free": self.arcs(1),
            "jammed": self.arcs(-1),
            "undecided": self.arcs(0),
            "one_branch": self.one_branch,
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
    bearings: Bearings,
    tilts: Misalignment | Iterable[Misalignment],
    *,
    condition: Condition = "A",
    length_tolerance: float = 0.0,
    resolution: float = 1e-4,
    max_pieces: int = 20_000,
    seconds: float = 20.0,
) -> TurnCertificate:
    """Prove where a mechanism is free and where it jams, between the first and the last input of a motion.

    Parameters
    ----------
    motion : Motion
        Of `graphsynth.simulate`; its branch is followed, its samples need not be dense.  No cams.
    bearings, tilts, condition
        As for `graphsynth.jamming.coupled.assess_coupled`; the ranges they carry are tolerance boxes, and the verdict
        holds for every value in them.
    length_tolerance : float
        Relative half width of every coordinate of a joint on its links.
    resolution : float
        Width of a piece, over the range, below which it is left undecided.
    max_pieces, seconds : optional
        Limits of the work; what is not decided within them stays undecided.

    Returns
    -------
    TurnCertificate
        Certified, in the small-tilt model; UNDECIDED with a reason rather than a guess.

    Raises
    ------
    GeometryError
        Limits or misalignments that do not fit the mechanism, fewer than two assembled samples.

    Notes
    -----
    Specification lambda_and_jamming, sections 9.4, 9.5 and 10.

    Examples
    --------
    >>> from graphsynth import Driver, Mechanism, MechanismGraph, Revolute, simulate
    >>> from graphsynth.jamming import Bearing
    >>> graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    >>> linkage = Mechanism(graph, [
    ...     Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (2.5, 0.0), (2.5, 0.0)),
    ...     Revolute(0, 3, (2.0, 0.0)),
    ... ], [Driver(0, 1)])
    >>> motion = simulate(linkage, np.linspace(0.0, 2.0 * np.pi, 37))
    >>> certify_coupled(motion, Bearing(), Misalignment(0, 1, 0.0115)).verdict.name
    'CERTIFIED_FREE'
    """
    begin = perf_counter()
    check_range(motion, length_tolerance, resolution=resolution, max_pieces=max_pieces, seconds=seconds)
    given = problem(motion.mechanism, bearings, tilts, condition)
    try:
        work = Work(given, motion, length_tolerance)
    except Unsupported as error:
        return _nothing(motion, str(error), perf_counter() - begin)
    parts: list[Found] = []
    lo, hi = work.first()
    stopped = ""
    smallest = resolution * (work.high - work.low)
    while lo.size:
        if work.evaluated + lo.size > max_pieces or perf_counter() - begin > seconds:
            stopped = f"the limit of work was reached after {work.evaluated} pieces"
            parts.append(_open(lo, hi, work.system.size))
            break
        try:
            found = work.evaluate(lo, hi)
        except Unsupported as error:
            return _nothing(motion, str(error), perf_counter() - begin)
        again = ~((found.lower > 1.0) | (found.upper < 1.0)) & (hi - lo > smallest)
        parts.append(found.take(~again))
        lo, hi = cut(lo[again], hi[again])
    pieces = Found.join(parts)
    if not (pieces.lower > 1.0).any() and not ((pieces.upper < 1.0) | ~pieces.proved).all():
        pieces = _with_peak(work, pieces)
    return _turn_certificate(work, pieces, stopped, begin)


def _with_peak(work: Work, pieces: Found) -> Found:
    """Look in undecided pieces for an input at which the jam can be proved; add it as a piece of no width."""
    left = np.flatnonzero((pieces.upper >= 1.0) & pieces.proved)
    left = left[np.argsort(-pieces.lower[left])][:_PEAKS]
    lo, hi = pieces.lo[left], pieces.hi[left]
    for _ in range(8):
        inputs = np.unique(lo[:, None] + (hi - lo)[:, None] * (np.arange(9) / 8.0))
        value = work.estimate(inputs)
        for k in range(len(lo)):
            own = np.flatnonzero((inputs >= lo[k]) & (inputs <= hi[k]))
            if own.size > 2:
                best = own[int(np.argmax(value[own]))]
                lo[k], hi[k] = inputs[max(best - 1, own[0])], inputs[min(best + 1, own[-1])]
    inputs = np.unique(np.concatenate([lo, 0.5 * (lo + hi), hi]))
    points = work.evaluate(inputs, inputs)
    jams = np.flatnonzero(points.lower > 1.0)
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
    return Found(lo, hi, none, none + np.inf, none > 1.0, box, box)


def _nothing(motion: Motion, reason: str, seconds: float) -> TurnCertificate:
    ends = motion.inputs[motion.assembled]
    low, high = np.array([ends.min()]), np.array([ends.max()])
    zero = np.zeros(1)
    return TurnCertificate(
        Verdict.UNDECIDED, reason, low, high, np.zeros(1, dtype=np.int8), zero, zero + np.inf, False, 0, seconds
    )


def _turn_certificate(work: Work, pieces: Found, stopped: str, begin: float) -> TurnCertificate:
    links = work.links(pieces)
    own = work.on_branch(pieces, links)
    branch = bool(own.all() and links.all())
    # of another branch, perhaps: nothing is said about the motion
    pieces = pieces._replace(lower=np.where(own, pieces.lower, 0.0), upper=np.where(own, pieces.upper, np.inf))
    state = np.where(pieces.lower > 1.0, -1, np.where(pieces.upper < 1.0, 1, 0)).astype(np.int8)
    lost = np.flatnonzero(pieces.proved & ~own)
    if lost.size and not stopped:
        stopped = (
            f"the pose near the input {float(pieces.lo[lost[0]])!r} is not proved to be on the branch of the motion"
        )
    verdict, reason = _judge(work, pieces, state, stopped, branch)
    return TurnCertificate(
        verdict, reason, pieces.lo, pieces.hi, state, pieces.lower, pieces.upper, branch, work.evaluated,
        perf_counter() - begin,
    )  # fmt: skip


def _judge(work: Work, pieces: Found, state: NDArray[np.int8], stopped: str, branch: bool) -> tuple[Verdict, str]:
    width = pieces.hi - pieces.lo
    share = [float(width[state == s].sum() / width.sum()) for s in (-1, 0, 1)]
    open_text = _why_open(pieces, state, stopped)
    if share[0] == 0.0 and (state == -1).any():
        u = float(pieces.lo[state == -1][0])
        return Verdict.CERTIFIED_JAMMED, f"jams at the input {u!r}, proved; around it undecided: {open_text}"
    if share[0] > 0.0:
        rest = f"; undecided over {share[1]:.3g}: {open_text}" if share[1] > 0.0 else ""
        return Verdict.CERTIFIED_JAMMED, f"jams over {shortened(share[0], -1)} of the range, proved{rest}"
    if share[1] > 0.0:
        if share[1] == 1.0:
            return Verdict.UNDECIDED, f"nothing is proved: {open_text}"
        return Verdict.UNDECIDED, f"{open_text} over {share[1]:.3g} of the range, the rest is proved free"
    if not work.motion.completed:
        return Verdict.UNDECIDED, f"free as far as the motion goes, proved; it ends: {work.motion.reason}"
    if not branch:
        return Verdict.UNDECIDED, "every piece is free, but the pieces are not proved to be one branch"
    return Verdict.CERTIFIED_FREE, f"free over the whole range, proved in {work.evaluated} pieces"


def _why_open(pieces: Found, state: NDArray[np.int8], stopped: str) -> str:
    left = state == 0
    if not left.any():
        return ""
    lost = left & ~pieces.proved
    if stopped:
        return stopped
    if lost.any():
        u = float(pieces.lo[lost][0])
        return f"the positions are not proved near the input {u:.9g} (a singularity, or two modes that nearly meet)"
    worst = int(np.flatnonzero(left)[np.argmax(pieces.upper[left] - pieces.lower[left])])
    below, above = shortened(float(pieces.lower[worst]), -1, 9), shortened(float(pieces.upper[worst]), 1, 9)
    return (
        f"the factor lies between {below} and {above} near the input "
        f"{pieces.lo[worst]:.9g}: a crossing, a touch, or tolerances of which some jam and some do not"
    )
