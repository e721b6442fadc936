"""Pictures of a jammed bearing: crossings and their boxes, the region between the curves, the section, the areas.

The pictures of the source [Mitrofanova & Bazhenov 2020], from certified results.  Every function returns a matplotlib
figure that belongs to no window; write it with ``figure.savefig(path)``.  `area_chart` is themed SVG too.

In space, radial distances from the wall of the untilted bearing are drawn larger by a factor that is written on the
picture; heights and angles around the axis are to scale.  Numbers in the titles are estimates (closed forms in
doubles).
"""

from __future__ import annotations

import math
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.crossing_pictures import dress
from graphsynth.drawing.palette import LIGHT
from graphsynth.drawing.plots import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from graphsynth.drawing.plots import Chart
    from graphsynth.jamming.assess import JammingReport
    from graphsynth.jamming.bearing.areas_enclosed import AreaCurve
    from graphsynth.jamming.bearing.bearing import Bearing

Array = NDArray[np.float64]

_SOURCE_NOTE = (
    "The dashed curve is the ordinate of the source: the free gap of the surrogate ellipse, recorded as 0 where "
    "nothing crosses.\nIt jumps to πRc at the onset and falls towards the worst pose; it measures no jamming. "
    "The shaded windows are details of the source's plot, not jam zones.\nValues of tens or hundreds of mm² that "
    "it shows are widths of interval sums over many boxes, not areas."
)


# -- the bearing in its hole -------------------------------------------------------------------------------------------


def section_picture(
    bearing: Bearing, tilts: tuple[float, ...], titles: tuple[str, ...] = (), exaggeration: float = 40.0
) -> Figure:
    """Draw the bearing in its hole, cut by the plane of the tilt, one panel for each tilt.

    `tilts`: radians, with `titles`. `exaggeration`: factor on radial distances from the wall of the untilted bearing,
    written on the picture. Raises `GeometryError` for an exaggeration that is not positive, or no tilts.

    >>> from graphsynth.jamming import Bearing
    >>> len(section_picture(Bearing(), (0.003, 0.0133)).axes)
    2
    """
    check_panels(tilts, exaggeration)
    figure = new_figure((5.0 * len(tilts), 4.6))
    panels = np.atleast_1d(figure.subplots(1, len(tilts), sharey=True))
    for axes, tilt, title in zip(panels, tilts, (*titles, *[""] * len(tilts))):
        _section(axes, bearing, tilt, exaggeration)
        dress(axes, panel_title(bearing, tilt, title), "distance from the bearing's wall [mm]", "z [mm]")
    figure.suptitle(
        f"radial distances from the wall × {exaggeration:g}, heights to scale, middle of the bearing left out",
        fontsize=9,
    )
    return figure


def _section(axes: Any, bearing: Bearing, tilt: float, factor: float) -> None:
    """Both walls of the bearing and of the hole; the middle is cut out."""
    R, h, c = bearing.Rb, bearing.h, bearing.clearance
    S, C = math.sin(tilt), math.cos(tilt)
    half = 0.6 * max(h, 1e-9 * R)  # half the strip that is left out, in drawing units
    bend = R * S * S / (1.0 + C)
    depth = factor * (abs(h * S) + bend + abs(c))
    top = 1.5 * h + 0.5
    for side in (1.0, -1.0):
        wall, outward = side * (half + depth), side * factor
        hole = wall + outward * c
        axes.fill_betweenx([-top, top], hole, hole + side * (depth + half), color=LIGHT["fill"], hatch="//", lw=0)
        axes.plot([hole, hole], [-top, top], color=LIGHT["ink"], lw=1.6, label="wall of the hole" if side > 0 else None)
        # the wall of the tilted bearing: ends (+-h) at R C +- h S along the tilt, and lifted by R S
        ends = [(wall + outward * (side * s * h * S - bend), s * h * C - side * R * S) for s in (-1.0, 1.0)]
        inner = [(side * half * 0.3, z) for _, z in reversed(ends)]
        axes.fill(*zip(*ends, *inner), color=LIGHT["a"], alpha=0.25, lw=0)
        axes.plot(*zip(*ends), color=LIGHT["a"], lw=1.8, label="bearing" if side > 0 else None)
        _overlap(axes, ends, hole, side)
    axes.axvline(0.0, color=LIGHT["soft"], lw=0.8, ls=(0, (8, 3, 2, 3)))
    axes.set_ylim(-top, top)
    ticks = [side * (half + depth + factor * d) for side in (1.0, -1.0) for d in (0.0, c)]
    axes.set_xticks(ticks, ["0", f"{c:g}"] * 2, fontsize=8, rotation=45)
    axes.legend(fontsize=8, loc="lower center", framealpha=0.95)


