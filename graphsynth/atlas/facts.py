"""Structural facts of chains, computed in blocks by the kernels, as arrays and as rows for the store."""

from __future__ import annotations

from base64 import urlsafe_b64encode
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from math import comb
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import TooLargeError
from graphsynth.structure.canonical import KEY_VERSION

if TYPE_CHECKING:
    from graphsynth.atlas.kernels.facts import Block

Bytes = NDArray[np.uint8]

_FRAMED = 8  # flag in the second byte of a key


@dataclass(frozen=True, slots=True)
class GroupRow:
    """A structural group: key with the base as frame, moving links, order, class."""

    key: str
    links: int
    order: int
    group_class: int


@dataclass(slots=True)
class Rows:
    """Rows of some chains for the store, without the numbers that only the store can give."""

    #: ``(key, graph6, links, joints, loops, assortment, automorphisms, link_orbits, inversions, girth, fractionated,
    #: contracted)``; ``contracted`` is an index into the next list
    chains: list[tuple[Any, ...]] = field(default_factory=list)
    contracted: list[tuple[int, str]] = field(default_factory=list)  # list of (vertices, edges)
    #: list of (chain, key of the parent): chains as indices into ``chains``, here and below
    dyads: list[tuple[int, str]] = field(default_factory=list)
    #: list of (chain, frame, joints of the frame, levels)
    inversions: list[tuple[int, int, int, str]] = field(default_factory=list)
    #: list of (chain, frame, driver, structure): ``driver`` is a link, or text such as ``'1,3'`` for several;
    #: ``structure`` an index into the next list
    mechanisms: list[tuple[int, int, int | str, int]] = field(default_factory=list)
    #: groups in the order of assembly, as indices into ``groups``
    structures: list[tuple[int, ...]] = field(default_factory=list)
    groups: list[GroupRow] = field(default_factory=list)


def _stream(links: int) -> int:
    """Bytes of the upper triangle of an adjacency matrix."""
    return (links * (links - 1) // 2 + 7) // 8


def analyse_block(links: int, mobility: int, packed: Bytes) -> Block:
    """Compute the facts of a block of planar chains with mobility-1 joints (exact).

    ``packed`` uint8, shape (chains, 3 joints): joints ``a, b, 1``, as the enumerator packs them. Raises
    `TooLargeError` for more links than the kernels are laid out for.
    """
    from graphsynth.atlas.kernels.facts import MOST_LINKS, WORDS, Block, analyse

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
        forms=np.zeros((chains, room, half, WORDS), np.uint64),
        parents=np.zeros((chains, half, _stream(links) + 1), np.uint8),
        contracted=np.zeros((chains, 1 + links * links), np.uint8),
    )
    analyse(links, mobility, packed, block)
    return block


def rows_of(block: Block, rows: Rows) -> None:
    """Append the rows of a block; what is in ``rows`` already keeps its place."""
    start = len(rows.chains)
    contracted = _contracted(block, rows)
    rows.chains += [(*fact, shape) for fact, shape in zip(zip(*_columns(block)), contracted)]
    for c, orbit in enumerate(block.orbit.tolist()):
        own = sorted(set(orbit))
        levels = block.levels[c].tolist()
        rows.inversions += [
            (start + c, frame, levels[frame][1], "-".join(str(size) for size in levels[frame] if size)) for frame in own
        ]
    _dyads(block, start, rows)
    _mechanisms(block, start, rows)


def _columns(block: Block) -> Iterator[Iterable[Any]]:
    """Columns of the chains, without the last one."""
    count, n = block.orbit.shape
    joints = block.joints.shape[1]
    yield [_key(n, stream) for stream in _lines(block.keys)]
    yield _graph6(n, block.keys)
    yield [n] * count
    yield [joints] * count
    yield [joints - n + 1] * count
    degrees = (block.joints.reshape(count, -1)[:, :, None] == np.arange(n)).sum(axis=1)
    kinds = (degrees[:, :, None] == np.arange(n)).sum(axis=1)
    yield ["-".join(map(str, kind[2 : top + 1])) for kind, top in zip(kinds.tolist(), degrees.max(axis=1).tolist())]
    yield block.order.tolist()
    orbits = block.orbit.tolist()
    yield [_orbits(orbit) for orbit in orbits]
    yield [len(set(orbit)) for orbit in orbits]
    yield block.girth.tolist()
    yield (block.cuts != 0).astype(int).tolist()


def _lines(array: Bytes) -> list[bytes]:
    """Rows of an array as bytes."""
    data, width = np.ascontiguousarray(array).tobytes(), array.shape[1]
    return [data[at : at + width] for at in range(0, len(data), width)]


def _key(links: int, stream: bytes, flags: int = 0) -> str:
    return KEY_VERSION + urlsafe_b64encode(bytes((links, 3 | flags)) + stream).decode("ascii").rstrip("=")


def _graph6(links: int, keys: Bytes) -> list[str]:
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


def _contracted(block: Block, rows: Rows) -> list[int]:
    """Index of the contracted graph of every chain, in the order of first appearance."""
    place = {shape: at for at, shape in enumerate(rows.contracted)}
    known: dict[bytes, int] = {}
    found = []
    for line in _lines(block.contracted):
        if line not in known:
            vertices = line[0]
            shape = vertices, edges_text(vertices, line[1 : 1 + vertices * vertices])
            known[line] = place.setdefault(shape, len(place))
            if known[line] == len(rows.contracted):
                rows.contracted.append(shape)
        found.append(known[line])
    return found


