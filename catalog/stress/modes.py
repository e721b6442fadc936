"""Assembly modes of the platform, counted and enclosed otherwise."""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def decimal_sum(a: str, b: str) -> str:
    """Sum of two decimal numbers with 50 digits."""
    from decimal import Decimal, localcontext

    with localcontext() as context:
        context.prec = 50
        return str(Decimal(a) + Decimal(b))


def exact_elbows(theta: tuple[str, ...]) -> list[Any]:
    """Anchors of G1 at decimal angles, as balls."""
    import flint

    from graphsynth.intervals.reading import ball, complex_ball, gaussian, precision, rational

    with precision(1000):
        found = []
        for pivot, arm, angle in zip((("0", "0"), ("2.5", "0.2"), ("1.1", "2.3")), ("0.9", "1.0", "0.8"), theta):
            s, c = flint.arb(angle).sin_cos()
            found.append(complex_ball(gaussian("D", pivot)) + ball(rational("l1", arm)) * flint.acb(c, s))
        return found


def count_for_doubles(theta: list[float], alpha: str) -> int:
    """Count the modes near the singular pose: closure of two legs, the third left over, extreme value at 60 digits."""
    import mpmath as mp

    from graphsynth.systems.platform.parallel_platform import ParallelPlatform

    g1 = ParallelPlatform.g1()
    with mp.workdps(60):
        A = [mp.mpc(D) + mp.mpf(r) * mp.expj(mp.mpf(t)) for D, r, t in zip(g1.D, g1.l1, theta)]
        b, l2 = [mp.mpc(v) for v in g1.b], [mp.mpf(v) for v in g1.l2]

        def third(turn: Any) -> Any:
            c = [A[k] - mp.expj(turn) * b[k] for k in (0, 1)]
            d = c[1] - c[0]
            along = (abs(d) ** 2 + l2[0] ** 2 - l2[1] ** 2) / (2 * abs(d))
            across = mp.sqrt(l2[0] ** 2 - along**2)
            options = [c[0] + d / abs(d) * mp.mpc(along, s * across) for s in (1, -1)]
            p = min(options, key=lambda q: abs(q - mp.mpc(1.2, 0.9)))
            return abs(p + mp.expj(turn) * b[2] - A[2]) ** 2 - l2[2] ** 2

        low, high = mp.mpf(alpha) - mp.mpf("1e-4"), mp.mpf(alpha) + mp.mpf("1e-4")
        extreme = third(mp.findroot(lambda a: mp.diff(third, a), (low + high) / 2))
        return 2 if extreme * third(high) < 0 else 0


def leg_error(poses: np.ndarray, A: Any, b: Any, lengths: Any) -> float:
    """Largest error of a leg length."""
    p = poses[:, :1] + 1j * poses[:, 1:2] + np.exp(1j * poses[:, 2:]) * np.asarray(b) - np.asarray(A)
    return float(np.abs(np.abs(p) - np.asarray(lengths)).max(initial=0.0))


def count_by_grid(A: Any, b: Any, lengths: Any) -> int:
    """Sign changes of the third leg's error along both circles' crossings of the other two, over a fine grid of alpha.

    Needs leg 1 and 2 with different ends; legs are renumbered until they have.
    """
    A, b, l = np.asarray(A, complex), np.asarray(b, complex), np.asarray(lengths, float)
    alpha = np.linspace(-math.pi, math.pi, 40_001)
    z = np.exp(1j * alpha)
    for order in ((0, 1, 2), (0, 2, 1), (1, 2, 0)):
        i, j, k = order
        c0, c1 = A[i] - z * b[i], A[j] - z * b[j]
        d = c1 - c0
        if np.abs(d).min() > 1e-6:
            break
    size = np.abs(d)
    along = (size**2 + l[i] ** 2 - l[j] ** 2) / (2 * size)
    square = l[i] ** 2 - along**2
    across = np.sqrt(np.maximum(square, 0.0))
    count = 0
    curves = []
    for sign in (1.0, -1.0):
        p = c0 + d / size * (along + 1j * sign * across)
        error = np.where(square >= 0.0, np.abs(p + z * b[k] - A[k]) - l[k], np.nan)
        curves.append(error)
        with np.errstate(invalid="ignore"):
            count += int((error[:-1] * error[1:] < 0.0).sum())
    # where the two circles only just touch, both curves end at the same point: a sign change between them is a mode
    inside = square >= 0.0
    for a in np.flatnonzero(inside[:-1] != inside[1:]):
        at = a if inside[a] else a + 1
        count += int(curves[0][at] * curves[1][at] < 0.0)
    return count


def companion_roots(anchors: Any, vertices: Any, lengths: Any) -> int:
    """Count the roots of the sextic on the unit circle, as eigenvalues of its companion matrix."""
    from graphsynth.kinematics.triad.assembly_modes import sextic

    g = np.array(sextic(anchors, vertices, lengths).g, dtype=complex)
    roots = np.roots([g[3], g[2], g[1], g[0], *np.conj(g[1:])])
    return int(np.sum(np.abs(np.abs(roots) - 1) < 1e-6))
