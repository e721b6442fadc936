"""The general engine against closed forms, all assembly modes, and its own promises."""

from __future__ import annotations

import itertools
import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.kinematics import simulate
from graphsynth.kinematics.triad.assembly_modes import assembly_modes
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.mechanism.joints import Gear, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Harmonic, Linear
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.systems.platform.parallel_platform import directions
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

TURN = np.linspace(0.0, math.tau, 361)
CYCLE = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
TRIAD = MechanismGraph(6, [(0, 1), (1, 3), (2, 3), (2, 4), (0, 4), (2, 5), (0, 5)], frame=0)


def four_bar(frame: float, crank: float, coupler: float, rocker: float, **more: object) -> Mechanism:
    joints = [
        Revolute(0, 1), Revolute(1, 2, (crank, 0.0)), Revolute(2, 3, (coupler, 0.0), (rocker, 0.0)),
        Revolute(0, 3, (frame, 0.0)),
    ]  # fmt: skip
    return Mechanism(CYCLE, joints, [Driver(0, 1)], **more)  # type: ignore[arg-type]


def pair(z: complex) -> tuple[float, float]:
    return float(np.real(z)), float(np.imag(z))


# --- four-bar linkages


@pytest.mark.parametrize("lengths", [(2.0, 1.0, 2.5, 2.5), (4.0, 1.2, 3.1, 3.4), (1.0, 2.0, 2.2, 1.9)])
@pytest.mark.parametrize("sign", [1, -1])
def test_four_bar_agrees_with_the_lambda_linkage(lengths: tuple[float, ...], sign: int) -> None:
    linkage = TiltedFourBar(*lengths, sgn=sign)
    closed = linkage.positions(TURN)
    assert closed.assembled.all()
    motions = [simulate(four_bar(*lengths), TURN, modes={0: mode}) for mode in (1, -1)]
    errors = []
    for motion in motions:
        M = motion.point(2, (lengths[2] * 2.0, 0.0))
        B = motion.point(3, (lengths[3], 0.0))
        if np.abs(B.position - closed.B[:, :2]).max() > 1e-3:
            continue
        errors.append(
            [np.abs(a - b[:, :2]).max() for a, b in ((B.position, closed.B), (M.position, closed.M),
             (B.velocity, closed.dB), (M.velocity, closed.dM))]
        )  # fmt: skip
        assert motion.closure.closed
    assert len(errors) == 1
    assert max(errors[0]) < 1e-14 * max(1.0, *lengths)


def test_limit_angle_ends_the_motion() -> None:
    motion = simulate(four_bar(2.0, 1.0, 1.0, 1.0), TURN)
    assert not motion.completed and not motion.closure.tested
    assert motion.stopped_at == pytest.approx(math.acos(0.25), abs=1e-14)
    event = motion.events[-1]
    assert (event.kind, event.order, event.group, event.ends_motion) == ("fold", 2, 0, True)
    assert "merge" in motion.reason and "links 2, 3" in motion.reason
    reached = motion.stopped_at > TURN
    assert (motion.assembled == reached).all()
    for array in (motion.poses, motion.velocities, motion.accelerations, motion.margins):
        assert np.isnan(array[~reached]).all() and np.isfinite(array[reached]).all()


def test_motion_backwards_meets_the_mirror_limit() -> None:
    motion = simulate(four_bar(2.0, 1.0, 1.0, 1.0), -TURN)
    assert motion.stopped_at == pytest.approx(-math.acos(0.25), abs=1e-14)


def test_mechanism_that_cannot_be_assembled() -> None:
    motion = simulate(four_bar(5.0, 1.0, 1.0, 1.0), TURN)
    assert not motion.assembled.any() and np.isnan(motion.poses).all()
    assert motion.events[0].kind == "not assembled" and motion.stopped_at == 0.0
    assert math.isnan(motion.residual)


