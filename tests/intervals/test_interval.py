"""Making, reading, printing, comparing intervals."""

import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, strategies as st

from graphsynth.core.errors import FormatError, IntervalError
from graphsynth.intervals import Decoration, Interval
from graphsynth.testing import finite_numbers

INF = math.inf


@given(st.fractions(), st.fractions(min_value=0))
def test_exact_numbers_are_enclosed_as_tightly_as_possible(value, radius):
    x = Interval(value)
    lo, hi = float(x.lo), float(x.hi)
    assert Fraction(lo) <= value <= Fraction(hi)
    assert hi == lo or hi == math.nextafter(lo, INF)
    assert x.exact_input
    spread = Interval.midrad(value, radius)
    assert spread.contains(value - radius)
    assert spread.contains(value + radius)


@given(st.decimals(allow_nan=False, allow_infinity=False, places=12))
def test_decimal_text(value):
    for written in (value, str(value)):
        assert Interval(written).contains(Fraction(value))


@pytest.mark.parametrize("text", ["0.03", "17.53", "1/30", "1e-400", "-1e400", "3"])
def test_texts_of_the_problem(text):
    x = Interval(text)
    value = Fraction(text)
    assert x.lo == -INF or Fraction(float(x.lo)) <= value
    assert x.hi == INF or Fraction(float(x.hi)) >= value
    assert float(x.lo) <= float(x.hi)


def test_pairs_spreads_and_bounds():
    assert Interval("[0.1, 0.2]").contains("0.1")
    assert Interval("17.5 +- 0.005").contains("17.505")
    assert Interval("17.5±0.005").contains("17.495")
    assert Interval("[1, inf]").equal(Interval(1, INF))
    assert Interval("[empty]").is_empty
    assert Interval("0.1", "0.2").contains("0.2")
    assert Interval([["0.1", 2], [Fraction(1, 3), Decimal("0.5")]]).shape == (2, 2)


def test_floats_are_marked_and_bounds_are_not():
    assert not Interval(0.1).exact_input
    assert not (Interval("0.1") + 0.1).exact_input
    assert (Interval("0.1") + 1).exact_input
    assert Interval.from_bounds(0.1, 0.2).exact_input
    assert Interval([0.1, "0.1"]).exact_input.tolist() == [False, True]
    assert Interval(np.array([0.5])).flags == Decoration.FLOAT_INPUT


@pytest.mark.parametrize(
    ("make", "error", "word"),
    [
        (lambda: Interval(math.nan), IntervalError, "nan"),
        (lambda: Interval(1.0, math.nan), IntervalError, "NaN"),
        (lambda: Interval(np.array([1.0, math.nan])), IntervalError, "nan"),
        (lambda: Interval(INF), IntervalError, "inf"),
        (lambda: Interval(2, 1), IntervalError, "lower <= upper"),
        (lambda: Interval(INF, INF), IntervalError, "hold no number"),
        (lambda: Interval("[2, 1]"), IntervalError, "exchange"),
        (lambda: Interval("1 +- -1"), IntervalError, "negative radius"),
        (lambda: Interval.midrad(1, -1), IntervalError, "negative"),
        (lambda: Interval("one"), FormatError, "not a number"),
        (lambda: Interval("1e999999999"), FormatError, "exponent"),
        (lambda: Interval(Decimal("1e999999")), FormatError, "exponent"),
        (lambda: Interval(Decimal("nan")), IntervalError, "point"),
        (lambda: Interval("1" * 20000), FormatError, "characters"),
        (lambda: Interval(1j), FormatError, "complex"),
        (lambda: Interval(True), FormatError, "truth"),
        (lambda: Interval([[1], [1, 2]]), IntervalError, "lengths"),
        (lambda: Interval(np.zeros(2), np.ones(3)), IntervalError, "shapes"),
        (lambda: Interval(2) ** 0.5, IntervalError, "integer"),
    ],
)  # fmt: skip
def test_bad_input_gets_a_sentence(make, error, word):
    with pytest.raises(error, match=word):
        make()


