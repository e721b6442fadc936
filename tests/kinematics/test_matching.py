"""Points of open paths are passed in order: least sums against all sequences, and the whole curve that passes them."""

from __future__ import annotations

import math
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.kinematics.dimensional.matching import MovingLink, Wanted, at_times, in_order


def drawn(z: Any, v: Any, u: Any, period: float = 0.0) -> MovingLink:
    """A link that does not turn, its origin at points with velocities."""
    still = np.zeros_like(u)
    frames = np.stack([z.real, z.imag, still + 1.0, still], axis=-1)
    return MovingLink(u, frames[None], np.stack([v.real, v.imag, still], axis=-1)[None], period)


def distances(own: MovingLink, times: Any, goal: Any) -> Any:
    at = at_times(own, times)[0][0]
    return np.abs(at[:, 0] + 1j * at[:, 1] - goal)


def wanted(goal: Any) -> Wanted:
    return Wanted(goal, None, float(np.abs(goal - goal.mean()).max()), False, free=False)


def test_no_sequence_of_samples_comes_nearer() -> None:
    random = np.random.default_rng(7)
    every = np.array([*combinations_with_replacement(range(9), 4)])
    for _ in range(30):
        z = random.normal(size=9) + 1j * random.normal(size=9)
        goal = random.normal(size=4) + 1j * random.normal(size=4)
        own = drawn(z, np.gradient(z), np.arange(9.0))
        square = np.abs(z - goal[:, None]) ** 2
        sums = square[np.arange(4), every]
        best = sums[sums.sum(axis=1).argmin()]
        times = in_order(own, wanted(goal))
        assert (np.diff(times[0]) >= 0.0).all()
        assert distances(own, times, goal).max() <= np.sqrt(best.max()) + 1e-12


@pytest.mark.parametrize("closed", [False, True])
def test_a_curve_passes_its_own_points_however_unevenly_they_lie(closed: bool) -> None:
    """Half of the points on a tenth of the curve, where a few guesses of times do not always get."""
    found = gs.simulate(
        gs.Mechanism.four_bar(4.0, 1.5, 3.5, 3.0, coupler_point=(1.6, 1.9)), np.linspace(0.0, math.tau, 721)
    ).point("P")
    z, v = (own @ [1.0, 1.0j] for own in (found.position, found.velocity))
    own = drawn(z, v, np.linspace(0.0, math.tau, 721), math.tau if closed else 0.0)
    at = np.sort(np.concatenate([np.linspace(0.3, 0.6, 60), np.linspace(0.7, 5.9, 40)]))
    at = at + 2.0 if closed else at  # beyond the end of a turn
    goal = at_times(own, at[None])[0][0, :, :2] @ [1.0, 1.0j]
    size = wanted(goal).size
    assert distances(own, in_order(own, wanted(goal)), goal).max() < 1e-9 * size
