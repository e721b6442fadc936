"""Maps of dexterity, force and velocity over the positions of a working mode; its singularity-free parts (aspects)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite, finite_array, positive, whole
from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.field import characteristic_length, determinant, pose_grid, scaled_rows, working_mode
from graphsynth.systems.platform.parallel_platform import ParallelPlatform

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Quality:
    """First-order quality of poses, arrays of one shape; NaN out of reach.

    With ``J_s = diag(1/Lc, 1/Lc, 1) J`` (platform speed over rocker speed) and its singular values:

    * `determinant`: ``det JX``, length^4; its sign names the side of the type-II curves.
    * `smallest`: smallest singular value of ``JX diag(1, 1, 1/Lc)``, length: zero at type II.
    * `dexterity`: ``1 / condition number`` of J_s, 1 at best, 0 at a singularity of type I or II.
    * `velocity_min`, `velocity_max`: slowest and fastest platform speed (1/Lc-scaled) for a unit vector of rocker
      speeds.
    * `force_min`, `force_max`: smallest and largest wrench (force times Lc, moment) that a unit vector of rocker
      torques holds: ``1 / velocity_max``, ``1 / velocity_min``.
    * `link_force`: largest norm of the three axial link forces for a unit wrench (force, moment / Lc).
    * `reach`: smallest ``S_k / (2 l1 l2)``: sine of the angle between rocker and link, zero at type I.
    * `Lc`: characteristic length.
    """

    determinant: Array
    smallest: Array
    dexterity: Array
    velocity_min: Array
    velocity_max: Array
    force_min: Array
    force_max: Array
    link_force: Array
    reach: Array
    Lc: float

    @property
    def condition(self) -> Array:
        """Condition number of J_s; infinite at a singularity."""
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / self.dexterity)


@dataclass(frozen=True, eq=False)
class PlatformMap:
    """`Quality` on a grid: arrays of shape (len(x), len(y)), first axis x."""

    platform: ParallelPlatform
    alpha: float
    sigma: tuple[int, int, int]
    x: Array
    y: Array
    quality: Quality

    def to_pandas(self) -> Any:
        """Return one row per reachable node."""
        import pandas as pd

        x, y = np.meshgrid(self.x, self.y, indexing="ij")
        names = [name for name in Quality.__dataclass_fields__ if name != "Lc"]
        columns = {"x": x, "y": y, **{name: getattr(self.quality, name) for name in names}}
        table = pd.DataFrame({name: np.ravel(values) for name, values in columns.items()})
        return table[table["determinant"].notna()].reset_index(drop=True)


@checked
def quality(platform: ParallelPlatform, poses: ArrayLike, sigma: Sequence[int], *, Lc: float | None = None) -> Quality:
    """Dexterity, force and velocity transmission at poses (..., 3) of one working mode.

    `poses`: shape (..., 3). `sigma`: of {+1, -1}. `Lc`: characteristic length; the largest distance of a vertex from
    the reference point by default. Floating point.  Singular poses give zeros and infinities, poses out of reach NaN.
    Raises `GeometryError`: poses without three coordinates, or not finite. See theory/platform-jacobians 3 and
    theory/platform-workspace 3.

    >>> home = quality(ParallelPlatform.mock(), [0.0, 0.0, 0.0], (-1, -1, -1), Lc=45.0)
    >>> round(float(home.condition), 12)  # 0.96 sqrt(2)
    1.357645019878
    """
    mode = working_mode(sigma)
    length = characteristic_length(platform) if Lc is None else positive("Lc", Lc)
    X = finite_array("poses", poses)
    if X.shape[-1:] != (3,):
        raise GeometryError(f"poses have shape {X.shape}; give (..., 3): x, y, alpha")
    theta = platform.inverse(X, mode).theta
    reachable = np.isfinite(theta).all(axis=-1)
    JX, JT = platform.jacobians(X[reachable], theta[reachable])
    values = _values(platform, scaled_rows(JX, length), JT, length)
    spread: list[Any] = [np.full(reachable.shape, np.nan) for _ in values]
    for array, value in zip(spread, values):
        array[reachable] = value
    spread.append(length)
    return Quality(*spread)


def _values(platform: ParallelPlatform, rows: Array, JT: Array, Lc: float) -> tuple[Any, ...]:
    """Quantities for the rows of ``JX diag(1, 1, 1/Lc)``, in the order of `Quality`."""
    l1, l2 = np.array(platform.l1), np.array(platform.l2)
    a, b, c = rows[..., 0, :], rows[..., 1, :], rows[..., 2, :]
    adjugate = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-1)
    determinant = np.einsum("...i,...i->...", rows[..., 0, :], adjugate[..., :, 0])
    smallest = np.linalg.svd(rows, compute_uv=False)[..., 2]
    # det * J_s stays finite at type II: its singular values over |det| are those of J_s
    motion = np.linalg.svd(adjugate * (-JT[..., None, :]), compute_uv=False) / Lc
    size = np.abs(determinant)
    top, bottom = motion[..., 0], motion[..., 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        fastest, slowest = np.where(size > 0.0, top / size, np.inf), np.where(size > 0.0, bottom / size, 0.0)
        dexterity = np.where(top > 0.0, bottom / top, 0.0)
        held_least, held_most = np.where(top > 0.0, size / top, np.inf), np.where(bottom > 0.0, size / bottom, np.inf)
        unit = rows / np.where(l2 > 0.0, 2.0 * l2, 1.0)[:, None]
        force = 1.0 / np.linalg.svd(unit, compute_uv=False)[..., 2]
        arms = 2.0 * l1 * l2
        reach = np.where(arms > 0.0, np.abs(JT) / np.where(arms > 0.0, arms, 1.0), 0.0).min(axis=-1)
    return determinant * Lc, smallest, dexterity, slowest, fastest, held_least, held_most, force, reach


@checked
def platform_map(
    platform: ParallelPlatform, alpha: float, sigma: Sequence[int], *, nodes: int = 200, Lc: float | None = None
) -> PlatformMap:
    """`quality` over a rectangle that holds the workspace at orientation ``alpha``.

    `alpha`: orientation, radians. `sigma`: of {+1, -1}. `nodes`: nodes along x and along y.

    >>> found = platform_map(ParallelPlatform.mock(), 0.0, (-1, -1, -1), nodes=50)
    >>> bool(0.7 < found.quality.dexterity[~np.isnan(found.quality.dexterity)].max() <= 1.0)
    True
    """
    mode, alpha = working_mode(sigma), finite("alpha", alpha)
    nodes = whole("nodes", nodes, 2, 100_000)
    x, y = pose_grid(platform, alpha, nodes)
    poses = np.stack(np.broadcast_arrays(x[:, None], y[None, :], alpha), axis=-1)
    return PlatformMap(platform, alpha, mode, x, y, quality(platform, poses, mode, Lc=Lc))


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
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    sigma = working_mode(sigma)
    count = nodes or (200 if alpha is not None else 64)
    if count < 4 or angles < 4:
        raise GeometryError(f"nodes = {count}, angles = {angles}: the grid needs 4 nodes or more along each axis")
    every = np.linspace(-math.pi, math.pi, angles, endpoint=False)
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
        if alpha is None:  # parts may meet across alpha = pi
            pairs = np.stack([part[:, :, 0].ravel(), part[:, :, -1].ravel()])
            pairs = pairs[:, pairs.all(axis=0)]
            joined = coo_array((np.ones(pairs.shape[1]), pairs), shape=(found + 1, found + 1))
            found, names = connected_components(joined, directed=False)
            part, found = names[part], found - 1
        labels = np.where(part > 0, part + len(signs), labels)
        signs += [sign] * found
    cell = float((x[1] - x[0]) * (y[1] - y[0]) * (1.0 if alpha is not None else math.tau / angles))
    cells = np.bincount(labels.ravel(), minlength=len(signs) + 1)[1:]
    order = np.argsort(-cells, kind="stable")
    order = order[cells[order] >= LEAST]
    rank = np.zeros(len(signs) + 1, dtype=np.int64)
    rank[order + 1] = np.arange(1, len(order) + 1)
    parts = []
    for k in order:
        inside = int(np.argmax(np.where(labels == k + 1, np.abs(values), -1.0)))
        parts.append(Aspect(signs[k], float(cells[k]) * cell, tuple(X.reshape(-1, 3)[inside].tolist()), int(cells[k])))
    at, unresolved = math.nan if alpha is None else float(turn[0]), int(cells[cells < LEAST].sum())
    return Aspects(sigma, at, tuple(parts), unresolved, rank[labels], x, y, turn)
