"""Chains with a single loop: a ring of links, told apart only by the order of their joint mobilities."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis.families import chain_joints

__all__ = ["rings"]


def _words(content: dict[int, int]) -> Iterator[tuple[int, ...]]:
    """Yield every arrangement of a multiset, in lexicographic order."""
    if not any(content.values()):
        yield ()
        return
    for value in sorted(content):
        if content[value]:
            content[value] -= 1
            for rest in _words(content):
                yield (value, *rest)
            content[value] += 1


def _is_first(word: tuple[int, ...], framed: bool) -> bool:
    """Tell whether no symmetry of the ring (only the reflection that keeps the frame, if framed) makes it smaller."""
    shifts = range(1) if framed else range(len(word))
    back = word[::-1]
    return all(word <= turned[i:] + turned[:i] for turned in (word, back) for i in shifts)


def rings(links: int, mobility: int, space: int, higher: Mapping[int, int], framed: bool) -> Iterator[MechanismGraph]:
    """Yield the chains (mechanisms, if ``framed``) that are one ring of links, each once.

    Joint i connects links i and i + 1 modulo N, so with the frame at link 0 the only symmetry left is the reflection.
    Any two links of a ring are apart by at least one joint, so every ring of mobility W >= 1 is admissible; mobility 0
    gives the ring that is a Baranov truss.  Two links and their only joint count as the smallest chain.

    Examples
    --------
    >>> [graph.to_text() for graph in rings(4, 1, 3, {}, True)]
    ['Cl f0']
    """
    lower = chain_joints(links, mobility, space, higher)
    if lower is None:
        return
    content = {1: lower} | {i: count for i, count in higher.items() if i > 1}
    if sum(content.values()) == 1 and links == 2:
        mobility = next(i for i, count in content.items() if count)
        yield MechanismGraph(2, [(0, 1, mobility)], frame=0 if framed else None, space=space)
    if links < 3 or sum(content.values()) != links:
        return
    for word in _words(content):
        if _is_first(word, framed):
            joints = [(i, (i + 1) % links, f) for i, f in enumerate(word)]
            yield MechanismGraph(links, joints, frame=0 if framed else None, space=space)
