"""Pictures of the lambda linkage: the mechanism at several crank angles, and its bearing over the turn."""

from __future__ import annotations

import cmath
import math
from typing import TYPE_CHECKING

from graphsynth.drawing.sketch import Sketch, degrees
from graphsynth.scenes.products import Attempt, Picture
from graphsynth.scenes.scene import LambdaTable
from graphsynth.scenes.stages import Context

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from graphsynth.drawing.plots import Band
    from graphsynth.jamming.assess import JammingReport
    from graphsynth.jamming.tilt_arcs import Arc
    from graphsynth.scenes.steps.four_bar import LambdaMotion

__all__ = ["plots", "sketches"]

_SHOWN = 6  # crank angles drawn one by one


def _first(attempts: tuple[Attempt, ...]) -> Attempt | None:
    return next((a for a in attempts if not a.failed), None)


def _plane(points: NDArray[np.float64]) -> list[complex]:
    """Project positions of shape (n, 3) on the plane of the linkage."""
    return [complex(x, y) for x, y in points[:, :2].tolist()]


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
        f"Crank at {shown}. M traces the blue curve, whose flat lower side is the working stroke. "
        "A ring around B marks a position in which the bearing jams."
    )
    pictures = [Picture("The linkage and the path of M", _sketch(motion, chosen[1], 420, arcs, True), caption, "wide")]
    for i in chosen:
        angle = float(motion.tilted.f[i])
        caption = f"The bearing at B {'jams' if _jams(arcs, angle) else 'is free'}."
        sketch = _sketch(motion, i, 250, arcs, False)
        pictures.append(Picture(f"Crank at {degrees(angle)}", sketch, caption, "small"))
    return tuple(pictures)


def _condition(context: Context) -> str:
    table = context.scene.mechanism
    assert isinstance(table, LambdaTable)
    return table.bearing.condition


def _jams(arcs: tuple[Arc, ...], angle: float) -> bool:
    return any(arc.contains(angle) for arc in arcs)


def _sketch(motion: LambdaMotion, i: int, width: float, arcs: tuple[Arc, ...], labels: bool) -> str:
    """Draw one position: ground first, then the links over it, then the joints."""
    A, B, M = (_plane(points) for points in (motion.tilted.A, motion.tilted.B, motion.tilted.M))
    O, C = 0j, complex(motion.linkage.l1, 0)
    every = [p for p in (O, C, *A, *B, *M) if cmath.isfinite(p)]
    lower = complex(min(p.real for p in every), min(p.imag for p in every))
    upper = complex(max(p.real for p in every), max(p.imag for p in every))
    angle = float(motion.tilted.f[i])
    sketch = Sketch(lower, upper, width, title=f"Lambda linkage, crank at {degrees(angle)}")
    sketch.circle(O, motion.linkage.l2, dash="4 4")
    sketch.ground(O)
    sketch.ground(C)
    sketch.trace(M, "a", 2.2, closed=True)
    if not all(map(cmath.isfinite, (A[i], B[i], M[i]))):
        sketch.label((lower + upper) / 2, "cannot be assembled")
        return sketch.svg()
    for p, q in ((O, A[i]), (C, B[i]), (A[i], M[i])):
        sketch.bar(p, q)
    if _jams(arcs, angle):
        sketch.dot(B[i], "jam", 10)
    for p in (O, C, A[i], B[i]):
        sketch.joint(p)
    sketch.dot(M[i], "a", 5)
    if labels:
        names = {
            "O": (O, -18 + 8j),
            "A": (A[i], -14 + 10j),
            "C": (C, 18 + 8j),
            "B": (B[i], 20 - 4j),
            "M": (M[i], 14 + 14j),
        }
        for name, (point, offset) in names.items():
            sketch.label(point, name, offset)
    return sketch.svg()


def plots(context: Context, motions: tuple[Attempt, ...], assessments: tuple[Attempt, ...]) -> tuple[Picture, ...]:
    """Plot the tilt of the coupler and the interference of the bearing over the crank angle, jam arcs shaded."""
    assessed = _first(assessments)
    if assessed is None:
        return ()
    condition = _condition(context)
    report: JammingReport = assessed.value[condition]
    shaded = f"Shaded: the bearing jams under condition {condition}."
    return (
        Picture("Tilt of the coupler at B", _plot_tilt(report), shaded),
        Picture("Interference of bearing and hole", _plot_gap(report), f"Negative: clearance left. {shaded}"),
    )


_TICKS = tuple(range(0, 361, 45))


def _plot_tilt(report: JammingReport) -> str:
    import numpy as np

    from graphsynth.drawing.plots import Line, line_plot

    tilt = Line(np.degrees(report.table.f), report.table.theta * 1e3, "tilt of the coupler")
    critical = report.critical_tilt
    limits = []
    if critical is not None:
        limits = [Line((), critical * 1e3, "critical tilt", "soft", "--"), Line((), -critical * 1e3, "", "soft", "--")]
    return line_plot([tilt], "crank angle [°]", "tilt [mrad]", bands=_jam_bands(report), xticks=_TICKS, levels=limits)


def _plot_gap(report: JammingReport) -> str:
    import numpy as np

    from graphsynth.drawing.plots import Line, line_plot

    table, f = report.table, np.degrees(report.table.f)
    gaps = [Line(f, table.gap_a, "condition A", "a"), Line(f, table.gap_b, "condition B", "c", "--")]
    zero = Line((), 0.0, "", "soft")
    return line_plot(
        gaps, "crank angle [°]", "interference [mm]", bands=_jam_bands(report), xticks=_TICKS, levels=[zero]
    )


def _jam_bands(report: JammingReport) -> list[Band]:
    """Return the jam arcs in degrees, cut at 360, the first one labelled."""
    from graphsynth.drawing.plots import Band

    spans = [_within_turn(math.degrees(arc.start), math.degrees(arc.stop)) for arc in report.arcs.arcs]
    pieces = [piece for span in spans for piece in span]
    return [Band(start, stop, "jams" if i == 0 else "") for i, (start, stop) in enumerate(pieces)]


def _within_turn(start: float, stop: float) -> list[tuple[float, float]]:
    """Cut an arc that runs past 360 degrees into pieces inside the turn."""
    return [(start, stop)] if stop <= 360.0 else [(start, 360.0), (0.0, stop - 360.0)]
