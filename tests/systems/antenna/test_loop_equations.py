"""The twelve loop equations: roots, Jacobian, false roots, singular coordinates of the printed form, rates."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.systems.antenna import PointingMechanism
from graphsynth.systems.antenna.loop_equations import loop_equations

ART = PointingMechanism()
ORDERS = ("YX", "XY")
# theory/values-of-the-antenna 1, degrees, at 40/40, order YX
UNKNOWNS = [
    25.867632282271907632, 16.557298688788906387, -41.891959625006658758, -3.3179772343770728488,
    4.9217113440515791783, 23.712080016484991565, 21.73389545342156182, 22.195371224626922341,
    -37.914219301819878608, -6.7752917335014975597, 5.2500883662822761811, 22.44785725383752382,
]  # fmt: skip


def grid(count, span, seed=0):
    return np.random.default_rng(seed).uniform(-span, span, (2, count))


def test_all_twelve_unknowns():
    phi = np.radians(40.0)
    got = ART.passive_angles(ART.poses(phi, phi))
    np.testing.assert_allclose(np.degrees(got.x), UNKNOWNS, rtol=0, atol=1e-13)
    assert got.margin == pytest.approx(math.cos(math.radians(UNKNOWNS[7])), rel=1e-12)
    solved = ART.solve_loops(phi, phi)
    np.testing.assert_allclose(np.degrees(solved.x), UNKNOWNS, rtol=0, atol=1e-13)


@pytest.mark.long
@pytest.mark.parametrize("order", ORDERS)
def test_newton_agrees_with_the_closed_form(order):
    mechanism = PointingMechanism(order=order)
    phi_x, phi_y = grid(200, 0.7)
    poses = mechanism.poses(phi_x, phi_y)
    x = mechanism.passive_angles(poses).x
    equations = loop_equations(mechanism, x, np.stack([phi_x, phi_y], 1))
    assert np.abs(equations.residual).max() < 1e-15
    np.testing.assert_allclose(equations.traces, 3.0, rtol=0, atol=1e-14)
    solved = mechanism.solve_loops(phi_x, phi_y)
    assert solved.genuine.all()
    np.testing.assert_allclose(solved.x, x, rtol=0, atol=3e-15)


@pytest.mark.parametrize("order", ORDERS)
def test_all_modes_satisfy_the_twelve_equations(order):
    mechanism = PointingMechanism(order=order)
    phi_x, phi_y = grid(50, 3.0, 1)
    modes = mechanism.solve(phi_x, phi_y)
    for signs in modes.signs:
        poses = mechanism.poses(phi_x, phi_y, *signs)
        real = poses.assembled
        x = mechanism.passive_angles(poses).x[real]
        assert np.abs(loop_equations(mechanism, x, np.stack([phi_x, phi_y], 1)[real]).residual).max() < 5e-15


@pytest.mark.parametrize("chart", ["corrected", "printed"])
@pytest.mark.parametrize("order", ORDERS)
def test_jacobian_against_finite_differences(order, chart):
    mechanism = PointingMechanism(0.1, 0.13, 0.05, 0.17, 0.07, order)
    random = np.random.default_rng(3)
    x, phi = random.uniform(-2, 2, (5, 12)), random.uniform(-2, 2, (5, 2))
    found = loop_equations(mechanism, x, phi, chart)
    whole = np.concatenate([found.jacobian, found.inputs], axis=2)
    step = 1e-5
    for k in range(14):
        shift = np.zeros((1, 14))
        shift[0, k] = step
        ahead = loop_equations(mechanism, x + shift[:, :12], phi + shift[:, 12:], chart).residual
        behind = loop_equations(mechanism, x - shift[:, :12], phi - shift[:, 12:], chart).residual
        np.testing.assert_allclose(whole[:, :, k], (ahead - behind) / (2 * step), rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("chart", "scaled", "largest", "smallest"),
    [
        ("printed", False, 2.15, 0.0),
        ("printed", True, 2.73, 0.0),
        ("corrected", False, 2.00, 0.0544),
        ("corrected", True, 2.45, 0.415),
    ],
)
def test_singular_values_at_rest(chart, scaled, largest, smallest):
    report = ART.check_chart(0.0, 0.0, chart, scaled=scaled)
    assert report.singular_values[0] == pytest.approx(largest, abs=0.0051)
    assert report.singular_values[-1] == pytest.approx(smallest, abs=5.1e-4 if smallest > 0.1 else 5.1e-5)
    assert report.rank == (11 if chart == "printed" else 12)


def test_verdicts_on_coordinates():
    printed = ART.check_chart(0.0, 0.0, "printed")
    assert (printed.rank, printed.other_rank) == (11, 12)
    assert printed.verdict == "coordinates singular, mechanism regular"
    assert printed.use == "corrected"
    corrected = ART.check_chart(0.0, 0.0)
    assert (corrected.verdict, round(corrected.condition, 1)) == ("regular", 5.9)
    assert round(ART.check_chart(0.0, 0.0, scaled=False).condition, 1) == 36.8
    assert ART.check_chart(*np.radians([40.0, 40.0]), scaled=False).condition == pytest.approx(45.0, abs=1.0)
    # the columns of x3 and x5 are equal, so that only their sum appears
    columns = loop_equations(ART, np.zeros((1, 12)), np.zeros((1, 2)), "printed").jacobian[0]
    np.testing.assert_allclose(columns[:, 2], columns[:, 4], rtol=0, atol=1e-16)
    assert ART.check_chart(0.3, 0.3, "printed").verdict == "regular"


def test_singular_coordinates_are_noticed_before_the_first_iteration():
    """theory/extreme-cases 3, case 1: rank 11 of 12, and the regular coordinates are used instead."""
    solved = ART.solve_loops(0.5, 0.5, chart="printed")
    assert (solved.chart, int(solved.start_rank)) == ("corrected", 11)
    assert "coordinates singular, mechanism regular" in solved.message
    np.testing.assert_array_equal(solved.x, ART.solve_loops(0.5, 0.5).x)
    told = ART.solve_loops(0.5, 0.5, chart="printed", start=np.full(12, 0.1))
    assert (told.chart, int(told.start_rank)) == ("printed", 12)


def test_the_mechanism_itself_is_singular_at_a_fold():
    # rod of leg X on a line through the centre: |S_X| = l1 + l4
    mechanism = PointingMechanism(0.1, 0.15, 0.12, 0.15, 0.12)
    with mp.workdps(30):
        A, B = mp.mpf("-0.0048"), mp.mpf("0.036")
        C = mp.mpf("0.25") ** 2 - mp.mpf("0.02") ** 2 - mp.mpf("0.12") ** 2 - mp.mpf("0.15") ** 2
        fold = float(mp.atan2(B, A) - mp.acos(C / mp.hypot(A, B)))
    report = mechanism.check_chart(0.0, fold - 1e-15)
    assert (report.rank, report.verdict, report.use) == (11, "mechanism singular", "")


@pytest.mark.parametrize("every", [5, pytest.param(1, marks=pytest.mark.slow)])
def test_printed_and_corrected_equations_from_zero(every):
    """theory/antenna 4: the printed form is not reliably solved from the rest pose, the corrected one always is."""
    from scipy.optimize import root

    solved = {"printed": 0, "corrected": 0}
    for degrees in range(every, 41, every):
        phi = np.full((1, 2), math.radians(degrees))
        for chart in solved:
            found = root(lambda x, c=chart, p=phi: loop_equations(ART, x[None], p, c).residual[0], np.zeros(12))
            solved[chart] += bool(np.abs(found.fun).max() < 1e-8)
    assert solved["corrected"] == 40 // every
    assert solved["printed"] < 40 // every
    phi = np.radians(np.arange(1.0, 41.0))
    assert ART.solve_loops(phi, phi, start=np.zeros(12)).genuine.all()


@pytest.mark.long
@pytest.mark.parametrize("order", ORDERS)
def test_false_orientation_roots_are_rejected_and_counted(order):
    mechanism = PointingMechanism(order=order)
    survey = mechanism.survey_roots(0.3, -0.2, starts=80, seed=1)
    assert survey.failed + survey.false + survey.genuine == survey.starts == 80
    # of the sixteen sign patterns of the two orientations only one is genuine
    assert survey.false > 4 * survey.genuine > 0
    modes = mechanism.solve(0.3, -0.2)
    want = np.stack([modes.a, modes.b], -1)
    assert len(survey.modes) >= 1
    assert np.abs(survey.modes[:, None] - want).max(axis=-1).min(axis=1).max() < 1e-10


@pytest.mark.parametrize("order", ORDERS)
def test_every_assembly_mode_is_a_root_that_attracts(order):
    mechanism = PointingMechanism(order=order)
    for signs in mechanism.solve(0.3, -0.2).signs:
        x = mechanism.passive_angles(mechanism.poses(0.3, -0.2, *signs)).x
        start = x + np.random.default_rng(2).uniform(-0.05, 0.05, (5, 12))
        solved = mechanism.solve_loops(np.full(5, 0.3), -0.2, start=start)
        assert solved.genuine.all()
        np.testing.assert_allclose(np.exp(1j * solved.x), np.broadcast_to(np.exp(1j * x), (5, 12)), atol=1e-14)


@pytest.mark.long
def test_false_roots_are_half_turns():
    random = np.random.default_rng(5).uniform(-np.pi, np.pi, (60, 12))
    from graphsynth.systems.antenna.loop_equations import newton

    phi = np.full((60, 2), 0.2)
    x, size, _, _ = newton(ART, random, phi, "corrected")
    traces = loop_equations(ART, x, phi).traces[size < 1e-12]
    assert set(np.round(traces).ravel().tolist()) == {-1.0, 3.0}
    np.testing.assert_allclose(traces, np.round(traces), rtol=0, atol=1e-9)


VELOCITY = [
    (15, [[0.5839465819715090151104, 0.01261738996212599825358], [0.0, 0.5790267806751893579606]]),
    (40, [[0.5067862152316446942759, 0.06633908618740883741323], [0.0, 0.4992776946735109168077]]),
]


@pytest.mark.parametrize(("degrees", "want"), VELOCITY)
def test_velocity_jacobian(degrees, want):
    got = ART.rates(math.radians(degrees), math.radians(degrees))
    np.testing.assert_allclose(got.jacobian, want, rtol=0, atol=3e-16)


@pytest.mark.parametrize("order", ORDERS)
def test_rates_against_taylor_series_in_many_digits(exact, order):
    lengths = ("0.1", "0.13", "0.05", "0.17", "0.07")
    mechanism = PointingMechanism(*map(float, lengths), order)
    motion = [(0.3, 0.7, -1.1), (-0.4, 1.3, 0.6)]  # angle, speed, acceleration
    got = mechanism.rates(*[pair[i] for i in range(3) for pair in motion])
    with mp.workdps(40):

        def output(which, t):
            phi = [mp.mpf(p) + mp.mpf(w) * t + mp.mpf(e) * t * t / 2 for p, w, e in motion]
            return exact.angles(*phi, lengths, order)[which]

        for which, values in enumerate([(got.da, got.dda), (got.db, got.ddb)]):
            for n, value in enumerate(values, start=1):
                assert value == pytest.approx(float(mp.diff(lambda t, w=which: output(w, t), 0, n)), rel=1e-13)
    np.testing.assert_allclose(got.jacobian @ [0.7, 1.3], [got.da, got.db], rtol=1e-14)


@settings(deadline=None, max_examples=40)
@given(st.floats(-0.7, 0.7), st.floats(-0.7, 0.7), st.floats(-2, 2), st.floats(-2, 2), st.sampled_from(ORDERS))
def test_passive_rates_give_the_rates_of_the_closed_form(phi_x, phi_y, dx, dy, order):
    mechanism = PointingMechanism(order=order)
    got = mechanism.rates(phi_x, phi_y, dx, dy)
    passive = mechanism.passive_rates(got.poses, dx, dy)
    np.testing.assert_allclose(passive[[5, 11]], [got.da, got.db], rtol=0, atol=2e-14)
    h = 1e-5
    ahead = mechanism.passive_angles(mechanism.poses(phi_x + h * dx, phi_y + h * dy)).x
    behind = mechanism.passive_angles(mechanism.poses(phi_x - h * dx, phi_y - h * dy)).x
    np.testing.assert_allclose(passive, (ahead - behind) / (2 * h), rtol=0, atol=2e-9)


@settings(deadline=None)
@given(
    st.floats(-0.45, 0.45), st.floats(-0.45, 0.45), st.sampled_from(ORDERS),
    st.sampled_from([(-1, 1), (1, 1), (-1, -1), (1, -1)]),
)  # fmt: skip
def test_crank_angles_point_the_reflector(a, b, order, elbows):
    mechanism = PointingMechanism(order=order)
    found = mechanism.cranks(a, b, *elbows)
    assert found.reached
    back = mechanism.poses(found.phi_x, found.phi_y, int(found.s_y), int(found.s_x))
    np.testing.assert_allclose([back.a, back.b], [a, b], rtol=0, atol=2e-15 / min(back.margin_x, back.margin_y) ** 2)


def test_default_crank_angles_are_those_of_the_rest_pose():
    phi_x, phi_y = grid(100, 0.7)
    for order in ORDERS:
        mechanism = PointingMechanism(order=order)
        poses = mechanism.poses(phi_x, phi_y)
        found = mechanism.cranks(poses.a, poses.b)
        np.testing.assert_allclose([found.phi_x, found.phi_y], [phi_x, phi_y], rtol=0, atol=2e-15)
        assert (found.s_y == 1).all() and (found.s_x == -1).all()


def test_unreachable_direction_names_the_leg():
    found = ART.cranks(np.radians([10.0, 10.0, 85.0]), np.radians([10.0, 85.0, 10.0]))
    assert found.reached.tolist() == [True, False, False]
    assert found.status_y.tolist() == [0, 2, 2] or found.status_y.tolist() == [0, 0, 2]
    assert found.status_x.tolist() == [0, 2, 0]
    assert np.isnan(found.phi_y[1]) and np.isnan(found.phi_x[2])
    assert found.deficit_x[1] > 0.0 and found.deficit_x[0] == 0.0


def test_all_assembly_modes_by_brute_force():
    """Sign changes of both loop conditions on a fine grid of one axis: every mode, none twice."""
    random = np.random.default_rng(11)
    grid_t = np.linspace(-np.pi, np.pi, 20001)
    for order in ORDERS:
        for _ in range(25):
            lengths = random.uniform(0.3, 1.5, 5)
            phi_x, phi_y = random.uniform(-np.pi, np.pi, 2)
            mechanism = PointingMechanism(*lengths, order=order)
            modes = mechanism.solve(phi_x, phi_y)
            l1, l2, l3, l4, l5 = lengths
            S_y = np.array([0.0, l1 - l3 + l3 * np.cos(phi_x), -l2 + l3 * np.sin(phi_x)])
            S_x = np.array([l1 - l5 + l5 * np.cos(phi_y), 0.0, -l4 - l5 * np.sin(phi_y)])

            def gap(a, b, leg, order=order, S=(S_y, S_x), l=(l1, l2, l4)):
                from graphsynth.systems.antenna.model import orientation

                R = orientation(a, b, order)
                return np.linalg.norm(l[0] * R[..., :, 1 - leg] - S[leg], axis=-1) - l[1 + leg]

            zero = np.zeros_like(grid_t)
            count = 0
            first = gap(zero, grid_t, 1) if order == "YX" else gap(grid_t, zero, 0)
            for i in np.flatnonzero(first[:-1] * first[1:] < 0):
                u = grid_t[i] - first[i] * (grid_t[1] - grid_t[0]) / (first[i + 1] - first[i])
                second = gap(grid_t, zero + u, 0) if order == "YX" else gap(zero + u, grid_t, 1)
                count += int((second[:-1] * second[1:] < 0).sum())
            assert modes.count == count


def test_bad_requests():
    with pytest.raises(GeometryError, match="chart = 'other' is unknown"):
        ART.check_chart(0.0, 0.0, "other")
    with pytest.raises(GeometryError, match="no rank at phi_x"):
        PointingMechanism(0.1, 0.15, 0.1, 0.15, 0.1).check_chart(1.3, 1.3)
    with pytest.raises(GeometryError, match="starts = 0"):
        ART.survey_roots(0.0, 0.0, starts=0)
