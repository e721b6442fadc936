"""Compiled parts of the parallel platform: against 60 digits, companion eigenvalues, brute force.

See theory/extreme-cases 2.
"""

from __future__ import annotations

import math
from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.triad.assembly_modes import assembly_modes, assembly_modes_batch, sextic
from graphsynth.kinematics.triad.kernels.leg import cross_sum
from graphsynth.kinematics.triad.leg import LegStatus, solve_leg
from graphsynth.systems.platform.drive import FourBarDrive
from graphsynth.systems.platform.motion import BranchEnd, track
from graphsynth.systems.platform.parallel_platform import WORKING_MODES, ParallelPlatform
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

G1, MOCK = ParallelPlatform.g1(), ParallelPlatform.mock()
REFERENCE = SingleMotorPlatform(crank=(10, 5, 0), phase=(0, 0.5, 1))
LEG_PHASES = SingleMotorPlatform().frame_angle
SINGULAR_CRANK = 45 * (1 - math.sqrt(5 / 29))  # theory/platform-drive 9


def circle(a, b):
    return np.abs(np.angle(np.exp(1j * (np.asarray(a) - np.asarray(b)))))


# --- inverse problem --------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_sum_of_two_products_that_cancel_keeps_its_digits():
    """``a b + c d`` to a rounding or two of the result, and to the square of a rounding of the products."""
    rng = np.random.default_rng(3)
    for a, b, c, more in rng.uniform(0.5, 2.0, (4000, 4)):
        d = -a * b / c * (1.0 + (more - 1.0) * 2.0 ** rng.integers(-50, 1))
        exact = Fraction(a) * Fraction(b) + Fraction(c) * Fraction(d)
        missed = abs(Fraction(cross_sum(a, b, c, d)) - exact)
        assert missed <= 2 * Fraction(math.ulp(float(exact))) + Fraction(2) ** -102


def bare(l1, l2):
    """Platform whose vertices and pivots are all at the origin: the pose is the end point of every leg, exactly."""
    return ParallelPlatform((0, 0, 0), (0, 0, 0), (l1,) * 3, (l2,) * 3)


def exact_angle(l1, l2, u, v, sigma):
    with mp.workdps(60):
        l1, l2, u, v = map(mp.mpf, (l1, l2, u, v))
        rho2 = u * u + v * v
        S, C = mp.sqrt(((l1 + l2) ** 2 - rho2) * (rho2 - (l1 - l2) ** 2)), rho2 + l1**2 - l2**2
        return float(mp.atan2(v * C + sigma * u * S, u * C - sigma * v * S))


EXTREME_LEGS = [
    (1, 1e6, 1000000.3, 0), (1e6, 1, 1000000.3, 0.2), (1, 1e-6, 0.8, 0.6), (1e-6, 1, 0.6, 0.8), (1, 1, 1e-9, 0),
    (1, 1, 2, 0), (1, 0.5, 0.5, 0), (1, 1, 1.999999999999, 0), (1, 0.5, 0.500000000001, 0), (3, 4, -3, 4),
    (1, 1, -1, 1), (1, 1, -1, 1.0000000001), (3, 4, -5, 0), (45, 60, 75, 0), (1, 1, 1e-16, 0), (1, 1 + 2**-52, 2, 0),
]  # fmt: skip


@pytest.mark.parametrize(("l1", "l2", "u", "v"), EXTREME_LEGS)
def test_extreme_legs_of_section_14_2(l1, l2, u, v):
    got = bare(l1, l2).inverse([u, v, 0.7])
    assert (got.status <= LegStatus.BOUNDARY).all()
    for mode, theta in zip(WORKING_MODES, got.theta):
        exact = [exact_angle(l1, l2, u, v, int(sigma)) for sigma in mode]
        assert circle(theta, exact).max() <= 4.5e-16


@pytest.mark.long
@settings(max_examples=200, deadline=None)
@given(
    st.floats(-6, 6), st.floats(-6, 6), st.floats(1e-90, 1), st.floats(-math.pi, math.pi), st.sampled_from((1, -1)),
    st.sampled_from((1.0, 1e-25, 1e25, 1e-53, 1e53)),
)  # fmt: skip
def test_legs_against_sixty_digits(log1, log2, t, direction, sigma, unit):
    l1, l2 = 10**log1 * unit, 10**log2 * unit
    rho = abs(l1 - l2) + t * (l1 + l2 - abs(l1 - l2))
    u, v = rho * math.cos(direction), rho * math.sin(direction)
    got = bare(l1, l2).inverse([u, v, 0.0], (sigma,) * 3)
    with mp.workdps(60):
        rho2 = mp.mpf(u) ** 2 + mp.mpf(v) ** 2
        reach = (mp.mpf(l1) + mp.mpf(l2)) ** 2 - rho2, rho2 - (mp.mpf(l1) - mp.mpf(l2)) ** 2
    if reach[0] < 0 or reach[1] < 0:
        assert (got.status == (LegStatus.TOO_FAR if reach[0] < 0 else LegStatus.TOO_NEAR)).all()
        assert np.isnan(got.theta).all()
        assert (got.deficit >= 0).all()
        return
    assume(got.status[0] == LegStatus.REACHABLE)
    exact = exact_angle(l1, l2, u, v, sigma)
    assert circle(got.theta, exact).max() <= 9e-16
    if 1e-300 < abs(exact) < 1e-3:  # small angles keep their digits
        assert got.theta[0] == pytest.approx(exact, rel=4e-15)


