"""Poses with exact closure in space: derivatives, least factor, proofs against links placed by rotation matrices."""

import math

import mpmath
import numpy as np
import pytest
from coupled_oracles import four_bar
from space_oracles import case, joint_limits, placed, rotation
from spatial_oracle import spatial

from graphsynth import Mechanism, simulate
from graphsynth.intervals import Interval
from graphsynth.intervals.balls import Balls, exact
from graphsynth.jamming.joints import RIGID, SPHERICAL, JointLimits, Misalignment
from graphsynth.jamming.joints.program import problem
from graphsynth.jamming.space.closure import Closure, ball
from graphsynth.jamming.space.model import Seat, SpaceJoint, SpaceModel
from graphsynth.jamming.space.optimum import least_scale
from graphsynth.jamming.space.plane import in_space, start
from graphsynth.jamming.space.pose import prove_pose
from graphsynth.jamming.space.proof import _positive, shift


@pytest.fixture(autouse=True)
def digits():
    """Fifty digits for every test, whichever runs before it."""
    with mpmath.workdps(50):
        yield


def posed(limits, tilt, u=0.7, lengths=(2.0, 1.0, 2.5, 2.5)):
    """A four-bar in space and its plane coordinates at one input."""
    mechanism = four_bar(*lengths)
    motion = simulate(mechanism, [u, u + 0.01])
    model = in_space(problem(mechanism, limits, tilt))
    return model, start(model, mechanism, motion.poses[0])


def general(rng):
    """A four-bar with slides, and coordinates anywhere."""
    model, q = posed(JointLimits(0.1, 0.05), Misalignment(0, 1, 0.1, 0.3))
    return model, q + 0.3 * rng.standard_normal(q.shape)


def test_derivatives_are_those_of_differences():
    rng = np.random.default_rng(0)
    model, q = general(rng)
    closure, h = Closure(model, False), 1e-6
    by = rng.standard_normal((1, 6))

    def both(x):
        loops = closure.loops(x[None])
        return closure.values(loops)[0], closure.jacobian(loops)[0]

    steps = h * np.eye(len(q))
    J = closure.jacobian(closure.loops(q[None]))[0]
    assert np.allclose(J.T, [(both(q + e)[0] - both(q - e)[0]) / (2 * h) for e in steps], atol=1e-8)
    H = closure.hessian(closure.loops(q[None]), by)[0]
    assert np.allclose(H, [(by[0] @ (both(q + e)[1] - both(q - e)[1])) / (2 * h) for e in steps], atol=1e-7)
    assert np.array_equal(H, H.T)


def test_balls_hold_values_and_derivatives_over_a_box():
    rng = np.random.default_rng(1)
    model, q = general(rng)
    floats, enclosed = Closure(model, False), Closure(model, True)
    by = rng.standard_normal((1, 6))
    radius = rng.choice([0.0, 1e-9, 0.03], q.shape)
    loops = enclosed.loops(Balls(q[None], radius[None]))
    held = enclosed.values(loops), enclosed.jacobian(loops), enclosed.hessian(loops, exact(by))
    largest = 0.0
    for _ in range(60):
        own = floats.loops((q + radius * rng.choice([-1.0, 1.0, rng.uniform(-1, 1)], q.shape))[None])
        found = floats.values(own), floats.jacobian(own), floats.hessian(own, by)
        for value, enclosure in zip(found, held):
            assert (np.abs(value - enclosure.mid) <= enclosure.rad + 1e-13).all()
        largest = max(largest, float((np.abs(found[0] - held[0].mid) / held[0].rad).max()))
    assert largest > 0.1  # not much wider than needed: the test can fail


def test_the_plane_mechanism_closes_and_a_chart_is_a_rotation():
    model, q = posed(JointLimits(0.1, 0.05), Misalignment(0, 1, 0.0))
    closure = Closure(model, False)
    assert np.abs(closure.values(closure.loops(q[None]))).max() < 1e-14
    rng = np.random.default_rng(2)
    model, q = general(rng)
    misfit = placed(model, [mpmath.mpf(v) for v in q])
    values = Closure(model, False).values(Closure(model, False).loops(q[None]))
    assert 0.1 < float(misfit) / np.abs(values).max() < 10.0  # both see that it does not close


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_least_factor_is_that_of_a_search_with_rotation_matrices(seed):
    rng = np.random.default_rng([seed, 4])
    mechanism, motion, tilt, limits, _ = case(rng, 4)
    model = in_space(problem(mechanism, joint_limits(limits, 1.0, tilt), tilt))
    found = least_scale(Closure(model, False), start(model, mechanism, motion.poses[0]))
    least, missed = spatial(mechanism, motion.poses[0], tilt, limits).least_factor()
    assert missed < 1e-9 and found.missed < 1e-13
    assert found.scale == pytest.approx(least, rel=1e-8)


def one_bearing(lengths, alpha, limit, u=math.pi / 2):
    joints = {(0, 1): RIGID, (1, 2): SPHERICAL, (2, 3): JointLimits(limit), (0, 3): RIGID}
    return posed(joints, Misalignment(0, 1, alpha), u, lengths)


