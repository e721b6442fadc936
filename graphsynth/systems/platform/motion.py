"""Motion of the platform over the wheel angle: branches followed without jumps, events, closure, labels.

A step is accepted only if the corrector moves little, converges at a quadratic rate and keeps the sign of ``det JX``;
otherwise it is halved.  A step that becomes too small ends the branch with its place and reason, never with a jump.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.drive import Event, FourBarDrive

if TYPE_CHECKING:
    from graphsynth.systems.platform.parallel_platform import ParallelPlatform

Array = NDArray[np.float64]

SAME = 1e-6  # scaled distance below which two poses are the same mode
SINGULAR = "det JX = 0: two assembly modes merge at this pose; the branch ends here"


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
        found = []
        for mode, at in enumerate(self.permutation):
            turns = 1
            while 0 <= at != mode and turns < len(self.permutation):
                at, turns = self.permutation[at], turns + 1
            found.append(turns if at == mode else 0)
        return tuple(found)


@dataclass(frozen=True, eq=False)
class _Followed:
    """What was followed over the wheel angle: n angles, and N dimension sets where there are many.

    * `psi` (shape (n,)): wheel angles, radians.
    * `pose`, `velocity` (shape (n, 3) or (N, n, 3)): ``(x, y, alpha)`` and d/dpsi; NaN from ``reached`` on.
    * `theta`, `theta_velocity` (shapes as above): rocker angles, continuous along the motion, and d/dpsi.
    * `determinant` (shape (n,) or (N, n)): ``det JX``.
    * `acceleration`, `theta_acceleration` (shapes as above): second derivatives by psi, if asked for.
    """

    psi: Array
    pose: Array
    velocity: Array
    theta: Array
    theta_velocity: Array
    determinant: Array
    acceleration: Array | None
    theta_acceleration: Array | None


@dataclass(frozen=True, eq=False)
class Sweep(_Followed):
    """One branch over many wheel angles, positions and derivatives only.

    * `reached`: number of wheel angles reached on the branch.
    * `complete`: all of them were.
    * `end`: wheel angle and pose at which the branch ended.
    * `reason`: why it ended early; empty if it is complete.
    """

    reached: int
    complete: bool
    end: tuple[float, ...]
    reason: str


@dataclass(frozen=True, eq=False)
class TurnBatch(_Followed):
    """Home branches of N dimension sets over the same n wheel angles.

    * `status` (shape (N,)): ``graphsynth.systems.platform.motion.BranchEnd``: how each branch ended.
    * `reached` (shape (N,)): number of wheel angles reached.
    * `end` (shape (N, 4)): wheel angle (for HOME_ENDS the scale of the cranks) and pose where the branch ended.
    * `closure_error` (shape (N,)): scaled distance of the last pose from the first; NaN if not complete.
    """

    status: NDArray[np.int8]
    reached: NDArray[np.int64]
    end: Array
    closure_error: Array

    @property
    def complete(self) -> NDArray[np.bool_]:
        """True for the sets that reached every wheel angle, shape (N,)."""
        return np.asarray(self.status == 0)


@dataclass(frozen=True, eq=False)
class TurnMotion(_Followed):
    """One tracked branch over the wheel angle, up to where it stops.

    * `leg` (shape (n, 3)): ``JT_kk = sigma_k S_k`` of the legs.
    * `drive` (shape (n, 3)): ``h_phi = tau_k S_B,k`` of the drives.
    * `gap` (shape (n,)): scaled distance to the nearest other assembly mode; infinite if there is none.
    * `residual`: largest closure error over the turn relative to the square of the largest length.
    * `complete`: the whole asked range was reached on one branch.
    * `closed`: after ``period`` turns the pose returns to the start; ``period`` is 0 if it does not.
    * `closure_error`: scaled distance of the end pose from the start pose after one turn; NaN if not complete.
    * `label`: of the start pose.
    * `Lc`: characteristic length of the scaled distances.
    * `monodromy`: what all assembly modes become after the turn; None if the range is not one turn or the branch ends.
    """

    acceleration: Array
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


def wheel_angles(samples: int | ArrayLike) -> Array:
    """Return increasing wheel angles (radians): those given, or so many over one turn.

    Raises `GeometryError`: fewer than two samples, angles that are not finite or do not increase.
    """
    if isinstance(samples, int | np.integer):
        if samples < 2:
            raise GeometryError(f"samples = {samples} is too few for a turn; give 2 or more, or an array of angles")
        return np.linspace(0.0, math.tau, int(samples))
    psi = finite_array("samples", samples).ravel()
    if psi.size < 2 or bool(np.any(np.diff(psi) <= 0.0)):
        raise GeometryError("samples must hold two or more increasing wheel angles")
    return psi


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


def followed(psi: Array, found: Tracked, key: Any) -> dict[str, Any]:
    """Arrays of `Sweep`, `TurnBatch` and `TurnMotion`: ``key`` takes the machine and the angles."""
    names = {"theta_velocity": "theta1", "theta_acceleration": "theta2"}
    arrays = {name: getattr(found, names.get(name, name)) for name in _Followed.__annotations__ if name != "psi"}
    second = found.theta2.shape[1] > 0
    return {"psi": psi} | {
        name: array[key] if second or not name.endswith("acceleration") else None for name, array in arrays.items()
    }


def track(
    machines: Array, psi: Array, stops: Array, guess: Array, Lc: float, *, grown: bool, accelerations: bool
) -> Tracked:
    """Follow one branch of each machine (N, 3, 21) through increasing wheel angles (n,).

    ``guess`` (N, 3) is near the branch at psi[0]; with ``grown`` it is near the home pose at zero crank length and the
    cranks grow first.  Angles from ``stops`` (N,) on are not entered.  Estimated, not certified: the criteria make a
    jump unlikely, they do not exclude it; compare with all assembly modes afterwards.
    """
    from graphsynth.systems.platform.kernels import turns

    count, n = len(machines), len(psi)
    vectors, second = (count, n, 3), (count, n if accelerations else 0, 3)
    shapes = (vectors, vectors, vectors, vectors, vectors[:2], second, second)
    arrays: list[Any] = [*map(np.empty, shapes), *np.empty((2, count), dtype=np.int64), np.empty((count, 4))]
    found = Tracked(*arrays)
    given = (np.require(a, dtype=np.float64, requirements=["C", "W"]) for a in (machines, psi, stops, guess))
    turns(*given, grown, Lc, found)
    for i in np.flatnonzero(found.reached < n):
        for array in found[:7]:
            array[i, found.reached[i] :] = np.nan
    return found


def dimension_sets(crank: ArrayLike, phase: ArrayLike, coupler: ArrayLike) -> tuple[Array, Array, Array]:
    """Return three arrays (N, 3).  Raises `GeometryError` for shapes and sizes that do not fit together."""
    pairs = (("crank", crank), ("phase", phase), ("coupler", coupler))
    given = {name: np.atleast_2d(finite_array(name, values)) for name, values in pairs}
    l_B = given["crank"]
    for name, array in given.items():
        if array.ndim != 2 or array.shape[1] != 3 or len(array) not in (1, len(l_B)):
            raise GeometryError(f"{name} has shape {array.shape}; give ({len(l_B)}, 3), three per dimension set")
        least = float(array.min())
        if name != "phase" and (least < 0.0 or (name == "coupler" and least == 0.0)):
            raise GeometryError(f"{name} = {least} must be {'positive' if name == 'coupler' else 'zero or more'}")
    first, second, third = (np.broadcast_to(array, l_B.shape) for array in given.values())
    return first, second, third


def distance(poses: Array, pose: Array, Lc: float) -> Array:
    """``sqrt(dx^2 + dy^2 + Lc^2 dalpha^2) / Lc`` with the angle taken on the circle."""
    d = poses - pose
    turn = np.angle(np.exp(1j * d[..., 2]))
    return np.asarray(np.sqrt((d[..., 0] ** 2 + d[..., 1] ** 2) / Lc**2 + turn**2))


def compare(platform: ParallelPlatform, pose: Array, theta: Array, Lc: float) -> tuple[Array, int, NDArray[np.bool_]]:
    """Distance to the nearest other mode, rank of alpha at the start, and samples where no mode matches."""
    batch = platform.direct_batch(theta)
    apart = np.full((len(pose), max(6, int(batch.counts.max()))), np.inf)
    place = np.arange(len(batch.problem)) - np.repeat(np.cumsum(batch.counts) - batch.counts, batch.counts)
    apart[batch.problem, place] = distance(batch.poses, pose[batch.problem], Lc)
    rank = int(np.argmin(apart[0]))
    apart.sort(axis=1)
    return apart[:, 1], rank, apart[:, 0] > SAME


def events(
    drives: Sequence[FourBarDrive], start: float, end: float, crossings: list[tuple[float, int]], lost: Array
) -> list[Event]:
    """Events that do not end a branch between two wheel angles, without order: dead points, legs, modes not found.

    `crossings`: wheel angle and number of each leg that passes its boundary. `lost` (shape (m,)): wheel angles of the
    samples whose pose is not among the computed assembly modes.
    """
    found: list[Event] = []
    for number, drive in enumerate(drives, start=1):
        text = f"crank and coupler {number} in line: the rocker reverses"
        for angle in drive.dead_points():
            turns = range(math.ceil((start - angle) / math.tau), math.floor((end - angle) / math.tau) + 1)
            found += [Event("rocker dead centre", angle + turn * math.tau, number, False, text) for turn in turns]
    for at, number in crossings:
        text = f"leg {number} passes its boundary: the working mode changes"
        found.append(Event("leg boundary", at, number, False, text))
    text = "the tracked pose is not one of the computed assembly modes"
    return found + [Event("mode mismatch", angle, 0, False, text) for angle in lost.tolist()]
