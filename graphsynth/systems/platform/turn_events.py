"""Events of the single-motor platform over the wheel angle, and the wheel angles asked for."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.motion import Event
from graphsynth.systems.platform.tracking import SINGULAR, BranchEnd, Tracked

if TYPE_CHECKING:
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

__all__ = ["events", "wheel_angles"]

Array = NDArray[np.float64]


def wheel_angles(samples: int | ArrayLike) -> Array:
    """Return increasing wheel angles (radians): those given, or so many over one turn.

    Raises
    ------
    GeometryError
        Fewer than two samples, angles that are not finite or do not increase.
    """
    if isinstance(samples, int | np.integer):
        if samples < 2:
            raise GeometryError(f"samples = {samples} is too few for a turn; give 2 or more, or an array of angles")
        return np.linspace(0.0, math.tau, int(samples))
    psi = finite_array("samples", samples).ravel()
    if psi.size < 2 or bool(np.any(np.diff(psi) <= 0.0)):
        raise GeometryError("samples must hold two or more increasing wheel angles")
    return psi


def events(
    machine: SingleMotorPlatform, psi: Array, tracked: Tracked, barrier: Event | None, leg: Array,
    mismatch: NDArray[np.bool_],
) -> list[Event]:  # fmt: skip
    """Events of one tracked branch in order: its end, dead points, boundaries of the legs, modes not found.

    Parameters
    ----------
    machine : SingleMotorPlatform
    psi : ndarray, shape (n,)
        Wheel angles asked for, radians.
    tracked : Tracked
        One branch.
    barrier : Event, optional
        First end of a drive in the range.
    leg : ndarray, shape (reached, 3)
        ``JT_kk`` at the samples reached.
    mismatch : ndarray of bool, shape (reached,)
        Samples whose pose is not among the computed assembly modes.
    """
    found: list[Event] = []
    end, status = float(psi[-1]), BranchEnd(int(tracked.status[0]))
    if status is BranchEnd.SINGULAR:
        end, x, y, alpha = (float(value) for value in tracked.end[0])
        found.append(Event("platform singular", end, 0, True, SINGULAR, (x, y, alpha)))
    elif barrier is not None:
        end = barrier.psi
        found.append(barrier)
    for number, drive in enumerate(machine.drives, start=1):
        text = f"crank and coupler {number} in line: the rocker reverses"
        for angle in drive.dead_points():
            turns = range(math.ceil((float(psi[0]) - angle) / math.tau), math.floor((end - angle) / math.tau) + 1)
            found += [Event("rocker dead point", angle + turn * math.tau, number, False, text) for turn in turns]
    for index, k in zip(*np.nonzero(np.sign(leg[1:]) != np.sign(leg[:-1]))):
        text = f"leg {k + 1} passes its boundary: the working mode changes"
        at = _crossing(machine, psi[index : index + 2], tracked.pose[0, index], int(k))
        found.append(Event("leg boundary", at, int(k) + 1, False, text))
    text = "the tracked pose is not one of the computed assembly modes"
    found += [Event("mode mismatch", float(psi[k]), 0, False, text) for k in np.flatnonzero(mismatch)]
    return sorted(found, key=lambda event: (event.psi, event.ends_motion))


def _crossing(machine: SingleMotorPlatform, psi: Array, pose: Array, leg: int) -> float:
    """Wheel angle at which ``JT`` of a leg vanishes between two samples, by refinement of the sampling."""
    low, high = float(psi[0]), float(psi[1])
    for _ in range(4):
        fine = machine.follow(np.linspace(low, high, 33), pose, np.inf, accelerations=False)
        values = machine.platform.jacobians(fine.pose[0], fine.theta[0])[1][:, leg]
        change = int(np.argmax(np.sign(values[1:]) != np.sign(values[:-1])))
        low, high = low + (high - low) * change / 32.0, low + (high - low) * (change + 1) / 32.0
        pose = fine.pose[0, change]
    return low + (high - low) * float(values[change] / (values[change] - values[change + 1]))
