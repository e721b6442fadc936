"""Error against run time, log-log: one picture for each problem, failures drawn as failures."""

from __future__ import annotations

import math
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.core.errors import SpecError
from graphsynth.drawing.palette import LIGHT
from graphsynth.evidence.rows import FLOOR, Problem, Row, RowStatus

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Okabe and Ito's colours, told apart by colour-blind readers, and markers.
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#aa4499", "#56b4e9", "#b8860b", "#1b2733", "#7f7f7f", "#e66fb0")
_MARKERS = "osD^vPXp*"
_SOFT = LIGHT["soft"]


def work_precision_picture(problem: Problem) -> Figure:
    """Draw every row of a problem: time to the right, error upwards; a cross at the upper edge is a failure.

    Filled markers are proved results.  A circle around a marker is the library's default.  Unreliable results are
    crosses at their error.  Errors of rounding size are drawn on one line.  Dashed: a growth law, extrapolated.

    Parameters
    ----------
    problem : Problem
        With ``count``, time is drawn against that column instead.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    SpecError
        A problem without rows.

    Examples
    --------
    >>> row = Row("sweep", "0.1 rad", 0.1, 0.002, 3, "proved width", "")
    >>> len(work_precision_picture(Problem("arcs", "where it jams", "rad", (row,))).axes)
    1
    """
    if not problem.rows:
        raise SpecError(f"problem {problem.name!r} has no rows, so there is nothing to draw")
    from graphsynth.drawing.plots import new_figure

    figure = new_figure((7.2, 5.8))
    axes = figure.subplots()
    # failures are drawn a decade above the largest error
    top = 10.0 * max((max(row.error, FLOOR) for row in problem.rows if math.isfinite(row.error)), default=1.0)
    names: list[Any] = []
    for k, method in enumerate(problem.methods):
        style = {"color": _COLOURS[k % len(_COLOURS)], "marker": _MARKERS[k % len(_MARKERS)]}
        _method(axes, problem, problem.of(method), top, style, names)
        if problem.count:
            _law(axes, problem.of(method), problem.count, style["color"])
    if any(row.status is not RowStatus.OK for row in problem.rows):
        axes.plot([], [], "x", color=_SOFT, ms=8, mew=2, label="failed (upper edge) or unreliable")
    if any(row.default for row in problem.rows):
        axes.plot([], [], "o", ms=11, mfc="none", mec=_SOFT, label="default of the library")
    _dress(axes, problem, top)
    _part(figure, axes, names)
    return figure


def _decades(axes: Any, name: str, least: float) -> None:
    """Widen an axis to some decades, so that noise looks like noise; numbers at decades only."""
    from matplotlib.ticker import NullFormatter

    left, right = getattr(axes, f"get_{name}lim")()
    low, high = math.log10(min(left, right)), math.log10(max(left, right))
    room = max(0.0, least - (high - low)) / 2.0
    ends = 10.0 ** (low - room), 10.0 ** (high + room)
    getattr(axes, f"set_{name}lim")(ends if left < right else ends[::-1])
    getattr(axes, f"{name}axis").set_minor_formatter(NullFormatter())


def _law(axes: Any, rows: tuple[Row, ...], count: str, colour: str) -> None:
    """Draw the growth law of a method, dashed, a hundred times further than it was measured."""
    from graphsynth.evidence.enumeration import growth

    good = [row for row in rows if row.good]
    law = growth([row.more[count] for row in good], [row.seconds for row in good])
    if law is None:
        return
    largest = max(row.more[count] for row in good)
    ends = [min(row.more[count] for row in good if row.more[count] >= 100.0), 100.0 * largest]
    axes.plot(ends, [law.seconds(n) for n in ends], "--", color=colour, lw=0.9, alpha=0.7)
    text, at = f"time ~ {count}^{law.exponent:.2f}", (ends[1], law.seconds(ends[1]))
    axes.annotate(text, at, (-4, 4), textcoords="offset points", ha="right", fontsize=7, color=colour)


def _place(problem: Problem, row: Row, top: float) -> tuple[float, float]:
    if problem.count:
        return row.more.get(problem.count, math.nan), row.seconds
    height = max(row.error, FLOOR) if math.isfinite(row.error) else top
    return (row.more.get(problem.over, math.nan) if problem.over else row.seconds), height


