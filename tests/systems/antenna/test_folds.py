"""Folds and dead points: published digits, completeness by brute force, approach to a fold, sweeps that stop."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.systems.antenna import PointingMechanism, PoseStatus
from graphsynth.systems.antenna.folds import quadratic_roots, sinusoid_roots
from graphsynth.systems.antenna.precise import precise_angles, precise_fold

ART = PointingMechanism()
PARALLELOGRAM = PointingMechanism(l3=0.1, l5=0.1)
STRETCHED = PointingMechanism(l3=0.12, l5=0.12)
ORDERS = ("YX", "XY")


def parallelogram_fold():
    return PARALLELOGRAM.sweep(np.radians(np.arange(0.0, 76.0))).fold


def test_sweep_stops_at_the_published_fold():
    t = np.radians(np.arange(0.0, 76.0))
    sweep = PARALLELOGRAM.sweep(t)
    fold = sweep.fold
    assert math.degrees(fold.parameter) == pytest.approx(69.3946276048996534091, abs=2e-14)
    assert math.degrees(fold.a) == pytest.approx(150.57815542480929740846, abs=2e-13)
    assert fold.b == pytest.approx(fold.parameter, rel=1e-15)
    assert fold.coefficient == pytest.approx(2.8694330080943580814, rel=1e-14)
    assert (fold.leg, fold.order, fold.side, fold.merging) == ("Y", 2, -1, ((1, -1), (-1, -1)))
    assert sweep.reached.sum() == 70
    assert np.isnan(sweep.poses.a[70:]).all() and not np.isnan(sweep.poses.a[:70]).any()
    assert "69.394628" in sweep.message and "leg Y" in sweep.message


def test_the_fold_in_fifty_digits():
    with mp.workdps(60):
        sharp = precise_fold(PARALLELOGRAM, parallelogram_fold())
        assert abs(mp.degrees(sharp.parameter) - mp.mpf("69.3946276048996534091046747766")) < mp.mpf("1e-28")
        assert abs(mp.degrees(sharp.a) - mp.mpf("150.57815542480929740846")) < mp.mpf("1e-20")
        assert abs(sharp.coefficient - mp.mpf("2.8694330080943580814")) < mp.mpf("1e-19")
        near = {"1e-3": "145.368182186659022207", "1e-6": "150.4137338628014220995",
                "1e-9": "150.5729564226259876224", "1e-12": "150.5779910183930399864"}  # fmt: skip
        for distance, want in near.items():
            phi = sharp.parameter - mp.mpf(distance)
            got = mp.degrees(precise_angles(PARALLELOGRAM, phi, phi)[0])
            assert abs(got - mp.mpf(want)) < mp.mpf(10) ** -(len(want) - 4)


def test_precise_angles_reproduce_the_table_of_differences():
    want = {5: ("0.226787926221", "0.00815589957422"), 10: ("1.73075995001", "0.130165128451"),
            15: ("5.55290270232", "0.656058727127"), 20: ("12.4627030642", "2.059786433"),
            30: ("37.1624955197", "10.2009845704"), 40: ("75.8533657588", "30.9895760535")}  # fmt: skip
    other = PointingMechanism(order="XY")
    with mp.workdps(50):
        for degrees, (apart, delta) in want.items():
            phi = mp.radians(degrees)
            a, b = precise_angles(ART, phi, phi)
            c, d = precise_angles(other, phi, phi)
            for value, text in ((a - b, apart), ((c + d - a - b) / 2, delta)):
                assert abs(mp.degrees(value) * 60 - mp.mpf(text)) < mp.mpf(10) ** -len(text.partition(".")[2])


@pytest.mark.parametrize("branch", [1, -1])
@pytest.mark.parametrize("which", range(5))
def test_approach_to_every_fold(which, branch):
    mechanism = STRETCHED if which < 4 else PARALLELOGRAM
    fold = parallelogram_fold()
    if which < 4:
        fold = STRETCHED.folds("X")[which]
        inside = fold.phi_y + 0.001 * fold.side  # where leg Y has to reach too
        other = next(p for p in np.linspace(-3, 3, 61).tolist() if STRETCHED.solve(p, inside).count == 4)
        fold = STRETCHED.folds("X", other)[which]
    distances = 10.0 ** -np.arange(3.0, 21.0)
    found = mechanism.approach(fold, distances, branch=branch)
    assert found.compensated_error.max() < 4e-15
    # the square root: first order, with an error that falls like the square root
    assert (np.abs(found.series / found.exact - 1.0) < 5.0 * np.sqrt(distances) + 1e-14).all()
    assert np.sign(found.exact[-1]) == np.sign(found.series[-1])
    seen = np.isfinite(found.plain_error)
    assert (found.plain_error[seen] <= found.predicted_error[seen]).all()
    # half of the digits are lost, and no more than that
    assert 1e-11 < np.nanmax(found.plain_error[-6:]) < 1e-7 or not seen[-6:].any()


def test_all_folds_of_the_full_stretch():
    """C_+ and C_- both give two folds; rod on a line through the centre."""
    folds = STRETCHED.folds("X")
    assert len(folds) == 4
    assert all(fold.order == 2 for fold in folds)
    reach = sorted(math.hypot(-0.02 + 0.12 * math.cos(f.phi_y), 0.15 + 0.12 * math.sin(f.phi_y)) for f in folds)
    np.testing.assert_allclose(reach, [0.05, 0.05, 0.25, 0.25], rtol=1e-14)
    assert ART.folds("X") == ART.folds("Y") == ()


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("leg", ["Y", "X"])
def test_folds_are_the_ends_of_what_can_be_assembled(order, leg):
    """Brute force: status over a fine turn changes exactly at the folds."""
    random = np.random.default_rng(17)
    seen = 0
    for _ in range(40):
        mechanism = PointingMechanism(*random.uniform(0.3, 1.3, 5), order=order)
        other = float(random.uniform(-1.0, 1.0))
        failing = PoseStatus.LEG_Y_OUT_OF_REACH if leg == "Y" else PoseStatus.LEG_X_OUT_OF_REACH
        turn = np.linspace(-np.pi, np.pi, 20001)
        modes = mechanism.poses(turn, other) if leg == "Y" else mechanism.poses(other, turn)
        own_first = (leg == "X") == (order == "YX")
        if not own_first and (modes.status != failing).all() and not modes.assembled.any():
            with pytest.raises(GeometryError, match="does not reach"):
                mechanism.folds(leg, other)
            continue
        out = modes.status == failing
        edges = turn[np.flatnonzero(out[:-1] != out[1:])]
        folds = [fold.parameter for fold in mechanism.folds(leg, other)]
        seen += len(folds)
        assert len(folds) == len(edges)
        np.testing.assert_allclose(folds, edges, rtol=0, atol=4e-4)
    assert seen > 20


def test_branches_that_cross_instead_of_turning_back():
    """Parallelogram: at phi_y = +-90 degrees leg X is flat; the branches cross, there is no square root."""
    flat = PARALLELOGRAM.folds("X")
    np.testing.assert_allclose([f.parameter for f in flat], [-math.pi / 2, math.pi / 2], rtol=1e-15)
    assert [f.order for f in flat] == [1, 1]
    with pytest.raises(GeometryError, match="not simple"):
        PARALLELOGRAM.approach(flat[0], [1e-3])
    with pytest.raises(GeometryError, match="order 1"):
        precise_fold(PARALLELOGRAM, flat[0])


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("leg", ["Y", "X"])
def test_dead_points(order, leg):
    mechanism = PointingMechanism(order=order)
    points = mechanism.dead_points(leg, 0.3)
    assert len(points) >= 2
    own = {"Y": (0, 0), "X": (1, 1)}[leg]
    for point in points:
        if point.s_y == 0:  # the other leg does not reach there
            assert math.isnan(point.transmission) and math.isnan(point.b if leg == "Y" else point.a)
            continue
        got = mechanism.rates(point.phi_x, point.phi_y, s_y=point.s_y, s_x=point.s_x)
        assert got.jacobian[own] == pytest.approx(0.0, abs=1e-14)
        assert point.transmission == pytest.approx(0.0, abs=1e-14)
        np.testing.assert_allclose([got.poses.a, got.poses.b], [point.a, point.b], rtol=0, atol=1e-14)
        # two crank settings meet there
        inverse = mechanism.cranks(point.a, point.b)
        margin = inverse.margin_y if leg == "Y" else inverse.margin_x
        assert not margin > 1e-6
    assert {point.kind for point in points} == {"stretched", "folded"}


def test_dead_points_are_complete():
    """Every sign change of the transmission over a turn, on every mode, is one of the dead points."""
    turn = np.linspace(-np.pi, np.pi, 4001)
    for leg, index in (("X", (1, 1)), ("Y", (0, 0))):
        angles = [(p.phi_y if leg == "X" else p.phi_x) for p in ART.dead_points(leg, 0.3)]
        changes = []
        for s in (1, -1):
            signs = {"s_x": s} if leg == "X" else {"s_y": s}
            got = ART.rates(0.3, turn, **signs) if leg == "X" else ART.rates(turn, 0.3, **signs)
            slope = got.jacobian[..., index[0], index[1]]
            changes += turn[np.flatnonzero(slope[:-1] * slope[1:] < 0.0)].tolist()
        np.testing.assert_allclose(sorted(angles), sorted(changes), rtol=0, atol=2e-3)


def test_art_has_no_fold_on_the_published_sweep():
    sweep = ART.sweep(np.linspace(0.0, math.pi, 181))
    assert sweep.fold is None and sweep.reached.all()
    assert "whole sweep" in sweep.message


def test_sweeps_of_every_direction_stop_before_the_first_failure():
    random = np.random.default_rng(23)
    stopped = 0
    for order in ORDERS:
        mechanism = PointingMechanism(0.1, 0.15, 0.11, 0.14, 0.12, order)
        for _ in range(25):
            direction = tuple(random.uniform(-1, 1, 2))
            t = np.linspace(0.0, 4.0, 81)
            sweep = mechanism.sweep(t, direction)
            fine = np.linspace(0.0, 4.0, 40001)
            whole = mechanism.poses(fine * direction[0], fine * direction[1])
            if sweep.fold is None:
                assert whole.assembled.all()
                continue
            stopped += 1
            first = fine[np.flatnonzero(~whole.assembled)[0]]
            assert abs(first - sweep.fold.parameter) < 1.1e-4
            # the sign of a fold's side and its square root, from the poses themselves
            e = 1e-6
            near = mechanism.poses(*((sweep.fold.parameter - e) * np.array(direction)))
            value, at = (near.a, sweep.fold.a) if sweep.fold.leg == "Y" else (near.b, sweep.fold.b)
            moved = abs(math.remainder(float(value) - at, math.tau))
            assert moved == pytest.approx(sweep.fold.coefficient * math.sqrt(e), rel=0.02)
            assert sweep.fold.side == -1
    assert stopped > 10


def test_a_sweep_stops_where_branches_cross():
    """Parallelogram in its flat pose: the sign of the branch would have to change to follow b = phi."""
    sweep = PARALLELOGRAM.sweep(np.radians(np.arange(0.0, 121.0, 2.5)), (0.0, 1.0))
    assert sweep.fold is not None and (sweep.fold.leg, sweep.fold.order) == ("X", 1)
    assert math.degrees(sweep.fold.parameter) == pytest.approx(90.0, abs=1e-5)
    assert "cross" in sweep.message
    assert np.isnan(sweep.poses.b[sweep.t > 1.6]).all()
    np.testing.assert_allclose(sweep.poses.b[sweep.t < 1.55], sweep.t[sweep.t < 1.55], rtol=0, atol=1e-14)


def test_sweep_that_cannot_start_and_bad_sweeps():
    sweep = STRETCHED.sweep([1.5, 1.6], (0.0, 1.0))
    assert not sweep.reached.any() and "cannot start" in sweep.message and np.isnan(sweep.poses.b).all()
    with pytest.raises(GeometryError, match="rise or fall"):
        ART.sweep([0.0, 1.0, 0.5])
    with pytest.raises(GeometryError, match="leg = 'Z'"):
        ART.folds("Z")
    with pytest.raises(GeometryError, match="positive distances"):
        PARALLELOGRAM.approach(parallelogram_fold(), [0.0])


coefficient = st.floats(-2.0, 2.0)


@settings(deadline=None)
@given(coefficient, coefficient, coefficient, coefficient, coefficient)
def test_roots_of_trigonometric_polynomials(c0, c1, s1, c2, s2):
    size = sum(map(abs, (c0, c1, s1, c2, s2)))
    assume(size > 1e-3)

    def value(t):
        return c0 + c1 * np.cos(t) + s1 * np.sin(t) + c2 * np.cos(2 * t) + s2 * np.sin(2 * t)

    roots = quadratic_roots((c0, c1, s1, c2, s2))
    assert sum(root.order for root in roots) <= 4
    for root in roots:
        assert abs(value(root.angle)) < 1e-12 * size
    grid = np.linspace(-np.pi, np.pi, 2001)
    heights = value(grid)
    changes = grid[:-1][(heights[:-1] * heights[1:] < 0) & (np.minimum(*np.abs([heights[:-1], heights[1:]])) > 1e-9)]
    for place in changes:  # every sign change has a root
        assert min(abs(math.remainder(root.angle - place, math.tau)) for root in roots) < 4e-3


def test_special_roots():
    assert [round(r.angle, 15) for r in sinusoid_roots(0.0, 1.0, 0.5)] == pytest.approx([math.pi / 6, 5 * math.pi / 6])
    assert sinusoid_roots(1.0, 0.0, 1.0) == [(0.0, 2)]
    assert sinusoid_roots(1.0, 0.0, 1.1) == sinusoid_roots(0.0, 0.0, 0.0) == []
    assert [(round(r.angle, 7), r.order) for r in quadratic_roots((1.0, 0.0, -2.0, 0.0, 0.0))] == [
        (round(math.pi / 6, 7), 1), (round(5 * math.pi / 6, 7), 1),
    ]  # fmt: skip
    touching = quadratic_roots((1.0, -1.0, 0.0, 0.0, 0.0))
    assert [(abs(round(r.angle, 7)), r.order) for r in touching] == [(0.0, 2)]
    assert quadratic_roots((0.0, 0.0, 0.0, 0.0, 0.0)) == []
    # double root at pi, where the turn closes, and two simple ones
    mixed = quadratic_roots((0.0, -1.0, 0.0, -1.0, -1e-100))
    assert [(round(abs(math.degrees(r.angle)), 6), r.order) for r in mixed] == [(60.0, 1), (60.0, 1), (180.0, 2)]


@pytest.mark.long
@settings(deadline=None)
@given(st.floats(-3.14, 3.14), st.floats(-3.14, 3.14), st.floats(-3.14, 3.14))
def test_known_roots(p, q, r):
    """(1 - cos(t - p)) (cos(t - m) - cos d): a double root at p, simple ones at m +- d."""
    m, d = 0.5 * (q + r), 0.5 * (q - r)
    gaps = [abs(math.remainder(x - y, math.tau)) for x, y in ((p, q), (p, r), (q, r))]
    assume(min(gaps) > 0.05)
    t = np.linspace(0.0, math.tau, 5, endpoint=False)
    heights = (1.0 - np.cos(t - p)) * (np.cos(t - m) - math.cos(d))
    basis = np.stack([np.ones(5), np.cos(t), np.sin(t), np.cos(2 * t), np.sin(2 * t)], 1)
    roots = quadratic_roots(tuple(np.linalg.solve(basis, heights).tolist()))
    assert sorted(root.order for root in roots) == [1, 1, 2]
    for root in roots:
        wanted = [p] if root.order == 2 else [q, r]
        assert min(abs(math.remainder(root.angle - x, math.tau)) for x in wanted) < (1e-6 if root.order == 2 else 1e-11)
