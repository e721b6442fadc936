"""Tolerances of parts: places as functions of parameters, independence of the frame, and verdicts against members."""

import itertools
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from graphsynth import (
    Driver,
    Mechanism,
    MechanismGraph,
    Prismatic,
    Revolute,
    assess_jamming,
    enumerate_chains,
    simulate,
)
from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Interval
from graphsynth.jamming import Bearing, Fit
from graphsynth.jamming.assembly.positions import Positions
from graphsynth.jamming.assembly.tubes import prove_tubes, slopes
from graphsynth.jamming.joints import (
    JointLimits,
    Misalignment,
    assess_coupled,
    bearing_limits,
    certify_coupled,
    largest_scale,
)
from graphsynth.jamming.joints.closure import joint_places
from graphsynth.jamming.joints.drawing import drawn, fit_limits
from graphsynth.kinematics.dimensional import embody
from graphsynth.tolerances import (
    AxisAngle,
    EndFloat,
    FitClearance,
    HolePosition,
    LengthTolerance,
    Parallelism,
    ThermalExpansion,
    parameter_box,
)
from graphsynth.tolerances.box import relative_box

LIMITS, TILT = JointLimits(0.006), Misalignment(0, 1, 1e-3)
TURN = np.linspace(0.0, 2.0 * math.pi, 73)
LAMBDA = Mechanism.four_bar(2, 1, 2.5, 2.5)


def lengths(relative):
    """All four lengths of the lambda linkage, each plus and minus a share of itself."""
    ends = {0: ((1, 3), 2.0), 1: ((0, 2), 1.0), 2: ((1, 3), 2.5), 3: ((0, 2), 2.5)}
    return [LengthTolerance(link, pair, relative * own) for link, (pair, own) in ends.items()]


def shifted(mechanism, offsets, turn=0.0):
    """Return the same mechanism with other frames of its links: moved, and the frame link's also turned."""
    joints = []
    for joint in mechanism.joints:
        moved = {}
        for link, name in ((joint.a, "at_a"), (joint.b, "at_b")):
            spin = turn if link == mechanism.frame else 0.0
            z = complex(*getattr(joint, name)) * np.exp(1j * spin) + offsets[link]
            moved[name] = (z.real, z.imag)
        joints.append(replace(joint, **moved))
    return Mechanism(mechanism.graph, joints, mechanism.drivers)


def slider_crank():
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [Revolute(0, 1), Revolute(1, 2, (1, 0)), Revolute(2, 3, (3, 0)), Prismatic(0, 3, (0, 0.3))]
    return Mechanism(graph, joints, [Driver(0, 1)])


def rocker_slider():
    """A four-bar whose rocker pushes a slider: a dyad, then unknowns."""
    graph = MechanismGraph(6, [(0, 1), (1, 2), (2, 3), (0, 3), (3, 4), (4, 5), (0, 5)], frame=0)
    joints = [
        *(Revolute(j.a, j.b, j.at_a, j.at_b) for j in LAMBDA.joints), Revolute(3, 4, (1.0, 0.7)),
        Revolute(4, 5, (3.0, 0.0)), Prismatic(0, 5, (0.0, -0.5)),
    ]  # fmt: skip
    return Mechanism(graph, joints, [Driver(0, 1)])


