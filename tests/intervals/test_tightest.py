"""Every path of + - * / squares and roots gives the tightest bounds, by fractions: kernels and their reference.

Each path is asked by itself on numbers that belong to it: an interval operation chooses among several, and one that is
only reached through another might be wrong unseen.
"""

import math
from fractions import Fraction

import numpy as np
import numpy_form as arrays
import pytest
from interval_samples import bounds

from graphsynth.intervals import Interval, hypot
from graphsynth.intervals.kernels import arithmetic, loops, rounding as compiled
from graphsynth.intervals.reading import lower_bound, upper_bound

INF = math.inf
COUNT = 1500
EXACT = {
    "add": lambda x, y: x + y, "subtract": lambda x, y: x - y, "multiply": lambda x, y: x * y,
    "divide": lambda x, y: x / y,
}  # fmt: skip


def ordinary(seed, count=COUNT):
    """Bounds that no rare path is needed for: both signs, across 0, points, sizes from 2^-60 to 2^60."""
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(2, count)) * 2.0 ** rng.integers(-60, 61, (2, count))
    b = np.where(rng.random(count) < 0.25, a, b)
    return np.minimum(a, b), np.maximum(a, b)


def extreme(seed, count=COUNT):
    """Finite bounds of any size: subnormal, near overflow, powers of two and their neighbours."""
    lo, hi = bounds(np.random.default_rng(seed), 3 * count, empty=0.0)
    fine = np.flatnonzero(np.isfinite(lo) & np.isfinite(hi))[:count]
    lo, hi = lo[fine], hi[fine]
    powers = 2.0 ** np.random.default_rng(seed).integers(-1074, 1024, (2, count // 5))
    lo[: count // 5], hi[: count // 5] = np.nextafter(powers.min(axis=0), 0.0), np.nextafter(powers.max(axis=0), INF)
    fine = np.isfinite(hi)
    return lo[fine], hi[fine]


def outside_zero(pair):
    """Intervals without 0, of both signs; the others are made positive."""
    lo, hi = pair
    low, high = np.minimum(abs(lo), abs(hi)), np.maximum(abs(lo), abs(hi))
    sign = np.where(np.arange(lo.size) % 2, 1.0, -1.0)
    low = np.where(low == 0.0, 1.0, low)
    high = np.maximum(low, high)
    return np.minimum(sign * low, sign * high), np.maximum(sign * low, sign * high)


def tight(name, a, b):
    """Tightest bounds of the exact range, from the ends."""
    found = []
    for row in zip(*(v.tolist() for v in (*a, *b))):
        al, ah, bl, bh = map(Fraction, row)
        ends = [EXACT[name](x, y) for x in (al, ah) for y in (bl, bh)]
        found.append((lower_bound(min(ends)), upper_bound(max(ends))))
    return np.array(found).T


def operands(name, draw):
    a, b = draw(1), draw(2)
    size = min(a[0].size, b[0].size)
    a, b = ((lo[:size].copy(), hi[:size].copy()) for lo, hi in (a, b))
    return a, outside_zero(b) if name == "divide" else b


def in_loop(function):
    """Apply a scalar kernel number by number."""
    return lambda a, b: np.array([function(*row) for row in zip(*(v.tolist() for v in (*a, *b)))]).T


def by_loop(name):
    def run(a, b):
        lo, hi = np.empty_like(a[0]), np.empty_like(a[0])
        getattr(loops, name)(*a, *b, lo, hi)
        return np.array([lo, hi])

    return run


def in_numpy(function):
    def run(a, b):
        with np.errstate(all="ignore"):
            return np.array(function(*a, *b))

    return run


PLAIN = {
    ("add", "kernel"): in_loop(arithmetic.add),
    ("subtract", "kernel"): in_loop(arithmetic.subtract),
    ("multiply", "plain"): in_loop(arithmetic.multiply_plain),
    ("divide", "plain"): in_loop(arithmetic.divide_plain),
}
ANY = {
    **{(name, "kernel"): in_loop(getattr(arithmetic, name)) for name in EXACT},
    ("multiply", "any"): in_loop(arithmetic.multiply_any),
    ("divide", "any"): in_loop(arithmetic.divide_any),
    **{(name, "loop"): by_loop(name) for name in EXACT},
    **{(name, "numpy"): in_numpy(getattr(arrays, name)) for name in EXACT},
}


@pytest.mark.parametrize(("name", "path"), PLAIN)
def test_paths_of_ordinary_numbers_are_the_tightest(name, path):
    a, b = operands(name, ordinary)
    found = PLAIN[name, path](a, b)
    assert np.array_equal(found, tight(name, a, b))


@pytest.mark.parametrize("draw", [ordinary, extreme])
@pytest.mark.parametrize(("name", "path"), ANY)
def test_paths_of_any_numbers_are_the_tightest(name, path, draw):
    a, b = operands(name, draw)
    assert np.array_equal(ANY[name, path](a, b), tight(name, a, b))


@pytest.mark.long
@pytest.mark.parametrize("draw", [ordinary, extreme])
def test_a_quotient_by_one_end_is_the_tightest(draw):
    """Divisors [0, b] and [b, 0]: the finite end is the quotient by b."""
    a, b = operands("divide", draw)
    for sign in (1.0, -1.0):
        far = sign * abs(b[0])
        divisor = np.minimum(far, 0.0), np.maximum(far, 0.0)
        same = (a[0] > 0.0) | (a[1] < 0.0)
        for al, ah, bl, bh, end in zip(*(v[same].tolist() for v in (*a, *divisor, far))):
            upward = (al > 0.0) == (sign > 0.0)
            least = Fraction(al if al > 0.0 else ah) / Fraction(end)
            wanted = (lower_bound(least), INF) if upward else (-INF, upper_bound(least))
            assert arithmetic.divide_zero(al, ah, bl, bh) == wanted
            with np.errstate(all="ignore"):
                low, high = arrays.divide(*(np.array([v]) for v in (al, ah, bl, bh)))
            assert (low[0], high[0]) == wanted


def root_bounds(value):
    """Tightest bounds of a square root, from integers."""
    exact = Fraction(value)
    shift = 2400
    floor = math.isqrt(exact.numerator * exact.denominator * 4**shift) // exact.denominator
    low = Fraction(floor, 2**shift)
    high = low if low * low == exact else Fraction(floor + 1, 2**shift)
    return lower_bound(low), upper_bound(high)


@pytest.mark.parametrize("draw", [ordinary, extreme])
def test_squares_roots_and_single_bounds_are_the_tightest(draw):
    lo, hi = (abs(v) for v in draw(3, 500))
    a = np.minimum(lo, hi), np.maximum(lo, hi)
    squares = [(lower_bound(Fraction(x) ** 2), upper_bound(Fraction(y) ** 2)) for x, y in zip(*(v.tolist() for v in a))]
    roots = [(root_bounds(x)[0], root_bounds(y)[1]) for x, y in zip(*(v.tolist() for v in a))]
    with np.errstate(all="ignore"):
        for name, wanted in (("square", squares), ("root", roots)):
            assert list(zip(*(v.tolist() for v in getattr(arrays, name)(*a)))) == wanted
            assert [getattr(arithmetic, name)(x, y) for x, y in zip(*(v.tolist() for v in a))] == wanted
    for x, y in zip(lo.tolist(), (-hi).tolist()):
        exact = Fraction(x) * Fraction(y)
        both = lower_bound(exact), upper_bound(exact)
        assert compiled.multiply_both(x, y) == both
        assert arithmetic.scale(y, x, x) == both
        if x > 0.0 and y != 0.0:
            exact = Fraction(y) / Fraction(x)
            assert compiled.divide_both(y, x) == (lower_bound(exact), upper_bound(exact))


@pytest.mark.parametrize("exponent", [-3, -2, 2, 3, 4, 7, 31])
def test_powers_are_as_tight_as_documented(exponent):
    """At most 2 |n| steps beyond the tightest; both forms."""
    lo, hi = outside_zero(ordinary(5, 300))
    lo, hi = (np.sign(v) * abs(v) ** 0.25 for v in (lo, hi))
    ends = [sorted((Fraction(x) ** exponent, Fraction(y) ** exponent)) for x, y in zip(lo.tolist(), hi.tolist())]
    wanted = np.array([(lower_bound(a), upper_bound(b)) for a, b in ends]).T
    outer = wanted.copy()
    for _ in range(2 * abs(exponent)):
        outer = np.nextafter(outer, np.array([[-INF], [INF]]))
    for found in (
        in_numpy(lambda *v: arrays.power(*v, exponent))((lo, hi), ()),
        np.array([arithmetic.power(x, y, exponent) for x, y in zip(lo.tolist(), hi.tolist())]).T,
    ):
        assert (found[0] <= wanted[0]).all() and (found[1] >= wanted[1]).all()
        assert (found[0] >= outer[0]).all() and (found[1] <= outer[1]).all()


@pytest.mark.parametrize("draw", [ordinary, extreme])
def test_hypot_is_within_two_steps(draw):
    (x, _), (y, _) = operands("add", draw)
    x, y = abs(x[:500]), abs(y[:500])
    found = hypot(Interval.from_bounds(x, x), Interval.from_bounds(y, y))
    for a, b, lo, hi in zip(*(v.tolist() for v in (x, y, found.lo, found.hi))):
        exact = Fraction(a) ** 2 + Fraction(b) ** 2
        assert Fraction(lo) ** 2 <= exact and (hi == INF or Fraction(hi) ** 2 >= exact)
        above, below = math.nextafter(math.nextafter(lo, INF), INF), math.nextafter(math.nextafter(hi, 0.0), 0.0)
        assert above == INF or Fraction(above) ** 2 > exact
        assert exact == 0 or Fraction(below) ** 2 < exact


def test_a_part_of_the_divisor_gives_a_part_of_the_quotient():
    """Also for a divisor so small that its quotient is beyond the ordinary range."""
    x = Interval(1, 1)
    small, big = Interval(1e-160, 1.0), Interval(0, 1)
    assert small.subset(big) and (x / small).subset(x / big)


def test_parts_give_parts_for_numbers_of_any_size():
    """Inclusion isotonicity follows from tightest bounds; here for nested draws of any size."""
    rng = np.random.default_rng(7)
    count = 4000
    ends = np.sort(np.concatenate([np.array(bounds(rng, count, empty=0.0)) for _ in range(2)]), axis=0)
    other = np.sort(np.concatenate([np.array(bounds(rng, count, empty=0.0)) for _ in range(2)]), axis=0)
    fine = np.isfinite(ends[1:3]).all(axis=0) & np.isfinite(other[1:3]).all(axis=0)
    a, b = ends[:, fine], other[:, fine]
    whole, part = ((Interval.from_bounds(p[i], p[j]), Interval.from_bounds(q[i], q[j]))
                   for p, q, i, j in ((a, b, 0, 3), (a, b, 1, 2)))  # fmt: skip
    for operation in (
        lambda p, q: p + q, lambda p, q: p - q, lambda p, q: p * q, lambda p, q: p / q, lambda p, q: p.sqr(),
        lambda p, q: q.sqrt(), lambda p, q: p**5, lambda p, q: p**-3, hypot,
    ):  # fmt: skip
        assert operation(*part).subset(operation(*whole)).all()
