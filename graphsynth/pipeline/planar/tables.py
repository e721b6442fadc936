"""What a scene with ``module = "planar"`` says: candidates, goals for dimensions, motion, bearings, loads."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated, Literal

from graphsynth.pipeline.tables import In, Positions, require
from graphsynth.pipeline.units import DEGREE

Deg = Annotated[float, In("deg")]
Degs = Annotated[tuple[float, ...], In("deg")]


@dataclass(frozen=True, slots=True)
class LineTable:
    """A point draws a straight segment: length in cranks, part of the turn, largest width over length."""

    length: float
    span: Deg = math.pi
    tolerance: float = 0.01
    on_bar: bool = False
    link: int | None = None


@dataclass(frozen=True, slots=True)
class PathTable:
    """A point passes points in order, at given inputs or at free ones; largest distance over the size of the set."""

    points: tuple[tuple[float, float], ...]
    inputs: Degs = ()
    tolerance: float = 0.01
    link: int | None = None


@dataclass(frozen=True, slots=True)
class PosesTable:
    """A link passes poses at given inputs: points, and the angles there."""

    points: tuple[tuple[float, float], ...]
    angles: Degs
    inputs: Degs
    tolerance: float = 0.01
    link: int | None = None

    def __post_init__(self) -> None:
        require(
            len(self.points) == len(self.angles),
            f"has {len(self.points)} points and {len(self.angles)} angles_deg; give one angle for each point",
        )


@dataclass(frozen=True, slots=True)
class FunctionTable:
    """The angle of a link on the frame is a function of the input; only differences of outputs count."""

    inputs: Degs
    outputs: Degs
    tolerance: Deg = 0.5 * DEGREE
    link: int | None = None


@dataclass(frozen=True, slots=True)
class EmbodyTable:
    """Goals for dimensions: bounds, at most one target, and how much work each candidate may cost."""

    span: Deg = math.tau
    min_transmission: Deg = 25.0 * DEGREE
    max_length_ratio: float = 6.0
    tries: Annotated[int, In(least=1, most=10_000)] = 12
    effort: Annotated[float, In(above=0, most=100)] = 1.0
    symmetric: bool = False  # the dimensions keep the symmetry of [structure.generate], where it names one
    rates: tuple[float, ...] = ()  # of every driver over the input, 1 by default
    pairs: str = ""  # kind of joints of mobility 2: gear, pin-slot, cam, "gear 2:1", "cam 0.2:0 0:0.05"
    line: LineTable | None = None
    path: PathTable | None = None
    poses: PosesTable | None = None
    function: FunctionTable | None = None

    def __post_init__(self) -> None:
        targets = [name for name in ("line", "path", "poses", "function") if getattr(self, name) is not None]
        require(len(targets) < 2, f"has {' and '.join(targets)}; only one target works")


@dataclass(frozen=True, slots=True)
class MotionTable:
    """The range of the input and what the motion must keep."""

    span: Annotated[float, In("deg", above=0, most=36_000, why="use more than 0 and at most 36000, 100 turns")] = (
        math.tau
    )
    positions: Positions = 360
    min_transmission: Deg = 0.0


Kind = Literal["length", "hole", "temperature", "fit", "end float", "axis", "parallelism"]
#: What every kind of tolerance needs.
NEEDED: dict[str, tuple[str, ...]] = {
    "length": ("link", "ends", "plus"),
    "hole": ("link", "to", "diameter"),
    "temperature": ("low_kelvin", "high_kelvin", "per_kelvin"),
    "fit": ("joint", "fit", "height_mm"),
    "end float": ("joint", "least", "most"),
    "axis": ("link", "to", "angle"),
    "parallelism": ("link", "to", "diameter", "over"),
}


@dataclass(frozen=True, slots=True)
class ToleranceTable:
    """One tolerance of a part, as on a drawing; a joint of a link is named by the link at its other side."""

    kind: Kind
    link: int | None = None
    to: int | None = None
    ends: tuple[int, int] | None = None
    joint: tuple[int, int] | None = None
    plus: Annotated[float | None, In("mm", least=0)] = None
    minus: Annotated[float | None, In("mm", least=0)] = None
    diameter: Annotated[float | None, In("mm", least=0)] = None
    over: Annotated[float | None, In("mm", above=0)] = None
    least: Annotated[float | None, In("mm", least=0)] = None
    most: Annotated[float | None, In("mm", least=0)] = None
    angle: Annotated[float | None, In("deg", least=0)] = None
    fit: str | None = None
    height_mm: Annotated[float | None, In(above=0)] = None
    low_kelvin: float | None = None
    high_kelvin: float | None = None
    per_kelvin: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        missing = [name for name in NEEDED[self.kind] if getattr(self, name) is None]
        require(not missing, f"gives no {' and no '.join(missing)}; a tolerance of kind {self.kind!r} needs it")


@dataclass(frozen=True, slots=True)
class BearingsTable:
    """All bearings alike, the driven axis tilted; tolerances are plus or minus, and only certificates use them."""

    radius_mm: Annotated[float, In(above=0)]
    height_mm: Annotated[float, In(above=0)]
    clearance_mm: Annotated[float, In(least=0)]
    alpha: Annotated[float, In("deg", above=0)]
    condition: Literal["A", "B"] = "A"
    direction: Deg = 0.0
    any_direction: bool = False
    certify: bool = False
    must_be_free: bool = False
    alpha_tolerance: Deg = 0.0
    clearance_tolerance_mm: float = 0.0
    length_tolerance: Annotated[float, In("%")] = 0.0
    tolerances: tuple[ToleranceTable, ...] = ()

    def __post_init__(self) -> None:
        both = bool(self.tolerances) and self.length_tolerance > 0.0
        require(not both, "has tolerances and length_tolerance, one number for all; give one of them")


@dataclass(frozen=True, slots=True)
class BindingTable:
    """What gives way where the bearings bind: their stiffness, links as bars (height across the plane); friction.

    With ``radial`` pins shift in their clearance, and are pressed beyond it, where a mechanism does not close.
    """

    stiffness: Annotated[float, In("N m/rad", above=0)]
    radial: Annotated[float | None, In("N/m", above=0)] = None
    friction: Annotated[float, In(least=0)] = 0.0
    motor: Annotated[float | None, In("Nm", above=0)] = None
    young: Annotated[float | None, In("GPa", above=0)] = None
    width: Annotated[float | None, In("mm", above=0)] = None
    height: Annotated[float | None, In("mm", above=0)] = None

    def __post_init__(self) -> None:
        bar = [value is None for value in (self.young, self.width, self.height)]
        require(all(bar) or not any(bar), "needs young_GPa, width_mm and height_mm of the links, or none of them")


@dataclass(frozen=True, slots=True)
class GradeTable:
    """A grade on offer for a toleranced quantity: a class of ISO 286 for a hole or shaft, or a range; its cost."""

    quantity: str
    cost: Annotated[float, In(least=0)]
    tolerance_class: str = ""
    range: str = ""
    name: str = ""

    def __post_init__(self) -> None:
        require(bool(self.tolerance_class) != bool(self.range), "needs either tolerance_class or range")


@dataclass(frozen=True, slots=True)
class RiskTable:
    """How likely the bearings bind, every quantity with one kind of distribution; and which grades to buy."""

    distribution: Literal["uniform", "normal", "triangular"] = "uniform"
    width: Annotated[float, In(above=0, most=1)] = 0.01  # of the proved bounds
    samples: Annotated[int, In(least=0, most=10_000_000)] = 10_000
    sensitivities: bool = True
    allowed: tuple[float, ...] = ()
    grades: tuple[GradeTable, ...] = ()
    trials: Annotated[int, In(least=1)] = 100

    def __post_init__(self) -> None:
        require(all(0.0 <= p < 1.0 for p in self.allowed), "has allowed probabilities outside 0 to 1; correct them")
        require(bool(self.grades) == bool(self.allowed), "needs both grades and allowed, or none of them")


@dataclass(frozen=True, slots=True)
class DirectCurrentTable:
    """A direct-current motor with voltage ``gain`` times what its speed lacks; one constant for torque and back-emf."""

    resistance: Annotated[float, In("ohm", above=0)]
    constant: Annotated[float, In("V s", above=0)]
    gain: Annotated[float, In("V s", above=0)]
    speed: Annotated[float, In("rad/s", above=0)]
    inductance: Annotated[float, In("H", least=0)] = 0.0


@dataclass(frozen=True, slots=True)
class MotorTable:
    """A motor on the driven link and its train: stages [driving teeth, driven teeth], with an efficiency each."""

    end: Annotated[float, In("s", above=0)]
    stall: Annotated[float | None, In("Nm", above=0)] = None
    no_load: Annotated[float | None, In("rad/s", above=0)] = None
    inertia: Annotated[float, In("kg m^2")] = 0.0
    direct_current: DirectCurrentTable | None = None
    stages: tuple[tuple[int, int], ...] = ()
    efficiency: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        straight = [self.stall is not None, self.no_load is not None]
        require(
            all(straight) if self.direct_current is None else not any(straight),
            "needs stall_Nm and no_load_rad_s, or [mechanism.loads.motor.direct_current], but not both",
        )


@dataclass(frozen=True, slots=True)
class LoadsTable:
    """Links as uniform bars between joints, gravity, a force on the first named point; a constant speed, a motor."""

    bar_kg_per_m: Annotated[float, In("kg/m", above=0)]
    gravity: Annotated[tuple[float, float], In("m/s^2")] = (0.0, 0.0)
    force: Annotated[tuple[float, float], In("N")] = (0.0, 0.0)
    speed: Annotated[float, In("rad/s")] = 1.0
    motor: MotorTable | None = None


@dataclass(frozen=True, slots=True)
class CandidatesTable:
    """How the candidates of another kind of scene become planar mechanisms: dimensions, motion, bearings."""

    crank: Annotated[float | None, In("mm", above=0)] = None
    embody: EmbodyTable = field(default_factory=EmbodyTable)
    motion: MotionTable = field(default_factory=MotionTable)
    bearings: BearingsTable | None = None
    pictures: Annotated[int, In(least=1)] = 10


@dataclass(frozen=True, slots=True)
class PlanarTable:
    """``[mechanism]`` with ``module = "planar"``: candidates come from ``[structure]`` or from `files`."""

    module: Literal["planar"]
    files: tuple[str, ...] = ()
    crank: Annotated[float | None, In("mm", above=0)] = None
    embody: EmbodyTable = field(default_factory=EmbodyTable)
    motion: MotionTable = field(default_factory=MotionTable)
    bearings: BearingsTable | None = None
    binding: BindingTable | None = None
    risk: RiskTable | None = None
    loads: LoadsTable | None = None
    pictures: Annotated[int, In(least=1)] = 10

    def __post_init__(self) -> None:
        require(
            bool(self.files) or self.crank is not None or self.loads is None,
            "has [mechanism.loads] but no crank_mm; masses need the size of the mechanism: give it",
        )
        if self.binding is not None:
            require(
                self.bearings is not None, "has [mechanism.binding] but no [mechanism.bearings], which bind; give it"
            )
            sized = bool(self.files) or self.crank is not None
            require(sized, "has [mechanism.binding] but no crank_mm; a torque needs the size of the mechanism: give it")
        require(
            self.risk is None or self.bearings is not None,
            "has [mechanism.risk] but no [mechanism.bearings]; the risk is that of the bearings: give them",
        )
