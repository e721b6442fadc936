"""Axes that may lean in any direction, every loop closed in space: closed forms of one bearing, random members."""

import math
from dataclasses import replace

import numpy as np
import pytest
from coupled_oracles import four_bar
from space_oracles import case, joint_limits, moved, product, rotation
from test_turn import one_bearing

from graphsynth import Driver, Mechanism, MechanismGraph, Prismatic, Revolute, simulate
from graphsynth.intervals.balls import exact
from graphsynth.intervals.proving import points
from graphsynth.jamming import Bearing, Verdict
from graphsynth.jamming.joints import (
    RIGID,
    SPHERICAL,
    JointLimits,
    Misalignment,
    SlideLimits,
    assess_coupled,
    certify_coupled,
    largest_scale as small_scale,
)
from graphsynth.jamming.joints.drawing import drawn
from graphsynth.jamming.joints.program import problem
from graphsynth.jamming.joints.search import sharp_problem
from graphsynth.jamming.space import certify_in_space, largest_scale, prove_pose
from graphsynth.jamming.space.binding import at, coordinates
from graphsynth.jamming.space.bodies import Bodies
from graphsynth.jamming.space.closure import Closure
from graphsynth.jamming.space.members import Members
from graphsynth.jamming.space.optimum import least_scale
from graphsynth.jamming.space.plane import in_space, largest_turn, start
from graphsynth.tolerances import AxisAngle, LengthTolerance, Parallelism

FREE, JAMMED, SOME = Verdict.CERTIFIED_FREE, Verdict.CERTIFIED_JAMMED, Verdict.CERTIFIED_JAMMED_FOR_SOME
SLOW = pytest.mark.slow
ALPHA, ANGLE = 0.05, 0.005
#: Tilt that the bearing at B takes when the crank is across: its coupler is 2.5 times as long as the crank.
TILT = math.asin(math.sin(ALPHA) / 2.5)


def members(parts, limits, tilt, u=1.3):
    """All members of some tolerances of the lambda linkage."""
    motion = simulate(four_bar(), [u, u + 0.1])
    bearings, axes, box = drawn(motion.mechanism, limits, tilt, parts)
    return Members(problem(motion.mechanism, bearings, axes), motion, box)


@pytest.mark.long
@pytest.mark.parametrize(("axis", "limit", "verdict"),
                         [((2, 3), 1.005 * (TILT + ANGLE), FREE), ((2, 3), 0.995 * (TILT + ANGLE), SOME),
                          ((3, 2), 1.02 * (TILT + ANGLE), FREE),
                          pytest.param((3, 2), 0.995 * (TILT + ANGLE), SOME, marks=SLOW),
                          ((2, 3), 0.97 * (TILT - ANGLE), JAMMED)])  # fmt: skip
def test_an_axis_that_may_lean_adds_its_angle_to_the_tilt_of_one_bearing(axis, limit, verdict):
    """The coupler is free to turn about AB, so that only the lean along it counts: added, or taken off for the best."""
    motion, given = simulate(four_bar(), [1.57, 1.571]), one_bearing(JointLimits(limit))
    found = certify_in_space(motion, given, Misalignment(0, 1, ALPHA), tolerances=[AxisAngle(*axis, ANGLE)])
    assert found.verdict is verdict
    if verdict is SOME:
        motor, own = found.witness.misalignments
        assert motor.alpha == ALPHA and (own.base, own.link) == axis and 0.99 * ANGLE < own.alpha <= ANGLE
        assert (
            f"alpha = {own.alpha:.9g} at {own.direction:.9g} rad" in found.reason and "turn about" not in found.reason
        )
        assert certify_in_space(motion, given, found.witness.misalignments).verdict is JAMMED
        turned = replace(own, direction=own.direction + math.pi, direction_range=None)
        assert certify_in_space(motion, given, (motor, turned)).verdict is FREE