FLOATS = finite_numbers()


@given(FLOATS, FLOATS)
def test_what_is_printed_holds_the_interval(a, b):
    x = Interval(min(a, b), max(a, b))
    text = repr(x).removeprefix("Interval([").removesuffix("])")
    lo, hi = (Fraction(part) for part in text.split(", "))
    assert lo <= Fraction(float(x.lo))
    assert hi >= Fraction(float(x.hi))
    assert x.subset(Interval("[" + text + "]"))


@given(FLOATS, FLOATS)
def test_measures(a, b):
    lo, hi = min(a, b), max(a, b)
    x = Interval(lo, hi)
    mid, rad, width = float(x.mid), float(x.rad), float(x.width)
    assert lo <= mid <= hi
    assert width == INF or Fraction(width) >= Fraction(hi) - Fraction(lo)
    assert rad == INF or (
        Fraction(mid) - Fraction(rad) <= Fraction(lo) and Fraction(mid) + Fraction(rad) >= Fraction(hi)
    )
    assert float(x.mag) == max(abs(lo), abs(hi))
    assert float(x.mig) == (0.0 if lo <= 0.0 <= hi else min(abs(lo), abs(hi)))
    left, right = x.bisect()
    assert left.hull(right).equal(x)
    assert x.interior(x.inflate(0.1)) or abs(lo) > 1e307 or abs(hi) > 1e307


def test_comparisons_and_sets():
    a, b, c = Interval(0, 1), Interval(1, 2), Interval(3, 4)
    assert a.certainly_less(c)
    assert not a.certainly_less(b)
    assert a.certainly_less_equal(b)
    assert a.possibly_less(b)
    assert not c.possibly_less(a)
    assert a.possibly_equal(b)
    assert a.disjoint(c)
    assert a.intersect(b).equal(Interval(1))
    assert a.intersect(c).is_empty
    assert a.hull(c).equal(Interval(0, 4))
    assert Interval.empty().subset(a)
    assert Interval.empty().interior(a)
    assert not a.interior(Interval(0, 2))
    assert Interval.entire().interior(Interval.entire())
    assert np.isnan(Interval.empty().mid)
    assert float(Interval.entire().mid) == 0.0
    assert float(Interval(1, INF).mid) > 1e307


def test_neither_truth_nor_equality():
    with pytest.raises(TypeError, match="neither true nor false"):
        bool(Interval(1))
    with pytest.raises(TypeError, match="no =="):
        Interval(1) == Interval(1)  # noqa: B015


def test_shapes():
    x = Interval(np.zeros((2, 3)), np.ones((2, 3)))
    assert x[0].shape == (3,)
    assert x[:, 1].shape == (2,)
    assert x.sum(axis=0).shape == (3,)
    assert float(x.sum().hi) == 6.0
    assert (x + Interval([1, 2, 3])).shape == (2, 3)
    assert (np.ones(3) * x).shape == (2, 3)
    assert len(list(x)) == 2
    assert Interval.stack([x, x], axis=-1).shape == (2, 3, 2)
    assert float(Interval(["0.1"] * 10).sum().lo) < 1 < float(Interval(["0.1"] * 10).sum().hi)
    with pytest.raises(AttributeError, match="does not change"):
        x.lo = np.zeros(3)
    with pytest.raises(ValueError, match="read-only"):
        x.lo[0, 0] = 5.0


def test_contains_refuses_what_is_no_number():
    with pytest.raises(FormatError, match="not a number"):
        Interval(1, 2).contains("one")


