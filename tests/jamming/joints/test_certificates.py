"""Proofs: never false, whatever they start from; decided where they should be."""

import math
from fractions import Fraction
from time import perf_counter

import numpy as np
import pytest
from coupled_oracles import driven_pair, embodied, factor_bounds, four_bar, single_loop

from graphsynth import Driver, Gear, Mechanism, MechanismGraph, PinSlot, Prismatic, Revolute, simulate
from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Interval
from graphsynth.jamming import Bearing
from graphsynth.jamming.assembly import positions
from graphsynth.jamming.assembly.positions import Positions
from graphsynth.jamming.assembly.tubes import prove_tubes, slopes
from graphsynth.jamming.joints import (
    RIGID,
    SPHERICAL,
    JointLimits,
    Misalignment,
    SlideLimits,
    assess_coupled,
    bearing_limits,
    certify_coupled,
    largest_scale,
)
from graphsynth.jamming.joints.branch import of_the_motion
from graphsynth.jamming.joints.closure import joint_places, leans
from graphsynth.jamming.joints.enclosure import Pieces
from graphsynth.jamming.joints.pieces import FEWEST, PARTS, Work
from graphsynth.jamming.joints.program import problem
from graphsynth.mechanism.laws import Harmonic, Table

T_A = 0.006064396559156420060266102798724801172486
TURN = np.linspace(0.0, 2.0 * math.pi, 25)


def at_points(given, poses):
    """Pieces without width at float positions."""
    at = joint_places(given.mechanism, given.layout.joints, poses)
    return Pieces(*(Interval.from_bounds(v, v) for v in (at.r, at.e, *leans(given.layout, at))))


def varied_limits(mechanism, rng):
    t, s = rng.uniform(0.3, 2.0, 8), rng.uniform(0.0, 0.3, 8)
    kinds = [
        lambda: JointLimits(rng.choice(t)), lambda: JointLimits(rng.choice(t), rng.choice(s)), lambda: SPHERICAL,
        lambda: JointLimits(rng.choice(t), math.inf), lambda: RIGID,
    ]  # fmt: skip
    chosen = rng.choice(5, size=len(mechanism.joints), p=[0.4, 0.3, 0.1, 0.1, 0.1])
    return {joint.pair: kinds[k]() for joint, k in zip(mechanism.joints, chosen)}


@pytest.mark.long
def test_pose_certificates_meet_on_random_linkages():
    """At float positions the two proved bounds hold the value and meet to 1e-11, over 2000 random loops."""
    rng = np.random.default_rng(4)
    mechanism = four_bar()
    motion = simulate(mechanism, np.linspace(0.0, 6.2, 20))
    poses = np.repeat(motion.poses, 10, axis=0)
    poses[..., :2] += rng.normal(0.0, 0.3, poses[..., :2].shape)  # the closure holds for any places of the joints
    poses[:, 0] = 0.0
    undecided = 0
    for _ in range(10):
        tilts = (Misalignment(0, 1, 0.1, rng.uniform(0, 6)), Misalignment(0, 3, 0.05, rng.uniform(0, 6), rigid=False))
        given = problem(mechanism, varied_limits(mechanism, rng), tilts)
        found = given.solve(poses, "scale")
        lower, upper = factor_bounds(given.layout, at_points(given, poses), found)
        assert (lower <= found.upper * (1 + 1e-10)).all() and (upper >= found.lower * (1 - 1e-10)).all()
        assert (lower <= upper).all()
        met = (upper - lower <= 1e-11 * upper + 1e-15) | np.isinf(lower)
        undecided += int((~met & np.isfinite(found.upper)).sum())
    assert undecided <= 40  # 2 %


