"""Pictures of the tribometer: both platforms over time, phase portrait, friction loop, energies, errors of methods.

Figures are those of matplotlib and belong to no window; write one with ``figure.savefig(path)``.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError
from graphsynth.drawing.palette import LIGHT
from graphsynth.drawing.plots import Line, legend_place, new_figure, themed_svg
from graphsynth.pipeline.display import chart
from graphsynth.pipeline.products import Picture
from graphsynth.pipeline.stages import Context
from graphsynth.systems.tribometer.cycles import LimitCycle
from graphsynth.systems.tribometer.motion import StickSlipMotion, event_driven

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from graphsynth.evidence.rows import Problem
Array = NDArray[np.float64]
#: Readable in grey and by colour-blind readers [Okabe & Ito 2008].
_LOWER, _UPPER, _FRICTION = "#0072B2", "#D55E00", "#009E73"
_SOFT = LIGHT["soft"]
#: Points of a path drawn at most.
_MOST_NODES, _MOST_ENERGIES = 20_000, 4000


def plots(context: Context, motion: StickSlipMotion, cycle: LimitCycle, study: Problem | None) -> tuple[Picture, ...]:
    """Draw Figure 7b, friction, phase portraits, energies and errors."""
    if not np.isfinite(motion.x2).sum() > 1:
        return ()
    stuck = "As Figure 7b of the article. Shaded: the platforms stick. Below: the force of friction."
    colours = "Of the upper platform: stick and slip in two colours."
    pictures = [
        _shown("Both platforms over time", platforms_picture(motion, size=(8.4, 5.4)), stuck, wide=True),
        _shown("Phase portrait of the run", phase_picture(motion, size=(5.2, 4.4)), colours),
    ]
    if math.isfinite(cycle.period) and cycle.kind not in ("none found", "steady"):
        words = f"{cycle.period:.6g} s, {len(cycle.events)} changes; {'stable' if cycle.stable else 'not stable'}."
        pictures.append(_shown("Limit cycle", phase_picture(_once(motion, cycle), size=(5.2, 4.4)), words))
    loop = friction_picture(motion, size=(5.2, 3.8))
    pictures.append(_shown("Friction force over sliding velocity", loop, "Grey: the law; points: what the run did."))
    return (*pictures, *_curves(motion), *_errors(study))


def _shown(title: str, figure: Figure, caption: str, *, wide: bool = False) -> Picture:
    return Picture(title, themed_svg(figure), caption, "wide" if wide else "normal")


def _once(motion: StickSlipMotion, cycle: LimitCycle) -> StickSlipMotion:
    """One period of the cycle by itself."""
    model = motion.model
    stuck = bool(abs(cycle.v2 - float(model.drive.motion(0.0).v)) < 1e-12 * max(model.frequency * model.reach, 1e-12))
    start = replace(model, x2=cycle.x2, v2=None if stuck else cycle.v2)
    return event_driven(start, cycle.period, estimate=False)


def _curves(motion: StickSlipMotion) -> list[Picture]:
    t = motion.t
    both = [Line(t, motion.v1, "lower platform", "a"), Line(t, motion.v2, "upper platform", "b", "--")]
    zero = "Lower minus upper platform; exactly zero while they stick."
    pictures = [
        chart("Velocities", both, "time [s]", "velocity [mm/s]"),
        chart("Sliding velocity", [Line(t, motion.sliding)], "time [s]", "sliding velocity [mm/s]", zero),
    ]
    if motion.path is None:
        return pictures
    c, stored = motion.path.columns, motion.path.stored
    gap = np.abs(stored - stored[0] - (c.driven - c.heat - c.damped))
    few = np.linspace(0, len(gap) - 1, min(len(gap), _MOST_ENERGIES)).astype(int)  # Zeno behaviour has many nodes
    names, styles = ("drive", "friction", "damper", "stored"), ("-", "--", ":", "-.")
    energies = [
        Line(c.t[few], energy[few], name, colour, style)
        for energy, name, colour, style in zip((c.driven, c.heat, c.damped, stored), names, "abcd", styles)
    ]
    spent = "Given by the drive, lost in friction and damper, stored."
    residual = f"At most {motion.energy_residual:.1e} of what is exchanged."
    return [
        *pictures,
        chart("Energies since the start", energies, "time [s]", "energy [J]", spent),
        chart(
            "Error of the energy balance", [Line(c.t[few], gap[few])], "time [s]", "error of the balance [J]", residual
        ),
    ]


def _errors(study: Problem | None) -> list[Picture]:
    from graphsynth.evidence.pictures import work_precision_picture

    if study is None or not any(row.good and row.error > 0.0 for row in study.rows):
        return []
    setting = "smoothing velocity [m/s], step [s] or tolerance"
    rows = tuple(replace(row, more={**row.more, setting: row.value}) for row in study.rows)
    by_setting = replace(study, rows=rows, over=setting)
    crosses = "Crosses: failed or unreliable."
    return [
        _shown("Error against run time", work_precision_picture(study), crosses),
        _shown("Error against tolerance, step and smoothing velocity", work_precision_picture(by_setting), crosses),
    ]


def _figure(motion: StickSlipMotion, size: tuple[float, float], **panels: Any) -> tuple[Figure, Any]:
    """Return a figure and its axes without their upper and right edges; `SpecError` if nothing is known."""
    if not np.isfinite(motion.x2).sum() > 1:
        raise SpecError(f"There is nothing to draw: {motion.statement}")
    figure = new_figure(size)
    found = figure.subplots(**panels)
    for axes in np.atleast_1d(found):
        axes.spines[["top", "right"]].set_visible(False)
    return figure, found


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
    """Displacements of both platforms over time, and below the friction force between its limits; size in inches.

    The upper part is Figure 7b of the source [Perechesova et al. 2014].  Sticking is shaded.  `SpecError` if the run
    failed at its start.
    """
    figure, (above, below) = _figure(motion, size, nrows=2, sharex=True, height_ratios=(3, 2))
    for axes in (above, below):
        for index, (start, stop) in enumerate(_sticking(motion)):
            axes.axvspan(start, stop, color=LIGHT["pale"], lw=0, zorder=0, label="stick" if index == 0 else None)
    if math.isfinite(motion.model.drive.period):  # a belt would run out of the picture
        above.plot(motion.t, 1e3 * motion.x1, color=_LOWER, label="lower platform")
    above.plot(motion.t, 1e3 * motion.x2, color=_UPPER, ls="--", label="upper platform")
    above.set_ylabel("displacement [mm]")
    above.legend(loc="upper center", bbox_to_anchor=(0.5, 1.12), ncols=3, frameon=False)
    bound = motion.model.law.static * motion.model.normal
    below.plot(motion.t, motion.friction, color=_FRICTION, lw=1.2)
    for side in (-bound, bound):
        below.axhline(side, color=_SOFT, ls=":", lw=1)
    place = {"xytext": (0, 3), "textcoords": "offset points", "ha": "right", "va": "bottom"}
    below.annotate("largest static friction", (motion.t[-1], bound), fontsize=8, color=LIGHT["note"], **place)
    below.set(xlabel="time [s]", ylabel="friction force [N]", xlim=(motion.t[0], motion.t[-1]))
    below.set_ylim(-1.3 * bound, 1.3 * bound)
    if not motion.complete:
        above.set_title(motion.status.value, color=LIGHT["bad"], fontsize=10, loc="left")
        above.axvline(motion.end, color=LIGHT["bad"], lw=1)
    return figure


def phase_picture(
    motion: StickSlipMotion, *, settled: float | None = None, size: tuple[float, float] = (6.0, 5.0)
) -> Figure:
    """Velocity of the upper platform over its displacement; stick and slip in two colours; size in inches.

    After the time ``settled`` the motion is drawn strongly, for example to show the limit cycle; before it, faintly.
    `SpecError` if the run failed at its start.
    """
    figure, axes = _figure(motion, size)
    # points of the events too, so that no corner is cut; those of Zeno behaviour cannot be told apart anyway
    t, x, v, state = motion.t, motion.x2, motion.v2, motion.state
    if motion.path is not None and len(motion.path.nodes) <= _MOST_NODES:
        t = np.unique(np.concatenate([t, motion.path.nodes[:, 0]]))
        x, v, state = motion.at(t)[:, :3].T
    for now, colour, label in ((True, _LOWER, "stick"), (False, _UPPER, "slip")):
        # a piece reaches to the first point of the next one
        inside = (state == 0) == now
        shown = inside | np.concatenate([[False], inside[:-1]])
        late = t >= (settled or 0.0)
        for part, style in ((late, {"lw": 1.8, "label": label}), (~late, {"lw": 0.8, "alpha": 0.35})):
            place = [1e3 * np.where(shown & part, values, np.nan) for values in (x, v)]
            axes.plot(*place, color=colour, **style)
    axes.set(xlabel="displacement of the upper platform [mm]", ylabel="velocity [mm/s]")
    axes.legend(frameon=False, loc=legend_place(t.size))
    return figure


def friction_picture(motion: StickSlipMotion, *, size: tuple[float, float] = (6.0, 4.5)) -> Figure:
    """Friction force over sliding velocity, with the curve of the law; sticking is the upright line at zero."""
    figure, axes = _figure(motion, size)
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
