"""A sketch as TikZ: for papers in LaTeX.

Shapes are written in centimetres, one pixel being 1/96 inch, with colours defined by name in the picture.  A sketch
wider than the column of an article is made smaller as a whole, letters and line widths included.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from graphsynth.core.errors import GraphsynthError
from graphsynth.drawing.palette import LIGHT
from graphsynth.drawing.shapes import Circle, Path, Placement, Point, Shape, Style, Text, placement
from graphsynth.drawing.sketch import Sketch

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
    text = f"{value:.4f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


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
    return rf"\path[{options}] {_runs(shape, at)};{note}"


def _runs(path: Path, at: Callable[[Point], str]) -> str:
    pieces = []
    for run in path.runs:
        points = [at(point) for point in run]
        if path.curved:  # a quadratic curve as a cubic one
            p, q, r = run
            pieces.append(f"{points[0]} .. controls {at((p + 2 * q) / 3)} and {at((r + 2 * q) / 3)} .. {points[2]}")
        else:
            pieces.append(" -- ".join([*points, "cycle"] if path.closed else points))
    return " ".join(pieces)


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
