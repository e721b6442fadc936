"""+ - * / powers and roots: containment and tightness against exact fractions, numpy form against compiled form."""

import math
from fractions import Fraction

import numpy as np
import numpy_form
import pytest
from hypothesis import example, given, strategies as st
from interval_samples import SPECIAL, bounds

from graphsynth.intervals import Interval, divide_extended
from graphsynth.testing import finite_numbers

INF = math.inf
ORDINARY = st.floats(-1e6, 1e6, allow_nan=False).filter(lambda x: x == 0.0 or abs(x) > 1e-100)
FINITE = finite_numbers()


def ordered(a, b):
    return (a, b) if a <= b else (b, a)


PAIRS = st.tuples(FINITE, FINITE).map(lambda p: ordered(*p))
TAME = st.tuples(ORDINARY, ORDINARY).map(lambda p: ordered(*p))


def steps(a, b):
    """Doubles from a up to b."""
    count = 0
    while a < b and count < 5:
        a = math.nextafter(a, INF)
        count += 1
    return count


def holds(result, lowest, highest):
    """The exact range lies inside; a bound beyond the largest double is infinite or the largest double."""
    lo, hi = float(result.lo), float(result.hi)
    assert lo == -INF or Fraction(lo) <= lowest, (lo, lowest)
    assert hi == INF or Fraction(hi) >= highest, (hi, highest)


def exact_range(operation, a, b):
    ends = [operation(Fraction(x), Fraction(y)) for x in a for y in b]
    return min(ends), max(ends)


OPERATIONS = {
    "add": lambda x, y: x + y,
    "subtract": lambda x, y: x - y,
    "multiply": lambda x, y: x * y,
}


@pytest.mark.long
@pytest.mark.parametrize("name", OPERATIONS)
@given(a=PAIRS, b=PAIRS)
def test_every_finite_operand_is_enclosed(name, a, b):
    operation = OPERATIONS[name]
    holds(operation(Interval(*a), Interval(*b)), *exact_range(operation, a, b))


@pytest.mark.long
@pytest.mark.parametrize("name", OPERATIONS)
@given(a=TAME, b=TAME)
def test_ordinary_operands_give_the_tightest_bounds(name, a, b):
    operation = OPERATIONS[name]
    result = operation(Interval(*a), Interval(*b))
    lowest, highest = exact_range(operation, a, b)
    tight = Interval(lowest, highest)
    assert (float(result.lo), float(result.hi)) == (float(tight.lo), float(tight.hi))


@given(a=PAIRS, b=PAIRS)
def test_quotients(a, b):
    result = Interval(*a) / Interval(*b)
    if b[0] > 0.0 or b[1] < 0.0:
        holds(result, *exact_range(lambda x, y: x / y, a, b))
    for x in a:
        for y in b:
            if y != 0.0:
                q = Fraction(x) / Fraction(y)
                assert float(result.lo) == -INF or Fraction(float(result.lo)) <= q
                assert float(result.hi) == INF or Fraction(float(result.hi)) >= q


@given(a=TAME, b=TAME)
def test_quotients_are_tight(a, b):
    if b[0] <= 0.0 <= b[1]:
        return
    result = Interval(*a) / Interval(*b)
    tight = Interval(*exact_range(lambda x, y: x / y, a, b))
    assert steps(float(result.lo), float(tight.lo)) <= 1
    assert steps(float(tight.hi), float(result.hi)) <= 1
    if all(abs(x) > 1e-30 for x in (*a, *b)):
        assert (float(result.lo), float(result.hi)) == (float(tight.lo), float(tight.hi))


@given(a=PAIRS)
def test_squares_and_roots(a):
    square = Interval(*a).sqr()
    ends = [Fraction(x) ** 2 for x in a]
    low = Fraction(0) if a[0] <= 0.0 <= a[1] else min(ends)
    holds(square, low, max(ends))
    assert float(square.lo) >= 0.0
    size = ordered(abs(a[0]), abs(a[1]))
    root = Interval(*size).sqrt()
    assert Fraction(float(root.lo)) ** 2 <= Fraction(size[0])
    assert Fraction(float(root.hi)) ** 2 >= Fraction(size[1])
    # the next double inwards would be wrong: tight, one step more beyond 2^-960 and 2^1000 as documented
    if 1e-280 < size[0] < 1e300:
        assert Fraction(math.nextafter(float(root.lo), INF)) ** 2 > Fraction(size[0])
    if 1e-280 < size[1] < 1e300:
        assert Fraction(math.nextafter(float(root.hi), 0.0)) ** 2 < Fraction(size[1])


@given(a=TAME, n=st.integers(-6, 9))
def test_powers(a, n):
    x = Interval(*a)
    result = x**n
    for end in a:
        if end != 0.0 or n >= 0:
            value = Fraction(end) ** n
            assert float(result.lo) == -INF or Fraction(float(result.lo)) <= value
            assert float(result.hi) == INF or Fraction(float(result.hi)) >= value
    if n > 0 and n % 2 == 0:
        assert float(result.lo) >= 0.0
    if n > 0 and n % 2 == 1 and a[0] < 0.0:
        assert float(result.lo) < 0.0 or a[0] > -1e-60


