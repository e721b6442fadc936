"""Linear systems in intervals, many small ones at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Interval

__all__ = ["enclosed_solve", "points"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def points(values: Array) -> Interval:
    """Floats as intervals of no width."""
    return Interval.from_bounds(values, values)


def enclosed_solve(matrix: Interval, right: Interval) -> tuple[Interval, Mask]:
    """Enclose the solutions of N systems (N, k, k) for all members; False where a matrix may be singular.

    With C near the inverse of the midpoint, ``x - x0 = C (b - A x0) + (1 - C A)(x - x0)``; a weighted norm of the last
    matrix below 1 bounds ``x - x0`` and proves every A regular (Rump 1980).
    """
    k = matrix.shape[-1]
    middle = np.where(np.isfinite(matrix.mid), matrix.mid, 0.0)
    inverse = np.linalg.pinv(middle, rcond=1e-14)
    C = points(inverse)
    start = (inverse @ right.mid[:, :, None])[..., 0]
    start = np.where(np.isfinite(start), start, 0.0)
    residual = right - (matrix * points(start[:, None])).sum(-1)
    first = (C * residual.reshape(len(residual), 1, k)).sum(-1).mag
    product = (C.reshape(-1, k, k, 1) * matrix.reshape(-1, 1, k, k)).sum(2)
    rest = points(np.eye(k)) - product
    size = np.where(np.isfinite(rest.mag), rest.mag, 1.0)
    first = np.where(np.isfinite(first), first, np.inf)
    weight = _weights(size, first)
    with np.errstate(all="ignore"):
        norm = (_nonnegative(size, weight) / points(weight)).hi.max(axis=1)
        largest = (points(first) / points(weight)).hi.max(axis=1)
        fine = np.isfinite(rest.mag).all(axis=(1, 2)) & (norm < 1.0) & np.isfinite(largest)
    norm, largest = np.where(fine, norm, 0.0), np.where(fine, largest, 0.0)
    bound = points(largest) / (1 - points(norm))
    spread = (points(weight) * bound.reshape(-1, 1)).hi
    first = np.where(fine[:, None], first, 0.0)
    for _ in range(3):  # any solution obeys |x - x0| <= first + |rest| |x - x0|
        spread = np.minimum(spread, (points(first) + _nonnegative(size, spread)).hi)
    around = Interval.from_bounds(-spread, spread)
    return around + points(start), np.asarray(fine)


def _weights(size: Array, first: Array) -> Array:
    """Positive weights near the fixed point of ``w = first + size w``; any positive numbers give valid bounds."""
    start = np.where(np.isfinite(first), first, 1.0)
    start = start + 1e-3 * start.max(axis=1, keepdims=True) + 1e-300
    weight = start
    for _ in range(6):
        weight = start + (size @ weight[:, :, None])[..., 0]
    return np.asarray(np.where(np.isfinite(weight), weight, 1.0))


def _nonnegative(matrix: Array, vector: Array) -> Interval:
    """Product of nonnegative numbers, enclosed."""
    return (points(matrix) * points(vector[:, None])).sum(-1)