@pytest.mark.long
@pytest.mark.parametrize(("factor", "verdict"), [(1.01, FREE), pytest.param(0.99, SOME, marks=SLOW)])
def test_a_motor_axis_that_may_lean_is_as_bad_as_its_worst_direction(factor, verdict):
    """Parallelism: within a cylinder; the worst direction is across the crank, which stands at 1.2 rad."""
    axis, motion = Parallelism(0, 1, 0.4, 20.0), simulate(four_bar(), [1.2, 1.201])
    limit = math.asin(math.sin(axis.angle) / 2.5) * factor
    found = certify_in_space(motion, one_bearing(JointLimits(limit)), [], tolerances=[axis])
    assert found.verdict is verdict
    if verdict is SOME:  # about an axis along the frame at the crank's own angle less a right one, or opposite
        own = found.witness.misalignments[0]
        assert math.cos(2.0 * (own.direction - found.witness.input + 0.5 * math.pi)) > 0.999


def test_two_turns_lead_the_axis_anywhere_within_its_angle():
    """Every lean within the angle is one of turns within the disc, which is hardly larger; a member is told by it."""
    rng = np.random.default_rng(3)
    for angle in (1e-7, 1e-3, 0.1, 0.5):
        tilt = Misalignment(2, 3, 0.0, rigid=False, alpha_range=(0.0, angle), direction_range=(0.0, math.tau))
        radius = largest_turn(tilt)
        assert angle < radius < angle * (1.0 + angle**2 / 22.0 + 1e-11)
        for lean, way in zip(angle * np.append(1.0, rng.random(20)), [math.pi / 4, *rng.uniform(0.0, 6.28, 20)]):
            z = np.array(rotation([lean * math.cos(way), lean * math.sin(way), 0.0]).tolist(), dtype=float)[:, 2]
            a, b = math.atan2(-z[1], z[2]), math.asin(z[0])
            assert math.hypot(a, b) <= radius
    own = members([AxisAngle(2, 3, 0.2)], JointLimits(0.1), Misalignment(0, 1, 0.01))
    q = np.zeros(own.model.width)
    for p in rng.uniform(-0.13, 0.13, (5, 2)):
        q[-2:] = p
        sharp = own.axes(p)[1]
        lean = np.array(rotation([sharp.alpha * math.cos(sharp.direction), sharp.alpha * math.sin(sharp.direction),
                                  0.0]).tolist(), dtype=float)  # fmt: skip
        two = product(*(moved(own.model, k, q.tolist()) for k in (4, 5)))
        mount = np.array(two[0].tolist(), dtype=float)
        assert mount[:, 2] == pytest.approx(lean[:, 2], abs=1e-14)
        spin = lean.T @ mount  # of the seat about its axis, which a given turn makes up for
        most = 2.0 * math.tan(0.5 * largest_turn(own.given.misalignments[1])) ** 2
        assert abs(math.atan2(spin[1, 0], spin[0, 0])) <= most


def test_the_turn_of_a_driven_joint_is_enclosed_with_the_spin_of_its_seat():
    own = members([AxisAngle(0, 1, 0.3)], JointLimits(0.1), [])
    radius, poses = own.box.high[0], own.poses(points(np.array([1.3])), own.box.whole.reshape(1, -1))
    a, b = radius * math.cos(0.25 * math.pi), radius * math.sin(0.25 * math.pi)
    spin = 2.0 * math.atan(math.tan(0.5 * a) * math.tan(0.5 * b))
    assert spin <= poses.given[0, 0] < 3.0 * spin
    none = members([], JointLimits(0.1), Misalignment(0, 1, 0.3))
    assert none.poses(points(np.array([1.3])), none.box.whole.reshape(1, -1)).given[0, 0] < 1e-15


