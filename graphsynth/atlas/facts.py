"""Structural facts of chains, computed in blocks by the kernels, as arrays and as rows for the store."""

from __future__ import annotations

from base64 import urlsafe_b64encode
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from math import comb, prod
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import TooLargeError
from graphsynth.structure.canonical import KEY_VERSION

if TYPE_CHECKING:
    from graphsynth.atlas.kernels.facts import Block

Bytes = NDArray[np.uint8]

_FRAMED = 8  # flag in the second byte of a key
#: Moving links of the largest groups whose assembly modes are counted: of larger ones there are hundred thousands.
_COUNTED = 10
#: Links of the largest mechanisms whose coupler curves are stored: they take 5 ms each with ten links.
_CURVES = 8


@dataclass(frozen=True, slots=True)
class GroupRow:
    """A structural group: key with the base as frame, moving links, order, class, assembly modes (or None)."""

    key: str
    links: int
    order: int
    group_class: int
    modes: int | None


@dataclass(slots=True)
class Rows:
    """Rows of some chains for the store, without the numbers that only the store can give."""

    #: ``(key, graph6, links, joints, loops, assortment, automorphisms, link_orbits, inversions, girth, fractionated,
    #: mobility_type, contracted)``; ``contracted`` is a place in the next
    chains: list[tuple[Any, ...]] = field(default_factory=list)
    contracted: dict[tuple[int, str], int] = field(default_factory=dict)  # (vertices, edges) to their place
    #: list of (chain, key of the parent): chains as indices into ``chains``, here and below
    dyads: list[tuple[int, str]] = field(default_factory=list)
    #: list of (chain, frame, joints of the frame, levels, and the values of `curves_of`)
    inversions: list[tuple[Any, ...]] = field(default_factory=list)
    #: list of (chain, frame, driver, structure): ``driver`` is a link, or text such as ``'1,3'`` for several;
    #: ``structure`` a place in the next
    mechanisms: list[tuple[int, int, int | str, int]] = field(default_factory=list)
    #: groups in the order of assembly, as places in ``groups``
    structures: dict[tuple[int, ...], int] = field(default_factory=dict)
    groups: dict[GroupRow, int] = field(default_factory=dict)


