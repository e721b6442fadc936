# ruff: noqa: E501  (published reference values are kept on one line with all their digits)
"""Inverse design, small-crank theory and the source's two claims, against published values and orders of error."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.attainable import attainable, ellipticity, lengths_only_design, two_pose_design
from graphsynth.systems.platform.inverse_design import linear_design, refine_design, rotation_about, translation_along
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
from graphsynth.systems.platform.small_crank import (
    cold_sweep,
    crank_scaling,
    harmonics,
    pose_derivatives,
    small_crank,
    warm_sweep,
)

MOCK = SingleMotorPlatform()
BETA = MOCK.frame_angle
WANTED = translation_along(4.0, math.radians(37.0))


def equal(length: float, phases: tuple[float, ...] = (0.0, 0.0, 0.0)) -> SingleMotorPlatform:
    return SingleMotorPlatform(crank=(length,) * 3, phase=phases)  # type: ignore[arg-type]


# --- theory/values-of-the-platform 6


def test_linear_design_reference() -> None:
    found = linear_design(MOCK, WANTED)
    assert found.accepted
    np.testing.assert_allclose(
        found.mechanism.crank, (2.10617329135206267553490883987, 5.29647666822047661716481396937, 3.19030337686841394162990512951),
        rtol=1e-13,
    )  # fmt: skip
    np.testing.assert_allclose(
        np.degrees(found.mechanism.phase), (-166.260204708311957406289, 133.739795291688042593711, 73.7397952916880425937112),
        rtol=1e-13,
    )  # fmt: skip
    achieved = [
        3.1973805572911 - 0.003193138760739j, 2.4046552611819 - 0.00239801917099j,
        -3.2114135722148e-5 - 2.9196327075759e-5j,
    ]  # fmt: skip
    np.testing.assert_allclose(found.achieved, achieved, atol=2e-13)
    np.testing.assert_allclose(found.mean, (0.01426237121601, 0.022015921731321, 0.0021509820493489), atol=2e-14)
    assert found.error == pytest.approx(1.471e-3, rel=1e-3) and found.drift == pytest.approx(2.51e-2, rel=2e-3)
    assert found.off_line < 0.2


def test_refined_design_with_six_unknowns() -> None:
    found = refine_design(MOCK, WANTED)
    assert found.accepted and found.motion is not None and found.motion.complete and found.iterations <= 4
    np.testing.assert_allclose(
        found.mechanism.crank, (2.1086012818164197251699498, 5.2979742550218495531860063, 3.1838630260137213127729831), rtol=1e-11
    )  # fmt: skip
    np.testing.assert_allclose(
        found.mechanism.phase, (-2.9015910437790475161001759, 2.3355161403291340031030699, 1.2874715921244663116809417), rtol=1e-11
    )  # fmt: skip
    assert found.mechanism.coupler == (45.0, 45.0, 45.0)
    assert found.off_line == pytest.approx(0.132, abs=1e-3)


def test_refined_design_with_nine_unknowns() -> None:
    found = refine_design(MOCK, WANTED, couplers=True)
    assert found.accepted and found.error < 1e-13 and np.abs(found.mean * [1, 1, 45]).max() < 1e-12
    np.testing.assert_allclose(
        found.mechanism.crank, (2.104823010539880549169867, 5.2977143152428201525335202, 3.1840216244461991091809534), rtol=1e-11
    )  # fmt: skip
    np.testing.assert_allclose(
        found.mechanism.phase, (-2.9015849722928910325195114, 2.3355022949863848068553702, 1.287471979738457488001566), rtol=1e-11
    )  # fmt: skip
    np.testing.assert_allclose(
        found.mechanism.coupler, (45.099771846507111824405587, 45.157369098992401663278997, 45.113339077942873555307843), rtol=1e-12
    )  # fmt: skip
    assert found.distortion == pytest.approx(0.024, abs=1e-3) and found.off_line == pytest.approx(0.043, abs=1e-3)


def test_two_extreme_poses_reference() -> None:
    first = np.array([2.4, 1.8, 0.05])
    found = two_pose_design(MOCK, first, -first)
    assert found.accepted and found.mechanism is not None and found.motion is not None
    np.testing.assert_allclose(
        found.mechanism.coupler, (45.148547554420588086705186311148, 45.02488909702967149168123466958, 45.05587101054054076157662841341), rtol=1e-14
    )  # fmt: skip
    assert found.first_error < 1e-12 and found.second_error < 1e-3
    assert np.abs(found.motion.velocity[0]).max() < 1e-10  # all rockers at rest
    dead = sorted(angle % math.tau for drive in found.mechanism.drives for angle in drive.dead_points())
    expected = sorted([0.0, 0.0, 0.0, *np.mod(found.other_dead_point, math.tau)])
    gaps = np.abs(np.exp(1j * np.array(dead))[:, None] - np.exp(1j * np.array(expected))[None, :])
    assert gaps.min(axis=1).max() < 1e-6 and gaps.min(axis=0).max() < 1e-6


def test_second_pose_error_is_of_second_order() -> None:
    errors = []
    for scale in (1.0, 0.5):
        pose = scale * np.array([3.0, 2.25, 0.0])
        found = two_pose_design(MOCK, pose, -pose)
        errors.append(found.second_error / scale)
    assert errors[0] < 1e-3 and errors[0] / errors[1] > 3.0


def test_trivial_and_impossible_extreme_poses() -> None:
    same = two_pose_design(MOCK, [1.0, 1.0, 0.0], [1.0, 1.0, 0.0])
    assert same.mechanism is not None and same.mechanism.crank == (0.0, 0.0, 0.0)
    assert len(same.notes) == 4 and "trivial" in same.notes[-1]
    far = two_pose_design(MOCK, [500.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    assert not far.accepted and "does not reach the first pose" in far.reason
    with pytest.raises(GeometryError, match="three"):
        two_pose_design(MOCK, [1.0, 1.0], [0.0, 0.0])


# --- derivatives and convergence


def test_derivatives_of_the_turn() -> None:
    """Analytic derivatives by cranks, phases and couplers against central differences of the closed turn."""
    mechanism = SingleMotorPlatform(crank=(7.0, 4.0, 3.0), phase=(0.3, -1.0, 2.0))
    base = cold_sweep(mechanism, 12)
    exact = pose_derivatives(base)
    z = np.array(mechanism.crank) * np.exp(1j * np.array(mechanism.phase))
    h = 1e-4
    for column in range(9):
        moved = []
        for sign in (1.0, -1.0):
            k, kind = column % 3, column // 3
            w, coupler = z.copy(), list(mechanism.coupler)
            w[k] += sign * h * (1.0, 1j, 0.0)[kind]
            coupler[k] += sign * h if kind == 2 else 0.0
            other = replace(mechanism, crank=tuple(np.abs(w)), phase=tuple(np.angle(w)), coupler=tuple(coupler))  # type: ignore[arg-type]
            sweep = warm_sweep(other, base)
            moved.append(sweep.pose)
        np.testing.assert_allclose((moved[0] - moved[1]) / (2 * h), exact[:, :, column], atol=1e-8)


def test_linear_design_error_orders() -> None:
    found = [linear_design(MOCK, WANTED * scale, samples=64) for scale in (1.0, 0.5, 0.25)]
    np.testing.assert_allclose([f.error for f in found], (1.471e-3, 3.656e-4, 9.127e-5), rtol=1e-3)
    assert found[0].drift / found[1].drift == pytest.approx(2.0, rel=0.02)


@settings(max_examples=8, deadline=None)
@given(st.floats(0.5, 3.0), st.floats(-3.1, 3.1), st.floats(-3.1, 3.1), st.floats(-0.03, 0.03))
def test_any_ellipse_is_designed(amplitude: float, direction: float, phase: float, turn: float) -> None:
    """Phases free: any first harmonic in x, y and alpha."""
    wanted = translation_along(amplitude, direction) * np.exp(1j * phase) + np.array([0.3j, -0.2, turn])
    found = refine_design(MOCK, wanted, samples=48)
    assert found.accepted, found.reason
    np.testing.assert_allclose(found.achieved, wanted, atol=1e-12)
    psi = np.linspace(0.0, math.tau, 31)[:-1]
    again = harmonics(found.mechanism.full_turn(np.append(psi, math.tau)).pose[:-1])
    np.testing.assert_allclose(again.order(1), wanted, atol=1e-10)  # other samples, followed from home


def test_rotation_about_a_point() -> None:
    centre = 5.0 - 8.0j
    found = refine_design(MOCK, rotation_about(0.02, centre), couplers=True)
    assert found.accepted and found.motion is not None
    X = found.motion.pose
    still = X[:, 0] + 1j * X[:, 1] + np.exp(1j * X[:, 2]) * centre
    assert np.abs(still - still.mean()).max() < 0.05 * 0.02 * abs(centre)


def test_amplitude_too_large_is_rejected_with_the_largest_reached() -> None:
    wanted = rotation_about(0.9)  # beyond the singular orientation 0.81
    found = refine_design(MOCK, wanted, samples=48)
    assert not found.accepted and found.reason and found.motion is None
    assert 0.2 < found.amplitude_reached < 0.95
    inside = refine_design(MOCK, wanted * (found.amplitude_reached * 0.98), samples=48)
    assert inside.accepted


def test_design_of_nothing() -> None:
    found = refine_design(MOCK, [0.0, 0.0, 0.0])
    assert found.accepted and found.mechanism.crank == (0.0, 0.0, 0.0)
    with pytest.raises(GeometryError, match="wanted"):
        linear_design(MOCK, [1.0, math.nan, 0.0])


# --- claim: any direction by crank lengths (theory/inverse-design 4, E5)


@settings(max_examples=30, deadline=None)
@given(st.floats(-3.2, 3.2))
def test_equal_global_phases_give_no_straight_translation(angle: float) -> None:
    found = attainable(MOCK, [math.cos(angle), math.sin(angle), 0.0])
    assert found.off_direction == pytest.approx(0.17585818795723, rel=1e-12)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3).filter(lambda v: np.linalg.norm(v) > 0.1))
def test_phases_equal_in_the_leg_frames_give_every_direction(direction: list[float]) -> None:
    mechanism = equal(1.0, BETA)
    found = attainable(mechanism, np.array(direction) / [1.0, 1.0, 45.0])
    assert found.off_direction < 1e-25 + 1e-14 and found.ellipticity < 1e-13


def test_attainable_share_against_a_search() -> None:
    """No real lengths do better, and the ones returned attain the share."""
    t = np.array([math.cos(0.4), math.sin(0.4), 0.0])
    found = attainable(MOCK, t)
    gains = small_crank(MOCK).gains * np.array([1.0, 1.0, MOCK.Lc])[:, None]
    lengths = np.random.default_rng(0).normal(size=(200000, 3))
    energy = np.abs(lengths @ gains.T) ** 2
    share = 1.0 - np.abs(lengths @ (gains.T @ t)) ** 2 / energy.sum(axis=1)
    assert found.off_direction <= share.min() < found.off_direction + 1e-3
    own = gains @ found.lengths
    assert 1.0 - abs(t @ own) ** 2 / (np.abs(own) ** 2).sum() == pytest.approx(found.off_direction, rel=1e-12)


@pytest.mark.parametrize(("crank", "expected"), [((1, 0, 0), 0.0), ((1, 1, 0), 0.481326), ((1, 1, 1), 1.0)])
def test_ellipticity_for_equal_global_phases(crank: tuple[float, ...], expected: float) -> None:
    phasor = small_crank(replace(MOCK, crank=crank)).first_harmonic  # type: ignore[arg-type]
    assert ellipticity(phasor, MOCK.Lc) == pytest.approx(expected, abs=5e-7)


def test_lengths_only_in_the_leg_frames_reach_what_is_asked() -> None:
    found = lengths_only_design(equal(1.0, BETA), WANTED)
    assert found.accepted and found.error == pytest.approx(1.471e-3, rel=1e-3)  # the linear design again
    keyed = np.mod(np.array(found.mechanism.phase) - BETA, math.tau)
    assert np.abs(np.sin(keyed)).max() < 1e-12
    worse = lengths_only_design(MOCK, WANTED)
    assert worse.accepted
    # least squares over lengths and the start of the turn cannot do better than the attainable share of the energy
    assert worse.error > 0.95 * math.sqrt(attainable(MOCK, [math.cos(0.6), math.sin(0.6), 0.0]).off_direction)


# --- claim: displacements tend to a sinusoid (theory/small-crank)


@pytest.mark.parametrize(("length", "ratio"), [(1.0, 0.00555566), (5.0, 0.00555832), (10.0, 0.00556778)])
def test_second_harmonic_of_a_rocker(length: float, ratio: float) -> None:
    psi = np.arange(256) * (math.tau / 256)
    measured = harmonics(equal(length).drive(psi).theta)
    size = np.abs(measured.order(2)) / np.abs(measured.order(1))
    np.testing.assert_allclose(size / length, ratio, atol=6e-9)
    np.testing.assert_allclose(small_crank(equal(length)).second_over_first, length / 180.0, rtol=1e-13)


@pytest.mark.parametrize("coupler", [(45.0, 45.0, 45.0), (43.0, 46.5, 47.0)], ids=["right angle", "general"])
def test_rocker_theory_is_of_third_order(coupler: tuple[float, float, float]) -> None:
    psi = np.linspace(0.0, math.tau, 41)
    errors, means, ratios = [], [], []
    for length in (0.4, 0.2):
        mechanism = replace(equal(length, (0.3, 1.0, -2.0)), coupler=coupler)
        theory = small_crank(mechanism)
        exact = np.angle(np.exp(1j * (mechanism.drive(psi).theta - theory.theta)))
        errors.append(np.abs(exact - theory.rockers(psi)).max(axis=0))
        found = harmonics(exact[:-1])
        means.append(np.abs(found.mean - theory.mean_shift).max())
        size = np.abs(found.order(2)) / np.abs(found.order(1))
        ratios.append(np.abs(size - theory.second_over_first).max())
    np.testing.assert_allclose(errors[0] / errors[1], 8.0, rtol=0.05)
    assert means[0] / means[1] > 14.0  # even powers only
    assert ratios[0] / ratios[1] > 7.0
    assert (np.abs(theory.cosine).max() > 1e-2) == (coupler[0] != 45.0)


def test_table_of_harmonics() -> None:
    """theory/small-crank 3, rows of the global and the leg-frame setting."""
    for length, first, second, mean, third in (
        (1.0, 0.7500407, 0.0065106, 0.000150739, 1.570e-6),
        (5.0, 3.7551412, 0.162894, 0.00378954, 0.00019734),
        (15.0, 11.4024465, 1.4773839, 0.03589888, 0.00563635),
    ):
        found = harmonics(equal(length).full_turn(np.linspace(0.0, math.tau, 97)).pose[:-1])
        np.testing.assert_allclose(np.abs(found.order(1)[:2]), first, rtol=1e-7)
        np.testing.assert_allclose(np.abs(found.order(2)[:2]), second, rtol=1e-5)
        assert found.mean[2] == pytest.approx(mean, rel=1e-5)
        assert abs(found.order(3)[2]) == pytest.approx(third, rel=1e-3)
    for length, first, second, mean in (
        (1.0, 0.017363114, 6.9837e-5, 0.000123091),
        (10.0, 0.17577621, 0.00676518, 0.0128149),
        (15.0, 0.26858223, 0.01450778, 0.03052043),
    ):
        found = harmonics(equal(length, BETA).full_turn(np.linspace(0.0, math.tau, 97)).pose[:-1])
        assert abs(found.order(1)[2]) == pytest.approx(first, rel=1e-7)
        assert abs(found.order(2)[2]) == pytest.approx(second, rel=1e-4)
        assert found.mean[2] == pytest.approx(mean, rel=1e-5)
        assert np.abs(found.order(1)[:2]).max() < 1e-11


def test_distortion_at_ten_millimetres() -> None:
    globally = harmonics(equal(10.0).full_turn(np.linspace(0.0, math.tau, 97)).pose[:-1])
    in_legs = harmonics(equal(10.0, BETA).full_turn(np.linspace(0.0, math.tau, 97)).pose[:-1])
    np.testing.assert_allclose(globally.distortion()[:2], 0.087, atol=5e-4)
    assert in_legs.distortion()[2] == pytest.approx(0.039, abs=5e-4)


def test_displacements_tend_to_a_sinusoid_with_the_crank_length() -> None:
    """True in the limit: distortion falls in proportion to the length, the phasor's error with its square."""
    found = crank_scaling(SingleMotorPlatform(crank=(8.0, 5.0, 3.0), phase=(0.0, 0.5, 1.0)), (1.0, 0.5, 0.25, 0.125))
    for coarse, fine in pairwise(found[1:]):
        assert coarse.second / fine.second == pytest.approx(2.0, rel=0.03)
        assert coarse.mean / fine.mean == pytest.approx(2.0, rel=0.03)
        assert coarse.first_error / fine.first_error == pytest.approx(4.0, rel=0.03)
    assert found[0].second > 0.02  # and not at finite length


