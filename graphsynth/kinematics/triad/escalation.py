"""Direct problem at 50 digits, for modes that float64 coefficients cannot separate.

The same isolation by a bound on the second derivative as in `sextic`, in multiple precision (mpmath, which sympy
brings along).  Slow (milliseconds per problem) and only used where the fast solver raised its flag.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: (pivots, arms, angles): lets the anchors be recomputed at higher precision
Arms = tuple[tuple[complex, complex, complex], tuple[float, float, float], Sequence[float]]

_DIGITS = 50
_COINCIDENT = 1e-12  # relative; the given numbers are rounded at 1e-16
_TRANSLATES = "congruent triangles and equal legs: the platform translates on a circle at one orientation"
_LARGEST_WORK = 20000  # intervals
_MERGED = 1e-20  # width at which two modes are reported as one double mode


def escalate(
    anchors: NDArray[np.complex128], vertices: NDArray[np.complex128], lengths: Array, arms: Arms | None
) -> tuple[Array, NDArray[np.bool_], str]:
    """Poses (m, 3), which of them are double, and a description of a self-motion (empty if none)."""
    import mpmath

    with mpmath.workdps(_DIGITS):
        mp = mpmath.mp
        if arms is None:
            A = [mp.mpc(value) for value in anchors]
        else:
            pivots, rockers, angles = arms
            A = [mp.mpc(D) + mp.mpf(arm) * mp.expj(mp.mpf(angle)) for D, arm, angle in zip(pivots, rockers, angles)]
        unit = 2.0 ** int(np.frexp(np.max(np.abs(anchors - anchors[0]), initial=float(lengths.max())))[1])
        A = [value / unit for value in A]
        b = [mp.mpc(value) / unit for value in vertices]
        l2 = [mp.mpf(value) / unit for value in lengths]
        g, n, d = coefficients(A, b, l2, mp.conj)
        found: list[tuple[Any, Any, bool]] = []
        family = _congruent(A, b, l2)
        if max(abs(c) for c in g) < mp.mpf(10) ** -14:  # below the resolution of the given numbers
            family = "the sextic vanishes: a continuous family of poses"
        roots = [] if family else _roots(mp, g)
        if roots is None:
            family, roots = "not decided: a root of the sextic is too flat to isolate", []
        for alpha, merged in roots:
            z = mp.expj(alpha)
            N, Delta = ((n[0] * z + n[1]) * z + n[2]) + n[3] / z, d[0] + d[1] * z - mp.conj(d[1]) / z
            if abs(Delta) > mp.mpf(10) ** -15:
                found.append((A[0] + N / Delta - z * b[0], alpha, merged))
                continue
            family, points = _geometric(mp, A, b, l2, z)
            if family:
                break
            known = [q for q, other, _ in found if abs(other - alpha) < _COINCIDENT]  # a split double root comes twice
            found += [(p, alpha, False) for p in points if all(abs(p - q) > _COINCIDENT for q in known)]
        found = [] if family else found
        poses = [[float(p.real * unit), float(p.imag * unit), float(alpha)] for p, alpha, _ in found]
        return np.array(poses).reshape(-1, 3), np.array([merged for *_, merged in found], dtype=bool), family


class Sextic(NamedTuple):
    """Coefficients of G, of ``N(z)`` and of ``Delta(z)`` (theory/platform-direct 1), in any arithmetic.

    ``g = (g0, g1, g2, g3)``, ``n = (n2, n1, n0, nm)``, ``d = (d0, de)``.
    """

    g: tuple[Any, Any, Any, Any]
    n: tuple[Any, Any, Any, Any]
    d: tuple[Any, Any]


def coefficients(A: Sequence[Any], b: Sequence[Any], lengths: Sequence[Any], c: Callable[[Any], Any]) -> Sextic:
    """Coefficients for three anchors, vertices and leg lengths; c is the complex conjugate in their arithmetic."""

    def square(z: Any) -> Any:
        return z.real * z.real + z.imag * z.imag

    def offset(k: int, a: Any, v: Any) -> Any:
        return (lengths[k] - lengths[0]) * (lengths[k] + lengths[0]) - square(a) - square(v)

    a2, a3, b2, b3, L = A[1] - A[0], A[2] - A[0], b[1] - b[0], b[2] - b[0], lengths[0] ** 2
    w20, w30, w21, w31 = offset(1, a2, b2), offset(2, a3, b3), b2 * c(a2), b3 * c(a3)
    n2 = w21 * b3 - w31 * b2
    n1 = w20 * b3 - w21 * a3 - w30 * b2 + w31 * a2
    n0 = -w20 * a3 + c(w21) * b3 + w30 * a2 - c(w31) * b2
    nm = -c(w21) * a3 + c(w31) * a2
    d0, de = 2j * (c(b2) * b3 + c(a2) * a3).imag, b2 * c(a3) - c(a2) * b3
    g0 = square(n2) + square(n1) + square(n0) + square(nm) - L * (square(d0) + 2 * square(de))
    g1 = n2 * c(n1) + n1 * c(n0) + n0 * c(nm) + 2 * L * d0 * de
    g2 = n2 * c(n0) + n1 * c(nm) + L * de * de
    return Sextic((g0, g1, g2, n2 * c(nm)), (n2, n1, n0, nm), (d0, de))


def _roots(mp: Any, g: Sequence[Any]) -> list[tuple[Any, bool]] | None:
    """Real roots of G, sorted, with a mark on those that stay merged at this precision; None if undecided.

    G'' is bounded on each interval through its Taylor expansion to the fourth derivative, so that the work stays small
    beside a quadruple root (similar triangles, theory/platform-direct 3).
    """
    fourth = 2 * (abs(g[1]) + 16 * abs(g[2]) + 81 * abs(g[3]))
    eta = (abs(g[0]) + fourth) * mp.mpf(10) ** (5 - _DIGITS)

    def derivative(order: int, x: Any) -> Any:
        z = mp.expj(x)
        total = sum((mp.j * k) ** order * g[k] * z**k for k in (1, 2, 3))
        return 2 * total.real + (g[0] if order == 0 else 0)

    value, slope = partial(derivative, 0), partial(derivative, 1)
    shift = mp.mpf(1) / 1000  # no node on the symmetric positions
    nodes = [-mp.pi + shift + 2 * mp.pi * k / 32 for k in range(33)]
    stack = [(nodes[k], nodes[k + 1]) for k in range(32)]
    roots: list[tuple[Any, bool]] = []
    for _ in range(_LARGEST_WORK):
        if not stack:
            break
        low, high = stack.pop()
        at_low, at_high, width, middle = value(low), value(high), high - low, (low + high) / 2
        bend = abs(derivative(2, middle)) + abs(derivative(3, middle)) * width / 2 + fourth * width**2 / 8
        same = (at_low >= 0) == (at_high >= 0)
        if same and min(abs(at_low), abs(at_high)) > bend * width**2 / 8 + eta:
            continue
        if abs(slope(middle)) > bend * width / 2 + 3 * eta:
            if not same:
                roots.append((_bracketed(value, slope, low, high, at_low >= 0), False))
        elif width < _MERGED:
            roots.append((middle, True))
        elif max(abs(value(middle)), abs(slope(middle)) / 3, abs(derivative(2, middle)) * width**2 / 8) <= eta:
            return None  # too flat for these digits: no smaller interval decides either
        else:
            stack += [(low, middle), (middle, high)]
    if stack:
        return None
    wrapped = sorted(((x - 2 * mp.pi if x > mp.pi else x, merged) for x, merged in roots), key=lambda root: root[0])
    return [
        (x, merged)
        for k, (x, merged) in enumerate(wrapped)
        if not (k and merged and wrapped[k - 1][1] and abs(x - wrapped[k - 1][0]) < 100 * _MERGED)
    ]


def _bracketed(value: Any, slope: Any, low: Any, high: Any, positive: bool) -> Any:
    x = (low + high) / 2
    for _ in range(200):
        y = value(x)
        if (y >= 0) == positive:
            low = x
        else:
            high = x
        s = slope(x)
        new = x - y / s if s != 0 else (low + high) / 2
        if not low < new < high:
            new = (low + high) / 2
        if abs(new - x) < 1e-40:
            return new
        x = new
    return x


def _congruent(A: list[Any], b: list[Any], l2: list[Any]) -> str:
    """Self-motion of a platform that is congruent to its anchors, with equal legs (to the rounding of the input)."""
    if b[1] == b[0] or A[1] == A[0] or max(abs(l2[k] - l2[0]) for k in (1, 2)) > _COINCIDENT / 100:
        return ""
    z = (A[1] - A[0]) / (b[1] - b[0])
    off = max(abs(abs(z) - 1), abs(z * (b[2] - b[0]) - (A[2] - A[0])))
    return _TRANSLATES if off < _COINCIDENT / 100 else ""


def _geometric(mp: Any, A: list[Any], b: list[Any], l2: list[Any], z: Any) -> tuple[str, list[Any]]:
    """Poses at an orientation where Delta vanishes: a line met with the circle ``|Q| = l2_1``.

    See theory/platform-direct 3.
    """
    e = [z * (b[k] - b[0]) - (A[k] - A[0]) for k in (1, 2)]
    w = [l2[k] ** 2 - l2[0] ** 2 - abs(e[k - 1]) ** 2 for k in (1, 2)]
    tiny = mp.mpf(10) ** -14
    if max(abs(v) for v in e) < tiny:
        if max(abs(l2[k] - l2[0]) for k in (1, 2)) < tiny:
            return _TRANSLATES, []
        return "", []
    k = 0 if abs(e[0]) >= abs(e[1]) else 1
    if abs(w[1 - k] * abs(e[k]) ** 2 - w[k] * (mp.conj(e[k]) * e[1 - k]).real) > tiny:
        return "", []  # parallel lines that do not coincide
    direction = e[k] / abs(e[k])
    along = w[k] / (2 * abs(e[k]))
    across2 = l2[0] ** 2 - along**2
    if across2 < -tiny:
        return "", []
    across = mp.sqrt(max(across2, mp.mpf(0)))
    sides = (across, -across) if across > tiny else (mp.mpf(0),)
    return "", [A[0] + direction * mp.mpc(along, side) - z * b[0] for side in sides]
