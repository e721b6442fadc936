"""Canonical labelling of mechanism graphs: canonical form, key, automorphism group, orbits.

The links of a mechanism are coloured by adjacency level, so that a canonical mechanism lists its links level by level
with the frame first; joints are coloured by mobility.  The search is :mod:`graphsynth.structure.search`; graphs of at
most 64 links go to the compiled copy of it once that is worth loading.  Both give the same results.
"""

from __future__ import annotations

from base64 import urlsafe_b64decode, urlsafe_b64encode
from binascii import Error as Base64Error
from dataclasses import dataclass
from itertools import combinations
from math import prod
from typing import TYPE_CHECKING, NamedTuple

from graphsynth.core.errors import FormatError
from graphsynth.core.wording import whole
from graphsynth.structure.connectivity import bits, breadth_first
from graphsynth.structure.search import CanonicalSearch, find_root, join_images
from graphsynth.structure.text import LINKS_MAX, pairs_of

if TYPE_CHECKING:
    from graphsynth.structure.graph import Joint, MechanismGraph

#: First character of every key.  It changes when any graph would get another key, and never otherwise.
KEY_VERSION = "1"

_KERNEL_LINKS_MAX = 64
#: Loading the compiled search costs as much as labelling a few hundred small graphs without it; compiling it, far more.
_GRAPHS_WORTH_THE_KERNEL = 300
_labelled_without_kernel = 0


@dataclass(frozen=True, slots=True)
class Labelling:
    """Result of one canonical labelling (exact)."""

    permutation: tuple[int, ...]  # canonical position of each link
    #: automorphisms, link to link, that generate the whole automorphism group; fewer than N
    generators: tuple[tuple[int, ...], ...]
    order: int  # order of the automorphism group
    orbits: tuple[int, ...]  # smallest link in the orbit of each link


def link_colours(graph: MechanismGraph) -> list[int]:
    """Return the colour of each link: its adjacency level in a mechanism, 0 in a chain.

    Links that cannot be reached from the frame share the first level that is not used.
    """
    if graph.frame is None:
        return [0] * graph.links
    levels = breadth_first(graph.neighbours, graph.frame)
    colours = [len(levels)] * graph.links
    for number, level in enumerate(levels):
        for link in bits(level):
            colours[link] = number
    return colours


def label(graph: MechanismGraph) -> Labelling:
    """Label a graph canonically.

    Raises `TooLargeError` for more than 64 links that are too symmetric (a hundred equal parts).

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> label(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (3, 0)])).order
    8
    """
    return label_coloured(graph, link_colours(graph))


def label_coloured(graph: MechanismGraph, colours: list[int]) -> Labelling:
    """Label a graph canonically whose links have the given colours; links are ordered by colour first."""
    global _labelled_without_kernel
    if graph.links <= _KERNEL_LINKS_MAX:
        if _labelled_without_kernel >= _GRAPHS_WORTH_THE_KERNEL:
            return _label(graph, colours, compiled=True)
        _labelled_without_kernel += 1
    return _label(graph, colours, compiled=False)


def _label(graph: MechanismGraph, colours: list[int], *, compiled: bool) -> Labelling:
    if compiled:
        import numpy as np

        from graphsynth.structure.kernels import canon_packed

        packed = np.frombuffer(graph.packed, dtype=np.uint8)
        found = canon_packed(graph.links, packed, np.array(colours, dtype=np.int64))
        order, generators, index, orbits = (part.tolist() for part in found)
    else:
        layers = [[0] * graph.links for _ in range(max(graph.packed[2::3], default=1))]
        for a, b, mobility in graph.joints:
            layers[mobility - 1][a] |= 1 << b
            layers[mobility - 1][b] |= 1 << a
        search = CanonicalSearch(graph.links, layers, colours, twins=graph.links > _KERNEL_LINKS_MAX).run()
        order, generators, index, orbits = search.order_of_vertices, search.generators, search.index, search.orbits
    permutation = [0] * graph.links
    for position, link in enumerate(order):
        permutation[link] = position
    return Labelling(tuple(permutation), tuple(map(tuple, generators)), prod(index), tuple(orbits))


def joint_orbits(graph: MechanismGraph) -> tuple[tuple[Joint, ...], ...]:
    """Return the orbits of joints under the automorphism group, in the order of their smallest joint.

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> [len(orbit) for orbit in joint_orbits(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (3, 0)]))]
    [4]
    """
    number = {(joint.a, joint.b): place for place, joint in enumerate(graph.joints)}
    parent = list(range(len(number)))
    for image in graph.labelling.generators:
        join_images(parent, [number[min(image[a], image[b]), max(image[a], image[b])] for a, b in number])
    orbits: dict[int, list[Joint]] = {}
    for place, joint in enumerate(graph.joints):
        orbits.setdefault(find_root(parent, place), []).append(joint)
    return tuple(tuple(orbit) for orbit in orbits.values())


class Roles(NamedTuple):
    """Roles of the links of a mechanism beside the frame."""

    drivers: tuple[int, ...]  # links driven at their joint with the frame, ascending
    outputs: tuple[int, ...]  # other links, ascending


