"""Folds of each leg: output singularities (theory/antenna 7).

Where a discriminant vanishes, two assembly modes or two crank settings meet.  For the leg that is solved first it is a
product of two sinusoids of the crank angle, for the other leg a trigonometric polynomial of degree two: all of its
roots over a full rotation are found.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import choice, finite
from graphsynth.core.errors import GeometryError
from graphsynth.systems.antenna.model import Leg, PointingDimensions, scale_of, solution_order

#: Coefficients of ``1, cos t, sin t, cos 2t, sin 2t``.
Coefficients = tuple[float, float, float, float, float]
#: A local extremum of this part of the sum of the coefficients counts as a double root.
TOUCH = 1e-13
#: The turn is cut here beyond pi, at no special angle, so that no root of a simple problem lies on the cut.
SEAM = 0.0123456789


class TrigRoot(NamedTuple):
    """A root in (-pi, pi] and its order: 1, or 2 where the function touches zero."""

    angle: float
    order: int


def _wrap(angle: float) -> float:
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped == -math.pi else wrapped


def sinusoid_roots(a: float, b: float, c: float) -> list[TrigRoot]:
    """Roots of ``a cos t + b sin t = c`` in closed form, without cancellation between ``hypot(a, b)`` and ``|c|``."""
    reach = math.hypot(a, b)
    rest = (reach - c) * (reach + c)
    if reach == 0.0 or rest < -TOUCH * reach * reach:
        return []
    if rest <= TOUCH * reach * reach:
        return [TrigRoot(math.atan2(math.copysign(b, b * c), math.copysign(a, a * c)), 2)]
    root = math.sqrt(rest)
    return sorted(TrigRoot(math.atan2(b * c + s * a * root, a * c - s * b * root), 1) for s in (-1.0, 1.0))


def quadratic_roots(coefficients: Coefficients) -> list[TrigRoot]:
    """Roots of ``c0 + c1 cos t + s1 sin t + c2 cos 2t + s2 sin 2t``, at most four counted with their order.

    Brackets between the critical points (eigenvalues of a companion matrix) make every sign change found; a critical
    value below 1e-13 of the coefficients is reported as a double root.
    """
    from scipy.optimize import brentq

    c0, c1, s1, c2, s2 = coefficients
    size = sum(map(abs, coefficients))
    if size == 0.0:
        return []

    def value(t: float) -> float:
        return c0 + c1 * math.cos(t) + s1 * math.sin(t) + c2 * math.cos(2 * t) + s2 * math.sin(2 * t)

    critical = _critical_points(c1, s1, c2, s2)
    double = [t for t in critical if abs(value(t)) <= TOUCH * size]
    found = [TrigRoot(t, 2) for t in double]

    def touched(t: float, distance: float = 1e-9) -> bool:
        return any(abs(math.remainder(t - other, math.tau)) < distance for other in double)

    # around a double root the sign is rounding noise: no mark there but the root itself
    even = [t for t in (np.linspace(-math.pi, math.pi, 17)[1:] + SEAM).tolist() if not touched(t, 1e-3)]
    marks = sorted({*(t if t > SEAM - math.pi else t + math.tau for t in critical), *even})
    for left, right in zip([marks[-1] - math.tau, *marks[:-1]], marks):
        f, g = value(left), value(right)
        if touched(left) or touched(right):
            # beside a double root the sign is that of the other end: an odd number of changes is left to it
            near, far = (left, right) if touched(left) else (right, left)
            inner = value(near + math.copysign(1e-4, far - near)) if abs(far - near) > 1e-3 else 0.0
            if not touched(far) and inner * value(far) < 0.0:
                low, high = sorted((near + math.copysign(1e-4, far - near), far))
                found.append(TrigRoot(_wrap(brentq(value, low, high, xtol=4e-16, rtol=8.9e-16)), 1))
        elif f < 0.0 < g or g < 0.0 < f:
            found.append(TrigRoot(_wrap(brentq(value, left, right, xtol=4e-16, rtol=8.9e-16)), 1))
        elif g == 0.0:
            found.append(TrigRoot(_wrap(right), 1))
    return sorted(found)


def _critical_points(c1: float, s1: float, c2: float, s2: float) -> list[float]:
    """Angles where the derivative vanishes, improved by Newton's method."""
    # derivative: s1 cos t - c1 sin t + 2 s2 cos 2t - 2 c2 sin 2t, as a polynomial in z = exp(i t)
    polynomial: NDArray[np.complex128] = np.array(
        [s2 + 1j * c2, 0.5 * (s1 + 1j * c1), 0.0, 0.5 * (s1 - 1j * c1), s2 - 1j * c2]
    )
    largest = np.abs(polynomial).max()
    if largest < 1e-280:
        return []
    z = np.roots(np.where(np.abs(polynomial) < 1e-30 * largest, 0.0, polynomial / largest))
    points: list[float] = []
    for t in np.angle(z[np.abs(np.abs(z) - 1.0) < 1e-4]).tolist():
        for _ in range(3):
            slope = s1 * math.cos(t) - c1 * math.sin(t) + 2 * (s2 * math.cos(2 * t) - c2 * math.sin(2 * t))
            bend = -s1 * math.sin(t) - c1 * math.cos(t) - 4 * (s2 * math.sin(2 * t) + c2 * math.cos(2 * t))
            if bend == 0.0 or abs(slope) > 0.01 * abs(bend):
                break
            t -= slope / bend
        if not any(abs(math.remainder(t - other, math.tau)) < 1e-9 for other in points):
            points.append(_wrap(t))
    return points


