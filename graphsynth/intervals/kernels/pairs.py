"""Intervals as pairs of bounds, for kernels that put them together one by one."""

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels import arithmetic as ia
from graphsynth.intervals.kernels.rounding import add_down, add_up


@kernel
def plus(a, b):
    """Sum of two intervals."""
    return ia.add(a[0], a[1], b[0], b[1])


@kernel
def minus(a, b):
    """Difference of two intervals."""
    return ia.subtract(a[0], a[1], b[0], b[1])


@kernel
def times(a, b):
    """Product of two intervals."""
    return ia.multiply(a[0], a[1], b[0], b[1])


@kernel
def thin(x):
    """One number as an interval."""
    return x, x


@kernel
def around(x, radius):
    """Interval around a number."""
    return add_down(x, -radius), add_up(x, radius)


@kernel
def size(a):
    """Largest absolute value in an interval; infinite if it is empty or no interval."""
    return max(-a[0], a[1]) if a[0] <= a[1] else np.inf


@kernel
def put(a, place):
    """Write an interval."""
    place[0], place[1] = a


@kernel
def got(place):
    """Read an interval."""
    return place[0], place[1]
