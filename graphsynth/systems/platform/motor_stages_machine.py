"""The motor of a single-motor platform: its real inertia over a turn, torque and speed for the resistances."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import GeometryError, SceneError, SpecError
from graphsynth.pipeline.motor_tables import quantity_table
from graphsynth.pipeline.products import Attempt, Picture, Quantity, Table
from graphsynth.pipeline.stages import Context
from graphsynth.systems.platform.motor_stages import LabelledRun, dc_motor
from graphsynth.systems.platform.motor_stages_pictures import run_pictures
from graphsynth.systems.platform.motor_stages_tables import run_tables
from graphsynth.systems.platform.motor_system import MachineDriveTable

if TYPE_CHECKING:
    from graphsynth.dynamics.driven.inertia import EffectiveInertia

__all__ = ["curves", "drive", "tables"]


def _table(context: Context) -> MachineDriveTable:
    table = getattr(context.scene.mechanism, "drive", None)
    if not isinstance(table, MachineDriveTable):
        raise SceneError(
            f"{context.scene.place / 'mechanism'} has no table [mechanism.drive], which the motor needs; add it or "
            "leave out drive_tables and drive_curves"
        )
    return table


def drive(context: Context, motions: tuple[Attempt, ...]) -> tuple[LabelledRun, ...]:
    """Drive the first candidate that moved from rest, for each armature resistance; nothing if none moved."""
    import numpy as np

    from graphsynth.systems.platform.motor_model import MotorDrivenPlatform

    table = _table(context)
    moved: Any = next((a.value for a in motions if not a.failed), None)
    if moved is None:
        return ()
    times = np.linspace(0.0, table.end, table.samples)
    found = []
    try:
        for resistance in table.resistances:
            model = MotorDrivenPlatform.of_machine(
                moved.mechanism,
                dc_motor(table.motor, resistance),
                mass=table.mass,
                gyration=table.gyration,
                mass_centre=complex(*table.mass_centre),
                wheel_inertia=table.wheel_inertia,
                pinion_inertia=table.pinion_inertia,
                efficiency=table.efficiency,
                friction=table.friction,
                load=table.load,
            )
            found.append(LabelledRun(resistance, model, model.simulate(times, rtol=table.tolerance)))
    except (SpecError, GeometryError) as error:
        raise (context.scene.place / "mechanism" / "drive").error(f"cannot be computed: {error}") from error
    return tuple(found)


def tables(context: Context, runs: tuple[LabelledRun, ...]) -> tuple[Table, ...]:
    """Inertia of the real machine at the crank, then every run."""
    if not runs:
        return ()
    model = runs[0].drive
    low, high, mean = model.inertia.range()
    rounding = max(model.inertia.truncation, 1e-13) * high
    quantities = [
        Quantity(f"{name} inertia of the platform at the crank", value, "kg m^2", "estimated", rounding)
        for name, value in (("least", low), ("largest", high), ("mean", mean))
    ]
    quantities.append(
        Quantity("constant inertia of rotor, pinion and wheels", model.constant_inertia, "kg m^2", "exact")
    )
    quantities.append(
        Quantity("dead centres of the platform in a turn", len(model.inertia.dead_centres), "", "estimated")
    )
    note = "Series of the real motion over a turn; its truncation is the error."
    return (quantity_table("What the motor feels", quantities, note), *run_tables(runs, told=True))


def curves(context: Context, runs: tuple[LabelledRun, ...]) -> tuple[Picture, ...]:
    """Torque, speed and phase portraits, the inertia over a turn, the torque at constant speed."""
    if not runs:
        return ()
    import numpy as np

    from graphsynth.drawing.plots import Line, line_plot

    model, table = runs[0].drive, _table(context)
    inertia: EffectiveInertia = model.inertia
    q = np.linspace(0.0, math.tau, 361)
    ticks = tuple(range(0, 361, 45))
    felt = 1e6 * (inertia.value(q) + model.constant_inertia)
    own = Line((), 1e6 * model.constant_inertia, "rotor, pinion, wheels", "soft", "--")
    turn = line_plot([Line(np.degrees(q), felt)], "wheel angle [°]", "inertia [kg mm²]", xticks=ticks, levels=[own])
    w = table.motor.speed / model.train.ratio
    held = line_plot(
        [Line(np.degrees(q), 1e3 * model.torque_at_speed(q, w))], "wheel angle [°]", "torque [mN m]", xticks=ticks
    )
    return (
        Picture(
            "Inertia at the crank", turn, "Of the real geometry: velocities of the platform per crank speed, squared."
        ),
        Picture("Torque that would keep the speed even", held, f"At the crank, at {w:g} rad/s: inverse dynamics."),
        *run_pictures(runs),
    )
