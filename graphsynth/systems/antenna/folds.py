"""Folds (output singularities) and dead points (input singularities) of each leg, over a full turn (section 2.7).

Where a discriminant vanishes, two assembly modes or two crank settings meet.  For the leg that is solved first it is a
product of two sinusoids of the crank angle, for the other leg a trigonometric polynomial of degree two: all of its
roots are found.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from graphsynth.core.checks import choice, finite
from graphsynth.core.errors import GeometryError
from graphsynth.systems.antenna.legs import Leg, scale_of, solution_order
from graphsynth.systems.antenna.trigonometric import TrigRoot, quadratic_roots, sinusoid_roots

if TYPE_CHECKING:
    from graphsynth.systems.antenna.mechanism import PointingMechanism

__all__ = ["DeadPoint", "Fold", "dead_points", "fold_on_path", "folds"]


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
        output = (
            f"{'elevation' if self.leg == 'Y' else 'azimuth'} {math.degrees(self.a if self.leg == 'Y' else self.b):.6f}"
        )
        where = f"phi_x = {math.degrees(self.phi_x):.6f} deg, phi_y = {math.degrees(self.phi_y):.6f} deg"
        first, second = self.merging
        what = "meet" if self.order == 2 else "cross, and which one the motion takes is not determined"
        return f"fold of leg {self.leg} at {where}, {output} deg: modes {first} and {second} {what}"


@dataclass(frozen=True)
class DeadPoint:
    """A dead point: crank and rod lie in one plane with the crank axis, the reflector cannot drive the crank.

    Attributes
    ----------
    leg : str
        "Y" (input ``phi_x``) or "X" (input ``phi_y``): the input that loses control.
    phi_x, phi_y, a, b : float
        The pose, radians.
    kind : str
        "stretched" (crank points to the cardan) or "folded" (it points away).
    s_y, s_x : int
        Assembly mode; 0 where the other leg does not reach (its output and the transmission are NaN then).
    transmission : float
        Derivative of the leg's output by its own crank angle as computed at this pose: 0 up to rounding.
    """

    leg: str
    phi_x: float
    phi_y: float
    a: float
    b: float
    kind: str
    s_y: int
    s_x: int
    transmission: float


def _coefficients(leg: Leg, l1: float, c: float) -> tuple[float, float, float, float, float]:
    """``P^2 + c^2 Q^2 - K^2`` as a trigonometric polynomial of the leg's own crank angle."""
    k, p, q = leg.crank, l1 - leg.crank, leg.side * leg.rod
    k0, kc, ks = (l1 * l1 + p * p + k * k) / (2 * l1), p * k / l1, q * k / l1
    c2 = c * c
    return (
        p * p + 0.5 * k * k + c2 * (q * q + 0.5 * k * k) - k0 * k0 - 0.5 * (kc * kc + ks * ks),
        2 * p * k - 2 * k0 * kc,
        2 * c2 * q * k - 2 * k0 * ks,
        0.5 * (k * k * (1 - c2) - kc * kc + ks * ks),
        -kc * ks,
    )


def _planar_folds(leg: Leg, l1: float) -> list[TrigRoot]:
    """Crank angles with ``|S| = l1 + rod`` or ``|S| = |l1 - rod|``."""
    k, r, p = leg.crank, leg.rod, l1 - leg.crank
    found = []
    for outer in (1.0, -1.0):
        # (l1 +- rod)^2 - p^2 - k^2 - rod^2 with the squares of rod and l1 taken out
        goal = 2.0 * k * (l1 - k) + outer * 2.0 * l1 * r
        found += sinusoid_roots(2.0 * p * k, 2.0 * leg.side * r * k, goal)
    return sorted(found)


def _first_output(mechanism: PointingMechanism, leg: Leg, phi: float, sign: int) -> float:
    """Angle u of the leg that is solved first."""
    angles = {"X": (0.0, phi), "Y": (phi, 0.0)}[leg.name]
    signs = (1, sign) if leg.name == "X" else (sign, -1)
    # its own equation does not contain the other crank; only a pose in reach of both legs gives both outputs
    from graphsynth.systems.antenna.path import Path

    return Path(mechanism, angles, (0.0, 0.0), *signs).first(0.0)


def folds(mechanism: PointingMechanism, leg: str, phi_other: float, s_other: int | None) -> tuple[Fold, ...]:
    """All folds of one leg over a turn of its crank; see `PointingMechanism.folds`.

    Raises
    ------
    GeometryError
        A crank angle out of the reach of the other leg.
    """
    choice("leg", leg, ("Y", "X"))
    other_angle = finite("phi_other", phi_other)
    scale = scale_of(mechanism)
    l1 = mechanism.l1 / scale
    first, second = solution_order(mechanism, scale)
    own, other = (first, second) if first.name == leg else (second, first)
    sign = other.rest if s_other is None else s_other
    if own is first:
        roots = _planar_folds(own, l1)
    else:
        u = _first_output(mechanism, first, other_angle, sign)
        if math.isnan(u):
            raise GeometryError(
                f"leg {other.name} does not reach at phi_other = {other_angle}; choose a crank angle in its reach"
            )
        roots = quadratic_roots(_coefficients(own, l1, math.cos(u)))
    offset = (0.0, other_angle) if leg == "Y" else (other_angle, 0.0)
    direction = (1.0, 0.0) if leg == "Y" else (0.0, 1.0)
    signs = (1, sign) if leg == "Y" else (sign, -1)
    return tuple(fold_on_path(mechanism, leg, root.angle, offset, direction, *signs, root.order) for root in roots)


