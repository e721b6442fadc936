"""``module = "single_motor_platform"``: what is measured of the platform with one motor."""

from __future__ import annotations

import math
from typing import Any

from graphsynth.core.errors import GeometryError
from graphsynth.evidence.rows import Effort, Problem

__all__ = ["assembly_modes", "double_root", "drive", "turn"]


def _mechanism(context: Any) -> Any:
    """Platform with the dimensions of the scene, as its stage builds it."""
    from graphsynth.systems.platform.stages import platform_of

    return platform_of(context)


def assembly_modes(context: Any, effort: Effort) -> Problem:
    """Measure all modes at angles that the drives reach during the turn."""
    import numpy as np

    from graphsynth.systems.platform.evidence_direct import mode_problem

    mechanism = _mechanism(context)
    psi = np.linspace(0.1, 0.1 + math.tau, 4 if effort.quick else 24, endpoint=False)
    theta = mechanism.drive(psi).theta
    return mode_problem(mechanism.platform, theta, mechanism.Lc, "the platform of the scene", effort)


def double_root(context: Any, effort: Effort) -> Problem:
    """Measure two modes that nearly merge."""
    from graphsynth.systems.platform.evidence_double_root import double_root_problem

    return double_root_problem(effort)


def turn(context: Any, effort: Effort) -> Problem:
    """Measure one branch followed over the turn."""
    from graphsynth.systems.platform.evidence_continuation import turn_problem

    return turn_problem(_mechanism(context), effort)


def drive(context: Any, effort: Effort) -> Problem:
    """Measure the motor that runs the platform up from rest, with the inertia of the real motion."""
    from graphsynth.evidence.drives import drive_problem
    from graphsynth.systems.platform.motor_model import MotorDrivenPlatform

    table = getattr(context.scene.mechanism, "drive", None)
    if table is None:
        raise GeometryError("the scene has no table [mechanism.drive], so no motor")
    from graphsynth.systems.platform.motor_stages import dc_motor

    motor = dc_motor(table.motor, table.resistances[0])
    model = MotorDrivenPlatform.of_machine(
        _mechanism(context), motor, mass=table.mass, gyration=table.gyration,
        mass_centre=complex(*table.mass_centre), wheel_inertia=table.wheel_inertia,
        pinion_inertia=table.pinion_inertia, efficiency=table.efficiency, friction=table.friction,
        load=table.load,
    )  # fmt: skip
    return drive_problem(model.plant(), model.motor, model.train, table.end, effort)
