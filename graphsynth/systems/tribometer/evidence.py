"""``module = "tribometer"``: what is measured of stick and slip."""

from __future__ import annotations

from typing import Any

from graphsynth.evidence.rows import Effort, Problem

__all__ = ["events", "stick_slip"]

_PRECISE_S = 2.0


def _model(context: Any) -> Any:
    from graphsynth.systems.tribometer.stages import tribometer_of

    return tribometer_of(context)


def events(context: Any, effort: Effort) -> Problem:
    """Event-driven run against multiple precision, over the first seconds."""
    from graphsynth.systems.tribometer.evidence_stick_slip import event_problem

    duration = min(context.scene.mechanism.run.duration_s, 0.5 if effort.quick else _PRECISE_S)
    return event_problem(_model(context), duration, effort)


def stick_slip(context: Any, effort: Effort) -> Problem:
    """All methods over the duration of the scene, with its settings."""
    from graphsynth.systems.tribometer.evidence_stick_slip import stick_slip_problem

    table = context.scene.mechanism
    duration = min(table.run.duration_s, 1.0) if effort.quick else table.run.duration_s
    m = table.methods
    return stick_slip_problem(_model(context), duration, m.steps_s, m.speeds_m_s, m.solvers, effort)
