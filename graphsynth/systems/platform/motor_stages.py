"""The motor-driven platform of a scene: runs for the resistances, without inertia, the claim, the limit L -> 0."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from graphsynth.core.errors import SpecError
from graphsynth.pipeline.products import Table
from graphsynth.pipeline.stages import Context
from graphsynth.systems.platform.motor_system import DCMotorTable, PlatformDriveTable

if TYPE_CHECKING:
    from graphsynth.dynamics.driven.reduction import ReductionStudy
    from graphsynth.dynamics.driven.run import DriveRun
    from graphsynth.dynamics.motors import DCMotor
    from graphsynth.systems.platform.motor_model import MotorDrivenPlatform
    from graphsynth.systems.platform.resistance import ResistanceEffect, RippleMap

__all__ = [
    "Claim", "LabelledRun", "WithoutInertia", "claim", "dc_motor", "drive", "drive_of", "limit", "solvers", "table_of",
    "without_inertia",
]  # fmt: skip


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

    return DCMotor(
        resistance=resistance,
        inductance=m.inductance if inductance is None else inductance,
        torque_constant=m.torque_constant,
        emf_constant=m.emf_constant,
        gain=m.gain,
        speed=m.speed if speed is None else speed,
        voltage_limit=math.inf if m.voltage_limit is None else m.voltage_limit,
        rotor_inertia=m.rotor_inertia,
        friction=m.friction,
    )


def drive_of(
    context: Context, resistance: float, inductance: float | None = None, speed: float | None = None
) -> MotorDrivenPlatform:
    """Build the drive of the scene for an armature resistance (ohm)."""
    from graphsynth.dynamics.driven.inertia import EffectiveInertia
    from graphsynth.systems.platform.motor_model import MotorDrivenPlatform

    table = table_of(context)
    moved = table.platform
    motor = dc_motor(table.motor, resistance, inductance, speed)
    return MotorDrivenPlatform(
        EffectiveInertia.of_slider(moved.mass, moved.amplitude), motor, base_inertia=moved.inertia,
        friction=moved.friction, load=moved.load,
    )  # fmt: skip


def _refuse(context: Context, error: SpecError, *place: str) -> Exception:
    at = context.scene.place / "mechanism"
    for key in place:
        at = at / key
    return at.error(f"cannot be computed: {error}")


def drive(context: Context) -> tuple[LabelledRun, ...]:
    """Integrate from rest for each armature resistance."""
    import numpy as np

    table = table_of(context)
    times = np.linspace(0.0, table.end, table.samples)
    found = []
    try:
        for resistance in table.resistances:
            model = drive_of(context, resistance)
            found.append(LabelledRun(resistance, model, model.simulate(times, rtol=table.tolerance)))
    except SpecError as error:
        raise _refuse(context, error) from error
    return tuple(found)


def without_inertia(context: Context) -> WithoutInertia:
    """Run the regularised model of the source, then the model with ever smaller inertia."""
    from dataclasses import replace

    import numpy as np

    table = table_of(context)
    w = table.without_inertia
    times = np.linspace(0.0, w.end, 501)
    try:
        full = drive_of(context, w.resistance, w.inductance)
        motor = replace(full.motor, rotor_inertia=0.0)
        bare = replace(full, motor=motor, base_inertia=0.0)
        source = bare.simulate(times, speed=w.start_speed, rtol=1e-12)
        runs = tuple(
            replace(bare, base_inertia=value).simulate(times, speed=w.start_speed, rtol=1e-11) for value in w.inertias
        )
    except SpecError as error:
        raise _refuse(context, error, "without_inertia") from error
    return WithoutInertia(source, w.inertias, runs)


def claim(context: Context) -> Claim:
    """Linear criterion and simulated ripples for the cases; the simulated map."""
    import numpy as np

    from graphsynth.systems.platform.resistance import resistance_effect, ripple_map

    c = table_of(context).claim
    first, last = c.resistances[0], c.resistances[-1]
    try:
        effects = {
            f"L = {L:g} H, w_d = {speed:g} rad/s": resistance_effect(
                drive_of(context, first, L, speed), c.resistances, simulate=True, revolutions=c.revolutions
            )
            for L, speed in c.cases
        }
        values = np.geomspace(first, last, c.map_resistances)
        mapped = ripple_map(
            drive_of(context, first), values.tolist(), c.map_inductances, revolutions=c.revolutions
        )  # fmt: skip
    except SpecError as error:
        raise _refuse(context, error, "claim") from error
    return Claim(effects, mapped)


def limit(context: Context) -> ReductionStudy | None:
    """Compare inductances with the limit L -> 0; None if the scene names none."""
    import numpy as np

    t = table_of(context).limit
    if not t.inductances:
        return None
    times = np.linspace(0.0, t.end, 26)
    transient = 20.0 * max(t.inductances) / t.resistance if t.resistance > 0.0 else 0.0
    try:  # the same times for every inductance
        after = min(transient, 0.5 * t.end)
        return drive_of(context, t.resistance).inductance_study(times, t.inductances, after=after)
    except SpecError as error:
        raise _refuse(context, error, "limit") from error


def solvers(context: Context) -> tuple[Table, ...]:
    """Error against run time beside scipy; not part of the shipped outputs."""
    import numpy as np

    from graphsynth.evidence.drives import drive_work_precision, rows_as_text

    table = table_of(context)
    model = drive_of(context, table.resistances[0])
    try:
        found = drive_work_precision(model, np.linspace(0.0, table.end, 11))
    except SpecError as error:
        raise _refuse(context, error) from error
    return (Table("Error against run time", *rows_as_text(found)),)
