"""Pictures of the tribometer: both platforms over time, phase portrait, friction loop, errors of the methods.

Every function returns a matplotlib figure that belongs to no window; write it with ``figure.savefig(path)``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError
from graphsynth.drawing.figures import legend_place, new_figure
from graphsynth.drawing.palette import LIGHT

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from graphsynth.evidence.rows import Problem
    from graphsynth.systems.tribometer.model import Tribometer
    from graphsynth.systems.tribometer.stick_slip import StickSlipMotion

Array = NDArray[np.float64]
#: Readable in grey and by colour-blind readers [Okabe & Ito 2008].
_LOWER, _UPPER, _THIRD, _FOURTH = "#0072B2", "#D55E00", "#009E73", "#AA4499"
_STICK, _FAIL, _SOFT = LIGHT["pale"], LIGHT["bad"], LIGHT["soft"]
_COLOURS = (_LOWER, _UPPER, _THIRD, _FOURTH, "#56B4E9", "#E69F00", "#555555")
#: Points of a path drawn at most.
_MOST_NODES = 20_000
_MARKERS = "osD^vP*"


def _plain(axes: Any) -> None:
    axes.spines[["top", "right"]].set_visible(False)


def _known(motion: StickSlipMotion) -> None:
    if not np.isfinite(motion.x2).sum() > 1:
        raise SpecError(f"There is nothing to draw: {motion.statement}")


def _sticking(motion: StickSlipMotion) -> list[tuple[float, float]]:
    """Return the intervals of stick, from the events where there are some."""
    if not motion.events:
        return [(float(motion.t[0]), motion.end)] if (motion.state == 0).all() else []
    spans, since = [], 0.0 if motion.state[0] == 0 else None
    for event in motion.events:
        if event.state == 0:
            since = event.time
        elif since is not None:
            spans.append((since, event.time))
            since = None
    return spans if since is None else [*spans, (since, motion.end)]


def platforms_picture(motion: StickSlipMotion, *, size: tuple[float, float] = (9.0, 6.0)) -> Figure:
    """Displacements of both platforms over time, and below the friction force between its limits.

    The upper part is Figure 7b of the source [Perechesova et al. 2014].  Sticking is shaded.

    Parameters
    ----------
    motion : StickSlipMotion
    size : tuple of float
        Inches.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    SpecError
        If the run failed at its start.
    """
    _known(motion)
    figure = new_figure(size)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    for axes in (above, below):
        _plain(axes)
        for index, (start, stop) in enumerate(_sticking(motion)):
            axes.axvspan(start, stop, color=_STICK, lw=0, zorder=0, label="stick" if index == 0 else None)
    if math.isfinite(motion.model.drive.period):  # a belt would run out of the picture
        above.plot(motion.t, 1e3 * motion.x1, color=_LOWER, label="lower platform")
    above.plot(motion.t, 1e3 * motion.x2, color=_UPPER, ls="--", label="upper platform")
    above.set_ylabel("displacement [mm]")
    above.legend(loc="upper center", bbox_to_anchor=(0.5, 1.12), ncols=3, frameon=False)
    bound = motion.model.law.static * motion.model.normal
    below.plot(motion.t, motion.friction, color=_THIRD, lw=1.2)
    for side in (-bound, bound):
        below.axhline(side, color=_SOFT, ls=":", lw=1)
    below.annotate("largest static friction", (motion.t[-1], bound), xytext=(0, 3), textcoords="offset points",
                   ha="right", va="bottom", fontsize=8, color=LIGHT["note"])  # fmt: skip
    below.set(xlabel="time [s]", ylabel="friction force [N]", xlim=(motion.t[0], motion.t[-1]))
    below.set_ylim(-1.3 * bound, 1.3 * bound)
    if not motion.complete:
        above.set_title(motion.status.value, color=_FAIL, fontsize=10, loc="left")
        above.axvline(motion.end, color=_FAIL, lw=1)
    return figure


def phase_picture(
    motion: StickSlipMotion, *, settled: float | None = None, size: tuple[float, float] = (6.0, 5.0)
) -> Figure:
    """Velocity of the upper platform over its displacement; stick and slip in two colours.

    Parameters
    ----------
    motion : StickSlipMotion
    settled : float, optional
        Time after which the motion is drawn strongly, for example to show the limit cycle; before it, faintly.
    size : tuple of float
        Inches.

    Raises
    ------
    SpecError
        If the run failed at its start.
    """
    _known(motion)
    figure = new_figure(size)
    axes = figure.subplots()
    _plain(axes)
    # points of the events too, so that no corner is cut; those of Zeno behaviour cannot be told apart anyway
    t, x, v, state = motion.t, motion.x2, motion.v2, motion.state
    if motion.path is not None and len(motion.path.nodes) <= _MOST_NODES:
        t = np.unique(np.concatenate([t, motion.path.nodes[:, 0]]))
        x, v, state = motion.at(t)[:, :3].T
    for now, colour, label in ((True, _LOWER, "stick"), (False, _UPPER, "slip")):
        # a piece reaches to the first point of the next one
        inside = (state == 0) == now
        shown = inside | np.concatenate([[False], inside[:-1]])
        for part, width, alpha, name in (
            (t >= (settled or 0.0), 1.8, 1.0, label), (t < (settled or 0.0), 0.8, 0.35, None),
        ):  # fmt: skip
            chosen = shown & part
            axes.plot(1e3 * np.where(chosen, x, np.nan), 1e3 * np.where(chosen, v, np.nan), color=colour, lw=width,
                      alpha=alpha, label=name)  # fmt: skip
    axes.set(xlabel="displacement of the upper platform [mm]", ylabel="velocity [mm/s]")
    axes.legend(frameon=False, loc=legend_place(t.size))
    return figure


def friction_picture(motion: StickSlipMotion, *, size: tuple[float, float] = (6.0, 4.5)) -> Figure:
    """Friction force over sliding velocity, with the curve of the law; sticking is the upright line at zero.

    Raises
    ------
    SpecError
        If the run failed at its start.
    """
    _known(motion)
    figure = new_figure(size)
    axes = figure.subplots()
    _plain(axes)
    model = motion.model
    widest = 1.05 * float(np.nanmax(np.abs(motion.sliding))) or 1e-3
    speed = np.linspace(0.0, widest, 400)
    force = model.normal * model.law.coefficient(speed)
    for side in (-1, 1):
        axes.plot(1e3 * side * speed, side * force, color=_SOFT, lw=5, alpha=0.4, label="law" if side > 0 else None)
    bound = model.law.static * model.normal
    axes.plot([0, 0], [-bound, bound], color=_SOFT, lw=5, alpha=0.4)
    stick = motion.state == 0
    axes.plot(1e3 * motion.sliding[~stick], motion.friction[~stick], ".", ms=3, color=_UPPER, label="slip")
    axes.plot(1e3 * motion.sliding[stick], motion.friction[stick], ".", ms=3, color=_LOWER, label="stick")
    axes.set(xlabel="sliding velocity [mm/s]", ylabel="friction force [N]")
    axes.legend(frameon=False, loc=legend_place(stick.size))
    return figure


def error_picture(studies: Sequence[Problem], *, over: str = "time", size: tuple[float, float] = (7.0, 5.0)) -> Figure:
    """Errors of the methods, log-log: over run time, or over the parameter (smoothing velocity, step).

    An error of exactly zero has no place on a logarithmic axis and is left out.
    What failed or is unreliable is a cross in the colour of its method: at its error if it has one, else at the upper
    edge.

    Parameters
    ----------
    studies : sequence of Problem
    over : str
        "time" or "parameter".
    size : tuple of float
        Inches.

    Raises
    ------
    SpecError
        If ``over`` is something else, or no run succeeded.
    """
    if over not in ("time", "parameter"):
        raise SpecError(f"The abscissa {over!r} is not known; give 'time' or 'parameter'.")
    rows = [row for study in studies for row in study.rows]
    good = [row for row in rows if row.good and row.error > 0.0]
    if not good:
        raise SpecError("No run of the studies succeeded with an error above zero, so there is nothing to draw.")
    figure = new_figure(size)
    axes = figure.subplots()
    _plain(axes)

    def place(row: Any) -> float:
        return float(row.seconds if over == "time" else row.value)

    top = 10.0 * max(row.error for row in good)
    for index, method in enumerate(dict.fromkeys(row.method for row in rows)):
        colour = _COLOURS[index % 7]
        own = [row for row in good if row.method == method]
        axes.loglog([place(row) for row in own], [row.error for row in own], color=colour, marker=_MARKERS[index % 7],
                    ms=5, lw=1.2, label=method)  # fmt: skip
        for row in rows:
            if row.method == method and not row.good:
                height = top if math.isnan(row.error) else row.error
                axes.loglog(place(row), height, "x", color=colour, ms=9, mew=2.5)
    if len(good) < len(rows):
        axes.loglog([], [], "x", color=_SOFT, ms=9, mew=2.5, label="failed or unreliable")
    speeds = all(row.method not in ("time stepping", "event-driven") for row in rows)
    name = "smoothing velocity [m/s]" if speeds else "smoothing velocity [m/s], step [s] or tolerance"
    axes.set(xlabel="run time [s]" if over == "time" else name, ylabel="largest error of the position [m]")
    axes.margins(0.08, 0.12)
    axes.grid(which="major", color=LIGHT["pale"], lw=0.8)
    axes.legend(frameon=False, fontsize=8)
    return figure


def stiffness_picture(
    model: Tribometer,
    factors: Sequence[float] = (1.0, 1e2, 1e4),
    duration: float = 3.0,
    *,
    size: tuple[float, float] = (8.0, 5.0),
) -> Figure:
    """Spring force over normal force for stiffer and stiffer springs with equal damping ratio, and its limit.

    Parameters
    ----------
    model : Tribometer
    factors : sequence of float
        Factors on the stiffness.
    duration : float
        s.
    size : tuple of float
        Inches.
    """
    figure = new_figure(size)
    axes = figure.subplots()
    _plain(axes)
    times = np.linspace(0.0, duration, 3001)
    for index, factor in enumerate(factors):
        stiff = model.stiffened(factor)
        motion = stiff.event_driven(duration, times=times, estimate=False)
        exponent = math.log10(factor)
        name = f"stiffness × {factor:g}" if exponent < 3 else f"stiffness × 10$^{{{exponent:.3g}}}$"
        name += "" if motion.complete else f" ({motion.status.value})"
        axes.plot(times, stiff.stiffness * motion.x2 / stiff.normal, color=_COLOURS[index % 7], lw=1.2, label=name)
    axes.plot(times, model.limit_force(times), color="black", ls=(0, (4, 3)), lw=1, label="limit sgn(v) μ(|v|)")
    axes.set(xlabel="time [s]", ylabel="spring force / normal force", xlim=(0.0, duration))
    axes.legend(frameon=False, ncols=2, loc="upper center", bbox_to_anchor=(0.5, 1.15))
    return figure


def save_tribometer_gif(
    motion: StickSlipMotion, path: str | Path, *, frames: int = 100, seconds: float = 8.0, dpi: int = 70
) -> int:
    """Write an animation: crank and rod, both platforms, spring, and the curves growing below.

    The upper platform is dark while it sticks.

    Parameters
    ----------
    motion : StickSlipMotion
    path : path-like
    frames : int
        Pictures, 2 to 1000.
    seconds : float
        Time of one pass.
    dpi : int
        Dots per inch of a picture of 6.4 x 4.2 inches.

    Returns
    -------
    int
        Number of frames.

    Raises
    ------
    SpecError
        If the run failed at its start, or the number of frames is out of bounds.
    """
    from matplotlib.animation import FuncAnimation, PillowWriter
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    _known(motion)
    if not 2 <= frames <= 1000:
        raise SpecError(f"The number of frames is {frames}; give 2 to 1000.")
    figure = new_figure((6.4, 4.2))
    FigureCanvasAgg(figure)
    scene, curves = figure.subplots(2, 1, height_ratios=(3, 2))
    last = int(np.flatnonzero(np.isfinite(motion.x2))[-1])
    chosen = np.linspace(0, last, frames).round().astype(int)
    show = _Stage(motion, scene, curves)
    movie = FuncAnimation(figure, lambda i: show(int(chosen[i])), frames=frames)
    movie.save(str(path), writer=PillowWriter(fps=max(1, round(frames / seconds))), dpi=dpi)
    return frames


class _Stage:
    """What an animation moves."""

    def __init__(self, motion: StickSlipMotion, scene: Any, curves: Any) -> None:
        from matplotlib.patches import Rectangle

        drive = motion.model.drive
        self.motion, self.belt = motion, not math.isfinite(drive.period)
        shown = [motion.x2, motion.x2 if self.belt else motion.x1]
        self.width = 2.2 * float(np.nanmax(np.abs(np.concatenate(shown)))) or 1.0
        self.radius, self.rod = getattr(drive, "radius", 0.0), getattr(drive, "rod", 0.0)
        width = self.width
        self.lower = scene.add_patch(Rectangle((-0.5 * width, 0), width, 0.18 * width, color=_LOWER, alpha=0.55))
        (self.marks,) = scene.plot([], [], "|", color="black", ms=8)
        self.upper = scene.add_patch(Rectangle((0, 0.18 * width), 0.5 * width, 0.18 * width, color=_UPPER))
        (self.spring,) = scene.plot([], [], color="black", lw=1)
        (self.crank,) = scene.plot([], [], "o-", color="black", lw=2, ms=4)
        self.wall = 1.6 * width
        scene.plot([self.wall] * 2, [0.14 * width, 0.42 * width], color="black", lw=3)
        self.centre = -0.5 * width - self.rod
        left = min(-1.1 * width, self.centre - 1.3 * self.radius if self.rod else 0.0)
        scene.set(xlim=(left, 1.7 * width), ylim=(-0.35 * width, 0.6 * width), aspect="equal")
        scene.axis("off")
        if not self.belt:
            curves.plot(motion.t, 1e3 * motion.x1, color=_LOWER, lw=0.8, alpha=0.4)
        curves.plot(motion.t, 1e3 * motion.x2, color=_UPPER, lw=0.8, alpha=0.4, ls="--")
        (self.first,) = curves.plot([], [], color=_LOWER)
        (self.second,) = curves.plot([], [], color=_UPPER)
        curves.set(xlabel="time [s]", ylabel="displacement [mm]", xlim=(motion.t[0], motion.t[-1]))
        _plain(curves)

    def __call__(self, i: int) -> list[Any]:
        """Show the moment ``i``."""
        motion, width = self.motion, self.width
        x1, x2 = float(motion.x1[i]), float(motion.x2[i])
        if self.belt:
            places = (x1 / width + np.linspace(0.0, 1.0, 6, endpoint=False)) % 1.0 - 0.5
            self.marks.set_data(width * places, np.full(6, 0.05 * width))
        else:
            self.lower.set_x(x1 - 0.5 * width)
            self.first.set_data(motion.t[: i + 1], 1e3 * motion.x1[: i + 1])
        self.upper.set_x(x2 - 0.25 * width)
        self.upper.set_alpha(1.0 if motion.state[i] == 0 else 0.55)
        turns = np.linspace(0.0, 1.0, 17)
        zigzag = 0.27 * width + 0.05 * width * np.array([0, 0, *([1, -1] * 6), 0, 0, 0])
        self.spring.set_data(x2 + 0.25 * width + turns * (self.wall - x2 - 0.25 * width), zigzag)
        if self.rod:
            angle = motion.model.drive.speed * float(motion.t[i])
            pin = (self.centre + self.radius * math.cos(angle), self.radius * math.sin(angle))
            end = self.centre + x1 + self.rod
            self.crank.set_data([self.centre, pin[0], end], [0.09 * width, pin[1] + 0.09 * width, 0.09 * width])
        self.second.set_data(motion.t[: i + 1], 1e3 * motion.x2[: i + 1])
        return [self.lower, self.marks, self.upper, self.spring, self.crank, self.first, self.second]
