"""Direct problem at 50 digits, for modes that float64 coefficients cannot separate.

The same isolation by a bound on the second derivative as in `sextic`, in multiple precision (mpmath, which sympy
brings along).  Slow (milliseconds per problem) and only used where the fast solver raised its flag.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.assembly_modes import Arms

__all__ = ["escalate"]

Array = NDArray[np.float64]

_DIGITS = 50
_MERGED = 1e-20  # width at which two modes are reported as one double mode


def escalate(
    anchors: NDArray[np.complex128], vertices: NDArray[np.complex128], lengths: Array, arms: Arms | None
) -> tuple[Array, NDArray[np.bool_], str]:
    """Poses (m, 3), which of them are double, and a description of a self-motion (empty if none)."""
    import mpmath  # type: ignore[import-untyped]

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
        g, n, d = _coefficients(mp, A, b, l2)
        if max(abs(c) for c in g) < mp.mpf(10) ** -14:  # below the resolution of the given numbers
            return np.zeros((0, 3)), np.zeros(0, dtype=bool), "the sextic vanishes: a continuous family of poses"
        found: list[tuple[Any, Any, bool]] = []
        for alpha, merged in _roots(mp, g):
            z = mp.expj(alpha)
            N, Delta = ((n[0] * z + n[1]) * z + n[2]) + n[3] / z, d[0] + d[1] * z - mp.conj(d[1]) / z
            if abs(Delta) > mp.mpf(10) ** -15:
                found.append((A[0] + N / Delta - z * b[0], alpha, merged))
                continue
            family, points = _geometric(mp, A, b, l2, z)
            if family:
                return np.zeros((0, 3)), np.zeros(0, dtype=bool), family
            found += [(p, alpha, False) for p in points]
        poses = [[float(p.real * unit), float(p.imag * unit), float(alpha)] for p, alpha, _ in found]
        return np.array(poses).reshape(-1, 3), np.array([merged for *_, merged in found], dtype=bool), ""


def _coefficients(mp: Any, A: list[Any], b: list[Any], l2: list[Any]) -> tuple[list[Any], list[Any], list[Any]]:
    """g, n and d of section 5.1."""
    c = mp.conj
    a2, a3, b2, b3, L = A[1] - A[0], A[2] - A[0], b[1] - b[0], b[2] - b[0], l2[0] ** 2
    w20 = l2[1] ** 2 - L - abs(a2) ** 2 - abs(b2) ** 2
    w30 = l2[2] ** 2 - L - abs(a3) ** 2 - abs(b3) ** 2
    w21, w31 = b2 * c(a2), b3 * c(a3)
    n2 = w21 * b3 - w31 * b2
    n1 = w20 * b3 - w21 * a3 - w30 * b2 + w31 * a2
    n0 = -w20 * a3 + c(w21) * b3 + w30 * a2 - c(w31) * b2
    nm = -c(w21) * a3 + c(w31) * a2
    d0, de = 2j * (c(b2) * b3 + c(a2) * a3).imag, b2 * c(a3) - c(a2) * b3
    g0 = sum(abs(v) ** 2 for v in (n2, n1, n0, nm)) - L * (abs(d0) ** 2 + 2 * abs(de) ** 2)
    g1 = n2 * c(n1) + n1 * c(n0) + n0 * c(nm) + 2 * L * d0 * de
    g2 = n2 * c(n0) + n1 * c(nm) + L * de**2
    return [g0, g1, g2, n2 * c(nm)], [n2, n1, n0, nm], [d0, de]


def _roots(mp: Any, g: list[Any]) -> list[tuple[Any, bool]]:
    """Real roots of G, sorted, with a mark on those that stay double at this precision."""
    bend = 2 * (abs(g[1]) + 4 * abs(g[2]) + 9 * abs(g[3]))
    eta = (abs(g[0]) + bend) * mp.mpf(10) ** (5 - _DIGITS)

    def value(x: Any) -> Any:
        z = mp.expj(x)
        return g[0] + 2 * (z * (g[1] + z * (g[2] + z * g[3]))).real

    def slope(x: Any) -> Any:
        z = mp.expj(x)
        return -2 * (z * (g[1] + z * (2 * g[2] + 3 * z * g[3]))).imag

    shift = mp.mpf(1) / 1000  # no node on the symmetric positions
    nodes = [-mp.pi + shift + 2 * mp.pi * k / 32 for k in range(33)]
    stack = [(nodes[k], nodes[k + 1]) for k in range(32)]
    roots: list[tuple[Any, bool]] = []
    while stack:
        low, high = stack.pop()
        at_low, at_high, width, middle = value(low), value(high), high - low, (low + high) / 2
        same = (at_low >= 0) == (at_high >= 0)
        if same and min(abs(at_low), abs(at_high)) > bend * width**2 / 8 + eta:
            continue
        if abs(slope(middle)) > bend * width / 2 + 3 * eta:
            if not same:
                roots.append((_bracketed(value, slope, low, high, at_low >= 0), False))
            continue
        if width < _MERGED:
            if not roots or not roots[-1][1] or abs(roots[-1][0] - middle) > 10 * _MERGED:
                roots.append((middle, True))
            continue
        stack += [(low, middle), (middle, high)]
    wrapped = [(x - 2 * mp.pi if x > mp.pi else x, merged) for x, merged in roots]
    return sorted(wrapped, key=lambda root: root[0])


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


def _geometric(mp: Any, A: list[Any], b: list[Any], l2: list[Any], z: Any) -> tuple[str, list[Any]]:
    """Poses at an orientation where Delta vanishes (section 5.3): a line met with the circle ``|Q| = l2_1``."""
    e = [z * (b[k] - b[0]) - (A[k] - A[0]) for k in (1, 2)]
    w = [l2[k] ** 2 - l2[0] ** 2 - abs(e[k - 1]) ** 2 for k in (1, 2)]
    tiny = mp.mpf(10) ** -14
    if max(abs(v) for v in e) < tiny:
        if max(abs(l2[k] - l2[0]) for k in (1, 2)) < tiny:
            return "congruent triangles and equal legs: the platform translates on a circle at this orientation", []
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
