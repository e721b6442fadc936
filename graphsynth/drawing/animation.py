"""Moving pictures of one stage: an HTML page with a player, an SVG that moves by itself, a GIF.

The stage is a sketch whose links are carried through the frames.  In the page and the SVG every link is a group of
shapes that is shifted and turned as a whole, so the file holds three numbers for each link and frame, whatever the
links look like; a GIF is drawn frame by frame through matplotlib, with one palette for all, and written by Pillow.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from itertools import groupby
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.bodies import bodies
from graphsynth.drawing.diagram import mechanism_sketch
from graphsynth.drawing.export import figure_of
from graphsynth.drawing.frames import Frames, frames_of
from graphsynth.drawing.moving import Moving
from graphsynth.drawing.pages import policy
from graphsynth.drawing.palette import LIGHT, STYLE, TRACE_COLOURS, VARIABLES
from graphsynth.drawing.shapes import FIXED, Point, Shape, Text
from graphsynth.drawing.sketch import Sketch
from graphsynth.drawing.svg import element, number, picture, words
from graphsynth.mechanism.joints import Prismatic, Revolute

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]
_LINE = 17.0  # height of a line of the note, pixels


class _Stage:
    """A sketch whose links are groups, and the pose of each group's origin in pixels and degrees over the frames."""

    def __init__(self, motion: Motion, count: int, seconds: float, width: float, height: float, title: str) -> None:
        if not (math.isfinite(seconds) and seconds > 0.0):
            raise GeometryError(f"seconds = {seconds} must be positive and finite; give the time of one pass")
        self.frames: Frames = frames_of(motion, count)
        frames, mechanism = self.frames, motion.mechanism
        self.sketch: Sketch = mechanism_sketch(mechanism, frames.poses, width=width, height=height, title=title)
        # the origin of a group is the middle of its link: turning errors stay small however far its frame lies
        shown = [body.vertices() for body in bodies(mechanism, frames.poses, 0.0)]
        self.middle: list[Point] = [sum(points) / len(points) if points else 0j for points in shown]
        self.ends = shown

    @property
    def lines(self) -> list[str]:
        """The note under the picture, in lines of its width."""
        return wrap(self.frames.note, max(20, int(self.sketch.width / 6.6)))

    def local(self, link: int, point: Point) -> tuple[float, float]:
        """Pixels from the origin of a link's group, y down."""
        offset = (point - self.middle[link]) * self.sketch.scale
        return offset.real, -offset.imag

    def track(self, link: int, at: Point | None = None) -> Array:
        """Place (pixels) and turn (degrees clockwise) of a link's group, or of a point, in all frames, shape (n, 3)."""
        pose = self.frames.poses[:, link]
        z = pose[:, 0] + 1j * pose[:, 1] + np.exp(1j * pose[:, 2]) * (self.middle[link] if at is None else at)
        x, y = np.array([self.sketch.xy(complex(value)) for value in z]).T
        return np.column_stack([x, y, -np.degrees(pose[:, 2])])

    def layers(self) -> list[tuple[str, int, list[Shape]]]:
        """Layer and link of all shapes, back to front; the frame stands still."""
        found = groupby(self.sketch.ordered(), key=lambda shape: (shape.layer, shape.link))
        return [(layer, link, list(run)) for (layer, link), run in found]

    def still(self, shapes: Sequence[Shape]) -> str:
        """Markup of shapes that do not move."""
        return "".join(element(s, self.sketch.xy, self.sketch.scale, self.sketch.symbol) for s in shapes)

    def about(self, link: int, shapes: Sequence[Shape], upright: str = "") -> str:
        """Markup of shapes about the origin of a link's group."""
        return "".join(
            element(s, lambda p: self.local(link, p), self.sketch.scale, self.sketch.symbol, upright) for s in shapes
        )

    def groups(self, grip: int) -> list[str]:
        """Markup for the player, back to front: what it moves is marked with the number of the link."""
        found = []
        for layer, link, shapes in self.layers():
            if link == FIXED:
                found.append(f'<g data-layer="{layer}">{self.still(shapes)}</g>')
                continue
            x, y, turn = self.track(link)[0]
            body = self.about(link, shapes, f'data-r="{link}" transform="rotate({number(-turn)})"')
            if grip == link and layer == "label":  # an invisible thick line along the driven link, to take hold of
                ends = [self.local(link, point) for point in self.ends[link]]
                data = " L".join(f"{number(x)} {number(y)}" for x, y in (ends if len(ends) > 1 else ends * 2))
                body += (
                    f'<path class="grip" d="M{data}" fill="none" stroke="#000" stroke-opacity="0" stroke-width="34" '
                    'stroke-linecap="round" pointer-events="stroke"/>'
                )
            where = f"translate({number(x)} {number(y)}) rotate({number(turn)})"
            found.append(f'<g data-k="{link}" data-layer="{layer}" transform="{where}">{body}</g>')
        return found


