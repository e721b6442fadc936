"""What a drawing consists of: paths, circles and texts, in the units of the mechanism, each fixed to a link.

One list of shapes is the picture; the SVG writer, the matplotlib canvas and the animations all read the same list, so
they cannot disagree.  A shape with ``link = k`` has its points in the frame of link k and is carried along by the pose
``(x, y, theta)`` of that link; a shape with ``link = FIXED`` has them in the fixed frame.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable, Sequence
from dataclasses import dataclass

Point = complex

#: Link number of shapes that do not move.
FIXED = -1

#: From back to front.
LAYERS = ("trace", "pitch", "ground", "plate", "bar", "block", "joint", "mark", "label")


@dataclass(frozen=True, slots=True)
class Style:
    """How a shape looks: colour names (see :data:`graphsynth.drawing.palette.LIGHT`), widths and dashes in pixels."""

    stroke: str = "link"
    width: float = 2.0
    fill: str = ""
    dash: tuple[float, ...] = ()
    round_ends: bool = False
    round_joins: bool = True
    fill_opacity: float = 1.0


@dataclass(frozen=True, slots=True)
class Path:
    """Straight lines through the points of every run; ``curved`` reads triples as quadratic curves."""

    runs: tuple[tuple[Point, ...], ...]
    style: Style
    closed: bool = False
    curved: bool = False
    link: int = FIXED
    layer: str = "bar"
    part: str = ""


@dataclass(frozen=True, slots=True)
class Circle:
    """A circle; the radius is in the units of the mechanism."""

    centre: Point
    radius: float
    style: Style
    link: int = FIXED
    layer: str = "joint"
    part: str = ""


@dataclass(frozen=True, slots=True)
class Text:
    """Upright text centred at a point moved by ``offset`` pixels (y upwards); a halo keeps it legible."""

    at: Point
    text: str
    offset: Point = 0j
    anchor: str = "middle"
    colour: str = "ink"
    size: float = 14.0
    halo: float = 3.0
    weight: str = ""
    link: int = FIXED
    layer: str = "label"
    part: str = ""


Shape = Path | Circle | Text
Placement = Callable[[int, Point], Point]


def placement(pose: Sequence[Sequence[float]] | None) -> Placement:
    """Return the function that carries a point of a link to the plane, for one pose ``(x, y, theta)`` per link.

    >>> place = placement([(0, 0, 0), (1, 0, cmath.pi / 2)])
    >>> z = place(1, 2 + 0j)
    >>> round(z.real, 12), round(z.imag, 12)
    (1.0, 2.0)
    """
    if pose is None:
        return lambda link, point: point
    origin = [complex(row[0], row[1]) for row in pose]
    turn = [cmath.exp(1j * row[2]) for row in pose]
    return lambda link, point: point if link == FIXED else origin[link] + turn[link] * point
