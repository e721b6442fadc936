"""Error against run time with every loop closed in space."""

import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.evidence import Effort
from graphsynth.evidence.space import space_problem
from graphsynth.mechanism.four_bar import TiltedFourBar


def test_the_exact_factor_and_its_proofs_beside_small_tilts():
    problem = space_problem(TiltedFourBar(), 0.1, Effort(rounds=1, quick=True))
    assert problem.methods == ("small tilts", "least factor in space", "proofs in space")
    assert problem.rows[0].error == pytest.approx(0.1**2 * (1 - 0.4**2) / 6, rel=0.01)  # third power of the tilt
    assert problem.rows[1].error < 1e-14
    assert all(row.good and row.proved and row.error == row.value for row in problem.of("proofs in space"))
    with pytest.raises(GeometryError, match="not assembled"):
        space_problem(TiltedFourBar(6.0, 1.0, 2.5, 2.5), 0.1, Effort(rounds=1, quick=True))
