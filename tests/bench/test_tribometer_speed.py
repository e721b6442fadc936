"""How fast the stick-slip model is; ``docs/theory/tribometer.md`` holds what was measured.

Run by the normal suite once each, without timing; with times: ``pytest tests/bench --benchmark-enable -n 0``.
``pytest tests/bench/test_tribometer_speed.py -k scipy -s`` prints the time of scipy's own event location on the same
problem at equal error.  No time is asserted: machines differ.  Every benchmark checks its result.
"""

from __future__ import annotations

import math
import time
from functools import partial

import numpy as np
import pytest

from graphsynth.systems.tribometer.cycles import limit_cycle
from graphsynth.systems.tribometer.model import Tribometer
from graphsynth.systems.tribometer.platforms import HarmonicDrive, TwoCoefficientLaw

CRANK = Tribometer()
HARMONIC = Tribometer(law=TwoCoefficientLaw(0.4, 0.25), drive=HarmonicDrive(0.03, 2.0))
FINAL = -0.0088337024489276769888


@pytest.fixture(scope="module", autouse=True)
def compiled():
    CRANK.event_driven(0.01)
    HARMONIC.event_driven(0.01)
    CRANK.time_stepping(0.01)


def repeat(benchmark, function, rounds=10):
    return benchmark.pedantic(function, rounds=rounds, warmup_rounds=1)


def test_ten_seconds_with_all_events(benchmark):
    motion = repeat(benchmark, lambda: CRANK.event_driven(10.0))
    assert len(motion.events) == 37
    assert motion.complete


def test_ten_seconds_in_closed_form(benchmark):
    motion = repeat(benchmark, lambda: HARMONIC.event_driven(10.0, times=[10.0]))
    assert motion.x2[0] == pytest.approx(FINAL, abs=1e-16)


def test_hundred_thousand_steps(benchmark):
    motion = repeat(benchmark, lambda: CRANK.time_stepping(10.0, step=1e-4, estimate=False))
    assert len(motion.events) == 37


def test_chatter(benchmark):
    stiff = CRANK.stiffened(1e4, scaled_damping=False)
    motion = repeat(benchmark, lambda: stiff.event_driven(1.0, estimate=False), 3)
    assert len(motion.events) == 576


def test_limit_cycle(benchmark):
    assert repeat(benchmark, lambda: limit_cycle(CRANK), 3).stable


def scipy_loop(model, duration, rtol):
    """The automaton on scipy's solvers and callbacks, written as one would without graphsynth."""
    from scipy.integrate import solve_ivp
    from scipy.optimize import brentq

    r, rod, w = model.drive.radius, model.drive.rod, model.drive.speed
    m, k, c, N = model.mass, model.stiffness, model.damping, model.normal
    law, t, x, v, state, times = model.law, 0.0, 0.0, 0.0, 0, []

    def platform(t):
        C, S = math.cos(w * t), math.sin(w * t)
        q = math.sqrt(rod * rod - r * r * S * S)
        return (
            r * C + q - rod, -r * w * S - r * r * w * S * C / q,
            w * w * (-r * C - r * r * math.cos(2 * w * t) / q - (r * r * S * C) ** 2 / q**3),
        )  # fmt: skip

    def need(t, offset):
        x1, v1, a1 = platform(t)
        return m * a1 + k * (x1 + offset) + c * v1

    def mu(u):
        return law.kinetic + (law.static - law.kinetic) * math.exp(-((u / law.velocity) ** 2))

    def gap(t, y, s, start):
        return s * (platform(t)[1] - y[1]) if t > start + 1e-5 else 1.0

    def rates(t, y, s):
        return [y[1], (-k * y[0] - c * y[1] + s * N * mu(s * (platform(t)[1] - y[1]))) / m]

    while t < duration:
        if state == 0:
            offset, at = x - platform(t)[0], t
            while at < duration and abs(need(at, offset)) <= law.static * N:
                at += 1e-3 / w
            if at >= duration:
                break
            t = brentq(lambda t, offset=offset: abs(need(t, offset)) - law.static * N, at - 1e-3 / w, at, xtol=1e-16)
            x, v, state = platform(t)[0] + offset, platform(t)[1], math.copysign(1, need(t, offset))
        else:
            start, s = t, state
            meet = partial(gap, s=s, start=start)
            meet.terminal, meet.direction = True, -1
            found = solve_ivp(
                partial(rates, s=s),
                (t, duration), [x, v], method="DOP853", rtol=rtol, atol=rtol / 100, events=meet,
                max_step=0.05 / model.frequency,
            )  # fmt: skip
            t, x = found.t[-1], found.y[0, -1]
            if t >= duration:
                break
            v = platform(t)[1]
            force = need(t, x - platform(t)[0])
            state = 0 if abs(force) <= law.static * N else math.copysign(1, force)
        times.append(t)
    return times


def test_beside_scipy():
    exact = np.array([event.time for event in CRANK.event_driven(2.0).events])
    begin = time.perf_counter()
    times = scipy_loop(CRANK, 2.0, 1e-10)
    other = time.perf_counter() - begin
    error = np.abs(np.array(times) - exact).max()
    own = math.inf
    for _ in range(5):
        begin = time.perf_counter()
        CRANK.event_driven(2.0, times=[2.0], rtol=1e-10, estimate=False)
        own = min(own, time.perf_counter() - begin)
    print(
        f"\nscipy {other * 1e3:.0f} ms, event times within {error:.1e} s; this {own * 1e3:.2g} ms: {other / own:.0f} x"
    )
    assert error < 1e-9
