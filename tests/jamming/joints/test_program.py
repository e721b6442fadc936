"""The convex program against independent answers, its duality and its invariances."""

import math
from functools import cache

import mpmath
import numpy as np
import pytest
from coupled_oracles import body_rows, driven_pair, embodied, four_bar, polygon_bounds, single_loop
from hypothesis import given, settings, strategies as st
from scipy.optimize import minimize

from graphsynth import Driver, Gear, Mechanism, MechanismGraph, PinSlot, Prismatic, Revolute, simulate
from graphsynth.core.errors import GeometryError
from graphsynth.jamming import Bearing
from graphsynth.jamming.joints import (
    FREE,
    RIGID,
    SPHERICAL,
    JointLimits,
    Misalignment,
    SlideLimits,
    assess_coupled,
    bearing_limits,
    direction_map,
)
from graphsynth.jamming.joints.closure import joint_places, leans
from graphsynth.jamming.joints.program import problem


def random_limits(mechanism, seed, plays=(0.0, 0.0, 0.02, 0.2)):
    rng = np.random.default_rng(seed)
    return {
        joint.pair: JointLimits(float(rng.uniform(0.5, 2.0)), float(rng.choice(plays))) for joint in mechanism.joints
    }


CASES = [(6, 0), (6, 1), (8, 0), (8, 3), (8, 7)]


@pytest.mark.long
@pytest.mark.parametrize(("links", "number"), CASES)
def test_against_a_linear_program_of_the_bodies(links, number):
    mechanism = embodied(links, number)
    limits = random_limits(mechanism, number)
    base, link = driven_pair(mechanism)
    motion = simulate(mechanism, np.linspace(0.1, 6.1, 7))
    tilt = Misalignment(base, link, 0.3, 0.7)
    report = assess_coupled(motion, limits, tilt)
    assert report.duality_gap.max() < 1e-12
    limit = {pair: own.tilt for pair, own in limits.items()}
    play = {pair: own.axial_clearance for pair, own in limits.items()}
    for k in range(len(motion.inputs)):
        own = (mechanism, motion.poses[k], limit, play, (base, link), tilt.vector)
        low, high = polygon_bounds(*own)
        assert low * (1 - 1e-7) <= report.factor[k] <= high * (1 + 1e-7)
        low, high = polygon_bounds(*own, hold_play=False)
        assert low * (1 - 1e-7) <= 1.0 / report.allowed_scale[k] <= high * (1 + 1e-7)


