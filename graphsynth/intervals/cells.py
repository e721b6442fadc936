"""Pavings of compiled systems, at a thousandth of the cost of a box, and pavings over wide parameter boxes.

A compiled system fills bounds of its equations and derivatives; see `compiled_system`.

A status holds for every parameter value at once, so a wide parameter box often proves nothing although every single
value would.  `pave_cells` cuts the parameters into cells until each cell is decided, and combines their statuses: what
holds in every cell holds for every value.  Source: theory/interval-tests 2 (last rule) and 4, item 9.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter
from typing import Any, Protocol

import numpy as np

from graphsynth.core.arguments import Budget, Positive
from graphsynth.core.errors import IntervalError
from graphsynth.intervals.boxes import Paving, Status, bounded, posed
from graphsynth.intervals.guard import check_rounding, checked
from graphsynth.intervals.interval import Interval, _make, interval
from graphsynth.intervals.paving import pave
from graphsynth.intervals.proving import System, read_parameters

#: Boxes between two looks at the clock; waiting and kept boxes for which there is room at first.
_AT_ONCE, _DEPTH, _KEPT = 100_000, 256, 64
#: A cell that is wide is not worth fine boxes: their widths, relative to the start box, next to that of the cell.
_COARSE = 0.4


class CompiledSystem(Protocol):
    """A system compiled by `compiled_system`."""

    @property
    def py_func(self) -> Callable[..., bool]:
        """The function as it is written."""

    def __call__(self, *bounds: Any) -> bool:
        """Write bounds of the equations, and of their derivatives."""


@checked
def compiled_system(function: Callable[..., bool]) -> CompiledSystem:
    """Compile a system for `pave_compiled`; a decorator.

    Parameters
    ----------
    function : callable
        ``function(xl, xh, pl, ph, fl, fh, jl, jh, derivatives) -> bool``: writes enclosures of the n equations into
        ``fl, fh`` (n,) and, if ``derivatives``, of the Jacobian into ``jl, jh`` (n, n), for unknowns ``xl, xh`` (n,)
        and parameters ``pl, ph`` (m,), with the scalar functions of ``graphsynth.intervals.kernels``; returns whether
        everything was defined and continuous on the whole box.  A system that writes wrong bounds proves nothing.

    Returns
    -------
    CompiledSystem
        A dispatcher of numba.
    """
    from graphsynth.intervals.kernels.krawczyk import system

    found: CompiledSystem = system(function)  # type: ignore[no-untyped-call]
    return found


@checked
def pave_compiled(
    system: CompiledSystem,
    box: Any,
    parameters: Any = None,
    *,
    tolerance: Positive | Sequence[float] = 1e-6,
    max_boxes: Budget = 1_000_000,
    max_seconds: Budget = 60.0,
) -> Paving:
    """Find all solutions of a compiled system in a box.

    Parameters
    ----------
    system : function decorated with `compiled_system`
    box : Interval or anything it takes, shape (n,)
        Start box, bounded.
    parameters : Interval or anything it takes, shape (m,), optional
    tolerance, max_boxes, max_seconds : as for `Search`; the clock is read every 100000 boxes

    Returns
    -------
    Paving
        Certified; the waiting boxes of a search that a budget ended are ``UNDECIDED``.

    Raises
    ------
    IntervalError
        For a box that is empty, unbounded or no vector, budgets and tolerances that are not positive, a system that
        is not compiled.

    Notes
    -----
    Depth first, with epsilon-inflation; the decisions are those of `pave`, the order of the boxes is another.  Source:
    theory/interval-tests 2.

    Examples
    --------
    >>> from graphsynth.intervals.kernels import arithmetic as ia
    >>> @compiled_system
    ... def root_of_two(xl, xh, pl, ph, fl, fh, jl, jh, derivatives):
    ...     low, high = ia.square(xl[0], xh[0])
    ...     fl[0], fh[0] = ia.subtract(low, high, 2.0, 2.0)
    ...     if derivatives:
    ...         jl[0, 0], jh[0, 0] = ia.scale(2.0, xl[0], xh[0])
    ...     return True
    >>> found = pave_compiled(root_of_two, ["[-4, 4]"])
    >>> [Status(s).name for s in found.status], found.finished
    (['UNIQUE', 'UNIQUE'], True)
    """
    check_rounding()
    if not hasattr(system, "py_func"):
        raise IntervalError(f"the system {system!r} is not compiled; decorate it with compiled_system")
    from graphsynth.intervals.kernels import krawczyk

    begin = perf_counter()
    start, widths = posed(box, tolerance)
    given = read_parameters(parameters)
    p = np.zeros((2, 0)) if given is None else np.array([given.lo, given.hi])
    n = start.size
    stack, kept, domains = np.empty((_DEPTH, 2, n)), np.empty((_KEPT, 2, n)), np.empty((_KEPT, 2, n))
    status, state = np.empty(_KEPT, dtype=np.int8), np.array([1, 0, 0, 0])
    stack[0] = start_box = np.array([start.lo, start.hi])
    while True:
        limit = min(max_boxes, int(state[krawczyk.TESTED]) + _AT_ONCE)
        outcome = krawczyk.pave(system, start_box, p, widths, stack, kept, domains, status, state, limit)
        if outcome == krawczyk.ROOM:
            stack, kept, domains, status = (
                np.concatenate([a, np.empty_like(a)]) for a in (stack, kept, domains, status)
            )
        elif outcome == krawczyk.DONE or state[krawczyk.TESTED] >= max_boxes or perf_counter() - begin >= max_seconds:
            break
    waiting, count, tested, _ = state.tolist()
    boxes, own = (np.concatenate([part[:count], stack[:waiting]]) for part in (kept, domains))
    found = np.concatenate([status[:count], np.full(waiting, Status.UNDECIDED, dtype=np.int8)])
    stays = np.ones(len(found), dtype=np.bool_)
    for low, high in own[found == Status.UNIQUE]:  # it stands for undecided boxes in its domain: they are left out
        stays &= ~((boxes[:, 0] >= low) & (boxes[:, 1] <= high)).all(axis=1) | (found == Status.UNIQUE)
    lo, hi, dlo, dhi = (part[stays, side] for part in (boxes, own) for side in (0, 1))
    inner, seconds = np.zeros(len(lo), dtype=np.bool_), perf_counter() - begin
    return Paving(_make(lo, hi), found[stays], _make(dlo, dhi), inner, waiting == 0, tested, seconds)


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
    f: System,
    box: Any,
    parameters: Any,
    *,
    tolerance: Positive = 1e-6,
    smallest: Positive = 1e-3,
    cell_boxes: Budget = 200,
    max_boxes: Budget = 100_000,
    max_seconds: Budget = 60.0,
) -> CellPaving:
    """Find all solutions of ``f = 0`` in a box, cutting the parameters where a wide box of them proves nothing.

    Parameters
    ----------
    f, box : as for `krawczyk`; f may also be a `compiled_system`, which is faster by a factor of a hundred
    parameters : Interval or anything it takes, shape (m,)
        Bounded.
    tolerance : as for `Search`
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
    p, start = bounded("parameters", parameters), interval(box)
    begin, tested, finished = perf_counter(), 0, True
    scale = np.where(start.width > 0.0, start.width, 1.0)
    widths = np.where(p.width > 0.0, p.width, 1.0)
    paved: Any = pave_compiled if hasattr(f, "nopython_signatures") else partial(pave, batch=256)
    waiting: deque[tuple[Interval, Interval, Paving | None]] = deque([(p, start, None)])
    done: list[tuple[Interval, Paving]] = []
    while waiting:
        cell, inside, before = waiting.popleft()
        left = max_seconds - (perf_counter() - begin)
        if before is not None and (tested >= max_boxes or left <= 0.0):
            done.append((cell, replace(before, finished=False, tested=0, seconds=0.0)))  # proofs stay proofs
            finished = False
            continue
        sides = cell.width / widths
        wide = float(sides.max())
        fine = max(tolerance, _COARSE * wide) if wide > smallest else tolerance
        limits = {"max_boxes": min(cell_boxes, max_boxes), "max_seconds": max(left, 1e-9)}
        found = paved(f, inside, cell, tolerance=(fine * scale).tolist(), **limits)
        tested += found.tested
        if _settled(found) or wide <= smallest:
            done.append((cell, found))
            finished = finished and _settled(found)
        else:
            # the hull of all solutions, a little larger so that a proof has room, within the box it comes from
            part = (found.outer + _make(-0.02, 0.02) * inside.width).intersect(inside)
            side = sides.argmax()
            lower, upper = cell.hi.copy(), cell.lo.copy()
            lower[side] = upper[side] = cell.mid[side]
            halves = _make(cell.lo, lower, cell.flags), _make(upper, cell.hi, cell.flags)
            waiting.extend((half, part, found) for half in halves)
    cells, pavings = zip(*done)
    return CellPaving(Interval.stack(cells), pavings, finished, tested, perf_counter() - begin)
