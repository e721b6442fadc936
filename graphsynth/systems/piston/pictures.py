"""Pictures of a crank drive with a floating piston: diagram, motion, side loads, reactions, gas force, animation.

Diagrams are SVG, or a :class:`~graphsynth.drawing.sketch.Sketch`; curves are :class:`~graphsynth.drawing.plots.Chart`.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.plots import Chart, Line, Mark
from graphsynth.drawing.sketch import Sketch, degrees
from graphsynth.kinematics.engine.result import Motion
from graphsynth.systems.piston.machine import PistonMachine
from graphsynth.systems.piston.model import FloatingPiston

Array = NDArray[np.float64]

_TURN = np.linspace(0.0, 2.0 * math.pi, 721)
_TICKS = tuple(range(0, 361, 45))
_NAME = "crank angle [°]"
_ORDERS = (("displacement", "mm"), ("velocity", "mm/rad"), ("acceleration", "mm/rad²"))


def piston_sketch(machine: FloatingPiston, angle: float, *, width: float = 640.0, numbers: bool = True) -> Sketch:
    """Kinematic diagram at one crank angle: cylinder with its head, piston, slot, crosshead on its guide, crank.

    All dimensions are true; the piston's stem, the shoe of the guide and the bore are drawn as long as looks well.
    `width` in pixels; `numbers` writes the numbers of the links.

    Examples
    --------
    >>> from graphsynth.systems.piston.model import FloatingPiston
    >>> piston_sketch(FloatingPiston.crank_slider(0.05, 0.2, lead=0.08), 1.0).svg().startswith("<svg")
    True
    """
    return _Drawing(machine, float(angle), width, numbers).sketch


class _Drawing:
    """One diagram; lengths that are only drawn are in units of the crank."""

    def __init__(self, machine: FloatingPiston, angle: float, width: float, numbers: bool) -> None:
        drive, group = machine.drive, machine.group
        self.machine, self.numbers, self.r = machine, numbers, drive.crank
        r = self.r
        self.slider = drive.kind == "RRP"
        self.pin = r * cmath.exp(1j * angle)
        motion = machine.motion(angle)
        self.offset = 1j * drive.offset
        self.crosshead = complex(float(motion.crosshead.value)) + self.offset
        self.dead = machine.dead_centres()
        self.axis = 1.0 + 0j if group is None else cmath.exp(1j * group.cylinder_angle)
        self.base = self.offset + (0.0 if group is None else 1j * group.cylinder_offset)
        self.place = float(motion.piston.value)
        ahead = 0.0 if group is None else max(group.lead, 0.0)
        self.shoe = 0.0 if self.slider or group is None else min(2.5 * r, 0.75 * ahead)
        self.stem = (1.1 if group is not None else 0.0 if self.slider else 3.0) * r
        ends = [self._on_axis(dead.piston + self.stem + side) for dead, side in zip(self.dead, (0.75 * r, -0.75 * r))]
        reach = [self.base + self.axis * 0.0, *(end + side * r * 0.6 for end in ends for side in (1j, -1j))]
        reach += [1.15 * r * (1 + 1j), -1.15 * r * (1 + 1j), self.offset - 0.5j * r]
        if not self.slider:
            reach += [2.0 * r * 1j + self.offset, -2.0 * r * 1j + self.offset, -1.4 * r + 0j]
        if group is not None:
            reach += [self._slot_end(sense) for sense in (1.0, -1.0)]
        low = complex(min(p.real for p in reach), min(p.imag for p in reach))
        high = complex(max(p.real for p in reach), max(p.imag for p in reach))
        what = "slider-crank" if self.slider else "Scotch yoke"
        title = f"{what} {'with' if group is not None else 'without'} floating piston, crank at {degrees(angle)}"
        self.sketch = Sketch(low, high, width, 26.0, title, symbol=min(1.0, width / 560.0))
        self._draw()

    def _on_axis(self, t: float) -> complex:
        return self.base + t * self.axis

    def _slot_end(self, sense: float, at: complex | None = None) -> complex:
        """End of the crosshead's slot; at the outer dead centre by default."""
        group = self.machine.group
        assert group is not None
        where = self.dead[0].crosshead + self.offset if at is None else at
        ways = [float(v) for v in self.machine.motion([dead.angle for dead in self.dead]).slot.value]
        middle, half = 0.5 * (max(ways) + min(ways)), 0.5 * (max(ways) - min(ways)) + 0.55 * self.r
        return where + group.lead + (middle + sense * half) * cmath.exp(1j * group.slot_angle)

    def _draw(self) -> None:
        r = self.r
        if self.machine.group is not None:  # ground under the shoe of the crosshead, as long as its travel
            start, stop = (dead.crosshead + self.shoe for dead in (self.dead[1], self.dead[0]))
            self._hatched(self.offset + start - (0.5 + 0.2j) * r, self.offset + stop + (0.5 - 0.2j) * r)
        # the cylinder: two walls and the head
        near = self._on_axis(self.dead[1].piston + self.stem - 0.45 * r)
        far = self._on_axis(self.dead[0].piston + self.stem + 0.5 * r)
        side = 0.47j * r * self.axis
        for one, other in pairwise((near - side, far - side, far + side, near + side)):
            self._hatched(one, other)
        head = self.crosshead + (0.0 if self.slider else self.stem)
        self._piston_head(head if self.machine.group is None else self._on_axis(self.place + self.stem))
        self._crosshead()
        self._first_links()
        if self.numbers:
            self._letters()

    def _block(self, centre: complex, along: complex, length: float, width: float, filled: bool = False) -> None:
        half, across = 0.5 * length * self.r * along, 0.5j * width * self.r * along
        corners = [centre + half + across, centre - half + across, centre - half - across, centre + half - across]
        (self.sketch.plate if filled else self.sketch.outline)(corners, width=2.0)

    def _hatched(self, start: complex, end: complex) -> None:
        """Ground to the right of the way from start to end."""
        down = -1j * (end - start) / abs(end - start) * self.sketch.pixel * self.sketch.symbol
        strokes = max(5, round(abs(end - start) * self.sketch.scale / 13.0))
        self.sketch.hatch(start, end, down, strokes)

    def _piston_head(self, centre: complex) -> None:
        """Piston in the cylinder and its stem."""
        self.sketch.on(layer="bar")
        if self.machine.group is not None:
            self.sketch.bar(self._on_axis(self.place), centre)
        elif not self.slider:
            self.sketch.bar(self.crosshead, centre)
        self.sketch.on(layer="block")
        self._block(centre, self.axis, 0.6, 0.86, filled=True)
        self.sketch.on()

    def _crosshead(self) -> None:
        """Crosshead with its shoe and, for the second group, the slot with the block of the piston in it."""
        group = self.machine.group
        if group is not None:
            self.sketch.on(layer="bar")
            self.sketch.bar(self.crosshead, self.crosshead + group.lead)
            slot = cmath.exp(1j * group.slot_angle)
            head, foot = (self._slot_end(sense, self.crosshead) for sense in (1.0, -1.0))
            self.sketch.on(layer="block")
            self._block(0.5 * (head + foot), slot, abs(head - foot) / self.r, 0.32)
            self._block(self._on_axis(self.place), slot, 0.42, 0.3, filled=True)
            self._block(self.crosshead + self.shoe, 1.0 + 0j, 0.7, 0.4)
        self.sketch.on()

    def _first_links(self) -> None:
        """Crank, and rod or block in the yoke."""
        sketch = self.sketch
        if self.slider:
            sketch.on(layer="joint")
            sketch.bar(self.pin, self.crosshead)
            sketch.joint(self.crosshead)
        else:
            along = cmath.exp(1j * self.machine.drive.yoke_angle)  # type: ignore[union-attr]
            sketch.on(layer="plate")
            self._block(self.crosshead, along, 3.5 / along.imag, 0.4)
            sketch.on(layer="bar")
            sketch.bar(self.crosshead, self.crosshead + self.shoe)
            sketch.on(layer="joint")
            self._block(self.pin, along, 0.6, 0.4, filled=True)
        sketch.on(layer="joint")
        sketch.bar(0j, self.pin, colour="b")
        sketch.joint(self.pin)
        sketch.ground(0j)
        sketch.on()

    def _letters(self) -> None:
        """Numbers of the links, beside their middles."""
        sketch = self.sketch
        sketch.on(layer="label")
        across = 1j * self.pin / abs(self.pin)
        sketch.label(0.5 * self.pin, "1", 13 * across, colour="note")
        if self.slider:
            rod = self.crosshead - self.pin
            sketch.label(self.pin + 0.35 * rod, "2", 13j * rod / abs(rod), colour="note")
        else:
            sketch.label(self.pin, "2", -20 + 0j, colour="note")
        group = self.machine.group
        if group is not None:
            sketch.label(self._slot_end(1.0, self.crosshead), "3", 11j, colour="note")
            sketch.label(self._on_axis(self.place + self.stem), "4", 0j, colour="note")
        else:
            # beside the pin of a slider-crank's piston, in the middle of a yoke's
            at = self.crosshead + (0.17 * self.r if self.slider else self.stem)
            sketch.label(at, "3", 0j, colour="note")
        sketch.on()


