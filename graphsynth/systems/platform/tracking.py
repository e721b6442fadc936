"""Branch-safe continuation of the platform pose: many machines over the same wheel angles, in compiled code.

A step is accepted only if the corrector moves little, converges at a quadratic rate and keeps the sign of ``det JX``;
otherwise it is halved.  A step that becomes too small ends the branch with its place and reason, never with a jump.
"""

from __future__ import annotations

import math
from dataclasses import replace
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.triad.leg import length_constants
from graphsynth.systems.platform.drive import first_barrier
from graphsynth.systems.platform.motion import Event, Monodromy, TurnBatch

if TYPE_CHECKING:
    from graphsynth.systems.platform.parallel_platform import ParallelPlatform
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

Array = NDArray[np.float64]


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


def events(
    machine: SingleMotorPlatform,
    psi: Array,
    tracked: Tracked,
    barrier: Event | None,
    leg: Array,
    mismatch: NDArray[np.bool_],
) -> list[Event]:
    """Events of one tracked branch in order: its end, dead points, boundaries of the legs, modes not found.

    `psi` (shape (n,)): wheel angles asked for, radians. `tracked`: one branch. `barrier`: first end of a drive in the
    range. `leg` (shape (reached, 3)): ``JT_kk`` at the samples reached. `mismatch` (shape (reached,)): samples whose
    pose is not among the computed assembly modes.
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


SAME = 1e-6  # scaled distance below which two poses are the same mode
SINGULAR = "det JX = 0: two assembly modes merge at this pose; the branch ends here"


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
    cranks grow first.  Angles from ``stops`` (N,) on are not entered.  Estimated, not certified: the criteria make a
    jump unlikely, they do not exclude it; compare with all assembly modes afterwards.
    """
    from graphsynth.systems.platform.kernels.turn import turns

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


def machine_rows(mechanism: SingleMotorPlatform, bell: NDArray[np.complex128]) -> Array:
    """Return the row per leg that the kernel needs (see ``kernels.turn``); bell: ``exp(i (beta_k + delta_k))``."""
    constants, P = length_constants(np.array(mechanism.rocker), np.array(mechanism.coupler)), mechanism.platform
    rows = []
    for k, drive in enumerate(mechanism.drives):
        w, D, b = drive.axis - drive.pivot, P.D[k], P.b[k]
        fixed = (bell[k].real, bell[k].imag, mechanism.frame_angle[k] + mechanism.delta[k])
        rows.append(
            [
                w.real,
                w.imag,
                drive.crank,
                drive.phase,
                drive.rocker,
                drive.tau,
                *constants[k, :6],
                *fixed,
                D.real,
                D.imag,
                P.l1[k],
                b.real,
                b.imag,
                P.l2[k],
            ]
        )
    return np.array(rows)


def turn_batch(
    mechanism: SingleMotorPlatform,
    crank: ArrayLike,
    phase: ArrayLike | None,
    coupler: ArrayLike | None,
    psi: Array,
    *,
    accelerations: bool,
) -> TurnBatch:
    """See `SingleMotorPlatform.full_turn_batch`."""
    l_B, psi0, l_BC = _sets(mechanism, crank, phase, coupler)
    machines = np.repeat(mechanism._machine[None], len(l_B), axis=0)
    machines[:, :, 2], machines[:, :, 3] = l_B, psi0 - np.array(mechanism.frame_angle)
    if coupler is not None:
        machines[:, :, 6:12] = length_constants(np.broadcast_to(np.array(mechanism.rocker), l_BC.shape), l_BC)[..., :6]
    stops = _stops(mechanism, l_B, psi0, l_BC, psi)
    guess = np.repeat(np.array(mechanism.home)[None], len(l_B), axis=0)
    tracked = track(machines, psi, stops, guess, mechanism.Lc, grown=True, accelerations=accelerations)
    return TurnBatch(
        psi=psi,
        pose=tracked.pose,
        velocity=tracked.velocity,
        theta=tracked.theta,
        theta_velocity=tracked.theta1,
        determinant=tracked.determinant,
        acceleration=tracked.acceleration if accelerations else None,
        theta_acceleration=tracked.theta2 if accelerations else None,
        status=tracked.status.astype(np.int8),
        reached=tracked.reached,
        end=tracked.end,
        closure_error=np.asarray(distance(tracked.pose[:, -1], tracked.pose[:, 0], mechanism.Lc)),
    )