@pytest.mark.parametrize("platform", [G1, MOCK], ids=["G1", "MOCK"])
def test_bulk_agrees_with_the_exact_leg(platform):
    rng = np.random.default_rng(3)
    size = max(abs(d) for d in platform.D)
    poses = rng.uniform([-size, -size, -9], [size, size, 9], (3000, 3))
    got = platform.inverse(poses)
    w = platform.vertices(poses) - np.array(platform.D)
    leg = solve_leg(w.real, w.imag, np.array(platform.l1), np.array(platform.l2))
    np.testing.assert_array_equal(got.status, leg.status)
    assert {0, 2} <= set(np.unique(got.status).tolist())
    np.testing.assert_allclose(got.deficit, leg.deficit, rtol=0, atol=1e-15 * size)
    clear = 1e-3 * size**2 < leg.S
    np.testing.assert_allclose(got.S[clear], leg.S[clear], rtol=1e-12)
    for index, mode in enumerate(WORKING_MODES):
        expected = leg.angle(mode)
        np.testing.assert_array_equal(np.isnan(got.theta[:, index]), np.isnan(expected))
        assert circle(got.theta[:, index], expected)[clear].max() < 1e-12
        np.testing.assert_array_equal(platform.inverse(poses, mode).theta, got.theta[:, index])
    each = rng.choice([1, -1], (3000, 3))
    mixed = platform.inverse(poses, each).theta
    for index in (0, 77, 2999):
        np.testing.assert_array_equal(mixed[index], platform.inverse(poses[index], each[index]).theta)


@pytest.mark.parametrize("count", [0, 1, 255, 256, 257, 600])
def test_blocks_of_any_size(count):
    poses = np.random.default_rng(1).uniform([0.4, 0.2, -3], [2, 1.6, 3], (600, 3))
    whole, part = G1.inverse(poses).theta, G1.inverse(poses[:count]).theta
    np.testing.assert_array_equal(part, whole[:count])
    assert G1.inverse(poses[:count].reshape(count, 1, 3)).theta.shape == (count, 1, 8, 3)


