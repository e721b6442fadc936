"""Shards take about the same work, are a partition, and are the same on every machine."""

from __future__ import annotations

from functools import lru_cache
from itertools import islice

import networkx as nx
import numpy as np
import pytest

from graphsynth import StructuralSpec
from graphsynth.atlas.making import share_of, tasks_of
from graphsynth.core.errors import SpecError
from graphsynth.synthesis.chunks import Chunk, count_each, estimates
from graphsynth.synthesis.kernels.counting import LISTING
from graphsynth.synthesis.kernels.layout import HEADER, make_work
from graphsynth.synthesis.kernels.listing import VISITED, list_rows, rewind
from graphsynth.synthesis.problem import EnumerationProblem
from graphsynth.synthesis.shards import shard_of, works

FOURTEEN = EnumerationProblem.chains(14, 1, 3, None, False, None)
MECHANISMS = EnumerationProblem.mechanisms(StructuralSpec(W=1, links=12), None)


def cuts(problem, shards, *, listing=True):
    pieces = problem.work_items(listing=listing)
    return [shard_of(pieces, (i, shards), listing=listing) for i in range(1, shards + 1)]


def spread(loads):
    return max(loads) / (sum(loads) / len(loads))


@pytest.mark.parametrize("problem", [FOURTEEN, MECHANISMS], ids=["chains", "mechanisms"])
def test_shards_are_about_equal_and_none_is_empty(problem):
    """By labellings, which listing visits one by one; the old cut left 19 of 32 shards of 14 links empty."""
    weighed = {family: works(family, 1.0, LISTING) for family in problem.families}
    found = cuts(problem, 32)
    loads = [
        sum(float(weighed[piece.family][piece.start : piece.stop].sum()) for piece in shard if isinstance(piece, Chunk))
        for shard in found
    ]
    assert all(found)
    assert spread(loads) < 1.15


def test_the_estimate_follows_what_is_listed():
    """Work is visited labellings and written chains: at least the chains, at most what could be visited."""
    for family in FOURTEEN.families:
        if not len(family.graphs):
            continue
        chains = count_each(family, 0, len(family.graphs))
        estimated = works(family, 1.0, LISTING)
        assert (estimated >= 0.5 * chains).all()
        assert (estimated <= 35 + estimates(family)).all()  # of all labellings, admissible or not
        assert (estimated == np.rint(estimated)).all()  # whole numbers: sums do not depend on the machine


@lru_cache(maxsize=1)
def room(resources):
    return make_work(resources, key_words=1 << 14)


def visited(unit):
    """Labellings that the search meets: a count of the work that is the same on every machine, however busy."""
    family, tables = unit.family, unit.family.edge_labels.tables
    work = room(family.edge_labels.resources)
    rows = np.zeros((4096, HEADER + family.loops + family.vertices), np.int32)
    rewind(unit.start, unit.part, unit.parts, work)
    search = family.vertices, family.graphs, unit.stop, family.frames, family.frame_degree, 0, tables
    while list_rows(*search, work, rows) == len(rows):
        pass
    return int(work.state[VISITED])


def has_no_symmetry(mult):
    """By a library."""
    graph = nx.from_numpy_array(mult.astype(int))
    same = nx.isomorphism.numerical_edge_match("weight", 0)
    found = nx.isomorphism.GraphMatcher(graph, graph, edge_match=same).isomorphisms_iter()
    return sum(1 for _ in islice(found, 2)) == 1


@pytest.mark.long
def test_the_estimate_is_what_is_visited():
    """By listing every contracted graph; without symmetry every labelling is met, and the number is exact."""
    for family in FOURTEEN.families:
        met = np.array([visited(Chunk(family, at, at + 1)) for at in range(len(family.graphs))])
        alone = [has_no_symmetry(mult) for mult in family.graphs]
        estimated = (works(family, 1.0, LISTING) - 35) * 60 / (48 + family.vertices)
        assert (abs(estimated - met)[alone] < 2).all()
        assert estimated.sum() == pytest.approx(met.sum(), rel=0.1, abs=5)


@pytest.mark.parametrize(
    ("links", "shards"), [(14, 32), pytest.param(16, 256, marks=pytest.mark.slow)], ids=["14 in 32", "16 in 256"]
)
def test_visits_of_shards(links, shards):
    """Cut by labellings and the order of the group, the largest had 1.15 and 1.43 times the mean."""
    found = cuts(EnumerationProblem.chains(links, 1, 3, None, False, None), shards)
    loads = [sum(visited(piece) for piece in own if isinstance(piece, Chunk)) for own in found]
    assert all(found)
    assert spread(loads) < 1.12


def test_chains_of_shards_of_a_catalogue():
    """Cut by bounds on the labellings, the largest of 14 links in 32 shards had 1.9 times the mean."""
    tasks = tasks_of(14, 1, False)
    shared = [share_of(tasks, (i, 32)) for i in range(1, 33)]
    assert [task for own in shared for task in own] == tasks
    assert spread([sum(len(block) for task in own for block in packed(task)) for own in shared]) < 1.15


def packed(task):
    return task.piece.packed() if isinstance(task.piece, Chunk) else ()


def test_lines_of_shards():
    lines = [
        sum(count for piece in shard if isinstance(piece, Chunk) for _, count in piece.texts())
        for shard in cuts(FOURTEEN, 32)
    ]
    assert sum(lines) == 318162 and spread(lines) < 1.6


@pytest.mark.parametrize("shards", [1, 5, 32, pytest.param(100, marks=pytest.mark.long)])
def test_counts_of_shards(shards):
    found = cuts(FOURTEEN, shards, listing=False)
    assert sum(piece.count() for shard in found for piece in shard) == 318162
    assert all(found)


def test_more_shards_than_graphs():
    problem = EnumerationProblem.chains(6, 1, 3, None, False, None)
    found = cuts(problem, 50)
    assert sum(map(bool, found)) == sum(len(family.graphs) for family in problem.families) + 1  # and the rings
    assert sum(piece.count() for shard in found for piece in shard) == 2


def test_a_share_of_a_large_family_stands_for_all():
    family = max(FOURTEEN.families, key=lambda family: len(family.graphs))
    all_of_it, some = works(family, 1.0, LISTING), works(family, 0.25, LISTING)
    assert some.shape == all_of_it.shape
    assert some.sum() == pytest.approx(all_of_it.sum(), rel=0.2)
    assert np.corrcoef(some, all_of_it)[0, 1] > 0.9


@pytest.mark.parametrize("shard", [(0, 3), (4, 3), (1.5, 3), ("1", 3), (1,), 7, (1, 10**7)])
def test_what_is_no_shard(shard):
    with pytest.raises(SpecError, match="must be i/m with 1 <= i <= m"):
        shard_of(FOURTEEN.work_items(listing=True), shard)
