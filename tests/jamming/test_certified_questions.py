"""Inverse questions, fits, friction, branch and bound, sweeps and samples against references and each other."""

from __future__ import annotations

import math
from fractions import Fraction as F

import mpmath
import numpy as np
import pytest
from scipy import stats

from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Interval, sin
from graphsynth.jamming import (
    STANDARD_FITS,
    Fit,
    Region,
    ToleranceBox,
    Verdict,
    Wedging,
    assess_fits,
    certified_largest_height,
    certified_largest_misalignment,
    certified_smallest_clearance,
    certify_jamming,
    insertion_diagram,
    largest_interference,
    maximise,
    sample_interference,
    spread,
    sweep_linkage,
    sweep_turn,
    tightest_free_fit,
    wedging,
)
from graphsynth.jamming.bearing import branch_and_bound
from graphsynth.jamming.bearing.arcs import Span, complement, contains, covers, merge_outer, subtract
from graphsynth.jamming.bearing.sweep import PieceInterference


def between(text, *ends):
    with mpmath.workdps(40):
        return min(ends) < mpmath.mpf(text) < max(ends)


# -- inverse questions -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("question", "condition", "published"),
    [
        (certified_largest_misalignment, "A", "0.0151614793250201376610981403839"),
        (certified_largest_misalignment, "B", "0.0148460080847629701366363985309"),
        (certified_smallest_clearance, "A", "0.0650992730735457585284715885170"),
        (certified_smallest_clearance, "B", "0.0682154318912891822469145530348"),
    ],
)
def test_published_limits_lie_between_two_proofs(question, condition, published):
    limit = question(ToleranceBox(alpha="1/30"), condition)
    assert between(published, limit.works, limit.fails)
    assert limit.relative_gap < 1e-14 and limit.reason == ""


def test_height_of_the_limit_from_the_closed_form():
    limit = certified_largest_height(ToleranceBox(alpha="1/30"))
    with mpmath.workdps(40):
        S = mpmath.sin(mpmath.mpf(1) / 30) * 2 / 5
        C = mpmath.sqrt(1 - S * S)
        height = 2 * (mpmath.mpf("0.03") + mpmath.mpf("17.5") * S * S / (1 + C)) / S
    assert between(mpmath.nstr(height, 35), limit.works, limit.fails)


def test_general_axis_and_no_limits():
    with mpmath.workdps(40):  # q^2 / (1 + sqrt(1 - q^2)) = (1 - cos alpha)(1 - n3^2), n3^2 = 4/9
        c, R, h = mpmath.mpf("0.03"), mpmath.mpf("17.5"), mpmath.mpf(5)
        t = c / (h + mpmath.sqrt(h * h - c * (2 * R + c)))
        q = mpmath.mpf("2.5") * 2 * t / (1 + t * t)
        alpha = mpmath.acos(1 - q * q / (1 + mpmath.sqrt(1 - q * q)) * 9 / 5)
    limit = certified_largest_misalignment(ToleranceBox(axis=(2, -1, 2)))
    assert between(mpmath.nstr(alpha, 35), limit.works, limit.fails)
    upright = certified_largest_misalignment(ToleranceBox(axis=(0, 0, 1)))
    assert upright.works is not None and upright.fails is None and "no limit" in upright.reason
    still = certified_smallest_clearance(ToleranceBox())
    assert still.fails is None and 0 < still.works < 1e-15 and "no limit" in still.reason
    tight = certified_largest_misalignment(ToleranceBox(clearance=0))
    assert tight.works is None and "touch" in tight.reason
    assert "no value works" in certified_largest_height(ToleranceBox(alpha=1, clearance="0.001"), "B").reason


def test_limits_hold_for_every_corner_of_a_box():
    box = ToleranceBox(
        l2=spread(1, 0, "0.01"), l3=spread("2.5", 0, "0.01"), Rb="17.5 +- 0.005", clearance="0.03 +- 0.003"
    )
    limit = certified_largest_misalignment(box)
    assert limit.relative_gap < 1e-13
    at = {"l2": "1.01", "l3": "2.475", "Rb": "17.495", "clearance": "0.027"}
    worst = certified_largest_misalignment(ToleranceBox(**at))
    assert min(worst.fails, limit.fails) > max(worst.works, limit.works)  # the same edge


