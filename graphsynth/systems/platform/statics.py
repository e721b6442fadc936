"""Statics of the platform and of the single-motor mechanism: rocker torques, axial forces, crank and motor torque."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite, finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.parallel_platform import ParallelPlatform
from graphsynth.systems.platform.singularity import TOLERANCE, Singularity, closed_pose, singularity

if TYPE_CHECKING:
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Statics:
    """Forces that hold the platform against a wrench (massless, frictionless links; estimated: floating point).

    * `status`: "balanced"; "cannot be balanced" (type II, the wrench does work on the uncontrolled motion: all forces
      NaN); "indeterminate" (type II, it does none: the forces of least norm, any multiple of
      ``singularity.self_stress`` may be added).
    * `rocker_torque` (shape (3,)): torques at the rockers, force x length.
    * `link_force` (shape (3,)): axial forces of the intermediate links, positive when the link pushes.
    * `unbalanced_power` (shape (m,)): work of the wrench on each uncontrolled motion of ``singularity.uncontrolled``.
    * `singularity`: type of the pose, with the uncontrolled motion.
    """

    status: str
    rocker_torque: Array
    link_force: Array
    unbalanced_power: Array
    singularity: Singularity


@dataclass(frozen=True, eq=False)
class CrankStatics:
    """Forces through the single-motor mechanism.

    * `status`: as in `Statics`; also "drive k locked", where no crank torque gives a rocker torque, with NaN.
    * `crank_torque`: torque at the common wheel axis (sum over the three wheels), ``(dX/dpsi)^T W``.
    * `motor_torque`: torque at the pinion for lossless gears, with the sign of its own rotation.
    * `coupler_force` (shape (3,)): axial forces of the couplers, positive when the coupler pushes.
    * `shares` (shape (3,)): crank torque of each drive.
    """

    status: str
    crank_torque: float
    motor_torque: float
    coupler_force: Array
    shares: Array
    platform: Statics


@checked
def statics(
    platform: ParallelPlatform,
    pose: ArrayLike,
    theta: ArrayLike,
    wrench: ArrayLike,
    *,
    Lc: float | None = None,
    tolerance: float = TOLERANCE,
) -> Statics:
    """Rocker torques and link forces for the wrench that the platform exerts on its surroundings.

    `pose`, `theta` (shape (3,)): a closed pose. `wrench` (shape (3,)): ``(W_x, W_y, W_alpha)``: force and moment about
    the reference point. `Lc`, `tolerance`: see `graphsynth.systems.platform.singularity.singularity`. Raises
    `GeometryError`: a wrench without three components, or legs that do not close. See theory/platform-jacobians 4:
    ``JX^T lambda = W``, ``tau_k = -JT_kk lambda_k``, axial force ``2 l2_k lambda_k``.

    >>> mock = ParallelPlatform.mock()
    >>> theta = mock.inverse([0.0, 0.0, 0.0], (-1, -1, -1)).theta
    >>> statics(mock, [0.0, 0.0, 0.0], theta, [0.0, 0.0, 72.0]).rocker_torque.round(9).tolist()
    [-25.0, -25.0, -25.0]
    """
    X, t = closed_pose(platform, pose, theta)
    W = finite_array("wrench", wrench).reshape(-1)
    if W.shape != (3,):
        raise GeometryError(f"wrench has {W.size} components; give (W_x, W_y, W_alpha)")
    found = singularity(platform, X, t, Lc=Lc, tolerance=tolerance)
    JX, JT = platform.jacobians(X, t)
    scale = np.array([1.0, 1.0, 1.0 / found.Lc])
    power = found.uncontrolled @ W
    if not len(found.uncontrolled):
        factor = np.linalg.solve((JX * scale).T, W * scale)
        return Statics("balanced", -JT * factor, 2.0 * np.array(platform.l2) * factor, power, found)
    if bool((np.abs(power) > 1e-7 * found.Lc * float(np.linalg.norm(W * scale))).any()):
        return Statics("cannot be balanced", np.full(3, np.nan), np.full(3, np.nan), power, found)
    factor = np.linalg.lstsq((JX * scale).T, W * scale, rcond=tolerance)[0]
    return Statics("indeterminate", -JT * factor, 2.0 * np.array(platform.l2) * factor, power, found)


@checked
def crank_statics(
    mechanism: SingleMotorPlatform, psi: float, pose: ArrayLike, wrench: ArrayLike, *, tolerance: float = TOLERANCE
) -> CrankStatics:
    """Crank torque, motor torque and coupler forces of the single-motor mechanism at one configuration.

    `psi`: wheel angle, radians. `pose` (shape (3,)): platform pose that belongs to it (a row of ``full_turn().pose``).
    `wrench` (shape (3,)): wrench that the platform exerts on its surroundings. Raises `GeometryError`: an angle at
    which a drive cannot be assembled, or a wrench without three components. See theory/platform-jacobians 4 and
    theory/platform-drive 3.  At a dead point of a rocker its share of the crank torque is zero whatever the load.

    >>> from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
    >>> mechanism = SingleMotorPlatform()
    >>> held = crank_statics(mechanism, 0.0, mechanism.home_pose(0.0), [1.0, 0.0, 0.0])
    >>> held.status, abs(held.motor_torque / held.crank_torque)
    ('balanced', 0.5)
    """
    psi = finite("psi", psi)
    state = mechanism.drive(psi)
    for k in range(3):
        if not np.isfinite(state.theta[k]):
            raise GeometryError(f"drive {k + 1} cannot be assembled at psi = {psi}; choose an angle inside its reach")
    held = statics(mechanism.platform, pose, state.theta, wrench, Lc=mechanism.Lc, tolerance=tolerance)
    moment = 0.5 * state.h_phi  # cross(C - D, C - B)
    sine = moment / (np.array(mechanism.rocker) * np.array(mechanism.coupler))
    locked = [k + 1 for k in range(3) if abs(sine[k]) <= tolerance]
    with np.errstate(divide="ignore", invalid="ignore"):
        coupler = np.where(np.abs(sine) > tolerance, held.rocker_torque * np.array(mechanism.coupler) / moment, np.nan)
    shares = held.rocker_torque * np.where(np.abs(sine) > tolerance, state.theta1, np.nan)
    total = float(shares.sum())
    status = held.status
    if locked and status != "cannot be balanced":
        status = f"drive {', '.join(map(str, locked))} locked"
    return CrankStatics(status, total, mechanism.gears.ratio * total, coupler, shares, held)