@pytest.mark.long
def test_roll_and_pitch_of_slanted_guides():
    """Guides in any direction: the bounds meet at the value, so neither component has another sign or direction."""
    rng = np.random.default_rng(1)
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    met = 0
    for _ in range(40):
        guide = Prismatic(0, 3, (0.0, 0.2), (0.0, 0.0), rng.uniform(-1.2, 1.2), 0.0)
        joints = [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (3.0, 0.0)), guide]
        mechanism = Mechanism(graph, joints, [Driver(0, 1)])
        poses = simulate(mechanism, [rng.uniform(0.2, 2.5)])
        if not poses.assembled.all():
            continue
        pins = {pair: JointLimits(0.004) for pair in ((1, 2), (2, 3))}
        tilt = Misalignment(0, 1, rng.uniform(0.005, 0.05), rng.uniform(0.0, 6.3))
        roll = rng.uniform(0.01, 0.03)
        slide = SlideLimits(roll, roll * rng.uniform(0.1, 0.5)) if rng.random() < 0.7 else SlideLimits(roll / 5, roll)
        given = problem(mechanism, {**pins, (0, 3): slide}, tilt)
        found = given.solve(poses.poses, "scale")
        lower, upper = factor_bounds(given.layout, at_points(given, poses.poses), found)
        assert lower[0] <= found.upper[0] * (1 + 1e-12) and upper[0] >= found.lower[0] * (1 - 1e-12)
        assert upper[0] - lower[0] <= 1e-10 * upper[0]
        met += 1
    assert met >= 30


def exact_lower(given, poses, y, units):
    """Lower bound in rational arithmetic for wrenches y, without the square roots: squared sizes.

    See theory/joints-that-share-a-tilt 4.
    """
    layout = given.layout
    at = joint_places(given.mechanism, layout.joints, poses[None])
    r, d = at.r, leans(layout, at).d[0]
    wrench = layout.incidence.T @ y.reshape(-1, 3)
    work, cost = Fraction(0), 0.0
    for place in range(len(layout.joints)):
        x, z = ((Fraction(r[0, place, i]) - Fraction(units.centre[i])) / Fraction(units.length) for i in (0, 1))
        mx = Fraction(wrench[place, 0]) - Fraction(wrench[place, 2]) * z
        my = Fraction(wrench[place, 1]) + Fraction(wrench[place, 2]) * x
        work += mx * Fraction(d[place, 0]) + my * Fraction(d[place, 1])
        cost += layout.limit[place] * math.sqrt(float(mx * mx + my * my))
    return abs(float(work)) / cost


@pytest.mark.long
def test_any_wrenches_and_any_tilts_give_valid_bounds():
    """Adversary: the certificate starts from garbage, and must stay on the right side."""
    rng = np.random.default_rng(8)
    mechanism = embodied(8, 0)
    base, link = driven_pair(mechanism)
    given = problem(mechanism, JointLimits(0.01), Misalignment(base, link, 0.02, 0.3))
    motion = simulate(mechanism, np.linspace(0.0, 6.0, 40))
    found = given.solve(motion.poses, "scale")
    at = at_points(given, motion.poses)
    for size in (0.0, 1e-15, 1e-9, 1e-4, 1e-1, 1.0, 1e3):
        noisy = found._replace(
            y=found.y * (1 + size * rng.normal(size=found.y.shape)) + size * rng.normal(size=found.y.shape),
            tau=found.tau + size * rng.normal(size=found.tau.shape) * 0.01,
            zeta=found.zeta + size * rng.normal(size=found.zeta.shape),
        )
        lower, upper = factor_bounds(given.layout, at, noisy)
        assert (lower <= found.upper * (1 + 1e-14)).all()
        assert (upper >= found.lower * (1 - 1e-14)).all()
        exact = np.array([exact_lower(given, pose, y, found.units) for pose, y in zip(motion.poses, noisy.y)])
        assert (lower <= exact * (1 + 1e-13)).all() and (lower >= exact * (1 - 1e-9) - 1e-12).all()


