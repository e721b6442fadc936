"""The tribometer as an SVG, moving by itself or standing still: drive, both platforms, spring, damper, curves."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError
from graphsynth.drawing.moving import Moving
from graphsynth.drawing.svg import painted, words
from graphsynth.pipeline.products import Picture
from graphsynth.pipeline.stages import Context
from graphsynth.systems.tribometer.motion import StickSlipMotion

Array = NDArray[np.float64]
_WIDTH, _SCENE, _CURVES = 640.0, 200.0, 130.0
_LOWER, _UPPER = painted("a", opacity=0.55), painted("b")


def sketches(context: Context, motion: StickSlipMotion) -> tuple[Picture, ...]:
    """Draw the machine with the names of its parts."""
    if not np.isfinite(motion.x2).sum() > 1:
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
    if not np.isfinite(motion.x2).sum() > 1:
        return ()
    seconds = min(max(motion.end, 4.0), 20.0)
    pace = "In real time" if seconds == motion.end else f"{motion.end:.4g} s in {seconds:g} s"
    caption = f"{pace}. Below: displacements of the lower (blue) and the upper platform (orange)."
    return (Picture("In motion", tribometer_animation(motion, seconds=seconds), caption, "wide"),)


def tribometer_sketch(motion: StickSlipMotion, at: float = 0.0) -> str:
    """Draw the tribometer at the known moment next to a time, s, its parts named; `SpecError` if nothing is known."""
    known = _known(motion)
    k = int(known[np.argmin(np.abs(motion.t[known] - at))])
    drawing, stage = Moving(_WIDTH, _SCENE + 16.0, 1.0), _Stage(motion)
    stage.draw(drawing, np.array([k]))
    stage.names(drawing, k)
    return drawing.svg("Tribometer")


def tribometer_animation(motion: StickSlipMotion, *, frames: int = 240, seconds: float = 0.0) -> str:
    """Draw the tribometer over the run as one SVG, with the displacements of both platforms below.

    ``frames`` are 2 to 2000 pictures, ``seconds`` the time of one pass (0: real time). `SpecError` if nothing is known.
    """
    if not 2 <= frames <= 2000:
        raise SpecError(f"The number of frames is {frames}; give 2 to 2000.")
    known = _known(motion)
    chosen = known[np.linspace(0, known.size - 1, frames).round().astype(int)]
    span = float(motion.t[chosen[-1]] - motion.t[chosen[0]])
    drawing = Moving(_WIDTH, _SCENE + _CURVES + 34.0, seconds or span, frames // 9)
    _Stage(motion).draw(drawing, chosen)
    _curves(drawing, motion, known, chosen)
    return drawing.svg("Tribometer in motion")


def _line(width: float, colour: str = "ink") -> str:
    return f'{painted(stroke=colour, width=width)} stroke-linecap="round" stroke-linejoin="round"'


def _known(motion: StickSlipMotion) -> NDArray[np.intp]:
    known = np.flatnonzero(np.isfinite(motion.x2))
    if known.size < 2:
        raise SpecError(f"There is nothing to draw: {motion.statement}")
    return known


class _Stage:
    """Places of all parts in pixels."""

    def __init__(self, motion: StickSlipMotion) -> None:
        self.motion, self.drive = motion, motion.model.drive
        self.belt = not math.isfinite(self.drive.period)
        self.radius = float(getattr(self.drive, "radius", 0.0))
        self.rod = float(getattr(self.drive, "rod", 0.0))
        shown = [motion.x2] if self.belt else [motion.x1, motion.x2]
        self.reach = float(np.nanmax(np.abs(np.concatenate(shown)))) or 1e-3
        # swing, half the lower platform, spring; then crank and rod, drawn to scale
        length = 5.4 * self.reach + (self.rod + 1.2 * self.radius if self.rod else 0.6 * self.reach)
        self.scale = (_WIDTH - 40.0) / length
        self.zero = _WIDTH - 20.0 - 3.6 * self.reach * self.scale
        self.floor = 160.0

    def at(self, x: Array) -> Array:
        """Pixels of displacements, m."""
        return self.zero + self.scale * np.asarray(x, float)

    def draw(self, drawing: Moving, frames: NDArray[np.intp]) -> None:
        """Add all parts at these times of the motion."""
        unit, floor = self.scale * self.reach, self.floor
        x1, x2 = self.at(self.motion.x1[frames]), self.at(self.motion.x2[frames])
        wall = self.zero + 3.4 * unit
        ground = np.linspace(20.0, _WIDTH - 20.0, 45)
        hatch = "".join(f"M{x:.1f} {floor + 1:.1f} l-6 8 " for x in ground)
        drawing.fixed(f'<path d="M14 {floor:.1f} H{_WIDTH - 14:.1f} {hatch}" {_line(1.2)}/>')
        if self.belt:
            # marks run along the belt and start anew
            length = _WIDTH - 60.0
            drawing.fixed(f'<rect x="30" y="{floor - 34:.1f}" width="{length:.1f}" height="10" rx="5" {_LOWER}/>')
            for k in range(8):
                x = 30.0 + np.remainder(self.scale * self.motion.x1[frames] + k * (length / 8.0), length)
                drawing.circle(np.stack([x, np.full_like(x, floor - 29.0)], -1), 3.0, painted("ink"))
        else:
            drawing.box(x1 - 1.8 * unit, floor - 34.0, 3.6 * unit, 28.0, _LOWER)
            for side in (-1.4, 1.4):
                drawing.circle(np.stack([x1 + side * unit, np.full_like(x1, floor - 4.0)], -1), 4.0, painted("ink"))
        top = floor - 34.0
        drawing.box(x2 - 0.8 * unit, top - 34.0, 1.6 * unit, 34.0, _UPPER)
        stuck = (self.motion.state[frames] == 0).tolist()
        for word, when in (("stick", stuck), ("slip", [not now for now in stuck])):
            drawing.shown(when, words(word, _WIDTH - 20.0, 22.0, colour="ink", anchor="end"))
        drawing.fixed(f'<path d="M{wall:.1f} {top - 50:.1f} V{floor:.1f}" {_line(4)}/>')
        self._spring(drawing, x2 + 0.8 * unit, wall, top - 25.0)
        if self.motion.model.damping > 0.0:
            self._damper(drawing, x2 + 0.8 * unit, wall, top - 8.0)
        if not self.belt:
            self._crank(drawing, frames, x1 - 1.8 * unit)

    def _spring(self, drawing: Moving, left: Array, wall: float, height: float) -> None:
        turns = np.array([0.0, 0.12, *np.linspace(0.17, 0.83, 11), 0.88, 1.0])
        side = np.array([0.0, 0.0, *(8.0 * (-1.0) ** k for k in range(11)), 0.0, 0.0])
        frames = [np.stack([x + turns * (wall - x), height + side], -1) for x in left]
        drawing.path(frames, _line(1.5))

    def _damper(self, drawing: Moving, left: Array, wall: float, height: float) -> None:
        body = 0.55 * (wall - float(left.min()))
        start = wall - 0.3 * (wall - float(left.max())) - body
        cup = f"M{start + body:.1f} {height - 6:.1f} H{start:.1f} V{height + 6:.1f} H{start + body:.1f}"
        drawing.fixed(f'<path d="M{wall:.1f} {height:.1f} H{start:.1f} {cup}" {_line(1.2)}/>')
        piston = [np.array([[x, height], [start + 0.5 * body + 0.5 * (x - left.mean()), height]]) for x in left]
        drawing.path(piston, _line(1.2))

    def _crank(self, drawing: Moving, frames: NDArray[np.intp], pin: Array) -> None:
        """Crank and rod to scale, or for a pure cosine only the arrow of the drive."""
        height = self.floor - 20.0
        if not self.rod:
            arrow = np.array([[-26.0, 0.0], [0.0, 0.0], [-7.0, -5.0], [0.0, 0.0], [-7.0, 5.0]])
            drawing.path([arrow + np.array([x, height]) for x in pin], _line(1.6))
            return
        angle = self.drive.speed * self.motion.t[frames]
        centre = pin[0] - self.scale * (self.rod + float(self.motion.x1[frames][0]))
        radius = self.scale * self.radius
        tip = np.stack([centre + radius * np.cos(angle), height - radius * np.sin(angle)], -1)
        end = np.stack([pin, np.full_like(pin, height)], -1)
        drawing.fixed(
            f'<circle cx="{centre:.1f}" cy="{height:.1f}" r="{radius:.1f}" '
            f'{painted(stroke="soft")} stroke-dasharray="2 4"/>'
        )
        middle = np.broadcast_to([centre, height], tip.shape)
        drawing.path(np.stack([middle, tip], 1), _line(5))
        drawing.path(np.stack([tip, end], 1), _line(2.4))
        for points in (middle, tip, end):
            drawing.circle(points, 4.0, painted("paper", "ink", 1.6))

    def names(self, drawing: Moving, k: int) -> None:
        """Name the parts."""
        unit, floor = self.scale * self.reach, self.floor
        x1, x2 = (float(x[k]) for x in (self.at(self.motion.x1), self.at(self.motion.x2)))
        model = self.motion.model
        spring = f"{model.stiffness:g} N/m" + (f", {model.damping:g} N s/m" if model.damping else "")
        named = [
            (x2, floor - 76.0, f"upper platform, {model.mass:g} kg", "middle"),
            (self.zero + 2.2 * unit, floor - 92.0, spring, "middle"),
        ]
        if self.belt:
            named.append((60.0, floor + 26.0, "belt", "start"))
        else:
            named.append((x1, floor + 26.0, "lower platform", "middle"))
            crank = self.zero - 1.8 * unit - self.scale * self.rod, floor - 32.0 - self.scale * self.radius
            named.append((*crank, "crank and rod", "middle") if self.rod else (24.0, floor + 26.0, "cosine", "start"))
        for x, y, text, anchor in named:
            drawing.fixed(words(text, x, y, anchor=anchor))


def _curves(drawing: Moving, motion: StickSlipMotion, known: NDArray[np.intp], chosen: NDArray[np.intp]) -> None:
    """Add displacements over time with a line that runs along."""
    t = motion.t
    shown = [(motion.x2, "b")] if not math.isfinite(motion.model.drive.period) else [(motion.x1, "a"), (motion.x2, "b")]
    largest = max(float(np.nanmax(np.abs(x))) for x, _ in shown) or 1.0
    left, width, middle = 64.0, _WIDTH - 84.0, _SCENE + 0.5 * _CURVES

    def place(times: Any, x: Any) -> Array:
        along = left + width * (np.asarray(times) - t[0]) / float(t[-1] - t[0])
        return np.stack([along, middle - 0.46 * _CURVES * np.asarray(x) / largest], -1)

    thin = known[np.linspace(0, known.size - 1, min(known.size, 600)).round().astype(int)]
    axis = (
        f"M{left:.1f} {middle - 0.5 * _CURVES:.1f} V{middle + 0.5 * _CURVES:.1f} M{left:.1f} {middle:.1f} h{width:.1f}"
    )
    drawing.fixed(f'<path d="{axis}" {_line(1.0, "soft")}/>')
    for x, colour in shown:
        data = "M" + " L".join(f"{a:.1f} {b:.1f}" for a, b in place(t[thin], x[thin]))
        drawing.fixed(f'<path d="{data}" {painted(stroke=colour, width=1.6)}/>')
        drawing.circle(place(t[chosen], x[chosen]), 4.0, painted(colour))
    label = f"{1e3 * largest:.3g} mm"
    for text, y in ((label, middle - 0.46 * _CURVES), (f"-{label}", middle + 0.46 * _CURVES)):
        drawing.fixed(words(text, left - 5.0, y + 4.0, size=12.0, anchor="end"))
    for k in range(6):
        time = f"{t[0] + (t[-1] - t[0]) * k / 5.0:.3g} s"
        drawing.fixed(words(time, left + width * k / 5.0, _SCENE + _CURVES + 20.0, size=12.0, anchor="middle"))
