"""Elementary functions: containment against mpmath and flint at high precision, tightness, ranges over intervals."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, strategies as st
from interval_samples import bounds

from graphsynth.intervals import (
    Decoration,
    Interval,
    acos,
    asin,
    atan,
    atan2,
    cos,
    exp,
    hypot,
    log,
    maximum,
    minimum,
    pi,
    sin,
    sqr,
    sqrt,
    tan,
)  # fmt: skip
from graphsynth.testing import finite_numbers

INF = math.inf
WORST = 6381956970095103 * 2.0**797  # the double nearest to a multiple of pi/2, relative to the spacing (Kahan)

FUNCTIONS = {"sin": sin, "cos": cos, "tan": tan, "atan": atan, "asin": asin, "acos": acos, "exp": exp, "log": log}
SPECIAL = [
    0.0, -0.0, 5e-324, -5e-324, 2.0**-1022, 1e-300, 2.0**-27, -(2.0**-27), 0.5, 0.785, 0.7853981633974483, 1.0, -1.0,
    math.nextafter(1.0, 0.0), math.nextafter(-1.0, 0.0), 0.7071067811865475, 0.7071067811865476,
    math.nextafter(1.0, 2.0), 1e5, 1e16, 1e22, WORST, 1e300, -1e300, 1.7976931348623157e308, 709.78, 709.79,
    -708.4, -744.4, -745.13, -745.2,
]  # fmt: skip


def arguments(name, rng, count):
    """Points that hit every branch of a function, in its domain."""
    quarter = count // 4
    x = np.concatenate([
        rng.uniform(-10.0, 10.0, quarter), rng.uniform(-1.0, 1.0, quarter),
        np.ldexp(rng.uniform(-1.0, 1.0, quarter), rng.integers(-1074, 1025, quarter)),
        np.ldexp(rng.normal(size=quarter), rng.integers(-40, 40, quarter)), SPECIAL,
    ])  # fmt: skip
    if name in ("sin", "cos", "tan"):
        near = rng.integers(-(10**6), 10**6, quarter) * (math.pi / 2.0)
        x = np.concatenate([x, near, np.nextafter(near, INF), np.arange(1, 60) * (math.pi / 2.0)])
    if name in ("asin", "acos"):
        close = 1.0 - np.ldexp(rng.random(quarter), -rng.integers(0, 53, quarter))
        x = np.concatenate([x[np.abs(x) <= 1.0], close, -close])
    if name == "exp":
        x = np.concatenate([x[np.abs(x) < 1e4], rng.uniform(-746.0, 710.0, quarter)])
    if name == "log":
        x = np.concatenate([np.abs(x), 1.0 + np.ldexp(rng.normal(size=quarter), -rng.integers(2, 53, quarter))])
        x = x[x > 0.0]
    return x[np.isfinite(x)]


def spacing(lo, hi):
    """Number of doubles from lo to hi."""

    def order(a):
        bits = np.abs(np.asarray(a)).reshape(-1).view(np.int64)
        return np.where(np.asarray(a).reshape(-1) < 0.0, -bits, bits)

    return order(hi) - order(lo)


@pytest.mark.long
@pytest.mark.parametrize("name", FUNCTIONS)
def test_points_against_mpmath(name):
    x = arguments(name, np.random.default_rng(11), 800)
    result = FUNCTIONS[name](Interval.from_bounds(x, x))
    assert result.guaranteed.all()
    with mpmath.workprec(1400):
        for point, lo, hi in zip(x.tolist(), result.lo.tolist(), result.hi.tolist()):
            value = getattr(mpmath, name)(mpmath.mpf(point))
            assert mpmath.mpf(lo) <= value <= mpmath.mpf(hi), point
    normal = (np.abs(result.mid) > 1e-290) & result.is_bounded
    gaps = spacing(result.lo[normal], result.hi[normal])
    assert gaps.max() <= 3
    assert (gaps <= 1).mean() > 0.99  # neighbouring doubles, nearly always


def enclosed(name, count, seed):
    """Violations of containment against flint, which proves its own bounds."""
    import flint

    x = arguments(name, np.random.default_rng(seed), count)
    result = FUNCTIONS[name](Interval.from_bounds(x, x))
    bad = []
    before = flint.ctx.prec
    try:
        for point, lo, hi in zip(x.tolist(), result.lo.tolist(), result.hi.tolist()):
            flint.ctx.prec = 1300 if abs(point) > 1e15 and name in ("sin", "cos", "tan") else 250
            value = getattr(flint.arb(point), name)()
            if flint.arb(lo) > value or flint.arb(hi) < value:
                bad.append(point)
    finally:
        flint.ctx.prec = before
    return len(x), bad


@pytest.mark.parametrize("name", FUNCTIONS)
def test_many_points_against_flint(name):
    count, bad = enclosed(name, 6_000, 3)
    assert count > 4_500
    assert bad == []


@pytest.mark.slow
@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_million_points_against_flint(name):
    count, bad = enclosed(name, 1_600_000, 4)
    assert count > 1_000_000
    assert bad == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["atan2", "hypot"])
def test_a_million_boxes_against_flint(name):
    """Random points of random boxes, extreme ones included, the signs of all four quadrants."""
    import flint

    rng = np.random.default_rng(9)
    count = 1_300_000
    y, x = bounds(rng, count, empty=0.0), bounds(rng, count, empty=0.0)
    result = {"atan2": atan2, "hypot": hypot}[name](Interval.from_bounds(*y), Interval.from_bounds(*x))
    p, q = (np.where(rng.random(count) < 0.5, *pair) + 0.0 for pair in (y, x))
    fine = np.isfinite(p) & np.isfinite(q) & ((p != 0.0) | (q != 0.0))
    bad, before, flint.ctx.prec = [], flint.ctx.prec, 200
    try:
        for a, b, lo, hi in zip(*(v[fine].tolist() for v in (p, q, result.lo, result.hi))):
            u, v = flint.arb(a), flint.arb(b)
            value = flint.arb.atan2(u, v) if name == "atan2" else (u * u + v * v).sqrt()
            if a == 0.0 and name == "atan2":
                value = flint.arb.pi() if b < 0.0 else flint.arb(0)
            if name == "hypot" and 0.0 in (a, b):
                value = abs(u) + abs(v)
            if not (lo <= value and value <= hi):  # not certainly inside: more bits decide
                flint.ctx.prec = 4400
                value = flint.arb.atan2(flint.arb(a), flint.arb(b)) if name == "atan2" else (u * u + v * v).sqrt()
                flint.ctx.prec = 200
                if lo > value or hi < value:
                    bad.append((a, b))
    finally:
        flint.ctx.prec = before
    assert fine.sum() > 1_000_000
    assert bad == []


BOUNDS = st.tuples(st.floats(-30, 30), st.floats(0, 8), st.floats(0, 1))


@pytest.mark.long
@pytest.mark.parametrize("name", ["sin", "cos", "tan", "atan", "exp"])
@given(BOUNDS)
def test_ranges_hold_every_value(name, data):
    start, width, where = data
    x = Interval(start, start + width)
    y = FUNCTIONS[name](x)
    point = min(max(start + width * where, float(x.lo)), float(x.hi))
    with mpmath.workdps(60):
        value = getattr(mpmath, name)(mpmath.mpf(point))
        assert mpmath.mpf(float(y.lo)) <= value <= mpmath.mpf(float(y.hi))
    assert FUNCTIONS[name](Interval.from_bounds(point, point)).subset(y)


@given(BOUNDS)
def test_ranges_of_sine_and_cosine_are_tight(data):
    """Exactly -1 or 1 where an extremum is certain, else the values at the ends."""
    start, width, _ = data
    x = Interval(start, start + width)
    for function, shift in ((sin, 0.25), (cos, 0.0)):
        y = function(x)
        turns = (start / math.tau, float(x.hi) / math.tau)
        top = math.floor(turns[1] - shift) > math.floor(turns[0] - shift)
        ends = max(float(function(Interval.from_bounds(e, e)).hi) for e in (float(x.lo), float(x.hi)))
        margin = min(abs(t - shift - round(t - shift)) for t in turns)
        if margin > 1e-12:
            assert float(y.hi) == (1.0 if top else ends)


def test_extrema_at_the_very_ends():
    half = 0.5 * math.pi  # below the true value
    assert float(sin(Interval(0.0, half)).hi) <= 1.0
    assert float(sin(Interval(half, math.nextafter(half, 2.0))).hi) == 1.0
    assert float(sin(Interval(0.0, math.nextafter(half, 2.0))).hi) == 1.0
    assert float(sin(Interval(0.0, math.nextafter(half, 0.0))).hi) == 1.0  # rounded outward, not an extremum
    assert cos(Interval(0)).equal(Interval(1))
    assert sin(Interval(0)).equal(Interval(0))
    assert float(cos(Interval(-1, 1)).hi) == 1.0
    assert sin(Interval(-INF, 0.0)).equal(Interval(-1, 1))
    assert sin(Interval(0.0, 6.2831853)).equal(Interval(-1, 1))
    assert cos(Interval(WORST, math.nextafter(WORST, INF))).equal(Interval(-1, 1))
    assert not math.isfinite(float(tan(Interval(1.5, 1.6)).lo))
    assert math.isfinite(float(tan(Interval(1.5, half)).hi))
    assert not math.isfinite(float(tan(Interval(1.5, math.nextafter(half, 2.0))).hi))


def test_domains():
    assert exp(Interval(-INF, 0.0)).equal(Interval(0, 1))
    assert float(exp(Interval(710)).lo) == 1.7976931348623157e308
    assert float(exp(Interval(710)).hi) == INF
    assert log(Interval(0, 1)).equal(Interval(-INF, 0.0))
    assert log(Interval(-2, -1)).is_empty
    assert not log(Interval(0, 1)).guaranteed
    assert asin(Interval(2, 3)).is_empty
    assert asin(Interval(-2, 2)).subset(atan(Interval.entire()).inflate(1e-15))
    assert not acos(Interval(0.5, 2.0)).guaranteed
    assert float(acos(Interval(0.5, 2.0)).lo) == 0.0
    assert not tan(Interval(1, 2)).guaranteed
    assert int(tan(Interval(1, 2)).flags) & Decoration.DISCONTINUOUS
    for f in FUNCTIONS.values():
        assert f(Interval.empty()).is_empty
    assert atan(Interval.entire()).contains(1.5707963267948966)
    assert pi().contains(3.141592653589793)


@given(finite_numbers(), finite_numbers())
def test_angle_of_points(y, x):
    if y == 0.0 and x == 0.0:
        assert atan2(Interval(0), Interval(0)).is_empty
        return
    y, x = y + 0.0, x + 0.0  # no negative zeros: an interval has none
    result = atan2(Interval.from_bounds(y, y), Interval.from_bounds(x, x))
    with mpmath.workprec(2400):
        value = mpmath.atan2(mpmath.mpf(y), mpmath.mpf(x))
        assert mpmath.mpf(float(result.lo)) <= value <= mpmath.mpf(float(result.hi))
    assert spacing(result.lo, result.hi) <= 4 or abs(value) < 1e-280


@given(*[st.floats(-3, 3)] * 2, *[st.floats(0, 4)] * 2, *[st.floats(0, 1)] * 2)
def test_angle_of_boxes(y, x, height, width, s, t):
    box_y, box_x = Interval(y, y + height), Interval(x, x + width)
    result = atan2(box_y, box_x)
    py, px = min(y + s * height, float(box_y.hi)), min(x + t * width, float(box_x.hi))
    if py != 0.0 or px != 0.0:
        with mpmath.workdps(60):
            value = mpmath.atan2(mpmath.mpf(py), mpmath.mpf(px))
            assert mpmath.mpf(float(result.lo)) <= value <= mpmath.mpf(float(result.hi))
    if x < 0.0 and y < 0.0 < y + height:
        assert float(result.hi) > 3.14 > -3.14 > float(result.lo)
        assert not result.guaranteed


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_angles_of_boxes_on_one_side_are_those_of_corners(sign):
    """A box above or below the x axis: the smallest and the largest angle are at corners, and tight."""
    rng = np.random.default_rng(8)
    y, x = np.sort(sign * rng.uniform(0.01, 3.0, (300, 2))), np.sort(rng.uniform(-3.0, 3.0, (300, 2)))
    found = atan2(Interval.from_bounds(*y.T), Interval.from_bounds(*x.T))
    with mpmath.workdps(40):
        for k in range(300):
            angles = [mpmath.atan2(mpmath.mpf(float(b)), mpmath.mpf(float(a))) for a in x[k] for b in y[k]]
            lo, hi = float(found.lo[k]), float(found.hi[k])
            assert mpmath.mpf(lo) <= min(angles) < mpmath.mpf(math.nextafter(lo, math.inf))
            assert mpmath.mpf(math.nextafter(hi, -math.inf)) < max(angles) <= mpmath.mpf(hi)


def test_angle_at_the_cut():
    upper = atan2(Interval(0, 1), Interval(-2, -1))
    assert upper.guaranteed
    assert upper.contains(3.141592653589793)
    lower = atan2(Interval(-1, 0), Interval(-2, -1))
    assert not lower.guaranteed
    assert atan2(Interval(-1, -1e-300), Interval(-2, -1)).hi < 0.0
    assert atan2(Interval(1, INF), Interval(-INF, INF)).subset(Interval("[0, 3.1415926535897936]"))


@given(finite_numbers(), finite_numbers())
def test_distance(x, y):
    result = hypot(Interval.from_bounds(x, x), Interval.from_bounds(y, y))
    with mpmath.workprec(4400):
        value = mpmath.sqrt(mpmath.mpf(x) ** 2 + mpmath.mpf(y) ** 2)
        assert mpmath.mpf(float(result.lo)) <= value <= mpmath.mpf(float(result.hi))
    if 1e-290 < value < 1e300:
        assert spacing(result.lo, result.hi) <= 5


def test_distance_does_not_overflow_on_the_way():
    result = hypot(Interval("3e200"), Interval("4e200"))
    assert result.contains("5e200")
    assert float(result.width) < 1e187
    assert hypot(Interval("3e-200"), Interval("4e-200")).contains("5e-200")


def test_smaller_and_larger():
    a, b = Interval(0, 3), Interval(1, 2)
    assert minimum(a, b).equal(Interval(0, 2))
    assert maximum(a, b).equal(Interval(1, 3))
    assert minimum(a, Interval.empty()).is_empty
    assert sqr(Interval(-1, 2)).equal(Interval(0, 4))
    assert sqrt(Interval(4, 9)).equal(Interval(2, 3))


def test_constants_against_mpmath():
    from fractions import Fraction

    from graphsynth.intervals.kernels import double_double as constants, exponential, inverse, trigonometry

    with mpmath.workprec(1600):
        assert abs(mpmath.mpf(constants.pi_fixed(1500)) / mpmath.mpf(2) ** 1500 - mpmath.pi) < mpmath.mpf(2) ** -1499
        assert abs(mpmath.mpf(constants.log2_fixed(900)) / mpmath.mpf(2) ** 900 - mpmath.log(2)) < mpmath.mpf(2) ** -899
        for k in range(17):
            whole = mpmath.mpf(constants.atan_fixed(k, 16, 256)) / mpmath.mpf(2) ** 256
            assert abs(whole - mpmath.atan(mpmath.mpf(k) / 16)) < mpmath.mpf(2) ** -254
            parts = sum(map(mpmath.mpf, inverse._TABLE[k].tolist()))
            assert abs(parts - whole) <= mpmath.mpf(2) ** -106 * whole
        words = constants.two_over_pi_words(42)
        exact = int(mpmath.floor(2 / mpmath.pi * mpmath.mpf(2) ** 1344))
        assert sum(w << (32 * (41 - i)) for i, w in enumerate(words)) == exact
    assert Fraction(constants.PI[0]) < Fraction(constants.pi_fixed(200), 2**200) < Fraction(constants.PI[1])
    assert math.nextafter(constants.PI[0], 4.0) == constants.PI[1]
    assert math.floor(math.log(2.0) * 2**40) == exponential._TOP * 2**40
    assert trigonometry._WORDS.tolist() == words


@pytest.mark.parametrize(
    ("y", "x", "lo", "hi"),
    [
        ((0, 0), (0, 1), 0.0, 0.0),
        ((0, 0), (2, 3), 0.0, 0.0),
        ((0, 0), (-1, 0), 3.141592653589793, 3.1415926535897936),
        ((0, 0), (-1, 1), 0.0, 3.1415926535897936),
        ((0, 1), (0, 0), 1.5707963267948966, 1.5707963267948968),
        ((-1, 0), (0, 0), -1.5707963267948968, -1.5707963267948966),
        ((0, 1), (0, 1), 0.0, 1.5707963267948968),
        ((-1, 0), (0, 1), -1.5707963267948968, 0.0),
        ((0, 0), (0, 0), math.inf, -math.inf),
    ],
)
def test_angles_of_boxes_beside_the_origin(y, x, lo, hi):
    """The origin has no angle; what is left of the box has exactly these."""
    found = atan2(Interval(*y), Interval(*x))
    assert (float(found.lo), float(found.hi)) == (lo, hi)
