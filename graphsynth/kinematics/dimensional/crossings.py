"""Sketches of graphs that cannot be drawn without crossings: with the fewest crossings found.

Two binary links cross as diagonals of a quadrilateral, or two pairs do (why so: docs/explanation/sketching.md, "Chains
that are not planar").  Where that fails, force-directed drawings from many starts are moved at once (arrays with the
start as first axis), and that with the fewest crossings of sides is relaxed; no step may add one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations, islice
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
IntArray = NDArray[np.intp]

#: Random starts, steps of all of them, steps of the best.
_STARTS, _STEPS, _FINISH = 40, 50, 40
#: Repulsion; distance of joints from foreign sides below which a force acts, in mean sides, and its strength.
_REPEL, _CLEAR, _CLEARING = 0.35, 0.45, 1.5
_SEED = 20
#: Planarity tests at most: every choice of two pairs up to twelve links, a second for a large graph.
_TRIALS = 500


def crossing_pairs(graph: MechanismGraph, most: int = 2) -> list[tuple[int, int]]:
    """Pairs of binary links that may cross so that the rest of the drawing is plane: as few as possible.

    None is with the frame if that can be avoided; without pairs if there are none up to ``most``.
    """
    import networkx as nx

    around = [{link for link in range(graph.links) if mask >> link & 1} for mask in graph.neighbours]
    binary = [link for link in range(graph.links) if len(around[link]) == 2]
    pairs = [(a, b) for a, b in combinations(binary, 2) if b not in around[a] and not around[a] & around[b]]
    pairs.sort(key=lambda pair: graph.frame in pair)
    for count in range(1, most + 1):
        for chosen in islice(combinations(pairs, count), _TRIALS):
            flat = {link for pair in chosen for link in pair}
            if len(flat) < 2 * count:
                continue
            links = merged(graph, chosen)
            joints = {tuple(sorted((links[a], links[b]))) for a, b, _ in graph.joints}
            if len(joints) == len(graph.joints) and nx.check_planarity(nx.Graph(list(joints)))[0]:
                return list(chosen)
    return []


def merged(graph: MechanismGraph, pairs: Sequence[tuple[int, int]]) -> list[int]:
    """Return the number of every link when the two links of each pair are one."""
    first = {b: a for a, b in pairs}
    kept = [link for link in range(graph.links) if link not in first]
    number = {link: k for k, link in enumerate(kept)}
    return [number[first.get(link, link)] for link in range(graph.links)]


class _Links:
    """Which joints each link has, and the pairs of sides that may cross."""

    def __init__(self, own: list[list[int]]) -> None:
        self.own = [np.array(joints, dtype=np.intp) for joints in own if len(joints) > 1]
        self.pairs = np.array(sorted({(p, q) for joints in own for p in joints for q in joints if p < q}))
        link = [k for k, joints in enumerate(self.own) for _ in range(len(joints) if len(joints) > 2 else 1)]
        first, second = np.triu_indices(len(link), 1)
        different = np.array(link)[first] != np.array(link)[second]
        self.first, self.second = first[different], second[different]

    def sides(self, z: Complex) -> IntArray:
        """Sides of the links in the order of their outline, shape (starts, sides, 2)."""
        found = []
        for joints in self.own:
            around = np.broadcast_to(joints, (len(z), len(joints)))
            if len(joints) > 3:
                at = z[:, joints]
                turn = np.argsort(np.angle(at - at.mean(axis=1, keepdims=True)), axis=1, kind="stable")
                around = joints[turn]
            both = np.stack([around, np.roll(around, -1, axis=1)], axis=2)
            found.append(both if len(joints) > 2 else both[:, :1])
        return np.concatenate(found, axis=1)

    def crossings(self, z: Complex) -> NDArray[np.int64]:
        """Crossings of sides of different links that do not meet at a joint; one more for each reflex corner."""
        sides = self.sides(z)
        p, q = (np.take_along_axis(z, sides[:, :, end], axis=1) for end in (0, 1))
        a, b, c, d = p[:, self.first], q[:, self.first], p[:, self.second], q[:, self.second]
        meet = np.zeros(a.shape, dtype=bool)
        for i in (0, 1):
            for j in (0, 1):
                meet |= sides[:, self.first, i] == sides[:, self.second, j]
        cross = (_turn(a, b, c) * _turn(a, b, d) < 0.0) & (_turn(c, d, a) * _turn(c, d, b) < 0.0)
        found = np.asarray((cross & ~meet).sum(axis=1), dtype=np.int64)
        for joints in self.own:
            if len(joints) > 3:
                at = z[:, joints]
                turn = np.argsort(np.angle(at - at.mean(axis=1, keepdims=True)), axis=1, kind="stable")
                at = np.take_along_axis(at, turn, axis=1)
                found += (_turn(at, np.roll(at, -1, axis=1), np.roll(at, -2, axis=1)) <= 0.0).sum(axis=1)
        return found


def _turn(p: Complex, q: Complex, r: Complex) -> Array:
    """Twice the signed area of triangles."""
    u, v = q - p, r - p
    return np.asarray(u.real * v.imag - u.imag * v.real)


def fewest_crossings(own: list[list[int]], count: int) -> tuple[Complex, int]:
    """Places of joints, given those of every link, so that links cross little; and the crossings of sides.

    The springs between the joints of a link have rest length 1.  The crossings are counted exactly for the places
    returned: the fewest found, not proved least.
    """
    links = _Links(own)
    random, shape = np.random.default_rng(_SEED), (_STARTS, count)  # the same every time
    x, y = random.normal(size=shape), random.normal(size=shape)
    z: Complex = np.asarray((x + 1j * y) * (math.sqrt(count) / 2.5), dtype=np.complex128)
    for k in range(_STEPS):
        move = _force(z, links)
        z = z + move * np.minimum(0.2, 0.4 * (1.0 - k / _STEPS) / np.maximum(np.abs(move).max(axis=1), 1e-9))[:, None]
    crossings = links.crossings(z)
    fewest = np.flatnonzero(crossings == crossings.min())
    # the roomiest of them: smallest distance of two joints over the size of the picture
    first, second = np.triu_indices(count, 1)
    apart = np.abs(z[fewest][:, first] - z[fewest][:, second])
    return _finished(z[fewest[np.argmax(apart.min(axis=1) / apart.max(axis=1))]][None], links)


def _force(z: Complex, links: _Links) -> Complex:
    """Springs between the joints of a link, repulsion of all joints."""
    gap = z[:, :, None] - z[:, None, :]
    square = gap.real**2 + gap.imag**2
    square[:, range(z.shape[1]), range(z.shape[1])] = 1.0
    total: Complex = np.asarray((gap * (_REPEL / square**1.5)).sum(axis=2))
    first, second = links.pairs[:, 0], links.pairs[:, 1]
    d = z[:, second] - z[:, first]
    pull = d * (1.0 - 1.0 / np.maximum(np.abs(d), 1e-9))
    rows = np.arange(len(z))[:, None]
    np.add.at(total, (rows, first[None]), pull)
    np.add.at(total, (rows, second[None]), -pull)
    return total


def _finished(z: Complex, links: _Links) -> tuple[Complex, int]:
    """Drive joints away from foreign sides, as long as no crossing is added."""
    crossings, step = int(links.crossings(z)[0]), 0.1
    for _ in range(_FINISH):
        # drive joints away from sides they are not on
        sides = links.sides(z)[0]
        p, q = z[0, sides[:, 0], None], z[0, sides[:, 1], None]
        side, way = q - p, z - p
        share = (way.real * side.real + way.imag * side.imag) / np.maximum(side.real**2 + side.imag**2, 1e-12)
        gap = way - np.minimum(np.maximum(share, 0.0), 1.0) * side
        distance = np.maximum(np.abs(gap), 1e-9)
        push = gap * (_CLEARING * np.maximum(0.0, _CLEAR - distance) / distance)
        rows = np.arange(len(sides))
        push[rows, sides[:, 0]] = push[rows, sides[:, 1]] = 0.0
        move = _force(z, links) + push.sum(axis=0)
        tried = z + move * min(step, 0.15 / max(float(np.abs(move).max()), 1e-9))
        found = int(links.crossings(tried)[0])
        if found <= crossings:
            z, crossings, step = tried, found, min(0.2, step * 1.2)
        else:
            step *= 0.5
            if step < 1e-3:
                break
    return z[0], crossings