def test_change_point_is_an_event() -> None:
    """l = (2, 1, 2, 3): the linkage folds flat at u = 0 and both branches continue."""
    inside = simulate(four_bar(2.0, 1.0, 2.0, 3.0), TURN + 0.3)
    assert not inside.completed and inside.stopped_at == pytest.approx(math.tau, abs=1e-11)
    assert inside.events[-1].kind == "change point"
    at_ends = simulate(four_bar(2.0, 1.0, 2.0, 3.0), TURN)
    assert [event.kind for event in at_ends.events if event.kind != "dead centre"] == ["change point"] * 2
    assert not at_ends.closure.closed and np.isnan(at_ends.velocities[0, 2:]).all()


def test_narrow_gap_between_samples_is_not_stepped_over() -> None:
    """The crank is blocked over a few thousandths of a degree, far less than a sample."""
    motion = simulate(four_bar(2.0, 1.0, 2.0 - 1e-9, 3.0), TURN + 0.3)
    assert not motion.completed and motion.events[-1].kind == "fold"
    half = math.acos(((1.0 + 1e-9) ** 2 - 5.0) / -4.0)
    assert motion.stopped_at == pytest.approx(math.tau - half, abs=1e-9)
    assert not motion.assembled[motion.inputs > motion.stopped_at].any()


@pytest.mark.parametrize("excess", [1e-3, 1e-6, 1e-8, 1e-10, 1e-12])
def test_close_to_a_change_point(excess: float) -> None:
    """The margin at u = 0 is a closed form in the excess length: passed, and reported if close."""
    motion = simulate(four_bar(2.0, 1.0, 2.0 + excess, 3.0), TURN + 0.3)
    assert motion.completed and motion.closure.closed
    close = [event for event in motion.events if event.kind == "near fold"]
    l = 2.0 + excess
    least = (l + 2.0) * (l + 4.0) * (3.0 + 1.0 - l) * (l - 2.0) / (4.0 * l * l * 9.0)
    assert bool(close) == (least < 1e-8)
    if close:
        assert close[0].input == pytest.approx(math.tau, abs=1e-8) and not close[0].ends_motion


@pytest.mark.parametrize("excess", [-1e-3, -1e-6, -1e-9, -1e-12])
def test_short_of_a_change_point(excess: float) -> None:
    coupler = 2.0 + excess
    motion = simulate(four_bar(2.0, 1.0, coupler, 3.0), TURN + 0.3)
    limit = 2.0 * math.asin(math.sqrt((3.0 - coupler - 1.0) * (3.0 - coupler + 1.0) / 8.0))
    assert motion.events[-1].kind == "fold"
    assert motion.stopped_at == pytest.approx(math.tau - limit, abs=1e-9)


def test_parallelogram_stops_at_its_change_point() -> None:
    motion = simulate(four_bar(2.0, 1.0, 2.0, 1.0), TURN)
    assert motion.stopped_at == pytest.approx(math.pi, abs=1e-12)
    assert motion.events[-1].kind == "change point"


@pytest.mark.parametrize("scale", [1e-9, 1e-6, 1e6, 1e9])
def test_size_does_not_matter(scale: float) -> None:
    unit = simulate(four_bar(2.0, 1.0, 2.5, 2.5), TURN)
    scaled = simulate(four_bar(2.0 * scale, scale, 2.5 * scale, 2.5 * scale), TURN)
    assert scaled.completed and scaled.closure.closed and scaled.residual < 1e-14
    np.testing.assert_allclose(scaled.poses[:, :, :2] / scale, unit.poses[:, :, :2], atol=1e-14)
    base, *_ = triad(0)
    joints = [
        Revolute(j.a, j.b, (j.at_a[0] * scale, j.at_a[1] * scale), (j.at_b[0] * scale, j.at_b[1] * scale))
        for j in base.joints
    ]
    small, large = simulate(base, TURN), simulate(Mechanism(TRIAD, joints, base.drivers), TURN)
    np.testing.assert_allclose(large.poses[:, :, :2] / scale, small.poses[:, :, :2], atol=1e-13)


