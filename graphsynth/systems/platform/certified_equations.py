"""The closure equations of the single-motor platform in balls: three four-bars and three legs, six unknowns.

Unknowns: the angles ``phi_k`` of the drive arms in the fixed frame, and the pose ``(x, y, alpha)``; the input is the
wheel angle psi.  Equations ``h_k = |C_k - B_k|^2 - l_BC^2`` and ``f_k = |F_k - A_k|^2 - l2^2``.  Every angle of the
dimensions (frame, phase, bell-crank) is a ball of a few 1e-16 rad around the given number, so that -pi/6 and the
double nearest to it are both meant.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals.balls import UP, Balls, exact, stack, unit
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

__all__ = ["LegBounds", "PlatformSystem"]

Array = NDArray[np.float64]

#: Angles of the dimensions are meant within this many radians.
ANGLE = 5e-16


class _Vectors(NamedTuple):
    """Balls (N, 3): arms and links of the three legs, and crank."""

    crank: Balls  # B - O
    link: Balls  # C - B
    arm: Balls  # C - D
    rocker: Balls  # A - D
    leg: Balls  # F - A
    vertex: Balls  # F - p
    reach: Balls  # F - D


class LegBounds(NamedTuple):
    """Enclosures (N, 3): ``P1``, ``P2`` (both positive inside the reach), ``JT`` of the legs and ``h_phi``."""

    P1: Balls
    P2: Balls
    JT: Balls
    h_phi: Balls


class PlatformSystem:
    """Equations of a `SingleMotorPlatform` as a `System` of the Krawczyk test."""

    def __init__(self, platform: SingleMotorPlatform) -> None:
        self.platform = platform
        turn = unit(_near(platform.frame_angle))
        self.O, self.D, self.b = (exact(np.array(v, dtype=np.complex128)) * turn
                                  for v in (platform.axis, platform.pivot, platform.vertex))  # fmt: skip
        self.bell = unit(_near(platform.delta))
        self.lengths = {name: exact(np.array(getattr(platform, name)))
                        for name in ("crank", "coupler", "rocker", "l1", "l2")}  # fmt: skip

    @property
    def weights(self) -> Array:
        """1 for angles, the characteristic length for x and y."""
        Lc = self.platform.Lc
        return np.array([1.0, 1.0, 1.0, Lc, Lc, 1.0])

    def units(self, x: Array, u: Array, checked: bool = True) -> Balls:
        """Directions of the three arms, of the platform and of the three cranks, (N, 7)."""
        crank = exact(u[:, None]) + _near(self.platform.phase)
        angles = np.concatenate([x[:, :3], x[:, 5:6], crank.mid], axis=1)
        rad = np.concatenate([np.zeros((len(x), 4)), crank.rad], axis=1)
        if checked:
            return unit(Balls(angles, rad))
        return exact(np.exp(1j * np.where(np.isfinite(angles), angles, 0.0)))

    def _vectors(self, x: Balls, u: Balls, units: Balls) -> _Vectors:
        n = self.lengths
        arm = units[:, :3].wider(x.rad[:, :3])
        vertex = units[:, 3:4].wider(x.rad[:, 5:6]) * self.b
        crank = units[:, 4:].wider(np.broadcast_to(u.rad[:, None], (len(u.mid), 3))) * n["crank"]
        place = Balls(x.mid[:, 3:4] + 1j * x.mid[:, 4:5], x.rad[:, 3:4] + x.rad[:, 4:5]).wider(0.0)
        arm_c, rocker = arm * n["rocker"], arm * self.bell * n["l1"]
        link = (self.D - self.O) + arm_c - crank
        reach = (place - self.D) + vertex
        return _Vectors(crank, link, arm_c, rocker, reach - rocker, vertex, reach)

    def residual(self, x: Balls, u: Balls, units: Balls) -> Balls:
        """``(h_1, h_2, h_3, f_1, f_2, f_3)``, shape (N, 6)."""
        v, n = self._vectors(x, u, units), self.lengths
        h = _square(v.link) - n["coupler"] * n["coupler"]
        f = _square(v.leg) - n["l2"] * n["l2"]
        return Balls(np.concatenate([h.mid, f.mid], axis=1), np.concatenate([h.rad, f.rad], axis=1))

    def derivatives(self, x: Balls, u: Balls, units: Balls) -> tuple[Balls, Balls]:
        """Jacobian (N, 6, 6) and derivative by psi (N, 6)."""
        v = self._vectors(x, u, units)
        two = exact(2.0)
        h_phi, f_phi = two * _cross(v.arm, v.link), -(two * _cross(v.rocker, v.leg))
        columns = stack([two * v.leg.real, two * v.leg.imag, two * _cross(v.vertex, v.leg)])
        h_psi = -(two * _cross(v.crank, v.link))
        N = len(x.mid)
        mid, rad = np.zeros((N, 6, 6)), np.zeros((N, 6, 6))
        for k in range(3):
            mid[:, k, k], rad[:, k, k] = h_phi.mid[:, k], h_phi.rad[:, k]
            mid[:, 3 + k, k], rad[:, 3 + k, k] = f_phi.mid[:, k], f_phi.rad[:, k]
        mid[:, 3:, 3:], rad[:, 3:, 3:] = columns.mid, columns.rad
        zero = np.zeros((N, 3))
        rate = Balls(np.concatenate([h_psi.mid, zero], axis=1), np.concatenate([h_psi.rad, zero], axis=1))
        return Balls(mid, rad), rate

    def branch(self, x: Balls, u: Array) -> tuple[NDArray[np.int64], Balls]:
        """Nothing is counted: all angles enter through their directions."""
        return np.zeros((len(x.mid), 0), dtype=np.int64), exact(np.zeros((len(x.mid), 0)))

    def bounds(self, x: Balls, u: Balls) -> LegBounds:
        """Quantities whose signs are the working mode and the drive branches, over boxes."""
        v, n = self._vectors(x, u, self.units(x.mid, u.mid)), self.lengths
        rho2, total, gap = _square(v.reach), n["l1"] + n["l2"], n["l1"] - n["l2"]
        JT, h_phi = -(exact(2.0) * _cross(v.rocker, v.leg)), exact(2.0) * _cross(v.arm, v.link)
        return LegBounds(total * total - rho2, rho2 - gap * gap, JT, h_phi)


def _near(angles: tuple[float, float, float]) -> Balls:
    mid = np.array(angles, dtype=np.float64)
    return Balls(mid, np.full(3, ANGLE) * np.maximum(1.0, np.abs(mid)) * UP)


def _cross(a: Balls, b: Balls) -> Balls:
    return (a.conj * b).imag


def _square(z: Balls) -> Balls:
    return z.real * z.real + z.imag * z.imag
