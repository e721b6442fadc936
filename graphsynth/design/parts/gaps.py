"""Gaps between rounded parts that move: at samples, and proved over a whole motion.

The distance of two convex polygons is at least their separation in any direction n, ``min over corners (q - p) . n``
(theory/parts 2).  So a proof needs no exact distance: n comes from floating point, and over a short interval of inputs
the separation in that direction changes by the corners' velocities along n, to first order, and by bounds of second
order.  Poses lie in the proved moving boxes of `graphsynth.kinematics.certify`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.parts.outline import Rounded

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.intp]

#: Rounding errors of a separation: fewer than 1000 operations on coordinates of at most this size, times that.
_ROUNDING = 1e-12
#: Bisections of a moving box, and intervals looked at for one pair.
_DEPTH, _MOST = 30, 200_000


class Solid(NamedTuple):
    """What keeps its shape: a rounded polygon in the frame of a link."""

    link: int
    shape: Rounded


@dataclass(frozen=True, eq=False)
class Tube:
    """Poses over a range of inputs: N moving boxes ``x + V (u - u_mid)``, each within ``u_rad`` and ``radius``.

    ``u_mid``, ``u_rad`` (N,); ``x``, ``V``, ``radius`` (N, links, 3); lengths in millimetres.
    """

    u_mid: Array
    u_rad: Array
    x: Array
    V: Array
    radius: Array

    def poses(self, count: int = 5) -> Array:
        """Return so many poses of each box, those of its centre along the inputs."""
        steps = np.linspace(-1.0, 1.0, count)[:, None] * self.u_rad
        return np.asarray(self.x + self.V * steps[:, :, None, None]).reshape(-1, *self.x.shape[1:])


class Found(NamedTuple):
    """What is known about two bodies: ``status`` "free", "hit" or "undecided", a gap, and the input it belongs to."""

    status: str
    gap: float
    input: float


def corners(body: Solid, poses: Array) -> Complex:
    """Corners of a body at poses (N, links, 3), shape (N, k)."""
    pose = poses[:, body.link]
    return np.asarray(
        (pose[:, 0] + 1j * pose[:, 1])[:, None] + np.exp(1j * pose[:, 2])[:, None] * np.array(body.shape.hull)
    )


def apart(one: Sequence[complex], other: Sequence[complex]) -> float:
    """Distance of two convex polygons; 0 if they meet."""
    return float(distances(np.array([one]), np.array([other]))[0][0])


def gaps(a: Solid, b: Solid, poses: Array) -> Array:
    """Gap between two bodies at poses; minus both radii where the polygons meet."""
    found: Array = distances(corners(a, poses), corners(b, poses))[0]
    return found - a.shape.radius - b.shape.radius


def distances(A: Complex, B: Complex) -> tuple[Array, Complex]:
    """Distance of convex polygons with corners (N, k) and (N, m), and the unit vector from A to B (1 if they meet)."""
    forth, back = _to_edges(A, B), -_to_edges(B, A)
    ways = np.concatenate([forth, back], axis=1)
    nearest = ways[np.arange(len(ways)), np.abs(ways).argmin(axis=1)]
    size = np.where(_meet(A, B), 0.0, np.abs(nearest))
    towards = np.where(size > 0.0, nearest, 1.0) / np.where(size > 0.0, np.abs(nearest), 1.0)
    return np.asarray(size), np.asarray(towards)


def _to_edges(A: Complex, B: Complex) -> Complex:
    """Shortest ways from the corners of A to the edges of B, shape (N, k m)."""
    start, along = B[:, None, :], (np.roll(B, -1, axis=1) - B)[:, None, :]
    offset = A[:, :, None] - start
    square = np.abs(along) ** 2
    t = np.clip((along.conj() * offset).real / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    return np.asarray((t * along - offset).reshape(len(A), -1))


def _meet(A: Complex, B: Complex) -> NDArray[np.bool_]:
    """Whether edges cross, or one polygon holds a corner of the other."""
    a, b = (np.roll(A, -1, axis=1) - A)[:, :, None], (np.roll(B, -1, axis=1) - B)[:, None, :]
    offset = B[:, None, :] - A[:, :, None]
    turn = (a.conj() * b).imag
    with np.errstate(all="ignore"):
        s, t = (offset.conj() * b).imag / turn, (offset.conj() * a).imag / turn
        found = ((turn != 0.0) & (s >= 0.0) & (s <= 1.0) & (t >= 0.0) & (t <= 1.0)).any(axis=(1, 2))
    for P, Q, edge in ((A, B, a[:, :, 0]), (B, A, b[:, 0, :])):
        if P.shape[1] > 2:
            found |= ((edge.conj() * (Q[:, :1] - P)).imag >= 0.0).all(axis=1)
    return np.asarray(found)


def proved_gap(a: Solid, b: Solid, tube: Tube, need: float) -> Found:
    """Prove that two bodies stay at least ``need`` apart over a tube, or find where they do not.

    "free": proved, with a bound of the gap from below; "hit": nearer at an input, with the gap there, for every pose of
    the box; "undecided": neither, after all bisections.
    """
    both = a.shape.radius + b.shape.radius
    box, s, h = np.arange(len(tube.u_mid)), np.zeros(len(tube.u_mid)), tube.u_rad.copy()
    least, looked, bound = np.inf, 0, np.array([-np.inf])
    for _ in range(_DEPTH):
        if box.size == 0:
            return Found("free", least, np.nan)
        looked += box.size
        if looked > _MOST:
            break
        x = tube.x[box] + tube.V[box] * s[:, None, None]
        P, Q = corners(a, x), corners(b, x)
        size, n = distances(P, Q)
        blur = _blur(a, x, tube, box) + _blur(b, x, tube, box)
        hit = size + blur < both + need
        if hit.any():
            k = int(np.argmin(np.where(hit, size, np.inf)))
            return Found("hit", float(size[k] - both), float(tube.u_mid[box[k]] + s[k]))
        v, w = _velocity(a, x, tube.V[box]), _velocity(b, x, tube.V[box])
        room = (n.conj()[:, None, None] * (Q[:, None, :] - P[:, :, None])).real
        speed = np.abs((n.conj()[:, None, None] * (w[:, None, :] - v[:, :, None])).real)
        wide = h * (1.0 + 1e-9) + 1e-300
        second = (_second(a, tube.V[box]) + _second(b, tube.V[box])) * wide * wide
        bound = (room - speed * wide[:, None, None]).min(axis=(1, 2)) - second - blur - both
        good = bound >= need
        least = min(least, float(bound[good].min(initial=np.inf)))
        box, s, h = _halves(box, s, h, ~good)
    return Found("undecided", float(bound.min()), float(tube.u_mid[box[0]] + s[0]))


def proved_travel(guide: Solid, line: Solid, angle: float, tube: Tube, bounds: tuple[float, float]) -> bool:
    """Whether a point (``guide``) stays within bounds along a line through a point (``line``), proved over a tube.

    By Lipschitz constants: the coordinate changes by the ways of both points and the turn of the line at most.
    """
    box, s, h = np.arange(len(tube.u_mid)), np.zeros(len(tube.u_mid)), tube.u_rad.copy()
    while box.size and len(box) < _MOST:
        V = tube.V[box]
        x = tube.x[box] + V * s[:, None, None]
        d = corners(guide, x)[:, 0] - corners(line, x)[:, 0]
        value = (np.exp(-1j * (x[:, line.link, 2] + angle)) * d).real
        wide, way = h * (1.0 + 1e-9) + 1e-300, np.zeros(len(box))
        for body in (guide, line):
            way += (
                np.abs(_velocity(body, x, V)[:, 0]) * wide + _second(body, V) * wide * wide + _blur(body, x, tube, box)
            )
        turned = np.abs(V[:, line.link, 2]) * wide + tube.radius[box, line.link, 2]
        change = way + turned * (np.abs(d) + way)
        if ((value < bounds[0]) | (value > bounds[1])).any():
            return False
        left = (value - change < bounds[0]) | (value + change > bounds[1])
        if (h[left] < 1e-12 * (1.0 + np.abs(tube.u_mid[box[left]]))).any():
            return False
        box, s, h = _halves(box, s, h, left)
    return not box.size


def _halves(box: Index, s: Array, h: Array, left: NDArray[np.bool_]) -> tuple[Index, Array, Array]:
    """Halves of the intervals that are left: their boxes, offsets and half widths."""
    half = 0.5 * h[left]
    return np.tile(box[left], 2), np.concatenate([s[left] - half, s[left] + half]), np.tile(half, 2)


def _velocity(body: Solid, x: Array, V: Array) -> Complex:
    """Velocities of the corners."""
    arm = np.exp(1j * x[:, body.link, 2])[:, None] * np.array(body.shape.hull)
    v = V[:, body.link]
    return np.asarray((v[:, 0] + 1j * v[:, 1])[:, None] + 1j * v[:, 2, None] * arm)


def _second(body: Solid, V: Array) -> Array:
    """Half the acceleration of the furthest corner: ``|exp(i t) - 1 - i t| <= t^2 / 2``."""
    return np.asarray(0.5 * V[:, body.link, 2] ** 2 * _reach(body))


def _blur(body: Solid, x: Array, tube: Tube, box: NDArray[np.intp]) -> Array:
    """How far a corner may be from where the centre of its box puts it, rounding errors included."""
    radius, reach = tube.radius[box, body.link], _reach(body)
    size = np.abs(x[:, body.link, :2]).max(axis=1) + reach + np.abs(x[:, body.link, 2])
    return np.asarray(np.hypot(radius[:, 0], radius[:, 1]) + radius[:, 2] * reach + _ROUNDING * size)


def _reach(body: Solid) -> float:
    return max(map(abs, body.shape.hull)) + body.shape.radius