def _overlap(axes: Any, ends: list[tuple[float, float]], hole: float, side: float) -> None:
    """Mark the part of the bearing's wall beyond the wall of the hole."""
    (x0, z0), (x1, z1) = ends
    beyond = [(x, z) for x, z in ends if side * (x - hole) > 0.0]
    if len(beyond) != 1:
        return
    z = z0 + (hole - x0) * (z1 - z0) / (x1 - x0)
    corner = beyond[0]
    axes.fill([hole, corner[0], hole], [z, corner[1], corner[1]], color=LIGHT["jam"], alpha=0.9, lw=0, zorder=5)
    look: dict[str, Any] = {"ha": "left" if side > 0.0 else "right", "fontsize": 8, "color": LIGHT["jam"]}
    away = (-4 * side, 14 if corner[1] > 0 else -18)
    axes.annotate("overlap", corner, textcoords="offset points", xytext=away, **look)


# -- areas over a turn -------------------------------------------------------------------------------------------------


def area_picture(curve: AreaCurve, zooms: tuple[tuple[float, float], ...] | None = None) -> Figure:
    """Draw the areas over the crank angle with details, and say what the ordinate of the source is.

    `zooms`: windows in degrees; the two of the source by default.

    >>> from graphsynth.jamming.bearing.areas_enclosed import area_curve
    >>> len(area_picture(area_curve()).axes)
    3
    """
    from graphsynth.jamming.bearing.areas_enclosed import ZOOMS

    windows = ZOOMS if zooms is None else zooms
    figure = new_figure((10.5, 7.0))
    grid = figure.add_gridspec(2, max(1, len(windows)), height_ratios=(1.15, 1.0))
    f = np.degrees(curve.f)
    whole = figure.add_subplot(grid[0, :])
    _areas(whole, curve, f)
    whole.set_xticks(np.arange(90.0, 451.0, 45.0))
    dress(whole, "areas over the crank angle", "crank angle [°]", "area [mm²]")
    whole.legend(fontsize=8, ncols=4, loc="lower left", bbox_to_anchor=(0.0, 1.12), frameon=False, borderaxespad=0)
    for k, (start, stop) in enumerate(windows):
        axes = figure.add_subplot(grid[1, k])
        _areas(axes, curve, f)
        axes.set_xlim(start, stop)
        dress(axes, f"detail, {start:g} to {stop:g} degrees", "crank angle [°]", "area [mm²]")
        whole.axvspan(start, stop, color=LIGHT["soft"], alpha=0.15, lw=0)
    figure.supxlabel(_SOURCE_NOTE, fontsize=8.5, color=LIGHT["note"])
    return figure


def _areas(axes: Any, curve: AreaCurve, f: Array) -> None:
    for area, colour, label in (
        (curve.lid, LIGHT["jam"], "interference, one lid (B)"),
        (curve.rim, LIGHT["d"], "interference, rim (A)"),
        (curve.surrogate_jam, LIGHT["c"], "circle \\ ellipse E4"),
    ):
        axes.fill_between(f, area.lo, area.hi, color=colour, lw=0)
        axes.plot(f, area.mid, color=colour, lw=1.5, label=label)
    axes.plot(f, curve.source_ordinate, color=LIGHT["ink"], lw=1.2, ls=(0, (4, 2)), label="ordinate of the source")
    axes.margins(x=0)
    axes.set_ylim(bottom=0.0)
    axes.grid(True, color=LIGHT["soft"], alpha=0.3, lw=0.6)


def area_chart(curve: AreaCurve, window: tuple[float, float] | None = None) -> Chart:
    """Return the areas over the crank angle as a `Chart`, for themed SVG.

    Of the angles inside the `window` (degrees); one without an angle of the curve raises `GeometryError`.

    >>> from graphsynth.jamming.bearing.areas_enclosed import area_curve
    >>> area_chart(area_curve(), (90.0, 115.5)).svg()[:15]
    '<svg class="gs"'
    """
    from graphsynth.drawing.plots import Chart, Line

    f, (low, high) = np.degrees(curve.f), window or (-math.inf, math.inf)
    use = (f >= low) & (f <= high)
    if not use.any():
        raise GeometryError(f"the window {window} degrees holds no angle of the curve; choose another")
    lines = [
        Line(f[use], curve.lid.mid[use], "one lid (B)", "jam"),
        Line(f[use], curve.rim.mid[use], "rim (A)", "d"),
        Line(f[use], curve.source_ordinate[use], "ordinate of the source", "ink", "--"),
    ]
    return Chart(lines, "crank angle [°]", "area [mm²]")


# -- a report ----------------------------------------------------------------------------------------------------------


