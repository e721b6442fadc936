"""Decorations at every border: a box is marked exactly where the definition says, one step beside it it is not."""

import math
from itertools import product

import numpy as np
import pytest
from interval_samples import bounds

from graphsynth import intervals
from graphsynth.intervals import Decoration, Interval, acos, asin, atan2, hypot, log, sqrt, tan
from graphsynth.intervals.linear import _tighten

TINY, UP, DOWN = math.ulp(0.0), math.nextafter(1.0, 2.0), math.nextafter(1.0, 0.0)
MARKS = Decoration.CLIPPED | Decoration.DISCONTINUOUS
SIDES = [-2.0, -UP, -1.0, -DOWN, -TINY, 0.0, TINY, DOWN, 1.0, UP, 2.0]
RANGES = [(low, high) for low, high in product(SIDES, SIDES) if low <= high]


def marks(x):
    return int(x.flags) & MARKS


@pytest.mark.parametrize(
    ("operation", "undefined"),
    [
        (sqrt, lambda low, high: low < 0.0),
        (log, lambda low, high: low <= 0.0),
        (asin, lambda low, high: low < -1.0 or high > 1.0),
        (acos, lambda low, high: low < -1.0 or high > 1.0),
        (lambda x: 1 / x, lambda low, high: low <= 0.0 <= high),
        (lambda x: x**-1, lambda low, high: low <= 0.0 <= high),
        (lambda x: x**-2, lambda low, high: low <= 0.0 <= high),
        (lambda x: x**3, lambda low, high: False),
    ],
)
def test_what_is_undefined_on_a_part_is_marked(operation, undefined):
    for low, high in RANGES:
        assert marks(operation(Interval(low, high))) == Decoration.CLIPPED * undefined(low, high), (low, high)


def test_angles_are_marked_at_the_origin_and_across_the_cut():
    for (yl, yh), (xl, xh) in product(RANGES, RANGES):
        origin = yl <= 0.0 <= yh and xl <= 0.0 <= xh
        cut = yl < 0.0 <= yh and xl < 0.0  # the angle is pi on the negative x axis and tends to -pi below it
        wanted = Decoration.CLIPPED * origin | Decoration.DISCONTINUOUS * cut
        assert marks(atan2(Interval(yl, yh), Interval(xl, xh))) == wanted, (yl, yh, xl, xh)


def test_a_tangent_is_marked_across_a_pole():
    below, above = 1.5707963, 1.5707964
    assert not marks(tan(Interval(1.5, below))) and not marks(tan(Interval(above, 4.0)))
    assert marks(tan(Interval(below, above))) == marks(tan(Interval(-above, 0.0))) == Decoration.DISCONTINUOUS


@pytest.mark.parametrize("size", [1.0, 2.0**500, 2.0**-450])
def test_a_leg_far_below_the_other_adds_less_than_a_step_to_a_hypotenuse(size):
    """The tightest bounds are the long leg and the number above it: ``b^2 / 2 a`` is above 0 and below a step."""
    rng = np.random.default_rng(1)
    a = rng.uniform(1.0, 2.0, 600)
    b = a * 2.0 ** rng.uniform(-60.0, -31.0, 600)
    found = hypot(Interval(a * size), Interval(b * size))
    np.testing.assert_array_equal(found.lo, a * size)
    np.testing.assert_array_equal(found.hi, np.nextafter(a * size, math.inf))


@pytest.mark.parametrize("norm", [0.3, 0.5, 0.6])
def test_a_contraction_goes_on_until_it_gains_little(norm):
    """From a wide start to the fixed point of ``D = residual + rest D``, whose half width is ``1 / (1 - norm)``."""
    n = 3
    rest, residual = Interval(np.full((n, n), -norm / n), np.full((n, n), norm / n)), Interval(-np.ones(n), np.ones(n))
    D = _tighten(residual, rest, Interval(np.full(n, -10.0), np.full(n, 10.0)))
    assert (D.hi >= 1.0 / (1.0 - norm)).all() and (D.hi <= 1.03 / (1.0 - norm)).all()
    again = D.intersect(residual + rest[None].times(D[None])[0])
    assert (again.width >= 0.99 * D.width).all()


#: Every operation that one interval takes a shorter way for than an array does.
SHORT = {
    "add": lambda x, y: x + y, "subtract": lambda x, y: x - y, "multiply": lambda x, y: x * y,
    "divide": lambda x, y: x / y, "float": lambda x, y: x * 0.1, "integer": lambda x, y: 7 - x,
    "minus": lambda x, y: -x, "abs": lambda x, y: abs(x), "cube": lambda x, y: x**3, "inverse": lambda x, y: x**-3,
    "one": lambda x, y: x**0, "hypot": hypot, "atan2": atan2,
    **{
        name: lambda x, y, name=name: getattr(intervals, name)(x)
        for name in ("sqr", "sqrt", "sin", "cos", "tan", "atan", "asin", "acos", "exp", "log")
    },
}  # fmt: skip


@pytest.mark.parametrize("name", SHORT)
def test_one_interval_is_an_array_of_one(name):
    rng = np.random.default_rng(3)
    operation = SHORT[name]
    for xl, xh, yl, yh in zip(*bounds(rng, 200), *bounds(rng, 200)):
        x, y = (Interval(0.5) * 0 + Interval.from_bounds(*ends) for ends in ((xl, xh), (yl, yh)))
        for other in (y, Interval.from_bounds(yl, yh)):  # of equal and of other decorations
            single, several = operation(x, other), operation(x.reshape(1), other.reshape(1))
            assert (single.lo == several.lo[0]) and (single.hi == several.hi[0]), (x, other)
            assert single.flags == np.broadcast_to(several.flags, 1)[0], (x, other)
            assert not (single.lo.flags.writeable or single.hi.flags.writeable)
