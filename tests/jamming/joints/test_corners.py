"""Corners of the boxes of misalignments: nothing of a box lies outside them, and what they prove is true."""

import math
from dataclasses import replace
from itertools import pairwise

import mpmath
import numpy as np
import pytest
from coupled_oracles import driven_pair, embodied, four_bar
from hypothesis import assume, example, given, settings, strategies as st
from scipy.optimize import nnls

from graphsynth import simulate
from graphsynth.jamming import Bearing
from graphsynth.jamming.joints import RIGID, JointLimits, Misalignment, certify_coupled, direction_map, largest_scale
from graphsynth.jamming.joints.closure import lay_out
from graphsynth.jamming.joints.pieces import corner_layouts
from graphsynth.jamming.joints.program import problem

TURN = np.linspace(0.0, 2.0 * math.pi, 25)


def vectors(layouts):
    """All misalignments of every corner as one vector (corners, 2 n)."""
    return np.array([[v for _, _, tilt in layout.misalignments for v in tilt.vector] for layout in layouts])


def boxed(base, link, alpha, direction, rigid=True):
    return Misalignment(base, link, alpha[0], direction[0], rigid, tuple(alpha), tuple(direction))


def in_hull(point, corners):
    """Whether a point is a mixture of corners, to 1e-9 of the largest (least squares with weights of one sign)."""
    size = np.abs(corners).max()
    rows = np.vstack([corners.T / size, np.ones(len(corners))])
    return nnls(rows, np.append(point / size, 1.0))[1] < 1e-9


boxes = st.tuples(
    st.tuples(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4)), st.tuples(st.floats(-7, 7), st.floats(0, 7) | st.just(0.0))
)


@pytest.mark.long
@settings(max_examples=25, deadline=None)
@given(boxes, boxes, st.integers(0, 2**31))
@example(((0.1, 0.1), (0.0, 0.0)), ((-0.1, 0.2), (0.3, 3.2)), 0)
def test_no_member_lies_outside(one, two, seed):
    """Members of two boxes together are mixtures of the corners; of one alone, of the corners and their opposites."""
    rng = np.random.default_rng(seed)
    ranges = [(sorted(alpha), (low, low + wide)) for alpha, (low, wide) in (one, two)]
    assume(all(max(map(abs, alpha)) > 1e-6 for alpha, _ in ranges))
    mechanism = four_bar()
    tilts = (boxed(0, 1, *ranges[0]), boxed(0, 3, *ranges[1], rigid=False))
    members = []
    for alpha, (low, high) in ranges:
        a, d = rng.choice([*alpha, rng.uniform(*alpha)], 4), rng.choice([low, high, rng.uniform(low, high)], 4)
        members.append(np.stack([a * np.cos(d), a * np.sin(d)], axis=1))
    limits = (JointLimits(0.1),) * 4
    both = corner_layouts(lay_out(mechanism, limits, tilts))
    if len(both) > 1 or all(low == high for alpha, angle in ranges for low, high in (alpha, angle)):
        corners = vectors(both)
        shrink = 1.0 - 1e-9  # the test's own oracle has a tolerance
        centre = corners.mean(axis=0)
        for point in np.hstack(members):
            assert in_hull(centre + shrink * (point - centre), corners)
    for k, tilt in enumerate(tilts):
        corners = vectors(corner_layouts(lay_out(mechanism, limits, (tilt,))))
        mirrored = np.vstack([corners, -corners])
        for point in members[k]:
            assert in_hull((1.0 - 1e-9) * point, mirrored)


@pytest.mark.parametrize("wide", [1e-12, 0.01, 0.2618, 0.5, 3.0, 3.2, 6.3])
def test_polygons_are_rounded_outward(wide):
    """No chord between neighbouring corners comes nearer than A, in 40 digits."""
    alpha, low = 0.3, 1.7
    tilt = boxed(0, 1, (-0.1, alpha), (low, low + wide))
    corners = [layout.misalignments[0][2] for layout in corner_layouts(lay_out(four_bar(), (RIGID,) * 4, (tilt,)))]
    with mpmath.workdps(40):
        angles = [mpmath.mpf(own.direction) for own in corners]
        if wide >= math.pi:  # round to the opposite of the first
            angles.append(angles[0] + mpmath.pi)
            corners.append(corners[0])
        else:
            assert (angles[0], angles[-1]) == (low, low + wide)
        for (a, one), (b, two) in pairwise(zip(angles, corners)):
            assert min(one.alpha, two.alpha) * mpmath.cos((b - a) / 2) >= alpha
        assert max(own.alpha for own in corners) <= 1.009 * alpha


