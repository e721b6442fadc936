"""Certified verdicts and arcs: published values, exact references to 60 digits, adversarial cases."""

from __future__ import annotations

import math
import platform
import re
import subprocess
import sys
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Interval
from graphsynth.jamming import Bearing, ToleranceBox, Verdict, certify_jamming, spread
from graphsynth.mechanism.four_bar import TiltedFourBar

DEG = mpmath.mpf
F = Fraction


def reference(alpha, axis, lengths, R, H, c, condition, hole=None):
    """Largest gap, kappa and phase to 60 digits from the geometry itself (rotation matrix, distances of points)."""
    mp = mpmath.mp.clone()
    mp.dps = 60
    q = [mp.mpf(x.numerator) / x.denominator for x in map(F, (alpha, *axis, *lengths, R, H, c))]
    alpha, n1, n2, n3, l2, l3, R, H, c = q
    norm = mp.sqrt(n1**2 + n2**2 + n3**2)
    n1, n2, n3 = n1 / norm, n2 / norm, n3 / norm
    s, k = mp.sin(alpha), 1 - mp.cos(alpha)
    r31, r32 = n1 * n3 * k - n2 * s, n2 * n3 * k + n1 * s
    S = l2 / l3 * mp.sqrt(r31**2 + r32**2)
    C, h, Rh = mp.sqrt(1 - S**2), H / 2, R + c
    D_A = R * C + h * S if h * C >= R * S else mp.sqrt(R**2 + h**2)
    gaps = {"A": D_A - Rh, "B": R - (Rh * C - h * S)}
    if hole is not None:
        hole = mp.mpf(F(hole).numerator) / F(hole).denominator / 2
        gaps["general"] = min(D_A, (R + hole * S) / C) - Rh
    return gaps[condition], S, mp.atan2(-r31, r32)


def deck(**changes):
    return ToleranceBox(**{"alpha": "1/30", **changes})


@pytest.mark.parametrize(
    ("condition", "start", "stop"),
    [("A", "27.0592203251509475645179736478", "152.940779674849052435482026352"),
     ("B", "26.4519007718602215158671401366", "153.548099228139778484132859863")],
)  # fmt: skip
def test_published_arcs_lie_in_their_enclosures(condition, start, stop):
    found = certify_jamming(deck(), condition)
    assert found.verdict is Verdict.CERTIFIED_JAMMED and found.exact_input and found.assembles == "always"
    with mpmath.workdps(40):
        for half, arc in enumerate(found.arcs.arcs):
            for text, end in ((start, arc.start), (stop, arc.stop)):
                exact = mpmath.radians(mpmath.mpf(text) + 180 * half)
                assert end.lo <= exact <= end.hi
                assert end.width < 1e-14
    (one, two), (first, last) = found.arcs.inner, found.arcs.free
    assert one.start > found.arcs.outer[0].start and two.stop < found.arcs.outer[1].stop
    assert first.start == found.arcs.outer[0].stop and last.start == found.arcs.outer[1].stop
    assert found.arcs.jammed_part.width < 1e-14
    assert list(found.to_pandas()["kind"]).count("undecided") == 4


def test_published_tilts_gaps_and_the_statement():
    found = certify_jamming(deck())
    with mpmath.workdps(40):
        for text, enclosure in [
            ("0.0133312592085829611560698794957554253", found.largest_tilt),
            ("0.006064396559156420060266102798724801172486", found.critical_tilt),
            ("0.03509927307354575852847158852", found.largest_interference),
            ("0.03509927307354575852847158852", found.smallest_worst_interference),
        ]:
            assert enclosure.lo <= mpmath.mpf(text) <= enclosure.hi
            assert enclosure.width < 1e-15
    assert found.statement.startswith("proved: the bearing binds") and "0.0350992 mm" in found.statement  # down
    assert found.summary()["verdict"] == "CERTIFIED_JAMMED"
    assert found.witness is not None and found.witness.interference.lo > 0


def table_10_3(alpha, tol):
    return ToleranceBox(
        l2=spread(1, 0, tol), l3=spread("2.5", 0, tol), alpha=spread(alpha, 0, tol), azimuth="[-0.05, 0.05]",
        Rb="17.5 +- 0.005", Hb=spread(10, "0.05"), clearance="0.03 +- 0.003",
    )  # fmt: skip


