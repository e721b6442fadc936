"""Diagrams of graphs without dimensions, and files of every kind."""

from __future__ import annotations

import subprocess
import sys
import xml.etree.ElementTree as ET
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

from graphsynth.core.errors import GraphError, GraphsynthError
from graphsynth.drawing.export import save
from graphsynth.drawing.graphs import graph_sketch, graph_svg, levels_sketch
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis import enumerate_chains


@cache
def eight(index: int) -> MechanismGraph:
    """Made on first use: a worker that only collects this file compiles nothing."""
    return list(enumerate_chains(8))[index]


def parts(svg: str) -> Counter[str]:
    return Counter(e.get("data-part") for e in ET.fromstring(svg).iter() if e.get("data-part"))


@pytest.mark.parametrize("index", range(16))
def test_every_eight_link_chain_and_its_inversions(index: int) -> None:
    chain = eight(index)
    counted = parts(graph_svg(chain))
    assert sum(counted[f"joint {a}-{b}"] for a, b, _ in chain.joints) == 10
    assert all(counted[f"link {k}"] == counted[f"number {k}"] == 1 for k in range(8))
    for inversion in chain.inversions():
        counted = parts(graph_svg(inversion, driver=inversion.levels[1][0]))
        assert all(counted[f"joint {a}-{b}"] == 1 for a, b, _ in inversion.joints)
        grounds = sum(part.startswith("ground") for part in counted)
        assert grounds == inversion.degrees[0] and counted["link 0"] == 0
        assert sum(part.startswith("driver") for part in counted) == 1


def test_higher_pairs_are_pins_in_slots() -> None:
    counted = parts(graph_svg(MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)))
    assert counted["slot 1-2"] == counted["joint 1-2"] == 1


def test_what_has_no_plane_diagram_is_refused() -> None:
    loop = [(0, 1), (1, 2), (2, 3), (0, 3)]
    with pytest.raises(GraphError, match="only planar graphs"):
        graph_svg(MechanismGraph(4, loop, frame=0, space=6))
    with pytest.raises(GraphError, match="driver 2 is not jointed to the frame"):
        graph_svg(MechanismGraph(4, loop, frame=0), driver=2)


@pytest.mark.long
def test_two_views_side_by_side_in_every_kind_of_file(tmp_path: Path) -> None:
    graph = eight(3).with_frame(0)
    sketch, pose = graph_sketch(graph)
    levels = levels_sketch(graph)
    for name, magic in (("x.svg", b"<svg"), ("x.png", b"\x89PNG"), ("x.pdf", b"%PDF")):
        save(tmp_path / name, [sketch, levels], [pose, None])
        content = (tmp_path / name).read_bytes()
        assert content.startswith(magic)
    root = ET.parse(tmp_path / "x.svg").getroot()
    inner = root.findall("{http://www.w3.org/2000/svg}svg")
    assert [float(e.get("x")) for e in inner] == pytest.approx([0, sketch.width], abs=0.01)
    assert float(root.get("width")) == pytest.approx(sketch.width + levels.width, abs=0.01)
    with pytest.raises(GraphsynthError, match=r"must end in \.svg, \.png, \.pdf, \.tikz, \.tex or \.dxf"):
        save(tmp_path / "x.bmp", [sketch], [pose])


@pytest.mark.long
def test_svg_pictures_load_no_matplotlib() -> None:
    """The writers of SVG and HTML stay with numpy."""
    code = (
        "import sys, graphsynth.drawing.animation, graphsynth.drawing.graphs\n"
        "import graphsynth.systems.lambda_linkage.pictures\n"
        "import graphsynth.drawing.motion_charts, graphsynth.drawing.animation, graphsynth.drawing.export\n"
        "import graphsynth.drawing.graphs\n"
        "heavy = {'matplotlib', 'PIL', 'pandas', 'networkx', 'sympy', 'scipy', 'mpmath', 'numba'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
