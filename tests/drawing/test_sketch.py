"""Sketches: well-formed SVG, everything inside the picture, symbols where they belong."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET

import pytest
from hypothesis import given, strategies as st

from graphsynth.drawing.graphs import draw_levels, level_order
from graphsynth.drawing.sketch import Sketch
from graphsynth.drawing.svg import number
from graphsynth.structure.graph import MechanismGraph

FIGURE_3 = MechanismGraph(
    15,
    [
        *((0, k) for k in (1, 2, 3, 4, 8, 9, 10)),
        *((2, 5), (3, 6), (4, 7), (5, 8), (6, 9), (7, 10), (8, 11), (9, 12), (10, 13), (11, 14), (12, 14), (13, 14)),
        *((1, 2, 2), (1, 3, 2), (1, 4, 2)),
    ],
    frame=0,
)
SVG = "{http://www.w3.org/2000/svg}"


def shapes(svg: str, tag: str) -> list[ET.Element]:
    return list(ET.fromstring(svg).iter(SVG + tag))


def test_world_to_picture_keeps_scale_and_turns_y_up() -> None:
    sketch = Sketch(0j, 4 + 2j, width=440, margin=20)
    sketch.joint(0j)
    sketch.joint(4 + 2j)
    first, second = shapes(sketch.svg(), "circle")
    assert (float(first.get("cx")), float(first.get("cy"))) == (20, 220)
    assert (float(second.get("cx")), float(second.get("cy"))) == (420, 20)
    assert sketch.height == 240


@pytest.mark.parametrize("upper", [0j, 1 + 0j, complex(math.nan, 1), complex(math.inf, 1), -1 - 1j])
def test_an_empty_or_unbounded_box_is_refused(upper: complex) -> None:
    with pytest.raises(ValueError, match="box with positive finite sides"):
        Sketch(0j, upper)


def test_ground_stands_below_the_joint_with_hatching_on_the_far_side() -> None:
    sketch = Sketch(-1 - 1j, 1 + 1j, width=200, margin=0)
    sketch.ground(0j, size=20)
    triangle, hatch = shapes(sketch.svg(), "path")
    ys = [float(y) for y in re.findall(r"[ML]-?[\d.]+ (-?[\d.]+)", triangle.get("d"))]
    assert ys == [100, 120, 120]  # the joint, then the two feet, further down the page
    strokes = re.findall(r"M-?[\d.]+ (-?[\d.]+) L-?[\d.]+ (-?[\d.]+)", hatch.get("d"))
    assert all(float(a) == 120 and float(b) > 120 for a, b in strokes[1:]) and len(strokes) == 6


def test_a_path_breaks_where_the_mechanism_cannot_be_assembled() -> None:
    sketch = Sketch(0j, 1 + 1j)
    sketch.trace([0j, 1j, complex(math.nan, 0), 1 + 0j, 1 + 1j], closed=True)
    (path,) = shapes(sketch.svg(), "path")
    assert path.get("d").count("M") == 2 and "Z" not in path.get("d")
    assert "nan" not in sketch.svg()


@pytest.mark.long
@given(st.text(max_size=20), st.floats(-1e6, 1e6))
def test_any_text_and_number_stay_well_formed(text: str, value: float) -> None:
    clean = "".join(c for c in text if c.isprintable())
    sketch = Sketch(0j, 1 + 1j, title=clean)
    sketch.label(complex(value, value), clean)
    ET.fromstring(sketch.svg())
    assert re.fullmatch(r"-?\d+(\.\d{1,2})?", number(value))
    assert abs(float(number(value)) - value) <= 0.005 + 1e-9 * abs(value)


def test_levels_drawing_shows_every_link_once_and_every_joint() -> None:
    svg = draw_levels(FIGURE_3)
    assert sorted(int(t.text) for t in shapes(svg, "text")) == list(range(15))
    edges = [p for p in shapes(svg, "path") if " Q" in p.get("d")]
    assert len(edges) == 22
    assert sum(p.get("stroke-dasharray") is not None for p in edges) == 3


def test_level_order_permutes_each_level_and_untangles_the_mirror_image() -> None:
    order = level_order(FIGURE_3)
    assert [sorted(level) for level in order] == [sorted(level) for level in FIGURE_3.levels]
    ladder = MechanismGraph(7, [(0, 1), (0, 2), (0, 3), (1, 6), (2, 5), (3, 4)], frame=0)
    _, middle, last = level_order(ladder)
    assert [7 - link for link in middle] == list(last)  # each above its neighbour: no crossing


def test_a_lone_frame_can_be_drawn() -> None:
    assert len(shapes(draw_levels(MechanismGraph(1, [], frame=0)), "circle")) == 1