class _Own(NamedTuple):
    """P, Q, K of a leg and their derivatives along the path."""

    p: Any
    q: Any
    k: Any
    dp: Any
    dq: Any
    dk: Any


@dataclass(frozen=True)
class Path:
    """Crank angles ``offset + t * direction`` on one assembly mode; with mpmath as ``context`` in many digits."""

    mechanism: PointingDimensions
    offset: tuple[Any, Any]
    direction: tuple[float, float]
    s_y: int = 1
    s_x: int = -1
    context: Any = math

    def legs(self) -> tuple[Leg, Leg, Any]:
        """Return the leg solved first, the other one, and l1: scaled, or as the decimals that the lengths print as."""
        if self.context is math:
            scale = scale_of(self.mechanism)
            return (*solution_order(self.mechanism, scale), self.mechanism.l1 / scale)
        first, second = solution_order(self.mechanism)
        sizes = (first.crank, first.rod, second.crank, second.rod, self.mechanism.l1)
        c1, r1, c2, r2, l1 = (self.context.mpf(repr(size)) for size in sizes)
        return first._replace(crank=c1, rod=r1), second._replace(crank=c2, rod=r2), l1

    def sign(self, leg: Leg) -> int:
        """Branch sign of a leg."""
        return self.s_y if leg.name == "Y" else self.s_x

    def _own(self, leg: Leg, l1: Any, t: Any) -> _Own:
        index = 0 if leg.name == "Y" else 1
        rate = self.direction[index]
        phi = self.offset[index] + t * rate
        s, c = leg.crank * self.context.sin(phi), leg.crank * self.context.cos(phi)
        bend = leg.crank * 2.0 * self.context.sin(0.5 * phi) ** 2
        p, q = l1 - bend, leg.side * leg.rod + s
        k = 0.5 * (l1 * l1 + p * p + s * (2.0 * leg.side * leg.rod + s)) / l1
        return _Own(p, q, k, -s * rate, c * rate, rate * (q * c - p * s) / l1)

    def _touching(self, own: _Own) -> tuple[Any, Any, int]:
        """Output of a leg at its fold, from ``atan2`` without the square root; coefficient and assembled side.

        ``C = sqrt(2 |dF/dt| / |d2F/dy2|)`` with ``F = A cos y + B sin y - K``; there ``d2F/dy2 = -K``.  The root is
        real for growing t if ``dF + F_yy dy^2 / 2 = 0`` says so.
        """
        y = self.context.atan2(own.q * own.k, own.p * own.k)
        slope = own.dp * self.context.cos(y) + own.dq * self.context.sin(y) - own.dk
        return y, self.context.sqrt(2.0 * abs(slope / own.k)), 1 if slope * own.k > 0.0 else -1

    def _output(self, leg: Leg, own: _Own, factor: Any = 1.0) -> Any:
        """Output of a leg whose Q counts ``factor`` times; NaN out of reach."""
        p, q, k = own.p, factor * own.q, own.k
        square = p * p + q * q
        rest = square - k * k
        if not rest >= 0.0 or square == 0.0:
            return math.nan
        root = self.sign(leg) * self.context.sqrt(rest)
        return self.context.atan2(q * k + p * root, p * k - q * root)

    def first(self, t: Any) -> Any:
        """Angle u of the fixed gimbal axis; NaN out of reach."""
        leg, _, l1 = self.legs()
        return self._output(leg, self._own(leg, l1, t))

    def outputs(self, t: Any) -> tuple[Any, Any]:
        """Elevation and azimuth; both NaN where the mechanism cannot be assembled."""
        first, second, l1 = self.legs()
        u = self.first(t)
        v = self._output(second, self._own(second, l1, t), self.context.cos(u))
        if math.isnan(v):
            return math.nan, math.nan
        return (u, v) if first.name == "Y" else (v, u)

    def discriminant(self, t: Any, leg: Leg) -> Any:
        """``A^2 + B^2 - K^2`` of a leg, scaled; NaN for the second one where the first is out of reach."""
        first, _, l1 = self.legs()
        own = self._own(leg, l1, t)
        q = own.q if leg.name == first.name else own.q * self.context.cos(self.first(t))
        return own.p * own.p + q * q - own.k * own.k

    def at_fold(self, name: str, t: Any) -> tuple[Any, Any, Any, int]:
        """Elevation, azimuth, square-root coefficient and assembled side (+1: for growing t) at a fold of a leg."""
        first, second, l1 = self.legs()
        one, two = self._own(first, l1, t), self._own(second, l1, t)
        if first.name == name:
            u, coefficient, side = self._touching(one)
            v = self._output(second, two, self.context.cos(u))
        else:
            u = self.first(t)
            c, s = self.context.cos(u), self.context.sin(u)
            f_u = -one.p * s + one.q * c
            du = -(one.dp * c + one.dq * s - one.dk) / f_u if f_u != 0.0 else math.nan
            v, coefficient, side = self._touching(two._replace(q=two.q * c, dq=two.dq * c - two.q * s * du))
        return (u, v, coefficient, side) if first.name == "Y" else (v, u, coefficient, side)


