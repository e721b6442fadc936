"""Data of a crank drive with a piston: masses, friction, and the loads found."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import check_fields, finite, positive
from graphsynth.dynamics.elements import not_negative

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PistonMasses:
    """Masses (kg) and moments of inertia about the centres of mass (kg m^2).

    ``crank_centre`` and ``rod_centre`` are the distances of the centres of mass from the crank's bearing and from the
    crank pin, m.  The centre of a yoke's block lies in its pin, those of crosshead and piston in their reference
    points.
    """

    crank: float = 0.0
    follower: float = 0.0
    crosshead: float = 0.0
    piston: float = 0.0
    crank_inertia: float = 0.0
    rod_inertia: float = 0.0
    crank_centre: float = 0.0
    rod_centre: float = 0.0

    def __post_init__(self) -> None:
        for name in ("crank", "follower", "crosshead", "piston", "crank_inertia", "rod_inertia"):
            object.__setattr__(self, name, not_negative(f"mass or inertia {name}", getattr(self, name)))
        for name in ("crank_centre", "rod_centre"):
            object.__setattr__(self, name, finite(name, getattr(self, name)))
        check_fields(self, (), small=(item.name for item in fields(self)))


@dataclass(frozen=True)
class PistonFriction:
    """Coefficients of dry friction in the sliding pairs, and the friction of the rings.

    ``mu tanh(v / smoothing_velocity) |N|`` acts against the sliding, N the normal force; pins run without friction.

    Parameters
    ----------
    guide, cylinder, slot, yoke : float
        Of crosshead on guide, piston on cylinder, piston in the crosshead's slot, block in the yoke.
    rings : float
        Force of the piston rings, N, whatever the side load.
    smoothing_velocity : float
        m/s.
    """

    guide: float = 0.0
    cylinder: float = 0.0
    slot: float = 0.0
    yoke: float = 0.0
    rings: float = 0.0
    smoothing_velocity: float = 1e-3

    def __post_init__(self) -> None:
        for name in ("guide", "cylinder", "slot", "yoke", "rings"):
            object.__setattr__(self, name, not_negative(f"friction {name}", getattr(self, name)))
        object.__setattr__(self, "smoothing_velocity", positive("smoothing_velocity", self.smoothing_velocity))
        check_fields(self, ("smoothing_velocity",), small=("guide", "cylinder", "slot", "yoke", "rings"))


@dataclass(frozen=True, eq=False)
class PistonLoads:
    """Reactions and powers over the crank angle (closed form, a few roundings; NaN where friction jams).

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
        Normal force of the block on the yoke; 0 for a crank-slider.
    guide_couple, wall_couple : ndarray, shape (n,)
        With a slot that carries no couple.  One couple may circulate on top of it, see `self_stress`.
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
        """Return the forces at the two ends of a piston (or of the crosshead's shoe) that give side load and couple.

        Parameters
        ----------
        length : float
            m; the reference point is in its middle.
        of : {"wall", "guide"}
            Of the cylinder on the piston, or of the guide on the crosshead.

        Returns
        -------
        near, far : ndarray, shape (n,)
            N; ``far`` at the end towards the head.
        """
        force, couple = (self.wall, self.wall_couple) if of == "wall" else (self.guide, self.guide_couple)
        lever = couple / positive("length of the piston", length)
        return 0.5 * force - lever, 0.5 * force + lever