@pytest.mark.parametrize("ratio", [1e-6, 1e-3, 1e3, 1e6])
def test_length_ratios(ratio: float) -> None:
    """Against the same closed form at 50 digits."""
    lengths = (2.0, 0.5 * ratio, 2.5, 2.5) if ratio < 1.0 else (2.0, 1.0, 2.5 * ratio, 2.5 * ratio)
    motion = simulate(four_bar(*lengths), TURN[::30])
    C = motion.point(3, (lengths[3], 0.0)).position
    with mp.workdps(50):
        frame, crank, coupler, rocker = map(mp.mpf, lengths)
        for k, u in enumerate(motion.inputs):
            A = crank * mp.expj(mp.mpf(u))
            d = abs(frame - A)
            along = (d**2 + coupler**2 - rocker**2) / (2 * d)
            exact = A + (frame - A) / d * mp.mpc(along, mp.sqrt(coupler**2 - along**2))
            assert abs(mp.mpc(*C[k]) - exact) < 1e-15 * 4 * max(lengths)


@settings(max_examples=40, deadline=None)
@example((1.0, 1.0, 1.0, 1.0), 1, 5.5e-130)
@given(st.tuples(*[st.floats(0.2, 5.0)] * 4), st.sampled_from([1, -1]), st.floats(0.0, 6.28))
def test_the_mode_never_swaps(lengths: tuple[float, ...], mode: int, begin: float) -> None:
    """The joint C stays on its side of the line from A to D wherever the linkage is assembled; links keep lengths."""
    frame, crank, coupler, rocker = lengths
    motion = simulate(four_bar(*lengths), begin + TURN[::4], modes={0: mode}, events=False)
    reached = motion.assembled
    A, C = motion.point(1, (crank, 0.0)).position[reached], motion.point(3, (rocker, 0.0)).position[reached]
    D = np.array([frame, 0.0])
    side = (D[0] - A[:, 0]) * (C[:, 1] - A[:, 1]) - (D[1] - A[:, 1]) * (C[:, 0] - A[:, 0])
    scale = max(lengths) ** 2
    assert (mode * side >= -1e-7 * scale).all()
    assert (motion.modes[reached] == mode).all() and (motion.modes[~reached] == 0).all()
    size = max(lengths) * 1e-13
    np.testing.assert_allclose(np.hypot(*(C - A).T), coupler, atol=size)
    np.testing.assert_allclose(np.hypot(*(C - D).T), rocker, atol=size)
    steps = np.abs(np.diff(C, axis=0)).max(axis=1, initial=0.0)
    if motion.completed and reached.all() and np.nanmin(motion.margins) > 0.05:
        speed = np.nanmax(np.linalg.norm(motion.point(3, (rocker, 0.0)).velocity, axis=1))
        assert (steps <= 1.5 * speed * (TURN[4] - TURN[0]) + 1e-12).all()


def test_transmission_angle_of_a_four_bar() -> None:
    motion = simulate(four_bar(4.0, 1.0, 3.0, 3.5), TURN)
    distance = np.sqrt(17.0 - 8.0 * np.cos(TURN))
    mu = np.arccos((9.0 + 3.5**2 - distance**2) / 21.0)
    np.testing.assert_allclose(motion.transmission_angle()[0], np.minimum(mu, math.pi - mu), atol=1e-12)


def test_dead_centres_of_a_crank_rocker() -> None:
    """The rocker reverses where crank and coupler are in line: two closed-form angles."""
    frame, crank, coupler, rocker = 4.0, 1.0, 3.0, 3.5
    found = sorted(e.input for e in simulate(four_bar(frame, crank, coupler, rocker), TURN).events)
    expected = []
    for reach, shift in ((coupler + crank, 0.0), (coupler - crank, math.pi)):
        angle = math.acos((frame**2 + reach**2 - rocker**2) / (2.0 * frame * reach))
        expected.append((angle + shift) % math.tau)
    np.testing.assert_allclose(found, sorted(expected), atol=1e-12)


