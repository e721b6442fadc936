# ruff: noqa: E501  (published reference values are kept on one line with all their digits)
"""Jam arcs, inverse questions and the report against published values and against the gap itself."""

from __future__ import annotations

import math
import re
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth import Driver, Mechanism, MechanismGraph, Revolute, simulate
from graphsynth.core.errors import GeometryError
from graphsynth.jamming import (
    Bearing,
    ToleranceBox,
    Verdict,
    assess_jamming,
    jam_arcs,
    largest_height,
    largest_misalignment,
    smallest_clearance,
)
from graphsynth.jamming.joints import Misalignment
from graphsynth.jamming.verdict import METHOD_CERTIFIED
from graphsynth.mechanism.four_bar import TiltedFourBar

DEG = math.pi / 180.0
DECK = TiltedFourBar(alpha=1 / 30)

# theory/values-of-bearings 2: f, theta, gA, gB, E4 ell\circ, E4 circ\ell, A_lid, A_rim
TABLE = [
    (0, 0, -0.03, -0.03, 3.301499719657513714300391931, 0, 0, 0),
    (13, 0.002998796481990437225089870257, -0.01508472683198013806918781056, -0.01492721840235467538782847698, 2.471409694573719309924230225, 0, 0, 0),
    (26.5, 0.005948237589236811913080169537, -0.0005685749133127471380137638930, 0.00005113076477751975532627573572, 1.646618830578826824867295346, 0.00009856701769126607825006148181, 0.00006930585840260152499740993306, 0),
    (27, 0.006052122707586214238205306504, -0.00006006687146966542519219949572, 0.0005814739053437592190222472247, 1.621066859793205177560545780, 0.003753716895479304633967575430, 0.002636945420866169587276483342, 0),
    (27.1, 0.006072844683813096860121404565, 0.00004134265285919959620426642216, 0.0006872841040205053623818768610, 1.616302869535650838012401711, 0.004816918513870584899324487852, 0.003383220663316864579216318011, 0.00005093062272311792870804194113),
    (30, 0.006665481523625300487177714188, 0.002938411641566113585274079865, 0.003716576459132869191679167768, 1.502974011396710512043995599, 0.05831761010012485421045240513, 0.04075997793158257881944974792, 0.02928239441092539668354974896),
    (45, 0.009426484173562221036794129364, 0.01635421582419991743612821308, 0.01791056274644127581914631733, 1.196616132387805330363001140, 0.5336526360764217477045925857, 0.3664808521978998405120393883, 0.3290896857541061507798596762),
    (64.2, 0.01200231556422492917626611296, 0.02874966581393647831345638987, 0.03127276898928444438631328932, 1.036062845606642030550256536, 1.108984364508992475184121805, 0.7527996640190556837671238555, 0.6873849392043081549994228099),
    (90, 0.01333125920858296115606987950, 0.03509927307354575852847158852, 0.03821203607106864097167846659, 0.9749683652811658362854900470, 1.430050028193116713621458536, 0.9660360305061188705287607231, 0.8839375957586522109156716223),
    (120, 0.01154512364123670242103379008, 0.02655806234668434139163146331, 0.02889260866186031197327987700, 1.059865427563370751400219417, 1.001706473157224352848954484, 0.6812203778465178218897125746, 0.6211836357185708258363889146),
    (153.6, 0.005927405961142186717729144649, -0.0006705665766588902145600238017, -0.00005519389126332707730155892092, 1.652375787694369216078952151, 0, 0, 0),
    (359, -0.0002326556646283865416439914034, -0.02883719531311036217721639156, -0.02883624724966480003750332002, 3.237409389451442607495635875, 0, 0, 0),
]  # fmt: skip


def test_published_table():
    expected = np.array(TABLE)
    f = expected[:, 0] * DEG
    got = assess_jamming(DECK, samples=f).table
    # an angle given in degrees is rounded to a double: the tilt changes by about one unit in the last place of f
    np.testing.assert_allclose(got.theta, expected[:, 1], rtol=2e-14, atol=2e-18)
    # gaps are sums of terms of the size of the clearance: absolute error of a few ulps of 0.03
    np.testing.assert_allclose(got.interference_a, expected[:, 2], rtol=1e-13, atol=3e-17)
    np.testing.assert_allclose(got.interference_b, expected[:, 3], rtol=1e-13, atol=3e-17)
    np.testing.assert_allclose(got.surrogate_gap_area, expected[:, 4], rtol=1e-13)
    # interference areas grow like gap^(3/2): relative error 3/2 * 3e-17 / gap
    for column, area, gap in ((5, got.surrogate_interference_area, 3), (6, got.lid_area, 3), (7, got.rim_area, 2)):
        tolerance = 1e-13 + 6e-17 / np.abs(expected[:, gap])
        assert np.all(np.abs(area - expected[:, column]) <= tolerance * expected[:, column])


