"""The compiled walk, of the library and of the page, beside single poses, the search over boxes and links in space."""

from __future__ import annotations

import json
import math
from functools import cache

import numpy as np
import pytest
from spatial_oracle import spatial
from test_exact_tilts import case, joint_limits

from graphsynth.jamming.joints import JointLimits, Misalignment, SlideLimits
from graphsynth.jamming.joints.pieces import Work
from graphsynth.jamming.joints.program import problem
from graphsynth.jamming.joints.walked import Walk, walkable
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism import gallery
from graphsynth.mechanism.files import to_dict
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.model import Mechanism
from graphsynth.workbench.posing import assembled

NAMES = ["stephenson_six_bar", "toggle_press", "whitworth_quick_return", "klann"]


@cache
def turning():
    """Mechanisms that turn, of four, six and eight links, with sliders; as a file keeps them, in a closed pose."""
    own = [Mechanism.four_bar(2.0, 1.0, 2.5, 2.5), Mechanism.slider_crank(1.0, 3.0, 0.2)]
    own += [getattr(gallery, name)() for name in NAMES]
    return [Mechanism.from_json(json.dumps(to_dict(assembled(mechanism)))) for mechanism in own]


def cases(seed, each):
    """Motions with random limits and a misalignment of a revolute joint, scaled to bind a little or nearly."""
    random, found = np.random.default_rng(seed), []
    for mechanism in turning():
        motion = simulate(mechanism, np.linspace(0.0, math.tau, 361), events=False)
        assert motion.completed
        for _ in range(each):
            angles = 10.0 ** random.uniform(-2.5, -1.5, (len(mechanism.joints), 2))
            play = random.choice([0.0, 0.01], len(mechanism.joints))
            limits = {
                joint.pair: JointLimits(one, end) if isinstance(joint, Revolute) else SlideLimits(one, two, end)
                for joint, (one, two), end in zip(mechanism.joints, angles.tolist(), play.tolist())
            }
            seats = [joint for joint in mechanism.joints if isinstance(joint, Revolute)]
            own = seats[int(random.integers(len(seats)))]
            base, link = own.pair if random.random() < 0.5 else own.pair[::-1]
            turned = float(random.uniform(0.0, 6.0))
            rigid = bool(random.random() < 0.5)
            one = problem(mechanism, limits, Misalignment(base, link, 1e-3, turned, rigid=rigid))
            factors = one.solve(motion.poses, "scale").lower
            wanted = random.choice([0.98, 0.999, 1.003, 1.05, 2.0])
            about = factors.max() if random.random() < 0.5 else np.median(factors)
            alpha = min(1e-3 * wanted / float(about), 0.2) if about > 0.0 and math.isfinite(about) else 1e-3
            found.append((motion, limits, Misalignment(base, link, alpha, turned, rigid=rigid)))
    return found


def walked(motion, limits, tilt):
    given = problem(motion.mechanism, limits, tilt)
    walk = Walk(given, motion, 1e-4 * math.tau, 20_000)
    walk.go(20_000)
    return given, walk.pieces


@pytest.mark.slow  # numba compiles the kernel
def test_the_walk_never_contradicts_single_poses_or_the_search(seed=1, each=2):
    """Proved bounds hold at poses inside every piece, and no piece that is decided is decided otherwise there."""
    decided = {1: 0, -1: 0}
    for motion, limits, tilt in cases(seed, each):
        given, pieces = walked(motion, limits, tilt)
        assert walkable(given)
        if len(pieces) == 0:
            continue
        assert (pieces[1:, 0] == pieces[:-1, 1]).all() and pieces[0, 0] == 0.0
        share = np.random.default_rng(seed).uniform(0.0, 1.0, len(pieces))
        at = pieces[:, 0] + share * (pieces[:, 1] - pieces[:, 0])
        here = simulate(motion.mechanism, np.concatenate([[0.0], at]), start=motion.poses[0], events=False)
        assert here.assembled.all()
        true = given.solve(here.poses[1:], "scale")
        assert (pieces[:, 2] <= true.upper * (1.0 + 1e-9)).all()
        assert (pieces[:, 3] >= true.lower * (1.0 - 1e-9)).all()
        state = pieces[:, 4]
        assert not ((state == 1) & (true.lower > 1.0)).any() and not ((state == -1) & (true.upper < 1.0)).any()
        # the search over arrays of boxes, of another arithmetic for the positions and the exact tilts, at points
        other = Work(given, motion, 0.0).evaluate(at, at).sure
        assert not (state * other == -1).any()
        for sign in (1, -1):
            decided[sign] += int((state == sign).sum())
    assert min(decided.values()) > 150 * each


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["bearings", "rigid"])
def test_links_placed_in_space_agree_with_the_walk(kind, seed):
    """Near the verge, where exact and small tilts differ: what is proved is what optimization in space finds."""
    rng = np.random.default_rng([seed, len(kind)])
    mechanism, motion, tilt, limits, factor = case(rng, kind)
    u = float(motion.inputs[0])
    short = simulate(mechanism, [u, u + 1e-4], start=motion.poses[0], events=False)
    for away in (*rng.uniform(-3.0, 3.0, 3), -15.0, 15.0):
        scale = factor * (1.0 + away * tilt.alpha**2)
        given = problem(mechanism, joint_limits(limits, scale), tilt)
        assert walkable(given)
        walk = Walk(given, short, 1e-5, 100)
        walk.go(3)
        low, _, lower, upper, state = walk.pieces[0].tolist()
        assert low == u and lower <= 1.0 / (1.0 + away * tilt.alpha**2) + 1e-9 and upper > lower
        own = {pair: (t * scale, s * scale) for pair, (t, s) in limits.items()}
        least, missed = spatial(mechanism, motion.poses[0], tilt, own).least_factor(6)
        assert missed < 1e-6
        assert state == 0.0 or (least < 1.0 + 1e-6 if state > 0.0 else least > 1.0 - 1e-6)
        if abs(away) == 15.0 and kind == "rigid":
            assert state == np.sign(away)
