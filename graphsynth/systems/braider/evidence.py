"""``module = "braider"``: what is measured of the braiding mechanism."""

from __future__ import annotations

from typing import Any

from graphsynth.evidence.rows import Effort, Problem


def _braider(context: Any) -> Any:
    from graphsynth.systems.braider.stages import braider_of

    return braider_of(context)


def start_up(context: Any, effort: Effort) -> Problem:
    """Start from rest with all currents."""
    from graphsynth.evidence.drives import drive_problem
    from graphsynth.systems.braider.evidence_four_bar import shape_of_braider

    b = _braider(context)
    end = context.scene.mechanism.start.end_s
    return drive_problem(b.plant(), b.motor, b.train, end, effort, shape=shape_of_braider(b))


def linkage_dynamics(context: Any, effort: Effort) -> Problem:
    """Measure the linkage without motor and thread, free to move from the speed of the scene."""
    from graphsynth.evidence.dynamics import Truth, dynamics_problem
    from graphsynth.evidence.precise_drive import NAME
    from graphsynth.systems.braider.evidence_four_bar import free_linkage, precise_swing

    braider, speed = _braider(context), context.scene.mechanism.speed_rad_s
    model, start = free_linkage(braider, speed)
    end, name = 1.0 if effort.quick else 2.0, "the braider's linkage, free"
    truth = Truth(lambda times: precise_swing(braider, speed, times, model.gravity), f"closed loop, {NAME}")
    return dynamics_problem(model, start, end, name, effort, truth=truth)


def positions(context: Any, effort: Effort) -> Problem:
    """Measure positions of the linkage over a turn."""
    from graphsynth.evidence.position import four_bar, position_problem
    from graphsynth.mechanism.four_bar import TiltedFourBar

    bar = _braider(context).linkage
    linkage = TiltedFourBar(bar.frame, bar.crank, bar.coupler, bar.rocker, sgn=bar.branch)
    mechanism, closed = four_bar(linkage)
    return position_problem(mechanism, "the braider's linkage", closed, effort=effort)