def test_places_are_what_the_drawing_says():
    """A ternary link with a chain of lengths, a hole in a circle and a temperature, against complex numbers."""
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    at = {0: 0.2 + 0.1j, 2: 1.0 + 0.5j}
    joints = [
        Revolute(0, 1, (0.0, 0.0), (at[0].real, at[0].imag)), Revolute(1, 2, (at[2].real, at[2].imag)),
        Revolute(2, 3, (2.5, 0.0), (2.5, 0.0)), Revolute(0, 3, (2.0, 0.0)),
    ]  # fmt: skip
    mechanism = Mechanism(graph, joints, [Driver(0, 1)])
    given = [
        LengthTolerance(1, (0, 2), 0.02, 0.01), HolePosition(1, 2, 0.004), HolePosition(0, 3, 0.01),
        ThermalExpansion(-20.0, 60.0, {0: 1e-5, 1: 2e-5}),
    ]  # fmt: skip
    box = parameter_box(mechanism, given)
    assert box.names == (
        "length 0-2 of link 1", "x of the hole 1-2 of link 1", "y of the hole 1-2 of link 1",
        "x of the hole 0-3 of link 0", "y of the hole 0-3 of link 0", "temperature",
    )  # fmt: skip
    np.testing.assert_array_equal(box.low, [-0.01, -0.002, -0.002, -0.005, -0.005, -20.0])
    np.testing.assert_array_equal(box.high, [0.02, 0.002, 0.002, 0.005, 0.005, 60.0])
    assert box.discs == ((1, 2), (3, 4))
    values = np.array([0.015, -0.001, 0.0005, 0.002, -0.003, 40.0])
    member = box.member(mechanism, values)
    along = (at[2] - at[0]) / abs(at[2] - at[0])
    expected = at[0] + (at[2] - at[0] + 0.015 * along + (-0.001 + 0.0005j)) * (1.0 + 40.0 * 2e-5)
    assert complex(*member.joint(1, 2).at_a) == pytest.approx(expected, abs=1e-15)
    assert complex(*member.joint(0, 1).at_b) == at[0]  # the datum
    assert complex(*member.joint(0, 3).at_a) == pytest.approx((2.002 - 0.003j) * (1.0 + 40.0 * 1e-5), abs=1e-15)
    assert member.joint(2, 3) == mechanism.joint(2, 3)  # no tolerance, no coefficient


def test_boxes_are_narrowed_to_their_part_of_a_disc():
    """Every point of a box and the disc stays inside; a box without a common point is found; against sampled points."""
    box = parameter_box(LAMBDA, [LengthTolerance(1, (0, 2), 0.1), HolePosition(2, 3, 2.0)])
    rng = np.random.default_rng(4)
    ends = np.sort(rng.uniform(box.low, box.high, (400, 3)) + rng.uniform(-0.3, 0.3, (2, 400, 3)), axis=0)
    ends = np.clip(ends, box.low, box.high)
    ends[:, 0] = (0.0, 0.6, 0.8), (0.1, 1.0, 1.0)  # touches the rim in one point, in decimals
    whole = Interval.from_bounds(*ends)
    narrow, held = box.in_discs(whole)
    assert 0.02 < (~held).mean() < 0.5
    assert (narrow.lo >= whole.lo)[held].all() and (narrow.hi <= whole.hi)[held].all()
    nearest = np.clip(0.0, ends[0], ends[1])[:, 1:]
    apart = np.hypot(*nearest.T)
    assert held[apart < 1.0 - 1e-12].all() and not held[apart > 1.0 + 1e-12].any()
    for _ in range(200):
        p = rng.uniform(*ends)
        inside = np.hypot(p[:, 1], p[:, 2]) <= 1.0
        assert ((narrow.lo <= p) & (p <= narrow.hi)).all(axis=1)[inside].all()
        assert [box.holds(one) for one in p[:20]] == inside[:20].tolist()
    assert (narrow.hi - narrow.lo < whole.hi - whole.lo)[held].any()
    assert box.holds(np.array([0.1, 0.0, 1.0])) and not box.holds(np.array([0.11, 0.0, 0.0]))
    assert not box.holds(np.array([0.0, 2.0**-40, 1.0]))  # exact: in doubles the sum of squares is 1


def test_lengths_of_a_link_are_chained_from_their_datum():
    six = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (1, 3)], frame=0)
    joints = [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (1.0, 0.0)), Revolute(1, 3, (1.0, 2.0))]
    joints[2] = Revolute(2, 3, (1.0, 0.0), (1.0, 0.0))
    mechanism = Mechanism(six, joints)
    box = parameter_box(mechanism, [LengthTolerance(1, (2, 3), 0.1), LengthTolerance(1, (0, 2), 0.2)])
    member = box.member(mechanism, np.array([0.05, -0.1]))
    assert member.joint(1, 2).at_a == pytest.approx((0.9, 0.0))
    assert member.joint(1, 3).at_a == pytest.approx((0.9, 2.05))  # moves with its datum


