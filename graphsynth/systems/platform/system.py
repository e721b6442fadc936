"""``module = "single_motor_platform"``: a planar platform on three legs, driven by one motor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from graphsynth.evidence.registry import plans
from graphsynth.pipeline.stages import Stage
from graphsynth.pipeline.system import System
from graphsynth.pipeline.tables import check_positions, require, require_positive
from graphsynth.systems.platform.motor_system import MachineDriveTable

__all__ = ["SYSTEM", "PlatformTable"]


@dataclass(frozen=True, slots=True)
class PlatformTable:
    """``[mechanism]`` with ``module = "single_motor_platform"``: one leg, repeated at three directions.

    Points are ``[along, across]`` in the frame of a leg, whose first axis points away from the centre.
    """

    module: Literal["single_motor_platform"]
    leg_directions_deg: tuple[float, float, float]
    wheel_axis_mm: tuple[float, float]
    rocker_pivot_mm: tuple[float, float]
    platform_vertex_mm: tuple[float, float]
    arm_mm: float
    intermediate_mm: float
    rocker_mm: float
    coupler_mm: float
    crank_mm: tuple[float, float, float]
    crank_phase_rad: tuple[float, float, float]
    rocker_angle_deg: float
    pinion_teeth: int
    wheel_teeth: int
    drive_branch: Literal[1, -1] = 1
    working_mode: tuple[Literal[1, -1], Literal[1, -1], Literal[1, -1]] = (-1, -1, -1)
    positions: int = 360
    drive: MachineDriveTable | None = None

    def __post_init__(self) -> None:
        require_positive(self, ("arm_mm", "intermediate_mm", "rocker_mm", "coupler_mm"), "a length must be positive")
        require_positive(self, ("pinion_teeth", "wheel_teeth"), "a gear needs teeth")
        require(min(self.crank_mm) >= 0, f"has crank_mm = {list(self.crank_mm)}; a crank must not be negative")
        check_positions(self.positions)


_HERE = "graphsynth.systems.platform"
SYSTEM = System(
    table=PlatformTable,
    structure="required",
    stages=(
        Stage("recognise", f"{_HERE}.stages:recognise", ("candidates",), ("recognised",)),
        Stage("kinematics", f"{_HERE}.stages:kinematics", ("recognised",), ("motions",)),
        Stage("judge", f"{_HERE}.stages:judge", ("recognised", "motions"), ("records", "tables")),
        Stage("sketch mechanism", f"{_HERE}.stages_pictures:sketches", ("motions",), ("mechanism_pictures",)),
        Stage("animate", f"{_HERE}.stages_pictures:animations", ("motions",), ("animations",)),
        Stage("plot", f"{_HERE}.stages_pictures:plots", ("motions",), ("plots",)),
        Stage("drive", f"{_HERE}.motor_stages_machine:drive", ("motions",), ("drive",)),
        Stage("tell the drive", f"{_HERE}.motor_stages_machine:tables", ("drive",), ("drive_tables",)),
        Stage("plot the drive", f"{_HERE}.motor_stages_machine:curves", ("drive",), ("drive_curves",)),
    ),
    evidence=plans("graphsynth.systems.platform.evidence", "assembly-modes", "double-root", "turn", "drive"),
)
