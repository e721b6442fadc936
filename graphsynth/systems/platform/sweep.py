"""A full turn of the single-motor mechanism on a known branch, warm-started from a neighbouring design.

Used inside design iterations: every sweep either keeps the branch label or says why not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import checked, whole
from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.field import determinant

if TYPE_CHECKING:
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Sweep:
    """Poses at ``psi = 2 pi j / N``; ``reason`` is empty if the whole turn stays on one branch."""

    mechanism: SingleMotorPlatform
    psi: Array
    pose: Array
    theta: Array
    h_phi: Array
    sigma: tuple[int, ...]
    sign: int
    reason: str


def _failed(mechanism: SingleMotorPlatform, reason: str) -> Sweep:
    empty = np.zeros((0, 3))
    return Sweep(mechanism, np.zeros(0), empty, empty, empty, (), 0, reason)


@checked
def cold_sweep(mechanism: SingleMotorPlatform, samples: int) -> Sweep:
    """Follow the home branch over a turn with step control."""
    samples = whole("samples", samples, 4, 100_000)
    reason = _drives(mechanism)
    if reason:
        return _failed(mechanism, reason)
    try:
        motion = mechanism.full_turn(np.linspace(0.0, math.tau, samples + 1))
    except GeometryError as error:
        return _failed(mechanism, str(error))
    if not motion.complete:
        stopped = next((event for event in motion.events if event.ends_motion), None)
        where = "" if stopped is None else f" at psi = {stopped.psi:.6g}"
        return _failed(mechanism, (motion.stop_reason() or "the tracked pose is not an assembly mode") + where)
    if motion.period != 1:
        return _failed(mechanism, f"the path does not close after one turn (period {motion.period})")
    if not motion.working_mode_constant:
        return _failed(mechanism, "a leg passes its boundary: the working mode changes during the turn")
    return Sweep(
        mechanism,
        motion.psi[:-1],
        motion.pose[:-1],
        motion.theta[:-1],
        motion.drive[:-1],
        motion.label.sigma,
        motion.label.sign,
        "",
    )


def _drives(mechanism: SingleMotorPlatform) -> str:
    for number, turn in enumerate(mechanism.drive_turns(), start=1):
        if turn.kind != "full turn":
            return f"drive {number} makes no full turn ({turn.kind})"
    return ""


@checked
def warm_sweep(mechanism: SingleMotorPlatform, near: Sweep) -> Sweep:
    """Solve all samples by Newton from the poses of a neighbouring design; checked against its branch label."""
    reason = _drives(mechanism)
    if reason:
        return _failed(mechanism, reason)
    platform, weight = mechanism.platform, np.array([1.0, 1.0, mechanism.Lc])
    state = mechanism.drive(near.psi)
    theta = state.theta + math.tau * np.round((near.theta - state.theta) / math.tau)
    pose, size = near.pose, math.inf
    for _ in range(12):
        JX, JT = platform.jacobians(pose, theta)
        value = determinant(JX)
        if bool((value * near.sign <= 0.0).any()):
            return _failed(mechanism, "det JX changes its sign: the platform is singular during the turn")
        step = np.linalg.solve(JX, -platform.closure(pose, theta)[..., None])[..., 0]
        pose = pose + step
        last, size = size, float(np.abs(step * weight).max()) / mechanism.Lc
        if size <= 1e-14 or (size <= 1e-11 and size >= 0.25 * last):
            break
        if size > 0.5 or (size >= last and size > 1e-11):
            return _followed(mechanism, near)
    JX, JT = platform.jacobians(pose, theta)
    if bool((np.sign(JT) != np.array(near.sigma)).any()):
        return _failed(mechanism, "a leg passes its boundary: the working mode changes during the turn")
    if bool((determinant(JX) * near.sign <= 0.0).any()):
        return _failed(mechanism, "det JX changes its sign: the platform is singular during the turn")
    return Sweep(mechanism, near.psi, pose, theta, state.h_phi, near.sigma, near.sign, "")


def _followed(mechanism: SingleMotorPlatform, near: Sweep) -> Sweep:
    """Follow the turn from home where Newton from the neighbouring poses fails; the label must be the neighbour's."""
    found = cold_sweep(mechanism, len(near.psi))
    if not found.reason and (found.sigma, found.sign) != (near.sigma, near.sign):
        return _failed(mechanism, "the home branch has another label than that of the neighbouring design")
    return found


@checked
def pose_derivatives(sweep: Sweep) -> Array:
    """Return the derivatives of the poses by the design, shape (N, 3, 9).

    Columns: real parts of ``l_B exp(i psi0)`` of the three cranks, imaginary parts, coupler lengths.
    """
    mechanism = sweep.mechanism
    turn = np.exp(1j * np.array(mechanism.frame_angle))
    crank = np.array(mechanism.crank) * np.exp(1j * np.array(mechanism.phase))
    wheel = np.exp(1j * sweep.psi)[:, None]
    phi = sweep.theta - np.array(mechanism.delta)
    C = np.array(mechanism.pivot) * turn + np.array(mechanism.rocker) * np.exp(1j * phi)
    link = C - np.array(mechanism.axis) * turn - crank * wheel
    moment = 0.5 * sweep.h_phi
    along, across = (np.conj(link) * wheel).real / moment, (np.conj(link) * 1j * wheel).real / moment
    longer = np.array(mechanism.coupler) / moment
    J = mechanism.platform.velocity_matrix(sweep.pose, sweep.theta)
    return np.concatenate([J * rate[:, None, :] for rate in (along, across, longer)], axis=-1)
