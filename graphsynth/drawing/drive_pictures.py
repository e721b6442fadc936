"""Pictures of drives: torque and speed over time, the resistance claim, the limit L -> 0, sensors of the braider.

Every function returns a matplotlib figure that belongs to no window; write it with ``figure.savefig(path)``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.core.errors import SpecError
from graphsynth.drawing.figures import legend_place, new_figure
from graphsynth.drawing.palette import LIGHT, WHITE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from graphsynth.dynamics.driven.reduction import ReductionStudy
    from graphsynth.dynamics.driven.run import DriveRun
    from graphsynth.systems.braider.model import Braider
    from graphsynth.systems.braider.reactions import Reactions
    from graphsynth.systems.platform.resistance import ResistanceEffect, RippleMap

__all__ = [
    "drive_curves", "reduction_picture", "resistance_picture", "ripple_map_picture", "ripple_picture", "sensor_picture",
    "start_up_picture",
]  # fmt: skip

#: Readable in grey and by colour-blind readers [Okabe & Ito 2008].
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
_STYLES = ("-", (0, (5, 2)), (0, (1, 1)), (0, (4, 1, 1, 1)), (0, (8, 2)), (0, (2, 2)))
_JOINTS = ("O1: frame on crank", "A: crank on coupler", "B: coupler on rocker", "O2: frame on rocker")


def _panel(axes: Any, title: str, x: str, y: str) -> None:
    axes.set_title(title, fontsize=10)
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(alpha=0.25)


def drive_curves(runs: Mapping[str, DriveRun], *, size: tuple[float, float] = (7.2, 5.6)) -> Figure:
    """Motor torque and crank speed over time, one curve for each labelled run (Figures 6 and 7 of the source).

    Parameters
    ----------
    runs : mapping of str to DriveRun
        Label and run, for example two armature resistances.
    size : tuple of float, optional
        Inches.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    SpecError
        Without any run.

    Examples
    --------
    >>> from graphsynth.dynamics.motors import DCMotor
    >>> from graphsynth.systems.platform.motor_model import MotorDrivenPlatform
    >>> motor = DCMotor(1.0, 0.2, 0.1, 0.1, gain=20.0, speed=20.0)
    >>> run = MotorDrivenPlatform.source(motor).simulate(np.linspace(0.0, 1.0, 101))
    >>> drive_curves({"1 ohm": run}).axes[1].get_ylabel()
    'crank speed [rad/s]'
    """
    if not runs:
        raise SpecError("there is no run to draw; give at least one, for example {'1 ohm': run}")
    figure = new_figure(size)
    torque, speed = figure.subplots(2, 1, sharex=True)
    for k, (label, run) in enumerate(runs.items()):
        style = {"color": _COLOURS[k % 6], "ls": _STYLES[k % 6], "lw": 1.4}
        torque.plot(run.time, run.motor_torque, label=label, **style)
        speed.plot(run.time, run.speed, label=label, **style)
        if not run.complete:
            for axes in (torque, speed):
                axes.axvline(run.time[max(run.reached - 1, 0)], color=_COLOURS[k % 6], lw=0.8)
    _panel(torque, "motor torque", "", "torque [N m]")
    _panel(speed, "crank speed", "time [s]", "crank speed [rad/s]")
    place = legend_place(sum(run.time.size for run in runs.values()))
    torque.legend(fontsize=8, frameon=False, ncols=min(len(runs), 4), loc=place)
    return figure


def resistance_picture(
    effects: Mapping[str, ResistanceEffect], *, size: tuple[float, float] = (10.0, 4.4)
) -> Figure:  # fmt: skip
    """Draw the resistance claim as a map, and ripples over the resistance: linear (lines) and simulated (dots).

    The map shows the linear speed gain over ``Om/w_n`` and ``zeta``; left of the bar at 1/sqrt(2) a larger resistance
    raises the speed ripple, right of it the ripple falls.

    Parameters
    ----------
    effects : mapping of str to ResistanceEffect
        Label and effect, for example one for each inductance.
    size : tuple of float, optional
        Inches.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    SpecError
        Without any effect.
    """
    if not effects:
        raise SpecError("there is no effect to draw; give at least one result of resistance_effect")
    figure = new_figure(size)
    chart, ripples = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    _gain_map(figure, chart)
    for label, effect in effects.items():
        chart.plot(np.full(effect.damping.size, effect.frequency_ratio), effect.damping, "o-", ms=3, lw=0.8, color="k")
        chart.annotate(label, (effect.frequency_ratio, effect.damping.max()), xytext=(3, 3), fontsize=7,
                       color=WHITE, textcoords="offset points")  # fmt: skip
    _ripples(ripples, effects, "speed")
    return figure


def ripple_picture(
    effects: Mapping[str, ResistanceEffect], of: str = "speed", *, size: tuple[float, float] = (5.4, 3.4)
) -> Figure:  # fmt: skip
    """Ripples of the speed or the current over the resistance: linear (lines) and simulated (dots).

    Raises
    ------
    SpecError
        Without any effect, or for another quantity.
    """
    if not effects or of not in ("speed", "current"):
        raise SpecError(f"there is nothing to draw of {of!r}; give effects, and 'speed' or 'current'")
    figure = new_figure(size)
    _ripples(figure.add_subplot(), effects, of)
    return figure


def _ripples(axes: Any, effects: Mapping[str, ResistanceEffect], of: str) -> None:
    for k, (label, effect) in enumerate(effects.items()):
        colour = _COLOURS[k % 6]
        axes.loglog(effect.resistance, getattr(effect, of), color=colour, ls=_STYLES[k % 6], lw=1.3, label=label)
        axes.loglog(effect.resistance, getattr(effect, f"simulated_{of}"), "o", ms=4, color=colour)
    unit = "rad/s" if of == "speed" else "A"
    title = f"{of} ripple: linear (lines), simulated (dots)"
    _panel(axes, title, "armature resistance [ohm]", f"peak to peak [{unit}]")
    axes.legend(fontsize=8, frameon=False)


def ripple_map_picture(found: RippleMap, *, size: tuple[float, float] = (5.4, 4.0)) -> Figure:
    """Draw the simulated truth of the claim: slope of the speed ripple over the resistance; bar: the linear condition.

    Blue: the ripple falls with a larger resistance; red: it rises; grey: no result.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(size)
    axes = figure.add_subplot()
    middle = np.sqrt(found.resistance[1:] * found.resistance[:-1])
    order = np.argsort(found.frequency_ratio)
    axes.set_facecolor("#999999")
    drawn = axes.pcolormesh(
        _edges(middle), _edges(found.frequency_ratio[order]), found.speed_slope[order], cmap="RdBu_r", vmin=-1.0,
        vmax=1.0, rasterized=True,
    )  # fmt: skip
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


