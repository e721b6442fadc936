"""The guard: the processor must still be rounding as IEEE 754 says.

Every bound of this package comes from operations rounded to nearest, with gradual underflow.  Other libraries in the
same process may have left the processor rounding upward (codac does) or flushing tiny numbers to zero (shared
libraries linked with ``-ffast-math`` do).  Bounds would then be silently wrong.  So an operation on an `Interval` is
made in the processor's default mode, whatever mode the thread is in (`in_default_mode`: looking costs a tenth of a
microsecond, and only another mode is left and restored).  A solve runs for long and calls functions of others, whose
own numbers would change with the mode: `check_rounding` refuses it, and the import of the package too.
See theory/interval-tests 4, item 1.
"""

from __future__ import annotations

import ctypes
import platform
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import ParamSpec, TypeVar

import numpy as np

from graphsynth.core.arguments import checker
from graphsynth.core.errors import GraphsynthError, IntervalError

_P = ParamSpec("_P")
_R = TypeVar("_R")
#: Lets a function keep what its annotations say; an `IntervalError` names the argument that is something else.
checked = checker(IntervalError, {"System": "Callable", "CompiledSystem": "Callable"})


_U = 2.0**-53
# run-time values in arrays: neither the byte-code compiler nor a C compiler can fold the sums below
_LEFT = np.array([1.0, -1.0, 1.0, 1.0 + 2.0 * _U, -1.0 - 2.0 * _U])
_RIGHT = np.array([_U, -_U, -0.5 * _U, _U, -_U])
_SUM = (1.0, -1.0, 1.0, 1.0 + 4.0 * _U, -1.0 - 4.0 * _U)
_TINY = np.array([5e-324, 2.0**-1022, 2.0**-537])
_FACTOR = np.array([1.0, 0.5, 2.0**-537])
_PRODUCT_BITS = (1, 1 << 51, 1)
# global names, so that no compiler folds the sums: one differs downward and to zero, the other upward and to zero
_ONE, _PART, _NEXT, _LEAST = 1.0, 1.5 * _U, 1.0 + 2.0 * _U, 2.0**-1022


def check_rounding() -> None:
    """Refuse to go on unless the processor rounds to nearest and keeps subnormal numbers.

    Raises
    ------
    GraphsynthError
        Naming what is wrong; interval bounds made in such a state would not be bounds.
    """
    faults = []
    with np.errstate(all="ignore"):
        array_sum = (_LEFT + _RIGHT).tolist()
        # bit patterns are compared as integers: a comparison of floats would itself flush
        array_bits = (_TINY * _FACTOR).view(np.int64).tolist()
    scalar_sum = [a + b for a, b in zip(_LEFT.tolist(), _RIGHT.tolist())]
    if tuple(array_sum) != _SUM or tuple(scalar_sum) != _SUM:
        faults.append("it does not round to nearest")
    scalar = np.array([a * b for a, b in zip(_TINY.tolist(), _FACTOR.tolist())])
    if tuple(array_bits) != _PRODUCT_BITS or tuple(scalar.view(np.int64).tolist()) != _PRODUCT_BITS:
        faults.append("it flushes subnormal numbers to zero")
    if faults:
        raise GraphsynthError(
            f"the processor cannot be trusted with bounds: {' and '.join(faults)}, although IEEE 754 rounding to "
            "nearest with subnormal numbers is required; another library has changed the floating-point mode: "
            "use it in a process of its own, or restore the default mode"
        )


@contextmanager
def default_mode() -> Iterator[None]:
    """Hold the default floating-point mode of this thread within the block; after it the mode is what it was.

    Raises
    ------
    GraphsynthError
        Where another mode is not left: outside glibc on x86-64 and AArch64, as `check_rounding`.
    """
    try:
        mathematics = ctypes.CDLL("libm.so.6") if platform.machine() in ("x86_64", "aarch64") else None
    except OSError:
        mathematics = None
    before = (ctypes.c_uint64 * 64)()  # more room than a floating-point environment takes
    if mathematics:
        mathematics.fegetenv(before)
        mathematics.fesetenv(ctypes.c_void_p(-1))  # FE_DFL_ENV of glibc
    try:
        check_rounding()
        yield
    finally:
        if mathematics:
            mathematics.fesetenv(before)


def in_default_mode(operation: Callable[_P, _R]) -> Callable[_P, _R]:
    """Let an operation give the same bits in every floating-point mode of the processor."""

    @wraps(operation)
    def guarded(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        if _ONE + _PART == _NEXT and -_ONE - _PART == -_NEXT and _LEAST * 0.5 != 0.0:
            return operation(*args, **kwargs)
        with default_mode():
            return operation(*args, **kwargs)

    return guarded