@pytest.mark.parametrize("margin", [1e-9, 1e-6, 1e-3])
def test_margins_at_a_pose_are_decided(margin):
    """On both sides of the closed form alpha = t_A (l3 + l4) / B_y at f = 0 and 180 degrees."""
    mechanism = four_bar()
    for f, height in ((0.0, math.sqrt(6.0)), (math.pi, 2.0)):
        limit = T_A * 5.0 / height
        for side in (1, -1):
            alpha = limit * (1 + side * margin)
            given = problem(mechanism, Bearing(), Misalignment(0, 1, alpha))
            poses = simulate(mechanism, [f]).poses
            lower, upper = factor_bounds(given.layout, at_points(given, poses), given.solve(poses, "scale"))
            assert lower[0] > 1.0 if side > 0 else upper[0] < 1.0


@pytest.mark.long
def test_poses_of_another_branch_prove_nothing(monkeypatch):
    """A solver that slips to the other assembly, which jams, must not turn a free motion into a proved jam."""
    from graphsynth.jamming.joints import walked
    from graphsynth.kinematics import simulation

    monkeypatch.setattr(walked, "compiled", lambda: False)  # the walk asks no solver
    own, mirrored = (simulate(four_bar(), np.linspace(a, b, 9)) for a, b in ((4.2, 5.2), (-4.2, -5.2)))
    tilt = Misalignment(0, 1, 0.0145)
    assert certify_coupled(own, Bearing(), tilt).verdict.name == "CERTIFIED_FREE"
    right = simulation.simulate

    def slips(mechanism, inputs, **options):
        found = right(mechanism, inputs, **options)
        other = right(mechanism, -np.asarray(inputs), **{**options, "start": mirrored.poses[0]})
        beyond = np.asarray(inputs) > 4.6
        for name in ("poses", "velocities"):
            sign = np.array([1.0, -1.0, -1.0]) * (1.0 if name == "poses" else -1.0)
            turned = getattr(other, name) * sign  # reflected in the x axis: the other assembly at the same input
            getattr(found, name)[beyond] = turned[beyond]
        return found

    monkeypatch.setattr(simulation, "simulate", slips)
    # a dyad is placed on its side, whatever the solver does; without the closed form its poses count
    assert certify_coupled(own, Bearing(), tilt).verdict.name == "CERTIFIED_FREE"
    monkeypatch.setattr(positions, "find_dyads", lambda *_: [])
    found = certify_coupled(own, Bearing(), tilt)
    assert found.verdict.name == "UNDECIDED" and "branch" in found.reason and not found.one_branch
    assert not (found.state == -1).any() and (found.state[found.high < 4.59] == 1).all()
    scale = largest_scale(own, Bearing(), tilt)
    assert scale.low == 0.0 and scale.high > 1.2 and "branch" in scale.reason


def test_a_box_around_the_float_alone_is_not_that_of_the_motion(monkeypatch):
    """The sample lies in every box below, but the assembly proved next to it only in the first."""
    motion = simulate(four_bar(), np.linspace(4.2, 5.2, 9))
    given = problem(four_bar(), Bearing(), Misalignment(0, 1, 0.01))
    work = Work(given, motion, 0.0)
    pieces = work.evaluate(np.array([4.2]), np.array([4.25]))
    assert work.system.size == 0 and of_the_motion(work, pieces) == (np.array([True]), True)
    other = work.system.dyads[0]._replace(side=-work.system.dyads[0].side)
    work.system.dyads = [other]
    assert not of_the_motion(work, work.evaluate(np.array([4.2]), np.array([4.25]))).own.any()
    monkeypatch.setattr(positions, "find_dyads", lambda *_: [])
    work = Work(given, motion, 0.0)
    pieces = work.evaluate(np.array([4.2]), np.array([4.25]))
    assert of_the_motion(work, pieces) == (np.array([True]), True)
    x = work.system.coordinates(motion.poses[:1], np.zeros_like(motion.poses[:1]))[0]
    assert not of_the_motion(work, pieces._replace(box_lo=x, box_hi=x)).own.any()
    assert not of_the_motion(work, pieces._replace(lo=pieces.lo + 0.01)).own.any()  # no sample within
    assert not of_the_motion(work, pieces._replace(proved=np.array([False]))).own.any()


