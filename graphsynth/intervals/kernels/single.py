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


@kernel
def add(al, ah, bl, bh, one):
    """Sum."""
    lo, hi = arithmetic.add(al, ah, bl, bh)
    return lo if is_nearest(one) else NAN, hi


@kernel
def subtract(al, ah, bl, bh, one):
    """Difference."""
    lo, hi = arithmetic.subtract(al, ah, bl, bh)
    return lo if is_nearest(one) else NAN, hi


@kernel
def multiply(al, ah, bl, bh, one):
    """Product."""
    lo, hi = arithmetic.multiply(al, ah, bl, bh)
    return lo if is_nearest(one) else NAN, hi


@kernel
def divide(al, ah, bl, bh, one):
    """Quotients by the nonzero part of the divisor."""
    lo, hi = arithmetic.divide(al, ah, bl, bh)
    return lo if is_nearest(one) else NAN, hi


@kernel
def square(al, ah, one):
    """Square."""
    lo, hi = arithmetic.square(al, ah)
    return lo if is_nearest(one) else NAN, hi


@kernel
def root(al, ah, one):
    """Square roots of the part at or above 0."""
    lo, hi = arithmetic.root(al, ah)
    return lo if is_nearest(one) else NAN, hi


@kernel
def exp(al, ah, one):
    """Exponential."""
    lo, hi = exponential.exp(al, ah)
    return lo if is_nearest(one) else NAN, hi


@kernel
def log(al, ah, one):
    """Logarithm of the part above 0."""
    lo, hi = exponential.log(al, ah)
    return lo if is_nearest(one) else NAN, hi


@kernel
def atan(al, ah, one):
    """Arctangent."""
    lo, hi = inverse.atan(al, ah)
    return lo if is_nearest(one) else NAN, hi


@kernel
def sin(al, ah, one):
    """Sine."""
    lo, hi = trigonometry.sin(al, ah)
    return lo if is_nearest(one) else NAN, hi


@kernel
def cos(al, ah, one):
    """Cosine."""
    lo, hi = trigonometry.cos(al, ah)
    return lo if is_nearest(one) else NAN, hi
