"""`Rounded`: all points within a radius of a convex polygon; bars, plates, holes and slots are of this form.

Its boundary consists of straight lines and arcs, so that area, centroid and second moment have closed forms, by Green's
theorem with ``z = x + i y``, ``theory/parts 1``:

    area = 1/(2i) closed integral of conj(z) dz,    integral of z dA = 1/(2i) closed integral of |z|^2 dz,
    integral of |z|^2 dA = 1/(4i) closed integral of |z|^2 conj(z) dz.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

#: Points of Gauss and Legendre on 0..1: exact for the cubics on straight lines.
_GAUSS = (0.5 - math.sqrt(3.0) / 6.0, 0.5 + math.sqrt(3.0) / 6.0)
#: Points nearer than this times the size are one point.
_SAME = 1e-9


class Corner(NamedTuple):
    """A point of a boundary and the bulge of the way to the next: tan(angle of the arc / 4), 0 for a straight line."""

    at: complex
    bulge: float


class Moments(NamedTuple):
    """Area, first moment (complex) and polar second moment, both about the origin."""

    area: float
    first: complex
    second: float

    def less(self, other: Moments) -> Moments:
        """Return what is left without another part of the plane."""
        return Moments(self.area - other.area, self.first - other.first, self.second - other.second)

    @property
    def centroid(self) -> complex:
        """Centroid."""
        return self.first / self.area

    @property
    def central(self) -> float:
        """Polar second moment about the centroid."""
        return self.second - abs(self.first) ** 2 / self.area


@dataclass(frozen=True)
class Rounded:
    """All points within ``radius`` of the convex hull of points: a disc, a stadium, a plate with rounded corners.

    >>> bar = Rounded.around([0j, 10 + 0j], 2.0)
    >>> round(bar.moments.area - (40.0 + 4.0 * math.pi), 12)
    0.0
    """

    hull: tuple[complex, ...]  #: corners counter-clockwise, no three on a line
    radius: float
    pitch = 0.0  # no circle to engrave

    @classmethod
    def around(cls, points: Iterable[complex], radius: float) -> Rounded:
        """Return the hull of points, rounded; corners that stand out by less than rounding errors are left out."""
        ordered: list[complex] = []  # Andrew's monotone chain
        given = sorted(points, key=lambda z: (z.real, z.imag))
        near = _SAME * max(abs(z - given[0]) for z in given)
        for z in given:
            if all(abs(z - other) > near for other in ordered):
                ordered.append(z)
        if len(ordered) < 3:  # a point or a bar
            return cls(tuple(ordered), radius)
        hull: list[complex] = []
        for way in (ordered, ordered[::-1]):
            chain: list[complex] = []
            for z in way:
                while len(chain) > 1 and not _stands_out(chain[-2], chain[-1], z, near):
                    chain.pop()
                chain.append(z)
            hull += chain[:-1]
        k = 0
        while k < len(hull) and len(hull) > 2:  # the ends of the chains, where they lie on a side
            if _stands_out(hull[k - 1], hull[k], hull[(k + 1) % len(hull)], near):
                k += 1
            else:
                del hull[k]
        return cls(tuple(hull), radius)

    @cached_property
    def corners(self) -> tuple[Corner, ...]:
        """Boundary, counter-clockwise."""
        found = []
        for before, at, after in zip(self.hull[-1:] + self.hull[:-1], self.hull, self.hull[1:] + self.hull[:1]):
            if at == before:  # a disc: two half circles
                return (Corner(at + self.radius, 1.0), Corner(at - self.radius, 1.0))
            first, second = (-1j * (b - a) / abs(b - a) for a, b in ((before, at), (at, after)))
            turn = math.pi if before == after else cmath.phase(second / first)
            found += [
                Corner(at + self.radius * first, math.tan(turn / 4.0)),
                Corner(at + self.radius * second, 0.0),
            ]
        return tuple(found)

    @cached_property
    def moments(self) -> Moments:
        """Area, first and second moment in closed form."""
        area = first = second = 0j
        for (start, bulge), (end, _) in zip(self.corners, self.corners[1:] + self.corners[:1]):
            parts = _arc(start, end, bulge) if bulge else _line(start, end)
            area, first, second = area + parts[0], first + parts[1], second + parts[2]
        return Moments((area / 2j).real, first / 2j, (second / 4j).real)

    def flat(self, deviation: float) -> list[complex]:
        """Corners of a polygon inscribed in the boundary, at most ``deviation`` from it."""
        found = []
        for (start, bulge), (end, _) in zip(self.corners, self.corners[1:] + self.corners[:1]):
            found.append(start)
            if bulge:
                centre, radius, angle = arc_of(start, end, bulge)
                step = 2.0 * math.acos(max(1.0 - deviation / radius, 0.0))
                count = max(1, math.ceil(angle / step))
                found += [centre + (start - centre) * cmath.exp(1j * angle * k / count) for k in range(1, count)]
        return found

    def moved(self, turn: complex, shift: complex) -> Rounded:
        """Return it turned about the origin by a unit vector, then shifted."""
        return Rounded(tuple(z * turn + shift for z in self.hull), self.radius)

    @property
    def box(self) -> tuple[complex, complex]:
        """Opposite corners of the box around it."""
        x, y, r = [z.real for z in self.hull], [z.imag for z in self.hull], self.radius
        return complex(min(x) - r, min(y) - r), complex(max(x) + r, max(y) + r)


def _stands_out(before: complex, at: complex, after: complex, near: float) -> bool:
    """Whether a corner lies to the right of the way between its neighbours, by more than ``near``."""
    return _cross(at - before, after - before) > near * abs(after - before)


def _cross(a: complex, b: complex) -> float:
    return (a.conjugate() * b).imag


def arc_of(start: complex, end: complex, bulge: float) -> tuple[complex, float, float]:
    """Centre, radius and angle of the arc of a bulge."""
    centre = (start + end) / 2 + 1j * (end - start) * (1.0 - bulge * bulge) / (4.0 * bulge)
    return centre, abs(start - centre), 4.0 * math.atan(bulge)


def _line(start: complex, end: complex) -> tuple[complex, complex, complex]:
    """Integrals of conj(z), |z|^2, |z|^2 conj(z) along a straight line."""
    along = end - start
    z = [start + along * t for t in _GAUSS]
    return (
        sum((p.conjugate() for p in z), 0j) * along / 2,
        sum(abs(p) ** 2 for p in z) * along / 2,
        sum((abs(p) ** 2 * p.conjugate() for p in z), 0j) * along / 2,
    )


def _arc(start: complex, end: complex, bulge: float) -> tuple[complex, complex, complex]:
    """Integrals of conj(z), |z|^2, |z|^2 conj(z) along an arc ``z = c + R exp(i t)``."""
    c, R, angle = arc_of(start, end, bulge)
    e = (start - c) / R

    def power(k: int) -> complex:
        """Integral of ``e^k`` over the arc."""
        return e**k * (cmath.exp(1j * k * angle) - 1.0) / (1j * k) if k else angle + 0j

    d, m = c.conjugate(), abs(c) ** 2 + R * R
    return (
        1j * R * (d * power(1) + R * power(0)),
        1j * R * (m * power(1) + c * R * power(0) + d * R * power(2)),
        1j
        * R
        * (
            (m + R * R) * d * power(1) + (m + abs(c) ** 2) * R * power(0) + c * R * R * power(-1) + d * d * R * power(2)
        ),
    )
