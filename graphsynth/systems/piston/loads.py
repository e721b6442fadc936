"""What acts on a crank drive with a piston: masses, friction, and the force of the gas.

Every law of the gas gives the force (N) that pushes the piston away from the cylinder's head.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import called, check_fields, finite, finite_array, not_negative, positive
from graphsynth.core.errors import GeometryError

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
    """Coefficients of dry friction in the prismatic joints, and the friction of the rings.

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
        names = ("guide", "cylinder", "slot", "yoke", "rings")
        for name in names:
            object.__setattr__(self, name, not_negative(f"friction {name}", getattr(self, name)))
        object.__setattr__(self, "smoothing_velocity", positive("smoothing_velocity", self.smoothing_velocity))
        check_fields(self, ("smoothing_velocity",), small=names)


class GasLaw(Protocol):
    """A law of the gas force: smooth, and of unknown work, unless it says otherwise."""

    def force(self, angle: Array, gap: Array, towards_head: NDArray[np.bool_], stroke: float) -> Array:
        """Force away from the head, N, at a distance ``gap`` (m) of the piston from its outer dead centre."""

    def kinks(self, stroke: float) -> tuple[tuple[float, bool], ...]:
        """Gaps at which the force is not smooth, and whether the piston moves towards the head there."""
        return ()

    def work(self, stroke: float) -> float:
        """Work that the gas takes from the piston over a turn, J (closed form); NaN if it is not known."""
        return float("nan")


@dataclass(frozen=True)
class ConstantForce(GasLaw):
    """A force that does not change, N; over a turn it takes no work.

    >>> ConstantForce(100.0).work(0.1)
    0.0
    """

    size: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", finite("size of the gas force", self.size))
        check_fields(self, (), small=("size",))

    def force(self, angle: Array, gap: Array, towards_head: NDArray[np.bool_], stroke: float) -> Array:
        """See :class:`GasLaw`."""
        return np.full_like(gap, self.size)

    def work(self, stroke: float) -> float:
        """See :class:`GasLaw`."""
        return 0.0


@dataclass(frozen=True)
class GivenForce(GasLaw):
    """A force given as a smooth function ``(crank angle, gap, towards the head) -> N`` of arrays.

    Raises
    ------
    GeometryError
        A law that cannot be called.
    """

    law: Callable[[Array, Array, NDArray[np.bool_]], Array]

    def __post_init__(self) -> None:
        if not callable(self.law):
            raise GeometryError(f"law = {self.law!r} of the gas force is not callable; give a function, or a force")

    def force(self, angle: Array, gap: Array, towards_head: NDArray[np.bool_], stroke: float) -> Array:
        """See :class:`GasLaw`; `GeometryError` if the function gives no finite force at every angle."""
        found = finite_array(
            "the gas force", called("the law of the gas", self.law, angle, gap, towards_head), nan=True
        )
        if found.shape not in ((), np.shape(gap)) or not np.isfinite(found).all():
            raise GeometryError("the gas force must be one finite number for every crank angle; correct the function")
        return np.broadcast_to(found, np.shape(gap)).copy()


@dataclass(frozen=True)
class CompressorCycle(GasLaw):
    """Ideal single-acting compressor: valves without losses, polytropic compression and re-expansion.

    Parameters
    ----------
    bore : float
        Diameter of the cylinder, m.
    suction, discharge : float
        Absolute pressures, Pa.
    back : float
        Absolute pressure behind the piston, Pa; the suction pressure by default.
    clearance : float
        Gap that is left at the outer dead centre, over the stroke.
    exponent : float
        Of compression and re-expansion.

    Raises
    ------
    GeometryError
        Values that are not positive; a discharge pressure below the suction pressure.

    Examples
    --------
    At the outer dead centre the discharge pressure acts, at the inner one suction and back pressure cancel.

    >>> cycle = CompressorCycle(0.1, suction=1e5, discharge=6e5)
    >>> cycle.force(np.zeros(2), np.array([0.0, 0.1]), np.array([True, True]), 0.1).round(3).tolist()
    [3926.991, 0.0]
    """

    bore: float
    suction: float
    discharge: float
    back: float | None = None
    clearance: float = 0.05
    exponent: float = 1.3

    def __post_init__(self) -> None:
        for name in ("bore", "suction", "discharge", "clearance", "exponent"):
            object.__setattr__(self, name, positive(f"{name} of the compressor", getattr(self, name)))
        back = self.suction if self.back is None else not_negative("back pressure of the compressor", self.back)
        object.__setattr__(self, "back", back)
        check_fields(self, ("bore", "suction", "discharge", "back", "clearance", "exponent"))
        if self.discharge < self.suction:
            raise GeometryError(
                f"discharge = {self.discharge:.6g} Pa is below suction = {self.suction:.6g} Pa; exchange them"
            )

    @property
    def area(self) -> float:
        """Of the piston, m^2."""
        return 0.25 * np.pi * self.bore**2

    def _top(self) -> float:
        """Pressure at the outer dead centre: the valve may never open."""
        return float(min(self.discharge, self.suction * ((1.0 + self.clearance) / self.clearance) ** self.exponent))

    def pressure(self, gap: Array, towards_head: NDArray[np.bool_], stroke: float) -> Array:
        """Absolute pressure over the piston, Pa."""
        left = np.maximum(gap, 0.0) / stroke + self.clearance  # a gap may be -1e-17 by rounding
        closing = self.suction * ((1.0 + self.clearance) / left) ** self.exponent
        opening = self._top() * (self.clearance / left) ** self.exponent
        return np.asarray(
            np.where(towards_head, np.minimum(closing, self.discharge), np.maximum(opening, self.suction))
        )

    def force(self, angle: Array, gap: Array, towards_head: NDArray[np.bool_], stroke: float) -> Array:
        """See :class:`GasLaw`."""
        assert self.back is not None
        return np.asarray((self.pressure(gap, towards_head, stroke) - self.back) * self.area)

    def kinks(self, stroke: float) -> tuple[tuple[float, bool], ...]:
        """Where the valves open."""
        delivers = (1.0 + self.clearance) * (self.suction / self.discharge) ** (1.0 / self.exponent) - self.clearance
        draws = self.clearance * ((self._top() / self.suction) ** (1.0 / self.exponent) - 1.0)
        found = ((delivers, True), (draws, False))
        return tuple((place * stroke, closing) for place, closing in found if 0.0 < place < 1.0)

    def work(self, stroke: float) -> float:
        """Return the indicated work of a turn, J: the area of the pressure-volume diagram (closed form)."""
        c, top, low = self.clearance, self._top(), self.suction
        delivers = max(0.0, (1.0 + c) * (low / self.discharge) ** (1.0 / self.exponent) - c)
        draws = min(1.0, c * ((top / low) ** (1.0 / self.exponent) - 1.0))
        compression = self._polytrope(low, 1.0 + c, delivers + c) + self.discharge * delivers
        expansion = low * (1.0 - draws) - self._polytrope(top, c, c + draws)
        return float((compression - expansion) * self.area * stroke)

    def _polytrope(self, pressure: float, start: float, stop: float) -> float:
        """Work to bring a volume of that pressure from ``start`` to ``stop``."""
        n = self.exponent
        if n == 1.0:
            return float(pressure * start * np.log(start / stop))
        return float(pressure * start * ((start / stop) ** (n - 1.0) - 1.0) / (n - 1.0))
