"""Line plots as inline SVG, drawn by matplotlib and recoloured so that they follow the light or dark page.

matplotlib is imported when a plot is drawn, through the figure interface (no pyplot, no display, no global state).
"""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["Band", "Line", "line_plot"]

# Colours that stand for CSS variables: matplotlib writes them into the SVG, `_themed` replaces them there.
_COLOURS = {"ink": "#010203", "soft": "#010204", "a": "#010205", "b": "#010206", "c": "#010207", "jam": "#010208"}
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
    """One curve: `x` and `y` of equal length; NaN breaks it. `colour` is one of ink, soft, a, b, c, jam."""

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
    """Draw curves over one axis.

    Parameters
    ----------
    lines : sequence of Line
    xlabel, ylabel : str
        With units.
    bands : sequence of Band
        Shaded ranges of x.
    xticks : sequence of float, optional
    levels : sequence of Line
        Horizontal thresholds; only the first value of `y` is used, `x` is ignored.
    equal : bool
        The same scale on both axes, for paths.
    size : tuple of float
        Inches; the picture scales with the page.

    Returns
    -------
    str
        One ``<svg class="gs">`` element with unique ids.
    """
    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    with matplotlib.rc_context(_RC):
        figure = Figure(figsize=size, layout="constrained")
        FigureCanvasSVG(figure)
        axes = figure.add_subplot()
        for band in bands:
            axes.axvspan(band.start, band.stop, color=_COLOURS[band.colour], alpha=0.16, lw=0, label=band.label or None)
        for line in lines:
            axes.plot(line.x, line.y, line.style, color=_COLOURS[line.colour], lw=1.7, label=line.label or None)
        for level in levels:
            height = float(np.ravel(np.asarray(level.y))[0])
            axes.axhline(height, ls=level.style, lw=1.2, color=_COLOURS[level.colour], label=level.label or None)
        _dress(axes, xlabel, ylabel, xticks, equal)
        stream = io.StringIO()
        figure.savefig(stream, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    return _themed(stream.getvalue())


def _dress(axes: Any, xlabel: str, ylabel: str, xticks: Sequence[float] | None, equal: bool) -> None:
    """Label the axes, put a light grid behind and a legend above the curves."""
    ink, soft = _COLOURS["ink"], _COLOURS["soft"]
    axes.set_xlabel(xlabel, color=ink)
    axes.set_ylabel(ylabel, color=ink)
    axes.tick_params(colors=ink, which="both")
    for spine in axes.spines.values():
        spine.set_color(soft)
    axes.grid(True, color=soft, alpha=0.3, lw=0.6)
    if equal:
        axes.set_aspect("equal", adjustable="datalim")
    else:
        axes.margins(x=0)
    if xticks is not None:
        axes.set_xticks(list(xticks))
    handles, labels = axes.get_legend_handles_labels()
    if labels:
        legend = axes.legend(
            handles,
            labels,
            loc="lower left",
            bbox_to_anchor=(0, 1.0),
            ncols=len(labels),
            frameon=False,
            borderaxespad=0.2,
        )
        for text in legend.get_texts():
            text.set_color(ink)


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
