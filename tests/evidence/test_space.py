"""Error against run time with every loop closed in space."""

import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.evidence import Effort, space
from graphsynth.evidence.space import space_problem
from graphsynth.mechanism.four_bar import TiltedFourBar


@pytest.mark.long
def test_the_exact_factor_and_its_proofs_beside_small_tilts():
    problem = space_problem(TiltedFourBar(), 0.1, Effort(rounds=1, quick=True))
    assert problem.methods == ("small tilts", "least factor in space", "proofs in space")
    assert problem.rows[0].error == pytest.approx(0.1**2 * (1 - 0.4**2) / 6, rel=0.01)  # third power of the tilt
    assert problem.rows[1].error < 1e-14
    assert all(row.good and row.proved and row.error == row.value for row in problem.of("proofs in space"))
    with pytest.raises(GeometryError, match="not assembled"):
        space_problem(TiltedFourBar(6.0, 1.0, 2.5, 2.5), 0.1, Effort(rounds=1, quick=True))


@pytest.mark.slow
@pytest.mark.parametrize("measure", [space.exact_turn, space.length_tolerances, space.exact_scale])
def test_proofs_over_a_range_leave_out_the_closed_form(measure, monkeypatch):
    rows = measure(None, Effort(rounds=1, quick=True)).rows
    assert all(row.good and row.proved and row.error > 0.0 for row in rows)
    if measure is space.exact_turn:
        coupled, exact = ([row.error for row in rows if row.method == name] for name in
                          ("small tilts and their remainder", "exact closure"))  # fmt: skip
        assert exact[-1] < 0.01 < coupled[-1]
    given = space._given
    monkeypatch.setattr(space, "_given", lambda *own: (given(*own)[0], given(*own)[1] * 0.95))
    reasons = {row.reason for row in measure(None, Effort(rounds=1, quick=True)).rows}
    assert reasons & {
        "the end in closed form lies within what is proved",
        "the reference lies outside of what is proved",
    }
