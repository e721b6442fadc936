"""Dimensions within tolerances, every loop closed in space: the closed form of one bearing, members drawn at random."""

import math
from dataclasses import replace

import numpy as np
import pytest
from coupled_oracles import four_bar
from space_oracles import case, joint_limits
from test_turn import one_bearing

from graphsynth import Mechanism, simulate
from graphsynth.intervals.balls import exact
from graphsynth.intervals.proving import points
from graphsynth.jamming import Bearing, Verdict
from graphsynth.jamming.joints import JointLimits, Misalignment, largest_scale as small_scale
from graphsynth.jamming.joints.program import problem
from graphsynth.jamming.space import certify_in_space, prove_pose
from graphsynth.jamming.space.apart import closes_apart
from graphsynth.jamming.space.binding import at
from graphsynth.jamming.space.bodies import Bodies
from graphsynth.jamming.space.closure import Closure
from graphsynth.jamming.space.members import Members
from graphsynth.jamming.space.optimum import some_closures
from graphsynth.jamming.space.plane import in_space, start
from graphsynth.jamming.space.pose import rates
from graphsynth.tolerances import EndFloat, FitClearance, HolePosition, LengthTolerance, ThermalExpansion, parameter_box

FREE, JAMMED, SOME = Verdict.CERTIFIED_FREE, Verdict.CERTIFIED_JAMMED, Verdict.CERTIFIED_JAMMED_FOR_SOME


def lengths(part):
    """All lengths of the lambda linkage."""
    ends = ((1, (0, 2), 1.0), (2, (1, 3), 2.5), (3, (2, 0), 2.5), (0, (1, 3), 2.0))
    return [LengthTolerance(link, pair, size * part) for link, pair, size in ends]


MIXED = [LengthTolerance(2, (1, 3), 0.03), HolePosition(1, 2, 0.04), HolePosition(0, 3, 0.03),
         ThermalExpansion(-80.0, 60.0, {1: 1e-4, 2: 2e-4, 3: 1e-4, 0: 3e-5})]  # fmt: skip


@pytest.fixture(scope="module")
def disturbed():
    """The lambda linkage with parameters of all kinds at a point beside its pose, and the sharp member there."""
    mechanism, tilt, rng = four_bar(), Misalignment(0, 1, 0.05, 0.4), np.random.default_rng(5)
    box = parameter_box(mechanism, MIXED)
    model = in_space(problem(mechanism, JointLimits(0.02, 0.01), tilt), box)
    q = start(model, mechanism, simulate(mechanism, [1.3]).poses[0]) + 0.02 * rng.normal(size=model.width)
    p = rng.uniform(box.low, box.high)
    q[model.size], q[-box.size :] = 1.3, p
    sharp = in_space(problem(box.member(mechanism, p), JointLimits(0.02, 0.01), tilt))
    return model, sharp, q, box


def test_parameters_move_the_loops_as_the_member_does(disturbed):
    """With a temperature up to the product of length and growth, which the box of the model encloses."""
    model, sharp, q, box = disturbed
    inside = Closure(model, True)
    found = inside.values(inside.loops(exact(q[None])))
    plain = Closure(sharp, True)
    wanted = plain.values(plain.loops(exact(q[None, : -box.size])))
    ratio = np.array([1.0, 1.0, 1.0, *[model.unit / sharp.unit] * 3])
    off = np.abs(found.mid * ratio - wanted.mid)[0]
    assert (off <= found.rad[0] * ratio + 1e-14).all() and found.rad.max() < 1e-3


def test_derivatives_by_parameters_are_differences(disturbed):
    model, _, q, _ = disturbed
    closure, rng = Closure(model, False), np.random.default_rng(2)
    by = rng.normal(size=(1, len(closure.rows)))

    def slopes(x):
        return closure.jacobian(closure.loops(x[None]))[0]

    J, H = slopes(q), closure.hessian(closure.loops(q[None]), by)[0]
    for k, unit in enumerate(np.eye(model.width) * 1e-5):
        rise = (closure.values(closure.loops((q + unit)[None])) - closure.values(closure.loops((q - unit)[None])))[0]
        assert J[:, k] == pytest.approx(rise / 2e-5, abs=1e-8)
        assert H[k] == pytest.approx(by[0] @ (slopes(q + unit) - slopes(q - unit)) / 2e-5, abs=1e-7)


def test_parameters_move_the_bodies_as_the_member_does(disturbed):
    model, sharp, q, box = disturbed
    own, plain = Bodies(model, q), Bodies(sharp, q[: -box.size])
    u = np.concatenate([np.random.default_rng(3).normal(size=own.size) * 0.02, [1.3], q[-box.size :]])
    found, wanted = at(own, exact(u[None])).V, at(plain, exact(u[None, : -box.size])).V
    off = np.abs(found.mid * model.unit / sharp.unit - wanted.mid)
    assert (off <= found.rad * model.unit / sharp.unit + 1e-14).all()


