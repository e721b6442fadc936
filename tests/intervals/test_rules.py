"""The rules of theory/interval-tests 4, one by one: the naive way fails where this package does not."""

import copy
import math
import pickle
from fractions import Fraction

import mpmath
import numpy as np
import pytest

from graphsynth.core.errors import IntervalError
from graphsynth.intervals import (
    Decoration,
    Interval,
    Status,
    atan2,
    divide_extended,
    jacobian,
    krawczyk,
    log,
    pave,
    pave_cells,
    sin,
    solve_linear,
    sqrt,
)
from graphsynth.intervals.reading import enclose

INF = math.inf
U = 2.0**-53


def holds(x, value):
    """Exactly decided."""
    return bool(x.contains(value))


def test_rule_1_bounds_are_moved_outward():
    a, b = 0.1, 0.2
    exact = Fraction(a) + Fraction(b)
    assert Fraction(a + b) != exact  # naive: the nearest sum as both bounds
    assert holds(Interval(a, a) + Interval(b, b), exact)
    third = Fraction(1) / Fraction(3.0)
    assert Fraction(1.0 / 3.0) != third
    assert holds(Interval(1) / Interval(3), third)


def rump(x):
    """The predecessor bound as it is written, without care for infinities."""
    with np.errstate(all="ignore"):
        return float(np.float64(x) - (np.abs(np.float64(x)) * (U * (1 + 2 * U)) + 5e-324))


def test_rule_2_infinities():
    with np.errstate(all="ignore"):
        assert math.isnan(rump(np.float64(1e308) * 10.0))  # naive: NaN or +inf as a lower bound
        assert math.isnan(np.float64(0.0) * INF)
        assert math.isnan(np.float64(INF) - INF)
    assert float((Interval("1e308") * 10).lo) == 1.7976931348623157e308
    assert float((Interval("-1e308") * 10).hi) == -1.7976931348623157e308
    assert (Interval(0) * Interval.entire()).equal(Interval(0))
    assert (Interval(1, INF) - Interval(1, INF)).equal(Interval.entire())


def naive_product(a, b):
    ends = [x * y for x in a for y in b]
    return min(ends), max(ends)


def test_rule_3_the_empty_set():
    assert naive_product((INF, -INF), (1.0, 2.0)) == (-INF, INF)  # naive: the empty set becomes the line
    empty = Interval.empty()
    for result in (empty * Interval(1, 2), Interval(1, 2) - empty, empty / Interval(-1, 1), sqrt(empty), empty**3):
        assert result.is_empty
    for part in divide_extended(empty, Interval(-1, 2)):
        assert part.is_empty
    with pytest.raises(IntervalError, match="lower"):
        Interval(2, 1)  # not exchanged silently
    with pytest.raises(IntervalError, match="NaN"):
        Interval(math.nan, 1.0)


def test_rule_4_division():
    quotients = [x / y for x in (1.0, 2.0) for y in (-1.0, 4.0)]
    assert max(quotients) == 0.5  # naive: 1/0.001 is missing
    assert holds(Interval(1, 2) / Interval(-1, 4), 1000)
    assert (Interval(1, 2) / Interval(0, 4)).equal(Interval(0.25, INF))
    assert (Interval(0) / Interval(-1, 1)).equal(Interval(0))
    assert (Interval(1) / Interval(0)).is_empty
    first, second = divide_extended(1, Interval(-1, 4))
    assert (float(first.hi), float(second.lo)) == (-1.0, 0.25)


def test_rule_5_powers_and_domains():
    assert naive_product((-1.0, 2.0), (-1.0, 2.0)) == (-2.0, 4.0)  # naive: a square below 0
    assert (Interval(-1, 2) ** 2).equal(Interval(0, 4))
    assert (Interval(-3, -2) ** 3).equal(Interval(-27, -8))
    low = 0.1 * 0.1 * 0.1  # naive: an odd power of a negative interval rounded inward
    assert Fraction(low) > Fraction(0.1) ** 3
    assert holds(Interval(-0.1, -0.1) ** 3, -(Fraction(0.1) ** 3))
    clipped = sqrt(Interval(-1, 4))
    assert int((clipped + 1).flags) & Decoration.CLIPPED
    assert not log(Interval(0, 1)).guaranteed
    naive_root = krawczyk(lambda x: [sqrt(x[0]) - x[0]], ["[-1, 0.9]"])  # naive: K of the clipped part lies inside
    assert naive_root.status is Status.UNDECIDED


