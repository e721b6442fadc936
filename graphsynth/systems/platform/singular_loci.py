"""Singular loci at a fixed orientation: circles of type I, curves of type II for each working mode.

A type-II curve is smooth in (x, y, theta_1, theta_2, theta_3), where pseudo-arclength traces it: in these unknowns it
passes smoothly through the boundary of a leg's reach, where ``theta(X)`` has a square root: there it goes over into
another working mode.  Lengths are divided by a characteristic length.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import checked, finite, whole
from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.field import (
    BoundaryCircle,
    characteristic_length,
    determinant,
    leg_circles,
    pose_grid,
    poses_at,
    working_mode,
)
from graphsynth.systems.platform.parallel_platform import WORKING_MODES, ParallelPlatform, cross
from graphsynth.systems.platform.workspace import Arc, constant_orientation_workspace

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_ARC_SAMPLES = 400


@dataclass(frozen=True, eq=False)
class SingularCurve:
    """One curve ``det JX = 0`` of one working mode.

    * `sigma`: working mode.
    * `points` (shape (n,), complex): positions of the platform, in order; the first is repeated at the end of a closed
      curve.
    * `theta` (shape (n, 3)): rocker angles, continuous along the curve.
    * `ends`: legs (1 to 3) on whose type-I circles the curve begins and ends; empty if it is closed.  0 marks an end
      that was lost (the step became too small); see ``complete``.
    * `residual`: largest closure error and ``|det JX|``, relative to powers of the characteristic length.
    """

    sigma: tuple[int, int, int]
    points: Complex
    theta: Array
    ends: tuple[int, ...]
    residual: float

    @property
    def closed(self) -> bool:
        """Whether the curve is a loop."""
        return not self.ends

    @property
    def complete(self) -> bool:
        """Whether the curve was followed to both ends."""
        return 0 not in self.ends


@dataclass(frozen=True, eq=False)
class SingularLoci:
    """Loci at one orientation.

    * `circles`: type I, the same for all working modes; exact.
    * `curves`: type II; estimated, see `type_two_curves`.
    * `points`: isolated points of type II, where a loop has shrunk to a point; see `isolated_singular_points`.
    * `nodes`: of the grid.
    """

    alpha: float
    circles: tuple[BoundaryCircle, ...]
    curves: tuple[SingularCurve, ...]
    points: tuple[tuple[tuple[int, int, int], complex], ...]
    nodes: int

    def of_mode(self, sigma: tuple[int, ...]) -> tuple[SingularCurve, ...]:
        """Curves of one working mode."""
        return tuple(curve for curve in self.curves if curve.sigma == working_mode(sigma))


@checked
def type_one_circles(platform: ParallelPlatform, alpha: float) -> tuple[BoundaryCircle, ...]:
    """Circles on which a leg is stretched ("outer") or folded ("inner"); exact."""
    return tuple(leg_circles(platform, finite("alpha", alpha), None, (None, None, None)))


@checked
def singular_loci(platform: ParallelPlatform, alpha: float, *, nodes: int = 120) -> SingularLoci:
    """Type-I circles and the type-II curves of all eight working modes at orientation ``alpha`` (radians).

    >>> loci = singular_loci(ParallelPlatform.mock(), 0.0, nodes=60)
    >>> len(loci.circles), all(curve.residual < 1e-12 for curve in loci.curves)
    (6, True)
    """
    modes = [working_mode([int(s) for s in mode]) for mode in WORKING_MODES]
    curves = [curve for mode in modes for curve in type_two_curves(platform, alpha, mode, nodes=nodes)]
    points = [(mode, p) for mode in modes for p in isolated_singular_points(platform, alpha, mode, nodes=nodes)]
    return SingularLoci(float(alpha), type_one_circles(platform, alpha), tuple(curves), tuple(points), nodes)


@checked
def type_two_curves(
    platform: ParallelPlatform, alpha: float, sigma: tuple[int, ...], *, nodes: int = 120
) -> tuple[SingularCurve, ...]:
    """Curves ``det JX = 0`` of a working mode at a fixed orientation.

    `alpha`: orientation, radians. `sigma`: of {+1, -1}. `nodes`: grid nodes along x and y. Every point satisfies the
    equations to rounding.  That no curve is missing is estimated: those that end on the boundary of the workspace are
    found by sign changes along it (400 samples per arc), closed loops by sign changes on the grid, so a loop smaller
    than a cell can be missed. Raises `GeometryError`: a leg with a link of length zero (its working modes coincide), or
    fewer than 8 nodes. See theory/platform-workspace 2; pseudo-arclength continuation: [Allgower & Georg 1990].
    """
    mode = working_mode(sigma)
    alpha = finite("alpha", alpha)
    nodes = whole("nodes", nodes, 8, 100_000)  # fewer find no curves
    for leg, lengths in enumerate(zip(platform.l1, platform.l2), start=1):
        if min(lengths) == 0.0:
            raise GeometryError(f"leg {leg} has a link of length zero, so its working modes coincide; give l1, l2 > 0")
    equations = CurveEquations(platform, alpha, characteristic_length(platform))
    curves: list[SingularCurve] = []
    for state, leg in _boundary_seeds(equations, mode):
        if not _known(equations, curves, state, ends_only=True):
            gradient = mode[leg - 1] * equations.reach_gradient(state, leg - 1)
            curves.append(_curve(equations, mode, leg, [trace(equations, state, mode, gradient)]))
    for state in _grid_seeds(equations, mode, nodes):
        if _known(equations, curves, state):
            continue
        found = equations.correct(state, np.linalg.svd(equations.evaluate(state)[1])[2][-1])
        if found is None or (np.array(mode) * equations.reach(found[0]) <= 0.0).any():
            continue
        along = np.linalg.svd(found[1])[2][-1]
        parts = [trace(equations, found[0], mode, along)]
        if parts[0][1] != 0:
            parts.append(trace(equations, found[0], mode, -along))
        curve = _curve(equations, mode, 0, parts)
        path = equations.states(curve.points, curve.theta)
        if curve.ends:  # an end belongs to one curve of a mode
            known = any(_known(equations, curves, state, ends_only=True) for state in path[[0, -1]])
        else:  # a loop is compared by its points
            loops = [c for c in curves if c.closed and abs(len(c.points) - len(path)) < 0.2 * len(path) + 10]
            sample = path[:: max(1, len(path) // 12)]
            known = sum(_known(equations, loops, state) for state in sample) > 0.7 * len(sample)
        if not known:
            curves.append(curve)
    return tuple(curves)


@checked
def isolated_singular_points(
    platform: ParallelPlatform, alpha: float, sigma: tuple[int, ...], *, nodes: int = 120
) -> tuple[complex, ...]:
    """Positions where ``det JX`` touches zero without changing its sign: loops shrunk to a point.

    Local minima of ``|det JX|`` on the grid are refined on smaller grids; kept if the value is below 1e-10 of the
    product of the rows of JX (estimated; such points exist at single orientations only).

    >>> import numpy as np
    >>> points = isolated_singular_points(ParallelPlatform.mock(), 2.0 * np.arctan(3.0 / 7.0), (-1, -1, -1))
    >>> len(points), abs(points[0]) < 1e-3
    (1, True)
    """
    mode, alpha = working_mode(sigma), finite("alpha", alpha)
    x, y = pose_grid(platform, alpha, nodes)
    step = max(float(x[1] - x[0]), float(y[1] - y[0]))

    def value(p: Complex) -> Array:
        X = poses_at(p, alpha)
        JX, _ = platform.jacobians(X, platform.inverse(X, mode).theta)
        return np.asarray(determinant(JX) / np.linalg.norm(JX, axis=-1).prod(axis=-1))

    g = value(x[:, None] + 1j * y[None, :])
    inner, size = g[1:-1, 1:-1], np.abs(g)
    least = np.isfinite(inner) & (np.abs(inner) < 0.05)
    for i, j in np.ndindex(3, 3):
        other = (slice(i, i + nodes - 2), slice(j, j + nodes - 2))
        least &= (size[other] >= np.abs(inner)) & (g[other] * inner > 0.0)
    rows, columns = np.nonzero(least)
    if not rows.size:
        return ()
    centre, sign = x[rows + 1] + 1j * y[columns + 1], np.sign(inner[rows, columns])
    local = (np.arange(-3, 4)[:, None] + 1j * np.arange(-3, 4)[None, :]).ravel() / 3.0
    first, values = centre, np.abs(inner[rows, columns])
    for _ in range(40):  # the best node of a 7 x 7 grid about each candidate, then a smaller grid
        around = np.asarray(centre[:, None] + step * local, dtype=np.complex128)
        size = np.nan_to_num(sign[:, None] * value(around), nan=1.0)
        best = np.argmin(size, axis=1)
        centre, values = around[np.arange(len(best)), best], size[np.arange(len(best)), best]
        step *= 0.6
    keep = (np.abs(values) <= 1e-10) & (np.abs(centre - first) <= 3.0 * float(x[1] - x[0] + y[1] - y[0]))
    return tuple(complex(p) for p in centre[keep])


def _curve(
    equations: CurveEquations, mode: tuple[int, int, int], leg: int, parts: list[tuple[Array, int]]
) -> SingularCurve:
    states, end = parts[0]
    if len(parts) == 2:
        states = np.concatenate([parts[1][0][::-1], states[1:]])
        ends: tuple[int, ...] = (max(parts[1][1], 0), max(end, 0))
    else:
        ends = () if end == 0 else (leg, max(end, 0))
    residual = max(float(np.abs(equations.evaluate(state)[0]).max()) for state in states)
    points = np.asarray(equations.unit * (states[:, 0] + 1j * states[:, 1]), dtype=np.complex128)
    return SingularCurve(mode, points, states[:, 2:], ends, residual)


def _known(equations: CurveEquations, curves: list[SingularCurve], state: Array, *, ends_only: bool = False) -> bool:
    """Whether a state lies on a traced curve (or is one of its ends)."""
    for curve in curves:
        path = equations.states(curve.points, curve.theta)
        if ends_only:
            path = path[[0, -1]] if curve.ends else path[:0]
        d = path - state
        d[:, 2:] -= math.tau * np.round(d[:, 2:] / math.tau)
        if ends_only:
            if (np.abs(d).max(axis=1) < 1e-7).any():
                return True
            continue
        chord = np.diff(path, axis=0)
        length = np.einsum("ij,ij->i", chord, chord)
        share = np.clip(-np.einsum("ij,ij->i", d[:-1], chord) / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
        gap = np.linalg.norm(d[:-1] + share[:, None] * chord, axis=1)
        if (gap <= 1e-6 + 0.03 * np.sqrt(length)).any():
            return True
    return False


def _boundary_seeds(equations: CurveEquations, mode: tuple[int, int, int]) -> list[tuple[Array, int]]:
    """Find the ends of curves on the boundary of the workspace: states and legs."""
    seeds = []
    for arc in constant_orientation_workspace(equations.platform, equations.alpha).arcs:
        leg = arc.circle.leg
        t = arc.start + (arc.stop - arc.start) * (np.arange(_ARC_SAMPLES) + 0.5) / _ARC_SAMPLES
        t = np.concatenate([[arc.start + 1e-9 * (t[1] - t[0])], t, [arc.stop - 1e-9 * (t[1] - t[0])]])
        values = _on_arc(equations, mode, arc, t)[0]
        change = values[:-1] * values[1:] < 0.0
        a, b, first = t[:-1][change], t[1:][change], values[:-1][change]
        for _ in range(20 if change.any() else 0):
            middle = 0.5 * (a + b)
            same = _on_arc(equations, mode, arc, middle)[0] * first > 0.0
            a, b = np.where(same, middle, a), np.where(same, b, middle)
        _, p, theta = _on_arc(equations, mode, arc, a)
        for state in equations.states(p, theta):
            found = equations.end(state, leg - 1)
            if found is not None:
                seeds.append((found, leg))
    return seeds


def _on_arc(equations: CurveEquations, mode: tuple[int, int, int], arc: Arc, t: Array) -> tuple[Array, Complex, Array]:
    """``det JX``, positions and rocker angles on an arc of the boundary, where the arc's own leg has one angle."""
    platform, k, p = equations.platform, arc.circle.leg - 1, arc.point(t)
    X = poses_at(p, equations.alpha)
    theta = platform.inverse(X, mode).theta.copy()
    back = arc.circle.side == "inner" and platform.l1[k] < platform.l2[k]
    theta[:, k] = t + (math.pi if back else 0.0)
    return determinant(platform.jacobians(X, theta)[0]), p, theta


