"""The exact hull: reference values, brute-force clipping, samples, extreme cases."""

from decimal import Decimal
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Interval, Status
from graphsynth.jamming.bearing.bearing import Bearing
from graphsynth.jamming.intersection.hull import Reason, circle_ellipse, exact_hull, mirrored, surrogate_problem

B90 = "17.4617879639289313590283215334"
ULP = 4e-16


def close(bounds, expected):
    """Bounds lie outside the decimal values (good to half a unit of their last digit), by a few roundings at most."""
    for k, (lo, hi) in enumerate(expected):
        lo, hi = Fraction(lo), Fraction(hi)
        for value, bound, sign in ((lo, bounds.lo[k], 1), (hi, bounds.hi[k], -1)):
            slack = sign * (value - Fraction(float(bound)))
            digits = Fraction(1, 10**22)
            assert -digits <= slack <= abs(value) * Fraction(ULP) + digits


HULLS = [
    (
        "0",
        "13.11490802879096276551727 13.11490802879096276551727 11.58659515976778845911871 11.58659515976778845911871",
    ),
    (
        "1e-12",
        "13.11490802728940913618112 13.11490803029251639468150 11.58659515806821775022441 11.58659516146735916776371",
    ),
    (
        "1e-9",
        "13.11490652723724755728604 13.11490953034450605768957 11.58659346019695503934472 11.58659685933837257868377",
    ),
    (
        "1e-6",
        "13.11340638919384018378296 13.11640949647202360219709 11.58489546439062678637722 11.58829460584473449768323",
    ),
    (
        "1e-3",
        "11.51587326726977120518672 14.53912955095568154052795 9.739851739145069863547885 13.17701266950068029306394",
    ),
    ("1e-2", "0 17.50028571195339084827388 0 17.50028571195339084827388"),
]


@pytest.mark.parametrize(("eps", "numbers"), HULLS)
def test_reference_hulls(eps, numbers):
    found = exact_hull(circle_ellipse("17.5", "17.53", B90, eps=eps))
    x0, x1, y0, y1 = numbers.split()
    close(found.hull, [(x0, x1), (y0, y1)])
    assert found.status is (Status.UNDECIDED if eps == "1e-2" else Status.UNIQUE)
    if eps == "1e-2":
        assert found.reasons == (Reason.TOUCHES_X, Reason.TOUCHES_Y)
        assert len(found.four) == 1


def test_reference_different_tolerances():
    found = exact_hull(circle_ellipse("17.5", "17.53", B90, "1e-3", "1e-6"))
    close(
        found.hull,
        [("13.10850140189148743244032", "13.12131152758367451247872"),
         ("11.57938615800076761795533", "11.59379967899259973598900")],
    )  # fmt: skip


def test_reference_ranges_of_the_radii():
    found = exact_hull(circle_ellipse("17.5 +- 0.001", "[17.529, 17.531]", "[17.461, 17.462]"))
    close(
        found.hull,
        [("12.83170424860185077321160", "13.43874902430272593057451"),
         ("11.21093330913187315691290", "11.89799844832790404113219")],
    )  # fmt: skip
    assert found.status is Status.UNIQUE


@pytest.mark.parametrize(
    ("R1", "eps", "expected", "reason"),
    [
        ("17.53", "0", [("17.53", "17.53"), ("0", "0")], Reason.TANGENT_LONG),
        ("17.53", "1e-9", [("17.52999887662644729619965", "17.53000000002852253280089"),
                           ("0", "0.006275705179167286322514133")], Reason.TOUCHES_Y),
        (B90, "0", [("0", "0"), ("17.46178796392893135902832",) * 2], Reason.TANGENT_SHORT),
        (B90, "1e-9", [("0", "0.006275784850982951066368807"),
                       ("17.46178683619571042637229", "17.46178796395756531112031")], Reason.TOUCHES_X),
    ],
)  # fmt: skip
def test_reference_tangency(R1, eps, expected, reason):
    found = exact_hull(circle_ellipse(R1, "17.53", B90, eps=eps))
    close(found.hull, expected)
    assert found.status is Status.UNDECIDED
    assert found.reasons == (reason,)
    assert len(found.four) == 2  # the copies on the axis are merged