@pytest.mark.long
def test_whole_turn_of_the_lambda_linkage():
    """Free up to 2 t_A, jammed above, undecided at it; within alpha squared of it by small tilts only.

    See theory/joints-that-share-a-tilt 6.
    """
    motion = simulate(four_bar(), TURN)
    for alpha, expected in [
        (2 * T_A * (1 - 1e-6), "CERTIFIED_FREE"), (2 * T_A * (1 + 1e-9), "CERTIFIED_JAMMED"),
        (2 * T_A, "UNDECIDED"), (1 / 30, "CERTIFIED_JAMMED"),
    ]:  # fmt: skip
        proof = certify_coupled(motion, Bearing(), Misalignment(0, 1, alpha))
        assert proof.small_tilts.name == expected, (alpha, proof.reason)
        assert proof.verdict.name == (expected if alpha == 1 / 30 else "UNDECIDED")
        assert proof.reason
        if proof.verdict is not proof.small_tilts:
            assert "small tilts (first order)" in proof.reason and proof.verdict.name == "UNDECIDED"
    assert proof.share(-1) == 1.0 and proof.one_branch  # alpha = 1/30 jams at every crank angle
    assert proof.arcs(-1) == [(0.0, 2.0 * math.pi)]
    assert len(proof.to_pandas()) == len(proof.low) and proof.summary()["verdict"] == "CERTIFIED_JAMMED"


@pytest.mark.long
def test_allowed_misalignment_from_both_sides():
    exact = 0.012128793118312840120532205597449602345
    begin = perf_counter()
    found = largest_scale(simulate(four_bar(), TURN), Bearing(), Misalignment(0, 1, 1 / 30), relative_gap=2e-4)
    assert 0.0 < found.seconds < perf_counter() - begin
    assert found.low / 30 < exact < found.high / 30 * (1 + 1e-15)
    assert 0.0 < found.relative_gap < 2e-4 and not found.reason
    one = largest_scale(simulate(four_bar(), TURN), SPHERICAL, Misalignment(0, 1, 0.1))
    assert one.low == math.inf  # nothing tilts against a limit


@pytest.mark.slow
@pytest.mark.parametrize(
    ("links", "number", "resolution"), [(6, 1, 1e-2), pytest.param(8, 3, 5e-4, marks=pytest.mark.slow)]
)
def test_pieces_against_dense_samples(links, number, resolution):
    """No sample of the input and of the tolerances contradicts a piece: 4000 samples each."""
    rng = np.random.default_rng(3)
    mechanism = embodied(links, number)
    base, link = driven_pair(mechanism)
    end = 2.0 * math.pi if links == 8 else 2.5
    motion = simulate(mechanism, np.linspace(0.0, end, 25))
    nominal = JointLimits(0.006, 0.001)
    alpha = 0.0106 * assess_coupled(motion, nominal, Misalignment(base, link, 0.01, 0.3)).smallest_scale
    around = (0.995 * alpha, 1.005 * alpha)
    tilts = [Misalignment(base, link, alpha, 0.3, alpha_range=around, direction_range=(0.295, 0.305))]
    limits = {j.pair: JointLimits(0.006, 0.001, (0.00595, 0.00603), (0.0009, 0.0011)) for j in mechanism.joints}
    proof = certify_coupled(motion, limits, tilts, seconds=60.0, resolution=resolution)
    assert proof.share(-1) > 0.02 and proof.share(1) > 0.1 and proof.one_branch
    inputs = np.sort(rng.uniform(0.0, end, 400 if links == 8 else 100))
    dense = simulate(mechanism, inputs, start=simulate(mechanism, [0.0]).poses[0])
    place = np.searchsorted(proof.high, inputs)
    for _ in range(10):
        own_alpha = float(rng.choice([*around, rng.uniform(*around)]))
        direction = float(rng.choice([0.295, 0.305, rng.uniform(0.295, 0.305)]))
        corner = [(float(rng.choice([0.00595, 0.00603])), float(rng.choice([0.0009, 0.0011]))) for _ in limits]
        own = {pair: JointLimits(*values) for pair, values in zip(limits, corner)}
        given = problem(mechanism, own, Misalignment(base, link, own_alpha, direction))
        value = given.solve(dense.poses, "scale").lower
        assert (value >= proof.lower[place] * (1 - 1e-12)).all()
        assert (value <= proof.upper[place] * (1 + 1e-12)).all()


