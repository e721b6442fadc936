"""Whether a mechanism passes through poses: its simulation from each pose to the next, and the miss."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.engine.result import Motion
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]
#: Samples between two poses; the largest error of a pose that is reached, over the size of the linkage.
STEPS, REACHED = 24, 1e-7


def passed(
    start: Callable[[int], Mechanism], inputs: Array, order: NDArray[Any], poses: Array, body: int, arm: float
) -> tuple[Motion, float]:
    """Move a mechanism through poses and measure by how much its body misses them.

    Parameters
    ----------
    start : callable
        Gives the mechanism in the pose of a number.
    inputs : ndarray
        Coordinate of the driver at all poses.
    order : ndarray of int
        Numbers of the poses in the order of the motion; without some of them the miss is infinite.
    poses : ndarray, shape (n, 3)
    body : int
        Number of the link.
    arm : float
        What angles are multiplied with.

    Returns
    -------
    (Motion, float)
        `STEPS` samples from each pose to the next; the largest sum of distance and turn times the arm, infinite where
        a pose is not reached.
    """
    grid = [np.linspace(a, b, STEPS + 1)[:-1] for a, b in pairwise(inputs[order])]
    motion = start(int(order[0])).simulate(np.concatenate([*grid, inputs[order[-1:]]]), events=False)
    away = motion.poses[::STEPS, body] - poses[order]
    turn = np.abs((away[:, 2] + np.pi) % (2.0 * np.pi) - np.pi) * arm
    miss = float(np.max(np.hypot(away[:, 0], away[:, 1]) + turn))
    return motion, miss if len(order) == len(poses) and math.isfinite(miss) else math.inf
