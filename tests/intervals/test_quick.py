"""Elementary functions by tables: every table, every piece of a constant and every error bound of the proof, by mpmath.

`ERROR` is what the rounding test relies on; the proof (docs/theory/elementary-functions.md) gives `PROVED`, which is
less, and what is measured must stay below that.
"""

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels import loops, quick, tables, trigonometry

INF = math.inf
NAMES = ["exp", "log", "atan", "sin", "cos"]
#: Relative errors of the pairs, as proved; sine and cosine have `ABSOLUTE` besides.
PROVED = {"exp": 2.0**-66, "log": 2.0**-66, "atan": 2.0**-66, "sin": 2.0**-64, "cos": 2.0**-64}
ERROR = {name: quick.SINE_ERROR if name in ("sin", "cos") else quick.ERROR for name in NAMES}
#: Multiples of pi/2 that are close to integers (numerators of convergents of pi), and others.
NEAR_MULTIPLES = [*(float(n) for n in (3, 11, 22, 33, 355, 710)), *(k * math.pi / 2.0 for k in (1, 2, 3, 344, 7629))]


@kernel
def pairs(which, x, h, l, scale):
    """Fill the pairs of function number ``which`` at all points."""
    for i in range(x.size):
        scale[i] = 1.0
        if which == 0:
            h[i], l[i], scale[i] = quick.exp_pair(x[i])
        elif which == 1:
            h[i], l[i] = quick.log_pair(x[i])
        elif which == 2:
            h[i], l[i] = quick.atan_pair(x[i])
        else:
            h[i], l[i], scale[i] = quick.sine_pair(x[i], which - 3)


def points(name, count, seed=1):
    """Arguments of every branch, at the edges of the tables, close to where the value is 0 or the range ends."""
    rng = np.random.default_rng(seed)
    wide, unit, sign = rng.normal(size=count) * 8.0, rng.random(count), rng.choice([-1.0, 1.0], count)
    tiny = sign * 2.0 ** rng.uniform(-31, -3, count)
    if name == "exp":
        edges = (rng.integers(-120_000, 120_000, count) + 0.5) * (math.log(2.0) / 128.0)
        return np.concatenate([wide, tiny, rng.uniform(-690, 709, count), edges[abs(edges) < 690], [-689.99, 708.99]])
    if name == "log":
        edges = (tables.FIRST_BITS + (rng.integers(0, 257, count) << 44)).view(np.float64) * 2.0 ** rng.integers(
            -3, 4, count
        )
        near = np.concatenate([1.0 + tiny, np.nextafter(1.0, [0.0, 2.0]), [2.0**-1022, 1.7976931348623157e308]])
        return np.concatenate([np.exp(88.0 * wide / 8.0), near, edges, np.nextafter(edges, 0.0), 0.5 + 1.5 * unit])
    if name == "atan":
        edges = (rng.integers(0, 128, count) + 0.5) / 128.0
        ends = np.concatenate([edges, 1.0 / edges, np.nextafter(edges, 1.0), [1.0, math.nextafter(1.0, 2.0), 2.0**899]])
        return np.concatenate([wide, tiny, 1.0 / tiny, ends, 2.0 ** rng.uniform(0, 900, count)])
    edges = (rng.integers(-900_000, 900_000, count) + 0.5) * (math.pi / 256.0)
    multiples = rng.integers(-7600, 7600, count) * (math.pi / 2.0)
    near = np.concatenate([multiples, np.nextafter(multiples, INF), multiples + tiny, NEAR_MULTIPLES])
    return np.concatenate([wide, tiny, rng.uniform(-12000, 12000, count), edges, near[abs(near) < 12000]])


def exact(name, x):
    return getattr(mpmath, name)(mpmath.mpf(x))


def evaluate(name, x):
    h, l, scale = np.empty((3, x.size))
    pairs(NAMES.index(name), x, h, l, scale)
    if name != "exp":
        scale[:] = 1.0
    return h, l, scale


def apply(name, lo, hi):
    low, high = np.empty(lo.size), np.empty(lo.size)
    getattr(loops, name)(lo, hi, low, high)
    return low, high


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_errors_stay_below_what_is_proved(name):
    assert PROVED[name] <= ERROR[name] / 2.0
    x = points(name, 150)
    h, l, scale = evaluate(name, x)
    with mpmath.workprec(330):
        for point, high, low, power in zip(*(v.tolist() for v in (x, h, l, scale))):
            if low == 0.0:
                continue  # the rounding test fails
            value = exact(name, point) / mpmath.mpf(power)
            error = abs(mpmath.mpf(high) + mpmath.mpf(low) - value)
            slack = quick.ABSOLUTE / 4.0 if name in ("sin", "cos") else 0.0
            assert error <= PROVED[name] * abs(value) + slack, (point, float(error / abs(value)))
            assert high == float(mpmath.mpf(high) + mpmath.mpf(low))


