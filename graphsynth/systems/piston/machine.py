"""Loads of a crank drive with and without a floating piston, from the general dynamics."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import Point, check_fields, check_sizes, checked, finite, finite_array, point, positive
from graphsynth.core.errors import GeometryError
from graphsynth.dynamics.elements import Element, Force, ForceLaw, JointFriction
from graphsynth.dynamics.model import Body, DynamicModel
from graphsynth.systems.piston.loads import (
    CompressorCycle,
    ConstantForce,
    GasLaw,
    GivenForce,
    PistonFriction,
    PistonMasses,
)
from graphsynth.systems.piston.model import CrankSlider, FloatingPiston

if TYPE_CHECKING:
    from graphsynth.dynamics.inverse import InverseDynamics

Array = NDArray[np.float64]
#: Kind of the slot.
Slot = Literal["sliding", "crowned"]


@dataclass(frozen=True, eq=False)
class PistonLoads:
    """Reactions and powers over the crank angle (estimated: a few roundings; NaN where friction jams).

    Forces are on the body with the higher number, in N, world coordinates; couples on it at its reference point, N m.

    Attributes
    ----------
    angle : ndarray, shape (n,)
    gas : ndarray, shape (n,)
        Force of the gas away from the head.
    wall : ndarray, shape (n,)
        Side load of the cylinder on the piston, along its normal.
    guide : ndarray, shape (n,)
        Normal force of the guide on the crosshead; the wall force if there is no second group.
    slot : ndarray, shape (n,)
        Normal force of the crosshead's slot on the piston; 0 without a second group.
    yoke : ndarray, shape (n,)
        Normal force of the block on the yoke; 0 for a slider-crank.
    guide_couple, wall_couple : ndarray, shape (n,)
        With a crowned slot, which carries no couple.  One couple may circulate on top of it in a sliding one, see
        `self_stress`.
    crank_pin, crosshead_pin, bearing : ndarray, shape (n, 2)
        Of crank on rod or block, of rod on crosshead (0 for a yoke), of frame on crank.
    torque : ndarray, shape (n,)
        Of the motor on the crank, N m.
    driving, gas_power, friction_power, kinetic_power, weight_power : ndarray, shape (n,)
        W: of the motor, taken by the gas, lost in friction, into kinetic energy, of the weights.
    held : ndarray, shape (n,)
        Where the slot does not slide: the force across the cylinder that its friction can hold, ``mu |slot|``; the wall
        may carry up to so much more or less than `wall`.  0 where it slides.
    """

    angle: Array
    gas: Array
    wall: Array
    guide: Array
    slot: Array
    yoke: Array
    guide_couple: Array
    wall_couple: Array
    crank_pin: Array
    crosshead_pin: Array
    bearing: Array
    torque: Array
    driving: Array
    gas_power: Array
    friction_power: Array
    kinetic_power: Array
    weight_power: Array
    held: Array

    #: Couples on crosshead (guide), piston (slot) and piston (wall) that balance each other in every pose.
    self_stress = (1.0, 1.0, -1.0)

    @property
    def power_error(self) -> float:
        """Largest error of the power balance over the largest power in play; NaN if nothing is determined."""
        parts = np.array([self.driving, -self.gas_power, -self.friction_power, -self.kinetic_power, self.weight_power])
        good = np.isfinite(parts).all(axis=0)
        if not good.any():
            return float("nan")
        return float(np.abs(parts[:, good].sum(axis=0)).max() / max(np.abs(parts[:, good]).max(), 1e-300))

    def edges(self, length: float, of: Literal["wall", "guide"] = "wall") -> tuple[Array, Array]:
        """Return the forces, N, at the two ends of a piston that give its side load and couple, the head's end last.

        `length` in m, with the reference point in its middle; `of` "guide": at the ends of the crosshead's shoe.
        """
        force, couple = (self.wall, self.wall_couple) if of == "wall" else (self.guide, self.guide_couple)
        lever = couple / positive("length of the piston", length)
        return 0.5 * force - lever, 0.5 * force + lever


@dataclass(frozen=True)
class PistonMachine:
    """A floating piston (or a plain drive) with masses, gas force and friction, its crank turned at a given speed.

    Parameters
    ----------
    mechanism : FloatingPiston
    masses : PistonMasses
    gas : CompressorCycle, ConstantForce or GivenForce
    friction : PistonFriction
    speed, acceleration : float
        Of the crank, rad/s and rad/s^2.
    gravity : (gx, gy)
        m/s^2; (0, 0) by default.  (-9.81, 0) puts the cylinder above the crank.

    Raises
    ------
    GeometryError
        Negative masses, coefficients or powers of the gas law; values that are not finite.

    Examples
    --------
    With 1 kN on the piston the connecting rod presses a plain piston to the wall; the floating piston is free.

    >>> machine = PistonMachine(FloatingPiston.crank_slider(0.05, 0.2), gas=ConstantForce(1000.0))
    >>> round(machine.without_group().loads(np.pi / 2).wall.item(), 3), machine.loads(np.pi / 2).wall.round(9) + 0.0
    (258.199, array([0.]))
    """

    mechanism: FloatingPiston
    masses: PistonMasses = field(default_factory=PistonMasses)
    gas: GasLaw = field(default_factory=ConstantForce)
    friction: PistonFriction = field(default_factory=PistonFriction)
    speed: float = 1.0
    acceleration: float = 0.0
    gravity: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        for name, kind in (
            ("mechanism", FloatingPiston),
            ("masses", PistonMasses),
            ("friction", PistonFriction),
            ("gas", CompressorCycle | ConstantForce | GivenForce),
        ):
            if not isinstance(getattr(self, name), kind):
                raise GeometryError(
                    f"{name} = {getattr(self, name)!r} is not a {getattr(kind, '__name__', kind)}; give one"
                )
        for name in ("speed", "acceleration"):
            object.__setattr__(self, name, finite(f"{name} of the crank", getattr(self, name)))
        object.__setattr__(self, "gravity", point("gravity", self.gravity))
        check_fields(self, (), small=("speed", "acceleration"))
        check_sizes("PistonMachine", {"gravity": max(1.0, *map(abs, self.gravity))})

    def without_group(self) -> PistonMachine:
        """Return the plain machine: piston and crosshead one body of the same mass in the cylinder, the same gas."""
        masses = replace(self.masses, crosshead=self.masses.crosshead + self.masses.piston, piston=0.0)
        return replace(self, mechanism=self.mechanism.without_group(), masses=masses)

    def gas_force(self, angle: ArrayLike) -> Array:
        """Force of the gas on the piston away from the head, N; a crank at rest counts as about to turn forwards."""
        motion = self.mechanism.motion(angle)
        outer, _ = self.mechanism.dead_centres()
        closing = np.asarray(motion.piston.first * (self.speed or 1.0) > 0.0)
        return self.gas.force(motion.angle, outer.piston - motion.piston.value, closing, self.mechanism.stroke)

    @checked
    def dynamic_model(self, slot: Slot = "crowned") -> DynamicModel:
        """Return the machine with bodies, gas, rings and friction as elements: for simulation, springs, motors.

        For `slot` see `FloatingPiston.mechanism`.

        Examples
        --------
        >>> sorted(PistonMachine(FloatingPiston.crank_slider(0.05, 0.2)).dynamic_model().bodies)
        [1, 2, 3, 4]
        """
        outer, stroke = self.mechanism.dead_centres()[0], self.mechanism.stroke
        turn, base = self.mechanism.cylinder
        along = np.exp(1j * turn)

        def law(t: float, place: Point, velocity: Point) -> Point:
            gap = outer.piston - (along.conj() * (complex(*place) - base)).real
            rate = (along.conj() * complex(*velocity)).real
            given = self.gas.force(np.array([t]), np.array([gap]), np.array([rate > 0.0]), stroke)
            rings = self.friction.rings * math.tanh(rate / self.friction.smoothing_velocity)
            force = -along * (float(given[0]) + rings)
            return force.real, force.imag

        return self._model(law, slot)

    def _model(self, force: ForceLaw, slot: Slot) -> DynamicModel:
        masses, friction, group = self.masses, self.friction, self.mechanism.group
        slider = isinstance(self.mechanism.drive, CrankSlider)
        bodies = {
            1: Body(masses.crank, masses.crank_inertia, (masses.crank_centre, 0.0)),
            2: Body(masses.follower, masses.rod_inertia * slider, (masses.rod_centre * slider, 0.0)),
            3: Body(masses.crosshead, 0.0),
            **({} if group is None else {4: Body(masses.piston, 0.0)}),
        }
        elements: list[Element] = [
            JointFriction(*pair, getattr(friction, name), smoothing_velocity=friction.smoothing_velocity)
            for name, (pair, _) in self._contacts().items()
            if getattr(friction, name) > 0.0
        ]
        elements.append(Force(max(bodies), force))
        return DynamicModel(self.mechanism.mechanism(slot), bodies, elements, self.gravity)

    def _contacts(self) -> dict[str, tuple[tuple[int, int], float]]:
        """Links of every sliding contact, the body that is loaded last, and its direction."""
        drive, group = self.mechanism.drive, self.mechanism.group
        found = {"cylinder" if group is None else "guide": ((0, 3), 0.0)}
        if group is not None:
            found |= {"cylinder": ((0, 4), group.cylinder_angle), "slot": ((3, 4), group.slot_angle)}
        return found if isinstance(drive, CrankSlider) else found | {"yoke": ((2, 3), drive.yoke_angle)}

    @checked
    def inverse_dynamics(self, angle: ArrayLike, slot: Slot = "crowned", refuse: bool = True) -> InverseDynamics:
        """Find torque and reactions of all joints by the general dynamics, at crank angles (n,) in radians.

        With a sliding slot the couples of guide, slot and wall are found undetermined; ``refuse=False`` gives NaN
        where friction leaves no loads, or several.
        """
        from graphsynth.dynamics.inverse import inverse_dynamics

        motion = self.mechanism.run(angle, slot)
        rate = self.mechanism.motion(motion.inputs).piston.first * self.speed
        rings = self.friction.rings * np.tanh(rate / self.friction.smoothing_velocity)
        forces = -np.exp(1j * self.mechanism.cylinder[0]) * (self.gas_force(motion.inputs) + rings)
        given = list(zip(forces.real.tolist(), forces.imag.tolist()))
        model = self._model(lambda k, place, velocity: given[int(k)], slot)
        count = np.arange(len(given))
        return inverse_dynamics(model, motion, self.speed, self.acceleration, times=count, refuse=refuse)

    def loads(self, angle: ArrayLike) -> PistonLoads:
        """Find all reactions at crank angles, radians: one list of numbers, or a scalar for arrays of length 1.

        NaN where friction leaves no or several solutions: the machine jams there, or may.
        """
        phi = np.atleast_1d(finite_array("angle", angle))
        found = self.inverse_dynamics(phi, refuse=False)
        motion, zero = self.mechanism.motion(phi), np.zeros(len(phi))
        pins = {pair: found.reactions.between(*pair).on(pair[1])[0] for pair in ((0, 1), (1, 2), (2, 3))}
        ways = (motion.crosshead, motion.piston, motion.slot, motion.follower)
        speeds = dict(zip(("guide", "cylinder", "slot", "yoke"), ways))
        normal, lost = dict.fromkeys(speeds, zero), self.friction.rings * self._sliding(motion.piston.first)
        for name, (pair, turn) in self._contacts().items():
            force = found.reactions.between(*pair).on(pair[1])[0]
            normal[name] = force @ np.array([-math.sin(turn), math.cos(turn)])
            lost = lost + getattr(self.friction, name) * np.abs(normal[name]) * self._sliding(speeds[name].first)
        plain, slider = self.mechanism.group is None, isinstance(self.mechanism.drive, CrankSlider)
        couple, torque, gas = found.reactions.between(0, 3).on(3)[1], found.efforts[:, 0], self.gas_force(phi)
        kinetic, weights = self._powers(phi)
        stands = self.mechanism.group is not None and math.sin(self.mechanism.group.cylinder_angle) == 0.0
        return PistonLoads(
            angle=phi,
            gas=gas,
            wall=normal["cylinder"],
            guide=normal["cylinder" if plain else "guide"],
            slot=normal["slot"],
            yoke=normal["yoke"],
            guide_couple=couple,
            wall_couple=couple if plain else zero,
            crank_pin=pins[1, 2],
            crosshead_pin=pins[2, 3] if slider else np.zeros_like(pins[2, 3]),
            bearing=pins[0, 1],
            torque=torque,
            driving=torque * self.speed,
            gas_power=gas * motion.piston.first * self.speed,
            friction_power=lost,
            kinetic_power=kinetic,
            weight_power=weights,
            held=self.friction.slot * np.abs(normal["slot"]) if stands else zero,
        )

    def _sliding(self, first: Array) -> Array:
        """Speed of a contact times the part of its friction that the smooth law leaves, from its rate by the angle."""
        return np.asarray(first * self.speed * np.tanh(first * self.speed / self.friction.smoothing_velocity))

    def _powers(self, phi: Array) -> tuple[Array, Array]:
        """Power into kinetic energy, and that of the weights."""
        motion, w, a = self.mechanism.run(phi), self.speed, self.acceleration
        kinetic = weights = np.zeros(len(phi))
        for link, body in self.dynamic_model().bodies.items():
            path = motion.point(link, body.centre)
            turn, second = motion.velocities[:, link, 2], motion.accelerations[:, link, 2]
            velocity, acceleration = path.velocity * w, path.acceleration * w**2 + path.velocity * a
            kinetic = kinetic + body.mass * (velocity * acceleration).sum(axis=1)
            kinetic = kinetic + body.inertia * turn * w * (second * w**2 + turn * a)
            weights = weights + body.mass * velocity @ np.array(self.gravity)
        return kinetic, weights
