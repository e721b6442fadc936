"""What a scene with ``module = "design"`` says: targets, what is given or bounded, how long to search."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, fields
from typing import TYPE_CHECKING, Annotated, Any, Literal

from graphsynth.pipeline.tables import In, require
from graphsynth.pipeline.units import DEGREE

if TYPE_CHECKING:
    from graphsynth.design.task.targets import Target
    from graphsynth.design.task.task import DesignTask

Deg = Annotated[float, In("deg")]
Point = tuple[float, float]
Box = tuple[float, float, float, float]
#: x and y of a place, or of two corners of a region.
Place = tuple[float, ...]
#: Ways to give a path.
_SHAPES = ("points", "polyline", "segment", "arc", "svg")


@dataclass(frozen=True, slots=True)
class ArcTable:
    """An arc of a circle between two directions."""

    centre: Point
    radius: Annotated[float, In(above=0)]
    start: Deg
    end: Deg


@dataclass(frozen=True, slots=True)
class PathTable:
    """A named point passes points, or draws a line from corner to corner, a segment, an arc, an SVG path.

    ``inputs``: of the drive at the points, or at the two ends of what is drawn: degrees, or parts 0 to 1 of a stroke.
    ``mean``: the tolerance is that of the root mean square of the distances, not of the largest.
    """

    points: tuple[Point, ...] = ()
    polyline: tuple[Point, ...] = ()
    segment: tuple[Point, ...] = ()
    arc: ArcTable | None = None
    svg: str = ""
    count: Annotated[int, In(least=2, most=400)] = 48
    inputs: tuple[float, ...] = ()
    own_start: bool = False
    closed: bool | None = None
    mean: bool = False
    point: str = "P"
    tolerance: Annotated[float, In(above=0)] = 0.01
    weight: Annotated[float, In(above=0)] = 1.0

    def __post_init__(self) -> None:
        given = [name for name in _SHAPES if getattr(self, name)]
        require(len(given) == 1, f"gives {' and '.join(given) or 'no path'}; give one of {', '.join(_SHAPES)}")
        require(len(self.segment) in (0, 2), "has a segment that has not two ends; give both")

    def target(self, turn: float) -> Target:
        """Return the target; a number of an input times ``turn`` is the input."""
        from graphsynth.design.task.targets import PathTarget

        more: dict[str, Any] = {"inputs": [turn * u for u in self.inputs] or None, "own_start": self.own_start}
        more |= {"point": self.point, "tolerance": self.tolerance, "weight": self.weight, "mean": self.mean}
        if self.closed is not None:
            more["closed"] = self.closed
        if self.points:
            return PathTarget(points=self.points, **more)
        if self.polyline:
            return PathTarget.polyline(self.polyline, count=self.count, **more)
        if self.segment:
            return PathTarget.segment(*self.segment, count=self.count, **more)
        if (arc := self.arc) is not None:
            return PathTarget.arc(arc.centre, arc.radius, arc.start, arc.end, count=self.count, **more)
        return PathTarget.svg(self.svg, count=self.count, **more)


@dataclass(frozen=True, slots=True)
class PosesTable:
    """The link of a named point passes poses: places of the point, and angles."""

    points: tuple[Point, ...]
    angles: Annotated[tuple[float, ...], In("deg")]
    inputs: tuple[float, ...] = ()
    own_start: bool = False
    point: str = "P"
    tolerance: Annotated[float, In(above=0)] = 0.01
    weight: Annotated[float, In(above=0)] = 1.0

    def __post_init__(self) -> None:
        require(
            len(self.points) == len(self.angles),
            f"has {len(self.points)} points and {len(self.angles)} angles_deg; give one angle for each point",
        )

    def target(self, turn: float) -> Target:
        """Return the target."""
        from graphsynth.design.task.targets import PosesTarget

        return PosesTarget(
            poses=[(*p, a) for p, a in zip(self.points, self.angles, strict=True)],
            inputs=[turn * u for u in self.inputs] or None,
            own_start=self.own_start,
            point=self.point,
            tolerance=self.tolerance,
            weight=self.weight,
        )


@dataclass(frozen=True, slots=True)
class FunctionTable:
    """The angle of a link on the frame is a function of the input: a table, or a formula of x between two x.

    ``base``: name of the link to which it is jointed instead of the frame.
    """

    inputs: tuple[float, ...] = ()
    outputs: Annotated[tuple[float, ...], In("deg")] = ()
    places: tuple[float, ...] = ()
    formula: str = ""
    between: tuple[float, float] = (0.0, 1.0)
    input_range: float = 90.0
    output_range: Deg = 90.0 * DEGREE
    place_range: float = 1.0
    own_start: bool = False
    link: str = "output"
    base: str = ""
    pivot: Place = ()
    within: Annotated[float | None, In(above=0)] = None
    tolerance: Deg = 0.5 * DEGREE
    weight: Annotated[float, In(above=0)] = 1.0

    def __post_init__(self) -> None:
        table = bool(self.inputs or self.outputs or self.places)
        require(table != bool(self.formula), "needs either inputs and outputs_deg (of a slider places) or a formula")
        require(not self.places or self.within is not None, "has places but not within, their tolerance; give it")

    def target(self, turn: float) -> Target:
        """Return the target."""
        from graphsynth.design.task.formulas import formula
        from graphsynth.design.task.targets import FunctionTarget

        more: dict[str, Any] = {"own_start": self.own_start, **_of_link(self)}
        slides = more["slides"]
        if not self.formula:
            outputs = self.places if slides else self.outputs
            return FunctionTarget(inputs=[turn * u for u in self.inputs], outputs=outputs, **more)
        more |= {"input_range": turn * self.input_range}
        more |= {"output_range": self.place_range if slides else self.output_range}
        return FunctionTarget.of(formula(self.formula), self.between, **more)


@dataclass(frozen=True, slots=True)
class DwellTable:
    """A link stands still for a part of the input; the tolerance says how still; ``within``, a length: it slides."""

    span: Annotated[float, In(above=0)]
    start: float | None = None
    link: str = "output"
    base: str = ""
    pivot: Place = ()
    within: Annotated[float | None, In(above=0)] = None
    tolerance: Deg = 0.5 * DEGREE
    weight: Annotated[float, In(above=0)] = 1.0

    def target(self, turn: float) -> Target:
        """Return the target."""
        from graphsynth.design.task.targets import DwellTarget

        start = None if self.start is None else turn * self.start
        return DwellTarget(span=turn * self.span, start=start, **_of_link(self))


@dataclass(frozen=True, slots=True)
class SwingTable:
    """A link swings, or slides by a stroke: limits, time of the slow stroke over that of the quick one."""

    least: Deg = 0.0
    most: Annotated[float | None, In("deg", above=0)] = None
    stroke: tuple[float, float] | None = None
    time_ratio: Annotated[float | None, In(least=1, most=20)] = None
    link: str = "output"
    base: str = ""
    pivot: Place = ()
    within: Annotated[float | None, In(above=0)] = None
    tolerance: Deg = 0.5 * DEGREE
    weight: Annotated[float, In(above=0)] = 1.0

    def __post_init__(self) -> None:
        sliding = (self.stroke is None) == (self.within is None)
        require(sliding, "has a stroke, of a link that slides, or within, its tolerance, alone; give both or none")

    def target(self, turn: float) -> Target:
        """Return the target."""
        from graphsynth.design.task.targets import SwingTarget

        least, most = self.least, math.inf if self.most is None else self.most
        if self.stroke is not None:
            least, most = self.stroke
        return SwingTarget(least=least, most=most, time_ratio=self.time_ratio, **_of_link(self))


def _of_link(table: FunctionTable | DwellTable | SwingTable) -> dict[str, Any]:
    """Return link, pivot, tolerance and weight; with ``within``, a tolerance of lengths, the link slides."""
    slides = table.within is not None
    tolerance = table.within if slides else table.tolerance
    more = {"pivot": table.pivot or None, "tolerance": tolerance, "weight": table.weight}
    return {"link": table.link, "base": table.base, "slides": slides, **more}


@dataclass(frozen=True, slots=True)
class RankTable:
    """What counts how much in the ranking: errors in tolerances, links, sizes of the task, radians, margins."""

    error: float = 1.0
    links: float = 0.05
    size: float = 0.02
    transmission: float = 0.1
    jam: float = 0.05


Weight = Annotated[float | None, In(above=0)]


@dataclass(frozen=True, slots=True)
class SoftTable:
    """Bounds that are wishes, each with its weight: tolerances for every hundredth by which it is broken."""

    transmission: Weight = None
    length_ratio: Weight = None
    lengths: Weight = None
    box: Weight = None


@dataclass(frozen=True, slots=True)
class DesignTable:
    """``[mechanism]`` with ``module = "design"``; lengths are in one unit of your choice.

    Inputs of targets are degrees of a drive that turns, parts 0 to 1 of the stroke of one that pushes.
    """

    module: Literal["design"]
    paths: tuple[PathTable, ...] = ()
    poses: tuple[PosesTable, ...] = ()
    functions: tuple[FunctionTable, ...] = ()
    dwells: tuple[DwellTable, ...] = ()
    swings: tuple[SwingTable, ...] = ()
    drive: Literal["rotation", "rocking", "cylinder", "slide"] = "rotation"
    span: Deg = math.tau
    stroke: tuple[float, float] | None = None
    links: tuple[int, ...] = (4, 6)
    sliders: Annotated[int, In(least=0, most=3)] = 0
    dyads_only: bool = False
    pivots: tuple[Place, ...] = ()
    drive_pivot: Place = ()
    pivot_region: Box | None = None
    box: Box | None = None
    lengths: tuple[float, float] | None = None
    crank: Annotated[float | None, In(above=0)] = None
    crank_start: Annotated[tuple[float, ...], In("deg")] = ()
    crank_from: Literal["x", "frame"] = "x"
    turning: Literal["either", "counter-clockwise", "clockwise"] = "either"
    symmetric: bool = False
    bars: tuple[float, ...] = ()
    length_ratio: Annotated[float, In(least=1)] = 8.0
    transmission: Annotated[float, In("deg", least=0, below=90)] = 25.0 * DEGREE
    misalignment: Annotated[float | None, In("deg", above=0)] = None
    joint_tilt: Annotated[float, In("deg", above=0)] = 0.3 * DEGREE
    plates: tuple[tuple[float, float, float], ...] = ()  # distances of three holes of a link: 1-2, 2-3, 3-1
    soft: SoftTable = field(default_factory=SoftTable)
    rank: RankTable = field(default_factory=RankTable)
    begin: tuple[str, ...] = ()  # files of mechanisms to begin with
    kept: str = ""  # folder for the best mechanisms so far, written while it searches
    index: str = ""  # folder of an index of curves to begin with
    seconds: Annotated[float, In(above=0)] = 60.0
    processor_seconds: Annotated[float | None, In(above=0)] = None
    answers: Annotated[int, In(least=1, most=100)] = 5

    def __post_init__(self) -> None:
        every = [*self.paths, *self.poses, *self.functions, *self.dwells, *self.swings]
        require(bool(every), "has no target; give [[mechanism.paths]], poses, functions, dwells or swings")

    def task(self) -> DesignTask:
        """Return the task; a `GeometryError` if it contradicts itself."""
        from graphsynth.design.task.task import DesignTask

        turn = 1.0 if self.drive in ("cylinder", "slide") else DEGREE
        tables: tuple[Any, ...] = (*self.paths, *self.poses, *self.functions, *self.dwells, *self.swings)
        targets: list[Target] = [table.target(turn) for table in tables]
        start = self.crank_start * 2 if len(self.crank_start) == 1 else self.crank_start or None
        shared = {own.name for own in fields(self)} & {own.name for own in fields(DesignTask)} - {
            "crank_start",
            "rank",
            "soft",
        }
        more: dict[str, Any] = {name: getattr(self, name) for name in shared}
        more["drive_pivot"] = self.drive_pivot or None
        soft = {name: weight for name, weight in asdict(self.soft).items() if weight is not None}
        return DesignTask(targets=targets, crank_start=start, rank=asdict(self.rank), soft=soft, **more)
