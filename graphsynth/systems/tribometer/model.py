"""The tribometer: an upper platform on a spring, dragged by friction on a driven lower platform.

One model, three methods: the event-driven automaton (the reference), time stepping with complementarity, and the
regularised ordinary differential equation; and the same as a model of the general dynamics.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError
from graphsynth.systems.tribometer import forms, motion
from graphsynth.systems.tribometer.platforms import Platforms, StribeckLaw

if TYPE_CHECKING:
    from graphsynth.dynamics.model import DynamicModel
    from graphsynth.dynamics.start import StartReport


Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tribometer(Platforms):
    """A tribometer; the defaults are the chosen values of theory/tribometer 1 (Stribeck law, crank drive).

    ``m x2'' = -k x2 - c x2' + F``; ``F = sgn(u) N mu(|u|)`` while slipping with ``u = x1' - x2'``, and whatever keeps
    ``u = 0``, at most ``mu_s N``, while sticking.  Source: [Perechesova et al. 2014].

    Of the upper platform: ``mass`` (kg), ``stiffness`` (N/m) of its spring, ``damping`` (N s/m), ``load``, the vertical
    force beside the weight (N; the normal force is ``mass gravity + load``), and its start ``x2`` (m; the spring is
    relaxed at 0) and ``v2`` (m/s; None: that of the lower platform).  ``law`` is a `TwoCoefficientLaw` or a
    `StribeckLaw`, ``drive`` a `CrankDrive`, a `HarmonicDrive` or a `BeltDrive`.  `SpecError` if a number is out of its
    bounds, or the platforms are not pressed together.

    Examples
    --------
    >>> motion = Tribometer().event_driven(1.0)
    >>> [event.name for event in motion.events]
    ['SLIP(-1)', 'STICK', 'SLIP(-1)', 'STICK']
    >>> round(motion.events[0].time, 12)
    0.365311879706
    """

    event_driven = motion.event_driven
    time_stepping = forms.time_stepping
    regularised = forms.regularised


def general_model(tribometer: Tribometer) -> tuple[DynamicModel, StartReport]:
    """Return a tribometer as a general model with its start: two guides, a spring, a prescribed motion, dry friction.

    Link 1 is the lower platform, link 2 the upper one; the weight carries the load.  `SpecError` for a law that
    `JointFriction` does not have: a Stribeck exponent other than 2, a viscous part.

    Examples
    --------
    >>> from graphsynth.dynamics.integrate import simulate_dynamics
    >>> model, start = general_model(Tribometer())
    >>> motion = simulate_dynamics(model, [0.0, 0.5], start=start)
    >>> [(event.kind, round(event.time, 9)) for event in motion.events]
    [('slip', 0.36531188)]
    """
    from graphsynth.dynamics.elements import JointFriction, Spring
    from graphsynth.dynamics.model import Body, DynamicModel
    from graphsynth.dynamics.start import consistent_start
    from graphsynth.mechanism.joints import Prismatic
    from graphsynth.mechanism.laws import Driver
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.graph import MechanismGraph

    law, drive = tribometer.law, tribometer.drive
    stribeck = law.velocity if isinstance(law, StribeckLaw) else 0.0
    if law.viscous or (isinstance(law, StribeckLaw) and law.exponent != 2.0):
        raise SpecError(f"{law} has no general element; take the Stribeck exponent 2, and no viscous part.")
    begin = drive.motion(0.0)

    def moved(u: Array) -> tuple[Array, Array, Array]:
        return drive.motion(u)[:3]

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
        gravity=(0.0, -tribometer.normal / tribometer.mass),
        prescribed=(Driver(0, 1, moved),),
    )
    rate = float(begin.v) if tribometer.v2 is None else tribometer.v2
    return model, consistent_start(model, keep={(2, "x"): tribometer.x2}, keep_rates={(2, "x"): rate})
