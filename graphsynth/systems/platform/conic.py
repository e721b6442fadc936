"""Type-II locus for fixed anchors (the 3-RPR view) at a fixed orientation: a conic, in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite, three_points
from graphsynth.systems.platform.plane import cross

__all__ = ["SingularConic", "singular_conic"]


@dataclass(frozen=True, eq=False)
class SingularConic:
    """``det JX = a x^2 + b x y + c y^2 + d x + e y + f`` for fixed anchors and orientation.

    Attributes
    ----------
    coefficients : tuple of 6 floats
        ``(a, b, c, d, e, f)``; ``det JX`` in length^4 for x, y in the fixed frame.
    discriminant : float
        ``b^2 - 4 a c``.
    kind : str
        "ellipse", "hyperbola", "parabola", "line", "nowhere" (constant, not zero) or "everywhere"; degenerate conics
        keep the name that the discriminant gives.  Floating point: a parabola is recognised to 1e-12.
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

    Parameters
    ----------
    anchors, vertices : array_like of complex, shape (3,)
        Joints A_k in the fixed frame, platform vertices b_k in the platform frame.
    alpha : float
        Orientation, radians.

    Returns
    -------
    SingularConic
        Exact but for rounding.

    Notes
    -----
    With ``q = p - g_1``, ``g_k = A_k - z b_k``, ``u_k = g_1 - g_k`` and ``t_k`` the third entries, the rows minus the
    first give ``det JX / 8 = t_1 cross(u_2, u_3) - t_2 cross(q, u_3) + t_3 cross(q, u_2)``: products of functions
    linear in p (theory/platform-workspace 2).

    Examples
    --------
    >>> singular_conic([0, 4, 2 + 3j], [0, 1, 0.5 + 0.5j], 0.3).kind
    'ellipse'
    """
    A, b = np.array(three_points("anchors", anchors)), np.array(three_points("vertices", vertices))
    arm = np.exp(1j * finite("alpha", alpha)) * b
    g = A - arm
    u2, u3 = complex(g[0] - g[1]), complex(g[0] - g[2])
    t1 = _moment(arm[0], g[0])
    t2 = _moment(arm[1], g[1]) - t1
    t3 = _moment(arm[2], g[2]) - t1
    quadratic = _product(t3, _turned(u2, g[0])) - _product(t2, _turned(u3, g[0]))
    quadratic[3:] += cross(u2, u3) * t1
    c = tuple(float(8.0 * value) for value in quadratic)
    discriminant = c[1] ** 2 - 4.0 * c[0] * c[2]
    size = float(max(np.abs(g - g[0]).max(), np.abs(arm).max(), 1e-300))
    return SingularConic((c[0], c[1], c[2], c[3], c[4], c[5]), discriminant, _kind(c, discriminant, size))


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


def _turned(u: complex, g: complex) -> NDArray[np.float64]:
    """``cross(p - g, u)`` as coefficients of (x, y, 1)."""
    return np.array([u.imag, -u.real, -cross(g, u)])


def _product(s: NDArray[np.float64], t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Product of two linear functions as coefficients of (xx, xy, yy, x, y, 1)."""
    return np.array(
        [s[0] * t[0], s[0] * t[1] + s[1] * t[0], s[1] * t[1], s[0] * t[2] + s[2] * t[0], s[1] * t[2] + s[2] * t[1],
         s[2] * t[2]]
    )  # fmt: skip
