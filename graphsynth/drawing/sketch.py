"""Kinematic diagrams as SVG, drawn the way a mechanism textbook does, without any third-party package.

A :class:`Sketch` collects shapes in the units of the mechanism (y upwards) and turns them into one self-contained
``<svg>``. Stroke widths and symbols keep their size on the page whatever the units. Colours are CSS variables with
light and dark values, so a sketch follows the page it is put in, and a file opened by itself follows the system.

Symbols: a joint is an open circle; a joint on the frame sits on a triangle with hatching; a link with three joints is
a shaded triangle; a gear is a dash-dotted pitch circle; paths are thin coloured lines.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape

__all__ = ["STYLE", "Sketch", "number"]

#: Light and dark values of every colour a drawing may use. Hues from the Okabe-Ito palette, safe for colour blindness.
STYLE = (
    ".gs{--ink:#1b2733;--soft:#8794a1;--paper:#ffffff;--link:#1b2733;--fill:#dbe4ee;--a:#0072b2;--b:#d55e00;"
    "--c:#009e73;--jam:#d55e00;font-family:system-ui,-apple-system,'Segoe UI',Roboto,sans-serif}"
    "@media (prefers-color-scheme:dark){.gs{--ink:#e6edf3;--soft:#8b98a5;--paper:#12181f;--link:#e6edf3;--fill:#2b3a49;"
    "--a:#56b4e9;--b:#f0a060;--c:#3ecf9f;--jam:#f0883e}}"
)

Point = complex


def number(value: float) -> str:
    """Write a coordinate with at most two decimals and no trailing zeros.

    Examples
    --------
    >>> number(1.0), number(-0.001), number(2.346)
    ('1', '0', '2.35')
    """
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


@dataclass(slots=True)
class Sketch:
    """A drawing under construction.

    Parameters
    ----------
    lower, upper : complex
        Opposite corners of the part of the plane shown, in the units of the mechanism.
    width : float
        Width of the picture in pixels; the height follows from the aspect ratio.
    margin : float
        Free space around, in pixels, for symbols and labels.
    title : str
        Read out by screen readers.
    symbol : float
        Scale of symbols, line widths and labels; below 1 for small pictures.

    Raises
    ------
    ValueError
        If the box is empty or not finite.

    Examples
    --------
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
    _shapes: list[str] = field(default_factory=list)
    _scale: float = 1.0
    _height: float = 0.0

    def __post_init__(self) -> None:
        size = self.upper - self.lower
        if not (cmath.isfinite(size) and size.real > 0 and size.imag > 0):
            raise ValueError(f"a sketch needs a box with positive finite sides, not {self.lower} .. {self.upper}")
        self._scale = (self.width - 2 * self.margin) / size.real
        self._height = self._scale * size.imag + 2 * self.margin

    @property
    def pixel(self) -> float:
        """Size of one pixel in the units of the mechanism."""
        return 1.0 / self._scale

    @property
    def height(self) -> float:
        """Height of the picture in pixels."""
        return self._height

    def _xy(self, point: Point) -> tuple[float, float]:
        offset = (point - self.lower) * self._scale
        return self.margin + offset.real, self._height - self.margin - offset.imag

    def _path(self, points: Sequence[Point], closed: bool = False) -> str:
        steps = " L".join(f"{number(x)} {number(y)}" for x, y in map(self._xy, points))
        return f"M{steps}{'Z' if closed else ''}"

    def _add(self, tag: str, attributes: str, body: str = "") -> None:
        self._shapes.append(f"<{tag} {attributes}>{body}</{tag}>" if body else f"<{tag} {attributes}/>")

    def _stroke(self, colour: str, width: float) -> str:
        return f'stroke="var(--{colour})" stroke-width="{number(width * self.symbol)}"'

    def bar(self, p: Point, q: Point, colour: str = "link", width: float = 4.0) -> None:
        """Draw a link with two joints."""
        self._add(
            "path",
            f'd="{self._path((p, q))}" {self._stroke(colour, width)} stroke-linecap="round" fill="none"',
        )

    def plate(self, points: Sequence[Point], colour: str = "link", width: float = 3.0) -> None:
        """Draw a link with three or more joints as a shaded polygon."""
        self._add(
            "path",
            f'd="{self._path(points, closed=True)}" fill="var(--fill)" '
            f'{self._stroke(colour, width)} stroke-linejoin="round"',
        )

    def joint(self, point: Point, radius: float = 5.0) -> None:
        """Draw a revolute joint: an open circle."""
        x, y = self._xy(point)
        self._add(
            "circle",
            f'cx="{number(x)}" cy="{number(y)}" r="{number(radius * self.symbol)}" fill="var(--paper)" '
            f"{self._stroke('link', 2)}",
        )

    def ground(self, point: Point, size: float = 17.0, direction: Point = -1j) -> None:
        """Draw a joint on the frame: a triangle below the joint, standing on hatched ground.

        `direction` points from the joint to the ground.
        """
        down = _unit(direction) * self.pixel * self.symbol
        side = down * 1j
        foot = point + down * size
        self._add(
            "path",
            f'd="{self._path((point, foot + side * size * 0.62, foot - side * size * 0.62), closed=True)}" '
            f'fill="var(--paper)" {self._stroke("link", 2)} stroke-linejoin="round"',
        )
        self._hatch(foot - side * size, foot + side * size, down)
        self.joint(point)

    def _hatch(self, start: Point, end: Point, down: Point) -> None:
        """Draw a ground line with short strokes on its far side; `down` is the unit of length towards that side."""
        across = end - start
        strokes = 5
        pieces = [self._path((start, end))]
        slant = (down - _unit(across) * abs(down)) * 6.5
        for i in range(strokes):
            foot = start + across * ((i + 0.9) / strokes)
            pieces.append(self._path((foot, foot + slant)))
        self._add(
            "path",
            f'd="{" ".join(pieces)}" fill="none" {self._stroke("link", 1.6)} stroke-linecap="round"',
        )

    def hatch_over(self, point: Point, radius: float) -> None:
        """Draw ground above a vertex of radius `radius` pixels: the sign of the frame in a graph."""
        up = 1j * self.pixel
        middle = point + up * (radius + 3)
        self._hatch(middle + radius * 1.3 * self.pixel, middle - radius * 1.3 * self.pixel, up)

    def circle(
        self, centre: Point, radius: float, colour: str = "soft", dash: str = "8 3 2 3", width: float = 1.3
    ) -> None:
        """Draw a circle of the mechanism's size, dash-dotted by default as a pitch circle."""
        x, y = self._xy(centre)
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        self._add(
            "circle",
            f'cx="{number(x)}" cy="{number(y)}" r="{number(radius * self._scale)}" fill="none" '
            f"{self._stroke(colour, width)}{dashes}",
        )

    def trace(
        self, points: Sequence[Point], colour: str = "a", width: float = 1.8, closed: bool = False, dash: str = ""
    ) -> None:
        """Draw the path of a point; a point that is not finite breaks the line."""
        runs: list[list[Point]] = [[]]
        for point in points:
            if cmath.isfinite(point):
                runs[-1].append(point)
            elif runs[-1]:
                runs.append([])
        whole = closed and len(runs) == 1
        data = " ".join(self._path(run, whole) for run in runs if len(run) > 1)
        if data:
            dashes = f' stroke-dasharray="{dash}"' if dash else ""
            self._add(
                "path",
                f'd="{data}" fill="none" {self._stroke(colour, width)} stroke-linejoin="round"{dashes}',
            )

    def dot(self, point: Point, colour: str = "a", radius: float = 3.5) -> None:
        """Draw a filled dot of fixed size."""
        x, y = self._xy(point)
        self._add(
            "circle", f'cx="{number(x)}" cy="{number(y)}" r="{number(radius * self.symbol)}" fill="var(--{colour})"'
        )

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
        x, y = self._xy(point)
        self._add(
            "text",
            f'x="{number(x + offset.real)}" y="{number(y - offset.imag)}" text-anchor="{anchor}" '
            f'dominant-baseline="central" font-size="{number(size)}" fill="var(--{colour})" stroke="var(--paper)" '
            'stroke-width="3" paint-order="stroke" stroke-linejoin="round"',
            escape(text),
        )

    def curve(
        self, p: Point, q: Point, bend: float = 0.0, colour: str = "ink", width: float = 1.8, dash: str = ""
    ) -> None:
        """Draw an edge p-q as a quadratic curve bent aside by `bend` units (to the right of p-q if positive)."""
        middle = (p + q) / 2 - 1j * _unit(q - p) * bend * 2
        (x1, y1), (x2, y2), (x3, y3) = map(self._xy, (p, middle, q))
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        self._add(
            "path",
            f'd="M{number(x1)} {number(y1)} Q{number(x2)} {number(y2)} {number(x3)} {number(y3)}" fill="none" '
            f"{self._stroke(colour, width)}{dashes}",
        )

    def node(self, point: Point, text: str, radius: float = 10.0, filled: bool = False) -> None:
        """Draw a vertex of a graph: a circle with its number."""
        x, y = self._xy(point)
        fill, ink = ("var(--ink)", "var(--paper)") if filled else ("var(--paper)", "var(--ink)")
        self._add(
            "circle",
            f'cx="{number(x)}" cy="{number(y)}" r="{number(radius)}" fill="{fill}" stroke="var(--ink)" '
            'stroke-width="1.6"',
        )
        self._add(
            "text",
            f'x="{number(x)}" y="{number(y)}" text-anchor="middle" dominant-baseline="central" '
            f'font-size="{number(radius * 1.1)}" fill="{ink}"',
            escape(text),
        )

    def svg(self) -> str:
        """Return the picture as one ``<svg>`` element that needs nothing else."""
        name = f"<title>{escape(self.title)}</title>" if self.title else ""
        box = f"0 0 {number(self.width)} {number(self._height)}"
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" class="gs" viewBox="{box}" width="{number(self.width)}" '
            f'height="{number(self._height)}" role="img">{name}<style>{STYLE}</style>{"".join(self._shapes)}</svg>'
        )


def _unit(vector: Point) -> Point:
    size = abs(vector)
    return vector / size if size > 0 else 1 + 0j


def degrees(angle: float) -> str:
    """Write an angle in radians as whole degrees within one turn.

    Examples
    --------
    >>> degrees(-math.pi / 2)
    '270°'
    """
    return f"{round(math.degrees(angle)) % 360}°"
