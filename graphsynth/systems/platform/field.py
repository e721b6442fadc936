"""Grids of poses, quantities at many poses of one working mode, and curves at a fixed orientation in closed form.

The circles bound the workspace of a leg; the conic is the type-II locus for fixed anchors (the 3-RPR view).
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite, sign, three, three_points, whole
from graphsynth.systems.platform.parallel_platform import ParallelPlatform, cross

Array = NDArray[np.float64]


def working_mode(sigma: Sequence[int]) -> tuple[int, int, int]:
    """Return the working mode as a tuple; `GeometryError` unless it has three entries +1 or -1."""
    first, second, third = (sign(f"sigma of leg {k}", s) for k, s in enumerate(three("sigma", sigma), 1))
    return first, second, third


def characteristic_length(platform: ParallelPlatform) -> float:
    """Default of ``Lc``: the largest distance of a platform vertex from the reference point, or else of a link."""
    return max(abs(b) for b in platform.b) or max(*platform.l2, *platform.l1)


def pose_grid(platform: ParallelPlatform, alpha: float | None, nodes: int) -> tuple[Array, Array]:
    """Nodes along x and y over a rectangle that holds the workspace at ``alpha`` (all orientations if None).

    The nodes are the centres of ``nodes`` equal strips, so none lies on the edge.
    """
    nodes = whole("nodes", nodes, 1)
    b, D = np.array(platform.b), np.array(platform.D)
    reach = np.array(platform.l1) + np.array(platform.l2)
    if alpha is None:
        centre, reach = D, reach + np.abs(b)
    else:
        centre = D - np.exp(1j * alpha) * b
    low = (np.max(centre.real - reach), np.max(centre.imag - reach))
    high = (np.min(centre.real + reach), np.min(centre.imag + reach))
    high = tuple(h if h > l else l + 1e-9 * float(reach.max()) for l, h in zip(low, high))  # an empty workspace
    steps = (np.arange(nodes) + 0.5) / nodes
    return low[0] + (high[0] - low[0]) * steps, low[1] + (high[1] - low[1]) * steps


def poses_at(positions: ArrayLike, alpha: float) -> Array:
    """Poses (..., 3) at complex positions (...) and one orientation."""
    p = np.asarray(positions, dtype=np.complex128)
    return np.stack([p.real, p.imag, np.full(p.shape, alpha)], axis=-1)


def determinant(matrix: Array) -> Array:
    """Return the determinants (...) of (..., 3, 3); NaN passes silently, unlike in ``numpy.linalg.det``."""
    return np.asarray((matrix[..., 0, :] * np.cross(matrix[..., 1, :], matrix[..., 2, :])).sum(axis=-1))


def scaled_rows(JX: Array, Lc: float) -> Array:
    """``JX`` with its third column divided by the characteristic length, all entries in lengths."""
    return np.asarray(JX * np.array([1.0, 1.0, 1.0 / Lc]))


#: Range (low, high) of a rocker angle in radians; None for no limit.
Limits = tuple[float, float] | None


class BoundaryCircle(NamedTuple):
    """One circle that bounds the reach of a leg.

    ``leg`` is 1 to 3; ``side`` is "outer" (leg stretched), "inner" (leg folded), "lower limit" or "upper limit"
    (rocker at a joint limit).  ``sense`` is +1 if the allowed side is inside the circle, -1 if outside.  ``angle`` is
    the rocker angle of a limit, NaN for the others.
    """

    leg: int
    side: str
    centre: complex
    radius: float
    sense: int
    angle: float = math.nan


@checked
def leg_circles(
    platform: ParallelPlatform, alpha: float, sigma: tuple[int, ...] | None, limits: tuple[Limits, ...]
) -> list[BoundaryCircle]:
    """Circles of all legs at orientation ``alpha``; circles of radius zero bound nothing and are left out.

    A rocker at a limit fixes its joint A, so the platform vertex then moves on a circle of radius l2 about A.  Going
    outward on it changes theta by the sign of ``-sigma``, which gives the allowed side.
    """
    z = cmath.exp(1j * alpha)
    found = []
    for k in range(3):
        l1, l2, centre = platform.l1[k], platform.l2[k], platform.D[k] - z * platform.b[k]
        found.append(BoundaryCircle(k + 1, "outer", centre, l1 + l2, 1))
        if l1 != l2:
            found.append(BoundaryCircle(k + 1, "inner", centre, abs(l1 - l2), -1))
        bounds = limits[k]
        if bounds is not None and sigma is not None:
            for side, angle, sense in (("lower limit", bounds[0], sigma[k]), ("upper limit", bounds[1], -sigma[k])):
                found.append(BoundaryCircle(k + 1, side, centre + l1 * cmath.exp(1j * angle), l2, sense, angle))
    return found


def meet(a: BoundaryCircle, b: BoundaryCircle, tolerance: float) -> tuple[str, tuple[complex, ...]]:
    """Tell how two circles lie, "apart", "crossing", "tangent" or "coincident", and their common points.

    Closer than ``tolerance`` (a length) counts as tangent or coincident.
    """
    gap = b.centre - a.centre
    d, total, difference = abs(gap), a.radius + b.radius, a.radius - b.radius
    if d <= tolerance and abs(difference) <= tolerance:
        return "coincident", ()
    if d == 0.0:
        return "apart", ()
    unit = gap / d
    if abs(d - total) <= tolerance:
        return "tangent", (a.centre + a.radius * unit,)
    if abs(d - abs(difference)) <= tolerance:
        larger = a if difference > 0.0 else b
        return "tangent", (larger.centre + larger.radius * (unit if difference > 0.0 else -unit),)
    if d > total or d < abs(difference):
        return "apart", ()
    along = 0.5 * (d + difference * total / d)
    across = math.sqrt((total - d) * (total + d) * (d - difference) * (d + difference)) / (2.0 * d)
    return "crossing", (a.centre + unit * (along + 1j * across), a.centre + unit * (along - 1j * across))


@dataclass(frozen=True, eq=False)
class SingularConic:
    """``det JX = a x^2 + b x y + c y^2 + d x + e y + f`` for fixed anchors and orientation.

    * `coefficients`: ``(a, b, c, d, e, f)``; ``det JX`` in length^4 for x, y in the fixed frame.
    * `discriminant`: ``b^2 - 4 a c``.
    * `kind`: "ellipse", "hyperbola", "parabola" (to 1e-12), "line", "nowhere" (constant, not zero) or "everywhere";
      degenerate conics keep the name that the discriminant gives.
    """

    coefficients: tuple[float, float, float, float, float, float]
    discriminant: float
    kind: str

    def __call__(self, points: ArrayLike) -> NDArray[np.float64]:
        """``det JX`` at positions (complex, any shape)."""
        p = np.asarray(points, dtype=np.complex128)
        a, b, c, d, e, f = self.coefficients
        x, y = p.real, p.imag
        return np.asarray((a * x + b * y + d) * x + (c * y + e) * y + f)


@checked
def singular_conic(anchors: ArrayLike, vertices: ArrayLike, alpha: float) -> SingularConic:
    """Locus of ``det JX = 0`` over the position for fixed anchors A_k and orientation.

    `anchors`, `vertices` (shape (3,), complex): joints A_k in the fixed frame, platform vertices b_k in the platform
    frame. `alpha`: orientation, radians. Exact but for rounding. With ``q = p - g_1``, ``g_k = A_k - z b_k``, ``u_k =
    g_1 - g_k`` and ``t_k`` the third entries, the rows minus the first give ``det JX / 8 = t_1 cross(u_2, u_3) - t_2
    cross(q, u_3) + t_3 cross(q, u_2)``: products of functions linear in p (theory/platform-workspace 2).

    >>> singular_conic([0, 4, 2 + 3j], [0, 1, 0.5 + 0.5j], 0.3).kind
    'ellipse'
    """
    A, b = np.array(three_points("anchors", anchors)), np.array(three_points("vertices", vertices))
    arm = np.exp(1j * finite("alpha", alpha)) * b
    g = A - arm
    u2, u3 = complex(g[0] - g[1]), complex(g[0] - g[2])
    t1 = _moment(arm[0], g[0])
    t2, t3 = (_moment(arm[k], g[k]) - t1 for k in (1, 2))
    P = np.outer(t2, _moment(u3, g[0])) - np.outer(t3, _moment(u2, g[0]))
    P = P + P.T
    quadratic = np.array([0.5 * P[0, 0], P[0, 1], 0.5 * P[1, 1], P[0, 2], P[1, 2], 0.5 * P[2, 2]])
    quadratic[3:] += cross(u2, u3) * t1
    c = tuple((8.0 * quadratic).tolist())
    discriminant = c[1] ** 2 - 4.0 * c[0] * c[2]
    size = float(max(np.abs(g - g[0]).max(), np.abs(arm).max(), 1e-300))
    return SingularConic(c, discriminant, _kind(c, discriminant, size))


def _kind(c: tuple[float, ...], discriminant: float, size: float) -> str:
    square = max(map(abs, c[:3]))
    if square <= 1e-12 * size**2:
        if max(map(abs, c[3:5])) > 1e-12 * size**3:
            return "line"
        return "nowhere" if abs(c[5]) > 1e-12 * size**4 else "everywhere"
    if abs(discriminant) <= 1e-12 * square**2:
        return "parabola"
    return "ellipse" if discriminant < 0.0 else "hyperbola"


def _moment(arm: complex, g: complex) -> NDArray[np.float64]:
    """``cross(arm, p - g)`` as coefficients of (x, y, 1)."""
    return np.array([-arm.imag, arm.real, -cross(arm, g)])
