"""Fractionated chains: chains that fall apart at a link or at a joint, each part with a mobility of its own.

A chain is a tree of blocks: non-fractionated chains, and single joints between two links.  Its mobility is the sum of
the mobilities of the blocks, and it has a rigid sub-chain exactly when a block has one.  Chains grow by gluing one
block at a link of a smaller chain.  A chain is kept only when the block just glued is equivalent to its canonical leaf
block, so each chain arises from one parent only and nothing has to be remembered (canonical augmentation, [McKay
1998]).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from graphsynth.structure.connectivity import bits, components_of
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.kernels import canon_packed
from graphsynth.synthesis.families import chain_families, rings
from graphsynth.synthesis.units import cut, graphs_of

Higher = tuple[tuple[int, int], ...]


@lru_cache(maxsize=512)
def blocks_of(links: int, mobility: int, space: int, higher: Higher) -> tuple[MechanismGraph, ...]:
    """List the blocks with given numbers: non-fractionated chains, or a single joint."""
    content = dict(higher)
    if links == 2:
        fits = {mobility: 1} == (content or {1: 1}) and 1 <= mobility < space
        return (MechanismGraph(2, [(0, 1, mobility)], space=space),) if fits else ()
    found = list(rings(links, mobility, space, content, False))
    for unit in cut(chain_families(links, mobility, space, content, False), listing=True):
        found += graphs_of(unit)
    return tuple(found)


def _shares(higher: Higher) -> Iterator[tuple[Higher, Higher]]:
    """Yield every way to divide the higher pairs between two parts."""
    if not higher:
        yield (), ()
        return
    (i, count), rest = higher[0], higher[1:]
    for mine in range(count + 1):
        own = ((i, mine),) if mine else ()
        other = ((i, count - mine),) if mine < count else ()
        for a, b in _shares(rest):
            yield own + a, other + b


def _glue(parent: MechanismGraph, at: int, block: MechanismGraph, link: int) -> tuple[MechanismGraph, frozenset[int]]:
    """Identify a link of the block with a link of the parent; return the chain and the new links."""
    names = {}
    fresh = parent.links
    for v in range(block.links):
        if v == link:
            names[v] = at
        else:
            names[v] = fresh
            fresh += 1
    joints = [*parent.joints, *((names[a], names[b], f) for a, b, f in block.joints)]
    return MechanismGraph(fresh, joints, space=parent.space), frozenset(range(parent.links, fresh))


def _leaves(graph: MechanismGraph) -> list[frozenset[int]]:
    """List the leaf blocks, each as its links other than the cut link.

    A leaf block is what falls off at a cut link and holds no other cut link.
    """
    everything = (1 << graph.links) - 1
    cuts = sum(1 << v for v in graph.cut_links)
    return [
        frozenset(bits(part))
        for cut_link in graph.cut_links
        for part in components_of(graph.neighbours, everything & ~(1 << cut_link))
        if not part & cuts
    ]


def _marked_form(graph: MechanismGraph, marked: frozenset[int]) -> tuple[object, ...]:
    """Return a form that is equal for two sets of links exactly when an automorphism maps one to the other."""
    colours = np.array([int(v in marked) for v in range(graph.links)], np.int64)
    order = canon_packed(graph.links, np.frombuffer(graph.packed, np.uint8), colours)[0]
    place = {int(v): i for i, v in enumerate(order)}
    joints = sorted((*sorted((place[a], place[b])), f) for a, b, f in graph.joints)
    # single joints first: a chain without loose ends then has parents with few of them
    return len(marked) > 1, len(marked), tuple(joints)


def _is_canonical(graph: MechanismGraph, glued: frozenset[int]) -> bool:
    own = _marked_form(graph, glued)
    return all(_marked_form(graph, leaf) >= own for leaf in _leaves(graph))


def _representatives(graph: MechanismGraph) -> list[int]:
    return sorted({min(orbit) for orbit in graph.orbits})


@lru_cache(maxsize=512)
def _trees(links: int, mobility: int, space: int, higher: Higher) -> tuple[MechanismGraph, ...]:
    """List the connected chains of blocks, loose ends (single joints as leaf blocks) included."""
    found = list(blocks_of(links, mobility, space, higher))
    for block_links in range(2, links):
        for block_mobility in range(1, mobility):
            for own, other in _shares(higher):
                blocks = blocks_of(block_links, block_mobility, space, own)
                if not blocks:
                    continue
                for parent in _trees(links - block_links + 1, mobility - block_mobility, space, other):
                    for block in blocks:
                        for at in _representatives(parent):
                            for link in _representatives(block):
                                graph, glued = _glue(parent, at, block, link)
                                if _is_canonical(graph, glued):
                                    found.append(graph)
    return tuple(found)


def fractionated_chains(links: int, mobility: int, space: int, higher: Higher) -> Iterator[MechanismGraph]:
    """Yield the fractionated chains without loose ends and without rigid sub-chains, each once.

    >>> sum(1 for _ in fractionated_chains(7, 2, 3, ()))
    1
    """
    for graph in _trees(links, mobility, space, higher):
        if graph.is_fractionated and min(graph.degrees) >= 2:
            yield graph