def test_both_rows_of_the_published_tolerance_table():
    jammed, free = certify_jamming(table_10_3("1/30", "1e-4")), certify_jamming(table_10_3("0.0130", "1e-2"))
    assert jammed.verdict is Verdict.CERTIFIED_JAMMED
    assert free.verdict is Verdict.CERTIFIED_FREE
    with mpmath.workdps(40):
        for text, enclosure in [
            ("0.03845215250404404041426319", jammed.largest_interference),
            ("0.03174659891642157774855620", jammed.smallest_worst_interference),
            ("-0.0003274375372990500519939424", free.largest_interference),
        ]:
            assert enclosure.lo <= mpmath.mpf(text) <= enclosure.hi
            assert enclosure.width < 3e-16
    assert free.arcs.outer == () and free.clearance_left.lo > 0.000327
    assert free.arcs.kappa.lo > 1 and free.tilt_margin.lo > 0
    inner, outer = jammed.arcs.inner, jammed.arcs.outer
    assert len(inner) == len(outer) == 2 and len(jammed.arcs.undecided) == 4
    assert all(o.start < i.start < i.stop < o.stop for i, o in zip(inner, outer))


rational = st.fractions(max_denominator=10**6)
lengths = st.fractions(F(1, 2), 4, max_denominator=1000)


@pytest.mark.long
@settings(max_examples=30, deadline=None)
@given(
    st.fractions(F(1, 1000), F(3, 2), max_denominator=10**5),
    st.tuples(*[st.fractions(-1, 1, max_denominator=50)] * 3).filter(any),
    lengths, st.fractions(4, 9, max_denominator=1000),
    st.fractions(5, 30, max_denominator=1000), st.fractions(1, 40, max_denominator=1000),
    st.fractions(F(1, 10**4), 1, max_denominator=10**5), st.sampled_from(["A", "B", "general"]),
)  # fmt: skip
def test_verdicts_and_enclosures_against_sixty_digits(alpha, axis, l2, l3, R, H, c, condition):
    hole = H / 3
    gap, S, phase = reference(alpha, axis, (l2, l3), R, H, c, condition, hole)
    box = ToleranceBox(6, l2, l3, 6, alpha, axis, Rb=R, Hb=H, clearance=c, hole_length=hole)
    found = certify_jamming(box, condition)
    assert found.largest_interference.lo <= gap <= found.largest_interference.hi
    assert found.largest_interference.width <= 1e-14 * float(R + H)
    if abs(gap) > 1e-13:
        assert found.verdict is (Verdict.CERTIFIED_JAMMED if gap > 0 else Verdict.CERTIFIED_FREE)
    off = mpmath.fmod(phase - mpmath.mpf(found.arcs.phase.mid), mpmath.pi)
    assert min(abs(off), mpmath.pi - abs(off)) < 1e-14 or S == 0


def critical_alpha(condition="A", digits=60):
    """Decimal text of the tilt at which the deck touches."""
    with mpmath.workdps(digits + 10):
        c, R, h = mpmath.mpf("0.03"), mpmath.mpf("17.5"), mpmath.mpf(5)
        w = mpmath.sqrt(h * h - c * (2 * R + c)) if condition == "A" else mpmath.sqrt(h * h + c * (2 * R + c))
        q = c / (h + w)
        return mpmath.asin(mpmath.mpf("2.5") * 2 * q / (1 + q * q))


@pytest.mark.long
@pytest.mark.parametrize("condition", ["A", "B"])
def test_never_a_wrong_certificate_beside_the_touching_tilt(condition):
    edge = critical_alpha(condition)
    for exponent in range(6, 40):
        for sign in (1, -1):
            with mpmath.workdps(70):
                text = mpmath.nstr(edge * (1 + sign * mpmath.mpf(10) ** -exponent), 60)
            verdict = certify_jamming(ToleranceBox(alpha=text), condition).verdict
            right = Verdict.CERTIFIED_JAMMED if sign > 0 else Verdict.CERTIFIED_FREE
            assert verdict in (right, Verdict.UNDECIDED)
            if exponent <= 12:
                assert verdict is right


