"""What an index is asked for: a curve, a curve with its inputs, a motion; how near a row is, and how it is placed."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.design.curves.fourier import (
    AnyComplex,
    aligned,
    coefficients,
    distances,
    magnitudes,
    orders,
    uniform,
    unit,
    variant,
)
from graphsynth.design.curves.matches import Fitted, Traced
from graphsynth.design.curves.stored import ARC, TIMED

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Harmonics of the sizes that are searched; of the final comparison over the arc length, and over the input.
LEADING, _FINAL, _FINAL_TIMED = 8, 64, 24
#: Fewest points with inputs; beginnings of a motion that are compared; rounds that improve the best, points of each.
_LEAST, _GRID, _ROUNDS, _FINER = 5, 64, 7, 17
#: Part of its largest value by which the matrix of a motion's placement is made regular.
_REGULAR = 1e-13


class Shape(NamedTuple):
    """Unit coefficients of a curve, their norm, its centre."""

    unit: Complex
    size: float
    centre: complex

    @classmethod
    def of(cls, points: Complex, closed: bool) -> Shape:
        """Over the arc length."""
        found = coefficients(points[None], np.array([closed]), _FINAL)[0]
        sides, middle = np.abs(np.diff(points)), 0.5 * (points[1:] + points[:-1])
        return cls(
            unit(found), float(np.linalg.norm(found)), complex((sides * middle).sum() / max(sides.sum(), 1e-300))
        )

    @classmethod
    def timed(cls, values: Complex, closed: bool) -> Shape:
        """Over the input, of uniform samples."""
        found = _waves(values, closed)
        moving = np.delete(found, _FINAL_TIMED)
        return cls(unit(moving), float(np.linalg.norm(moving)), complex(found[_FINAL_TIMED]))


def _waves(values: Complex, closed: bool) -> Complex:
    """Coefficients of uniform samples; 0 for harmonics that so few samples do not tell."""
    told = min(_FINAL_TIMED, (len(values) - 2) // 2 if closed else len(values) - 2)
    found = uniform(values[None], np.array([closed]), np.array([len(values)]), told)[0]
    return np.pad(found, _FINAL_TIMED - told)


class Wanted(ABC):
    """Base: ``own`` are the coefficients of what is wanted as they stand in ``column`` of an index."""

    column: str
    columns: tuple[str, ...]
    own: Complex
    closed: bool

    def sizes(self) -> list[Array]:
        """Sizes to look for: of the curve, and of a closed one backwards."""
        both = [self.own, self.own[::-1]] if self.closed else [self.own]
        return [magnitudes(own, LEADING) for own in both]

    def distances(self, rows: Mapping[str, AnyComplex]) -> Array:
        """Distance of stored rows."""
        return distances(self.own.astype(np.complex64), rows[self.column], self.closed)

    @abstractmethod
    def fitted(self, traced: Traced) -> tuple[float, Fitted]:
        """Error of a mechanism that was moved anew, and how it is placed."""


class WantedCurve(Wanted):
    """A curve, however fast it is run through."""

    column, columns = "arc", ("arc",)

    def __init__(self, curve: ArrayLike, closed: bool | None) -> None:
        points, self.closed = _points("curve", curve, 2, closed, 3)
        z = _complex(points)
        self.shape = Shape.of(z, self.closed)
        self.own = unit(coefficients(z[None], np.array([self.closed]), ARC)[0])

    def fitted(self, traced: Traced) -> tuple[float, Fitted]:
        """By the best motion over the arc length."""
        curve = np.append(traced.curve[:-1], traced.curve[0]) if self.closed else traced.curve
        along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(curve)))])
        return _best(self.shape, Shape.of(curve, self.closed), self.closed, traced.inputs, along / along[-1])


class TimedCurve(Wanted):
    """A curve at uniform inputs."""

    column, columns = "timed", ("timed",)

    def __init__(self, curve: ArrayLike, closed: bool | None) -> None:
        points, self.closed = _points("curve", curve, 2, closed, _LEAST)
        self.shape = Shape.timed(_complex(points), self.closed)
        self.own = unit(self.shape.unit[_FINAL_TIMED - TIMED : _FINAL_TIMED + TIMED])

    def fitted(self, traced: Traced) -> tuple[float, Fitted]:
        """By the best motion over the input."""
        share = np.linspace(0.0, 1.0, len(traced.inputs))
        return _best(self.shape, Shape.timed(traced.curve, self.closed), self.closed, traced.inputs, share)


class WantedMotion(Wanted):
    """Poses at uniform inputs; the point of the link is free, and the line from which its angle is measured."""

    column, columns = "turn", ("turn", "timed")

    def __init__(self, poses: ArrayLike, closed: bool | None) -> None:
        rows, self.closed = _points("poses", poses, 3, closed, _LEAST)
        self.shape = Shape.timed(_complex(rows), self.closed)
        self.turn = _waves(np.exp(1j * rows[:, 2]), self.closed)
        inner = slice(_FINAL_TIMED - TIMED, _FINAL_TIMED + TIMED)
        self.own = self.turn[inner.start : inner.stop + 1]
        self._near = _Motions(self.shape.unit[inner], self.own)

    def distances(self, rows: Mapping[str, AnyComplex]) -> Array:
        """Least of all variants and beginnings."""
        shifts = np.arange(_GRID) / _GRID if self.closed else np.array([0.0, 0.5])
        every = [self._near.squares(rows["timed"], rows["turn"], own, shifts).min(axis=1) for own in self._variants()]
        return np.asarray(np.sqrt(np.min(every, axis=0)))

    def _variants(self) -> list[tuple[bool, bool]]:
        """Reflected or not; a closed motion also backwards."""
        return [(reflected, back) for reflected in (False, True) for back in (False, True) if self.closed or not back]

    def fitted(self, traced: Traced) -> tuple[float, Fitted]:
        """By the best variant and beginning, improved on finer and finer grids."""
        own, turn = Shape.timed(traced.curve, self.closed), _waves(traced.turn, self.closed)
        near, z, w = _Motions(self.shape.unit, self.turn), own.unit[None], turn[None]
        shifts = np.arange(_GRID) / _GRID if self.closed else np.array([0.0, 0.5])
        found = {way: near.squares(z, w, way, shifts)[0] for way in self._variants()}
        way = min(found, key=lambda way: float(found[way].min()))
        shift, error, span = float(shifts[found[way].argmin()]), float(found[way].min()), 1.0 / _GRID
        for _ in range(_ROUNDS if self.closed else 0):
            finer = shift + np.linspace(-span, span, _FINER)
            squares = near.squares(z, w, way, finer)[0]
            shift, error, span = float(finer[squares.argmin()]), float(squares.min()), 2.0 * span / (_FINER - 1)
        s, q = near.placed(own.unit, turn, way, shift)
        s, q = s * self.shape.size / own.size, q * self.shape.size
        centre, middle = own.centre, complex(turn[_FINAL_TIMED])
        if way[0]:
            centre, middle = centre.conjugate(), middle.conjugate()
        offset = self.shape.centre - s * centre - q * middle
        share = np.linspace(0.0, 1.0, len(traced.inputs))
        beginning = _beginning(self.closed, shift, way[1], traced.inputs, share)
        return math.sqrt(max(error, 0.0)), Fitted(s, offset, way[0], *beginning, q / s)


class _Motions(NamedTuple):
    """A wanted motion: unit coefficients of its path, coefficients of its direction."""

    path: Complex
    turn: Complex

    def squares(self, z: AnyComplex, w: AnyComplex, way: tuple[bool, bool], shifts: Array) -> Array:
        """Squared errors (sets, shifts) of unit paths and directions: of the path over its size, and of the angle.

        What the best multiples of path and direction leave of the wanted path, and what a rotation leaves of the
        directions.
        """
        z, w = (variant(part.astype(np.complex128), *way) for part in (z, w))
        half = self.path.shape[-1] // 2
        still = np.delete(w, half, axis=1)
        waves = np.exp(-2j * math.pi * orders(half)[:, None] * shifts)
        one, two = (np.conj(z) * self.path) @ waves, (np.conj(still) * self.path) @ waves
        whole = np.exp(-2j * math.pi * np.arange(-half, half + 1)[:, None] * shifts)
        rho = np.abs((np.conj(w) * self.turn) @ whole)
        a, b, c = _matrix(z, still)
        told = (b * np.abs(one) ** 2 + a * np.abs(two) ** 2 - 2.0 * (np.conj(one) * c * two).real) / (
            a * b - np.abs(c) ** 2
        )
        norms = (np.abs(w) ** 2).sum(axis=1, keepdims=True) + (np.abs(self.turn) ** 2).sum()
        return np.asarray(np.maximum(1.0 - told, 0.0) + np.maximum(norms - 2.0 * rho, 0.0))

    def placed(self, z: Complex, w: Complex, way: tuple[bool, bool], shift: float) -> tuple[complex, complex]:
        """Return the multiples of path and direction that are nearest to the wanted path."""
        half = self.path.shape[-1] // 2
        waves = np.exp(2j * math.pi * orders(half) * shift)
        z, still = variant(z, *way) * waves, np.delete(variant(w, *way), half) * waves
        a, b, c = (part[0, 0] for part in _matrix(z[None], still[None]))
        one, two = np.vdot(z, self.path), np.vdot(still, self.path)
        det = a * b - abs(c) ** 2
        return complex((b * one - c * two) / det), complex((a * two - np.conj(c) * one) / det)


def _matrix(z: AnyComplex, w: AnyComplex) -> tuple[Array, Array, AnyComplex]:
    """Products of path and direction (sets, 1), a little regular where one is a multiple of the other."""
    a, b = ((np.abs(part) ** 2).sum(axis=1, keepdims=True) for part in (z, w))
    size = _REGULAR * np.maximum(a, b)
    return a + size, b + size, (np.conj(z) * w).sum(axis=1, keepdims=True)


def _best(target: Shape, own: Shape, closed: bool, inputs: Array, share: Array) -> tuple[float, Fitted]:
    """Fit a curve whose samples lie at shares of its period, in steps of its inputs."""
    fit = aligned(target.unit, own.unit, closed)
    factor = fit.factor * target.size / own.size
    beginning = _beginning(closed, fit.shift, fit.backwards, inputs, share)
    centre = own.centre.conjugate() if fit.reflected else own.centre
    return fit.error, Fitted(factor, target.centre - factor * centre, fit.reflected, *beginning)


def _beginning(closed: bool, shift: float, backwards: bool, inputs: Array, share: Array) -> tuple[float, float, bool]:
    """Input at which the wanted curve begins, the range, and whether it is run against the input."""
    span = float(inputs[-1] - inputs[0])
    if not closed:
        return float(inputs[-1] if shift else inputs[0]), span, shift != 0.0
    return float(np.interp((-shift if backwards else shift) % 1.0, share, inputs)), span, backwards


def _complex(rows: Array) -> Complex:
    return np.asarray(rows[:, 0] + 1j * rows[:, 1])


def _points(name: str, given: ArrayLike, width: int, closed: bool | None, least: int) -> tuple[Array, bool]:
    """Return rows, the first repeated at the end of what is closed, and whether it is closed.

    `GeometryError` for too few points, or all at one place.
    """
    values = finite_array(name, given)
    if values.ndim != 2 or values.shape[1] != width or len(values) < least:
        row = ("x", "y", "theta")[:width]
        raise GeometryError(f"{name} has shape {values.shape}; give {least} or more rows ({', '.join(row)})")
    same = bool((values[0, :2] == values[-1, :2]).all())
    loop = same if closed is None else bool(closed)
    if loop and not same:
        values = np.concatenate([values, values[:1]])
    if not np.ptp(values[:, :2], axis=0).any():
        raise GeometryError(f"all points of {name} are the same; give a curve")
    return values, loop