def test_symmetries():
    f = np.radians([13.0, 64.2, 27.1])
    base = assess_jamming(DECK, samples=f).table
    for other, sign in ((math.pi - f, 1), (f + math.pi, -1), (-f, -1)):
        table = assess_jamming(DECK, samples=other).table
        np.testing.assert_allclose(table.theta, sign * base.theta, rtol=1e-13)
        np.testing.assert_allclose(table.interference_a, base.interference_a, rtol=1e-11)
        np.testing.assert_allclose(table.lid_area, base.lid_area, rtol=1e-10)


@pytest.mark.parametrize(
    ("axis", "rows"),
    [
        ((0, 1, 0), [(0, 0.03509927307354575852847158852), (45, 0.01635421582419991743612821308), (90, -0.03),
                     (135, 0.01635421582419991743612821308), (180, 0.03509927307354575852847158852)]),
        ((1, 1, 0), [(0, 0.01635421582419991743612821308), (45, -0.03), (90, 0.01635421582419991743612821308),
                     (135, 0.03509927307354575852847158852), (180, 0.01635421582419991743612821308)]),
        ((0, 0, 1), [(0, -0.03), (45, -0.03)]),
        ((2, -1, 2), [(0, -0.007468652729646155295143647229), (60, 0.01876307507309429554370971373),
                      (90, 0.01350586666806930374623660666), (200, 0.005990667116879132118298573046)]),
    ],
)  # fmt: skip
def test_other_axes(axis, rows):
    degrees, gaps = np.array(rows).T
    got = assess_jamming(TiltedFourBar(alpha=1 / 30, axis=axis), samples=degrees * DEG).table
    np.testing.assert_allclose(got.interference_a, gaps, rtol=1e-13, atol=3e-17)


def test_general_axis_condition_b():
    got = assess_jamming(TiltedFourBar(alpha=1 / 30, axis=(2, -1, 2)), samples=np.radians([0, 60, 90, 200])).table
    expected = [-0.007107260446920128638161704837, 0.02048844506384219279652856194,
                0.01487395243316819535703169698, 0.006921796341260882250703825704]  # fmt: skip
    np.testing.assert_allclose(got.interference_b, expected, rtol=1e-13, atol=3e-17)


def test_tiny_tilt():
    got = assess_jamming(TiltedFourBar(alpha=1e-8), samples=[math.pi / 2, 0.0]).table
    assert got.theta[0] == pytest.approx(3.999999999999999944e-9, rel=1e-15)
    assert got.interference_a[0] == pytest.approx(-0.02999998000000014000000033333, rel=1e-15)
    assert got.interference_b[0] == pytest.approx(-0.02999997999999985976000033333, rel=1e-15)
    assert got.surrogate_gap_area[0] == pytest.approx(3.301498618215121642404901832, rel=1e-14)


def test_change_point_linkage_gaps():
    got = assess_jamming(TiltedFourBar(2, 1, 2, 3, alpha=1 / 30), samples=np.radians([30.0, 90.0])).table
    np.testing.assert_allclose(
        got.theta, [0.008331886609246326355046407780, 0.01666435169112613254681867559], rtol=1e-14
    )
    np.testing.assert_allclose(
        got.interference_a, [0.01105152663331466536041477071, 0.05088807792172234392703678866], rtol=1e-13
    )
    np.testing.assert_allclose(
        got.interference_b, [0.01226741675756245107069880797, 0.05575189167490887234112258484], rtol=1e-13
    )


@pytest.mark.parametrize(
    ("condition", "rod", "start", "stop"),
    [
        ("A", "rigid", 27.0592203251509475645179736478, 152.940779674849052435482026352),
        ("B", "rigid", 26.4519007718602215158671401366, 153.548099228139778484132859863),
        ("A", "deck", 27.0597585332963475926436265901, None),
        ("B", "deck", 26.4524033865587758198820397202, None),
    ],
)
def test_arcs(condition, rod, start, stop):
    arcs = jam_arcs(TiltedFourBar(alpha=1 / 30, rod=rod), Bearing(), condition)
    stop = 180 - start if stop is None else stop
    first, second = arcs.arcs
    assert first.start / DEG == pytest.approx(start, rel=1e-14)
    assert first.stop / DEG == pytest.approx(stop, rel=1e-14)
    assert second.start / DEG == pytest.approx(start + 180, rel=1e-14)
    assert second.stop / DEG == pytest.approx(stop + 180, rel=1e-14)
    assert arcs.condition == condition
    assert "not certified" in arcs.method