@dataclass(frozen=True)
class Fold:
    """A fold: two assembly modes meet, the output moves like a square root of the distance (double precision).

    Crank angles are ``offset + parameter * direction``, first ``phi_x``, then ``phi_y``.

    Attributes
    ----------
    leg : str
        "Y" or "X", the leg whose two branches meet.
    parameter : float
        Position on the path, radians of crank angle for a direction of ones and zeros.
    offset, direction : tuple of float
        The path.
    phi_x, phi_y, a, b : float
        The pose at the fold, radians.
    coefficient : float
        ``C`` of ``y = y* -+ C sqrt(distance)`` for the output of the leg, rad^(1/2); NaN unless ``order`` is 2.
    side : int
        +1 if the mechanism can be assembled beyond the fold, -1 before it; 0 if on both sides or neither.
    order : int
        2 for a simple fold (square root); 1 where the branches cross instead of turning back.
    merging : tuple of (int, int)
        The two branches ``(s_y, s_x)`` that meet.
    """

    leg: str
    parameter: float
    offset: tuple[float, float]
    direction: tuple[float, float]
    phi_x: float
    phi_y: float
    a: float
    b: float
    coefficient: float
    side: int
    order: int
    merging: tuple[tuple[int, int], tuple[int, int]]

    @property
    def message(self) -> str:
        """One sentence for the user."""
        name, angle = ("elevation", self.a) if self.leg == "Y" else ("azimuth", self.b)
        where = f"phi_x = {math.degrees(self.phi_x):.6f} deg, phi_y = {math.degrees(self.phi_y):.6f} deg"
        first, second = self.merging
        what = "meet" if self.order == 2 else "cross, and which one the motion takes is not determined"
        where += f", {name} {math.degrees(angle):.6f} deg"
        return f"fold of leg {self.leg} at {where}: modes {first} and {second} {what}"


def less_square(c0: float, c1: float, s1: float, twice: float, k: tuple[float, float, float]) -> Coefficients:
    """``c0 + c1 cos t + s1 sin t + (twice / 2) cos 2t`` less the square of ``k0 + kc cos t + ks sin t``."""
    k0, kc, ks = k
    return (
        c0 - k0 * k0 - 0.5 * (kc * kc + ks * ks),
        c1 - 2 * k0 * kc,
        s1 - 2 * k0 * ks,
        0.5 * (twice - kc * kc + ks * ks),
        -kc * ks,
    )


def _coefficients(leg: Leg, l1: float, c: float) -> Coefficients:
    """``P^2 + c^2 Q^2 - K^2`` as a trigonometric polynomial of the leg's own crank angle."""
    k, p, q = leg.crank, l1 - leg.crank, leg.side * leg.rod
    square = (l1 * l1 + p * p + k * k) / (2 * l1), p * k / l1, q * k / l1
    c2 = c * c
    c0 = p * p + 0.5 * k * k + c2 * (q * q + 0.5 * k * k)
    return less_square(c0, 2 * p * k, 2 * c2 * q * k, k * k * (1 - c2), square)


