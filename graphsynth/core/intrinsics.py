"""Operations of the processor for kernels."""

from __future__ import annotations

from typing import Any

from graphsynth.core.compilation import Intrinsic


@Intrinsic
def popcount(typing_context: Any, x: Any) -> Any:
    """Return the number of set bits of a uint64."""
    from numba.types import uint64

    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.ctpop(args[0])

    return uint64(uint64), build


@Intrinsic
def lowest_bit(typing_context: Any, x: Any) -> Any:
    """Return the position of the lowest set bit of a uint64 (64 for zero) as uint64."""
    from numba.types import boolean, uint64

    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.cttz(args[0], context.get_constant(boolean, False))

    return uint64(uint64), build


@Intrinsic
def fma(typing_context: Any, a: Any, b: Any, c: Any) -> Any:
    """Return ``a b + c`` with one rounding."""
    from numba.types import float64

    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.fma(*args)

    return float64(float64, float64, float64), build
