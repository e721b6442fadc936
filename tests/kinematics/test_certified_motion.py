"""Motions of the general engine: what is proved is true, and nothing false is proved."""

from __future__ import annotations

import math
from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.intervals.balls import Balls, exact
from graphsynth.kinematics import simulate
from graphsynth.kinematics.certify import certify, certify_four_bar
from graphsynth.kinematics.certify.equations import MechanismSystem
from graphsynth.kinematics.engine.result import Motion
from graphsynth.mechanism.constraints import jacobian, residual
from graphsynth.mechanism.joints import Cam, Gear, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Harmonic, Linear, Polynomial, Table
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

TURN = np.linspace(0.0, math.tau, 121)
CYCLE = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
WATT = MechanismGraph(6, [(0, 1), (1, 2), (2, 3), (0, 3), (3, 4), (4, 5), (0, 5)], frame=0)
TRIAD = MechanismGraph(6, [(0, 1), (1, 3), (2, 3), (2, 4), (0, 4), (2, 5), (0, 5)], frame=0)
FIVE = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4), (1, 4, 2)], frame=0)


def four_bar(frame: float, crank: float, coupler: float, rocker: float, law: object = None) -> Mechanism:
    joints = [
        Revolute(0, 1), Revolute(1, 2, (crank, 0.0)), Revolute(2, 3, (coupler, 0.0), (rocker, 0.0)),
        Revolute(0, 3, (frame, 0.0)),
    ]  # fmt: skip
    return Mechanism(CYCLE, joints, [Driver(0, 1, law or Linear())])  # type: ignore[arg-type]


def watt() -> Mechanism:
    joints = [
        Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (3.0, 0.0), (3.5, 0.0)), Revolute(0, 3, (4.0, 0.0)),
        Revolute(3, 4, (2.0, 1.0)), Revolute(4, 5, (4.0, 0.0), (3.0, 0.0)), Revolute(0, 5, (7.0, 0.5)),
    ]  # fmt: skip
    return Mechanism(WATT, joints, [Driver(0, 1)])


def triad(crank: float = 0.3) -> Mechanism:
    joints = [
        Revolute(0, 1), Revolute(1, 3, (crank, 0.0)), Revolute(2, 3, (-0.4, -0.25), (1.2, 0.0)),
        Revolute(2, 4, (0.45, -0.3), (1.1, 0.0)), Revolute(0, 4, (2.2, 0.1)),
        Revolute(2, 5, (0.05, 0.5), (1.3, 0.0)), Revolute(0, 5, (1.0, 2.2)),
    ]  # fmt: skip
    return Mechanism(TRIAD, joints, [Driver(0, 1)])


def cammed() -> Mechanism:
    """A cam with a given profile on the driver, its roller on a rocker."""
    cam = Cam(1, 2, (0.1, 0.0), (2.6, 0.0), 0.3, 1.2, ((0.25, 0.1), (0.05, -0.02)))
    graph = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
    pose = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (3.0, 0.0, 2.6))
    return Mechanism(graph, [Revolute(0, 1), Revolute(0, 2, (3.0, 0.0)), cam], [Driver(0, 1)], pose=pose)


def rocker_pin(lengths: tuple[float, float, float, float], u: float, side: int) -> mp.mpc:
    """Pin between coupler and rocker of a four-bar, 50 digits, exact floats."""
    frame, crank, coupler, rocker = (mp.mpf(v) for v in lengths)
    B = crank * mp.expj(mp.mpf(u))
    w = frame - B
    r = abs(w)
    along = (r**2 + coupler**2 - rocker**2) / (2 * r)
    return B + w / r * mp.mpc(along, side * mp.sqrt(coupler**2 - along**2))


# --- certified and true


def test_four_bar_poses_are_within_their_radii_of_the_exact_ones() -> None:
    lengths = (4.0, 1.0, 3.0, 3.5)
    motion = simulate(four_bar(*lengths), TURN, modes={0: 1})
    proof = certify(motion)
    assert proof.certified and proof.closed and proof.intervals.all()
    pin = motion.point(3, (3.5, 0.0)).position @ [1.0, 1.0j]
    with mp.workdps(50):
        sides = [
            min((1, -1), key=lambda s: abs(rocker_pin(lengths, u, s) - mp.mpmathify(z))) for u, z in zip(TURN, pin)
        ]
        assert len(set(sides)) == 1
        for k in range(0, 121, 7):
            exact_pin = rocker_pin(lengths, float(TURN[k]), sides[0])
            angle = mp.arg((exact_pin - 4) / mp.mpf(3.5))
            assert abs(mp.sin(angle - motion.poses[k, 3, 2])) <= proof.angle_radius[k]
            assert abs(exact_pin - rocker_pin(lengths, float(TURN[k]), -sides[0])) > proof.unique_within[k]
    assert proof.position_radius.max() < 1e-12 and proof.unique_within.min() > 1e-5