def edges_text(vertices: int, matrix: bytes) -> str:
    """Write a contracted graph as text: '0-1x2 0-2' for two parallel paths and one.

    >>> edges_text(2, bytes([0, 3, 3, 0]))
    '0-1x3'
    """
    found = []
    for p in range(vertices):
        for q in range(p, vertices):
            times = matrix[p * vertices + q]
            if times:
                found.append(f"{p}-{q}" + (f"x{times}" if times > 1 else ""))
    return " ".join(found)


def _dyads(block: Block, start: int, rows: Rows) -> None:
    n = block.orbit.shape[1]
    own = _stream(n - 2)
    chains, places = np.nonzero(block.parents[:, :, 0])
    streams = _lines(block.parents[chains, places, 1 : 1 + own]) if len(chains) else []
    rows.dyads += sorted({(start + c, _key(n - 2, stream)) for c, stream in zip(chains.tolist(), streams)})


def _mechanisms(block: Block, start: int, rows: Rows) -> None:
    """Append mechanisms, and the structures and groups they are the first to have."""
    filled = np.arange(block.frames.shape[1]) < block.mechanisms[:, None]
    chains = np.nonzero(filled)[0]
    if not len(chains):
        return
    frames, drives = block.frames[filled].tolist(), block.drives[filled]
    sizes, forms = block.sizes[filled], block.forms[filled]
    # a mechanism is described by the sizes and forms of its groups: distinct descriptions, numbered by appearance
    whole = np.zeros((*sizes.shape, 1 + forms.shape[2]), np.uint64)
    whole[:, :, 0] = sizes
    whole[:, :, 1:] = np.where(sizes[:, :, None] > 0, forms, np.uint64(0))
    _, first, which = np.unique(_as_words(whole.reshape(len(whole), -1)), return_index=True, return_inverse=True)
    order = np.argsort(first)
    place = np.empty(len(order), np.int64)
    place[order] = _structures(block, rows, np.nonzero(filled), first[order])
    rows.mechanisms += zip(
        (start + chains).tolist(), frames, _drivers(drives), place[which.ravel()].tolist(), strict=True
    )


def _as_words(array: NDArray[np.uint64]) -> NDArray[np.void]:
    """Rows of an array as one item each, so that they can be compared whole."""
    return np.ascontiguousarray(array).view(np.dtype((np.void, array.shape[1] * array.itemsize))).ravel()


def _drivers(drives: NDArray[np.uint64]) -> list[int | str]:
    """Driven links of each mechanism: a number, or text for several."""
    from graphsynth.structure.connectivity import bits

    names: dict[int, int | str] = {}
    for mask in np.unique(drives).tolist():
        links = bits(mask)
        names[mask] = links[0] if len(links) == 1 else ",".join(map(str, links))
    return [names[mask] for mask in drives.tolist()]


def _structures(block: Block, rows: Rows, where: tuple[NDArray[Any], ...], wanted: NDArray[np.int64]) -> list[int]:
    """Index in ``rows.structures`` of the mechanisms ``wanted``, appended where they are new."""
    at = where[0][wanted], where[1][wanted]
    sizes, outers, forms = block.sizes[at], block.outers[at], block.forms[at]
    lists = []
    for size, outer, form in zip(sizes.tolist(), outers.tolist(), forms.tolist()):
        lists.append(
            [
                (links, sum(word << 64 * at for at, word in enumerate(words)), order)
                for links, order, words in zip(size, outer, form)
                if links
            ]
        )
    known = _groups(rows, dict.fromkeys(group for groups in lists for group in groups))
    place = {groups: number for number, groups in enumerate(rows.structures)}
    found = []
    for groups in lists:
        own = tuple(known[group] for group in groups)
        number = place.setdefault(own, len(place))
        if number == len(rows.structures):
            rows.structures.append(own)
        found.append(number)
    return found


def _groups(rows: Rows, forms: Iterable[tuple[int, int, int]]) -> dict[tuple[int, int, int], int]:
    """Index in ``rows.groups`` of groups ``(links, form, order)``, appended where they are new."""
    from graphsynth.atlas.kernels.facts import WORDS, classes_of

    forms = list(forms)
    words = np.array(
        [[bits >> 64 * at & (1 << 64) - 1 for at in range(WORDS)] for _, bits, _ in forms], np.uint64
    ).reshape(-1, WORDS)
    classes = np.zeros(len(forms), np.int64)
    classes_of(np.array([links + 1 for links, _, _ in forms], np.int64), words, classes)
    place = {group.key: number for number, group in enumerate(rows.groups)}
    found = {}
    for (links, bits, order), own in zip(forms, classes.tolist()):
        row = GroupRow(_group_key(links, bits), links, order, own)
        number = found[links, bits, order] = place.setdefault(row.key, len(place))
        if number == len(rows.groups):
            rows.groups.append(row)
    return found


def _group_key(links: int, form: int) -> str:
    """Key of a group from its canonical form: the same bits, the first in the highest place of a byte."""
    size = (links + 1) * links // 2
    width = -(-size // 8) * 8
    stream = int(f"{form:0{size}b}"[::-1].ljust(width, "0"), 2).to_bytes(width // 8, "big")
    return _key(links + 1, stream, _FRAMED)
