"""What a scene with ``module = "pointing"`` says, and the mechanisms that are built from it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, Literal

from graphsynth.core.errors import GeometryError
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.tables import In, require
from graphsynth.pipeline.units import DEGREE

if TYPE_CHECKING:
    from graphsynth.systems.antenna import Convention, PointingMechanism

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


#: Keys of the lengths in the order l1 to l5.
LENGTH_NAMES = ("cardan", "rod_y", "crank_y", "rod_x", "crank_x")


def table_of(context: Context) -> AntennaTable:
    """Return ``[mechanism]`` of the scene."""
    table = context.scene.mechanism
    assert isinstance(table, AntennaTable)
    return table


def antenna_of(context: Context) -> PointingMechanism:
    """Build the mechanism of the scene, lengths in metres."""
    from graphsynth.systems.antenna import PointingMechanism

    table = table_of(context)
    try:
        l1, l2, l3, l4, l5 = (getattr(table.lengths, name) for name in LENGTH_NAMES)
        return PointingMechanism(l1, l2, l3, l4, l5, order=table.order)
    except GeometryError as error:
        raise (context.scene.place / "mechanism" / "lengths").error(f"cannot be built: {error}") from error


def widths_of(context: Context) -> list[float]:
    """Tolerances of the five lengths, metres."""
    table = table_of(context).tolerances
    return [getattr(table, name) for name in LENGTH_NAMES]


def other_model(context: Context) -> tuple[PointingMechanism, Convention]:
    """Return the second model and its conventions."""
    from graphsynth.systems.antenna import Convention

    c = table_of(context).comparison
    return (replace(antenna_of(context), order=c.order), Convention(c.sense_y, c.sense_x, c.side_y, c.side_x, c.output))
