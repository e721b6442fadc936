"""Pictures of a four-bar survey: maps over the ratios of lengths, what can be had at once, the best linkages."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.drawing.palette import WHITE
from graphsynth.drawing.plots import new_figure, themed_svg
from graphsynth.mechanism.model import Mechanism
from graphsynth.mechanism.rotatability import TYPES
from graphsynth.pipeline.products import Picture, Ranking, Record
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.units import Unit
from graphsynth.systems.four_bar_survey.results import Survey
from graphsynth.systems.four_bar_survey.stages import Lattice, classify, evaluate_sets, lattice_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Colours of `TYPES`: cranks that turn are strong, the others pale, change points dark.
#: Not quite those of the palette: on a dark page the map would keep them, and its legend would not.
_COLOURS = ("#0073B2", "#009E74", "#E8C37B", "#D9A0BE", "#333333", "#C9CFD6", "#F3F4F6", "#7A1F1F")
_SKETCHED, _ANIMATED = 6, 3


def maps(context: Context, survey: Survey) -> tuple[Picture, ...]:
    """Draw the classes over frame and coupler for some rockers, the best that can be had, and the Pareto front."""
    lattice = survey.lattice
    pictures = [_classes(context, lattice)]
    if survey.maps.get("frame"):
        pictures.append(_best_angle(lattice, survey))
        if max(survey.maps["largest axis tilt"]) >= 0.0:
            pictures.append(_best_tilt(context, lattice, survey))
    if survey.front:
        pictures.append(_front(context, survey))
    return tuple(pictures)


def _extent(lattice: Lattice) -> tuple[float, float, float, float]:
    """Coupler along, frame up, in crank lengths; half a step around."""
    ends = []
    for lengths in (lattice.coupler, lattice.frame):
        ends += [(lengths[0] - 0.5 * lengths.step) / lattice.crank, (lengths[-1] + 0.5 * lengths.step) / lattice.crank]
    return ends[0], ends[1], ends[2], ends[3]


def _image(lattice: Lattice) -> dict[str, Any]:
    return {"origin": "lower", "extent": _extent(lattice), "aspect": "auto", "interpolation": "nearest"}


def _slices(context: Context, lattice: Lattice) -> list[int]:
    """Return the rockers whose class maps are drawn, in units: the nearest to those asked for, else three."""
    count = len(lattice.rocker)
    asked = context.scene.mechanism.slices
    if not asked:
        return sorted({lattice.rocker[round(part * (count - 1))] for part in (0.2, 0.5, 0.8)})
    return [min(lattice.rocker, key=lambda length: abs(length * lattice.unit - value)) for value in asked]


def _classes(context: Context, lattice: Lattice) -> Picture:
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.patches import Patch

    rockers = _slices(context, lattice)
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
        ax.imshow(image, **_image(lattice), cmap=ListedColormap(_COLOURS), norm=norm)
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


def _map(lattice: Lattice, grid: Any, label: str, cmap: str) -> tuple[Figure, Axes]:
    figure = new_figure((5.4, 4.2))
    ax = figure.add_subplot()
    image = ax.imshow(grid, **_image(lattice), cmap=cmap)
    figure.colorbar(image, ax=ax, label=label)
    ax.set_xlabel("coupler / crank")
    ax.set_ylabel("frame / crank")
    return figure, ax


def _best_angle(lattice: Lattice, survey: Survey) -> Picture:
    figure, ax = _map(
        lattice, _grid(lattice, survey, "transmission angle"), "smallest transmission angle [°]", "viridis"
    )
    _contour(ax, lattice, _grid(lattice, survey, "transmission angle"), [20, 30, 40, 50, 60, 70, 80])
    caption = "The smallest transmission angle over a turn, with the best rocker for each pair; blank: no crank turns."
    return Picture("Transmission", themed_svg(figure), caption)


def _contour(ax: Axes, lattice: Lattice, grid: Any, levels: list[float]) -> None:
    low, high, bottom, top = _extent(lattice)
    lines = ax.contour(grid, levels=levels, colors=WHITE, linewidths=0.7, extent=(low, high, bottom, top))
    ax.clabel(lines, fontsize=8, fmt="%g°")


def _best_tilt(context: Context, lattice: Lattice, survey: Survey) -> Picture:
    figure, _ = _map(lattice, _grid(lattice, survey, "largest axis tilt"), "tilt of the axis [°]", "cividis")
    transmission = round(Unit.parse("deg").from_si(context.scene.mechanism.limits.transmission), 9)
    caption = (
        "The critical tilt of the motor axis: up to it the bearing is free over the whole turn. Only pairs with some "
        f"rocker that keeps the limits (transmission angle {transmission:g}° and more)."
    )
    return Picture("Critical tilt", themed_svg(figure), caption)


def _front(context: Context, survey: Survey) -> Picture:

    done = evaluate_sets(context, survey.lattice, np.array(survey.front))
    figure = new_figure((5.4, 4.2))
    ax = figure.add_subplot()
    x, y = done.quantity("transmission angle"), done.quantity("largest axis tilt")
    dots = ax.scatter(x, y, c=done.size, cmap="viridis", s=14, linewidths=0)
    figure.colorbar(dots, ax=ax, label="longest length / crank")
    ax.set_xlabel("smallest transmission angle [°]")
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


def _caption(record: Record) -> str:
    margins = ", ".join(f"{m.name} {m.value:.3g}{' ' + m.unit if m.unit else ''}" for m in record.margins[:4])
    return f"{record.solution.partition(': ')[2]}. {record.recognised_as}; {margins}; {record.verdict}."


def sketches(context: Context, records: tuple[Record, ...], ranking: Ranking) -> tuple[Picture, ...]:
    """Draw the best linkages."""
    from graphsynth.drawing.diagram import mechanism_svg
    from graphsynth.kinematics.simulation import simulate

    pictures = []
    for place, (record, mechanism) in enumerate(_best(context, records, ranking, _SKETCHED), 1):
        motion = simulate(mechanism, [1.0], modes={0: 1}, events=False)
        svg = mechanism_svg(mechanism, motion.poses[0], width=300, height=220, title=f"Place {place}")
        pictures.append(Picture(f"Place {place}", svg, _caption(record), "small"))
    return tuple(pictures)


def animations(context: Context, records: tuple[Record, ...], ranking: Ranking) -> tuple[Picture, ...]:
    """Show the best linkages in motion."""
    from graphsynth.drawing.animation import animated_svg
    from graphsynth.kinematics.simulation import simulate

    pictures = []
    for place, (record, mechanism) in enumerate(_best(context, records, ranking, _ANIMATED), 1):
        motion = simulate(mechanism, np.linspace(0.0, math.tau, 61), modes={0: 1})
        svg = animated_svg(motion, frames=60, title=f"Place {place}", seconds=4, width=300, height=220)
        pictures.append(Picture(f"Place {place}", svg, record.solution.partition(": ")[2], "small"))
    return tuple(pictures)
