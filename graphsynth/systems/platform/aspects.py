"""Aspects: the parts of a working mode in which the platform moves without meeting a singularity."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import checked, finite
from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.field import determinant, pose_grid, working_mode
from graphsynth.systems.platform.parallel_platform import ParallelPlatform

#: Parts of fewer grid cells are not listed.
LEAST = 8


class Aspect(NamedTuple):
    """One aspect: sign of ``det JX``, size (area, or length^2 rad for all orientations), a pose inside, grid cells."""

    sign: int
    size: float
    pose: tuple[float, float, float]
    cells: int


@dataclass(frozen=True, eq=False)
class Aspects:
    """Aspects of one working mode on a grid, the largest first (estimated: parts narrower than a cell may be missed).

    * `alpha`: the orientation, or NaN if all orientations were examined.
    * `unresolved`: cells in parts of fewer than ``LEAST`` cells, which the grid does not resolve; such parts are not
      listed.
    * `labels`: number of the aspect (from 1, in the order of ``parts``) at every grid node; 0 outside.
    * `x`, `y`, `angles`: the grid.
    """

    sigma: tuple[int, ...]
    alpha: float
    parts: tuple[Aspect, ...]
    unresolved: int
    labels: NDArray[np.int64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    angles: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.parts)


@checked
def aspects(
    platform: ParallelPlatform,
    sigma: tuple[int, ...],
    alpha: float | None = None,
    *,
    nodes: int | None = None,
    angles: int = 48,
) -> Aspects:
    """Singularity-free components of a working mode, at one orientation or over all of them.

    `sigma` (of {+1, -1}): working mode. `alpha`: orientation, radians; all orientations (a closed circle) if omitted.
    `nodes`: grid nodes along x and y: 200 for one orientation, 64 for all. `angles`: grid nodes over all orientations.
    Estimated on the grid. Raises `GeometryError`: fewer than 4 nodes along an axis, or a working mode that is none. See
    theory/platform-workspace 1.  Nodes are connected along the axes of the grid.

    >>> found = aspects(ParallelPlatform.mock(), (-1, -1, -1), 0.0)
    >>> [part.sign for part in found.parts]
    [-1]
    """
    from scipy.ndimage import label

    sigma = working_mode(sigma)
    count = nodes or (200 if alpha is not None else 64)
    if count < 4 or angles < 4:
        raise GeometryError(f"nodes = {count}, angles = {angles}: the grid needs 4 nodes or more along each axis")
    every = np.arange(angles) * (math.tau / angles) - math.pi
    turn = every if alpha is None else np.array([finite("alpha", alpha)])
    x, y = pose_grid(platform, None if alpha is None else float(turn[0]), count)
    X = np.stack(np.broadcast_arrays(x[:, None, None], y[None, :, None], turn), axis=-1)
    theta = platform.inverse(X, sigma).theta
    values = determinant(platform.jacobians(X, theta)[0])
    labels = np.zeros(values.shape, dtype=np.int64)
    signs: list[int] = []
    for sign in (1, -1):
        with np.errstate(invalid="ignore"):
            part, found = label(sign * values > 0.0)
        if alpha is None:
            part, found = _wrapped(part, found)
        labels = np.where(part > 0, part + len(signs), labels)
        signs += [sign] * found
    cell = (x[1] - x[0]) * (y[1] - y[0]) * (1.0 if alpha is not None else math.tau / angles)
    return _sorted(sigma, math.nan if alpha is None else float(turn[0]), labels, signs, X, values, float(cell))


def _wrapped(part: NDArray[np.int64], count: int) -> tuple[NDArray[np.int64], int]:
    """Join parts that meet across alpha = pi."""
    parent = list(range(count + 1))

    def root(k: int) -> int:
        while parent[k] != k:
            parent[k] = parent[parent[k]]
            k = parent[k]
        return k

    for a, b in np.unique(np.stack([part[:, :, 0].ravel(), part[:, :, -1].ravel()], axis=1), axis=0):
        if a and b:
            parent[root(int(a))] = root(int(b))
    roots = sorted({root(k) for k in range(1, count + 1)})
    table = np.array([0] + [1 + roots.index(root(k)) for k in range(1, count + 1)])
    return table[part], len(roots)


def _sorted(
    sigma: tuple[int, ...],
    alpha: float,
    labels: NDArray[np.int64],
    signs: list[int],
    X: NDArray[np.float64],
    values: NDArray[np.float64],
    cell: float,
) -> Aspects:
    cells = np.bincount(labels.ravel(), minlength=len(signs) + 1)[1:]
    order = np.argsort(-cells, kind="stable")
    rank = np.zeros(len(signs) + 1, dtype=np.int64)
    rank[order + 1] = np.arange(1, len(signs) + 1)
    parts = []
    unresolved = int(cells[cells < LEAST].sum())
    for k in order[cells[order] >= LEAST]:
        own = np.where(labels == k + 1, np.abs(values), -1.0)
        x, y, a = (float(v) for v in X.reshape(-1, 3)[int(np.argmax(own))])
        parts.append(Aspect(signs[k], float(cells[k]) * cell, (x, y, a), int(cells[k])))
    rank[rank > len(parts)] = 0
    return Aspects(sigma, alpha, tuple(parts), unresolved, rank[labels], X[:, 0, 0, 0], X[0, :, 0, 1], X[0, 0, :, 2])