def test_six_bar_of_two_dyads_over_a_turn() -> None:
    proof = certify(simulate(watt(), np.linspace(0.0, math.tau, 361)))
    assert proof.certified and proof.closed and proof.position_radius.max() < 1e-11
    assert proof.seconds < 5.0


def test_class_three_group_over_a_turn() -> None:
    motion = simulate(triad(), TURN)
    proof = certify(motion)
    assert motion.completed and proof.certified and proof.closed


def test_few_samples_suffice() -> None:
    proof = certify(simulate(watt(), np.linspace(0.0, math.tau, 4)))
    assert proof.certified and proof.closed and proof.boxes > 30


@pytest.mark.parametrize(
    "law",
    [Linear(2.0, 0.3), Linear(-1.0), Harmonic(0.4, 0.9, 2.0, 0.1), Polynomial((0.2, 0.5, -0.1, 0.03))],
)
def test_motion_laws(law: object) -> None:
    motion = simulate(four_bar(4.0, 1.0, 3.0, 3.5, law), np.linspace(0.0, math.tau, 40))
    proof = certify(motion)
    assert proof.certified
    assert proof.closed == (not isinstance(law, Polynomial))


def test_a_table_is_known_at_its_points_only() -> None:
    law = Table((0.0, 1.0, 2.0, 3.0), (0.0, 0.5, 1.5, 2.0))
    motion = simulate(four_bar(4.0, 1.0, 3.0, 3.5, law), np.linspace(0.0, 3.0, 13))
    assert certify(motion, between=False).certified
    proof = certify(motion)
    assert not proof.certified and "law" in proof.reason and proof.poses.all()


def test_sliders_slots_and_gears() -> None:
    slider = [
        Revolute(0, 1),
        Revolute(1, 2, (0.3, 0.0)),
        Revolute(2, 3, (1.1, 0.0)),
        Prismatic(0, 3, (0.0, 0.1), angle_a=0.2),
    ]
    turning = simulate(Mechanism(CYCLE, slider, [Driver(0, 1)]), TURN)
    assert certify(turning).closed
    back = simulate(
        Mechanism(CYCLE, slider, [Driver(0, 3)], pose=tuple(map(tuple, turning.poses[10]))), [1.3, 1.2, 1.1, 1.0]
    )
    assert certify(back).certified
    swing = [Revolute(0, 1), Revolute(1, 2, (0.4, 0.0)), Prismatic(3, 2, angle_a=0.1), Revolute(0, 3, (1.0, 0.0))]
    assert certify(simulate(Mechanism(CYCLE, swing, [Driver(0, 1)]), TURN)).closed
    slot = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
    parts = [Revolute(0, 1), Revolute(0, 2, (1.0, 0.0)), PinSlot(2, 1, (0.0, 0.0), (0.4, 0.0), 0.3)]
    assert certify(simulate(Mechanism(slot, parts, [Driver(0, 1)]), TURN)).closed


def five_bar() -> Mechanism:
    joints = [
        Revolute(0, 1), Revolute(1, 2, (0.6, 0.0)), Revolute(2, 3, (2.4, 0.0), (2.2, 0.0)),
        Revolute(3, 4, at_b=(0.5, 0.0)), Revolute(0, 4, (3.0, 0.0)), Gear(1, 4, radius_a=2.0, radius_b=3.0),
    ]  # fmt: skip
    return Mechanism(FIVE, joints, [Driver(0, 1)])


