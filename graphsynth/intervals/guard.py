"""The guard: the processor must still be rounding as IEEE 754 says.

Every bound of this package comes from operations rounded to nearest, with gradual underflow.  Other libraries in the
same process may have left the processor rounding upward (codac does) or flushing tiny numbers to zero (shared
libraries linked with ``-ffast-math`` do).  Bounds would then be silently wrong, so `check_rounding` runs when the
package is imported and at the start of every public solve, and `check_quickly` in every operation on an `Interval`.
See theory/interval-tests 4, item 1.
"""

from __future__ import annotations

import numpy as np

from graphsynth.core.arguments import checker
from graphsynth.core.errors import GraphsynthError, IntervalError

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


def check_quickly() -> None:
    """Do what `check_rounding` does, in a tenth of a microsecond where all is well."""
    if _ONE + _PART != _NEXT or -_ONE - _PART != -_NEXT or _LEAST * 0.5 == 0.0:
        check_rounding()
