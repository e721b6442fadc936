"""Verdict and reason of a range of inputs, from what is proved about its pieces; by small tilts and by exact ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals.reading import shortened
from graphsynth.jamming.joints.pieces import Found, Work
from graphsynth.jamming.joints.witness import Witness
from graphsynth.jamming.verdict import Verdict

__all__ = ["MODEL", "judge", "states"]

States = NDArray[np.int8]
Mask = NDArray[np.bool_]

#: What the verdict is about, for certificates and reports.
MODEL = (
    "L1 with exact tilts: the small-tilt closure (first order) with bounds of the terms of second order that it "
    "neglects; the factors are those of small tilts"
)


def states(pieces: Found) -> States:
    """+1 where with small tilts every member of the boxes is free, -1 where every one jams, 0 elsewhere."""
    return np.where(pieces.lower > 1.0, -1, np.where(pieces.upper < 1.0, 1, 0)).astype(np.int8)


def judge(
    work: Work, pieces: Found, state: States, stopped: str, branch: bool, witness: Witness | None
) -> tuple[Verdict, str]:
    """Return the strongest verdict that the pieces in these states prove, and one sentence on it."""
    width = pieces.hi - pieces.lo
    share = [float(width[state == s].sum() / width.sum()) for s in (-1, 0, 1)]
    open_text = _why_open(pieces, state, stopped)
    if share[0] == 0.0 and (state == -1).any():
        u = float(pieces.lo[state == -1][0])
        return Verdict.CERTIFIED_JAMMED, f"jams at the input {u!r}, proved; around it undecided: {open_text}"
    if share[0] > 0.0:
        rest = f"; undecided over {share[1]:.3g}: {open_text}" if share[1] > 0.0 else ""
        return Verdict.CERTIFIED_JAMMED, f"jams over {shortened(share[0], -1)} of the range, proved{rest}"
    if witness is not None:
        return Verdict.CERTIFIED_JAMMED_FOR_SOME, witness.sentence
    if share[1] > 0.0:
        if share[1] == 1.0:
            return Verdict.UNDECIDED, f"nothing is proved: {open_text}"
        return Verdict.UNDECIDED, f"{open_text} over {share[1]:.3g} of the range, the rest is proved free"
    if not work.motion.completed:
        return Verdict.UNDECIDED, f"free as far as the motion goes, proved; it ends: {work.motion.reason}"
    if not branch:
        return Verdict.UNDECIDED, "every piece is free, but the pieces are not proved to be one branch"
    return Verdict.CERTIFIED_FREE, f"free over the whole range, proved in {work.evaluated} pieces"


def _why_open(pieces: Found, state: States, stopped: str) -> str:
    left = state == 0
    if not left.any():
        return ""
    lost = left & ~pieces.proved
    near = left & (states(pieces) != 0)
    if stopped:
        return stopped
    if lost.any():
        u = float(pieces.lo[lost][0])
        return f"the positions are not proved near the input {u:.9g} (a singularity, or two modes that nearly meet)"
    if near.any():
        at = int(np.flatnonzero(near)[np.argmin(np.maximum(pieces.lower[near] - 1.0, 1.0 - pieces.upper[near]))])
        side = "jams" if pieces.lower[at] > 1.0 else "is free"
        text = (
            f"near the input {pieces.lo[at]:.9g} it {side} with small tilts (first order), but the terms of second "
            "order that they neglect may change that"
        )
        return text if (near == left).all() else f"{text}; {_widest(pieces, left & ~near)}"
    return _widest(pieces, left)


def _widest(pieces: Found, left: Mask) -> str:
    worst = int(np.flatnonzero(left)[np.argmax(pieces.upper[left] - pieces.lower[left])])
    below, above = shortened(float(pieces.lower[worst]), -1, 9), shortened(float(pieces.upper[worst]), 1, 9)
    return (
        f"the factor lies between {below} and {above} near the input "
        f"{pieces.lo[worst]:.9g}: a crossing, a touch, or tolerances of which some jam and some do not"
    )