def test_inverse_questions():
    assert largest_misalignment(DECK, Bearing(), "A").value == pytest.approx(
        0.0151614793250201376610981403839, rel=1e-15
    )
    assert largest_misalignment(DECK, Bearing(), "B").value == pytest.approx(
        0.0148460080847629701366363985309, rel=1e-15
    )
    assert smallest_clearance(DECK, Bearing(), "A").value == pytest.approx(0.0650992730735457585284715885170, rel=1e-15)
    assert smallest_clearance(DECK, Bearing(), "B").value == pytest.approx(0.0682154318912891822469145530348, rel=1e-15)


@pytest.mark.parametrize("condition", ["A", "B"])
@pytest.mark.parametrize("axis", [(1, 0, 0), (2, -1, 2), (0.3, 0.1, 2)])
def test_inverse_answers_are_on_the_edge(condition, axis):
    linkage, bearing = TiltedFourBar(alpha=0.02, axis=axis), Bearing(17.5, 10.0, 0.03)
    alpha = largest_misalignment(linkage, bearing, condition).value
    clearance = smallest_clearance(linkage, bearing, condition).value
    height = largest_height(linkage, bearing, condition).value
    for factor, free in ((1 - 1e-9, True), (1 + 1e-9, False)):
        kinds = [
            assess_jamming(TiltedFourBar(alpha=alpha * factor, axis=axis), bearing, condition, 5),
            assess_jamming(linkage, Bearing(17.5, 10.0, clearance / factor), condition, 5),
            assess_jamming(linkage, Bearing(17.5, height * factor, 0.03), condition, 5),
        ]
        expected = Verdict.CERTIFIED_FREE if free else Verdict.CERTIFIED_JAMMED
        assert [report.verdict for report in kinds] == [expected] * 3


def test_no_limits_have_reasons():
    assert "no limit" in largest_misalignment(TiltedFourBar(axis=(0, 0, 1)), Bearing()).reason
    assert "no limit" in largest_misalignment(TiltedFourBar(), Bearing(17.5, 1.0, 0.03), "A").reason
    assert "no height" in largest_height(TiltedFourBar(alpha=1.0), Bearing(), "B").reason
    assert "no limit" in largest_height(TiltedFourBar(), Bearing()).reason
    steep = TiltedFourBar(1, 1, 1, 1, alpha=1.2)
    assert smallest_clearance(steep, Bearing(1.0, 0.5, 0.1)).value == pytest.approx(math.hypot(1, 0.25) - 1, rel=1e-14)
    with pytest.raises(GeometryError, match="l3"):
        smallest_clearance(TiltedFourBar(5, 3, 2, 4, alpha=1.5), Bearing())


angle = st.floats(-3.0, 3.0)


@settings(max_examples=80, deadline=None)
@given(
    st.floats(0.001, 0.2), st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.2, 1)),
    st.floats(5, 30), st.floats(1, 30), st.floats(1e-4, 0.2), st.sampled_from(["A", "B"]), st.floats(0, 6.28),
)  # fmt: skip
def test_arcs_agree_with_the_gap(alpha, axis, R, H, c, condition, f):
    linkage, bearing = TiltedFourBar(alpha=alpha, axis=axis), Bearing(R, H, c)
    arcs = jam_arcs(linkage, bearing, condition)
    path = linkage.positions(f)
    gap = float(bearing.interference(path.sin_theta, path.cos_theta, condition))
    jammed = any(arc.contains(f) for arc in arcs.arcs)
    if abs(gap) > 1e-12:
        assert jammed == (gap > 0)
    for arc in arcs.arcs:  # the ends of the arcs are contacts
        end = linkage.positions([arc.start, arc.stop])
        assert np.all(np.abs(bearing.interference(end.sin_theta, end.cos_theta, condition)) < 1e-12)


