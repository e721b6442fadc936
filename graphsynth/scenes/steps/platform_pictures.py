"""Pictures of the single-motor platform: the mechanism at several wheel angles, and its motion over the turn."""

from __future__ import annotations

import cmath
from typing import TYPE_CHECKING

from graphsynth.drawing.sketch import Sketch, degrees
from graphsynth.scenes.products import Attempt, Picture
from graphsynth.scenes.stages import Context

if TYPE_CHECKING:
    from graphsynth.scenes.steps.platform import PlatformMotion

__all__ = ["plots", "sketches"]

_SHOWN = 6  # wheel angles drawn one by one
_LEG_COLOURS = ("a", "b", "c")


def _first(attempts: tuple[Attempt, ...]) -> PlatformMotion | None:
    return next((a.value for a in attempts if not a.failed), None)


def sketches(context: Context, motions: tuple[Attempt, ...]) -> tuple[Picture, ...]:
    """Draw the mechanism large at the start of the turn, then small at six wheel angles."""
    motion = _first(motions)
    if motion is None:
        return ()
    count = len(motion.motion.psi) - 1
    chosen = [round(i * count / _SHOWN) for i in range(_SHOWN)]
    caption = (
        "Wheel angle 0. The pinion in the middle turns three wheels; a crank pin B on each drives a coupler BC and the "
        "bell crank CDA, whose other arm moves the platform through AF. The small closed curves are the paths of the "
        "platform's corners."
    )
    pictures = [Picture("The single-motor platform", _sketch(motion, 0, 640, True), caption, "wide")]
    for i in chosen:
        name = f"Wheel at {degrees(float(motion.motion.psi[i]))}"
        pictures.append(Picture(name, _sketch(motion, i, 270, False), "", "small"))
    return tuple(pictures)


def _sketch(motion: PlatformMotion, i: int, width: float, labels: bool) -> str:
    """Draw one position: pitch circles and ground, then the links leg by leg, the platform, the joints."""
    O, D = motion.O, motion.D
    B, C, A, F = (points[i] for points in (motion.B, motion.C, motion.A, motion.F))
    lower, upper = _box(motion)
    sketch = Sketch(
        lower,
        upper,
        width,
        margin=34 if labels else 18,
        title=f"Single-motor platform, wheel at {degrees(float(motion.motion.psi[i]))}",
    )
    thick = 4.0 if labels else 2.6
    ring = 5.0 if labels else 3.2
    pinion = min(abs(O)) - motion.wheel_radius
    sketch.circle(0j, pinion)
    for k in range(3):
        sketch.circle(O[k], motion.wheel_radius)
        sketch.ground(D[k], 17 if labels else 9, direction=D[k])
        sketch.ground(O[k], 12 if labels else 7)
    sketch.ground(0j, 12 if labels else 7)
    if not all(map(cmath.isfinite, (*B, *C, *A, *F))):
        sketch.label(0j, "cannot be assembled")
        return sketch.svg()
    for k, colour in enumerate(_LEG_COLOURS):
        sketch.trace(list(motion.F[:, k]), colour, 1.6, closed=True)
        sketch.bar(O[k], B[k], width=thick)
        sketch.bar(B[k], C[k], colour=colour, width=thick * 0.75)
        sketch.plate((C[k], D[k], A[k]), width=thick * 0.75)
        sketch.bar(A[k], F[k], colour=colour, width=thick * 0.75)
    sketch.plate(list(F), opacity=0.85, width=thick)
    for k in range(3):
        for point in (O[k], B[k], C[k], D[k], A[k], F[k]):
            sketch.joint(point, ring)
    sketch.joint(0j, ring)
    if labels:
        _label_leg(sketch, O[1], B[1], C[1], D[1], A[1], F[1])
    return sketch.svg()


def _label_leg(sketch: Sketch, *points: complex) -> None:
    """Name the joints of one leg, each label pushed away from the middle of the leg."""
    middle = sum(points) / len(points)
    for name, point in zip("OBCDAF", points, strict=True):
        away = point - middle
        sketch.label(point, name, 17 * away / abs(away) if away else 17j)


def _box(motion: PlatformMotion) -> tuple[complex, complex]:
    points = [p for group in (motion.D, motion.A, motion.C, motion.F) for p in group.ravel() if cmath.isfinite(p)]
    points += [o + motion.wheel_radius * d for o in motion.O for d in (1, -1, 1j, -1j)]
    return (
        complex(min(p.real for p in points), min(p.imag for p in points)),
        complex(max(p.real for p in points), max(p.imag for p in points)),
    )


def plots(context: Context, motions: tuple[Attempt, ...]) -> tuple[Picture, ...]:
    """Plot the path of the platform, its rotation, and the determinant that tells a singular pose."""
    motion = _first(motions)
    if motion is None:
        return ()
    import numpy as np

    from graphsynth.drawing.plots import Line, line_plot

    turn = motion.motion
    psi, ticks = np.degrees(turn.psi), tuple(range(0, 361, 45))
    x, y, alpha = turn.pose.T
    path = line_plot([Line(x, y)], "x [mm]", "y [mm]", equal=True)
    shift = line_plot(
        [Line(psi, x, "x", "a"), Line(psi, y, "y", "b", "--")], "wheel angle [°]", "displacement [mm]", xticks=ticks
    )
    swing = line_plot([Line(psi, np.degrees(alpha))], "wheel angle [°]", "rotation [°]", xticks=ticks)
    relative = turn.determinant / abs(turn.determinant[0])
    zero = Line((), 0.0, "singular", "jam", "--")
    far = line_plot([Line(psi, relative)], "wheel angle [°]", "det JX / |det JX at 0|", xticks=ticks, levels=[zero])
    return (
        Picture("Path of the platform's centre", path),
        Picture("Displacement", shift),
        Picture("Rotation", swing),
        Picture("Distance from singular poses", far, "The platform is held as long as the determinant keeps its sign."),
    )
