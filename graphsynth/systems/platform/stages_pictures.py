"""Pictures of the single-motor platform: the mechanism at several wheel angles, and its motion over the turn."""

from __future__ import annotations

from typing import TYPE_CHECKING

from graphsynth.drawing.sketch import Sketch, degrees
from graphsynth.pipeline.products import Attempt, Picture
from graphsynth.pipeline.stages import Context

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from graphsynth.systems.platform.stages import PlatformMotion

_SHOWN = 6  # wheel angles drawn one by one
_FRAMES = 90  # of the animation
_LEG_COLOURS = ("a", "b", "c")


def _first(attempts: tuple[Attempt, ...]) -> PlatformMotion | None:
    return next((a.value for a in attempts if not a.failed), None)


def sketches(context: Context, motions: tuple[Attempt, ...]) -> tuple[Picture, ...]:
    """Draw the mechanism large where its joints are well apart, then small at six wheel angles."""
    motion = _first(motions)
    if motion is None:
        return ()
    psi = motion.motion.psi
    count = len(psi) - 1
    leg = max(range(3), key=lambda k: motion.mechanism.crank[k])
    clear = max(range(count), key=lambda i: _spread(motion, i, leg))
    caption = (
        f"Wheel at {degrees(float(psi[clear]))}. The pinion in the middle turns three wheels; a crank pin B on each "
        "moves a coupler BC and the bell crank CDA, whose other arm moves the platform through AF. The closed curves "
        "at the corners of the platform are their paths."
    )
    pictures = [Picture("The single-motor platform", _sketch(motion, clear, 680, leg), caption, "wide")]
    pictures += [
        Picture(f"Wheel at {degrees(float(psi[i]))}", _sketch(motion, i, 270, None), "", "small")
        for i in (round(i * count / _SHOWN) for i in range(_SHOWN))
    ]
    return tuple(pictures)


def _spread(motion: PlatformMotion, i: int, k: int) -> float:
    """Return the smallest distance between wheel axis, crank pin and platform corner of leg k, in position i."""
    O, B, F = motion.O[k], motion.B[i, k], motion.F[i, k]
    return float(min(abs(O - B), abs(B - F), abs(F - O)))


def _sketch(motion: PlatformMotion, i: int, width: float, labelled: int | None) -> str:
    """Draw one position: plates at the back, then pitch circles, ground, links and joints."""
    O, D = motion.O, motion.D
    B, C, A, F = (points[i] for points in (motion.B, motion.C, motion.A, motion.F))
    large = labelled is not None
    title = f"Single-motor platform, wheel at {degrees(float(motion.motion.psi[i]))}"
    sketch = Sketch(*_box(motion), width, 40 if large else 16, title, symbol=1.0 if large else 0.5)
    sketch.plate(list(F), width=4)
    for k in range(3):
        sketch.plate((C[k], D[k], A[k]))
    _surroundings(sketch, motion, 1.6 if large else 1.0)
    for k, colour in enumerate(_LEG_COLOURS):
        sketch.bar(O[k], B[k], width=5)
        sketch.bar(B[k], C[k], colour=colour, width=3)
        sketch.bar(A[k], F[k], colour=colour, width=3)
        for point in (O[k], B[k], C[k], D[k], A[k], F[k]):
            sketch.joint(point)
    if labelled is not None:
        _label_leg(sketch, *(points[labelled] for points in (O, B, C, D, A, F)))
    return sketch.svg()


def _surroundings(sketch: Sketch, motion: PlatformMotion, width: float) -> None:
    """Draw what does not move: wheels, pinion, ground, and the paths of the platform's corners."""
    O, D = motion.O, motion.D
    for k in range(3):
        sketch.circle(O[k], motion.wheel_radius)
        sketch.ground(D[k], direction=D[k])
        sketch.ground(O[k], 12)
    sketch.circle(0j, min(abs(O)) - motion.wheel_radius)
    sketch.ground(0j, 12)
    for k, colour in enumerate(_LEG_COLOURS):
        sketch.trace(list(motion.F[:, k]), colour, width, closed=True)


def animations(context: Context, motions: tuple[Attempt, ...]) -> tuple[Picture, ...]:
    """Show one turn of the wheels."""
    motion = _first(motions)
    if motion is None:
        return ()
    from graphsynth.drawing.moving import Bar, linkage_animation

    steps = slice(None, None, max(1, len(motion.F) // _FRAMES))
    tracks: dict[str, ArrayLike] = {}
    for name, points in {"B": motion.B, "C": motion.C, "A": motion.A, "F": motion.F}.items():
        tracks |= {f"{name}{k}": points[steps, k] for k in range(3)}
    for name, places in {"O": motion.O, "D": motion.D}.items():
        tracks |= {f"{name}{k}": complex(places[k]) for k in range(3)}
    bars = [
        bar
        for k, colour in enumerate(_LEG_COLOURS)
        for bar in (Bar(f"O{k}", f"B{k}", width=5), Bar(f"B{k}", f"C{k}", colour, 3), Bar(f"A{k}", f"F{k}", colour, 3))
    ]
    sketch = Sketch(*_box(motion), 620, 40, "Single-motor platform in motion")
    _surroundings(sketch, motion, 1.6)
    svg = linkage_animation(
        sketch,
        tracks,
        bars=bars,
        plates=[("F0", "F1", "F2"), *((f"C{k}", f"D{k}", f"A{k}") for k in range(3))],
        joints=list(tracks),
    )
    return (Picture("One turn of the wheels", svg, "The motor turns them; the curves are the corners' paths.", "wide"),)


def _label_leg(sketch: Sketch, O: complex, B: complex, C: complex, D: complex, A: complex, F: complex) -> None:
    """Name the joints of one leg, each label pushed away from its neighbours; D's also from its ground."""
    near = (O + B + F) / 3
    for name, point in {"O": O, "B": B, "F": F}.items():
        sketch.label(point, name, 17 * _direction(point - near))
    for name, point in {"C": C, "A": A}.items():
        sketch.label(point, name, 17 * _direction(point - (A + C + D) / 3))
    sketch.label(D, "D", 20 * _direction((A + C) / 2 - D))


def _direction(vector: complex) -> complex:
    return vector / abs(vector) if vector else 1j


def _box(motion: PlatformMotion) -> tuple[complex, complex]:
    points = [p for group in (motion.D, motion.A, motion.C, motion.F) for p in group.ravel()]
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
    from graphsynth.drawing.plots import Line
    from graphsynth.pipeline.display import TURN, chart, unit_in

    turn, wheel = motion.motion, "wheel angle [°]"
    x, y = unit_in("[mm]").to_si(1.0) * turn.pose.T[:2]
    alpha = turn.pose[:, 2]
    shift = [Line(turn.psi, x, "x", "a"), Line(turn.psi, y, "y", "b", "--")]
    far = [Line(turn.psi, turn.determinant / abs(turn.determinant[0]))]
    zero = Line((), 0.0, "singular", "jam", "--")
    held = "The platform is held as long as the determinant keeps its sign."
    ratio = "det JX / |det JX at 0|"
    return (
        chart("Path of the platform's centre", [Line(x, y)], "x [mm]", "y [mm]", equal=True),
        chart("Displacement", shift, wheel, "displacement [mm]", xticks=TURN),
        chart("Rotation", [Line(turn.psi, alpha)], wheel, "rotation [°]", xticks=TURN),
        chart("Distance from singular poses", far, wheel, ratio, held, xticks=TURN, levels=[zero]),
    )
