"""Branch-safe continuation of the platform pose: velocity predictor, Newton corrector, step control.

A step is accepted only if the corrector moves little, converges at a quadratic rate and keeps the sign of ``det JX``;
otherwise it is halved.  A step that becomes too small is an event, never a jump.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.parallel_platform import ParallelPlatform

__all__ = ["Tracked", "correct", "track"]

Array = NDArray[np.float64]

#: parameter -> (theta, d theta / d parameter), NaN where a drive cannot be assembled
Input = Callable[[float], tuple[Array, Array]]

_SMALLEST = 1e-11  # relative to the length of the whole range


class Tracked(NamedTuple):
    """Poses at the parameters reached; the parameter at which tracking failed (None if it did not); the last pose."""

    parameter: Array
    pose: Array
    failed_at: float | None
    last: Array


class Corrected(NamedTuple):
    """Result of the corrector: pose, scaled first correction, rate of convergence, determinant."""

    pose: Array
    first: float
    rate: float
    determinant: float


def correct(platform: ParallelPlatform, pose: Array, theta: Array, Lc: float) -> Corrected | None:
    """Newton iteration on the closure from ``pose``; None if it fails to converge."""
    weight = np.array([1.0, 1.0, Lc])
    sizes: list[float] = []
    for _ in range(8):
        JX, _ = platform.jacobians(pose, theta)
        determinant = float(np.linalg.det(JX))
        if determinant == 0.0 or not np.isfinite(determinant):
            return None
        step = np.linalg.solve(JX, -platform.closure(pose, theta))
        sizes.append(float(np.linalg.norm(step * weight)) / Lc)
        pose = pose + step
        if sizes[-1] <= 1e-15 or (len(sizes) > 1 and sizes[-1] <= 1e-11 and sizes[-1] <= 1e-3 * sizes[-2]):
            rate = sizes[1] / sizes[0] if len(sizes) > 1 and sizes[0] > 1e-13 else 0.0
            return Corrected(pose, sizes[0], rate, determinant)
        if len(sizes) > 1 and sizes[-1] > 1e-13 and sizes[-1] >= 0.5 * sizes[-2]:
            return None
    return Corrected(pose, sizes[0], sizes[1] / max(sizes[0], 1e-300), determinant) if sizes[-1] <= 1e-12 else None


def _velocity(platform: ParallelPlatform, pose: Array, theta: Array, rate: Array) -> tuple[Array, float]:
    JX, JT = platform.jacobians(pose, theta)
    return np.asarray(np.linalg.solve(JX, -JT * rate)), float(np.linalg.det(JX))


def track(platform: ParallelPlatform, drive: Input, start: Array, parameters: Array, Lc: float) -> Tracked:
    """Follow the pose ``start`` (valid at ``parameters[0]``) through increasing ``parameters``.

    Estimated, not certified: the criteria make a jump unlikely, they do not exclude it; callers compare with all
    assembly modes afterwards.
    """
    total = float(parameters[-1] - parameters[0]) or 1.0
    poses, pose, here = [start], start, float(parameters[0])
    step = total
    for target in parameters[1:]:
        while here < target:
            trial = min(step, float(target) - here)
            goal = float(target) if trial >= float(target) - here else here + trial
            moved = _advance(platform, drive, pose, here, goal, Lc)
            if moved is None:
                step = 0.5 * (goal - here)
                if step < _SMALLEST * total:
                    return Tracked(parameters[: len(poses)], np.array(poses), here, pose)
                continue
            pose, here, step = moved, goal, max(step, 2.0 * trial) if trial < step else 2.0 * step
            step = min(step, total / 16.0)
        poses.append(pose)
    return Tracked(parameters, np.array(poses), None, pose)


def _advance(
    platform: ParallelPlatform, drive: Input, pose: Array, here: float, goal: float, Lc: float
) -> Array | None:
    theta, rate = drive(here)
    velocity, before = _velocity(platform, pose, theta, rate)
    after_theta, _ = drive(goal)
    if not (np.isfinite(velocity).all() and np.isfinite(after_theta).all()):
        return None
    advance = velocity * (goal - here)
    result = correct(platform, pose + advance, after_theta, Lc)
    if result is None:
        return None
    travelled = float(np.linalg.norm(advance * np.array([1.0, 1.0, Lc]))) / Lc
    small = result.first <= 0.1 * travelled + 1e-9 and travelled <= 0.1
    regular = before * result.determinant > 0.0 and abs(result.determinant) > 0.5 * abs(before)
    return result.pose if small and regular and result.rate <= 0.1 else None
