"""Files of parts, read again: holes in DXF, closed surfaces in STL, true arcs in SVG and STEP."""

from __future__ import annotations

import csv
import math
from collections import Counter
from xml.etree import ElementTree

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.core.errors import GraphsynthError
from graphsynth.formats import write_parts

MADE = {
    "lambda": gs.parts(gs.simulate(gs.gallery.chebyshev_lambda()), unit=40.0),
    "slider": gs.parts(gs.simulate(gs.Mechanism.slider_crank(1.0, 3.0)), unit=40.0),
    "jansen": gs.parts(gs.simulate(gs.gallery.jansen()), unit=1.5, prove=False),
}


@pytest.fixture(params=MADE)
def made(request):
    return MADE[request.param]


def test_dxf_has_the_same_holes(made, tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    files = write_parts(made, tmp_path, forms=["dxf"])
    assert [file.name for file in files] == ["cut.dxf"]
    drawing = ezdxf.readfile(files[0])
    assert drawing.units == 4  # millimetres
    space = drawing.modelspace()
    discs = [hole for holes in made.plan.holes for hole in holes if len(hole.hull) == 1]
    circles = space.query("CIRCLE[layer=='HOLES']")
    assert Counter(round(c.dxf.radius, 9) for c in circles) == Counter(round(h.radius, 9) for h in discs)
    outlines = space.query("LWPOLYLINE[layer=='OUTLINE']")
    areas = sorted(polygon_area(line) for line in outlines)
    assert areas == pytest.approx(sorted(o.moments.area for o in made.plan.outlines), rel=1e-4)
    # every hole of a link is where the link has it: distances of holes are those of the joints
    for link, outline in enumerate(made.plan.outlines):
        holes = [h.hull[0] for h in made.plan.holes[link] if len(h.hull) == 1]
        near = [t for t in space.query("TEXT") if t.dxf.text == str(link)]
        assert len(near) == 1
        found = [complex(c.dxf.center.x, c.dxf.center.y) for c in circles]
        ways = np.abs(np.subtract.outer(found, found))
        for a in range(len(holes)):
            for b in range(a):
                assert np.abs(ways - abs(holes[a] - holes[b])).min() < 1e-9 * (1 + abs(outline.hull[0]))


def polygon_area(line):
    points = np.array([complex(p.x, p.y) for p in line_points(line)])
    return float((points.conj() * np.roll(points, -1)).imag.sum() / 2)


def line_points(line):
    from ezdxf import path

    return list(path.make_path(line).flattening(1e-4))


def read_stl(data):
    count = int.from_bytes(data[80:84], "little")
    rows = np.frombuffer(data[84:], dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])
    assert len(rows) == count
    return rows


def test_stl_is_closed_and_has_the_volume_of_the_sheet(made, tmp_path):
    pytest.importorskip("ezdxf")
    for link, file in enumerate(write_parts(made, tmp_path, forms=["stl"])):
        rows = read_stl(file.read_bytes())
        corners = rows["corners"].astype(float)
        names = {}
        faces = [tuple(names.setdefault(tuple(np.round(p, 5)), len(names)) for p in face) for face in corners]
        edges = Counter((f[k], f[(k + 1) % 3]) for f in faces for k in range(3))
        assert all(count == 1 and edges[b, a] == 1 for (a, b), count in edges.items())
        holes = len(made.plan.holes[link])
        assert len(names) - len(edges) // 2 + len(faces) == 2 - 2 * holes  # Euler: a plate with so many holes
        volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
        exact = made.moments(link).area * made.sizes.thickness
        assert volume == pytest.approx(exact, rel=2e-3)
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert (np.einsum("ij,ij->i", normals, rows["normal"]) > -1e-9).all()


def test_svg_to_cut_is_in_millimetres_and_nothing_overlaps(made, tmp_path):
    file = write_parts(made, tmp_path, forms=["svg"])[0]
    root = ElementTree.parse(file).getroot()
    wide, high = (float(v) for v in root.get("viewBox").split()[2:])
    assert root.get("width") == f"{wide:.3f}mm" and root.get("height") == f"{high:.3f}mm"
    paths = [node.get("d") for node in root.iter("{http://www.w3.org/2000/svg}path")]
    assert len(paths) == len(made.layers)
    boxes = []
    for link, d in enumerate(paths):
        assert d.count("Z") == 1 + len(made.plan.holes[link])
        words = d.split("Z")[0].replace("M", " M ").replace("L", " L ").replace("A", " A ").split()
        points, k = [], 0
        while k < len(words):
            skip = 5 if words[k] == "A" else 0
            points.append(complex(float(words[k + 1 + skip]), float(words[k + 2 + skip])))
            k += 3 + skip
        assert all(0 <= z.real <= wide and 0 <= z.imag <= high for z in points)
        r = made.plan.outlines[link].radius
        x, y = [z.real for z in points], [z.imag for z in points]
        boxes.append((min(x), max(x), min(y), max(y)))
        assert r > 0
    for k, one in enumerate(boxes):
        for other in boxes[:k]:
            assert one[1] < other[0] or other[1] < one[0] or one[3] < other[2] or other[3] < one[2]


def test_the_bill_is_read_again(made, tmp_path):
    file = write_parts(made, tmp_path / "new", forms=["csv"])[0]
    rows = list(csv.DictReader(file.read_text().splitlines()))
    assert [row["part"] for row in rows] == [row.part for row in made.bill]
    assert float(rows[1]["area"]) == pytest.approx(made.bill[1].area, rel=1e-5)


@pytest.mark.long
def test_step_has_the_exact_volume(tmp_path):
    cad = pytest.importorskip("build123d")
    made = MADE["slider"]
    for link, file in enumerate(write_parts(made, tmp_path, forms=["step"])):
        solid = cad.import_step(str(file))
        assert solid.volume == pytest.approx(made.moments(link).area * made.sizes.thickness, rel=1e-9)


def test_a_form_that_is_not_known_is_told(tmp_path):
    with pytest.raises(GraphsynthError, match="parts are not written as 'obj'"):
        write_parts(MADE["lambda"], tmp_path, forms=["obj"])
    assert math.isfinite(MADE["lambda"].gap)