def test_touching_exactly_is_never_decided():
    # h^2 = c (2R + c): 3, 4, 5 triangle; R = 4, h = 3, Rh = 5; whatever the tilt, contact but no overlap
    for alpha in ("1/30", "0.5", "1.5"):
        found = certify_jamming(ToleranceBox(1, 1, 1, 1, alpha, Rb=4, Hb=6, clearance=1))
        assert found.verdict in (Verdict.UNDECIDED, Verdict.CERTIFIED_FREE)
        assert found.arcs.inner == ()
    assert found.verdict is Verdict.UNDECIDED and "never overlap" in found.reason
    wider = certify_jamming(ToleranceBox(1, 1, 1, 1, "1.5", Rb=4, Hb=6, clearance="1.000000001"))
    tighter = certify_jamming(ToleranceBox(1, 1, 1, 1, "1.5", Rb=4, Hb=6, clearance="0.999999999"))
    assert (wider.verdict, tighter.verdict) == (Verdict.CERTIFIED_FREE, Verdict.CERTIFIED_JAMMED)


def test_no_clearance():
    found = certify_jamming(deck(clearance=0))
    assert found.verdict is Verdict.CERTIFIED_JAMMED  # a tilt exists, and any tilt jams
    assert "touches at the two angles without" in found.arcs.reason
    assert found.arcs.free == () and found.arcs.jammed_part.lo > 1 - 1e-14
    still = certify_jamming(deck(alpha=0, clearance=0))
    assert still.verdict is Verdict.UNDECIDED and "touching" in still.reason
    assert still.arcs.inner == () and still.arcs.free == ()
    thin = certify_jamming(deck(clearance=0, Hb=0))
    assert thin.verdict is Verdict.UNDECIDED and thin.arcs.free == ()


def test_interference_fit_cannot_be_assembled():
    press = certify_jamming(deck(clearance="-0.01"))
    assert press.verdict is Verdict.CANNOT_ASSEMBLE and "interference" in press.statement
    mixed = certify_jamming(deck(alpha="0.001", clearance="[-0.01, 0.1]"))
    assert mixed.verdict is Verdict.CERTIFIED_JAMMED_FOR_SOME
    assert certify_jamming(deck(alpha=0, clearance="[-0.01, 0.1]")).verdict is Verdict.UNDECIDED


def test_linkage_that_never_assembles():
    found = certify_jamming(deck(l1=10, l3=2, l4=2))
    assert (found.verdict, found.assembles) == (Verdict.CANNOT_ASSEMBLE, "never")


def test_jam_that_cannot_be_reached_is_not_claimed():
    # the crank of (10, 9, 2, 2) is assembled near f = 0 only, where the pin is in the plane: the jam is out of reach
    found = certify_jamming(ToleranceBox(10, 9, 2, 2, "0.003"))
    assert found.assembles == "at some angles"
    assert found.verdict is Verdict.UNDECIDED and "assembled" in found.reason


def test_zero_tilt_and_vertical_axis_are_free():
    for box in (deck(alpha=0), deck(axis=(0, 0, 1)), deck(axis=(0, 0, 1), alpha=3)):
        found = certify_jamming(box)
        assert found.verdict is Verdict.CERTIFIED_FREE and "no tilt" in found.arcs.reason
        assert found.largest_interference.hi == pytest.approx(-0.03, rel=1e-15)
        assert found.arcs.free[0].length == math.tau


def test_tiny_tilt_keeps_its_digits():
    found = certify_jamming(deck(alpha="1e-8"))
    with mpmath.workdps(40):  # 14.4
        assert (
            found.largest_interference.lo
            <= mpmath.mpf("-0.02999998000000014000000033333")
            <= found.largest_interference.hi
        )


def test_upright_tilt():
    for condition in ("A", "B"):
        found = certify_jamming(ToleranceBox(4, 2, 2, 5, "1.5707963267948966192", Rb=10, Hb=4), condition)
        assert found.verdict is Verdict.CERTIFIED_JAMMED and found.largest_tilt.hi > 1.5


@pytest.mark.parametrize("factor", ["1e-9", "1e9"])
def test_units_do_not_matter(factor):
    f = F(factor)
    for alpha in ("1/30", "0.0151", "0.0152"):
        plain = certify_jamming(deck(alpha=alpha))
        for kind in ("lengths", "bearing"):
            other = {"l1": 2 * f, "l2": f, "l3": F("2.5") * f, "l4": F("2.5") * f}
            if kind == "bearing":
                other = {"Rb": F("17.5") * f, "Hb": 10 * f, "clearance": F("0.03") * f}
            scaled = certify_jamming(deck(alpha=alpha, **other))
            assert scaled.verdict is plain.verdict
            for one, two in zip(plain.arcs.arcs, scaled.arcs.arcs):
                assert one.start.lo <= two.start.hi and two.start.lo <= one.start.hi
                assert two.start.width < 4e-15 / abs(math.cos(two.start.mid))  # the condition of the arcsine


