"""Start poses through the planar engine: the drivers at given coordinates, the assembly modes chosen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.mechanism.laws import Linear
from graphsynth.mechanism.model import Mechanism

__all__ = ["pose_from_drivers"]

Array = NDArray[np.float64]


def pose_from_drivers(
    mechanism: Mechanism, wanted: Sequence[tuple[Any, float]], modes: Mapping[int, int]
) -> Array | None:
    """Poses (links, 3) with the drivers at given coordinates (key, value) in their order; None if out of reach."""
    from graphsynth.kinematics.simulation import simulate

    drivers = []
    for driver, (key, value) in zip(mechanism.drivers, wanted):
        sense = 1.0 if tuple(key) == (driver.base, driver.link) else -1.0
        drivers.append(replace(driver, law=Linear(0.0, sense * float(value))))
    motion = simulate(replace(mechanism, drivers=tuple(drivers)), [0.0], modes=modes, events=False)
    return np.array(motion.poses[0]) if motion.assembled[0] else None
