"""Hidden mechanisms, drawn with another seed: neighbours against brute force, and what a search makes of them."""

import math

import numpy as np
import pytest

from graphsynth.design import CurveIndex
from graphsynth.design.curves.building import Piece, make_piece
from graphsynth.design.curves.families import of_graph
from graphsynth.design.curves.fourier import aligned, coefficients, unit
from graphsynth.design.curves.matches import Entry
from graphsynth.design.curves.sampling import draw
from graphsynth.design.curves.stored import ARC, unpacked
from graphsynth.design.curves.wanted import WantedCurve
from graphsynth.kinematics.dimensional.goals import Goals, PathGoal
from graphsynth.kinematics.dimensional.refine import refine
from graphsynth.synthesis import enumerate_chains

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> CurveIndex:
    return CurveIndex.build(tmp_path_factory.mktemp("curves"), 20_000)


def hidden(index: CurveIndex, count: int, closed: bool | None = None) -> list[tuple[np.ndarray, bool]]:
    """Curves of mechanisms that are not in the index, from all its families alike."""
    random, found = np.random.default_rng(4321), []
    while len(found) < count:
        drawn = draw(index.families[int(random.integers(len(index.families)))], 4, random)
        if len(drawn.link) and closed in (None, bool(drawn.closed[0])):
            z = drawn.curves[0][: drawn.samples[0]]
            found.append((np.column_stack([z.real, z.imag]), bool(drawn.closed[0])))
    return found


def test_neighbours_are_those_of_brute_force(large: CurveIndex) -> None:
    shares = []
    for curve, closed in hidden(large, 40):
        wanted = WantedCurve(curve, closed)
        every = large._nearest(wanted, len(large), None, math.inf)[:10]
        shares.append(np.isin(every, large._nearest(wanted, 1000, None, math.inf)).mean())
    assert np.mean(shares) > 0.95


def test_searches_from_the_index_find_hidden_mechanisms(large: CurveIndex) -> None:
    errors = []
    for curve, closed in hidden(large, 12, closed=True):
        z = curve @ [1.0, 1.0j]
        along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(z)))])
        points = [np.interp(np.arange(24) / 24 * along[-1], along, part) for part in (z.real, z.imag)]
        found = []
        for start in large.starts(curve, 6, closed=closed):
            target = PathGoal(tuple(zip(*(part.tolist() for part in points))), closed=True, link=start.link)
            problem, x = start.problem(Goals(math.tau, 0.0, 1e3, target))
            found.append(float(refine(problem, x[None], 60).error[0]))
        errors.append(min(found))
    assert np.mean(np.array(errors) < 1e-3) >= 0.75


def test_hidden_curves_are_near_to_some(large: CurveIndex) -> None:
    errors = [large.find(curve, 1, closed=closed)[0].error for curve, closed in hidden(large, 40)]
    assert np.median(errors) < 0.03


def test_ten_links() -> None:
    graphs = (graph for chain in enumerate_chains(10) for graph in chain.inversions())
    family = next(family for graph in graphs for _, family in of_graph(graph, 0) if not family.dyadic)
    piece = make_piece(Piece(family, 0, 0, 20, 0, len(family.design.kinds), 1))
    for number, row in enumerate(piece["mechanism"]):
        entry = Entry(family, row)
        z = entry.traced().curve
        own = unit(coefficients(z[None], np.array([entry.closed]), ARC)[0])
        assert aligned(own, unpacked(piece["arc"][number]).astype(complex), entry.closed).error < 0.02