def test_against_a_general_optimiser():
    """SLSQP on the body form of a six-link mechanism, from several starts."""
    mechanism = embodied(6, 0)
    base, link = driven_pair(mechanism)
    motion = simulate(mechanism, [0.5, 2.0])
    given_ = problem(mechanism, JointLimits(1.0), Misalignment(base, link, 0.5, 0.4))
    found = given_.solve(motion.poses)
    at = joint_places(mechanism, given_.layout.joints, motion.poses)
    tilts, slips = body_rows(given_, at.r, at.e)
    d = leans(given_.layout, at).d
    free = given_.layout.limit > 0.0
    for k in range(2):
        A = tilts[k][free]
        fixed = np.concatenate([slips[k], tilts[k][~free].reshape(-1, tilts.shape[-1])])
        target = np.concatenate([np.zeros(len(slips[k])), d[k][given_.layout.block_joint][~free].ravel()])
        start = np.linalg.lstsq(fixed, target, rcond=None)[0]
        null = np.linalg.svd(fixed)[2][np.linalg.matrix_rank(fixed) :].T
        rng, best = np.random.default_rng(k), math.inf
        for _ in range(6):
            result = minimize(
                lambda v: v[-1], np.append(rng.normal(0.0, 0.1, null.shape[1]), 3.0), method="SLSQP",
                jac=lambda v: np.eye(len(v))[-1], options={"maxiter": 500, "ftol": 1e-14},
                bounds=[(None, None)] * null.shape[1] + [(0.0, None)],
                constraints=[{"type": "ineq", "fun": lambda v, A=A, start=start, null=null: (
                    v[-1] ** 2 - ((A @ (start + null @ v[:-1])) ** 2).sum(-1)
                )}],
            )  # fmt: skip
            reached = np.sqrt(((A @ (start + null @ result.x[:-1])) ** 2).sum(-1).max())  # whatever it says of itself
            best = min(best, float(reached))
        assert found.upper[k] <= best * (1 + 1e-9)
        assert found.upper[k] == pytest.approx(best, rel=2e-6)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_single_loop_to_many_digits(seed):
    """theory/joints-that-share-a-tilt 4: the search over the point p, in 25 digits, with axial play."""
    rng = np.random.default_rng(seed)
    mechanism = four_bar()
    limits = {(1, 2): rng.uniform(0.3, 3), (2, 3): rng.uniform(0.3, 3), (0, 3): rng.uniform(0.3, 3)}
    plays = dict(zip(limits, rng.uniform(0, 0.1, 3))) if seed else dict.fromkeys(limits, 0.0)
    angle, alpha = float(rng.uniform(0, 6)), 0.5
    motion = simulate(mechanism, [float(rng.uniform(0, 6))])
    bearings = {pair: JointLimits(limits[pair], plays[pair]) for pair in limits}
    report = assess_coupled(motion, bearings, Misalignment(0, 1, alpha, angle))
    points = [motion.point(1, (1.0, 0.0)).position[0], motion.point(2, (2.5, 0.0)).position[0], (2.0, 0.0)]
    a = (alpha * math.cos(angle), alpha * math.sin(angle))
    exact = single_loop(points, list(limits.values()), a, (0.0, 0.0), sum(plays.values()), digits=22)
    assert report.factor[0] == pytest.approx(float(exact), rel=1e-11)


@pytest.mark.parametrize(("links", "number"), [(8, 0)])
def test_loop_and_body_form_agree(links, number):
    """The tilts of the loop form are those of a field of the bodies, and reach T there."""
    mechanism = embodied(links, number)
    base, link = driven_pair(mechanism)
    given_ = problem(mechanism, random_limits(mechanism, 5), Misalignment(base, link, 0.02, 2.0))
    motion = simulate(mechanism, np.linspace(0.0, 6.0, 25))
    found = given_.solve(motion.poses)
    at = joint_places(mechanism, given_.layout.joints, motion.poses)
    tilts, slips = body_rows(given_, at.r, at.e)
    d = leans(given_.layout, at).d[:, given_.layout.block_joint]
    rows = np.concatenate([tilts.reshape(25, -1, tilts.shape[-1]), slips], axis=1)
    values = np.concatenate([(found.tau + d).reshape(25, -1), found.zeta], axis=1)
    for k in range(25):
        z, *_ = np.linalg.lstsq(rows[k], values[k], rcond=None)
        assert np.abs(rows[k] @ z - values[k]).max() < 1e-14
    lean = np.hypot(found.tau[..., 0], found.tau[..., 1])
    limit = given_.layout.limit
    assert (lean <= found.upper[:, None] * limit * (1 + 1e-12)).all()
    assert (np.abs(found.zeta) <= given_.layout.end_float * (1 + 1e-12)).all()


