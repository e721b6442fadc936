"""Lambda linkage against the published values, 50-digit recomputation, and invariants."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth import LambdaLinkage
from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.four_bar import AssemblyStatus, TiltedFourBar

DEG = math.pi / 180.0
DECK = TiltedFourBar(alpha=1 / 30)

# theory/values-of-bearings 1: f (deg), A, B
DECK_POSITIONS = [
    (0, (1, 0, 0), (1.5, 2.449489742783178098197284075)),
    (
        30,
        (0.8660254037844386467637231708, 0.4997222479414342514870302635, 0.01666358041837680819303796826),
        (2.409598745274405477103708363, 2.466217522415578146368061138),
    ),
    (
        45,
        (0.7071067811865475244008443621, 0.7067139804583467966672758704, 0.02356586142536321552227216855),
        (2.499203635229387843817538558, 2.449652165221373686125213589),
    ),
    (
        90,
        (0, 0.9994444958828685029740605269, 0.03332716083675361638607593651),
        (1.999305571657300499822334243, 2.499999903553853510753273135),
    ),
    (
        120,
        (-0.5, 0.8655443231070959239499263289, 0.02886216792063848078971877533),
        (1.443855815292586456464380075, 2.437355871803731144193931024),
    ),
    (180, (-1, 0, 0), (0.5, 2)),
    (
        225,
        (-0.7071067811865475244008443621, -0.7067139804583467966672758704, -0.02356586142536321552227216855),
        (0.1230034465534309127906349839, 1.651327931802069687277817630),
    ),
    (
        270,
        (0, -0.9994444958828685029740605269, -0.03332716083675361638607593651),
        (0.0002500497686986904079389320031, 1.500333341811048314131073841),
    ),
    (
        300,
        (0.5, -0.8655443231070959239499263289, -0.02886216792063848078971877533),
        (0.07769858483444626746666689171, 1.598360806968348253348054783),
    ),
]


@pytest.mark.parametrize(("degrees", "A", "B"), DECK_POSITIONS)
def test_deck_positions(degrees, A, B):
    got = DECK.positions([degrees * DEG])
    np.testing.assert_allclose(got.A[0], A, rtol=1e-15, atol=4e-16)
    # B is a difference of numbers near 2, so its error is absolute
    np.testing.assert_allclose(got.B[0], [*B, 0.0], rtol=1e-15, atol=1e-15)
    np.testing.assert_allclose(got.M[0], 2.0 * got.B[0] - got.A[0], rtol=0, atol=1e-15)
    assert got.M[0, 2] == -got.A[0, 2]


def test_planar_values():
    got = TiltedFourBar().positions(np.array([0.0, 90.0, 180.0, 270.0]) * DEG)
    root = math.sqrt(6.0)
    np.testing.assert_allclose(got.B[:, :2], [(1.5, root), (2, 2.5), (0.5, 2), (0, 1.5)], rtol=0, atol=1e-15)
    np.testing.assert_allclose(got.M[:, :2], [(2, 2 * root), (4, 4), (2, 4), (0, 4)], rtol=0, atol=2e-15)
    assert np.all(got.theta == 0.0)


def test_deck_rod_and_convention():
    got = TiltedFourBar(alpha=1 / 30, rod="deck").positions([90 * DEG])
    np.testing.assert_allclose(got.B[0, :2], (1.999583277409820260233159, 2.499999965268456325521706), rtol=4e-16)
    length = np.linalg.norm(got.A[0] - got.B[0])
    assert length == pytest.approx(2.500222130061534921299998, rel=1e-15)
    mirrored = TiltedFourBar(alpha=1 / 30, convention="deck").positions([1.0])
    assert mirrored.theta[0] == -DECK.positions([1.0]).theta[0]
    assert got.theta[0] == pytest.approx(0.0133300747342876170473645923467087430, rel=1e-15)


def test_largest_tilt():
    tilt, sine = DECK.largest_tilt
    assert tilt == pytest.approx(0.0133312592085829611560698794957554253, rel=4e-16)
    assert sine == pytest.approx(math.sin(0.0133312592085829611560698794957554253), rel=4e-16)


def test_general_axis():
    linkage = TiltedFourBar(alpha=1 / 30, axis=(2, -1, 2))
    np.testing.assert_allclose(
        linkage.rotation[2],
        (0.01135594433097631525133174464, 0.02209466186513985602939740811, 0.9996913866015936127633669594),
        rtol=1e-15,
    )
    assert linkage.pin_height == pytest.approx(0.02484213264965587719518507795, rel=1e-15)
    assert linkage.pin_phase == pytest.approx(-0.4747592916922992948087464667, rel=1e-15)
    assert linkage.largest_tilt[0] == pytest.approx(0.009937016596344322017456706003, rel=1e-15)
    expected = [
        (0, (1.553870486740653073647520984, 2.459871634333584122080677675), 0.004542393353163501518230858877),
        (60, (2.409962567848114419605860939, 2.466157069807878271334340317), 0.009925167203644744265696751780),
        (90, (1.977243665960526022005644584, 2.499896427706772790720064824), 0.008837979801207141733336949522),
        (200, (0.2864824968737200893919523816, 1.820400441243596083515886272), -0.007291231205719498327296250707),
    ]
    got = linkage.positions([row[0] * DEG for row in expected])
    np.testing.assert_allclose(got.B[:, :2], [row[1] for row in expected], rtol=0, atol=1e-15)
    np.testing.assert_allclose(got.theta, [row[2] for row in expected], rtol=1e-14)
    pins = [
        (0.9996913866015936127633669594, 0.02209466186513985602939740811, 0.01135594433097631525133174464),
        (0.4804973412031838807854716646, 0.8766451074482594878328246820, 0.02481251062872653974907909100),
        (-0.02234155258386496581870384058, 0.9995062185625497804213871351, 0.02209466186513985602939740811),
        (-0.9317613580358987801235153715, -0.3626134508410921921946471994, -0.01822791650772133350586769819),
    ]
    np.testing.assert_allclose(got.A, pins, rtol=1e-15, atol=4e-16)


@pytest.mark.parametrize(
    ("alpha", "degrees", "B"),
    [
        (0.0, 0.000001, (-0.9999999999999978786133348643, 0.0000001128198563676370905924991809)),
        (0.0, 0.001, (-0.9999999978786133363105300899, 0.0001128198563092354682133015520)),
        (0.0, 1, (-0.9978800586591051030698926315, 0.1127614911841828487933249357)),
        (0.0, 90, (0.8944271909999158785636694675, 2.788854381999831757127338935)),
        (0.0, 180, (-1 / 3, 1.885618083164126731735584966)),
        (1 / 30, 30, (0.1635393708613023042000500113, 2.372216760252633120165984711)),
        (1 / 30, 90, (0.8934610987931061261585619328, 2.788471204820992939813570057)),
        (1 / 30, 180, (-1 / 3, 1.885618083164126731735584966)),
    ],
)
def test_change_point_linkage(alpha, degrees, B):
    got = TiltedFourBar(2, 1, 2, 3, alpha=alpha).positions([degrees * DEG]).B[0]
    # B_x is a difference from l1 = 2; B_y keeps its relative accuracy right up to the change point
    assert got[0] == pytest.approx(B[0], rel=0, abs=1e-15)
    assert got[1] == pytest.approx(B[1], rel=2e-15, abs=0)


def test_change_point_and_dead_point_statements():
    change = TiltedFourBar(2, 1, 2, 3).full_turn()
    assert (change.kind, change.change_angles, change.method) == ("change point", (0.0,), "exact")
    limited = TiltedFourBar(2, 1, 1, 1).full_turn()
    assert limited.kind == "limited"
    assert limited.limit_angles[0] == pytest.approx(1.318116071652817965745664, rel=1e-15)
    assert limited.limit_angles[1] == pytest.approx(math.tau - 1.318116071652817965745664, rel=1e-15)
    free = TiltedFourBar().full_turn()
    assert free.possible
    assert free.method == "exact"
    assert TiltedFourBar(10, 1, 2, 2).full_turn().kind == "never assembled"
    assert DECK.full_turn().possible
    assert DECK.full_turn().method == "estimated"


def test_turned_about_normal_shifts_limits():
    shifted = TiltedFourBar(2, 1, 1, 1, alpha=0.3, axis=(0, 0, 1)).full_turn()
    expected = sorted(((1.318116071652817965745664 * s) - 0.3) % math.tau for s in (1, -1))
    assert shifted.limit_angles == pytest.approx(expected, rel=1e-14)
    flipped = TiltedFourBar(2, 1, 1, 1, alpha=math.pi, axis=(1, 1, 0))
    for angle in flipped.full_turn().limit_angles:
        around = flipped.positions([angle - 1e-6, angle + 1e-6]).assembled
        assert around[0] != around[1]


def test_tilted_limit_angles_are_where_the_status_changes():
    linkage = TiltedFourBar(2, 1, 1, 1, alpha=0.5, axis=(1, 2, 0.5))
    turn = linkage.full_turn()
    assert turn.kind == "limited"
    for angle in turn.limit_angles:
        around = linkage.positions([angle - 1e-7, angle + 1e-7]).assembled
        assert around[0] != around[1]


def test_one_sided_derivatives_at_change_point():
    linkage = TiltedFourBar(2, 1, 2, 3)
    at = linkage.positions([0.0])
    assert at.status[0] == AssemblyStatus.LIMIT
    np.testing.assert_array_equal(at.B[0], (-1.0, 0.0, 0.0))
    assert np.isnan(at.dB[0]).all()
    right, left = linkage.positions([1e-9, -1e-9]).dB[:, 1]
    assert right == pytest.approx(3 + math.sqrt(12), rel=1e-8)
    assert left == pytest.approx(3 - math.sqrt(12), rel=1e-7)


@pytest.mark.parametrize(
    ("linkage", "f", "status"),
    [
        (TiltedFourBar(2, 1, 1, 1), math.pi, AssemblyStatus.TOO_FAR),
        (TiltedFourBar(2, 1, 1, 5), 0.0, AssemblyStatus.ROCKER_TOO_LONG),
        (TiltedFourBar(2, 1, 5, 1), 0.0, AssemblyStatus.COUPLER_TOO_LONG),
        (TiltedFourBar(2, 2, 1, 1), 0.0, AssemblyStatus.INDETERMINATE),
        (TiltedFourBar(2, 2, 1, 2), 0.0, AssemblyStatus.ROCKER_TOO_LONG),
        (TiltedFourBar(2, 3, 2, 4, alpha=math.pi / 2), math.pi / 2, AssemblyStatus.TILT_EXCEEDS_ROD),
    ],
)
def test_not_assembled_has_a_reason(linkage, f, status):
    got = linkage.positions(f)
    assert got.status == status
    assert not got.assembled
    assert np.isnan(got.B).all()
    assert np.isnan(got.theta)
    assert got.reasons() == [status.message]


def test_nan_only_with_a_status():
    got = TiltedFourBar(2, 1, 1, 1).positions(np.linspace(-4, 4, 400))
    for array in (got.B, got.M, got.theta[:, None]):
        np.testing.assert_array_equal(np.isnan(array).any(axis=-1), ~got.assembled)


@pytest.mark.parametrize(
    "arguments",
    [
        {"l1": 0},
        {"l2": -1},
        {"l3": math.nan},
        {"l4": math.inf},
        {"axis": (0, 0, 0)},
        {"axis": (1, 0)},
        {"axis": (math.nan, 0, 1)},
        {"sgn": 0},
        {"alpha": math.nan},
        {"rod": "soft"},
        {"convention": "other"},
        {"l1": "long"},
    ],
)
def test_bad_input_names_the_parameter(arguments):
    with pytest.raises(GeometryError, match=next(iter(arguments))):
        TiltedFourBar(**arguments)


def test_bad_angle():
    with pytest.raises(GeometryError, match="f holds nan"):
        TiltedFourBar().positions([0.0, math.nan])


def test_straightness():
    stroke = TiltedFourBar().straightness()
    assert stroke.chord == pytest.approx(4.0, rel=1e-15)
    assert stroke.lowest == pytest.approx(0.0, abs=1e-14)
    assert 0.009753 < stroke.highest < 0.00976
    assert min(abs(stroke.f_highest / DEG - x) for x in (128.7, 231.3)) < 0.05
    tilted = DECK.straightness()
    assert tilted.out_of_plane == pytest.approx(DECK.pin_height, rel=1e-15)
    with pytest.raises(GeometryError, match="not assembled"):
        TiltedFourBar(2, 1, 1, 1).straightness()


def _reference(linkage, f):
    """B and theta at 50 digits from the double-precision input, by the plain formulas.

    See theory/four-bar-and-tilt 2, 5.
    """
    with mp.workdps(max(50, mp.mp.dps)):
        l1, l2, l3, l4 = (mp.mpf(v) for v in (linkage.l1, linkage.l2, linkage.l3, linkage.l4))
        n = [mp.mpf(v) for v in linkage.axis]
        norm = mp.sqrt(sum(v * v for v in n))
        n = [v / norm for v in n]
        alpha, f = mp.mpf(linkage.alpha), mp.mpf(f)
        s, c = mp.sin(alpha), mp.cos(alpha)
        p = [mp.cos(f), mp.sin(f), mp.mpf(0)]
        cross = [n[1] * p[2] - n[2] * p[1], n[2] * p[0] - n[0] * p[2], n[0] * p[1] - n[1] * p[0]]
        along = sum(a * b for a, b in zip(n, p))
        A = [l2 * (c * p[i] + s * cross[i] + (1 - c) * along * n[i]) for i in range(3)]  # Rodrigues
        if abs(A[2]) > l3:
            return A, None, None, mp.mpc(0, 1)
        s3 = mp.sqrt(l3**2 - A[2] ** 2)
        d = [A[0] - l1, A[1]]
        D = mp.hypot(*d)
        if D == 0:
            return A, None, None, None
        x = (D**2 + l4**2 - s3**2) / (2 * D)
        y = linkage.sgn * mp.sqrt(l4**2 - x**2)
        B = [l1 + x * d[0] / D + y * d[1] / D, x * d[1] / D - y * d[0] / D]
        return A, B, mp.atan2(A[2], s3), y


lengths = st.floats(0.2, 5.0)
angles = st.floats(-7.0, 7.0)


@settings(max_examples=150, deadline=None)
@given(
    lengths,
    lengths,
    lengths,
    lengths,
    st.sampled_from((1, -1)),
    st.floats(-1.4, 1.4),
    st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.1, 1)),
    angles,
)
def test_against_fifty_digits(l1, l2, l3, l4, sgn, alpha, axis, f):
    linkage = TiltedFourBar(l1, l2, l3, l4, sgn, alpha=alpha, axis=axis)
    got = linkage.positions(f)
    A, B, theta, y = _reference(linkage, f)
    if B is None:
        assert not got.assembled
        return
    if isinstance(y, mp.mpc):
        if abs(y) > 1e-6:  # at the boundary itself a rounding may go either way
            assert not got.assembled
        return
    if not got.assembled:
        assert abs(y) < 1e-6
        return
    scale = max(l1, l2, l3, l4)
    np.testing.assert_allclose(got.A, [float(v) for v in A], rtol=0, atol=8e-16 * scale)
    # dB/dD = O(scale / y) (a type-I boundary) and the direction e turns with 1 / D
    D = math.hypot(float(A[0]) - l1, float(A[1]))
    amplification = 1.0 + scale / max(abs(float(y)), 1e-8 * scale) + scale / max(D, 1e-8 * scale)
    np.testing.assert_allclose(got.B[:2], [float(v) for v in B], rtol=0, atol=4e-15 * scale * amplification)
    assert float(got.theta) == pytest.approx(float(theta), abs=4e-16 * scale / l3 * (1 + float(abs(mp.tan(theta)))) * 4)


@settings(max_examples=60, deadline=None)
@given(st.floats(-0.5, 0.5), st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.1, 1)), angles)
def test_invariants(alpha, axis, f):
    linkage = TiltedFourBar(alpha=alpha, axis=axis)
    got = linkage.positions(f)
    assert np.linalg.norm(got.A - got.B) == pytest.approx(2.5, rel=2e-15)  # the rod is rigid
    assert np.linalg.norm(got.B - (2.0, 0.0, 0.0)) == pytest.approx(2.5, rel=2e-15)
    assert np.linalg.norm(got.A) == pytest.approx(1.0, rel=2e-15)
    assert got.sin_theta**2 + got.cos_theta**2 == pytest.approx(1.0, rel=1e-15)
    assert abs(got.A[2]) <= linkage.pin_height * (1 + 1e-12) + 1e-16
    # derivatives against mpmath differentiation of the reference
    with mp.workdps(50):
        for index in range(2):
            exact = mp.diff(lambda x, i=index: _reference(linkage, x)[1][i], mp.mpf(f))
            assert got.dB[index] == pytest.approx(float(exact), rel=1e-12, abs=1e-13)
        exact = mp.diff(lambda x: _reference(linkage, x)[2], mp.mpf(f))
        assert float(got.dtheta) == pytest.approx(float(exact), rel=1e-12, abs=1e-15)


def test_scale_invariance():
    f = np.linspace(0, 6, 50)
    small = TiltedFourBar(2e-9, 1e-9, 2.5e-9, 2.5e-9, alpha=0.1).positions(f)
    large = TiltedFourBar(2e9, 1e9, 2.5e9, 2.5e9, alpha=0.1).positions(f)
    np.testing.assert_allclose(small.theta, large.theta, rtol=1e-14, atol=1e-17)
    np.testing.assert_allclose(small.B * 1e18, large.B, rtol=1e-14, atol=1e-6)


def test_quadrant_for_long_crank():
    linkage = TiltedFourBar(1, 3, 3, 2)  # l2 > l1: a one-argument arctangent would change quadrant
    got = linkage.positions(np.linspace(0, math.tau, 100))
    assert got.assembled.all()
    steps = np.linalg.norm(np.diff(got.B, axis=0), axis=1)
    assert steps.max() < 0.5


def test_graph_is_the_four_bar_chain():
    from graphsynth.structure import graph as graph_module

    graph = TiltedFourBar().graph()
    assert isinstance(graph, graph_module.MechanismGraph)
    assert (graph.links, graph.frame) == (4, 0)
    assert [(j.a, j.b) for j in graph.joints] == [(0, 1), (0, 3), (1, 2), (2, 3)]


def test_lambda_linkage_is_the_four_bar_of_its_system():
    own, again = LambdaLinkage(alpha=0.1), LambdaLinkage(alpha=0.1)
    assert repr(own).startswith("LambdaLinkage(l1=2.0, l2=1.0, l3=2.5, l4=2.5, sgn=1, k=1.0, alpha=0.1,")
    assert own == again == pickle.loads(pickle.dumps(own)) and hash(own) == hash(again)
    assert own != TiltedFourBar(alpha=0.1) and isinstance(replace(own, alpha=0.0), LambdaLinkage)
