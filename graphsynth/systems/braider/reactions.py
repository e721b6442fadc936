"""Joint reactions of the braider, from the general dynamics of its planar model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array
from graphsynth.core.errors import SpecError

if TYPE_CHECKING:
    from graphsynth.dynamics.driven.run import DriveRun
    from graphsynth.systems.braider.model import Braider

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class JointForces:
    """Reactions at the four joints, N in the fixed frame (n, 2), and the shaft torque, N m (n,)."""

    theta: Array
    speed: Array
    acceleration: Array
    F01: Array  #: on the crank at O1 from the frame
    F12: Array  #: on the coupler at A from the crank
    F23: Array  #: on the rocker at B from the coupler
    F03: Array  #: on the rocker at O2 from the frame
    torque: Array  #: of the output shaft of the train on the crank
    #: largest ``|T w + M w3 - dE_k/dt|`` over the largest of its terms, E_k of the links in closed form
    power_error: float
    #: largest difference of a force from the equilibrium of every body, over the largest force
    second_way: float

    def forces(self) -> Array:
        """Return the four forces (n, 4, 2) in the order O1, A, B, O2."""
        return np.stack([self.F01, self.F12, self.F23, self.F03], axis=1)

    def magnitudes(self) -> Array:
        """Sizes of the four forces (n, 4), N."""
        return np.asarray(np.hypot(*np.moveaxis(self.forces(), -1, 0)))


def reactions(braider: Braider, theta: ArrayLike, speed: ArrayLike, acceleration: ArrayLike) -> JointForces:
    """Inverse dynamics at given crank angle (rad), speed and acceleration; arrays broadcast to (n,).

    Estimated, a few roundings; NaN where the linkage cannot be assembled.  `SpecError` for lengths that do not fit.

    Examples
    --------
    >>> from graphsynth.systems.braider.model import Braider
    >>> found = reactions(Braider(), 0.0, 1.803, 0.0)
    >>> round(float(found.torque[0]), 15)
    -7.9020145597e-05
    """
    from graphsynth.dynamics.inverse import inverse_dynamics

    given = {"theta": theta, "speed": speed, "acceleration": acceleration}
    # rows of a run that ended early are NaN
    parts = [np.atleast_1d(finite_array(name, value, SpecError, nan=True)) for name, value in given.items()]
    try:
        theta, w, alpha = (x.copy() for x in np.broadcast_arrays(*parts))
    except ValueError:
        shapes = ", ".join(str(x.shape) for x in parts)
        raise SpecError(f"theta, speed and acceleration of shapes {shapes} do not fit; give equal lengths") from None
    there = np.flatnonzero(braider.motion(theta).assembled & np.isfinite(w) & np.isfinite(alpha))
    motion = braider.motion(theta[there])
    found = inverse_dynamics(braider.model(motor=False), motion, w[there], alpha[there], times=0.0)
    values = np.full((theta.size, 9), np.nan)
    for k, pair in enumerate(((0, 1), (1, 2), (2, 3), (0, 3))):
        values[there, 2 * k : 2 * k + 2] = found.reactions.between(*pair).on(pair[1])[0]
    values[there, 8] = found.efforts[:, 0]
    F01, F12, F23, F03, T = np.split(values, [2, 4, 6, 8], axis=1)
    inertia, slope = braider.effective_inertia(theta)
    gained = (inertia - braider.reflected_inertia) * alpha * w + 0.5 * slope * w**3
    powers = np.stack([T[:, 0] * w, braider.load_moment(theta) * braider.linkage.motion(theta).k3 * w, -gained])
    size = float(np.nanmax(np.abs(powers), initial=0.0))
    error = float(np.nanmax(np.abs(powers.sum(axis=0)), initial=0.0)) / size if size > 0.0 else 0.0
    return JointForces(theta, w, alpha, F01, F12, F23, F03, T[:, 0], error, found.newton_euler)


def run_reactions(braider: Braider, found: DriveRun) -> JointForces:
    """Reactions along a run, with the accelerations of the equation of motion."""
    alpha = braider.acceleration(found.angle, found.speed, found.motor_torque)
    return reactions(braider, found.angle, found.speed, alpha)
