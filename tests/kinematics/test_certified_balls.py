"""Balls contain what they stand for; Krawczyk's test proves roots where they are and nothing where they are not."""

from __future__ import annotations

from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from graphsynth.intervals.balls import Balls, exact, tau_times, unit
from graphsynth.intervals.guard import check_rounding
from graphsynth.intervals.moving import Budget, cover, prove_nodes

NUMBER = st.floats(-1e100, 1e100, allow_subnormal=True)
OPERATIONS = [lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a * b, lambda a, b: a / b]


def contains(ball: Balls, value: Fraction) -> bool:
    mid, rad = float(ball.mid), float(ball.rad)
    return rad == np.inf or abs(Fraction(mid) - value) <= Fraction(rad)


@given(
    NUMBER,
    NUMBER,
    st.sampled_from(range(4)),
    st.floats(0, 1e-3),
    st.floats(0, 1e-3),
    st.floats(-1, 1),
    st.floats(-1, 1),
)
@example(5e-324, 1.1125369292536007e-308, 3, 0.0, 0.0007252308933841355, 0.0, 1.0)  # radius times quotient underflows
@example(2.0**-1074, 2.0**-1073, 3, 0.0, 0.0, 0.0, 0.0)
@settings(max_examples=300)
def test_operations_contain_the_exact_result(
    a: float, b: float, k: int, ra: float, rb: float, s: float, t: float
) -> None:
    """For members of both operands, at the middle and at the rim."""
    operation = OPERATIONS[k]
    wide_a, wide_b = ra * abs(a), rb * abs(b)
    with np.errstate(all="ignore"):
        result = operation(Balls(np.array(a), np.array(wide_a)), Balls(np.array(b), np.array(wide_b)))
    for x, y in ((0.0, 0.0), (s, t), (1.0, -1.0)):
        p, q = Fraction(a) + Fraction(x) * Fraction(wide_a), Fraction(b) + Fraction(y) * Fraction(wide_b)
        if k == 3 and q == 0:
            assert float(result.rad) == np.inf
            continue
        assert contains(result, operation(p, q))


@given(*[st.floats(-1e6, 1e6)] * 4)
def test_complex_product_contains_the_exact_one(a: float, b: float, c: float, d: float) -> None:
    result = exact(np.array(complex(a, b))) * exact(np.array(complex(c, d)))
    x = Fraction(a) * Fraction(c) - Fraction(b) * Fraction(d)
    y = Fraction(a) * Fraction(d) + Fraction(b) * Fraction(c)
    dx, dy = Fraction(float(result.mid.real)) - x, Fraction(float(result.mid.imag)) - y
    assert dx * dx + dy * dy <= Fraction(float(result.rad)) ** 2


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=30), st.floats(0, 0.1))
def test_directions_contain_the_exact_ones(angles: list[float], radius: float) -> None:
    z = unit(Balls(np.array(angles), np.full(len(angles), radius)))
    with mp.workdps(40):
        for k, angle in enumerate(angles):
            for member in (angle, mp.mpf(angle) + radius, mp.mpf(angle) - radius):
                assert abs(mp.expj(member) - mp.mpmathify(complex(z.mid[k]))) <= z.rad[k]
            assert z.rad[k] <= radius * 1.001 + 2e-15 * max(1.0, abs(angle))


def test_turns_and_undefined_angles() -> None:
    with mp.workdps(40):
        for turns in (1.0, 3.0, -7.0, 1024.0):
            ball = tau_times(turns)
            assert abs(2 * mp.pi * turns - mp.mpf(float(ball.mid))) <= float(ball.rad)
    assert np.isinf(unit(exact(np.array([np.nan, np.inf, 1e300]))).rad).all()
    check_rounding()


class Parabola:
    """``x^2 + c = u``: two branches that merge at u = c."""

    weights = np.ones(1)

    def __init__(self, c: float) -> None:
        self.c = c

    def units(self, x: np.ndarray, u: np.ndarray, checked: bool = True) -> Balls:
        return exact(np.zeros((len(x), 0), dtype=complex))

    def residual(self, x: Balls, u: Balls, units: Balls) -> Balls:
        return x * x + exact(self.c) - Balls(u.mid[:, None], u.rad[:, None])

    def derivatives(self, x: Balls, u: Balls, units: Balls) -> tuple[Balls, Balls]:
        J = exact(2.0) * x
        return Balls(J.mid[..., None], J.rad[..., None]), exact(-np.ones_like(x.mid))

    def branch(self, x: Balls, u: np.ndarray) -> tuple[np.ndarray, Balls]:
        return np.zeros((len(x.mid), 0), dtype=np.int64), exact(np.zeros((len(x.mid), 0)))


def run(c: float, u: list[float], x: list[float]) -> tuple[np.ndarray, list[tuple[float, float]]]:
    system = Parabola(c)
    nodes = prove_nodes(system, exact(np.array(u)), np.array(x)[:, None])
    found = cover(system, nodes, Budget(5000, 20.0))
    return found.covered, found.undecided


def test_a_branch_is_covered_up_to_close_to_its_fold() -> None:
    covered, undecided = run(0.0, [1e-8, 1.0, 4.0, 9.0], [1e-4, 1.0, 2.0, 3.0])
    assert covered.all() and not undecided
    covered, undecided = run(0.0, [0.0, 1.0, 4.0], [0.0, 1.0, 2.0])
    assert covered.tolist() == [False, True]


@pytest.mark.parametrize("gap", [1.0, 1e-3, 1e-6, 1e-9])
def test_samples_of_two_branches_are_not_linked(gap: float) -> None:
    """Before and after the jump everything is proved, across it nothing, however close the branches are."""
    u = [gap * gap * (1 + k / 4) for k in range(6)]
    x = [np.sqrt(v) * (1 if k < 3 else -1) for k, v in enumerate(u)]
    covered, _ = run(0.0, u, x)
    assert covered.tolist() == [True, True, False, True, True]


def test_an_empty_gap_between_samples_is_not_stepped_over() -> None:
    """``|u| = sqrt(x^2 + c)`` in disguise: both samples are assembled, between them nothing is."""

    class Gap(Parabola):
        def residual(self, x: Balls, u: Balls, units: Balls) -> Balls:
            v = Balls(u.mid[:, None], u.rad[:, None])
            return x * x - v * v + exact(self.c)

        def derivatives(self, x: Balls, u: Balls, units: Balls) -> tuple[Balls, Balls]:
            J, _ = super().derivatives(x, u, units)
            return J, exact(-2.0) * Balls(u.mid[:, None], u.rad[:, None])

    for c, possible in ((1e-12, False), (-1e-12, True)):
        system = Gap(c)
        nodes = prove_nodes(system, exact(np.array([-1.0, 1.0])), np.array([[1.0], [1.0]]))
        found = cover(system, nodes, Budget(5000, 20.0))
        assert bool(found.covered[0]) == possible