def test_surrogate_of_the_bearing_at_the_worst_pose():
    with mpmath.workdps(40):
        sine = mpmath.nstr(mpmath.mpf("0.4") * mpmath.sin(mpmath.mpf(1) / 30), 36)
    problem = surrogate_problem(Bearing(), sine)
    assert abs(problem.b.lo - Fraction(B90)) < Fraction(1, 10**27)
    close(exact_hull(problem).hull, [("13.11490802879096276551727",) * 2, ("11.58659515976778845911871",) * 2])


def test_amplification_of_the_tolerance():
    """Half widths in the squares (6.2), and the factor a^2 / (a^2 - b^2) at the worst pose."""
    eps, b = Fraction(1, 10**6), Fraction(B90)
    found = exact_hull(circle_ellipse("17.5", "17.53", b, eps=eps)).squares[0]
    half = (Fraction(float(found.hi)) - Fraction(float(found.lo))) / 2
    assert float(half / (eps * (1 + b * b))) == pytest.approx(128.7468716303685825185188, rel=1e-9)
    a = Fraction("17.53")
    assert float(a * a / (a * a - b * b)) == pytest.approx(128.7468716303685825185188, rel=1e-15)


def clipped_hull(R1, a, b, e1, e2):
    """Hull in (u, v) by clipping the parallelogram edge by edge; None if nothing is left."""
    span = a**2 - b**2
    corners = []
    for s1, s2 in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        Q, E = R1**2 + s1 * e1, 1 + s2 * e2
        corners.append((a**2 * (Q - b**2 * E) / span, b**2 * (a**2 * E - Q) / span))
    for axis in (0, 1):
        kept = []
        for p, q in zip(corners, corners[1:] + corners[:1]):
            if p[axis] >= 0:
                kept.append(p)
            if (p[axis] < 0) != (q[axis] < 0) and p[axis] != q[axis]:
                t = p[axis] / (p[axis] - q[axis])
                kept.append((p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])))
        corners = kept
        if not corners:
            return None
    return [(min(c[k] for c in corners), max(c[k] for c in corners)) for k in (0, 1)]


small = st.fractions(min_value=0, max_value=Fraction(3, 2), max_denominator=40)
size = st.fractions(min_value=Fraction(1, 4), max_value=4, max_denominator=24)


@settings(max_examples=50, deadline=None)
@given(size, size, size, small, small)
def test_hull_agrees_with_clipping(R1, b, extra, e1, e2):
    a = b + extra
    found, expected = exact_hull(circle_ellipse(R1, a, b, e1, e2)), clipped_hull(R1, a, b, e1, e2)
    if expected is None:
        assert found.status is Status.EMPTY
        return
    assert found.status is not Status.EMPTY
    for k, (lo, hi) in enumerate(expected):
        assert Fraction(float(found.squares.lo[k])) <= lo <= Fraction(float(np.nextafter(found.squares.lo[k], np.inf)))
        assert Fraction(float(found.squares.hi[k])) >= hi >= Fraction(float(np.nextafter(found.squares.hi[k], -np.inf)))
        assert Fraction(float(found.hull.lo[k])) ** 2 <= lo
        assert Fraction(float(found.hull.hi[k])) ** 2 >= hi
    everywhere = all(c > 0 for c in unclipped_minimum(R1, a, b, e1, e2))
    assert (found.status is Status.UNIQUE) == everywhere


def unclipped_minimum(R1, a, b, e1, e2):
    """Smallest u and v of the parallelogram, times ``a^2 - b^2``."""
    return R1**2 - e1 - b**2 * (1 + e2), a**2 * (1 - e2) - R1**2 - e1


