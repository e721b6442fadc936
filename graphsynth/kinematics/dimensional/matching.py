"""When does a moving link pass points, or poses, whose times are not given?  The times are found, not searched.

From many phases and spans, the points spread by their arc; then each slides along the curve to where it is nearest,
in order, while the placement of the whole curve is solved for.  Many candidates at once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Phases tried in a whole rotation, and parts of it over which points of an open path are spread.
_PHASES, _SPANS = 24, (0.2, 0.35, 0.55, 0.8)
_ROUNDS = 12
_SMALL = 1e-13


class MovingLink(NamedTuple):
    """A moving link at inputs u (M,): frames (sets, M, 4) of x, y, cos, sin, rates (sets, M, 3); a rotation or 0."""

    u: Array
    frames: Array
    rates: Array
    period: float


def at_times(own: MovingLink, times: Array) -> tuple[Array, Array]:
    """Frames (sets, N, ..., 4) and rates (sets, N, ..., 3) at times (sets, N), by cubics between the samples.

    Of one link or, with more axes in the middle, of many at once.
    """
    u = own.u[0] + np.mod(times - own.u[0], own.period) if own.period else np.clip(times, own.u[0], own.u[-1])
    k = np.clip(np.searchsorted(own.u, u, side="right") - 1, 0, len(own.u) - 2)
    row, wide = np.arange(len(u))[:, None], (*u.shape, *(1,) * (own.frames.ndim - 2))
    h = (own.u[k + 1] - own.u[k]).reshape(wide)
    x = (u - own.u[k]).reshape(wide) / h
    p, q = own.frames[row, k], own.frames[row, k + 1]
    first, second = (_speed(own.rates[row, k + i], f) for i, f in enumerate((p, q)))
    y = 1 - x
    frames = (1 + 2 * x) * y * y * p + x * y * y * h * first + x * x * (3 - 2 * x) * q - x * x * y * h * second
    speed = y * (1 - 3 * x) * first + x * (3 * x - 2) * second + 6 * x * y / h * (q - p)
    size = np.maximum(np.hypot(frames[..., 2], frames[..., 3]), 1e-300)[..., None]
    frames[..., 2:] /= size
    turn = (frames[..., 2] * speed[..., 3] - frames[..., 3] * speed[..., 2]) / size[..., 0]
    return frames, np.concatenate([speed[..., :2], turn[..., None]], axis=-1)


def _speed(rate: Array, frames: Array) -> Array:
    """Return derivatives of x, y, cos, sin from rates of x, y, theta."""
    found = np.empty_like(frames)
    found[..., :2] = rate[..., :2]
    found[..., 2] = -rate[..., 2] * frames[..., 3]
    found[..., 3] = rate[..., 2] * frames[..., 2]
    return found


class Wanted(NamedTuple):
    """Points (N,), complex; angles (N,) relative to the first or None; their size; whether the last joins the first.

    ``free``: the whole may be moved, turned and scaled, and the point on the link chosen; else the origin is the point.
    """

    points: Complex
    angles: Array | None
    size: float
    closed: bool
    free: bool = True


def _placed(frames: Array, wanted: Wanted) -> tuple[Complex, Complex, Array]:
    """Placement (sets, 3), distances (sets, N), and errors of the angles times the size (sets, N)."""
    z, w = frames[..., 0] + 1j * frames[..., 1], frames[..., 2] + 1j * frames[..., 3]
    B = np.stack([z, w, np.ones_like(z)], axis=2)
    if not wanted.free:
        c = np.tile(np.array([1.0, 0.0, 0.0], dtype=np.complex128), (len(z), 1))
        return c, z - wanted.points, _turned(w, wanted)
    BH = np.conj(B.transpose(0, 2, 1))
    N = BH @ B
    N = N + _SMALL * np.trace(N, axis1=1, axis2=2).real[:, None, None] * np.eye(3)
    c = np.linalg.solve(N, BH @ np.broadcast_to(wanted.points, z.shape)[:, :, None])
    e = (B @ c)[:, :, 0] - wanted.points
    return c[:, :, 0], e, _turned(w, wanted)


def _turned(w: Complex, wanted: Wanted) -> Array:
    """Errors of the angles times the size, (sets, N)."""
    if wanted.angles is None:
        return np.zeros(w.shape)
    turned = np.exp(-1j * wanted.angles) * w
    return np.asarray(wanted.size * np.angle(turned * np.conj(turned.sum(axis=1, keepdims=True))))


def _slid(own: MovingLink, times: Array, wanted: Wanted) -> tuple[Array, Array]:
    """Slide times along the curves towards the points, in order; and give the root mean square errors before.

    A step of Gauss and Newton in times and placement: what is across the motion is left to the placement, then the
    times take what is along it.
    """
    frames, rates = at_times(own, times)
    c, e, turned = _placed(frames, wanted)
    z, w = frames[..., 0] + 1j * frames[..., 1], frames[..., 2] + 1j * frames[..., 3]
    T = c[:, :1] * (rates[..., 0] + 1j * rates[..., 1]) + 1j * c[:, 1:2] * rates[..., 2] * w
    spin = wanted.size * rates[..., 2] if wanted.angles is not None else 0.0 * turned
    inverse = 1.0 / np.maximum(np.abs(T) ** 2 + spin**2, 1e-300)
    columns = [part for a in (z - z.mean(axis=1, keepdims=True), w, np.ones_like(z)) for part in (a, 1j * a)]
    A = np.stack(columns, axis=2)  # what the placement changes, (sets, N, 6)
    along = (np.conj(T)[..., None] * A).real * inverse[..., None]
    rest = ((np.conj(T) * e).real + spin * turned) * inverse
    across, left = A - along * T[..., None], e - rest * T
    H = np.einsum("sni,snj->sij", np.conj(across), across).real
    g = np.einsum("sni,sn->si", np.conj(across), left).real
    if wanted.angles is not None:
        more, less = -along * spin[..., None], turned - rest * spin
        H, g = H + np.einsum("sni,snj->sij", more, more), g + np.einsum("sni,sn->si", more, less)
    H = H + (1e-12 * np.trace(H, axis1=1, axis2=2) + 1e-300)[:, None, None] * np.eye(6)
    change = -np.linalg.solve(H, g[:, :, None])[:, None, :, 0] if wanted.free else np.zeros((1, 1, 6))
    step = -(rest + (along * change).sum(axis=2))
    reach = 0.5 * (own.u[-1] - own.u[0]) / max(times.shape[1], 8)
    moved = np.maximum.accumulate(times + np.clip(np.nan_to_num(step), -reach, reach), axis=1)
    if own.period:
        moved = np.minimum(moved, moved[:, :1] + own.period)
    else:
        moved = np.clip(moved, own.u[0], own.u[-1])
    return moved, np.sqrt((np.abs(e) ** 2 + turned**2).mean(axis=1))


def matched(own: MovingLink, wanted: Wanted) -> Array:
    """Find times (sets, N) at which the links pass what is wanted, in order, for any samples."""
    z = wanted.points
    steps = np.abs(np.diff(z)) + 1e-3 * wanted.size
    whole = steps.sum() + (abs(z[0] - z[-1]) + 1e-3 * wanted.size if wanted.closed else 0.0)
    share = np.concatenate([[0.0], np.cumsum(steps)]) / whole
    length = own.u[-1] - own.u[0]
    spans = np.array([1.0]) if wanted.closed or not own.period else np.array(_SPANS)
    starts = np.arange(_PHASES) / _PHASES if own.period else np.zeros(1)
    if not own.period:
        spans = np.array([1.0, *_SPANS])
        starts = np.array([0.0, 0.2, 0.4, 0.6])
    guesses = [s + part * share for s in starts for part in spans if own.period or s + part <= 1.0 + 1e-9]
    sets, count = len(own.frames), len(guesses)
    times = np.tile(own.u[0] + length * np.array(guesses), (sets, 1))
    every = own._replace(frames=np.repeat(own.frames, count, 0), rates=np.repeat(own.rates, count, 0))
    for _ in range(2):
        times, error = _slid(every, times, wanted)
    best = np.nan_to_num(error, nan=np.inf).reshape(sets, count).argmin(axis=1)
    return followed(own, times.reshape(sets, count, -1)[np.arange(sets), best], wanted, _ROUNDS)


def in_order(own: MovingLink, wanted: Wanted) -> Array:
    """Find times (1, N) at which one link, as it lies, passes the points of an open path in order.

    Dynamic programming over all samples gives the least sum of squared distances without going back, from where times
    slide; where `matched`, which begins with few guesses, comes nearer, its times are taken.
    """
    u, z = own.u, own.frames[0, :, 0] + 1j * own.frames[0, :, 1]
    if own.period:
        u, z = np.concatenate([u, u[1:] + own.period]), np.concatenate([z, z[1:]])
    square = np.abs(z - wanted.points[:, None]) ** 2
    best, before = square[0], np.zeros(square.shape, dtype=np.intp)
    for k in range(1, len(square)):
        least = np.minimum.accumulate(best)
        fresh = np.concatenate([[True], best[1:] < least[:-1]])
        before[k] = np.maximum.accumulate(np.where(fresh, np.arange(len(u)), 0))
        best = least + square[k]
    at = [int(best.argmin())]
    for row in before[:0:-1]:
        at.append(int(row[at[-1]]))
    times = u[at[::-1]][None]
    times = np.minimum(times, times[:, :1] + own.period) if own.period else times  # no more than a turn
    every = times, followed(own, times, wanted, _ROUNDS), matched(own, wanted)
    return min(every, key=lambda found: float(np.abs(_placed(at_times(own, found)[0], wanted)[1]).max()))


def passed(own: MovingLink, wanted: Wanted) -> Array:
    """Find the times (1, N) by which a motion is judged: in order for points of an open path, else as `matched`."""
    return matched(own, wanted) if wanted.closed or wanted.angles is not None else in_order(own, wanted)


def followed(own: MovingLink, times: Array, wanted: Wanted, rounds: int = 4) -> Array:
    """Slide times (sets, N) that are nearly right to where they belong."""
    for _ in range(rounds):
        times, _ = _slid(own, times, wanted)
    return times
