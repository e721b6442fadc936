"""Structural facts of chains, computed in blocks by the kernels and handed out as rows for the store."""

from __future__ import annotations

from base64 import urlsafe_b64encode
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.errors import TooLargeError
from graphsynth.structure.canonical import KEY_VERSION
from graphsynth.structure.text import encode_text

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph

__all__ = ["Block", "ChainFacts", "analyse_block", "chain_facts", "group_graph"]

Bytes = NDArray[np.uint8]

#: A group as (moving links, upper triangle of base and links as a number).
GroupForm = tuple[int, int]


@dataclass(frozen=True, slots=True)
class ChainFacts:
    """What the catalogue knows of one chain; links are numbered canonically.

    Parameters
    ----------
    key, graph6 : str
    assortment : dict
        ``{joints of a link: number of links}``.
    automorphisms : int
        Order of the automorphism group.
    orbits : tuple of tuple of int
        Orbits of links.
    girth : int
    cut_links : tuple of int
    contracted : tuple
        Multiplicities ``(vertices, rows)`` of the contracted graph, canonical.
    parents : tuple of str
        Keys of the chains left when one dyad of two binary links is removed, sorted.
    levels : dict
        ``{frame: sizes of the adjacency levels}``, one frame for each orbit.
    mechanisms : tuple of (frame, driver, groups)
        One for each orbit of (frame, driver on it); groups as ``((links, form), order)`` in the order of assembly, or
        None where they are not computed.
    """

    key: str
    graph6: str
    links: int
    joints: int
    assortment: dict[int, int]
    automorphisms: int
    orbits: tuple[tuple[int, ...], ...]
    girth: int
    cut_links: tuple[int, ...]
    contracted: tuple[int, bytes]
    parents: tuple[str, ...]
    levels: dict[int, tuple[int, ...]]
    mechanisms: tuple[tuple[int, int, tuple[tuple[GroupForm, int], ...] | None], ...]


@dataclass(frozen=True, eq=False, slots=True)
class Block:
    """Arrays of :func:`graphsynth.atlas.kernels.facts.analyse`, chain by chain along the first axis."""

    links: int
    joints: Bytes
    keys: Bytes
    order: NDArray[np.int64]
    orbit: Bytes
    girth: Bytes
    cuts: NDArray[np.uint64]
    levels: Bytes
    arcs: NDArray[np.int16]
    sizes: Bytes
    outers: Bytes
    forms: NDArray[np.uint64]
    parents: Bytes
    contracted: Bytes


def _stream(links: int) -> int:
    """Bytes of the upper triangle of an adjacency matrix."""
    return (links * (links - 1) // 2 + 7) // 8


def analyse_block(links: int, packed: Bytes) -> Block:
    """Compute the facts of a block of planar chains with mobility-1 joints (exact).

    Parameters
    ----------
    links : int
    packed : ndarray of uint8, shape (chains, 3 joints)
        Joints ``a, b, 1``, as the enumerator packs them.

    Raises
    ------
    TooLargeError
        For more links than the kernels are laid out for.
    """
    from graphsynth.atlas.kernels.facts import MOST_LINKS, analyse

    if links > MOST_LINKS:
        raise TooLargeError(f"a catalogue holds chains of at most {MOST_LINKS} links, not {links}: count or list them")
    chains, joints, half = len(packed), packed.shape[1] // 3, links // 2
    block = Block(
        links=links,
        joints=np.zeros((chains, joints, 2), np.uint8),
        keys=np.zeros((chains, _stream(links)), np.uint8),
        order=np.zeros(chains, np.int64),
        orbit=np.zeros((chains, links), np.uint8),
        girth=np.zeros(chains, np.uint8),
        cuts=np.zeros(chains, np.uint64),
        levels=np.zeros((chains, links, links), np.uint8),
        arcs=np.zeros((chains, 2 * joints), np.int16),
        sizes=np.zeros((chains, joints, half), np.uint8),
        outers=np.zeros((chains, joints, half), np.uint8),
        forms=np.zeros((chains, joints, half, 2), np.uint64),
        parents=np.zeros((chains, half, _stream(links) + 1), np.uint8),
        contracted=np.zeros((chains, 1 + links * links), np.uint8),
    )
    analyse(
        links, packed, block.joints, block.keys, block.order, block.orbit, block.girth, block.cuts, block.levels,
        block.arcs, block.sizes, block.outers, block.forms, block.parents, block.contracted,
    )  # fmt: skip
    return block


def _key(links: int, stream: bytes) -> str:
    head = bytes((links, 3))
    return KEY_VERSION + urlsafe_b64encode(head + stream).decode("ascii").rstrip("=")


def chain_facts(block: Block, mobility: int) -> Iterator[ChainFacts]:
    """Read a block chain by chain."""
    n = block.links
    for c in range(len(block.keys)):
        pairs = block.joints[c].tolist()
        packed = bytes(part for a, b in pairs for part in (a, b, 1))
        degree = np.bincount(block.joints[c].ravel(), minlength=n).tolist()
        orbit = block.orbit[c].tolist()
        cuts = int(block.cuts[c])
        size = int(block.contracted[c, 0])
        yield ChainFacts(
            key=_key(n, block.keys[c].tobytes()),
            graph6=encode_text(n, packed, None, 3),
            links=n,
            joints=len(pairs),
            assortment={a: degree.count(a) for a in sorted(set(degree))},
            automorphisms=int(block.order[c]),
            orbits=tuple(tuple(v for v in range(n) if orbit[v] == low) for low in sorted(set(orbit))),
            girth=int(block.girth[c]),
            cut_links=tuple(v for v in range(n) if cuts >> v & 1),
            contracted=(size, block.contracted[c, 1 : 1 + size * size].tobytes()),
            parents=_parents(block.parents[c], n),
            levels={v: tuple(s for s in block.levels[c, v].tolist() if s) for v in range(n) if orbit[v] == v},
            mechanisms=tuple(_mechanisms(block, c, pairs, mobility)),
        )


def _parents(rows: Bytes, links: int) -> tuple[str, ...]:
    own = _stream(links - 2)
    return tuple(sorted({_key(links - 2, row[1 : 1 + own].tobytes()) for row in rows if row[0]}))


def _mechanisms(
    block: Block, c: int, pairs: list[list[int]], mobility: int
) -> Iterator[tuple[int, int, tuple[tuple[GroupForm, int], ...] | None]]:
    arcs = block.arcs[c].tolist()
    sizes, outers = block.sizes[c].tolist(), block.outers[c].tolist()
    forms = block.forms[c].tolist()
    for k, low in enumerate(arcs):
        if k != low:
            continue
        j, back = k >> 1, k & 1
        groups = tuple(
            ((size, high << 64 | low64), outer)
            for size, outer, (high, low64) in zip(sizes[j], outers[j], forms[j])
            if size
        )
        yield pairs[j][back], pairs[j][1 - back], groups if mobility == 1 else None


def group_graph(form: GroupForm) -> MechanismGraph:
    """Return the graph of a structural group, its base as frame (link 0).

    Examples
    --------
    >>> group_graph((2, 7)).joints
    (Joint(a=0, b=1, mobility=1), Joint(a=0, b=2, mobility=1), Joint(a=1, b=2, mobility=1))
    """
    from graphsynth.structure.graph import MechanismGraph

    size, bits = form
    pairs: list[tuple[int, Any]] = [(a, b) for b in range(1, size + 1) for a in range(b)]
    return MechanismGraph(size + 1, [pair for k, pair in enumerate(pairs) if bits >> k & 1], frame=0)
