"""Krawczyk's test: what it proves, and that it never proves what is false."""

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth import intervals
from graphsynth.core.errors import IntervalError
from graphsynth.intervals import (
    Interval,
    Status,
    atan2,
    gauss_seidel,
    image,
    krawczyk,
    maximum,
    minimum,
    pave,
    solve_linear,
    sqrt,
    tan,
    variables,
)  # fmt: skip

# -- derivatives -------------------------------------------------------------------------------------------------------


def formulas(x, y, m):
    """Return the same expressions by this package's functions or by mpmath's (module ``m``)."""
    return {
        "polynomial": lambda: x**3 * y - 2 * x / (y + 3) + y**-2,
        "roots": lambda: m.sqrt(x) * m.hypot(x, y) / (y * y),
        "circular": lambda: m.sin(x * y) + m.cos(x) * m.tan(y) - 1 / x,
        "inverse": lambda: m.atan(x) * m.asin(y / 3) + m.acos(x / 4) + m.atan2(y, x),
        "exponential": lambda: m.exp(x - y) * m.log(x + y) - abs(x),
        "choice": lambda: lesser(x, y) * greater(x * x, 0.25) + (-y),
    }


NAMES = ["polynomial", "roots", "circular", "inverse", "exponential", "choice"]


def lesser(x, y):
    return min(x, y) if isinstance(x, mpmath.mpf) else minimum(x, y)


def greater(x, y):
    return max(x, y) if isinstance(x, mpmath.mpf) else maximum(x, y)


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=15, deadline=None)
@given(st.floats(0.5, 1.4), st.floats(0.5, 1.4), st.floats(0, 0.1))
def test_derivatives_hold_the_true_ones(name, x, y, width):
    box = Interval.from_bounds([[x, y]], [[x + width, y + width]])
    result = formulas(*variables(box), intervals)[name]()
    theirs = lambda a, b: formulas(a, b, mpmath)[name]()  # noqa: E731
    with mpmath.workdps(40):
        for corner in [(x, y), (box.hi[0, 0], box.hi[0, 1])]:
            a, b = (mpmath.mpf(float(c)) for c in corner)
            assert mpmath.mpf(result.value.lo[0]) <= theirs(a, b) <= mpmath.mpf(result.value.hi[0])
            if (name == "choice" and abs(a - b) < 1e-9) or (name == "choice" and abs(a * a - 0.25) < 1e-9):
                continue
            slopes = [mpmath.diff(lambda s: theirs(s, b), a), mpmath.diff(lambda s: theirs(a, s), b)]  # noqa: B023
            for k in range(2):
                slack = mpmath.mpf(10) ** -15 * (1 + abs(slopes[k]))  # of the numerical derivative
                assert mpmath.mpf(result.grad.lo[k, 0]) - slack <= slopes[k] <= mpmath.mpf(result.grad.hi[k, 0]) + slack


# -- semantics ---------------------------------------------------------------------------------------------------------


def circle_and_parabola(x):
    return [x[0] ** 2 + x[1] ** 2 - 1, x[0] - x[1] ** 2]


def test_second_problem_of_the_specification():
    result = krawczyk(circle_and_parabola, ["[0.5, 0.7]", "[0.7, 0.9]"])
    assert result.status is Status.UNIQUE
    assert result.exact_input
    with mpmath.workdps(40):
        x = (mpmath.sqrt(5) - 1) / 2
        for value, i in ((x, 0), (mpmath.sqrt(x), 1)):
            assert mpmath.mpf(result.box.lo[i]) <= value <= mpmath.mpf(result.box.hi[i])
    assert float(result.box.width.max()) < 1e-14
    assert result.spectral_radius < 1e-12
    assert result.contraction < 1.0
    assert result.domain.subset(Interval(["[0.5, 0.7]", "[0.7, 0.9]"])).all()


def test_no_solution():
    assert krawczyk(circle_and_parabola, ["[0, 0.3]", "[0, 0.3]"]).status is Status.EMPTY
    assert krawczyk(circle_and_parabola, ["[0.7, 0.8]", "[0.7, 0.8]"]).status is Status.EMPTY
    assert krawczyk(lambda x: [x[0] ** 2 + 1], ["[-9, 9]"]).box.is_empty.all()


