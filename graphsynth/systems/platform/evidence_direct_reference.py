"""All assembly modes of the platform with 50 digits: the reference of every other way.

The closure condition itself is sampled, interpolated, and its roots are found in the complex plane: no coefficient
formula, no isolation and no iteration of the library is used.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from graphsynth.systems.platform.parallel_platform import ParallelPlatform

__all__ = ["DIGITS", "precise_anchors", "precise_modes"]

Array = NDArray[np.float64]
DIGITS = 50


def precise_modes(anchors: Sequence[Any], vertices: Sequence[complex], lengths: Sequence[float]) -> Array:
    """Return all assembly modes (x, y, alpha) of one problem (3-RPR), found with 50 digits; shape (m, 3), by alpha.

    For a rotation ``z = exp(i alpha)`` two differences of the closure equations are linear in the position; put into
    the third they give a trigonometric polynomial of degree three, sampled at eight angles and interpolated.  Its roots
    on the unit circle are the modes.

    Parameters
    ----------
    anchors : sequence of 3 complex or mpmath numbers
    vertices : sequence of 3 complex
    lengths : sequence of 3 floats

    Examples
    --------
    >>> corner = [complex(np.exp(2j * np.pi * k / 3)) for k in range(3)]
    >>> precise_modes([2 * c for c in corner], corner, [1.5] * 3)[:, 2].round(6).tolist()
    [-0.812756, 0.812756]
    """
    import mpmath

    with mpmath.workdps(DIGITS + 20):
        A, b = [mpmath.mpc(v) for v in anchors], [mpmath.mpc(v) for v in vertices]
        l2 = [mpmath.mpf(v) for v in lengths]

        def parts(z: Any) -> tuple[Any, Any, Any, list[Any]]:
            w = [z * b[k] - A[k] for k in range(3)]  # p + w_k is the leg
            r = [l2[k] ** 2 - abs(w[k]) ** 2 for k in range(3)]
            u, v = w[1] - w[0], w[2] - w[0]  # 2 Re(p conj u) = r1 - r0
            det = (mpmath.conj(u) * v).imag
            top = (v * (r[1] - r[0]) - u * (r[2] - r[0])) / (2j)  # det * p
            return det, top, r[0], w

        def condition(alpha: Any) -> Any:
            det, top, r0, w = parts(mpmath.expj(alpha))
            return abs(top) ** 2 + 2 * det * (top * mpmath.conj(w[0])).real - det * det * r0

        nodes = [2 * mpmath.pi * k / 8 for k in range(8)]
        values = [condition(alpha) for alpha in nodes]
        coefficients = [
            sum(g * mpmath.expj(-m * alpha) for g, alpha in zip(values, nodes)) / 8 for m in range(3, -4, -1)
        ]
        scale = max(abs(c) for c in coefficients)
        while abs(coefficients[0]) < scale * mpmath.mpf(10) ** (-DIGITS):  # the degree drops
            coefficients = coefficients[1:-1]
        roots = mpmath.polyroots(coefficients, maxsteps=500, extraprec=400)
        found = []
        for z in roots:
            if abs(abs(z) - 1) < mpmath.mpf(10) ** (-DIGITS // 2):
                alpha = mpmath.arg(z)
                det, top, _, _ = parts(mpmath.expj(alpha))
                p = top / det
                found.append((float(alpha), float(p.real), float(p.imag)))
        return np.array([(x, y, alpha) for alpha, x, y in sorted(found)]).reshape(-1, 3)


def precise_anchors(platform: ParallelPlatform, theta: Array) -> list[Any]:
    """Elbows with 50 digits from the doubles given."""
    import mpmath

    with mpmath.workdps(DIGITS + 20):
        return [
            mpmath.mpc(D) + mpmath.mpf(arm) * mpmath.expj(mpmath.mpf(float(t)))
            for D, arm, t in zip(platform.D, platform.l1, theta)
        ]
