"""Sums and products of many intervals in numpy, block by block: what fits into the cache, in memory used again.

A quick form does a block of ordinary numbers; it says where it is not to be trusted (overflow, underflow, infinities,
empty ones), and the complete form of ``arrays.py`` does those.  Results are the same to the bit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals.rounding import MAX, PRODUCT_MIN, SPLIT, SPLIT_MAX

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Bounds = tuple[Array, Array]
#: Intervals done at once: long enough for numpy's overhead, short enough for the cache of a core.
BLOCK = 16384
#: Sums are trusted while no intermediate can overflow.
_SUM_MAX = 2.0**1000


def in_blocks(form: Callable[..., Bounds], *operands: Array, extra: tuple[Any, ...] = ()) -> Bounds:
    """Apply a form to flat operands a block at a time."""
    count = operands[0].size
    if count <= BLOCK:
        return form(*operands, *extra)
    lo, hi = np.empty(count), np.empty(count)
    for start in range(0, count, BLOCK):
        part = slice(start, start + BLOCK)
        lo[part], hi[part] = form(*[a[part] for a in operands], *extra)
    return lo, hi


class _Room:
    """Arrays for the intermediate results of one block."""

    def __init__(self, count: int, floats: int, masks: int) -> None:
        self.floats = np.empty((floats, count))
        self.masks = np.empty((masks, count), dtype=np.bool_)

    def of(self, count: int) -> tuple[Array, Mask]:
        return self.floats[:, :count], self.masks[:, :count]


def _move(x: Array, wrong: Mask, outward: int, room: Array) -> None:
    """Move ``x`` to its neighbour outward where it is wrong: one unit of its bit pattern; not for zeros."""
    bits, step = x.view(np.int64), room.view(np.int64)
    np.right_shift(bits, 63, out=step)  # -1 for negative numbers, whose patterns ascend downward
    np.bitwise_or(step, 1, out=step)
    np.multiply(step, wrong, out=step)
    (np.add if outward > 0 else np.subtract)(bits, step, out=bits)


def _one_end(a: Array, b: Array, out: Array, floats: Array, wrong: Mask, outward: int) -> bool:
    """One end of a sum (two-sum of Knuth); False where the block needs the complete form."""
    t, u = floats
    np.add(a, b, out=out)
    np.subtract(out, a, out=t)
    np.subtract(out, t, out=u)
    np.subtract(a, u, out=u)
    np.subtract(b, t, out=t)
    np.add(t, u, out=u)
    np.abs(out, out=t)
    if outward > 0:
        np.greater(u, 0.0, out=wrong)
    else:
        np.less(u, 0.0, out=wrong)
    # a maximum is NaN if there is one
    ordinary = bool(t.max() <= _SUM_MAX) and bool(u.max() <= MAX) and bool(u.min() >= -MAX)
    _move(out, wrong, outward, t)
    return ordinary


def _sum(al: Array, ah: Array, b_low: Array, b_high: Array, again: Callable[[slice], Bounds]) -> Bounds:
    lo, hi = np.empty(al.size), np.empty(al.size)
    room = _Room(min(BLOCK, al.size), 2, 1)
    for start in range(0, al.size, BLOCK):
        part = slice(start, start + BLOCK)
        floats, masks = room.of(len(al[part]))
        if not (
            _one_end(al[part], b_low[part], lo[part], floats, masks[0], -1)
            and _one_end(ah[part], b_high[part], hi[part], floats, masks[0], 1)
        ):
            lo[part], hi[part] = again(part)
    return lo, hi


def add(al: Array, ah: Array, bl: Array, bh: Array, complete: Callable[..., Bounds]) -> Bounds:
    """Add flat arrays."""
    return _sum(al, ah, bl, bh, lambda part: complete(al[part], ah[part], bl[part], bh[part]))


def subtract(al: Array, ah: Array, bl: Array, bh: Array, complete: Callable[..., Bounds]) -> Bounds:
    """Subtract flat arrays."""
    return _sum(al, ah, -bh, -bl, lambda part: complete(al[part], ah[part], bl[part], bh[part]))


def _halves(x: Array, high: Array, low: Array) -> None:
    """Split into two numbers of at most 26 bits (Veltkamp)."""
    np.multiply(x, SPLIT, out=high)
    np.subtract(high, x, out=low)
    np.subtract(high, low, out=high)
    np.subtract(x, high, out=low)


def _error(p: Array, a: Array, b: Array, out: Array, t: Array) -> None:
    """Error of a product of halved numbers (Dekker)."""
    (ah, al), (bh, bl) = a, b
    np.multiply(ah, bh, out=t)
    np.subtract(p, t, out=out)
    np.multiply(al, bh, out=t)
    np.subtract(out, t, out=out)
    np.multiply(ah, bl, out=t)
    np.subtract(out, t, out=out)
    np.multiply(al, bl, out=t)
    np.subtract(t, out, out=out)


def _product(operands: list[Array], lo: Array, hi: Array, floats: Array, masks: Mask) -> NDArray[np.intp]:
    """Products of a block; returns the places that need the complete form."""
    halves, products, e, t = floats[:8].reshape(4, 2, -1), floats[8:12], floats[12], floats[13]
    below, above, m, k = masks
    for x, pair in zip(operands, halves):
        _halves(x, *pair)
    pairs = [(i, j) for i in (0, 1) for j in (2, 3)]
    for p, (i, j) in zip(products, pairs):
        np.multiply(operands[i], operands[j], out=p)
    np.minimum(products[0], products[1], out=lo)
    np.maximum(products[0], products[1], out=hi)
    for p in products[2:]:
        np.minimum(lo, p, out=lo)
        np.maximum(hi, p, out=hi)
    below[:] = above[:] = False
    for p, (i, j) in zip(products, pairs):
        _error(p, halves[i], halves[j], e, t)
        for end, compare, wrong in ((lo, np.less, below), (hi, np.greater, above)):
            np.equal(p, end, out=m)
            np.logical_and(m, compare(e, 0.0, out=k), out=m)
            np.logical_or(wrong, m, out=wrong)
    odd = _vanished(products, [(operands[i], operands[j]) for i, j in pairs])
    for end, wrong, outward in ((lo, below, -1), (hi, above, 1)):
        np.abs(end, out=t)
        if not (t.min() >= PRODUCT_MIN and t.max() <= MAX):
            odd |= ~((t >= PRODUCT_MIN) & (t <= MAX) | (t == 0.0))
        _move(end, wrong, outward, t)
    largest = max(*(float(x.max()) for x in operands), *(-float(x.min()) for x in operands))
    if largest > SPLIT_MAX:  # an infinity, or a number whose halves overflow
        odd[:] = True
    return np.flatnonzero(odd)


def _vanished(products: Array, factors: list[tuple[Array, Array]]) -> Mask:
    """Where a product is 0 although its factors are not, so that the zero is no bound."""
    vanished = np.zeros(products.shape[1], dtype=np.bool_)
    for p, (a, b) in zip(products, factors):
        zero = p == 0.0
        if zero.any():
            vanished |= zero & (a != 0.0) & (b != 0.0)
    return vanished


def multiply(al: Array, ah: Array, bl: Array, bh: Array, complete: Callable[..., Bounds]) -> Bounds:
    """Multiply flat arrays."""
    lo, hi = np.empty(al.size), np.empty(al.size)
    room = _Room(min(BLOCK, al.size), 14, 4)
    for start in range(0, al.size, BLOCK):
        part = slice(start, start + BLOCK)
        operands = [x[part] for x in (al, ah, bl, bh)]
        rare = _product(operands, lo[part], hi[part], *room.of(len(operands[0])))
        if rare.size:
            lo[part][rare], hi[part][rare] = complete(*[x[rare] for x in operands])
    return lo, hi
