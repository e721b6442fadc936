"""The single-motor platform of a scene: recognise its graph, move it through a full rotation, assess, draw."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.plots import Line
from graphsynth.drawing.sketch import Sketch, degrees
from graphsynth.pipeline.display import TURN, chart, table
from graphsynth.pipeline.products import Attempt, Candidate, Picture, Quantity, Recognised, Record, Table, each, exact
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.steps import recognise_by_key, records_of
from graphsynth.systems.platform.system import PlatformTable

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from graphsynth.systems.platform.motion import TurnMotion
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform


T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False)
class PlatformMotion:
    """One rotation of the wheels, with every joint for the pictures.

    * `motion`: what the module computed; shorter than asked for if the branch ends.
    * `O`, `D` (shape (3,), complex): wheel axes and rocker pivots, fixed frame, metres.
    * `B`, `C`, `A`, `F` (shape (n, 3), complex): crank pins, drive joints of the rockers, platform joints of the
      rockers, platform corners.
    * `wheel_radius`: pitch radius, metres.
    """

    mechanism: SingleMotorPlatform
    motion: TurnMotion
    O: NDArray[np.complex128]
    D: NDArray[np.complex128]
    B: NDArray[np.complex128]
    C: NDArray[np.complex128]
    A: NDArray[np.complex128]
    F: NDArray[np.complex128]
    wheel_radius: float


def _table(context: Context) -> PlatformTable:
    table = context.scene.mechanism
    assert isinstance(table, PlatformTable)  # the registry chose this stage by the module of the scene
    return table


def recognise(context: Context, candidates: tuple[Candidate, ...]) -> tuple[Recognised, ...]:
    """Mark the candidates isomorphic to the single-motor platform, frame and gear pairs respected."""
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

    return recognise_by_key(candidates, SingleMotorPlatform().graph(), "single_motor_platform")


def kinematics(context: Context, recognised: tuple[Recognised, ...]) -> tuple[Attempt, ...]:
    """Move every recognised candidate through one turn with the dimensions of the scene."""
    return each((Attempt(r.candidate, r) for r in recognised if r.module), lambda _: _move(context))


def platform_of(context: Context) -> SingleMotorPlatform:
    """Return the platform with the dimensions of the scene, metres, not moved yet; one leg is repeated three times.

    Raises `GeometryError` for dimensions that no platform can have.
    """
    from graphsynth.systems.platform.drive import GearTrain
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

    table = _table(context)

    def thrice(value: T) -> tuple[T, T, T]:
        return (value, value, value)

    return SingleMotorPlatform(
        crank=table.crank,
        phase=table.crank_phase,
        coupler=thrice(table.coupler),
        rocker=thrice(table.rocker),
        axis=thrice(complex(*table.wheel_axis)),
        pivot=thrice(complex(*table.rocker_pivot)),
        vertex=thrice(complex(*table.platform_vertex)),
        l1=thrice(table.arm),
        l2=thrice(table.intermediate),
        frame_angle=table.leg_directions,
        delta=thrice(table.rocker_angle),
        tau=thrice(table.drive_branch),
        gears=GearTrain(table.pinion_teeth, table.wheel_teeth),
    )


def _move(context: Context) -> PlatformMotion:
    table, mechanism = _table(context), platform_of(context)
    motion = mechanism.full_turn(table.positions + 1)
    if motion.label.sigma != table.working_mode:
        raise GeometryError(
            f"the home pose has working mode {list(motion.label.sigma)}, the scene says working_mode = "
            f"{list(table.working_mode)}; correct the scene or the dimensions"
        )
    turn = np.exp(1j * np.array(mechanism.frame_angle))
    O = np.array(mechanism.axis) * turn
    D = np.array(mechanism.platform.D)
    crank = np.array(mechanism.crank) * np.exp(1j * (motion.psi[:, None] + np.array(mechanism.phase)))
    arm = np.array(mechanism.rocker) * np.exp(1j * (motion.theta - np.array(mechanism.delta)))
    share = table.wheel_teeth / (table.pinion_teeth + table.wheel_teeth)
    A, F = mechanism.platform.elbows(motion.theta), mechanism.platform.vertices(motion.pose)
    return PlatformMotion(mechanism, motion, O, D, O + crank, D + arm, A, F, float(abs(O[0])) * share)


def assess(context: Context, recognised: tuple[Recognised, ...], motions: tuple[Attempt, ...]) -> tuple[Record, ...]:
    """Give one record per candidate."""
    return records_of(recognised, motions, _verdict)


def tables(context: Context, motions: tuple[Attempt, ...]) -> tuple[Table, ...]:
    """Lay out the rotation of the first one moved."""
    moved = _first(motions)
    return () if moved is None else _tables(moved)


def _verdict(moved: PlatformMotion) -> tuple[str, bool, tuple[Quantity, ...]]:
    motion = moved.motion
    good = motion.complete and motion.closed
    if good:
        turns = "turn" if motion.period == 1 else "turns"
        words = f"full rotation on one branch, closed after {motion.period} {turns} (estimated)"
    elif motion.complete:
        words = "full rotation on one branch, but it does not close (estimated)"
    else:
        words = f"no full rotation: {motion.stop_reason() or 'the branch is lost'} (estimated)"
    return words, good, _margins(motion)


def _margins(motion: TurnMotion) -> tuple[Quantity, ...]:
    travel = np.ptp(motion.pose, axis=0)
    closure = motion.closure_error * motion.Lc
    error, turned = (closure, motion.closure_error) if math.isfinite(closure) else (None, None)
    least = np.abs(motion.determinant / motion.determinant[0]).min()
    of_si = Quantity.of_si
    return (
        of_si("travel in x", travel[0], "mm", error=error),
        of_si("travel in y", travel[1], "mm", error=error),
        of_si("swing", travel[2], "rad", error=turned),
        of_si("distance to the nearest other assembly mode", motion.gap.min() * motion.Lc, "mm"),
        of_si("smallest |det JX|, relative to the start", least),
        exact("wheel positions computed", len(motion.psi)),
        of_si("smallest |leg Jacobian|", np.abs(motion.leg).min(), "mm^2"),
        of_si("closure error after one rotation", closure, "mm"),
        of_si("relative closure residual", motion.residual),
    )


def _tables(moved: PlatformMotion) -> tuple[Table, ...]:
    """Tell what the rotation is and what the drives allow; list poses every 45 degrees, dead points and the like."""
    motion, label = moved.motion, moved.motion.label
    drives = ", ".join(turn.kind.replace("turn", "rotation") for turn in moved.mechanism.drive_turns())
    side = {1: "> 0", -1: "< 0"}.get(label.sign, "= 0")
    branch = f"tau = {_signs(label.tau)}, sigma = {_signs(label.sigma)}, det JX {side}"
    rows = [
        ("drives 1, 2, 3", drives, "exact"),
        ("branch at the start", branch, "estimated"),
        ("the working mode is kept", motion.working_mode_constant, "estimated, at the samples"),
        *((q.name, q, q.guarantee) for q in _margins(motion)),
        ("time to compute the rotation", f"{motion.seconds:.3f} s", "measured once"),
    ]
    eighths = sorted({round(i * (len(motion.psi) - 1) / 8) for i in range(9)})
    modes = ("/".join("1" if value > 0 else "-1" for value in motion.leg[i]) for i in eighths)
    poses = [(motion.psi[i], *motion.pose[i], motion.determinant[i], mode) for i, mode in zip(eighths, modes)]
    found = [(event.psi, event.kind, event.statement) for event in motion.events]
    how = "Estimated: Newton iteration in double precision."
    return (
        table("Full rotation", ("quantity", "value", "method"), rows, f"Method: {motion.method}."),
        table("Poses during the rotation", _POSE_COLUMNS, poses, how),
        table(f"Events during the rotation: {len(found)}", ("wheel [°] | .6f", "event", "what it means"), found),
    )


def _signs(values: tuple[int, ...]) -> str:
    return "(" + ", ".join("+" if value > 0 else "-" for value in values) + ")"


_POSE_COLUMNS = (
    "wheel [°] | .6g",
    "x [mm] | .12g",
    "y [mm] | .12g",
    "alpha [rad] | .12g",
    "det JX [mm^4] | .12g",
    "sigma",
)


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
    O, B, F = motion.O[leg], motion.B[:count, leg], motion.F[:count, leg]
    clear = int(np.argmax(np.minimum(np.minimum(abs(O - B), abs(B - F)), abs(F - O))))  # joints well apart
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
    if labelled is not None:  # each label is pushed away from its neighbours, D's also from its ground
        o, b, c, d, a, f = (complex(points[labelled]) for points in (O, B, C, D, A, F))
        crank, bell = (o + b + f) / 3, (a + c + d) / 3
        away = {"O": (o, o - crank), "B": (b, b - crank), "F": (f, f - crank), "C": (c, c - bell), "A": (a, a - bell)}
        for name, (point, vector) in (away | {"D": (d, (a + c) / 2 - d)}).items():
            apart = vector / abs(vector) if vector else 1j
            sketch.label(point, name, (20 if name == "D" else 17) * apart)
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
    for name in "BCAFOD":
        places = getattr(motion, name)
        tracks |= {f"{name}{k}": places[steps, k] if places.ndim == 2 else complex(places[k]) for k in range(3)}
    bars = []
    for k, colour in enumerate(_LEG_COLOURS):
        bars += [Bar(f"O{k}", f"B{k}", width=5), Bar(f"B{k}", f"C{k}", colour, 3), Bar(f"A{k}", f"F{k}", colour, 3)]
    sketch = Sketch(*_box(motion), 620, 40, "Single-motor platform in motion")
    _surroundings(sketch, motion, 1.6)
    plates = [("F0", "F1", "F2"), *((f"C{k}", f"D{k}", f"A{k}") for k in range(3))]
    svg = linkage_animation(sketch, tracks, bars=bars, plates=plates, joints=list(tracks))
    return (Picture("One rotation of the wheels", svg, "The curves are the paths of the corners.", "wide"),)


def _box(motion: PlatformMotion) -> tuple[complex, complex]:
    rims = np.add.outer(motion.O, motion.wheel_radius * np.array([1, -1, 1j, -1j]))
    points = np.concatenate([group.ravel() for group in (motion.D, motion.A, motion.C, motion.F, rims)])
    x, y = points.real, points.imag
    return complex(x.min(), y.min()), complex(x.max(), y.max())


def plots(context: Context, motions: tuple[Attempt, ...]) -> tuple[Picture, ...]:
    """Plot the path of the platform, its rotation, and the determinant that tells a singular pose."""
    motion = _first(motions)
    if motion is None:
        return ()
    turn, wheel = motion.motion, "wheel angle [°]"
    x, y, alpha = turn.pose.T
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