def test_loops_and_bodies_close_alike_with_leaning_axes():
    """Derivatives by the turns are differences; a closure of the loops is one of links as bodies and a sharp member."""
    parts = [AxisAngle(2, 3, 0.03), AxisAngle(0, 3, 0.02), LengthTolerance(1, (0, 2), 0.03)]
    own = members(parts, JointLimits(0.02, 0.01), Misalignment(0, 1, 0.05, 0.4))
    model, closure = own.model, own.floats
    p = np.array([0.02, 0.01, -0.02, 0.012, 0.01])
    q = own.poses(points(np.array([1.3])), points(p[None])).q[0]
    found = least_scale(closure, q)
    assert found.missed < 1e-11
    bodies = Bodies(model, q)
    assert np.abs(at(bodies, exact(coordinates(bodies, found.q)[None])).V.mid).max() < 1e-11
    sharp = in_space(sharp_problem(own.mechanism(p), own.given.limits, own.axes(p)))
    pose = simulate(own.mechanism(p), [1.3]).poses[0]
    assert least_scale(Closure(sharp, False), start(sharp, own.mechanism(p), pose)).scale == pytest.approx(
        found.scale, rel=1e-9
    )
    for k in range(model.size, model.width):
        unit = np.zeros(model.width)
        unit[k] = 1e-5
        up, down = (closure.values(closure.loops((found.q + side * unit)[None]))[0] for side in (1.0, -1.0))
        assert closure.jacobian(closure.loops(found.q[None]))[0][:, k] == pytest.approx((up - down) / 2e-5, abs=1e-8)
        u = coordinates(bodies, found.q)
        step = np.zeros(bodies.width)
        step[bodies.size + k - model.size] = 1e-5
        ends = [at(bodies, exact((u + side * step)[None])).V.mid[0] for side in (1.0, -1.0)]
        slope = at(bodies, exact(u[None])).J.mid[0, :, bodies.size + k - model.size]
        assert slope == pytest.approx((ends[0] - ends[1]) / 2e-5, abs=1e-8)


@pytest.mark.long
@pytest.mark.parametrize(("alpha", "verdict"), [(0.0105, FREE), pytest.param(0.0137, JAMMED, marks=SLOW)])
def test_random_members_are_as_the_box_is(alpha, verdict):
    parts, tilt = [AxisAngle(2, 3, 5e-4), AxisAngle(0, 3, 5e-4)], Misalignment(0, 1, alpha)
    motion = simulate(four_bar(), [1.5, 1.51])
    assert certify_in_space(motion, Bearing(), tilt, tolerances=parts).verdict is verdict
    own, rng = members(parts, Bearing(), tilt, 1.5), np.random.default_rng(7)
    for _ in range(6):
        tilts = [tilt] + [Misalignment(*ends, 5e-4 * math.sqrt(rng.random()), rng.uniform(0.0, 6.28), rigid=False)
                          for ends in ((2, 3), (0, 3))]  # fmt: skip
        u = rng.uniform(1.5, 1.51)
        model = in_space(sharp_problem(motion.mechanism, own.given.limits, tuple(tilts)))
        q = start(model, motion.mechanism, simulate(motion.mechanism, [u]).poses[0])
        q[model.size] = u
        assert prove_pose(model, q).state == (1 if verdict is FREE else -1)


def test_no_angle_is_the_sharp_mechanism():
    motion, tilt = simulate(four_bar(), [1.4, 1.6]), Misalignment(0, 1, 0.0115)
    sharp = certify_in_space(motion, Bearing(), tilt)
    for angle in (0.0, 1e-12):
        found = certify_in_space(motion, Bearing(), tilt, tolerances=[AxisAngle(2, 3, angle), AxisAngle(0, 3, angle)])
        assert found.verdict is sharp.verdict is FREE and found.low.tolist() == sharp.low.tolist()


