"""How fast links through five poses are found, where a four-bar that does it is known; whether one is missed.

With times: ``pytest tests/bench/test_poses_speed.py --benchmark-enable -n0 -s -m "slow or not slow"``.  No time is
asserted: machines differ.
"""

from __future__ import annotations

import cmath
import math
import time

import numpy as np
import pytest

from graphsynth.design import dyads, four_bars_for_poses, six_bars_for_poses


def planted(rng):
    """Five poses of the coupler of a random four-bar, in any order on both branches; its dyads as (pivot, point)."""
    while True:
        ground, crank, coupler, rocker = rng.uniform(0.5, 3.0, 4)
        if ground + crank + coupler + rocker > 2.2 * max(ground, crank, coupler, rocker):
            break
    frame = rng.normal(size=2) @ [1, 1j], cmath.rect(1.0, rng.uniform(0, 2 * np.pi))
    mark = rng.normal(size=2) @ [1, 1j]  # origin of the body as seen from the crank pin
    poses = []
    while len(poses) < 5:
        pin = crank * cmath.exp(1j * rng.uniform(0, 2 * np.pi))
        reach = abs(ground - pin)
        cosine = (coupler**2 + reach**2 - rocker**2) / (2 * coupler * reach)
        if abs(cosine) < 0.999:
            turn = cmath.phase(ground - pin) + rng.choice([-1, 1]) * math.acos(cosine)
            at = frame[0] + frame[1] * (pin + cmath.exp(1j * turn) * mark)
            poses.append((at.real, at.imag, turn + cmath.phase(frame[1])))
    return poses, [(frame[0], -mark), (frame[0] + frame[1] * ground, coupler - mark)]


def missed(found, known):
    return [pair for pair in known if not any(
        abs(complex(*own.pivot) - pair[0]) + abs(complex(*own.point) - pair[1]) < 1e-6 for own in found
    )]  # fmt: skip


@pytest.mark.slow
def test_a_thousand_five_pose_problems():
    """Both dyads of every four-bar are among those found, and it is proved that there is no other."""
    rng, spent, counts = np.random.default_rng(2026), [], {2: 0, 3: 0, 4: 0}
    dyads(planted(rng)[0])
    for _ in range(1000):
        poses, known = planted(rng)
        begin = time.process_time()
        found = dyads(poses)
        spent.append(1e3 * (time.process_time() - begin))
        assert found.complete and not missed(found, known), (poses, known)
        counts[len(found)] += 1
    print(f"\n{counts} dyads; CPU ms: median {np.median(spent):.3g}, 99 % {np.quantile(spent, 0.99):.3g}, "
          f"largest {max(spent):.3g}")  # fmt: skip
    assert sum(counts.values()) == 1000 and counts[3] == 0  # roots of a real polynomial come in pairs


@pytest.mark.parametrize("what", ["dyads", "four-bars", "six-bars"])
def test_one_problem(benchmark, what):
    poses = [(0.87, 1.44, 0.6), (0.68, 1.86, 0.44), (-0.08, 2.22, 0.28), (-1.03, 1.92, 0.24), (-1.38, 1.29, 0.32)]
    run = {
        "dyads": lambda: dyads(poses),
        "four-bars": lambda: four_bars_for_poses(poses),
        "six-bars": lambda: six_bars_for_poses(poses, pivot=(-1, 0), joint=(0, 0), lengths=(2, 2)),
    }[what]
    assert len(benchmark(run)) == {"dyads": 4, "four-bars": 6, "six-bars": 43}[what]