@given(a=PAIRS, b=PAIRS, s=st.floats(0, 1), t=st.floats(0, 1))
@example(a=(1.0, 1.0), b=(0.0, 1.0), s=0.0, t=1e-160)  # a divisor whose square underflows
@example(a=(1.0, 3.0), b=(-1e-300, 2.0), s=0.5, t=0.75)
def test_inclusion_isotonicity(a, b, s, t):
    """A part of the argument gives a part of the result."""
    x, y = Interval(*a), Interval(*b)
    part = lambda i, u, v: i.intersect(Interval(*ordered(_at(i, u), _at(i, v))))  # noqa: E731
    small_x, small_y = part(x, s, t), part(y, t, 1.0)
    for operation in (lambda p, q: p + q, lambda p, q: p - q, lambda p, q: p * q, lambda p, q: p / q):
        assert operation(small_x, small_y).subset(operation(x, y))
    assert small_x.sqr().subset(x.sqr())
    assert abs(small_x).sqrt().subset(abs(x).sqrt())


def _at(i, u):
    lo, hi = float(i.lo), float(i.hi)
    return min(max(lo * (1.0 - u) + hi * u, lo), hi)


BINARY = ["add", "subtract", "multiply", "divide"]
COUNT = 40_000


@pytest.mark.parametrize("name", [*BINARY, "square", "root", "power"])
def test_numpy_and_compiled_forms_agree_to_the_bit(name):
    from graphsynth.intervals.kernels import loops

    rng = np.random.default_rng(5)
    a, b = bounds(rng, COUNT), bounds(rng, COUNT)
    lo, hi = np.empty(COUNT), np.empty(COUNT)
    for extra in [(n,) for n in (-3, -2, -1, 0, 1, 2, 3, 8)] if name == "power" else [()]:
        arguments = (*a, *b) if name in BINARY else (*a, *extra)
        getattr(loops, name)(*arguments, lo, hi)
        with np.errstate(all="ignore"):
            low, high = getattr(numpy_form, name)(*arguments)
        assert not np.isnan(lo).any()
        assert not np.isnan(hi).any()
        assert (lo == low).all()
        assert (hi == high).all()
        empty = lo > hi
        assert (lo[empty] == INF).all()
        assert (hi[empty] == -INF).all()


ENDS = sorted({0.0, INF, *(s * x for s in (1.0, -1.0) for x in SPECIAL if x > 0.0 and x < INF), -INF})
GRID = [(a, b) for i, a in enumerate(ENDS) for b in ENDS[i:] if a < INF and b > -INF]


