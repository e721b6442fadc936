"""Pavings of systems that are compiled themselves: the search of ``paving.py`` at a thousandth of the cost of a box.

A compiled system fills bounds of its equations and derivatives; see `compiled_system`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.arguments import Budget, Positive
from graphsynth.core.errors import IntervalError
from graphsynth.intervals.boxes import Paving
from graphsynth.intervals.guard import check_rounding, checked
from graphsynth.intervals.interval import Interval, _make, interval
from graphsynth.intervals.proving import read_parameters
from graphsynth.intervals.status import Status

Array = NDArray[np.float64]
_AT_ONCE = 100_000
_DEPTH, _KEPT = 256, 64
_NO_PARAMETERS = np.zeros(0)


@checked
def compiled_system(function: Callable[..., bool]) -> Any:
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
    numba dispatcher
    """
    from graphsynth.intervals.kernels.krawczyk import system

    return system(function)  # type: ignore[no-untyped-call]


@checked
def pave_compiled(
    system: Any, box: Any, parameters: Any = None, *, tolerance: Positive = 1e-6, scale: Sequence[float] | None = None,
    max_boxes: Budget = 1_000_000, max_seconds: Budget = 60.0,
) -> Paving:  # fmt: skip
    """Find all solutions of a compiled system in a box.

    Parameters
    ----------
    system : function decorated with `compiled_system`
    box : Interval or anything it takes, shape (n,)
        Start box, bounded.
    parameters : Interval or anything it takes, shape (m,), optional
    tolerance : float
        Boxes with all widths below ``tolerance * scale`` are not cut further.
    scale : sequence of float, optional
        Natural size of each unknown; the widths of the start box for None.
    max_boxes, max_seconds : int, float
        Budget; the clock is read every 100000 boxes.

    Returns
    -------
    Paving
        Certified; the waiting boxes of a search that a budget ended are ``UNDECIDED``.

    Raises
    ------
    IntervalError
        For a box that is empty, unbounded or no vector, budgets and tolerances that are not positive, a system that
        is not compiled.
    GraphsynthError
        If the processor's rounding has been changed.

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
    from graphsynth.intervals.kernels import paving

    begin = perf_counter()
    start, sizes = _posed(box, tolerance, scale)
    p = read_parameters(parameters)
    pl, ph = (_NO_PARAMETERS, _NO_PARAMETERS) if p is None else (_row(p.lo), _row(p.hi))
    n = start.size
    stack, kept = np.empty((2, _DEPTH, n)), np.empty((4, _KEPT, n))
    status, state = np.empty(_KEPT, dtype=np.int8), np.array([1, 0, 0, 0])
    stack[0, 0], stack[1, 0] = start.lo, start.hi
    sl, sh = _row(start.lo), _row(start.hi)
    while True:
        limit = min(max_boxes, int(state[paving.TESTED]) + _AT_ONCE)
        outcome = paving.pave(system, sl, sh, pl, ph, sizes, *stack, *kept, status, state, limit)
        if outcome == paving.ROOM:
            stack, kept = (np.concatenate([a, np.empty_like(a)], axis=1) for a in (stack, kept))
            status = np.concatenate([status, np.empty_like(status)])
        elif outcome == paving.DONE or state[paving.TESTED] >= max_boxes or perf_counter() - begin >= max_seconds:
            break
    waiting, count, tested, _ = state.tolist()
    return _collected(stack[:, :waiting], kept[:, :count], status[:count], tested, perf_counter() - begin)


def _row(values: Array) -> Array:
    return np.array(values, dtype=np.float64).reshape(-1)


def _posed(box: Any, tolerance: float, scale: Sequence[float] | None) -> tuple[Interval, Array]:
    """Check a question; returns the start box and the widths that are small enough."""
    start = interval(box)
    if start.ndim != 1 or start.size == 0 or not start.is_bounded.all():
        raise IntervalError(f"the box {start!r} is not a vector of bounded intervals; give finite bounds, shape (n,)")
    size = np.asarray(start.hi - start.lo if scale is None else scale, dtype=np.float64)
    if size.shape != start.shape or not np.isfinite(size).all() or (size < 0.0).any():
        raise IntervalError(f"scale {scale!r} must hold {start.size} positive numbers")
    return start, tolerance * np.where(size > 0.0, size, 1.0)


def _collected(stack: Array, kept: Array, status: NDArray[np.int8], tested: int, seconds: float) -> Paving:
    """Make the result; undecided boxes that a proved solution stands for are left out."""
    wait = np.full(stack.shape[1], Status.UNDECIDED, dtype=np.int8)
    found = np.concatenate([status, wait])
    lo, hi = np.concatenate([kept[0], stack[0]]), np.concatenate([kept[1], stack[1]])
    dlo, dhi = np.concatenate([kept[2], stack[0]]), np.concatenate([kept[3], stack[1]])
    if (found == Status.UNDECIDED).any():
        stays = np.ones(len(found), dtype=np.bool_)
        for k in np.flatnonzero(found == Status.UNIQUE):
            stays &= ~((lo >= dlo[k]).all(axis=1) & (hi <= dhi[k]).all(axis=1)) | (found == Status.UNIQUE)
        lo, hi, dlo, dhi, found = lo[stays], hi[stays], dlo[stays], dhi[stays], found[stays]
    inner = np.zeros(len(found), dtype=np.bool_)
    return Paving(_make(lo, hi), found, _make(dlo, dhi), inner, len(wait) == 0, tested, seconds)
