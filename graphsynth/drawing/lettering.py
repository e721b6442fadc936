"""Where the numbers of links and the names of points go: beside their link, away from everything else."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from graphsynth.drawing.bodies import Body, outline, thickness
from graphsynth.drawing.sketch import Sketch
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]
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

    def clearances(self, link: int, points: Sequence[complex]) -> list[float]:
        """Distances of points to the nearest thing, at most 22 pixels: the worst pose and the mean count half each."""
        others = np.concatenate([np.empty((0, self.count), dtype=np.complex128), *self.taken])
        others = others[np.array(self.own, dtype=np.intp) != link]
        gaps = np.abs(self._world(link, points)[:, None] - others) / self.pixel
        near: Array = gaps.min(axis=1, initial=22.0)
        return list((0.5 * near.min(axis=1) + 0.5 * near.mean(axis=1)).tolist())

    def best(self, link: int, candidates: Sequence[complex]) -> complex:
        """Choose the first of the freest candidates, and take it."""
        scores = [clear - 0.4 * k for k, clear in enumerate(self.clearances(link, candidates))]
        chosen = candidates[scores.index(max(scores))]
        self.add(link, [chosen])
        return chosen


def place_letters(
    sketch: Sketch,
    mechanism: Mechanism,
    poses: Array,
    bodies: list[Body],
    grounds: list[tuple[complex, complex]],
    numbers: bool,
    grounded: bool,
) -> None:
    """Write the names of points and the numbers of links; the letters move with their link and stay upright."""
    px = sketch.pixel * sketch.symbol
    room = _Room(poses, px)
    for body in bodies:
        if not (grounded and body.link == mechanism.frame):
            room.add(body.link, _along(outline(body.vertices(), 2.0 * px), 14.0 * px), body.link)
        room.add(body.link, body.points)
        for guide in body.guides:
            room.add(body.link, _along([guide.start, guide.stop], 14.0 * px), body.link)
    frame = mechanism.frame
    for at, down in grounds:
        room.add(frame, [at + down * r * px for r in (8.0, 16.0, 23.0)])
        room.add(frame, [at + down * 18.0 * px + 1j * down * s * 12.0 * px for s in (-1, 1)])
    for driver in mechanism.drivers:
        joint = mechanism.joint(*driver.pair)
        at = complex(*(joint.at_a if joint.a == driver.base else joint.at_b))
        room.add(driver.base, [at + 19.0 * px * cmath.exp(1j * math.radians(a)) for a in range(0, 360, 45)])
    for name, (link, local) in mechanism.points.items():
        centre = complex(*local)
        ring = [centre + 15.0 * px * cmath.exp(1j * math.radians(45 * k)) for k in (1, 3, 2, 0, 4, 7, 5, 6)]
        sketch.on(link, "label", f"name {name}").label(room.best(link, ring), name, size=14.0 * sketch.symbol)
    if not numbers:
        return
    for body in bodies:
        if grounded and body.link == frame:
            spots = [at + down * 20.0 * px + s * 1j * down * 27.0 * px for at, down in grounds for s in (1, -1)]
            spots = spots or [g.start - g.direction * 14.0 * px for g in body.guides] or [0j]
        else:
            spots = _beside(body, px)
        sketch.on(body.link, "label", f"number {body.link}")
        sketch.label(room.best(body.link, spots), str(body.link), colour="note", size=13.0 * sketch.symbol)


def _along(corners: list[complex], step: float) -> list[complex]:
    """Points along the sides of a figure, at most a step apart."""
    sides = list(pairwise([*corners, corners[0]] if len(corners) > 2 else corners))
    found = []
    for p, q in sides:
        count = min(40, max(1, math.ceil(abs(q - p) / step)))
        found += [p + (q - p) * k / count for k in range(count + 1)]
    return found


def _beside(body: Body, px: float) -> list[complex]:
    """Candidates for a number: inside a wide plate, beside the longest side of another link, above a block."""
    corners = outline(body.vertices(), 2.0 * px)
    if len(corners) > 2 and thickness(corners) > 26.0 * px:
        middle = sum(corners) / len(corners)
        return [middle, *((0.55 * middle + 0.45 * corner) for corner in corners)]
    if len(corners) > 1:
        p, q = max(pairwise([*corners, corners[0]]), key=lambda side: abs(side[1] - side[0]))
        thin = thickness(corners) < 12.0 * px
        aside = -1j * (q - p) / abs(q - p) * (18.0 if thin and body.joints > 2 else 12.0) * px
        sides = (1, -1) if thin else (1,)  # corners run anticlockwise: the outside of a plate comes first
        return [p + (q - p) * s + side * aside for s in (0.5, 0.36, 0.64, 0.22, 0.78) for side in sides]
    at = corners[0] if corners else 0j
    return [at + 24.0 * px * d for d in (0.8j, -0.8j, 1, -1, 0.8 + 0.8j, -0.8 + 0.8j)]