@pytest.mark.parametrize("name", NAMES)
def test_undecided_and_barely_decided_points(name):
    """The hardest of 100 000 points: values closest to a double, on both sides of the rounding test."""
    x = np.random.default_rng(2).uniform(-20.0, 20.0, 100_000)
    x = abs(x) if name == "log" else x
    h, l, _ = evaluate(name, x)
    hardness = abs(l / h)
    undecided = ~(abs(l) > ERROR[name] * abs(h) + (quick.ABSOLUTE if name in ("sin", "cos") else 0.0))
    assert 0 < undecided.sum() < 2e-3 * x.size
    hard = np.argsort(hardness)[:250]
    assert undecided[hard].any() and not undecided[hard].all()
    lo, hi = apply(name, x[hard], x[hard])
    assert (abs(hi.view(np.int64) - lo.view(np.int64)) == 1).all()
    with mpmath.workprec(330):
        for point, low, high in zip(x[hard].tolist(), lo.tolist(), hi.tolist()):
            assert mpmath.mpf(low) <= exact(name, point) <= mpmath.mpf(high)


@pytest.mark.parametrize("name", NAMES)
def test_ends_of_the_range(name):
    """Where the quick way ends: subnormal and huge numbers, overflow, zeros, infinities, the empty set."""
    tiny, huge = [5e-324, 1e-310, 2.0**-1022, math.nextafter(2.0**-1022, 0.0), 1e-300], [1e300, 1.7976931348623157e308]
    values = {
        "exp": [-745.14, -745.13, -708.4, -708.39, -690.1, -690.0, -689.9, 708.9, 709.0, 709.1, 709.78, 709.79, 1e300],
        "log": [*tiny, *huge, 1.0, math.nextafter(1.0, 0.0), math.nextafter(1.0, 2.0)],
        "atan": [*tiny, *huge, 2.0**-27, 2.0**-31, 2.0**899, 2.0**900, 2.0**901, 1.0],
    }
    far = [*tiny, 2.0**-27, 2.0**-31, 11999.9, 12000.0, 12000.1, 999_999.0, 1e6, 1e22, 6381956970095103 * 2.0**797]
    x = np.array(values.get(name, far))
    x = x if name == "log" else np.concatenate([x, -x])
    lo, hi = apply(name, x, x)
    with mpmath.workprec(2400):
        for point, low, high in zip(x.tolist(), lo.tolist(), hi.tolist()):
            value = exact(name, point)
            assert mpmath.mpf(low) <= value, point
            assert high == INF or value <= mpmath.mpf(high), point
    special = np.array([[-INF, INF], [INF, -INF], [0.0, 0.0], [1.0, INF], [0.5, math.pi]]).T.copy()
    wanted = {
        "exp": [(0.0, INF), (INF, -INF), (1.0, 1.0), (math.nextafter(math.e, 0.0), INF)],
        "log": [(-INF, INF), (INF, -INF), (INF, -INF), (0.0, INF)],
        "atan": [(-math.pi / 2, math.pi / 2), (INF, -INF), (0.0, 0.0), (math.pi / 4, math.pi / 2)],
        "sin": [(-1.0, 1.0), (INF, -INF), (0.0, 0.0), (-1.0, 1.0)],
        "cos": [(-1.0, 1.0), (INF, -INF), (1.0, 1.0), (-1.0, 1.0)],
    }
    found = np.array(apply(name, *special)).T.tolist()
    for (low, high), (a, b) in zip(found, wanted[name]):
        assert low == a or math.isclose(low, a, rel_tol=1e-15)
        assert high == b or math.isclose(high, b, rel_tol=1e-15)


@pytest.mark.parametrize("turn", [0, 1])
def test_extrema_are_counted_as_by_the_function_of_double_doubles(turn, monkeypatch):
    """Ends next to multiples of pi/2, intervals of up to seven quarter turns; both ways hold the values between."""
    rng = np.random.default_rng(4)
    first = rng.integers(-40, 40, 400)
    count = rng.integers(0, 8, 400)
    ends = [(first + k) * (math.pi / 2.0) for k in (0, count)]
    lo, hi = (e + rng.choice([0.0, 0.3, 1e-9], 400) * rng.choice([-1.0, 1.0], 400) for e in ends)
    lo, hi = np.minimum(lo, hi), np.maximum(lo, hi)
    low, high = apply(["sin", "cos"][turn], lo, hi)
    shift = 0.25 - 0.25 * turn  # of the maximum, in turns
    with mpmath.workdps(50):
        for a, b, p, q in zip(*(v.tolist() for v in (lo, hi, low, high))):
            turns = [mpmath.mpf(e) / (2 * mpmath.pi) for e in (a, b)]
            top, bottom = (
                any(turns[0] <= k + s <= turns[1] for k in range(-15, 16)) for s in (shift, mpmath.mpf(shift) + 0.5)
            )
            values = [exact(["sin", "cos"][turn], e) for e in (a, b)]
            assert (q == 1.0) == top or max(values) > 1.0 - 2.0**-52
            assert (p == -1.0) == bottom or min(values) < -1.0 + 2.0**-52
            assert p <= min(values) and max(values) <= q


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_scalar_kernels_give_the_bits_of_the_loops(name):
    from graphsynth.intervals.kernels import exponential, inverse

    rng = np.random.default_rng(6)
    x = rng.choice(points(name, 200, seed=5), 60)
    lo, hi = x, x + rng.choice([0.0, 1.0, 7.0], x.size)
    module = {"exp": exponential, "log": exponential, "atan": inverse}.get(name, trigonometry)
    one = [getattr(module, name)(a, b) for a, b in zip(lo.tolist(), hi.tolist())]
    assert np.array_equal(np.array(one).T, np.array(apply(name, lo, hi)))


