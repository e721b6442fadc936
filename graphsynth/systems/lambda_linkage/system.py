"""``module = "lambda_linkage"``: Chebyshev's four-bar with a tilted motor axis and a bearing that may jam."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from graphsynth.evidence.registry import plans
from graphsynth.pipeline.stages import Stage
from graphsynth.pipeline.system import System
from graphsynth.pipeline.tables import ANY_LENGTH, In, Positions, require

_Length = Annotated[float, ANY_LENGTH, In(above=0, why="a length must be positive")]


@dataclass(frozen=True, slots=True)
class LambdaLengths:
    """Link lengths of the four-bar, in any one unit: the model only uses their ratios."""

    frame: _Length
    crank: _Length
    coupler: _Length
    rocker: _Length


@dataclass(frozen=True, slots=True)
class Tilt:
    """Tilt of the motor axis: by `alpha_rad` about the direction `axis`."""

    alpha: Annotated[float, In("rad", above=-math.pi / 2, below=math.pi / 2, why="it must be within pi/2")]
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        require(any(self.axis), "has axis [0, 0, 0]; a direction must not vanish")


@dataclass(frozen=True, slots=True)
class BearingTable:
    """The bearing at B: radius, height and radial clearance in millimetres, and the contact condition."""

    radius_mm: Annotated[float, In(above=0)]
    height_mm: Annotated[float, In(above=0)]
    clearance_mm: Annotated[float, In(least=0)]
    condition: Literal["A", "B"] = "A"


@dataclass(frozen=True, slots=True)
class LambdaTable:
    """``[mechanism]`` with ``module = "lambda_linkage"``."""

    module: Literal["lambda_linkage"]
    lengths: LambdaLengths
    tilt: Tilt
    bearing: BearingTable
    branch: Literal[1, -1] = 1
    positions: Positions = 360
    tolerances: Mapping[str, object] = field(default_factory=dict)


_HERE = "graphsynth.systems.lambda_linkage"
SYSTEM = System(
    table=LambdaTable,
    structure="required",
    stages=(
        Stage("recognise", f"{_HERE}.stages:recognise", ("candidates",), ("recognised",)),
        Stage("kinematics", f"{_HERE}.stages:kinematics", ("recognised",), ("motions",)),
        Stage("jamming", f"{_HERE}.stages:jamming", ("motions",), ("assessments",)),
        Stage("assess", f"{_HERE}.stages:assess", ("recognised", "motions", "assessments"), ("records", "tables")),
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
