"""``module = "tribometer"``: an upper platform on a spring, dragged by friction on a driven lower platform.

The tables of its scenes, the event-driven run, the cycle it settles to, the other methods beside it, and what the
report says about them.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Literal

from graphsynth.core.errors import GeometryError, SpecError
from graphsynth.evidence.rows import plans
from graphsynth.pipeline.display import quantity_table, table
from graphsynth.pipeline.products import Quantity, Record, Table, exact
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.system import Stage, System
from graphsynth.pipeline.tables import In, require

if TYPE_CHECKING:
    from graphsynth.evidence.rows import Problem
    from graphsynth.systems.tribometer.cycles import LimitCycle
    from graphsynth.systems.tribometer.model import Tribometer
    from graphsynth.systems.tribometer.motion import StickSlipMotion
    from graphsynth.systems.tribometer.platforms import Drive, FrictionLaw

_Length = Annotated[float | None, In("mm")]


@dataclass(frozen=True, slots=True)
class PlatformsTable:
    """The upper platform: mass, spring and damper to the frame, force on it beside the weight, and its start.

    ``v2_m_s`` is the initial velocity; without it, that of the lower platform.
    """

    mass: Annotated[float, In("kg")]
    stiffness: Annotated[float, In("N/m")]
    damping: Annotated[float, In("N s/m")] = 0.0
    load: Annotated[float, In("N")] = 0.0
    gravity: Annotated[float, In("m/s^2")] = 9.81
    x2: Annotated[float, In("mm")] = 0.0
    v2: Annotated[float | None, In("m/s")] = None


@dataclass(frozen=True, slots=True)
class FrictionTable:
    """Law of friction: coefficients at rest and in fast sliding, Stribeck velocity (none: two coefficients)."""

    static: float
    kinetic: float
    stribeck: Annotated[float | None, In("m/s")] = None
    exponent: float = 2.0
    viscous: Annotated[float, In("s/m")] = 0.0

    def law(self) -> FrictionLaw:
        """Build the law."""
        from graphsynth.systems.tribometer.platforms import StribeckLaw, TwoCoefficientLaw

        if self.stribeck is None:
            return TwoCoefficientLaw(self.static, self.kinetic, self.viscous)
        return StribeckLaw(self.static, self.kinetic, self.stribeck, self.exponent, self.viscous)


@dataclass(frozen=True, slots=True)
class DriveTable:
    """What moves the lower platform: a crank with a rod, a cosine of amplitude ``radius_mm``, or a belt."""

    kind: Literal["crank", "harmonic", "belt"]
    radius: _Length = None
    rod: _Length = None
    speed: Annotated[float | None, In("rad/s")] = None
    belt: Annotated[float | None, In("m/s")] = None

    def __post_init__(self) -> None:
        wanted = {"crank": ("radius", "rod", "speed"), "harmonic": ("radius", "speed")}.get(self.kind, ("belt",))
        for name, key in (("radius", "radius_mm"), ("rod", "rod_mm"), ("speed", "speed_rad_s"), ("belt", "belt_m_s")):
            given = getattr(self, name) is not None
            require(given or name not in wanted, f"lacks {key}, which a {self.kind} drive needs")
            require(not given or name in wanted, f"has {key}, which a {self.kind} drive does not have; remove it")

    def drive(self) -> Drive:
        """Build the drive."""
        from graphsynth.systems.tribometer.platforms import BeltDrive, CrankDrive, HarmonicDrive

        if self.kind == "belt":
            return BeltDrive(self.belt or 0.0)
        radius, speed = self.radius or 0.0, self.speed or 0.0
        return HarmonicDrive(radius, speed) if self.kind == "harmonic" else CrankDrive(radius, self.rod or 0.0, speed)


@dataclass(frozen=True, slots=True)
class RunTable:
    """Length of the run, number of output times, tolerance of integrated slip pieces, turns until a cycle is found."""

    duration: Annotated[float, In("s", above=0)] = 10.0
    samples: Annotated[int, In(least=20, most=200_000, why="use 20 to 200000 output times")] = 2001
    tolerance: float = 1e-14
    most_turns: Annotated[int, In(least=1, most=100_000)] = 400


@dataclass(frozen=True, slots=True)
class MethodsTable:
    """Settings of the methods that are compared with the event-driven run."""

    tolerances: tuple[float, ...] = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
    steps: Annotated[tuple[float, ...], In("s")] = (1e-3, 1e-4, 1e-5)
    speeds: Annotated[tuple[float, ...], In("m/s")] = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
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


def _table(context: Context) -> TribometerTable:
    found = context.scene.mechanism
    assert isinstance(found, TribometerTable)  # the registry chose these stages by the module of the scene
    return found


def tribometer_of(context: Context) -> Tribometer:
    """Build the tribometer; a number that makes no sense is an error of the scene."""
    from graphsynth.systems.tribometer.model import Tribometer

    own, part = _table(context), "friction"
    p = own.platform
    try:
        law, part = own.friction.law(), "drive"
        drive, part = own.drive.drive(), "platform"
        return Tribometer(p.mass, p.stiffness, p.damping, p.load, p.gravity, law, drive, p.x2, p.v2)
    except (SpecError, GeometryError) as error:
        raise (context.scene.place / "mechanism" / part).error(f"cannot be used: {error}") from error


def move(context: Context) -> StickSlipMotion:
    """Run the hybrid automaton."""
    import numpy as np

    run = _table(context).run
    times = np.linspace(0.0, run.duration, run.samples)
    tribometer = tribometer_of(context)
    try:
        return tribometer.event_driven(run.duration, times=times, rtol=run.tolerance)
    except SpecError as error:
        raise (context.scene.place / "mechanism" / "run").error(f"cannot be used: {error}") from error


def cycle(context: Context) -> LimitCycle:
    """Find the periodic motion to which the tribometer settles."""
    from graphsynth.systems.tribometer.cycles import limit_cycle

    return limit_cycle(tribometer_of(context), most_turns=_table(context).run.most_turns)


def methods(context: Context, motion: StickSlipMotion, solvers: tuple[str, ...] = ()) -> Problem | None:
    """Compare the methods with the event-driven run; None if that one did not finish."""
    from graphsynth.systems.tribometer.evidence import method_study

    if not motion.complete:
        return None
    scene, m = _table(context), _table(context).methods
    settings: dict[str, Any] = {"tolerances": m.tolerances, "steps": m.steps, "speeds": m.speeds}
    settings["solvers"] = solvers or m.solvers
    try:
        return method_study(tribometer_of(context), scene.run.duration, **settings)
    except SpecError as error:
        raise (context.scene.place / "mechanism" / "methods").error(f"cannot be used: {error}") from error


def solvers(context: Context, motion: StickSlipMotion) -> tuple[Table, ...]:
    """Error against run time with every solver; some minutes, not part of the shipped outputs."""
    study = methods(context, motion, ("LSODA", "BDF", "Radau"))
    return () if study is None else (_methods_table("Error against run time", study, study.note),)


#: Above this part of the energy exchanged the balance gets a warning.
BALANCE = 1e-9
_MOST_EVENTS = 400


def assess(
    context: Context, motion: StickSlipMotion, cycle: LimitCycle, study: Problem | None
) -> tuple[tuple[Record, ...], tuple[Table, ...]]:
    """Give the verdict and the tables."""
    margins = _margins(motion, cycle)
    tables = [
        quantity_table("Results", margins, motion.statement),
        _events_table(motion),
        _cycle_table(tribometer_of(context), cycle),
        _energy_table(motion),
    ]
    if study is not None:
        note = (
            f"Error of the position at 0.05, 0.10, ... s, against: {study.rows[0].reference} (rows 'event-driven': the "
            "same method with a larger tolerance). Solvers of scipy run the smoothed law."
        )
        tables.append(_methods_table("The other methods", study, note))
    return (_verdict(motion, cycle, margins),), tuple(tables)


def _verdict(motion: StickSlipMotion, cycle: LimitCycle, margins: tuple[Quantity, ...]) -> Record:
    name = "tribometer"
    if not motion.complete:
        return Record(recognised_as=name, verdict=motion.statement, good=False, margins=margins)
    words = f"{len(motion.events)} changes between stick and slip in {motion.t[-1]:g} s"
    if cycle.kind == "none found":
        words += "; no limit cycle found"
    elif cycle.kind == "steady":
        place = f"settles to steady sliding at {1e3 * cycle.x2:.6g} mm"
        words += f"; {place if cycle.stable else 'steady sliding unstable'}"
    else:
        words += f"; settles to a {cycle.kind} cycle of {cycle.period:.6g} s with {len(cycle.events)} of them"
    good = motion.energy_residual <= BALANCE
    if not good:
        words += f"; WARNING: energies balance to {motion.energy_residual:.1e} only"
    return Record(recognised_as=name, verdict=f"{words} ({motion.guarantee})", good=good, margins=margins)


def _margins(motion: StickSlipMotion, cycle: LimitCycle) -> tuple[Quantity, ...]:
    import numpy as np

    worst = max((event.error for event in motion.events), default=0.0)
    found = [exact("changes between stick and slip", len(motion.events))]
    known = np.flatnonzero(np.isfinite(motion.x2))
    if known.size:
        last = int(known[-1])
        own = motion.error if math.isfinite(motion.error) else None
        place = f"upper platform at {motion.t[last]:g} s"
        found.append(Quantity.of_si(place, motion.x2[last], "mm", "estimated", own))
        stuck = math.nan
        if motion.path is not None:
            t, state = motion.path.columns.t, motion.path.columns.state
            stuck = float(np.diff(t)[state[:-1] == 0.0].sum() / max(float(t[-1]), 1e-300))
        found.append(Quantity("share of the time that it sticks", stuck))
    if math.isfinite(motion.shortest_dwell):
        found.append(Quantity("shortest time between changes", motion.shortest_dwell, "s", error=2.0 * worst))
    if math.isfinite(cycle.period):
        # with a crank the period is that of the drive; on a belt it carries the errors of its events
        error = 2.0 * math.ulp(cycle.period)
        if not cycle.turns:
            error = max((e.error for e in cycle.events if math.isfinite(e.error)), default=0.0) + 1e-14
        found.append(Quantity("period of the cycle", cycle.period, "s", error=error))
        found.append(Quantity("largest multiplier of the cycle", max(map(abs, cycle.multipliers))))
    found.append(Quantity("largest estimated error of an event time", worst, "s"))
    found.append(Quantity("relative error of the energy balance", motion.energy_residual))
    return tuple(found)


def _events_table(motion: StickSlipMotion) -> Table:
    rows = [
        (k, event.time, event.error if math.isfinite(event.error) else None, event.name, event.position)
        for k, event in enumerate(motion.events[:_MOST_EVENTS], 1)
    ]
    method = (
        "Closed-form pieces joined at roots found to rounding"
        if motion.guarantee == "exact"
        else "Slip integrated with order 8, events are roots in the length of a step"
    )
    note = f"{method}; errors estimated by a second run with other tolerance and data."
    if len(motion.events) > _MOST_EVENTS:
        note += f" The first {_MOST_EVENTS} of {len(motion.events)}."
    columns = ("no.", "time [s] | .15f", "± [s] | .0e", "new state", "position of the upper platform [mm] | .12f")
    return table(f"Events: {len(motion.events)}", columns, rows, note)


def _cycle_table(model: Tribometer, cycle: LimitCycle) -> Table:
    from graphsynth.systems.tribometer.cycles import belt_cycle

    rows = [("kind", cycle.kind), ("statement", cycle.statement)]
    if cycle.kind != "none found":
        factors = (f"{m.real:.6g}" + (f" {m.imag:+.6g}i" if m.imag else "") for m in cycle.multipliers)
        rows += [
            ("period", f"{cycle.period:.12g} s" if math.isfinite(cycle.period) else "none"),
            ("turns of the crank", str(cycle.turns) if cycle.turns else "no crank"),
            ("upper platform at its start", f"{1e3 * cycle.x2:.12g} mm, {round(1e3 * cycle.v2, 10) + 0.0:.10g} mm/s"),
            ("change over one period", f"{cycle.residual:.1e} m"),
            ("multipliers (small changes shrink by)", ", ".join(factors)),
            ("stable", "yes" if cycle.stable else "no"),
        ]
        rows += [
            (f"{event.name} in the cycle", f"{event.time:.12f} s, {1e3 * event.position:.9f} mm")
            for event in cycle.events
        ]
    with suppress(SpecError):  # no closed form for this drive or law
        known = belt_cycle(model)
        rows += [(f"exact: {name}", f"{getattr(known, name):.15g} s") for name in ("stick", "slip", "period")]
    return table("Limit cycle", ("", ""), rows, "Return map of the automaton, multipliers by differences (estimated).")


def _energy_table(motion: StickSlipMotion) -> Table:
    stored = math.nan if motion.path is None else float(motion.path.stored[-1] - motion.path.stored[0])
    energies = {
        "work of the drive": motion.drive_work,
        "heat of friction": motion.friction_loss,
        "loss in the damper": motion.damper_loss,
        "gained by platform and spring": stored,
    }
    rows = [(name, f"{energy:.12g} J") for name, energy in energies.items()]
    warned = "" if motion.energy_residual <= BALANCE else " (WARNING)"
    rows.append(("largest relative error of the balance", f"{motion.energy_residual:.1e}{warned}"))
    note = "Each is integrated by itself along the run; none is the remainder of the others."
    return table("Energy balance", ("", ""), rows, note)


_METHOD_COLUMNS = (
    *("method", "tolerance, step [s] or speed [m/s] | .0e", "error [m] | .2e", "event time [s] | .1e"),
    *("steps or calls | .0f", "time [ms] | .2f", "status", ""),
)


def _methods_table(title: str, study: Problem, note: str) -> Table:
    def known(value: float) -> float | None:
        return None if math.isnan(value) else value

    rows = [
        (
            *(row.method, row.value, known(row.error), row.more.get("event error [s]")),
            *(row.more["steps or calls"], known(row.seconds), row.status.value, row.reason),
        )
        for row in study.rows
    ]
    return table(title, _METHOD_COLUMNS, rows, note)


_HERE = "graphsynth.systems.tribometer"
SYSTEM = System(
    table=TribometerTable,
    cases=("instruments-3.8", *(f"instruments-9.{k}" for k in range(10, 16))),
    structure="none",
    build=f"{_HERE}.system:tribometer_of",
    stages=(
        Stage("run", f"{_HERE}.system:move", (), ("motion",)),
        Stage("find limit cycle", f"{_HERE}.system:cycle", (), ("cycle",)),
        Stage("compare methods", f"{_HERE}.system:methods", ("motion",), ("methods",)),
        Stage("assess", f"{_HERE}.system:assess", ("motion", "cycle", "methods"), ("records", "tables")),
        Stage("draw mechanism", f"{_HERE}.animation:sketches", ("motion",), ("mechanism_pictures",)),
        Stage("animate", f"{_HERE}.animation:animations", ("motion",), ("animations",)),
        Stage("plot", f"{_HERE}.pictures:plots", ("motion", "cycle", "methods"), ("plots",)),
        Stage("compare solvers", f"{_HERE}.system:solvers", ("motion",), ("solvers",)),
    ),
    evidence=plans("graphsynth.systems.tribometer.evidence", "events", "stick-slip"),
)
