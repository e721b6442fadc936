"""A mechanism with limits and misalignments: what solvers and certificates start from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Bearing, Condition
from graphsynth.jamming.joints.closure import ROLL, ROUND, Layout, joint_places, lay_out, shifts
from graphsynth.jamming.joints.limits import Limits, Misalignment, complete
from graphsynth.jamming.joints.program import Mode, PoseSolution, solve_poses

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism

__all__ = ["Bearings", "Problem", "check_motion", "problem"]

Array = NDArray[np.float64]
Bearings: TypeAlias = Bearing | Limits | Mapping[tuple[int, int], Bearing | Limits]


@dataclass(frozen=True, eq=False)
class Problem:
    """A mechanism with limits and misalignments; what the solvers and the certificates start from."""

    mechanism: Mechanism
    limits: tuple[Limits, ...]
    misalignments: tuple[Misalignment, ...]
    layout: Layout

    @property
    def names(self) -> tuple[tuple[tuple[int, int], str], ...]:
        """Joint and kind of every limit on tilt."""
        kinds = ["tilt" if axis == ROUND else "roll" if axis == ROLL else "pitch" for axis in self.layout.block_axis]
        return tuple((self.pairs[place], kind) for place, kind in zip(self.layout.block_joint, kinds))

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Links of every joint of the layout."""
        return tuple(self.mechanism.joints[k].pair for k in self.layout.joints)

    def solve(self, poses: Array, mode: Mode = "tilt", turned: float = 0.0) -> PoseSolution:
        """Solve at poses (N, links, 3); all misalignments turned by ``turned`` radians."""
        r, e, base = joint_places(self.mechanism, self.layout.joints, poses)
        return solve_poses(self.layout, r, e, shifts(self.layout, base, turned), mode)


def check_motion(motion: Any) -> None:
    """Refuse anything that is no `Motion`."""
    from graphsynth.kinematics.simulation import Motion

    if not isinstance(motion, Motion):
        raise GeometryError(f"motion = {motion!r} is no Motion; give the result of simulate(mechanism, inputs)")


def problem(
    mechanism: Mechanism, bearings: Bearings, tilts: Misalignment | Iterable[Misalignment], condition: Condition = "A"
) -> Problem:
    """Put a mechanism, limits and misalignments together; see `assess_coupled` for the arguments.

    Raises
    ------
    GeometryError
        A joint without limits, limits that do not fit a joint, a misalignment of a joint that does not exist.
    """
    chosen = tuple(tilts) if isinstance(tilts, Iterable) else (tilts,)
    for tilt in chosen:
        if not isinstance(tilt, Misalignment):
            raise GeometryError(
                f"tilts = {tilt!r} is no misalignment; give Misalignment(base, link, alpha), or several"
            )
    by_pair: dict[tuple[int, int], Misalignment] = {}
    for tilt in chosen:
        pair = (min(tilt.base, tilt.link), max(tilt.base, tilt.link))
        mechanism.joint(*pair)  # raises if there is none
        if pair in by_pair:
            raise GeometryError(f"joint {pair[0]}-{pair[1]} has two misalignments; give their sum")
        by_pair[pair] = tilt
    limits = complete(mechanism.joints, bearings, by_pair, condition)
    return Problem(mechanism, limits, chosen, lay_out(mechanism, limits, chosen))