class OneLeg(NamedTuple):
    """A leg whose crank turns while the other one stays: whether it is solved first, l1 (scaled), the other's branch.

    ``u`` is the angle of the gimbal axis that the other leg holds if that one is solved first; NaN otherwise.
    """

    leg: Leg
    l1: float
    is_first: bool
    u: float
    sign: int


def one_leg(mechanism: PointingDimensions, leg: str, phi_other: float, s_other: int | None) -> OneLeg:
    """Return a leg with what the other one holds; `GeometryError` for a crank angle out of the other's reach."""
    choice("leg", leg, ("Y", "X"))
    scale = scale_of(mechanism)
    l1 = mechanism.l1 / scale
    first, second = solution_order(mechanism, scale)
    if first.name == leg:
        return OneLeg(first, l1, True, math.nan, second.rest if s_other is None else s_other)
    sign = first.rest if s_other is None else s_other
    angles = {"X": (0.0, phi_other), "Y": (phi_other, 0.0)}[first.name]
    signs = (1, sign) if first.name == "X" else (sign, -1)
    # its own equation does not contain the other crank; only a pose in reach of both legs gives both outputs
    u = Path(mechanism, angles, (0.0, 0.0), *signs).first(0.0)
    if math.isnan(u):
        raise GeometryError(
            f"leg {first.name} does not reach at phi_other = {phi_other}; choose a crank angle in its reach"
        )
    return OneLeg(second, l1, False, u, sign)


def folds(
    self: PointingDimensions, leg: str, phi_other: float = 0.0, *, s_other: int | None = None
) -> tuple[Fold, ...]:
    """All folds of one leg over a full turn of its crank, with place, output, order and coefficient (theory/antenna 7).

    Sorted by crank angle.  The output of the other leg is NaN where that leg does not reach; a `GeometryError` says
    that the fold depends on it there.

    Parameters
    ----------
    leg : {"Y", "X"}
    phi_other : float
        Angle of the other crank, radians.
    s_other : {+1, -1}, optional
        Branch of the other leg; by default that of the rest pose.

    Examples
    --------
    >>> from graphsynth.systems.antenna import PointingMechanism
    >>> PointingMechanism().folds("X")
    ()
    >>> len(PointingMechanism(l3=0.12, l5=0.12).folds("X"))
    4
    """
    other_angle = finite("phi_other", phi_other)
    own = one_leg(self, leg, other_angle, s_other)
    if own.is_first:  # |S| = l1 + rod or |S| = |l1 - rod|
        roots = []
        for outer in (1.0, -1.0):
            crank, rod = own.leg.crank, own.leg.rod
            # (l1 +- rod)^2 - p^2 - k^2 - rod^2 with the squares of rod and l1 taken out
            goal = 2.0 * crank * (own.l1 - crank) + outer * 2.0 * own.l1 * rod
            roots += sinusoid_roots(2.0 * (own.l1 - crank) * crank, 2.0 * own.leg.side * rod * crank, goal)
        roots.sort()
    else:
        roots = quadratic_roots(_coefficients(own.leg, own.l1, math.cos(own.u)))
    offset = (0.0, other_angle) if leg == "Y" else (other_angle, 0.0)
    direction = (1.0, 0.0) if leg == "Y" else (0.0, 1.0)
    signs = (1, own.sign) if leg == "Y" else (own.sign, -1)
    path = Path(self, offset, direction, *signs)
    return tuple(fold_on_path(path, leg, root.angle, root.order) for root in roots)


def fold_on_path(path: Path, leg: str, parameter: float, multiplicity: int = 1) -> Fold:
    """Describe a fold whose place on a path is known."""
    a, b, coefficient, side = path.at_fold(leg, parameter)
    merging = ((1, path.s_x), (-1, path.s_x)) if leg == "Y" else ((path.s_y, 1), (path.s_y, -1))
    phi_x, phi_y = (path.offset[i] + parameter * path.direction[i] for i in (0, 1))
    end: tuple[float, int, int] = (coefficient, side, 2) if multiplicity == 1 else (math.nan, 0, 1)
    return Fold(leg, parameter, path.offset, path.direction, phi_x, phi_y, a, b, *end, merging)