@pytest.mark.long
@pytest.mark.parametrize(
    ("make", "closed"),
    [(lambda: LAMBDA, 0), (lambda: LAMBDA, 1), (slider_crank, 1), (rocker_slider, 1)],
    ids=["lambda", "dyad", "slider", "rocker"],
)
def test_tubes_hold_the_motion_of_every_member(make, closed):
    """Wide boxes of lengths, a hole and a temperature: random members and inputs lie inside, and their rates too."""
    mechanism = make()
    rng = np.random.default_rng(3)
    given = [
        LengthTolerance(1, (0, 2), 0.02), LengthTolerance(2, (1, 3), 0.03, 0.01), HolePosition(0, 3, 0.02),
        ThermalExpansion(-50.0, 100.0, {0: 1e-5, 1: 1e-4, 2: 2e-5}),
    ]  # fmt: skip
    box = parameter_box(mechanism, given)
    edges = np.linspace(0.3, 2.8, 41)
    u = Interval.from_bounds(edges[:-1], edges[1:])
    motion, joints = simulate(mechanism, u.mid), tuple(range(len(mechanism.joints)))
    system = Positions(mechanism, box, motion.poses[0] if closed else None)
    assert len(system.dyads) == (closed and make is not slider_crank)
    assert (system.size == 0) == (closed and len(mechanism.joints) == 4 and make is not slider_crank)
    counted = system.count(motion.poses)
    x = system.coordinates(motion.poses, motion.velocities)[0]
    tubes = prove_tubes(system, joints, u, x, counted)
    assert tubes.proved.all()
    (r_rate, *_), fine = slopes(system, joints, u, tubes, counted)
    assert fine.all() and r_rate.shape == (1 + box.size, 40, len(joints), 2)
    step = 1e-6
    for _ in range(6):
        p = rng.uniform(box.low, box.high)
        inputs = edges[:-1] + rng.uniform(0, 1, 40) * np.diff(edges)
        places = {}
        for k in (-1, *range(box.size)):
            values = p.copy()
            values[k] = p[k] if k < 0 else p[k] + (step if p[k] < 0.0 else -step) * (box.high[k] - box.low[k])
            member = box.member(mechanism, values if k >= 0 else p)
            found = simulate(member, inputs, start=motion.poses[0], events=False)
            places[k] = joint_places(member, joints, found.poses)[0], values[k] - p[k]
        r = places[-1][0]
        # every link is counted from its datum; the frame's is the origin here
        assert ((r >= tubes.r.lo - 1e-12) & (r <= tubes.r.hi + 1e-12)).all()
        for k in range(box.size):
            slope = (places[k][0] - r) / places[k][1]
            near = 1e-6 + 1e-4 * abs(slope)
            assert ((slope >= r_rate.lo[1 + k] - near) & (slope <= r_rate.hi[1 + k] + near)).all(), box.names[k]


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_the_origin_of_a_frame_changes_nothing(seed):
    """The same parts, drawn from other origins, have the same verdict and the same bounds, up to rounding."""
    rng = np.random.default_rng(seed)
    given = [*lengths(0.004), HolePosition(2, 3, 0.004), ThermalExpansion(-30.0, 30.0, 1.2e-5)]
    offsets = rng.uniform(-50.0, 50.0, 4) + 1j * rng.uniform(-50.0, 50.0, 4)
    offsets[0] = rng.uniform(-5.0, 5.0) + 1j * rng.uniform(-5.0, 5.0)
    found = []
    for mechanism in (LAMBDA, shifted(LAMBDA, offsets)):
        motion = simulate(mechanism, TURN)
        found.append(certify_coupled(motion, LIMITS, replace(TILT, alpha=0.0117, alpha_range=None), tolerances=given))
    here, there = found
    assert here.verdict is there.verdict and here.verdict.name == "CERTIFIED_FREE"
    assert here.evaluated == there.evaluated
    np.testing.assert_allclose(here.upper, there.upper, rtol=1e-8)
    np.testing.assert_allclose(here.lower, there.lower, rtol=1e-8, atol=1e-12)


def worst_scale(mechanism, box, limits=LIMITS, tilt=TILT, count=181):
    """Smallest allowed scale over all corners of a box, at dense samples (estimated)."""
    inputs, found = np.linspace(0.0, 2.0 * math.pi, count), math.inf
    for corner in itertools.product(*zip(box.low, box.high)):
        motion = simulate(box.member(mechanism, np.array(corner)), inputs, events=False)
        found = min(found, assess_coupled(motion, limits, tilt).smallest_scale)
    return found


