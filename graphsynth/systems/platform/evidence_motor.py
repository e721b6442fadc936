"""``module = "platform_drive"``: what is measured of the motor-driven platform."""

from __future__ import annotations

from typing import Any

from graphsynth.core.errors import GeometryError
from graphsynth.evidence.rows import Effort, Problem

__all__ = ["drive", "small_inductance"]


def drive(context: Any, effort: Effort) -> Problem:
    """Measure the run from rest for the first resistance."""
    from graphsynth.evidence.drives import drive_problem

    table = context.scene.mechanism
    from graphsynth.systems.platform.motor_stages import drive_of

    model = drive_of(context, table.resistances[0])
    return drive_problem(model.plant(), model.motor, model.train, table.end, effort)


def small_inductance(context: Any, effort: Effort) -> Problem:
    """Measure the limit L -> 0."""
    import numpy as np

    from graphsynth.evidence.drives import reduction_problem

    limit = context.scene.mechanism.limit
    if len(limit.inductances) < 3:
        raise GeometryError("the scene names fewer than three inductances, so there is no limit to compare")
    from graphsynth.systems.platform.motor_stages import drive_of

    model = drive_of(context, limit.resistance)
    return reduction_problem(model, np.linspace(0.0, limit.end, 26), limit.inductances, effort)
