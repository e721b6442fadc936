"""Operations on arrays of bounds by the compiled loops: broadcasting, and the guard of the processor."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import IntervalError
from graphsynth.intervals.guard import in_default_mode

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Flags = NDArray[np.uint8]


@cache
def _loop(name: str) -> Callable[..., None]:
    """Return a compiled loop; it is loaded when the first operation asks."""
    from graphsynth.core.compilation import named

    found: Callable[..., None] = named("graphsynth.intervals.kernels.loops", name)[0]
    return found


@cache
def single(name: str) -> Callable[..., tuple[float, float]]:
    """Return a compiled operation on one interval, which looks itself how numbers are rounded (NaN: not to nearest)."""
    from graphsynth.core.compilation import named

    found: Callable[..., tuple[float, float]] = named("graphsynth.intervals.kernels.single", name)[0]
    return found


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


@in_default_mode
def run(name: str, *bounds: Array, extra: tuple[Any, ...] = ()) -> tuple[Array, Array]:
    """Apply an operation to lower and upper bounds in turn, with numpy's broadcasting."""
    shape = common_shape(*bounds)
    lo, hi = np.empty(shape), np.empty(shape)
    _loop(name)(*[_flat(a, shape) for a in bounds], *extra, lo.reshape(-1), hi.reshape(-1))
    return lo, hi


def _flat(a: Array, shape: tuple[int, ...]) -> Array:
    """Spread an array to a shape and flatten it, contiguous; cheaper than numpy's own broadcasting for few numbers."""
    if a.shape == shape:
        return np.ascontiguousarray(a).reshape(-1)
    spread = np.empty(shape)
    spread[...] = a
    return spread.reshape(-1)