@pytest.mark.long
@settings(max_examples=8, deadline=None)
@given(
    st.floats(-9, 9), st.floats(0, 6.28), st.booleans(), st.floats(0, 6.28), st.floats(0, 6.28), st.floats(0.01, 100.0)
)
def test_invariances(exponent, turn, mirrored, f, direction, growth):
    """Unit of length, rotation, mirror image, and proportion to alpha where there is no play."""
    scale = 10.0**exponent
    plain = four_bar()
    reference = assess_coupled(simulate(plain, [f]), JointLimits(1e-3), Misalignment(0, 1, 1e-3, direction)).factor[0]
    scaled = four_bar(scale=scale)
    limits = JointLimits(1e-3, 0.0)
    value = assess_coupled(simulate(scaled, [f]), limits, Misalignment(0, 1, 1e-3, direction)).factor[0]
    assert value == pytest.approx(reference, rel=1e-9)
    c, s = math.cos(turn), math.sin(turn)
    graph = plain.graph
    turned = Mechanism(graph, [
        Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (2.5, 0.0), (2.5, 0.0)),
        Revolute(0, 3, (2.0 * c, 2.0 * s)),
    ], [Driver(0, 1)])  # fmt: skip
    motion = simulate(turned, [f + turn])
    value = assess_coupled(motion, limits, Misalignment(0, 1, 1e-3, direction + turn)).factor[0]
    assert value == pytest.approx(reference, rel=1e-9)
    if mirrored:
        motion = simulate(plain, [-f], modes={0: -1})
        other = simulate(plain, [f])
        if np.allclose(motion.poses[0, 2, :2] * [1, -1], other.poses[0, 2, :2], atol=1e-9):
            value = assess_coupled(motion, limits, Misalignment(0, 1, 1e-3, -direction)).factor[0]
            assert value == pytest.approx(reference, rel=1e-9)
    grown = assess_coupled(simulate(plain, [f]), JointLimits(1e-3), Misalignment(0, 1, 1e-3 * growth, direction))
    assert grown.factor[0] == pytest.approx(growth * reference, rel=1e-10)


def test_factor_and_scale_pass_one_together():
    mechanism = embodied(6, 1)
    base, link = driven_pair(mechanism)
    motion = simulate(mechanism, np.linspace(0.0, 6.0, 13))
    limits = random_limits(mechanism, 3)
    report = assess_coupled(motion, limits, Misalignment(base, link, 0.4, 1.0))
    for k in range(0, 13, 3):
        one = simulate(mechanism, [motion.inputs[k]], start=motion.poses[k])
        alpha = 0.4 * report.allowed_scale[k]
        if alpha < 0.5:
            touching = assess_coupled(one, limits, Misalignment(base, link, alpha, 1.0))
            assert touching.factor[0] == pytest.approx(1.0, abs=1e-9)


@pytest.mark.long
def test_prices_are_derivatives():
    mechanism = embodied(6, 0)
    base, link = driven_pair(mechanism)
    motion = simulate(mechanism, [1.234])
    limits = random_limits(mechanism, 11, plays=(0.01, 0.02))
    tilt = Misalignment(base, link, 0.3, 0.2)
    report = assess_coupled(motion, limits, tilt)
    assert report.shadow_price[0].sum() == pytest.approx(1.0, abs=1e-12)
    step = 1e-5
    for k, (pair, _) in enumerate(report.names):
        if pair == (min(base, link), max(base, link)):
            continue
        values = []
        for sign in (1.0, -1.0):
            changed = {
                **limits,
                pair: JointLimits(limits[pair].tilt * math.exp(sign * step), limits[pair].axial_clearance),
            }
            values.append(assess_coupled(motion, changed, tilt).factor[0])
        slope = (values[0] - values[1]) / (2.0 * step) / report.factor[0]
        assert slope == pytest.approx(-report.shadow_price[0, k], abs=1e-6)
    for k, pair in enumerate(report.joints):
        if pair == (min(base, link), max(base, link)):
            continue
        values = []
        for sign in (1.0, -1.0):
            changed = {
                **limits,
                pair: JointLimits(limits[pair].tilt, limits[pair].axial_clearance * math.exp(sign * step)),
            }
            values.append(assess_coupled(motion, changed, tilt).factor[0])
        assert (values[0] - values[1]) / (2.0 * step) == pytest.approx(-report.axial_shadow_price[0, k], abs=1e-6)


