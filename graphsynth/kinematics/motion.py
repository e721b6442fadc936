"""Motion of a mechanism over its input: arrays, events, closure of the turn, branch label."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["BranchLabel", "Event", "Motion"]

Array = NDArray[np.float64]


class Event(NamedTuple):
    """Something that happens at one input angle.

    ``kind`` is "drive lock", "change point", "rocker dead point", "platform singular", "leg boundary" or
    "mode mismatch"; ``psi`` in radians; ``leg`` is 1 to 3, or 0 for the platform; ``ends_motion`` tells whether the
    motion stops there; ``pose`` is the last pose reached before a platform singularity.
    """

    kind: str
    psi: float
    leg: int
    ends_motion: bool
    statement: str
    pose: tuple[float, float, float] | None = None


class BranchLabel(NamedTuple):
    """Branch identity (section 7.5): drive branches, working mode, sign of det JX, rank of alpha, continuation id."""

    tau: tuple[int, int, int]
    sigma: tuple[int, int, int]
    sign: int
    rank: int
    continuation: int


@dataclass(frozen=True, eq=False)
class Motion:
    """One tracked branch over the wheel angle.

    Attributes
    ----------
    psi : ndarray, shape (n,)
        Wheel angles that were reached, radians; fewer than asked for if the motion stops.
    pose, velocity, acceleration : ndarray, shape (n, 3)
        ``(x, y, alpha)`` and its first and second derivatives with respect to psi.
    theta : ndarray, shape (n, 3)
        Rocker angles, continuous along the motion.
    determinant : ndarray, shape (n,)
        ``det JX``.
    leg : ndarray, shape (n, 3)
        ``JT_kk = sigma_k S_k`` of the legs.
    drive : ndarray, shape (n, 3)
        ``h_phi = tau_k S_B,k`` of the drives.
    gap : ndarray, shape (n,)
        Scaled distance to the nearest other assembly mode; infinite if there is none.
    residual : float
        Largest closure error over the turn relative to the square of the largest length.
    complete : bool
        The whole asked range was reached on one branch.
    closed : bool
        After ``period`` turns the pose returns to the start.
    closure_error : float
        Scaled distance of the end pose from the start pose after one turn; NaN if the turn is not complete.
    period : int
        Number of turns until closure; 0 if not closed.
    events : tuple of Event
        In order of psi.
    label : BranchLabel
        Of the start pose.
    Lc : float
        Characteristic length of the scaled distances.
    method : str
        How the branch was followed.
    seconds : float
        Run time.
    """

    psi: Array
    pose: Array
    velocity: Array
    acceleration: Array
    theta: Array
    determinant: Array
    leg: Array
    drive: Array
    gap: Array
    residual: float
    complete: bool
    closed: bool
    closure_error: float
    period: int
    events: tuple[Event, ...]
    label: BranchLabel
    Lc: float
    method: str
    seconds: float

    @property
    def working_mode_constant(self) -> bool:
        """True if no leg crosses its boundary at the sampled angles."""
        return bool(np.all(np.sign(self.leg) == np.sign(self.leg[0])))

    def stop_reason(self) -> str:
        """Why the motion ended early; empty if it is complete."""
        return next((event.statement for event in self.events if event.ends_motion), "")