def test_over_boxes_the_loops_hold_all_members(disturbed):
    model, _, q, box = disturbed
    closure, rng = Closure(model, True), np.random.default_rng(4)
    ball = exact(q[None]).wider(np.concatenate([np.full(model.width - box.size, 0.01), 0.3 * box.high])[None])
    loops = closure.loops(ball)
    values, J = closure.values(loops), closure.jacobian(loops)
    for _ in range(20):
        x = q + ball.rad[0] * rng.uniform(-1.0, 1.0, model.width)
        near = closure.loops(exact(x[None]))
        value, slope = closure.values(near), closure.jacobian(near)
        assert (np.abs(value.mid - values.mid) <= values.rad + value.rad).all()
        assert (np.abs(slope.mid - J.mid) <= J.rad + slope.rad).all()


@pytest.mark.long
@pytest.mark.parametrize(("factor", "part", "verdict"),
                         [(0.95, 0.01, FREE), (0.995, 1e-3, FREE), (0.9999, 1e-6, FREE), (1.003, 0.01, SOME),
                          (1.045, 0.01, JAMMED)])  # fmt: skip
def test_one_bearing_with_crank_and_coupler_in_tolerance(factor, part, verdict):
    """The bearing tilts by asin(l2 sin(alpha) |sin u| / l3): the longest crank with the shortest coupler is the worst.

    With 1 % the other end is 1.0404 times the limit away.
    """
    motion, limit = simulate(four_bar(), [1.57, 1.571]), 0.05
    height = math.sin(limit) * 2.5 * (1.0 - part) / (1.0 + part)
    alpha = factor * math.asin(height / math.sin(1.5705))
    parts = [LengthTolerance(1, (0, 2), part), LengthTolerance(2, (1, 3), 2.5 * part)]
    given = one_bearing(JointLimits(limit)), Misalignment(0, 1, alpha)
    found = certify_in_space(motion, *given, tolerances=parts)
    assert found.verdict is verdict
    if verdict is SOME:
        deviations = dict(found.witness.deviations)
        assert deviations["length 0-2 of link 1"] > 0.0 > deviations["length 1-3 of link 2"]
        crank, coupler = 1.0 + deviations["length 0-2 of link 1"], 2.5 + deviations["length 1-3 of link 2"]
        assert crank * math.sin(alpha) * math.sin(found.witness.input) / coupler > math.sin(limit)
        alone = simulate(found.witness.mechanism, [1.57, 1.571])
        assert certify_in_space(alone, *given).verdict is JAMMED
        assert found.witness.sentence in found.reason and "exact closure" in found.reason


def least(mechanism, u, bearings, tilt):
    """State of one sharp member at an input."""
    model = in_space(problem(mechanism, bearings, tilt))
    q = start(model, mechanism, simulate(mechanism, [u]).poses[0])
    q[model.size] = u
    return prove_pose(model, q).state


@pytest.mark.parametrize(("alpha", "verdict"), [(0.0113, FREE), pytest.param(0.0126, JAMMED, marks=pytest.mark.slow)])
def test_random_members_are_as_the_box_is(alpha, verdict):
    motion, tilt, parts = simulate(four_bar(), [1.5, 1.52]), Misalignment(0, 1, alpha), lengths(0.01)
    assert certify_in_space(motion, Bearing(), tilt, tolerances=parts).verdict is verdict
    box, rng = parameter_box(motion.mechanism, parts), np.random.default_rng(7)
    for _ in range(6):
        p = np.where(rng.random(4) < 0.5, rng.choice([-1.0, 1.0], 4), rng.uniform(-1.0, 1.0, 4)) * box.high
        state = least(box.member(motion.mechanism, p), rng.uniform(1.5, 1.52), Bearing(), tilt)
        assert state == (1 if verdict is FREE else -1)


@pytest.mark.parametrize(("slide", "room"), [(0.0, 0.03), (0.0, -1e-9), (0.02, 0.06), (0.02, -0.06)])
def test_links_as_bodies_are_proved_free_up_to_the_worst_member_and_no_further(slide, room):
    """One bearing with crank and coupler within 3 % at one input; a slide there takes off its part of the height."""
    alpha, part, u = 0.05, 0.03, 1.2
    height = (1.0 + part) * math.sin(alpha) * math.sin(u) - slide
    limit = JointLimits(math.asin(height / (2.5 * (1.0 - part))) * (1.0 + room), slide)
    parts = [LengthTolerance(1, (0, 2), part), LengthTolerance(2, (1, 3), 2.5 * part)]
    motion = simulate(four_bar(), [u, u + 0.1])
    given = problem(motion.mechanism, one_bearing(limit), Misalignment(0, 1, alpha))
    members = Members(given, motion, parameter_box(motion.mechanism, parts))
    poses = members.poses(points(np.array([u])), members.box.whole.reshape(1, -1))
    q = some_closures(members.floats, poses.q).q[0]
    assert closes_apart(members.model, q, rates(members.floats, q), poses.given[0]) == (room > 0.0)


