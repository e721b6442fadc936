"""How fast all four-bars through given points are found and proved, beside the linear systems alone in LAPACK.

Run by the normal suite once each, without timing; with times: ``pytest tests/bench/test_nine_points_speed.py
--benchmark-enable -n0 -m "slow or not slow"``.  No time is asserted: machines differ.
"""

import time

import numpy as np
import pytest

from graphsynth.core.compilation import named
from graphsynth.design import four_bars_through
from graphsynth.design.nine_points.following import SETTINGS, shipped
from graphsynth.design.nine_points.task import free_unknowns, read_task

POINTS = [
    (2.41, 2.79), (3.14, 2.62), (2.81, 2.25), (2.11, 1.86), (1.64, 1.49), (1.37, 1.2), (1.34, 1.27), (1.34, 1.66),
    (1.46, 2.17),
]  # fmt: skip
PIVOTS = [(-0.09, 0.01), (2.87, 0.1)]


def systems(points, pivots):
    """How many linear systems the paths to a task solve, and their size."""
    (follow_all,) = named("graphsynth.design.nine_points.kernels.paths", "follow_all")
    task, start = read_task(points, pivots), shipped(len(pivots))
    free = np.array(free_unknowns(len(pivots)))
    ends = np.zeros((len(start.z), 3), dtype=np.int64)
    given = np.setdiff1d(np.arange(8), free)
    turn = np.exp(2j * np.pi * np.random.default_rng(0).uniform(size=2))
    begin = start.turned(turn / np.abs(start.end[: len(points) - 1]).mean())
    follow_all(begin.z, begin.end, task.end - begin.end, free, given, np.array(SETTINGS[0]), ends)
    return int(ends[:, 2].sum()), len(free)


@pytest.mark.parametrize("pivots", [2, 1, pytest.param(0, marks=pytest.mark.slow)])
def test_all_four_bars(benchmark, pivots):
    points, given = POINTS[: 9 - 2 * pivots], PIVOTS[:pivots]
    found = benchmark.pedantic(lambda: four_bars_through(points, given), rounds=3, warmup_rounds=1)
    assert found.complete
    if benchmark.stats:
        count, n = systems(points, given)
        A = np.random.default_rng(1).normal(size=(20_000, n, n)) + 1j * np.eye(n)
        begin = time.perf_counter()
        np.linalg.solve(A, A[:, :, :2])
        lapack = (time.perf_counter() - begin) / len(A) * count
        benchmark.extra_info["linear systems"] = count
        benchmark.extra_info["LAPACK for these alone / this"] = f"{lapack / benchmark.stats.stats.min:.3g}"