def test_a_cam_with_a_profile_over_a_turn() -> None:
    """Its rocker is within the stated radius of the exact angle (50 digits, from the law of the radius itself)."""
    motion = simulate(cammed(), np.linspace(0.0, math.tau, 49))
    proof = certify(motion)
    assert proof.certified and proof.closed and not certify(simulate(cammed(), np.linspace(0.0, 3.0, 25))).closed
    with mp.workdps(50):
        for k in (0, 7, 20, 33, 48):
            u = mp.mpf(float(motion.inputs[k]))

            def excess(angle: mp.mpf, u: mp.mpf = u) -> mp.mpf:
                d = 3 + mp.mpf(2.6) * mp.expj(angle) - mp.mpf(0.1) * mp.expj(u)
                psi = mp.arg(d) - u - mp.mpf(0.3)
                waves = mp.mpf(0.25) * mp.cos(psi) + mp.mpf(0.1) * mp.sin(psi)
                return abs(d) - (mp.mpf(1.2) + waves + mp.mpf(0.05) * mp.cos(2 * psi) - mp.mpf(0.02) * mp.sin(2 * psi))

            sample = mp.mpf(float(motion.poses[k, 2, 2]))
            assert abs(mp.findroot(excess, sample) - sample) <= proof.angle_radius[k]


def test_a_geared_five_bar_closes_after_three_turns_and_not_before() -> None:
    once = certify(simulate(five_bar(), TURN, modes={1: 1}))
    assert once.certified and not once.closed
    assert certify(simulate(five_bar(), np.linspace(0.0, 3 * math.tau, 200), modes={1: 1})).closed


def test_planet_around_a_fixed_sun() -> None:
    graph = MechanismGraph(3, [(0, 1), (1, 2), (0, 2, 2)], frame=0)
    for ratio, turns, closes in ((1.0, 1, True), (1.5, 1, False), (1.5, 2, False), (1.5, 3, True)):
        parts = [Revolute(0, 1), Revolute(1, 2, (2.0 + ratio, 0.0)), Gear(0, 2, radius_a=2.0, radius_b=ratio)]
        proof = certify(simulate(Mechanism(graph, parts, [Driver(0, 1)]), np.linspace(0.0, turns * math.tau, 50)))
        assert proof.certified and proof.closed == closes, (ratio, turns)


@pytest.mark.long
def test_close_to_a_change_point_the_gap_is_really_open() -> None:
    for excess in (1e-3, 1e-6, 1e-9, 1e-12):
        lengths = (3.0, 1.0, 2.0 + excess, 2.0)
        assert certify_four_bar(*lengths).full_turn
        proof = certify(simulate(four_bar(*lengths), TURN))
        assert proof.certified and proof.closed


def gear_platform(source: SingleMotorPlatform) -> Mechanism:
    """The single-motor platform for the general engine: 15 links, 19 turning pairs, 3 gear pairs."""
    turn = np.exp(1j * np.array(source.frame_angle))
    joints: list[Revolute | Gear] = [Revolute(0, 1)]
    for k in range(3):
        wheel, coupler, rocker, link = 2 + k, 5 + k, 8 + k, 11 + k
        O, D, b = (z[k] * turn[k] for z in (source.axis, source.pivot, source.vertex))
        crank, bell = source.crank[k] * np.exp(1j * source.phase[k]), source.l1[k] * np.exp(1j * source.delta[k])
        joints += [
            Revolute(0, wheel, (O.real, O.imag)), Revolute(wheel, coupler, (crank.real, crank.imag)),
            Revolute(coupler, rocker, (source.coupler[k], 0.0), (source.rocker[k], 0.0)),
            Revolute(0, rocker, (D.real, D.imag)), Revolute(rocker, link, (bell.real, bell.imag)),
            Revolute(link, 14, (source.l2[k], 0.0), (b.real, b.imag)),
            Gear(1, wheel, radius_a=15.0, radius_b=30.0, offset=-1.5 * float(np.angle(O))),
        ]  # fmt: skip
    return Mechanism(source.graph(), joints, [Driver(0, 1, Linear(-2.0))])


def test_fifteen_links_with_gears_close_after_a_turn_of_the_wheels() -> None:
    source = SingleMotorPlatform(crank=(10.0, 5.0, 1.0), phase=(0.0, 0.5, 1.0))
    start = np.zeros((15, 3))
    start[14] = source.home_pose(0.0)
    motion = simulate(gear_platform(source), np.linspace(0.0, math.tau, 91), modes={3: -1, 4: -1, 5: -1}, start=start)
    proof = certify(motion)
    assert motion.completed and proof.certified and proof.closed and proof.position_radius.max() < 1e-10
    half = certify(simulate(motion.mechanism, motion.inputs[:46], modes={3: -1, 4: -1, 5: -1}, start=start))
    assert half.certified and not half.closed


# --- nothing false


