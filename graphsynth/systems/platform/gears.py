"""One pinion and three equal wheels at 120 degrees: ratio, tooth orientation, keying, collision."""

from __future__ import annotations

import math
from dataclasses import dataclass

from graphsynth.core.checks import positive
from graphsynth.core.errors import GeometryError

__all__ = ["GearTrain"]


@dataclass(frozen=True)
class GearTrain:
    """Pinion with ``z1`` teeth on the motor shaft, three wheels with ``z2`` teeth around it.

    Source: theory/platform-drive 2.

    Raises
    ------
    GeometryError
        Numbers of teeth that are not positive integers.

    Examples
    --------
    >>> train = GearTrain(30, 60)
    >>> train.ratio, train.same_in_fixed_frame, train.same_in_leg_frame
    (-0.5, True, True)
    """

    z1: int = 30
    z2: int = 60

    def __post_init__(self) -> None:
        for name in ("z1", "z2"):
            teeth = getattr(self, name)
            if not isinstance(teeth, int) or teeth < 1:
                raise GeometryError(f"{name} = {teeth!r} is not a number of teeth; give a positive integer")

    @property
    def ratio(self) -> float:
        """Wheel speed over motor speed, negative for an external mesh."""
        return -self.z1 / self.z2

    @property
    def same_in_fixed_frame(self) -> bool:
        """The three wheels can carry the same tooth orientation in the fixed frame (exact)."""
        return (self.z1 + self.z2) % 3 == 0

    @property
    def same_in_leg_frame(self) -> bool:
        """The three wheels can carry the same tooth orientation relative to their own leg (exact)."""
        return self.z1 % 3 == 0

    @property
    def keying_step(self) -> float:
        """Step of the wheel angles that mounting alone offers, radians."""
        return math.tau / self.z2

    def wheel_angle(self, direction: float, pinion: float = 0.0) -> float:
        """Return a tooth angle chi_k that meshes, in [0, 2 pi / z2); the others follow in steps of `keying_step`.

        ``direction`` is the angle of the wheel axis seen from the pinion, ``pinion`` the angle of a pinion tooth
        centre, both in radians.
        """
        turns = self.z1 * (direction - pinion) / math.tau + self.z2 * (direction + math.pi) / math.tau - 0.5
        return (turns % 1.0) * self.keying_step

    def wheels_clear(self, module: float = 1.0, addendum: float = 0.0) -> bool:
        """Tell whether neighbouring wheels stay apart, with ``addendum`` added to their pitch radii for ``module``."""
        module = positive("module", module)
        addendum = positive("addendum", addendum, zero=True)
        centre = 0.5 * module * (self.z1 + self.z2)
        return math.sqrt(3.0) * centre > 2.0 * (0.5 * module * self.z2 + addendum)