def _method(
    axes: Any, problem: Problem, rows: tuple[Row, ...], top: float, style: dict[str, Any], names: list[Any]
) -> None:
    good = [row for row in rows if row.good]
    places = [_place(problem, row, top) for row in good]
    colour = style["color"]
    style = {**style, "ms": 6, "lw": 1.3}
    if places:
        filled = all(row.proved for row in good)
        label = rows[0].method + (" (proved)" if filled else "")
        axes.plot(*zip(*places), **style, mfc=colour if filled else "white", mew=1.4, label=label)
        default = [place for place, row in zip(places, good) if row.default]
        axes.plot(*(zip(*default) if default else ((), ())), "o", ms=12, mfc="none", mec=colour, mew=1.0)
    else:
        axes.plot([], [], **style, mfc="white", label=rows[0].method)
    times = [row.seconds for row in problem.rows if math.isfinite(row.seconds)]
    for row in rows:
        if row.status is not RowStatus.OK:
            x, y = _place(problem, row, top)
            axes.plot(x if math.isfinite(x) else max(times, default=1.0), y, "x", color=colour, ms=9, mew=2.2, zorder=4)
    # the settings at the first and the last point of a line, where no other text stands
    for k in sorted({0, len(good) - 1}) if good else ():
        if good[k].setting:
            spot = {"textcoords": "offset points", "fontsize": 7, "color": colour}
            names.append(axes.annotate(good[k].setting, places[k], (6, 6), **spot))


#: Where the name of a setting may stand beside its marker, in points: offset and alignment, the best first.
_SPOTS = tuple(
    ((x, y), "left" if x > 0 else "right")
    for x, y in ((6, 6), (6, -11), (-6, 6), (-6, -11), (6, 15), (6, -20), (-6, 15), (-6, -20), (6, 24), (6, -29))
)


def _part(figure: Any, axes: Any, names: list[Any]) -> None:
    """Move names of settings that overlap each other, a marker, a line or the edge to a free spot, or drop them."""
    figure.draw_without_rendering()
    inside = axes.get_window_extent()
    taken: list[Any] = []  # points of lines, and how far a marker reaches from them
    for line in axes.lines:
        own = line.get_transform().transform(line.get_xydata())
        reach = 0.5 * (line.get_markersize() + line.get_markeredgewidth()) * figure.dpi / 72.0
        taken += [(*at, reach) for k in range(len(own)) for at in np.linspace(own[max(k - 1, 0)], own[k], 32)]
    x, y, reaches = np.transpose(taken)
    kept: list[Any] = []
    for text in names:
        for offset, side in _SPOTS:
            text.set(ha=side, position=offset)
            box = text.get_window_extent()
            within = inside.x0 <= box.x0 and box.x1 <= figure.bbox.x1 and inside.y0 <= box.y0 and box.y1 <= inside.y1
            gaps = np.hypot(x - np.clip(x, box.x0, box.x1), y - np.clip(y, box.y0, box.y1))
            if within and not any(box.overlaps(other) for other in kept) and (gaps > reaches).all():
                kept.append(box.padded(1.0))
                break
        else:
            text.set_visible(False)


def _dress(axes: Any, problem: Problem, top: float) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    if problem.count:
        axes.set(xlabel=problem.count, ylabel=f"time of one {problem.per} [s]")
    else:
        unit = " (relative)" if problem.unit == "relative" else f" [{problem.unit}]"
        axes.set(xlabel=problem.over or f"time of one {problem.per} [s]", ylabel=f"error{unit}")
        if any(not math.isfinite(row.error) for row in problem.rows):
            axes.axhline(top, color=_SOFT, lw=0.8, ls=":")
    if problem.over:
        axes.invert_xaxis()  # harder to the right
    if not any(row.good for row in problem.rows):
        axes.set_ylim(0.1 * top, 10.0 * top)
    axes.set_title(fill(problem.question, 92), fontsize=9, loc="left")
    axes.margins(0.12, 0.1)
    _decades(axes, "x", 2.3)
    _decades(axes, "y", 3.0)
    axes.grid(which="major", color=LIGHT["pale"], lw=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2)
