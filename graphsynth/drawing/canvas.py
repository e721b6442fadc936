"""Shapes drawn through matplotlib: PNG, PDF, axes of the user's own figure, frames of animations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from graphsynth.core.errors import GraphsynthError
from graphsynth.drawing.palette import LIGHT
from graphsynth.drawing.shapes import FIXED, Circle, Path, Shape, Style, Text, placement
from graphsynth.drawing.sketch import Sketch

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


def draw(sketch: Sketch, axes: Any, pose: Pose | None = None) -> Any:
    """Draw a sketch on matplotlib axes; return the axes."""
    Canvas(sketch, axes, pose)
    return axes


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
