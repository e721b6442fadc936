"""``module = "floating_piston"``: crank drives whose piston hangs on the crosshead in a structural group of its own."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated, Literal

from graphsynth.evidence.rows import plans
from graphsynth.pipeline.system import Stage, System
from graphsynth.pipeline.tables import In, Positions, require

Length = Annotated[float, In("mm")]
Size = Annotated[float, In("mm", above=0)]
Angle = Annotated[float, In("deg")]
Pressure = Annotated[float, In("MPa", above=0)]
Mass = Annotated[float, In("kg")]
Inertia = Annotated[float, In("kg m^2")]


@dataclass(frozen=True, slots=True)
class DriveTable:
    """The first group: crank, rod (of the slider-crank), angle of the yoke's slot, offset of the crosshead's axis."""

    crank: Size
    rod: Length = math.nan
    offset: Length = 0.0
    yoke_angle: Angle = 0.5 * math.pi


@dataclass(frozen=True, slots=True)
class GroupTable:
    """The second group: angles against the crosshead's guide, offset of the cylinder's axis, place of the slot."""

    cylinder_angle: Angle = 0.0
    slot_angle: Angle = 0.5 * math.pi
    cylinder_offset: Length = 0.0
    lead: Length = 0.0


@dataclass(frozen=True, slots=True)
class GasTable:
    """An ideal compressor: bore, absolute pressures, clearance over the stroke, polytropic exponent."""

    bore: Size
    suction: Pressure
    discharge: Pressure
    back: Annotated[float | None, In("MPa")] = None
    clearance: Annotated[float, In(above=0)] = 0.05
    exponent: Annotated[float, In(above=0)] = 1.3


@dataclass(frozen=True, slots=True)
class MassTable:
    """Masses, moments of inertia about the centres of mass, distances of these from crank bearing and crank pin."""

    crank: Mass = 0.0
    follower: Mass = 0.0
    crosshead: Mass = 0.0
    piston: Mass = 0.0
    crank_inertia: Inertia = 0.0
    rod_inertia: Inertia = 0.0
    crank_centre: Length = 0.0
    rod_centre: Length = 0.0


@dataclass(frozen=True, slots=True)
class FrictionTable:
    """Coefficients of dry friction in the prismatic joints, friction of the rings, smoothing velocity."""

    guide: float = 0.0
    cylinder: float = 0.0
    slot: float = 0.0
    yoke: float = 0.0
    rings: Annotated[float, In("N")] = 0.0
    smoothing_velocity: Annotated[float, In("m/s")] = 1e-3


@dataclass(frozen=True, slots=True)
class PistonTable:
    """``[mechanism]`` with ``module = "floating_piston"``.

    Without ``[mechanism.gas]`` the constant ``force_N`` pushes the piston away from the head.
    """

    module: Literal["floating_piston"]
    drive: DriveTable
    kinds: tuple[Literal["crank_slider", "scotch_yoke"], ...] = ("crank_slider", "scotch_yoke")
    group: GroupTable = field(default_factory=GroupTable)
    gas: GasTable | None = None
    force: Annotated[float, In("N")] = 0.0
    masses: MassTable = field(default_factory=MassTable)
    friction: FrictionTable = field(default_factory=FrictionTable)
    speed: Annotated[float, In("rad/s")] = 1.0
    gravity: Annotated[tuple[float, float], In("m/s^2")] = (0.0, 0.0)
    piston_length: Annotated[float | None, In("mm", above=0)] = None
    square_errors: Annotated[tuple[float, ...], In("deg")] = tuple(map(math.radians, (0, 1, 2, 5, 10)))
    positions: Positions = 24

    def __post_init__(self) -> None:
        require(bool(self.kinds), "has no kinds; name crank_slider, scotch_yoke or both")
        require(len(set(self.kinds)) == len(self.kinds), f"has kinds that repeat in {list(self.kinds)}; remove one")
        require(self.speed != 0, "has speed = 0; a turn needs a speed")
        require(
            "crank_slider" not in self.kinds or math.isfinite(self.drive.rod),
            "has kinds with a crank_slider, but [mechanism.drive] gives no rod_mm; give its length",
        )
        require(
            self.gas is None or self.force == 0.0, "has force_N and [mechanism.gas]; the gas is one of them: remove one"
        )


_HERE = "graphsynth.systems.piston"
SYSTEM = System(
    table=PistonTable,
    structure="optional",
    stages=(
        Stage("recognise", f"{_HERE}.stages:recognise", ("candidates",), ("recognised",)),
        Stage("loops", f"{_HERE}.stages:loops", (), ("loops",)),
        Stage("turn", f"{_HERE}.stages:turn", (), ("turns",)),
        Stage("assess", f"{_HERE}.stages:assess", ("loops", "turns"), ("records", "tables")),
        Stage("sketch mechanism", f"{_HERE}.stages:sketches", (), ("mechanism_pictures",)),
        Stage("animate", f"{_HERE}.stages:animations", (), ("animations",)),
        Stage("plot", f"{_HERE}.stages:plots", (), ("plots",)),
    ),
    evidence=plans(f"{_HERE}.evidence", "positions", "loads", "work"),
)