def report_picture(report: JammingReport) -> Figure:
    """Draw tilt and gap over the crank angle, with the parts of the turn that are proved free or jammed.

    The curves are the sampled table of the report (nominal dimensions), the bands come from its certificate and hold
    for all tolerances; without a certificate there are no bands.

    >>> from graphsynth.jamming import ToleranceBox, assess_jamming
    >>> len(report_picture(assess_jamming(ToleranceBox(alpha="1/30"))).axes)
    2
    """
    figure = new_figure((9.0, 5.6))
    tilts, gaps = figure.subplots(2, 1, sharex=True)
    f = np.degrees(report.table.f)
    tilts.plot(f, 1e3 * report.table.theta, color=LIGHT["a"], lw=1.5)
    if report.critical_tilt is not None:
        for sign in (1.0, -1.0):
            tilts.axhline(sign * 1e3 * report.critical_tilt, color=LIGHT["soft"], lw=1.0, ls=(0, (4, 2)))
        at, look = (f[0], 1e3 * report.critical_tilt), {"fontsize": 8, "color": LIGHT["note"]}
        tilts.annotate("critical tilt", at, xytext=(4, 3), textcoords="offset points", **look)
    gaps.plot(f, report.table.interference, color=LIGHT["ink"], lw=1.5)
    gaps.axhline(0.0, color=LIGHT["soft"], lw=1.0)
    if report.certificate is not None:
        _bands((tilts, gaps), report, (float(f.min()), float(f.max())))
    dress(tilts, fill(report.statement, 110), "", "tilt of the coupler [mrad]")
    dress(gaps, "", "crank angle [°]", f"interference (condition {report.condition}) [mm]")
    for axes in (tilts, gaps):
        axes.margins(x=0)
    handles, labels = gaps.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    return figure


def _bands(panels: tuple[Any, ...], report: JammingReport, shown: tuple[float, float]) -> None:
    """Shade the turn by what the certificate proves; pieces too short to be seen get a line."""
    assert report.certificate is not None
    arcs = report.certificate.arcs
    where = "" if report.certificate.assembles == "always" else ", where it can be assembled"
    for spans, colour, label in (
        (arcs.inner, LIGHT["jam"], f"jams for all tolerances (proved){where}"),
        (arcs.undecided, LIGHT["soft"], "depends on the tolerances, or not decided"),
        (arcs.free, LIGHT["c"], "free for all tolerances (proved)"),
    ):
        pieces = [(a + turn, b + turn) for a, b in (s.degrees() for s in spans) for turn in range(-720, 721, 360)]
        seen = [(max(a, shown[0]), min(b, shown[1])) for a, b in pieces if b > shown[0] and a < shown[1]]
        for axes in panels:
            for k, (a, b) in enumerate(seen):
                axes.axvspan(a, b, color=colour, alpha=0.22, lw=0 if b - a > 0.2 else 1.0, label="" if k else label)


_AROUND, _ALONG = 217, 45
_SIDE = -52.0  # degrees: the view, with the side towards which the upper lid leans in front
_ABOVE = 24.0


def check_panels(tilts: tuple[float, ...], exaggeration: float) -> None:
    """Refuse pictures of a tilted bearing without a tilt, or with an exaggeration that is not positive."""
    if not 0.0 < exaggeration < math.inf:
        raise GeometryError(f"exaggeration = {exaggeration} must be positive; 1 draws to scale")
    if not tilts:
        raise GeometryError("tilts is empty; give at least one tilt in radians")


def panel_title(bearing: Bearing, tilt: float, title: str) -> str:
    """Return the heading of a panel: its title, the tilt, and by how much the bearing jams or is free."""
    gap = float(bearing.interference(abs(math.sin(tilt)), math.cos(tilt), "A"))
    verdict = f"jams: {gap:.4f} mm too much" if gap > 0 else f"free: {-gap:.4f} mm left"
    return f"{title}\ntilt {tilt:.6f} rad, {verdict}".strip()


def space_picture(
    bearing: Bearing, tilts: tuple[float, ...], titles: tuple[str, ...] = (), exaggeration: float = 60.0
) -> Figure:
    """Draw the bearing in its cut-away hole, one panel for each tilt; what does not fit into the hole is coloured.

    Arguments and errors are those of `section_picture`; besides, a tilt of a right angle or more, and an interference
    fit, raise `GeometryError`.

    >>> from graphsynth.jamming import Bearing
    >>> len(space_picture(Bearing(), (0.003, 0.0133)).axes)
    2
    """
    check_panels(tilts, exaggeration)
    if bearing.clearance < 0.0:
        raise GeometryError(f"clearance = {bearing.clearance} mm is an interference fit, which has no hole to turn in")
    for tilt in tilts:
        if not abs(tilt) < 0.5 * math.pi:
            raise GeometryError(f"tilt = {tilt} rad must lie between -pi/2 and pi/2")
    figure = new_figure((5.6 * len(tilts), 5.0))
    for k, (tilt, title) in enumerate(zip(tilts, (*titles, *[""] * len(tilts)))):
        axes: Any = figure.add_subplot(1, len(tilts), k + 1, projection="3d", computed_zorder=False)
        _panel(axes, bearing, tilt, exaggeration)
        axes.set_title(panel_title(bearing, tilt, title), fontsize=10, color=LIGHT["ink"])
    figure.suptitle(
        f"radial distances from the wall of the untilted bearing × {exaggeration:g}, heights to scale; "
        "half of the hole is cut away; orange: beyond its wall",
        fontsize=9,
    )
    return figure