def test_several_solutions_prove_nothing():
    result = krawczyk(lambda x: [x[0] ** 2 - 2], ["[-4, 4]"])
    assert result.status is Status.UNDECIDED
    assert "singular" in result.reason


def test_interval_parameters_hold_for_every_value():
    result = krawczyk(lambda x, p: [x[0] ** 2 - p[0]], ["[1, 3]"], ["[2, 3]"])
    assert result.status is Status.UNIQUE
    assert result.box.contains(np.sqrt(2.0)).all()
    assert result.box.contains(np.sqrt(3.0)).all()
    # for p above 9 there is no solution, for p below there is one: nothing holds for all
    assert krawczyk(lambda x, p: [x[0] ** 2 - p[0]], ["[1, 3]"], ["[8, 10]"]).status is Status.UNDECIDED


def test_a_solution_on_a_face_needs_inflation():
    f = lambda x: [x[0] - 1, x[1] - 2]  # noqa: E731
    result = krawczyk(f, ["[0, 1]", "[0, 4]"])
    assert result.status in (Status.UNIQUE, Status.EXISTS)
    root = Interval(2).sqrt()
    right = krawczyk(lambda x: [x[0] ** 2 - 2], Interval.from_bounds([float(root.lo)], [2.0]))
    assert right.status is not Status.EMPTY
    outside = krawczyk(lambda x: [x[0] ** 2 - 2], Interval.from_bounds([float(root.hi) * (1 + 1e-9)], [2.0]))
    assert outside.status is Status.EMPTY
    near = krawczyk(lambda x: [x[0] ** 2 - 2], Interval.from_bounds([1.0], [float(root.hi)]))
    assert near.status in (Status.UNIQUE, Status.UNDECIDED)


@pytest.mark.parametrize(
    ("box", "allowed"),
    [
        # the only root near lies on a face, just inside, just outside, on an edge of two boxes that share it
        (["[1, 3]"], {Status.UNIQUE, Status.EXISTS, Status.UNDECIDED}),
        (["[-1, 1]"], {Status.UNIQUE, Status.EXISTS, Status.UNDECIDED}),
        ([(1.0 - 1e-15, 3.0)], {Status.UNIQUE, Status.EXISTS, Status.UNDECIDED}),
        ([(1.0 + 1e-14, 3.0)], {Status.EMPTY, Status.UNDECIDED}),
        ([(-1.0, 1.0 - 1e-14)], {Status.EMPTY, Status.UNDECIDED}),
        ([(1.0, 1.0)], {Status.UNIQUE, Status.EXISTS, Status.UNDECIDED}),
        ([(math.nextafter(1.0, 2.0), 2.0)], {Status.EMPTY, Status.UNDECIDED}),
    ],
)
@pytest.mark.parametrize("scale", [1, "0.1", "1/3"])
def test_a_root_at_a_face_is_never_lost(box, allowed, scale):
    """What an enlarged box proves about the given one: never that it is empty while the root lies in it."""
    bounds = [Interval(b) if isinstance(b, str) else Interval.from_bounds(*b) for b in box]
    start = Interval.stack(bounds)
    factor = Interval(scale)
    for f in (lambda x: [(x[0] - 1) * factor], lambda x: [(x[0] - 1) * (x[0] + 9) * factor]):
        assert krawczyk(f, start).status in allowed
        assert krawczyk(f, start, rounds=1).status in allowed
        found = pave(f, start)
        assert (found.verdict is Status.EMPTY) <= (Status.EMPTY in allowed)
        assert (found.verdict is Status.UNIQUE) <= (Status.UNIQUE in allowed)


@pytest.mark.parametrize("inner", [0.5, 1.0, 2.0])
def test_inflation_around_a_corner(inner):
    """Two unknowns: the enlarged box overlaps the corner; outside in one unknown alone is outside."""
    corner = Interval.from_bounds([1.0, 2.0], [3.0, 4.0])
    for root, has in (((1.0, 2.0), True), ((3.0, 4.0), True), ((1.0 - 1e-12, 3.0), False), ((2.0, 4.0 + 1e-12), False),
                      ((2.0, 3.0), True)):  # fmt: skip
        f = lambda x, r=root: [x[0] - r[0] + (x[1] - r[1]) * 0.125 * inner, x[1] - r[1]]  # noqa: E731
        status = krawczyk(f, corner).status
        assert status is not Status.EMPTY if has else status in (Status.EMPTY, Status.UNDECIDED)
        verdict = pave(f, corner).verdict
        assert verdict is not Status.EMPTY if has else verdict in (Status.EMPTY, Status.UNDECIDED)


