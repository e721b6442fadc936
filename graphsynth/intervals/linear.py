"""Linear interval systems ``A x = b``: enclosures of all solutions for all matrices and right-hand sides.

Rump's form of Krawczyk's test: with Y near the inverse of mid A and x near the solution of the midpoint system, if

    D' = Y (b - A x) + (I - Y A) D   lies in the interior of D,

then every matrix in A (and Y) is nonsingular and every solution lies in ``x + D'`` ([Rump 1980]; [Neumaier 1990],
theory/bearing-contact 4).  D is found by epsilon-inflation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from graphsynth.core.arguments import Count
from graphsynth.core.errors import IntervalError
from graphsynth.intervals.boxes import Status
from graphsynth.intervals.functions import divide_extended
from graphsynth.intervals.guard import check_rounding, checked
from graphsynth.intervals.interval import Interval, interval
from graphsynth.intervals.proving import inverses, points, spectral_radius

_ROUNDS = 15


@dataclass(frozen=True, eq=False)
class LinearResult:
    """Outcome of a linear solve.

    Attributes
    ----------
    status : Status
        ``UNIQUE``: every matrix in A is nonsingular and ``x`` holds every solution; ``UNDECIDED``: not proved, perhaps
        a matrix in A is singular; ``EMPTY``: no solution in the box given to `gauss_seidel`.
    x : Interval, shape (n,)
        Enclosure; the whole line (or the given box) where nothing is proved.
    spectral_radius : float
        Estimate of ``rho(|I - Y A|)``; below 1 where the solve can succeed.
    """

    status: Status
    x: Interval
    spectral_radius: float


def _read(matrix: Any, right: Any) -> tuple[Interval, Interval]:
    check_rounding()
    A, b = interval(matrix), interval(right)
    if A.ndim != 2 or A.shape[0] != A.shape[1] or b.shape != A.shape[:1]:
        raise IntervalError(f"shapes {A.shape} and {b.shape} are not (n, n) and (n,); give a square system")
    if not (A.is_bounded.all() and b.is_bounded.all()):
        raise IntervalError("the system has an empty or unbounded entry; give finite bounds")
    return A, b


def solve_linear(matrix: Any, right: Any) -> LinearResult:
    """Enclose all solutions of ``A x = b``.

    Parameters
    ----------
    matrix : Interval or anything it takes, shape (n, n)
    right : Interval or anything it takes, shape (n,)

    Returns
    -------
    LinearResult
        Certified.

    Raises
    ------
    IntervalError
        For shapes that do not fit and for unbounded entries.

    Examples
    --------
    >>> result = solve_linear([["[2, 3]", 1], [1, 4]], [1, 1])
    >>> result.status.name, result.x.contains(np.array([3 / 7, 1 / 7])).tolist()
    ('UNIQUE', [True, True])
    >>> solve_linear([[1, 1], [1, "[0.9, 1.1]"]], [1, 1]).status.name
    'UNDECIDED'
    """
    A, b = _read(matrix, right)
    n = b.size
    Y, singular = inverses(A.mid[None])
    if singular[0]:
        return LinearResult(Status.UNDECIDED, Interval.entire(n), float("inf"))
    with np.errstate(all="ignore"):
        exact, x = points(Y), points(Y[0] @ b.mid)
        residual = exact.times((b - A[None].times(x[None])[0])[None])[0]
        rest = (points(np.eye(n)) - exact.times(A[None]))[0]
        radius = spectral_radius(np.asarray(rest.mag))
        D = residual
        for _ in range(_ROUNDS):
            trial = D.hull(0).inflate(0.1, 1e-300)
            D = residual + rest[None].times(trial[None])[0]
            if not D.is_bounded.all():
                break
            if D.interior(trial).all():
                return LinearResult(Status.UNIQUE, x + _tighten(residual, rest, D), radius)
    return LinearResult(Status.UNDECIDED, Interval.entire(n), radius)


def _tighten(residual: Interval, rest: Interval, D: Interval) -> Interval:
    """Repeat the contraction until it gains little."""
    for _ in range(_ROUNDS):
        before = D.width
        D = D.intersect(residual + rest[None].times(D[None])[0])
        if not (D.width < 0.99 * before).any():
            break
    return D


@checked
def gauss_seidel(matrix: Any, right: Any, box: Any, *, rounds: Count = _ROUNDS) -> LinearResult:
    """Cut away parts of a box that hold no solution of ``A x = b``; works for singular matrices too.

    Every row is solved for its diagonal unknown with the two-piece quotient, so a divisor that contains 0 may still cut
    a gap.  No preconditioning: multiply the system first where it is not dominated by its diagonal.

    Parameters
    ----------
    matrix, right : as for `solve_linear`
    box : Interval or anything it takes, shape (n,)
    rounds : int

    Returns
    -------
    LinearResult
        ``EMPTY`` if the box holds no solution, else ``UNDECIDED`` with the smaller box; certified.

    Raises
    ------
    IntervalError
        If the box has not one interval for each unknown.

    Examples
    --------
    >>> gauss_seidel([[2, 1], [1, 3]], [3, 4], ["[-9, 9]", "[-9, 9]"]).x.width.max() < 1e-3
    np.True_
    """
    A, b = _read(matrix, right)
    X = interval(box)
    if X.shape != b.shape:
        raise IntervalError(f"the box has shape {X.shape}, the system {b.shape}; give one interval per unknown")
    n = b.size
    parts = [X[i] for i in range(n)]
    for _ in range(rounds):
        before = [p.width.item() for p in parts]
        for i in range(n):
            total = b[i]
            for j in range(n):
                if j != i:
                    total = total - A[i, j] * parts[j]
            if bool((A[i, i].contains(0.0)) and total.contains(0.0)):
                continue  # 0 x = 0 holds for every x
            low, high = divide_extended(total, A[i, i])
            parts[i] = parts[i].intersect(low).hull(parts[i].intersect(high))
            if parts[i].is_empty:
                return LinearResult(Status.EMPTY, Interval.empty(n), float("nan"))
        if all(p.width.item() >= 0.99 * w for p, w in zip(parts, before)):
            break
    return LinearResult(Status.UNDECIDED, Interval.stack(parts), float("nan"))
