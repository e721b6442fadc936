"""Proofs about sharp mechanisms by the compiled walk along the branch of a motion, the one of the page.

If it decides everything, the certificate is that of the walk; else the search over arrays of boxes
(`graphsynth.jamming.joints.search`) has the question, as it has where the walk is not compiled ahead of time.
"""

from __future__ import annotations

import os
from functools import cache
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.compilation import named
from graphsynth.core.native.library import contents
from graphsynth.jamming.joints.limits import bounds
from graphsynth.jamming.joints.pieces import Found, Work
from graphsynth.mechanism.constraints import characteristic_length
from graphsynth.mechanism.joints import PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Linear

if TYPE_CHECKING:
    from graphsynth.jamming.joints.program import JointProblem
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]
#: Pieces of the whole range at least; the first step, in parts of the widest piece.
WIDEST, FIRST = 128, 0.25
#: Boxes between two looks at the clock, part of the time that the walk may take, pieces at most.
_SOME, _SHARE, _MOST = 256, 0.25, 20_000
_KERNEL = "graphsynth.jamming.joints.kernels.walking"
#: Relative width of a misalignment that only encloses a number.
_ROUNDING = 1e-9
_GUIDES = Prismatic | PinSlot


def walkable(given: JointProblem) -> bool:
    """Whether the walk knows all joints, the driver, the limits and the misalignments of a problem."""
    mechanism, layout = given.mechanism, given.layout
    if layout.loops == 0 or len(layout.joints) != len(mechanism.joints) or layout.rails:
        return False
    if len(mechanism.drivers) != 1 or mechanism.drivers[0].law != Linear():
        return False
    if not all(isinstance(joint, Revolute | _GUIDES) for joint in mechanism.joints):
        return False
    if not (np.isfinite(layout.limit_range).all() and np.isfinite(layout.end_float_range).all()):
        return False
    for place, _, tilt in layout.misalignments:
        ends = bounds(tilt, "alpha"), bounds(tilt, "direction")
        narrow = all(high - low <= _ROUNDING * max(abs(low), abs(high)) for low, high in ends)
        if not narrow or isinstance(mechanism.joints[layout.joints[place]], _GUIDES):
            return False
    return True


def asked_of(given: JointProblem) -> Any:
    """Return a problem as the kernels take it (`kernels.moving.Asked`)."""
    from graphsynth.jamming.joints.kernels.moving import Asked

    layout, joints = given.layout, given.mechanism.joints
    count = len(joints)
    guided, sizes, tilts = np.zeros(count, dtype=np.int64), np.zeros((count, 10)), np.zeros((count, 5))
    limits = np.zeros((3, count, 3))
    for k, (joint, own) in enumerate(zip(joints, given.limits)):
        sizes[k, :2], sizes[k, 3:5] = joint.at_a, joint.at_b
        if isinstance(joint, _GUIDES):
            guided[k], sizes[k, 2] = 1, joint.angle_a
        columns = [(c, name) for c, name in enumerate(own.tilts)]
        for c, name in [*columns, (2, "axial_clearance")]:
            limits[:, k, c] = getattr(own, name), *bounds(own, name)
    for place, sign, tilt in layout.misalignments:
        tilts[place] = *bounds(tilt, "alpha"), *bounds(tilt, "direction"), sign
    pairs, loops = layout.pairs.astype(np.int64), np.ascontiguousarray(layout.incidence, dtype=np.float64)
    return Asked._make([pairs, guided, sizes, *(own.copy() for own in limits), tilts, loops])


class Walk:
    """A walk from the lowest input of a motion to the highest one; ``pieces`` (N, 5) as the kernel writes them."""

    def __init__(self, given: JointProblem, motion: Motion, narrowest: float, most: int) -> None:
        from graphsynth.kinematics.certify.kernels.enclosing import Task
        from graphsynth.kinematics.engine.program import equations

        mechanism, keep = given.mechanism, np.flatnonzero(motion.assembled)
        inputs = motion.inputs[keep]
        low, self.goal = float(inputs.min()), float(inputs.max())
        pose = motion.poses[keep[int(np.argmin(inputs))]]
        rows, (table,) = equations(mechanism.joints, mechanism.dimensions[None], mechanism.drivers)
        turns, widest = np.zeros(len(rows)), (self.goal - low) / WIDEST
        self.task = Task(rows, table, mechanism.frame, turns, np.array([low]), 0)
        self.asked, self.length = asked_of(given), characteristic_length(mechanism)
        self.box, self.widths = np.zeros((4, *pose.shape)), np.array([narrowest, widest])
        self.box[0], self.state = pose, np.array([low, FIRST * widest, 0.0, 0.0, 0.0])
        self._found, self.code = np.zeros((most, 5)), -1

    @property
    def pieces(self) -> Array:
        """What is proved so far."""
        return self._found[: int(self.state[4])]

    @property
    def stuck(self) -> bool:
        """Whether there is no way on."""
        from graphsynth.kinematics.certify.kernels.marching import LIMIT

        return self.code != LIMIT

    def go(self, limit: int) -> bool:
        """Go on until so many boxes have been tested in all; whether the goal is reached (certified)."""
        (walk,) = named(_KERNEL, "walk")
        self.code = walk(
            self.task, self.asked, self.goal, self.length, self.box, self.state, limit, self.widths, self._found
        )
        return bool(self.code == 0)


@cache
def compiled() -> bool:
    """Whether the walk is in the library of kernels, or recorded for it: to compile it takes longer than a search."""
    return "GRAPHSYNTH_RECORD" in os.environ or any(name == f"{_KERNEL}.walk" for name, _, _ in contents())


def walked(work: Work, resolution: float, max_pieces: float, seconds: float) -> Found | None:
    """Return the pieces of a walk that decides all of the range (certified), or None."""
    if not compiled() or work.box.size or not walkable(work.given):
        return None
    most, end = int(min(max_pieces, _MOST)), perf_counter() + _SHARE * seconds
    walk = Walk(work.given, work.motion, resolution * (work.high - work.low), most)
    tested = 0
    while tested < most and perf_counter() < end:
        tested += _SOME
        if walk.go(min(tested, most)):
            low, high, lower, upper, state = walk.pieces.T
            if (state == 0.0).any():
                return None
            work.evaluated = len(low)
            found = Found.open(low, high, work.whole(len(low)), work.system.size)
            return found._replace(lower=lower, upper=upper, proved=state != 0.0, sure=state.astype(np.int8))
        if walk.stuck or (walk.pieces[:, 4] == 0.0).any():
            return None
    return None
