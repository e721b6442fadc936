"""What a paving is: the boxes that a search has kept, and what is proved about them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals.interval import Interval, _make
from graphsynth.intervals.status import Status

Mask = NDArray[np.bool_]


class Progress(NamedTuple):
    """State of a search after a batch."""

    tested: int
    waiting: int
    kept: int
    seconds: float


@dataclass(frozen=True, eq=False)
class Paving:
    """Boxes that hold every solution of the start box.

    Attributes
    ----------
    boxes : Interval, shape (M, n)
        Kept boxes; together they hold every solution for every parameter value (certified).
    status : ndarray of int8, shape (M,)
        ``UNIQUE`` or ``EXISTS``: proved about the matching row of ``domains``, the solutions lying in ``boxes``;
        ``UNDECIDED``: a box at the limit of the resolution, inner, or not treated when the budget ended.
    domains : Interval, shape (M, n)
        For ``UNIQUE`` the boxes in which the solution is the only one.
    inner : ndarray of bool, shape (M,)
        Boxes of which every point is a solution for some parameter value.
    finished : bool
        False when a budget ended the search; the boxes then still hold every solution.
    tested, seconds : int, float
        Work done.
    """

    boxes: Interval
    status: NDArray[np.int8]
    domains: Interval
    inner: Mask
    finished: bool
    tested: int
    seconds: float

    @property
    def outer(self) -> Interval:
        """Hull of all boxes, shape (n,): every solution lies in it."""
        n = self.boxes.shape[1]
        if len(self.status) == 0:
            return Interval.empty(n)
        return _make(self.boxes.lo.min(axis=0), self.boxes.hi.max(axis=0))

    @property
    def inside(self) -> Interval:
        """Hull of the inner boxes, shape (n,): its extreme faces are touched by solutions; empty if there are none."""
        n = self.boxes.shape[1]
        if not self.inner.any():
            return Interval.empty(n)
        return _make(self.boxes.lo[self.inner].min(axis=0), self.boxes.hi[self.inner].max(axis=0))

    @property
    def verdict(self) -> Status:
        """What is proved about the start box as a whole, for all parameter values at once."""
        if len(self.status) == 0:
            return Status.EMPTY
        proved = (self.status == Status.UNIQUE) | (self.status == Status.EXISTS)
        if len(self.status) == 1 and self.status[0] == Status.UNIQUE:
            return Status.UNIQUE
        return Status.EXISTS if proved.any() else Status.UNDECIDED

    @property
    def solutions(self) -> int | None:
        """Number of solutions in the start box, for every parameter value; None if that is not proved."""
        if not self.finished or not (self.status == Status.UNIQUE).all():
            return None
        lo, hi = self.boxes.lo, self.boxes.hi
        for k in range(len(lo) - 1):  # enclosures with a common point might hold one solution twice
            if ((lo[k + 1 :] <= hi[k]) & (lo[k] <= hi[k + 1 :])).all(axis=1).any():
                return None
        return len(lo)