def wall(bearing: Bearing, tilt: float, factor: float, phi: Array, z: Array) -> tuple[Array, Array, Array, Array]:
    """Return where points of the bearing's wall are drawn (x, y, z), and how far they stand out of the hole (mm)."""
    S, C = math.sin(tilt), math.cos(tilt)
    x, y = bearing.Rb * np.cos(phi), bearing.Rb * np.sin(phi)
    across, up = x * C + z * S, z * C - x * S
    # hypot(across, y) - R without cancellation
    beyond = (across - x) * (across + x) / (np.hypot(across, y) + bearing.Rb)
    drawn, angle = bearing.Rb + factor * beyond, np.arctan2(y, across)
    return drawn * np.cos(angle), drawn * np.sin(angle), up, beyond - bearing.clearance


def _panel(axes: Any, bearing: Bearing, tilt: float, factor: float) -> None:
    h = max(bearing.h, 1e-6 * bearing.Rb)
    top, hole = 1.35 * h + 0.02 * bearing.Rb, bearing.Rb + factor * bearing.clearance
    view = math.radians(_SIDE)
    behind = np.linspace(view + 0.5 * math.pi, view + 1.5 * math.pi, _AROUND)
    flat = np.array([[-top], [top]])
    look: dict[str, Any] = {"linewidth": 0, "shade": False, "antialiased": False, "ccount": _AROUND}
    wall_of_hole = [hole * np.cos(behind) + 0.0 * flat, hole * np.sin(behind) + 0.0 * flat, flat + 0.0 * behind]
    axes.plot_surface(*wall_of_hole, color="#d9dee3", rcount=2, zorder=1, **look)
    for level in (-top, top):
        axes.plot(hole * np.cos(behind), hole * np.sin(behind), level, color=LIGHT["ink"], lw=1.3, zorder=2)
    phi, z = np.meshgrid(np.linspace(0.0, math.tau, _AROUND), np.linspace(-h, h, _ALONG))
    X, Y, Z, out = wall(bearing, tilt, factor, phi, z)
    out = 0.25 * (out[:-1, :-1] + out[1:, :-1] + out[:-1, 1:] + out[1:, 1:])
    axes.plot_surface(X, Y, Z, facecolors=_shades(out, phi), rcount=_ALONG, zorder=3, **look)
    lid = [np.stack([np.full(_AROUND, rim.mean()), rim]) for rim in (X[-1], Y[-1], Z[-1])]
    axes.plot_surface(*lid, color="#cfe3f2", rcount=2, zorder=4, **look)
    axes.plot(X[-1], Y[-1], Z[-1], color=LIGHT["ink"], lw=1.0, zorder=4)
    front = np.linspace(view - 0.5 * math.pi, view + 0.5 * math.pi, _AROUND)
    for level in (-top, top):  # the part cut away, as a thin line
        edge = (hole * np.cos(front), hole * np.sin(front), level)
        axes.plot(*edge, color=LIGHT["ink"], lw=0.8, ls=(0, (4, 3)), zorder=5)
    axes.plot([0, 0], [0, 0], [-1.5 * top, 1.5 * top], color=LIGHT["soft"], lw=0.9, ls=(0, (8, 3, 2, 3)), zorder=6)
    reach = float(max(hole, np.hypot(X, Y).max()))
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), zlim=(-1.5 * top, 1.5 * top))
    axes.set_box_aspect((2.0 * reach, 2.0 * reach, 3.0 * top), zoom=1.4)
    axes.view_init(elev=_ABOVE, azim=_SIDE)
    axes.set_axis_off()


def _shades(out: Array, phi: Array) -> Array:
    """Colours of the bearing's wall: blue, or that of a jam where it stands out of the hole; lit from the right."""
    from matplotlib.colors import to_rgb

    light = 0.72 + 0.28 * np.cos(phi[:-1, :-1] - math.radians(_SIDE + 35.0))
    base = np.where((out > 0.0)[..., None], to_rgb(LIGHT["jam"]), to_rgb(LIGHT["a"]))
    colours: Array = np.clip(base * light[..., None], 0.0, 1.0)
    return colours