def _stream(links: int) -> int:
    """Bytes of the upper triangle of an adjacency matrix."""
    return (links * (links - 1) // 2 + 7) // 8


def analyse_block(links: int, mobility: int, packed: Bytes) -> Block:
    """Compute the facts of a block of planar chains with mobility-1 joints (exact).

    ``packed`` uint8, shape (chains, 3 joints): joints ``a, b, 1``, as the enumerator packs them. Raises
    `TooLargeError` for more links than the kernels are laid out for.
    """
    from graphsynth.atlas.kernels.facts import FORM, MOST_LINKS, Block, analyse

    if links > MOST_LINKS:
        raise TooLargeError(f"a catalogue holds chains of at most {MOST_LINKS} links, not {links}: count or list them")
    chains, joints, half = len(packed), packed.shape[1] // 3, max(1, links // 2)
    ends = packed.reshape(chains, joints, 3)[:, :, :2].reshape(chains, -1)
    degrees = (ends[:, :, None] == np.arange(links)).sum(axis=1)
    choices = np.array([comb(degree, mobility) for degree in range(links)])
    room = int(choices[degrees].sum(axis=1).max(initial=1))
    block = Block(
        joints=np.zeros((chains, joints, 2), np.uint8),
        keys=np.zeros((chains, _stream(links)), np.uint8),
        order=np.zeros(chains, np.int64),
        orbit=np.zeros((chains, links), np.uint8),
        girth=np.zeros(chains, np.uint8),
        cuts=np.zeros(chains, np.uint64),
        levels=np.zeros((chains, links, links), np.uint8),
        mechanisms=np.zeros(chains, np.int64),
        frames=np.zeros((chains, room), np.uint8),
        drives=np.zeros((chains, room), np.uint64),
        sizes=np.zeros((chains, room, half), np.uint8),
        outers=np.zeros((chains, room, half), np.uint8),
        forms=np.zeros((chains, room, half, FORM), np.uint8),
        parents=np.zeros((chains, half, _stream(links) + 1), np.uint8),
        contracted=np.zeros((chains, 1 + links * links), np.uint8),
    )
    analyse(links, mobility, packed, block)
    return block


def rows_of(block: Block, rows: Rows) -> None:
    """Append the rows of a block; what is in ``rows`` already keeps its place."""
    start = len(rows.chains)
    rows.chains += zip(*_columns(block), contracted_of(block, rows))
    for c, orbit in enumerate(block.orbit.tolist()):
        levels = block.levels[c].tolist()
        for frame in sorted(set(orbit)):
            sizes = "-".join(str(size) for size in levels[frame] if size)
            curves = curves_of(block.joints[c].tolist(), len(orbit), frame)
            rows.inversions.append((start + c, frame, levels[frame][1], sizes, *curves))
    n = block.orbit.shape[1]
    chains, places = np.nonzero(block.parents[:, :, 0])
    streams = _lines(block.parents[chains, places, 1 : 1 + _stream(n - 2)]) if len(chains) else []
    rows.dyads += sorted({(start + c, chain_key(n - 2, stream)) for c, stream in zip(chains.tolist(), streams)})
    _mechanisms(block, start, rows)


def _columns(block: Block) -> Iterator[Iterable[Any]]:
    """Columns of the chains, without the last one."""
    count, n = block.orbit.shape
    joints = block.joints.shape[1]
    yield [chain_key(n, stream) for stream in _lines(block.keys)]
    yield graph6_of(n, block.keys)
    yield [n] * count
    yield [joints] * count
    yield [joints - n + 1] * count
    yield assortments(block)
    yield block.order.tolist()
    orbits = block.orbit.tolist()
    yield [_orbits(orbit) for orbit in orbits]
    yield [len(set(orbit)) for orbit in orbits]
    yield block.girth.tolist()
    yield (block.cuts != 0).astype(int).tolist()
    yield mobility_types(block)


def mobility_types(block: Block) -> list[str]:
    """Type of mobility of every chain: total, partial or fractionated."""
    from graphsynth.structure.graph import MechanismGraph

    count, n = block.orbit.shape
    if 3 * (n - 1) - 2 * block.joints.shape[1] == 1:
        return ["total"] * count
    return [MechanismGraph(n, [(a, b) for a, b in joints]).mobility_type for joints in block.joints.tolist()]


def assortments(block: Block) -> list[str]:
    """Numbers of links with 2, 3, ... joints of every chain, as text: '4-4'."""
    count, n = block.orbit.shape
    degrees = (block.joints.reshape(count, -1)[:, :, None] == np.arange(n)).sum(axis=1)
    kinds = (degrees[:, :, None] == np.arange(n)).sum(axis=1)
    return ["-".join(map(str, kind[2 : top + 1])) for kind, top in zip(kinds.tolist(), degrees.max(axis=1).tolist())]


def _lines(array: Bytes) -> list[bytes]:
    """Rows of an array as bytes."""
    data, width = np.ascontiguousarray(array).tobytes(), array.shape[1]
    return [data[at : at + width] for at in range(0, len(data), width)]


def chain_key(links: int, stream: bytes, flags: int = 0) -> str:
    """Write the bits of a canonical graph of revolute joints as its key."""
    return KEY_VERSION + urlsafe_b64encode(bytes((links, 3 | flags)) + stream).decode("ascii").rstrip("=")


def graph6_of(links: int, keys: Bytes) -> list[str]:
    """Write canonical graphs as graph6: the bits of the key, six to a letter."""
    size = links * (links - 1) // 2
    bits = np.zeros((len(keys), -(-size // 6) * 6), np.uint8)
    bits[:, :size] = np.unpackbits(keys, axis=1)[:, :size]
    letters = bits.reshape(len(keys), -1, 6) @ np.array([32, 16, 8, 4, 2, 1], np.uint8) + np.uint8(63)
    return [chr(links + 63) + line.decode("ascii") for line in _lines(letters)]


def _orbits(orbit: list[int]) -> str:
    """Write orbits as text: '0,1 2 3,4'."""
    members: dict[int, list[str]] = {}
    for link, low in enumerate(orbit):
        members.setdefault(low, []).append(str(link))
    return " ".join(",".join(links) for links in members.values())


def curves_of(
    joints: Collection[Sequence[int]], links: int, frame: int
) -> tuple[int, int, str, str] | tuple[None, None, None, None]:
    """Find the largest degree and genus of a coupler curve, and both of each link; None where they are not stored."""
    from graphsynth.structure.graph import MechanismGraph
    from graphsynth.structure.modes import coupler_curve_degree, coupler_curve_genus

    if links > _CURVES or 3 * (links - 1) - 2 * len(joints) != 1:
        return None, None, None, None
    mechanism = MechanismGraph(links, [(a, b) for a, b in joints], frame=frame)
    degrees, genera = (
        [0 if link == frame else count(mechanism, link) for link in range(links)]
        for count in (coupler_curve_degree, coupler_curve_genus)
    )
    return max(degrees), max(genera), " ".join(map(str, degrees)), " ".join(map(str, genera))


@lru_cache(maxsize=1 << 16)
def modes_of(key: str, links: int) -> int | None:
    """Count the assembly modes of a group of so many moving links; None for one that is too large."""
    from graphsynth.structure.graph import MechanismGraph
    from graphsynth.structure.modes import count_assembly_modes

    return count_assembly_modes(MechanismGraph.from_key(key)) if links <= _COUNTED else None


def modes_of_all(groups: Iterable[int | None]) -> int | None:
    """Multiply the assembly modes of the groups of a mechanism; None if those of one are not counted."""
    return prod(modes or 0 for modes in groups) or None


def contracted_of(block: Block, rows: Rows) -> list[int]:
    """Place of the contracted graph of every chain, in the order of first appearance."""
    known: dict[bytes, int] = {}
    lines = _lines(block.contracted)
    for line in dict.fromkeys(lines):
        shape = line[0], edges_text(line[0], line[1:])
        known[line] = rows.contracted.setdefault(shape, len(rows.contracted))
    return [known[line] for line in lines]


def edges_text(vertices: int, matrix: bytes) -> str:
    """Write a contracted graph as text: '0-1x2 0-2' for two parallel paths and one.

    >>> edges_text(2, bytes([0, 3, 3, 0]))
    '0-1x3'
    """
    places = [(p, q, matrix[p * vertices + q]) for p in range(vertices) for q in range(p, vertices)]
    return " ".join(f"{p}-{q}" + (f"x{times}" if times > 1 else "") for p, q, times in places if times)


def _mechanisms(block: Block, start: int, rows: Rows) -> None:
    """Append mechanisms, and the structures and groups they are the first to have."""
    chains, frames, drives, structures = mechanisms_of(block, rows)
    names = {mask: driven_text(mask) for mask in set(drives.tolist())}
    drivers = (names[mask] for mask in drives.tolist())
    rows.mechanisms += zip((start + chains).tolist(), frames.tolist(), drivers, structures.tolist(), strict=True)


def driven_text(mask: int) -> int | str:
    """Name driven links: a number, or text for several.

    >>> driven_text(2), driven_text(10)
    (1, '1,3')
    """
    from graphsynth.structure.connectivity import bits

    links = bits(mask)
    return links[0] if len(links) == 1 else ",".join(map(str, links))


def mechanisms_of(block: Block, rows: Rows) -> tuple[NDArray[np.int64], Bytes, NDArray[np.uint64], NDArray[np.int64]]:
    """Return chain, frame, mask of driven links and structure of each mechanism of a block.

    Structures and groups that are the first of their kind are appended to ``rows``.
    """
    filled = np.arange(block.frames.shape[1]) < block.mechanisms[:, None]
    chains = np.nonzero(filled)[0]
    if not len(chains):
        return chains, block.frames[filled], block.drives[filled], chains
    # a mechanism is described by the sizes and forms of its groups: distinct descriptions, numbered by appearance
    sizes, outers, forms = block.sizes[filled], block.outers[filled], block.forms[filled]
    whole = np.concatenate([sizes[:, :, None], np.where(sizes[:, :, None] > 0, forms, np.uint8(0))], axis=2)
    lines = np.frombuffer(whole.tobytes(), np.dtype((np.void, whole[0].size)))  # compared whole
    _, first, which = np.unique(lines, return_index=True, return_inverse=True)
    order = np.argsort(first)
    place = np.empty(len(order), np.int64)
    place[order] = _structures(sizes[first[order]], outers[first[order]], forms[first[order]], rows)
    return chains, block.frames[filled], block.drives[filled], place[which.ravel()]


def _structures(sizes: Bytes, outers: Bytes, forms: Bytes, rows: Rows) -> list[int]:
    """Place in ``rows.structures`` of each list of groups, added where it is new, as its groups are."""
    from graphsynth.atlas.kernels.facts import classes_of

    lists = [
        [(links, order, bytes(form)) for links, order, form in zip(*groups) if links]
        for groups in zip(sizes.tolist(), outers.tolist(), forms, strict=True)
    ]
    known = dict.fromkeys(group for groups in lists for group in groups)
    classes = np.zeros(len(known), np.int64)
    vertices = np.array([links + 1 for links, _, _ in known], np.int64)
    streams = np.frombuffer(b"".join(form for _, _, form in known), np.uint8).reshape(-1, forms.shape[2])
    classes_of(vertices, streams, classes)
    numbers: dict[tuple[int, int, bytes], int] = {}
    for (links, order, form), own in zip(known, classes.tolist(), strict=True):
        key = chain_key(links + 1, form[: _stream(links + 1)], _FRAMED)
        row = GroupRow(key, links, order, own, modes_of(key, links))
        numbers[links, order, form] = rows.groups.setdefault(row, len(rows.groups))
    places = (tuple(numbers[group] for group in groups) for groups in lists)
    return [rows.structures.setdefault(own, len(rows.structures)) for own in places]