# --- groups of class III


def triad(seed: int) -> tuple[Mechanism, np.ndarray, np.ndarray, np.ndarray, float]:
    random = np.random.default_rng(seed)
    D = np.array([0.0, 2.0 + 0.3 * random.normal() + 1j * random.normal(), 1.0 + 2.2j])
    b = np.array([-0.4 - 0.25j, 0.45 - 0.3j, 0.05 + 0.5j]) * random.uniform(0.6, 1.4)
    lengths, crank = random.uniform(0.9, 1.6, 3), float(random.uniform(0.2, 0.6))
    joints = [
        Revolute(0, 1), Revolute(1, 3, (crank, 0.0)), Revolute(2, 3, pair(b[0]), (lengths[0], 0.0)),
        Revolute(2, 4, pair(b[1]), (lengths[1], 0.0)), Revolute(0, 4, pair(D[1])),
        Revolute(2, 5, pair(b[2]), (lengths[2], 0.0)), Revolute(0, 5, pair(D[2])),
    ]  # fmt: skip
    return Mechanism(TRIAD, joints, [Driver(0, 1)]), D, b, lengths, crank


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1, 4, 6, 10, 12, 28, 35, 36])
def test_triad_follows_every_mode(seed: int) -> None:
    """Each mode is followed over the turn; where it ends, two of the six roots of the sextic disappear."""
    mechanism, D, b, lengths, crank = triad(seed)

    def modes(u: float) -> np.ndarray:
        return np.asarray(assembly_modes([crank * np.exp(1j * u), D[1], D[2]], b, lengths).poses)

    u = TURN[::4]
    motions = [simulate(mechanism, u, modes={0: rank}) for rank in range(len(modes(0.0)))]
    assert motions
    for motion in motions:
        reached = motion.assembled
        assert motion.residual < 1e-14
        assert len(set(motion.modes[reached, 0])) == 1
        for k in np.flatnonzero(reached)[::10]:
            assert np.abs(modes(u[k])[:, :2] - motion.poses[k, 2, :2]).max(axis=1).min() < 1e-8
        if motion.completed:
            continue
        event = next(e for e in motion.events if e.ends_motion)
        assert event.kind == "fold" and event.uncertainty < 1e-7
        assert len(modes(event.input - 1e-6)) - len(modes(event.input + 1e-6)) == 2
    for first, second in itertools.combinations(motions, 2):
        both = first.assembled & second.assembled
        apart = np.abs(np.exp(1j * first.poses[both, 2, 2]) - np.exp(1j * second.poses[both, 2, 2]))
        place = np.abs(first.poses[both, 2, :2] - second.poses[both, 2, :2]).max(axis=1)
        assert (apart + place > 1e-4).all()


@pytest.mark.parametrize(("seed", "rank"), [(4, 0), (6, 0), (12, 1), (28, 0), (28, 3), (36, 2)])
def test_fold_of_a_triad_is_located(seed: int, rank: int) -> None:
    """Against the exact system f = 0, det f_X = 0 in pose and input, solved at 40 digits."""
    mechanism, D, b, lengths, crank = triad(seed)
    event = next(e for e in simulate(mechanism, TURN, modes={0: rank}).events if e.ends_motion)
    near = simulate(mechanism, np.append(TURN[event.input - 1e-6 > TURN], event.input - 1e-8), modes={0: rank})
    pose = near.poses[near.assembled][-1, 2]

    def system(x: mp.mpf, y: mp.mpf, alpha: mp.mpf, u: mp.mpf) -> list[mp.mpf]:
        z = mp.expj(alpha)
        anchors = [crank * mp.expj(u), mp.mpc(D[1]), mp.mpc(D[2])]
        arms = [z * mp.mpc(point) for point in b]
        d = [mp.mpc(x, y) + arm - anchor for arm, anchor in zip(arms, anchors)]
        rows = [[mp.re(v), mp.im(v), mp.im(mp.conj(arm) * v)] for arm, v in zip(arms, d)]
        return [abs(v) ** 2 - mp.mpf(l) ** 2 for v, l in zip(d, lengths)] + [mp.det(mp.matrix(rows))]

    with mp.workdps(40):
        exact = mp.findroot(system, [mp.mpf(v) for v in (*pose, event.input)], tol=1e-60, maxsteps=30)[3]
        error = abs(float(exact - mp.mpf(event.input)))
    assert error <= event.uncertainty and error < 1e-11


