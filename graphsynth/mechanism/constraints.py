"""Constraint equations of the joints of a mechanism in link poses, and their Jacobian.

The unknowns are the poses ``(x, y, theta)`` of all links, three columns per link in link order; every joint gives
``3 - mobility`` rows.  These are the equations as stated by the joints, without any elimination: the reference against
which solved poses are substituted, and the matrix whose rank is the mobility.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.joints import Cam, Gear, JointGeometry, Prismatic, Revolute

__all__ = ["jacobian", "residual"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def _place(pose: Array, link: int, local: tuple[float, float]) -> tuple[Complex, Complex]:
    """World point and the arm from the link's origin to it, as complex numbers."""
    arm = np.exp(1j * pose[..., link, 2]) * complex(*local)
    return pose[..., link, 0] + 1j * pose[..., link, 1] + arm, arm


def _read(joints: Iterable[JointGeometry], poses: ArrayLike) -> tuple[list[JointGeometry], Array]:
    """Return joints and poses that fit each other."""
    try:
        found = list(joints)
        most = max((max(joint.a, joint.b) for joint in found), default=0)
    except (TypeError, AttributeError) as error:
        raise GeometryError(f"joints = {str(joints)[:60]} is no list of joints ({error}); give one") from error
    try:
        pose = np.asarray(poses, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise GeometryError(
            f"poses hold something that is no number ({error}); give x, y and angle of each link"
        ) from error
    if pose.ndim < 2 or pose.shape[-1] != 3 or pose.shape[-2] <= most:
        raise GeometryError(f"poses of shape {pose.shape} do not fit joints of links 0 to {most}; give (..., links, 3)")
    return found, pose


def residual(joints: Sequence[JointGeometry], poses: ArrayLike) -> Array:
    """Constraint violations at ``poses`` (..., links, 3), shape (..., rows), in lengths.

    Angular equations are the sine of the angle error times the longest arm of the two links at that joint (at least the
    distance of the joint's points from the origins; 1 if both vanish).  A gear pair counts modulo a tooth-independent
    full turn of wheel b.

    Examples
    --------
    >>> residual([Revolute(0, 1, at_a=(1.0, 0.0))], [[0, 0, 0], [1, 2, 0.3]]).tolist()
    [0.0, 2.0]
    """
    joints, pose = _read(joints, poses)
    rows: list[Array] = []
    for joint in joints:
        d = _place(pose, joint.b, joint.at_b)[0] - _place(pose, joint.a, joint.at_a)[0]
        if isinstance(joint, Revolute):
            rows += [d.real, d.imag]
        elif isinstance(joint, Gear):
            rows.append(_gear(joint, pose, d))
        elif isinstance(joint, Cam):
            rows.append(np.abs(d) - _pitch(joint, pose, d)[0])
        else:
            direction = np.exp(1j * (pose[..., joint.a, 2] + joint.angle_a))
            rows.append((np.conj(direction) * d).imag)
            if isinstance(joint, Prismatic):
                turn = pose[..., joint.b, 2] + joint.angle_b - pose[..., joint.a, 2] - joint.angle_a
                size = max(abs(complex(*joint.at_a)), abs(complex(*joint.at_b))) or 1.0
                rows.append(2.0 * size * np.sin(0.5 * turn) * np.sign(np.cos(0.5 * turn)))
    return np.stack(rows, axis=-1) if rows else np.zeros((*pose.shape[:-2], 0))


def _gear(joint: Gear, pose: Array, d: Complex) -> Array:
    sign = -1.0 if joint.internal else 1.0
    phi = np.angle(d)
    value = joint.radius_a * (pose[..., joint.a, 2] - phi)
    value = value + sign * joint.radius_b * (pose[..., joint.b, 2] - phi - joint.offset)
    # phi is known modulo a turn only, which moves the value by multiples of tau (radius_a + sign radius_b)
    period = (2.0 * np.pi) * abs(joint.radius_a + sign * joint.radius_b)
    return np.asarray(value - period * np.round(value / period))


def _pitch(joint: Cam, pose: Array, d: Complex) -> tuple[Array, Array]:
    """Radius of the pitch curve in the direction of d, and its derivative by the direction."""
    psi = np.angle(d) - pose[..., joint.a, 2] - joint.angle_a
    value, first = np.full(psi.shape, joint.radius), np.zeros(psi.shape)
    for k, (c, s) in enumerate(joint.harmonics, 1):
        value += c * np.cos(k * psi) + s * np.sin(k * psi)
        first += k * (s * np.cos(k * psi) - c * np.sin(k * psi))
    return value, first


def jacobian(joints: Sequence[JointGeometry], poses: ArrayLike) -> Array:
    """Return the derivatives of the constraints by the poses, shape (..., rows, 3 links).

    Angular rows (sliding pairs) are those of the plain angle equation, in radians.
    """
    joints, pose = _read(joints, poses)
    count = sum(3 - joint.mobility for joint in joints)
    J = np.zeros((*pose.shape[:-2], count, 3 * pose.shape[-2]))
    row = 0
    for joint in joints:
        a, b = 3 * joint.a, 3 * joint.b
        P, arm_a = _place(pose, joint.a, joint.at_a)
        Q, arm_b = _place(pose, joint.b, joint.at_b)
        d = Q - P
        if isinstance(joint, Revolute):
            for axis in (0, 1):
                J[..., row + axis, a + axis], J[..., row + axis, b + axis] = -1.0, 1.0
            J[..., row, a + 2], J[..., row, b + 2] = arm_a.imag, -arm_b.imag
            J[..., row + 1, a + 2], J[..., row + 1, b + 2] = -arm_a.real, arm_b.real
            row += 2
        elif isinstance(joint, Gear):
            sign = -1.0 if joint.internal else 1.0
            total = joint.radius_a + sign * joint.radius_b
            normal = 1j * d / np.abs(d) ** 2  # gradient of phi by the position of Q
            for column, weight, arm in ((a, -1.0, arm_a), (b, 1.0, arm_b)):
                J[..., row, column] = -total * weight * normal.real
                J[..., row, column + 1] = -total * weight * normal.imag
                J[..., row, column + 2] = -total * weight * (np.conj(normal) * 1j * arm).real
            J[..., row, a + 2] += joint.radius_a
            J[..., row, b + 2] += sign * joint.radius_b
            row += 1
        elif isinstance(joint, Cam):
            first = _pitch(joint, pose, d)[1]
            normal = d / np.abs(d) - first * 1j * d / np.abs(d) ** 2  # gradient by the position of Q
            for column, weight, arm in ((a, -1.0, arm_a), (b, 1.0, arm_b)):
                J[..., row, column], J[..., row, column + 1] = weight * normal.real, weight * normal.imag
                J[..., row, column + 2] = weight * (np.conj(normal) * 1j * arm).real
            J[..., row, a + 2] += first
            row += 1
        else:
            t = np.exp(1j * (pose[..., joint.a, 2] + joint.angle_a))
            n = 1j * t
            J[..., row, a], J[..., row, a + 1] = -n.real, -n.imag
            J[..., row, a + 2] = -(np.conj(t) * d).real - (np.conj(n) * 1j * arm_a).real
            J[..., row, b], J[..., row, b + 1] = n.real, n.imag
            J[..., row, b + 2] = (np.conj(n) * 1j * arm_b).real
            row += 1
            if isinstance(joint, Prismatic):
                J[..., row, a + 2], J[..., row, b + 2] = -1.0, 1.0
                row += 1
    return J
