"""How fast circle and ellipse are solved and their areas enclosed, beside python-flint and mpmath on the same formulas.

Run by the normal suite once each, without timing; with times: ``pytest tests/bench/test_circle_ellipse_speed.py
--benchmark-enable -n0``. No time is asserted: machines differ. Every benchmark checks its result; measured times are in
``docs/theory/circle-and-ellipse.md``.
"""

from __future__ import annotations

import flint
import mpmath
import numpy as np
import pytest

from graphsynth.intervals import Interval, Status, pave
from graphsynth.jamming.bearing.areas_enclosed import area_curve, enclose_lid_area
from graphsynth.jamming.intersection import kernels
from graphsynth.jamming.intersection.boxes import krawczyk_boxes, krawczyk_data
from graphsynth.jamming.intersection.hull import circle_ellipse, exact_hull

B = "17.4617879639289313590283215334"
X0, Y0 = 13.11490802879096276551727, 11.58659515976778845911871


def bearing(eps="0"):
    return circle_ellipse("17.5", "17.53", B, eps=eps)


@pytest.mark.parametrize("eps", ["0", "1e-6"])
def test_exact_hull(benchmark, eps):
    found = benchmark(lambda: exact_hull(bearing(eps)))
    assert found.hull.contains(np.array([X0, Y0])).all()


def test_exact_hull_in_flint_balls(benchmark, monkeypatch):
    """The same closed form without tolerances and without decisions."""
    monkeypatch.setattr(flint.ctx, "prec", 64)  # some versions read 17.53 as a ball twice as large as others

    def hull():
        R, a, b = (flint.arb(v) for v in ("17.5", "17.53", B))
        span = (a - b) * (a + b)
        return a * ((R - b) * (R + b) / span).sqrt(), b * ((a - R) * (a + R) / span).sqrt()

    x, y = benchmark(hull)
    assert x.contains(flint.arb("13.11490802879096276551727"))
    assert float(y.rad()) < 1e-12


@pytest.mark.parametrize("eps", ["0", "1e-6"])
def test_krawczyk_boxes(benchmark, eps):
    problem = bearing(eps)
    found = benchmark(lambda: krawczyk_boxes(problem))
    assert found.status is Status.UNIQUE


def test_krawczyk_kernel_alone(benchmark):
    """Without posing the problem and without making the result; the target is 0.1 ms for both."""
    data, side = krawczyk_data(bearing()), 17.500000000000004

    def search():
        queue, state = np.empty((4000, 4)), np.zeros(5, dtype=np.int64)
        queue[0], state[kernels.TAIL] = (0.0, side, 0.0, side), 1
        proved = np.empty((16, 8))
        kernels.search(queue, state, np.empty((2000, 4)), np.zeros(2000, np.bool_), proved, data, 1e-6 * side, 20_000)
        return state, proved

    state, proved = benchmark(search)
    assert state[kernels.PROVED] == 1
    assert proved[0, 4] <= X0 <= proved[0, 5]


def test_krawczyk_by_the_general_solver(benchmark):
    system = lambda z: [z[0] ** 2 + z[1] ** 2 - Q, z[0] ** 2 * alpha + z[1] ** 2 * beta - 1]  # noqa: E731
    Q, alpha, beta = Interval("306.25"), 1 / Interval("17.53").sqr(), 1 / Interval(B).sqr()
    found = benchmark.pedantic(lambda: pave(system, ["[0, 17.6]", "[0, 17.6]"]), rounds=3, warmup_rounds=1)
    assert (np.asarray(found.status) == Status.UNIQUE).sum() == 1


def test_boxes_to_the_limit(benchmark):
    """20000 boxes of the problem that cannot be certified."""
    problem = bearing("1e-4")
    found = benchmark.pedantic(lambda: krawczyk_boxes(problem), rounds=3, warmup_rounds=1)
    assert not found.finished


def lid_direct(number, S, sqrt, atan2):
    """Direct form of A_lid (theory/circle-and-ellipse 4) in any arithmetic."""
    R, c, h = number("17.5"), number("0.03"), number("5")
    C, q = sqrt(1 - S * S), number("17.53")
    p, d = q * C, h * S
    k, H = (S / C) ** 2 / (q * q), (S / C) ** 2 / (q * q) * R + d / (p * p)
    gap = h * S - c + q * S * S / (1 + C)
    G = gap * (R + d + p) / (p * p)
    m = G / (H + sqrt(H * H - k * G))
    X, y = R - m, sqrt(m * (2 * R - m))
    return R * R * atan2(y, X) + d * y - p * q * atan2(y / q, (d + X) / p)


SINES = np.linspace(0.0065, 0.0133, 200)


def test_lid_areas_enclosed(benchmark):
    S = Interval.from_bounds(SINES, SINES)
    found = benchmark(lambda: enclose_lid_area("17.5", "0.03", 5, S))
    assert (found.width < 2e-13).all()


def test_lid_areas_in_flint_balls(benchmark):
    def areas():
        return [lid_direct(flint.arb, flint.arb(s), flint.arb.sqrt, lambda y, x: flint.arb.atan2(y, x))
                for s in SINES.tolist()]  # fmt: skip

    found = benchmark(areas)
    mine = enclose_lid_area("17.5", "0.03", 5, Interval.from_bounds(SINES, SINES))
    assert all(ball.overlaps(flint.arb(float(mid), 1e-13)) for ball, mid in zip(found, mine.mid))


def test_lid_areas_in_mpmath(benchmark):
    with mpmath.workdps(30):
        found = benchmark(
            lambda: [lid_direct(mpmath.mpf, mpmath.mpf(s), mpmath.sqrt, mpmath.atan2) for s in SINES.tolist()]
        )
    mine = enclose_lid_area("17.5", "0.03", 5, Interval.from_bounds(SINES, SINES))
    assert all(lo <= value <= hi for lo, value, hi in zip(mine.lo, found, mine.hi))


def test_area_curve_over_a_turn(benchmark):
    curve = benchmark(lambda: area_curve())
    assert curve.lid.width.max() < 1e-12