@pytest.mark.long
@settings(max_examples=30, deadline=None)
@given(size, size, size, small, small, st.randoms(use_true_random=False))
def test_ranges_of_the_radii_with_tolerances(R1, b, extra, e1, e2, random):
    """Every solution for parameters inside the ranges lies in the hull; no solution if it is empty."""
    e1, e2 = e1 / 20, e2 / 20
    spread = [Fraction(random.randrange(8), 400) for _ in range(3)]
    ranges = [(value - d, value + d) for value, d in zip((R1, b + extra, b), spread)]
    found = exact_hull(circle_ellipse(*ranges, e1, e2))
    low, high = (
        ([Fraction(float(v)) for v in side] for side in (found.squares.lo, found.squares.hi))
        if (found.status is not Status.EMPTY)
        else ([1, 1], [0, 0])
    )
    for _ in range(40):
        r, p, q = (lo + (hi - lo) * Fraction(random.randrange(4), 3) for lo, hi in ranges)
        Q, E = r**2 + e1 * random.randint(-1, 1), 1 + e2 * random.randint(-1, 1)
        u, v = p**2 * (Q - q**2 * E) / (p**2 - q**2), q**2 * (p**2 * E - Q) / (p**2 - q**2)
        if u >= 0 and v >= 0:
            assert low[0] <= u <= high[0]
            assert low[1] <= v <= high[1]


def test_equal_axes():
    assert exact_hull(circle_ellipse(2, 2, 2)).reasons == (Reason.COINCIDENT,)
    assert exact_hull(circle_ellipse(2, 2, 2)).hull.equal(Interval([["[0, 2]"], ["[0, 2]"]]).reshape(2)).all()
    assert exact_hull(circle_ellipse(2, 2, 2)).status is Status.UNDECIDED
    assert exact_hull(circle_ellipse(3, 2, 2)).reasons == (Reason.CIRCLE_OUTSIDE,)
    assert exact_hull(circle_ellipse(1, 2, 2)).reasons == (Reason.CIRCLE_INSIDE,)
    assert exact_hull(circle_ellipse(1, 2, 2)).status is Status.EMPTY
    ring = exact_hull(circle_ellipse(2, 2, 2, "0.5", "0.25"))
    assert ring.reasons == (Reason.RING,)
    assert ring.squares.hi.tolist() == [4.5, 4.5]  # min(4 + 0.5, 4 (1 + 0.25))


def test_ranges_of_the_axes_that_overlap_are_enclosed_and_not_called_exact():
    found = exact_hull(circle_ellipse("1", "[0.9, 1.2]", "[0.8, 1.1]"))
    assert not found.tight
    assert found.reasons == (Reason.NOT_SEPARATED,)
    for a, b in ((1.2, 0.8), (1.1, 0.9), (1.0, 1.0)):
        if a > b:
            x2 = a * a * (1 - b * b) / (a * a - b * b)
            assert found.squares.contains(np.array([x2, 1 - x2])).all()


def test_wide_tolerances_are_defined():
    for e1, e2 in ((0, 1), (0, 2), (25, 0), (100, 3)):
        found = exact_hull(circle_ellipse(5, 6, 4, e1, e2))
        assert found.status is Status.UNDECIDED
        expected = clipped_hull(Fraction(5), Fraction(6), Fraction(4), Fraction(e1), Fraction(e2))
        assert [float(v) for pair in expected for v in pair] == pytest.approx(
            [found.squares.lo[0], found.squares.hi[0], found.squares.lo[1], found.squares.hi[1]], rel=1e-15
        )


@pytest.mark.parametrize("unit", [Fraction(1, 10**9), Fraction(10**9)])
def test_change_of_unit(unit):
    for e in ("0", "1e-6", "1e-2"):
        plain = exact_hull(circle_ellipse("17.5", "17.53", B90, e, e))
        values = [Fraction(v) * unit for v in ("17.5", "17.53", B90)]
        other = exact_hull(circle_ellipse(*values, Fraction(e) * unit**2, e))
        assert other.status is plain.status
        assert other.reasons == plain.reasons
        np.testing.assert_allclose(other.hull.hi / float(unit), plain.hull.hi, rtol=1e-15)