def animation_html(
    motion: Motion,
    *,
    frames: int = 120,
    title: str = "",
    note: str = "",
    seconds: float = 5.0,
    width: float = 540.0,
    height: float = 440.0,
) -> str:
    """One HTML page with the moving mechanism: play, pause, slider, dragging, speed, traces, keyboard.

    The page needs no other file and no network; it is light or dark with the system, and stands still at first for
    readers who ask for reduced motion.

    `motion`: one that does not close is shown to and fro over the part it reaches, with the reason underneath.
    `frames`: poses in the file, 2..2000; the page interpolates between them. `title`, `note`: heading, and a remark
    under the picture. `seconds`: time of one pass at speed 1. `width`, `height`: largest size of the picture in pixels
    of the drawing; it scales with the page. Raises `GeometryError`: nothing of the motion is assembled, or a number is
    out of its bounds.
    """
    name = title or f"Mechanism with {motion.mechanism.graph.links} links"
    stage = _Stage(motion, frames, seconds, width, height, name)
    first = motion.mechanism.drivers[0]
    driver = first.link if first.link != motion.mechanism.frame else first.base  # the moving one of its joint
    svg = picture(stage.groups(driver), stage.sketch.width, stage.sketch.height, name, style="")
    notes = "".join(
        f'<p class="{css}">{escape(words)}</p>' for css, words in (("", note), ("stop", stage.frames.note)) if words
    )
    template = files("graphsynth.drawing").joinpath("player.html").read_text("utf-8")
    data = json.dumps(_data(stage, seconds, driver), separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    allowed = policy(re.findall("<script>(.*?)</script>", template, re.DOTALL))
    parts = {"POLICY": allowed, "STYLE": VARIABLES + STYLE, "SVG": svg, "NOTES": notes, "DATA": data}
    parts["TITLE"] = escape(name)
    pieces = re.split("@([A-Z]+)@", template)
    return "".join(parts[piece] if k % 2 else piece for k, piece in enumerate(pieces))


def _data(stage: _Stage, seconds: float, driver: int) -> dict[str, Any]:
    """Everything the player needs: poses as whole tenths of pixels and hundredths of degrees."""
    frames, mechanism = stage.frames, stage.frames.mechanism

    def short(link: int, point: Point) -> list[float]:
        return [round(value, 2) for value in stage.local(link, point)]

    poses = [
        np.rint(stage.track(link) * [10.0, 10.0, 100.0]).astype(int).ravel().tolist()
        for link in range(mechanism.graph.links)
    ]
    drivers = []
    for driven, coordinates in zip(mechanism.drivers, frames.coordinates.T):  # in degrees or lengths, rounded
        angle = not isinstance(mechanism.joint(*driven.pair), Prismatic)
        values = [float(f"{math.degrees(v):.2f}" if angle else f"{v:.6g}") for v in coordinates]
        drivers.append({"name": f"driver {driven.base}-{driven.link}", "angle": angle, "values": values})
    points = [
        {"name": name, "link": link, "colour": TRACE_COLOURS[k % len(TRACE_COLOURS)], "at": short(link, complex(*at))}
        for k, (name, (link, at)) in enumerate(mechanism.points.items())
    ]
    # where the driven link is held, and the centre it turns about if that is fixed
    joint = mechanism.joint(*mechanism.drivers[0].pair)
    own = complex(*(joint.at_a if joint.a == driver else joint.at_b))
    far = max(stage.ends[driver], key=lambda point: abs(point - own), default=own)
    centre = None
    if isinstance(joint, Revolute) and mechanism.frame in (joint.a, joint.b) and abs(far - own) > 0.0:
        fixed = complex(*(joint.at_a if joint.a == mechanism.frame else joint.at_b))
        centre = [round(value, 2) for value in stage.sketch.xy(fixed)]
    grip = {"link": driver, "at": short(driver, far), "centre": centre}
    played = {"count": len(frames.poses), "loop": frames.loops, "seconds": seconds, "grip": grip}
    return played | {"poses": poses, "drivers": drivers, "points": points}


def animated_svg(
    motion: Motion,
    *,
    frames: int = 90,
    title: str = "",
    seconds: float = 5.0,
    width: float = 560.0,
    height: float = 480.0,
    behind: Sequence[Shape] = (),
) -> str:
    """One SVG that moves by itself (SMIL, one clock), for pages and slides where no script runs.

    `motion`, `frames`, `title`, `seconds`, `width`, `height`: as for :func:`animation_html`. `behind`: shapes that
    stand still behind it, in the coordinates of the frame, as what a point should draw. It stands still for readers
    who ask for reduced motion. Raises `GeometryError`: nothing of the motion is assembled, or a number is out of its
    bounds.
    """
    stage = _Stage(motion, frames, seconds, width, height, title)
    stage.sketch.shapes[:0] = behind
    shown = stage.frames
    last = len(shown.poses) - 1
    # round, or to and fro: one clock moves everything, so it runs over the whole period
    order = list(range(last + 1)) if shown.loops else [*range(last + 1), *range(last - 1, -1, -1)]
    lines = stage.lines
    tall = stage.sketch.height + _LINE * len(lines) + (8.0 if lines else 0.0)
    drawing = Moving(stage.sketch.width, tall, seconds if shown.loops else 2.0 * seconds)
    for layer, link, shapes in stage.layers():
        if link == FIXED:
            drawing.fixed(stage.still(shapes))
            continue
        name = f' data-link="{link}" data-layer="{layer}"'
        rigid = [shape for shape in shapes if not isinstance(shape, Text)]
        if rigid:
            drawing.carried(stage.track(link)[order], stage.about(link, rigid), name)
        for shape in shapes:
            if isinstance(shape, Text):  # letters stay upright
                mark = element(shape, lambda point: (0.0, 0.0), stage.sketch.scale, stage.sketch.symbol)
                drawing.carried(stage.track(link, shape.at)[order, :2], mark, name)
    for k, line in enumerate(lines):
        drawing.fixed(words(line, 12.0, stage.sketch.height + _LINE * k + 6.0, size=12.5, colour="b"))
    return drawing.svg(title)


def save_gif(
    motion: Motion,
    path: str | Path,
    *,
    frames: int = 60,
    title: str = "",
    seconds: float = 5.0,
    width: float = 440.0,
    height: float = 380.0,
) -> int:
    """Write an endless GIF of a motion.

    `motion`: one that does not close is shown to and fro over the part it reaches, with the reason underneath.
    `frames`: pictures of one pass, 2..2000. `title`: written above the picture. `seconds`: time of one pass; a GIF
    counts hundredths of a second, and most viewers show at most 50 pictures a second. `width`, `height`: largest size
    of the picture in pixels. Number of pictures in the file. Raises `GeometryError`: nothing of the motion is
    assembled, or a number is out of its bounds.
    """
    stage = _Stage(motion, frames, seconds, width, height, title)
    pictures = _pictures(stage, title)
    passes = max(len(stage.frames.poses) - 1, 1)
    duration = max(20, round(seconds / passes * 100.0) * 10)
    first, *rest = [pictures[k] for k in stage.frames.order]
    endless = {"save_all": True, "loop": 0, "optimize": True, "disposal": 1}
    first.save(Path(path), format="GIF", append_images=rest, duration=duration, **endless)
    return 1 + len(rest)


def _pictures(stage: _Stage, title: str) -> list[Any]:
    """Draw every frame once."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.colors import to_rgb
    from PIL import Image

    poses = stage.frames.poses.tolist()
    figure, (canvas,) = figure_of([stage.sketch], poses[:1], above=title, below=stage.lines)
    agg = FigureCanvasAgg(figure)
    found: list[Any] = []
    # every ink in seven steps to the paper, and the ink of links in steps to the fill of plates
    inks = dict.fromkeys(LIGHT[name] for name in ("link", "soft", "note", "a", "b", "c", "d"))
    pairs = [(ink, LIGHT["paper"]) for ink in inks] + [(LIGHT["link"], LIGHT["fill"])]
    colours = dict.fromkeys(
        tuple(round(255 * (p * k + q * (6 - k)) / 6) for p, q in zip(to_rgb(ink), to_rgb(ground)))
        for ink, ground in pairs
        for k in range(7)
    )
    # Pillow looks colours up in boxes of eight: nothing may lie as close to the paper as the edge of a plate
    palette = Image.new("P", (1, 1))
    palette.putpalette([value for colour in colours for value in colour])
    for pose in poses:
        canvas.move(pose)
        agg.draw()
        image = Image.fromarray(np.asarray(agg.buffer_rgba())).convert("RGB")
        found.append(image.quantize(palette=palette, dither=Image.Dither.NONE))
    return found