def _grid_seeds(equations: CurveEquations, mode: tuple[int, int, int], nodes: int) -> Array:
    """Zeros of ``det JX`` on the edges of the grid, states (n, 5)."""
    platform, alpha = equations.platform, equations.alpha

    def value(p: Complex) -> tuple[Array, Array]:
        X = poses_at(p, alpha)
        theta = platform.inverse(X, mode).theta
        return determinant(platform.jacobians(X, theta)[0]), theta

    x, y = pose_grid(platform, alpha, nodes)
    p = x[:, None] + 1j * y[None, :]
    g = value(p)[0]
    horizontal, vertical = g[:-1] * g[1:] < 0.0, g[:, :-1] * g[:, 1:] < 0.0
    a = np.concatenate([p[:-1][horizontal], p[:, :-1][vertical]])
    b = np.concatenate([p[1:][horizontal], p[:, 1:][vertical]])
    low = np.concatenate([g[:-1][horizontal], g[:, :-1][vertical]])
    for _ in range(30):
        middle = 0.5 * (a + b)
        same = value(middle)[0] * low > 0.0
        a, b = np.where(same, middle, a), np.where(same, b, middle)
    g, theta = value(a)
    return equations.states(a, theta)[np.isfinite(g)]


_LARGEST = 0.05
_SMALLEST = 1e-8
_STEPS = 20000


