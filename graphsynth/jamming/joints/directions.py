"""The worst direction of a misalignment.

The factor on limits and plays is a seminorm of the misalignments (a maximum of linear functions of them), so turning
all of them by phi gives a seminorm of ``(cos phi, sin phi)``.  Between two directions that are delta apart it is at
most the larger of their values over ``cos(delta / 2)``: a grid bounds every direction.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.joints.limits import Misalignment
from graphsynth.jamming.joints.problem import Bearings, check_motion, problem

if TYPE_CHECKING:
    from graphsynth.kinematics.simulation import Motion

__all__ = ["DirectionMap", "direction_map"]

_MOST = 100_000

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DirectionMap:
    """Allowed scale over the direction and the input.

    Attributes
    ----------
    directions : ndarray, shape (m,)
        Angles by which all misalignments were turned, radians, in [0, pi): turning by pi changes nothing.
    inputs : ndarray, shape (n,)
    allowed_scale : ndarray, shape (m, n)
        Factor by which the misalignments may grow (estimated); NaN where not assembled.
    worst_direction, worst_input, smallest_scale : float
        Smallest entry and where.
    bound : float
        No direction between those of the grid has a smaller scale than this at the inputs given (exact consequence of
        the grid values).
    """

    directions: Array
    inputs: Array
    allowed_scale: Array
    worst_direction: float
    worst_input: float
    smallest_scale: float
    bound: float


def direction_map(
    motion: Motion,
    bearings: Bearings,
    tilts: Misalignment | Iterable[Misalignment],
    *,
    condition: Condition = "A",
    directions: int = 12,
) -> DirectionMap:
    """Turn all misalignments together through half a turn and find the worst direction.

    Parameters
    ----------
    motion, bearings, tilts, condition
        As for `graphsynth.jamming.joints.assess_coupled`.
    directions : int
        Number of directions over half a turn, at least 3.

    Returns
    -------
    DirectionMap
        Estimated at the grid.

    Raises
    ------
    GeometryError
        Fewer than 3 directions; a motion without an assembled sample.

    Notes
    -----
    Specification lambda_and_jamming, section 9.6: the direction of the tilt matters.
    """
    if not isinstance(directions, int | np.integer) or not 3 <= directions <= _MOST:
        few = "many" if isinstance(directions, int | np.integer) and directions > _MOST else "few"
        raise GeometryError(f"directions = {directions} are too {few} for a map; give a whole number, 3 to {_MOST}")
    check_motion(motion)
    given = problem(motion.mechanism, bearings, tilts, condition)
    keep = np.flatnonzero(motion.assembled)
    if keep.size == 0:
        raise GeometryError(f"no sample is assembled: {motion.reason}; choose other inputs")
    angles = math.pi * np.arange(directions) / directions
    scale = np.full((directions, len(motion.inputs)), np.nan)
    with np.errstate(divide="ignore"):
        for k, angle in enumerate(angles.tolist()):
            scale[k, keep] = 1.0 / given.solve(motion.poses[keep], "scale", angle).lower
    at = np.unravel_index(int(np.nanargmin(scale)), scale.shape)
    least = float(scale[at])
    return DirectionMap(
        directions=angles,
        inputs=motion.inputs,
        allowed_scale=scale,
        worst_direction=float(angles[at[0]]),
        worst_input=float(motion.inputs[at[1]]),
        smallest_scale=least,
        bound=least * math.cos(0.5 * math.pi / directions),
    )
