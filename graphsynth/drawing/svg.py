"""Shapes written as SVG elements."""

from __future__ import annotations

import html
import re
from collections.abc import Callable, Iterable

from graphsynth.drawing.palette import LIGHT, STYLE_ALONE
from graphsynth.drawing.shapes import Circle, Point, Shape, Style, Text

ToPage = Callable[[Point], tuple[float, float]]

#: Typefaces of the root element, the first that is there.
FONT = "system-ui,-apple-system,'Segoe UI',Roboto,sans-serif"
#: Half the height of a capital or a digit in units of the size: few programs know another baseline than the letters'.
_HALF_CAPITAL = 0.36
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def escape(text: str) -> str:
    """Write text for XML."""
    return html.escape(sound(text))


def sound(text: str) -> str:
    """Return text in which characters that no XML file may hold are the replacement character."""
    return _NOT_XML.sub("\ufffd", text)


def number(value: float, digits: int = 2) -> str:
    """Write a coordinate with at most two decimals, or as many as told, and no trailing zeros.

    >>> number(1.0), number(-0.001), number(2.346)
    ('1', '0', '2.35')
    """
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def element(shape: Shape, xy: ToPage, scale: float, symbol: float = 1.0, upright: str = "") -> str:
    """Write one shape.

    `xy`: carries a point of the shape to the page. `scale`: pixels per unit of length, for radii. `symbol`: scale of
    line widths. `upright`: attributes of a group around the letters that undoes the turn of their link.
    """
    part = f' data-part="{escape(shape.part)}"' if shape.part else ""
    if isinstance(shape, Text):
        return _text(shape, xy, part, upright)
    if isinstance(shape, Circle):
        x, y = xy(shape.centre)
        where = f'<circle cx="{number(x)}" cy="{number(y)}" r="{number(shape.radius * scale)}"'
    else:
        pieces = []
        for run in shape.runs:
            points = [f"{number(x)} {number(y)}" for x, y in map(xy, run)]
            if shape.curved:
                pieces.append(f"M{points[0]} Q{points[1]} {points[2]}")
            else:
                pieces.append(f"M{' L'.join(points)}{'Z' if shape.closed else ''}")
        where = f'<path d="{" ".join(pieces)}"'
    return f"{where}{_paint(shape.style, symbol)}{part}/>"


def _paint(style: Style, symbol: float) -> str:
    paint = painted(style.fill, style.stroke if style.width else "", style.width * symbol, opacity=style.fill_opacity)
    if style.stroke and style.width:
        paint += ' stroke-linecap="round"' if style.round_ends else ""
        paint += ' stroke-linejoin="round"' if style.round_joins else ""
        paint += f' stroke-dasharray="{" ".join(map(number, style.dash))}"' if style.dash else ""
    return f" {paint}"


def painted(fill: str = "", stroke: str = "", width: float = 1.0, *, opacity: float = 1.0) -> str:
    """Write fill and stroke as plain attributes; colours are names of the palette, none if empty.

    >>> painted("a"), painted(stroke="b", width=2.5)
    ('fill="#0072b2"', 'fill="none" stroke="#d55e00" stroke-width="2.5"')
    """
    paint = f'fill="{LIGHT[fill]}"' if fill else 'fill="none"'
    if fill and opacity < 1.0:
        paint += f' fill-opacity="{number(opacity)}"'
    return paint + (f' stroke="{LIGHT[stroke]}" stroke-width="{number(width)}"' if stroke else "")


def words(
    text: str,
    x: float,
    y: float,
    *,
    size: float = 14.0,
    colour: str = "note",
    anchor: str = "start",
    halo: float = 0.0,
    more: str = "",
) -> str:
    """Write a line of text that stands at height ``y``.

    A halo is the same text with a thick edge underneath: not every program paints an edge before the letters.
    """
    at = f'<text x="{number(x)}" y="{number(y)}"'
    look = f' {painted(colour)} font-size="{number(size)}" text-anchor="{anchor}"{more}'
    if not halo:
        return f"{at}{look}>{escape(text)}</text>"
    edge = f'stroke="{LIGHT["paper"]}" stroke-width="{number(halo)}" stroke-linejoin="round" aria-hidden="true"'
    return f"<g{look}>{at} {edge}>{escape(text)}</text>{at}>{escape(text)}</text></g>"


def _text(shape: Text, xy: ToPage, part: str, upright: str) -> str:
    x, y = xy(shape.at)
    around = ("", "")
    if upright:
        around = (f'<g transform="translate({number(x)} {number(y)})"><g {upright}>', "</g></g>")
        x = y = 0.0
    written = words(
        shape.text,
        x + shape.offset.real,
        y - shape.offset.imag + _HALF_CAPITAL * shape.size,
        size=shape.size,
        colour=shape.colour,
        anchor=shape.anchor,
        halo=shape.halo,
        more=(f' font-weight="{shape.weight}"' if shape.weight else "") + part,
    )
    return f"{around[0]}{written}{around[1]}"


def picture(body: Iterable[str], width: float, height: float, title: str = "", *, style: str = STYLE_ALONE) -> str:
    """Wrap elements in one ``<svg>`` that needs nothing else; without ``style`` the page has the rules."""
    name = f"<title>{escape(title)}</title>" if title else ""
    rules = f"<style>{style}</style>" if style else ""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="gs" viewBox="0 0 {number(width)} {number(height)}" '
        f'width="{number(width)}" height="{number(height)}" role="img" font-family="{FONT}">{name}{rules}'
        f"{''.join(body)}</svg>"
    )


def bare(svg: str) -> str:
    """Return a picture without its rules, for a page or a picture that has them."""
    return svg.replace(f"<style>{STYLE_ALONE}</style>", "", 1)