@pytest.mark.slow
def test_every_length_of_the_lambda_linkage_within_one_percent():
    """Free at 95 % of what the worst member allows; at 105 % some member binds, and it is named."""
    scale = worst_scale(LAMBDA, parameter_box(LAMBDA, lengths(0.01)))
    motion = simulate(LAMBDA, TURN)
    free = certify_coupled(
        motion, LIMITS, replace(TILT, alpha=0.95e-3 * scale, alpha_range=None), tolerances=lengths(0.01)
    )
    assert free.verdict.name == "CERTIFIED_FREE" and free.one_branch and free.decided == 1.0
    same = certify_coupled(motion, LIMITS, replace(TILT, alpha=0.95e-3 * scale, alpha_range=None), tolerances=0.01)
    assert same.verdict.name == "CERTIFIED_FREE"
    tilt = replace(TILT, alpha=1.05e-3 * scale, alpha_range=None)
    binds = certify_coupled(motion, LIMITS, tilt, tolerances=lengths(0.01), resolution=1e-2, max_pieces=3000)
    assert binds.verdict.is_jammed and not binds.verdict.is_free


def turning(rng, width):
    """A random four-bar whose driven link turns fully for every member, with its lengths and a tilt."""
    while True:
        sizes = rng.uniform(0.2, 1.0, 4)
        short, *middle, long = np.sort(sizes)
        if sizes.argmin() in (0, 1) and (1.0 + width) * (short + long) < (1.0 - width) * sum(middle):
            break
    ends = {0: (1, 3), 1: (0, 2), 2: (1, 3), 3: (0, 2)}
    given = [LengthTolerance(link, ends[link], width * sizes[link]) for link in range(4)]
    return Mechanism.four_bar(*sizes), given, Misalignment(0, 1, 1e-3, rng.uniform(0.0, 6.28))


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 10))])
def test_three_percent_on_every_length_is_decided(seed):
    """Free at 80 % of what the worst of all corners allows, up to members that are nearly stretched."""
    mechanism, given, tilt = turning(np.random.default_rng([15, seed]), 0.03)
    scale = worst_scale(mechanism, parameter_box(mechanism, given), tilt=tilt, count=61)
    tilt = replace(tilt, alpha=0.8e-3 * scale, alpha_range=None)
    found = certify_coupled(simulate(mechanism, TURN), LIMITS, tilt, tolerances=given, seconds=600.0)
    assert found.verdict.name == "CERTIFIED_FREE" and found.one_branch and found.decided == 1.0


def test_a_dyad_that_some_member_cannot_close_is_not_proved():
    """Crank and frame in line: coupler and rocker reach for the nominal mechanism, not for the shortest of both."""
    mechanism = Mechanism.four_bar(2, 1, 1.6, 1.45)
    motion = simulate(mechanism, [3.1, 3.2])
    u = Interval.from_bounds(np.array([3.1]), np.array([3.2]))
    for plus, proved in ((0.01, True), (0.04, False)):
        box = parameter_box(mechanism, [LengthTolerance(2, (1, 3), plus), LengthTolerance(3, (0, 2), plus)])
        system = Positions(mechanism, box, motion.poses[0])
        x, counted = np.zeros((1, 0)), system.count(motion.poses[:1])
        tubes = prove_tubes(system, (0, 1, 2, 3), u, x, counted)
        assert tubes.proved[0] == proved and (float(tubes.dyads.lo[0, 0, 0]) > 0.0) == proved
        for a, b in itertools.product((-plus, plus), repeat=2):  # room of the triangle with sides 3, 1.6 + a, 1.45 + b
            share = 0.5 + ((1.6 + a) ** 2 - (1.45 + b) ** 2) / 18.0
            assert tubes.dyads[0, 0, 0].contains((1.6 + a) ** 2 / 9.0 - share**2)


@pytest.mark.long
@pytest.mark.parametrize(("sizes", "signs"), [((2, 1, 1.6, 1.45), (1, 1, -1, -1)), ((2, 1, 2.5, 1.55), (-1, 1, 1, -1))])
def test_a_member_that_does_not_turn_fully_is_named(sizes, signs):
    """Near the verge: stretched, coupler and rocker do not reach; folded, the coupler is too long."""
    ends = {0: (1, 3), 1: (0, 2), 2: (1, 3), 3: (0, 2)}
    given = [LengthTolerance(link, ends[link], 0.04 * sizes[link]) for link in range(4)]
    motion = simulate(Mechanism.four_bar(*sizes), TURN)
    found = certify_coupled(motion, LIMITS, TILT, tolerances=given, max_pieces=1500)
    assert found.verdict.name == "UNDECIDED" and found.decided > 0.5
    told = re.search(r"the member \((.*)\) cannot be assembled at the input ([^,]+), proved", found.reason)
    values = [float(own.split()[-1]) for own in told[1].split(", ")]
    assert np.sign(values).tolist() == list(signs)
    a, b, c, d = np.add(sizes, values)
    reach = math.sqrt(a * a + b * b - 2.0 * a * b * math.cos(float(told[2])))
    assert not abs(c - d) < reach < c + d
    plain = certify_coupled(motion, LIMITS, TILT, tolerances=[LengthTolerance(1, (0, 2), 0.001)], max_pieces=128)
    assert "cannot be assembled" not in plain.reason


