"""Poses of which a dyad is known, and the equations of dyads in fifty digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np


def planted(rng: np.random.Generator, kind: str = "RR", count: int = 5) -> tuple[complex, complex, float, list[Any]]:
    """Pivot, point in the body, length or direction, and random poses of a body on that dyad."""
    pivot, point = rng.normal(size=2) @ [1, 1j], rng.normal(size=2) @ [1, 1j]
    angle = rng.uniform(-np.pi, np.pi, count)
    if kind == "RR":
        own = rng.uniform(0.3, 2.0)
        end = pivot + own * np.exp(1j * rng.uniform(-np.pi, np.pi, count))
        z = end - np.exp(1j * angle) * point
    elif kind == "PR":
        own = rng.uniform(-np.pi / 2, np.pi / 2)
        z = pivot + rng.normal(size=count) * np.exp(1j * own) - np.exp(1j * angle) * point
    else:
        own = rng.uniform(-np.pi / 2, np.pi / 2)
        z = pivot - np.exp(1j * angle) * (point + rng.normal(size=count) * np.exp(1j * own))
    return pivot, point, own, np.column_stack([z.real, z.imag, angle]).tolist()


def residual(dyad: Any, poses: list[Any]) -> Any:
    """Largest violation of what the dyad keeps constant, of the doubles as they are, in fifty digits."""
    with mpmath.workdps(50):
        rows = [(mpmath.mpc(x, y), mpmath.expj(mpmath.mpf(t))) for x, y, t in poses]
        pivot, point = mpmath.mpc(*dyad.pivot), mpmath.mpc(*dyad.point)
        along = mpmath.expj(mpmath.mpf(dyad.angle))
        if dyad.kind == "RP":
            kept = [(((pivot - z) * mpmath.conj(u) - point) * mpmath.conj(along)).imag for z, u in rows]
        elif dyad.kind == "PR":
            kept = [((z + u * point - pivot) * mpmath.conj(along)).imag for z, u in rows]
        else:
            kept = [abs(z + u * point - pivot) - mpmath.mpf(dyad.length) for z, u in rows]
        return max(abs(value) for value in kept)


def exact(dyad: Any, poses: list[Any]) -> list[Any]:
    """Pivot and point of the true RR dyad beside a rounded one, by Newton's method in fifty digits."""
    with mpmath.workdps(50):
        rows = [(mpmath.mpc(x, y), mpmath.expj(mpmath.mpf(t))) for x, y, t in poses]

        def equations(p: Any, q: Any, x: Any, y: Any) -> list[Any]:
            arms = [z + u * mpmath.mpc(x, y) - mpmath.mpc(p, q) for z, u in rows]
            squares = [arm.real**2 + arm.imag**2 for arm in arms]
            return [square - squares[0] for square in squares[1:]]

        found = mpmath.findroot(equations, (*dyad.pivot, *dyad.point), tol=1e-45)
        return list(found)
