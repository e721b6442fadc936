"""Pictures of a four-bar survey: maps over the ratios of lengths, what can be had at once, the best linkages."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np

from graphsynth.drawing.palette import LIGHT, WHITE
from graphsynth.drawing.plots import new_figure, themed_svg
from graphsynth.mechanism.model import Mechanism
from graphsynth.mechanism.rotatability import TYPES
from graphsynth.pipeline.products import Picture, Ranking, Record
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.units import Unit, behind
from graphsynth.systems.four_bar_survey.results import Survey
from graphsynth.systems.four_bar_survey.stages import Lattice, classify, evaluate_sets, lattice_of

#: Colours of `TYPES`: cranks that turn are strong, the others pale, change points dark.
#: Not quite those of the palette: on a dark page the map would keep them, and its legend would not.
_COLOURS = ("#0073B2", "#009E74", "#E8C37B", "#D9A0BE", "#333333", "#C9CFD6", "#F3F4F6", "#7A1F1F")
_SKETCHED, _ANIMATED = 6, 3
_ANGLE = "smallest transmission angle [°]"
_BLANK = "The smallest transmission angle over a rotation, with the best rocker for each pair; blank: no crank turns."
_TILT = (
    "The critical tilt of the motor axis: up to it the bearing is free over a full rotation. Only pairs with some "
    "rocker that keeps the limits"
)


def maps(context: Context, survey: Survey) -> tuple[Picture, ...]:
    """Draw the classes over frame and coupler for some rockers, the best that can be had, and the Pareto front."""
    lattice = survey.lattice
    pictures = [_classes(context, lattice)]
    if survey.maps.get("frame"):
        pictures.append(_map("Transmission", survey, "transmission angle", _ANGLE, "viridis", _BLANK))
        if max(survey.maps["largest axis tilt"]) >= 0.0:
            transmission = round(Unit.parse("deg").from_si(context.scene.mechanism.limits.transmission), 9)
            caption = f"{_TILT} (transmission angle {transmission:g}° and more)."
            pictures.append(
                _map("Critical tilt", survey, "largest axis tilt", "tilt of the axis [°]", "cividis", caption)
            )
    if survey.front:
        pictures.append(_front(context, survey))
    return tuple(pictures)


def _axes(lattice: Lattice) -> dict[str, Any]:
    """Coupler along, frame up, in crank lengths; half a step around."""
    ends = []
    for lengths in (lattice.coupler, lattice.frame):
        ends += [(lengths[0] - 0.5 * lengths.step) / lattice.crank, (lengths[-1] + 0.5 * lengths.step) / lattice.crank]
    return {"origin": "lower", "extent": ends, "aspect": "auto", "interpolation": "nearest"}


def _classes(context: Context, lattice: Lattice) -> Picture:
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.patches import Patch

    # the rockers nearest to those asked for, else three
    rockers = [
        min(lattice.rocker, key=lambda length: abs(length * lattice.unit - value))
        for value in context.scene.mechanism.slices
    ]
    if not rockers:
        most = len(lattice.rocker) - 1
        rockers = sorted({lattice.rocker[round(part * most)] for part in (0.2, 0.5, 0.8)})
    figure = new_figure((3.1 * len(rockers) + 0.3, 4.0))
    axes = figure.subplots(1, len(rockers), sharey=True, squeeze=False)[0]
    frame, coupler = np.meshgrid(lattice.frame, lattice.coupler, indexing="ij")
    seen: set[int] = set()
    for ax, rocker in zip(axes, rockers, strict=True):
        lengths = np.stack([frame, np.full_like(frame, lattice.crank), coupler, np.full_like(frame, rocker)], axis=-1)
        _, types = classify(lengths.reshape(-1, 4))
        seen |= set(types.tolist())
        norm = BoundaryNorm(np.arange(len(TYPES) + 1) - 0.5, len(TYPES))
        image = types.reshape(frame.shape)
        ax.imshow(image, **_axes(lattice), cmap=ListedColormap(_COLOURS), norm=norm)
        ax.set_title(f"rocker {rocker / lattice.crank:g}", fontsize=10)
        ax.set_xlabel("coupler / crank")
    axes[0].set_ylabel("frame / crank")
    patches = [Patch(facecolor=_COLOURS[k], edgecolor="#888888", label=TYPES[k]) for k in sorted(seen)]
    figure.legend(handles=patches, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    caption = (
        "Grashof's classes, decided in exact arithmetic. Blue and green: the crank turns fully. Dark lines: change "
        "points; red ones: immovable, they can only lie stretched."
    )
    return Picture("Classes", themed_svg(figure), caption, "wide")


def _grid(lattice: Lattice, survey: Survey, name: str) -> Any:
    """Values by (frame, coupler); NaN where there is none."""
    grid = np.full((len(lattice.frame), len(lattice.coupler)), math.nan)
    rows = [(length - lattice.frame[0]) // lattice.frame.step for length in survey.maps["frame"]]
    columns = [(length - lattice.coupler[0]) // lattice.coupler.step for length in survey.maps["coupler"]]
    values = np.array(survey.maps[name], dtype=float)
    grid[rows, columns] = np.where(values < 0.0, math.nan, values)
    return grid


def _map(title: str, survey: Survey, name: str, label: str, cmap: str, caption: str) -> Picture:
    """Colour the values of one map, with lines of equal transmission angle on theirs."""
    lattice = survey.lattice
    grid = _grid(lattice, survey, name)
    figure = new_figure((5.4, 4.2))
    ax = figure.add_subplot()
    image = ax.imshow(grid, **_axes(lattice), cmap=cmap)
    figure.colorbar(image, ax=ax, label=label)
    ax.set_xlabel("coupler / crank")
    ax.set_ylabel("frame / crank")
    if name == "transmission angle":
        extent = _axes(lattice)["extent"]
        levels = [20, 30, 40, 50, 60, 70, 80]
        lines = ax.contour(grid, levels=levels, colors=WHITE, linewidths=0.7, extent=extent)
        ax.clabel(lines, fontsize=8, fmt="%g°")
    return Picture(title, themed_svg(figure), caption)


def _front(context: Context, survey: Survey) -> Picture:
    done = evaluate_sets(context, survey.lattice, np.array(survey.front))
    figure = new_figure((5.4, 4.2))
    ax = figure.add_subplot()
    x, y = done.quantity("transmission angle"), done.quantity("largest axis tilt")
    dots = ax.scatter(x, y, c=done.size, cmap="viridis", s=14, linewidths=0.4, edgecolors=LIGHT["soft"])
    figure.colorbar(dots, ax=ax, label="longest length / crank")
    ax.set_xlabel(_ANGLE)
    ax.set_ylabel("critical tilt of the axis [°]")
    ax.grid(alpha=0.3)
    caption = (
        f"The {len(survey.front)} sets of the Pareto front: none is beaten in one objective without a loss in another."
    )
    return Picture("What can be had at once", themed_svg(figure), caption)


def _best(context: Context, records: tuple[Record, ...], ranking: Ranking, most: int) -> list[tuple[Record, Mechanism]]:
    """Return the best records with their linkages, lengths in cranks."""
    lattice = lattice_of(context)
    by_number = {record.number: record for record in records}
    found = []
    for number in ranking.numbers[:most]:
        record = by_number[number]
        match = re.match(r"set (\d+):", record.solution)
        assert match is not None  # as `judge` writes it
        g, a, b, c = (lattice.lengths(np.array([int(match[1])]))[0] / lattice.crank).tolist()
        found.append((record, Mechanism.four_bar(g, a, b, c)))
    return found


def sketches(context: Context, records: tuple[Record, ...], ranking: Ranking) -> tuple[Picture, ...]:
    """Draw the best linkages."""
    from graphsynth.drawing.diagram import mechanism_svg
    from graphsynth.kinematics.simulation import simulate

    pictures = []
    for place, (record, mechanism) in enumerate(_best(context, records, ranking, _SKETCHED), 1):
        margins = ", ".join(f"{m.name} {m.value:.3g}{behind(m.unit)}" for m in record.margins[:4])
        lengths = record.solution.partition(": ")[2]
        caption = f"{record.recognised_as.capitalize()}: {lengths}; {margins}; {record.verdict}."
        motion = simulate(mechanism, [1.0], modes={0: 1}, events=False)
        svg = mechanism_svg(mechanism, motion.poses[0], width=300, height=220, title=f"Place {place}")
        pictures.append(Picture(f"Place {place}", svg, caption, "small"))
    return tuple(pictures)


def animations(context: Context, records: tuple[Record, ...], ranking: Ranking) -> tuple[Picture, ...]:
    """Show the best linkages in motion."""
    from graphsynth.drawing.animation import animated_svg
    from graphsynth.kinematics.simulation import simulate

    pictures = []
    for place, (record, mechanism) in enumerate(_best(context, records, ranking, _ANIMATED), 1):
        motion = simulate(mechanism, np.linspace(0.0, math.tau, 61), modes={0: 1})
        svg = animated_svg(motion, frames=60, title=f"Place {place}", seconds=4, width=300, height=220)
        pictures.append(Picture(f"Place {place}", svg, f"{record.solution.partition(': ')[2].capitalize()}.", "small"))
    return tuple(pictures)
