"""The form of an operation: numpy for few intervals, compiled for many; results are the same to the bit."""

from __future__ import annotations

import math
import sys
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import IntervalError
from graphsynth.intervals import arrays
from graphsynth.intervals.guard import check_quickly

Array = NDArray[np.float64]

#: From this size on the compiled form is loaded; once it is there it is used for every size: a call costs 6 to 15
#: microseconds against 30 to 130 of the numpy form, up to 64 intervals alike.
LOAD_FROM, USE_FROM = 5_000, 1
_LOOPS = "graphsynth.intervals.kernels.loops"


def _loops(size: int) -> Any:
    """Return the compiled loops if they pay, else None."""
    if size < USE_FROM:
        return None
    loaded = sys.modules.get(_LOOPS)
    if loaded is None and size >= LOAD_FROM:
        loaded = import_module(_LOOPS)
    return loaded


def common_shape(*operands: Array) -> tuple[int, ...]:
    """Return the shape to which arrays spread; `IntervalError` if there is none."""
    shape = operands[0].shape
    for a in operands:
        if a.shape != shape:
            try:
                return np.broadcast(*operands).shape
            except ValueError:
                shapes = " and ".join(str(shape) for shape in dict.fromkeys(a.shape for a in operands))
                raise IntervalError(f"shapes {shapes} do not fit; give equal shapes, or axes of length 1") from None
    return shape


def _run(name: str, operands: tuple[Array, ...], extra: tuple[int, ...] = ()) -> tuple[Array, Array]:
    check_quickly()
    shape = common_shape(*operands)
    loops = _loops(math.prod(shape))
    if loops is None:
        with np.errstate(all="ignore"):
            lo, hi = getattr(arrays, name)(*[np.broadcast_to(a, shape) for a in operands], *extra)
        return lo, hi
    flat = [flat_of(a, shape) for a in operands]
    lo, hi = np.empty(shape), np.empty(shape)
    getattr(loops, name)(*flat, *extra, lo.reshape(-1), hi.reshape(-1))
    return lo, hi


def flat_of(a: Array, shape: tuple[int, ...]) -> Array:
    """Spread an array to a shape and flatten it, contiguous; cheaper than numpy's own broadcasting for few numbers."""
    if a.shape == shape:
        return np.ascontiguousarray(a).reshape(-1)
    spread = np.empty(shape)
    spread[...] = a
    return spread.reshape(-1)


def binary(name: str, al: Array, ah: Array, bl: Array, bh: Array) -> tuple[Array, Array]:
    """Add, subtract, multiply or divide, with numpy's broadcasting."""
    return _run(name, (al, ah, bl, bh))


def unary(name: str, al: Array, ah: Array) -> tuple[Array, Array]:
    """Absolute, square or root."""
    if name == "absolute":
        return arrays.absolute(al, ah)
    return _run(name, (al, ah))


def power(al: Array, ah: Array, n: int) -> tuple[Array, Array]:
    """Integer power."""
    return _run("power", (al, ah), (n,))
