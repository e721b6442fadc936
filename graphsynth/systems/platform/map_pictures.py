"""Pictures of the parallel platform: workspace with singular loci, dexterity, harmonics over the crank length.

Every function returns a matplotlib figure that belongs to no window; write it with ``figure.savefig(path)``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.palette import LIGHT, WHITE
from graphsynth.drawing.plots import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from graphsynth.systems.platform.maps import PlatformMap
    from graphsynth.systems.platform.parallel_platform import ParallelPlatform
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
    from graphsynth.systems.platform.singular_loci import SingularLoci
    from graphsynth.systems.platform.workspace import Arc, Workspace

#: One colour for each leg, readable in grey and by colour-blind readers [Okabe & Ito 2008].
_LEGS = ("#0072B2", "#D55E00", "#009E73")
_SINGULAR = LIGHT["bad"]
_TINTS = ("#F6DCC8", "#D3E4F2")  # det JX < 0, > 0
_STYLES = {"outer": "-", "inner": (0, (5, 2)), "lower limit": (0, (1, 1)), "upper limit": (0, (3, 1, 1, 1))}
#: name of a map -> title, colour map, unit
_MAPS = {
    "dexterity": ("dexterity 1/κ of the scaled velocity matrix", "viridis", ""),
    "smallest": ("smallest singular value of the scaled JX", "viridis", "length"),
    "velocity_min": ("slowest platform speed per rocker speed", "viridis", ""),
    "velocity_max": ("fastest platform speed per rocker speed", "magma_r", ""),
    "force_min": ("smallest wrench held per rocker torque", "viridis", ""),
    "force_max": ("largest wrench held per rocker torque", "magma_r", ""),
    "link_force": ("largest link forces per wrench", "magma_r", ""),
    "reach": ("smallest sine of the angle rocker-link", "viridis", ""),
}


def _axis(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _signs(sigma: Sequence[int]) -> str:
    return "(" + " ".join("+" if s > 0 else "−" for s in sigma) + ")"


def _along(arc: Arc) -> Any:
    """Points of an arc, with the workspace on the left."""
    t = np.linspace(arc.start, arc.stop, max(8, math.ceil(60 * (arc.stop - arc.start))))
    return arc.point(t if arc.circle.sense > 0 else t[::-1])


def _fill(axes: Any, work: Workspace) -> None:
    """Fill the workspace (holes wind the other way)."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    loops = [np.concatenate([_along(work.arcs[i]) for i in loop]) for loop in work.loops]
    if loops:
        paths = [Path(np.column_stack([p.real, p.imag])[[*range(len(p)), 0]], closed=True) for p in loops]
        outline = Path.make_compound_path(*paths)
        axes.add_patch(PathPatch(outline, facecolor=LIGHT["pale"], edgecolor="none", zorder=0))


def _arcs(axes: Any, work: Workspace, width: float) -> None:
    """Draw the boundary, coloured by leg, the style by side; each label once."""
    seen: set[tuple[int, str]] = set()
    for arc in work.arcs:
        key = (arc.circle.leg, arc.circle.side)
        p = _along(arc)
        label = None if key in seen else f"leg {key[0]}, {key[1]}"
        seen.add(key)
        axes.plot(p.real, p.imag, ls=_STYLES[key[1]], color=_LEGS[key[0] - 1], lw=width, label=label)


def _frame(axes: Any, work: Workspace, unit: str | None = None) -> None:
    """Equal scales, limits a little outside the workspace; names of the axes if there is a unit."""
    x0, x1, y0, y1 = work.box()
    if math.isfinite(x0):
        margin = 0.05 * max(x1 - x0, y1 - y0)
        axes.set_xlim(x0 - margin, x1 + margin)
        axes.set_ylim(y0 - margin, y1 + margin)
    axes.set_aspect("equal")
    axes.tick_params(labelsize=8)
    if unit is not None:
        axes.set_xlabel(_axis("x", unit))
        axes.set_ylabel(_axis("y", unit))


