"""Pictures of the lambda linkage: the mechanism at several crank angles, and its bearing over the turn."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from graphsynth.drawing.sketch import degrees
from graphsynth.pipeline.products import Attempt, Picture
from graphsynth.pipeline.stages import Context
from graphsynth.systems.lambda_linkage.pictures import lambda_animation, lambda_sketch, lambda_sketch_3d
from graphsynth.systems.lambda_linkage.system import LambdaTable

if TYPE_CHECKING:
    from graphsynth.drawing.plots import Band
    from graphsynth.jamming.assess import JammingReport
    from graphsynth.jamming.bearing.arcs import JamArc
    from graphsynth.systems.lambda_linkage.stages import LambdaMotion

_SHOWN = 6  # crank angles drawn one by one


def _first(attempts: tuple[Attempt, ...]) -> Attempt | None:
    return next((a for a in attempts if not a.failed), None)


def sketches(context: Context, motions: tuple[Attempt, ...], assessments: tuple[Attempt, ...]) -> tuple[Picture, ...]:
    """Draw the linkage with the path of M, then at six crank angles; a bearing that jams has a coloured ring."""
    moved, assessed = _first(motions), _first(assessments)
    if moved is None:
        return ()
    motion: LambdaMotion = moved.value
    arcs = assessed.value[_condition(context)].arcs.arcs if assessed else ()
    count = len(motion.tilted.f) - 1
    chosen = [round(i * count / _SHOWN) for i in range(_SHOWN)]
    shown = degrees(float(motion.tilted.f[chosen[1]]))
    caption = (
        f"Crank at {shown}. M traces the blue curve; the thick part is the nearly straight working stroke. "
        "A ring around B marks a position in which the bearing jams."
    )
    pictures = [Picture("The linkage and the path of M", _sketch(motion, chosen[1], 420, arcs, True), caption, "wide")]
    pictures += _in_space(motion, chosen[1])
    for i in chosen:
        angle = float(motion.tilted.f[i])
        caption = f"The bearing at B {'jams' if _jams(arcs, angle) else 'is free'}."
        sketch = _sketch(motion, i, 250, arcs, False)
        pictures.append(Picture(f"Crank at {degrees(angle)}", sketch, caption, "small"))
    return tuple(pictures)


def animations(context: Context, motions: tuple[Attempt, ...], assessments: tuple[Attempt, ...]) -> tuple[Picture, ...]:
    """Show one turn of the crank; words say where the bearing jams."""
    moved, assessed = _first(motions), _first(assessments)
    if moved is None:
        return ()
    arcs = assessed.value[_condition(context)].arcs.arcs if assessed else ()
    svg = lambda_animation(moved.value.linkage, lambda angle: _jams(arcs, angle))
    return (Picture("One turn of the crank", svg, "Blue: the path of M; green: its nearly straight part.", "wide"),)


def _in_space(motion: LambdaMotion, i: int) -> list[Picture]:
    """Draw the tilted linkage in space, if it is tilted and assembled there."""
    angle = float(motion.tilted.f[i])
    if motion.linkage.pin_height <= 0.0 or not motion.tilted.assembled[i]:
        return []
    caption = (
        "The motor axis is tilted, so the crank pin A leaves the plane of the frame and the rod tilts in its "
        "bearing at B. Heights are drawn larger by the factor written in the picture."
    )
    return [Picture("In space", lambda_sketch_3d(motion.linkage, angle).svg(), caption, "wide")]


def _condition(context: Context) -> str:
    table = context.scene.mechanism
    assert isinstance(table, LambdaTable)
    return table.bearing.condition


def _jams(arcs: tuple[JamArc, ...], angle: float) -> bool:
    return any(arc.contains(angle) for arc in arcs)


def _sketch(motion: LambdaMotion, i: int, width: float, arcs: tuple[JamArc, ...], labels: bool) -> str:
    """Draw one position in the plane; a bearing that jams has a coloured ring."""
    angle = float(motion.tilted.f[i])
    return lambda_sketch(motion.linkage, angle, width=width, labels=labels, ring=_jams(arcs, angle)).svg()


def plots(context: Context, motions: tuple[Attempt, ...], assessments: tuple[Attempt, ...]) -> tuple[Picture, ...]:
    """Plot the tilt of the coupler and the interference of the bearing over the crank angle, jam arcs shaded."""
    assessed = _first(assessments)
    if assessed is None:
        return ()
    from graphsynth.drawing.plots import Line
    from graphsynth.pipeline.display import TURN, chart, unit_in

    condition = _condition(context)
    report: JammingReport = assessed.value[condition]
    table, bands, critical = report.table, _jam_bands(report), report.critical_tilt
    shaded = f"Shaded: the bearing jams under condition {condition}."
    levels = []
    if critical is not None:
        levels = [Line((), critical, "critical tilt", "soft", "--"), Line((), -critical, "", "soft", "--")]
    tilt = [Line(table.f, table.theta, "tilt of the coupler")]
    mm = unit_in("[mm]").to_si(1.0)
    gaps = [
        Line(table.f, table.interference_a * mm, "condition A"),
        Line(table.f, table.interference_b * mm, "condition B", "c", "--"),
    ]
    words, x = f"Negative: clearance left. {shaded}", "crank angle [°]"
    more: dict[str, Any] = {"bands": bands, "xticks": TURN}
    zero = [Line((), 0.0, "", "soft")]
    return (
        chart("Tilt of the coupler at B", tilt, x, "tilt [mrad]", shaded, levels=levels, **more),
        chart("Interference of bearing and hole", gaps, x, "interference [mm]", words, levels=zero, **more),
    )


def _jam_bands(report: JammingReport) -> list[Band]:
    """Return the jam arcs, cut at a full rotation, the first one labelled."""
    from graphsynth.drawing.plots import Band

    spans = [_within_turn(arc.start, arc.stop) for arc in report.arcs.arcs]
    pieces = [piece for span in spans for piece in span]
    return [Band(start, stop, "jams" if i == 0 else "") for i, (start, stop) in enumerate(pieces)]


def _within_turn(start: float, stop: float) -> list[tuple[float, float]]:
    """Cut an arc that runs past a full rotation into pieces inside."""
    return [(start, stop)] if stop <= math.tau else [(start, math.tau), (0.0, stop - math.tau)]
