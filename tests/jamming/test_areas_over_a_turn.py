"""Areas against the crank angle, the ordinate of the source, and the interval shoelace sum."""

import math

import mpmath
import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Interval
from graphsynth.jamming import Bearing, assess_jamming
from graphsynth.jamming.bearing.areas_enclosed import area_curve, enclose_surrogate_areas, enclose_tilt_sine
from graphsynth.jamming.intersection.readings import (
    Reading,
    crescent_boxes,
    interval_shoelace,
    reading_areas,
    reading_ellipse,
    reading_problem,
)
from graphsynth.mechanism.four_bar import TiltedFourBar

DECK = TiltedFourBar(alpha=1 / 30)


def test_curve_holds_the_double_precision_table():
    curve = area_curve()
    table = assess_jamming(DECK, samples=curve.f).table
    for bounds, values in (
        (curve.lid, table.lid_area), (curve.rim, table.rim_area), (curve.surrogate_gap, table.surrogate_gap_area),
        (curve.surrogate_jam, table.surrogate_interference_area), (curve.sine, np.sin(table.theta)),
    ):  # fmt: skip
        assert (bounds.lo <= values + 1e-13).all()
        assert (bounds.hi >= values - 1e-13).all()
        assert bounds.width.max() < 1e-12
    assert curve.rim_closed.all()
    frame = curve.to_pandas()
    assert len(frame) == 721
    assert (frame.lid_hi >= frame.lid_lo).all()


def test_ordinate_of_the_source_jumps_at_the_onset_and_falls_towards_the_worst_pose():
    onset = math.radians(26.4519007718602215158671401366)
    curve = area_curve(f=[onset - 1e-9, onset + 1e-9, math.pi / 2])
    before, after, worst = curve.source_ordinate
    assert before == 0.0
    assert after == pytest.approx(1.649336143134641450192888, rel=1e-6)  # pi R c
    assert worst == pytest.approx(0.9749683652811658362854900, rel=1e-14)
    true = curve.lid.mid
    assert true[0] == 0.0
    assert true[1] < 1e-9
    assert true[2] == pytest.approx(0.9660360305061188705287607231, rel=1e-14)


def test_half_of_the_surrogate_underestimates_the_interference():
    """By 26 to 29 per cent (theory/circle-and-ellipse 4)."""
    curve = area_curve(f=np.radians([26.5, 30, 45, 90]))
    short = 1 - 0.5 * curve.surrogate_jam.mid / curve.lid.mid
    assert ((short > 0.25) & (short < 0.295)).all()


@pytest.mark.parametrize(
    ("axis", "alpha"), [((1.0, 0.0, 0.0), 1 / 30), ((2 / 3, -1 / 3, 2 / 3), 1 / 30), ((0.0, 0.0, 1.0), 0.3)]
)
def test_tilt_over_ranges_of_the_crank_angle(axis, alpha):
    linkage = TiltedFourBar(alpha=alpha, axis=axis)
    f = np.linspace(0.0, 2 * math.pi, 4001)
    values = linkage.positions(f).sin_theta
    wide = enclose_tilt_sine(linkage, Interval.from_bounds(f[:-1], f[1:]))
    for side in (values[:-1], values[1:]):
        assert (wide.lo - 1e-17 <= side).all()
        assert (side <= wide.hi + 1e-17).all()
    assert enclose_tilt_sine(linkage, f).width.max() < 1e-16


def test_bad_curves_are_refused():
    with pytest.raises(GeometryError, match="not a rigid body"):
        area_curve(TiltedFourBar(alpha=0.1, rod="deck"))
    with pytest.raises(GeometryError, match="rises above l3 at 90 degrees"):
        area_curve(TiltedFourBar(l3=0.5, alpha=1.0), f=[0.0, math.pi / 2])
    with pytest.raises(GeometryError, match="interference fit"):
        area_curve(bearing=Bearing(clearance=-0.01))


# the interval shoelace sum

B90 = 17.4617879639289313590283215334


def test_shoelace_is_right_for_points_and_useless_for_boxes():
    assert interval_shoelace(Interval([[0, 0], [3, 0], [3, 2], [0, 2]])).contains(6)
    true = enclose_surrogate_areas("17.5", "0.03", 5, "0.0133308643").ellipse_only.mid / 2  # one crescent
    for count in (60, 250, 1000):
        found = interval_shoelace(crescent_boxes(17.5, 17.53, B90, count))
        assert found.contains(float(true))
        assert 850 < float(found.width) < 900  # finer boxes do not help
        assert float(found.mid) == pytest.approx(true, rel=1e-2)
        size = abs(found)
        assert size.lo == 0.0  # the absolute value of an interval around 0 starts at 0
        assert size.hi == found.hi