def piston_motion_chart(machine: FloatingPiston, order: int = 0) -> Chart:
    """Displacement, velocity or acceleration (`order`) of piston, and of crosshead and slot where they differ.

    Over a turn; derivatives are by the crank angle, displacements count from the inner dead centre.  A `GeometryError`
    refuses another order.
    """
    if order not in (0, 1, 2):
        raise GeometryError(f"order = {order} must be 0, 1 or 2: displacement, velocity or acceleration")
    motion, inner = machine.motion(_TURN), machine.dead_centres()[1]
    x = np.degrees(_TURN)
    lines = [Line(x, 1e3 * (motion.piston[order] - (inner.piston if order == 0 else 0.0)), "piston", "a")]
    if machine.group is not None:
        own = motion.crosshead[order] - (inner.crosshead if order == 0 else 0.0)
        lines.append(Line(x, 1e3 * own, "crosshead", "b", "--"))
        slot = motion.slot[order] - (motion.slot[0].mean() if order == 0 else 0.0)
        lines.append(Line(x, 1e3 * slot, "piston in the slot", "c", "-."))
    word, unit = _ORDERS[order]
    marks = [Mark(math.degrees(dead.angle)) for dead in machine.dead_centres()]
    return Chart(lines, _NAME, f"{word} [{unit}]", marks=marks, xticks=_TICKS)


