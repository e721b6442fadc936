"""Pavings over wide parameter boxes: the parameters are cut into cells until each cell is decided.

A status holds for every parameter value at once, so a wide parameter box often proves nothing although every single
value would.  Here the cells of a subdivision are paved one by one and their statuses combined: what holds in every cell
holds for every value.  Source: theory/interval-tests 2 (last rule) and 4, item 9.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from graphsynth.core.arguments import Budget, Positive
from graphsynth.core.errors import IntervalError
from graphsynth.intervals.boxes import Paving
from graphsynth.intervals.compiled import pave_compiled
from graphsynth.intervals.guard import check_rounding, checked
from graphsynth.intervals.interval import Interval, _make, interval
from graphsynth.intervals.paving import pave
from graphsynth.intervals.proving import System
from graphsynth.intervals.status import Status

#: A cell that is wide is not worth fine boxes: their widths, relative to the start box, next to that of the cell.
_COARSE = 0.4


@dataclass(frozen=True, eq=False)
class CellPaving:
    """Pavings of the cells of a parameter box.

    Attributes
    ----------
    cells : Interval, shape (C, m)
        Cells; together they are the whole parameter box.
    pavings : tuple of Paving
        One for each cell, each certified for all values of its cell.
    finished : bool
        False when a budget or the smallest cell ended the search; what is known holds all the same.
    tested, seconds : int, float
        Work done.
    """

    cells: Interval
    pavings: tuple[Paving, ...]
    finished: bool
    tested: int
    seconds: float

    @property
    def verdict(self) -> Status:
        """What is proved about the start box for every parameter value."""
        found = {paving.verdict for paving in self.pavings}
        if len(found) == 1:
            return found.pop()
        return Status.EXISTS if found == {Status.UNIQUE, Status.EXISTS} else Status.UNDECIDED

    @property
    def solutions(self) -> int | None:
        """Number of solutions, the same for every parameter value; None if that is not proved."""
        found = {paving.solutions for paving in self.pavings}
        return found.pop() if len(found) == 1 else None

    @property
    def undecided(self) -> Interval:
        """Cells in which boxes are left undecided, shape (K, m)."""
        return self.cells[np.array([not _settled(paving) for paving in self.pavings], dtype=np.bool_)]

    @property
    def outer(self) -> Interval:
        """Hull of all boxes, shape (n,): every solution lies in it, for every parameter value."""
        hull = self.pavings[0].outer
        for paving in self.pavings[1:]:
            hull = hull.hull(paving.outer)
        return hull


def _settled(paving: Paving) -> bool:
    return paving.finished and not bool((paving.status == Status.UNDECIDED).any())


@checked
def pave_cells(
    f: System, box: Any, parameters: Any, *, tolerance: Positive = 1e-6, smallest: Positive = 1e-3,
    cell_boxes: Budget = 200, max_boxes: Budget = 100_000, max_seconds: Budget = 60.0,
) -> CellPaving:  # fmt: skip
    """Find all solutions of ``f = 0`` in a box, cutting the parameters where a wide box of them proves nothing.

    Parameters
    ----------
    f, box : as for `krawczyk`; f may also be a `compiled_system`, which is faster by a factor of a hundred
    parameters : Interval or anything it takes, shape (m,)
        Bounded.
    tolerance : float
        As for `Search`.
    smallest : float
        Cells whose widths are all at most ``smallest`` times those of the parameter box are not cut further.
    cell_boxes : int
        Boxes tested in one cell before it is cut (exceeded by at most one batch).
    max_boxes, max_seconds : int, float
        Budget of the whole; cells not treated are then undecided, with the boxes of the cell they come from.

    Returns
    -------
    CellPaving
        Certified.

    Raises
    ------
    IntervalError
        For parameters that are no vector of bounded intervals, and whatever `Search` refuses.

    Examples
    --------
    >>> f = lambda x, p: [x[0] ** 2 - p[0]]
    >>> wide = pave_cells(f, ["[0.1, 10]"], ["[1, 50]"])
    >>> wide.verdict.name, wide.solutions, wide.finished
    ('UNIQUE', 1, True)
    """
    check_rounding()
    p, start = interval(parameters), interval(box)
    if p.ndim != 1 or p.size == 0 or not p.is_bounded.all():
        raise IntervalError(
            f"the parameters {p!r} are not a vector of bounded intervals; give finite bounds, shape (m,)"
        )
    begin, tested, finished = perf_counter(), 0, True
    scale = np.where(start.width > 0.0, start.width, 1.0).tolist()
    widths = np.where(p.width > 0.0, p.width, 1.0)
    waiting: deque[tuple[Interval, Interval, Paving | None]] = deque([(p, start, None)])
    done: list[tuple[Interval, Paving]] = []
    while waiting:
        cell, inside, before = waiting.popleft()
        left = max_seconds - (perf_counter() - begin)
        if before is not None and (tested >= max_boxes or left <= 0.0):
            done.append((cell, _unproved(before)))
            finished = False
            continue
        sides = cell.width / widths
        wide = float(sides.max())
        fine = max(tolerance, _COARSE * wide) if wide > smallest else tolerance
        options: dict[str, Any] = {"tolerance": fine, "scale": scale, "max_boxes": min(cell_boxes, max_boxes)}
        found = _paved(f, inside, cell, options | {"max_seconds": max(left, 1e-9)})
        tested += found.tested
        if _settled(found):
            done.append((cell, found))
        elif wide <= smallest:
            done.append((cell, found))
            finished = False
        else:
            part = _around(found.outer, inside)
            waiting.extend((half, part, found) for half in _halves(cell, int(sides.argmax())))
    return CellPaving(
        Interval.stack([cell for cell, _ in done]), tuple(paving for _, paving in done), finished, tested,
        perf_counter() - begin,
    )  # fmt: skip


def _paved(f: Any, box: Interval, cell: Interval, options: dict[str, Any]) -> Paving:
    if hasattr(f, "nopython_signatures"):
        return pave_compiled(f, box, cell, **options)
    return pave(f, box, cell, batch=256, **options)


def _around(hull: Interval, inside: Interval) -> Interval:
    """Return the hull of all solutions, a little larger so that a proof has room, within the box it comes from."""
    grow = _make(-0.02, 0.02) * inside.width
    return (hull + grow).intersect(inside)


def _halves(cell: Interval, side: int) -> tuple[Interval, Interval]:
    lower, upper = cell.hi.copy(), cell.lo.copy()
    lower[side] = upper[side] = cell.mid[side]
    return _make(cell.lo, lower, cell.flags), _make(upper, cell.hi, cell.flags)


def _unproved(paving: Paving) -> Paving:
    """Carry the boxes of a paving over to a part of its cell: proofs stay proofs, and nothing is finished."""
    return Paving(paving.boxes, paving.status, paving.domains, paving.inner, False, 0, 0.0)
