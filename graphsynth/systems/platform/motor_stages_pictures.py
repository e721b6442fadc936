"""Pictures of the motor-driven platform: torque, speed, phase portraits, no inertia, the claim as a map, animation."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.drawing.plots import Chart, Line, Mark, themed_svg
from graphsynth.pipeline.display import TURN, chart, shown_motion
from graphsynth.pipeline.products import Picture
from graphsynth.pipeline.stages import Context
from graphsynth.systems.platform.motor_stages import Claim, LabelledRun, WithoutInertia, machine_table, table_of

if TYPE_CHECKING:
    from graphsynth.dynamics.driven.reduction import ReductionStudy

_COLOURS = ("a", "b", "c", "d")
_STYLES = ("-", "--", "-.", ":")


def sketches(context: Context) -> tuple[Picture, ...]:
    """Draw crank, slot and platform at one angle, and the inertia that the motor feels over a turn."""
    from graphsynth.drawing.diagram import mechanism_sketch
    from graphsynth.dynamics.driven.inertia import EffectiveInertia

    moved = table_of(context).platform
    q = np.linspace(0.0, math.tau, 361)
    pictures = []
    if moved.amplitude > 0.0:
        mechanism, poses = _yoke(moved.amplitude, q)
        caption = (
            "Link 1 is the crank, whose pin moves the platform, link 2, along its guide: y = amplitude sin(angle)."
        )
        svg = mechanism_sketch(mechanism, poses, width=420, height=360).svg(poses[52].tolist())
        pictures.append(Picture("Crank and platform", svg, caption))
    own = moved.inertia
    total = EffectiveInertia.of_slider(moved.mass, moved.amplitude).value(q) + own
    level = Line((), own, "constant part", "soft", "--")
    caption = "At the dead centres, 90° and 270°, the platform stands still and only the constant part is left."
    x, y = "crank angle [°]", "effective inertia [g m²]"
    pictures.append(chart("Inertia at the crank", [Line(q, total)], x, y, caption, xticks=TURN, levels=[level]))
    return tuple(pictures)


def _yoke(amplitude: float, q: Any) -> tuple[Any, Any]:
    """Crank with a pin in the slot of a platform that slides along y, and its poses (n, 3, 3) at crank angles."""
    from graphsynth.mechanism.joints import PinSlot, Prismatic, Revolute
    from graphsynth.mechanism.laws import Driver
    from graphsynth.mechanism.model import Mechanism, TracePoint
    from graphsynth.structure.graph import MechanismGraph

    mechanism = Mechanism(
        MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0),
        (
            Revolute(0, 1),
            Prismatic(0, 2, (1.6 * amplitude, 0.0), (1.6 * amplitude, 0.0), math.pi / 2, math.pi / 2),
            PinSlot(2, 1, (0.0, 0.0), (amplitude, 0.0)),
        ),
        drivers=(Driver(0, 1),),
        points={"P": TracePoint(1, (amplitude, 0.0))},
    )
    poses = np.zeros((q.size, 3, 3))
    poses[:, 1, 2] = q
    poses[:, 2, 1] = amplitude * np.sin(q)
    return mechanism, poses


def animations(context: Context, runs: tuple[LabelledRun, ...]) -> tuple[Picture, ...]:
    """Let the crank make its last turn with the speed that the motor gives it, slowed down."""
    from graphsynth.drawing.animation import animated_svg

    amplitude = table_of(context).platform.amplitude
    usable = [item for item in runs if item.run.complete and item.run.angle[-1] - item.run.angle[0] > math.tau]
    if not usable or amplitude == 0.0:
        return ()
    item = max(usable, key=lambda k: float(np.ptp(k.run.speed[k.run.time > 0.5 * k.run.time[-1]])))
    run = item.run
    begin = float(np.interp(run.angle[-1] - math.tau, run.angle, run.time))
    times = np.linspace(begin, float(run.time[-1]), 91)
    fine = item.drive.simulate(np.concatenate([[0.0], times]), rtol=run.rtol, estimate=False)
    q = fine.angle[1:]
    mechanism, poses = _yoke(amplitude, q)
    slow = 10.0
    seconds = slow * float(times[-1] - times[0])
    title = f"Platform driven by the motor, {item.label}"
    motion = shown_motion(mechanism, q, poses, closed=True)
    svg = animated_svg(motion, title=title, seconds=seconds, width=460, height=400)
    caption = (
        f"The last rotation of the run with {item.label}, {slow:g} times slower than in reality: the crank hurries "
        "through the dead centres, where it has hardly any inertia to move."
    )
    return (Picture("One rotation of the steady motion", svg, caption, "wide"),)


def plots(
    context: Context, runs: tuple[LabelledRun, ...], bare: WithoutInertia, found: Claim, study: ReductionStudy | None
) -> tuple[Picture, ...]:
    """Torque, speed and phase portraits; the model without inertia; the claim; the limit L -> 0."""
    from graphsynth.drawing.drive_pictures import reduction_picture
    from graphsynth.systems.platform.resistance import ripple_map_picture, ripple_picture

    pictures = [*run_pictures(runs), *_bare_pictures(context, bare)]
    map_caption = (
        "Blue: a larger resistance lowers the speed ripple of the full model, red: it raises it. The bar is the linear "
        "condition Ω = ω_n/√2: blue above and red below it is what small ripples obey."
    )
    pictures.append(
        Picture("The claim about the resistance as a map", themed_svg(ripple_map_picture(found.map)), map_caption)
    )
    for of, said in (("speed", "rises where Ω/ω_n < 0.71"), ("current", "always falls, and the torque with it")):
        svg = themed_svg(ripple_picture(found.effects, of))
        pictures.append(Picture(f"Ripple of the {of} over the resistance", svg, f"Linear theory: it {said}."))
    if study is not None:
        caption = "Largest differences from the motor without inductance, after the electrical transient."
        pictures.append(Picture("The limit L → 0", themed_svg(reduction_picture(study, size=(5.4, 3.4))), caption))
    return tuple(pictures)


def run_pictures(runs: tuple[LabelledRun, ...]) -> list[Picture]:
    """Torque and speed over time (Figures 6 and 7 of the source), and two phase portraits of the steady motion."""
    torque, speed, turn, spiral = [], [], [], []
    for k, item in enumerate(runs):
        run, look = item.run, (item.label, _COLOURS[k % 4], _STYLES[k % 4])
        late = run.time >= 0.5 * run.time[-1]
        angle = run.angle[late] % math.tau
        ends = np.flatnonzero(np.abs(np.diff(angle)) > math.pi) + 1  # a gap where a rotation ends
        torque.append(Line(run.time, run.motor_torque, *look))
        speed.append(Line(run.time, run.speed, *look))
        turn.append(Line(np.insert(angle, ends, np.nan), np.insert(run.speed[late], ends, np.nan), *look))
        spiral.append(Line(run.motor_torque, run.speed, *look))
    rest = "From rest, for each armature resistance."
    steady = "Second half of the run: a closed curve is a steady motion."
    loop = "From rest (0, 0) into the steady loop."
    y = "speed [rad/s]"
    return [
        chart("Motor torque", torque, "time [s]", "torque [N m]", rest),
        chart("Crank speed", speed, "time [s]", y, rest),
        chart("Phase portrait over a full rotation", turn, "crank angle [°]", y, steady, xticks=TURN),
        chart("Phase portrait of motor and crank", spiral, "torque [N m]", y, loop, size=(5.4, 3.6)),
    ]


def _bare_pictures(context: Context, bare: WithoutInertia) -> list[Picture]:
    run = bare.source
    root = math.sqrt(table_of(context).platform.mass) or 1.0
    marks = [Mark(event.time, event.kind, "soft" if event.kind == "dead centre" else "b") for event in run.events]
    moving = Chart([Line(run.time, run.momentum / root)], "time [s]", "speed of the platform [m/s]", marks=marks)
    spike = float(np.nanpercentile(np.abs(run.speed), 97.0))
    labels = ("none", *(f"{inertia:.0e}" for inertia in bare.inertias[:3]))
    lines = []
    for k, (label, other) in enumerate(zip(labels, (run, *bare.runs))):
        shown = np.where(np.abs(other.speed) <= spike, other.speed, np.nan)
        lines.append(Line(other.time, shown, label, _COLOURS[k], _STYLES[k]))
    speeds = Chart(lines, "time [s]", "crank speed [rad/s]")
    upright = "The regularised model of the source passes its dead centres (upright lines); this speed stays finite."
    cut = f"J_0 in kg m². The spikes of the crank speed at the dead centres are cut off at {spike:.3g} rad/s."
    return [
        Picture("Without inertia: speed of the platform", moving.svg(), upright),
        Picture("Without and with ever smaller inertia", speeds.svg(), cut),
    ]


def curves(context: Context, runs: tuple[LabelledRun, ...]) -> tuple[Picture, ...]:
    """Torque, speed and phase portraits, the inertia over a turn, the torque at constant speed."""
    if not runs:
        return ()
    model, table = runs[0].drive, machine_table(context)
    q = np.linspace(0.0, math.tau, 361)
    own = Line((), model.constant_inertia, "rotor, pinion, wheels", "soft", "--")
    felt = [Line(q, model.inertia.value(q) + model.constant_inertia)]
    w = table.motor.speed / model.train.ratio
    held = [Line(q, model.torque_at_speed(q, w))]
    words = "Of the real geometry: velocities of the platform per crank speed, squared."
    even = f"At the crank, at {w:g} rad/s: inverse dynamics."
    x = "wheel angle [°]"
    return (
        chart("Inertia at the crank", felt, x, "inertia [kg mm²]", words, xticks=TURN, levels=[own]),
        chart("Torque that would keep the speed even", held, x, "torque [mN m]", even, xticks=TURN),
        *run_pictures(runs),
    )