def reduction_picture(study: ReductionStudy, *, size: tuple[float, float] = (5.4, 4.2)) -> Figure:
    """Distance of the full model from the limit L -> 0 over the inductance, with a line of first order.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(size)
    axes = figure.add_subplot()
    axes.loglog(study.inductance, study.speed, "o-", color=_COLOURS[0], lw=1.3, ms=4, label="speed [rad/s]")
    axes.loglog(study.inductance, study.angle, "s--", color=_COLOURS[1], lw=1.3, ms=4, label="angle [rad]")
    small = int(np.argmin(study.inductance))
    line = study.speed[small] * study.inductance / study.inductance[small]
    axes.loglog(study.inductance, 0.3 * line, ":", color="black", lw=1.0, label="first order")
    _panel(axes, "difference between the full model and its limit", "inductance [H]", "largest difference")
    axes.legend(fontsize=8, frameon=False)
    return figure


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
    speed.plot(run.time, run.speed, color=_COLOURS[0], lw=1.5)
    outside = np.nonzero(~(np.abs(run.speed / target - 1.0) <= band))[0]
    if outside.size and outside[-1] + 1 < run.time.size:
        at = run.time[outside[-1] + 1]
        speed.axvline(at, color="0.4", lw=0.8)
        speed.annotate(f"within ±{100 * band:g} % from {at:.3g} s", (at, 0.5 * target), xytext=(5, 0), fontsize=8,
                       textcoords="offset points")  # fmt: skip
    _panel(speed, f"crank speed; band around {target:g} rad/s", "", "[rad/s]")
    for k in range(run.currents.shape[1]):
        name = ("i_d", "i_q")[k] if run.currents.shape[1] == 2 else "I"
        current.plot(run.time, run.currents[:, k], color=_COLOURS[k], ls=_STYLES[k], lw=1.4, label=name)
    _panel(current, "motor currents", "", "[A]")
    if run.currents.shape[1]:
        current.legend(fontsize=8, frameon=False, loc=legend_place(run.currents.size))
    motion = braider.link_motion(run).speed
    for k, name in enumerate(("crank", "coupler", "rocker and switch")):
        links.plot(run.time, motion[:, k], color=_COLOURS[k], ls=_STYLES[k], lw=1.4, label=name)
    _panel(links, "angular velocities", "time [s]", "[rad/s]")
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
        style = {"color": _COLOURS[k], "ls": _STYLES[k], "lw": 1.4, "label": joint}
        rates.plot(x, relative[k], **style)
        forces.plot(x, found.magnitudes()[:, k], **style)
        fx, fy = found.forces()[:, k].T
        paths.plot(fx, fy, **style)
    torque.plot(x, found.torque, color="black", lw=1.4)
    _panel(rates, "relative angular velocity at the joints", name, "[rad/s]")
    _panel(forces, "size of the reactions", name, "[N]")
    _panel(paths, "hodographs of the reactions", "F_x [N]", "F_y [N]")
    _panel(torque, "torque on the crank", name, "[N m]")
    paths.set_aspect("equal", adjustable="datalim")
    torque.ticklabel_format(axis="y", style="sci", scilimits=(-3, 3))
    paths.locator_params(axis="x", nbins=5)
    handles, labels = rates.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    return figure
