"""``module = "pointing"``: what is measured of the antenna."""

from __future__ import annotations

from typing import Any

from graphsynth.evidence.rows import Effort, Problem

__all__ = ["poses"]


def poses(context: Any, effort: Effort) -> Problem:
    """Poses over the sweep of the scene."""
    from graphsynth.systems.antenna.evidence_poses import pose_problem
    from graphsynth.systems.antenna.stages import antenna_of

    antenna = antenna_of(context)
    return pose_problem(antenna, context.scene.mechanism.sweep.largest, effort)
