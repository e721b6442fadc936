"""Circle and ellipse by exact fractions and many digits."""

from __future__ import annotations

from fractions import Fraction
from typing import Any


def clipped_parallelogram(R1: Fraction, a: Fraction, b: Fraction, e1: Fraction, e2: Fraction) -> list[Fraction]:
    """Bounds of u = x^2 and v = y^2 by clipping the parallelogram edge by edge."""
    span = a**2 - b**2
    corners = []
    for s1, s2 in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        Q, E = R1**2 + s1 * e1, 1 + s2 * e2
        corners.append((a**2 * (Q - b**2 * E) / span, b**2 * (a**2 * E - Q) / span))
    for axis in (0, 1):
        kept = []
        for p, q in zip(corners, corners[1:] + corners[:1]):
            if p[axis] >= 0:
                kept.append(p)
            if (p[axis] < 0) != (q[axis] < 0):
                t = p[axis] / (p[axis] - q[axis])
                kept.append((p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])))
        corners = kept
    u, v = zip(*corners)
    return [min(u), max(u), min(v), max(v)]


def hull_bounds(found: Any, expected: str) -> list[tuple[str, float, str, bool]]:
    """Name, bound found, bound printed, and whether the bound lies outside of the printed one."""
    names = ("x low", "x high", "y low", "y high")
    bounds = (found.hull.lo[0], found.hull.hi[0], found.hull.lo[1], found.hull.hi[1])
    rows = []
    for name, bound, text in zip(names, bounds, expected.split()):
        outward = (Fraction(text) - Fraction(float(bound))) * (1 if name.endswith("low") else -1)
        rows.append((name, bound, text, outward >= -Fraction(1, 10**22)))
    return rows


def exact_crescent(d: Fraction | float) -> tuple[Any, Any, Any]:
    """Point where the unit circle meets the ellipse of semi-axes ``1 + d`` and ``1 - d``, and the area outside it."""
    import mpmath as mp

    with mp.workdps(80):
        D = mp.mpf(d.numerator) / d.denominator if isinstance(d, Fraction) else mp.mpf(d)
        a, b = 1 + D, 1 - D
        x = a * mp.sqrt((1 - b * b) / (a * a - b * b))
        y = b * mp.sqrt((a * a - 1) / (a * a - b * b))
        return x, y, 2 * (a * b * mp.atan2(a * y, b * x) - mp.atan2(y, x))
