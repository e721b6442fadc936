"""Charts of a motion: the right numbers, gaps, events, units."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.motion_charts import coupler_curves, margin_chart, motion_chart, transmission_chart
from graphsynth.drawing.plots import Chart
from graphsynth.kinematics import simulate

from .conftest import TURN, four_bar


def texts(chart: Chart) -> set[str]:
    root = ET.fromstring(chart.svg())
    return {"".join(t.itertext()) for t in root.iter("{http://www.w3.org/2000/svg}text")}


def test_slider_crank_displacement_in_closed_form(motions: dict[str, Any]) -> None:
    """x = cos u + sqrt(9 - sin^2 u) and its derivatives; dead centres at 0 and pi."""
    motion = motions["slider crank"]
    u = motion.inputs
    root = np.sqrt(9 - np.sin(u) ** 2)
    exact = (
        np.cos(u) + root,
        -np.sin(u) - np.sin(u) * np.cos(u) / root,
        -np.cos(u) - np.cos(2 * u) / root - (np.sin(u) * np.cos(u)) ** 2 / root**3,
    )
    for order in range(3):
        (line,) = motion_chart(motion, 3, order).lines
        np.testing.assert_allclose(line.y, exact[order], atol=1e-12)
    chart = motion_chart(motion, 3, 2, unit="m")
    assert chart.ylabel == "acceleration [m/rad²]" and chart.xlabel == "driver angle [rad]"
    assert any(mark.x == pytest.approx(math.pi) and mark.label == "dead centre" for mark in chart.marks)
    assert {"0", "π/2", "π", "3π/2", "2π", "dead centre"} <= texts(chart)


def test_the_end_of_the_motion_is_marked_and_the_rest_is_a_gap(motions: dict[str, Any]) -> None:
    motion = motions["stops"]
    chart = motion_chart(motion)
    (line,) = chart.lines
    assert (np.isnan(line.y) == ~motion.assembled).all()
    (end,) = [mark for mark in chart.marks if mark.colour == "jam"]
    assert end.x == pytest.approx(math.acos(0.25)) and end.label == "fold: ends here"
    assert "nan" not in chart.svg().replace("dominant", "")


def test_coupler_curve_is_the_path(motions: dict[str, Any]) -> None:
    chart = coupler_curves(motions["lambda"])
    (line,) = chart.lines
    np.testing.assert_array_equal(np.column_stack([line.x, line.y]), motions["lambda"].point("M").position)
    assert chart.equal and (chart.xlabel, chart.ylabel) == ("x [length]", "y [length]")


def test_transmission_angle_of_a_four_bar_in_closed_form(motions: dict[str, Any]) -> None:
    """Cosine rule: D^2 = l1^2 + l2^2 - 2 l1 l2 cos f between coupler and rocker."""
    f = motions["lambda"].inputs
    D2 = 5 - 4 * np.cos(f)
    mu = np.arccos((2.5**2 + 2.5**2 - D2) / (2 * 2.5 * 2.5))
    chart = transmission_chart(motions["lambda"], least=0.4)
    (line,) = chart.lines
    np.testing.assert_allclose(line.y, np.minimum(mu, math.pi - mu), atol=1e-7)
    assert {"bound", "links 2, 3"} <= texts(chart)
    np.testing.assert_allclose(margin_chart(motions["lambda"]).lines[0].y, np.sin(mu) ** 2, atol=1e-12)


def test_what_has_no_chart_is_said(motions: dict[str, Any]) -> None:
    with pytest.raises(GeometryError, match="order = 3 must be 0, 1 or 2"):
        motion_chart(motions["lambda"], order=3)
    with pytest.raises(GeometryError, match="no named point"):
        coupler_curves(motions["yoke"])
    with pytest.raises(GeometryError, match="link 9 does not exist"):
        motion_chart(motions["lambda"], 9)
    with pytest.raises(GeometryError, match="'Z' is not defined"):
        motion_chart(motions["lambda"], "Z")
    with pytest.raises(GeometryError, match="no transmission angle"):
        transmission_chart(motions["yoke"])


def test_sliding_driver_has_a_length_axis(motions: dict[str, Any]) -> None:
    chart = motion_chart(motions["cylinder"], 1, 1)
    assert (chart.xlabel, chart.ylabel) == ("driver displacement [length]", "velocity [rad/length]")


def test_nothing_assembled_is_an_empty_chart() -> None:
    chart = motion_chart(simulate(four_bar(5, 1, 1, 1), TURN))
    assert np.isnan(chart.lines[0].y).all()
    ET.fromstring(chart.svg())


def test_a_chart_is_drawn_on_axes_of_the_user_and_saved(motions: dict[str, Any], tmp_path: Path) -> None:
    chart = motion_chart(motions["lambda"], "M")
    axes = chart.draw()
    assert [line.get_label() for line in axes.get_lines()[:2]] == ["M, x", "M, y"]
    np.testing.assert_array_equal(axes.get_lines()[0].get_ydata(), motions["lambda"].point("M").position[:, 0])
    for name, magic in (("c.png", b"\x89PNG"), ("c.pdf", b"%PDF"), ("c.svg", b"<svg")):
        chart.save(tmp_path / name)
        assert (tmp_path / name).read_bytes().startswith(magic)
