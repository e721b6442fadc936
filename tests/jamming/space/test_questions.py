"""Scale, prices, directions and arcs with exact closure in space, against the closed form of one bearing."""

import math

import numpy as np
import pytest
from coupled_oracles import four_bar
from space_oracles import case, joint_limits
from spatial_oracle import spatial

from graphsynth import Driver, Gear, Mechanism, MechanismGraph, Revolute, simulate
from graphsynth.core.errors import GeometryError
from graphsynth.jamming import (
    Verdict,
    assess_jamming,
    certified_arcs,
    compare_sensitivities,
    direction_map,
    largest_scale,
)
from graphsynth.jamming.joints import RIGID, SPHERICAL, JointLimits, Misalignment
from graphsynth.jamming.joints.program import problem
from graphsynth.jamming.space import least_factor
from graphsynth.jamming.space.along import Along, Change
from graphsynth.tolerances import LengthTolerance

LENGTHS, ALPHA, LIMIT = (1, 3, 2, 3.5), 0.08, 0.13


def one_bearing(limit=LIMIT):
    """Spherical at A, rigid at C: the bearing at B tilts by asin(1.5 sin(alpha) |sin(u - direction)|)."""
    return {(1, 2): SPHERICAL, (2, 3): JointLimits(limit), (0, 3): RIGID}


def moved(low, high, count=3, lengths=LENGTHS):
    return simulate(four_bar(*lengths), np.linspace(low, high, count))


def allowed(u, direction=0.0, limit=LIMIT):
    """Factor on the misalignment at which the bearing has no room left."""
    return math.asin(math.sin(limit) / (1.5 * abs(math.sin(u - direction)))) / ALPHA


@pytest.mark.slow
def test_the_scale_of_one_bearing_lies_between_its_bounds():
    motion, wanted = moved(1.5, 1.6), allowed(math.pi / 2)
    found = largest_scale(motion, one_bearing(), ALPHA, model="exact")
    assert found.low < wanted < found.high and found.relative_gap < 1e-3 and not found.reason
    assert found.at == pytest.approx(math.pi / 2, abs=0.02) and "exact closure" in found.model
    small = largest_scale(motion, one_bearing(), ALPHA)
    assert small.low > found.high and "small tilts" in small.model  # they differ by more than the bounds leave


@pytest.mark.slow
def test_with_tolerances_the_scale_is_that_of_the_worst_and_of_the_best_member():
    """Crank and coupler within 1 %: the bearing tilts by asin(l2 sin(alpha) sin(u) / l3)."""
    parts = [LengthTolerance(1, (0, 2), 0.03), LengthTolerance(2, (1, 3), 0.02)]
    found = largest_scale(moved(1.5, 1.6), one_bearing(), ALPHA, model="exact", tolerances=parts, seconds=300.0)
    worst, best = (math.asin(math.sin(LIMIT) * (2.0 + side) / (3.0 - 1.5 * side)) / ALPHA for side in (-0.02, 0.02))
    assert found.low < worst < best < found.high and not math.isinf(found.high)
    assert found.low > worst * (1.0 - 2e-3) and found.high < best * (1.0 + 2e-3)
    assert (found.low, found.high) != (0.0, math.inf) and "all members" in found.reason


@pytest.mark.slow
def test_the_least_factor_of_one_bearing_lies_between_its_bounds():
    least = least_factor(moved(1.5, 1.6), one_bearing(), Misalignment(0, 1, ALPHA))
    assert least.low < math.asin(1.5 * math.sin(ALPHA)) / LIMIT < least.high and least.relative_gap < 1e-3
    parts = [LengthTolerance(1, (0, 2), 0.03), LengthTolerance(2, (1, 3), 0.02)]
    factor = least_factor(moved(1.5, 1.6), one_bearing(), Misalignment(0, 1, ALPHA), tolerances=parts)
    ends = [math.asin((3.0 - 1.5 * side) / (2.0 + side) * math.sin(ALPHA)) / LIMIT for side in (0.02, -0.02)]
    assert factor.low < ends[0] < ends[1] < factor.high < ends[1] * (1.0 + 2e-3)


