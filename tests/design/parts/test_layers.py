"""The least number of layers, and of those layerings the shortest pins, against all layerings one by one."""

from __future__ import annotations

from itertools import combinations, product

import pytest
from hypothesis import given, settings, strategies as st

from graphsynth import enumerate_chains
from graphsynth.design.parts.layers import Stacking, least_layers

MECHANISMS = [chain.with_frame(k) for n in (4, 6) for chain in enumerate_chains(n) for k in range(n)]


def allowed(stacking, layers):
    """Return what the words say, layer by layer: who is in it, which pins pass through it."""
    if any(layers[a] == layers[b] for a, b in stacking.same):
        return False
    if any(layers[a] != layers[b] for a, b in stacking.together):
        return False
    for k in range(max(layers) + 1):
        passing = {
            p
            for p, pin in enumerate(stacking.pins)
            if any(layers[a] < k for a in pin) and any(layers[a] > k for a in pin)
        }
        if any(p in passing and layers[c] == k for p, c in stacking.through):
            return False
        if any(p in passing and q in passing for p, q in stacking.crossing):
            return False
    return True


def spans(stacking, layers):
    return sum(max(layers[a] for a in pin) - min(layers[a] for a in pin) for pin in stacking.pins)


def brute(stacking):
    """Least layers and shortest pins of all layerings; None if there is none."""
    others = [k for k in range(stacking.links) if k != stacking.frame]
    for count in range(1, len(others) + 1):
        best = None
        for own in product(range(1, count + 1), repeat=len(others)):
            layers = [0] * stacking.links
            for link, layer in zip(others, own):
                layers[link] = layer
            if allowed(stacking, layers):
                best = min(spans(stacking, layers), best if best is not None else 10**9)
        if best is not None:
            return count, best
    return None


@st.composite
def stackings(draw):
    graph = draw(st.sampled_from(MECHANISMS))
    pins = [(a, b) for a, b, _ in graph.joints]
    moving = [k for k in range(graph.links) if k != graph.frame]
    share = draw(st.sampled_from([0.1, 0.4, 0.8]))
    some = lambda pairs: [pair for pair in pairs if draw(st.floats(0, 1)) < share]  # noqa: E731
    same = some(list(combinations(moving, 2))) + pins
    through = some([(p, c) for p, pin in enumerate(pins) for c in moving if c not in pin])
    crossing = some(list(combinations(range(len(pins)), 2)))
    free = [pair for pair in combinations(moving, 2) if pair not in same]
    together = draw(st.sampled_from([[], *([pair] for pair in free)]))
    return Stacking(graph.links, graph.frame, pins, sorted(set(same)), through, crossing, together)


def agrees(stacking):
    found, expected = least_layers(stacking), brute(stacking)
    if expected is None:
        assert found is None
        return
    assert found is not None
    assert found[stacking.frame] == 0 and allowed(stacking, found)
    assert (max(found), spans(stacking, found)) == expected


@pytest.mark.parametrize("graph", MECHANISMS, ids=str)
def test_links_that_collide_only_at_their_joints(graph):
    pins = [(a, b) for a, b, _ in graph.joints]
    agrees(Stacking(graph.links, graph.frame, pins, pins, []))


@pytest.mark.long
@given(stackings())
@settings(max_examples=40, deadline=None)
def test_layers_are_least_by_brute_force(stacking):
    agrees(stacking)


def test_no_layering_where_each_crank_hits_the_other_ones_pin():
    pins = [(0, 1), (1, 2), (2, 3), (0, 3)]
    jointed = [tuple(sorted(pin)) for pin in pins]
    assert least_layers(Stacking(4, 0, pins, [*jointed, (1, 3)], [(3, 1), (0, 3)])) is None
    assert least_layers(Stacking(4, 0, pins, [*jointed, (1, 3)], [(3, 1)])) is not None
