"""How fast planar dynamics is, beside scipy on the plain equations, exudyn and MuJoCo at equal error.

Run by the normal suite once each, without timing; with times: ``pytest tests/bench/test_dynamics_speed.py
--benchmark-enable -n0``. No time is asserted: machines differ. Every benchmark checks its result.  Targets on one core:
four-bar 2 s at 1e-9 in 30 ms, seven-body mechanism 0.03 s at 1e-8 in the augmented form in 300 ms.
"""

from __future__ import annotations

import functools
import math
import sys
from pathlib import Path
from time import perf_counter

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from graphsynth.dynamics import consistent_start, simulate_dynamics

sys.path.insert(0, str(Path(__file__).parents[1] / "dynamics"))
from dynamic_models import g1, seven_body, seven_pose

G1_END = 19.151183313715786848


def timed(benchmark, run):
    return benchmark.pedantic(run, rounds=5, warmup_rounds=1)


@pytest.mark.parametrize("form", ["one-coordinate", "augmented", "partitioned"])
def test_four_bar(benchmark, form):
    model = g1()
    start = consistent_start(model, keep={(0, 1): 0.0}, keep_rates={(0, 1): 10.0}, modes={0: 1})
    motion = timed(benchmark, lambda: simulate_dynamics(model, [0.0, 2.0], start=start, form=form, rtol=1e-9))
    assert abs(motion.poses[-1, 1, 2] - G1_END) < 2e-7
    benchmark.extra_info["integration alone, ms"] = round(1e3 * motion.seconds, 1)


@pytest.mark.parametrize("form", ["one-coordinate", "augmented", "partitioned"])
def test_seven_body_mechanism(benchmark, form):
    model = seven_body()
    start = consistent_start(model, pose=seven_pose())
    motion = timed(benchmark, lambda: simulate_dynamics(model, [0.0, 0.03], start=start, form=form, rtol=1e-8))
    assert abs(motion.poses[-1, 1, 2] - 15.81077119629904) < 1e-6
    benchmark.extra_info["integration alone, ms"] = round(1e3 * motion.seconds, 1)


def plain_equations():
    """Right-hand side of the four-bar written by hand (theory/braider 2, 4), in Python."""
    a, b, c, g, gravity = 0.2, 0.6, 0.4, 0.6, 9.81
    m1, m2, m3 = 0.2, 0.6, 0.4

    def rates(t, y):
        th, w = y
        d = math.hypot(g - a * math.cos(th), a * math.sin(th))
        ex, ey = (g - a * math.cos(th)) / d, -a * math.sin(th) / d
        u = (b * b - c * c + d * d) / (2.0 * d)
        h = math.sqrt(b * b - u * u)
        bx, by = a * math.cos(th) + u * ex - h * ey, a * math.sin(th) + u * ey + h * ex
        p2 = math.atan2(by - a * math.sin(th), bx - a * math.cos(th))
        p3 = math.atan2(by, bx - g)
        s = math.sin(p2 - p3)
        k2, k3 = -a * math.sin(th - p3) / (b * s), -a * math.sin(th - p2) / (c * s)
        q2 = (-a * math.cos(th - p3) - b * k2 * k2 * math.cos(p2 - p3) + c * k3 * k3) / (b * s)
        q3 = (a * math.cos(th - p2) + b * k2 * k2 - c * k3 * k3 * math.cos(p3 - p2)) / (-c * s)
        i2, i3 = m2 * b * b / 12.0, m3 * c * c / 3.0
        J = m1 * a * a / 3.0 + m2 * (a * a + b * b * k2 * k2 / 4.0 + a * b * k2 * math.cos(th - p2)) + i2 * k2 * k2
        J += i3 * k3 * k3
        slope = b * b * k2 * q2 / 2.0 + a * b * (q2 * math.cos(th - p2) - k2 * math.sin(th - p2) * (1.0 - k2))
        slope = m2 * slope + 2.0 * i2 * k2 * q2 + 2.0 * i3 * k3 * q3
        load = -gravity * (m1 * a / 2.0 * math.cos(th) + m2 * (a * math.cos(th) + b / 2.0 * k2 * math.cos(p2))
                           + m3 * c / 2.0 * k3 * math.cos(p3))  # fmt: skip
        return w, (load - 0.5 * slope * w * w) / J

    return rates


def scipy_run(rtol):
    return solve_ivp(plain_equations(), (0.0, 2.0), (0.0, 10.0), "DOP853", rtol=rtol, atol=rtol * np.array([0.01, 0.1]))


def test_scipy_on_the_plain_equations(benchmark):
    found = timed(benchmark, lambda: scipy_run(1e-9))
    assert found.success and abs(found.y[0, -1] - G1_END) < 5e-7


def best_of(run, rounds=3):
    """Shortest time and last result."""
    times = []
    for _ in range(rounds):
        begin = perf_counter()
        found = run()
        times.append(perf_counter() - begin)
    return min(times), found


def report(capsys, name, ours, theirs):
    """Print both (error, seconds) and the ratio at equal error: ours is the fastest run that is at least as exact."""
    rival, seconds = theirs
    error, own = min((entry for entry in ours if entry[0] <= rival), key=lambda entry: entry[1])
    with capsys.disabled():
        print(f"\n  {name}: error {rival:.1e} in {1e3 * seconds:.1f} ms; graphsynth {error:.1e} in {1e3 * own:.1f} ms: "
              f"{seconds / own:.1f} times as fast")  # fmt: skip
    assert error <= rival


@pytest.fixture(scope="module")
def four_bar_runs():
    """Error of theta(2) and time of the one-coordinate and the augmented form over tolerances."""
    model = g1()
    start = consistent_start(model, keep={(0, 1): 0.0}, keep_rates={(0, 1): 10.0}, modes={0: 1})
    found = []
    for form in ("one-coordinate", "augmented"):
        for exponent in range(4, 12):
            run = functools.partial(simulate_dynamics, model, [0.0, 2.0], start=start, form=form, rtol=10.0**-exponent)
            seconds, motion = best_of(run)
            found.append((abs(motion.poses[-1, 1, 2] - G1_END), seconds))
    return model, start, found


@pytest.mark.long
@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
def test_four_bar_beside_scipy_at_equal_error(four_bar_runs, capsys, rtol):
    seconds, found = best_of(lambda: scipy_run(rtol))
    report(capsys, f"scipy DOP853 {rtol:g}", four_bar_runs[2], (abs(found.y[0, -1] - G1_END), seconds))


@pytest.mark.long
@pytest.mark.parametrize("step", [1e-3, 1e-4])
def test_four_bar_beside_exudyn_at_equal_error(four_bar_runs, capsys, step):
    pytest.importorskip("exudyn")
    from graphsynth.formats import ExudynSettings, run_exudyn

    model, start, ours = four_bar_runs
    found = run_exudyn(model, start, [0.0, 2.0], ExudynSettings(step))
    assert found.completed
    report(capsys, f"exudyn step {step:g} s", ours, (abs(found.poses[-1, 1, 2] - G1_END), found.seconds))


@pytest.mark.long
@pytest.mark.parametrize("step", [1e-3, 1e-4])
def test_four_bar_beside_mujoco_at_equal_error(four_bar_runs, capsys, step):
    pytest.importorskip("mujoco")
    from graphsynth.formats import MujocoSettings, run_mujoco

    model, start, ours = four_bar_runs
    found = run_mujoco(model, start, [0.0, 2.0], MujocoSettings(step))
    assert found.completed
    report(capsys, f"MuJoCo RK4 step {step:g} s", ours, (abs(found.poses[-1, 1, 2] - G1_END), found.seconds))
