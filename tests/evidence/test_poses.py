"""Error against run time of poses, functions and cognates: what the rows say is true."""

from __future__ import annotations

from graphsynth.evidence.poses import cognates, five_poses, function_positions
from graphsynth.evidence.rows import Effort, RowStatus

QUICK = Effort(rounds=1, quick=True)


def test_five_poses_give_the_four_bar_back() -> None:
    problem = five_poses(None, QUICK)
    own, *others = problem.rows
    assert own.good and own.proved and own.error < 1e-12
    for row in others:  # one start finds one root at most, and two dyads are known
        assert row.good == (row.error < 1e-3) and (row.good or row.status is RowStatus.FAILED)
    assert not others[0].good and others[-1].good


def test_functions_give_the_four_bar_back() -> None:
    rows = function_positions(None, QUICK).rows
    assert [row.setting.partition(" ")[0] for row in rows] == ["3", "4", "5"]
    assert all(row.good and row.proved and row.error < 1e-12 for row in rows)


def test_cognates_draw_the_same_curve() -> None:
    """A four-bar has two cognates (Roberts), of which one has its driver."""
    rows = cognates(None, QUICK).rows
    assert rows[0].setting == "four-bar: 2 of 3"
    assert all(row.good and row.error < 1e-12 for row in rows)
    same, every = rows[1].setting.rpartition(": ")[2].split(" of ")
    assert 2 <= int(same) <= int(every)
