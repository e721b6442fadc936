"""Files of parts: outlines to cut as SVG and DXF, solids as STL and STEP, the bill as CSV; all in millimetres."""

from __future__ import annotations

import cmath
import csv
import io
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GraphsynthError
from graphsynth.core.extras import need
from graphsynth.core.wholefiles import replacing
from graphsynth.design.parts.outline import Rounded, arc_of
from graphsynth.design.parts.result import Parts, turned
from graphsynth.design.parts.wheels import Cut

#: Free sheet between two parts, in thicknesses.
_BETWEEN = 2.0
#: Flat sides of a solid stay this near to its arcs, in millimetres.
_DEVIATION = 0.01
_HALF = 0.36  #: height of half a digit, in units of the size
_WIDTH = 600.0  #: of the sheet
#: What can be written.
FORMS = ("svg", "dxf", "stl", "step", "csv")


def write_parts(
    parts: Parts, folder: str | Path, *, forms: Sequence[str] = ("svg", "csv"), picture: str = ""
) -> list[Path]:
    """Write parts to a folder, which is made if it is not there.

    Parameters
    ----------
    parts : Parts
        Of `graphsynth.parts`.
    folder : str or Path
        Files of the same names are replaced.
    forms : sequence of str
        "svg" and "dxf": all sheets beside each other, to cut; "csv": the bill; "stl" and "step": one solid for each
        link, ``link-2.stl``, in the frame of the link with its lower face at z = 0.  DXF and STL need the extra
        ``dxf``, STEP the extra ``step``.
    picture : str
        An SVG to write beside them as ``parts.svg``; none if empty.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    GraphsynthError
        A form that is not known.
    MissingExtraError
        An extra that is not installed.
    """
    for form in forms:
        if form not in FORMS:
            raise GraphsynthError(f"parts are not written as {form!r}; choose from {', '.join(FORMS)}")
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    files: list[Path] = []

    def write(name: str, content: str | bytes) -> None:
        with replacing(place / name) as fresh:
            fresh.write_bytes(content.encode() if isinstance(content, str) else content)
        files.append(place / name)

    for link in range(len(parts.layers)):  # what needs an extra comes first: without it nothing is written
        if "step" in forms:
            with replacing(place / f"link-{parts.plan.label(link)}.step") as fresh:
                write_step(parts, link, fresh)
            files.append(place / f"link-{parts.plan.label(link)}.step")
        if "stl" in forms:
            write(f"link-{parts.plan.label(link)}.stl", link_stl(parts, link))
    if "dxf" in forms:
        with replacing(place / "cut.dxf") as fresh:
            cut_dxf(parts).saveas(os.fspath(fresh))
        files.append(place / "cut.dxf")
    if picture:
        write("parts.svg", picture)
    if "csv" in forms:
        write("bill.csv", bill_csv(parts))
    if "svg" in forms:
        write("cut.svg", cut_svg(parts))
    return files