@pytest.mark.parametrize(
    ("lengths", "alpha", "away"),
    [
        ((2, 1, 2.5, 2.5), 1 / 30, 1e-6),
        pytest.param((2, 1, 2.5, 2.5), 0.1, 1e-6, marks=pytest.mark.slow),
        pytest.param((1, 3, 2, 3.5), 0.1, 1e-6, marks=pytest.mark.slow),
    ],
)
def test_one_bearing_has_its_closed_form(lengths, alpha, away):
    """Spherical at A, rigid at C: the bearing at B tilts by asin(l2 / l3 sin(alpha) |sin u|), roll left free."""
    u = 1.3
    wanted = math.asin(lengths[1] / lengths[2] * math.sin(alpha) * math.sin(u))
    model, q = one_bearing(lengths, alpha, wanted, u)
    assert least_scale(Closure(model, False), q).scale == pytest.approx(1.0, rel=1e-9)
    for side in (1.0, -1.0):
        model, q = one_bearing(lengths, alpha, wanted * (1.0 + side * away), u)
        assert prove_pose(model, q).state == side


@pytest.mark.parametrize(("lengths", "alpha"), [
    ((2, 1, 2.5, 2.5), 0.3), pytest.param((1, 3, 2, 3.5), 0.4, marks=pytest.mark.slow)])  # fmt: skip
def test_large_tilts_at_a_spherical_joint_are_decided(lengths, alpha):
    wanted = math.asin(lengths[1] / lengths[2] * math.sin(alpha) * math.sin(1.3))
    for away in (1e-6, 0.01, -1e-6, -0.01, -0.5):
        model, q = one_bearing(lengths, alpha, wanted * (1.0 + away), 1.3)
        assert least_scale(Closure(model, False), q).scale == pytest.approx(1.0 / (1.0 + away), rel=1e-8)
        assert prove_pose(model, q).state == (1 if away > 0.0 else -1)


def decided(rng, links, away):
    """A random mechanism with limits so far from the verge, what is proved, and limits by pair."""
    mechanism, motion, tilt, limits, _ = case(rng, links)
    model = in_space(problem(mechanism, joint_limits(limits, 1.0, tilt), tilt))
    q = start(model, mechanism, motion.poses[0])
    scale = least_scale(Closure(model, False), q).scale * (1.0 + away)
    model = in_space(problem(mechanism, joint_limits(limits, scale, tilt), tilt))
    own = {pair: (t * scale, s * scale) for pair, (t, s) in limits.items()}
    return model, prove_pose(model, q), spatial(mechanism, motion.poses[0], tilt, own)


def refined(model, q):
    """Largest misfit of the joints at the closure nearest to q, 50 digits, and by how much limits are kept."""
    closure = Closure(model, False)
    x = [mpmath.mpf(v) for v in q]
    for _ in range(4):
        floats = np.array([float(v) for v in x])
        J = closure.jacobian(closure.loops(floats[None]))[0][:, : model.size]
        values = np.array([float(v) for v in exact_values(model, x)])
        for k, step in enumerate(np.linalg.lstsq(J, values, rcond=1e-12)[0]):
            x[k] -= mpmath.mpf(step)
    room = [2 * mpmath.atan(mpmath.sqrt(sum(x[c] ** 2 for c in b.columns)) / 2) if b.angular
            else abs(x[b.columns[0]]) for b in model.bounds]  # fmt: skip
    return placed(model, x), max(float(r / mpmath.mpf(b.limit)) for r, b in zip(room, model.bounds))


def exact_values(model, x):
    """Left sides of one loop in 50 digits, from the places of the links."""
    from space_oracles import inverse, moved, product

    values = []
    for path in model.paths:
        at = (mpmath.eye(3), mpmath.matrix(3, 1))
        first = None
        for k, forward in path:
            motion = moved(model, k, x)
            at = product(at, motion if forward else inverse(motion))
            first = first or k
        R, t = at
        values += [(R[2, 1] - R[1, 2]) / 2, (R[0, 2] - R[2, 0]) / 2, (R[1, 0] - R[0, 1]) / 2, *t]
    return values


@pytest.mark.parametrize(("links", "count"), [(4, 1), *(
    pytest.param(links, count, marks=pytest.mark.slow) for links, count in ((4, 100), (6, 60), (8, 40)))])  # fmt: skip
def test_proofs_of_random_mechanisms(links, count):
    """No proof is wrong, and most are decided where the limit is 1e-6 or further away."""
    undecided = 0
    for seed in range(count):
        rng = np.random.default_rng([seed, links])
        away = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-6.0, -0.5)
        model, proof, judge = decided(rng, links, away)
        undecided += proof.state == 0
        if proof.state == 1:
            misfit, most = refined(model, proof.optimum.q)
            assert misfit < 1e-20 and most < 1.0
        if proof.state == -1 and (links == 4 or seed % 10 == 0):
            least, missed = judge.least_factor(3)
            assert least > 1.0 - 1e-8 or missed > 1e-9
    assert undecided <= 0.02 * count


