"""Maps of the antenna over both crank angles: difference of two models, folds, certified cost of tolerances.

Every function returns a matplotlib figure that belongs to no window; write it with ``figure.savefig(path)``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.figures import new_figure
from graphsynth.drawing.palette import LIGHT, WHITE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from graphsynth.systems.antenna.closed_form import Convention, ModelComparison
    from graphsynth.systems.antenna.mechanism import PointingMechanism

__all__ = ["difference_map_picture", "fold_map_picture", "tolerance_map_picture"]

Array = NDArray[np.float64]


def difference_map_picture(
    mechanism: PointingMechanism,
    other: PointingMechanism | None = None,
    *,
    reading: Convention | None = None,
    other_reading: Convention | None = None,
    span: float = math.radians(40.0),
    nodes: int = 81,
    size: tuple[float, float] = (10.0, 4.4),
) -> Figure:
    """Draw the difference of two models over both crank angles, minutes of arc: of the means, and of the beams.

    Parameters
    ----------
    mechanism, other, reading, other_reading
        As for `comparison_picture`.
    span : float
        Largest crank angle, radians.
    nodes : int
        Grid points along each axis.
    size : tuple of float, optional
        Inches.

    Returns
    -------
    matplotlib.figure.Figure
        Left: difference of the means of elevation and azimuth.  Right: angle between the normals of the reflectors.
    """
    from dataclasses import replace

    if nodes < 2:
        raise GeometryError(f"nodes = {nodes} must be at least 2")
    if other is None:
        other = replace(mechanism, order="XY" if mechanism.order == "YX" else "YX")
    grid = np.linspace(-_span(span), span, nodes)
    found = mechanism.compare(other, grid[:, None], grid[None, :], reading=reading, other_reading=other_reading)
    values = (found.arcminutes, _between_beams(found, (mechanism.order, other.order)))
    figure, degrees = new_figure(size), np.degrees(grid)
    for axes, drawn, name in zip(figure.subplots(1, 2, sharey=True), values, ("means", "beams")):
        largest = max(float(np.nanmax(np.abs(drawn), initial=0.0)), 1e-9)
        low, colours = (-largest, "RdBu_r") if name == "means" else (0.0, "magma_r")
        axes.set_facecolor(LIGHT["pale"])
        image = axes.pcolormesh(degrees, degrees, drawn.T, cmap=colours, vmin=low, vmax=largest, rasterized=True)
        figure.colorbar(image, ax=axes, label="arc-minutes")
        axes.set_title("difference of the means" if name == "means" else "angle between the two beams", fontsize=10)
        axes.set_xlabel("φx, crank of leg Y [deg]")
        axes.set_aspect("equal")
    figure.axes[0].set_ylabel("φy, crank of leg X [deg]")
    return figure


def _between_beams(found: ModelComparison, orders: tuple[str, str]) -> Array:
    """Angle between the normals of both reflectors, minutes of arc, from half their chord."""
    from graphsynth.systems.antenna.model import orientation

    first, second = (orientation(found.a[k], found.b[k], orders[k])[..., :, 2] for k in (0, 1))
    chord = np.linalg.norm(first - second, axis=-1)
    return np.asarray(60.0 * np.degrees(2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0))))


def _span(span: float) -> float:
    if not (math.isfinite(span) and 0.0 < span <= math.pi):
        raise GeometryError(f"span = {span} must be above 0 and at most pi; give the largest crank angle in radians")
    return span


def fold_map_picture(
    mechanism: PointingMechanism,
    *,
    span: float = math.pi,
    nodes: int = 241,
    s_y: int = 1,
    s_x: int = -1,
    size: tuple[float, float] = (7.4, 5.8),
) -> Figure:
    """Draw how far the mechanism is from a fold over both crank angles, with the folds and dead points themselves.

    Parameters
    ----------
    mechanism : PointingMechanism
    span : float
        Largest crank angle, radians.
    nodes : int
        Grid points along each axis; at least 16.
    s_y, s_x : {+1, -1}
        Assembly mode.
    size : tuple of float, optional
        Inches.

    Returns
    -------
    matplotlib.figure.Figure
        Colour: sine of the angle to the nearest fold; white: cannot be assembled.
    """
    if nodes < 16:
        raise GeometryError(f"nodes = {nodes} must be at least 16")
    grid = np.linspace(-_span(span), span, nodes)
    poses = mechanism.poses(grid[:, None], grid[None, :], s_y, s_x)
    margin = np.where(poses.assembled, np.minimum(poses.margin_y, poses.margin_x), np.nan)
    figure = new_figure(size)
    axes = figure.add_subplot()
    degrees = np.degrees(grid)
    image = axes.pcolormesh(degrees, degrees, margin.T, cmap="viridis", vmin=0.0, vmax=1.0, rasterized=True)
    figure.colorbar(image, ax=axes, label="sine of the angle to the nearest fold [–]")
    _singular_points(axes, mechanism, grid, s_y, s_x)
    axes.set_xlim(degrees[0], degrees[-1])
    axes.set_ylim(degrees[0], degrees[-1])
    axes.set_aspect("equal")
    axes.set_xlabel("φx, crank of leg Y [deg]")
    axes.set_ylabel("φy, crank of leg X [deg]")
    mode = f"mode ({'+' if s_y > 0 else '−'} {'+' if s_x > 0 else '−'})"
    share = 100.0 * float(poses.assembled.mean())
    axes.set_title(f"order {mechanism.order}, {mode}: {share:.1f} % of this square can be assembled", fontsize=10)
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.12), ncols=2, fontsize=8, frameon=False, markerscale=2.0)
    return figure


def _singular_points(axes: Any, mechanism: PointingMechanism, grid: Array, s_y: int, s_x: int) -> None:
    """Mark folds and dead points of both legs that lie on the drawn mode."""
    wanted = (s_y, s_x)
    for leg, colour in (("Y", "#d62728"), ("X", "#ff9e4a")):
        folded: list[tuple[float, float]] = []
        dead: list[tuple[float, float]] = []
        s_other = s_x if leg == "Y" else s_y
        for other in grid.tolist():
            try:
                folds = mechanism.folds(leg, other, s_other=s_other)
                points = mechanism.dead_points(leg, other, s_other=s_other)
            except GeometryError:  # the other leg does not reach there
                continue
            folded += [(f.phi_x, f.phi_y) for f in folds if math.isfinite(f.a) and math.isfinite(f.b)]
            dead += [(p.phi_x, p.phi_y) for p in points if (p.s_y, p.s_x) == wanted]
        for pairs, marker, size, kind in ((folded, "s", 2.2, "folds"), (dead, ".", 2.0, "dead points")):
            if pairs:
                shade = colour if kind == "folds" else (WHITE if leg == "Y" else "#ff66cc")
                x, y = np.degrees(np.array(pairs)).T
                edge = {"mec": "#555555", "mew": 0.3} if shade == WHITE else {}
                axes.plot(x, y, marker, ms=size + 1.5 * bool(edge), color=shade, label=f"{kind} of leg {leg}", **edge)


def tolerance_map_picture(
    mechanism: PointingMechanism,
    widths: float | tuple[float, ...] = 5e-5,
    *,
    span: float = math.radians(40.0),
    nodes: int = 17,
    size: tuple[float, float] = (10.0, 4.4),
) -> Figure:
    """Draw the largest certified deviation of each output over both crank angles, seconds of arc (mean-value form).

    Parameters
    ----------
    mechanism : PointingMechanism
    widths : float or tuple of five floats
        Tolerances of the lengths.
    span : float
        Largest crank angle, radians.
    nodes : int
        Grid points along each axis; every one is an interval proof of about ten milliseconds.
    size : tuple of float, optional
        Inches.

    Returns
    -------
    matplotlib.figure.Figure
        Cells that are undecided (a fold in the box of lengths, or no pose) are hatched.
    """
    if nodes < 2:
        raise GeometryError(f"nodes = {nodes} must be at least 2")
    grid = np.linspace(-_span(span), span, nodes)
    worst = np.full((2, nodes, nodes), np.nan)
    for i, x in enumerate(grid.tolist()):
        for j, y in enumerate(grid.tolist()):
            found = mechanism.tolerance(x, y, widths, method="mean_value")
            worst[:, i, j] = [max(map(abs, bounds.deviation)) for bounds in (found.a, found.b)]
    figure = new_figure(size)
    degrees = np.degrees(grid)
    for axes, values, name in zip(figure.subplots(1, 2, sharey=True), worst, ("elevation", "azimuth")):
        axes.set_facecolor(LIGHT["pale"])
        axes.patch.set_hatch("////")
        image = axes.pcolormesh(degrees, degrees, values.T, cmap="magma_r", shading="nearest", rasterized=True)
        figure.colorbar(image, ax=axes, label="largest certified deviation [arc-seconds]")
        axes.set_title(f"{name}, order {mechanism.order}", fontsize=10)
        axes.set_xlabel("φx, crank of leg Y [deg]")
        axes.set_aspect("equal")
    figure.axes[0].set_ylabel("φy, crank of leg X [deg]")
    given = (widths,) if isinstance(widths, int | float) else tuple(dict.fromkeys(widths))
    text = f"{given[0]:g}" if len(given) == 1 else ", ".join(f"{w:g}" for w in np.ravel(widths))
    figure.suptitle(f"lengths ±{text}; hatched: undecided", fontsize=11)
    return figure