def _sets(
    mechanism: SingleMotorPlatform, crank: ArrayLike, phase: ArrayLike | None, coupler: ArrayLike | None
) -> tuple[Array, Array, Array]:
    l_B = np.atleast_2d(finite_array("crank", crank))
    given = {"crank": l_B}
    for name, values in (("phase", phase), ("coupler", coupler)):
        given[name] = np.atleast_2d(finite_array(name, getattr(mechanism, name) if values is None else values))
    for name, array in given.items():
        if array.ndim != 2 or array.shape[1] != 3 or len(array) not in (1, len(l_B)):
            raise GeometryError(f"{name} has shape {array.shape}; give ({len(l_B)}, 3), three per dimension set")
        least = float(array.min())
        if name != "phase" and (least < 0.0 or (name == "coupler" and least == 0.0)):
            raise GeometryError(f"{name} = {least} must be {'positive' if name == 'coupler' else 'zero or more'}")
    first, second, third = (np.broadcast_to(array, l_B.shape) for array in given.values())
    return first, second, third


def _stops(mechanism: SingleMotorPlatform, l_B: Array, psi0: Array, l_BC: Array, psi: Array) -> Array:
    """First wheel angle that each set cannot pass: infinite where all its cranks turn fully."""
    distance, l_CD = np.abs(np.array(mechanism.axis) - np.array(mechanism.pivot)), np.array(mechanism.rocker)
    slack = 1e-12 * (l_CD + l_BC + l_B)
    free = (distance + l_B < l_CD + l_BC - slack) & (np.abs(distance - l_B) > np.abs(l_CD - l_BC) + slack)
    stops = np.full(len(l_B), np.inf)
    for i in np.flatnonzero(~free.all(axis=1)):  # decided exactly, one by one
        one = replace(mechanism, crank=tuple(l_B[i]), phase=tuple(psi0[i]), coupler=tuple(l_BC[i]))
        barrier = first_barrier(one.drives, float(psi[0]), float(psi[-1]))
        stops[i] = np.inf if barrier is None else barrier.psi
    return stops


def monodromy(mechanism: SingleMotorPlatform, psi: Array) -> Monodromy:
    """See `SingleMotorPlatform.monodromy`."""
    modes = mechanism.all_poses(float(psi[0]))
    barrier = first_barrier(mechanism.drives, float(psi[0]), float(psi[-1]))
    stop = np.inf if barrier is None else barrier.psi
    tracked = track(
        np.repeat(mechanism._machine[None], len(modes), axis=0),
        psi,
        np.full(len(modes), stop),
        modes,
        mechanism.Lc,
        grown=False,
        accelerations=False,
    )
    permutation, reasons = [], []
    for i in range(len(modes)):
        status, reason, target = BranchEnd(int(tracked.status[i])), "", -1
        if status is BranchEnd.COMPLETE:
            apart = distance(modes, tracked.pose[i, -1], mechanism.Lc)
            nearest = int(np.argmin(apart))
            target = nearest if apart[nearest] <= SAME else -1
            reason = "" if target >= 0 else "the pose at the end is none of the modes at the start"
        elif status is BranchEnd.DRIVE_ENDS and barrier is not None:
            reason = barrier.statement
        else:
            reason = SINGULAR
        permutation.append(target)
        reasons.append(reason)
    ends = tuple(math.nan if target >= 0 else float(at) for target, at in zip(permutation, tracked.end[:, 0]))
    return Monodromy(modes, tuple(permutation), ends, tuple(reasons))


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
