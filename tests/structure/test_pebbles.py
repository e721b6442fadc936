"""Structural groups and faults of the compiled pebble game beside those of plain Python."""

from __future__ import annotations

import random
from itertools import combinations

import pytest

from graphsynth.structure.assur import decompose, find_fault
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis.api import enumerate_chains

from .plain_groups import PlainSystem


def agree(graph: MechanismGraph, pairs: list[tuple[int, int]]) -> bool:
    """Whether there are groups; they, or what stands in their way, are the same in both."""
    joints = {(joint.a, joint.b): joint for joint in graph.joints}
    plain = PlainSystem(graph, tuple(joints[pair] for pair in pairs))
    fault = find_fault(graph, pairs)
    if fault is None:
        assert not plain.crowded and not plain.free() and not plain.crowded_inside()
        assert graph.mobility == len(pairs)
        assert [group.links for group in decompose(graph, pairs).groups] == plain.groups()
        return True
    named = f"links {', '.join(map(str, plain.too_many()))} have too many constraints"
    assert (named in fault.message) == bool(plain.crowded)
    if fault.kind == "drivers":
        assert graph.mobility != len(pairs) and fault.links == plain.free()
    elif plain.crowded:
        assert fault.links == plain.too_many()
    else:
        assert fault.links == plain.crowded_inside() != ()
    return False


@pytest.mark.parametrize(
    "links", [4, 6, pytest.param(8, marks=pytest.mark.long), pytest.param(10, marks=pytest.mark.slow)]
)
def test_groups_of_all_chains_are_those_of_plain_python(links: int) -> None:
    count = 0
    for chain in enumerate_chains(links):
        for frame in range(links):
            graph = chain.with_frame(frame)
            count += sum(agree(graph, [(joint.a, joint.b)]) for joint in graph.joints)
    assert count >= 4 * links


def test_groups_and_faults_of_random_graphs_are_those_of_plain_python() -> None:
    choose, right, wrong = random.Random(3), 0, 0
    for _ in range(400):
        links, space = choose.randint(3, 8), choose.choice([3, 3, 6])
        pairs = choose.sample(list(combinations(range(links), 2)), choose.randint(2, min(10, links * (links - 1) // 2)))
        graph = MechanismGraph(
            links, [(*pair, choose.randint(1, 2)) for pair in pairs], frame=choose.randrange(links), space=space
        )
        wanted = min(max(graph.mobility, 0), len(pairs)) if choose.random() < 0.8 else choose.randint(0, 2)
        found = agree(graph, choose.sample(pairs, wanted))
        right, wrong = right + found, wrong + (not found)
    assert right > 20 and wrong > 100
