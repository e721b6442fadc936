"""Bad and extreme input: one clear sentence, or a verdict that is defined."""

from __future__ import annotations

import inspect
import math

import numpy as np
import pytest

from graphsynth import jamming
from graphsynth.core.errors import GeometryError, GraphsynthError
from graphsynth.jamming import (
    Bearing,
    Fit,
    ToleranceBox,
    Verdict,
    assess_fits,
    assess_jamming,
    certified_largest_misalignment,
    certified_smallest_clearance,
    certify_jamming,
    joints as coupled,
    largest_interference,
    sample_interference,
    smallest_clearance,
    sweep_linkage,
    wedging,
)
from graphsynth.jamming.bearing.areas import lid_area, rim_area, surrogate_areas
from graphsynth.jamming.bearing.areas_enclosed import area_curve, enclose_lid_area
from graphsynth.jamming.intersection.boxes import krawczyk_boxes
from graphsynth.jamming.intersection.hull import circle_ellipse, surrogate_problem
from graphsynth.mechanism.four_bar import TiltedFourBar

DECK = TiltedFourBar(alpha=1 / 30)
OUT_OF_REACH = TiltedFourBar(2, 3, 1, 2.5, alpha=1.2)  # the pin rises to 2.8 l3


def box(**changes):
    return ToleranceBox(**{"alpha": "1/30", **changes})


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: box(clearance="[0.1, 0.03]"), "clearance has its lower bound 0.1 above its upper bound 0.03"),
        (lambda: box(clearance=(0.1, 0.03)), "exchange them"),
        (lambda: circle_ellipse("[6, 5]", 7, 4), "R1 has its lower bound 6 above its upper bound 5"),
        (lambda: circle_ellipse(5, 4, 6), "a = 4.0 is below b = 6.0"),
        (lambda: circle_ellipse(5, 6, 4, eps=-1), "e1 = -1.0 must be zero or more"),
        (lambda: circle_ellipse(math.nan, 6, 4), "R1 = nan is not a finite number"),
        (lambda: box(Rb=math.nan), "Rb = nan is not a finite number"),
        (lambda: Bearing(Rb=math.nan), "Rb = nan is not finite"),
        (lambda: Bearing(clearance=math.inf), "clearance = inf is not finite"),
        (lambda: Bearing(Hb=-1), "Hb = -1.0 must be zero or more"),
        (lambda: TiltedFourBar(alpha=math.nan), "alpha = nan is not finite"),
        (lambda: certify_jamming(box()).over(math.nan, 1.0), "start = nan is not finite"),
        (lambda: krawczyk_boxes(circle_ellipse(5, 6, 4), tolerance=math.nan), "tolerance = nan must be positive"),
        (lambda: surrogate_problem(Bearing(), "1.5"), "sine = 1.5 of the tilt exceeds 1"),
        (lambda: enclose_lid_area(17.5, 0.03, 5, 2), "sine = 2.0 of the tilt exceeds 1"),
        (lambda: enclose_lid_area(17.5, -0.03, 5, 0.01), "interference fit"),
        (lambda: lid_area(Bearing(clearance=-0.01), 0.01, 1.0), "interference fit"),
        (lambda: rim_area(Bearing(clearance=-0.01), 0.01, 1.0), "interference fit"),
        (lambda: surrogate_areas(Bearing(clearance=-0.01), 0.01, 1.0), "interference fit"),
        (lambda: area_curve(OUT_OF_REACH, f=[1.5]), "rises above l3 at 85.9437 degrees"),
        (lambda: smallest_clearance(OUT_OF_REACH, Bearing()), "rises to 2.79612, above l3 = 1.0|rises to 2.796"),
        (lambda: sweep_linkage(box(), resolution=math.nan), "resolution = nan must be at least"),
        (lambda: largest_interference(box(), "C"), "condition = 'C' is unknown"),
        (lambda: assess_jamming(DECK, Bearing(), samples=[math.nan]), "samples holds nan"),
        (lambda: assess_fits(box(), diameter=-3), "diameter -3 mm is outside"),
        (lambda: wedging(box(), "-0.1"), "friction = -0.1 is negative"),
        *[(lambda n=n: sample_interference(box(), count=n), "must be a positive integer") for n in (0, -3, 2.5, True)],
    ],
)  # fmt: skip
def test_one_clear_sentence(call, words):
    with pytest.raises(GraphsynthError, match=words) as caught:
        call()
    assert str(caught.value).count("\n") == 0


def test_zero_clearance():
    jammed = assess_jamming(DECK, Bearing(clearance=0))
    assert jammed.verdict is Verdict.CERTIFIED_JAMMED and any("no clearance" in note for note in jammed.notes)
    still = assess_jamming(TiltedFourBar(), Bearing(clearance=0))
    assert still.verdict is Verdict.UNDECIDED and "touch at every angle" in still.certificate.reason
    limit = certified_largest_misalignment(box(clearance=0))
    assert limit.works is None or limit.works == 0.0
    assert "touching" in limit.reason or "no value works" in limit.reason


