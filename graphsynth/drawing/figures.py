"""Figures of matplotlib for the pictures of this room: empty ones, and written as SVG; no global state is touched."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Points up to which the emptiest corner is found at once.
_FEW = 20_000


def new_figure(size: tuple[float, float]) -> Figure:
    """Return an empty figure of a size in inches."""
    from matplotlib.figure import Figure

    figure: Figure = Figure(figsize=size, layout="constrained")
    return figure


def legend_place(points: int) -> str:
    """Return where a legend goes: the emptiest corner, or a fixed one where so many points would take long to avoid.

    >>> legend_place(100), legend_place(100_000)
    ('best', 'upper right')
    """
    return "best" if points <= _FEW else "upper right"


def themed_svg(figure: Figure, settings: Mapping[str, Any] | None = None) -> str:
    """Return a figure as one ``<svg class="gs">`` that is light or dark with the page it is put in.

    Colours are plain attributes; black is the ink of the palette, matplotlib's grey of grids its soft one.  Ids are
    unique to the picture.

    `settings`: of matplotlib, for the time of writing.

    >>> svg = themed_svg(new_figure((2.0, 1.0)))
    >>> svg.startswith("<svg class="), "<?xml" in svg
    (True, False)
    """
    import io
    from hashlib import sha256

    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    from graphsynth.drawing.palette import LIGHT, STYLE
    from graphsynth.drawing.svg import FONT, sound

    stream = io.StringIO()
    # text stays text: readable by screen readers and in the page's font; the same bytes for the same figure
    own = {**(settings or {}), "svg.fonttype": "none", "svg.hashsalt": "graphsynth"}
    with matplotlib.rc_context(own), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph")  # the reader's typeface may have the letter
        FigureCanvasSVG(figure)
        figure.savefig(stream, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    svg = sound(stream.getvalue())
    mark = sha256(svg.encode()).hexdigest()[:8]
    body = svg[svg.index("<svg") :].strip()
    # matplotlib's rules for `*` would count for the whole page
    body = re.sub(r"<metadata>.*?</metadata>|<defs>\s*<style.*?</style>\s*</defs>", "", body, flags=re.DOTALL)
    body = re.sub(r' style="([^"]*)"', lambda found: _attributes(found[1]), body)
    body = body.replace("#000000", LIGHT["ink"]).replace("#b0b0b0", LIGHT["soft"])
    used = set(re.findall(r'(?:href="#|url\(#)([^")]+)', body))
    body = re.sub(r' id="([^"]+)"', lambda found: found[0] if found[1] in used else "", body)
    body = re.sub(r'( id="| xlink:href="#|url\(#)', rf"\g<1>{mark}-", body)
    head, inside = body.removesuffix("</svg>").split(">", 1)
    return (
        f'{head.replace("<svg ", f"""<svg class="gs" font-family="{FONT}" """, 1)}><style>{STYLE}</style>'
        f'<g fill="{LIGHT["ink"]}" stroke-linejoin="round">{inside}</g></svg>'
    )


_FONT_PARTS = re.compile(r"(?:(italic|oblique) )?(?:(bold|[1-9]00) )?([0-9.]+)px")


def _attributes(style: str) -> str:
    """Write declarations of CSS as attributes, without the typeface: that of the picture is used.

    >>> _attributes("fill: none; stroke: #1b2733; font: bold 10px 'DejaVu Sans', sans-serif")
    ' fill="none" stroke="#1b2733" font-weight="bold" font-size="10px"'
    """
    found: dict[str, str] = {}
    for declaration in filter(str.strip, style.split(";")):
        name, _, value = (part.strip() for part in declaration.partition(":"))
        if name == "font" and (parts := _FONT_PARTS.match(value)):
            named = zip(("font-style", "font-weight", "font-size"), (parts[1], parts[2], f"{parts[3]}px"))
            found |= {own: text for own, text in named if text}
        elif name != "font-family":
            found[name] = value
    return "".join(f' {name}="{value}"' for name, value in found.items())
