"""The tribometer of a scene: the event-driven run, the cycle it settles to, the other methods beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from graphsynth.core.errors import GeometryError, SpecError
from graphsynth.pipeline.products import Table
from graphsynth.pipeline.stages import Context
from graphsynth.systems.tribometer.system import TribometerTable

if TYPE_CHECKING:
    from graphsynth.evidence.rows import Problem
    from graphsynth.systems.tribometer.cycles import LimitCycle
    from graphsynth.systems.tribometer.drives import Drive
    from graphsynth.systems.tribometer.model import Tribometer
    from graphsynth.systems.tribometer.stick_slip import StickSlipMotion


def table_of(context: Context) -> TribometerTable:
    """Return ``[mechanism]`` of the scene."""
    table = context.scene.mechanism
    assert isinstance(table, TribometerTable)
    return table


def tribometer_of(context: Context) -> Tribometer:
    """Build the tribometer of the scene; a number that makes no sense is an error of the scene."""
    from graphsynth.dynamics.friction.laws import StribeckLaw, TwoCoefficientLaw
    from graphsynth.systems.tribometer.model import Tribometer

    table = table_of(context)
    p, f = table.platform, table.friction
    part = "friction"
    try:
        law: StribeckLaw | TwoCoefficientLaw = TwoCoefficientLaw(f.static, f.kinetic, f.viscous)
        if f.stribeck_m_s is not None:
            law = StribeckLaw(f.static, f.kinetic, f.stribeck_m_s, f.exponent, f.viscous)
        part = "drive"
        drive = _drive(table)
        part = "platform"
        return Tribometer(
            p.mass_kg, p.stiffness_N_per_m, p.damping_N_s_per_m, p.load_N, p.gravity_m_s2, law, drive, p.x2_mm / 1e3,
            p.v2_m_s,
        )  # fmt: skip
    except (SpecError, GeometryError) as error:
        raise (context.scene.place / "mechanism" / part).error(f"cannot be used: {error}") from error


def _drive(table: TribometerTable) -> Drive:
    from graphsynth.systems.tribometer.drives import BeltDrive, CrankDrive, HarmonicDrive

    d = table.drive
    if d.kind == "belt":
        return BeltDrive(d.belt_m_s or 0.0)
    radius, speed = (d.radius_mm or 0.0) / 1e3, d.speed_rad_s or 0.0
    return HarmonicDrive(radius, speed) if d.kind == "harmonic" else CrankDrive(radius, (d.rod_mm or 0.0) / 1e3, speed)


def move(context: Context) -> StickSlipMotion:
    """Run the hybrid automaton."""
    import numpy as np

    run = table_of(context).run
    times = np.linspace(0.0, run.duration_s, run.samples)
    try:
        return tribometer_of(context).event_driven(run.duration_s, times=times, rtol=run.tolerance)
    except SpecError as error:
        raise (context.scene.place / "mechanism" / "run").error(f"cannot be used: {error}") from error


def cycle(context: Context) -> LimitCycle:
    """Find the periodic motion to which the tribometer settles."""
    from graphsynth.systems.tribometer.cycles import limit_cycle

    return limit_cycle(tribometer_of(context), most_turns=table_of(context).run.most_turns)


def methods(context: Context, motion: StickSlipMotion) -> Problem | None:
    """Compare the methods with the event-driven run; None if that one did not finish."""
    return _study(context, motion, table_of(context).methods.solvers)


def _study(context: Context, motion: StickSlipMotion, solvers: tuple[str, ...]) -> Problem | None:
    from graphsynth.systems.tribometer.accuracy import method_study

    table, model = table_of(context), tribometer_of(context)
    if not motion.complete:
        return None
    m = table.methods
    try:
        return method_study(
            model, table.run.duration_s, tolerances=m.tolerances, steps=m.steps_s, speeds=m.speeds_m_s,
            solvers=solvers, rounds=3,
        )  # fmt: skip
    except SpecError as error:
        raise (context.scene.place / "mechanism" / "methods").error(f"cannot be used: {error}") from error


def method_rows(study: Problem) -> tuple[tuple[str, ...], ...]:
    """Rows of a study, ready to print."""
    import math

    def shown(value: float, text: str) -> str:
        return "" if math.isnan(value) else text

    return tuple(
        (
            row.method, f"{row.value:.0e}", shown(row.error, f"{row.error:.2e}"),
            f"{row.more['event error [s]']:.1e}" if "event error [s]" in row.more else "",
            f"{row.more['steps or calls']:.0f}", shown(row.seconds, f"{1e3 * row.seconds:.2f}"), row.status.value,
            row.reason,
        )
        for row in study.rows
    )  # fmt: skip


METHOD_COLUMNS = (
    "method", "tolerance, step [s] or speed [m/s]", "error [m]", "event time [s]", "steps or calls", "time [ms]",
    "status", "",
)  # fmt: skip


def solvers(context: Context, motion: StickSlipMotion) -> tuple[Table, ...]:
    """Error against run time with every solver; some minutes, not part of the shipped outputs."""
    study = _study(context, motion, ("LSODA", "BDF", "Radau"))
    if study is None:
        return ()
    return (Table("Error against run time", METHOD_COLUMNS, method_rows(study), study.note),)
