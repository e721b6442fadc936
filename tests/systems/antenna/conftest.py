"""Independent formulas in many digits, written straight from theory/antenna 2 to 5."""

from __future__ import annotations

from types import SimpleNamespace

import mpmath as mp
import pytest

ART = ("0.1", "0.15", "0.0592", "0.15", "0.0592")
PARALLELOGRAM = ("0.1", "0.15", "0.1", "0.15", "0.1")


def rx(t):
    c, s = mp.cos(t), mp.sin(t)
    return mp.matrix([[1, 0, 0], [0, c, -s], [0, s, c]])


def ry(t):
    c, s = mp.cos(t), mp.sin(t)
    return mp.matrix([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def angles(phi_x, phi_y, lengths=ART, order="YX", s_y=1, s_x=-1):
    """Elevation and azimuth, radians, from the closed form with atan2 and acos."""
    l1, l2, l3, l4, l5 = (mp.mpf(x) for x in lengths)
    sy, sz = l1 - l3 + l3 * mp.cos(phi_x), -l2 + l3 * mp.sin(phi_x)
    xx, xz = l1 - l5 + l5 * mp.cos(phi_y), -l4 - l5 * mp.sin(phi_y)
    ky = (l1**2 + sy**2 + sz**2 - l2**2) / (2 * l1)
    kx = (l1**2 + xx**2 + xz**2 - l4**2) / (2 * l1)

    def solve(A, B, K, s):
        t = mp.atan2(B, A) + s * mp.acos(K / mp.hypot(A, B))
        return t - 2 * mp.pi * mp.nint(t / (2 * mp.pi))

    if order == "YX":
        b = solve(xx, -xz, kx, s_x)
        return solve(sy, sz * mp.cos(b), ky, s_y), b
    a = solve(sy, sz, ky, s_y)
    return a, solve(xx, -xz * mp.cos(a), kx, s_x)


def rod_errors(a, b, phi_x, phi_y, lengths=ART, order="YX"):
    """Length of each rod from the positions of its joints, minus its nominal length."""
    l1, l2, l3, l4, l5 = (mp.mpf(x) for x in lengths)
    R = ry(b) * rx(a) if order == "YX" else rx(a) * ry(b)
    SY = mp.matrix([0, l1 - l3, -l2]) + rx(phi_x) * mp.matrix([0, l3, 0])
    SX = mp.matrix([l1 - l5, 0, -l4]) + ry(phi_y) * mp.matrix([l5, 0, 0])
    return mp.norm(R * mp.matrix([0, l1, 0]) - SY) - l2, mp.norm(R * mp.matrix([l1, 0, 0]) - SX) - l4


@pytest.fixture(scope="session")
def exact():
    return SimpleNamespace(angles=angles, rod_errors=rod_errors, rx=rx, ry=ry)