def test_many_boxes_fall_back_to_intervals():
    mechanism = embodied(8, 0)
    wide = [boxed(*joint.pair, (-0.01, 0.01), (0.0, 3.0), rigid=False) for joint in mechanism.joints[:3]]
    layout = lay_out(mechanism, (JointLimits(0.1),) * 10, tuple(wide))
    assert corner_layouts(layout) == (layout,)
    large = lay_out(mechanism, (JointLimits(0.1),) * 10, (boxed(*mechanism.joints[0].pair, (0.0, 0.5), (0.0, 0.1)),))
    assert corner_layouts(large) == (large,)


@pytest.mark.long
@pytest.mark.parametrize("turn", [np.linspace(0.6, 0.8, 3), pytest.param(TURN, marks=pytest.mark.slow)])
def test_any_direction(turn):
    """A tilt up to alpha in a direction nobody knows: proved free up to one percent below the worst direction."""
    motion = simulate(four_bar(), turn)
    unknown = Misalignment(0, 1, 0.0085, alpha_range=(0.0, 0.0085), direction_range=(0.0, 2.0 * math.pi))
    # theory/joints-that-share-a-tilt 6: the worst factor of the grid is 0.699 t_A / alpha, which allows 0.00868
    assert certify_coupled(motion, Bearing(), unknown).verdict.name == "CERTIFIED_FREE"
    more = replace(unknown, alpha=0.0088, alpha_range=(0.0, 0.0088))
    found = certify_coupled(motion, Bearing(), more, resolution=2e-2)
    assert found.verdict.name == "CERTIFIED_JAMMED_FOR_SOME"
    (own,) = found.witness.misalignments
    assert own.alpha == 0.0088 and math.degrees(own.direction) % 180.0 == pytest.approx(135.0, abs=6.0)


@pytest.mark.slow
def test_any_direction_of_a_larger_mechanism():
    """Both bounds of the allowed scale over all directions hold the value of a dense map of directions."""
    mechanism = embodied(6, 1)
    base, link = driven_pair(mechanism)
    motion = simulate(mechanism, TURN)
    unknown = Misalignment(base, link, 0.01, alpha_range=(0.0, 0.01), direction_range=(0.0, 2.0 * math.pi))
    found = largest_scale(motion, JointLimits(0.006, 0.001), unknown, relative_gap=2e-2, seconds=60.0)
    dense = simulate(mechanism, np.linspace(0.0, 2.0 * math.pi, 181))
    table = direction_map(dense, JointLimits(0.006, 0.001), Misalignment(base, link, 0.01), directions=90)
    assert found.low <= table.smallest_scale * (1 + 1e-9)
    assert found.low >= table.smallest_scale / 1.04


@pytest.mark.parametrize("links", [4, pytest.param(6, marks=pytest.mark.slow)])
def test_upper_bounds_hold_for_members(links):
    """Bounds of pieces against the factor of random members of boxes of alpha and direction."""
    rng = np.random.default_rng(links)
    mechanism = four_bar() if links == 4 else embodied(6, 0)
    base, link = (0, 1) if links == 4 else driven_pair(mechanism)
    motion = simulate(mechanism, np.linspace(0.5, 1.5, 9))
    alpha, direction = (-0.008, 0.012), (0.2, 1.1)
    tilt = Misalignment(base, link, 0.01, 0.5, alpha_range=alpha, direction_range=direction)
    proof = certify_coupled(motion, JointLimits(0.006, 0.001), tilt, resolution=0.1)
    inputs = np.linspace(0.5, 1.5, 60)
    dense = simulate(mechanism, inputs, start=motion.poses[0])
    place = np.searchsorted(proof.high, inputs)
    most = np.zeros(len(inputs))
    for _ in range(6):
        own = Misalignment(base, link, float(rng.choice(alpha)), float(rng.uniform(*direction)))
        value = problem(mechanism, JointLimits(0.006, 0.001), own).solve(dense.poses, "scale").lower
        assert (value <= proof.upper[place] * (1 + 1e-12)).all()
        most = np.maximum(most, value)
    assert (proof.upper[place] < 1.3 * most).mean() > 0.9  # and they are no idle bounds