def test_a_jam_for_some_names_exact_parameters():
    found = certify_jamming(deck(clearance="[0.03, 0.1]", l2="1 +- 0.001"))
    assert found.verdict is Verdict.CERTIFIED_JAMMED_FOR_SOME
    assert found.witness is not None
    assert (found.witness.parameters["clearance"], found.witness.parameters["l2"]) == ("0.03", "1.001")
    assert found.arcs.inner == () and "depends on the parameters" in found.arcs.reason
    _check_witness(found)
    floats = certify_jamming(deck(clearance=(0.03, 0.1), l2=(0.9, 1.07)))
    assert F(floats.witness.parameters["clearance"]) == F(0.03) and F(floats.witness.parameters["l2"]) == F(1.07)
    _check_witness(floats)
    assert found.largest_interference.lo > 0 > found.smallest_worst_interference.hi


def _check_witness(found):
    """Evaluate the witness to 60 digits, at its own crank angle."""
    p = {name: F(text) for name, text in found.witness.parameters.items()}
    axis, lengths = (p["n1"], p["n2"], p["n3"]), (p["l2"], p["l3"])
    _, S, phase = reference(p["alpha"], axis, lengths, p["Rb"], p["Hb"], p["clearance"], found.condition)
    with mpmath.workdps(60):
        f = mpmath.mpf(found.witness.f.mid) - p["azimuth"].numerator / mpmath.mpf(p["azimuth"].denominator)
        S, R, h, c = abs(S * mpmath.sin(f - phase)), *(mpmath.mpf(v.numerator) / v.denominator for v in (
            p["Rb"], p["Hb"] / 2, p["clearance"]))  # fmt: skip
        assert h * mpmath.sqrt(1 - S * S) > R * S
        assert h * S - c - R * (1 - mpmath.sqrt(1 - S * S)) >= found.witness.interference.lo - 1e-15


def test_results_are_refused_after_a_library_has_changed_the_rounding():
    code = """
import ctypes, ctypes.util
from graphsynth.jamming import ToleranceBox, certify_jamming
certify_jamming(ToleranceBox())
ctypes.CDLL(ctypes.util.find_library("m")).fesetround(0x800)
try:
    certify_jamming(ToleranceBox())
except Exception as error:
    print(type(error).__name__, error)
"""
    if platform.machine() not in ("x86_64", "AMD64"):
        pytest.skip("the code of the rounding mode is that of x86")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "GraphsynthError" in done.stdout and "round to nearest" in done.stdout


def test_arcs_that_merge_and_phases_that_are_unknown():
    near = certify_jamming(deck(azimuth="[-0.5, 0.5]"))  # free pieces vanish for some azimuth
    assert near.verdict is Verdict.CERTIFIED_JAMMED
    assert near.arcs.outer[0].length == math.tau and near.arcs.free == ()
    assert len(near.arcs.inner) == 2
    lost = certify_jamming(deck(axis=("[-1, 1]", "[-1, 1]", 1)))
    assert lost.arcs.inner == () and "direction" in lost.arcs.reason
    turned = certify_jamming(deck(azimuth="6.4"))
    shift = [
        (b.start.mid - a.start.mid - 6.4) % math.pi for a, b in zip(certify_jamming(deck()).arcs.arcs, turned.arcs.arcs)
    ]
    assert all(min(s, math.pi - s) < 1e-14 for s in shift)
    assert all(-1e-14 <= arc.start.lo < math.tau for arc in turned.arcs.arcs)