def test_general_pin_is_searched_without_a_closed_form():
    box = ToleranceBox(alpha="1/30", hole_length=4)
    limit = certified_smallest_clearance(box, "general")
    assert limit.relative_gap < 1e-12
    both = [certified_smallest_clearance(box.replace(Hb=4), "B"), certified_smallest_clearance(box, "A")]
    assert between(str(limit.works), *(0.999999 * min(b.works for b in both), 1.000001 * min(b.works for b in both)))


# -- fits --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "diameter", "hole", "shaft"),  # micrometres, ISO 286-2 tables of limit deviations
    [("H7/g6", 35, (0, 25), (-25, -9)), ("H8/f7", 40, (0, 39), (-50, -25)), ("H9/d9", 60, (0, 74), (-174, -100)),
     ("H11/c11", 45, (0, 160), (-290, -130)), ("H7/h6", 25, (0, 21), (-13, 0)), ("H8/e8", 100, (0, 54), (-126, -72)),
     ("H11/c11", 30, (0, 130), (-240, -110)),
     ("H11/b11", 35, (0, 160), (-330, -170)), ("H11/a11", 35, (0, 160), (-470, -310))],
)  # fmt: skip
def test_limit_deviations(name, diameter, hole, shaft):
    fit = Fit.read(name, diameter)
    assert (fit.hole.lower * 1000, fit.hole.upper * 1000) == hole
    assert (fit.shaft.lower * 1000, fit.shaft.upper * 1000) == shaft
    assert fit.clearance.lower == F(hole[0] - shaft[1], 2000)


def test_shafts_a_and_b_do_not_exist_up_to_one_millimetre():
    assert Fit.read("H7/g6", 1).clearance.lower == F(1, 1000)
    for name in ("H11/a11", "H11/b11"):
        with pytest.raises(GeometryError, match="not standardised"):
            Fit.read(name, 1)


def test_fits_of_a_small_tilt():
    box = ToleranceBox(alpha="0.02")  # needs 0.0394 mm
    verdicts = {found.fit.name: found.verdict for found in assess_fits(box)}
    assert list(verdicts) == list(STANDARD_FITS)
    assert verdicts["H9/d9"] is verdicts["H11/c11"] is Verdict.CERTIFIED_FREE
    assert verdicts["H7/h6"] is verdicts["H7/g6"] is Verdict.CERTIFIED_JAMMED  # even the loosest: 0.025 mm
    assert verdicts["H8/e8"] is Verdict.CERTIFIED_JAMMED_FOR_SOME  # from 0.025 to 0.064 mm
    assert tightest_free_fit(box).fit.name == "H9/d9"
    deck = ToleranceBox(alpha="1/30")  # 0.0651 mm is more than c11 grants
    assert tightest_free_fit(deck).fit.name == "H11/b11"
    assert tightest_free_fit(deck, fits=("H7/g6", "H11/c11")) is None
    assert assess_fits(box)[0].row()["verdict"] == "CERTIFIED_JAMMED"
    with pytest.raises(GeometryError, match="not in the table"):
        Fit.read("H7/q6", 35)
    with pytest.raises(GeometryError, match="500"):
        Fit.read("H7/g6", 501)


# -- friction ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("condition", "published"),
    [("A", "0.279166102038487555339305041556974830"), ("B", "0.291657613076199542652043205085742340")],
)
def test_wedging_limits(condition, published):
    found = wedging(ToleranceBox(), "0.2", condition)
    with mpmath.workdps(40):
        assert found.limit.lo <= mpmath.mpf(published) <= found.limit.hi
        assert found.amplification.lo <= mpmath.mpf("0.2") / mpmath.mpf(published) <= found.amplification.hi
    assert found.limit.width < 1e-15 and found.verdict is Wedging.NOT_POSSIBLE
    for sign, verdict in ((1, Wedging.POSSIBLE), (-1, Wedging.NOT_POSSIBLE)):
        with mpmath.workdps(40):
            mu = mpmath.nstr(mpmath.mpf(published) * (1 + sign * mpmath.mpf("1e-12")), 30)
        assert wedging(ToleranceBox(), mu, condition).verdict is verdict
    assert wedging(ToleranceBox(), published, condition).verdict is Wedging.UNDECIDED
    assert wedging(ToleranceBox(), "[0.1, 0.6]", condition).verdict is Wedging.POSSIBLE_FOR_SOME


