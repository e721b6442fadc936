"""One measure for all who compete: the errors of the literature, from places alone.

Paths: sum of squared distances.  Functions and strokes: degrees.  Closed curves: the Chamfer distance over the size.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Curve = Callable[[Array], Complex]
#: Samples of a turn in which points are looked for, and steps that refine their places.
_SAMPLES, _STEPS = 2880, 8


def timed(places: Complex, goals: Complex) -> float:
    """Sum of squared distances of places from the points wanted there."""
    return float((np.abs(places - goals) ** 2).sum())


def ordered(far: Array, closed: bool = True) -> NDArray[np.intp]:
    """Return the samples (n,) nearest to n points that come in their order: distances (n, samples), a turn or a range.

    The sum is the least of all in order, found by dynamic programming from each local minimum of the first point.
    """
    n, count = far.shape
    first = far[0]
    if not closed:
        begins = [0]
    else:
        begins = np.flatnonzero((first <= np.roll(first, 1)) & (first <= np.roll(first, -1))).tolist()
        begins = sorted(begins, key=lambda k: float(first[k]))[:6]
    best, found = np.inf, np.zeros(n, dtype=np.intp)
    for begin in begins:
        turned = np.roll(far, -begin, axis=1)
        total = turned[0].copy()
        if closed:
            total[1:] = np.inf  # it begins here
        back = np.zeros((n, count), dtype=np.intp)
        for k in range(1, n):
            least = np.minimum.accumulate(total)
            index = np.where(total <= least, np.arange(count), 0)
            back[k] = np.maximum.accumulate(index)
            total = least + turned[k]
        at = int(total.argmin())
        if total[at] < best:
            best, chain = float(total[at]), [at]
            for k in range(n - 1, 0, -1):
                chain.append(int(back[k][chain[-1]]))
            found = (np.array(chain[::-1]) + begin) % count
    return found


def passed(curve: Curve, goals: Complex, span: float = 2.0 * np.pi) -> tuple[float, Array]:
    """Sum of squared distances of a curve from points in either order, and the inputs at which it passes them."""
    closed = span >= 2.0 * np.pi - 1e-9
    u = np.linspace(0.0, span, _SAMPLES, endpoint=not closed)
    z = curve(u)
    best, times = np.inf, np.zeros(len(goals))
    if np.isnan(z).any():
        return best, times
    far = np.abs(goals[:, None] - z[None]) ** 2
    for backward in (False, True):
        rows = far[:, ::-1] if backward else far
        at = ordered(rows, closed)
        at = len(u) - 1 - at if backward else at
        own = _refined(curve, goals, u[at], u[1] - u[0])
        error = timed(curve(own), goals)
        if error < best:
            best, times = error, own
    return best, times


def _refined(curve: Curve, goals: Complex, u: Array, step: float) -> Array:
    """Take inputs to the nearest points of the curve by parabolas through three neighbours, never uphill."""
    best, least, reach = u, np.abs(curve(u) - goals) ** 2, step
    for _ in range(_STEPS):
        low, high = (np.abs(curve(best + side * step) - goals) ** 2 for side in (-1.0, 1.0))
        bend = low - 2.0 * least + high
        with np.errstate(all="ignore"):
            shift = np.where(bend > 0.0, 0.5 * step * (low - high) / bend, 0.0)
        new = best + np.clip(np.nan_to_num(shift), -reach, reach)
        value = np.abs(curve(new) - goals) ** 2
        better = value < least
        best, least = np.where(better, new, best), np.where(better, value, least)
        step *= 0.3
    return best


def function(values: Array, wanted: Array) -> float:
    """Largest structural error in degrees: the zero of the output is free, so half the spread of the differences."""
    return float(np.degrees(0.5 * np.ptp(values - wanted)))


def dwell(values: Array, share: float, least: float) -> float:
    """Half the spread in degrees over the quietest part of a turn, and what the stroke (degrees) lacks."""
    n = len(values)
    if abs(values[-1] - values[0]) > 1.0:  # it turns
        return float("inf")
    twice = np.degrees(np.concatenate([values[:-1], values[:-1]]))
    width = int(np.ceil(share * (n - 1))) + 1
    windows = np.lib.stride_tricks.sliding_window_view(twice, width)[: n - 1]
    quiet = 0.5 * float(np.ptp(windows, axis=1).min())
    return quiet + max(0.0, least - float(np.ptp(np.degrees(values))))


def stroke(bar: Any, least: float, most: float, ratio: float) -> float:
    """Degrees that a stroke lacks or has too much, or by which the slow one lasts too long; the worse of them.

    At both ends of the stroke crank and coupler are in one line, so that the follower's pin is as far from the crank's
    pivot as they are together, or their difference.
    """
    crank, ground = abs(bar.crank), bar.b0 - bar.a0
    side = np.sign(((bar.at(0.0)[1] - bar.a0) * np.conj(ground)).imag)  # of the pin, all the time
    ends, angles = [], []
    for far, back in ((bar.coupler + crank, 1.0), (abs(bar.coupler - crank), np.sign(crank - bar.coupler))):
        cosine = (far**2 + abs(ground) ** 2 - bar.follower**2) / (2.0 * far * abs(ground))
        if not abs(cosine) <= 1.0:
            return float("inf")
        way = np.exp(1j * side * np.arccos(cosine)) * ground / abs(ground)
        ends.append(bar.a0 + far * way - bar.b0)
        angles.append(back * way)
    swing = abs(np.degrees(np.angle(ends[0] / ends[1])))
    apart = abs(np.degrees(np.angle(angles[0] / angles[1])))
    slow = max(apart, 360.0 - apart)
    return float(max(least - swing, swing - most, abs(slow - 360.0 * ratio / (1.0 + ratio)), 0.0))


def chamfer(curve: Complex, wanted: Complex, size: float) -> float:
    """Mean of both mean distances to the nearest point of the other closed curve, over the size."""
    one, two = (_pairs(_fine(z)) for z in (curve, wanted))
    there, back = cKDTree(two).query(one)[0], cKDTree(one).query(two)[0]
    return float(0.5 * (there.mean() + back.mean()) / size)


def _fine(z: Complex, count: int = 1000) -> Complex:
    """Points of equal distance along a closed polyline."""
    z = np.append(z, z[0])
    along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(z)))])
    at = np.linspace(0.0, along[-1], count, endpoint=False)
    return np.asarray(np.interp(at, along, z.real) + 1j * np.interp(at, along, z.imag))


def _pairs(z: Complex) -> Array:
    return np.stack([z.real, z.imag], axis=-1)


def posed(curve: Callable[[Array], tuple[Complex, Complex]], poses: Any) -> float:
    """Largest distance of a pose over the size of all, in either order, angles as arcs; the line on the body is free.

    ``curve`` gives places and directions of the body at inputs; infinite if it breaks off between the poses.
    """
    goals = np.array([complex(x, y) for x, y, _ in poses])
    turns = np.exp(1j * np.array([angle for *_, angle in poses]))
    size = float(np.abs(goals - goals.mean()).max())
    found = [_passed_poses(curve, goals, turns, size, backward) for backward in (False, True)]
    return min(found)


def _passed_poses(curve: Any, goals: Complex, turns: Complex, size: float, backward: bool) -> float:
    """Error of poses in one order: nearest inputs and the line on the body in turn."""
    u = np.linspace(0.0, 2.0 * np.pi, _SAMPLES, endpoint=False)
    z, w = curve(u)
    line, n, own = None, len(goals), np.zeros(len(goals))
    for _ in range(10):
        far = np.abs(goals[:, None] - z) ** 2
        if line is not None:
            far = far + size**2 * np.angle(w * np.conj(turns[:, None] * line)) ** 2
        far = np.where(np.isnan(far), 1e9, far)
        at = ordered(far[:, ::-1] if backward else far)
        own, step = u[len(u) - 1 - at if backward else at], float(u[1])
        for _ in range(16):  # nearest input of each pose for this line, by ever finer steps
            tried = own + step * np.linspace(-1.0, 1.0, 9)[:, None]
            p, q = curve(tried)
            rest = q * np.conj(turns)
            mean = rest[4] / np.abs(rest[4]) if line is None else line
            error = np.nan_to_num(np.abs(p - goals) ** 2 + size**2 * np.angle(rest * np.conj(mean)) ** 2, nan=1e9)
            own = np.take_along_axis(tried, error.argmin(axis=0)[None], axis=0)[0]
            step *= 0.3
        p, q = curve(own)
        rest = q * np.conj(turns)
        line = rest.mean() / abs(rest.mean())
    error = np.hypot(np.abs(p - goals), size * np.angle(rest * np.conj(line))) / size
    way = -1.0 if backward else 1.0
    ways = np.cumsum(np.concatenate([[own[0]], way * (np.diff(own) * way % (2.0 * np.pi))]))
    whole = not np.isnan(curve(np.interp(np.linspace(0.0, n - 1.0, 400), np.arange(n), ways))[0]).any()
    return float(error.max()) if whole and np.isfinite(error).all() else float("inf")
