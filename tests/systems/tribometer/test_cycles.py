"""Limit cycles: closed form of the belt cycle, return maps, stability."""

from __future__ import annotations

import math

import numpy as np
import pytest

from graphsynth.core.errors import SpecError
from graphsynth.systems.tribometer.cycles import belt_cycle, limit_cycle
from graphsynth.systems.tribometer.model import Tribometer
from graphsynth.systems.tribometer.platforms import BeltDrive, CrankDrive, HarmonicDrive, StribeckLaw, TwoCoefficientLaw

from . import printed

PLAIN = TwoCoefficientLaw(0.40, 0.25)


def belt(speed, **more):
    return Tribometer(**{"damping": 0.0, "law": PLAIN, "drive": BeltDrive(speed)} | more)


def test_printed_belt_cycle():
    cycle = belt_cycle(belt(0.02))
    assert cycle.stick == pytest.approx(float(printed.BELT_STICK), rel=1e-15)
    assert cycle.slip == pytest.approx(float(printed.BELT_SLIP), rel=1e-15)
    assert cycle.period == pytest.approx(float(printed.BELT_PERIOD), rel=1e-15)
    assert (cycle.release, cycle.capture) == pytest.approx((0.4 * 9.81 / 400, 0.1 * 9.81 / 400), rel=1e-14)


def test_both_ends_of_the_belt_speed():
    slow, fast = belt_cycle(belt(1e-9)), belt_cycle(belt(1e6))
    assert slow.stick == pytest.approx(7.3575e6, rel=1e-14)
    assert slow.slip == pytest.approx(math.pi / 20, rel=1e-6)
    assert fast.stick < 1e-8
    assert fast.slip == pytest.approx(math.tau / 20, rel=1e-6)


@pytest.mark.parametrize("speed", [1e-6, 1e-4, 1e-2, 0.1, 1.0, 10.0, -0.02])
def test_period_found_against_the_formula(speed):
    model = belt(speed)
    exact, found = belt_cycle(model), limit_cycle(model)
    assert found.kind == "stick-slip"
    assert found.period == pytest.approx(exact.period, rel=1e-13)
    assert found.events[1].time == pytest.approx(exact.slip, rel=1e-13)
    assert found.events[1].position == pytest.approx(exact.capture, abs=1e-11 * abs(speed) + 1e-16)
    # no event is lost over several cycles from the relaxed spring
    motion = model.event_driven(4.5 * exact.period, estimate=False)
    states = [event.state for event in motion.events]
    assert states == [round(math.copysign(1, speed)), 0] * (len(states) // 2) + states[len(states) & ~1 :]
    assert len(states) >= 8


def test_settles_on_steady_sliding():
    found = limit_cycle(belt(0.5, damping=2.0))
    assert found.kind == "steady"
    assert found.stable
    assert found.x2 == pytest.approx(0.25 * 9.81 / 400)
    assert max(map(abs, found.multipliers)) == pytest.approx(math.exp(-0.5 * 2.0 * math.tau / 20), rel=1e-12)
    long = belt(0.5, damping=2.0, x2=found.x2 + 0.01, v2=0.0).event_driven(40.0, times=[40.0])
    assert not long.events
    assert long.x2[0] == pytest.approx(found.x2, abs=1e-12)


@pytest.mark.parametrize(
    "model",
    [
        Tribometer(),
        Tribometer(law=PLAIN, drive=HarmonicDrive(0.03, 2.0)),
        Tribometer(drive=CrankDrive(0.03, 0.12, 8.0)),
    ],
    ids=["crank", "harmonic", "fast crank"],
)
def test_cycle_with_crank_repeats_and_attracts(model):
    cycle = limit_cycle(model)
    assert (cycle.kind, cycle.turns, cycle.stable) == ("stick-slip", 1, True)
    assert cycle.residual < 1e-14
    assert len(cycle.events) == {2.0: 12, 8.0: 4}[model.drive.speed]
    # a nearby start comes closer by the largest multiplier in every turn
    largest = max(map(abs, cycle.multipliers))
    start = Tribometer(law=model.law, drive=model.drive, x2=cycle.x2 + 1e-6, v2=cycle.v2 if cycle.v2 else None)
    turns = model.drive.period * np.arange(1, 4)
    away = np.abs(start.event_driven(turns[-1] + 1e-9, times=turns, estimate=False).x2 - cycle.x2)
    assert away / 1e-6 == pytest.approx(largest ** np.arange(1, 4), rel=2e-3)


def test_sliding_without_sticking():
    cycle = limit_cycle(Tribometer(drive=CrankDrive(0.03, 0.12, 40.0)))
    assert (cycle.kind, cycle.turns) == ("sliding", 1)
    assert len(cycle.multipliers) == 2
    assert 0.0 < max(map(abs, cycle.multipliers)) < 1.0


def test_half_turn_symmetry():
    """A pure cosine and an odd law: the second half of the cycle mirrors the first."""
    cycle = limit_cycle(Tribometer(law=PLAIN, drive=HarmonicDrive(0.03, 2.0)))
    first, second = cycle.events[:6], cycle.events[6:]
    half = 0.5 * cycle.period
    assert [a.time + half for a in first] == pytest.approx([b.time for b in second], abs=1e-12)
    assert [-a.position for a in first] == pytest.approx([b.position for b in second], abs=1e-13)


def test_stuck_all_the_time():
    cycle = limit_cycle(Tribometer(drive=HarmonicDrive(0.005, 1.0)))
    assert (cycle.kind, cycle.events, cycle.stable) == ("stuck", (), False)


def test_nothing_found_is_said():
    cycle = limit_cycle(Tribometer(), most_turns=1)
    assert cycle.kind == "none found"
    assert math.isnan(cycle.period)
    assert "most_turns" in cycle.statement


def test_refusals():
    with pytest.raises(SpecError, match="BeltDrive"):
        belt_cycle(Tribometer())
    with pytest.raises(SpecError, match="closed form"):
        belt_cycle(belt(0.02, damping=1.0))
    with pytest.raises(SpecError, match="closed form"):
        belt_cycle(belt(0.02, law=StribeckLaw(0.4, 0.25, 0.02)))
