"""``module = "pointing"``: an antenna reflector on a gimbal, tilted about two axes by two cranks."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from graphsynth.evidence.rows import plans
from graphsynth.pipeline.system import Stage, System
from graphsynth.pipeline.tables import In, require
from graphsynth.pipeline.units import DEGREE

_Length = Annotated[float, In("mm", above=0, why="a length must be positive")]
_Tolerance = Annotated[float, In("mm", least=0, why="a tolerance must not be negative")]


@dataclass(frozen=True, slots=True)
class AntennaLengths:
    """Distance of both cardans from the centre, rods and cranks of leg Y (elevation) and leg X (azimuth)."""

    cardan: _Length
    rod_y: _Length
    crank_y: _Length
    rod_x: _Length
    crank_x: _Length


@dataclass(frozen=True, slots=True)
class AntennaSweep:
    """Equal angles of both cranks, from 0 to `largest_deg`; the article calls `working_deg` the working limit."""

    largest: Annotated[float, In("deg", above=0, most=360, why="use 0 to 360 degrees")] = 40.0 * DEGREE
    samples: Annotated[int, In(least=9, most=100_000)] = 161
    working: Annotated[float, In("deg", above=0)] = 15.0 * DEGREE

    def __post_init__(self) -> None:
        sentence = f"has working_deg = {self.working / DEGREE:g}, above largest_deg; make it smaller"
        require(self.working <= self.largest, sentence)


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

    cardan: _Tolerance = 0.0
    rod_y: _Tolerance = 0.0
    crank_y: _Tolerance = 0.0
    rod_x: _Tolerance = 0.0
    crank_x: _Tolerance = 0.0
    at: Annotated[tuple[float, ...], In("deg")] = (0.0, 15.0 * DEGREE, 40.0 * DEGREE)
    map_nodes: Annotated[int, In(least=2, most=101, why="use 2 to 101 along each axis")] = 9


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
    shown: Annotated[tuple[float, float], In("deg")] = (35.0 * DEGREE, 25.0 * DEGREE)


_HERE = "graphsynth.systems.antenna"
SYSTEM = System(
    table=AntennaTable,
    cases=tuple(f"instruments-9.{k}" for k in range(1, 8)),
    structure="none",
    build=f"{_HERE}.stages:antenna_of",
    stages=(
        Stage("sweep", f"{_HERE}.stages:sweep", (), ("sweep",)),
        Stage("compare models", f"{_HERE}.stages:compare", (), ("comparison",)),
        Stage("solve the twelve equations", f"{_HERE}.stages:cross_check", ("sweep",), ("second_way",)),
        Stage("find singular poses", f"{_HERE}.stages:singular_poses", (), ("singular_poses",)),
        Stage("prove tolerances", f"{_HERE}.stages:tolerances", (), ("tolerances",)),
        Stage(
            "assess",
            f"{_HERE}.stages:assess",
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