def fold_on_path(
    mechanism: PointingMechanism,
    leg: str,
    parameter: float,
    offset: tuple[float, float],
    direction: tuple[float, float],
    s_y: int,
    s_x: int,
    multiplicity: int = 1,
) -> Fold:
    """Describe a fold whose place on a path is known."""
    from graphsynth.systems.antenna.path import Path

    path = Path(mechanism, offset, direction, s_y, s_x)
    at = path.at_fold(leg, parameter)
    merging = ((1, s_x), (-1, s_x)) if leg == "Y" else ((s_y, 1), (s_y, -1))
    phi_x, phi_y = (offset[i] + parameter * direction[i] for i in (0, 1))
    simple = multiplicity == 1
    return Fold(
        leg, parameter, offset, direction, phi_x, phi_y, at.a, at.b, at.coefficient if simple else math.nan,
        at.side if simple else 0, 2 if simple else 1, merging,
    )  # fmt: skip


def dead_points(mechanism: PointingMechanism, leg: str, phi_other: float, s_other: int | None) -> tuple[DeadPoint, ...]:
    """All dead points of one crank; see `PointingMechanism.dead_points`.

    Raises
    ------
    GeometryError
        A crank angle out of the reach of the other leg.
    """
    choice("leg", leg, ("Y", "X"))
    other_angle = finite("phi_other", phi_other)
    scale = scale_of(mechanism)
    l1 = mechanism.l1 / scale
    first, second = solution_order(mechanism, scale)
    own, other = (first, second) if first.name == leg else (second, first)
    cosine = 1.0
    if own is second:
        u = _first_output(mechanism, first, other_angle, other.rest if s_other is None else s_other)
        if math.isnan(u):
            raise GeometryError(
                f"leg {other.name} does not reach at phi_other = {other_angle}; choose a crank angle in its reach"
            )
        cosine = math.cos(u)
    else:
        u = math.nan
    k, p, q = own.crank, l1 - own.crank, own.side * own.rod
    k0, kc, ks = (l1 * l1 + p * p + k * k) / (2 * k), -l1 * p / k, -l1 * cosine * q / k
    square = l1 * l1
    roots = quadratic_roots(
        (
            0.5 * square * (1 + cosine * cosine) + p * p + q * q - k0 * k0 - 0.5 * (kc * kc + ks * ks),
            -2 * l1 * p - 2 * k0 * kc,
            -2 * l1 * cosine * q - 2 * k0 * ks,
            0.5 * (square * (1 - cosine * cosine) - kc * kc + ks * ks),
            -kc * ks,
        )
    )
    found = []
    for root in roots:
        v = root.angle
        dp, dq = l1 * math.cos(v) - p, l1 * cosine * math.sin(v) - q
        toward = math.copysign(1.0, k0 + kc * math.cos(v) + ks * math.sin(v))
        phi = math.atan2(toward * dq, toward * dp)
        found.append(_dead_point(mechanism, leg, phi, other_angle, v, u, toward, s_other))
    return tuple(found)


def _dead_point(
    mechanism: PointingMechanism,
    leg: str,
    phi: float,
    other_angle: float,
    output: float,
    other_output: float,
    toward: float,
    s_other: int | None,
) -> DeadPoint:
    phi_x, phi_y = (phi, other_angle) if leg == "Y" else (other_angle, phi)
    candidates = [
        (s_y, s_x) for s_y in (1, -1) for s_x in (1, -1) if s_other is None or (s_x if leg == "Y" else s_y) == s_other
    ]
    rest = -1 if leg == "Y" else 1
    candidates.sort(key=lambda signs: (signs[1] if leg == "Y" else signs[0]) != rest)
    best: tuple[float, int, int, float, float, float] | None = None
    for s_y, s_x in candidates:
        got = mechanism.rates(phi_x, phi_y, s_y=s_y, s_x=s_x)
        a, b = float(got.poses.a), float(got.poses.b)
        miss = abs(math.remainder((a if leg == "Y" else b) - output, math.tau))
        slope = float(got.jacobian[0, 0] if leg == "Y" else got.jacobian[1, 1])
        if miss < 1e-6 and (best is None or miss < best[0] - 1e-9):
            best = (miss, s_y, s_x, a, b, slope)
    kind = "stretched" if toward > 0.0 else "folded"
    if best is None:
        a, b = (output, other_output) if leg == "Y" else (other_output, output)
        return DeadPoint(leg, phi_x, phi_y, a, b, kind, 0, 0, math.nan)
    return DeadPoint(leg, phi_x, phi_y, best[3], best[4], kind, best[1], best[2], best[5])
