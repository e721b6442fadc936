"""``module = "floating_piston"``: crank drives whose piston hangs on the crosshead in a structural group of its own."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

from graphsynth.evidence.rows import plans
from graphsynth.pipeline.system import Stage, System
from graphsynth.pipeline.tables import Positions, require

Kind = Literal["crank_slider", "scotch_yoke"]


def _positive(table: object, *names: str) -> None:
    for name in names:
        value = getattr(table, name)
        require(value > 0, f"has {name} = {value}; it must be positive")


@dataclass(frozen=True, slots=True)
class DriveTable:
    """The first group: crank, rod (of the crank-slider), angle of the yoke's slot, offset of the crosshead's axis."""

    crank_mm: float
    rod_mm: float = math.nan
    offset_mm: float = 0.0
    yoke_angle_deg: float = 90.0

    def __post_init__(self) -> None:
        _positive(self, "crank_mm")


@dataclass(frozen=True, slots=True)
class GroupTable:
    """The second group: angles against the crosshead's guide, offset of the cylinder's axis, place of the slot."""

    cylinder_angle_deg: float = 0.0
    slot_angle_deg: float = 90.0
    cylinder_offset_mm: float = 0.0
    lead_mm: float = 0.0


@dataclass(frozen=True, slots=True)
class GasTable:
    """An ideal compressor: bore, absolute pressures, clearance over the stroke, polytropic exponent."""

    bore_mm: float
    suction_MPa: float
    discharge_MPa: float
    back_MPa: float | None = None
    clearance: float = 0.05
    exponent: float = 1.3

    def __post_init__(self) -> None:
        _positive(self, "bore_mm", "suction_MPa", "discharge_MPa", "clearance", "exponent")


@dataclass(frozen=True, slots=True)
class MassTable:
    """Masses, moments of inertia about the centres of mass, distances of these from crank bearing and crank pin."""

    crank_kg: float = 0.0
    follower_kg: float = 0.0
    crosshead_kg: float = 0.0
    piston_kg: float = 0.0
    crank_inertia_kg_m2: float = 0.0
    rod_inertia_kg_m2: float = 0.0
    crank_centre_mm: float = 0.0
    rod_centre_mm: float = 0.0


@dataclass(frozen=True, slots=True)
class FrictionTable:
    """Coefficients of dry friction in the sliding pairs, friction of the rings, speed of the regularisation."""

    guide: float = 0.0
    cylinder: float = 0.0
    slot: float = 0.0
    yoke: float = 0.0
    rings_N: float = 0.0
    smoothing_velocity_m_s: float = 1e-3


@dataclass(frozen=True, slots=True)
class PistonTable:
    """``[mechanism]`` with ``module = "floating_piston"``.

    Without ``[mechanism.gas]`` the constant ``force_N`` pushes the piston away from the head.
    """

    module: Literal["floating_piston"]
    drive: DriveTable
    kinds: tuple[Kind, ...] = ("crank_slider", "scotch_yoke")
    group: GroupTable = field(default_factory=GroupTable)
    gas: GasTable | None = None
    force_N: float = 0.0
    masses: MassTable = field(default_factory=MassTable)
    friction: FrictionTable = field(default_factory=FrictionTable)
    speed_rad_s: float = 1.0
    gravity_m_s2: tuple[float, float] = (0.0, 0.0)
    piston_length_mm: float | None = None
    square_errors_deg: tuple[float, ...] = (0.0, 1.0, 2.0, 5.0, 10.0)
    positions: Positions = 24

    def __post_init__(self) -> None:
        require(bool(self.kinds), "has no kinds; name crank_slider, scotch_yoke or both")
        require(len(set(self.kinds)) == len(self.kinds), f"has kinds that repeat in {list(self.kinds)}; remove one")
        require(self.speed_rad_s != 0, "has speed_rad_s = 0; a turn needs a speed")
        rod = self.drive.rod_mm
        require(
            "crank_slider" not in self.kinds or math.isfinite(rod),
            "has kinds with a crank_slider, but [mechanism.drive] gives no rod_mm; give its length",
        )
        require(
            self.gas is None or self.force_N == 0.0,
            "has force_N and [mechanism.gas]; the gas is one of them: remove one",
        )
        require(
            self.piston_length_mm is None or self.piston_length_mm > 0,
            f"has piston_length_mm = {self.piston_length_mm}; it must be positive",
        )


_HERE = "graphsynth.systems.piston"
SYSTEM = System(
    table=PistonTable,
    structure="optional",
    stages=(
        Stage("recognise", f"{_HERE}.stages:recognise", ("candidates",), ("recognised",)),
        Stage("loops", f"{_HERE}.stages:loops", (), ("loops",)),
        Stage("turn", f"{_HERE}.stages:turn", (), ("turns",)),
        Stage("judge", f"{_HERE}.stages:judge", ("loops", "turns"), ("records", "tables")),
        Stage("sketch mechanism", f"{_HERE}.stages_pictures:sketches", (), ("mechanism_pictures",)),
        Stage("animate", f"{_HERE}.stages_pictures:animations", (), ("animations",)),
        Stage("plot", f"{_HERE}.stages_pictures:plots", (), ("plots",)),
    ),
    evidence=plans("graphsynth.systems.piston.evidence", "positions", "loads", "work"),
)
