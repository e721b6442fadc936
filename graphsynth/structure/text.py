"""Graphs as text, graph6 and a one-line form of our own for coloured ones; graphs from joints and from networkx.

The one-line form is ``<graph6>`` followed by space-separated fields, in this order and each only when needed:
``f<frame>``; ``<mobility>:<a>-<b>,<a>-<b>`` for each joint mobility of 2 and more, ascending; ``pi<space>`` when the
space is not 3.  Example: ``C] f0 2:0-2``.

Readers accept any text or bytes and raise nothing but :class:`~graphsynth.core.errors.FormatError`; their time and
memory are bounded by the length of the input, and an input longer than any valid graph is refused before it is read.

Source of graph6: B. D. McKay, *Description of graph6, sparse6 and digraph6 encodings* (formats.txt of nauty).
"""

from __future__ import annotations

import operator
import re
from collections.abc import Iterable
from math import isqrt
from typing import Any

from graphsynth.core.errors import FormatError

#: Joints are packed as three bytes, so a link number is at most 254.
LINKS_MAX = 255

_HEADER = ">>graph6<<"
#: Longer than the text of the complete graph on 255 links with every joint listed by name.
_LENGTH_MAX = 400_000
_FIELD = re.compile(r"f(?P<frame>[0-9]{1,3})|(?P<mobility>[2-5]):(?P<joints>.+)|pi(?P<space>[2-6])")
_JOINT = re.compile(r"([0-9]{1,3})-([0-9]{1,3})")


