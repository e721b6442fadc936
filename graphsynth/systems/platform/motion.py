"""Motion of a mechanism over its input: arrays, events, closure of the turn, branch label."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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
    """Branch identity: drive branches, working mode, sign of det JX, rank of alpha, continuation id.

    See theory/platform-drive 6.
    """

    tau: tuple[int, int, int]
    sigma: tuple[int, int, int]
    sign: int
    rank: int
    continuation: int


@dataclass(frozen=True, eq=False)
class Monodromy:
    """What the assembly modes become after one turn of the wheels.

    * `modes` (shape (m, 3)): poses at the start, sorted by alpha.
    * `permutation`: number of the mode that each mode has become; -1 where its branch ends.
    * `ends`: wheel angle at which a branch ends, radians; NaN where it does not.
    * `reasons`: why a branch ends; empty where it does not.
    """

    modes: Array
    permutation: tuple[int, ...]
    ends: tuple[float, ...]
    reasons: tuple[str, ...]

    @property
    def periods(self) -> tuple[int, ...]:
        """Number of turns after which each mode returns to itself; 0 if it never does because a branch ends."""
        return tuple(self._period(mode) for mode in range(len(self.permutation)))

    def _period(self, mode: int) -> int:
        at = mode
        for turns in range(1, len(self.permutation) + 1):
            at = self.permutation[at]
            if at < 0:
                return 0
            if at == mode:
                return turns
        return 0


@dataclass(frozen=True, eq=False)
class Sweep:
    """One branch over many wheel angles, positions and derivatives only.

    * `psi` (shape (n,)): wheel angles asked for, radians.
    * `pose`, `velocity` (shape (n, 3)): ``(x, y, alpha)`` and d/dpsi; NaN from ``reached`` on.
    * `theta`, `theta_velocity` (shape (n, 3)): rocker angles, continuous along the motion, and d/dpsi.
    * `determinant` (shape (n,)): ``det JX``.
    * `acceleration`, `theta_acceleration` (shape (n, 3)): second derivatives by psi, if asked for.
    * `reached`: number of wheel angles reached on the branch.
    * `complete`: all of them were.
    * `end`: wheel angle and pose at which the branch ended.
    * `reason`: why it ended early; empty if it is complete.
    """

    psi: Array
    pose: Array
    velocity: Array
    theta: Array
    theta_velocity: Array
    determinant: Array
    acceleration: Array | None
    theta_acceleration: Array | None
    reached: int
    complete: bool
    end: tuple[float, ...]
    reason: str


@dataclass(frozen=True, eq=False)
class TurnBatch:
    """Home branches of N dimension sets over the same n wheel angles.

    * `psi` (shape (n,)): wheel angles, radians.
    * `pose`, `velocity`, `theta`, `theta_velocity` (shape (N, n, 3)): as in `Sweep`; NaN from ``reached`` on.
    * `determinant` (shape (N, n)): ``det JX``.
    * `acceleration`, `theta_acceleration` (shape (N, n, 3)): second derivatives by psi, if asked for.
    * `status` (shape (N,)): ``graphsynth.systems.platform.tracking.BranchEnd``: how each branch ended.
    * `reached` (shape (N,)): number of wheel angles reached.
    * `end` (shape (N, 4)): wheel angle (for HOME_ENDS the scale of the cranks) and pose where the branch ended.
    * `closure_error` (shape (N,)): scaled distance of the last pose from the first; NaN if not complete.
    """

    psi: Array
    pose: Array
    velocity: Array
    theta: Array
    theta_velocity: Array
    determinant: Array
    acceleration: Array | None
    theta_acceleration: Array | None
    status: NDArray[np.int8]
    reached: NDArray[np.int64]
    end: Array
    closure_error: Array

    @property
    def complete(self) -> NDArray[np.bool_]:
        """True for the sets that reached every wheel angle, shape (N,)."""
        return np.asarray(self.status == 0)


@dataclass(frozen=True, eq=False)
class Motion:
    """One tracked branch over the wheel angle.

    * `psi` (shape (n,)): wheel angles that were reached, radians; fewer than asked for if the motion stops.
    * `pose`, `velocity`, `acceleration` (shape (n, 3)): ``(x, y, alpha)`` and its first and second derivatives with
      respect to psi.
    * `theta` (shape (n, 3)): rocker angles, continuous along the motion.
    * `determinant` (shape (n,)): ``det JX``.
    * `leg` (shape (n, 3)): ``JT_kk = sigma_k S_k`` of the legs.
    * `drive` (shape (n, 3)): ``h_phi = tau_k S_B,k`` of the drives.
    * `gap` (shape (n,)): scaled distance to the nearest other assembly mode; infinite if there is none.
    * `residual`: largest closure error over the turn relative to the square of the largest length.
    * `complete`: the whole asked range was reached on one branch.
    * `closed`: after ``period`` turns the pose returns to the start.
    * `closure_error`: scaled distance of the end pose from the start pose after one turn; NaN if the turn is not
      complete.
    * `period`: number of turns until closure; 0 if not closed.
    * `events`: in order of psi.
    * `label`: of the start pose.
    * `Lc`: characteristic length of the scaled distances.
    * `method`: how the branch was followed.
    * `seconds`: run time.
    * `monodromy`: what all assembly modes become after the turn; None if the range is not one turn or the branch ends.
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
    monodromy: Monodromy | None = None

    @property
    def working_mode_constant(self) -> bool:
        """True if no leg crosses its boundary at the sampled angles."""
        return bool(np.all(np.sign(self.leg) == np.sign(self.leg[0])))

    def stop_reason(self) -> str:
        """Why the motion ended early; empty if it is complete."""
        return next((event.statement for event in self.events if event.ends_motion), "")
