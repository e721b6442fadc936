"""``module = "planar"``: any planar mechanisms, from a question or from files: dimensions, motion, bearings, loads."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from graphsynth.core.errors import SceneError
from graphsynth.evidence.registry import plans
from graphsynth.pipeline.stages import COLLECT, Stage
from graphsynth.pipeline.system import System
from graphsynth.pipeline.tables import check_positions, require, require_positive
from graphsynth.pipeline.units import Unit

__all__ = ["SYSTEM", "BearingsTable", "EmbodyTable", "LoadsTable", "MotionTable", "MotorTable", "PlanarTable"]


@dataclass(frozen=True, slots=True)
class LineTable:
    """A point draws a straight segment: length in cranks, part of the turn, largest width over length."""

    length: float
    span_deg: float = 180.0
    tolerance: float = 0.01
    on_bar: bool = False
    link: int | None = None


@dataclass(frozen=True, slots=True)
class PathTable:
    """A point passes points in order, at given inputs or at free ones; largest distance over the size of the set."""

    points: tuple[tuple[float, float], ...]
    inputs_deg: tuple[float, ...] = ()
    tolerance: float = 0.01
    link: int | None = None


@dataclass(frozen=True, slots=True)
class PosesTable:
    """A link passes poses at given inputs: points, and the angles there."""

    points: tuple[tuple[float, float], ...]
    angles_deg: tuple[float, ...]
    inputs_deg: tuple[float, ...]
    tolerance: float = 0.01
    link: int | None = None

    def __post_init__(self) -> None:
        require(
            len(self.points) == len(self.angles_deg),
            f"has {len(self.points)} points and {len(self.angles_deg)} angles_deg; give one angle for each point",
        )


@dataclass(frozen=True, slots=True)
class FunctionTable:
    """The angle of a link on the frame is a function of the input; only differences of outputs count."""

    inputs_deg: tuple[float, ...]
    outputs_deg: tuple[float, ...]
    tolerance_deg: float = 0.5
    link: int | None = None


@dataclass(frozen=True, slots=True)
class EmbodyTable:
    """Goals for dimensions: bounds, at most one target, and how much work each candidate may cost."""

    span_deg: float = 360.0
    min_transmission_deg: float = 25.0
    max_length_ratio: float = 6.0
    tries: int = 12
    effort: float = 1.0
    line: LineTable | None = None
    path: PathTable | None = None
    poses: PosesTable | None = None
    function: FunctionTable | None = None

    def __post_init__(self) -> None:
        require(1 <= self.tries <= 10_000, f"has tries = {self.tries}; use 1 to 10000")
        require(
            0 < self.effort <= 100, f"has effort = {self.effort}; use more than 0 and at most 100, 1 is the usual work"
        )
        targets = [name for name in ("line", "path", "poses", "function") if getattr(self, name) is not None]
        require(len(targets) < 2, f"has {' and '.join(targets)}; only one target works")


@dataclass(frozen=True, slots=True)
class MotionTable:
    """The range of the input and what the motion must keep."""

    span_deg: float = 360.0
    positions: int = 360
    min_transmission_deg: float = 0.0

    def __post_init__(self) -> None:
        check_positions(self.positions)
        require(
            0 < self.span_deg <= 36_000, f"has span_deg = {self.span_deg}; use more than 0 and at most 36000, 100 turns"
        )


@dataclass(frozen=True, slots=True)
class BearingsTable:
    """All bearings alike, the driven axis tilted; tolerances are plus or minus, and only certificates use them."""

    radius_mm: float
    height_mm: float
    clearance_mm: float
    alpha_deg: float
    condition: Literal["A", "B"] = "A"
    direction_deg: float = 0.0
    any_direction: bool = False
    certify: bool = False
    must_be_free: bool = False
    alpha_tolerance_deg: float = 0.0
    clearance_tolerance_mm: float = 0.0
    length_tolerance_percent: float = 0.0

    def __post_init__(self) -> None:
        require_positive(self, ("radius_mm", "height_mm", "alpha_deg"))
        require(self.clearance_mm >= 0, f"has clearance_mm = {self.clearance_mm}; it must not be negative")


@dataclass(frozen=True, slots=True)
class MotorTable:
    """A motor with a straight characteristic on the driven link: torque at rest, speed without load."""

    stall_Nm: float
    no_load_rad_s: float
    end_s: float
    inertia_kg_m2: float = 0.0

    def __post_init__(self) -> None:
        require_positive(self, ("stall_Nm", "no_load_rad_s", "end_s"))


@dataclass(frozen=True, slots=True)
class LoadsTable:
    """Links as uniform bars between joints, gravity, a force on the first named point; a constant speed, a motor."""

    bar_kg_per_m: Annotated[float, Unit.parse("kg/m")]
    gravity_m_s2: tuple[float, float] = (0.0, 0.0)
    force_N: tuple[float, float] = (0.0, 0.0)
    speed_rad_s: float = 1.0
    motor: MotorTable | None = None

    def __post_init__(self) -> None:
        require(self.bar_kg_per_m > 0, f"has bar_kg_per_m = {self.bar_kg_per_m}; it must be positive")


@dataclass(frozen=True, slots=True)
class PlanarTable:
    """``[mechanism]`` with ``module = "planar"``: candidates come from ``[structure]`` or from `files`."""

    module: Literal["planar"]
    files: tuple[str, ...] = ()
    crank_mm: float | None = None
    embody: EmbodyTable = field(default_factory=EmbodyTable)
    motion: MotionTable = field(default_factory=MotionTable)
    bearings: BearingsTable | None = None
    loads: LoadsTable | None = None
    pictures: int = 10

    def __post_init__(self) -> None:
        require(self.crank_mm is None or self.crank_mm > 0, f"has crank_mm = {self.crank_mm}; it must be positive")
        require(self.pictures >= 1, f"has pictures = {self.pictures}; use 1 or more")
        require(
            bool(self.files) or self.crank_mm is not None or self.loads is None,
            "has [mechanism.loads] but no crank_mm; masses need the size of the mechanism: give it",
        )


_HERE = "graphsynth.pipeline.planar"


def _more(scene: Any) -> tuple[Stage, ...]:
    """Return the stages of the parts that a scene has."""
    table: PlanarTable = scene.mechanism
    place = scene.place / "mechanism"
    if bool(table.files) == (scene.structure is not None):
        raise SceneError(
            f"{place} needs candidates: give either a table [structure] or mechanism files, as in "
            'files = ["my-mechanism.toml"]'
        )
    parts, stages = ["moved"], []
    if table.bearings is not None:
        stages.append(Stage("jamming", f"{_HERE}.stages_loads:jamming", ("moved",), ("jammed",), each=True, cost=2.0))
        parts.append("jammed")
    if table.loads is not None:
        stages.append(Stage("dynamics", f"{_HERE}.stages_loads:dynamics", ("moved",), ("driven",), each=True, cost=3.0))
        parts.append("driven")
    stages.append(Stage("judge", f"{_HERE}.stages:judge", tuple(parts), ("record",), each=True))
    if scene.ranking is not None:
        best = ("written", "ranking")
        stages += [
            Stage("sketch best", f"{_HERE}.stages_pictures:sketches", (*best, "records"), ("mechanism_pictures",)),
            Stage("animate best", f"{_HERE}.stages_pictures:animations", (*best, "records"), ("animations",)),
            Stage("plot best", f"{_HERE}.stages_pictures:plots", best, ("plots",)),
        ]
    return tuple(stages)


SYSTEM = System(
    table=PlanarTable,
    stages=(
        Stage("take", f"{_HERE}.stages:take", (), ("designs",), stream=True),
        Stage("embody", f"{_HERE}.stages:embody", ("designs",), ("built",), each=True),
        Stage("move", f"{_HERE}.stages:move", ("built",), ("moved",), each=True),
        Stage("write", f"{_HERE}.stages:write", ("moved",), ("written",), each=True, cost=9.0),
        Stage("mechanisms", f"{_HERE}.stages:mechanisms", ("written",), ("mechanisms",)),
        COLLECT,
    ),
    more=_more,
    evidence=plans(
        "graphsynth.pipeline.planar.evidence",
        "positions",
        "coupled-joints",
        "linkage-dynamics",
        "dimensions",
        "path-dimensions",
    ),
)