def _unit(values: Array) -> tuple[float, str]:
    """Return 1e-3 and kN for large forces."""
    return (1e-3, "kN") if float(np.nanmax(np.abs(values), initial=0.0)) >= 2000.0 else (1.0, "N")


def side_load_chart(machine: PistonMachine, length: float | None = None) -> Chart:
    """Side load on the cylinder of the floating and of the plain piston, and the load of the crosshead's guide.

    Dotted: what static friction in a slot that does not slide may add to the floating piston's.  For a Scotch yoke,
    whose plain piston has a couple and hardly a side load, the forces at the far ends of piston and shoe: `length` is
    theirs, m, the stroke by default.  A `GeometryError` refuses a machine without a second group.
    """
    if machine.mechanism.group is None:
        raise GeometryError("the machine has no second group to compare with; give a mechanism with a FloatingGroup")
    size = machine.mechanism.stroke if length is None else length
    floating, plain = machine.loads(_TURN), machine.without_group().loads(_TURN)
    x = np.degrees(_TURN)
    slider = machine.mechanism.drive.kind == "RRP"
    with_group, without, guide = floating.wall, plain.wall, floating.guide
    if not slider:
        with_group, without, guide = floating.edges(size)[1], plain.edges(size)[1], floating.edges(size, "guide")[1]
    scale, unit = _unit(np.concatenate([without, guide, with_group]))
    lines = [
        Line(x, scale * without, "plain piston", "b", "--"),
        Line(x, scale * with_group, "floating piston", "a"),
        Line(x, scale * guide, "its crosshead", "c", "-."),
    ]
    levels = [
        Line((), sign * scale * float(floating.held.max()), "slot's friction" if sign > 0 else "", "soft", ":")
        for sign in (1.0, -1.0)
        if float(np.nanmax(floating.held)) > 0.0
    ]
    name = "side load" if slider else "force at the piston's end"
    return Chart(lines, _NAME, f"{name} [{unit}]", levels=levels, xticks=_TICKS, size=(6.4, 3.2))


