"""Equations of the nine-point problem, their slopes and symmetries, for any kind of numbers (theory/nine-points 1, 2).

What has ``+``, ``-`` and ``*`` will do: arrays of complex numbers, balls, numbers of many digits.
"""

from __future__ import annotations

from typing import Any


def dyad(pivot: tuple[Any, Any], joint: tuple[Any, Any], p: Any, q: Any) -> tuple[Any, Any, Any]:
    """Coefficients c, k, e of the equation ``c g + k g* + e = 0`` of one dyad at the point p, conjugate q."""
    (a, aa), (x, xx) = pivot, joint
    return x * (q - aa), xx * (p - a), p * (xx - aa) + q * (x - a) + p * q


def minors(z: Any, p: Any, q: Any) -> tuple[Any, Any, Any, tuple[Any, ...], tuple[Any, ...]]:
    """Minors u, v, w of the coefficients of both dyads, so that ``g = u / w``, ``g* = v / w``, and these."""
    one, two = dyad(z[0:2], z[2:4], p, q), dyad(z[4:6], z[6:8], p, q)
    (c1, k1, e1), (c2, k2, e2) = one, two
    return k1 * e2 - k2 * e1, e1 * c2 - e2 * c1, c1 * k2 - c2 * k1, one, two


def value(z: Any, p: Any, q: Any) -> Any:
    """Zero if a linkage passes through the point: ``w (u + v) + u v``."""
    u, v, w, _, _ = minors(z, p, q)
    return w * (u + v) + u * v


def slopes(z: Any, p: Any, q: Any) -> list[Any]:
    """Return the derivatives of `value` by the eight unknowns."""
    u, v, w, (c1, k1, e1), (c2, k2, e2) = minors(z, p, q)
    fw, fu, fv = u + v, w + v, w + u
    first = fw * k2 - fv * e2, fu * e2 - fw * c2, fv * c2 - fu * k2
    second = fv * e1 - fw * k1, fw * c1 - fu * e1, fu * k1 - fv * c1
    found = []
    for (gc, gk, ge), (a, aa), (x, xx) in ((first, z[0:2], z[2:4]), (second, z[4:6], z[6:8])):
        found += [-(gk * xx + ge * q), -(gc * x + ge * p), gc * (q - aa) + ge * q, gk * (p - a) + ge * p]
    return found


def cognates(z: Any) -> list[tuple[Any, ...]]:
    """Return the three linkages with the same path, the given one first; numbers that can be divided.

    >>> for linkage in cognates((0.0, 0.0, 1.0, 1.0, 4.0, 4.0, 3.0, 3.0)):
    ...     print(linkage)
    (0.0, 0.0, 1.0, 1.0, 4.0, 4.0, 3.0, 3.0)
    (0.0, 0.0, -1.0, -1.0, -2.0, -2.0, -1.5, -1.5)
    (4.0, 4.0, 1.0, 1.0, -2.0, -2.0, -0.5, -0.5)
    """
    a, aa, x, xx, b, bb, y, yy = z
    r, rr = y / (y - x), yy / (yy - xx)  # the third pivot is r a + (1 - r) b
    left, lleft = (a - x) * r, (aa - xx) * rr
    right, rright = (b - y) * (1 - r), (bb - yy) * (1 - rr)
    e, ee = left + right, lleft + rright
    # e = r a + (1-r) b, as r x + (1-r) y = 0
    return [tuple(z), (a, aa, a - x, aa - xx, e, ee, left, lleft), (b, bb, b - y, bb - yy, e, ee, right, rright)]