def test_no_tolerance_is_the_sharp_mechanism():
    motion, tilt = simulate(four_bar(), [1.4, 1.6]), Misalignment(0, 1, 0.0115)
    sharp = certify_in_space(motion, Bearing(), tilt)
    for none in (0.0, [], [LengthTolerance(1, (0, 2), 0.0)], 1e-12):
        found = certify_in_space(motion, Bearing(), tilt, tolerances=none)
        assert found.verdict is sharp.verdict is FREE and found.decided == 1.0
        assert found.low.tolist() == sharp.low.tolist()


@pytest.mark.slow
def test_tiny_tilts_are_as_small_tilts_say():
    motion = simulate(four_bar(), [1.3, 1.32])
    parts = [*lengths(1e-3), EndFloat((1, 2), 0.001, 0.002), FitClearance((2, 3), "35 H7/f7", 10.0)]
    ends = small_scale(motion, JointLimits(0.0015), Misalignment(0, 1, 1e-3), tolerances=parts, relative_gap=1e-2)
    for factor, verdict in ((0.97 * ends.low, FREE), (0.97 * ends.high, SOME), (1.03 * ends.high, JAMMED)):
        given = motion, JointLimits(0.0015), Misalignment(0, 1, 1e-3 * factor)
        found = certify_in_space(*given, tolerances=parts)
        assert found.verdict is verdict
        if verdict is SOME:
            assert {"tilt of joint 2-3", "axial clearance of joint 1-2"} == set(dict(found.witness.chosen_limits))


@pytest.mark.slow
def test_what_no_proof_reaches_is_undecided_with_a_reason():
    motion, tilt = simulate(four_bar(), [1.5, 1.52]), Misalignment(0, 1, 0.006)
    wide = certify_in_space(motion, Bearing(), tilt, tolerances=lengths(0.2), max_pieces=12)
    assert wide.verdict is Verdict.UNDECIDED and "limit of work" in wide.reason and wide.decided < 1.0
    crank = [LengthTolerance(1, (0, 2), 0.9)]  # crank and frame of 1.9 and 2 reach past coupler and rocker nowhere
    lost = certify_in_space(simulate(four_bar(2, 1, 1.6, 1.6), [3.0, 3.02]), Bearing(), tilt, tolerances=crank,
                            max_pieces=12)  # fmt: skip
    assert lost.verdict is Verdict.UNDECIDED and "cannot be assembled" in lost.reason


def test_the_origin_of_a_frame_does_not_matter():
    mechanism, tilt = four_bar(), Misalignment(0, 1, 0.0115)
    shift = (3.0, -7.0)
    moved = [replace(j, **{side: (x + shift[0], y + shift[1]) for side, link in (("at_a", j.a), ("at_b", j.b))
                           if link == 2 for x, y in [getattr(j, side)]}) for j in mechanism.joints]  # fmt: skip
    other = Mechanism(mechanism.graph, moved, mechanism.drivers)
    parts = [*lengths(0.005), HolePosition(2, 3, 0.005)]
    motions = [simulate(own, [1.5, 1.52]) for own in (mechanism, other)]
    found = [certify_in_space(motion, Bearing(), tilt, tolerances=parts) for motion in motions]
    assert found[0].verdict is found[1].verdict is FREE and found[0].evaluated == found[1].evaluated


@pytest.mark.slow
@pytest.mark.parametrize("links", [4, 6])
def test_random_mechanisms_with_random_tolerances_never_contradict_their_members(links):
    rng = np.random.default_rng(links)
    decided = 0
    for _ in range(8):
        mechanism, motion, tilt, limits, factor = case(rng, links, 0.05)
        part, scale = 10.0 ** rng.uniform(-4, -2), factor * rng.choice([0.7, 0.95, 1.0, 1.05, 1.4])
        given = joint_limits(limits, scale, tilt)
        parts = [HolePosition(link, to, part) for joint in mechanism.joints
                 for link, to in ((joint.a, joint.b), (joint.b, joint.a)) if link != mechanism.frame]  # fmt: skip
        motion = simulate(mechanism, motion.inputs[0] + np.array([0.0, 1e-3]), start=motion.poses[0])
        found = certify_in_space(motion, given, tilt, tolerances=parts, seconds=10.0, resolution=0.5)
        decided += found.verdict is not Verdict.UNDECIDED
        if found.verdict not in (FREE, JAMMED):
            continue
        box = parameter_box(mechanism, parts)
        for _ in range(3):
            p = box.furthest(rng.normal(size=box.size))
            own = box.member(mechanism, p)
            model = in_space(problem(own, given, tilt))
            pose = simulate(own, motion.inputs[:1], start=motion.poses[0]).poses[0]
            assert prove_pose(model, start(model, own, pose)).state != (-1 if found.verdict is FREE else 1)
    assert decided >= 4
