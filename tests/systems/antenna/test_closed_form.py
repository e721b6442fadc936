"""Closed form of the pointing mechanism: published digits, 50-digit recomputation, rigid rods, reach, bad input."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import graphsynth.systems.antenna as pointing
from graphsynth.core.errors import GeometryError
from graphsynth.systems.antenna import PointingMechanism, PoseStatus
from graphsynth.systems.antenna.precise import precise_angles

# theory/values-of-the-antenna 1, equal cranks, degrees: phi, a YX, b YX, a XY, b XY
EQUAL = [
    (5, "2.961353737663430764484", "2.957573938893077389169", "2.957541511617530966725", "2.961658028258117829033"),
    (10, "5.929522028403067771639", "5.900676029236157904114", "5.900151492499074575631", "5.934385402755182936507"),
    (15, "8.90752659324051374247", "8.814978214868563808162", "8.812274199459061809926", "8.932099232887585502355"),
    (20, "11.89386643991345663454", "11.68615472217681156899", "11.67739093759806551609", "11.97128977225872244326"),
    (30, "17.86052249633140064393", "17.24114757100242548654", "17.19353892876885598339", "18.24816395757937403938"),
    (40, "23.7120800164849915647", "22.44785725383752382049", "22.28238176921033118981", "24.91054136956160033838"),
]
UNEQUAL = [
    (15, -15, "8.907467680230180924959", "-8.812274199459061809926"),
    (-15, 15, "-8.932171986643161372765", "8.814978214868563808162"),
    (30, -20, "17.49501898156559029702", "-11.67739093759806551609"),
    (40, -40, "23.69018800465512636078", "-22.28238176921033118981"),
]
ART = ("0.1", "0.15", "0.0592", "0.15", "0.0592")
PARALLELOGRAM = ("0.1", "0.15", "0.1", "0.15", "0.1")
ORDERS = ("YX", "XY")
mp.mp.dps = 50


def digits(text):
    return mp.mpf(10) ** (-len(text.partition(".")[2]))


@pytest.mark.parametrize("row", EQUAL)
def test_the_reference_formulas_give_the_published_digits(exact, row):
    phi = mp.radians(row[0])
    got = [*exact.angles(phi, phi), *exact.angles(phi, phi, order="XY")]
    for value, text in zip(got, row[1:]):
        assert abs(mp.degrees(value) - mp.mpf(text)) <= digits(text)


def test_equal_cranks():
    phi = np.radians([row[0] for row in EQUAL])
    for order, first in (("YX", 1), ("XY", 3)):
        poses = PointingMechanism(order=order).poses(phi, phi)
        np.testing.assert_allclose(np.degrees(poses.a), [float(row[first]) for row in EQUAL], rtol=0, atol=4e-14)
        np.testing.assert_allclose(np.degrees(poses.b), [float(row[first + 1]) for row in EQUAL], rtol=0, atol=4e-14)
        assert poses.assembled.all()


def test_unequal_cranks():
    degrees = np.array([row[:2] for row in UNEQUAL], dtype=float)
    poses = PointingMechanism().poses(*np.radians(degrees).T)
    np.testing.assert_allclose(np.degrees(poses.a), [float(row[2]) for row in UNEQUAL], rtol=0, atol=4e-14)
    np.testing.assert_allclose(np.degrees(poses.b), [float(row[3]) for row in UNEQUAL], rtol=0, atol=4e-14)


def test_parallelogram_legs():
    mechanism = PointingMechanism(l3=0.1, l5=0.1)
    phi = np.radians([10.0, 40.0, 60.0])
    poses = mechanism.poses(phi, phi)
    want = [10.13747995612367270141, 47.36198225141130633077, 87.9656410068250778839]
    np.testing.assert_allclose(np.degrees(poses.a), want, rtol=0, atol=2e-13)
    turn = np.linspace(-math.pi + 1e-3, math.pi, 400)
    # b = phi for every phi: the parallelogram, on whichever branch it lies
    both = [mechanism.poses(0.0, turn, s_x=s).b for s in (1, -1)]
    assert np.nanmax(np.min(np.abs([b - turn for b in both]), axis=0)) < 1e-13


def test_small_angles(exact):
    """Series of theory/antenna 5 with its coefficient c4; the response is not odd."""
    ratio, c4 = 0.592, 0.0592**2 * 0.408**2 / (8 * 0.1 * 0.15)
    for phi in (0.02, 0.04):
        with mp.workdps(50):
            plus, minus = exact.angles(mp.mpf(phi), mp.mpf(phi)), exact.angles(-mp.mpf(phi), -mp.mpf(phi))
            assert float(plus[1] + minus[1]) == pytest.approx(2 * c4 * phi**4, rel=10 * phi**2)
            assert float(plus[0] - plus[1]) == pytest.approx(ratio**3 * phi**3 / 2, rel=3 * phi)
        got = PointingMechanism().poses(phi, phi).b
        assert got == pytest.approx(ratio * phi - ratio * (1 - ratio**2) * phi**3 / 6 + c4 * phi**4, abs=2 * phi**5)


@settings(deadline=None)
@given(
    st.floats(-math.pi, math.pi),
    st.floats(-math.pi, math.pi),
    st.tuples(*[st.floats(0.05, 2.0)] * 5),
    st.sampled_from(ORDERS),
    st.sampled_from([(1, 1), (1, -1), (-1, 1), (-1, -1)]),
)
def test_every_pose_has_rigid_rods(exact, phi_x, phi_y, lengths, order, signs):
    poses = PointingMechanism(*lengths, order=order).poses(phi_x, phi_y, *signs)
    if poses.assembled:
        errors = exact.rod_errors(*map(float, (poses.a, poses.b)), phi_x, phi_y, map(repr, lengths), order)
        # even at a fold: what the angles lose there, the rods do not feel
        assert max(map(abs, errors)) < 1e-14 * max(lengths) ** 2 / min(lengths)
    else:
        assert np.isnan(poses.a) and np.isnan(poses.b)
        assert poses.deficit > 0.0


@settings(deadline=None)
@given(st.floats(-3.1, 3.1), st.floats(-3.1, 3.1), st.sampled_from(ORDERS))
def test_against_many_digits(exact, phi_x, phi_y, order):
    want = exact.angles(mp.mpf(phi_x), mp.mpf(phi_y), order=order)
    poses = PointingMechanism(order=order).poses(phi_x, phi_y)
    if poses.assembled:
        assert abs(complex(mp.expj(want[0]) - mp.expj(float(poses.a)))) < 2e-15 / poses.margin_y / poses.margin_x
        assert abs(complex(mp.expj(want[1]) - mp.expj(float(poses.b)))) < 2e-15 / poses.margin_y / poses.margin_x
    else:
        assert any(isinstance(value, mp.mpc) for value in want)


@settings(deadline=None)
@given(st.floats(-1.2, 1.2))
def test_swapping_the_gimbal_order_reverses_both_cranks(phi):
    there = PointingMechanism(order="XY").poses(phi, phi)
    back = PointingMechanism().poses(-phi, -phi)
    np.testing.assert_allclose([there.a, there.b], [-back.b, -back.a], rtol=0, atol=1e-15)


def test_out_of_reach_is_named_and_never_clipped():
    short = PointingMechanism(0.1, 0.15, 0.1, 0.15, 0.1)
    beyond = short.poses(np.radians(70.0), np.radians(70.0))
    assert PoseStatus(int(beyond.status)) is PoseStatus.LEG_Y_OUT_OF_REACH
    assert np.isnan(beyond.a) and np.isnan(beyond.b)
    assert "leg Y" in beyond.reasons()[0]
    l1, l2, l3 = (mp.mpf(x) for x in PARALLELOGRAM[:3])
    phi = mp.radians(70)
    sy, sz = l1 - l3 + l3 * mp.cos(phi), -l2 + l3 * mp.sin(phi)
    deficit = abs((l1**2 + sy**2 + sz**2 - l2**2) / (2 * l1)) - mp.hypot(sy, sz * mp.cos(phi))
    assert beyond.deficit == pytest.approx(float(deficit), rel=1e-12)
    stretched = PointingMechanism(0.1, 0.15, 0.12, 0.15, 0.12).poses(0.0, np.radians([0.0, 100.0]))
    assert stretched.assembled.tolist() == [True, False]
    assert PoseStatus(int(stretched.status[1])) is PoseStatus.LEG_X_OUT_OF_REACH


def test_lengths_of_any_size():
    phi = np.linspace(-1.0, 1.0, 7)
    want = PointingMechanism().poses(phi, 0.5 * phi)
    for factor in (2.0**-600, 2.0**-20, 2.0**600):
        got = PointingMechanism(*(float(x) * factor for x in ART)).poses(phi, 0.5 * phi)
        np.testing.assert_array_equal(got.a, want.a)
        np.testing.assert_array_equal(got.b, want.b)


@pytest.mark.long
@pytest.mark.parametrize("span", [1.0, 6.0])
def test_length_ratios_up_to_a_million_millions(span):
    """Against 60 digits: angles to rounding over margin; where reach is decided wrongly, it is flagged."""
    random = np.random.default_rng(9)
    wrong = 0
    for _ in range(400):
        lengths = (10.0 ** random.uniform(-span, span, 5)).tolist()
        x, y = random.uniform(-3.0, 3.0, 2).tolist()
        poses = PointingMechanism(*lengths).poses(x, y)
        with mp.workdps(60):
            want = precise_angles(PointingMechanism(*lengths), x, y)
            if bool(mp.isnan(want[0])) == bool(poses.assembled):
                assert poses.near_limit
                wrong += 1
            elif poses.assembled and not poses.near_limit:
                errors = [float(abs(mp.arg(mp.expj(w - float(g))))) for w, g in zip(want, (poses.a, poses.b))]
                assert errors[1] <= 3e-15 / poses.margin_x
                assert errors[0] <= 3e-15 / poses.margin_y / poses.margin_x
    assert wrong <= (0 if span == 1.0 else 8)


def test_shapes_broadcast():
    poses = PointingMechanism().poses(np.zeros((3, 1)), np.zeros(4))
    assert poses.a.shape == poses.status.shape == (3, 4)
    assert poses.rotation.shape == (3, 4, 3, 3)
    assert PointingMechanism().poses(0.0, 0.0).a.shape == ()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: PointingMechanism(l3=-0.1), "l3 = -0.1 must be positive"),
        (lambda: PointingMechanism(l1=0.0), "l1 = 0.0 must be positive"),
        (lambda: PointingMechanism(l2=math.nan), "l2 = nan is not finite"),
        (lambda: PointingMechanism(order="ZX"), "order = 'ZX' is unknown"),
        (lambda: PointingMechanism().poses(math.inf, 0.0), "phi_x holds inf"),
        (lambda: PointingMechanism().poses(0.0, "x"), "phi_y holds text"),
        (lambda: PointingMechanism().poses(0.0, 0.0, s_y=0), "s_y = 0 must be"),
    ],
)
def test_bad_input_is_refused_with_a_sentence(make, words):
    with pytest.raises(GeometryError, match=words.replace("(", r"\(")):
        make()


def test_structure():
    graph = PointingMechanism().graph()
    assert (graph.links, len(graph.joints), graph.mobility, graph.loops) == (6, 7, 2, 2)
    passive = sum(joint.mobility for joint in graph.joints) - 2
    assert passive == 6 * graph.loops == 12


def test_package_is_lazy():
    assert set(pointing.__all__) >= {"PointingMechanism", "Poses"}
    with pytest.raises(AttributeError, match="nothing"):
        pointing.nothing  # noqa: B018