@pytest.mark.long
def test_a_tolerance_of_nothing_changes_nothing():
    """A parameter without width is no reason not to cut the input."""
    given, motion = [LengthTolerance(1, (0, 2), 0.0), HolePosition(2, 3, 0.0)], simulate(LAMBDA, TURN)
    tilt = Misalignment(0, 1, 0.01199)
    bare, same = (certify_coupled(motion, LIMITS, tilt, tolerances=own) for own in ([], given))
    assert bare.verdict.name == same.verdict.name == "CERTIFIED_FREE"
    assert same.evaluated > 128 and same.decided == 1.0


@pytest.mark.long
def test_tubes_of_chained_dyads_hold_every_member():
    """The second dyad stands on the first: joints of random members lie inside, and the boxes are no idle ones."""
    mechanism = embody(next(iter(enumerate_chains(6))), seed=0).mechanism
    box, rng = relative_box(mechanism, 0.02), np.random.default_rng(8)
    edges = np.linspace(0.0, 2.0 * math.pi, 129)
    motion = simulate(mechanism, edges[:-1])
    system, joints = Positions(mechanism, box, motion.poses[0]), tuple(range(7))
    assert len(system.dyads) == 2 and system.size == 0
    u = Interval.from_bounds(edges[:-1], edges[1:])
    tubes = prove_tubes(system, joints, u, np.zeros((128, 0)), system.count(motion.poses))
    assert tubes.proved.all()
    low, high = np.full((128, 7, 2), np.inf), np.full((128, 7, 2), -np.inf)
    for k in range(60):
        p = rng.uniform(box.low, box.high) if k % 2 else rng.choice([-1.0, 1.0], box.size) * box.high
        inputs = edges[:-1] + rng.uniform(0.0, 1.0, 128) * np.diff(edges)
        member = box.member(mechanism, p)
        found = simulate(member, inputs, start=motion.poses[0], events=False)
        r = joint_places(member, joints, found.poses)[0]
        assert found.assembled.all() and ((tubes.r.lo <= r) & (r <= tubes.r.hi)).all()
        low, high = np.minimum(low, r), np.maximum(high, r)
    assert np.median((tubes.r.hi - tubes.r.lo)[:, [2, 4, 5, 6]] / (high - low)[:, [2, 4, 5, 6]]) < 6.0


@pytest.mark.parametrize(
    "name, width, alpha",
    [
        pytest.param("six_bar", 0.03, 0.00595, marks=pytest.mark.long),
        # its first dyad comes nearer to a dead centre, the second one stands on it
        pytest.param("flat_six_bar", 0.03, 0.00656, marks=pytest.mark.long),
    ],
)
def test_chained_dyads_are_decided_for_wide_boxes(name, width, alpha):
    """Six-bars of two dyads with 14 and 15 toleranced coordinates, at half their limit."""
    # kept as files, for a search finds others where roundings differ
    mechanism = Mechanism.from_json((Path(__file__).parent / f"{name}.json").read_text(encoding="utf-8"))
    (driver,), motion = mechanism.drivers, simulate(mechanism, TURN)
    tilt = Misalignment(driver.base, driver.link, alpha)
    assert 2.0 < assess_coupled(motion, LIMITS, tilt).smallest_scale < 2.01
    found = certify_coupled(motion, LIMITS, tilt, tolerances=width, seconds=600.0)
    assert found.verdict.name == "CERTIFIED_FREE" and found.one_branch and found.decided == 1.0