def spherical(limit, off):
    """Four axes through the origin, joints on the unit sphere; one axis is off, and the driver turned a little."""
    rng = np.random.default_rng(5)
    joints = []
    for k in range(4):
        turn = rng.uniform(-0.6, 0.6, 3)
        place = rotation(turn) * mpmath.matrix([0, 0, 1])
        point = tuple(float(v) for v in place)
        wrong = tuple(turn + (off if k == 2 else 0.0) * np.array([1.0, 0.0, 0.0]))
        seats = Seat(point, tuple(turn)), Seat(point, wrong)
        joints.append(SpaceJoint(k, (k + 1) % 4, *seats, JointLimits(limit), driven=k == 0))
    model = SpaceModel(tuple(joints), 4)
    q = np.zeros(model.width)
    q[-1] = 0.05
    return model, q


@pytest.mark.slow
def test_a_spherical_linkage_closes_by_nature_and_binds_when_an_axis_is_off():
    model, q = spherical(1e-6, 0.0)
    assert least_scale(Closure(model, False), q).scale < 1e-2 and prove_pose(model, q).state == 1
    q = least_scale(Closure(model, False), q).q  # the reference of a jam is a closure of one's own
    model = spherical(0.01, 0.01)[0]
    scale = least_scale(Closure(model, False), q).scale
    assert 0.1 < scale < 1.0
    for away, state in ((1.001, 1), (0.99, -1)):
        assert prove_pose(spherical(0.01 * scale * away, 0.01)[0], q).state == state


def test_all_rigid_jams_and_no_misalignment_is_free():
    model, q = posed(RIGID, Misalignment(0, 1, 0.01))
    assert least_scale(Closure(model, False), q).scale == math.inf and prove_pose(model, q).state == -1
    model, q = posed(RIGID, Misalignment(0, 1, 0.0))
    assert model.rows == ((2, 3, 4),) and prove_pose(model, q).state == 1
    model, q = posed(JointLimits(0.01), Misalignment(0, 1, 0.0))
    assert prove_pose(model, q).state == 1


@pytest.mark.slow
def test_a_limit_that_touches_is_never_wrong():
    """Limits a few units in the last place beside the closed form; the box of a jam must hold the spherical tilt."""
    u = math.pi / 2
    edge = mpmath.asin(mpmath.mpf(2) / 5 * mpmath.sin(mpmath.mpf(0.1)) * mpmath.sin(mpmath.mpf(u)))
    limit = float(edge)
    for _ in range(2):
        limit = math.nextafter(limit, 1.0)
    for _ in range(2):
        model, q = one_bearing((2, 1, 2.5, 2.5), 0.1, limit, u)
        assert prove_pose(model, q, boxes=8).state in (0, 1 if mpmath.mpf(limit) > edge else -1)
        limit = limit * (1.0 - 1e-15)


def test_a_shifted_matrix_is_proved_positive():
    rng = np.random.default_rng(3)
    for n in (1, 4, 12):
        A = rng.standard_normal((n, n))
        A = A + A.T
        least = float(np.linalg.eigvalsh(A)[0])
        assert not _positive(A - (least + 1e-12) * np.eye(n)) or least >= 0.0
        assert _positive(A - (least - 1e-9) * np.eye(n))
        cost = shift(A, np.zeros((n, n)), np.ones(n)).sum()
        assert math.isfinite(cost) and cost >= max(0.0, -least)
        assert shift(A - (least - 1.0) * np.eye(n), np.zeros((n, n)), np.ones(n)).sum() < 1e-9
        wider = shift(A - (least - 1.0) * np.eye(n), np.full((n, n), 2.0 / n), np.ones(n)).sum()
        assert wider >= 0.5  # members with an eigenvalue below -1 + ... are in the ball
    assert shift(np.full((2, 2), np.nan), np.zeros((2, 2)), np.ones(2)).sum() == math.inf


def test_guides_are_in_space_too():
    crank = Mechanism.slider_crank(1.0, 3.0)
    motion = simulate(crank, [0.8, 0.81])
    tilt = Misalignment(crank.drivers[0].base, crank.drivers[0].link, 0.02)
    from graphsynth.jamming.joints import SlideLimits

    limits = {j.pair: SlideLimits(0.05, 0.05, 0.02) if j.kind == "P" else JointLimits(0.05, 0.02) for j in crank.joints}
    model = in_space(problem(crank, limits, tilt))
    q = start(model, crank, motion.poses[0])
    flat = in_space(problem(crank, limits, Misalignment(tilt.base, tilt.link, 0.0)))
    closure = Closure(flat, False)
    assert np.abs(closure.values(closure.loops(q[None]))).max() < 1e-12
    assert prove_pose(model, q).state == 1


def test_constants_are_enclosed():
    values = ball(Interval("0.1"))
    assert values.mid == 0.1 and 0.0 < values.rad < 2e-17