def test_triad_rates_agree_with_differences() -> None:
    mechanism = triad(0)[0]
    h = 1e-3
    motion = simulate(mechanism, 0.7 + h * np.arange(-4, 5))
    weights = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280]) / h
    for values, rates in ((motion.poses, motion.velocities[4]), (motion.velocities, motion.accelerations[4])):
        np.testing.assert_allclose(np.tensordot(weights, values, axes=1), rates, atol=2e-11)


def test_coarse_inputs_follow_the_same_branch() -> None:
    mechanism = triad(0)[0]
    fine, coarse = simulate(mechanism, TURN), simulate(mechanism, TURN[::60])
    np.testing.assert_allclose(coarse.poses, fine.poses[::60], atol=1e-12)


# --- six-bar linkages of dyads


def six_bar(joints: list[tuple[int, int]], seed: int) -> Mechanism:
    """A six-bar linkage assembled at a random pose of its joints, link frames along the fixed one."""
    graph = MechanismGraph(6, joints, frame=0)
    random = np.random.default_rng(seed)
    at = {(0, 1): 0j, **{pair: complex(*random.normal(size=2)) * 2.0 for pair in joints if pair != (0, 1)}}
    near = next(pair for pair in joints if 1 in pair and pair != (0, 1))
    at[near] = 0.4 + 0.2j
    parts = [Revolute(a, b, pair(z), pair(z)) for (a, b), z in at.items()]
    return Mechanism(graph, parts, [Driver(0, 1)], pose=((0.0, 0.0, 0.0),) * 6)


SIX = {
    "Watt I": [(0, 1), (1, 2), (2, 3), (0, 3), (2, 4), (4, 5), (3, 5)],
    "Watt II": [(0, 1), (1, 2), (2, 3), (0, 3), (3, 4), (4, 5), (0, 5)],
    "Stephenson I": [(0, 1), (1, 2), (2, 3), (0, 3), (1, 4), (4, 5), (2, 5)],
    "Stephenson II": [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4), (2, 5), (4, 5)],
    "Stephenson III": [(0, 1), (1, 2), (2, 3), (0, 3), (2, 4), (4, 5), (0, 5)],
}


@pytest.mark.parametrize("name", SIX)
@pytest.mark.parametrize("seed", range(3))
def test_six_bars_start_at_their_pose_and_keep_their_lengths(name: str, seed: int) -> None:
    mechanism = six_bar(SIX[name], seed)
    motion = simulate(mechanism, np.linspace(0.0, 0.5, 51))
    assert motion.assembled[0]
    np.testing.assert_allclose(motion.poses[0], 0.0, atol=1e-12)
    assert motion.residual < 1e-13
    if not motion.completed:
        assert motion.reason and any(event.ends_motion for event in motion.events)
    reached = motion.assembled
    for joint in mechanism.joints:
        P, Q = (motion.point(link, at).position[reached] for link, at in ((joint.a, joint.at_a), (joint.b, joint.at_b)))
        np.testing.assert_allclose(P, Q, atol=1e-13 * motion.Lc)


# --- gears and the single-motor platform


