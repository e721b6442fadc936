"""``module = "platform_drive"``: a DC motor with speed control that moves a platform, with and without inertia."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from graphsynth.evidence.rows import Plan, plans
from graphsynth.pipeline.system import Stage, System
from graphsynth.pipeline.tables import In, require

_Positive = "each must be positive"
_Friction = Annotated[float, In("N m s/rad")]
_Inertia = Annotated[float, In("kg m^2")]
_Resistances = Annotated[tuple[float, ...], In("ohm")]
_Samples = Annotated[int, In(least=20, most=100_000, why="use 20 to 100000 output times")]
_Second = Annotated[float, In("s", above=0)]


@dataclass(frozen=True, slots=True)
class DCMotorTable:
    """Independent excitation, speed control ``U = gain (speed - motor speed)``; the resistances stand apart."""

    inductance: Annotated[float, In("H")]
    torque_constant: Annotated[float, In("N m/A")]
    emf_constant: Annotated[float, In("V s/rad")]
    gain: Annotated[float, In("V s/rad")]
    speed: Annotated[float, In("rad/s")]
    rotor_inertia: _Inertia = 0.0
    friction: _Friction = 0.0
    voltage_limit: Annotated[float | None, In("V")] = None


@dataclass(frozen=True, slots=True)
class MovedTable:
    """Platform that moves as ``amplitude * sin(crank angle)``; constant inertia J_0, friction and load at the crank."""

    mass: Annotated[float, In("kg")]
    amplitude: Annotated[float, In("mm")]
    inertia: _Inertia = 0.0
    friction: _Friction = 0.0
    load: Annotated[float, In("Nm")] = 0.0


@dataclass(frozen=True, slots=True)
class WithoutInertiaTable:
    """The model of the source without rotor inertia, regularised, and the model with J_0 that tends to it."""

    resistance: Annotated[float, In("ohm")] = 10.0
    inductance: Annotated[float, In("H")] = 1.0
    start_speed: Annotated[float, In("rad/s")] = 1.0
    end: _Second = 0.5
    inertias: Annotated[tuple[float, ...], In("kg m^2", above=0, why=_Positive)] = (1e-4, 1e-6, 1e-8)


@dataclass(frozen=True, slots=True)
class ClaimTable:
    """Does a larger armature resistance calm the machine?  Pairs [inductance, demanded speed], and a map."""

    resistances: _Resistances = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
    cases: Annotated[tuple[tuple[float, float], ...], In(above=0, why=_Positive)] = (
        (0.2, 20.0),
        (0.05, 20.0),
        (0.01, 20.0),
        (0.01, 60.0),
    )
    map_resistances: Annotated[int, In(least=2, most=200)] = 9
    map_inductances: Annotated[tuple[float, ...], In("H", above=0, why=_Positive)] = (
        *(0.005, 0.01, 0.02, 0.05, 0.1),
        *(0.15, 0.2, 0.3, 0.5, 0.8),
    )
    revolutions: int = 40

    def __post_init__(self) -> None:
        given = self.resistances
        require(
            len(given) >= 2 and given[0] > 0 and list(given) == sorted(set(given)),
            f"has resistances_ohm = {list(given)}; give at least two positive ones in increasing order",
        )


@dataclass(frozen=True, slots=True)
class LimitTable:
    """Inductances that are compared with the limit L -> 0 over a time."""

    inductances: Annotated[tuple[float, ...], In("H")] = (1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10, 1e-12)
    resistance: Annotated[float, In("ohm")] = 1.0
    end: Annotated[float, In("s")] = 0.05


@dataclass(frozen=True, slots=True)
class PlatformDriveTable:
    """``[mechanism]`` with ``module = "platform_drive"``."""

    module: Literal["platform_drive"]
    motor: DCMotorTable
    platform: MovedTable
    resistances: _Resistances = (5.0, 20.0)
    end: _Second = 2.0
    samples: _Samples = 1001
    tolerance: float = 1e-11
    without_inertia: WithoutInertiaTable = field(default_factory=WithoutInertiaTable)
    claim: ClaimTable = field(default_factory=ClaimTable)
    limit: LimitTable = field(default_factory=LimitTable)

    def __post_init__(self) -> None:
        _check_resistances(self.resistances)


@dataclass(frozen=True, slots=True)
class MachineDriveTable:
    """``[mechanism.drive]`` of ``module = "single_motor_platform"``: the motor and the masses of the real machine.

    Efficiency is that of the gears; friction and load are at the crank; inertias of the pinion and of each wheel are
    about their own axes.
    """

    motor: DCMotorTable
    mass: Annotated[float, In("kg")]
    gyration: Annotated[float, In("mm")]
    mass_centre: Annotated[tuple[float, float], In("mm")] = (0.0, 0.0)
    wheel_inertia: _Inertia = 0.0
    pinion_inertia: _Inertia = 0.0
    efficiency: float = 1.0
    friction: _Friction = 0.0
    load: Annotated[float, In("Nm")] = 0.0
    resistances: _Resistances = (5.0, 20.0)
    end: _Second = 2.0
    samples: _Samples = 1001
    tolerance: float = 1e-11

    def __post_init__(self) -> None:
        _check_resistances(self.resistances)


def _check_resistances(resistances: tuple[float, ...]) -> None:
    require(1 <= len(resistances) <= 4, f"has {len(resistances)} resistances_ohm; give one to four, in ohm")


_HERE = "graphsynth.systems.platform"
_STEPS = f"{_HERE}.motor_stages"
SYSTEM = System(
    table=PlatformDriveTable,
    cases=("platform-14.8", *(f"platform-12.{k}" for k in range(24, 31))),
    structure="none",
    stages=(
        Stage("drive", f"{_STEPS}:drive", (), ("runs",)),
        Stage("without inertia", f"{_STEPS}:without_inertia", (), ("without_inertia",)),
        Stage("resistance", f"{_STEPS}:claim", (), ("claim",)),
        Stage("inductance", f"{_STEPS}:limit", (), ("limit",)),
        Stage("assess", f"{_STEPS}:assess", ("runs", "without_inertia", "claim", "limit"), ("records", "tables")),
        Stage("sketch mechanism", f"{_STEPS}_pictures:sketches", (), ("mechanism_pictures",)),
        Stage("animate", f"{_STEPS}_pictures:animations", ("runs",), ("animations",)),
        Stage("plot", f"{_STEPS}_pictures:plots", ("runs", "without_inertia", "claim", "limit"), ("plots",)),
        Stage("compare solvers", f"{_STEPS}:solvers", (), ("solvers",)),
    ),
    evidence=(Plan("drive", f"{_HERE}.evidence:motor_drive"), *plans(f"{_HERE}.evidence", "small-inductance")),
)
