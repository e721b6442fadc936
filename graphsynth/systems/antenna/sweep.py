"""A sweep of both cranks that carries its assembly mode and stops at a fold (theory/antenna 7)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite, finite_array, sign
from graphsynth.core.errors import GeometryError
from graphsynth.systems.antenna.closed_form import poses
from graphsynth.systems.antenna.folds import Fold, Path, fold_on_path
from graphsynth.systems.antenna.model import PointingDimensions, Poses, PoseStatus

#: Samples of a discriminant per radian of crank angle, between which a dip is refined.
DENSITY = 60
#: A dip to this part of the largest discriminant counts as touching zero: the branches cross there.
TOUCH = 1e-13


@dataclass(frozen=True, eq=False)
class PointingSweep:
    """Poses along a straight path of the crank angles, up to the first fold.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Path parameter; crank angles are ``offset + t * direction``.
    poses : Poses
        ``a`` and ``b`` are NaN beyond the fold, also where the mechanism could be assembled again there.
    reached : ndarray of bool, shape (n,)
        Poses that the sweep comes to.
    fold : Fold or None
        Where the sweep had to stop.
    message : str
        One sentence for the user.
    """

    t: NDArray[np.float64]
    poses: Poses
    reached: NDArray[np.bool_]
    fold: Fold | None
    message: str


def sweep(
    mechanism: PointingDimensions,
    t: ArrayLike,
    direction: tuple[float, float],
    offset: tuple[float, float],
    s_y: int,
    s_x: int,
) -> PointingSweep:
    """Follow one assembly mode; see `PointingMechanism.sweep`.

    Raises
    ------
    GeometryError
        Fewer than two values, or values that do not rise or fall throughout.
    """
    values = finite_array("t", t)
    change = np.diff(values)
    if values.ndim != 1 or values.size < 2 or not ((change > 0.0).all() or (change < 0.0).all()):
        raise GeometryError(f"t of shape {values.shape} must hold at least two values that rise or fall throughout")
    dx, dy = (finite(f"direction[{i}]", part) for i, part in enumerate(direction))
    ox, oy = (finite(f"offset[{i}]", part) for i, part in enumerate(offset))
    path = Path(mechanism, (ox, oy), (dx, dy), sign("s_y", s_y), sign("s_x", s_x))
    found = poses(mechanism, ox + values * dx, oy + values * dy, s_y, s_x)
    if not found.assembled[0]:
        nothing = np.zeros(values.size, dtype=bool)
        why = PoseStatus(int(found.status[0])).message
        return PointingSweep(values, _hide(found, nothing), nothing, None, f"the sweep cannot start: {why}")
    stop = _first_zero(path, float(values[0]), float(values[-1]))
    if stop is None:
        return PointingSweep(values, found, found.assembled, None, "the whole sweep lies on one assembly mode")
    which, place, multiplicity = stop
    first, second, _ = path.legs()
    leg = (first, second)[which].name
    fold = fold_on_path(mechanism, leg, place, (ox, oy), (dx, dy), path.s_y, path.s_x, multiplicity)
    reached = (values <= place) if change[0] > 0.0 else (values >= place)
    reached &= found.assembled
    return PointingSweep(values, _hide(found, reached), reached, fold, f"stopped at t = {place:.12g}: {fold.message}")


def _hide(poses: Poses, reached: NDArray[np.bool_]) -> Poses:
    return replace(poses, a=np.where(reached, poses.a, np.nan), b=np.where(reached, poses.b, np.nan))


def _first_zero(path: Path, start: float, stop: float) -> tuple[int, float, int] | None:
    """First zero of either discriminant: index of the leg, parameter, and 2 where it only touches zero, else 1.

    Samples between which the second derivative cannot hide a dip are refined by minimisation (estimated, not proved).
    """
    found: tuple[int, float, int] | None = None
    end = stop
    for which in (0, 1):
        zero = _zero_of(path, which, start, end)
        if zero is not None:
            found, end = (which, *zero), zero[0]
    return found


def _zero_of(path: Path, which: int, start: float, stop: float) -> tuple[float, int] | None:
    from scipy.optimize import brentq, minimize_scalar

    def value(t: float) -> float:
        return path.discriminant(t, which)

    turn = abs(stop - start) * max(map(abs, path.direction))
    grid = np.linspace(start, stop, max(64, math.ceil(DENSITY * turn)) + 1).tolist()
    heights = [value(t) for t in grid]
    touch = TOUCH * max(abs(height) for height in heights if not math.isnan(height))
    precision = {"xtol": 4e-16 * max(1.0, abs(stop)), "rtol": 8.9e-16}
    for i in range(1, len(grid)):
        if math.isnan(heights[i]):
            return None  # beyond the fold of the first leg by rounding
        if heights[i] < 0.0:
            return float(brentq(value, grid[i - 1], grid[i], **precision)), 1
        if i + 1 < len(grid) and heights[i] < heights[i - 1] and heights[i] <= heights[i + 1]:
            low, high = sorted((grid[i - 1], grid[i + 1]))
            dip = minimize_scalar(value, bounds=(low, high), method="bounded", options={"xatol": 1e-10})
            if abs(dip.fun) <= touch:
                return float(dip.x), 2
            if dip.fun < 0.0:
                return float(brentq(value, grid[i - 1], dip.x, **precision)), 1
    return None