def test_no_scale_where_nothing_binds_or_everything_does():
    motion = moved(1.5, 1.6)
    found = largest_scale(motion, one_bearing(), 0.0, model="exact")
    assert (found.low, found.high) == (0.0, math.inf) and "no misalignment" in found.reason
    assert largest_scale(motion, RIGID, 0.01, model="exact").reason.startswith("it binds with any")
    assert "no limits are large enough" in least_factor(motion, RIGID, Misalignment(0, 1, 0.01)).reason
    assert "any limits will do" in least_factor(motion, JointLimits(0.1), Misalignment(0, 1, 0.0)).reason


@pytest.mark.slow
def test_the_map_of_directions_is_the_closed_form():
    motion = moved(1.25, 1.5)
    found = direction_map(motion, one_bearing(), ALPHA, model="exact", directions=3)
    wanted = [[allowed(u, k * math.pi / 3) for u in motion.inputs] for k in range(3)]
    at = np.argwhere(found.allowed_scale == found.smallest_scale)[0]
    assert found.smallest_scale == pytest.approx(np.min(wanted), rel=1e-9)
    assert tuple(at) == np.unravel_index(np.argmin(wanted), found.allowed_scale.shape)
    near = np.array(wanted) < 2.0
    assert np.allclose(found.allowed_scale[near], np.array(wanted)[near], rtol=5e-3)
    assert math.isnan(found.bound) and "exact closure" in found.model


def test_gain_and_promise_of_one_bearing():
    motion, by = moved(1.57, 1.571), 0.1
    table = compare_sensitivities(motion, one_bearing(), ALPHA, model="exact", by=by)
    (row,) = table.rows
    u = max(motion.inputs, key=math.sin)
    k = math.sin(LIMIT) / (1.5 * math.sin(u))
    slope = LIMIT * math.cos(LIMIT) / (1.5 * math.sin(u) * math.sqrt(1.0 - k * k) * math.asin(k))
    assert table.scale == pytest.approx(allowed(u), rel=1e-9) and "exact closure" in str(table)
    assert (row.joint, row.what) == ((2, 3), "tilt") and row.promised == pytest.approx(slope, rel=1e-2)
    assert row.gain == pytest.approx((allowed(u, limit=LIMIT * (1 + by)) / allowed(u) - 1) / by, rel=1e-7)
    assert row.without == math.inf  # the joint is then as good as spherical


@pytest.mark.slow
def test_prices_are_slopes_of_the_least_factor():
    """Differences of the exact factor; all joints tilt and slide."""
    motion, tilt = moved(0.7, 0.71, lengths=(2, 1, 2.5, 2.5)), Misalignment(0, 1, 0.2, 0.3)
    limits = {(1, 2): JointLimits(0.1, 0.02), (2, 3): JointLimits(0.05, 0.03), (0, 3): JointLimits(0.08, 0.01)}
    along = Along(problem(motion.mechanism, limits, tilt), motion)
    report = assess_jamming(motion, tilt=tilt, joints=limits, model="exact", certify=False)
    assert report.verdict.name.endswith("ESTIMATED") and "exact closure" in report.reason + report.model
    prices = dict(zip(report.names, report.shadow_price[0].tolist()))
    prices |= {(pair, "play"): price for pair, price in zip(report.joints, report.axial_shadow_price[0].tolist())}
    assert sum(prices.values()) == pytest.approx(1.0, abs=1e-9) and report.duality_gap[0] < 1e-9
    for k, joint in enumerate(motion.mechanism.joints):
        if joint.pair == tilt.pair:
            continue
        own = limits[joint.pair]
        for what, more in (("tilt", lambda f, own=own: JointLimits(own.tilt * f, own.axial_clearance)),
                           ("play", lambda f, own=own: JointLimits(own.tilt, own.axial_clearance * f))):  # fmt: skip
            ends = [along.least(0.7, motion.poses[0], Change(other=((k, more(f)),))).scale for f in (1.001, 0.999)]
            slope = -math.log(ends[0] / ends[1]) / math.log(1.001 / 0.999)
            assert prices[joint.pair, what] == pytest.approx(slope, abs=1e-5)


