"""Sketches as TikZ and DXF: the same shapes in the same places as in the SVG."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from graphsynth.drawing.graphs import graph_sketch
from graphsynth.drawing.levels import levels_sketch
from graphsynth.drawing.shapes import Circle
from graphsynth.drawing.sketch import Sketch
from graphsynth.drawing.sketching.pictures import SUFFIXES, save
from graphsynth.drawing.sketching.tikz import tikz
from graphsynth.errors import GraphsynthError
from graphsynth.structure.graph import MechanismGraph

GRAPH = MechanismGraph(
    6, [(0, 1), (1, 2), (2, 3), (0, 3), (2, 4), (4, 5), (0, 5)], frame=0
)  # fmt: skip
CM = 2.54 / 96


def test_tikz_circles_are_where_the_svg_has_them() -> None:
    sketch, pose = graph_sketch(GRAPH, driver=1)
    text = tikz(sketch, pose)
    number = r"(-?[0-9.]+)"
    ours = [
        tuple(map(float, m)) for m in re.findall(rf"\({number},{number}\) circle\[radius={number}\]", text)
    ]  # fmt: skip
    svg = [e for e in ET.fromstring(sketch.svg(pose)).iter() if e.tag.endswith("circle")]
    theirs = [(float(e.get("cx")), float(e.get("cy")), float(e.get("r"))) for e in svg]
    assert len(ours) == len(theirs) == 7
    for (x, y, r), (cx, cy, cr) in zip(ours, theirs):
        assert (x / CM, y / CM, r / CM) == pytest.approx((cx, sketch.height - cy, cr), abs=0.02)
    assert text.count(r"\node") == 6
    assert text.count("\\path") + text.count("\\node") == len(sketch.shapes)


def test_tikz_is_balanced_and_escapes_what_tex_reads() -> None:
    sketch = Sketch(0j, 1 + 1j, title="100 %\nof it")
    sketch.label(0j, r"a_b & {50%} \x #1 ~^$")
    text = tikz(sketch)
    assert r"a\_b \& \{50\%\} \textbackslash{}x \#1 \textasciitilde{}\textasciicircum{}\$" in text
    assert text.splitlines()[0] == "% 100 % of it"
    body = re.sub(r"\\[{}%]|%.*", "", text.split("\n", 1)[1])
    assert body.count("{") == body.count("}") and body.count("[") == body.count("]")
    assert all(line.rstrip().endswith((";", "]", "}")) for line in body.splitlines() if line.strip())


def test_curves_of_the_levels_drawing_pass_the_same_points() -> None:
    sketch = levels_sketch(GRAPH)
    assert tikz(sketch).count(".. controls") == len(GRAPH.joints)


def test_dxf_holds_the_joints_in_millimetres(tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    sketch, pose = graph_sketch(GRAPH)
    save(tmp_path / "x.dxf", [sketch], [pose])
    drawing = ezdxf.readfile(tmp_path / "x.dxf")
    assert not drawing.audit().errors
    space = drawing.modelspace()
    circles = [e for e in space.query("CIRCLE") if e.dxf.layer == "JOINT"]
    wanted = [s for s in sketch.shapes if isinstance(s, Circle) and s.layer == "joint"]
    assert len(circles) == len(wanted) == 7
    for entity, shape in zip(circles, wanted):  # the pose is the identity
        assert complex(entity.dxf.center.x, entity.dxf.center.y) == pytest.approx(40.0 * shape.centre)
        assert entity.dxf.radius == pytest.approx(40.0 * shape.radius)
    assert {e.dxf.text for e in space.query("TEXT")} == set("012345")
    assert sum(e.closed for e in space.query("LWPOLYLINE") if e.dxf.layer == "PLATE") == 1  # ternary link 2
    with pytest.raises(GraphsynthError, match="one sketch"):
        save(tmp_path / "y.dxf", [sketch, sketch], [pose, pose])


def test_every_suffix_is_written(tmp_path: Path) -> None:
    sketch, pose = graph_sketch(GRAPH)
    for suffix in sorted(set(SUFFIXES) - {".dxf"}):
        save(tmp_path / f"x{suffix}", [sketch, levels_sketch(GRAPH)], [pose, None])
        assert (tmp_path / f"x{suffix}").stat().st_size > 1000
    assert (tmp_path / "x.tex").read_text().count(r"\begin{tikzpicture}") == 2
    with pytest.raises(GraphsynthError, match=r"must end in \.svg"):
        save(tmp_path / "x.bmp", [sketch], [pose])
