"""What is proved about boxes: the status of one, and a paving, the boxes that a search has kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import IntervalError
from graphsynth.intervals.interval import Interval, _make, interval
from graphsynth.intervals.operations import Array, Mask


class Status(IntEnum):
    """What is proved about a box X, for all parameter values at once (theory/interval-tests 1).

    With K the Krawczyk image of X:

    ========= ===================================================== =========================================
    member    meaning                                               proof
    ========= ===================================================== =========================================
    EMPTY     no solution in X                                      0 not in F(X), or X and K disjoint
    UNIQUE    exactly one solution in X for every parameter value   K in the interior of X
    EXISTS    at least one solution in X for every parameter value  K in X, preconditioner proved nonsingular
    UNDECIDED nothing proved                                        otherwise; an overlap proves nothing
    ========= ===================================================== =========================================
    """

    EMPTY = 0
    UNIQUE = 1
    EXISTS = 2
    UNDECIDED = 3

    @property
    def proves_existence(self) -> bool:
        """Whether a solution is certain."""
        return self in (Status.UNIQUE, Status.EXISTS)


class PavingProgress(NamedTuple):
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
        return _make(self.boxes.lo.min(axis=0, initial=np.inf), self.boxes.hi.max(axis=0, initial=-np.inf))

    @property
    def inside(self) -> Interval:
        """Hull of the inner boxes, shape (n,): its extreme faces are touched by solutions; empty if there are none."""
        own = self.boxes[self.inner]
        return _make(own.lo.min(axis=0, initial=np.inf), own.hi.max(axis=0, initial=-np.inf))

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


def bounded(name: str, values: Any) -> Interval:
    """Read a vector of bounded intervals; `IntervalError` for anything else."""
    found = interval(values)
    if found.ndim != 1 or found.size == 0 or not found.is_bounded.all():
        raise IntervalError(f"{name} = {found!r} is empty, unbounded or no vector; give finite bounds, shape (n,)")
    return found


def posed(box: Any, tolerance: float | Sequence[float]) -> tuple[Interval, Array]:
    """Read a start box, and the widths at which boxes are not cut further: a part of its own, or one for each unknown.

    `IntervalError` for widths that are not as many positive numbers.
    """
    start = bounded("box", box)
    if isinstance(tolerance, int | float | np.number):
        return start, tolerance * np.where(start.width > 0.0, start.width, 1.0)
    widths = np.array(tolerance, dtype=np.float64)
    if widths.shape != start.shape or not (np.isfinite(widths) & (widths > 0.0)).all():
        raise IntervalError(f"tolerance {tolerance!r} must be one number, or {start.size} positive widths")
    return start, widths