def test_angle_of_an_arc():
    from graphsynth.kinematics.triad.kernels.leg import angle_of

    rng = np.random.default_rng(0)
    cases = [tuple(row) for row in rng.normal(size=(300, 2)) * 10.0 ** rng.integers(-8, 8, (300, 2))]
    cases += [(0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (-1.0, 0.0), (1.0, 1.0), (-1.0, -1.0), (1e-300, 1.0), (1.0, -1e-9)]
    for y, x in cases:
        with mp.workdps(40):
            exact = mp.atan2(mp.mpf(y), mp.mpf(x))
            assert abs(mp.mpf(angle_of(y, x)) - exact) <= min(3.4e-16, 4e-16 * abs(exact) + mp.mpf(10) ** -320)
    assert angle_of(-0.0, -1.0) == math.pi
    assert math.isnan(angle_of(0.0, 0.0))


# --- assembly modes ---------------------------------------------------------------------------------------------------


def random_problems(count, seed):
    rng = np.random.default_rng(seed)
    anchors, vertices = (rng.normal(size=(count, 3)) + 1j * rng.normal(size=(count, 3)) for _ in range(2))
    return anchors, vertices, rng.uniform(0.3, 3, (count, 3))


def companion_counts(anchors, vertices, lengths):
    """Number of roots of the sextic on the unit circle, and where that is clear, by eigenvalues."""
    g0, g1, g2, g3 = sextic(anchors, vertices, lengths).g
    lead = np.stack([g2, g1, g0, np.conj(g1), np.conj(g2), np.conj(g3)], axis=-1) / g3[:, None]
    matrix = np.zeros((len(g0), 6, 6), dtype=complex)
    matrix[:, 0], matrix[:, range(1, 6), range(5)] = -lead, 1.0
    off = np.abs(np.abs(np.linalg.eigvals(matrix)) - 1.0)
    return (off < 1e-6).sum(axis=1), ((off < 1e-8) | (off > 1e-4)).all(axis=1)


def check_against_companion(count, seed):
    anchors, vertices, lengths = random_problems(count, seed)
    batch = assembly_modes_batch(anchors, vertices, lengths, escalate=False)
    expected, clear = companion_counts(anchors, vertices, lengths)
    assert clear.mean() > 0.998
    np.testing.assert_array_equal(batch.counts[clear], expected[clear])
    assert batch.near_double_root.mean() < 1e-3
    assert batch.consistent[~batch.near_double_root].all()
    assert set(np.unique(batch.counts[~batch.near_double_root])) == {0, 2, 4, 6}
    k = batch.problem
    F = batch.poses[:, :1] + 1j * batch.poses[:, 1:2] + np.exp(1j * batch.poses[:, 2:]) * vertices[k]
    gap = np.abs(F - anchors[k]) - lengths[k]
    size = np.abs(anchors).max(axis=1) + np.abs(vertices).max(axis=1) + lengths.max(axis=1)
    fine = ~batch.near_double_root[k]
    assert (np.abs(gap).max(axis=1) / size[k])[fine].max() < 1e-13 / 0.3  # a leg may be ten times shorter
    order = np.diff(batch.poses[:, 2])
    assert (order[np.diff(k) == 0] >= 0).all()


def test_counts_against_companion_eigenvalues():
    check_against_companion(5000, 11)


@pytest.mark.slow
def test_counts_against_companion_eigenvalues_at_length():
    for seed in range(5):
        check_against_companion(40000, 100 + seed)


def test_parity_on_a_platform_nearly_as_large_as_its_base():
    large = ParallelPlatform((0, 1, 0.3 + 0.9j), (0, 0.95, 0.32 + 0.85j), (0.5,) * 3, (1, 1.1, 0.9))
    theta = np.random.default_rng(2).uniform(-math.pi, math.pi, (20000, 3))
    batch = large.direct_batch(theta, escalate=False)
    assert batch.consistent[~batch.near_double_root].all()
    assert np.abs(large.closure(batch.poses, theta[batch.problem])).max() < 1e-13
    np.testing.assert_allclose(
        batch.determinants, large.determinant(batch.poses, theta[batch.problem]), rtol=0, atol=1e-13
    )
    assert np.bincount(batch.counts, minlength=7)[[2, 4, 6]].min() > 1000


def test_batch_escalates_what_it_flags():
    singular = -0.491174039432700716436386522579764691645742
    theta = [G1.inverse([1.2, 0.9, singular + eps], (1, 1, 1)).theta for eps in (0.3, 1e-3, 1e-6, 1e-9, 1e-12)]
    raw = G1.direct_batch(theta, escalate=False)
    assert raw.near_double_root.tolist() == [False, False, True, True, True]
    assert not raw.escalated.any()
    full = G1.direct_batch(theta)
    assert full.escalated.tolist() == [False, False, True, True, True]
    assert full.consistent.all()
    for index, angles in enumerate(theta):
        one = G1.direct(angles)
        np.testing.assert_array_equal(full.poses[full.problem == index], one.poses)
        d = one.poses[0] - one.poses[1] if len(one) == 2 else np.zeros(3)
        assert one.separation(2.0).tolist() == pytest.approx([math.hypot(d[0] / 2, d[1] / 2, d[2])] * len(one))


def test_one_platform_many_legs_and_the_other_way_round():
    anchors, vertices, lengths = random_problems(50, 5)
    full = assembly_modes_batch(anchors, vertices, lengths)
    for k in range(50):
        one = assembly_modes(anchors[k], vertices[k], lengths[k])
        np.testing.assert_array_equal(one.poses, full.poses[full.problem == k])
    shared = assembly_modes_batch(anchors[0], vertices[0], lengths)
    for k in (0, 17):
        one = assembly_modes(anchors[0], vertices[0], lengths[k])
        np.testing.assert_array_equal(one.poses, shared.poses[shared.problem == k])


@pytest.mark.parametrize(
    ("anchors", "lengths", "text"),
    [
        ([0, 1, math.nan], [1, 1, 1], "leg 3"),
        ([0, 1, 1j], [1, -1, 1], "leg 2"),
        ([0, 1], [1, 1, 1], "shape"),
        ([[0, 1, 1j]] * 2, [[1, 1, 1]] * 3, "2 anchors"),
    ],
)
def test_bad_problems(anchors, lengths, text):
    with pytest.raises(GeometryError, match=text):
        assembly_modes_batch(anchors, [0, 1, 1j], lengths)


# --- one motor --------------------------------------------------------------------------------------------------------


def exact_pose(machine, guess, psi):
    """Pose at wheel angle psi at the working precision of mpmath."""
    platform, theta = machine.platform, []
    for k, drive in enumerate(machine.drives):
        w = mp.mpc(drive.axis) - mp.mpc(drive.pivot) + mp.mpf(drive.crank) * mp.expj(psi + mp.mpf(drive.phase))
        r2, a, c = abs(w) ** 2, mp.mpf(drive.rocker), mp.mpf(drive.coupler)
        S = mp.sqrt(((a + c) ** 2 - r2) * (r2 - (a - c) ** 2))
        theta.append(mp.arg(w * mp.mpc(r2 + a * a - c * c, drive.tau * S)) + machine.frame_angle[k] + machine.delta[k])
    A = [mp.mpc(D) + mp.mpf(r) * mp.expj(t) for D, r, t in zip(platform.D, platform.l1, theta)]

    def closure(x, y, alpha):
        F = [mp.mpc(x, y) + mp.expj(alpha) * mp.mpc(b) for b in platform.b]
        return [abs(f - a) ** 2 - mp.mpf(r) ** 2 for f, a, r in zip(F, A, platform.l2)]

    return mp.findroot(closure, [mp.mpf(value) for value in guess])


@pytest.mark.parametrize("psi", [0.4, 3.9])
def test_sweep_against_forty_digits(psi):
    sweep = REFERENCE.sweep(np.linspace(0.0, psi, 50), accelerations=True)
    with mp.workdps(40):
        h = mp.mpf(10) ** -8
        before, here, after = (exact_pose(REFERENCE, sweep.pose[-1], mp.mpf(psi) + step) for step in (-h, 0, h))
        for i in range(3):
            weight = 45 if i < 2 else 1
            assert abs(sweep.pose[-1, i] - here[i]) < 1e-14 * weight
            assert abs(sweep.velocity[-1, i] - (after[i] - before[i]) / (2 * h)) < 1e-14 * weight
            second = (after[i] - 2 * here[i] + before[i]) / h**2
            assert abs(sweep.acceleration[-1, i] - second) < 1e-13 * weight
    assert circle(sweep.theta[-1], REFERENCE.drive(psi).theta).max() < 1e-15
    np.testing.assert_allclose(sweep.theta_velocity[-1], REFERENCE.drive(psi).theta1, rtol=0, atol=1e-15)
    np.testing.assert_allclose(sweep.theta_acceleration[-1], REFERENCE.drive(psi).theta2, rtol=0, atol=1e-14)


@pytest.mark.parametrize("samples", [2, 3, 5, 17, 129, 300])
def test_samples_do_not_change_the_branch(samples):
    psi = np.linspace(0.0, math.tau, samples)
    fine = np.unique(np.concatenate([psi, np.linspace(0.0, math.tau, 1000)]))
    coarse, dense = REFERENCE.sweep(psi, accelerations=True), REFERENCE.sweep(fine, accelerations=True)
    same = np.searchsorted(fine, psi)
    assert coarse.complete
    np.testing.assert_allclose(coarse.pose, dense.pose[same], rtol=0, atol=5e-13)
    np.testing.assert_allclose(coarse.velocity, dense.velocity[same], rtol=0, atol=1e-12)
    np.testing.assert_allclose(coarse.acceleration, dense.acceleration[same], rtol=0, atol=1e-11)
    np.testing.assert_allclose(coarse.theta, dense.theta[same], rtol=0, atol=4e-15)
    np.testing.assert_array_equal(REFERENCE.sweep(psi).pose, coarse.pose)


def test_every_swept_pose_is_an_assembly_mode_of_the_same_sign():
    sweep = REFERENCE.sweep(np.linspace(0, 3 * math.tau, 2000))
    assert np.abs(REFERENCE.platform.closure(sweep.pose, sweep.theta)).max() < 1e-11  # of 3600 mm^2
    assert (np.sign(sweep.determinant) == -1).all()
    assert np.abs(np.diff(sweep.theta, axis=0)).max() < 0.02
    batch = REFERENCE.platform.direct_batch(sweep.theta)
    distance = np.full(2000, np.inf)
    np.minimum.at(distance, batch.problem, np.abs(batch.poses - sweep.pose[batch.problem]).max(axis=1))
    assert distance.max() < 1e-11


def test_batch_of_dimension_sets():
    rng = np.random.default_rng(8)
    crank, phase = rng.uniform(0, 12, (40, 3)), rng.uniform(-3, 3, (40, 3))
    crank[7], crank[11], phase[7] = (31, 5, 5), 40.0, 0.0
    batch = SingleMotorPlatform().full_turn_batch(crank, phase, samples=91, accelerations=True)
    for i in (0, 7, 39):
        machine = SingleMotorPlatform(crank=tuple(crank[i]), phase=tuple(phase[i]))
        if i == 7:
            sweep = machine.sweep(batch.psi)
            assert (sweep.reached, sweep.complete) == (batch.reached[i], False)
            assert batch.status[i] == BranchEnd.DRIVE_ENDS
            continue
        sweep = machine.sweep(batch.psi, accelerations=True)
        np.testing.assert_array_equal(batch.pose[i], sweep.pose)
        np.testing.assert_array_equal(batch.acceleration[i], sweep.acceleration)
        assert batch.closure_error[i] < 1e-13
    assert not batch.complete[[7, 11]].any()
    assert batch.complete.sum() == 38
    for i in range(40):
        assert np.isnan(batch.pose[i, batch.reached[i] :]).all()
        assert np.isfinite(batch.pose[i, : batch.reached[i]]).all()
    couplers = np.full((2, 3), 45.0)
    couplers[1] = 46.0
    two = SingleMotorPlatform().full_turn_batch([[5, 5, 5]], coupler=couplers[1:], samples=9)
    one = SingleMotorPlatform(crank=(5,) * 3, coupler=(46,) * 3).sweep(two.psi)
    np.testing.assert_array_equal(two.pose[0], one.pose)


@pytest.mark.parametrize(
    "arguments",
    [
        {"crank": [[1, 2]]},
        {"crank": [[1, -2, 3]]},
        {"crank": [[1, 2, math.nan]]},
        {"crank": [[1, 2, 3]], "coupler": [[0, 1, 1]]},
    ],
)
def test_bad_sets(arguments):
    with pytest.raises(GeometryError, match=r"crank|coupler"):
        SingleMotorPlatform().full_turn_batch(**arguments)
    with pytest.raises(GeometryError, match="increasing"):
        REFERENCE.sweep([0.0, 0.0])


def equilateral(crank, phase, pivot, vertex, l1, l2, delta):
    """Drives with coupler, rocker and frame of length 1.5; phases and bell-cranks in steps of 30 degrees."""
    twelfth = math.pi / 6
    return SingleMotorPlatform(
        crank=crank, phase=tuple(twelfth * k for k in phase), coupler=(1.5,) * 3, rocker=(1.5,) * 3,
        axis=tuple(p + 1.5 for p in pivot), pivot=pivot, vertex=vertex, l1=l1, l2=l2,
        delta=tuple(twelfth * k for k in delta), frame_angle=(0, 0, 0),
    )  # fmt: skip


# found by a random search: two of the four modes change places in a turn without meeting a singularity
CUSPED = [
    equilateral(
        (0.8, 1, 1), (11, 2, 0), (-0.5 + 1.5j, -0.6 + 0.4j, 1.4 - 0.2j), (1 - 0.8j, 0.8 - 1.7j, 0.4 + 1j),
        (0.5, 0.7, 0.9), (1.8, 2.3, 1.9), (6, 11, 1),
    ),
    equilateral(
        (0.8, 0.6, 0.6), (3, 4, 5), (-0.9 - 0.7j, 0.7 + 1j, -1.6 - 0.3j), (-0.7 + 0.1j, -1.6 + 0.6j, 0.1 - 0.9j),
        (1.2, 0.9, 0.9), (1.6, 1.8, 1.8), (3, 7, 11),
    ),
]  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("machine", CUSPED)
def test_modes_that_change_places(machine):
    turned = machine.monodromy()
    assert turned.permutation == (0, 1, 3, 2)
    assert turned.periods == (1, 1, 2, 2)
    assert turned.reasons == ("",) * 4
    # brute force: all modes at every sample, each joined to the nearest at the next
    batch = machine.platform.direct_batch(machine.drive(np.linspace(0, math.tau, 8001)).theta)
    sets = np.split(batch.poses, np.cumsum(batch.counts)[:-1])
    at = sets[0]
    for poses in sets[1:]:
        difference = at[:, None] - poses[None]
        difference[..., 2] = np.angle(np.exp(1j * difference[..., 2]))
        distance = np.linalg.norm(difference, axis=-1)
        nearest = distance.argmin(axis=1)
        assert distance.min(axis=1).max() < 0.02
        at = poses[nearest]
    joined = [int(np.abs(sets[0][:, :2] - pose[:2]).sum(axis=1).argmin()) for pose in at]
    assert tuple(joined) == turned.permutation
    motion = machine.full_turn(start=turned.modes[2])
    assert motion.complete
    assert motion.closed
    assert motion.period == 2
    assert motion.closure_error > 1
    twice = machine.sweep(np.linspace(0, 2 * math.tau, 721), start=turned.modes[2])
    np.testing.assert_allclose(twice.pose[360, :2], turned.modes[3, :2], rtol=0, atol=1e-13)
    np.testing.assert_allclose(twice.pose[720, :2], turned.modes[2, :2], rtol=0, atol=1e-13)
    assert circle(twice.pose[720, 2], turned.modes[2, 2]) < 1e-13
    assert (np.sign(twice.determinant) == np.sign(twice.determinant[0])).all()


def test_leg_boundary_is_passed_and_located():
    machine = CUSPED[1]
    motion = machine.full_turn(start=machine.monodromy().modes[2])
    events = [event for event in motion.events if event.kind == "leg boundary"]
    assert motion.complete
    assert not motion.working_mode_constant
    for event in events:
        assert not event.ends_motion
        near = machine.sweep([0.0, event.psi - 1e-6, event.psi, event.psi + 1e-6], start=motion.pose[0])
        legs = machine.platform.jacobians(near.pose, near.theta)[1][:, event.leg - 1]
        assert legs[1] * legs[3] < 0
        assert abs(legs[2]) < 1e-8 * abs(legs[3]) + 1e-10
        modes = machine.platform.working_mode(near.pose, near.theta)
        assert (modes[1] != modes[3]).tolist() == [leg == event.leg for leg in (1, 2, 3)]
        # the platform passes regularly
        assert near.determinant[1] == pytest.approx(near.determinant[3], rel=1e-4)
    assert len(events) == int(np.sum(np.diff(np.sign(motion.leg), axis=0) != 0))


@pytest.mark.parametrize("offset", [1e-9, 1e-6, 1e-3])
def test_limit_of_pure_rotation(offset):
    below = SingleMotorPlatform(crank=(SINGULAR_CRANK - offset,) * 3, phase=LEG_PHASES).full_turn()
    assert below.complete
    assert below.closed
    above = SingleMotorPlatform(crank=(SINGULAR_CRANK + offset,) * 3, phase=LEG_PHASES)
    motion = above.full_turn()
    assert not motion.complete
    event = motion.events[-1]
    assert event.kind == "platform singular"
    # at the singular pose the rockers have turned by -2 atan(9/37) from home (theory/platform-drive 9)
    home = float(FourBarDrive(45, 105 + 45j, 0.0, 45.0, 60.0).motion(0.0).phi)
    turned = float(above.drives[0].motion(event.psi).phi) - home
    assert turned == pytest.approx(-2 * math.atan(9 / 37), abs=1e-9)
    assert event.pose[2] == pytest.approx(2 * math.atan(3 / 7), abs=5e-6)
    assert above.monodromy().permutation == (-1, -1)
    assert set(above.monodromy().reasons) == {event.statement}


@pytest.mark.parametrize("cranks", [lambda c: (c, c, c), lambda c: (c, 0, 0)])
def test_limit_of_the_drives(cranks):
    assert SingleMotorPlatform(crank=cranks(30 - 1e-12)).full_turn().complete
    for crank, kind in ((30.0, "change point"), (30 + 1e-12, "drive lock"), (30.001, "drive lock")):
        machine = SingleMotorPlatform(crank=cranks(crank))
        motion, sweep = machine.full_turn(), machine.sweep(np.linspace(0, math.tau, 361))
        event = motion.events[-1]
        assert (event.kind, event.ends_motion, motion.complete) == (kind, True, False)
        assert sweep.reason == event.statement
        assert sweep.end[0] == event.psi
        assert sweep.reached == len(motion.psi)
        assert np.isnan(sweep.pose[sweep.reached :]).all()
        # |O D| + crank = coupler + rocker when the crank points away from the pivot
        w = 45 - (105 + 45j)
        away = (np.angle(w) - (0.0 - LEG_PHASES[event.leg - 1])) % math.tau
        assert circle(event.psi, away) < 0.02


def test_a_drive_whose_constants_disagree_ends_the_branch_at_once():
    """A sign of the rocker that is not +1 or -1 makes its rate wrong: steps stay tiny, 1e8 of them over a turn."""
    machine = SingleMotorPlatform()
    for sign, end in ((1.0, BranchEnd.COMPLETE), (1.1, BranchEnd.HOME_ENDS), (0.9, BranchEnd.HOME_ENDS)):
        own = machine._machine[None].copy()
        own[:, :, 5] *= sign
        psi, home, never = np.linspace(0.0, math.tau, 9), np.array(machine.home)[None], np.full(1, np.inf)
        found = track(own, psi, never, home, machine.Lc, grown=True, accelerations=False)
        assert found.status.tolist() == [end]


# --- extreme cases of theory/extreme-cases 2
# --------------------------------------------------------------------------------------


def similar(zeta, size=1.0):
    corner = size * np.exp(2j * np.pi * np.arange(3) / 3)
    return zeta * corner, corner


def case_out_of_reach():
    got = G1.inverse([1.2, 2.9, 0.0])
    out = got.deficit > 0
    assert out.tolist() == [True, True, False]
    assert np.isnan(got.theta[:, out]).all()
    assert np.isfinite(got.theta[:, ~out]).all()
    assert np.isnan(got.S[out]).all()
    reach = np.abs(G1.vertices([1.2, 2.9, 0.0]) - np.array(G1.D)) - np.array(G1.l1) - np.array(G1.l2)
    np.testing.assert_allclose(got.deficit[out], reach[out], rtol=1e-14)
    assert (got.status[out] == LegStatus.TOO_FAR).all()


def case_reach_boundary():
    got = ParallelPlatform((0, 2, 1), (0, 0, 0), (1,) * 3, (1,) * 3).inverse([2, 0, 0])
    assert got.status.tolist() == [LegStatus.BOUNDARY, LegStatus.FREE, LegStatus.REACHABLE]
    assert got.S[0] == 0.0
    assert got.sensitivity[0] == math.inf
    assert (got.theta[:, 0] == 0.0).all()
    assert np.isnan(got.theta[:, 1]).all()


def case_zero_lengths():
    got = ParallelPlatform((0, 0, 0), (0, 0, 0), (0, 1, 0), (1, 0, 0.5)).inverse([1, 0, 0])
    assert got.status.tolist() == [LegStatus.FREE, LegStatus.BOUNDARY, LegStatus.TOO_FAR]
    assert got.theta[0, 1] == 0.0
    assert got.deficit[2] == 0.5


def case_length_ratios():
    for ratio in (1e-6, 1e6, 1e-9, 1e9):
        u, v = 0.6 * max(1, ratio), 0.8 * max(1, ratio)
        got = bare(1.0, ratio).inverse([u, v, 0.0], (1, 1, 1))
        if got.reachable:
            assert circle(got.theta, exact_angle(1.0, ratio, u, v, 1)).max() <= 4.5e-16


def case_theta_and_alpha_pi():
    assert abs(bare(3.0, 4.0).inverse([-3, 4, math.pi], (1, 1, 1)).theta[0]) == math.pi
    pose = [1.2, 0.9, math.pi]
    rotated = ParallelPlatform(G1.D, tuple(-np.array(G1.b)), G1.l1, G1.l2)
    theta = rotated.inverse(pose, (1, -1, 1)).theta
    modes = rotated.direct(theta)
    assert modes.consistent
    error = np.abs(modes.poses - pose)
    error[:, 2] = circle(modes.poses[:, 2], math.pi)
    assert error.max(axis=1).min() < 1e-13


def case_no_mode():
    modes = assembly_modes([0, 100, 50j], [0, 1, 1j], [1, 1, 1])
    assert len(modes) == 0
    assert modes.consistent
    assert not modes.near_double_root


def case_exact_type_two():
    vertices = np.array([1, 1j, -1])  # similar triangles: the modes are |z - 2| = leg length (theory/platform-direct 3)
    merged = assembly_modes(2 * vertices, vertices, [1.0, 1.0, 1.0])
    assert (merged.near_double_root, merged.escalated, merged.double.tolist()) == (True, True, [True])
    assert np.abs(merged.poses).max() < 1e-20
    apart = assembly_modes(2 * vertices, vertices, [1.0 + 2**-52] * 3)
    assert (apart.near_double_root, apart.escalated, apart.double.tolist()) == (True, True, [False, False])
    half = 2.0**-26  # 5 - 4 cos(alpha) = leg^2
    np.testing.assert_allclose(apart.poses[:, 2], [-half, half], rtol=1e-9)
    assert apart.separation(1.0) == pytest.approx([2 * half] * 2, rel=1e-9)
    none = assembly_modes(2 * vertices, vertices, [1.0 - 2**-53] * 3)
    assert none.escalated
    assert len(none) == 0


def case_delta_zero():
    Q = 0.3 + 1.1j
    batch = assembly_modes_batch([0, 2, 5], [0, 1, 2], [abs(Q), abs(Q - 1), abs(Q - 3)])
    assert batch.escalated[0]
    assert batch.near_double_root[0]
    flat = batch.poses[np.abs(batch.poses[:, 2]) < 1e-9]
    np.testing.assert_allclose(np.sort(flat[:, 1]), [-Q.imag, Q.imag], atol=1e-12)


def case_coincident():
    for anchors, vertices in (([0, 2, 1 + 2j], [0, 0, 0.5]), ([0, 0, 2 + 1j], [0, 0.5, 1j])):
        for lengths in np.random.default_rng(0).uniform(0.5, 2.5, (200, 3)):
            modes = assembly_modes(anchors, vertices, lengths)
            assert "degree drops" in modes.note
            assert modes.consistent
            assert len(modes) <= 4
            assert modes.residuals.max(initial=0) < 1e-14


def case_collinear():
    rng = np.random.default_rng(1)
    lengths = rng.uniform(0.5, 2.5, (3000, 3))
    both = assembly_modes_batch([0, 1, 2.3], [0, 0.7, 1.1], lengths)
    assert both.counts.max() <= 4
    assert both.consistent.all()
    one = assembly_modes_batch([0, 1, 2.3], [0, 0.7, 1.1 + 0.4j], lengths)
    assert one.consistent.all()


def case_congruent():
    for lengths, self_motion in (([0.5] * 3, True), ([0.5, 0.5, 0.6], False)):
        anchors, vertices = similar(1.0)
        batch = assembly_modes_batch(3 + anchors, vertices, lengths)
        assert ("translates" in batch.remarks.get(0, "")) == self_motion
        if self_motion:
            assert batch.counts[0] == 0
            assert not batch.consistent[0]


def case_symmetric_home():
    theta = MOCK.inverse([0, 0, 0], (-1, -1, -1)).theta
    batch = MOCK.direct_batch(theta)
    assert batch.counts[0] == 2
    assert not batch.near_double_root[0]
    np.testing.assert_allclose(batch.poses[:, 2], [0, 2 * math.atan(96 / 103)], rtol=0, atol=1e-15)


def case_units():
    theta = np.random.default_rng(6).uniform(-3, 3, (500, 3))
    base = G1.direct_batch(theta)
    for unit in (2.0**-199, 1e-30, 1e30, 2.0**60, 2.0**195):
        scaled = ParallelPlatform(
            tuple(np.array(G1.D) * unit), tuple(np.array(G1.b) * unit), tuple(np.array(G1.l1) * unit),
            tuple(np.array(G1.l2) * unit),
        )  # fmt: skip
        other = scaled.direct_batch(theta)
        np.testing.assert_array_equal(other.counts, base.counts)
        np.testing.assert_allclose(other.poses[:, 2], base.poses[:, 2], rtol=0, atol=1e-11)
        pose = np.array([1.2, 0.9, 0.15])
        got = scaled.inverse(pose * [unit, unit, 1]).theta
        assert circle(got, G1.inverse(pose).theta).max() < 3e-15


def case_very_unequal_platform():
    for ratio in (1e-6, 1e-3, 1e3, 1e6):
        vertices = ratio * np.array(G1.b)
        # legs that close at a known pose
        pose, anchors = np.array([0.9, 0.7, 0.4]), np.array(G1.D)
        F = pose[0] + 1j * pose[1] + np.exp(0.4j) * vertices
        batch = assembly_modes_batch(anchors, vertices, np.abs(F - anchors))
        assert batch.consistent[0]
        error = np.abs(batch.poses - pose)
        error[:, 2] = circle(batch.poses[:, 2], pose[2])
        # an angle is determined to the rounding of the legs over the size of the platform
        scale = max(1.0, ratio)
        assert (error.max(axis=1) < 1e-13 * scale / min(1.0, ratio)).any() or batch.near_double_root[0]


def case_zero_cranks():
    for crank in ((0, 0, 0), (5, 0, 0), (5, 5, 0)):
        motion = SingleMotorPlatform(crank=crank).full_turn(samples=37)
        assert motion.closed
        still = [k for k, length in enumerate(crank) if length == 0]
        assert np.ptp(motion.theta[:, still], axis=0).max(initial=0.0) == 0.0
        if crank == (0, 0, 0):
            assert np.abs(motion.velocity).max() == 0.0


def case_crank_cannot_turn():
    machine = SingleMotorPlatform(crank=(31, 5, 5))
    state = machine.drive_turns()[0]
    assert state.kind == "limited"
    ((start, stop),) = state.admissible
    inside, outside = (
        machine.drives[0].motion([start + 1e-9, stop - 1e-9]),
        machine.drives[0].motion([start - 1e-9, stop + 1e-9]),
    )
    assert (inside.status == LegStatus.REACHABLE).all()
    assert (outside.status == LegStatus.TOO_FAR).all()


def case_change_point():
    motion = SingleMotorPlatform(crank=(30, 5, 5)).full_turn()
    (event,) = [event for event in motion.events if event.ends_motion]
    assert event.kind == "change point"
    assert "tau = +1 and tau = -1" in event.statement


CASES = [value for name, value in sorted(globals().items()) if name.startswith("case_")]


@pytest.mark.long
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__.removeprefix("case_"))
def test_extreme_case(case):
    case()
