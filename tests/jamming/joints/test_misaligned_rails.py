"""Rails that lean about their own points: small tilts are the first order of the exact closure."""

import math

import numpy as np
import pytest
from coupled_oracles import factor_bounds
from rails import MAKES, case, least_factor, question

from graphsynth import Driver, Mechanism, MechanismGraph, Prismatic, Revolute, simulate
from graphsynth.intervals import Interval
from graphsynth.jamming import Verdict
from graphsynth.jamming.joints import (
    RIGID,
    SPHERICAL,
    JointLimits,
    Misalignment,
    SlideLimits,
    assess_coupled,
    certify_coupled,
    closure,
)
from graphsynth.jamming.joints.closure import joint_places, leans
from graphsynth.jamming.joints.enclosure import Pieces
from graphsynth.jamming.joints.program import problem, solve_poses
from graphsynth.jamming.space.closure import Closure
from graphsynth.jamming.space.optimum import least_scale
from graphsynth.jamming.space.plane import in_space, start

LONG = pytest.mark.long


def small(mechanism, motion, limits, tilts):
    return float(problem(mechanism, limits, tilts).solve(motion.poses[:1], "scale").lower[0])


def exact(mechanism, motion, limits, tilts):
    model = in_space(problem(mechanism, limits, tilts))
    return least_scale(Closure(model, False), start(model, mechanism, motion.poses[0])).scale


def apart(name, seed, alpha):
    """Relative difference of the factors of both models, and whether the rail leans rather than the slider."""
    rng = np.random.default_rng([seed, 5])
    mechanism, motion, pair = case(rng, name)
    limits, tilts = question(rng, mechanism, pair, alpha)
    value = small(mechanism, motion, limits, tilts)
    rail = mechanism.joint(*pair).a == pair[0]
    return exact(mechanism, motion, limits, tilts) / value - 1.0 if value < 20.0 else 0.0, rail


@pytest.mark.long
@pytest.mark.parametrize("name", ["slider_crank", "slotted", pytest.param("swinging_block", marks=LONG),
                                  pytest.param("two_loops", marks=LONG)])  # fmt: skip
def test_small_tilts_are_the_first_order_of_the_exact_closure(name):
    """A hundredth of the tilts, a ten-thousandth of the difference; whichever seat leans, on the frame or a link."""
    for seed in range(3):
        far, near = (abs(apart(name, seed, alpha)[0]) for alpha in (1e-2, 1e-4))
        assert far < 2e-4 and near < 1e-4 * far + 2e-7


@pytest.mark.slow
@pytest.mark.parametrize("name", list(MAKES))
def test_small_tilts_are_the_first_order_at_many_mechanisms(name):
    kinds = set()
    for seed in range(100):
        difference, rail = apart(name, seed, 1e-3)
        kinds.add(rail)
        assert abs(difference) < 2e-5, seed
    assert kinds == {True, False}


def test_a_rail_that_leans_where_its_slider_is_would_be_another_mechanism(monkeypatch):
    """With the slider's place for the rail's point both models differ by a tenth and more."""
    monkeypatch.setattr(closure, "leaning_points", lambda layout, r, rail: r)
    rails = [abs(difference) for seed in range(6) for difference, rail in [apart("slider_crank", seed, 1e-3)] if rail]
    assert len(rails) >= 2 and max(rails) > 0.1


@pytest.mark.parametrize("name", list(MAKES))
def test_against_finite_rotations_and_linear_programs(name):
    for seed in range(2):
        rng = np.random.default_rng([seed, 6])
        mechanism, motion, pair = case(rng, name)
        limits, tilts = question(rng, mechanism, pair, 0.02)
        low, high = least_factor(mechanism, motion.poses[0], limits, tilts)
        assert low * (1.0 - 1e-6) <= small(mechanism, motion, limits, tilts) <= high * (1.0 + 1e-6)