@pytest.mark.slow
def test_tolerances_within_which_all_are_free_or_all_jam():
    motion = simulate(four_bar(), TURN)
    sharp = Misalignment(0, 1, 0.0120)
    assert certify_coupled(motion, Bearing(), sharp, tolerances=1e-4).verdict.name == "CERTIFIED_FREE"
    fit = bearing_limits(Bearing(), clearance_tolerance=0.003)
    free = certify_coupled(motion, fit, Misalignment(0, 1, 0.0108))
    assert free.verdict.name == "CERTIFIED_FREE" and free.witness is None
    assert certify_coupled(motion, fit, Misalignment(0, 1, 0.0134)).verdict.name == "CERTIFIED_JAMMED"


@pytest.mark.long
@pytest.mark.parametrize(
    ("fit", "alpha", "alpha_range", "tolerance"),
    [
        pytest.param(Bearing(), 0.0120, (0.0118, 0.0123), 0.0, marks=pytest.mark.slow),
        (Bearing(), 0.0120, (-0.0123, 0.0121), 0.0),
        (lambda: bearing_limits(Bearing(), clearance_tolerance=0.003), 0.0120, None, 0.0),
        (Bearing(), 2 * T_A * (1 - 2e-3), None, 5e-3),
    ],
    ids=["alpha", "sign", "fit", "lengths"],
)
def test_some_members_jam(fit, alpha, alpha_range, tolerance):
    """The witness is a member of the boxes, and jams by the search over points in many digits.

    See theory/joints-that-share-a-tilt 4.
    """
    tilt = Misalignment(0, 1, alpha, alpha_range=alpha_range)
    motion = simulate(four_bar(), TURN)
    fit = fit() if callable(fit) else fit
    found = certify_coupled(motion, fit, tilt, tolerances=tolerance, resolution=2e-2)
    assert found.verdict.name == "CERTIFIED_JAMMED_FOR_SOME" and found.certified, found.reason
    assert not (found.state == -1).any() and found.share(1) > 0.4
    one = found.witness
    (own,) = one.misalignments
    assert tilt.alpha_range[0] <= own.alpha <= tilt.alpha_range[1]
    for joint, plain in zip(one.mechanism.joints, four_bar().joints):
        for value, nominal in zip((*joint.at_a, *joint.at_b), (*plain.at_a, *plain.at_b)):
            assert abs(value - nominal) <= tolerance * abs(nominal)
    pose = simulate(one.mechanism, [one.input], start=motion.poses[np.argmin(abs(motion.inputs - one.input))])
    points = [pose.point(1, one.mechanism.joint(1, 2).at_a).position[0],
              pose.point(2, one.mechanism.joint(2, 3).at_a).position[0], one.mechanism.joint(0, 3).at_a]  # fmt: skip
    limits = [own.tilt for joint, own in zip(one.mechanism.joints, one.limits) if joint.pair != (0, 1)]
    lowest = fit.tilt_range[0] if isinstance(fit, JointLimits) else T_A
    assert all(lowest * (1.0 - 1e-14) <= own <= lowest * (1.0 + 2e-9) for own in limits)  # a pair that exists
    exact = float(single_loop(points, limits, own.vector, (0.0, 0.0), 0.0, digits=16))
    assert 1.0 < one.factor <= exact * (1 + 1e-12) and one.factor == pytest.approx(exact, rel=1e-6)
    assert found.summary()["witness"]["factor"] == one.factor and repr(one.input) in found.reason