def test_shoelace_input():
    with pytest.raises(GeometryError, match="0 < b < R1 < a"):
        crescent_boxes(1.0, 0.5, 0.4)
    with pytest.raises(GeometryError, match="at least 4"):
        crescent_boxes(5.0, 6.0, 4.0, 2)


# the four readings

BEARING = Bearing()


def monte_carlo(centre, along, across, circle, count=400_000):
    """Areas ellipse minus circle and circle minus ellipse on a grid of points."""
    reach = max(abs(centre) + along, across, circle)
    side = np.linspace(-reach, reach, int(math.sqrt(count)))
    x, y = np.meshgrid(side, side)
    disc = x * x + y * y <= circle**2
    oval = ((x - centre) / along) ** 2 + (y / across) ** 2 <= 1
    cell = (side[1] - side[0]) ** 2
    return (oval & ~disc).sum() * cell, (disc & ~oval).sum() * cell


@pytest.mark.parametrize("reading", list(Reading))
@pytest.mark.parametrize("t", [0.2, 0.5])
def test_areas_of_the_readings_against_counting(reading, t):
    bearing = Bearing(2.0, 1.0, 0.1)
    S, C = math.sin(t), math.cos(t)
    found = reading_areas(bearing, S, C, reading)
    ellipse = reading_ellipse(bearing, S, C, reading)
    for value, count in zip(found, monte_carlo(*map(float, ellipse))):
        assert float(value) == pytest.approx(count, abs=0.02)


def test_readings_that_ignore_the_height_need_a_larger_tilt():
    """E1 and E2 start at arccos(R/Rh); E4 and E3 at t_B (theory/circle-and-ellipse 1)."""
    late, early = 0.05851222627558999787339087, 0.005938219994357610895366507614
    jam = {
        Reading.IMAGE: (late, 1), Reading.SECTION: (late, 0), Reading.LID: (early, 1), Reading.SURROGATE: (early, 1),
    }  # fmt: skip
    for reading, (onset, which) in jam.items():
        below, above = (
            reading_areas(BEARING, math.sin(t), math.cos(t), reading)[which] for t in (onset - 1e-9, onset + 1e-9)
        )
        assert below == 0.0
        assert above > 0.0


def test_problems_of_the_readings():
    for reading in (Reading.IMAGE, Reading.SECTION, Reading.SURROGATE):
        problem = reading_problem(BEARING, "0.1", reading)
        ellipse = reading_ellipse(BEARING, 0.1, math.sqrt(0.99), reading)
        assert float(problem.R1.lo) == pytest.approx(ellipse.circle)
        assert float(problem.a.lo) == pytest.approx(max(float(ellipse.along), float(ellipse.across)))
        assert float(problem.b.lo) == pytest.approx(min(float(ellipse.along), float(ellipse.across)))
    with pytest.raises(GeometryError, match="not centred"):
        reading_problem(BEARING, "0.1", Reading.LID)
    with pytest.raises(GeometryError, match="exists for"):
        reading_problem(BEARING, 1, Reading.IMAGE)
    with pytest.raises(GeometryError, match="lid = 0"):
        reading_ellipse(BEARING, 0.1, 0.9, lid=0)


def test_lids_are_mirror_images():
    up, down = (reading_ellipse(BEARING, 0.1, math.sqrt(0.99), Reading.LID, lid) for lid in (1, -1))
    assert up.centre == -down.centre == 0.5


@pytest.mark.parametrize("axis", [(2, -1, 2), (1, 1, 0), (3, 1, -7), (1, 2, 3)])
def test_the_axis_is_a_unit_vector_up_to_rounding_only(axis):
    """Its doubles, made exact and normalised in 50 digits: the sine lies inside without any allowance."""
    linkage = TiltedFourBar(alpha=0.9, axis=axis)
    angles = np.linspace(0.1, 6.2, 60)
    found = enclose_tilt_sine(linkage, angles)
    with mpmath.workdps(50):
        n = [mpmath.mpf(part) for part in linkage.axis]
        n1, n2, n3 = (part / mpmath.sqrt(sum(x * x for x in n)) for part in n)
        alpha, ratio = mpmath.mpf(0.9), mpmath.mpf(linkage.l2) / mpmath.mpf(linkage.l3)
        s, k = mpmath.sin(alpha), 1 - mpmath.cos(alpha)
        for f, low, high in zip(angles.tolist(), found.lo.tolist(), found.hi.tolist()):
            f = mpmath.mpf(f)
            sine = ratio * ((n1 * n3 * k - n2 * s) * mpmath.cos(f) + (n2 * n3 * k + n1 * s) * mpmath.sin(f))
            assert low <= sine <= high
