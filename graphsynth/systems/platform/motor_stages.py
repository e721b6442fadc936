"""The motor-driven platform: runs over the resistances, without inertia, the claim, L -> 0, a real machine; tables."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.core.errors import GeometryError, SceneError, SpecError
from graphsynth.pipeline.display import balance_rows, limit_table, quantity_table, table
from graphsynth.pipeline.products import Attempt, Finding, Quantity, Record, Table
from graphsynth.pipeline.stages import Context
from graphsynth.systems.platform.motor_system import DCMotorTable, MachineDriveTable, PlatformDriveTable

if TYPE_CHECKING:
    from graphsynth.dynamics.driven.reduction import ReductionStudy
    from graphsynth.dynamics.driven.run import DriveRun
    from graphsynth.dynamics.motors import DCMotor
    from graphsynth.systems.platform.motor_model import MotorDrivenPlatform
    from graphsynth.systems.platform.resistance import ResistanceEffect, RippleMap
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform


@dataclass(frozen=True, slots=True)
class LabelledRun:
    """A run of the drive for one armature resistance (ohm)."""

    resistance: float
    drive: MotorDrivenPlatform
    run: DriveRun

    @property
    def label(self) -> str:
        """Name of the curve."""
        return f"{self.resistance:g} ohm"


@dataclass(frozen=True, slots=True)
class WithoutInertia:
    """Model S, and runs with constant inertias (kg m^2) that tend to it."""

    source: DriveRun
    inertias: tuple[float, ...]
    runs: tuple[DriveRun, ...]


@dataclass(frozen=True, slots=True)
class Claim:
    """Effects for each case by its label, and the simulated map."""

    effects: dict[str, ResistanceEffect]
    map: RippleMap


def table_of(context: Context) -> PlatformDriveTable:
    """Return ``[mechanism]`` of the scene."""
    table = context.scene.mechanism
    assert isinstance(table, PlatformDriveTable)
    return table


def dc_motor(
    m: DCMotorTable, resistance: float, inductance: float | None = None, speed: float | None = None
) -> DCMotor:
    """Build the motor of a table for an armature resistance (ohm); another inductance or demanded speed if given."""
    from graphsynth.dynamics.motors import DCMotor

    shared = ("torque_constant", "emf_constant", "gain", "rotor_inertia", "friction")
    return DCMotor(
        resistance=resistance,
        inductance=m.inductance if inductance is None else inductance,
        speed=m.speed if speed is None else speed,
        voltage_limit=math.inf if m.voltage_limit is None else m.voltage_limit,
        **{name: getattr(m, name) for name in shared},
    )


def drive_of(
    context: Context, resistance: float, inductance: float | None = None, speed: float | None = None
) -> MotorDrivenPlatform:
    """Build the drive of the scene for an armature resistance (ohm)."""
    from graphsynth.dynamics.driven.inertia import EffectiveInertia
    from graphsynth.systems.platform.motor_model import MotorDrivenPlatform

    moved = table_of(context).platform
    motor = dc_motor(table_of(context).motor, resistance, inductance, speed)
    inertia = EffectiveInertia.of_slider(moved.mass, moved.amplitude)
    return MotorDrivenPlatform(inertia, motor, base_inertia=moved.inertia, friction=moved.friction, load=moved.load)


@contextmanager
def _refused(context: Context, *place: str) -> Iterator[None]:
    """Add the place in the scene to what the numbers there make impossible."""
    try:
        yield
    except (SpecError, GeometryError) as error:
        at = context.scene.place / "mechanism"
        for key in place:
            at = at / key
        raise at.error(f"cannot be computed: {error}") from error


def drive(context: Context) -> tuple[LabelledRun, ...]:
    """Integrate from rest for each armature resistance."""
    table = table_of(context)
    with _refused(context):
        return _runs(table, (drive_of(context, resistance) for resistance in table.resistances))


def _runs(
    table: PlatformDriveTable | MachineDriveTable, drives: Iterable[MotorDrivenPlatform]
) -> tuple[LabelledRun, ...]:
    times = np.linspace(0.0, table.end, table.samples)
    pairs = zip(table.resistances, drives)
    return tuple(LabelledRun(r, model, model.simulate(times, rtol=table.tolerance)) for r, model in pairs)


def without_inertia(context: Context) -> WithoutInertia:
    """Run the regularised model of the source, then the model with ever smaller inertia."""
    w = table_of(context).without_inertia
    times = np.linspace(0.0, w.end, 501)
    with _refused(context, "without_inertia"):
        full = drive_of(context, w.resistance, w.inductance)
        bare = replace(full, motor=replace(full.motor, rotor_inertia=0.0), base_inertia=0.0)
        source = bare.simulate(times, speed=w.start_speed, rtol=1e-12)
        drives = (replace(bare, base_inertia=value) for value in w.inertias)
        runs = tuple(model.simulate(times, speed=w.start_speed, rtol=1e-11) for model in drives)
    return WithoutInertia(source, w.inertias, runs)


def claim(context: Context) -> Claim:
    """Linear criterion and simulated ripples for the cases; the simulated map."""
    from graphsynth.systems.platform.resistance import resistance_effect, ripple_map

    c = table_of(context).claim
    first, last = c.resistances[0], c.resistances[-1]
    with _refused(context, "claim"):
        effects = {
            f"L = {L:g} H, ω_d = {speed:g} rad/s": resistance_effect(
                drive_of(context, first, L, speed), c.resistances, simulate=True, revolutions=c.revolutions
            )
            for L, speed in c.cases
        }
        values = np.geomspace(first, last, c.map_resistances).tolist()
        mapped = ripple_map(drive_of(context, first), values, c.map_inductances, revolutions=c.revolutions)
    return Claim(effects, mapped)


def limit(context: Context) -> ReductionStudy | None:
    """Compare inductances with the limit L -> 0; None if the scene names none."""
    t = table_of(context).limit
    if not t.inductances:
        return None
    times = np.linspace(0.0, t.end, 26)
    transient = 20.0 * max(t.inductances) / t.resistance if t.resistance > 0.0 else 0.0
    after = min(transient, 0.5 * t.end)  # the same times for every inductance
    with _refused(context, "limit"):
        return drive_of(context, t.resistance).inductance_study(times, t.inductances, after=after)


def solvers(context: Context) -> tuple[Table, ...]:
    """Error against run time beside scipy; not part of the shipped outputs."""
    from graphsynth.evidence.drives import drive_work_precision
    from graphsynth.pipeline.display import work_table

    table = table_of(context)
    with _refused(context):
        found = drive_work_precision(drive_of(context, table.resistances[0]), np.linspace(0.0, table.end, 11))
    return (work_table(found),)


def assess(
    context: Context, runs: tuple[LabelledRun, ...], bare: WithoutInertia, found: Claim, study: ReductionStudy | None
) -> tuple[tuple[Record, ...], tuple[Table, ...]]:
    """Give one record for each resistance and the tables."""
    records = tuple(_record(k, item) for k, item in enumerate(runs, 1))
    tables = [*run_tables(runs), *_claim_tables(context, found), *_bare_tables(context, bare)]
    if study is not None:
        tables.append(limit_table(study))
    return records, tuple(tables)


def _record(number: int, item: LabelledRun) -> Record:
    if not item.run.complete:
        reason = f"{item.label}: {item.run.reason}"
        return Record(number, status="failed", recognised_as="platform_drive", reason=reason)
    margins = _margins(item)
    return Record(number, recognised_as="platform_drive", verdict=_words(item, margins), margins=margins)


def _words(item: LabelledRun, margins: tuple[Quantity, ...]) -> str:
    varies = f"the speed varies by {margins[2].value:.4g} rad/s, the torque by {margins[3].value:.4g} N m"
    return f"{item.label}: in steady motion {varies} (estimated)"


def _margins(item: LabelledRun) -> tuple[Quantity, ...]:
    from graphsynth.systems.platform.resistance import steady_ripple

    run, motor = item.run, item.drive.motor
    half = run.time.size // 2
    span = float(run.time[-1] - run.time[half])
    mean = float(run.angle[-1] - run.angle[half]) / span
    try:
        (speed, current), (other, second) = (steady_ripple(item.drive, 40, rtol=rtol) for rtol in (1e-9, 1e-7))
    except SpecError:
        speed = current = other = second = math.nan
    constant = float(getattr(motor, "torque_constant", 1.0))
    angle_error, w_error, i_error = float(run.error[0]), float(run.error[1]), float(run.error[-1]) * constant
    rows = (
        ("mean speed, second half", mean, "rad/s", 2.0 * angle_error / span),
        ("largest torque at the samples", run.motor_torque.max(), "N m", i_error),
        ("steady speed ripple, peak to peak", speed, "rad/s", abs(speed - other)),
        ("steady torque ripple, peak to peak", constant * current, "N m", constant * abs(current - second)),
        ("crank angle at the end", run.angle[-1], "rad", angle_error),
        ("speed at the end", run.speed[-1], "rad/s", w_error),
        ("torque at the end", run.motor_torque[-1], "N m", i_error),
    )
    turns = Quantity("rotations completed", float(np.floor(run.angle[-1] / math.tau)), "", "exact", 0.0)
    return *(Quantity(name, float(value), unit, "estimated", error) for name, value, unit, error in rows), turns


def run_tables(runs: tuple[LabelledRun, ...], *, headline: bool = False) -> tuple[Table, ...]:
    """Quantities, method and errors of every run that reached its end; `headline`: the first screen reports them."""
    tables = []
    for item in runs:
        if item.run.complete:
            margins = _margins(item)
            said = (Finding(f"Motor with {_words(item, margins)}."),) if headline else ()
            tables.append(replace(quantity_table(f"Motion with {item.label}", margins), findings=said))
        tables.append(Table(f"Method and errors of the run with {item.label}", ("", ""), balance_rows(item.run)))
    return tuple(tables)


def _claim_tables(context: Context, found: Claim) -> tuple[Table, ...]:
    trends, rows = [], []
    for label, effect in found.effects.items():
        speed, current = effect.simulated_speed, effect.simulated_current
        linear = "falls" if effect.speed_falls else "rises"
        ratios = (speed[-1] / speed[0], current[-1] / current[0])
        trends.append((label, effect.frequency_ratio, linear, _trend(speed), ratios[0], _trend(current), ratios[1]))
        series = (effect.resistance, effect.damping, effect.speed, speed, effect.current, current)
        rows += [(*(("", None) if k else (label, effect.frequency_ratio)), *row) for k, row in enumerate(zip(*series))]
    truth = (
        "The claim is that a larger armature resistance calms both. On the map the linear condition tells the sign of "
        f"the simulated trend of the speed on {100 * found.map.agreement:.0f} % of the cells; the rest have ripples "
        "that are not small. Ω is the frequency at which the inertia varies, ω_n the natural frequency of motor and "
        "control, ω_d the speed asked for; last to first: ripple at the largest resistance over that at the smallest."
    )
    note = (
        "Ripples peak to peak in steady motion. Linear, exact for small ripples: the torque ripple always falls with "
        "r, the speed ripple if and only if Ω/ω_n > 0.7071. Simulated: estimated, the full model over the second half "
        f"of {table_of(context).claim.revolutions} mean revolutions."
    )
    count = len(found.effects)
    falls = [sum(row[column] == "falls" for row in trends) for column in (3, 5)]
    calms = "calms" if falls == [count, count] else "does not always calm"
    finding = Finding(
        f"A larger armature resistance {calms} the machine: of {count} cases the ripple of the speed falls throughout "
        f"in {falls[0] or 'none'}, that of the torque in {falls[1] or 'none'} (estimated)."
    )
    return (
        table("Does a larger resistance calm the machine?", _TREND_COLUMNS, trends, truth, finding),
        table("Ripples over the resistance", _RIPPLE_COLUMNS, rows, note),
    )


_TREND_COLUMNS = (
    "case",
    "Ω/ω_n | .3f",
    "speed ripple, linear",
    "speed ripple, simulated",
    "last to first | .3g",
    "current ripple, simulated",
    "last to first | .3g",
)
_RIPPLE_COLUMNS = (
    "case",
    "Ω/ω_n | .3f",
    "r [ohm] | g",
    "ζ | .3f",
    "speed, linear [rad/s] | .4g",
    "simulated | .4g",
    "current, linear [A] | .4g",
    "simulated | .4g",
)


def _trend(values: object) -> str:
    """Words for the way a ripple goes over increasing resistance."""
    steps = np.diff(np.asarray(values, dtype=np.float64))
    if not np.isfinite(steps).all():
        return "not known: a run failed"
    if (steps < 0).all():
        return "falls"
    if (steps > 0).all():
        return "rises"
    return "falls, then rises" if steps[0] < 0 else "rises, then falls"


def _bare_tables(context: Context, bare: WithoutInertia) -> tuple[Table, ...]:
    moved, source = table_of(context).platform, bare.source
    root = math.sqrt(moved.mass)
    scale = moved.amplitude * root
    events = [
        (e.kind, e.angle / math.pi, e.time, e.fictitious_time * scale, e.motion / root, listed)
        for e in source.events[:20]
        for listed in [", ".join(f"{i:.13g}" for i in e.currents)]
    ]
    more = len(source.events) - len(events)
    note = "Regularised by dt = |cos q| ds: the crank speed is unbounded there, the speed of the platform is not."
    note += f" {more} more events are left out." if more > 0 else ""
    rows: list[tuple[object, ...]] = []
    for inertia, run in zip((*bare.inertias, None), (*bare.runs, source)):
        end = float(run.angle[-1]) if run.complete else run.reason
        apart, fastest = abs(run.angle[-1] - source.angle[-1]), float(abs(run.speed).max())
        of_run = ("none", end, None, "unbounded") if inertia is None else (f"{inertia:.0e}", end, apart, fastest)
        rows.append((*of_run, run.energy_error))
    columns = (
        "J_0 [kg m²]",
        f"angle at {source.time[-1]:g} s [rad] | .12g",
        "difference | .2e",
        "largest speed [rad/s] | .5g",
        "energy | .1e",
    )
    first = next((event for event in source.events if event.kind == "dead centre"), None)
    found = []
    if first is not None:
        unbounded = f"the crank speed is unbounded at each dead centre, first after {first.time:.4g} s"
        passes = f"the platform passes it at {abs(first.motion) / root:.4g} m/s (estimated)"
        found.append(Finding(f"Without rotor inertia {unbounded}; {passes}."))
    return (
        table("Without inertia: dead centres and reversals", _EVENT_COLUMNS, events, note, *found),
        table("The model without inertia as a limit", columns, rows, "Estimated; the largest speed at the samples."),
        Table("Method and errors of the run without inertia", ("", ""), balance_rows(source)),
    )


_EVENT_COLUMNS = (
    "event",
    "angle/π | .12g",
    "time t [s] | .14g",
    "fictitious time s [s] | .14g",
    "speed of the platform [m/s] | .13g",
    "current [A]",
)


def machine_table(context: Context) -> MachineDriveTable:
    """Return ``[mechanism.drive]`` of the scene."""
    table = getattr(context.scene.mechanism, "drive", None)
    if not isinstance(table, MachineDriveTable):
        raise SceneError(
            f"{context.scene.place / 'mechanism'} has no table [mechanism.drive], which the motor needs; add it or "
            "leave out drive_tables and drive_curves"
        )
    return table


def machine_drive(machine: SingleMotorPlatform, table: MachineDriveTable, resistance: float) -> MotorDrivenPlatform:
    """Build the drive of the real machine for an armature resistance (ohm)."""
    from graphsynth.systems.platform.motor_model import MotorDrivenPlatform

    shared = {name: getattr(table, name) for name in ("mass", "gyration", "wheel_inertia", "pinion_inertia")}
    motor, centre = dc_motor(table.motor, resistance), complex(*table.mass_centre)
    model = MotorDrivenPlatform.of_machine(machine, motor, mass_centre=centre, length=1.0, **shared)
    train = replace(model.train, efficiency=table.efficiency)
    return replace(model, train=train, friction=table.friction, load=table.load)


def drive_machine(context: Context, motions: tuple[Attempt, ...]) -> tuple[LabelledRun, ...]:
    """Drive the first candidate that moved from rest, for each armature resistance; nothing if none moved."""
    table = machine_table(context)
    moved: Any = next((a.value for a in motions if not a.failed), None)
    if moved is None:
        return ()
    with _refused(context, "drive"):
        return _runs(table, (machine_drive(moved.mechanism, table, r) for r in table.resistances))


def tables(context: Context, runs: tuple[LabelledRun, ...]) -> tuple[Table, ...]:
    """Inertia of the real machine at the crank, then every run."""
    if not runs:
        return ()
    model = runs[0].drive
    low, high, mean = model.inertia.range()
    rounding = max(model.inertia.truncation, 1e-13) * high
    quantities = [
        Quantity(f"{name} inertia of the platform at the crank", value, "kg m^2", "estimated", rounding)
        for name, value in (("smallest", low), ("largest", high), ("mean", mean))
    ]
    quantities += [
        Quantity("constant inertia of rotor, pinion and wheels", model.constant_inertia, "kg m^2", "exact"),
        Quantity("dead centres of the platform per rotation", len(model.inertia.dead_centres), "", "estimated"),
    ]
    note = "Series of the real motion over one rotation; the error is that of its truncation."
    return (quantity_table("Inertia seen by the motor", quantities, note), *run_tables(runs, headline=True))