@pytest.mark.long
def test_undecided_pieces_were_cut_at_least_once():
    """All over this range some members jam and some do not; a first piece alone would be given up too early."""
    fit, span = bearing_limits(Bearing(), clearance_tolerance=0.003), (1.2, 1.9)
    found = certify_coupled(simulate(four_bar(), np.linspace(*span, 5)), fit, Misalignment(0, 1, 0.0120))
    width = (found.high - found.low)[found.state == 0]
    assert width.size and width.max() < (span[1] - span[0]) / FEWEST / PARTS * (1 + 1e-9)


@pytest.mark.long
def test_what_no_member_decides():
    """At the limit itself a member touches: neither free nor a proved jam, whatever the tolerance below it."""
    motion = simulate(four_bar(), np.linspace(1.2, 1.9, 5))
    touching = Misalignment(0, 1, 0.0120, alpha_range=(0.0118, 2 * T_A * (1 - 1e-17)))
    proof = certify_coupled(motion, Bearing(), touching, resolution=1e-2)
    assert proof.verdict.name == "UNDECIDED" and "touch" in proof.reason and proof.witness is None


def test_change_points_and_folds_are_not_proved():
    """Two modes meet at f = 0 of (2, 1, 2, 3): the motion ends there, and what ends is not proved free."""
    motion = simulate(four_bar(2.0, 1.0, 2.0, 3.0), np.linspace(-0.5, 0.5, 21), start=None, modes={0: 1})
    proof = certify_coupled(motion, JointLimits(1.0), Misalignment(0, 1, 1e-6), max_pieces=3000)
    assert proof.verdict.name == "UNDECIDED" and "change point" in proof.reason
    fold = simulate(four_bar(2.0, 1.0, 1.0, 1.0), np.linspace(0.5, 2.0, 16))
    assert not fold.completed
    proof = certify_coupled(fold, JointLimits(1.0), Misalignment(0, 1, 1e-6), max_pieces=3000)
    assert proof.verdict.name == "UNDECIDED" and ("it ends" in proof.reason or "not proved" in proof.reason)


def test_report_with_proof(lambda_mechanism):
    motion = simulate(lambda_mechanism, TURN)
    report = assess_coupled(motion, Bearing(), Misalignment(0, 1, 0.0115), certify=True)
    assert report.verdict.name == "CERTIFIED_FREE" and report.certificate.certified
    assert report.summary()["certificate"]["free"] == [(0.0, 2.0 * math.pi)]


def geared():
    """Four-bar whose rocker turns a wheel on the frame, which drives nothing else."""
    graph = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (0, 3), (0, 4), (3, 4, 2)], frame=0)
    joints = [
        Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (2.5, 0.0), (2.5, 0.0)), Revolute(0, 3, (2.0, 0.0)),
        Revolute(0, 4, (5.0, 0.0)), Gear(3, 4, (0.0, 0.0), (0.0, 0.0), 1.0, 2.0),
    ]  # fmt: skip
    return Mechanism(graph, joints, [Driver(0, 1)])


def yoke():
    graph = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
    joints = [Revolute(0, 1), Prismatic(0, 2), PinSlot(2, 1, (0.0, 0.0), (1.0, 0.0), math.pi / 2)]
    return Mechanism(graph, joints, [Driver(0, 1)])


def swinging_block(law=None):
    """Slider on the crank's coupler (RPR), driven by a slide or a crank."""
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Prismatic(2, 3, angle_b=0.3), Revolute(0, 3, (2.5, 0.0))]
    return Mechanism(graph, joints, [Driver(0, 1, law) if law else Driver(0, 1)])


def slide_driven():
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [
        Prismatic(1, 0, angle_a=0.2, angle_b=0.2), Revolute(1, 2), Revolute(2, 3, (3.0, 0.0), (2.0, 0.0)),
        Revolute(0, 3, (0.5, 2.5)),
    ]  # fmt: skip
    return Mechanism(graph, joints, [Driver(0, 1)])


