"""Grids of poses and quantities at many poses of one working mode, shared by maps, loci and aspects."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import whole
from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.parallel_platform import ParallelPlatform

Array = NDArray[np.float64]


def working_mode(sigma: Sequence[int]) -> tuple[int, int, int]:
    """Return the working mode as a tuple; `GeometryError` unless it has three entries +1 or -1."""
    try:
        values = tuple(sigma)
    except TypeError:
        values = ()
    if len(values) != 3 or any(not isinstance(s, int | float | np.number) or s not in (1, -1) for s in values):
        raise GeometryError(f"sigma = {sigma!r} must hold three entries +1 or -1, the working mode")
    return (int(values[0]), int(values[1]), int(values[2]))


def characteristic_length(platform: ParallelPlatform) -> float:
    """Default of ``Lc``: the largest distance of a platform vertex from the reference point, or else of a link."""
    return max(abs(b) for b in platform.b) or max(*platform.l2, *platform.l1)


def pose_grid(platform: ParallelPlatform, alpha: float | None, nodes: int) -> tuple[Array, Array]:
    """Nodes along x and y over a rectangle that holds the workspace at ``alpha`` (all orientations if None).

    The nodes are the centres of ``nodes`` equal strips, so none lies on the edge.
    """
    nodes = whole("nodes", nodes, 1)
    b, D = np.array(platform.b), np.array(platform.D)
    reach = np.array(platform.l1) + np.array(platform.l2)
    if alpha is None:
        centre, reach = D, reach + np.abs(b)
    else:
        centre = D - np.exp(1j * alpha) * b
    low = (np.max(centre.real - reach), np.max(centre.imag - reach))
    high = (np.min(centre.real + reach), np.min(centre.imag + reach))
    high = tuple(h if h > l else l + 1e-9 * float(reach.max()) for l, h in zip(low, high))  # an empty workspace
    steps = (np.arange(nodes) + 0.5) / nodes
    return low[0] + (high[0] - low[0]) * steps, low[1] + (high[1] - low[1]) * steps


def cofactors(matrix: Array) -> Array:
    """Cofactor matrices (..., 3, 3): row k is the cross product of the two other rows.  NaN passes silently."""
    first, second, third = matrix[..., 0, :], matrix[..., 1, :], matrix[..., 2, :]
    return np.stack([np.cross(second, third), np.cross(third, first), np.cross(first, second)], axis=-2)


def determinant(matrix: Array) -> Array:
    """Return the determinants (...) of (..., 3, 3); NaN passes silently, unlike in ``numpy.linalg.det``."""
    return np.asarray((matrix[..., 0, :] * np.cross(matrix[..., 1, :], matrix[..., 2, :])).sum(axis=-1))


def scaled_rows(JX: Array, Lc: float) -> Array:
    """``JX`` with its third column divided by the characteristic length, all entries in lengths."""
    return np.asarray(JX * np.array([1.0, 1.0, 1.0 / Lc]))