@pytest.mark.long
def test_a_turn_that_the_lengths_forbid_is_never_proved() -> None:
    """Poses of a linkage that passes, claimed for one that does not: only the samples beside the gap stay open."""
    good = simulate(four_bar(3.0, 1.0, 2.0 + 1e-6, 2.0), np.linspace(0.0, math.tau, 360))
    for deficit in (1e-6, 1e-9, 1e-12, 1e-15, 0.0):
        proof = certify(replace(good, mechanism=four_bar(3.0, 1.0, 2.0 - deficit, 2.0)))
        assert not proof.certified and not proof.closed
        where = int(np.argmin(proof.intervals))
        assert abs(good.inputs[where] - math.pi) < 0.05 and proof.intervals.sum() >= 350


def mirrored(motion: Motion, other: Motion, start: int) -> Motion:
    """The other assembly mode from sample ``start`` on, passed off as the same motion."""
    poses = motion.poses.copy()
    poses[start:] = other.poses[start:]
    return replace(motion, poses=poses)


def test_a_jump_to_the_other_branch_is_found() -> None:
    first, second = (simulate(four_bar(4.0, 1.0, 3.0, 3.5), TURN, modes={0: s}) for s in (1, -1))
    for start in (1, 40, 120):
        proof = certify(mirrored(first, second, start))
        assert proof.poses.all() and not proof.certified and not proof.closed
        assert np.flatnonzero(~proof.intervals).tolist() == [start - 1]
        assert "between inputs" in proof.reason


@pytest.mark.long
def test_a_jump_where_the_branches_nearly_meet_is_found() -> None:
    u = np.linspace(0.0, math.tau, 361)
    first, second = (simulate(four_bar(3.0, 1.0, 2.0 + 1e-9, 2.0), u, modes={0: s}) for s in (1, -1))
    proof = certify(mirrored(first, second, 181))
    assert not proof.certified and not proof.closed and not proof.intervals[180]


@pytest.mark.long
def test_a_parallelogram_is_not_followed_through_its_change_point() -> None:
    """Neither on the branch that stays a parallelogram nor on the crossed one, although every sample is assembled."""
    u = np.linspace(0.1, 0.1 + math.tau, 200)
    motion = simulate(four_bar(2.0, 1.0, 2.0, 1.0), u[:2])
    turn = np.zeros((200, 4, 3))
    turn[:, 1, 2] = turn[:, 3, 2] = u
    turn[:, 2, 0], turn[:, 2, 1] = np.cos(u), np.sin(u)
    turn[:, 3, 0] = 2.0
    claimed = replace(motion, inputs=u, poses=turn, assembled=np.ones(200, dtype=bool))
    proof = certify(claimed)
    assert not proof.certified and not proof.closed and proof.poses.all()
    open_intervals = [(u[k], u[k + 1]) for k in np.flatnonzero(~proof.intervals)]
    assert len(open_intervals) == 2
    assert (
        open_intervals[0][0] < math.pi < open_intervals[0][1] and open_intervals[1][0] < math.tau < open_intervals[1][1]
    )


def test_a_perturbed_pose_is_given_an_honest_radius_or_none() -> None:
    motion = simulate(four_bar(4.0, 1.0, 3.0, 3.5), TURN)
    for size in (1e-9, 1e-6, 1e-3, 1e-1):
        poses = motion.poses.copy()
        poses[17, 3, 2] += size
        proof = certify(replace(motion, poses=poses), between=False)
        if proof.poses[17]:
            assert proof.angle_radius[17] >= size * (1.0 - 1e-9)
        assert proof.poses[17] == (size < 1e-2)
        assert np.delete(proof.poses, 17).all() and proof.certified == bool(proof.poses[17])


def test_an_incomplete_motion_is_not_certified_but_its_reached_part_is_proved() -> None:
    motion = simulate(four_bar(3.0, 1.5, 1.5, 2.0), np.linspace(0.2, math.tau, 80))
    assert not motion.completed
    proof = certify(motion)
    reached = int(motion.assembled.sum())
    assert not proof.certified and "incomplete" in proof.reason
    assert proof.poses.sum() == reached and proof.intervals.sum() == reached - 1
    assert np.isnan(proof.position_radius[reached:]).all()


def test_a_hole_in_the_samples_is_not_bridged() -> None:
    motion = simulate(four_bar(4.0, 1.0, 3.0, 3.5), TURN)
    poses = motion.poses.copy()
    poses[50] = np.nan
    proof = certify(replace(motion, poses=poses))
    assert not proof.certified and not proof.closed
    assert proof.intervals.tolist() == [True] * 49 + [False] * 71


