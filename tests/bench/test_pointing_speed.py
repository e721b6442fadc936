"""How fast the closed form of the pointing mechanism is, beside scipy on its twelve loop equations.

Run by the normal suite once each, without timing; with times: ``pytest tests/bench/test_pointing_speed.py
--benchmark-enable``.  No time is asserted: machines differ.  Poses per second are in the columns of extra information
and in ``docs/explanation/pointing-mechanism.md``.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from graphsynth.kinematics.pointing import PointingMechanism
from graphsynth.kinematics.pointing.loop_equations import loop_equations

ART = PointingMechanism()


def cranks(count):
    return np.random.default_rng(1).uniform(-0.7, 0.7, (2, count))


def timed(benchmark, run, poses):
    result = benchmark.pedantic(run, rounds=9, warmup_rounds=1)
    if benchmark.stats:
        benchmark.extra_info["poses per second"] = f"{poses / benchmark.stats.stats.min:.3g}"
    return result


@pytest.mark.parametrize("order", ["YX", "XY"])
def test_closed_form(benchmark, order):
    count = 1_000_000 if benchmark.enabled else 1000
    x, y = cranks(count)
    poses = timed(benchmark, lambda: PointingMechanism(order=order).poses(x, y), count)
    assert poses.assembled.all()


def test_all_modes(benchmark):
    count = 200_000 if benchmark.enabled else 100
    x, y = cranks(count)
    assert (timed(benchmark, lambda: ART.solve(x, y), count).count >= 2).all()


def test_rates(benchmark):
    count = 200_000 if benchmark.enabled else 100
    x, y = cranks(count)
    assert np.isfinite(timed(benchmark, lambda: ART.rates(x, y, 1.0, 1.0), count).dda).all()


def test_inverse(benchmark):
    count = 200_000 if benchmark.enabled else 100
    poses = ART.poses(*cranks(count))
    assert timed(benchmark, lambda: ART.cranks(poses.a, poses.b), count).reached.all()


def test_passive_angles(benchmark):
    count = 50_000 if benchmark.enabled else 100
    poses = ART.poses(*cranks(count))
    assert np.isfinite(timed(benchmark, lambda: ART.passive_angles(poses), count).x).all()


def test_twelve_equations_by_newton(benchmark):
    """Many poses at once, analytic Jacobian, from the rest pose."""
    count = 2000 if benchmark.enabled else 20
    x, y = cranks(count)
    assert timed(benchmark, lambda: ART.solve_loops(x, y), count).genuine.all()


@pytest.mark.parametrize("analytic", [False, True])
def test_twelve_equations_by_fsolve(benchmark, analytic):
    """SciPy's hybr by continuation along the published sweep."""
    from scipy.optimize import fsolve

    count = 100 if benchmark.enabled else 3
    angles = np.linspace(0.0, math.radians(40.0), count + 1)[1:]

    def follow():
        x, worst = np.zeros(12), 0.0
        for phi in angles:
            both = np.full((1, 2), phi)
            fprime = (lambda v, p=both: loop_equations(ART, v[None], p).jacobian[0]) if analytic else None
            x = fsolve(lambda v, p=both: loop_equations(ART, v[None], p).residual[0], x + 1e-9, fprime=fprime)
            worst = max(worst, np.abs(loop_equations(ART, x[None], both).residual).max())
        return worst

    # its own flag is not believed: the residual is checked
    assert timed(benchmark, follow, count) < 1e-7


def test_the_trap_of_tiny_unknowns():
    """Section 2.11: started from 1e-41, finite differences underflow and fsolve returns the start."""
    import warnings

    from scipy.optimize import fsolve

    def equation(x):
        return np.cos(x) - 1.0 + x - 0.1

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        trapped = fsolve(equation, 1e-41)
        analytic = fsolve(equation, 1e-41, fprime=lambda x: np.diag(1.0 - np.sin(x)))
    assert abs(equation(trapped)[0]) == pytest.approx(0.1)
    assert abs(equation(fsolve(equation, 1e-8))[0]) < 1e-12
    assert abs(equation(analytic)[0]) < 1e-12
    # our own solution from unknowns of that size is right
    solved = ART.solve_loops(0.3, 0.3, start=np.full(12, 1e-41))
    np.testing.assert_allclose(solved.x, ART.passive_angles(ART.poses(0.3, 0.3)).x, rtol=0, atol=2e-15)
