"""The circle-point and centre-point curves of four poses: two cubics, sampled branch by branch (theory/poses 3)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.arguments import Count
from graphsynth.core.checks import Point, checked
from graphsynth.core.errors import GeometryError
from graphsynth.core.shown import Shown, work
from graphsynth.design.poses.roots import rows_of, swapped
from graphsynth.design.poses.task import read_poses
from graphsynth.intervals.reading import precision

if TYPE_CHECKING:
    import graphsynth as gs  # what methods give back that is made in rooms above, by its public name

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
#: Roots this near the unit circle are taken as angles; double roots lie farther off than single ones.
_NEAR = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class BurmesterCurve(Shown):
    """A circular cubic, the places of one joint of all RR dyads of four poses (estimated: floating point).

    Attributes
    ----------
    kind : {"centre", "circle"}
        Centre points are joints at the frame; circle points are joints at the body, in its own frame.
    base : (float, float)
        A point of the curve, the pole of two poses; each line through it meets the curve in two points more.
    asymptote : ((float, float), float)
        A point of the real asymptote and its direction, radians.
    branches : int
        Components of the curve: 1 or 2.
    """

    kind: str
    base: Point
    asymptote: tuple[Point, float]
    branches: int
    _rows: Array
    _frame: tuple[complex, complex]
    _partner: tuple[complex, complex]

    def points(self, count: Count = 200) -> list[Array]:
        """Sample every branch in its order, shape (m, 2), about ``count`` points each.

        An oval is closed; the other branch begins and ends far out on the asymptote.
        """
        return [_pairs(self._frame, z) for z in self._samples(count)]

    def partners(self, points: Any) -> Array:
        """Return the other ends of the dyads whose joint is at given points of this curve, shape (m, 2)."""
        vectors = np.linalg.svd(_tables(self._rows, self._inner(points)))[2][..., 2, :]
        with np.errstate(divide="ignore", invalid="ignore"):
            return _pairs(self._partner, (vectors[..., 0] + 1j * vectors[..., 1]) / vectors[..., 2])

    def distances(self, points: Any) -> Array:
        """Return distances from the curve, to first order, of points (m, 2), in the unit of the poses."""
        z = self._inner(points)
        slopes = np.array([_forms(self._rows, z, np.full(z.shape, v))[2] for v in (1.0, 1j)])
        return np.asarray(np.abs(np.linalg.det(_tables(self._rows, z))) / np.hypot(*slopes) * abs(self._frame[1]))

    def _inner(self, points: Any) -> Complex:
        x, y = np.asarray(points, dtype=np.float64).T
        return np.asarray((x + 1j * y - self._frame[0]) / self._frame[1])

    def _samples(self, count: int) -> list[Complex]:
        """Points of every branch, in units from the first pose."""
        base = (complex(*self.base) - self._frame[0]) / self._frame[1]
        far = _infinity(self._rows, base)
        loops: list[tuple[Complex, Array]] = []
        for arcs in _arcs(self._rows, base):
            start, stop = arcs
            whole = stop - start >= np.pi * (1.0 - 1e-12)
            cut = start + (np.angle(far) - start) % np.pi
            ends = [start, cut, stop] if cut < stop else [start, stop]
            share = max(4, count // (2 * (len(ends) - 1)))
            grid = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, share + 1))
            angles = np.concatenate([a + (b - a) * grid[1 if k else 0 : -1] for k, (a, b) in enumerate(pairwise(ends))])
            angles = angles if whole else np.append(angles, stop)
            up, down = _sheets(self._rows, base, angles, cut if cut < stop else None)
            loops += [up, down] if whole else [(np.append(up[0], down[0][::-1]), np.append(up[1], down[1][::-1]))]
        return [_opened(z, side) for z, side in loops]

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        (x, y), angle = self.asymptote
        rows = [
            ("branches", str(self.branches)),
            ("asymptote", f"through ({x:.6g}, {y:.6g}), direction {math.degrees(angle):.6g} deg"),
        ]
        return f"{self.kind.capitalize()}-point curve of four poses", rows


@dataclass(frozen=True, eq=False, repr=False)
class BurmesterCurves(Shown):
    """Both curves of four poses.

    Attributes
    ----------
    poses : ndarray, shape (4, 3)
    centre, circle : BurmesterCurve
        Joints at the frame, and at the body.
    """

    poses: Array
    centre: BurmesterCurve
    circle: BurmesterCurve

    def pairs(self, count: Count = 200) -> tuple[Array, Array]:
        """Return joints at the frame and at the body of dyads along the curve, each of shape (m, 2)."""
        centres = np.concatenate(self.centre.points(count))
        points = self.centre.partners(centres)
        fine = np.isfinite(points).all(axis=1)
        return centres[fine], points[fine]

    def plot(self) -> gs.Chart:
        """Chart both curves with their asymptotes, that of the body in its first pose."""
        chart: gs.Chart = work("chart burmester")(self)
        return chart

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [(f"{one.kind} {name}", text) for one in (self.centre, self.circle) for name, text in one._told()[1]]
        return "Curves of the RR dyads of four poses", rows


@checked
def burmester_curves(poses: Any) -> BurmesterCurves:
    """Find the centre-point and the circle-point curve of four poses.

    Parameters
    ----------
    poses : sequence of (x, y, angle)
        Four poses, as for `dyads`.

    Returns
    -------
    BurmesterCurves

    Raises
    ------
    GeometryError
        Another number of poses, angles that are all the same, poses whose curve falls apart.

    Examples
    --------
    >>> curves = burmester_curves([(0, 0, 0), (1, 0.5, "20 deg"), (2, 0.6, "50 deg"), (2.5, 1, "70 deg")])
    >>> curves.centre.branches, len(curves.centre.points())
    (1, 1)
    """
    task = read_poses(poses, 4, 4)
    with precision(128):
        moves = task.displacements()
        rows = rows_of(moves)
        centre = np.array([[float(v) for v in row] for row in rows])
        circle = np.array([[float(v) for v in swapped(row)] for row in rows])
        size, z1 = complex(float(task.unit)), complex(task.from_first(0))
        turn = complex(task.from_first(1, in_link=True))
        poles = [complex(d / (1 - u)) for u, d in moves if not (1 - u).contains(0)]
    if not poles:
        raise GeometryError("the angles of the four poses are the same, so there are no poles; give other angles")
    pole = min(poles, key=abs)
    frames = {"centre": (z1, size), "circle": (0j, turn)}
    made = [
        _curve(kind, rows, pole, (frames[kind], frames[other]))
        for kind, other, rows in (("centre", "circle", centre), ("circle", "centre", circle))
    ]
    return BurmesterCurves(task.poses, *made)


def _curve(kind: str, rows: Array, base: complex, frames: tuple[Any, Any]) -> BurmesterCurve:
    frame, partner = frames
    direction = _infinity(rows, base)
    second = _forms(rows, np.array([base]), np.array([direction]))[1][0]
    slope = complex(*(_forms(rows, np.array([base]), np.array([v]))[0][0] for v in (1.0, 1j)))
    at = frame[0] + frame[1] * (base - second * slope / abs(slope) ** 2)
    angle = np.angle(frame[1] * direction)
    angle = float((angle + np.pi / 2) % np.pi - np.pi / 2)
    arcs = _arcs(rows, base)
    count = 2 if arcs[0][1] - arcs[0][0] >= np.pi * (1.0 - 1e-12) else len(arcs)
    place = frame[0] + frame[1] * base
    return BurmesterCurve(kind, (place.real, place.imag), ((at.real, at.imag), angle), count, rows, frame, partner)


def _pairs(frame: tuple[complex, complex], z: Complex) -> Array:
    z = frame[0] + frame[1] * z
    return np.column_stack([z.real, z.imag])


def _tables(rows: Array, z: Complex, linear: bool = False) -> Array:
    """Coefficients of x, y, 1 in the three equations at pivots z, shape (..., 3, 3); without the constants."""
    p, q, one = z.real[..., None], z.imag[..., None], 0.0 if linear else 1.0
    a, b, x, y, c, d, e = rows.T
    return np.stack([one * x + a * p - b * q, one * y + a * q + b * p, one * e + c * p + d * q], axis=-1)


def _forms(rows: Array, base: Complex, v: Complex) -> tuple[Array, Array, Array]:
    """Coefficients of t^3, t^2 and t of the cubic on the line ``base + t v``; v of any length, so t^3 has |v|^2 L."""
    at, along = _tables(rows, base), _tables(rows, v, linear=True)

    def mixed(*which: int) -> Array:
        chosen = [(along if k in which else at)[..., k, :] for k in range(3)]
        return np.asarray(np.einsum("...i,...i->...", chosen[0], np.cross(chosen[1], chosen[2])))

    return mixed(0, 1, 2), mixed(0, 1) + mixed(0, 2) + mixed(1, 2), mixed(0) + mixed(1) + mixed(2)


def _infinity(rows: Array, base: complex) -> complex:
    """Direction of the real asymptote."""
    a, b = (_forms(rows, np.array([base]), np.array([v]))[0][0] for v in (1.0, 1j))
    if math.hypot(a, b) <= 1e-13 * np.prod([np.abs(row).max() for row in rows]):
        raise GeometryError("the curve of these poses falls apart into a circle and lines; change a pose a little")
    return complex(-b, a) / math.hypot(a, b)


def _arcs(rows: Array, base: complex) -> list[tuple[float, float]]:
    """Directions of lines through the base that meet the curve in two points more: arcs in a half turn, joined."""

    def discriminant(angle: Any) -> Array:
        lead, second, last = _forms(rows, np.full(np.shape(angle), base), np.exp(1j * np.asarray(angle)))
        return np.asarray(second * second - 4.0 * lead * last)

    nodes = np.arange(8) * np.pi / 8
    waves = np.fft.fft(discriminant(nodes)) / 8  # a trigonometric polynomial of degree two in the doubled angle
    roots = np.roots([waves[2], waves[1], waves[0].real, waves[1].conj(), waves[2].conj()])
    ends = np.sort([np.angle(z) / 2 % np.pi for z in roots if abs(abs(z) - 1.0) < _NEAR])
    if not len(ends):
        return [(0.0, np.pi)]
    arcs: list[tuple[float, float]] = []
    for start, stop in zip(ends, np.append(ends[1:], ends[0] + np.pi)):
        if discriminant(0.5 * (start + stop)) > 0.0:
            if arcs and arcs[-1][1] == start:
                start = arcs.pop()[0]
            arcs.append((float(start), float(stop)))
    if len(arcs) > 1 and abs(arcs[-1][1] - np.pi - arcs[0][0]) < 1e-12:
        arcs[0] = (arcs.pop()[0] - np.pi, arcs[0][1])
    return arcs


def _sheets(rows: Array, base: complex, angles: Array, cut: float | None) -> list[tuple[Complex, Array]]:
    """Both further points on every line, and for each whether it lies before or after infinity there; 0 if neither."""
    v = np.exp(1j * angles)
    lead, second, last = _forms(rows, np.full(angles.shape, base), v)
    root = np.sqrt(np.maximum(second * second - 4.0 * lead * last, 0.0))
    outer = -0.5 * (second + np.copysign(root, second))
    with np.errstate(divide="ignore", invalid="ignore"):
        large, small = outer / lead, np.where(outer == 0.0, 0.0, last / outer)
    up = second < 0.0  # the sheet + is the larger root
    side = np.zeros(angles.shape) if cut is None else np.where(angles < cut, -1.0, 1.0)
    found = []
    for own in (up, ~up):
        t = np.where(own, large, small)
        fine = np.isfinite(t)
        found.append((base + t[fine] * v[fine], np.where(own, side, 0.0)[fine]))
    return found


def _opened(z: Complex, side: Array) -> Complex:
    """Turn a loop so that it is cut at infinity; close it where it does not get there."""
    jump = np.flatnonzero(side * np.roll(side, -1) < 0.0)
    if len(jump) > 1:  # besides the jump at infinity, the seam of a whole turn
        jump = jump[[int(np.argmax(np.abs(z[jump] - z[(jump + 1) % len(z)])))]]
    return np.roll(z, -jump[0] - 1) if len(jump) else np.append(z, z[:1])
