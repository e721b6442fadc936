"""The second group: one link on two sliding pairs, a structural group of a space of mobility 2."""

from __future__ import annotations

import math
from dataclasses import dataclass

from graphsynth.core.checks import check_fields, finite
from graphsynth.core.errors import GeometryError

_PARALLEL = 1e-9


@dataclass(frozen=True)
class FloatingGroup:
    """A piston that slides in its cylinder and in a slot of the crosshead.

    With one link, two joints of mobility 1 and translations only its mobility is 2 * 1 - 2 (2 - 1) = 0.

    Parameters
    ----------
    cylinder_angle : float
        Direction of the cylinder, towards its head, against the crosshead's guide, radians; 0: parallel.
    slot_angle : float
        Direction of the slot against the crosshead's guide, radians; pi/2: square to it.
    cylinder_offset : float
        Distance of the cylinder's axis above the crosshead's, taken over the centre of the crank, m.
    lead : float
        Where the slot crosses the crosshead's axis, ahead of its pin, m.

    Raises
    ------
    GeometryError
        A slot that is parallel to the cylinder or to the guide, or that moves the piston backwards; a cylinder that
        is square to the guide; values that are not finite.

    Examples
    --------
    >>> FloatingGroup().transmission
    (1.0, 0.0)
    """

    cylinder_angle: float = 0.0
    slot_angle: float = 0.5 * math.pi
    cylinder_offset: float = 0.0
    lead: float = 0.0

    def __post_init__(self) -> None:
        for name in ("cylinder_angle", "slot_angle", "cylinder_offset", "lead"):
            object.__setattr__(self, name, finite(f"{name} of the floating group", getattr(self, name)))
        check_fields(self, (), small=("cylinder_offset",))
        if math.cos(self.cylinder_angle) < _PARALLEL:
            raise GeometryError(
                f"cylinder_angle = {self.cylinder_angle:.6g} rad turns the cylinder square to the crosshead's guide or "
                "beyond; keep it between -pi/2 and pi/2"
            )
        if abs(math.sin(self.slot_angle - self.cylinder_angle)) < _PARALLEL:
            raise GeometryError(
                f"slot_angle = {self.slot_angle:.6g} rad is parallel to the cylinder, so the piston has no definite "
                "place; turn the slot, best by pi/2"
            )
        if abs(math.sin(self.slot_angle)) < _PARALLEL:
            raise GeometryError(
                f"slot_angle = {self.slot_angle:.6g} rad is parallel to the crosshead's guide, so the piston stands "
                "still; turn the slot, best to pi/2"
            )
        if self.transmission[0] < 0.0:
            raise GeometryError(
                f"slot_angle = {self.slot_angle:.6g} rad lies between the directions of guide and cylinder, so the "
                "piston moves against the crosshead; turn the slot, best to pi/2"
            )

    @property
    def transmission(self) -> tuple[float, float]:
        """Displacement of the piston in the cylinder, and along the slot, for one of the crosshead."""
        across = math.sin(self.slot_angle - self.cylinder_angle)
        return math.sin(self.slot_angle) / across, math.sin(self.cylinder_angle) / across

    def place(self) -> tuple[float, float]:
        """Coordinates of the piston in the cylinder and along the slot, for a crosshead at 0."""
        across = math.sin(self.slot_angle - self.cylinder_angle)
        x, y = self.lead, -self.cylinder_offset
        return (
            (x * math.sin(self.slot_angle) - y * math.cos(self.slot_angle)) / across,
            (x * math.sin(self.cylinder_angle) - y * math.cos(self.cylinder_angle)) / across,
        )
