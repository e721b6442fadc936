"""Sketches on matplotlib axes and in files, by suffix: SVG, PNG and PDF, TikZ for papers in LaTeX, DXF for CAD.

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

import numpy as np

from graphsynth.core.errors import GraphsynthError
from graphsynth.core.extras import need
from graphsynth.drawing.palette import LIGHT
from graphsynth.drawing.shapes import FIXED, LAYERS, Circle, Path, Placement, Point, Shape, Style, Text, placement
from graphsynth.drawing.sketch import Sketch
from graphsynth.drawing.svg import bare, number, picture

Pose = Sequence[Sequence[float]]

#: Pixels of a sketch per inch of a figure.
DPI = 96.0


class Canvas:
    """The artists of a sketch on axes; they can be moved to another pose without being made again.

    `axes`: its limits and aspect are set to show the whole sketch; data coordinates are those of the mechanism. `pose`:
    where every link is; needed if any shape is fixed to a link.
    """

    def __init__(self, sketch: Sketch, axes: Any, pose: Pose | None = None) -> None:
        self.sketch, self.axes = sketch, axes
        edge = sketch.margin * sketch.pixel
        axes.set_aspect("equal", adjustable="box")
        axes.set_xlim(sketch.lower.real - edge, sketch.upper.real + edge)
        axes.set_ylim(sketch.lower.imag - edge, sketch.upper.imag + edge)
        box = axes.get_window_extent()
        #: typographic points that one pixel of the sketch takes on these axes
        self._points = float(min(box.width / sketch.width, box.height / sketch.height) * 72.0 / axes.figure.dpi)
        self._moving: list[tuple[Shape, Any]] = []
        for order, shape in enumerate(sketch.ordered()):
            artist = self._artist(shape, 2.0 + order * 1e-3)
            if shape.link != FIXED:
                self._moving.append((shape, artist))
        self.move(pose)

    def _artist(self, shape: Shape, order: float) -> Any:
        from matplotlib.patches import Circle as CirclePatch, PathPatch

        if isinstance(shape, Text):
            return self._text(shape, order)
        look = self._look(shape.style)
        if isinstance(shape, Circle):
            patch: Any = CirclePatch((shape.centre.real, shape.centre.imag), shape.radius, **look)
        else:
            patch = PathPatch(_outline(shape), **look)
        patch.set_zorder(order)
        patch.set_gid(shape.part or None)
        return self.axes.add_patch(patch)

    def _look(self, style: Style) -> dict[str, Any]:
        from matplotlib.colors import to_rgba

        width = style.width * self.sketch.symbol * self._points
        look: dict[str, Any] = {
            "facecolor": to_rgba(LIGHT[style.fill], style.fill_opacity) if style.fill else "none",
            "edgecolor": LIGHT[style.stroke] if style.stroke and width else "none",
            "linewidth": width,
            "capstyle": "round" if style.round_ends else "butt",
            "joinstyle": "round" if style.round_joins else "miter",
        }
        if style.dash and width:
            # matplotlib multiplies dashes by the line width
            look["linestyle"] = (0.0, [d * self._points / width for d in style.dash])
        return look

    def _text(self, shape: Text, order: float) -> Any:
        from matplotlib.patheffects import withStroke

        place = {"middle": "center", "start": "left", "end": "right"}[shape.anchor]
        k = self._points
        note = self.axes.annotate(
            shape.text,
            (shape.at.real, shape.at.imag),
            xytext=(shape.offset.real * k, shape.offset.imag * k),
            textcoords="offset points",
            ha=place,
            va="center_baseline" if len(shape.text) > 2 else "center",
            fontsize=shape.size * k,
            color=LIGHT[shape.colour],
            zorder=order,
            annotation_clip=False,
            fontweight=shape.weight or "normal",
            parse_math=False,
        )
        note.set_gid(shape.part or None)
        if shape.halo:
            note.set_path_effects([withStroke(linewidth=shape.halo * k, foreground=LIGHT["paper"])])
        return note

    def move(self, pose: Pose | None) -> None:
        """Carry every link to a pose."""
        from matplotlib.transforms import Affine2D

        if not self._moving:
            return
        if pose is None:
            raise GraphsynthError("the sketch has moving links: give the pose of every link")
        place = placement(pose)
        for shape, artist in self._moving:
            if isinstance(shape, Text):
                point = place(shape.link, shape.at)
                artist.xy = (point.real, point.imag)
            else:
                x, y, theta = pose[shape.link]
                artist.set_transform(Affine2D().rotate(theta).translate(x, y) + self.axes.transData)


def _outline(path: Path) -> Any:
    """Matplotlib's path of the same points."""
    from matplotlib.path import Path as Outline

    points: list[tuple[float, float]] = []
    codes: list[Any] = []
    for run in path.runs:
        points += [(p.real, p.imag) for p in run]
        if path.curved:
            codes += [Outline.MOVETO, Outline.CURVE3, Outline.CURVE3]
        else:
            codes += [Outline.MOVETO, *([Outline.LINETO] * (len(run) - 1))]
        if path.closed:
            points.append(points[-len(run)])
            codes.append(Outline.CLOSEPOLY)
    return Outline(np.array(points), codes)


def figure_of(
    sketches: Sequence[Sketch],
    poses: Sequence[Pose | None],
    dpi: float = DPI,
    above: str = "",
    below: Sequence[str] = (),
) -> tuple[Any, list[Canvas]]:
    """Make a figure with the sketches side by side in their own size; return it and the canvases.

    `sketches`, `poses`: a pose for every sketch; None for one that does not move. `dpi`: pixels per inch; 96 gives the
    sketches their own size. `above`, `below`: a title, and lines of a remark.
    """
    from matplotlib.figure import Figure

    head, foot = (26.0 if above else 0.0), (17.0 * len(below) + 8.0 if below else 0.0)
    width, inner = sum(s.width for s in sketches), max(s.height for s in sketches)
    height = head + inner + foot
    figure = Figure(figsize=(width / DPI, height / DPI), dpi=dpi)
    figure.set_facecolor(LIGHT["paper"])
    canvases, left = [], 0.0
    for sketch, pose in zip(sketches, poses):
        bottom = foot + (inner - sketch.height) / 2
        axes = figure.add_axes(
            (left / width, bottom / height, sketch.width / width, sketch.height / height), label=f"sketch {left:g}"
        )
        axes.set_axis_off()
        canvases.append(Canvas(sketch, axes, pose))
        left += sketch.width
    if above:
        figure.text(12.0 / width, 1.0 - 18.0 / height, above, fontsize=10.5, color=LIGHT["ink"], parse_math=False)
    for k, line in enumerate(below):
        figure.text(12.0 / width, (foot - 14.0 - 17.0 * k) / height, line, fontsize=9.0, color=LIGHT["b"])
    return figure, canvases


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
