"""A path as a whole: distances of the curve from the outline and of the outline from the curve.

Both are cut at equal lengths; nearest points that run the same way are found anew after each step [Besl & McKay 1992],
and only the distance across counts [Chen & Medioni 1992].  Theory: docs/explanation/embodiment.md, "Closed paths".
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.task.aims import PointAim, bands
from graphsynth.design.task.model import Model, Moved, Picks, Rows, Unknowns
from graphsynth.design.task.targets import PathTarget

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Whole = NDArray[np.intp]
#: Points of about equal distance along the outline, besides its corners, and along the curve, besides the samples of
#: its motion, which are dense where it turns back; chords between two samples.
_ALONG, _EQUAL, _CHORDS = 128, 96, 4
#: Points by which a curve is placed.
_PLACED = 24
#: Steps to the nearest points of a curve.
_SLIDES = 3
#: No distance, over the size, has a direction below this one.
_NONE = 1e-9


class Polygon(NamedTuple):
    """Polygons (sets, n): corners, and the directions of the sides before and after them."""

    z: Complex
    before: Complex
    after: Complex

    @classmethod
    def of(cls, z: Complex, closed: bool = True) -> Polygon:
        """From corners; at an end of what is not closed both directions are those of its side."""
        side = np.roll(z, -1, axis=-1) - z
        after = side / np.maximum(np.abs(side), 1e-300)
        before = np.roll(after, 1, axis=-1)
        if not closed:
            before[..., 0], after[..., -1] = after[..., 0], before[..., -1]
        return cls(z, before, after)

    def foot(self, of: Complex, near: Whole) -> Complex:
        """Points nearest to others (sets, m) on the two sides at the corners ``near`` of one polygon."""
        n, found = self.z.shape[1], []
        for k in ((near - 1) % n, near):
            a, side = self.z[0, k], self.z[0, (k + 1) % n] - self.z[0, k]
            part = (np.conj(side) * (of - a)).real / np.maximum(np.abs(side) ** 2, 1e-300)
            found.append(a + np.clip(part, 0.0, 1.0) * side)
        return np.asarray(np.where(np.abs(found[0] - of) < np.abs(found[1] - of), *found))


class ContourAim(PointAim):
    """A named point draws a path, however fast; looked at at all samples of the motion.

    ``turned``: distance, over the size, that counts like an angle of a radian between directions when nearest points
    are looked for.  Points of a closed curve shall lie on the polygon but for its sagitta, an open one may go on; given
    points shall lie on the curve.
    """

    def __init__(self, model: Model, target: PathTarget, turned: float) -> None:
        super().__init__(model, 0, target, _PLACED)
        self.turned = turned * self.size
        side = np.roll(target.goal, -1) - target.goal
        parts = np.ceil(_ALONG * np.abs(side) / np.abs(side).sum()).astype(np.intp).clip(1)
        k = np.repeat(np.arange(len(side)), parts)
        part = (np.arange(len(k)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[k]
        self.outline = Polygon.of((target.goal[k] + part * side[k])[None])
        self.given = Polygon.of(target.goal[None], target.closed)
        self.band = bands(target.goal)[k]
        self.closed, n = target.closed, len(target.goal)
        self.count = _EQUAL + len(model.inputs) - 1 if self.closed else 0
        self.weight = target.weight / target.tolerance / math.sqrt(2.0 * self.count or n)
        self.heavy = math.sqrt(self.count / n) if self.closed else 1.0

    def times(self, moved: Moved, u: Unknowns, before: Array | None) -> Array:
        """Nothing is kept from step to step: as many zeros as there are distances."""
        return np.zeros((len(moved.frames), self.count + self.given.z.shape[1]))

    def looked(self, moved: Moved, times: Array) -> tuple[Array, Array]:
        """At the samples of any motion."""
        at = np.searchsorted(moved.inputs, self.model.inputs - 1e-9)
        return moved.frames[:, at], moved.rates[:, at]

    def rows(self, times: Array, frames: Array, rates: Array, u: Unknowns) -> Rows:
        """Distances of points of the curve from the outline, then of given points from the curve."""
        sets, n = frames.shape[:2]
        own, speed = frames[:, :, self.link], rates[:, :, self.link]
        turn = own[..., 2] + 1j * own[..., 3]
        arm = turn * self.place(u)
        h = np.diff(self.model.inputs)
        z, v = own[..., 0] + 1j * own[..., 1] + arm, speed[..., 0] + 1j * speed[..., 1] + 1j * speed[..., 2] * arm
        curve = _Cubics(z[:, :-1], z[:, 1:], v[:, :-1] * h, v[:, 1:] * h, self.closed)
        at = curve.spread()
        polygon = Polygon.of(curve.at(at)[0], self.closed)
        there, back = _nearest(polygon, self.outline, self.given, self.turned)
        places = curve.nearest(at[np.arange(sets)[:, None], back], self.given.z)
        e = self.heavy * (curve.at(places)[0] - self.given.z) / self.size
        if self.closed:
            away = polygon.z - self.outline.foot(polygon.z, there)
            away *= np.maximum(1.0 - self.band[there] / np.maximum(np.abs(away), 1e-300), 0.0) / self.size
            e, places = np.concatenate([away, e], axis=1), np.concatenate([at, places], axis=1)
        far = np.abs(e)
        way = np.where(far > _NONE, e / np.maximum(far, _NONE), 0.0)
        way[:, self.count :] *= self.heavy
        loads, direct = self.blank(sets, 2, n)
        self.put(loads, direct, arm, turn)
        low, part = curve.split(places)
        return Rows(times, far[:, None], loads, direct, self.weight, picks=Picks(low, part, _parts(way)))


class _Cubics(NamedTuple):
    """Curves in cubics (sets, n): both ends and the velocities there; places are in cubics."""

    a: Complex
    b: Complex
    p: Complex
    q: Complex
    closed: bool = True

    def split(self, at: Array) -> tuple[Whole, Array]:
        """Return cubics and parts of them."""
        low, n = np.floor(at).astype(np.intp), self.a.shape[1]
        if not self.closed:
            low = np.clip(low, 0, n - 1)
        return low % n, at - low

    def at(self, at: Array) -> tuple[Complex, Complex]:
        """Return points and velocities at places (sets, m)."""
        k, x = self.split(at)
        row, y = np.arange(len(k))[:, None], 1.0 - x
        a, b, p, q = (own[row, k] for own in self[:4])
        z = y * y * ((1 + 2 * x) * a + x * p) + x * x * ((1 + 2 * y) * b - y * q)
        return z, 6 * x * y * (b - a) + y * (1 - 3 * x) * p + x * (3 * x - 2) * q

    def spread(self) -> Array:
        """Return places (sets, _EQUAL + n) of equal distance along the curves and where cubics begin, in order."""
        sets, n = self.a.shape
        fine, _ = self.at(np.tile(np.arange(n * _CHORDS) / _CHORDS, (sets, 1)))
        share = np.cumsum(np.abs(np.diff(fine, axis=1, append=self.b[:, -1:])), axis=1)
        share /= np.maximum(share[:, -1:], 1e-300)
        row, wanted = np.arange(sets)[:, None], (np.arange(_EQUAL) + 0.5) / _EQUAL
        k = np.searchsorted((share + row).ravel(), (wanted + row).ravel()).reshape(sets, -1) - row * n * _CHORDS
        k = np.clip(k, 0, n * _CHORDS - 1)
        begin = np.where(k > 0, share[row, k - 1], 0.0)
        part = np.clip((wanted - begin) / np.maximum(share[row, k] - begin, 1e-300), 0.0, 1.0)
        own = np.broadcast_to(np.arange(n, dtype=np.float64), (sets, n))
        return np.sort(np.concatenate([(k + part) / _CHORDS, own], axis=1), axis=1)

    def bends(self, at: Array) -> Complex:
        """Return accelerations at places (sets, m)."""
        k, x = self.split(at)
        a, b, p, q = (own[np.arange(len(k))[:, None], k] for own in self[:4])
        return 6.0 * (1.0 - 2.0 * x) * (b - a) + (6.0 * x - 4.0) * p + (6.0 * x - 2.0) * q

    def nearest(self, at: Array, goal: Complex) -> Array:
        """Slide places to where the curves are nearest to points (sets, m)."""
        for _ in range(_SLIDES):
            z, v = self.at(at)
            along, square = (np.conj(v) * (goal - z)).real, np.abs(v) ** 2
            steep = np.maximum(square - (np.conj(self.bends(at)) * (goal - z)).real, 0.1 * square)
            at = at + np.clip(along / np.maximum(steep, 1e-300), -0.5, 0.5)
            at = at if self.closed else np.clip(at, 0.0, self.a.shape[1])
        return at


def _nearest(curve: Polygon, outline: Polygon, given: Polygon, turned: float) -> tuple[Whole, Whole]:
    """Corner of the outline nearest to every one of the curves (sets, m); of the curves to every given point."""
    one, two, three = (_four(own, turned) for own in (curve, outline, given))
    there = (one @ two[0].T - 0.5 * (two[0] ** 2).sum(axis=1)).argmax(axis=2)
    return there, (three[0] @ one.transpose(0, 2, 1) - 0.5 * (one**2).sum(axis=2)[:, None]).argmax(axis=2)


def _parts(z: Complex) -> Array:
    return np.stack([z.real, z.imag], axis=1)


def _four(own: Polygon, turned: float) -> NDArray[np.float32]:
    """Places and, as far as they count, directions."""
    way = own.before + own.after
    way = turned * way / np.maximum(np.abs(way), 1e-300)
    return np.stack([own.z.real, own.z.imag, way.real, way.imag], axis=2).astype(np.float32)