def test_the_budget_is_kept_and_said() -> None:
    proof = certify(simulate(watt(), np.linspace(0.0, math.tau, 4)), max_boxes=5)
    assert not proof.certified and "limit of work" in proof.reason and proof.boxes <= 5


def test_a_mechanism_with_too_few_drivers_is_refused() -> None:
    motion = simulate(four_bar(4.0, 1.0, 3.0, 3.5), [0.0, 0.1])
    bare = Mechanism(CYCLE, motion.mechanism.joints)
    with pytest.raises(GeometryError, match="drivers"):
        certify(replace(motion, mechanism=bare))


# --- the equations themselves


MECHANISMS = [watt(), triad(), five_bar()]
SLIDING = [
    Revolute(0, 1), Revolute(1, 2, (0.4, 0.1)), Prismatic(3, 2, (0.2, 0.3), (0.1, 0.2), 0.1, 0.7),
    Revolute(0, 3, (1.0, 0.0)),
]  # fmt: skip
MECHANISMS += [Mechanism(CYCLE, SLIDING, [Driver(3, 2)]), Mechanism(CYCLE, SLIDING, [Driver(2, 3)]), cammed()]


@pytest.mark.parametrize("index", range(len(MECHANISMS)))
def test_equations_agree_with_those_of_the_joints(index: int) -> None:
    mechanism = MECHANISMS[index]
    system = MechanismSystem(mechanism)
    random = np.random.default_rng(index)
    poses = random.normal(size=(6, mechanism.graph.links, 3))
    poses[:, 0] = 0.0
    x, u = poses[:, 1:].reshape(6, -1), np.full(6, 0.2)
    units = system.units(x, u)
    f, (J, _) = system.residual(exact(x), exact(u), units), system.derivatives(exact(x), exact(u), units)
    rows = sum(3 - joint.mobility for joint in mechanism.joints)
    np.testing.assert_allclose(J.mid[:, :rows], jacobian(mechanism.joints, poses)[..., 3:], atol=1e-13)
    angular = [k for k, joint in enumerate(mechanism.joints) if isinstance(joint, Prismatic)]
    if not angular:
        np.testing.assert_allclose(f.mid[:, :rows], residual(mechanism.joints, poses), atol=1e-12)
    h = 1e-6
    for column in range(x.shape[1]):
        moved = x.copy()
        moved[:, column] += h
        ahead = system.residual(exact(moved), exact(u), system.units(moved, u)).mid
        moved[:, column] -= 2 * h
        behind = system.residual(exact(moved), exact(u), system.units(moved, u)).mid
        np.testing.assert_allclose(J.mid[..., column], (ahead - behind) / (2 * h), atol=2e-8)


@given(st.integers(0, len(MECHANISMS) - 1), st.integers(0, 2**32 - 1), st.floats(1e-8, 0.3))
@settings(max_examples=60, deadline=None)
def test_jacobian_over_a_box_contains_that_of_its_members(index: int, seed: int, radius: float) -> None:
    mechanism = MECHANISMS[index]
    system = MechanismSystem(mechanism)
    random = np.random.default_rng(seed)
    x, u = random.normal(size=(1, system.size)), np.array([0.1])
    units = system.units(x, u)
    J, _ = system.derivatives(Balls(x, np.full_like(x, radius)), exact(u), units)
    member = x + radius * random.uniform(-1.0, 1.0, x.shape)
    inside, _ = system.derivatives(exact(member), exact(u), system.units(member, u))
    assert (np.abs(inside.mid - J.mid) <= J.rad + inside.rad + 1e-15).all()


# --- against the exact condition


@given(st.lists(st.integers(1, 12), min_size=4, max_size=4), st.sampled_from([0.0, 1e-3, 1e-6, 1e-9]))
@settings(max_examples=10, deadline=None)
def test_full_turns_of_four_bars_agree_with_the_exact_condition(lengths: list[int], excess: float) -> None:
    g, a, b, c = (float(v) for v in lengths)
    b += excess
    kind = certify_four_bar(g, a, b, c).kind
    motion = simulate(four_bar(g, a, b, c), np.linspace(0.01, 0.01 + math.tau, 181))
    if not motion.assembled[0]:
        assert kind in ("limited", "never assembled")
        return
    proof = certify(motion)
    assert proof.certified == (kind == "full turn"), (kind, proof.statement)
