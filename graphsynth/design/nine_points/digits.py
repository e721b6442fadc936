"""Single paths followed with many digits, where double precision loses them: roots with very large pivots."""

from __future__ import annotations

from typing import Any

import numpy as np

from graphsynth.design.nine_points.equations import slopes, value
from graphsynth.design.nine_points.task import Complex, Task
from graphsynth.intervals.reading import precision

#: Binary digits; a step of time for derivatives, of which half of them are lost.
_BITS, _EPS = 256, 2.0**-120
#: Largest first correction of a step, what Newton's method shall reach, first step, least one, most steps.
_MOST, _REACHED, _FIRST, _LEAST, _STEPS = 1e-4, 1e-40, 1e-2, 1e-25, 4000
_NEWTON = 7


def follow_with_digits(z: Complex, begin: Complex, task: Task) -> Complex | None:
    """Follow one root from generic points and given unknowns to those of a task.

    The same path, predictor and corrector as in the kernels (theory/nine-points 3); None where it does not arrive.
    """
    import flint

    with precision(_BITS):
        try:
            return _follow(_Path(z, begin, task), [flint.acb(complex(part)) for part in z])
        except (ZeroDivisionError, OverflowError):
            return None


class _Path:
    """Points and given unknowns that move on a straight line, and linear systems along it."""

    def __init__(self, z: Complex, begin: Complex, task: Task) -> None:
        import flint

        self.free = task.free
        self.given = [k for k in range(len(z)) if k not in task.free]
        self.start = [[flint.acb(complex(v)) for v in row] for row in begin]
        self.change = [
            [flint.acb(complex(v)) - s for v, s in zip(row, first)] for row, first in zip(task.end, self.start)
        ]

    def place(self, t: Any, z: list[Any]) -> tuple[list[list[Any]], list[Any]]:
        """Points at a time, and all unknowns with the given ones there."""
        at = [[s + t * c for s, c in zip(*rows)] for rows in zip(self.start, self.change)]
        z = list(z)
        for k in self.given:
            z[k] = at[len(self.free) + k // 2][k % 2]
        return at[: len(self.free)], z

    def solved(self, t: Any, z: list[Any], rates: bool) -> list[Any]:
        """Newton's correction at a time, or the rates of the free unknowns."""
        import flint

        points, z = self.place(t, z)
        rows = [slopes(z, p, q) for p, q in points]
        matrix = flint.acb_mat([[row[k] for k in self.free] for row in rows])
        right = [value(z, p, q) for p, q in points]
        if rates:
            later, moved = self.place(t + _EPS, z)
            right = [(value(moved, p, q) - v) / _EPS for (p, q), v in zip(later, right)]
        found = matrix.mid().solve(flint.acb_mat([[-v.mid()] for v in right]), algorithm="approx")
        return [found[i, 0].mid() for i in range(len(self.free))]

    def moved(self, z: list[Any], step: list[Any], factor: Any = 1) -> list[Any]:
        """Unknowns, the free ones moved."""
        z = list(z)
        for k, by in zip(self.free, step):
            z[k] = (z[k] + factor * by).mid()
        return z

    def correct(self, t: Any, z: list[Any]) -> tuple[list[Any], float, bool]:
        """Newton's method: where it ends, the relative size of its first correction, whether it converged."""
        first = last = 0.0
        for count in range(_NEWTON):
            step = self.solved(t, z, rates=False)
            last = max(float(abs(by).mid()) / (0.1 + float(abs(z[k]).mid())) for k, by in zip(self.free, step))
            first = first if count else last
            if not last < 1e-2:
                return z, first, False
            z = self.moved(z, step)
            if last < _REACHED:
                break
        return z, first, last < _REACHED


def _follow(path: _Path, z: list[Any]) -> Complex | None:
    """Runge and Kutta's rule with steps that follow the first correction."""
    import flint

    z, _, good = path.correct(flint.arb(0), z)
    t, h = 0.0, _FIRST
    for _ in range(_STEPS if good else 0):
        h = min(h, 1.0 - t)
        at = flint.arb(t)
        half, after = at + h / 2, flint.arb(1.0 if h == 1.0 - t else t + h)
        k1 = path.solved(at, z, rates=True)
        k2 = path.solved(half, path.moved(z, k1, h / 2), rates=True)
        k3 = path.solved(half, path.moved(z, k2, h / 2), rates=True)
        k4 = path.solved(after, path.moved(z, k3, h), rates=True)
        step = [(a + 2 * (b + c) + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4)]
        there, first, good = path.correct(after, path.moved(z, step, h))
        if good and first <= _MOST:
            z, t = there, float(after)
            if t == 1.0:
                _, z = path.place(after, z)
                return np.array([complex(part) for part in z])
            h *= min(3.0, 0.85 * (_MOST / max(first, 1e-300)) ** 0.2)
        else:
            h *= 0.5 if not 0.0 < first < 1e200 else max(0.2, min(0.6, 0.8 * (_MOST / first) ** 0.2))
            if t + h == t or h < _LEAST:
                return None
    return None
