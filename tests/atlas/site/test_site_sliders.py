"""Choices of prismatic joints that the atlas lists: each once, as many as the enumerator has."""

from __future__ import annotations

import pytest

from graphsynth import MechanismGraph, count_slider_chains, enumerate_slider_chains
from graphsynth.atlas.site.sliders import MOST_SLIDERS, choices
from graphsynth.structure.slider_chains import SliderChain

COUNTS = tuple(range(1, MOST_SLIDERS + 1))
#: Links and mobility of chains of at most eight links.
FAMILIES = [(4, 1), (6, 1), (8, 1), (5, 2), (7, 2), (6, 3), (8, 3), (7, 4)]


def chain_of(key, bits):
    graph = MechanismGraph.from_key(key)
    return SliderChain.from_graph(graph, [joint[:2] for k, joint in enumerate(graph.joints) if bits >> k & 1])


@pytest.mark.parametrize(("links", "mobility"), FAMILIES)
def test_choices_are_those_of_the_enumerator(links, mobility):
    listed = [chain_of(key, bits) for key, own in choices(links, mobility).items() for bits in own]
    by_count = {count: [chain for chain in listed if len(chain.sliders) == count] for count in COUNTS}
    for count, own in by_count.items():
        assert len(own) == count_slider_chains(links, count, mobility)
        assert {chain.key for chain in own} == {c.key for c in enumerate_slider_chains(links, count, mobility)}
    assert sum(map(len, by_count.values())) == len({chain.key for chain in listed})


def test_numbers_of_choices():
    """Six and eight links by hand: what docs/explanation/sliders.md gives, equal to brute force."""
    for links, counts in ((6, [6, 13, 10]), (8, [84, 307, 555])):
        own = [bits.bit_count() for found in choices(links, 1).values() for bits in found]
        assert [own.count(count) for count in COUNTS] == counts