def test_loosening_order(lambda_mechanism):
    """At the worst pose half of the price each is that of A and C; five percent more there allows as much more tilt."""
    motion = simulate(lambda_mechanism, [math.pi / 2])
    report = assess_coupled(motion, Bearing(), Misalignment(0, 1, 0.01))
    assert [one.joint for one in report.sensitivities] in ([(1, 2), (0, 3)], [(0, 3), (1, 2)])
    assert [one.gain for one in report.sensitivities] == pytest.approx([0.5, 0.5])
    assert report.to_pandas().shape == (1, 4 + 2 * len(report.names))
    assert report.summary()["verdict"] == "FREE_ESTIMATED"


def test_two_misaligned_axes_add_up(lambda_mechanism):
    """T* is convex and homogeneous in the misalignments: the sum of two is no worse than the two together."""
    motion = simulate(lambda_mechanism, np.linspace(0.0, 6.0, 25))
    one = Misalignment(0, 1, 0.01, 0.3)
    two = Misalignment(0, 3, 0.02, 1.9, rigid=False)
    first, second, both = (
        assess_coupled(motion, JointLimits(0.005), tilts).factor
        for tilts in (one, (Misalignment(0, 1, 0.0), two), (one, two))
    )
    assert (both <= (first + second) * (1 + 1e-12)).all()
    assert (both >= np.abs(first - second) * (1 - 1e-12)).all()


def test_a_tilted_seat_on_a_moving_link(lambda_mechanism):
    """The seat on one link tilted one way is the seat on the other tilted back; directions turn with their links."""
    for f in (0.4, 2.9):
        motion = simulate(lambda_mechanism, [f])
        turned = motion.poses[0, 1, 2] - motion.poses[0, 2, 2]
        straight = Misalignment(0, 1, 0.0)
        factors = [
            assess_coupled(motion, JointLimits(0.005), (straight, tilt)).factor[0]
            for tilt in (
                Misalignment(1, 2, 0.01, 0.7, rigid=False),
                Misalignment(2, 1, 0.01, 0.7 + turned, rigid=False),
                Misalignment(2, 1, 0.01, 0.7 + turned + math.pi, rigid=False),
                Misalignment(1, 2, 0.01, 1.7, rigid=False),
            )
        ]
        assert factors[0] > 0.1
        assert factors[1] == pytest.approx(factors[0], rel=1e-12) and factors[2] == pytest.approx(factors[0], rel=1e-12)
        assert abs(factors[3] - factors[0]) > 1e-3


def slider_crank(offset=0.2):
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [
        Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (3.0, 0.0), (0.0, 0.0)),
        Prismatic(0, 3, (0.0, offset), (0.0, 0.0)),
    ]  # fmt: skip
    return Mechanism(graph, joints, [Driver(0, 1)])


def test_slider_limits():
    """A guide without pitch limit is looser than one with; equal limits about two axes are looser than a round one."""
    motion = simulate(slider_crank(), np.linspace(0.1, 6.0, 19))
    tilt = Misalignment(0, 1, 0.01, 0.8)
    pins = {(1, 2): JointLimits(0.01), (2, 3): JointLimits(0.01)}
    tight = assess_coupled(motion, {**pins, (0, 3): SlideLimits(0.01, 0.01)}, tilt)
    loose = assess_coupled(motion, {**pins, (0, 3): SlideLimits(0.01, math.inf)}, tilt)
    round_ = assess_coupled(motion, {**pins, (0, 3): JointLimits(0.01)}, tilt)
    assert tight.duality_gap.max() < 1e-12 and loose.duality_gap.max() < 1e-12
    assert (loose.factor <= tight.factor * (1 + 1e-12)).all()
    assert (tight.factor <= round_.factor * (1 + 1e-12)).all()
    assert (round_.factor <= tight.factor * math.sqrt(2) * (1 + 1e-12)).all()
    assert np.isnan(loose.consumption[:, [name[1] == "pitch" for name in loose.names]]).all()


