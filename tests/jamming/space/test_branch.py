"""One continuous motion through pieces: assembly modes in closed form, ways between closures, members at faces."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from coupled_oracles import four_bar
from space_oracles import case, joint_limits
from test_members import lengths

from graphsynth import Mechanism, simulate
from graphsynth.intervals import Interval
from graphsynth.jamming import Verdict
from graphsynth.jamming.joints import RIGID, JointLimits, Misalignment
from graphsynth.jamming.joints.program import problem
from graphsynth.jamming.space import certify_in_space
from graphsynth.jamming.space.branch import Free, faces, joined
from graphsynth.jamming.space.closure import closures
from graphsynth.jamming.space.plane import in_space, start
from graphsynth.jamming.space.pose import free_poses
from graphsynth.jamming.space.proof import tubes

LIMIT, WIDE = 0.01, 0.02


@pytest.fixture(scope="module")
def modes():
    """Closures in both assembly modes of the lambda linkage with a leaning motor axis, for 1.2 and 1.24 within 0.02."""
    mechanism, tilt = four_bar(), Misalignment(0, 1, 0.008)
    model = in_space(problem(mechanism, JointLimits(LIMIT), tilt))
    inputs, found = np.array([1.2, 1.24]), []
    first = simulate(mechanism, inputs).poses
    for k in (0, 1):
        poses = first.copy()
        if k:  # the triangle of coupler and rocker on the other side of the line from B to C
            for pose in poses:
                (xb, yb), (xc, yc) = pose[2, :2], pose[3, :2]
                along = math.atan2(yc - yb, xc - xb)
                pose[2, 2], pose[3, 2] = 2.0 * along - pose[2, 2], 2.0 * along - pose[3, 2]
        q = np.array([start(model, mechanism, pose) for pose in poses])
        q[:, model.size] = inputs
        proofs = free_poses(model, q, np.full((2, 1), WIDE))
        assert [proof.state for proof in proofs] == [1, 1]
        found.append(Free.of([(proof.optimum.q, proof.lead) for proof in proofs], model.size))
    return SimpleNamespace(model=model, found=found)


def at(u):
    return Interval.from_bounds(np.array([[u]]), np.array([[u]]))


def test_pieces_of_one_mode_are_joined_and_those_of_two_are_not(modes):
    floats, enclosed = closures(modes.model)
    rows = np.array([0]), np.array([1])
    for first in (0, 1):
        for second in (0, 1):
            pair = modes.found[first].take(rows[0]), modes.found[second].take(rows[1])
            assert joined(enclosed, floats, *pair, at(1.22)).tolist() == [first == second]


def test_a_way_that_leaves_the_limits_is_none(modes):
    """From one closure to itself by another place: between them a limit is exceeded, so that no family leads there."""
    floats, enclosed = closures(modes.model)
    one = modes.found[0].take(np.array([0]))
    far = one._replace(at=one.at.copy())
    bound = modes.model.bounds[0]
    far.at[0, list(bound.columns)] = 1.01 * LIMIT, 0.0
    assert joined(enclosed, floats, one, one, at(1.2)).all() and not joined(enclosed, floats, one, far, at(1.2)).any()


@pytest.mark.parametrize(("part", "single"), [(0.02, True), (1.1, False), (3.0, False)])
def test_a_box_with_both_modes_is_never_one_of_a_single_closure(part, single):
    """Coupler and rocker are alike and nearly in line: by half to either side of it, so that C turns by four halves."""
    mechanism, half = Mechanism.four_bar(2.0, 0.98, 1.5, 1.5), math.acos(1.49 / 1.5)
    model = in_space(problem(mechanism, RIGID, Misalignment(0, 1, 0.0)))
    q = np.array([start(model, mechanism, simulate(mechanism, [math.pi]).poses[0])])
    loose, none = np.full((1, model.size), 4.0 * half * part), np.zeros((1, model.width, 0))
    found = tubes(closures(model)[1], q, none, none[:, 0], np.arange(3)[None], loose)
    assert model.size == 3 and found.single[0] == single
    assert not single or (found.reach >= loose).all()


def test_pieces_meet_where_one_ends_and_the_next_begins_and_members_are_common():
    low, high = np.array([0.0, 0.0, 1.0, 1.0, 2.0]), np.array([1.0, 1.0, 2.0, 3.0, 3.0])
    p_low, p_high = np.array([[-1.0, 0.0, -1.0, 0.0, -1.0], np.zeros(5)]).T, np.array([[0, 1, 0, 1, 0], np.zeros(5)]).T
    first, second = faces(low, high, p_low, p_high)
    assert sorted(zip(first.tolist(), second.tolist())) == [(0, 2), (1, 3), (2, 4)]
    assert faces(low[:1], high[:1], p_low[:1], p_high[:1])[0].size == 0


@pytest.mark.long
@pytest.mark.parametrize("part", [0.0, 0.002])
def test_one_motion_leads_through_a_part_of_a_rotation(part):
    motion, tilt = simulate(four_bar(), [0.4, 0.9]), Misalignment(0, 1, 0.011)
    found = certify_in_space(motion, JointLimits(LIMIT), tilt, tolerances=lengths(part) if part else 0.0)
    assert found.verdict is Verdict.CERTIFIED_FREE and found.one_branch and "one continuous motion" in found.reason
    jam = certify_in_space(simulate(four_bar(), [1.5, 1.6]), JointLimits(LIMIT), Misalignment(0, 1, 0.03))
    assert jam.verdict is Verdict.CERTIFIED_JAMMED and not jam.one_branch


@pytest.mark.slow
@pytest.mark.parametrize("links", [4, 6, 8])
def test_random_mechanisms_move_through_their_pieces(links):
    """Over 0.3 rad with 2 to 50 % of room in the limits."""
    rng, led = np.random.default_rng(links), 0
    for _ in range(8):
        mechanism, motion, tilt, limits, factor = case(rng, links)
        given = joint_limits(limits, factor * rng.choice([1.02, 1.1, 1.5]), tilt)
        motion = simulate(mechanism, motion.inputs[0] + np.linspace(0.0, 0.3, 9), start=motion.poses[0])
        found = certify_in_space(motion, given, tilt, seconds=math.inf)
        led += found.one_branch
        assert found.one_branch == (found.verdict is Verdict.CERTIFIED_FREE)
    assert led >= 5