def test_near_circular_keeps_all_digits():
    d = Fraction(1, 10**12)
    found = exact_hull(circle_ellipse(1, 1 + d, 1 - d))
    with mpmath.workdps(60):
        a, b = 1 + mpmath.mpf(10) ** -12, 1 - mpmath.mpf(10) ** -12
        x = a * mpmath.sqrt((1 - b * b) / (a * a - b * b))
    assert found.hull.lo[0] <= x <= found.hull.hi[0]
    assert found.hull.width.max() < 3e-16


def test_touching_by_one_part_in_1e30_is_decided():
    tiny = Fraction(1, 10**30)
    assert exact_hull(circle_ellipse(6 + tiny, 6, 4)).status is Status.EMPTY
    assert exact_hull(circle_ellipse(6 - tiny, 6, 4)).status is Status.UNIQUE
    assert exact_hull(circle_ellipse(6, 6, 4)).status is Status.UNDECIDED


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("x", 2, 1), "R1 = 'x' is not a finite number"),
        ((float("nan"), 2, 1), "not a finite number"),
        ((0, 2, 1), "R1 = 0.0 must be positive"),
        ((1, 2, 0), "b = 0.0 must be positive"),
        ((1, 1, 2), "exchange them"),
        ((1, 2, 1, -1), "e1 = -1.0 must be zero or more"),
        (("[2, 1]", 2, 1), "exchange them"),
        ((None, 2, 1), "not a finite number"),
        ((1j, 2, 1), "not a finite number"),
        (("1e999999999", 2, 1), "not a finite number"),
        (("1e9_999_999_999", 2, 1), "not a finite number"),
        ((Decimal("1e999999999"), 2, 1), "not a finite number"),
        (("1/0", 2, 1), "not a finite number"),
        ((True, 2, 1), "not a finite number"),
        ((Interval("[1, 2]").hull(Interval.entire()), 2, 1), "not a finite number"),
    ],
)
def test_bad_input_gets_a_sentence(arguments, words):
    with pytest.raises(GeometryError, match=r"\S") as caught:
        circle_ellipse(*arguments)
    assert words in str(caught.value)


def test_eps_beside_e1_is_refused():
    with pytest.raises(GeometryError, match="either eps"):
        circle_ellipse(1, 2, 1, 1, eps=1)


def test_poses_of_the_bearing_without_a_crossing():
    """No tilt, and a tilt of 4e-9: circle inside the ellipse, no division by a^2 - b^2 (theory/extreme-cases 1)."""
    for sine in ("0", "4e-9"):
        found = exact_hull(surrogate_problem(Bearing(), sine, eps="1e-9"))
        assert found.status is Status.EMPTY
        assert found.reasons == (Reason.CIRCLE_INSIDE,)
    no_clearance = Bearing(clearance=0.0)
    assert exact_hull(surrogate_problem(no_clearance, "0")).reasons == (Reason.COINCIDENT,)
    assert exact_hull(surrogate_problem(no_clearance, "0.01")).reasons == (Reason.TANGENT_LONG,)


def test_steep_tilt_has_no_surrogate():
    with pytest.raises(GeometryError, match="lid_area"):
        surrogate_problem(Bearing(), "0.999")
    with pytest.raises(GeometryError, match="exceeds 1"):
        surrogate_problem(Bearing(), "1.5")


def test_mirror_images():
    box = Interval.from_bounds([1.0, 2.0], [1.5, 2.5])
    assert mirrored(box).lo.tolist() == [[1, 2], [1, -2.5], [-1.5, -2.5], [-1.5, 2]]
    both = mirrored(Interval.from_bounds([0.0, 0.0], [1.0, 2.0]))
    assert (both.lo.tolist(), both.hi.tolist()) == ([[-1, -2]], [[1, 2]])
    assert len(mirrored(Interval.empty(2))) == 0
