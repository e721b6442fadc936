"""Side load on the cylinder of a crank drive with and without a floating piston: inverse dynamics in closed form.

Every reaction follows from the balance of one body after the other, without any system larger than two by two.
Signs of normal forces are guessed and checked, so Coulomb friction needs no iteration.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import Point, check_fields, check_sizes, finite, finite_array, point
from graphsynth.core.errors import GeometryError
from graphsynth.systems.piston.drives import CrankSlider
from graphsynth.systems.piston.gas import CompressorCycle, ConstantForce, GasLaw, GivenForce
from graphsynth.systems.piston.loads import PistonFriction, PistonLoads, PistonMasses
from graphsynth.systems.piston.model import FloatingPiston, PistonMotion
from graphsynth.systems.piston.solving import Reaction, cross, one_contact, two_contacts, wedge

Array = NDArray[np.float64]
Complex = NDArray[np.complexfloating[Any, Any]]


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
    >>> round(machine.without_group().loads(np.pi / 2).wall.item(), 3), machine.loads(np.pi / 2).wall.round(12) + 0.0
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

    def loads(self, angle: ArrayLike) -> PistonLoads:
        """Find all reactions at crank angles.

        Parameters
        ----------
        angle : array_like
            Radians; a scalar gives arrays of length 1.

        Returns
        -------
        PistonLoads
            NaN where friction leaves no or several solutions: the machine jams there, or may.

        Raises
        ------
        GeometryError
            Angles that are not one list of numbers.
        """
        given = np.atleast_1d(finite_array("angle", angle, nan=True))
        if given.ndim != 1:
            raise GeometryError(f"angle has shape {given.shape}; give one list of crank angles")
        motion = self.mechanism.motion(given)
        return _Balance(self, motion).loads()


class _Balance:
    """Balance of piston, crosshead, follower and crank, one after the other."""

    def __init__(self, machine: PistonMachine, motion: PistonMotion) -> None:
        self.machine, self.motion = machine, motion
        drive, group = machine.mechanism.drive, machine.mechanism.group
        w, a = machine.speed, machine.acceleration
        self.weight = complex(*machine.gravity)

        def rates(of: tuple[Array, Array, Array]) -> tuple[Array, Array]:
            return of[1] * w, of[2] * w**2 + of[1] * a

        phi = motion.angle
        self.turning = np.exp(1j * phi)
        self.pin = drive.crank * self.turning  # of the crank
        self.pin_rates = 1j * w * self.pin, (1j * a - w**2) * self.pin
        self.at = motion.crosshead.value + 1j * drive.offset
        self.crosshead, self.follower = rates(motion.crosshead), rates(motion.follower)
        self.piston, self.slot = rates(motion.piston), rates(motion.slot)
        self.cylinder = complex(1.0) if group is None else complex(np.exp(1j * group.cylinder_angle))
        self.gas = machine.gas_force(phi)

    def _mu(self, name: str, speed: Array) -> Array:
        friction = self.machine.friction
        return np.asarray(getattr(friction, name) * np.tanh(speed / friction.smoothing_velocity))

    def _own_forces(self) -> Complex:
        """Force that gas and rings put on the piston."""
        return -self.cylinder * (self.gas + self._mu("rings", self.piston[0]))

    def loads(self) -> PistonLoads:
        """Assemble everything."""
        zero = np.zeros(len(self.motion.angle))
        slot, wall = Reaction.none(zero), Reaction.none(zero)
        if self.machine.mechanism.group is not None:
            slot, wall = self._piston()
        pin, guide, yoke = self._crosshead(slot.force)
        if self.machine.mechanism.group is None:
            wall = guide
        crank_pin, bearing, torque = self._crank(pin)
        arm = self._slot_place() - self.at
        guide_couple = cross(arm, slot.force) - cross(self.pin - self.at, yoke.force)
        plain = self.machine.mechanism.group is None
        friction = guide.loss + slot.loss + yoke.loss + (0.0 if plain else wall.loss)
        friction = friction + self._mu("rings", self.piston[0]) * self.piston[0]
        return PistonLoads(
            angle=self.motion.angle, gas=self.gas, wall=wall.normal, guide=guide.normal, slot=slot.normal,
            yoke=yoke.normal, guide_couple=guide_couple, wall_couple=guide_couple if plain else zero.copy(),
            crank_pin=_pairs(crank_pin), crosshead_pin=_pairs(pin if self._is_slider else zero + 0j),
            bearing=_pairs(bearing), torque=torque, driving=torque * self.machine.speed,
            gas_power=self.gas * self.piston[0], friction_power=friction, kinetic_power=self._kinetic_power(),
            weight_power=self._weight_power(), held=self._held(slot),
        )  # fmt: skip

    @property
    def _is_slider(self) -> bool:
        return isinstance(self.machine.mechanism.drive, CrankSlider)

    def _slot_place(self) -> Complex:
        """Where the piston's reference point is."""
        group = self.machine.mechanism.group
        if group is None:
            return self.at
        base = 1j * (self.machine.mechanism.drive.offset + group.cylinder_offset)
        return base + self.motion.piston.value * self.cylinder

    def _piston(self) -> tuple[Reaction, Reaction]:
        """Slot on piston, cylinder on piston: ``slot + wall = m a - other forces``."""
        group = self.machine.mechanism.group
        assert group is not None
        wanted = self.machine.masses.piston * (self.piston[1] * self.cylinder - self.weight) - self._own_forces()
        along = complex(np.exp(1j * group.slot_angle))
        return two_contacts(
            wanted,
            wedge(along, self._mu("slot", self.slot[0]), self.slot[0]),
            wedge(self.cylinder, self._mu("cylinder", self.piston[0]), self.piston[0]),
        )

    def _crosshead(self, slot: Complex) -> tuple[Complex, Reaction, Reaction]:
        """Force of the follower on the crosshead, guide on crosshead, block on yoke."""
        machine = self.machine
        plain = machine.mechanism.group is None
        wanted = machine.masses.crosshead * (self.crosshead[1] - self.weight) + slot
        wanted = wanted - (self._own_forces() if plain else 0.0)
        name = "cylinder" if plain else "guide"
        guide_wedge = wedge(1.0 + 0j, self._mu(name, self.crosshead[0]), self.crosshead[0])
        drive = machine.mechanism.drive
        zero = np.zeros(len(self.motion.angle))
        if isinstance(drive, CrankSlider):
            rod = np.exp(1j * self.motion.follower.value)
            guide = one_contact(cross(rod, wanted) - self._rod_moment() / drive.rod, rod, guide_wedge)
            return wanted - guide.force, guide, Reaction.none(zero)
        along = complex(np.exp(1j * drive.yoke_angle))
        # the yoke slides against the block with the opposite speed
        yoke, guide = two_contacts(
            wanted, wedge(along, self._mu("yoke", -self.follower[0]), -self.follower[0]), guide_wedge
        )
        return yoke.force, guide, yoke

    def _rod_motion(self) -> tuple[Complex, Complex, Complex]:
        """Lever from crank pin to the rod's centre of mass, velocity and acceleration of the latter."""
        lever = self.machine.masses.rod_centre * np.exp(1j * self.motion.follower.value)
        w, a = self.follower
        return lever, self.pin_rates[0] + 1j * w * lever, self.pin_rates[1] + (1j * a - w**2) * lever

    def _rod_moment(self) -> Array:
        """Moment about the crank pin that the force of the rod on the crosshead must have, N m."""
        masses = self.machine.masses
        lever, _, acceleration = self._rod_motion()
        moment = cross(lever, masses.follower * (self.weight - acceleration))
        return np.asarray(moment - masses.rod_inertia * self.follower[1])

    def _crank(self, pin: Complex) -> tuple[Complex, Complex, Array]:
        """Force of crank on follower, of frame on crank, torque of the motor."""
        machine = self.machine
        masses = machine.masses
        acceleration = self._rod_motion()[2] if self._is_slider else self.pin_rates[1]
        crank_pin = masses.follower * (acceleration - self.weight) + pin
        lever = masses.crank_centre * self.turning
        own = (1j * machine.acceleration - machine.speed**2) * lever
        inertia = masses.crank_inertia + masses.crank * masses.crank_centre**2
        torque = inertia * machine.acceleration + cross(self.pin, crank_pin) - cross(lever, masses.crank * self.weight)
        return crank_pin, masses.crank * (own - self.weight) + crank_pin, np.asarray(torque)

    def _centres(self) -> list[tuple[float, Complex, Complex]]:
        """Mass, velocity and acceleration of every centre of mass."""
        machine = self.machine
        masses = machine.masses
        lever = masses.crank_centre * self.turning
        w, a = machine.speed, machine.acceleration
        follower = self._rod_motion()[1:] if self._is_slider else self.pin_rates
        return [
            (masses.crank, 1j * w * lever, (1j * a - w**2) * lever),
            (masses.follower, *follower),
            (masses.crosshead, self.crosshead[0] + 0j, self.crosshead[1] + 0j),
            (masses.piston, self.piston[0] * self.cylinder, self.piston[1] * self.cylinder),
        ]

    def _kinetic_power(self) -> Array:
        machine = self.machine
        turning = np.full(len(self.motion.angle), machine.masses.crank_inertia * machine.acceleration * machine.speed)
        if self._is_slider:
            turning = turning + machine.masses.rod_inertia * self.follower[0] * self.follower[1]
        return np.asarray(turning + sum(m * (np.conj(v) * a).real for m, v, a in self._centres()))

    def _weight_power(self) -> Array:
        return np.asarray(sum(m * (np.conj(v) * self.weight).real for m, v, _ in self._centres()))

    def _held(self, slot: Reaction) -> Array:
        group = self.machine.mechanism.group
        if group is None or math.sin(group.cylinder_angle) != 0.0:
            return np.zeros(len(self.motion.angle))
        return np.asarray(self.machine.friction.slot * np.abs(slot.normal))


def _pairs(values: Complex) -> Array:
    return np.column_stack([values.real, values.imag])