@pytest.mark.parametrize("steps", [1, 2, 3, 5, 8])
@pytest.mark.parametrize("scale", [1, "0.1", "1/3", "[0.9, 1.1]"])
def test_a_root_just_outside_one_face_is_not_inside(steps, scale):
    """Inside in one unknown, some steps outside in the other: whatever an enlarged box proves, the box has no root."""
    root = 1.0
    for _ in range(steps):
        root = math.nextafter(root, 0.0)
    factor, box = Interval(scale), Interval.from_bounds([1.0, 2.0], [3.0, 4.0])
    # x1 - x1 keeps the equations alone from excluding the box
    f = lambda x: [(x[0] - root) * factor + (x[1] - x[1]) * factor, (x[1] - 3) * factor]  # noqa: E731
    assert not krawczyk(f, box).status.proves_existence
    assert not pave(f, box).verdict.proves_existence


def test_clipped_and_discontinuous_systems_certify_nothing():
    assert krawczyk(lambda x: [sqrt(x[0]) - "0.5"], ["[-1, 1]"]).status is Status.UNDECIDED
    assert krawczyk(lambda x: [tan(x[0])], ["[1, 2]"]).status is Status.UNDECIDED
    assert krawczyk(lambda x: [1 / x[0]], ["[-1, 1]"]).status is not Status.UNIQUE
    assert krawczyk(lambda x: [sqrt(x[0]) + 1], ["[-1, 1]"]).status is Status.EMPTY
    # the angle jumps by a turn across the cut: a sign change there is no root
    jump = krawczyk(lambda x: [atan2(x[0], -1) + x[0]], ["[-0.5, 0.25]"])
    assert not jump.status.proves_existence


def test_a_plain_float_is_reported():
    assert not krawczyk(lambda x: [x[0] ** 2 - 0.1], ["[0.1, 1]"]).exact_input
    assert krawczyk(lambda x: [x[0] ** 2 - "0.1"], ["[0.1, 1]"]).exact_input


@pytest.mark.parametrize(
    ("box", "word"),
    [([], "shape"), (Interval.entire(2), "unbounded"), (Interval.empty(2), "empty"), ([[1, 2]], "shape")],
)
def test_bad_boxes(box, word):
    with pytest.raises(IntervalError, match=word):
        krawczyk(circle_and_parabola, box)


def test_equations_and_unknowns_must_match():
    with pytest.raises(IntervalError, match="1 equations for 2 unknowns"):
        krawczyk(lambda x: [x[0]], ["[0, 1]", "[0, 1]"])


# -- no false certificate ------------------------------------------------------------------------------------------


def status_is_true(roots, start, width):
    """Check the status of a product of (x - r) on a box against the exact roots; return it."""
    box = Interval(Fraction(start, 256), Fraction(start + width, 256))

    def f(x):
        product = x[0] - roots[0]
        for r in roots[1:]:
            product = product * (x[0] - r)
        return [product]

    result = krawczyk(f, box.reshape(1))
    inside = [r for r in set(roots) if float(box.lo) <= r <= float(box.hi)]
    if result.status is Status.EMPTY:
        assert inside == []
    elif result.status is Status.UNIQUE:
        assert len(inside) == 1
    elif result.status is Status.EXISTS:
        assert inside
    assert all(result.box[0].contains(r) for r in inside)
    return result.status


@pytest.mark.long
@settings(max_examples=80, deadline=None)
@given(
    st.lists(st.integers(-64, 64), min_size=1, max_size=4), st.integers(-1, 1), st.integers(-1100, 1100),
    st.integers(1, 900), st.integers(0, 52),
)  # fmt: skip
def test_status_against_exactly_known_roots(numerators, shift, start, width, depth):
    """Single, double and close roots, on boxes with roots at and near their faces."""
    roots = [Fraction(k, 16) for k in numerators]
    roots[-1] = roots[-1] + Fraction(shift, 2**depth)
    status_is_true(roots, start, width)