def test_scaling_refuses_cranks_that_do_not_turn() -> None:
    with pytest.raises(GeometryError, match=r"full turn|home branch"):
        crank_scaling(equal(40.0), (1.0,))


# --- harmonics


@given(st.lists(st.complex_numbers(max_magnitude=5.0), min_size=3, max_size=3), st.floats(-5.0, 5.0))
def test_harmonics_of_a_polynomial(amplitudes: list[complex], mean: float) -> None:
    psi = np.arange(9) * (math.tau / 9)
    samples = mean + sum((a * np.exp(1j * m * psi)).real for m, a in enumerate(amplitudes, start=1))
    found = harmonics(samples)
    np.testing.assert_allclose(found.amplitudes[:3, 0], amplitudes, atol=1e-13)
    assert found.mean[0] == pytest.approx(mean, abs=1e-13)
    with pytest.raises(GeometryError, match="harmonic"):
        found.order(5)


def test_home_of_the_theory_at_high_precision() -> None:
    """The coupler direction and angle of transmission from exact geometry: C - O = 45 exp(i arg(43.2 - 12.6 i))."""
    theory = small_crank(MOCK)
    with mp.workdps(30):
        beta = mp.atan2(mp.mpf("-12.6"), mp.mpf("43.2"))
        expected = [float(beta + mp.mpf(k) * mp.pi / 6) for k in (-5, -1, 3)]
    np.testing.assert_allclose(np.exp(1j * theory.coupler_direction), np.exp(1j * np.array(expected)), atol=1e-15)
    np.testing.assert_allclose(theory.cosine, 0.0, atol=1e-15)