@pytest.mark.slow
def test_the_factor_on_the_misalignments_is_that_of_a_search_with_rotation_matrices():
    """A general program with no code in common: at the factor found no room is left."""
    rng = np.random.default_rng(21)
    mechanism, motion, tilt, limits, _ = case(rng, 4, 0.2)
    report = assess_jamming(motion, tilt=tilt, joints=joint_limits(limits, 1.0, tilt), model="exact", certify=False)
    scaled = Misalignment(tilt.base, tilt.link, tilt.alpha * report.smallest_scale, tilt.direction)
    at = int(np.argmin(report.allowed_scale))
    least, missed = spatial(mechanism, motion.poses[at], scaled, limits).least_factor()
    assert missed < 1e-9 and least == pytest.approx(1.0, abs=1e-7)


@pytest.mark.slow
def test_arcs_end_where_the_closed_form_has_them():
    alpha, motion = 1 / 30, moved(0.4, 0.5, lengths=(2, 1, 2.5, 2.5))
    joints = one_bearing(math.asin(0.4 * math.sin(alpha) * math.sin(0.45)))
    for model in ("small", "exact"):
        arcs = certified_arcs(motion, joints, alpha, model=model, resolution=0.05)
        ((first, free),), ((binds, last),), ((low, high),) = (arcs.arcs(state) for state in (1, -1, 0))
        assert first == 0.4 and last == 0.5 and low == free < 0.45 < binds == high and high - low < 0.04


@pytest.mark.slow
def test_reports_say_what_they_are_about_and_how_far_small_tilts_are_off():
    motion, alpha = moved(1.57, 1.571), 0.2
    small = assess_jamming(motion, tilt=alpha, joints=one_bearing(0.4), certify=False)
    u = small.smallest_scale_input
    exact = math.asin(1.5 * math.sin(alpha) * math.sin(u)) / (1.5 * alpha * math.sin(u))
    assert small.small_tilt_error == pytest.approx(exact - 1.0, rel=1e-6) and small.small_tilt_error > 8e-3
    assert "small tilts (first order), off by about 0.87 %" in small.details()
    own = assess_jamming(motion, tilt=alpha, joints=one_bearing(0.4), model="exact", certify=False)
    assert own.factor[own.inputs == u] == pytest.approx(small.factor[small.inputs == u] * exact, rel=1e-9)
    assert "exact closure in space" in own.details() and math.isnan(own.small_tilt_error)
    for model, words in (
        ("small", "proof of       L1 with exact tilts"),
        ("exact", "proof of       exact closure in space"),
    ):
        proved = assess_jamming(motion, tilt=0.02, joints=one_bearing(0.04), model=model)
        assert proved.verdict is Verdict.CERTIFIED_FREE and words in proved.details()


def test_a_word_for_no_model_and_mechanisms_that_are_not_described():
    motion = moved(1.0, 1.1)
    for ask in (largest_scale, compare_sensitivities, direction_map, certified_arcs):
        with pytest.raises(GeometryError, match="model"):
            ask(motion, 0.1, 0.01, model="best")
        with pytest.raises(GeometryError, match="no limits"):
            ask(motion, None, 0.01)
    graph = MechanismGraph(3, [(0, 1), (1, 2, 2), (0, 2)], frame=0)
    geared = Mechanism(graph, [Revolute(0, 1), Gear(1, 2, radius_b=2.0), Revolute(0, 2, (3.0, 0.0))], [Driver(0, 1)])
    turning = simulate(geared, [0.0, 0.1])
    given = {(0, 2): JointLimits(0.1)}
    for ask in (compare_sensitivities, direction_map):
        with pytest.raises(GeometryError, match="gear"):
            ask(turning, given, 0.01, model="exact")
    assert "gear" in largest_scale(turning, given, 0.01, model="exact").reason
    assert "gear" in least_factor(turning, given, Misalignment(0, 1, 0.01)).reason
    report = assess_jamming(turning, tilt=0.01, joints=given, model="exact")
    assert report.verdict is Verdict.UNDECIDED and "gear" in report.reason
    with pytest.raises(GeometryError, match="directions"):
        direction_map(motion, 0.1, 0.01, model="exact", directions=2)
    with pytest.raises(GeometryError, match="by = "):
        compare_sensitivities(motion, 0.1, 0.01, model="exact", by=0.0)
