"""Static forces: what the joints and the drivers hold at every position of a motion under given loads."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.core.shown import Shown
from graphsynth.dynamics.elements import Force, Torque
from graphsynth.dynamics.inverse import inverse_dynamics
from graphsynth.dynamics.model import Body, DynamicModel
from graphsynth.mechanism.joints import Prismatic

if TYPE_CHECKING:
    from graphsynth.dynamics.reactions import Reactions
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class StaticForces(Shown):
    """Forces at rest at every sample of a motion (estimated: float64; NaN where the motion does not reach).

    Attributes
    ----------
    motion : Motion
    efforts : ndarray, shape (n, drivers)
        Torque (N times the unit of length) or force (N) that every driver exerts on its ``link`` to hold the mechanism.
    reactions : Reactions
        Of all joints; see `between`.
    """

    motion: Motion
    efforts: Array
    reactions: Reactions

    def between(self, a: int, b: int) -> Array:
        """Return the force that link a exerts on link b in their joint, shape (n, 2), N, in fixed coordinates."""
        return self.reactions.between(a, b).on(b)[0]

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        mechanism, inputs = self.motion.mechanism, self.motion.inputs
        angular = not isinstance(mechanism.joint(*mechanism.drivers[0].pair), Prismatic)
        rows = []
        for driver, effort in zip(mechanism.drivers, self.efforts.T):
            kind = "force" if isinstance(mechanism.joint(*driver.pair), Prismatic) else "torque"
            ends = f"{np.nanmin(effort):.4g} to {np.nanmax(effort):.4g}" if np.isfinite(effort).any() else "unknown"
            rows.append((f"driver {driver.base}-{driver.link}", f"{kind} {ends}"))
        for joint in self.reactions.joints:
            size = joint.size
            if joint.kind == "driver" or not np.isfinite(size).any():
                continue
            at = float(inputs[int(np.nanargmax(size))])
            where = f"{math.degrees(at):.4g}°" if angular else f"{at:.4g}"
            rows.append((f"joint {joint.a}-{joint.b}", f"force up to {np.nanmax(size):.4g}, at input {where}"))
        return "Static forces in the units of the loads (estimated: float64)", rows


def static_forces(
    motion: Motion,
    loads: Mapping[str | int, Any] | Sequence[Force | Torque],
    gravity: tuple[float, float] = (0.0, 0.0),
    bodies: Mapping[int, Body] | None = None,
) -> StaticForces:
    """Find the forces in all joints, and what the drivers must hold, at every position of a motion at rest.

    Parameters
    ----------
    motion : Motion
    loads : mapping, or sequence of Force and Torque
        By the name of a point, the force (fx, fy) that acts there, N; by the number of a link, the torque on it, N
        times the unit of length, its opposite on the frame.
    gravity : (gx, gy)
        m/s^2; acts on ``bodies`` only.
    bodies : mapping of int to Body, optional
        Masses of links; the others have none.

    Returns
    -------
    StaticForces

    Raises
    ------
    GeometryError
        A point or link that does not exist, a load of another kind.

    Examples
    --------
    >>> from graphsynth import Mechanism
    >>> arm = Mechanism.from_points({"A": (0, 0), "B": (2, 0)}, ["AB"], "A")
    >>> arm.simulate([0.0]).forces({"B": (0, -100)}).efforts.round(9).tolist()
    [[200.0]]
    """
    mechanism = motion.mechanism
    given = [_load(motion, where, what) for where, what in loads.items()] if isinstance(loads, Mapping) else list(loads)
    massless = {link: Body(0.0, 0.0) for link in range(mechanism.graph.links) if link != mechanism.frame}
    model = DynamicModel(mechanism, {**massless, **(bodies or {})}, tuple(given), gravity)
    found = inverse_dynamics(model, motion, speed=0.0)
    return StaticForces(motion, found.efforts, found.reactions)


def _load(motion: Motion, where: str | int, what: Any) -> Force | Torque:
    mechanism = motion.mechanism
    if not isinstance(where, str):
        return Torque(mechanism.frame, where, what)
    if where not in mechanism.points:
        known = ", ".join(mechanism.points) or "none"
        raise GeometryError(f"point {where!r} of a load is not defined; the mechanism has {known}")
    link, at = mechanism.points[where]
    return Force(link, what, at)