def test_parts_of_the_turn():
    found = certify_jamming(deck())
    edge = found.arcs.arcs[0].start
    free, jams, open_ = Verdict.CERTIFIED_FREE, Verdict.CERTIFIED_JAMMED, Verdict.UNDECIDED
    assert found.over(0.0, edge.lo - 1e-14) is free and found.over(0.0, edge.hi + 1e-14) is jams
    assert found.over(0.0, edge.mid) is open_
    assert found.over(6.1, 0.3) is free and found.over(6.1 + 4 * math.tau, 0.3) is free  # across the full turn
    assert found.over(3.0, 3.2) is free and found.over(-3.2, -3.0) is free
    assert found.over(math.pi / 2, 1.5 * math.pi) is jams  # the working stroke
    assert found.over(0.0, 100.0) is found.verdict
    assert found.over(1.5, 1.5) is jams and found.over(0.1, 0.1) is free
    some = certify_jamming(deck(clearance="[0.03, 0.1]"))
    assert some.over(1.0, 2.0) is open_ and some.over(-0.4, 0.4) is free
    partly = certify_jamming(ToleranceBox(2, 1, 1, 1, "1/30"))
    assert partly.over(2.0, 2.5) is open_  # jams if it could get there
    with pytest.raises(GeometryError, match="finite"):
        found.over(0.0, math.nan)


def test_reversed_axis_and_negative_tilt_have_the_same_zones():
    base = certify_jamming(deck(axis=(1, 2, 0)))
    for other in (deck(axis=(-1, -2, 0)), deck(axis=(1, 2, 0), alpha="-1/30"), deck(axis=(1, 2, 0), convention="deck")):
        found = certify_jamming(other)
        assert found.verdict is base.verdict
        for one, two in zip(base.arcs.arcs, found.arcs.arcs):
            assert one.start.lo <= two.start.hi and two.start.lo <= one.start.hi


def test_floats_are_marked():
    found = certify_jamming(ToleranceBox.of(TiltedFourBar(alpha=1 / 30), Bearing()))
    assert not found.exact_input and "floats came in" in found.statement
    assert certify_jamming(deck()).exact_input


def test_the_deck_rod():
    found = certify_jamming(deck(rod="deck"))
    with mpmath.workdps(40):
        for text, arc in zip(("27.0597585332963475926436265901", "207.0597585332963475926436265901"), found.arcs.arcs):
            assert arc.start.lo <= mpmath.radians(mpmath.mpf(text)) <= arc.start.hi


@pytest.mark.long
@settings(max_examples=40, deadline=None)
@given(st.data())
def test_arcs_hold_every_member_of_a_box(data):
    draw = data.draw
    alpha = draw(st.fractions(F(1, 100), F(1, 5), max_denominator=1000))
    axis = draw(st.sampled_from([(1, 0, 0), (-1, 2, 0), (2, -1, 2), (-1, F(-1, 3), F(1, 4))]))
    tolerance = draw(st.fractions(0, F(1, 20), max_denominator=1000))
    condition = draw(st.sampled_from(["A", "B"]))
    values = {"l2": 1, "l3": F(5, 2), "alpha": alpha, "Rb": F(35, 2), "Hb": 10, "clearance": F(3, 100)}
    box = ToleranceBox(
        axis=axis, azimuth=f"0 +- {tolerance}", **{k: spread(v, 0, tolerance) for k, v in values.items()}
    )
    found = certify_jamming(box, condition)
    u = {name: draw(st.fractions(0, 1, max_denominator=100)) for name in (*values, "azimuth")}
    point = box.replace(**{name: box[name].lower + u[name] * (box[name].upper - box[name].lower) for name in u})
    linkage, bearing = point.nominal()
    f = np.linspace(0.0, math.tau, 721)
    path = linkage.positions(f)
    gap = bearing.interference(path.sin_theta, path.cos_theta, condition)
    from graphsynth.jamming.bearing.arcs import contains

    for angle, g in zip(f, gap):
        if g > 1e-12:
            assert contains(found.arcs.outer, angle + 0.0) or _near(found.arcs.outer, angle)
        if g < -1e-12:
            assert not any(_inside(span, angle) for span in found.arcs.inner)
    assert found.largest_interference.hi >= gap.max() - 1e-14
    assert (found.verdict is not Verdict.CERTIFIED_FREE) or gap.max() < 1e-14
    assert (found.verdict is not Verdict.CERTIFIED_JAMMED) or gap.max() > -1e-5


def _near(spans, angle, eps=1e-12):
    return any(min((angle - end) % math.tau, (end - angle) % math.tau) < eps for span in spans for end in span)


