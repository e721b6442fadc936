"""`probability_of_jamming` of all joints: closed forms, random members, and what is refused."""

from fractions import Fraction

import numpy as np
import pytest
from jointed import CASES, FOUR, PLAIN, four_bar, true_margin

from graphsynth.core.errors import GeometryError
from graphsynth.jamming import (
    CommonFactor,
    Distribution,
    Grade,
    allocate_tolerances,
    joints_margin,
    probability_of_jamming as probability,
)
from graphsynth.jamming.bearing.parameters import Range
from graphsynth.jamming.joints.limits import FREE, JointLimits, Misalignment
from graphsynth.tolerances import AxisAngle, FitClearance, LengthTolerance

LEVEL = {pair: JointLimits(0.006, tilt_range=(0.0055, 0.0065)) for pair in ((0, 3), (1, 2), (2, 3))}
ALPHA = Misalignment(0, 1, 0.012, alpha_range=(0.010, 0.014))


def fixed(value: str) -> Distribution:
    return Distribution("uniform", Range(Fraction(value), Fraction(value)))


@pytest.mark.slow
def test_one_quantity_over_the_full_rotation() -> None:
    """Three equal bearings bind if and only if alpha > 2 t (theory/joints-that-share-a-tilt 6)."""
    margin = joints_margin(FOUR.simulate("0..360 deg"), JointLimits(0.006), ALPHA)
    found = probability(margin, {"alpha 0-1": Distribution.uniform("[0.010, 0.014]")}, width=2e-3)
    assert found.lower <= 0.5 <= found.upper <= found.lower + 2e-3
    assert "small tilts" in found.model and "0 to 6.28319" in found.model
    all_bind = probability(margin, {"alpha 0-1": Distribution.uniform("[0.0121, 0.0122]")})
    none = probability(margin, {"alpha 0-1": Distribution.uniform("[0.0118, 0.0119]")})
    assert all_bind.lower > 1.0 - 1e-12 and none.upper == 0.0


@pytest.mark.slow
def test_two_quantities_over_the_full_rotation() -> None:
    """All limits grow together by a common factor: P(alpha > 2 t) is an integral of a linear function."""
    margin = joints_margin(FOUR.simulate("0..360 deg"), LEVEL, ALPHA)
    given = {f"tilt {a}-{b}": fixed("0.006") for a, b in LEVEL} | {"alpha 0-1": Distribution.uniform("[0.010, 0.014]")}
    for spread, shape, exact in (
        ("[-0.0005, 0.0005]", Distribution.uniform, 0.5),
        ("[0, 0.0005]", Distribution.uniform, (0.014 - 0.0125) / 0.004),
        ("[-0.0005, 0.0005]", Distribution.triangular, 0.5),
    ):
        together = CommonFactor("grade", shape(spread), {name: 1 for name in given if name.startswith("tilt")})
        found = probability(margin, given, [together], width=4e-3)
        assert found.lower <= exact <= found.upper <= found.lower + 4e-3


@pytest.mark.slow
def test_part_of_a_rotation_is_less_likely_to_bind() -> None:
    whole, part = (four_bar(span, tolerances=()) for span in ("0..180 deg", "140..180 deg"))
    both = [probability(margin, width=0.2, seconds=8.0, samples=2000) for margin in (whole, part)]
    drawn = [found.samples for found in both]
    assert drawn[1].share < drawn[0].share and both[1].lower <= both[0].upper
    assert all(own.lower <= found.upper and found.lower <= own.upper for own, found in zip(drawn, both))


@pytest.mark.slow
@pytest.mark.parametrize("name", list(CASES))
def test_bounds_hold_the_interval_of_random_members(name: str) -> None:
    found = probability(CASES[name](), width=5e-3, seconds=5.0)
    drawn = found.sampled(20_000)
    assert drawn.lower <= found.upper and found.lower <= drawn.upper


@pytest.mark.parametrize(
    "name", [*(pytest.param(own, marks=pytest.mark.slow) for own in ("crank_slider", "fitted")), "spherical"]
)
def test_sampled_margins_are_those_of_members(name: str) -> None:
    """Signs of sampled margins near binding, against members with their own dimensions."""
    margin, rng = CASES[name](), np.random.default_rng(3)
    ends = np.array([[float(own.lower), float(own.upper)] for own in margin.ranges.values()])
    x = ends[:, 0] + (ends[:, 1] - ends[:, 0]) * rng.random((200, len(ends)))
    sampled = margin.sampled(x)
    near = np.argsort(np.abs(sampled))[:3]
    for k in near:
        true = true_margin(margin, x[k], 121)
        assert true * sampled[k] > 0.0 or abs(true) < 1e-3
        assert abs(true) < 0.05


@pytest.mark.long
def test_a_point_is_a_plain_verdict() -> None:
    margin = four_bar("85..95 deg", tolerances=())
    given = {name: Distribution("uniform", Range(own.lower, own.lower)) for name, own in margin.ranges.items()}
    found = probability(margin, given)
    assert (found.lower, found.upper) in ((0.0, 0.0), (1.0, 1.0))
    assert (found.lower == 1.0) == (true_margin(margin, np.array([float(o.lower) for o in margin.ranges.values()])) < 0)


