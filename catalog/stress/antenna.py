"""Own computations for the cases of the antenna: rods, modes, folds."""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def rod_error(mechanism: Any, a: float, b: float, phi_x: float, phi_y: float) -> float:
    """Largest error of the rod lengths, from rotation matrices and points alone (theory/antenna 5, order YX)."""
    l1, l2, l3, l4, l5 = mechanism.lengths
    ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
    R = np.array([[cb, sb * sa, sb * ca], [0.0, ca, -sa], [-sb, cb * sa, cb * ca]])
    S_y = np.array([0.0, l1 - l3 + l3 * math.cos(phi_x), -l2 + l3 * math.sin(phi_x)])
    S_x = np.array([l1 - l5 + l5 * math.cos(phi_y), 0.0, -l4 - l5 * math.sin(phi_y)])
    errors = [np.linalg.norm(R @ [0.0, l1, 0.0] - S_y) - l2, np.linalg.norm(R @ [l1, 0.0, 0.0] - S_x) - l4]
    return float(max(abs(errors[0]), abs(errors[1])))


def count_modes(lengths: np.ndarray, phi_x: float, phi_y: float, grid: np.ndarray) -> int:
    l1, l2, l3, l4, l5 = lengths
    y1, y2 = l1 - l3 + l3 * math.cos(phi_x), -l2 + l3 * math.sin(phi_x)
    x1, x2 = l1 - l5 + l5 * math.cos(phi_y), -l4 - l5 * math.sin(phi_y)
    # order YX: R e_x = (cos b, 0, -sin b) holds leg X alone
    first = np.hypot(l1 * np.cos(grid) - x1, -l1 * np.sin(grid) - x2) - l4
    count = 0
    for i in np.flatnonzero(first[:-1] * first[1:] < 0):
        b = grid[i] - first[i] * (grid[1] - grid[0]) / (first[i + 1] - first[i])
        point = l1 * np.stack([math.sin(b) * np.sin(grid), np.cos(grid), math.cos(b) * np.sin(grid)])
        second = np.sqrt(point[0] ** 2 + (point[1] - y1) ** 2 + (point[2] - y2) ** 2) - l2
        count += int((second[:-1] * second[1:] < 0).sum())
    return count


def sine_of_crank_and_rod(mechanism: Any, leg: str, p: Any) -> float:
    """Sine of the angle between the crank and the projection of the rod on the crank's plane."""
    l1, l2, l3, l4, l5 = mechanism.lengths
    ca, sa, cb, sb = math.cos(p.a), math.sin(p.a), math.cos(p.b), math.sin(p.b)
    R = np.array([[cb, sb * sa, sb * ca], [0.0, ca, -sa], [-sb, cb * sa, cb * ca]])
    if leg == "Y":
        crank = l3 * np.array([math.cos(p.phi_x), math.sin(p.phi_x)])
        rod = (R @ [0.0, l1, 0.0])[1:] - [l1 - l3, -l2] - crank
    else:
        crank = l5 * np.array([math.cos(p.phi_y), -math.sin(p.phi_y)])
        rod = (R @ [l1, 0.0, 0.0])[[0, 2]] - [l1 - l5, -l4] - crank
    return float(abs(crank[0] * rod[1] - crank[1] * rod[0]) / np.hypot(*crank) / np.hypot(*rod))


def folds_of_leg_x() -> list[Any]:
    """Crank angles at which the rod of leg X lies on a line through the centre, with ``l5 = 0.12``.

    There ``|S_X| = l1 + l4`` or ``l4 - l1``, so ``A cos + B sin = C`` of theory/antenna 7.
    """
    import mpmath as mp

    with mp.workdps(40):
        l1, l4, l5 = mp.mpf(0.1), mp.mpf(0.15), mp.mpf(0.12)
        A, B = 2 * (l1 - l5) * l5, 2 * l4 * l5
        angles = []
        for sign in (1, -1):
            C = (l1 + sign * l4) ** 2 - (l1 - l5) ** 2 - l5**2 - l4**2
            for side in (1, -1):
                angle = mp.atan2(B, A) + side * mp.acos(C / mp.hypot(A, B))
                angles.append(angle - 2 * mp.pi * mp.nint(angle / (2 * mp.pi)))
        return sorted(angles)
