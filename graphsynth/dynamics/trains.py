"""Gear and belt trains between motor and mechanism: ratio, inertia, efficiency by the direction of the power flow."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from graphsynth.core.checks import check_fields
from graphsynth.core.errors import SpecError
from graphsynth.dynamics.motors import number, whole


@dataclass(frozen=True)
class Train:
    """Train with constant ratio.

    Parameters
    ----------
    ratio : float
        Motor turns per turn of the output shaft, positive (the sense of rotation is absorbed).
    efficiency : float
        In (0, 1].  When the motor drives, the output torque is ``ratio * efficiency * torque``; when the mechanism
        drives the motor, ``ratio * torque / efficiency``.
    inertia : float
        Of the train itself, reduced to the output shaft, kg m^2.

    Raises
    ------
    SpecError
        Ratio not positive, efficiency outside (0, 1], negative inertia.

    Examples
    --------
    >>> train = Train.of_teeth([(10, 44), (10, 33), (20, 80)])
    >>> round(train.ratio, 12), round(train.reflected(8.2e-6), 8)
    (58.08, 0.02766095)
    """

    ratio: float = 1.0
    efficiency: float = 1.0
    inertia: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "ratio", number("ratio", self.ratio, least=0.0, above=True))
        object.__setattr__(self, "efficiency", number("efficiency", self.efficiency, least=0.0, above=True))
        object.__setattr__(self, "inertia", number("inertia of the train", self.inertia, least=0.0))
        check_fields(self, ("ratio", "efficiency"), SpecError, small=("inertia",))
        if self.efficiency > 1.0:
            raise SpecError(f"efficiency = {self.efficiency:g} must be at most 1; give a fraction, not a percentage")

    @classmethod
    def of_teeth(
        cls, stages: Sequence[tuple[int, int]], efficiency: Sequence[float] = (), inertia: float = 0.0
    ) -> Train:
        """Train of stages (driving teeth, driven teeth), with the efficiency of each stage (1 by default).

        Raises
        ------
        SpecError
            For a stage that is not a pair of numbers of teeth, or another number of efficiencies.
        """
        if not isinstance(stages, Sequence) or not isinstance(efficiency, Sequence):
            raise SpecError(f"stages = {stages!r}, efficiency = {efficiency!r}: give lists, one entry for each stage")
        for stage in stages:
            if not isinstance(stage, Sequence) or len(stage) != 2:
                raise SpecError(f"stage {stage!r} of the train must be a pair; give (driving teeth, driven teeth)")
            for teeth in stage:
                whole("teeth", teeth, "give (driving, driven)")
        if efficiency and len(efficiency) != len(stages):
            raise SpecError(f"{len(efficiency)} efficiencies for {len(stages)} stages; give one for each stage")
        parts = [number("efficiency of a stage", part, least=0.0, above=True) for part in efficiency]
        driven_teeth, driving_teeth = math.prod(s[1] for s in stages), math.prod(s[0] for s in stages)
        return cls(driven_teeth / driving_teeth, math.prod(parts), inertia)

    def output_torque(self, torque: float, speed: float) -> float:
        """Torque at the output for a motor torque (N m) at a motor speed (rad/s): the sign of the power decides."""
        torque, speed = number("torque", torque), number("speed", speed)
        eta = self.efficiency if torque * speed >= 0.0 else 1.0 / self.efficiency
        return self.ratio * eta * torque

    def reflected(self, inertia: float) -> float:
        """Inertia at the output of a rotor inertia at the motor, plus the train's own, kg m^2."""
        return self.ratio**2 * number("inertia", inertia) + self.inertia