@pytest.mark.slow
def test_tiny_angles_are_as_small_tilts_say():
    motion, limits, parts = simulate(four_bar(), [1.3, 1.31]), one_bearing(JointLimits(0.0015)), [AxisAngle(2, 3, 2e-4)]
    ends = small_scale(motion, limits, Misalignment(0, 1, 1e-3), tolerances=parts, relative_gap=1e-2)
    for factor, verdict in ((0.99 * ends.low, FREE), (1.01 * ends.low, SOME)):
        tilt, own = Misalignment(0, 1, 1e-3 * factor), [AxisAngle(2, 3, 2e-4 * factor)]
        assert certify_in_space(motion, limits, tilt, tolerances=own).verdict is verdict
        assert certify_coupled(motion, limits, tilt, tolerances=own).verdict is verdict


@pytest.mark.slow
def test_the_scale_is_that_of_the_worst_direction():
    """A factor f on both angles binds first where asin(sin(f alpha) / 2.5) + f angle is the limit."""
    from scipy.optimize import brentq

    motion, parts = simulate(four_bar(), [1.57, 1.571]), [AxisAngle(2, 3, 0.004)]
    found = largest_scale(motion, one_bearing(JointLimits(0.05)), Misalignment(0, 1, ALPHA), tolerances=parts,
                          relative_gap=1e-2)  # fmt: skip
    worst = brentq(lambda f: math.asin(math.sin(f * ALPHA) / 2.5) + f * 0.004 - 0.05, 0.1, 9.0)
    best = brentq(lambda f: math.asin(math.sin(f * ALPHA) / 2.5) - f * 0.004 - 0.05, 0.1, 9.0)
    assert 0.97 * worst < found.low < worst and best < found.high < 1.1 * best


@SLOW
@pytest.mark.parametrize("links", [4, 6])
def test_random_mechanisms_with_leaning_axes_never_contradict_their_members(links):
    rng, decided = np.random.default_rng(links), 0
    for _ in range(8):
        mechanism, motion, tilt, limits, factor = case(rng, links, 0.05)
        given = joint_limits(limits, factor * rng.choice([0.6, 0.9, 1.1, 1.5]), tilt)
        free = [joint for joint in mechanism.joints if joint.pair != tilt.pair]
        ends = [own.pair[:: rng.choice([-1, 1])] for own in rng.choice(np.array(free, dtype=object), 2, replace=False)]
        angle = tilt.alpha * 10.0 ** rng.uniform(-2.5, -1.0)
        motion = simulate(mechanism, motion.inputs[0] + np.array([0.0, 1e-3]), start=motion.poses[0])
        parts = [AxisAngle(int(a), int(b), angle) for a, b in ends]
        found = certify_in_space(motion, given, tilt, tolerances=parts, seconds=15.0, resolution=0.5)
        decided += found.verdict is not Verdict.UNDECIDED
        if found.verdict not in (FREE, JAMMED):
            continue
        sharp = problem(mechanism, given, tilt).limits
        for _ in range(3):
            axes = [Misalignment(own.link, own.to, angle, rng.uniform(0.0, 6.28), rigid=False) for own in parts]
            model = in_space(sharp_problem(mechanism, sharp, (tilt, *axes)))
            state = prove_pose(model, start(model, mechanism, motion.poses[0])).state
            assert state != (-1 if found.verdict is FREE else 1)
    assert decided >= 5


def slider(angle):
    """Crank 1, coupler 3, a guide through the motor's axis in the direction ``angle``."""
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    guide = Prismatic(0, 3, angle_a=angle, angle_b=angle)
    return Mechanism(graph, [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (3.0, 0.0)), guide],
                     [Driver(0, 1)])  # fmt: skip


