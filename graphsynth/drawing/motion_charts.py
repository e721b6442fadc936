"""Charts of a motion: coupler curves, displacements, velocities and accelerations, transmission angles, margins.

Every function returns a :class:`~graphsynth.drawing.plots.Chart`; where the branch does not reach,
the curves have gaps.  Events of the motion are upright lines.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.palette import TRACE_COLOURS
from graphsynth.drawing.plots import Chart, Line, Mark
from graphsynth.mechanism.joints import Prismatic

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]

_STYLES = ("-", "--", "-.", ":")
_WORDS = ("displacement", "velocity", "acceleration")
#: Events that end a motion, and those that it passes.
_ENDS = ("jam", "--")
_PASSES = ("soft", ":")


def coupler_curves(motion: Motion, names: Sequence[str] | None = None, *, unit: str = "length") -> Chart:
    """Paths of named points, on equal scales.

    `names`: all named points of the mechanism by default. `unit`: unit of length written at the axes, for example "m".
    Raises `GeometryError`: a name that is not defined, or no point at all.
    """
    chosen = list(motion.mechanism.points) if names is None else list(names)
    if not chosen:
        raise GeometryError("the mechanism has no named point, so there is no path to draw; give it points")
    lines = []
    for k, name in enumerate(chosen):
        x, y = motion.point(name).position.T
        lines.append(Line(x, y, name, TRACE_COLOURS[k % len(TRACE_COLOURS)]))
    return Chart(lines, f"x [{unit}]", f"y [{unit}]", equal=True, size=(5.4, 3.6))


def motion_chart(
    motion: Motion, of: str | int | None = None, order: int = 0, *, events: bool = True, unit: str = "length"
) -> Chart:
    """Displacement, velocity or acceleration over the input.

    `of`: a named point (its x and y), or a link: its angle, or its displacement if it slides on the frame.  By default
    all undriven links jointed to the frame. `order` (one of {0, 1, 2}): 0 displacement, 1 and 2 its first and second
    derivative by the input. `events`: mark dead centres, folds and the end of the motion. `unit`: unit of length
    written at the axes. Raises `GeometryError`: another order, an unknown point or link, or links that both turn and
    slide in one chart.
    """
    if order not in (0, 1, 2):
        raise GeometryError(f"order = {order} must be 0, 1 or 2: displacement, velocity or acceleration")
    per = "length" if _driver_slides(motion) else "rad"
    below = ("", f"/{per}", f"/{per}²")[order]
    if isinstance(of, str):
        path = motion.point(of)
        values = (path.position, path.velocity, path.acceleration)[order]
        lines = [Line(motion.inputs, values[:, c], f"{of}, {'xy'[c]}", "ab"[c], _STYLES[c]) for c in (0, 1)]
        return _over_input(motion, lines, f"{_WORDS[order]} [{unit}{below}]", events=events)
    frame = motion.mechanism.frame
    if of is None:  # undriven links jointed to the frame; sliding ones only if no link turns
        driven = {link for d in motion.mechanism.drivers for link in (d.link, d.base)}
        near = sorted({a + b - frame for a, b, _ in motion.mechanism.graph.joints if frame in (a, b)} - driven)
        near = near or [link for link in range(motion.mechanism.graph.links) if link != frame]
        links = [link for link in near if not _slides(motion, link)] or near
    else:
        links = [of]
    sliding = {_slides(motion, link) for link in links}
    if len(sliding) > 1:
        raise GeometryError(f"links {links} turn and slide, so they have no common axis; draw them one by one")
    lines = []
    for k, link in enumerate(links):
        values = _coordinate(motion, link, order)
        lines.append(Line(motion.inputs, values, f"link {link}", TRACE_COLOURS[k % 4], _STYLES[k % 4]))
    own = unit if sliding.pop() else "rad"
    return _over_input(motion, lines, f"{_WORDS[order]} [{own}{below}]", events=events)


def _slides(motion: Motion, link: int) -> bool:
    mechanism = motion.mechanism
    if not 0 <= link < mechanism.graph.links:
        raise GeometryError(f"link {link} does not exist; the links are 0..{mechanism.graph.links - 1}")
    return any(
        isinstance(joint, Prismatic) and {joint.a, joint.b} == {link, mechanism.frame} for joint in mechanism.joints
    )


def _coordinate(motion: Motion, link: int, order: int) -> Array:
    """Angle of a link, or displacement along its guide on the frame, or a derivative."""
    array = (motion.poses, motion.velocities, motion.accelerations)[order]
    mechanism = motion.mechanism
    if not _slides(motion, link):
        return array[:, link, 2]
    joint = mechanism.joint(link, mechanism.frame)
    assert isinstance(joint, Prismatic)
    on_frame = joint.a == mechanism.frame
    angle = joint.angle_a if on_frame else joint.angle_b  # the link does not turn: its own angle is constant
    moved = motion.point(link, joint.at_b if on_frame else joint.at_a)
    values = (moved.position, moved.velocity, moved.acceleration)[order]
    origin = np.array(joint.at_a if on_frame else joint.at_b) if order == 0 else np.zeros(2)
    along = (values - origin) @ np.array([math.cos(angle), math.sin(angle)])
    return np.asarray(along if on_frame else -along)


def _driver_slides(motion: Motion) -> bool:
    drivers = motion.mechanism.drivers
    return bool(drivers) and isinstance(motion.mechanism.joint(*drivers[0].pair), Prismatic)


def _over_input(
    motion: Motion, lines: list[Line], label: str, *, events: bool = True, levels: Sequence[Line] = ()
) -> Chart:
    """Return curves over the input, in quarters of a turn if it goes far; events within it are upright lines."""
    sliding, reached = _driver_slides(motion), motion.inputs[motion.assembled]
    name = "driver displacement [length]" if sliding else "driver angle [rad]"
    wide = not sliding and reached.size > 0 and float(np.ptp(reached)) >= 0.75 * math.pi
    low, high = float(motion.inputs.min()), float(motion.inputs.max())
    marks = []
    for event in motion.events if events else ():
        colour, style = _ENDS if event.ends_motion else _PASSES
        if low <= event.input <= high:
            told = f"{event.kind}: ends here" if event.ends_motion else event.kind
            marks.append(Mark(event.input, told, colour, style))
    return Chart(lines, name, label, marks=marks, levels=levels, in_pi=wide)


def transmission_chart(motion: Motion, least: float | None = None) -> Chart:
    """Transmission angle of every dyad over the input.

    `least`: a bound to be drawn, radians. Raises `GeometryError` if no group of the mechanism has a transmission angle
    (no dyads with two modes).
    """
    angles = motion.transmission_angle()
    if not angles:
        raise GeometryError("no dyad with two assembly modes, so no transmission angle; draw the margins instead")
    links = {step.group: ", ".join(map(str, step.links)) for step in motion.steps}
    lines = [
        Line(motion.inputs, values, f"links {links[group]}", TRACE_COLOURS[k % 4], _STYLES[k % 4])
        for k, (group, values) in enumerate(angles.items())
    ]
    bound = [] if least is None else [Line((), least, "bound", "jam", "--")]
    return _over_input(motion, lines, "transmission angle [rad]", levels=bound)


def margin_chart(motion: Motion) -> Chart:
    """Margin of every group over the input: 0 where two assembly modes meet.

    Dyads: the square of the sine of the angle at the joint that closes them; larger groups: the determinant of the
    reduced system, over its largest value.
    """
    lines = []
    for k, step in enumerate(step for step in motion.steps if step.group >= 0):
        values = motion.margins[:, step.group]
        if step.iterative and np.isfinite(values).any():
            values = values / np.nanmax(np.abs(values))
        label = f"links {', '.join(map(str, step.links))}"
        lines.append(Line(motion.inputs, values, label, TRACE_COLOURS[k % 4], _STYLES[k % 4]))
    if not lines:
        raise GeometryError("the mechanism has drivers only, no group: there is no margin to draw")
    return _over_input(motion, lines, "margin [1]", levels=[Line((), 0.0, "", "jam", "-")])
