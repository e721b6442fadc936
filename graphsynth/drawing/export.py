"""Sketches in files, by suffix: SVG, PNG and PDF, TikZ for papers in LaTeX, DXF for CAD programs.

TikZ: shapes are written in centimetres, one pixel being 1/96 inch, with colours defined by name in the picture.  A
sketch wider than the column of an article is made smaller as a whole, letters and line widths included.

DXF needs the extra ``dxf`` (ezdxf).  Units are millimetres: one unit of the mechanism is `unit` millimetres.  Bars,
plates, blocks, joints, ground and letters lie on layers of their names; nothing is filled, since CAD wants outlines.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path as File
from typing import Any

from graphsynth.core.errors import GraphsynthError
from graphsynth.core.extras import need
from graphsynth.drawing.canvas import DPI, figure_of
from graphsynth.drawing.palette import LIGHT
from graphsynth.drawing.shapes import LAYERS, Circle, Path, Placement, Point, Shape, Style, Text, placement
from graphsynth.drawing.sketch import Sketch
from graphsynth.drawing.svg import bare, number, picture

#: Widest picture in centimetres: the column of LaTeX's article class at 10 pt is 12.1 cm wide.
MAX_WIDTH = 12.0
_CM = 2.54 / 96.0
_PT = 72.27 / 96.0
_ANCHOR = {"middle": "center", "start": "west", "end": "east"}
#: Characters that TeX reads otherwise.
_ESCAPE = str.maketrans(
    {
        "\\": r"\textbackslash{}",
        "{": r"\{",
        "}": r"\}",
        "$": r"\$",
        "&": r"\&",
        "%": r"\%",
        "#": r"\#",
        "_": r"\_",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "°": r"\textdegree{}",
    }
)


def tikz(sketch: Sketch, pose: Sequence[Sequence[float]] | None = None, *, max_width: float | None = MAX_WIDTH) -> str:
    r"""Write a sketch as a ``tikzpicture``.

    `pose`: where every link is; needed if any shape is fixed to a link. `max_width`: centimetres; a wider sketch is
    made so wide, a narrower one keeps its size.  None: no bound. Needs nothing but ``\usepackage{tikz}``. Raises
    `GraphsynthError` for a width that is not positive and finite.

    >>> s = Sketch(0j, 2 + 1j, width=200)
    >>> s.joint(1 + 0.5j)
    >>> tikz(s).count("circle")
    1
    """
    if max_width is not None and not 0.0 < max_width < math.inf:
        raise GraphsynthError(f"max_width = {max_width!r} cm must be positive and finite; None for no bound")
    place = placement(pose)
    zoom = 1.0 if max_width is None else min(1.0, max_width / (sketch.width * _CM))
    body = [_element(shape, sketch, place, zoom) for shape in sketch.ordered()]
    title = [f"% {' '.join(sketch.title.split())}"] if sketch.title else []
    lines = [*title, r"\begin{tikzpicture}[line join=round]"]
    lines += [rf"\definecolor{{gs-{name}}}{{HTML}}{{{value[1:].upper()}}}" for name, value in LIGHT.items()]
    lines += [*body, r"\end{tikzpicture}", ""]
    return "\n".join(lines)


def document(pictures: Sequence[str]) -> str:
    """Put pictures side by side in a ``standalone`` document of LaTeX."""
    head = "\\documentclass[border=2pt]{standalone}\n\\usepackage{tikz}\n\\begin{document}\n"
    return head + "\\quad\n".join(pictures) + "\\end{document}\n"


def _number(value: float) -> str:
    return number(value, 4)


def _element(shape: Shape, sketch: Sketch, place: Placement, zoom: float) -> str:
    cm = zoom * _CM

    def at(point: Point, offset: Point = 0j) -> str:
        x, y = sketch.xy(place(shape.link, point))
        return f"({_number((x + offset.real) * cm)},{_number((sketch.height - y + offset.imag) * cm)})"

    note = f" % {shape.part}" if shape.part else ""
    if isinstance(shape, Text):
        size = _number(shape.size * zoom * _PT)
        font = rf"\fontsize{{{size}}}{{{size}}}\selectfont\sffamily" + (r"\bfseries" if shape.weight else "")
        options = f"anchor={_ANCHOR[shape.anchor]}, text=gs-{shape.colour}, inner sep=0pt, font={{{font}}}"
        return rf"\node[{options}] at {at(shape.at, shape.offset)} {{{shape.text.translate(_ESCAPE)}}};{note}"
    options = _options(shape.style, sketch.symbol * zoom, zoom)
    if isinstance(shape, Circle):
        radius = _number(shape.radius * sketch.scale * cm)
        return rf"\path[{options}] {at(shape.centre)} circle[radius={radius}];{note}"
    pieces = []
    for run in shape.runs:
        points = [at(point) for point in run]
        if shape.curved:  # a quadratic curve as a cubic one
            p, q, r = run
            pieces.append(f"{points[0]} .. controls {at((p + 2 * q) / 3)} and {at((r + 2 * q) / 3)} .. {points[2]}")
        else:
            pieces.append(" -- ".join([*points, "cycle"] if shape.closed else points))
    return rf"\path[{options}] {' '.join(pieces)};{note}"


def _options(style: Style, symbol: float, zoom: float) -> str:
    found = []
    if style.fill:
        found.append(f"fill=gs-{style.fill}")
        if style.fill_opacity < 1.0:
            found.append(f"fill opacity={_number(style.fill_opacity)}")
    if style.stroke and style.width:
        found += [f"draw=gs-{style.stroke}", f"line width={_number(style.width * symbol * _PT)}pt"]
        if style.round_ends:
            found.append("line cap=round")
        if style.dash:
            words = [
                f"{'off' if k % 2 else 'on'} {_number(length * zoom * _PT)}pt" for k, length in enumerate(style.dash)
            ]
            found.append(f"dash pattern={' '.join(words)}")
    return ", ".join(found)


_ALIGN = {"middle": "MIDDLE_CENTER", "start": "MIDDLE_LEFT", "end": "MIDDLE_RIGHT"}
_CURVE = 12  # straight pieces of a curve


def dxf(sketch: Sketch, pose: Sequence[Sequence[float]] | None = None, *, unit: float = 40.0) -> Any:
    """Return a sketch as an ``ezdxf`` drawing (DXF R2010, millimetres).

    `pose`: where every link is; needed if any shape is fixed to a link. `unit`: millimetres per unit of the mechanism;
    1000 for a mechanism in metres at full size. Raises `MissingExtraError` if ezdxf is not installed.
    """
    ezdxf = need("ezdxf", "dxf", "DXF")
    drawing = ezdxf.new("R2010", setup=True, units=4)
    space, place = drawing.modelspace(), placement(pose)
    for colour, layer in enumerate(LAYERS, 1):
        drawing.layers.add(layer.upper(), color=colour)
    for shape in sketch.ordered():
        _add(space, shape, sketch, place, unit)
    return drawing


def _add(space: Any, shape: Shape, sketch: Sketch, place: Placement, unit: float) -> None:
    def at(point: Point, offset: Point = 0j) -> tuple[float, float]:
        z = place(shape.link, point) + offset * sketch.pixel
        return z.real * unit, z.imag * unit

    look = {"layer": shape.layer.upper()}
    if isinstance(shape, Circle):
        space.add_circle(at(shape.centre), shape.radius * unit, dxfattribs=look)
    elif isinstance(shape, Path):
        for run in shape.runs:
            points = list(run)
            if shape.curved:  # quadratic
                p, q, r = run
                steps = [k / _CURVE for k in range(_CURVE + 1)]
                points = [(1 - t) ** 2 * p + 2 * t * (1 - t) * q + t * t * r for t in steps]
            space.add_lwpolyline(list(map(at, points)), close=shape.closed, dxfattribs=look)
    elif isinstance(shape, Text):
        from ezdxf.enums import TextEntityAlignment

        height = 0.7 * shape.size * sketch.pixel * unit
        text = space.add_text(shape.text, height=height, dxfattribs=look)
        text.set_placement(at(shape.at, shape.offset), align=TextEntityAlignment[_ALIGN[shape.anchor]])


def save_dxf(
    path: str | os.PathLike[str], sketch: Sketch, pose: Sequence[Sequence[float]] | None = None, *, unit: float = 40.0
) -> None:
    """Write a sketch to a DXF file; see :func:`dxf`."""
    dxf(sketch, pose, unit=unit).saveas(os.fspath(path))


#: Suffixes of pictures.
SUFFIXES = (".svg", ".png", ".pdf", ".tikz", ".tex", ".dxf")

Pose = Sequence[Sequence[float]]


def save(path: str | File, sketches: Sequence[Sketch], poses: Sequence[Pose | None]) -> None:
    """Write sketches side by side as the suffix says.

    ``.svg``, ``.tikz`` (a picture to be read into a paper) and ``.tex`` (a document) need no other package; ``.png``
    and ``.pdf`` use matplotlib, ``.dxf`` ezdxf.

    `sketches`, `poses`: a pose for every sketch; None for one that does not move. Raises `GraphsynthError`: another
    suffix, several sketches in one DXF, a package that is not installed.
    """
    path = File(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise GraphsynthError(f"{path} must end in {', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}")
    if suffix == ".dxf":
        if len(sketches) != 1:
            raise GraphsynthError("a DXF file holds one sketch; write each to its own")
        save_dxf(path, sketches[0], poses[0])
    elif suffix in (".tikz", ".tex"):
        pictures = [tikz(sketch, pose) for sketch, pose in zip(sketches, poses)]
        path.write_text(document(pictures) if suffix == ".tex" else "".join(pictures), "utf-8")
    elif suffix == ".svg":
        path.write_text(beside([sketch.svg(pose) for sketch, pose in zip(sketches, poses)], sketches), "utf-8")
    else:
        from matplotlib import rc_context

        with rc_context({"font.family": "sans-serif", "pdf.fonttype": 42}):
            figure, _ = figure_of(sketches, poses)
            metadata: dict[str, Any] = {"CreationDate": None} if suffix == ".pdf" else {}
            figure.savefig(path, dpi=2 * DPI, metadata=metadata)


def beside(pictures: Sequence[str], sketches: Sequence[Sketch]) -> str:
    """Put SVG pictures side by side in one."""
    if len(pictures) == 1:
        return pictures[0]
    width, height = sum(s.width for s in sketches), max(s.height for s in sketches)
    body, left = [], 0.0
    for text, sketch in zip(pictures, sketches):
        top = (height - sketch.height) / 2
        body.append(bare(text).replace("<svg ", f'<svg x="{number(left)}" y="{number(top)}" ', 1))
        left += sketch.width
    return picture(body, width, height)