@pytest.mark.parametrize(("angle", "part", "verdict"), [(0.4, 1.01, FREE), pytest.param(0.0, 0.99, SOME, marks=SLOW)])
def test_a_rail_that_leans_lifts_its_slider(angle, part, verdict):
    """At the distance s by s times the sine of the lean; the coupler is free at the slider and tilts in the crank."""
    lean, u = 0.02, np.array([0.5, 0.501])
    along = math.cos(lean) * np.cos(u - angle)
    height = math.sin(lean) * (along + np.sqrt(along**2 + 8.0)).max()
    limits = {(0, 1): RIGID, (1, 2): JointLimits(part * math.asin(height / 3.0)), (2, 3): SPHERICAL,
              (0, 3): SlideLimits(0.0, 0.0)}  # fmt: skip
    found = certify_in_space(simulate(slider(angle), u), limits, [], tolerances=[AxisAngle(0, 3, lean)])
    assert found.verdict is verdict
    if verdict is SOME:  # it leans across its direction
        own = found.witness.misalignments[0]
        assert own.alpha == pytest.approx(lean) and abs(math.cos(own.direction - angle)) < 1e-3


def test_a_guide_leans_by_the_least_rotation_and_its_direction_does_not_turn():
    """Three turns within their box are any lean of the seat; small tilts say the same where the slider leans."""
    rng, angle = np.random.default_rng(5), 0.2
    motion = simulate(slider(0.4), [0.7, 0.71])
    limits, axes, box = drawn(motion.mechanism, JointLimits(0.1), Misalignment(0, 1, 0.01), [AxisAngle(3, 0, angle)])
    own = Members(problem(motion.mechanism, limits, axes), motion, box)
    assert own.box.size == 3 and own.box.discs == ((0, 1),)
    q = np.zeros(own.model.width)
    for way in rng.uniform(0.0, math.tau, 6):
        least = np.array(rotation([angle * math.cos(way), angle * math.sin(way), 0.0]).tolist(), dtype=float)
        a, b = math.atan2(-least[1, 2], least[2, 2]), math.asin(least[0, 2])
        p = np.array([a, b, -2.0 * math.atan(math.tan(0.5 * a) * math.tan(0.5 * b))])
        assert (np.abs(p) <= own.box.high).all() and own.box.holds(p)
        q[-3:] = p
        mount = np.eye(3)
        for k in (4, 5, 6):
            mount = mount @ np.array(moved(own.model, k, q.tolist())[0].tolist(), dtype=float)
        assert mount == pytest.approx(least, abs=1e-14)
    for way in (0.3, 1.7):
        tilt = Misalignment(3, 0, 1e-4, way, rigid=False)
        limits = {j.pair: SlideLimits(0.01, 0.03) if j.kind == "P" else JointLimits(0.02, 0.01)
                  for j in motion.mechanism.joints}  # fmt: skip
        small = assess_coupled(motion, limits, tilt).allowed_scale[0]
        model = in_space(problem(motion.mechanism, limits, tilt))
        exactly = least_scale(Closure(model, False), start(model, motion.mechanism, motion.poses[0])).scale
        assert small * exactly == pytest.approx(1.0, abs=1e-6)


@SLOW
def test_random_members_of_a_leaning_guide_are_as_the_box_is():
    motion, rng = simulate(slider(0.3), [0.8, 0.81]), np.random.default_rng(9)
    tilt, part = Misalignment(0, 1, 0.01, 0.5), AxisAngle(0, 3, 2e-3)
    decided = set()
    for limit in (0.0016, 0.002, 0.004, 0.006, 0.01):
        limits = {(1, 2): JointLimits(limit), (2, 3): JointLimits(limit), (0, 3): SlideLimits(limit, limit, 0.002)}
        found = certify_in_space(motion, limits, tilt, tolerances=[part], seconds=30.0)
        decided.add(found.verdict)
        if found.verdict not in (FREE, JAMMED):
            continue
        sharp = problem(motion.mechanism, limits, tilt).limits
        for _ in range(6):
            lean, way = part.angle * math.sqrt(rng.random()), rng.uniform(0.0, 6.28)
            model = in_space(sharp_problem(motion.mechanism, sharp, (tilt, Misalignment(0, 3, lean, way, rigid=False))))
            state = prove_pose(model, start(model, motion.mechanism, motion.poses[0])).state
            assert state != (-1 if found.verdict is FREE else 1)
    assert {FREE, JAMMED} <= decided
