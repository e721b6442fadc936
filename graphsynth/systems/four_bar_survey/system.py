"""``module = "four_bar_survey"``: all four-bars of a lattice of lengths moved, judged, ranked; the best certified."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated, Literal

from graphsynth.evidence.rows import plans
from graphsynth.pipeline.scene import BearingTable, TiltTable
from graphsynth.pipeline.system import Stage, System
from graphsynth.pipeline.tables import In, require
from graphsynth.pipeline.units import DEGREE

_MOST = 10**8
_Length = Annotated[float, In(above=0, why="a length must be positive")]
_LEAST = {"least": 0, "why": "a tolerance is zero or more"}

Grashof = Literal["crank-rocker", "double crank"]
Column = Literal[
    "frame",
    "coupler",
    "rocker",
    "type",
    "kind",
    "transmission angle",
    "rocker swing",
    "size",
    "largest tilt",
    "largest axis tilt",
    "smallest clearance",
    "jammed part",
    "passes",
]


@dataclass(frozen=True, slots=True)
class RangeTable:
    """Lengths from `first` to `last` in steps of `step`."""

    first: _Length
    last: float
    step: Annotated[float, In(above=0)]

    def __post_init__(self) -> None:
        require(self.last >= self.first, f"has last = {self.last}, less than first = {self.first}; exchange them")


@dataclass(frozen=True, slots=True)
class SurveyLengths:
    """Lengths in any one unit, exact decimals: one crank, and a range of each other link."""

    frame: RangeTable
    coupler: RangeTable
    rocker: RangeTable
    crank: _Length = 1.0

    def __post_init__(self) -> None:
        sets = math.prod((r.last - r.first) / r.step + 1.0 for r in (self.frame, self.coupler, self.rocker))
        require(
            sets <= 1.001 * _MOST,
            f"has ranges of {sets:.3g} dimension sets together, hours of work; at most {_MOST:.0e} are taken at once: "
            "use larger steps, or one scene for each part of the range of the frame",
        )


@dataclass(frozen=True, slots=True)
class SurveyLimits:
    """What a set must keep to be ranked; only sets whose crank turns fully are."""

    types: tuple[Grashof, ...] = ("crank-rocker",)
    transmission: Annotated[float, In("deg", least=0, below=90)] = 30.0 * DEGREE
    free: bool = True

    def __post_init__(self) -> None:
        require(bool(self.types), "has no types; name crank-rocker, double crank or both")


@dataclass(frozen=True, slots=True)
class SurveyTolerances:
    """Plus or minus, for the certificates: of all four lengths, the tilt and its azimuth, the bearing."""

    lengths: Annotated[float, In("%", **_LEAST)] = 0.0
    alpha: Annotated[float, In("rad", **_LEAST)] = 0.0
    azimuth: Annotated[float, In("rad", **_LEAST)] = 0.0
    radius: Annotated[float, In("mm", **_LEAST)] = 0.0
    height: Annotated[float, In("mm", **_LEAST)] = 0.0
    clearance: Annotated[float, In("mm", **_LEAST)] = 0.0


@dataclass(frozen=True, slots=True)
class SurveyTable:
    """``[mechanism]`` with ``module = "four_bar_survey"``."""

    module: Literal["four_bar_survey"]
    lengths: SurveyLengths
    tilt: TiltTable
    bearing: BearingTable
    limits: SurveyLimits = field(default_factory=SurveyLimits)
    tolerances: SurveyTolerances = field(default_factory=SurveyTolerances)
    positions: int = 72
    shard: Annotated[int, In(least=100, most=1_000_000, why="use 100 to 1000000 sets")] = 20_000
    certify: Annotated[int, In(least=1, most=1_000_000, why="use 1 to 1000000 sets")] = 1000
    rows: Literal["all", "passing"] = "passing"
    columns: tuple[Column, ...] = (
        "frame",
        "coupler",
        "rocker",
        "type",
        "transmission angle",
        "rocker swing",
        "size",
        "largest axis tilt",
    )
    slices: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        require(
            8 <= self.positions <= 3600 and self.positions % 2 == 0,
            f"has positions = {self.positions}; give an even number from 8 to 3600, so that both dead centres are met",
        )
        require(bool(self.columns), "has columns = []; name at least one")
        require(abs(self.tilt.alpha) < math.pi / 4, "has a tilt of 45 degrees or more; no bearing is meant for it")


_HERE = "graphsynth.systems.four_bar_survey"
_RANK = Stage("rank", f"{_HERE}.results:rank", ("survey", "records"), ("ranking",))
SYSTEM = System(
    table=SurveyTable,
    structure="none",
    stages=(
        Stage("shards", f"{_HERE}.stages:shards", (), ("shards",), stream=True),
        Stage("evaluate", f"{_HERE}.stages:evaluate", ("shards",), ("evaluated", "surveyed"), each=True),
        Stage("store rows", f"{_HERE}.stages:store", ("evaluated",), ("rows",), each=True),
        Stage("gather", f"{_HERE}.results:gather", ("surveyed",), ("survey",)),
        Stage("certify", f"{_HERE}.results:certify", ("survey",), ("certificates",)),
        Stage("assess", f"{_HERE}.results:assess", ("survey", "certificates"), ("records", "tables")),
        Stage("maps", f"{_HERE}.pictures:maps", ("survey",), ("plots",), aside=True),
        Stage("sketch best", f"{_HERE}.pictures:sketches", ("records", "ranking"), ("mechanism_pictures",)),
        Stage("animate best", f"{_HERE}.pictures:animations", ("records", "ranking"), ("animations",)),
    ),
    more=lambda scene: (_RANK,) if scene.ranking is not None else (),
    evidence=plans(f"{_HERE}.evidence", "many-sets", "arc-ends", "crossing", "dimensions"),
)