@pytest.mark.slow
def test_ten_thousand_certificates():
    rng = np.random.default_rng(17)
    seen = dict.fromkeys(Status, 0)
    for _ in range(10_000):
        roots = [Fraction(int(k), 16) for k in rng.integers(-64, 65, rng.integers(1, 5))]
        roots[-1] += Fraction(int(rng.integers(-1, 2)), 2 ** int(rng.integers(0, 53)))
        start = int(rng.integers(-1100, 1100))
        if rng.random() < 0.5:  # near a root, so that certificates are common
            start = int(256 * roots[0]) - int(rng.integers(0, 30))
        seen[
            status_is_true(roots, start, int(rng.integers(1, 40) if rng.random() < 0.7 else rng.integers(1, 900)))
        ] += 1
    assert seen[Status.UNIQUE] > 2000
    assert seen[Status.EMPTY] > 1000


@pytest.mark.parametrize("gap", [0.0, 2.0**-52, 2.0**-40, 1e-9, -1e-9, -(2.0**-52)])
@pytest.mark.parametrize("half", [0.5, 1e-3, 1e-6])
def test_tangent_curves(gap, half):
    """A circle and a line that touch, cut twice, or miss by little: never unique with two, never empty with one."""
    f = lambda x: [x[0] ** 2 + x[1] ** 2 - 1, x[0] - (1 + Interval(Fraction(gap)))]  # noqa: E731
    box = Interval.from_bounds([1 - half, -half], [1 + half, half])
    status = krawczyk(f, box).status
    if gap > 0.0:
        assert not status.proves_existence  # misses
    elif gap == 0.0:
        assert status is Status.UNDECIDED  # a double root cannot be proved by a test that is stable under rounding
    else:
        assert status is Status.UNDECIDED or half**2 < -gap  # two roots, unless the box cuts them off


def test_empty_by_one_step():
    """x^2 = 2 on an interval that ends just before or just after the root."""
    root = Interval(2).sqrt()
    below, above = float(root.lo), float(root.hi)
    f = lambda x: [x[0] ** 2 - 2]  # noqa: E731
    left = krawczyk(f, Interval.from_bounds([1.0], [below]))
    assert not left.status.proves_existence
    right = krawczyk(f, Interval.from_bounds([above], [2.0]))
    assert not right.status.proves_existence
    both = krawczyk(f, Interval.from_bounds([below], [above]))
    assert both.status in (Status.UNIQUE, Status.UNDECIDED)


def test_a_double_root_is_never_certified():
    for half in (1.0, 1e-4, 1e-9, 1e-15):
        result = krawczyk(lambda x: [(x[0] - 1) ** 2], Interval.from_bounds([1 - half], [1 + half]))
        assert result.status is Status.UNDECIDED
        assert not krawczyk(
            lambda x: [(x[0] - 1) ** 2 + "1e-40"], Interval.from_bounds([1 - half], [1 + half])
        ).status.proves_existence


def test_many_boxes_at_once_equal_one_by_one():
    rng = np.random.default_rng(2)
    lo = rng.uniform(-1.5, 1.0, (200, 2))
    boxes = Interval.from_bounds(lo, lo + rng.uniform(0.0, 0.6, (200, 2)))
    together = image(circle_and_parabola, boxes)
    for k in range(200):
        alone = image(circle_and_parabola, boxes[k : k + 1])
        assert alone.status[0] == together.status[k]
        assert (alone.image.lo[0] == together.image.lo[k]).all()
    assert set(together.status.tolist()) >= {Status.EMPTY, Status.UNIQUE, Status.UNDECIDED}


def test_a_box_where_nothing_is_guaranteed_spoils_no_other():
    boxes = Interval.from_bounds([[0.9], [-1.0], [0.9]], [[1.1], [2.0], [1.1]])
    found = image(lambda x: [sqrt(x[0]) - 1], boxes)
    assert found.status.tolist() == [Status.UNIQUE, Status.UNDECIDED, Status.UNIQUE]