def encode_graph6(links: int, packed: bytes) -> str:
    """Write a graph as graph6; joint mobilities are not written.

    ``links``: number of links, 1 to 255; ``packed``: three bytes ``a, b, mobility`` per joint, ``a < b``. Returns
    printable ASCII, without a header or a line end.

    >>> encode_graph6(4, bytes([0, 1, 1, 0, 3, 1, 1, 2, 1, 2, 3, 1]))
    'Cl'
    """
    size = links * (links - 1) // 2
    chunks = bytearray(-(-size // 6))
    for place in range(0, len(packed), 3):
        a, b = packed[place], packed[place + 1]
        bit = b * (b - 1) // 2 + a
        chunks[bit // 6] |= 32 >> bit % 6
    head = [links] if links <= 62 else [63, links >> 12, links >> 6 & 63, links & 63]
    return bytes(value + 63 for value in (*head, *chunks)).decode("ascii")


def decode_graph6(text: str | bytes) -> tuple[int, bytes]:
    r"""Read graph6.

    The optional header ``>>graph6<<`` and one line end are accepted.  Returns the number of links, and the joints of
    mobility 1, three bytes each, sorted by ``(a, b)``.  Raises `FormatError` for anything else, with the byte where
    reading stopped.

    >>> decode_graph6("Bw")
    (3, b'\x00\x01\x01\x00\x02\x01\x01\x02\x01')
    """
    line = _ascii(text)
    line = line.removesuffix("\n").removesuffix("\r")
    start = len(_HEADER) if line.startswith(_HEADER) else 0
    if line[start : start + 1] in (":", ";", "&"):
        raise FormatError(
            f"{line[start]!r} starts sparse6 or digraph6; convert the file to graph6 first", f"byte {start}"
        )
    values = [ord(letter) - 63 for letter in line[start:]]
    for index, value in enumerate(values):
        if not 0 <= value <= 63:
            raise FormatError(
                f"byte value {value + 63} is not graph6, whose bytes are 63 to 126", f"byte {start + index}"
            )
    if not values:
        raise FormatError("empty text; graph6 starts with the number of links", f"byte {start}")
    links, used = values[0], 1
    if links == 63:
        used = 8 if values[1:2] == [63] else 4
        digits = values[used // 4 : used]
        if len(digits) < (6 if used == 8 else 3):
            raise FormatError("the number of links is cut short", f"byte {start + len(values)}")
        links = 0
        for digit in digits:
            links = links << 6 | digit
    if not 1 <= links <= LINKS_MAX:
        raise FormatError(f"{links} links; a mechanism graph has 1 to {LINKS_MAX}", f"byte {start}")
    values, start = values[used:], start + used
    size = links * (links - 1) // 2
    expected = -(-size // 6)
    if len(values) != expected:
        what = "is cut short" if len(values) < expected else "goes on after its end"
        raise FormatError(
            f"the text {what}: {links} links need {expected} bytes of joints, not {len(values)}",
            f"byte {start + min(len(values), expected)}",
        )
    bits = "".join(f"{value:06b}" for value in values)
    if "1" in bits[size:]:
        raise FormatError("the last byte has bits after the last pair of links", f"byte {start + len(values) - 1}")
    return links, b"".join(bytes((a, b, 1)) for a, b in pairs_of(bits))


def pairs_of(bits: str) -> list[tuple[int, int]]:
    """Return the sorted pairs a < b with digit 1 in the upper triangle of an adjacency matrix, column by column."""
    pairs = []
    bit = bits.find("1")
    while bit >= 0:
        b = (1 + isqrt(1 + 8 * bit)) // 2
        pairs.append((bit - b * (b - 1) // 2, b))
        bit = bits.find("1", bit + 1)
    return sorted(pairs)


def _ascii(text: object) -> str:
    """Return the input as a str of ASCII characters, refusing what cannot be a graph at once."""
    if not isinstance(text, str | bytes | bytearray):
        raise FormatError(f"a graph is read from str or bytes, not from {type(text).__name__}", "input")
    if len(text) > _LENGTH_MAX:
        raise FormatError(
            f"{len(text)} characters; no graph of {LINKS_MAX} links needs more than {_LENGTH_MAX}", "input"
        )
    line = text if isinstance(text, str) else bytes(text).decode("latin-1")
    if not line.isascii():
        index = next(i for i, letter in enumerate(line) if ord(letter) > 127)
        raise FormatError(f"character {line[index]!r} is not ASCII", f"byte {index}")
    return line


def encode_text(links: int, packed: bytes, frame: int | None, space: int) -> str:
    """Write a coloured graph as one line.

    >>> encode_text(3, bytes([0, 1, 1, 0, 2, 1, 1, 2, 2]), 0, 3)
    'Bw f0 2:1-2'
    """
    fields = [encode_graph6(links, packed)]
    if frame is not None:
        fields.append(f"f{frame}")
    by_mobility: dict[int, list[str]] = {}
    for place in range(0, len(packed), 3):
        a, b, mobility = packed[place : place + 3]
        if mobility > 1:
            by_mobility.setdefault(mobility, []).append(f"{a}-{b}")
    fields += [f"{mobility}:{','.join(pairs)}" for mobility, pairs in sorted(by_mobility.items())]
    if space != 3:
        fields.append(f"pi{space}")
    return " ".join(fields)


def decode_text(text: str | bytes) -> tuple[int, list[tuple[int, int, int]], int | None, int]:
    """Read the one-line form.

    Returns the links, the joints as (a, b, mobility), the frame, and the space.  Raises `FormatError` for anything
    that is not the one-line form, with the field where reading stopped.

    >>> decode_text("Bw f0 2:1-2")
    (3, [(0, 1, 1), (0, 2, 1), (1, 2, 2)], 0, 3)
    """
    fields = _ascii(text).split()
    if not fields:
        raise FormatError("empty text; a graph starts with its graph6 form", "field 1")
    links, packed = decode_graph6(fields[0])
    mobility = {(packed[i], packed[i + 1]): packed[i + 2] for i in range(0, len(packed), 3)}
    frame: int | None = None
    space = 3
    last = (0, 0)  # (kind of field, mobility): must increase from field to field
    for index, field in enumerate(fields[1:], start=2):
        place = f"field {index}"
        match = _FIELD.fullmatch(field)
        if not match:
            known = "f<frame>, <mobility 2 to 5>:<a>-<b>,... and pi<space 2 to 6>"
            raise FormatError(f"{_shown(field)} is none of {known}", place)
        kind = (1, 0) if match["frame"] else (2, int(match["mobility"])) if match["mobility"] else (3, 0)
        if kind <= last:
            raise FormatError(f"{_shown(field)} is out of order; the order is f, mobilities ascending, pi", place)
        last = kind
        frame = int(match["frame"]) if match["frame"] else frame
        space = int(match["space"]) if match["space"] else space
        for item in match["joints"].split(",") if match["joints"] else ():
            ends = _JOINT.fullmatch(item)
            if not ends:
                raise FormatError(f"{_shown(item)} is not a joint; write <link>-<link>", place)
            pair = (min(int(ends[1]), int(ends[2])), max(int(ends[1]), int(ends[2])))
            if pair not in mobility:
                raise FormatError(f"{_shown(item)} is not a joint of the graph6 part", place)
            if mobility[pair] != 1:
                raise FormatError(f"the mobility of joint {_shown(item)} is given twice", place)
            mobility[pair] = kind[1]
    return links, [(a, b, m) for (a, b), m in mobility.items()], frame, space


def _shown(text: str) -> str:
    """Return a short quotation fit for a message."""
    return repr(text if len(text) <= 24 else text[:21] + "...")


def from_networkx(graph: Any) -> tuple[int, list[tuple[int, int, Any]], Any, Any]:
    """Return ``(links, joints, frame, space)`` of a ``networkx.Graph``, still to be checked by the constructor.

    Raises `FormatError` if it is no undirected simple graph, has too many nodes, or names a frame that is not one of
    them.
    """
    import networkx

    if not isinstance(graph, networkx.Graph):
        raise FormatError(f"expected a networkx.Graph, not {type(graph).__name__}", "graph")
    if graph.is_directed() or graph.is_multigraph():
        raise FormatError("a mechanism graph is undirected and simple; convert with networkx.Graph(...)", "graph")
    links = len(graph)
    if not 1 <= links <= LINKS_MAX:
        raise FormatError(f"{links} nodes; a mechanism graph has 1 to {LINKS_MAX} links", "graph")
    number = {node: place for place, node in enumerate(graph)}
    if all(type(node) is int and 0 <= node < links for node in graph):  # these keep their number
        number = {node: node for node in graph}
    joints = [(number[a], number[b], data.get("mobility", 1)) for a, b, data in graph.edges(data=True)]
    frame = graph.graph.get("frame")
    if frame is not None:
        try:
            frame = number[frame]
        except (KeyError, TypeError):
            raise FormatError("the graph attribute 'frame' is not a node of the graph", "frame") from None
    return links, joints, frame, graph.graph.get("space", 3)


def integer(value: object, place: str, low: int, high: int, what: str) -> int:
    """Return a plain int within its bounds or raise FormatError."""
    try:
        number = operator.index(value)  # type: ignore[arg-type]
    except Exception:  # whatever a foreign __index__ raises
        raise FormatError(f"the {what} must be an integer, not {type(value).__name__}", place) from None
    if not low <= number <= high:
        shown = number if abs(number) < 10**18 else "a number of many digits"
        raise FormatError(f"the {what} must be within {low} to {high}, not {shown}", place)
    return number


def packed_joints(links: int, joints: Iterable[Any], space: int) -> bytes:
    """Return valid joints packed and sorted."""
    found: dict[tuple[int, int], bytes] = {}
    try:
        items = iter(joints)
    except TypeError:
        raise FormatError(f"joints must be pairs of links, not {type(joints).__name__}", "joints") from None
    for count, item in enumerate(items, start=1):
        place = f"joint {count}"
        try:
            a, b, *rest = item
        except (TypeError, ValueError):
            raise FormatError("a joint is (a, b) or (a, b, mobility)", place) from None
        if len(rest) > 1:
            raise FormatError(f"a joint is (a, b) or (a, b, mobility), not {len(rest) + 2} values", place)
        a = integer(a, place, 0, links - 1, "number of a link")
        b = integer(b, place, 0, links - 1, "number of a link")
        mobility = integer(rest[0], place, 1, space - 1, "mobility of a joint") if rest else 1
        if a == b:
            raise FormatError(f"link {a} is jointed to itself", place)
        a, b = min(a, b), max(a, b)
        if (a, b) in found:
            raise FormatError(f"links {a} and {b} are jointed twice; merge the two joints or add a link", place)
        found[a, b] = bytes((a, b, mobility))
    return b"".join(sorted(found.values()))
