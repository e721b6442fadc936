"""Sketches as TikZ and DXF: the same shapes in the same places as in the SVG."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from graphsynth.core.errors import GraphsynthError
from graphsynth.drawing.export import SUFFIXES, save, tikz
from graphsynth.drawing.graphs import graph_sketch, levels_sketch
from graphsynth.drawing.shapes import Circle
from graphsynth.drawing.sketch import Sketch
from graphsynth.structure.graph import MechanismGraph

GRAPH = MechanismGraph(
    6, [(0, 1), (1, 2), (2, 3), (0, 3), (2, 4), (4, 5), (0, 5)], frame=0
)  # fmt: skip
CM = 2.54 / 96


def test_tikz_circles_are_where_the_svg_has_them() -> None:
    sketch, pose = graph_sketch(GRAPH, driver=1)
    text = tikz(sketch, pose, max_width=None)
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


NUMBERS = re.compile(r"-?[0-9]+(?:\.[0-9]+)?")


def test_tikz_is_no_wider_than_the_column_of_an_article() -> None:
    """Made smaller as a whole: every number outside names is the same part of what it was."""
    sketch, pose = graph_sketch(GRAPH, driver=1)
    wide = Sketch(sketch.lower, sketch.upper, width=1000.0)
    wide.shapes.extend(sketch.shapes)
    whole, narrow = (tikz(wide, pose, max_width=bound) for bound in (None, 12.0))
    assert tikz(wide, pose) == narrow
    part = 12.0 / (1000.0 * CM)
    drawn = [line for line in whole.splitlines() if line.startswith(("\\path", "\\node"))]
    shown = [line for line in narrow.splitlines() if line.startswith(("\\path", "\\node"))]
    assert len(drawn) == len(shown) == len(wide.shapes)
    places = 0
    for before, after in zip(drawn, shown):
        # opacity and the text of a label are no lengths
        old, new = (re.sub(r"opacity=[0-9.]+|\{[0-9]+\};.*|%.*", "", line) for line in (before, after))
        for a, b in zip(NUMBERS.findall(old), NUMBERS.findall(new), strict=True):
            assert float(b) == pytest.approx(part * float(a), abs=1e-4)
            places += 1
        for x in re.findall(r"\((-?[0-9.]+),", after):
            assert 0.0 <= float(x) <= 12.0
    assert places > 100
    small = Sketch(sketch.lower, sketch.upper, width=200.0)
    small.shapes.extend(sketch.shapes)
    assert tikz(small, pose) == tikz(small, pose, max_width=None)
    for bad in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(GraphsynthError, match="must be positive and finite"):
            tikz(sketch, pose, max_width=bad)


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