def slider(angle, base):
    """Crank 1, coupler 3, a guide through the motor's axis in the direction ``angle``; the rail is on link ``base``."""
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    guide = Prismatic(base, 3 - base, angle_a=angle, angle_b=angle)
    return Mechanism(graph, [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (3.0, 0.0)), guide],
                     [Driver(0, 1)])  # fmt: skip


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_the_lift_of_a_slider_tilts_the_coupler(angle):
    """By alpha s sin(beta) at the distance s from the rail's point; a rail on the slider lifts at its own place."""
    alpha, beta = 0.01, 0.5
    motion = simulate(slider(angle, 0), np.linspace(angle + 0.1, angle + 6.0, 25))
    limits = {(0, 1): RIGID, (1, 2): JointLimits(0.1), (2, 3): SPHERICAL, (0, 3): SlideLimits(0.0, 0.0)}
    report = assess_coupled(motion, limits, Misalignment(0, 3, alpha, angle + beta))
    f = motion.inputs - angle
    s = np.cos(f) + np.sqrt(9.0 - np.sin(f) ** 2)
    assert report.factor == pytest.approx(alpha * s * math.sin(beta) / 3.0 / 0.1, rel=1e-9)
    # the seat on the slider leans where the slider is: the slider itself stays level on its rail
    other = assess_coupled(motion, limits, Misalignment(3, 0, alpha, angle + beta))
    assert other.factor == pytest.approx(0.0, abs=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("name", ["slider_crank", "slotted", pytest.param("swinging_block", marks=LONG),
                                  pytest.param("two_loops", marks=LONG)])  # fmt: skip
def test_bounds_meet_at_a_pose_and_hold_over_boxes(name):
    rng = np.random.default_rng(8)
    for _ in range(4):
        mechanism, motion, pair = case(rng, name)
        limits, tilts = question(rng, mechanism, pair, 0.02)
        given = problem(mechanism, limits, tilts)
        found = given.solve(motion.poses, "scale")
        places = joint_places(mechanism, given.layout.joints, motion.poses)
        values = places.r, places.e, *leans(given.layout, places)
        lower, upper = factor_bounds(given.layout, Pieces(*(Interval.from_bounds(v, v) for v in values)), found)
        assert (lower <= found.upper * (1.0 + 1e-12)).all() and (upper >= found.lower * (1.0 - 1e-12)).all()
        finite = np.isfinite(upper)
        assert (upper - lower)[finite] == pytest.approx(0.0, abs=1e-9 * found.upper.max())
        wide = Pieces(*(Interval.from_bounds(v[1:2] - 1e-3, v[1:2] + 1e-3) for v in values))
        middle = type(found)._make(part[1:2] if isinstance(part, np.ndarray) else part for part in found)
        lower, upper = factor_bounds(given.layout, wide, middle)
        for _ in range(5):
            r, e, d, about = (v[1:2] + rng.uniform(-1e-3, 1e-3, v[1:2].shape) for v in values)
            leaning = np.isin(np.arange(r.shape[1]), [place for place, _, _ in given.layout.misalignments])
            about = np.where(np.isin(np.arange(r.shape[1]), given.layout.rails)[:, None], about, r)
            own = closure.Leans(np.where(leaning[:, None], d, 0.0), about)
            other = solve_poses(given.layout, r, e, own, "scale")
            assert lower[0] <= other.upper[0] * (1.0 + 1e-12) and upper[0] >= other.lower[0] * (1.0 - 1e-12)


@LONG
@pytest.mark.parametrize("name", list(MAKES))
def test_ranges_near_the_verge_are_proved(name):
    """4 % beside the least allowed scale of small tilts the range is proved with exact tilts, on the right side."""
    rng, decided = np.random.default_rng(11), 0
    for _ in range(3):
        mechanism, motion, pair = case(rng, name)
        limits, tilts = question(rng, mechanism, pair, 0.004)
        scale = assess_coupled(motion, limits, tilts).smallest_scale
        if not 0.05 < scale < 5.0:
            continue
        for change, wanted in ((0.96, Verdict.CERTIFIED_FREE), (1.04, Verdict.CERTIFIED_JAMMED)):
            own = [Misalignment(t.base, t.link, t.alpha * scale * change, t.direction, t.rigid) for t in tilts]
            found = certify_coupled(motion, limits, own, resolution=1e-2)
            assert found.verdict in (wanted, Verdict.UNDECIDED)
            decided += found.verdict is wanted
    assert decided >= 3