def platform(source: SingleMotorPlatform) -> Mechanism:
    """The same mechanism for the general engine: 15 links, pinion of half the wheels' radius."""
    turn = directions(source.frame_angle)
    joints: list[Revolute | Gear] = [Revolute(0, 1)]
    for k in range(3):
        wheel, coupler, rocker, link = 2 + k, 5 + k, 8 + k, 11 + k
        O, D, b = (z[k] * turn[k] for z in (source.axis, source.pivot, source.vertex))
        joints += [
            Revolute(0, wheel, pair(O)),
            Revolute(wheel, coupler, pair(source.crank[k] * np.exp(1j * source.phase[k]))),
            Revolute(coupler, rocker, (source.coupler[k], 0.0), (source.rocker[k], 0.0)),
            Revolute(0, rocker, pair(D)),
            Revolute(rocker, link, pair(source.l1[k] * np.exp(1j * source.delta[k]))),
            Revolute(link, 14, (source.l2[k], 0.0), pair(b)),
            Gear(1, wheel, radius_a=15.0, radius_b=30.0, offset=-1.5 * float(np.angle(O))),
        ]
    return Mechanism(source.graph(), joints, [Driver(0, 1, Linear(-2.0))], points={"P": (14, (0.0, 0.0))})


@pytest.mark.parametrize(
    ("crank", "phase"),
    [((10.0, 5.0, 1.0), (0.0, 0.5, 1.0)), ((10.0,) * 3, (0.0, 0.0, 0.0)), ((8.0, 0.0, 3.0), (1.0, 2.0, 3.0))],
)
def test_single_motor_platform_over_a_turn(crank: tuple[float, ...], phase: tuple[float, ...]) -> None:
    source = SingleMotorPlatform(crank=crank, phase=phase)  # type: ignore[arg-type]
    expected = source.full_turn(361)
    assert expected.complete
    start = np.zeros((15, 3))
    start[14] = expected.pose[0]
    mechanism = platform(source)
    motion = simulate(mechanism, expected.psi, modes={3: -1, 4: -1, 5: -1}, start=start)
    assert [step.group for step in motion.steps if step.has_two_modes] == [3, 4, 5]
    assert motion.completed and motion.closure.closed
    for own, closed in (
        (motion.poses, expected.pose), (motion.velocities, expected.velocity),
        (motion.accelerations, expected.acceleration),
    ):  # fmt: skip
        assert np.abs(own[:, 14] - closed).max() < 1e-10
    assert motion.residual < 1e-13 and np.nanmax(motion.errors) < 1e-11
    reversals = sorted(e.input for e in motion.events if e.kind == "dead centre")
    known = sorted(e.psi for e in expected.events if e.kind == "rocker dead centre" and crank[e.leg - 1] > 0.0)
    np.testing.assert_allclose(reversals, known, atol=1e-9)
    np.testing.assert_allclose(motion.poses[:, 2, 2] - motion.poses[0, 2, 2], expected.psi, atol=1e-13)
    report = mechanism.mobility(motion.poses[7])
    assert (report.count, report.by_rank, report.rank) == (1, 1, 41)


def test_one_turn_of_the_pinion_is_half_a_turn_of_the_wheels() -> None:
    source = SingleMotorPlatform(crank=(10.0, 5.0, 1.0), phase=(0.0, 0.5, 1.0))
    mechanism = platform(source)
    start = np.zeros((15, 3))
    start[14] = source.full_turn(9).pose[0]
    motion = simulate(mechanism, np.linspace(0.0, math.pi, 91), modes={3: -1, 4: -1, 5: -1}, start=start)
    assert motion.completed and motion.closure.tested and not motion.closure.closed
    assert motion.closure.period == 2 and set(motion.closure.changed) == set(range(7))


def test_planetary_gear() -> None:
    """Fixed sun, arm, planet: the planet turns (1 + r_sun/r_planet) times the arm, without a name for the carrier."""
    graph = MechanismGraph(3, [(0, 1), (1, 2), (0, 2, 2)], frame=0)
    mechanism = Mechanism(
        graph,
        [Revolute(0, 1), Revolute(1, 2, (3.0, 0.0)), Gear(0, 2, radius_a=2.0, radius_b=1.0)],
        [Driver(0, 1)],
    )
    u = np.linspace(0.0, 3.0 * math.tau, 100)
    motion = simulate(mechanism, u)
    np.testing.assert_allclose(motion.poses[:, 2, 2] - motion.poses[0, 2, 2], 3.0 * u, atol=1e-12)
    np.testing.assert_allclose(motion.velocities[:, 2, 2], 3.0, atol=1e-13)
    assert motion.closure.closed and motion.residual < 1e-13


