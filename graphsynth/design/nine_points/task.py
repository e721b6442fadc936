"""The points that a path shall pass, read and scaled; the pivots that are given."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import point
from graphsynth.core.errors import GeometryError
from graphsynth.intervals.balls import Balls, exact

Complex = NDArray[np.complex128]
#: Points for no, one and two given pivots.
POINTS = (9, 7, 5)


@dataclass(frozen=True, eq=False)
class Task:
    """Points ``p`` and given pivots, complex; unknowns count from ``p[0]`` in units of ``unit``, a power of two."""

    p: Complex
    pivots: Complex

    @property
    def free(self) -> list[int]:
        """Places of the unknowns among a, a*, x, x*, b, b*, y, y*."""
        return free_unknowns(len(self.pivots))

    @cached_property
    def unit(self) -> float:
        """A power of two near the mean distance of the points from the first."""
        return float(2.0 ** round(math.log2(np.mean(np.abs(self.p[1:] - self.p[0])))))

    def _counted(self, given: Complex) -> Balls:
        away = exact(given) - exact(self.p[:1])
        scaled = Balls(away.mid / self.unit, away.rad / self.unit)
        mid, rad = np.stack([scaled.mid, scaled.mid.conj()], axis=-1), np.stack([scaled.rad, scaled.rad], axis=-1)
        return Balls(mid, rad)

    @cached_property
    def points(self) -> Balls:
        """The other points and their conjugates, shape (points - 1, 2)."""
        return self._counted(self.p[1:])

    @cached_property
    def held(self) -> Balls:
        """Given pivots and their conjugates, shape (pivots, 2)."""
        return self._counted(self.pivots)

    @property
    def end(self) -> Complex:
        """Where a path of points and given unknowns ends, as the kernels want it."""
        return parameters(self.points.mid, self.held.mid)

    def ball(self, value: complex) -> tuple[Any, Any]:
        """Exact coordinates of a given point, and their conjugates, in balls of python-flint."""
        import flint

        away = (flint.acb(complex(value)) - flint.acb(complex(self.p[0]))) / self.unit
        return away, flint.acb(away.real, -away.imag)


def free_unknowns(pivots: int) -> list[int]:
    """Places of the unknowns where so many pivots are given."""
    return [k for k in range(8) if k % 4 > 1 or k // 4 >= pivots]


def parameters(points: Complex, pivots: Complex) -> Complex:
    """Points, four rows for the unknowns of which given pivots take the first and the third, no bend."""
    rows = np.zeros((5, 2), dtype=np.complex128)
    rows[: 2 * len(pivots) : 2] = pivots
    return np.concatenate([points, rows])


def read_task(points: Any, pivots: Any) -> Task:
    """Check points and pivots."""
    p, held = _read("points", points), _read("pivots", pivots)
    if len(held) > 2 or len(p) != POINTS[len(held)]:
        raise GeometryError(
            f"{len(p)} points and {len(held)} pivots are given; give 9 points, or 7 and one pivot, or 5 and two pivots"
        )
    for name, given in (("points", p), ("pivots", held)):
        if len(set(given)) < len(given):
            raise GeometryError(f"two of the {name} are the same; give different ones")
    size = max(map(abs, (*p, *held)))
    if not 1e-60 < size < 1e60:
        raise GeometryError(f"the largest coordinate is about {size:g}; choose a unit in which it is 1e-60 to 1e60")
    return Task(np.array(p), np.array(held, dtype=np.complex128))


def _read(name: str, values: Any) -> list[complex]:
    try:
        given = list(values)
    except TypeError:
        raise GeometryError(f"{name} is {values!r}; give a list of points (x, y)") from None
    return [complex(*point(f"{name}[{k}]", value)) for k, value in enumerate(given)]