def test_coincident_and_collinear_joints():
    """All joints on one line (a change point), and two joints at one point."""
    line = four_bar(3.0, 1.0, 3.5, 1.5)  # 1 + 3.5 = 3 + 1.5: O = 0, A = 1, C = 3 and B = 4.5 on the x axis
    motion = simulate(line, [0.0])
    places = [motion.point(1, (1.0, 0.0)).position[0], motion.point(2, (3.5, 0.0)).position[0]]
    np.testing.assert_allclose(places, [[1.0, 0.0], [4.5, 0.0]], atol=1e-7)
    for direction in (0.0, 1.0, math.pi / 2):
        report = assess_coupled(motion, JointLimits(0.01), Misalignment(0, 1, 0.01, direction))
        assert report.duality_gap[0] < 1e-12
    square = four_bar(1.0, 1.0, 1.0, 1.0)
    with np.errstate(all="ignore"):
        folded = simulate(square, [math.pi - 1e-13, math.pi])
    assert assess_coupled(folded, JointLimits(0.01), Misalignment(0, 1, 0.01, 1.0)).duality_gap[0] < 1e-9


def test_nothing_helps_a_rigid_mechanism(lambda_mechanism):
    motion = simulate(lambda_mechanism, [0.3, 1.0])
    report = assess_coupled(motion, RIGID, Misalignment(0, 1, 1e-6))
    assert np.isinf(report.factor).all() and report.verdict.name == "JAMMED_ESTIMATED"
    assert (report.allowed_scale == 0.0).all()


def test_limits_that_only_touch_one_joint(lambda_mechanism):
    """With A, B spherical and C rigid nothing holds the coupler: no jam at all."""
    motion = simulate(lambda_mechanism, [0.3, 1.0])
    loose = {(1, 2): SPHERICAL, (2, 3): SPHERICAL, (0, 3): RIGID}
    report = assess_coupled(motion, loose, Misalignment(0, 1, 0.1))
    # the coupler between two spherical joints tilts freely, so no limit is in play
    assert (report.factor == 0.0).all() and report.verdict.name == "FREE_ESTIMATED"
    report = assess_coupled(motion, {(1, 2): FREE, (2, 3): RIGID, (0, 3): RIGID}, Misalignment(0, 1, 0.1))
    assert (report.factor == 0.0).all() and "no closed loop" in report.notes[0]


def test_axial_play_alone_decides(lambda_mechanism):
    """Spherical joints at A, B, C, with play at A only: the lift of the crank pin passes through freely."""
    motion = simulate(lambda_mechanism, [math.pi / 2])
    spherical = JointLimits(math.inf)
    rigid_rest = {(1, 2): JointLimits(math.inf, 0.05), (2, 3): RIGID, (0, 3): RIGID}
    report = assess_coupled(motion, rigid_rest, Misalignment(0, 1, 0.1))
    # pin height 0.1 at f = 90 deg against a play of 0.05: jams whatever the tilt limits, scale 1 / 2
    assert report.allowed_scale[0] == pytest.approx(0.5, rel=1e-12)
    assert np.isinf(report.factor[0])
    free = assess_coupled(motion, {**rigid_rest, (2, 3): spherical}, Misalignment(0, 1, 0.1))
    assert free.factor[0] == 0.0


def test_gear_contacts_guide_nothing():
    """Two wheels on the frame: each loop passes the contact, so no guided loop is closed."""
    graph = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
    wheels = Mechanism(graph, [Revolute(0, 1), Revolute(0, 2, (3.0, 0.0)), Gear(1, 2, radius_a=1.0, radius_b=2.0)],
                       [Driver(0, 1)])  # fmt: skip
    report = assess_coupled(simulate(wheels, [0.0, 1.0]), JointLimits(0.01), Misalignment(0, 1, 0.1))
    assert (report.factor == 0.0).all()
    with pytest.raises(GeometryError, match="guides nothing"):
        assess_coupled(simulate(wheels, [0.0]), {(1, 2): JointLimits(0.1), (0, 2): RIGID}, Misalignment(0, 1, 0.1))


