"""Joint reactions of the braider: Newton and Euler for each link, checked by power and by the general formulation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.errors import SpecError
from graphsynth.dynamics.motors import numbers

if TYPE_CHECKING:
    from graphsynth.dynamics.driven.run import DriveRun
    from graphsynth.systems.braider.model import Braider

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Reactions:
    """Reactions at the four joints and the shaft torque; forces in N in the fixed frame, torque in N m.

    Attributes
    ----------
    F01, F12, F23, F03 : ndarray of shape (n, 2)
        On the crank at O1 from the frame; on the coupler at A from the crank; on the rocker at B from the coupler;
        on the rocker at O2 from the frame.
    torque : ndarray of shape (n,)
        Of the output shaft of the train on the crank.
    power_error : float
        Largest ``|T w + M w3 - dE_k/dt|`` over the largest of its terms, E_k of the links alone.
    """

    theta: Array
    speed: Array
    acceleration: Array
    F01: Array
    F12: Array
    F23: Array
    F03: Array
    torque: Array
    power_error: float

    def forces(self) -> Array:
        """Return the four forces (n, 4, 2) in the order O1, A, B, O2."""
        return np.stack([self.F01, self.F12, self.F23, self.F03], axis=1)

    def magnitudes(self) -> Array:
        """Sizes of the four forces (n, 4), N."""
        return np.asarray(np.hypot(*np.moveaxis(self.forces(), -1, 0)))


def reactions(braider: Braider, theta: ArrayLike, speed: ArrayLike, acceleration: ArrayLike) -> Reactions:
    """Inverse dynamics at given crank angle (rad), speed and acceleration; arrays broadcast to (n,).

    Returns
    -------
    Reactions
        Closed form up to rounding; NaN where the linkage cannot be assembled.

    Raises
    ------
    SpecError
        What is no number, or lengths that do not fit.

    Notes
    -----
    See theory/braider 5.  The dyad is solved first: the moments of the coupler about A
    and of the rocker about O2 give F23; the rest follows from sums of forces.

    Examples
    --------
    >>> from graphsynth.systems.braider.model import Braider
    >>> found = reactions(Braider(), 0.0, 1.803, 0.0)
    >>> round(float(found.torque[0]), 15)
    -7.9020145597e-05
    """
    theta, w, alpha = _together(theta, speed, acceleration)
    s = braider.linkage.motion(theta)
    m1, m2 = braider.masses[:2]
    _, i2, i3 = braider.moments
    w2, w3 = s.k2 * w, s.k3 * w
    a2, a3 = s.f2 * w * w + s.k2 * alpha, s.f3 * w * w + s.k3 * alpha
    crank = _turning(s.crank, w, alpha)
    mass_arm = _mass_arm(braider, s.rocker)
    coupler = crank + 0.5 * _turning(s.coupler, w2, a2)
    rocker = _turning(mass_arm, w3, a3)  # first moment of mass, m34 a_G3
    arm = braider.tip(theta) - braider.linkage.frame
    load = braider.thread.force(braider.linkage.frame + arm)
    moment = _cross(arm, load)
    # coupler about A:  AB x (-F23) = I2 a2 + AB/2 x m2 a_G2;   rocker about O2:  O2B x F23 + M = I3 a3
    first = -(i2 * a2 + _cross(0.5 * s.coupler, m2 * coupler))
    second = i3 * a3 - moment
    det = _cross(s.coupler, s.rocker)
    with np.errstate(divide="ignore", invalid="ignore"):
        F23 = (first * s.rocker - second * s.coupler) / det
    F12 = F23 + m2 * coupler
    F01 = F12 + m1 * 0.5 * crank
    F03 = rocker - F23 - load
    torque = m1 * braider.linkage.crank**2 / 3.0 * alpha + _cross(s.crank, F12)
    inertia, slope = (x - k for x, k in zip(braider.effective_inertia(theta), (braider.reflected_inertia, 0.0)))
    gained = inertia * alpha * w + 0.5 * slope * w**3
    return Reactions(
        theta, w, alpha, _plane(F01), _plane(F12), _plane(F23), _plane(F03), torque,
        _power_error(torque * w, moment * w3, gained),
    )  # fmt: skip


def _together(theta: ArrayLike, speed: ArrayLike, acceleration: ArrayLike) -> tuple[Array, Array, Array]:
    """Three arrays of one length."""
    given = [
        numbers(name, value, finite=False)  # rows of a run that ended early are NaN
        for name, value in (("theta", theta), ("speed", speed), ("acceleration", acceleration))
    ]
    try:
        theta, speed, acceleration = (x.copy() for x in np.broadcast_arrays(*map(np.atleast_1d, given)))
    except ValueError:
        shapes = ", ".join(str(x.shape) for x in given)
        raise SpecError(f"theta, speed and acceleration of shapes {shapes} do not fit; give equal lengths") from None
    return theta, speed, acceleration


def run_reactions(braider: Braider, found: DriveRun) -> Reactions:
    """Reactions along a run, with the accelerations of the equation of motion."""
    alpha = braider.acceleration(found.angle, found.speed, found.motor_torque)
    return reactions(braider, found.angle, found.speed, alpha)


def general_reactions(
    braider: Braider, theta: ArrayLike, speed: ArrayLike, acceleration: ArrayLike
) -> tuple[Array, Array]:
    """Reactions a second way: multipliers of the planar model in nine absolute coordinates, by `inverse_dynamics`.

    Returns
    -------
    forces, torque : ndarray of shape (n, 4, 2) and (n,)
        As in `Reactions`; NaN where the linkage cannot be assembled.

    Examples
    --------
    >>> from graphsynth.systems.braider.model import Braider
    >>> round(float(general_reactions(Braider(), [0.0], 1.803, 0.0)[1][0]), 15)
    -7.9020145597e-05
    """
    from graphsynth.dynamics.inverse import inverse_dynamics
    from graphsynth.kinematics.simulation import simulate
    from graphsynth.mechanism.laws import Driver, Linear

    theta, w, alpha = _together(theta, speed, acceleration)
    model = braider.model(motor=False)
    turning = replace(model.mechanism, drivers=(Driver(0, 1, Linear()),))
    motion = simulate(turning, theta, modes={0: braider.linkage.branch}, events=False)
    found = inverse_dynamics(model, motion, w, alpha, times=0.0)
    pairs = ((0, 1), (1, 2), (2, 3), (0, 3))
    return np.stack([found.reactions.between(*pair).on(pair[1])[0] for pair in pairs], axis=1), found.efforts[:, 0]


def _turning(arm: NDArray[np.complex128], w: Array, alpha: Array) -> NDArray[np.complex128]:
    """Acceleration of the end of an arm that turns about a fixed point."""
    return np.asarray((1j * alpha - w * w) * arm)


def _plane(force: NDArray[np.complex128]) -> Array:
    """Two components of forces, (n, 2)."""
    return np.stack([force.real, force.imag], axis=-1)


def _mass_arm(braider: Braider, rocker: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """``m34 r_G`` of rocker and switch."""
    _, _, m3, m4 = braider.masses
    ratio = braider.switch / braider.linkage.rocker
    return np.asarray(0.5 * rocker * (m3 + m4 * ratio * np.exp(1j * braider.switch_angle)))


def _cross(u: NDArray[np.complex128], v: NDArray[np.complex128]) -> Array:
    return np.asarray((np.conj(u) * v).imag)


def _power_error(*terms: Array) -> float:
    supplied, load, gained = terms
    size = float(np.nanmax(np.abs(np.stack(terms)), initial=0.0))
    return float(np.nanmax(np.abs(supplied + load - gained), initial=0.0)) / size if size > 0.0 else 0.0
