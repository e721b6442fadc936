"""Error against run time: every method and subdivision gives a row, and the errors mean what they say."""

from __future__ import annotations

import math

import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.evidence import arc_errors, area_errors, crossing_errors, error_table
from graphsynth.jamming import ToleranceBox, spread
from graphsynth.jamming.intersection import circle_ellipse


def by_method(rows):
    return {name: [row for row in rows if row.method == name] for name in dict.fromkeys(row.method for row in rows)}


def test_crossings():
    rows = by_method(crossing_errors(boxes=(100, 400, 5000), repeats=1))
    assert list(rows) == ["exact hull", "Krawczyk boxes", "general solver"]
    errors = [row.error for row in rows["Krawczyk boxes"]]
    assert errors == sorted(errors, reverse=True) and errors[0] > 1.0 > 1e-10 > errors[-1]
    assert rows["exact hull"][0].error < 1e-14 and rows["general solver"][0].error < 1e-9
    thick = crossing_errors(circle_ellipse(5, 6, 4, 1, "0.1"), boxes=(50, 500), repeats=1)
    assert [row.method for row in thick] == ["exact hull", "Krawczyk boxes", "Krawczyk boxes"]
    assert 0.0 < thick[2].error < thick[1].error


def test_areas():
    rows = by_method(area_errors(counts=(100, 200), repeats=1))
    assert rows["closed form, enclosed"][0].error < 1e-13
    assert rows["closed form, doubles"][0].error < 1e-14
    coarse, fine = (row.error for row in rows["polygon, doubles"])
    assert coarse / fine == pytest.approx(4.0, rel=0.05)  # chords: second order
    assert all(row.error > 800.0 for row in rows["interval shoelace sum"])  # finer boxes do not help
    with pytest.raises(GeometryError, match="do not cross"):
        area_errors(sine="0.001")


def test_arcs():
    rows = by_method(arc_errors(resolutions=(1e-2, 1e-4), samples=(100, 1000), repeats=1))
    assert rows["closed form, enclosed"][0].error < 1e-13
    coarse, fine = (row.error for row in rows["interval sweep"])
    assert coarse < 4.1e-2 and fine < 4.1e-4 and fine < coarse
    assert [row.error for row in rows["samples, doubles"]] == pytest.approx([4 * math.tau / 100, 4 * math.tau / 1000])
    box = ToleranceBox(alpha=spread("1/30", relative="1e-2"))
    loose = by_method(arc_errors(box, resolutions=(1e-3,), repeats=1))
    assert list(loose) == ["closed form, enclosed", "interval sweep"]  # samples prove nothing about tolerances
    assert loose["interval sweep"][0].error >= loose["closed form, enclosed"][0].error > 1e-3
    with pytest.raises(GeometryError, match="repeats = 0"):
        arc_errors(repeats=0)


def test_table():
    rows = area_errors(counts=(100,), repeats=1)
    table = error_table({"area": rows, "arcs": arc_errors(resolutions=(), samples=(), repeats=1)})
    assert table["question"].tolist() == ["area"] * len(rows) + ["arcs"]
    assert (table["seconds"] > 0).all() and table["error"].notna().all()
