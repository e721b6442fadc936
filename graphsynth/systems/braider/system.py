"""``module = "braider"``: a synchronous motor that drives a four-bar with a switch through a train."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from graphsynth.evidence.rows import plans
from graphsynth.pipeline.system import Stage, System
from graphsynth.pipeline.tables import In, Positions, require

Length = Annotated[float, In("mm", above=0, why="a length must be positive")]
Mass = Annotated[float, In("g")]
Seconds = Annotated[float, In("s", above=0)]
Speed = Annotated[float, In("rad/s")]


@dataclass(frozen=True, slots=True)
class LinkageTable:
    """Crank O1A, coupler AB, rocker BO2, frame O1O2; +1: B on the left of the line from A to O2."""

    crank: Length
    coupler: Length
    rocker: Length
    frame: Length
    branch: Literal[1, -1] = 1


@dataclass(frozen=True, slots=True)
class SwitchTable:
    """Length O2C of the switch, rigid with the rocker, and the angle from rocker to switch."""

    length: Annotated[float, In("mm")]
    angle: Annotated[float, In("deg")]


@dataclass(frozen=True, slots=True)
class MassTable:
    """Masses of the four uniform bars."""

    crank: Mass
    coupler: Mass
    rocker: Mass
    switch: Mass


@dataclass(frozen=True, slots=True)
class ThreadTable:
    """Weight that tightens the thread, the guide point in the plane, its height above the plane."""

    weight: Mass
    guide: Annotated[tuple[float, float], In("mm")]
    height: Annotated[float, In("mm")]
    gravity: Annotated[float, In("m/s^2")] = 9.80665


@dataclass(frozen=True, slots=True)
class TrainTable:
    """Stages [driving teeth, driven teeth] from the motor to the crank; efficiencies, one for each stage."""

    stages: tuple[tuple[int, int], ...]
    efficiency: tuple[float, ...] = ()
    inertia: Annotated[float, In("kg m^2")] = 0.0


@dataclass(frozen=True, slots=True)
class MotorTable:
    """Permanent-magnet synchronous motor in the rotor frame; the voltages step to their values at t = 0."""

    pole_pairs: int
    resistance_ohm: float
    inductance_H: float
    flux_V_s: float
    ud_V: float
    uq_V: float
    rotor_inertia: Annotated[float, In("kg m^2")] = 0.0
    friction_Nm_s_per_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class StartTable:
    """Start-up from rest: its length, the speed that is to be reached and its band, the tolerance of the integrator."""

    end: Seconds = 0.5
    target: Annotated[float, In("rad/s", above=0)] = 1.803
    band: Annotated[float, In(above=0)] = 0.02
    samples: Annotated[int, In(least=20, most=100_000, why="use 20 to 100000 output times")] = 501
    tolerance: float = 1e-11


@dataclass(frozen=True, slots=True)
class BraiderTable:
    """``[mechanism]`` with ``module = "braider"``.

    ``speed_rad_s`` turns the crank evenly for the sensors over a turn; ``inductances_H`` are compared with L -> 0.
    """

    module: Literal["braider"]
    linkage: LinkageTable
    switch: SwitchTable
    masses: MassTable
    thread: ThreadTable
    train: TrainTable
    motor: MotorTable
    start: StartTable = field(default_factory=StartTable)
    speed: Speed = 1.803
    positions: Positions = 360
    inductances_H: tuple[float, ...] = (1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10, 1e-12)

    def __post_init__(self) -> None:
        require(self.speed != 0, "has speed = 0; give the speed of the crank for the sensors")
        require(all(x > 0 for x in self.inductances_H), "has an inductances_H that is not positive; each must be")


_HERE = "graphsynth.systems.braider"
SYSTEM = System(
    table=BraiderTable,
    cases=("instruments-9.16", "instruments-9.17"),
    structure="none",
    build=f"{_HERE}.stages:braider_of",
    stages=(
        Stage("start up", f"{_HERE}.stages:start_up", (), ("start_up",)),
        Stage("sensors", f"{_HERE}.stages:sensors", (), ("sensors",)),
        Stage("inductance", f"{_HERE}.stages:inductance", (), ("inductance",)),
        Stage("assess", f"{_HERE}.stages:assess", ("start_up", "sensors", "inductance"), ("records", "tables")),
        Stage("sketch mechanism", f"{_HERE}.stages:sketches", (), ("mechanism_pictures",)),
        Stage("animate", f"{_HERE}.stages:animations", (), ("animations",)),
        Stage("plot", f"{_HERE}.stages:plots", ("start_up", "sensors", "inductance"), ("plots",)),
        Stage("compare solvers", f"{_HERE}.stages:solvers", (), ("solvers",)),
    ),
    evidence=plans(f"{_HERE}.evidence", "start-up", "linkage-dynamics", "positions"),
)
