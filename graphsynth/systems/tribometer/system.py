"""``module = "tribometer"``: an upper platform on a spring, dragged by friction on a driven lower platform."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from graphsynth.evidence.rows import plans
from graphsynth.pipeline.system import Stage, System
from graphsynth.pipeline.tables import require
from graphsynth.pipeline.units import Unit


@dataclass(frozen=True, slots=True)
class PlatformsTable:
    """The upper platform: mass, spring and damper to the frame, force on it beside the weight, and its start.

    ``v2_m_s`` is the initial velocity; without it, that of the lower platform.
    """

    mass_kg: float
    stiffness_N_per_m: float
    damping_N_s_per_m: float = 0.0
    load_N: float = 0.0
    gravity_m_s2: float = 9.81
    x2_mm: float = 0.0
    v2_m_s: float | None = None


@dataclass(frozen=True, slots=True)
class FrictionTable:
    """Law of friction: coefficients at rest and in fast sliding, Stribeck velocity (none: two coefficients)."""

    static: float
    kinetic: float
    stribeck_m_s: float | None = None
    exponent: float = 2.0
    viscous: Annotated[float, Unit.parse("s/m")] = 0.0


@dataclass(frozen=True, slots=True)
class DriveTable:
    """What moves the lower platform: a crank with a rod, a cosine of amplitude ``radius_mm``, or a belt."""

    kind: Literal["crank", "harmonic", "belt"]
    radius_mm: float | None = None
    rod_mm: float | None = None
    speed_rad_s: float | None = None
    belt_m_s: float | None = None

    def __post_init__(self) -> None:
        wanted = {"crank": ("radius_mm", "rod_mm", "speed_rad_s"), "harmonic": ("radius_mm", "speed_rad_s")}.get(
            self.kind, ("belt_m_s",)
        )
        for name in ("radius_mm", "rod_mm", "speed_rad_s", "belt_m_s"):
            given = getattr(self, name) is not None
            require(given or name not in wanted, f"lacks {name}, which a {self.kind} drive needs")
            require(not given or name in wanted, f"has {name}, which a {self.kind} drive does not have; remove it")


@dataclass(frozen=True, slots=True)
class RunTable:
    """Length of the run, number of output times, tolerance of integrated slip pieces, turns until a cycle is found."""

    duration_s: float = 10.0
    samples: int = 2001
    tolerance: float = 1e-14
    most_turns: int = 400

    def __post_init__(self) -> None:
        require(self.duration_s > 0, f"has duration_s = {self.duration_s}; it must be positive")
        require(20 <= self.samples <= 200_000, f"has samples = {self.samples}; use 20 to 200000 output times")
        require(1 <= self.most_turns <= 100_000, f"has most_turns = {self.most_turns}; use 1 to 100000")


@dataclass(frozen=True, slots=True)
class MethodsTable:
    """Settings of the methods that are compared with the event-driven run."""

    tolerances: tuple[float, ...] = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
    steps_s: tuple[float, ...] = (1e-3, 1e-4, 1e-5)
    speeds_m_s: tuple[float, ...] = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
    solvers: tuple[Literal["LSODA", "BDF", "Radau", "DOP853"], ...] = ("LSODA",)


@dataclass(frozen=True, slots=True)
class TribometerTable:
    """``[mechanism]`` with ``module = "tribometer"``."""

    module: Literal["tribometer"]
    platform: PlatformsTable
    friction: FrictionTable
    drive: DriveTable
    run: RunTable = field(default_factory=RunTable)
    methods: MethodsTable = field(default_factory=MethodsTable)


_HERE = "graphsynth.systems.tribometer"
SYSTEM = System(
    table=TribometerTable,
    cases=("instruments-3.8", *(f"instruments-9.{k}" for k in range(10, 16))),
    structure="none",
    stages=(
        Stage("run", f"{_HERE}.stages:move", (), ("motion",)),
        Stage("find limit cycle", f"{_HERE}.stages:cycle", (), ("cycle",)),
        Stage("compare methods", f"{_HERE}.stages:methods", ("motion",), ("methods",)),
        Stage("judge", f"{_HERE}.stages_tables:judge", ("motion", "cycle", "methods"), ("records", "tables")),
        Stage("draw mechanism", f"{_HERE}.stages_pictures:sketches", ("motion",), ("mechanism_pictures",)),
        Stage("animate", f"{_HERE}.stages_pictures:animations", ("motion",), ("animations",)),
        Stage("plot", f"{_HERE}.stages_pictures:plots", ("motion", "cycle", "methods"), ("plots",)),
        Stage("compare solvers", f"{_HERE}.stages:solvers", ("motion",), ("solvers",)),
    ),
    evidence=plans("graphsynth.systems.tribometer.evidence", "events", "stick-slip"),
)
