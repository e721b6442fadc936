"""Inverse problem: crank angles for a wanted direction of the reflector (closed form, each leg by itself)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array, sign
from graphsynth.systems.antenna.legs import Leg, legs, scale_of
from graphsynth.systems.antenna.results import orientation

if TYPE_CHECKING:
    from graphsynth.systems.antenna.mechanism import PointingMechanism

__all__ = ["CrankAngles", "CrankStatus", "cranks"]

Array = NDArray[np.float64]


class CrankStatus(IntEnum):
    """Whether a crank can be set so that its rod meets the reflector."""

    OK = 0
    DEAD_POINT = 1  #: crank and rod in one plane with the crank axis: two settings meet
    OUT_OF_REACH = 2
    INDETERMINATE = 3  #: the cardan lies on the crank axis

    @property
    def message(self) -> str:
        """One sentence that says what the status means."""
        return (
            "the crank reaches the pose",
            "the crank reaches the pose at a dead point: the reflector cannot drive it",
            "no setting of the crank reaches the pose",
            "not determined: the cardan lies on the crank axis and every setting is equally good",
        )[self]


@dataclass(frozen=True, eq=False)
class CrankAngles:
    """Crank angles that point the reflector.

    Attributes
    ----------
    a, b : ndarray, shape (...)
        Wanted elevation and azimuth, radians.
    phi_x, phi_y : ndarray, shape (...)
        Crank angles, radians in (-pi, pi]; NaN where the crank does not reach.
    status_y, status_x : ndarray of int8, shape (...)
        `CrankStatus` of leg Y (crank angle ``phi_x``) and of leg X (``phi_y``).
    deficit_y, deficit_x : ndarray, shape (...)
        ``|K| - hypot(A, B)`` where a crank does not reach, unit of the lengths; 0 elsewhere.
    margin_y, margin_x : ndarray, shape (...)
        Sine of the angle by which each crank is away from its dead point.
    s_y, s_x : ndarray of int8, shape (...)
        Branch signs of the assembly mode in which these crank angles give the wanted pose; 0 at a fold or without pose.
    """

    a: Array
    b: Array
    phi_x: Array
    phi_y: Array
    status_y: NDArray[np.int8]
    status_x: NDArray[np.int8]
    deficit_y: Array
    deficit_x: Array
    margin_y: Array
    margin_x: Array
    s_y: NDArray[np.int8]
    s_x: NDArray[np.int8]

    @property
    def reached(self) -> NDArray[np.bool_]:
        """True where both cranks reach the pose."""
        return np.asarray(
            (self.status_y <= CrankStatus.DEAD_POINT) & (self.status_x <= CrankStatus.DEAD_POINT), dtype=bool
        )


def _one_leg(leg: Leg, l1: float, point: Array, elbow: int) -> tuple[Array, ...]:
    """Crank angle, status, deficit, margin of a leg whose cardan lies at ``point`` (P, Q, across), shape (..., 3)."""
    p, q, across = point[..., 0] - (l1 - leg.crank), point[..., 1] - leg.side * leg.rod, point[..., 2]
    reach = np.hypot(p, q)
    k = (p * p + q * q + across * across + (leg.crank - leg.rod) * (leg.crank + leg.rod)) / (2.0 * leg.crank)
    rest = (reach - np.abs(k)) * (reach + np.abs(k))
    status = np.where(rest > 0.0, CrankStatus.OK, CrankStatus.DEAD_POINT)
    status = np.where(rest < 0.0, CrankStatus.OUT_OF_REACH, status)
    status = np.where((reach == 0.0) & (k == 0.0), CrankStatus.INDETERMINATE, status).astype(np.int8)
    root = np.sqrt(np.where(status <= CrankStatus.DEAD_POINT, np.maximum(rest, 0.0), np.nan))
    angle = np.arctan2(q * k + elbow * p * root, p * k - elbow * q * root)
    deficit = np.where(status == CrankStatus.OUT_OF_REACH, np.abs(k) - reach, 0.0)
    return angle, status, deficit, root / np.where(reach > 0.0, reach, np.nan)


def _branch(leg: Leg, l1: float, phi: Array, point: Array, axis: Array) -> NDArray[np.int8]:
    """Branch sign of a leg from the sense in which turning about its gimbal axis stretches the rod."""
    ball = np.stack(
        [l1 - leg.crank + leg.crank * np.cos(phi), leg.side * leg.rod + leg.crank * np.sin(phi), np.zeros_like(phi)], -1
    )
    pull = np.einsum("...i,...i->...", np.cross(axis, point), ball)
    return np.asarray(np.nan_to_num(-np.sign(pull)), dtype=np.int8)


def cranks(
    mechanism: PointingMechanism, a: ArrayLike, b: ArrayLike, elbow_y: int | None, elbow_x: int | None
) -> CrankAngles:
    """Crank angles for a wanted pose; see `PointingMechanism.cranks`."""
    wanted_a, wanted_b = np.broadcast_arrays(finite_array("a", a), finite_array("b", b))
    scale = scale_of(mechanism)
    leg_y, leg_x = legs(mechanism, scale)
    elbow_y = sign("elbow_y", leg_y.side if elbow_y is None else elbow_y)
    elbow_x = sign("elbow_x", leg_x.side if elbow_x is None else elbow_x)
    l1 = mechanism.l1 / scale
    R = orientation(wanted_a, wanted_b, mechanism.order)
    # coordinates (P, Q, across) of each leg: (y, z, x) for leg Y, (x, -z, y) for leg X; both are right-handed or not
    to_y, to_x = np.array([1, 2, 0]), np.array([0, 2, 1])
    flip = np.array([1.0, -1.0, 1.0])
    point_y, point_x = l1 * R[..., :, 1][..., to_y], l1 * R[..., :, 0][..., to_x] * flip
    phi_x, status_y, deficit_y, margin_y = _one_leg(leg_y, l1, point_y, elbow_y)
    phi_y, status_x, deficit_x, margin_x = _one_leg(leg_x, l1, point_x, elbow_x)
    axis_y, axis_x = _gimbal_axes(wanted_a, wanted_b, mechanism.order)
    s_y = _branch(leg_y, l1, phi_x, point_y, axis_y[..., to_y])
    s_x = _branch(leg_x, l1, phi_y, point_x, axis_x[..., to_x] * flip)
    return CrankAngles(
        a=wanted_a, b=wanted_b, phi_x=phi_x, phi_y=phi_y, status_y=status_y.astype(np.int8),
        status_x=status_x.astype(np.int8), deficit_y=deficit_y * scale, deficit_x=deficit_x * scale,
        margin_y=margin_y, margin_x=margin_x, s_y=s_y, s_x=s_x,
    )  # fmt: skip


def _gimbal_axes(a: Array, b: Array, order: str) -> tuple[Array, Array]:
    """Directions in the ground about which the elevation and the azimuth turn the reflector."""
    zero, one = np.zeros_like(a), np.ones_like(a)
    if order == "YX":
        return np.stack([np.cos(b), zero, -np.sin(b)], -1), np.stack([zero, one, zero], -1)
    return np.stack([one, zero, zero], -1), np.stack([zero, np.cos(a), np.sin(a)], -1)
