"""Joints that shift across their axes, with exact closure: closed form of one bearing, links placed by a search."""

import math

import numpy as np
import pytest
from coupled_oracles import four_bar
from scipy.optimize import brentq
from space_oracles import case
from spatial_oracle import spatial

from graphsynth import simulate
from graphsynth.core.errors import GeometryError
from graphsynth.jamming import assess_jamming, certified_arcs, compare_sensitivities, largest_scale
from graphsynth.jamming.joints import (
    RIGID,
    SPHERICAL,
    JointLimits,
    Misalignment,
    assess_coupled,
    certify_coupled,
    compare_sensitivities as small_sensitivities,
)
from graphsynth.jamming.joints.program import problem
from graphsynth.jamming.space import least_factor, prove_pose
from graphsynth.jamming.space.closure import Closure
from graphsynth.jamming.space.optimum import least_scale
from graphsynth.jamming.space.plane import in_space, start

ALPHA, U = 0.1, 1.3


def tilt_at_b(scale=1.0, a=0.05, b=0.04, u=U):
    """Least tilt of the bearing at B; crank 1 and coupler 2.5 long, shifts up to a in the joint at A, b in that at B.

    The pin at A moves down the slope of the crank's plane, that at B away from A along the coupler, whose axes then
    lean less.
    """
    return math.asin(math.sin(ALPHA) * (abs(math.sin(u)) - scale * a) / (2.5 + scale * b))


def shifting(tilt, a=0.05, b=0.04):
    return {(1, 2): JointLimits(math.inf, radial_clearance=a), (2, 3): JointLimits(tilt, radial_clearance=b),
            (0, 3): RIGID}  # fmt: skip


def posed(joints, u=U, alpha=ALPHA):
    mechanism = four_bar(2.0, 1.0, 2.5, 2.5)
    model = in_space(problem(mechanism, joints, Misalignment(0, 1, alpha)))
    return model, start(model, mechanism, simulate(mechanism, [u, u + 0.01]).poses[0])


@pytest.mark.long
@pytest.mark.parametrize(("a", "b"), [(0.05, 0.04), (0.0, 0.04)])
def test_one_bearing_leans_less_where_pins_may_shift(a, b):
    wanted = tilt_at_b(1.0, a, b)
    model, q = posed(shifting(wanted, a, b))
    assert least_scale(Closure(model, False), q).scale == pytest.approx(1.0, rel=1e-9)
    for side in (1.0, -1.0):
        model, q = posed(shifting(wanted * (1.0 + side * 1e-6), a, b))
        assert prove_pose(model, q).state == side


@pytest.mark.long
def test_the_common_factor_counts_shifts():
    model, q = posed(shifting(0.05))
    wanted = brentq(lambda s: tilt_at_b(s) - s * 0.05, 0.1, 2.0, xtol=1e-14)
    assert least_scale(Closure(model, False), q).scale == pytest.approx(wanted, rel=1e-9)


@pytest.mark.long
def test_verdicts_prices_and_ranges_of_a_motion():
    """Where the crank is across the bearing needs most; its clearances may be anything within their ranges."""
    motion = simulate(four_bar(2.0, 1.0, 2.5, 2.5), np.linspace(1.5, 1.6, 3))
    worst = tilt_at_b(u=math.pi / 2)
    for limit, verdict in ((1.001 * worst, "CERTIFIED_FREE"), (0.999 * worst, "CERTIFIED_JAMMED")):
        report = assess_jamming(motion, tilt=ALPHA, joints=shifting(limit), model="exact")
        assert report.verdict.name == verdict
        gains = {(row.joint, row.what): row.gain for row in report.sensitivities}
        assert set(gains) == {((1, 2), "shift"), ((2, 3), "shift"), ((2, 3), "tilt")}
    # alpha ~ limit (2.5 + b) / (1 - a): one percent more of each
    table = compare_sensitivities(motion, shifting(worst), ALPHA, model="exact", by=0.01)
    own = {(row.joint, row.what): (row.gain, row.promised) for row in table.rows}
    for key, rise in ((((1, 2), "shift"), 0.05 / 0.95), (((2, 3), "shift"), 0.04 / 2.54), (((2, 3), "tilt"), 1.0)):
        assert own[key] == pytest.approx((rise, rise), rel=0.02)
    ranged = shifting(worst) | {
        (1, 2): JointLimits(math.inf, radial_clearance=0.05, radial_clearance_range=(0.0, 0.06))
    }
    assert certified_arcs(motion, ranged, ALPHA, model="exact").verdict.name == "CERTIFIED_JAMMED_FOR_SOME"
    factor = least_factor(motion, shifting(worst), Misalignment(0, 1, ALPHA))
    assert factor.low < 1.0 < factor.high and factor.high - factor.low < 2e-3


def searched(seed):
    """A random four-bar whose joints shift, and the least factor that a search with rotation matrices finds."""
    rng = np.random.default_rng([seed, 12])
    mechanism, motion, tilt, limits, _ = case(rng, 4)
    more = {pair: (t, s, float(rng.uniform(0.02, 0.4) * tilt.alpha)) for pair, (t, s) in limits.items()}
    least, missed = spatial(mechanism, motion.poses[0], tilt, more).least_factor(3)
    assert missed < 1e-9

    def model(scale):
        joints = {pair: JointLimits(t * scale, s * scale, radial_clearance=r * scale)
                  for pair, (t, s, r) in more.items() if pair != tilt.pair}  # fmt: skip
        return in_space(problem(mechanism, joints, tilt))

    return model, start(model(1.0), mechanism, motion.poses[0]), least


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_a_search_finds_the_same_factor_and_contradicts_no_proof(seed):
    model, q, least = searched(seed)
    found = least_scale(Closure(model(1.0), False), q)
    assert found.missed < 1e-12 and found.scale == pytest.approx(least, rel=1e-6)
    for side in (1.0, -1.0):
        assert prove_pose(model(least * (1.0 + side * 2e-3)), q).state == side
        assert prove_pose(model(least * (1.0 + side * 1e-5)), q).state in (0.0, side)


def test_small_tilts_refuse_proofs_and_change_no_estimate():
    motion = simulate(four_bar(2.0, 1.0, 2.5, 2.5), np.linspace(1.5, 1.6, 3))
    for ask in (certify_coupled, largest_scale):
        with pytest.raises(GeometryError, match=r'radial clearance of 0.05.*ask model="exact"'):
            ask(motion, shifting(0.05), Misalignment(0, 1, ALPHA))
    rigid = {(1, 2): SPHERICAL, (2, 3): JointLimits(0.05), (0, 3): RIGID}
    with_shifts, without = (assess_coupled(motion, own, Misalignment(0, 1, ALPHA)) for own in (shifting(0.05), rigid))
    assert np.array_equal(with_shifts.factor, without.factor)
    assert small_sensitivities(motion, shifting(0.05), Misalignment(0, 1, ALPHA)).rows
    with pytest.raises(GeometryError, match="not joined"):
        JointLimits(0.1, radial_clearance=math.inf)
