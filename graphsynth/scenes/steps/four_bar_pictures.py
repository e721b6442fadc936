"""Pictures of the lambda linkage: the mechanism at several crank angles, and its bearing over the turn."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from graphsynth.drawing.sketch import Sketch, degrees
from graphsynth.scenes.products import Attempt, Picture
from graphsynth.scenes.stages import Context

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from graphsynth.scenes.steps.four_bar import LambdaMotion

__all__ = ["plots", "sketches"]

_SHOWN = 6  # crank angles drawn one by one


def _first(attempts: tuple[Attempt, ...]) -> Attempt | None:
    return next((a for a in attempts if not a.failed), None)


def _plane(points: NDArray[object]) -> list[complex]:
    """Project positions of shape (n, 3) on the plane of the linkage."""
    return [complex(x, y) for x, y in points[:, :2].astype(float).tolist()]


def sketches(context: Context, motions: tuple[Attempt, ...], assessments: tuple[Attempt, ...]) -> tuple[Picture, ...]:
    """Draw the linkage with the path of M, then the same at six crank angles; jammed positions are in the jam colour."""
    moved = _first(motions)
    if moved is None:
        return ()
    motion: LambdaMotion = moved.value
    assessed = _first(assessments)
    condition = context.scene.mechanism.bearing.condition  # type: ignore[union-attr]
    arcs = assessed.value[condition].arcs.arcs if assessed else ()
    count = len(motion.tilted.f) - 1
    chosen = [round(i * count / _SHOWN) for i in range(_SHOWN)]
    caption = f"Crank at {degrees(float(motion.tilted.f[chosen[1]]))}. M traces the curve; its upper part is the straight stroke."
    pictures = [Picture("The linkage and the path of M", _sketch(motion, chosen[1], 520, arcs, True), caption)]
    for i in chosen:
        angle = float(motion.tilted.f[i])
        state = "jams" if any(arc.contains(angle) for arc in arcs) else "free"
        pictures.append(
            Picture(
                f"Crank at {degrees(angle)}", _sketch(motion, i, 300, arcs, False), f"The bearing at B {_IS[state]}"
            )
        )
    return tuple(pictures)


_IS = {"jams": "jams.", "free": "is free."}


def _sketch(motion: LambdaMotion, i: int, width: float, arcs: tuple[object, ...], labels: bool) -> str:
    A, B, M = (_plane(points) for points in (motion.tilted.A, motion.tilted.B, motion.tilted.M))
    O, C = 0j, complex(motion.linkage.l1, 0)
    every = [p for p in (O, C, *A, *B, *M) if p == p]
    reach = 0.16 * (max(p.imag for p in every) - min(p.imag for p in every))
    lower = complex(min(p.real for p in every), min(p.imag for p in every) - 0.3 * reach)
    upper = complex(max(p.real for p in every), max(p.imag for p in every))
    sketch = Sketch(lower, upper, width, title=f"Lambda linkage, crank at {degrees(float(motion.tilted.f[i]))}")
    sketch.circle(O, motion.linkage.l2, dash="4 4")
    sketch.trace(M, "a", 2.2, closed=True)
    jammed = any(arc.contains(float(motion.tilted.f[i])) for arc in arcs)  # type: ignore[attr-defined]
    sketch.bar(O, A[i])
    sketch.bar(C, B[i])
    sketch.bar(A[i], M[i])
    sketch.ground(O)
    sketch.ground(C)
    sketch.joint(A[i])
    if jammed:
        sketch.dot(B[i], "jam", 9)
    sketch.joint(B[i])
    sketch.dot(M[i], "a", 5)
    if labels:
        for point, name, offset in (
            (O, "O", -20 + 8j),
            (A[i], "A", -16 + 8j),
            (C, "C", 20 + 8j),
            (B[i], "B", 20 + 2j),
            (M[i], "M", 16 + 12j),
        ):
            sketch.label(point, name, offset)
    return sketch.svg()


def plots(context: Context, motions: tuple[Attempt, ...], assessments: tuple[Attempt, ...]) -> tuple[Picture, ...]:
    """Plot tilt and gap over the crank angle with the jam arcs shaded, and the departure of M from the straight stroke."""
    assessed = _first(assessments)
    if assessed is None:
        return ()
    import numpy as np

    from graphsynth.drawing.plots import Band, Line, line_plot

    condition = context.scene.mechanism.bearing.condition  # type: ignore[union-attr]
    report = assessed.value[condition]
    table, f = report.table, np.degrees(report.table.f)
    ticks = list(range(0, 361, 45))
    spans = [(math.degrees(arc.start), math.degrees(arc.stop)) for arc in report.arcs.arcs]
    pieces = [piece for span in spans for piece in _within_turn(*span)]
    bands = [Band(a, b, "jams" if i == 0 else "") for i, (a, b) in enumerate(pieces)]
    limits = []
    if report.critical_tilt is not None:
        for sign in (1.0, -1.0):
            limits.append(
                Line((), sign * report.critical_tilt * 1e3, "critical tilt" if sign > 0 else "", "soft", "--")
            )
    tilt = line_plot(
        [Line(f, table.theta * 1e3, "tilt of the coupler", "a")],
        "crank angle [°]",
        "tilt [mrad]",
        bands=bands,
        xticks=ticks,
        levels=limits,
    )
    gaps = [Line(f, table.gap_a, "condition A", "a"), Line(f, table.gap_b, "condition B", "c", "--")]
    gap = line_plot(
        gaps, "crank angle [°]", "interference [mm]", bands=bands, xticks=ticks, levels=[Line((), 0.0, "", "soft", "-")]
    )
    shaded = f"Shaded: the bearing jams under condition {condition}."
    return (
        Picture("Tilt of the coupler at B", tilt, shaded),
        Picture("Interference of bearing and hole", gap, f"Negative: clearance left. {shaded}"),
    )


def _within_turn(start: float, stop: float) -> list[tuple[float, float]]:
    """Cut an arc that runs past 360 degrees into pieces inside the turn."""
    return [(start, stop)] if stop <= 360.0 else [(start, 360.0), (0.0, stop - 360.0)]