def test_geared_five_bar() -> None:
    """Two cranks geared 2:3 carry an RRR dyad; the turn closes after three turns of the first crank."""
    graph = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4), (1, 4, 2)], frame=0)
    frame, r1, r4, l2, l3 = 3.0, 0.6, 0.5, 2.4, 2.2
    joints = [
        Revolute(0, 1), Revolute(1, 2, (r1, 0.0)), Revolute(2, 3, (l2, 0.0), (l3, 0.0)), Revolute(3, 4, at_b=(r4, 0.0)),
        Revolute(0, 4, (frame, 0.0)), Gear(1, 4, radius_a=2.0, radius_b=3.0),
    ]  # fmt: skip
    motion = simulate(Mechanism(graph, joints, [Driver(0, 1)]), TURN, modes={1: 1})
    assert motion.completed and motion.closure.period == 3 and not motion.closure.closed
    A = r1 * np.exp(1j * TURN)
    B = frame + r4 * np.exp(-2j / 3 * TURN)
    d = np.abs(B - A)
    along = (d**2 + l2**2 - l3**2) / (2.0 * d)
    C = A + (B - A) / d * (along + 1j * np.sqrt(l2**2 - along**2))
    own = motion.point(2, (l2, 0.0)).position @ [1.0, 1.0j]
    mirror = A + (B - A) / d * (along - 1j * np.sqrt(l2**2 - along**2))
    assert min(np.abs(own - C).max(), np.abs(own - mirror).max()) < 1e-13


def test_slider_crank_driven_by_its_slider() -> None:
    """The inverse of the crank-driven motion, up to the dead centre, where the crank's two modes merge."""
    r, l = 0.3, 1.1
    joints = [Revolute(0, 1), Revolute(1, 2, (r, 0.0)), Revolute(2, 3, (l, 0.0)), Prismatic(0, 3)]
    forward = simulate(Mechanism(CYCLE, joints, [Driver(0, 1)]), np.linspace(0.3, 2.8, 26), modes={0: 1})
    if forward.poses[0, 3, 0] < 0.0:
        forward = simulate(Mechanism(CYCLE, joints, [Driver(0, 1)]), np.linspace(0.3, 2.8, 26), modes={0: -1})
    driven = Mechanism(CYCLE, joints, [Driver(0, 3)], pose=tuple(map(tuple, forward.poses[0])))
    back = simulate(driven, forward.poses[:, 3, 0])
    np.testing.assert_allclose(back.poses[:, 1:3], forward.poses[:, 1:3], atol=1e-13)
    np.testing.assert_allclose(back.velocities[:, 1, 2] * forward.velocities[:, 3, 0], 1.0, atol=1e-12)
    stopped = simulate(driven, np.linspace(forward.poses[0, 3, 0], 2.0, 50))
    assert stopped.stopped_at == pytest.approx(r + l, abs=1e-15 * 4) and stopped.events[-1].kind == "fold"


def test_pressure_angle_is_the_complement() -> None:
    motion = simulate(four_bar(4.0, 1.0, 3.0, 3.5), TURN[::30])
    total = motion.pressure_angle()[0] + motion.transmission_angle()[0]
    np.testing.assert_allclose(total, math.pi / 2, atol=1e-15)


# --- input, laws, refusal


