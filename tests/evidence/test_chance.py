"""Error against run time of probabilities: the bounds hold plain formulas, random members come near them."""

import pytest

from graphsynth.evidence import Effort, chance
from graphsynth.evidence.rows import RowStatus

QUICK = Effort(rounds=1, quick=True)


@pytest.mark.parametrize(
    "measure", [chance.probability, pytest.param(chance.joints_probability, marks=pytest.mark.slow)]
)
def test_bounds_hold_the_formula_and_are_as_narrow_as_asked(measure):
    found = measure(None, QUICK)
    assert all(row.good for row in found.rows)
    assert all(row.error <= row.value for row in found.of("proved bounds"))
    assert found.of("random members")[-1].error < 0.02
    assert 0.28 < chance.binding_probability() < 0.29


def test_bounds_that_miss_are_failures(monkeypatch):
    right = chance.binding_probability()
    monkeypatch.setattr(chance, "binding_probability", lambda: right + 0.02)
    rows = chance.probability(None, QUICK).of("proved bounds")
    assert {row.reason for row in rows} == {"the reference lies outside of what is proved"}


@pytest.mark.slow
def test_allocation_costs_no_more_than_the_best_by_quadrature():
    problem = chance.allocation(None, QUICK)
    default = next(row for row in problem.rows if row.default)
    assert default.good and default.proved and default.error == 0.0
    assert problem.rows[0].status is RowStatus.FAILED  # one trial is not enough