@pytest.mark.slow
def test_a_member_that_binds_is_named_and_binds():
    """Between the nominal mechanism and the worst member: the witness is inside its box, and binds at its input."""
    mechanism, tilt = Mechanism.four_bar(2, 0.7, 1.6, 1.9), TILT
    given = [LengthTolerance(1, (0, 2), 0.02), LengthTolerance(3, (0, 2), 0.05), HolePosition(2, 3, 0.03)]
    box = parameter_box(mechanism, given)
    motion = simulate(mechanism, TURN)
    nominal = assess_coupled(motion, LIMITS, tilt).smallest_scale
    worst = worst_scale(mechanism, box)
    assert worst < 0.995 * nominal
    alpha = 1e-3 * (0.4 * worst + 0.6 * nominal)
    found = certify_coupled(
        motion, LIMITS, Misalignment(0, 1, alpha), tolerances=given, resolution=1e-2, max_pieces=2500
    )
    assert found.verdict.name == "CERTIFIED_JAMMED_FOR_SOME", found.reason
    assert "of all inputs and dimensions together" in found.reason and 0.0 < found.decided < 1.0
    member, at = found.witness.mechanism, found.witness.input
    crank = math.dist(member.joint(0, 1).at_b, member.joint(1, 2).at_a)
    assert abs(crank - 0.7) <= 0.02
    hole = np.subtract(member.joint(2, 3).at_a, mechanism.joint(2, 3).at_a)
    assert math.hypot(*hole) <= 0.015 * (1 + 1e-9)
    reached = simulate(member, np.sort([0.0, at]), start=motion.poses[0], events=False)
    factor = assess_coupled(reached, LIMITS, Misalignment(0, 1, alpha)).factor
    assert factor.max() >= found.witness.factor * (1.0 - 1e-9) > 1.0


@pytest.mark.slow
def test_a_named_member_has_its_hole_inside_the_circle():
    """Of a square round the circle the corners bind by far: pieces there are proved to bind, but hold no member."""
    mechanism, radius = Mechanism.four_bar(2, 0.7, 1.6, 1.9), 0.45
    given, motion = [HolePosition(1, 2, 2.0 * radius)], simulate(mechanism, np.linspace(0.4, 0.45, 3))
    tilt = Misalignment(0, 1, 0.011616, alpha_range=(0.0, 0.011616))
    found = certify_coupled(motion, LIMITS, tilt, tolerances=given, resolution=1e-2)
    assert found.verdict.name == "CERTIFIED_JAMMED_FOR_SOME" and (found.state == 0).all(), found.reason
    (joint,) = (own for own in found.witness.mechanism.joints if own.pair == (1, 2))
    x, y = np.subtract(joint.at_a, (0.7, 0.0))
    assert math.hypot(x, y) <= radius
    named = found.witness.summary()["deviations"]
    assert named == pytest.approx({"x of the hole 1-2 of link 1": x, "y of the hole 1-2 of link 1": y}, abs=1e-15)
    for name, value in named.items():
        assert f"{name} {value:+.12g}" in found.reason


@pytest.mark.long
def test_a_named_member_has_its_limits_and_angle():
    motion = simulate(LAMBDA, TURN)
    limits = JointLimits(0.006, tilt_range=(0.0055, 0.0065))
    tilt = Misalignment(0, 1, 0.0118, alpha_range=(0.0115, 0.0118))
    found = certify_coupled(motion, limits, tilt, tolerances=lengths(0.001), resolution=1e-2)
    assert found.verdict.name == "CERTIFIED_JAMMED_FOR_SOME", found.reason
    assert "alpha = 0.0118 at 0 rad, length 1-3 of link 0 " in found.reason
    assert "tilt of joint 1-2 = 0.0055" in found.reason and found.witness.limits[1].tilt == pytest.approx(
        0.0055, rel=1e-8
    )
    assert len(found.witness.deviations) == 4 and len(found.witness.chosen_limits) == 3  # the motor's joint is rigid


