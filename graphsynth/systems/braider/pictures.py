"""Pictures of the braider: its start-up, its four sensors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from graphsynth.drawing.drive_pictures import COLOURS, STYLES, panel
from graphsynth.drawing.palette import LIGHT
from graphsynth.drawing.plots import legend_place, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from graphsynth.dynamics.driven.run import DriveRun
    from graphsynth.systems.braider.model import Braider
    from graphsynth.systems.braider.reactions import Reactions

_JOINTS = ("O1: frame on crank", "A: crank on coupler", "B: coupler on rocker", "O2: frame on rocker")


def start_up_picture(
    braider: Braider,
    run: DriveRun,
    *,
    target: float = 1.803,
    band: float = 0.02,
    size: tuple[float, float] = (7.2, 6.4),
) -> Figure:
    """Start-up of the braider: crank speed with its band, the currents, angular velocities of the three links.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(size)
    speed, current, links = figure.subplots(3, 1, sharex=True)
    speed.axhspan(target * (1 - band), target * (1 + band), color=LIGHT["pale"])
    speed.plot(run.time, run.speed, color=COLOURS[0], lw=1.5)
    outside = np.nonzero(~(np.abs(run.speed / target - 1.0) <= band))[0]
    if outside.size and outside[-1] + 1 < run.time.size:
        at = run.time[outside[-1] + 1]
        speed.axvline(at, color="0.4", lw=0.8)
        speed.annotate(f"within ±{100 * band:g} % from {at:.3g} s", (at, 0.5 * target), xytext=(5, 0), fontsize=8,
                       textcoords="offset points")  # fmt: skip
    panel(speed, f"crank speed; band around {target:g} rad/s", "", "[rad/s]")
    for k in range(run.currents.shape[1]):
        name = ("i_d", "i_q")[k] if run.currents.shape[1] == 2 else "I"
        current.plot(run.time, run.currents[:, k], color=COLOURS[k], ls=STYLES[k], lw=1.4, label=name)
    panel(current, "motor currents", "", "[A]")
    if run.currents.shape[1]:
        current.legend(fontsize=8, frameon=False, loc=legend_place(run.currents.size))
    motion = braider.link_motion(run).speed
    for k, name in enumerate(("crank", "coupler", "rocker and switch")):
        links.plot(run.time, motion[:, k], color=COLOURS[k], ls=STYLES[k], lw=1.4, label=name)
    panel(links, "angular velocities", "time [s]", "[rad/s]")
    links.legend(fontsize=8, frameon=False, ncols=3, loc=legend_place(motion.size))
    return figure


def sensor_picture(
    braider: Braider, found: Reactions, *, time: Sequence[float] | None = None, size: tuple[float, float] = (9.6, 6.4)
) -> Figure:
    """Draw the four sensors of Figure 13: relative angular velocity and reaction at each joint, hodographs.

    Parameters
    ----------
    braider : Braider
    found : Reactions
        Over a turn, or along a run with its ``time`` (s).
    time : sequence of float, optional
        Abscissa; the crank angle in degrees if omitted.
    size : tuple of float, optional
        Inches.

    Returns
    -------
    matplotlib.figure.Figure
    """
    s = braider.linkage.motion(found.theta)
    w1, w2, w3 = found.speed, s.k2 * found.speed, s.k3 * found.speed
    x = np.degrees(found.theta) if time is None else np.asarray(time, dtype=np.float64)
    name = "crank angle [deg]" if time is None else "time [s]"
    figure = new_figure(size)
    grid = figure.subplots(2, 2)
    rates, forces, paths, torque = grid.ravel()
    relative = (w1, w2 - w1, w3 - w2, w3)
    for k, joint in enumerate(_JOINTS):
        style = {"color": COLOURS[k], "ls": STYLES[k], "lw": 1.4, "label": joint}
        rates.plot(x, relative[k], **style)
        forces.plot(x, found.magnitudes()[:, k], **style)
        fx, fy = found.forces()[:, k].T
        paths.plot(fx, fy, **style)
    torque.plot(x, found.torque, color="black", lw=1.4)
    panel(rates, "relative angular velocity at the joints", name, "[rad/s]")
    panel(forces, "size of the reactions", name, "[N]")
    panel(paths, "hodographs of the reactions", "F_x [N]", "F_y [N]")
    panel(torque, "torque on the crank", name, "[N m]")
    paths.set_aspect("equal", adjustable="datalim")
    torque.ticklabel_format(axis="y", style="sci", scilimits=(-3, 3))
    paths.locator_params(axis="x", nbins=5)
    handles, labels = rates.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    return figure