def test_pin_in_slot_with_and_without_guidance():
    """Scotch yoke: the slot may guide roll and pitch, or nothing."""
    graph = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
    yoke = Mechanism(graph, [Revolute(0, 1), Prismatic(0, 2), PinSlot(2, 1, (0.0, 0.0), (1.0, 0.0), math.pi / 2)],
                     [Driver(0, 1)])  # fmt: skip
    motion = simulate(yoke, np.linspace(0.2, 6.0, 9))
    tilt = Misalignment(0, 1, 0.01)
    guide = SlideLimits(0.01, 0.01)
    assert (assess_coupled(motion, {(0, 2): guide}, tilt).factor == 0.0).all()
    held = assess_coupled(motion, {(0, 2): guide, (1, 2): SlideLimits(0.01, 0.01)}, tilt)
    assert held.factor.min() > 0.4 and held.duality_gap.max() < 1e-12


@cache
def eight_directions():
    motion = simulate(four_bar(), np.linspace(0.0, 6.0, 13))
    return motion, direction_map(motion, JointLimits(0.01, 0.003), Misalignment(0, 1, 0.01, 0.0), directions=8)


@pytest.mark.long
@settings(max_examples=8, deadline=None)
@given(st.floats(0.0, 6.28))
def test_no_direction_is_worse_than_the_bound(angle):
    motion, found = eight_directions()
    assert found.allowed_scale.shape == (8, 13)
    other = assess_coupled(motion, JointLimits(0.01, 0.003), Misalignment(0, 1, 0.01, angle))
    assert other.smallest_scale >= found.bound * (1 - 1e-12)


def test_bearing_ranges():
    exact = 0.006064396559156420060266102798724801172486
    own = bearing_limits(Bearing())
    low, high = own.tilt_range
    assert low < exact < high and high - low < 1e-16
    wide = bearing_limits(Bearing(), radius_tolerance=0.005, height_tolerance=0.05, clearance_tolerance=0.003)
    for condition in ("A", "B"):
        wide = bearing_limits(
            Bearing(), condition, radius_tolerance=0.005, height_tolerance=0.05, clearance_tolerance=0.003
        )
        for R in (17.495, 17.505):
            for H in (9.95, 10.05):
                for c in (0.027, 0.033):
                    angle = Bearing(R, H, c).critical_tilt(condition).angle
                    assert wide.tilt_range[0] * (1 - 1e-13) <= angle <= wide.tilt_range[1] * (1 + 1e-13)
    assert bearing_limits(Bearing(Hb=1.0)).tilt == math.inf  # h^2 < c (2 R + c)


def extent(R, half, hole, tilt):
    """Largest half width of a tilted pin inside the slab of its hole (theory/bearing-contact 4)."""
    s, c = mpmath.sin(tilt), mpmath.cos(tilt)
    if R * s >= half * c:
        return mpmath.sqrt(R * R + half * half)
    return R * c + half * s if half * c - R * s <= hole else (R + hole * s) / c


