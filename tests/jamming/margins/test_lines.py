"""Linear bounds of the margin against members that are simulated and solved by themselves."""

import numpy as np
import pytest
from jointed import CASES, true_margin

from graphsynth.jamming.chance.paving import linear
from graphsynth.jamming.chance.probability import ChanceProblem
from graphsynth.jamming.margins.margin import JointsMargin


def check(margin: JointsMargin, sides: tuple[float, ...], members: int, seed: int) -> tuple[int, int]:
    """Random boxes with random members: what the lines prove must be so.  Return how many were proved of each kind."""
    rng = np.random.default_rng(seed)
    _, sources = ChanceProblem(margin, {}).model()
    n = len(sources.every)
    proved = [0, 0]
    for side in sides:
        low = np.round(rng.uniform(0.0, 1.0 - side, n) * 2**20) / 2**20
        lo, hi = low[None], np.minimum(low + np.round(side * 2**20) / 2**20, 1.0)[None]
        line, _ = linear(margin, sources, lo, hi, np.full(1, None, dtype=object))
        assert line.low[0] <= line.high[0]
        for _ in range(members):
            v = np.where(rng.random(n) < 0.5, rng.uniform(lo[0], hi[0]), np.where(rng.random(n) < 0.5, lo[0], hi[0]))
            at = float(line.weights[0] @ (v - 0.5 * (lo + hi)[0]))
            m = true_margin(margin, sources.sampled([np.array([value]) for value in v])[0])
            if at < line.low[0]:
                assert m < 5e-4, (side, m, at, line)  # the grid may miss the worst input by so much
                proved[0] += 1
            if at >= line.high[0]:
                assert m > -1e-9, (side, m, at, line)
                proved[1] += 1
    return proved[0], proved[1]


@pytest.mark.parametrize("name", [pytest.param("crank_slider", marks=pytest.mark.slow), "fitted", "spherical"])
def test_what_the_lines_prove_holds_for_members(name: str) -> None:
    binds, free = check(CASES[name](), (0.3, 0.01), 2, seed=5)
    assert binds + free > 0


@pytest.mark.slow
@pytest.mark.parametrize("name", list(CASES))
@pytest.mark.parametrize("seed", range(8))
def test_what_the_lines_prove_holds_for_many_members(name: str, seed: int) -> None:
    binds, free = check(CASES[name](), (0.6, 0.3, 0.2, 0.1, 0.05, 0.03, 0.01, 0.003, 0.001), 20, seed)
    assert binds + free > 20