def relative(parts, value):
    """Relative difference of a sum of doubles to a number, of 0 to 0 none."""
    difference = abs(sum(map(mpmath.mpf, parts)) - value)
    return difference / abs(value) if value else difference


def test_tables_against_mpmath():
    with mpmath.workdps(70):
        for j in range(128):
            value = mpmath.mpf(2) ** (mpmath.mpf(j) / 128)
            assert relative((tables.POWER_H[j], tables.POWER_L[j]), value) <= 2.0**-78
            assert (tables.POWER_H[j] * 2.0**25).is_integer() and 0.0 <= tables.POWER_L[j] < 2.0**-25
        for k in range(129):
            angle = mpmath.atan(mpmath.mpf(k) / 128)
            assert relative((tables.ATAN_H[k], tables.ATAN_L[k]), angle) <= 2.0**-105
            assert relative((tables.ATAN_H[129 + k], tables.ATAN_L[129 + k]), mpmath.pi / 2 - angle) <= 2.0**-105
        for j in range(512):
            value = mpmath.sin(j * mpmath.pi / 256) if j % 256 else mpmath.mpf(0)
            assert abs(sum(map(mpmath.mpf, (tables.SIN_H[j], tables.SIN_L[j]))) - value) <= mpmath.mpf(2) ** -79
            assert (tables.SIN_H[j] * 2.0**26).is_integer() and 0.0 <= tables.SIN_L[j] < 2.0**-26
        for k in range(256):
            value = -mpmath.log(mpmath.mpf(float(tables.INVERSE[k])))
            found = mpmath.mpf(float(tables.LOG_H[k])) + mpmath.mpf(float(tables.LOG_L[k]))
            assert abs(found - value) <= mpmath.mpf(2) ** -95
            assert Fraction(float(tables.LOG_H[k])).denominator <= 2**42


def test_multipliers_of_the_logarithm_leave_an_exact_small_rest():
    """``m n/256 - 1`` is a double for both ends of each of the 256 parts, at most 2^-7 (2^-8 below 1)."""
    for k in range(256):
        bits = tables.FIRST_BITS + (k << 44)
        ends = np.array([bits, bits + (1 << 44) - 1]).view(np.float64)
        for m in ends.tolist():
            z = Fraction(m) * Fraction(float(tables.INVERSE[k])) - 1
            assert abs(z) <= (Fraction(1, 256) if m < 1.0 else Fraction(1, 128))
            # multiples of 2^-61 below 1 and of 2^-60 above: at most 2^53 of them
            assert z * 2 ** (61 if m < 1.0 else 60) == int(z * 2 ** (61 if m < 1.0 else 60))
        if ends[0] <= 1.0 <= np.nextafter(ends[1], 2.0):
            assert tables.INVERSE[k] == 1.0 and tables.LOG_H[k] == 0.0 == tables.LOG_L[k]


def test_pieces_of_constants():
    """Their products with the integers that come are exact; their sums are the constants."""
    with mpmath.workdps(70):
        step, angle = mpmath.log(2) / 128, mpmath.pi / 256
        assert relative((quick._EXP_STEP, quick._EXP_SECOND, quick._EXP_THIRD), step) <= 2.0**-120
        assert relative((quick._SIN_STEP, quick._SIN_SECOND, quick._SIN_THIRD), angle) <= 2.0**-117
        assert relative((quick._LOG2_H, quick._LOG2_L), mpmath.log(2)) <= 2.0**-94
    largest = {"exp": 2**17, "sin": 2**20}
    for piece, last, count in (
        (quick._EXP_STEP, 42, "exp"), (quick._EXP_SECOND, 77, "exp"),
        (quick._SIN_STEP, 39, "sin"), (quick._SIN_SECOND, 72, "sin"),
    ):  # fmt: skip
        units = Fraction(piece) * 2**last
        assert units.denominator == 1 and units * largest[count] <= 2**53
    assert 709.1 * 128 / math.log(2.0) < largest["exp"] and 12000 * 256 / math.pi < largest["sin"]
    assert Fraction(quick._LOG2_H) * 2**42 * 1100 < 2**53
    assert quick._EXP_THIRD <= 2.0**-77 and quick._SIN_THIRD <= 2.0**-72