@pytest.mark.slow
def test_the_verge_is_undecided_with_a_reason() -> None:
    """Three equal bearings bind if and only if alpha > 2 t, at 90 degrees: a point there, and a range that touches."""
    margin = joints_margin(FOUR.simulate("85..95 deg"), JointLimits(0.006), ALPHA)
    point = probability(margin, {"alpha 0-1": fixed("0.012")})
    assert (point.lower, point.upper) == (0.0, 1.0) and "one member lies so close" in point.reason
    below = probability(margin, {"alpha 0-1": Distribution.uniform("[0.011, 0.012]")})
    assert below.lower == 0.0 < below.upper < 1e-3 and "touch the limit" in below.reason
    assert below.boxes < 100


@pytest.mark.slow
def test_allocation_takes_the_margin_of_all_joints() -> None:
    margin = joints_margin(FOUR.simulate("30..120 deg"), PLAIN, ALPHA)
    grades = {
        "alpha 0-1": [Grade("coarse", "[0.010, 0.014]", 1.0), Grade("fine", "[0.0108, 0.0112]", 4.0)],
        "tilt 0-3": [Grade("coarse", "[0.005, 0.007]", 1.0), Grade("fine", "[0.0065, 0.0075]", 3.0)],
    }
    bought = allocate_tolerances(margin, grades, allowed=1e-3, seconds=10.0)
    assert bought.choice and bought.upper <= 1e-3
    assert bought.cheapest


@pytest.mark.long
def test_what_has_no_answer_is_refused() -> None:
    motion = FOUR.simulate("30..120 deg")
    with pytest.raises(GeometryError, match="nothing can bind"):
        joints_margin(motion, FREE, ALPHA)
    with pytest.raises(GeometryError, match="no axis is misaligned"):
        joints_margin(motion, PLAIN)
    with pytest.raises(GeometryError, match="assembled near"):
        joints_margin(motion, PLAIN, ALPHA, [LengthTolerance(2, (1, 3), 2.4)])
    with pytest.raises(GeometryError, match="fit with clearance"):
        joints_margin(motion, PLAIN, ALPHA, [FitClearance((1, 2), "35 H7/p6", 10.0)])
    with pytest.raises(GeometryError, match="never for others"):
        joints_margin(motion, PLAIN, ALPHA, [FitClearance((1, 2), "35 H7/c11", 3.6)])
    with pytest.raises(GeometryError, match="no quantity"):
        probability(joints_margin(motion, PLAIN, ALPHA), {"nonsense": Distribution.uniform("[0, 1]")})


@pytest.mark.long
def test_limits_that_are_zero_by_name_count_with_their_range() -> None:
    """Free or not depends on what a limit may be; without any the question is refused."""
    motion = FOUR.simulate("60..120 deg")
    pairs = (0, 3), (1, 2), (2, 3)
    named = [
        joints_margin(motion, {pair: JointLimits(own, tilt_range=(0.0, 0.02)) for pair in pairs}, ALPHA)
        for own in (0.0, 0.01)
    ]
    x = np.array([[0.007, 0.007, 0.007, 0.012], [0.005, 0.005, 0.005, 0.012]])
    assert list(named[0].names)[-1] == "alpha 0-1"
    found = [margin.sampled(x) for margin in named]
    assert found[0] == pytest.approx(found[1], abs=1e-9) and found[0][0] > 0.0 > found[0][1]
    wide = {name: fixed("0.007") for name in named[0].names[:-1]} | {
        "alpha 0-1": Distribution.uniform("[0.010, 0.013]")
    }
    assert [probability(margin, wide).upper for margin in named] == [0.0, 0.0]
    with pytest.raises(GeometryError, match="no joint has a limit above zero"):
        joints_margin(motion, JointLimits(0.0), ALPHA)


def test_tolerances_of_no_width_are_no_quantities() -> None:
    motion = FOUR.simulate("30..120 deg")
    none = [AxisAngle(2, 3, 0.0), LengthTolerance(1, (0, 2), 0.0)]
    with_none, without = (joints_margin(motion, PLAIN, ALPHA, parts) for parts in (none, ()))
    wide = [name for name, own in with_none.ranges.items() if not own.is_point]
    assert wide == list(without.ranges)
    values = [
        margin.sampled(np.array([[float(own.upper) for own in margin.ranges.values()]]))
        for margin in (with_none, without)
    ]
    assert values[0] == pytest.approx(values[1], abs=1e-6)


def test_fits_that_may_interfere_by_another_distribution_are_refused() -> None:
    margin = four_bar(joints=PLAIN, tolerances=[FitClearance((1, 2), "35 F7/h6", 10.0)])
    with pytest.raises(GeometryError, match="interfere"):
        probability(margin, {"shaft 1-2": Distribution.uniform("[-0.016, 0.1]")})
