"""Operations on one interval, called from Python with plain floats; NaN where the processor does not round to nearest.

The last argument is 1.0, as a number that the compiler does not know: the sums with it tell the rounding mode.
"""

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels import arithmetic, exponential, inverse, trigonometry
from graphsynth.intervals.kernels.rounding import NORMAL_MIN

NAN = float("nan")
_PART, _NEXT = 1.5 * 2.0**-53, 1.0 + 2.0**-52


@kernel(forceinline=True)
def is_nearest(one):
    """Whether the processor rounds to nearest and keeps subnormal numbers."""
    # downward and to zero the first sum is 1, upward the second is -1
    return (one + _PART == _NEXT) & (-one - _PART == -_NEXT) & (one * NORMAL_MIN * 0.5 != 0.0)


def _of_one(name, operation):
    """Return the kernel that applies an operation of one interval, known by its name."""

    def single(al, ah, one):
        lo, hi = operation(al, ah)
        return lo if is_nearest(one) else NAN, hi

    single.__name__ = single.__qualname__ = name
    return kernel(single)


def _of_two(name, operation):
    """Return the kernel that applies an operation of two intervals, known by its name."""

    def single(al, ah, bl, bh, one):
        lo, hi = operation(al, ah, bl, bh)
        return lo if is_nearest(one) else NAN, hi

    single.__name__ = single.__qualname__ = name
    return kernel(single)


add = _of_two("add", arithmetic.add)
subtract = _of_two("subtract", arithmetic.subtract)
multiply = _of_two("multiply", arithmetic.multiply)
divide = _of_two("divide", arithmetic.divide)
square = _of_one("square", arithmetic.square)
root = _of_one("root", arithmetic.root)
exp = _of_one("exp", exponential.exp)
log = _of_one("log", exponential.log)
hypot = _of_two("hypot", exponential.hypot)
atan = _of_one("atan", inverse.atan)
asin = _of_one("asin", inverse.asin)
acos = _of_one("acos", inverse.acos)
atan2 = _of_two("atan2", inverse.atan2)
sin = _of_one("sin", trigonometry.sin)
cos = _of_one("cos", trigonometry.cos)
tan = _of_one("tan", trigonometry.tan)


@kernel
def power(al, ah, n, one):
    """Integer power."""
    lo, hi = arithmetic.power(al, ah, n)
    return lo if is_nearest(one) else NAN, hi
