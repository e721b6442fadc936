"""The result of a dynamic simulation: motion, energy, reactions, checks, events, status."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.start import StartReport

if TYPE_CHECKING:
    from graphsynth.dynamics.model import DynamicModel
    from graphsynth.dynamics.reactions import Reactions
    from graphsynth.dynamics.tables import Compiled

Array = NDArray[np.float64]


class DynamicEvent(NamedTuple):
    """Something at one time.

    Kinds: "singular pose", "fold", "change of coordinates", "break", of dry friction "stick", "slip", "reversal", of
    motors "voltage limit", "direction of power flow".
    """

    kind: str
    time: float
    uncertainty: float
    statement: str


class FrictionHistory(NamedTuple):
    """Dry friction of all elements over n output times.

    ``names`` of the joints in the order of the elements; ``state`` (n, elements) 0 sticking, +1 and -1 sliding;
    ``rate`` of the joint's second link relative to the first (m/s, rad/s), exactly 0 while sticking; ``force`` on the
    second link along it (N, N m); ``load`` of the sliding surfaces (N).  ``shared``: joints that stick together in a
    loop, whose shares of the friction are not determined.
    """

    names: tuple[str, ...]
    state: NDArray[np.int64]
    rate: Array
    force: Array
    load: Array
    shared: tuple[tuple[str, ...], ...]


class MotorHistory(NamedTuple):
    """A motor over n output times.

    ``name``; ``speed`` of its shaft (rad/s), its own ``torque`` (N m), ``currents`` (n, 0, 1 or 2) in A (i_d and i_q of
    a synchronous motor), ``output`` (N m) on its link b behind the losses of the train, without inertia and friction.
    """

    name: str
    speed: Array
    torque: Array
    currents: Array
    output: Array


class RunChecks(NamedTuple):
    """Numbers that tell whether a result can be trusted (theory/planar-dynamics 8); NaN where a check does not apply.

    ``position_drift``, ``velocity_drift``: largest violation of scaled rows at the output times (lengths over the
    characteristic length).  ``energy``: largest ``|E - E(0) - W|`` over the scale of energies in play.  ``power``:
    largest ``|dE/dt - P|`` over the largest ``|P|`` or kinetic power.  ``dalembert``: largest residual of the body
    equations with the reported reactions over the largest force.  ``second_form``: largest difference of the
    accelerations of two formulations over their largest size, counted at regular poses.  ``newton_euler``: the same
    of the reactions, against body-by-body equilibrium.  ``projection_loss``: energy taken by projection (J).
    ``contraction``: the largest factor with which a load that friction makes returned to it; 0 without friction, below
    1 a motion is the only one.  ``electric``: largest defect of the energy of the motors' currents over the energies
    in play; NaN without currents.
    """

    position_drift: float = math.nan
    velocity_drift: float = math.nan
    energy: float = math.nan
    power: float = math.nan
    dalembert: float = math.nan
    second_form: float = math.nan
    newton_euler: float = math.nan
    projection_loss: float = math.nan
    contraction: float = math.nan
    electric: float = math.nan


@dataclass(frozen=True, eq=False)
class DynamicMotion:
    """Motion of a dynamic model over time (estimated: floating point; NaN from where it failed).

    Attributes
    ----------
    times : ndarray, shape (n,)
    poses, velocities, accelerations : ndarray, shape (n, links, 3)
        ``(x, y, theta)`` of the link frames, m and rad; theta continuous.
    multipliers : ndarray, shape (n, rows)
    kinetic, potential, work : ndarray, shape (n,)
        Energies, and the work of all non-conservative loads and drivers since the start, J.
    status : str
        "completed" or "failed".
    message : str
        One sentence.
    reached : float
        Last time reached.
    events : tuple of DynamicEvent
    start : StartReport
    checks : Checks
    warnings : tuple of str
        Checks that are worse than expected, each in a sentence.
    error_estimate : Array or None, shape (n,)
        Largest difference of coordinates (lengths over the characteristic length, angles) to a run at a tolerance
        100 times tighter; None if not asked for.
    form, method, backend : str
    rtol : float
    evaluations, steps : int
        Right-hand sides, accepted steps.
    seconds : float
        Of the integration; ``seconds_checks`` of the checks.
    friction : FrictionHistory or None
        Friction of the joints that have it.
    motors : tuple of MotorHistory
        In the order of the elements.
    """

    compiled: Compiled
    times: Array
    poses: Array
    velocities: Array
    accelerations: Array
    q: Array
    v: Array
    a: Array
    multipliers: Array
    slots: Array
    kinetic: Array
    potential: Array
    work: Array
    status: str
    message: str
    reached: float
    events: tuple[DynamicEvent, ...]
    start: StartReport
    checks: RunChecks
    warnings: tuple[str, ...]
    error_estimate: Array | None
    form: str
    method: str
    backend: str
    rtol: float
    evaluations: int
    steps: int
    seconds: float
    seconds_checks: float
    friction: FrictionHistory | None = None
    motors: tuple[MotorHistory, ...] = ()

    #: How the numbers were obtained.
    label = "estimated"

    @property
    def model(self) -> DynamicModel:
        """The model that moves."""
        return self.compiled.model

    @property
    def completed(self) -> bool:
        """Whether the last output time was reached."""
        return self.status == "completed"

    @property
    def energy(self) -> Array:
        """Kinetic and potential energy, J."""
        return self.kinetic + self.potential

    @cached_property
    def reactions(self) -> Reactions:
        """Reactions in all joints at the output times."""
        from graphsynth.dynamics.reactions import reactions_from_multipliers

        more = None
        if self.friction is not None and self.friction.shared:
            from graphsynth.dynamics.friction.problem import open_shares

            more = open_shares(self.compiled, self.times, self.q, self.v, self.slots, self.friction.state)
        return reactions_from_multipliers(self.compiled, self.q, self.v, self.multipliers, self.times, more)

    def coordinate(self, base: int, link: int) -> tuple[Array, Array]:
        """Coordinate of an R or P joint and its rate over time, each (n,)."""
        from graphsynth.dynamics.values import joint_coordinate

        return joint_coordinate(self.model.mechanism, base, link, self.poses, self.velocities)

    def to_pandas(self) -> Any:
        """Return a table: time, pose, velocity and acceleration of every moving link, energies, work."""
        import pandas as pd

        columns: dict[str, Array] = {"time": self.times}
        for link in self.compiled.moving:
            for name, array in (("", self.poses), ("d_", self.velocities), ("dd_", self.accelerations)):
                for axis, label in enumerate(("x", "y", "theta")):
                    columns[f"{name}{label}_{link}"] = array[:, link, axis]
        columns |= {"kinetic": self.kinetic, "potential": self.potential, "work": self.work}
        return pd.DataFrame(columns)
