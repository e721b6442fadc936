# ruff: noqa: E501  (published reference values are kept on one line with all their digits)
"""Parallel platform against published values, 50 digits, companion eigenvalues, and the parity and sign test."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.triad.assembly_modes import assembly_modes, assembly_modes_batch, sextic
from graphsynth.kinematics.triad.leg import LegStatus, solve_leg
from graphsynth.systems.platform.parallel_platform import WORKING_MODES, ParallelPlatform

G1, MOCK = ParallelPlatform.g1(), ParallelPlatform.mock()
POSE = [1.2, 0.9, 0.15]


def turn_difference(a, b):
    return np.abs(np.angle(np.exp(1j * (np.asarray(a) - np.asarray(b)))))


def test_inverse_g1():
    got = G1.inverse(POSE)
    plus = (
        1.820203731367051943318523950600570,
        -2.644475043988912944478601459321876,
        -0.1619825351011604738549565239053447,
    )
    minus = (
        -0.5928070548217145930837666328227347,
        1.592038372673509987822015572933192,
        -2.813605694276900041039116987900029,
    )
    for mode, theta in zip(WORKING_MODES, got.theta):
        np.testing.assert_allclose(theta, np.where(mode > 0, plus, minus), rtol=1e-15)
    expected = (
        1.731926162377084907938701817454782,
        1.600085389488500706040382266571449,
        1.398936026680482256528965900931966,
    )
    np.testing.assert_allclose(got.S, expected, rtol=1e-15)
    assert got.reachable
    np.testing.assert_array_equal(got.theta[0], G1.inverse(POSE, sigma=(1, 1, 1)).theta)


def test_jacobian_g1():
    theta = G1.inverse(POSE, (1, 1, 1)).theta
    JX, JT = G1.jacobians(POSE, theta)
    expected = [
        [2.12799574088602436065988934656, -0.558241996602674339831294451479, 0.853160400343546224452751936226],
        [0.13747846161553902847266240655, 1.89501970242840081189769889589, 0.959675146799297669357489982668],
        [-1.42961620791971119512542007484, -1.53824494085085977555983024607, 0.756351158492199394202605228448],
    ]
    np.testing.assert_allclose(JX, expected, rtol=2e-15)
    np.testing.assert_allclose(JT, G1.inverse(POSE).S, rtol=2e-15)
    assert G1.determinant(POSE, theta) == pytest.approx(9.146291682729941930803887604932168, rel=2e-15)
    speed = G1.velocity_matrix(POSE, theta) @ [0.3, -0.7, 1.1]
    expected = (
        0.08785827374873766137951616616596935,
        0.7541669729645753132525458309300402,
        -0.3346758759285139590335113146468548,
    )
    np.testing.assert_allclose(speed, expected, rtol=5e-15)


def test_direct_g1():
    modes = G1.direct(G1.inverse(POSE, (1, 1, 1)).theta)
    expected = [
        (1.170779876116247460706011555938259, 1.013261618710664131601840694856533, -1.2006894643793908462956328293323),
        (1.2, 0.9, 0.15),
    ]
    # theta is rounded to a double: the condition number of JX is about 3
    np.testing.assert_allclose(modes.poses, expected, rtol=0, atol=3e-15)
    np.testing.assert_allclose(
        modes.determinants, [-9.399469232873439330251628961, 9.146291682729941930803887605], rtol=1e-14
    )
    assert modes.consistent
    assert not modes.near_double_root


def test_direct_g1_at_zero_and_sextic():
    modes = G1.direct([0.0, 0.0, 0.0])
    expected = [
        (
            2.201176574824335152036418315111726,
            0.8592023940960303889858882300747313,
            -0.1676478906740002300845393288613099,
        ),
        (
            2.172192970780247706912768147214596,
            0.7866243880900504876483939425547658,
            0.4780458846922180136167385177734372,
        ),
    ]
    np.testing.assert_allclose(modes.poses, expected, rtol=0, atol=3e-15)
    np.testing.assert_allclose(
        modes.determinants, [-5.160695960119047064362753245, 5.193397665195021007556334361], rtol=1e-14
    )
    for pose in modes.poses:
        np.testing.assert_array_equal(G1.working_mode(pose, [0, 0, 0]), (-1, -1, 1))
    s = sextic(G1.elbows([0.0, 0.0, 0.0]), np.array(G1.b), np.array(G1.l2))
    exact = (430.8263188125, -298.873816625 + 45.734591625j, 93.0164815 - 29.070855375j, -10.33986 + 5.03622j)
    np.testing.assert_allclose(np.array(s.g, dtype=complex), exact, rtol=1e-14)


def test_sextic_coefficients_g1():
    theta = G1.inverse(POSE, (1, 1, 1)).theta
    s = sextic(G1.elbows(theta), np.array(G1.b), np.array(G1.l2))
    exact = (
        265.2436854688131407288280925,
        -168.4028280717034567525427936 - 96.10109222838240123892954345j,
        34.65533079958678435094954576 + 58.40102854648555975454981687j,
        -0.178928024664161842255185092 - 8.830889447741458430566235101j,
    )
    got = np.array(s.g, dtype=complex)
    np.testing.assert_allclose(got, exact, rtol=1e-14)
    roots = np.roots([got[3], got[2], got[1], got[0], *np.conj(got[1:])])
    off = sorted(abs(roots[np.abs(np.abs(roots) - 1) > 1e-6]))[:2]
    np.testing.assert_allclose(off, [0.36739122567491978175, 0.3754187226690027078], rtol=1e-12)


def test_mock_home():
    theta = MOCK.inverse([0, 0, 0], (-1, -1, -1)).theta
    expected = (
        0.23980466638997102745140399634148,
        2.3341997687831665197598329185278,
        -1.8545904360032246648570249258449,
    )
    assert turn_difference(theta, expected).max() < 5e-16
    np.testing.assert_allclose(MOCK.inverse([0, 0, 0]).S, 5400.0, rtol=1e-15)
    assert MOCK.determinant([0, 0, 0], theta) == pytest.approx(-111974400 * math.sqrt(3), rel=2e-15)
    J = MOCK.velocity_matrix([0, 0, 0], theta)
    exact = [
        [-7.1253866082107153671847253656753, -21.674613391789284632815274634325, 28.8],
        [29.141531628991833026795227317685, -20.741531628991833026795227317685, -8.4],
        [-25 / 72] * 3,
    ]
    np.testing.assert_allclose(J, exact, rtol=3e-15)
    scaled = MOCK.scaled_velocity_matrix([0, 0, 0], theta, 45.0)
    values = np.linalg.svd(scaled, compute_uv=False)
    np.testing.assert_allclose(values, [math.sqrt(2 / 3)] * 2 + [25 * math.sqrt(3) / 72], rtol=2e-15)
    assert values[0] / values[2] == pytest.approx(1.3576450198781712468496211752413, rel=3e-15)


def test_mock_modes_at_home():
    theta = MOCK.inverse([0, 0, 0], (-1, -1, -1)).theta
    modes = MOCK.direct(theta)
    assert len(modes) == 2
    np.testing.assert_allclose(modes.poses[:, 2], [0, 1.500473562884840063348944637207295], rtol=0, atol=1e-15)
    assert np.abs(modes.poses[:, :2]).max() < 5e-14  # 4e-16 of the 105 mm of the base
    np.testing.assert_allclose(modes.determinants, [-193945349.94704049, 193945349.94704049], rtol=1e-14)
    for pose in modes.poses:
        np.testing.assert_array_equal(MOCK.working_mode(pose, theta), (-1, -1, -1))


@pytest.mark.parametrize(
    ("platform", "counts"), [(G1, (147683, 45069, 4973, 2275)), (MOCK, (174206, 25561, 233, 0))], ids=["G1", "MOCK"]
)
def test_distribution_of_the_number_of_modes(platform, counts):
    theta = np.random.default_rng(9).uniform(-math.pi, math.pi, (200000, 3))
    batch = platform.direct_batch(theta)
    number = batch.counts.copy()
    flagged = np.flatnonzero(batch.near_double_root)
    assert flagged.size < 10
    for problem in flagged:  # a flagged answer is not complete: escalate
        number[problem] = len(platform.direct(theta[problem]))
    np.testing.assert_array_equal(np.bincount(number, minlength=7)[::2], counts)
    assert batch.consistent[~batch.near_double_root].all()
    closure = platform.closure(batch.poses, theta[batch.problem])
    assert np.abs(closure).max() < 1e-11 * max(platform.l2) ** 2


def _reference_leg(l1, l2, u, v, sigma):
    with mp.workdps(60):
        l1, l2, u, v = map(mp.mpf, (l1, l2, u, v))
        rho2 = u * u + v * v
        product = ((l1 + l2) ** 2 - rho2) * (rho2 - (l1 - l2) ** 2)
        S, C = mp.sqrt(product), rho2 + l1**2 - l2**2
        return mp.atan2(v * C + sigma * u * S, u * C - sigma * v * S)


EXTREME_LEGS = [
    (1, 1e6, 1000000.3, 0), (1e6, 1, 1000000.3, 0.2), (1, 1e-6, 0.8, 0.6), (1e-6, 1, 0.6, 0.8), (1, 1, 1e-9, 0),
    (1, 1, 2, 0), (1, 0.5, 0.5, 0), (1, 1, 1.999999999999, 0), (1, 0.5, 0.500000000001, 0), (3, 4, -3, 4),
    (1, 1, -1, 1), (1, 1, -1, 1.0000000001), (3, 4, -5, 0), (45, 60, 75, 0),
]  # fmt: skip


@pytest.mark.parametrize(("l1", "l2", "u", "v"), EXTREME_LEGS)
@pytest.mark.parametrize("sigma", [1, -1])
def test_extreme_legs(l1, l2, u, v, sigma):
    leg = solve_leg(u, v, l1, l2)
    exact = _reference_leg(l1, l2, u, v, sigma)
    if leg.status > LegStatus.BOUNDARY:  # (1, 1e-6, 0.8, 0.6): rho is 1 up to rounding, inside the reach
        pytest.fail(f"status {leg.status}")
    assert float(turn_difference(float(leg.angle(sigma)), float(exact))) <= 4.5e-16


def test_leg_out_of_reach():
    leg = solve_leg(2.0000001, 0.0, 1.0, 1.0)
    assert leg.status == LegStatus.TOO_FAR
    assert float(leg.deficit) == pytest.approx(2.0000001 - 2.0, rel=1e-12)
    assert np.isnan(leg.angle(1))
    near = solve_leg(0.25, 0.0, 1.0, 0.5)
    assert near.status == LegStatus.TOO_NEAR
    assert float(near.deficit) == 0.25
    assert float(solve_leg(1.5, 0.0, 1.0, 1.0).deficit) == -0.5


@pytest.mark.parametrize(
    ("l1", "l2", "u", "v", "status"),
    [
        (1, 1, 0, 0, LegStatus.FREE), (0, 1, 0.6, 0.8, LegStatus.TOO_FAR), (0, 1, 1, 0, LegStatus.FREE),
        (0, 0, 0, 0, LegStatus.FREE), (1, 0, 1, 0, LegStatus.BOUNDARY), (1, 0, 0.5, 0, LegStatus.TOO_NEAR),
        (0, 1, 2, 0, LegStatus.TOO_FAR), (1, 1, 2, 0, LegStatus.BOUNDARY), (1, 0.5, 0.5, 0, LegStatus.BOUNDARY),
    ],
)  # fmt: skip
def test_special_legs(l1, l2, u, v, status):
    assert solve_leg(u, v, l1, l2).status == status
    if (u, v) == (0.6, 0.8):  # the status is exact for the given doubles, not for the decimals
        with mp.workdps(60):
            assert mp.mpf(0.6) ** 2 + mp.mpf(0.8) ** 2 > 1


@pytest.mark.long
@settings(max_examples=300, deadline=None)
@given(
    st.floats(-6, 6), st.floats(-6, 6), st.floats(1e-90, 1), st.floats(-math.pi, math.pi), st.sampled_from((1, -1)),
    st.sampled_from((1.0, 1e-100, 1e100)),
)  # fmt: skip
def test_legs_against_sixty_digits(log1, log2, t, direction, sigma, unit):
    l1, l2 = 10**log1, 10**log2
    rho = abs(l1 - l2) + t * (l1 + l2 - abs(l1 - l2))
    u, v = rho * math.cos(direction), rho * math.sin(direction)
    leg = solve_leg(u * unit, v * unit, l1 * unit, l2 * unit)
    with mp.workdps(60):
        rho2 = mp.mpf(u * unit) ** 2 + mp.mpf(v * unit) ** 2
        P1 = (mp.mpf(l1 * unit) + mp.mpf(l2 * unit)) ** 2 - rho2
        P2 = rho2 - (mp.mpf(l1 * unit) - mp.mpf(l2 * unit)) ** 2
    if min(P1, P2) < 0:
        assert leg.status in (LegStatus.TOO_FAR, LegStatus.TOO_NEAR)
        return
    assume(leg.status == LegStatus.REACHABLE)
    exact = float(_reference_leg(l1 * unit, l2 * unit, u * unit, v * unit, sigma))
    assert float(turn_difference(float(leg.angle(sigma)), exact)) <= 9e-16


@settings(max_examples=100, deadline=None)
@given(st.floats(0.4, 2), st.floats(0.2, 1.6), st.floats(-3.1, 3.1), st.integers(0, 7))
def test_round_trip_and_working_mode(x, y, alpha, mode):
    sigma = WORKING_MODES[mode]
    solution = G1.inverse([x, y, alpha], sigma)
    assume(solution.reachable and solution.S.min() > 1e-3)
    theta = solution.theta
    np.testing.assert_array_equal(G1.working_mode([x, y, alpha], theta), sigma)
    np.testing.assert_allclose(G1.jacobians([x, y, alpha], theta)[1], sigma * solution.S, atol=1e-14, rtol=0)
    assume(abs(float(G1.determinant([x, y, alpha], theta))) > 1e-2)
    modes = G1.direct(theta)
    assert modes.consistent
    assert len(modes) % 2 == 0
    error = np.abs(modes.poses - [x, y, alpha])
    error[:, 2] = turn_difference(modes.poses[:, 2], alpha)
    condition = np.linalg.cond(G1.jacobians([x, y, alpha], theta)[0])
    assert error.max(axis=1).min() < 1e-14 * condition


@settings(max_examples=60, deadline=None)
@given(st.tuples(*[st.floats(-3.1, 3.1)] * 3))
def test_derivatives(theta):
    """JX and JT against 50-digit differentiation of the closure."""
    pose = [0.7, 0.4, 1.1]
    JX, JT = G1.jacobians(pose, theta)

    def closure(k, x, y, a, t):
        F = mp.mpc(x, y) + mp.expj(a) * mp.mpc(G1.b[k])
        A = mp.mpc(G1.D[k]) + mp.mpf(G1.l1[k]) * mp.expj(t)
        return abs(F - A) ** 2

    with mp.workdps(40):
        for k in range(3):
            point = (*map(mp.mpf, pose), mp.mpf(theta[k]))
            for j in range(3):
                order = tuple(int(i == j) for i in range(4))
                exact = mp.diff(lambda x, y, a, t, k=k: closure(k, x, y, a, t), point, order)
                assert JX[k, j] == pytest.approx(float(exact), rel=1e-14, abs=2e-15)
            exact = mp.diff(lambda t, k=k, at=point: closure(k, *at[:3], t), point[3])
            assert JT[k] == pytest.approx(float(exact), rel=1e-14, abs=2e-15)


def test_batch_count_against_companion_eigenvalues():
    rng = np.random.default_rng(4)
    anchors = rng.normal(size=(400, 3)) + 1j * rng.normal(size=(400, 3))
    vertices = rng.normal(size=(400, 3)) + 1j * rng.normal(size=(400, 3))
    lengths = rng.uniform(0.3, 3, (400, 3))
    batch = assembly_modes_batch(anchors, vertices, lengths)
    for k in range(400):
        g = np.array(sextic(anchors[k], vertices[k], lengths[k]).g, dtype=complex)
        roots = np.roots([g[3], g[2], g[1], g[0], *np.conj(g[1:])])
        if not batch.near_double_root[k]:
            assert batch.counts[k] == np.sum(np.abs(np.abs(roots) - 1) < 1e-6)
    assert batch.consistent[~batch.near_double_root].all()


NEAR = [
    (1e-3, (1.993963026206228016672296632595370356845, 3.883339916240559650861563252219424055145, -0.02522615783274709427062438503457063163104)),
    (1e-6, (1.993977033694318608277538269252194065751, 3.883435523856570219287331300269557275857, -0.02534662599308213334215831417781596377881)),
    (1e-9, (1.99397704729682579100913434633926119239, 3.883435618987425947731696729011853971623, -0.0253467469262519167982482485531679969043)),
    (1e-12, (1.993977047310427893273409240925632591882, 3.883435619082556326758317157326704979355, -0.02534674704718555144288409189953178994069)),
]  # fmt: skip
ALPHA_S = -0.491174039432700716436386522579764691645742


@pytest.mark.parametrize(("eps", "theta"), NEAR)
def test_near_singular(eps, theta):
    """float64 angles: the modes are determined to about 1e-16 / eps; the flag must be raised and acted upon."""
    modes = G1.direct(theta)
    assert modes.near_double_root == modes.escalated
    if eps >= 1e-6:
        assert len(modes) == 2
        assert modes.consistent
        twin = {1e-3: -0.4921764773997155301383646838947536089142, 1e-6: -0.4911750416750986847740103988954935308036}[
            eps
        ]
        np.testing.assert_allclose(modes.poses[:, 2], [twin, ALPHA_S + eps], rtol=0, atol=1e-15 / eps + 1e-16)
    else:
        assert modes.escalated
        # independent: minimum of G in 60 digits for the very same float64 angles
        assert len(modes) == _count_by_minimum(theta)
        if len(modes):
            assert np.abs(modes.poses[:, 2] - ALPHA_S).max() < 2e-7
    if eps == 1e-3:
        assert not modes.near_double_root


def _count_by_minimum(theta):
    """Number of modes near ALPHA_S: the closure with the third leg left out, solved for the length of the third."""
    with mp.workdps(60):
        A = [mp.mpc(D) + mp.mpf(r) * mp.expj(mp.mpf(t)) for D, r, t in zip(G1.D, G1.l1, theta)]
        b, l2 = [mp.mpc(v) for v in G1.b], [mp.mpf(v) for v in G1.l2]

        def third(alpha):  # legs 1 and 2 fix p as a crossing of two circles
            c = [A[k] - mp.expj(alpha) * b[k] for k in (0, 1)]
            d = c[1] - c[0]
            along = (abs(d) ** 2 + l2[0] ** 2 - l2[1] ** 2) / (2 * abs(d))
            across = mp.sqrt(l2[0] ** 2 - along**2)
            options = [c[0] + d / abs(d) * mp.mpc(along, s * across) for s in (1, -1)]
            p = min(options, key=lambda q: abs(q - mp.mpc(1.2, 0.9)))
            return abs(p + mp.expj(alpha) * b[2] - A[2]) ** 2 - l2[2] ** 2

        low, high = mp.mpf(ALPHA_S) - mp.mpf("1e-4"), mp.mpf(ALPHA_S) + mp.mpf("1e-4")
        stationary = mp.findroot(lambda a: mp.diff(third, a), (low + high) / 2)
        extreme, end = third(stationary), third(high)
        assert third(low) * end > 0
        return 2 if extreme * end < 0 else 0


def test_self_motion_and_degenerate_modes():
    corner = np.exp(2j * np.pi * np.arange(3) / 3)
    congruent = assembly_modes(3 + corner, corner, [0.5, 0.5, 0.5])
    assert "translates" in congruent.self_motion
    assert len(congruent) == 0
    assert not congruent.consistent
    two = assembly_modes([0, 2, 1 + 2j], [0, 0, 0.5], [1.5, 1.5, 1.5])
    assert "degree drops" in two.note
    assert two.consistent
    none = assembly_modes([0, 100, 50j], [0, 1, 1j], [1, 1, 1])
    assert len(none) == 0
    assert none.consistent


def test_delta_vanishing_at_a_real_mode():
    """e_2 parallel to e_3 at alpha = 0 with N = 0: two modes share the orientation (theory/platform-direct 3)."""
    A = np.array([0, 2, 5], dtype=complex)
    b = np.array([0, 1, 2], dtype=complex)  # e_2 = -1, e_3 = -3 at alpha = 0
    Q = 0.3 + 1.1j
    lengths = [abs(Q), abs(Q - 1), abs(Q - 3)]
    modes = assembly_modes(A, b, lengths)
    at_zero = modes.poses[np.abs(modes.poses[:, 2]) < 1e-9]
    expected = [(Q.real, -Q.imag), (Q.real, Q.imag)]
    np.testing.assert_allclose(at_zero[np.argsort(at_zero[:, 1]), :2], expected, rtol=0, atol=1e-12)


def test_scale_invariance():
    theta = np.array([0.3, -1.2, 2.0])
    base = G1.direct_batch(np.random.default_rng(1).uniform(-3, 3, (300, 3)))
    for unit in (1e-6, 1e6):
        scaled = ParallelPlatform(
            tuple(np.array(G1.D) * unit), tuple(np.array(G1.b) * unit), tuple(np.array(G1.l1) * unit),
            tuple(np.array(G1.l2) * unit),
        )  # fmt: skip
        other = scaled.direct_batch(np.random.default_rng(1).uniform(-3, 3, (300, 3)))
        np.testing.assert_array_equal(other.counts, base.counts)
        np.testing.assert_allclose(other.poses[:, 2], base.poses[:, 2], rtol=0, atol=1e-10)
    assert len(G1.direct(theta)) == len(G1.direct(theta + math.tau))


def test_statics_balances_power():
    theta = G1.inverse(POSE, (1, -1, 1)).theta
    wrench, rate = np.array([3.0, -2.0, 0.5]), np.array([0.2, 0.4, -0.3])
    power = wrench @ (G1.velocity_matrix(POSE, theta) @ rate)
    assert G1.rocker_torques(POSE, theta, wrench) @ rate == pytest.approx(power, rel=1e-14)


def test_unreachable_pose_keeps_the_other_legs():
    got = G1.inverse([1.2, 2.9, 0.0])
    assert not got.reachable
    assert np.isnan(got.theta[0]).tolist() == (got.status > LegStatus.BOUNDARY).tolist()
    assert (got.deficit > 0).tolist() == (got.status > LegStatus.BOUNDARY).tolist()


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"l1": (1, -1, 1)}, "leg 2"),
        ({"l2": (1, 1, math.nan)}, "leg 3"),
        ({"D": (0, math.inf, 1)}, "leg 2"),
        ({"b": (0, 1)}, "three"),
    ],
)
def test_bad_platform(change, text):
    arguments = {"D": G1.D, "b": G1.b, "l1": G1.l1, "l2": G1.l2, **change}
    with pytest.raises(GeometryError, match=text):
        ParallelPlatform(**arguments)
    with pytest.raises(GeometryError, match="nan"):
        G1.inverse([math.nan, 0, 0])
    with pytest.raises(GeometryError, match="sigma"):
        G1.inverse(POSE, sigma=(1, 0, 1))


# --- bad input: one sentence, whatever it is


@pytest.mark.parametrize(
    "points", ["abc", (1, 2), 5, (0, 1, "x"), (0, 1, (1.0, 2.0)), (0, 1, np.nan), None, (0, 1, np.inf)]
)
@pytest.mark.parametrize("name", ["D", "b"])
def test_points_that_are_none_are_refused(points: object, name: str) -> None:
    good = {"D": (0, 2.5 + 0.2j, 1.1 + 2.3j), "b": (-0.4 - 0.25j, 0.45 - 0.3j, 0.05 + 0.5j), "l1": 1.0, "l2": 1.0}
    with pytest.raises(GeometryError, match=name):
        ParallelPlatform(**{**good, name: points})  # type: ignore[arg-type]


@pytest.mark.parametrize("lengths", ["abc", (1.0, 2.0), (1.0, -1.0, 2.0), None, (1.0, 1.0, np.nan), 1j])
def test_lengths_that_are_none_are_refused(lengths: object) -> None:
    with pytest.raises(GeometryError, match="l1"):
        ParallelPlatform((0, 2.5 + 0.2j, 1.1 + 2.3j), (-0.4j, 0.45, 0.5j), lengths, 1.0)  # type: ignore[arg-type]


@pytest.mark.parametrize("wrong", [[0.0, 0.0], [0.0] * 4, 0.0, [[0.0, 0.0]], []])
def test_shapes_that_do_not_fit_are_refused(wrong: object) -> None:
    platform = ParallelPlatform.g1()
    for call in (platform.inverse, platform.vertices, platform.direct, platform.direct_batch):
        with pytest.raises(GeometryError, match="shape"):
            call(wrong)  # type: ignore[operator]
    for other in (platform.jacobians, platform.closure, platform.determinant, platform.velocity_matrix):
        with pytest.raises(GeometryError, match="shape"):
            other(wrong, [0.0, 0.0, 0.0])
        with pytest.raises(GeometryError, match="shape"):
            other([0.0, 0.0, 0.0], wrong)


@pytest.mark.parametrize("sigma", [1, -1])
@pytest.mark.parametrize("unit", [2.0**-900, 2.0**-500, 2.0**500, 2.0**900])
def test_angles_of_legs_whose_squares_are_no_doubles(unit: float, sigma: int) -> None:
    """Squared lengths overflow and underflow; the angle is that of the leg of ordinary size."""
    for l1, l2, u, v in EXTREME_LEGS[:4]:
        leg = solve_leg(u * unit, v * unit, l1 * unit, l2 * unit)
        assert leg.status == LegStatus.REACHABLE
        assert float(turn_difference(float(leg.angle(sigma)), float(_reference_leg(l1, l2, u, v, sigma)))) <= 4.5e-16


@pytest.mark.parametrize("rho", [1e-10, 1e-150, 1e-200, 1e-300, 1e-307])
def test_vertex_almost_on_the_pivot(rho: float) -> None:
    """Equal lengths: the arm stands across the direction of the vertex however near that is."""
    leg = solve_leg(rho, 0.0, 1.0, 1.0)
    assert leg.status == LegStatus.REACHABLE
    for sigma in (1, -1):
        assert float(leg.angle(sigma)) == pytest.approx(sigma * math.acos(rho / 2.0), rel=3e-16)


def test_fourfold_root_is_said_to_be_undecided() -> None:
    """Similar collinear triangles: more digits do not help, so the search stops at once; certificates decide it."""
    modes = assembly_modes([0, 12, 6], [0, 6, 3], [5, 5, 4])
    assert len(modes) == 0 and modes.near_double_root and modes.escalated and not modes.consistent
    assert "not decided" in modes.self_motion