def test_clearance_larger_than_the_bearing():
    for condition in ("A", "B"):
        report = assess_jamming(DECK, Bearing(clearance=100), condition)
        assert report.verdict is Verdict.CERTIFIED_FREE and report.worst_interference < -90.0
    assert report.critical_tilt > report.largest_tilt and assess_jamming(DECK, Bearing(clearance=100)).arcs.reason
    limit = certified_largest_misalignment(box(clearance=100))
    assert limit.fails is None and "no limit" in limit.reason


def test_bearing_without_height():
    report = assess_jamming(DECK, Bearing(Hb=0))
    assert report.verdict is Verdict.CERTIFIED_FREE and "disc" in report.arcs.reason
    assert assess_jamming(DECK, Bearing(Hb=0), "B").critical_tilt == pytest.approx(math.acos(17.5 / 17.53), rel=1e-12)
    assert wedging(box(Hb=0), "0.5").verdict.name == "NOT_POSSIBLE"
    limit = certified_smallest_clearance(box(Hb=0))
    assert limit.works < 1e-15 and limit.fails is None


def test_tilt_beyond_the_reach_of_the_linkage():
    report = assess_jamming(OUT_OF_REACH, Bearing())
    assert report.verdict is Verdict.CANNOT_ASSEMBLE and any("cannot be assembled" in note for note in report.notes)
    assert np.isnan(report.table.interference).all() and math.isnan(report.worst_interference)
    limit = certified_smallest_clearance(ToleranceBox(2, 3, 1, "2.5", "1.2"))
    assert limit.works is None and limit.fails is None and "assembled" in limit.reason
    partly = assess_jamming(TiltedFourBar(3, 2, 1.5, 2.5, alpha=1.2), Bearing())
    assert (
        not partly.full_turn.possible
        and np.isnan(partly.table.interference).any()
        and not np.isnan(partly.table.interference).all()
    )
    assert partly.verdict in (Verdict.CERTIFIED_JAMMED, Verdict.UNDECIDED)


def test_what_is_not_a_number_gives_no_area():
    for areas in (lid_area, lambda *a: rim_area(*a)[0], lambda *a: surrogate_areas(*a)[1]):
        found = areas(Bearing(), [math.nan, 0.0133], [1.0, math.sqrt(1 - 0.0133**2)])
        assert math.isnan(found[0]) and found[1] > 0.8


def test_a_box_without_tolerances_can_be_sampled():
    seen = sample_interference(ToleranceBox(alpha="1/30"), count=500)
    assert seen.outside == 0 and seen.corners == 1 and 0 <= seen.overestimation < 1e-15


def test_reversed_bounds_are_never_exchanged_silently():
    with pytest.raises(GeometryError):
        ToleranceBox(axis=("[1, 0]", 0, 0))


NOTHINGS = [None, "text", math.nan, np.zeros(3), object()]


@pytest.mark.parametrize("value", NOTHINGS, ids=["none", "text", "nan", "array", "object"])
@pytest.mark.parametrize(
    "call",
    [
        lambda v: Fit.read(v, 35), lambda v: Fit.read("H7/g6", v), lambda v: assess_fits(v),
        lambda v: certify_jamming(v),
        lambda v: assess_fits(box(), "A", v), lambda v: certified_largest_misalignment(v),
        lambda v: sample_interference(v),
        lambda v: certified_smallest_clearance(v), lambda v: certified_smallest_clearance(box(), v),
        lambda v: largest_interference(v), lambda v: largest_interference(box(), v), lambda v: wedging(v, "0.1"),
        lambda v: wedging(box(), v),
        lambda v: smallest_clearance(v, Bearing()), lambda v: smallest_clearance(DECK, v), lambda v: sweep_linkage(v),
        lambda v: sweep_linkage(box(), resolution=v), lambda v: krawczyk_boxes(v),
        lambda v: surrogate_problem(v, "0.1"),
        lambda v: surrogate_areas(v, 0.1, 1.0), lambda v: ToleranceBox.of(v),
        lambda v: ToleranceBox.of(DECK, 0 if v is None else v),
        lambda v: coupled.bearing_limits(v), lambda v: coupled.JointLimits(v), lambda v: coupled.SlideLimits(v, v),
        lambda v: coupled.certify_coupled(v, Bearing(), coupled.Misalignment(0, 1, 0.01)),
        lambda v: coupled.Misalignment(0, 1, v), lambda v: sample_interference(box(), seed=v),
        lambda v: sample_interference(box(), v),
    ],
)  # fmt: skip
def test_nothing_of_use_gets_a_sentence(call, value):
    """Whatever is no argument of a public function is refused by an exception of the project, not by an accident."""
    with pytest.raises(GraphsynthError):
        call(value)


def test_one_default_condition():
    """Every function that takes a contact condition takes A unless told otherwise."""
    found = {}
    for module in (jamming, coupled):
        for name in module.__all__:
            member = getattr(module, name)
            if inspect.isfunction(member) and "condition" in inspect.signature(member).parameters:
                found[name] = inspect.signature(member).parameters["condition"].default
    assert len(found) >= 15 and set(found.values()) == {"A"}, found
    assert largest_interference(box()).upper >= largest_interference(box(), "A").lower
