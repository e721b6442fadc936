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
from graphsynth.mechanism.equations import Floats, Seen, derivatives, seen
from graphsynth.mechanism.joints import JointGeometry

Array = NDArray[np.float64]


def _seen(joint: JointGeometry, pose: Array) -> Seen:
    a, b = ((pose[..., link, 0], pose[..., link, 1], pose[..., link, 2]) for link in (joint.a, joint.b))
    return seen(Floats(), joint, a, b)


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
    >>> from graphsynth.mechanism.joints import Revolute
    >>> residual([Revolute(0, 1, at_a=(1.0, 0.0))], [[0, 0, 0], [1, 2, 0.3]]).tolist()
    [0.0, 2.0]
    """
    joints, pose = _read(joints, poses)
    rows: list[Array] = []
    for joint in joints:
        for value, turns in zip(joint.values(_seen(joint, pose)), joint.turns()):
            if len(turns) == 1:
                size = max(abs(complex(*joint.at_a)), abs(complex(*joint.at_b))) or 1.0
                rows.append(2.0 * size * np.sin(0.5 * value) * np.sign(np.cos(0.5 * value)))
            elif turns:
                period = 2.0 * np.pi * abs(sum(turns))
                rows.append(np.asarray(value - period * np.round(value / period)))
            else:
                rows.append(value)
    return np.stack(rows, axis=-1) if rows else np.zeros((*pose.shape[:-2], 0))


def jacobian(joints: Sequence[JointGeometry], poses: ArrayLike) -> Array:
    """Return the derivatives of the constraints by the poses, shape (..., rows, 3 links).

    Angular rows (sliding pairs) are those of the plain angle equation, in radians.
    """
    joints, pose = _read(joints, poses)
    count = sum(3 - joint.mobility for joint in joints)
    J = np.zeros((*pose.shape[:-2], count, 3 * pose.shape[-2]))
    row = 0
    for joint in joints:
        at = _seen(joint, pose)
        for by_a, by_b in derivatives(at, joint.gradients(at)):
            for link, entries in ((joint.a, by_a), (joint.b, by_b)):
                for axis, entry in enumerate(entries):
                    if entry is not None:
                        J[..., row, 3 * link + axis] = entry
            row += 1
    return J
