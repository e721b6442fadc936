"""Velocities and accelerations, dead-centre positions, sweeps that stop at a fold (theory/antenna 6, 7)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite, finite_array, sign
from graphsynth.core.errors import GeometryError
from graphsynth.systems.antenna import closed_form
from graphsynth.systems.antenna.folds import Fold, Path, fold_on_path, less_square, one_leg, quadratic_roots
from graphsynth.systems.antenna.loop_equations import loop_equations, passive_angles
from graphsynth.systems.antenna.model import Leg, PointingDimensions, Poses, PoseStatus, scale_of, solution_order

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Rates:
    """Poses with their first and second derivatives; NaN at a fold and where not assembled.

    Attributes
    ----------
    poses : Poses
    jacobian : ndarray, shape (..., 2, 2)
        ``[[da/dphi_x, da/dphi_y], [db/dphi_x, db/dphi_y]]``.
    da, db : ndarray, shape (...)
        Rates of elevation and azimuth, rad/s.
    dda, ddb : ndarray, shape (...)
        Their accelerations, rad/s^2.
    """

    poses: Poses
    jacobian: Array
    da: Array
    db: Array
    dda: Array
    ddb: Array


class _LegMotion(NamedTuple):
    """Coefficients P, Q, K of a leg with derivatives by the crank angle, and its motion in time."""

    p: Array
    q: Array
    p1: Array
    q1: Array
    k1: Array
    dphi: Array
    p_dot: Array
    q_dot: Array
    p_dot2: Array
    q_dot2: Array
    k_dot2: Array

    def second(self, q: tuple[Array, Array, Array], c: Array, s: Array, dy: Array, slope: Array) -> Array:
        """Acceleration of an output y with ``P cos y + q sin y = K``; ``q`` with its two derivatives in time."""
        bend = -(self.p * c + q[0] * s) * dy * dy
        turn = 2.0 * (-self.p_dot * s + q[1] * c) * dy
        return np.asarray(-(bend + turn + (self.p_dot2 * c + q[2] * s - self.k_dot2)) / slope)


def _motion(leg: Leg, l1: float, phi: Array, dphi: Array, ddphi: Array) -> _LegMotion:
    s, c = leg.crank * np.sin(phi), leg.crank * np.cos(phi)
    p, q = l1 - leg.crank + c, leg.side * leg.rod + s
    k1 = (q * c - p * s) / l1
    k2 = (leg.crank * leg.crank - p * c - q * s) / l1
    square = dphi * dphi
    second = -c * square - s * ddphi, -s * square + c * ddphi, k2 * square + k1 * ddphi
    return _LegMotion(p, q, -s, c, k1, dphi, -s * dphi, c * dphi, *second)


def rates(
    self: PointingDimensions,
    phi_x: ArrayLike,
    phi_y: ArrayLike,
    dphi_x: ArrayLike = 0.0,
    dphi_y: ArrayLike = 0.0,
    ddphi_x: ArrayLike = 0.0,
    ddphi_y: ArrayLike = 0.0,
    *,
    s_y: int = 1,
    s_x: int = -1,
) -> Rates:
    """Velocity Jacobian, velocities and accelerations (theory/antenna 6); crank rates in rad/s, rad/s^2.

    Examples
    --------
    >>> from graphsynth.systems.antenna import PointingMechanism
    >>> import numpy as np
    >>> PointingMechanism().rates(np.radians(15), np.radians(15)).jacobian.round(9).tolist()
    [[0.583946582, 0.01261739], [0.0, 0.579026781]]
    """
    names = ("phi_x", "phi_y", "dphi_x", "dphi_y", "ddphi_x", "ddphi_y")
    given = [finite_array(name, value) for name, value in zip(names, (phi_x, phi_y, dphi_x, dphi_y, ddphi_x, ddphi_y))]
    x, y, dx, dy, ddx, ddy = np.broadcast_arrays(*given)
    found = closed_form.poses(self, x, y, s_y, s_x)
    scale = scale_of(self)
    l1 = self.l1 / scale
    first, second = solution_order(self, scale)
    moving = {"Y": (x, dx, ddx), "X": (y, dy, ddy)}
    one, two = _motion(first, l1, *moving[first.name]), _motion(second, l1, *moving[second.name])
    swap = self.order == "XY"
    u, v = (found.a, found.b) if swap else (found.b, found.a)
    hide = np.where(found.status == PoseStatus.OK, 0.0, np.nan)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        u1, v1, v2, du, dv, ddu, ddv = (part + hide for part in _derivatives(one, two, u, v))
    zero = np.zeros_like(u1) + hide
    if swap:
        jacobian = np.stack([np.stack([u1, zero], -1), np.stack([v1, v2], -1)], -2)
        return Rates(found, jacobian, du, dv, ddu, ddv)
    jacobian = np.stack([np.stack([v2, v1], -1), np.stack([zero, u1], -1)], -2)
    return Rates(found, jacobian, dv, du, ddv, ddu)


def _derivatives(one: _LegMotion, two: _LegMotion, u: Array, v: Array) -> tuple[Array, ...]:
    """du/dphi1, dv/dphi1, dv/dphi2 and the motion in time of both outputs."""
    cu, su, cv, sv = np.cos(u), np.sin(u), np.cos(v), np.sin(v)
    f_u = -one.p * su + one.q * cu
    u1 = -(one.p1 * cu + one.q1 * su - one.k1) / f_u
    g_v = -two.p * sv + two.q * cu * cv
    g_u = -two.q * su * sv
    v1 = -g_u * u1 / g_v
    v2 = -(two.p1 * cv + two.q1 * cu * sv - two.k1) / g_v
    du = u1 * one.dphi
    dv = v1 * one.dphi + v2 * two.dphi
    ddu = one.second((one.q, one.q_dot, one.q_dot2), cu, su, du, f_u)
    g_dot2 = two.q_dot2 * cu - 2.0 * two.q_dot * su * du - two.q * (cu * du * du + su * ddu)
    ddv = two.second((two.q * cu, two.q_dot * cu - two.q * su * du, g_dot2), cv, sv, dv, g_v)
    return u1, v1, v2, du, dv, ddu, ddv


def passive_rates(self: PointingDimensions, poses: Poses, dphi_x: ArrayLike, dphi_y: ArrayLike) -> NDArray[np.float64]:
    """Rates of the twelve unknowns for crank speeds, shape (..., 12), from the 12 x 12 Jacobian."""
    x = passive_angles(self, poses).x
    speeds = np.stack(np.broadcast_arrays(dphi_x, dphi_y, poses.a)[:2], -1).astype(np.float64).reshape(-1, 2)
    flat, phi = x.reshape(-1, 12), np.stack([poses.phi_x.ravel(), poses.phi_y.ravel()], -1)
    made = np.full_like(flat, np.nan)
    good = np.ravel(poses.status == PoseStatus.OK)
    if good.any():
        equations = loop_equations(self, flat[good], phi[good])
        right = -np.einsum("nij,nj->ni", equations.inputs, speeds[good])
        made[good] = np.linalg.solve(equations.jacobian, right[..., None])[..., 0]
    return made.reshape(x.shape)


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


def dead_points(
    self: PointingDimensions, leg: str, phi_other: float = 0.0, *, s_other: int | None = None
) -> tuple[DeadPoint, ...]:
    """All dead points of one crank: crank and rod in a plane with the crank axis (theory/antenna 7).

    Parameters are those of `folds`.
    """
    other_angle = finite("phi_other", phi_other)
    own, l1, is_first, u, _ = one_leg(self, leg, other_angle, s_other)
    cosine = 1.0 if is_first else math.cos(u)
    k, p, q = own.crank, l1 - own.crank, own.side * own.rod
    k0, kc, ks = (l1 * l1 + p * p + k * k) / (2 * k), -l1 * p / k, -l1 * cosine * q / k
    square = l1 * l1
    c0 = 0.5 * square * (1 + cosine * cosine) + p * p + q * q
    twice = square * (1 - cosine * cosine)
    roots = quadratic_roots(less_square(c0, -2 * l1 * p, -2 * l1 * cosine * q, twice, (k0, kc, ks)))
    found = []
    for root in roots:
        v = root.angle
        dp, dq = l1 * math.cos(v) - p, l1 * cosine * math.sin(v) - q
        toward = math.copysign(1.0, k0 + kc * math.cos(v) + ks * math.sin(v))
        phi = math.atan2(toward * dq, toward * dp)
        found.append(_dead_point(self, leg, (phi, other_angle), (v, u), toward, s_other))
    return tuple(found)


def _dead_point(
    mechanism: PointingDimensions,
    leg: str,
    angles: tuple[float, float],
    outputs: tuple[float, float],
    toward: float,
    s_other: int | None,
) -> DeadPoint:
    """Find the assembly mode of a dead point: crank angles and outputs are those of the leg and of the other one."""
    own = 0 if leg == "Y" else 1
    rest = (-1, 1)[own]
    signs = [(s_y, s_x) for s_y in (1, -1) for s_x in (1, -1) if s_other in (None, (s_y, s_x)[1 - own])]
    signs.sort(key=lambda pair: pair[1 - own] != rest)
    phi = angles if own == 0 else angles[::-1]
    kind = "stretched" if toward > 0.0 else "folded"
    best = DeadPoint(leg, *phi, *(outputs if own == 0 else outputs[::-1]), kind, 0, 0, math.nan)
    least = 1e-6
    for s_y, s_x in signs:
        got = rates(mechanism, *phi, s_y=s_y, s_x=s_x)
        pose = float(got.poses.a), float(got.poses.b)
        miss = abs(math.remainder(pose[own] - outputs[0], math.tau))
        if miss < least:
            least = miss - 1e-9
            best = DeadPoint(leg, *phi, *pose, kind, s_y, s_x, float(got.jacobian[own, own]))
    return best


#: Samples of a discriminant per radian of crank angle, between which a dip is refined.
DENSITY = 60
#: A dip to this part of the largest discriminant counts as touching zero: the branches cross there.
TOUCH = 1e-13


@dataclass(frozen=True, eq=False)
class PointingSweep:
    """Poses along a straight path of the crank angles, up to the first fold.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Path parameter; crank angles are ``offset + t * direction``.
    poses : Poses
        ``a`` and ``b`` are NaN beyond the fold, also where the mechanism could be assembled again there.
    reached : ndarray of bool, shape (n,)
        Poses that the sweep comes to.
    fold : Fold or None
        Where the sweep had to stop.
    message : str
        One sentence for the user.
    """

    t: NDArray[np.float64]
    poses: Poses
    reached: NDArray[np.bool_]
    fold: Fold | None
    message: str


def sweep(
    self: PointingDimensions,
    t: ArrayLike,
    direction: tuple[float, float] = (1.0, 1.0),
    offset: tuple[float, float] = (0.0, 0.0),
    *,
    s_y: int = 1,
    s_x: int = -1,
) -> PointingSweep:
    """Move both cranks along ``offset + t * direction`` on one assembly mode and stop at the first fold.

    It never continues on another mode; beyond the fold all angles are NaN.

    Parameters
    ----------
    t : array_like, shape (n,)
        Rising or falling path parameter, radians; a `GeometryError` refuses others.
    direction, offset : tuple of float
        Change of ``(phi_x, phi_y)`` per unit of ``t``, and their values at ``t = 0``.
    s_y, s_x : {+1, -1}
        Assembly mode.

    Examples
    --------
    >>> from graphsynth.systems.antenna import PointingMechanism
    >>> import numpy as np
    >>> sweep = PointingMechanism(l3=0.1, l5=0.1).sweep(np.radians(np.arange(0.0, 76.0)))
    >>> np.degrees([sweep.fold.parameter, sweep.fold.a]).round(9).tolist(), round(sweep.fold.coefficient, 9)
    ([69.394627605, 150.578155425], 2.869433008)
    """
    values = finite_array("t", t)
    change = np.diff(values)
    if values.ndim != 1 or values.size < 2 or not ((change > 0.0).all() or (change < 0.0).all()):
        raise GeometryError(f"t of shape {values.shape} must hold at least two values that rise or fall throughout")
    dx, dy = (finite(f"direction[{i}]", part) for i, part in enumerate(direction))
    ox, oy = (finite(f"offset[{i}]", part) for i, part in enumerate(offset))
    path = Path(self, (ox, oy), (dx, dy), sign("s_y", s_y), sign("s_x", s_x))
    found = closed_form.poses(self, ox + values * dx, oy + values * dy, s_y, s_x)
    if not found.assembled[0]:
        nothing = np.zeros(values.size, dtype=bool)
        why = PoseStatus(int(found.status[0])).message
        return PointingSweep(values, _hide(found, nothing), nothing, None, f"the sweep cannot start: {why}")
    stop, end = None, float(values[-1])
    for leg in path.legs()[:2]:
        zero = _zero_of(path, leg, float(values[0]), end)
        if zero is not None:
            stop, end = (leg.name, *zero), zero[0]
    if stop is None:
        return PointingSweep(values, found, found.assembled, None, "the whole sweep lies on one assembly mode")
    fold, place = fold_on_path(path, *stop), stop[1]
    reached = (values <= place) if change[0] > 0.0 else (values >= place)
    reached &= found.assembled
    return PointingSweep(values, _hide(found, reached), reached, fold, f"stopped at t = {place:.12g}: {fold.message}")


def _hide(poses: Poses, reached: NDArray[np.bool_]) -> Poses:
    return replace(poses, a=np.where(reached, poses.a, np.nan), b=np.where(reached, poses.b, np.nan))


def _zero_of(path: Path, leg: Leg, start: float, stop: float) -> tuple[float, int] | None:
    """First zero of the discriminant of a leg: its parameter, and 2 where it only touches zero, else 1.

    Samples between which the second derivative cannot hide a dip are refined by minimisation (estimated, not proved).
    """
    from scipy.optimize import brentq, minimize_scalar

    def value(t: float) -> float:
        return float(path.discriminant(t, leg))

    turn = abs(stop - start) * max(map(abs, path.direction))
    grid = np.linspace(start, stop, max(64, math.ceil(DENSITY * turn)) + 1).tolist()
    heights = [value(t) for t in grid]
    touch = TOUCH * max(abs(height) for height in heights if not math.isnan(height))
    precision = {"xtol": 4e-16 * max(1.0, abs(stop)), "rtol": 8.9e-16}
    for i in range(1, len(grid)):
        if math.isnan(heights[i]):
            return None  # beyond the fold of the first leg by rounding
        if heights[i] < 0.0:
            return float(brentq(value, grid[i - 1], grid[i], **precision)), 1
        if i + 1 < len(grid) and heights[i] < heights[i - 1] and heights[i] <= heights[i + 1]:
            low, high = sorted((grid[i - 1], grid[i + 1]))
            dip = minimize_scalar(value, bounds=(low, high), method="bounded", options={"xatol": 1e-10})
            if abs(dip.fun) <= touch:
                return float(dip.x), 2
            if dip.fun < 0.0:
                return float(brentq(value, grid[i - 1], dip.x, **precision)), 1
    return None