def workspace_picture(work: Workspace, *, unit: str = "mm", size: tuple[float, float] = (6.4, 4.8)) -> Figure:
    """Draw a constant-orientation workspace: area, arcs by leg and side, area and perimeter in the title.

    `unit`: name of the length unit. `size`: inches.

    >>> from graphsynth.systems.platform.parallel_platform import ParallelPlatform
    >>> from graphsynth.systems.platform.workspace import constant_orientation_workspace
    >>> figure = workspace_picture(constant_orientation_workspace(ParallelPlatform.mock(), 0.5))
    >>> figure.axes[0].get_xlabel()
    'x [mm]'
    """
    figure = new_figure(size)
    axes = figure.add_subplot()
    _fill(axes, work)
    _arcs(axes, work, 2.0)
    for p in work.isolated:
        axes.plot([p.real], [p.imag], "o", color="black", ms=5)
    _frame(axes, work, unit)
    plain, square = (f" {unit}", f" {unit}²") if unit else ("", "")
    mode = "" if work.sigma is None else f", working mode {_signs(work.sigma)}"
    size_text = f"area {work.area:.6g}{square}, perimeter {work.perimeter:.6g}{plain}"
    axes.set_title(f"α = {math.degrees(work.alpha):.4g}°{mode}\n{size_text}", fontsize=10)
    if work.empty:
        axes.text(0.5, 0.5, "no position is reached", ha="center", va="center", transform=axes.transAxes)
    elif work.arcs:
        axes.legend(loc="center left", bbox_to_anchor=(1.02, 0.5), fontsize=8, frameon=False)
    return figure


