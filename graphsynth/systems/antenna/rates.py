"""Velocities and accelerations (theory/antenna 6, for both gimbal orders)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array
from graphsynth.systems.antenna.closed_form import poses
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


def _motion(leg: Leg, l1: float, phi: Array, dphi: Array, ddphi: Array) -> _LegMotion:
    s, c = leg.crank * np.sin(phi), leg.crank * np.cos(phi)
    p, q = l1 - leg.crank + c, leg.side * leg.rod + s
    k1 = (q * c - p * s) / l1
    k2 = (leg.crank * leg.crank - p * c - q * s) / l1
    square = dphi * dphi
    return _LegMotion(
        p, q, -s, c, k1, dphi, -s * dphi, c * dphi, -c * square - s * ddphi, -s * square + c * ddphi,
        k2 * square + k1 * ddphi,
    )  # fmt: skip


def rates(
    mechanism: PointingDimensions,
    phi_x: ArrayLike,
    phi_y: ArrayLike,
    speeds: tuple[ArrayLike, ArrayLike],
    accelerations: tuple[ArrayLike, ArrayLike],
    s_y: int,
    s_x: int,
) -> Rates:
    """Velocities and accelerations; see `PointingMechanism.rates`."""
    names = ("phi_x", "phi_y", "dphi_x", "dphi_y", "ddphi_x", "ddphi_y")
    given = [finite_array(name, value) for name, value in zip(names, (phi_x, phi_y, *speeds, *accelerations))]
    x, y, dx, dy, ddx, ddy = np.broadcast_arrays(*given)
    found = poses(mechanism, x, y, s_y, s_x)
    scale = scale_of(mechanism)
    l1 = mechanism.l1 / scale
    first, second = solution_order(mechanism, scale)
    moving = {"Y": (x, dx, ddx), "X": (y, dy, ddy)}
    one, two = _motion(first, l1, *moving[first.name]), _motion(second, l1, *moving[second.name])
    swap = mechanism.order == "XY"
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
    ddu = (
        -(
            -(one.p * cu + one.q * su) * du * du
            + 2.0 * (-one.p_dot * su + one.q_dot * cu) * du
            + (one.p_dot2 * cu + one.q_dot2 * su - one.k_dot2)
        )
        / f_u
    )
    g, g_dot = two.q * cu, two.q_dot * cu - two.q * su * du
    g_dot2 = two.q_dot2 * cu - 2.0 * two.q_dot * su * du - two.q * (cu * du * du + su * ddu)
    ddv = (
        -(
            -(two.p * cv + g * sv) * dv * dv
            + 2.0 * (-two.p_dot * sv + g_dot * cv) * dv
            + (two.p_dot2 * cv + g_dot2 * sv - two.k_dot2)
        )
        / g_v
    )
    return u1, v1, v2, du, dv, ddu, ddv


def passive_rates(mechanism: PointingDimensions, found: Poses, dphi_x: ArrayLike, dphi_y: ArrayLike) -> Array:
    """Rates of all twelve unknowns from ``J12 dx = -(d res / d phi) dphi``; see `PointingMechanism.passive_rates`."""
    x = passive_angles(mechanism, found).x
    shape = x.shape[:-1]
    speeds = np.stack(np.broadcast_arrays(dphi_x, dphi_y, found.a)[:2], -1).astype(np.float64).reshape(-1, 2)
    flat, phi = x.reshape(-1, 12), np.stack([found.phi_x.ravel(), found.phi_y.ravel()], -1)
    made = np.full_like(flat, np.nan)
    good = np.ravel(found.status == PoseStatus.OK)
    if good.any():
        equations = loop_equations(mechanism, flat[good], phi[good])
        right = -np.einsum("nij,nj->ni", equations.inputs, speeds[good])
        made[good] = np.linalg.solve(equations.jacobian, right[..., None])[..., 0]
    return made.reshape(*shape, 12)
