"""Compiled kernels of the planar engine.

The state of a link at one sample is a row of eleven numbers: x, y, cos theta, sin theta, theta (unwrapped; right only
where gears need it), the velocity (x', y', theta') and the acceleration.  Over many samples the same numbers lie in
arrays with the sample as last axis.
"""

from pathlib import Path

from graphsynth.compilation import drop_stale_kernels

drop_stale_kernels(Path(__file__).parent, Path(__file__).parents[1] / "codes.py")

from graphsynth.kinematics.engine.kernels.loops import rrr  # noqa: E402
from graphsynth.kinematics.engine.kernels.newton import newton  # noqa: E402
from graphsynth.kinematics.engine.kernels.running import run  # noqa: E402

__all__ = ["newton", "rrr", "run"]
