"""Pictures of the best planar mechanisms: diagrams, animations, the paths of their tracing points."""

from __future__ import annotations

from typing import TYPE_CHECKING

from graphsynth.pipeline.planar.stages import restored
from graphsynth.pipeline.products import Outcome, Picture, Ranking, Record
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.units import behind

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

_FRAMES = 72


#: What names the best candidates: their ranking, or the records of all in their order.
Best = Ranking | tuple[Record, ...]


def best_numbers(context: Context, best: Best) -> list[tuple[str, int]]:
    """Return title and number of the best candidates, the best first; without a ranking of the first ones."""
    if isinstance(best, Ranking):
        named = [(f"Place {place}: candidate {n}", n) for place, n in enumerate(best.numbers, 1)]
    else:
        named = [(f"Candidate {record.number}", record.number) for record in best if record.status == "assessed"]
    return named[: context.scene.mechanism.pictures]


def best_motions(context: Context, written: tuple[Outcome, ...], best: Best) -> list[tuple[str, int, Motion]]:
    """Return title, number and motion of each of `best_numbers`."""
    import numpy as np

    from graphsynth.kinematics.simulation import simulate

    outcomes = {outcome.number: outcome for outcome in written}
    inputs = np.linspace(0.0, context.scene.mechanism.motion.span, 181)
    return [(title, n, simulate(restored(outcomes[n]), inputs)) for title, n in best_numbers(context, best)]


def sketches(
    context: Context, written: tuple[Outcome, ...], best: Best, records: tuple[Record, ...]
) -> tuple[Picture, ...]:
    """Draw the best candidates where their joints are well apart."""
    import numpy as np

    from graphsynth.drawing.diagram import mechanism_svg

    by_number = {record.number: record for record in records}
    pictures = []
    for title, number, motion in best_motions(context, written, best):
        # the sample in which the nearest two joints are far apart, and all of them from one line
        joints = np.stack([motion.point(j.a, j.at_a).position for j in motion.mechanism.joints], axis=1)
        apart = np.linalg.norm(joints[:, :, None] - joints[:, None], axis=-1)
        apart[:, apart.max(axis=0) < 1e-9 * apart.max()] = np.inf  # a pin on a slider is always at its guide
        flat = np.linalg.svd(joints - joints.mean(axis=1, keepdims=True), compute_uv=False)[:, 1]
        clear = int(np.fmin(apart.min(axis=(1, 2)), flat).argmax())
        record = by_number[number]
        margins = ", ".join(f"{m.name} {m.value:.3g}{behind(m.unit)}" for m in record.margins[:5])
        text = f"{record.verdict[:1].upper()}{record.verdict[1:]}. {margins[:1].upper()}{margins[1:]}."
        pictures.append(Picture(title, mechanism_svg(motion, clear, width=420, height=320, title=title), text))
    return tuple(pictures)


def animations(
    context: Context, written: tuple[Outcome, ...], best: Best, records: tuple[Record, ...]
) -> tuple[Picture, ...]:
    """Show the best candidates in motion, with the path of a tracing point."""
    from graphsynth.drawing.animation import animated_svg
    from graphsynth.drawing.frames import with_trace_points

    pictures = []
    for title, number, motion in best_motions(context, written, best):
        traced = with_trace_points(motion)
        svg = animated_svg(traced, frames=_FRAMES, title=title, seconds=4.0, width=420.0, height=320.0)
        pictures.append(Picture(title, svg, next(r.solution for r in records if r.number == number)))
    return tuple(pictures)


def plots(context: Context, written: tuple[Outcome, ...], best: Best) -> tuple[Picture, ...]:
    """Plot the paths of the tracing points of the best candidates, or how far their assembly modes are apart."""
    from graphsynth.drawing.motion_charts import coupler_curves, margin_chart

    pictures = []
    for title, _, motion in best_motions(context, written, best):
        named = bool(motion.mechanism.points)
        chart = coupler_curves(motion) if named else margin_chart(motion)
        what = "path of the point" if named else "margins of the groups: 0 where two assembly modes meet"
        pictures.append(Picture(title, chart.svg(), f"The {what}."))
    return tuple(pictures)
