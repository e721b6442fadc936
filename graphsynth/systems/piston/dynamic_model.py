"""The floating piston as a general dynamic model, and the check of the closed form by multipliers."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import Point, checked
from graphsynth.dynamics.elements import Element, Force, JointFriction
from graphsynth.dynamics.inverse import InverseDynamics, inverse_dynamics
from graphsynth.dynamics.model import Body, DynamicModel
from graphsynth.kinematics.engine.inputs import monotonic
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.model import Mechanism
from graphsynth.systems.piston.drives import CrankSlider
from graphsynth.systems.piston.loads import PistonLoads
from graphsynth.systems.piston.machine import PistonMachine

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MultiplierCheck:
    """Closed form against the general constrained dynamics (estimated).

    Attributes
    ----------
    difference : float
        Largest difference of forces, couples over the stroke and torque over the stroke, over the largest force.
    redundant_couples : bool
        Whether the general dynamics found the couples of guide, slot and wall undetermined, as the structure says.
    closed_form : PistonLoads
    general : InverseDynamics
    """

    difference: float
    redundant_couples: bool
    closed_form: PistonLoads
    general: InverseDynamics


@checked
def dynamic_model(machine: PistonMachine, slot: Literal["sliding", "crowned"] = "crowned") -> DynamicModel:
    """Return the machine with bodies, gas, rings and friction as elements: for simulation, springs, motors, engines.

    Parameters
    ----------
    machine : PistonMachine
    slot : {"sliding", "crowned"}
        See :meth:`graphsynth.systems.piston.model.FloatingPiston.mechanism`.

    Examples
    --------
    >>> from graphsynth.systems.piston import FloatingPiston
    >>> sorted(dynamic_model(PistonMachine(FloatingPiston.crank_slider(0.05, 0.2))).bodies)
    [1, 2, 3, 4]
    """
    mechanism = machine.mechanism.mechanism(slot)
    masses, friction = machine.masses, machine.friction
    group = machine.mechanism.group
    slider = isinstance(machine.mechanism.drive, CrankSlider)
    bodies = {
        1: Body(masses.crank, masses.crank_inertia, (masses.crank_centre, 0.0)),
        2: Body(masses.follower, masses.rod_inertia, (masses.rod_centre, 0.0)) if slider else Body(masses.follower, 0),
        3: Body(masses.crosshead, 0.0),
    }
    pairs = {"cylinder" if group is None else "guide": (0, 3)}
    if group is not None:
        bodies[4] = Body(masses.piston, 0.0)
        pairs |= {"cylinder": (0, 4), "slot": (3, 4)}
    if not slider:
        pairs["yoke"] = (2, 3)
    elements: list[Element] = [
        JointFriction(a, b, getattr(friction, name), smoothing_velocity=friction.smoothing_velocity)
        for name, (a, b) in pairs.items()
        if getattr(friction, name) > 0.0
    ]
    elements.append(_gas(machine, 3 if group is None else 4))
    return DynamicModel(mechanism, bodies, tuple(elements), machine.gravity)


def _gas(machine: PistonMachine, link: int) -> Force:
    """Gas and rings as one force on the piston, from its place and velocity."""
    mechanism, friction = machine.mechanism, machine.friction
    turn = 0.0 if mechanism.group is None else mechanism.group.cylinder_angle
    along = (math.cos(turn), math.sin(turn))
    above = mechanism.drive.offset + (0.0 if mechanism.group is None else mechanism.group.cylinder_offset)
    outer, stroke = mechanism.dead_centres()[0], mechanism.stroke

    def law(t: float, place: Point, velocity: Point) -> Point:
        gap = outer.piston - (along[0] * place[0] + along[1] * (place[1] - above))
        rate = along[0] * velocity[0] + along[1] * velocity[1]
        given = machine.gas.force(np.array([t]), np.array([gap]), np.array([rate > 0.0]), stroke)
        size = float(given[0]) + friction.rings * math.tanh(rate / friction.smoothing_velocity)
        return -along[0] * size, -along[1] * size

    return Force(link, law)


@checked
def check_by_multipliers(machine: PistonMachine, angle: ArrayLike) -> MultiplierCheck:
    """Compute the loads a second time from all constraints at once, with Lagrange multipliers, and compare.

    The general dynamics knows nothing of the order of the bodies: it solves all equations of all bodies, with the
    sliding pair 3-4 of the source, whose redundant couple it has to find undetermined.

    Parameters
    ----------
    machine : PistonMachine
        A `GivenForce` must not depend on the crank angle.
    angle : array_like, shape (n,)
        Strictly monotonic crank angles, radians.

    Examples
    --------
    >>> from graphsynth.systems.piston.gas import ConstantForce
    >>> from graphsynth.systems.piston import FloatingPiston
    >>> machine = PistonMachine(FloatingPiston.crank_slider(0.05, 0.2), gas=ConstantForce(1000.0))
    >>> found = check_by_multipliers(machine, [0.5, 1.0])
    >>> found.difference < 1e-12, found.redundant_couples
    (True, True)
    """
    model = dynamic_model(machine, "sliding")
    angle = monotonic(angle)
    crowned = machine.mechanism.mechanism("crowned", float(angle[0]))
    motion = replace(simulate(crowned, angle, events=False), mechanism=model.mechanism)
    # the law of the gas reads the crank angle where a load has its time
    general = inverse_dynamics(model, motion, machine.speed, machine.acceleration, times=motion.inputs)
    loads = machine.loads(motion.inputs)
    pairs = _pairs(machine, loads, general, model.mechanism)
    size = max(float(np.abs(own).max()) for own, _ in pairs)
    difference = max(float(np.abs(own - other).max()) for own, other in pairs)
    free = machine.mechanism.group is not None and not any(
        general.reactions.between(a, b).determined[:, 2].any() for a, b in ((0, 3), (3, 4), (0, 4))
    )
    return MultiplierCheck(difference / max(size, 1e-300), free, loads, general)


def _pairs(
    machine: PistonMachine, loads: PistonLoads, general: InverseDynamics, mechanism: Mechanism
) -> list[tuple[Array, Array]]:
    """Own and general values of the same load, all in N."""
    stroke = machine.mechanism.stroke
    group = machine.mechanism.group
    reactions = general.reactions

    def normal(a: int, b: int, turn: float) -> Array:
        """Of the force of link a on link b, along the normal of a direction."""
        return np.asarray(reactions.between(a, b).on(b)[0] @ np.array([-math.sin(turn), math.cos(turn)]))

    found = [
        (loads.bearing, reactions.between(0, 1).on(1)[0]),
        (loads.crank_pin, reactions.between(1, 2).on(2)[0]),
        (loads.guide, normal(0, 3, 0.0)),
        (loads.torque / stroke, general.efforts[:, 0] / stroke),
    ]
    drive = machine.mechanism.drive
    if isinstance(drive, CrankSlider):
        found.append((loads.crosshead_pin, reactions.between(2, 3).on(3)[0]))
    else:
        found.append((loads.yoke, normal(2, 3, drive.yoke_angle)))
    if group is not None:
        found.append((loads.wall, normal(0, 4, group.cylinder_angle)))
        found.append((loads.slot, normal(3, 4, group.slot_angle)))
    else:
        found.append((loads.guide_couple / stroke, reactions.between(0, 3).on(3)[1] / stroke))
    return found