@pytest.mark.long
@pytest.mark.parametrize(
    ("make", "low", "high"),
    [
        (geared, 0.0, 6.0), (yoke, 0.2, 6.0), (swinging_block, 0.0, 6.0), (slide_driven, 0.1, 0.9),
        (lambda: swinging_block(Harmonic(0.3, 0.8, 2.0, 0.1)), 0.0, 3.0), (lambda: embodied(6, 1), 0.0, 6.0),
    ],
    ids=["gear", "slot", "block", "slide", "law", "six"],
)  # fmt: skip
def test_tubes_contain_perturbed_motions(make, low, high):
    """Every joint kind: dimensions anywhere in their tolerance, inputs anywhere in the piece, positions inside."""
    mechanism = make()
    rng = np.random.default_rng(1)
    edges = np.linspace(low, high, 121)
    middle = 0.5 * (edges[:-1] + edges[1:])
    motion = simulate(mechanism, middle)
    assert motion.completed
    joints = tuple(range(len(mechanism.joints)))
    tolerance = 1e-4
    system = Positions(mechanism, tolerance)
    x, _ = system.coordinates(motion.poses, motion.velocities)
    pieces = Interval.from_bounds(edges[:-1], edges[1:])
    tubes = prove_tubes(system, joints, pieces, x, system.count(motion.poses))
    assert tubes.proved.mean() > 0.95
    rates, fine = slopes(system, joints, pieces, tubes, system.count(motion.poses))
    assert (fine | ~tubes.proved).all()
    guided = [k for k in joints if not isinstance(mechanism.joints[k], Gear)]
    for _ in range(2):
        moved = []
        for joint in mechanism.joints:
            grow = 1.0 + tolerance * rng.uniform(-1, 1, 4) * (1 - 1e-12)
            at_a = (joint.at_a[0] * grow[0], joint.at_a[1] * grow[1])
            at_b = (joint.at_b[0] * grow[2], joint.at_b[1] * grow[3])
            moved.append(type(joint)(**{**joint.__dict__, "at_a": at_a, "at_b": at_b}))
        other = Mechanism(mechanism.graph, moved, mechanism.drivers)
        inputs = edges[:-1] + rng.uniform(0, 1, 120) * np.diff(edges)
        sample = simulate(other, np.concatenate([middle[:1] * 0 + min(middle[0], inputs[0]) - 1e-9, inputs]),
                          start=motion.poses[0])  # fmt: skip
        r, e, _, rail = joint_places(other, joints, sample.poses[1:])
        keep = tubes.proved & sample.assembled[1:]
        h = 1e-5
        near = [
            simulate(other, [u - h, u, u + h], start=pose, events=False) for u, pose in zip(inputs, sample.poses[1:])
        ]
        ends = [joint_places(other, joints, np.array([one.poses[k] for one in near])) for k in (0, 2)]
        for before, after, rate in zip(*ends, (own[0] for own in rates)):  # by the input
            slope, size = (after - before) / (2 * h), 1e-8 + 1e-3 * h
            assert ((slope >= rate.lo - size) & (slope <= rate.hi + size))[keep][:, guided].all()
        pad = 1e-12
        for value, tube in ((r, tubes.r), (e, tubes.e), (rail, tubes.rail)):
            inside = (value >= tube.lo - pad) & (value <= tube.hi + pad)
            assert inside[keep][:, guided].all()