def roles(graph: MechanismGraph, drivers: int = 1, outputs: int = 1) -> tuple[Roles, ...]:
    """Return the choices of so many drivers and outputs, one from each orbit under the automorphism group (exact).

    Raises `GraphError` without a frame, `SpecError` for numbers below 0.

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> roles(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0))
    (Roles(drivers=(1,), outputs=(2,)), Roles(drivers=(1,), outputs=(3,)))
    """
    near = [link for level in graph.levels[1:2] for link in level]
    moving = [link for link in range(graph.links) if link != graph.frame]
    choices = [
        Roles(driven, others)
        for driven in combinations(near, whole(drivers, "drivers", 0))
        for others in combinations([link for link in moving if link not in driven], whole(outputs, "outputs", 0))
    ]
    number = {choice: place for place, choice in enumerate(choices)}
    parent = list(range(len(number)))
    for image in graph.labelling.generators:
        moved = (Roles(*(tuple(sorted(image[link] for link in part)) for part in choice)) for choice in number)
        join_images(parent, [number[choice] for choice in moved])
    return tuple(choice for choice, place in number.items() if find_root(parent, place) == place)


def key(graph: MechanismGraph) -> str:
    """Return the canonical key: the version, then the canonical graph in base64url without padding.

    The bytes are: links; ``space + 8 (frame) + 16 (mobilities)``; the upper triangle of the adjacency matrix, column
    by column; and, when some joint has another mobility than 1, three bits ``mobility - 1`` per joint sorted by
    ``(a, b)``; zero bits fill the last byte.  A frame is link 0.

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> key(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (3, 0)]))
    '1BAN4'
    """
    return key_of(graph.canonical())


def key_of(graph: MechanismGraph) -> str:
    """Return the key of a graph that is canonical already."""
    packed = graph.packed
    coloured = any(mobility != 1 for mobility in packed[2::3])
    size = graph.links * (graph.links - 1) // 2
    total = size + (len(packed) if coloured else 0)
    stream = bytearray(-(-total // 8))
    for place in range(0, len(packed), 3):
        a, b = packed[place], packed[place + 1]
        bit = b * (b - 1) // 2 + a
        stream[bit >> 3] |= 128 >> (bit & 7)
        if coloured:
            for offset in range(3):
                if packed[place + 2] - 1 & 4 >> offset:
                    bit = size + place + offset
                    stream[bit >> 3] |= 128 >> (bit & 7)
    head = bytes((graph.links, graph.space | (graph.frame is not None) << 3 | coloured << 4))
    return KEY_VERSION + urlsafe_b64encode(head + stream).decode("ascii").rstrip("=")


def decode_key(text: object) -> tuple[int, list[tuple[int, int, int]], int | None, int]:
    """Return ``(links, joints, frame, space)`` of a key; whether they are canonical is not checked here.

    Raises `FormatError` for anything that no graph has as its key, as far as its form shows.

    >>> decode_key("1BAN4")
    (4, [(0, 2, 1), (0, 3, 1), (1, 2, 1), (1, 3, 1)], None, 3)
    """
    if not isinstance(text, str):
        raise FormatError(f"a key is a str, not {type(text).__name__}", "key")
    if len(text) > 25_000:
        raise FormatError(f"{len(text)} characters are more than the key of any graph", "key")
    if not text.startswith(KEY_VERSION):
        raise FormatError(f"a key of this version starts with {KEY_VERSION!r}", "key character 1")
    body = text[1:]
    try:
        data = urlsafe_b64decode(body + "=" * (-len(body) % 4))
    except (Base64Error, ValueError):
        raise FormatError("a key is base64url text without padding", "key") from None
    if len(data) < 2 or urlsafe_b64encode(data).decode("ascii").rstrip("=") != body:
        raise FormatError("a key is base64url text without padding, two bytes at least", "key")
    links, flags = data[0], data[1]
    space, framed, coloured = flags & 7, flags >> 3 & 1, flags >> 4 & 1
    if not 1 <= links <= LINKS_MAX or not 2 <= space <= 6 or flags >> 5:
        raise FormatError(f"header bytes {links}, {flags} do not describe a graph", "key character 2")
    size = links * (links - 1) // 2
    # One leading 1 keeps the zeros in front.
    stream = bin(int.from_bytes(b"\x01" + data[2:], "big"))[3:]
    pairs = pairs_of(stream[:size])
    total = size + (3 * len(pairs) if coloured else 0)
    if len(stream) != -(-total // 8) * 8 or "1" in stream[total:]:
        raise FormatError(f"the joints of {links} links are cut short, or bits follow their end", "key")
    if not coloured:
        return links, [(a, b, 1) for a, b in pairs], 0 if framed else None, space
    places = range(size, total, 3)
    joints = [(a, b, int(stream[p : p + 3], 2) + 1) for (a, b), p in zip(pairs, places, strict=True)]
    return links, joints, 0 if framed else None, space