@pytest.mark.parametrize("seed", [pytest.param(k, marks=pytest.mark.slow) for k in range(4)])
def test_no_member_contradicts_a_proof(seed):
    """Random four-bars and wide boxes of lengths: random members, dense inputs, no contradiction in any piece."""
    rng = np.random.default_rng([11, seed])
    crank, rest = rng.uniform(0.2, 0.5), np.sort(rng.uniform(0.8, 1.2, 3))
    mechanism = Mechanism.four_bar(rest[2], crank, rest[0], rest[1])
    ends = {0: ((1, 3), rest[2]), 1: ((0, 2), crank), 2: ((1, 3), rest[0]), 3: ((0, 2), rest[1])}
    given = [LengthTolerance(link, pair, 0.015 * own) for link, (pair, own) in ends.items()]
    box, motion = parameter_box(mechanism, given), simulate(mechanism, TURN)
    scale = assess_coupled(motion, LIMITS, TILT).smallest_scale
    for use in (0.7, 0.95, 1.0, 1.1, 1.6):
        tilt = Misalignment(0, 1, 1e-3 * scale * use)
        found = certify_coupled(motion, LIMITS, tilt, tolerances=given, resolution=5e-3, max_pieces=2000, seconds=60.0)
        for _ in range(12):
            p = np.where(rng.random(4) < 0.5, rng.uniform(box.low, box.high), rng.choice([-1, 1], 4) * box.high)
            inputs = np.sort(rng.uniform(0.0, 2.0 * math.pi, 200))
            moved = simulate(box.member(mechanism, p), inputs, events=False)
            factor = assess_coupled(moved, LIMITS, tilt).factor
            place = np.searchsorted(found.low, inputs, side="right") - 1
            inside = moved.assembled & (inputs <= found.high[place])
            # the certificate is of exact tilts; its small-tilt bounds are those of these factors
            assert (factor[inside] <= found.upper[place][inside] * (1 + 1e-9)).all()
            assert (factor[inside] >= found.lower[place][inside] * (1 - 1e-9)).all()


@pytest.mark.long
def test_lengths_that_grow_together_are_one_parameter():
    """One material: a temperature scales the whole linkage, and no tilt is lost; two materials do lose some."""
    motion = simulate(LAMBDA, TURN)
    one = largest_scale(motion, LIMITS, TILT, tolerances=[ThermalExpansion(-100.0, 100.0, 2e-5)], relative_gap=1e-3)
    assert one.low <= 12.0 <= one.high <= 1.004 * one.low
    mechanism = Mechanism.four_bar(2, 0.7, 1.6, 1.9)
    motion = simulate(mechanism, TURN)
    found = {}
    for name, coefficients in {"none": 0.0, "same": 1e-4, "crank": {1: 1e-4}}.items():
        given = [ThermalExpansion(-100.0, 100.0, coefficients)]
        found[name] = largest_scale(motion, LIMITS, TILT, tolerances=given, relative_gap=1e-3).low
    assert found["same"] == pytest.approx(found["none"], rel=2e-3)
    assert found["crank"] < 0.999 * found["none"]


def test_a_fit_limits_the_tilt_for_every_pair_of_parts():
    limits = fit_limits(FitClearance((1, 2), "35 H7/g6", 10.0, 0.1))
    fit = Fit.read("35 H7/g6")
    rng = np.random.default_rng(2)
    for _ in range(200):
        hole = rng.uniform(*(float(fit.nominal + own) for own in (fit.hole.lower, fit.hole.upper))) / 2
        pin = rng.uniform(*(float(fit.nominal + own) for own in (fit.shaft.lower, fit.shaft.upper))) / 2
        angle = Bearing(pin, rng.uniform(9.9, 10.1), hole - pin).critical_tilt("A").angle
        assert limits.tilt_range[0] <= angle <= limits.tilt_range[1]
    # both ends are those of pairs that exist
    (r, c), (wide, loose) = (map(float, fit.pair(own)) for own in (False, True))
    ends = Bearing(r, 10.1, c).critical_tilt("A").angle, Bearing(wide, 9.9, loose).critical_tilt("A").angle
    assert limits.tilt_range == pytest.approx(ends, rel=1e-12)


def test_a_pin_in_a_hole_has_no_less_than_both_contacts_allow():
    """Condition "general" with a range of radii: the least of the larger of both tilts, by dense sampling."""
    bearing = Bearing(17.5, 10.0, 0.03, 10.002)
    own = bearing_limits(bearing, "general", radius_tolerance=2.0, clearance_tolerance=0.005)
    radii = np.linspace(15.5, 19.5, 4001)
    larger = [max(Bearing(r, 10.0, 0.025, 10.002).critical_tilt(kind).angle for kind in "AB") for r in radii]
    assert own.tilt_range[0] == pytest.approx(min(larger), rel=1e-6) and own.tilt_range[0] <= min(larger)


