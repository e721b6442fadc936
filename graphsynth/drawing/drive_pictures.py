"""Pictures of drives: torque and speed over time, the limit L -> 0.

Every function returns a matplotlib figure that belongs to no window; write it with ``figure.savefig(path)``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.core.errors import SpecError
from graphsynth.drawing.plots import legend_place, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from graphsynth.dynamics.driven.reduction import ReductionStudy
    from graphsynth.dynamics.driven.run import DriveRun

#: Readable in grey and by colour-blind readers [Okabe & Ito 2008].
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
STYLES = ("-", (0, (5, 2)), (0, (1, 1)), (0, (4, 1, 1, 1)), (0, (8, 2)), (0, (2, 2)))


def panel(axes: Any, title: str, x: str, y: str) -> None:
    """Give a panel its title, its axes and a grid."""
    axes.set_title(title, fontsize=10)
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(alpha=0.25)


def drive_curves(runs: Mapping[str, DriveRun], *, size: tuple[float, float] = (7.2, 5.6)) -> Figure:
    """Motor torque and crank speed over time, one curve for each labelled run (Figures 6 and 7 of the source).

    `runs`: label and run, for example two armature resistances. `size`: inches. Raises `SpecError` without any run.

    >>> from graphsynth.dynamics.driven.inertia import EffectiveInertia
    >>> from graphsynth.dynamics.driven.run import run
    >>> from graphsynth.dynamics.driven.setup import Plant
    >>> from graphsynth.dynamics.motors import DCMotor, Train
    >>> plant = Plant(EffectiveInertia.of_slider(2.0, 0.05).rows, 0.002)
    >>> motor = DCMotor(1.0, 0.2, 0.1, 0.1, gain=20.0, speed=20.0)
    >>> found = run(plant, motor, Train(), np.linspace(0.0, 1.0, 101))
    >>> drive_curves({"1 ohm": found}).axes[1].get_ylabel()
    'crank speed [rad/s]'
    """
    if not runs:
        raise SpecError("there is no run to draw; give at least one, for example {'1 ohm': run}")
    figure = new_figure(size)
    torque, speed = figure.subplots(2, 1, sharex=True)
    for k, (label, run) in enumerate(runs.items()):
        style = {"color": COLOURS[k % 6], "ls": STYLES[k % 6], "lw": 1.4}
        torque.plot(run.time, run.motor_torque, label=label, **style)
        speed.plot(run.time, run.speed, label=label, **style)
        if not run.complete:
            for axes in (torque, speed):
                axes.axvline(run.time[max(run.reached - 1, 0)], color=COLOURS[k % 6], lw=0.8)
    panel(torque, "motor torque", "", "torque [N m]")
    panel(speed, "crank speed", "time [s]", "crank speed [rad/s]")
    place = legend_place(sum(run.time.size for run in runs.values()))
    torque.legend(fontsize=8, frameon=False, ncols=min(len(runs), 4), loc=place)
    return figure


def reduction_picture(study: ReductionStudy, *, size: tuple[float, float] = (5.4, 4.2)) -> Figure:
    """Distance of the full model from the limit L -> 0 over the inductance, with a line of first order."""
    figure = new_figure(size)
    axes = figure.add_subplot()
    axes.loglog(study.inductance, study.speed, "o-", color=COLOURS[0], lw=1.3, ms=4, label="speed [rad/s]")
    axes.loglog(study.inductance, study.angle, "s--", color=COLOURS[1], lw=1.3, ms=4, label="angle [rad]")
    small = int(np.argmin(study.inductance))
    line = study.speed[small] * study.inductance / study.inductance[small]
    axes.loglog(study.inductance, 0.3 * line, ":", color="black", lw=1.0, label="first order")
    panel(axes, "difference between the full model and its limit", "inductance [H]", "largest difference")
    axes.legend(fontsize=8, frameon=False)
    return figure
