"""``module = "lambda_linkage"``: Chebyshev's four-bar with a tilted motor axis and a bearing that may bind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from graphsynth.evidence.rows import plans
from graphsynth.pipeline.scene import BearingTable, TiltTable
from graphsynth.pipeline.system import Stage, System
from graphsynth.pipeline.tables import ANY_LENGTH, In, Positions

_Length = Annotated[float, ANY_LENGTH, In(above=0, why="a length must be positive")]


@dataclass(frozen=True, slots=True)
class LambdaLengths:
    """Link lengths of the four-bar, in any one unit: the model only uses their ratios."""

    frame: _Length
    crank: _Length
    coupler: _Length
    rocker: _Length


@dataclass(frozen=True, slots=True)
class LambdaTable:
    """``[mechanism]`` with ``module = "lambda_linkage"``."""

    module: Literal["lambda_linkage"]
    lengths: LambdaLengths
    tilt: TiltTable
    bearing: BearingTable
    branch: Literal[1, -1] = 1
    positions: Positions = 360
    tolerances: Mapping[str, object] = field(default_factory=dict)


_HERE = "graphsynth.systems.lambda_linkage"
SYSTEM = System(
    table=LambdaTable,
    cases=("lambda",),
    structure="required",
    build=f"{_HERE}.stages:linkage_of",
    stages=(
        Stage("recognise", f"{_HERE}.stages:recognise", ("candidates",), ("recognised",)),
        Stage("kinematics", f"{_HERE}.stages:kinematics", ("recognised",), ("motions",)),
        Stage("jamming", f"{_HERE}.stages:jamming", ("motions",), ("assessments",)),
        Stage("assess", f"{_HERE}.stages:assess", ("recognised", "motions", "assessments"), ("records", "tables")),
        Stage("sketch mechanism", f"{_HERE}.pictures:sketches", ("motions", "assessments"), ("mechanism_pictures",)),
        Stage("animate", f"{_HERE}.pictures:animations", ("motions", "assessments"), ("animations",)),
        Stage("plot", f"{_HERE}.pictures:plots", ("motions", "assessments"), ("plots",)),
    ),
    evidence=(
        *plans(f"{_HERE}.evidence", "crossing", "areas", "arc-ends", "coupled-joints", "exact-closure"),
        *plans("graphsynth.evidence.space", "exact-turn", "exact-scale", "length-tolerances"),
        *plans("graphsynth.evidence.chance", "probability", "joints-probability", "allocation"),
        *plans("graphsynth.evidence.functions", "interval-functions"),
        *plans(f"{_HERE}.evidence", "positions", "dimensions"),
    ),
)
