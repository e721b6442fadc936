"""Pictures of the resistance claim: its map, ripples over the resistance, the simulated truth."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.core.errors import SpecError
from graphsynth.drawing.drive_pictures import COLOURS, STYLES, panel
from graphsynth.drawing.figures import new_figure
from graphsynth.drawing.palette import WHITE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from graphsynth.systems.platform.resistance import ResistanceEffect, RippleMap


def resistance_picture(effects: Mapping[str, ResistanceEffect], *, size: tuple[float, float] = (10.0, 4.4)) -> Figure:
    """Draw the resistance claim as a map, and ripples over the resistance: linear (lines) and simulated (dots).

    The map shows the linear speed gain over ``Om/w_n`` and ``zeta``; left of the bar at 1/sqrt(2) a larger resistance
    raises the speed ripple, right of it the ripple falls.

    `effects`: label and effect, for example one for each inductance. `size`: inches. Raises `SpecError` without any
    effect.
    """
    if not effects:
        raise SpecError("there is no effect to draw; give at least one result of resistance_effect")
    figure = new_figure(size)
    chart, ripples = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    _gain_map(figure, chart)
    for label, effect in effects.items():
        chart.plot(np.full(effect.damping.size, effect.frequency_ratio), effect.damping, "o-", ms=3, lw=0.8, color="k")
        chart.annotate(
            label,
            (effect.frequency_ratio, effect.damping.max()),
            xytext=(3, 3),
            fontsize=7,
            color=WHITE,
            textcoords="offset points",
        )
    _ripples(ripples, effects, "speed")
    return figure


def ripple_picture(
    effects: Mapping[str, ResistanceEffect], of: str = "speed", *, size: tuple[float, float] = (5.4, 3.4)
) -> Figure:
    """Ripples of the speed or the current over the resistance: linear (lines) and simulated (dots).

    Raises `SpecError` without any effect, or for another quantity.
    """
    if not effects or of not in ("speed", "current"):
        raise SpecError(f"there is nothing to draw of {of!r}; give effects, and 'speed' or 'current'")
    figure = new_figure(size)
    _ripples(figure.add_subplot(), effects, of)
    return figure


def _ripples(axes: Any, effects: Mapping[str, ResistanceEffect], of: str) -> None:
    for k, (label, effect) in enumerate(effects.items()):
        colour = COLOURS[k % 6]
        axes.loglog(effect.resistance, getattr(effect, of), color=colour, ls=STYLES[k % 6], lw=1.3, label=label)
        axes.loglog(effect.resistance, getattr(effect, f"simulated_{of}"), "o", ms=4, color=colour)
    unit = "rad/s" if of == "speed" else "A"
    title = f"{of} ripple: linear (lines), simulated (dots)"
    panel(axes, title, "armature resistance [ohm]", f"peak to peak [{unit}]")
    axes.legend(fontsize=8, frameon=False)


def ripple_map_picture(found: RippleMap, *, size: tuple[float, float] = (5.4, 4.0)) -> Figure:
    """Draw the simulated truth of the claim: slope of the speed ripple over the resistance; bar: the linear condition.

    Blue: the ripple falls with a larger resistance; red: it rises; grey: no result.
    """
    figure = new_figure(size)
    axes = figure.add_subplot()
    middle = np.sqrt(found.resistance[1:] * found.resistance[:-1])
    order = np.argsort(found.frequency_ratio)
    axes.set_facecolor("#999999")
    drawn = axes.pcolormesh(
        _edges(middle),
        _edges(found.frequency_ratio[order]),
        found.speed_slope[order],
        cmap="RdBu_r",
        vmin=-1.0,
        vmax=1.0,
        rasterized=True,
    )
    bar = figure.colorbar(drawn, ax=axes, extend="both")
    bar.set_label("d ln(speed ripple) / d ln r")
    axes.axhline(1.0 / math.sqrt(2.0), color="#111111", lw=2.0)
    axes.text(axes.get_xlim()[0] * 1.1, 0.73, "linear: falls above", fontsize=8, color="#111111")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("armature resistance [ohm]")
    axes.set_ylabel("Om / w_n")
    for axis, ticks in ((axes.xaxis, (0.5, 1, 2, 5, 10, 20)), (axes.yaxis, (0.1, 0.2, 0.3, 0.5, 0.7, 1, 1.5, 2))):
        low, high = sorted(axis.get_view_interval())
        shown = [tick for tick in ticks if low <= tick <= high]
        axis.set_ticks(shown, [f"{tick:g}" for tick in shown])
        axis.set_ticks([], minor=True)
    return figure


def _edges(centres: Any) -> Any:
    """Borders of cells around centres, evenly between them in the logarithm."""
    log = np.log(centres)
    if log.size == 1:
        return np.exp([log[0] - 0.3, log[0] + 0.3])
    inner = 0.5 * (log[1:] + log[:-1])
    return np.exp(np.concatenate([[2.0 * log[0] - inner[0]], inner, [2.0 * log[-1] - inner[-1]]]))


def _gain_map(figure: Figure, axes: Any) -> None:
    from graphsynth.systems.platform.resistance import ripple_gain

    nu, zeta = np.geomspace(0.1, 3.0, 181), np.geomspace(0.02, 8.0, 161)
    gain = np.log10(ripple_gain(nu[None, :], zeta[:, None])[0])
    drawn = axes.contourf(nu, zeta, gain, levels=np.linspace(-1.0, 1.6, 14), cmap="viridis", extend="both")
    bar = figure.colorbar(drawn, ax=axes)
    bar.set_label("log10 of the speed gain")
    axes.axvline(1.0 / math.sqrt(2.0), color=WHITE, lw=2.0)
    for x, text in ((0.26, "ripple rises with r"), (1.4, "ripple falls with r")):
        axes.text(x, 0.024, text, color=WHITE, fontsize=8, ha="center")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(nu[0], nu[-1])
    axes.set_ylim(zeta[0], zeta[-1])
    for axis, ticks in ((axes.xaxis, (0.1, 0.2, 0.5, 1, 2, 3)), (axes.yaxis, (0.02, 0.1, 0.5, 1, 5))):
        axis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
        axis.set_ticks([], minor=True)
    axes.set_title("speed gain; bar: Om = w_n / √2", fontsize=10)
    axes.set_xlabel("Om / w_n")
    axes.set_ylabel("damping ratio zeta")
