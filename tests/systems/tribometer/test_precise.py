"""The motion in multiple precision against the printed digits, and the automaton against it."""

from __future__ import annotations

import mpmath
import pytest

from graphsynth.core.errors import SpecError, TooLargeError
from graphsynth.systems.tribometer.model import Tribometer
from graphsynth.systems.tribometer.platforms import BeltDrive, HarmonicDrive, StribeckLaw, TwoCoefficientLaw
from graphsynth.systems.tribometer.precise import precise_motion

from . import printed

PLAIN = TwoCoefficientLaw(0.40, 0.25)
HARMONIC = Tribometer(law=PLAIN, drive=HarmonicDrive(0.03, 2.0))
BELT = Tribometer(damping=0.0, law=PLAIN, drive=BeltDrive(0.02))


def test_every_printed_digit_of_the_harmonic_drive():
    motion = precise_motion(HARMONIC, 10.0, digits=30)
    assert [event.state for event in motion.events] == [state for _, state, _ in printed.HARMONIC_EVENTS]
    with mpmath.workdps(40):
        for event, (t, _, x) in zip(motion.events, printed.HARMONIC_EVENTS):
            assert abs(event.time - mpmath.mpf(t)) <= mpmath.mpf(10) ** (1 + 1 - len(t.replace(".", "").lstrip("0")))
            assert abs(event.position - mpmath.mpf(x)) < mpmath.mpf("1e-31")
        assert abs(motion.x2 - mpmath.mpf(printed.HARMONIC_X2)) < mpmath.mpf("1e-31")
        assert abs(motion.v2 - mpmath.mpf(printed.HARMONIC_V2)) < mpmath.mpf("1e-31")


def test_every_printed_digit_of_the_belt_cycle():
    events = precise_motion(BELT, 1.6, digits=30).events
    with mpmath.workdps(40):
        assert abs(events[1].time - events[0].time - mpmath.mpf(printed.BELT_SLIP)) < mpmath.mpf("1e-29")
        assert abs(events[2].time - events[1].time - mpmath.mpf(printed.BELT_STICK)) < mpmath.mpf("1e-29")
        assert abs(events[1].position - (2 * mpmath.mpf("0.25") - mpmath.mpf("0.4")) * mpmath.mpf("9.81") / 400) < 1e-30


@pytest.mark.slow
def test_more_digits_change_nothing_that_was_given():
    low, high = precise_motion(Tribometer(), 0.8, digits=16), precise_motion(Tribometer(), 0.8, digits=24)
    with mpmath.workdps(40):
        assert all(abs(a.time - b.time) < mpmath.mpf("1e-16") for a, b in zip(low.events, high.events))


def same(model, duration, digits=20, **more):
    motion, reference = (
        model.event_driven(duration, times=[duration], **more),
        precise_motion(model, duration, digits=digits),
    )
    assert [a.state for a in motion.events] == [b.state for b in reference.events]
    assert len(motion.events) > 1
    for event, exact in zip(motion.events, reference.events):
        error = abs(float(event.time - exact.time))
        assert error <= event.error + 4e-16 * duration  # the estimate holds
        assert abs(float(event.position - exact.position)) <= motion.error + 1e-15
    error = abs(float(motion.x2[-1] - reference.x2))
    assert error <= motion.error
    return motion


@pytest.mark.slow
def test_automaton_against_more_digits_with_crank():
    motion = same(Tribometer(), 1.0)
    for event, (t, _, x) in zip(motion.events, printed.CRANK_EVENTS):
        assert event.time == pytest.approx(t, abs=1e-14, rel=0)
        assert event.position == pytest.approx(x, abs=2.1e-14, rel=0)  # printed to about 1e-14


@pytest.mark.long
@pytest.mark.parametrize(
    "model",
    [
        Tribometer(law=StribeckLaw(0.4, 0.25, 0.02, 1.0), drive=HarmonicDrive(0.03, 2.0)),
        Tribometer(law=TwoCoefficientLaw(0.4, 0.25, viscous=0.05), drive=HarmonicDrive(0.03, -3.0)),
        Tribometer(law=StribeckLaw(0.4, 0.1, 0.05, 3.0, 0.1), drive=BeltDrive(-0.05)),
        Tribometer(damping=60.0, law=PLAIN, drive=HarmonicDrive(0.03, 2.0)),
        Tribometer(damping=40.0, law=PLAIN, drive=HarmonicDrive(0.03, 2.0)),
    ],
    ids=["exponent 1", "viscous", "belt", "overdamped", "critical"],
)
def test_automaton_against_more_digits(model):
    same(model, 2.0 if isinstance(model.law, TwoCoefficientLaw) else 1.0)


@pytest.mark.slow
def test_whole_reference_run_against_more_digits():
    motion = same(Tribometer(), 10.0)
    assert len(motion.events) == 37


def test_refusals():
    with pytest.raises(SpecError, match="whole number"):
        precise_motion(Tribometer(law=StribeckLaw(0.4, 0.25, 0.02, 1.5)), 1.0)
    with pytest.raises(SpecError, match="15 to 200"):
        precise_motion(HARMONIC, 1.0, digits=5)
    with pytest.raises(TooLargeError, match="most_events"):
        precise_motion(HARMONIC, 10.0, digits=15, most_events=3)
