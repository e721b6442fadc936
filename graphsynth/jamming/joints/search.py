"""The search over the range of a motion: pieces are cut until each is decided or no cut can decide it."""

from __future__ import annotations

from time import perf_counter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.jamming.joints.pieces import Found, Work, cut

__all__ = ["Budget", "peak_inputs", "search"]

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
    """Cut the range until every piece is decided, too narrow, or cannot be decided; say what stopped the work.

    Raises
    ------
    Unsupported
        For a mechanism whose positions are not enclosed.
    """
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
        again = (_straddles(found) | _unsure(found)) & (hi - lo > budget.smallest)
        if not first and not budget.over:
            again &= ~_hopeless(work, found, again)
        first = False
        parts.append(found.take(~again))
        lo, hi = cut(lo[again], hi[again])
    pieces = Found.join(parts)
    if not (pieces.sure == -1).any() and not ((pieces.upper < 1.0) | ~pieces.proved).all():
        pieces = _with_peak(work, pieces)
    return pieces, stopped


def _straddles(found: Found) -> Mask:
    return np.asarray(~((found.lower > 1.0) | (found.upper < 1.0)))


def _unsure(found: Found) -> Mask:
    """Decided by small tilts, not by exact ones."""
    return np.asarray(~_straddles(found) & (found.sure == 0))


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
    same = np.where(_straddles(found)[rows], _straddles(at)[back].reshape(3, -1), _unsure(at)[back].reshape(3, -1))
    stuck[rows] = (at.proved[back].reshape(3, -1) & same).all(axis=0)
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
