"""The symbols of a kinematic diagram: what is drawn for every link, joint, driver and named point, and their letters.

Each function adds the shapes of one kind of part to the sketch of a plan, fixed to the link they belong to; numbers of
links and names of points stand beside their link, away from everything else.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from graphsynth.drawing.bodies import Guide, LinkBody, outline, rounded, thickness, world
from graphsynth.drawing.palette import TRACE_COLOURS
from graphsynth.drawing.shapes import FIXED, Circle, Path
from graphsynth.drawing.sketch import Sketch
from graphsynth.mechanism.joints import Cam, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]

BLOCK = 13.0  # half length of a slider's block, pixels
_HALF = 8.0  # its half width
_SLOT = 6.5  # half width of a slot
_THIN = 12.0  # plates thinner than this are drawn with room around their joints
_ROUND = 9.0


@dataclass(frozen=True, slots=True)
class Plan:
    """What the parts of a diagram share."""

    mechanism: Mechanism
    poses: Array
    sketch: Sketch
    bodies: list[LinkBody]
    grounded: bool

    @property
    def px(self) -> float:
        """One symbol pixel in the units of the mechanism."""
        return self.sketch.pixel * self.sketch.symbol

    def fixed(self, link: int) -> bool:
        """Whether a link is drawn as ground."""
        return self.grounded and link == self.mechanism.frame

    def colour(self, link: int) -> str:
        """Ink of a link: driven links stand out."""
        frame = self.mechanism.frame
        driven = any(d.link == link or (d.base == link != frame and d.link == frame) for d in self.mechanism.drivers)
        return "b" if driven and self.grounded else "link"


def draw_traces(plan: Plan) -> None:
    """Draw the path of every named point over the poses, at the back."""
    for k, (name, (link, at)) in enumerate(plan.mechanism.points.items()):
        path = world(plan.poses, link, complex(*at))
        if abs(path - path[0]).max() > plan.px:
            plan.sketch.on(layer="trace", part=f"path {name}")
            plan.sketch.trace(path.tolist(), TRACE_COLOURS[k % len(TRACE_COLOURS)], 2.0)


def draw_link(plan: Plan, body: LinkBody) -> None:
    """Pitch circles, guides, and the bar or plate that joins what is attached."""
    sketch, link = plan.sketch, body.link
    for centre, radius, gear in body.wheels:
        part = f"gear {gear.a}-{gear.b} of {link}"
        sketch.on(link, "pitch", part)
        sketch.circle(centre, radius, "link" if plan.fixed(link) else "soft")
        if gear.internal and radius == max(gear.radius_a, gear.radius_b):
            sketch.circle(centre, radius + 7.0 * plan.px, "soft", dash=())
        if not plan.fixed(link):  # a spoke shows the turn
            rim = radius * cmath.exp(0.5j)
            sketch.line((centre + 0.8 * rim, centre + rim), "soft", 2.2)
        sketch.on(link, "joint", f"centre {part}")
        for d in (4.0 * plan.px, 4j * plan.px):
            sketch.line((centre - d, centre + d), "link", 1.2)
        if plan.fixed(link):  # a wheel that does not turn: hatching inside the lower part of its rim
            sketch.on(link, "ground", "ground of a wheel")
            for k in range(7):
                rim = centre + radius * cmath.exp(1j * math.radians(-120 + 10 * k))
                sketch.line((rim, rim + (0.6 + 1j) * 7.0 * plan.px), "link", 1.4)
    for cam, curve in body.cams:
        sketch.on(link, "pitch", f"cam {cam.a}-{cam.b}")
        sketch.plate(curve, plan.colour(link), 2.0, 0.8)
    for guide in body.guides:
        if isinstance(guide.joint, Prismatic) and not plan.fixed(link):
            sketch.on(link, "bar", f"guide {guide.joint.a}-{guide.joint.b}")
            sketch.bar(guide.start, guide.stop, plan.colour(link), 4.0)
    if plan.fixed(link):
        return
    corners = outline(body.vertices(), 2.0 * plan.px)
    if len(corners) > 1 and body.joints > 2 and thickness(corners) < _THIN * plan.px:
        # a bar would look like several links that meet at a joint
        sketch.on(link, "plate", f"link {link}")
        sketch.plate(rounded(corners, _ROUND * plan.px), plan.colour(link), 2.0, 0.8)
    elif len(corners) > 2:
        sketch.on(link, "plate", f"link {link}")
        sketch.plate(corners, plan.colour(link), 2.6, 0.8)
    elif len(corners) == 2:
        sketch.on(link, "bar", f"link {link}")
        sketch.bar(corners[0], corners[1], plan.colour(link), 4.0)


def draw_slider(plan: Plan, joint: Prismatic | PinSlot) -> None:
    """Draw a block on its guide, or a slot; ground where the frame is one of the two."""
    sketch, px = plan.sketch, plan.px
    guide = next(g for g in plan.bodies[joint.a].guides if g.joint is joint)
    name = f"{joint.a}-{joint.b}"
    if isinstance(joint, PinSlot):
        sketch.on(joint.a, "block", f"slot {name}")
        ends = [(guide.stop, -0.5), (guide.start, 0.5)]  # round
        slot = [
            end + _SLOT * px * guide.direction * cmath.exp(1j * math.pi * (first + k / 8))
            for end, first in ends
            for k in range(9)
        ]
        sketch.outline(slot, plan.colour(joint.a), 1.8)
        if plan.fixed(joint.a):
            _guide_ground(plan, guide, _SLOT + 1.0)
        return
    t = cmath.exp(1j * joint.angle_b)
    sketch.on(joint.b, "block", f"block {name}")
    middle = complex(*joint.at_b)
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    corners = [middle + t * (x * BLOCK * px + 1j * y * _HALF * px) for x, y in signs]
    sketch.outline(corners, plan.colour(joint.b))
    if plan.fixed(joint.a):
        _guide_ground(plan, guide, _HALF + 1.5)
    elif plan.fixed(joint.b):
        sketch.on(joint.b, "ground", f"ground {name}")
        down = _downward(t)
        foot = middle + down * (_HALF + 1.0) * px
        sketch.hatch(foot - t * BLOCK * px, foot + t * BLOCK * px, down * px, 4)


def _downward(t: complex) -> complex:
    """Return the normal of a direction that points down (to the right of an upright direction)."""
    normal = -1j * t
    return normal if normal.imag < -1e-9 or (abs(normal.imag) <= 1e-9 and normal.real > 0) else -normal


def _guide_ground(plan: Plan, guide: Guide, aside: float) -> None:
    down = _downward(guide.direction)
    shift = down * aside * plan.px
    strokes = max(4, round(abs(guide.stop - guide.start) / (9.0 * plan.px)))
    plan.sketch.on(guide.joint.a, "ground", f"ground {guide.joint.a}-{guide.joint.b}")
    plan.sketch.hatch(guide.start + shift, guide.stop + shift, down * plan.px, strokes)


def draw_joints(plan: Plan) -> list[tuple[complex, complex]]:
    """Draw every revolute joint and pin once; return where ground stands and which way it points."""
    sketch = plan.sketch
    grounds: list[tuple[complex, complex]] = []
    for joint in plan.mechanism.joints:
        name = f"{joint.a}-{joint.b}"
        if isinstance(joint, Revolute):
            at = complex(*joint.at_a)
            links = (joint.a, joint.b)
            if any(map(plan.fixed, links)):
                own, other = (joint.a, joint.b) if plan.fixed(joint.a) else (joint.b, joint.a)
                at = complex(*(joint.at_a if own == joint.a else joint.at_b))
                if all(abs(at - place) > plan.px for place, _ in grounds):  # a multiple joint stands on one
                    down = _ground_direction(plan, at, other)
                    grounds.append((at, down))
                    sketch.on(own, "ground", f"ground {name}")
                    sketch.ground(at, direction=down, joint=False)
                sketch.on(own, "joint", f"joint {name}")
            else:
                sketch.on(joint.a, "joint", f"joint {name}")
            sketch.joint(at)
        elif isinstance(joint, PinSlot):
            pin = complex(*joint.at_b)
            if plan.fixed(joint.b):
                sketch.on(joint.b, "ground", f"ground {name}")
                sketch.ground(pin, joint=False)
                grounds.append((pin, -1j))
            sketch.on(joint.b, "joint", f"joint {name}")
            sketch.joint(pin, 4.0)
        elif isinstance(joint, Cam):
            sketch.on(joint.b, "joint", f"roller {name}")
            sketch.joint(complex(*joint.at_b), 6.5)
            sketch.dot(complex(*joint.at_b), "link", 1.8)
    return grounds


def _ground_direction(plan: Plan, at: complex, link: int) -> complex:
    """Return down, unless the link jointed there lies that way most of the time: then aside or up."""
    own = plan.bodies[link].vertices()
    ways = np.concatenate([world(plan.poses, link, p) for p in own]) - at if own else np.zeros(0, np.complex128)
    ways = ways[abs(ways) > 2.0 * plan.px]
    if ways.size == 0:
        return -1j
    units = ways / abs(ways)

    def cost(d: complex) -> float:
        return float(np.maximum((units * d.conjugate()).real, 0.0).mean()) + {-1j: 0.0, 1j: 0.25}.get(d, 0.3)

    return min((-1j, 1j, -1 + 0j, 1 + 0j), key=cost)


def draw_arrow(plan: Plan, driver: Driver, grounds: list[tuple[complex, complex]]) -> None:
    """Sense of a driver: an arc around a revolute joint, a straight arrow beside a slider."""
    joint = plan.mechanism.joint(*driver.pair)
    rate = np.asarray(driver.law(np.array([0.0, 1.0]))[1], dtype=np.float64)
    sense = -1.0 if np.isfinite(rate[0]) and rate[0] < 0.0 else 1.0
    sketch, px = plan.sketch, plan.px
    part = f"driver {driver.base}-{driver.link}"
    if isinstance(joint, Revolute):
        at = complex(*(joint.at_a if joint.a == driver.base else joint.at_b))
        down = next((d for p, d in grounds if p == at and driver.base == plan.mechanism.frame), -1j)
        sketch.on(driver.base, "mark", part)
        arc = [at + 19.0 * px * -down * cmath.exp(1j * sense * math.radians(-80 + 10 * k)) for k in range(17)]
        sketch.trace(arc, "b", 2.4)
        _head(plan, arc[-1], (arc[-1] - at) * 1j * sense)
    elif isinstance(joint, Prismatic):
        sense = sense if driver.base == joint.a else -sense
        t = cmath.exp(1j * joint.angle_b) * sense
        foot = complex(*joint.at_b) - _downward(t) * 15.0 * px - t * 12.0 * px
        sketch.on(joint.b, "mark", part)
        sketch.trace([foot, foot + t * 24.0 * px], "b", 2.4)
        _head(plan, foot + t * 24.0 * px, t)


def _head(plan: Plan, tip: complex, along: complex) -> None:
    t = along / abs(along) * 9.0 * plan.px
    plan.sketch.line((tip - t + 0.6j * t, tip + 0.25 * t, tip - t - 0.6j * t), "b", 2.4)


def draw_points(plan: Plan) -> None:
    """Draw a dot at every named point, in the colour of its path."""
    for k, (name, (link, at)) in enumerate(plan.mechanism.points.items()):
        plan.sketch.on(link, "mark", f"point {name}")
        plan.sketch.dot(complex(*at), TRACE_COLOURS[k % len(TRACE_COLOURS)], 4.2)


Complex = NDArray[np.complex128]

_SAMPLES = 12  # poses looked at


class _Room:
    """What letters must keep away from, over some poses of a motion; distances in pixels."""

    def __init__(self, poses: Array, pixel: float) -> None:
        pick = np.unique(np.linspace(0, len(poses) - 1, min(_SAMPLES, len(poses))).round().astype(int))
        chosen = poses[pick]
        self.pixel, self.count = pixel, len(chosen)
        self.at, self.turn = chosen[..., 0] + 1j * chosen[..., 1], np.exp(1j * chosen[..., 2])
        self.taken: list[Complex] = []  # each of shape (points, poses)
        self.own: list[int] = []  # the link of each point of all that may come near

    def _world(self, link: int, points: Sequence[complex]) -> Complex:
        """Carry points of a link to the plane, shape (points, poses)."""
        return np.asarray(self.at[:, link] + self.turn[:, link] * np.array(points, dtype=np.complex128)[:, None])

    def add(self, link: int, points: Sequence[complex], own: int = -1) -> None:
        """Keep letters away from points of a link; those of link ``own`` may come near."""
        if points:
            self.taken.append(self._world(link, points))
            self.own += [own] * len(points)

    def clearances(self, link: int, points: Sequence[complex], own: int) -> list[float]:
        """Distances of points to the nearest thing, at most 22 pixels: the worst pose and the mean count half each."""
        others = np.concatenate([np.empty((0, self.count), dtype=np.complex128), *self.taken])
        others = others[np.array(self.own, dtype=np.intp) != own]
        gaps = np.abs(self._world(link, points)[:, None] - others) / self.pixel
        near: Array = gaps.min(axis=1, initial=22.0)
        return list((0.5 * near.min(axis=1) + 0.5 * near.mean(axis=1)).tolist())

    def best(self, link: int, candidates: Sequence[complex], own: int = -2) -> complex:
        """Choose the first of the freest candidates, and take it; things of link ``own`` may be near."""
        scores = [clear - 0.4 * k for k, clear in enumerate(self.clearances(link, candidates, own))]
        chosen = candidates[scores.index(max(scores))]
        self.add(link, [chosen + d * self.pixel for d in (5, -5, 5j, -5j)])
        return chosen


def place_letters(plan: Plan, grounds: list[tuple[complex, complex]], numbers: bool) -> None:
    """Write the names of points and the numbers of links; the letters move with their link and stay upright."""
    sketch, mechanism, px = plan.sketch, plan.mechanism, plan.px
    room = _Room(plan.poses, px)
    for shape in sketch.shapes:
        if isinstance(shape, Circle):
            room.add(shape.link, [shape.centre])
        elif isinstance(shape, Path) and shape.link != FIXED:  # paths of points may be covered
            own = shape.link if shape.layer in ("plate", "bar", "block") else -1
            for run in shape.runs:
                room.add(shape.link, _along([*run, *run[: int(shape.closed)]], 9.0 * px), own)
    ways = [r * px * cmath.exp(1j * math.radians(45 * k)) for r in (15.0, 23.0) for k in (1, 3, 2, 0, 4, 7, 5, 6)]
    for name, (link, local) in mechanism.points.items():
        at = room.best(link, [complex(*local) + way for way in ways])
        sketch.on(link, "label", f"name {name}").label(at, name, size=14.0 * sketch.symbol)
    if not numbers:
        return
    for body in plan.bodies:
        if plan.fixed(body.link):
            spots = [at + down * 20.0 * px + s * 1j * down * 27.0 * px for at, down in grounds for s in (1, -1)]
            spots = spots or [g.start - g.direction * 14.0 * px for g in body.guides] or [0j]
        else:
            spots = _beside(body, px)
        sketch.on(body.link, "label", f"number {body.link}")
        sketch.label(room.best(body.link, spots, body.link), str(body.link), colour="note", size=13.0 * sketch.symbol)


def _along(run: Sequence[complex], step: float) -> list[complex]:
    """Points along a line, at most a step apart."""
    found = list(run[:1])
    for p, q in pairwise(run):
        count = min(40, max(1, math.ceil(abs(q - p) / step)))
        found += [p + (q - p) * k / count for k in range(1, count + 1)]
    return found


def _beside(body: LinkBody, px: float) -> list[complex]:
    """Candidates for a number: inside a wide plate, beside the longest side of another link, above a block."""
    corners = outline(body.vertices(), 2.0 * px)
    if len(corners) > 2 and thickness(corners) > 26.0 * px:
        middle = sum(corners) / len(corners)
        return [middle, *((0.55 * middle + 0.45 * corner) for corner in corners)]
    if len(corners) > 1:
        p, q = max(pairwise([*corners, corners[0]]), key=lambda side: abs(side[1] - side[0]))
        thin = thickness(corners) < 12.0 * px
        aside = -1j * (q - p) / abs(q - p) * (18.0 if thin and body.joints > 2 else 12.0) * px
        sides = (1, -1, 1.7, -1.7) if thin else (1,)  # corners run anticlockwise: the outside of a plate comes first
        return [p + (q - p) * s + side * aside for side in sides for s in (0.5, 0.36, 0.64, 0.22, 0.78)]
    at = corners[0] if corners else 0j
    return [at + 24.0 * px * d for d in (0.8j, -0.8j, 1, -1, 0.8 + 0.8j, -0.8 + 0.8j)]