def test_wedging_over_a_box_holds_samples():
    box = ToleranceBox(Rb="17.5 +- 0.5", Hb="10 +- 1", clearance="[0.01, 0.2]")
    rng = np.random.default_rng(1)
    R, h, c = 17.5 + rng.uniform(-0.5, 0.5, 2000), 0.5 * (10 + rng.uniform(-1, 1, 2000)), rng.uniform(0.01, 0.2, 2000)
    for condition, limit in (
        ("A", np.sqrt(h * h - c * (2 * R + c)) / (R + c)),
        ("B", np.sqrt(h * h + c * (2 * R + c)) / R),
    ):
        found = wedging(box, "0.3", condition)
        assert found.limit.lo <= limit.min() and limit.max() <= found.limit.hi
        lever = limit * ((R + c) if condition == "A" else R)
        assert found.lever.lo <= lever.min() and lever.max() <= found.lever.hi


def test_wedging_without_contact_and_bad_input():
    none = wedging(ToleranceBox(Hb=1), "0.9")
    assert none.verdict is Wedging.NOT_POSSIBLE and "never touch" in none.reason
    assert wedging(ToleranceBox(Hb="[1, 10]"), "0.9").verdict is Wedging.UNDECIDED
    with pytest.raises(GeometryError, match="negative"):
        wedging(ToleranceBox(), "-0.1")
    with pytest.raises(GeometryError, match="interference"):
        wedging(ToleranceBox(clearance="-0.01"), "0.1")


def test_insertion_diagram_against_the_contact_forces():
    mu, r, l = 0.25, 4.0, 6.0
    diagram = insertion_diagram("0.25", 6, 4)
    lam = l / (2 * r * mu)
    for x, y in diagram.vertices:  # every corner lies on both kinds of limits
        assert abs(abs(x) - 1 / mu) < 1e-12 and abs(abs(y + mu * (1 + lam) * x) - lam) < 1e-12
    rng = np.random.default_rng(2)
    for f1, f2 in rng.uniform(0.1, 1.0, (50, 2)):  # two-point contact at the verge of sliding: on the border
        Fz, Fx, M = mu * (f1 + f2), f2 - f1, -mu * r * (f2 - f1) - l * f2
        x, y = Fx / Fz, M / (r * Fz)
        assert abs(y + mu * (1 + lam) * x) == pytest.approx(lam)
        inside = [F(Fx) * F(99, 100), F(Fz), F(M) * F(99, 100)]
        assert diagram.where(*inside, 4) is Region.INSIDE
        assert diagram.where(F(Fx) * F(101, 100), F(Fz), F(M) * F(101, 100), 4) is Region.OUTSIDE
        assert diagram.where((F(Fx) - F(1, 10), F(Fx) + F(1, 10)), F(Fz), F(M), 4) is not Region.INSIDE
    with pytest.raises(GeometryError, match="axial"):
        diagram.where(1, 0, 0, 4)
    with pytest.raises(GeometryError, match="friction"):
        insertion_diagram(0, 1, 1)


# -- branch and bound, sweep, samples ----------------------------------------------------------------------------------


@pytest.mark.parametrize("condition", ["A", "B"])
@pytest.mark.parametrize("axis", [(1, 0, 0), (2, -1, 2)])
def test_branch_and_bound_agrees_with_the_corners(condition, axis):
    tol = "0.01"
    box = ToleranceBox(l2=spread(1, 0, tol), l3=spread("2.5", 0, tol), alpha=spread("1/30", 0, tol), axis=axis,
                       Rb="17.5 +- 0.05", Hb="10 +- 0.1", clearance="0.03 +- 0.003")  # fmt: skip
    corner = certify_jamming(box, condition).largest_interference
    found = largest_interference(box, condition, tolerance=1e-12)
    assert found.finished and found.upper - found.lower <= 1e-12
    assert found.lower <= corner.hi and corner.lo <= found.upper
    assert found.boxes <= 20


def test_the_lower_bound_of_the_search_belongs_to_the_exact_box():
    """Its points are doubles, but 0.03 and 1/3 are none: the values beside them belong to other bearings."""
    for clearance in ("0.03", "1/3", "[0.1, 0.3]"):
        found = largest_interference(ToleranceBox(clearance=clearance), "A", max_boxes=100)  # no tilt: the gap is -c
        exact = -ToleranceBox(clearance=clearance)["clearance"].lower
        assert F(found.lower) <= exact <= F(found.upper)
        assert found.upper - found.lower < 1e-16


