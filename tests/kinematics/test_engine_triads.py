"""All assembly modes of triads with sliding pairs, against Newton's method from many starts."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from graphsynth.kinematics import simulate
from graphsynth.kinematics.engine import start
from graphsynth.kinematics.engine.follow import Trace, Tracker
from graphsynth.kinematics.engine.program import compile_program
from graphsynth.kinematics.engine.start import sign_table
from graphsynth.kinematics.engine.triads import conditions, triad_modes
from graphsynth.mechanism.joints import Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

TRIAD = MechanismGraph(6, [(0, 1), (1, 3), (2, 3), (2, 4), (0, 4), (2, 5), (0, 5)], frame=0)
PAIRS = [(1, 3), (2, 3), (2, 4), (0, 4), (2, 5), (0, 5)]
#: Every set of sliding pairs that leaves no leg with two of them (a leg of two sliders fixes the direction).
SLIDING = [
    pairs for count in (1, 2, 3) for pairs in itertools.combinations(PAIRS, count)
    if all(sum(leg in pair for pair in pairs) < 2 for leg in (3, 4, 5))
]  # fmt: skip


def triad(seed: int, sliding: tuple[tuple[int, int], ...]) -> Mechanism:
    random = np.random.default_rng(seed)
    joints: list[Revolute | Prismatic] = []
    for a, b, _ in TRIAD.joints:
        x, y = random.normal(size=2)
        angle, shift = random.uniform(-3.0, 3.0), random.normal()
        if (a, b) in sliding:
            along = (x + shift * np.cos(angle), y + shift * np.sin(angle))
            joints.append(Prismatic(a, b, (x, y), along, angle, angle))
        else:
            joints.append(Revolute(a, b, (x, y), (x, y)))
    return Mechanism(TRIAD, joints, [Driver(0, 1)], pose=((0.0, 0.0, 0.0),) * 6)


def prepared(mechanism: Mechanism) -> tuple[Tracker, Trace, int]:
    program = compile_program(mechanism)
    tracker = Tracker(program, sign_table(program, {}))
    trace = tracker.blank(np.array([0.0]))
    tracker.seed(trace, np.zeros((6, 3)))
    tracker.run(trace, 0)
    return tracker, trace, len(program.steps) - 1


def apart(a: np.ndarray, b: np.ndarray) -> float:
    return float(max(np.abs(a[:2] - b[:2]).max(), abs(np.exp(1j * a[2]) - np.exp(1j * b[2]))))


@pytest.mark.parametrize("sliding", SLIDING)
def test_no_mode_is_missing(sliding: tuple[tuple[int, int], ...]) -> None:
    for seed in range(3):
        tracker, trace, step = prepared(triad(seed, sliding))
        held = conditions(tracker.program, step, trace.X[0])
        assert held is not None
        modes = triad_modes(held, tracker.program.Lc)
        searched = start._searched_modes(tracker, trace, step)[:, 0]
        assert all(min(apart(pose, mode) for mode in modes) < 1e-6 for pose in searched)
        assert min(apart(np.zeros(3), mode) for mode in modes) < 1e-9  # the drawn pose is one of them
        assert len(modes) % 2 == 0
        assert all(apart(a, b) > 1e-6 for a, b in itertools.combinations(modes, 2))


def test_every_mode_starts_a_motion() -> None:
    """Each rank gives a motion of its own whose joints close."""
    mechanism = triad(2, ((2, 4),))
    tracker, trace, step = prepared(mechanism)
    held = conditions(tracker.program, step, trace.X[0])
    assert held is not None
    count = len(triad_modes(held, tracker.program.Lc))
    motions = [simulate(mechanism, [0.0, 1e-4], modes={0: rank}) for rank in range(count)]
    assert count == 4
    for motion in motions:
        assert motion.completed and motion.residual < 1e-13
    starts = [motion.poses[0, 2] for motion in motions]
    assert all(apart(a, b) > 1e-3 for a, b in itertools.combinations(starts, 2))


def test_two_sliders_in_a_leg_fix_the_direction() -> None:
    """PP leg and two turning legs: the direction is known, two circles remain, hence two modes."""
    joints = [
        Revolute(0, 1), Revolute(1, 3, (0.3, 0.0), (0.0, 0.0)), Revolute(2, 3, (-0.4, 0.0), (1.0, 0.0)),
        Revolute(2, 5, (0.4, 0.0), (1.1, 0.0)), Revolute(0, 5, (1.6, 0.1)),
        Prismatic(2, 4, (0.0, 0.0), (0.0, 0.0), 0.0, 0.0), Prismatic(0, 4, (0.0, 2.0), (0.0, 0.0), 1.2, 1.4),
    ]  # fmt: skip
    mechanism = Mechanism(TRIAD, joints, [Driver(0, 1)])
    motions = [simulate(mechanism, np.linspace(0.0, 0.5, 6), modes={0: rank}) for rank in (0, 1)]
    for motion in motions:
        assert motion.completed and motion.residual < 1e-14
        np.testing.assert_allclose(motion.poses[:, 2, 2], -0.2, atol=1e-12)
    assert np.abs(motions[0].poses[0, 2] - motions[1].poses[0, 2]).max() > 0.1
