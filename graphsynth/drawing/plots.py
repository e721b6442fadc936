"""Line plots as inline SVG, drawn by matplotlib in colours that follow the light or dark page; empty figures.

matplotlib is imported when a plot is drawn, through the figure interface (no pyplot, no display, no global state).
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from graphsynth.drawing.palette import LIGHT, STYLE_ALONE
from graphsynth.drawing.svg import FONT, sound

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_RC = {
    "font.family": "sans-serif",
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.9,
}


@dataclass(frozen=True, slots=True)
class Line:
    """One curve: `x` and `y` of equal length; NaN breaks it. `colour` is one of ink, soft, note, a, b, c, d, jam."""

    x: ArrayLike
    y: ArrayLike
    label: str = ""
    colour: str = "a"
    style: str = "-"


@dataclass(frozen=True, slots=True)
class Band:
    """A shaded range of x, for example a jam arc."""

    start: float
    stop: float
    label: str = ""
    colour: str = "jam"


@dataclass(frozen=True, slots=True)
class Mark:
    """An event: an upright line at one x."""

    x: float
    label: str = ""
    colour: str = "soft"
    style: str = ":"


@dataclass(frozen=True)
class Chart:
    """Curves over one axis, as data: written as themed SVG, drawn on axes of a user's figure, or saved.

    `xlabel`, `ylabel`: with units. `bands`: shaded ranges of x. `marks`: events. `levels`: horizontal thresholds; only
    the first value of `y` is used, `x` is ignored. `equal`: the same scale on both axes, for paths. `in_pi`: mark the x
    axis in quarters of a turn. `decades`: a logarithmic x axis. `size`: inches; an SVG scales with the page.
    """

    lines: Sequence[Line]
    xlabel: str
    ylabel: str
    bands: Sequence[Band] = ()
    marks: Sequence[Mark] = ()
    levels: Sequence[Line] = ()
    xticks: Sequence[float] | None = None
    equal: bool = False
    in_pi: bool = False
    decades: bool = False
    size: tuple[float, float] = (5.4, 2.8)

    def draw(self, ax: Any = None) -> Any:
        """Draw on matplotlib axes (of a new figure by default), in the colours of a light page; return the axes."""
        axes = new_figure(self.size).add_subplot() if ax is None else ax
        for band in self.bands:
            axes.axvspan(band.start, band.stop, color=LIGHT[band.colour], alpha=0.16, lw=0, label=band.label or None)
        for line in self.lines:
            axes.plot(line.x, line.y, line.style, color=LIGHT[line.colour], lw=1.7, label=line.label or None)
        for level in self.levels:
            height = float(np.ravel(np.asarray(level.y))[0])
            axes.axhline(height, ls=level.style, lw=1.2, color=LIGHT[level.colour], label=level.label or None)
        seen: set[str] = set()
        for mark in self.marks:
            label = None if mark.label in seen else mark.label or None
            seen.add(mark.label)
            axes.axvline(mark.x, ls=mark.style, lw=1.4, color=LIGHT[mark.colour], label=label)
        # labels of the axes, a light grid behind, a legend above the curves
        ink, soft = LIGHT["ink"], LIGHT["soft"]
        axes.set_xlabel(self.xlabel, color=ink, parse_math=False)  # names may hold any letters
        axes.set_ylabel(self.ylabel, color=ink, parse_math=False)
        axes.tick_params(colors=ink, which="both")
        for side, spine in axes.spines.items():
            spine.set_color(soft)
            spine.set_visible(side in ("left", "bottom"))
        axes.grid(True, color=soft, alpha=0.3, lw=0.6)
        if self.equal:
            axes.set_aspect("equal", adjustable="datalim")
        else:
            axes.margins(x=0)
        if self.decades:
            axes.set_xscale("log")
        if self.in_pi:
            low, high = axes.get_xlim()
            quarter = math.pi / 2 * max(1, math.ceil((high - low) / (4.5 * math.pi)))
            steps = range(math.ceil(low / quarter - 1e-9), math.floor(high / quarter + 1e-9) + 1)
            axes.set_xticks([k * quarter for k in steps], [_in_pi(round(k * quarter / (math.pi / 2))) for k in steps])
        elif self.xticks is not None:
            axes.set_xticks(list(self.xticks))
        handles, labels = axes.get_legend_handles_labels()
        if labels:
            legend = axes.legend(
                handles,
                labels,
                loc="lower left",
                bbox_to_anchor=(0, 1.0),
                ncols=min(len(labels), 4),
                frameon=False,
                borderaxespad=0.2,
                columnspacing=1.2,
                handlelength=1.6,
            )
            for text in legend.get_texts():
                text.set(color=ink, parse_math=False)
        return axes

    def svg(self) -> str:
        """Return one ``<svg class="gs">`` element with unique ids, whose colours follow the page it is put in."""
        import matplotlib

        with matplotlib.rc_context(_RC):
            figure = new_figure(self.size)
            self.draw(figure.add_subplot())
        return themed_svg(figure, _RC)

    def _repr_svg_(self) -> str:
        return self.svg()

    def __repr__(self) -> str:
        return f"Chart of {len(self.lines)} curves: {self.ylabel} over {self.xlabel}; .save(path) writes it"

    def save(self, path: str | Path) -> None:
        """Write to a file, as its suffix says: ``.svg`` themed, ``.png``, ``.pdf`` and what else matplotlib writes."""
        if Path(path).suffix.lower() == ".svg":
            Path(path).write_text(self.svg(), "utf-8")
        else:
            self.draw().figure.savefig(path, dpi=200)


def line_plot(
    lines: Sequence[Line],
    xlabel: str,
    ylabel: str,
    *,
    bands: Sequence[Band] = (),
    xticks: Sequence[float] | None = None,
    levels: Sequence[Line] = (),
    equal: bool = False,
    size: tuple[float, float] = (5.4, 2.8),
) -> str:
    """Draw curves over one axis as SVG; see :class:`Chart`."""
    return Chart(lines, xlabel, ylabel, bands, (), levels, xticks, equal, size=size).svg()


def _in_pi(halves: int) -> str:
    """Write ``halves`` times pi/2.

    >>> [_in_pi(k) for k in (-1, 0, 1, 2, 3, 4)]
    ['-π/2', '0', 'π/2', 'π', '3π/2', '2π']
    """
    if halves % 2:
        return f"{halves}π/2" if abs(halves) > 1 else f"{halves}π/2".replace("1", "")
    return {0: "0", 2: "π", -2: "-π"}.get(halves, f"{halves // 2}π")


#: Points up to which the emptiest corner is found at once.
_FEW = 20_000


def new_figure(size: tuple[float, float]) -> Figure:
    """Return an empty figure of a size in inches; a notebook shows it as it is drawn, pyplot or not."""
    from matplotlib.figure import Figure

    figure: Figure = Figure(figsize=size, layout="constrained")
    figure._repr_svg_ = partial(themed_svg, figure)  # type: ignore[attr-defined]
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
        f'{head.replace("<svg ", f"""<svg class="gs" font-family="{FONT}" """, 1)}><style>{STYLE_ALONE}</style>'
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
