"""How fast planar dynamics is, beside scipy on the plain equations.

Run by the normal suite once each, without timing; with times: ``pytest tests/bench/test_dynamics_speed.py
--benchmark-enable``.  No time is asserted: machines differ.  Every benchmark checks its result.  Targets on one core:
four-bar 2 s at 1e-9 in 30 ms, seven-body mechanism 0.03 s at 1e-8 in the constrained form in 300 ms.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from graphsynth.dynamics import consistent_start, simulate_dynamics

sys.path.insert(0, str(Path(__file__).parents[1] / "dynamics"))
from dynamic_models import g1, seven_body, seven_pose

G1_END = 19.151183313715786848


def timed(benchmark, run):
    return benchmark.pedantic(run, rounds=5, warmup_rounds=1)


@pytest.mark.parametrize("form", ["minimal", "constrained"])
def test_four_bar(benchmark, form):
    model = g1()
    start = consistent_start(model, keep={(0, 1): 0.0}, keep_rates={(0, 1): 10.0}, modes={0: 1})
    motion = timed(benchmark, lambda: simulate_dynamics(model, [0.0, 2.0], start=start, form=form, rtol=1e-9))
    assert abs(motion.poses[-1, 1, 2] - G1_END) < 2e-7
    benchmark.extra_info["integration alone, ms"] = round(1e3 * motion.seconds, 1)


@pytest.mark.parametrize("form", ["minimal", "constrained"])
def test_seven_body_mechanism(benchmark, form):
    model = seven_body()
    start = consistent_start(model, pose=seven_pose())
    motion = timed(benchmark, lambda: simulate_dynamics(model, [0.0, 0.03], start=start, form=form, rtol=1e-8))
    assert abs(motion.poses[-1, 1, 2] - 15.81077119629904) < 1e-6
    benchmark.extra_info["integration alone, ms"] = round(1e3 * motion.seconds, 1)


def test_scipy_on_the_plain_equations(benchmark):
    """The same four-bar, its equation written by hand (spec 4.2, 4.4), Python right-hand side."""
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

    found = timed(
        benchmark, lambda: solve_ivp(rates, (0.0, 2.0), (0.0, 10.0), "DOP853", rtol=1e-9, atol=np.array([1e-11, 1e-10]))
    )
    assert found.success and abs(found.y[0, -1] - G1_END) < 5e-7
