"""Pictures of the antenna of a scene: in space, its assembly modes, a scan, the curves of the article's Figure 4."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from graphsynth.pipeline.products import Picture
from graphsynth.pipeline.stages import Context
from graphsynth.systems.antenna.stages import AntennaMotion, antenna_of, other_model, table_of, widths_of

if TYPE_CHECKING:
    from graphsynth.systems.antenna import ModelComparison

_FRAMES = 97


def _svg(figure: Any) -> str:
    from graphsynth.drawing.plots import themed_svg

    return themed_svg(figure)


def sketches(context: Context) -> tuple[Picture, ...]:
    """Draw the mechanism in space, then every assembly mode at the same crank angles."""
    from graphsynth.systems.antenna.pictures import pointing_picture

    antenna, shown = antenna_of(context), table_of(context).shown
    x, y = shown
    modes = antenna.solve(x, y)
    there = [signs for k, signs in enumerate(modes.signs) if modes.distinct[k]]
    at = f"cranks at {math.degrees(x):g}° and {math.degrees(y):g}°"
    pictures = []
    if (1, -1) in there:
        caption = (
            "Leg Y (crank axis parallel to x) gives the elevation, leg X the azimuth. Squares are cardans, open "
            "circles ball joints, dotted circles the paths of the crank pins."
        )
        pictures.append(
            Picture(f"The mechanism in space, {at}", _svg(pointing_picture(antenna, x, y)), caption, "wide")
        )
    for sy, sx in there:
        name = f"Assembly mode ({'+' if sy > 0 else '−'}, {'+' if sx > 0 else '−'})"
        svg = _svg(pointing_picture(antenna, x, y, s_y=sy, s_x=sx, size=(4.4, 4.0), plain=True))
        pictures.append(Picture(name, svg, "The rest pose lies on it." if (sy, sx) == (1, -1) else ""))
    return tuple(pictures)


def animations(context: Context, motion: AntennaMotion) -> tuple[Picture, ...]:
    """Let the reflector scan a figure of eight, or follow equal cranks where a fold forbids that."""
    import numpy as np

    from graphsynth.systems.antenna.animation import pointing_animation

    antenna, largest = antenna_of(context), table_of(context).sweep.largest
    turn = np.linspace(0.0, math.tau, _FRAMES)
    x, y = largest * np.sin(turn), largest * np.sin(2.0 * turn)
    words = "The cranks swing by the largest angle of the sweep, leg X twice as fast as leg Y"
    clear = antenna.poses(np.linspace(-largest, largest, 25)[:, None], np.linspace(-largest, largest, 25))
    if not (clear.assembled.all() and antenna.poses(x, y).assembled.all()):
        far = float(motion.phi[motion.path.reached].max(initial=0.0))
        if far == 0.0:
            return ()
        x = y = far * 0.5 * (1.0 - np.cos(turn))
        words = f"Equal cranks, to and fro up to {math.degrees(far):.4g}°: beyond that the mechanism folds"
    caption = f"{words}. Right: where the beam goes."
    return (Picture("A scan", pointing_animation(antenna, x, y), caption, "wide"),)


def plots(context: Context, motion: AntennaMotion, comparison: ModelComparison) -> tuple[Picture, ...]:
    """Draw Figure 4, the growth of the difference, velocities, passive angles, maps of tolerances and folds."""
    from graphsynth.systems.antenna.pictures import (
        comparison_picture,
        difference_map_picture,
        fold_map_picture,
        tolerance_map_picture,
    )

    table, antenna = table_of(context), antenna_of(context)
    other, reading = other_model(context)
    largest = table.sweep.largest
    figure4 = comparison_picture(
        antenna, other, other_reading=reading, largest=largest, samples=table.sweep.samples,
        working=table.sweep.working, size=(8.6, 3.7),
    )  # fmt: skip
    pictures = [
        Picture(
            "Figure 4: two models over equal crank angles", _svg(figure4),
            "a: second model; b: first model; c: the means of both and their difference. Dotted: working limit.",
            "wide",
        ),
        *_curves(motion, comparison),
    ]  # fmt: skip
    drawn = difference_map_picture(antenna, other, other_reading=reading, span=largest)
    words = "Left: what the article compares. Right: how far apart the two models really point."
    pictures.append(Picture("Map of the difference of the two models", _svg(drawn), words, "wide"))
    if any(widths_of(context)):
        drawn = tolerance_map_picture(
            antenna, tuple(widths_of(context)), span=largest, nodes=table.tolerances.map_nodes
        )  # fmt: skip
        pictures.append(
            Picture("Map of the certified deviations", _svg(drawn), "Mean-value form at every node.", "wide")
        )
    drawn = fold_map_picture(antenna, nodes=61, size=(6.4, 6.2))
    pictures.append(Picture("Map of folds and dead points", _svg(drawn), "Of the mode of the rest pose.", "wide"))
    return tuple(pictures)


def _curves(motion: AntennaMotion, comparison: ModelComparison) -> list[Picture]:
    from graphsynth.drawing.plots import Line
    from graphsynth.pipeline.display import chart, unit_in

    phi, poses, J, passive = motion.phi, motion.path.poses, motion.rates.jacobian, motion.passive.x
    x, minute = "crank angle [°]", unit_in("[′]").to_si(1.0)
    growth = [
        Line(phi, comparison.arcminutes * minute, "means of two models", "a"),
        Line(phi, poses.a - poses.b, "a − b of one model", "b", "--"),
    ]
    slopes = [
        Line(phi, J[:, row, column], f"∂{angle}/∂φ{crank}", colour, style)
        for (row, column, angle, crank), colour, style in zip(
            ((0, 0, "a", "x"), (0, 1, "a", "y"), (1, 0, "b", "x"), (1, 1, "b", "y")), "abcd", ("-", "--", ":", "-.")
        )
    ]
    ratios = "Of the reflector (a elevation, b azimuth) to the cranks (φx leg Y, φy leg X)."
    leg_y, leg_x = _lines(phi, passive, range(5)), _lines(phi, passive, range(6, 11))
    return [
        chart("Growth of the differences", growth, x, "difference [′]", "Equal cranks; a: elevation, b: azimuth."),
        chart("Velocity ratios", slopes, x, "velocity ratio", ratios),
        chart("Passive angles of leg Y", leg_y, x, "angle [°]", "x1, x2: cardan; x3, x4, x5: ball joint."),
        chart("Passive angles of leg X", leg_x, x, "angle [°]", "x7, x8: cardan; x9, x10, x11: ball joint."),
    ]


def _lines(x: Any, columns: Any, which: range) -> list[Any]:
    from graphsynth.drawing.plots import Line

    colours, styles = ("a", "b", "c", "d", "note"), ("-", "--", "-.", ":", "-")
    return [Line(x, columns[:, k], f"x{k + 1}", colours[i], styles[i]) for i, k in enumerate(which)]
