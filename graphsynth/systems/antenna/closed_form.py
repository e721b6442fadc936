"""Closed forms: poses on one assembly mode and on all, crank angles for a wanted pose, two models compared.

See theory/antenna 5, 8.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import choice, finite_array, sign
from graphsynth.systems.antenna.model import (
    Leg,
    PointingDimensions,
    Poses,
    PoseStatus,
    legs,
    orientation,
    scale_of,
    solution_order,
)

Array = NDArray[np.float64]
#: Codes of the kernel in terms of the legs, for each gimbal order.
_CODES = {
    "YX": (0, PoseStatus.FOLD_X, PoseStatus.FOLD_Y, PoseStatus.LEG_X_OUT_OF_REACH, PoseStatus.LEG_Y_OUT_OF_REACH, 5),
    "XY": (0, PoseStatus.FOLD_Y, PoseStatus.FOLD_X, PoseStatus.LEG_Y_OUT_OF_REACH, PoseStatus.LEG_X_OUT_OF_REACH, 5),
}


def crank_arrays(phi_x: ArrayLike, phi_y: ArrayLike) -> tuple[Array, Array]:
    """Check two crank angles and broadcast them against each other."""
    x, y = np.broadcast_arrays(finite_array("phi_x", phi_x), finite_array("phi_y", phi_y))
    return x, y


def poses(self: PointingDimensions, phi_x: ArrayLike, phi_y: ArrayLike, s_y: int = 1, s_x: int = -1) -> Poses:
    """Reflector angles for crank angles, on one assembly mode (closed form, theory/antenna 5).

    Accurate to a few units of rounding divided by ``margin_y`` and ``margin_x`` (estimated).  A pose that cannot be
    assembled has NaN, a status and the deficit in length.

    Parameters
    ----------
    phi_x, phi_y : array_like
        Angles of the cranks of legs Y and X, radians, finite, broadcast against each other.
    s_y, s_x : {+1, -1}
        Branch signs; the defaults contain the rest pose.
    """
    from graphsynth.systems.antenna.kernels.poses import triangular

    x, y = crank_arrays(phi_x, phi_y)
    signs = {"Y": sign("s_y", s_y), "X": sign("s_x", s_x)}
    scale = scale_of(self)
    first, second = solution_order(self, scale)
    inputs = {"Y": np.array(x).ravel(), "X": np.array(y).ravel()}  # writable copies: one compiled kernel
    u, v, deficit, margin1, margin2 = np.empty((5, x.size))
    status, close = np.empty(x.size, dtype=np.int8), np.empty(x.size, dtype=np.bool_)
    triangular(
        self.l1 / scale,
        *(first.crank, first.rod, first.side, float(signs[first.name])),
        *(second.crank, second.rod, second.side, float(signs[second.name])),
        *(inputs[first.name], inputs[second.name]),
        *(u, v, status, deficit, margin1, margin2, close),
    )
    status = np.array(_CODES[self.order], dtype=np.int8)[status]
    outputs = {first.name: (u, margin1), second.name: (v, margin2)}
    (a, margin_y), (b, margin_x) = outputs["Y"], outputs["X"]
    found: tuple[Any, ...] = (a, b, status, deficit * scale, margin_y, margin_x, close)
    a, b, status, deficit, margin_y, margin_x, close = (part.reshape(x.shape) for part in found)
    return Poses(x, y, a, b, status, deficit, margin_y, margin_x, close, int(s_y), int(s_x), self.order)


#: Branch signs ``(s_y, s_x)`` of the four modes; the rest pose lies on the first.
SIGNS = ((1, -1), (1, 1), (-1, -1), (-1, 1))


@dataclass(frozen=True, eq=False)
class PointingModes:
    """All assembly modes; the last axis runs over `SIGNS`.

    Attributes
    ----------
    a, b : ndarray, shape (..., 4)
        Elevation and azimuth, radians; NaN where the mode does not exist.
    status : ndarray of int8, shape (..., 4)
        `PoseStatus`.
    deficit : ndarray, shape (..., 4)
        Missing length, 0 where assembled.
    distinct : ndarray of bool, shape (..., 4)
        The mode exists and is not the second copy of a mode that a fold has merged with it.
    signs : tuple of (int, int)
        `SIGNS`.
    """

    a: NDArray[np.float64]
    b: NDArray[np.float64]
    status: NDArray[np.int8]
    deficit: NDArray[np.float64]
    distinct: NDArray[np.bool_]
    signs: tuple[tuple[int, int], ...] = SIGNS

    @property
    def count(self) -> NDArray[np.int64]:
        """Number of different real modes, 0 to 4."""
        return np.asarray(self.distinct.sum(axis=-1))


def solve(self: PointingDimensions, phi_x: ArrayLike, phi_y: ArrayLike) -> PointingModes:
    """All assembly modes at the given crank angles: up to four, none twice.

    Examples
    --------
    >>> from graphsynth.systems.antenna import PointingMechanism
    >>> PointingMechanism().solve(0.2, 0.3).count
    array(4)
    """
    found = [poses(self, phi_x, phi_y, *signs) for signs in SIGNS]
    a, b, status, deficit = (
        np.stack([getattr(mode, name) for mode in found], axis=-1) for name in ("a", "b", "status", "deficit")
    )
    distinct = status <= PoseStatus.FOLD_X
    for later in range(1, 4):
        for earlier in range(later):
            same = (a[..., later] == a[..., earlier]) & (b[..., later] == b[..., earlier])
            distinct[..., later] &= ~same
    return PointingModes(a, b, status, deficit, distinct)


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


def _one_leg(leg: Leg, l1: float, point: Array, axis: Array, elbow: int, scale: float) -> tuple[Any, ...]:
    """Crank angle, status, deficit, margin, branch sign of a leg whose cardan lies at ``point`` (P, Q, across).

    ``point`` has the shape (..., 3), and so may ``axis``, the direction of its gimbal axis: the branch is the sense in
    which turning about it stretches the rod.
    """
    p, q, across = point[..., 0] - (l1 - leg.crank), point[..., 1] - leg.side * leg.rod, point[..., 2]
    reach = np.hypot(p, q)
    k = (p * p + q * q + across * across + (leg.crank - leg.rod) * (leg.crank + leg.rod)) / (2.0 * leg.crank)
    rest = (reach - np.abs(k)) * (reach + np.abs(k))
    status = np.where(rest > 0.0, CrankStatus.OK, CrankStatus.DEAD_POINT)
    status = np.where(rest < 0.0, CrankStatus.OUT_OF_REACH, status)
    status = np.where((reach == 0.0) & (k == 0.0), CrankStatus.INDETERMINATE, status).astype(np.int8)
    root = np.sqrt(np.where(status <= CrankStatus.DEAD_POINT, np.maximum(rest, 0.0), np.nan))
    phi = np.arctan2(q * k + elbow * p * root, p * k - elbow * q * root)
    deficit = np.where(status == CrankStatus.OUT_OF_REACH, np.abs(k) - reach, 0.0)
    ball = l1 - leg.crank + leg.crank * np.cos(phi), leg.side * leg.rod + leg.crank * np.sin(phi), np.zeros_like(phi)
    pull = np.einsum("...i,...i->...", np.cross(axis, point), np.stack(ball, -1))
    branch = np.asarray(np.nan_to_num(-np.sign(pull)), dtype=np.int8)
    return phi, status, deficit * scale, root / np.where(reach > 0.0, reach, np.nan), branch


def cranks(
    self: PointingDimensions, a: ArrayLike, b: ArrayLike, elbow_y: int | None = None, elbow_x: int | None = None
) -> CrankAngles:
    """Crank angles that point the reflector (closed form, each leg by itself).

    With the assembly mode on which `poses` returns to the wanted pose.

    Parameters
    ----------
    a, b : array_like
        Wanted elevation and azimuth, radians.
    elbow_y, elbow_x : {+1, -1}, optional
        Which of the two settings of each crank; by default those of the rest pose (-1 and +1).

    Examples
    --------
    >>> from graphsynth.systems.antenna import PointingMechanism
    >>> import numpy as np
    >>> found = PointingMechanism().cranks(np.radians(10), np.radians(-5))
    >>> np.degrees([found.phi_x, found.phi_y]).round(6).tolist()
    [17.001794, -8.466231]
    """
    wanted_a, wanted_b = np.broadcast_arrays(finite_array("a", a), finite_array("b", b))
    scale = scale_of(self)
    leg_y, leg_x = legs(self, scale)
    elbow_y = sign("elbow_y", leg_y.side if elbow_y is None else elbow_y)
    elbow_x = sign("elbow_x", leg_x.side if elbow_x is None else elbow_x)
    l1 = self.l1 / scale
    R = orientation(wanted_a, wanted_b, self.order)
    # coordinates (P, Q, across) of each leg: (y, z, x) for leg Y, (x, -z, y) for leg X; both are right-handed or not
    to_y, to_x = np.array([1, 2, 0]), np.array([0, 2, 1])
    flip = np.array([1.0, -1.0, 1.0])
    point_y, point_x = l1 * R[..., :, 1][..., to_y], l1 * R[..., :, 0][..., to_x] * flip
    # the elevation turns the reflector about axis_y, the azimuth about axis_x: one is fixed, the other one carried
    fixed = np.eye(3)
    axis_y, axis_x = (R[..., :, 0], fixed[1]) if self.order == "YX" else (fixed[0], R[..., :, 1])
    y = _one_leg(leg_y, l1, point_y, axis_y[..., to_y], elbow_y, scale)
    x = _one_leg(leg_x, l1, point_x, axis_x[..., to_x] * flip, elbow_x, scale)
    return CrankAngles(wanted_a, wanted_b, *(part for both in zip(y, x) for part in both))


@dataclass(frozen=True)
class Convention:
    """How a model reads its inputs and outputs.

    Parameters
    ----------
    sense_y, sense_x : {+1, -1}
        -1 reverses the crank of leg Y or X.
    side_y, side_x : {+1, -1}
        -1 mounts a leg on the negative side of its axis (mounting angle turned by half a turn): crank pivot, ball joint
        and cardan are mirrored, the senses of all rotations are kept.
    output : {"gimbal", "normal"}
        "normal" reads the tilt of the reflector's normal ``n``: ``atan2(-n_y, n_z)`` and ``atan2(n_x, n_z)``.
    """

    sense_y: int = 1
    sense_x: int = 1
    side_y: int = 1
    side_x: int = 1
    output: str = "gimbal"

    def __post_init__(self) -> None:
        for name in ("sense_y", "sense_x", "side_y", "side_x"):
            object.__setattr__(self, name, sign(name, getattr(self, name)))
        choice("output", self.output, ("gimbal", "normal"))


@dataclass(frozen=True, eq=False)
class ModelComparison:
    """Outputs of two models at the same crank angles.

    Attributes
    ----------
    phi_x, phi_y : ndarray, shape (...)
        Crank angles, radians.
    a, b : ndarray, shape (2, ...)
        Elevation and azimuth of the first and of the second model, radians; NaN where a model cannot be assembled.
    status : ndarray of int8, shape (2, ...)
        `PoseStatus`.
    """

    phi_x: Array
    phi_y: Array
    a: Array
    b: Array
    status: NDArray[np.int8]

    @property
    def means(self) -> Array:
        """Mean of elevation and azimuth of each model, shape (2, ...), radians."""
        return 0.5 * (self.a + self.b)

    @property
    def difference(self) -> Array:
        """Mean of the second model minus mean of the first, radians."""
        return np.asarray(0.5 * ((self.a[1] - self.a[0]) + (self.b[1] - self.b[0])))

    @property
    def arcminutes(self) -> Array:
        """`difference` in minutes of arc."""
        return np.degrees(self.difference) * 60.0

    @property
    def separation(self) -> Array:
        """Elevation minus azimuth of each model, shape (2, ...), radians."""
        return self.a - self.b

    @property
    def assembled(self) -> NDArray[np.bool_]:
        """True where both models can be assembled."""
        return np.asarray((self.status <= PoseStatus.FOLD_X).all(axis=0))


def read_angles(
    mechanism: PointingDimensions, reading: Convention, phi_x: Array, phi_y: Array
) -> tuple[Array, Array, NDArray[np.int8]]:
    """Elevation, azimuth and status as a model with the given conventions reads them.

    A leg on the negative side is the mirror image of the leg in the plane through the other gimbal axis: crank angle
    and output change their signs together, and the other output enters through its cosine only.
    """
    at = poses(mechanism, reading.side_y * reading.sense_y * phi_x, reading.side_x * reading.sense_x * phi_y)
    a, b = reading.side_y * at.a, reading.side_x * at.b
    if reading.output == "normal":
        normal = orientation(a, b, mechanism.order)[..., :, 2]
        a, b = np.arctan2(-normal[..., 1], normal[..., 2]), np.arctan2(normal[..., 0], normal[..., 2])
    return a, b, at.status


def compare(
    self: PointingDimensions,
    other: PointingDimensions,
    phi_x: ArrayLike,
    phi_y: ArrayLike | None = None,
    *,
    reading: Convention | None = None,
    other_reading: Convention | None = None,
) -> ModelComparison:
    """Difference of two models over a sweep: gimbal order, lengths, senses, mounting, reading (theory/antenna 8).

    Parameters
    ----------
    other : PointingMechanism
    phi_x, phi_y : array_like
        Crank angles, radians; ``phi_y = phi_x`` unless given.
    reading, other_reading : Convention, optional
        Conventions of each model.

    Examples
    --------
    >>> from graphsynth.systems.antenna import PointingMechanism
    >>> import numpy as np
    >>> found = PointingMechanism().compare(PointingMechanism(order="XY"), np.radians([15, 40]))
    >>> found.arcminutes.round(6).tolist()
    [0.656059, 30.989576]
    """
    x, y = crank_arrays(phi_x, phi_x if phi_y is None else phi_y)
    one = read_angles(self, reading or Convention(), x, y)
    two = read_angles(other, other_reading or Convention(), x, y)
    a, b = np.stack([one[0], two[0]]), np.stack([one[1], two[1]])
    return ModelComparison(x, y, a, b, np.stack([one[2], two[2]]))