@pytest.mark.long
def test_range_of_the_general_pin_is_proved():
    """No pin within tolerance jams below the range, every one jams above it: 50 digits, 400 random pins."""
    rng = np.random.default_rng(6)
    with mpmath.workdps(50):
        for _ in range(400):
            R, H, c = rng.uniform(1, 20), rng.uniform(0.1, 30), rng.choice([rng.uniform(0, 0.5), 1e-6, 0.0])
            hole = H * rng.choice([1.0, 1.0 - 1e-9, rng.uniform(0.05, 2.0)])
            sizes = [rng.choice([0.0, 0.01 * rng.random()]) * value for value in (R, H, c, hole)]
            names = ("radius_tolerance", "height_tolerance", "clearance_tolerance", "hole_tolerance")
            low, high = bearing_limits(Bearing(R, H, c, hole), "general", **dict(zip(names, sizes))).tilt_range
            if not any(sizes) and high < 1.5:
                assert high - low <= 1e-14 * high
            for _ in range(3):
                r, h, g, s = (
                    mpmath.mpf(v) + mpmath.mpf(t) * rng.choice([-1.0, 1.0, rng.uniform(-1, 1)])
                    for v, t in zip((R, H, c, hole), sizes)
                )
                if low > 0.0:
                    assert extent(r, h / 2, s / 2, min(mpmath.mpf(low), mpmath.pi / 2)) <= r + g + 1e-45
                if high < 1.5:
                    assert extent(r, h / 2, s / 2, mpmath.mpf(high)) >= r + g - 1e-45


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: JointLimits(-1.0), "negative"),
        (lambda: JointLimits(math.nan), "not finite"),
        (lambda: JointLimits(0.1, tilt_range=(0.2, 0.3)), "outside its range"),
        (lambda: Misalignment(0, 1, 1.0), "small tilt"),
        (lambda: bearing_limits(Bearing(clearance=-0.01)), "interference fit"),
        (lambda: bearing_limits(Bearing(), clearance_tolerance=0.05), "reaches"),
        (lambda: bearing_limits(Bearing(), "general"), "hole_length"),
        (lambda: bearing_limits(Bearing(), hole_tolerance=0.1), "hole_tolerance"),
        (lambda: problem(four_bar(), {}, Misalignment(0, 1, 0.1)), "no limits"),
        (lambda: problem(four_bar(), {(0, 2): RIGID}, Misalignment(0, 1, 0.1)), "does not exist"),
        (lambda: problem(four_bar(), RIGID, Misalignment(0, 2, 0.1)), "no joint"),
        (lambda: problem(four_bar(), RIGID, [Misalignment(0, 1, 0.1), Misalignment(1, 0, 0.1)]), "two misalignments"),
        (lambda: problem(four_bar(), SlideLimits(0.1, 0.1), Misalignment(0, 1, 0.1)), "without a direction"),
        (lambda: problem(slider_crank(), Bearing(), Misalignment(0, 1, 0.1)), "does not fit"),
        (lambda: problem(four_bar(), "x", Misalignment(0, 1, 0.1)), "no limits"),
        (lambda: problem(four_bar(), RIGID, None), "no misalignment"),
        (lambda: problem(four_bar(), RIGID, [0.01]), "no misalignment"),
        (lambda: Misalignment(0, 1, 0.01, alpha_range=(-3.0, 3.0)), "small tilt"),
        (lambda: Misalignment(0, 1, 0.01, alpha_range=0.02), "no pair"),
        (lambda: JointLimits(0.1, tilt_range=(0.1, 0.1, 0.2)), "no pair"),
        (lambda: JointLimits(5e-324), "smaller than"),
        (lambda: assess_coupled(None, RIGID, Misalignment(0, 1, 0.1)), "no Motion"),
    ],
)
def test_bad_input_gets_a_sentence(make, text):
    with pytest.raises(GeometryError, match=text):
        make()


def test_rigid_joints_without_misalignment_are_free():
    """No limit has any width, and nothing does work: factor 0, not an exception."""
    motion = simulate(four_bar(), [0.0, 0.5, 1.0])
    report = assess_coupled(motion, Bearing(clearance=0.0), Misalignment(0, 1, 0.0), certify=True)
    assert (report.factor == 0.0).all() and report.verdict.name in ("CERTIFIED_FREE", "UNDECIDED")
    assert assess_coupled(motion, RIGID, Misalignment(0, 1, 1e-9), certify=True).verdict.name == "CERTIFIED_JAMMED"
