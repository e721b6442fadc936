"""Shapes written as SVG elements."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from html import escape

from graphsynth.drawing.shapes import Circle, Path, Point, Shape, Style, Text

__all__ = ["element", "number", "picture"]

ToPage = Callable[[Point], tuple[float, float]]


def number(value: float) -> str:
    """Write a coordinate with at most two decimals and no trailing zeros.

    Examples
    --------
    >>> number(1.0), number(-0.001), number(2.346)
    ('1', '0', '2.35')
    """
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def element(shape: Shape, xy: ToPage, scale: float, symbol: float = 1.0, upright: str = "") -> str:
    """Write one shape.

    Parameters
    ----------
    shape : Shape
    xy : callable
        Carries a point of the shape to the page.
    scale : float
        Pixels per unit of length, for radii.
    symbol : float
        Scale of line widths.
    upright : str
        Attributes of a group around the letters that undoes the turn of their link.
    """
    part = f' data-part="{escape(shape.part)}"' if shape.part else ""
    if isinstance(shape, Text):
        return _text(shape, xy, part, upright)
    if isinstance(shape, Circle):
        x, y = xy(shape.centre)
        where = f'<circle cx="{number(x)}" cy="{number(y)}" r="{number(shape.radius * scale)}"'
    else:
        where = f'<path d="{_data(shape, xy)}"'
    return f"{where}{_paint(shape.style, symbol)}{part}/>"


def _data(path: Path, xy: ToPage) -> str:
    """Path data of all runs."""
    pieces = []
    for run in path.runs:
        points = [f"{number(x)} {number(y)}" for x, y in map(xy, run)]
        if path.curved:
            pieces.append(f"M{points[0]} Q{points[1]} {points[2]}")
        else:
            pieces.append(f"M{' L'.join(points)}{'Z' if path.closed else ''}")
    return " ".join(pieces)


def _paint(style: Style, symbol: float) -> str:
    """Fill and stroke attributes."""
    paint = f' fill="var(--{style.fill})"' if style.fill else ' fill="none"'
    if style.fill and style.fill_opacity < 1.0:
        paint += f' fill-opacity="{number(style.fill_opacity)}"'
    if style.stroke and style.width:
        paint += f' stroke="var(--{style.stroke})" stroke-width="{number(style.width * symbol)}"'
        paint += ' stroke-linecap="round"' if style.round_ends else ""
        paint += ' stroke-linejoin="round"' if style.round_joins else ""
        paint += f' stroke-dasharray="{" ".join(map(number, style.dash))}"' if style.dash else ""
    return paint


def _text(shape: Text, xy: ToPage, part: str, upright: str) -> str:
    x, y = xy(shape.at)
    dx, dy = shape.offset.real, -shape.offset.imag
    around = ("", "")
    if upright:
        around = (f'<g transform="translate({number(x)} {number(y)})"><g {upright}>', "</g></g>")
        x = y = 0.0
    halo = (
        f' stroke="var(--paper)" stroke-width="{number(shape.halo)}" paint-order="stroke" stroke-linejoin="round"'
        if shape.halo
        else ""
    )
    weight = f' font-weight="{shape.weight}"' if shape.weight else ""
    return (
        f'{around[0]}<text x="{number(x + dx)}" y="{number(y + dy)}" text-anchor="{shape.anchor}" '
        f'dominant-baseline="central" font-size="{number(shape.size)}"{weight} '
        f'fill="var(--{shape.colour})"{halo}{part}>'
        f"{escape(shape.text)}</text>{around[1]}"
    )


def picture(body: Iterable[str], width: float, height: float, style: str, title: str = "", attributes: str = "") -> str:
    """Wrap elements in one ``<svg>`` that needs nothing else."""
    name = f"<title>{escape(title)}</title>" if title else ""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="gs" viewBox="0 0 {number(width)} {number(height)}" '
        f'width="{number(width)}" height="{number(height)}" role="img"{attributes}>{name}<style>{style}</style>'
        f"{''.join(body)}</svg>"
    )
