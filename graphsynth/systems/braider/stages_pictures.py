"""Pictures of the braider: the mechanism with its thread, its turn as an animation, curves of start-up and sensors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from graphsynth.pipeline.display import shown_motion
from graphsynth.pipeline.products import Picture
from graphsynth.pipeline.stages import Context
from graphsynth.systems.braider.stages import JOINTS, braider_of, table_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from graphsynth.drawing.plots import Line
    from graphsynth.dynamics.driven.reduction import ReductionStudy
    from graphsynth.dynamics.driven.run import DriveRun
    from graphsynth.systems.braider.model import Braider
    from graphsynth.systems.braider.reactions import Reactions

_SHOWN = 6  # crank angles drawn one by one
_COLOURS = ("a", "b", "c", "d")
_STYLES = ("-", "--", "-.", ":")
_TICKS = tuple(range(0, 361, 45))


def sketches(context: Context) -> tuple[Picture, ...]:
    """Draw the linkage large with its names and the path of the tip, then small at six crank angles."""
    import numpy as np

    braider = braider_of(context)
    turn = np.linspace(0.0, math.tau, 361)
    reached = turn[np.isfinite(braider.linkage.motion(turn).k3)]
    if reached.size == 0:
        return ()
    from graphsynth.drawing.sketch import degrees

    shown = float(reached[np.argmin(np.abs(reached - 1.0))])
    caption = (
        f"Crank at {degrees(shown)}. The crank O1A moves the rocker BO2 through the coupler AB; the switch O2C is "
        "rigid with the rocker. From its tip C the thread (dashed) runs to the guide G above the plane. The curves are "
        "the paths of B and C."
    )
    angles = [float(reached[round(i * (reached.size - 1) / _SHOWN)]) for i in range(_SHOWN)]
    small = [Picture(f"Crank at {degrees(x)}", _sketch(braider, x, reached, 250, False), "", "small") for x in angles]
    return (Picture("The mechanism", _sketch(braider, shown, reached, 620, True), caption, "wide"), *small)


def _points(braider: Braider, theta: Any) -> tuple[Any, Any, Any]:
    """Positions of A, B and C, m."""
    state = braider.linkage.motion(theta)
    return state.crank, braider.linkage.frame + state.rocker, braider.tip(theta)


def _sketch(braider: Braider, angle: float, reached: NDArray[np.float64], width: float, large: bool) -> str:
    from graphsynth.drawing.sketch import Sketch, degrees

    paths = _points(braider, reached)
    A, B, C = (complex(p) for p in _points(braider, angle))
    far, guide = complex(braider.linkage.frame), braider.thread.guide
    corners = [0j, far, guide, *paths[0], *paths[1], *paths[2]]
    lower = complex(min(z.real for z in corners), min(z.imag for z in corners))
    upper = complex(max(z.real for z in corners), max(z.imag for z in corners))
    sketch = Sketch(
        lower, upper, width, 40 if large else 18, f"Braiding mechanism, crank at {degrees(angle)}",
        symbol=1.0 if large else 0.6,
    )  # fmt: skip
    sketch.trace(list(paths[1]), "c", 1.4)
    sketch.trace(list(paths[2]), "a", 1.8)
    sketch.plate((far, B, C))
    sketch.trace([C, guide], "b", 2.4, dash=(6.0, 5.0))
    sketch.ground(0j)
    sketch.ground(far)
    sketch.bar(0j, A, width=5)
    sketch.bar(A, B)
    for point in (0j, A, B, far):
        sketch.joint(point)
    sketch.dot(C, "a", 4.5)
    sketch.dot(guide, "b", 4.0)
    if large:
        middle = (A + B + C + far) / 4
        for name, point in {"O1": -0.2 - 1j, "A": A - middle, "B": B - middle, "C": C - middle}.items():
            at = 0j if name == "O1" else {"A": A, "B": B, "C": C}[name]
            sketch.label(at, name, 20 * point / abs(point) if name != "O1" else -24 + 4j)
        sketch.label(far, "O2", 26 + 4j)
        same = abs(guide - far) < 0.2 * braider.linkage.frame
        sketch.label(guide, "G", (24 + 22j) if same else (14 + 14j))
    return sketch.svg()


def animations(context: Context) -> tuple[Picture, ...]:
    """Let the linkage turn in the page at the crank speed of the sensors."""
    import numpy as np

    from graphsynth.drawing.animation import animated_svg

    table, braider = table_of(context), braider_of(context)
    bar = braider.linkage
    arcs = bar.reach()
    if not arcs:
        return ()
    linkage = braider.mechanism
    low, high = (0.0, math.tau) if bar.turns_fully else arcs[-1]
    theta = np.linspace(low, high, 181)
    theta = theta[np.isfinite(bar.motion(theta).k3)]
    turns = bool(bar.turns_fully and theta.size == 181)
    motion = shown_motion(linkage, theta, _poses(braider, theta), closed=turns)
    seconds = abs((high - low) / table.speed_rad_s)
    svg = animated_svg(motion, title="Braiding mechanism", seconds=seconds, width=620)
    caption = (
        f"In real time with the crank at {table.speed_rad_s:g} rad/s; links 1 crank, 2 coupler, 3 rocker with switch."
    )
    return (Picture("The linkage in motion", svg, caption, "wide"),)


def _poses(braider: Braider, theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Poses (n, 4, 3) of frame, crank, coupler and rocker at crank angles."""
    import numpy as np

    state = braider.linkage.motion(theta)
    poses = np.zeros((theta.size, 4, 3))
    poses[:, 1, 2] = theta
    poses[:, 2] = np.column_stack([state.crank.real, state.crank.imag, np.unwrap(state.phi2)])
    poses[:, 3, 0], poses[:, 3, 2] = braider.linkage.frame, np.unwrap(state.phi3)
    return poses


