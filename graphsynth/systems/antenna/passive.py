"""The ten passive joint angles, without iteration (specification instruments_and_dynamics, section 2.5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.systems.antenna.results import Poses

if TYPE_CHECKING:
    from graphsynth.systems.antenna.mechanism import PointingMechanism

__all__ = ["PassiveAngles", "passive_angles", "printed_ball_joint"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PassiveAngles:
    """The twelve unknowns of the loop equations.

    Attributes
    ----------
    x : ndarray, shape (..., 12)
        ``x1 ... x12`` of section 2.3, radians: cardan and ball joint of leg Y, elevation, cardan and ball joint of leg
        X, azimuth.  NaN where the mechanism cannot be assembled.
    margin : ndarray, shape (...)
        Smallest cosine of ``x2, x4, x8, x10``: 0 means that a cardan or the angles of a ball joint are locked.
    """

    x: Array
    margin: Array


def _turn(axis: int, angle: Array) -> Array:
    """Rotation about a coordinate axis, shape (..., 3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.zeros((*np.shape(angle), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix[..., axis, axis] = 1.0
    matrix[..., i, i] = matrix[..., j, j] = c
    matrix[..., j, i], matrix[..., i, j] = s, -s
    return matrix


def _ball_joints(mechanism: PointingMechanism, poses: Poses) -> tuple[Array, Array]:
    """Return positions of the two ball joints in the ground, shape (..., 3)."""
    l1, l2, l3, l4, l5 = mechanism.lengths
    zero = np.zeros(np.shape(poses.phi_x))
    y = np.stack([zero, l1 - l3 + l3 * np.cos(poses.phi_x), -l2 + l3 * np.sin(poses.phi_x)], -1)
    x = np.stack([l1 - l5 + l5 * np.cos(poses.phi_y), zero, -l4 - l5 * np.sin(poses.phi_y)], -1)
    return y, x


def _rotations(mechanism: PointingMechanism, poses: Poses) -> tuple[Array, Array, Array, Array]:
    """Return cardan angles (..., 2) of legs Y and X and the rotations E_Y, E_X of their ball joints."""
    R = poses.rotation
    ball_y, ball_x = _ball_joints(mechanism, poses)
    dy = np.einsum("...ji,...j->...i", R, ball_y - mechanism.l1 * R[..., :, 1])
    dx = np.einsum("...ji,...j->...i", R, ball_x - mechanism.l1 * R[..., :, 0])
    x2, x1 = np.arctan2(dy[..., 0], np.hypot(dy[..., 1], dy[..., 2])), np.arctan2(-dy[..., 1], -dy[..., 2])
    x8, x7 = np.arctan2(-dx[..., 1], np.hypot(dx[..., 0], dx[..., 2])), np.arctan2(dx[..., 0], -dx[..., 2])
    E_y = _turn(0, -poses.phi_x) @ R @ _turn(0, -x1) @ _turn(1, -x2)
    E_x = _turn(1, -poses.phi_y) @ R @ _turn(1, -x7) @ _turn(0, -x8)
    return np.stack([x1, x2], -1), np.stack([x7, x8], -1), E_y, E_x


def passive_angles(mechanism: PointingMechanism, poses: Poses) -> PassiveAngles:
    """All twelve unknowns of the corrected loop equations for known poses; see `PointingMechanism.passive_angles`."""
    cardan_y, cardan_x, E, F = _rotations(mechanism, poses)
    x = np.empty((*np.shape(poses.a), 12))
    x[..., 0:2], x[..., 6:8] = cardan_y, cardan_x
    x[..., 2] = np.arctan2(-E[..., 1, 2], E[..., 1, 1])
    x[..., 3] = np.arctan2(E[..., 1, 0], np.hypot(E[..., 1, 1], E[..., 1, 2]))
    x[..., 4] = np.arctan2(-E[..., 2, 0], E[..., 0, 0])
    x[..., 5] = poses.a
    x[..., 8] = np.arctan2(F[..., 0, 2], F[..., 0, 0])
    x[..., 9] = np.arctan2(-F[..., 0, 1], np.hypot(F[..., 0, 0], F[..., 0, 2]))
    x[..., 10] = np.arctan2(F[..., 2, 1], F[..., 1, 1])
    x[..., 11] = poses.b
    return PassiveAngles(x, np.cos(x[..., [1, 3, 7, 9]]).min(axis=-1))


def printed_ball_joint(mechanism: PointingMechanism, poses: Poses) -> Array:
    """Angles ``x3, x4, x5`` of the ball joint of leg Y in the printed order y-x-y, shape (..., 3); 0 + x5 if locked."""
    _, _, E, _ = _rotations(mechanism, poses)
    x4 = np.arctan2(np.hypot(E[..., 0, 1], E[..., 2, 1]), E[..., 1, 1])
    locked = np.hypot(E[..., 0, 1], E[..., 2, 1]) < 1e-15
    x3 = np.where(locked, 0.0, np.arctan2(E[..., 1, 0], -E[..., 1, 2]))
    x5 = np.where(locked, np.arctan2(E[..., 0, 2], E[..., 0, 0]), np.arctan2(E[..., 0, 1], E[..., 2, 1]))
    return np.stack([x3, np.where(locked, 0.0, x4), x5], -1)
