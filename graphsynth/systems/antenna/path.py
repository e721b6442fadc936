"""A straight path in the plane of the two crank angles: discriminants, and what happens where one vanishes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from graphsynth.systems.antenna.legs import Leg, scale_of, solution_order

if TYPE_CHECKING:
    from graphsynth.systems.antenna.mechanism import PointingMechanism

__all__ = ["AtFold", "Path"]


class AtFold(NamedTuple):
    """Outputs at a fold, its square-root coefficient, and the side on which the mechanism can be assembled."""

    a: float
    b: float
    coefficient: float
    side: int


class _Own(NamedTuple):
    """P, Q, K of a leg and their derivatives along the path."""

    p: float
    q: float
    k: float
    dp: float
    dq: float
    dk: float


@dataclass(frozen=True)
class Path:
    """Crank angles ``offset + t * direction`` on one assembly mode."""

    mechanism: PointingMechanism
    offset: tuple[float, float]
    direction: tuple[float, float]
    s_y: int = 1
    s_x: int = -1

    def legs(self) -> tuple[Leg, Leg, float]:
        """Return the leg solved first, the other one, and l1, all scaled."""
        scale = scale_of(self.mechanism)
        return (*solution_order(self.mechanism, scale), self.mechanism.l1 / scale)

    def sign(self, leg: Leg) -> int:
        """Branch sign of a leg."""
        return self.s_y if leg.name == "Y" else self.s_x

    def _own(self, leg: Leg, l1: float, t: float) -> _Own:
        index = 0 if leg.name == "Y" else 1
        rate = self.direction[index]
        phi = self.offset[index] + t * rate
        s, c = leg.crank * math.sin(phi), leg.crank * math.cos(phi)
        bend = leg.crank * 2.0 * math.sin(0.5 * phi) ** 2
        p, q = l1 - bend, leg.side * leg.rod + s
        k = 0.5 * (l1 * l1 + p * p + s * (2.0 * leg.side * leg.rod + s)) / l1
        return _Own(p, q, k, -s * rate, c * rate, rate * (q * c - p * s) / l1)

    def first(self, t: float) -> float:
        """Angle u of the fixed gimbal axis; NaN out of reach."""
        leg, _, l1 = self.legs()
        own = self._own(leg, l1, t)
        square = own.p * own.p + own.q * own.q
        rest = square - own.k * own.k
        if rest < 0.0 or square == 0.0:
            return math.nan
        root = self.sign(leg) * math.sqrt(rest)
        return math.atan2(own.q * own.k + own.p * root, own.p * own.k - own.q * root)

    def discriminant(self, t: float, which: int) -> float:
        """``A^2 + B^2 - K^2`` of the first (0) or second (1) leg, scaled; NaN where the first is out of reach."""
        first, second, l1 = self.legs()
        if which == 0:
            own = self._own(first, l1, t)
            return own.p * own.p + own.q * own.q - own.k * own.k
        u = self.first(t)
        own = self._own(second, l1, t)
        q = own.q * math.cos(u)
        return own.p * own.p + q * q - own.k * own.k

    def at_fold(self, name: str, t: float) -> AtFold:
        """Return what happens at a fold of leg ``name``; its own output comes from ``atan2`` without the square root.

        ``C = sqrt(2 |dF/dt| / |d2F/dy2|)`` with ``F = A cos y + B sin y - K``; there ``d2F/dy2 = -K``.
        """
        first, second, l1 = self.legs()
        one = self._own(first, l1, t)
        turned = 0.0 if one.k > 0.0 else math.pi
        if first.name == name:
            u = math.remainder(math.atan2(one.q, one.p) + turned, math.tau)
            slope = one.dp * math.cos(u) + one.dq * math.sin(u) - one.dk
            v = self._second_output(second, l1, t, u)
            coefficient, side = _square_root(slope, one.k)
        else:
            u = self.first(t)
            two = self._own(second, l1, t)
            f_u = -one.p * math.sin(u) + one.q * math.cos(u)
            du = -(one.dp * math.cos(u) + one.dq * math.sin(u) - one.dk) / f_u if f_u != 0.0 else math.nan
            b = two.q * math.cos(u)
            db = two.dq * math.cos(u) - two.q * math.sin(u) * du
            v = math.remainder(math.atan2(b, two.p) + (0.0 if two.k > 0.0 else math.pi), math.tau)
            slope = two.dp * math.cos(v) + db * math.sin(v) - two.dk
            coefficient, side = _square_root(slope, two.k)
        return AtFold(u, v, coefficient, side) if first.name == "Y" else AtFold(v, u, coefficient, side)

    def _second_output(self, second: Leg, l1: float, t: float, u: float) -> float:
        own = self._own(second, l1, t)
        q = own.q * math.cos(u)
        rest = own.p * own.p + q * q - own.k * own.k
        if rest < 0.0:
            return math.nan
        root = self.sign(second) * math.sqrt(rest)
        return math.atan2(q * own.k + own.p * root, own.p * own.k - q * root)


def _square_root(slope: float, k: float) -> tuple[float, int]:
    """Return the coefficient, and +1 if the root is real for growing t: ``dF + F_yy dy^2 / 2 = 0``."""
    return math.sqrt(2.0 * abs(slope / k)), 1 if slope * k > 0.0 else -1