def test_law_of_the_driver_enters_the_rates() -> None:
    law = Harmonic(mean=1.0, amplitude=0.6, order=1.0)
    base = four_bar(4.0, 1.0, 3.0, 3.5)
    driven = Mechanism(CYCLE, base.joints, [Driver(0, 1, law)])
    u = np.linspace(0.0, math.tau, 41)
    motion, plain = simulate(driven, u), [simulate(base, [q]) for q in law(u)[0]]
    _, q1, q2 = law(u)
    first = np.array([p.velocities[0, 3, 2] for p in plain])
    second = np.array([p.accelerations[0, 3, 2] for p in plain])
    np.testing.assert_allclose(motion.velocities[:, 3, 2], first * q1, atol=1e-14)
    np.testing.assert_allclose(motion.accelerations[:, 3, 2], second * q1**2 + first * q2, atol=1e-13)
    assert motion.closure.closed


def test_driver_named_the_other_way_round_turns_backwards() -> None:
    forward, back = four_bar(4.0, 1.0, 3.0, 3.5), Mechanism(CYCLE, four_bar(4.0, 1.0, 3.0, 3.5).joints, [Driver(1, 0)])
    u = np.linspace(0.1, 1.0, 5)
    np.testing.assert_allclose(simulate(back, -u).poses, simulate(forward, u).poses, atol=1e-14)


def test_driver_between_moving_links() -> None:
    """Open chain of two driven links: the second turns relative to the first."""
    graph = MechanismGraph(3, [(0, 1), (1, 2)], frame=0)
    arm = Mechanism(graph, [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0))], [Driver(1, 2, Linear(2.0)), Driver(0, 1)])
    u = np.linspace(0.0, 1.0, 11)
    motion = simulate(arm, u)
    np.testing.assert_allclose(motion.poses[:, 2, 2], 3.0 * u, atol=1e-15)
    np.testing.assert_allclose(motion.poses[:, 2, :2], np.column_stack([np.cos(u), np.sin(u)]), atol=1e-15)


@pytest.mark.parametrize(
    ("inputs", "words"),
    [([], "one or more"), ([0.0, 0.0], "strictly"), ([0.0, math.nan], "finite"), ([0.0, 2.0, 1.0], "strictly"),
     ([[0.0, 1.0]], "shape")],
)  # fmt: skip
def test_bad_inputs(inputs: list[float], words: str) -> None:
    with pytest.raises(GeometryError, match=words):
        simulate(four_bar(2.0, 1.0, 2.5, 2.5), inputs)


def test_bad_modes_and_drivers() -> None:
    mechanism = four_bar(2.0, 1.0, 2.5, 2.5)
    for modes, words in (({1: 1}, "groups are"), ({0: 2}, r"\+1 or -1"), ({0: True}, "integer")):
        with pytest.raises(GeometryError, match=words):
            simulate(mechanism, [0.0], modes=modes)
    with pytest.raises(GeometryError, match="needs 1 driver"):
        simulate(Mechanism(CYCLE, mechanism.joints), [0.0])
    with pytest.raises(GeometryError, match="does not exist"):
        simulate(triad(0)[0], [0.0], modes={0: 9})
    with pytest.raises(GeometryError, match="shape"):
        simulate(mechanism, [0.0], start=[[0.0, 0.0, 0.0]])


def test_table_of_the_motion() -> None:
    motion = simulate(four_bar(2.0, 1.0, 2.5, 2.5, points={"M": (2, (5.0, 0.0))}), TURN)
    table = motion.to_pandas()
    assert len(table) == 361 and {"input", "x_2", "d_theta_3", "dd_y_2", "mode_0", "error"} <= set(table.columns)
    np.testing.assert_array_equal(table["theta_3"], motion.poses[:, 3, 2])
    M = motion.point("M")
    np.testing.assert_array_equal(M.position, motion.point(2, (5.0, 0.0)).position)
    with pytest.raises(GeometryError, match="not defined"):
        motion.point("N")


def test_errors_bound_the_distance_from_the_closed_form() -> None:
    motion = simulate(four_bar(2.0, 1.0, 2.5, 2.5), TURN)
    closed = TiltedFourBar().positions(TURN)
    error = np.abs(motion.point(3, (2.5, 0.0)).position - closed.B[:, :2]).max(axis=1)
    assert (error <= motion.errors * motion.Lc).all() and (motion.errors < 1e-13).all()