def test_rule_6_decimals():
    assert Fraction(0.03) != Fraction(3, 100)  # naive: the float is the number
    for text in ("0.03", "17.53", "1/30"):
        exact = Fraction(text)
        assert Fraction(float(exact)) != exact
        assert holds(Interval(text), exact)
        assert (float(Interval(text).lo), float(Interval(text).hi)) == enclose(exact)
    assert not Interval(0.03).exact_input
    assert Interval("0.03").exact_input
    assert not krawczyk(lambda x: [x[0] - 0.03], ["[0, 1]"]).exact_input
    assert (Interval(np.array([1, 2])) + np.array([3, 4])).equal(Interval([4, 6])).all()
    assert (np.int64(3) * Interval(1, 2)).exact_input
    assert not (np.float64(3) * Interval(1, 2)).exact_input


def test_rule_7_elementary_functions():
    with mpmath.workdps(60):
        points = np.linspace(0.1, 3.0, 50).tolist()
        wrong = [x for x in points if mpmath.mpf(math.sin(x)) != mpmath.sin(mpmath.mpf(x))]
        assert wrong  # naive: the library value as both bounds
        for x in wrong:
            y = sin(Interval(x, x))
            assert mpmath.mpf(float(y.lo)) <= mpmath.sin(mpmath.mpf(x)) <= mpmath.mpf(float(y.hi))
    # naive: the number of quarter turns by the float pi; wrong beside a multiple of pi/2
    half = 0.5 * math.pi  # below pi/2: the maximum lies beyond it
    assert math.floor(half / (math.pi / 2)) == 1
    far = 6381956970095103 * 2.0**797
    naive_turns = math.floor(far / (math.pi / 2)), math.floor(math.nextafter(far, INF) / (math.pi / 2))
    with mpmath.workprec(1400):
        true_turns = tuple(int(mpmath.floor(2 * mpmath.mpf(x) / mpmath.pi)) for x in (far, math.nextafter(far, INF)))
    assert naive_turns != true_turns
    assert sin(Interval(far, math.nextafter(far, INF))).equal(Interval(-1, 1))
    ends = [math.atan2(y, -1.0) for y in (-1.0, 1.0)]
    assert max(ends) < 3.0  # naive: the angles across the cut are missing
    angle = atan2(Interval(-1, 1), Interval(-1))
    assert float(angle.hi) > 3.14159
    assert int(angle.flags) & Decoration.DISCONTINUOUS


def test_rule_8_matrices_and_sums():
    a, b = np.array([1e16, 1.0, -1e16]), np.ones(3)
    assert float(a @ b) != 1.0 or float(a[[1, 0, 2]] @ b) != 1.0  # naive: lost, or dependent on the order
    assert holds(Interval.from_bounds(a, a).dot(Interval.from_bounds(b, b)), 1)
    found = solve_linear([[1, 1], [1, "1.0000000000000001"]], [2, 2])  # in floats singular
    assert np.linalg.matrix_rank(np.array([[1.0, 1.0], [1.0, 1.0000000000000001]])) == 1
    assert found.status in (Status.UNDECIDED, Status.UNIQUE)
    assert found.x.contains(np.array([2.0, 0.0])).all()


