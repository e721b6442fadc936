"""Whether one continuous motion leads through pieces that are proved to be free.

On every piece the closure proved is a continuous function of the given coordinates.  Where two pieces meet, both name a
closure of the same given coordinates, not the same one: joints have room.  They are joined by a third family, whose
unknowns lead from the one to the other at the same input, proved to close within the limits on all of the way.  So the
mechanism can be moved through all pieces without ever leaving its limits.  See theory/closure-in-space 6.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Interval
from graphsynth.jamming.space.closure import Closure
from graphsynth.jamming.space.pose import Lead
from graphsynth.jamming.space.proof import sides, tubes

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
Mask = NDArray[np.bool_]
#: Rounding errors of places named in floats, beside their size; Newton's steps; how often a way is halved.
_ROUNDED, _STEPS, _HALVES = 1e-14, 3, 4
_UP = 1.0 + 1e-12


class Free(NamedTuple):
    """N pieces with one closure each: ``at`` (N, width) and its `Lead`; ``reach`` (N, size) is zero where not basic."""

    at: Array
    rate: Array
    basic: Ints
    reach: Array

    @classmethod
    def of(cls, found: list[tuple[Array, Lead]], size: int) -> Free:
        """Gather what is proved of pieces."""
        at = np.array([q for q, _ in found])
        rate, basic, own = (np.array([lead[k] for _, lead in found]) for k in range(3))
        reach = np.zeros((len(at), size))
        np.put_along_axis(reach, basic, own, 1)
        return cls(at, rate, basic, reach)

    def take(self, rows: Ints) -> Free:
        """Return some of them."""
        return Free._make(part[rows] for part in self)


class _Ends(NamedTuple):
    """Closures at N faces: ``at`` (N, width), led by ``rate``, within ``off`` (N, size) of that; ``sure`` (N,)."""

    at: Array
    rate: Array
    off: Array
    sure: Mask


def joined(closure: Closure, floats: Closure, first: Free, second: Free, face: Interval) -> Mask:
    """Tell which of N pairs of pieces are joined by closures at their common given coordinates (certified).

    ``closure`` in balls, ``floats`` the same in floats; ``face`` (N, given coordinates) encloses what both share.
    """
    if not closure.rows:
        return np.ones(len(first.at), dtype=np.bool_)  # any motion is one, and limits are convex
    found = _led(closure, floats, _ends(first, face), _ends(second, face), face.rad, 0)
    rows = np.flatnonzero(~found)
    if rows.size:
        some = face[rows]
        a, b = (_narrow(closure, floats, piece.take(rows), some) for piece in (first, second))
        found[rows] = a.sure & b.sure
        rest = np.flatnonzero(found[rows])
        found[rows[rest]] = _led(closure, floats, _some(a, rest), _some(b, rest), some.rad[rest], _HALVES)
    return found


def _some(ends: _Ends, rows: Ints) -> _Ends:
    return _Ends._make(part[rows] for part in ends)


def _ends(piece: Free, face: Interval) -> _Ends:
    """Closures of pieces at their faces, as widely enclosed as on the pieces."""
    size = piece.reach.shape[1]
    away = face.mid - piece.at[:, size:]
    at = np.concatenate([piece.at[:, :size] + (piece.rate @ away[..., None])[..., 0], face.mid], 1)
    rounded = _rounding(np.abs(piece.at[:, :size]) + sides(np.abs(piece.rate), np.abs(away)))
    return _Ends(at, piece.rate, (piece.reach + rounded) * _UP, np.ones(len(at), dtype=np.bool_))


def _narrow(closure: Closure, floats: Closure, piece: Free, face: Interval) -> _Ends:
    """Closures of pieces at their faces, enclosed narrowly; not sure where they may be others than those proved."""
    size, wide = closure.model.size, _ends(piece, face)
    led, rows = wide.at.copy(), np.arange(len(wide.at))[:, None]
    for _ in range(_STEPS):
        loops = floats.loops(led)
        own = floats.jacobian(loops)[rows, :, piece.basic].swapaxes(1, 2)
        led[rows, piece.basic] -= (np.linalg.pinv(own) @ floats.values(loops)[..., None])[..., 0]
    off, fine = _off(closure, led, piece.rate, face.rad, piece.basic)
    rounded = wide.off - piece.reach
    moved = (np.abs(led - wide.at)[:, :size] + off + rounded) * _UP
    inside = (moved[rows, piece.basic] <= piece.reach[rows, piece.basic]).all(1)
    return _Ends(led, piece.rate, np.maximum(off, rounded), fine & inside)


def _rounding(places: Array) -> Array:
    """Bound the rounding errors of places that are sums of few terms, none much larger than the sum and 1."""
    return _ROUNDED * (1.0 + np.abs(places))


def _off(closure: Closure, at: Array, rate: Array, given: Array, basic: Ints | None) -> tuple[Array, Mask]:
    """How far the one closure near ``at`` lies from it at most, (N, size), and whether that is proved."""
    size, (count, k) = closure.model.size, given.shape
    loose, eye = _rounding(at[:, :size]), np.broadcast_to(np.eye(k), (count, k, k))
    found = tubes(closure, at, np.concatenate([rate, eye], 1), given, basic, loose)
    np.put_along_axis(loose, found.basic, found.reach, 1)
    return loose, found.single


def _led(closure: Closure, floats: Closure, a: _Ends, b: _Ends, given: Array, halves: int) -> Mask:
    """Tell where a way leads from the closures a to the closures b; where not, halves of it are tried."""
    size, count = closure.model.size, len(a.at)
    if count == 0:
        return np.zeros(0, dtype=np.bool_)
    middle, way = 0.5 * a.at + 0.5 * b.at, 0.5 * b.at[:, :size] - 0.5 * a.at[:, :size]
    rate, turn = 0.5 * a.rate + 0.5 * b.rate, np.abs(0.5 * b.rate - 0.5 * a.rate)
    loose = (np.maximum(a.off, b.off) + sides(turn, given)) * _UP + _rounding(np.abs(middle[:, :size]) + np.abs(way))
    k = given.shape[1]
    along = np.zeros((count, closure.model.width, k + 1))
    along[:, :size, :k], along[:, :size, k], along[:, size:, :k] = rate, way, np.eye(k)
    found: Mask = tubes(closure, middle, along, np.hstack([given, np.ones((count, 1))]), loose=loose).single
    rest = np.flatnonzero(~found)
    if halves and rest.size:
        between = middle[rest]
        for _ in range(_STEPS):
            loops = floats.loops(between)
            inverse = np.linalg.pinv(floats.jacobian(loops)[:, :, :size], rcond=1e-11)
            between[:, :size] -= (inverse @ floats.values(loops)[..., None])[..., 0]
        half = _Ends(between, rate[rest], *_off(closure, between, rate[rest], given[rest], None))
        one = half.sure & _led(closure, floats, _some(a, rest), half, given[rest], halves - 1)
        rows = np.flatnonzero(one)
        one[rows] = _led(closure, floats, _some(half, rows), _some(b, rest[rows]), given[rest[rows]], halves - 1)
        found[rest] = one
    return found


def faces(low: Array, high: Array, p_low: Array, p_high: Array) -> tuple[Ints, Ints]:
    """Pairs of pieces of which the first ends where the second begins, with members in common: their numbers.

    ``low``, ``high`` (N,): ends of the input; ``p_low``, ``p_high`` (N, m): of the dimensions.
    """
    order = np.argsort(low, kind="stable")
    begin, end = (np.searchsorted(low[order], high, side=side) for side in ("left", "right"))
    first = np.repeat(np.arange(len(low)), end - begin)
    second = order[np.concatenate([np.arange(b, e) for b, e in zip(begin, end)] or [order[:0]])]
    below, above = np.maximum(p_low[first], p_low[second]), np.minimum(p_high[first], p_high[second])
    wide = p_low[first] < p_high[first]
    meet = np.where(wide, below < above, below <= above).all(1)
    return first[meet], second[meet]