def test_general_pin_with_a_range_of_radii():
    # wide radii: neither end is the worst, gA falls and gB / C rises with the radius
    box = ToleranceBox(l2=1, l3=2, alpha="0.5", Rb="[5, 40]", Hb=20, hole_length=6, clearance="0.5 +- 0.1")
    certificate = certify_jamming(box, "general").largest_interference
    found = largest_interference(box, "general", tolerance=1e-9, max_boxes=50_000)
    assert found.finished
    assert found.lower <= certificate.hi and certificate.lo <= found.upper
    assert certificate.width < 1e-9
    radii = np.linspace(5.0, 40.0, 2001)
    S = math.sin(0.5) / 2
    C, c = math.sqrt(1 - S * S), 0.4
    a = np.where(radii * S <= 10 * C, 10 * S - c - radii * S * S / (1 + C), np.hypot(radii, 10) - radii - c)
    b = (3 * S - c + (radii + c) * S * S / (1 + C)) / C
    worst = np.minimum(a, b)
    assert 0 < worst.argmax() < 2000
    assert worst.max() <= certificate.hi and worst.max() > certificate.lo - 0.01


def test_search_of_any_function_and_its_budget():
    def wave(x):
        return sin(x[0] * 3) * x[1] - x[0].sqr() / 9

    box = Interval(["[-3, 3]", "[-1, 2]"])
    found = maximise(wave, box, tolerance=1e-8)
    x = np.linspace(-3, 3, 200_001)
    dense = np.maximum(np.sin(3 * x) * 2, -np.sin(3 * x)) - x * x / 9
    assert found.finished and found.lower - 1e-8 <= dense.max() + 1e-8 and dense.max() <= found.upper
    short = maximise(wave, box, tolerance=1e-12, max_boxes=3)
    assert not short.finished and short.upper >= found.lower and short.lower <= found.upper
    assert maximise(wave, box, decide_sign=True).lower > 0
    with pytest.raises(GeometryError, match="bounded"):
        maximise(wave, Interval.entire(2))


@pytest.mark.parametrize("condition", ["A", "B"])
def test_sweep_and_closed_form_check_each_other(condition):
    box = ToleranceBox(alpha=spread("1/30", 0, "1e-3"), azimuth="0 +- 0.01", clearance="0.03 +- 0.001")
    arcs, sweep = certify_jamming(box, condition).arcs, sweep_linkage(box, condition, resolution=1e-5)
    assert sweep.missing == () and sweep.finished and len(sweep.inner) == 2
    for span in sweep.inner:  # everything proved by one is possible for the other
        assert contains(arcs.outer, span.start) and contains(arcs.outer, span.stop)
    for span in arcs.inner:
        middle = 0.5 * (span.start + span.stop)
        assert contains(sweep.inner, middle)
    for span in sweep.free:
        assert not any(covers(arcs.inner, f, f) for f in np.linspace(span.start, span.stop, 50))
    total = sum(s.stop - s.start for kind in (sweep.free, sweep.inner, sweep.undecided) for s in kind)
    assert total == pytest.approx(math.tau, rel=1e-12)


def test_sweep_of_linkages_without_full_turn():
    # crank longer than the frame: double crank, assembled everywhere
    double = sweep_linkage(ToleranceBox(1, 2, F(5, 2), 2, "1/30"), resolution=1e-4)
    assert double.missing == () and len(double.inner) == 2
    # limit angle arccos(1/4) of (2, 1, 1, 1) in the plane
    limited = sweep_linkage(ToleranceBox(2, 1, 1, 1, 0), resolution=1e-5)
    (gap,) = limited.missing
    limit = 1.318116071652817965745664
    assert limit < gap.start < limit + math.tau / 256 and gap.stop < math.tau - limit
    assert limited.inner == ()
    # beyond the reach there is no jam, only no position
    tilted = sweep_linkage(ToleranceBox(2, 1, 1, 1, "1/30"), resolution=1e-4)
    assert all(not contains(tilted.inner, f) for f in (math.pi, 2.0, 4.0))