# -- linear systems ------------------------------------------------------------------------------------------


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 5))
def test_linear_systems_hold_every_solution(seed, n):
    """Exact solutions of random members of the system, by fractions."""
    rng = np.random.default_rng(seed)
    mid = rng.integers(-8, 9, (n, n)) + 12 * np.eye(n)
    width = rng.integers(0, 5, (n, n)) / 64
    A = Interval.from_bounds(mid - width, mid + width)
    b = Interval.from_bounds(rng.integers(-9, 1, n).astype(float), rng.integers(1, 9, n).astype(float))
    result = solve_linear(A, b)
    x = gauss_seidel(A, b, Interval.from_bounds(np.full(n, -1e6), np.full(n, 1e6)))
    for _ in range(8):
        member = [[Fraction(float(v)) for v in row] for row in np.where(rng.random((n, n)) < 0.5, A.lo, A.hi)]
        right = [Fraction(float(v)) for v in np.where(rng.random(n) < 0.5, b.lo, b.hi)]
        solution = solve_exactly(member, right)
        if solution is None:
            assert result.status is Status.UNDECIDED
            continue
        assert all(result.x[i].contains(s) for i, s in enumerate(solution))
        if all(abs(s) < 10**6 for s in solution):
            assert all(x.x[i].contains(s) for i, s in enumerate(solution))
    if (width == 0.0).all():
        assert result.spectral_radius < 1e-6 or result.status is Status.UNDECIDED


def solve_exactly(matrix, right):
    n = len(right)
    rows = [[*row, r] for row, r in zip(matrix, right)]
    for k in range(n):
        pivot = next((i for i in range(k, n) if rows[i][k]), None)
        if pivot is None:
            return None
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [v / rows[k][k] for v in rows[k]]
        for i in range(n):
            if i != k:
                rows[i] = [v - rows[i][k] * w for v, w in zip(rows[i], rows[k])]
    return [row[-1] for row in rows]


def test_singular_systems():
    assert solve_linear([[1, 2], [2, 4]], [1, 2]).status is Status.UNDECIDED
    assert solve_linear([["[-1, 1]"]], [1]).status is Status.UNDECIDED
    # Hilbert's matrix of order 8: nearly singular, yet proved regular
    hilbert = Interval([[Fraction(1, i + j + 1) for j in range(8)] for i in range(8)])
    result = solve_linear(hilbert, [1] * 8)
    assert result.status is Status.UNIQUE
    exact = solve_exactly([[Fraction(1, i + j + 1) for j in range(8)] for i in range(8)], [Fraction(1)] * 8)
    assert all(result.x[i].contains(v) for i, v in enumerate(exact))
    assert solve_linear(Interval([[1e30, 0], [0, 1e-30]]), [1, 1]).status is Status.UNIQUE


def test_gauss_seidel_proves_emptiness():
    assert gauss_seidel([[2, 0], [0, 1]], [2, 2], ["[2, 3]", "[0, 3]"]).status is Status.EMPTY
    cut = gauss_seidel([["[-1, 1]"]], [1], ["[-0.5, 3]"])
    assert float(cut.x.lo[0]) == 1.0
    with pytest.raises(IntervalError, match="square"):
        solve_linear([[1, 2]], [1])


def test_traps_of_the_literature():
    """Rump's expression: 333.75 b^6 + a^2 (11 a^2 b^2 - b^6 - 121 b^4 - 2) + 5.5 b^8 + a/(2 b)."""
    a, b = Interval(77617), Interval(33096)
    value = "333.75" * b**6 + a**2 * (11 * a**2 * b**2 - b**6 - 121 * b**4 - 2) + "5.5" * b**8 + a / (2 * b)
    assert value.contains(Fraction(77617, 2 * 33096) - 2)
    assert not value.contains(np.float64(1.1726039400531787)) or float(value.width) > 1e10
    # (x - 1)^8 expanded, near 1: the sign is unknown, and the enclosure says so
    x = Interval("0.995")
    p = x**8 - 8 * x**7 + 28 * x**6 - 56 * x**5 + 70 * x**4 - 56 * x**3 + 28 * x**2 - 8 * x + 1
    assert p.contains(Fraction(-1, 200) ** 8)


def test_what_is_no_system_is_refused():
    with pytest.raises(IntervalError, match="cannot be called"):
        krawczyk(None, ["[0, 1]"])
    with pytest.raises(IntervalError, match="must return a list"):
        krawczyk(lambda x: None, ["[0, 1]"])
