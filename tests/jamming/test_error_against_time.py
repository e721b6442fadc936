"""Error against run time: every method and subdivision gives a row, and the errors mean what they say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError, SpecError
from graphsynth.evidence import Effort, arc_problem, area_problem, crossing_problem
from graphsynth.evidence.jamming import lambda_problem
from graphsynth.jamming import Bearing, ToleranceBox, certify_jamming, spread, sweep_linkage
from graphsynth.jamming.bearing.arcs import total_length
from graphsynth.jamming.intersection.boxes import krawczyk_boxes
from graphsynth.jamming.intersection.hull import circle_ellipse, exact_hull
from graphsynth.mechanism.four_bar import TiltedFourBar

ONCE = Effort(rounds=1)
WORST = "0.01333086433470144655443037446460955080344"  # 0.4 sin(1/30): the largest tilt of the linkage


def test_crossings():
    problem = crossing_problem(Bearing(), WORST, ONCE)
    assert problem.methods == ("exact hull", "Krawczyk boxes", "general solver")
    errors = [row.error for row in problem.of("Krawczyk boxes")]
    assert errors == sorted(errors, reverse=True) and errors[0] > 1.0 > 1e-10 > errors[-1]
    assert problem.of("exact hull")[0].error < 1e-14 and problem.of("general solver")[-1].error < 1e-9
    thick = circle_ellipse(5, 6, 4, 1, "0.1")
    exact = exact_hull(thick).hull.width
    coarse, fine = (float(np.max(krawczyk_boxes(thick, max_boxes=n).outer.width - exact)) for n in (50, 500))
    assert 0.0 < fine < coarse


def test_areas():
    problem = area_problem(Bearing(), WORST, ONCE)
    assert problem.of("closed form, enclosed")[0].error < 1e-13
    assert problem.of("closed form, double precision")[0].error < 1e-14
    errors = [row.error for row in problem.of("polygon, double precision")]
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.05)  # chords: second order
    assert all(row.error > 800.0 for row in problem.of("interval shoelace sum"))  # finer boxes do not help
    with pytest.raises(GeometryError, match="do not cross"):
        area_problem(Bearing(), "0.001", ONCE)


def test_arcs():
    problem = arc_problem(ToleranceBox(alpha="1/30"), effort=ONCE)
    assert problem.of("closed form, enclosed")[0].error < 1e-13
    widths = {row.setting: row.error for row in problem.of("interval sweep")}
    assert 0.0 < widths["0.01 rad"] < 4.1e-2 and widths["0.0001 rad"] < min(4.1e-4, widths["0.01 rad"])
    samples = [row.error for row in problem.of("samples, float64")]
    assert samples == pytest.approx([4 * math.tau / n for n in (100, 1000, 10_000, 100_000)])
    box = ToleranceBox(alpha=spread("1/30", relative="1e-2"))
    swept = math.tau * sweep_linkage(box, resolution=1e-3).undecided_part
    assert swept >= total_length(certify_jamming(box).arcs.undecided) > 1e-3
    with pytest.raises(GeometryError, match="single dimensions"):  # samples prove nothing about tolerances
        arc_problem(box, effort=ONCE)
    with pytest.raises(SpecError, match="rounds = 0"):
        Effort(rounds=0)


@pytest.mark.long
def test_a_shared_misalignment():
    problem = lambda_problem(TiltedFourBar(), Bearing(), effort=Effort(rounds=1, quick=True))
    coarse, _, fine = (row.error for row in problem.of("samples"))
    assert coarse == pytest.approx(0.0044, abs=5e-5) and coarse > 10.0 * fine > 0.0
    gaps = problem.of("certified gap")
    assert all(0.0 < row.error <= row.value for row in gaps) and min(row.value for row in gaps) <= 1e-2
    assert all(row.seconds > 0.0 for row in problem.rows)


def test_table():
    table = area_problem(Bearing(), WORST, Effort(rounds=1, quick=True)).to_pandas()
    assert set(table["problem"]) == {"areas"}
    assert (table["seconds"] > 0).all() and table["error"].notna().all()