def loci_picture(
    platform: ParallelPlatform, loci: SingularLoci, *, unit: str = "mm", size: tuple[float, float] = (11.0, 6.4)
) -> Figure:
    """Draw the workspace with its type-I arcs and the type-II curves of all eight working modes.

    Regions with ``det JX > 0`` and ``det JX < 0`` are tinted differently.

    `loci`: from `graphsynth.systems.platform.singular_loci.singular_loci`.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    from graphsynth.systems.platform.field import working_mode
    from graphsynth.systems.platform.parallel_platform import WORKING_MODES
    from graphsynth.systems.platform.workspace import constant_orientation_workspace

    work = constant_orientation_workspace(platform, loci.alpha)
    figure = new_figure(size)
    grid = figure.subplots(2, 4, sharex=True, sharey=True)
    for axes, mode in zip(grid.ravel(), WORKING_MODES):
        _panel(axes, platform, loci, work, working_mode([int(s) for s in mode]))
    for axes in grid[-1]:
        axes.set_xlabel(_axis("x", unit), fontsize=9)
    for axes in grid[:, 0]:
        axes.set_ylabel(_axis("y", unit), fontsize=9)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    handles += [Line2D([], [], color=_SINGULAR, lw=1.4), Patch(color=_TINTS[1]), Patch(color=_TINTS[0])]
    labels += ["type II, det JX = 0", "det JX > 0", "det JX < 0"]
    columns = len(labels) if len(labels) <= 6 else (len(labels) + 1) // 2
    look = {"loc": "outside lower center", "fontsize": 8, "frameon": False}
    figure.legend(handles, labels, ncols=columns, **look)
    figure.suptitle(f"Singular loci at α = {math.degrees(loci.alpha):.4g}°; arcs: type I", fontsize=11)
    return figure


def _panel(
    axes: Any, platform: ParallelPlatform, loci: SingularLoci, work: Workspace, sigma: tuple[int, int, int]
) -> None:
    """Draw one working mode: sign of ``det JX``, boundary, curves."""
    from matplotlib.colors import ListedColormap

    from graphsynth.systems.platform.maps import platform_map

    if not work.empty:
        field = platform_map(platform, loci.alpha, sigma, nodes=240)
        sign = np.sign(field.quality.determinant).T
        shown = np.where(sign == 0, np.nan, sign)
        tints = ListedColormap(list(_TINTS))
        axes.pcolormesh(field.x, field.y, shown, cmap=tints, vmin=-1, vmax=1, zorder=0, rasterized=True)
    _arcs(axes, work, 1.3)
    for curve in loci.of_mode(sigma):
        axes.plot(curve.points.real, curve.points.imag, color=_SINGULAR, lw=1.4, zorder=4)
    for own, p in loci.points:
        if own == sigma:
            axes.plot([p.real], [p.imag], ".", color=_SINGULAR, zorder=4)
    _frame(axes, work)
    axes.set_title(f"working mode {_signs(sigma)}", fontsize=9)


def map_picture(
    found: PlatformMap, quantity: str = "dexterity", *, unit: str = "mm", size: tuple[float, float] = (6.2, 4.8)
) -> Figure:
    """Draw one quantity of a map over the workspace.

    `quantity`: a field of `graphsynth.systems.platform.maps.Quality`. Raises `GeometryError`: an unknown quantity.
    """
    from graphsynth.systems.platform.workspace import constant_orientation_workspace

    if quantity not in _MAPS:
        raise GeometryError(f"quantity = {quantity!r} is unknown; use one of {', '.join(_MAPS)}")
    title, colours, measured = _MAPS[quantity]
    values = getattr(found.quality, quantity)
    values = np.where(np.isfinite(values), values, np.nan)
    figure = new_figure(size)
    axes = figure.add_subplot()
    work = constant_orientation_workspace(found.platform, found.alpha)
    if not work.empty:
        shown = values[~np.isnan(values)]
        top = float(np.percentile(shown, 97)) if colours == "magma_r" and shown.size else None
        bottom = 0.0 if top is None else float(shown.min())
        image = axes.pcolormesh(found.x, found.y, values.T, cmap=colours, vmin=bottom, vmax=top, rasterized=True)
        label = _axis(title, unit if measured == "length" else "–")
        figure.colorbar(image, ax=axes, extend="neither" if top is None else "max").set_label(label)
        determinant = found.quality.determinant.T
        if bool((determinant > 0.0).any()) and bool((determinant < 0.0).any()):
            axes.contour(found.x, found.y, determinant, levels=[0.0], colors=WHITE, linewidths=1.2)
    for arc in work.arcs:
        p = _along(arc)
        axes.plot(p.real, p.imag, color="#333333", lw=1.2)
    _frame(axes, work, unit)
    length = f"Lc = {found.quality.Lc:.4g} {unit}".rstrip()
    text = f"α = {math.degrees(found.alpha):.4g}°, working mode {_signs(found.sigma)}, {length}"
    axes.set_title(text, fontsize=10)
    return figure


def harmonics_picture(
    mechanism: SingleMotorPlatform,
    scales: Sequence[float] = (0.03125, 0.0625, 0.125, 0.25, 0.5, 1.0),
    *,
    size: tuple[float, float] = (6.4, 4.4),
) -> Figure:
    """Draw distortion, drift and error of the small-crank theory over the crank length, on logarithmic axes.

    Dashed lines have the predicted slopes 1 and 2.

    `scales`: factors of its crank lengths.
    """
    from graphsynth.systems.platform.small_crank import crank_scaling

    found = crank_scaling(mechanism, scales)
    share = max(mechanism.crank) * np.array([row.scale for row in found])
    curves = (
        ("higher harmonics / first", [row.second for row in found], "o", _LEGS[0], 1),
        ("mean shift / first harmonic", [row.mean for row in found], "s", _LEGS[2], 1),
        ("error of predicted first harmonic", [row.first_error for row in found], "^", _LEGS[1], 2),
    )
    figure = new_figure(size)
    axes = figure.add_subplot()
    for label, values, marker, colour, order in curves:
        y = np.array(values)
        if not (y > 1e-15).all():
            continue
        axes.loglog(share, y, marker, color=colour, ms=6, label=label)
        axes.loglog(share, y[0] * (share / share[0]) ** order, "--", color=colour, lw=1.0)
    axes.grid(True, which="both", alpha=0.25)
    axes.set_xlabel("longest crank [mm]")
    axes.set_ylabel("relative size [–]")
    axes.plot([], [], "--", color="grey", lw=1.0, label="slopes 1 and 2")
    axes.legend(fontsize=8, frameon=False)
    axes.set_title("Displacements tend to a sinusoid as the cranks tend to zero", fontsize=10)
    return figure
