"""Own search for the factor of joints that share a misalignment."""

from __future__ import annotations

import math

import numpy as np


def _joints(motion: object) -> list[tuple[float, float]]:
    """Positions of the joints but that of the driver, at the only sample."""
    poses, joints = motion.poses[0], motion.mechanism.joints  # type: ignore[attr-defined]
    places = []
    for joint in joints:
        if joint.pair == (0, 1):
            continue
        x, y, theta = poses[joint.a]
        u, v = joint.at_a
        places.append((x + math.cos(theta) * u - math.sin(theta) * v, y + math.sin(theta) * u + math.cos(theta) * v))
    return places


def _single_loop(motion: object, alpha: float, direction: float) -> float:
    """Largest ``|cross(a, p - O)| / sum |p - r_j|`` over the plane: own nested search, limits of one, no play."""
    joints = np.array(_joints(motion))
    a = alpha * np.array([math.cos(direction), math.sin(direction)])

    def quotient(p: np.ndarray) -> np.ndarray:
        lift = np.abs(a[0] * p[..., 1] - a[1] * p[..., 0])
        return np.asarray(lift / np.hypot(*np.moveaxis(p[..., None, :] - joints, -1, 0)).sum(axis=-1))

    best = alpha / len(joints)  # p at infinity
    best = max(best, *(float(q) for q in np.nan_to_num(quotient(joints + 0.0))))
    centre = joints.mean(axis=0)
    for side in (1.0, -1.0):
        low, size = centre, 8.0
        for _ in range(40):
            offsets = np.linspace(-size, size, 41)
            p = low + np.stack(np.meshgrid(offsets, offsets), axis=-1)
            signed = side * (a[0] * p[..., 1] - a[1] * p[..., 0])
            with np.errstate(invalid="ignore"):
                q = np.where(signed > 0.0, quotient(p), -1.0)
            best = max(best, float(q.max()))
            low = p[np.unravel_index(int(q.argmax()), q.shape)]
            size *= 0.6
    return best