def test_verdicts_of_extreme_cases():
    assert assess_jamming(TiltedFourBar(), Bearing(), certify=False).verdict is Verdict.FREE_ESTIMATED
    assert assess_jamming(TiltedFourBar(), Bearing()).verdict is Verdict.CERTIFIED_FREE
    assert assess_jamming(TiltedFourBar(alpha=0.5, axis=(0, 0, 1)), Bearing()).verdict is Verdict.CERTIFIED_FREE
    zero = assess_jamming(DECK, Bearing(17.5, 10, 0.0))
    assert zero.verdict is Verdict.CERTIFIED_JAMMED
    assert assess_jamming(DECK, Bearing(17.5, 10, 0.0), certify=False).verdict is Verdict.JAMMED_ESTIMATED
    assert zero.arcs.touching == pytest.approx((0.0, math.pi))
    assert sum(arc.length for arc in zero.arcs.arcs) == pytest.approx(math.tau, rel=1e-15)
    assert assess_jamming(TiltedFourBar(), Bearing(17.5, 10, 0.0)).verdict is Verdict.UNDECIDED
    still = assess_jamming(TiltedFourBar(), Bearing(17.5, 10, 0.0), certify=False)
    assert still.verdict is Verdict.TOUCHING_ESTIMATED
    press = assess_jamming(DECK, Bearing(17.5, 10, -0.01))
    assert press.verdict is Verdict.CANNOT_ASSEMBLE
    assert np.all(press.table.interference > 0)
    never = assess_jamming(TiltedFourBar(10, 1, 2, 2, alpha=0.1))
    assert never.verdict is Verdict.CANNOT_ASSEMBLE
    assert np.isnan(never.table.interference).all()
    assert (never.table.status > 1).all()


def test_touching():
    bearing = Bearing()
    sine = bearing.critical_tilt("A").sine
    linkage = TiltedFourBar(alpha=math.asin(2.5 * sine))
    report = assess_jamming(linkage, bearing)
    assert report.verdict is Verdict.UNDECIDED
    assert any("contains 0" in note for note in report.notes)
    assert assess_jamming(linkage, bearing, certify=False).verdict is Verdict.TOUCHING_ESTIMATED
    assert report.arcs.touching == pytest.approx((math.pi / 2, 3 * math.pi / 2))


def test_partial_turn_is_said():
    report = assess_jamming(TiltedFourBar(2, 1, 1, 1, alpha=0.1))
    assert not report.full_turn.possible
    assert any("assembled crank angles only" in note for note in report.notes)


def test_units_do_not_matter():
    for factor in (1e-9, 1e9):
        scaled = TiltedFourBar(2 * factor, factor, 2.5 * factor, 2.5 * factor, alpha=1 / 30)
        arcs = jam_arcs(scaled, Bearing(17.5 * factor, 10 * factor, 0.03 * factor))
        assert arcs.arcs[0].start == pytest.approx(27.0592203251509475645179736478 * DEG, rel=1e-13)


def test_reversed_axis_exchanges_lids_only():
    forward = jam_arcs(TiltedFourBar(alpha=0.05, axis=(1, 2, 0)), Bearing())
    backward = jam_arcs(TiltedFourBar(alpha=-0.05, axis=(1, 2, 0)), Bearing())
    assert [a.start for a in forward.arcs] == pytest.approx([a.start for a in backward.arcs], rel=1e-14)


def test_report_is_plain_data():
    report = assess_jamming(DECK, samples=19)
    frame = report.table.to_pandas()
    assert list(frame.columns)[:3] == ["f", "status", "theta"]
    assert len(frame) == 19
    summary = report.summary()
    assert summary["condition"] == "A"
    assert summary["method"].startswith("certified") and summary["verdict"] == "CERTIFIED_JAMMED"
    assert "floats came in" in summary["statement"] and not summary["certificate"]["exact_input"]
    plain = assess_jamming(DECK, samples=19, certify=False).summary()
    assert "not certified" in plain["method"]
    assert plain["verdict"] == "JAMMED_ESTIMATED" and plain["certificate"] is None
    table = report.to_pandas()
    assert table["certainly_jams"].sum() == (table["interference"] > 0).sum() == 12
    assert table["certainly_free"].sum() == (table["interference"] < 0).sum() == 7
    with pytest.raises(GeometryError, match="neither"):
        assess_jamming()
    with pytest.raises(GeometryError, match="samples"):
        assess_jamming(DECK, samples=1)
    with pytest.raises(GeometryError, match="condition"):
        assess_jamming(DECK, condition="C")


def test_reports_begin_with_one_sentence_and_tell_all_on_request():
    assert all(verdict.sentence.endswith(".") and len(verdict.sentence) <= 100 for verdict in Verdict)
    for report in (assess_jamming(DECK), assess_jamming(TiltedFourBar(), Bearing(17.5, 10, 0.0))):
        lines, told = repr(report).splitlines(), report.details()
        assert lines[0] == report.verdict.sentence == told.splitlines()[0]
        assert len(lines) <= 10 and all(len(line) <= 120 for line in lines)
        assert report.statement in told and report.method in told and all(note in told for note in report.notes)
    assert "reason" in repr(report) and report.verdict is Verdict.UNDECIDED