def bill_csv(parts: Parts) -> str:
    """Return the bill of parts as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(parts.bill[0]._fields)
    writer.writerows([f"{v:.6g}" if isinstance(v, float) else v for v in row] for row in parts.bill)
    return text.getvalue()


def laid_out(parts: Parts) -> tuple[list[tuple[complex, complex]], complex]:
    """Return turn and shift of every link on a sheet, one row above the other, and the corner of the sheet."""
    between = _BETWEEN * parts.sizes.thickness
    boxes = []
    for link, outline in enumerate(parts.plan.outlines):
        turn = turned(parts, link)
        boxes.append((turn, outline.moved(turn, 0j).box))
    wide = max([_WIDTH, *((high - low).real + 2.0 * between for _, (low, high) in boxes)])
    places: dict[int, tuple[complex, complex]] = {}
    x = y = between
    row = right = 0.0
    for link in sorted(range(len(boxes)), key=lambda k: -(boxes[k][1][1] - boxes[k][1][0]).imag):  # the tallest first
        turn, (low, high) = boxes[link]
        size = high - low
        if x + size.real + between > wide and x > between:
            x, y, row = between, y + row + between, 0.0
        places[link] = turn, complex(x, y) - low
        x, row = x + size.real + between, max(row, size.imag)
        right = max(right, x)
    return [places[link] for link in range(len(boxes))], complex(right, y + row + between)


def _sheet(parts: Parts) -> list[tuple[int, Rounded, list[Rounded]]]:
    """Link, outline and holes of every part on the sheet."""
    return [
        (link, outline.moved(*at), [hole.moved(*at) for hole in holes])
        for link, (outline, holes, at) in enumerate(zip(parts.plan.outlines, parts.plan.holes, laid_out(parts)[0]))
    ]


def cut_svg(parts: Parts, *, line: float = 0.1) -> str:
    """Write all sheets beside each other as SVG at full size: outlines and holes as hairlines, numbers engraved.

    Parameters
    ----------
    parts : Parts
    line : float
        Width of the lines, millimetres; hairlines are right for most lasers, wider ones for the eye.

    Returns
    -------
    str
        In millimetres, with true arcs.
    """
    corner = laid_out(parts)[1]
    size = max(2.0, 0.6 * parts.sizes.pin)
    lines = []
    for link, outline, holes in _sheet(parts):
        path = " ".join(_path(shape, corner.imag) for shape in (outline, *holes))
        at, middle, pitch = _label_place(outline, holes), outline.hull[0], outline.pitch
        engraved = (
            f'<circle cx="{middle.real:.3f}" cy="{corner.imag - middle.imag:.3f}" r="{pitch:.3f}" fill="none" '
            f'stroke="#0000ff" stroke-width="{line:g}"/>'
            if pitch
            else ""
        )
        lines.append(
            f'<g id="link-{parts.plan.label(link)}">'
            f'<path d="{path}" fill="none" stroke="#ff0000" stroke-width="{line:g}"/>{engraved}'
            f'<text x="{at.real:.3f}" y="{corner.imag - at.imag + _HALF * size:.3f}" '
            f'font-size="{size:.3g}" text-anchor="middle" fill="#0000ff">{parts.plan.label(link)}</text></g>'
        )
    wide, high = f"{corner.real:.3f}", f"{corner.imag:.3f}"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide}mm" height="{high}mm" viewBox="0 0 {wide} {high}" '
        f'font-family="sans-serif"><title>Parts to cut, millimetres</title>{"".join(lines)}</svg>\n'
    )


def _label_place(outline: Rounded, holes: Sequence[Rounded]) -> complex:
    """Return a place for a number on the way between two corners of a part, clear of its holes."""
    hull = outline.hull
    middle = sum(hull) / len(hull)
    tries = [middle] + [p + (q - p) * t for p, q in zip(hull, hull[1:] + hull[:1]) for t in (0.5, 0.3, 0.2, 0.7)]
    if isinstance(outline, Cut):  # between hub and rim
        reach = 0.5 * min(abs(corner.at - middle) for corner in outline.corners)
        tries += [middle + reach * cmath.exp(0.25j * math.pi * k) for k in range(8)]
    for teeth in (hole for hole in holes if isinstance(hole, Cut)):  # on the rim of a ring
        reach = 0.5 * (outline.radius + teeth.radius)
        tries += [middle + reach * cmath.exp(0.25j * math.pi * k) for k in range(8)]
    return max(
        tries, key=lambda z: min((min(abs(z - c) for c in hole.hull) - hole.radius for hole in holes), default=0.0)
    )


def _path(shape: Rounded, height: float) -> str:
    """Write a boundary with true arcs, y downwards."""
    corners = shape.corners
    start = corners[0].at
    text = [f"M{start.real:.5f} {height - start.imag:.5f}"]
    for (at, bulge), (end, _) in zip(corners, corners[1:] + corners[:1]):
        to = f"{end.real:.5f} {height - end.imag:.5f}"
        if bulge:
            _, radius, angle = arc_of(at, end, bulge)
            text.append(f"A{radius:.5f} {radius:.5f} 0 {int(angle > math.pi + 1e-9)} 0 {to}")
        else:
            text.append(f"L{to}")
    return " ".join(text) + "Z"


def cut_dxf(parts: Parts) -> Any:
    """Return all sheets beside each other as an ezdxf drawing: layers OUTLINE, HOLES and NUMBERS."""
    ezdxf = need("ezdxf", "dxf", "DXF")
    drawing = ezdxf.new("R2010", units=4)
    for name, colour in (("OUTLINE", 1), ("HOLES", 3), ("NUMBERS", 5)):
        drawing.layers.add(name, color=colour)
    space = drawing.modelspace()
    for link, outline, holes in _sheet(parts):
        for shape, layer in ((outline, "OUTLINE"), *((hole, "HOLES") for hole in holes)):
            look = {"layer": layer}
            if len(shape.corners) == 2 and len(shape.hull) == 1:
                space.add_circle((shape.hull[0].real, shape.hull[0].imag), shape.radius, dxfattribs=look)
            else:
                points = [(at.real, at.imag, bulge) for at, bulge in shape.corners]
                space.add_lwpolyline(points, format="xyb", close=True, dxfattribs=look)
        if pitch := outline.pitch:
            space.add_circle((outline.hull[0].real, outline.hull[0].imag), pitch, dxfattribs={"layer": "NUMBERS"})
        at = _label_place(outline, holes)
        height = max(2.0, 0.6 * parts.sizes.pin)
        text = space.add_text(parts.plan.label(link), height=height, dxfattribs={"layer": "NUMBERS"})
        text.set_placement(
            (at.real, at.imag), align=need("ezdxf.enums", "dxf", "DXF").TextEntityAlignment.MIDDLE_CENTER
        )
    return drawing


def triangles(parts: Parts, link: int, deviation: float = _DEVIATION) -> NDArray[np.float64]:
    """Return the surface of a link as triangles (n, 3, 3), seen from outside counter-clockwise.

    The faces are triangulated by ezdxf's version of Mapbox's earcut; arcs become chords at most ``deviation`` mm from
    them, inside the sheet and inside the holes.
    """
    earcut = need("ezdxf.math.triangulation", "dxf", "STL").mapbox_earcut_2d
    loops = [parts.plan.outlines[link].flat(deviation)]
    loops += [hole.flat(deviation)[::-1] for hole in parts.plan.holes[link]]
    pairs = [[(z.real, z.imag) for z in loop] for loop in loops]
    faces = np.array([[(p.x, p.y) for p in face] for face in earcut(pairs[0], pairs[1:])])
    one, other = faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]
    clockwise = one[:, 0] * other[:, 1] < one[:, 1] * other[:, 0]
    faces[clockwise] = faces[clockwise][:, ::-1]
    t = parts.sizes.thickness
    upper = np.concatenate([faces, np.full((*faces.shape[:2], 1), t)], axis=2)
    lower = np.concatenate([faces, np.zeros((*faces.shape[:2], 1))], axis=2)[:, ::-1]
    walls = []
    for loop in pairs:
        for (x, y), (u, v) in zip(loop, loop[1:] + loop[:1]):
            walls += [[(x, y, 0.0), (u, v, 0.0), (u, v, t)], [(x, y, 0.0), (u, v, t), (x, y, t)]]
    return np.concatenate([upper, lower, np.array(walls)])


def link_stl(parts: Parts, link: int) -> bytes:
    """Return a link as binary STL."""
    solid = triangles(parts, link)
    normals = np.cross(solid[:, 1] - solid[:, 0], solid[:, 2] - solid[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    rows = np.zeros(len(solid), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])
    rows["normal"], rows["corners"] = normals, solid
    head = f"graphsynth link {parts.plan.label(link)}, millimetres".encode().ljust(80, b" ")
    return head + len(solid).to_bytes(4, "little") + rows.tobytes()


def write_step(parts: Parts, link: int, path: Path) -> None:
    """Write a link as STEP, its arcs as true cylinders."""
    cad = need("build123d", "step", "STEP")

    def face(shape: Rounded) -> Any:
        edges = []
        for (at, bulge), (end, _) in zip(shape.corners, shape.corners[1:] + shape.corners[:1]):
            a, b = (at.real, at.imag), (end.real, end.imag)
            if bulge:
                centre, _, angle = arc_of(at, end, bulge)
                turn = complex(math.cos(angle / 2.0), math.sin(angle / 2.0))
                middle = centre + (at - centre) * turn
                edges.append(cad.ThreePointArc(a, (middle.real, middle.imag), b))
            else:
                edges.append(cad.Line(a, b))
        return cad.make_face(edges)

    sheet = face(parts.plan.outlines[link])
    for hole in parts.plan.holes[link]:
        sheet -= face(hole)
    solid = cad.extrude(sheet, amount=parts.sizes.thickness)
    solid.label = f"link {parts.plan.label(link)}"
    cad.export_step(solid, os.fspath(path))
