"""Paths followed with many digits end where those in double precision end, and where these are lost."""

import numpy as np
import pytest

from graphsynth.design import four_bars_through
from graphsynth.design.nine_points.digits import follow_with_digits
from graphsynth.design.nine_points.following import follow, shipped
from graphsynth.design.nine_points.task import read_task


@pytest.fixture(scope="module")
def paths():
    task = read_task([(0, 0), (1, 0.5), (2, 0.7), (3, 0.5), (4, 0)], [(1, -2), (3, -2.5)])
    begin = shipped(2).turned(np.exp(1j * np.array([1.0, 2.5])) / np.abs(shipped(2).end[:4]).mean())
    return task, begin, follow(begin, task.end)


@pytest.mark.long
@pytest.mark.parametrize("k", [0, 7, 30])
def test_both_end_at_the_same_root(paths, k):
    task, begin, ends = paths
    found = follow_with_digits(begin.z[k], begin.end, task)
    assert found is not None and np.abs(found - ends[k]).max() < 1e-11 * (1.0 + np.abs(ends[k]).max())
    assert np.array_equal(found[[0, 1, 4, 5]], task.held.mid.ravel())


def test_what_is_no_root_is_not_followed(paths):
    task, begin, _ = paths
    assert follow_with_digits(begin.z[0] * 1.5, begin.end, task) is None
    assert follow_with_digits(np.zeros(8, dtype=complex), begin.end, task) is None


@pytest.mark.slow
def test_a_path_that_doubles_lose(plant):
    """1441 triples are proved without many digits."""
    linkage = plant(80, 9)
    found = four_bars_through(linkage.points)
    assert (found.certified, found.complete) == (1442, True) and linkage.among(found.linkages)
