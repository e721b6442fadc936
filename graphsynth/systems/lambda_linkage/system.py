"""``module = "lambda_linkage"``: Chebyshev's four-bar with a tilted motor axis and a bearing that may jam."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from graphsynth.evidence.registry import plans
from graphsynth.pipeline.stages import Stage
from graphsynth.pipeline.system import System
from graphsynth.pipeline.tables import ANY_LENGTH, check_positions, require, require_positive

__all__ = ["SYSTEM", "BearingTable", "LambdaLengths", "LambdaTable", "Tilt"]


@dataclass(frozen=True, slots=True)
class LambdaLengths:
    """Link lengths of the four-bar, in any one unit: the model only uses their ratios."""

    frame: Annotated[float, ANY_LENGTH]
    crank: Annotated[float, ANY_LENGTH]
    coupler: Annotated[float, ANY_LENGTH]
    rocker: Annotated[float, ANY_LENGTH]

    def __post_init__(self) -> None:
        require_positive(self, ("frame", "crank", "coupler", "rocker"), "a length must be positive")


@dataclass(frozen=True, slots=True)
class Tilt:
    """Tilt of the motor axis: by `alpha_rad` about the direction `axis`."""

    alpha_rad: float
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        require(any(self.axis), "has axis [0, 0, 0]; a direction must not vanish")
        require(abs(self.alpha_rad) < math.pi / 2, f"has alpha_rad = {self.alpha_rad}; it must be within pi/2")


@dataclass(frozen=True, slots=True)
class BearingTable:
    """The bearing at B: radius, height and radial clearance in millimetres, and the contact condition."""

    radius_mm: float
    height_mm: float
    clearance_mm: float
    condition: Literal["A", "B"] = "A"

    def __post_init__(self) -> None:
        require(self.radius_mm > 0, f"has radius_mm = {self.radius_mm}; it must be positive")
        require(self.height_mm > 0, f"has height_mm = {self.height_mm}; it must be positive")
        require(self.clearance_mm >= 0, f"has clearance_mm = {self.clearance_mm}; it must not be negative")


@dataclass(frozen=True, slots=True)
class LambdaTable:
    """``[mechanism]`` with ``module = "lambda_linkage"``."""

    module: Literal["lambda_linkage"]
    lengths: LambdaLengths
    tilt: Tilt
    bearing: BearingTable
    branch: Literal[1, -1] = 1
    positions: int = 360
    tolerances: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_positions(self.positions)


_HERE = "graphsynth.systems.lambda_linkage"
SYSTEM = System(
    table=LambdaTable,
    structure="required",
    stages=(
        Stage("recognise", f"{_HERE}.stages:recognise", ("candidates",), ("recognised",)),
        Stage("kinematics", f"{_HERE}.stages:kinematics", ("recognised",), ("motions",)),
        Stage("jamming", f"{_HERE}.stages:jamming", ("motions",), ("assessments",)),
        Stage("judge", f"{_HERE}.stages:judge", ("recognised", "motions", "assessments"), ("records", "tables")),
        Stage(
            "sketch mechanism",
            f"{_HERE}.stages_pictures:sketches",
            ("motions", "assessments"),
            ("mechanism_pictures",),
        ),
        Stage("animate", f"{_HERE}.stages_pictures:animations", ("motions", "assessments"), ("animations",)),
        Stage("plot", f"{_HERE}.stages_pictures:plots", ("motions", "assessments"), ("plots",)),
    ),
    evidence=plans(
        "graphsynth.systems.lambda_linkage.evidence",
        "crossing",
        "areas",
        "arc-ends",
        "coupled-joints",
        "positions",
        "dimensions",
    ),
)