def test_reasons_of_what_is_not_proved():
    tabled = swinging_block(Table((0.0, 3.0, 6.3), (0.0, 3.0, 6.3)))
    motion = simulate(tabled, np.linspace(0.1, 6.0, 9))
    limits = {(0, 1): RIGID, (1, 2): JointLimits(0.1), (2, 3): SlideLimits(0.1, 0.1), (0, 3): JointLimits(0.1)}
    proof = certify_coupled(motion, limits, Misalignment(0, 1, 0.01))
    assert proof.verdict.name == "UNDECIDED" and "Table" in proof.reason
    with pytest.raises(GeometryError, match="two or more"):
        certify_coupled(simulate(four_bar(), [0.0]), RIGID, Misalignment(0, 1, 0.01))
    with pytest.raises(GeometryError, match="tolerances"):
        certify_coupled(simulate(four_bar(), TURN), RIGID, Misalignment(0, 1, 0.01), tolerances=-1.0)
    cut = certify_coupled(simulate(four_bar(), TURN), Bearing(), Misalignment(0, 1, 0.012), max_pieces=50)
    assert cut.verdict.name == "UNDECIDED" and "limit of work" in cut.reason


@pytest.mark.parametrize(
    ("options", "text"),
    [({"seconds": math.nan}, "seconds = nan"), ({"max_pieces": -1}, "max_pieces"),
     ({"resolution": math.nan}, "resolution"), ({"tolerances": "x"}, "tolerances = 'x'"),
     ({"tolerances": 0.5}, "0 to 0.5")],
)  # fmt: skip
def test_limits_of_the_work_that_make_no_sense(options, text):
    motion = simulate(four_bar(), [0.0, 0.5])
    with pytest.raises(GeometryError, match=text):
        certify_coupled(motion, Bearing(), Misalignment(0, 1, 0.01), **options)


def test_no_work_proves_nothing_and_says_so():
    motion = simulate(four_bar(), [0.0, 0.5])
    found = certify_coupled(motion, Bearing(), Misalignment(0, 1, 0.01), seconds=0.0)
    assert found.verdict.name == "UNDECIDED" and "nothing is proved" in found.reason and "free" not in found.reason


@pytest.mark.slow
def test_members_of_many_boxes():
    """Slider-crank with boxes of everything: the verdict follows alpha, and every witness jams when solved alone."""
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (3.0, 0.0)), Prismatic(0, 3, (0.0, 0.2))]
    motion = simulate(Mechanism(graph, joints, [Driver(0, 1)]), np.linspace(0.0, 6.2, 13))
    pins = {
        (1, 2): JointLimits(0.01, 0.01, (0.009, 0.011)), (2, 3): JointLimits(0.01),
        (0, 3): SlideLimits(0.01, 0.01, 0.0, (0.008, 0.012)),
    }  # fmt: skip
    seen = []
    for alpha in (0.005, 0.0135, 0.016, 0.03):
        tilts = [
            Misalignment(0, 1, alpha, 0.8, direction_range=(0.7, 0.9)),
            Misalignment(0, 3, 0.001, rigid=False, alpha_range=(-0.002, 0.002)),
        ]
        found = certify_coupled(motion, pins, tilts, tolerances=1e-3, resolution=2e-2)
        seen.append(found.verdict.name)
        one = found.witness
        if one is None:
            continue
        member = {joint.pair: own for joint, own in zip(one.mechanism.joints, one.limits)}
        assert 0.008 <= member[0, 3].roll <= 0.008 * (1.0 + 2e-9) and member[0, 3].pitch == 0.01
        assert 0.009 <= member[1, 2].tilt <= 0.009 * (1.0 + 2e-9) and member[1, 2].axial_clearance == 0.01
        assert all(low.alpha_range[0] <= own.alpha <= low.alpha_range[1] for own, low in zip(one.misalignments, tilts))
        near = motion.poses[np.argmin(abs(motion.inputs - one.input))]
        limits = {pair: own for pair, own in member.items() if pair != (0, 1)}
        alone = assess_coupled(simulate(one.mechanism, [one.input], start=near), limits, one.misalignments)
        assert 1.0 < one.factor <= 1.0 / alone.allowed_scale[0] * (1 + 1e-12)
    assert seen == ["CERTIFIED_FREE", "CERTIFIED_JAMMED_FOR_SOME", "CERTIFIED_JAMMED_FOR_SOME", "CERTIFIED_JAMMED"]
