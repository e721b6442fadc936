"""Type-II curve of a working mode as a smooth curve in (x, y, theta_1, theta_2, theta_3), traced by pseudo-arclength.

In these unknowns the curve passes smoothly through the boundary of a leg's reach, where ``theta(X)`` has a square root:
there it goes over into another working mode.  Lengths are divided by a characteristic length.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.systems.platform.parallel_platform import ParallelPlatform
from graphsynth.systems.platform.plane import cross

Array = NDArray[np.float64]

_LARGEST = 0.05
_SMALLEST = 1e-8
_STEPS = 20000


class Traced(NamedTuple):
    """States (n, 5) in order; ``end`` is the leg (1 to 3) whose reach ends the curve, 0 if closed, -1 if lost."""

    states: Array
    end: int


class CurveEquations:
    """Closure of the legs and ``det JX`` at a fixed orientation, with their derivatives."""

    def __init__(self, platform: ParallelPlatform, alpha: float, unit: float) -> None:
        z = np.exp(1j * alpha)
        self.arm = [complex(z * b) / unit for b in platform.b]
        self.centre = [complex(D) / unit - a for D, a in zip(platform.D, self.arm)]
        self.l1, self.l2 = [l / unit for l in platform.l1], [l / unit for l in platform.l2]

    def legs(self, v: Array) -> tuple[list[complex], list[complex]]:
        """Rockers and links as vectors."""
        p = complex(v[0], v[1])
        rocker = [l * complex(math.cos(t), math.sin(t)) for l, t in zip(self.l1, v[2:])]
        return rocker, [p - c - e for c, e in zip(self.centre, rocker)]

    def reach(self, v: Array) -> Array:
        """``JT_k``: its sign is the working mode."""
        rocker, d = self.legs(v)
        return np.array([-2.0 * cross(e, x) for e, x in zip(rocker, d)])

    def reach_gradient(self, v: Array, k: int) -> Array:
        """Gradient of ``JT_k``."""
        rocker, d = self.legs(v)
        e, gradient = rocker[k], np.zeros(5)
        gradient[0], gradient[1] = 2.0 * e.imag, -2.0 * e.real
        gradient[2 + k] = 2.0 * ((e.conjugate() * d[k]).real + abs(e) ** 2)
        return gradient

    def evaluate(self, v: Array) -> tuple[Array, Array]:
        """Four residuals and their Jacobian (4, 5)."""
        rocker, d = self.legs(v)
        rows = [(x.real, x.imag, cross(a, x)) for a, x in zip(self.arm, d)]
        cofactor = [_cross3(rows[(k + 1) % 3], rows[(k + 2) % 3]) for k in range(3)]
        f, J = np.empty(4), np.zeros((4, 5))
        for k in range(3):
            x, e, c, a = d[k], rocker[k], cofactor[k], self.arm[k]
            length = abs(x)
            f[k] = (length - self.l2[k]) * (length + self.l2[k])
            J[k, 0], J[k, 1], J[k, 2 + k] = 2.0 * x.real, 2.0 * x.imag, -2.0 * cross(e, x)
            move = -1j * e
            J[3, 0] += c[0] - c[2] * a.imag
            J[3, 1] += c[1] + c[2] * a.real
            J[3, 2 + k] = c[0] * move.real + c[1] * move.imag + c[2] * cross(a, move)
        f[3] = rows[0][0] * cofactor[0][0] + rows[0][1] * cofactor[0][1] + rows[0][2] * cofactor[0][2]
        return f, J

    def correct(self, v: Array, row: Array) -> tuple[Array, Array] | None:
        """Newton iteration orthogonal to ``row``; the state and the Jacobian there, or None."""
        size = math.inf
        for _ in range(7):
            f, J = self.evaluate(v)
            try:
                step = np.linalg.solve(np.vstack([J, row]), np.append(-f, 0.0))
            except np.linalg.LinAlgError:
                return None
            v = v + step
            last, size = size, float(np.abs(step).max())
            if size <= 1e-14 or (size <= 1e-11 and size >= 0.5 * last):
                return v, self.evaluate(v)[1]
            if size > last:
                return None
        return (v, self.evaluate(v)[1]) if size <= 1e-11 else None

    def end(self, v: Array, k: int) -> Array | None:
        """Return the state at which leg k is stretched or folded, near ``v``."""
        size = math.inf
        for _ in range(12):
            f, J = self.evaluate(v)
            try:
                step = np.linalg.solve(np.vstack([J, self.reach_gradient(v, k)]), -np.append(f, self.reach(v)[k]))
            except np.linalg.LinAlgError:
                return None
            v, size = v + step, float(np.abs(step).max())
            if size <= 1e-13:
                return v
        return v if size <= 1e-10 else None


def trace(equations: CurveEquations, start: Array, sigma: tuple[int, ...], direction: Array) -> Traced:
    """Follow the curve from ``start`` until a leg reaches its boundary or the curve closes."""
    tangent = _tangent(equations.evaluate(start)[1], direction)
    first, v, states, step = tangent, start, [start], 0.01
    mode = np.array(sigma)
    for _ in range(_STEPS):
        found = equations.correct(v + step * tangent, tangent)
        turned = None if found is None else _tangent(found[1], tangent)
        if found is None or turned is None or float(turned @ tangent) < 0.985:
            step *= 0.5
            if step < _SMALLEST:
                return Traced(np.array(states), -1)
            continue
        new = found[0]
        reach = mode * equations.reach(new)
        crossed = np.flatnonzero(reach < 0.0)
        if crossed.size:
            before = mode * equations.reach(v)
            share = before / np.where(reach < 0.0, before - reach, np.inf)
            k = int(crossed[np.argmin(share[crossed])])
            ended = equations.end(v + float(share[k]) * (new - v), k)
            if ended is not None and np.abs(ended - v).max() <= 2.0 * step:
                return Traced(np.array([*states, ended]), k + 1)
            step *= 0.5
            if step < _SMALLEST:
                return Traced(np.array(states), -1)
            continue
        if len(states) > 2 and _closes(start, first, v, new):
            return Traced(np.array([*states, start]), 0)
        v, tangent = new, turned
        states.append(v)
        step = min(_LARGEST, 1.6 * step)
    return Traced(np.array(states), -1)


def _closes(start: Array, first: Array, v: Array, new: Array) -> bool:
    """Whether the step from v to new passes the start."""
    before, after = _difference(v, start), _difference(new, start)
    reach = float(np.linalg.norm(new - v))
    return bool(before @ first < 0.0 <= after @ first and np.linalg.norm(before) <= 1.2 * reach)


def _difference(a: Array, b: Array) -> Array:
    d = a - b
    d[2:] = np.mod(d[2:] + math.pi, math.tau) - math.pi
    return d


def _tangent(J: Array, along: Array) -> Array:
    """Return the unit null vector of the Jacobian with a positive component along ``along``."""
    t = np.linalg.svd(J)[2][-1]
    return np.asarray(-t if float(t @ along) < 0.0 else t)


def _cross3(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[float, float, float]:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
