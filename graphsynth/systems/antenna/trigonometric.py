"""Real roots of trigonometric polynomials of degree one and two over a full turn."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["TrigRoot", "quadratic_roots", "sinusoid_roots"]

#: A local extremum of this part of the sum of the coefficients counts as a double root.
TOUCH = 1e-13
#: The turn is cut here beyond pi, at no special angle, so that no root of a simple problem lies on the cut.
SEAM = 0.0123456789


class TrigRoot(NamedTuple):
    """A root in (-pi, pi] and its order: 1, or 2 where the function touches zero."""

    angle: float
    order: int


def _wrap(angle: float) -> float:
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped == -math.pi else wrapped


def sinusoid_roots(a: float, b: float, c: float) -> list[TrigRoot]:
    """Roots of ``a cos t + b sin t = c`` in closed form, without cancellation between ``hypot(a, b)`` and ``|c|``."""
    reach = math.hypot(a, b)
    rest = (reach - c) * (reach + c)
    if reach == 0.0 or rest < -TOUCH * reach * reach:
        return []
    if rest <= TOUCH * reach * reach:
        return [TrigRoot(math.atan2(math.copysign(b, b * c), math.copysign(a, a * c)), 2)]
    root = math.sqrt(rest)
    return sorted(TrigRoot(math.atan2(b * c + s * a * root, a * c - s * b * root), 1) for s in (-1.0, 1.0))


def quadratic_roots(coefficients: tuple[float, float, float, float, float]) -> list[TrigRoot]:
    """Roots of ``c0 + c1 cos t + s1 sin t + c2 cos 2t + s2 sin 2t``, at most four counted with their order.

    Brackets between the critical points (eigenvalues of a companion matrix) make every sign change found; a critical
    value below 1e-13 of the coefficients is reported as a double root.
    """
    from scipy.optimize import brentq

    c0, c1, s1, c2, s2 = coefficients
    size = sum(map(abs, coefficients))
    if size == 0.0:
        return []

    def value(t: float) -> float:
        return c0 + c1 * math.cos(t) + s1 * math.sin(t) + c2 * math.cos(2 * t) + s2 * math.sin(2 * t)

    critical = _critical_points(c1, s1, c2, s2)
    double = [t for t in critical if abs(value(t)) <= TOUCH * size]
    found = [TrigRoot(t, 2) for t in double]

    def touched(t: float, distance: float = 1e-9) -> bool:
        return any(abs(math.remainder(t - other, math.tau)) < distance for other in double)

    # around a double root the sign is rounding noise: no mark there but the root itself
    even = [t for t in (np.linspace(-math.pi, math.pi, 17)[1:] + SEAM).tolist() if not touched(t, 1e-3)]
    marks = sorted({*(t if t > SEAM - math.pi else t + math.tau for t in critical), *even})
    for left, right in zip([marks[-1] - math.tau, *marks[:-1]], marks):
        f, g = value(left), value(right)
        if touched(left) or touched(right):
            # beside a double root the sign is that of the other end: an odd number of changes is left to it
            near, far = (left, right) if touched(left) else (right, left)
            inner = value(near + math.copysign(1e-4, far - near)) if abs(far - near) > 1e-3 else 0.0
            if not touched(far) and inner * value(far) < 0.0:
                low, high = sorted((near + math.copysign(1e-4, far - near), far))
                found.append(TrigRoot(_wrap(brentq(value, low, high, xtol=4e-16, rtol=8.9e-16)), 1))
        elif f < 0.0 < g or g < 0.0 < f:
            found.append(TrigRoot(_wrap(brentq(value, left, right, xtol=4e-16, rtol=8.9e-16)), 1))
        elif g == 0.0:
            found.append(TrigRoot(_wrap(right), 1))
    return sorted(found)


def _critical_points(c1: float, s1: float, c2: float, s2: float) -> list[float]:
    """Angles where the derivative vanishes, improved by Newton's method."""
    # derivative: s1 cos t - c1 sin t + 2 s2 cos 2t - 2 c2 sin 2t, as a polynomial in z = exp(i t)
    polynomial: NDArray[np.complex128] = np.array(
        [s2 + 1j * c2, 0.5 * (s1 + 1j * c1), 0.0, 0.5 * (s1 - 1j * c1), s2 - 1j * c2]
    )
    largest = np.abs(polynomial).max()
    if largest < 1e-280:
        return []
    z = np.roots(np.where(np.abs(polynomial) < 1e-30 * largest, 0.0, polynomial / largest))
    points: list[float] = []
    for t in np.angle(z[np.abs(np.abs(z) - 1.0) < 1e-4]).tolist():
        for _ in range(3):
            slope = s1 * math.cos(t) - c1 * math.sin(t) + 2 * (s2 * math.cos(2 * t) - c2 * math.sin(2 * t))
            bend = -s1 * math.sin(t) - c1 * math.cos(t) - 4 * (s2 * math.sin(2 * t) + c2 * math.cos(2 * t))
            if bend == 0.0 or abs(slope) > 0.01 * abs(bend):
                break
            t -= slope / bend
        if not any(abs(math.remainder(t - other, math.tau)) < 1e-9 for other in points):
            points.append(_wrap(t))
    return points
