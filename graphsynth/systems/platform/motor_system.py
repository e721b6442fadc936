"""``module = "platform_drive"``: a DC motor with speed control that moves a platform, with and without inertia."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

from graphsynth.evidence.registry import plans
from graphsynth.pipeline.stages import Stage
from graphsynth.pipeline.system import System
from graphsynth.pipeline.tables import require

__all__ = [
    "SYSTEM",
    "ClaimTable",
    "DCMotorTable",
    "LimitTable",
    "MachineDriveTable",
    "PlatformDriveTable",
    "WithoutInertiaTable",
]


@dataclass(frozen=True, slots=True)
class DCMotorTable:
    """Independent excitation, speed control ``U = gain (speed - motor speed)``; the resistances stand apart."""

    inductance_H: float
    torque_constant_Nm_per_A: float
    emf_constant_V_per_rad_s: float
    gain_V_per_rad_s: float
    speed_rad_s: float
    rotor_inertia_kg_m2: float = 0.0
    friction_Nm_s_per_rad: float = 0.0
    voltage_limit_V: float | None = None


@dataclass(frozen=True, slots=True)
class MovedTable:
    """Platform that moves as ``amplitude * sin(crank angle)``; constant inertia J_0, friction and load at the crank."""

    mass_kg: float
    amplitude_mm: float
    inertia_kg_m2: float = 0.0
    friction_Nm_s_per_rad: float = 0.0
    load_Nm: float = 0.0


@dataclass(frozen=True, slots=True)
class WithoutInertiaTable:
    """The model of the source without rotor inertia, regularised, and the model with J_0 that tends to it."""

    resistance_ohm: float = 10.0
    inductance_H: float = 1.0
    start_speed_rad_s: float = 1.0
    end_s: float = 0.5
    inertias_kg_m2: tuple[float, ...] = (1e-4, 1e-6, 1e-8)

    def __post_init__(self) -> None:
        require(self.end_s > 0, f"has end_s = {self.end_s}; it must be positive")
        require(all(x > 0 for x in self.inertias_kg_m2), "has an inertias_kg_m2 that is not positive; each must be")


@dataclass(frozen=True, slots=True)
class ClaimTable:
    """Does a larger armature resistance calm the machine?  Pairs [inductance, demanded speed], and a map."""

    resistances_ohm: tuple[float, ...] = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
    cases: tuple[tuple[float, float], ...] = ((0.2, 20.0), (0.05, 20.0), (0.01, 20.0), (0.01, 60.0))
    map_resistances: int = 9
    map_inductances_H: tuple[float, ...] = (0.005, 0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 0.8)
    revolutions: int = 40

    def __post_init__(self) -> None:
        given = self.resistances_ohm
        require(
            len(given) >= 2 and given[0] > 0 and list(given) == sorted(set(given)),
            f"has resistances_ohm = {list(given)}; give at least two positive ones in increasing order",
        )
        require(2 <= self.map_resistances <= 200, f"has map_resistances = {self.map_resistances}; use 2 to 200")
        require(
            all(x > 0 for pair in self.cases for x in pair), f"has cases = {list(self.cases)}; all must be positive"
        )
        require(
            all(x > 0 for x in self.map_inductances_H), "has a map_inductances_H that is not positive; each must be"
        )


@dataclass(frozen=True, slots=True)
class LimitTable:
    """Inductances that are compared with the limit L -> 0 over a time."""

    inductances_H: tuple[float, ...] = (1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10, 1e-12)
    resistance_ohm: float = 1.0
    end_s: float = 0.05


@dataclass(frozen=True, slots=True)
class PlatformDriveTable:
    """``[mechanism]`` with ``module = "platform_drive"``."""

    module: Literal["platform_drive"]
    motor: DCMotorTable
    platform: MovedTable
    resistances_ohm: tuple[float, ...] = (5.0, 20.0)
    end_s: float = 2.0
    samples: int = 1001
    tolerance: float = 1e-11
    without_inertia: WithoutInertiaTable = field(default_factory=WithoutInertiaTable)
    claim: ClaimTable = field(default_factory=ClaimTable)
    limit: LimitTable = field(default_factory=LimitTable)

    def __post_init__(self) -> None:
        _check_runs(self.resistances_ohm, self.end_s, self.samples)


@dataclass(frozen=True, slots=True)
class MachineDriveTable:
    """``[mechanism.drive]`` of ``module = "single_motor_platform"``: the motor and the masses of the real machine.

    Efficiency is that of the gears; friction and load are at the crank; inertias of the pinion and of each wheel are
    about their own axes.
    """

    motor: DCMotorTable
    mass_kg: float
    gyration_mm: float
    mass_centre_mm: tuple[float, float] = (0.0, 0.0)
    wheel_inertia_kg_m2: float = 0.0
    pinion_inertia_kg_m2: float = 0.0
    efficiency: float = 1.0
    friction_Nm_s_per_rad: float = 0.0
    load_Nm: float = 0.0
    resistances_ohm: tuple[float, ...] = (5.0, 20.0)
    end_s: float = 2.0
    samples: int = 1001
    tolerance: float = 1e-11

    def __post_init__(self) -> None:
        _check_runs(self.resistances_ohm, self.end_s, self.samples)


def _check_runs(resistances: tuple[float, ...], end: float, samples: int) -> None:
    require(1 <= len(resistances) <= 4, f"has {len(resistances)} resistances_ohm; give one to four, in ohm")
    require(math.isfinite(end) and end > 0, f"has end_s = {end}; it must be positive")
    require(20 <= samples <= 100_000, f"has samples = {samples}; use 20 to 100000 output times")


_STEPS = "graphsynth.systems.platform.motor_stages"
SYSTEM = System(
    table=PlatformDriveTable,
    structure="none",
    stages=(
        Stage("drive", f"{_STEPS}:drive", (), ("runs",)),
        Stage("without inertia", f"{_STEPS}:without_inertia", (), ("without_inertia",)),
        Stage("resistance", f"{_STEPS}:claim", (), ("claim",)),
        Stage("inductance", f"{_STEPS}:limit", (), ("limit",)),
        Stage("judge", f"{_STEPS}_tables:judge", ("runs", "without_inertia", "claim", "limit"), ("records", "tables")),
        Stage("sketch mechanism", f"{_STEPS}_pictures:sketches", (), ("mechanism_pictures",)),
        Stage("animate", f"{_STEPS}_pictures:animations", ("runs",), ("animations",)),
        Stage("plot", f"{_STEPS}_pictures:plots", ("runs", "without_inertia", "claim", "limit"), ("plots",)),
        Stage("compare solvers", f"{_STEPS}:solvers", (), ("solvers",)),
    ),
    evidence=plans("graphsynth.systems.platform.evidence_motor", "drive", "small-inductance"),
)
