"""``module = "single_motor_platform"``: a planar platform on three legs, driven by one motor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from graphsynth.evidence.rows import plans
from graphsynth.pipeline.planar.tables import CandidatesTable
from graphsynth.pipeline.system import COLLECT, Stage, System
from graphsynth.pipeline.tables import In, Positions
from graphsynth.systems.platform.motor_system import MachineDriveTable

_Length = Annotated[float, In("mm", above=0, why="a length must be positive")]
_Point = Annotated[tuple[float, float], In("mm")]
_Teeth = Annotated[int, In(above=0, why="a gear needs teeth")]


@dataclass(frozen=True, slots=True)
class PlatformTable:
    """``[mechanism]`` with ``module = "single_motor_platform"``: one leg, repeated at three directions.

    Points are ``[along, across]`` in the frame of a leg, whose first axis points away from the centre.
    """

    module: Literal["single_motor_platform"]
    leg_directions: Annotated[tuple[float, float, float], In("deg")]
    wheel_axis: _Point
    rocker_pivot: _Point
    platform_vertex: _Point
    arm: _Length
    intermediate: _Length
    rocker: _Length
    coupler: _Length
    crank: Annotated[tuple[float, float, float], In("mm", least=0, why="a crank must not be negative")]
    crank_phase: Annotated[tuple[float, float, float], In("rad")]
    rocker_angle: Annotated[float, In("deg")]
    pinion_teeth: _Teeth
    wheel_teeth: _Teeth
    drive_branch: Literal[1, -1] = 1
    working_mode: tuple[Literal[1, -1], Literal[1, -1], Literal[1, -1]] = (-1, -1, -1)
    positions: Positions = 360
    drive: MachineDriveTable | None = None
    others: CandidatesTable | None = None


_HERE = "graphsynth.systems.platform"
#: Records of the platform alone; and of every candidate, each through the stages of any planar mechanism.
_ALONE = (Stage("assess", f"{_HERE}.stages:assess", ("recognised", "motions"), ("records",)),)
_EVERY = (
    Stage("embody", f"{_HERE}.others:embody", ("candidates",), ("built",), each=True),
    Stage("move", f"{_HERE}.others:move", ("built",), ("moved",), each=True),
    Stage("write", "graphsynth.pipeline.planar.stages:write", ("moved",), ("written",), each=True, cost=9.0),
    Stage("compare", f"{_HERE}.others:comparison", ("ranking", "records"), ("comparison",)),
    Stage("sketch best", f"{_HERE}.others:sketches", ("written", "ranking", "records"), ("best_pictures",)),
    COLLECT,
)


def _records(scene: Any) -> tuple[Stage, ...]:
    """Return the stages that lead to the records of a scene."""
    others: CandidatesTable | None = scene.mechanism.others
    if others is None:
        return _ALONE
    parts = ("moved",) if others.bearings is None else ("moved", "jammed")
    record = Stage("record", "graphsynth.pipeline.planar.stages:assess", parts, ("record",), each=True)
    jamming = Stage("jamming", f"{_HERE}.others:jamming", ("moved",), ("jammed",), each=True, cost=2.0)
    return (*_EVERY, record, jamming)


SYSTEM = System(
    table=PlatformTable,
    cases=("platform",),
    structure="required",
    build=f"{_HERE}.stages:platform_of",
    stages=(
        Stage("recognise", f"{_HERE}.stages:recognise", ("candidates",), ("recognised",)),
        Stage("kinematics", f"{_HERE}.stages:kinematics", ("recognised",), ("motions",)),
        Stage("tables of the rotation", f"{_HERE}.stages:tables", ("motions",), ("tables",)),
        Stage("sketch mechanism", f"{_HERE}.stages:sketches", ("motions",), ("mechanism_pictures",)),
        Stage("animate", f"{_HERE}.stages:animations", ("motions",), ("animations",)),
        Stage("plot", f"{_HERE}.stages:plots", ("motions",), ("plots",)),
        Stage("drive", f"{_HERE}.motor_stages:drive_machine", ("motions",), ("drive",)),
        Stage("report the drive", f"{_HERE}.motor_stages:tables", ("drive",), ("drive_tables",)),
        Stage("plot the drive", f"{_HERE}.motor_stages_pictures:curves", ("drive",), ("drive_curves",)),
    ),
    more=_records,
    evidence=plans(f"{_HERE}.evidence", "assembly-modes", "double-root", "turn", "drive"),
)
