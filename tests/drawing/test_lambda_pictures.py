"""Pictures of the lambda linkage: projections, exaggeration, the stroke, the tilt."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.shapes import Path, Text
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.systems.lambda_linkage.pictures import _View, lambda_sketch, lambda_sketch_3d, lambda_tilt_chart

TILTED = TiltedFourBar(alpha=1 / 30)


def test_points_in_the_plane() -> None:
    """f = 90 degrees: A (0, 1), B (2, 5/2), M (4, 4); the stroke lies within 4 .. 4.0098."""
    sketch = lambda_sketch(TiltedFourBar(), math.pi / 2)
    names = {s.text: s for s in sketch.shapes if isinstance(s, Text)}
    for name, point in {"O": 0j, "A": 1j, "B": 2 + 2.5j, "C": 2 + 0j, "M": 4 + 4j}.items():
        assert names[name].at == pytest.approx(point, abs=1e-12)
    stroke = next(s for s in sketch.shapes if isinstance(s, Path) and s.style.stroke == "c")
    heights = [z.imag for z in stroke.runs[0]]
    assert min(heights) >= 4 - 1e-12 and 4.0097 < max(heights) < 4.00977
    assert stroke.runs[0][0] == pytest.approx(4 + 4j) and stroke.runs[0][-1] == pytest.approx(4j)


def test_projection_is_orthographic_and_only_heights_grow() -> None:
    view = _View(1.0)
    rows = np.array([view._x, view._y])
    np.testing.assert_allclose(rows @ rows.T, np.eye(2), atol=1e-15)
    assert _View(7.0)(np.array([1.0, 2.0, 0.0])) == view(np.array([1.0, 2.0, 0.0]))
    assert _View(7.0)(np.array([0.0, 0.0, 1.0])) == pytest.approx(7.0 * view(np.array([0.0, 0.0, 1.0])))


@pytest.mark.parametrize(
    ("alpha", "words"),
    [(1 / 30, "heights × 10"), (1e-4, "heights × 5000"), (0.6, "heights to scale"), (0.0, "to scale")],
)
def test_the_factor_of_heights_is_written(alpha: float, words: str) -> None:
    svg = lambda_sketch_3d(TiltedFourBar(alpha=alpha), 1.0).svg()
    ET.fromstring(svg)
    assert words in svg and "nan" not in re.sub("dominant", "", svg)


def test_axis_stands_square_to_the_crank_circle_as_drawn() -> None:
    """In the exaggerated space the axis is normal to the plane of the exaggerated circle."""
    view = _View(10.0)
    axis = view.normal(TILTED.rotation[:, 2])
    for column in (0, 1):
        raised = TILTED.rotation[:, column] * [1, 1, 10]
        assert abs(axis @ raised) < 1e-12


def test_an_angle_without_assembly_is_a_word_or_a_sentence() -> None:
    short = TiltedFourBar(2, 1, 1, 1)
    assert "cannot be assembled" in lambda_sketch(short, math.pi).svg()
    with pytest.raises(GeometryError, match="cannot be assembled at the crank angle"):
        lambda_sketch_3d(short, math.pi)
    with pytest.raises(GeometryError, match=r"exaggeration = 0\.0 must be positive"):
        lambda_sketch_3d(TILTED, 0.0, exaggeration=0.0)
    ET.fromstring(lambda_sketch(TiltedFourBar(9, 1, 1, 1), 0.0).svg())


def test_tilt_over_the_turn() -> None:
    """sin(theta) = l2 sin(alpha) sin(f) / l3 for the axis n = (1, 0, 0)."""
    (line,) = lambda_tilt_chart(TILTED).lines
    exact = np.arcsin(np.sin(1 / 30) * np.sin(np.asarray(line.x)) / 2.5)
    np.testing.assert_allclose(np.asarray(line.y), 1e3 * exact, atol=1e-12)
