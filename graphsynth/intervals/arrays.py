"""Interval operations on arrays of bounds, the numpy form: bounds in, bounds out, any equal shapes.

Empty is ``(inf, -inf)``.  Long arrays are done in blocks (``blocks.py``).  The compiled form in
``kernels/arithmetic.py`` gives the same results to the bit; it is used for large arrays, this one where loading
compiled code would take longer than the work.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import blocks, rounding
from graphsynth.intervals.rounding import down, up

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Bounds = tuple[Array, Array]


def _masked(lo: Array, hi: Array, void: Mask) -> Bounds:
    return np.where(void, np.inf, lo), np.where(void, -np.inf, hi)


def _add(al: Array, ah: Array, bl: Array, bh: Array) -> Bounds:
    """Sum."""
    s, below, _ = rounding.add(al, bl)
    t, _, above = rounding.add(ah, bh)
    return _masked(down(s, below), up(t, above), (al > ah) | (bl > bh))


def _subtract(al: Array, ah: Array, bl: Array, bh: Array) -> Bounds:
    """Difference."""
    s, below, _ = rounding.add(al, -bh)
    t, _, above = rounding.add(ah, -bl)
    return _masked(down(s, below), up(t, above), (al > ah) | (bl > bh))


def _ends(values: list[tuple[Array, Array]]) -> tuple[Array, Array, Mask, Mask]:
    """Least and largest of four nearest values with the signs of their errors, and whether they bound the exact ones.

    An error that is NaN belongs to a product with an infinity, which is exact.
    """
    lo = np.minimum(np.minimum(values[0][0], values[1][0]), np.minimum(values[2][0], values[3][0]))
    hi = np.maximum(np.maximum(values[0][0], values[1][0]), np.maximum(values[2][0], values[3][0]))
    below, above = np.ones(lo.shape, dtype=np.bool_), np.ones(lo.shape, dtype=np.bool_)
    for value, error in values:
        below &= ~((value == lo) & (error < 0.0))
        above &= ~((value == hi) & (error > 0.0))
    return lo, hi, below, above


def _multiply(al: Array, ah: Array, bl: Array, bh: Array) -> Bounds:
    """Product, with ``0 * inf = 0``."""
    lo, hi, below, above = _ends([rounding.multiply(a, b) for a in (al, ah) for b in (bl, bh)])
    return _masked(down(lo, below), up(hi, above), (al > ah) | (bl > bh))


def _divide(al: Array, ah: Array, bl: Array, bh: Array) -> Bounds:
    """Quotients by the nonzero part of the divisor."""
    touched = (bl <= 0.0) & (bh >= 0.0)
    if not touched.any():
        return _divide_nonzero(al, ah, bl, bh)
    # a divisor [0, h] or [l, 0] is replaced by its far end; the near end gives an infinity in the direction of the sign
    far = np.where(bl == 0.0, bh, bl)
    safe = np.where(touched, np.where(far == 0.0, 1.0, far), bl), np.where(touched, np.where(far == 0.0, 1.0, far), bh)
    lo, hi = _divide_nonzero(al, ah, *safe)
    positive, negative = (al >= 0.0), (ah <= 0.0)
    upward = (positive & (bl == 0.0)) | (negative & (bh == 0.0))
    lo = np.where(touched, np.where(upward & (lo > 0.0), lo, np.where(upward, 0.0, -np.inf)), lo)
    hi = np.where(touched, np.where(upward, np.inf, np.where(hi < 0.0, hi, 0.0)), hi)
    across = touched & (((bl < 0.0) & (bh > 0.0)) | ((al < 0.0) & (ah > 0.0)))
    lo, hi = np.where(across, -np.inf, lo), np.where(across, np.inf, hi)
    nothing = touched & (al == 0.0) & (ah == 0.0)
    lo, hi = np.where(nothing, 0.0, lo), np.where(nothing, 0.0, hi)
    return _masked(lo, hi, (al > ah) | (bl > bh) | ((bl == 0.0) & (bh == 0.0)))


def _divide_nonzero(al: Array, ah: Array, bl: Array, bh: Array) -> Bounds:
    lo, hi, below, above = _ends([rounding.divide(a, b) for a in (al, ah) for b in (bl, bh)])
    return _masked(down(lo, below), up(hi, above), (al > ah) | (bl > bh))


def _one_product(a: Array, b: Array) -> Bounds:
    """Lower and upper bound of the product of two numbers that are not negative."""
    p, e = rounding.multiply(a, b)
    zero = (a == 0.0) | (b == 0.0)
    return down(p, zero | (e >= 0.0)), up(p, zero | (e <= 0.0))


def absolute(al: Array, ah: Array) -> Bounds:
    """Absolute value."""
    return _masked(np.maximum(np.maximum(al, -ah), 0.0), np.maximum(-al, ah), al > ah)


def _square(al: Array, ah: Array) -> Bounds:
    """Square, not the product with itself."""
    low, high = absolute(al, ah)
    return _masked(_one_product(low, low)[0], _one_product(high, high)[1], al > ah)


def _root(al: Array, ah: Array) -> Bounds:
    """Square roots of the part at or above 0."""
    low, high = np.maximum(al, 0.0), np.maximum(ah, 0.0)
    s, below, _ = rounding.square_root(low)
    t, _, above = rounding.square_root(high)
    return _masked(down(s, below), up(t, above), (al > ah) | (ah < 0.0))


def _power_bounds(x: Array, n: int, side: int) -> Array:
    """Lower (side 0) or upper (side 1) bound of ``x**n`` for ``x >= 0``, ``n >= 1``, by repeated squaring."""
    result, factor = np.ones_like(x), x
    while True:
        if n & 1:
            result = _one_product(result, factor)[side]
        n >>= 1
        if n == 0:
            return result
        factor = _one_product(factor, factor)[side]


def _power(al: Array, ah: Array, n: int) -> Bounds:
    """Integer power; a negative exponent is the quotient of 1 by the positive one."""
    void = al > ah
    if n == 0:
        return _masked(np.ones_like(al), np.ones_like(ah), void)
    m = abs(n)
    if m % 2:
        lo = np.where(al >= 0.0, _power_bounds(np.abs(al), m, 0), -_power_bounds(np.abs(al), m, 1))
        hi = np.where(ah >= 0.0, _power_bounds(np.abs(ah), m, 1), -_power_bounds(np.abs(ah), m, 0))
    else:
        low, high = absolute(al, ah)
        lo, hi = _power_bounds(low, m, 0), _power_bounds(high, m, 1)
    if n < 0:
        lo, hi = _divide(np.ones_like(lo), np.ones_like(hi), lo, hi)
    return _masked(lo, hi, void)


#: From this size on the quick form pays.
_QUICK_FROM = 256


def _spread(form: Callable[..., Bounds], operands: tuple[Array, ...], **options: Any) -> Bounds:
    """Apply a form of flat arrays to arrays of any one shape."""
    lo, hi = form(*[np.reshape(a, -1) for a in operands], **options)
    return lo.reshape(operands[0].shape), hi.reshape(operands[0].shape)


def add(al: Array, ah: Array, bl: Array, bh: Array) -> Bounds:
    """Sum."""
    if al.size < _QUICK_FROM:
        return _add(al, ah, bl, bh)
    return _spread(blocks.add, (al, ah, bl, bh), complete=_add)


def subtract(al: Array, ah: Array, bl: Array, bh: Array) -> Bounds:
    """Difference."""
    if al.size < _QUICK_FROM:
        return _subtract(al, ah, bl, bh)
    return _spread(blocks.subtract, (al, ah, bl, bh), complete=_subtract)


def multiply(al: Array, ah: Array, bl: Array, bh: Array) -> Bounds:
    """Product, with ``0 * inf = 0``."""
    if al.size < _QUICK_FROM:
        return _multiply(al, ah, bl, bh)
    return _spread(blocks.multiply, (al, ah, bl, bh), complete=_multiply)


def divide(al: Array, ah: Array, bl: Array, bh: Array) -> Bounds:
    """Quotients by the nonzero part of the divisor."""
    return _spread(partial(blocks.in_blocks, _divide), (al, ah, bl, bh))


def square(al: Array, ah: Array) -> Bounds:
    """Square, not the product with itself."""
    return _spread(partial(blocks.in_blocks, _square), (al, ah))


def root(al: Array, ah: Array) -> Bounds:
    """Square roots of the part at or above 0."""
    return _spread(partial(blocks.in_blocks, _root), (al, ah))


def power(al: Array, ah: Array, n: int) -> Bounds:
    """Integer power; a negative exponent is the quotient of 1 by the positive one."""
    return _spread(partial(blocks.in_blocks, _power), (al, ah), extra=(n,))