class CurveEquations:
    """Closure of the legs and ``det JX`` at a fixed orientation, with their derivatives."""

    def __init__(self, platform: ParallelPlatform, alpha: float, unit: float) -> None:
        self.platform, self.alpha, self.unit = platform, alpha, unit
        z = np.exp(1j * alpha)
        self.arm = [complex(z * b) / unit for b in platform.b]
        self.centre = [complex(D) / unit - a for D, a in zip(platform.D, self.arm)]
        self.l1, self.l2 = [l / unit for l in platform.l1], [l / unit for l in platform.l2]

    def states(self, p: Complex, theta: Array) -> Array:
        """States (n, 5) at positions and rocker angles."""
        return np.column_stack([p.real / self.unit, p.imag / self.unit, theta])

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


def trace(equations: CurveEquations, start: Array, sigma: tuple[int, ...], direction: Array) -> tuple[Array, int]:
    """Follow the curve from ``start`` until a leg reaches its boundary or the curve closes.

    The states (n, 5) in order, and the leg (1 to 3) whose reach ends the curve, 0 if closed, -1 if lost.
    """
    tangent = _tangent(equations.evaluate(start)[1], direction)
    first, v, states, step = tangent, start, [start], 0.01
    mode = np.array(sigma)
    for _ in range(_STEPS):
        found = equations.correct(v + step * tangent, tangent)
        turned = None if found is None else _tangent(found[1], tangent)
        if found is None or turned is None or float(turned @ tangent) < 0.985:
            step *= 0.5
            if step < _SMALLEST:
                break
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
                return np.array([*states, ended]), k + 1
            step *= 0.5
            if step < _SMALLEST:
                break
            continue
        gaps = np.array([v, new]) - start
        gaps[:, 2:] = np.mod(gaps[:, 2:] + math.pi, math.tau) - math.pi
        passed = gaps[0] @ first < 0.0 <= gaps[1] @ first
        if len(states) > 2 and passed and np.linalg.norm(gaps[0]) <= 1.2 * np.linalg.norm(new - v):
            return np.array([*states, start]), 0
        v, tangent = new, turned
        states.append(v)
        step = min(_LARGEST, 1.6 * step)
    return np.array(states), -1


def _tangent(J: Array, along: Array) -> Array:
    """Return the unit null vector of the Jacobian with a positive component along ``along``."""
    t = np.linalg.svd(J)[2][-1]
    return np.asarray(-t if float(t @ along) < 0.0 else t)


def _cross3(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[float, float, float]:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