def plots(context: Context, run: DriveRun, turn: Reactions, study: ReductionStudy | None) -> tuple[Picture, ...]:
    """Curves of the start-up, then of the turn, then the limit L -> 0."""
    braider = braider_of(context)
    pictures = [*_start_pictures(context, braider, run), *_turn_pictures(context, braider, turn)]
    if study is not None:
        pictures.append(_inductance_picture(study))
    return tuple(pictures)


def _lines(x: Any, columns: Any, names: tuple[str, ...]) -> list[Line]:
    from graphsynth.drawing.plots import Line

    return [Line(x, columns[:, k], name, _COLOURS[k], _STYLES[k]) for k, name in enumerate(names)]


def _start_pictures(context: Context, braider: Braider, run: DriveRun) -> list[Picture]:
    from graphsynth.drawing.plots import Line, line_plot
    from graphsynth.systems.braider.reactions import run_reactions

    start = table_of(context).start
    t, found, motion = 1e3 * run.time, run_reactions(braider, run), braider.link_motion(run)
    edges = [
        Line((), start.target_rad_s * (1.0 + s * start.band), "band" if s > 0 else "", "soft", "--") for s in (1, -1)
    ]
    speed = line_plot([Line(t, run.speed, "crank speed")], "time [ms]", "[rad/s]", levels=edges)
    current = line_plot(_lines(t, run.currents, ("i_d", "i_q")), "time [ms]", "current [A]")
    phase = line_plot([Line(run.currents[:, -1], run.speed)], "current i_q [A]", "crank speed [rad/s]")
    links = line_plot(_lines(t, motion.speed, ("crank", "coupler", "rocker, switch")), "time [ms]", "[rad/s]")
    forces = line_plot(_lines(t, 1e3 * found.magnitudes(), _short(JOINTS)), "time [ms]", "size of the reaction [mN]")
    torque = line_plot(
        [Line(t, 1e3 * found.torque, "on the crank"), Line(t, 1e3 * run.motor_torque, "of the motor", "b", "--")],
        "time [ms]", "torque [mN m]",
    )  # fmt: skip
    share = f"±{100 * start.band:g} % of {start.target_rad_s:g} rad/s"
    return [
        Picture("Start-up: crank speed", speed, f"From rest by a step of the voltage; dashed: {share}."),
        Picture("Start-up: currents of the motor", current, "In the frame of the rotor; i_q makes the torque."),
        Picture(
            "Start-up: phase portrait",
            phase,
            "From rest (0, 0): the current rises at once, then the speed takes it down.",
        ),
        Picture("Start-up: angular velocities of the links", links),
        Picture("Start-up: reactions in the joints", forces),
        Picture("Start-up: torque", torque, "Behind the train, and of the motor before it."),
    ]