def _inside(span, angle, eps=1e-12):
    return eps < (angle - span.start) % math.tau < span.stop - span.start - eps


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"clearance": "[0.1, 0.03]"}, "exchange"),
        ({"clearance": math.nan}, "not a finite number"),
        ({"clearance": "0,03"}, "not a finite number"),
        ({"clearance": -20}, "leaves no hole"),
        ({"Rb": 0}, "positive"),
        ({"Hb": "0 +- 1"}, "zero or more"),
        ({"l3": "1 +- 2"}, "positive"),
        ({"axis": (0, 0, 0)}, "zero vector"),
        ({"axis": (1, 0)}, "three components"),
        ({"rod": "soft"}, "rod"),
        ({"alpha": True}, "not a finite number"),
        ({"alpha": "1e999999"}, "not a finite number"),
        ({"alpha": "1/0"}, "not a finite number"),
    ],
)
def test_bad_input_gets_a_sentence(changes, words):
    with pytest.raises(GeometryError, match=words):
        deck(**changes)


def test_general_needs_a_hole_and_condition_a_name():
    with pytest.raises(GeometryError, match="hole_length"):
        certify_jamming(deck(), "general")
    with pytest.raises(GeometryError, match="condition"):
        certify_jamming(deck(), "C")
    with pytest.raises(GeometryError, match="no parameter"):
        deck().replace(colour=3)
    with pytest.raises(AttributeError, match="does not change"):
        deck().sgn = -1


@pytest.mark.parametrize("alpha", ["1/30", "0.013", "0.0151", "0.02"])
@pytest.mark.parametrize("condition", ["A", "B"])
def test_numbers_in_sentences_are_bounds_too(alpha, condition):
    """A proved sentence must not promise more than its certificate because a number was rounded to nearest."""
    for box in (deck(alpha=alpha), deck(alpha=alpha, clearance="0.03 +- 0.02")):
        found = certify_jamming(box, condition)
        said = re.search(r"at least ([-+.e\d]+) mm", found.statement)
        proved = {
            Verdict.CERTIFIED_FREE: -found.largest_interference.hi,
            Verdict.CERTIFIED_JAMMED: found.smallest_worst_interference.lo,
            Verdict.CERTIFIED_JAMMED_FOR_SOME: found.largest_interference.lo,
        }[found.verdict]  # fmt: skip
        assert 0 < F(said[1]) <= F(proved) and F(said[1]) > F(proved) * (1 - F(1, 10**5))


def test_gap_of_a_range_that_begins_with_interference():
    """The largest gap counts the members with interference: at no tilt it is minus the smallest clearance."""
    found = certify_jamming(ToleranceBox(clearance="[-0.01, 0.01]"))
    assert found.verdict is Verdict.UNDECIDED and "interference" in found.reason
    assert (
        F(1, 100) in (F(found.largest_interference.lo), F(found.largest_interference.hi))
        or 0.01 in found.largest_interference
    )
    assert -0.01 in found.smallest_worst_interference and not found.arcs.free


def test_what_is_no_tolerance_box_or_no_number_is_refused():
    with pytest.raises(GeometryError, match="no ToleranceBox"):
        certify_jamming(None)
    for value, text in [
        (b"0.03", "not a finite number"), (np.bool_(True), "not a finite number"), ("0.03 +- -1", "negative tolerance"),
        (Interval([1, 2]), "array of shape"),
    ]:  # fmt: skip
        with pytest.raises(GeometryError, match=text):
            deck(clearance=value)
    assert deck(Hb=np.int64(10)).exact_input and not deck(Hb=np.float32(10)).exact_input


def test_numbers_at_the_ends_of_the_range_of_doubles():
    tiny = certify_jamming(deck(axis=(1e-320, 0, 0)))
    assert (
        tiny.verdict is certify_jamming(deck()).verdict
        and tiny.largest_interference == certify_jamming(deck()).largest_interference
    )
    wide = certify_jamming(ToleranceBox(alpha="1/30", rod="deck", Hb=0, clearance="1e20"), "B")
    assert wide.verdict is Verdict.CERTIFIED_FREE


def test_extended_precision_is_not_rounded_on_the_way_in():
    value = np.longdouble(3) / 100
    found = ToleranceBox(clearance=value)["clearance"]
    assert found.lower == found.upper == F(*value.as_integer_ratio()) and not found.exact
    between = ToleranceBox(clearance=(value, value))["clearance"].outer
    assert F(float(between.lo)) <= F(*value.as_integer_ratio()) <= F(float(between.hi))
