"""The tribometer as a model of the general dynamics: two guides, a spring, a prescribed motion, dry friction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError
from graphsynth.dynamics.elements import JointFriction, Spring
from graphsynth.dynamics.friction.laws import StribeckLaw
from graphsynth.dynamics.model import Body, DynamicModel
from graphsynth.dynamics.start import StartReport, consistent_start
from graphsynth.mechanism.joints import Prismatic
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

if TYPE_CHECKING:
    from graphsynth.systems.tribometer.drives import Drive
    from graphsynth.systems.tribometer.model import Tribometer

Array = NDArray[np.float64]


class _DriveLaw:
    """A drive of a tribometer as a motion law."""

    def __init__(self, drive: Drive) -> None:
        self._drive = drive

    def __call__(self, u: Array) -> tuple[Array, Array, Array]:
        motion = self._drive.motion(u)
        return motion.x, motion.v, motion.a


def general_model(tribometer: Tribometer) -> tuple[DynamicModel, StartReport]:
    """Return a tribometer as a general model with its start.

    Parameters
    ----------
    tribometer : Tribometer
        With two coefficients or a Stribeck law of exponent 2, without a viscous part.

    Returns
    -------
    model : DynamicModel
        Link 1 is the lower platform, link 2 the upper one; the weight carries the load.
    start : StartReport

    Raises
    ------
    SpecError
        A law that `JointFriction` does not have.

    Examples
    --------
    >>> from graphsynth.dynamics.integrate import simulate_dynamics
    >>> from graphsynth.systems.tribometer.model import Tribometer
    >>> model, start = general_model(Tribometer())
    >>> motion = simulate_dynamics(model, [0.0, 0.5], start=start)
    >>> [(event.kind, round(event.time, 9)) for event in motion.events]
    [('slip', 0.36531188)]
    """
    law, drive = tribometer.law, tribometer.drive
    stribeck = law.velocity if isinstance(law, StribeckLaw) else 0.0
    if law.viscous or (isinstance(law, StribeckLaw) and law.exponent != 2.0):
        raise SpecError(f"{law} has no general element; take the Stribeck exponent 2, and no viscous part.")
    begin = drive.motion(0.0)
    graph = MechanismGraph(3, [(0, 1), (1, 2)], frame=0)
    pose = ((0.0, 0.0, 0.0), (float(begin.x), 0.0, 0.0), (tribometer.x2, 0.0, 0.0))
    far = 1.0 + 10.0 * tribometer.reach  # the spring never comes to length 0
    model = DynamicModel(
        Mechanism(graph, (Prismatic(0, 1), Prismatic(1, 2)), pose=pose),
        {1: Body(tribometer.mass, tribometer.mass), 2: Body(tribometer.mass, tribometer.mass)},
        (
            Spring(0, 2, (-far, 0.0), (0.0, 0.0), tribometer.stiffness, far, tribometer.damping),
            JointFriction(1, 2, law.kinetic, law.static, stribeck_speed=stribeck),
        ),
        gravity=(0.0, -tribometer.normal / tribometer.mass), prescribed=(Driver(0, 1, _DriveLaw(drive)),),
    )  # fmt: skip
    rate = float(begin.v) if tribometer.v2 is None else tribometer.v2
    return model, consistent_start(model, keep={(2, "x"): tribometer.x2}, keep_rates={(2, "x"): rate})
