"""``module = "pointing"``: an antenna reflector on a gimbal, tilted about two axes by two cranks."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from graphsynth.evidence.registry import plans
from graphsynth.pipeline.stages import Stage
from graphsynth.pipeline.system import System
from graphsynth.pipeline.tables import require, require_positive

__all__ = ["SYSTEM", "AntennaComparison", "AntennaLengths", "AntennaSweep", "AntennaTable", "AntennaTolerances"]


@dataclass(frozen=True, slots=True)
class AntennaLengths:
    """Distance of both cardans from the centre, rods and cranks of leg Y (elevation) and leg X (azimuth)."""

    cardan_mm: float
    rod_y_mm: float
    crank_y_mm: float
    rod_x_mm: float
    crank_x_mm: float

    def __post_init__(self) -> None:
        require_positive(
            self, ("cardan_mm", "rod_y_mm", "crank_y_mm", "rod_x_mm", "crank_x_mm"), "a length must be positive"
        )


@dataclass(frozen=True, slots=True)
class AntennaSweep:
    """Equal angles of both cranks, from 0 to `largest_deg`; the article calls `working_deg` the working limit."""

    largest_deg: float = 40.0
    samples: int = 161
    working_deg: float = 15.0

    def __post_init__(self) -> None:
        require(0 < self.largest_deg <= 360, f"has largest_deg = {self.largest_deg}; use 0 to 360 degrees")
        require(9 <= self.samples <= 100_000, f"has samples = {self.samples}; use 9 to 100000")
        require(
            0 < self.working_deg <= self.largest_deg,
            f"has working_deg = {self.working_deg}; it must be positive and not above largest_deg",
        )


@dataclass(frozen=True, slots=True)
class AntennaComparison:
    """Conventions of the model that is compared with the first one; the lengths are the same."""

    order: Literal["YX", "XY"] = "XY"
    sense_y: Literal[1, -1] = 1
    sense_x: Literal[1, -1] = 1
    side_y: Literal[1, -1] = 1
    side_x: Literal[1, -1] = 1
    output: Literal["gimbal", "normal"] = "gimbal"


@dataclass(frozen=True, slots=True)
class AntennaTolerances:
    """Plus and minus of every length, the equal crank angles at which bounds are proved, and the nodes of the map."""

    cardan_mm: float = 0.0
    rod_y_mm: float = 0.0
    crank_y_mm: float = 0.0
    rod_x_mm: float = 0.0
    crank_x_mm: float = 0.0
    at_deg: tuple[float, ...] = (0.0, 15.0, 40.0)
    map_nodes: int = 9

    def __post_init__(self) -> None:
        for name in ("cardan_mm", "rod_y_mm", "crank_y_mm", "rod_x_mm", "crank_x_mm"):
            require(getattr(self, name) >= 0, f"has {name} = {getattr(self, name)}; a tolerance must not be negative")
        require(2 <= self.map_nodes <= 101, f"has map_nodes = {self.map_nodes}; use 2 to 101 along each axis")


@dataclass(frozen=True, slots=True)
class AntennaTable:
    """``[mechanism]`` with ``module = "pointing"``.

    ``order`` "YX" has the azimuth axis fixed to the ground, "XY" the elevation axis; ``shown_deg`` are the crank angles
    of the picture in space.
    """

    module: Literal["pointing"]
    lengths: AntennaLengths
    order: Literal["YX", "XY"] = "YX"
    sweep: AntennaSweep = field(default_factory=AntennaSweep)
    comparison: AntennaComparison = field(default_factory=AntennaComparison)
    tolerances: AntennaTolerances = field(default_factory=AntennaTolerances)
    shown_deg: tuple[float, float] = (35.0, 25.0)


_HERE = "graphsynth.systems.antenna"
SYSTEM = System(
    table=AntennaTable,
    structure="none",
    stages=(
        Stage("sweep", f"{_HERE}.stages:sweep", (), ("sweep",)),
        Stage("compare models", f"{_HERE}.stages:compare", (), ("comparison",)),
        Stage("solve the twelve equations", f"{_HERE}.stages:second_way", ("sweep",), ("second_way",)),
        Stage("find singular poses", f"{_HERE}.stages:singular_poses", (), ("singular_poses",)),
        Stage("prove tolerances", f"{_HERE}.stages:tolerances", (), ("tolerances",)),
        Stage(
            "judge",
            f"{_HERE}.stages_tables:judge",
            ("sweep", "comparison", "second_way", "singular_poses", "tolerances"),
            ("records", "tables"),
        ),
        Stage("draw mechanism", f"{_HERE}.stages_pictures:sketches", (), ("mechanism_pictures",)),
        Stage("animate", f"{_HERE}.stages_pictures:animations", ("sweep",), ("animations",)),
        Stage("plot", f"{_HERE}.stages_pictures:plots", ("sweep", "comparison"), ("plots",)),
        Stage("compare solvers", f"{_HERE}.stages:solvers", (), ("solvers",)),
    ),
    evidence=plans("graphsynth.systems.antenna.evidence", "poses"),
)
