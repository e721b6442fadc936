"""A platform whose modes change places, and its modes joined by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def cusped_platform() -> Any:
    """Platform two of whose modes change places in a turn, without a singularity."""
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

    twelfth, pivot = math.pi / 6, (-0.5 + 1.5j, -0.6 + 0.4j, 1.4 - 0.2j)
    a, b, c = pivot
    return SingleMotorPlatform(
        crank=(0.8, 1, 1),
        phase=(11 * twelfth, 2 * twelfth, 0.0),
        coupler=(1.5,) * 3,
        rocker=(1.5,) * 3,
        axis=(a + 1.5, b + 1.5, c + 1.5),
        pivot=pivot,
        vertex=(1 - 0.8j, 0.8 - 1.7j, 0.4 + 1j),
        l1=(0.5, 0.7, 0.9),
        l2=(1.8, 2.3, 1.9),
        delta=(6 * twelfth, 11 * twelfth, twelfth),
        frame_angle=(0, 0, 0),
    )


def joined_to_the_nearest(batch: Any) -> tuple[int, ...]:
    """Permutation of the modes after a turn, each joined to the nearest of the next angle."""
    sets = np.split(batch.poses, np.cumsum(batch.counts)[:-1])
    at = sets[0]
    for poses in sets[1:]:
        apart = at[:, None] - poses[None]
        apart[..., 2] = np.angle(np.exp(1j * apart[..., 2]))
        at = poses[np.linalg.norm(apart, axis=-1).argmin(axis=1)]
    return tuple(int(np.abs(sets[0][:, :2] - pose[:2]).sum(axis=1).argmin()) for pose in at)