def test_bounds_in_extended_precision_are_rounded_outward():
    low, high = 1 - np.longdouble(2) ** -60, 1 + np.longdouble(2) ** -60
    for made in (Interval(low, high), Interval(np.array([low]), np.array([high]))[0], Interval([low, high])[0]):
        assert made.lo <= low
    for made in (
        Interval(low, high),
        Interval(np.array([low]), np.array([high]))[0],
        Interval(np.array([low, high]))[1],
    ):
        assert made.hi >= high
    assert not Interval(np.array([low])).exact_input.any()
    assert Interval(np.array(low)).lo < low and Interval(np.array(3)).contains(3) and Interval(np.array(0.5)).rad == 0.0
    assert Interval(-np.longdouble(np.inf), low).lo == -INF


def test_exponents_with_underscores_do_not_hang():
    with pytest.raises(FormatError, match="exponent"):
        Interval("1e9_999_999_999")
    with pytest.raises(FormatError, match="not a number"):
        Interval("1e+_9")


def test_halves_of_the_empty_set_are_empty():
    left, right = Interval.empty(2).bisect()
    assert left.is_empty.all() and right.is_empty.all()
    mixed = Interval.from_bounds([INF, 0.0], [-INF, 2.0]).bisect()
    assert [half.is_empty.tolist() for half in mixed] == [[True, False]] * 2
    assert mixed[0][1].equal(Interval(0, 1)) and mixed[1][1].equal(Interval(1, 2))


def test_an_infinity_is_no_number_of_any_interval():
    for x in (Interval.entire(), Interval(0, INF), Interval(-INF, 0)):
        for point in (INF, -INF, math.nan, np.float64(INF), np.float32(-INF), Decimal("inf"), Decimal("nan")):
            assert x.contains(point) is False
    both = Interval.entire(2)
    assert both.contains(np.array([INF, 1.0])).tolist() == [False, True]
    assert both.contains(-INF).tolist() == [False, False]
    assert both.contains(np.array([1, 2])).tolist() == [True, True]
    assert Interval(1, 2).contains(np.array(1.5)) and Interval(1, 2).contains(np.int64(2))


def test_bounded_are_intervals_with_two_finite_ends():
    lo, hi = np.array([-1.0, 0.0, -INF, -INF, INF]), np.array([2.0, INF, 0.0, INF, -INF])
    assert Interval.from_bounds(lo, hi).is_bounded.tolist() == [True, False, False, False, False]


def test_midpoints_of_half_lines():
    largest = float(np.finfo(np.float64).max)
    assert Interval(0, INF).mid == largest and Interval(-INF, 5).mid == -largest
    assert Interval.entire().mid == 0.0 and np.isnan(Interval.empty().mid)
    assert Interval(largest, INF).mid == largest and Interval(-largest, largest).mid == 0.0


@pytest.mark.parametrize(
    ("make", "error", "word"),
    [
        (lambda x: x.contains(None), FormatError, "None is not a number"),
        (lambda x: x.contains([1.0]), FormatError, "not a number"),
        (lambda x: x.contains("one"), FormatError, "not a number"),
        (lambda x: x.contains(True), FormatError, "not a number"),
        (lambda x: x.contains(np.array(["a", "b"])), FormatError, "not a number"),
        (lambda x: x.contains(np.zeros(3)), IntervalError, "do not fit"),
        (lambda x: x.contains(np.array([2**60, 1])), FormatError, "number by number"),
        (lambda x: x + Interval([1, 2, 3]), IntervalError, "do not fit"),
        (lambda x: x * np.zeros(3), IntervalError, "do not fit"),
        (lambda x: x.hull([1, 2, 3]), IntervalError, "do not fit"),
        (lambda x: x.intersect(Interval([1, 2, 3])), IntervalError, "do not fit"),
        (lambda x: x.certainly_less([1, 2, 3]), IntervalError, "do not fit"),
        (lambda x: x.subset(Interval([1, 2, 3])), IntervalError, "do not fit"),
        (lambda x: x + None, FormatError, "NoneType"),
        (lambda x: x.hull(None), FormatError, "NoneType"),
    ],
)
def test_a_wrong_operand_gets_a_sentence(make, error, word):
    with pytest.raises(error, match=word):
        make(Interval([1, 2]))