def test_rule_9_statuses():
    # naive: an overlap of K and X taken for existence; x^2 - x + 0.3 has no root
    no_root = lambda x: [x[0] ** 2 - x[0] + "0.3"]  # noqa: E731
    overlap = krawczyk(no_root, ["[0, 0.9]"], inflate=False)
    assert not overlap.box.is_empty.any()
    assert overlap.status is Status.UNDECIDED
    assert pave(no_root, ["[0, 0.9]"]).verdict is Status.EMPTY
    # naive: a singular midpoint Jacobian discarded; the two roots lie in such a box
    roots = pave(lambda x: [x[0] ** 2 - 2], ["[-4, 4]"])
    assert roots.solutions == 2
    # naive: a root on a cut is in neither interior
    assert pave(lambda x: [x[0] - 1], ["[0, 2]"]).solutions == 1
    # naive: one box for a wide parameter
    wide = ["[0.25, 9]"]
    assert krawczyk(lambda x, p: [x[0] ** 2 - p[0]], ["[0.1, 4]"], wide).status is Status.UNDECIDED
    assert pave_cells(lambda x, p: [x[0] ** 2 - p[0]], ["[0.1, 4]"], wide).verdict is Status.UNIQUE


# -- what a careful user tries ---------------------------------------------------------------------------------


def test_intervals_are_copied_and_sent_to_other_processes():
    x = sqrt(Interval([-1, "0.1"], [1, "0.2"]))
    for y in (copy.deepcopy(x), pickle.loads(pickle.dumps(x))):
        assert y.equal(x).all()
        assert (y.flags == x.flags).all()


@pytest.mark.parametrize(
    ("f", "parameters", "word"),
    [
        (lambda x: [math.sin(x[0])], None, "functions of graphsynth.intervals"),
        (lambda x: [np.sin(x[0])], None, "functions of graphsynth.intervals"),
        (lambda x, p: [x[0]], None, "parameters"),
        (lambda x, p: [x[0] - p[0]], 0.5, "shape"),
        (lambda x, p: [x[0] - p[0]], ["[empty]"], "nonempty"),
    ],
)
def test_systems_that_cannot_be_evaluated(f, parameters, word):
    for solve in (krawczyk, pave):
        with pytest.raises(IntervalError, match=word):
            solve(f, ["[-1, 1]"], parameters)


def test_derivatives_of_a_system():
    f = lambda x, p: [x[0] * x[1], sin(x[0]), 3]  # noqa: E731
    values, slopes = jacobian(f, Interval([[1, 2], [0, 1]]), Interval([7]))
    assert values.shape == (2, 3)
    assert slopes.shape == (2, 3, 2)
    assert slopes[0, 0].equal(Interval([2, 1])).all()
    assert slopes[1, 1, 0].equal(Interval(1))
    assert slopes[:, 2].equal(Interval.zeros((2, 2))).all()


def test_certificates_with_parameters_at_every_magnitude():
    """``x^2 = p`` for narrow and wide p from 2^-500 to 2^500: every status checked in rational numbers."""
    rng = np.random.default_rng(1)
    count = 1500
    low = np.ldexp(rng.uniform(0.5, 1.0, count), rng.integers(-500, 500, count))
    high = low * (1.0 + np.ldexp(rng.random(count), -rng.integers(0, 52, count)))
    ends = rng.choice([-1.0, 1.0], count) * np.sqrt(low)
    ends = np.sort(ends * (1.0 + np.ldexp(rng.normal(size=(2, count)), -rng.integers(0, 50, (2, count)))), axis=0)
    boxes, p = Interval(ends[0][:, None], ends[1][:, None]), Interval(low[:, None], high[:, None])
    from graphsynth.intervals import image

    seen = set()
    for f in (lambda x, p: [x[0] ** 2 - p[0]], lambda x, p: [x[0] - p[0] / x[0]], lambda x, p: [p[0] / x[0] ** 2 - 1]):
        found = image(f, boxes, p)
        seen |= set(found.status.tolist())
        for k, status in enumerate(found.status.tolist()):
            a, b = Fraction(float(ends[0, k])), Fraction(float(ends[1, k]))
            for q in (Fraction(float(low[k])), Fraction(float(high[k]))):
                positive = b >= 0 and b * b >= q and (a <= 0 or a * a <= q)
                negative = a <= 0 and a * a >= q and (b >= 0 or b * b <= q)
                number = int(positive) + int(negative)
                assert status == Status.UNDECIDED or {
                    Status.EMPTY: number == 0, Status.UNIQUE: number == 1, Status.EXISTS: number >= 1
                }[Status(status)]  # fmt: skip
    assert {Status.EMPTY, Status.UNIQUE, Status.UNDECIDED} <= seen
