"""The form of an operation: numpy for few intervals, compiled for many; results are the same to the bit."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import arrays

__all__ = ["binary", "power", "unary"]

Array = NDArray[np.float64]

#: From this size on the compiled form is loaded; once it is there it is used for every size: a call costs 6 to 15
#: microseconds against 30 to 130 of the numpy form, up to 64 intervals alike.
LOAD_FROM, USE_FROM = 5_000, 1
_LOOPS = "graphsynth.intervals.kernels.loops"


def _loops(size: int) -> Any:
    """Return the compiled loops if they pay, else None."""
    if size < USE_FROM or (size < LOAD_FROM and _LOOPS not in sys.modules):
        return None
    from graphsynth.intervals.kernels import loops

    return loops


def _run(name: str, operands: list[Array], extra: tuple[int, ...] = ()) -> tuple[Array, Array]:
    if any(a.shape != operands[0].shape for a in operands):
        operands = list(np.broadcast_arrays(*operands))
    loops = _loops(operands[0].size)
    if loops is None:
        with np.errstate(all="ignore"):
            lo, hi = getattr(arrays, name)(*operands, *extra)
        return lo, hi
    shape = operands[0].shape
    flat = [np.ascontiguousarray(a).reshape(-1) for a in operands]
    lo, hi = np.empty(flat[0].size), np.empty(flat[0].size)
    getattr(loops, name)(*flat, *extra, lo, hi)
    return lo.reshape(shape), hi.reshape(shape)


def binary(name: str, al: Array, ah: Array, bl: Array, bh: Array) -> tuple[Array, Array]:
    """Add, subtract, multiply or divide, with numpy's broadcasting."""
    return _run(name, [al, ah, bl, bh])


def unary(name: str, al: Array, ah: Array) -> tuple[Array, Array]:
    """Absolute, square or root."""
    if name == "absolute":
        return arrays.absolute(al, ah)
    return _run(name, [al, ah])


def power(al: Array, ah: Array, n: int) -> tuple[Array, Array]:
    """Integer power."""
    return _run("power", [al, ah], (n,))
