"""Error against run time of probabilities: the bounds hold the quadrature, random members come near it."""

from graphsynth.evidence.chance import binding_probability, chance_problem
from graphsynth.evidence.rows import Effort


def test_bounds_hold_the_quadrature_and_are_as_narrow_as_asked() -> None:
    found = chance_problem(Effort(quick=True))
    assert all(row.good for row in found.rows)
    assert all(row.error <= row.value for row in found.of("proved bounds"))
    assert found.of("random members")[-1].error < 0.02
    assert 0.28 < binding_probability() < 0.29