@pytest.mark.parametrize("name", ["add", "subtract", "multiply", "divide"])
def test_every_pair_of_special_intervals(name):
    """Zeros, infinities, the smallest and largest numbers: containment by fractions, both forms equal."""
    from graphsynth.intervals.kernels import loops

    some = GRID[:: max(1, len(GRID) // 110)]
    a, b = (np.array([p[k] for p in some for _ in some]) for k in (0, 1))
    c, d = (np.array([q[k] for _ in some for q in some]) for k in (0, 1))
    lo, hi = np.empty(a.size), np.empty(a.size)
    getattr(loops, name)(a, b, c, d, lo, hi)
    with np.errstate(all="ignore"):
        low, high = getattr(numpy_form, name)(a, b, c, d)
    assert np.array_equal(lo, low)
    assert np.array_equal(hi, high)
    operation = {**OPERATIONS, "divide": lambda x, y: x / y}[name]
    step = 7  # fractions are slow
    for al, ah, bl, bh, l, h in zip(*(v[::step].tolist() for v in (a, b, c, d, lo, hi))):
        for x in (al, ah):
            for y in (bl, bh):
                if math.isfinite(x) and math.isfinite(y) and (name != "divide" or y != 0.0):
                    value = operation(Fraction(x), Fraction(y))
                    assert l == -INF or (l < INF and Fraction(l) <= value), (al, ah, bl, bh)
                    assert h == INF or (h > -INF and Fraction(h) >= value), (al, ah, bl, bh)


@pytest.mark.parametrize(
    ("result", "lo", "hi"),
    [
        (Interval(1, 2) / Interval(-1, 1), -INF, INF),
        (Interval(1, 2) / Interval(0, 4), 0.25, INF),
        (Interval(1, 2) / Interval(-4, 0), -INF, -0.25),
        (Interval(-2, -1) / Interval(0, 4), -INF, -0.25),
        (Interval(-2, -1) / Interval(-4, 0), 0.25, INF),
        (Interval(0, 1) / Interval(0, 1), 0.0, INF),
        (Interval(-1, 1) / Interval(0, 1), -INF, INF),
        (Interval(0) / Interval(-1, 1), 0.0, 0.0),
        (Interval(1, 2) / Interval(0), INF, -INF),
        (Interval(0) / Interval(0), INF, -INF),
        (Interval(0) * Interval.entire(), 0.0, 0.0),
        (Interval(0, INF) * Interval(0, INF), 0.0, INF),
        (Interval(-INF, 1.0) + Interval(1, INF), -INF, INF),
        (Interval(1, INF) - Interval(1, INF), -INF, INF),
        (Interval(1e308, INF) + Interval(1e308, INF), 1.7976931348623157e308, INF),
        (Interval(1e200, 1e201) * Interval(1e200), 1.7976931348623157e308, INF),
        (Interval(1, INF) / Interval(2, INF), 0.0, INF),
        (Interval(-3, -2) ** 3, -27.0, -8.0),
        (Interval(-3, 2) ** 2, 0.0, 9.0),
        (Interval(-3, 2) ** 4, 0.0, 81.0),
        (Interval(-3, 2) ** 0, 1.0, 1.0),
        (Interval(2, 4) ** -2, 0.0625, 0.25),
        (Interval(-1, 1) ** -1, -INF, INF),
        (Interval(-1, 4).sqrt(), 0.0, 2.0),
        (Interval(-2, -1).sqrt(), INF, -INF),
        (abs(Interval(-3, 2)), 0.0, 3.0),
        (Interval.empty() + 1, INF, -INF),
        (Interval.empty() * Interval.entire(), INF, -INF),
        (Interval.empty().sqr(), INF, -INF),
        (Interval(1) / Interval.empty(), INF, -INF),
    ],
)
def test_special_cases(result, lo, hi):
    assert (float(result.lo), float(result.hi)) == (lo, hi)


def test_clipping_is_recorded_and_carried_on():
    assert Interval(1, 2).sqrt().guaranteed
    bad = Interval(-1, 2).sqrt() + 1
    assert not bad.guaranteed
    assert not (Interval(1) / Interval(0, 1)).guaranteed
    assert not ((bad * 0) + 5).guaranteed
    both = Interval(np.array([-1.0, 1.0]), np.array([2.0, 2.0])).sqrt()
    assert both.guaranteed.tolist() == [False, True]
    assert both[1].guaranteed


def test_extended_division():
    first, second = divide_extended(Interval(1, 2), Interval(-2, 4))
    assert (float(first.lo), float(first.hi), float(second.lo), float(second.hi)) == (-INF, -0.5, 0.25, INF)
    first, second = divide_extended(Interval(-2, -1), Interval(-2, 4))
    assert (float(first.hi), float(second.lo)) == (-0.25, 0.5)
    first, second = divide_extended(Interval(1, 2), Interval(1, 4))
    assert second.is_empty
    assert float(first.lo) == 0.25


def test_large_arrays_use_the_compiled_form_with_the_same_result():
    rng = np.random.default_rng(1)
    big = Interval(*bounds(rng, 6000, empty=0.0)) * Interval("0.1")
    assert big.shape == (6000,)
    again = np.random.default_rng(1)
    lo, hi = bounds(again, 6000, empty=0.0)
    with np.errstate(all="ignore"):
        tenth = Interval("0.1")
        low, high = numpy_form.multiply(lo, hi, *np.broadcast_arrays(tenth.lo, tenth.hi, lo)[:2])
    assert (big.lo == low).all()
    assert (big.hi == high).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", [*BINARY, "square", "root", "power"])
def test_a_million_operations_against_flint(name):
    """Random points of random intervals; the exact value, at 4400 bits or more, lies in the result."""
    import flint

    rng = np.random.default_rng(6)
    count = 2_600_000 if name == "root" else 1_500_000
    a, b = bounds(rng, count, empty=0.0), bounds(rng, count, empty=0.0)
    x, y = (np.where(rng.random(count) < 0.5, *pair) for pair in (a, b))
    result = np.empty(count), np.empty(count)
    from graphsynth.intervals.kernels import loops

    if name == "power":
        y = rng.integers(-7, 12, count).astype(float)
        for n in range(-7, 12):
            rows = y == n
            part = np.empty(rows.sum()), np.empty(rows.sum())
            loops.power(a[0][rows], a[1][rows], n, *part)
            result[0][rows], result[1][rows] = part
    else:
        getattr(loops, name)(*(a + b if name in BINARY else a), *result)
    fine = np.isfinite(x) & np.isfinite(y)
    fine &= {"divide": y != 0.0, "root": x >= 0.0, "power": (x != 0.0) | (y >= 0.0)}.get(name, True)
    exact = {
        "add": lambda p, q: p + q, "subtract": lambda p, q: p - q, "multiply": lambda p, q: p * q,
        "divide": lambda p, q: p / q, "square": lambda p, q: p * p, "root": lambda p, q: p.sqrt(),
        "power": lambda p, q: p ** int(float(q)),
    }[name]  # fmt: skip
    before, flint.ctx.prec = flint.ctx.prec, 4400
    bad = []
    try:
        rows = zip(*(v[fine].tolist() for v in (x, y, *result)))
        for p, q, lo, hi in rows:
            value = exact(flint.arb(p), flint.arb(q))
            if flint.arb(lo) > value or flint.arb(hi) < value:
                bad.append((p, q))
    finally:
        flint.ctx.prec = before
    assert fine.sum() > 1_000_000
    assert bad == []
