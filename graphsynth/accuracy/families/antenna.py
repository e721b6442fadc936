"""``module = "pointing"``: what is measured of the antenna."""

from __future__ import annotations

import math
from typing import Any

from graphsynth.accuracy.registry import build
from graphsynth.accuracy.rows import Effort, Problem

__all__ = ["poses"]


def poses(context: Any, effort: Effort) -> Problem:
    """Poses over the sweep of the scene."""
    from graphsynth.accuracy.pointing import pose_problem

    antenna = build("graphsynth.scenes.steps.antenna:antenna_of", context)
    return pose_problem(antenna, math.radians(context.scene.mechanism.sweep.largest_deg), effort)
