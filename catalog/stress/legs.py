"""Legs of the platform with 60 digits."""

from __future__ import annotations

from typing import Any

import numpy as np


def exact_angle(l1: float, l2: float, u: float, v: float, sigma: int) -> Any:
    """Rocker angle to 60 digits for the given doubles, by the law of cosines alone (not theory/platform-inverse 4)."""
    import mpmath as mp

    with mp.workdps(60):
        a, b, x, y = (mp.mpf(value) for value in (l1, l2, u, v))
        rho = mp.hypot(x, y)
        cosine = (rho**2 + a**2 - b**2) / (2 * a * rho)
        return mp.arg(mp.mpc(x, y)) + sigma * mp.acos(min(max(cosine, mp.mpf(-1)), mp.mpf(1)))


def turned_to(found: float, right: Any) -> Any:
    """Return the angle ``right``, turned by whole turns until it is next to ``found``."""
    import mpmath as mp

    with mp.workdps(60):
        return right + 2 * mp.pi * mp.nint((mp.mpf(found) - right) / (2 * mp.pi))


def exact_status(l1: float, l2: float, u: float, v: float) -> str:
    from fractions import Fraction

    square = Fraction(u) ** 2 + Fraction(v) ** 2
    far, near = (Fraction(l1) + Fraction(l2)) ** 2, (Fraction(l1) - Fraction(l2)) ** 2
    if square > far:
        return "TOO_FAR"
    return "TOO_NEAR" if square < near else "BOUNDARY" if square in (far, near) else "REACHABLE"


def without_warnings(call: Any, *arguments: Any) -> Any:
    """Return what a call gives; a division by zero or an overflow inside raises."""
    with np.errstate(all="raise"):
        return call(*arguments)
