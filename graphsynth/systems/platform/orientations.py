"""Workspaces over the orientation: reachable (some angle) and total-orientation (every angle of a range).

For a given position the orientations that a leg allows are intervals in closed form.  An area is enclosed by
subdividing a square: the distance of every vertex from its pivot changes by at most the distance moved, so legs made
longer or shorter by half the diagonal of a cell decide whole cells.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import checked, finite, plane_point, positive
from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.parallel_platform import ParallelPlatform

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Test = Callable[[Complex, float], NDArray[np.bool_]]


@dataclass(frozen=True, eq=False)
class RegionArea:
    """Area of a region of positions, enclosed.

    * `area`: estimate: decided cells and the undecided ones whose centre belongs to the region, length^2.
    * `low`, `high`: bounds: area of the cells wholly inside; that and the undecided ones (rigorous but for rounding).
    * `inside`, `undecided`: centres of the cells.
    * `inside_half`, `undecided_half`: half sides of the cells.
    * `statement`: what the region is.
    """

    area: float
    low: float
    high: float
    inside: Complex
    inside_half: Array
    undecided: Complex
    undecided_half: Array
    statement: str


@checked
def orientations(platform: ParallelPlatform, point: complex) -> tuple[tuple[float, float], ...]:
    """Orientations at which all legs reach a position: closed intervals (start, stop), radians, 0 <= start < 2 pi.

    Exact but for rounding.  ``(0, 2 pi)`` stands for every orientation.

    >>> [tuple(round(a, 6) for a in pair) for pair in orientations(ParallelPlatform.mock(), 0j)]
    [(5.522173, 7.853982)]
    """
    p = np.array([plane_point("point", point)])
    ends = _ends(platform, p)[0].ravel()
    ends = np.unique(np.mod(ends[np.isfinite(ends)], math.tau))
    if not ends.size:
        return ((0.0, math.tau),) if bool(_allowed(platform, p, np.zeros((1, 1)), 0.0).all()) else ()
    following = np.append(ends[1:], ends[0] + math.tau)
    good = _allowed(platform, p, 0.5 * (ends + following)[None], 0.0)[0].all(axis=-1)
    joined: list[tuple[float, float]] = []
    for start, stop in zip(ends[good].tolist(), following[good].tolist()):
        if joined and joined[-1][1] == start:
            start = joined.pop()[0]
        joined.append((start, stop))
    if len(joined) > 1 and joined[-1][1] == joined[0][0] + math.tau:
        joined = [(joined[-1][0], joined[0][1] + math.tau), *joined[1:-1]]
    return tuple(joined)


@checked
def reachable_workspace(platform: ParallelPlatform, resolution: float = 2e-3) -> RegionArea:
    """Positions that the platform reaches at one orientation or more.

    `resolution`: side of the smallest cells over the width of the region looked at. With bounds; the gap between them
    shrinks in proportion to ``resolution``. See theory/platform-workspace 1 (union over alpha).
    """

    def test(p: Complex, extra: float) -> NDArray[np.bool_]:
        ends = _ends(platform, p, extra)
        candidates = np.concatenate([ends.reshape(len(p), 12), np.zeros((len(p), 1))], axis=1)
        allowed = _allowed(platform, p, candidates, extra)
        own = np.repeat(np.arange(3), 4)
        allowed[:, np.arange(12), own] = np.isfinite(candidates[:, :12])  # its own leg: by construction
        return np.asarray(allowed.all(axis=-1).any(axis=-1))

    return _cover(platform, test, resolution, "positions reached at one orientation or more")


@checked
def total_orientation_workspace(
    platform: ParallelPlatform, start: float, stop: float, resolution: float = 2e-3
) -> RegionArea:
    """Positions at which every orientation from ``start`` to ``stop`` (radians) is reached by all legs.

    The legs reach each orientation; whether one working mode passes from end to end without a singularity is another
    question (see `graphsynth.systems.platform.maps`).

    Raises `GeometryError` if ``stop < start``.
    """
    start, stop = finite("start", start), finite("stop", stop)
    if stop < start:
        raise GeometryError(f"the range of orientations {start} to {stop} is reversed; give start <= stop")

    def test(p: Complex, extra: float) -> NDArray[np.bool_]:
        low, high, centre = _cosines(platform, p, extra)
        a, b = start - centre, stop - centre
        ends = np.sort(np.cos([a, b]), axis=0)
        whole = stop - start >= math.tau
        top = np.where((np.ceil(a / math.tau) * math.tau <= b) | whole, 1.0, ends[1])
        bottom = np.where((np.ceil((a - math.pi) / math.tau) * math.tau + math.pi <= b) | whole, -1.0, ends[0])
        return np.asarray(((top <= high) & (bottom >= low)).all(axis=-1))

    return _cover(platform, test, resolution, f"positions where every orientation from {start} to {stop} is reached")


def _cosines(platform: ParallelPlatform, p: Complex, extra: float) -> tuple[Array, Array, Array]:
    """Bounds of ``cos(alpha - centre)`` for each leg, (n, 3), and the centre; legs changed by ``extra``."""
    b, l1, l2 = np.array(platform.b), np.array(platform.l1), np.array(platform.l2)
    q = p[:, None] - np.array(platform.D)
    base, double = np.abs(q) ** 2 + np.abs(b) ** 2, 2.0 * np.abs(q) * np.abs(b)
    far, near = l1 + l2 + extra, np.abs(l1 - l2) - extra
    small = double <= 1e-300  # the orientation does not matter for this leg
    scale = np.where(small, 1e-300, double)
    high = np.where(far >= 0.0, (np.square(far) - base) / scale, -np.inf)
    low = np.where(near > 0.0, (np.square(near) - base) / scale, -np.inf)
    return low, high, np.angle(q) - np.angle(b)


def _ends(platform: ParallelPlatform, p: Complex, extra: float = 0.0) -> Array:
    """Orientations at which a leg passes its reach, (n, 3, 4); NaN where it does not."""
    low, high, centre = _cosines(platform, p, extra)
    bounds = np.stack([low, high], axis=-1)
    with np.errstate(invalid="ignore"):
        half = np.arccos(np.where(np.abs(bounds) <= 1.0, bounds, np.nan))
    return np.asarray(centre[..., None] + np.concatenate([half, -half], axis=-1))


def _allowed(platform: ParallelPlatform, p: Complex, alpha: Array, extra: float) -> NDArray[np.bool_]:
    """Whether each leg reaches the positions (n,) at orientations (n, m); shape (n, m, 3)."""
    low, high, centre = _cosines(platform, p, extra)
    cosine = np.cos(alpha[..., None] - centre[:, None])
    with np.errstate(invalid="ignore"):
        return np.asarray((cosine >= low[:, None]) & (cosine <= high[:, None]))


def _cover(platform: ParallelPlatform, test: Test, resolution: float, statement: str) -> RegionArea:
    """Subdivide a square that holds the reach of leg 1."""
    resolution = positive("resolution", resolution)
    half = platform.l1[0] + platform.l2[0] + abs(platform.b[0])
    centres: Complex = np.array([platform.D[0]], dtype=np.complex128)
    side, low = half, 0.0
    inside: list[Complex] = []
    inside_half: list[Array] = []
    for _ in range(max(1, math.ceil(math.log2(1.0 / resolution)))):
        side *= 0.5
        centres = np.asarray(centres[:, None] + side * np.array([-1 - 1j, 1 - 1j, -1 + 1j, 1 + 1j])).ravel()
        reach = side * math.sqrt(2.0)
        centres = centres[test(centres, reach)]
        sure = test(centres, -reach)
        inside.append(centres[sure])
        inside_half.append(np.full(int(sure.sum()), side))
        low += float(sure.sum()) * 4.0 * side * side
        centres = centres[~sure]
    area = low + float(test(centres, 0.0).sum()) * 4.0 * side * side
    high, halves = low + len(centres) * 4.0 * side * side, np.full(len(centres), side)
    boxes = (np.concatenate(inside), np.concatenate(inside_half), centres, halves)
    return RegionArea(area, low, high, *boxes, statement)
