"""Bearing contact, critical tilt and areas against published values, 50 digits, quadrature and brute force."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.areas import (
    ellipse_circle,
    ellipse_circle_stable,
    lid_area,
    lid_intersection,
    rim_area,
    rim_intersection,
    surrogate_areas,
)
from graphsynth.jamming.bearing.bearing import Bearing

DECK = Bearing()


def close(got, expected, rel=1e-13):
    assert float(got) == pytest.approx(expected, rel=rel, abs=0)


def test_critical_tilts():
    close(DECK.critical_tilt("A").angle, 0.006064396559156420060266102798724801172486, 1e-15)
    close(DECK.critical_tilt("B").angle, 0.005938219994357610895366507614303110074863, 1e-15)
    for condition in ("A", "B"):
        found = DECK.critical_tilt(condition)
        close(found.sine, math.sin(found.angle), 4e-16)
        assert abs(float(DECK.interference(found.sine, math.cos(found.angle), condition))) < 1e-17


@pytest.mark.parametrize(
    ("R", "hp", "hh", "t", "D"),
    [
        (1, 2, 2, 0.1, 1.194670998571682070709190),
        (1, 2, 1, 0.1, 1.105355590485905973523194),
        (1, 2, 1, 1.2, 2.236067977499789696409174),
        (1, 0.5, 3, 0.2, 1.079401243238772238853903),
    ],
)
def test_general_pin(R, hp, hh, t, D):
    bearing = Bearing(R, 2 * hp, 0.05, hole_length=2 * hh)
    close(bearing.interference(math.sin(t), math.cos(t), "general") + bearing.Rh, D, 1e-15)


@settings(max_examples=30, deadline=None)
@given(st.floats(0.2, 3), st.floats(0.05, 3), st.floats(0.05, 3), st.floats(0.0, 1.5))
def test_general_pin_against_brute_force(R, hp, hh, t):
    """Farthest point of the pin inside the slab |z| <= hh, sampled on the mantle and on the rims."""
    angle = np.linspace(0, math.pi, 721)
    z = np.linspace(-hp, hp, 801)[:, None]
    S, C = math.sin(t), math.cos(t)
    x = R * np.cos(angle) * C + z * S
    y = R * np.sin(angle) + 0 * z
    height = z * C - R * np.cos(angle) * S
    # cut every generator exactly at the slab
    with np.errstate(divide="ignore", invalid="ignore"):
        cuts = [np.clip((side * hh + R * np.cos(angle) * S) / C, -hp, hp) for side in (1, -1)]
    reach = [np.hypot(R * np.cos(angle) * C + cut * S, R * np.sin(angle)) for cut in cuts]
    inside = [np.abs(cut * C - R * np.cos(angle) * S) <= hh * (1 + 1e-12) for cut in cuts]
    candidates = [np.where(np.abs(height) <= hh, np.hypot(x, y), 0).max()]
    candidates += [np.where(ok, r, 0).max() for ok, r in zip(inside, reach)]
    bearing = Bearing(R, 2 * hp, 0.0, hole_length=2 * hh)
    assert float(bearing.interference(S, C, "general")) + R == pytest.approx(max(candidates), rel=2e-4)


@settings(max_examples=100, deadline=None)
@given(st.floats(0.1, 100), st.floats(0.05, 5), st.floats(1e-9, 0.1), st.floats(0.0, 1.5))
def test_gaps_against_fifty_digits(R, ratio, relative, t):
    bearing = Bearing(R, R * ratio, R * relative)
    S, C = math.sin(t), math.cos(t)
    with mp.workdps(50):
        r, h, c, s = mp.mpf(bearing.Rb), mp.mpf(bearing.Hb) / 2, mp.mpf(bearing.clearance), mp.mpf(S)
        k = mp.sqrt(1 - s * s)
        gA = (r * k + h * s if r * s <= h * k else mp.hypot(r, h)) - (r + c)
        gB = r - ((r + c) * k - h * s)
        size = float(h * s + c + r * s * s)
    assume(abs(R * S - R * ratio / 2 * C) > 1e-9)  # the branch itself
    assert float(bearing.interference(S, C, "A")) == pytest.approx(float(gA), rel=1e-14, abs=1e-15 * size)
    # C is rounded; only S^2 / (1 + C) sees it
    assert float(bearing.interference(S, C, "B")) == pytest.approx(float(gB), rel=1e-14, abs=1e-15 * size)


@settings(max_examples=100, deadline=None)
@given(st.floats(0.1, 100), st.floats(0.05, 5), st.floats(1e-9, 0.1))
def test_critical_tilt_against_the_cross_check_forms(R, ratio, relative):
    bearing = Bearing(R, R * ratio, R * relative)
    with mp.workdps(60):
        r, h = mp.mpf(bearing.Rb), mp.mpf(bearing.Hb) / 2
        c = mp.mpf(bearing.clearance)
        rh = r + c
        tB = mp.acos(r / mp.hypot(rh, h)) - mp.atan(h / rh)
        close(bearing.critical_tilt("B").angle, float(tB), 2e-15)
        if h * h > c * (2 * r + c):
            tA = mp.atan(h / r) - mp.acos(rh / mp.hypot(r, h))
            room = float(1 - c * (2 * r + c) / (h * h))  # the root is ill-conditioned where both modes of contact meet
            close(bearing.critical_tilt("A").angle, float(tA), 2e-15 / room + 1e-15)
        else:
            assert bearing.critical_tilt("A").angle is None


def test_no_critical_tilt():
    assert Bearing(17.5, 1.0, 0.03).critical_tilt("A").angle is None
    assert "h^2 < c" in Bearing(17.5, 1.0, 0.03).critical_tilt("A").reason
    assert Bearing(17.5, 1.0, 0.03).critical_tilt("B").angle is not None
    thin = Bearing(17.5, 0.0, 0.03)
    assert thin.critical_tilt("A").angle is None
    close(thin.critical_tilt("B").angle, 0.05851222627558999787339087, 1e-14)  # arccos(R / Rh); c = Rh - R is rounded
    touch = Bearing(4.0, 6.0, 1.0).critical_tilt("A")  # h^2 = 9 = c (2R + c)
    assert "never overlap" in touch.reason
    close(touch.angle, 2 * math.atan(1 / 3), 1e-15)
    assert float(Bearing(4.0, 6.0, 1.0).interference(1.0, 0.0, "A")) == 0.0
    assert "interference" in Bearing(17.5, 10, -0.01).critical_tilt("A").reason
    assert Bearing(17.5, 10, 0.0).critical_tilt("A").angle == 0.0


def test_general_critical_tilt_is_where_the_gap_vanishes():
    for bearing in (Bearing(1, 4, 0.1, hole_length=2), Bearing(1, 1, 0.05, hole_length=6), Bearing(1, 2.2, 0.3, 2.0)):
        found = bearing.critical_tilt("general")
        assert abs(float(bearing.interference(found.sine, math.cos(found.angle), "general"))) < 1e-15


@pytest.mark.parametrize(
    "arguments", [{"Rb": 0}, {"Hb": -1}, {"clearance": math.nan}, {"clearance": -17.5}, {"hole_length": 0}]
)
def test_bad_dimensions(arguments):
    with pytest.raises(GeometryError, match=next(iter(arguments))):
        Bearing(**arguments)


def test_bad_condition():
    with pytest.raises(GeometryError, match="condition"):
        DECK.interference(0.1, 0.9, "C")
    with pytest.raises(GeometryError, match="hole_length"):
        DECK.interference(0.1, 0.9, "general")


def test_monotone_gap():
    t = np.linspace(0, math.pi / 2, 4001)
    for condition in ("A", "B"):
        assert np.all(np.diff(DECK.interference(np.sin(t), np.cos(t), condition)) >= -1e-14)


# areas ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("R1", "pa", "qb", "ell", "cir"),
    [
        (5.0, 1.0, 1.0, 8.345778368199523218975473074, 11.48737102178931645743811646),
        (1.0, 9.0, 0.9, 2.742918043625145128948858904, 2.742918043625145128948858904),
        (1.0, 1e-9, 1e-9, 1.999999998429203672788436714e-9, 2.000000001570796326378229953e-9),
        (1.0, 1e-12, 0.5, 2.177324215805273540088654111e-18, 1.570796326793325825081851011),
    ],
)
def test_crescents(R1, pa, qb, ell, cir):
    got = ellipse_circle_stable(R1, pa, qb)
    close(got.ellipse_only, ell, 3e-15)
    close(got.circle_only, cir, 3e-15)


def test_crescent_direct_form():
    got = ellipse_circle([5.0, 17.53], [6.0, 17.5 / math.cos(0.06)], [4.0, 17.5])
    np.testing.assert_allclose(
        got.ellipse_only, [8.345778368199523218975473074, 0.01607824197607069187615058061], rtol=1e-11
    )
    np.testing.assert_allclose(
        got.circle_only, [11.48737102178931645743811646, 1.583173498318460594385361309], rtol=1e-12
    )
    inside, outside = ellipse_circle([3.0, 1.0, 2.0], [2.0, 2.0, 2.0], [1.0, 1.5, 2.0])
    np.testing.assert_allclose(inside, [0, math.pi * 2, 0], atol=1e-15)
    np.testing.assert_allclose(outside, [math.pi * 7, 0, 0], atol=1e-15)
    with pytest.raises(GeometryError):
        ellipse_circle(1.0, 1.0, 2.0)


@settings(max_examples=150, deadline=None)
@given(st.floats(0.1, 10), st.floats(-12, 0.5), st.floats(-12, -0.05))
def test_stable_crescents_against_fifty_digits(R1, log_pa, log_qb):
    pa, qb = R1 * 10**log_pa, R1 * 10**log_qb
    with mp.workdps(60):
        r, a, b = mp.mpf(R1), mp.mpf(R1) + mp.mpf(pa), mp.mpf(R1) - mp.mpf(qb)
        x = a * mp.sqrt((r * r - b * b) / (a * a - b * b))
        y = b * mp.sqrt((a * a - r * r) / (a * a - b * b))
        ell = 2 * (a * b * mp.atan2(a * y, b * x) - r * r * mp.atan2(y, x))
        cir = 2 * (r * r * mp.atan2(x, y) - a * b * mp.atan2(b * x, a * y))
        got = ellipse_circle_stable(R1, pa, qb)
        close(got.ellipse_only, float(ell), 8e-15)
        close(got.circle_only, float(cir), 8e-15)


def _disc_minus_lid(R, Rh, h, t):
    """Area by strips y = const, midpoint rule in the angle: the independent path of theory/circle-and-ellipse 4."""
    count = 400_000
    angle = (np.arange(count) + 0.5) * (0.5 * math.pi / count)
    y, half = R * np.sin(angle), R * np.cos(angle)
    lid, d = Rh * math.cos(t) * np.sqrt(1.0 - (y / Rh) ** 2), h * math.sin(t)
    overlap = np.maximum(0.0, np.minimum(half, d + lid) - np.maximum(-half, d - lid))
    return 2.0 * float(np.sum((2.0 * half - overlap) * half)) * (0.5 * math.pi / count)


@pytest.mark.parametrize(
    ("R", "c", "h", "t"),
    [(1.0, 0.05, 0.4, 0.3), (1.0, 0.2, 2.0, 0.7), (2.0, 0.1, 0.3, 1.0), (1.0, 0.02, 0.5, 1.4), (1.0, 0.05, 3.0, 1.2)],
)
def test_lid_area_against_quadrature(R, c, h, t):
    bearing = Bearing(R, 2 * h, c)
    exact = _disc_minus_lid(bearing.Rb, bearing.Rh, h, t)
    assert float(lid_area(bearing, math.sin(t), math.cos(t))) == pytest.approx(exact, rel=1e-9)


def _lid_direct(R, Rh, h, t):
    with mp.workdps(60):
        q, p, d = Rh, Rh * mp.cos(t), h * mp.sin(t)
        # crossing: (x - d)^2 / p^2 + y^2 / q^2 = 1 with y^2 = R^2 - x^2, smaller root
        A, B, C = 1 / p**2 - 1 / q**2, -2 * d / p**2, d * d / p**2 + R * R / q**2 - 1
        x = (-B - mp.sqrt(B * B - 4 * A * C)) / (2 * A)
        X, y = -x, mp.sqrt(R * R - x * x)
        s1, s2 = mp.atan2(y, X), mp.atan2(y / q, (d + X) / p)
        return R * R * s1 + d * y - p * q * s2


@settings(max_examples=100, deadline=None)
@given(st.floats(0.1, 100), st.floats(0.1, 4), st.floats(1e-6, 0.05), st.floats(0.001, 3))
def test_lid_area_against_the_direct_form(R, ratio, relative, beyond):
    """60 digits; the tilt is taken beyond the critical one, up to where the second crescent would begin."""
    bearing = Bearing(R, R * ratio, R * relative)
    t = bearing.critical_tilt("B").angle * (1 + beyond)
    S = math.sin(t)
    C = math.cos(t)
    assume(bearing.Rh * C + bearing.h * S > bearing.Rb and bearing.h * S - bearing.Rh * C < bearing.Rb)
    with mp.workdps(60):
        s = mp.mpf(S)
        exact = _lid_direct(
            mp.mpf(bearing.Rb), mp.mpf(bearing.Rb) + mp.mpf(bearing.clearance), mp.mpf(bearing.h), mp.asin(s)
        )
    # the area grows like gap^(3/2); the gap has the absolute error of its largest term
    gap, size = float(bearing.interference(S, C, "B")), bearing.h * S + bearing.clearance
    close(lid_area(bearing, S, C), float(exact), 2e-14 + 1e-15 * size / gap)


@settings(max_examples=100, deadline=None)
@given(st.floats(0.1, 100), st.floats(0.3, 4), st.floats(1e-6, 0.01), st.floats(0.001, 3))
def test_rim_area_against_the_direct_form(R, ratio, relative, beyond):
    bearing = Bearing(R, R * ratio, R * relative)
    critical = bearing.critical_tilt("A")
    assume(critical.angle is not None)
    t = critical.angle * (1 + beyond)
    S, C = math.sin(t), math.cos(t)
    assume(bearing.Rb * S <= bearing.h * C and bearing.h * S - bearing.Rb * C < bearing.Rh)
    gap, size = float(bearing.interference(S, C, "A")), bearing.h * S + bearing.clearance
    assume(gap > 1e-6 * size)
    with mp.workdps(60):
        s = mp.mpf(S)
        k = mp.sqrt(1 - s * s)
        r, rh, h = mp.mpf(bearing.Rb), mp.mpf(bearing.Rb) + mp.mpf(bearing.clearance), mp.mpf(bearing.h)
        p, d = r * k, h * s
        A, B, K = 1 / p**2 - 1 / r**2, -2 * d / p**2, d * d / p**2 + rh * rh / r**2 - 1
        x = (-B - mp.sqrt(B * B - 4 * A * K)) / (2 * A)
        other = (-B + mp.sqrt(B * B - 4 * A * K)) / (2 * A)
        x = x if abs(x) <= rh else other
        y = mp.sqrt(rh * rh - x * x)
        exact = p * r * mp.atan2(y / r, (x - d) / p) - rh * rh * mp.atan2(y, x) + d * y
    area, quadrature = rim_area(bearing, S, C)
    assert not quadrature
    close(area, float(exact), 1e-13 + 4e-15 * size / gap)


@pytest.mark.long
def test_steep_rim_uses_quadrature():
    bearing = Bearing(1.0, 1.6, 0.1)
    t = 1.2
    assert bearing.Rb * math.sin(t) > bearing.h * math.cos(t)
    area, quadrature = rim_area(bearing, math.sin(t), math.cos(t))
    assert quadrature
    # independent path: count points of a fine grid
    x, y = np.meshgrid(np.linspace(-2, 2, 4001), np.linspace(-1, 1, 2001))
    p, d = math.cos(t), 0.8 * math.sin(t)
    count = np.sum((((x - d) / p) ** 2 + y * y <= 1) & (x * x + y * y > 1.1**2)) * 1e-6
    assert float(area) == pytest.approx(count, rel=1e-2)


def test_areas_of_a_straight_pose():
    S, C = np.zeros(1), np.ones(1)
    np.testing.assert_allclose(
        surrogate_areas(DECK, S, C).ellipse_only, 3.30149971965751371430039193148842958, rtol=4e-16
    )
    assert surrogate_areas(DECK, S, C).circle_only == 0.0
    assert lid_area(DECK, S, C) == 0.0
    assert rim_area(DECK, S, C)[0] == 0.0


def test_lid_area_is_bounded_by_the_disc_and_monotone():
    t = np.linspace(0, math.pi / 2, 500)
    area = lid_area(DECK, np.sin(t), np.cos(t))
    assert np.all(np.diff(area) >= -1e-9)
    close(area[-1], math.pi * 17.5**2, 1e-15)


def test_zero_clearance():
    bearing = Bearing(17.5, 10.0, 0.0)
    S = 0.4 * math.sin(1 / 30) * np.array([0.0, math.sin(math.radians(1)), 1.0])
    C = np.sqrt(1 - S * S)
    np.testing.assert_allclose(
        bearing.interference(S, C, "A"),
        [0, 0.001162804686889637822783608439, 0.06509927307354575852847158852],
        rtol=1e-14,
    )
    np.testing.assert_allclose(
        bearing.interference(S, C, "B"),
        [0, 0.001163751938405329369742144091, 0.06820937027346870701583215753],
        rtol=1e-14,
    )
    np.testing.assert_allclose(
        surrogate_areas(bearing, S, C).circle_only,
        [0, 0.06398060445516362539956021991, 3.750005989749518033035104254],
        rtol=1e-14,
    )


def test_crossing_points_at_the_worst_pose():
    """theory/values-of-bearings 2, below the table: f = 90 degrees of the deck's motion."""
    sine = 0.4 * math.sin(1.0 / 30.0)
    cosine = math.sqrt((1.0 - sine) * (1.0 + sine))
    u, v = lid_intersection(DECK, sine, cosine)
    assert float(u) == pytest.approx(-7.768039976301275745374382, rel=1e-14)
    assert float(v) == pytest.approx(15.68143982313439467532102, rel=1e-14)
    u, v = rim_intersection(DECK, sine, cosine)
    assert float(u) == pytest.approx(8.000463409123589289808929, rel=1e-14)
    assert float(v) == pytest.approx(15.59786797095277876096664, rel=1e-14)


def test_crossing_points_lie_on_both_outlines_or_are_nan():
    t = np.linspace(0.0, 0.25, 41)
    S, C = np.sin(t), np.cos(t)
    for found, ellipse, disc in (
        (lid_intersection(DECK, S, C), (DECK.h * S, DECK.Rh * C, DECK.Rh), DECK.Rb),
        (rim_intersection(DECK, S, C), (DECK.h * S, DECK.Rb * C, DECK.Rb), DECK.Rh),
    ):
        u, v = found
        there = np.isfinite(u)
        assert there.any() and not there[0] and (np.isfinite(v) == there).all()
        assert np.abs(np.hypot(u, v)[there] / disc - 1.0).max() < 1e-14
        centre, along, across = ellipse
        assert np.abs((((u - centre) / along) ** 2 + (v / across) ** 2)[there] - 1.0).max() < 1e-12
