"""Error against run time of the search for a task and of nine points: what the rows say is true."""

from __future__ import annotations

import math

import pytest

from graphsynth.evidence.designs import hidden_task, nearest_curves, nine_points
from graphsynth.evidence.rows import Effort


@pytest.mark.long
def test_nine_points_are_all_found_and_proved() -> None:
    """The counts are those of the literature: 36, 243 and 1442 (Wampler, Morgan and Sommese)."""
    problem = nine_points(None, Effort(quick=True))
    said = [row.setting.rpartition(": ")[2] for row in problem.rows]
    assert said == ["36 of 36", "243 of 243", "1442 of 1442"]
    assert all(row.proved and row.good and 0.0 < row.error < 1e-6 for row in problem.rows)


@pytest.mark.long
def test_more_curves_and_candidates_come_nearer() -> None:
    """The same draws, more of them: the nearest of all in a larger index is at least as near as among a few."""
    problem = nearest_curves(None, Effort(quick=True))
    assert [row.setting.split()[0] for row in problem.rows] == ["1000", "2000", "2000", "2000"]
    few, usual, every = problem.rows[1:]
    assert every.error <= usual.error <= few.error < 0.2 and all(row.good for row in problem.rows)
    assert [row.default for row in problem.rows] == [False, False, True, False]


@pytest.mark.slow
def test_a_hidden_task_is_found_or_called_failed() -> None:
    problem = hidden_task(None, Effort(quick=True))
    for row in problem.rows:
        assert row.good == math.isfinite(row.error) and (row.good or "within the time" in row.reason)
        assert not row.good or row.error <= 0.002
