"""Arguments of the public functions that are not what they should be: a sentence, never another exception."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

from graphsynth.core.errors import GraphsynthError
from graphsynth.kinematics import simulate, simulate_batch
from graphsynth.kinematics.certify import certify
from graphsynth.kinematics.dimensional import PathGoal, PosesGoal, embody
from graphsynth.kinematics.engine.batch import solve_rrr
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.systems.antenna import PointingMechanism
from graphsynth.systems.piston import rotary_assignments
from graphsynth.systems.platform import certify_assembly_modes, certify_direct, certify_direct_batch, certify_full_turn
from graphsynth.systems.platform.parallel_platform import ParallelPlatform
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

CYCLE = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
JOINTS = [
    Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (3.0, 0.0), (3.5, 0.0)), Revolute(0, 3, (4.0, 0.0)),
]  # fmt: skip
FOUR_BAR = Mechanism(CYCLE, JOINTS, [Driver(0, 1)])
G1, LAMBDA = ParallelPlatform.g1(), TiltedFourBar()


@cache
def motion() -> Any:
    """Made on first use: a worker that only collects this file compiles nothing."""
    return simulate(FOUR_BAR, [0.0, 0.1])


CALLS: dict[str, Callable[[Any], Any]] = {
    "mechanism of simulate": lambda bad: simulate(bad, [0.0]),
    "inputs of simulate": lambda bad: simulate(FOUR_BAR, bad),
    "modes of simulate": lambda bad: simulate(FOUR_BAR, [0.0], modes=bad),
    "start of simulate": lambda bad: simulate(FOUR_BAR, [0.0], start=bad),
    "mechanism of a batch": lambda bad: simulate_batch(bad, [0.0], FOUR_BAR.dimensions[None]),
    "dimensions of a batch": lambda bad: simulate_batch(FOUR_BAR, [0.0], bad),
    "points of dyads": lambda bad: solve_rrr(bad, [[1.0, 0.0]], 1.0, 1.0),
    "length of dyads": lambda bad: solve_rrr([[0.0, 0.0]], [[1.0, 0.0]], bad, 1.0),
    "graph of a mechanism": lambda bad: Mechanism(bad, JOINTS),
    "joints of a mechanism": lambda bad: Mechanism(CYCLE, bad),
    "drivers of a mechanism": lambda bad: Mechanism(CYCLE, JOINTS, bad),
    "points of a mechanism": lambda bad: Mechanism(CYCLE, JOINTS, points=bad),
    "pose of a mechanism": lambda bad: Mechanism(CYCLE, JOINTS, pose=bad),
    "motion of certify": certify,
    "boxes of certify": lambda bad: certify(motion(), max_boxes=bad),
    "seconds of certify": lambda bad: certify(motion(), seconds=bad),
    "platform of a certified turn": certify_full_turn,
    "angles of certified modes": lambda bad: certify_direct(G1, bad),
    "angles of certified modes in bulk": lambda bad: certify_direct_batch(G1, bad),
    "anchors of certified modes": lambda bad: certify_assembly_modes(bad, G1.b, G1.l2),
    "lengths of certified modes": lambda bad: certify_assembly_modes(G1.D, G1.b, bad),
    "points of a path": PathGoal,
    "poses of a goal": lambda bad: PosesGoal(bad, [0.0, 1.0, 2.0]),
    "seconds of embody": lambda bad: embody(CYCLE, seconds=bad),
    "joints of embody": lambda bad: embody(CYCLE, joints=bad),
    "driver of embody": lambda bad: embody(CYCLE, driver=bad),
    "start of a stroke": lambda bad: LAMBDA.straightness(start=bad),
    "stop of a stroke": lambda bad: LAMBDA.straightness(stop=bad),
    "samples of a stroke": lambda bad: LAMBDA.straightness(samples=bad),
    "length of a linkage": lambda bad: TiltedFourBar(l1=bad),
    "axis of a linkage": lambda bad: TiltedFourBar(axis=bad),
    "length of a pointing mechanism": lambda bad: PointingMechanism(l1=bad),
    "lengths of a platform": lambda bad: SingleMotorPlatform(l1=bad),
    "pivots of a platform": lambda bad: SingleMotorPlatform(pivot=bad),
    "gears of a platform": lambda bad: SingleMotorPlatform(gears=bad),
    "seed of the assignments": rotary_assignments,
}


BAD = {
    "text": "x", "nan": np.nan, "text inside": (1, 1, "a"), "object": object(), "ragged": [[1], [2, 3]],
    "too large for a float": 10**400, "bytes": b"1", "complex": 1j * np.inf,
}  # fmt: skip


@pytest.mark.parametrize("bad", BAD.values(), ids=BAD)
@pytest.mark.parametrize("name", CALLS)
def test_bad_argument_is_told_in_a_sentence(name: str, bad: object) -> None:
    with pytest.raises(GraphsynthError):
        CALLS[name](bad)
