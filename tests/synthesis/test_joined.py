"""Counts of fractionated chains by arithmetic, against listings of the same chains and against sums done by hand."""

from __future__ import annotations

import pytest

from graphsynth import StructuralSpec, count_chains, count_mechanisms
from graphsynth.synthesis import chunks, fractionated
from graphsynth.synthesis.fractionated import count_fractionated, fractionated_chains
from graphsynth.synthesis.problem import EnumerationProblem

SMALL = [
    *[(links, 2, 3, ()) for links in (5, 7, 9, 11)],
    *[(links, 3, 3, ()) for links in (6, 8, 10)],
    *[(links, 4, 3, ()) for links in (9, 11)],
    (10, 5, 3, ()), (11, 6, 3, ()),
    *[(links, mobility, 2, ()) for links in (5, 6, 7, 8) for mobility in (2, 3, 4)],
    (9, 2, 4, ()), (12, 3, 4, ()),
    (5, 2, 3, ((2, 2),)), (6, 2, 3, ((2, 3),)), (7, 3, 3, ((2, 1),)), (7, 3, 3, ((2, 3),)), (7, 4, 3, ((2, 2),)),
    (7, 3, 4, ((2, 1), (3, 1))), (6, 4, 4, ((2, 2), (3, 1))),
]  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("question", SMALL, ids=str)
def test_the_listing_has_as_many(question):
    """Listed by canonical augmentation, which shares no arithmetic with the count."""
    chains = list(fractionated_chains(*question))
    assert count_fractionated(*question) == len(chains)
    assert count_fractionated(*question, framed=True) == sum(len(chain.orbits) for chain in chains)


def test_two_blocks_are_pairs_of_mechanisms():
    """With W = 2 a fractionated chain is an unordered pair of mechanisms with W = 1 that share their frame."""
    rooted = {links: count_mechanisms(StructuralSpec(W=1, links=links)) for links in (4, 6, 8, 10, 12)}
    pairs = rooted[4] * rooted[12] + rooted[6] * rooted[10] + rooted[8] * (rooted[8] + 1) // 2
    assert count_fractionated(15, 2, 3, ()) == pairs == 87123


@pytest.mark.parametrize(
    ("links", "mobility", "chains"), [(15, 2, 1519853), (14, 3, 97194), (13, 4, 5915), (13, 2, 29685), (12, 3, 2422)]
)
def test_no_fractionated_chain_is_made_to_be_counted(links, mobility, chains, monkeypatch):
    monkeypatch.setattr(fractionated, "fractionated_chains", None)
    assert count_chains(links, mobility, fractionated=True) == chains


def test_restricted_counts_are_those_of_the_listing():
    question = StructuralSpec(W=2, links=9, fractionated=True)
    found = EnumerationProblem.mechanisms(question, None)
    assert sum(item.count() for item in found.work_items(listing=True)) == count_mechanisms(question)
    assert count_chains(9, 2, fractionated=True, symmetry=3) == sum(
        chain.automorphism_order % 3 == 0
        for item in EnumerationProblem.chains(9, 2, 3, None, True, None).work_items(listing=True)
        for chain in item.graphs()
    )


def test_a_table_that_is_too_small_for_the_states_is_made_larger(monkeypatch):
    workspace, words = chunks.workspace, []

    def small(edge_labels, key_words):
        words.append(key_words)
        return workspace(edge_labels, key_words >> 14)

    monkeypatch.setattr(chunks, "workspace", small)
    assert (count_chains(10), count_chains(12)) == (230, 6856)
    assert max(words) > min(words)