def torque_chart(machine: PistonMachine) -> Chart:
    """Torque of the motor with and without the second group, and its mean."""
    x = np.degrees(_TURN)
    torque = machine.loads(_TURN).torque
    lines = [Line(x, torque, "floating piston", "a")]
    if machine.mechanism.group is not None:
        lines.append(Line(x, machine.without_group().loads(_TURN).torque, "plain piston", "b", "--"))
    mean = [Line((), float(np.nanmean(torque[:-1])), "mean", "soft", ":")]
    return Chart(lines, _NAME, "motor torque [N m]", levels=mean, xticks=_TICKS)


def reaction_chart(machine: PistonMachine) -> Chart:
    """Polar plot of the reactions over a turn: the path of the tip of every force, on equal scales.

    Forces of frame on crank, of crank on rod or block, of rod on crosshead, and of the cylinder's wall on the piston.
    """
    loads = machine.loads(_TURN)
    slider = machine.mechanism.drive.kind == "RRP"
    group = machine.mechanism.group
    normal = 1j * (1.0 if group is None else cmath.exp(1j * group.cylinder_angle))
    wall = loads.wall[:, None] * [normal.real, normal.imag]
    forces = [
        ("bearing", loads.bearing, "a", "-"),
        ("crank pin", loads.crank_pin, "b", "--"),
        *([("crosshead pin", loads.crosshead_pin, "c", "-.")] if slider else []),
        ("cylinder wall", wall, "d", "-"),
    ]
    scale, unit = _unit(np.concatenate([force for _, force, _, _ in forces]))
    lines = [Line(scale * f[:, 0], scale * f[:, 1], name, colour, style) for name, f, colour, style in forces]
    return Chart(lines, f"force along the guide [{unit}]", f"across [{unit}]", equal=True, size=(6.4, 4.2))


def indicator_chart(machine: PistonMachine) -> Chart:
    """Force of the gas over the place of the piston: its area is the work that the gas takes."""
    mechanism = machine.mechanism
    inner = mechanism.dead_centres()[1]
    place = 1e3 * (mechanism.motion(_TURN).piston.value - inner.piston)
    force = machine.gas_force(_TURN)
    scale, unit = _unit(force)
    return Chart([Line(place, scale * force)], "piston from the inner dead centre [mm]", f"gas force [{unit}]")


def piston_animation(machine: FloatingPiston, *, title: str = "", note: str = "", frames: int = 90) -> str:
    """Return one HTML page with the moving mechanism (see :func:`graphsynth.drawing.animation.animation_html`)."""
    from graphsynth.drawing.animation import animation_html

    return animation_html(_shown(machine), frames=frames, title=title, note=note, width=720.0)


def piston_animated_svg(machine: FloatingPiston, *, title: str = "", frames: int = 90) -> str:
    """Return one SVG that moves by itself (see :func:`graphsynth.drawing.animation.animated_svg`)."""
    from graphsynth.drawing.animation import animated_svg

    return animated_svg(_shown(machine), frames=frames, title=title, width=720.0, height=320.0)


def _shown(machine: FloatingPiston) -> Motion:
    motion = machine.run(np.linspace(0.0, 2.0 * math.pi, 181), "sliding")
    return replace(motion, mechanism=replace(motion.mechanism, points={}))
