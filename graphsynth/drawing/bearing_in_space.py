"""The tilted bearing in its hole, in space: the source's picture of the cylinders without and with jamming.

Radial distances from the wall of the untilted bearing are drawn larger by a factor that is written on the picture;
heights and angles around the axis are to scale.  Numbers in the titles are estimates (closed forms in doubles).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.figures import new_figure
from graphsynth.drawing.palette import LIGHT

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from graphsynth.jamming.bearing.bearing import Bearing

Array = NDArray[np.float64]

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

    `tilts`: radians. `titles`: one for each panel. `exaggeration`: factor on radial distances from the wall of the
    untilted bearing; 1 draws to scale.  Written on the picture. Raises `GeometryError` for an exaggeration that is not
    positive, no tilts, a tilt of a right angle or more, an interference fit.

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
    axes.plot_surface(
        hole * np.cos(behind) + 0.0 * flat,
        hole * np.sin(behind) + 0.0 * flat,
        flat + 0.0 * behind,
        color="#d9dee3",
        linewidth=0,
        shade=False,
        antialiased=False,
        rcount=2,
        ccount=_AROUND,
        zorder=1,
    )
    for level in (-top, top):
        axes.plot(hole * np.cos(behind), hole * np.sin(behind), level, color=LIGHT["ink"], lw=1.3, zorder=2)
    phi, z = np.meshgrid(np.linspace(0.0, math.tau, _AROUND), np.linspace(-h, h, _ALONG))
    X, Y, Z, out = wall(bearing, tilt, factor, phi, z)
    out = 0.25 * (out[:-1, :-1] + out[1:, :-1] + out[:-1, 1:] + out[1:, 1:])
    axes.plot_surface(
        X,
        Y,
        Z,
        facecolors=_shades(out, phi),
        linewidth=0,
        shade=False,
        antialiased=False,
        rcount=_ALONG,
        ccount=_AROUND,
        zorder=3,
    )
    lid = [np.stack([np.full(_AROUND, rim.mean()), rim]) for rim in (X[-1], Y[-1], Z[-1])]
    axes.plot_surface(
        *lid, color="#cfe3f2", linewidth=0, shade=False, antialiased=False, rcount=2, ccount=_AROUND, zorder=4
    )
    axes.plot(X[-1], Y[-1], Z[-1], color=LIGHT["ink"], lw=1.0, zorder=4)
    front = np.linspace(view - 0.5 * math.pi, view + 0.5 * math.pi, _AROUND)
    for level in (-top, top):  # the part cut away, as a thin line
        axes.plot(
            hole * np.cos(front), hole * np.sin(front), level, color=LIGHT["ink"], lw=0.8, ls=(0, (4, 3)), zorder=5
        )
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