@pytest.mark.long
def test_fits_stand_for_the_limits_of_their_joints():
    fits = [FitClearance(pair, "35 H8/e8", 10.0) for pair in ((1, 2), (2, 3), (0, 3))]
    motion = simulate(LAMBDA, TURN)
    report = assess_jamming(motion, tilt=0.004, tolerances=[*fits, *lengths(0.002)])
    assert report.verdict.name == "CERTIFIED_FREE"
    tight = fits[0].fit.replace("e8", "g7")
    binding = assess_jamming(motion, tilt=0.02, tolerances=[FitClearance(own.joint, tight, 10.0) for own in fits])
    assert binding.verdict.name == "CERTIFIED_JAMMED"


def test_end_floats_and_axes_are_limits_and_misalignments():
    play = drawn(LAMBDA, LIMITS, TILT, [EndFloat((1, 2), 0.1, 0.3)]).bearings[(1, 2)]
    assert (play.tilt, play.axial_clearance_range) == (0.006, (0.05, 0.15))
    plain = drawn(LAMBDA, LIMITS, TILT, [AxisAngle(2, 3, 0.001), Parallelism(1, 2, 0.02, 10.0)])
    _, seat, pin = plain.tilts
    assert (seat.base, seat.link, seat.rigid, seat.alpha_range) == (2, 3, False, (0.0, 0.001))
    assert 0.002 > pin.alpha_range[1] == pytest.approx(math.atan(0.002), rel=1e-14) and pin.alpha_range[1] >= math.atan(
        0.002
    )


@pytest.mark.slow
def test_axes_that_may_lean_take_their_share():
    motion = simulate(LAMBDA, TURN)
    straight, leaning = (
        certify_coupled(motion, LIMITS, Misalignment(0, 1, 0.0112), tolerances=own, max_pieces=1500).verdict.name
        for own in ([], [AxisAngle(2, 3, 0.0003)])
    )
    assert (straight, leaning) == ("CERTIFIED_FREE", "CERTIFIED_FREE")
    wide = certify_coupled(
        motion, LIMITS, Misalignment(0, 1, 0.0112), tolerances=[AxisAngle(2, 3, 0.01)], max_pieces=1500
    )
    assert not wide.verdict.is_free


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([LengthTolerance(1, (0, 3), 0.1)], "links 1 and 3 have no joint"),
        ([LengthTolerance(1, (0, 2), 0.1), LengthTolerance(1, (0, 2), 0.1)], "two lengths to its joint with link 2"),
        ([LengthTolerance(1, (0, 2), 0.1), LengthTolerance(1, (2, 0), 0.1)], "form a ring"),
        ([LengthTolerance(1, (0, 2), 0.1, 1.0)], "leaves no length"),
        ([ThermalExpansion(-1, 1, 1e-5), ThermalExpansion(-1, 1, 1e-5)], "two temperature ranges"),
        ([FitClearance((1, 2), "35 H7/g6", 10.0)] * 2, "two tolerances of one kind"),
        ([AxisAngle(0, 1, 0.001)], "two misalignments"),
        ([3.0], "is no tolerance of a part"),
        ("text", "tolerances = 'text'"),
        (None, "tolerances"),
        (0.5, "0 to 0.5"),
    ],
)
def test_drawings_that_do_not_fit_are_refused(given, message):
    with pytest.raises(GeometryError, match=message):
        certify_coupled(simulate(LAMBDA, TURN[:9]), LIMITS, TILT, tolerances=given)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: LengthTolerance(1, (0, 0), 0.1), "names one link twice"),
        (lambda: LengthTolerance(1, 0, 0.1), "no pair of links"),
        (lambda: LengthTolerance(1, (0, 2), -0.1), "plus"),
        (lambda: HolePosition(1, 2, math.nan), "diameter"),
        (lambda: ThermalExpansion(5.0, 9.0, 1e-5), "do not hold 0"),
        (lambda: FitClearance((1, 2), "35 H7/k6", 10.0), "tightest pair interferes"),
        (lambda: FitClearance((1, 2), "H7/g6", 10.0), "no nominal size"),
        (lambda: EndFloat((1, 2), 0.3, 0.1), "exchange them"),
        (lambda: Parallelism(1, 2, 0.01, 0.0), "length"),
        (lambda: drawn(LAMBDA, None, TILT, 0.01), "no limits"),
        (
            lambda: drawn(LAMBDA, {(0, 3): LIMITS}, TILT, [EndFloat((1, 2), 0.1, 0.3)]),
            "has an end float, but no limits",
        ),
    ],
)
def test_tolerances_that_make_no_sense_are_refused(call, message):
    with pytest.raises(GeometryError, match=message):
        call()