def _short(names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(name.partition(":")[0] for name in names)


def _turn_pictures(context: Context, braider: Braider, turn: Reactions) -> list[Picture]:
    import numpy as np

    from graphsynth.drawing.plots import Line, line_plot

    state = braider.linkage.motion(turn.theta)
    deg = np.degrees(turn.theta)
    w2, w3 = state.k2 * turn.speed, state.k3 * turn.speed
    relative = np.stack([turn.speed, w2 - turn.speed, w3 - w2, w3], axis=1)
    names = _short(JOINTS)
    inertia = braider.effective_inertia(turn.theta)[0] - braider.reflected_inertia
    x = "crank angle [°]"
    sensors = line_plot(_lines(deg, relative, names), x, "[rad/s]", xticks=_TICKS)
    sizes = line_plot(_lines(deg, 1e3 * turn.magnitudes(), names), x, "size of the reaction [mN]", xticks=_TICKS)
    forces = 1e3 * turn.forces()
    polar = line_plot(
        [Line(forces[:, k, 0], forces[:, k, 1], name, _COLOURS[k], _STYLES[k]) for k, name in enumerate(names)],
        "F_x [mN]", "F_y [mN]", equal=True, size=(5.4, 4.2),
    )  # fmt: skip
    torque = line_plot([Line(deg, 1e6 * turn.torque)], x, "torque on the crank [µN m]", xticks=_TICKS)
    swing = line_plot(
        [
            Line(np.degrees(state.phi3), w3, "rocker, switch", "a"),
            Line(np.degrees(state.phi2), w2, "coupler", "b", "--"),
        ],
        "angle of the link [°]", "angular velocity [rad/s]",
    )  # fmt: skip
    terms = line_plot([Line(deg, 1e6 * inertia)], x, "inertia of the links [kg mm²]", xticks=_TICKS)
    at = f"Crank at {table_of(context).speed_rad_s:g} rad/s."
    pictures = [
        Picture("Sensors: relative angular velocities", sensors, f"{at} Of the two links of each joint."),
        Picture("Sensors: reactions", sizes, f"{at} {'; '.join(JOINTS)}."),
        Picture("Sensors: polar plot of the reactions", polar, f"{at} Paths of the force vectors in the fixed frame."),
        Picture("Sensors: torque on the crank", torque, at),
        Picture("Phase portraits of coupler and rocker", swing, f"{at} Each closes after a turn."),
        Picture(
            "Inertia of the links at the crank", terms, "The rotor behind the train adds a constant that is far larger."
        ),
    ]
    moment = braider.load_moment(turn.theta)
    if np.nanmax(np.abs(moment)) > 1e-12:  # a guide above O2 leaves no moment
        both = [Line(deg, 1e3 * moment, "on the switch"), Line(deg, 1e3 * moment * state.k3, "at the crank", "b", "--")]
        pull = line_plot(both, x, "moment of the thread [mN m]", xticks=_TICKS)
        pictures.append(Picture("Load of the thread", pull, "At the crank: positive where it drives."))
    return pictures


def _inductance_picture(study: ReductionStudy) -> Picture:
    from graphsynth.drawing.drive_pictures import reduction_picture
    from graphsynth.drawing.plots import themed_svg

    svg = themed_svg(reduction_picture(study, size=(5.4, 3.4)))
    caption = (
        "Largest differences from the motor without inductance after the electrical transient: of first order in L."
    )
    return Picture("The limit L -> 0", svg, caption)
