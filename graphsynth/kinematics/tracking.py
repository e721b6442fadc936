"""Branch-safe continuation of the platform pose: many machines over the same wheel angles, in compiled code.

A step is accepted only if the corrector moves little, converges at a quadratic rate and keeps the sign of ``det JX``;
otherwise it is halved.  A step that becomes too small ends the branch with its place and reason, never with a jump.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["BranchEnd", "Tracked", "track"]

Array = NDArray[np.float64]


class BranchEnd(IntEnum):
    """How the continuation of a branch ended."""

    COMPLETE = 0
    NO_HOME = 1  #: the guess is not close to an assembled pose at zero crank length
    HOME_ENDS = 2  #: the home branch ends while the cranks grow to their length
    DRIVE_ENDS = 3  #: a drive locks or reaches a change point
    SINGULAR = 4  #: det JX = 0: two assembly modes merge
    NO_START = 5  #: the guess is not close to an assembled pose at the first wheel angle


class Tracked(NamedTuple):
    """Branches of N machines over n wheel angles; rows from ``reached`` on are NaN.

    ``pose``, ``velocity``, ``theta``, ``theta1`` (N, n, 3), ``determinant`` (N, n); ``theta2`` and ``acceleration``
    (N, n, 3), or (N, 0, 3) if not wanted; ``status`` (N,) of `BranchEnd`; ``reached`` (N,); ``end`` (N, 4): parameter
    and pose at the end.
    """

    pose: Array
    velocity: Array
    theta: Array
    theta1: Array
    determinant: Array
    theta2: Array
    acceleration: Array
    status: NDArray[np.int64]
    reached: NDArray[np.int64]
    end: Array


def track(
    machines: Array, psi: Array, stops: Array, guess: Array, Lc: float, *, grown: bool, accelerations: bool
) -> Tracked:
    """Follow one branch of each machine (N, 3, 21) through increasing wheel angles (n,).

    ``guess`` (N, 3) is near the branch at psi[0]; with ``grown`` it is near the home pose at zero crank length and the
    cranks grow first.  Angles from ``stops`` (N,) on are not entered.  Estimated, not certified: the criteria make a jump
    unlikely, they do not exclude it; compare with all assembly modes afterwards.
    """
    from graphsynth.kinematics.kernels.turn import turns

    count, n = len(machines), len(psi)
    shape, second = (count, n, 3), (count, n if accelerations else 0, 3)
    pose, velocity, theta, theta1 = np.empty(shape), np.empty(shape), np.empty(shape), np.empty(shape)
    theta2, acceleration, determinant = np.empty(second), np.empty(second), np.empty(shape[:2])
    status, reached, end = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64), np.empty((count, 4))
    given = (np.require(a, dtype=np.float64, requirements=["C", "W"]) for a in (machines, psi, stops, guess))
    turns(*given, grown, Lc, theta, theta1, pose, velocity, determinant, theta2, acceleration, status, reached, end)
    for i in np.flatnonzero(reached < n):
        for array in (pose, velocity, theta, theta1, determinant, theta2, acceleration):
            array[i, reached[i] :] = np.nan
    return Tracked(pose, velocity, theta, theta1, determinant, theta2, acceleration, status, reached, end)