def test_import_is_cheap():
    code = "import graphsynth.jamming, sys; print([m for m in ('pandas','scipy','matplotlib','sympy','networkx') if m in sys.modules])"
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"
    )


@pytest.mark.long
def test_a_motion_is_assessed_with_all_its_joints():
    """The same entry and the same words for any mechanism: three equal bearings are free up to 2 t_A.

    See theory/joints-that-share-a-tilt 6.
    """
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [
        Revolute(0, 1),
        Revolute(1, 2, (1.0, 0.0)),
        Revolute(2, 3, (2.5, 0.0), (2.5, 0.0)),
        Revolute(0, 3, (2, 0)),
    ]
    mechanism = Mechanism(graph, joints, [Driver(0, 1)])
    motion = simulate(mechanism, np.linspace(0.0, 2.0 * math.pi, 13))
    for factor, expected in ((0.99, Verdict.CERTIFIED_FREE), (1.01, Verdict.CERTIFIED_JAMMED)):
        tilt = Misalignment(0, 1, factor * 0.012128793118312840)
        report = assess_jamming(motion, tilt=tilt, joints=Bearing())
        assert report.verdict is expected and report.method == METHOD_CERTIFIED and report.certificate is not None
        assert report.summary()["verdict"] == expected.name and report.statement == report.certificate.reason
        assert list(report.to_pandas().columns)[:2] == ["input", "factor"]
        estimate = assess_jamming(motion, tilt=tilt, joints=Bearing(), certify=False)
        assert not estimate.verdict.is_certified and "not certified" in estimate.method
        assert estimate.verdict.is_free is expected.is_free
    single = assess_jamming(simulate(mechanism, [0.3]), tilt=tilt, joints=Bearing())
    assert single.verdict is Verdict.UNDECIDED and "one assembled sample" in single.statement


def test_arguments_of_the_other_model_are_refused():
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [
        Revolute(0, 1),
        Revolute(1, 2, (1.0, 0.0)),
        Revolute(2, 3, (2.5, 0.0), (2.5, 0.0)),
        Revolute(0, 3, (2, 0)),
    ]
    motion = simulate(Mechanism(graph, joints, [Driver(0, 1)]), [0.0, 0.1])
    tilt = Misalignment(0, 1, 0.01)
    for text, arguments, options in [
        ("samples does not go", (motion,), {"tilt": tilt, "joints": Bearing(), "samples": 5}),
        ("bearing does not go", (motion, Bearing()), {"tilt": tilt}),
        ("neither a Motion", (None,), {"tilt": tilt, "joints": Bearing()}),
        ("no axis is misaligned", (motion,), {"joints": Bearing()}),
        ("have no limits", (motion,), {"tilt": tilt}),
        ("pieces is no argument", (motion,), {"tilt": tilt, "joints": Bearing(), "pieces": 5}),
        ("tilt does not go", (DECK,), {"tilt": tilt}),
        ("tolerances does not go", (DECK,), {"tolerances": 1e-3}),
        ("no Bearing", (DECK, {(0, 1): Bearing()}), {}),
        ("neither a Motion", ("shutter",), {"tilt": tilt, "joints": Bearing()}),
        ("neither a Motion", (math.nan,), {}),
    ]:
        with pytest.raises(GeometryError, match=text):
            assess_jamming(*arguments, **options)


def test_what_lies_beyond_a_dead_centre_does_not_count():
    """The crank of (2, 1, 1, 1) stops at 75 degrees: the gap of 90 degrees is neither promised nor reported."""
    report = assess_jamming(ToleranceBox(2, 1, 1, 1, "0.05"))
    assert not report.full_turn.possible and report.verdict is Verdict.CERTIFIED_JAMMED
    f = np.linspace(*report.full_turn.limit_angles, 20_001)
    path = report.linkage.positions(np.concatenate([f, np.linspace(-1.3176, 1.3176, 20_001)]))
    seen = report.bearing.interference(path.sin_theta, path.cos_theta, "A")[path.assembled].max()
    assert report.worst_interference == pytest.approx(seen, rel=1e-4) and report.worst_interference >= seen - 1e-12
    said = float(re.search(r"at least ([-+.e\d]+) mm", report.statement)[1])
    assert said <= report.worst_interference < report.certificate.smallest_worst_interference.lo
    frame = report.to_pandas()
    assert frame["certainly_jams"].any() and not frame.loc[frame["status"] != 0, "certainly_jams"].any()
    never = assess_jamming(TiltedFourBar(10, 1, 1, 1), Bearing())
    assert never.verdict is Verdict.CANNOT_ASSEMBLE and math.isnan(never.worst_interference)
