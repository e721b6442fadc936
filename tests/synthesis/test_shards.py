"""Shards take about the same work, are a partition, and are the same on every machine."""

from __future__ import annotations

import numpy as np
import pytest

from graphsynth import StructuralSpec
from graphsynth.errors import SpecError
from graphsynth.synthesis.problem import Problem, count_piece
from graphsynth.synthesis.shards import shard_of, works
from graphsynth.synthesis.units import Unit, count_each, estimates, text_of

FOURTEEN = Problem.chains(14, 1, 3, None, False, None)
MECHANISMS = Problem.mechanisms(StructuralSpec(W=1, links=12), None)


def cuts(problem, shards, *, listing=True):
    pieces = problem.pieces(listing=listing)
    return [shard_of(pieces, (i, shards), listing=listing) for i in range(1, shards + 1)]


def spread(loads):
    return max(loads) / (sum(loads) / len(loads))


@pytest.mark.parametrize("problem", [FOURTEEN, MECHANISMS], ids=["chains", "mechanisms"])
def test_shards_are_about_equal_and_none_is_empty(problem):
    """By labellings, which listing visits one by one; the old cut left 19 of 32 shards of 14 links empty."""
    weighed = {family: works(family, 1.0, listing=True) for family in problem.families}
    found = cuts(problem, 32)
    loads = [
        sum(float(weighed[piece.family][piece.start : piece.stop].sum()) for piece in shard if isinstance(piece, Unit))
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
        estimated = works(family, 1.0, listing=True)
        assert (estimated >= 0.5 * chains).all()
        assert (estimated <= 24 + estimates(family)).all()  # of all labellings, admissible or not
        assert (estimated == np.rint(estimated)).all()  # whole numbers: sums do not depend on the machine


def test_lines_of_shards():
    lines = [
        sum(count for piece in shard if isinstance(piece, Unit) for _, count in text_of(piece))
        for shard in cuts(FOURTEEN, 32)
    ]
    assert sum(lines) == 318162 and spread(lines) < 1.6


@pytest.mark.parametrize("shards", [1, 5, 32, 100])
def test_counts_of_shards(shards):
    found = cuts(FOURTEEN, shards, listing=False)
    assert sum(count_piece(piece) for shard in found for piece in shard) == 318162
    assert all(found)


def test_more_shards_than_graphs():
    problem = Problem.chains(6, 1, 3, None, False, None)
    found = cuts(problem, 50)
    assert sum(map(bool, found)) == sum(len(family.graphs) for family in problem.families) + 1  # and the rings
    assert sum(count_piece(piece) for shard in found for piece in shard) == 2


def test_a_share_of_a_large_family_stands_for_all():
    family = max(FOURTEEN.families, key=lambda family: len(family.graphs))
    all_of_it, some = works(family, 1.0, listing=True), works(family, 0.25, listing=True)
    assert some.shape == all_of_it.shape
    assert some.sum() == pytest.approx(all_of_it.sum(), rel=0.2)
    assert np.corrcoef(some, all_of_it)[0, 1] > 0.9


@pytest.mark.parametrize("shard", [(0, 3), (4, 3), (1.5, 3), ("1", 3), (1,), 7, (1, 10**7)])
def test_what_is_no_shard(shard):
    with pytest.raises(SpecError, match="must be i/m with 1 <= i <= m"):
        shard_of(FOURTEEN.pieces(listing=True), shard)
