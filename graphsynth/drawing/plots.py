"""Line plots as inline SVG, drawn by matplotlib and recoloured so that they follow the light or dark page.

matplotlib is imported when a plot is drawn, through the figure interface (no pyplot, no display, no global state).
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["Band", "Chart", "Line", "Mark", "line_plot"]

# Colours that stand for CSS variables: matplotlib writes them into the SVG, `_themed` replaces them there.
_COLOURS = {
    "ink": "#010203", "soft": "#010204", "a": "#010205", "b": "#010206", "c": "#010207", "jam": "#010208",
    "d": "#010209", "note": "#01020a",
}  # fmt: skip
_RC = {
    "svg.fonttype": "none",  # text stays text: readable by screen readers and in the page's font
    "svg.hashsalt": "graphsynth",  # the same bytes for the same plot
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

    Parameters
    ----------
    lines : sequence of Line
    xlabel, ylabel : str
        With units.
    bands : sequence of Band
        Shaded ranges of x.
    marks : sequence of Mark
        Events.
    levels : sequence of Line
        Horizontal thresholds; only the first value of `y` is used, `x` is ignored.
    xticks : sequence of float, optional
    equal : bool
        The same scale on both axes, for paths.
    in_pi : bool
        Mark the x axis in quarters of a turn: 0, pi/2, pi, ...
    size : tuple of float
        Inches; an SVG scales with the page.
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
    size: tuple[float, float] = (5.4, 2.8)

    def draw(self, ax: Any = None) -> Any:
        """Draw on matplotlib axes (of a new figure by default), in the colours of a light page; return the axes."""
        from graphsynth.drawing.palette import LIGHT

        if ax is None:
            from matplotlib.figure import Figure

            ax = Figure(figsize=self.size, layout="constrained").add_subplot()
        self._draw(ax, LIGHT)
        return ax

    def svg(self) -> str:
        """Return one ``<svg class="gs">`` element with unique ids, whose colours follow the page it is put in."""
        import matplotlib
        from matplotlib.backends.backend_svg import FigureCanvasSVG
        from matplotlib.figure import Figure

        with matplotlib.rc_context(_RC):
            figure = Figure(figsize=self.size, layout="constrained")
            FigureCanvasSVG(figure)
            self._draw(figure.add_subplot(), _COLOURS)
            stream = io.StringIO()
            figure.savefig(stream, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
        return _themed(stream.getvalue())

    def save(self, path: str | Path) -> None:
        """Write to a file, as its suffix says: ``.svg`` themed, ``.png``, ``.pdf`` and what else matplotlib writes."""
        if Path(path).suffix.lower() == ".svg":
            Path(path).write_text(self.svg(), "utf-8")
        else:
            self.draw().figure.savefig(path, dpi=200)

    def _draw(self, axes: Any, colours: Mapping[str, str]) -> None:
        for band in self.bands:
            axes.axvspan(band.start, band.stop, color=colours[band.colour], alpha=0.16, lw=0, label=band.label or None)
        for line in self.lines:
            axes.plot(line.x, line.y, line.style, color=colours[line.colour], lw=1.7, label=line.label or None)
        for level in self.levels:
            height = float(np.ravel(np.asarray(level.y))[0])
            axes.axhline(height, ls=level.style, lw=1.2, color=colours[level.colour], label=level.label or None)
        seen: set[str] = set()
        for mark in self.marks:
            label = None if mark.label in seen else mark.label or None
            seen.add(mark.label)
            axes.axvline(mark.x, ls=mark.style, lw=1.4, color=colours[mark.colour], label=label)
        _dress(axes, self, colours)


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


def _dress(axes: Any, chart: Chart, colours: Mapping[str, str]) -> None:
    """Label the axes, put a light grid behind and a legend above the curves."""
    ink, soft = colours["ink"], colours["soft"]
    axes.set_xlabel(chart.xlabel, color=ink)
    axes.set_ylabel(chart.ylabel, color=ink)
    axes.tick_params(colors=ink, which="both")
    for side, spine in axes.spines.items():
        spine.set_color(soft)
        spine.set_visible(side in ("left", "bottom"))
    axes.grid(True, color=soft, alpha=0.3, lw=0.6)
    if chart.equal:
        axes.set_aspect("equal", adjustable="datalim")
    else:
        axes.margins(x=0)
    if chart.in_pi:
        _quarter_turns(axes)
    elif chart.xticks is not None:
        axes.set_xticks(list(chart.xticks))
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
            text.set_color(ink)


def _quarter_turns(axes: Any) -> None:
    low, high = axes.get_xlim()
    quarter = math.pi / 2 * max(1, math.ceil((high - low) / (4.5 * math.pi)))
    steps = range(math.ceil(low / quarter - 1e-9), math.floor(high / quarter + 1e-9) + 1)
    axes.set_xticks([k * quarter for k in steps], [_in_pi(round(k * quarter / (math.pi / 2))) for k in steps])


def _in_pi(halves: int) -> str:
    """Write ``halves`` times pi/2.

    >>> [_in_pi(k) for k in (-1, 0, 1, 2, 3, 4)]
    ['-π/2', '0', 'π/2', 'π', '3π/2', '2π']
    """
    if halves % 2:
        return f"{halves}π/2".replace("1π", "π") if abs(halves) == 1 else f"{halves}π/2"
    whole = halves // 2
    return "0" if whole == 0 else f"{whole}π" if abs(whole) != 1 else ("π" if whole > 0 else "-π")


_COUNTER = re.compile(r'id="([^"]+)"')


def _themed(svg: str) -> str:
    """Cut the XML prologue, make colours CSS variables, and make ids unique to this picture."""
    from hashlib import sha256

    from graphsynth.drawing.palette import STYLE

    mark = sha256(svg.encode()).hexdigest()[:8]
    body = svg[svg.index("<svg") :].strip()
    for name, colour in _COLOURS.items():
        body = body.replace(colour, f"var(--{name})")
    for identifier in set(_COUNTER.findall(body)):
        body = re.sub(rf'(id="|#){re.escape(identifier)}(?=["\)])', rf"\g<1>{mark}-{identifier}", body)
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    # Without this the generic family would win over the page's font.
    body = re.sub(r"font: ([0-9.]+)px [^;\"]*", r"font-size: \1px; font-family: inherit", body)
    return body.replace("<svg ", '<svg class="gs" ', 1).replace(">", f"><style>{STYLE}</style>", 1)
