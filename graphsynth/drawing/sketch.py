"""A drawing under construction: symbols of kinematic diagrams put together from shapes, without third-party packages.

A :class:`Sketch` collects shapes in the units of the mechanism (y upwards).  Symbols and line widths keep their size on
the page whatever the units.  `Sketch.svg` writes one self-contained ``<svg>``; `graphsynth.drawing.export` draws the
same list of shapes through matplotlib.

Symbols (ISO 3952): a revolute joint is an open circle; one on the frame stands on a triangle with hatching; a link
with two joints is a bar, with more a shaded plate; a gear is a dash-dotted pitch circle with its centre marked.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from graphsynth.drawing.shapes import FIXED, LAYERS, Circle, Path, Placement, Point, Shape, Style, Text, placement
from graphsynth.drawing.svg import element, picture

_CHAIN = (8.0, 3.0, 2.0, 3.0)  # dash-dotted: pitch circles


@dataclass(slots=True)
class Sketch:
    """A list of shapes, and the part of the plane they are shown in.

    `lower`, `upper`: opposite corners of the part of the plane shown, in the units of the mechanism. `width`: width of
    the picture in pixels; the height follows from the aspect ratio. `margin`: free space around, in pixels, for symbols
    and labels. `title`: read out by screen readers. `symbol`: scale of symbols and line widths; below 1 for small
    pictures. Raises `ValueError` if the box is empty or not finite.

    >>> s = Sketch(0j, 2 + 1j, width=200)
    >>> s.bar(0j, 2 + 1j); s.ground(0j); s.joint(2 + 1j)
    >>> s.svg().startswith("<svg")
    True
    """

    lower: Point
    upper: Point
    width: float = 480.0
    margin: float = 28.0
    title: str = ""
    symbol: float = 1.0
    shapes: list[Shape] = field(default_factory=list)
    scale: float = field(init=False)  # pixels per unit of the mechanism
    height: float = field(init=False)  # of the picture, in pixels
    _link: int = FIXED
    _layer: str = LAYERS[0]
    _part: str = ""

    def __post_init__(self) -> None:
        size = self.upper - self.lower
        if not (cmath.isfinite(size) and size.real > 0 and size.imag > 0):
            raise ValueError(f"a sketch needs a box with positive finite sides, not {self.lower} .. {self.upper}")
        self.scale = (self.width - 2 * self.margin) / size.real
        self.height = self.scale * size.imag + 2 * self.margin

    @property
    def pixel(self) -> float:
        """Size of one pixel in the units of the mechanism."""
        return 1.0 / self.scale

    def xy(self, point: Point) -> tuple[float, float]:
        """Carry a point of the plane to the page, in pixels from the upper left corner."""
        offset = (point - self.lower) * self.scale
        return self.margin + offset.real, self.height - self.margin - offset.imag

    def on(self, link: int = FIXED, layer: str = LAYERS[0], part: str = "") -> Sketch:
        """Fix the shapes that follow to a link, put them in a layer and name them; return the sketch itself."""
        self._link, self._layer, self._part = link, layer, part
        return self

    def _path(self, runs: Sequence[Sequence[Point]], style: Style, closed: bool = False, curved: bool = False) -> None:
        found = tuple(map(tuple, runs))
        self.shapes.append(Path(found, style, closed, curved, self._link, self._layer, self._part))

    def _disc(self, centre: Point, pixels: float, style: Style) -> None:
        self.shapes.append(Circle(centre, pixels * self.pixel, style, self._link, self._layer, self._part))

    def bar(self, p: Point, q: Point, colour: str = "link", width: float = 4.0) -> None:
        """Draw a link with two joints."""
        self._path([(p, q)], Style(colour, width, round_ends=True))

    def line(self, points: Sequence[Point], colour: str = "link", width: float = 1.6, closed: bool = False) -> None:
        """Draw a thin line through points."""
        self._path([points], Style(colour, width, round_ends=True), closed)

    def plate(self, points: Sequence[Point], colour: str = "link", width: float = 3.0, opacity: float = 1.0) -> None:
        """Draw a link with three or more joints as a shaded polygon."""
        self._path([points], Style(colour, width, "fill", fill_opacity=opacity), closed=True)

    def outline(self, points: Sequence[Point], colour: str = "link", width: float = 2.0) -> None:
        """Draw a closed figure filled with the colour of the paper: the block of a slider, a slot."""
        self._path([points], Style(colour, width, "paper"), closed=True)

    def joint(self, point: Point, radius: float = 5.0) -> None:
        """Draw a revolute joint: an open circle."""
        self._disc(point, radius * self.symbol, Style("link", 2.0, "paper"))

    def multiple_joint(self, point: Point) -> None:
        """Draw a joint of three links or more: two circles."""
        self._disc(point, 9.0 * self.symbol, Style("link", 1.6))
        self.joint(point)

    def ground(self, point: Point, size: float = 17.0, direction: Point = -1j, joint: bool = True) -> None:
        """Draw a joint on the frame: a triangle below the joint, standing on hatched ground.

        `direction` points from the joint to the ground.
        """
        down = _unit(direction) * self.pixel * self.symbol
        side = down * 1j
        foot = point + down * size
        corners = (point, foot + side * size * 0.62, foot - side * size * 0.62)
        self._path([corners], Style("link", 2.0, "paper"), closed=True)
        self.hatch(foot - side * size, foot + side * size, down)
        if joint:
            self.joint(point)

    def hatch(self, start: Point, end: Point, down: Point, strokes: int = 5) -> None:
        """Draw a ground line with short strokes on its far side; `down` is the unit of length towards that side."""
        across = end - start
        slant = (down - _unit(across) * abs(down)) * 6.5
        feet = [start + across * ((i + 0.9) / strokes) for i in range(strokes)]
        self._path([(start, end), *((foot, foot + slant) for foot in feet)], Style("link", 1.6, round_ends=True))

    def circle(
        self,
        centre: Point,
        radius: float,
        colour: str = "soft",
        dash: Sequence[float] | str = _CHAIN,
        width: float = 1.3,
    ) -> None:
        """Draw a circle of the mechanism's size, dash-dotted by default as a pitch circle."""
        dashes = tuple(map(float, dash.split())) if isinstance(dash, str) else tuple(dash)
        style = Style(colour, width, dash=dashes)
        self.shapes.append(Circle(centre, radius, style, self._link, self._layer, self._part))

    def trace(
        self,
        points: Sequence[Point],
        colour: str = "a",
        width: float = 1.8,
        closed: bool = False,
        dash: Sequence[float] = (),
    ) -> None:
        """Draw the path of a point; a point that is not finite breaks the line."""
        runs: list[list[Point]] = [[]]
        for point in points:
            if cmath.isfinite(point):
                runs[-1].append(point)
            elif runs[-1]:
                runs.append([])
        whole = closed and len(runs) == 1
        long = [run for run in runs if len(run) > 1]
        if long:
            self._path(long, Style(colour, width, dash=tuple(dash)), closed=whole)

    def dot(self, point: Point, colour: str = "a", radius: float = 3.5) -> None:
        """Draw a filled dot of fixed size."""
        self._disc(point, radius * self.symbol, Style("", 0.0, colour))

    def label(
        self,
        point: Point,
        text: str,
        offset: Point = 0j,
        anchor: str = "middle",
        colour: str = "ink",
        size: float = 14.0,
    ) -> None:
        """Write text at a point, moved by `offset` pixels (y upwards); a halo keeps it readable over lines."""
        self.shapes.append(
            Text(point, text, offset, anchor, colour, size, link=self._link, layer=self._layer, part=self._part)
        )

    def curve(
        self, p: Point, q: Point, bend: float = 0.0, colour: str = "ink", width: float = 1.8, dash: Sequence[float] = ()
    ) -> None:
        """Draw an edge p-q as a quadratic curve bent aside by `bend` units (to the right of p-q if positive)."""
        middle = (p + q) / 2 - 1j * _unit(q - p) * bend * 2
        self._path([(p, middle, q)], Style(colour, width, dash=tuple(dash), round_joins=False), curved=True)

    def node(self, point: Point, text: str, radius: float = 10.0, filled: bool = False) -> None:
        """Draw a vertex of a graph: a circle with its number."""
        fill, ink = ("ink", "paper") if filled else ("paper", "ink")
        self._disc(point, radius, Style("ink", 1.6, fill))
        where = (self._link, self._layer, self._part)
        self.shapes.append(Text(point, text, 0j, "middle", ink, radius * 1.1, 0.0, "", *where))

    def ordered(self) -> list[Shape]:
        """Return the shapes from back to front; inside a layer in the order they were drawn."""
        rank = {layer: k for k, layer in enumerate(LAYERS)}
        return sorted(self.shapes, key=lambda shape: rank[shape.layer])

    def svg(self, pose: Sequence[Sequence[float]] | None = None) -> str:
        """Return the picture as one ``<svg>`` element that needs nothing else.

        `pose`: where every link is; needed if any shape is fixed to a link.
        """
        place = placement(pose)
        body = [self._element(shape, place) for shape in self.ordered()]
        return picture(body, self.width, self.height, self.title)

    def _element(self, shape: Shape, place: Placement) -> str:
        return element(shape, lambda point: self.xy(place(shape.link, point)), self.scale, self.symbol)


def _unit(vector: Point) -> Point:
    size = abs(vector)
    return vector / size if size > 0 else 1 + 0j


def degrees(angle: float) -> str:
    """Write an angle in radians as whole degrees within one turn.

    >>> degrees(-math.pi / 2)
    '270°'
    """
    return f"{round(math.degrees(angle)) % 360}°"