def test_sweep_budget_and_input():
    def rough(f):
        return PieceInterference(sin(f * 1000), np.ones(len(f), bool), np.zeros(len(f), bool))

    short = sweep_turn(rough, max_pieces=1000)
    assert not short.finished and short.undecided_part > 0.5
    with pytest.raises(GeometryError, match="resolution"):
        sweep_turn(rough, resolution=0.0)


def test_samples_stay_below_the_bound():
    jammed = ToleranceBox(
        l2=spread(1, 0, "1e-4"), l3=spread("2.5", 0, "1e-4"), alpha=spread("1/30", 0, "1e-4"), azimuth="0 +- 0.05",
        Rb="17.5 +- 0.005", Hb="10 +- 0.05", clearance="0.03 +- 0.003",
    )  # fmt: skip
    seen = sample_interference(jammed, seed=3)
    assert seen.outside == 0 and seen.count == 200_000
    assert seen.jamming_positions == pytest.approx(0.70, abs=0.005)  # 10.3
    assert seen.jamming_mechanisms == 1.0 and seen.jamming_mechanisms_range[0] > 0.9999
    assert seen.largest_interference == pytest.approx(0.0384, abs=1e-4)
    assert 0 <= seen.overestimation < 1e-15 and seen.corners == 2**7


def test_the_share_of_mechanisms_is_not_that_of_positions():
    """Clearance uniform, the rest fixed: the probability of a jam anywhere is a length over a length, exactly."""
    box = ToleranceBox(alpha="0.0145", clearance="0.03 +- 0.003", l2=1, l3="2.5", Rb="17.5", Hb=10)
    S = 1 / 2.5 * math.sin(0.0145)
    needed = 5 * S - 17.5 * S * S / (1 + math.sqrt(1 - S * S))  # clearance with which the gap closes at 90 degrees
    exact = (needed - 0.027) / 0.006
    seen = sample_interference(box, count=50_000, seed=2)
    low, high = seen.jamming_mechanisms_range
    assert low < exact < high and high - low < 0.01
    assert seen.jamming_mechanisms == pytest.approx(exact, abs=0.008)
    assert seen.jamming_positions < 0.3 * seen.jamming_mechanisms
    for hits, count in ((0, 50), (17, 50), (50, 50)):
        wanted = stats.binomtest(hits, count).proportion_ci(0.95, "exact")
        assert branch_and_bound._binomial_range(hits, count) == pytest.approx((wanted.low, wanted.high), abs=1e-12)


def test_a_million_samples():
    for k in range(10):
        box = ToleranceBox(
            alpha=(0.01 * (k + 1), 0.01 * (k + 2)), l2="1 +- 0.1", l3="2.5 +- 0.2", axis=(k - 5, 2, 1),
            Rb="[10, 20]", Hb="[2, 12]", clearance="[0.01, 0.2]", hole_length="[1, 9]",
        )  # fmt: skip
        for condition in ("A", "B", "general"):
            assert sample_interference(box, condition, 34_000, k).outside == 0


# -- sets of angles ----------------------------------------------------------------------------------------------------


def test_sets_of_angles():
    spans = merge_outer([Span(6.0, 6.5), Span(1.0, 2.0), Span(0.1, 0.3)])
    assert spans == (Span(1.0, 2.0), spans[1]) and spans[1].start == 6.0 and spans[1].stop > 0.3 + math.tau - 1e-14
    assert merge_outer([Span(0.0, 4.0), Span(3.0, 6.4)]) == (Span(0.0, 6.283185307179587),)
    free = complement(spans)
    assert len(free) == 2 and free[0] == Span(2.0, 6.0) and free[1].stop < 1.0 + math.tau
    assert complement(()) == (Span(0.0, 6.283185307179587),) and complement(merge_outer([Span(1.0, 9.0)])) == ()
    assert subtract((Span(0.0, 3.0),), (Span(1.0, 2.0),)) == (Span(0.0, 1.0), Span(2.0, 3.0))
    (left, right) = subtract((Span(5.0, 8.0),), (Span(0.5, 1.0),))  # a turn later
    assert left.stop >= 0.5 + math.tau and right.start <= 1.0 + math.tau
    assert covers((Span(6.0, 6.5),), 0.1, 0.1) and not covers((Span(6.0, 6.5),), 0.3, 0.3)
    assert not covers((Span(1.0, 2.0),), 1.0, 1.0)
