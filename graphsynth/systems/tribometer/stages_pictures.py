"""Pictures of the tribometer of a scene: the machine, its motion, Figure 7b, phase portraits, energies, methods."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from graphsynth.pipeline.products import Picture
from graphsynth.pipeline.stages import Context

if TYPE_CHECKING:
    from graphsynth.evidence.rows import Problem
    from graphsynth.systems.tribometer.cycles import LimitCycle
    from graphsynth.systems.tribometer.stick_slip import StickSlipMotion

_MOST_NODES = 4000


def _svg(figure: Any) -> str:
    from graphsynth.drawing.figures import themed_svg

    return themed_svg(figure)


def _drawable(motion: StickSlipMotion) -> bool:
    import numpy as np

    return bool(np.isfinite(motion.x2).sum() > 1)


def sketches(context: Context, motion: StickSlipMotion) -> tuple[Picture, ...]:
    """Draw the machine with the names of its parts."""
    from graphsynth.systems.tribometer.animation import tribometer_sketch

    if not _drawable(motion):
        return ()
    first = next((event.time for event in motion.events if event.state != 0), 0.0)
    caption = (
        "The spring and the damper hold the upper platform to the frame; friction with the lower one drags it along. "
        f"Shown at {first:.4g} s, where it is first released."
        if first
        else "Shown at the start."
    )
    return (Picture("The tribometer", tribometer_sketch(motion, first), caption, "wide"),)


def animations(context: Context, motion: StickSlipMotion) -> tuple[Picture, ...]:
    """Let both platforms move in the page."""
    from graphsynth.systems.tribometer.animation import tribometer_animation

    if not _drawable(motion):
        return ()
    seconds = motion.end if 4.0 <= motion.end <= 20.0 else min(max(motion.end, 4.0), 20.0)
    pace = "In real time" if seconds == motion.end else f"{motion.end:.4g} s in {seconds:g} s"
    caption = f"{pace}. Below: displacements of the lower (blue) and the upper platform (orange)."
    return (Picture("In motion", tribometer_animation(motion, seconds=seconds), caption, "wide"),)


def plots(context: Context, motion: StickSlipMotion, cycle: LimitCycle, study: Problem | None) -> tuple[Picture, ...]:
    """Draw Figure 7b, friction, phase portraits, energies and errors."""
    from graphsynth.systems.tribometer.pictures import error_picture, friction_picture, phase_picture, platforms_picture

    if not _drawable(motion):
        return ()
    pictures = [
        Picture(
            "Figure 7b: both platforms over time", _svg(platforms_picture(motion, size=(8.4, 5.4))),
            "Shaded: the platforms stick. Below: the force of friction.", "wide",
        ),
        Picture(
            "Phase portrait of the run", _svg(phase_picture(motion, size=(5.2, 4.4))),
            "Of the upper platform: stick and slip in two colours.",
        ),
    ]  # fmt: skip
    portrait = _cycle_picture(context, cycle)
    if portrait is not None:
        pictures.append(portrait)
    pictures += [
        Picture(
            "Friction force over sliding velocity", _svg(friction_picture(motion, size=(5.2, 3.8))),
            "Grey: the law; points: what the run did.",
        ),
        *_curves(motion),
    ]  # fmt: skip
    if study is not None and any(row.good and row.error > 0.0 for row in study.rows):
        for over, name in (("time", "run time"), ("parameter", "tolerance, step and smoothing velocity")):
            svg = _svg(error_picture([study], over=over, size=(5.2, 4.4)))
            pictures.append(Picture(f"Error against {name}", svg, "Crosses: failed or unreliable."))
    return tuple(pictures)


def _cycle_picture(context: Context, cycle: LimitCycle) -> Picture | None:
    """Draw one period of the cycle by itself."""
    from dataclasses import replace

    import numpy as np

    from graphsynth.systems.tribometer.pictures import phase_picture
    from graphsynth.systems.tribometer.stages import tribometer_of

    if not math.isfinite(cycle.period) or cycle.kind in ("none found", "steady"):
        return None
    model = tribometer_of(context)
    stuck = bool(abs(cycle.v2 - float(model.drive.motion(0.0).v)) < 1e-12 * max(model.frequency * model.reach, 1e-12))
    start = replace(model, x2=cycle.x2, v2=None if stuck else cycle.v2)
    times = np.linspace(0.0, cycle.period, 1001)
    once = start.event_driven(cycle.period, times=times, estimate=False)
    words = f"{cycle.period:.6g} s, {len(cycle.events)} changes; {'stable' if cycle.stable else 'not stable'}."
    return Picture("Limit cycle", _svg(phase_picture(once, size=(5.2, 4.4))), words)


def _curves(motion: StickSlipMotion) -> list[Picture]:
    import numpy as np

    from graphsynth.drawing.plots import Line, line_plot

    t, model = motion.t, motion.model
    speeds = line_plot(
        [Line(t, 1e3 * motion.v1, "lower platform", "a"), Line(t, 1e3 * motion.v2, "upper platform", "b", "--")],
        "time [s]", "velocity [mm/s]",
    )  # fmt: skip
    sliding = line_plot([Line(t, 1e3 * motion.sliding)], "time [s]", "sliding velocity [mm/s]")
    pictures = [
        Picture("Velocities", speeds),
        Picture("Sliding velocity", sliding, "Lower minus upper platform; exactly zero while they stick."),
    ]
    if motion.path is None:
        return pictures
    nodes = motion.path.nodes
    if len(nodes) > _MOST_NODES:  # Zeno behaviour has hundreds of thousands
        nodes = nodes[np.linspace(0, len(nodes) - 1, _MOST_NODES).astype(int)]
    stored = 0.5 * model.mass * nodes[:, 2] ** 2 + 0.5 * model.stiffness * nodes[:, 1] ** 2
    at = nodes[:, 0]
    energy = line_plot(
        [Line(at, nodes[:, 4], "drive", "a"), Line(at, nodes[:, 5], "friction", "b", "--"),
         Line(at, nodes[:, 6], "damper", "c", ":"), Line(at, stored, "stored", "d", "-.")], "time [s]", "energy [J]",
    )  # fmt: skip
    gap = np.abs(stored - stored[0] - (nodes[:, 4] - nodes[:, 5] - nodes[:, 6]))
    residual = line_plot([Line(at, 1e15 * gap)], "time [s]", "gap of the balance [fJ]")
    return [
        *pictures,
        Picture("Energies since the start", energy, "Given by the drive, lost in friction and damper, stored."),
        Picture("Gap of the energy balance", residual, f"At most {motion.energy_residual:.1e} of what is exchanged."),
    ]
