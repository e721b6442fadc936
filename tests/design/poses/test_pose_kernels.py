"""RR dyads in floating point, for the page: beside the proved ones, and by the distances that they keep."""

from __future__ import annotations

import math

import numpy as np
import pytest

from graphsynth.design.poses.curves import burmester_curves
from graphsynth.design.poses.dyads import dyads
from graphsynth.design.poses.kernels import candidates

pytestmark = pytest.mark.long  # kernels that the native library does not hold are compiled


def found(poses: np.ndarray, samples: int = 720) -> np.ndarray:
    """Pivots and joints in the first pose, complex, shape (n, 2)."""
    out = np.empty((4000, 4))
    count = candidates(poses, samples, out)
    return np.asarray(out[:count, 0::2] + 1j * out[:count, 1::2])


def random_poses(random: np.random.Generator, count: int) -> np.ndarray:
    return np.column_stack([random.normal(size=(count, 2)) * 3.0 + 5.0, random.uniform(-math.pi, math.pi, count)])


def spread(poses: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """How far the distance of two joints differs between poses, over the largest distance of anything."""
    z, turn = poses[:, 0] + 1j * poses[:, 1], np.exp(1j * (poses[:, 2] - poses[0, 2]))
    moved = z[:, None] + turn[:, None] * (pairs[:, 1] - z[0])
    lengths = np.abs(moved - pairs[:, 0])
    return np.asarray(np.ptp(lengths, axis=0) / (lengths.max(axis=0) + np.abs(pairs).max(axis=1)))


@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_candidates_keep_their_length_in_all_poses(count: int) -> None:
    random = np.random.default_rng(count)
    for _ in range(20):
        poses = random_poses(random, count)
        pairs = found(poses, 90)
        assert np.isfinite(pairs).all() and (count == 5 or len(pairs) > 20)
        assert not len(pairs) or spread(poses, pairs).max() < 1e-7


def test_five_poses_have_the_proved_dyads() -> None:
    random, known, seen = np.random.default_rng(1), 0, 0
    for _ in range(40):
        poses = random_poses(random, 5)
        proved = dyads(poses)
        assert proved.complete
        own = np.array([complex(*one.pivot) for one in proved])
        pairs = found(poses)
        # each is one of the proved ones; of them few are missed
        for pivot, _ in pairs:
            assert np.abs(own - pivot).min() < 1e-6 * (1.0 + abs(pivot))
        known += len(own)
        seen += sum(bool(len(pairs)) and np.abs(pairs[:, 0] - pivot).min() < 1e-6 * (1.0 + abs(pivot)) for pivot in own)
    assert known >= 60 and seen >= 0.97 * known


def test_four_poses_lie_on_the_centre_point_curve() -> None:
    random = np.random.default_rng(2)
    for _ in range(10):
        poses = random_poses(random, 4)
        centre = burmester_curves(poses).centre
        pairs = found(poses, 60)
        near = pairs[np.abs(pairs[:, 0]) < 1e3]
        far = centre.distances(np.column_stack([near[:, 0].real, near[:, 0].imag]))
        assert len(near) > 30 and far.max() < 1e-6


def test_poses_that_have_none_are_left_alone() -> None:
    shifted = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 1.0, 0.0], [3.0, 0.0, 0.0]]
    for poses in ([[1.0, 2.0, 0.3]] * 3, shifted, shifted[:1]):
        assert len(found(np.array(poses))) == 0
