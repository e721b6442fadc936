"""How fast the closed form of the pointing mechanism is, beside scipy on its twelve loop equations.

Run by the normal suite once each, without timing; with times: ``pytest tests/bench/test_pointing_speed.py
--benchmark-enable -n0``. No time is asserted: machines differ. Poses per second are in the columns of extra information
and in ``docs/explanation/pointing-mechanism.md``.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from graphsynth.systems.antenna import PointingMechanism
from graphsynth.systems.antenna.loop_equations import loop_equations

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


def turned(axis, angle, v):
    c, s = math.cos(angle), math.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    w = list(v)
    w[i], w[j] = c * v[i] - s * v[j], s * v[i] + c * v[j]
    return w


def plain_residual(x, phi_x, phi_y):
    """The twelve equations in plain Python: each chain applied to the vectors it needs."""
    l1, l2, l3, l4, l5 = ART.lengths
    leg_y = ((0, phi_x, None), (1, x[4], l3), (2, x[3], None), (0, x[2], l2), (1, x[1], None), (0, x[0], None))
    leg_x = ((1, phi_y, None), (0, x[10], l5), (2, x[9], None), (1, x[8], l4), (0, x[7], None), (1, x[6], None))
    position, direction_z, direction_x = [], [], []
    for chain, start, goal in (
        (leg_y, [0.0, -l1, 0.0], (0.0, l3 - l1, l2)),
        (leg_x, [-l1, 0.0, 0.0], (l5 - l1, 0.0, l4)),
    ):
        p, z, e = start, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]
        shifts = [2 if length in (l2, l4) else (1 if chain is leg_y else 0) for _, _, length in chain]
        for (axis, angle, length), along in zip(reversed(chain), reversed(shifts)):
            if length is not None:
                p = list(p)
                p[along] += length
            p, z, e = turned(axis, angle, p), turned(axis, angle, z), turned(axis, angle, e)
        position += [(a - b) / l1 for a, b in zip(p, goal)]
        z, e = (turned(0, -x[5], turned(1, -x[11], v)) for v in (z, e))
        direction_z += z[:2]
        direction_x.append(e[1])
    return [*position, *direction_z, *direction_x]


def test_plain_residual_is_the_same():
    random = np.random.default_rng(2)
    x, phi = random.uniform(-2, 2, 12), random.uniform(-2, 2, 2)
    want = loop_equations(ART, x[None], phi[None]).residual[0]
    np.testing.assert_allclose(plain_residual(x.tolist(), *phi), want, rtol=0, atol=3e-15)


def test_twelve_equations_by_fsolve(benchmark):
    """SciPy's hybr by continuation along the published sweep."""
    from scipy.optimize import fsolve

    count = 400 if benchmark.enabled else 5
    angles = np.linspace(0.0, math.radians(40.0), count + 1)[1:].tolist()

    def follow():
        x, worst = np.zeros(12), 0.0
        for phi in angles:
            # shifted by a little: see the trap below
            x = fsolve(lambda v, p=phi: plain_residual(v.tolist(), p, p), x + 1e-9)
            worst = max(worst, max(map(abs, plain_residual(x.tolist(), phi, phi))))
        return worst

    # its own flag is not believed: the residual is checked
    assert timed(benchmark, follow, count) < 1e-7


def test_the_trap_of_tiny_unknowns():
    """theory/antenna 10: started from 1e-41, fsolve returns the start.

    The difference step underflows, and so does the first trust region (100 times the start): with an analytic
    Jacobian it is trapped all the same.
    """
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
    assert abs(equation(analytic)[0]) == pytest.approx(0.1)
    # our own solution from unknowns of that size is right
    solved = ART.solve_loops(0.3, 0.3, start=np.full(12, 1e-41))
    np.testing.assert_allclose(solved.x, ART.passive_angles(ART.poses(0.3, 0.3)).x, rtol=0, atol=2e-15)
